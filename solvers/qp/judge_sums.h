/* Sums of the judge (certify.c) over rows, once per instruction set. Sums run in several lanes side by side, added
 * up in a fixed order, and the error of a product is the same with and without an FMA unit: all sets give the same
 * bits. */
#ifndef BATTEN_QP_JUDGE_SUMS_H
#define BATTEN_QP_JUDGE_SUMS_H

#include <stddef.h>
#include <stdint.h>

/* Entry e of a row is in column columns[e]; columns NULL: column e. The same entries give the same bits either way.
 */
typedef struct qp_judge_sums {
  /* sum a_i x_i, plainly, and the sum of |a_i x_i| */
  double (*plain)(size_t n, const double *a, const uint32_t *columns, const double *x, double *size);
  /* sum a_i x_i in twice the working precision [Ogita, Rump, Oishi 2005, Dot2], as the sum of *hi and *lo */
  void (*twice)(size_t n, const double *a, const uint32_t *columns, const double *x, double *hi, double *lo);
  /* (hi, lo)[i] += (factor_hi + factor_lo) a_i, likewise */
  void (*add)(size_t n, const double *a, const uint32_t *columns, double factor_hi, double factor_lo, double *hi,
              double *lo);
} qp_judge_sums;

const qp_judge_sums *qp_judge_sums_now(void);
/* The sets that run here, widest first; NULL when there are no more. */
const qp_judge_sums *qp_judge_sums_at(unsigned index);

#endif
