/* Leaves of the node's own: ball, capped cone, gyroid.
 *
 * Ball and cone are signed distances of convex bodies K, positive inside, which are concave over all of space. So
 * over a box the least value is taken at a corner. Above, for any unit vector u with support h = max over K of u . k,
 *   f(x) <= h - u . x   (the distance to the half-space that K lies in)
 * and the bound of the right side over a box is exact; with u the outward direction at the box's middle it is wrong
 * by the second order of the box's size only. */
#include <string.h>

#include "base/checked.h"
#include "frep/frep_inner.h"

/* ---- ball ---------------------------------------------------------------------------------------------- */

static batten_status ball_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                   double *values, double *gradients) {
  const size_t n = a->n;
  const double *center = a->numbers, radius = center[n];
  (void)ctx;
  for (size_t i = 0; i < count; i++) {
    double square = 0;
    for (size_t k = 0; k < n; k++) square += (points[n * i + k] - center[k]) * (points[n * i + k] - center[k]);
    double distance = sqrt(square);
    values[i] = radius - distance;
    for (size_t k = 0; gradients && k < n; k++)
      gradients[n * i + k] = distance > 0 ? (center[k] - points[n * i + k]) / distance : 0;
  }
  return BATTEN_OK;
}

/* Every coordinate stands in the formula once: intervals give the exact range. */
static batten_status ball_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                 double *ranges) {
  const size_t n = a->n;
  (void)ctx;
  for (size_t i = 0; i < count; i++) {
    const double *lower = boxes + 2 * n * i, *upper = lower + n;
    interval square = interval_of(0);
    for (size_t k = 0; k < n; k++)
      square = interval_add(
          square, interval_square(interval_sub((interval){lower[k], upper[k]}, interval_of(a->numbers[k]))));
    interval r = interval_sub(interval_of(a->numbers[n]), interval_sqrt(square));
    ranges[2 * i] = r.lo;
    ranges[2 * i + 1] = r.hi;
  }
  return BATTEN_OK;
}

static bool ball_box(const batten_frep *a, double *lower, double *upper) {
  for (unsigned k = 0; k < a->n; k++) {
    interval r = interval_add(interval_of(a->numbers[k]), (interval){-a->numbers[a->n], a->numbers[a->n]});
    lower[k] = r.lo;
    upper[k] = r.hi;
  }
  return true;
}

batten_status batten_frep_ball(batten_context *ctx, unsigned n, const double *center, double radius,
                               batten_frep **out) {
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0 && n != 2 && n != 3) st = batten_fail(ctx, BATTEN_E_INVALID, "n: %u; give 2 or 3", n);
  if (st >= 0) st = frep_check_numbers(ctx, "center", n, center);
  if (st >= 0) st = frep_check_positive(ctx, "radius", radius);
  if (st < 0) return st;
  double numbers[4];
  memcpy(numbers, center, n * sizeof *center);
  numbers[n] = radius;
  batten_frep_parts parts = {.n = n, .number_count = n + 1, .numbers = numbers};
  return frep_make(ctx, &frep_class_ball, &parts, true, NULL, out);
}

static batten_status create_ball(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  batten_status st = frep_check_parts(ctx, parts, parts->n + 1, 0);
  return st < 0 ? st : batten_frep_ball(ctx, parts->n, parts->numbers, parts->numbers[parts->n], out);
}

const frep_class frep_class_ball = {.kind = BATTEN_FREP_KIND_BALL,
                                    .name = "ball",
                                    .evaluate = ball_evaluate,
                                    .bounds = ball_bounds,
                                    .box = ball_box,
                                    .create = create_ball};

/* ---- capped cone --------------------------------------------------------------------------------------- */

typedef struct cone {
  const double *a;
  double axis[3], length, radius[2];
  double side[2]; /* outward unit normal (rho, z) of the mantle */
} cone;

static cone cone_of(const batten_frep *a) {
  const double *v = a->numbers;
  cone c = {.a = v, .radius = {v[6], v[7]}};
  c.length = hypot(hypot(v[3] - v[0], v[4] - v[1]), v[5] - v[2]); /* squares may vanish */
  for (int k = 0; k < 3; k++) c.axis[k] = (v[3 + k] - v[k]) / c.length;
  double rise = c.radius[0] - c.radius[1], slant = hypot(rise, c.length);
  c.side[0] = c.length / slant;
  c.side[1] = rise / slant;
  return c;
}

