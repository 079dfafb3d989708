/* Quadratic programs and solutions into files: what the arguments are is checked here, for both formats. */
#include "qp_file.h"
#include "write.h"

#include "base/checked.h"

#include <math.h>
#include <string.h>

static batten_status check_matrix(batten_context *ctx, const char *name, const batten_matrix *m, size_t rows,
                                  size_t n) {
  if (!m) return BATTEN_OK;
  if (m->columns != n || (rows != SIZE_MAX && m->rows != rows) || m->rows > UINT32_MAX)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: %zu x %zu, expected %zu columns", name, m->rows, m->columns, n);
  if (m->rows == 0 || n == 0) return BATTEN_OK;
  size_t count = 0;
  if (m->dense) {
    if (!batten_mul(m->rows, n, &count))
      return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%s: %zu x %zu", name, m->rows, n);
  } else {
    if (!m->starts || m->starts[0] != 0)
      return batten_fail(ctx, BATTEN_E_INVALID, "%s: neither dense nor starts that begin with 0", name);
    for (size_t i = 0; i < m->rows; i++)
      if (m->starts[i] > m->starts[i + 1])
        return batten_fail(ctx, BATTEN_E_INVALID, "%s.starts[%zu]: %zu, less than the one before", name, i + 1,
                           m->starts[i + 1]);
    count = m->starts[m->rows];
    if (count && (!m->indices || !m->values))
      return batten_fail(ctx, BATTEN_E_INVALID, "%s: no indices or values", name);
    for (size_t e = 0; e < count; e++)
      if (m->indices[e] >= n)
        return batten_fail(ctx, BATTEN_E_INVALID, "%s.indices[%zu]: %lu of %zu columns", name, e,
                           (unsigned long)m->indices[e], n);
  }
  const double *values = m->dense ? m->dense : m->values;
  size_t bad = batten_first_nonfinite(count, values);
  if (bad == count) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "%s: value %zu is %g", name, bad, values[bad]);
}

static batten_status check_vector(batten_context *ctx, const char *name, const double *values, size_t count) {
  size_t bad = values ? batten_first_nonfinite(count, values) : count;
  return bad == count ? BATTEN_OK : batten_fail(ctx, BATTEN_E_INVALID, "%s[%zu]: %g", name, bad, values[bad]);
}

/* Infinite on its own side, where it means none. */
static batten_status check_side(batten_context *ctx, const char *name, const double *values, size_t count,
                                double none) {
  for (size_t i = 0; values && i < count; i++)
    if (isnan(values[i]) || (isinf(values[i]) && (values[i] > 0) != (none > 0)))
      return batten_fail(ctx, BATTEN_E_INVALID, "%s[%zu]: %g; %g is none", name, i, values[i], none);
  return BATTEN_OK;
}

/* Bytes of a character of UTF-8 at text, 0 = it is none. */
static size_t utf8_length(const unsigned char *text) {
  size_t length = text[0] < 0x80   ? 1
                  : text[0] < 0xc2 ? 0
                  : text[0] < 0xe0 ? 2
                  : text[0] < 0xf0 ? 3
                  : text[0] < 0xf5 ? 4
                                   : 0;
  for (size_t i = 1; i < length; i++)
    if ((text[i] & 0xc0) != 0x80) return 0;
  bool wrong = (text[0] == 0xe0 && text[1] < 0xa0) || (text[0] == 0xed && text[1] >= 0xa0) ||
               (text[0] == 0xf0 && text[1] < 0x90) || (text[0] == 0xf4 && text[1] >= 0x90);
  return wrong ? 0 : length;
}

static bool is_utf8(const char *text) {
  const unsigned char *at = (const unsigned char *)text;
  size_t length = 1;
  for (; *at && length; at += length) length = utf8_length(at);
  return length != 0;
}

static batten_status check_names(batten_context *ctx, const char *list, char *const *names, size_t count) {
  for (size_t i = 0; names && i < count; i++) {
    if (!names[i]) return batten_fail(ctx, BATTEN_E_INVALID, "%s[%zu]: NULL; give a name, or no list", list, i);
    if (!is_utf8(names[i])) return batten_fail(ctx, BATTEN_E_INVALID, "%s[%zu]: not UTF-8; rename it", list, i);
  }
  return BATTEN_OK;
}

