/* The fitted volume spline: making, sharing, evaluating.   [Savchenko et al. 1995, section 3]
 *
 * A spline is immutable after batten_spline_create. Beside the parts as the caller gave them it keeps the
 * centres in the unit box, one array per axis, those with gradients last: the form that the inner loops read.
 * Evaluation cuts the points into tasks; each point's sum is made by one task in a fixed order. */
#include "spline/inner.h"

#include "base/checked.h"
#include "basis/green.h"

/* ---- making ---- */

batten_spline_data batten_spline_data_default(void) {
  return (batten_spline_data){.struct_size = sizeof(batten_spline_data), .n = 3};
}

static batten_status check_finite(batten_context *ctx, const char *name, size_t count, const double *values) {
  size_t i = batten_first_nonfinite(count, values);
  if (i == count) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "%s[%zu]: %g; must be finite", name, i, values[i]);
}

static batten_status check_parts(batten_context *ctx, const batten_spline_parts *p) {
  batten_status st = batten_check_struct(ctx, "batten_spline_parts", p->struct_size, sizeof *p);
  if (st < 0) return st;
  if (!batten_green_exists(p->n, p->m))
    return batten_fail(ctx, BATTEN_E_INVALID, "parts.n = %u, parts.m = %u; n must be 1 .. 3, m <= 4, 2m > n", p->n,
                       p->m);
  unsigned k = batten_polynomial_count(p->n, p->m - 1);
  if (p->polynomial_count != k)
    return batten_fail(ctx, BATTEN_E_INVALID, "parts.polynomial_count: %zu; %u for n = %u, m = %u",
                       p->polynomial_count, k, p->n, p->m);
  if (p->gradient_count > p->count)
    return batten_fail(ctx, BATTEN_E_INVALID, "parts.gradient_count: %zu, more than parts.count = %zu",
                       p->gradient_count, p->count);
  if (p->gradient_count && batten_green_power(p->n, p->m) <= 2)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "parts.gradient_count: %zu with n = %u, m = %u; gradients need 2m - n > 2", p->gradient_count,
                       p->n, p->m);
  if (!p->polynomial || (p->count && (!p->centers || !p->coefficients)) ||
      (p->gradient_count && (!p->gradient_at || !p->gradient_coefficients)))
    return batten_fail(ctx, BATTEN_E_INVALID, "parts: an array is NULL");
  size_t size;
  if (!batten_mul3(p->count, 16, sizeof(double), &size)) /* 16: more doubles than a centre takes here */
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "parts.count: %zu", p->count);
  for (size_t q = 0; q < p->gradient_count; q++)
    if (p->gradient_at[q] >= p->count || (q > 0 && p->gradient_at[q] <= p->gradient_at[q - 1]))
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "parts.gradient_at[%zu]: %zu; must increase and be < parts.count = %zu", q,
                         p->gradient_at[q], p->count);
  if (!(p->scale > 0) || !isfinite(p->scale))
    return batten_fail(ctx, BATTEN_E_INVALID, "parts.scale: %g; must be > 0 and finite", p->scale);
  if ((st = check_finite(ctx, "parts.origin", p->n, p->origin)) < 0) return st;
  if ((st = check_finite(ctx, "parts.centers", p->count * p->n, p->centers)) < 0) return st;
  if ((st = check_finite(ctx, "parts.coefficients", p->count, p->coefficients)) < 0) return st;
  if ((st = check_finite(ctx, "parts.polynomial", k, p->polynomial)) < 0) return st;
  return check_finite(ctx, "parts.gradient_coefficients", p->gradient_count * p->n, p->gradient_coefficients);
}

static double *copy(double *to, size_t count, const double *from) {
  if (count) memcpy(to, from, count * sizeof *to);
  return to + count;
}

/* Centre i of the caller as term j. */
static void set_term(const batten_spline *s, double *x[3], double *w, size_t j, size_t i) {
  const batten_spline_parts *p = &s->parts;
  for (unsigned a = 0; a < p->n; a++) x[a][j] = spline_to_box(p->centers[i * p->n + a], p->origin[a], p->scale);
  w[j] = batten_green_sign(s->terms.power) * p->coefficients[i];
}

