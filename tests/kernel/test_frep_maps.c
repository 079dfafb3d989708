/* The algebra of solids: maps of space, and solids of the plane in space and back. */
#include "frep/frep_inner.h"
#include "frep_checks.h"

#define PI 3.14159265358979323846

static double value_at(batten_context *ctx, const batten_frep *a, double x, double y, double z) {
  double p[3] = {x, y, z}, f = NAN;
  return batten_frep_evaluate(ctx, a, 1, p, &f, NULL) == BATTEN_OK ? f : NAN;
}

/* Ball of radius 0.6 with a nose, not symmetric. */
static batten_frep *make_body(batten_context *ctx) {
  batten_frep *ball = NULL, *nose = NULL, *body = NULL;
  T_OK(batten_frep_ball(ctx, 3, (double[]){0.1, -0.05, 0.2}, 0.6, &ball), ctx);
  T_OK(batten_frep_cone(ctx, (double[]){0, 0.1, 0.2}, (double[]){0.7, 0.3, 0.8}, 0.4, 0.1, &nose), ctx);
  T_OK(batten_frep_combine(ctx, BATTEN_FREP_UNION, ball, nose, 1, &body), ctx);
  batten_frep_free(ball);
  batten_frep_free(nose);
  return body;
}

/* A rod of elliptic section along z: circles would hide turns. */
static batten_frep *make_bar(batten_context *ctx, const double lower[3], const double upper[3]) {
  batten_frep *disc = NULL, *ellipse = NULL, *bar = NULL;
  const double matrix[4] = {(upper[0] - lower[0]) / 2, 0, 0, (upper[1] - lower[1]) / 2};
  const double middle[2] = {(lower[0] + upper[0]) / 2, (lower[1] + upper[1]) / 2};
  T_OK(batten_frep_ball(ctx, 2, (double[]){0, 0}, 1, &disc), ctx);
  T_OK(batten_frep_affine(ctx, disc, matrix, middle, &ellipse), ctx);
  T_OK(batten_frep_extrude(ctx, ellipse, lower[2], upper[2], &bar), ctx);
  batten_frep_free(disc);
  batten_frep_free(ellipse);
  return bar;
}

/* No inner point of [-size, size]^n lies outside of the structural box, and some lie close to each of its sides where
 * it is said to be tight. */
static void check_box(batten_context *ctx, const char *what, const batten_frep *a, double size, double tight) {
  enum { COUNT = 40000 };
  static double x[3 * COUNT], f[COUNT];
  unsigned n = batten_frep_dimension(a);
  double lower[3], upper[3], least[3] = {INFINITY, INFINITY, INFINITY}, most[3] = {-INFINITY, -INFINITY, -INFINITY};
  if (!T_CHECK(frep_structural_box(a, lower, upper), "%s has a box", what)) return;
  uint64_t seed = 77;
  for (size_t i = 0; i < n * COUNT; i++) x[i] = size * (2 * t_uniform(&seed) - 1);
  T_OK(batten_frep_evaluate(ctx, a, COUNT, x, f, NULL), ctx);
  size_t inside = 0, outside = 0;
  for (size_t i = 0; i < COUNT; i++) {
    if (!(f[i] >= 0)) continue;
    inside++;
    for (unsigned k = 0; k < n; k++) {
      outside += x[n * i + k] < lower[k] || x[n * i + k] > upper[k];
      least[k] = fmin(least[k], x[n * i + k]);
      most[k] = fmax(most[k], x[n * i + k]);
    }
  }
  double slack = 0;
  for (unsigned k = 0; k < n; k++) slack = fmax(slack, fmax(least[k] - lower[k], upper[k] - most[k]));
  T_CHECK(inside > 50 && outside == 0, "%s: its box holds it (%zu inside, %zu of them not in the box)", what, inside,
          outside);
  T_RATIO(slack, tight, "%s: room in its box", what);
}

static void check_all(batten_context *ctx, const char *what, const batten_frep *a, double kinks, double tight) {
  frep_check(ctx, what, a, 1.5, kinks, 1e-7, 20000);
  if (tight > 0) check_box(ctx, what, a, 2, tight);
}

/* ---- affine --------------------------------------------------------------------------------------- */

