/* Which cells meet, by one walk over pairs of cells from the pair of roots.
 *
 *   side by side, both leaves:         direct sums
 *
 *   same level, apart:                 a translation between far fields; the parents are side by side, so the
 *                                      offset is in {-3 .. 3}^n, and one axis has 2 or more
 *
 *   a leaf and a smaller cell, apart:  the far field of the smaller one at its nodes, evaluated at the targets of
 *                                      the leaf or made from its sources; direct sums where those are fewer
 *
 *   else:                              the larger one is cut (both, when they are of one level)
 *
 * The walk is made twice, to count and to fill; each list is in the order of the walk. */
#include "fmm/fmm_inner.h"

#include "base/checked.h"

typedef struct pair {
  uint32_t target, source;
} pair;

typedef struct walk {
  unsigned n;
  size_t full;
  const fmm_cell *cell;
  const uint32_t *chunk_of; /* [cells] */
  fmm_lists *lists;
  pair *stack;
  size_t height;
  bool fills; /* second time: begin[i + 1] is where the next of cell i goes */
  size_t translations;
} walk;

static void add(walk *w, unsigned list, pair p) {
  if (w->fills) w->lists->with[list][w->lists->begin[list][p.target + 1]] = p.source;
  w->lists->begin[list][p.target + 1]++;
}

static void push(walk *w, uint32_t target, uint32_t source) {
  const fmm_cell *t = &w->cell[target], *s = &w->cell[source];
  if (t->t0 < t->t1 && s->s0 < s->s1) w->stack[w->height++] = (pair){target, source};
}

static void add_translation(walk *w, pair p) {
  uint32_t mirror = 0;
  const unsigned kind = batten_fmm_kind(w->n, &w->cell[p.target].frame, &w->cell[p.source].frame, &mirror);
  size_t *next = &w->lists->kind_begin[w->chunk_of[p.target] * FMM_KINDS + kind + 1];
  if (w->fills) w->lists->translations[*next] = (fmm_translation){p.target, p.source, mirror};
  ++*next;
  w->translations++;
}

/* A pair that is apart and not of one level. */
static void meet_far(walk *w, pair p) {
  const fmm_cell *t = &w->cell[p.target], *s = &w->cell[p.source];
  const size_t targets = t->t1 - t->t0, sources = s->s1 - s->s0;
  if (s->level > t->level) { /* the target is a leaf */
    const bool cheaper = sources > w->full;
    add(w, cheaper ? FMM_LIST_FROM_CELL : FMM_LIST_NEAR, p);
    if (!w->fills) *(cheaper ? &w->lists->node_terms : &w->lists->pairs) += targets * (cheaper ? w->full : sources);
  } else if (targets > w->full) {
    add(w, FMM_LIST_TO_CELL, p);
    if (!w->fills) w->lists->node_terms += w->full * sources;
  } else if (fmm_is_leaf(t)) {
    add(w, FMM_LIST_NEAR, p);
    if (!w->fills) w->lists->pairs += targets * sources;
  } else {
    for (uint32_t i = 0; i < t->children; i++) push(w, t->child + i, p.source);
  }
}

static void meet(walk *w, pair p) {
  const fmm_cell *t = &w->cell[p.target], *s = &w->cell[p.source];
  if (!fmm_side_by_side(w->n, &t->frame, &s->frame)) {
    if (t->level == s->level)
      add_translation(w, p);
    else
      meet_far(w, p);
    return;
  }
  if (fmm_is_leaf(t) && fmm_is_leaf(s)) {
    add(w, FMM_LIST_NEAR, p);
    if (!w->fills) w->lists->pairs += (t->t1 - t->t0) * (s->s1 - s->s0);
    return;
  }
  const bool cut_target = !fmm_is_leaf(t) && (t->level <= s->level || fmm_is_leaf(s));
  const bool cut_source = !fmm_is_leaf(s) && (s->level <= t->level || fmm_is_leaf(t));
  for (uint32_t i = 0; i < (cut_target ? t->children : 1); i++)
    for (uint32_t j = 0; j < (cut_source ? s->children : 1); j++)
      push(w, cut_target ? t->child + i : p.target, cut_source ? s->child + j : p.source);
}

static void walk_pairs(walk *w) {
  w->translations = 0;
  push(w, 0, 0);
  while (w->height > 0) meet(w, w->stack[--w->height]);
}

size_t batten_fmm_begin_lists(size_t *begin, size_t count) {
  size_t total = 0;
  for (size_t i = 0; i < count; i++) {
    const size_t length = begin[i + 1];
    begin[i + 1] = total;
    total += length;
  }
  return total;
}

