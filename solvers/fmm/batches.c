/* A batch of targets of an evaluator: points to their nodes, points of one node together, sums.
 *
 * FMM_LANES points of a node go side by side, each with its own sums: the expansion of the node, then the sources of
 * its near cells in the order of the tree. Points outside of the root take the far field of source cells that are
 * apart from them as weights at the cell's nodes, in one walk over the sources' tree for some points at a time; a
 * point counts only the cells that are its own. So a point's bits do not depend on its company.
 *
 * A batch whose nodes cannot be held at a time is cut into slices of points that lie together. */
#include "fmm/evaluator.h"

#include "base/checked.h"
#include "base/neighbours.h"

#include <string.h>

enum {
  OUTSIDE_TOGETHER = 64, /* points outside that walk over the tree together */
  SLICE_SMALL = 64,      /* points for which nodes are made whatever their limit */
};

/* Terms of a task, about half a millisecond; tasks between two calls of the host's progress callback. */
static const size_t TASK_TERMS = 1 << 20, TASKS_TOGETHER = 256;

/* Points of a leaf, or outside: sorted[first] .. sorted[last - 1]. */
typedef struct group {
  uint32_t node;
  size_t first, last;
} group;

typedef struct batch {
  const batten_fmm_evaluator *e;
  fmm_far at;
  const double *points;
  double *values, *gradients; /* [count], [count][n] or NULL */
  /* a slice */
  size_t *sorted; /* points, those of a leaf together */
  size_t groups;
  group *group;
  size_t tasks;
  size_t *task_first; /* [tasks + 1] into group */
  size_t first_task;
} batch;

/* ---- sums ---- */

typedef double lanes_of_sums[FMM_SUMS][FMM_LANES];

static void store(const batch *b, const size_t *point, size_t count, lanes_of_sums sums) {
  const unsigned n = b->e->kernel.n;
  for (size_t lane = 0; lane < count; lane++) {
    b->values[point[lane]] = sums[0][lane];
    for (unsigned a = 0; a < n && b->gradients; a++) b->gradients[point[lane] * n + a] = sums[1 + a][lane];
  }
}

/* Places of up to FMM_LANES points; lanes left over repeat the last one. */
static void load(const batch *b, const size_t *point, size_t count, double x[3][FMM_LANES]) {
  const unsigned n = b->e->kernel.n;
  for (size_t lane = 0; lane < FMM_LANES; lane++)
    for (unsigned a = 0; a < n; a++) x[a][lane] = b->points[point[lane < count ? lane : count - 1] * n + a];
}

/* Cells that follow each other hold sources that do. */
static void sum_near(const batch *b, const fmm_node *t, fmm_near_function *near, const double x[3][FMM_LANES],
                     lanes_of_sums sums) {
  const fmm_cell *cell = b->e->tree.cell;
  const uint32_t *list = b->e->nodes.near + t->near_begin;
  for (size_t i = 0; i < t->near_count;) {
    const size_t first = cell[list[i]].s0;
    size_t last = cell[list[i++]].s1;
    while (i < t->near_count && cell[list[i]].s0 == last) last = cell[list[i++]].s1;
    near(&b->e->terms, first, last, x, sums);
  }
}

static void sum_in_node(const batch *b, const group *g, fmm_near_function *near) {
  const fmm_operators *o = b->e->operators;
  const fmm_node *t = &b->e->nodes.node[g->node];
  for (size_t i = g->first; i < g->last; i += FMM_LANES) {
    const size_t count = g->last - i < FMM_LANES ? g->last - i : FMM_LANES;
    double x[3][FMM_LANES] = {{0}}, sums[FMM_SUMS][FMM_LANES] = {{0}};
    load(b, b->sorted + i, count, x);
    b->at.lanes->evaluate(o->n, o->order, &t->frame, b->gradients != NULL, fmm_expansion(b->e, g->node),
                          (const double(*)[FMM_LANES])x, sums);
    sum_near(b, t, near, (const double(*)[FMM_LANES])x, sums);
    store(b, b->sorted + i, count, sums);
  }
}

/* ---- outside ---- */

/* Some points on their walk over the sources' tree. */
typedef struct walkers {
  size_t count;
  double x[OUTSIDE_TOGETHER / FMM_LANES][3][FMM_LANES];
  lanes_of_sums sums[OUTSIDE_TOGETHER / FMM_LANES];
} walkers;

