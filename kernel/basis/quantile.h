/* Quantiles of weighted samples. */
#ifndef BATTEN_BASIS_QUANTILE_H
#define BATTEN_BASIS_QUANTILE_H

#include <stddef.h>

typedef struct weighted_sample {
  double value, weight; /* weight 0: no sample */
} weighted_sample;

/* The least value among the samples up to which lies a part q of the weight; NaN without samples. Time O(count), 65
 * passes; no room. */
double weighted_quantile(size_t count, const weighted_sample *samples, double q);

#endif