/* Distance f in the half plane (rho >= 0, z) from the trapezium (0, 0) (r_a, 0) (r_b, L) (0, L), and the outward
 * direction u = -grad f. Outside of the discs and the mantle the nearest point lies on one of their edges; inside all
 * three are half-planes. */
static double cone_section(const cone *c, double rho, double z, double u[2]) {
  double below = -z, above = z - c->length, out = (rho - c->radius[0]) * c->side[0] + z * c->side[1];
  if (below <= 0 && above <= 0 && out <= 0) {
    double most = fmax(out, fmax(below, above));
    u[0] = most == out ? c->side[0] : 0;
    u[1] = most == out ? c->side[1] : most == above ? 1 : -1;
    return -most;
  }
  /* nearest points of the two discs and of the mantle */
  double along = (c->radius[0] - rho) * c->side[1] + z * c->side[0]; /* from the edge of a towards b */
  double slant = hypot(c->radius[0] - c->radius[1], c->length);
  along = fmin(fmax(along, 0), slant);
  double near[3][2] = {{fmin(rho, c->radius[0]), 0},
                       {fmin(rho, c->radius[1]), c->length},
                       {c->radius[0] - along * c->side[1], along * c->side[0]}};
  double least = INFINITY;
  u[0] = u[1] = 0; /* stays where no distance is a number */
  for (int i = 0; i < 3; i++) {
    double dr = rho - near[i][0], dz = z - near[i][1], d = hypot(dr, dz);
    if (!(d < least)) continue;
    least = d;
    u[0] = d > 0 ? dr / d : c->side[0];
    u[1] = d > 0 ? dz / d : c->side[1];
  }
  return -least;
}

/* f at a point; outward [3] may be NULL. On the axis the outward direction lies along it, as far as it has one. */
static double cone_at(const cone *c, const double *x, double *outward) {
  double d[3], z = 0, square = 0, u[2];
  for (int k = 0; k < 3; k++) {
    d[k] = x[k] - c->a[k];
    z += d[k] * c->axis[k];
  }
  for (int k = 0; k < 3; k++) {
    d[k] -= z * c->axis[k];
    square += d[k] * d[k];
  }
  double rho = sqrt(square), f = cone_section(c, rho, z, u);
  for (int k = 0; outward && k < 3; k++) outward[k] = (rho > 0 ? u[0] * d[k] / rho : 0) + u[1] * c->axis[k];
  return f;
}

static batten_status cone_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                   double *values, double *gradients) {
  cone c = cone_of(a);
  (void)ctx;
  for (size_t i = 0; i < count; i++) {
    values[i] = cone_at(&c, points + 3 * i, gradients ? gradients + 3 * i : NULL);
    for (size_t k = 3 * i; gradients && k < 3 * i + 3; k++) gradients[k] = -gradients[k];
  }
  return BATTEN_OK;
}

/* h - u . (x - a) over a box for u of about unit length, as a bound of f above: with U = u / |u|. Support over the
 * two discs: (a: r_a |u across|; b: r_b |u across| + L u . axis). */
static double cone_support_bound(const cone *c, const double *lower, const double *upper, const double *u) {
  double along = 0, square = 0, reach = 0, size = 0;
  for (int k = 0; k < 3; k++) {
    along += u[k] * c->axis[k];
    square += u[k] * u[k];
  }
  double across = 0; /* from the part itself: along^2 taken from the square would leave 1e-8 of rounding */
  for (int k = 0; k < 3; k++) across += (u[k] - along * c->axis[k]) * (u[k] - along * c->axis[k]);
  across = sqrt(across);
  for (int k = 0; k < 3; k++) {
    double nearest = u[k] > 0 ? lower[k] : upper[k];
    reach += u[k] * (nearest - c->a[k]);
    size = fmax(size, fabs(nearest) + fabs(c->a[k]));
  }
  double h = fmax(c->radius[0] * across, c->radius[1] * across + c->length * along);
  return (h - reach) / sqrt(square) + 0x1p-46 * (size + c->length + c->radius[0] + c->radius[1]);
}

