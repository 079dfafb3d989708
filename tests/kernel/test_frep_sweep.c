/* The algebra of solids: sweeps along paths, deformation by displaced points. */
#include "frep/frep_inner.h"
#include "frep_checks.h"

#define PI 3.14159265358979323846

static double value_at(batten_context *ctx, const batten_frep *a, double x, double y, double z) {
  double p[3] = {x, y, z}, f = NAN;
  return batten_frep_evaluate(ctx, a, 1, p, &f, NULL) == BATTEN_OK ? f : NAN;
}

static void check_box(batten_context *ctx, const char *what, const batten_frep *a, double size) {
  enum { COUNT = 20000 };
  static double x[3 * COUNT], f[COUNT];
  unsigned n = batten_frep_dimension(a);
  double lower[3], upper[3];
  if (!T_CHECK(frep_structural_box(a, lower, upper), "%s has a box", what)) return;
  uint64_t seed = 77;
  for (size_t i = 0; i < n * COUNT; i++) x[i] = size * (2 * t_uniform(&seed) - 1);
  T_OK(batten_frep_evaluate(ctx, a, COUNT, x, f, NULL), ctx);
  size_t inside = 0, outside = 0;
  for (size_t i = 0; i < COUNT; i++)
    for (unsigned k = 0; k < n && f[i] >= 0; k++) {
      inside += k == 0;
      outside += x[n * i + k] < lower[k] || x[n * i + k] > upper[k];
    }
  T_CHECK(inside > 20 && outside == 0, "%s: its box [%.3g %.3g] [%.3g %.3g] holds it (%zu inside)", what, lower[0],
          upper[0], lower[1], upper[1], inside);
}

/* Ellipse with a notch: not symmetric, no distance. */
static batten_frep *make_profile(batten_context *ctx, double size) {
  batten_frep *disc = NULL, *ellipse = NULL, *notch = NULL, *profile = NULL;
  T_OK(batten_frep_ball(ctx, 2, (double[]){0, 0}, size, &disc), ctx);
  T_OK(batten_frep_affine(ctx, disc, (double[]){1, 0.2, 0, 0.6}, (double[]){0.1 * size, 0}, &ellipse), ctx);
  T_OK(batten_frep_ball(ctx, 2, (double[]){0.6 * size, 0.6 * size}, 0.5 * size, &notch), ctx);
  T_OK(batten_frep_combine(ctx, BATTEN_FREP_DIFFERENCE, ellipse, notch, 1, &profile), ctx);
  batten_frep_free(disc);
  batten_frep_free(ellipse);
  batten_frep_free(notch);
  return profile;
}

/* Points of a circle's arc in the xy plane. */
static void arc(size_t count, double radius, double from, double to, double *path) {
  for (size_t i = 0; i < count; i++) {
    double t = from + (to - from) * (double)i / (double)(count - 1);
    path[3 * i] = radius * cos(t);
    path[3 * i + 1] = radius * sin(t);
    path[3 * i + 2] = 0;
  }
}

