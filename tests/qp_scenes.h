/* Quadratic programs for tests and benchmarks, the same numbers everywhere:
 *   qp_scene_random   solution and multipliers known, condition, active rows and all else chosen
 *   qp_scene_patch    convex Bezier patch: 48 unknowns, 352 .. 27,104 dense rows, right sides 0, a strict start
 *   qp_scene_curve    planar cubic spline that must keep turning left: 2 N unknowns, 6 (N - 3) rows of 8 entries
 *   qp_scene_convex   sequence whose k-th differences are not negative (as LISWET): n unknowns, n - k rows
 * Each gives a scene on the heap; free it with qp_scene_free. */
#ifndef QP_SCENES_H
#define QP_SCENES_H

#include <batten/qp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "scenes.h"

typedef struct qp_scene {
  batten_qp_problem problem;
  batten_matrix a, h, c; /* what problem points at */
  double *x, *y;         /* [n], [m + n] solution and multipliers, NULL where not known */
  double *start;         /* [n] strictly feasible, NULL where not known */
  void *blocks[24];
  size_t used;
} qp_scene;

static inline void qp_scene_free(qp_scene *s) {
  while (s && s->used) free(s->blocks[--s->used]);
  free(s);
}

/* Zeroed memory of the scene. */
static inline void *qp_scene_array(qp_scene *s, size_t count, size_t size) {
  void *block = calloc(count ? count : 1, size);
  if (!block) {
    fprintf(stderr, "out of memory\n");
    exit(1);
  }
  return s->blocks[s->used++] = block;
}

static inline qp_scene *qp_scene_new(size_t n) {
  qp_scene *s = calloc(1, sizeof *s);
  if (!s) {
    fprintf(stderr, "out of memory\n");
    exit(1);
  }
  s->problem = batten_qp_problem_default(n);
  return s;
}

/* Uniform integer in [0, count), and a multiple of 2^-8 in [-1, 1]: sums of products of such are exact in a double.
 */
static inline size_t qp_scene_pick(uint64_t *seed, size_t count) {
  return (size_t)(scene_uniform(seed) * (double)count);
}
static inline double qp_scene_short(uint64_t *seed) { return (double)qp_scene_pick(seed, 513) / 256 - 1; }

/* Rows of a sparse matrix, appended one after the other. */
typedef struct qp_scene_rows {
  size_t rows, *starts;
  uint32_t *indices;
  double *values;
} qp_scene_rows;

static inline qp_scene_rows qp_scene_rows_new(qp_scene *s, size_t rows, size_t entries) {
  return (qp_scene_rows){0, qp_scene_array(s, rows + 1, sizeof(size_t)), qp_scene_array(s, entries, sizeof(uint32_t)),
                         qp_scene_array(s, entries, sizeof(double))};
}
static inline void qp_scene_entry(qp_scene_rows *r, size_t column, double value) {
  size_t at = r->starts[r->rows + 1]++;
  r->indices[at] = (uint32_t)column;
  r->values[at] = value;
}
static inline void qp_scene_row_begin(qp_scene_rows *r) { r->starts[r->rows + 1] = r->starts[r->rows]; }
static inline void qp_scene_row_end(qp_scene_rows *r) { r->rows++; }
static inline batten_matrix qp_scene_rows_matrix(const qp_scene_rows *r, size_t columns) {
  return batten_matrix_sparse(r->rows, columns, r->starts, r->indices, r->values);
}

/* out [rows] (long double) = M x, or to [columns] += M'y. Plain loops, for generators and checks. */
static inline long double qp_scene_dot(const batten_matrix *m, size_t i, const double *x) {
  long double sum = 0;
  if (m->dense)
    for (size_t j = 0; j < m->columns; j++) sum += (long double)m->dense[i * m->columns + j] * x[j];
  else
    for (size_t e = m->starts[i]; e < m->starts[i + 1]; e++) sum += (long double)m->values[e] * x[m->indices[e]];
  return sum;
}
static inline void qp_scene_add(const batten_matrix *m, size_t i, long double factor, long double *to) {
  if (m->dense)
    for (size_t j = 0; j < m->columns; j++) to[j] += factor * m->dense[i * m->columns + j];
  else
    for (size_t e = m->starts[i]; e < m->starts[i + 1]; e++) to[m->indices[e]] += factor * m->values[e];
}

/* ---- random problems with a known solution ------------------------------------------------------------------- */

typedef struct qp_scene_spec {
  uint64_t seed;
  size_t n, m;
  double condition;  /* of the Hessian P, on what is not its null space */
  size_t null;       /* dimensions of that: semidefinite */
  size_t equalities; /* rows */
  size_t active;     /* rows that hold with equality beside them; more than n is a degenerate vertex */
  size_t bounded;    /* unknowns that stand at a bound */
  bool bounds;       /* all other unknowns have bounds too */
  bool lsq;          /* the objective as least squares, else as Hessian */
  bool sparse;       /* rows of at most 8 entries */
  bool two_sided;
  bool weak; /* an eighth of the active rows has multiplier 0 */
} qp_scene_spec;

