/* One patch of degree 7 a facet.   [Kolb, Pottmann, Seidel 1995, section 6]
 *
 * Along an edge with curve C (degree 5) and field d (degree 3) the derivative R towards the facet's third corner is
 * set to k d + h C', k cubic, h linear: degree 6, a row of control points of a patch of degree 7. Both facets of an
 * edge derive in the planes of d and C' then, whatever k and h they have: G1. k and h at a corner follow from the
 * other edge's tangent there, and k' from the twist, the mixed derivative along both edges of the corner: R' at a
 * corner is the twist less C', for each of the two edges. Of it
 *   tau - h s - (1 + h') t   must be a multiple, k', of d
 * in the tangent plane (t, s: first and second derivative of the edge's curve): one linear condition from each edge
 * on the two components of tau. The component across is settled by the second fundamental form, and agrees for both
 * edges since their curves share it. The twist gives b_511, b_151, b_115; the products the rest of the rows beside
 * the edges. Three interior points remain. */
#include <stdbool.h>

#include "basis/bezier.h"
#include "network/fill.h"

/* 36 values, rows of c = 0, 1, ..., b runs. */
const signed char net_degree7_weights[36] = {-10, 8,  -12, -4, -4, 0, -6, 0, 8,  39, -6, 17, 30, 3, 0, -12, -6, 0,
                                             0,   -6, 0,   -4, 17, 0, -3, 0, -4, 30, -6, 0,  0,  3, 0, -6,  0,  0};

/* Of the edge's length: the normals of the two sides of an edge would differ by a few times this, radians. Rounding
 * gives some 1e-15, more at very sharp corners; curves that do not have the curvature of the corner's form, far more.
 */
static const double MISS_MOST = 1e-12;

/* Weights over 409024 with which the points count for b_322 in the least integral of the fourth derivatives' squares
 * over an equilateral triangle. That completes every cubic exactly, where second derivatives' squares do so for
 * planes alone: K strays less. */
static const int fourth_weights[36] = {1636,  -4998,  -25020, -5217, -51494, -6771, -3304,  1174,  -4998,
                                       66028, 19847,  188876, 98233, -11434, -994,  -25020, 19847, 0,
                                       0,     -70936, 3239,   -5217, 188876, 0,     59824,  9567,  -51494,
                                       98233, -70936, 9567,   -6771, -11434, 3239,  -3304,  -994,  1174};

/* An edge at one of its corners, in the corner's tangent plane: t away from the corner, d into the facet. */
typedef struct side {
  double t[2], s[2], d[2];
  double k, h; /* the other edge's t = k d + h t */
} side;

static double det(const double *a, const double *b) { return a[0] * b[1] - a[1] * b[0]; }

static void to_plane(const net_node *node, const double *a, double *out) {
  out[0] = vec_dot(a, node->u);
  out[1] = vec_dot(a, node->v);
}

/* c0, c1, c2: the control points from the corner on. */
static void side_make(const net_node *node, const double *c0, const double *c1, const double *c2, const double *d,
                      side *out) {
  double t[3], s[3];
  for (int x = 0; x < 3; x++) {
    t[x] = 5 * (c1[x] - c0[x]);
    s[x] = 20 * ((c2[x] - c1[x]) - (c1[x] - c0[x]));
  }
  to_plane(node, t, out->t);
  to_plane(node, s, out->s);
  to_plane(node, d, out->d);
}

static void side_cross(side *one, const side *other) {
  double area = det(one->d, one->t);
  one->k = det(other->t, one->t) / area;
  one->h = det(one->d, other->t) / area;
}

/* The twist of the corner, and the derivatives of k there, inward, along edge a, which leaves, and b, which arrives:
 * h_a, h_b are the derivatives of h along the runs of the two. */
