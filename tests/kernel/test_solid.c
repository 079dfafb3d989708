/* The solid as a whole: exactness, the independence of the ball, invariances, another carrier, parts, few points. */
#include <batten/solid.h>

#include "scenes.h"
#include "tap.h"

enum { MAX = 1500, PROBES = 1000 };

static double points[MAX * 3], probes[PROBES * 3], values[PROBES], others[PROBES];

static void scatter(unsigned n, double half, const double *center) {
  uint64_t seed = 77;
  for (size_t i = 0; i < PROBES * n; i++)
    probes[i] = (center ? center[i % n] : 0) + half * (2 * t_uniform(&seed) - 1);
}

static batten_solid *fit(batten_context *ctx, unsigned n, size_t count, const batten_carrier *carrier,
                         batten_solid_info *info) {
  batten_solid_options o = batten_solid_options_default();
  batten_solid *s = NULL;
  o.carrier = carrier;
  o.orientation = BATTEN_ORIENT_NEVER;
  batten_status st = batten_solid_fit(ctx, n, count, points, &o, &s, info);
  if (st != BATTEN_OK) t_line(false, "fit: %s %s", batten_status_name(st), batten_error(ctx));
  return s;
}

static void evaluate(batten_context *ctx, const batten_solid *s, double *out) {
  if (batten_solid_evaluate(ctx, s, PROBES, probes, out, NULL, NULL) != BATTEN_OK) t_line(false, "evaluate");
}

static double difference(const double *a, const double *b) {
  double worst = 0, scale = 0;
  for (size_t i = 0; i < PROBES; i++) {
    worst = fmax(worst, fabs(a[i] - b[i]));
    scale = fmax(scale, fabs(a[i]));
  }
  return worst / scale;
}

static void test_sphere(batten_context *ctx) {
  batten_solid_info info;
  scene_sphere_points(1, 500, points);
  batten_solid *s = fit(ctx, 3, 500, NULL, &info);
  T_RATIO(info.residual_max, 1e-10, "sphere of 500 random points: f at the data over the range");
  T_RATIO(info.distance_max, 1e-10, "and as a distance");
  scatter(3, 1.4, NULL);
  evaluate(ctx, s, values);
  double worst = 0;
  for (size_t i = 0; i < PROBES; i++)
    if ((values[i] > 0) != (scene_sphere(probes + 3 * i) > 0))
      worst = fmax(worst, fabs(scene_sphere(probes + 3 * i)));
  T_RATIO(worst, 1e-3, "deepest wrong sign among %d probes", PROBES);
  T_CHECK(info.sign == BATTEN_SIGN_CLEAN && info.orientation == BATTEN_ORIENTATION_NONE && info.check.clean,
          "clean without orientation");
  T_CHECK(info.points_given == 500 && info.points_used == 500 && info.duplicates_merged == 0, "counts");
  /* Volume by counting a grid of 60^3 cells: the count's own error is about 60^-1.5 of the ball. */
  enum { GRID = 60 };
  static double row[GRID * 3], f[GRID];
  size_t in = 0;
  for (size_t k = 0; k < GRID * GRID; k++) {
    for (size_t i = 0; i < GRID; i++) {
      row[3 * i] = -1.1 + 2.2 * ((double)i + 0.5) / GRID;
      row[3 * i + 1] = -1.1 + 2.2 * ((double)(k % GRID) + 0.5) / GRID;
      row[3 * i + 2] = -1.1 + 2.2 * ((double)(k / GRID) + 0.5) / GRID;
    }
    batten_solid_evaluate(ctx, s, GRID, row, f, NULL, NULL);
    for (size_t i = 0; i < GRID; i++) in += f[i] >= 0;
  }
  double volume = (double)in * pow(2.2 / GRID, 3);
  T_RATIO(fabs(volume / (4 * SCENE_PI / 3) - 1), 4e-3, "volume %.4f against 4 pi / 3", volume);
  size_t count;
  const double *seeds = batten_solid_points(s, &count);
  T_CHECK(count == 500 && !memcmp(seeds, points, 500 * 3 * sizeof *points), "its points are the data");
  double lower[3], upper[3];
  batten_solid_box(s, lower, upper);
  T_CHECK(lower[2] < -0.95 && upper[0] > 0.95 && batten_solid_sign(s) == 1 && batten_solid_dimension(s) == 3,
          "box, sign");
  batten_solid_free(s);
}