/* What makes an orthogonal matrix here: a few reflections I - 2 v v'. */
enum { QP_SCENE_REFLECTIONS = 4 };

static inline void qp_scene_unit_vectors(uint64_t *seed, size_t n, double *v) {
  for (size_t q = 0; q < QP_SCENE_REFLECTIONS; q++, v += n) {
    double square = 0;
    for (size_t j = 0; j < n; j++) v[j] = 2 * scene_uniform(seed) - 1, square += v[j] * v[j];
    for (size_t j = 0; j < n; j++) v[j] /= sqrt(square);
  }
}
/* x := Q x, or Q'x. */
static inline void qp_scene_reflect(size_t n, const double *v, bool transposed, double *x) {
  for (size_t q = 0; q < QP_SCENE_REFLECTIONS; q++) {
    const double *u = v + n * (transposed ? QP_SCENE_REFLECTIONS - 1 - q : q);
    double dot = 0;
    for (size_t j = 0; j < n; j++) dot += u[j] * x[j];
    for (size_t j = 0; j < n; j++) x[j] -= 2 * dot * u[j];
  }
}

/* Rows, sides and multipliers about the solution s->x; all products and sums are exact. */
static inline void qp_scene_random_rows(qp_scene *s, const qp_scene_spec *spec, uint64_t *seed) {
  size_t n = spec->n, m = spec->m, most = n < 8 ? n : 8;
  if (spec->sparse) {
    qp_scene_rows r = qp_scene_rows_new(s, m, m * most);
    bool *taken = qp_scene_array(s, n, sizeof *taken);
    for (size_t i = 0; i < m; i++) {
      qp_scene_row_begin(&r);
      for (size_t left = 1 + qp_scene_pick(seed, most); left > 0; left--) {
        size_t j = qp_scene_pick(seed, n);
        if (!taken[j]) qp_scene_entry(&r, j, qp_scene_short(seed) + (scene_uniform(seed) < 0.5 ? 2 : -2));
        taken[j] = true;
      }
      qp_scene_row_end(&r);
      for (size_t e = r.starts[i]; e < r.starts[i + 1]; e++) taken[r.indices[e]] = false;
    }
    s->c = qp_scene_rows_matrix(&r, n);
  } else {
    double *dense = qp_scene_array(s, m * n, sizeof *dense);
    for (size_t i = 0; i < m * n; i++) dense[i] = qp_scene_short(seed);
    s->c = batten_matrix_dense(m, n, dense);
  }
  double *lower = qp_scene_array(s, m, sizeof *lower), *upper = qp_scene_array(s, m, sizeof *upper);
  for (size_t i = 0; i < m; i++) {
    double value = (double)qp_scene_dot(&s->c, i, s->x);
    double below = ldexp(1 + (double)qp_scene_pick(seed, 16), -(int)qp_scene_pick(seed, 12));
    double above = ldexp(1 + (double)qp_scene_pick(seed, 16), -(int)qp_scene_pick(seed, 12));
    bool equality = i < spec->equalities, active = !equality && i < spec->equalities + spec->active;
    bool at_upper = scene_uniform(seed) < 0.5;
    double y = (double)(1 + qp_scene_pick(seed, 256)) / 256;
    if (active && spec->weak && i % 8 == 0) y = 0;
    lower[i] = spec->two_sided || !at_upper ? value - below : -INFINITY;
    upper[i] = spec->two_sided || at_upper ? value + above : INFINITY;
    if (equality) lower[i] = upper[i] = value, s->y[i] = at_upper ? -y : y;
    if (active && at_upper) upper[i] = value, s->y[i] = -y;
    if (active && !at_upper) lower[i] = value, s->y[i] = y;
  }
  s->problem.c = &s->c;
  s->problem.lower = lower;
  s->problem.upper = upper;
}

static inline void qp_scene_random_bounds(qp_scene *s, const qp_scene_spec *spec, uint64_t *seed) {
  if (!spec->bounds && !spec->bounded) return;
  size_t n = spec->n;
  double *lower = qp_scene_array(s, n, sizeof *lower), *upper = qp_scene_array(s, n, sizeof *upper);
  for (size_t j = 0; j < n; j++) {
    bool at_upper = scene_uniform(seed) < 0.5, is_bounded = spec->bounds || j < spec->bounded;
    double room = ldexp(1, -(int)qp_scene_pick(seed, 8)), y = (double)(1 + qp_scene_pick(seed, 256)) / 256;
    lower[j] = is_bounded ? s->x[j] - room : -INFINITY;
    upper[j] = is_bounded ? s->x[j] + room : INFINITY;
    if (j >= spec->bounded) continue;
    (at_upper ? upper : lower)[j] = s->x[j];
    s->y[spec->m + j] = at_upper ? -y : y;
  }
  s->problem.x_lower = lower;
  s->problem.x_upper = upper;
}

