/* Bounds of carriers, splines and solids over boxes: no value of f is outside of them in a million random boxes (from
 * single points to the whole scene, about centres of splines, with flat ones and corners), they narrow with the
 * square of the box where f is smooth, edges, bad input. */
#include <batten/carrier.h>
#include <batten/solid.h>
#include <batten/spline.h>

#include "scenes.h"
#include "tap.h"

enum { BATCH = 500, SAMPLES = 5 };

static double turned[9];
static const double origin[3] = {0.1, -0.2, 0.05};

static void make_turned(void) {
  double c = cos(0.7), s = sin(0.7), d = cos(0.4), e = sin(0.4);
  const double rows[9] = {c, s, 0, -d * s, d * c, e, e * s, -e * c, d};
  memcpy(turned, rows, sizeof turned);
}

/* ---- boxes and points ---------------------------------------------------------------------------- */

/* A box [2][n] about somewhere in [-2, 2]^n, or about one of the given points; half extents 1e-12 to 3, some of them
 * 0. */
static void random_box(unsigned n, size_t count, const double *points, uint64_t *seed, double *box) {
  double size = pow(10, -12 + 12.5 * sqrt(t_uniform(seed)));
  size_t at = count ? t_random(seed) % (2 * count) : 1;
  bool point = t_uniform(seed) < 0.02;
  for (unsigned k = 0; k < n; k++) {
    double middle = at < count ? points[at * n + k] : 4 * t_uniform(seed) - 2;
    double half = point || t_uniform(seed) < 0.05 ? 0 : size * t_uniform(seed);
    /* Not always in the middle. */
    box[k] = middle - half;
    box[n + k] = middle + half * t_uniform(seed);
  }
}

/* A corner, the middle, or anywhere in the box. */
static void random_point(unsigned n, const double *box, uint64_t *seed, double *x) {
  double kind = t_uniform(seed);
  for (unsigned k = 0; k < n; k++) {
    double s = kind < 0.4 ? (double)(t_random(seed) % 2) : kind < 0.5 ? 0.5 : t_uniform(seed);
    x[k] = fmin(fmax(box[k] + s * (box[n + k] - box[k]), box[k]), box[n + k]);
  }
}

typedef struct outcome {
  size_t boxes, wrong, unknown; /* unknown: an infinite end */
  double worst;                 /* how far a value was outside */
} outcome;

static void sample(batten_context *ctx, const batten_field *f, size_t batches, size_t count, const double *points,
                   uint64_t *seed, outcome *out) {
  static double boxes[BATCH * 6], ranges[BATCH * 2], x[BATCH * SAMPLES * 3], values[BATCH * SAMPLES];
  unsigned n = f->dimension;
  for (size_t batch = 0; batch < batches; batch++) {
    for (size_t i = 0; i < BATCH; i++) {
      random_box(n, count, points, seed, boxes + i * 2 * n);
      for (size_t k = 0; k < SAMPLES; k++) random_point(n, boxes + i * 2 * n, seed, x + (i * SAMPLES + k) * n);
    }
    batten_status st = f->bounds(f->user, ctx, BATCH, boxes, ranges);
    if (st >= 0) st = f->evaluate(f->user, ctx, BATCH * SAMPLES, x, values, NULL, NULL);
    if (st < 0) {
      t_line(false, "bounds and values: %s", batten_error(ctx));
      return;
    }
    for (size_t i = 0; i < BATCH; i++) {
      double outside = 0;
      for (size_t k = 0; k < SAMPLES; k++) {
        double v = values[i * SAMPLES + k];
        outside = fmax(outside, fmax(ranges[2 * i] - v, v - ranges[2 * i + 1]));
      }
      out->boxes++;
      out->wrong += outside > 0 || !(ranges[2 * i] <= ranges[2 * i + 1]);
      out->worst = fmax(out->worst, outside);
      out->unknown += isinf(ranges[2 * i]) || isinf(ranges[2 * i + 1]);
    }
  }
}

static void check_field(batten_context *ctx, const char *what, batten_field f, size_t batches, size_t count,
                        const double *points) {
  uint64_t seed = 81 + f.dimension;
  outcome out = {0};
  sample(ctx, &f, batches, count, points, &seed, &out);
  T_CHECK(out.boxes == batches * BATCH && out.wrong == 0 && out.unknown == 0,
          "%s: no value outside of its bounds in %zu boxes (%zu wrong by up to %.2g, %zu unknown)", what, out.boxes,
          out.wrong, out.worst, out.unknown);
}

/* ---- carriers ------------------------------------------------------------------------------------ */

/* Frees the carrier. */
static void check_carrier(batten_context *ctx, const char *what, batten_carrier *c, size_t batches) {
  check_field(ctx, what, batten_carrier_field(c), batches, 1, origin);
  batten_carrier_free(c);
}

