/* The proof that plane sections keep their sign: it must hold for what keeps it and never for what does not. Judged
 * by samples in long double from de Boor's algorithm, which shares no code with it. */
#include "surface_shapes.h"

#include <float.h>

#include "surface/certify_sections.h"

enum { ORDER = BATTEN_SURFACE_DEGREE_MAX + 1, POWERS = 6 };

/* ---- evaluation that knows nothing of the kernel ------------------------------------------------- */

/* Functions of span mu and their derivatives, table [3][degree + 1]. */
static void basis_at(const surface_case *s, int axis, size_t mu, long double t, long double table[3][ORDER]) {
  const double *knots = s->knots[axis];
  unsigned d = s->degree[axis];
  for (unsigned j = 0; j <= d; j++)
    for (unsigned order = 0; order < 3; order++) {
      long double c[ORDER] = {0};
      c[j] = 1;
      for (unsigned r = 1; r <= d; r++)
        for (unsigned i = d; i >= r; i--) {
          long double a = knots[mu - d + i], b = knots[mu + i + 1 - r], length = b - a;
          bool difference = order <= d && r > d - order; /* a round with a direction in place of t */
          c[i] = difference ? (c[i] - c[i - 1]) / length : ((b - t) * c[i - 1] + (t - a) * c[i]) / length;
        }
      long double factor = 1;
      for (unsigned k = 0; k < order; k++) factor *= (long double)d - k;
      table[order][j] = order > d ? 0 : factor * c[d];
    }
}

/* Signed curvature of the section at a place of a span pair, for a unit normal; w too unless NULL. */
static long double curvature_at(const surface_case *s, const double normal[3], size_t mu, size_t nu, long double u,
                                long double v, long double *w) {
  long double bu[3][ORDER], bv[3][ORDER], x[2][3] = {{0}}, cross = 0, square = 0;
  basis_at(s, 0, mu, u, bu);
  basis_at(s, 1, nu, v, bv);
  for (unsigned i = 0; i <= s->degree[0]; i++)
    for (unsigned j = 0; j <= s->degree[1]; j++)
      for (int k = 0; k < 2; k++)
        for (int d = 0; d < 3; d++)
          x[k][d] +=
              bu[k + 1][i] * bv[0][j] * s->control[(mu - s->degree[0] + i) * s->points[1] + nu - s->degree[1] + j][d];
  for (int d = 0; d < 3; d++) {
    int e = (d + 1) % 3, f = (d + 2) % 3;
    cross += normal[d] * (x[0][e] * x[1][f] - x[0][f] * x[1][e]);
    square += x[0][d] * x[0][d];
  }
  if (w) *w = cross;
  return cross / (square * sqrtl(square));
}

static size_t spans_of(const surface_case *s, int axis, size_t *mu) {
  size_t count = 0;
  for (size_t i = s->degree[axis]; i < s->points[axis]; i++)
    if (s->knots[axis][i] < s->knots[axis][i + 1]) mu[count++] = i;
  return count;
}

/* Least curvature times the sign on a grid of a span pair. */
static double least_of_pair(const surface_case *s, const double normal[3], size_t mu, size_t nu, int sign, int grid) {
  long double least = INFINITY;
  const double *u = s->knots[0] + mu, *v = s->knots[1] + nu;
  for (int i = 0; i <= grid; i++)
    for (int j = 0; j <= grid; j++) {
      long double a = (long double)i / grid, b = (long double)j / grid;
      long double c =
          sign * curvature_at(s, normal, mu, nu, (1 - a) * u[0] + a * u[1], (1 - b) * v[0] + b * v[1], NULL);
      if (c < least) least = c;
    }
  return (double)least;
}

static const double up[3] = {0, 0, 1};

typedef struct verdict {
  batten_sections s;
  signed char pair[SURFACE_POINTS];
} verdict;

static verdict prove(batten_context *ctx, const surface_case *c, const batten_sections_options *opt) {
  verdict v = {.s = {.certified = -1}};
  batten_surface *s = surface_case_make(ctx, c);
  if (batten_surface_certify_sections(ctx, s, opt, &v.s, v.pair) != BATTEN_OK) printf("# %s\n", batten_error(ctx));
  batten_surface_free(s);
  return v;
}