/* Singular values of the objective's root: 1 down to condition^-1/2, the last `null` of them 0. */
static inline double qp_scene_singular(const qp_scene_spec *spec, size_t j) {
  size_t rank = spec->n - spec->null;
  if (j >= rank) return 0;
  return rank > 1 ? pow(spec->condition, -0.5 * (double)j / (double)(rank - 1)) : 1;
}

/* P = Q D Q', g = target - P x. */
static inline void qp_scene_random_hessian(qp_scene *s, const qp_scene_spec *spec, const long double *target,
                                           uint64_t *seed) {
  size_t n = spec->n;
  double *v = qp_scene_array(s, n * QP_SCENE_REFLECTIONS, sizeof *v), *h = qp_scene_array(s, n * n, sizeof *h);
  double *g = qp_scene_array(s, n, sizeof *g);
  qp_scene_unit_vectors(seed, n, v);
  for (size_t j = 0; j < n; j++) {
    double d = qp_scene_singular(spec, j);
    h[j * n + j] = d * d;
    qp_scene_reflect(n, v, false, h + j * n); /* row j of D Q' */
  }
  double *column = qp_scene_array(s, n, sizeof *column);
  for (size_t j = 0; j < n; j++) {
    for (size_t i = 0; i < n; i++) column[i] = h[i * n + j];
    qp_scene_reflect(n, v, false, column);
    for (size_t i = 0; i < n; i++) h[i * n + j] = column[i];
  }
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < i; j++) h[j * n + i] = h[i * n + j];
  s->h = batten_matrix_dense(n, n, h);
  s->problem.h = &s->h;
  for (size_t j = 0; j < n; j++) g[j] = (double)(target[j] - qp_scene_dot(&s->h, j, s->x));
  s->problem.g = g;
}

/* A = U D V'. Where A has full rank, b = A x - U D^-1 V' target and there is no g; else b = A x - r and g makes up.
 */
static inline void qp_scene_random_lsq(qp_scene *s, const qp_scene_spec *spec, const long double *target,
                                       uint64_t *seed) {
  size_t n = spec->n, k = n + qp_scene_pick(seed, n + 1);
  double *u = qp_scene_array(s, k * QP_SCENE_REFLECTIONS, sizeof *u), *a = qp_scene_array(s, k * n, sizeof *a);
  double *v = qp_scene_array(s, n * QP_SCENE_REFLECTIONS, sizeof *v), *b = qp_scene_array(s, k, sizeof *b);
  double *column = qp_scene_array(s, k, sizeof *column);
  qp_scene_unit_vectors(seed, k, u);
  qp_scene_unit_vectors(seed, n, v);
  for (size_t j = 0; j < n; j++) {
    a[j * n + j] = qp_scene_singular(spec, j);
    qp_scene_reflect(n, v, false, a + j * n);
  }
  for (size_t j = 0; j < n; j++) {
    for (size_t i = 0; i < k; i++) column[i] = a[i * n + j];
    qp_scene_reflect(k, u, false, column);
    for (size_t i = 0; i < k; i++) a[i * n + j] = column[i];
  }
  s->a = batten_matrix_dense(k, n, a);
  s->problem.a = &s->a;
  s->problem.b = b;
  for (size_t i = 0; i < k; i++) column[i] = i < n ? (double)target[i] : 0;
  qp_scene_reflect(n, v, true, column);
  for (size_t j = 0; j < n; j++)
    column[j] = spec->null ? scene_uniform(seed) : column[j] / qp_scene_singular(spec, j);
  qp_scene_reflect(k, u, false, column);
  for (size_t i = 0; i < k; i++) b[i] = (double)(qp_scene_dot(&s->a, i, s->x) - column[i]);
  if (!spec->null) return;
  double *g = qp_scene_array(s, n, sizeof *g);
  long double *sum = qp_scene_array(s, n, sizeof *sum);
  for (size_t i = 0; i < k; i++) qp_scene_add(&s->a, i, qp_scene_dot(&s->a, i, s->x) - b[i], sum);
  for (size_t j = 0; j < n; j++) g[j] = (double)(target[j] - sum[j]);
  s->problem.g = g;
}

static inline qp_scene *qp_scene_random(const qp_scene_spec *spec) {
  qp_scene *s = qp_scene_new(spec->n);
  uint64_t seed = spec->seed;
  size_t n = spec->n, m = spec->m;
  s->x = qp_scene_array(s, n, sizeof *s->x);
  s->y = qp_scene_array(s, m + n, sizeof *s->y);
  for (size_t j = 0; j < n; j++) s->x[j] = qp_scene_short(&seed);
  qp_scene_random_rows(s, spec, &seed);
  qp_scene_random_bounds(s, spec, &seed);
  long double *target = qp_scene_array(s, n, sizeof *target);
  for (size_t i = 0; i < m; i++) qp_scene_add(&s->c, i, s->y[i], target);
  for (size_t j = 0; j < n; j++) target[j] += s->y[m + j];
  if (spec->lsq)
    qp_scene_random_lsq(s, spec, target, &seed);
  else
    qp_scene_random_hessian(s, spec, target, &seed);
  return s;
}

