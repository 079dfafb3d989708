/* Convex spline functions of scattered data: against solutions that are known, other routes, and invariances. Errors
 * and failures: test_convex_function_bad.c. */
#include <batten/convex.h>
#include <batten/qp.h>

#include "basis/bspline.h"
#include "convex/function_inner.h"
#include "tap.h"

enum { MOST = 2000 };

typedef double (*height)(double x, double y);

static double bowl(double x, double y) { return 2 * x * x + x * y + 1.5 * y * y - x + 3; }
static double hill(double x, double y) { return exp(x + 0.5 * y) + 0.5 * y * y; }
static double saddle(double x, double y) { return x * y; }
static double roof(double x, double y) { return fabs(x) + 0 * y; }
static double ripple(double x, double y) { return -sin(2 * 3.14159265358979323846 * x) * (1 + 0.2 * y); }
static double plane(double x, double y) { return 3 - 2 * x + y; }
static double wave(double x, double y) { return sin(3.14159265358979323846 * x) * (1 + 0.2 * y); }

/* Points over [-1, 1]^2. */
static void scatter(height f, size_t count, double noise, uint64_t seed, double *points) {
  for (size_t k = 0; k < count; k++) {
    double x = 2 * t_uniform(&seed) - 1, y = 2 * t_uniform(&seed) - 1;
    points[3 * k] = x;
    points[3 * k + 1] = y;
    points[3 * k + 2] = f(x, y) + noise * (2 * t_uniform(&seed) - 1);
  }
}

static batten_convex_function_options options(unsigned degree, unsigned spans) {
  batten_convex_function_options o = batten_convex_function_options_default();
  o.degree[0] = o.degree[1] = degree;
  o.spans[0] = o.spans[1] = spans;
  for (int i = 0; i < 2; i++) {
    o.domain[i][0] = -1;
    o.domain[i][1] = 1;
  }
  return o;
}

/* Least eigenvalue of the Hessian, times the sign of each span pair, over a grid of each; by evaluation. */
static double sampled_least(batten_context *ctx, const batten_surface *s, const batten_convex_function_options *o) {
  enum { GRID = 9 };
  double least = INFINITY;
  for (unsigned i = 0; i < o->spans[0]; i++)
    for (unsigned j = 0; j < o->spans[1]; j++)
      for (int g = 0; g < GRID * GRID; g++) {
        double sign = o->signs ? o->signs[i * o->spans[1] + j] : 1;
        double part[2] = {(i + (g / GRID + 0.5) / GRID) / o->spans[0], (j + (g % GRID + 0.5) / GRID) / o->spans[1]};
        double place[2] = {2 * part[0] - 1, 2 * part[1] - 1};
        batten_surface_point p;
        if (sign == 0 || batten_surface_evaluate(ctx, s, 1, place, &p) != BATTEN_OK) continue;
        double a = sign * p.duu[2], b = sign * p.duv[2], c = sign * p.dvv[2];
        least = fmin(least, (a + c) / 2 - hypot((a - c) / 2, b));
      }
  return least;
}

/* Weighted sum of squares by evaluation. */
static double squares(batten_context *ctx, const batten_surface *s, size_t count, const double *points) {
  double sum = 0;
  for (size_t k = 0; k < count; k++) {
    batten_surface_point p;
    if (batten_surface_evaluate(ctx, s, 1, points + 3 * k, &p) != BATTEN_OK) return NAN;
    sum += (p.point[2] - points[3 * k + 2]) * (p.point[2] - points[3 * k + 2]);
  }
  return sum;
}

