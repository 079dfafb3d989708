/* Dense least squares, see <batten/lsq.h>.
 *
 * What comes in is brought to size 1 by powers of two, so that rank, condition and overflow do not depend on units:
 *     S = sqrt(W) A D,  C = sqrt(W) B E,  T := D T D,   X = D Y E^-1
 * Both methods then minimise |S Y - C|^2 + Y'T Y:
 *   normal  G = S'S + T = R'R by syrk and Cholesky, then two steps y += G^-1 g with the gradient g = S'(C - S Y) - T
 * Y: the second step takes the squared condition's error away. QR      of [S; U] with column pivoting, T = U'U by
 * pivoted Cholesky. Row-major S [m][n] is column-major S' [n][m]; Y and gradients are kept column-major [n][nrhs]
 * inside. */
#include <batten/lsq.h>
#include <float.h>
#include <string.h>

#include "base/checked.h"
#include "la/la.h"

static const batten_la_real D = BATTEN_LA_DOUBLE;

/* Normal equations lose eps / rcond^2; from here on one refinement step brings that back to rounding. */
static const double NORMAL_RCOND = 1e-4;

batten_lsq_options batten_lsq_options_default(void) {
  return (batten_lsq_options){.struct_size = sizeof(batten_lsq_options), .method = BATTEN_LSQ_AUTO};
}

typedef struct problem {
  batten_context *ctx;
  size_t m, n, nrhs;
  double *a, *b, *tension; /* [m][n] S, [m][nrhs] C, [n][n] T or NULL */
  double *scale, *unit;    /* [n] D, [nrhs] E */
  double *y;               /* [nrhs][n] */
  double *residual;        /* [m][nrhs] C - S Y */
  double *gradient;        /* [nrhs][n] */
  batten_lsq_info info;
} problem;

/* ---- What both methods share ---- */

/* residual = C - S Y, gradient = S' residual - T Y. */
static void update_gradient(problem *p) {
  size_t m = p->m, n = p->n, q = p->nrhs;
  if (m * q > 0) memcpy(p->residual, p->b, m * q * sizeof *p->residual);
  if (n > 0) batten_la_gemm(D, 'T', 'N', q, m, n, -1, p->y, n, p->a, n, 1, p->residual, q);
  memset(p->gradient, 0, n * q * sizeof *p->gradient);
  if (m > 0) batten_la_gemm(D, 'N', 'T', n, q, m, 1, p->a, n, p->residual, q, 0, p->gradient, n);
  if (p->tension) batten_la_symm(D, 'L', 'L', n, q, -1, p->tension, n, p->y, n, 1, p->gradient, n);
}

static double largest(size_t count, const double *values) {
  double norm = 0;
  for (size_t i = 0; i < count; i++) norm = fmax(norm, fabs(values[i]));
  return norm;
}

/* to [m][columns] := sqrt(W) from, times the powers of two scale [columns] that bring its columns to size 1; floor
 * [columns] counts as an entry of the column (NULL = none). A column of zeros keeps scale 0. */
static batten_status make_columns(problem *p, const char *name, size_t columns, const double *from,
                                  const double *weights, const double *floor, double *to, double *scale) {
  for (size_t j = 0; j < columns; j++) scale[j] = floor ? sqrt(floor[j * columns + j]) : 0;
  for (size_t i = 0; i < p->m; i++) {
    double root = weights ? sqrt(weights[i]) : 1;
    for (size_t j = 0; j < columns; j++) {
      to[i * columns + j] = root * from[i * columns + j];
      scale[j] = fmax(scale[j], fabs(to[i * columns + j]));
    }
  }
  for (size_t j = 0; j < columns; j++) {
    if (!(scale[j] <= DBL_MAX))
      return batten_fail(p->ctx, BATTEN_E_INVALID,
                         "%s: column %zu times the roots of the weights overflows; choose "
                         "a larger unit",
                         name, j);
    if (scale[j] > 0) scale[j] = batten_unit(scale[j]);
  }
  for (size_t i = 0; i < p->m; i++)
    for (size_t j = 0; j < columns; j++) to[i * columns + j] *= scale[j];
  return BATTEN_OK;
}

static batten_status make_problem(problem *p, const double *a, const double *b, const batten_lsq_options *o) {
  size_t n = p->n;
  batten_status st = make_columns(p, "a", n, a, o->weights, o->tension, p->a, p->scale);
  if (st == BATTEN_OK) st = make_columns(p, "b", p->nrhs, b, o->weights, NULL, p->b, p->unit);
  for (size_t j = 0; j < n && st == BATTEN_OK; j++)
    if (p->scale[j] == 0)
      st = batten_fail(p->ctx, BATTEN_E_SINGULAR, "a: column %zu is zero; drop it or add tension", j);
  for (size_t i = 0; p->tension && i < n; i++)
    for (size_t j = 0; j < n; j++) p->tension[i * n + j] = p->scale[i] * o->tension[i * n + j] * p->scale[j];
  return st;
}

