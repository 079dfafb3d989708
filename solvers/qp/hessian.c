/* Whether a symmetric matrix is positive semidefinite up to rounding, a direction of negative curvature if not, its
 * root if so.
 *
 * H is scaled to a diagonal of about one: S = E^-1 H E^-1, E powers of two. What rounding can hide is a diagonal N:
 * Cholesky of S + N ends if and only if no direction has v'Sv < -v'Nv, up to errors far below N. If it breaks down at
 * unknown j, then R'R = S + N before j, and v = [-R^-1 R^-T s_j; 1; 0] is such a direction.
 *
 * The root comes from Cholesky with diagonal pivoting, P'SP = [R1 R2]'[R1 R2], which stops where the diagonal left is
 * rounding [Higham, Accuracy and Stability, 10.3]. See objective.h. */
#include <float.h>
#include <string.h>

#include "base/checked.h"
#include "kkt.h"
#include "la/la.h"
#include "matrix_row.h"
#include "objective.h"

static const batten_la_real D = BATTEN_LA_DOUBLE;

/* ---- Scales ---- */

/* Power of two of size sqrt(square). */
static double root_scale(double square) { return square > 0 ? 1 / batten_unit(sqrt(square)) : 0; }

/* Returns the largest |H_ij|. scale [n]: of size sqrt(H_jj); where that is not positive, as large as the row asks
 * for, 1 for an empty row, and 0 for a row that is rounding beside the largest entry: it counts as empty. */
static double set_scales(const batten_matrix *h, double *diagonal, double *scale) {
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
      scale[i] =
          root_scale(fmax(wanted * wanted, fmax(fabs(diagonal[i]), diagonal[i] == 0 && wanted <= 0 ? most : 0)));
  }
  return largest;
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

/* ---- Convexity ---- */

/* Entries of the longest row. */
static size_t longest_row(const batten_matrix *h) {
  size_t longest = 0;
  for (size_t i = 0; i < h->rows; i++) {
    qp_matrix_row row = qp_row_of(h, i);
    if (row.count > longest) longest = row.count;
  }
  return longest;
}

/* N_jj: what is put down to rounding of H's entries. They may be sums of some thousand products, or computed with
 * errors relative to the largest of them; but what is far below 0 in scaled unknowns is believed in whatever units
 * they are. */
static double noise_of(size_t row, double largest, double scale) {
  const double OWN = (1000 + 8 * (double)row) * DBL_EPSILON, OTHERS = (64 + (double)row) * DBL_EPSILON, FAR = 1e-6;
  return fmin(fmax(OWN, OTHERS * (largest / scale / scale)), FAR);
}

static batten_status not_convex(batten_context *ctx, size_t index, double curvature) {
  return batten_fail(ctx, BATTEN_E_NOT_CONVEX,
                     "h: curvature %.3g of its scale along a direction that ends in unknown %zu; make it positive "
                     "semidefinite",
                     curvature, index);
}

/* ray, its largest entry of size one: E^-1 v. */
static void set_ray(size_t n, const double *scale, const double *v, double *ray) {
  double most = 0;
  for (size_t i = 0; i < n; i++) {
    ray[i] = scale[i] > 0 ? v[i] / scale[i] : 0;
    most = fmax(most, fabs(ray[i]));
  }
  for (size_t i = 0; i < n; i++) ray[i] *= batten_unit(most);
}

