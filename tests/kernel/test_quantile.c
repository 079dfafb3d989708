/* Quantiles of weighted samples. */
#include "basis/quantile.h"

#include "tap.h"

static int by_value(const void *a, const void *b) {
  double x = ((const weighted_sample *)a)->value, y = ((const weighted_sample *)b)->value;
  return (x > y) - (x < y);
}

int main(void) {
  const weighted_sample some[] = {{3, 1}, {-1, 2}, {7, 0}, {-1e300, 1}};
  T_CHECK(weighted_quantile(4, some, 0.2) == -1e300 && weighted_quantile(4, some, 0.5) == -1 &&
              weighted_quantile(4, some, 0.75) == -1 && weighted_quantile(4, some, 0.76) == 3 &&
              weighted_quantile(4, some, 1) == 3,
          "four samples by hand");
  T_CHECK(isnan(weighted_quantile(0, NULL, 0.5)) && isnan(weighted_quantile(1, some + 2, 0.5)), "no samples: NaN");
  enum { COUNT = 2000 };
  weighted_sample *all = malloc(COUNT * sizeof *all), *sorted = malloc(COUNT * sizeof *all);
  uint64_t seed = 5;
  double whole = 0;
  for (size_t i = 0; i < COUNT; i++) {
    /* Weights are whole numbers, so that sums in any order are the same. */
    all[i] = (weighted_sample){t_uniform(&seed) - 0.5, floor(8 * t_uniform(&seed))};
    whole += all[i].weight;
  }
  memcpy(sorted, all, COUNT * sizeof *all);
  qsort(sorted, COUNT, sizeof *sorted, by_value);
  bool same = true;
  for (int k = 1; k < 100; k++) {
    double up_to = 0;
    size_t i = 0;
    while ((up_to += sorted[i].weight) < k / 100.0 * whole) i++;
    same = same && weighted_quantile(COUNT, all, k / 100.0) == sorted[i].value;
  }
  T_CHECK(same, "2000 samples: what sorting finds");
  free(sorted);
  free(all);
  return t_done();
}