static batten_status rank_deficient(const problem *p, size_t column) {
  return batten_fail(p->ctx, BATTEN_E_SINGULAR,
                     "a: column %zu depends on the others; drop it, add rows or add tension", column);
}

/* ---- Normal equations ---- */

static batten_status solve_normal(problem *p) {
  size_t n = p->n;
  p->info.method = BATTEN_LSQ_NORMAL;
  double *g = batten_alloc_array(p->ctx, n * n, sizeof *g);
  if (!g) return BATTEN_E_NOMEM;
  batten_la_syrk(D, 'U', 'N', n, p->m, 1, p->a, n, 0, g, n);
  for (size_t q = 0; p->tension && q < n * n; q++) g[q] += p->tension[q];
  batten_status st = batten_progress(p->ctx, "least squares", 0.5);
  if (st < 0) goto done;
  size_t failed = batten_la_potrf(D, 'U', n, g, n);
  if (failed > 0) {
    st = rank_deficient(p, failed - 1);
    goto done;
  }
  st = batten_la_trcon(p->ctx, n, g, n, &p->info.rcond);
  if (st < 0) goto done;
  if (p->info.rcond < sqrt(DBL_EPSILON)) { /* G has no correct digit then */
    size_t weakest = 0;
    for (size_t j = 1; j < n; j++)
      if (g[j + j * n] < g[weakest + weakest * n]) weakest = j;
    st = rank_deficient(p, weakest);
    goto done;
  }
  for (int step = 0; step < 2; step++) {
    update_gradient(p);
    batten_la_trsm(D, 'L', 'U', 'T', n, p->nrhs, 1, g, n, p->gradient, n);
    batten_la_trsm(D, 'L', 'U', 'N', n, p->nrhs, 1, g, n, p->gradient, n);
    for (size_t q = 0; q < n * p->nrhs; q++) p->y[q] += p->gradient[q];
  }
done:
  batten_free(p->ctx, g);
  return st;
}

/* ---- QR ---- */

/* u [n][n] := U with T = U'U, its columns in T's order, *rank rows. INVALID when T is not semidefinite. */
static batten_status tension_rows(const problem *p, double *u, size_t *rank) {
  size_t n = p->n;
  batten_status st = BATTEN_E_NOMEM;
  size_t *pivots = NULL;
  double *factor = batten_alloc_array(p->ctx, n * n, sizeof *factor);
  if (!factor) goto done;
  pivots = batten_alloc_array(p->ctx, n, sizeof *pivots);
  if (!pivots) goto done;
  memcpy(factor, p->tension, n * n * sizeof *factor);
  st = batten_la_pstrf(p->ctx, n, factor, n, -1, pivots, rank);
  if (st < 0) goto done;
  memset(u, 0, n * n * sizeof *u);
  for (size_t j = 0; j < n; j++)
    for (size_t i = 0; i <= j && i < *rank; i++) u[i + pivots[j] * n] = factor[i + j * n];
  /* What the rank leaves out must be rounding. */
  batten_la_syrk(D, 'U', 'T', n, *rank, 1, u, n, 0, factor, n);
  double norm = largest(n * n, p->tension);
  for (size_t j = 0; j < n; j++)
    for (size_t i = 0; i <= j; i++)
      if (fabs(factor[i + j * n] - p->tension[i + j * n]) > 10 * (double)n * DBL_EPSILON * norm) {
        st = batten_fail(p->ctx, BATTEN_E_INVALID, "opt.tension: not positive semidefinite, see row %zu", j);
        goto done;
      }
done:
  batten_free(p->ctx, pivots);
  batten_free(p->ctx, factor);
  return st;
}

/* stacked [n][rows] := [S; U] and right [nrhs][rows] := [C; 0]. */
static void stack(const problem *p, const double *u, size_t rank, size_t rows, double *stacked, double *right) {
  size_t m = p->m, n = p->n;
  for (size_t i = 0; i < m; i++) {
    for (size_t j = 0; j < n; j++) stacked[i + j * rows] = p->a[i * n + j];
    for (size_t q = 0; q < p->nrhs; q++) right[i + q * rows] = p->b[i * p->nrhs + q];
  }
  for (size_t j = 0; j < n; j++)
    for (size_t i = 0; i < rank; i++) stacked[m + i + j * rows] = u[i + j * n];
  for (size_t q = 0; q < p->nrhs; q++) memset(right + m + q * rows, 0, rank * sizeof *right);
}

