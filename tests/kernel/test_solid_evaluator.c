/* Solids at many points: fast sums against direct ones, on solids of all kinds of data; what is told of them; the
 * surface and the sign check by either; bad input, failing memory, cancelling. */
#include <batten/frep.h>
#include <batten/mesh.h>
#include <batten/solid.h>

#include "scenes.h"
#include "solid/solid_inner.h"
#include "tap.h"

enum { MAX = 4000, PROBES = 1500 };

static double points[3 * MAX], normals[3 * MAX];

/* ---- accuracy ---- */

typedef struct recipe {
  const char *what;
  unsigned n, m;
  size_t count;
  void (*scatter)(size_t count);
  double (*scene)(const double *); /* whose normals orient the points; NULL: the carrier alone */
  batten_orient_data data;
} recipe;

static void moon(size_t count) { scene_moon_points(3, count, points); }
static void torus(size_t count) { scene_torus_points(2, count, points); }
static void contours(size_t count) { scene_pair_points(count, points); }

/* Gradient terms at all points, too many to fit in a test: the coefficients of some function, polynomial in the box.
 */
static batten_solid *make_hermite(batten_context *ctx, const recipe *r) {
  const size_t n = r->n, count = r->count;
  const double lower[3] = {-1.4, -1.4, -0.4}, upper[3] = {1.4, 1.4, 0.4}, polynomial[10] = {0.3, 0.1, 0.2, -0.3, 0.2};
  double *w = malloc(count * sizeof *w), *g = malloc(n * count * sizeof *g);
  size_t *at = malloc(count * sizeof *at);
  uint64_t seed = 6;
  batten_spline *spline = NULL;
  batten_carrier *carrier = NULL;
  batten_solid *s = NULL;
  r->scatter(count);
  for (size_t i = 0; i < count; i++) w[i] = (t_uniform(&seed) - 0.5) / (double)count;
  for (size_t i = 0; i < n * count; i++) g[i] = 0.1 * (t_uniform(&seed) - 0.5) / (double)count;
  for (size_t i = 0; i < count; i++) at[i] = i;
  batten_spline_parts parts = {.struct_size = sizeof parts,
                               .n = r->n,
                               .m = r->m,
                               .count = count,
                               .centers = points,
                               .coefficients = w,
                               .gradient_count = count,
                               .gradient_at = at,
                               .gradient_coefficients = g,
                               .polynomial_count = 10,
                               .polynomial = polynomial,
                               .origin = {0.1, 0, 0},
                               .scale = 2};
  T_OK(batten_spline_create(ctx, &parts, &spline), ctx);
  T_OK(batten_carrier_ball(ctx, r->n, (double[]){0, 0, 0}, 1, &carrier), ctx);
  T_OK(batten_solid_create(ctx, spline, carrier, -1, lower, upper, count, points, &s), ctx);
  batten_spline_free(spline);
  batten_carrier_free(carrier);
  free(w);
  free(g);
  free(at);
  return s;
}

static batten_solid *make(batten_context *ctx, const recipe *r) {
  if (r->data == BATTEN_ORIENT_DATA_GRADIENTS) return make_hermite(ctx, r);
  batten_solid_options o = batten_solid_options_default();
  batten_solid *s = NULL;
  r->scatter(r->count);
  o.orientation = r->scene ? BATTEN_ORIENT_GIVEN : BATTEN_ORIENT_NEVER;
  for (size_t i = 0; r->scene && i < r->count; i++)
    scene_normal(r->n, r->scene, points + i * r->n, normals + i * r->n);
  o.normals = r->scene ? normals : NULL;
  o.orient_data = r->data;
  o.spline.m = r->m;
  o.spline.loo_samples = 0;
  o.check_cells = 10;
  batten_status st = batten_solid_fit(ctx, r->n, r->count, points, &o, &s, NULL);
  if (st < 0) t_line(false, "%s: %s", r->what, batten_error(ctx));
  return s;
}

/* Places that the evaluator's own trial did not see: beside the surface, and in the grown box. */
static void choose_probes(const batten_solid *s, double *x) {
  size_t count;
  const unsigned n = batten_solid_dimension(s);
  const double *data = batten_solid_points(s, &count);
  double lower[3], upper[3];
  uint64_t seed = 4;
  batten_solid_box(s, lower, upper);
  for (size_t i = 0; i < PROBES; i++)
    for (unsigned k = 0; k < n; k++)
      x[i * n + k] = i % 3 ? data[(i * 31 % count) * n + k] + 0.02 * (t_uniform(&seed) - 0.5)
                           : lower[k] + (1.4 * t_uniform(&seed) - 0.2) * (upper[k] - lower[k]);
}

