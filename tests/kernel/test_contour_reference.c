/* Reference curves of both constructions. Signs are proven by code of this test alone: Bezier points of each span by
 * de Boor's triangle, Bernstein coefficients of [x', x''], bisection. */
#include "tap.h"

#include "contour/contour_inner.h"
#include "contour_scenes.h"

#include <float.h>
#include <time.h>

enum { SPANS_MAX = 2100, POINTS_MAX = 9000 };

/* ---- the proof ------------------------------------------------------------------------------------ */

/* Bezier points of span mu, out [degree + 1][2]: blossoms at its ends. */
static void bezier(const bspline *b, const double *control, size_t mu, double (*out)[2]) {
  unsigned d = b->degree;
  double from = b->knots[mu], to = b->knots[mu + 1];
  for (unsigned i = 0; i <= d; i++) {
    double p[10][2];
    for (unsigned j = 0; j <= d; j++) memcpy(p[j], control + 2 * (mu - d + j), sizeof p[j]);
    for (unsigned r = 1; r <= d; r++)
      for (unsigned j = d; j >= r; j--) {
        double left = b->knots[mu - d + j], right = b->knots[mu + j + 1 - r], at = r <= i ? to : from;
        for (int k = 0; k < 2; k++) p[j][k] = ((right - at) * p[j - 1][k] + (at - left) * p[j][k]) / (right - left);
      }
    memcpy(out[i], p[d], sizeof out[i]);
  }
}

static double choose(unsigned n, unsigned k) {
  double value = 1;
  for (unsigned i = 1; i <= k; i++) value = value * (n - k + i) / i;
  return value;
}

/* Coefficients [n + 1] all positive after bisection. */
static bool positive(unsigned n, const double *c, int depth) {
  double left[20], right[20];
  bool all = true;
  for (unsigned i = 0; i <= n; i++) all = all && c[i] > 0;
  if (all) return true;
  if (depth == 0 || !(c[0] > 0) || !(c[n] > 0)) return false;
  memcpy(right, c, (n + 1) * sizeof *c);
  for (unsigned r = 0; r <= n; r++) {
    left[r] = right[0];
    for (unsigned i = 0; i + r < n; i++) right[i] = (right[i] + right[i + 1]) / 2;
  }
  /* After n rounds of means right[0] is the middle; redo them from the other side. */
  memcpy(right, c, (n + 1) * sizeof *c);
  double rest[20];
  for (unsigned r = 0; r <= n; r++) {
    rest[n - r] = right[n - r];
    for (unsigned i = n - r; i > 0; i--) right[i] = (right[i] + right[i - 1]) / 2;
  }
  return positive(n, left, depth - 1) && positive(n, rest, depth - 1);
}

/* Divides by the distance from the left (right) end, where the first (last) coefficient is 0 to rounding. */
static bool divide(unsigned *n, double *c, bool right, double rounding) {
  if (fabs(c[right ? *n : 0]) > rounding) return false;
  for (unsigned i = 0; i < *n; i++)
    c[i] = right ? c[i] * (double)*n / (double)(*n - i) : c[i + 1] * (double)*n / (double)(i + 1);
  --*n;
  return true;
}

/* The first span that has not the wanted sign throughout; spans when all have. */
static size_t first_wrong(const contour_shape *s, const bspline *b, const double *control) {
  unsigned d = b->degree;
  size_t span = 0;
  for (size_t mu = d; mu < b->count; mu++) {
    if (!(b->knots[mu] < b->knots[mu + 1])) continue;
    double p[10][2], first[10][2], second[10][2], c[20] = {0};
    bezier(b, control, mu, p);
    for (unsigned i = 0; i < d; i++)
      for (int k = 0; k < 2; k++) first[i][k] = p[i + 1][k] - p[i][k];
    for (unsigned i = 0; i + 1 < d; i++)
      for (int k = 0; k < 2; k++) second[i][k] = first[i + 1][k] - first[i][k];
    unsigned n = 2 * d - 3;
    for (unsigned i = 0; i < d; i++)
      for (unsigned j = 0; j + 1 < d; j++)
        c[i + j] += s->signs[span] * choose(d - 1, i) * choose(d - 2, j) / choose(n, i + j) *
                    (first[i][0] * second[j][1] - first[i][1] * second[j][0]);
    bool good = true;
    double leg = 0;
    for (unsigned i = 0; i < d; i++) leg = fmax(leg, hypot(first[i][0], first[i][1]));
    double rounding = 100 * d * d * DBL_EPSILON * leg; /* of points of size 1, in second differences */
    if (s->smoothness == 2 && contour_inflection(s, span)) good = divide(&n, c, false, rounding);
    if (good && s->smoothness == 2 && contour_inflection(s, span + 1)) good = divide(&n, c, true, rounding);
    if (!good || !positive(n, c, 30)) return span;
    span++;
  }
  return span;
}

