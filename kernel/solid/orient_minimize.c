/* min g' M g over unit vectors g_i: L-BFGS on the product of spheres.   [Nocedal, Wright 2006, alg. 7.4]
 *
 * Gradients and steps are projected to the tangent planes of the spheres, points come back to them by normalisation,
 * pairs of earlier steps were projected when they were made. What makes it fast is the initial metric: the Hessian is
 * about 2 M, so S / 2 = M^-1 / 2 stands where a multiple of the identity is usual: 5 to 40 steps instead of 100 to
 * 300. */
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "basis/eigen3.h"
#include "orient_energy.h"

enum { MEMORY = 8, STEPS_MAX = 200, EIGEN_STEPS_MAX = 40 };
static const double STEP_TOL =
    1e-4; /* tangential over radial part of M g: the angle that normals may still turn by */
static const double EIGEN_TOL = 1e-3; /* only a start: signs count */

static double dot(size_t count, const double *a, const double *b) {
  double s = 0;
  for (size_t i = 0; i < count; i++) s += a[i] * b[i];
  return s;
}

static void add(size_t count, double factor, const double *a, double *b) {
  for (size_t i = 0; i < count; i++) b[i] += factor * a[i];
}

void batten_orient_normalize(unsigned n, size_t count, double *g) {
  for (size_t i = 0; i < count; i++) {
    double length = sqrt(dot(n, g + i * n, g + i * n));
    for (unsigned c = 0; c < n; c++) g[i * n + c] = length > 0 ? g[i * n + c] / length : c == 0;
  }
}

/* v := tangential part of v at g. */
static void project(unsigned n, size_t count, const double *g, double *v) {
  for (size_t i = 0; i < count; i++) add(n, -dot(n, v + i * n, g + i * n), g + i * n, v + i * n);
}

static double longest(unsigned n, size_t count, const double *v) {
  double square = 0;
  for (size_t i = 0; i < count; i++) square = fmax(square, dot(n, v + i * n, v + i * n));
  return sqrt(square);
}

typedef struct search {
  size_t size;
  double *slope, *direction, *next, *next_mg, *spare; /* [size] */
  double *steps, *changes;                            /* [MEMORY][size], a ring */
  size_t pairs, oldest;
} search;

/* direction := - (inverse Hessian) slope. */
static void find_direction(const batten_orient_system *s, const double *g, search *w) {
  double alpha[MEMORY];
  memcpy(w->direction, w->slope, w->size * sizeof *w->direction);
  for (size_t p = w->pairs; p-- > 0;) {
    size_t at = (w->oldest + p) % MEMORY * w->size;
    alpha[p] = dot(w->size, w->steps + at, w->direction) / dot(w->size, w->steps + at, w->changes + at);
    add(w->size, -alpha[p], w->changes + at, w->direction);
  }
  project(s->n, s->count, g, w->direction);
  batten_orient_system_multiply(s, w->direction, w->spare);
  project(s->n, s->count, g, w->spare);
  for (size_t i = 0; i < w->size; i++) w->direction[i] = 0.5 * w->spare[i];
  for (size_t p = 0; p < w->pairs; p++) {
    size_t at = (w->oldest + p) % MEMORY * w->size;
    double beta = dot(w->size, w->changes + at, w->direction) / dot(w->size, w->steps + at, w->changes + at);
    add(w->size, alpha[p] - beta, w->steps + at, w->direction);
  }
  project(s->n, s->count, g, w->direction);
  for (size_t i = 0; i < w->size; i++) w->direction[i] *= -1;
}

/* Keeps the pair (step, change of slope) when its curvature is positive. */
static void remember(const batten_orient_system *s, const double *g, const double *slope_new, search *w) {
  size_t at = (w->oldest + w->pairs) % MEMORY * w->size;
  double *step = w->steps + at, *change = w->changes + at;
  for (size_t i = 0; i < w->size; i++) {
    step[i] = w->next[i] - g[i];
    change[i] = slope_new[i] - w->slope[i];
  }
  project(s->n, s->count, w->next, step);
  project(s->n, s->count, w->next, change);
  double curvature = dot(w->size, step, change);
  bool full = w->pairs == MEMORY; /* then the oldest has been overwritten */
  if (full) w->oldest = (w->oldest + 1) % MEMORY;
  if (!(curvature > 1e-12 * sqrt(dot(w->size, step, step) * dot(w->size, change, change))))
    w->pairs -= full;
  else if (!full)
    w->pairs++;
}

static void find_slope(const batten_orient_system *s, const double *g, const double *mg, double *slope) {
  for (size_t i = 0; i < s->size; i++) slope[i] = 2 * mg[i];
  project(s->n, s->count, g, slope);
}

/* Armijo's rule along direction; false when no step lowers the energy. */
static bool step_along(const batten_orient_system *s, const double *g, double *energy, search *w) {
  double descent = dot(w->size, w->direction, w->slope), far = longest(s->n, s->count, w->direction);
  if (!(descent < 0)) return false;
  for (double t = far > 1 ? 1 / far : 1; t > 1e-8; t /= 2) {
    for (size_t i = 0; i < w->size; i++) w->next[i] = g[i] + t * w->direction[i];
    batten_orient_normalize(s->n, s->count, w->next);
    batten_orient_system_solve(s, w->next, w->next_mg);
    double reached = dot(w->size, w->next, w->next_mg);
    if (reached <= *energy + 1e-4 * t * descent) {
      *energy = reached;
      return true;
    }
  }
  return false;
}

