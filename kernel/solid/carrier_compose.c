/* Carriers made of other fields: R-functions of two carriers, and the host's callback.
 *
 * R-functions  u = (f + g +- S) / (1 + a),  S = sqrt(f^2 + g^2 - 2 a f g):
 *   u_f = (1 +- (f - a g) / S) / (1 + a), likewise u_g
 *   the second derivatives of S have rank one: (1 - a^2) / S^3 (g, -f)(g, -f)'
 * At S = 0 (f = g = 0; for a = 1 all of f = g) the kink's derivatives are replaced by their mean over both
 * sides: u_f = u_g = 1 / (1 + a), no second-order term. */
#include <math.h>
#include <stdbool.h>

#include "solid/carrier_inner.h"
#include "solid/differences.h"

typedef struct joint {
  double u, u_f, u_g;
  double f, g, bend; /* over S; the Hessian gets bend (g df - f dg)(g df - f dg)' */
} joint;

static joint join(double alpha, double sign, double f, double g) {
  double difference = f - g, square = difference * difference + 2 * (1 - alpha) * f * g;
  double s = square > 0 ? sqrt(square) : 0, sum = f + g;
  joint j = {0};
  /* (f + g)^2 - S^2 = 2 (1 + a) f g: without cancellation where f + g and +-S have opposite signs. */
  j.u = sum * sign >= 0 || s == 0 ? (sum + sign * s) / (1 + alpha) : 2 * f * g / (sum - sign * s);
  j.u_f = j.u_g = 1 / (1 + alpha);
  if (s > 0) {
    j.u_f += sign * (f - alpha * g) / s / (1 + alpha);
    j.u_g += sign * (g - alpha * f) / s / (1 + alpha);
    j.f = f / s;
    j.g = g / s;
    j.bend = sign * (1 - alpha) / s;
  }
  return j;
}

void batten_carrier_combine(unsigned n, double alpha, double sign, size_t count, double *f, double *df, double *ddf,
                            const double *g, const double *dg, const double *ddg) {
  for (size_t p = 0; p < count; p++) {
    joint j = join(alpha, sign, f[p], g[p]);
    if (ddf)
      for (unsigned a = 0; a < n; a++)
        for (unsigned b = 0; b < n; b++) {
          double va = j.g * df[p * n + a] - j.f * dg[p * n + a], vb = j.g * df[p * n + b] - j.f * dg[p * n + b];
          size_t at = (p * n + a) * n + b;
          ddf[at] = j.u_f * ddf[at] + j.u_g * ddg[at] + j.bend * va * vb;
        }
    if (df)
      for (unsigned a = 0; a < n; a++) df[p * n + a] = j.u_f * df[p * n + a] + j.u_g * dg[p * n + a];
    f[p] = j.u;
  }
}

/* ---- the host's field ---------------------------------------------------------------------------- */

static batten_status ask(batten_context *ctx, const batten_field *field, size_t count, const double *points,
                         double *values, double *gradients, double *hessians) {
  unsigned n = field->dimension;
  batten_status st = field->evaluate(field->user, ctx, count, points, values, gradients, hessians);
  if (st < 0) return st;
  for (size_t i = 0; i < count; i++) {
    bool finite = !values || isfinite(values[i]);
    for (size_t k = 0; gradients && k < n; k++) finite = finite && isfinite(gradients[i * n + k]);
    for (size_t k = 0; hessians && k < n * n; k++) finite = finite && isfinite(hessians[i * n * n + k]);
    if (!finite)
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "carrier callback: not finite at (%g, %g, %g); let it return finite numbers", points[i * n],
                         n > 1 ? points[i * n + 1] : 0, n > 2 ? points[i * n + 2] : 0);
  }
  return BATTEN_OK;
}

batten_status batten_carrier_call(batten_context *ctx, const batten_carrier *c, size_t count, const double *points,
                                  double *values, double *gradients, double *hessians) {
  enum { STENCIL = DIFFERENCE_POINTS };
  const batten_field *field = &c->field;
  unsigned n = c->n;
  bool direct_gradients = field->order >= 1, direct_hessians = field->order >= 2;
  bool differ = (gradients && !direct_gradients) || (hessians && !direct_hessians);
  if (!differ) return ask(ctx, field, count, points, values, gradients, hessians);
  double *at = batten_alloc_array(ctx, CARRIER_BLOCK, (STENCIL * 4 + 1) * sizeof *at);
  if (!at) return BATTEN_E_NOMEM;
  double *answer = at + CARRIER_BLOCK * STENCIL * 3, *middle = answer + CARRIER_BLOCK * STENCIL;
  size_t made = 0, each = 0;
  for (size_t i = 0; i < count; i++)
    made += each = batten_difference_points(n, points + i * n, c->step, hessians && !direct_gradients, at + made * n);
  batten_status st = ask(ctx, field, count, points, middle, direct_gradients ? gradients : NULL, NULL);
  if (st >= 0)
    st = direct_gradients ? ask(ctx, field, made, at, NULL, answer, NULL)
                          : ask(ctx, field, made, at, answer, NULL, NULL);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    if (values) values[i] = middle[i];
    if (direct_gradients)
      batten_differences_of_gradients(n, c->step, answer + i * each * n, hessians + i * n * n);
    else
      batten_differences_of_values(n, c->step, middle[i], answer + i * each, gradients ? gradients + i * n : NULL,
                            hessians ? hessians + i * n * n : NULL);
  }
  batten_free(ctx, at);
  return st;
}