static batten_status alloc_counts(batten_context *ctx, size_t cells, fmm_lists *l) {
  for (unsigned k = 0; k < FMM_LISTS; k++) {
    if (!(l->begin[k] = batten_alloc_array(ctx, cells + 1, sizeof(size_t)))) return BATTEN_E_NOMEM;
    for (size_t i = 0; i <= cells; i++) l->begin[k][i] = 0;
  }
  const size_t kinds = l->chunks * FMM_KINDS;
  if (!(l->kind_begin = batten_alloc_array(ctx, kinds + 1, sizeof(size_t)))) return BATTEN_E_NOMEM;
  for (size_t i = 0; i <= kinds; i++) l->kind_begin[i] = 0;
  return BATTEN_OK;
}

static batten_status alloc_lists(batten_context *ctx, size_t cells, fmm_lists *l) {
  for (unsigned k = 0; k < FMM_LISTS; k++) {
    const size_t total = batten_fmm_begin_lists(l->begin[k], cells);
    if (!(l->with[k] = batten_alloc_array(ctx, total, sizeof(uint32_t)))) return BATTEN_E_NOMEM;
  }
  const size_t total = batten_fmm_begin_lists(l->kind_begin, l->chunks * FMM_KINDS);
  l->translations = batten_alloc_array(ctx, total, sizeof *l->translations);
  return l->translations ? BATTEN_OK : BATTEN_E_NOMEM;
}

/* Leaves with targets, cut into tasks of WORK terms and more. */
static batten_status make_tasks(batten_context *ctx, const fmm_tree *t, size_t full, fmm_lists *l) {
  const size_t WORK = 1 << 20; /* about half a millisecond */
  l->leaf = batten_alloc_array(ctx, t->leaves, sizeof *l->leaf);
  l->task_first = batten_alloc_array(ctx, t->leaves + 1, sizeof *l->task_first);
  if (!l->leaf || !l->task_first) return BATTEN_E_NOMEM;
  size_t work = WORK;
  for (uint32_t i = 0; i < t->cells; i++) {
    const fmm_cell *c = &t->cell[i];
    if (!fmm_is_leaf(c) || c->t0 == c->t1) continue;
    if (work >= WORK) l->task_first[l->tasks++] = l->leaves, work = 0;
    l->leaf[l->leaves++] = i;
    size_t sources = full * (l->begin[FMM_LIST_FROM_CELL][i + 1] - l->begin[FMM_LIST_FROM_CELL][i]);
    for (size_t k = l->begin[FMM_LIST_NEAR][i]; k < l->begin[FMM_LIST_NEAR][i + 1]; k++) {
      const fmm_cell *s = &t->cell[l->with[FMM_LIST_NEAR][k]];
      sources += s->s1 - s->s0;
    }
    work += (c->t1 - c->t0) * sources;
  }
  l->task_first[l->tasks] = l->leaves;
  return BATTEN_OK;
}

void batten_fmm_lists_free(batten_context *ctx, fmm_lists *l) {
  for (unsigned k = 0; k < FMM_LISTS; k++) {
    batten_free(ctx, l->begin[k]);
    batten_free(ctx, l->with[k]);
  }
  batten_free(ctx, l->kind_begin);
  batten_free(ctx, l->translations);
  batten_free(ctx, l->leaf);
  batten_free(ctx, l->task_first);
  *l = (fmm_lists){0};
}

batten_status batten_fmm_lists_new(batten_context *ctx, unsigned n, size_t full, const fmm_tree *tree,
                                   fmm_lists *lists) {
  *lists = (fmm_lists){0};
  batten_status st = BATTEN_E_NOMEM;
  uint32_t *chunk_of = batten_alloc_array(ctx, tree->cells, sizeof *chunk_of);
  /* A pair gives way to 64 at most, and a level is cut at most twice on the way down. */
  pair *stack = batten_alloc_array(ctx, 128 * (size_t)tree->levels + 64, sizeof *stack);
  if (!chunk_of || !stack) goto done;
  for (unsigned level = 0; level < tree->levels; level++)
    for (size_t i = tree->level_first[level]; i < tree->level_first[level + 1]; i++) {
      lists->chunks += (i - tree->level_first[level]) % FMM_CHUNK_CELLS == 0;
      chunk_of[i] = (uint32_t)(lists->chunks - 1);
    }
  if ((st = alloc_counts(ctx, tree->cells, lists)) < 0) goto done;
  walk w = {.n = n, .full = full, .cell = tree->cell, .chunk_of = chunk_of, .lists = lists, .stack = stack};
  walk_pairs(&w);
  if ((st = batten_progress(ctx, "tree", 0.5)) < 0) goto done;
  if ((st = alloc_lists(ctx, tree->cells, lists)) < 0) goto done;
  w.fills = true;
  walk_pairs(&w);
  st = make_tasks(ctx, tree, full, lists);
done:
  batten_free(ctx, stack);
  batten_free(ctx, chunk_of);
  if (st < 0) batten_fmm_lists_free(ctx, lists);
  return st;
}
