/* Householder projection onto the null space of P'. */
#include <float.h>
#include <string.h>

#include "system.h"

/* ---- QR of P ---- */

void batten_saddle_qr_free(batten_saddle *s) {
  batten_free(s->ctx, s->qr.v);
  batten_free(s->ctx, s->qr.t);
  batten_free(s->ctx, s->qr.r);
  batten_free(s->ctx, s->qr.pivots);
  s->qr = (batten_saddle_qr){0};
}

/* SINGULAR when a diagonal entry of R is rounding: columns of P are then dependent on the points given. */
static batten_status check_rank(batten_saddle *s) {
  size_t n = s->matrix.n, k = s->matrix.k;
  const double *r = s->qr.r;
  /* The columns have size 1; factoring n rows perturbs R by about n eps of its largest entry. */
  double smallest = (double)(n > 10 ? n : 10) * DBL_EPSILON * fabs(r[0]);
  for (size_t j = 0; j < k; j++) {
    if (fabs(r[j + j * k]) > smallest) continue;
    return batten_fail(s->ctx, BATTEN_E_SINGULAR,
                       "matrix.p: column %zu depends on the others, rank %zu of %zu (coplanar or too few points?); "
                       "lower the polynomial degree or add points off the plane",
                       s->qr.pivots[j], j, k);
  }
  return BATTEN_OK;
}

batten_status batten_saddle_qr_new(batten_saddle *s) {
  size_t n = s->matrix.n, k = s->matrix.k;
  batten_saddle_qr *qr = &s->qr;
  batten_status st = BATTEN_E_NOMEM;
  double *tau = NULL;
  if (k == 0) return BATTEN_OK;
  qr->v = batten_alloc_array(s->ctx, n * k, sizeof *qr->v);
  if (!qr->v) goto done;
  qr->t = batten_alloc_array(s->ctx, k * k, sizeof *qr->t);
  if (!qr->t) goto done;
  qr->r = batten_alloc_array(s->ctx, k * k, sizeof *qr->r);
  if (!qr->r) goto done;
  qr->pivots = batten_alloc_array(s->ctx, k, sizeof *qr->pivots);
  if (!qr->pivots) goto done;
  tau = batten_alloc_array(s->ctx, k, sizeof *tau);
  if (!tau) goto done;
  for (size_t c = 0; c < k; c++)
    for (size_t i = 0; i < n; i++) qr->v[i + c * n] = s->matrix.p[i + c * n] * s->p_scale[c];
  st = batten_la_geqp3(s->ctx, n, k, qr->v, n, qr->pivots, tau);
  if (st < 0) goto done;
  batten_la_larft(n, k, qr->v, n, tau, qr->t, k);
  for (size_t c = 0; c < k; c++)
    for (size_t i = 0; i < k; i++) {
      bool upper = i <= c;
      qr->r[i + c * k] = upper ? qr->v[i + c * n] : 0;
      if (upper) qr->v[i + c * n] = i == c;
      else qr->t[i + c * k] = 0;
    }
  st = check_rank(s);
done:
  batten_free(s->ctx, tau);
  if (st < 0) batten_saddle_qr_free(s);
  return st;
}
