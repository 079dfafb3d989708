/* Measures of surfaces: closed forms, dense sampling, other knots, units and frames. */
#include "mesh/vec.h"
#include "surface_shapes.h"

#include <float.h>

static batten_surface_measures measures_of(batten_context *ctx, const surface_case *c) {
  batten_surface *s = surface_case_make(ctx, c);
  batten_surface_measures m;
  memset(&m, 0, sizeof m);
  T_OK(batten_surface_measure(ctx, s, &m), ctx);
  batten_surface_free(s);
  return m;
}

static const double BOWL_AREA = 5.1231571010936054, BOWL_Z = 0.35993514362953505;

/* z = (x^2 + y^2) / 2 on [-1, 1]^2, W^2 = 1 + r^2: K = W^-4, the integral of K is 4 atan(1 / sqrt 3). Area, height of
 * the centroid and quantiles by quadrature with 60^2 nodes and sorting of 1.6e7 places. */
static void test_bowl(batten_context *ctx, unsigned degree, unsigned spans) {
  surface_case c = surface_case_bowl(degree, spans);
  batten_surface_measures m = measures_of(ctx, &c);
  printf("# bowl, degree %u, %u spans\n", degree, spans);
  T_RATIO(fabs(m.area / BOWL_AREA - 1), 1e-13, "area");
  T_RATIO(hypot(m.centroid[0], m.centroid[1]) + fabs(m.centroid[2] - BOWL_Z), 1e-13, "centroid");
  T_RATIO(fabs(m.gauss_integral - 2 * acos(-1) / 3), 1e-12, "integral of K");
  T_RATIO(fabs(m.gauss_max - 1) + fabs(m.gauss_min - 1 / 9.0), 1e-14, "extremes of K");
  T_CHECK(hypot(m.gauss_max_at[0], m.gauss_max_at[1]) < 1e-6 && fabs(m.gauss_min_at[0]) == 1 &&
              fabs(m.gauss_min_at[1]) == 1,
          "at the bottom (%.1e, %.1e) and in a corner", m.gauss_max_at[0], m.gauss_max_at[1]);
  T_RATIO(fabs(m.mean_min + 1) + fabs(m.mean_max + 2 / (3 * sqrt(3))), 1e-14, "extremes of H");
  T_RATIO(fabs(m.gauss_p01 / 0.130933 - 1) + fabs(m.gauss_p50 / 0.344666 - 1) + fabs(m.gauss_p99 / 0.968293 - 1),
          3e-3, "quantiles of K");
  T_RATIO(fabs(m.regularity_min * BOWL_AREA / 4 - 1), 1e-13, "least |du x dv|, at the bottom");
  T_RATIO(m.supporting_gap, 1e-15, "beyond tangent planes");
  double box = 0;
  for (int d = 0; d < 3; d++) box = fmax(box, fabs(m.upper[d] - 1) + fabs(m.lower[d] + (d < 2)));
  T_RATIO(box, 2e-9, "box");
}

/* z = x y: K = -1 / W^4, (x, y) lies (x - a) (y - b) / W over the plane at (a, b), and H has the sign of x y. */
static void test_saddle(batten_context *ctx) {
  static const double f[3][3] = {{0, 0, 0}, {0, 1, 0}, {0, 0, 0}};
  surface_case c = surface_case_bowl(1, 2);
  surface_case_graph(&c, f);
  batten_surface_measures m = measures_of(ctx, &c);
  T_RATIO(fabs(m.gauss_min + 1) + fabs(m.gauss_max + 1 / 9.0), 1e-14, "saddle: extremes of K");
  T_RATIO(fabs(m.gauss_integral + 2 * acos(-1) / 3), 1e-12, "integral of K");
  T_RATIO(fabs(m.area / BOWL_AREA - 1), 1e-13, "area");
  T_RATIO(fabs(m.mean_max + m.mean_min) + fabs(m.mean_max - 1 / (3 * sqrt(3))), 1e-14, "H is as much to both sides");
  T_RATIO(fabs(m.supporting_gap - 4 / sqrt(3)), 1e-14, "from a corner's plane to the opposite corner");
  T_CHECK(fabs(m.lower[2] + 1) < 1e-9 && fabs(m.upper[2] - 1) < 1e-9, "box");
}

