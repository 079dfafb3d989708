/* Carriers: values by hand, derivatives against differences, R-functions, parts, the fitted ellipsoid, bad input. */
#include <batten/carrier.h>
#include <batten/solid.h>

#include "tap.h"

static const double origin[3] = {0, 0, 0}, z_axis[3] = {0, 0, 1};
/* Rotation by the angles 0.7 about z, then 0.4 about x: rows are orthonormal. */
static double turned[9];

static void make_turned(void) {
  double c = cos(0.7), s = sin(0.7), d = cos(0.4), e = sin(0.4);
  const double rows[9] = {c, s, 0, -d * s, d * c, e, e * s, -e * c, d};
  memcpy(turned, rows, sizeof turned);
}

static double value_at(batten_context *ctx, const batten_carrier *c, double x, double y, double z) {
  double p[3] = {x, y, z}, f = NAN;
  if (batten_carrier_evaluate(ctx, c, 1, p, &f, NULL, NULL) != BATTEN_OK) return NAN;
  return f;
}

/* |f(a, b, c) - expected| <= 1e-14 for unit sized shapes: a few roundings. Frees the carrier. */
static void by_hand(batten_context *ctx, const char *what, batten_carrier *c, size_t count, const double *cases) {
  double worst = 0;
  for (size_t i = 0; i < count; i++, cases += 4)
    worst = fmax(worst, fabs(value_at(ctx, c, cases[0], cases[1], cases[2]) - cases[3]));
  T_RATIO(worst, 1e-14, "%s at %zu points by hand", what, count);
  batten_carrier_free(c);
}

static void test_values(batten_context *ctx) {
  batten_carrier *c = NULL;
  T_OK(batten_carrier_ball(ctx, 3, (double[]){1, 0, 0}, 2, &c), ctx);
  by_hand(ctx, "ball", c, 3, (double[]){1, 0, 0, 4, 3, 0, 0, 0, 1, 3, 0, -5});
  T_OK(batten_carrier_ellipsoid(ctx, 3, origin, (double[]){1, 2, 4}, NULL, &c), ctx);
  by_hand(ctx, "ellipsoid", c, 4, (double[]){0, 0, 0, 1, 0, 2, 0, 0, 0, 0, 4, 0, 2, 0, 0, -3});
  T_OK(batten_carrier_box(ctx, 3, origin, (double[]){1, 2, 3}, NULL, 0, &c), ctx);
  by_hand(ctx, "box", c, 4, (double[]){0, 0, 0, 1, 1, 1, 1, 0, 4, 6, 0, -5, 0, 0, 3.5, -0.5});
  T_OK(batten_carrier_box(ctx, 3, origin, (double[]){1, 2, 3}, NULL, 0.5, &c), ctx);
  by_hand(ctx, "rounded box", c, 3, (double[]){0, 0, 0, 1, 0.5 + 0.3, 1.5 + 0.4, 0, 0, 2, 0, 0, -1});
  T_OK(batten_carrier_cylinder(ctx, (double[]){0, 0, -2}, (double[]){0, 0, 2}, 1, 0, &c), ctx);
  by_hand(ctx, "cylinder", c, 4, (double[]){0, 0, 0, 1, 4, 0, 6, -5, 0, 0, 1.5, 0.5, 0, 3, 0, -2});
  T_OK(batten_carrier_torus(ctx, origin, z_axis, 2, 0.5, &c), ctx);
  by_hand(ctx, "torus", c, 3, (double[]){2, 0, 0, 0.5, 0, 0, 0, -1.5, 0, 5, 4, -4.5});
  T_OK(batten_carrier_half_space(ctx, 3, (double[]){0, 0, 1}, (double[]){0, 0, 7}, &c), ctx);
  by_hand(ctx, "half-space", c, 2, (double[]){5, 5, 0, 1, 0, 9, 3, -2});
  T_OK(batten_carrier_none(ctx, 3, &c), ctx);
  by_hand(ctx, "none", c, 1, (double[]){5, 5, 0, 0});
  T_OK(batten_carrier_box(ctx, 1, origin, (double[]){2}, NULL, 0, &c), ctx);
  double x[3] = {-3, 0, 1.5}, f[3];
  T_OK(batten_carrier_evaluate(ctx, c, 3, x, f, NULL, NULL), ctx);
  T_CHECK(f[0] == -1 && f[1] == 2 && f[2] == 0.5, "an interval is a box in one dimension");
  batten_carrier_free(c);
}

