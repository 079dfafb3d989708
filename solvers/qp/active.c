/* Factorised working set, see active.h. Single members are added and dropped by loops over contiguous columns
 * (lanes.h): at the sizes where the dense engines are best (n below 100) a call into BLAS costs more than it saves.
 * Sets that are known at once go through LAPACK. */
#include "active.h"

#include <float.h>
#include <string.h>

#include "base/checked.h"
#include "la/la.h"
#include "lanes.h"

/* Four running sums, so that the order of additions is fixed and the loop fills vector registers. */
static double dot(size_t n, const double *a, const double *b) {
  double s[4] = {0};
  size_t i = 0;
  for (; i + 4 <= n; i += 4)
    for (size_t l = 0; l < 4; l++) s[l] += a[i + l] * b[i + l];
  for (; i < n; i++) s[0] += a[i] * b[i];
  return (s[0] + s[1]) + (s[2] + s[3]);
}

static void axpy(size_t n, double factor, const double *restrict a, double *restrict to) {
  for (size_t i = 0; i < n; i++) to[i] += factor * a[i];
}

/* |a|, safe from overflow and underflow of squares. */
static double norm(size_t n, const double *a) {
  double square = dot(n, a, a), most = 0, sum = 0;
  if (square > 0x1p-900 && square < INFINITY) return sqrt(square);
  for (size_t i = 0; i < n; i++) most = fmax(most, fabs(a[i]));
  if (most == 0 || !isfinite(most)) return most;
  double unit = batten_unit(most);
  for (size_t i = 0; i < n; i++) sum += (unit * a[i]) * (unit * a[i]);
  return sqrt(sum) / unit;
}

/* ---- Life ---- */

/* Column j of R^-1 is (e_j - R^-1 r_j) / r_jj with the columns before it [LAPACK's trtri]. */
static void invert(size_t n, const double *r, double *inverse) {
  const size_t WORTH_BLAS = 192;
  memset(inverse, 0, n * n * sizeof *inverse);
  if (n >= WORTH_BLAS) {
    for (size_t j = 0; j < n; j++) inverse[j + j * n] = 1;
    batten_la_trsm(BATTEN_LA_DOUBLE, 'L', 'U', 'N', n, n, 1, r, n, inverse, n);
    return;
  }
  for (size_t j = 0; j < n; j++) {
    double unit = 1 / r[j + j * n];
    qp_lanes_now()->combine(j, j, inverse, n, -unit, r + j * n, inverse + j * n);
    inverse[j + j * n] = unit;
  }
}

batten_status qp_active_new(batten_context *ctx, const qp_dense *objective, const qp_rows *rows, qp_active *set) {
  size_t n = objective->n, square;
  *set = (qp_active){.rows = rows, .n = n};
  if (!batten_mul(n, n, &square) || !batten_la_fits(n))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "n = %zu: too large for a dense engine", n);
  set->inverse = batten_alloc_array(ctx, square, sizeof *set->inverse);
  if (!set->inverse) return BATTEN_E_NOMEM;
  set->j = batten_alloc_array(ctx, square, sizeof *set->j);
  if (!set->j) return BATTEN_E_NOMEM;
  set->t = batten_alloc_array(ctx, square, sizeof *set->t);
  if (!set->t) return BATTEN_E_NOMEM;
  set->reach = batten_alloc_array(ctx, n, 3 * sizeof *set->reach);
  if (!set->reach) return BATTEN_E_NOMEM;
  set->member = batten_alloc_array(ctx, n, sizeof *set->member);
  if (!set->member) return BATTEN_E_NOMEM;
  set->side = batten_alloc_array(ctx, n, sizeof *set->side);
  if (!set->side) return BATTEN_E_NOMEM;
  set->target = set->reach + n;
  set->scratch = set->target + n;

  invert(n, objective->r, set->inverse);
  qp_active_reset(set, objective->target);
  for (size_t i = 0; i < n; i++) {
    for (size_t j = i; j < n; j++) set->scratch[j] = set->inverse[i + j * n];
    set->reach[i] = norm(n - i, set->scratch + i);
  }
  return BATTEN_OK;
}

void qp_active_free(batten_context *ctx, qp_active *set) {
  batten_free(ctx, set->side);
  batten_free(ctx, set->member);
  batten_free(ctx, set->reach);
  batten_free(ctx, set->t);
  batten_free(ctx, set->j);
  batten_free(ctx, set->inverse);
  *set = (qp_active){0};
}