/* ---- cases ---------------------------------------------------------------------------------------- */

typedef struct trial {
  contour_scene scene;
  contour_shape shape;
  contour_data data;
  double *parameters, *breaks;
  signed char *signs;
  const contour_ends *ends;
  unsigned construction;
  double tension;
  contour_row_options rows;
  /* results */
  contour_space space;
  double *control;
  unsigned by;
  bool fallback;
  double rms, truth;
} trial;

static int ascending(const void *x, const void *y) {
  double a = *(const double *)x, b = *(const double *)y;
  return a < b ? -1 : a > b;
}

/* A scene of size 1 with about `spans` spans: inflections are breaks, and one break lies between two of them. */
static trial trial_make(const contour_rule *r, unsigned degree, unsigned smoothness, size_t spans, double jitter) {
  trial t = {.scene = contour_scene_make(r)};
  uint64_t state = r->seed + 17;
  contour_scene *s = &t.scene;
  t.parameters = malloc(s->count * sizeof *t.parameters);
  t.breaks = malloc(SPANS_MAX * sizeof *t.breaks);
  t.signs = malloc(SPANS_MAX);
  double origin[2] = {s->points[0], s->points[1]};
  for (size_t i = 0; i < 2 * s->count; i++) {
    s->points[i] = (s->points[i] - origin[i % 2]) / s->size;
    s->truth[i] = (s->truth[i] - origin[i % 2]) / s->size;
  }
  memcpy(t.parameters, s->lengths, s->count * sizeof *t.parameters);
  size_t n = 0;
  t.breaks[n++] = 0;
  for (size_t i = 0; i < s->inflection_count; i++) {
    if (i > 0 && smoothness == 2) t.breaks[n++] = (s->inflections[i - 1] + s->inflections[i]) / 2;
    t.breaks[n++] = s->inflections[i];
  }
  t.breaks[n++] = 1;
  for (size_t i = 1; i < spans; i++) {
    double at = ((double)i + jitter * (t_uniform(&state) - 0.5)) / (double)spans;
    bool far = true;
    for (size_t k = 0; k < n; k++) far = far && fabs(t.breaks[k] - at) > 0.2 / (double)spans;
    if (far) t.breaks[n++] = at;
  }
  qsort(t.breaks, n, sizeof *t.breaks, ascending);
  int sign = s->sign;
  for (size_t i = 0; i + 1 < n; i++) {
    for (size_t k = 0; k < s->inflection_count; k++)
      if (t.breaks[i] == s->inflections[k]) sign = -sign;
    t.signs[i] = (signed char)sign;
  }
  t.shape = (contour_shape){degree, smoothness, s->closed, n - 1, t.breaks, t.signs};
  t.data = (contour_data){s->count, s->points, NULL};
  t.tension = 1e-12;
  t.rows = (contour_row_options){.gap = 0.1, .depth_max = 12, .margin = 1e-3, .row_limit = SIZE_MAX};
  return t;
}

static void trial_drop(batten_context *ctx, trial *t) {
  contour_space_free(ctx, &t->space);
  free(t->control);
  t->control = NULL;
}
static void trial_free(batten_context *ctx, trial *t) {
  trial_drop(ctx, t);
  free(t->parameters);
  free(t->breaks);
  free(t->signs);
  contour_scene_free(&t->scene);
}