/* With m = 2 the quadratic part of every ball is the same and the rest is linear, which the spline contains: f is the
 * same function. */
static void test_every_ball(batten_context *ctx) {
  const double centers[3][3] = {{0, 0, 0}, {0.5, -0.3, 0.2}, {2, 1, -1}}, radii[3] = {1, 0.4, 3};
  for (unsigned n = 2; n <= 3; n++) {
    size_t count = n == 3 ? 400 : 67;
    if (n == 3)
      scene_moon_points(5, count, points);
    else
      scene_pair_points(count, points);
    scatter(n, 2, NULL);
    for (int k = 0; k < 3; k++) {
      batten_carrier *ball = NULL;
      T_OK(batten_carrier_ball(ctx, n, centers[k], radii[k], &ball), ctx);
      batten_solid *s = fit(ctx, n, count, ball, NULL);
      evaluate(ctx, s, k ? others : values);
      if (k) T_RATIO(difference(values, others), 1e-10, "ball %d gives the f of ball 0 (n = %u)", k, n);
      batten_solid_free(s);
      batten_carrier_free(ball);
    }
  }
}

/* f of moved data at moved probes, against values. Rotation about an axis, doubling, translation, another order. */
static void test_invariance(batten_context *ctx) {
  enum { COUNT = 300 };
  static double original[COUNT * 3], at[PROBES * 3];
  const double c = cos(0.7), s = sin(0.7), d = cos(0.4), e = sin(0.4);
  const double turn[9] = {c, s, 0, -d * s, d * c, e, e * s, -e * c, d};
  scene_moon_points(3, COUNT, original);
  scatter(3, 1.6, NULL);
  memcpy(at, probes, sizeof at);
  memcpy(points, original, sizeof original);
  batten_solid *solid = fit(ctx, 3, COUNT, NULL, NULL);
  evaluate(ctx, solid, values);
  batten_solid_free(solid);
  const char *names[4] = {"rotated", "1024 times as large", "moved by 7e6", "in reverse order"};
  /* Moving by 7e6 rounds the data to 1e-9: f moves by as much times its slope, the scatter of w times that. */
  const double bounds[4] = {1e-11, 1e-12, 1e-6, 1e-11};
  for (int way = 0; way < 4; way++) {
    double *sets[2] = {points, probes};
    const double *from[2] = {original, at};
    for (int k = 0; k < 2; k++)
      for (size_t i = 0; i < (k ? PROBES : COUNT); i++) {
        const double *x = from[k] + 3 * i;
        double *y = sets[k] + 3 * (way == 3 && k == 0 ? COUNT - 1 - i : i);
        for (size_t a = 0; a < 3; a++) {
          y[a] = way == 0 ? turn[3 * a] * x[0] + turn[3 * a + 1] * x[1] + turn[3 * a + 2] * x[2] : x[a];
          if (way == 1) y[a] *= 1024;
          if (way == 2) y[a] += 7e6;
        }
      }
    solid = fit(ctx, 3, COUNT, NULL, NULL);
    evaluate(ctx, solid, others);
    batten_solid_free(solid);
    for (size_t i = 0; way == 1 && i < PROBES; i++) others[i] /= 1024.0 * 1024.0; /* the carrier is an area */
    T_RATIO(difference(values, others), bounds[way], "%s: the same f", names[way]);
  }
}