static void test_straight(batten_context *ctx) {
  batten_frep *profile = make_profile(ctx, 0.5), *a = NULL, *b = NULL;
  /* along z with up = y: the profile's own axes, so that it is the extrusion */
  const double path[6] = {0, 0, -0.5, 0, 0, 0.8}, up[3] = {0, 1, 0.3};
  T_OK(batten_frep_extrude(ctx, profile, -0.5, 0.8, &b), ctx);
  uint64_t seed = 3;
  for (int smooth = 0; smooth < 2; smooth++) {
    T_OK(batten_frep_sweep(ctx, profile, 2, path, smooth, 0, up, &a), ctx);
    frep_check(ctx, "straight sweep", a, 1.5, 0.04, 1e-7, 4096);
    check_box(ctx, "straight sweep", a, 1.5);
    double worst = 0;
    for (int i = 0; i < 300; i++) {
      double p[3] = {2 * t_uniform(&seed) - 1, 2 * t_uniform(&seed) - 1, 3 * t_uniform(&seed) - 1.5};
      worst = fmax(worst, fabs(value_at(ctx, a, p[0], p[1], p[2]) - value_at(ctx, b, p[0], p[1], p[2])));
    }
    T_RATIO(worst, 1e-14, "a straight sweep is the extrusion");
    batten_frep_free(a);
  }
  batten_frep_free(b);
  /* a smooth path of points on a line is the same; a smooth path and a polyline agree */
  const double line[12] = {0, 0, -0.5, 0, 0, 0.1, 0, 0, 0.3, 0, 0, 0.8};
  T_OK(batten_frep_sweep(ctx, profile, 4, line, 1, 0, up, &a), ctx);
  T_OK(batten_frep_extrude(ctx, profile, -0.5, 0.8, &b), ctx);
  frep_check(ctx, "sweep along points of a line", a, 1.5, 0.04, 1e-7, 4096);
  double worst = 0;
  for (int i = 0; i < 300; i++) {
    double p[3] = {2 * t_uniform(&seed) - 1, 2 * t_uniform(&seed) - 1, 3 * t_uniform(&seed) - 1.5};
    worst = fmax(worst, fabs(value_at(ctx, a, p[0], p[1], p[2]) - value_at(ctx, b, p[0], p[1], p[2])));
  }
  T_RATIO(worst, 1e-13, "so is one along points of a line");
  batten_frep_free(a);
  batten_frep_free(b);
  batten_frep_free(profile);
}

static void test_ring(batten_context *ctx) {
  enum { COUNT = 24 };
  double path[3 * (COUNT + 1)];
  batten_frep *disc = NULL, *a = NULL, *profile = make_profile(ctx, 0.35);
  T_OK(batten_frep_ball(ctx, 2, (double[]){0, 0}, 0.3, &disc), ctx);
  arc(COUNT + 1, 0.9, 0, 2 * PI, path);
  T_OK(batten_frep_sweep(ctx, disc, COUNT, path, 1, 1, NULL, &a), ctx);
  frep_check(ctx, "ring", a, 1.5, 0.02, 1e-6, 4096);
  check_box(ctx, "ring", a, 1.5);
  uint64_t seed = 9;
  double worst = 0;
  for (int i = 0; i < 500; i++) {
    double p[3] = {3 * t_uniform(&seed) - 1.5, 3 * t_uniform(&seed) - 1.5, 2 * t_uniform(&seed) - 1};
    double torus = 0.3 - hypot(hypot(p[0], p[1]) - 0.9, p[2]);
    worst = fmax(worst, fabs(value_at(ctx, a, p[0], p[1], p[2]) - torus));
  }
  T_RATIO(worst, 2e-4, "a disc along 24 points of a circle is the torus"); /* the spline misses the circle so far */
  batten_frep_free(a);
  /* a profile without symmetry, up = z: y is z, x points inwards; against the revolved profile */
  batten_frep *moved = NULL, *turned = NULL;
  T_OK(batten_frep_affine(ctx, profile, (double[]){-1, 0, 0, 1}, (double[]){0.9, 0}, &moved), ctx);
  T_OK(batten_frep_revolve(ctx, moved, &turned), ctx);
  T_OK(batten_frep_sweep(ctx, profile, COUNT, path, 1, 1, (double[]){0, 0, 1}, &a), ctx);
  frep_check(ctx, "ring of a profile", a, 1.5, 0.04, 1e-6, 4096);
  double mirrored = 0;
  worst = 0;
  for (int i = 0; i < 500; i++) {
    double p[3] = {3 * t_uniform(&seed) - 1.5, 3 * t_uniform(&seed) - 1.5, 2 * t_uniform(&seed) - 1};
    double f = value_at(ctx, a, p[0], p[1], p[2]), g = value_at(ctx, turned, p[0], p[1], p[2]);
    worst = fmax(worst, fabs(f - g));
    mirrored = fmax(mirrored, fabs(f - value_at(ctx, turned, p[0], p[1], -p[2])));
  }
  T_CHECK(worst < 4e-4 && mirrored > 0.05, "the ring of a profile is the solid of revolution: %.3g (mirrored %.3g)",
          worst, mirrored);
  batten_frep_free(moved);
  batten_frep_free(turned);
  batten_frep_free(a);
  batten_frep_free(disc);
  batten_frep_free(profile);
}