static void exact_quadratic(batten_context *ctx) {
  double points[3 * 200];
  scatter(bowl, 200, 0, 1, points);
  batten_convex_function_options o = options(3, 3);
  o.tension = 0;
  batten_surface *s = NULL;
  batten_convex_function_info info;
  T_OK(batten_convex_function_fit(ctx, 200, points, &o, &s, NULL, &info), ctx);
  T_RATIO(info.max_error, 1e-12, "a convex quadratic is reproduced");
  T_CHECK(info.convexity.certified && info.slack == 0 && info.rounds == 0, "proven, and nothing had to be asked");
  T_CHECK(info.unknowns == 36 && info.lsq == info.lsq_unconstrained, "6 x 6 unknowns");
  double place[2] = {0.3, -0.7};
  batten_surface_point p;
  T_OK(batten_surface_evaluate(ctx, s, 1, place, &p), ctx);
  T_CHECK(fabs(p.point[0] - 0.3) < 1e-14 && fabs(p.point[1] + 0.7) < 1e-14, "u = x, v = y");
  T_RATIO(fabs(p.point[2] - bowl(0.3, -0.7)), 1e-12, "value between points");
  T_RATIO(fabs(p.duu[2] - 4) + fabs(p.duv[2] - 1) + fabs(p.dvv[2] - 3), 1e-9, "second derivatives");
  /* det / (1 + f_x^2 + f_y^2)^2: largest where the slope vanishes */
  T_CHECK(info.gauss_max > 9 && info.gauss_max < 11 + 1e-9, "Gaussian curvature near the bottom: %g", info.gauss_max);
  batten_surface_free(s);
}

/* What every fit has to say of itself. */
static void fit(batten_context *ctx, const char *what, height f, double noise, size_t count,
                const batten_convex_function_options *o) {
  static double points[3 * MOST];
  scatter(f, count, noise, 7, points);
  batten_surface *s = NULL, *u = NULL;
  batten_convex_function_info info;
  printf("# %s\n", what);
  T_OK(batten_convex_function_fit(ctx, count, points, o, &s, &u, &info), ctx);
  printf("# unknowns %zu, rounds %u, rows %zu, outer %zu; lsq %.9g, lower %.9g, unconstrained %.9g; slack %.3g\n",
         info.unknowns, info.rounds, info.rounds ? info.rows_per_round[info.rounds - 1] : 0, info.rows_outer,
         info.lsq, info.lsq_lower, info.lsq_unconstrained, info.slack);
  T_CHECK(info.convexity.certified, "proven");
  double gap = info.objective - info.objective_lower;
  T_RATIO(gap, o->gap_tol * info.objective_lower + 1e-11, "within the gap of the lower bound");
  T_CHECK(info.lsq_lower <= info.lsq && info.lsq >= info.lsq_unconstrained * (1 - 1e-5), "sums in their order");
  double least = sampled_least(ctx, s, o), sum = squares(ctx, s, count, points);
  if (info.slack == 0)
    T_CHECK(least > 0, "all sampled Hessians are definite: %.3g", least);
  else
    T_RATIO(-least, info.slack, "sampled Hessians");
  T_RATIO(fabs(sum - info.lsq), 1e-9 * info.lsq + 1e-21, "sum of squares by evaluation");
  T_RATIO(fabs(squares(ctx, u, count, points) - info.lsq_unconstrained), 1e-9 * info.lsq_unconstrained + 1e-21,
          "the same of the unconstrained");
  batten_surface_free(s);
  batten_surface_free(u);
}

static void fits(batten_context *ctx) {
  batten_convex_function_options o = options(3, 4);
  fit(ctx, "paraboloid", bowl, 0.1, 400, &o);
  fit(ctx, "hill", hill, 0.1, 400, &o);
  fit(ctx, "hill without noise", hill, 0, 400, &o);
  fit(ctx, "saddle", saddle, 0.1, 300, &o);
  fit(ctx, "roof", roof, 0.05, 400, &o);
  fit(ctx, "roof without noise", roof, 0, 400, &o);
  fit(ctx, "plane", plane, 0, 100, &o);
  fit(ctx, "plane with noise", plane, 0.01, 100, &o);
  fit(ctx, "five points", hill, 0, 5, &o);
  o = options(2, 5);
  fit(ctx, "biquadratic", hill, 0.1, 400, &o);
  o = options(5, 2);
  o.smoothness[0] = 2;
  fit(ctx, "degree 5", hill, 0.1, 400, &o);
  o = options(7, 1);
  fit(ctx, "degree 7, where the Hessian dips between few places", saddle, 0.1, 400, &o);
  o = options(3, 6);
  o.smoothness[0] = o.smoothness[1] = 1;
  fit(ctx, "C1", hill, 0.1, 800, &o);
}