/* Largest difference of gradient and Hessian to fourth-order differences with step h: rounding about eps / h = 1e-11,
 * truncation (h / distance to the nearest kink or edge)^4. */
static void check_derivatives(batten_context *ctx, const char *what, const batten_carrier *c) {
  const double bound = 1e-8; /* rounding of the differences times the size of the fields, with room */
  enum { POINTS = 200 };
  const double h = 1e-5;
  unsigned n = batten_carrier_field(c).dimension;
  uint64_t seed = 3;
  double worst_gradient = 0, worst_hessian = 0, worst_alone = 0;
  for (int i = 0; i < POINTS; i++) {
    double x[3], f, g[3], hess[9], alone[9], ga[3];
    for (unsigned k = 0; k < n; k++) x[k] = 5 * t_uniform(&seed) - 2.5;
    if (batten_carrier_evaluate(ctx, c, 1, x, &f, g, hess) != BATTEN_OK) worst_gradient = NAN;
    batten_carrier_evaluate(ctx, c, 1, x, NULL, NULL, alone);
    batten_carrier_evaluate(ctx, c, 1, x, NULL, ga, NULL);
    for (unsigned k = 0; k < n * n; k++) worst_alone = fmax(worst_alone, fabs(alone[k] - hess[k]));
    for (unsigned k = 0; k < n; k++) worst_alone = fmax(worst_alone, fabs(ga[k] - g[k]));
    for (unsigned k = 0; k < n; k++) {
      const double weights[4] = {1, -8, 8, -1}, at = x[k];
      double slope = 0, bend[3] = {0};
      for (int side = 0; side < 4; side++) {
        double v, gv[3];
        x[k] = at + h * (side < 2 ? side - 2 : side - 1);
        batten_carrier_evaluate(ctx, c, 1, x, &v, gv, NULL);
        slope += weights[side] * v / (12 * h);
        for (unsigned j = 0; j < n; j++) bend[j] += weights[side] * gv[j] / (12 * h);
      }
      x[k] = at;
      worst_gradient = fmax(worst_gradient, fabs(slope - g[k]));
      for (unsigned j = 0; j < n; j++) worst_hessian = fmax(worst_hessian, fabs(bend[j] - hess[k * n + j]));
    }
  }
  T_RATIO(worst_gradient, bound, "%s: gradient against differences (n=%u)", what, n);
  T_RATIO(worst_hessian, bound, "%s: Hessian against differences (n=%u)", what, n);
  T_CHECK(worst_alone == 0, "%s: the same derivatives when asked for alone", what);
}

static batten_status wavy(const void *user, batten_context *ctx, size_t count, const double *x, double *f, double *g,
                          double *h) {
  unsigned n = *(const unsigned *)user;
  (void)ctx;
  for (size_t i = 0; i < count; i++, x += n) {
    double a = x[0], b = n > 1 ? x[1] : 0, c = n > 2 ? x[2] : 0;
    if (f) f[i] = sin(a) + a * b + b * c * c;
    const double full_g[3] = {cos(a) + b, a + c * c, 2 * b * c};
    const double full_h[9] = {-sin(a), 1, 0, 1, 0, 2 * c, 0, 2 * c, 2 * b};
    for (unsigned k = 0; k < n; k++) {
      if (g) g[i * n + k] = full_g[k];
      for (unsigned j = 0; h && j < n; j++) h[(i * n + k) * n + j] = full_h[3 * k + j];
    }
  }
  return BATTEN_OK;
}

