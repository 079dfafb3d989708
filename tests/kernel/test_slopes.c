/* Bounds of |grad f| of solids and carriers over boxes, and what trees make of them: no gradient is outside of them
 * in random boxes, they narrow with the box where f is smooth, normalized nodes are bounded from both sides, and a
 * search over an offset of a reconstructed solid asks for few boxes and points. */
#include <batten/carrier.h>
#include <batten/frep.h>
#include <batten/mesh.h>
#include <batten/solid.h>

#include "scenes.h"
#include "solid/solid_form.h"
#include "tap.h"

enum { BATCH = 400, SAMPLES = 5, COUNT = 300 };

static const double origin[3] = {0.1, -0.2, 0.05}, axes[3] = {0.5, 0.8, 1.3}, tilted[3] = {1, 2, -1.5};

static batten_status slopes_of(batten_context *ctx, const batten_carrier *c, const batten_solid *s, size_t count,
                               const double *boxes, double *ranges, double *slopes) {
  return c ? batten_carrier_slopes(ctx, c, count, boxes, ranges, slopes)
           : batten_solid_slopes(ctx, s, count, boxes, ranges, slopes);
}

/* Boxes of half extents 1e-9 to 1 about places in [-2, 2]^n or about given points; a sixth of them flat. */
static void random_box(size_t n, size_t count, const double *points, uint64_t *seed, double *box) {
  double size = pow(10, -9 * t_uniform(seed) * t_uniform(seed));
  size_t at = t_random(seed) % (2 * count + 1);
  for (size_t k = 0; k < n; k++) {
    double middle = at < count ? points[at * n + k] : 4 * t_uniform(seed) - 2;
    double half = t_uniform(seed) < 0.06 ? 0 : size * t_uniform(seed);
    box[k] = middle - half;
    box[n + k] = middle + half * t_uniform(seed);
  }
}

static double length(size_t n, const double *v) {
  double sum = 0;
  for (unsigned k = 0; k < n; k++) sum += v[k] * v[k];
  return sqrt(sum);
}

/* Of a carrier or a solid, the other is NULL. known: bounds shall be finite. */
static void check_slopes(batten_context *ctx, const char *what, const batten_carrier *c, const batten_solid *s,
                         size_t batches, size_t count, const double *points, bool known) {
  static double boxes[BATCH * 6], ranges[BATCH * 2], again[BATCH * 2], slopes[BATCH * 2], x[BATCH * SAMPLES * 3],
      gradients[BATCH * SAMPLES * 3];
  batten_field f = c ? batten_carrier_field(c) : batten_solid_field(s);
  size_t n = f.dimension;
  uint64_t seed = 17 + n;
  size_t wrong = 0, unknown = 0, differ = 0;
  double worst = 0;
  for (size_t batch = 0; batch < batches; batch++) {
    for (size_t i = 0; i < BATCH; i++) {
      random_box(n, count, points, &seed, boxes + i * 2 * n);
      for (size_t j = 0; j < SAMPLES; j++)
        for (size_t k = 0; k < n; k++) {
          const double *box = boxes + i * 2 * n;
          double share = j < 3 ? (double)(t_random(&seed) % 2) : t_uniform(&seed);
          x[(i * SAMPLES + j) * n + k] = fmin(fmax(box[k] + share * (box[n + k] - box[k]), box[k]), box[n + k]);
        }
    }
    batten_status st = slopes_of(ctx, c, s, BATCH, boxes, ranges, slopes);
    if (st >= 0) st = f.bounds(f.user, ctx, BATCH, boxes, again);
    if (st >= 0) st = f.evaluate(f.user, ctx, BATCH * SAMPLES, x, NULL, gradients, NULL);
    if (st < 0) {
      t_line(false, "%s: %s", what, batten_error(ctx));
      return;
    }
    for (size_t i = 0; i < BATCH; i++) {
      double outside = 0;
      for (size_t j = 0; j < SAMPLES; j++) {
        double v = length(n, gradients + (i * SAMPLES + j) * n);
        outside = fmax(outside, fmax(slopes[2 * i] - v, v - slopes[2 * i + 1]));
      }
      wrong += outside > 0 || !(slopes[2 * i] >= 0) || !(slopes[2 * i] <= slopes[2 * i + 1]);
      worst = fmax(worst, outside);
      unknown += slopes[2 * i + 1] == INFINITY;
      differ += ranges[2 * i] != again[2 * i] || ranges[2 * i + 1] != again[2 * i + 1];
    }
  }
  T_CHECK(wrong == 0 && differ == 0 && (unknown == 0 || !known),
          "%s: no slope outside of its bounds in %zu boxes (%zu wrong by up to %.2g, %zu unknown, %zu other ranges)",
          what, batches * BATCH, wrong, worst, unknown, differ);
}

