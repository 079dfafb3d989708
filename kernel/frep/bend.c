/* Bends: the height along an axis becomes an arc.   [Barr 1984]
 *
 * In the plane of u (towards the middle of the arc) and h (along the axis, from `lower`), with R = 1 / curvature and
 * the angle A = curvature (upper - lower), the straight solid at (u, h) comes to
 *   h <= 0       (u, h)
 *   within       (R - (R - u) cos(h / R), (R - u) sin(h / R))
 *   beyond       the same at angle A, and straight on along the tangent there.
 * The inverse is polar about (R, 0): with (c, s) = (R - u, h) the arc takes the angles 0 .. A, the part below c > 0,
 * s < 0, the part beyond the same after a turn by -A. Each is one to one for u < R. Arcs beyond half a turn come back
 * to the straight parts, so that a point may have two or three places: the solid is the union of them. What is left
 * lies beyond the fold u = R of the straight parts, and takes the value at the fold of the nearer one. */
#include "base/checked.h"
#include "frep/axis_frame.h"

#define PI 3.14159265358979323846

typedef struct bend_state {
  frep_frame frame;
  double lower, upper, radius, angle, cos_angle, sin_angle;
} bend_state;

/* ---- points --------------------------------------------------------------------------------------- */

static void straight_below(const bend_state *s, const double *q, double c, double d, frep_place *p) {
  const double psi[3] = {s->radius - fmax(c, 0), q[1], s->lower + fmin(d, 0)};
  double psi_q[3][3] = {{c > 0, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  frep_frame_back(&s->frame, psi, psi_q, p);
}

/* c, d after the turn. */
static void straight_beyond(const bend_state *s, const double *q, double c, double d, frep_place *p) {
  const double psi[3] = {s->radius - fmax(c, 0), q[1], s->upper + fmax(d, 0)};
  double in = c > 0;
  double psi_q[3][3] = {{in * s->cos_angle, 0, -in * s->sin_angle}, {0, 1, 0}, {s->sin_angle, 0, s->cos_angle}};
  frep_frame_back(&s->frame, psi, psi_q, p);
}

static void along_arc(const bend_state *s, const double *q, double c, double d, double angle, frep_place *p) {
  double far = hypot(c, d), inverse = far > 0 ? 1 / far : 0;
  const double psi[3] = {s->radius - far, q[1], s->lower + angle * s->radius};
  double along_c = c * inverse, along_d = d * inverse, steep = s->radius * inverse;
  double psi_q[3][3] = {{along_c, 0, -along_d}, {0, 1, 0}, {steep * along_d, 0, steep * along_c}};
  frep_frame_back(&s->frame, psi, psi_q, p);
}

static unsigned bend_places(const batten_frep *a, const double *x, frep_place *places) {
  const bend_state *s = a->state;
  double q[3];
  frep_frame_into(&s->frame, x, q);
  double c = s->radius - q[0], d = q[2] - s->lower;
  double turned_c = c * s->cos_angle + d * s->sin_angle, turned_d = d * s->cos_angle - c * s->sin_angle;
  double angle = atan2(d, c);
  if (angle < 0) angle += 2 * PI;
  bool arc = angle <= s->angle, below = c > 0 && d<0, beyond = turned_c> 0 && turned_d > 0;
  if (!arc && !below && !beyond) {
    beyond = angle < s->angle / 2 + PI;
    below = !beyond;
  }
  unsigned made = 0;
  if (arc) along_arc(s, q, c, d, angle, places + made++);
  if (below) straight_below(s, q, c, d, places + made++);
  if (beyond) straight_beyond(s, q, turned_c, turned_d, places + made++);
  return made;
}

/* ---- boxes ---------------------------------------------------------------------------------------- */

/* The angles of a box about 0 that lie in 0 .. limit, into *within; returns whether there are any. *all: are there no
 * others? 1e-14: ample for the rounding of atan2 and of the turns added. */
static bool angles_of(interval c, interval d, double limit, interval *within, bool *all) {
  const double slack = 1e-14;
  *all = false;
  *within = (interval){0, limit};
  if (c.lo <= 0 && c.hi >= 0 && d.lo <= 0 && d.hi >= 0) return true;
  double middle = atan2(d.lo / 2 + d.hi / 2, c.lo / 2 + c.hi / 2), least = 0, most = 0;
  for (unsigned corner = 0; corner < 4; corner++) { /* seen from 0 a box takes less than half a turn */
    double off = atan2(corner & 2 ? d.hi : d.lo, corner & 1 ? c.hi : c.lo) - middle;
    off -= 2 * PI * round(off / (2 * PI));
    least = fmin(least, off);
    most = fmax(most, off);
  }
  interval found = {INFINITY, -INFINITY};
  for (int turn = -1; turn <= 1; turn++) {
    double lo = middle + least + 2 * PI * turn - slack, hi = middle + most + 2 * PI * turn + slack;
    if (lo >= 0 && hi <= limit) *all = true;
    if (hi < 0 || lo > limit) continue;
    found = interval_hull(found, (interval){fmax(lo, 0), fmin(hi, limit)});
  }
  if (found.lo > found.hi) return false;
  *within = found;
  return true;
}

static unsigned bend_images(const batten_frep *a, const interval *x, frep_image *images) {
  const bend_state *s = a->state;
  const interval radius = interval_of(s->radius), lower = interval_of(s->lower), zero = {0, 0};
  interval q[3], angle;
  frep_frame_into_range(&s->frame, x, q);
  interval c = interval_sub(radius, q[0]), d = interval_sub(q[2], lower);
  interval turned_c = interval_add(interval_scale(c, s->cos_angle), interval_scale(d, s->sin_angle));
  interval turned_d = interval_sub(interval_scale(d, s->cos_angle), interval_scale(c, s->sin_angle));
  bool all, arc = angles_of(c, d, s->angle, &angle, &all);
  unsigned made = 0;
  if (arc) {
    interval far = interval_hypot(c, d);
    interval height = interval_add(lower, interval_scale(angle, s->radius));
    images[made++] = frep_frame_image(&s->frame, (const interval[3]){interval_sub(radius, far), q[1], height},
                                      fmax(1, s->radius / far.lo));
    images[made - 1].group = all ? 1 : 0;
  }
  bool all_below = c.lo > 0 && d.hi<0, all_beyond = turned_c.lo> 0 && turned_d.lo > 0;
  bool fold = !all && !all_below && !all_beyond;
  if (d.lo < 0 && (fold || c.hi > 0)) {
    interval u = interval_sub(radius, interval_max(c, zero)), height = interval_add(lower, interval_min(d, zero));
    images[made++] = frep_frame_image(&s->frame, (const interval[3]){u, q[1], height}, 1);
    images[made - 1].group = all_below ? 2 : 0;
  }
  if (turned_d.hi > 0 && (fold || turned_c.hi > 0)) {
    interval u = interval_sub(radius, interval_max(turned_c, zero));
    interval height = interval_add(interval_of(s->upper), interval_max(turned_d, zero));
    images[made++] = frep_frame_image(&s->frame, (const interval[3]){u, q[1], height}, 1);
    images[made - 1].group = all_beyond ? 3 : 0;
  }
  return made;
}

static batten_status bend_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                   double *values, double *gradients) {
  return frep_map_evaluate(a, ctx, bend_places, count, points, values, gradients);
}

static batten_status bend_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                 double *ranges) {
  return frep_map_bounds(a, ctx, bend_images, count, boxes, ranges, NULL);
}