/* ---- scenes --------------------------------------------------------------------------------------- */

static double choose(unsigned n, unsigned k) {
  double out = 1;
  for (unsigned i = 0; i < k; i++) out = out * (n - i) / (i + 1);
  return out;
}

/* Over [0, 1]^2: (u, y, v) with y_uu = sum a[k][l] u^k v^l, seen from -y; as (u, y) in the plane z = v. */
static surface_case bent(unsigned m, unsigned n, const double a[POWERS][POWERS]) {
  surface_case s = {.degree = {0}};
  surface_case_axis(&s, 0, m, 1, 1, 0, 1);
  surface_case_axis(&s, 1, n, 1, 1, 0, 1);
  for (unsigned i = 0; i <= m; i++)
    for (unsigned j = 0; j <= n; j++) {
      double *p = s.control[i * (n + 1) + j];
      p[0] = (double)i / m;
      p[2] = (double)j / n;
      for (unsigned k = 0; k < POWERS && k + 2 <= i; k++)
        for (unsigned l = 0; l < POWERS && l <= j; l++)
          p[1] += a[k][l] / ((k + 1.) * (k + 2.)) * choose(i, k + 2) / choose(m, k + 2) * choose(j, l) / choose(n, l);
    }
  return s;
}

/* (u, u^2) (1 + v) over [-1, 1] x [0, 1]: curvature 2 / (1 + v) / (1 + 4 u^2)^1.5. */
static surface_case cone(unsigned m, unsigned n, unsigned spans) {
  surface_case s = {.degree = {0}};
  surface_case_axis(&s, 0, m, spans, 1, -1, 1);
  surface_case_axis(&s, 1, n, spans, 1, 0, 1);
  for (size_t i = 0; i < s.points[0]; i++)
    for (size_t j = 0; j < s.points[1]; j++) {
      double u[3], v[3], *p = s.control[i * s.points[1] + j];
      surface_case_powers(&s, 0, i, u);
      surface_case_powers(&s, 1, j, v);
      p[0] = u[1] * (1 + v[1]);
      p[1] = u[2] * (1 + v[1]);
      p[2] = v[1];
    }
  return s;
}

/* The plane of the sections turned to the axes (e, f, g), and moved. */
static void turn(surface_case *s, const double e[3], const double f[3], const double g[3], double shift) {
  for (size_t i = 0; i < s->points[0] * s->points[1]; i++) {
    double p[3] = {s->control[i][0], s->control[i][1], s->control[i][2]};
    for (int d = 0; d < 3; d++) s->control[i][d] = p[0] * e[d] + p[1] * f[d] + p[2] * g[d] + shift;
  }
}

static void test_by_hand(batten_context *ctx) {
  static const unsigned degrees[6][3] = {{2, 1, 1}, {2, 5, 3}, {3, 3, 1}, {5, 4, 2}, {7, 7, 1}, {9, 9, 2}};
  double least = 1 / pow(5, 1.5);
  for (int k = 0; k < 6; k++) {
    surface_case s = cone(degrees[k][0], degrees[k][1], degrees[k][2]);
    verdict v = prove(ctx, &s, NULL);
    T_CHECK(
        v.s.certified && v.s.pairs == (size_t)degrees[k][2] * degrees[k][2] && v.s.pairs_free == 0 && v.pair[0] == 1,
        "cone of degree (%u, %u)", degrees[k][0], degrees[k][1]);
    T_CHECK(
        v.s.margin_min > 0.9 * least && v.s.margin_min < least && fabs(v.s.worst_at[0]) == 1 && v.s.worst_at[1] == 1,
        "curvature > %.6f, it is %.6f; %zu boxes, depth %u", v.s.margin_min, least, v.s.boxes, v.s.depth);
  }
}

