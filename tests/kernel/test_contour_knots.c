/* Where breaks go, and how many: kernel/contour/knots.c, density.c. */
#include "contour/density.h"
#include "contour_scenes.h"
#include "tap.h"

typedef struct rig {
  contour_scene scene;
  double *t;
  contour_data data;
  contour_knots_options opt;
  size_t pieces;
  double *breaks;
} rig;

/* Points of a scene in a box of size about 1, chord parameters, inflections where they are. */
static rig make_rig(contour_rule rule, unsigned degree, unsigned smoothness) {
  rig r = {.scene = contour_scene_make(&rule)};
  batten_context *ctx = t_context(NULL, NULL, 1);
  double scale = ldexp(1, -ilogb(r.scene.size));
  double x = r.scene.points[0], y = r.scene.points[1];
  for (size_t i = 0; i < r.scene.count; i++) {
    r.scene.points[2 * i] = scale * (r.scene.points[2 * i] - x);
    r.scene.points[2 * i + 1] = scale * (r.scene.points[2 * i + 1] - y);
  }
  r.t = malloc(r.scene.count * sizeof *r.t);
  batten_contour_parametrize(ctx, r.scene.count, r.scene.points, BATTEN_CONTOUR_CHORD, r.scene.closed, r.t);
  r.data = (contour_data){r.scene.count, r.scene.points, NULL};
  r.opt = (contour_knots_options){
      degree, smoothness, r.scene.closed, 0, 0, r.scene.inflection_count, r.scene.inflections};
  batten_context_free(ctx);
  return r;
}

static void drop(batten_context *ctx, rig *r) {
  batten_free(ctx, r->breaks);
  contour_scene_free(&r->scene);
  free(r->t);
}

static batten_status place(batten_context *ctx, rig *r) {
  batten_free(ctx, r->breaks);
  r->breaks = NULL;
  r->opt.inflections = r->scene.inflections;
  return contour_knots_place(ctx, &r->data, r->t, &r->opt, &r->pieces, &r->breaks);
}

/* What is true of all breaks: in order, from 0 to 1, inflections among them with enough between. */
static bool is_sound(const rig *r) {
  bool ok = r->breaks[0] == 0 && r->breaks[r->pieces] == 1;
  for (size_t i = 0; i < r->pieces; i++) ok = ok && r->breaks[i] < r->breaks[i + 1];
  size_t at = 0, before = 0;
  for (size_t i = 0; i < r->opt.inflection_count; i++) {
    while (at < r->pieces && r->breaks[at] < r->opt.inflections[i]) at++;
    ok = ok && r->breaks[at] == r->opt.inflections[i];
    if (i > 0 && r->opt.smoothness == 2) ok = ok && at - before >= 2;
    before = at;
  }
  return ok && r->pieces >= r->opt.spans;
}

/* Whether each function of the open space can be given a point of its own, in order [Schoenberg, Whitney]. */
static bool is_determined(const rig *r) {
  double knots[4000];
  unsigned d = r->opt.degree;
  size_t n = bspline_make_knots(d, r->opt.smoothness, r->pieces, r->breaks + 1, 0, 1, knots) - d - 1, i = 0;
  double last = -1;
  for (size_t j = 0; j < n; j++) {
    bool first = j == 0, end = j + 1 == n; /* these are 1 at the ends of their support */
    while (i < r->data.count && (r->t[i] <= last || r->t[i] < knots[j] || (!first && r->t[i] == knots[j]))) i++;
    if (i == r->data.count || r->t[i] > knots[j + d + 1] || (!end && r->t[i] == knots[j + d + 1])) return false;
    last = r->t[i];
  }
  return true;
}

/* Largest distance from the fit without inequalities, with two rounds of correction. */
static double largest_distance(batten_context *ctx, const rig *r) {
  double *t = malloc(r->data.count * sizeof *t), *squares = malloc(r->data.count * sizeof *squares), most = 0;
  memcpy(t, r->t, r->data.count * sizeof *t);
  for (int round = 0; round < 2; round++) {
    contour_least f;
    contour_least_fit(ctx, &r->data, t, r->opt.degree, r->opt.smoothness, r->opt.closed, r->pieces, r->breaks, &f);
    contour_correct(ctx, &f.space.b, r->opt.closed, f.control, &r->data, 3, t, squares);
    contour_least_free(ctx, &f);
  }
  for (size_t i = 0; i < r->data.count; i++) most = fmax(most, squares[i]);
  free(t);
  free(squares);
  return sqrt(most);
}

