/* Quadratic models of the primitive carriers and of R-functions over boxes.
 *
 * Ball, ellipsoid and half-space are their own models. Distances (box, cylinder, torus) have kinks: their model is
 * linear with the gradient in the middle, and what it leaves out is at most sum_i max |G_i - slope_i| radius_i, where
 * G holds all gradients in the box: f(x) - f(middle) is an integral over gradients on the way. Beside it stands the
 * range by interval arithmetic, which is better in large boxes. */
#include <math.h>
#include <string.h>

#include "solid/bounds.h"

/* Above the relative rounding error of evaluating a primitive. */
static const double ROUNDING = 0x1p-45;

static interval clip(interval a, double lo, double hi) {
  return (interval){fmin(fmax(a.lo, lo), hi), fmin(fmax(a.hi, lo), hi)};
}

static interval span(const taylor_box *box, unsigned axis) { return (interval){box->lower[axis], box->upper[axis]}; }

/* row . (x - center) over the box */
static interval dot(unsigned n, const double *row, const double *center, const taylor_box *box) {
  interval sum = interval_of(0);
  for (unsigned k = 0; k < n; k++)
    sum = interval_add(sum, interval_scale(interval_sub(span(box, k), interval_of(center[k])), row[k]));
  return sum;
}

/* Largest |x - center|, summed over the axes: what roundings of distances are relative to. */
static double reach(unsigned n, const double *center, const taylor_box *box) {
  double sum = 0;
  for (unsigned k = 0; k < n; k++) sum += fmax(fabs(box->lower[k] - center[k]), fabs(box->upper[k] - center[k]));
  return sum;
}

/* Value, slope and, if quadratic, bend in the middle, by the evaluator. */
static taylor start(const batten_carrier *c, const taylor_box *box, bool quadratic) {
  taylor t = {.range = interval_all(), .steep = batten_steep_unknown()};
  double hessian[9];
  batten_carrier_shape(c, 1, box->middle, &t.value, t.slope, quadratic ? hessian : NULL);
  for (unsigned a = 0; quadratic && a < c->n; a++)
    for (unsigned b = a; b < c->n; b++) t.bend[TAYLOR_BEND[a][b]] = hessian[a * c->n + b];
  return t;
}

/* ---- quadratic and linear shapes ----------------------------------------------------------------- */

static taylor ball(const batten_carrier *c, const taylor_box *box) {
  taylor t = start(c, box, true);
  double radius = c->parameters[c->n], size = reach(c->n, c->parameters, box) + radius;
  interval sum = interval_of(0);
  for (unsigned k = 0; k < c->n; k++)
    sum = interval_add(sum, interval_square(interval_sub(span(box, k), interval_of(c->parameters[k]))));
  t.range = interval_sub(interval_square(interval_of(radius)), sum);
  t.rest = ROUNDING * size * size;
  t.rest_slope = ROUNDING * size;
  return t;
}

static taylor ellipsoid(const batten_carrier *c, const taylor_box *box) {
  taylor t = start(c, box, true);
  const double *axes = c->parameters + c->n, *rotation = axes + c->n;
  double least = axes[0];
  for (unsigned k = 1; k < c->n; k++) least = fmin(least, axes[k]);
  double size = reach(c->n, c->parameters, box) + least;
  interval sum = interval_of(0);
  for (unsigned k = 0; k < c->n; k++) {
    interval y = dot(c->n, rotation + k * c->n, c->parameters, box);
    sum = interval_add(sum, interval_square(interval_scale(y, least / axes[k])));
  }
  t.range = interval_sub(interval_square(interval_of(least)), sum);
  t.rest = ROUNDING * size * size;
  t.rest_slope = ROUNDING * size;
  return t;
}

static taylor half_space(const batten_carrier *c, const taylor_box *box) {
  taylor t = start(c, box, false);
  t.rest = ROUNDING * reach(c->n, c->parameters, box);
  t.rest_slope = ROUNDING;
  return t;
}

/* ---- distances ----------------------------------------------------------------------------------- */