/* ---- dense sampling ------------------------------------------------------------------------------ */

typedef struct dense {
  double gauss_min, gauss_max, mean_min, mean_max, area_min, area, gauss, moment[3], lower[3], upper[3];
} dense;

/* Midpoints of n x n cells of each span pair, and both sides of all knots. */
static dense sample(batten_context *ctx, const surface_case *c, const batten_surface *s, size_t n) {
  dense d = {INFINITY, -INFINITY, INFINITY, -INFINITY, INFINITY, 0, 0, {0}, {0}, {0}};
  double *t[2], *w[2];
  size_t count[2];
  for (int k = 0; k < 2; k++) {
    t[k] = malloc(SURFACE_KNOTS * (n + 2) * sizeof *t[k]);
    w[k] = malloc(SURFACE_KNOTS * (n + 2) * sizeof *w[k]);
    count[k] = 0;
    for (size_t i = 0; i + 1 < c->knot_count[k]; i++) {
      double a = c->knots[k][i], b = c->knots[k][i + 1], h = (b - a) / (double)n;
      for (size_t p = 0; p < n + 2 && a < b; p++, count[k]++) {
        t[k][count[k]] = p == 0 ? a : p == n + 1 ? nextafter(b, a) : a + ((double)p - 0.5) * h;
        w[k][count[k]] = p == 0 || p == n + 1 ? 0 : h;
      }
    }
  }
  for (int k = 0; k < 3; k++) {
    d.lower[k] = INFINITY;
    d.upper[k] = -INFINITY;
  }
  double *places = malloc(2 * count[1] * sizeof *places);
  batten_surface_point *out = malloc(count[1] * sizeof *out);
  for (size_t i = 0; i < count[0]; i++) {
    for (size_t j = 0; j < count[1]; j++) {
      places[2 * j] = t[0][i];
      places[2 * j + 1] = t[1][j];
    }
    if (batten_surface_evaluate(ctx, s, count[1], places, out) < 0) d.area = NAN;
    for (size_t j = 0; j < count[1]; j++) {
      double cross[3], area;
      vec_cross(out[j].du, out[j].dv, cross);
      area = vec_norm(cross) * w[0][i] * w[1][j];
      d.area += area;
      d.area_min = fmin(d.area_min, vec_norm(cross));
      d.gauss += area * out[j].gauss;
      d.gauss_min = fmin(d.gauss_min, out[j].gauss);
      d.gauss_max = fmax(d.gauss_max, out[j].gauss);
      d.mean_min = fmin(d.mean_min, out[j].mean);
      d.mean_max = fmax(d.mean_max, out[j].mean);
      for (int k = 0; k < 3; k++) {
        d.moment[k] += area * out[j].point[k];
        d.lower[k] = fmin(d.lower[k], out[j].point[k]);
        d.upper[k] = fmax(d.upper[k], out[j].point[k]);
      }
    }
  }
  free(out);
  free(places);
  for (int k = 0; k < 2; k++) {
    free(w[k]);
    free(t[k]);
  }
  return d;
}

/* An extreme is beyond all samples, but by no more than what a smooth function has between two of them. */
static void check_extreme(double found, double sampled, double sign, double range, const char *what) {
  double beyond = sign * (found - sampled) / range;
  T_CHECK(beyond >= -1e-9 && beyond < 2e-3, "%s: %.9g, beyond samples by %.1e of all there is", what, found, beyond);
}

