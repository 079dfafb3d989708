/* The public calls of <batten/saddle.h>: arguments, choice of method, memory, iterative refinement, fall-back.
 *
 * Refinement recomputes the residual from fresh entries of K in double. A float factor then gives a double solution
 * as long as its error times the condition stays below 1; where it does not contract, the next method takes over:
 * mixed -> Cholesky -> LDL'. */
#include <float.h>
#include <string.h>

#include "schwarz.h"

/* A step that gains less than this factor has stalled. */
static const double STALL = 0.25;

/* Of the iterative method: below 1e-13 rounding of the rows that are checked is what one would see. */
static const double ACCURACY_MIN = 1e-13, ACCURACY_MAX = 0.1;

/* Distances are compared by their squares. */
static const double COORDINATE_MAX = 1e150;

const char *batten_saddle_method_name(batten_saddle_method method) {
  static const char *const names[] = {[BATTEN_SADDLE_AUTO] = "auto",
                                      [BATTEN_SADDLE_CHOLESKY] = "cholesky",
                                      [BATTEN_SADDLE_CHOLESKY_MIXED] = "cholesky-mixed",
                                      [BATTEN_SADDLE_LDL] = "ldl",
                                      [BATTEN_SADDLE_QR] = "qr",
                                      [BATTEN_SADDLE_ITERATIVE] = "iterative"};
  return (size_t)method < sizeof names / sizeof *names ? names[method] : "unknown method";
}

batten_saddle_options batten_saddle_options_default(void) {
  return (batten_saddle_options){.struct_size = sizeof(batten_saddle_options),
                                 .refine_max = 10,
                                 .residual_tol = 1e-13,
                                 .accuracy = 1e-6,
                                 .iterations_max = 200};
}

/* ---- Memory and choice of method ---- */

/* From this order on the float factor saves more than the extra residuals cost (benchmarks/bench_saddle). */
enum { MIXED_FROM = 1500 };

static size_t qr_bytes(size_t n, size_t k) { return k * (n + 2 * k) * sizeof(double) + k * sizeof(size_t); }

static size_t handle_bytes(size_t k) { return sizeof(batten_saddle) + k * sizeof(double); }

size_t batten_saddle_bytes(batten_saddle_method method, size_t n, size_t k) {
  size_t order, bytes;
  if (k > n || !batten_add(n, k, &order) || !batten_la_fits(order)) return SIZE_MAX;
  if (method == BATTEN_SADDLE_ITERATIVE) {
    bytes = batten_saddle_iterative_bytes(NULL, n, k);
    return batten_add(bytes, handle_bytes(k), &bytes) ? bytes : SIZE_MAX;
  }
  bool dense = method == BATTEN_SADDLE_LDL || method == BATTEN_SADDLE_QR;
  if (dense)
    bytes = batten_saddle_dense_bytes(method, n, k);
  else
    bytes = batten_saddle_project_bytes(method == BATTEN_SADDLE_CHOLESKY_MIXED ? BATTEN_LA_FLOAT : BATTEN_LA_DOUBLE,
                                        n, k);
  size_t fixed = handle_bytes(k) + (dense ? 0 : qr_bytes(n, k));
  return batten_add(bytes, fixed, &bytes) ? bytes : SIZE_MAX;
}

/* What the context still allows for a factor: what the handle itself holds is part of the prediction, and a factor
 * at hand makes room for the next. */
static size_t allowed_bytes(const batten_saddle *s) {
  size_t own = handle_bytes(s->matrix.k) + (s->qr.v ? qr_bytes(s->matrix.n, s->matrix.k) : 0), allowed;
  if (s->factored) own += s->info.bytes;
  batten_add(batten_bytes_available(s->ctx), own, &allowed);
  return allowed;
}

static size_t wanted_bytes(const batten_saddle *s, batten_saddle_method method) {
  size_t bytes;
  if (method != BATTEN_SADDLE_ITERATIVE) return batten_saddle_bytes(method, s->matrix.n, s->matrix.k);
  return batten_add(batten_saddle_iterative_bytes(s, s->matrix.n, s->matrix.k), handle_bytes(s->matrix.k), &bytes)
             ? bytes
             : SIZE_MAX;
}

