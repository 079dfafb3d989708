/* What a caller can get wrong in a quadratic program, each with the argument, its index and value, and what to do.
 *
 * Sizes are looked at before anything is read, numbers before anything is computed. The structure of sparse matrices
 * needs memory of its own and comes last, when the sizes are known to be sane. */
#include <float.h>
#include <string.h>

#include "base/checked.h"
#include "driver.h"
#include "la/la.h"
#include "matrix_row.h"

/* ---- Sizes and pointers ---- */

static batten_status check_pointers(batten_context *ctx, const char *name, const batten_matrix *m, size_t columns) {
  size_t bytes;
  if (m->columns != columns)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s.columns: %zu, but there are n = %zu unknowns", name, m->columns,
                       columns);
  if (m->rows == 0 || columns == 0) return BATTEN_OK;
  if (m->dense) {
    if (m->starts || m->indices || m->values)
      return batten_fail(ctx, BATTEN_E_INVALID, "%s: both dense and sparse arrays; give one of the two", name);
    if (batten_mul3(m->rows, columns, sizeof(double), &bytes)) return BATTEN_OK;
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%s: %zu rows of %zu dense entries exceed memory; give it sparse",
                       name, m->rows, columns);
  }
  if (!m->starts)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: neither dense nor starts; give one of the two", name);
  return BATTEN_OK;
}

static batten_status check_sizes(batten_context *ctx, const batten_qp_problem *p) {
  size_t m = qp_problem_rows(p), k = p->a ? p->a->rows : 0, all;
  if (!batten_add(p->n, m, &all) || !batten_add(all, k, &all) || !batten_la_fits(all) || all >= UINT32_MAX)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE,
                       "n, c.rows, a.rows: %zu, %zu, %zu together exceed the range of BLAS's integers", p->n, m, k);
  batten_status st = BATTEN_OK;
  if (p->a) st = check_pointers(ctx, "problem.a", p->a, p->n);
  if (st == BATTEN_OK && p->h) {
    if (p->h->rows != p->n)
      return batten_fail(ctx, BATTEN_E_INVALID, "problem.h.rows: %zu, but there are n = %zu unknowns", p->h->rows,
                         p->n);
    st = check_pointers(ctx, "problem.h", p->h, p->n);
  }
  if (st == BATTEN_OK && p->c) st = check_pointers(ctx, "problem.c", p->c, p->n);
  if (st < 0) return st;
  const struct {
    const char *name, *matrix;
    const void *vector, *needs;
  } pairs[] = {{"b", "a", p->b, p->a},
               {"weights", "a", p->weights, p->a},
               {"lower", "c", p->lower, p->c},
               {"upper", "c", p->upper, p->c}};
  for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++)
    if (pairs[i].vector && !pairs[i].needs)
      return batten_fail(ctx, BATTEN_E_INVALID, "problem.%s: given without problem.%s; give both or none",
                         pairs[i].name, pairs[i].matrix);
  return BATTEN_OK;
}

/* ---- Numbers ---- */

/* As batten_first_nonfinite(), but at the speed of memory: 0 v is not 0 where v is not finite. */
static size_t first_nonfinite(size_t count, const double *v) {
  enum { CHUNK = 4096, LANES = 4 };
  size_t i = 0;
  for (; i + CHUNK <= count; i += CHUNK) {
    double sum[LANES] = {0};
    for (size_t e = i; e < i + CHUNK; e += LANES)
      for (size_t l = 0; l < LANES; l++) sum[l] += 0 * v[e + l];
    if (!(sum[0] + sum[1] + sum[2] + sum[3] == 0)) break;
  }
  return i + batten_first_nonfinite(count - i, v + i);
}

static batten_status check_finite(batten_context *ctx, const char *name, size_t count, const double *v) {
  size_t bad = v ? first_nonfinite(count, v) : count;
  if (bad == count) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "%s[%zu]: %g is not finite; give a number", name, bad, v[bad]);
}

