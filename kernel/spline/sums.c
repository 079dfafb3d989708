/* The system of a fit as the iterative solver wants it: where the unknowns are, products with K by fast multipole
 * sums, and entries in any order.
 *
 * An unknown is a weight, or one component of a gradient coefficient; several share a point. So the columns of a plan
 * become sources, each point once with a weight and a dipole, and the rows targets with a value and a gradient.
 * `slot` says where an unknown is among the numbers that <batten/fmm.h> takes or gives: values first, [points], then
 * gradients, [points][n].
 *
 * Operators of the multipole method depend on the kernel and the accuracy alone and can take seconds to make; plans
 * of one fit share those of the plans that are alive. */
#include "spline/inner.h"

#include "base/checked.h"
#include "basis/green.h"

#include <batten/fmm.h>

/* What fast sums can be asked for. */
static const double ACCURACY_FINEST = 1e-12, ACCURACY_COARSEST = 1e-3;

/* They promise their values. Derivatives of what is interpolated on cells are worse: asked for 1e-7 and a thirtieth
 * of it, rows and columns with gradients had 1.1e-6 and 1.6e-7 in the plane, where digits are cheap; in space they
 * had what was asked for. */
static const double DERIVATIVE_MARGIN_PLANE = 300, DERIVATIVE_MARGIN_SPACE = 1.5;

/* One side of a product. */
typedef struct role {
  size_t count;    /* unknowns */
  size_t *slot;    /* [count] */
  size_t points;   /* distinct */
  double *numbers; /* [points], with gradients [(1 + n) points] */
  bool gradients;
} role;

/* A term of the diagonal: y[row] += rho x[col]. */
typedef struct nugget {
  size_t row, col;
  double rho;
} nugget;

typedef struct spline_plan {
  batten_context *ctx;
  spline_sums *owner;
  struct spline_plan *next; /* of those alive */
  double sign;              /* of the kernel */
  double accuracy;
  role rows, cols;
  nugget *nuggets;
  size_t nugget_count;
  batten_fmm *fmm;
} plan;

/* ---- unknowns and points ---- */

/* Point of an unknown, and the axis of its derivative; -1 for a value. */
static size_t point_of(const spline_system *s, size_t unknown, int *axis) {
  *axis = -1;
  if (unknown < s->count) return unknown;
  const size_t q = (unknown - s->count) % s->gradient_count;
  *axis = (int)((unknown - s->count) / s->gradient_count);
  return s->gradient_at ? s->gradient_at[q] : q;
}

static double smoothing_at(const spline_system *s, size_t unknown) {
  return s->smoothing_per_point ? s->smoothing_per_point[unknown] : s->smoothing;
}

/* The points of some unknowns (list NULL: of all), numbered as they come in the data, and the slots of the unknowns.
 * *x [points][n] is the caller's to free. */
static batten_status make_role(batten_context *ctx, const spline_system *s, size_t count, const size_t *list, role *r,
                               double **x) {
  int axis;
  batten_status st = BATTEN_E_NOMEM;
  size_t *number = batten_alloc_array(ctx, s->count, sizeof *number);
  r->count = count;
  r->slot = batten_alloc_array(ctx, count, sizeof *r->slot);
  if (!number || !r->slot) goto done;
  for (size_t i = 0; i < s->count; i++) number[i] = SIZE_MAX;
  for (size_t i = 0; i < count; i++) {
    number[point_of(s, list ? list[i] : i, &axis)] = 0;
    r->gradients = r->gradients || axis >= 0;
  }
  for (size_t i = 0; i < s->count; i++)
    if (number[i] == 0) number[i] = r->points++;
  *x = batten_alloc_array(ctx, r->points, s->n * sizeof **x);
  r->numbers = batten_alloc_array(ctx, r->points, (r->gradients ? 1 + s->n : 1) * sizeof *r->numbers);
  if (!*x || !r->numbers) goto done;
  for (size_t i = 0; i < s->count; i++)
    for (unsigned a = 0; a < s->n && number[i] != SIZE_MAX; a++) (*x)[number[i] * s->n + a] = s->y[a][i];
  for (size_t i = 0; i < count; i++) {
    const size_t at = number[point_of(s, list ? list[i] : i, &axis)];
    r->slot[i] = axis < 0 ? at : r->points + at * s->n + (size_t)axis;
  }
  st = BATTEN_OK;
done:
  batten_free(ctx, number);
  return st;
}

