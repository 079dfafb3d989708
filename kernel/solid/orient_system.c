/* The matrix of least energy.
 *
 * Given gradients g at the points, let f minimise the spline energy |f|^2 of the kernel r^3 (native norm: a' K a for
 * the coefficients) plus (1 / lambda) sum f(x_i)^2, under grad f(x_i) = g_i, up to linear functions that cost
 * nothing. The minimum is g' M g. The usual way to M goes through the Hermite matrix of all (n + 1) N unknowns
 *
 *     [ V + lambda I   W    P ]  a        V_ij  = phi(x_i - x_j)           phi(x) = |x|^3
 *     [      W'       -H    E ]  b        W_ij  = -grad phi(x_i - x_j)     P_i = (1, x_i')
 *     [      P'        E'   0 ]  c        H_ij  = Hessian of phi           E_i = (0, I)
 *
 * Here values and polynomial are eliminated instead, of which only a system of N is lambda's business. With
 * d = -P (P'P)^-1 [0; I] the side condition P'a + E'b = 0 is a = Z u + d sum b_j, with Z an orthonormal basis
 * of null(P'), and
 *
 *     M = S^-1,   S = -H + e_r(j,c) + e_c(i,r) + (d'V d + lambda d'd)(r,c) - Y'Y,
 *     e_r(j,c) = d_r' W(:,jc),    Y = L^-1 Z'(W + V d (1' x I)),    L L' = Z'V Z + lambda I.
 *
 * So M's smallest eigenvector is S's largest, and S is the natural preconditioner: both are kept, S in the upper
 * triangle and its Cholesky factor in the lower one. Cost of a lambda: about (n N)^2 N + (n N)^3 / 3 flops; by way
 * of the Hermite matrix five times that. */
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "basis/eigen3.h"
#include "la/la.h"
#include "orient_energy.h"

enum { ROWS = 64 }; /* points to a task */

static void difference(const batten_orient_system *s, size_t i, size_t j, double e[3], double *r) {
  double square = 0;
  for (unsigned c = 0; c < s->n; c++) {
    e[c] = s->x[i * s->n + c] - s->x[j * s->n + c];
    square += e[c] * e[c];
  }
  *r = sqrt(square);
}

static void fill_values(void *system, size_t task) {
  batten_orient_system *s = system;
  size_t end = (task + 1) * ROWS < s->count ? (task + 1) * ROWS : s->count;
  for (size_t j = task * ROWS; j < end; j++)
    for (size_t i = 0; i < s->count; i++) {
      double e[3], r;
      difference(s, i, j, e, &r);
      s->values[i + j * s->count] = r * r * r;
    }
}

/* W + V d (1' x I), and e beside it. vd [N][n]. */
static void fill_mixed(void *system, size_t task) {
  batten_orient_system *s = system;
  unsigned n = s->n;
  size_t end = (task + 1) * ROWS < s->count ? (task + 1) * ROWS : s->count;
  for (size_t j = task * ROWS; j < end; j++)
    for (unsigned c = 0; c < n; c++) {
      double *column = s->mixed + (j * n + c) * s->count, products[3] = {0};
      for (size_t i = 0; i < s->count; i++) {
        double e[3], r;
        difference(s, i, j, e, &r);
        double w = -3 * r * e[c];
        for (unsigned q = 0; q < n; q++) products[q] += s->d[i * n + q] * w;
        column[i] = w + s->vd[i * n + c];
      }
      for (unsigned q = 0; q < n; q++) s->e[q * s->size + j * n + c] = products[q];
    }
}

/* Lower triangle of S without Y'Y. */
static void fill_gradients(void *system, size_t task) {
  batten_orient_system *s = system;
  unsigned n = s->n;
  size_t end = (task + 1) * ROWS < s->count ? (task + 1) * ROWS : s->count;
  for (size_t j = task * ROWS; j < end; j++)
    for (size_t i = j; i < s->count; i++) {
      double e[3], r;
      difference(s, i, j, e, &r);
      for (unsigned c = 0; c < n; c++)
        for (unsigned q = i == j ? c : 0; q < n; q++) {
          double hessian = (q == c ? 3 * r : 0) + (r > 0 ? 3 * e[q] * e[c] / r : 0);
          s->matrix[i * n + q + (j * n + c) * s->size] = -hessian + s->e[q * s->size + j * n + c] +
                                                         s->e[c * s->size + i * n + q] + s->dvd[q * 3 + c] +
                                                         s->lambda * s->dd[q * 3 + c];
        }
    }
}

static void mirror(void *system, size_t task) {
  batten_orient_system *s = system;
  size_t n = s->size, begin = task * ROWS, end = begin + ROWS < n ? begin + ROWS : n;
  for (size_t low = 0; low < end; low += ROWS) /* tile by tile: both sides stay in cache */
    for (size_t j = low; j < low + ROWS && j < end; j++)
      for (size_t i = begin > j ? begin : j; i < end; i++) s->matrix[j + i * n] = s->matrix[i + j * n];
}

