/* Parameter correction of curves: kernel/contour/correct.c. */
#include "contour/contour_inner.h"
#include "tap.h"

enum { KNOTS = 100, COUNT = 1000 };

typedef struct rig {
  double knots[KNOTS], control[2 * KNOTS];
  bspline b;
  bool closed;
  double points[2 * COUNT], t[COUNT], squares[COUNT], start[COUNT], before[COUNT];
  contour_data data;
} rig;

/* By the blossom's rows: another way than that of the library's steps. */
static void point_at(const rig *r, double t, double x[2]) {
  double rows[BSPLINE_ORDER * BSPLINE_ORDER];
  size_t mu = bspline_span(&r->b, t);
  bspline_rows(&r->b, mu, 0, t, t, rows);
  x[0] = x[1] = 0;
  for (size_t j = 0; j <= r->b.degree; j++)
    for (size_t k = 0; k < 2; k++) x[k] += rows[j] * r->control[2 * (mu - r->b.degree + j) + k];
}

static double square_at(const rig *r, double t, const double *p) {
  double x[2];
  point_at(r, t, x);
  return (x[0] - p[0]) * (x[0] - p[0]) + (x[1] - p[1]) * (x[1] - p[1]);
}

/* A lively curve, or a closed one (C^1: the ends' control points are in line), and points about it whose parameters
 * are off. */
static void make_rig(rig *r, unsigned degree, unsigned smoothness, bool closed, double away, double off) {
  enum { SPANS = 9 };
  uint64_t seed = degree + 10 * smoothness;
  size_t n = bspline_make_knots(degree, smoothness, SPANS, NULL, 0, 1, r->knots);
  r->b = (bspline){degree, n - degree - 1, r->knots};
  r->closed = closed;
  n = r->b.count;
  for (size_t i = 0; i < n; i++) {
    double a = (closed ? 6.283185307 : 5) * (double)i / (double)(n - 1);
    r->control[2 * i] = 3 * cos(a) + 3 * t_uniform(&seed) / (double)n;
    r->control[2 * i + 1] = 2 * sin(a) + 3 * t_uniform(&seed) / (double)n;
  }
  if (closed)
    for (size_t k = 0; k < 2; k++)
      r->control[k] = r->control[2 * (n - 1) + k] = (r->control[2 + k] + r->control[2 * (n - 2) + k]) / 2;
  for (size_t i = 0; i < COUNT; i++) {
    double t = (double)i / (COUNT - 1), x[2];
    point_at(r, t, x);
    for (size_t k = 0; k < 2; k++) r->points[2 * i + k] = x[k] + away * (2 * t_uniform(&seed) - 1);
    t += off * (2 * t_uniform(&seed) - 1);
    if (closed) t -= floor(t);
    r->t[i] = r->start[i] = fmin(fmax(t, 0), 1);
    r->before[i] = square_at(r, r->t[i], r->points + 2 * i);
  }
  r->data = (contour_data){COUNT, r->points, NULL};
}

