/* Noise from neighbours.
 *
 * A point's distance across the cubic through the k-th and 2 k-th neighbours on both sides, divided by what noise of
 * 1 would make of it, is about the noise where the curve is calm over 4 k points. A low quantile over all points
 * does not see the places where it is not [Rousseeuw, Croux 1993], as long as they are not most of the curve.
 *
 * From k to 2 k it stays where noise is white, and grows 16 times, as the error of cubics, where the data are a
 * smooth curve. Where both are there, one doubling is between the two, or two where parts of the curve differ much.
 * Data that were drawn by hand or follow the pixels of a picture differ: neighbours deviate alike, and by what they
 * deviate grows a few times at every scale, like the way of a random walk. Three doublings with such growth have
 * neither noise nor a smooth curve. */
#include "deviations.h"

#include "base/checked.h"
#include "basis/quantile.h"

/* Fewer distances tell nothing; fewer points no growth, since features of a few points grow slowly, too. */
enum { FEW = 5, SCALES = 4, POINTS_MIN = 48 };
/* Parts of the distances: of next neighbours as many as are calm where half of few points are not; and the quantiles
 * of |.| of normal numbers. */
static const double PART = 0.375, PART_NORMAL = 0.488776411114669, HALF_NORMAL = 0.674489750196081743;
/* Growth by each doubling: what chance makes of white noise is below, smooth curves of some noise grow by more; what
 * neighbours share may end at the last. */
static const double SLOW_LEAST[SCALES - 1] = {1.6, 1.6, 0.9}, SLOW_MOST[SCALES - 1] = {7, 7, 10};
static const double SLOW_BOTH = 24; /* by the first two together */

/* Point i's distance across the chord of its neighbours in units of noise; false: it has no such neighbours. */
static bool distance_of(const contour_data *data, const double *parameters, bool closed, size_t i, size_t k,
                        double *distance) {
  const size_t n = data->count;
  const double *p[4];
  double t[4], e[2] = {data->points[2 * i], data->points[2 * i + 1]}, squares = 1;
  if (n < 4 * k + 1 || (!closed && (i < 2 * k || i + 2 * k >= n))) return false;
  for (size_t a = 0; a < 4; a++) {
    size_t at = i + n + (a < 2 ? a * k : (a + 1) * k) - 2 * k, j = at % n;
    if (data->weights && !(data->weights[j] > 0)) return false;
    p[a] = data->points + 2 * j;
    t[a] = parameters[j] - parameters[i] + (at < n ? -1 : at >= 2 * n ? 1 : 0);
  }
  if (!(t[0] < t[1] && t[1] < 0 && 0 < t[2] && t[2] < t[3])) return false;
  for (size_t a = 0; a < 4; a++) {
    double w = 1;
    for (size_t b = 0; b < 4; b++)
      if (b != a) w *= t[b] / (t[b] - t[a]);
    for (size_t c = 0; c < 2; c++) e[c] -= w * p[a][c];
    squares += w * w;
  }
  double along[2] = {p[2][0] - p[1][0], p[2][1] - p[1][1]}, length = hypot(along[0], along[1]);
  if (!(length > 0)) return false;
  *distance = fabs(contour_cross(along, e)) / (length * sqrt(squares));
  return true;
}

/* Distances [*count] of all points that have neighbours. */
static void find_distances(const contour_data *data, const double *parameters, bool closed, size_t k, size_t *count,
                           weighted_sample *samples) {
  *count = 0;
  for (size_t i = 0; i < data->count; i++) {
    double weight = data->weights ? data->weights[i] : 1, distance;
    if (!(weight > 0) || !distance_of(data, parameters, closed, i, k, &distance)) continue;
    samples[(*count)++] = (weighted_sample){distance, 1};
  }
}

batten_status contour_deviations_find(batten_context *ctx, const contour_data *data, const double *parameters,
                                      bool closed, contour_deviations *out) {
  double scales[SCALES];
  weighted_sample *samples = batten_alloc_array(ctx, data->count, sizeof *samples);
  if (!samples) return BATTEN_E_NOMEM;
  *out = (contour_deviations){.local = NAN};
  for (size_t k = 0; k < SCALES; k++) {
    size_t count;
    find_distances(data, parameters, closed, (size_t)1 << k, &count, samples);
    scales[k] = count < FEW ? NAN : weighted_quantile(count, samples, 0.5) / HALF_NORMAL;
    if (k == 0 && count >= FEW) out->local = weighted_quantile(count, samples, PART) / PART_NORMAL;
  }
  batten_free(ctx, samples);
  bool slow = data->count >= POINTS_MIN;
  for (size_t k = 0; k + 1 < SCALES; k++) {
    double growth = scales[k + 1] / scales[k];
    slow = slow && growth >= SLOW_LEAST[k] && growth <= SLOW_MOST[k]; /* not of NaN */
  }
  slow = slow && scales[2] / scales[0] <= SLOW_BOTH;
  if (slow) {
    out->correlated = scales[2];
    out->reach = 4;
  }
  return BATTEN_OK;
}
