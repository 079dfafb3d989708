/* The tree of cells: an octree, in the plane a quadtree, of sources and targets together.
 *
 * A cell with more than leaf_points sources or targets is cut at its centre as long as there is anything to part.
 * Sides are powers of two and centres are whole numbers of them, so that places within a cell, and offsets between
 * cells, are exact however small the cell is: there are no integer keys that would bound the depth. It ends where
 * doubles cannot tell the centres of children apart, or all points of a cell are equal; those become one point with
 * the sum of the weights, since terms at r = 0 are 0. */
#include "fmm/fmm_inner.h"

#include "base/checked.h"

#include <string.h>

/* A point on its way to its cell. */
typedef struct record {
  double x[3];
  size_t index;
} record;

typedef struct builder {
  unsigned n;
  size_t leaf_points, room; /* cells that there is memory for */
  record *sources, *targets, *spare;
  fmm_tree *tree;
} builder;

/* ---- cutting ---- */

static void root_frame(unsigned n, const fmm_points *sources, const fmm_points *targets, double margin,
                       fmm_frame *frame) {
  double low[3] = {0, 0, 0}, high[3] = {0, 0, 0}, extent = 0;
  for (unsigned a = 0; a < n; a++) {
    low[a] = INFINITY, high[a] = -INFINITY;
    for (size_t i = 0; i < sources->count; i++)
      low[a] = fmin(low[a], sources->x[a][i]), high[a] = fmax(high[a], sources->x[a][i]);
    for (size_t i = 0; i < targets->count; i++)
      low[a] = fmin(low[a], targets->x[a][i]), high[a] = fmax(high[a], targets->x[a][i]);
    extent = fmax(extent, high[a] - low[a]);
  }
  for (unsigned a = 0; a < n; a++) low[a] -= margin * extent, high[a] += margin * extent;
  double side = extent > 0 ? 0.5 / batten_unit(extent) : 1;
  bool inside = false;
  while (!inside) {
    side *= 2;
    inside = true;
    *frame = (fmm_frame){.half = side / 2};
    for (unsigned a = 0; a < n; a++) {
      const double corner = floor(low[a] / (side / 8)) * (side / 8); /* a whole number of eighths: exact */
      frame->centre[a] = corner + side / 2;
      inside = inside && high[a] <= corner + side;
    }
  }
}

/* Sorts records first .. last - 1 by octant, stably; begin[o] .. begin[o + 1] is octant o then. */
static void part_records(unsigned n, const fmm_frame *frame, record *records, record *spare, size_t first,
                         size_t last, size_t begin[FMM_CLASSES + 1]) {
  size_t next[FMM_CLASSES] = {0}, at = first;
  for (size_t i = first; i < last; i++) next[fmm_octant(n, frame, records[i].x)]++;
  for (unsigned o = 0; o < FMM_CLASSES; o++) {
    begin[o] = at;
    at += next[o];
    next[o] = begin[o];
  }
  begin[FMM_CLASSES] = last;
  for (size_t i = first; i < last; i++) spare[next[fmm_octant(n, frame, records[i].x)]++] = records[i];
  if (last > first) memcpy(records + first, spare + first, (last - first) * sizeof *records);
}

static bool all_equal(unsigned n, const record *a, size_t a_count, const record *b, size_t b_count) {
  const double *x = a_count ? a->x : b->x;
  for (size_t i = 0; i < a_count; i++)
    for (unsigned k = 0; k < n; k++)
      if (a[i].x[k] != x[k]) return false;
  for (size_t i = 0; i < b_count; i++)
    for (unsigned k = 0; k < n; k++)
      if (b[i].x[k] != x[k]) return false;
  return true;
}

bool batten_fmm_can_part(unsigned n, const fmm_frame *frame, unsigned level) {
  const double quarter = frame->half / 2;
  if (level + 1 >= FMM_LEVELS_MAX || quarter < 1e-290) return false;
  for (unsigned a = 0; a < n; a++) {
    const double centre = frame->centre[a];
    if (centre + quarter - centre != quarter || centre - (centre - quarter) != quarter) return false;
  }
  return true;
}