static void test_affine(batten_context *ctx) {
  batten_frep *body = make_body(ctx), *a = NULL, *b = NULL;
  const double c = cos(0.7), s = sin(0.7);
  const double turn[9] = {c, -s, 0, s, c, 0, 0, 0, 1}, shift[3] = {0.2, -0.3, 0.1};
  T_OK(batten_frep_affine(ctx, body, turn, shift, &a), ctx);
  check_all(ctx, "turn", a, 0.02, 0.6);
  T_CHECK(batten_frep_is_distance(a), "a turned distance is one");
  double y[3] = {0.3, 0.4, 0.5}, x[3];
  for (int i = 0; i < 3; i++) x[i] = turn[3 * i] * y[0] + turn[3 * i + 1] * y[1] + turn[3 * i + 2] * y[2] + shift[i];
  T_RATIO(fabs(value_at(ctx, a, x[0], x[1], x[2]) - value_at(ctx, body, y[0], y[1], y[2])), 1e-15,
          "what was at y is at x");
  batten_frep_free(a);

  const double twice[9] = {0, 0, -2, 0, 2, 0, 2, 0, 0};
  T_OK(batten_frep_affine(ctx, body, twice, shift, &a), ctx);
  check_all(ctx, "turn and scale", a, 0.02, 0);
  T_CHECK(batten_frep_is_distance(a), "a scaled distance is one");
  batten_frep *ball = NULL, *moved = NULL, *direct = NULL;
  T_OK(batten_frep_ball(ctx, 3, (double[]){0.5, 0.25, 0.125}, 0.75, &ball), ctx);
  T_OK(batten_frep_affine(ctx, ball, twice, shift, &moved), ctx);
  T_OK(batten_frep_ball(ctx, 3, (double[]){-0.25 + 0.2, 0.5 - 0.3, 1 + 0.1}, 1.5, &direct), ctx);
  double worst = 0;
  uint64_t seed = 4;
  for (int i = 0; i < 200; i++) {
    double p[3] = {4 * t_uniform(&seed) - 2, 4 * t_uniform(&seed) - 2, 4 * t_uniform(&seed) - 2};
    worst = fmax(worst, fabs(value_at(ctx, moved, p[0], p[1], p[2]) - value_at(ctx, direct, p[0], p[1], p[2])));
  }
  T_RATIO(worst, 2e-15, "a ball moved and scaled is the ball there");
  batten_frep_free(ball);
  batten_frep_free(moved);
  batten_frep_free(direct);
  batten_frep_free(a);

  const double shear[9] = {1, 0.5, 0.2, 0, 1.5, -0.3, 0.1, 0, 0.7};
  T_OK(batten_frep_affine(ctx, body, shear, shift, &a), ctx);
  check_all(ctx, "shear", a, 0.02, 1);
  T_CHECK(!batten_frep_is_distance(a), "a sheared distance is none");
  batten_frep_free(a);

  /* in the plane, and a turn of 90 degrees four times over is none, to the bit */
  batten_frep *disc = NULL, *chain[5];
  T_OK(batten_frep_ball(ctx, 2, (double[]){0.4, 0.1}, 0.6, &disc), ctx);
  chain[0] = disc;
  const double quarter[4] = {0, -1, 1, 0};
  for (int i = 0; i < 4; i++)
    T_OK(batten_frep_affine(ctx, chain[i], quarter, (const double[]){0, 0}, &chain[i + 1]), ctx);
  check_all(ctx, "turns in the plane", chain[3], 0.02, 0.02);
  double at[2] = {0.123, -0.77}, f[2];
  T_OK(batten_frep_evaluate(ctx, chain[0], 1, at, f, NULL), ctx);
  T_OK(batten_frep_evaluate(ctx, chain[4], 1, at, f + 1, NULL), ctx);
  T_CHECK(f[0] == f[1], "four quarter turns are none: %.17g, %.17g", f[0], f[1]);
  for (int i = 0; i < 5; i++) batten_frep_free(chain[i]);

  T_STATUS(batten_frep_affine(ctx, body, (const double[]){1, 2, 3, 4, 5, 6, 7, 8, 9}, shift, &b), BATTEN_E_INVALID,
           ctx, "matrix: has no inverse");
  T_STATUS(batten_frep_affine(ctx, body, NULL, shift, &b), BATTEN_E_INVALID, ctx, "matrix: NULL");
  T_STATUS(batten_frep_affine(ctx, body, turn, (const double[]){0, NAN, 0}, &b), BATTEN_E_INVALID, ctx,
           "shift[1]: nan");
  T_STATUS(batten_frep_affine(ctx, NULL, turn, shift, &b), BATTEN_E_INVALID, ctx, "a: NULL");
  T_STATUS(batten_frep_affine(ctx, body, turn, shift, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_CHECK(b == NULL, "bad input leaves out untouched");
  batten_frep_free(body);
}

/* ---- about an axis -------------------------------------------------------------------------------- */

static void test_twist(batten_context *ctx) {
  batten_frep *bar = make_bar(ctx, (double[]){-0.5, -0.2, -1}, (double[]){0.5, 0.2, 1}), *a = NULL, *b = NULL;
  T_OK(batten_frep_twist(ctx, bar, (double[]){0, 0, 0}, (double[]){0, 0, 2}, PI / 2, &a), ctx);
  check_all(ctx, "twist", a, 0.03, 0.1);
  /* at height 1 a quarter turn: the long side lies along y; at -1 too; at 0.5 by 45 degrees */
  const double d = 0.45 / sqrt(2);
  T_CHECK(value_at(ctx, a, 0, 0.45, 0.99) > 0 && value_at(ctx, a, 0.45, 0, 0.99) < 0 &&
              value_at(ctx, a, 0.45, 0, 0) > 0 && value_at(ctx, a, d, d, 0.5) > 0 && value_at(ctx, a, -d, d, 0.5) < 0,
          "twisted by hand");
  T_OK(batten_frep_twist(ctx, a, (double[]){0, 0, 0}, (double[]){0, 0, 2}, -PI / 2, &b), ctx);
  double worst = 0;
  uint64_t seed = 8;
  for (int i = 0; i < 200; i++) {
    double p[3] = {2 * t_uniform(&seed) - 1, 2 * t_uniform(&seed) - 1, 2 * t_uniform(&seed) - 1};
    worst = fmax(worst, fabs(value_at(ctx, b, p[0], p[1], p[2]) - value_at(ctx, bar, p[0], p[1], p[2])));
  }
  T_RATIO(worst, 1e-14, "twisted back");
  batten_frep_free(a);
  batten_frep_free(b);
  T_OK(batten_frep_twist(ctx, bar, (double[]){0.1, 0.2, -0.1}, (double[]){1, -2, 2}, 0.8, &a), ctx);
  check_all(ctx, "twist about any axis", a, 0.03, 2);
  batten_frep_free(a);
  /* many turns within a box: what lies beside the twisted bar is known to be outside all the same */
  T_OK(batten_frep_twist(ctx, bar, (double[]){0, 0, 0}, (double[]){0, 0, 1}, 30, &a), ctx);
  frep_check_bounds(ctx, "fast twist", a, 1.5, 25600, 21);
  double range[2];
  T_OK(batten_frep_bounds(ctx, a, 1, (double[]){1.2, -0.1, -0.9, 1.4, 0.1, 0.9}, range), ctx);
  T_CHECK(range[1] < 0 && range[0] < range[1], "a box beside a bar of 8 turns is outside: %.3g to %.3g", range[0],
          range[1]);
  batten_frep_free(a);
  a = NULL;
  T_STATUS(batten_frep_twist(ctx, bar, (double[]){0, 0, 0}, (double[]){0, 0, 0}, 1, &a), BATTEN_E_INVALID, ctx,
           "axis: its length is 0");
  T_STATUS(batten_frep_twist(ctx, bar, (double[]){0, 0, 0}, (double[]){0, 0, 1}, INFINITY, &a), BATTEN_E_INVALID, ctx,
           "rate: inf");
  batten_frep_free(bar);
}

/* Lines along the axis beside it, from a sixth of a turn to many: f on them comes near the bar in few places only,
 * which no arc of the bounds may leave out. */
static void test_twisted_lines(batten_context *ctx) {
  enum { LINES = 300, PLACES = 600 };
  static double x[3 * PLACES], f[PLACES];
  batten_frep *bar = make_bar(ctx, (double[]){0.9, -0.1, -1}, (double[]){1.1, 0.1, 1}), *a = NULL;
  T_OK(batten_frep_twist(ctx, bar, (double[]){0, 0, 0}, (double[]){0, 0, 1}, 30, &a), ctx);
  uint64_t seed = 29;
  size_t outside = 0, wide = 0;
  for (int i = 0; i < LINES; i++) {
    double t = 2 * PI * t_uniform(&seed), low = -0.5 * t_uniform(&seed);
    double high = low + (0.5 + 7 * t_uniform(&seed)) / 30, range[2];
    const double line[6] = {cos(t), sin(t), low, cos(t), sin(t), high};
    for (int j = 0; j < PLACES; j++) {
      x[3 * j] = cos(t);
      x[3 * j + 1] = sin(t);
      x[3 * j + 2] = fmin(low + (high - low) * j / (PLACES - 1), high);
    }
    if (batten_frep_bounds(ctx, a, 1, line, range) < 0 || batten_frep_evaluate(ctx, a, PLACES, x, f, NULL) < 0)
      outside += PLACES;
    for (int j = 0; j < PLACES; j++) outside += !(f[j] >= range[0] && f[j] <= range[1]);
    wide += range[1] > 2;
  }
  T_CHECK(outside == 0 && wide == 0, "lines beside the axis of a fast twist: %zu values outside of their bounds",
          outside);
  batten_frep_free(a);
  batten_frep_free(bar);
}

static void test_taper(batten_context *ctx) {
  batten_frep *bar = make_bar(ctx, (double[]){-0.5, -0.2, -1}, (double[]){0.5, 0.2, 1}), *a = NULL;
  T_OK(batten_frep_taper(ctx, bar, (double[]){0, 0, 0}, (double[]){0, 0, 1}, -0.5, 0.5, 1.5, 0.5, &a), ctx);
  check_all(ctx, "taper", a, 0.04, 0.4);
  T_CHECK(value_at(ctx, a, 0.74, 0, -0.75) > 0 && value_at(ctx, a, 0.76, 0, -0.75) < 0 &&
              value_at(ctx, a, 0.49, 0, 0) > 0 && value_at(ctx, a, 0.51, 0, 0) < 0 &&
              value_at(ctx, a, 0.24, 0, 0.9) > 0 && value_at(ctx, a, 0.26, 0, 0.9) < 0,
          "tapered by hand");
  batten_frep_free(a);
  T_OK(batten_frep_taper(ctx, bar, (double[]){0, 0.1, 0}, (double[]){1, 1, 0}, -0.2, 0.7, 0.6, 1.2, &a), ctx);
  check_all(ctx, "taper across", a, 0.04, 2);
  batten_frep_free(a);
  T_STATUS(batten_frep_taper(ctx, bar, (double[]){0, 0, 0}, (double[]){0, 0, 1}, 1, 1, 1, 1, &a), BATTEN_E_INVALID,
           ctx, "upper: 1, lower: 1; give lower < upper");
  T_STATUS(batten_frep_taper(ctx, bar, (double[]){0, 0, 0}, (double[]){0, 0, 1}, 0, 1, 0, 1, &a), BATTEN_E_INVALID,
           ctx, "scale_lower: 0");
  T_STATUS(batten_frep_taper(ctx, bar, (double[]){0, 0, 0}, (double[]){0, 0, 1}, 0, 1, 1, -1, &a), BATTEN_E_INVALID,
           ctx, "scale_upper: -1");
  batten_frep_free(bar);
}

/* The bar of length 3 along z, bent towards +x with radius 1 / curvature between 0 and upper. */
static void bend_case(batten_context *ctx, const char *what, double curvature, double upper, double size,
                      double tight) {
  batten_frep *bar = make_bar(ctx, (double[]){-0.2, -0.3, -0.4}, (double[]){0.25, 0.3, upper + 0.4}), *a = NULL;
  T_OK(batten_frep_bend(ctx, bar, (double[]){0, 0, 0}, (double[]){0, 0, 1}, (double[]){1, 0, 0.3}, curvature, 0,
                        upper, &a),
       ctx);
  frep_check(ctx, what, a, size, 0.05, 1e-7, 20000);
  check_box(ctx, what, a, 2.2, tight);
  /* forward: what was at (u, v, h) is there after it, whichever of its other places there are */
  uint64_t seed = 21;
  double worst = 0, radius = 1 / curvature;
  size_t less = 0;
  for (int i = 0; i < 300; i++) {
    double u = -0.3 + 0.6 * t_uniform(&seed), v = 0.8 * t_uniform(&seed) - 0.4;
    double h = -0.5 + (upper + 1) * t_uniform(&seed);
    double on = fmin(fmax(h, 0), upper), c = cos(on * curvature), s = sin(on * curvature), rest = h - on;
    double x = radius - (radius - u) * c + rest * s, z = (radius - u) * s + rest * c;
    double f = value_at(ctx, a, x, v, z), g = value_at(ctx, bar, u, v, h);
    less += f < g - 1e-13;
    if (upper * curvature <= PI) worst = fmax(worst, fabs(f - g));
  }
  T_CHECK(less == 0, "%s: holds all that was there", what);
  T_RATIO(worst, 1e-13, "%s: what was there came here", what);
  batten_frep_free(a);
  batten_frep_free(bar);
}

static void test_bend(batten_context *ctx) {
  bend_case(ctx, "bend by 60 degrees", PI / 3, 1, 1.5, 0.1);
  bend_case(ctx, "bend by half a turn", 2, PI / 2, 1.5, 0.1);
  bend_case(ctx, "bend by 300 degrees", 2, 5 * PI / 6, 1.5, 0.1);
  bend_case(ctx, "bend by a full turn", 2, PI, 1.5, 0.1);
  batten_frep *bar = make_bar(ctx, (double[]){-0.2, -0.2, 0}, (double[]){0.2, 0.2, PI}), *ring = NULL;
  /* a full turn of a bar is a ring, closed */
  T_OK(batten_frep_bend(ctx, bar, (double[]){0, 0, 0}, (double[]){0, 0, 1}, (double[]){1, 0, 0}, 2, 0, PI, &ring),
       ctx);
  double least = INFINITY;
  for (int i = 0; i < 720; i++) {
    double t = 2 * PI * i / 720 + 0.001;
    least = fmin(least, value_at(ctx, ring, 0.5 - 0.5 * cos(t), 0, 0.5 * sin(t)));
  }
  T_CHECK(least >= 0, "bar to ring: %g along its middle", least);
  batten_frep_free(ring);
  double lower[3], upper[3];
  T_OK(batten_frep_bend(ctx, bar, (double[]){0, 0, 0}, (double[]){0, 0, 1}, (double[]){1, 0, 0}, 6, 0, 1, &ring),
       ctx);
  T_CHECK(!frep_structural_box(ring, lower, upper), "no box is known of what crosses the fold");
  frep_check_bounds(ctx, "bend across the fold", ring, 1.5, 20000, 3);
  batten_frep_free(ring);
  ring = NULL;
  T_STATUS(batten_frep_bend(ctx, bar, (double[]){0, 0, 0}, (double[]){0, 0, 1}, (double[]){1, 0, 0}, 7, 0, 1, &ring),
           BATTEN_E_INVALID, ctx, "curvature: 7 makes 1.11408 turns");
  T_STATUS(batten_frep_bend(ctx, bar, (double[]){0, 0, 0}, (double[]){0, 0, 1}, (double[]){0, 0, -3}, 1, 0, 1, &ring),
           BATTEN_E_INVALID, ctx, "direction: lies along axis");
  T_STATUS(batten_frep_bend(ctx, bar, (double[]){0, 0, 0}, (double[]){0, 0, 1}, (double[]){1, 0, 0}, 0, 0, 1, &ring),
           BATTEN_E_INVALID, ctx, "curvature: 0");
  T_STATUS(batten_frep_bend(ctx, bar, (double[]){0, 0, 0}, (double[]){0, 0, 1}, (double[]){1, 0, 0}, 1, 2, 1, &ring),
           BATTEN_E_INVALID, ctx, "lower < upper");
  batten_frep_free(bar);
}

/* ---- dimensions ----------------------------------------------------------------------------------- */

static void test_extrude(batten_context *ctx) {
  batten_frep *disc = NULL, *a = NULL, *b = NULL;
  T_OK(batten_frep_ball(ctx, 2, (double[]){0.2, -0.1}, 0.7, &disc), ctx);
  T_OK(batten_frep_extrude(ctx, disc, -0.5, 0.8, &a), ctx);
  check_all(ctx, "extrusion", a, 0.03, 0.05);
  /* by the other route: the cylinder's own distance */
  T_OK(batten_frep_cone(ctx, (double[]){0.2, -0.1, -0.5}, (double[]){0.2, -0.1, 0.8}, 0.7, 0.7, &b), ctx);
  double worst = 0;
  uint64_t seed = 9;
  for (int i = 0; i < 500; i++) {
    double p[3] = {4 * t_uniform(&seed) - 2, 4 * t_uniform(&seed) - 2, 4 * t_uniform(&seed) - 2};
    worst = fmax(worst, fabs(value_at(ctx, a, p[0], p[1], p[2]) - value_at(ctx, b, p[0], p[1], p[2])));
  }
  T_RATIO(worst, 4e-15, "a disc's extrusion is the cylinder");
  batten_frep_free(a);
  batten_frep_free(b);
  T_OK(batten_frep_extrude(ctx, disc, -INFINITY, INFINITY, &a), ctx);
  check_all(ctx, "extrusion without end", a, 0.03, 0);
  batten_frep_free(a);
  T_OK(batten_frep_extrude(ctx, disc, 0.1, INFINITY, &a), ctx);
  check_all(ctx, "extrusion with one end", a, 0.03, 0);
  batten_frep_free(a);
  T_STATUS(batten_frep_extrude(ctx, disc, 1, 1, &a), BATTEN_E_INVALID, ctx, "upper: 1, lower: 1");
  T_STATUS(batten_frep_extrude(ctx, disc, NAN, 1, &a), BATTEN_E_INVALID, ctx, "lower: nan");
  batten_frep *body = make_body(ctx);
  T_STATUS(batten_frep_extrude(ctx, body, 0, 1, &a), BATTEN_E_INVALID, ctx, "a: of dimension 3");
  batten_frep_free(body);
  batten_frep_free(disc);
}

static void test_revolve(batten_context *ctx) {
  batten_frep *disc = NULL, *a = NULL;
  T_OK(batten_frep_ball(ctx, 2, (double[]){0.8, 0.1}, 0.3, &disc), ctx);
  T_OK(batten_frep_revolve(ctx, disc, &a), ctx);
  check_all(ctx, "revolution", a, 0.01, 0.1);
  double worst = 0;
  uint64_t seed = 9;
  for (int i = 0; i < 500; i++) {
    double p[3] = {4 * t_uniform(&seed) - 2, 4 * t_uniform(&seed) - 2, 4 * t_uniform(&seed) - 2};
    double torus = 0.3 - hypot(hypot(p[0], p[1]) - 0.8, p[2] - 0.1);
    worst = fmax(worst, fabs(value_at(ctx, a, p[0], p[1], p[2]) - torus));
  }
  T_RATIO(worst, 4e-15, "a disc turned about an axis is the torus");
  double g[3], at[3] = {0, 0, 0.5};
  T_OK(batten_frep_evaluate(ctx, a, 1, at, NULL, g), ctx);
  T_CHECK(g[0] == 0 && g[1] == 0, "on the axis the gradient is the mean of all sides");
  batten_frep_free(a);
  batten_frep_free(disc);
}

static void test_section(batten_context *ctx) {
  batten_frep *body = make_body(ctx), *a = NULL;
  const double origin[3] = {0.1, 0.2, 0.3}, axes[2][3] = {{0.6, 0.8, 0}, {0, 0, 1}};
  T_OK(batten_frep_section(ctx, body, origin, axes, &a), ctx);
  check_all(ctx, "section", a, 0.02, 1);
  double at[2] = {0.3, -0.2}, f;
  T_OK(batten_frep_evaluate(ctx, a, 1, at, &f, NULL), ctx);
  T_RATIO(fabs(f - value_at(ctx, body, 0.1 + 0.18, 0.2 + 0.24, 0.1)), 1e-15, "section by hand");
  batten_frep_free(a);
  a = NULL;
  const double skew[2][3] = {{0.6, 0.8, 0}, {0.1, 0, 1}};
  T_STATUS(batten_frep_section(ctx, body, origin, skew, &a), BATTEN_E_INVALID, ctx, "axes: rows 0 and 1");
  T_STATUS(batten_frep_section(ctx, body, origin, NULL, &a), BATTEN_E_INVALID, ctx, "axes: NULL");
  T_STATUS(batten_frep_section(ctx, body, NULL, axes, &a), BATTEN_E_INVALID, ctx, "origin: NULL");
  batten_frep_free(body);
}

static void test_project(batten_context *ctx) {
  batten_frep *ball = NULL, *a = NULL;
  T_OK(batten_frep_ball(ctx, 3, (double[]){0.2, 0.1, 0.3}, 0.7, &ball), ctx);
  for (unsigned axis = 0; axis < 3; axis++) {
    T_OK(batten_frep_project(ctx, ball, axis, -1, 2, 9, &a), ctx);
    const double center[3] = {0.2, 0.1, 0.3};
    double worst = 0, low[2], high[2];
    uint64_t seed = 9;
    for (int i = 0; i < 300; i++) {
      double p[2] = {4 * t_uniform(&seed) - 2, 4 * t_uniform(&seed) - 2}, f = NAN;
      double du = p[0] - center[axis == 0], dv = p[1] - center[axis == 2 ? 1 : 2];
      if (batten_frep_evaluate(ctx, a, 1, p, &f, NULL) < 0) f = NAN;
      worst = fmax(worst, fabs(f - (0.7 - hypot(du, dv))));
    }
    T_RATIO(worst, 1e-15, "shadow of a ball along %u is the disc", axis);
    T_CHECK(frep_structural_box(a, low, high) && fabs(high[0] - center[axis == 0] - 0.7) < 1e-12, "its box");
    batten_frep_free(a);
  }
  batten_frep *body = make_body(ctx);
  T_OK(batten_frep_project(ctx, body, 1, -0.3, 0.7, 12, &a), ctx);
  frep_check(ctx, "shadow", a, 1.5, 0.03, 1e-6, 4096);
  check_box(ctx, "shadow", a, 2, 0.2);
  batten_frep_free(a);
  /* a thin blade far from every sample, which bounds alone can find */
  batten_frep *sheet = NULL, *blade = NULL, *both = NULL;
  T_OK(batten_frep_ball(ctx, 2, (double[]){0, 0}, 2, &sheet), ctx);
  T_OK(batten_frep_extrude(ctx, sheet, 0.3301, 0.3323, &blade), ctx);
  batten_frep_free(sheet);
  T_OK(batten_frep_combine(ctx, BATTEN_FREP_UNION, ball, blade, 1, &both), ctx);
  T_OK(batten_frep_project(ctx, both, 2, -1, 2, 4, &a), ctx);
  double f, p[2] = {0.95, 0.95};
  T_OK(batten_frep_evaluate(ctx, a, 1, p, &f, NULL), ctx);
  T_RATIO(fabs(f - 0.0011), 1e-8, "shadow of a blade");
  batten_frep_free(a);
  batten_frep_free(both);
  batten_frep_free(blade);
  a = NULL;
  T_STATUS(batten_frep_project(ctx, body, 3, 0, 1, 9, &a), BATTEN_E_INVALID, ctx, "axis: 3; give 0, 1 or 2");
  T_STATUS(batten_frep_project(ctx, body, 0, 1, 0, 9, &a), BATTEN_E_INVALID, ctx, "upper: 0, lower: 1");
  T_STATUS(batten_frep_project(ctx, body, 0, 0, 1, 1, &a), BATTEN_E_INVALID, ctx, "samples: 1; give 2 to");
  batten_frep_free(body);
  batten_frep_free(ball);
}

/* ---- memory --------------------------------------------------------------------------------------- */

static batten_status use_maps(batten_context *ctx, void *arg) {
  (void)arg;
  batten_frep *disc = NULL, *bar = NULL, *bent = NULL, *turned = NULL, *flat = NULL;
  const double turn[9] = {0, 1, 0, -1, 0, 0, 0, 0, 1}, shift[3] = {1, 2, 3};
  double x[10] = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1}, f[5], g[10], range[2];
  batten_status st = batten_frep_ball(ctx, 2, (double[]){0.1, 0.2}, 0.5, &disc);
  if (st >= 0) st = batten_frep_extrude(ctx, disc, 0, 2, &bar);
  if (st >= 0) st = batten_frep_bend(ctx, bar, shift, (double[]){0, 0, 1}, (double[]){1, 0, 0}, 1, 0, 1, &bent);
  if (st >= 0) st = batten_frep_affine(ctx, bent, turn, shift, &turned);
  if (st >= 0) st = batten_frep_project(ctx, turned, 1, -1, 1, 5, &flat);
  if (st >= 0) st = batten_frep_evaluate(ctx, flat, 5, x, f, g);
  if (st >= 0) st = batten_frep_bounds(ctx, flat, 1, x, range);
  batten_frep_free(disc);
  batten_frep_free(bar);
  batten_frep_free(bent);
  batten_frep_free(turned);
  batten_frep_free(flat);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_affine(ctx);
  test_twist(ctx);
  test_twisted_lines(ctx);
  test_taper(ctx);
  test_bend(ctx);
  test_extrude(ctx);
  test_revolve(ctx);
  test_section(ctx);
  test_project(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  batten_context_free(ctx);
  t_fail_every_allocation("maps", use_maps, NULL);
  return t_done();
}
