/* Spans of a curve alone, and integrals over them.
 *
 * By the part u of its span a derivative is as large as the span is, whatever the parameters are: factors are
 * quotients of knot differences below 1. The Bezier points are values of the blossoms of the curve's and of its
 * derivatives' own control points: no digits are lost in short spans. */
#include "curve_inner.h"

#include "basis/gauss8.h"
#include "basis/refine.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* ---- Bezier points ------------------------------------------------------------------------------- */

/* Control points 0 .. degree of span mu (of the curve or a derivative) -> Bezier points. */
static void find_bezier(const double *knots, unsigned degree, const double (*control)[2], double (*out)[2]) {
  double work[BSPLINE_ORDER][2];
  for (unsigned i = 0; i <= degree; i++) {
    memcpy(work, control, (degree + 1) * sizeof *work);
    for (unsigned round = 1; round <= degree; round++) {
      double t = round <= degree - i ? knots[0] : knots[1];
      for (unsigned k = 0; k + round <= degree; k++) {
        double start = *(knots + k + round - degree), part = (t - start) / (knots[k + 1] - start);
        for (unsigned x = 0; x < 2; x++) work[k][x] = bspline_blend(work[k][x], work[k + 1][x], part);
      }
    }
    memcpy(out[i], work[0], sizeof *out);
  }
}

void curve_piece_make(const batten_curve *curve, size_t mu, const double middle[2], curve_piece *out) {
  const bspline *b = &curve->space;
  unsigned d = b->degree;
  const double *knots = b->knots + mu, *p = curve->control_points + 2 * (mu - d);
  double unit = ldexp(1, curve->exponent), length = knots[1] - knots[0], control[BSPLINE_ORDER][2];
  double(*const nets[3])[2] = {out->point, out->first, out->second};
  memset(out, 0, sizeof *out);
  out->degree = d;
  for (unsigned i = 0; i <= d; i++)
    for (unsigned x = 0; x < 2; x++) control[i][x] = (p[2 * i + x] - middle[x]) * unit;
  find_bezier(knots, d, (const double(*)[2])control, nets[0]);
  for (unsigned k = 1; k <= 2 && k <= d; k++) {
    unsigned left = d - k;
    for (unsigned i = 0; i <= left; i++) {
      double part = (left + 1) * (length / (knots[i + 1] - *(knots + i - left)));
      for (unsigned x = 0; x < 2; x++) {
        /* Neighbouring control points themselves: far from the middle differences are exact. */
        double step = k == 1 ? (p[2 * i + 2 + x] - p[2 * i + x]) * unit : control[i + 1][x] - control[i][x];
        control[i][x] = part * step;
      }
    }
    find_bezier(knots, left, (const double(*)[2])control, nets[k]);
  }
}

void curve_find_middle(const batten_curve *curve, double middle[2]) {
  double lower[2], upper[2];
  curve_points_box(curve->space.count, curve->control_points, lower, upper);
  for (int x = 0; x < 2; x++) middle[x] = lower[x] + 0.5 * (upper[x] - lower[x]);
}

double curve_span_at(const bspline *space, size_t mu, double u) {
  double from = space->knots[mu], to = space->knots[mu + 1];
  return fmin(fmax(bspline_blend(from, to, u), from), to);
}

double curve_span_part(const bspline *space, size_t mu, double t) {
  double from = space->knots[mu], to = space->knots[mu + 1];
  return (t - from) / (to - from);
}

void curve_net_at(unsigned degree, const double (*net)[2], double u, double out[2]) {
  double work[BSPLINE_ORDER][2], v = 1 - u;
  memcpy(work, net, (degree + 1) * sizeof *work);
  for (unsigned left = degree; left > 0; left--)
    for (unsigned k = 0; k < left; k++) {
      work[k][0] = v * work[k][0] + u * work[k + 1][0];
      work[k][1] = v * work[k][1] + u * work[k + 1][1];
    }
  memcpy(out, work[0], sizeof work[0]);
}

void curve_restrict(unsigned n, unsigned dim, double from, double to, double *c) {
  for (unsigned level = 1; level <= n; level++)
    for (unsigned k = (n + 1) * dim - 1; k >= level * dim; k--) c[k] = (1 - to) * c[k - dim] + to * c[k];
  double part = from / to;
  for (unsigned level = 1; level <= n && from > 0; level++)
    for (unsigned k = 0; k < (n + 1 - level) * dim; k++) c[k] = (1 - part) * c[k] + part * c[k + dim];
}

/* ---- integrals ----------------------------------------------------------------------------------- */

/* Parts of a span that are asked to have the integrals to SAME; there are more only where rounding must be what
 * differs, and the more there are the less is asked. */
