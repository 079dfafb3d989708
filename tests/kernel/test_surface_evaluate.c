/* Places on surfaces: against the definition of B-splines, closed forms, and in other knots, units and frames. */
#include "mesh/vec.h"
#include "surface/surface_inner.h"
#include "surface_shapes.h"

#include <float.h>

/* ---- the definition ------------------------------------------------------------------------------ */

/* The k-th derivative of function i of degree d, from the right (at the end from the left). */
static long double function(const double *t, size_t last, unsigned d, size_t i, unsigned k, double x) {
  if (d == 0) {
    bool end = x == t[last];
    return k == 0 && (end ? t[i] < x && x <= t[i + 1] : t[i] <= x && x < t[i + 1]);
  }
  long double left = (long double)t[i + d] - t[i], right = (long double)t[i + d + 1] - t[i + 1], sum = 0;
  if (k > 0) {
    if (left > 0) sum += d * function(t, last, d - 1, i, k - 1, x) / left;
    if (right > 0) sum -= d * function(t, last, d - 1, i + 1, k - 1, x) / right;
    return sum;
  }
  if (left > 0) sum += ((long double)x - t[i]) / left * function(t, last, d - 1, i, 0, x);
  if (right > 0) sum += ((long double)t[i + d + 1] - x) / right * function(t, last, d - 1, i + 1, 0, x);
  return sum;
}

static void definition(const surface_case *c, const double place[2], double jet[6][3]) {
  static const unsigned by[6][2] = {{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}};
  static long double n[2][3][SURFACE_KNOTS];
  for (int k = 0; k < 2; k++)
    for (unsigned o = 0; o < 3; o++)
      for (size_t i = 0; i < c->points[k]; i++)
        n[k][o][i] = function(c->knots[k], c->knot_count[k] - 1, c->degree[k], i, o, place[k]);
  for (int e = 0; e < 6; e++)
    for (int d = 0; d < 3; d++) {
      long double sum = 0;
      for (size_t i = 0; i < c->points[0]; i++)
        for (size_t j = 0; j < c->points[1]; j++)
          sum += n[0][by[e][0]][i] * n[1][by[e][1]][j] * c->control[i * c->points[1] + j][d];
      jet[e][d] = (double)sum;
    }
}

/* Largest difference of the six vectors, each over the size of the largest of its order. */
static double difference(const batten_surface_point *p, const double jet[6][3]) {
  const double *own[6] = {p->point, p->du, p->dv, p->duu, p->duv, p->dvv};
  double worst = 0;
  for (int e = 0; e < 6; e++) worst = surface_worse(worst, vec_distance(own[e], jet[e]) / (1 + vec_norm(jet[e])));
  return worst;
}

static void test_definition(batten_context *ctx) {
  static const unsigned degrees[][2] = {{1, 1}, {1, 3}, {2, 2}, {3, 3}, {5, 2}, {4, 7}, {9, 9}};
  for (size_t k = 0; k < sizeof degrees / sizeof *degrees; k++)
    for (unsigned fold = 1; fold <= 2; fold++) {
      surface_case c = surface_case_random(degrees[k][0], degrees[k][1], 3, 2, fold, 11 + k);
      batten_surface *s = surface_case_make(ctx, &c);
      uint64_t seed = 3;
      double worst = 0, inner = 0;
      for (int i = 0; i < 40; i++) {
        double place[2], jet[6][3], own[6][3];
        batten_surface_point p;
        surface_case_place(&c, &seed, place);
        if (i < 4)
          for (int a = 0; a < 2; a++) place[a] = c.knots[a][i >> a & 1 ? c.knot_count[a] - 1 : 0];
        if (i == 4) place[0] = c.knots[0][c.degree[0] + 1]; /* an inner knot: from the right */
        if (batten_surface_evaluate(ctx, s, 1, place, &p) < 0) worst = NAN;
        definition(&c, place, jet);
        worst = surface_worse(worst, difference(&p, (const double(*)[3])jet));
        surface_jet(s, place, own);
        inner = surface_worse(inner, difference(&p, (const double(*)[3])own));
      }
      T_RATIO(worst, 2e-13, "degrees %u, %u, inner knots %u fold, against the definition", degrees[k][0],
              degrees[k][1], fold);
      T_CHECK(inner == 0, "the jet alone is the same");
      batten_surface_free(s);
    }
}

