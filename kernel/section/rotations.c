/* Rotations: exponentials, logarithms, and motions from their angular velocity.  [Savchenko et al. 1995, section 4]
 *
 * The direction cosines gamma of a fixed axis in a frame that turns with the angular velocity omega (in the frame's
 * own coordinates) obey gamma' = -omega x gamma: Poisson's equations, the paper's system. For all three axes together
 * M' = -[omega]x M. Over a step the exact M is exp(-[v]x) M with a vector v; Magnus' series cut after its second
 * term, with Gauss' two places, gives v to order 4:
 *
 *   v = h / 2 (omega_1 + omega_2) + sqrt(3) h^2 / 12 omega_1 x omega_2
 *
 * and the exponential is a rotation whatever v is, so that the first integral |gamma| = 1 holds but for rounding.
 * Runge and Kutta's steps leave it, by what they then report as drift. */
#include "section/rotations.h"

#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "basis/cubic.h"
#include "mesh/vec.h"

void rotation_factors(double square, double *s, double *a, double *b) {
  double x = sqrt(square), half = x / 2, f = half > 0 ? sin(half) / half : 1;
  *s = x > 0 ? sin(x) / x : 1;
  *a = f * f / 2;
  if (square < 0.25) { /* x - sin x cancels */
    double y = square;
    *b = (1 - y / 20 * (1 - y / 42 * (1 - y / 72 * (1 - y / 110 * (1 - y / 156 * (1 - y / 210)))))) / 6;
  } else {
    *b = (1 - *s) / square;
  }
}

void rotation_turn(const double v[3], double *turn) {
  double s, a, b, square = vec_dot(v, v);
  rotation_factors(square, &s, &a, &b);
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) turn[3 * i + j] = a * v[i] * v[j];
    turn[4 * i] += 1 - a * square;
  }
  for (int i = 0; i < 3; i++) { /* -s [v]x */
    int j = (i + 1) % 3, k = (i + 2) % 3;
    turn[3 * j + k] += s * v[i];
    turn[3 * k + j] -= s * v[i];
  }
}

void rotation_multiply(const double *a, const double *b, double *out) {
  double r[9];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) r[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
  memcpy(out, r, sizeof r);
}

/* By the unit quaternion of to from', found from its largest component: right for small turns and for those near pi.
 */
void rotation_between(const double *from, const double *to, double v[3]) {
  double d[3][3], q[4];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) d[i][j] = vec_dot(to + 3 * i, from + 3 * j);
  double trace = d[0][0] + d[1][1] + d[2][2];
  int i = d[1][1] > d[0][0] ? 1 : 0;
  if (d[2][2] > d[i][i]) i = 2;
  int j = (i + 1) % 3, k = (i + 2) % 3;
  if (trace >= d[i][i]) {
    q[3] = 1 + trace;
    for (int m = 0; m < 3; m++) q[m] = d[(m + 1) % 3][(m + 2) % 3] - d[(m + 2) % 3][(m + 1) % 3];
  } else {
    q[i] = 1 + d[i][i] - d[j][j] - d[k][k];
    q[j] = d[i][j] + d[j][i];
    q[k] = d[i][k] + d[k][i];
    q[3] = d[j][k] - d[k][j];
  }
  double length = vec_norm(q), sign = q[3] < 0 ? -1 : 1;
  /* 2 atan2 over the length is 2 / q[3] in the limit: q is not zero */
  double factor = length > 0 ? sign * 2 * atan2(length, fabs(q[3])) / length : 0;
  for (int m = 0; m < 3; m++) v[m] = factor * q[m];
}

void rotation_rate(const double v[3], const double dv[3], double omega[3]) {
  double s, a, b, once[3], twice[3];
  rotation_factors(vec_dot(v, v), &s, &a, &b);
  vec_cross(v, dv, once);
  vec_cross(v, once, twice);
  for (int k = 0; k < 3; k++) omega[k] = dv[k] - a * once[k] + b * twice[k];
}

void rotation_rate_inverse(const double v[3], const double omega[3], double dv[3]) {
  double once[3], twice[3], y = vec_dot(v, v), half = sqrt(y) / 2, c;
  if (y < 0.25) /* (1 - half cot half) / y, whose series has Bernoulli's numbers */
    c = 1.0 / 12 + y * (1.0 / 720 + y * (1.0 / 30240 + y * (1.0 / 1209600 + y * (1.0 / 47900160 + y * 5.284e-10))));
  else
    c = (1 - half * cos(half) / sin(half)) / y;
  vec_cross(v, omega, once);
  vec_cross(v, once, twice);
  for (int k = 0; k < 3; k++) dv[k] = omega[k] + 0.5 * once[k] + c * twice[k];
}