static batten_status cone_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                 double *ranges) {
  cone c = cone_of(a);
  (void)ctx;
  for (size_t i = 0; i < count; i++) {
    const double *lower = boxes + 6 * i, *upper = lower + 3;
    double lo = INFINITY, middle[3], u[3], size = 0;
    for (int corner = 0; corner < 8; corner++) {
      const double x[3] = {corner & 1 ? upper[0] : lower[0], corner & 2 ? upper[1] : lower[1],
                           corner & 4 ? upper[2] : lower[2]};
      lo = fmin(lo, cone_at(&c, x, NULL));
    }
    for (int k = 0; k < 3; k++) {
      middle[k] = lower[k] / 2 + upper[k] / 2;
      size = fmax(size, fmax(fabs(lower[k]), fabs(upper[k])) + fabs(c.a[k]));
    }
    cone_at(&c, middle, u);
    double hi = INFINITY, caps[2][3];
    for (int k = 0; k < 3; k++) {
      caps[0][k] = c.axis[k];
      caps[1][k] = -c.axis[k];
    }
    if (u[0] != 0 || u[1] != 0 || u[2] != 0) hi = cone_support_bound(&c, lower, upper, u);
    for (int cap = 0; cap < 2; cap++) hi = fmin(hi, cone_support_bound(&c, lower, upper, caps[cap]));
    /* 0x1p-46: some sixty roundings of the coordinates from a, and of its axis */
    ranges[2 * i] = lo - 0x1p-46 * (size + c.length + c.radius[0] + c.radius[1]);
    ranges[2 * i + 1] = hi;
  }
  return BATTEN_OK;
}

/* Discs of radius r across the axis reach r sqrt(1 - axis_k^2) along coordinate k: the other two of the axis. */
static bool cone_box(const batten_frep *a, double *lower, double *upper) {
  cone c = cone_of(a);
  for (int k = 0; k < 3; k++) {
    double reach = hypot(c.axis[(k + 1) % 3], c.axis[(k + 2) % 3]) + 0x1p-46;
    lower[k] = fmin(a->numbers[k] - c.radius[0] * reach, a->numbers[3 + k] - c.radius[1] * reach);
    upper[k] = fmax(a->numbers[k] + c.radius[0] * reach, a->numbers[3 + k] + c.radius[1] * reach);
    interval r = interval_widen(lower[k], upper[k], 4);
    lower[k] = r.lo;
    upper[k] = r.hi;
  }
  return true;
}

batten_status batten_frep_cone(batten_context *ctx, const double a[3], const double b[3], double radius_a,
                               double radius_b, batten_frep **out) {
  const double numbers[8] = {a ? a[0] : 0, a ? a[1] : 0, a ? a[2] : 0, b ? b[0] : 0,
                             b ? b[1] : 0, b ? b[2] : 0, radius_a,     radius_b};
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0) st = frep_check_numbers(ctx, "a", 3, a);
  if (st >= 0) st = frep_check_numbers(ctx, "b", 3, b);
  for (int i = 0; st >= 0 && i < 2; i++)
    if (!(numbers[6 + i] >= 0 && isfinite(numbers[6 + i])))
      st = batten_fail(ctx, BATTEN_E_INVALID, "radius_%c: %g; give a finite radius >= 0", i ? 'b' : 'a',
                       numbers[6 + i]);
  if (st >= 0 && radius_a == 0 && radius_b == 0)
    st = batten_fail(ctx, BATTEN_E_INVALID, "radius_a, radius_b: both 0; give a positive one");
  if (st < 0) return st;
  double length = hypot(hypot(b[0] - a[0], b[1] - a[1]), b[2] - a[2]);
  if (!(length > 0 && isfinite(length)))
    return batten_fail(ctx, BATTEN_E_INVALID, "b: at distance %g from a; give two different ends", length);
  batten_frep_parts parts = {.n = 3, .number_count = 8, .numbers = numbers};
  return frep_make(ctx, &frep_class_cone, &parts, true, NULL, out);
}

static batten_status create_cone(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  batten_status st = frep_check_parts(ctx, parts, 8, 0);
  const double *v = parts->numbers;
  return st < 0 ? st : batten_frep_cone(ctx, v, v + 3, v[6], v[7], out);
}

const frep_class frep_class_cone = {.kind = BATTEN_FREP_KIND_CONE,
                                    .name = "cone",
                                    .evaluate = cone_evaluate,
                                    .bounds = cone_bounds,
                                    .box = cone_box,
                                    .create = create_cone};

/* ---- gyroid -------------------------------------------------------------------------------------------- */

/* G = sin X cos Y + sin Y cos Z + sin Z cos X, X = 2 pi x / period. On G = 0 its slope by X, Y, Z has the mean 1.531
 * over the surface's area (from 1.414 to 1.732), so |G| period / (2 pi 1.531) is about the distance to it. */
