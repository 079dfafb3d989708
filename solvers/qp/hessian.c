/* Whether a symmetric matrix is positive semidefinite up to rounding, its root if so, a direction of negative curvature
 * if not.
 *
 * H is scaled to a diagonal of about one: S = E^-1 H E^-1, E powers of two. Cholesky with diagonal pivoting
 *   P'SP = [R11 R12]'[R11 R12] + [0 0; 0 L]      [Higham, Accuracy and Stability, 10.3]
 * stops where the diagonal left is rounding. If S is semidefinite all of the rest L is; if S has an eigenvalue -e then
 * L has one of -e or below, since w'Lw is the least of v'Sv over all v that end in w. So L's most negative direction w,
 * found by shifted power iteration, decides, and v = [-R11^-1 R12 w; w] is the direction for S. See objective.h. */
#include <float.h>
#include <string.h>

#include "base/checked.h"
#include "la/la.h"
#include "matrix_row.h"
#include "objective.h"

static const batten_la_real D = BATTEN_LA_DOUBLE;

/* ---- Scales ---- */

/* Power of two of size sqrt(square). */
static double root_scale(double square) { return square > 0 ? 1 / batten_unit(sqrt(square)) : 0; }

/* scale [n]: of size sqrt(H_jj); where that is not positive, as large as the row asks for, 1 for an empty row, and 0 for
 * a row that is rounding beside the largest entry: it counts as empty. */
static void set_scales(const batten_matrix *h, double *diagonal, double *scale) {
  size_t n = h->rows;
  double largest = 0;
  for (size_t i = 0; i < n; i++) {
    qp_matrix_row row = qp_row_of(h, i);
    diagonal[i] = 0;
    for (size_t e = 0; e < row.count; e++) {
      largest = fmax(largest, fabs(row.values[e]));
      if (qp_row_column(&row, e) == i) diagonal[i] = row.values[e];
    }
    scale[i] = root_scale(fabs(diagonal[i]));
  }
  for (size_t i = 0; i < n; i++) {
    if (diagonal[i] > 0) continue;
    qp_matrix_row row = qp_row_of(h, i);
    double most = 0, wanted = 0;
    for (size_t e = 0; e < row.count; e++) {
      size_t j = qp_row_column(&row, e);
      most = fmax(most, fabs(row.values[e]));
      if (diagonal[j] > 0) wanted = fmax(wanted, fabs(row.values[e]) / scale[j]);
    }
    if (most <= 4 * DBL_EPSILON * largest)
      scale[i] = most > 0 ? 0 : 1;
    else
      scale[i] = root_scale(fmax(wanted * wanted, fmax(fabs(diagonal[i]), diagonal[i] == 0 && wanted <= 0 ? most : 0)));
  }
}

/* s [n][n] := E^-1 H E^-1, the mean of both triangles. */
static void scaled_matrix(const batten_matrix *h, const double *scale, double *s) {
  size_t n = h->rows;
  memset(s, 0, n * n * sizeof *s);
  for (size_t i = 0; i < n; i++) {
    qp_matrix_row row = qp_row_of(h, i);
    for (size_t e = 0; e < row.count; e++) {
      size_t j = qp_row_column(&row, e);
      if (scale[i] <= 0 || scale[j] <= 0) continue;
      double half = 0.5 * (row.values[e] / scale[i] / scale[j]);
      s[i + j * n] += half;
      s[j + i * n] += half;
    }
  }
}

/* ---- The rest ---- */

/* rest [t][t] := S22 - R12'R12, all of it; returns its largest entry and where that is. */
static double form_rest(size_t n, size_t rank, const double *s, const double *u, const size_t *pivots, double *rest,
                        size_t at[2]) {
  size_t t = n - rank;
  double largest = 0;
  at[0] = at[1] = 0;
  for (size_t j = 0; j < t; j++)
    for (size_t i = 0; i < t; i++) rest[i + j * t] = s[pivots[rank + i] + pivots[rank + j] * n];
  if (rank > 0) batten_la_syrk(D, 'U', 'T', t, rank, -1, u + rank * n, n, 1, rest, t);
  for (size_t j = 0; j < t; j++) {
    for (size_t i = 0; i <= j; i++) {
      rest[j + i * t] = rest[i + j * t];
      if (fabs(rest[i + j * t]) <= largest) continue;
      largest = fabs(rest[i + j * t]);
      at[0] = i, at[1] = j;
    }
  }
  return largest;
}

