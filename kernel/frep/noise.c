/* Solid noise: f + amplitude product over i of s(x_i, x_(i+1)), the axes in a ring.   [Savchenko et al. 1995, section
 * 5.5: s(x, y) s(y, x) in the plane; Pasko, Savchenko 1993]
 *
 *   s(p, q) = sin(w p) + sin(w p / 1.35 + phase sin(w q)) / 1.17
 *
 * The paper multiplies s by the amplitude, and the second sine once more; here the amplitude stands outside of the
 * product, so that it is one: |noise| <= (1 + 1 / 1.17)^n. Ranges: of the product in intervals, and its mean value
 * form with the intervals of the slopes. */
#include "base/checked.h"
#include "frep/frep_inner.h"

#define NOISE_STRETCH 1.35
#define NOISE_WEIGHT 1.17

/* s and its derivatives by p and q. */
static double wave(double frequency, double phase, double p, double q, double *by_p, double *by_q) {
  double inner = frequency * p / NOISE_STRETCH + phase * sin(frequency * q), slope = cos(inner) / NOISE_WEIGHT;
  *by_p = frequency * cos(frequency * p) + frequency / NOISE_STRETCH * slope;
  *by_q = slope * phase * frequency * cos(frequency * q);
  return sin(frequency * p) + sin(inner) / NOISE_WEIGHT;
}

static double noise_at(size_t n, double frequency, double phase, const double *x, double *gradient) {
  double s[3], by_p[3], by_q[3], all = 1;
  for (size_t i = 0; i < n; i++) {
    s[i] = wave(frequency, phase, x[i], x[(i + 1) % n], by_p + i, by_q + i);
    all *= s[i];
  }
  for (size_t i = 0; gradient && i < n; i++) { /* x_i stands in s_i and in the one before */
    size_t before = (i + n - 1) % n;
    double rest = n == 3 ? s[(i + 1) % n] : 1;
    gradient[i] = rest * (by_p[i] * s[before] + s[i] * by_q[before]);
  }
  return all;
}

static batten_status noise_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                    double *values, double *gradients) {
  const size_t n = a->n;
  const double *v = a->numbers;
  batten_status st = frep_evaluate_block(a->children[0], ctx, count, points, values, gradients);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    double g[3];
    values[i] += v[0] * noise_at(n, v[1], v[2], points + n * i, gradients ? g : NULL);
    for (size_t k = 0; gradients && k < n; k++) gradients[n * i + k] += v[0] * g[k];
  }
  return st;
}

/* The same in intervals. */
static interval wave_range(interval frequency, double phase, interval p, interval q, interval *by_p, interval *by_q) {
  interval wp = interval_mul(frequency, p), wq = interval_mul(frequency, q);
  interval stretch = interval_div(interval_of(1), interval_of(NOISE_STRETCH));
  interval weight = interval_div(interval_of(1), interval_of(NOISE_WEIGHT));
  interval inner = interval_add(interval_mul(wp, stretch), interval_scale(interval_sin(wq), phase));
  interval slope = interval_mul(interval_cos(inner), weight);
  interval own = interval_add(interval_cos(wp), interval_mul(stretch, slope));
  *by_p = interval_mul(frequency, own);
  *by_q = interval_mul(interval_mul(slope, interval_scale(frequency, phase)), interval_cos(wq));
  return interval_add(interval_sin(wp), interval_mul(interval_sin(inner), weight));
}