/* The problem of a number: n from 2 to most_n and m to most_m (both more often small), condition 1 to 1e10, and a
 * mixture of all kinds. A twentieth is semidefinite. */
static inline qp_scene_spec qp_scene_spec_random(uint64_t number, size_t most_n, size_t most_m) {
  uint64_t seed = number * 0x9e3779b97f4a7c15u + 1;
  qp_scene_spec p = {.seed = number};
  double u = scene_uniform(&seed), w = scene_uniform(&seed);
  p.n = (size_t)(2 * pow((double)(most_n + 1) / 2, u * u));
  double least = 1 + (double)p.n / 2;
  p.m = (size_t)(least * pow(fmax((double)most_m / least, 1), w * w));
  p.condition = pow(10, 10 * scene_uniform(&seed));
  p.lsq = scene_uniform(&seed) < 0.5;
  p.sparse = p.m * p.n > 2000000 || scene_uniform(&seed) < 0.4;
  p.two_sided = scene_uniform(&seed) < 0.3;
  p.bounds = scene_uniform(&seed) < 0.3;
  p.weak = scene_uniform(&seed) < 0.3;
  if (scene_uniform(&seed) < 0.05) p.null = 1 + qp_scene_pick(&seed, p.n / 2);
  if (scene_uniform(&seed) < 0.3) p.equalities = qp_scene_pick(&seed, p.n / 2 + 1);
  if (p.equalities > p.m) p.equalities = p.m;
  size_t rest = p.m - p.equalities, free_n = p.n - p.equalities;
  size_t most = scene_uniform(&seed) < 0.15 ? 3 * p.n : free_n; /* beyond n: a degenerate vertex */
  p.active = qp_scene_pick(&seed, (most < rest ? most : rest) + 1);
  if (scene_uniform(&seed) < 0.3 && p.active < free_n) p.bounded = qp_scene_pick(&seed, free_n - p.active + 1);
  return p;
}

/* ---- convex Bezier patch ------------------------------------------------------------------------------------- */

/* Bidegree (3, 3), control points b[4 i + j], unknowns 3 (4 i + j) + coordinate. For each box of a grid the first
 * derivatives must stay in two cones, and for each extreme normal of these the second fundamental form must be
 * positive along P pairs of neighbouring directions: all linear and homogeneous. */
typedef struct qp_patch_map {
  double s[4][4], d1[3][4], d1_raised[4][4],
      d2_raised[4][4]; /* Bezier points and derivatives on [a, b], raised to 3 */
} qp_patch_map;

