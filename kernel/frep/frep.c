/* Nodes of the algebra of solids: making, sharing, evaluating in batches, bounds over boxes.
 *
 * A node is a row of functions (its class), numbers, and at most two children. Points go through a tree in blocks of
 * FREP_BLOCK: every operation evaluates a whole block of its children before it combines them, so that the costly
 * leaves (reconstructed solids, polygons) see many points at a time, and the price of walking the tree is shared by a
 * block. How points fall into blocks changes nothing: every value depends on its own point alone. */
#include <string.h>

#include "base/checked.h"
#include "frep/frep_inner.h"
#include "solid/carrier_inner.h"
#include "solid/solid_form.h"

/* ---- checks of constructors ----------------------------------------------------------------------- */

batten_status frep_check_out(batten_context *ctx, const void *out) {
  return out ? BATTEN_OK : batten_fail(ctx, BATTEN_E_INVALID, "out: NULL; give the place for the node");
}

batten_status frep_check_node(batten_context *ctx, const char *name, const batten_frep *a, unsigned n) {
  if (!a) return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a node", name);
  if (n == 0 || a->n == n) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "%s: of dimension %u; give a node of dimension %u", name, a->n, n);
}

batten_status frep_check_numbers(batten_context *ctx, const char *name, size_t count, const double *values) {
  if (!values) return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give %zu numbers", name, count);
  size_t bad = batten_first_nonfinite(count, values);
  if (bad == count) return BATTEN_OK;
  if (count == 1) return batten_fail(ctx, BATTEN_E_INVALID, "%s: %g; give a finite number", name, values[0]);
  return batten_fail(ctx, BATTEN_E_INVALID, "%s[%zu]: %g; give a finite number", name, bad, values[bad]);
}

batten_status frep_check_positive(batten_context *ctx, const char *name, double value) {
  if (value > 0 && isfinite(value)) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "%s: %g; give a positive finite number", name, value);
}

batten_status frep_check_direction(batten_context *ctx, const char *name, size_t n, const double *v, double *unit) {
  batten_status st = frep_check_numbers(ctx, name, n, v);
  if (st < 0) return st;
  double largest = 0, square = 0, scaled[3] = {0};
  for (size_t i = 0; i < n; i++) largest = fmax(largest, fabs(v[i]));
  if (!(largest > 0)) return batten_fail(ctx, BATTEN_E_INVALID, "%s: its length is 0; give a direction", name);
  double scale = batten_unit(largest); /* squares neither overflow nor vanish */
  for (size_t i = 0; i < n; i++) {
    scaled[i] = v[i] * scale;
    square += scaled[i] * scaled[i];
  }
  for (size_t i = 0; i < n; i++) unit[i] = scaled[i] / sqrt(square);
  return BATTEN_OK;
}

/* ---- making and sharing --------------------------------------------------------------------------- */

static batten_status check_size(batten_context *ctx, const batten_frep_parts *parts, unsigned *depth, size_t *nodes) {
  *depth = 0;
  *nodes = 1;
  for (size_t i = 0; i < parts->child_count; i++) {
    const batten_frep *child = parts->children[i];
    if (child->depth + 1 > *depth) *depth = child->depth + 1;
    *nodes += child->nodes; /* each is at most FREP_NODES */
  }
  if (*depth > FREP_DEPTH)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE,
                       "node: %u levels deep, %d are allowed; combine in pairs (batten_frep_combine_all) rather than "
                       "in a chain",
                       *depth, FREP_DEPTH);
  if (*nodes > FREP_NODES)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE,
                       "node: a tree of %zu nodes, shared ones as often as they stand in it, %d are allowed", *nodes,
                       FREP_NODES);
  return BATTEN_OK;
}

/* Solids that trees make are carriers and leaves again: their depth limits the recursion of these. */
static unsigned levels_below(const batten_frep_parts *parts) {
  unsigned below = 0;
  if (parts->carrier) below = parts->carrier->depth + 1;
  if (parts->solid) below = batten_solid_depth(parts->solid) + 1;
  for (size_t i = 0; i < parts->child_count; i++)
    if (parts->children[i]->below > below) below = parts->children[i]->below;
  return below;
}