static batten_status solve_qr(problem *p) {
  size_t m = p->m, n = p->n, rank = 0;
  batten_status st = BATTEN_E_NOMEM;
  double *u = NULL, *stacked = NULL, *right = NULL, *tau = NULL;
  size_t *pivots = NULL;
  p->info.method = BATTEN_LSQ_QR;
  if (p->tension) {
    u = batten_alloc_array(p->ctx, n * n, sizeof *u);
    if (!u) goto done;
    st = tension_rows(p, u, &rank);
    if (st < 0) goto done;
    st = BATTEN_E_NOMEM;
  }
  size_t rows = m + rank;
  stacked = batten_alloc_array(p->ctx, rows * n, sizeof *stacked);
  if (!stacked) goto done;
  right = batten_alloc_array(p->ctx, rows * p->nrhs, sizeof *right);
  if (!right) goto done;
  tau = batten_alloc_array(p->ctx, n, sizeof *tau);
  if (!tau) goto done;
  pivots = batten_alloc_array(p->ctx, n, sizeof *pivots);
  if (!pivots) goto done;
  stack(p, u, rank, rows, stacked, right);
  st = batten_progress(p->ctx, "least squares", 0.5);
  if (st < 0) goto done;
  st = batten_la_geqp3(p->ctx, rows, n, stacked, rows, pivots, tau);
  if (st < 0) goto done;
  double smallest = (double)(rows > 10 ? rows : 10) * DBL_EPSILON * (n > 0 && rows > 0 ? fabs(stacked[0]) : 0);
  for (size_t j = 0; j < n; j++) {
    if (j < rows && fabs(stacked[j + j * rows]) > smallest) continue;
    st = rank_deficient(p, j < rows ? pivots[j] : j);
    goto done;
  }
  st = batten_la_trcon(p->ctx, n, stacked, rows, &p->info.rcond);
  if (st < 0) goto done;
  st = batten_la_ormqr(p->ctx, 'T', rows, p->nrhs, n, stacked, rows, tau, right, rows);
  if (st < 0) goto done;
  batten_la_trsm(D, 'L', 'U', 'N', n, p->nrhs, 1, stacked, rows, right, rows);
  for (size_t q = 0; q < p->nrhs; q++)
    for (size_t j = 0; j < n; j++) p->y[pivots[j] + q * n] = right[j + q * rows];
done:
  batten_free(p->ctx, pivots);
  batten_free(p->ctx, tau);
  batten_free(p->ctx, right);
  batten_free(p->ctx, stacked);
  batten_free(p->ctx, u);
  return st;
}

/* ---- Arguments ---- */

static batten_status check_finite(batten_context *ctx, const char *name, size_t rows, size_t columns,
                                  const double *values) {
  size_t count = rows * columns;
  if (count > 0 && !values) return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL with %zu values", name, count);
  size_t bad = batten_first_nonfinite(count, values);
  if (bad == count) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "%s[%zu][%zu]: %g is not finite", name, bad / columns, bad % columns,
                     values[bad]);
}

static batten_status check_tension(batten_context *ctx, size_t n, const double *t) {
  batten_status st = check_finite(ctx, "opt.tension", n, n, t);
  if (st < 0) return st;
  double norm = largest(n * n, t);
  for (size_t i = 0; i < n; i++) {
    if (t[i * n + i] < 0)
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.tension[%zu][%zu]: %g; not positive semidefinite", i, i,
                         t[i * n + i]);
    for (size_t j = 0; j < i; j++)
      if (fabs(t[i * n + j] - t[j * n + i]) > 10 * DBL_EPSILON * norm)
        return batten_fail(ctx, BATTEN_E_INVALID, "opt.tension[%zu][%zu]: %.17g differs from [%zu][%zu]: %.17g", i, j,
                           t[i * n + j], j, i, t[j * n + i]);
  }
  return BATTEN_OK;
}

static batten_status check(batten_context *ctx, const problem *p, const double *a, const double *b,
                           const batten_lsq_options *o, const double *x) {
  size_t sum, product;
  batten_status st = batten_check_struct(ctx, "batten_lsq_options", o->struct_size, sizeof *o);
  if (st < 0) return st;
  if ((int)o->method < BATTEN_LSQ_AUTO || (int)o->method > BATTEN_LSQ_QR)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.method: %d; use one of batten_lsq_method", (int)o->method);
  if (!(batten_add(p->m, p->n, &sum) && batten_add(sum, p->nrhs, &sum) && batten_la_fits(sum)) ||
      !batten_mul3(sum, sum, sizeof(double), &product))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "m, n, nrhs: %zu, %zu, %zu exceed LAPACK's integers", p->m, p->n,
                       p->nrhs);
  if (p->m < p->n && !o->tension)
    return batten_fail(ctx, BATTEN_E_INVALID, "m: %zu rows for %zu unknowns; add rows or tension", p->m, p->n);
  if (!x && p->n * p->nrhs > 0) return batten_fail(ctx, BATTEN_E_INVALID, "x: NULL");
  st = check_finite(ctx, "a", p->m, p->n, a);
  if (st == BATTEN_OK) st = check_finite(ctx, "b", p->m, p->nrhs, b);
  if (st == BATTEN_OK && o->tension) st = check_tension(ctx, p->n, o->tension);
  for (size_t i = 0; st == BATTEN_OK && o->weights && i < p->m; i++)
    if (!(o->weights[i] >= 0 && o->weights[i] <= DBL_MAX))
      st = batten_fail(ctx, BATTEN_E_INVALID, "opt.weights[%zu]: %g; must be finite and not negative", i,
                       o->weights[i]);
  return st;
}

