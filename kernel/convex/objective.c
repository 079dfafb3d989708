/* Least squares and tension of tensor-product surfaces as matrices.   [Juettler 1998, section 3]
 *
 * The coordinates are fitted apart, by the same matrix N = sum of weight N_i N_j (normal equations) and the tension
 *   T = D3_u (x) D0_v + D0_u (x) D3_v + D1_u (x) D1_v,
 * Dk the Gram matrix of the k-th derivatives in one variable, exact by the product formula of Bernstein polynomials:
 *   int_0^1 B_i^p B_j^p = C(p, i) C(p, j) / (C(2 p, i + j) (2 p + 1)).
 * Normal equations square the condition; steps of refinement, with residuals of the data themselves, bring the digits
 * back. For w -> infinity only surfaces f(u) + g(v), f and g quadratic, are left: five functions. */
#include "convex_inner.h"

#include "base/checked.h"
#include "la/la.h"

#include <float.h>
#include <string.h>

enum { LIMIT = 5, REFINEMENTS = 2 };

/* ---- tension ------------------------------------------------------------------------------------ */

static double binomial(unsigned n, unsigned k) {
  double value = 1;
  for (unsigned i = 1; i <= k; i++) value = value * (n - k + i) / i;
  return value;
}

/* gram [p + 1][p + 1] of the Bernstein polynomials of degree p on [0, 1]. */
static void bernstein_gram(unsigned p, double (*gram)[BSPLINE_ORDER]) {
  for (unsigned i = 0; i <= p; i++)
    for (unsigned j = 0; j <= p; j++)
      gram[i][j] = binomial(p, i) * binomial(p, j) / (binomial(2 * p, i + j) * (2 * p + 1));
}

void convex_gram(const bspline *b, unsigned k, double *out) {
  size_t n = b->count;
  memset(out, 0, n * n * sizeof *out);
  if (k > b->degree) return;
  unsigned p = b->degree - k, order = b->degree + 1;
  double gram[BSPLINE_ORDER][BSPLINE_ORDER], rows[BSPLINE_ORDER * BSPLINE_ORDER];
  bernstein_gram(p, gram);
  for (size_t mu = bspline_first(b); mu < n; mu = bspline_next(b, mu)) {
    double lower = b->knots[mu], upper = b->knots[mu + 1];
    bspline_rows(b, mu, k, lower, upper, rows);
    for (unsigned i = 0; i < order; i++)
      for (unsigned j = 0; j < order; j++) {
        double sum = 0;
        for (unsigned r = 0; r <= p; r++)
          for (unsigned s = 0; s <= p; s++) sum += rows[r * order + i] * gram[r][s] * rows[s * order + j];
        out[(mu - b->degree + i) * n + mu - b->degree + j] += (upper - lower) * sum;
      }
  }
}

/* tension += u (x) v */
static void add_product(size_t nu, const double *u, size_t nv, const double *v, double *tension) {
  size_t n = nu * nv;
  for (size_t i = 0; i < nu; i++)
    for (size_t k = 0; k < nu; k++) {
      if (u[i * nu + k] == 0) continue;
      for (size_t j = 0; j < nv; j++)
        for (size_t l = 0; l < nv; l++) tension[(i * nv + j) * n + k * nv + l] += u[i * nu + k] * v[j * nv + l];
    }
}

/* work: convex_tension_work doubles. */
static size_t tension_work(const convex_space *s) {
  size_t nu = s->axis[0].count, nv = s->axis[1].count;
  return 3 * (nu * nu + nv * nv);
}
static void make_tension(const convex_space *s, double *work, double *tension) {
  static const unsigned orders[3] = {0, 1, 3};
  size_t nu = s->axis[0].count, nv = s->axis[1].count, n = nu * nv;
  double *u[3], *v[3];
  for (int k = 0; k < 3; k++) {
    u[k] = work;
    v[k] = work + nu * nu;
    work += nu * nu + nv * nv;
    convex_gram(&s->axis[0], orders[k], u[k]);
    convex_gram(&s->axis[1], orders[k], v[k]);
  }
  memset(tension, 0, n * n * sizeof *tension);
  add_product(nu, u[2], nv, v[0], tension);
  add_product(nu, u[0], nv, v[2], tension);
  add_product(nu, u[1], nv, v[1], tension);
}

/* ---- sums of squares ---------------------------------------------------------------------------- */