static bool is_one_point(const builder *b, const fmm_cell *c) {
  if (b->tree->same) return all_equal(b->n, b->sources + c->s0, c->s1 - c->s0, b->sources, 0);
  return all_equal(b->n, b->sources + c->s0, c->s1 - c->s0, b->targets + c->t0, c->t1 - c->t0);
}

static bool is_to_be_cut(const builder *b, const fmm_cell *c) {
  if (c->s1 - c->s0 <= b->leaf_points && c->t1 - c->t0 <= b->leaf_points) return false;
  return batten_fmm_can_part(b->n, &c->frame, c->level) && !is_one_point(b, c);
}

static batten_status make_room(batten_context *ctx, builder *b) {
  fmm_tree *t = b->tree;
  if (t->cells + FMM_CLASSES <= b->room) return BATTEN_OK;
  size_t room = 2 * b->room + 64;
  fmm_cell *grown = batten_realloc_array(ctx, t->cell, room, sizeof *grown);
  if (!grown) return BATTEN_E_NOMEM;
  t->cell = grown;
  b->room = room;
  return BATTEN_OK;
}

/* The children of a cell that hold anything. */
static void add_children(builder *b, size_t index) {
  fmm_tree *t = b->tree;
  fmm_cell *c = &t->cell[index];
  size_t s[FMM_CLASSES + 1], u[FMM_CLASSES + 1];
  part_records(b->n, &c->frame, b->sources, b->spare, c->s0, c->s1, s);
  memcpy(u, s, sizeof u);
  if (!t->same) part_records(b->n, &c->frame, b->targets, b->spare, c->t0, c->t1, u);
  c->child = (uint32_t)t->cells;
  for (unsigned o = 0; o < FMM_CLASSES; o++) {
    if (s[o] == s[o + 1] && u[o] == u[o + 1]) continue;
    fmm_cell *k = &t->cell[t->cells++];
    *k = (fmm_cell){.frame = fmm_child_frame(b->n, &c->frame, o),
                    .parent = (uint32_t)index,
                    .level = c->level + 1,
                    .s0 = s[o],
                    .s1 = s[o + 1],
                    .t0 = u[o],
                    .t1 = u[o + 1]};
    c->children++;
  }
}

static batten_status cut_levels(batten_context *ctx, builder *b) {
  fmm_tree *t = b->tree;
  for (size_t first = 0; first < t->cells;) {
    const size_t last = t->cells;
    batten_status st = batten_progress(ctx, "tree", 0);
    if (st < 0) return st;
    for (size_t i = first; i < last; i++) {
      if (!is_to_be_cut(b, &t->cell[i])) continue;
      if ((st = make_room(ctx, b)) < 0) return st;
      add_children(b, i);
    }
    t->level_first[t->levels++] = first;
    t->level_first[t->levels] = last;
    first = last;
  }
  return BATTEN_OK;
}

/* ---- points in the order of the tree ---- */

static batten_status make_records(batten_context *ctx, unsigned n, const fmm_points *points, record **out) {
  record *r = batten_alloc_array(ctx, points->count, sizeof *r);
  if (!r) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < points->count; i++) {
    r[i] = (record){.index = i};
    for (unsigned a = 0; a < n; a++) r[i].x[a] = points->x[a][i];
  }
  *out = r;
  return BATTEN_OK;
}

/* after[i]: how many points there are before record i once the records of a cut-off cell of equal points are one. */
static size_t count_points(const builder *b, bool of_targets, size_t count, size_t *after) {
  const fmm_tree *t = b->tree;
  for (size_t i = 0; i <= count; i++) after[i] = 1;
  for (size_t k = 0; k < t->cells; k++) {
    const fmm_cell *c = &t->cell[k];
    const size_t first = of_targets ? c->t0 : c->s0, last = of_targets ? c->t1 : c->s1;
    const bool large = c->s1 - c->s0 > b->leaf_points || c->t1 - c->t0 > b->leaf_points;
    if (fmm_is_leaf(c) && large && is_one_point(b, c))
      for (size_t i = first + 1; i < last; i++) after[i] = 0;
  }
  size_t total = 0;
  for (size_t i = 0; i <= count; i++) {
    const size_t one = after[i];
    after[i] = total;
    total += one;
  }
  return after[count];
}