static void test_derivatives(batten_context *ctx) {
  const double h = 1e-5;
  scene_torus_points(1, 200, points);
  batten_solid *s = fit(ctx, 3, 200, NULL, NULL);
  batten_field field = batten_solid_field(s);
  double worst = 0, worst_hessian = 0;
  scatter(3, 1.2, NULL);
  for (size_t i = 0; i < 50; i++) {
    double *x = probes + 3 * i, f, g[3], hess[9], fp, fm, gp[3], gm[3];
    field.evaluate(field.user, ctx, 1, x, &f, g, hess);
    for (size_t k = 0; k < 3; k++) {
      double keep = x[k];
      x[k] = keep + h;
      field.evaluate(field.user, ctx, 1, x, &fp, gp, NULL);
      x[k] = keep - h;
      field.evaluate(field.user, ctx, 1, x, &fm, gm, NULL);
      x[k] = keep;
      worst = fmax(worst, fabs((fp - fm) / (2 * h) - g[k]));
      for (size_t j = 0; j < 3; j++)
        worst_hessian = fmax(worst_hessian, fabs((gp[j] - gm[j]) / (2 * h) - hess[3 * k + j]));
    }
  }
  T_RATIO(worst, 1e-6, "gradient against differences");
  T_RATIO(worst_hessian, 1e-4, "Hessian against differences"); /* third derivatives of r at 0.02 are 2500 */
  T_CHECK(field.dimension == 3 && field.order == 2, "the field has everything");
  batten_solid_free(s);
}

/* The paper's figure 5: a cube on the union of two balls, then the balls move apart while the spline stays. */
static void test_deformation(batten_context *ctx) {
  batten_carrier *a = NULL, *b = NULL, *both = NULL, *apart = NULL;
  batten_solid *moved = NULL;
  scene_cube_points(4, 90, points);
  batten_carrier_ball(ctx, 3, (double[]){-0.5, 0, 0}, 1.2, &a);
  batten_carrier_ball(ctx, 3, (double[]){0.5, 0, 0}, 1.2, &b);
  T_OK(batten_carrier_union(ctx, a, b, 0, &both), ctx);
  batten_solid_options o = batten_solid_options_default();
  batten_solid *s = NULL;
  batten_solid_info info;
  o.carrier = both;
  o.orientation = BATTEN_ORIENT_NEVER;
  batten_status st = batten_solid_fit(ctx, 3, 90, points, &o, &s, &info);
  /* 90 random points leave a corner out here and there: such a point may end up alone, which is told. */
  T_CHECK(st >= 0 && info.check.weak_gradients <= 1 && info.check.flipped_neighbours == 0 &&
              info.check.phantom_components == 0 && info.check.phantom_cells == 0,
          "cube of 90 points on two balls: %s, %zu weak points", batten_status_name(st), info.check.weak_gradients);
  batten_carrier_free(a);
  batten_carrier_free(b);
  scatter(3, 1.8, NULL);
  evaluate(ctx, s, values);
  size_t wrong = 0;
  for (size_t i = 0; i < PROBES; i++) {
    double t = scene_cube(probes + 3 * i);
    wrong += fabs(t) > 0.35 && (values[i] > 0) != (t > 0);
  }
  T_CHECK(wrong == 0, "cube of 90 points on two balls: signs right beyond 0.35, the spacing");
  batten_carrier_ball(ctx, 3, (double[]){-0.8, 0, 0}, 1.2, &a);
  batten_carrier_ball(ctx, 3, (double[]){0.8, 0, 0}, 1.2, &b);
  batten_carrier_union(ctx, a, b, 0, &apart);
  T_OK(batten_solid_with_carrier(ctx, s, apart, &moved), ctx);
  batten_spline_parts before, after;
  batten_spline_get_parts(batten_solid_spline(s), &before);
  batten_spline_get_parts(batten_solid_spline(moved), &after);
  T_CHECK(before.coefficients == after.coefficients && batten_solid_carrier(moved) == apart, "the spline is shared");
  evaluate(ctx, moved, others);
  static double f0[PROBES], f1[PROBES];
  batten_carrier_evaluate(ctx, both, PROBES, probes, f0, NULL, NULL);
  batten_carrier_evaluate(ctx, apart, PROBES, probes, f1, NULL, NULL);
  double worst = 0;
  for (size_t i = 0; i < PROBES; i++) worst = fmax(worst, fabs((others[i] - values[i]) - (f1[i] - f0[i])));
  T_RATIO(worst, 1e-13, "f changes by what the carrier changes by");
  double lower[3], upper[3], old[3], high[3], f[90];
  size_t count;
  const double *seeds = batten_solid_points(moved, &count);
  batten_solid_box(s, old, high);
  batten_solid_box(moved, lower, upper);
  T_CHECK(upper[0] > high[0] + 0.1, "it is longer: %.2f, was %.2f", upper[0], high[0]);
  batten_solid_evaluate(ctx, moved, count, seeds, f, NULL, NULL);
  double off = 0;
  for (size_t i = 0; i < count; i++) off = fmax(off, fabs(f[i]));
  T_RATIO(off, 1e-8, "its %zu points were moved onto its surface", count);
  batten_solid_free(s); /* the spline lives on in the other */
  evaluate(ctx, moved, values);
  T_RATIO(difference(others, values), 0, "and outlives the solid that it came from");
  batten_solid_free(moved);
  batten_carrier_free(a);
  batten_carrier_free(b);
  batten_carrier_free(both);
  batten_carrier_free(apart);
}