batten_status convex_objective_new(batten_context *ctx, const convex_space *space, size_t count, const double *points,
                                   const double *weights, convex_objective *out) {
  size_t n = convex_points(space), square, values;
  convex_objective o = {.n = n, .count = count, .points = points, .weights = weights};
  for (int k = 0; k < 2; k++) o.order[k] = space->axis[k].degree + 1;
  batten_mul(n, n, &square);
  batten_mul(count, o.order[0] + o.order[1], &values);
  double *work = batten_alloc_array(ctx, tension_work(space), sizeof *work);
  o.tension = batten_alloc_array(ctx, square, sizeof *o.tension);
  o.normal = batten_alloc_array(ctx, square, sizeof *o.normal);
  o.right = batten_alloc_array(ctx, 3 * n, sizeof *o.right);
  o.basis = batten_alloc_array(ctx, values, sizeof *o.basis);
  o.first = batten_alloc_array(ctx, 2 * count, sizeof *o.first);
  bool all = work && o.tension && o.normal && o.right && o.basis && o.first;
  if (all) {
    make_tension(space, work, o.tension);
    *out = o;
  } else
    convex_objective_free(ctx, &o);
  batten_free(ctx, work);
  return all ? BATTEN_OK : BATTEN_E_NOMEM;
}

void convex_objective_free(batten_context *ctx, convex_objective *o) {
  batten_free(ctx, o->first);
  batten_free(ctx, o->basis);
  batten_free(ctx, o->right);
  batten_free(ctx, o->normal);
  batten_free(ctx, o->tension);
  *o = (convex_objective){0};
}

static double weight_of(const convex_objective *o, size_t i) { return o->weights ? o->weights[i] : 1; }

/* The lower triangle of `normal` and `right` take in a point. */
static void add_point(convex_objective *o, size_t nv, size_t i) {
  const double *bu = o->basis + i * (o->order[0] + o->order[1]), *bv = bu + o->order[0];
  double weight = weight_of(o, i);
  size_t first = o->first[2 * i] * nv + o->first[2 * i + 1];
  for (unsigned a = 0; a < o->order[0]; a++)
    for (unsigned b = 0; b < o->order[1]; b++) {
      size_t row = first + a * nv + b;
      double value = weight * bu[a] * bv[b];
      for (int x = 0; x < 3; x++) o->right[(size_t)x * o->n + row] += value * o->points[3 * i + (size_t)x];
      double *line = o->normal + row * o->n + first;
      for (unsigned c = 0; c <= a; c++) {
        double part = value * bu[c];
        for (unsigned d = 0; d < o->order[1]; d++) line[c * nv + d] += part * bv[d];
      }
    }
}

void convex_objective_set(convex_objective *o, const convex_space *space, const double *parameters) {
  size_t nv = space->axis[1].count;
  memset(o->normal, 0, o->n * o->n * sizeof *o->normal);
  memset(o->right, 0, 3 * o->n * sizeof *o->right);
  for (size_t i = 0; i < o->count; i++) {
    double *values = o->basis + i * (o->order[0] + o->order[1]);
    for (int k = 0; k < 2; k++) {
      const bspline *b = &space->axis[k];
      size_t mu = bspline_span(b, parameters[2 * i + (size_t)k]);
      bspline_basis(b, mu, parameters[2 * i + (size_t)k], 0, values + (k ? o->order[0] : 0));
      o->first[2 * i + (size_t)k] = (uint32_t)(mu - b->degree);
    }
    add_point(o, nv, i);
  }
  for (size_t i = 0; i < o->n; i++) /* blocks on the diagonal were filled on both sides, with the same sums */
    for (size_t j = 0; j < i; j++) o->normal[j * o->n + i] = o->normal[i * o->n + j];
}

/* point - x(u, v) of point i. control [n][3]. */
static void residual_of(const convex_objective *o, size_t nv, const double *control, size_t i, double *out) {
  const double *bu = o->basis + i * (o->order[0] + o->order[1]), *bv = bu + o->order[0];
  size_t first = o->first[2 * i] * nv + o->first[2 * i + 1];
  double x[3] = {0, 0, 0};
  for (unsigned a = 0; a < o->order[0]; a++) {
    double row[3] = {0, 0, 0};
    const double *points = control + 3 * (first + a * nv);
    for (unsigned b = 0; b < o->order[1]; b++)
      for (int k = 0; k < 3; k++) row[k] += bv[b] * points[3 * b + (unsigned)k];
    for (int k = 0; k < 3; k++) x[k] += bu[a] * row[k];
  }
  for (int k = 0; k < 3; k++) out[k] = o->points[3 * i + (size_t)k] - x[k];
}