static void signs(batten_context *ctx) {
  batten_convex_function_options o = options(3, 4);
  signed char half[16], part[16], none[16] = {0};
  for (int k = 0; k < 16; k++) {
    half[k] = k / 4 < 2 ? 1 : -1;
    part[k] = k / 4 < 2 ? 1 : 0;
  }
  o.signs = half;
  o.gap_tol = 3e-3;
  fit(ctx, "convex half, concave half", wave, 0.05, 400, &o);
  o.smoothness[0] = 1;
  fit(ctx, "with jumps of second derivatives", wave, 0.05, 400, &o);
  o.smoothness[0] = 0;
  o.signs = part;
  fit(ctx, "convex half, free half", wave, 0.05, 400, &o);
  o.signs = none;
  double points[3 * 300];
  scatter(wave, 300, 0.05, 3, points);
  batten_surface *s = NULL;
  batten_convex_function_info info;
  T_OK(batten_convex_function_fit(ctx, 300, points, &o, &s, NULL, &info), ctx);
  T_CHECK(info.lsq == info.lsq_unconstrained && info.objective == info.objective_lower,
          "nothing asked: unconstrained");
  batten_surface_free(s);
}

/* Opposite signs at both ends of spans, around one span pair, and apart: what is best is not always flat. */
static void sign_patterns(batten_context *ctx) {
  batten_convex_function_options o = options(2, 4);
  signed char stripes[16], apart[16], checker[16];
  for (int k = 0; k < 16; k++) {
    stripes[k] = k / 4 % 2 ? -1 : 1;
    apart[k] = k / 4 == 0 ? -1 : k / 4 == 3 ? 1 : 0;
    checker[k] = (k / 4 + k % 4) % 2 ? -1 : 1;
  }
  o.signs = stripes;
  fit(ctx, "biquadratic stripes", ripple, 0.05, 600, &o);
  o.signs = apart;
  fit(ctx, "convex and concave, free between", ripple, 0.05, 600, &o);
  /* With opposite signs on all four sides of span pairs and C1 only the plane is left. */
  static double points[3 * MOST];
  scatter(saddle, 600, 0.05, 7, points);
  o.signs = checker;
  batten_surface *s = NULL;
  batten_convex_function_info info;
  T_OK(batten_convex_function_fit(ctx, 600, points, &o, &s, NULL, &info), ctx);
  const double *c = batten_surface_get(s).control_points;
  T_RATIO(fabs(c[2] - c[5] - c[3 * 30 + 2] + c[3 * 31 + 2]), 1e-6, "the plane");
  T_RATIO(info.objective - info.objective_lower, 1e-6 * info.objective, "and nothing is better");
  batten_surface_free(s);
}

/* Far from the origin, where coordinates have few digits left, the fit is the same; and data on a plane stay on it.
 */
static void far_away(batten_context *ctx) {
  enum { N = 300 };
  double points[3 * N];
  batten_convex_function_options o = options(3, 4);
  batten_surface *s = NULL;
  batten_convex_function_info near, far;
  scatter(hill, N, 0.1, 1, points);
  T_OK(batten_convex_function_fit(ctx, N, points, &o, &s, NULL, &near), ctx);
  batten_surface_free(s);
  for (int k = 0; k < 3 * N; k++) points[k] += 1e8;
  for (int k = 0; k < 4; k++) o.domain[k / 2][k % 2] += 1e8;
  T_OK(batten_convex_function_fit(ctx, N, points, &o, &s, NULL, &far), ctx);
  T_RATIO(fabs(far.lsq - near.lsq), 2e-3 * near.lsq, "sum of squares 1e8 away");
  batten_surface_free(s);
  o = options(3, 4);
  scatter(plane, N, 0, 1, points);
  for (int k = 0; k < N; k++) points[3 * k + 2] += 1e6;
  T_OK(batten_convex_function_fit(ctx, N, points, &o, &s, NULL, &far), ctx);
  T_RATIO(far.max_error, 1e-10 * 1e6, "error of a plane that is 1e6 high");
  batten_surface_free(s);
}

