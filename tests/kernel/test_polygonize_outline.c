/* Outlines of plane solids: area, length, orientation, spacing, clipping, refusals. */
#include <batten/mesh.h>

#include "tap.h"

typedef double (*plane_function)(const double *x, double *g);

typedef struct plane {
  plane_function function;
  size_t points, nan_at, fail_at, calls;
} plane;

static batten_status plane_evaluate(const void *user, batten_context *ctx, size_t count, const double *points,
                                    double *values, double *gradients, double *hessians) {
  plane *p = (plane *)(uintptr_t)user;
  (void)hessians;
  if (++p->calls == p->fail_at) return batten_fail(ctx, BATTEN_E_SINGULAR, "the field fails at call %zu", p->calls);
  for (size_t i = 0; i < count; i++) {
    double g[2];
    values[i] = p->function(points + 2 * i, g);
    if (++p->points == p->nan_at) values[i] = NAN;
    if (gradients) memcpy(gradients + 2 * i, g, sizeof g);
  }
  return BATTEN_OK;
}

static double disk_at(const double *x, double a, double r, double *g) {
  g[0] = -2 * (x[0] - a);
  g[1] = -2 * x[1];
  return r * r - (x[0] - a) * (x[0] - a) - x[1] * x[1];
}
static double disk(const double *x, double *g) { return disk_at(x, 0, 1, g); }
static double two_disks(const double *x, double *g) {
  double h[2], a = disk_at(x, -1.5, 1, g), b = disk_at(x, 1.5, 0.5, h);
  if (b > a) memcpy(g, h, sizeof h);
  return b > a ? b : a;
}
static double annulus(const double *x, double *g) {
  double h[2], a = disk_at(x, 0, 1, g), b = -disk_at(x, 0, 0.5, h);
  if (b < a) {
    g[0] = -h[0];
    g[1] = -h[1];
  }
  return b < a ? b : a;
}
static double square(const double *x, double *g) {
  int k = fabs(x[1]) > fabs(x[0]);
  g[k] = -copysign(1, x[k]);
  g[1 - k] = 0;
  return 1 - fabs(x[k]);
}
static double nowhere(const double *x, double *g) {
  g[0] = g[1] = 0;
  return -1 - x[0] * x[0];
}

static batten_context *ctx;
static const double some_seeds[10] = {-1, 0.01, 1, 0.02, 0, 0.5, 0, -0.5, -2.5, 0.1};

static batten_polygonize_options options(double cell) {
  batten_polygonize_options o = batten_polygonize_options_default();
  o.cell = cell;
  o.lower[0] = o.lower[1] = -3;
  o.upper[0] = o.upper[1] = 3.1;
  return o;
}

static batten_outline *trace(plane_function function, unsigned order, double cell, batten_polygonize_info *info) {
  plane p = {.function = function};
  batten_field field = {.dimension = 2, .order = order, .evaluate = plane_evaluate, .user = &p};
  batten_polygonize_options o = options(cell);
  batten_outline *outline = NULL;
  T_OK(batten_trace_outline(ctx, &field, 5, some_seeds, &o, &outline, info), ctx);
  T_CHECK(info->evaluations == p.points, "%zu evaluations counted", p.points);
  return outline;
}

/* Ratio of the longest piece to the shortest. */
static double spread(const batten_outline *outline) {
  double shortest = INFINITY, longest = 0;
  for (size_t l = 0; l < batten_outline_loop_count(outline); l++) {
    size_t n;
    int closed;
    const double *p = batten_outline_loop(outline, l, &n, &closed);
    for (size_t i = closed ? 0 : 1; i < n; i++) {
      const double *a = p + 2 * (i ? i - 1 : n - 1), *b = p + 2 * i;
      double length = hypot(a[0] - b[0], a[1] - b[1]);
      shortest = fmin(shortest, length);
      longest = fmax(longest, length);
    }
  }
  return longest / shortest;
}

