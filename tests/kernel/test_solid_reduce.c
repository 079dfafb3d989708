/* Solids within a distance of their points: the distance recomputed here, carriers and pairs, sign and surface. */
#include <batten/mesh.h>
#include <batten/solid.h>

#include "scenes.h"
#include "tap.h"

/* A bumpy sphere, evenly drawn directions. */
static void bumpy_points(uint64_t seed, size_t count, double *points) {
  for (size_t i = 0; i < count; i++) {
    double *x = points + 3 * i;
    scene_sphere_point(&seed, x);
    const double a = atan2(x[1], x[0]), s = 1 - x[2] * x[2], radius = 1 + 0.1 * sin(5 * a) * s + 0.05 * cos(9 * x[2]);
    for (int k = 0; k < 3; k++) x[k] *= radius;
  }
}

/* Largest |f| / |grad f|, with f = sign (f_c - U) put together here. */
static double farthest(batten_context *ctx, const batten_solid *s, size_t count, const double *points) {
  double *c = malloc(count * 8 * sizeof *c), *u = c + count, *gc = u + count, *gu = gc + 3 * count, worst = 0;
  if (!s || batten_carrier_evaluate(ctx, batten_solid_carrier(s), count, points, c, gc, NULL) < 0 ||
      batten_spline_evaluate(ctx, batten_solid_spline(s), count, points, u, gu, NULL) < 0)
    worst = INFINITY;
  for (size_t i = 0; i < count && worst < INFINITY; i++) {
    double square = 0;
    for (size_t k = 0; k < 3; k++) square += pow(gc[3 * i + k] - gu[3 * i + k], 2);
    worst = fmax(worst, fabs(c[i] - u[i]) / sqrt(square));
  }
  free(c);
  return worst;
}

static size_t centres_of(const batten_solid *s) {
  batten_spline_parts p = {.struct_size = sizeof p};
  if (s) batten_spline_get_parts(batten_solid_spline(s), &p);
  return p.count;
}

static batten_solid *fit(batten_context *ctx, size_t count, const double *points, const batten_solid_options *o,
                         batten_status wanted, batten_solid_info *info) {
  batten_solid *s = NULL;
  batten_status st = batten_solid_fit(ctx, 3, count, points, o, &s, info);
  if (st != wanted) t_line(false, "%s: %s", batten_status_name(st), batten_error(ctx));
  return s;
}

/* What is promised, for a solid that was made with o. */
static void check(batten_context *ctx, const char *what, size_t count, const double *points,
                  const batten_solid_options *o, const batten_solid *s, const batten_solid_info *i) {
  const double far = farthest(ctx, s, count, points);
  size_t seeds = 0;
  T_RATIO(far, o->reduce * (1 + 1e-9), "%s, %zu centres: largest distance to %zu points, recomputed", what,
          i->reduced.centers, count);
  T_RATIO(fabs(i->reduced.error_certified - far), 1e-9 * far, "the one that is certified");
  T_CHECK(i->reduced.ratio_max <= 1, "all tolerances met: %.3g", i->reduced.ratio_max);
  T_CHECK(centres_of(s) == i->reduced.centers, "%zu centres", centres_of(s));
  if (s) batten_solid_points(s, &seeds);
  T_CHECK(seeds == count, "all points are seeds");
  T_CHECK(i->check_final.clean, "sign");
}

static double volume_of(batten_context *ctx, const batten_solid *s) {
  batten_mesh *mesh = NULL;
  batten_mesh_measures measures = {0};
  batten_polygonize_options o = batten_polygonize_options_default();
  size_t count = 0;
  const double *seeds = s ? batten_solid_points(s, &count) : NULL;
  o.cell = 0.08;
  if (s) batten_solid_box(s, o.lower, o.upper);
  for (int k = 0; k < 3; k++) o.lower[k] -= 0.2, o.upper[k] += 0.2;
  batten_field field = s ? batten_solid_field(s) : (batten_field){0};
  if (s && batten_polygonize(ctx, &field, count, seeds, &o, &mesh, NULL) >= 0)
    batten_mesh_measure(ctx, mesh, &measures);
  batten_mesh_free(mesh);
  return measures.volume;
}

