/* Noise, or data of another shape than the wanted one?
 *
 * Distances of points from the fit without inequalities tell the noise, where that fit leaves enough freedom; from
 * the fit of the wanted shape they should not be much larger. Distances are those from nearest places, to which a
 * point moves along the curve: each point is one number, and half of the unknowns, which are coordinates, shape the
 * curve across itself.
 *
 * Where the data contradict the shape most: the stretch of neighbours with the largest sum of what the squares of
 * their distances rise above a few times those of the fit without inequalities. */
#include "contour_inner.h"

#include "base/checked.h"

/* As BATTEN_W_SHAPE has it. */
static const double MISFIT = 3;
/* Of the points' size: nothing that is so even to the eye contradicts a shape. */
static const double EVEN = 1e-4;
/* Fewer parts of the points' number than this that are left tell little of noise. */
static const double FREEDOM_PART = 0.2;
enum { FREEDOM_MIN = 4, DIFFERENCE_MIN = 4 };

static double weight_of(const contour_data *data, size_t i) { return data->weights ? data->weights[i] : 1; }

static double size_of(const contour_data *data) {
  double size = 0;
  for (size_t d = 0; d < 2; d++) {
    double lower = INFINITY, upper = -INFINITY;
    for (size_t i = 0; i < data->count; i++) {
      lower = fmin(lower, data->points[2 * i + d]);
      upper = fmax(upper, data->points[2 * i + d]);
    }
    size = fmax(size, upper - lower);
  }
  return size;
}

/* Third differences of neighbours vanish on smooth dense data; of noise s their mean square is 20 s^2. */
static double noise_of_differences(const contour_data *data) {
  static const double factors[4] = {-1, 3, -3, 1};
  double sum = 0;
  size_t used = 0;
  for (size_t i = 0; i + 3 < data->count; i++) {
    bool counts = true;
    for (size_t k = 0; k < 4; k++) counts = counts && weight_of(data, i + k) > 0;
    if (!counts) continue;
    for (size_t d = 0; d < 2; d++) {
      double difference = 0;
      for (size_t k = 0; k < 4; k++) difference += factors[k] * data->points[2 * (i + k) + d];
      sum += difference * difference;
    }
    used++;
  }
  return used >= DIFFERENCE_MIN ? sqrt(sum / (40 * (double)used)) : NAN;
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
  out->misfit = rms / fmax(noise, EVEN * size);
  out->contradicts = out->misfit > MISFIT;
}