static void corner_twist(const net_node *node, const side *a, const side *b, double h_a, double h_b, double *twist,
                         double *k_a, double *k_b) {
  double from_a[2], from_b[2], apart[2], tau[2];
  for (int x = 0; x < 2; x++) {
    from_a[x] = a->h * a->s[x] + (1 + h_a) * a->t[x];
    from_b[x] = b->h * b->s[x] + (1 + h_b) * b->t[x];
    apart[x] = from_b[x] - from_a[x];
  }
  double area = det(b->d, a->d);
  *k_a = det(b->d, apart) / area;
  *k_b = det(a->d, apart) / area;
  for (int x = 0; x < 2; x++) tau[x] = from_a[x] + *k_a * a->d[x];
  const double *p = node->x, *t = a->t, *l = b->t;
  double up =
      p[0] * tau[0] + p[1] * tau[1] + p[2] * t[0] * l[0] + p[3] * (t[0] * l[1] + t[1] * l[0]) + p[4] * t[1] * l[1];
  for (int x = 0; x < 3; x++) twist[x] = tau[0] * node->u[x] + tau[1] * node->v[x] + up * node->w[x];
}

/* Place of point m of row `row` beside edge k. */
static unsigned place(unsigned k, unsigned m, unsigned row) {
  unsigned j = k == 0 ? m : k == 1 ? 7 - row - m : row, c = k == 0 ? row : k == 1 ? m : 7 - row - m;
  return c * 8 - c * (c - 1) / 2 + j;
}

/* Points 2, 3, 4 of the row beside the edge. Points 1 and 5 are there from the twists; how far off they are from what
 * the row asks for. */
static double row_fill(unsigned k, const net_ribbon *ribbon, const net_across *across, double (*out)[3]) {
  double curve[7][3], rate[5][3], slide[6][3], slides[7][3], turn[7][3];
  bezier_elevate(5, 3, ribbon->c[0], curve[0]);
  bezier_difference(5, 3, ribbon->c[0], rate[0]);
  bezier_multiply(1, across->h, 4, 3, rate[0], slide[0]);
  bezier_elevate(5, 3, slide[0], slides[0]);
  bezier_multiply(3, across->k, 3, 3, ribbon->d[0], turn[0]);
  for (unsigned m = 1; m < 6; m++)
    for (int x = 0; x < 3; x++) curve[m][x] += (turn[m][x] + 5 * slides[m][x]) / 7;
  for (unsigned m = 2; m < 5; m++)
    for (int x = 0; x < 3; x++) out[place(k, m, 1)][x] = curve[m][x];
  return fmax(vec_distance(curve[1], out[place(k, 1, 1)]), vec_distance(curve[5], out[place(k, 5, 1)]));
}

void net_degree7_frame(const net_node *nodes, const net_ribbon *ribbons, double (*out)[3], net_across *across) {
  side leave[3], arrive[3]; /* by corner */
  net_across own[3];
  if (!across) across = own;
  for (unsigned i = 0; i < 3; i++) {
    const net_ribbon *a = &ribbons[i], *b = &ribbons[(i + 2) % 3];
    side_make(&nodes[i], a->c[0], a->c[1], a->c[2], a->d[0], &leave[i]);
    side_make(&nodes[i], b->c[5], b->c[4], b->c[3], b->d[3], &arrive[i]);
    side_cross(&leave[i], &arrive[i]);
    side_cross(&arrive[i], &leave[i]);
    across[i].k[0] = leave[i].k;
    across[i].h[0] = leave[i].h;
    across[(i + 2) % 3].k[3] = arrive[i].k;
    across[(i + 2) % 3].h[1] = -arrive[i].h;
  }
  for (unsigned i = 0; i < 3; i++) {
    net_across *a = &across[i], *b = &across[(i + 2) % 3];
    double twist[3], k_a, k_b;
    corner_twist(&nodes[i], &leave[i], &arrive[i], a->h[1] - a->h[0], b->h[1] - b->h[0], twist, &k_a, &k_b);
    a->k[1] = a->k[0] + k_a / 3;
    b->k[2] = b->k[3] + k_b / 3;
    double *to = out[place(i, 1, 1)];
    for (int x = 0; x < 3; x++) {
      double corner = ribbons[i].c[0][x];
      double t = 5 * (ribbons[i].c[1][x] - corner), l = 5 * (ribbons[(i + 2) % 3].c[4][x] - corner);
      to[x] = corner + (t + l) / 7 + twist[x] / 42;
    }
  }
  for (unsigned k = 0; k < 3; k++) {
    double six[7][3], seven[8][3];
    bezier_elevate(5, 3, ribbons[k].c[0], six[0]);
    bezier_elevate(6, 3, six[0], seven[0]);
    for (unsigned m = 0; m < 7; m++)
      for (int x = 0; x < 3; x++) out[place(k, m, 0)][x] = seven[m][x];
    across[k].miss = row_fill(k, &ribbons[k], &across[k], out);
  }
}