batten_status batten_orient_minimize(batten_context *ctx, const batten_orient_system *s, double part, double *g,
                                     double *mg, double *energy) {
  search w = {.size = s->size};
  batten_status status = BATTEN_E_NOMEM;
  double *memory = batten_alloc_array(ctx, s->size, (5 + 2 * MEMORY) * sizeof *memory);
  if (!memory) return status;
  double **blocks[] = {&w.slope, &w.direction, &w.next, &w.next_mg, &w.spare, &w.steps};
  for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) *blocks[i] = memory + i * s->size;
  w.changes = w.steps + MEMORY * s->size;

  batten_orient_system_solve(s, g, mg);
  *energy = dot(s->size, g, mg);
  find_slope(s, g, mg, w.slope);
  for (unsigned step = 0; step < STEPS_MAX; step++) {
    if ((status = batten_progress(ctx, "orient", part)) < 0) goto done;
    if (sqrt(dot(w.size, w.slope, w.slope)) <= STEP_TOL * 2 * *energy / sqrt((double)s->count)) break;
    find_direction(s, g, &w);
    if (!step_along(s, g, energy, &w)) {
      if (w.pairs == 0) break;
      w.pairs = 0; /* memory misled: once more with the metric alone */
      continue;
    }
    find_slope(s, w.next, w.next_mg, w.spare);
    remember(s, g, w.spare, &w);
    memcpy(w.slope, w.spare, w.size * sizeof *g);
    memcpy(g, w.next, w.size * sizeof *g);
    memcpy(mg, w.next_mg, w.size * sizeof *g);
  }
  status = BATTEN_OK;
done:
  batten_free(ctx, memory);
  return status;
}

/* v := v / |v|, sv with it; false when v is nothing. */
static bool scale_pair(size_t size, double *v, double *sv, double least) {
  double length = sqrt(dot(size, v, v));
  if (!(length > least)) return false;
  for (size_t i = 0; i < size; i++) {
    v[i] /= length;
    sv[i] /= length;
  }
  return true;
}

/* Locally optimal conjugate gradients for S's largest eigenvalue (Knyazev 2001, block size 1): the best vector in the
 * span of x, the residual and the last step. The start is the field of rays from the centroid: sum x_i . n_i > 0 for
 * the normals of every solid, and it turns with the data. */
batten_status batten_orient_eigenvector(batten_context *ctx, const batten_orient_system *s, double part, double *g) {
  size_t size = s->size;
  batten_status status = BATTEN_E_NOMEM;
  double *memory = batten_alloc_array(ctx, size, 6 * sizeof *memory);
  if (!memory) return status;
  double *v[3] = {memory, memory + size, memory + 2 * size}; /* x, residual, step: orthonormal; and S times them */
  double *sv[3] = {memory + 3 * size, memory + 4 * size, memory + 5 * size};
  memcpy(v[0], s->x, size * sizeof **v);
  batten_orient_normalize(s->n, s->count, v[0]);
  batten_orient_system_multiply(s, v[0], sv[0]);
  scale_pair(size, v[0], sv[0], 0);
  bool stepped = false;
  for (unsigned step = 0; step < EIGEN_STEPS_MAX; step++) {
    if ((status = batten_progress(ctx, "orient", part)) < 0) goto done;
    double value = dot(size, v[0], sv[0]);
    for (size_t i = 0; i < size; i++) v[1][i] = sv[0][i] - value * v[0][i];
    if (sqrt(dot(size, v[1], v[1])) <= EIGEN_TOL * value) break;
    add(size, -dot(size, v[0], v[1]), v[0], v[1]);
    batten_orient_system_multiply(s, v[1], sv[1]);
    if (!scale_pair(size, v[1], sv[1], 0)) break;
    for (int q = 0; stepped && q < 2; q++) {
      double along = dot(size, v[q], v[2]);
      add(size, -along, v[q], v[2]);
      add(size, -along, sv[q], sv[2]);
    }
    unsigned span = stepped && scale_pair(size, v[2], sv[2], 1e-8) ? 3 : 2;
    double projected[9], values[3], vectors[9];
    for (unsigned r = 0; r < span; r++)
      for (unsigned c = 0; c < span; c++) projected[r * span + c] = dot(size, v[r < c ? r : c], sv[r < c ? c : r]);
    batten_eigen_symmetric(span, projected, values, vectors);
    const double *best = vectors + (size_t)(span - 1) * span;
    double third = span == 3 ? best[2] : 0;
    for (size_t i = 0; i < size; i++) {
      v[2][i] = best[1] * v[1][i] + (span == 3 ? third * v[2][i] : 0);
      sv[2][i] = best[1] * sv[1][i] + (span == 3 ? third * sv[2][i] : 0);
      v[0][i] = best[0] * v[0][i] + v[2][i];
      sv[0][i] = best[0] * sv[0][i] + sv[2][i];
    }
    stepped = scale_pair(size, v[2], sv[2], 1e-8);
    scale_pair(size, v[0], sv[0], 0);
  }
  memcpy(g, v[0], size * sizeof *g);
  batten_orient_normalize(s->n, s->count, g);
  status = BATTEN_OK;
done:
  batten_free(ctx, memory);
  return status;
}