static bool fits(const batten_saddle *s, batten_saddle_method method) {
  return wanted_bytes(s, method) <= allowed_bytes(s);
}

static batten_saddle_method first_method(const batten_saddle *s) {
  if (s->options.method != BATTEN_SADDLE_AUTO) return s->options.method;
  bool mixed_pays = s->matrix.n >= MIXED_FROM && !s->options.smooth_kernel;
  if (mixed_pays || !fits(s, BATTEN_SADDLE_CHOLESKY)) return BATTEN_SADDLE_CHOLESKY_MIXED;
  return BATTEN_SADDLE_CHOLESKY;
}

static batten_status too_large(const batten_saddle *s, batten_saddle_method method, const char *reason) {
  return batten_fail(
      s->ctx, BATTEN_E_TOO_LARGE,
      "matrix.n: %zu rows by %s take %zu bytes, the context allows %zu%s%s; raise memory_limit or use fewer "
      "points%s",
      s->matrix.n, batten_saddle_method_name(method), wanted_bytes(s, method), allowed_bytes(s),
      *reason ? ", since " : "", reason,
      method == BATTEN_SADDLE_CHOLESKY_MIXED || method == BATTEN_SADDLE_ITERATIVE || *reason
          ? ""
          : ", or method cholesky-mixed");
}

/* The method to try after `method`; AUTO when there is none. */
static batten_saddle_method next_method(batten_saddle_method method) {
  if (method == BATTEN_SADDLE_CHOLESKY_MIXED) return BATTEN_SADDLE_CHOLESKY;
  return method == BATTEN_SADDLE_CHOLESKY ? BATTEN_SADDLE_LDL : BATTEN_SADDLE_AUTO;
}

/* ---- Factor ---- */

static void free_factor(batten_saddle *s) {
  batten_saddle_project_free(s);
  batten_saddle_dense_free(s);
  batten_saddle_iterative_free(s);
  s->factored = false;
}

static batten_status factor_with(batten_saddle *s, batten_saddle_method method) {
  bool mixed = method == BATTEN_SADDLE_CHOLESKY_MIXED;
  free_factor(s);
  s->info.method = method;
  if (method == BATTEN_SADDLE_ITERATIVE) {
    batten_saddle_qr_free(s); /* its levels have polynomials of their own */
    return batten_saddle_iterative_new(s);
  }
  if (method == BATTEN_SADDLE_LDL || method == BATTEN_SADDLE_QR) {
    batten_saddle_qr_free(s);
    return batten_saddle_dense_factor(s, method);
  }
  if (s->matrix.k > 0 && !s->qr.v) {
    batten_status st = batten_saddle_qr_new(s);
    if (st < 0) return st;
  }
  return batten_saddle_project_factor(s, mixed ? BATTEN_LA_FLOAT : BATTEN_LA_DOUBLE);
}

/* Factors by method, or by the first after it that works. */
static batten_status factor_from(batten_saddle *s, batten_saddle_method method) {
  for (;;) {
    batten_status st = factor_with(s, method);
    batten_saddle_method next = next_method(method);
    s->factored = st == BATTEN_OK;
    if (st != BATTEN_E_SINGULAR || next == BATTEN_SADDLE_AUTO) return st;
    if (!fits(s, next)) {
      if (method == BATTEN_SADDLE_CHOLESKY_MIXED) return too_large(s, next, batten_error(s->ctx));
      return batten_fail(s->ctx, BATTEN_E_SINGULAR,
                         "%s; merge duplicate points or check the kernel's sign (ldl, which "
                         "could say more, does not fit)",
                         batten_error(s->ctx));
    }
    s->info.fallbacks++;
    method = next;
  }
}

/* ---- Arguments ---- */