static batten_status trial_run(batten_context *ctx, trial *t) {
  trial_drop(ctx, t);
  const contour_shape *s = &t->shape;
  batten_status st = contour_space_make(ctx, s, s->degree, s->smoothness == 2, t->ends, &t->space);
  if (st < 0) return st;
  t->control = malloc(2 * t->space.b.count * sizeof *t->control);
  contour_reference out = {.control = t->control};
  st = contour_reference_find(ctx, s, &t->space, t->ends, &t->data, t->parameters, t->construction, t->tension,
                              &t->rows, &out);
  if (st < 0) return st;
  contour_data truth = {t->data.count, t->scene.truth, NULL};
  t->by = out.construction;
  t->fallback = out.fallback;
  t->rms = sqrt(contour_sum(&t->space.b, t->control, &t->data, t->parameters) / (double)t->data.count);
  t->truth = sqrt(contour_sum(&t->space.b, t->control, &truth, t->parameters) / (double)t->data.count);
  return st;
}

static bool right_signs(const trial *t) { return first_wrong(&t->shape, &t->space.b, t->control) == t->shape.spans; }

/* Largest jump of a derivative 0 .. smoothness over the seam, in parts of what it is. */
static double seam(const trial *t) {
  const bspline *b = &t->space.b;
  unsigned d = b->degree;
  double first[30], last[30], jump = 0;
  bspline_basis(b, bspline_span(b, 0), 0, 2, first);
  bspline_basis(b, bspline_span(b, 1), 1, 2, last);
  for (unsigned k = 0; k <= t->shape.smoothness; k++) {
    double u[2] = {0, 0}, v[2] = {0, 0};
    for (unsigned j = 0; j <= d; j++)
      for (int c = 0; c < 2; c++) {
        u[c] += first[k * (d + 1) + j] * t->control[2 * j + (size_t)c];
        v[c] += last[k * (d + 1) + j] * t->control[2 * (b->count - 1 - d + j) + (size_t)c];
      }
    jump = fmax(jump, hypot(u[0] - v[0], u[1] - v[1]) / (hypot(u[0], u[1]) + pow((double)t->shape.spans, k)));
  }
  return jump;
}

static void test_parabola(batten_context *ctx) {
  /* (t, t^2) is in every space: least squares find it, and so do legs of its directions. */
  trial t = trial_make(&(contour_rule){.kind = CONTOUR_SINE, .count = 40}, 3, 2, 5, 1);
  for (size_t i = 0; i < t.data.count; i++) {
    t.parameters[i] = (double)i / (double)(t.data.count - 1);
    t.scene.points[2 * i] = t.parameters[i];
    t.scene.points[2 * i + 1] = t.parameters[i] * t.parameters[i];
  }
  for (t.construction = 1; t.construction <= 2; t.construction++) {
    T_OK(trial_run(ctx, &t), ctx);
    T_CHECK(t.by == t.construction, "construction %u", t.by);
    T_RATIO(t.rms, t.construction == 2 ? 1e-8 : 1e-4, "construction %u finds a parabola", t.construction);
  }
  for (size_t i = 0; i < t.shape.spans; i++) t.signs[i] = -1;
  for (t.construction = 0; t.construction < 2; t.construction++) {
    T_OK(trial_run(ctx, &t), ctx);
    T_CHECK(right_signs(&t), "construction %u: a parabola that is to bend the other way does", t.by);
    T_RATIO(t.rms, 0.12, "and stays near the chord");
  }
  trial_free(ctx, &t);
}