/* ---- closed forms -------------------------------------------------------------------------------- */

/* The graph of f: K = (fxx fyy - fxy^2) / W^4, 2 H = ((1 + fy^2) fxx - 2 fx fy fxy + (1 + fx^2) fyy) / W^3 towards
 * the normal, W^2 = 1 + fx^2 + fy^2. */
static void test_graph(batten_context *ctx) {
  static const double f[3][3] = {{0.2, -0.4, 0.5}, {0.1, 0.6, 0}, {-0.3, 0, 0.25}};
  surface_case c = {.degree = {0}};
  uint64_t seed = 5;
  surface_case_axis(&c, 0, 4, 3, 2, -1, 1);
  surface_case_axis(&c, 1, 3, 4, 1, 0, 2);
  surface_case_shake(&c, 0, &seed);
  surface_case_graph(&c, f);
  batten_surface *s = surface_case_make(ctx, &c);
  double normal = 0, gauss = 0, mean = 0, principal = 0, axes = 0;
  for (int i = 0; i < 500; i++) {
    double at[2];
    batten_surface_point p;
    surface_case_place(&c, &seed, at);
    if (batten_surface_evaluate(ctx, s, 1, at, &p) < 0) normal = NAN;
    double x = at[0], y = at[1], fx = 0.1 + 0.6 * y - 0.6 * x + 0.5 * x * y * y, fxx = -0.6 + 0.5 * y * y;
    double fy = -0.4 + y + 0.6 * x + 0.5 * x * x * y, fyy = 1 + 0.5 * x * x, fxy = 0.6 + x * y;
    double w = sqrt(1 + fx * fx + fy * fy), k = (fxx * fyy - fxy * fxy) / pow(w, 4);
    double h = -((1 + fy * fy) * fxx - 2 * fx * fy * fxy + (1 + fx * fx) * fyy) / (2 * pow(w, 3));
    const double up[3] = {-fx / w, -fy / w, 1 / w};
    normal = surface_worse(normal, vec_distance(up, p.normal));
    gauss = surface_worse(gauss, fabs(p.gauss - k));
    mean = surface_worse(mean, fabs(p.mean - h));
    principal = surface_worse(principal, fabs(p.principal[0] - h - sqrt(fmax(0, h * h - k))) +
                                             fabs(p.principal[1] - h + sqrt(fmax(0, h * h - k))));
    for (int a = 0; a < 2; a++) {
      const double *d = p.directions[a];
      double along = -(fxx * d[0] * d[0] + 2 * fxy * d[0] * d[1] + fyy * d[1] * d[1]) / w;
      axes = surface_worse(axes, fabs(along - p.principal[a]) + fabs(vec_norm(d) - 1) + fabs(vec_dot(d, p.normal)));
    }
  }
  T_RATIO(normal, 1e-13, "graph of a polynomial: normals");
  T_RATIO(gauss, 1e-12, "Gauss curvature");
  T_RATIO(mean, 1e-12, "mean curvature, its sign");
  T_RATIO(principal, 1e-11, "principal curvatures, larger first");
  T_RATIO(axes, 1e-12, "principal directions: unit, tangent, of that curvature");
  batten_surface_free(s);

  /* By hand: the bottom of the bowl, and its corner, where r^2 = 2. */
  c = surface_case_bowl(2, 1);
  s = surface_case_make(ctx, &c);
  batten_surface_point p[2];
  T_OK(batten_surface_evaluate(ctx, s, 2, (const double[4]){0, 0, 1, -1}, p), ctx);
  T_CHECK(
      vec_norm(p[0].point) == 0 && fabs(p[0].gauss - 1) < 1e-15 && fabs(p[0].mean + 1) < 1e-15 && p[0].normal[2] == 1,
      "bottom of the bowl: K = 1, it bends towards the normal");
  T_CHECK(p[1].point[0] == 1 && p[1].point[1] == -1 && p[1].point[2] == 1 && fabs(p[1].gauss - 1 / 9.0) < 1e-15,
          "its corner: the control point itself, K = 1/9");
  batten_surface_free(s);
}