/* Data that are the same for all y: the best convex spline is one in x alone, since the mean over the points' y of
 * any other is convex, too, and no worse. f'' of a cubic spline is linear on spans: f'' >= 0 at the knots is all. */
static void one_dimension(batten_context *ctx) {
  enum { X = 40, Y = 9 };
  double points[3 * X * Y], design[X * 9], z[X], rows[6 * 9] = {0};
  uint64_t seed = 5;
  double knots[20];
  bspline b = {3, 8, knots};
  bspline_make_knots(3, 2, 5, NULL, -1, 1, knots);
  memset(design, 0, sizeof design);
  for (size_t i = 0; i < X; i++) {
    double x = -1 + 2.0 * (double)i / (X - 1), table[4];
    z[i] = fabs(x - 0.2) + 0.2 * t_uniform(&seed);
    size_t mu = bspline_span(&b, x);
    bspline_basis(&b, mu, x, 0, table);
    for (size_t j = 0; j < 4; j++) design[i * 8 + mu - 3 + j] = table[j];
    for (size_t j = 0; j < Y; j++) {
      double p[3] = {x, -1 + 2.0 * (double)j / (Y - 1), z[i]};
      memcpy(points + 3 * (i * Y + j), p, sizeof p);
    }
  }
  for (size_t k = 0; k < 6; k++) {
    double at = -1 + 0.4 * (double)k, table[12];
    size_t mu = bspline_span(&b, at);
    bspline_basis(&b, mu, at, 2, table);
    for (size_t j = 0; j < 4; j++) rows[k * 8 + mu - 3 + j] = table[8 + j];
  }
  batten_matrix a = batten_matrix_dense(X, 8, design), c = batten_matrix_dense(6, 8, rows);
  double lower[6] = {0};
  batten_qp_problem problem = batten_qp_problem_default(8);
  problem.a = &a;
  problem.b = z;
  problem.c = &c;
  problem.lower = lower;
  batten_qp_info best;
  T_OK(batten_qp_solve(ctx, &problem, NULL, NULL, NULL, &best), ctx);
  batten_convex_function_options o = options(3, 5);
  o.spans[1] = 2;
  o.tension = 0;
  o.gap_tol = 1e-4;
  batten_surface *s = NULL;
  batten_convex_function_info info;
  T_OK(batten_convex_function_fit(ctx, X * Y, points, &o, &s, NULL, &info), ctx);
  double sum = 2 * best.objective * Y;
  T_CHECK(info.lsq_lower <= sum * (1 + 1e-9), "the lower bound is below the best in one variable: %.9g, %.9g",
          info.lsq_lower, sum);
  T_RATIO(fabs(info.lsq - sum), 1.1e-4 * sum, "sum of squares against that of one variable");
  T_RATIO(sum - info.lsq_lower, 1.1e-4 * sum, "lower bound against it");
  batten_surface_free(s);
}