/* One section, or one place, in the middle that bends the wrong way. */
static void test_hidden(batten_context *ctx) {
  const double u0 = 0.37, v0 = 0.61;
  for (int kind = 0; kind < 2; kind++)
    for (int k = 2; k <= 12; k++)
      for (int sign = -1; sign <= 1; sign += 2) {
        double depth = pow(10, -k), a[POWERS][POWERS] = {{0}};
        a[0][0] = v0 * v0 + sign * depth + kind * u0 * u0;
        a[0][1] = -2 * v0;
        a[0][2] = 1;
        a[1][0] = -2 * u0 * kind;
        a[2][0] = kind;
        surface_case s = bent(kind ? 4 : 2, 3, (const double(*)[POWERS])a);
        verdict v = prove(ctx, &s, NULL);
        if (sign < 0)
          T_CHECK(!v.s.certified && v.s.pairs == 1 && v.s.violations == 1 && v.s.margin_min < 0 && v.pair[0] == -1 &&
                      fabs(v.s.worst_at[1] - v0) < 1.01 * sqrt(depth),
                  "%s wrong by 1e-%d: %.2g met at %.4f %.4f, %zu boxes", kind ? "place" : "section", k,
                  v.s.margin_min, v.s.worst_at[0], v.s.worst_at[1], v.s.boxes);
        else
          T_CHECK(v.s.certified && v.s.margin_min > 0.85 * depth && v.s.margin_min < depth * (1 + 1e-3),
                  "%s right by 1e-%d: > %.3g, %zu boxes, depth %u", kind ? "place" : "section", k, v.s.margin_min,
                  v.s.boxes, v.s.depth);
      }
}

/* y_uu = a u (1 - u)^b ...: flat at one end or both, exactly and to the rounding of points that were turned. */
static void test_flat(batten_context *ctx) {
  enum { ONE_END = 4 };
  static const struct {
    const char *what;
    double a[POWERS][POWERS];
    int pairs, certified, verdict;
  } cases[] = {
      {"flat at u = 0", {{0}, {1, 0.5, -0.3}}, 1, 1, 1},
      {"flat at u = 1", {{1, 0.5, -0.3}, {-1, -0.5, 0.3}}, 1, 1, 1},
      {"flat at both", {{0}, {1, 0.5}, {-1, -0.5}}, 1, 1, 1},
      {"flat at both, downwards", {{0}, {-1, -0.5}, {1, 0.5}}, 1, 1, 1},
      {"flat at u = 0, in one end section only", {{0, 0.5}, {1}}, 0, 1, 0},
      {"flat at u = 0, more in between", {{0, 0.1, -0.1}, {1}}, 1, 1, 1},
      {"flat at u = 0, wrong in between", {{0, -0.01, 0.01}, {1}}, 1, 0, -1},
      {"flat at u = 0, wrong in between further on", {{0}, {0.2, -1, 1}, {1}}, 1, 0, -1},
      {"straight", {{0}}, 0, 1, 0},
      {"straight in the last section", {{1, -1}}, 0, 1, 0},
      {"an inflection", {{-1}, {2}}, 0, 1, 0},
  };
  const double e[3] = {0.48, 0.64, 0.6}, f[3] = {-0.8, 0.6, 0}, g[3] = {-0.36, -0.48, 0.8};
  for (size_t k = 0; k < sizeof cases / sizeof *cases; k++)
    for (unsigned m = 4; m <= 6; m++)
      for (int turned = 0; turned < 3; turned++) {
        if (turned && k == ONE_END) continue; /* rounding decides */
        surface_case s = bent(m, 3, cases[k].a);
        batten_sections_options o = batten_sections_options_default();
        if (turned == 1) turn(&s, (double[]){0.6, 0.8, 0}, (double[]){-0.8, 0.6, 0}, up, 1000 / 3.);
        if (turned == 2) turn(&s, e, f, g, 100 / 3.);
        if (turned == 2) memcpy(o.normal, g, sizeof g);
        verdict v = prove(ctx, &s, &o);
        bool strict = cases[k].pairs == 0 || (v.s.certified ? isnan(v.s.margin_min) : v.s.margin_min <= 0);
        T_CHECK(v.s.certified == cases[k].certified && v.s.pairs == (size_t)cases[k].pairs && strict &&
                    v.pair[0] == cases[k].verdict && v.s.unproven == 0,
                "%s, degree %u%s: certified %d, %zu pairs, %d, %.3g, %zu boxes", cases[k].what, m,
                turned ? ", turned" : "", v.s.certified, v.s.pairs, v.pair[0], v.s.margin_min, v.s.boxes);
      }
}