static inline qp_patch_map qp_patch_map_new(double a, double b) {
  qp_patch_map m;
  for (int k = 0; k < 4; k++) {
    double p[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
    for (int r = 0; r < 3; r++)
      for (int j = 0; j + r < 3; j++)
        for (int c = 0; c < 4; c++) p[j][c] += (r < k ? b : a) * (p[j + 1][c] - p[j][c]);
    memcpy(m.s[k], p[0], sizeof m.s[k]);
  }
  for (int c = 0; c < 4; c++) {
    for (int k = 0; k < 3; k++) m.d1[k][c] = 3 * (m.s[k + 1][c] - m.s[k][c]);
    double d2[2] = {2 * (m.d1[1][c] - m.d1[0][c]), 2 * (m.d1[2][c] - m.d1[1][c])};
    for (int k = 0; k < 4; k++) {
      m.d1_raised[k][c] = (k > 0 ? k * m.d1[k - 1][c] : 0) / 3 + (k < 3 ? (3 - k) * m.d1[k][c] : 0) / 3;
      m.d2_raised[k][c] = ((3 - k) * d2[0] + k * d2[1]) / 3;
    }
  }
  return m;
}

static inline void qp_patch_cross(const double *a, const double *b, double *out) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}
static inline double qp_patch_dot(const double *a, const double *b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
static inline void qp_patch_normalise(double *a) {
  double length = sqrt(qp_patch_dot(a, a));
  for (int c = 0; c < 3; c++) a[c] /= length;
}

/* Coefficients of (one row for u) x (one row for v), and their vector on a net. */
static inline void qp_patch_weights(const double *u, const double *v, double *w) {
  for (int i = 0; i < 4; i++)
    for (int j = 0; j < 4; j++) w[4 * i + j] = u[i] * v[j];
}
static inline void qp_patch_vector(const double *w, const double *net, double *out) {
  for (int c = 0; c < 3; c++) {
    out[c] = 0;
    for (int p = 0; p < 16; p++) out[c] += w[p] * net[3 * p + c];
  }
}

/* A pyramid about a family of vectors: axis, four facets, four rays. */
typedef struct qp_patch_cone {
  double facet[4][3], ray[4][3];
} qp_patch_cone;

static inline bool qp_patch_cone_new(size_t count, double (*vectors)[3], const double *g, double delta,
                                     qp_patch_cone *out) {
  double axis[3] = {0}, f[2][3], low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
  for (size_t i = 0; i < count; i++)
    for (int c = 0; c < 3; c++) axis[c] += vectors[i][c];
  qp_patch_normalise(axis);
  for (int c = 0; c < 3; c++) f[0][c] = g[c] - qp_patch_dot(g, axis) * axis[c];
  qp_patch_normalise(f[0]);
  qp_patch_cross(axis, f[0], f[1]);
  for (size_t i = 0; i < count; i++) {
    double along = qp_patch_dot(vectors[i], axis);
    if (!(along > 0)) return false;
    for (int q = 0; q < 2; q++) {
      low[q] = fmin(low[q], qp_patch_dot(vectors[i], f[q]) / along - delta);
      high[q] = fmax(high[q], qp_patch_dot(vectors[i], f[q]) / along + delta);
    }
  }
  for (int q = 0; q < 2; q++)
    for (int c = 0; c < 3; c++) {
      out->facet[2 * q][c] = f[q][c] - low[q] * axis[c];
      out->facet[2 * q + 1][c] = high[q] * axis[c] - f[q][c];
    }
  for (int k = 0; k < 4; k++)
    for (int c = 0; c < 3; c++)
      out->ray[k][c] = axis[c] + (k & 1 ? high : low)[0] * f[0][c] + (k & 2 ? high : low)[1] * f[1][c];
  return true;
}

/* Extreme rays of the cone of all cross products: vertices of the convex hull (gift wrapping) of their central
 * projection along g. Returns how many, 0 if a product points away from g. */
static inline size_t qp_patch_normals(const qp_patch_cone *u, const qp_patch_cone *v, const double *g,
                                      double (*out)[3]) {
  double all[16][3], flat[16][2], e[2][3], help[3] = {fabs(g[0]) < 0.5, fabs(g[0]) >= 0.5, 0};
  qp_patch_cross(g, help, e[0]);
  qp_patch_normalise(e[0]);
  qp_patch_cross(g, e[0], e[1]);
  size_t first = 0, count = 0;
  for (size_t k = 0; k < 16; k++) {
    qp_patch_cross(u->ray[k / 4], v->ray[k % 4], all[k]);
    double height = qp_patch_dot(all[k], g);
    if (!(height > 0)) return 0;
    for (int c = 0; c < 3; c++) all[k][c] /= height;
    for (int q = 0; q < 2; q++) flat[k][q] = qp_patch_dot(all[k], e[q]);
    if (flat[k][0] < flat[first][0]) first = k;
  }
  size_t at = first;
  do {
    memcpy(out[count++], all[at], sizeof *out);
    size_t next = at == 0 ? 1 : 0;
    for (size_t k = 0; k < 16; k++) {
      double ax = flat[next][0] - flat[at][0], ay = flat[next][1] - flat[at][1];
      double bx = flat[k][0] - flat[at][0], by = flat[k][1] - flat[at][1];
      double turn = ax * by - ay * bx, near = 1e-9 * (ax * ax + ay * ay + bx * bx + by * by);
      if (turn < -near || (turn <= near && bx * bx + by * by > ax * ax + ay * ay)) next = k;
    }
    at = next;
  } while (at != first && count < 16);
  return count;
}

/* Appends direction (x) weights at unit length. */
static inline void qp_patch_row(const double *w, const double *direction, double sign, double *row) {
  double square = 0;
  for (int p = 0; p < 16; p++)
    for (int c = 0; c < 3; c++) {
      row[3 * p + c] = sign * w[p] * direction[c];
      square += row[3 * p + c] * row[3 * p + c];
    }
  for (int e = 0; e < 48; e++) row[e] /= sqrt(square);
}

/* Directions of the form's rows in the metric of its mean: z_a = M^-1/2 (cos, sin)(a pi / P). False if M is not
 * definite. */
static inline bool qp_patch_metric(const double *mean, double *root, double *sign) {
  double a = mean[0], b = mean[1], d = mean[2], det = a * d - b * b;
  *sign = a > 0 ? 1 : -1;
  if (!(det > 0)) return false;
  double s = sqrt(det), t = sqrt(fabs(a + d) + 2 * s);
  double ra = (fabs(a) + s) / t, rb = *sign * b / t, rd = (fabs(d) + s) / t; /* root of sign M */
  double inverse = 1 / (ra * rd - rb * rb);
  root[0] = rd * inverse, root[1] = -rb * inverse, root[2] = ra * inverse;
  return true;
}

/* Rows of one box into rows [..][48]; the least value of the form's rows at the net (1 = that of the mean) in *least.
 */
static inline size_t qp_patch_box(const double *net, const qp_patch_map *u, const qp_patch_map *v, size_t directions,
                                  double delta, double *rows, double *least) {
  double w[16], xu[12][3], xv[12][3], g[3], mu[3] = {0}, mv[3] = {0}, normals[16][3];
  for (size_t k = 0; k < 12; k++) {
    qp_patch_weights(u->d1[k / 4], v->s[k % 4], w);
    qp_patch_vector(w, net, xu[k]);
    qp_patch_weights(u->s[k % 4], v->d1[k / 4], w);
    qp_patch_vector(w, net, xv[k]);
    for (int c = 0; c < 3; c++) mu[c] += xu[k][c], mv[c] += xv[k][c];
  }
  qp_patch_cross(mu, mv, g);
  qp_patch_normalise(g);
  qp_patch_cone cu, cv;
  if (!qp_patch_cone_new(12, xu, g, delta, &cu) || !qp_patch_cone_new(12, xv, g, delta, &cv)) return 0;
  size_t count = 0, sides = qp_patch_normals(&cu, &cv, g, normals);
  for (size_t k = 0; k < 12; k++)
    for (size_t f = 0; f < 4; f++, count += 2) {
      qp_patch_weights(u->d1[k / 4], v->s[k % 4], w);
      qp_patch_row(w, cu.facet[f], 1, rows + 48 * count);
      qp_patch_weights(u->s[k % 4], v->d1[k / 4], w);
      qp_patch_row(w, cv.facet[f], 1, rows + 48 * (count + 1));
    }
  double mean[3] = {0}, root[3], sign, part = 1 / (double)(16 * sides), step = SCENE_PI / (double)directions;
  double form[16][3][16]; /* of each coefficient: uu, uv, vv */
  for (size_t rs = 0; rs < 16; rs++) {
    qp_patch_weights(u->d2_raised[rs / 4], v->s[rs % 4], form[rs][0]);
    qp_patch_weights(u->d1_raised[rs / 4], v->d1_raised[rs % 4], form[rs][1]);
    qp_patch_weights(u->s[rs / 4], v->d2_raised[rs % 4], form[rs][2]);
    for (size_t t = 0; t < sides; t++)
      for (int q = 0; q < 3; q++) {
        double value[3];
        qp_patch_vector(form[rs][q], net, value);
        mean[q] += part * qp_patch_dot(value, normals[t]);
      }
  }
  if (!sides || !qp_patch_metric(mean, root, &sign)) return 0;
  for (size_t a = 0; a < directions; a++) {
    double c0 = cos((double)a * step), s0 = sin((double)a * step);
    double c1 = cos((double)(a + 1) * step), s1 = sin((double)(a + 1) * step);
    double z[2] = {root[0] * c0 + root[1] * s0, root[1] * c0 + root[2] * s0};
    double y[2] = {root[0] * c1 + root[1] * s1, root[1] * c1 + root[2] * s1};
    for (size_t rs = 0; rs < 16; rs++)
      for (size_t t = 0; t < sides; t++, count++) {
        double value[3];
        for (int p = 0; p < 16; p++)
          w[p] = z[0] * y[0] * form[rs][0][p] + (z[0] * y[1] + z[1] * y[0]) * form[rs][1][p] +
                 z[1] * y[1] * form[rs][2][p];
        qp_patch_vector(w, net, value);
        *least = fmin(*least, sign * qp_patch_dot(value, normals[t]) / cos(step));
        qp_patch_row(w, normals[t], sign, rows + 48 * count);
      }
  }
  return count;
}

/* The strictly convex net that rows are made from: a bowl whose parameter lines are bent a little. */
static inline void qp_patch_net(double *net) {
  for (int i = 0; i < 4; i++)
    for (int j = 0; j < 4; j++) {
      double u = i / 3., v = j / 3., *p = net + 3 * (4 * i + j);
      p[0] = u + 0.05 * v * v;
      p[1] = v + 0.04 * u * u;
      p[2] = 0.3 * (u - 0.4) * (u - 0.4) + 0.25 * (v - 0.5) * (v - 0.5) + 0.05 * u * v;
    }
}

/* Boxes in u and v, and P: 352, 2,496, 9,856 and 27,104 rows. */
static const size_t qp_patch_sizes[4][3] = {{1, 1, 4}, {2, 3, 5}, {4, 7, 4}, {7, 11, 4}};

/* Samples [side][side] of a surface that is convex but flat along a curve, with noise: the best fit without rows is
 * not convex. hessian: A'A and -A'b instead of A and b. */
static inline qp_scene *qp_scene_patch(size_t size, bool hessian, uint64_t seed) {
  enum { SIDE = 20, N = 48, DELTAS = 7 };
  static const double deltas[DELTAS] = {1, .5, .25, .12, .06, .03, .015};
  const double ENOUGH = 0.15, NOISE = 0.02;
  size_t gu = qp_patch_sizes[size][0], gv = qp_patch_sizes[size][1], directions = qp_patch_sizes[size][2];
  size_t room = gu * gv * (96 + 16 * 16 * directions), m = 0;
  qp_scene *s = qp_scene_new(N);
  double *rows = qp_scene_array(s, room * N, sizeof *rows);
  s->start = qp_scene_array(s, N, sizeof *s->start);
  qp_patch_net(s->start);
  for (size_t iu = 0; iu < gu; iu++)
    for (size_t iv = 0; iv < gv; iv++) {
      qp_patch_map u = qp_patch_map_new((double)iu / (double)gu, (double)(iu + 1) / (double)gu);
      qp_patch_map v = qp_patch_map_new((double)iv / (double)gv, (double)(iv + 1) / (double)gv);
      for (size_t d = 0; d < DELTAS; d++) {
        double least = INFINITY;
        size_t count = qp_patch_box(s->start, &u, &v, directions, deltas[d], rows + N * m, &least);
        if (count == 0 || least < ENOUGH) continue;
        m += count;
        break;
      }
    }
  s->c = batten_matrix_dense(m, N, rows);
  s->problem.c = &s->c;
  s->problem.lower = qp_scene_array(s, m, sizeof(double));

  qp_scene_rows a = qp_scene_rows_new(s, 3 * SIDE * SIDE, 3 * SIDE * SIDE * 16);
  double *b = qp_scene_array(s, 3 * SIDE * SIDE, sizeof *b);
  for (size_t k = 0; k < 3 * SIDE * SIDE; k++) {
    double u = (double)(k / 3 / SIDE) / (SIDE - 1), v = (double)(k / 3 % SIDE) / (SIDE - 1), w[16];
    qp_patch_map at_u = qp_patch_map_new(u, u), at_v = qp_patch_map_new(v, v);
    double across = u - 0.5 + 0.3 * (v - 0.5), height = 0.35 * across * across;
    double point[3] = {u + 0.03 * v * v, v, height};
    qp_patch_weights(at_u.s[0], at_v.s[0], w);
    qp_scene_row_begin(&a);
    for (size_t p = 0; p < 16; p++) qp_scene_entry(&a, 3 * p + k % 3, w[p]);
    qp_scene_row_end(&a);
    b[k] = point[k % 3] + NOISE * (2 * scene_uniform(&seed) - 1);
  }
  s->a = qp_scene_rows_matrix(&a, N);
  if (!hessian) {
    s->problem.a = &s->a;
    s->problem.b = b;
    return s;
  }
  double *h = qp_scene_array(s, N * N, sizeof *h), *g = qp_scene_array(s, N, sizeof *g);
  for (size_t i = 0; i < s->a.rows; i++)
    for (size_t e = a.starts[i]; e < a.starts[i + 1]; e++) {
      g[a.indices[e]] -= a.values[e] * b[i];
      for (size_t f = a.starts[i]; f < a.starts[i + 1]; f++)
        h[a.indices[e] * N + a.indices[f]] += a.values[e] * a.values[f];
    }
  s->h = batten_matrix_dense(N, N, h);
  s->problem.h = &s->h;
  s->problem.g = g;
  return s;
}

/* ---- planar curve that keeps turning left -------------------------------------------------------------------- */

/* Uniform cubic spline, control points d_0 .. d_{N-1} (unknowns x_0, y_0, x_1, ...), reference a spiral whose legs of
 * length one turn by 0.1 to 0.2 each. On each span the Bezier legs D1 must lie between u and v, and the second
 * differences D2 between v and -u [Juettler, the lemma on linear sufficient conditions]: after what is redundant has
 * gone, 6 rows of 8 entries. */

/* The weights of d_s .. d_{s+3} in: Bezier legs 0 .. 2, second differences 0, 1. */
static const double qp_curve_legs[5][4] = {{-1. / 6, 0, 1. / 6, 0},
                                           {0, -1. / 3, 1. / 3, 0},
                                           {0, -1. / 6, 0, 1. / 6},
                                           {1. / 6, -1. / 3, 1. / 6, 0},
                                           {0, 1. / 6, -1. / 3, 1. / 6}};

static inline double qp_curve_angle(const double *weights, const double *points) {
  double x = 0, y = 0;
  for (int i = 0; i < 4; i++) x += weights[i] * points[2 * i], y += weights[i] * points[2 * i + 1];
  return atan2(y, x);
}
/* The representative of an angle that lies within pi of another. */
static inline double qp_curve_near(double angle, double other) {
  return angle - 2 * SCENE_PI * round((angle - other) / (2 * SCENE_PI));
}
/* Row of sign [w, A d], w the unit vector at an angle. */
static inline void qp_curve_row(qp_scene_rows *r, size_t first, const double *weights, double angle, double sign) {
  qp_scene_row_begin(r);
  for (size_t i = 0; i < 4; i++) {
    if (weights[i] == 0) continue;
    qp_scene_entry(r, 2 * (first + i), -sign * sin(angle) * weights[i]);
    qp_scene_entry(r, 2 * (first + i) + 1, sign * cos(angle) * weights[i]);
  }
  qp_scene_row_end(r);
}

static inline qp_scene *qp_scene_curve(size_t controls, double noise, uint64_t seed) {
  enum { SAMPLES = 3 };
  size_t n = 2 * controls, spans = controls - 3;
  qp_scene *s = qp_scene_new(n);
  s->start = qp_scene_array(s, n, sizeof *s->start);
  double heading = 0;
  for (size_t j = 1; j < controls; j++) {
    s->start[2 * j] = s->start[2 * j - 2] + cos(heading);
    s->start[2 * j + 1] = s->start[2 * j - 1] + sin(heading);
    heading += 0.15 + 0.05 * sin(0.1 * (double)j);
  }
  qp_scene_rows c = qp_scene_rows_new(s, 6 * spans, 6 * spans * 8);
  for (size_t i = 0; i < spans; i++) {
    const double *p = s->start + 2 * i;
    double mean = qp_curve_angle(qp_curve_legs[1], p), theta[2] = {INFINITY, -INFINITY},
           phi[2] = {INFINITY, -INFINITY};
    for (int k = 0; k < 5; k++) {
      double *range = k < 3 ? theta : phi;
      double angle = qp_curve_near(qp_curve_angle(qp_curve_legs[k], p), mean + (k < 3 ? 0 : SCENE_PI / 2));
      range[0] = fmin(range[0], angle);
      range[1] = fmax(range[1], angle);
    }
    double v = (theta[1] + phi[0]) / 2, u = (theta[0] + phi[1] - SCENE_PI) / 2;
    qp_curve_row(&c, i, qp_curve_legs[0], u, 1);  /* [u, D1_0] >= 0 */
    qp_curve_row(&c, i, qp_curve_legs[2], v, -1); /* [D1_2, v] >= 0 */
    for (int k = 3; k < 5; k++) {
      qp_curve_row(&c, i, qp_curve_legs[k], v, 1);
      qp_curve_row(&c, i, qp_curve_legs[k], u, 1);
    }
  }
  s->c = qp_scene_rows_matrix(&c, n);
  s->problem.c = &s->c;
  s->problem.lower = qp_scene_array(s, c.rows, sizeof(double));

  qp_scene_rows a = qp_scene_rows_new(s, 2 * SAMPLES * spans, 8 * SAMPLES * spans);
  double *b = qp_scene_array(s, 2 * SAMPLES * spans, sizeof *b);
  for (size_t k = 0; k < 2 * SAMPLES * spans; k++) {
    size_t i = k / 2 / SAMPLES;
    double t = ((double)(k / 2 % SAMPLES) + 0.5) / SAMPLES, r = 1 - t, value = noise * (2 * scene_uniform(&seed) - 1);
    double w[4] = {r * r * r / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * r * r * r - 6 * r * r + 4) / 6,
                   t * t * t / 6};
    qp_scene_row_begin(&a);
    for (size_t q = 0; q < 4; q++) {
      qp_scene_entry(&a, 2 * (i + q) + k % 2, w[q]);
      value += w[q] * s->start[2 * (i + q) + k % 2];
    }
    qp_scene_row_end(&a);
    b[k] = value;
  }
  s->a = qp_scene_rows_matrix(&a, n);
  s->problem.a = &s->a;
  s->problem.b = b;
  return s;
}