static void test_carriers(batten_context *ctx) {
  static const double plane_turn[4] = {0.8, 0.6, -0.6, 0.8}, axes[3] = {0.5, 0.8, 1.3}, tilted[3] = {1, 2, -1.5};
  batten_carrier *c = NULL, *ball = NULL, *block = NULL;
  for (unsigned n = 1; n <= 3; n++) {
    const double *rotation = n == 3 ? turned : n == 2 ? plane_turn : NULL;
    T_OK(batten_carrier_ball(ctx, n, origin, 0.9, &c), ctx);
    check_carrier(ctx, "ball", c, 60);
    T_OK(batten_carrier_ellipsoid(ctx, n, origin, axes, rotation, &c), ctx);
    check_carrier(ctx, "ellipsoid", c, 60);
    T_OK(batten_carrier_box(ctx, n, origin, axes, rotation, 0, &c), ctx);
    check_carrier(ctx, "turned box", c, 60);
    T_OK(batten_carrier_box(ctx, n, origin, axes, NULL, 0.3, &c), ctx);
    check_carrier(ctx, "rounded box", c, 60);
    T_OK(batten_carrier_half_space(ctx, n, origin, tilted, &c), ctx);
    check_carrier(ctx, "half-space", c, 60);
    T_OK(batten_carrier_none(ctx, n, &c), ctx);
    check_carrier(ctx, "none", c, 1);
  }
  T_OK(batten_carrier_cylinder(ctx, origin, tilted, 0.7, 0, &c), ctx);
  check_carrier(ctx, "cylinder", c, 100);
  T_OK(batten_carrier_cylinder(ctx, origin, tilted, 0.7, 0.2, &c), ctx);
  check_carrier(ctx, "rounded cylinder", c, 100);
  T_OK(batten_carrier_torus(ctx, origin, tilted, 1.1, 0.4, &c), ctx);
  check_carrier(ctx, "torus", c, 100);
  T_OK(batten_carrier_ball(ctx, 3, origin, 0.9, &ball), ctx);
  T_OK(batten_carrier_box(ctx, 3, (double[]){0.5, 0, 0.3}, axes, turned, 0.1, &block), ctx);
  for (int i = 0; i < 5; i++) {
    const double alpha = (double[]){-0.9, -0.3, 0, 0.5, 1}[i];
    char what[40];
    snprintf(what, sizeof what, "union, alpha %g", alpha);
    T_OK(batten_carrier_union(ctx, ball, block, alpha, &c), ctx);
    check_carrier(ctx, what, c, 40);
    snprintf(what, sizeof what, "intersection, alpha %g", alpha);
    T_OK(batten_carrier_intersection(ctx, ball, block, alpha, &c), ctx);
    check_carrier(ctx, what, c, 40);
  }
  batten_carrier_free(ball);
  batten_carrier_free(block);
}

/* ---- splines ------------------------------------------------------------------------------------- */

static batten_spline *make_spline(batten_context *ctx, unsigned n, unsigned m, size_t count, bool hermite,
                                  double scale, double *points) {
  static double values[400], gradients[400 * 3];
  uint64_t seed = 7 * n + m;
  for (size_t i = 0; i < count * n; i++) points[i] = scale * (3 * t_uniform(&seed) - 1.5);
  for (size_t i = 0; i < count; i++) values[i] = t_uniform(&seed) - 0.5;
  for (size_t i = 0; i < count * n; i++) gradients[i] = (t_uniform(&seed) - 0.5) / scale;
  batten_spline_data data = batten_spline_data_default();
  data.n = n;
  data.count = count;
  data.points = points;
  data.values = values;
  if (hermite) {
    data.gradient_count = count / 2;
    data.gradients = gradients;
  }
  batten_spline_options o = batten_spline_options_default();
  o.m = m;
  o.loo_samples = 0;
  batten_spline *s = NULL;
  batten_status st = batten_spline_fit(ctx, &data, &o, &s, NULL);
  if (st < 0) t_line(false, "spline: %s", batten_error(ctx));
  return s;
}

static void test_splines(batten_context *ctx) {
  static double points[400 * 3];
  for (unsigned n = 1; n <= 3; n++)
    for (unsigned m = n == 1 ? 1 : 2; m <= 4; m++)
      for (int hermite = 0; hermite < 2; hermite++) {
        if (hermite && 2 * m - n <= 2) continue;
        size_t count = n == 1 ? 12 : n == 2 && m == 4 ? 30 : 60; /* more are singular to working precision */
        char what[80];
        snprintf(what, sizeof what, "spline, n = %u, m = %u%s", n, m, hermite ? ", half of the gradients" : "");
        batten_spline *s = make_spline(ctx, n, m, count, hermite, 1, points);
        if (!s) continue;
        check_field(ctx, what, batten_spline_field(s), 60, count, points);
        batten_spline_free(s);
      }
}

/* ---- solids -------------------------------------------------------------------------------------- */

static batten_solid *fit_solid(batten_context *ctx, unsigned n, size_t count, const double *points,
                               const double *normals, batten_orient_data data) {
  batten_solid_options o = batten_solid_options_default();
  o.spline.loo_samples = 0;
  o.check_cells = 8;
  if (normals) {
    o.normals = normals;
    o.orientation = BATTEN_ORIENT_GIVEN;
    o.orient_data = data;
  }
  batten_solid *s = NULL;
  if (batten_solid_fit(ctx, n, count, points, &o, &s, NULL) < 0) t_line(false, "solid: %s", batten_error(ctx));
  return s;
}