/* Numbers of SciPy's LSQBivariateSpline (FITPACK) for the same points and knots. */
static void unconstrained(batten_context *ctx) {
  enum { N = 300 };
  double points[3 * N], breaks_x[3] = {0.25, 0.5, 0.75}, breaks_y[2] = {1.0 / 3, 2.0 / 3}, whole;
  for (int k = 0; k < N; k++) {
    double x = modf((k + 1) * 0.7548776662466927, &whole), y = modf((k + 1) * 0.5698402909980532, &whole);
    double p[3] = {x, y, sin(3 * x) * (1 + y) + y * y * x};
    memcpy(points + 3 * k, p, sizeof p);
  }
  batten_convex_function_options o = batten_convex_function_options_default();
  o.degree[1] = 2;
  o.break_count[0] = 3;
  o.break_count[1] = 2;
  o.breaks[0] = breaks_x;
  o.breaks[1] = breaks_y;
  o.domain[0][0] = o.domain[1][0] = 0;
  o.domain[0][1] = o.domain[1][1] = 1;
  o.tension = 0;
  batten_surface *s = NULL, *u = NULL;
  batten_convex_function_info info;
  T_OK(batten_convex_function_fit(ctx, N, points, &o, &s, &u, &info), ctx);
  T_RATIO(fabs(info.lsq_unconstrained - 4.276080383038698e-05), 1e-13, "sum of squares of FITPACK");
  double places[6] = {0.1, 0.2, 0.5, 0.5, 0.9, 0.7};
  double values[3] = {0.3584470768197261, 1.622050104856101, 1.1672360186647577};
  batten_surface_point p[3];
  T_OK(batten_surface_evaluate(ctx, u, 3, places, p), ctx);
  for (int k = 0; k < 3; k++) T_RATIO(fabs(p[k].point[2] - values[k]), 1e-11, "value of FITPACK at place %d", k);
  batten_surface_free(s);
  batten_surface_free(u);
}

static void invariances(batten_context *ctx) {
  enum { N = 250 };
  double points[3 * N], other[3 * N];
  batten_convex_function_options o = options(3, 3);
  signed char minus[9];
  memset(minus, -1, sizeof minus);
  scatter(hill, N, 0.2, 11, points);
  batten_surface *s = NULL, *t = NULL;
  batten_convex_function_info a, b;
  T_OK(batten_convex_function_fit(ctx, N, points, &o, &s, NULL, &a), ctx);
  const double *x = batten_surface_get(s).control_points, *y;

  memcpy(other, points, sizeof points);
  for (int k = 0; k < N; k++) other[3 * k + 2] = -points[3 * k + 2];
  o.signs = minus;
  T_OK(batten_convex_function_fit(ctx, N, other, &o, &t, NULL, &b), ctx);
  y = batten_surface_get(t).control_points;
  bool same = true;
  for (int k = 0; k < 36; k++) same = same && y[3 * k + 2] == -x[3 * k + 2];
  T_CHECK(same && a.lsq == b.lsq && b.convexity.sign == -1, "concave is minus convex, to the bit");
  batten_surface_free(t);
  o.signs = NULL;

  for (int k = 0; k < N; k++) other[3 * k + 2] = 0x1p-30 * points[3 * k + 2];
  T_OK(batten_convex_function_fit(ctx, N, other, &o, &t, NULL, &b), ctx);
  y = batten_surface_get(t).control_points;
  for (int k = 0; k < 36; k++) same = same && y[3 * k + 2] == 0x1p-30 * x[3 * k + 2];
  T_CHECK(same && b.lsq == 0x1p-60 * a.lsq, "z times a power of two, to the bit");
  batten_surface_free(t);

  for (int k = 0; k < N; k++) {
    other[3 * k] = points[3 * k + 1];
    other[3 * k + 1] = points[3 * k];
    other[3 * k + 2] = points[3 * k + 2];
  }
  T_OK(batten_convex_function_fit(ctx, N, other, &o, &t, NULL, &b), ctx);
  T_RATIO(fabs(a.lsq - b.lsq), 2e-3 * a.lsq, "x and y exchanged: sum of squares");
  T_RATIO(fabs(a.lsq_unconstrained - b.lsq_unconstrained), 1e-10 * a.lsq, "the same of the unconstrained");
  batten_surface_free(t);

  double weights[N];
  for (int k = 0; k < N; k++) weights[k] = k < 200;
  batten_surface *u = NULL;
  o.weights = weights;
  T_OK(batten_convex_function_fit(ctx, N, points, &o, &t, NULL, &a), ctx);
  o.weights = NULL;
  T_OK(batten_convex_function_fit(ctx, 200, points, &o, &u, NULL, &b), ctx);
  T_RATIO(fabs(a.lsq - b.lsq), 1e-9 * a.lsq, "weights of 0 and no points");
  batten_surface_free(u);
  batten_surface_free(t);
  batten_surface_free(s);
}