/* The three interior points from weights of all points for b_322, times total. */
static inline void interior_make(const int *weights, double total, double (*net)[3]) {
  double sum[3][3] = {{0}};
  for (unsigned c = 0, n = 0; c <= 7; c++)
    for (unsigned b = 0; b + c <= 7; b++, n++) {
      double weight = weights[n];
      unsigned a = 7 - b - c;
      const double *from[3] = {net[n], net[b * 8 - b * (b - 1) / 2 + a], net[a * 8 - a * (a - 1) / 2 + c]};
      if (weight == 0) continue; /* the interior points themselves may be anything */
      for (int i = 0; i < 3; i++)
        for (int x = 0; x < 3; x++) sum[i][x] += weight * from[i][x];
    }
  for (int i = 0; i < 3; i++)
    for (int x = 0; x < 3; x++) net[NET_DEGREE7_INTERIOR[i]][x] = sum[i][x] / total;
}

void net_degree7_interior(double (*net)[3]) {
  int weights[36];
  for (int n = 0; n < 36; n++) weights[n] = net_degree7_weights[n];
  interior_make(weights, 66, net);
}

/* True when all coefficients [count][3] have a part of more than `least` of the largest one's length along their
 * sum. */
static bool one_side(unsigned count, const double (*c)[3], double least) {
  double sum[3] = {0, 0, 0}, largest = 0;
  for (unsigned k = 0; k < count; k++) {
    for (int x = 0; x < 3; x++) sum[x] += c[k][x];
    largest = fmax(largest, vec_dot(c[k], c[k]));
  }
  double bound = least * sqrt(largest * vec_dot(sum, sum));
  bool ok = bound > 0;
  for (unsigned k = 0; k < count; k++) ok = ok && vec_dot(c[k], sum) > bound;
  return ok;
}

bool net_across_regular(unsigned n, const double *k, const net_ribbon *ribbon) {
  enum { PIECES = 8 };
  double rest[8][3], part[8][3], after[8][3], rate[5][3], k_rest[4], k_part[4], k_after[4], mean = 0;
  bezier_difference(5, 3, ribbon->c[0], rate[0]);
  bezier_cross(4, rate[0], 3, ribbon->d[0], rest[0]);
  bool whole = one_side(8, (const double(*)[3])rest, 1e-3);
  for (unsigned i = 0; i <= n; i++) {
    mean += k[i] / (n + 1);
    k_rest[i] = k[i];
  }
  for (unsigned i = 0; i <= n; i++) whole = whole && k[i] > 1e-3 * mean;
  if (whole && mean > 0) return true;
  if (!(mean > 0)) return false;
  for (unsigned piece = 0; piece < PIECES; piece++) {
    double t = 1.0 / (PIECES - piece);
    bezier_split(7, 3, rest[0], t, part[0], after[0]);
    bezier_split(n, 1, k_rest, t, k_part, k_after);
    if (!one_side(8, (const double(*)[3])part, 1e-3)) return false;
    for (unsigned i = 0; i <= n; i++)
      if (!(k_part[i] > 1e-3 * mean)) return false;
    for (unsigned i = 0; i < 8; i++)
      for (int x = 0; x < 3; x++) rest[i][x] = after[i][x];
    for (unsigned i = 0; i <= n; i++) k_rest[i] = k_after[i];
  }
  return true;
}

/* k must stay above this part of its mean: three patches of degree 6 are fairer where it comes near 0. */
static const double K_LEAST = 0.1;

bool net_fill_degree7(const net_node *nodes, const net_ribbon *ribbons, double (*out)[3]) {
  net_across across[3];
  net_degree7_frame(nodes, ribbons, out, across);
  interior_make(fourth_weights, 409024, out);
  bool good = true;
  for (unsigned i = 0; i < 3; i++) {
    const double *k = across[i].k, spare = K_LEAST * (k[0] + k[1] + k[2] + k[3]) / 4;
    const double above[4] = {k[0] - spare, k[1] - spare, k[2] - spare, k[3] - spare};
    double length = vec_distance(ribbons[i].c[0], ribbons[i].c[5]);
    good = good && across[i].miss <= MISS_MOST * length && net_across_regular(3, above, &ribbons[i]);
  }
  return good;
}