static batten_status solve(problem *p, batten_lsq_method method) {
  if (method == BATTEN_LSQ_QR) return solve_qr(p);
  batten_status st = solve_normal(p);
  bool poor = st == BATTEN_E_SINGULAR || (st == BATTEN_OK && p->info.rcond < NORMAL_RCOND);
  return method == BATTEN_LSQ_AUTO && poor ? solve_qr(p) : st;
}

/* y := X, in the caller's units, and the figures about it; before: the largest gradient of each right side at 0. */
static batten_status finish(problem *p, const double *before) {
  size_t n = p->n, nrhs = p->nrhs;
  update_gradient(p);
  for (size_t q = 0; q < nrhs; q++) {
    double gradient = largest(n, p->gradient + q * n), unit = p->unit[q] > 0 ? p->unit[q] : 1;
    p->info.gradient_norm = fmax(p->info.gradient_norm, before[q] > 0 ? gradient / before[q] : gradient);
    for (size_t i = 0; i < p->m; i++)
      p->info.residual_norm = hypot(p->info.residual_norm, p->residual[i * nrhs + q] / unit);
    for (size_t j = 0; j < n; j++) {
      double *y = p->y + j + q * n;
      *y = *y / unit * p->scale[j];
      if (!(fabs(*y) <= DBL_MAX))
        return batten_fail(p->ctx, BATTEN_E_INVALID, "x[%zu][%zu]: overflows; choose a larger unit for b", j, q);
    }
  }
  return BATTEN_OK;
}

static batten_status allocate(problem *p, bool tension, double **before) {
  size_t m = p->m, n = p->n, nrhs = p->nrhs;
  struct {
    double **array;
    size_t count;
  } arrays[] = {{&p->a, m * n},           {&p->b, m * nrhs},        {&p->scale, n},
                {&p->unit, nrhs},         {&p->y, n * nrhs},        {before, nrhs},
                {&p->residual, m * nrhs}, {&p->gradient, n * nrhs}, {&p->tension, tension ? n * n : 0}};
  for (size_t i = 0; i + !tension < sizeof arrays / sizeof *arrays; i++) {
    *arrays[i].array = batten_alloc_array(p->ctx, arrays[i].count, sizeof(double));
    if (!*arrays[i].array) return BATTEN_E_NOMEM;
  }
  return BATTEN_OK;
}

batten_status batten_lsq_solve(batten_context *ctx, size_t m, size_t n, size_t nrhs, const double *a, const double *b,
                               const batten_lsq_options *opt, double *x, batten_lsq_info *info) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_lsq_options o = opt ? *opt : batten_lsq_options_default();
  problem p = {.ctx = ctx, .m = m, .n = n, .nrhs = nrhs};
  double start = batten_now(), *before = NULL;
  batten_status st = check(ctx, &p, a, b, &o, x);
  if (st < 0) return st;

  st = allocate(&p, o.tension != NULL, &before);
  if (st < 0) goto done;
  st = batten_progress(ctx, "least squares", 0);
  if (st < 0) goto done;
  st = make_problem(&p, a, b, &o);
  if (st < 0) goto done;
  memset(p.y, 0, n * nrhs * sizeof *p.y);
  update_gradient(&p);
  for (size_t q = 0; q < nrhs; q++) before[q] = largest(n, p.gradient + q * n);
  st = solve(&p, o.method);
  if (st < 0) goto done;
  st = finish(&p, before);
  if (st < 0) goto done;
  for (size_t i = 0; i < n; i++)
    for (size_t q = 0; q < nrhs; q++) x[i * nrhs + q] = p.y[i + q * n];
  p.info.time_s = batten_now() - start;
  if (info) *info = p.info;
done:
  batten_free(ctx, p.a);
  batten_free(ctx, p.b);
  batten_free(ctx, p.tension);
  batten_free(ctx, p.scale);
  batten_free(ctx, p.unit);
  batten_free(ctx, p.y);
  batten_free(ctx, before);
  batten_free(ctx, p.residual);
  batten_free(ctx, p.gradient);
  return st;
}