static void test_create(batten_context *ctx) {
  batten_solid_info info;
  batten_solid *s, *copy = NULL, *onion = NULL;
  batten_carrier *inner = NULL;
  double lower[3], upper[3];
  scene_moon_points(9, 200, points);
  s = fit(ctx, 3, 200, NULL, &info);
  batten_solid_box(s, lower, upper);
  T_OK(batten_solid_create(ctx, batten_solid_spline(s), batten_solid_carrier(s), batten_solid_sign(s), lower, upper,
                           0, NULL, &copy),
       ctx);
  scatter(3, 1.5, NULL);
  evaluate(ctx, s, values);
  evaluate(ctx, copy, others);
  size_t count;
  batten_solid_points(copy, &count);
  T_CHECK(!memcmp(values, others, sizeof values) && count == 200,
          "the same bits from its parts, all points on f = 0");
  batten_solid_free(copy);
  /* A solid as carrier of another: already right, so that U is 0 and nothing changes. */
  T_OK(batten_carrier_solid(ctx, s, &inner), ctx);
  onion = fit(ctx, 3, 200, inner, NULL);
  evaluate(ctx, onion, others);
  T_RATIO(difference(values, others), 1e-9, "a solid as carrier of its own points");
  batten_solid_free(s);
  batten_carrier_free(inner);
  batten_solid_free(onion);
  /* Pairs off the surface are told from the data by f. */
  batten_solid_options o = batten_solid_options_default();
  static double normals[200 * 3];
  for (size_t i = 0; i < 200; i++) scene_normal(3, scene_moon, points + 3 * i, normals + 3 * i);
  o.normals = normals;
  o.orientation = BATTEN_ORIENT_GIVEN;
  o.orient_data = BATTEN_ORIENT_DATA_PAIRS;
  T_OK(batten_solid_fit(ctx, 3, 200, points, &o, &s, &info), ctx);
  T_OK(batten_solid_create(ctx, batten_solid_spline(s), batten_solid_carrier(s), 1, lower, upper, 0, NULL, &copy),
       ctx);
  const double *kept = batten_solid_points(copy, &count);
  T_CHECK(count == 200 && !memcmp(kept, points, 200 * 3 * sizeof *kept), "pairs are not among the points");
  batten_solid_free(copy);
  batten_solid_free(s);
}

