/* Quadratic programs as QPS with free columns, as few lines as the rules of the format allow: see docs/files.md.
 *
 * The objective is row OBJ, its constant a right-hand side with the other sign; rows with two sides are of type G (or
 * L) with a range, free ones of type G with a right-hand side of -1e30. */
#include "qp_file.h"
#include "write.h"

#include "base/checked.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

typedef struct qps_writer {
  bx_writer *w;
  const batten_qp_file *file;
  size_t n, m;
  bx_names rows, columns; /* as they are written */
  bx_sparse c, h;         /* C column by column; H */
  size_t objective;       /* its place in rows */
} qps_writer;

static batten_status refuse(qps_writer *q, const char *format, const char *name, size_t index) {
  return batten_fail(q->w->ctx, BATTEN_E_INVALID, format, name, index);
}

/* ---- names ----------------------------------------------------------------------------------------- */

/* A copy that is one word; blanks and control characters become '_'. */
static batten_status add_word(bx_names *names, const char *name, const char *list, size_t index) {
  size_t length = strlen(name);
  char *word = batten_alloc(names->ctx, length + 1);
  if (!word) return BATTEN_E_NOMEM;
  for (size_t i = 0; i <= length; i++) word[i] = name[i];
  for (size_t i = 0; i < length; i++)
    if ((unsigned char)word[i] <= ' ' || word[i] == 0x7f) word[i] = '_';
  batten_status st = BATTEN_OK;
  if (length == 0)
    st = batten_fail(names->ctx, BATTEN_E_INVALID, "%s[%zu]: empty; QPS needs a name, or none of all", list, index);
  else if (bx_names_find(names, word, length) != SIZE_MAX)
    st = batten_fail(names->ctx, BATTEN_E_INVALID,
                     "%s[%zu]: '%.32s' is there twice (blanks are written as _); QPS tells them by name", list, index,
                     word);
  else
    st = bx_names_add(names, word, length);
  batten_free(names->ctx, word);
  return st;
}

static batten_status make_names(bx_names *names, char *const *given, size_t count, char letter, const char *list) {
  batten_status st = BATTEN_OK;
  for (size_t i = 0; st == BATTEN_OK && i < count; i++) {
    char text[32];
    snprintf(text, sizeof text, "%c%zu", letter, i + 1);
    st = given ? add_word(names, given[i], list, i) : bx_names_add(names, text, strlen(text));
  }
  return st;
}

/* OBJ, longer where a row is called so. */
static batten_status name_objective(qps_writer *q) {
  char text[64] = "OBJ";
  size_t length = strlen(text);
  for (; bx_names_find(&q->rows, text, length) != SIZE_MAX && length + 1 < sizeof text; length++) text[length] = '_';
  if (bx_names_find(&q->rows, text, length) != SIZE_MAX)
    return refuse(q, "row_names: %s and %zu longer ones are taken; rename one", "OBJ", length - 3);
  q->objective = q->rows.count;
  return bx_names_add(&q->rows, text, length);
}

/* ---- sections -------------------------------------------------------------------------------------- */

/* " head name value" */
static void put_pair(bx_writer *w, const char *head, const char *name, double value) {
  bx_put_text(w, " ");
  bx_put_text(w, head);
  bx_put_text(w, " ");
  bx_put_text(w, name);
  bx_put_text(w, " ");
  bx_put_number(w, value);
  bx_put_text(w, "\n");
}

static double side(const double *values, size_t i, double none) { return values ? values[i] : none; }

typedef struct qps_side {
  char type;
  double rhs, range;
  bool has_range;
} qps_side;

/* Is there a range with which the one side gives the other to the last bit? Its rounding is of no more than some
 * units in the last place, so neighbours are tried. */
static bool find_range(double lower, double upper, bool from_lower, double *range) {
  enum { NEIGHBOURS = 4 };
  double first = upper - lower, up = first, down = first;
  for (int i = 0; i < NEIGHBOURS; i++, up = nextafter(up, INFINITY), down = nextafter(down, 0)) {
    double tried[2] = {up, down};
    for (int k = 0; k < 2; k++) {
      double back = from_lower ? lower + tried[k] : upper - tried[k], wanted = from_lower ? upper : lower;
      if (back < wanted || back > wanted) continue;
      *range = tried[k];
      return true;
    }
  }
  *range = first;
  return false;
}

