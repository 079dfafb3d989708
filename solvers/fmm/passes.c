/* One product: moments up the tree, far fields across, expansions down, and what is near.
 *
 *   moments    of a leaf from its sources, of a cell from its children: exact sums of tau_i(y)
 *   outer      U' moments, what leaves the cell
 *   near       direct sums at the targets of each leaf, and far fields of smaller cells there
 *   inner      sums of C_t outer over the translations to a cell
 *   down       expansion of a cell: its parent's, U inner, and sources of larger leaves; evaluated in the leaves
 *
 * Every number is made by one task, in an order that sizes alone decide. Tensors hold moments first and expansions
 * then: the far fields that `near` evaluates at nodes are the last to be read. */
#include "fmm/fmm_inner.h"

#include "base/checked.h"

#include <string.h>

enum { CELLS_TOGETHER = 16, BATCH = 48, NODE_ARRAYS = 6 };

typedef struct pass {
  const batten_fmm *f;
  const fmm_lanes *lanes;
  fmm_terms terms;
  bool gradients, dipoles;
  size_t first_task;
  size_t first, last; /* cells of the level */
} pass;

static double *scratch_of(const pass *p, size_t index) {
  return p->f->work.scratch + index * p->f->work.scratch_each;
}

/* ---- up ---- */

static void compress(const pass *p, size_t cell, double *spare) {
  const fmm_operators *o = p->f->operators;
  const double *tensor = p->f->work.tensors + cell * o->full;
  double *outer = p->f->work.outer + cell * o->stride;
  memset(outer, 0, o->stride * sizeof *outer);
  for (size_t i = 0; i < o->full; i++) spare[i] = tensor[o->members[i]];
  for (unsigned c = 0; c < o->classes; spare += o->class_full[c++])
    p->lanes->combine(o->class_full[c], o->class_rank[c], o->reduce[c], spare, outer + o->class_place[c]);
}

/* Moves a tensor between a child and its parent: one axis after the other, by the side on which the child lies. */
static const double *shift(const pass *p, const fmm_cell *child,
                           const double (*matrices)[FMM_ORDER_MAX][FMM_ORDER_MAX], const double *tensor, double *a,
                           double *b) {
  const fmm_operators *o = p->f->operators;
  const fmm_cell *parent = &p->f->tree.cell[child->parent];
  for (unsigned k = 0; k < o->n; k++) {
    const unsigned side = child->frame.centre[k] > parent->frame.centre[k];
    double *to = k % 2 ? b : a;
    p->lanes->contract(o->order, o->full / o->order, matrices[side], tensor, to);
    tensor = to;
  }
  return tensor;
}

static void up_task(void *arg, size_t index) {
  const pass *p = arg;
  const fmm_operators *o = p->f->operators;
  double *a = scratch_of(p, index), *b = a + o->full, *rows = b + o->full;
  const size_t begin = p->first + (p->first_task + index) * CELLS_TOGETHER;
  for (size_t i = begin; i < begin + CELLS_TOGETHER && i < p->last; i++) {
    const fmm_cell *c = &p->f->tree.cell[i];
    double *tensor = p->f->work.tensors + i * o->full;
    if (c->s0 == c->s1) continue;
    memset(tensor, 0, o->full * sizeof *tensor);
    if (fmm_is_leaf(c))
      p->lanes->moments(o->n, o->order, &c->frame, p->dipoles, &p->terms, c->s0, c->s1, tensor, rows);
    for (uint32_t k = c->child; k < c->child + c->children; k++) {
      const fmm_cell *child = &p->f->tree.cell[k];
      if (child->s0 == child->s1) continue;
      const double *moved = shift(p, child, (const double(*)[FMM_ORDER_MAX][FMM_ORDER_MAX])o->up,
                                  p->f->work.tensors + k * o->full, a, b);
      for (size_t q = 0; q < o->full; q++) tensor[q] += moved[q];
    }
    compress(p, i, a);
  }
}

/* ---- near ---- */

/* A tensor through a matrix along each axis; ends in one of the two. */
static double *through(const pass *p, const double (*matrix)[FMM_ORDER_MAX], double *from, double *to) {
  const fmm_operators *o = p->f->operators;
  for (unsigned k = 0; k < o->n; k++) {
    p->lanes->contract(o->order, o->full / o->order, matrix, from, to);
    double *t = from;
    from = to, to = t;
  }
  return from;
}