/* At least three halves from the centre along an axis: as far from the cell as from another of its size. */
static bool is_apart(unsigned n, const fmm_frame *f, const walkers *w, size_t i) {
  for (unsigned a = 0; a < n; a++)
    if (fabs(w->x[i / FMM_LANES][a][i % FMM_LANES] - f->centre[a]) >= 3 * f->half) return true;
  return false;
}

/* Adds terms first .. last - 1 to the points of a set. */
static void add_terms(const batch *b, walkers *w, uint64_t set, fmm_near_function *near, const fmm_terms *terms,
                      size_t first, size_t last) {
  const unsigned used = b->gradients ? 1 + b->e->kernel.n : 1;
  for (size_t k = 0; k < OUTSIDE_TOGETHER / FMM_LANES; k++) {
    const uint64_t lanes = set >> k * FMM_LANES & 0xff;
    if (!lanes) continue;
    double part[FMM_SUMS][FMM_LANES] = {{0}};
    near(terms, first, last, (const double(*)[FMM_LANES])w->x[k], part);
    for (unsigned q = 0; q < used; q++)
      for (size_t lane = 0; lane < FMM_LANES; lane++)
        if (lanes >> lane & 1) w->sums[k][q][lane] += part[q][lane];
  }
}

/* The same of the weights at the nodes of a cell. */
static void add_nodes(const batch *b, walkers *w, uint64_t set, fmm_near_function *plain, size_t cell) {
  enum { TOGETHER = 64 };
  const fmm_operators *o = b->e->operators;
  double block[3 * TOGETHER] = {0}, *x[3] = {block, block + TOGETHER, block + 2 * TOGETHER};
  for (size_t i = 0; i < o->full; i += TOGETHER) {
    const size_t count = o->full - i < TOGETHER ? o->full - i : TOGETHER;
    batten_fmm_place_nodes(o, &b->e->tree.cell[cell].frame, i, count, x);
    const fmm_terms terms = {.x = {x[0], x[1], x[2]}, .w = b->e->top + cell * o->full + i};
    add_terms(b, w, set, plain, &terms, 0, count);
  }
}

/* A cell on the walk, and the points that are not done with it. */
typedef struct step {
  uint32_t cell;
  uint64_t set;
} step;

/* Down from the root of the sources: cells that are apart by their nodes or, where those are more, by their sources.
 * stack [FMM_CLASSES * levels] */
static void walk(const batch *b, walkers *w, fmm_near_function *near, fmm_near_function *plain, step *stack) {
  const batten_fmm_evaluator *e = b->e;
  const fmm_operators *o = e->operators;
  size_t height = 0;
  stack[height++] = (step){0, w->count < 64 ? ((uint64_t)1 << w->count) - 1 : UINT64_MAX};
  while (height > 0) {
    const step s = stack[--height];
    const fmm_cell *c = &e->tree.cell[s.cell];
    const bool few = fmm_is_leaf(c) || s.cell >= e->top_cells || c->s1 - c->s0 <= o->full;
    uint64_t apart = 0;
    for (size_t i = 0; i < w->count && !few; i++)
      if (s.set >> i & 1) apart |= (uint64_t)is_apart(o->n, &c->frame, w, i) << i;
    if (few) add_terms(b, w, s.set, near, &e->terms, c->s0, c->s1);
    if (apart) add_nodes(b, w, apart, plain, s.cell);
    for (uint32_t k = 0; k < c->children && !few && s.set != apart; k++)
      stack[height++] = (step){c->child + k, s.set & ~apart};
  }
}

static void sum_outside(const batch *b, const group *g, fmm_near_function *near, fmm_near_function *plain) {
  step stack[FMM_CLASSES * (FMM_TOP_LEVELS + 1)];
  for (size_t i = g->first; i < g->last; i += OUTSIDE_TOGETHER) {
    walkers w = {.count = g->last - i < OUTSIDE_TOGETHER ? g->last - i : OUTSIDE_TOGETHER};
    for (size_t k = 0; k < w.count; k += FMM_LANES)
      load(b, b->sorted + i + k, w.count - k < FMM_LANES ? w.count - k : FMM_LANES, w.x[k / FMM_LANES]);
    walk(b, &w, near, plain, stack);
    for (size_t k = 0; k < w.count; k += FMM_LANES)
      store(b, b->sorted + i + k, w.count - k < FMM_LANES ? w.count - k : FMM_LANES, w.sums[k / FMM_LANES]);
  }
}

