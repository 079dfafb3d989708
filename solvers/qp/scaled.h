/* The interior point's own copy of a problem, equilibrated. */
#ifndef BATTEN_QP_SCALED_H
#define BATTEN_QP_SCALED_H

#include "engine.h"
#include "pattern.h"

/* min 1/2 x'Hx + g'x,  lower <= rows <= upper. The first `general` rows are those of c; row general + b is the
 * unknown column[b] itself. With the engine's problem marked by ~: x~ = e x,  H = cost e H~ e,  g = cost e g~,  row =
 * f row~ e,  side = f side~,  y~ = f y / cost. e, cost are powers of two, and so are f of the general rows. */
typedef struct qp_scaled {
  size_t n, m, general;
  qp_csr h, c;               /* without zeros */
  const uint32_t *column;    /* [m - general] */
  double *g, *e;             /* [n] */
  double *lower, *upper, *f; /* [m] */
  double cost;
  void *memory[10]; /* what the arrays lie in */
  size_t bytes;
} qp_scaled;

/* The larger; a where b is no number. Inline, where fmax() is a call. */
static inline double qp_larger(double a, double b) { return a < b ? b : a; }

/* Free with qp_scaled_free, also after NOMEM or TOO_LARGE. */
batten_status qp_scaled_new(batten_context *ctx, const qp_sparse *objective, const qp_rows *rows, qp_scaled *out);
void qp_scaled_free(batten_context *ctx, qp_scaled *s);

/* out [m] := rows at x; out [n] := H x; to [n] += factor * (sum y_k row_k). */
void qp_scaled_rows(const qp_scaled *s, const double *x, double *out);
void qp_scaled_hessian(const qp_scaled *s, const double *x, double *out);
void qp_scaled_add(const qp_scaled *s, double factor, const double *y, double *to);

#endif
