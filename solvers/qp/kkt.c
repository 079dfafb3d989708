/* Chooses between the two ways to the interior point's linear systems, see kkt.h. The order of little fill is found
 * first, because it says how many operations the band may take. */
#include "kkt.h"

/* Sums that run along a band go this much faster than those through the indices of a sparse factor: measured. */
static const double BAND_IS_FASTER = 4;

static void take_band(qp_kkt *out, qp_bordered *band, bool cheap) {
  out->bordered = band;
  out->cheap = cheap;
  out->flops = qp_bordered_flops(band) / BAND_IS_FASTER;
  out->bytes = qp_bordered_bytes(band);
}

batten_status qp_kkt_new(batten_context *ctx, const qp_csr *h, const qp_csr *c, qp_kkt *out) {
  const double FEW = 40; /* operations for each entry of the problem: no order of little fill gains on that */
  double entries = (double)(h->starts[h->rows] + c->starts[c->rows] + c->columns + c->rows);
  qp_bordered *band = NULL;
  *out = (qp_kkt){.c = *c};
  batten_status st = qp_bordered_new(ctx, h, c, FEW * entries, &band);
  if (st >= 0) take_band(out, band, true);
  if (st != BATTEN_E_TOO_LARGE) return st;
  st = qp_ldl_new(ctx, h, c, &out->ldl);
  if (st < 0) return st;
  out->flops = qp_ldl_flops(out->ldl);
  out->bytes = qp_ldl_bytes(out->ldl);
  st = qp_bordered_new(ctx, h, c, BAND_IS_FASTER * out->flops, &band);
  if (st == BATTEN_E_TOO_LARGE) return BATTEN_OK;
  if (st < 0) return st;
  qp_ldl_free(ctx, out->ldl);
  out->ldl = NULL;
  take_band(out, band, false);
  return BATTEN_OK;
}

void qp_kkt_free(batten_context *ctx, qp_kkt *k) {
  qp_ldl_free(ctx, k->ldl);
  qp_bordered_free(ctx, k->bordered);
  *k = (qp_kkt){0};
}

size_t qp_kkt_factor(qp_kkt *k, const double *d, const double *w) {
  return k->bordered ? qp_bordered_factor(k->bordered, d, w) : qp_ldl_factor(k->ldl, d, w);
}

void qp_kkt_solve(qp_kkt *k, double *r, double *s, double *to) {
  if (k->bordered) {
    qp_bordered_solve(k->bordered, r, s, to);
    return;
  }
  qp_ldl_solve(k->ldl, r, s);
  for (size_t i = 0; i < k->c.rows; i++) to[i] += qp_csr_dot(&k->c, i, r);
}