/* The centres in the unit box, plain ones first; `to` has room for (n + 1) N + n M numbers. */
static void make_terms(batten_spline *s, double *to) {
  const batten_spline_parts *p = &s->parts;
  double *x[3] = {NULL, NULL, NULL}, *w, *g[3] = {NULL, NULL, NULL};
  for (unsigned a = 0; a < p->n; a++, to += p->count) x[a] = to;
  w = to, to += p->count;
  for (unsigned a = 0; a < p->n; a++, to += p->gradient_count) g[a] = to;
  s->terms = (spline_terms){.n = p->n,
                            .power = batten_green_power(p->n, p->m),
                            .plain = p->count - p->gradient_count,
                            .hermite = p->gradient_count,
                            .x = {x[0], x[1], x[2]},
                            .w = w,
                            .g = {g[0], g[1], g[2]}};
  for (size_t i = 0, j = 0, q = 0; i < p->count; i++) {
    if (q == p->gradient_count || p->gradient_at[q] != i) {
      set_term(s, x, w, j++, i);
      continue;
    }
    set_term(s, x, w, s->terms.plain + q, i);
    for (unsigned a = 0; a < p->n; a++)
      g[a][q] = batten_green_sign(s->terms.power) * p->gradient_coefficients[q * p->n + a];
    q++;
  }
}

batten_status batten_spline_create(batten_context *ctx, const batten_spline_parts *parts, batten_spline **out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!parts || !out) return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL", parts ? "out" : "parts");
  batten_status st = check_parts(ctx, parts);
  if (st < 0) return st;
  const size_t n = parts->n, count = parts->count, gradients = parts->gradient_count, k = parts->polynomial_count;
  st = BATTEN_E_NOMEM;
  batten_spline *s = batten_alloc(ctx, sizeof *s);
  if (!s) goto done;
  *s = (batten_spline){.ctx = ctx, .parts = *parts, .basis = batten_polynomial_basis(parts->n, parts->m - 1)};
  atomic_init(&s->owners, 1);
  /* Caller's form and evaluator's form, one after the other. */
  s->numbers = batten_alloc_array(ctx, 2 * (count * (n + 1) + gradients * n) + k, sizeof *s->numbers);
  s->gradient_at = batten_alloc_array(ctx, gradients, sizeof *s->gradient_at);
  if (!s->numbers || !s->gradient_at) goto done;
  if (gradients) memcpy(s->gradient_at, parts->gradient_at, gradients * sizeof *s->gradient_at);
  double *to = s->numbers;
  s->parts.gradient_at = s->gradient_at;
  s->parts.centers = to, to = copy(to, count * n, parts->centers);
  s->parts.coefficients = to, to = copy(to, count, parts->coefficients);
  s->parts.gradient_coefficients = to, to = copy(to, gradients * n, parts->gradient_coefficients);
  s->parts.polynomial = to, to = copy(to, k, parts->polynomial);
  make_terms(s, to);
  st = batten_spline_clusters_new(ctx, &s->terms, &s->clusters);
  if (st < 0) goto done;
  *out = s;
  s = NULL;
done:
  batten_spline_free(s);
  return st;
}

void batten_spline_get_parts(const batten_spline *s, batten_spline_parts *parts) { *parts = s->parts; }

batten_spline *batten_spline_retain(batten_spline *s) {
  if (s) atomic_fetch_add(&s->owners, 1);
  return s;
}

void batten_spline_free(batten_spline *s) {
  if (!s || atomic_fetch_sub(&s->owners, 1) != 1) return;
  batten_spline_clusters_free(s->ctx, &s->clusters);
  batten_free(s->ctx, s->gradient_at);
  batten_free(s->ctx, s->numbers);
  batten_free(s->ctx, s);
}

/* ---- evaluating ---- */

enum { TASK_POINTS = 64 };
/* Terms below which a second thread costs more than it saves (20 us against 0.3 ns a term), and terms between two
 * calls of the host's progress callback (some hundredths of a second). */
static const size_t TERMS_SERIAL = 200000, TERMS_PROGRESS = 64000000;

typedef struct evaluation {
  const batten_spline *spline;
  spline_sum_function *sum;
  unsigned order;
  size_t count;
  const double *points;
  double *values, *gradients, *hessians;
} evaluation;

/* Row-major entries of the Hessian among the sums. */
static const unsigned char hessian_sum[3][3] = {{4, 5, 6}, {5, 7, 8}, {6, 8, 9}};

static void store_point(const evaluation *e, size_t point, const double sums[SPLINE_SUMS]) {
  const unsigned n = e->spline->parts.n;
  const double scale = e->spline->parts.scale;
  if (e->values) e->values[point] = sums[0];
  for (unsigned a = 0; a < n && e->gradients; a++) e->gradients[point * n + a] = sums[1 + a] / scale;
  for (unsigned a = 0; a < n && e->hessians; a++)
    for (unsigned b = 0; b < n; b++) e->hessians[(point * n + a) * n + b] = sums[hessian_sum[a][b]] / scale / scale;
}