/* All sources, one by one. */
static void sum_directly(const batch *b, const group *g, fmm_near_function *near) {
  for (size_t i = g->first; i < g->last; i += FMM_LANES) {
    const size_t count = g->last - i < FMM_LANES ? g->last - i : FMM_LANES;
    double x[3][FMM_LANES] = {{0}}, sums[FMM_SUMS][FMM_LANES] = {{0}};
    load(b, b->sorted + i, count, x);
    near(&b->e->terms, 0, b->e->tree.sources.count, (const double(*)[FMM_LANES])x, sums);
    store(b, b->sorted + i, count, sums);
  }
}

static void sum_task(void *arg, size_t index) {
  const batch *b = arg;
  const unsigned n = b->e->kernel.n, power = (unsigned)b->e->kernel.power;
  const size_t task = b->first_task + index;
  fmm_near_function *near = b->at.lanes->near(n, power, b->gradients != NULL, b->e->dipoles);
  fmm_near_function *plain = b->at.lanes->near(n, power, b->gradients != NULL, 0);
  for (size_t i = b->task_first[task]; i < b->task_first[task + 1]; i++) {
    const group *g = &b->group[i];
    if (!b->e->operators)
      sum_directly(b, g, near);
    else if (g->node == FMM_OUTSIDE)
      sum_outside(b, g, near, plain);
    else
      sum_in_node(b, g, near);
  }
}

/* ---- a slice ---- */

/* Cuts sorted[first] .. sorted[last - 1], whose points take `terms` each, into groups, and groups into tasks. */
static void add_groups(batch *b, uint32_t node, size_t first, size_t last, size_t terms, size_t *work) {
  const size_t unit = node == FMM_OUTSIDE ? OUTSIDE_TOGETHER : FMM_LANES;
  const size_t most = (TASK_TERMS / (unit * terms) + 1) * unit;
  for (size_t i = first; i < last; i += most) {
    const size_t end = last - i < most ? last : i + most;
    if (*work >= TASK_TERMS) b->task_first[b->tasks++] = b->groups, *work = 0;
    b->group[b->groups++] = (group){node, i, end};
    *work += ((end - i + unit - 1) / unit) * unit * terms;
  }
}

/* Points of one leaf together, those outside at the end; `leaves` are the leaves that have some. */
static void sort_points(batten_fmm_evaluator *e, batch *b, size_t count, const size_t *which, const uint32_t *at,
                        uint32_t *leaf) {
  fmm_node *node = e->nodes.node;
  size_t leaves = 0, place = 0, work = TASK_TERMS;
  b->groups = b->tasks = 0;
  for (size_t i = 0; i < count; i++)
    if (at[i] != FMM_OUTSIDE && node[at[i]].visitors++ == 0) leaf[leaves++] = at[i];
  for (size_t k = 0; k < leaves; k++) {
    fmm_node *t = &node[leaf[k]];
    const size_t first = place;
    place += t->visitors;
    t->visitors = first;
    add_groups(b, leaf[k], first, place, t->near_sources + e->operators->full / 8 + 64, &work);
  }
  const size_t top = e->operators ? 8 * e->operators->full : 0, outside = place;
  for (size_t i = 0; i < count; i++) {
    const size_t to = at[i] == FMM_OUTSIDE ? place++ : node[at[i]].visitors++;
    b->sorted[to] = which ? which[i] : i;
  }
  add_groups(b, FMM_OUTSIDE, outside, place, e->operators ? top : e->tree.sources.count + 8, &work);
  b->task_first[b->tasks] = b->groups;
  for (size_t k = 0; k < leaves; k++) node[leaf[k]].visitors = 0;
}