/* ---- k-convex sequences -------------------------------------------------------------------------------------- */

/* min 1/2 |x - data|^2, k-th differences >= 0, 1 <= k <= 5. The powers 0, 1, .. k of the index, the last with a
 * positive factor, are strictly feasible. */
static inline qp_scene *qp_scene_convex(size_t n, size_t k, double noise, uint64_t seed) {
  qp_scene *s = qp_scene_new(n);
  qp_scene_rows c = qp_scene_rows_new(s, n - k, (n - k) * (k + 1)), h = qp_scene_rows_new(s, n, n);
  for (size_t i = 0; i + k < n; i++) {
    double binomial = k % 2 ? -1 : 1;
    qp_scene_row_begin(&c);
    for (size_t j = 0; j <= k; j++) {
      qp_scene_entry(&c, i + j, binomial);
      binomial *= -(double)(k - j) / (double)(j + 1);
    }
    qp_scene_row_end(&c);
  }
  double *g = qp_scene_array(s, n, sizeof *g);
  s->start = qp_scene_array(s, n, sizeof *s->start);
  for (size_t i = 0; i < n; i++) {
    double t = (double)i / (double)(n - 1);
    g[i] = -(exp(t) + noise * (2 * scene_uniform(&seed) - 1));
    s->start[i] = pow(t, (double)k);
    qp_scene_row_begin(&h);
    qp_scene_entry(&h, i, 1);
    qp_scene_row_end(&h);
  }
  s->h = qp_scene_rows_matrix(&h, n);
  s->c = qp_scene_rows_matrix(&c, n);
  s->problem.h = &s->h;
  s->problem.g = g;
  s->problem.c = &s->c;
  s->problem.lower = qp_scene_array(s, n - k, sizeof(double));
  return s;
}

#endif