static batten_status check_sides(batten_context *ctx, const char *name_lower, const char *name_upper, size_t count,
                                 const double *lower, const double *upper) {
  for (size_t i = 0; i < count; i++) {
    double from = lower ? lower[i] : -INFINITY, to = upper ? upper[i] : INFINITY;
    if (!(from < INFINITY))
      return batten_fail(ctx, BATTEN_E_INVALID, "%s[%zu]: %g; give a number, or -INFINITY for none", name_lower, i,
                         from);
    if (!(to > -INFINITY))
      return batten_fail(ctx, BATTEN_E_INVALID, "%s[%zu]: %g; give a number, or INFINITY for none", name_upper, i,
                         to);
    if (from > to)
      return batten_fail(ctx, BATTEN_E_INVALID, "%s[%zu]: %.17g exceeds %s[%zu]: %.17g; exchange or relax them",
                         name_lower, i, from, name_upper, i, to);
  }
  return BATTEN_OK;
}

static batten_status check_csr(batten_context *ctx, const char *name, const batten_matrix *m) {
  if (m->starts[0] != 0)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s.starts[0]: %zu; must be 0", name, m->starts[0]);
  for (size_t i = 0; i < m->rows; i++) {
    if (m->starts[i + 1] < m->starts[i])
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "%s.starts[%zu]: %zu is less than the one before, %zu; give the sums "
                         "of the rows' lengths",
                         name, i + 1, m->starts[i + 1], m->starts[i]);
    if (m->starts[i + 1] - m->starts[i] > m->columns)
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "%s.starts[%zu]: row %zu has %zu entries in %zu columns; give each "
                         "column once",
                         name, i + 1, i, m->starts[i + 1] - m->starts[i], m->columns);
  }
  size_t entries = m->starts[m->rows];
  if (entries == 0) return BATTEN_OK;
  if (!m->indices || !m->values)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s.%s: NULL with %zu entries", name, m->indices ? "values" : "indices",
                       entries);
  for (size_t e = 0; e < entries; e++)
    if (m->indices[e] >= m->columns)
      return batten_fail(ctx, BATTEN_E_INVALID, "%s.indices[%zu]: %lu, but the columns are 0 to %zu", name, e,
                         (unsigned long)m->indices[e], m->columns - 1);
  size_t bad = first_nonfinite(entries, m->values);
  if (bad == entries) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "%s.values[%zu]: %g is not finite; give a number", name, bad,
                     m->values[bad]);
}

static batten_status check_matrix(batten_context *ctx, const char *name, const batten_matrix *m) {
  if (!m || m->rows == 0 || m->columns == 0) return BATTEN_OK;
  if (!m->dense) return check_csr(ctx, name, m);
  size_t bad = first_nonfinite(m->rows * m->columns, m->dense);
  if (bad == m->rows * m->columns) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "%s[%zu][%zu]: %g is not finite; give a number", name, bad / m->columns,
                     bad % m->columns, m->dense[bad]);
}

static batten_status check_problem(batten_context *ctx, const batten_qp_problem *p) {
  size_t m = qp_problem_rows(p), k = p->a ? p->a->rows : 0;
  batten_status st = check_sizes(ctx, p);
  if (st == BATTEN_OK) st = check_matrix(ctx, "problem.a", p->a);
  if (st == BATTEN_OK) st = check_finite(ctx, "problem.b", k, p->b);
  for (size_t i = 0; st == BATTEN_OK && p->weights && i < k; i++)
    if (!(p->weights[i] >= 0 && p->weights[i] <= DBL_MAX))
      st = batten_fail(ctx, BATTEN_E_INVALID, "problem.weights[%zu]: %g; must be finite and not negative", i,
                       p->weights[i]);
  if (st == BATTEN_OK) st = check_matrix(ctx, "problem.h", p->h);
  if (st == BATTEN_OK) st = check_finite(ctx, "problem.g", p->n, p->g);
  if (st == BATTEN_OK && !isfinite(p->constant))
    st = batten_fail(ctx, BATTEN_E_INVALID, "problem.constant: %g is not finite; give a number", p->constant);
  if (st == BATTEN_OK) st = check_matrix(ctx, "problem.c", p->c);
  if (st == BATTEN_OK) st = check_sides(ctx, "problem.lower", "problem.upper", m, p->lower, p->upper);
  if (st == BATTEN_OK) st = check_sides(ctx, "problem.x_lower", "problem.x_upper", p->n, p->x_lower, p->x_upper);
  return st;
}