static batten_status bend_slopes(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                 double *slopes) {
  return frep_map_bounds(a, ctx, bend_images, count, boxes, NULL, slopes);
}

/* Forward: the hull of what the three parts make of the child's box. A box across the fold tells none: beyond it the
 * value at the fold goes on. */
static bool bend_box(const batten_frep *a, double *lower, double *upper) {
  const bend_state *s = a->state;
  interval q[3], hull[3];
  bool empty;
  if (!frep_frame_child_box(a, &s->frame, q, &empty)) return false;
  if (!empty) {
    if (q[0].hi >= s->radius) return false;
    const interval radius = interval_of(s->radius), far = interval_sub(radius, q[0]);
    hull[0] = hull[2] = (interval){INFINITY, -INFINITY};
    hull[1] = q[1];
    if (q[2].lo < s->lower) {
      hull[0] = q[0];
      hull[2] = (interval){q[2].lo, fmin(q[2].hi, s->lower)};
    }
    if (q[2].hi >= s->lower && q[2].lo <= s->upper) {
      interval height = {fmax(q[2].lo, s->lower), fmin(q[2].hi, s->upper)};
      interval angle = interval_div(interval_sub(height, interval_of(s->lower)), radius);
      hull[0] = interval_hull(hull[0], interval_sub(radius, interval_mul(far, interval_cos(angle))));
      hull[2] = interval_hull(hull[2], interval_add(interval_of(s->lower), interval_mul(far, interval_sin(angle))));
    }
    if (q[2].hi > s->upper) {
      interval on = interval_sub((interval){fmax(q[2].lo, s->upper), q[2].hi}, interval_of(s->upper));
      interval c = interval_sub(interval_scale(far, s->cos_angle), interval_scale(on, s->sin_angle));
      interval d = interval_add(interval_scale(far, s->sin_angle), interval_scale(on, s->cos_angle));
      hull[0] = interval_hull(hull[0], interval_sub(radius, c));
      hull[2] = interval_hull(hull[2], interval_add(interval_of(s->lower), d));
    }
  }
  frep_frame_box(&s->frame, empty, hull, lower, upper);
  return true;
}

