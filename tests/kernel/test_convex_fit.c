/* Convex surfaces from scattered points: batten_convex_fit. */
#include <batten/batten.h>
#include <batten/convex.h>

#include "convex_scenes.h"
#include "tap.h"

typedef struct result {
  batten_status status;
  batten_surface *surface, *free;
  batten_convex_info info;
} result;

static result run(batten_context *ctx, const convex_scene *s, const batten_convex_options *opt) {
  result r = {0};
  r.status = batten_convex_fit(ctx, s->count, s->points, opt, &r.surface, &r.free, &r.info);
  return r;
}

static void release(result *r) {
  batten_surface_free(r->surface);
  batten_surface_free(r->free);
}

/* Weighted sum of squared distances from the nearest places of all, not only from those where corrections end. */
static double nearest_sum(batten_context *ctx, const batten_surface *surface, const convex_scene *s) {
  double *places = convex_allocate(2 * s->count, sizeof *places), sum = 0;
  double *distances = convex_allocate(s->count, sizeof *distances);
  T_CHECK(batten_surface_closest(ctx, surface, s->count, s->points, places, distances) >= 0, "nearest places");
  for (size_t i = 0; i < s->count; i++) sum += distances[i] * distances[i];
  free(distances);
  free(places);
  return sum;
}

/* ---- the paper's experiment ---------------------------------------------------------------------- */

static void check_paper(batten_context *ctx, uint64_t seed) {
  convex_scene s = convex_scene_paper(seed);
  batten_convex_options o = batten_convex_options_default();
  o.rounds = 3;
  result r = run(ctx, &s, &o);
  const batten_convex_info *f = &r.info;
  T_CHECK(r.status == BATTEN_OK && f->convexity.certified, "seed %d: %s, certified", (int)seed,
          batten_status_name(r.status));
  if (r.status < 0) return;
  T_CHECK(f->lsq_unconstrained <= f->lsq && f->lsq < f->lsq_reference,
          "sums: unconstrained %.3f, convex %.3f, "
          "reference %.3f (paper: 0.153, 0.244, 0.422)",
          f->lsq_unconstrained, f->lsq, f->lsq_reference);
  T_CHECK(f->gauss_min > 0 && f->gauss_min_unconstrained < 0, "K from %.3g to %.3g, unconstrained from %.3g to %.3g",
          f->gauss_min, f->gauss_max, f->gauss_min_unconstrained, f->gauss_max_unconstrained);
  for (unsigned k = 0; k < f->rounds; k++)
    T_CHECK(f->rows_per_round[k] > 0 && (k == 0 || f->lsq_per_round[k] <= f->lsq_per_round[k - 1]),
            "round %u: %zu rows, %zu boxes, sum %.4f", k + 1, f->rows_per_round[k], f->boxes_per_round[k],
            f->lsq_per_round[k]);
  double sum = nearest_sum(ctx, r.surface, &s);
  T_CHECK(sum <= f->lsq * (1 + 1e-9) && sum > 0.8 * f->lsq, "sum from the nearest places of all %.4f of %.4f", sum,
          f->lsq);
  T_RATIO(fabs(f->rms - sqrt(f->lsq / (double)s.count)), 1e-12, "rms");
  release(&r);
  convex_scene_free(&s);
}

/* ---- exact data, invariances --------------------------------------------------------------------- */

static const double *control_of(const result *r, size_t *count) {
  batten_surface_form f = batten_surface_get(r->surface);
  *count = 3 * (f.knot_count[0] - f.degree[0] - 1) * (f.knot_count[1] - f.degree[1] - 1);
  return f.control_points;
}

/* Points of a convex bicubic patch give it back without inequalities; tension off, since the patch has some. */
static void check_exact(batten_context *ctx) {
  convex_scene s = convex_scene_new(120);
  uint64_t seed = 4;
  for (size_t i = 0; i < s.count; i++) {
    double u = s.parameters[2 * i] = t_uniform(&seed), v = s.parameters[2 * i + 1] = t_uniform(&seed);
    s.points[3 * i] = u + 0.1 * u * u * u;
    s.points[3 * i + 1] = v;
    s.points[3 * i + 2] = u * u + v * v + 0.2 * u * u * u + 0.1 * u * v;
  }
  batten_convex_options o = batten_convex_options_default();
  o.parameters = s.parameters;
  o.tension = 0;
  result r = run(ctx, &s, &o);
  T_CHECK(r.status == BATTEN_OK, "exact data: %s", batten_status_name(r.status));
  T_RATIO(r.info.max_error, 1e-14, "largest distance of exact data");
  T_CHECK(r.info.rows_per_round[0] == 0 && r.info.tension_weight == 0, "no inequalities, no tension");
  release(&r);
  convex_scene_free(&s);
}