static void test_carrier(batten_context *ctx) {
  enum { COUNT = 2500 };
  double *points = malloc(COUNT * 3 * sizeof *points);
  bumpy_points(1, COUNT, points);
  batten_solid_options o = batten_solid_options_default();
  batten_solid_info full = {0}, info = {0};
  batten_solid *exact = fit(ctx, COUNT, points, &o, BATTEN_OK, &full), *s;
  T_CHECK(full.reduced.centers == 0 && centres_of(exact) == COUNT, "without a tolerance: all points");
  o.reduce = 0.01;
  s = fit(ctx, COUNT, points, &o, BATTEN_OK, &info);
  check(ctx, "carrier", COUNT, points, &o, s, &info);
  T_CHECK(info.orient_data == BATTEN_ORIENT_DATA_AUTO, "carrier alone");
  T_RATIO((double)info.reduced.centers, 450, "centres");
  T_RATIO(fabs(info.distance_max - info.reduced.error_certified), 1e-3 * info.distance_max,
          "the distance that is told as for any solid");
  /* The surfaces are no farther apart than the tolerance, about: so are the volumes, over the area (14). */
  const double volume = volume_of(ctx, exact), reduced = volume_of(ctx, s);
  T_CHECK(volume > 4 && volume < 5, "volume %.4f", volume);
  T_RATIO(fabs(volume - reduced), 14 * o.reduce, "volume of the reduced one");
  batten_solid_free(exact);
  exact = s;
  for (int k = 0; k < COUNT * 3; k++) points[k] = ldexp(points[k], 20);
  o.reduce = ldexp(o.reduce, 20);
  batten_solid_info large = {0};
  s = fit(ctx, COUNT, points, &o, BATTEN_OK, &large);
  T_CHECK(large.reduced.centers == info.reduced.centers, "2^20 times as large: as many centres");
  T_RATIO(fabs(ldexp(large.reduced.error_max, -20) - info.reduced.error_max), 1e-9, "and 2^20 times the distance");
  batten_solid_free(s);
  batten_solid_free(exact);
  free(points);
}

/* Orientation enters as pairs, and only those; order 3 needs it. */
static void test_pairs(batten_context *ctx) {
  enum { COUNT = 1200 };
  double *points = malloc(COUNT * 6 * sizeof *points), *normals = points + 3 * COUNT;
  scene_torus_points(2, COUNT, points);
  for (size_t i = 0; i < COUNT; i++) scene_normal(3, scene_torus, points + 3 * i, normals + 3 * i);
  for (unsigned m = 2; m <= 3; m++) {
    batten_solid_options o = batten_solid_options_default();
    batten_solid_info info = {0};
    o.normals = normals;
    o.orientation = BATTEN_ORIENT_GIVEN;
    o.spline.m = m;
    o.reduce = 0.01;
    batten_solid *s = fit(ctx, COUNT, points, &o, BATTEN_OK, &info);
    check(ctx, m == 2 ? "pairs, r" : "pairs, r^3", COUNT, points, &o, s, &info);
    T_CHECK(info.orient_data == BATTEN_ORIENT_DATA_PAIRS, "pairs");
    T_RATIO((double)info.reduced.centers, 500, "centres, of up to 3664");
    double inside[6] = {1, 0, 0, 0, -1, 0.1}, f[2] = {0}, off[6] = {0, 0, 0, 1, 0, 0.6};
    T_OK(batten_solid_evaluate(ctx, s, 2, inside, f, NULL, NULL), ctx);
    T_CHECK(f[0] > 0 && f[1] > 0, "inside is inside: %.3g, %.3g", f[0], f[1]);
    T_OK(batten_solid_evaluate(ctx, s, 2, off, f, NULL, NULL), ctx);
    T_CHECK(f[0] < 0 && f[1] < 0, "outside is outside: %.3g, %.3g", f[0], f[1]);
    batten_solid_free(s);
  }
  free(points);
}

/* Above 50,000 points one in eight has its pair, a second one of eight that look two ways: on a ball, with its 64 far
 * points, 1.25 N data; and so few pairs say inside and outside as well. The tolerance keeps it cheap. */