static void check_steps(batten_context *ctx, unsigned degree, unsigned smoothness, bool closed) {
  rig *r = malloc(sizeof *r);
  make_rig(r, degree, smoothness, closed, 0.2, 0.05);
  double last[COUNT], rise = 0, wrong = 0, slope = 0;
  memcpy(last, r->before, sizeof last);
  bool inside = true;
  for (unsigned pass = 0; pass < 25; pass++) { /* in single passes: none may raise a distance */
    contour_correct(ctx, &r->b, closed, r->control, &r->data, 1, r->t, r->squares);
    for (size_t i = 0; i < COUNT; i++) {
      rise = fmax(rise, (r->squares[i] - last[i]) / (1e-30 + last[i]));
      wrong = fmax(wrong, fabs(r->squares[i] - square_at(r, r->t[i], r->points + 2 * i)));
      inside = inside && r->t[i] >= 0 && r->t[i] <= 1;
    }
    memcpy(last, r->squares, sizeof last);
  }
  size_t round = 0, held = 0;
  for (size_t i = 0; i < COUNT; i++) { /* a step of the place either way leads no nearer */
    const double h = 1e-5;
    double t = r->t[i], left = t - h, right = t + h;
    if (closed) {
      left -= floor(left);
      right -= floor(right);
    }
    if (!closed) held += t == 0 || t == 1;
    if (!closed && (t == 0 || t == 1) && (i == 0 || i + 1 == COUNT)) continue; /* these stay */
    round += fabs(t - r->start[i]) > 0.5;
    for (int side = 0; side < 2; side++) {
      double at = side ? right : left;
      if (at >= 0 && at <= 1) slope = fmax(slope, r->squares[i] - square_at(r, at, r->points + 2 * i));
    }
  }
  T_RATIO(rise, 1e-12, "degree %u, C^%u, %s: no distance rises", degree, smoothness, closed ? "closed" : "open");
  T_RATIO(wrong, 1e-14, "squares are those of the new places");
  T_RATIO(slope, 1e-9, "and no neighbour is nearer");
  T_CHECK(inside, "all places are inside");
  T_CHECK(closed ? round > 5 : held > 0, "%zu went over the end of the closed curve, %zu are held by ends", round,
          held);
  free(r);
}

/* Points of the curve come back to it from nearby, in three steps. */
static void check_return(batten_context *ctx, unsigned degree) {
  rig *r = malloc(sizeof *r);
  make_rig(r, degree, degree > 2 ? 2 : 1, false, 0, 0.01);
  contour_correct(ctx, &r->b, false, r->control, &r->data, 5, r->t, r->squares);
  double most = 0;
  for (size_t i = 0; i < COUNT; i++) most = fmax(most, fabs(r->t[i] - (double)i / (COUNT - 1)));
  T_RATIO(most, 1e-11, "degree %u: points of the curve find their parameters", degree);
  make_rig(r, degree, degree > 2 ? 2 : 1, false, 0.1, 0.01);
  contour_correct(ctx, &r->b, false, r->control, &r->data, 0, r->t, r->squares);
  double wrong = 0;
  for (size_t i = 0; i < COUNT; i++) wrong = fmax(wrong, fabs(r->squares[i] - r->before[i]));
  T_CHECK(memcmp(r->t, r->start, sizeof r->t) == 0, "no pass moves nothing");
  T_RATIO(wrong, 1e-14, "and tells squares");
  free(r);
}

/* The first and last points stay at the ends of an open curve, also where places inside are nearer; their squares are
 * told. From inside they move, and those of a closed curve do. */
static void test_held(batten_context *ctx) {
  const double knots[] = {0, 0, 0, 1, 1, 1}, control[] = {-1, 1, 0, -1, 1, 1}; /* x = 2 t - 1, y = x^2 */
  const bspline b = {2, 3, knots};
  const double points[] = {-0.5, 0.25, -0.5, 0.25, 0.5, 0.25, 0.5, 0.25};
  contour_data data = {4, points, NULL};
  for (int way = 0; way < 3; way++) {
    double t[] = {0, 0, 1, 1}, squares[4];
    if (way == 1) t[0] = 0.01, t[3] = 0.99;
    contour_correct(ctx, &b, way == 2, control, &data, 20, t, squares);
    double first = way ? 0.25 : 0, square = way ? 0 : 0.8125; /* (-1, 1) - (-0.5, 0.25) */
    T_RATIO(fabs(t[0] - first) + fabs(t[3] - 1 + first), 1e-12, "%s: the first and last points' places",
            way == 0 ? "at the ends they stay" : way == 1 ? "from inside they move" : "closed: they move");
    T_RATIO(fabs(squares[0] - square) + fabs(squares[3] - square), 1e-12, "their squares");
    T_RATIO(fabs(t[1] - 0.25) + fabs(t[2] - 0.75), 1e-12, "others leave the ends");
  }
}