/* w'rest w / w'w; to := rest w */
static double quotient(size_t t, const double *rest, const double *w, double *to) {
  double energy = 0, square = 0;
  batten_la_symv('U', t, 1, rest, t, w, 0, to);
  for (size_t i = 0; i < t; i++) {
    energy += w[i] * to[i];
    square += w[i] * w[i];
  }
  return square > 0 ? energy / square : 0;
}

/* w [t] := direction of about the most negative curvature of rest, starting from the pair that holds its largest entry:
 * that alone has at least a t-th of it. */
static double descend(size_t t, const double *rest, const size_t at[2], double *w, double *to) {
  const size_t ROUNDS = 60;
  double shift = 0, best = 0;
  for (size_t i = 0; i < t; i++) shift += fmax(rest[i + i * t], 0); /* bounds the positive eigenvalues, nearly */
  memset(w, 0, t * sizeof *w);
  w[at[0]] = 1;
  if (at[0] != at[1]) w[at[1]] = rest[at[0] + at[1] * t] > 0 ? -1 : 1;
  best = quotient(t, rest, w, to);
  for (size_t round = 0; round < ROUNDS; round++) {
    double length = 0;
    for (size_t i = 0; i < t; i++) to[i] -= shift * w[i];
    for (size_t i = 0; i < t; i++) length = fmax(length, fabs(to[i]));
    if (!(length > 0)) break;
    for (size_t i = 0; i < t; i++) w[i] = to[i] / length;
    double now = quotient(t, rest, w, to);
    if (now >= best * (1 - 1e-3)) { /* no lower to speak of: both are negative */
      best = fmin(best, now);
      break;
    }
    best = now;
  }
  return best;
}

/* v [n] in the caller's unknowns from w: [-R11^-1 R12 w; w]. Returns v'Sv / v'v in scaled ones. */
static double lift(size_t n, size_t rank, const double *u, const size_t *pivots, const double *scale, double quotient_of_w,
                   const double *w, double *work, double *v, size_t *index) {
  size_t t = n - rank;
  double square = 0, square_of_w = 0, most = 0;
  if (rank > 0) {
    batten_la_gemv(D, 'N', rank, t, -1, u + rank * n, n, w, 0, work);
    batten_la_trsv(D, 'U', 'N', rank, u, n, work);
  }
  memcpy(work + rank, w, t * sizeof *w);
  for (size_t i = 0; i < n; i++) square += work[i] * work[i];
  for (size_t i = 0; i < t; i++) {
    square_of_w += w[i] * w[i];
    if (fabs(w[i]) <= most) continue;
    most = fabs(w[i]);
    *index = pivots[rank + i];
  }
  for (size_t i = 0; i < n; i++) v[pivots[i]] = scale[pivots[i]] > 0 ? work[i] / scale[pivots[i]] : 0;
  return quotient_of_w * (square_of_w / square);
}

static batten_status not_convex(batten_context *ctx, size_t index, double curvature) {
  return batten_fail(ctx, BATTEN_E_NOT_CONVEX,
                     "h: curvature %.3g of its scale along a direction at unknown %zu; make it positive semidefinite",
                     curvature, index);
}