/* Range of the noise over a box, and of its slopes [n]. */
static interval noise_range(size_t n, double frequency, double phase, const double *lower, const double *upper,
                            interval *slopes) {
  const interval w = interval_of(frequency);
  interval x[3], middle[3], s[3], by_p[3], by_q[3], all = interval_of(1), mean = interval_of(1), unused[2];
  for (size_t i = 0; i < n; i++) {
    x[i] = (interval){lower[i], upper[i]};
    middle[i] = interval_of(lower[i] / 2 + upper[i] / 2);
  }
  for (size_t i = 0; i < n; i++) {
    s[i] = wave_range(w, phase, x[i], x[(i + 1) % n], by_p + i, by_q + i);
    all = interval_mul(all, s[i]);
    mean = interval_mul(mean, wave_range(w, phase, middle[i], middle[(i + 1) % n], unused, unused + 1));
  }
  for (size_t i = 0; i < n; i++) {
    size_t before = (i + n - 1) % n;
    slopes[i] = interval_add(interval_mul(by_p[i], s[before]), interval_mul(s[i], by_q[before]));
    if (n == 3) slopes[i] = interval_mul(slopes[i], s[(i + 1) % n]);
    mean = interval_add(mean, interval_mul(slopes[i], interval_sub(x[i], middle[i])));
  }
  return interval_meet(all, mean);
}

static batten_status noise_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                  double *ranges) {
  const size_t n = a->n;
  const double *v = a->numbers;
  batten_status st = frep_bounds_block(a->children[0], ctx, count, boxes, ranges);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    interval slopes[3], f = {ranges[2 * i], ranges[2 * i + 1]};
    interval noise = noise_range(n, v[1], v[2], boxes + 2 * n * i, boxes + 2 * n * i + n, slopes);
    interval r = interval_add(f, interval_scale(noise, v[0]));
    ranges[2 * i] = r.lo;
    ranges[2 * i + 1] = r.hi;
  }
  return st;
}

static batten_status noise_slopes(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                  double *slopes) {
  const size_t n = a->n;
  const double *v = a->numbers;
  batten_status st = frep_slopes_block(a->children[0], ctx, count, boxes, slopes);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    interval own[3], squares = interval_of(0);
    noise_range(n, v[1], v[2], boxes + 2 * n * i, boxes + 2 * n * i + n, own);
    for (size_t k = 0; k < n; k++) squares = interval_add(squares, interval_square(own[k]));
    slopes[i] = (slopes[i] + fabs(v[0]) * interval_sqrt(squares).hi) * (1 + 1e-12);
  }
  return st;
}

/* A distance that the noise lifts above 0 is no deeper below it than the noise is high. */
static bool noise_box(const batten_frep *a, double *lower, double *upper) {
  const batten_frep *child = a->children[0];
  if (!child->distance || !frep_structural_box(child, lower, upper)) return false;
  double most = fabs(a->numbers[0]) * pow(1 + 1 / NOISE_WEIGHT, a->n) * (1 + 1e-12);
  for (unsigned k = 0; k < a->n; k++) {
    lower[k] = interval_sub(interval_of(lower[k]), interval_of(most)).lo;
    upper[k] = interval_add(interval_of(upper[k]), interval_of(most)).hi;
  }
  return true;
}

batten_status batten_frep_noise(batten_context *ctx, batten_frep *a, double amplitude, double frequency, double phase,
                                batten_frep **out) {
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0) st = frep_check_node(ctx, "a", a, 0);
  if (st >= 0) st = frep_check_numbers(ctx, "amplitude", 1, &amplitude);
  if (st >= 0) st = frep_check_positive(ctx, "frequency", frequency);
  if (st >= 0) st = frep_check_numbers(ctx, "phase", 1, &phase);
  if (st < 0) return st;
  batten_frep_parts parts = {.n = a->n,
                             .number_count = 3,
                             .numbers = (const double[3]){amplitude, frequency, phase},
                             .child_count = 1,
                             .children = {a}};
  return frep_make(ctx, &frep_class_noise, &parts, false, NULL, out);
}

static batten_status create_noise(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  batten_status st = frep_check_parts(ctx, parts, 3, 1);
  const double *v = parts->numbers;
  return st < 0 ? st : batten_frep_noise(ctx, parts->children[0], v[0], v[1], v[2], out);
}

const frep_class frep_class_noise = {.kind = BATTEN_FREP_KIND_NOISE,
                                     .name = "noise",
                                     .evaluate = noise_evaluate,
                                     .bounds = noise_bounds,
                                     .slopes = noise_slopes,
                                     .box = noise_box,
                                     .create = create_noise};