double rotation_defect(const double *m) {
  double worst = 0, normal[3];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      double e = fabs(vec_dot(m + 3 * i, m + 3 * j) - (i == j ? 1 : 0));
      if (!(e <= worst)) worst = isfinite(e) ? e : INFINITY;
    }
  vec_cross(m, m + 3, normal);
  return vec_dot(normal, m + 6) > 0 ? worst : INFINITY;
}

/* Newton's iteration for the polar factor, (3 - m m') m / 2: from 0.1 five steps are enough. What comes out stays as
 * it is when it comes again. */
void rotation_orthonormalize(double *m) {
  for (int round = 0; round < 6 && rotation_defect(m) > 0x1p-50; round++) {
    double c[9];
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) c[3 * i + j] = (i == j ? 1.5 : 0) - vec_dot(m + 3 * i, m + 3 * j) / 2;
    rotation_multiply(c, m, m);
  }
}

/* ---- motions ------------------------------------------------------------------------------------------------- */

/* Samples of omega and the spline through them. */
typedef struct rate_samples {
  size_t count;
  const double *times, *omega, *slopes;
} rate_samples;

static void rate_at(const rate_samples *r, double t, double omega[3]) {
  cubic_value(r->count, 3, r->times, r->omega, r->slopes, t, omega, NULL);
}

static double column_square(const double *m, int j) {
  return m[j] * m[j] + m[3 + j] * m[3 + j] + m[6 + j] * m[6 + j];
}

static double column_drift(const double *m) {
  double worst = 0;
  for (int j = 0; j < 3; j++) worst = fmax(worst, fabs(column_square(m, j) - 1));
  return worst;
}

static void magnus_step(const rate_samples *r, double t, double h, const double *from, double *to) {
  const double root3 = 1.73205080756887729353;
  double a[3], b[3], v[3], turn[9];
  rate_at(r, t + h * (0.5 - root3 / 6), a);
  rate_at(r, t + h * (0.5 + root3 / 6), b);
  vec_cross(a, b, v);
  for (int k = 0; k < 3; k++) v[k] = h / 2 * (a[k] + b[k]) + root3 * h * h / 12 * v[k];
  rotation_turn(v, turn);
  rotation_multiply(turn, from, to);
}

/* out = m + h (-[omega]x) slope, column by column. */
static void rate_step(const double *m, const double *slope, const double omega[3], double h, double *out) {
  for (int j = 0; j < 3; j++) {
    double gamma[3] = {slope[j], slope[3 + j], slope[6 + j]}, w[3];
    vec_cross(omega, gamma, w);
    for (int i = 0; i < 3; i++) out[3 * i + j] = m[3 * i + j] - h * w[i];
  }
}

static void runge_kutta_step(const rate_samples *r, double t, double h, const double *from, double *to) {
  double w[3][3], y[9], sum[9];
  rate_at(r, t, w[0]);
  rate_at(r, t + h / 2, w[1]);
  rate_at(r, t + h, w[2]);
  rate_step(from, from, w[0], h / 6, sum);
  rate_step(from, from, w[0], h / 2, y);
  rate_step(sum, y, w[1], h / 3, sum);
  rate_step(from, y, w[1], h / 2, y);
  rate_step(sum, y, w[1], h / 3, sum);
  rate_step(from, y, w[1], h, y);
  rate_step(sum, y, w[2], h / 6, to);
}

/* One step; returns the drift, of which RUNGE_KUTTA's columns are then rid. */
static double kinematic_step(batten_kinematics method, const rate_samples *r, double t, double h, const double *from,
                             double *to) {
  if (method == BATTEN_KINEMATICS_MAGNUS) {
    magnus_step(r, t, h, from, to);
    return column_drift(to);
  }
  runge_kutta_step(r, t, h, from, to);
  double drift = column_drift(to);
  for (int j = 0; j < 3; j++) {
    double length = sqrt(column_square(to, j));
    for (int i = 0; i < 3 && length > 0; i++) to[3 * i + j] /= length;
  }
  return drift;
}