static batten_status check_matrix(batten_context *ctx, const batten_saddle_matrix *m) {
  size_t order;
  if (!batten_add(m->n, m->k, &order) || !batten_la_fits(order))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "matrix.n: %zu + %zu rows exceed LAPACK's integers", m->n, m->k);
  if (m->k >= m->n && m->k > 0)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "matrix.k: %zu columns of P need more than %zu rows; add points or lower "
                       "the polynomial degree",
                       m->k, m->n);
  if (m->k > 0 && !m->p) return batten_fail(ctx, BATTEN_E_INVALID, "matrix.p: NULL with k = %zu", m->k);
  if (m->n > 0 && !m->fill) return batten_fail(ctx, BATTEN_E_INVALID, "matrix.fill: NULL; give a callback");
  size_t bad = batten_first_nonfinite(m->n * m->k, m->p);
  if (bad < m->n * m->k)
    return batten_fail(ctx, BATTEN_E_INVALID, "matrix.p[%zu][%zu]: %g is not finite", bad / m->n, bad % m->n,
                       m->p[bad]);
  return BATTEN_OK;
}

static batten_status check_options(batten_context *ctx, const batten_saddle_options *o) {
  batten_status st = batten_check_struct(ctx, "batten_saddle_options", o->struct_size, sizeof *o);
  if (st < 0) return st;
  if ((int)o->method < BATTEN_SADDLE_AUTO || (int)o->method > BATTEN_SADDLE_ITERATIVE)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.method: %d; use one of batten_saddle_method", (int)o->method);
  if (!(o->residual_tol > 0 && o->residual_tol <= DBL_MAX))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.residual_tol: %g; must be positive", o->residual_tol);
  if (!(o->accuracy >= ACCURACY_MIN && o->accuracy <= ACCURACY_MAX))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.accuracy: %g; give %g .. %g", o->accuracy, ACCURACY_MIN,
                       ACCURACY_MAX);
  if (!(o->products_accuracy == 0 || (o->products_accuracy > 0 && o->products_accuracy <= ACCURACY_MAX)))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.products_accuracy: %g; give up to %g, or 0 to have it chosen",
                       o->products_accuracy, ACCURACY_MAX);
  if (!(o->overlap >= 0 && o->overlap <= SADDLE_OVERLAP_MAX))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.overlap: %g; give 0 .. %d", o->overlap, SADDLE_OVERLAP_MAX);
  if ((int)o->krylov < BATTEN_SADDLE_KRYLOV_AUTO || (int)o->krylov > BATTEN_SADDLE_CG)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.krylov: %d; use one of batten_saddle_krylov", (int)o->krylov);
  if (o->iterations_max == 0) return batten_fail(ctx, BATTEN_E_INVALID, "opt.iterations_max: 0; must be positive");
  return BATTEN_OK;
}

/* What only the iterative method asks for. */
static batten_status check_sums(batten_context *ctx, const batten_saddle_matrix *m) {
  const batten_saddle_sums *s = m->sums;
  if (!s)
    return batten_fail(
        ctx, BATTEN_E_INVALID,
        "matrix.sums: NULL, but opt.method is iterative, which needs products and points; give them, or "
        "choose another method");
  if (s->dimension < 1 || s->dimension > 3)
    return batten_fail(ctx, BATTEN_E_INVALID, "matrix.sums.dimension: %u; give 1 .. 3", s->dimension);
  if (!s->plan || !s->apply || !s->release)
    return batten_fail(ctx, BATTEN_E_INVALID, "matrix.sums.%s: NULL; give a callback",
                       !s->plan    ? "plan"
                       : !s->apply ? "apply"
                                   : "release");
  if (m->n > 0 && !s->points) return batten_fail(ctx, BATTEN_E_INVALID, "matrix.sums.points: NULL");
  size_t count = m->n * s->dimension;
  for (size_t i = 0; i < count; i++)
    if (!(fabs(s->points[i]) <= COORDINATE_MAX))
      return batten_fail(ctx, BATTEN_E_INVALID, "matrix.sums.points[%zu]: coordinate %zu is %g; must be within %g",
                         i / s->dimension, i % s->dimension, s->points[i], COORDINATE_MAX);
  return BATTEN_OK;
}

/* A handle takes memory and progress from its own context, so another thread's must not come in with it. */
static batten_status check_handle(batten_context *ctx, const batten_saddle *s) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!s) return batten_fail(ctx, BATTEN_E_INVALID, "s: NULL; make it with batten_saddle_factor()");
  if (s->ctx != ctx)
    return batten_fail(ctx, BATTEN_E_INVALID, "s: made with another context; pass the one it was factored with");
  return BATTEN_OK;
}