/* ---- Options ---- */

static batten_status check_tolerance(batten_context *ctx, const char *name, double value) {
  if (value >= 0 && value <= DBL_MAX) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s: %g; must be finite and not negative", name, value);
}

static batten_status check_flag(batten_context *ctx, const char *name, int value) {
  if (value == 0 || value == 1) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s: %d; use 0 or 1", name, value);
}

static batten_status check_options(batten_context *ctx, const batten_qp_problem *p, const batten_qp_options *o) {
  if ((int)o->engine < BATTEN_QP_AUTO || (int)o->engine > BATTEN_QP_INTERIOR)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.engine: %d; use one of batten_qp_engine", (int)o->engine);
  batten_status st = check_tolerance(ctx, "tolerance_absolute", o->tolerance_absolute);
  if (st == BATTEN_OK) st = check_tolerance(ctx, "tolerance_relative", o->tolerance_relative);
  if (st == BATTEN_OK && o->tolerance_absolute <= 0 && o->tolerance_relative <= 0)
    st = batten_fail(ctx, BATTEN_E_INVALID, "opt.tolerance_absolute, opt.tolerance_relative: both 0; give one > 0");
  if (st == BATTEN_OK && !(o->time_limit_s > 0))
    st = batten_fail(ctx, BATTEN_E_INVALID, "opt.time_limit_s: %g; give seconds > 0, or INFINITY for none",
                     o->time_limit_s);
  if (st == BATTEN_OK) st = check_flag(ctx, "hand_over", o->hand_over);
  if (st == BATTEN_OK) st = check_flag(ctx, "exact", o->exact);
  if (st == BATTEN_OK) st = check_finite(ctx, "opt.x0", p->n, o->x0);
  if (st == BATTEN_OK && o->exact) st = check_finite(ctx, "opt.interior", p->n, o->interior);
  for (size_t i = 0; st == BATTEN_OK && o->active && i < qp_problem_rows(p) + p->n; i++)
    if (o->active[i] < -1 || o->active[i] > 2)
      st = batten_fail(ctx, BATTEN_E_INVALID, "opt.active[%zu]: %d; use -1, 0, 1 or 2", i, (int)o->active[i]);
  return st;
}

batten_status qp_check(batten_context *ctx, const batten_qp_problem *problem, const batten_qp_options *o) {
  if (!problem) return batten_fail(ctx, BATTEN_E_INVALID, "problem: NULL");
  batten_status st = batten_check_struct(ctx, "batten_qp_problem", problem->struct_size, sizeof(batten_qp_problem));
  if (st == BATTEN_OK) st = batten_check_struct(ctx, "batten_qp_options", o->struct_size, sizeof *o);
  if (st == BATTEN_OK) st = check_problem(ctx, problem);
  return st == BATTEN_OK ? check_options(ctx, problem, o) : st;
}

/* ---- Structure ---- */

/* last [columns] scratch: the latest row, counted from 1, in which a column was met. */
static batten_status check_repeats(batten_context *ctx, const char *name, const batten_matrix *m, uint32_t *last) {
  if (!m || m->dense || m->rows == 0 || m->columns == 0) return BATTEN_OK;
  memset(last, 0, m->columns * sizeof *last);
  for (size_t i = 0; i < m->rows; i++)
    for (size_t e = m->starts[i]; e < m->starts[i + 1]; e++) {
      if (last[m->indices[e]] == i + 1)
        return batten_fail(ctx, BATTEN_E_INVALID, "%s.indices[%zu]: column %lu twice in row %zu; add its values up",
                           name, e, (unsigned long)m->indices[e], i);
      last[m->indices[e]] = (uint32_t)(i + 1);
    }
  return BATTEN_OK;
}

static batten_status asymmetric(batten_context *ctx, size_t i, size_t j, double here, double there) {
  return batten_fail(
      ctx, BATTEN_E_INVALID,
      "problem.h: row %zu has %.17g in column %zu, row %zu has %.17g in column %zu; give both triangles "
      "of a symmetric matrix",
      i, here, j, j, there, i);
}