static void transpose(size_t n, double *a) {
  for (size_t j = 0; j < n; j++)
    for (size_t i = 0; i < j; i++) {
      double t = a[i + j * n];
      a[i + j * n] = a[j + i * n];
      a[j + i * n] = t;
    }
}

/* d = -P (P'P)^-1 [0; I], the centroid being at 0: -X (X'X)^-1. */
static batten_status find_d(batten_context *ctx, batten_orient_system *s) {
  unsigned n = s->n;
  double second[9] = {0}, values[3], vectors[9], inverse[9] = {0};
  for (size_t i = 0; i < s->count; i++)
    for (unsigned r = 0; r < n; r++)
      for (unsigned c = 0; c < n; c++) second[r * n + c] += s->x[i * n + r] * s->x[i * n + c];
  batten_eigen_symmetric(n, second, values, vectors);
  if (values[0] <= 1e-20 * values[n - 1])
    return batten_fail(ctx, BATTEN_E_SINGULAR, "points: the chosen %zu are flat; raise energy_points", s->count);
  for (unsigned q = 0; q < n; q++)
    for (unsigned r = 0; r < n; r++)
      for (unsigned c = 0; c < n; c++) inverse[r * n + c] += vectors[q * n + r] * vectors[q * n + c] / values[q];
  memset(s->dd, 0, sizeof s->dd);
  for (size_t i = 0; i < s->count; i++) {
    for (unsigned r = 0; r < n; r++) {
      s->d[i * n + r] = 0;
      for (unsigned c = 0; c < n; c++) s->d[i * n + r] -= inverse[r * n + c] * s->x[i * n + c];
    }
    for (unsigned r = 0; r < n; r++)
      for (unsigned c = 0; c < n; c++) s->dd[r * 3 + c] += s->d[i * n + r] * s->d[i * n + c];
  }
  return BATTEN_OK;
}

/* values := Q'V Q, mixed := Q'(W + V d), Q from P = Q R: rows and columns from n + 1 on are those of Z. */
static batten_status project(batten_context *ctx, batten_orient_system *s) {
  size_t N = s->count, k = s->n + 1;
  double *p = s->reflectors, *tau = s->tau;
  for (size_t i = 0; i < N; i++) {
    p[i] = 1;
    for (unsigned c = 0; c < s->n; c++) p[i + (c + 1) * N] = s->x[i * s->n + c];
  }
  batten_status status = batten_la_geqrf(ctx, N, k, p, N, tau);
  if (status < 0) return status;
  if ((status = batten_la_ormqr(ctx, 'T', N, s->size, k, p, N, tau, s->mixed, N)) < 0) return status;
  if ((status = batten_la_ormqr(ctx, 'T', N, N, k, p, N, tau, s->values, N)) < 0) return status;
  transpose(N, s->values);
  return batten_la_ormqr(ctx, 'T', N, N, k, p, N, tau, s->values, N);
}

void batten_orient_system_free(batten_context *ctx, batten_orient_system *s) {
  double *blocks[] = {s->x,      s->d, s->vd,     s->e,        s->values,    s->mixed,
                      s->factor, s->y, s->matrix, s->diagonal, s->reflectors};
  for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) batten_free(ctx, blocks[i]);
  *s = (batten_orient_system){0};
}

batten_status batten_orient_system_new(batten_context *ctx, unsigned n, size_t count, const double *points,
                                       batten_orient_system *out) {
  batten_orient_system s = {.n = n, .count = count};
  batten_status status = BATTEN_E_TOO_LARGE;
  size_t N = count, bytes;
  if (!batten_mul(N, n, &s.size) || !batten_la_fits(s.size) || !batten_mul3(s.size, s.size, sizeof(double), &bytes)) {
    batten_fail(ctx, status, "energy_points: %zu points at a time; lower it", N);
    goto done;
  }
  status = BATTEN_E_NOMEM;
  if (!(s.x = batten_alloc_array(ctx, s.size, sizeof *s.x)) ||
      !(s.d = batten_alloc_array(ctx, s.size, sizeof *s.d)) ||
      !(s.vd = batten_alloc_array(ctx, s.size, sizeof *s.vd)) ||
      !(s.e = batten_alloc_array(ctx, n * s.size, sizeof *s.e)) ||
      !(s.reflectors = batten_alloc_array(ctx, N, (n + 1) * sizeof *s.reflectors)) ||
      !(s.values = batten_alloc_array(ctx, N * N, sizeof *s.values)) ||
      !(s.mixed = batten_alloc_array(ctx, N * s.size, sizeof *s.mixed)) ||
      !(s.factor = batten_alloc_array(ctx, N * N, sizeof *s.factor)) ||
      !(s.y = batten_alloc_array(ctx, N * s.size, sizeof *s.y)) || !(s.matrix = batten_alloc(ctx, bytes)) ||
      !(s.diagonal = batten_alloc_array(ctx, s.size, sizeof *s.diagonal)))
    goto done;
  for (unsigned c = 0; c < n; c++) {
    for (size_t i = 0; i < N; i++) s.middle[c] += points[i * n + c] / (double)N;
    for (size_t i = 0; i < N; i++) s.x[i * n + c] = points[i * n + c] - s.middle[c];
  }
  if ((status = find_d(ctx, &s)) < 0) goto done;
  size_t tasks = (N + ROWS - 1) / ROWS;
  batten_parallel(ctx, tasks, fill_values, &s);
  /* rows of a row-major [N][n] are columns of a column-major [n][N]: vd' = d' V */
  batten_la_gemm(BATTEN_LA_DOUBLE, 'N', 'N', n, N, N, 1, s.d, n, s.values, N, 0, s.vd, n);
  for (size_t i = 0; i < N; i++)
    for (unsigned r = 0; r < n; r++)
      for (unsigned c = 0; c < n; c++) s.dvd[r * 3 + c] += s.d[i * n + r] * s.vd[i * n + c];
  batten_parallel(ctx, tasks, fill_mixed, &s);
  status = project(ctx, &s);
done:
  if (status < 0) batten_orient_system_free(ctx, &s);
  *out = s;
  return status;
}

