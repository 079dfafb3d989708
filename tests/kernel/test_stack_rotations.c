/* Turns of frames, and motions from their angular velocity. */
#include "section/rotations.h"

#include <float.h>

#include "tap.h"

static void random_vector(uint64_t *state, double length, double v[3]) {
  double square;
  do {
    square = 0;
    for (int k = 0; k < 3; k++) {
      v[k] = 2 * t_uniform(state) - 1;
      square += v[k] * v[k];
    }
  } while (square > 1 || square < 0.01);
  for (int k = 0; k < 3; k++) v[k] *= length / sqrt(square);
}

static double difference(size_t count, const double *a, const double *b) {
  double worst = 0;
  for (size_t k = 0; k < count; k++) worst = fmax(worst, fabs(a[k] - b[k]));
  return worst;
}

static void test_by_hand(void) {
  /* the frame turned by 90 degrees about its z axis: its x axis is the old y axis */
  const double v[3] = {0, 0, acos(0)}, expected[9] = {0, 1, 0, -1, 0, 0, 0, 0, 1};
  double turn[9];
  rotation_turn(v, turn);
  T_RATIO(difference(9, turn, expected), 2 * DBL_EPSILON, "a quarter turn about z");
  const double half[9] = {1, 0, 0, 0, -1, 0, 0, 0, -1}, one[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  double back[3];
  rotation_between(one, half, back);
  T_RATIO(fabs(fabs(back[0]) - 2 * acos(0)) + fabs(back[1]) + fabs(back[2]), 1e-15, "half a turn about x");
  rotation_between(half, half, back);
  T_CHECK(back[0] == 0 && back[1] == 0 && back[2] == 0, "no turn");
  T_CHECK(rotation_defect(one) == 0 && isinf(rotation_defect((const double[9]){1, 0, 0, 0, 1, 0, 0, 0, -1})) &&
              isinf(rotation_defect((const double[9]){1, 0, 0, 0, NAN, 0, 0, 0, 1})),
          "a reflection and NaN are no rotations");
}

static void test_round_trip(void) {
  const double angles[] = {0, 1e-300, 1e-12, 1e-6, 0.01, 0.4999, 0.5001, 1, 2, 3, 3.14, 3.1415926};
  double worst = 0, defect = 0, rate = 0, inverse = 0;
  uint64_t state = 1;
  for (size_t i = 0; i < sizeof angles / sizeof *angles; i++)
    for (int n = 0; n < 50; n++) {
      double v[3], back[3], turn[9], from[9], to[9], w[3];
      random_vector(&state, 3 * t_uniform(&state), w);
      rotation_turn(w, from);
      random_vector(&state, angles[i], v);
      rotation_turn(v, turn);
      rotation_multiply(turn, from, to);
      rotation_between(from, to, back);
      worst = fmax(worst, difference(3, v, back));
      defect = fmax(defect, rotation_defect(to));
      /* the rate against differences of the turn: turn(v + h dv) = exp(-[h omega]x) turn(v) */
      double dv[3], omega[3], a[3], b[3], ta[9], tb[9], h = 1e-4;
      random_vector(&state, 1, dv);
      for (int k = 0; k < 3; k++) {
        a[k] = v[k] - h * dv[k];
        b[k] = v[k] + h * dv[k];
      }
      rotation_rate(v, dv, omega);
      rotation_turn(a, ta);
      rotation_turn(b, tb);
      rotation_between(ta, tb, back);
      for (int k = 0; k < 3; k++) back[k] /= 2 * h;
      rate = fmax(rate, difference(3, omega, back));
      rotation_rate_inverse(v, omega, back);
      inverse = fmax(inverse, difference(3, dv, back));
    }
  T_RATIO(worst, 1e-14, "turns come back from frames, up to half a turn (seed=1)");
  T_RATIO(defect, 10 * DBL_EPSILON, "turned frames are frames");
  T_RATIO(rate, 1e-8, "rates against differences");
  T_RATIO(inverse, 1e-13, "rates back");
  double m[9] = {1.01, 0.02, 0, -0.01, 0.98, 0.01, 0, 0.005, 1}, again[9];
  rotation_orthonormalize(m);
  memcpy(again, m, sizeof m);
  rotation_orthonormalize(again);
  T_CHECK(rotation_defect(m) < 1e-15 && memcmp(again, m, sizeof m) == 0 && m[0] > 0.99,
          "orthonormal after one call, untouched by the next");
}

/* ---- motions: M = turn about z by 1.3 t and 0.4 t^2 about the new x ----------------------------------------------
 */

static void motion(double t, double *m, double omega[3]) {
  double x = 0.4 * t * t, a[9], b[9];
  rotation_turn((const double[3]){0, 0, 1.3 * t}, a);
  rotation_turn((const double[3]){x, 0, 0}, b);
  rotation_multiply(b, a, m);
  /* about x at 0.8 t, and 1.3 about the old z, whose coordinates are the last column of b */
  omega[0] = 0.8 * t;
  omega[1] = 1.3 * sin(x);
  omega[2] = 1.3 * cos(x);
}

typedef struct motion_case {
  size_t count;
  double times[64], omega[64][3], first[9];
} motion_case;

static motion_case motion_samples(size_t count, double from, double to, double uneven) {
  motion_case c = {.count = count};
  double unused[3];
  for (size_t i = 0; i < count; i++) {
    double u = (double)i / (double)(count - 1), m[9];
    c.times[i] = from + (to - from) * (u + uneven * sin(20 * u) * u * (1 - u));
    motion(c.times[i], m, c.omega[i]);
  }
  motion(from, c.first, unused);
  return c;
}

static double motion_error(batten_context *ctx, const motion_case *c, batten_kinematics method, double *drift) {
  double at[101], rotations[101][9], worst = 0;
  for (int i = 0; i < 101; i++) at[i] = c->times[0] + (c->times[c->count - 1] - c->times[0]) * i / 100;
  at[100] = c->times[c->count - 1];
  batten_status st = batten_rotations_integrate(ctx, method, c->count, c->times, c->omega[0], c->first, 101, at,
                                                rotations[0], drift);
  if (st != BATTEN_OK) return INFINITY;
  for (int i = 0; i < 101; i++) {
    double m[9], omega[3], v[3];
    motion(at[i], m, omega);
    rotation_between(m, rotations[i], v);
    worst = fmax(worst, sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
    if (rotation_defect(rotations[i]) > 1e-15) worst = INFINITY;
  }
  return worst;
}

static void test_motions(batten_context *ctx) {
  double drift, runge_drift;
  motion_case c = motion_samples(50, 0, 2, 0);
  T_RATIO(motion_error(ctx, &c, BATTEN_KINEMATICS_MAGNUS, &drift), 2e-7, "MAGNUS, 50 samples: angle, radians");
  T_RATIO(drift, 1e-13, "its drift");
  T_RATIO(motion_error(ctx, &c, BATTEN_KINEMATICS_RUNGE_KUTTA, &runge_drift), 2e-7, "RUNGE_KUTTA, 50 samples");
  T_CHECK(runge_drift > 10 * drift && runge_drift < 1e-8, "its drift %.2g before columns are made unit", runge_drift);
  c = motion_samples(10, 0, 2, 0);
  T_RATIO(motion_error(ctx, &c, BATTEN_KINEMATICS_MAGNUS, &drift), 2e-4, "MAGNUS, 10 samples");
  T_RATIO(motion_error(ctx, &c, BATTEN_KINEMATICS_RUNGE_KUTTA, &drift), 2e-4, "RUNGE_KUTTA, 10 samples");
  T_RATIO(drift, 1e-5, "its drift");
  c = motion_samples(50, -1, 2, 0.1);
  T_RATIO(motion_error(ctx, &c, BATTEN_KINEMATICS_MAGNUS, NULL), 2e-6, "MAGNUS, 50 uneven samples");
  /* a constant velocity is a screw's: exact with two samples */
  const double times[2] = {1, 3}, omega[6] = {0.3, -0.7, 0.5, 0.3, -0.7, 0.5}, one[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  double at[3] = {3, 1, 1.7}, m[3][9], expected[9];
  T_OK(batten_rotations_integrate(ctx, BATTEN_KINEMATICS_MAGNUS, 2, times, omega, one, 3, at, m[0], &drift), ctx);
  double worst = difference(9, m[1], one);
  for (int i = 0; i < 3; i++) {
    double h = at[i] - 1;
    rotation_turn((const double[3]){0.3 * h, -0.7 * h, 0.5 * h}, expected);
    worst = fmax(worst, difference(9, m[i], expected));
  }
  T_RATIO(worst, 1e-15, "constant velocity is integrated exactly, times in any order");
}

static batten_status call_integrate(batten_context *ctx, void *arg) {
  (void)arg;
  motion_case c = motion_samples(5, 0, 1, 0);
  double m[9];
  return batten_rotations_integrate(ctx, BATTEN_KINEMATICS_MAGNUS, 5, c.times, c.omega[0], c.first, 1,
                                    (const double[1]){0.3}, m, NULL);
}

static void test_bad(batten_context *ctx) {
  const motion_case good = motion_samples(5, 0, 1, 0);
  motion_case c = good;
  double at = 0.5, m[9] = {7};
#define INTEGRATE batten_rotations_integrate(ctx, method, c.count, c.times, c.omega[0], c.first, 1, &at, m, NULL)
  batten_kinematics method = (batten_kinematics)2;
  T_STATUS(INTEGRATE, BATTEN_E_INVALID, ctx, "method: 2; give BATTEN_KINEMATICS_MAGNUS or _RUNGE_KUTTA");
  method = BATTEN_KINEMATICS_MAGNUS;
  c.count = 1;
  T_STATUS(INTEGRATE, BATTEN_E_INVALID, ctx, "count: 1; give two samples of omega at least");
  c = good;
  c.times[2] = c.times[1];
  T_STATUS(INTEGRATE, BATTEN_E_INVALID, ctx, "times[2]: 0.25; give finite times that increase");
  c = good;
  c.times[0] = -1.5e308;
  c.times[4] = 1.5e308;
  T_STATUS(INTEGRATE, BATTEN_E_INVALID, ctx, "times: -1.5e+308 to 1.5e+308; their distance is beyond a double");
  c = good;
  c.omega[3][1] = NAN;
  T_STATUS(INTEGRATE, BATTEN_E_INVALID, ctx, "omega[3][1]: nan; give finite rates");
  c = good;
  c.first[8] = -1;
  T_STATUS(INTEGRATE, BATTEN_E_INVALID, ctx, "first: no rotation (inf off)");
  c = good;
  c.first[0] = 1.00001;
  T_STATUS(INTEGRATE, BATTEN_E_INVALID, ctx, "give right-handed rows, orthonormal to 1e-6");
  c = good;
  at = 1.01;
  T_STATUS(INTEGRATE, BATTEN_E_INVALID, ctx, "at[0]: 1.01; give times in [0, 1], the samples'");
  at = NAN;
  T_STATUS(INTEGRATE, BATTEN_E_INVALID, ctx, "at[0]: nan");
  T_STATUS(batten_rotations_integrate(ctx, method, 5, NULL, c.omega[0], c.first, 1, &at, m, NULL), BATTEN_E_INVALID,
           ctx, "times: NULL; give an array");
  T_STATUS(batten_rotations_integrate(ctx, method, 5, c.times, c.omega[0], c.first, 1, &at, NULL, NULL),
           BATTEN_E_INVALID, ctx, "rotations: NULL; give an array");
  T_STATUS(batten_rotations_integrate(ctx, method, SIZE_MAX / 8, c.times, c.omega[0], c.first, 1, &at, m, NULL),
           BATTEN_E_TOO_LARGE, ctx, "count");
  T_CHECK(batten_rotations_integrate(NULL, method, 5, c.times, c.omega[0], c.first, 1, &at, m, NULL) ==
                  BATTEN_E_INVALID &&
              m[0] == 7,
          "no context; outputs untouched by failures");
  t_fail_every_allocation("batten_rotations_integrate", call_integrate, NULL);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_by_hand();
  test_round_trip();
  test_motions(ctx);
  test_bad(ctx);
  batten_context_free(ctx);
  return t_done();
}
