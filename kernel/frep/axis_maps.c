/* Twists and tapers: maps in a frame about an axis.   [Barr 1984] */
#include "frep/axis_frame.h"

/* ---- twist ---------------------------------------------------------------------------------------- */

typedef struct twist_state {
  frep_frame frame;
  double rate;
} twist_state;

static unsigned twist_places(const batten_frep *a, const double *x, frep_place *p) {
  const twist_state *s = a->state;
  double q[3];
  frep_frame_into(&s->frame, x, q);
  double angle = s->rate * q[2], c = cos(angle), d = sin(angle);
  const double psi[3] = {c * q[0] + d * q[1], c * q[1] - d * q[0], q[2]};
  double psi_q[3][3] = {{c, d, s->rate * psi[1]}, {-d, c, -s->rate * psi[0]}, {0, 0, 1}};
  frep_frame_back(&s->frame, psi, psi_q, p);
  return 1;
}

/* cos(t) u + sin(t) v over ranges of u, v and t: for every t its extremes stand in corners of (u, v), where it is r
 * cos(t - phi), so that the hull of four ranges is no wider than it must be. */
static interval turned_range(interval u, interval v, interval t) {
  interval hull = {INFINITY, -INFINITY};
  for (unsigned corner = 0; corner < 4; corner++) {
    double x = corner & 1 ? u.hi : u.lo, y = corner & 2 ? v.hi : v.lo, r = hypot(x, y), phi = atan2(y, x);
    interval angle = interval_sub(t, interval_widen(phi, phi, 8));
    hull = interval_hull(hull, interval_mul(interval_widen(r, r, 8), interval_cos(angle)));
  }
  /* what cos and sin of a rounded angle differ by stands in the angle; the sum's own rounding */
  double size = fabs(u.lo) + fabs(u.hi) + fabs(v.lo) + fabs(v.hi);
  return interval_widen(hull.lo - 1e-15 * size, hull.hi + 1e-15 * size, 8);
}

/* A box that turns far off the axis is looked at in arcs: the hull of all of them would hold what lies about the axis
 * too. */
static unsigned twist_images(const batten_frep *a, const interval *x, frep_image *images) {
  static const double sixth = 1.0471975511965976, turn = 6.2831853071795865;
  const twist_state *s = a->state;
  interval q[3];
  frep_frame_into_range(&s->frame, x, q);
  const interval radius = interval_hypot(q[0], q[1]);
  const double width = fabs(s->rate) * (q[2].hi - q[2].lo);
  const bool around = !(width < turn);
  const unsigned most = radius.lo > radius.hi / 2 ? FREP_IMAGES : 1;
  const unsigned arcs = around ? most : (unsigned)fmin(1 + width / sixth, most);
  for (unsigned i = 0; i < arcs; i++) {
    const double from = (double)i / arcs, to = (double)(i + 1) / arcs;
    interval z = q[2], angle = interval_widen(turn * from, turn * to, 4);
    if (!around) {
      if (i > 0) z.lo = (1 - from) * q[2].lo + from * q[2].hi;
      if (i + 1 < arcs) z.hi = (1 - to) * q[2].lo + to * q[2].hi;
      angle = interval_scale(z, s->rate);
    }
    const interval psi[3] = {turned_range(q[0], q[1], angle), turned_range(q[1], interval_neg(q[0]), angle), z};
    images[i] = frep_frame_image(&s->frame, psi, 1 + fabs(s->rate) * radius.hi);
    images[i].group = 1;
  }
  return arcs;
}

static batten_status twist_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                    double *values, double *gradients) {
  return frep_map_evaluate(a, ctx, twist_places, count, points, values, gradients);
}

static batten_status twist_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                  double *ranges) {
  return frep_map_bounds(a, ctx, twist_images, count, boxes, ranges, NULL);
}

static batten_status twist_slopes(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                  double *slopes) {
  return frep_map_bounds(a, ctx, twist_images, count, boxes, NULL, slopes);
}

static bool twist_box(const batten_frep *a, double *lower, double *upper) {
  const twist_state *s = a->state;
  interval q[3];
  bool empty;
  if (!frep_frame_child_box(a, &s->frame, q, &empty)) return false;
  if (!empty) {
    interval angle = interval_neg(interval_scale(q[2], s->rate)), u = q[0];
    q[0] = turned_range(u, q[1], angle);
    q[1] = turned_range(q[1], interval_neg(u), angle);
  }
  frep_frame_box(&s->frame, empty, q, lower, upper);
  return true;
}

batten_status batten_frep_twist(batten_context *ctx, batten_frep *a, const double origin[3], const double axis[3],
                                double rate, batten_frep **out) {
  double unit[3];
  batten_status st = frep_frame_check(ctx, a, origin, axis, unit, out);
  if (st >= 0) st = frep_check_numbers(ctx, "rate", 1, &rate);
  if (st < 0) return st;
  const double numbers[7] = {origin[0], origin[1], origin[2], axis[0], axis[1], axis[2], rate};
  twist_state s = {.rate = rate};
  frep_frame_any(&s.frame, origin, unit);
  return frep_frame_make(ctx, &frep_class_twist, a, 7, numbers, &s, sizeof s, out);
}

static batten_status twist_create(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  const double *v = parts->numbers;
  batten_status st = frep_check_parts(ctx, parts, 7, 1);
  return st < 0 ? st : batten_frep_twist(ctx, parts->children[0], v, v + 3, v[6], out);
}