static void test_derivatives(batten_context *ctx) {
  const double center[3] = {0.1, -0.2, 0.3}, half[3] = {1, 0.8, 1.3};
  batten_carrier *c = NULL;
  for (unsigned n = 1; n <= 3; n++) {
    const double plane[4] = {0.6, 0.8, -0.8, 0.6}, *rotation = n == 3 ? turned : n == 2 ? plane : NULL;
    batten_carrier_ball(ctx, n, center, 1.2, &c);
    check_derivatives(ctx, "ball", c);
    batten_carrier_free(c);
    batten_carrier_ellipsoid(ctx, n, center, half, rotation, &c);
    check_derivatives(ctx, "ellipsoid", c);
    batten_carrier_free(c);
    for (int r = 0; r < 2; r++) {
      batten_carrier_box(ctx, n, center, half, rotation, 0.5 * r, &c);
      check_derivatives(ctx, r ? "rounded box" : "box", c);
      batten_carrier_free(c);
    }
    batten_carrier_half_space(ctx, n, center, half, &c);
    check_derivatives(ctx, "half-space", c);
    batten_carrier_free(c);
  }
  for (int r = 0; r < 2; r++) {
    batten_carrier_cylinder(ctx, center, half, 0.7, 0.3 * r, &c);
    check_derivatives(ctx, r ? "rounded cylinder" : "cylinder", c);
    batten_carrier_free(c);
  }
  batten_carrier_torus(ctx, center, half, 1.5, 0.6, &c);
  check_derivatives(ctx, "torus", c);
  batten_carrier_free(c);
}

static void test_callback(batten_context *ctx) {
  for (unsigned n = 1; n <= 3; n++)
    for (unsigned order = 0; order <= 2; order++) {
      batten_carrier *c = NULL;
      batten_field field = {.dimension = n, .order = order, .evaluate = wavy, .user = &n};
      T_OK(batten_carrier_callback(ctx, &field, 1e-4, &c), ctx);
      static double x[700 * 3], f[700], g[700 * 3], h[700 * 9], fe[700], ge[700 * 3], he[700 * 9];
      uint64_t seed = 9;
      for (size_t i = 0; i < 700 * n; i++) x[i] = 2 * t_uniform(&seed) - 1;
      T_OK(batten_carrier_evaluate(ctx, c, 700, x, f, g, h), ctx);
      wavy(&n, ctx, 700, x, fe, ge, he);
      double ef = 0, eg = 0, eh = 0;
      for (size_t i = 0; i < 700; i++) ef = fmax(ef, fabs(f[i] - fe[i]));
      for (size_t i = 0; i < 700 * n; i++) eg = fmax(eg, fabs(g[i] - ge[i]));
      for (size_t i = 0; i < 700 * n * n; i++) eh = fmax(eh, fabs(h[i] - he[i]));
      T_RATIO(ef, 0, "callback of order %u, n = %u: values", order, n);
      T_RATIO(eg, 1e-8, "callback of order %u, n = %u: gradients", order, n);
      T_RATIO(eh, order ? 1e-8 : 1e-6, "callback of order %u, n = %u: Hessians", order, n); /* eps / step^2 = 2e-8 */
      batten_carrier_free(c);
    }
}

static batten_status sick(const void *user, batten_context *ctx, size_t count, const double *x, double *f, double *g,
                          double *h) {
  (void)x, (void)g, (void)h;
  if (!user) return batten_fail(ctx, BATTEN_E_NOT_FOUND, "host: no field here");
  for (size_t i = 0; i < count; i++) f[i] = i == 2 ? NAN : 1;
  return BATTEN_OK;
}

static void test_sick_callback(batten_context *ctx) {
  batten_carrier *c = NULL;
  double x[8] = {0, 0, 1, 1, 2, 3, 4, 4}, f[4], g[8];
  batten_field field = {.dimension = 2, .order = 0, .evaluate = sick, .user = NULL};
  batten_carrier_callback(ctx, &field, 1, &c);
  T_STATUS(batten_carrier_evaluate(ctx, c, 4, x, f, NULL, NULL), BATTEN_E_NOT_FOUND, ctx, "host: no field");
  batten_carrier_free(c);
  field.user = &field;
  batten_carrier_callback(ctx, &field, 1, &c);
  T_STATUS(batten_carrier_evaluate(ctx, c, 4, x, f, NULL, NULL), BATTEN_E_INVALID, ctx, "not finite at (2, 3, 0)");
  T_STATUS(batten_carrier_evaluate(ctx, c, 4, x, f, g, NULL), BATTEN_E_INVALID, ctx, "not finite");
  batten_carrier_free(c);
}