batten_status batten_orient_system_factor(batten_context *ctx, batten_orient_system *s, double lambda) {
  size_t N = s->count, k = s->n + 1, m = N - k;
  s->lambda = lambda;
  for (size_t j = 0; j < m; j++) {
    memcpy(s->factor + j * m, s->values + k + (k + j) * N, m * sizeof *s->factor);
    s->factor[j + j * m] += lambda;
  }
  if (batten_la_potrf(BATTEN_LA_DOUBLE, 'L', m, s->factor, m))
    return batten_fail(ctx, BATTEN_E_SINGULAR, "points: too close together to orient by energy at lambda %g", lambda);
  for (size_t j = 0; j < s->size; j++) memcpy(s->y + j * m, s->mixed + k + j * N, m * sizeof *s->y);
  batten_la_trsm(BATTEN_LA_DOUBLE, 'L', 'L', 'N', m, s->size, 1, s->factor, m, s->y, m);
  batten_parallel(ctx, (N + ROWS - 1) / ROWS, fill_gradients, s);
  batten_la_syrk(BATTEN_LA_DOUBLE, 'L', 'T', s->size, m, -1, s->y, m, 1, s->matrix, s->size);
  batten_parallel(ctx, (s->size + ROWS - 1) / ROWS, mirror, s);
  for (size_t i = 0; i < s->size; i++) s->diagonal[i] = s->matrix[i + i * s->size];
  if (batten_la_potrf(BATTEN_LA_DOUBLE, 'L', s->size, s->matrix, s->size))
    return batten_fail(ctx, BATTEN_E_SINGULAR, "points: too close together to orient by energy at lambda %g", lambda);
  return BATTEN_OK;
}

void batten_orient_system_multiply(const batten_orient_system *s, const double *v, double *sv) {
  batten_la_symv('U', s->size, 1, s->matrix, s->size, v, 0, sv);
  for (size_t i = 0; i < s->size; i++) sv[i] += (s->diagonal[i] - s->matrix[i + i * s->size]) * v[i];
}

void batten_orient_system_solve(const batten_orient_system *s, const double *g, double *mg) {
  memcpy(mg, g, s->size * sizeof *mg);
  batten_la_trsv(BATTEN_LA_DOUBLE, 'L', 'N', s->size, s->matrix, s->size, mg);
  batten_la_trsv(BATTEN_LA_DOUBLE, 'L', 'T', s->size, s->matrix, s->size, mg);
}

batten_status batten_orient_system_field(batten_context *ctx, const batten_orient_system *s, const double *g,
                                         double *a, double *b, double *c) {
  size_t N = s->count, k = s->n + 1, m = N - k;
  batten_orient_system_solve(s, g, b);
  memset(a, 0, k * sizeof *a);
  batten_la_gemv(BATTEN_LA_DOUBLE, 'N', m, s->size, -1, s->y, m, b, 0, a + k);
  batten_la_trsv(BATTEN_LA_DOUBLE, 'L', 'T', m, s->factor, m, a + k); /* u = -L^-T Y b */
  batten_status status = batten_la_ormqr(ctx, 'N', N, 1, k, s->reflectors, N, s->tau, a, N);
  if (status < 0) return status;
  double sum[3] = {0};
  for (size_t i = 0; i < s->size; i++) sum[i % s->n] += b[i];
  for (unsigned q = 0; q < s->n; q++) c[q] = 0;
  for (size_t i = 0; i < N; i++)
    for (unsigned q = 0; q < s->n; q++) a[i] += s->d[i * s->n + q] * sum[q];
  /* c = d' ((V + lambda I) a + W b) */
  for (unsigned q = 0; q < s->n; q++) {
    for (size_t i = 0; i < N; i++) c[q] += (s->vd[i * s->n + q] + s->lambda * s->d[i * s->n + q]) * a[i];
    for (size_t i = 0; i < s->size; i++) c[q] += s->e[q * s->size + i] * b[i];
  }
  return BATTEN_OK;
}