/* Places of the nodes of a cell, x[axis][full]. */
static void place_nodes(const fmm_operators *o, const fmm_frame *frame, double *x[3]) {
  for (size_t i = 0; i < o->full; i++) {
    size_t rest = i;
    for (unsigned a = o->n; a-- > 0; rest /= o->order)
      x[a][i] = frame->centre[a] + frame->half * o->node[rest % o->order];
  }
}

/* Sums at the targets of a leaf over a range of terms. */
static void sum_at_leaf(const pass *p, const fmm_cell *c, fmm_near_function *near, const fmm_terms *terms,
                        size_t first, size_t last) {
  const fmm_points *targets = &p->f->tree.targets;
  double *sums = p->f->work.sums;
  const unsigned n = p->f->kernel.n, used = p->gradients ? 1 + n : 1;
  for (size_t i0 = c->t0; i0 < c->t1; i0 += FMM_LANES) {
    double x[3][FMM_LANES] = {{0}}, part[FMM_SUMS][FMM_LANES] = {{0}};
    for (size_t lane = 0; lane < FMM_LANES; lane++)
      for (unsigned a = 0; a < n; a++) x[a][lane] = targets->x[a][i0 + lane < c->t1 ? i0 + lane : c->t1 - 1];
    near(terms, first, last, (const double(*)[FMM_LANES])x, part);
    for (unsigned q = 0; q < used; q++)
      for (size_t lane = 0; lane < FMM_LANES && i0 + lane < c->t1; lane++)
        sums[q * targets->count + i0 + lane] += part[q][lane];
  }
}

/* The far field of a cell as weights at its nodes. */
static void sum_far_cell(const pass *p, const fmm_cell *leaf, size_t source, fmm_near_function *near,
                         double *scratch) {
  const fmm_operators *o = p->f->operators;
  double *x[3] = {scratch, scratch + o->full, scratch + 2 * o->full}, *a = scratch + 3 * o->full, *b = a + o->full;
  place_nodes(o, &p->f->tree.cell[source].frame, x);
  memcpy(a, p->f->work.tensors + source * o->full, o->full * sizeof *a);
  const double *w = through(p, (const double(*)[FMM_ORDER_MAX])o->at_nodes, a, b);
  const fmm_terms terms = {.x = {x[0], x[1], x[2]}, .w = w};
  sum_at_leaf(p, leaf, near, &terms, 0, o->full);
}

static void near_task(void *arg, size_t index) {
  const pass *p = arg;
  const fmm_lists *l = &p->f->lists;
  const size_t task = p->first_task + index;
  const unsigned n = p->f->kernel.n, power = (unsigned)p->f->kernel.power;
  fmm_near_function *near = p->lanes->near(n, power, p->gradients, p->dipoles);
  fmm_near_function *plain = p->lanes->near(n, power, p->gradients, 0);
  for (size_t i = l->task_first[task]; i < l->task_first[task + 1]; i++) {
    const size_t cell = l->leaf[i];
    const fmm_cell *c = &p->f->tree.cell[cell];
    for (size_t k = l->begin[FMM_LIST_NEAR][cell]; k < l->begin[FMM_LIST_NEAR][cell + 1]; k++) {
      const fmm_cell *s = &p->f->tree.cell[l->with[FMM_LIST_NEAR][k]];
      sum_at_leaf(p, c, near, &p->terms, s->s0, s->s1);
    }
    for (size_t k = l->begin[FMM_LIST_FROM_CELL][cell]; k < l->begin[FMM_LIST_FROM_CELL][cell + 1]; k++)
      sum_far_cell(p, c, l->with[FMM_LIST_FROM_CELL][k], plain, scratch_of(p, index));
  }
}

/* ---- across ---- */

/* +-factor by the parity of class c and the mirrored axes. */
static double signed_factor(unsigned c, uint32_t mirror, double factor) {
  const unsigned odd = c & mirror;
  return ((odd ^ odd >> 1 ^ odd >> 2) & 1) ? -factor : factor;
}

static void gather(const pass *p, const fmm_translation *t, double factor, double *b) {
  const fmm_operators *o = p->f->operators;
  const double *outer = p->f->work.outer + t->source * o->stride;
  for (unsigned c = 0; c < o->classes; c++) {
    const double sign = signed_factor(c, t->mirror, factor);
    for (size_t i = o->class_place[c]; i < o->class_place[c] + o->class_rank[c]; i++) b[i] = sign * outer[i];
  }
}