/* What is wanted decides: straight sections, free ones, wrong signs. */
static void test_wanted(batten_context *ctx) {
  surface_case s = bent(3, 2, (const double[POWERS][POWERS]){{0}});
  batten_sections_options o = batten_sections_options_default();
  o.signs = (const signed char[1]){1};
  verdict v = prove(ctx, &s, &o);
  T_CHECK(!v.s.certified && v.s.violations == 1 && v.pair[0] == -1 && v.s.margin_min <= 0 && v.s.margin_min > -1e-9,
          "straight sections do not bend to the left");
  surface_case_insert(&s, 0, 0.5);
  s = cone(3, 3, 2);
  o.signs = (const signed char[4]){0, 0, 0, 0};
  v = prove(ctx, &s, &o);
  T_CHECK(v.s.certified && v.s.pairs == 0 && v.s.pairs_free == 4 && isnan(v.s.margin_min) && v.s.boxes == 0,
          "nothing wanted, nothing looked at");
  o.signs = (const signed char[4]){1, -1, 0, 1};
  v = prove(ctx, &s, &o);
  T_CHECK(!v.s.certified && v.s.violations == 1 && v.s.pairs == 3 && v.pair[0] == 1 && v.pair[1] == -1 &&
              v.pair[2] == 0 && v.pair[3] == 1 && v.s.margin_min < -0.08,
          "one sign that is not there: %.3g", v.s.margin_min);
  s = bent(1, 2, (const double[POWERS][POWERS]){{0}});
  o.signs = (const signed char[1]){-1};
  v = prove(ctx, &s, &o);
  verdict none = prove(ctx, &s, NULL);
  T_CHECK(!v.s.certified && v.pair[0] == -1 && none.s.pairs == 0 && none.s.certified, "degree 1 does not bend");
}

/* ---- at random ------------------------------------------------------------------------------------ */

/* Sections around an arc or an S, turned and moved from one to the next. */
static surface_case scene_of(uint64_t *seed, double noise) {
  surface_case s = {.degree = {0}};
  unsigned m = 2 + (unsigned)(t_random(seed) % 4), n = 1 + (unsigned)(t_random(seed) % 6);
  surface_case_axis(&s, 0, m, 1 + (unsigned)(t_random(seed) % 3), 1, 0, 1);
  surface_case_axis(&s, 1, n, 1 + (unsigned)(t_random(seed) % 2), 1, -1, 2);
  surface_case_shake(&s, 0, seed);
  surface_case_shake(&s, 1, seed);
  double angle = 0.5 + 3 * t_uniform(seed), twist = t_uniform(seed), grow = 0.5 + t_uniform(seed);
  bool both = t_random(seed) % 4 == 0;
  for (size_t j = 0; j < s.points[1]; j++) {
    double r = 1 + grow * (double)j / (double)s.points[1], x = 0, y = 0, at = twist * (double)j;
    for (size_t i = 0; i < s.points[0]; i++) {
      double *p = s.control[i * s.points[1] + j], step = angle / (double)(s.points[0] - 1);
      p[0] = x + noise * (2 * t_uniform(seed) - 1);
      p[1] = y + noise * (2 * t_uniform(seed) - 1);
      p[2] = (double)j;
      at += both && i > s.points[0] / 2 ? -step : step;
      x += r * step * cos(at);
      y += r * step * sin(at);
    }
  }
  return s;
}