/* Unknowns that are rows and columns meet on the diagonal, where the smoothing is. */
static batten_status make_nuggets(batten_context *ctx, const spline_system *s, const size_t *rows, const size_t *cols,
                                  plan *p) {
  if (!s->smoothing_per_point && s->smoothing == 0) return BATTEN_OK;
  const size_t most = p->rows.count < p->cols.count ? p->rows.count : p->cols.count;
  p->nuggets = batten_alloc_array(ctx, most, sizeof *p->nuggets);
  if (!p->nuggets) return BATTEN_E_NOMEM;
  for (size_t i = 0, j = 0; i < p->rows.count && j < p->cols.count;) {
    const size_t row = rows ? rows[i] : i, col = cols ? cols[j] : j;
    if (row >= s->count) break;
    if (row == col) p->nuggets[p->nugget_count++] = (nugget){i, j, smoothing_at(s, row)};
    i += row <= col;
    j += col <= row;
  }
  return BATTEN_OK;
}

/* ---- plans ---- */

/* What to ask of the sums for rows or columns with derivatives, or without. */
static double accuracy_of_sums(unsigned n, double accuracy, bool gradients) {
  if (gradients) accuracy /= n == 2 ? DERIVATIVE_MARGIN_PLANE : DERIVATIVE_MARGIN_SPACE;
  return fmin(fmax(accuracy, ACCURACY_FINEST), ACCURACY_COARSEST);
}

static batten_radial kernel_of(const spline_system *s) {
  return (batten_radial){.n = s->n, .power = (int)s->power, .logarithm = s->power % 2 == 0};
}

/* A plan whose operators serve another of the same kind; NULL when there is none. */
static const batten_fmm *find_operators(const plan *p) {
  for (const plan *q = p->owner->plans; q; q = q->next)
    if (q->accuracy == p->accuracy && q->rows.gradients == p->rows.gradients &&
        q->cols.gradients == p->cols.gradients && !batten_fmm_get_info(q->fmm).direct)
      return q->fmm;
  return NULL;
}

static void release(void *user) {
  plan *p = user;
  if (!p) return;
  for (plan **q = &p->owner->plans; *q; q = &(*q)->next)
    if (*q == p) {
      *q = p->next;
      break;
    }
  batten_fmm_free(p->fmm);
  batten_free(p->ctx, p->nuggets);
  batten_free(p->ctx, p->rows.slot);
  batten_free(p->ctx, p->rows.numbers);
  batten_free(p->ctx, p->cols.slot);
  batten_free(p->ctx, p->cols.numbers);
  batten_free(p->ctx, p);
}

static batten_status make_plan(const void *user, batten_context *ctx, double accuracy, size_t row_count,
                               const size_t *rows, size_t col_count, const size_t *cols, void **out) {
  const spline_system *s = user;
  const batten_radial kernel = kernel_of(s);
  double *sources = NULL, *targets = NULL;
  batten_status st = BATTEN_E_NOMEM;
  plan *p = batten_alloc(ctx, sizeof *p);
  if (!p) goto done;
  *p = (plan){.ctx = ctx, .owner = s->sums, .sign = batten_green_sign(s->power)};
  if ((st = make_role(ctx, s, row_count, rows, &p->rows, &targets)) < 0) goto done;
  if ((st = make_role(ctx, s, col_count, cols, &p->cols, &sources)) < 0) goto done;
  if ((st = make_nuggets(ctx, s, rows, cols, p)) < 0) goto done;
  p->accuracy = accuracy_of_sums(s->n, accuracy, p->rows.gradients || p->cols.gradients);
  batten_fmm_options o = batten_fmm_options_default();
  o.accuracy = p->accuracy;
  o.gradients = p->rows.gradients;
  o.dipoles = p->cols.gradients;
  o.share = find_operators(p);
  const bool same = !rows && !cols; /* one tree does */
  st = batten_fmm_create(ctx, &kernel, p->cols.points, sources, p->rows.points, same ? NULL : targets, &o, &p->fmm);
  if (st < 0) goto done;
  p->next = s->sums->plans;
  s->sums->plans = p;
  *out = p;
  p = NULL;
done:
  batten_free(ctx, sources);
  batten_free(ctx, targets);
  release(p);
  return st;
}

static batten_status apply(void *user, batten_context *ctx, const double *x, double *y) {
  plan *p = user;
  role *rows = &p->rows, *cols = &p->cols;
  const size_t n = p->owner->calls.dimension;
  for (size_t i = 0; i < cols->points * (cols->gradients ? 1 + n : 1); i++) cols->numbers[i] = 0;
  for (size_t j = 0; j < cols->count; j++) cols->numbers[cols->slot[j]] = p->sign * x[j];
  batten_status st =
      batten_fmm_apply(ctx, p->fmm, cols->numbers, cols->gradients ? cols->numbers + cols->points : NULL,
                       rows->numbers, rows->gradients ? rows->numbers + rows->points : NULL);
  if (st < 0) return st;
  for (size_t i = 0; i < rows->count; i++) y[i] = rows->numbers[rows->slot[i]];
  for (size_t q = 0; q < p->nugget_count; q++) y[p->nuggets[q].row] += p->nuggets[q].rho * x[p->nuggets[q].col];
  return BATTEN_OK;
}

