/* Quadratic programs read from memory, and compared bit by bit. */
#ifndef TEST_QP_FILES_H
#define TEST_QP_FILES_H

#include "files.h"

static inline batten_status qp_of(batten_context *ctx, const char *name, const void *bytes, size_t size,
                                  batten_qp_file *out) {
  bx_reader r;
  batten_status st = bx_open_memory(&r, ctx, name, bytes, size);
  if (st != BATTEN_OK) return st;
  bool gz;
  st = bx_read_qp_from(&r, bx_format_of(name, &gz), out);
  bx_close(&r);
  return st;
}

/* Both absent, or the same bits. */
static inline bool same_numbers(const double *a, const double *b, size_t count) {
  if (!a || !b) return !a && !b;
  return count == 0 || !memcmp(a, b, count * sizeof *a);
}

static inline bool same_matrices(const batten_matrix *a, const batten_matrix *b) {
  if (!a || !b) return !a && !b;
  if (a->rows != b->rows || a->columns != b->columns || !a->dense != !b->dense) return false;
  if (a->dense) return same_numbers(a->dense, b->dense, a->rows * a->columns);
  size_t count = a->starts[a->rows];
  return !memcmp(a->starts, b->starts, (a->rows + 1) * sizeof *a->starts) &&
         (!count || !memcmp(a->indices, b->indices, count * sizeof *a->indices)) &&
         same_numbers(a->values, b->values, count);
}

static inline bool same_names(char *const *a, char *const *b, size_t count) {
  if (!a || !b) return !a && !b;
  for (size_t i = 0; i < count; i++)
    if (strcmp(a[i], b[i])) return false;
  return true;
}

/* The first thing that differs, NULL = nothing. */
static inline const char *qp_difference(const batten_qp_file *a, const batten_qp_file *b) {
  const batten_qp_problem *p = &a->problem, *q = &b->problem;
  size_t n = p->n, m = p->c ? p->c->rows : 0, k = p->a ? p->a->rows : 0;
  return p->n != q->n                                         ? "n"
         : !same_matrices(p->a, q->a)                         ? "a"
         : !same_matrices(p->h, q->h)                         ? "h"
         : !same_matrices(p->c, q->c)                         ? "c"
         : !same_numbers(p->b, q->b, k)                       ? "b"
         : !same_numbers(p->weights, q->weights, k)           ? "weights"
         : !same_numbers(p->g, q->g, n)                       ? "g"
         : !same_numbers(&p->constant, &q->constant, 1)       ? "constant"
         : !same_numbers(p->lower, q->lower, m)               ? "lower"
         : !same_numbers(p->upper, q->upper, m)               ? "upper"
         : !same_numbers(p->x_lower, q->x_lower, n)           ? "x_lower"
         : !same_numbers(p->x_upper, q->x_upper, n)           ? "x_upper"
         : !same_numbers(a->x0, b->x0, n)                     ? "x0"
         : strcmp(a->name, b->name)                           ? "name"
         : !same_names(a->unknown_names, b->unknown_names, n) ? "unknown_names"
         : !same_names(a->row_names, b->row_names, m)         ? "row_names"
                                                              : NULL;
}

/* A number of any exponent. */
static inline double any_number(uint64_t *seed) {
  double value = ldexp(2 * t_uniform(seed) - 1, (int)(t_random(seed) % 80) - 40);
  return t_random(seed) % 8 ? value : floor(16 * value);
}

#endif