void qp_active_reset(qp_active *set, const double *c) {
  memcpy(set->j, set->inverse, set->n * set->n * sizeof *set->j);
  memcpy(set->target, c, set->n * sizeof *set->target);
  set->q = 0;
}

/* ---- Products ---- */

void qp_active_project_vector(const qp_active *set, const double *v, double *d) {
  qp_lanes_now()->dots(set->n, set->n, set->j, set->n, v, d);
}

void qp_active_project(const qp_active *set, size_t k, double *d) {
  const double *values;
  const uint32_t *columns;
  size_t n = set->n, count = qp_rows_entries(set->rows, k, &values, &columns);
  double scale = set->rows->scale[k];
  if (!columns) {
    qp_active_project_vector(set, values, d);
    for (size_t j = 0; j < n; j++) d[j] *= scale;
    return;
  }
  for (size_t j = 0; j < n; j++) {
    double sum = 0;
    for (size_t e = 0; e < count; e++) sum += set->j[columns[e] + j * n] * values[e];
    d[j] = scale * sum;
  }
}

void qp_active_combine(const qp_active *set, size_t first, size_t last, double factor, const double *u,
                       double *restrict x) {
  qp_lanes_now()->combine(set->n, last - first, set->j + first * set->n, set->n, factor, u + first, x);
}

void qp_active_solve(const qp_active *set, const double *d, double *y) {
  if (y != d) memcpy(y, d, set->q * sizeof *y);
  for (size_t i = set->q; i-- > 0;) {
    const double *column = set->t + i * set->n;
    y[i] /= column[i];
    axpy(i, -y[i], column, y);
  }
}

void qp_active_solve_transposed(const qp_active *set, const double *b, double *u) {
  for (size_t i = 0; i < set->q; i++) {
    const double *column = set->t + i * set->n;
    u[i] = (b[i] - dot(i, column, u)) / column[i];
  }
}

/* ---- Dependence ---- */

double qp_active_row_reach(const qp_active *set, size_t k) {
  const double *values;
  const uint32_t *columns;
  size_t count = qp_rows_entries(set->rows, k, &values, &columns);
  double sum = 0;
  for (size_t e = 0; e < count; e++) sum += fabs(values[e]) * set->reach[columns ? columns[e] : e];
  return set->rows->scale[k] * sum;
}

/* Errors of J'a_k after some updates: a few eps for each of n terms. */
static double dependence(const qp_active *set) { return 4 * (double)set->n * DBL_EPSILON; }

bool qp_active_depends(const qp_active *set, size_t k, const double *d) {
  return set->q == set->n || norm(set->n - set->q, d + set->q) <= dependence(set) * qp_active_row_reach(set, k);
}

/* ---- One at a time ---- */

void qp_active_add(qp_active *set, size_t k, signed char side, double *d) {
  size_t n = set->n, q = set->q;
  double *v = d + q, length = norm(n - q, v), head = v[0] > 0 ? -length : length;
  memcpy(set->t + q * n, d, q * sizeof *set->t);
  set->t[q + q * n] = head;
  set->member[q] = k;
  set->side[q] = side;
  set->q++;

  /* The reflection I - v v' / |v|^2 * 2 takes J2'a_k to (head, 0, ..): with v scaled to v[0] = 1 it is I - tau v v'.
   */
  double first = v[0] - head, tau = -first / head;
  for (size_t i = 1; i < n - q; i++) v[i] /= first;
  v[0] = 1;
  double *w = set->scratch;
  memset(w, 0, n * sizeof *w);
  qp_active_combine(set, q, n, tau, d, w);
  qp_lanes_now()->subtract(n, n - q, set->j + q * n, n, w, d + q);
  axpy(n - q, -tau * dot(n - q, v, set->target + q), v, set->target + q);
}

/* lanes.h's, of two numbers. */
static void rotate_pair(double c, double s, double *a, double *b) {
  double x = *a, y = *b;
  *a = c * x + s * y;
  *b = c * y - s * x;
}