static double length(size_t n, const double *v) {
  double square = 0;
  for (size_t k = 0; k < n; k++) square += v[k] * v[k];
  return sqrt(square);
}

static int compare(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

/* The largest distance, over the diagonal, between f of an evaluator and f beside the surface; far: in the box.
 * Slopes under the median count as that, since off the surface f may be flat. */
static double distance_to_direct(batten_context *ctx, const batten_solid *s, batten_solid_evaluator *e, double *far,
                                 double *gradient_error, size_t *differ) {
  static double x[3 * PROBES], f[PROBES], g[PROBES], df[3 * PROBES], dg[3 * PROBES], slope[PROBES],
      values_alone[PROBES];
  const size_t n = batten_solid_dimension(s);
  double lower[3], upper[3], box[3], worst = 0;
  choose_probes(s, x);
  T_OK(batten_solid_evaluate(ctx, s, PROBES, x, f, df, NULL), ctx);
  T_OK(batten_solid_evaluator_evaluate(ctx, e, PROBES, x, g, dg), ctx);
  T_OK(batten_solid_evaluator_evaluate(ctx, e, PROBES, x, values_alone, NULL), ctx);
  for (size_t i = 0; i < PROBES; i++) slope[i] = length(n, df + i * n);
  qsort(slope, PROBES, sizeof *slope, compare);
  batten_solid_box(s, lower, upper);
  for (size_t k = 0; k < n; k++) box[k] = upper[k] - lower[k];
  *gradient_error = *far = 0;
  *differ = 0;
  for (size_t i = 0; i < PROBES; i++) {
    const double steep = fmax(length(n, df + i * n), slope[PROBES / 2]);
    for (size_t k = 0; k < n; k++) dg[i * n + k] -= df[i * n + k];
    const double miss = fmax(fabs(g[i] - f[i]), fabs(values_alone[i] - f[i])) / steep / length(n, box);
    if (i % 3)
      worst = fmax(worst, miss);
    else
      *far = fmax(*far, miss);
    *gradient_error = fmax(*gradient_error, length(n, dg + i * n) / steep);
    *differ += g[i] != f[i];
  }
  return worst;
}

static void test_accuracy(batten_context *ctx, const recipe *r, batten_solid *s, double accuracy) {
  batten_solid_evaluator *e = NULL;
  double turn, far;
  size_t differ;
  T_OK(batten_solid_evaluator_new(ctx, s, BATTEN_EVALUATE_FAST, accuracy, &e), ctx);
  if (!e) return;
  batten_solid_evaluator_info i = batten_solid_evaluator_get_info(e);
  T_CHECK(i.method == BATTEN_EVALUATE_FAST && i.places > 200 && i.terms >= r->count,
          "%s, %g: %zu terms, sums of %.1g are off by %.1g at %zu places", r->what, accuracy, i.terms,
          i.sums_accuracy, i.error, i.places);
  T_RATIO(i.error, accuracy / 6, "what is told is a sixth of what was asked for at most");
  T_RATIO(distance_to_direct(ctx, s, e, &far, &turn, &differ), accuracy, "at 1000 other places beside the surface");
  T_RATIO(far, 4 * accuracy, "at 500 places in the grown box, where f is large");
  /* A kernel's sums lose digits in each derivative; a gradient that is off by 1e-2 still leads to the surface. */
  T_RATIO(turn, fmax(1e4 * accuracy, 1e-8), "and the gradients (told: %.1g)", i.gradient_error);
  T_CHECK(differ > PROBES / 10, "they are other sums: %zu of %d values differ", differ, (int)PROBES);
  i = batten_solid_evaluator_get_info(e);
  T_CHECK(i.evaluations == 2 * PROBES, "%zu points were asked for", i.evaluations);
  batten_solid_evaluator_free(e);
}

static void test_recipe(batten_context *ctx, const recipe *r, double accuracy, double finer) {
  batten_solid *s = make(ctx, r);
  if (!s) return;
  test_accuracy(ctx, r, s, accuracy);
  if (finer > 0) test_accuracy(ctx, r, s, finer);
  batten_solid_free(s);
}

/* ---- the same bits ---- */

static void test_threads(void) {
  const recipe r = {"torus, gradients", 3, 3, 3500, torus, NULL, BATTEN_ORIENT_DATA_GRADIENTS};
  const unsigned threads[2] = {1, 5};
  static double x[3 * PROBES], f[2][PROBES], g[2][3 * PROBES];
  for (int t = 0; t < 2; t++) {
    batten_context *ctx = t_context(NULL, NULL, threads[t]);
    batten_solid *s = make(ctx, &r);
    batten_solid_evaluator *e = NULL;
    choose_probes(s, x);
    T_OK(batten_solid_evaluator_new(ctx, s, BATTEN_EVALUATE_FAST, 1e-5, &e), ctx);
    T_OK(batten_solid_evaluator_evaluate(ctx, e, PROBES, x, f[t], g[t]), ctx);
    batten_solid_evaluator_free(e);
    batten_solid_free(s);
    batten_context_free(ctx);
    T_CHECK(!memcmp(f[0], f[t], sizeof f[0]) && !memcmp(g[0], g[t], sizeof g[0]), "the same bits on %u threads",
            threads[t]);
  }
}

/* ---- other kinds ---- */

static void expect_direct(batten_context *ctx, const char *what, batten_solid *s, batten_evaluation how) {
  static double x[3 * PROBES], f[PROBES], g[PROBES], df[3 * PROBES], dg[3 * PROBES];
  batten_solid_evaluator *e = NULL;
  const size_t n = batten_solid_dimension(s);
  choose_probes(s, x);
  T_OK(batten_solid_evaluator_new(ctx, s, how, 0, &e), ctx);
  batten_solid_evaluator_info i = batten_solid_evaluator_get_info(e);
  T_OK(batten_solid_evaluate(ctx, s, PROBES, x, f, df, NULL), ctx);
  T_OK(batten_solid_evaluator_evaluate(ctx, e, PROBES, x, g, dg), ctx);
  T_CHECK(i.method == BATTEN_EVALUATE_DIRECT && i.error == 0 && i.places == 0 && !memcmp(f, g, sizeof f) &&
              !memcmp(df, dg, PROBES * n * sizeof *df),
          "%s: direct, the same bits", what);
  batten_solid_evaluator_free(e);
}

static void test_kinds(batten_context *ctx) {
  batten_frep *ball = NULL;
  batten_solid *s = NULL;
  T_OK(batten_frep_ball(ctx, 3, (double[]){0.1, 0, 0}, 0.7, &ball), ctx);
  T_OK(batten_frep_to_solid(ctx, ball, NULL, NULL, 0, &s), ctx);
  expect_direct(ctx, "a tree", s, BATTEN_EVALUATE_FAST);
  batten_solid_free(s);
  batten_frep_free(ball);
  for (int i = 0; i < 10; i++) points[i] = 0.1 * i * i;
  T_OK(batten_solid_fit(ctx, 1, 10, points, NULL, &s, NULL), ctx);
  expect_direct(ctx, "intervals", s, BATTEN_EVALUATE_FAST);
  batten_solid_free(s);
  moon(300);
  T_OK(batten_solid_fit(ctx, 3, 300, points, NULL, &s, NULL), ctx);
  expect_direct(ctx, "few points", s, BATTEN_EVALUATE_AUTO);
  expect_direct(ctx, "on demand", s, BATTEN_EVALUATE_DIRECT);
  batten_solid_free(s);
}

/* ---- the surface ---- */

static batten_mesh *surface_of(batten_context *ctx, const batten_solid *s, batten_field field, bool search,
                               batten_mesh_measures *m) {
  batten_polygonize_options o = batten_polygonize_options_default();
  batten_mesh *mesh = NULL;
  size_t count;
  const double *seeds = batten_solid_points(s, &count);
  o.cell = 0.15;
  for (int k = 0; search && k < 3; k++) o.lower[k] = -2, o.upper[k] = 2;
  T_OK(batten_polygonize(ctx, &field, search ? 0 : count, search ? NULL : seeds, &o, &mesh, NULL), ctx);
  T_OK(batten_mesh_measure(ctx, mesh, m), ctx);
  return mesh;
}

/* Vertices settle to 1e-6 of the box by f of fast sums: f of direct ones agrees to that and what the sums are off. */
static void expect_same_surface(batten_context *ctx, const batten_solid *s, batten_solid_evaluator *e) {
  batten_mesh_measures direct, fast, found;
  batten_field field = batten_solid_evaluator_field(e);
  T_CHECK(field.dimension == 3 && field.order == 1 && field.bounds, "a field of order 1 with bounds");
  batten_mesh_free(surface_of(ctx, s, batten_solid_field(s), false, &direct));
  batten_mesh_free(surface_of(ctx, s, field, true, &found));
  batten_mesh *mesh = surface_of(ctx, s, field, false, &fast);
  T_CHECK(fast.components == 1 && fast.genus == 1 && direct.components == 1 && direct.genus == 1 &&
              found.components == 1 && found.genus == 1,
          "a ring by fast and direct sums, from its points or found by its bounds");
  T_RATIO(fabs(fast.volume / direct.volume - 1), 1e-4, "volume");
  size_t count = batten_mesh_vertex_count(mesh);
  double *f = malloc(count * sizeof *f), *df = malloc(3 * count * sizeof *df), worst = 0, lower[3], upper[3], box[3];
  T_OK(batten_solid_evaluate(ctx, s, count, batten_mesh_vertices(mesh), f, df, NULL), ctx);
  for (size_t i = 0; i < count; i++) worst = fmax(worst, fabs(f[i]) / length(3, df + 3 * i));
  batten_solid_box(s, lower, upper);
  for (int k = 0; k < 3; k++) box[k] = 1.5 * (upper[k] - lower[k]); /* the polygoniser's */
  T_RATIO(worst / length(3, box), 1e-6 + 1e-7, "vertices are off the surface of direct sums");
  free(f);
  free(df);
  batten_mesh_free(mesh);
}

/* ---- the sign check ---- */

static batten_sign_check check(batten_context *ctx, const surface_data *d, batten_solid *s,
                               batten_solid_evaluator *e) {
  batten_sign_check c = {0};
  T_OK(batten_solid_check_sign(ctx, d, 16, 0, s, e, &c), ctx);
  return c;
}

static batten_sign_check check_directly(batten_context *ctx, const surface_data *d, batten_solid *s) {
  batten_solid_evaluator *e = NULL;
  T_OK(batten_solid_evaluator_new(ctx, s, BATTEN_EVALUATE_DIRECT, 0, &e), ctx);
  batten_sign_check c = check(ctx, d, s, e);
  batten_solid_evaluator_free(e);
  return c;
}

static void expect_same_check(const char *what, batten_sign_check a, batten_sign_check b) {
  T_CHECK(a.weak_gradients == b.weak_gradients && a.flipped_neighbours == b.flipped_neighbours &&
              a.phantom_components == b.phantom_components && a.phantom_cells == b.phantom_cells &&
              a.clean == b.clean,
          "%s: %zu %zu weak, %zu %zu flipped, %zu %zu pieces, %zu %zu cells", what, a.weak_gradients,
          b.weak_gradients, a.flipped_neighbours, b.flipped_neighbours, a.phantom_components, b.phantom_components,
          a.phantom_cells, b.phantom_cells);
}

/* What fast sums say of a fit by iteration is what direct ones say: its check, and its surface. */
static void test_iterative_fit(batten_context *ctx) {
  enum { COUNT = 4000 };
  batten_solid_evaluator *e = NULL;
  batten_solid_options o = batten_solid_options_default();
  batten_solid_info info;
  batten_solid *s = NULL;
  surface_data d = {0};
  torus(COUNT);
  o.evaluation = BATTEN_EVALUATE_FAST;
  o.spline.saddle.method = BATTEN_SADDLE_ITERATIVE;
  o.check_cells = 16;
  T_OK(batten_solid_fit(ctx, 3, COUNT, points, &o, &s, &info), ctx);
  if (!s) return;
  T_CHECK(info.evaluation.method == BATTEN_EVALUATE_FAST && info.evaluation.evaluations > 4 * COUNT,
          "%d points: the check evaluated f at %zu by fast sums", (int)COUNT, info.evaluation.evaluations);
  T_RATIO(info.evaluation.error, 1e-5, "off by");
  T_CHECK(info.residual_points == COUNT && info.sign == BATTEN_SIGN_CLEAN,
          "all points are looked at directly; clean");
  T_OK(batten_surface_data_make(ctx, 3, COUNT, points, &o, &d), ctx);
  T_OK(batten_solid_evaluator_new(ctx, s, BATTEN_EVALUATE_FAST, 0, &e), ctx);
  expect_same_check("direct and fast", check_directly(ctx, &d, s), check(ctx, &d, s, e));
  expect_same_surface(ctx, s, e);
  batten_solid_evaluator_free(e);
  batten_surface_data_free(ctx, &d);
  batten_solid_free(s);
}

/* f = y and a sum of small terms at random centres about the box [-1, 1]^2, which needs no fit. */
static batten_solid *make_plain(batten_context *ctx, unsigned m, size_t count, size_t point_count, const double *on) {
  const double lower[2] = {-1, -1}, upper[2] = {1, 1}, polynomial[6] = {0, 0, -1};
  double *x = malloc(2 * count * sizeof *x), *w = malloc(count * sizeof *w);
  uint64_t seed = 11;
  for (size_t i = 0; i < count; i++) {
    w[i] = 20 * (t_uniform(&seed) - 0.5) / (double)count;
    for (size_t k = 0; k < 2; k++) x[2 * i + k] = 2 * t_uniform(&seed) - 1;
  }
  batten_spline_parts parts = {.struct_size = sizeof parts,
                               .n = 2,
                               .m = m,
                               .count = count,
                               .centers = x,
                               .coefficients = w,
                               .polynomial_count = m == 2 ? 3 : 6,
                               .polynomial = polynomial,
                               .scale = 1};
  batten_spline *spline = NULL;
  batten_carrier *none = NULL;
  batten_solid *s = NULL;
  T_OK(batten_spline_create(ctx, &parts, &spline), ctx);
  T_OK(batten_carrier_none(ctx, 2, &none), ctx);
  T_OK(batten_solid_create(ctx, spline, none, 1, lower, upper, point_count, on, &s), ctx);
  batten_carrier_free(none);
  batten_spline_free(spline);
  free(x);
  free(w);
  return s;
}

/* AUTO takes fast sums from 12,000 terms on, from 30,000 with r^4 ln r. */
static void test_auto(batten_context *ctx) {
  const struct {
    unsigned m;
    size_t count;
    batten_evaluation method;
  } cases[4] = {{2, 11999, BATTEN_EVALUATE_DIRECT},
                {2, 12000, BATTEN_EVALUATE_FAST},
                {3, 29999, BATTEN_EVALUATE_DIRECT},
                {3, 30000, BATTEN_EVALUATE_FAST}};
  const double on[4] = {0.5, 0, -0.5, 0};
  for (int i = 0; i < 4; i++) {
    batten_solid *s = make_plain(ctx, cases[i].m, cases[i].count, 2, on);
    batten_solid_evaluator *e = NULL;
    T_OK(batten_solid_evaluator_new(ctx, s, BATTEN_EVALUATE_AUTO, 1e-3, &e), ctx);
    T_CHECK(batten_solid_evaluator_get_info(e).method == cases[i].method, "m = %u, %zu terms: %s", cases[i].m,
            cases[i].count, cases[i].method == BATTEN_EVALUATE_FAST ? "fast" : "direct");
    batten_solid_evaluator_free(e);
    batten_solid_free(s);
  }
}

enum { CLUSTERS = 60, EACH = 4, CLUSTERED = CLUSTERS * EACH };

/* How many of the points do not see f of e rise along y, a tenth of their spacing before and behind. */
static size_t count_lost(batten_context *ctx, batten_solid_evaluator *e, const surface_data *d) {
  double x[6 * CLUSTERED], f[3 * CLUSTERED];
  size_t lost = 0;
  for (size_t i = 0; i < d->count; i++)
    for (int side = -1; side <= 1; side++) {
      x[6 * i + 2 * (size_t)(side + 1)] = d->points[2 * i];
      x[6 * i + 2 * (size_t)(side + 1) + 1] = d->points[2 * i + 1] + 0.1 * side * d->spacing[i];
    }
  T_OK(batten_solid_evaluator_evaluate(ctx, e, 3 * d->count, x, f, NULL), ctx);
  for (size_t i = 0; i < d->count; i++) {
    const double *v = f + 3 * i;
    lost += !((v[0] < v[1] && v[1] < v[2]) || (v[0] > v[1] && v[1] > v[2]));
  }
  return lost;
}

/* Clusters of 4 points within 1e-9 on y = 0, where cells of the sums meet: f by sums steps there by what these are
 * off, which is more than it rises between probes 1e-11 apart. Points that seem weak for that are summed again. */
static void test_clusters(batten_context *ctx) {
  batten_solid_options o = batten_solid_options_default();
  batten_solid_evaluator *e = NULL;
  surface_data d = {0};
  for (size_t i = 0; i < CLUSTERED; i++) {
    const size_t cluster = i / EACH;
    points[2 * i] = -0.9 + 0.03 * (double)cluster + 1e-10 * (double)(i % EACH);
    points[2 * i + 1] = 0;
  }
  batten_solid *s = make_plain(ctx, 2, 4000, CLUSTERED, points);
  T_OK(batten_surface_data_make(ctx, 2, CLUSTERED, points, &o, &d), ctx);
  T_OK(batten_solid_evaluator_new(ctx, s, BATTEN_EVALUATE_FAST, 1e-5, &e), ctx);
  const size_t lost = count_lost(ctx, e, &d);
  T_CHECK(lost > CLUSTERED / 10, "of %d points in clusters %zu seem weak by sums alone", (int)CLUSTERED, lost);
  batten_sign_check direct = check_directly(ctx, &d, s), fast = check(ctx, &d, s, e);
  batten_solid_evaluator_free(e);
  T_CHECK(direct.weak_gradients == 0 && fast.weak_gradients == 0, "summed again none is: %zu, directly %zu",
          fast.weak_gradients, direct.weak_gradients);
  batten_surface_data_free(ctx, &d);
  batten_solid_free(s);
}

/* ---- solids made of large ones ---- */

/* 12,000 centres: points are moved to the surface under another carrier by fast sums, and direct ones find them
 * there. Of 40,000 centres f vanishes at those on y = 0. */
static void test_made(batten_context *ctx) {
  enum { POINTS = 200, CENTERS = 40000, ON = CENTERS / 4 + 100 };
  const double lower[2] = {-1, -1}, upper[2] = {1, 1}, polynomial[3] = {0, 0, -1};
  static double on[2 * POINTS], f[POINTS], df[2 * POINTS], x[2 * CENTERS], w[CENTERS];
  batten_carrier *plane = NULL, *none = NULL;
  batten_spline *spline = NULL;
  batten_solid *moved = NULL, *guessed = NULL;
  batten_solid_evaluator *e = NULL;
  double worst = 0;
  size_t count;
  uint64_t seed = 13;
  for (size_t i = 0; i < POINTS; i++) on[2 * i] = -1 + 2.0 * (double)i / POINTS;
  batten_solid *s = make_plain(ctx, 2, 12000, POINTS, on);
  T_OK(batten_carrier_half_space(ctx, 2, (double[]){0, 0.3}, (double[]){0.1, -1}, &plane), ctx);
  T_OK(batten_solid_with_carrier(ctx, s, plane, &moved), ctx);
  T_OK(batten_solid_evaluate(ctx, moved, POINTS, batten_solid_points(moved, &count), f, df, NULL), ctx);
  for (size_t i = 0; i < POINTS; i++) worst = fmax(worst, fabs(f[i]) / length(2, df + 2 * i));
  T_CHECK(count == POINTS && worst > 1e-14, "%zu points, by other sums", count);
  T_RATIO(worst, 1e-7 * 2 * sqrt(2), "are moved to the surface");
  T_OK(batten_solid_evaluator_new(ctx, moved, BATTEN_EVALUATE_AUTO, 1e-5, &e), ctx);
  T_CHECK(batten_solid_evaluator_get_info(e).method == BATTEN_EVALUATE_FAST, "which has an evaluator too");
  batten_solid_evaluator_free(e);
  batten_solid_free(moved);
  batten_solid_free(s);
  batten_carrier_free(plane);

  /* Weights that are odd in y leave f = 0 on y = 0. */
  for (size_t i = 0; i < CENTERS; i++) {
    const bool mirrored = i >= ON && (i - ON) % 2;
    x[2 * i] = mirrored ? x[2 * i - 2] : 2 * t_uniform(&seed) - 1;
    x[2 * i + 1] = i < ON ? 0 : mirrored ? -x[2 * i - 1] : 0.1 + 0.9 * t_uniform(&seed);
    w[i] = i < ON ? 0 : mirrored ? -w[i - 1] : t_uniform(&seed) / CENTERS;
  }
  batten_spline_parts parts = {.struct_size = sizeof parts,
                               .n = 2,
                               .m = 2,
                               .count = CENTERS,
                               .centers = x,
                               .coefficients = w,
                               .polynomial_count = 3,
                               .polynomial = polynomial,
                               .scale = 1};
  T_OK(batten_spline_create(ctx, &parts, &spline), ctx);
  T_OK(batten_carrier_none(ctx, 2, &none), ctx);
  T_OK(batten_solid_create(ctx, spline, none, 1, lower, upper, 0, NULL, &guessed), ctx);
  const double *found = batten_solid_points(guessed, &count);
  bool all_on = true;
  for (size_t i = 0; i < count; i++) all_on = all_on && found[2 * i + 1] == 0;
  T_CHECK(count == ON && all_on, "%zu of %d centres are on the surface", count, (int)CENTERS);
  batten_solid_free(guessed);
  batten_spline_free(spline);

  /* No centres, and three of which none is on the surface: there is something to evaluate all the same. */
  for (size_t few = 0; few <= 3; few += 3) {
    double y[2] = {0.2, 0.3}, value = 0, again = 0;
    parts.count = few;
    parts.centers = x + 2 * (CENTERS - 4);
    parts.coefficients = w + CENTERS - 4;
    T_OK(batten_spline_create(ctx, &parts, &spline), ctx);
    T_OK(batten_solid_create(ctx, spline, none, 1, lower, upper, 0, NULL, &guessed), ctx);
    batten_solid_points(guessed, &count);
    T_CHECK(count == few, "%zu centres", few);
    T_OK(batten_solid_evaluator_new(ctx, guessed, BATTEN_EVALUATE_FAST, 1e-5, &e), ctx);
    T_OK(batten_solid_evaluator_evaluate(ctx, e, 1, y, &value, NULL), ctx);
    T_OK(batten_solid_evaluate(ctx, guessed, 1, y, &again, NULL, NULL), ctx);
    T_RATIO(fabs(value - again), 1e-5, "%zu centres, fast sums asked for", few);
    batten_solid_evaluator_free(e);
    batten_solid_free(guessed);
    batten_spline_free(spline);
  }
  batten_carrier_free(none);
}

/* ---- bad input, memory, cancelling ---- */

static void test_bad(batten_context *ctx) {
  batten_solid *s = NULL;
  batten_solid_evaluator *e = NULL, *untouched = NULL;
  double x[3] = {0, 0, 0}, f;
  moon(200);
  T_OK(batten_solid_fit(ctx, 3, 200, points, NULL, &s, NULL), ctx);
  T_STATUS(batten_solid_evaluator_new(ctx, NULL, BATTEN_EVALUATE_AUTO, 0, &e), BATTEN_E_INVALID, ctx, "s: NULL");
  T_STATUS(batten_solid_evaluator_new(ctx, s, BATTEN_EVALUATE_AUTO, 0, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_STATUS(batten_solid_evaluator_new(ctx, s, (batten_evaluation)3, 0, &e), BATTEN_E_INVALID, ctx, "how: 3");
  const double wrong[4] = {-1, 1e-13, 0.1, NAN};
  for (int i = 0; i < 4; i++)
    T_STATUS(batten_solid_evaluator_new(ctx, s, BATTEN_EVALUATE_AUTO, wrong[i], &e), BATTEN_E_INVALID, ctx,
             "accuracy: ");
  T_CHECK(e == untouched, "out is untouched");
  T_STATUS(batten_solid_evaluator_evaluate(ctx, NULL, 1, x, &f, NULL), BATTEN_E_INVALID, ctx, "e: NULL");
  T_OK(batten_solid_evaluator_new(ctx, s, BATTEN_EVALUATE_FAST, 1e-4, &e), ctx);
  T_STATUS(batten_solid_evaluator_evaluate(ctx, e, 1, NULL, &f, NULL), BATTEN_E_INVALID, ctx, "points: NULL");
  T_STATUS(batten_solid_evaluator_evaluate(ctx, e, SIZE_MAX / 8, x, &f, NULL), BATTEN_E_TOO_LARGE, ctx, "count: ");
  x[1] = NAN;
  T_STATUS(batten_solid_evaluator_evaluate(ctx, e, 1, x, &f, NULL), BATTEN_E_INVALID, ctx, "points[0][1]");
  T_OK(batten_solid_evaluator_evaluate(ctx, e, 0, NULL, NULL, NULL), ctx);
  T_OK(batten_solid_evaluator_evaluate(ctx, e, 1, x, NULL, NULL), ctx);
  batten_context *other = t_context(NULL, NULL, 1);
  T_STATUS(batten_solid_evaluator_evaluate(other, e, 1, x, &f, NULL), BATTEN_E_INVALID, other, "another context");
  batten_context_free(other);
  batten_solid_free(s); /* the evaluator holds it */
  x[1] = 0;
  T_OK(batten_solid_evaluator_evaluate(ctx, e, 1, x, &f, NULL), ctx);
  batten_solid_evaluator_free(e);
  batten_solid_evaluator_free(NULL);
  batten_solid_options o = batten_solid_options_default();
  o.evaluation = (batten_evaluation)-1;
  T_STATUS(batten_solid_fit(ctx, 3, 200, points, &o, &s, NULL), BATTEN_E_INVALID, ctx, "opt.evaluation: -1");
}

/* Points that are not on the surface but about a place where f is flat, by symmetry: no sums are fine enough to say
 * where f = 0 is there. */
static void test_flat(batten_context *ctx) {
  enum { CENTERS = 4000, AROUND = 300 };
  static double x[2 * CENTERS], w[CENTERS], around[2 * AROUND];
  const double polynomial[3] = {0}, lower[2] = {-1, -1}, upper[2] = {1, 1};
  uint64_t seed = 3;
  for (size_t i = 0; i < CENTERS; i += 2)
    for (size_t k = 0; k < 2; k++) {
      x[2 * i + k] = 2 * t_uniform(&seed) - 1;
      x[2 * i + 2 + k] = -x[2 * i + k];
    }
  for (size_t i = 0; i < CENTERS; i++) w[i] = 1.0 / CENTERS;
  for (size_t i = 0; i < 2 * AROUND; i++) around[i] = 1e-9 * (t_uniform(&seed) - 0.5);
  batten_spline_parts parts = {.struct_size = sizeof parts,
                               .n = 2,
                               .m = 2,
                               .count = CENTERS,
                               .centers = x,
                               .coefficients = w,
                               .polynomial_count = 3,
                               .polynomial = polynomial,
                               .scale = 1};
  batten_spline *spline = NULL;
  batten_carrier *none = NULL;
  batten_solid *s = NULL;
  batten_solid_evaluator *e = NULL;
  T_OK(batten_spline_create(ctx, &parts, &spline), ctx);
  T_OK(batten_carrier_none(ctx, 2, &none), ctx);
  T_OK(batten_solid_create(ctx, spline, none, 1, lower, upper, AROUND, around, &s), ctx);
  T_STATUS(batten_solid_evaluator_new(ctx, s, BATTEN_EVALUATE_FAST, 0, &e), BATTEN_W_ACCURACY, ctx, "accuracy: ");
  batten_solid_evaluator_info i = batten_solid_evaluator_get_info(e);
  T_CHECK(i.sums_accuracy == 1e-12 && i.error > 5e-8, "sums of %g are off by %g", i.sums_accuracy, i.error);
  batten_solid_evaluator_free(e);
  batten_solid_free(s);
  batten_carrier_free(none);
  batten_spline_free(spline);
}

enum { SMALL = 3200, MANY = 600 };

typedef struct life {
  batten_spline_parts parts;
  double *x, *f; /* [MANY][2], [MANY] */
} life;

/* All that an evaluator does, on a spline that costs nothing to make, in the plane, where operators cost little. */
static batten_status live(batten_context *ctx, void *arg) {
  life *l = arg;
  const double lower[2] = {-1, -1}, upper[2] = {1, 1}, center[2] = {0, 0};
  batten_spline *spline = NULL;
  batten_carrier *ball = NULL;
  batten_solid *s = NULL;
  batten_solid_evaluator *e = NULL;
  batten_status st = batten_spline_create(ctx, &l->parts, &spline);
  if (st >= 0) st = batten_carrier_ball(ctx, 2, center, 1, &ball);
  if (st >= 0) st = batten_solid_create(ctx, spline, ball, 1, lower, upper, 8, l->parts.centers, &s);
  if (st >= 0) st = batten_solid_evaluator_new(ctx, s, BATTEN_EVALUATE_FAST, 1e-3, &e);
  if (st >= 0) st = batten_solid_evaluator_evaluate(ctx, e, MANY, l->x, l->f, NULL);
  batten_solid_evaluator_free(e);
  batten_solid_free(s);
  batten_carrier_free(ball);
  batten_spline_free(spline);
  return st;
}

static void test_life(void) {
  static double weights[SMALL], polynomial[3] = {1, 0.1, 0.2};
  life l = {.x = malloc(2 * MANY * sizeof(double)), .f = malloc(MANY * sizeof(double))};
  uint64_t seed = 5;
  contours(SMALL);
  for (size_t i = 0; i < SMALL; i++) weights[i] = (i % 2 ? 1e-3 : -1e-3) * t_uniform(&seed);
  for (size_t i = 0; i < 2 * MANY; i++) l.x[i] = 2 * t_uniform(&seed) - 1;
  l.parts = (batten_spline_parts){.struct_size = sizeof l.parts,
                                  .n = 2,
                                  .m = 2,
                                  .count = SMALL,
                                  .centers = points,
                                  .coefficients = weights,
                                  .polynomial_count = 3,
                                  .polynomial = polynomial,
                                  .scale = 1};
  t_fail_every_allocation("an evaluator", live, &l);
  t_cancel_every_progress("an evaluator", live, &l);
  free(l.x);
  free(l.f);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  const batten_orient_data none = BATTEN_ORIENT_DATA_AUTO, pairs = BATTEN_ORIENT_DATA_PAIRS,
                           gradients = BATTEN_ORIENT_DATA_GRADIENTS;
  const recipe moon_pairs = {"moon, pairs, r", 3, 2, 1200, moon, scene_moon, pairs},
               torus_cubic = {"torus, pairs, r^3", 3, 3, 1100, torus, scene_torus, pairs},
               torus_hermite = {"torus, gradients, r^3", 3, 3, 3500, torus, NULL, gradients},
               plane = {"two contours, r^2 ln r", 2, 2, 3300, contours, NULL, none};
  test_recipe(ctx, &moon_pairs, 1e-6, 0);
  test_recipe(ctx, &torus_cubic, 1e-4, 0);
  test_recipe(ctx, &torus_hermite, 1e-5, 0);
  test_recipe(ctx, &plane, 1e-7, 1e-10);
  test_threads();
  test_kinds(ctx);
  test_iterative_fit(ctx);
  test_auto(ctx);
  test_clusters(ctx);
  test_made(ctx);
  test_bad(ctx);
  test_flat(ctx);
  test_life();
  batten_context_free(ctx);
  return t_done();
}