static void test_random(batten_context *ctx) {
  size_t pairs = 0, certified = 0, all = 0, wrong = 0, above = 0, low = 0, false_violations = 0, unproven = 0;
  size_t missed = 0, boxes = 0;
  uint64_t seed = 5;
  for (int k = 0; k < 1200; k++) {
    surface_case s = scene_of(&seed, 0.3 * pow(t_uniform(&seed), 3));
    signed char signs[64];
    size_t mu[SURFACE_KNOTS], nu[SURFACE_KNOTS], columns = spans_of(&s, 1, nu), rows = spans_of(&s, 0, mu);
    for (size_t i = 0; i < rows * columns; i++)
      signs[i] = curvature_at(&s, up, mu[i / columns], nu[i % columns], s.knots[0][mu[i / columns]],
                              s.knots[1][nu[i % columns]], NULL) > 0
                     ? 1
                     : -1;
    batten_sections_options o = batten_sections_options_default();
    o.signs = signs;
    verdict v = prove(ctx, &s, &o);
    double least = INFINITY;
    boxes += v.s.boxes;
    unproven += v.s.unproven;
    all += v.s.certified != 0;
    for (size_t i = 0; i < rows * columns; i++) {
      double c = least_of_pair(&s, up, mu[i / columns], nu[i % columns], signs[i], 12);
      pairs++;
      least = fmin(least, c);
      certified += v.pair[i] == 1;
      wrong += v.pair[i] == 1 && !(c > 0);
      missed += v.pair[i] != 1 && c > 0.02;
      false_violations += v.pair[i] == -1 && c > 0.02;
    }
    above += v.s.certified && !(v.s.margin_min < least * (1 + 1e-12));
    low += v.s.certified && v.s.margin_min < 0.85 * least; /* the grid is coarse */
  }
  printf("# %zu span pairs, %zu proven, %zu of 1200 surfaces, %zu unproven, %zu boxes\n", pairs, certified, all,
         unproven, boxes);
  T_CHECK(certified > pairs / 3 && certified < pairs - pairs / 10, "%zu of %zu span pairs are proven", certified,
          pairs);
  T_CHECK(wrong == 0, "%zu of them with a wrong sample", wrong);
  T_CHECK(above == 0, "%zu surfaces with a sample below the margin", above);
  T_CHECK(missed == 0 && false_violations == 0 && unproven == 0, "%zu pairs missed, %zu unproven", missed, unproven);
  T_CHECK(low < 5, "%zu surfaces whose margin is far below the grid's", low);
}

