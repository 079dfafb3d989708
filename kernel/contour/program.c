/* The quadratic program of a round.   [section 2.2 (iii)]
 *
 * Unknown is d in control = free + Z d, from the minimum without inequalities: minimise d'Z'N Z d / 2 subject to
 * C Z d >= lower - C free. So that minimum keeps all its digits, and where it satisfies the rows there is nothing to
 * solve. All matrices are sparse: a control point meets those of degree steps either way.
 *
 * Unknowns are scaled by powers of two to a diagonal of about one: where there are no data only a tension of maybe
 * 1e-12 holds the curve. Their unit is such that the reference is about one above the minimum. Rows are scaled so
 * that the reference has about one to spare: a row misses by a part of that, whether it bounds a first difference or,
 * beside an inflection, a second one that is nearly 0. Their sides are raised by a little of it, so that what engines
 * leave is mostly inside. The rest is taken away by moving towards the reference, which satisfies every row strictly.
 */
#include <float.h>
#include <string.h>

#include "base/checked.h"
#include "contour_inner.h"

/* The part of what the reference has to spare by which sides are raised. */
static const double INSIDE = 1e-9;
/* Rows that have less than this to spare are scaled as if they had it: beyond it is rounding that is enlarged. */
static const double LEAST_SPARE = 1e-7;

/* Compressed rows under way. */
typedef struct sparse {
  size_t rows, room;
  size_t *starts;
  uint32_t *indices;
  double *values;
} sparse;

static void sparse_free(batten_context *ctx, sparse *s) {
  batten_free(ctx, s->values);
  batten_free(ctx, s->indices);
  batten_free(ctx, s->starts);
}

static batten_status sparse_start(batten_context *ctx, sparse *s, size_t rows, size_t room) {
  s->starts = batten_alloc_array(ctx, rows + 1, sizeof *s->starts);
  s->indices = batten_alloc_array(ctx, room, sizeof *s->indices);
  s->values = batten_alloc_array(ctx, room, sizeof *s->values);
  s->room = room;
  if (!s->starts || !s->indices || !s->values) return BATTEN_E_NOMEM;
  s->starts[0] = 0;
  return BATTEN_OK;
}

/* A row that is summed up column by column. */
typedef struct sum {
  double *values;    /* [columns] */
  uint32_t *used;    /* [columns] those that are in */
  unsigned char *in; /* [columns] */
  size_t count;
} sum;

static void sum_add(sum *s, uint32_t column, double value) {
  if (!s->in[column]) {
    s->in[column] = 1;
    s->values[column] = 0;
    s->used[s->count++] = column;
  }
  s->values[column] += value;
}

/* Ends a row of out: the sum, entries times scale[column] * factor. */
static batten_status sum_finish(batten_context *ctx, sum *s, const double *scale, double factor, sparse *out) {
  size_t at = out->starts[out->rows];
  if (at + s->count > out->room) {
    size_t room = at + s->count + out->room / 2;
    void *indices = batten_realloc_array(ctx, out->indices, room, sizeof *out->indices);
    if (indices) out->indices = indices;
    void *values = indices ? batten_realloc_array(ctx, out->values, room, sizeof *out->values) : NULL;
    if (values) out->values = values;
    if (!values) return BATTEN_E_NOMEM;
    out->room = room;
  }
  for (size_t k = 0; k < s->count; k++) {
    uint32_t column = s->used[k];
    s->in[column] = 0;
    out->indices[at] = column;
    out->values[at++] = s->values[column] * (scale ? scale[column] : 1) * factor;
  }
  s->count = 0;
  out->starts[++out->rows] = at;
  return BATTEN_OK;
}

static double row_times(const batten_matrix *m, size_t row, const double *x) {
  double value = 0;
  for (size_t at = m->starts[row]; at < m->starts[row + 1]; at++) value += m->values[at] * x[m->indices[at]];
  return value;
}

typedef struct work {
  batten_context *ctx;
  const contour_objective *objective;
  const contour_space *space;
  const contour_rows *rows;
  const double *free, *reference;
  sum sum;
  double unit;   /* of d: what the reference is above the minimum becomes about one */
  double *scale; /* [unknowns] of d, beside the unit */
  double *bound; /* [rows] */
  double *d;     /* [unknowns] */
  sparse turned; /* Z' */
  sparse hessian, c;
} work;

static void work_free(work *w) {
  sparse_free(w->ctx, &w->c);
  sparse_free(w->ctx, &w->hessian);
  sparse_free(w->ctx, &w->turned);
  batten_free(w->ctx, w->d);
  batten_free(w->ctx, w->bound);
  batten_free(w->ctx, w->scale);
  batten_free(w->ctx, w->sum.in);
  batten_free(w->ctx, w->sum.used);
  batten_free(w->ctx, w->sum.values);
}