static void scatter(const pass *p, const fmm_translation *t, const double *y) {
  const fmm_operators *o = p->f->operators;
  double *inner = p->f->work.inner + t->target * o->stride;
  for (unsigned c = 0; c < o->classes; c++) {
    const double sign = signed_factor(c, t->mirror, 1);
    for (size_t i = o->class_place[c]; i < o->class_place[c] + o->class_rank[c]; i++) inner[i] += sign * y[i];
  }
}

/* Translations of one kind, BATCH at most: gathered, one product, scattered. */
static void translate(const pass *p, const double *transfer, const fmm_translation *t, size_t count, double factor,
                      double *b, double *y) {
  const fmm_operators *o = p->f->operators;
  for (size_t c = 0; c < count; c++) gather(p, &t[c], factor, b + c * o->stride);
  for (size_t i = 0; i < o->stride; i += FMM_PANEL)
    for (size_t c = 0; c < count; c += FMM_COLUMNS) /* columns beyond the last are what was there before: not read */
      p->lanes->tile(o->rank, transfer + i * o->rank, b + c * o->stride, o->stride, y + c * o->stride + i, o->stride);
  for (size_t c = 0; c < count; c++) scatter(p, &t[c], y + c * o->stride);
}

static void across_task(void *arg, size_t index) {
  const pass *p = arg;
  const fmm_operators *o = p->f->operators;
  const fmm_lists *l = &p->f->lists;
  const size_t chunk = p->first_task + index, *begin = l->kind_begin + chunk * FMM_KINDS;
  if (begin[0] == begin[FMM_KINDS]) return;
  double *b = scratch_of(p, index), *y = b + BATCH * o->stride;
  memset(b, 0, BATCH * o->stride * sizeof *b);
  const fmm_cell *cell = &p->f->tree.cell[l->translations[begin[0]].target];
  const double factor = pow(cell->frame.half, p->f->kernel.power);
  const double *level = p->f->work.level_transfer[cell->level];
  for (unsigned kind = 0, known = 0; kind < FMM_KINDS; kind++) {
    if (!o->transfer[kind]) continue;
    const double *transfer = level ? level + known * o->stride * o->rank : o->transfer[kind];
    known++;
    for (size_t i = begin[kind]; i < begin[kind + 1]; i += BATCH)
      translate(p, transfer, l->translations + i, begin[kind + 1] - i < BATCH ? begin[kind + 1] - i : BATCH, factor,
                b, y);
  }
}

/* ---- down ---- */

/* Adds the sources of a larger leaf to an expansion, by their sums at the nodes. */
static void add_leaf_sources(const pass *p, const fmm_cell *c, const fmm_cell *leaf, double *tensor,
                             double *scratch) {
  const fmm_operators *o = p->f->operators;
  double *nodes[3] = {scratch, scratch + o->full, scratch + 2 * o->full}, *a = scratch + 3 * o->full,
         *b = a + o->full;
  fmm_near_function *near = p->lanes->near(o->n, (unsigned)p->f->kernel.power, 0, p->dipoles);
  place_nodes(o, &c->frame, nodes);
  for (size_t i = 0; i < o->full; i += FMM_LANES) {
    double x[3][FMM_LANES] = {{0}}, sums[FMM_SUMS][FMM_LANES] = {{0}};
    for (size_t lane = 0; lane < FMM_LANES; lane++)
      for (unsigned k = 0; k < o->n; k++) x[k][lane] = nodes[k][i + lane < o->full ? i + lane : i];
    near(&p->terms, leaf->s0, leaf->s1, (const double(*)[FMM_LANES])x, sums);
    for (size_t lane = 0; lane < FMM_LANES && i + lane < o->full; lane++) a[i + lane] = sums[0][lane];
  }
  const double *moved = through(p, (const double(*)[FMM_ORDER_MAX])o->from_nodes, a, b);
  for (size_t i = 0; i < o->full; i++) tensor[i] += moved[i];
}

static void expand(const pass *p, size_t cell, double *tensor, double *spare) {
  const fmm_operators *o = p->f->operators;
  const double *inner = p->f->work.inner + cell * o->stride;
  memset(spare, 0, o->full * sizeof *spare);
  for (unsigned c = 0, first = 0; c < o->classes; first += (unsigned)o->class_full[c++])
    p->lanes->combine(o->class_rank[c], o->class_full[c], o->expand[c], inner + o->class_place[c], spare + first);
  for (size_t i = 0; i < o->full; i++) tensor[o->members[i]] += spare[i];
}