static void test_r_functions(batten_context *ctx) {
  batten_carrier *a = NULL, *b = NULL, *c = NULL, *deep = NULL;
  const double left[3] = {-0.8, 0, 0}, right[3] = {0.8, 0.1, 0};
  batten_carrier_ball(ctx, 3, left, 1.1, &a);
  batten_carrier_ball(ctx, 3, right, 1.3, &b);
  const double alphas[4] = {-0.5, 0, 0.9, 1};
  for (int k = 0; k < 4; k++)
    for (int kind = 0; kind < 2; kind++) {
      double alpha = alphas[k], sign = kind ? -1 : 1, worst = 0, wrong = 0;
      T_OK((kind ? batten_carrier_intersection : batten_carrier_union)(ctx, a, b, alpha, &c), ctx);
      uint64_t seed = 5;
      for (int i = 0; i < 500; i++) {
        double x = 4 * t_uniform(&seed) - 2, y = 4 * t_uniform(&seed) - 2, z = 4 * t_uniform(&seed) - 2;
        double f = value_at(ctx, a, x, y, z), g = value_at(ctx, b, x, y, z), u = value_at(ctx, c, x, y, z);
        double e = (f + g + sign * sqrt(f * f + g * g - 2 * alpha * f * g)) / (1 + alpha);
        worst = fmax(worst, fabs(u - e));
        wrong += (u > 0) != (kind ? f > 0 && g > 0 : f > 0 || g > 0);
      }
      T_RATIO(worst, 1e-13, "%s of two balls, alpha = %g, against its formula", kind ? "intersection" : "union",
              alpha);
      T_CHECK(wrong == 0, "its sign is that of the set");
      check_derivatives(ctx, "R-function", c);
      batten_carrier_free(c);
    }
  batten_carrier_union(ctx, a, b, 0, &c);
  batten_carrier_half_space(ctx, 3, origin, z_axis, &deep);
  batten_carrier *all = NULL;
  T_OK(batten_carrier_intersection(ctx, c, deep, 0.25, &all), ctx);
  batten_carrier_free(a); /* the composite keeps its parts */
  batten_carrier_free(b);
  batten_carrier_free(c);
  batten_carrier_free(deep);
  check_derivatives(ctx, "intersection of a union and a half-space", all);
  batten_carrier_free(all);
}

/* f = g = 0: the mean of both sides. Tiny values: no overflow of 1 / S^3. */
static void test_kink(batten_context *ctx) {
  batten_carrier *a = NULL, *b = NULL, *c = NULL;
  batten_carrier_half_space(ctx, 2, origin, (double[]){1, 0}, &a);
  batten_carrier_half_space(ctx, 2, origin, (double[]){0, 1}, &b);
  for (int k = 0; k < 2; k++) {
    double x[4] = {0, 0, 1e-150, -1e-160}, f[2], g[4], h[8], sum = 0;
    batten_carrier_union(ctx, a, b, k, &c);
    T_OK(batten_carrier_evaluate(ctx, c, 2, x, f, g, h), ctx);
    T_CHECK(f[0] == 0 && g[0] == -1.0 / (1 + k) && g[1] == -1.0 / (1 + k) && h[0] == 0 && h[3] == 0,
            "where both vanish (alpha = %d): gradient %g %g, no second derivative", k, g[0], g[1]);
    for (int i = 0; i < 8; i++) sum += g[i % 4] + h[i];
    T_CHECK(isfinite(sum), "finite derivatives at values of 1e-150 (alpha = %d)", k);
    batten_carrier_free(c);
  }
  batten_carrier_free(a);
  batten_carrier_free(b);
}

/* Chains stop at the depth that the evaluation's recursion is made for; pairs go on. */
static void test_depth(batten_context *ctx) {
  batten_carrier *chain = NULL, *ball = NULL;
  batten_carrier_ball(ctx, 2, origin, 1, &ball);
  chain = batten_carrier_retain(ball);
  batten_status st = BATTEN_OK;
  int levels = 0;
  for (; st == BATTEN_OK && levels < 100; levels++) {
    batten_carrier *next = NULL;
    st = batten_carrier_union(ctx, chain, ball, 0, &next);
    if (st != BATTEN_OK) break;
    batten_carrier_free(chain);
    chain = next;
  }
  T_CHECK(st == BATTEN_E_TOO_LARGE && levels == 64 && strstr(batten_error(ctx), "in pairs"), "chain of %d unions: %s",
          levels, batten_error(ctx));
  T_CHECK(value_at(ctx, chain, 0, 0, 0) > 1, "the chain evaluates");
  batten_carrier_free(chain);
  batten_carrier_free(ball);
}

