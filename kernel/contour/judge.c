/* Noise, or data of another shape than the wanted one?
 *
 * Distances of points from the fit without inequalities tell the noise, where that fit leaves enough freedom; from
 * the fit of the wanted shape they should not be much larger. Distances are those from nearest places, to which a
 * point moves along the curve: each point is one number, and half of the unknowns, which are coordinates, shape the
 * curve across itself.
 *
 * Few points tell little of noise, and three times what they tell may be a shape that is far off. So a misfit of less
 * counts, too, where it is seen and no chance: inequalities that the true curve satisfies lower the freedom of the
 * fit by less than its unknowns; what squares rise by them, over what noise gives so many unknowns, is then below an
 * F distribution's, which its cube root makes normal [Paulson 1942]. Of many points that would find fault with what
 * parameters that are not quite right leave; therefore the misfit that it takes at least.
 *
 * Where the data contradict the shape most: the stretch of neighbours with the largest sum of what the squares of
 * their distances rise above a few times those of the fit without inequalities. */
#include "contour_inner.h"

#include "base/checked.h"

/* As BATTEN_W_SHAPE has it. */
static const double MISFIT = 3;
/* Of the points' size: nothing that is so even to the eye contradicts a shape; and what is plainly seen. */
static const double EVEN = 1e-4, SEEN = 3e-3;
/* A misfit of this much counts where it is seen, and chance gives it about once in 1,000 times: standard deviations
 * of a normal variable. */
static const double MISFIT_SURE = 2, CHANCE = 3;
/* Fewer parts of the points' number than this that are left tell little of noise. */
static const double FREEDOM_PART = 0.2;
enum { FREEDOM_MIN = 4, DIFFERENCE_MIN = 4, ORDER_MIN = 3, ORDER_MAX = 6 };

static double weight_of(const contour_data *data, size_t i) { return data->weights ? data->weights[i] : 1; }

static double size_of(const contour_data *data) {
  double size = 0;
  for (size_t d = 0; d < 2; d++) {
    double lower = INFINITY, upper = -INFINITY;
    for (size_t i = 0; i < data->count; i++) {
      if (!(weight_of(data, i) > 0)) continue;
      lower = fmin(lower, data->points[2 * i + d]);
      upper = fmax(upper, data->points[2 * i + d]);
    }
    size = fmax(size, upper - lower);
  }
  return size;
}

/* Differences of neighbours vanish on smooth dense data, those of higher order sooner; of noise s the mean square of
 * the k-th is C(2 k, k) s^2. The order that tells least is taken. */
static double noise_of_differences(const contour_data *data) {
  double least = INFINITY, factors[ORDER_MAX + 1] = {1}, norm = 1;
  for (size_t order = 1; order <= ORDER_MAX; order++) {
    for (size_t k = order; k > 0; k--) factors[k] -= factors[k - 1];
    norm *= 4 - 2 / (double)order; /* C(2 k, k) */
    double sum = 0;
    size_t used = 0;
    for (size_t i = 0; i + order < data->count && order >= ORDER_MIN; i++) {
      double difference[2] = {0, 0};
      bool counts = true;
      for (size_t k = 0; k <= order; k++) {
        counts = counts && weight_of(data, i + k) > 0;
        for (size_t d = 0; d < 2; d++) difference[d] += factors[k] * data->points[2 * (i + k) + d];
      }
      if (!counts) continue;
      sum += difference[0] * difference[0] + difference[1] * difference[1];
      used++;
    }
    if (used >= DIFFERENCE_MIN) least = fmin(least, sqrt(sum / (2 * norm * (double)used)));
  }
  return isinf(least) ? NAN : least;
}

/* The stretch with the greatest sum of squares above `allowed` times the others, and above `least` [Kadane]. */
static void find_worst(const contour_data *data, const double *squares, const double *unconstrained, double allowed,
                       double least, contour_verdict *out) {
  double sum = 0, best = -INFINITY;
  size_t start = 0, from = 0, to = 0;
  for (size_t i = 0; i < data->count; i++) {
    if (sum <= 0) {
      sum = 0;
      start = i;
    }
    sum += weight_of(data, i) * (squares[i] - allowed * unconstrained[i] - least);
    if (sum > best) {
      best = sum;
      from = start;
      to = i;
    }
  }
  double mean = 0;
  for (size_t i = from; i <= to; i++) mean += sqrt(squares[i]);
  out->worst = from + (to - from) / 2;
  out->distance = mean / (double)(to - from + 1);
}

/* Whether squares whose mean is `result` rise above those without inequalities, of mean `free` that leaves `left` of
 * `count` points, by what is seen and no chance. noise: its square. */
static bool surely_above(double result, double free, double noise, double count, double left, double size) {
  double bound = count - left;
  if (left < 1 || bound <= 0 || result < MISFIT_SURE * MISFIT_SURE * noise) return false;
  if (result - free < SEEN * SEEN * size * size) return false;
  double root = cbrt((result - free) * count / bound / noise), a = 2 / (9 * bound), b = 2 / (9 * left);
  return (1 - b) * root - (1 - a) > CHANCE * sqrt(a + b * root * root);
}

void contour_judge(const contour_data *data, const double *squares, const double *unconstrained_squares,
                   size_t unknowns, contour_verdict *out) {
  double total = 0, result = 0, free = 0, count = 0;
  for (size_t i = 0; i < data->count; i++) {
    double w = weight_of(data, i);
    total += w;
    result += w * squares[i];
    free += w * unconstrained_squares[i];
    count += w > 0;
  }
  *out = (contour_verdict){.misfit = NAN};
  if (!(total > 0)) return;
  double rms = sqrt(result / total), size = size_of(data);
  double left = count - 0.5 * (double)unknowns;
  double noise = left >= 1 ? sqrt(free / total * count / left) : NAN;
  if (left < FREEDOM_MIN || left < FREEDOM_PART * count) noise = fmax(noise, noise_of_differences(data));
  double scale = noise > 0 ? noise * noise : 0;
  find_worst(data, squares, unconstrained_squares, MISFIT, fmax(scale, EVEN * EVEN * size * size), out);
  if (isnan(noise)) return;
  noise = fmax(noise, EVEN * size);
  out->misfit = rms / noise;
  out->contradicts =
      out->misfit > MISFIT || surely_above(result / total, free / total, noise * noise, count, left, size);
}