/* ---- the same surface otherwise ------------------------------------------------------------------ */

/* Relative difference of the six vectors and the curvatures, `sign` of the normal. */
static double compare(const batten_surface_point *a, const batten_surface_point *b, double sign) {
  double worst = vec_distance(a->point, b->point);
  for (int d = 0; d < 3; d++) worst = surface_worse(worst, fabs(a->normal[d] - sign * b->normal[d]));
  worst = surface_worse(worst, fabs(a->gauss - b->gauss) / (1 + fabs(a->gauss)));
  return surface_worse(worst, fabs(a->mean - sign * b->mean) / (1 + fabs(a->mean)));
}

static void test_same(batten_context *ctx) {
  surface_case c = surface_case_random(3, 4, 3, 2, 1, 21), turned = c, swapped = c, refined = c;
  surface_case_reverse(&turned, 0);
  surface_case_swap(&swapped);
  surface_case_insert(&refined, 0, -0.3);
  surface_case_insert(&refined, 0, -0.3);
  surface_case_insert(&refined, 1, 4.4);
  batten_surface *s = surface_case_make(ctx, &c), *r = surface_case_make(ctx, &turned);
  batten_surface *w = surface_case_make(ctx, &swapped), *f = surface_case_make(ctx, &refined);
  uint64_t seed = 9;
  double reversed = 0, exchanged = 0, finer = 0;
  for (int i = 0; i < 200; i++) {
    double at[2];
    surface_case_place(&c, &seed, at);
    batten_surface_point p[4];
    batten_status st = batten_surface_evaluate(ctx, s, 1, at, &p[0]);
    if (st >= 0) st = batten_surface_evaluate(ctx, r, 1, (const double[2]){-at[0], at[1]}, &p[1]);
    if (st >= 0) st = batten_surface_evaluate(ctx, w, 1, (const double[2]){at[1], at[0]}, &p[2]);
    if (st >= 0) st = batten_surface_evaluate(ctx, f, 1, at, &p[3]);
    if (st < 0) finer = NAN;
    reversed = surface_worse(reversed, compare(&p[0], &p[1], -1));
    exchanged = surface_worse(exchanged, compare(&p[0], &p[2], -1));
    finer = surface_worse(finer, compare(&p[0], &p[3], 1));
  }
  T_RATIO(reversed, 1e-13, "u reversed: the normal turns over");
  T_RATIO(exchanged, 1e-13, "u and v exchanged: the same");
  T_RATIO(finer, 1e-12, "with more knots: the same surface");
  batten_surface_free(f);
  batten_surface_free(w);
  batten_surface_free(r);
  batten_surface_free(s);
}