static void scale_p(batten_saddle *s) {
  size_t n = s->matrix.n;
  for (size_t c = 0; c < s->matrix.k; c++) {
    double largest = 0;
    for (size_t i = 0; i < n; i++) largest = fmax(largest, fabs(s->matrix.p[i + c * n]));
    s->p_scale[c] = largest > 0 ? batten_unit(largest) : 1;
  }
}

batten_status batten_saddle_factor(batten_context *ctx, const batten_saddle_matrix *matrix,
                                   const batten_saddle_options *opt, batten_saddle **out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!matrix || !out) return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL", matrix ? "out" : "matrix");
  batten_saddle_options options = opt ? *opt : batten_saddle_options_default();
  batten_status st = check_options(ctx, &options);
  if (st < 0) return st;
  st = check_matrix(ctx, matrix);
  if (st < 0) return st;
  if (options.method == BATTEN_SADDLE_ITERATIVE) {
    st = check_sums(ctx, matrix);
    if (st < 0) return st;
  }

  batten_saddle *s = batten_alloc(ctx, sizeof *s);
  if (!s) return BATTEN_E_NOMEM;
  *s = (batten_saddle){.ctx = ctx, .matrix = *matrix, .options = options};
  st = BATTEN_E_NOMEM;
  s->p_scale = batten_alloc_array(ctx, matrix->k, sizeof *s->p_scale);
  if (!s->p_scale) goto done;
  batten_saddle_method method = first_method(s);
  if (!fits(s, method)) {
    st = too_large(s, method, "");
    goto done;
  }
  scale_p(s);
  st = batten_saddle_probe_scale(s);
  if (st < 0) goto done;
  st = batten_saddle_qr_new(s); /* for LDL' and QR too: it tells dependent columns of P from other troubles */
  if (st < 0) goto done;
  st = factor_from(s, method);
done:
  if (st < 0)
    batten_saddle_free(s);
  else
    *out = s;
  return st;
}

void batten_saddle_free(batten_saddle *s) {
  if (!s) return;
  free_factor(s);
  batten_saddle_qr_free(s);
  batten_free(s->ctx, s->begin);
  batten_free(s->ctx, s->p_scale);
  batten_free(s->ctx, s);
}

batten_saddle_info batten_saddle_get_info(const batten_saddle *s) { return s->info; }

batten_status batten_saddle_begin_at(batten_context *ctx, batten_saddle *s, const double *w) {
  batten_status st = check_handle(ctx, s);
  if (st < 0) return st;
  size_t n = s->matrix.n;
  size_t bad = w ? batten_first_nonfinite(n, w) : n;
  if (bad < n) return batten_fail(ctx, BATTEN_E_INVALID, "w[%zu]: %g is not finite", bad, w[bad]);
  if (s->info.method != BATTEN_SADDLE_ITERATIVE) return BATTEN_OK;
  if (w && !s->begin) {
    s->begin = batten_alloc_array(ctx, n, sizeof *s->begin);
    if (!s->begin) return BATTEN_E_NOMEM;
  }
  if (w && n > 0) memcpy(s->begin, w, n * sizeof *w);
  if (!w) {
    batten_free(ctx, s->begin);
    s->begin = NULL;
  }
  return BATTEN_OK;
}

/* ---- Solve ---- */

batten_status batten_saddle_apply(const batten_saddle *s, double *b) {
  size_t n = s->matrix.n, k = s->matrix.k;
  for (size_t i = 0; i < n; i++) b[i] *= s->scale;
  for (size_t c = 0; c < k; c++) b[n + c] *= s->p_scale[c];
  batten_status st = s->a ? batten_saddle_dense_solve(s, 1, b) : batten_saddle_project_solve(s, b);
  /* First by the one, then by the other: their quotient may leave the range of a double. */
  for (size_t c = 0; c < k; c++) b[n + c] = b[n + c] / s->scale * s->p_scale[c];
  return st;
}