/* A closed path in space, whose frame comes back turned. */
static void test_knot(batten_context *ctx) {
  enum { COUNT = 40 };
  double path[3 * COUNT];
  for (int i = 0; i < COUNT; i++) {
    double t = 2 * PI * i / COUNT;
    path[3 * i] = 0.35 * (sin(t) + 2 * sin(2 * t));
    path[3 * i + 1] = 0.35 * (cos(t) - 2 * cos(2 * t));
    path[3 * i + 2] = -0.35 * sin(3 * t);
  }
  batten_frep *profile = make_profile(ctx, 0.2), *a = NULL;
  T_OK(batten_frep_sweep(ctx, profile, COUNT, path, 1, 1, NULL, &a), ctx);
  frep_check(ctx, "knot", a, 1.5, 0.08, 1e-4, 4096);
  check_box(ctx, "knot", a, 1.5);
  double jump = 0, before = NAN;
  /* no step where it closes: values beside the path, all along it, in steps that share no turn with the points */
  for (int i = 0; i < 8000; i++) {
    double t = 2 * PI * (i - 4000) / 8000 * 0.1;
    double x = 0.35 * (sin(t) + 2 * sin(2 * t)), y = 0.35 * (cos(t) - 2 * cos(2 * t)), z = -0.35 * sin(3 * t);
    double f = value_at(ctx, a, x + 0.05, y + 0.07, z + 0.09);
    if (i > 0) jump = fmax(jump, fabs(f - before));
    before = f;
  }
  T_RATIO(jump, 1e-3, "knot: no jump where it closes");
  batten_frep_free(a);
  batten_frep_free(profile);
}

/* Values by brute force: the profile in the frame's plane at every t of a fine sampling whose plane is near. */
static void test_open(batten_context *ctx) {
  enum { COUNT = 9 };
  double path[3 * COUNT];
  arc(COUNT, 0.8, 0, PI, path);
  for (int i = 0; i < COUNT; i++) path[3 * i + 2] = 0.05 * i;
  batten_frep *profile = make_profile(ctx, 0.25), *disc = NULL, *a = NULL;
  T_OK(batten_frep_sweep(ctx, profile, COUNT, path, 1, 0, NULL, &a), ctx);
  frep_check(ctx, "arc", a, 1.5, 0.05, 1e-5, 4096);
  check_box(ctx, "arc", a, 1.5);
  batten_frep_free(a);
  /* a tight bend: planes cross within the profile; a disc of radius 0.5 about an arc of radius 0.3 holds every ball
   * of its discs: each of the points of each disc is in */
  T_OK(batten_frep_ball(ctx, 2, (double[]){0, 0}, 0.5, &disc), ctx);
  arc(COUNT, 0.3, 0, PI, path);
  for (int i = 0; i < COUNT; i++) path[3 * i + 2] = 0;
  T_OK(batten_frep_sweep(ctx, disc, COUNT, path, 1, 0, NULL, &a), ctx);
  frep_check_bounds(ctx, "tight arc", a, 1.5, 4096, 5);
  size_t out = 0;
  uint64_t seed = 31;
  for (int i = 0; i < 2000; i++) {
    double t = PI * (0.02 + 0.96 * t_uniform(&seed)), s = 0.49 * (2 * t_uniform(&seed) - 1);
    double z = sqrt(0.49 * 0.49 - s * s) * (2 * t_uniform(&seed) - 1);
    if (!(value_at(ctx, a, (0.3 + s) * cos(t), (0.3 + s) * sin(t), z) > -2e-3)) out++;
  }
  T_CHECK(out == 0, "tight arc: every place of the profile is in (%zu out)", out);
  batten_frep_free(a);
  batten_frep_free(disc);
  batten_frep_free(profile);
}