/* NOT_CONVEX when the rest is negative somewhere beyond rounding. */
static batten_status judge_rest(batten_context *ctx, size_t n, size_t rank, const double *s, const double *u,
                                const size_t *pivots, const double *scale, size_t *index, double *ray) {
  size_t t = n - rank, at[2];
  const double noise = qp_curvature_noise(n);
  if (t == 0) return BATTEN_OK;
  batten_status st = BATTEN_E_NOMEM;
  double *work = NULL, *rest = batten_alloc_array(ctx, t, t * sizeof *rest);
  if (!rest) goto done;
  work = batten_alloc_array(ctx, n, 4 * sizeof *work);
  if (!work) goto done;
  st = BATTEN_OK;
  if (form_rest(n, rank, s, u, pivots, rest, at) * (double)t <= noise) goto done;
  double *w = work + n, *to = work + 2 * n, *v = work + 3 * n;
  double lowest = descend(t, rest, at, w, to);
  if (lowest >= 0) goto done;
  size_t where = 0;
  double curvature = lift(n, rank, u, pivots, scale, lowest, w, work, v, &where);
  if (curvature >= -noise) goto done;
  memcpy(ray, v, n * sizeof *ray);
  *index = where;
  st = not_convex(ctx, where, curvature);
done:
  batten_free(ctx, work);
  batten_free(ctx, rest);
  return st;
}

batten_status qp_hessian_root(batten_context *ctx, const batten_matrix *h, double *u, size_t *rank, size_t *index,
                              double *ray) {
  size_t n = h->rows, *pivots = NULL;
  if (!batten_la_fits(n)) return batten_fail(ctx, BATTEN_E_TOO_LARGE, "h: %zu rows; use the interior engine", n);
  batten_status st = BATTEN_E_NOMEM;
  double *scale = NULL, *s = u, *factor = batten_alloc_array(ctx, n, n * sizeof *factor);
  if (!factor) goto done;
  scale = batten_alloc_array(ctx, n, 2 * sizeof *scale);
  if (!scale) goto done;
  pivots = batten_alloc_array(ctx, n, sizeof *pivots);
  if (!pivots) goto done;
  set_scales(h, scale + n, scale);
  scaled_matrix(h, scale, s);
  memcpy(factor, s, n * n * sizeof *factor);
  st = batten_la_pstrf(ctx, n, factor, n, 4 * (double)n * DBL_EPSILON, pivots, rank);
  if (st < 0) goto done;
  st = judge_rest(ctx, n, *rank, s, factor, pivots, scale, index, ray);
  if (st < 0) goto done;
  memset(u, 0, n * n * sizeof *u);
  for (size_t j = 0; j < n; j++)
    for (size_t i = 0; i <= j && i < *rank; i++) u[i + pivots[j] * n] = factor[i + j * n] * scale[pivots[j]];
done:
  batten_free(ctx, pivots);
  batten_free(ctx, scale);
  batten_free(ctx, factor);
  return st;
}

/* A minor of rows i and j is negative along (1, -t) with t of S_ij's sign and size one. */
batten_status qp_hessian_minors(batten_context *ctx, const batten_matrix *h, size_t *index, double *ray) {
  size_t n = h->rows;
  double *scale = batten_alloc_array(ctx, n, 2 * sizeof *scale);
  if (!scale) return BATTEN_E_NOMEM;
  batten_status st = BATTEN_OK;
  double *diagonal = scale + n, noise = qp_curvature_noise(n);
  set_scales(h, diagonal, scale);
  for (size_t i = 0; i < n && st >= 0; i++) {
    qp_matrix_row row = qp_row_of(h, i);
    if (scale[i] <= 0) continue;
    double own = diagonal[i] / scale[i] / scale[i];
    for (size_t e = 0; e < row.count && st >= 0; e++) {
      size_t j = qp_row_column(&row, e);
      if (scale[j] <= 0) continue;
      double other = diagonal[j] / scale[j] / scale[j], off = row.values[e] / scale[i] / scale[j];
      /* least of own + 2 t off + other t^2 over t, or at t = -+1 where other is none */
      double t = i == j ? 0 : other > 0 ? -off / other : copysign(1, -off);
      double least = i == j ? own : own + 2 * t * off + t * t * other;
      if (least >= -noise * (1 + t * t)) continue;
      memset(ray, 0, n * sizeof *ray);
      ray[i] = 1 / scale[i];
      if (i != j) ray[j] = t / scale[j];
      *index = i;
      st = not_convex(ctx, i, least / (1 + t * t));
    }
  }
  batten_free(ctx, scale);
  return st;
}