/* Polynomials and their bounds, on parts of parts: curvature at corners against samples. */
static void test_coefficients(batten_context *ctx) {
  uint64_t seed = 21;
  double worst = 0, largest = 0;
  for (int k = 0; k < 200; k++) {
    surface_case s = scene_of(&seed, 0.1);
    if (k % 4 == 0) turn(&s, (double[]){1, 0, 0}, (double[]){0, 1, 0}, up, 1e4);
    batten_surface *surface = surface_case_make(ctx, &s);
    sections_plan plan;
    sections_plan_make(surface, up, &plan);
    double *room = malloc((sections_room(&plan) + 2 * (sections_a_count(&plan) + sections_w_count(&plan))) * 8);
    sections_pair p = {.a.c = room + sections_room(&plan)};
    p.w.c = p.a.c + sections_a_count(&plan);
    sections_sheet a = {.c = p.w.c + sections_w_count(&plan)}, w = {.c = a.c + sections_a_count(&plan)};
    size_t mu[SURFACE_KNOTS], nu[SURFACE_KNOTS], rows = spans_of(&s, 0, mu), columns = spans_of(&s, 1, nu);
    size_t span[2] = {mu[t_random(&seed) % rows], nu[t_random(&seed) % columns]};
    sections_pair_make(&plan, span[0], span[1], room, &p);
    long double lower[2] = {0, 0}, width[2] = {1, 1};
    for (int cut = 0; cut < 16; cut++) {
      for (int c = 0; c < 4; c++) {
        long double place[2];
        for (int i = 0; i < 2; i++) {
          const double *t = s.knots[i] + span[i];
          long double part = lower[i] + (c >> i & 1 ? width[i] : 0);
          place[i] = (1 - part) * t[0] + part * t[1];
        }
        size_t i = c & 1 ? p.w.degree[0] : 0, q = s.degree[1], at = c & 1 ? s.degree[0] - 1 : 0;
        const double *x = p.a.c + at * (q + 1) + (c & 2 ? q : 0), *y = x + s.degree[0] * (q + 1);
        double speed = hypot(*x, *y), value = p.w.c[i * (2 * q + 1) + (c & 2 ? 2 * q : 0)];
        double found = ldexp(value / pow(speed, 3) * p.factor, plan.exponent);
        double expected = (double)curvature_at(&s, up, span[0], span[1], place[0], place[1], NULL);
        double error = fabs(value) * 6 * p.a.error[at] / speed + p.w.error[i] + 1e-18 * fabs(value);
        double ratio = fabs(found - expected) / (error / fabs(value) * fabs(expected));
        if (speed > 1e-3 && fabs(value) > 1e-6) worst = fmax(worst, ratio);
        if (speed > 1e-3 && fabs(value) > 1e-6) largest = fmax(largest, error / fabs(value));
      }
      unsigned axis = t_random(&seed) % 2, upper = t_random(&seed) % 2;
      sections_halve(axis, &p.a, &a, room);
      sections_halve(axis, &p.w, &w, room);
      width[axis] /= 2;
      if (upper == 0) continue;
      lower[axis] += width[axis];
      memcpy(p.a.c, a.c, sections_count(&a) * sizeof *a.c);
      memcpy(p.w.c, w.c, sections_count(&w) * sizeof *w.c);
      for (int part = 0; part < 2; part++) {
        sections_sheet *to = part ? &p.a : &p.w, *from = part ? &a : &w;
        memcpy(to->error, from->error, sizeof to->error);
        memcpy(to->most, from->most, sizeof to->most);
      }
    }
    free(room);
    batten_surface_free(surface);
  }
  T_RATIO(worst, 1, "curvature at corners of parts, off by less than the bounds (which are below %.2g)", largest);
}

/* ---- the same surface otherwise -------------------------------------------------------------------- */

static bool same_pairs(const verdict *a, const verdict *b, size_t count) {
  return memcmp(a->pair, b->pair, count) == 0;
}

static void test_invariances(batten_context *ctx) {
  uint64_t seed = 9;
  size_t tried = 0;
  for (int k = 0; k < 60; k++) {
    surface_case s = scene_of(&seed, 0.02), t = s;
    size_t room[SURFACE_KNOTS], rows = spans_of(&s, 0, room), columns = spans_of(&s, 1, room), n = rows * columns;
    verdict v = prove(ctx, &s, NULL), other;
    bool ok = true;
    tried += v.s.certified && v.s.pairs > 0;
    for (size_t i = 0; i < s.points[0] * s.points[1]; i++)
      for (int d = 0; d < 3; d++) t.control[i][d] = ldexp(s.control[i][d], 40);
    other = prove(ctx, &t, NULL);
    double margin = ldexp(other.s.margin_min, 40);
    ok = ok && same_pairs(&v, &other, n) && (margin == v.s.margin_min || (isnan(margin) && isnan(v.s.margin_min)));
    batten_sections_options o = batten_sections_options_default();
    t = s;
    for (size_t i = 0; i < s.points[0] * s.points[1]; i++) { /* along x */
      t.control[i][0] = s.control[i][2];
      t.control[i][1] = s.control[i][0];
      t.control[i][2] = s.control[i][1];
    }
    memcpy(o.normal, (double[]){3, 0, 0}, sizeof o.normal);
    other = prove(ctx, &t, &o);
    ok = ok && same_pairs(&v, &other, n) && memcmp(&v.s, &other.s, sizeof v.s) == 0;
    t = s;
    memcpy(o.normal, (double[]){-0.36e9, -0.48e9, 0.8e9}, sizeof o.normal);
    turn(&t, (double[]){0.48, 0.64, 0.6}, (double[]){-0.8, 0.6, 0}, (double[]){-0.36, -0.48, 0.8}, 0);
    other = prove(ctx, &t, &o);
    ok = ok && same_pairs(&v, &other, n) &&
         (isnan(v.s.margin_min) || !v.s.certified || fabs(other.s.margin_min / v.s.margin_min - 1) < 1e-6);
    t = s;
    surface_case_reverse(&t, 1);
    other = prove(ctx, &t, NULL);
    for (size_t i = 0; i < n; i++)
      ok = ok && v.pair[i] == other.pair[i / columns * columns + columns - 1 - i % columns];
    t = s;
    surface_case_reverse(&t, 0);
    memcpy(o.normal, (double[]){0, 0, -1}, sizeof o.normal);
    other = prove(ctx, &t, &o);
    for (size_t i = 0; i < n; i++)
      ok = ok && v.pair[i] == other.pair[(rows - 1 - i / columns) * columns + i % columns];
    if (!ok) T_CHECK(false, "scene %d is not the same turned, scaled, reversed", k);
  }
  T_CHECK(tried > 10, "%zu of 60 scenes proven are the same scaled, turned, reversed", tried);
}