static void test_dense(batten_context *ctx, unsigned p, unsigned q, unsigned fold, uint64_t seed) {
  surface_case c = surface_case_random(p, q, 2, 3, fold, seed);
  batten_surface *s = surface_case_make(ctx, &c);
  batten_surface_measures m;
  T_OK(batten_surface_measure(ctx, s, &m), ctx);
  printf("# random, degrees %u, %u, inner knots %u fold\n", p, q, fold);
  dense d = sample(ctx, &c, s, 100);
  double range = d.gauss_max - d.gauss_min, ranges = d.mean_max - d.mean_min, centroid = 0;
  double domain = 1;
  for (int k = 0; k < 2; k++) domain *= c.knots[k][c.knot_count[k] - 1] - c.knots[k][0];
  T_RATIO(fabs(m.area / d.area - 1), 3e-4, "area");
  T_RATIO(fabs(m.gauss_integral - d.gauss), 1e-2 * (1 + fabs(d.gauss)), "integral of K");
  for (int k = 0; k < 3; k++) centroid = fmax(centroid, fabs(m.centroid[k] - d.moment[k] / d.area));
  T_RATIO(centroid, 3e-4, "centroid");
  check_extreme(m.gauss_min, d.gauss_min, -1, range, "least K");
  check_extreme(m.gauss_max, d.gauss_max, 1, range, "largest K");
  check_extreme(m.mean_min, d.mean_min, -1, ranges, "least H");
  check_extreme(m.mean_max, d.mean_max, 1, ranges, "largest H");
  T_CHECK(m.regularity_min <= d.area_min * domain / m.area * (1 + 1e-9) && m.regularity_min > 0, "regularity %g",
          m.regularity_min);
  bool box = true;
  for (int k = 0; k < 3; k++) {
    double size = m.upper[k] - m.lower[k];
    box = box && m.lower[k] <= d.lower[k] && m.upper[k] >= d.upper[k] && m.lower[k] > d.lower[k] - 1e-3 * size &&
          m.upper[k] < d.upper[k] + 1e-3 * size;
  }
  T_CHECK(box, "the box holds all samples, closely");
  batten_surface_point at[2];
  double places[4] = {m.gauss_min_at[0], m.gauss_min_at[1], m.gauss_max_at[0], m.gauss_max_at[1]};
  T_OK(batten_surface_evaluate(ctx, s, 2, places, at), ctx);
  bool jumps = fold + 2 > (p < q ? p : q);
  T_CHECK(jumps || (fabs(at[0].gauss - m.gauss_min) < 1e-9 * range && fabs(at[1].gauss - m.gauss_max) < 1e-9 * range),
          "K has these values at these places");
  batten_surface_free(s);
}

/* ---- the same surface otherwise ------------------------------------------------------------------ */

static double differ(const batten_surface_measures *a, const batten_surface_measures *b) {
  double worst = fabs(a->area / b->area - 1);
  worst = surface_worse(worst, fabs(a->gauss_integral - b->gauss_integral));
  worst = surface_worse(worst, fabs(a->gauss_min - b->gauss_min) / fabs(a->gauss_min));
  worst = surface_worse(worst, fabs(a->gauss_max - b->gauss_max) / fabs(a->gauss_max));
  return worst;
}