static qps_side side_of_row(double lower, double upper) {
  qps_side s = {.type = 'E', .rhs = lower};
  if (isinf(lower) && isinf(upper)) return (qps_side){.type = 'G', .rhs = -1e30};
  if (isinf(upper)) return (qps_side){.type = 'G', .rhs = lower};
  if (isinf(lower)) return (qps_side){.type = 'L', .rhs = upper};
  if (!(lower < upper)) return s;
  s = (qps_side){.type = 'G', .rhs = lower, .has_range = true};
  if (find_range(lower, upper, true, &s.range)) return s;
  qps_side other = {.type = 'L', .rhs = upper, .has_range = true};
  return find_range(lower, upper, false, &other.range) ? other : s;
}

static qps_side row_side(const qps_writer *q, size_t i) {
  const batten_qp_problem *p = &q->file->problem;
  return side_of_row(side(p->lower, i, -INFINITY), side(p->upper, i, INFINITY));
}

static void put_rows(qps_writer *q) {
  bx_print(q->w, "ROWS\n N ");
  bx_put_text(q->w, bx_names_get(&q->rows, q->objective));
  for (size_t i = 0; i < q->m; i++) {
    bx_print(q->w, "\n %c ", row_side(q, i).type);
    bx_put_text(q->w, bx_names_get(&q->rows, i));
  }
  bx_put_text(q->w, "\n");
}

/* A column without entries has a 0 in the objective, so that it is there. */
static void put_columns(qps_writer *q) {
  const double *g = q->file->problem.g;
  bx_put_text(q->w, "COLUMNS\n");
  for (size_t j = 0; j < q->n; j++) {
    const char *name = bx_names_get(&q->columns, j);
    size_t from = q->m ? q->c.starts[j] : 0, to = q->m ? q->c.starts[j + 1] : 0;
    double value = side(g, j, 0);
    if (from == to || value < 0 || value > 0 || signbit(value))
      put_pair(q->w, name, bx_names_get(&q->rows, q->objective), value);
    for (size_t e = from; e < to; e++) put_pair(q->w, name, bx_names_get(&q->rows, q->c.indices[e]), q->c.values[e]);
  }
}

static void put_right_sides(qps_writer *q) {
  double constant = q->file->problem.constant;
  bx_put_text(q->w, "RHS\n");
  if (constant < 0 || constant > 0) put_pair(q->w, "RHS", bx_names_get(&q->rows, q->objective), -constant);
  for (size_t i = 0; i < q->m; i++) {
    double value = row_side(q, i).rhs;
    if (value < 0 || value > 0 || signbit(value)) put_pair(q->w, "RHS", bx_names_get(&q->rows, i), value);
  }
}

static void put_ranges(qps_writer *q) {
  bool any = false;
  for (size_t i = 0; i < q->m; i++) {
    qps_side s = row_side(q, i);
    if (!s.has_range) continue;
    if (!any) bx_put_text(q->w, "RANGES\n");
    any = true;
    put_pair(q->w, "RANGE", bx_names_get(&q->rows, i), s.range);
  }
}

static void put_bound(qps_writer *q, const char *type, size_t j, const double *value) {
  bx_print(q->w, " %s BOUND ", type);
  bx_put_text(q->w, bx_names_get(&q->columns, j));
  if (value) {
    bx_put_text(q->w, " ");
    bx_put_number(q->w, *value);
  }
  bx_put_text(q->w, "\n");
}

/* The default is 0 <= x. A lower bound comes before an upper one, which might take it away. */
static void put_bounds(qps_writer *q) {
  const batten_qp_problem *p = &q->file->problem;
  bx_put_text(q->w, "BOUNDS\n");
  for (size_t j = 0; j < q->n; j++) {
    double lower = side(p->x_lower, j, -INFINITY), upper = side(p->x_upper, j, INFINITY);
    bool fixed = !(lower < upper) && !(lower > upper) && signbit(lower) == signbit(upper);
    bool standard = !(lower < 0) && !(lower > 0) && !signbit(lower);
    if (isinf(lower) && isinf(upper)) {
      put_bound(q, "FR", j, NULL);
    } else if (fixed) {
      put_bound(q, "FX", j, &lower);
    } else {
      if (isinf(lower)) put_bound(q, "MI", j, NULL);
      if (!isinf(lower) && (!standard || upper < 0)) put_bound(q, "LO", j, &lower);
      if (!isinf(upper)) put_bound(q, "UP", j, &upper);
    }
  }
}