/* By hand: the parabola (t, t^2), and a point right above its lowest place. */
static void test_by_hand(batten_context *ctx) {
  const double knots[] = {0, 0, 0, 1, 1, 1}, control[] = {-1, 1, 0, -1, 1, 1}; /* x = 2 t - 1, y = x^2 */
  const bspline b = {2, 3, knots};
  const double points[] = {0.1, 0.25, 5, 1, -3, -9, 0, 2};
  double t[] = {0.3, 0.9, 0.1, 0.5}, squares[4];
  contour_data data = {4, points, NULL};
  contour_correct(ctx, &b, false, control, &data, 20, t, squares);
  double x = 2 * t[0] - 1; /* x - 0.1 + 2 x (x^2 - 0.25) = 0 */
  T_RATIO(fabs(x - 0.1 + 2 * x * (x * x - 0.25)), 1e-14, "parabola: the nearest place");
  T_CHECK(t[1] == 1 && squares[1] == 16, "beyond the end: %g, %g", t[1], squares[1]);
  T_CHECK(t[3] == 0.5 && squares[3] == 4, "a place that is stationary stays: %g", t[3]);
  const double dot[] = {1, 1, 1, 1, 1, 1};
  t[0] = 0.3;
  contour_correct(ctx, &b, false, dot, &data, 3, t, squares);
  T_CHECK(t[0] == 0.3, "a curve that is a point moves nothing");
}

static void test_threads(void) {
  rig *one = malloc(sizeof *one), *many = malloc(sizeof *many);
  make_rig(one, 4, 2, true, 0.2, 0.05);
  make_rig(many, 4, 2, true, 0.2, 0.05);
  batten_context *first = t_context(NULL, NULL, 1), *second = t_context(NULL, NULL, 4);
  contour_correct(first, &one->b, true, one->control, &one->data, 3, one->t, one->squares);
  contour_correct(second, &many->b, true, many->control, &many->data, 3, many->t, many->squares);
  T_CHECK(!memcmp(one->t, many->t, sizeof one->t) && !memcmp(one->squares, many->squares, sizeof one->squares),
          "4 threads: same bits");
  batten_context_free(first);
  batten_context_free(second);
  free(one);
  free(many);
}

static void test_time(batten_context *ctx) {
  enum { N = 100000, SPANS = 2000 };
  double *knots = malloc((SPANS + 8) * sizeof *knots), *control = malloc(2 * (SPANS + 8) * sizeof *control);
  double *points = malloc(2 * N * sizeof *points), *t = malloc(N * sizeof *t), *squares = malloc(N * sizeof *squares);
  uint64_t seed = 1;
  bspline b = {3, bspline_make_knots(3, 2, SPANS, NULL, 0, 1, knots) - 4, knots};
  for (size_t i = 0; i < b.count; i++) {
    control[2 * i] = (double)i / (double)b.count;
    control[2 * i + 1] = sin(20 * control[2 * i]);
  }
  for (size_t i = 0; i < N; i++) {
    t[i] = (double)i / (N - 1);
    points[2 * i] = t[i] + 1e-3 * t_uniform(&seed);
    points[2 * i + 1] = sin(20 * t[i]) + 1e-3 * t_uniform(&seed);
  }
  contour_data data = {N, points, NULL};
  double start = batten_now();
  contour_correct(ctx, &b, false, control, &data, 3, t, squares);
  printf("# %d points, 3 passes: %.1f ms on one thread\n", N, 1e3 * (batten_now() - start));
  double most = 0;
  for (size_t i = 0; i < N; i++) most = fmax(most, squares[i]);
  T_CHECK(most < 1e-4, "all are near: %g", sqrt(most));
  free(knots), free(control), free(points), free(t), free(squares);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_by_hand(ctx);
  test_held(ctx);
  for (unsigned degree = 2; degree <= 9; degree++)
    for (unsigned smoothness = 1; smoothness <= 2 && smoothness < degree; smoothness++)
      for (int closed = 0; closed < 2; closed++) check_steps(ctx, degree, smoothness, closed);
  for (unsigned degree = 2; degree <= 9; degree++) check_return(ctx, degree);
  test_threads();
  test_time(ctx);
  batten_context_free(ctx);
  return t_done();
}