/* Every kind, degree and smoothness by both constructions. */
static void test_random(batten_context *ctx) {
  enum { CASES = 300 };
  size_t second = 0, first = 0, wrong = 0, failed = 0, better = 0, both = 0, nearer = 0, fallbacks = 0;
  double jump = 0, ratio = 0;
  for (uint64_t seed = 0; seed < CASES; seed++) {
    contour_rule r = contour_rule_random(seed + 5000);
    uint64_t state = seed;
    unsigned smoothness = 1 + seed % 2, degree = smoothness + 1 + (unsigned)(seed / 2 % (9 - smoothness));
    r.count = r.count > 600 ? 600 : r.count;
    size_t spans = 4 + (size_t)(t_uniform(&state) * (double)r.count / 4);
    trial t = trial_make(&r, degree, smoothness, spans, seed % 3 ? 1.4 : 0);
    double rms[3] = {0, 0, 0};
    for (t.construction = 1; t.construction <= 2; t.construction++) {
      if (trial_run(ctx, &t) < 0) {
        if (t.construction == 1) printf("# seed %d: %s\n", (int)seed, batten_error(ctx));
        failed += t.construction == 1;
        continue;
      }
      *(t.construction == 1 ? &first : &second) += 1;
      rms[t.construction] = t.rms;
      size_t at = first_wrong(&t.shape, &t.space.b, t.control);
      if (at < t.shape.spans)
        printf("# seed %d construction %u kind %d degree %u smoothness %u: span %zu of %zu\n", (int)seed,
               t.construction, r.kind, degree, smoothness, at, t.shape.spans);
      wrong += at < t.shape.spans;
      if (t.shape.closed) jump = fmax(jump, seam(&t));
    }
    t.construction = 0;
    bool found = trial_run(ctx, &t) >= 0;
    fallbacks += found && t.fallback;
    if (found && rms[1] > 0 && rms[2] > 0) {
      nearer += t.rms == fmin(rms[1], rms[2]);
      both++;
      better += rms[2] < rms[1];
      ratio += log(rms[2] / rms[1]);
    }
    trial_free(ctx, &t);
  }
  T_CHECK(failed == 0 && first == CASES, "construction 1 serves in all of %d cases", CASES);
  T_CHECK(second >= CASES * 9 / 10, "construction 2 serves in %zu of %d", second, CASES);
  T_CHECK(first == CASES && fallbacks == CASES - second, "construction 1 is called the fallback in the other %zu",
          fallbacks);
  T_CHECK(wrong == 0, "all have the wanted signs");
  T_CHECK(both > 0 && nearer == both, "of both the nearer one is taken");
  T_RATIO(jump, 1e-9, "closed ones are smooth where they close");
  printf("# construction 2 is nearer to the data in %zu of %zu, its distance is %.3f of the other's\n", better, both,
         exp(ratio / (double)both));
}

/* One to three turns on few spans: legs of higher degree follow where those of degree smoothness + 1 cannot. */
static void test_spirals(batten_context *ctx) {
  for (uint64_t seed = 0; seed < 4; seed++)
    for (unsigned smoothness = 1; smoothness <= 2; smoothness++) {
      contour_rule r = {.kind = CONTOUR_SPIRAL, .count = 100, .seed = seed};
      trial t = trial_make(&r, 5, smoothness, 6, 0);
      t.construction = 1;
      T_OK(trial_run(ctx, &t), ctx);
      T_CHECK(right_signs(&t), "a spiral of few spans bends to its side");
      T_RATIO(t.rms, 0.01, "and follows its data: smoothness %u, seed %d", smoothness, (int)seed);
      trial_free(ctx, &t);
    }
}

static void test_ends(batten_context *ctx) {
  contour_rule r = {.kind = CONTOUR_WAVE, .count = 80, .inflections = 2, .noise = 0.01, .seed = 3};
  for (unsigned smoothness = 1; smoothness <= 2; smoothness++) {
    trial t = trial_make(&r, smoothness + 2, smoothness, 12, 0);
    const double *p = t.scene.truth, *q = t.scene.truth + 2 * (r.count - 2);
    contour_ends ends;
    for (int k = 0; k < 2; k++) {
      ends.point[0][k] = p[k];
      ends.point[1][k] = q[2 + k];
      ends.tangent[0][k] = (p[2 + k] - p[k]) / hypot(p[2] - p[0], p[3] - p[1]);
      ends.tangent[1][k] = (q[2 + k] - q[k]) / hypot(q[2] - q[0], q[3] - q[1]);
    }
    t.ends = &ends;
    for (t.construction = 1; t.construction <= 2; t.construction++) {
      T_OK(trial_run(ctx, &t), ctx);
      const double *c = t.control, *e = c + 2 * (t.space.b.count - 1);
      double off = fabs(c[0] - p[0]) + fabs(c[1] - p[1]) + fabs(e[0] - q[2]) + fabs(e[1] - q[3]);
      T_RATIO(off, 1e-14, "construction %u begins and ends where it should", t.construction);
      double first[2] = {c[2] - c[0], c[3] - c[1]}, last[2] = {e[0] - e[-2], e[1] - e[-1]};
      T_RATIO(fabs(contour_cross(first, ends.tangent[0])) + fabs(contour_cross(last, ends.tangent[1])), 1e-13,
              "in the directions it should");
      T_CHECK(first[0] * ends.tangent[0][0] + first[1] * ends.tangent[0][1] > 0 &&
                  last[0] * ends.tangent[1][0] + last[1] * ends.tangent[1][1] > 0,
              "and not backwards");
      T_CHECK(right_signs(&t), "with the wanted signs; distance %.4f", t.rms);
    }
    trial_free(ctx, &t);
  }
}