static double norm_max(size_t n, const double *x) {
  double largest = 0;
  for (size_t i = 0; i < n; i++) {
    if (!(fabs(x[i]) <= DBL_MAX)) return INFINITY; /* an overflow in the factor counts as a miss, not as nothing */
    largest = fmax(largest, fabs(x[i]));
  }
  return largest;
}

/* r [N+k] = right side - matrix * x, x [N+k]. */
static batten_status residual(const batten_saddle *s, const double *f, const double *x, double *r) {
  size_t n = s->matrix.n, k = s->matrix.k;
  const double *p = s->matrix.p;
  batten_status st = batten_saddle_product(s, "residual", false, 1, x, r);
  if (st < 0) return st;
  for (size_t c = 0; c < k; c++) {
    double sum = 0;
    for (size_t i = 0; i < n; i++) {
      r[i] += p[i + c * n] * x[n + c];
      sum += p[i + c * n] * x[i];
    }
    r[n + c] = -sum;
  }
  for (size_t i = 0; i < n; i++) r[i] = f[i] - r[i];
  return BATTEN_OK;
}

/* The residual that rounding alone leaves: eps * max(|K||w| + |P||c| + |f|) / max |f|, times a few. scratch [N]. */
static batten_status attainable(const batten_saddle *s, const double *f, const double *x, double f_norm,
                                double *scratch, double *out) {
  size_t n = s->matrix.n, k = s->matrix.k;
  batten_status st = batten_saddle_product(s, "residual", true, 1, x, scratch);
  if (st < 0) return st;
  for (size_t c = 0; c < k; c++)
    for (size_t i = 0; i < n; i++) scratch[i] += fabs(s->matrix.p[i + c * n] * x[n + c]);
  for (size_t i = 0; i < n; i++) scratch[i] += fabs(f[i]);
  *out = 8 * DBL_EPSILON * norm_max(n, scratch) / f_norm;
  return BATTEN_OK;
}

/* Solves and refines with the factor at hand. x, r, best [N+k]; the best solution ends in best, its residual in
 * info. *stalled: refinement stopped above the tolerance. */
static batten_status refine(batten_saddle *s, const double *f, double f_norm, double *x, double *r, double *best,
                            bool *stalled) {
  size_t n = s->matrix.n, order = batten_saddle_order(s);
  double last = INFINITY;
  memcpy(r, f, n * sizeof *r);
  memset(r + n, 0, s->matrix.k * sizeof *r);
  memset(x, 0, order * sizeof *x);
  memset(best, 0, order * sizeof *best);
  *stalled = false;
  s->info.residual = 1; /* of zero */
  for (unsigned step = 0;; step++) {
    batten_status st = batten_saddle_apply(s, r);
    if (st < 0) return st;
    for (size_t i = 0; i < order; i++) x[i] += r[i];
    st = residual(s, f, x, r);
    if (st < 0) return st;
    double now = norm_max(n, r) / f_norm;
    if (now < s->info.residual) {
      s->info.residual = now;
      s->info.refinements = step;
      memcpy(best, x, order * sizeof *best);
    }
    if (now <= s->options.residual_tol) return BATTEN_OK;
    *stalled = !(now <= STALL * last) && step > 0;
    if (*stalled || step >= s->options.refine_max) return BATTEN_OK;
    last = now;
  }
}

