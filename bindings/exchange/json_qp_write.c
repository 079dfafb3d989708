/* Quadratic programs and their solutions as JSON documents: see json_qp_read.c for their members. */
#include "write.h"

#include <math.h>

/* null for what is infinite: no bound. */
static void put_value(bx_writer *w, double value) {
  if (isfinite(value))
    bx_put_number(w, value);
  else
    bx_put_text(w, "null");
}

static void put_array(bx_writer *w, const double *values, size_t count) {
  bx_put_text(w, "[");
  for (size_t i = 0; i < count; i++) {
    if (i) bx_put_text(w, ", ");
    put_value(w, values[i]);
  }
  bx_put_text(w, "]");
}

static void put_vector(bx_writer *w, const char *key, const double *values, size_t count) {
  if (!values) return;
  bx_print(w, ",\n\"%s\": ", key);
  put_array(w, values, count);
}

/* A vector that a sparse matrix's size is taken from: there even when the caller left it out. */
static void put_sizing_vector(bx_writer *w, const char *key, const double *values, size_t count,
                              const char *otherwise) {
  if (values) {
    put_vector(w, key, values, count);
    return;
  }
  bx_print(w, ",\n\"%s\": [", key);
  for (size_t i = 0; i < count; i++) {
    if (i) bx_put_text(w, ", ");
    bx_put_text(w, otherwise);
  }
  bx_put_text(w, "]");
}

static void put_index(bx_writer *w, bool first, size_t index) { bx_print(w, first ? "%zu" : ", %zu", index); }

static void put_matrix(bx_writer *w, const char *key, const batten_matrix *m) {
  if (!m) return;
  bx_print(w, ",\n\"%s\": ", key);
  if (m->dense) {
    bx_put_text(w, "[");
    for (size_t i = 0; i < m->rows; i++) {
      bx_put_text(w, i ? ",\n" : "\n");
      put_array(w, m->dense + i * m->columns, m->columns);
    }
    bx_put_text(w, "]");
    return;
  }
  size_t count = m->rows ? m->starts[m->rows] : 0;
  bx_put_text(w, "{\"rows\": [");
  for (size_t i = 0; i < m->rows; i++)
    for (size_t e = m->starts[i]; e < m->starts[i + 1]; e++) put_index(w, e == 0, i);
  bx_put_text(w, "],\n\"cols\": [");
  for (size_t e = 0; e < count; e++) put_index(w, e == 0, m->indices[e]);
  bx_put_text(w, "],\n\"values\": ");
  put_array(w, m->values, count);
  bx_put_text(w, "}");
}

static void put_names(bx_writer *w, const char *key, char *const *names, size_t count) {
  if (!names) return;
  bx_print(w, ",\n\"%s\": [", key);
  for (size_t i = 0; i < count; i++) {
    if (i) bx_put_text(w, ", ");
    bx_put_json_text(w, names[i]);
  }
  bx_put_text(w, "]");
}

void bx_write_json_qp(bx_writer *w, const batten_qp_file *file) {
  const batten_qp_problem *p = &file->problem;
  size_t n = p->n, k = p->a ? p->a->rows : 0, m = p->c ? p->c->rows : 0;
  bx_put_text(w, "{\"batten\": \"qp\", \"version\": 1");
  if (file->name && *file->name) {
    bx_put_text(w, ",\n\"name\": ");
    bx_put_json_text(w, file->name);
  }
  bx_print(w, ",\n\"n\": %zu", n);
  put_matrix(w, "H", p->h);
  put_matrix(w, "A", k ? p->a : NULL);
  if (k) put_sizing_vector(w, "b", p->b, k, "0");
  if (k) put_vector(w, "weights", p->weights, k);
  put_sizing_vector(w, "g", p->g, n, "0");
  bx_put_text(w, ",\n\"constant\": ");
  bx_put_number(w, p->constant);
  put_matrix(w, "C", m ? p->c : NULL);
  if (m) put_sizing_vector(w, "lower", p->lower, m, "null");
  if (m) put_vector(w, "upper", p->upper, m);
  put_vector(w, "x_lower", p->x_lower, n);
  put_vector(w, "x_upper", p->x_upper, n);
  put_vector(w, "x0", file->x0, n);
  put_names(w, "unknown_names", file->unknown_names, n);
  if (m) put_names(w, "row_names", file->row_names, m);
  bx_put_text(w, "\n}\n");
}

/* ---- solutions ------------------------------------------------------------------------------------- */

const char *batten_qp_status_word(batten_status status) {
  switch (status) {
    case BATTEN_OK:
      return "optimal";
    case BATTEN_W_ACCURACY:
      return "inaccurate";
    case BATTEN_W_STOPPED:
      return "stopped";
    case BATTEN_E_INFEASIBLE:
      return "infeasible";
    case BATTEN_E_UNBOUNDED:
      return "unbounded";
    case BATTEN_E_NOT_CONVEX:
      return "not convex";
    case BATTEN_E_LIMIT:
      return "limit";
    default:
      return batten_status_name(status);
  }
}

void bx_write_json_qp_solution(bx_writer *w, size_t n, size_t m, batten_status status,
                               const batten_qp_solution *solution) {
  bx_print(w, "{\"batten\": \"qp_solution\", \"version\": 1,\n\"status\": \"%s\"", batten_qp_status_word(status));
  if (status >= 0) {
    put_vector(w, "x", solution->x, n);
    put_vector(w, "multipliers", solution->multipliers, m + n);
    if (solution->active) {
      bx_put_text(w, ",\n\"active\": [");
      for (size_t i = 0; i < m + n; i++) bx_print(w, i ? ", %d" : "%d", solution->active[i]);
      bx_put_text(w, "]");
    }
  }
  if (status == BATTEN_E_INFEASIBLE) put_vector(w, "certificate", solution->certificate, m + n);
  if (status == BATTEN_E_UNBOUNDED || status == BATTEN_E_NOT_CONVEX) put_vector(w, "ray", solution->ray, n);
  bx_put_text(w, "\n}\n");
}
