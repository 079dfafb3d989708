/* Sweeps along paths: what they are made of, and sweeps of solids in space, which do not turn: the largest of f(x -
 * path(t) + path(0)) along the path. Profiles in the plane are in sweep_profile.c. */
#include <string.h>

#include "base/checked.h"
#include "frep/gather.h"
#include "frep/highest.h"
#include "frep/sweep_profile.h"

enum { LEAST_PIECES = 32 /* of a solid's path: what its bounds do not settle is looked at in so many steps */ };

static void place(const void *user, size_t piece, double u, const double *x, double *y) {
  const sweep_path *path = user;
  sweep_piece_at(path->piece + piece, u, y, NULL, NULL);
  for (unsigned k = 0; k < 3; k++) y[k] = x[k] - y[k];
}

static void velocity(const void *user, size_t piece, double u, double *dy) {
  const sweep_path *path = user;
  sweep_piece_at(path->piece + piece, u, NULL, dy, NULL);
  for (unsigned k = 0; k < 3; k++) dy[k] = -dy[k];
}

/* Bezier points hold their curve; at an end the curve is one of them. Rounding: a few ulps of the largest. */
static void image(const void *user, size_t piece, double from, double to, const interval *x, interval *y) {
  const sweep_path *path = user;
  const sweep_piece *p = path->piece + piece;
  const double *end = from == 1 ? p->b[3] : to == 0 ? p->b[0] : NULL;
  for (unsigned k = 0; k < 3; k++) {
    interval o = end ? interval_of(end[k]) : (interval){p->low[k], p->high[k]};
    double size = fmax(-p->low[k], p->high[k]);
    y[k] = interval_sub(x[k], interval_widen(o.lo - 4e-15 * size, o.hi + 4e-15 * size, 1));
  }
}

static frep_track track_of(const batten_frep *a) {
  const sweep_path *path = a->state;
  return (frep_track){.child = a->children[0],
                      .n = 3,
                      .user = path,
                      .pieces = path->pieces,
                      .place = place,
                      .velocity = velocity,
                      .image = image};
}

static batten_status sweep_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                    double *values, double *gradients) {
  if (a->children[0]->n == 2) return frep_profile_evaluate(a, a->state, ctx, count, points, values, gradients);
  frep_track track = track_of(a);
  return frep_highest(&track, ctx, count, points, values, gradients);
}

static batten_status sweep_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                  double *ranges) {
  if (a->children[0]->n == 2) return frep_profile_bounds(a, a->state, ctx, count, boxes, ranges);
  frep_track track = track_of(a);
  return frep_highest_bounds(&track, ctx, count, boxes, ranges);
}

static batten_status sweep_slopes(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                  double *slopes) {
  if (a->children[0]->n == 2) { /* planes across a bend run together: no bound is known */
    for (size_t i = 0; i < count; i++) slopes[i] = INFINITY;
    return BATTEN_OK;
  }
  frep_track track = track_of(a);
  return frep_highest_slopes(&track, ctx, count, boxes, slopes);
}

/* The path's box widened by the child's: of a solid as it is, of a profile by its reach to all sides. */
static bool sweep_box(const batten_frep *a, double *lower, double *upper) {
  const sweep_path *path = a->state;
  const batten_frep *child = a->children[0];
  double low[3], high[3];
  if (!frep_structural_box(child, low, high)) return false;
  bool empty = false;
  double reach = 0;
  for (unsigned k = 0; k < child->n; k++) {
    empty = empty || low[k] > high[k];
    reach = hypot(reach, fmax(fabs(low[k]), fabs(high[k])));
  }
  sweep_path_box(path, lower, upper);
  for (unsigned k = 0; k < 3; k++) {
    lower[k] += child->n == 2 ? path->base[k] - reach : low[k];
    upper[k] += child->n == 2 ? path->base[k] + reach : high[k];
    double slack = 1e-14 * (fabs(lower[k]) + fabs(upper[k]));
    lower[k] = empty ? 1 : lower[k] - slack;
    upper[k] = empty ? -1 : upper[k] + slack;
  }
  return true;
}

static void sweep_release(void *state) { sweep_path_free(state); }

batten_status batten_frep_sweep(batten_context *ctx, batten_frep *a, size_t count, const double *path, int smooth,
                                int closed, const double *up, batten_frep **out) {
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0) st = frep_check_node(ctx, "a", a, 0);
  if (st < 0) return st;
  size_t least = closed ? 3 : 2, all;
  if (count < least) return batten_fail(ctx, BATTEN_E_INVALID, "count: %zu; give %zu points or more", count, least);
  if (!batten_mul(count, 3, &all) || all > SIZE_MAX - 5)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu points", count);
  st = frep_check_numbers(ctx, "path", all, path);
  if (st >= 0 && up) st = frep_check_numbers(ctx, "up", 3, up);
  if (st < 0) return st;
  sweep_path *state = NULL;
  double *numbers = batten_alloc_array(ctx, all + 5, sizeof *numbers);
  if (!numbers) return BATTEN_E_NOMEM;
  st = sweep_path_make(ctx, count, path, smooth != 0, closed != 0, a->n == 2, up, LEAST_PIECES, &state);
  if (st >= 0) {
    memcpy(numbers, path, all * sizeof *numbers);
    numbers[all] = smooth != 0;
    numbers[all + 1] = closed != 0;
    for (size_t k = 0; k < 3; k++) numbers[all + 2 + k] = up ? up[k] : 0; /* no direction: any */
    batten_frep_parts parts = {
        .n = 3, .number_count = all + 5, .numbers = numbers, .child_count = 1, .children = {a}};
    /* places of a solid are united; of a profile only near the surface is the plane's distance that in space */
    st = frep_make(ctx, &frep_class_sweep, &parts, a->n == 3 && a->distance, state, out);
  }
  if (st < 0) sweep_path_free(state);
  batten_free(ctx, numbers);
  return st;
}

static batten_status sweep_create(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  size_t count = parts->number_count < 5 ? 0 : (parts->number_count - 5) / 3;
  batten_status st = frep_check_parts(ctx, parts, 3 * count + 5, 1);
  if (st < 0) return st;
  const double *rest = parts->numbers + 3 * count;
  return batten_frep_sweep(ctx, parts->children[0], count, parts->numbers, rest[0] != 0, rest[1] != 0, rest + 2, out);
}

const frep_class frep_class_sweep = {.kind = BATTEN_FREP_KIND_SWEEP,
                                     .name = "sweep",
                                     .evaluate = sweep_evaluate,
                                     .bounds = sweep_bounds,
                                     .slopes = sweep_slopes,
                                     .box = sweep_box,
                                     .create = sweep_create,
                                     .release = sweep_release};