static void test_parts(batten_context *ctx) {
  batten_carrier *c[9] = {0};
  const double center[3] = {1, -2, 0.1}, half[3] = {1, 0.7, 1.3}, axis[3] = {1, 2, 3};
  batten_carrier_none(ctx, 3, &c[0]);
  batten_carrier_ball(ctx, 3, center, 1.5, &c[1]);
  batten_carrier_ellipsoid(ctx, 3, center, half, turned, &c[2]);
  batten_carrier_box(ctx, 3, center, half, turned, 0.2, &c[3]);
  batten_carrier_cylinder(ctx, center, axis, 0.7, 0.1, &c[4]);
  batten_carrier_torus(ctx, center, axis, 2, 0.3, &c[5]);
  batten_carrier_half_space(ctx, 3, center, axis, &c[6]);
  batten_carrier_union(ctx, c[1], c[5], 0.5, &c[7]);
  batten_carrier_intersection(ctx, c[7], c[6], 0, &c[8]);
  for (int k = 0; k < 9; k++) {
    batten_carrier_parts parts, again;
    batten_carrier *copy = NULL;
    batten_carrier_get_parts(c[k], &parts);
    T_OK(batten_carrier_create(ctx, &parts, &copy), ctx);
    batten_carrier_get_parts(copy, &again);
    bool same = again.kind == parts.kind && again.n == 3 && again.parameter_count == parts.parameter_count &&
                again.children[0] == parts.children[0];
    uint64_t seed = 21;
    for (int i = 0; i < 100; i++) {
      double x[3], f[13], g[13];
      for (int j = 0; j < 3; j++) x[j] = 6 * t_uniform(&seed) - 3;
      batten_carrier_evaluate(ctx, c[k], 1, x, f, f + 1, f + 4);
      batten_carrier_evaluate(ctx, copy, 1, x, g, g + 1, g + 4);
      same = same && !memcmp(f, g, sizeof f);
    }
    T_CHECK(same, "%s: the same bits from its parts", batten_carrier_kind_name(parts.kind));
    parts.parameter_count++;
    if (k < 7) T_STATUS(batten_carrier_create(ctx, &parts, &copy), BATTEN_E_INVALID, ctx, "parts.parameter_count");
    batten_carrier_free(copy);
  }
  for (int k = 0; k < 9; k++) batten_carrier_free(c[k]);
}

/* Points spread evenly over a sphere (Fibonacci spiral) or circle: the ellipsoid is that sphere up to the spiral's
 * own unevenness (1 / N), wherever it lies. */
static void test_fit(batten_context *ctx) {
  enum { N = 4000 };
  static double points[3 * N];
  const double far[2] = {0, 7e6};
  for (int f = 0; f < 2; f++)
    for (unsigned n = 2; n <= 3; n++) {
      for (int i = 0; i < N; i++) {
        double z = n == 3 ? 1 - (2.0 * i + 1) / N : 0, r = sqrt(1 - z * z),
               angle = n == 3 ? 2.399963229728653 * i : 2 * 3.14159265358979 * i / N;
        double p[3] = {3 * r * cos(angle), 3 * r * sin(angle), 3 * z};
        for (unsigned k = 0; k < n; k++) points[(size_t)i * n + k] = far[f] + p[k];
      }
      batten_carrier *c = NULL;
      batten_carrier_parts parts;
      T_OK(batten_carrier_fit(ctx, n, N, points, &c), ctx);
      batten_carrier_get_parts(c, &parts);
      double worst = 0;
      for (unsigned k = 0; k < n; k++) {
        worst = fmax(worst, fabs(parts.parameters[k] - far[f]));
        worst = fmax(worst, fabs(parts.parameters[n + k] - 3));
      }
      T_RATIO(worst, 3.0 / N, "sphere of radius 3 at %g, n = %u: centre and semi-axes", far[f], n);
      batten_carrier_free(c);
    }
  const double line[6] = {0, 0, 1, 1, 2, 2}, plane[12] = {0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1};
  batten_carrier *c = NULL;
  T_STATUS(batten_carrier_fit(ctx, 2, 3, line, &c), BATTEN_E_SINGULAR, ctx, "flat across");
  T_STATUS(batten_carrier_fit(ctx, 3, 4, plane, &c), BATTEN_E_SINGULAR, ctx, "1)");
  T_STATUS(batten_carrier_fit(ctx, 3, 3, plane, &c), BATTEN_E_INVALID, ctx, "count: 3 points; at least 4");
  T_STATUS(batten_carrier_fit(ctx, 0, 3, plane, &c), BATTEN_E_INVALID, ctx, "n: 0");
  T_STATUS(batten_carrier_fit(ctx, 2, 3, NULL, &c), BATTEN_E_INVALID, ctx, "points: NULL");
  T_STATUS(batten_carrier_fit(ctx, 2, 3, (double[]){0, 0, 0, 1, INFINITY, 2}, &c), BATTEN_E_INVALID, ctx,
           "points[2]: coordinate 0 is inf");
  T_CHECK(c == NULL, "out untouched");
}

