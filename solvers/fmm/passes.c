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

typedef struct pass {
  const batten_fmm *f;
  fmm_far at;
  fmm_terms terms;
  bool gradients, dipoles;
  size_t first_task;
  size_t first, last; /* cells of the level */
} pass;

static double *scratch_of(const pass *p, size_t index) {
  return p->f->work.scratch + index * p->f->work.scratch_each;
}

/* ---- near ---- */

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
  batten_fmm_place_nodes(o, &p->f->tree.cell[source].frame, 0, o->full, x);
  memcpy(a, p->f->work.tensors + source * o->full, o->full * sizeof *a);
  const double *w = batten_fmm_through(&p->at, (const double(*)[FMM_ORDER_MAX])o->at_nodes, a, b);
  const fmm_terms terms = {.x = {x[0], x[1], x[2]}, .w = w};
  sum_at_leaf(p, leaf, near, &terms, 0, o->full);
}

static void near_task(void *arg, size_t index) {
  const pass *p = arg;
  const fmm_lists *l = &p->f->lists;
  const size_t task = p->first_task + index;
  const unsigned n = p->f->kernel.n, power = (unsigned)p->f->kernel.power;
  fmm_near_function *near = p->at.lanes->near(n, power, p->gradients, p->dipoles);
  fmm_near_function *plain = p->at.lanes->near(n, power, p->gradients, 0);
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

static void across_task(void *arg, size_t index) {
  const pass *p = arg;
  const fmm_lists *l = &p->f->lists;
  const size_t *begin = l->kind_begin + (p->first_task + index) * FMM_KINDS;
  if (begin[0] == begin[FMM_KINDS]) return;
  const fmm_cell *cell = &p->f->tree.cell[l->translations[begin[0]].target];
  batten_fmm_translate(&p->at, pow(cell->frame.half, p->f->kernel.power), p->f->work.level_transfer[cell->level],
                       begin, l->translations, p->f->work.outer, p->f->work.inner, scratch_of(p, index));
}

/* ---- down ---- */

static void add_leaf(const pass *p, const fmm_cell *c, const fmm_cell *leaf, double *tensor, double *scratch) {
  fmm_near_function *near = p->at.lanes->near(p->f->kernel.n, (unsigned)p->f->kernel.power, 0, p->dipoles);
  batten_fmm_add_sources(&p->at, &c->frame, near, &p->terms, leaf->s0, leaf->s1, tensor, scratch);
}

static void evaluate_leaf(const pass *p, const fmm_cell *c, const double *tensor) {
  const fmm_operators *o = p->f->operators;
  const fmm_points *targets = &p->f->tree.targets;
  double *sums = p->f->work.sums;
  for (size_t i0 = c->t0; i0 < c->t1; i0 += FMM_LANES) {
    double x[3][FMM_LANES] = {{0}}, part[FMM_SUMS][FMM_LANES] = {{0}};
    for (size_t lane = 0; lane < FMM_LANES; lane++)
      for (unsigned a = 0; a < o->n; a++) x[a][lane] = targets->x[a][i0 + lane < c->t1 ? i0 + lane : c->t1 - 1];
    p->at.lanes->evaluate(o->n, o->order, &c->frame, p->gradients, tensor, (const double(*)[FMM_LANES])x, part);
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
  const size_t begin = p->first + (p->first_task + index) * FMM_CELLS_TOGETHER;
  for (size_t i = begin; i < begin + FMM_CELLS_TOGETHER && i < p->last; i++) {
    const fmm_cell *c = &p->f->tree.cell[i];
    double *tensor = p->f->work.tensors + i * o->full;
    if (c->t0 == c->t1) continue;
    if (i == 0)
      memset(tensor, 0, o->full * sizeof *tensor);
    else
      memcpy(tensor,
             batten_fmm_shift(&p->at, &c->frame, &p->f->tree.cell[c->parent].frame,
                              (const double(*)[FMM_ORDER_MAX][FMM_ORDER_MAX])o->down,
                              p->f->work.tensors + c->parent * o->full, a, b),
             o->full * sizeof *tensor);
    batten_fmm_expand(&p->at, p->f->work.inner + i * o->stride, tensor, a);
    for (size_t k = l->begin[FMM_LIST_TO_CELL][i]; k < l->begin[FMM_LIST_TO_CELL][i + 1]; k++)
      add_leaf(p, c, &p->f->tree.cell[l->with[FMM_LIST_TO_CELL][k]], tensor, a);
    if (fmm_is_leaf(c)) evaluate_leaf(p, c, tensor);
  }
}

/* ---- a product ---- */

/* One translates to 128 cells, which takes some hundredths of a second: a group is short enough for a cancel. */
enum { ACROSS_GROUP = FMM_GROUP / 8 };

/* Tasks in groups of at most FMM_GROUP, each with its own scratch. */
static batten_status run(batten_context *ctx, pass *p, size_t tasks, size_t group, void (*task)(void *, size_t),
                         double from, double to) {
  for (size_t first = 0; first < tasks; first += group) {
    batten_status st = batten_progress(ctx, "sums", from + (to - from) * (double)first / (double)tasks);
    if (st < 0) return st;
    p->first_task = first;
    batten_parallel(ctx, tasks - first < group ? tasks - first : group, task, p);
  }
  return BATTEN_OK;
}

static batten_status run_level(batten_context *ctx, pass *p, unsigned level, void (*task)(void *, size_t),
                               double at) {
  p->first = p->f->tree.level_first[level], p->last = p->f->tree.level_first[level + 1];
  return run(ctx, p, (p->last - p->first + FMM_CELLS_TOGETHER - 1) / FMM_CELLS_TOGETHER, FMM_GROUP, task, at, at);
}

batten_status batten_fmm_passes(batten_context *ctx, batten_fmm *f, const double *weights, const double *dipoles,
                                bool gradients) {
  pass p = {.f = f, .at = {f->operators, batten_fmm_lanes_now()}, .gradients = gradients, .dipoles = dipoles != NULL};
  batten_status st = BATTEN_OK;
  batten_fmm_set_terms(&f->tree.sources, f->tree.source_place, f->kernel.n, f->sources.count, weights, dipoles,
                       f->work.terms, &p.terms);
  memset(f->work.sums, 0, f->tree.targets.count * (gradients ? 1 + f->kernel.n : 1) * sizeof(double));
  st = batten_fmm_climb(ctx, &p.at, &f->tree, &p.terms, p.dipoles, f->work.tensors, f->work.outer, f->work.scratch);
  if (st < 0) return st;
  if ((st = run(ctx, &p, f->lists.tasks, FMM_GROUP, near_task, 0.1, 0.5)) < 0) return st;
  memset(f->work.inner, 0, f->tree.cells * f->operators->stride * sizeof(double));
  if ((st = run(ctx, &p, f->lists.chunks, ACROSS_GROUP, across_task, 0.5, 0.9)) < 0) return st;
  for (unsigned level = 0; level < f->tree.levels; level++)
    if ((st = run_level(ctx, &p, level, down_task, 0.9)) < 0) return st;
  return BATTEN_OK;
}

/* ---- memory ---- */

/* Kernels with a logarithm: what carries far fields on each level that has translations. */
static batten_status make_level_transfers(batten_context *ctx, batten_fmm *f) {
  for (size_t chunk = 0; chunk < f->lists.chunks; chunk++) {
    const size_t *begin = f->lists.kind_begin + chunk * FMM_KINDS;
    if (begin[0] == begin[FMM_KINDS]) continue;
    const fmm_cell *cell = &f->tree.cell[f->lists.translations[begin[0]].target];
    double **to = &f->work.level_transfer[cell->level];
    if (!*to && !(*to = batten_fmm_level_transfer(ctx, f->operators, cell->frame.half))) return BATTEN_E_NOMEM;
  }
  return BATTEN_OK;
}

batten_status batten_fmm_work_new(batten_context *ctx, batten_fmm *f) {
  const fmm_operators *o = f->operators;
  fmm_work *w = &f->work;
  w->scratch_each = batten_fmm_scratch(o);
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
