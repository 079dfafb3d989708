/* Seeds of the surface f = 0 in a box, from bounds of f over boxes.
 *
 * The box is cut into 2^k cells along each axis, none larger than wanted. From the whole box downwards each level's
 * boxes are bounded together; those in which f may change its sign are halved along their long axes. What is left at
 * the end are cells near the surface: f is evaluated at their corners, each once, and on every edge between a corner
 * inside and one outside there is a seed. The cells themselves are not bounded: bounds of one cost as much as values
 * at several points, and would leave out less than one corner for every cell. */
#include "seeds.h"

#include "table.h"

#include "base/checked.h"

#include <string.h>

enum {
  BATCH = 4096,   /* boxes that are bounded together */
  AXIS_BITS = 21, /* of a corner's place along an axis, in the keys of the table */
  LEVELS = 20     /* most halvings of an axis: its last corner still fits */
};
static const size_t BOXES_MAX = (size_t)1 << 27; /* of a level; its list takes 1 GB */
/* Axes are halved together when their sides are within this factor: boxes come to be about cubes. */
static const double LONG = 1.5;

typedef struct search {
  batten_sampler *sampler;
  const double *lower, *upper;
  unsigned n;
  unsigned levels[3]; /* the box has 2^levels cells along an axis */
  unsigned left[3];   /* the present boxes have 2^left */
  uint64_t *boxes;    /* keys of their lowest corners */
  size_t count, capacity;
  double done; /* share of the levels */
} search;

static uint64_t place(uint64_t key, unsigned axis) { return key >> (AXIS_BITS * axis) & ((1u << AXIS_BITS) - 1); }
static uint64_t step(unsigned axis, unsigned power) { return (uint64_t)1 << (AXIS_BITS * axis + power); }

/* Where corner `at` of the cells lies; the last is the box's end to the bit. */
static double coordinate(const search *s, unsigned axis, uint64_t at) {
  uint64_t cells = (uint64_t)1 << s->levels[axis];
  double share = (double)at / (double)cells;
  return at == cells ? s->upper[axis] : s->lower[axis] + share * (s->upper[axis] - s->lower[axis]);
}

static batten_status progress(const search *s, size_t done, size_t of, double levels) {
  double share = s->done + (of ? (double)done / (double)of : 1) * levels;
  return batten_progress(s->sampler->ctx, "search", fmin(share, 1));
}

static bool at_cells(const search *s) { return s->left[0] + s->left[1] + s->left[2] == 0; }

/* Keeps the boxes in which f may change its sign. */
static batten_status keep_crossed(search *s, double *numbers, double levels) {
  const unsigned n = s->n;
  const batten_field *f = s->sampler->field;
  double *ranges = numbers + BATCH * 2 * n;
  size_t kept = 0;
  for (size_t first = 0; first < s->count; first += BATCH) {
    size_t now = s->count - first < BATCH ? s->count - first : BATCH;
    for (size_t i = 0; i < now; i++)
      for (unsigned k = 0; k < n; k++) {
        uint64_t at = place(s->boxes[first + i], k);
        numbers[2 * n * i + k] = coordinate(s, k, at);
        numbers[2 * n * i + n + k] = coordinate(s, k, at + ((uint64_t)1 << s->left[k]));
      }
    batten_status st = progress(s, first, s->count, levels);
    if (st >= 0) st = f->bounds(f->user, s->sampler->ctx, now, numbers, ranges);
    if (st < 0) return st;
    for (size_t i = 0; i < now; i++) /* f = 0 is inside; what is no number tells nothing */
      if (!(ranges[2 * i] >= 0) && !(ranges[2 * i + 1] < 0)) s->boxes[kept++] = s->boxes[first + i];
  }
  s->count = kept;
  s->done += levels;
  return BATTEN_OK;
}

/* The boxes' halves along their long axes that have more than one cell. False where there are none. */
static bool choose_axes(const search *s, bool halve[3]) {
  double longest = 0, side[3];
  for (unsigned k = 0; k < s->n; k++) {
    side[k] = ldexp(s->upper[k] - s->lower[k], (int)s->left[k] - (int)s->levels[k]);
    if (s->left[k] > 0) longest = fmax(longest, side[k]);
  }
  bool any = false;
  for (unsigned k = 0; k < s->n; k++) {
    halve[k] = s->left[k] > 0 && side[k] * LONG >= longest;
    any = any || halve[k];
  }
  return any;
}