/* All of corner_distance (carrier_shapes.c) over intervals e: its range, and its derivatives by e in de. */
static interval corner_distance(unsigned n, const interval *e, interval *de) {
  interval out[3], squares = interval_of(0);
  double inner_lo = e[0].lo, inner_hi = e[0].hi; /* of max e */
  for (unsigned i = 0; i < n; i++) {
    out[i] = (interval){fmax(e[i].lo, 0), fmax(e[i].hi, 0)};
    squares = interval_add(squares, interval_square(out[i]));
    inner_lo = fmax(inner_lo, e[i].lo);
    inner_hi = fmax(inner_hi, e[i].hi);
  }
  bool inside = inner_lo <= 0, outside = inner_hi > 0;
  interval d = interval_sqrt(squares);
  for (unsigned i = 0; i < n; i++) {
    double others_lo = 0, others_hi = 0, second = -INFINITY;
    for (unsigned j = 0; j < n; j++) {
      if (j == i) continue;
      others_lo = hypot(others_lo, out[j].lo);
      others_hi = hypot(others_hi, out[j].hi);
      second = fmax(second, e[j].hi);
    }
    /* Outside e_i / d grows with e_i and falls with the others; inside one derivative is 1, the others are 0. */
    double most = out[i].hi > 0 ? out[i].hi / hypot(others_lo, out[i].hi) : 0;
    double least = out[i].lo > 0 ? out[i].lo / hypot(others_hi, out[i].lo) : 0;
    if (inside && e[i].lo > second) least = 1; /* the others are negative throughout */
    if (inside && e[i].hi >= inner_lo) most = 1;
    de[i] = clip(interval_widen(least, most, 4), 0, 1);
  }
  if (!outside) return (interval){inner_lo, inner_hi};
  return inside ? (interval){fmin(inner_lo, 0), d.hi} : d;
}

/* Above the length of a distance's gradient: rotations and axes are right to 1e-9. */
static const double UNIT = 1 + 1e-8;

/* The rest of a linear model whose gradient lies in g everywhere; size: what roundings are relative to. The squares
 * of lengths under 1e-154 are lost. */
static void settle_distance(unsigned n, const interval *g, const taylor_box *box, double size, taylor *t) {
  double slack = ROUNDING * size + 0x1p-500, square = 0;
  t->rest = slack;
  for (unsigned k = 0; k < n; k++) {
    double apart = fmax(fabs(g[k].hi - t->slope[k]), fabs(t->slope[k] - g[k].lo));
    t->rest += apart * box->radius[k] * (1 + 0x1p-48);
    square += apart * apart;
  }
  t->rest_slope = sqrt(square) + ROUNDING;
  t->steep = (interval){0, UNIT};
  t->range.lo -= slack;
  t->range.hi += slack;
}

/* y >= 0: [1, 1], y <= 0: [-1, -1], else both */
static interval side_of(interval y) { return (interval){y.lo < 0 ? -1 : 1, y.hi > 0 ? 1 : -1}; }

static taylor box_shape(const batten_carrier *c, const taylor_box *box) {
  const unsigned n = c->n;
  const double *half = c->parameters + n, *rotation = half + n;
  const double rounding = rotation[n * n];
  double size = reach(n, c->parameters, box);
  interval e[3], side[3], de[3], g[3];
  for (unsigned i = 0; i < n; i++) {
    interval y = dot(n, rotation + i * n, c->parameters, box);
    e[i] = interval_sub(interval_abs(y), interval_of(half[i] - rounding));
    side[i] = side_of(y);
    size += half[i];
  }
  taylor t = start(c, box, false);
  t.range = interval_sub(interval_of(rounding), corner_distance(n, e, de));
  for (unsigned k = 0; k < n; k++) {
    g[k] = interval_of(0);
    for (unsigned i = 0; i < n; i++)
      g[k] = interval_sub(g[k], interval_scale(interval_mul(side[i], de[i]), rotation[i * n + k]));
  }
  settle_distance(n, g, box, size, &t);
  return t;
}

/* Along an axis z, away from it rho, and the unit vector e that points away, as in carrier_shapes.c. */
static void cylindrical(const double center[3], const double axis[3], const taylor_box *box, interval *z,
                        interval *rho, interval e[3]) {
  interval away[3], squares = interval_of(0);
  *z = dot(3, axis, center, box);
  for (unsigned i = 0; i < 3; i++) {
    double row[3];
    for (unsigned j = 0; j < 3; j++) row[j] = (i == j) - axis[i] * axis[j];
    away[i] = dot(3, row, center, box);
    squares = interval_add(squares, interval_square(away[i]));
  }
  *rho = interval_sqrt(squares);
  for (unsigned i = 0; i < 3; i++) e[i] = clip(interval_div(away[i], *rho), -1, 1);
}