/* Points of an arc below the chord from (0, 0) to (1, 0), which turns left. */
static trial make_arc(unsigned degree, unsigned smoothness, size_t spans) {
  trial t = trial_make(&(contour_rule){.kind = CONTOUR_SINE, .count = 20}, degree, smoothness, spans, 0);
  for (size_t i = 0; i < t.data.count; i++) {
    double x = t.parameters[i];
    t.scene.points[2 * i] = x;
    t.scene.points[2 * i + 1] = -x * (1 - x);
  }
  memset(t.signs, 1, t.shape.spans);
  return t;
}

/* The ends of that chord, with tangents that make these angles with it, degrees. */
static contour_ends chord(double first, double last) {
  double a = first * SCENE_PI / 180, b = last * SCENE_PI / 180;
  return (contour_ends){{{0, 0}, {1, 0}}, {{cos(a), -sin(a)}, {cos(b), sin(b)}}};
}

static void test_tangents(batten_context *ctx) {
  contour_ends ends = chord(45, 45);
  trial t = make_arc(3, 2, 4);
  t.ends = &ends;
  T_OK(trial_run(ctx, &t), ctx);
  T_CHECK(right_signs(&t), "an arc between fixed ends");
  for (size_t i = 0; i < t.shape.spans; i++) t.signs[i] = -1; /* that would have to go round */
  T_STATUS(trial_run(ctx, &t), BATTEN_E_INFEASIBLE, ctx, "the fixed ends contradict the signs");
  trial_free(ctx, &t);
  /* One piece and both tangents: a parabola has no length of legs to choose, but a cubic has. */
  t = make_arc(3, 1, 1);
  t.ends = &ends;
  for (t.construction = 0; t.construction <= 2; t.construction++) {
    T_OK(trial_run(ctx, &t), ctx);
    T_CHECK(right_signs(&t), "one piece between fixed ends, construction %u", t.construction);
  }
  trial_free(ctx, &t);
  /* Tangents that differ much: legs on one side are many times as long as those on the other. */
  for (unsigned smoothness = 1; smoothness <= 2; smoothness++)
    for (int slope = 10; slope <= 80; slope += 10)
      for (int flat = 0; flat < 2; flat++) {
        ends = flat ? chord(2.5, slope) : chord(slope, 2.5);
        t = make_arc(4, smoothness, 5);
        t.ends = &ends;
        t.construction = 1;
        T_OK(trial_run(ctx, &t), ctx);
        T_CHECK(right_signs(&t), "smoothness %u, %d degrees at one end, 2.5 at the other", smoothness, slope);
        trial_free(ctx, &t);
      }
}

/* Inflections at neighbouring breaks: straight for cubics, but not for degree 4. */
static void test_neighbours(batten_context *ctx) {
  contour_rule r = {.kind = CONTOUR_SINE, .count = 90, .inflections = 3, .noise = 0.002, .seed = 4};
  trial t = trial_make(&r, 4, 2, 1, 0);
  size_t n = 0;
  for (size_t i = 0; i <= t.shape.spans; i++) /* without the breaks between */
    if (i == 0 || i == t.shape.spans || contour_inflection(&t.shape, i)) t.breaks[n++] = t.breaks[i];
  for (size_t i = 0; i + 1 < n; i++) t.signs[i] = (signed char)(i % 2 ? -t.signs[0] : t.signs[0]);
  t.shape.spans = n - 1;
  for (t.shape.degree = 4; t.shape.degree <= 6; t.shape.degree++)
    for (t.construction = 1; t.construction <= 2; t.construction++) {
      T_OK(trial_run(ctx, &t), ctx);
      T_CHECK(right_signs(&t), "degree %u, construction %u, inflections at neighbouring breaks; distance %.4f",
              t.shape.degree, t.construction, t.rms);
    }
  t.shape.degree = 4;
  t.construction = 0;
  T_OK(trial_run(ctx, &t), ctx);
  t.shape.degree = 3;
  contour_reference out = {.control = t.control};
  T_STATUS(contour_reference_find(ctx, &t.shape, &t.space, NULL, &t.data, t.parameters, 0, 0, &t.rows, &out),
           BATTEN_E_INFEASIBLE, ctx, "a cubic piece is straight");
  trial_free(ctx, &t);
}