/* Control points times 2^k, knots times 2^j and moved: the same but for these factors, to the last bit. */
static void test_units(batten_context *ctx) {
  static const int scales[][2] = {{500, 0}, {-500, 0}, {0, 900}, {0, -900}, {1000, -40}, {-1000, -1000}};
  surface_case c = surface_case_random(3, 3, 3, 2, 1, 31);
  batten_surface *s = surface_case_make(ctx, &c);
  for (size_t k = 0; k < sizeof scales / sizeof *scales; k++) {
    int x = scales[k][0], t = scales[k][1];
    surface_case other = c;
    for (size_t i = 0; i < c.points[0] * c.points[1]; i++)
      for (int d = 0; d < 3; d++) other.control[i][d] = ldexp(c.control[i][d], x);
    for (int a = 0; a < 2; a++)
      for (size_t i = 0; i < c.knot_count[a]; i++) other.knots[a][i] = ldexp(c.knots[a][i], t);
    batten_surface *o = surface_case_make(ctx, &other);
    uint64_t seed = 7;
    bool same = true;
    for (int i = 0; i < 50; i++) {
      double at[2], to[2];
      surface_case_place(&c, &seed, at);
      for (int a = 0; a < 2; a++) to[a] = ldexp(at[a], t);
      batten_surface_point p, q;
      same =
          same && batten_surface_evaluate(ctx, s, 1, at, &p) == 0 && batten_surface_evaluate(ctx, o, 1, to, &q) == 0;
      for (int d = 0; d < 3 && same; d++)
        same = q.point[d] == ldexp(p.point[d], x) && q.du[d] == ldexp(p.du[d], x - t) &&
               q.dvv[d] == ldexp(p.dvv[d], x - 2 * t) && q.normal[d] == p.normal[d];
      same = same && q.gauss == ldexp(p.gauss, -2 * x) && q.mean == ldexp(p.mean, -x);
    }
    T_CHECK(same, "control points times 2^%d, knots times 2^%d: the same bits", x, t);
    batten_surface_free(o);
  }
  /* A domain far from 0 and one of next to no length: what does not depend on parameters is as it was. */
  static const double domains[][2] = {{1e6, 1e6 + 1}, {0, 1e-300}, {-1e300, 1e300}, {-1, -1 + 0x1p-40}};
  for (size_t k = 0; k < sizeof domains / sizeof *domains; k++) {
    surface_case a = surface_case_bowl(3, 2), b = a;
    for (int i = 0; i < 2; i++)
      for (size_t j = 0; j < a.knot_count[i]; j++) {
        double part = 0.5 * (a.knots[i][j] + 1);
        b.knots[i][j] = part == 1 ? domains[k][1] : (1 - part) * domains[k][0] + part * domains[k][1];
      }
    batten_surface *o = surface_case_make(ctx, &b), *own = surface_case_make(ctx, &a);
    double worst = 0;
    for (int i = 0; i <= 16; i++) {
      double part = i / 16.0, at[2], to[2] = {2 * part - 1, 1 - part};
      at[0] = (1 - part) * domains[k][0] + part * domains[k][1];
      at[1] = (1 - (1 - 0.5 * part)) * domains[k][0] + (1 - 0.5 * part) * domains[k][1];
      batten_surface_point p, q;
      if (batten_surface_evaluate(ctx, own, 1, to, &p) < 0 || batten_surface_evaluate(ctx, o, 1, at, &q) < 0)
        worst = NAN;
      worst = surface_worse(worst, compare(&p, &q, 1));
    }
    T_RATIO(worst, 1e-13, "domain from %g, %g long", domains[k][0], domains[k][1] - domains[k][0]);
    batten_surface_free(own);
    batten_surface_free(o);
  }
  batten_surface_free(s);
}

/* A surface of size 1 at 1e6: differences of control points keep the digits that these have. */
static void test_far(batten_context *ctx) {
  surface_case c = surface_case_bowl(3, 2), far = c;
  for (size_t i = 0; i < c.points[0] * c.points[1]; i++)
    for (int d = 0; d < 3; d++) {
      far.control[i][d] = c.control[i][d] + 0x1p30;
      c.control[i][d] = far.control[i][d] - 0x1p30; /* the same rounding, exactly */
    }
  batten_surface *s = surface_case_make(ctx, &c), *o = surface_case_make(ctx, &far);
  uint64_t seed = 3;
  double worst = 0;
  for (int i = 0; i < 100; i++) {
    double at[2];
    batten_surface_point p, q;
    surface_case_place(&c, &seed, at);
    if (batten_surface_evaluate(ctx, s, 1, at, &p) < 0 || batten_surface_evaluate(ctx, o, 1, at, &q) < 0) worst = NAN;
    for (int d = 0; d < 3; d++) q.point[d] = p.point[d];
    worst = surface_worse(worst, compare(&p, &q, 1));
  }
  T_RATIO(worst, 1e-14, "1e9 sizes from the origin: normals and curvatures to the last digit");
  batten_surface_free(o);
  batten_surface_free(s);
}

/* ---- degenerate, bad, threads -------------------------------------------------------------------- */