batten_status qp_hessian_convex(batten_context *ctx, const batten_matrix *h, size_t *index, double *ray) {
  size_t n = h->rows, longest = longest_row(h);
  if (!batten_la_fits(n)) return batten_fail(ctx, BATTEN_E_TOO_LARGE, "h: %zu rows; use the interior engine", n);
  batten_status st = BATTEN_E_NOMEM;
  double *scale = NULL, *s = batten_alloc_array(ctx, n, n * sizeof *s);
  if (!s) goto done;
  scale = batten_alloc_array(ctx, n, 2 * sizeof *scale);
  if (!scale) goto done;
  double *v = scale + n, largest = set_scales(h, v, scale);
  scaled_matrix(h, scale, s);
  for (size_t j = 0; j < n; j++) s[j + j * n] += scale[j] > 0 ? noise_of(longest, largest, scale[j]) : 1;
  /* the lower triangle is left as it was: row j of it is s_j */
  size_t broken = batten_la_potrf(D, 'U', n, s, n);
  st = BATTEN_OK;
  if (broken == 0) goto done;
  size_t j = broken - 1;
  memset(v, 0, n * sizeof *v);
  for (size_t i = 0; i < j; i++) v[i] = -s[j + i * n];
  batten_la_trsv(D, 'U', 'T', j, s, n, v);
  double square = 1, along = 0;
  for (size_t i = 0; i < j; i++) along += v[i] * v[i];
  batten_la_trsv(D, 'U', 'N', j, s, n, v);
  for (size_t i = 0; i < j; i++) square += v[i] * v[i];
  v[j] = 1;
  set_ray(n, scale, v, ray);
  *index = j;
  st = not_convex(ctx, j, -along / square);
done:
  batten_free(ctx, scale);
  batten_free(ctx, s);
  return st;
}

/* A minor of rows i and j is negative along (1, t) where that is least, or with t of size one if other is none. */
batten_status qp_hessian_minors(batten_context *ctx, const batten_matrix *h, size_t *index, double *ray) {
  size_t n = h->rows, longest = longest_row(h);
  double *scale = batten_alloc_array(ctx, n, 2 * sizeof *scale);
  if (!scale) return BATTEN_E_NOMEM;
  batten_status st = BATTEN_OK;
  double *diagonal = scale + n, largest = set_scales(h, diagonal, scale);
  for (size_t i = 0; i < n && st >= 0; i++) {
    qp_matrix_row row = qp_row_of(h, i);
    if (scale[i] <= 0) continue;
    double own = diagonal[i] / scale[i] / scale[i] + noise_of(longest, largest, scale[i]);
    for (size_t e = 0; e < row.count && st >= 0; e++) {
      size_t j = qp_row_column(&row, e);
      if (scale[j] <= 0) continue;
      double other = diagonal[j] / scale[j] / scale[j] + noise_of(longest, largest, scale[j]);
      double off = row.values[e] / scale[i] / scale[j];
      double t = i == j ? 0 : other > 0 ? -off / other : copysign(1, -off);
      double least = i == j ? own : own + 2 * t * off + t * t * other;
      if (least >= 0) continue;
      double one = 1 / scale[i], two = i == j ? 0 : t / scale[j], unit = batten_unit(fmax(one, fabs(two)));
      memset(ray, 0, n * sizeof *ray);
      ray[i] = one * unit;
      if (i != j) ray[j] = two * unit;
      *index = i;
      st = not_convex(ctx, i, least / (1 + t * t));
    }
  }
  batten_free(ctx, scale);
  return st;
}

/* ---- Convexity of sparse matrices ---- */

/* S + N for the sparse factorization, and which of its leading minors are definite. */
typedef struct leading {
  size_t n;
  double *values; /* of S, as the entries of H are ordered */
  double *noise;  /* [n] N */
  double *shift;  /* [n] what the factorization adds to the diagonal */
  double *v;      /* [n] */
  qp_ldl *ldl;
} leading;

/* Whether the first `count` unknowns, those after being cut off by a huge diagonal, have only positive pivots. */
static bool definite(leading *l, size_t count) {
  const double CUT_OFF = 1e40; /* entries of S are near 1 at most where it is semidefinite */
  for (size_t j = 0; j < l->n; j++) l->shift[j] = j < count ? l->noise[j] : CUT_OFF;
  return qp_ldl_factor(l->ldl, l->shift, NULL) == 0;
}