enum { LEAVES = 200, LEAVES_PER_BIT = 4 };
static const double SAME = 1e-13;
/* Where x' is steady it goes one way everywhere, by at least so much of its largest size. */
static const double STEADY = 0.1;

void curve_speed(const curve_piece *piece, double u, double *out) {
  double first[2];
  curve_net_at(piece->degree - 1, (const double(*)[2])piece->first, u, first);
  out[0] = sqrt(first[0] * first[0] + first[1] * first[1]);
  for (unsigned k = 1; k < CURVE_INTEGRALS; k++) out[k] = 0;
}

static void integrate(const curve_piece *piece, curve_integrand *integrand, double from, double to, double *out) {
  for (unsigned k = 0; k < CURVE_INTEGRALS; k++) out[k] = 0;
  for (unsigned i = 0; i < GAUSS8; i++) {
    double x, weight, value[CURVE_INTEGRALS];
    gauss8_node(i, &x, &weight);
    integrand(piece, from + (to - from) * x, value);
    for (unsigned k = 0; k < CURVE_INTEGRALS; k++) out[k] += weight * (to - from) * value[k];
  }
}

double curve_gauss_speed(const curve_piece *piece, double from, double to) {
  double out[CURVE_INTEGRALS];
  integrate(piece, curve_speed, from, to, out);
  return out[0];
}

void curve_walk_start(curve_walk *walk, const curve_piece *piece, curve_integrand *integrand, double from,
                      double to) {
  double most = 0;
  for (unsigned i = 0; i < piece->degree; i++)
    most = fmax(most, fmax(fabs(piece->first[i][0]), fabs(piece->first[i][1])));
  walk->piece = piece;
  walk->integrand = integrand;
  walk->most = most;
  walk->leaves = 0;
  walk->height = 1;
  walk->stack[0].from = from;
  walk->stack[0].to = to;
  integrate(piece, integrand, from, to, walk->stack[0].whole);
}

bool curve_is_steady(unsigned n, const double (*net)[2]) {
  double sum[2] = {0, 0}, least = INFINITY, most = 0;
  for (unsigned i = 0; i <= n; i++)
    for (int x = 0; x < 2; x++) sum[x] += net[i][x];
  for (unsigned i = 0; i <= n; i++) {
    least = fmin(least, net[i][0] * sum[0] + net[i][1] * sum[1]);
    most = fmax(most, hypot(net[i][0], net[i][1]));
  }
  return least >= STEADY * most * hypot(sum[0], sum[1]);
}

/* What x' does in a place narrower than the rule's nodes are apart, the halves may miss as the whole does. */
static bool is_steady(const curve_piece *piece, double from, double to) {
  unsigned n = piece->degree - 1;
  double net[BSPLINE_ORDER][2];
  memcpy(net, piece->first, (n + 1) * sizeof *net);
  curve_restrict(n, 2, from, to, net[0]);
  return curve_is_steady(n, (const double(*)[2])net);
}

bool curve_walk_next(curve_walk *walk, double *from, double *to, double integrals[CURVE_INTEGRALS]) {
  if (walk->height == 0) return false;
  for (;;) {
    double a = walk->stack[walk->height - 1].from, b = walk->stack[walk->height - 1].to, middle = a + 0.5 * (b - a);
    double *whole = walk->stack[walk->height - 1].whole, halves[2][CURVE_INTEGRALS];
    integrate(walk->piece, walk->integrand, a, middle, halves[0]);
    integrate(walk->piece, walk->integrand, middle, b, halves[1]);
    bool same = true;
    double asked = walk->leaves <= LEAVES ? SAME : ldexp(SAME, (int)(walk->leaves - LEAVES) / LEAVES_PER_BIT);
    double length = halves[0][0] + halves[1][0], noise = 8 * DBL_EPSILON * walk->most * (b - a); /* of the length */
    for (unsigned k = 0; k < CURVE_INTEGRALS; k++) {
      integrals[k] = halves[0][k] + halves[1][k];
      /* The others may vanish, or change their sign; where |x'| is small they are as rough as it is. */
      double size = fmax(fabs(integrals[k]), length), allowed = (asked + noise / length) * size;
      if (!(fabs(integrals[k] - whole[k]) <= allowed)) same = false;
    }
    if ((same && is_steady(walk->piece, a, b)) || length <= 1e-17 * walk->most || walk->height > CURVE_DEPTH) {
      walk->height--;
      walk->leaves++;
      *from = a;
      *to = b;
      return true;
    }
    walk->stack[walk->height].from = a;
    walk->stack[walk->height].to = middle;
    memcpy(walk->stack[walk->height].whole, halves[0], sizeof halves[0]);
    walk->stack[walk->height - 1].from = middle;
    memcpy(whole, halves[1], sizeof halves[1]);
    walk->height++;
  }
}