/* 10 eps of the largest entry: what a product such as B'B in floating point is off by. */
static double asymmetry_allowed(size_t count, const double *values) {
  double most = 0;
  for (size_t e = 0; e < count; e++) most = fabs(values[e]) > most ? fabs(values[e]) : most;
  return 10 * DBL_EPSILON * most;
}

static batten_status check_symmetry_dense(batten_context *ctx, const batten_matrix *h) {
  const double *v = h->dense;
  size_t n = h->rows;
  double allowed = asymmetry_allowed(n * n, v);
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < i; j++)
      if (fabs(v[i * n + j] - v[j * n + i]) > allowed) return asymmetric(ctx, i, j, v[i * n + j], v[j * n + i]);
  return BATTEN_OK;
}

/* The transpose as compressed rows beside h, row by row: place [n] is where each row of the transpose is filled up
 * to, dense [n] a row of h. */
static batten_status check_symmetry_sparse(batten_context *ctx, const batten_matrix *h) {
  size_t n = h->rows, entries = h->starts[n];
  batten_status st = BATTEN_E_NOMEM;
  uint32_t *row = NULL;
  double *value = NULL, *dense = NULL, allowed = asymmetry_allowed(entries, h->values);
  size_t *place = batten_alloc_array(ctx, n + 1, sizeof *place);
  if (!place) goto done;
  row = batten_alloc_array(ctx, entries, sizeof *row);
  if (!row) goto done;
  value = batten_alloc_array(ctx, entries, sizeof *value);
  if (!value) goto done;
  dense = batten_alloc_array(ctx, n, sizeof *dense);
  if (!dense) goto done;
  memset(place, 0, (n + 1) * sizeof *place);
  memset(dense, 0, n * sizeof *dense);
  for (size_t e = 0; e < entries; e++) place[h->indices[e] + 1]++;
  for (size_t j = 0; j < n; j++) place[j + 1] += place[j];
  for (size_t i = 0; i < n; i++)
    for (size_t e = h->starts[i]; e < h->starts[i + 1]; e++) {
      size_t at = place[h->indices[e]]++;
      row[at] = (uint32_t)i;
      value[at] = h->values[e];
    }
  /* place[j] is now where row j of the transpose ends */
  st = BATTEN_OK;
  for (size_t i = 0; i < n && st == BATTEN_OK; i++) {
    size_t from = i > 0 ? place[i - 1] : 0;
    for (size_t e = h->starts[i]; e < h->starts[i + 1]; e++) dense[h->indices[e]] = h->values[e];
    for (size_t e = from; e < place[i] && st == BATTEN_OK; e++) {
      if (fabs(value[e] - dense[row[e]]) > allowed) st = asymmetric(ctx, i, row[e], dense[row[e]], value[e]);
      dense[row[e]] = 0;
    }
    for (size_t e = h->starts[i]; e < h->starts[i + 1] && st == BATTEN_OK; e++) {
      double left = dense[h->indices[e]]; /* has no partner in the transpose */
      if (fabs(left) > allowed) st = asymmetric(ctx, i, h->indices[e], left, 0);
      dense[h->indices[e]] = 0;
    }
  }
done:
  batten_free(ctx, dense);
  batten_free(ctx, value);
  batten_free(ctx, row);
  batten_free(ctx, place);
  return st;
}

batten_status qp_check_structure(batten_context *ctx, const batten_qp_problem *problem) {
  uint32_t *last = batten_alloc_array(ctx, problem->n, sizeof *last);
  if (!last) return BATTEN_E_NOMEM;
  batten_status st = check_repeats(ctx, "problem.a", problem->a, last);
  if (st == BATTEN_OK) st = check_repeats(ctx, "problem.h", problem->h, last);
  if (st == BATTEN_OK) st = check_repeats(ctx, "problem.c", problem->c, last);
  batten_free(ctx, last);
  if (st < 0 || !problem->h || problem->n == 0) return st;
  return problem->h->dense ? check_symmetry_dense(ctx, problem->h) : check_symmetry_sparse(ctx, problem->h);
}
