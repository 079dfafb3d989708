/* What every node of the algebra must pass: bounds that hold where they are sampled and narrow with their box,
 * gradients that agree with differences, the same bits in any batch, the same node from its parts. */
#ifndef FREP_CHECKS_H
#define FREP_CHECKS_H

#include <batten/frep.h>

#include "tap.h"

enum { FREP_CHECK_SAMPLES = 16 }; /* points in a box: its corners, and random ones */

/* Places in [lower, upper], then on the corners of it. */
static inline void frep_sample(unsigned n, const double *box, int which, uint64_t *seed, double *x) {
  for (unsigned k = 0; k < n; k++) {
    double t = which < 1 << n ? (which >> k & 1) : t_uniform(seed);
    x[k] = t == 0 ? box[k] : t == 1 ? box[n + k] : fmin(box[k] + t * (box[n + k] - box[k]), box[n + k]);
  }
}

/* count random boxes about [-size, size]^n, of sizes from size down to size / 1e6: no sample outside of the bounds.
 * Prints the mean of (width of the bounds) / (range of the samples) for the smallest boxes. */
static inline void frep_check_bounds(batten_context *ctx, const char *what, const batten_frep *a, double size,
                                     size_t count, uint64_t seed) {
  enum { BATCH = 512 };
  unsigned n = batten_frep_dimension(a);
  static double boxes[BATCH * 6], ranges[BATCH * 2], points[BATCH * FREP_CHECK_SAMPLES * 3],
      values[BATCH * FREP_CHECK_SAMPLES];
  size_t outside = 0, narrow = 0, unknown = 0;
  double over = 0, worst = 0;
  for (size_t first = 0; first < count; first += BATCH) {
    for (size_t i = 0; i < BATCH; i++) {
      double *box = boxes + 2 * n * i, width = size * pow(10, -6 * t_uniform(&seed));
      for (unsigned k = 0; k < n; k++) {
        box[k] = size * (2 * t_uniform(&seed) - 1) - width / 2;
        box[n + k] = box[k] + width * t_uniform(&seed);
      }
      for (int s = 0; s < FREP_CHECK_SAMPLES; s++)
        frep_sample(n, box, s, &seed, points + n * (FREP_CHECK_SAMPLES * i + (size_t)s));
    }
    if (batten_frep_bounds(ctx, a, BATCH, boxes, ranges) != BATTEN_OK ||
        batten_frep_evaluate(ctx, a, BATCH * FREP_CHECK_SAMPLES, points, values, NULL) != BATTEN_OK) {
      t_line(false, "%s: %s", what, batten_error(ctx));
      return;
    }
    for (size_t i = 0; i < BATCH; i++) {
      double lo = INFINITY, hi = -INFINITY, width = 0;
      for (size_t s = 0; s < FREP_CHECK_SAMPLES; s++) {
        double v = values[FREP_CHECK_SAMPLES * i + s];
        if (!(v >= ranges[2 * i] && v <= ranges[2 * i + 1])) {
          outside++;
          worst = fmax(worst, fmax(ranges[2 * i] - v, v - ranges[2 * i + 1]));
        }
        lo = fmin(lo, v);
        hi = fmax(hi, v);
      }
      for (unsigned k = 0; k < n; k++) width = fmax(width, boxes[2 * n * i + n + k] - boxes[2 * n * i + k]);
      double range = ranges[2 * i + 1] - ranges[2 * i];
      if (!isfinite(range)) unknown++;
      if (width < 1e-3 * size && width > 1e-5 * size && isfinite(range) && hi > lo) {
        over += range / (hi - lo);
        narrow++;
      }
    }
  }
  t_line(outside == 0,
         "%s: bounds hold in %zu boxes (%zu samples outside, by %.3g); small ones are %.3f of what they "
         "hold, %zu unbounded",
         what, count, outside, worst, narrow ? over / (double)narrow : 0, unknown);
}

/* Gradients against central differences at random places of [-size, size]^n. Kinks: the share of places beside them,
 * which is let go. bound: largest difference, relative to 1 + |grad f|. */
static inline void frep_check_gradient(batten_context *ctx, const char *what, const batten_frep *a, double size,
                                       double kinks, double bound, uint64_t seed) {
  enum { COUNT = 500 };
  const double h = 1e-5 * size;
  unsigned n = batten_frep_dimension(a);
  static double points[COUNT * 3], gradients[COUNT * 3], values[COUNT], again[COUNT];
  double worst = 0;
  size_t bad = 0, different = 0;
  for (size_t i = 0; i < COUNT * n; i++) points[i] = size * (2 * t_uniform(&seed) - 1);
  T_OK(batten_frep_evaluate(ctx, a, COUNT, points, values, gradients), ctx);
  T_OK(batten_frep_evaluate(ctx, a, COUNT, points, again, NULL), ctx);
  for (size_t i = 0; i < COUNT; i++) {
    double x[3], here = 0, norm = 1, alone, g[3];
    memcpy(x, points + n * i, n * sizeof *x);
    if (batten_frep_evaluate(ctx, a, 1, x, &alone, NULL) != BATTEN_OK) alone = NAN;
    different += alone != values[i] || again[i] != values[i];
    if (batten_frep_evaluate(ctx, a, 1, x, NULL, g) != BATTEN_OK) g[0] = NAN;
    for (unsigned k = 0; k < n; k++) {
      double side[2], at = x[k];
      for (int s = 0; s < 2; s++) {
        x[k] = at + (s ? h : -h);
        batten_frep_evaluate(ctx, a, 1, x, side + s, NULL);
      }
      x[k] = at;
      here = fmax(here, fabs((side[1] - side[0]) / (2 * h) - gradients[n * i + k]));
      norm += fabs(g[k]);
      different += g[k] != gradients[n * i + k];
    }
    if (here / norm > bound)
      bad++;
    else
      worst = fmax(worst, here / norm);
  }
  t_line((double)bad <= kinks * COUNT, "%s: gradients against differences: %.3g, allowed %.3g; %zu of %d at kinks",
         what, worst, bound, bad, COUNT);
  t_line(different == 0, "%s: the same bits alone and in a batch", what);
}

/* A node made from the parts of a has its bits. */
static inline void frep_check_parts_again(batten_context *ctx, const char *what, const batten_frep *a, double size,
                                          uint64_t seed) {
  enum { COUNT = 100 };
  unsigned n = batten_frep_dimension(a);
  double points[COUNT * 3], one[COUNT], two[COUNT];
  for (size_t i = 0; i < COUNT * n; i++) points[i] = size * (2 * t_uniform(&seed) - 1);
  batten_frep_parts parts;
  batten_frep_get_parts(a, &parts);
  batten_frep *b = NULL;
  T_OK(batten_frep_create(ctx, &parts, &b), ctx);
  bool ok = b && batten_frep_is_distance(a) == batten_frep_is_distance(b) &&
            batten_frep_evaluate(ctx, a, COUNT, points, one, NULL) == BATTEN_OK &&
            batten_frep_evaluate(ctx, b, COUNT, points, two, NULL) == BATTEN_OK && memcmp(one, two, sizeof one) == 0;
  t_line(ok, "%s: the same node from its parts (%s)", what, batten_frep_kind_name(parts.kind));
  batten_frep_free(b);
}

/* All of it. */
static inline void frep_check(batten_context *ctx, const char *what, const batten_frep *a, double size, double kinks,
                              double bound, size_t boxes) {
  frep_check_bounds(ctx, what, a, size, boxes, 11);
  frep_check_gradient(ctx, what, a, size, kinks, bound, 12);
  frep_check_parts_again(ctx, what, a, size, 13);
}

#endif