/* Programs of both kinds, with one thread and with four. */
static void threads(batten_context *ctx) {
  enum { N = 400 };
  double points[3 * N];
  signed char half[16];
  for (int k = 0; k < 16; k++) half[k] = k / 4 < 2 ? 1 : -1;
  scatter(wave, N, 0.05, 7, points);
  batten_convex_function_options o = options(3, 4);
  o.signs = half;
  o.rounds = 2;
  batten_context *four = t_context(NULL, NULL, 4);
  batten_surface *s[2] = {NULL, NULL};
  for (int k = 0; k < 2; k++)
    T_CHECK(batten_convex_function_fit(k ? four : ctx, N, points, &o, &s[k], NULL, NULL) >= 0, "fitted");
  const double *x[2] = {batten_surface_get(s[0]).control_points, batten_surface_get(s[1]).control_points};
  T_CHECK(memcmp(x[0], x[1], 3 * 49 * sizeof(double)) == 0, "same bits with four threads");
  batten_surface_free(s[0]);
  batten_surface_free(s[1]);
  batten_context_free(four);
}

/* The sufficient inequalities alone: sums fall with the rounds, down to the lower bound. */
static void asymptotics(batten_context *ctx) {
  enum { N = 300, SPANS = 3 };
  double points[3 * N], knots[16], weights[N], x[36], free_x[36];
  signed char one[SPANS * SPANS];
  size_t span[2][SPANS];
  memset(one, 1, sizeof one);
  scatter(saddle, N, 0.1, 13, points);
  for (int k = 0; k < N; k++) {
    weights[k] = 1.0 / N;
    for (int i = 0; i < 2; i++) points[3 * k + i] = (points[3 * k + i] + 1) / 2;
  }
  bspline_make_knots(3, 2, SPANS, NULL, 0, 1, knots);
  bspline axis = {3, 6, knots};
  function_space space = {.spline = {{axis, axis}},
                          .smoothness = {2, 2},
                          .n = 36,
                          .spans = {SPANS, SPANS},
                          .span = {span[0], span[1]},
                          .signs = one};
  for (size_t k = 0; k < SPANS; k++) span[0][k] = span[1][k] = 3 + k;
  function_terms terms;
  T_OK(function_terms_make(ctx, &space, N, points, weights, 1e-8, &terms), ctx);
  function_rounds_options o = {7, 1e-7, 0, 1e-12, true};
  function_rounds_info info;
  T_OK(function_rounds(ctx, &space, &terms, &o, x, free_x, &info), ctx);
  bool falls = true;
  for (unsigned k = 0; k < info.rounds; k++) {
    printf("# round %u: %zu rows, gap %.3g\n", k, info.rows[k], info.upper[k] / info.lower - 1);
    falls = falls && (k == 0 || info.upper[k] <= info.upper[k - 1]);
  }
  T_CHECK(falls, "objectives never rise");
  T_CHECK(info.upper[0] > info.lower * 1.001, "at first they are not at the bound: %.3g",
          info.upper[0] / info.lower - 1);
  T_RATIO(info.objective / info.lower - 1, 3e-4, "in the end they are: gap");
  T_CHECK(info.objective >= info.lower, "above it");
  function_terms_free(ctx, &terms);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  exact_quadratic(ctx);
  fits(ctx);
  signs(ctx);
  sign_patterns(ctx);
  far_away(ctx);
  one_dimension(ctx);
  unconstrained(ctx);
  invariances(ctx);
  threads(ctx);
  asymptotics(ctx);
  batten_context_free(ctx);
  return t_done();
}
