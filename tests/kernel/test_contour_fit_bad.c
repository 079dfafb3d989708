/* Data and options that make no sense, or little: an error that names what is wrong, or the right result. */
#include <batten/contour.h>

#include "contour_scenes.h"
#include "tap.h"

typedef struct job {
  size_t count;
  const double *points;
  batten_contour_options o;
  batten_contour_info info;
} job;

/* An arc and one that bends the other way. */
static void make_wave(size_t count, double *points) {
  for (size_t i = 0; i < count; i++) {
    double t = (double)i / (double)(count - 1);
    points[2 * i] = 4 * t;
    points[2 * i + 1] = sin(6 * t) + 1e-3 * sin(97.0 * (double)i);
  }
}

static batten_status run(batten_context *ctx, job *j) {
  batten_curve *curve = NULL;
  batten_status st = batten_contour_fit(ctx, j->count, j->points, &j->o, &curve, NULL, NULL, &j->info);
  batten_curve_free(curve);
  return st;
}

static batten_status call(batten_context *ctx, void *arg) {
  const job *j = arg;
  batten_curve *curve = NULL, *other = NULL;
  double *parameters = malloc(j->count * sizeof *parameters);
  batten_contour_info info;
  batten_status st = batten_contour_fit(ctx, j->count, j->points, &j->o, &curve, parameters, &other, &info);
  batten_curve_free(other);
  batten_curve_free(curve);
  free(parameters);
  return st;
}