double rotation_integrate(batten_kinematics method, size_t count, const double *times, const double *omega,
                          const double *slopes, const double *first, double *frames) {
  rate_samples r = {count, times, omega, slopes};
  double drift = 0;
  memcpy(frames, first, 9 * sizeof *frames);
  for (size_t i = 0; i + 1 < count; i++) {
    double h = (times[i + 1] - times[i]) / ROTATION_STEPS;
    for (unsigned j = 0; j < ROTATION_STEPS; j++, frames += 9)
      drift = fmax(drift, kinematic_step(method, &r, times[i] + j * h, h, frames, frames + 9));
  }
  return drift;
}

static batten_status check_motion(batten_context *ctx, batten_kinematics method, size_t count, const double *times,
                                  const double *omega, const double *first, size_t at_count, const double *at,
                                  const double *rotations) {
  if (method != BATTEN_KINEMATICS_MAGNUS && method != BATTEN_KINEMATICS_RUNGE_KUTTA)
    return batten_fail(ctx, BATTEN_E_INVALID, "method: %d; give BATTEN_KINEMATICS_MAGNUS or _RUNGE_KUTTA",
                       (int)method);
  if (count < 2) return batten_fail(ctx, BATTEN_E_INVALID, "count: %zu; give two samples of omega at least", count);
  if (!times || !omega || !first || (at_count && (!at || !rotations)))
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give an array",
                       !times   ? "times"
                       : !omega ? "omega"
                       : !first ? "first"
                       : !at    ? "at"
                                : "rotations");
  size_t size;
  if (!batten_mul3(count, 9 * ROTATION_STEPS, sizeof(double), &size))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu", count);
  for (size_t i = 0; i < count; i++)
    if (!isfinite(times[i]) || (i > 0 && !(times[i] > times[i - 1])))
      return batten_fail(ctx, BATTEN_E_INVALID, "times[%zu]: %g; give finite times that increase", i, times[i]);
  if (!isfinite(times[count - 1] - times[0]))
    return batten_fail(ctx, BATTEN_E_INVALID, "times: %g to %g; their distance is beyond a double", times[0],
                       times[count - 1]);
  size_t bad = batten_first_nonfinite(3 * count, omega);
  if (bad < 3 * count)
    return batten_fail(ctx, BATTEN_E_INVALID, "omega[%zu][%zu]: %g; give finite rates", bad / 3, bad % 3, omega[bad]);
  double defect = rotation_defect(first);
  if (!(defect <= 1e-6))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "first: no rotation (%g off); give right-handed rows, orthonormal to 1e-6", defect);
  for (size_t i = 0; i < at_count; i++)
    if (!(at[i] >= times[0] && at[i] <= times[count - 1]))
      return batten_fail(ctx, BATTEN_E_INVALID, "at[%zu]: %g; give times in [%g, %g], the samples'", i, at[i],
                         times[0], times[count - 1]);
  return BATTEN_OK;
}

batten_status batten_rotations_integrate(batten_context *ctx, batten_kinematics method, size_t count,
                                         const double *times, const double *omega, const double *first,
                                         size_t at_count, const double *at, double *rotations, double *drift) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_status st = check_motion(ctx, method, count, times, omega, first, at_count, at, rotations);
  if (st < 0) return st;
  st = BATTEN_E_NOMEM;
  double start[9];
  memcpy(start, first, sizeof start);
  rotation_orthonormalize(start);
  double *slopes = batten_alloc_array(ctx, count, 4 * sizeof(double));
  double *frames = batten_alloc_array(ctx, ROTATION_STEPS * (count - 1) + 1, 9 * sizeof *frames);
  if (!slopes || !frames) goto done;
  cubic_slopes(count, 3, times, omega, slopes, slopes + 3 * count);
  double worst = rotation_integrate(method, count, times, omega, slopes, start, frames);
  rate_samples r = {count, times, omega, slopes};
  for (size_t i = 0; i < at_count; i++) { /* from the last step's end before it */
    size_t k = cubic_interval(count, times, at[i]);
    double h = (times[k + 1] - times[k]) / ROTATION_STEPS, m[9];
    double steps = floor((at[i] - times[k]) / h);
    size_t j = steps < ROTATION_STEPS ? (size_t)steps : ROTATION_STEPS;
    double from = times[k] + (double)j * h;
    memcpy(m, frames + 9 * (ROTATION_STEPS * k + j), sizeof m);
    if (at[i] > from) worst = fmax(worst, kinematic_step(method, &r, from, at[i] - from, m, m));
    rotation_orthonormalize(m);
    memcpy(rotations + 9 * i, m, sizeof m);
  }
  if (drift) *drift = worst;
  st = BATTEN_OK;
done:
  batten_free(ctx, frames);
  batten_free(ctx, slopes);
  return st;
}