static void test_polyline(batten_context *ctx) {
  const double path[12] = {-0.8, 0, 0, 0.2, 0, 0.1, 0.4, 0.7, 0.2, 0.4, 0.7, 0.9};
  batten_frep *profile = make_profile(ctx, 0.25), *disc = NULL, *a = NULL;
  for (int closed = 0; closed < 2; closed++) {
    T_OK(batten_frep_sweep(ctx, profile, 4, path, 0, closed, (double[]){0, 0, 1}, &a), ctx);
    frep_check(ctx, closed ? "closed polyline" : "polyline", a, 1.5, 0.05, 1e-7, 4096);
    check_box(ctx, "polyline", a, 1.5);
    batten_frep_free(a);
  }
  T_OK(batten_frep_ball(ctx, 2, (double[]){0, 0}, 0.2, &disc), ctx);
  T_OK(batten_frep_sweep(ctx, disc, 4, path, 0, 0, NULL, &a), ctx);
  batten_frep *cone = NULL, *all = NULL, *next = NULL;
  for (size_t i = 0; i < 3; i++) {
    T_OK(batten_frep_cone(ctx, path + 3 * i, path + 3 * i + 3, 0.2, 0.2, &cone), ctx);
    if (i == 0) {
      all = cone;
      continue;
    }
    T_OK(batten_frep_combine(ctx, BATTEN_FREP_UNION, all, cone, 1, &next), ctx);
    batten_frep_free(all);
    batten_frep_free(cone);
    all = next;
  }
  double worst = 0;
  uint64_t seed = 12;
  for (int i = 0; i < 500; i++) {
    double p[3] = {3 * t_uniform(&seed) - 1.5, 3 * t_uniform(&seed) - 1.5, 3 * t_uniform(&seed) - 1.5};
    worst = fmax(worst, fabs(value_at(ctx, a, p[0], p[1], p[2]) - value_at(ctx, all, p[0], p[1], p[2])));
  }
  T_RATIO(worst, 1e-14, "a disc along a polyline is the union of cylinders");
  batten_frep_free(all);
  batten_frep_free(a);
  batten_frep_free(disc);
  batten_frep_free(profile);
}

static void test_solid(batten_context *ctx) {
  const double path[9] = {0.2, 0, 0, 0.9, 0.1, 0, 0.9, 0.8, 0.4};
  batten_frep *ball = NULL, *a = NULL, *oblong = NULL;
  T_OK(batten_frep_ball(ctx, 3, (double[]){0, -0.1, 0}, 0.3, &ball), ctx);
  T_OK(batten_frep_sweep(ctx, ball, 3, path, 0, 0, NULL, &a), ctx);
  T_CHECK(batten_frep_is_distance(a), "a ball's sweep is a distance");
  frep_check(ctx, "ball along a polyline", a, 1.5, 0.02, 1e-6, 1024);
  check_box(ctx, "ball along a polyline", a, 1.5);
  /* the distance from the polyline, which starts in the ball's own middle */
  double worst = 0;
  uint64_t seed = 12;
  for (int i = 0; i < 500; i++) {
    double p[3], least = INFINITY;
    for (int k = 0; k < 3; k++) p[k] = 3 * t_uniform(&seed) - 1.5;
    for (int j = 0; j < 2; j++) {
      double v[3], q[3], vv = 0, vq = 0, square = 0;
      for (int k = 0; k < 3; k++) {
        v[k] = path[3 * j + 3 + k] - path[3 * j + k];
        q[k] = p[k] - (path[3 * j + k] - path[k]) - (k == 1 ? -0.1 : 0);
        vv += v[k] * v[k];
        vq += v[k] * q[k];
      }
      double t = fmin(fmax(vq / vv, 0), 1);
      for (int k = 0; k < 3; k++) square += (q[k] - t * v[k]) * (q[k] - t * v[k]);
      least = fmin(least, sqrt(square));
    }
    worst = fmax(worst, fabs(value_at(ctx, a, p[0], p[1], p[2]) - (0.3 - least)));
  }
  T_RATIO(worst, 1e-14, "a ball along a polyline is the distance from it");
  batten_frep_free(a);
  const double stretch[9] = {1, 0.3, 0, 0, 0.5, 0, 0, 0, 0.7};
  T_OK(batten_frep_affine(ctx, ball, stretch, (double[]){0, 0, 0}, &oblong), ctx);
  T_OK(batten_frep_sweep(ctx, oblong, 3, path, 1, 1, NULL, &a), ctx);
  frep_check(ctx, "ellipsoid along a closed path", a, 1.5, 0.03, 1e-6, 1024);
  check_box(ctx, "ellipsoid along a closed path", a, 1.5);
  batten_frep_free(a);
  batten_frep_free(oblong);
  batten_frep_free(ball);
}