/* Sums at points[which[0]] .. points[which[count - 1]], or at the first ones; `from` and `to` are the part done. */
static batten_status sum_slice(batten_context *ctx, batten_fmm_evaluator *e, batch *b, size_t count,
                               const size_t *which, bool forced, double from, double to) {
  batten_status st = BATTEN_E_NOMEM;
  uint32_t *at = batten_alloc_array(ctx, count, sizeof *at), *leaf = NULL;
  if (!at) goto done;
  if (e->operators && (st = batten_fmm_nodes_find(ctx, e, count, which, b->points, forced, at)) < 0) goto done;
  for (size_t i = 0; i < count && !e->operators; i++) at[i] = FMM_OUTSIDE;
  const size_t leaves = count < e->nodes.count ? count : e->nodes.count;
  const size_t groups = count / FMM_LANES + leaves + 1; /* of a leaf all but the last have FMM_LANES points */
  st = BATTEN_E_NOMEM;
  leaf = batten_alloc_array(ctx, leaves, sizeof *leaf);
  b->sorted = batten_alloc_array(ctx, count, sizeof *b->sorted);
  b->group = batten_alloc_array(ctx, groups, sizeof *b->group);
  b->task_first = batten_alloc_array(ctx, groups + 1, sizeof *b->task_first);
  if (!leaf || !b->sorted || !b->group || !b->task_first) goto done;
  sort_points(e, b, count, which, at, leaf);
  st = BATTEN_OK;
  for (size_t i = 0; i < b->tasks && st >= 0; i += TASKS_TOGETHER) {
    st = batten_progress(ctx, "evaluate", from + (to - from) * (double)i / (double)b->tasks);
    b->first_task = i;
    if (st >= 0) batten_parallel(ctx, b->tasks - i < TASKS_TOGETHER ? b->tasks - i : TASKS_TOGETHER, sum_task, b);
  }
done:
  batten_free(ctx, b->task_first);
  batten_free(ctx, b->group);
  batten_free(ctx, b->sorted);
  batten_free(ctx, leaf);
  batten_free(ctx, at);
  return st;
}

/* ---- a batch ---- */

/* *order [count]: points that lie together stand together; NULL without memory: the caller's order does then. Fails:
 * CANCELLED. */
static batten_status order_of(batten_context *ctx, unsigned n, size_t count, const double *points, size_t **order) {
  batten_tree *tree = NULL;
  *order = batten_alloc_array(ctx, count, sizeof **order);
  batten_status st = *order ? batten_tree_new(ctx, n, count, points, &tree) : BATTEN_E_NOMEM;
  if (st >= 0) {
    batten_tree_order(tree, *order);
    batten_tree_free(ctx, tree);
    return BATTEN_OK;
  }
  batten_free(ctx, *order);
  *order = NULL;
  return batten_expect(ctx, st, BATTEN_E_NOMEM);
}

/* Slices: all points at first. When there is no memory for the nodes of a slice, those of the slices before go; when
 * that is not enough, slices are halved. */
batten_status batten_fmm_batch(batten_context *ctx, batten_fmm_evaluator *e, size_t count, const double *points,
                               double *values, double *gradients) {
  batch b = {.e = e,
             .at = {e->operators, batten_fmm_lanes_now()},
             .points = points,
             .values = values,
             .gradients = gradients};
  size_t *order = NULL, size = count;
  bool ordered = false;
  batten_status st = BATTEN_OK;
  for (size_t done = 0; done < count && st >= 0;) {
    const size_t now = count - done < size ? count - done : size;
    const bool empty = e->nodes.count <= 1, last_try = empty && now <= SLICE_SMALL;
    const double scale = 1 / (double)count;
    batch slice = b;
    if (!order) slice.points += done * e->kernel.n, slice.values += done;
    if (!order && gradients) slice.gradients += done * e->kernel.n;
    st = sum_slice(ctx, e, &slice, now, order ? order + done : NULL, last_try, (double)done * scale,
                   (double)(done + now) * scale);
    if (st != BATTEN_E_NOMEM || last_try) {
      done += now;
      continue;
    }
    batten_fmm_nodes_drop(e);
    e->info.drops++;
    st = batten_expect(ctx, st, BATTEN_E_NOMEM);
    if (!empty) continue;
    size = (now + 1) / 2;
    if (!ordered && done == 0) st = order_of(ctx, e->kernel.n, count, points, &order);
    ordered = true;
  }
  batten_free(ctx, order);
  return st;
}