static void evaluate_leaf(const pass *p, const fmm_cell *c, const double *tensor) {
  const fmm_operators *o = p->f->operators;
  const fmm_points *targets = &p->f->tree.targets;
  double *sums = p->f->work.sums;
  for (size_t i0 = c->t0; i0 < c->t1; i0 += FMM_LANES) {
    double x[3][FMM_LANES] = {{0}}, part[FMM_SUMS][FMM_LANES] = {{0}};
    for (size_t lane = 0; lane < FMM_LANES; lane++)
      for (unsigned a = 0; a < o->n; a++) x[a][lane] = targets->x[a][i0 + lane < c->t1 ? i0 + lane : c->t1 - 1];
    p->lanes->evaluate(o->n, o->order, &c->frame, p->gradients, tensor, (const double(*)[FMM_LANES])x, part);
    for (unsigned q = 0; q < (p->gradients ? 1 + o->n : 1); q++)
      for (size_t lane = 0; lane < FMM_LANES && i0 + lane < c->t1; lane++)
        sums[q * targets->count + i0 + lane] += part[q][lane];
  }
}

static void down_task(void *arg, size_t index) {
  const pass *p = arg;
  const fmm_operators *o = p->f->operators;
  const fmm_lists *l = &p->f->lists;
  double *a = scratch_of(p, index), *b = a + o->full;
  const size_t begin = p->first + (p->first_task + index) * CELLS_TOGETHER;
  for (size_t i = begin; i < begin + CELLS_TOGETHER && i < p->last; i++) {
    const fmm_cell *c = &p->f->tree.cell[i];
    double *tensor = p->f->work.tensors + i * o->full;
    if (c->t0 == c->t1) continue;
    if (i == 0)
      memset(tensor, 0, o->full * sizeof *tensor);
    else
      memcpy(tensor,
             shift(p, c, (const double(*)[FMM_ORDER_MAX][FMM_ORDER_MAX])o->down,
                   p->f->work.tensors + c->parent * o->full, a, b),
             o->full * sizeof *tensor);
    expand(p, i, tensor, a);
    for (size_t k = l->begin[FMM_LIST_TO_CELL][i]; k < l->begin[FMM_LIST_TO_CELL][i + 1]; k++)
      add_leaf_sources(p, c, &p->f->tree.cell[l->with[FMM_LIST_TO_CELL][k]], tensor, a);
    if (fmm_is_leaf(c)) evaluate_leaf(p, c, tensor);
  }
}

/* ---- a product ---- */

/* Tasks in groups of FMM_GROUP, each with its own scratch. */
static batten_status run(batten_context *ctx, pass *p, size_t tasks, void (*task)(void *, size_t), double from,
                         double to) {
  for (size_t first = 0; first < tasks; first += FMM_GROUP) {
    batten_status st = batten_progress(ctx, "sums", from + (to - from) * (double)first / (double)tasks);
    if (st < 0) return st;
    p->first_task = first;
    batten_parallel(ctx, tasks - first < FMM_GROUP ? tasks - first : FMM_GROUP, task, p);
  }
  return BATTEN_OK;
}

static batten_status run_level(batten_context *ctx, pass *p, unsigned level, void (*task)(void *, size_t),
                               double at) {
  p->first = p->f->tree.level_first[level], p->last = p->f->tree.level_first[level + 1];
  return run(ctx, p, (p->last - p->first + CELLS_TOGETHER - 1) / CELLS_TOGETHER, task, at, at);
}

/* Weights and dipoles in the order of the tree; equal points that are one there have their sum. */
static void set_terms(const batten_fmm *f, const double *weights, const double *dipoles, fmm_terms *terms) {
  const size_t count = f->tree.sources.count, n = f->kernel.n;
  double *to = f->work.terms;
  memset(to, 0, count * (dipoles ? 1 + n : 1) * sizeof *to);
  *terms = (fmm_terms){.w = to};
  for (unsigned a = 0; a < n; a++) {
    terms->x[a] = f->tree.sources.x[a];
    terms->g[a] = dipoles ? to + (1 + a) * count : NULL;
  }
  for (size_t i = 0; i < f->sources.count; i++) {
    const size_t j = f->tree.source_place[i];
    if (weights) to[j] += weights[i];
    for (unsigned a = 0; a < n && dipoles; a++) to[(1 + a) * count + j] += dipoles[i * n + a];
  }
}