static void test_threads(batten_context *ctx) {
  surface_case s = cone(3, 3, 7);
  uint64_t seed = 2;
  for (size_t i = 0; i < s.points[0] * s.points[1]; i++)
    for (int d = 0; d < 2; d++) s.control[i][d] += 0.004 * t_uniform(&seed);
  verdict v = prove(ctx, &s, NULL);
  for (unsigned threads = 2; threads <= 8; threads *= 2) {
    batten_context *more = t_context(NULL, NULL, threads);
    verdict other = prove(more, &s, NULL);
    T_CHECK(memcmp(&v.s, &other.s, sizeof v.s) == 0 && same_pairs(&v, &other, 49),
            "%u threads: the same bits, %zu of 49 pairs, %zu boxes", threads, v.s.pairs, v.s.boxes);
    batten_context_free(more);
  }
}

static void test_limits(batten_context *ctx) {
  double a[POWERS][POWERS] = {{0.61 * 0.61 + 1e-4, -1.22, 1}};
  surface_case s = bent(3, 3, (const double(*)[POWERS])a);
  batten_sections_options o = batten_sections_options_default();
  verdict v = prove(ctx, &s, NULL);
  o.depth_max = 0;
  verdict rough = prove(ctx, &s, &o);
  T_CHECK(v.s.certified && v.s.depth > 2 && !rough.s.certified && rough.s.unproven == 1 && rough.pair[0] == -2 &&
              rough.s.depth == 0,
          "no bisection: unproven");
  o.depth_max = 20;
  o.box_limit = 3;
  rough = prove(ctx, &s, &o);
  T_CHECK(!rough.s.certified && rough.s.unproven == 1 && rough.s.boxes <= 4, "3 boxes: unproven, %zu", rough.s.boxes);
  o.box_limit = 1;
  s = cone(3, 3, 1);
  rough = prove(ctx, &s, &o);
  T_CHECK(rough.s.certified && rough.s.margin_min > 0 && rough.s.margin_min < 0.0895 && rough.s.boxes == 1,
          "1 box proves the sign: > %.3g", rough.s.margin_min);
  for (size_t i = 0; i < 16; i++)
    for (int d = 0; d < 3; d++) s.control[i][d] *= 0x1p-1000;
  rough = prove(ctx, &s, NULL);
  T_CHECK(rough.s.certified && rough.s.margin_min > ldexp(0.08, 1000), "tiny: > %.3g", rough.s.margin_min);
  for (size_t i = 0; i < 16; i++)
    for (int d = 0; d < 3; d++) s.control[i][d] = ldexp(s.control[i][d], 2020);
  rough = prove(ctx, &s, NULL);
  T_CHECK(rough.s.certified && rough.s.margin_min >= 0, "huge: > %.3g", rough.s.margin_min);
  /* Needles, whose sections are next to nothing beside their height: of them the cube of |x_u| underflows. */
  static const int shift[3] = {-500, -780, -960};
  for (int k = 0; k < 3; k++) {
    s = cone(3, 3, 1);
    for (size_t i = 0; i < 16; i++)
      for (int d = 0; d < 2; d++) s.control[i][d] = ldexp(s.control[i][d], shift[k]);
    rough = prove(ctx, &s, NULL);
    double most = ldexp(0.0895, -shift[k]), proven = rough.s.margin_min;
    T_CHECK(rough.s.pairs == 1 && rough.s.certified && proven < most && proven > 0.8 * most,
            "needle by 2^%d: > %.3g of %.3g", shift[k], proven, most);
  }
}

