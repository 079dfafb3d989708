/* Point sets and kernels for the tests of saddle: K[i][j] = phi(|x_i - x_j|), P = [1, x, y, z] or [1]. */
#ifndef SADDLE_SCENE_H
#define SADDLE_SCENE_H

#include <batten/saddle.h>

#include "tap.h"

typedef enum scene_kernel { KERNEL_R, KERNEL_R3, KERNEL_R2LOGR } scene_kernel; /* -r, r^3, r^2 ln r */
static const char *const kernel_names[] = {"-r", "r^3", "r^2 ln r"};

typedef struct scene {
  size_t n, k;
  scene_kernel kernel;
  double nugget;    /* added to the diagonal */
  double factor;    /* multiplies K */
  double *x;        /* [n][3] */
  double *p;        /* [k][n] */
  double *f;        /* [n] */
  void *sums_state; /* of saddle_sums.h */
} scene;

/* The sums of the tests themselves are not what sanitizers are to look at, and take most of the time under them. */
#if defined(__GNUC__) && !defined(__clang__)
#define NOT_SANITIZED __attribute__((no_sanitize("address", "undefined")))
#else
#define NOT_SANITIZED
#endif

NOT_SANITIZED static inline double scene_phi(scene_kernel kernel, double r2) {
  if (kernel == KERNEL_R) return -sqrt(r2);
  if (kernel == KERNEL_R3) return r2 * sqrt(r2);
  return r2 > 0 ? 0.5 * r2 * log(r2) : 0;
}

NOT_SANITIZED static inline void scene_fill(const void *user, size_t row0, size_t rows, size_t col0, size_t cols,
                                            double *tile, size_t ld) {
  const scene *s = user;
  for (size_t j = 0; j < cols; j++)
    for (size_t i = 0; i < rows; i++) {
      const double *a = s->x + 3 * (row0 + i), *b = s->x + 3 * (col0 + j);
      double dx = a[0] - b[0], dy = a[1] - b[1], dz = a[2] - b[2];
      tile[i + j * ld] = s->factor * scene_phi(s->kernel, dx * dx + dy * dy + dz * dz);
      if (row0 + i == col0 + j) tile[i + j * ld] += s->nugget;
    }
}

typedef enum scene_type {
  SCENE_RANDOM,
  SCENE_GRID,
  SCENE_SPHERE,
  SCENE_NEAR_DUPLICATES,
  SCENE_CLUSTERS,
  SCENE_TINY,
  SCENE_HUGE,
  SCENE_TRANSLATED,
  SCENE_TYPES
} scene_type;
static const char *const scene_names[] = {"random",   "grid",       "sphere",    "near-duplicates",
                                          "clusters", "scale 1e-6", "scale 1e6", "translated"};

static inline void scene_points(scene_type type, size_t n, uint64_t *seed, double *x) {
  size_t side = (size_t)ceil(cbrt((double)n));
  for (size_t i = 0; i < n; i++) {
    double *p = x + 3 * i, u[3];
    for (int d = 0; d < 3; d++) p[d] = u[d] = 2 * t_uniform(seed) - 1;
    double norm = sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
    switch (type) {
      case SCENE_GRID:
        p[0] = (double)(i % side), p[1] = (double)(i / side % side), p[2] = (double)(i / side / side);
        break;
      case SCENE_SPHERE:
        for (int d = 0; d < 3; d++) p[d] /= norm;
        break;
      case SCENE_NEAR_DUPLICATES:
        for (int d = 0; d < 3 && i % 2 == 1 && i > 4; d++) p[d] = x[3 * (i - 1) + (size_t)d] + 1e-4 * u[d];
        break;
      case SCENE_CLUSTERS:
        for (int d = 0; d < 3 && i >= 5; d++) p[d] = x[3 * (i % 5) + (size_t)d] + 0.05 * u[d];
        break;
      case SCENE_TINY:
        for (int d = 0; d < 3; d++) p[d] *= 1e-6;
        break;
      case SCENE_HUGE:
        for (int d = 0; d < 3; d++) p[d] *= 1e6;
        break;
      case SCENE_TRANSLATED:
        for (int d = 0; d < 3; d++) p[d] += 100 * (d + 1);
        break;
      default:
        break;
    }
  }
}

/* k = 4: linear polynomials; 1: constants; 0: none; above 4 the caller fills the rest of P. */
static inline scene scene_new(scene_type type, scene_kernel kernel, size_t n, size_t k, uint64_t seed) {
  scene s = {.n = n, .k = k, .kernel = kernel, .factor = 1};
  s.x = malloc((3 * n + 1) * sizeof *s.x);
  s.p = malloc((k * n + 1) * sizeof *s.p);
  s.f = malloc((n + 1) * sizeof *s.f);
  scene_points(type, n, &seed, s.x);
  for (size_t i = 0; i < n; i++) {
    for (size_t c = 0; c < k; c++) s.p[i + c * n] = c == 0 ? 1 : c < 4 ? s.x[3 * i + c - 1] : 0;
    s.f[i] = 2 * t_uniform(&seed) - 1;
  }
  return s;
}

static inline void scene_free(scene *s) {
  free(s->x);
  free(s->p);
  free(s->f);
}

static inline batten_saddle_matrix scene_matrix(const scene *s) {
  return (batten_saddle_matrix){.n = s->n, .k = s->k, .p = s->k ? s->p : NULL, .fill = scene_fill, .user = s};
}

/* How well (w, c) solves the scene, computed in the plainest way. */
typedef struct scene_quality {
  double residual; /* max |f - K w - P c| / max |f| */
  double scaled;   /* max |f - K w - P c| / (eps max(|f| + |K||w| + |P||c|)): rounding of w alone gives about 1 */
  double orthogonality; /* max |P' w| / (max|P| |w|_1) */
} scene_quality;

static inline scene_quality scene_check(const scene *s, const double *w, const double *c) {
  double worst = 0, f_norm = 0, sum_norm = 0, dot = 0, w1 = 0, p_norm = 0;
  for (size_t i = 0; i < s->n; i++) {
    double r = s->f[i], sum = fabs(r), entry;
    for (size_t j = 0; j < s->n; j++) {
      scene_fill(s, i, 1, j, 1, &entry, 1);
      r -= entry * w[j];
      sum += fabs(entry * w[j]);
    }
    for (size_t q = 0; q < s->k; q++) {
      double term = s->p[i + q * s->n] * c[q];
      r -= term;
      sum += fabs(term);
      p_norm = fmax(p_norm, fabs(s->p[i + q * s->n]));
    }
    worst = fmax(worst, isnan(r) ? INFINITY : fabs(r));
    sum_norm = fmax(sum_norm, sum);
    f_norm = fmax(f_norm, fabs(s->f[i]));
    w1 += fabs(w[i]);
  }
  for (size_t q = 0; q < s->k; q++) {
    double sum = 0;
    for (size_t i = 0; i < s->n; i++) sum += s->p[i + q * s->n] * w[i];
    dot = fmax(dot, fabs(sum));
  }
  return (scene_quality){f_norm > 0 ? worst / f_norm : 0, sum_norm > 0 ? worst / (0x1p-52 * sum_norm) : 0,
                         w1 > 0 && p_norm > 0 ? dot / (p_norm * w1) : 0};
}

#endif