static void test_same(batten_context *ctx) {
  surface_case c = surface_case_random(4, 4, 2, 2, 1, 5), other = c;
  batten_surface_measures m = measures_of(ctx, &c), n;
  surface_case_reverse(&other, 1);
  n = measures_of(ctx, &other);
  T_RATIO(differ(&m, &n) + fabs(m.mean_min + n.mean_max) + fabs(m.gauss_p50 - n.gauss_p50) +
              fabs(m.supporting_gap - n.supporting_gap),
          1e-11, "v reversed: the same, H with the other sign");
  other = c;
  surface_case_swap(&other);
  n = measures_of(ctx, &other);
  T_RATIO(differ(&m, &n) + fabs(m.mean_min + n.mean_max) + fabs(m.gauss_p01 - n.gauss_p01), 1e-11, "u, v exchanged");
  other = c;
  surface_case_insert(&other, 0, -0.9);
  surface_case_insert(&other, 1, 3.2);
  n = measures_of(ctx, &other);
  T_RATIO(differ(&m, &n), 1e-9, "more knots");
  other = c;
  const double move[3] = {3, -40, 17};
  for (size_t i = 0; i < c.points[0] * c.points[1]; i++) surface_turn(c.control[i], 0.25, move, other.control[i]);
  n = measures_of(ctx, &other);
  double centroid[3];
  surface_turn(m.centroid, 0.25, move, centroid);
  T_RATIO(vec_distance(centroid, n.centroid), 1e-12, "turned, smaller and moved: the centroid goes along");
  n.area *= 16;
  n.gauss_min /= 16;
  n.gauss_max /= 16;
  T_RATIO(differ(&m, &n) + fabs(m.supporting_gap - 4 * n.supporting_gap), 1e-10, "the rest as the unit says");
  /* Powers of two change no bit. */
  static const int scale[] = {-300, 300};
  for (int k = 0; k < 2; k++) {
    int x = scale[k];
    for (size_t i = 0; i < c.points[0] * c.points[1]; i++)
      for (int d = 0; d < 3; d++) other.control[i][d] = ldexp(c.control[i][d], x);
    n = measures_of(ctx, &other);
    T_CHECK(n.area == ldexp(m.area, 2 * x) && n.gauss_min == ldexp(m.gauss_min, -2 * x) &&
                n.gauss_p50 == ldexp(m.gauss_p50, -2 * x) && n.mean_max == ldexp(m.mean_max, -x) &&
                n.supporting_gap == ldexp(m.supporting_gap, x) && n.upper[2] == ldexp(m.upper[2], x) &&
                n.regularity_min == m.regularity_min && n.gauss_integral == m.gauss_integral,
            "times 2^%d: the same bits", x);
  }
}

/* ---- special ------------------------------------------------------------------------------------- */