/* Mean width of slopes, over their lower bound's mean, in boxes beside the surface. */
static void check_narrow(batten_context *ctx, const char *what, const batten_solid *s, size_t count,
                         const double *points) {
  double at[6];
  printf("# %s: slopes known to", what);
  for (int i = 0; i < 6; i++) {
    double h = 0.16 * pow(0.5, i), width = 0, size = 0;
    uint64_t seed = 5;
    unsigned n = batten_solid_dimension(s);
    for (size_t b = 0; b < 200; b++) {
      double box[6], range[2], slope[2];
      size_t p = t_random(&seed) % count;
      for (unsigned k = 0; k < n; k++) {
        double middle = points[p * n + k] + 0.1 * (t_uniform(&seed) - 0.5);
        box[k] = middle - h;
        box[n + k] = middle + h;
      }
      if (batten_solid_slopes(ctx, s, 1, box, range, slope) < 0) return;
      width += slope[1] - slope[0];
      size += slope[1];
    }
    at[i] = width / size;
    printf(" %.2g", at[i]);
  }
  printf(" of themselves for half extents 0.16, 0.08, ...\n");
  T_CHECK(at[5] < 0.1 && at[5] <= 0.3 * at[3], "%s: bounds of the slope narrow with the box, order %.2f", what,
          log2(at[3] / at[5]) / 2);
}

static void test_carriers(batten_context *ctx) {
  batten_carrier *c[6] = {NULL}, *joined = NULL;
  const double c7 = cos(0.7), s7 = sin(0.7);
  const double turned[9] = {c7, s7, 0, -s7, c7, 0, 0, 0, 1};
  static const char *const names[6] = {"ball", "ellipsoid", "rounded box", "half-space", "cylinder", "torus"};
  T_OK(batten_carrier_ball(ctx, 3, origin, 0.9, c), ctx);
  T_OK(batten_carrier_ellipsoid(ctx, 3, origin, axes, turned, c + 1), ctx);
  T_OK(batten_carrier_box(ctx, 3, origin, axes, turned, 0.2, c + 2), ctx);
  T_OK(batten_carrier_half_space(ctx, 3, origin, tilted, c + 3), ctx);
  T_OK(batten_carrier_cylinder(ctx, origin, tilted, 0.7, 0.1, c + 4), ctx);
  T_OK(batten_carrier_torus(ctx, origin, tilted, 1.1, 0.4, c + 5), ctx);
  for (int i = 0; i < 6; i++) check_slopes(ctx, names[i], c[i], NULL, 20, 1, origin, true);
  for (int i = 0; i < 5; i++) {
    const double alpha = (double[]){-0.9, -0.3, 0, 0.5, 1}[i];
    char what[60];
    for (int turn = 0; turn < 2; turn++) {
      snprintf(what, sizeof what, "%s of ball and box, alpha %g", turn ? "intersection" : "union", alpha);
      T_OK((turn ? batten_carrier_intersection : batten_carrier_union)(ctx, c[0], c[2], alpha, &joined), ctx);
      check_slopes(ctx, what, joined, NULL, 20, 1, origin, true);
      batten_carrier_free(joined);
    }
  }
  /* By hand: R^2 - |x|^2 over the unit box beside the middle has slopes 2 |x|, from 2 to 2 sqrt 6. */
  double range[2], slope[2];
  batten_carrier *ball = NULL;
  T_OK(batten_carrier_ball(ctx, 3, (double[]){0, 0, 0}, 1, &ball), ctx);
  T_OK(batten_carrier_slopes(ctx, ball, 1, (double[]){1, -1, -1, 2, 1, 1}, range, slope), ctx);
  T_CHECK(slope[0] <= 2 && slope[0] > 1.9999 && slope[1] >= 2 * sqrt(6) && slope[1] < 2 * sqrt(6) + 1e-4,
          "a ball's slope over a box is from 2 to 2 sqrt 6: [%g, %g]", slope[0], slope[1]);
  batten_carrier_free(ball);
  for (int i = 0; i < 6; i++) batten_carrier_free(c[i]);
}