void qp_active_drop(qp_active *set, size_t place) {
  size_t n = set->n, last = --set->q;
  for (size_t i = place; i < last; i++) {
    /* Column i + 1 of T moves to i with its first i + 2 entries, the last of which the rotation takes away. */
    double *column = set->t + i * n, *next = column + n;
    memcpy(column, next, (i + 2) * sizeof *column);
    set->member[i] = set->member[i + 1];
    set->side[i] = set->side[i + 1];
    double length = hypot(column[i], column[i + 1]), c = column[i] / length, s = column[i + 1] / length;
    column[i] = length;
    for (size_t l = i + 2; l <= last; l++) rotate_pair(c, s, set->t + i + l * n, set->t + i + 1 + l * n);
    qp_lanes_now()->rotate(n, c, s, set->j + i * n, set->j + (i + 1) * n);
    rotate_pair(c, s, set->target + i, set->target + i + 1);
  }
}

/* ---- Many at once ---- */

/* J2 := J2 Q and target2 := Q'target2 with the first `rank` reflectors in w (leading dimension n): through C = [J2'
 * target2], work [n - q][n + 1], because reflectors are applied from the left. */
static batten_status apply_reflectors(batten_context *ctx, qp_active *set, size_t rank, const double *w,
                                      const double *tau, double *work) {
  size_t n = set->n, q = set->q, rest = n - q;
  for (size_t j = 0; j < rest; j++) {
    for (size_t i = 0; i < n; i++) work[j + i * rest] = set->j[i + (q + j) * n];
    work[j + n * rest] = set->target[q + j];
  }
  batten_status st = batten_la_ormqr(ctx, 'T', rest, n + 1, rank, w, n, tau, work, rest);
  if (st < 0) return st;
  for (size_t j = 0; j < rest; j++) {
    for (size_t i = 0; i < n; i++) set->j[i + (q + j) * n] = work[j + i * rest];
    set->target[q + j] = work[j + n * rest];
  }
  return BATTEN_OK;
}

/* w [n][count] := J'[a_k], normals [n][count] scratch. */
static void project_many(const qp_active *set, size_t count, const size_t *k, double *normals, double *w) {
  size_t n = set->n;
  memset(normals, 0, n * count * sizeof *normals);
  for (size_t i = 0; i < count; i++) qp_rows_add(set->rows, k[i], 1, normals + i * n);
  batten_la_gemm(BATTEN_LA_DOUBLE, 'T', 'N', n, count, n, 1, set->j, n, normals, n, 0, w, n);
}

batten_status qp_active_add_many(batten_context *ctx, qp_active *set, size_t count, const size_t *k,
                                 const signed char *side) {
  size_t n = set->n, q = set->q, rest = n - q, most = count < rest ? count : rest, area, other;
  if (most == 0) return BATTEN_OK;
  batten_status st = BATTEN_E_NOMEM;
  double *w = NULL, *work = NULL, *tau = NULL;
  size_t *pivots = NULL;
  if (!batten_mul(n, count, &area) || !batten_mul(rest, n + 1, &other) || !batten_la_fits(count))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu constraints of %zu unknowns at once", count, n);
  if (other > area) area = other; /* normals, then J2' */
  w = batten_alloc_array(ctx, n, count * sizeof *w);
  if (!w) goto done;
  work = batten_alloc_array(ctx, area, sizeof *work);
  if (!work) goto done;
  tau = batten_alloc_array(ctx, count + most, sizeof *tau);
  if (!tau) goto done;
  pivots = batten_alloc_array(ctx, count, sizeof *pivots);
  if (!pivots) goto done;

  double *reach = tau + most;
  project_many(set, count, k, work, w);
  for (size_t i = 0; i < count; i++) {
    reach[i] = qp_active_row_reach(set, k[i]);
    for (size_t l = q; l < n; l++) w[l + i * n] /= reach[i];
  }
  st = batten_la_geqp3(ctx, rest, count, w + q, n, pivots, tau);
  if (st < 0) goto done;
  size_t rank = 0;
  while (rank < most && fabs(w[q + rank + rank * n]) > dependence(set)) rank++;
  st = apply_reflectors(ctx, set, rank, w + q, tau, work);
  if (st < 0) goto done;

  /* Pivoting moved the columns' lower parts, which geqp3 saw; the upper parts are where they were. */
  for (size_t i = 0; i < rank; i++) {
    double *column = set->t + (q + i) * n;
    size_t from = pivots[i];
    memcpy(column, w + from * n, q * sizeof *column);
    for (size_t l = q; l <= q + i; l++) column[l] = reach[from] * w[l + i * n];
    set->member[q + i] = k[from];
    set->side[q + i] = side[from];
  }
  set->q += rank;
done:
  batten_free(ctx, pivots);
  batten_free(ctx, tau);
  batten_free(ctx, work);
  batten_free(ctx, w);
  return st;
}