static void test_bad(batten_context *ctx) {
  surface_case s = cone(3, 3, 2);
  batten_surface *surface = surface_case_make(ctx, &s);
  batten_sections c = {.certified = 77};
  signed char verdicts[4] = {7, 7, 7, 7};
  batten_sections_options o = batten_sections_options_default();
  T_CHECK(batten_surface_certify_sections(NULL, surface, NULL, &c, verdicts) == BATTEN_E_INVALID, "no context");
  T_STATUS(batten_surface_certify_sections(ctx, NULL, NULL, &c, NULL), BATTEN_E_INVALID, ctx, "surface: NULL");
  T_STATUS(batten_surface_certify_sections(ctx, surface, NULL, NULL, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  o.struct_size = 3;
  T_STATUS(batten_surface_certify_sections(ctx, surface, &o, &c, NULL), BATTEN_E_INVALID, ctx,
           "batten_sections_options.struct_size: 3");
  o = batten_sections_options_default();
  memset(o.normal, 0, sizeof o.normal);
  T_STATUS(batten_surface_certify_sections(ctx, surface, &o, &c, NULL), BATTEN_E_INVALID, ctx,
           "opt.normal: 0 0 0; give a direction");
  o.normal[1] = NAN;
  T_STATUS(batten_surface_certify_sections(ctx, surface, &o, &c, NULL), BATTEN_E_INVALID, ctx, "opt.normal: 0 nan 0");
  memcpy(o.normal, (double[]){0, 1, 8}, sizeof o.normal);
  T_STATUS(batten_surface_certify_sections(ctx, surface, &o, &c, verdicts), BATTEN_E_INVALID, ctx,
           "control_points[1][0]: not in the plane of control_points[0][0] across opt.normal; sections v = const");
  o = batten_sections_options_default();
  o.depth_max = 31;
  T_STATUS(batten_surface_certify_sections(ctx, surface, &o, &c, NULL), BATTEN_E_INVALID, ctx,
           "opt.depth_max: 31; give 0 to 30");
  o.depth_max = 5;
  o.box_limit = 0;
  T_STATUS(batten_surface_certify_sections(ctx, surface, &o, &c, NULL), BATTEN_E_INVALID, ctx, "opt.box_limit: 0");
  o.box_limit = 10;
  o.signs = (const signed char[4]){1, 0, 2, 1};
  T_STATUS(batten_surface_certify_sections(ctx, surface, &o, &c, verdicts), BATTEN_E_INVALID, ctx,
           "opt.signs[1][0]: 2; give -1, 0 or 1");
  T_CHECK(c.certified == 77 && verdicts[0] == 7 && verdicts[3] == 7, "failures leave the results alone");
  batten_surface_free(surface);
}

static batten_status certify(batten_context *ctx, void *arg) {
  batten_sections c;
  batten_surface *s = NULL;
  batten_surface_form form = surface_case_form(arg);
  batten_status st = batten_surface_create(ctx, &form, &s);
  if (st >= 0) st = batten_surface_certify_sections(ctx, s, NULL, &c, NULL);
  batten_surface_free(s);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_by_hand(ctx);
  test_hidden(ctx);
  test_flat(ctx);
  test_wanted(ctx);
  test_random(ctx);
  test_coefficients(ctx);
  test_invariances(ctx);
  test_threads(ctx);
  test_limits(ctx);
  test_bad(ctx);
  surface_case s = cone(4, 3, 4);
  t_fail_every_allocation("batten_surface_certify_sections", certify, &s);
  t_cancel_every_progress("batten_surface_certify_sections", certify, &s);
  batten_context_free(ctx);
  return t_done();
}