static batten_status check_problem(batten_context *ctx, const batten_qp_file *file) {
  const batten_qp_problem *p = &file->problem;
  batten_status st = batten_check_struct(ctx, "batten_qp_problem", p->struct_size, sizeof *p);
  if (st != BATTEN_OK) return st;
  size_t n = p->n, k = p->a ? p->a->rows : 0, m = p->c ? p->c->rows : 0;
  if (n > UINT32_MAX) return batten_fail(ctx, BATTEN_E_TOO_LARGE, "problem.n: %zu", n);
  st = check_matrix(ctx, "problem.a", p->a, SIZE_MAX, n);
  if (st == BATTEN_OK) st = check_matrix(ctx, "problem.h", p->h, n, n);
  if (st == BATTEN_OK) st = check_matrix(ctx, "problem.c", p->c, SIZE_MAX, n);
  if (st == BATTEN_OK) st = check_vector(ctx, "problem.b", p->b, k);
  if (st == BATTEN_OK) st = check_vector(ctx, "problem.weights", p->weights, k);
  if (st == BATTEN_OK) st = check_vector(ctx, "problem.g", p->g, n);
  if (st == BATTEN_OK) st = check_vector(ctx, "problem.constant", &p->constant, 1);
  if (st == BATTEN_OK) st = check_vector(ctx, "x0", file->x0, n);
  if (st == BATTEN_OK) st = check_side(ctx, "problem.lower", p->lower, m, -INFINITY);
  if (st == BATTEN_OK) st = check_side(ctx, "problem.upper", p->upper, m, INFINITY);
  if (st == BATTEN_OK) st = check_side(ctx, "problem.x_lower", p->x_lower, n, -INFINITY);
  if (st == BATTEN_OK) st = check_side(ctx, "problem.x_upper", p->x_upper, n, INFINITY);
  char *name = file->name;
  if (st == BATTEN_OK && name) st = check_names(ctx, "name", &name, 1);
  if (st == BATTEN_OK) st = check_names(ctx, "unknown_names", file->unknown_names, n);
  if (st == BATTEN_OK) st = check_names(ctx, "row_names", file->row_names, m);
  return st;
}

batten_status batten_write_qp(batten_context *ctx, const batten_qp_file *file, const char *path) {
  batten_status st = bx_check_pointers(ctx, path, file, "file");
  if (st != BATTEN_OK) return st;
  bx_format format = bx_format_of(path, NULL);
  if (format != BX_QPS && format != BX_JSON)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "%s: quadratic programs are written as .qps .sif .mps .json; rename the "
                       "file",
                       bx_short_path(path));
  st = check_problem(ctx, file);
  bx_writer w;
  if (st == BATTEN_OK) st = bx_create(&w, ctx, path);
  if (st != BATTEN_OK) return st;
  if (format == BX_QPS)
    bx_write_qps(&w, file);
  else
    bx_write_json_qp(&w, file);
  return bx_commit(&w);
}

/* ---- solutions ------------------------------------------------------------------------------------- */

/* A field of CSV, in quotes where it needs them. */
static void put_field(bx_writer *w, const char *text) {
  bool plain = !strpbrk(text, ",\"\r\n");
  if (plain) {
    bx_put_text(w, text);
    return;
  }
  bx_put_text(w, "\"");
  for (; *text; text++) {
    if (*text == '"') bx_put_u8(w, '"');
    bx_put_u8(w, (uint8_t)*text);
  }
  bx_put_text(w, "\"");
}

static void write_csv(bx_writer *w, const batten_qp_file *file, const double *x) {
  for (size_t j = 0; j < file->problem.n; j++) {
    if (file->unknown_names)
      put_field(w, file->unknown_names[j]);
    else
      bx_print(w, "x%zu", j + 1);
    bx_put_u8(w, ',');
    bx_put_number(w, x[j]);
    bx_put_u8(w, '\n');
  }
}

static batten_status check_solution(batten_context *ctx, const batten_qp_solution *s, size_t n, size_t m,
                                    batten_status status) {
  batten_status st = BATTEN_OK;
  if (status >= 0) st = check_vector(ctx, "solution.x", s->x, n);
  if (st == BATTEN_OK && status >= 0) st = check_vector(ctx, "solution.multipliers", s->multipliers, m + n);
  if (st == BATTEN_OK && status == BATTEN_E_INFEASIBLE)
    st = check_vector(ctx, "solution.certificate", s->certificate, m + n);
  if (st == BATTEN_OK && (status == BATTEN_E_UNBOUNDED || status == BATTEN_E_NOT_CONVEX))
    st = check_vector(ctx, "solution.ray", s->ray, n);
  return st;
}

/* Of the formats of text the one with commas, in any case of letters. */
static bool is_csv(const char *path) {
  const char *csv = "csv", *end = strrchr(path, '.');
  if (!end++ || strlen(end) != 3) return false;
  for (size_t i = 0; i < 3; i++)
    if ((end[i] | 0x20) != csv[i]) return false;
  return true;
}

batten_status batten_write_qp_solution(batten_context *ctx, const batten_qp_file *file, batten_status status,
                                       const batten_qp_solution *solution, const char *path) {
  batten_status st = bx_check_pointers(ctx, path, file, "file");
  if (st == BATTEN_OK) st = bx_check_pointers(ctx, path, solution, "solution");
  if (st != BATTEN_OK) return st;
  bx_format format = bx_format_of(path, NULL);
  bool csv = is_csv(path);
  if (format != BX_JSON && !csv)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: solutions are written as .json or .csv; rename the file",
                       bx_short_path(path));
  if (csv && (status < 0 || !solution->x))
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: .csv takes x, and there is none (%s); write .json",
                       bx_short_path(path), batten_status_text(status));
  size_t n = file->problem.n, m = file->problem.c ? file->problem.c->rows : 0;
  st = check_names(ctx, "unknown_names", file->unknown_names, n);
  if (st == BATTEN_OK) st = check_solution(ctx, solution, n, m, status);
  bx_writer w;
  if (st == BATTEN_OK) st = bx_create(&w, ctx, path);
  if (st != BATTEN_OK) return st;
  if (csv)
    write_csv(&w, file, solution->x);
  else
    bx_write_json_qp_solution(&w, n, m, status, solution);
  return bx_commit(&w);
}