/* Points first .. first + lanes - 1, lanes <= SPLINE_LANES; lanes left over repeat the last point. */
static void evaluate_lanes(const evaluation *e, size_t first, size_t lanes) {
  const batten_spline_parts *p = &e->spline->parts;
  double y[3][SPLINE_LANES] = {{0}}, sums[SPLINE_SUMS][SPLINE_LANES] = {{0}};
  for (size_t lane = 0; lane < SPLINE_LANES; lane++) {
    const double *x = e->points + (first + (lane < lanes ? lane : lanes - 1)) * p->n;
    for (unsigned a = 0; a < p->n; a++) y[a][lane] = spline_to_box(x[a], p->origin[a], p->scale);
  }
  e->sum(&e->spline->terms, e->order, y, sums);
  for (size_t lane = 0; lane < lanes; lane++) {
    double at[3] = {y[0][lane], y[1][lane], y[2][lane]}, total[SPLINE_SUMS];
    batten_polynomial_sum(&e->spline->basis, p->polynomial, at, e->order, total);
    for (unsigned q = 0; q < SPLINE_SUMS; q++) total[q] += sums[q][lane];
    /* The branch-free logarithm would make a number of what is none. */
    if (!isfinite(at[0]) || !isfinite(at[1]) || !isfinite(at[2]))
      for (unsigned q = 0; q < SPLINE_SUMS; q++) total[q] = NAN;
    store_point(e, first + lane, total);
  }
}

static void evaluate_task(void *arg, size_t index) {
  const evaluation *e = arg;
  size_t first = index * TASK_POINTS, last = e->count - first < TASK_POINTS ? e->count : first + TASK_POINTS;
  for (; first < last; first += SPLINE_LANES)
    evaluate_lanes(e, first, last - first < SPLINE_LANES ? last - first : SPLINE_LANES);
}

batten_status batten_spline_evaluate(batten_context *ctx, const batten_spline *s, size_t count, const double *points,
                                     double *values, double *gradients, double *hessians) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!s) return batten_fail(ctx, BATTEN_E_INVALID, "s: NULL; make it with batten_spline_fit() or _create()");
  if (count && !points) return batten_fail(ctx, BATTEN_E_INVALID, "points: NULL with count = %zu", count);
  evaluation e = {.spline = s,
                  .sum = batten_spline_code()->sum,
                  .order = hessians ? 2 : gradients != NULL,
                  .points = points,
                  .values = values,
                  .gradients = gradients,
                  .hessians = hessians};
  if (!values && !gradients && !hessians) return BATTEN_OK;
  const size_t n = s->parts.n, centres = s->parts.count ? s->parts.count : 1;
  /* Points of one piece: a multiple of TASK_POINTS, so that the tasks are the same whatever the pieces. */
  const size_t piece = (TERMS_PROGRESS / centres / TASK_POINTS + 1) * TASK_POINTS;
  for (size_t first = 0; first < count; first += e.count) {
    if (count > piece) {
      batten_status st = batten_progress(ctx, "evaluate", (double)first / (double)count);
      if (st < 0) return st;
    }
    e.count = count - first < piece ? count - first : piece;
    size_t tasks = (e.count + TASK_POINTS - 1) / TASK_POINTS;
    if (e.count < TERMS_SERIAL / centres)
      for (size_t i = 0; i < tasks; i++) evaluate_task(&e, i);
    else
      batten_parallel(ctx, tasks, evaluate_task, &e);
    e.points += e.count * n;
    if (values) e.values += e.count;
    if (gradients) e.gradients += e.count * n;
    if (hessians) e.hessians += e.count * n * n;
  }
  return BATTEN_OK;
}

static batten_status field_evaluate(const void *user, batten_context *ctx, size_t count, const double *points,
                                    double *values, double *gradients, double *hessians) {
  return batten_spline_evaluate(ctx, user, count, points, values, gradients, hessians);
}

static batten_status field_bounds(const void *user, batten_context *ctx, size_t count, const double *boxes,
                                  double *ranges) {
  return batten_spline_bounds(ctx, user, count, boxes, ranges);
}

batten_field batten_spline_field(const batten_spline *s) {
  return (batten_field){
      .dimension = s->parts.n, .order = 2, .evaluate = field_evaluate, .user = s, .bounds = field_bounds};
}
