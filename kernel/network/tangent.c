/* Local parameters of edges [Kolb, Pottmann, Seidel 1995, section 3.1]: direction and length of the derivative that a
 * curve has at its ends before the surface's slope is added.
 *
 * L3 and L4 are lengths 3 l of the derivatives of a cubic from V_i to V_j with unit tangents d_i, d_j (outgoing) and
 * given normal curvatures k_i, k_j. Its second derivative at V_i is 6 (E + l_j d_j - 2 l_i d_i), the square of its
 * first 9 l_i^2; times the normal w_i, which is orthogonal to d_i, and likewise at V_j:
 *   w_i . (E + l_j d_j) = 1.5 k_i l_i^2,    w_j . (-E + l_i d_i) = 1.5 k_j l_j^2
 * In a plane these are the equations of [de Boor, Hollig, Sabin 1987], the curve's curvature there being k / (N . w)
 * by Meusnier's theorem. */
#include "network/fan.h"

#include <string.h>

/* Below this part of its length a vector has no direction left. */
static const double DIRECTION_MIN = 1e-6;
/* An arc turns by twice this at most: longer ones would be loops. */
static const double ARC_ANGLE_MAX = 2.6;

/* Of the angle between projected edges that a tangent may use up: two of them leave a fifth. */
static const double ORDER_SHARE = 0.4;
static const double PI = 3.14159265358979323846;

/* Unit vector of the part of a that is orthogonal to the unit normal w. */
static bool project(const double *a, const double *w, double *out) {
  double part = vec_dot(a, w), length = vec_norm(a);
  for (int k = 0; k < 3; k++) out[k] = a[k] - part * w[k];
  return vec_norm(out) > DIRECTION_MIN * length && vec_normalize(out);
}

/* Direction at one end; chord runs away from it, plane [3] is orthogonal to the curve's plane or NULL. */
static bool direction_at(const double *chord, const double *normal, const double *guide, const double *plane,
                         const double *fallback, double *out) {
  if (guide && vec_dot(guide, guide) > 0 && project(guide, normal, out)) return true;
  if (plane) {
    vec_cross(normal, plane, out);
    bool found = vec_norm(out) > DIRECTION_MIN && vec_normalize(out);
    double forward = vec_dot(out, chord);
    if (forward < 0)
      for (int k = 0; k < 3; k++) out[k] = -out[k];
    /* An edge along the normal has no forward in the plane. */
    if (found && fabs(forward) > DIRECTION_MIN * vec_norm(chord)) return true;
  }
  if (project(chord, normal, out)) return !plane;
  if (fallback && project(fallback, normal, out)) return false;
  net_node any;
  net_frame(normal, NULL, &any);
  memcpy(out, any.u, sizeof any.u);
  return false;
}

/* The arc of a circle from the chord's start to its end that leaves along the unit vector d. */
static double arc_length(const double *d, const double *chord) {
  double across[3], size = vec_norm(chord);
  vec_cross(d, chord, across);
  double sine = vec_norm(across) / size, angle = atan2(sine, vec_dot(d, chord) / size);
  /* What rounding does to a small sine it does to the angle too. */
  if (angle > ARC_ANGLE_MAX) return size * ARC_ANGLE_MAX / sin(ARC_ANGLE_MAX);
  return sine > 1e-4 ? size * angle / sine : size * (1 + sine * sine / 6);
}

/* Newton's method for the two equations above; l in: where to start. False when it does not end near there. */
static bool solve_lengths(const double *a, const double *b, const double *curvature, double *l) {
  double start[2] = {l[0], l[1]}, step = INFINITY;
  for (int pass = 0; pass < 30 && step > 1e-14 * (start[0] + start[1]); pass++) {
    double f0 = a[0] + b[0] * l[1] - 1.5 * curvature[0] * l[0] * l[0];
    double f1 = a[1] + b[1] * l[0] - 1.5 * curvature[1] * l[1] * l[1];
    double j00 = -3 * curvature[0] * l[0], j11 = -3 * curvature[1] * l[1];
    double det = j00 * j11 - b[0] * b[1];
    double d0 = (f0 * j11 - f1 * b[0]) / det, d1 = (f1 * j00 - f0 * b[1]) / det;
    l[0] -= d0;
    l[1] -= d1;
    step = fabs(d0) + fabs(d1);
    if (!isfinite(step)) return false;
  }
  for (int k = 0; k < 2; k++)
    if (!(l[k] >= 0.2 * start[k] && l[k] <= 3 * start[k])) return false;
  return step <= 1e-10 * (start[0] + start[1]);
}