static void check_scale(batten_context *ctx) {
  convex_scene s = convex_scene_paper(1);
  batten_convex_options o = batten_convex_options_default();
  o.rounds = 2;
  size_t n;
  result a = run(ctx, &s, &o);
  for (size_t i = 0; i < 3 * s.count; i++) s.points[i] *= 0x1p40;
  result b = run(ctx, &s, &o);
  const double *x = control_of(&a, &n), *y = control_of(&b, &n);
  double off = 0;
  for (size_t i = 0; i < n; i++) off = fmax(off, fabs(0x1p40 * x[i] - y[i]));
  T_RATIO(off, 0, "2^40 times as large: the same bits");
  T_CHECK(b.info.lsq == a.info.lsq * 0x1p80 && b.info.max_error == a.info.max_error * 0x1p40, "and figures");
  batten_context *many = t_context(NULL, NULL, 3);
  result c = run(many, &s, &o);
  T_CHECK(memcmp(control_of(&c, &n), y, n * sizeof *y) == 0, "three threads: the same bits");
  release(&c);
  release(&b);
  release(&a);
  batten_context_free(many);
  convex_scene_free(&s);
}

/* Turned, in another order, and with a point twice in place of a weight of 2: the same surface to rounding, which the
 * active set of the quadratic program carries on. */
static void check_same(batten_context *ctx) {
  convex_scene s = convex_scene_paper(2), t = convex_scene_new(s.count + 1);
  double m[3][3], weights[CONVEX_PAPER_COUNT];
  uint64_t seed = 8;
  convex_rotation(&seed, m);
  batten_convex_options o = batten_convex_options_default();
  o.rounds = 2;
  o.parameters = s.parameters;
  o.weights = weights;
  for (size_t i = 0; i < s.count; i++) weights[i] = i == 7 ? 2 : 1;
  result a = run(ctx, &s, &o);
  const double none[3] = {0, 0, 0};
  for (size_t i = 0; i <= s.count; i++) { /* reversed, the seventh twice */
    size_t from = i < s.count ? s.count - 1 - i : 7;
    memcpy(t.points + 3 * i, s.points + 3 * from, 3 * sizeof *s.points);
    memcpy(t.parameters + 2 * i, s.parameters + 2 * from, 2 * sizeof *s.parameters);
    convex_turn((const double(*)[3])m, none, t.points + 3 * i);
  }
  o.parameters = t.parameters;
  o.weights = NULL;
  result b = run(ctx, &t, &o);
  T_CHECK(a.status == BATTEN_OK && b.status == BATTEN_OK, "both fitted");
  T_RATIO(fabs(a.info.lsq_unconstrained_first - b.info.lsq_unconstrained_first), 1e-12,
          "turned, reversed, twice for a weight of 2: unconstrained sum");
  T_RATIO(fabs(a.info.lsq_reference - b.info.lsq_reference), 1e-11, "sum of the reference");
  T_RATIO(fabs(a.info.lsq - b.info.lsq) / a.info.lsq, 0.02, "convex sum: the cones are others after a turn");
  release(&b);
  release(&a);
  convex_scene_free(&t);
  convex_scene_free(&s);
}

/* ---- shapes -------------------------------------------------------------------------------------- */

static void check_shape(batten_context *ctx, const char *what, const convex_rule *rule, unsigned degree,
                        batten_status status, bool plane) {
  convex_scene s = convex_scene_make(rule);
  batten_convex_options o = batten_convex_options_default();
  o.degree[0] = o.degree[1] = degree;
  o.rounds = 3;
  result r = run(ctx, &s, &o);
  T_CHECK(r.status == status && (r.info.plane != 0) == plane, "%s: %s, misfit %.1f, %s", what,
          batten_status_name(r.status), r.info.misfit, r.status ? batten_error(ctx) : "no remark");
  if (r.status == BATTEN_W_SHAPE && !plane) {
    const char *named = strstr(batten_error(ctx), "points[");
    size_t index = named ? strtoul(named + 7, NULL, 10) : s.count;
    T_CHECK(r.info.convexity.certified, "what is left is convex");
    T_CHECK(index < s.count && s.dent[index], "point %zu, which the text names, is in the dent", index);
  }
  if (plane && rule->body == CONVEX_PLANE)
    T_CHECK(r.info.rounds == 0 && isnan(r.info.lsq_reference) && isnan(r.info.tension_weight) &&
                isnan(r.info.misfit) && strstr(batten_error(ctx), "all lie in a plane"),
            "no reference, no rounds");
  else
    T_CHECK(r.info.rounds > 0 && r.info.lsq_unconstrained <= r.info.lsq * 1.0001, "unconstrained %.6g, convex %.6g",
            r.info.lsq_unconstrained, r.info.lsq);
  release(&r);
  convex_scene_free(&s);
}