double convex_objective_sum(const convex_objective *o, const convex_space *space, const double *control) {
  double sum = 0, r[3];
  for (size_t i = 0; i < o->count; i++) {
    residual_of(o, space->axis[1].count, control, i, r);
    sum += weight_of(o, i) * (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
  }
  return sum;
}

/* ---- minima ------------------------------------------------------------------------------------- */

/* Minus half the gradient at control: gradient [3][n]. */
static void descent(const convex_objective *o, size_t nv, double w, const double *control, double *gradient) {
  memset(gradient, 0, 3 * o->n * sizeof *gradient);
  for (size_t i = 0; i < o->count; i++) {
    const double *bu = o->basis + i * (o->order[0] + o->order[1]), *bv = bu + o->order[0];
    size_t first = o->first[2 * i] * nv + o->first[2 * i + 1];
    double r[3], weight = weight_of(o, i);
    residual_of(o, nv, control, i, r);
    for (unsigned a = 0; a < o->order[0]; a++)
      for (unsigned b = 0; b < o->order[1]; b++)
        for (size_t k = 0; k < 3; k++) gradient[k * o->n + first + a * nv + b] += weight * bu[a] * bv[b] * r[k];
  }
  for (size_t i = 0; i < o->n && w > 0; i++)
    for (size_t j = 0; j < o->n; j++)
      for (size_t k = 0; k < 3; k++) gradient[k * o->n + i] -= w * o->tension[i * o->n + j] * control[3 * j + k];
}

/* factor = S (N + w T) S, S making its diagonal ones, then its Cholesky factor. False: not definite to rounding. */
static bool factor_scaled(const convex_objective *o, double w, double *factor, double *scale) {
  size_t n = o->n;
  for (size_t i = 0; i < n; i++) {
    double diagonal = o->normal[i * n + i] + w * o->tension[i * n + i];
    if (!(diagonal > 0)) return false;
    scale[i] = 1 / sqrt(diagonal);
  }
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < n; j++)
      factor[i * n + j] = (o->normal[i * n + j] + w * o->tension[i * n + j]) * scale[i] * scale[j];
  if (batten_la_potrf(BATTEN_LA_DOUBLE, 'L', n, factor, n) != 0) return false;
  double least = 1;
  for (size_t i = 0; i < n; i++) least = fmin(least, factor[i * n + i]);
  return least * least > 4 * (double)n * DBL_EPSILON;
}

/* x [3][n] := (N + w T)^-1 x */
static void solve_scaled(size_t n, const double *factor, const double *scale, double *x) {
  for (size_t k = 0; k < 3; k++) {
    double *column = x + k * n;
    for (size_t i = 0; i < n; i++) column[i] *= scale[i];
    batten_la_trsv(BATTEN_LA_DOUBLE, 'L', 'N', n, factor, n, column);
    batten_la_trsv(BATTEN_LA_DOUBLE, 'L', 'T', n, factor, n, column);
    for (size_t i = 0; i < n; i++) column[i] *= scale[i];
  }
}

batten_status convex_objective_solve(batten_context *ctx, const convex_objective *o, const convex_space *space,
                                     double w, double *control) {
  size_t n = o->n;
  batten_status st = BATTEN_E_NOMEM;
  double *factor = batten_alloc_array(ctx, n * n, sizeof *factor);
  double *step = batten_alloc_array(ctx, 7 * n, sizeof *step), *scale = step ? step + 3 * n : NULL;
  double *x = step ? step + 4 * n : NULL;
  if (!factor || !step) goto done;
  if (!factor_scaled(o, w, factor, scale)) {
    st = batten_fail(ctx, BATTEN_E_SINGULAR,
                     "parameters: these %zu do not determine the %zu control points%s; give more points, a "
                     "domain that they fill (all NaN), a lower degree, fewer spans%s",
                     o->count, n, w > 0 ? ", even with this tension" : "", w > 0 ? "" : ", or opt.tension > 0");
    goto done;
  }
  memset(x, 0, 3 * n * sizeof *x);
  for (int pass = 0; pass <= REFINEMENTS; pass++) {
    if (pass == 0)
      memcpy(step, o->right, 3 * n * sizeof *step);
    else
      descent(o, space->axis[1].count, w, x, step);
    solve_scaled(n, factor, scale, step);
    for (size_t i = 0; i < n; i++)
      for (size_t k = 0; k < 3; k++) x[3 * i + k] += step[k * n + i];
  }
  memcpy(control, x, 3 * n * sizeof *control);
  st = BATTEN_OK;
done:
  batten_free(ctx, step);
  batten_free(ctx, factor);
  return st;
}