static batten_status work_start(work *w) {
  size_t unknowns = w->space->unknowns, n = 2 * w->space->b.count, entries = w->space->starts[n];
  w->sum.values = batten_alloc_array(w->ctx, unknowns, sizeof *w->sum.values);
  w->sum.used = batten_alloc_array(w->ctx, unknowns, sizeof *w->sum.used);
  w->sum.in = batten_alloc_array(w->ctx, unknowns, sizeof *w->sum.in);
  w->scale = batten_alloc_array(w->ctx, unknowns, sizeof *w->scale);
  w->bound = batten_alloc_array(w->ctx, w->rows->matrix.rows, sizeof *w->bound);
  w->d = batten_alloc_array(w->ctx, unknowns, sizeof *w->d);
  if (!w->sum.values || !w->sum.used || !w->sum.in || !w->scale || !w->bound || !w->d) return BATTEN_E_NOMEM;
  memset(w->sum.in, 0, unknowns);
  batten_status st = sparse_start(w->ctx, &w->turned, unknowns, entries);
  size_t band = 2 * (size_t)w->objective->b.degree + 2;
  if (st >= 0) st = sparse_start(w->ctx, &w->hessian, unknowns, unknowns * band);
  if (st >= 0) st = sparse_start(w->ctx, &w->c, w->rows->matrix.rows, w->rows->matrix.starts[w->rows->matrix.rows]);
  return st;
}

/* turned = Z'. */
static void turn(work *w) {
  const contour_space *s = w->space;
  size_t n = 2 * s->b.count, *starts = w->turned.starts;
  memset(starts, 0, (s->unknowns + 1) * sizeof *starts);
  for (size_t at = 0; at < s->starts[n]; at++) starts[s->indices[at] + 1]++;
  for (size_t j = 0; j < s->unknowns; j++) starts[j + 1] += starts[j];
  for (size_t row = 0; row < n; row++)
    for (size_t at = s->starts[row]; at < s->starts[row + 1]; at++) {
      size_t to = starts[s->indices[at]]++;
      w->turned.indices[to] = (uint32_t)row;
      w->turned.values[to] = s->values[at];
    }
  for (size_t j = s->unknowns; j > 0; j--) starts[j] = starts[j - 1]; /* each has moved to its end */
  starts[0] = 0;
}

/* sum += factor * row of Z */
static void add_space_row(work *w, size_t row, double factor) {
  const contour_space *s = w->space;
  for (size_t at = s->starts[row]; at < s->starts[row + 1]; at++)
    sum_add(&w->sum, s->indices[at], factor * s->values[at]);
}

/* Z'N Z, scaled: diagonal within a factor of four of one. */
static batten_status make_hessian(work *w) {
  const contour_objective *o = w->objective;
  size_t order = (size_t)o->b.degree + 1, n = o->b.count, unknowns = w->space->unknowns;
  batten_status st = BATTEN_OK;
  for (size_t p = 0; p < unknowns && st >= 0; p++) {
    for (size_t at = w->turned.starts[p]; at < w->turned.starts[p + 1]; at++) {
      size_t i = w->turned.indices[at] / 2, k = w->turned.indices[at] % 2;
      double z = w->turned.values[at];
      for (size_t j = i >= order ? i - order + 1 : 0; j < n && j < i + order; j++)
        add_space_row(w, 2 * j + k, z * (j < i ? o->band[j * order + i - j] : o->band[i * order + j - i]));
    }
    double diagonal = w->sum.in[p] ? w->sum.values[p] : 0;
    w->scale[p] = diagonal > 0 ? ldexp(1, ilogb(batten_unit(diagonal)) / 2) : 1;
    st = sum_finish(w->ctx, &w->sum, NULL, 1, &w->hessian);
  }
  for (size_t p = 0; p < unknowns && st >= 0; p++)
    for (size_t at = w->hessian.starts[p]; at < w->hessian.starts[p + 1]; at++)
      w->hessian.values[at] *= w->scale[p] * w->scale[w->hessian.indices[at]];
  return st;
}

/* C Z and its sides, scaled. *missing: some row does not hold at free. */
static batten_status make_rows(work *w, bool *missing) {
  const batten_matrix *m = &w->rows->matrix;
  batten_status st = BATTEN_OK;
  *missing = false;
  for (size_t i = 0; i < m->rows && st >= 0; i++) {
    double spare = row_times(m, i, w->reference) - w->rows->lower[i];
    double miss = w->rows->lower[i] - row_times(m, i, w->free), factor = batten_unit(fmax(spare, LEAST_SPARE));
    if (miss > 0) *missing = true;
    for (size_t at = m->starts[i]; at < m->starts[i + 1]; at++) add_space_row(w, m->indices[at], m->values[at]);
    w->bound[i] = factor * (miss + INSIDE * spare);
    st = sum_finish(w->ctx, &w->sum, w->scale, factor * w->unit, &w->c);
  }
  return st;
}