static void check_shapes(batten_context *ctx) {
  convex_rule cap = {.count = 400, .noise = 0.01, .turned = true, .seed = 5}, rule = cap;
  check_shape(ctx, "cap", &rule, 3, BATTEN_OK, false);
  rule.outline = CONVEX_TRIANGLE;
  check_shape(ctx, "triangle", &rule, 3, BATTEN_OK, false);
  rule.outline = CONVEX_ELL;
  check_shape(ctx, "L", &rule, 3, BATTEN_OK, false);
  rule = cap;
  rule.body = CONVEX_SUPERQUADRIC;
  check_shape(ctx, "superquadric", &rule, 4, BATTEN_OK, false);
  rule.body = CONVEX_HALF_PIPE;
  check_shape(ctx, "half pipe, K = 0", &rule, 3, BATTEN_OK, false);
  rule.body = CONVEX_ELLIPSOID;
  rule.reach = 0.3;
  rule.noise = 0.1;
  rule.count = 57;
  check_shape(ctx, "more noise than rise", &rule, 3, BATTEN_OK, false);
  rule = cap;
  rule.dent_depth = 0.1;
  rule.dent_size = 0.5;
  check_shape(ctx, "dent", &rule, 3, BATTEN_W_SHAPE, false);
  rule = cap;
  rule.body = CONVEX_SADDLE;
  check_shape(ctx, "saddle", &rule, 3, BATTEN_W_SHAPE, true);
  rule.body = CONVEX_PLANE;
  rule.noise = 0;
  check_shape(ctx, "plane", &rule, 3, BATTEN_W_SHAPE, true);
}

/* The best plane is that of the points that count. */
static void check_weighted_plane(batten_context *ctx) {
  convex_scene s = convex_scene_make(&(convex_rule){.body = CONVEX_PLANE, .count = 100, .seed = 3});
  batten_convex_options o = batten_convex_options_default();
  double weights[100];
  for (size_t i = 0; i < s.count; i++) {
    weights[i] = i % 4 ? 1 : 0;
    if (i % 4 == 0) s.points[3 * i + 2] = s.points[3 * i] > 0 ? 0.3 : 0;
  }
  o.weights = weights;
  result r = run(ctx, &s, &o);
  T_CHECK(r.status == BATTEN_W_SHAPE && r.info.plane && r.info.max_error < 1e-14,
          "plane of weighted points: %s, %.3g", batten_status_name(r.status), r.info.max_error);
  release(&r);
  convex_scene_free(&s);
}

/* Too few inequalities are not the data's fault. */
static void check_limit(batten_context *ctx) {
  convex_scene s = convex_scene_paper(3);
  batten_convex_options o = batten_convex_options_default();
  o.row_limit = 100;
  result r = run(ctx, &s, &o);
  T_CHECK(r.status == BATTEN_W_SHAPE && r.info.plane && strstr(batten_error(ctx), "opt.row_limit: 100"), "limit: %s",
          batten_error(ctx));
  release(&r);
  convex_scene_free(&s);
}

/* Convex data are no dent: with weights of four decades, where few points make the means; with points beyond the
 * border, and surfaces of too low a degree to follow them there. */