/* Mean over boxes of half extent h beside the surface of how much wider the bounds are than the values. */
static double excess(batten_context *ctx, const batten_field *f, size_t count, const double *points, double h) {
  enum { BOXES = 200, GRID = 5 };
  uint64_t seed = 5;
  unsigned n = f->dimension;
  double sum = 0;
  for (size_t i = 0; i < BOXES; i++) {
    double box[6], range[2], x[GRID * GRID * GRID * 3], values[GRID * GRID * GRID], lo = INFINITY, hi = -INFINITY;
    size_t at = t_random(&seed) % count, made = 0;
    for (unsigned k = 0; k < n; k++) {
      double middle = points[at * n + k] + 0.2 * (t_uniform(&seed) - 0.5);
      box[k] = middle - h;
      box[n + k] = middle + h;
    }
    for (size_t g = 0; g < (n == 3 ? GRID * GRID * GRID : GRID * GRID); g++, made++) {
      size_t digit[3] = {g % GRID, g / GRID % GRID, g / GRID / GRID};
      for (unsigned k = 0; k < n; k++) x[g * n + k] = box[k] + 2 * h * (double)digit[k] / (GRID - 1);
    }
    if (f->bounds(f->user, ctx, 1, box, range) < 0 || f->evaluate(f->user, ctx, made, x, values, NULL, NULL) < 0)
      return NAN;
    for (size_t g = 0; g < made; g++) {
      lo = fmin(lo, values[g]);
      hi = fmax(hi, values[g]);
    }
    sum += (range[1] - range[0]) - (hi - lo);
  }
  return sum / BOXES;
}

static void check_narrow(batten_context *ctx, const char *what, batten_field f, size_t count, const double *points,
                         double order) {
  double at[6];
  printf("# %s: wider than the values by", what);
  for (int i = 0; i < 6; i++) {
    double h = 0.16 * pow(0.5, i);
    at[i] = excess(ctx, &f, count, points, h);
    printf(" %.2g", at[i]);
  }
  printf(" for half extents 0.16, 0.08, ...\n");
  T_CHECK(at[5] > -1e-12 && at[5] <= at[2] * pow(0.5, 3 * order),
          "%s: what bounds are too wide falls with order %.2f", what, log2(at[2] / at[5]) / 3);
}

static void test_solids(batten_context *ctx) {
  enum { COUNT = 400 };
  static double points[COUNT * 3], normals[COUNT * 3], circle[60 * 2];
  static const batten_orient_data data[] = {BATTEN_ORIENT_DATA_AUTO, BATTEN_ORIENT_DATA_PAIRS,
                                            BATTEN_ORIENT_DATA_GRADIENTS};
  static const char *const names[] = {"solid under its carrier", "solid of pairs", "solid of gradients"};
  static const double orders[] = {1.6, 1.2, 1.8};
  scene_sphere_points(3, COUNT, normals);
  for (size_t i = 0; i < COUNT; i++) {
    points[3 * i] = normals[3 * i] * 1.3;
    points[3 * i + 1] = normals[3 * i + 1] * 0.8;
    points[3 * i + 2] = normals[3 * i + 2] * (0.7 + 0.1 * normals[3 * i]);
  }
  for (int i = 0; i < 3; i++) {
    batten_solid *s = fit_solid(ctx, 3, i == 2 ? 100 : COUNT, points, i ? normals : NULL, data[i]);
    if (!s) continue;
    check_field(ctx, names[i], batten_solid_field(s), 20, i == 2 ? 100 : COUNT, points);
    check_narrow(ctx, names[i], batten_solid_field(s), 100, points, orders[i]);
    batten_carrier *c = NULL, *ball = NULL, *both = NULL;
    T_OK(batten_carrier_solid(ctx, s, &c), ctx);
    T_OK(batten_carrier_ball(ctx, 3, origin, 0.9, &ball), ctx);
    T_OK(batten_carrier_union(ctx, c, ball, 0, &both), ctx);
    check_field(ctx, "its union with a ball", batten_carrier_field(both), 10, COUNT, points);
    batten_carrier_free(both);
    batten_carrier_free(ball);
    batten_carrier_free(c);
    batten_solid_free(s);
  }
  for (size_t i = 0; i < 60; i++) {
    double a = 2 * SCENE_PI * (double)i / 60, r = 1 + 0.3 * cos(3 * a);
    circle[2 * i] = r * cos(a);
    circle[2 * i + 1] = r * sin(a);
  }
  batten_solid *s = fit_solid(ctx, 2, 60, circle, NULL, BATTEN_ORIENT_DATA_AUTO);
  if (!s) return;
  check_field(ctx, "plane solid", batten_solid_field(s), 60, 60, circle);
  check_narrow(ctx, "plane solid", batten_solid_field(s), 60, circle, 1.8);
  batten_solid_free(s);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  make_turned();
  test_carriers(ctx);
  test_splines(ctx);
  test_solids(ctx);
  batten_context_free(ctx);
  return t_done();
}
