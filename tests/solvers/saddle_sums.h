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

NOT_SANITIZED FAST_SUMS static double sum_r(size_t n, const double *x, const double *y, const double *z,
                                            const double *w, const double *p) {
  double s[SUM_LANES] = {0}, total = 0;
  for (size_t j = 0; j < n; j += SUM_LANES)
    for (size_t l = 0; l < SUM_LANES; l++) {
      double dx = x[j + l] - p[0], dy = y[j + l] - p[1], dz = z[j + l] - p[2];
      s[l] += w[j + l] * sqrt(dx * dx + dy * dy + dz * dz);
    }
  for (size_t l = 0; l < SUM_LANES; l++) total += s[l];
  return -total;
}

NOT_SANITIZED FAST_SUMS static double sum_r3(size_t n, const double *x, const double *y, const double *z,
                                             const double *w, const double *p) {
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

typedef struct answer {
  batten_status status;
  batten_saddle_info info;
  double *w, c[10];
} answer;

static inline answer answer_new(size_t n) { return (answer){.w = calloc(n + 1, sizeof(double))}; }

static inline batten_saddle_options iterative_options(double accuracy) {
  batten_saddle_options o = batten_saddle_options_default();
  o.method = BATTEN_SADDLE_ITERATIVE;
  o.accuracy = accuracy;
  return o;
}

/* Factors and solves; sums are d's, whose counts are looked at by the caller. */
static inline void solve(batten_context *ctx, scene *s, direct *d, const batten_saddle_options *o, answer *a) {
  batten_saddle_sums sums = direct_sums(s, d);
  batten_saddle_matrix m = scene_matrix(s);
  batten_saddle *h = NULL;
  m.sums = &sums;
  a->status = batten_saddle_factor(ctx, &m, o, &h);
  if (a->status == BATTEN_OK) {
    a->status = batten_saddle_solve(ctx, h, s->f, a->w, a->c);
    a->info = batten_saddle_get_info(h);
  }
  batten_saddle_free(h);
  if (d->live != 0) t_line(false, "%zu plans left over", d->live);
}

/* A sphere with bumps, random points on it: the ball's distance as data. */
static inline scene bumpy_sphere(scene_kernel kernel, size_t n, uint64_t seed) {
  scene s = scene_new(SCENE_SPHERE, kernel, n, 4, seed);
  for (size_t i = 0; i < n; i++) {
    double *x = s.x + 3 * i,
           r = 0.35 * (1 + 0.1 * sin(5 * x[0]) * sin(5 * x[1]) * sin(5 * x[2]) + 0.05 * sin(9 * x[2]));
    for (int a = 0; a < 3; a++) x[a] = 0.5 + r * x[a];
    for (size_t c = 1; c < s.k; c++) s.p[i + c * n] = x[c - 1];
    s.f[i] = 0.35 - r;
  }
  return s;
}

/* f: smooth, not random. */
static inline void smooth_data(scene *s) {
  for (size_t i = 0; i < s->n; i++) s->f[i] = sin(3 * s->x[3 * i]) + s->x[3 * i + 1] * s->x[3 * i + 2];
}

static inline void polynomials(scene *s) {
  for (size_t i = 0; i < s->n; i++)
    for (size_t c = 1; c < s->k && c < 4; c++) s->p[i + c * s->n] = s->x[3 * i + c - 1];
}

/* 2-norm of f - K w - P c over all rows, over that of f less its mean: no less than what the method promises by. */
static inline double residual_of(const scene *s, const answer *a, const double *c) {
  double square = 0, all = 0, mean = 0;
  double *column = malloc((s->n + 1) * sizeof *column);
  for (size_t i = 0; i < s->n; i++) mean += s->f[i] / (double)s->n;
  for (size_t i = 0; i < s->n; i++) {
    double r = s->f[i];
    scene_fill(s, 0, s->n, i, 1, column, s->n);
    for (size_t j = 0; j < s->n; j++) r -= column[j] * a->w[j];
    for (size_t q = 0; q < s->k; q++) r -= s->p[i + q * s->n] * c[q];
    square += r * r;
    all += (s->f[i] - mean) * (s->f[i] - mean);
  }
  free(column);
  return sqrt(square / all);
}

static inline double orthogonality_of(const scene *s, const answer *a) {
  double worst = 0, total = 0;
  for (size_t i = 0; i < s->n; i++) total += fabs(a->w[i]);
  for (size_t q = 0; q < s->k; q++) {
    double sum = 0, most = 0;
    for (size_t i = 0; i < s->n; i++) {
      sum += s->p[i + q * s->n] * a->w[i];
      most = fmax(most, fabs(s->p[i + q * s->n]));
    }
    worst = fmax(worst, fabs(sum) / (most * total));
  }
  return worst;
}

#endif
