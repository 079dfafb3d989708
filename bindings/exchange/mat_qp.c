/* Quadratic programs in MATLAB's files, as the Maros-Meszaros problems are handed on: the variables P q r l u A of
 *   minimise 1/2 x'Px + q'x + r,   l <= A x <= u
 * Where the last n rows of A are the identity, they are the bounds of x. Their form is P, A sparse; full matrices are
 * read as well. */
#include "mat.h"
#include "qp_file.h"

#include <math.h>
#include <string.h>

enum { P, Q, R, L, U, A, N, M, VARIABLES };
static const char names[VARIABLES][2] = {"P", "q", "r", "l", "u", "A", "n", "m"};

typedef struct mat_qp {
  bx_reader *r;
  mat_reader mat;
  mat_matrix v[VARIABLES];
  bool there[VARIABLES];
  size_t n, m; /* m: rows of A */
} mat_qp;

static int number_of(const char *name) {
  int i = 0;
  while (i < VARIABLES && strcmp(names[i], name)) i++;
  return i;
}

static bool wanted(const char *name) { return number_of(name) < VARIABLES; }

static batten_status fail(const mat_qp *q, const char *what) {
  return batten_fail(q->r->ctx, BATTEN_E_FORMAT, "%s: %s", bx_short_path(q->r->path), what);
}

static batten_status read_variables(mat_qp *q) {
  bool end = false;
  batten_status st = BATTEN_OK;
  while (st == BATTEN_OK) {
    mat_matrix matrix;
    st = mat_next(&q->mat, wanted, &matrix, &end);
    if (st != BATTEN_OK || end) break;
    int i = number_of(q->mat.name);
    if (q->there[i]) {
      mat_free(q->r->ctx, &matrix);
      st = mat_fail(&q->mat, "is there twice");
    } else {
      q->there[i] = true;
      q->v[i] = matrix;
    }
  }
  return st;
}

/* ---- checks ---------------------------------------------------------------------------------------- */

static batten_status check_numbers(const mat_qp *q, int i) {
  const mat_matrix *a = &q->v[i];
  bool side = i == L || i == U;
  for (size_t e = 0; e < a->count; e++)
    if (isnan(a->values[e]) || (isinf(a->values[e]) && !side))
      return batten_fail(q->r->ctx, BATTEN_E_FORMAT, "%s: variable '%s': number %zu is %g", bx_short_path(q->r->path),
                         names[i], e, a->values[e]);
  return BATTEN_OK;
}

/* A vector of that length, lying or standing, not sparse. */
static batten_status check_vector(const mat_qp *q, int i, size_t length) {
  const mat_matrix *a = &q->v[i];
  if (!q->there[i] || (!a->sparse && a->count == length && (a->rows == length || a->columns == length)))
    return BATTEN_OK;
  return batten_fail(q->r->ctx, BATTEN_E_FORMAT, "%s: variable '%s' is %s%zu x %zu, expected %zu x 1",
                     bx_short_path(q->r->path), names[i], a->sparse ? "sparse " : "", a->rows, a->columns, length);
}

static batten_status check_matrix(const mat_qp *q, int i, size_t rows) {
  const mat_matrix *a = &q->v[i];
  if (!q->there[i] || (a->rows == rows && a->columns == q->n)) return BATTEN_OK;
  return batten_fail(q->r->ctx, BATTEN_E_FORMAT, "%s: variable '%s' is %zu x %zu, expected %zu x %zu",
                     bx_short_path(q->r->path), names[i], a->rows, a->columns, rows, q->n);
}

/* The scalars n and m, where they are, say what the arrays say. */
static batten_status check_scalar(const mat_qp *q, int i, double expected) {
  batten_status st = check_vector(q, i, 1);
  if (st != BATTEN_OK || !q->there[i]) return st;
  double value = q->v[i].values[0];
  if (value >= expected && value <= expected) return BATTEN_OK;
  return batten_fail(q->r->ctx, BATTEN_E_FORMAT, "%s: variable '%s' is %g, but the arrays say %g",
                     bx_short_path(q->r->path), names[i], value, expected);
}

static batten_status check(mat_qp *q) {
  if (!q->there[P] && !q->there[Q])
    return fail(q, "no variables P and q; a quadratic program has P q r l u A: 1/2 x'Px + q'x + r, l <= Ax <= u");
  q->n = q->there[P] ? q->v[P].columns : q->v[Q].count;
  q->m = q->there[A] ? q->v[A].rows : 0;
  if (q->m && !q->there[L] && !q->there[U]) return fail(q, "A without l and u; give at least one");
  batten_status st = check_matrix(q, P, q->n);
  if (st == BATTEN_OK) st = check_vector(q, Q, q->n);
  if (st == BATTEN_OK) st = check_vector(q, R, 1);
  if (st == BATTEN_OK) st = check_vector(q, L, q->m);
  if (st == BATTEN_OK) st = check_vector(q, U, q->m);
  if (st == BATTEN_OK) st = check_matrix(q, A, q->m);
  if (st == BATTEN_OK) st = check_scalar(q, N, (double)q->n);
  if (st == BATTEN_OK) st = check_scalar(q, M, (double)q->m);
  for (int i = 0; st == BATTEN_OK && i < VARIABLES; i++) st = check_numbers(q, i);
  return st;
}