const frep_class frep_class_twist = {.kind = BATTEN_FREP_KIND_TWIST,
                                     .name = "twist",
                                     .evaluate = twist_evaluate,
                                     .bounds = twist_bounds,
                                     .slopes = twist_slopes,
                                     .box = twist_box,
                                     .create = twist_create};

/* ---- taper ---------------------------------------------------------------------------------------- */

typedef struct taper_state {
  frep_frame frame;
  double lower, upper, scale_lower, scale_upper;
} taper_state;

static double taper_scale(const taper_state *s, double h, double *slope) {
  double t = (h - s->lower) / (s->upper - s->lower);
  *slope = t > 0 && t < 1 ? (s->scale_upper - s->scale_lower) / (s->upper - s->lower) : 0;
  t = t > 0 ? t < 1 ? t : 1 : 0;
  return (1 - t) * s->scale_lower + t * s->scale_upper;
}

/* It is monotone in h; one ulp per operation of each of its ends. */
static interval taper_range(const taper_state *s, interval h) {
  double slope, p = taper_scale(s, h.lo, &slope), q = taper_scale(s, h.hi, &slope);
  interval range = interval_widen(fmin(p, q), fmax(p, q), 8);
  double least = fmin(s->scale_lower, s->scale_upper), most = fmax(s->scale_lower, s->scale_upper);
  return (interval){fmax(range.lo, least * (1 - 1e-15)), fmin(range.hi, most * (1 + 1e-15))};
}

static unsigned taper_places(const batten_frep *a, const double *x, frep_place *p) {
  const taper_state *s = a->state;
  double q[3], slope;
  frep_frame_into(&s->frame, x, q);
  double scale = taper_scale(s, q[2], &slope), bend = -slope / scale;
  const double psi[3] = {q[0] / scale, q[1] / scale, q[2]};
  double psi_q[3][3] = {{1 / scale, 0, bend * psi[0]}, {0, 1 / scale, bend * psi[1]}, {0, 0, 1}};
  frep_frame_back(&s->frame, psi, psi_q, p);
  return 1;
}

static unsigned taper_images(const batten_frep *a, const interval *x, frep_image *image) {
  const taper_state *s = a->state;
  interval q[3];
  frep_frame_into_range(&s->frame, x, q);
  interval scale = taper_range(s, q[2]);
  const interval psi[3] = {interval_div(q[0], scale), interval_div(q[1], scale), q[2]};
  double slope = fabs(s->scale_upper - s->scale_lower) / (s->upper - s->lower);
  double shear = slope / scale.lo * interval_hypot(psi[0], psi[1]).hi;
  *image = frep_frame_image(&s->frame, psi, fmax(1, 1 / scale.lo) + shear);
  return 1;
}

static batten_status taper_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                    double *values, double *gradients) {
  return frep_map_evaluate(a, ctx, taper_places, count, points, values, gradients);
}

static batten_status taper_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                  double *ranges) {
  return frep_map_bounds(a, ctx, taper_images, count, boxes, ranges, NULL);
}

static batten_status taper_slopes(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                  double *slopes) {
  return frep_map_bounds(a, ctx, taper_images, count, boxes, NULL, slopes);
}

static bool taper_box(const batten_frep *a, double *lower, double *upper) {
  const taper_state *s = a->state;
  interval q[3];
  bool empty;
  if (!frep_frame_child_box(a, &s->frame, q, &empty)) return false;
  if (!empty) {
    interval scale = taper_range(s, q[2]);
    q[0] = interval_mul(q[0], scale);
    q[1] = interval_mul(q[1], scale);
  }
  frep_frame_box(&s->frame, empty, q, lower, upper);
  return true;
}

batten_status batten_frep_taper(batten_context *ctx, batten_frep *a, const double origin[3], const double axis[3],
                                double lower, double upper, double scale_lower, double scale_upper,
                                batten_frep **out) {
  double unit[3];
  batten_status st = frep_frame_check(ctx, a, origin, axis, unit, out);
  if (st >= 0) st = frep_frame_check_heights(ctx, lower, upper);
  if (st >= 0) st = frep_check_positive(ctx, "scale_lower", scale_lower);
  if (st >= 0) st = frep_check_positive(ctx, "scale_upper", scale_upper);
  if (st < 0) return st;
  const double numbers[10] = {origin[0], origin[1], origin[2], axis[0],     axis[1],
                              axis[2],   lower,     upper,     scale_lower, scale_upper};
  taper_state s = {.lower = lower, .upper = upper, .scale_lower = scale_lower, .scale_upper = scale_upper};
  frep_frame_any(&s.frame, origin, unit);
  return frep_frame_make(ctx, &frep_class_taper, a, 10, numbers, &s, sizeof s, out);
}

static batten_status taper_create(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  const double *v = parts->numbers;
  batten_status st = frep_check_parts(ctx, parts, 10, 1);
  return st < 0 ? st : batten_frep_taper(ctx, parts->children[0], v, v + 3, v[6], v[7], v[8], v[9], out);
}

const frep_class frep_class_taper = {.kind = BATTEN_FREP_KIND_TAPER,
                                     .name = "taper",
                                     .evaluate = taper_evaluate,
                                     .bounds = taper_bounds,
                                     .slopes = taper_slopes,
                                     .box = taper_box,
                                     .create = taper_create};
