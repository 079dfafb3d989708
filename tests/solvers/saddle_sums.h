/* Products for the tests of the iterative method: sums over all pairs of a scene, on the context's threads. */
#ifndef SADDLE_SUMS_H
#define SADDLE_SUMS_H

#include "saddle_scene.h"

/* What the products are worth, and what was asked of them. */
typedef struct direct {
  const scene *s;
  double worst;        /* relative error put into each product, on top of the accuracy asked for by `honest` */
  bool honest;         /* errors of the size that was asked for */
  size_t plans, calls; /* made, applied */
  double last_accuracy;
  size_t live;
} direct;

typedef struct direct_plan {
  direct *d;
  double error;
  size_t rows, cols;
  size_t *row, *col;   /* NULL: all */
  double *x, *w, *y;   /* [3][cols] the sources, coordinate by coordinate; their weights */
  const double *input; /* of the call under way */
} direct_plan;

#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__)
#define FAST_SUMS __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default"), optimize("O3")))
#else
#define FAST_SUMS
#endif

enum { SUM_LANES = 16 };

FAST_SUMS static double sum_r(size_t n, const double *x, const double *y, const double *z, const double *w,
                              const double *p) {
  double s[SUM_LANES] = {0}, total = 0;
  for (size_t j = 0; j < n; j += SUM_LANES)
    for (size_t l = 0; l < SUM_LANES; l++) {
      double dx = x[j + l] - p[0], dy = y[j + l] - p[1], dz = z[j + l] - p[2];
      s[l] += w[j + l] * sqrt(dx * dx + dy * dy + dz * dz);
    }
  for (size_t l = 0; l < SUM_LANES; l++) total += s[l];
  return -total;
}

FAST_SUMS static double sum_r3(size_t n, const double *x, const double *y, const double *z, const double *w,
                               const double *p) {
  double s[SUM_LANES] = {0}, total = 0;
  for (size_t j = 0; j < n; j += SUM_LANES)
    for (size_t l = 0; l < SUM_LANES; l++) {
      double dx = x[j + l] - p[0], dy = y[j + l] - p[1], dz = z[j + l] - p[2], r2 = dx * dx + dy * dy + dz * dz;
      s[l] += w[j + l] * (r2 * sqrt(r2));
    }
  for (size_t l = 0; l < SUM_LANES; l++) total += s[l];
  return total;
}

enum { DIRECT_ROWS = 64 };

static void direct_rows(void *arg, size_t task) {
  const direct_plan *p = arg;
  const scene *s = p->d->s;
  size_t high = (task + 1) * DIRECT_ROWS < p->rows ? (task + 1) * DIRECT_ROWS : p->rows;
  size_t padded = (p->cols + SUM_LANES - 1) / SUM_LANES * SUM_LANES;
  const double *x = p->x, *y = x + padded, *z = y + padded;
  for (size_t i = task * DIRECT_ROWS; i < high; i++) {
    size_t at = p->row ? p->row[i] : i;
    const double *q = s->x + 3 * at;
    if (s->kernel == KERNEL_R) {
      p->y[i] = sum_r(padded, x, y, z, p->w, q);
    } else if (s->kernel == KERNEL_R3) {
      p->y[i] = sum_r3(padded, x, y, z, p->w, q);
    } else {
      p->y[i] = 0;
      for (size_t j = 0; j < p->cols; j++) {
        double dx = x[j] - q[0], dy = y[j] - q[1], dz = z[j] - q[2];
        p->y[i] += p->w[j] * scene_phi(s->kernel, dx * dx + dy * dy + dz * dz);
      }
    }
    p->y[i] *= s->factor;
  }
}

static void direct_release(void *plan) {
  direct_plan *p = plan;
  p->d->live--;
  free(p->row);
  free(p->col);
  free(p->x);
  free(p);
}

static batten_status direct_new(const void *user, batten_context *ctx, double accuracy, size_t row_count,
                                const size_t *rows, size_t col_count, const size_t *cols, void **plan) {
  const scene *s = user;
  direct *d = s->sums_state;
  direct_plan *p = calloc(1, sizeof *p);
  size_t padded = (col_count + SUM_LANES - 1) / SUM_LANES * SUM_LANES;
  (void)ctx;
  d->plans++;
  d->live++;
  d->last_accuracy = accuracy;
  *p = (direct_plan){.d = d, .error = (d->honest ? accuracy : 0) + d->worst, .rows = row_count, .cols = col_count};
  if (rows) p->row = memcpy(malloc(row_count * sizeof *rows), rows, row_count * sizeof *rows);
  if (cols) p->col = memcpy(malloc(col_count * sizeof *cols), cols, col_count * sizeof *cols);
  p->x = calloc(4 * padded + 1, sizeof *p->x);
  p->w = p->x + 3 * padded;
  for (size_t j = 0; j < col_count; j++)
    for (size_t a = 0; a < 3; a++) p->x[j + a * padded] = s->x[3 * (cols ? cols[j] : j) + a];
  *plan = p;
  return BATTEN_OK;
}

static batten_status direct_apply(void *plan, batten_context *ctx, const double *x, double *y) {
  direct_plan *p = plan;
  const scene *s = p->d->s;
  uint64_t seed = 77;
  double norm = 0;
  p->d->calls++;
  p->y = y;
  memcpy(p->w, x, p->cols * sizeof *x);
  batten_parallel(ctx, (p->rows + DIRECT_ROWS - 1) / DIRECT_ROWS, direct_rows, p);
  if (s->nugget != 0)
    for (size_t i = 0, j = 0; i < p->rows; i++) {
      size_t at = p->row ? p->row[i] : i;
      while (j < p->cols && (p->col ? p->col[j] : j) < at) j++;
      if (j < p->cols && (p->col ? p->col[j] : j) == at) y[i] += s->nugget * x[j];
    }
  if (p->error > 0) {
    for (size_t i = 0; i < p->rows; i++) norm += y[i] * y[i];
    norm = sqrt(norm / ((double)p->rows + 1));
    for (size_t i = 0; i < p->rows; i++) y[i] += p->error * norm * (2 * t_uniform(&seed) - 1) * sqrt(3);
  }
  return BATTEN_OK;
}

static void direct_entries(const void *user, size_t rows, const size_t *row, size_t cols, const size_t *col,
                           double *tile, size_t ld) {
  for (size_t j = 0; j < cols; j++)
    for (size_t i = 0; i < rows; i++) scene_fill(user, row[i], 1, col[j], 1, tile + i + j * ld, ld);
}

/* Sums of a scene, by d. */
static batten_saddle_sums direct_sums(scene *s, direct *d) {
  d->s = s;
  s->sums_state = d;
  return (batten_saddle_sums){.dimension = 3,
                              .points = s->x,
                              .plan = direct_new,
                              .apply = direct_apply,
                              .release = direct_release,
                              .entries = direct_entries};
}

#endif