batten_status batten_fmm_passes(batten_context *ctx, batten_fmm *f, const double *weights, const double *dipoles,
                                bool gradients) {
  pass p = {.f = f, .lanes = batten_fmm_lanes_now(), .gradients = gradients, .dipoles = dipoles != NULL};
  batten_status st = BATTEN_OK;
  set_terms(f, weights, dipoles, &p.terms);
  memset(f->work.sums, 0, f->tree.targets.count * (gradients ? 1 + f->kernel.n : 1) * sizeof(double));
  for (unsigned level = f->tree.levels; level-- > 0;)
    if ((st = run_level(ctx, &p, level, up_task, 0)) < 0) return st;
  if ((st = run(ctx, &p, f->lists.tasks, near_task, 0.1, 0.5)) < 0) return st;
  memset(f->work.inner, 0, f->tree.cells * f->operators->stride * sizeof(double));
  if ((st = run(ctx, &p, f->lists.chunks, across_task, 0.5, 0.9)) < 0) return st;
  for (unsigned level = 0; level < f->tree.levels; level++)
    if ((st = run_level(ctx, &p, level, down_task, 0.9)) < 0) return st;
  return BATTEN_OK;
}

/* ---- memory ---- */

/* Kernels with a logarithm: C_t + ln h D_t for each level that has translations. */
static batten_status make_level_transfers(batten_context *ctx, batten_fmm *f) {
  const fmm_operators *o = f->operators;
  const size_t size = o->stride * o->rank;
  size_t kinds = 0;
  for (unsigned k = 0; k < FMM_KINDS; k++) kinds += o->transfer[k] != NULL;
  for (size_t chunk = 0; chunk < f->lists.chunks; chunk++) {
    const size_t *begin = f->lists.kind_begin + chunk * FMM_KINDS;
    if (begin[0] == begin[FMM_KINDS]) continue;
    const fmm_cell *cell = &f->tree.cell[f->lists.translations[begin[0]].target];
    double **to = &f->work.level_transfer[cell->level];
    if (*to) continue;
    if (!(*to = batten_alloc_array(ctx, kinds, size * sizeof **to))) return BATTEN_E_NOMEM;
    const double l = log(cell->frame.half);
    double *out = *to;
    for (unsigned k = 0; k < FMM_KINDS; k++) {
      if (!o->transfer[k]) continue;
      for (size_t i = 0; i < size; i++) out[i] = o->transfer[k][i] + l * o->transfer_power[k][i];
      out += size;
    }
  }
  return BATTEN_OK;
}

batten_status batten_fmm_work_new(batten_context *ctx, batten_fmm *f) {
  const fmm_operators *o = f->operators;
  fmm_work *w = &f->work;
  const size_t across = 2 * BATCH * o->stride, others = NODE_ARRAYS * o->full + 8 * o->full / o->order;
  w->scratch_each = across > others ? across : others;
  w->terms = batten_alloc_array(ctx, f->tree.sources.count, (f->dipoles ? 1 + f->kernel.n : 1) * sizeof(double));
  w->tensors = batten_alloc_array(ctx, f->tree.cells, o->full * sizeof(double));
  w->outer = batten_alloc_array(ctx, f->tree.cells, o->stride * sizeof(double));
  w->inner = batten_alloc_array(ctx, f->tree.cells, o->stride * sizeof(double));
  w->sums = batten_alloc_array(ctx, f->tree.targets.count, (f->gradients ? FMM_SUMS : 1) * sizeof(double));
  w->scratch = batten_alloc_array(ctx, FMM_GROUP, w->scratch_each * sizeof(double));
  if (!w->terms || !w->tensors || !w->outer || !w->inner || !w->sums || !w->scratch) return BATTEN_E_NOMEM;
  return f->kernel.logarithm ? make_level_transfers(ctx, f) : BATTEN_OK;
}

void batten_fmm_work_free(batten_context *ctx, fmm_work *w) {
  for (unsigned level = 0; level < FMM_LEVELS_MAX; level++) batten_free(ctx, w->level_transfer[level]);
  batten_free(ctx, w->scratch);
  batten_free(ctx, w->sums);
  batten_free(ctx, w->inner);
  batten_free(ctx, w->outer);
  batten_free(ctx, w->tensors);
  batten_free(ctx, w->terms);
}