/* Fills points and place from records; `after` as above, the first record of a point has the largest after. */
static batten_status place_points(batten_context *ctx, unsigned n, const record *records, size_t count,
                                  const size_t *after, fmm_points *points, uint32_t **place) {
  points->count = after[count];
  points->block = batten_alloc_array(ctx, points->count * n, sizeof *points->block);
  *place = batten_alloc_array(ctx, count, sizeof **place);
  if (!points->block || !*place) return BATTEN_E_NOMEM;
  for (unsigned a = 0; a < n; a++) points->x[a] = points->block + a * points->count;
  for (size_t i = 0; i < count; i++) {
    /* A record that starts no point of its own belongs to the one before the next. */
    const size_t at = after[i + 1] > after[i] ? after[i] : after[i] - 1;
    for (unsigned a = 0; a < n; a++) points->x[a][at] = records[i].x[a];
    (*place)[records[i].index] = (uint32_t)at;
  }
  return BATTEN_OK;
}

static batten_status order_points(batten_context *ctx, builder *b, size_t sources, size_t targets) {
  fmm_tree *t = b->tree;
  batten_status st = BATTEN_E_NOMEM;
  size_t *s = batten_alloc_array(ctx, sources + 1, sizeof *s), *u = s;
  if (!s) goto done;
  if (!t->same && !(u = batten_alloc_array(ctx, targets + 1, sizeof *u))) goto done;
  count_points(b, false, sources, s);
  if (!t->same) count_points(b, true, targets, u);
  if ((st = place_points(ctx, b->n, b->sources, sources, s, &t->sources, &t->source_place)) < 0) goto done;
  if (t->same) {
    t->targets = t->sources;
    t->targets.block = NULL;
    t->target_place = t->source_place;
  } else if ((st = place_points(ctx, b->n, b->targets, targets, u, &t->targets, &t->target_place)) < 0) {
    goto done;
  }
  for (size_t k = 0; k < t->cells; k++) {
    fmm_cell *c = &t->cell[k];
    c->s0 = s[c->s0], c->s1 = s[c->s1], c->t0 = u[c->t0], c->t1 = u[c->t1];
    t->leaves += fmm_is_leaf(c);
  }
done:
  if (u != s) batten_free(ctx, u);
  batten_free(ctx, s);
  return st;
}

void batten_fmm_tree_free(batten_context *ctx, fmm_tree *t) {
  if (!t->same) {
    batten_free(ctx, t->target_place);
    batten_free(ctx, t->targets.block);
  }
  batten_free(ctx, t->source_place);
  batten_free(ctx, t->sources.block);
  batten_free(ctx, t->cell);
  *t = (fmm_tree){0};
}

batten_status batten_fmm_tree_new(batten_context *ctx, unsigned n, const fmm_points *sources,
                                  const fmm_points *targets, bool same, double margin, size_t leaf_points,
                                  fmm_tree *tree) {
  *tree = (fmm_tree){.same = same};
  builder b = {.n = n, .leaf_points = leaf_points, .tree = tree};
  batten_status st = make_records(ctx, n, sources, &b.sources);
  if (st < 0) goto done;
  if (!same && (st = make_records(ctx, n, targets, &b.targets)) < 0) goto done;
  st = BATTEN_E_NOMEM;
  const size_t spare = same || sources->count > targets->count ? sources->count : targets->count;
  if (!(b.spare = batten_alloc_array(ctx, spare, sizeof *b.spare)) || make_room(ctx, &b) < 0) goto done;
  tree->cell[0] = (fmm_cell){.s1 = sources->count, .t1 = targets->count};
  tree->cells = 1;
  root_frame(n, sources, targets, margin, &tree->cell[0].frame);
  if ((st = cut_levels(ctx, &b)) < 0) goto done;
  batten_free(ctx, b.spare);
  b.spare = NULL;
  st = order_points(ctx, &b, sources->count, targets->count);
done:
  batten_free(ctx, b.spare);
  batten_free(ctx, b.targets);
  batten_free(ctx, b.sources);
  if (st < 0) batten_fmm_tree_free(ctx, tree);
  return st;
}
