/* The unknowns of planar fits: whatever they are, the curve has the smoothness, the inflections and the ends that
 * were asked for, by derivatives on both sides of knots. */
#include <batten/contour.h>

#include <float.h>

#include "contour/contour_inner.h"
#include "tap.h"

enum { SPANS = 40, COUNT = 400 };

typedef struct scene {
  double breaks[SPANS + 1];
  signed char signs[SPANS];
  contour_shape shape;
} scene;

/* Spans of different lengths; runs of two spans at least. */
static void make_scene(scene *s, unsigned degree, unsigned smoothness, bool closed, size_t spans, size_t inflections,
                       uint64_t *seed) {
  double at = 0;
  for (size_t i = 0; i <= spans; i++) {
    s->breaks[i] = at;
    at += 0.2 + t_uniform(seed);
  }
  for (size_t i = 0; i <= spans; i++) s->breaks[i] /= s->breaks[spans];
  for (size_t i = 0; i < spans; i++) {
    size_t run = closed && inflections ? i * inflections / spans : i * (inflections + 1) / spans;
    s->signs[i] = run % 2 ? -1 : 1;
  }
  s->shape = (contour_shape){degree, smoothness, closed, spans, s->breaks, s->signs};
}

/* Derivatives of the curve at t on span mu: jet [3][2]. */
static void jet_of(const bspline *b, const double *control, size_t mu, double t, double jet[3][2]) {
  double table[3 * BSPLINE_ORDER];
  bspline_basis(b, mu, t, 2, table);
  for (int k = 0; k < 3; k++)
    for (int c = 0; c < 2; c++) {
      jet[k][c] = 0;
      for (size_t j = 0; j <= b->degree; j++)
        jet[k][c] += table[(size_t)k * (b->degree + 1) + j] * control[2 * (mu - b->degree + j) + (size_t)c];
    }
}

static double apart(const double *a, const double *b) { return fmax(fabs(a[0] - b[0]), fabs(a[1] - b[1])); }

typedef struct figures {
  double jump, second, convex, sum;
  bool bits;
} figures;

/* A random curve of the space. */
static void look(const scene *s, const contour_space *space, uint64_t *seed, figures *f) {
  double y[2 * COUNT], control[2 * COUNT], left[3][2], right[3][2];
  const bspline *b = &space->b;
  for (size_t i = 0; i < space->unknowns; i++) y[i] = 2 * t_uniform(seed) - 1;
  contour_space_expand(space, y, control);
  size_t mu = bspline_first(b), last = 0;
  for (size_t i = 0; i < s->shape.spans; i++) last = i ? bspline_next(b, last) : mu;
  size_t before = last;
  for (size_t i = 0; i < s->shape.spans; i++, before = mu, mu = bspline_next(b, mu)) {
    if (i == 0 && !s->shape.closed) continue;
    jet_of(b, control, before, i ? b->knots[mu] : 1, left);
    jet_of(b, control, mu, b->knots[mu], right);
    double h = fmin(b->knots[mu + 1] - b->knots[mu], b->knots[before + 1] - b->knots[before]), unit = 1;
    for (unsigned k = 0; k <= s->shape.smoothness; k++, unit *= h)
      f->jump = fmax(f->jump, unit * apart(left[k], right[k]));
    if (!contour_inflection(&s->shape, i) || s->shape.smoothness < 2) continue;
    const double zero[2] = {0, 0};
    f->second = fmax(f->second, h * h * fmax(apart(left[2], zero), apart(right[2], zero)));
  }
  size_t n = b->count;
  if (s->shape.closed) f->bits = f->bits && !memcmp(control, control + 2 * n - 2, 2 * sizeof *control);
  for (size_t row = 0; row < 2 * n; row++) {
    double sum = 0;
    for (size_t i = space->starts[row]; i < space->starts[row + 1]; i++) {
      f->convex = fmin(f->convex, space->values[i]);
      sum += space->values[i];
      if (i > space->starts[row]) f->bits = f->bits && space->indices[i] > space->indices[i - 1];
    }
    f->sum = fmax(f->sum, fabs(sum - 1));
  }
}