batten_status frep_make(batten_context *ctx, const frep_class *cls, const batten_frep_parts *parts, bool distance,
                        void *state, batten_frep **out) {
  batten_frep *a = NULL;
  double *numbers = NULL;
  size_t *starts = NULL, nodes;
  unsigned depth;
  batten_status st = check_size(ctx, parts, &depth, &nodes);
  if (st < 0) return st;
  st = BATTEN_E_NOMEM;
  a = batten_alloc(ctx, sizeof *a);
  if (!a) goto done;
  if (parts->number_count) {
    numbers = batten_alloc_array(ctx, parts->number_count, sizeof *numbers);
    if (!numbers) goto done;
    memcpy(numbers, parts->numbers, parts->number_count * sizeof *numbers);
  }
  if (parts->start_count) {
    starts = batten_alloc_array(ctx, parts->start_count, sizeof *starts);
    if (!starts) goto done;
    memcpy(starts, parts->starts, parts->start_count * sizeof *starts);
  }
  *a = (batten_frep){.ctx = ctx,
                     .cls = cls,
                     .n = parts->n,
                     .depth = depth,
                     .nodes = nodes,
                     .below = levels_below(parts),
                     .distance = distance,
                     .normal = distance,
                     .number_count = parts->number_count,
                     .numbers = numbers,
                     .start_count = parts->start_count,
                     .starts = starts,
                     .child_count = parts->child_count,
                     .carrier = batten_carrier_retain(parts->carrier),
                     .solid = batten_solid_retain(parts->solid),
                     .state = state};
  atomic_init(&a->owners, 1);
  for (size_t i = 0; i < parts->child_count; i++) a->children[i] = batten_frep_retain(parts->children[i]);
  *out = a;
  return BATTEN_OK;
done:
  batten_free(ctx, starts);
  batten_free(ctx, numbers);
  batten_free(ctx, a);
  return st;
}

batten_frep *batten_frep_retain(batten_frep *a) {
  if (a) atomic_fetch_add_explicit(&a->owners, 1, memory_order_relaxed);
  return a;
}

/* Recursion over the children is no deeper than FREP_DEPTH. The last owner must see what all others did before. */
void batten_frep_free(batten_frep *a) {
  if (!a || atomic_fetch_sub_explicit(&a->owners, 1, memory_order_acq_rel) > 1) return;
  batten_frep_free(a->children[0]);
  batten_frep_free(a->children[1]);
  batten_carrier_free(a->carrier);
  batten_solid_free(a->solid);
  if (a->cls->release)
    a->cls->release(a->state);
  else
    batten_free(a->ctx, a->state);
  batten_free(a->ctx, a->numbers);
  batten_free(a->ctx, a->starts);
  batten_free(a->ctx, a);
}

/* ---- a block through a tree ----------------------------------------------------------------------- */

batten_status frep_evaluate_block(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                  double *values, double *gradients) {
  return a->cls->evaluate(a, ctx, count, points, values, gradients);
}

batten_status frep_bounds_block(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                double *ranges) {
  return a->cls->bounds(a, ctx, count, boxes, ranges);
}

batten_status frep_slopes_block(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                double *slopes) {
  if (!a->distance && a->cls->slopes) return a->cls->slopes(a, ctx, count, boxes, slopes);
  if (!a->distance && a->cls->both) {
    double *all = batten_alloc_array(ctx, count, 4 * sizeof *all);
    if (!all) return BATTEN_E_NOMEM;
    batten_status st = a->cls->both(a, ctx, count, boxes, all, all + 2 * count);
    for (size_t i = 0; st >= 0 && i < count; i++) slopes[i] = all[2 * count + 2 * i + 1];
    batten_free(ctx, all);
    return st;
  }
  /* A distance grows by at most the way; the rounding of its gradient is far below 1e-12. */
  for (size_t i = 0; i < count; i++) slopes[i] = a->distance ? 1 + 1e-12 : INFINITY;
  return BATTEN_OK;
}

batten_status frep_both_block(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                              double *ranges, double *slopes) {
  if (a->cls->both) return a->cls->both(a, ctx, count, boxes, ranges, slopes);
  batten_status st = frep_bounds_block(a, ctx, count, boxes, ranges);
  if (st >= 0) st = frep_slopes_block(a, ctx, count, boxes, slopes);
  for (size_t i = count; st >= 0 && i-- > 0;) { /* one apart become two apart, from behind */
    slopes[2 * i + 1] = slopes[i];
    slopes[2 * i] = 0;
  }
  return st;
}

bool frep_structural_box(const batten_frep *a, double *lower, double *upper) {
  return a->cls->box && a->cls->box(a, lower, upper);
}

bool frep_hint_box(const batten_frep *a, double *lower, double *upper) {
  if (frep_structural_box(a, lower, upper)) {
    bool some = true; /* a structure that tells that there is nothing tells no place */
    for (unsigned k = 0; k < a->n; k++) some = some && lower[k] <= upper[k];
    if (some) return true;
  }
  bool found = false;
  for (size_t i = 0; i < a->child_count; i++) {
    double low[3] = {0, 0, 0}, high[3] = {0, 0, 0}; /* a plane child of a solid in space lies at height 0 */
    if (!frep_hint_box(a->children[i], low, high)) continue;
    for (unsigned k = 0; k < a->n; k++) {
      lower[k] = found ? fmin(lower[k], low[k]) : low[k];
      upper[k] = found ? fmax(upper[k], high[k]) : high[k];
    }
    found = true;
  }
  return found;
}