static void test_options(batten_context *ctx) {
  double points[2 * 40], weights[40], parameters[40], breaks[2] = {0.5, 0.4}, inflections[3] = {0.2, 0.5, 1};
  make_wave(40, points);
  for (size_t i = 0; i < 40; i++) {
    weights[i] = 0;
    parameters[i] = (double)i;
  }
  batten_curve *curve = NULL;
  const batten_contour_options plain = batten_contour_options_default();
  batten_contour_options zero = {0};
  T_STATUS(batten_contour_fit(ctx, 40, points, &zero, &curve, NULL, NULL, NULL), BATTEN_E_INVALID, ctx,
           "batten_contour_options_default");
  T_STATUS(batten_contour_fit(ctx, 40, points, NULL, NULL, NULL, NULL, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_STATUS(batten_contour_fit(ctx, 40, NULL, NULL, &curve, NULL, NULL, NULL), BATTEN_E_INVALID, ctx, "points: NULL");
  T_STATUS(batten_contour_fit(ctx, 2, points, NULL, &curve, NULL, NULL, NULL), BATTEN_E_INVALID, ctx,
           "count: 2 points");
#define BAD(change, text)                                \
  do {                                                   \
    job j = {.count = 40, .points = points, .o = plain}; \
    batten_contour_options *o = &j.o;                    \
    (void)o;                                             \
    change;                                              \
    T_STATUS(run(ctx, &j), BATTEN_E_INVALID, ctx, text); \
  } while (0)
  BAD(o->smoothness = 3, "opt.smoothness: 3; must be 1 or 2");
  BAD(o->degree = 2, "opt.degree: 2; must be 3 .. 9");
  BAD(o->degree = 10, "opt.degree: 10");
  BAD(o->parametrization = (batten_contour_parametrization)7, "opt.parametrization: 7");
  BAD(o->rounds = 0, "opt.rounds: 0; must be 1 .. 100");
  BAD(o->correction_passes = 101, "opt.correction_passes: 101");
  BAD(o->construction = 3, "opt.construction: 3");
  BAD(o->depth_max = 21, "opt.depth_max: 21");
  BAD(o->row_limit = 0, "opt.row_limit: 0");
  BAD(o->sign = 2, "opt.sign: 2");
  BAD(o->blend = 1, "opt.blend: 1");
  BAD(o->margin = NAN, "opt.margin: nan");
  BAD(o->gap = 0.5, "opt.gap: 0.5");
  BAD(o->significance = 0, "opt.significance: 0");
  BAD(o->tension = -1, "opt.tension: -1");
  BAD(o->rounds_tol = INFINITY, "opt.rounds_tol: inf");
  BAD(o->tolerance = -1, "opt.tolerance: -1");
  BAD(o->end_points[1][0] = 3, "opt.end_points[1]");
  BAD(o->end_tangents[0][0] = o->end_tangents[0][1] = 0, "opt.end_tangents[0]: (0, 0)");
  BAD((o->closed = 1, o->fix_ends[1] = 1), "opt.fix_ends[1]");
  BAD((o->closed = 1, o->end_tangents[0][0] = o->end_tangents[0][1] = 1), "opt.end_tangents[0]");
  BAD((o->breaks = breaks, o->break_count = 2), "opt.breaks[1]: 0.4");
  BAD(o->break_count = 2, "opt.breaks: NULL");
  BAD(o->inflection_count = 2, "opt.inflections: NULL");
  BAD((o->inflections = inflections, o->inflection_count = 3), "opt.inflections[2]: 1; must lie inside the domain");
  BAD((o->inflections = inflections + 2, o->inflection_count = 1, o->sign = 1), "opt.inflections[0]: 1; must lie");
  BAD((o->closed = 1, o->inflections = inflections, o->inflection_count = 1), "even number");
  BAD((o->breaks = breaks, o->break_count = 0, o->inflections = inflections, o->inflection_count = 2, o->sign = 1),
      "no knot between 0.2 and 0.5");
  BAD((o->breaks = breaks, o->break_count = 1, o->closed = 1, o->inflection_count = 0), "3 at least");
  BAD(o->weights = weights, "opt.weights: all 0");
  BAD((weights[3] = weights[4] = 1, o->weights = weights), "all 2 of positive weight are one point or lie on a line");
  BAD((weights[3] = -1, o->weights = weights), "opt.weights[3]: -1");
  double same[40];
  for (size_t i = 0; i < 40; i++) same[i] = 3;
  BAD((o->parameters = same, o->domain[0] = 0, o->domain[1] = 5), "opt.parameters: all are 3");
  BAD((parameters[7] = 5, o->parameters = parameters), "opt.parameters[7]: 5 is below the one before");
  BAD((parameters[7] = NAN, o->parameters = parameters), "opt.parameters[7]: nan");
  BAD((parameters[7] = 7, o->parameters = parameters, o->closed = 1), "opt.domain: NaN");
  BAD((o->parameters = parameters, o->domain[0] = 0, o->domain[1] = 30), "opt.parameters[31]: 31 is outside");
  BAD((o->domain[0] = 1, o->domain[1] = 1), "opt.domain: from 1 to 1");
  BAD((o->domain[0] = 1, o->domain[1] = 1 + 0x1p-51, o->inflection_count = 0), "too narrow");
  BAD(points[9] = NAN, "points[4][1]: nan");
  points[9] = 0;
#undef BAD
  const double tiny = 1e-300;
  job near = {.count = 40, .points = points, .o = plain};
  near.o.breaks = &tiny;
  near.o.break_count = 1;
  near.o.inflection_count = 0;
  T_STATUS(run(ctx, &near), BATTEN_E_INFEASIBLE, ctx, "are only 1e-300 apart; leave out one");
  for (size_t i = 0; i < 40; i++) weights[i] = i == 20 ? 1e300 : 1;
  near.o = plain;
  near.o.weights = weights;
  T_STATUS(run(ctx, &near), BATTEN_E_SINGULAR, ctx, "give opt.weights");
  T_CHECK(!curve, "out is untouched");
  points[9] = 1e305;
  job j = {.count = 40, .points = points, .o = plain};
  T_STATUS(run(ctx, &j), BATTEN_E_TOO_LARGE, ctx, "points[4][1]");
}

static void test_lines(batten_context *ctx) {
  double same[2 * 9], line[2 * 9];
  for (size_t i = 0; i < 18; i++) {
    same[i] = 0.1;
    line[i] = i % 2 ? 3 + 0.1 * (double)(i / 2) : 0.7 * (double)(i / 2);
  }
  job j = {.count = 9, .points = same, .o = batten_contour_options_default()};
  T_STATUS(run(ctx, &j), BATTEN_E_INVALID, ctx, "one point or lie on a line");
  j.points = line;
  T_STATUS(run(ctx, &j), BATTEN_E_INVALID, ctx, "one point or lie on a line");
}

/* A straight piece between two bends the same way: proven, and as near as a hair. */
static void test_straight(batten_context *ctx) {
  double points[2 * 120];
  for (size_t i = 0; i < 120; i++) {
    double s = (double)i / 119 * (2 + 3.14159265358979), a;
    if (s < 1.570796326794897) {
      a = s;
      points[2 * i] = sin(a);
      points[2 * i + 1] = -cos(a);
    } else if (s < 3.570796326794897) {
      points[2 * i] = 1;
      points[2 * i + 1] = s - 1.570796326794897;
    } else {
      a = s - 3.570796326794897;
      points[2 * i] = cos(a);
      points[2 * i + 1] = 2 + sin(a);
    }
  }
  job j = {.count = 120, .points = points, .o = batten_contour_options_default()};
  for (unsigned l = 1; l <= 2; l++) {
    j.o.smoothness = l;
    j.o.inflection_count = 0;
    T_OK(run(ctx, &j), ctx);
    T_CHECK(j.info.shape.certified && j.info.inflections_found == 0,
            "straight between bends, smoothness %u: proven, "
            "%zu inflections without inequalities",
            l, j.info.inflections_unconstrained);
    T_RATIO(j.info.max_error, 5e-3, "its largest distance, size 4");
  }
}

/* A wave that is to bend one way only, a convex arc that is to have two inflections, and signs the wrong way round.
 */
static void test_contradiction(batten_context *ctx) {
  double wave[2 * 200], arc[2 * 100], inflection[2] = {0.3, 0.6};
  make_wave(200, wave);
  for (size_t i = 0; i < 100; i++) {
    arc[2 * i] = cos((double)i / 40) + 1e-3 * sin(31.0 * (double)i);
    arc[2 * i + 1] = sin((double)i / 40) + 1e-3 * sin(57.0 * (double)i);
  }
  job j = {.count = 200, .points = wave, .o = batten_contour_options_default()};
  j.o.inflection_count = 0;
  T_STATUS(run(ctx, &j), BATTEN_W_SHAPE, ctx, "times as far from them as their noise explains");
  T_CHECK(j.info.shape.certified && j.info.inflections_found == 0 && j.info.misfit > 3,
          "a wave as a convex curve: proven, misfit %.1f", j.info.misfit);
  j.o.sign = -1;
  j.points = arc;
  j.count = 100;
  T_STATUS(run(ctx, &j), BATTEN_W_SHAPE, ctx, "points[");
  T_CHECK(j.info.shape.certified && j.info.shape.sign == -1, "an arc to the left as one to the right: proven");
  j.o.sign = 1;
  j.o.inflections = inflection;
  j.o.inflection_count = 2;
  T_STATUS(run(ctx, &j), BATTEN_W_SHAPE, ctx, "change the inflections or the sign");
  T_CHECK(j.info.shape.certified && j.info.inflections_found == 2, "an arc with two inflections: proven");
}

/* Repeated points, three points, an inflection next to the end, a curve that crosses itself, one that goes back. */
static void test_odd(batten_context *ctx) {
  const double three[6] = {0, 0, 1, 0.5, 2, 0}, back[14] = {0, 0, 1, 0, 2, 0.1, 3, 0, 2, -0.2, 1, -0.1, 0, -0.3};
  double points[2 * 240], late = 1 - 1e-6;
  job j = {.count = 3, .points = three, .o = batten_contour_options_default()};
  batten_status st = run(ctx, &j);
  T_CHECK(st == BATTEN_OK && j.info.shape.certified && j.info.inflections_found == 0 && isnan(j.info.misfit),
          "three points: %s, rms %.2g, misfit %g", batten_status_name(st), j.info.rms, j.info.misfit);
  j.o.closed = 1;
  st = run(ctx, &j);
  T_CHECK(st == BATTEN_OK && j.info.shape.certified, "three points, closed: %s %s", batten_status_name(st),
          st ? batten_error(ctx) : "");
  j.o.closed = 0;
  j.points = back;
  j.count = 7;
  st = run(ctx, &j);
  T_CHECK(st >= 0 && j.info.shape.certified, "there and back: %s", batten_status_name(st));
  make_wave(240, points);
  for (size_t i = 1; i < 240; i++)
    if (i % 3) memcpy(points + 2 * i, points + 2 * (i - i % 3), 2 * sizeof *points);
  j.points = points;
  j.count = 240;
  st = run(ctx, &j);
  T_CHECK(st >= 0 && j.info.shape.certified && j.info.inflections_found == 1,
          "each point three times: %s, %zu "
          "inflections",
          batten_status_name(st), j.info.inflections_found);
  j.o.inflections = &late;
  j.o.inflection_count = 1;
  st = run(ctx, &j);
  T_CHECK(st >= 0 && j.info.shape.certified, "an inflection a millionth before the end: %s %s",
          batten_status_name(st), st ? batten_error(ctx) : "");
  j.o = batten_contour_options_default();
  for (size_t i = 0; i < 240; i++) { /* a loop: cubic with a crossing */
    double t = (double)i / 120 - 1;
    points[2 * i] = 2 * t * t;
    points[2 * i + 1] = 3 * t * t * t - 1.5 * t;
  }
  st = run(ctx, &j);
  T_CHECK(st == BATTEN_OK && j.info.inflections_found == 0, "a curve that crosses itself: %s, rms %.2g",
          batten_status_name(st), j.info.rms);
  make_wave(240, points);
  j.o.inflection_count = 0;
  j.o.row_limit = 1;
  T_STATUS(run(ctx, &j), BATTEN_E_TOO_LARGE, ctx, "row_limit: 1");
}

/* A closed curve with and without its first point again. */
static void test_repeated(batten_context *ctx) {
  const contour_rule rule = {.kind = CONTOUR_LOOP, .count = 90, .inflections = 2, .noise = 0.003, .seed = 5};
  contour_scene s = contour_scene_make(&rule);
  double points[2 * 91], parameters[91];
  memcpy(points, s.points, 180 * sizeof *points);
  memcpy(points + 180, points, 2 * sizeof *points);
  batten_contour_options o = batten_contour_options_default();
  o.closed = 1;
  batten_contour_info info[2];
  batten_curve *curve[2] = {NULL, NULL};
  T_OK(batten_contour_fit(ctx, 90, points, &o, &curve[0], NULL, NULL, &info[0]), ctx);
  T_OK(batten_contour_fit(ctx, 91, points, &o, &curve[1], parameters, NULL, &info[1]), ctx);
  T_CHECK(info[0].lsq == info[1].lsq && info[0].inflections_found == 2,
          "the same sum with the first point again: %.17g, %.17g, %zu inflections", info[0].lsq, info[1].lsq,
          info[0].inflections_found);
  T_CHECK(parameters[90] == parameters[0] || parameters[90] == 1, "its parameter: %g, first %g", parameters[90],
          parameters[0]);
  for (int i = 0; i < 2; i++) batten_curve_free(curve[i]);
  contour_scene_free(&s);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_options(ctx);
  test_lines(ctx);
  test_straight(ctx);
  test_contradiction(ctx);
  test_odd(ctx);
  test_repeated(ctx);
  for (int closed = 0; closed < 2; closed++) {
    const contour_rule rule = {
        .kind = closed ? CONTOUR_LOOP : CONTOUR_WAVE, .count = 40, .inflections = 2, .noise = 0.01, .seed = 6};
    contour_scene s = contour_scene_make(&rule);
    job j = {.count = s.count, .points = s.points, .o = batten_contour_options_default()};
    j.o.closed = closed;
    j.o.rounds = 2;
    t_fail_every_allocation(closed ? "a closed fit" : "an open fit", call, &j);
    t_cancel_every_progress(closed ? "a closed fit" : "an open fit", call, &j);
    contour_scene_free(&s);
  }
  batten_context_free(ctx);
  return t_done();
}