static void test_many_pairs(batten_context *ctx) {
  enum { COUNT = 50001 };
  double *points = malloc(COUNT * 6 * sizeof *points), *normals = points + 3 * COUNT;
  batten_solid_options o = batten_solid_options_default();
  batten_solid_info info = {0};
  scene_sphere_points(3, COUNT, points);
  memcpy(normals, points, 3 * COUNT * sizeof *points);
  o.normals = normals;
  o.orientation = BATTEN_ORIENT_GIVEN;
  o.check_cells = 8;
  o.reduce = 0.02;
  batten_solid *s = fit(ctx, COUNT, points, &o, BATTEN_OK, &info);
  T_CHECK(info.orient_data == BATTEN_ORIENT_DATA_PAIRS && info.check_final.clean, "pairs, clean");
  const double pairs = (double)info.reduced.points - COUNT;
  T_CHECK(pairs > 0.24 * COUNT && pairs <= 0.25 * COUNT + 66, "%d points, %.0f off the surface", (int)COUNT, pairs);
  T_RATIO(info.reduced.ratio_max, 1, "%zu centres keep to the tolerance", info.reduced.centers);
  batten_solid_free(s);
  free(points);
}

/* Too little to be met. */
static void test_misses(batten_context *ctx) {
  enum { COUNT = 400 };
  double points[COUNT * 3];
  bumpy_points(3, COUNT, points);
  batten_solid_options o = batten_solid_options_default();
  batten_solid_info info = {0};
  o.reduce = 1e-9;
  batten_solid *s = fit(ctx, COUNT, points, &o, BATTEN_OK, &info);
  T_CHECK(info.reduced.all && info.reduced.centers == COUNT, "1e-9: all points");
  batten_solid_free(s);
  o.spline.smoothing = 1;
  o.reduce = 1e-3;
  o.orientation = BATTEN_ORIENT_NEVER;
  s = NULL;
  batten_status st = batten_solid_fit(ctx, 3, COUNT, points, &o, &s, &info);
  T_CHECK(s && (st == BATTEN_W_ACCURACY || st == BATTEN_W_AMBIGUOUS) && info.reduced.ratio_max > 1,
          "smoothing: %s: %s", batten_status_name(st), batten_error(ctx));
  batten_solid_free(s);
}

static batten_status small(batten_context *ctx, void *arg) {
  batten_solid_options o = batten_solid_options_default();
  batten_solid *s = NULL;
  o.check_cells = 8;
  o.reduce = 0.05;
  o.orientation = BATTEN_ORIENT_NEVER;
  batten_status st = batten_solid_fit(ctx, 3, 80, arg, &o, &s, NULL);
  if (st < 0 && s) t_line(false, "out touched by a failure");
  batten_solid_free(s);
  return st;
}

static void test_failures(batten_context *ctx) {
  double points[80 * 3];
  bumpy_points(4, 80, points);
  t_fail_every_allocation("a reduced solid", small, points);
  t_cancel_every_progress("a reduced solid", small, points);
  batten_solid_options o = batten_solid_options_default();
  batten_solid *s = NULL;
  o.reduce = -1;
  T_STATUS(batten_solid_fit(ctx, 3, 80, points, &o, &s, NULL), BATTEN_E_INVALID, ctx, "opt.reduce: -1");
  o.reduce = NAN;
  T_STATUS(batten_solid_fit(ctx, 3, 80, points, &o, &s, NULL), BATTEN_E_INVALID, ctx, "opt.reduce: nan");
  o.reduce = 0.1;
  o.orient_data = BATTEN_ORIENT_DATA_GRADIENTS;
  T_STATUS(batten_solid_fit(ctx, 3, 80, points, &o, &s, NULL), BATTEN_E_INVALID, ctx,
           "opt.reduce: 0.1 with opt.orient_data gradients");
  T_CHECK(!s, "nothing made");
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_carrier(ctx);
  test_pairs(ctx);
  test_many_pairs(ctx);
  test_misses(ctx);
  test_failures(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all memory is back");
  batten_context_free(ctx);
  return t_done();
}