static batten_status halve_boxes(search *s, const bool halve[3]) {
  for (unsigned k = 0; k < s->n; k++) {
    if (!halve[k]) continue;
    if (s->count > BOXES_MAX / 2)
      return batten_fail(s->sampler->ctx, BATTEN_E_TOO_LARGE,
                         "cell: the bounds leave more than %zu boxes near the surface; make cell larger or the box "
                         "smaller",
                         BOXES_MAX);
    void *block = s->boxes;
    batten_status st = batten_reserve(s->sampler->ctx, &block, &s->capacity, 2 * s->count, sizeof *s->boxes);
    s->boxes = block;
    if (st < 0) return st;
    s->left[k]--;
    for (size_t i = s->count; i-- > 0;) {
      s->boxes[2 * i + 1] = s->boxes[i] + step(k, s->left[k]);
      s->boxes[2 * i] = s->boxes[i];
    }
    s->count *= 2;
  }
  return BATTEN_OK;
}

static batten_status refine(search *s) {
  batten_status st = BATTEN_OK;
  unsigned total = 1;
  for (unsigned k = 0; k < s->n; k++) total += s->levels[k];
  double *numbers = batten_alloc_array(s->sampler->ctx, BATCH, (2 * s->n + 2) * sizeof *numbers);
  if (!numbers) return BATTEN_E_NOMEM;
  bool halve[3] = {false, false, false};
  do {
    unsigned halved = 1;
    for (unsigned k = 0; k < s->n; k++) halved += halve[k];
    st = halve_boxes(s, halve);
    if (st >= 0 && at_cells(s) && halved > 1) break;
    if (st >= 0) st = keep_crossed(s, numbers, 0.5 * halved / (total + s->n));
  } while (st >= 0 && s->count > 0 && choose_axes(s, halve));
  batten_free(s->sampler->ctx, numbers);
  return st;
}

/* ---- corners ------------------------------------------------------------------------------------- */

/* The corners of the cells that are left, each once: *keys [*count], and the table of their places. */
static batten_status list_corners(const search *s, batten_table *table, uint64_t **keys, size_t *count) {
  batten_context *ctx = s->sampler->ctx;
  size_t capacity = 0;
  for (size_t i = 0; i < s->count; i++)
    for (unsigned corner = 0; corner < 1u << s->n; corner++) {
      uint64_t key = s->boxes[i];
      for (unsigned k = 0; k < s->n; k++)
        if (corner >> k & 1) key += step(k, 0);
      if (*count >= UINT32_MAX) return batten_fail(ctx, BATTEN_E_TOO_LARGE, "cell: too small for 32-bit indices");
      int is_new = 0;
      if (!batten_table_insert(ctx, table, key, (uint32_t)*count, &is_new)) return BATTEN_E_NOMEM;
      if (!is_new) continue;
      void *block = *keys;
      batten_status st = batten_reserve(ctx, &block, &capacity, *count + 1, sizeof **keys);
      *keys = block;
      if (st < 0) return st;
      (*keys)[(*count)++] = key;
    }
  return BATTEN_OK;
}

static batten_status sample_corners(const search *s, size_t count, const uint64_t *keys, double *values) {
  double *points = batten_alloc_array(s->sampler->ctx, BATCH, s->n * sizeof *points);
  if (!points) return BATTEN_E_NOMEM;
  batten_status st = BATTEN_OK;
  for (size_t first = 0; st >= 0 && first < count; first += BATCH) {
    size_t now = count - first < BATCH ? count - first : BATCH;
    for (size_t i = 0; i < now; i++)
      for (unsigned k = 0; k < s->n; k++) points[i * s->n + k] = coordinate(s, k, place(keys[first + i], k));
    st = progress(s, first, count, 1 - s->done);
    if (st >= 0) st = batten_sampler_values(s->sampler, now, points, values + first);
  }
  batten_free(s->sampler->ctx, points);
  return st;
}

/* A seed where f = 0 on the line between the values at the ends of an edge. */
static batten_status place_seeds(const search *s, const batten_table *table, size_t count, const uint64_t *keys,
                                 const double *values, size_t *made, double **seeds) {
  size_t capacity = 0;
  for (size_t i = 0; i < count; i++)
    for (unsigned axis = 0; axis < s->n; axis++) {
      const uint32_t *other = batten_table_find(table, keys[i] + step(axis, 0));
      if (!other || (values[i] >= 0) == (values[*other] >= 0)) continue;
      void *block = *seeds;
      batten_status st = batten_reserve(s->sampler->ctx, &block, &capacity, (*made + 1) * s->n, sizeof **seeds);
      *seeds = block;
      if (st < 0) return st;
      double *x = *seeds + s->n * (*made)++;
      for (unsigned k = 0; k < s->n; k++) x[k] = coordinate(s, k, place(keys[i], k));
      double from = x[axis], to = coordinate(s, axis, place(keys[i], axis) + 1);
      /* Halved first: their difference may overflow. */
      double share = values[i] / 2 / (values[i] / 2 - values[*other] / 2);
      x[axis] = from + share * (to - from);
    }
  return BATTEN_OK;
}