/* ---- solids and trees ------------------------------------------------------------------------------------ */

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

typedef struct counted {
  batten_field field;
  size_t *boxes, *points;
} counted;

static batten_status count_points(const void *user, batten_context *ctx, size_t count, const double *points,
                                  double *values, double *gradients, double *hessians) {
  const counted *c = user;
  *c->points += count;
  return c->field.evaluate(c->field.user, ctx, count, points, values, gradients, hessians);
}

static batten_status count_boxes(const void *user, batten_context *ctx, size_t count, const double *boxes,
                                 double *ranges) {
  const counted *c = user;
  *c->boxes += count;
  return c->field.bounds(c->field.user, ctx, count, boxes, ranges);
}

/* The share of the cells of a box that a search asks for. */
static void check_search(batten_context *ctx, const char *what, batten_frep *a, double most) {
  double lower[3], upper[3], cells = 1, diagonal = 0, *seeds = NULL;
  size_t boxes = 0, points = 0, found = 0;
  counted c = {batten_frep_field(a), &boxes, &points};
  batten_field f = {.dimension = 3, .order = 1, .evaluate = count_points, .user = &c, .bounds = count_boxes};
  T_OK(batten_frep_box(ctx, a, lower, upper), ctx);
  for (int k = 0; k < 3; k++) diagonal = hypot(diagonal, upper[k] - lower[k]);
  for (int k = 0; k < 3; k++) cells *= exp2(ceil(log2((upper[k] - lower[k]) / (diagonal / 60))));
  T_OK(batten_find_seeds(ctx, &f, lower, upper, diagonal / 60, &found, &seeds), ctx);
  T_CHECK((double)(boxes + points) < most * cells && found > 100,
          "%s: a search asks for %zu boxes and %zu points, %.2f of %g cells; %zu seeds", what, boxes, points,
          (double)(boxes + points) / cells, cells, found);
  batten_free(ctx, seeds);
}

static void check_trees(batten_context *ctx, const char *name, batten_solid *s, size_t count, const double *points,
                        double most) {
  batten_frep *leaf = NULL, *half = NULL, *both = NULL, *made[4] = {NULL};
  batten_carrier *plane = NULL;
  static const char *const names[4] = {"its offset", "its shell", "a half of it", "offset of the half"};
  printf("# trees over %s\n", name);
  T_OK(batten_frep_solid(ctx, s, &leaf), ctx);
  T_OK(batten_carrier_half_space(ctx, 3, origin, tilted, &plane), ctx);
  T_OK(batten_frep_carrier(ctx, plane, &half), ctx);
  T_OK(batten_frep_combine(ctx, BATTEN_FREP_INTERSECTION, leaf, half, 0, &both), ctx);
  T_OK(batten_frep_offset(ctx, leaf, 0.06, made), ctx);
  T_OK(batten_frep_shell(ctx, leaf, 0.08, made + 1), ctx);
  made[2] = batten_frep_retain(both);
  T_OK(batten_frep_offset(ctx, both, -0.05, made + 3), ctx);
  for (int i = 0; i < 4; i++) {
    batten_solid *solid = NULL;
    check_search(ctx, names[i], made[i], most);
    T_OK(batten_frep_to_solid(ctx, made[i], (double[]){-2, -2, -2}, (double[]){2, 2, 2}, 0.25, &solid), ctx);
    if (solid) check_slopes(ctx, names[i], NULL, solid, 2, count, points, false);
    batten_solid_free(solid);
    batten_frep_free(made[i]);
  }
  batten_frep_free(both);
  batten_frep_free(half);
  batten_frep_free(leaf);
  batten_carrier_free(plane);
}