/* Gradient in space of F(rho, z) from its derivatives. */
static void revolve(const double axis[3], const interval e[3], interval by_rho, interval by_z, interval g[3]) {
  for (unsigned i = 0; i < 3; i++) g[i] = interval_add(interval_mul(by_rho, e[i]), interval_scale(by_z, axis[i]));
}

static taylor cylinder(const batten_carrier *c, const taylor_box *box) {
  const double radius = c->parameters[6], rounding = c->parameters[7];
  interval z, rho, e[3], de[2], g[3];
  cylindrical(c->middle, c->axis, box, &z, &rho, e);
  interval edge[2] = {interval_sub(rho, interval_of(radius - rounding)),
                      interval_sub(interval_abs(z), interval_of(c->half_length - rounding))};
  taylor t = start(c, box, false);
  t.range = interval_sub(interval_of(rounding), corner_distance(2, edge, de));
  revolve(c->axis, e, interval_neg(de[0]), interval_neg(interval_mul(side_of(z), de[1])), g);
  settle_distance(3, g, box, reach(3, c->middle, box) + radius + c->half_length, &t);
  return t;
}

static taylor torus(const batten_carrier *c, const taylor_box *box) {
  const double major = c->parameters[6], minor = c->parameters[7];
  interval z, rho, e[3], g[3];
  cylindrical(c->parameters, c->axis, box, &z, &rho, e);
  interval out = interval_sub(rho, interval_of(major)), d = interval_hypot(out, z);
  taylor t = start(c, box, false);
  t.range = interval_sub(interval_of(minor), d);
  revolve(c->axis, e, interval_neg(clip(interval_div(out, d), -1, 1)), interval_neg(clip(interval_div(z, d), -1, 1)),
          g);
  settle_distance(3, g, box, reach(3, c->parameters, box) + major + minor, &t);
  return t;
}

taylor batten_carrier_shape_model(const batten_carrier *c, const taylor_box *box) {
  switch (c->kind) {
    case BATTEN_CARRIER_BALL:
      return ball(c, box);
    case BATTEN_CARRIER_ELLIPSOID:
      return ellipsoid(c, box);
    case BATTEN_CARRIER_BOX:
      return box_shape(c, box);
    case BATTEN_CARRIER_CYLINDER:
      return cylinder(c, box);
    case BATTEN_CARRIER_TORUS:
      return torus(c, box);
    case BATTEN_CARRIER_HALF_SPACE:
      return half_space(c, box);
    case BATTEN_CARRIER_NONE:
    case BATTEN_CARRIER_UNION:
    case BATTEN_CARRIER_INTERSECTION:
    case BATTEN_CARRIER_CALLBACK:
    case BATTEN_CARRIER_SOLID:
      break;
  }
  return (taylor){.range = interval_of(0), .steep = interval_of(0)};
}

/* ---- R-functions --------------------------------------------------------------------------------- */

/* u at one pair; with an infinite one its limit: the other, or the infinite one itself. */
static double join_at(double alpha, double sign, double f, double g) {
  double inner = sign > 0 ? fmax(f, g) : fmin(f, g);
  if (isinf(f) || isinf(g)) return inner;
  batten_carrier_combine(1, alpha, sign, 1, &f, NULL, NULL, &g, NULL, NULL);
  return isnan(f) ? inner : f;
}

/* It depends on the angle of (f, g) alone and is 1 on the positive axis of f, -1 on its negative one, and in between
 * at the ends elsewhere. */
interval batten_carrier_root_change(double alpha, interval f, interval g) {
  double least = 1, most = -1;
  bool g_has_0 = g.lo <= 0 && g.hi >= 0;
  if ((f.lo <= 0 && f.hi >= 0 && g_has_0) || !isfinite(f.lo) || !isfinite(f.hi) || !isfinite(g.lo) || !isfinite(g.hi))
    return (interval){-1, 1};
  for (int i = 0; i < 4; i++) {
    double a = i & 1 ? f.hi : f.lo, b = i & 2 ? g.hi : g.lo, d = a - b;
    double square = d * d + 2 * (1 - alpha) * a * b, by = square > 0 ? (a - alpha * b) / sqrt(square) : NAN;
    if (isnan(by)) return (interval){-1, 1};
    least = fmin(least, by);
    most = fmax(most, by);
  }
  if (g_has_0 && f.hi > 0) most = 1;
  if (g_has_0 && f.lo < 0) least = -1;
  return clip((interval){least - 1e-9, most + 1e-9}, -1, 1);
}