static void put_hessian(qps_writer *q) {
  if (!q->file->problem.h) return;
  bx_put_text(q->w, "QUADOBJ\n");
  for (size_t j = 0; j < q->n; j++)
    for (size_t e = q->h.starts[j]; e < q->h.starts[j + 1]; e++)
      if (q->h.indices[e] >= j)
        put_pair(q->w, bx_names_get(&q->columns, j), bx_names_get(&q->columns, q->h.indices[e]), q->h.values[e]);
}

/* ---- the whole ------------------------------------------------------------------------------------- */

static batten_status check_bounds(qps_writer *q, const char *name, const double *values, size_t count) {
  for (size_t i = 0; values && i < count; i++)
    if (isfinite(values[i]) && fabs(values[i]) >= BX_QP_INFINITE)
      return refuse(q, "%s[%zu]: so large that QPS takes it for none; make it infinite", name, i);
  return BATTEN_OK;
}

static batten_status prepare(qps_writer *q) {
  const batten_qp_problem *p = &q->file->problem;
  bx_sparse other = {0};
  size_t i, j;
  if (p->a && p->a->rows)
    return batten_fail(q->w->ctx, BATTEN_E_INVALID,
                       "problem.a: QPS has no least squares; write .json, or give the Hessian as problem.h");
  batten_status st = check_bounds(q, "problem.lower", p->lower, q->m);
  if (st == BATTEN_OK) st = check_bounds(q, "problem.upper", p->upper, q->m);
  if (st == BATTEN_OK) st = check_bounds(q, "problem.x_lower", p->x_lower, q->n);
  if (st == BATTEN_OK) st = check_bounds(q, "problem.x_upper", p->x_upper, q->n);
  if (st == BATTEN_OK) st = make_names(&q->columns, q->file->unknown_names, q->n, 'x', "unknown_names");
  if (st == BATTEN_OK) st = make_names(&q->rows, q->file->row_names, q->m, 'r', "row_names");
  if (st == BATTEN_OK) st = name_objective(q);
  if (st == BATTEN_OK && q->m) st = bx_sparse_of(q->w->ctx, p->c, &other);
  if (st == BATTEN_OK && q->m) st = bx_sparse_transpose(q->w->ctx, &other, &q->c);
  bx_sparse_free(q->w->ctx, &other);
  if (st != BATTEN_OK || !p->h) return st;
  st = bx_sparse_of(q->w->ctx, p->h, &q->h);
  if (st == BATTEN_OK) st = bx_sparse_transpose(q->w->ctx, &q->h, &other);
  if (st == BATTEN_OK && bx_sparse_differs(&q->h, &other, &i, &j))
    st = batten_fail(q->w->ctx, BATTEN_E_INVALID, "problem.h: (%zu, %zu) differs from (%zu, %zu); H is symmetric", i,
                     j, j, i);
  bx_sparse_free(q->w->ctx, &other);
  return st;
}

void bx_write_qps(bx_writer *w, const batten_qp_file *file) {
  const batten_qp_problem *p = &file->problem;
  qps_writer q = {.w = w, .file = file, .n = p->n, .m = p->c ? p->c->rows : 0};
  q.rows.ctx = q.columns.ctx = w->ctx;
  batten_status st = prepare(&q);
  if (st == BATTEN_OK) {
    bx_put_text(w, file->name && *file->name ? "NAME " : "NAME");
    for (const char *c = file->name ? file->name : ""; *c; c++)
      bx_put_u8(w, (unsigned char)*c < ' ' ? '_' : (uint8_t)*c);
    bx_put_text(w, "\n");
    put_rows(&q);
    put_columns(&q);
    put_right_sides(&q);
    put_ranges(&q);
    put_bounds(&q);
    put_hessian(&q);
    bx_put_text(w, "ENDATA\n");
  } else {
    bx_writer_fail(w, st);
  }
  bx_names_free(&q.rows);
  bx_names_free(&q.columns);
  bx_sparse_free(w->ctx, &q.c);
  bx_sparse_free(w->ctx, &q.h);
}
