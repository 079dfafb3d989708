/* The interior point's linear systems
 *
 *   [ H + diag(d)    C'     ] [x]   [r]
 *   [     C       -diag(w)  ] [p] = [s]      d >= 0, w > 0: quasidefinite, so that any symmetric order of pivots
 * exists
 *
 * with fixed H and C and new d, w in every step. Two ways, chosen by their cost:
 *   bordered.c  x alone, banded: H + diag(d) + C' diag(1/w) C, with long rows and busy unknowns in a border
 *   ldl.c       x and p together, any pattern: L D L' in an order of little fill */
#ifndef BATTEN_QP_KKT_H
#define BATTEN_QP_KKT_H

#include <stdbool.h>

#include "pattern.h"

typedef struct qp_ldl qp_ldl;
typedef struct qp_bordered qp_bordered;

typedef struct qp_kkt {
  qp_csr c;
  qp_ldl *ldl; /* one of the two, the other NULL */
  qp_bordered *bordered;
  double flops; /* of a factorization, in time of ldl.c's */
  bool cheap;   /* a factorization costs little more than a solve */
  size_t bytes; /* held */
} qp_kkt;

/* h: both triangles, m x m rows of c. The values are read at every factorization: the arrays must stay. */
batten_status qp_kkt_new(batten_context *ctx, const qp_csr *h, const qp_csr *c, qp_kkt *out);
void qp_kkt_free(batten_context *ctx, qp_kkt *k);

/* Factors; returns how many pivots were repaired because rounding had eaten them. */
size_t qp_kkt_factor(qp_kkt *k, const double *d, const double *w);
/* r [n], s [m] -> x, p; to [m] += C x, which one of the two knows anyway. */
void qp_kkt_solve(qp_kkt *k, double *r, double *s, double *to);

batten_status qp_ldl_new(batten_context *ctx, const qp_csr *h, const qp_csr *c, qp_ldl **out);
void qp_ldl_free(batten_context *ctx, qp_ldl *f);
size_t qp_ldl_factor(qp_ldl *f, const double *d, const double *w);
void qp_ldl_solve(qp_ldl *f, double *r, double *s);
double qp_ldl_flops(const qp_ldl *f);
size_t qp_ldl_bytes(const qp_ldl *f);

/* TOO_LARGE when a factorization takes more than most_flops, or the border gets too wide. */
batten_status qp_bordered_new(batten_context *ctx, const qp_csr *h, const qp_csr *c, double most_flops,
                              qp_bordered **out);
void qp_bordered_free(batten_context *ctx, qp_bordered *f);
size_t qp_bordered_factor(qp_bordered *f, const double *d, const double *w);
void qp_bordered_solve(qp_bordered *f, double *r, double *s, double *to);
double qp_bordered_flops(const qp_bordered *f);
size_t qp_bordered_bytes(const qp_bordered *f);

#endif