/* Lengths of t [2] for L3 and L4; true when they could be had. Where the edge is straight to rounding they cannot,
 * but any length will do there: *straight. */
static bool curvature_lengths(const double *chord, const double *const normals[2], const double (*d)[3],
                              const double *curvature, double *lengths, bool *straight) {
  double size = vec_norm(chord), l[2];
  double a[2] = {vec_dot(normals[0], chord), -vec_dot(normals[1], chord)};
  double b[2] = {vec_dot(normals[0], d[1]), vec_dot(normals[1], d[0])};
  double bent = 0;
  for (int k = 0; k < 2; k++) {
    bent = fmax(bent, fmax(fabs(a[k]) / size, fmax(fabs(b[k]), fabs(curvature[k]) * size)));
    l[k] = lengths[k] / 3;
  }
  *straight = bent < 1e-7;
  if (*straight || !solve_lengths(a, b, curvature, l)) return false;
  for (int k = 0; k < 2; k++) lengths[k] = 3 * l[k];
  return true;
}

bool net_tangent(batten_network_direction direction, batten_network_length length, const double chord[3],
                 const double normal_i[3], const double normal_j[3], const double (*guide)[3],
                 const double *curvature, const double (*fallback)[3], net_local *out) {
  const double *normals[2] = {normal_i, normal_j};
  double back[3], sum[3], plane[3], d[2][3], lengths[2];
  for (int k = 0; k < 3; k++) {
    back[k] = -chord[k];
    sum[k] = normal_i[k] + normal_j[k];
  }
  const double *chords[2] = {chord, back};
  bool exact = true, planar = false;
  if (direction == BATTEN_DIRECTION_D2) {
    vec_cross(chord, sum, plane);
    planar = vec_norm(plane) > DIRECTION_MIN * vec_norm(chord);
    exact = planar;
    vec_normalize(plane);
  }
  for (int end = 0; end < 2; end++) {
    exact &= direction_at(chords[end], normals[end], guide ? guide[end] : NULL, planar ? plane : NULL,
                          fallback ? fallback[end] : NULL, d[end]);
    lengths[end] = length == BATTEN_LENGTH_L1 ? vec_norm(chord) : arc_length(d[end], chords[end]);
  }
  bool curved = curvature && (length == BATTEN_LENGTH_L3 || length == BATTEN_LENGTH_L4), straight = false;
  if (curved) {
    curved = curvature_lengths(chord, normals, (const double(*)[3])d, curvature, lengths, &straight);
    exact &= curved || straight;
  }
  memset(out, 0, sizeof *out);
  for (int end = 0; end < 2; end++)
    for (int k = 0; k < 3; k++) out->t[end][k] = lengths[end] * d[end][k];
  if (curved && length == BATTEN_LENGTH_L4)
    for (int end = 0; end < 2; end++) {
      for (int k = 0; k < 3; k++) out->s[end][k] = 6 * chords[end][k] + 2 * out->t[!end][k] - 4 * out->t[end][k];
      double part = vec_dot(out->s[end], normals[end]);
      for (int k = 0; k < 3; k++) out->s[end][k] -= part * normals[end][k];
    }
  return !exact;
}

/* ---- edges of a network --------------------------------------------------------------------------- */

/* Between the other sides of the triangles at the edge's end, projected: for edges that stand upright there. */
static void upright_fallback(const net_topology *t, const net_node *const ends[2], uint32_t e, double (*out)[3]) {
  memset(out, 0, 2 * sizeof *out);
  for (unsigned end = 0; end < 2; end++) {
    uint32_t h = t->half[e];
    const double *p = t->points + (size_t)3 * t->triangles[end ? net_next(h) : h];
    for (int side = 0; side < 2 && h != NET_NONE; side++, h = t->twin[h]) {
      double a[3], d[3];
      vec_sub(t->points + (size_t)3 * t->triangles[net_prev(h)], p, a);
      if (project(a, ends[end]->w, d))
        for (int k = 0; k < 3; k++) out[end][k] += d[k];
    }
  }
}