/* Beside the sums themselves: slots, numbers, nuggets, and points for a time. */
static size_t plan_bytes(const void *user, double accuracy, size_t row_count, size_t col_count) {
  const spline_system *s = user;
  const batten_radial kernel = kernel_of(s);
  batten_fmm_options o = batten_fmm_options_default();
  o.accuracy = accuracy_of_sums(s->n, accuracy, s->gradient_count > 0);
  o.gradients = o.dipoles = s->gradient_count > 0;
  size_t unknowns, own, total;
  batten_add(row_count, col_count, &unknowns);
  batten_mul(unknowns, sizeof(size_t) + (2 * s->n + 1) * sizeof(double) + sizeof(nugget), &own);
  const size_t sources = col_count < s->count ? col_count : s->count;
  const size_t targets = row_count < s->count ? row_count : s->count;
  batten_add(own, batten_fmm_bytes(&kernel, sources, targets, &o), &total);
  return total;
}

/* ---- entries ---- */

enum { BLOCK = 64 }; /* unknowns gathered at a time: their coordinates fit a small array */

/* Unknowns of one kind of functional, with their coordinates side by side. */
typedef struct gathered {
  int axis;
  size_t count;
  double x[3][BLOCK];
} gathered;

static void gather(const spline_system *s, size_t count, const size_t *list, gathered *g) {
  int axis;
  point_of(s, list[0], &g->axis);
  for (g->count = 0; g->count < count && g->count < BLOCK; g->count++) {
    const size_t at = point_of(s, list[g->count], &axis);
    if (axis != g->axis) return;
    for (unsigned a = 0; a < s->n; a++) g->x[a][g->count] = s->y[a][at];
  }
}

/* As batten_spline_system_fill adds it: also where it is 0, for the sign of a zero. */
static void add_smoothing(const spline_system *s, size_t rows, const size_t *row, size_t cols, const size_t *col,
                          double *tile, size_t ld) {
  for (size_t j = 0; j < cols && col[j] < s->count; j++)
    for (size_t i = 0; i < rows; i++)
      if (row[i] == col[j]) tile[i + j * ld] += smoothing_at(s, col[j]);
}

static void entries(const void *user, size_t rows, const size_t *row, size_t cols, const size_t *col, double *tile,
                    size_t ld) {
  const spline_system *s = user;
  gathered r, c;
  for (size_t j = 0; j < cols; j += c.count) {
    gather(s, cols - j, col + j, &c);
    for (size_t i = 0; i < rows; i += r.count) {
      gather(s, rows - i, row + i, &r);
      spline_tile t = {.n = s->n,
                       .power = s->power,
                       .row_axis = r.axis,
                       .col_axis = c.axis,
                       .rows = r.count,
                       .cols = c.count,
                       .row_x = {r.x[0], r.x[1], r.x[2]},
                       .col_x = {c.x[0], c.x[1], c.x[2]},
                       .tile = tile + i + j * ld,
                       .ld = ld};
      s->code->tile(&t);
      if (r.axis < 0 && c.axis < 0) add_smoothing(s, r.count, row + i, c.count, col + j, t.tile, ld);
    }
  }
}

/* ---- for the fit ---- */

bool batten_spline_sums_exist(unsigned n) { return n == 2 || n == 3; }

size_t batten_spline_sums_bytes(unsigned n, unsigned m, size_t points, size_t gradients, double accuracy) {
  const spline_system s = {.n = n, .power = batten_green_power(n, m), .count = points, .gradient_count = gradients};
  size_t rows, sums, own, total;
  batten_mul(n, gradients, &rows);
  batten_add(rows, points, &rows);
  sums = plan_bytes(&s, accuracy, rows, rows);
  batten_mul3(rows, n, sizeof(double), &own);
  batten_add(sums, own, &total);
  return total;
}

batten_status batten_spline_sums_make(batten_context *ctx, spline_system *s) {
  int axis;
  s->sums = batten_alloc(ctx, sizeof *s->sums);
  if (!s->sums) return BATTEN_E_NOMEM;
  *s->sums = (spline_sums){.calls = {.dimension = s->n,
                                     .plan = make_plan,
                                     .apply = apply,
                                     .release = release,
                                     .entries = entries,
                                     .bytes = plan_bytes}};
  double *points = batten_alloc_array(ctx, s->rows, s->n * sizeof *points);
  s->sums->points = points;
  if (!points) return BATTEN_E_NOMEM;
  for (size_t r = 0; r < s->rows; r++) {
    const size_t at = point_of(s, r, &axis);
    for (unsigned a = 0; a < s->n; a++) points[r * s->n + a] = s->y[a][at];
  }
  s->sums->calls.points = points;
  return BATTEN_OK;
}

void batten_spline_sums_free(batten_context *ctx, spline_system *s) {
  if (!s->sums) return;
  batten_free(ctx, s->sums->points);
  batten_free(ctx, s->sums);
  s->sums = NULL;
}