/* Rows can be written around what is accepted, however strict they are to be; and fewer bisections are no failure of
 * the fit but of the reference. */
static void test_strict(batten_context *ctx) {
  contour_rule r = {.kind = CONTOUR_WAVE, .count = 150, .inflections = 2, .noise = 0.02, .seed = 6};
  trial t = trial_make(&r, 5, 2, 14, 1);
  const double gaps[3] = {1e-6, 0.1, 0.49};
  size_t found = 0, refused = 0, kept = 0;
  for (int g = 0; g < 3; g++)
    for (unsigned depth = 0; depth <= 12; depth += 3) {
      t.rows.gap = gaps[g];
      t.rows.depth_max = depth;
      batten_status st = trial_run(ctx, &t);
      if (st < 0) {
        refused += st == BATTEN_E_INFEASIBLE;
        continue;
      }
      bool accepted = false;
      found++;
      T_OK(contour_rows_make(ctx, &t.shape, &t.space.b, t.control, &t.rows, NULL, &accepted, NULL), ctx);
      kept += accepted;
    }
  /* An inflection all but at the end. */
  t.breaks[1] = 1e-12;
  t.signs[0] = (signed char)-t.signs[1];
  T_STATUS(trial_run(ctx, &t), BATTEN_E_INFEASIBLE, ctx, "two knots or inflections at 0 (of [0, 1]) are only 1e-12");
  T_CHECK(found + refused == 15 && kept == found && found >= 12, "strict rows: %zu references, %zu with rows", found,
          kept);
  trial_free(ctx, &t);
}

static void fill(trial *t, int what, uint64_t seed) {
  for (size_t i = 0; i < t->data.count; i++) {
    double x = t->parameters[i], *p = t->scene.points + 2 * i;
    switch (what) {
      case 0:
        p[0] = x, p[1] = 0;
        break; /* straight */
      case 1:
        p[0] = x, p[1] = 1e-9 * sin(40 * x);
        break; /* to rounding */
      case 2:
        p[0] = t_uniform(&seed), p[1] = t_uniform(&seed);
        break; /* noise alone */
      case 3:
        p[0] = floor(8 * x) / 8, p[1] = p[0] * p[0];
        break; /* repeated points */
      case 4:
        p[0] = x, p[1] = x < 0.3 || x > 0.8 ? x * x : p[1];
        break; /* see the gap below */
      default:
        p[0] = cos(9 * x) + 3 * x * x, p[1] = sin(9 * x);
        break; /* crosses itself */
    }
  }
}

static void test_bad_data(batten_context *ctx) {
  static const char *const names[] = {"straight",        "almost straight", "noise alone",
                                      "repeated points", "a gap",           "a loop"};
  for (int what = 0; what < 6; what++)
    for (unsigned smoothness = 1; smoothness <= 2; smoothness++)
      for (int sign = -1; sign <= 1; sign += 2) {
        contour_rule r = {.kind = CONTOUR_SINE, .count = 60};
        trial t = trial_make(&r, smoothness + 1 + (unsigned)what % 3, smoothness, 20, 1);
        fill(&t, what, 11);
        if (what == 4) { /* points near the ends only, the others there too */
          for (size_t i = 0; i < r.count; i++)
            if (t.parameters[i] > 0.3 && t.parameters[i] < 0.8) t.parameters[i] = i % 2 ? 0.29 : 0.81;
          for (size_t i = 0; i < r.count; i++) {
            t.scene.points[2 * i] = t.parameters[i];
            t.scene.points[2 * i + 1] = t.parameters[i] * t.parameters[i];
          }
        }
        for (size_t i = 0; i < t.shape.spans; i++) t.signs[i] = (signed char)sign;
        batten_status st = trial_run(ctx, &t);
        T_CHECK(st == BATTEN_OK && right_signs(&t), "%s, smoothness %u, sign %d: construction %u, distance %.3g %s",
                names[what], smoothness, sign, t.by, t.rms, st < 0 ? batten_error(ctx) : "");
        trial_free(ctx, &t);
      }
}