/* v := [-(S + N)_j^-1 s_j; 1; 0] for the first unknown j whose minor is not definite. */
static size_t descend(leading *l, const batten_matrix *h) {
  size_t low = 0, high = l->n;
  while (high - low > 1) {
    size_t middle = low + (high - low) / 2;
    if (definite(l, middle))
      low = middle;
    else
      high = middle;
  }
  memset(l->v, 0, l->n * sizeof *l->v);
  definite(l, low);
  for (size_t e = h->starts[low]; e < h->starts[low + 1]; e++)
    if (h->indices[e] < low) l->v[h->indices[e]] = -l->values[e];
  qp_ldl_solve(l->ldl, l->v, NULL);
  for (size_t j = low; j < l->n; j++) l->v[j] = j == low;
  return low;
}

static bool is_diagonal(const batten_matrix *h) {
  for (size_t i = 0; i < h->rows; i++)
    for (size_t e = h->starts[i]; e < h->starts[i + 1]; e++)
      if (h->indices[e] != i) return false;
  return true;
}

batten_status qp_hessian_convex_sparse(batten_context *ctx, const batten_matrix *h, size_t *index, double *ray) {
  /* Below so many unknowns a dense factor is as cheap; beyond so many operations only minors are looked at. */
  const size_t FEW = 64;
  const double TOO_MUCH = 1e11;
  size_t n = h->rows, longest = longest_row(h), none[1] = {0};
  if (h->dense || n <= FEW) return qp_hessian_convex(ctx, h, index, ray);
  batten_status st = qp_hessian_minors(ctx, h, index, ray);
  if (st < 0 || is_diagonal(h)) return st;
  leading l = {.n = n};
  st = BATTEN_E_NOMEM;
  double *scale = batten_alloc_array(ctx, n, 4 * sizeof *scale);
  if (!scale) goto done;
  l.values = batten_alloc_array(ctx, h->starts[n], sizeof *l.values);
  if (!l.values) goto done;
  l.noise = scale + n, l.shift = scale + 2 * n, l.v = scale + 3 * n;
  double largest = set_scales(h, l.v, scale);
  for (size_t i = 0; i < n; i++) {
    l.noise[i] = scale[i] > 0 ? noise_of(longest, largest, scale[i]) : 1;
    for (size_t e = h->starts[i]; e < h->starts[i + 1]; e++) {
      double other = scale[h->indices[e]];
      l.values[e] = scale[i] > 0 && other > 0 ? h->values[e] / scale[i] / other : 0;
    }
  }
  qp_csr scaled = {n, n, h->starts, h->indices, l.values}, rows = {0, n, none, NULL, NULL};
  st = qp_ldl_new(ctx, &scaled, &rows, &l.ldl);
  if (st < 0) goto done;
  if (qp_ldl_flops(l.ldl) > TOO_MUCH || definite(&l, n)) goto done;
  size_t j = descend(&l, h);
  set_ray(n, scale, l.v, ray);
  *index = j;
  st = batten_fail(ctx, BATTEN_E_NOT_CONVEX,
                   "h: its minor of the unknowns up to %zu is negative; make it positive semidefinite", j);
done:
  qp_ldl_free(ctx, l.ldl);
  batten_free(ctx, l.values);
  batten_free(ctx, scale);
  return st;
}

/* ---- Root ---- */

batten_status qp_hessian_root(batten_context *ctx, const batten_matrix *h, double *u, size_t *rank) {
  size_t n = h->rows, *pivots = NULL;
  batten_status st = BATTEN_E_NOMEM;
  double *scale = NULL, *factor = batten_alloc_array(ctx, n, n * sizeof *factor);
  if (!factor) goto done;
  scale = batten_alloc_array(ctx, n, 2 * sizeof *scale);
  if (!scale) goto done;
  pivots = batten_alloc_array(ctx, n, sizeof *pivots);
  if (!pivots) goto done;
  set_scales(h, scale + n, scale);
  scaled_matrix(h, scale, factor);
  st = batten_la_pstrf(ctx, n, factor, n, 4 * (double)n * DBL_EPSILON, pivots, rank);
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