static void check_no_dent(batten_context *ctx) {
  uint64_t seed = 9;
  convex_scene s = convex_scene_make(&(convex_rule){.count = 1000, .noise = 0.04, .seed = 27});
  batten_convex_options o = batten_convex_options_default();
  double weights[1000];
  for (size_t i = 0; i < s.count; i++) weights[i] = pow(10, -4 * t_uniform(&seed));
  o.weights = weights;
  o.rounds = 2;
  result r = run(ctx, &s, &o);
  T_CHECK(r.status == BATTEN_OK, "uneven weights: %s, misfit %.1f", batten_status_name(r.status), r.info.misfit);
  release(&r);
  convex_scene_free(&s);
  convex_rule rule = {.body = CONVEX_SUPERQUADRIC, .outline = CONVEX_DISC, .power = 6, .reach = 0.8, .count = 1500};
  rule.noise = 0.002;
  rule.along_normal = true;
  for (rule.seed = 0; rule.seed < 3; rule.seed++) {
    s = convex_scene_make(&rule);
    o = batten_convex_options_default();
    o.degree[0] = o.degree[1] = 2;
    o.rounds = 2;
    r = run(ctx, &s, &o);
    T_CHECK(r.status == BATTEN_OK, "low degree, %d: %s, misfit %.1f", (int)rule.seed, batten_status_name(r.status),
            r.info.misfit);
    release(&r);
    convex_scene_free(&s);
  }
}

/* Fewer points than control points; several spans; a domain of the caller's. */
static void check_spaces(batten_context *ctx) {
  convex_scene s = convex_scene_make(&(convex_rule){.count = 12, .noise = 0.01, .seed = 6});
  result r = run(ctx, &s, NULL);
  T_CHECK(r.status == BATTEN_OK, "12 points, 16 control points: %s", batten_status_name(r.status));
  release(&r);
  convex_scene_free(&s);
  s = convex_scene_make(&(convex_rule){.count = 300, .noise = 0.01, .seed = 7});
  for (size_t i = 0; i < 2 * s.count; i++) s.parameters[i] = 3 + 2 * s.parameters[i];
  batten_convex_options o = batten_convex_options_default();
  o.spans[0] = 2;
  o.spans[1] = 2;
  o.rounds = 2;
  o.parameters = s.parameters;
  for (int k = 0; k < 4; k++) o.domain[k / 2][k % 2] = k % 2 ? 5 : 3;
  r = run(ctx, &s, &o);
  batten_surface_form f = batten_surface_get(r.surface);
  T_CHECK(r.status == BATTEN_OK && f.knots[0][0] == 3 && f.knots[1][f.knot_count[1] - 1] == 5,
          "four spans on [3, 5]^2: %s, sum %.4g of %.4g", batten_status_name(r.status), r.info.lsq,
          r.info.lsq_unconstrained);
  release(&r);
  for (int k = 0; k < 4; k++) o.domain[k / 2][k % 2] = NAN;
  r = run(ctx, &s, &o);
  T_CHECK(r.status == BATTEN_OK, "domain from the parameters: %s", batten_status_name(r.status));
  release(&r);
  convex_scene_free(&s);
}

/* ---- bad input ------------------------------------------------------------------------------------ */

static void check_bad_options(batten_context *ctx, const convex_scene *s) {
  const batten_convex_options good = batten_convex_options_default();
  batten_convex_options o;
  batten_surface *out = NULL;
#define BAD(change, part)                                                                                     \
  do {                                                                                                        \
    o = good;                                                                                                 \
    change;                                                                                                   \
    T_STATUS(batten_convex_fit(ctx, s->count, s->points, &o, &out, NULL, NULL), BATTEN_E_INVALID, ctx, part); \
  } while (0)
  BAD(o.struct_size = 0, "batten_convex_options.struct_size");
  BAD(o.degree[0] = 1, "opt.degree[0]: 1; must be 2 .. 7");
  BAD(o.degree[1] = 8, "opt.degree[1]: 8");
  BAD(o.spans[1] = 0, "opt.spans[1]: 0; must be 1 .. 16");
  BAD(o.spans[0] = 17, "opt.spans[0]: 17");
  BAD(o.smoothness[0] = 3, "opt.smoothness[0]: 3; must be 1 .. 2");
  BAD(o.rounds = 0, "opt.rounds: 0; must be 1 .. 100");
  BAD(o.rounds = 101, "opt.rounds: 101");
  BAD(o.correction_passes = 101, "opt.correction_passes: 101");
  BAD(o.directions = 2, "opt.directions: 2; must be 3 .. 16");
  BAD(o.depth_max = 11, "opt.depth_max: 11");
  BAD(o.row_limit = 0, "opt.row_limit: 0");
  BAD(o.blend = 1, "opt.blend: 1");
  BAD(o.blend = NAN, "opt.blend: nan");
  BAD(o.margin = 0, "opt.margin: 0");
  BAD(o.row_share = -1, "opt.row_share: -1");
  BAD(o.tension = -1, "opt.tension: -1");
  BAD(o.tension = INFINITY, "opt.tension: inf");
  BAD(o.rounds_tol = NAN, "opt.rounds_tol: nan");
  BAD(o.domain[0][1] = 0, "opt.domain[0]: 0 to 0");
  BAD(o.domain[1][0] = NAN, "opt.domain[1]: nan to 1");
  T_CHECK(out == NULL, "the output is untouched");
}

