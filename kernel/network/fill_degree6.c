/* Three patches of degree 6 a facet.   [Kolb, Pottmann, Seidel 1995, section 6; Shirman, Sequin 1987]
 *
 * The facet is split at an inner point Z. Along an edge with curve C and field d the derivative towards Z is
 * k d + h C' with k and h linear: degree 5, the row of a patch of degree 6. The curves inside, from corner A to Z,
 * are quintics A I1 I2 I3 I4 Z; across them neighbours join by r + r' - 2 I = mu I' / 5 [Farin 1982], where r, r' are
 * the rows beside the curve, of degree 5 as the curve itself, and mu is linear. I1 is A + f (mean of A and its
 * neighbours on the two edges - A), f by how much longer an arc to the middle of the opposite edge's curve is than
 * the straight way to that edge's chord [section 4]: mu = 5 / (2 f) at A. At Z, the mean of the three I4, mu = 5/6.
 * Coefficient by coefficient r_m + r'_m = 2 I_m + ((5 - m) mu_0 (I_m+1 - I_m) + m mu_1 (I_m - I_m-1)) / 5,   m = 1
 * .. 4. m = 1: both r_1 belong to rows of the edges: gives I2. m = 2, 3: the means of the points beside the curve;
 * their differences, the skews, are free. m = 4: three equations for the three points next to Z. Free then: I3, I4
 * and the two skews at each corner, the middle g2 of the third row beside each edge. They take the least integral of
 * the third derivatives' squares (invariant under rotation) over an equilateral parameter triangle: it lets a
 * quadratic surface pass, where the second derivatives' would flatten it.
 *
 * Points are affine functions of the 15 unknowns while these are not known: [18], unknowns first, then the constant
 * vector. */
#include <stdbool.h>
#include <string.h>

#include "basis/bezier.h"
#include "network/fill.h"

enum { UNKNOWNS = 15, WIDTH = UNKNOWNS + 3, POINTS = 28, LOOSE = 13 };

/* Unknowns, by corner or edge. */
enum { AT_I3 = 0, AT_I4 = 3, AT_SKEW_2 = 6, AT_SKEW_3 = 9, AT_MIDDLE = 12 };

static const double MU_1 = 5. / 6;

/* Points of a patch that depend on unknowns: all beyond the second row but the ends of the third. */
static const unsigned char loose[LOOSE] = {14, 15, 16, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27};

/* Their rows of the integral's matrix, times 15120, for a third of the equilateral triangle with corners at (0, 0),
 * (1, 0) and (1/2, sqrt(3) / 6), to a common factor. */
