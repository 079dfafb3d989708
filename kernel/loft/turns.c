/* What turns of the sections' polygons must keep, and whether those of a surface do.   [eq. 10, 11]
 *
 * With p and q the legs beside a vertex, as polynomials in zeta, the turn lies in [lower, upper] where q is to the
 * left of p turned by lower and to the right of p turned by upper: two products of degree 2 n, whose Bernstein
 * coefficients prove it where they are not negative. Else zeta is bisected. */
#include <float.h>

#include "basis/bezier.h"
#include "loft_inner.h"

enum { ORDER = BATTEN_SURFACE_DEGREE_MAX + 1, PROOF_DEPTH = 10, SAMPLES = 64 };

static const double PI = 3.14159265358979323846;

/* Turns of contours as large as eq. 11 allows, or larger, leave sections that much more. */
static const double BEYOND = 1.01;

bool loft_bound_of(const loft_slab *slab, size_t v, double margin, loft_bound *out) {
  int wanted = slab->wanted[v];
  double first = loft_turn(slab, 0, v), last = loft_turn(slab, 1, v);
  if (wanted == LOFT_FLAT || isnan(first) || isnan(last)) return false;
  double least = margin * fmin(fabs(first), fabs(last));
  double most = fmax(PI / (slab->space.degree - 1), BEYOND * fmax(fabs(first), fabs(last)));
  most = fmin(most, PI);
  if (wanted == LOFT_FREE && most > PI / 2) return false; /* no two half planes say that */
  *out = wanted == LOFT_FREE ? (loft_bound){-most, most}
         : wanted > 0        ? (loft_bound){least, most}
                             : (loft_bound){-most, -least};
  return true;
}

void loft_leg(const loft_net *net, const double *control, size_t i, size_t v, double (*out)[2]) {
  const loft_space *space = &net->slabs[i].space;
  size_t from = v, to = v + 1;
  if (space->closed) {
    from %= space->count;
    to %= space->count;
  }
  for (unsigned k = 0; k <= net->degree; k++)
    for (unsigned x = 0; x < 2; x++)
      out[k][x] = control[2 * loft_at(net, i, to, k) + x] - control[2 * loft_at(net, i, from, k) + x];
}

/* Both legs over [from, to] of [0, 1]. */
static void restrict_leg(unsigned n, double (*leg)[2], double from, double to, double (*out)[2]) {
  double left[ORDER][2], right[ORDER][2];
  bezier_split(n, 2, leg[0], from, left[0], right[0]);
  bezier_split(n, 2, right[0], from < 1 ? (to - from) / (1 - from) : 1, out[0], left[0]);
}

/* The signs of the Bernstein coefficients of [p turned by an angle, q] times `sign`: 1 none is negative, -1 one at an
 * end is, so that it fails there; 0 neither. */
static int product_sign(unsigned n, double (*p)[2], double angle, double (*q)[2], double sign) {
  double c = cos(angle), s = sin(angle), product[2 * ORDER - 1] = {0};
  for (unsigned i = 0; i <= n; i++) {
    double turned[2] = {c * p[i][0] - s * p[i][1], s * p[i][0] + c * p[i][1]};
    for (unsigned j = 0; j <= n; j++)
      product[i + j] += sign * loft_cross(turned, q[j]) * bezier_binomial[n][i] * bezier_binomial[n][j];
  }
  if (product[0] < 0 || product[2 * n] < 0) return -1;
  for (unsigned r = 1; r < 2 * n; r++)
    if (!(product[r] >= 0)) return 0;
  return 1;
}

static bool proven(unsigned n, double (*p)[2], double (*q)[2], const loft_bound *bound) {
  unsigned depth = 0;
  size_t index = 0;
  while (index < (size_t)1 << depth) {
    double part[2][ORDER][2], from = ldexp((double)index, -(int)depth), to = ldexp((double)index + 1, -(int)depth);
    restrict_leg(n, p, from, to, part[0]);
    restrict_leg(n, q, from, to, part[1]);
    int first = product_sign(n, part[0], bound->lower, part[1], 1);
    int second = first < 0 ? -1 : product_sign(n, part[0], bound->upper, part[1], -1);
    if (first < 0 || second < 0) return false;
    if (first == 0 || second == 0) {
      if (depth == PROOF_DEPTH) return false;
      depth++;
      index *= 2;
      continue;
    }
    for (index++; depth > 0 && index % 2 == 0; depth--) index /= 2;
  }
  return true;
}

static void point_at(unsigned n, double (*leg)[2], double zeta, double out[2]) {
  double work[ORDER][2];
  for (unsigned k = 0; k <= n; k++)
    for (unsigned x = 0; x < 2; x++) work[k][x] = leg[k][x];
  for (unsigned level = n; level > 0; level--)
    for (unsigned k = 0; k < level; k++)
      for (unsigned x = 0; x < 2; x++) work[k][x] = (1 - zeta) * work[k][x] + zeta * work[k + 1][x];
  out[0] = work[0][0];
  out[1] = work[0][1];
}

double loft_shortage(const loft_net *net, const double *control, size_t i, size_t v, const loft_bound *bound) {
  double p[ORDER][2], q[ORDER][2];
  unsigned n = net->degree;
  loft_leg(net, control, i, v, p);
  loft_leg(net, control, i, v + 1, q);
  if (proven(n, p, q, bound)) return 0;
  double worst = DBL_EPSILON, middle = (bound->lower + bound->upper) / 2, half = (bound->upper - bound->lower) / 2;
  for (unsigned r = 0; r <= SAMPLES; r++) {
    double a[2], b[2];
    point_at(n, p, (double)r / SAMPLES, a);
    point_at(n, q, (double)r / SAMPLES, b);
    double turn = atan2(loft_cross(a, b), a[0] * b[0] + a[1] * b[1]);
    worst = fmax(worst, fabs(remainder(turn - middle, 2 * PI)) - half);
  }
  return worst;
}