static void test_bad_paths(batten_context *ctx) {
  batten_frep *disc = NULL, *a = NULL;
  T_OK(batten_frep_ball(ctx, 2, (double[]){0, 0}, 0.2, &disc), ctx);
  const double twice[9] = {0, 0, 0, 1, 0, 0, 1, 0, 0}, back[9] = {0, 0, 0, 1, 0, 0, 0, 0, 0};
  T_STATUS(batten_frep_sweep(ctx, disc, 1, twice, 0, 0, NULL, &a), BATTEN_E_INVALID, ctx, "count: 1; give 2");
  T_STATUS(batten_frep_sweep(ctx, disc, 2, twice, 0, 1, NULL, &a), BATTEN_E_INVALID, ctx, "count: 2; give 3");
  T_STATUS(batten_frep_sweep(ctx, disc, 3, twice, 0, 0, NULL, &a), BATTEN_E_INVALID, ctx, "path[2]: equals path[1]");
  T_STATUS(batten_frep_sweep(ctx, disc, 3, back, 0, 1, NULL, &a), BATTEN_E_INVALID, ctx,
           "path[2]: equals path[0]; leave one of them out (a closed path comes back by itself)");
  T_STATUS(batten_frep_sweep(ctx, disc, 3, back, 1, 0, NULL, &a), BATTEN_E_INVALID, ctx,
           "path: stands still near (1, 0, 0)");
  T_STATUS(batten_frep_sweep(ctx, disc, 2, twice, 0, 0, (double[]){2, 0, 0}, &a), BATTEN_E_INVALID, ctx,
           "up: lies along the path");
  T_STATUS(batten_frep_sweep(ctx, disc, 2, NULL, 0, 0, NULL, &a), BATTEN_E_INVALID, ctx, "path: NULL");
  T_STATUS(batten_frep_sweep(ctx, disc, 2, (double[]){0, 0, 0, NAN, 0, 0}, 0, 0, NULL, &a), BATTEN_E_INVALID, ctx,
           "path[3]: nan");
  T_CHECK(!a, "bad paths leave out untouched");
  T_OK(batten_frep_sweep(ctx, disc, 3, back, 0, 0, NULL, &a), ctx); /* a polyline may turn back */
  batten_frep_free(a);
  batten_frep_free(disc);
}

/* ---- displaced points ------------------------------------------------------------------------------ */