/* ---- the problem ----------------------------------------------------------------------------------- */

/* Entries that are not 0, as sparse rows. */
static batten_status sparse_rows(mat_qp *q, int i, bx_sparse *out) {
  mat_matrix *a = &q->v[i];
  bx_entries entries = {.ctx = q->r->ctx};
  batten_status st = BATTEN_OK;
  for (size_t j = 0; st == BATTEN_OK && j < a->columns; j++) {
    size_t from = a->sparse ? (size_t)a->starts[j] : j * a->rows;
    size_t to = a->sparse ? (size_t)a->starts[j + 1] : from + a->rows;
    for (size_t e = from; st == BATTEN_OK && e < to; e++) {
      size_t row = a->sparse ? (size_t)a->row_of[e] : e - from;
      if (a->values[e] < 0 || a->values[e] > 0)
        st = bx_entries_add(&entries, (bx_entry){.row = (uint32_t)row, .column = (uint32_t)j, .value = a->values[e]});
    }
  }
  mat_matrix read = *a;
  *a = (mat_matrix){.rows = read.rows, .columns = read.columns};
  mat_free(q->r->ctx, &read);
  if (st == BATTEN_OK) st = bx_sparse_from(q->r->ctx, a->rows, a->columns, entries.items, entries.count, out);
  batten_free(q->r->ctx, entries.items);
  size_t row, column;
  if (st == BATTEN_OK && bx_sparse_twice(out, &row, &column))
    return batten_fail(q->r->ctx, BATTEN_E_FORMAT, "%s: variable '%s' has two entries at (%zu, %zu), counted from 0",
                       bx_short_path(q->r->path), names[i], row, column);
  return st;
}

/* Do the last n rows form the identity? */
static bool ends_with_identity(const bx_sparse *a) {
  size_t n = a->columns;
  if (n == 0 || a->rows < n) return false;
  for (size_t j = 0; j < n; j++) {
    size_t row = a->rows - n + j, e = a->starts[row];
    if (a->starts[row + 1] - e != 1 || a->indices[e] != j || a->values[e] < 1 || a->values[e] > 1) return false;
  }
  return true;
}

/* Part of l or u, infinite where it is meant to be and where the variable is not there. */
static double *sides(const mat_qp *q, int i, size_t from, size_t count) {
  double none = i == L ? -INFINITY : INFINITY;
  double *side = bx_qp_fill(q->r->ctx, count, none);
  for (size_t k = 0; side && q->there[i] && k < count; k++) {
    double value = q->v[i].values[from + k];
    bool infinite = i == L ? value <= -BX_QP_INFINITE : value >= BX_QP_INFINITE;
    if (!infinite) side[k] = value;
  }
  return side;
}

static batten_status make(mat_qp *q, batten_qp_file *out) {
  batten_context *ctx = q->r->ctx;
  bx_qp_store *s = bx_qp_store_new(ctx);
  batten_status st = s ? BATTEN_OK : BATTEN_E_NOMEM;
  size_t rows = q->m;
  if (st == BATTEN_OK && q->there[P]) st = sparse_rows(q, P, &s->sparse[1]);
  if (st == BATTEN_OK && q->there[A]) st = sparse_rows(q, A, &s->sparse[2]);
  if (st == BATTEN_OK && q->there[A] && ends_with_identity(&s->sparse[2])) {
    rows -= q->n;
    s->sparse[2].rows = rows;
    s->x_lower = sides(q, L, rows, q->n);
    s->x_upper = sides(q, U, rows, q->n);
    if (!s->x_lower || !s->x_upper) st = BATTEN_E_NOMEM;
  }
  if (st == BATTEN_OK && rows) {
    s->lower = sides(q, L, 0, rows);
    s->upper = sides(q, U, 0, rows);
    if (!s->lower || !s->upper) st = BATTEN_E_NOMEM;
  }
  if (st == BATTEN_OK && q->there[Q]) {
    s->g = q->v[Q].values;
    q->v[Q].values = NULL;
  }
  if (st == BATTEN_OK) st = bx_qp_finish(ctx, s, q->n, q->there[R] ? q->v[R].values[0] : 0, out);
  if (st != BATTEN_OK) bx_qp_store_free(ctx, s);
  return st;
}

batten_status bx_read_mat(bx_reader *r, batten_qp_file *out) {
  mat_qp *q = batten_alloc(r->ctx, sizeof *q);
  if (!q) return BATTEN_E_NOMEM;
  *q = (mat_qp){.r = r};
  batten_status st = mat_begin(&q->mat, r);
  if (st == BATTEN_OK) {
    st = read_variables(q);
    mat_end(&q->mat);
  }
  if (st == BATTEN_OK) st = check(q);
  if (st == BATTEN_OK) st = make(q, out);
  for (int i = 0; i < VARIABLES; i++) mat_free(r->ctx, &q->v[i]);
  batten_free(r->ctx, q);
  return st;
}