static void test_bad_input(batten_context *ctx) {
  batten_carrier *c = NULL, *two = NULL, *three = NULL;
  batten_carrier_ball(ctx, 2, origin, 1, &two);
  batten_carrier_ball(ctx, 3, origin, 1, &three);
  const double nan3[3] = {0, NAN, 0}, skew[4] = {1, 0, 0.1, 1};
  T_STATUS(batten_carrier_ball(ctx, 4, origin, 1, &c), BATTEN_E_INVALID, ctx, "n: 4");
  T_STATUS(batten_carrier_ball(ctx, 3, origin, 0, &c), BATTEN_E_INVALID, ctx, "radius: 0");
  T_STATUS(batten_carrier_ball(ctx, 3, origin, INFINITY, &c), BATTEN_E_INVALID, ctx, "radius: inf");
  T_STATUS(batten_carrier_ball(ctx, 3, nan3, 1, &c), BATTEN_E_INVALID, ctx, "center[1]: nan");
  T_STATUS(batten_carrier_ball(ctx, 3, NULL, 1, &c), BATTEN_E_INVALID, ctx, "center: NULL");
  T_STATUS(batten_carrier_ball(ctx, 3, origin, 1, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_STATUS(batten_carrier_ellipsoid(ctx, 3, origin, origin, NULL, &c), BATTEN_E_INVALID, ctx, "semi_axes[0]: 0");
  T_STATUS(batten_carrier_ellipsoid(ctx, 2, origin, (double[]){1, 1}, skew, &c), BATTEN_E_INVALID, ctx,
           "rotation: rows 0 and 1");
  T_STATUS(batten_carrier_box(ctx, 2, origin, (double[]){1, 2}, NULL, 1.5, &c), BATTEN_E_INVALID, ctx,
           "rounding: 1.5; give 0 to 1");
  T_STATUS(batten_carrier_box(ctx, 2, origin, (double[]){1, -2}, NULL, 0, &c), BATTEN_E_INVALID, ctx,
           "half_extents[1]: -2");
  T_STATUS(batten_carrier_cylinder(ctx, origin, origin, 1, 0, &c), BATTEN_E_INVALID, ctx, "two different ends");
  T_STATUS(batten_carrier_cylinder(ctx, origin, z_axis, 1, 0.6, &c), BATTEN_E_INVALID, ctx, "rounding: 0.6");
  T_STATUS(batten_carrier_torus(ctx, origin, origin, 2, 1, &c), BATTEN_E_INVALID, ctx, "axis: its length is 0");
  T_STATUS(batten_carrier_torus(ctx, origin, z_axis, 1, 2, &c), BATTEN_E_INVALID, ctx, "minor_radius: 2");
  T_STATUS(batten_carrier_half_space(ctx, 3, origin, nan3, &c), BATTEN_E_INVALID, ctx, "normal[1]: nan");
  T_STATUS(batten_carrier_union(ctx, two, three, 0, &c), BATTEN_E_INVALID, ctx, "b: of dimension 3 beside");
  T_STATUS(batten_carrier_union(ctx, two, two, -1, &c), BATTEN_E_INVALID, ctx, "alpha: -1");
  T_STATUS(batten_carrier_union(ctx, two, NULL, 0, &c), BATTEN_E_INVALID, ctx, "b: NULL");
  T_STATUS(batten_carrier_callback(ctx, NULL, 1, &c), BATTEN_E_INVALID, ctx, "field: NULL");
  batten_field field = {.dimension = 2, .order = 0, .evaluate = sick, .user = &field};
  T_STATUS(batten_carrier_callback(ctx, &field, 0, &c), BATTEN_E_INVALID, ctx, "difference_step: 0");
  field.order = 3;
  T_STATUS(batten_carrier_callback(ctx, &field, 1, &c), BATTEN_E_INVALID, ctx, "field->order: 3");
  field = (batten_field){.dimension = 7, .order = 0, .evaluate = sick};
  T_STATUS(batten_carrier_callback(ctx, &field, 1, &c), BATTEN_E_INVALID, ctx, "field->dimension: 7");
  field.evaluate = NULL;
  T_STATUS(batten_carrier_callback(ctx, &field, 1, &c), BATTEN_E_INVALID, ctx, "field->evaluate: NULL");
  T_STATUS(batten_carrier_solid(ctx, NULL, &c), BATTEN_E_INVALID, ctx, "solid: NULL");
  T_STATUS(batten_carrier_evaluate(ctx, NULL, 1, origin, NULL, NULL, NULL), BATTEN_E_INVALID, ctx, "carrier: NULL");
  T_STATUS(batten_carrier_evaluate(ctx, two, 1, NULL, NULL, NULL, NULL), BATTEN_E_INVALID, ctx, "points: NULL");
  batten_carrier_parts parts = {.kind = BATTEN_CARRIER_TORUS, .n = 2};
  T_STATUS(batten_carrier_create(ctx, &parts, &c), BATTEN_E_INVALID, ctx, "torus (5) in 2 dimensions");
  parts.kind = BATTEN_CARRIER_CALLBACK;
  T_STATUS(batten_carrier_create(ctx, &parts, &c), BATTEN_E_INVALID, ctx, "callback (9)");
  parts = (batten_carrier_parts){
      .kind = BATTEN_CARRIER_UNION, .n = 2, .parameters = origin, .parameter_count = 1, .children = {two, three}};
  T_STATUS(batten_carrier_create(ctx, &parts, &c), BATTEN_E_INVALID, ctx, "parts.children[1]: of dimension 3");
  parts = (batten_carrier_parts){.kind = BATTEN_CARRIER_BALL, .n = 2, .parameter_count = 3};
  T_STATUS(batten_carrier_create(ctx, &parts, &c), BATTEN_E_INVALID, ctx, "parts.parameters: NULL");
  parts = (batten_carrier_parts){.kind = BATTEN_CARRIER_SOLID, .n = 2};
  T_STATUS(batten_carrier_create(ctx, &parts, &c), BATTEN_E_INVALID, ctx, "solid: NULL");
  T_STATUS(batten_carrier_create(ctx, NULL, &c), BATTEN_E_INVALID, ctx, "parts: NULL");
  T_CHECK(c == NULL, "out is untouched by all of these");
  T_CHECK(!strcmp(batten_carrier_kind_name((batten_carrier_kind)99), "unknown"), "name of no kind");
  T_OK(batten_carrier_evaluate(ctx, two, 0, NULL, NULL, NULL, NULL), ctx);
  batten_carrier_free(two);
  batten_carrier_free(three);
  batten_carrier_free(NULL);
}

static batten_status call_composite(batten_context *ctx, void *arg) {
  batten_carrier *a = NULL, *b = NULL, *c = NULL;
  unsigned n = 3;
  batten_field field = {.dimension = 3, .order = 0, .evaluate = wavy, .user = &n};
  double f, g[3], h[9];
  (void)arg;
  batten_status st = batten_carrier_fit(ctx, 3, 4, (double[]){0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, &a);
  if (st >= 0) st = batten_carrier_callback(ctx, &field, 1e-3, &b);
  if (st >= 0) st = batten_carrier_union(ctx, a, b, 0, &c);
  if (st >= 0) st = batten_carrier_evaluate(ctx, c, 1, origin, &f, g, h);
  batten_carrier_free(a);
  batten_carrier_free(b);
  batten_carrier_free(c);
  return st;
}

int main(void) {
  make_turned();
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_values(ctx);
  test_derivatives(ctx);
  test_callback(ctx);
  test_sick_callback(ctx);
  test_r_functions(ctx);
  test_kink(ctx);
  test_depth(ctx);
  test_parts(ctx);
  test_fit(ctx);
  test_bad_input(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all released");
  batten_context_free(ctx);
  t_fail_every_allocation("carriers", call_composite, NULL);
  return t_done();
}