batten_status batten_frep_bend(batten_context *ctx, batten_frep *a, const double origin[3], const double axis[3],
                               const double direction[3], double curvature, double lower, double upper,
                               batten_frep **out) {
  double unit[3], towards[3];
  batten_status st = frep_frame_check(ctx, a, origin, axis, unit, out);
  if (st >= 0) st = frep_check_direction(ctx, "direction", 3, direction, towards);
  if (st >= 0) st = frep_check_positive(ctx, "curvature", curvature);
  if (st >= 0) st = frep_frame_check_heights(ctx, lower, upper);
  if (st < 0) return st;
  double angle = curvature * (upper - lower);
  if (!(angle <= 2 * PI * (1 + 1e-12)))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "curvature: %g makes %g turns between lower and upper; give at most %g, one turn", curvature,
                       angle / (2 * PI), 2 * PI / (upper - lower));
  bend_state s = {.lower = lower, .upper = upper, .radius = 1 / curvature, .angle = angle};
  s.cos_angle = cos(angle);
  s.sin_angle = sin(angle);
  if (!isfinite(s.radius))
    return batten_fail(ctx, BATTEN_E_INVALID, "curvature: %g; its radius is too large for a number", curvature);
  if (!frep_frame_set(&s.frame, origin, unit, towards))
    return batten_fail(ctx, BATTEN_E_INVALID, "direction: lies along axis; give one across it");
  const double numbers[12] = {origin[0],    origin[1],    origin[2],    axis[0],   axis[1], axis[2],
                              direction[0], direction[1], direction[2], curvature, lower,   upper};
  return frep_frame_make(ctx, &frep_class_bend, a, 12, numbers, &s, sizeof s, out);
}

static batten_status bend_create(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  const double *v = parts->numbers;
  batten_status st = frep_check_parts(ctx, parts, 12, 1);
  return st < 0 ? st : batten_frep_bend(ctx, parts->children[0], v, v + 3, v + 6, v[9], v[10], v[11], out);
}

const frep_class frep_class_bend = {.kind = BATTEN_FREP_KIND_BEND,
                                    .name = "bend",
                                    .evaluate = bend_evaluate,
                                    .bounds = bend_bounds,
                                    .slopes = bend_slopes,
                                    .box = bend_box,
                                    .create = bend_create};