static void test_special(batten_context *ctx) {
  static const double plane[3][3] = {{1, 2, 0}, {-1, 0, 0}, {0, 0, 0}};
  surface_case c = surface_case_bowl(3, 2);
  surface_case_graph(&c, plane);
  batten_surface_measures m = measures_of(ctx, &c);
  T_RATIO(fabs(m.area - 4 * sqrt(6)), 1e-14, "plane: area");
  T_RATIO(fabs(m.gauss_min) + fabs(m.gauss_max) + fabs(m.mean_min) + fabs(m.mean_max), 1e-13, "no curvature");
  T_RATIO(m.supporting_gap + fabs(m.regularity_min - 1), 1e-14, "all on its tangent planes; regular");

  /* A side drawn together: the triangle of the plane over (-1, 0), (1, -1), (1, 1), area 2. */
  c = surface_case_bowl(2, 1);
  for (size_t i = 0; i < 3; i++)
    for (size_t j = 0; j < 3; j++) {
      double *b = c.control[3 * i + j];
      b[0] = (double)i - 1;
      b[1] = ((double)j - 1) * 0.5 * (double)i;
      b[2] = 0;
    }
  m = measures_of(ctx, &c);
  T_RATIO(fabs(m.area - 2) + fabs(m.centroid[0] - 1 / 3.0), 1e-14, "triangle: area and centroid");
  T_CHECK(m.regularity_min == 0 && m.gauss_min == 0 && m.gauss_max == 0, "not regular, flat where it is");

  /* A crease: x = u, z = |u|; K = 0 but no tangent plane has the other half on its own side, or on the wrong one. */
  c = surface_case_bowl(1, 2);
  for (size_t i = 0; i < 9; i++) c.control[i][2] = fabs(c.control[i][0]);
  m = measures_of(ctx, &c);
  T_RATIO(fabs(m.area - 4 * sqrt(2)) + m.supporting_gap, 1e-14, "roof: area, and a part of a convex body");
  T_CHECK(m.lower[2] == 0 && m.upper[2] == 1 && m.lower[0] == -1, "its box, exactly");

  memset(c.control, 0, sizeof c.control);
  m = measures_of(ctx, &c);
  T_CHECK(m.area == 0 && vec_norm(m.centroid) == 0 && isnan(m.gauss_min) && isnan(m.gauss_p50) &&
              isnan(m.gauss_max_at[0]) && m.supporting_gap == 0 && m.regularity_min == 0,
          "a point has no area, no curvature");

  batten_surface *s = surface_case_make(ctx, &c);
  m.area = 7;
  T_STATUS(batten_surface_measure(ctx, NULL, &m), BATTEN_E_INVALID, ctx, "surface: NULL");
  T_STATUS(batten_surface_measure(ctx, s, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_CHECK(batten_surface_measure(NULL, s, &m) == BATTEN_E_INVALID && m.area == 7, "no context; nothing written");
  batten_surface_free(s);
}

/* u = 0: K jumps at a double knot of a cubic; its largest value is on one side of it. */
static void test_jump(batten_context *ctx) {
  surface_case c = surface_case_bowl(3, 1);
  surface_case_axis(&c, 0, 3, 2, 2, -1, 1);
  surface_case_graph(&c, surface_bowl);
  /* z + u^2 (1 + u) on the left only: control points 0 .. 5 of the left are its blossom, those of the right as
   * before. The left cubic's Bezier points of u^2 + u^3 on [-1, 0] are 0, 1/3, 0, 0. */
  for (size_t j = 0; j < c.points[1]; j++) c.control[c.points[1] + j][2] += 1 / 3.0;
  batten_surface_measures m = measures_of(ctx, &c);
  /* At (0-, 0): z_uu = 1 + 2, z_vv = 1, flat: K = 3; to the right of it 1. */
  T_CHECK(fabs(m.gauss_max - 3) < 1e-12 && fabs(m.gauss_max_at[0]) < 1e-7 && fabs(m.gauss_max_at[1]) < 1e-7,
          "the larger side of a jump: K = %.15g at (%.1e, %.1e)", m.gauss_max, m.gauss_max_at[0], m.gauss_max_at[1]);
}

static batten_status measure_some(batten_context *ctx, void *arg) {
  const surface_case *c = arg;
  batten_surface_form form = surface_case_form(c);
  batten_surface *s;
  batten_surface_measures m;
  batten_status st = batten_surface_create(ctx, &form, &s);
  if (st < 0) return st;
  st = batten_surface_measure(ctx, s, &m);
  batten_surface_free(s);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_bowl(ctx, 2, 1);
  test_bowl(ctx, 5, 3);
  test_saddle(ctx);
  test_dense(ctx, 3, 3, 1, 1);
  test_dense(ctx, 5, 4, 1, 2);
  test_dense(ctx, 3, 4, 2, 3);
  test_dense(ctx, 9, 2, 1, 4);
  test_same(ctx);
  test_special(ctx);
  test_jump(ctx);
  surface_case c = surface_case_random(3, 3, 2, 2, 1, 3);
  batten_surface_measures m[2];
  for (int k = 0; k < 2; k++) {
    batten_context *own = t_context(NULL, NULL, k ? 4 : 1);
    double start = batten_now();
    m[k] = measures_of(own, &c);
    printf("# %.1f ms\n", 1e3 * (batten_now() - start));
    batten_context_free(own);
  }
  T_CHECK(memcmp(&m[0], &m[1], sizeof m[0]) == 0, "1 and 4 threads: the same bits");
  t_fail_every_allocation("batten_surface_measure", measure_some, &c);
  t_cancel_every_progress("batten_surface_measure", measure_some, &c);
  batten_context_free(ctx);
  return t_done();
}
