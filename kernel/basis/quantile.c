/* Quantiles of weighted samples: by bisection over all doubles, which needs no order and no room. */
#include "quantile.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

/* Unsigned numbers in the order of the doubles. */
static uint64_t order_key(double x) {
  uint64_t bits;
  memcpy(&bits, &x, sizeof bits);
  return bits >> 63 ? ~bits : bits | (uint64_t)1 << 63;
}
static double from_key(uint64_t key) {
  uint64_t bits = key >> 63 ? key & ~((uint64_t)1 << 63) : ~key;
  double x;
  memcpy(&x, &bits, sizeof x);
  return x;
}

static double weight_up_to(size_t count, const weighted_sample *samples, double value) {
  double weight = 0;
  for (size_t i = 0; i < count; i++)
    if (samples[i].weight > 0 && samples[i].value <= value) weight += samples[i].weight;
  return weight;
}

double weighted_quantile(size_t count, const weighted_sample *samples, double q) {
  double whole = weight_up_to(count, samples, INFINITY);
  if (!(whole > 0)) return NAN;
  uint64_t low = order_key(-INFINITY), high = order_key(INFINITY);
  while (high - low > 1) {
    uint64_t mid = low + (high - low) / 2;
    if (weight_up_to(count, samples, from_key(mid)) >= q * whole)
      high = mid;
    else
      low = mid;
  }
  return from_key(high);
}