static double seconds(void) {
  struct timespec t;
  timespec_get(&t, TIME_UTC);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Twice the spans do not take much more than twice the time: a wide limit, for machines are shared. */
static void test_large(batten_context *ctx) {
  double time[3][2];
  for (unsigned construction = 1; construction <= 2; construction++)
    for (int size = 0; size < 2; size++) {
      contour_rule r = {.kind = CONTOUR_WAVE, .inflections = 5, .noise = 0.02, .seed = 8};
      r.count = size ? POINTS_MAX : POINTS_MAX / 8;
      trial t = trial_make(&r, 3, 2, size ? 2000 : 250, 0);
      t.construction = construction;
      double start = seconds();
      T_OK(trial_run(ctx, &t), ctx);
      time[construction][size] = seconds() - start;
      T_CHECK(right_signs(&t), "%zu spans, construction %u; %.3f from the truth with noise %.3f", t.shape.spans,
              construction, t.truth, r.noise);
      trial_free(ctx, &t);
    }
  for (int k = 1; k <= 2; k++)
    printf("# construction %d: %.3f s, eight times as large %.3f s\n", k, time[k][0], time[k][1]);
}

/* Turned by a right angle, and scaled by a power of two in time: the same curve. */
static void test_invariance(batten_context *ctx) {
  contour_rule r = {.kind = CONTOUR_WAVE, .count = 120, .inflections = 3, .noise = 0.01, .seed = 9};
  for (unsigned construction = 1; construction <= 2; construction++) {
    trial t = trial_make(&r, 4, 2, 20, 1), u = trial_make(&r, 4, 2, 20, 1);
    t.construction = u.construction = construction;
    for (size_t i = 0; i < r.count; i++) {
      u.scene.points[2 * i] = -t.scene.points[2 * i + 1];
      u.scene.points[2 * i + 1] = t.scene.points[2 * i];
    }
    T_OK(trial_run(ctx, &t), ctx);
    T_OK(trial_run(ctx, &u), ctx);
    double worst = 0;
    for (size_t i = 0; i < t.space.b.count; i++)
      worst = fmax(worst, hypot(u.control[2 * i] + t.control[2 * i + 1], u.control[2 * i + 1] - t.control[2 * i]));
    T_RATIO(worst, construction == 1 ? 1e-5 : 1e-9, "construction %u turns with the data", construction);
    trial_free(ctx, &t);
    trial_free(ctx, &u);
  }
}

static batten_status run(batten_context *ctx, void *arg) {
  trial *t = arg;
  batten_status st = trial_run(ctx, t);
  contour_space_free(ctx, &t->space);
  return st;
}

static void test_failures(void) {
  contour_rule r = {.kind = CONTOUR_LOOP, .count = 60, .inflections = 4, .noise = 0.02, .seed = 5};
  trial t = trial_make(&r, 3, 2, 14, 0);
  for (t.construction = 1; t.construction <= 2; t.construction++) {
    t_fail_every_allocation(t.construction == 1 ? "construction 1" : "construction 2", run, &t);
    t_cancel_every_progress(t.construction == 1 ? "construction 1" : "construction 2", run, &t);
  }
  trial_free(NULL, &t);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_parabola(ctx);
  test_random(ctx);
  test_spirals(ctx);
  test_ends(ctx);
  test_tangents(ctx);
  test_neighbours(ctx);
  test_strict(ctx);
  test_bad_data(ctx);
  test_large(ctx);
  test_invariance(ctx);
  test_failures();
  batten_context_free(ctx);
  return t_done();
}