/* ---- batches --------------------------------------------------------------------------------------- */

unsigned batten_frep_dimension(const batten_frep *a) { return a->n; }

int batten_frep_is_distance(const batten_frep *a) { return a->distance; }

static batten_status check_points(batten_context *ctx, const batten_frep *a, size_t count, const double *points) {
  if (!points) return batten_fail(ctx, BATTEN_E_INVALID, "points: NULL; give [%zu][%u] numbers", count, a->n);
  size_t all;
  if (!batten_mul(count, a->n, &all)) return batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu points", count);
  size_t bad = batten_first_nonfinite(all, points);
  if (bad == all) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "points[%zu][%zu]: %g; give finite coordinates", bad / a->n, bad % a->n,
                     points[bad]);
}

batten_status batten_frep_evaluate(batten_context *ctx, const batten_frep *a, size_t count, const double *points,
                                   double *values, double *gradients) {
  batten_status st = frep_check_node(ctx, "a", a, 0);
  if (st >= 0 && count > 0) st = check_points(ctx, a, count, points);
  if (st < 0 || count == 0 || (!values && !gradients)) return st;
  double *scratch = NULL;
  if (!values) {
    scratch = batten_alloc_array(ctx, count < FREP_BLOCK ? count : FREP_BLOCK, sizeof *scratch);
    if (!scratch) return BATTEN_E_NOMEM;
  }
  for (size_t first = 0; st >= 0 && first < count; first += FREP_BLOCK) {
    size_t now = count - first < FREP_BLOCK ? count - first : FREP_BLOCK;
    if (first > 0) st = batten_progress(ctx, "evaluate", (double)first / (double)count);
    if (st >= 0)
      st = frep_evaluate_block(a, ctx, now, points + first * a->n, values ? values + first : scratch,
                               gradients ? gradients + first * a->n : NULL);
  }
  batten_free(ctx, scratch);
  return st;
}

static batten_status check_boxes(batten_context *ctx, const batten_frep *a, size_t count, const double *boxes,
                                 const double *ranges) {
  unsigned n = a->n;
  if (!boxes) return batten_fail(ctx, BATTEN_E_INVALID, "boxes: NULL; give [%zu][2][%u] numbers", count, n);
  if (!ranges) return batten_fail(ctx, BATTEN_E_INVALID, "ranges: NULL; give the place for [%zu][2] numbers", count);
  for (size_t i = 0; i < count; i++) {
    const double *lower = boxes + 2 * n * i, *upper = lower + n;
    for (unsigned k = 0; k < n; k++)
      if (!(isfinite(lower[k]) && isfinite(upper[k]) && lower[k] <= upper[k]))
        return batten_fail(ctx, BATTEN_E_INVALID,
                           "boxes[%zu]: from %g to %g along axis %u; give finite corners, lower <= upper", i,
                           lower[k], upper[k], k);
  }
  return BATTEN_OK;
}

batten_status batten_frep_bounds(batten_context *ctx, const batten_frep *a, size_t count, const double *boxes,
                                 double *ranges) {
  batten_status st = frep_check_node(ctx, "a", a, 0);
  if (st >= 0 && count > 0) st = check_boxes(ctx, a, count, boxes, ranges);
  for (size_t first = 0; st >= 0 && first < count; first += FREP_BLOCK) {
    size_t now = count - first < FREP_BLOCK ? count - first : FREP_BLOCK;
    if (first > 0) st = batten_progress(ctx, "bounds", (double)first / (double)count);
    if (st >= 0) st = frep_bounds_block(a, ctx, now, boxes + first * 2 * a->n, ranges + first * 2);
  }
  return st;
}

static batten_status evaluate_field(const void *user, batten_context *ctx, size_t count, const double *points,
                                    double *values, double *gradients, double *hessians) {
  (void)hessians;
  return batten_frep_evaluate(ctx, user, count, points, values, gradients);
}

static batten_status field_bounds(const void *user, batten_context *ctx, size_t count, const double *boxes,
                                  double *ranges) {
  return batten_frep_bounds(ctx, user, count, boxes, ranges);
}

batten_field batten_frep_field(const batten_frep *a) {
  return (batten_field){.dimension = a->n, .order = 1, .evaluate = evaluate_field, .user = a, .bounds = field_bounds};
}