#define GYROID_SLOPE 1.531
static const double two_pi = 6.28318530717958647692;

static batten_status gyroid_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                     double *values, double *gradients) {
  const double k = two_pi / a->numbers[0], half = a->numbers[1] / 2, unit = 1 / (k * GYROID_SLOPE);
  (void)ctx;
  for (size_t i = 0; i < count; i++) {
    double s[3], c[3];
    for (int j = 0; j < 3; j++) {
      s[j] = sin(k * points[3 * i + (size_t)j]);
      c[j] = cos(k * points[3 * i + (size_t)j]);
    }
    double G = s[0] * c[1] + s[1] * c[2] + s[2] * c[0], turn = G < 0 ? 1 : -1;
    values[i] = half - fabs(G) * unit;
    for (int j = 0; gradients && j < 3; j++)
      gradients[3 * i + (size_t)j] = turn * k * unit * (c[j] * c[(j + 1) % 3] - s[j] * s[(j + 2) % 3]);
  }
  return BATTEN_OK;
}

/* Sines and cosines of intervals, and the mean value form with the intervals of the slopes. Their widening by 8
 * units, and by that of the products, is more than the evaluation's rounding; that of k x is in the arguments. */
static interval gyroid_range(const double *lower, const double *upper, double k) {
  interval s[3], c[3], t[3], G = interval_of(0), mean = interval_of(0);
  interval middle_s[3], middle_c[3];
  for (int j = 0; j < 3; j++) {
    interval middle = interval_scale(interval_of(lower[j] / 2 + upper[j] / 2), k);
    t[j] = interval_scale((interval){lower[j], upper[j]}, k);
    s[j] = interval_sin(t[j]);
    c[j] = interval_cos(t[j]);
    middle_s[j] = interval_sin(middle);
    middle_c[j] = interval_cos(middle);
    t[j] = interval_sub(t[j], middle);
  }
  for (int j = 0; j < 3; j++) {
    int next = (j + 1) % 3, last = (j + 2) % 3;
    interval slope = interval_sub(interval_mul(c[j], c[next]), interval_mul(s[j], s[last]));
    G = interval_add(G, interval_mul(s[j], c[next]));
    mean = interval_add(mean, interval_mul(middle_s[j], middle_c[next]));
    mean = interval_add(mean, interval_mul(slope, t[j]));
  }
  return interval_meet(G, mean);
}

static batten_status gyroid_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                   double *ranges) {
  const double k = two_pi / a->numbers[0], half = a->numbers[1] / 2, unit = 1 / (k * GYROID_SLOPE);
  (void)ctx;
  for (size_t i = 0; i < count; i++) {
    interval G = gyroid_range(boxes + 6 * i, boxes + 6 * i + 3, k);
    interval r = interval_sub(interval_of(half), interval_scale(interval_abs(G), unit));
    ranges[2 * i] = r.lo;
    ranges[2 * i + 1] = r.hi;
  }
  return BATTEN_OK;
}

/* Each slope c c' - s s' lies within [-1, 1] (Cauchy-Schwarz), so the three have at most sqrt(3), reached where all
 * are 1. */
static batten_status gyroid_slopes(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                   double *slopes) {
  (void)a, (void)ctx, (void)boxes;
  for (size_t i = 0; i < count; i++) slopes[i] = 1.7320508075688773 / GYROID_SLOPE * (1 + 1e-12);
  return BATTEN_OK;
}

batten_status batten_frep_gyroid(batten_context *ctx, double period, double thickness, batten_frep **out) {
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0) st = frep_check_positive(ctx, "period", period);
  if (st >= 0) st = frep_check_positive(ctx, "thickness", thickness);
  if (st < 0) return st;
  batten_frep_parts parts = {.n = 3, .number_count = 2, .numbers = (const double[2]){period, thickness}};
  return frep_make(ctx, &frep_class_gyroid, &parts, false, NULL, out);
}

static batten_status create_gyroid(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  batten_status st = frep_check_parts(ctx, parts, 2, 0);
  return st < 0 ? st : batten_frep_gyroid(ctx, parts->numbers[0], parts->numbers[1], out);
}

const frep_class frep_class_gyroid = {.kind = BATTEN_FREP_KIND_GYROID,
                                      .name = "gyroid",
                                      .evaluate = gyroid_evaluate,
                                      .bounds = gyroid_bounds,
                                      .slopes = gyroid_slopes,
                                      .create = create_gyroid};
