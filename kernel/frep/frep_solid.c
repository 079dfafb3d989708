/* A tree as a solid: what meshes, files and carriers take.
 *
 * Its data points are where neighbouring corners of cells near the surface differ in sign, moved onto the surface by
 * Newton's method: one or more for every piece that the cells show, so that a mesh tracked from them has all pieces.
 */
#include "base/checked.h"
#include "frep/frep_inner.h"
#include "solid/carrier_inner.h"
#include "solid/solid_form.h"

static batten_status tree_evaluate(const void *state, batten_context *ctx, size_t count, const double *points,
                                   double *values, double *gradients, double *hessians) {
  (void)hessians; /* of order 1 */
  return batten_frep_evaluate(ctx, state, count, points, values, gradients);
}

static batten_status tree_bounds(const void *state, batten_context *ctx, size_t count, const double *boxes,
                                 double *ranges) {
  return batten_frep_bounds(ctx, state, count, boxes, ranges);
}

static batten_status tree_slopes(const void *state, batten_context *ctx, size_t count, const double *boxes,
                                 double *ranges, double *slopes) {
  const batten_frep *a = state;
  batten_status st = BATTEN_OK;
  for (size_t first = 0; st >= 0 && first < count; first += FREP_BLOCK) {
    size_t now = count - first < FREP_BLOCK ? count - first : FREP_BLOCK;
    st = frep_both_block(a, ctx, now, boxes + first * 2 * a->n, ranges + 2 * first, slopes + 2 * first);
  }
  return st;
}

static void tree_release(void *state) { batten_frep_free(state); }

static const solid_form tree_form = {.kind = BATTEN_SOLID_TREE,
                                     .order = 1,
                                     .evaluate = tree_evaluate,
                                     .bounds = tree_bounds,
                                     .slopes = tree_slopes,
                                     .release = tree_release};

/* Newton's method along the gradient, each step at most half a cell; a point keeps the place of the least |f|, and
 * stays where it is when there is no slope (0) or no progress. */
static batten_status project(batten_context *ctx, const batten_frep *a, size_t count, double cell, double *points) {
  enum { STEPS = 8 };
  const size_t n = a->n;
  double *f = batten_alloc_array(ctx, count, (2 + 2 * n) * sizeof *f);
  if (!f) return BATTEN_E_NOMEM;
  double *least = f + count, *g = least + count, *at = g + n * count;
  for (size_t i = 0; i < count; i++) least[i] = INFINITY;
  for (size_t i = 0; i < n * count; i++) at[i] = points[i];
  batten_status st = BATTEN_OK;
  for (int step = 0; st >= 0 && step <= STEPS; step++) {
    st = batten_frep_evaluate(ctx, a, count, at, f, g);
    for (size_t i = 0; st >= 0 && i < count; i++) {
      if (!(fabs(f[i]) < least[i])) continue; /* stays at the last place, without a further step */
      least[i] = fabs(f[i]);
      double square = 0;
      for (size_t k = n * i; k < n * i + n; k++) {
        points[k] = at[k];
        square += g[k] * g[k];
      }
      double length = sqrt(square), move = length > 0 ? fmin(fabs(f[i]) / length, cell / 2) : 0;
      for (size_t k = n * i; k < n * i + n && length > 0; k++)
        at[k] = points[k] - (f[i] < 0 ? -move : move) * g[k] / length;
    }
  }
  batten_free(ctx, f);
  return st;
}

static batten_status check_box(batten_context *ctx, const batten_frep *a, const double *lower, const double *upper,
                               double cell) {
  if (!lower != !upper)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give both corners of the box, or neither",
                       lower ? "upper" : "lower");
  for (unsigned k = 0; lower && k < a->n; k++)
    if (!(isfinite(lower[k]) && isfinite(upper[k]) && lower[k] < upper[k]))
      return batten_fail(ctx, BATTEN_E_INVALID, "lower[%u], upper[%u]: %g, %g; give finite corners, lower < upper", k,
                         k, lower[k], upper[k]);
  if (!(cell >= 0 && isfinite(cell)))
    return batten_fail(ctx, BATTEN_E_INVALID, "cell: %g; give a positive finite length, or 0", cell);
  return BATTEN_OK;
}

static batten_status check_tree(batten_context *ctx, const batten_frep *a, const void *out) {
  batten_status st = out ? BATTEN_OK : batten_fail(ctx, BATTEN_E_INVALID, "out: NULL; give the place for the solid");
  if (st >= 0) st = frep_check_node(ctx, "a", a, 0);
  if (st >= 0 && a->below > CARRIER_DEPTH)
    st = batten_fail(ctx, BATTEN_E_TOO_LARGE, "a: solids nested %u levels deep, %d are allowed", a->below,
                     CARRIER_DEPTH);
  return st;
}

static batten_status make_solid(batten_context *ctx, batten_frep *a, const double *lower, const double *upper,
                                size_t count, const double *points, batten_solid **out) {
  batten_frep *state = batten_frep_retain(a);
  batten_status st = batten_solid_make(ctx, &tree_form, state, a->n, a->below, lower, upper, count, points, out);
  if (st < 0) batten_frep_free(state);
  return st;
}

batten_status batten_frep_solid_create(batten_context *ctx, batten_frep *a, const double *lower, const double *upper,
                                       size_t count, const double *points, batten_solid **out) {
  batten_status st = check_tree(ctx, a, out);
  if (st >= 0 && (!lower || !upper))
    st = batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a corner of the box", lower ? "upper" : "lower");
  if (st >= 0) st = check_box(ctx, a, lower, upper, 0);
  if (st >= 0 && (count == 0 || !points))
    st = batten_fail(ctx, BATTEN_E_INVALID, "%s; give points on the surface, one or more",
                     count ? "points: NULL" : "count: 0");
  size_t numbers;
  if (st >= 0 && !batten_mul(count, a->n, &numbers))
    st = batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu; beyond the address space", count);
  if (st >= 0) st = frep_check_numbers(ctx, "points", numbers, points);
  return st < 0 ? st : make_solid(ctx, a, lower, upper, count, points, out);
}

batten_status batten_frep_to_solid(batten_context *ctx, batten_frep *a, const double *lower, const double *upper,
                                   double cell, batten_solid **out) {
  batten_status st = check_tree(ctx, a, out);
  if (st >= 0) st = check_box(ctx, a, lower, upper, cell);
  if (st < 0) return st;
  double low[3], high[3], diagonal = 0, *seeds = NULL;
  size_t count = 0;
  for (unsigned k = 0; lower && k < a->n; k++) {
    low[k] = lower[k];
    high[k] = upper[k];
  }
  if (!lower) st = batten_frep_box(ctx, a, low, high);
  if (st < 0) return st;
  for (unsigned k = 0; k < a->n; k++) diagonal = hypot(diagonal, high[k] - low[k]);
  if (cell == 0) cell = diagonal / 60;
  batten_field field = batten_frep_field(a);
  st = batten_find_seeds(ctx, &field, low, high, cell, &count, &seeds);
  if (st >= 0) st = project(ctx, a, count, cell, seeds);
  if (st >= 0) st = make_solid(ctx, a, low, high, count, seeds, out);
  batten_free(ctx, seeds);
  return st;
}

batten_frep *batten_solid_tree(const batten_solid *s) { return batten_solid_state(s, &tree_form); }