/* Derivatives of a crease are the same on both sides: directions are those of the crease, where it has some, else
 * the projected edge at an end where both sides have one plane; nothing is asked of the other planes. */
static bool crease_tangent(const net_topology *t, batten_network_length length, const net_node *const ends[2],
                           uint32_t e, const double *chord, const double (*guide)[3], const double (*fallback)[3],
                           net_local *out) {
  double back[3] = {-chord[0], -chord[1], -chord[2]};
  const double *chords[2] = {chord, back};
  bool exact = true;
  memset(out, 0, sizeof *out);
  for (unsigned end = 0; end < 2; end++) {
    uint32_t node = net_edge_node(t, e, end, 0);
    double d[3] = {0};
    if (guide) memcpy(d, guide[end], sizeof d);
    if (!t->constraint || t->constraint[node].kind == NET_FREE || !vec_normalize(d))
      exact &= direction_at(chords[end], ends[end]->w, guide ? guide[end] : NULL, NULL,
                            fallback ? fallback[end] : NULL, d);
    double size = length == BATTEN_LENGTH_L1 ? vec_norm(chord) : arc_length(d, chords[end]);
    for (int k = 0; k < 3; k++) out->t[end][k] = size * d[k];
  }
  return !exact;
}

static double form_value(const net_node *node, const double *form, const double *t) {
  double a = vec_dot(t, node->u), b = vec_dot(t, node->v);
  return (form[0] * a * a + 2 * form[1] * a * b + form[2] * b * b) / (a * a + b * b);
}

/* ---- order around a node -------------------------------------------------------------------------- */

/* Angle from a to b about w, both of which are orthogonal to it. */
static double angle_about(const double *w, const double *a, const double *b) {
  double across[3];
  vec_cross(a, b, across);
  return atan2(vec_dot(w, across), vec_dot(a, b));
}

/* Angle from d, the projected edge, about w or, turn -1, against it, to the next one from the same node: of the
 * triangle of x, where the node is at x's start or end. Its tangent where that is fixed, else its projection; pi when
 * there is none. */
static double gap(const net_topology *t, const double *p, const double *w, const double *d, double turn, uint32_t x,
                  bool at_end) {
  double a[3], b[3];
  if (x == NET_NONE) return PI;
  uint32_t next = at_end ? net_next(x) : net_prev(x), e = t->edge[next];
  const double *guide = t->guide ? t->guide + 3 * (2 * (size_t)e + ((t->half[e] == next) != at_end)) : NULL;
  if (guide && vec_dot(guide, guide) > 0)
    memcpy(a, guide, sizeof a);
  else
    vec_sub(t->points + (size_t)3 * t->triangles[net_prev(x)], p, a);
  return project(a, w, b) ? turn * angle_about(w, d, b) : 0;
}

/* The plane of D2 turns a tangent away from its projected edge, where normals differ much by more than the angle to
 * the next edge, or until the angle to the one behind is more than half a turn: the facet between them would turn
 * over. Each keeps to its share of what there is. True when d [3] was changed. */
static bool hold_order(const net_topology *t, const double *w, uint32_t e, unsigned end, const double *chord,
                       double *d) {
  uint32_t h = t->half[e], twin = t->twin[h];
  const double *p = t->points + (size_t)3 * t->triangles[end ? net_next(h) : h];
  double middle[3], v[3];
  if (!project(chord, w, middle)) return false;
  double turn = angle_about(w, middle, d);
  double sign = turn > 0 ? 1 : -1;
  bool left = (sign > 0) != end;
  uint32_t ahead = left ? h : twin, behind = left ? twin : h;
  double limit = gap(t, p, w, middle, sign, ahead, left == end);
  if (behind != NET_NONE) limit = fmin(limit, PI - gap(t, p, w, middle, -sign, behind, left != end));
  limit = ORDER_SHARE * fmax(limit, 0);
  if (fabs(turn) <= limit) return false;
  vec_cross(w, middle, v);
  double angle = sign * limit, size = vec_norm(d);
  for (int k = 0; k < 3; k++) d[k] = size * (cos(angle) * middle[k] + sin(angle) * v[k]);
  return true;
}