static void test_degenerate(batten_context *ctx) {
  surface_case c = surface_case_bowl(3, 1);
  for (size_t j = 1; j < c.points[1]; j++) memcpy(c.control[j], c.control[0], sizeof *c.control);
  batten_surface *s = surface_case_make(ctx, &c);
  batten_surface_point p;
  T_OK(batten_surface_evaluate(ctx, s, 1, (const double[2]){-1, 0.3}, &p), ctx);
  T_CHECK(vec_norm(p.normal) == 0 && isnan(p.gauss) && isnan(p.mean) && isnan(p.principal[1]) &&
              vec_norm(p.directions[0]) == 0 && vec_norm(p.dv) == 0 && vec_distance(p.point, c.control[0]) < 1e-15,
          "a side drawn together: no normal, but a point");
  T_OK(batten_surface_evaluate(ctx, s, 1, (const double[2]){-0.999, 0.3}, &p), ctx);
  T_CHECK(fabs(vec_norm(p.normal) - 1) < 1e-15 && isfinite(p.gauss), "a normal next to it");
  batten_surface_free(s);
  memset(c.control, 0, sizeof c.control);
  s = surface_case_make(ctx, &c);
  T_OK(batten_surface_evaluate(ctx, s, 1, (const double[2]){0, 0}, &p), ctx);
  T_CHECK(vec_norm(p.point) == 0 && vec_norm(p.normal) == 0 && isnan(p.gauss), "all control points at one place");
  batten_surface_free(s);
}

static void test_bad(batten_context *ctx) {
  surface_case c = surface_case_bowl(3, 2);
  batten_surface *s = surface_case_make(ctx, &c);
  batten_surface_point p[3], untouched;
  memset(&untouched, 5, sizeof untouched);
  p[0] = untouched;
  T_STATUS(batten_surface_evaluate(ctx, NULL, 0, NULL, p), BATTEN_E_INVALID, ctx, "surface: NULL");
  T_STATUS(batten_surface_evaluate(ctx, s, 1, NULL, p), BATTEN_E_INVALID, ctx, "places: NULL");
  T_STATUS(batten_surface_evaluate(ctx, s, 1, (const double[2]){0, 0}, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_STATUS(batten_surface_evaluate(ctx, s, 2, (const double[4]){0, 0, 0, 1.5}, p), BATTEN_E_INVALID, ctx,
           "places[1][1]: 1.5; give one from -1 to 1");
  T_STATUS(batten_surface_evaluate(ctx, s, 1, (const double[2]){NAN, 0}, p), BATTEN_E_INVALID, ctx,
           "places[0][0]: nan");
  T_CHECK(memcmp(&p[0], &untouched, sizeof untouched) == 0, "nothing is written then");
  T_OK(batten_surface_evaluate(ctx, s, 0, NULL, NULL), ctx);
  T_CHECK(batten_surface_evaluate(NULL, s, 0, NULL, NULL) == BATTEN_E_INVALID, "no context");
  batten_surface_free(s);
}

static void test_threads(void) {
  enum { COUNT = 3000 };
  surface_case c = surface_case_random(3, 3, 4, 4, 1, 41);
  batten_surface_point *out[2];
  double *places = malloc(COUNT * 2 * sizeof *places);
  uint64_t seed = 1;
  for (size_t i = 0; i < COUNT; i++) surface_case_place(&c, &seed, places + 2 * i);
  for (int k = 0; k < 2; k++) {
    batten_context *ctx = t_context(NULL, NULL, k ? 4 : 1);
    batten_surface *s = surface_case_make(ctx, &c);
    out[k] = calloc(COUNT, sizeof *out[k]);
    T_OK(batten_surface_evaluate(ctx, s, COUNT, places, out[k]), ctx);
    batten_surface_free(s);
    batten_context_free(ctx);
  }
  T_CHECK(memcmp(out[0], out[1], COUNT * sizeof *out[0]) == 0, "1 and 4 threads: the same bits");
  free(out[1]);
  free(out[0]);
  free(places);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_definition(ctx);
  test_graph(ctx);
  test_same(ctx);
  test_units(ctx);
  test_far(ctx);
  test_degenerate(ctx);
  test_bad(ctx);
  batten_context_free(ctx);
  test_threads();
  return t_done();
}