static void test_deform(batten_context *ctx) {
  for (unsigned n = 2; n <= 3; n++) {
    enum { COUNT = 20 };
    double from[3 * COUNT], to[3 * COUNT];
    uint64_t seed = 17;
    for (size_t i = 0; i < n * COUNT; i++) from[i] = 2 * t_uniform(&seed) - 1;
    for (size_t i = 0; i < n * COUNT; i++) to[i] = from[i] + 0.3 * (t_uniform(&seed) - 0.5);
    batten_frep *ball = NULL, *a = NULL;
    T_OK(batten_frep_ball(ctx, n, (double[]){0.1, 0.2, 0}, 0.6, &ball), ctx);
    T_OK(batten_frep_deform(ctx, ball, COUNT, from, to, &a), ctx);
    frep_check(ctx, n == 2 ? "displaced points in the plane" : "displaced points", a, 1.5, 0.02, 1e-6, 1024);
    check_box(ctx, "displaced points", a, 1.5);
    double f[COUNT], g[COUNT], worst = 0;
    T_OK(batten_frep_evaluate(ctx, ball, COUNT, from, f, NULL), ctx);
    T_OK(batten_frep_evaluate(ctx, a, COUNT, to, g, NULL), ctx);
    for (int i = 0; i < COUNT; i++) worst = fmax(worst, fabs(f[i] - g[i]));
    T_RATIO(worst, 1e-12, "n = %u: what was at from is at to", n);
    batten_frep_free(a);
    /* displacements by a linear map are that map */
    const double matrix[9] = {1.1, 0.2, 0, -0.1, 0.9, 0.1, 0.05, 0, 1.2};
    double small[9], shift[3] = {0.1, -0.2, 0.3};
    for (unsigned i = 0; i < n; i++)
      for (unsigned j = 0; j < n; j++) small[i * n + j] = matrix[3 * i + j];
    for (size_t p = 0; p < COUNT; p++)
      for (unsigned i = 0; i < n; i++) {
        to[p * n + i] = shift[i];
        for (unsigned j = 0; j < n; j++) to[p * n + i] += small[i * n + j] * from[p * n + j];
      }
    batten_frep *map = NULL;
    T_OK(batten_frep_deform(ctx, ball, COUNT, from, to, &a), ctx);
    T_OK(batten_frep_affine(ctx, ball, small, shift, &map), ctx);
    double x[300], u[300], v[300];
    size_t many = 300 / n;
    for (size_t i = 0; i < 300; i++) x[i] = 4 * t_uniform(&seed) - 2;
    T_OK(batten_frep_evaluate(ctx, a, many, x, u, NULL), ctx);
    T_OK(batten_frep_evaluate(ctx, map, many, x, v, NULL), ctx);
    worst = 0;
    for (size_t i = 0; i < many; i++) worst = fmax(worst, fabs(u[i] - v[i]));
    T_RATIO(worst, 1e-12, "n = %u: displacements by a linear map are that map", n);
    check_box(ctx, "linear displacements", a, 1.5);
    batten_frep_free(map);
    batten_frep_free(a);
    a = NULL;
    T_STATUS(batten_frep_deform(ctx, ball, n, from, to, &a), BATTEN_E_INVALID, ctx, "give more than");
    for (size_t i = 0; i < n * COUNT; i++) to[i] = (double)(i / n) * (i % n == 0);
    T_STATUS(batten_frep_deform(ctx, ball, COUNT, from, to, &a), BATTEN_E_SINGULAR, ctx, "");
    to[1] = NAN;
    T_STATUS(batten_frep_deform(ctx, ball, COUNT, from, to, &a), BATTEN_E_INVALID, ctx, "to[1]: nan");
    T_STATUS(batten_frep_deform(ctx, ball, COUNT, NULL, to, &a), BATTEN_E_INVALID, ctx, "from: NULL");
    batten_frep_free(ball);
  }
}

static batten_status use_sweeps(batten_context *ctx, void *arg) {
  (void)arg;
  const double path[9] = {0, 0, 0, 1, 0, 0, 1, 1, 1};
  const double box[6] = {0, 0, 0, 0.1, 0.1, 0.1}, x[6] = {0.1, 0.2, 0.1, 0.9, 0.1, 0.1};
  const double to[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  double f[2], g[6], range[2];
  batten_frep *disc = NULL, *ball = NULL, *tube = NULL, *track = NULL, *bent = NULL;
  batten_status st = batten_frep_ball(ctx, 2, (double[]){0, 0}, 0.2, &disc);
  if (st >= 0) st = batten_frep_ball(ctx, 3, (double[]){0, 0, 0}, 0.2, &ball);
  if (st >= 0) st = batten_frep_sweep(ctx, disc, 3, path, 1, 1, NULL, &tube);
  if (st >= 0) st = batten_frep_sweep(ctx, ball, 3, path, 1, 0, NULL, &track);
  if (st >= 0) st = batten_frep_deform(ctx, tube, 4, to, to, &bent);
  if (st >= 0) st = batten_frep_evaluate(ctx, bent, 2, x, f, g);
  if (st >= 0) st = batten_frep_bounds(ctx, bent, 1, box, range);
  if (st >= 0) st = batten_frep_evaluate(ctx, track, 2, x, f, g);
  if (st >= 0) st = batten_frep_bounds(ctx, track, 1, box, range);
  batten_frep_free(disc);
  batten_frep_free(ball);
  batten_frep_free(tube);
  batten_frep_free(track);
  batten_frep_free(bent);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_straight(ctx);
  test_ring(ctx);
  test_knot(ctx);
  test_open(ctx);
  test_polyline(ctx);
  test_solid(ctx);
  test_bad_paths(ctx);
  test_deform(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  batten_context_free(ctx);
  t_fail_every_allocation("sweeps", use_sweeps, NULL);
  return t_done();
}