/* ---- cases by hand ------------------------------------------------------------------------------- */

static void test_by_hand(batten_context *ctx) {
  enum { N = 96 };
  double points[2 * N], t[N];
  for (size_t i = 0; i < N; i++) {
    t[i] = (double)i / N;
    points[2 * i] = cos(2 * acos(-1) * t[i]);
    points[2 * i + 1] = sin(2 * acos(-1) * t[i]);
  }
  contour_data data = {N, points, NULL};
  contour_knots_options opt = {.degree = 3, .smoothness = 2, .closed = true, .spans = 8};
  size_t pieces = 0;
  double *breaks = NULL, off = 0;
  T_OK(contour_knots_place(ctx, &data, t, &opt, &pieces, &breaks), ctx);
  for (size_t i = 0; i <= 8 && pieces == 8; i++) off = fmax(off, fabs(breaks[i] - (double)i / 8));
  T_CHECK(pieces == 8, "circle: %zu pieces", pieces);
  T_RATIO(off, 1e-6, "of equal lengths");
  batten_free(ctx, breaks);
  /* The reference's polygon must go round: hexagon and more, squares where curvature may jump. */
  for (unsigned smoothness = 1; smoothness <= 2; smoothness++) {
    opt = (contour_knots_options){.degree = smoothness + 1, .smoothness = smoothness, .closed = true, .spans = 1};
    T_OK(contour_knots_place(ctx, &data, t, &opt, &pieces, &breaks), ctx);
    T_CHECK(pieces == (smoothness == 2 ? 6 : 4), "one span is not enough for a circle: %zu", pieces);
    batten_free(ctx, breaks);
  }
  /* A parabola is one span of any degree. */
  for (size_t i = 0; i < N; i++) {
    t[i] = (double)i / (N - 1);
    points[2 * i] = t[i];
    points[2 * i + 1] = t[i] * t[i];
  }
  opt = (contour_knots_options){.degree = 3, .smoothness = 2};
  T_OK(contour_knots_place(ctx, &data, t, &opt, &pieces, &breaks), ctx);
  T_CHECK(pieces == 2 || pieces == 1, "parabola: %zu pieces", pieces);
  batten_free(ctx, breaks);
  /* An inflection at the start of a closed curve is no new break; two others cut runs. */
  const double inflections[] = {0, 0.5};
  opt = (contour_knots_options){
      .degree = 3, .smoothness = 2, .closed = true, .spans = 2, .inflection_count = 2, .inflections = inflections};
  T_OK(contour_knots_place(ctx, &data, t, &opt, &pieces, &breaks), ctx);
  bool half = false;
  for (size_t i = 1; i < pieces; i++) half = half || breaks[i] == 0.5;
  T_CHECK(pieces >= 4 && half, "inflections at 0 and 1/2 of a closed curve: %zu pieces", pieces);
  batten_free(ctx, breaks);
}

/* ---- random scenes ------------------------------------------------------------------------------- */

static void test_random(batten_context *ctx) {
  size_t sound = 0, tried = 0, exact = 0, determined = 0, counted = 0, noisy = 0, many = 0;
  for (uint64_t seed = 0; seed < 150; seed++) {
    contour_rule rule = contour_rule_random(seed);
    unsigned smoothness = 1 + (unsigned)seed % 2, degree = smoothness + 1 + (unsigned)(seed / 2) % 4;
    rig r = make_rig(rule, degree, smoothness);
    size_t fold = degree - smoothness;
    for (size_t spans = 0; spans < 2 * r.data.count / fold; spans = 4 * spans + 10) {
      r.opt.spans = spans;
      batten_status st = place(ctx, &r);
      tried++;
      sound += st == BATTEN_OK && is_sound(&r);
      if (st != BATTEN_OK || !is_sound(&r))
        printf("# seed %d, degree %u, %zu spans: %s %s\n", (int)seed, degree, spans, batten_status_name(st),
               batten_error(ctx));
      if (spans == 0 && rule.noise > 0.005) {
        noisy++;
        many += r.pieces > 15 + 3 * rule.inflections;
      }
      if (spans < 50 || r.opt.closed || 3 * spans * fold > r.data.count || 3 * spans * fold > 3900) continue;
      counted++;
      exact += r.pieces == spans;
      determined += is_determined(&r);
    }
    drop(ctx, &r);
  }
  T_CHECK(sound == tried, "%zu of %zu breaks in order, with inflections and enough between", sound, tried);
  T_CHECK(exact == counted && counted > 30, "%zu of %zu have as many spans as asked for", exact, counted);
  T_CHECK(determined == counted, "%zu of %zu leave all unknowns determined by the data", determined, counted);
  T_CHECK(many * 20 < noisy, "%zu of %zu noisy scenes get more than 15 spans and 3 an inflection", many, noisy);
}