interval batten_carrier_join_steep(double alpha, double sign, interval f, interval g, interval df, interval dg) {
  double most = alpha == 1   ? fmax(df.hi, dg.hi)
                : alpha == 0 ? df.hi + dg.hi + hypot(df.hi, dg.hi)
                             : 2 / (1 + alpha) * (df.hi + dg.hi);
  if (!(most < INFINITY)) return batten_steep_unknown();
  interval by_f = batten_carrier_root_change(alpha, f, g), by_g = batten_carrier_root_change(alpha, g, f);
  if (sign < 0) {
    by_f = interval_neg(by_f);
    by_g = interval_neg(by_g);
  }
  by_f = clip(interval_scale(interval_add(by_f, interval_of(1)), 1 / (1 + alpha)), 0, INFINITY);
  by_g = clip(interval_scale(interval_add(by_g, interval_of(1)), 1 / (1 + alpha)), 0, INFINITY);
  interval steep = batten_steep_add(interval_mul(by_f, df), interval_mul(by_g, dg));
  /* The evaluated derivatives are off by units over 1 + alpha. */
  double slack = 1e-9 * most;
  return (interval){fmax(steep.lo - slack, 0), fmin(steep.hi, most) + slack};
}

/* u - u(f0, g0) = U_f (f - f0) + U_g (g - g0) with U_f, U_g among the derivatives over the box: their middles carry
 * the models of f and g on, the rest of them is bounded by the ranges of f - f0 and g - g0. */
taylor batten_carrier_join_models(unsigned n, const taylor_box *box, double alpha, double sign, const taylor *f,
                                  const taylor *g) {
  interval of_f = batten_taylor_range(n, box, f), of_g = batten_taylor_range(n, box, g);
  double lo = join_at(alpha, sign, of_f.lo, of_g.lo), hi = join_at(alpha, sign, of_f.hi, of_g.hi);
  double size = fmax(fabs(of_f.lo), fabs(of_f.hi)) + fmax(fabs(of_g.lo), fabs(of_g.hi));
  /* S^2 is at least (1 + alpha) / 2 of the square of |f| + |g|, and is off by that square times some units. */
  double slack = ROUNDING * size / ((1 + alpha) * (1 + alpha));
  interval steep_f = batten_taylor_steep(n, box, f), steep_g = batten_taylor_steep(n, box, g);
  interval steep = batten_carrier_join_steep(alpha, sign, of_f, of_g, steep_f, steep_g);
  taylor t = batten_taylor_of_range(lo - (isfinite(lo) ? slack : 0), hi + (isfinite(hi) ? slack : 0), steep);
  if (!(f->rest < INFINITY) || !(g->rest < INFINITY) || !isfinite(slack)) return t;
  interval root_f = batten_carrier_root_change(alpha, of_f, of_g),
           root_g = batten_carrier_root_change(alpha, of_g, of_f);
  double by_f = (1 + sign * (root_f.lo + root_f.hi) / 2) / (1 + alpha);
  double by_g = (1 + sign * (root_g.lo + root_g.hi) / 2) / (1 + alpha);
  double around_f = (root_f.hi - root_f.lo) / 2 / (1 + alpha), around_g = (root_g.hi - root_g.lo) / 2 / (1 + alpha);
  t.value = join_at(alpha, sign, f->value, g->value);
  for (unsigned k = 0; k < 3; k++) t.slope[k] = by_f * f->slope[k] + by_g * g->slope[k];
  for (unsigned k = 0; k < 6; k++) t.bend[k] = by_f * f->bend[k] + by_g * g->bend[k];
  double change_f = fmax(of_f.hi - f->value, f->value - of_f.lo);
  double change_g = fmax(of_g.hi - g->value, g->value - of_g.lo);
  t.rest = (by_f + around_f) * f->rest + (by_g + around_g) * g->rest + around_f * change_f + around_g * change_g +
           slack + (1e-9 * ROUNDING + ROUNDING) * size / (1 + alpha);
  t.rest_slope = by_f * f->rest_slope + by_g * g->rest_slope;
  if (around_f > 0) t.rest_slope += around_f * steep_f.hi; /* 0 times infinity is 0 */
  if (around_g > 0) t.rest_slope += around_g * steep_g.hi;
  return t;
}