static batten_status seeds_of_cells(const search *s, size_t *made, double **seeds) {
  batten_context *ctx = s->sampler->ctx;
  batten_table table = {0};
  uint64_t *keys = NULL;
  double *values = NULL;
  size_t count = 0;
  batten_status st = list_corners(s, &table, &keys, &count);
  if (st >= 0) {
    values = batten_alloc_array(ctx, count, sizeof *values);
    if (!values) st = BATTEN_E_NOMEM;
  }
  if (st >= 0) st = sample_corners(s, count, keys, values);
  if (st >= 0) st = place_seeds(s, &table, count, keys, values, made, seeds);
  batten_free(ctx, values);
  batten_free(ctx, keys);
  batten_table_free(ctx, &table);
  return st;
}

/* ---- the search ---------------------------------------------------------------------------------- */

static batten_status count_levels(search *s, double cell) {
  for (unsigned k = 0; k < s->n; k++) {
    double side = s->upper[k] - s->lower[k];
    while (ldexp(side, -(int)s->levels[k]) > cell) {
      if (++s->levels[k] <= LEVELS) continue;
      return batten_fail(s->sampler->ctx, BATTEN_E_TOO_LARGE,
                         "cell: %g, under a millionth of the box along axis %u; make it larger", cell, k);
    }
    s->left[k] = s->levels[k];
  }
  return BATTEN_OK;
}

batten_status batten_search_seeds(batten_sampler *sampler, const double *lower, const double *upper, double cell,
                                  size_t *count, double **seeds) {
  batten_context *ctx = sampler->ctx;
  search s = {.sampler = sampler, .lower = lower, .upper = upper, .n = sampler->field->dimension, .count = 1};
  size_t made = 0;
  double *found = NULL;
  void *block = NULL;
  batten_status st = count_levels(&s, cell);
  if (st >= 0) st = batten_reserve(ctx, &block, &s.capacity, 1, sizeof *s.boxes);
  if (st < 0) goto done;
  s.boxes = block;
  s.boxes[0] = 0;
  st = refine(&s);
  if (st >= 0) st = seeds_of_cells(&s, &made, &found);
  if (st >= 0 && made == 0)
    st = batten_fail(ctx, BATTEN_E_NOT_FOUND,
                     "the field changes its sign nowhere in the box, at corners of cells of %g; all of it is inside "
                     "or outside, or the parts are smaller: make cell smaller or the box larger",
                     cell);
  if (st < 0) goto done;
  *count = made;
  *seeds = found;
  found = NULL;
done:
  batten_free(ctx, found);
  batten_free(ctx, s.boxes);
  return st;
}

batten_status batten_find_seeds(batten_context *ctx, const batten_field *field, const double *lower,
                                const double *upper, double cell, size_t *count, double **seeds) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!field || !field->evaluate || !field->bounds)
    return batten_fail(ctx, BATTEN_E_INVALID, "field: %s; give one with its bounds function",
                       !field ? "NULL" : "without bounds or evaluate");
  unsigned n = field->dimension;
  if (n != 2 && n != 3) return batten_fail(ctx, BATTEN_E_INVALID, "field.dimension: %u; give a field in 2 or 3", n);
  if (!lower || !upper)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give the box to be searched", lower ? "upper" : "lower");
  for (unsigned k = 0; k < n; k++)
    if (!(lower[k] < upper[k]) || !isfinite(upper[k] - lower[k]))
      return batten_fail(ctx, BATTEN_E_INVALID, "lower[%u], upper[%u]: %g, %g; give lower < upper, finite", k, k,
                         lower[k], upper[k]);
  if (!(cell > 0) || isinf(cell)) return batten_fail(ctx, BATTEN_E_INVALID, "cell: %g; give a length > 0", cell);
  if (!count || !seeds)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give the place for the result", count ? "seeds" : "count");
  batten_sampler sampler = {.ctx = ctx, .field = field};
  return batten_search_seeds(&sampler, lower, upper, cell, count, seeds);
}