static void test_random(batten_context *ctx) {
  uint64_t seed = 71;
  figures f = {.convex = 1, .bits = true};
  size_t cases = 0, unknowns = 0, wanted = 0;
  for (int i = 0; i < 600; i++) {
    unsigned smoothness = 1 + (unsigned)(t_random(&seed) % 2);
    unsigned degree = smoothness + 1 + (unsigned)(t_random(&seed) % (BATTEN_CURVE_DEGREE_MAX - smoothness));
    bool closed = t_random(&seed) % 2;
    size_t runs = 1 + t_random(&seed) % 4, spans = 2 * runs + t_random(&seed) % 9;
    size_t inflections = closed ? runs / 2 * 2 : runs - 1;
    if (closed && spans * (degree - smoothness) < 3) spans = 3;
    scene s;
    contour_space space;
    make_scene(&s, degree, smoothness, closed, spans, inflections, &seed);
    if (contour_space_make(ctx, &s.shape, degree, true, NULL, &space) != BATTEN_OK) {
      t_line(false, "case %d, degree %u, smoothness %u, %zu spans, %zu inflections: %s", i, degree, smoothness, spans,
             inflections, batten_error(ctx));
      continue;
    }
    size_t free = spans * (degree - smoothness) + (closed ? 0 : smoothness + 1);
    size_t equal = smoothness == 2 ? 2 * inflections : 0;
    wanted += 2 * free - equal;
    unknowns += space.unknowns;
    f.bits = f.bits && space.equalities == equal;
    look(&s, &space, &seed, &f);
    contour_space_free(ctx, &space);
    cases++;
  }
  T_CHECK(cases == 600, "%zu random spaces of degrees 2 .. 9", cases);
  T_CHECK(unknowns == wanted, "%zu unknowns in all, counted %zu", unknowns, wanted);
  T_RATIO(f.jump, 1e-11, "jumps at knots and seams, spans of length 1");
  T_RATIO(f.second, 1e-11, "x'' at inflections, spans of length 1");
  T_RATIO(-f.convex, 0, "no negative entry");
  T_RATIO(f.sum, 8 * DBL_EPSILON, "rows sum to 1");
  T_CHECK(f.bits, "first and last points equal to the bit, indices ascend, equalities counted");
}

/* Three spans of length 1/3 and 2 inflections' worth of hand arithmetic: c_2 between c_1 and c_3. */
static void test_by_hand(batten_context *ctx) {
  const double breaks[4] = {0, 0.25, 0.5, 1};
  const signed char signs[3] = {1, -1, -1};
  contour_shape shape = {3, 2, false, 3, breaks, signs};
  contour_space space;
  T_OK(contour_space_make(ctx, &shape, 3, true, NULL, &space), ctx);
  /* knots 0 0 0 0 .25 .5 1 1 1 1; break 1: points 1, 2, 3; w1 = u_5 - u_2 = .5, w2 = u_6 - u_3 = 1 */
  double y[10] = {0, 0, 3, 9, 6, 0, 0, 0, 0, 0}, control[12];
  T_CHECK(space.unknowns == 10 && space.equalities == 2, "%zu unknowns, %zu equalities", space.unknowns,
          space.equalities);
  contour_space_expand(&space, y, control);
  T_RATIO(fabs(control[4] - 4) + fabs(control[5] - 6), 1e-14, "(1 (3, 9) + 0.5 (6, 0)) / 1.5 = (4, 6)");
  contour_space_free(ctx, &space);
}

static void test_ends(batten_context *ctx) {
  uint64_t seed = 5;
  double worst = 0;
  size_t wrong = 0;
  for (int i = 0; i < 200; i++) {
    unsigned smoothness = 1 + (unsigned)(t_random(&seed) % 2), degree = smoothness + 1 + (unsigned)i % 4;
    size_t spans = 2 + t_random(&seed) % 5;
    scene s;
    make_scene(&s, degree, smoothness, false, spans, spans >= 4 ? 1 : 0, &seed);
    contour_ends ends;
    size_t fixed = 0;
    for (int e = 0; e < 2; e++) {
      bool point = t_random(&seed) % 2, tangent = t_random(&seed) % 2;
      double angle = 7 * t_uniform(&seed);
      for (int k = 0; k < 2; k++) {
        ends.point[e][k] = point ? t_uniform(&seed) : NAN;
        ends.tangent[e][k] = !tangent ? NAN : k ? sin(angle) : cos(angle);
      }
      fixed += (point ? 2u : 0u) + (tangent ? 1u : 0u);
    }
    contour_space space;
    if (contour_space_make(ctx, &s.shape, degree, false, &ends, &space) != BATTEN_OK) {
      wrong++;
      continue;
    }
    double y[2 * COUNT], control[2 * COUNT];
    size_t n = space.b.count;
    for (size_t j = 0; j < space.unknowns; j++) y[j] = t_uniform(&seed) - 0.5;
    contour_space_expand(&space, y, control);
    wrong += space.unknowns != 2 * n - fixed || space.equalities != fixed;
    for (size_t e = 0; e < 2; e++) {
      const double *point = control + (e ? 2 * n - 2 : 0), *next = control + (e ? 2 * n - 4 : 2);
      const double leg[2] = {next[0] - point[0], next[1] - point[1]};
      if (!isnan(ends.point[e][0])) worst = fmax(worst, apart(point, ends.point[e]));
      if (!isnan(ends.tangent[e][0])) worst = fmax(worst, fabs(contour_cross(leg, ends.tangent[e])));
    }
    contour_space_free(ctx, &space);
  }
  T_CHECK(wrong == 0, "unknowns of 200 spaces with ends: %zu wrong", wrong);
  T_RATIO(worst, 4 * DBL_EPSILON, "ends and their tangents");
}