/* clang-format off */
static const short third_derivatives[LOOSE][POINTS] = {
    {632, 2656, 4416, 3744, 1868, 624, 100, -3936, -12048, -13320, -7368, -2928, -576, 7968, 14424, 8136, 4056,
     1056, -4408, -744, -840, -488, -1908, -1152, -180, 216, -216, 216},
    {252, 1212, 2586, 3240, 2586, 1212, 252, -1476, -5688, -10008, -10008, -5688, -1476, 2826, 8136, 11448, 8136,
     2826, -1656, -2232, -2232, -1656, -414, -2736, -414, 324, 324, 324},
    {100, 624, 1868, 3744, 4416, 2656, 632, -576, -2928, -7368, -13320, -12048, -3936, 1056, 4056, 8136, 14424,
     7968, -488, -840, -744, -4408, -180, -1152, -1908, -216, 216, 216},
    {-136, -592, -928, -648, -224, -56, -8, 1040, 3104, 2912, 1048, 280, 40, -2656, -4408, -1656, -488, -80, 2248,
     744, 192, 56, 216, 432, 0, -432, 0, 0},
    {48, 264, 444, 216, -48, -48, -12, -312, -960, -456, 600, 384, 96, 372, -744, -2232, -840, -228, 744, 3672,
     792, 192, -648, 0, 0, -1728, -432, 864},
    {-12, -48, -48, 216, 444, 264, 48, 96, 384, 600, -456, -960, -312, -228, -840, -2232, -744, 372, 192, 792,
     3672, 744, 0, 0, -648, -432, -1728, 864},
    {-8, -56, -224, -648, -928, -592, -136, 40, 280, 1048, 2912, 3104, 1040, -80, -488, -1656, -4408, -2656, 56,
     192, 744, 2248, 0, 432, 216, 0, -432, 0},
    {-90, -378, -585, -432, -180, -54, -9, 630, 1764, 1548, 576, 198, 36, -1341, -1908, -414, -180, -45, 216,
     -648, 0, 0, 2196, 792, 36, -2160, -432, 864},
    {18, 108, 198, 216, 198, 108, 18, -72, -72, 576, 576, -72, -72, -72, -1152, -2736, -1152, -72, 432, 0, 0, 432,
     792, 5328, 792, -2592, -2592, 864},
    {-9, -54, -180, -432, -585, -378, -90, 36, 198, 576, 1548, 1764, 630, -45, -180, -414, -1908, -1341, 0, 0,
     -648, 216, 36, 792, 2196, -432, -2160, 864},
    {-54, -216, -324, -216, -54, 0, 0, 324, 864, 864, 432, 108, 0, -270, 216, 324, -216, -54, -432, -1728, -432,
     0, -2160, -2592, -432, 6912, 3456, -4320},
    {0, 0, -54, -216, -324, -216, -54, 0, 108, 432, 864, 864, 324, -54, -216, 324, 216, -270, 0, -432, -1728,
     -432, -432, -2592, -2160, 3456, 6912, -4320},
    {-27, -108, -189, -216, -189, -108, -27, 54, 54, -108, -108, 54, 54, 54, 216, 324, 216, 54, 0, 864, 864, 0,
     864, 864, 864, -4320, -4320, 4320},
};
/* clang-format on */

typedef struct facet {
  double edge[3][7][3];  /* of degree 6 */
  double row[3][6][3];   /* beside it; its ends are settled by the inner curves */
  double inner[3][3][3]; /* A I1 I2 */
  double mu[3];          /* at A */
} facet;

/* ---- what is known ------------------------------------------------------------------------------ */

/* f of the corner at which `leave` begins. */
static double first_length(const net_ribbon *leave, const net_ribbon *opposite, const net_ribbon *arrive) {
  double middle[3], to_curve[3], to_chord[3], first[3], cross[3];
  bezier_evaluate(5, 3, opposite->c[0], 0.5, middle, NULL);
  for (int x = 0; x < 3; x++) {
    double corner = leave->c[0][x];
    first[x] = (leave->c[1][x] - corner) + (arrive->c[4][x] - corner);
    to_curve[x] = middle[x] - corner;
    to_chord[x] = 0.5 * (opposite->c[0][x] + opposite->c[5][x]) - corner;
  }
  vec_cross(first, to_curve, cross);
  double angle = fmin(atan2(vec_norm(cross), vec_dot(first, to_curve)), 2.6);
  double arc = vec_norm(to_curve) * (angle < 1e-4 ? 1 + angle * angle / 6 : angle / sin(angle));
  double ratio = arc / vec_norm(to_chord);
  return fmin(fmax(ratio, 0.5), 2);
}

/* f = k d + h c in the plane of d and c, least squares. */
static void components(const double *f, const double *d, const double *c, double *k, double *h) {
  double dd = vec_dot(d, d), dc = vec_dot(d, c), cc = vec_dot(c, c), fd = vec_dot(f, d), fc = vec_dot(f, c);
  double area = dd * cc - dc * dc;
  *k = (fd * cc - fc * dc) / area;
  *h = (fc * dd - fd * dc) / area;
}