static void test_figures(void) {
  const double pi = acos(-1);
  const struct {
    const char *name;
    plane_function function;
    size_t loops;
    double area, length;
  } cases[] = {{"disk", disk, 1, pi, 2 * pi},
               {"two disks", two_disks, 2, pi * 1.25, 3 * pi},
               {"annulus", annulus, 2, pi * 0.75, 3 * pi},
               {"square", square, 1, 4, 8}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
    for (unsigned order = 0; order < 2; order++) {
      batten_polygonize_info info;
      batten_outline *o = trace(cases[i].function, order, 0.05, &info);
      size_t loops = batten_outline_loop_count(o);
      T_CHECK(loops == cases[i].loops, "%s: %zu loops", cases[i].name, loops);
      /* Chords of length c on radius r lose c^2 / (6 r^2) of the area; corners of the square lose up to c^2 / 2. */
      T_RATIO(fabs(batten_outline_area(o) - cases[i].area), 0.05 * 0.05 * 2, "%s: area", cases[i].name);
      T_RATIO(fabs(batten_outline_length(o) - cases[i].length), 0.05 * 4, "%s: length", cases[i].name);
      T_RATIO(info.distance_max, 1e-6 * sqrt(2.0) * 6.1, "%s: distance from f = 0", cases[i].name);
      T_RATIO(spread(o), 1.5, "%s: longest over shortest piece", cases[i].name);
      bool closed = true;
      for (size_t l = 0; l < loops; l++) {
        int c;
        batten_outline_loop(o, l, NULL, &c);
        closed = closed && c;
      }
      T_CHECK(closed && !info.clipped && info.seeds_missed + loops <= 5, "%s: closed", cases[i].name);
      T_CHECK(!batten_outline_loop(o, loops, NULL, NULL), "%s: no more loops", cases[i].name);
      batten_outline_free(o);
    }
  batten_outline_free(NULL);
}

/* The ring's inner loop runs clockwise: the solid on its left. */
static void test_orientation(void) {
  batten_polygonize_info info;
  batten_outline *o = trace(annulus, 1, 0.1, &info);
  for (size_t l = 0; l < 2; l++) {
    size_t n;
    const double *p = batten_outline_loop(o, l, &n, NULL);
    double area = 0, r = hypot(p[0], p[1]);
    for (size_t i = 0; i < n; i++) {
      const double *a = p + 2 * i, *b = p + 2 * ((i + 1) % n);
      area += 0.5 * (a[0] * b[1] - a[1] * b[0]);
    }
    T_CHECK(r > 0.75 ? area > 3 : area < -0.7, "loop of radius %.2f has the area %.3f", r, area);
  }
  batten_outline_free(o);
}

static void test_convergence(void) {
  double error[3];
  for (int i = 0; i < 3; i++) {
    batten_polygonize_info info;
    batten_outline *o = trace(disk, 1, ldexp(0.2, -i), &info);
    error[i] = fabs(batten_outline_area(o) - acos(-1));
    batten_outline_free(o);
  }
  for (int i = 0; i < 2; i++) {
    double order = log2(error[i] / error[i + 1]);
    T_CHECK(fabs(order - 2) < 0.3, "order %.2f of the disk's area, expected 2", order);
  }
}

static void test_clipped(void) {
  plane p = {.function = disk};
  batten_field field = {.dimension = 2, .order = 1, .evaluate = plane_evaluate, .user = &p};
  batten_polygonize_options o = options(0.05);
  o.lower[0] = -0.5;
  batten_outline *outline = NULL;
  batten_polygonize_info info;
  T_STATUS(batten_trace_outline(ctx, &field, 5, some_seeds, &o, &outline, &info), BATTEN_W_CLIPPED, ctx, "opt.lower");
  size_t n;
  int closed;
  const double *v = batten_outline_loop(outline, 0, &n, &closed);
  T_CHECK(batten_outline_loop_count(outline) == 1 && !closed && info.clipped && info.seeds_missed == 4,
          "one open chain; seeds outside and far from the outline are missed: %zu", info.seeds_missed);
  T_CHECK(v[0] == -0.5 && v[2 * (n - 1)] == -0.5, "its ends lie on the box");
  T_RATIO(fabs(v[1] + sqrt(0.75)) + fabs(v[2 * n - 1] - sqrt(0.75)), 4e-5,
          "and on the circle, the solid on the left");
  T_CHECK(isnan(batten_outline_area(outline)), "no area");
  T_RATIO(fabs(batten_outline_length(outline) - 4 * acos(-1) / 3), 1e-3, "length");
  batten_outline_free(outline);
}

static void test_refusals(void) {
  plane p = {.function = disk};
  batten_field field = {.dimension = 2, .order = 1, .evaluate = plane_evaluate, .user = &p},
               solid = {.dimension = 3, .order = 1, .evaluate = plane_evaluate, .user = &p};
  batten_polygonize_options o = options(0.05);
  batten_outline *out = NULL;
  T_CHECK(batten_trace_outline(NULL, &field, 5, some_seeds, &o, &out, NULL) == BATTEN_E_INVALID, "no context");
  T_STATUS(batten_trace_outline(ctx, NULL, 5, some_seeds, &o, &out, NULL), BATTEN_E_INVALID, ctx, "field: NULL");
  T_STATUS(batten_trace_outline(ctx, &solid, 5, some_seeds, &o, &out, NULL), BATTEN_E_INVALID, ctx,
           "field.dimension: 3; batten_trace_outline takes fields in 2 dimensions");
  T_STATUS(batten_trace_outline(ctx, &field, 0, NULL, &o, &out, NULL), BATTEN_E_INVALID, ctx, "seeds: none");
  double bad[4] = {0, 1, INFINITY, 0};
  T_STATUS(batten_trace_outline(ctx, &field, 2, bad, &o, &out, NULL), BATTEN_E_INVALID, ctx, "seeds[1][0]: inf");
  o.cell = 1e-12;
  T_STATUS(batten_trace_outline(ctx, &field, 5, some_seeds, &o, &out, NULL), BATTEN_E_TOO_LARGE, ctx, "opt.cell");
  o = options(0.05);
  o.evaluations_max = 100;
  T_STATUS(batten_trace_outline(ctx, &field, 5, some_seeds, &o, &out, NULL), BATTEN_E_TOO_LARGE, ctx,
           "opt.evaluations_max: 100;");
  o = options(0.05);
  p = (plane){.function = nowhere};
  T_STATUS(batten_trace_outline(ctx, &field, 5, some_seeds, &o, &out, NULL), BATTEN_E_NOT_FOUND, ctx, "5 seeds");
  p = (plane){.function = disk, .nan_at = 300};
  T_STATUS(batten_trace_outline(ctx, &field, 5, some_seeds, &o, &out, NULL), BATTEN_E_INVALID, ctx,
           "field: nan at the point (");
  for (size_t k = 1; k < 40; k += 4) {
    p = (plane){.function = disk, .fail_at = k};
    batten_status st = batten_trace_outline(ctx, &field, 5, some_seeds, &o, &out, NULL);
    bool handed = st == BATTEN_E_SINGULAR && strstr(batten_error(ctx), "the field fails at call");
    if (!handed && p.calls >= k) T_CHECK(false, "failure at call %zu is handed on", k);
  }
  T_CHECK(!out && batten_bytes_in_use(ctx) == 0, "failures leave the result alone");
}

static batten_status call_trace(batten_context *c, void *arg) {
  (void)arg;
  plane p = {.function = annulus};
  batten_field field = {.dimension = 2, .order = 0, .evaluate = plane_evaluate, .user = &p};
  batten_polygonize_options o = options(0.2);
  batten_outline *outline = NULL;
  batten_status st = batten_trace_outline(c, &field, 5, some_seeds, &o, &outline, NULL);
  batten_outline_free(outline);
  return st;
}

int main(void) {
  ctx = t_context(NULL, NULL, 2);
  test_figures();
  test_orientation();
  test_convergence();
  test_clipped();
  test_refusals();
  t_fail_every_allocation("tracing", call_trace, NULL);
  t_cancel_every_progress("tracing", call_trace, NULL);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all released");
  batten_context_free(ctx);
  return t_done();
}