/* Guides that keep the tangents of out in order; false when they are so already. */
static bool order_guides(const net_topology *t, const net_node *const ends[2], uint32_t e, const double *chord,
                         const double (*guide)[3], const net_local *out, double (*guides)[3]) {
  bool held = false;
  double back[3] = {-chord[0], -chord[1], -chord[2]};
  memset(guides, 0, 2 * sizeof *guides);
  for (unsigned end = 0; end < 2; end++) {
    if (guide && vec_dot(guide[end], guide[end]) > 0) {
      memcpy(guides[end], guide[end], sizeof guides[end]);
      continue;
    }
    double d[3];
    memcpy(d, out->t[end], sizeof d);
    if (!hold_order(t, ends[end]->w, e, end, end ? back : chord, d)) continue;
    memcpy(guides[end], d, sizeof d);
    held = true;
  }
  return held;
}

/* Of a smooth edge; forms as below. */
static bool smooth_tangent(const net_topology *t, const batten_network_options *opt, batten_network_length length,
                           const net_node *const ends[2], const double *const *forms, uint32_t e, const double *chord,
                           const double (*guide)[3], const double (*upright)[3], net_local *out) {
  const double *wi = ends[0]->w, *wj = ends[1]->w;
  double held[2][3], curvature[2];
  bool substitute = net_tangent(opt->direction, forms ? BATTEN_LENGTH_L1 : length, chord, wi, wj, guide, NULL,
                                upright, out); /* directions are the same for all lengths */
  bool turned = opt->direction == BATTEN_DIRECTION_D2 && order_guides(t, ends, e, chord, guide, out, held);
  if (!turned && !forms) return substitute;
  for (int end = 0; forms && end < 2; end++)
    curvature[end] = form_value(ends[end], forms[end], turned ? held[end] : out->t[end]);
  return net_tangent(opt->direction, length, chord, wi, wj, turned ? (const double(*)[3])held : guide,
                     forms ? curvature : NULL, upright, out);
}

bool net_tangent_between(const net_topology *t, const batten_network_options *opt, const net_node *const ends[2],
                         const double *const *forms, uint32_t e, net_local *out) {
  static const double none[6] = {0};
  uint32_t h = t->half[e];
  const double(*guide)[3] = t->guide ? (const double(*)[3])(t->guide + (size_t)6 * e) : NULL;
  bool bent = t->bend && memcmp(t->bend + (size_t)6 * e, none, sizeof none) != 0;
  bool crease = t->kind[e] == NET_CREASE;
  batten_network_length length = opt->length;
  double chord[3], fallback[2][3];
  vec_sub(t->points + (size_t)3 * t->triangles[net_next(h)], t->points + (size_t)3 * t->triangles[h], chord);
  if (bent || (length != BATTEN_LENGTH_L3 && length != BATTEN_LENGTH_L4)) forms = NULL;
  if (!forms && length != BATTEN_LENGTH_L1) length = BATTEN_LENGTH_L2;

  const double(*upright)[3] = NULL;
  bool substitute = false;
  for (int attempt = 0; attempt < 2 && (attempt == 0 || substitute); attempt++) {
    if (attempt) {
      upright_fallback(t, ends, e, fallback);
      upright = (const double(*)[3])fallback;
    }
    substitute = crease ? crease_tangent(t, length, ends, e, chord, guide, upright, out)
                        : smooth_tangent(t, opt, length, ends, forms, e, chord, guide, upright, out);
  }
  return substitute;
}

bool net_tangent_edge(const net_topology *t, const batten_network_options *opt, const net_node *nodes,
                      const double *forms, uint32_t e, net_local *out) {
  uint32_t i = net_edge_node(t, e, 0, 0), j = net_edge_node(t, e, 1, 0);
  const net_node *ends[2] = {nodes + i, nodes + j};
  const double *both[2] = {forms ? forms + (size_t)3 * i : NULL, forms ? forms + (size_t)3 * j : NULL};
  return net_tangent_between(t, opt, ends, forms ? both : NULL, e, out);
}