static void test_line(batten_context *ctx) {
  const double two[2] = {3, -1}, four[4] = {5, 0, 1, 7}, at[5] = {-2, 0.5, 3, 6, 9};
  double f[5];
  batten_solid *s = NULL;
  batten_solid_info info;
  T_OK(batten_solid_fit(ctx, 1, 2, two, NULL, &s, &info), ctx);
  T_OK(batten_solid_evaluate(ctx, s, 3, (double[]){-2, 1, 4}, f, NULL, NULL), ctx);
  T_CHECK(f[0] < 0 && f[1] > 0 && f[2] < 0, "two points bound an interval: %g %g %g", f[0], f[1], f[2]);
  batten_solid_free(s);
  T_OK(batten_solid_fit(ctx, 1, 4, four, NULL, &s, &info), ctx);
  T_OK(batten_solid_evaluate(ctx, s, 5, at, f, NULL, NULL), ctx);
  T_CHECK(f[0] < 0 && f[1] > 0 && f[2] < 0 && f[3] > 0 && f[4] < 0, "four points bound two");
  /* Between ends with slopes +1 and -1 the cubic is the parabola (x - a)(b - x) / (b - a). */
  T_RATIO(fabs(f[1] - 0.25), 1e-13, "the middle of [0, 1]");
  T_RATIO(fabs(f[3] - 0.5), 1e-13, "the middle of [5, 7]");
  batten_solid_free(s);
  s = NULL;
  T_STATUS(batten_solid_fit(ctx, 1, 3, four, NULL, &s, NULL), BATTEN_E_INVALID, ctx, "points: 3 distinct ends");
  T_STATUS(batten_solid_fit(ctx, 1, 1, four, NULL, &s, NULL), BATTEN_E_INVALID, ctx, "at least 2");
}

static void test_duplicates(batten_context *ctx) {
  batten_solid_options o = batten_solid_options_default();
  batten_solid_info info;
  batten_solid *s = NULL;
  scene_sphere_points(2, 300, points);
  memcpy(points + 900, points, 300 * sizeof *points); /* 100 of them again */
  for (size_t i = 0; i < 60; i++)
    points[1200 + i] = points[i] + (i % 3 == 0 ? 1e-4 : 0); /* 20 of them, moved a little */
  T_OK(batten_solid_fit(ctx, 3, 420, points, NULL, &s, &info), ctx);
  T_CHECK(info.points_given == 420 && info.points_used == 320 && info.duplicates_merged == 100,
          "100 equal points merge");
  batten_solid_free(s);
  o.merge_radius = 2e-4;
  T_OK(batten_solid_fit(ctx, 3, 420, points, &o, &s, &info), ctx);
  T_CHECK(info.points_used == 300 && info.duplicates_merged == 120, "and 20 near ones within the radius");
  size_t count;
  T_CHECK(!memcmp(batten_solid_points(s, &count), points, 900 * sizeof *points), "the first of each place stays");
  batten_solid_free(s);
}

static void test_smoothing(batten_context *ctx) {
  batten_solid_options o = batten_solid_options_default();
  batten_solid_info info;
  batten_solid *s = NULL;
  static double each[301];
  scene_sphere_points(2, 300, points);
  uint64_t seed = 4;
  for (size_t i = 0; i < 900; i++) points[i] *= 1 + 0.02 * (t_uniform(&seed) - 0.5);
  memcpy(points + 900, points, 3 * sizeof *points);
  o.spline.smoothing = 0.05;
  T_OK(batten_solid_fit(ctx, 3, 301, points, &o, &s, &info), ctx);
  double one = info.distance_max;
  T_CHECK(one > 1e-4 && one < 0.05, "smoothing leaves the data by %.3g", one);
  evaluate(ctx, s, values);
  batten_solid_free(s);
  for (size_t i = 0; i < 301; i++) each[i] = 0.05;
  o.spline.smoothing = 0;
  o.spline.smoothing_per_point = each;
  T_OK(batten_solid_fit(ctx, 3, 301, points, &o, &s, &info), ctx);
  T_RATIO(fabs(info.distance_max / one - 1), 1e-9, "the same per point, past a merged duplicate");
  batten_solid_free(s);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_sphere(ctx);
  test_every_ball(ctx);
  test_invariance(ctx);
  test_derivatives(ctx);
  test_deformation(ctx);
  test_create(ctx);
  test_line(ctx);
  test_duplicates(ctx);
  test_smoothing(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all released");
  batten_context_free(ctx);
  return t_done();
}