/* The row beside an edge between corners with first inner points i and j. */
static void row_make(const net_ribbon *ribbon, const double *i, const double *j, double (*row)[3], double k[2]) {
  double rate[5][3], f[2][3], h[2], slide[6][3], turn[5][3], turns[6][3];
  bezier_difference(5, 3, ribbon->c[0], rate[0]);
  for (int x = 0; x < 3; x++) {
    f[0][x] = 5. / 6 * (i[x] - ribbon->c[0][x]);
    f[1][x] = 5. / 6 * (j[x] - ribbon->c[5][x]);
  }
  components(f[0], ribbon->d[0], rate[0], &k[0], &h[0]);
  components(f[1], ribbon->d[3], rate[4], &k[1], &h[1]);
  bezier_multiply(1, k, 3, 3, ribbon->d[0], turn[0]);
  bezier_elevate(4, 3, turn[0], turns[0]);
  bezier_multiply(1, h, 4, 3, rate[0], slide[0]);
  for (unsigned m = 0; m < 6; m++)
    for (int x = 0; x < 3; x++) row[m][x] = ribbon->c[m][x] + turns[m][x] + slide[m][x];
}

/* True when the edges are proven regular. */
static bool facet_make(const net_ribbon *ribbons, facet *out) {
  bool regular = true;
  for (unsigned i = 0; i < 3; i++) {
    const net_ribbon *leave = &ribbons[i], *arrive = &ribbons[(i + 2) % 3];
    double f = first_length(leave, &ribbons[(i + 1) % 3], arrive), *a = out->inner[i][0], *first = out->inner[i][1];
    for (int x = 0; x < 3; x++) {
      a[x] = leave->c[0][x];
      first[x] = a[x] + f * ((leave->c[1][x] - a[x]) + (arrive->c[4][x] - a[x])) / 3;
    }
    out->mu[i] = 5 / (2 * f);
    bezier_elevate(5, 3, leave->c[0], out->edge[i][0]);
  }
  for (unsigned i = 0; i < 3; i++) {
    double k[2];
    row_make(&ribbons[i], out->inner[i][1], out->inner[(i + 1) % 3][1], out->row[i], k);
    regular = regular && net_across_regular(1, k, &ribbons[i]);
  }
  for (unsigned i = 0; i < 3; i++) {
    double next = 4 * out->mu[i] / 5, last = MU_1 / 5;
    for (int x = 0; x < 3; x++) {
      double a = out->inner[i][0][x], first = out->inner[i][1][x];
      double rows = out->row[i][1][x] + out->row[(i + 2) % 3][4][x];
      out->inner[i][2][x] = first + (rows - 2 * first - last * (first - a)) / next;
    }
  }
  return regular;
}

/* ---- affine functions of the unknowns ----------------------------------------------------------- */

static void add_known(double factor, const double *point, double *to) {
  for (int x = 0; x < 3; x++) to[UNKNOWNS + x] += factor * point[x];
}

/* to += factor times point m of the curve from corner i. */
static void add_inner(const facet *s, unsigned i, unsigned m, double factor, double *to) {
  if (m < 3)
    add_known(factor, s->inner[i][m], to);
  else if (m < 5)
    to[(m == 3 ? AT_I3 : AT_I4) + i] += factor;
  else
    for (unsigned k = 0; k < 3; k++) to[AT_I4 + k] += factor / 3;
}

/* ... of the curve as one of degree 6. */
static void add_raised(const facet *s, unsigned i, unsigned m, double *to) {
  if (m > 0) add_inner(s, i, m - 1, m / 6., to);
  if (m < 6) add_inner(s, i, m, (6 - m) / 6., to);
}

/* ... of (r_m + r'_m) / 2 beside it. */
static void add_mean(const facet *s, unsigned i, unsigned m, double factor, double *to) {
  double next = (5 - m) * s->mu[i] / 10, last = m * MU_1 / 10;
  add_inner(s, i, m + 1, factor * next, to);
  add_inner(s, i, m, factor * (1 - next + last), to);
  add_inner(s, i, m - 1, -factor * last, to);
}