/* The circle does not know where its parameter begins: a curve of the space, seen from another knot, is in the space
 * with breaks turned by a span (dimension, and the same points). */
static void test_seam(batten_context *ctx) {
  const double breaks[6] = {0, 0.1, 0.35, 0.5, 0.8, 1}, turned[6] = {0, 0.25, 0.4, 0.7, 0.9, 1};
  const signed char signs[5] = {1, 1, 1, 1, 1};
  double worst = 0;
  for (unsigned degree = 2; degree <= 6; degree++)
    for (unsigned l = 1; l <= 2 && l < degree; l++) {
      contour_shape shape[2] = {{degree, l, true, 5, breaks, signs}, {degree, l, true, 5, turned, signs}};
      contour_space space[2];
      double y[2][64], control[2][2 * 64];
      size_t m = degree - l;
      for (int i = 0; i < 2; i++)
        if (contour_space_make(ctx, &shape[i], degree, true, NULL, &space[i]) != BATTEN_OK) return;
      uint64_t seed = degree;
      for (size_t j = 0; j < space[0].unknowns; j++) y[0][j] = t_uniform(&seed);
      for (size_t j = 0; j < space[0].unknowns; j++) y[1][j] = y[0][(j + 2 * m) % space[0].unknowns];
      for (int i = 0; i < 2; i++) contour_space_expand(&space[i], y[i], control[i]);
      for (int i = 0; i < 100; i++) {
        double t = i / 100.0, u = fmod(t + 0.1, 1), a[3][2], b[3][2];
        jet_of(&space[1].b, control[1], bspline_span(&space[1].b, t), t, a);
        jet_of(&space[0].b, control[0], bspline_span(&space[0].b, u), u, b);
        worst = fmax(worst, apart(a[0], b[0]));
      }
      for (int i = 0; i < 2; i++) contour_space_free(ctx, &space[i]);
    }
  T_RATIO(worst, 1e-14, "closed curves seen from another knot");
}

static void test_bad(batten_context *ctx) {
  const double breaks[6] = {0, 0.2, 0.4, 0.6, 0.8, 1};
  const signed char adjacent[5] = {1, -1, 1, 1, 1}, even[5] = {1, 1, 1, 1, 1};
  contour_space space;
  contour_shape s = {3, 2, false, 5, breaks, adjacent};
  T_STATUS(contour_space_make(ctx, &s, 3, true, NULL, &space), BATTEN_E_INVALID, ctx, "opt.inflections");
  T_OK(contour_space_make(ctx, &s, 4, true, NULL, &space), ctx);
  contour_space_free(ctx, &space);
  const double two[3] = {0, 0.5, 1};
  s = (contour_shape){3, 2, true, 2, two, even};
  T_STATUS(contour_space_make(ctx, &s, 3, true, NULL, &space), BATTEN_E_INVALID, ctx, "closed curve of 2 spans");
  T_OK(contour_space_make(ctx, &s, 4, true, NULL, &space), ctx);
  contour_space_free(ctx, &space);
  const double one[2] = {0, 1};
  s = (contour_shape){4, 1, true, 1, one, even};
  T_OK(contour_space_make(ctx, &s, 4, true, NULL, &space), ctx);
  contour_space_free(ctx, &space);
  contour_ends ends = {{{0, 0}, {1, 0}}, {{0, 1}, {0, -1}}};
  s = (contour_shape){2, 1, false, 1, one, even};
  T_STATUS(contour_space_make(ctx, &s, 2, true, &ends, &space), BATTEN_E_INVALID, ctx, "opt.end_tangents");
  s.spans = SIZE_MAX / 4;
  T_STATUS(contour_space_make(ctx, &s, 9, true, &ends, &space), BATTEN_E_TOO_LARGE, ctx, "opt.spans");
}

static batten_status make_one(batten_context *ctx, void *arg) {
  const scene *s = arg;
  contour_space space;
  batten_status st = contour_space_make(ctx, &s->shape, s->shape.degree, true, NULL, &space);
  if (st >= 0) contour_space_free(ctx, &space);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_by_hand(ctx);
  test_random(ctx);
  test_ends(ctx);
  test_seam(ctx);
  test_bad(ctx);
  scene s;
  uint64_t seed = 2;
  make_scene(&s, 4, 2, true, 9, 2, &seed);
  t_fail_every_allocation("contour_space_make", make_one, &s);
  batten_context_free(ctx);
  return t_done();
}
