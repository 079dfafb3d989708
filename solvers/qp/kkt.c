/* Chooses between the two ways to the interior point's linear systems, see kkt.h. */
#include "kkt.h"

batten_status qp_kkt_new(batten_context *ctx, const qp_csr *h, const qp_csr *c, qp_kkt *out) {
  *out = (qp_kkt){.n = c->columns, .m = c->rows};
  batten_status st = qp_ldl_new(ctx, h, c, &out->ldl);
  if (st < 0) return st;
  out->flops = qp_ldl_flops(out->ldl);
  out->bytes = qp_ldl_bytes(out->ldl);
  return BATTEN_OK;
}
void qp_kkt_free(batten_context *ctx, qp_kkt *k) {
  qp_ldl_free(ctx, k->ldl);
  *k = (qp_kkt){0};
}
size_t qp_kkt_factor(qp_kkt *k, const double *d, const double *w) { return qp_ldl_factor(k->ldl, d, w); }
void qp_kkt_solve(qp_kkt *k, double *r, double *s) { qp_ldl_solve(k->ldl, r, s); }