/* ---- how many ------------------------------------------------------------------------------------ */

static void test_structure(batten_context *ctx) {
  size_t most = 0;
  for (int kind = 0; kind < CONTOUR_KINDS; kind++) {
    size_t pieces[3];
    static const double noises[3] = {0, 0.001, 0.02};
    for (int k = 0; k < 3; k++) {
      rig r = make_rig(
          (contour_rule){.kind = (contour_kind)kind, .count = 300, .inflections = 2, .noise = noises[k], .seed = 5},
          3, 2);
      T_OK(place(ctx, &r), ctx);
      pieces[k] = r.pieces;
      drop(ctx, &r);
    }
    most = pieces[0] > most ? pieces[0] : most;
    T_CHECK(pieces[0] >= pieces[2] && pieces[2] <= 20, "kind %d, noise 0, 0.1 %%, 2 %%: %zu, %zu, %zu pieces", kind,
            pieces[0], pieces[1], pieces[2]);
  }
  T_CHECK(most < 100, "exact data of 300 points get %zu pieces at most", most);
}

/* Waves that few spans tell nothing of: numbers that do not help must not stop the search. */
static void test_hidden(batten_context *ctx) {
  enum { N = 4000 };
  double *points = malloc(2 * N * sizeof *points), *t = malloc(N * sizeof *t);
  uint64_t seed = 1;
  for (size_t i = 0; i < N; i++) {
    t[i] = (double)i / (N - 1);
    points[2 * i] = t[i];
    points[2 * i + 1] = 0.02 * sin(500 * t[i]) + 0.002 * contour_scene_normal(&seed);
  }
  contour_data data = {N, points, NULL};
  contour_knots_options opt = {.degree = 3, .smoothness = 2};
  size_t pieces = 0;
  double *breaks = NULL;
  T_OK(contour_knots_place(ctx, &data, t, &opt, &pieces, &breaks), ctx);
  contour_least f;
  contour_left left;
  T_OK(contour_least_fit(ctx, &data, t, 3, 2, false, pieces, breaks, &f), ctx);
  contour_left_of(&f.space.b, f.control, &data, t, &left);
  T_CHECK(pieces > 160 && pieces < 1000 && left.rms < 0.0022, "80 waves of 10 noises: %zu pieces, %g is left", pieces,
          left.rms);
  contour_least_free(ctx, &f);
  batten_free(ctx, breaks);
  free(points);
  free(t);
}

/* Breaks gather at the nose of a section, where data lie evenly. */
static void test_need(batten_context *ctx) {
  rig r = make_rig((contour_rule){.kind = CONTOUR_AIRFOIL, .count = 400, .seed = 3}, 3, 2);
  r.opt.spans = 40;
  r.opt.inflection_count = 0;
  T_OK(place(ctx, &r), ctx);
  size_t nose = 0;
  for (size_t i = 0; i <= r.pieces; i++) nose += fabs(r.breaks[i] - 0.5) < 0.05;
  T_CHECK(nose >= 8, "%zu of 40 breaks lie in the tenth around the nose; evenly they would be 4", nose);
  double placed = largest_distance(ctx, &r);
  for (size_t i = 0; i <= r.pieces; i++) r.breaks[i] = (double)i / (double)r.pieces;
  double even = largest_distance(ctx, &r);
  T_RATIO(placed, even / 3, "largest distance of the section's points, beside even breaks");
  drop(ctx, &r);
}