/* The patch between corners k and k + 1 and Z. */
static void part_make(const facet *s, unsigned k, double (*out)[WIDTH]) {
  unsigned l = (k + 1) % 3;
  double(*row[7])[WIDTH] = {out, out + 7, out + 13, out + 18, out + 22, out + 25, out + 27};
  memset(out, 0, POINTS * sizeof *out);
  for (unsigned m = 0; m < 7; m++) add_known(1, s->edge[k][m], row[0][m]);
  for (unsigned m = 1; m < 5; m++) add_known(1, s->row[k][m], row[1][m]);
  for (unsigned m = 1; m < 6; m++) {
    add_raised(s, k, m, row[m][0]);
    add_raised(s, l, m, row[m][6 - m]);
  }
  for (unsigned m = 2; m < 4; m++) {
    unsigned skew = m == 2 ? AT_SKEW_2 : AT_SKEW_3;
    add_mean(s, k, m, 1, row[m][1]);
    row[m][1][skew + k] += 1;
    add_mean(s, l, m, 1, row[m][5 - m]);
    row[m][5 - m][skew + l] -= 1;
  }
  row[2][2][AT_MIDDLE + k] = 1;
  add_mean(s, k, 4, 1, row[4][1]);
  add_mean(s, l, 4, 1, row[4][1]);
  add_mean(s, (k + 2) % 3, 4, -1, row[4][1]);
  add_raised(s, k, 6, row[6][0]);
}

/* ---- the least integral ------------------------------------------------------------------------- */

/* system [UNKNOWNS][WIDTH] += half the integral's gradient, a symmetric matrix of which the upper triangle is kept.
 */
static void add_part(const double (*net)[WIDTH], double (*system)[WIDTH]) {
  for (unsigned p = 0; p < LOOSE; p++) {
    double image[WIDTH] = {0};
    for (unsigned q = 0; q < POINTS; q++) {
      unsigned first = q < 14 || q == 17 ? UNKNOWNS : 0; /* not among the loose ones: known */
      for (unsigned y = first; y < WIDTH; y++) image[y] += third_derivatives[p][q] * net[q][y];
    }
    for (unsigned a = 0; a < UNKNOWNS; a++) {
      double factor = net[loose[p]][a];
      for (unsigned y = a; y < WIDTH && factor != 0; y++) system[a][y] += factor * image[y];
    }
  }
}

/* Positive definite system, gradient 0: the solution [UNKNOWNS][3] is left in the last columns. */
static void solve(double (*system)[WIDTH]) {
  for (unsigned c = 0; c < UNKNOWNS; c++)
    for (unsigned a = c + 1; a < UNKNOWNS; a++) {
      double factor = system[c][a] / system[c][c];
      for (unsigned y = a; y < WIDTH; y++) system[a][y] -= factor * system[c][y];
    }
  for (unsigned a = UNKNOWNS; a-- > 0;)
    for (int x = 0; x < 3; x++) {
      double sum = -system[a][UNKNOWNS + x];
      for (unsigned b = a + 1; b < UNKNOWNS; b++) sum -= system[a][b] * system[b][UNKNOWNS + x];
      system[a][UNKNOWNS + x] = sum / system[a][a];
    }
}

bool net_fill_degree6(const net_node *nodes, const net_ribbon *ribbons, double (*out)[28][3]) {
  facet s;
  double net[POINTS][WIDTH], system[UNKNOWNS][WIDTH] = {{0}};
  (void)nodes; /* the ribbons say it all */
  bool regular = facet_make(ribbons, &s);
  for (unsigned k = 0; k < 3; k++) {
    part_make(&s, k, net);
    add_part((const double(*)[WIDTH])net, system);
  }
  solve(system);
  for (unsigned k = 0; k < 3; k++) {
    part_make(&s, k, net);
    for (unsigned p = 0; p < POINTS; p++)
      for (int x = 0; x < 3; x++) {
        double sum = net[p][UNKNOWNS + x];
        for (unsigned y = 0; y < UNKNOWNS; y++) sum += net[p][y] * system[y][UNKNOWNS + x];
        out[k][p][x] = sum;
      }
  }
  return regular;
}