batten_status batten_saddle_solve(batten_context *ctx, batten_saddle *s, const double *f, double *w, double *c) {
  batten_status st = check_handle(ctx, s);
  if (st < 0) return st;
  size_t n = s->matrix.n, k = s->matrix.k, order = n + k;
  if ((n > 0 && (!f || !w)) || (k > 0 && !c))
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL", n > 0 && !f ? "f" : n > 0 && !w ? "w" : "c");
  size_t bad = batten_first_nonfinite(n, f);
  if (bad < n) return batten_fail(ctx, BATTEN_E_INVALID, "f[%zu]: %g is not finite", bad, f[bad]);

  double start = batten_now(), f_norm = norm_max(n, f);
  if (s->info.method == BATTEN_SADDLE_ITERATIVE) {
    st = s->factored ? BATTEN_OK : factor_from(s, s->info.method);
    if (st == BATTEN_OK) st = batten_saddle_iterative_solve(s, f, w, c);
    if (st >= 0) s->info.time_solve_s = batten_now() - start;
    return st;
  }
  double *x = batten_alloc_array(ctx, order, 3 * sizeof *x);
  if (!x) return BATTEN_E_NOMEM;
  double *r = x + order, *best = r + order;
  bool stalled = false;
  s->info.residual = 0;
  s->info.refinements = 0;
  memset(best, 0, order * sizeof *best);
  if (!s->factored) st = factor_from(s, s->info.method);
  while (st == BATTEN_OK && f_norm > 0) {
    st = refine(s, f, f_norm, x, r, best, &stalled);
    if (st < 0 || !stalled || next_method(s->info.method) == BATTEN_SADDLE_AUTO) break;
    /* A better factor helps only where rounding of the solution itself is not the limit, and needs room. */
    double limit;
    st = attainable(s, f, best, f_norm, r, &limit);
    if (st < 0 || s->info.residual <= limit || !fits(s, next_method(s->info.method))) break;
    s->info.fallbacks++;
    st = factor_from(s, next_method(s->info.method));
  }
  if (st < 0) goto done;
  if (n > 0) memcpy(w, best, n * sizeof *w);
  if (k > 0) memcpy(c, best + n, k * sizeof *c);
  s->info.time_solve_s = batten_now() - start;
  if (s->info.residual > s->options.residual_tol)
    st = batten_fail(ctx, BATTEN_W_ACCURACY,
                     "residual: %.3g after %u refinements, above the tolerance %.3g; rcond %.3g", s->info.residual,
                     s->info.refinements, s->options.residual_tol, s->info.rcond);
done:
  batten_free(ctx, x);
  return st;
}

/* ---- Diagonal of the inverse ---- */

enum { RIGHT_SIDES = 64 }; /* solved at a time: enough for level-3 BLAS */

/* diagonal of the inverse of the scaled matrix, by the whole factor: full solves. */
static batten_status dense_diagonal(const batten_saddle *s, size_t count, const size_t *index, double *diagonal) {
  size_t order = batten_saddle_order(s);
  double *b = batten_alloc_array(s->ctx, order * count, sizeof *b);
  if (!b) return BATTEN_E_NOMEM;
  memset(b, 0, order * count * sizeof *b);
  for (size_t q = 0; q < count; q++) b[index[q] + q * order] = 1;
  batten_status st = batten_saddle_dense_solve(s, count, b);
  for (size_t q = 0; q < count; q++) diagonal[q] = b[index[q] + q * order];
  batten_free(s->ctx, b);
  return st;
}

batten_status batten_saddle_inverse_diagonal(batten_context *ctx, batten_saddle *s, size_t count, const size_t *index,
                                             double *diagonal) {
  batten_status st = check_handle(ctx, s);
  if (st < 0) return st;
  if (count > 0 && (!index || !diagonal))
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL", index ? "diagonal" : "index");
  size_t n = s->matrix.n;
  for (size_t q = 0; q < count; q++)
    if (index[q] >= n)
      return batten_fail(ctx, BATTEN_E_INVALID, "index[%zu]: %zu; must be below %zu", q, index[q], n);

  if (s->info.method == BATTEN_SADDLE_ITERATIVE)
    return batten_fail(ctx, BATTEN_E_INVALID, "s: method iterative has no factor; choose another method");

  double *result = batten_alloc_array(ctx, count, sizeof *result);
  if (!result) return BATTEN_E_NOMEM;
  st = s->factored ? BATTEN_OK : factor_from(s, s->info.method);
  for (size_t first = 0; first < count && st == BATTEN_OK; first += RIGHT_SIDES) {
    size_t these = count - first < RIGHT_SIDES ? count - first : RIGHT_SIDES;
    st = batten_progress(ctx, "leave-one-out", (double)first / (double)count);
    if (st < 0) break;
    st = s->a ? dense_diagonal(s, these, index + first, result + first)
              : batten_saddle_project_diagonal(s, these, index + first, result + first);
  }
  for (size_t q = 0; q < count && st == BATTEN_OK; q++) diagonal[q] = s->scale * result[q];
  batten_free(ctx, result);
  return st;
}