static void test_tolerance(batten_context *ctx) {
  static const double tolerances[] = {3e-2, 1e-3, 1e-4};
  for (uint64_t seed = 0; seed < 9; seed++) {
    contour_kind kind = (contour_kind)(seed % 3 == 0 ? CONTOUR_WAVE : seed % 3 == 1 ? CONTOUR_LOOP : CONTOUR_AIRFOIL);
    rig r = make_rig((contour_rule){.kind = kind, .count = 200, .inflections = 2, .seed = seed},
                     3 + (unsigned)seed % 2, 2);
    r.opt.tolerance = tolerances[seed / 3];
    T_OK(place(ctx, &r), ctx);
    size_t pieces = r.pieces;
    double most = largest_distance(ctx, &r), fewer = INFINITY;
    bool sound = is_sound(&r);
    r.opt.tolerance = 0;
    r.opt.spans = 1;
    T_OK(place(ctx, &r), ctx);
    size_t least = r.pieces;
    if (pieces > least) {
      r.opt.spans = pieces - 1;
      T_OK(place(ctx, &r), ctx);
      fewer = largest_distance(ctx, &r);
    }
    T_CHECK(sound && most <= tolerances[seed / 3] && fewer > tolerances[seed / 3],
            "tolerance %g: %zu pieces bring %g, one less %g", tolerances[seed / 3], pieces, most, fewer);
    drop(ctx, &r);
  }
  rig r = make_rig((contour_rule){.kind = CONTOUR_WAVE, .count = 30, .noise = 0.05, .seed = 2}, 3, 2);
  r.opt.tolerance = 1e-12;
  T_OK(place(ctx, &r), ctx);
  T_CHECK(is_sound(&r) && r.pieces <= 30, "a tolerance out of reach ends at %zu pieces for 30 points", r.pieces);
  drop(ctx, &r);
}

/* ---- invariance ---------------------------------------------------------------------------------- */

static void test_invariance(batten_context *ctx) {
  double off = 0;
  size_t other_number = 0, other_bits = 0;
  batten_context *threads = t_context(NULL, NULL, 4);
  for (uint64_t seed = 0; seed < 40; seed++) {
    contour_rule rule = contour_rule_random(seed);
    rig r = make_rig(rule, 3, 2);
    size_t n = r.data.count;
    if (seed % 2) r.opt.tolerance = 0.01;
    place(ctx, &r);
    size_t pieces = r.pieces;
    double *breaks = r.breaks;
    r.breaks = NULL;
    for (size_t i = 0; i < 2 * n; i++) r.scene.points[i] *= 0x1p-40;
    r.opt.tolerance *= 0x1p-40;
    place(threads, &r);
    other_bits += r.pieces != pieces || memcmp(breaks, r.breaks, (pieces + 1) * sizeof *breaks);
    batten_free(threads, r.breaks);
    r.breaks = NULL;
    for (size_t i = 0; i < 2 * n; i++) r.scene.points[i] *= 0x1p40;
    r.opt.tolerance *= 0x1p40;
    size_t skip = r.opt.closed; /* the first point stays the first */
    for (size_t i = skip, j = n - 1; i < j; i++, j--) {
      for (size_t k = 0; k < 2; k++) {
        double x = r.scene.points[2 * i + k];
        r.scene.points[2 * i + k] = r.scene.points[2 * j + k];
        r.scene.points[2 * j + k] = x;
      }
      double t = 1 - r.t[i];
      r.t[i] = 1 - r.t[j];
      r.t[j] = t;
    }
    if (skip == 0 && n % 2) r.t[n / 2] = 1 - r.t[n / 2];
    if (skip == 1 && n % 2 == 0) r.t[n / 2] = 1 - r.t[n / 2];
    for (size_t i = 0; i < r.scene.inflection_count; i++) r.scene.inflections[i] = 1 - r.scene.inflections[i];
    for (size_t i = 0, j = r.scene.inflection_count; i + 1 < j--; i++) {
      double x = r.scene.inflections[i];
      r.scene.inflections[i] = r.scene.inflections[j];
      r.scene.inflections[j] = x;
    }
    place(ctx, &r);
    other_number += r.pieces != pieces;
    for (size_t i = 0; i <= pieces && r.pieces == pieces; i++)
      off = fmax(off, fabs(r.breaks[pieces - i] + breaks[i] - 1));
    batten_free(ctx, breaks);
    drop(ctx, &r);
  }
  T_CHECK(other_bits == 0, "scaled by a power of two, 4 threads: %zu of 40 have other bits", other_bits);
  T_CHECK(other_number == 0, "reversed: %zu of 40 have another number", other_number);
  T_RATIO(off, 1e-9, "reversed: breaks become 1 - breaks");
  batten_context_free(threads);
}