/* |f| / |grad f| over boxes: ranges hold the values, and are about as wide as the box. */
static void check_normalized(batten_context *ctx, batten_solid *s, size_t count, const double *points) {
  batten_frep *leaf = NULL, *a = NULL;
  uint64_t seed = 3;
  double widest[3] = {0, 0, 0};
  size_t wrong = 0;
  T_OK(batten_frep_solid(ctx, s, &leaf), ctx);
  T_OK(batten_frep_normalize(ctx, leaf, &a), ctx);
  for (int i = 0; i < 600; i++) {
    double box[6], range[2], x[3], f = NAN, h = (double[]){0.04, 0.02, 0.01}[i % 3];
    size_t at = t_random(&seed) % count;
    for (size_t k = 0; k < 3; k++) {
      double middle = points[3 * at + k] + 0.2 * (t_uniform(&seed) - 0.5);
      box[k] = middle - h;
      box[3 + k] = middle + h;
      x[k] = middle + h * (2 * t_uniform(&seed) - 1);
    }
    if (batten_frep_bounds(ctx, a, 1, box, range) < 0 || batten_frep_evaluate(ctx, a, 1, x, &f, NULL) < 0) wrong++;
    wrong += !(range[0] <= f && f <= range[1]);
    widest[i % 3] = fmax(widest[i % 3], (range[1] - range[0]) / (2 * sqrt(3) * h));
  }
  T_CHECK(wrong == 0 && widest[2] < 2 && widest[1] < 4,
          "normalized: %zu values outside; ranges over the diagonal at most %.2f, %.2f, %.2f for half extents 0.04, "
          "0.02, 0.01",
          wrong, widest[0], widest[1], widest[2]);
  batten_frep_free(a);
  batten_frep_free(leaf);
}

static void test_solids(batten_context *ctx) {
  static double points[COUNT * 3], normals[COUNT * 3], few[100 * 3], few_normals[100 * 3], plane[60 * 2];
  for (int i = 0; i < 2; i++) {
    size_t count = i ? 100 : COUNT;
    double *x = i ? few : points, *unit = i ? few_normals : normals;
    scene_sphere_points(3, count, unit);
    for (size_t j = 0; j < count; j++)
      for (size_t k = 0; k < 3; k++) x[3 * j + k] = unit[3 * j + k] * (double[]){1.2, 1, 0.9}[k];
    for (size_t j = 0; j < count; j++) { /* normals of the ellipsoid */
      double *m = unit + 3 * j, size = 0;
      for (int k = 0; k < 3; k++) m[k] /= (double[]){1.2, 1, 0.9}[k];
      size = length(3, m);
      for (int k = 0; k < 3; k++) m[k] /= size;
    }
  }
  static const char *const names[3] = {"a solid under its carrier", "a solid of pairs", "a solid of gradients"};
  static const batten_orient_data data[3] = {BATTEN_ORIENT_DATA_AUTO, BATTEN_ORIENT_DATA_PAIRS,
                                             BATTEN_ORIENT_DATA_GRADIENTS};
  for (int i = 0; i < 3; i++) {
    size_t count = i == 2 ? 100 : COUNT;
    const double *x = i == 2 ? few : points;
    batten_solid *s = fit_solid(ctx, 3, count, x, i == 0 ? NULL : i == 1 ? normals : few_normals, data[i]);
    if (!s) continue;
    check_slopes(ctx, names[i], NULL, s, 10, count, x, true);
    check_narrow(ctx, names[i], s, count, x);
    if (i != 1) check_normalized(ctx, s, count, x);
    if (i != 1) check_trees(ctx, names[i], s, count, x, i ? 0.9 : 0.6);
    batten_solid_free(s);
  }
  for (size_t i = 0; i < 60; i++) {
    double a = 2 * SCENE_PI * (double)i / 60, r = 1 + 0.3 * cos(3 * a);
    plane[2 * i] = r * cos(a);
    plane[2 * i + 1] = r * sin(a);
  }
  batten_solid *s = fit_solid(ctx, 2, 60, plane, NULL, BATTEN_ORIENT_DATA_AUTO);
  if (!s) return;
  check_slopes(ctx, "a plane solid", NULL, s, 20, 60, plane, true);
  check_narrow(ctx, "a plane solid", s, 60, plane);
  batten_solid_free(s);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_carriers(ctx);
  test_solids(ctx);
  batten_context_free(ctx);
  return t_done();
}