/* ---- the limit ---------------------------------------------------------------------------------- */

/* Where the parameters lie in a direction: their weighted mean, and their reach from it. */
static void centre(const convex_objective *o, const double *parameters, size_t axis, double *mean, double *reach) {
  double sum = 0, total = 0;
  for (size_t i = 0; i < o->count; i++) {
    sum += weight_of(o, i) * parameters[2 * i + axis];
    total += weight_of(o, i);
  }
  *mean = sum / total;
  *reach = 0;
  for (size_t i = 0; i < o->count; i++) *reach = fmax(*reach, fabs(parameters[2 * i + axis] - *mean));
}

/* Values of the blossoms at the knots. */
void convex_quadratic(const bspline *b, size_t i, double mean, double reach, double out[2]) {
  double sum = 0, pairs = 0;
  for (unsigned j = 1; j <= b->degree; j++) {
    double t = (b->knots[i + j] - mean) / reach;
    pairs += 2 * t * sum;
    sum += t;
  }
  out[0] = sum / b->degree;
  out[1] = pairs / (b->degree * (b->degree - 1.0));
}

batten_status convex_objective_limit(batten_context *ctx, const convex_objective *o, const convex_space *space,
                                     const double *parameters, double *control) {
  double mean[2], reach[2], gram[LIMIT * LIMIT] = {0}, right[3 * LIMIT] = {0};
  bool regular = true;
  for (size_t k = 0; k < 2; k++) {
    centre(o, parameters, k, &mean[k], &reach[k]);
    regular = regular && reach[k] > 0;
  }
  for (size_t i = 0; i < o->count && regular; i++) {
    double u = (parameters[2 * i] - mean[0]) / reach[0], v = (parameters[2 * i + 1] - mean[1]) / reach[1];
    const double f[LIMIT] = {1, u, u * u, v, v * v};
    for (int a = 0; a < LIMIT; a++) {
      for (int b = 0; b < LIMIT; b++) gram[a * LIMIT + b] += weight_of(o, i) * f[a] * f[b];
      for (int k = 0; k < 3; k++) right[k * LIMIT + a] += weight_of(o, i) * f[a] * o->points[3 * i + (size_t)k];
    }
  }
  double largest = gram[0];
  regular = regular && batten_la_potrf(BATTEN_LA_DOUBLE, 'L', LIMIT, gram, LIMIT) == 0;
  /* 1e-13: points on a conic leave a pivot that is rounding of the sum, some 1e-16 of it */
  for (int a = 0; a < LIMIT && regular; a++)
    regular = gram[a * (LIMIT + 1)] * gram[a * (LIMIT + 1)] > 1e-13 * largest;
  if (!regular)
    return batten_fail(
        ctx, BATTEN_E_SINGULAR,
        "parameters: all%s lie on one conic a + b u + c u^2 + d v + e v^2 = 0, which leaves the surface "
        "undetermined whatever the tension; add points at other places",
        o->weights ? " of positive weight" : "");
  for (int k = 0; k < 3; k++) {
    batten_la_trsv(BATTEN_LA_DOUBLE, 'L', 'N', LIMIT, gram, LIMIT, right + k * LIMIT);
    batten_la_trsv(BATTEN_LA_DOUBLE, 'L', 'T', LIMIT, gram, LIMIT, right + k * LIMIT);
  }
  for (size_t i = 0; i < space->axis[0].count; i++)
    for (size_t j = 0; j < space->axis[1].count; j++) {
      double u[2], v[2];
      convex_quadratic(&space->axis[0], i, mean[0], reach[0], u);
      convex_quadratic(&space->axis[1], j, mean[1], reach[1], v);
      for (int k = 0; k < 3; k++) {
        const double *c = right + k * LIMIT;
        control[3 * (i * space->axis[1].count + j) + (size_t)k] =
            c[0] + c[1] * u[0] + c[2] * u[1] + c[3] * v[0] + c[4] * v[1];
      }
    }
  return BATTEN_OK;
}