/* ---- edges --------------------------------------------------------------------------------------- */

static void test_edges(batten_context *ctx) {
  double points[] = {0, 0, 1, 0, 1, 1, 1, 1, 0, 1}, t[] = {0, 0.3, 0.7, 0.7, 1}, weights[] = {0, 1, 0, 1, 1};
  contour_data data = {5, points, NULL};
  const double near[] = {0.4, 0.4 + 1e-15, 0.5};
  for (size_t count = 2; count <= 5; count++)
    for (unsigned degree = 2; degree <= 9; degree++)
      for (unsigned closed = 0; closed < 2; closed++) {
        size_t pieces = 0;
        double *breaks = NULL;
        data.count = count;
        data.weights = count == 5 ? weights : NULL;
        contour_knots_options opt = {.degree = degree,
                                     .smoothness = degree > 2 ? 2 : 1,
                                     .closed = closed != 0,
                                     .spans = degree % 3 * 20,
                                     .inflection_count = degree % 4 < 2 ? 3 : 0,
                                     .inflections = near};
        batten_status st = contour_knots_place(ctx, &data, t, &opt, &pieces, &breaks);
        bool ok = st == BATTEN_OK && breaks[0] == 0 && breaks[pieces] == 1;
        for (size_t i = 0; ok && i < pieces; i++) ok = breaks[i] < breaks[i + 1];
        T_CHECK(ok, "%zu points, degree %u, %s: %s, %zu pieces", count, degree, closed ? "closed" : "open",
                batten_status_name(st), pieces);
        batten_free(ctx, breaks);
      }
  contour_knots_options opt = {.degree = 3, .smoothness = 2, .spans = SIZE_MAX / 8};
  size_t pieces = 7;
  double *breaks = points;
  T_STATUS(contour_knots_place(ctx, &data, t, &opt, &pieces, &breaks), BATTEN_E_TOO_LARGE, ctx, "opt.spans: ");
  T_CHECK(pieces == 7 && breaks == points, "outputs are left alone");
}

static batten_status once(batten_context *ctx, void *arg) {
  rig *r = arg;
  size_t pieces;
  double *breaks = NULL;
  r->opt.inflections = r->scene.inflections;
  batten_status st = contour_knots_place(ctx, &r->data, r->t, &r->opt, &pieces, &breaks);
  batten_free(ctx, breaks);
  return st;
}

static void test_failures(batten_context *ctx) {
  rig r =
      make_rig((contour_rule){.kind = CONTOUR_WAVE, .count = 25, .inflections = 1, .noise = 0.02, .seed = 2}, 3, 2);
  t_fail_every_allocation("spans that the data speak for", once, &r);
  t_cancel_every_progress("spans that the data speak for", once, &r);
  r.opt.tolerance = 0.02;
  t_fail_every_allocation("spans for a tolerance", once, &r);
  t_cancel_every_progress("spans for a tolerance", once, &r);
  drop(ctx, &r);
}

static void test_time(batten_context *ctx) {
  for (size_t count = 1000; count <= 100000; count *= 10) {
    rig r = make_rig(
        (contour_rule){.kind = CONTOUR_WAVE, .count = count, .inflections = 4, .noise = 0.001, .seed = 9}, 3, 2);
    double start = batten_now();
    T_OK(place(ctx, &r), ctx);
    double structure = batten_now() - start;
    size_t pieces = r.pieces;
    r.opt.tolerance = 0.01;
    T_OK(place(ctx, &r), ctx);
    double tolerance = batten_now() - start - structure;
    size_t for_tolerance = r.pieces;
    r.opt.spans = count / 50;
    T_OK(place(ctx, &r), ctx);
    printf("# %zu points: by structure %zu pieces, %.1f ms; for a tolerance %zu, %.1f ms; given %zu, %.1f ms\n",
           count, pieces, 1e3 * structure, for_tolerance, 1e3 * tolerance, r.pieces,
           1e3 * (batten_now() - start - structure - tolerance));
    drop(ctx, &r);
  }
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_by_hand(ctx);
  test_random(ctx);
  test_structure(ctx);
  test_hidden(ctx);
  test_need(ctx);
  test_tolerance(ctx);
  test_invariance(ctx);
  test_edges(ctx);
  test_failures(ctx);
  test_time(ctx);
  batten_context_free(ctx);
  return t_done();
}