static void check_bad_data(batten_context *ctx, convex_scene *s) {
  const batten_convex_options good = batten_convex_options_default();
  batten_convex_options o;
  batten_surface *out = NULL;
  double weights[CONVEX_PAPER_COUNT], places[2 * CONVEX_PAPER_COUNT], points[3 * CONVEX_PAPER_COUNT];
  memset(weights, 0, sizeof weights);
  BAD(o.weights = weights, "opt.weights: all 0");
  weights[3] = -1;
  BAD(o.weights = weights, "opt.weights[3]: -1");
  memcpy(places, s->parameters, sizeof places);
  places[9] = 1.25;
  BAD(o.parameters = places, "opt.parameters[4][1]: 1.25 is outside the domain, 0 to 1");
  places[9] = NAN;
  BAD(o.parameters = places, "opt.parameters[4][1]: nan");
  for (int i = 0; i < 2 * CONVEX_PAPER_COUNT; i++) places[i] = 0.5;
  BAD(o.parameters = places, "have u = 0.5");
  for (int i = 0; i < CONVEX_PAPER_COUNT; i++) places[2 * i] = i / 60.0;
  BAD(o.parameters = places, "have v = 0.5");
  for (int i = 0; i < CONVEX_PAPER_COUNT; i++) places[2 * i + 1] = places[2 * i];
  o = good;
  o.parameters = places;
  T_STATUS(batten_convex_fit(ctx, s->count, s->points, &o, &out, NULL, NULL), BATTEN_E_SINGULAR, ctx, "one conic");
  for (int i = 0; i < 3 * CONVEX_PAPER_COUNT; i++) points[i] = 1 + (i / 3) * 0.3 * (1 + i % 3);
  T_STATUS(batten_convex_fit(ctx, s->count, points, NULL, &out, NULL, NULL), BATTEN_E_INVALID, ctx, "lie on a line");
  for (int i = 0; i < 3 * CONVEX_PAPER_COUNT; i++) points[i] = 1;
  T_STATUS(batten_convex_fit(ctx, s->count, points, NULL, &out, NULL, NULL), BATTEN_E_INVALID, ctx, "one point");
  memcpy(points, s->points, sizeof points);
  points[8] = INFINITY;
  T_STATUS(batten_convex_fit(ctx, s->count, points, NULL, &out, NULL, NULL), BATTEN_E_INVALID, ctx, "points[2][2]");
  T_STATUS(batten_convex_fit(ctx, 5, s->points, NULL, &out, NULL, NULL), BATTEN_E_INVALID, ctx, "count: 5");
  T_STATUS(batten_convex_fit(ctx, 51, NULL, NULL, &out, NULL, NULL), BATTEN_E_INVALID, ctx, "points: NULL");
  T_STATUS(batten_convex_fit(ctx, 51, s->points, NULL, NULL, NULL, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_CHECK(out == NULL, "the output is untouched");
}

/* ---- failures ------------------------------------------------------------------------------------- */

static batten_status call(batten_context *ctx, void *arg) {
  const convex_scene *s = arg;
  batten_convex_options o = batten_convex_options_default();
  batten_surface *surface = NULL, *other = NULL;
  o.rounds = 2;
  o.degree[0] = o.degree[1] = 2;
  batten_status st = batten_convex_fit(ctx, s->count, s->points, &o, &surface, &other, NULL);
  if (st < 0 && (surface || other)) return BATTEN_E_INTERNAL;
  batten_surface_free(surface);
  batten_surface_free(other);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  for (uint64_t seed = 0; seed < 5; seed++) check_paper(ctx, seed);
  check_exact(ctx);
  check_scale(ctx);
  check_same(ctx);
  check_shapes(ctx);
  check_weighted_plane(ctx);
  check_limit(ctx);
  check_no_dent(ctx);
  check_spaces(ctx);
  convex_scene s = convex_scene_paper(2);
  check_bad_options(ctx, &s);
  check_bad_data(ctx, &s);
  t_fail_every_allocation("a convex fit", call, &s);
  t_cancel_every_progress("a convex fit", call, &s);
  convex_scene_free(&s);
  batten_context_free(ctx);
  return t_done();
}