static batten_status solve(work *w, batten_qp_workspace *workspace, contour_program_figures *figures) {
  size_t unknowns = w->space->unknowns;
  batten_matrix h =
      batten_matrix_sparse(unknowns, unknowns, w->hessian.starts, w->hessian.indices, w->hessian.values);
  batten_matrix c = batten_matrix_sparse(w->c.rows, unknowns, w->c.starts, w->c.indices, w->c.values);
  batten_qp_problem problem = batten_qp_problem_default(unknowns);
  problem.h = &h;
  problem.c = &c;
  problem.lower = w->bound;
  batten_qp_options opt = batten_qp_options_default();
  batten_qp_solution solution = {.x = w->d};
  batten_qp_info info;
  batten_status st = batten_qp_solve(w->ctx, &problem, &opt, workspace, &solution, &info);
  if (st == BATTEN_W_STOPPED && info.cancelled)
    return batten_fail(w->ctx, BATTEN_E_CANCELLED, "cancelled by the host during quadratic program");
  figures->solved = st == BATTEN_OK || st == BATTEN_W_ACCURACY;
  if (figures->solved) {
    figures->active = info.rows_active;
    figures->iterations = info.iterations;
    for (size_t p = 0; p < unknowns; p++) w->d[p] *= w->unit * w->scale[p];
  }
  return st == BATTEN_E_NOMEM || st == BATTEN_E_CANCELLED || st == BATTEN_E_TOO_LARGE ? st : BATTEN_OK;
}

/* control moved towards the reference until all rows hold in floating point. The sums of a moved point round anew, so
 * that steps grow. */
static void settle(const work *w, double *control) {
  size_t n = 2 * w->space->b.count;
  for (int pass = 0;; pass++) {
    double move = 0;
    for (size_t i = 0; i < w->rows->matrix.rows; i++) {
      double missing = w->rows->lower[i] - row_times(&w->rows->matrix, i, control);
      if (missing <= 0) continue;
      double spare = row_times(&w->rows->matrix, i, w->reference) - w->rows->lower[i];
      move = fmax(move, missing / (missing + spare));
    }
    if (!(move > 0)) return;
    move += ldexp(DBL_EPSILON, 2 * pass);
    if (!(move < 1)) {
      memcpy(control, w->reference, n * sizeof *control);
      return;
    }
    for (size_t i = 0; i < n; i++) control[i] = (1 - move) * control[i] + move * w->reference[i];
  }
}

/* (x - free)'N (x - free): by how much x is above the minimum. */
static double above(const work *w, const double *x) {
  const contour_objective *o = w->objective;
  size_t order = (size_t)o->b.degree + 1, n = o->b.count;
  double value = 0;
  for (size_t i = 0; i < n; i++)
    for (size_t j = i; j < n && j < i + order; j++)
      for (size_t k = 0; k < 2; k++)
        value += (j > i ? 2 : 1) * o->band[i * order + j - i] * (x[2 * i + k] - w->free[2 * i + k]) *
                 (x[2 * j + k] - w->free[2 * j + k]);
  return value;
}

batten_status contour_program_solve(batten_context *ctx, batten_qp_workspace *workspace,
                                    const contour_objective *objective, const contour_space *space,
                                    const contour_rows *rows, const double *free, const double *reference,
                                    double *control, contour_program_figures *figures) {
  work w = {ctx, objective, space, rows, free, reference, .unit = 1};
  size_t n = 2 * space->b.count;
  contour_program_figures f = {.solved = true};
  bool missing = false;
  double *x = batten_alloc_array(ctx, n, sizeof *x);
  batten_status st = x ? work_start(&w) : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  turn(&w);
  double reference_above = above(&w, reference);
  if (reference_above > 0) w.unit = ldexp(1, -ilogb(batten_unit(reference_above)) / 2);
  st = make_hessian(&w);
  if (st >= 0) st = make_rows(&w, &missing);
  memcpy(x, free, n * sizeof *x);
  if (st >= 0 && missing) st = solve(&w, workspace, &f);
  if (st < 0 || !f.solved) goto done;
  for (size_t i = 0; i < n && missing; i++)
    for (size_t at = space->starts[i]; at < space->starts[i + 1]; at++)
      x[i] += space->values[at] * w.d[space->indices[at]];
  settle(&w, x);
  f.solved = above(&w, x) <= reference_above;
  if (f.solved) memcpy(control, x, n * sizeof *x);
done:
  if (st >= 0) *figures = f;
  work_free(&w);
  batten_free(ctx, x);
  return st;
}
