/* The judge against quadruple precision, where plain sums would see only their own rounding; what it accepts as a
 * proof, and what not. */
#include "qp/certify.h"
#include "tap.h"

#include <float.h>

#ifdef __SIZEOF_FLOAT128__
__extension__ typedef __float128 wide;
#else
typedef long double wide;
#endif

static double uniform(uint64_t *seed) { return 2 * t_uniform(seed) - 1; }
static wide size_of(wide x) { return x < 0 ? -x : x; }
static double larger(double a, wide b) { return (double)b > a ? (double)b : a; }

/* ---- Figures ---- */

/* min (x + y - 3)^2 + y^2 / 2 + x + 7,  1 <= x - y <= 4, x >= 0 at (2, 1): all by hand. */
static void test_by_hand(void) {
  static const double a[] = {1, 1}, b[] = {3}, w[] = {2}, h[] = {0, 0, 0, 1}, g[] = {1, 0}, c[] = {1, -1},
                      low[] = {1.25};
  static const double high[] = {4}, x_low[] = {0, -INFINITY}, x[] = {2, 1}, y[] = {3, 0.5, -2};
  batten_matrix rows = batten_matrix_dense(1, 2, a), hessian = batten_matrix_dense(2, 2, h),
                side = batten_matrix_dense(1, 2, c);
  batten_qp_problem p = {.struct_size = sizeof p,
                         .n = 2,
                         .a = &rows,
                         .b = b,
                         .weights = w,
                         .h = &hessian,
                         .g = g,
                         .constant = 7,
                         .c = &side,
                         .lower = low,
                         .upper = high,
                         .x_lower = x_low};
  batten_qp_info info = {0};
  double work[4];
  qp_certify_residuals(&p, x, y, work, &info);
  /* gradient (1, 1); C'y + y_bounds = (3.5, -5); the -2 at y has no side */
  T_CHECK(info.objective == 9.5, "objective %g", info.objective);
  T_CHECK(info.primal_residual == 0.25 && info.primal_scale == 2, "primal %g of %g", info.primal_residual,
          info.primal_scale);
  T_CHECK(info.dual_residual == 6 && info.dual_scale == 7, "dual %g of %g", info.dual_residual, info.dual_scale);
  /* gradient'x = 3, sides 3 * 1.25 + 0.5 * 0 + (-2) * 1 */
  T_CHECK(fabs(info.duality_gap - 1.25) < 1e-15 && info.gap_scale == 19, "gap %g of %g", info.duality_gap,
          info.gap_scale);
  qp_certify_residuals(&p, x, NULL, work, &info);
  T_CHECK(info.dual_residual == 1 && info.duality_gap == 3, "without multipliers: %g, %g", info.dual_residual,
          info.duality_gap);
}

typedef struct scene {
  batten_qp_problem p;
  batten_matrix a, h, c;
  double *memory, *x, *y;
} scene;

/* n unknowns, sizes spread over 10^+-spread, side i at C x up to 1e-16, gradient nearly C'y: what is left is
 * rounding. */
static scene make_scene(size_t n, size_t k, size_t m, double spread, uint64_t seed) {
  scene s = {0};
  size_t count = k * n + n * n + m * n + 2 * k + n + 2 * m + 2 * n + n + m + n;
  double *at = s.memory = malloc(count * sizeof *at);
  for (size_t i = 0; i < count; i++) at[i] = uniform(&seed) * pow(10, spread * uniform(&seed));
  double *a = at, *h = a + k * n, *c = h + n * n, *b = c + m * n, *w = b + k, *g = w + k, *low = g + n,
         *high = low + m;
  double *x_low = high + m, *x_high = x_low + n;
  s.x = x_high + n, s.y = s.x + n;
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < i; j++) h[i * n + j] = h[j * n + i];
  for (size_t i = 0; i < k; i++) w[i] = fabs(w[i]);
  for (size_t i = 0; i < m; i++) {
    wide sum = 0;
    for (size_t j = 0; j < n; j++) sum += (wide)c[i * n + j] * s.x[j];
    low[i] = (double)sum - (i % 3 ? 0 : 1), high[i] = i % 2 ? INFINITY : (double)sum;
    s.y[i] = i % 4 == 3 ? 0 : i % 2 ? fabs(s.y[i]) : i % 3 ? s.y[i] : -fabs(s.y[i]);
  }
  for (size_t j = 0; j < n; j++) {
    x_low[j] = j % 2 ? -INFINITY : s.x[j], x_high[j] = j % 3 ? INFINITY : s.x[j] + 1;
    s.y[m + j] = j % 2 ? 0 : fabs(s.y[m + j]);
    wide sum = s.y[m + j];
    for (size_t i = 0; i < m; i++) sum += (wide)s.y[i] * c[i * n + j];
    for (size_t i = 0; i < n; i++) sum -= (wide)h[j * n + i] * s.x[i];
    for (size_t i = 0; i < k; i++) {
      wide r = -(wide)b[i];
      for (size_t q = 0; q < n; q++) r += (wide)a[i * n + q] * s.x[q];
      sum -= w[i] * r * a[i * n + j];
    }
    g[j] = (double)sum;
  }
  s.a = batten_matrix_dense(k, n, a), s.h = batten_matrix_dense(n, n, h), s.c = batten_matrix_dense(m, n, c);
  s.p = (batten_qp_problem){.struct_size = sizeof s.p,
                            .n = n,
                            .b = b,
                            .weights = w,
                            .g = g,
                            .constant = 0.5,
                            .lower = low,
                            .upper = high,
                            .x_lower = x_low,
                            .x_upper = x_high};
  return s;
}
static void link_scene(scene *s) { s->p.a = &s->a, s->p.h = &s->h, s->p.c = &s->c; }

static void wide_figures(const scene *s, double figures[4]) {
  const batten_qp_problem *p = &s->p;
  size_t n = p->n, m = s->c.rows;
  double primal = 0, dual = 0;
  wide objective = p->constant, gap = 0;
  for (size_t j = 0; j < n; j++) {
    wide gradient = p->g[j], held;
    objective += (wide)p->g[j] * s->x[j];
    for (size_t i = 0; i < n; i++) {
      gradient += (wide)s->h.dense[j * n + i] * s->x[i];
      objective += (wide)s->h.dense[j * n + i] * s->x[i] * s->x[j] / 2;
    }
    for (size_t i = 0; i < s->a.rows; i++) {
      wide r = -(wide)p->b[i];
      for (size_t q = 0; q < n; q++) r += (wide)s->a.dense[i * n + q] * s->x[q];
      gradient += p->weights[i] * r * s->a.dense[i * n + j];
      if (j == 0) objective += p->weights[i] * r * r / 2;
    }
    gap += gradient * s->x[j];
    held = s->y[m + j];
    for (size_t i = 0; i < m; i++) held += (wide)s->y[i] * s->c.dense[i * n + j];
    dual = larger(dual, size_of(gradient - held));
    if (s->y[m + j] != 0) gap -= (wide)s->y[m + j] * p->x_lower[j];
    primal = larger(larger(primal, (wide)p->x_lower[j] - s->x[j]), (wide)s->x[j] - p->x_upper[j]);
  }
  for (size_t i = 0; i < m; i++) {
    wide value = 0;
    for (size_t j = 0; j < n; j++) value += (wide)s->c.dense[i * n + j] * s->x[j];
    if (s->y[i] != 0) gap -= (wide)s->y[i] * (s->y[i] > 0 ? p->lower[i] : p->upper[i]);
    primal = larger(primal, p->lower[i] - value);
    if (p->upper[i] < INFINITY) primal = larger(primal, value - p->upper[i]);
  }
  figures[0] = (double)objective, figures[1] = primal, figures[2] = dual, figures[3] = (double)size_of(gap);
}

static void test_against_wide(size_t n, size_t k, size_t m, double spread, uint64_t seed) {
  scene s = make_scene(n, k, m, spread, seed);
  link_scene(&s);
  batten_qp_info info = {0};
  double figures[4], *work = malloc((2 * n + 1) * sizeof *work);
  wide_figures(&s, figures);
  qp_certify_residuals(&s.p, s.x, s.y, work, &info);
  double got[4] = {info.objective, info.primal_residual, info.dual_residual, info.duality_gap};
  double scale[4] = {info.gap_scale, info.primal_scale, info.dual_scale, info.gap_scale};
  static const char *name[4] = {"objective", "primal", "dual", "gap"};
  for (int q = 0; q < 4; q++) /* 1e-28: half of the digits below double's, of which n^2 sums lose a few */
    T_RATIO(fabs(got[q] - figures[q]), 2 * DBL_EPSILON * fabs(figures[q]) + 1e-28 * scale[q],
            "n = %zu, 10^+-%g: %s %.3g of %.3g", n, spread, name[q], figures[q], scale[q]);
  T_CHECK(figures[1] < 1e-14 * scale[1] && figures[2] < 1e-14 * scale[2], "they are below what plain sums can tell");

  /* sparse rows give the same; rows times 2^e and multipliers divided by it do, too, but for the primal residual */
  batten_matrix *parts[3] = {&s.a, &s.h, &s.c};
  void *blocks[6];
  for (int q = 0; q < 3; q++) {
    size_t rows = parts[q]->rows, *starts = blocks[2 * q] = malloc((rows + 1) * sizeof *starts);
    uint32_t *indices = blocks[2 * q + 1] = malloc((rows * n + 1) * sizeof *indices);
    for (size_t i = 0; i <= rows; i++) starts[i] = i * n;
    for (size_t e = 0; e < rows * n; e++) indices[e] = (uint32_t)(e % n);
    *parts[q] = batten_matrix_sparse(rows, n, starts, indices, parts[q]->dense);
  }
  batten_qp_info other = {0};
  qp_certify_residuals(&s.p, s.x, s.y, work, &other);
  T_CHECK(other.objective == info.objective && other.primal_residual == info.primal_residual &&
              other.dual_residual == info.dual_residual && other.duality_gap == info.duality_gap,
          "sparse rows: the same figures");
  double *c = s.memory + k * n + n * n, *low = c + m * n + 2 * k + n, *high = low + m;
  for (size_t i = 0; i < m; i++) {
    int e = (int)(i % 41) - 20;
    for (size_t j = 0; j < n; j++) c[i * n + j] = ldexp(c[i * n + j], e);
    low[i] = ldexp(low[i], e), high[i] = ldexp(high[i], e), s.y[i] = ldexp(s.y[i], -e);
  }
  qp_certify_residuals(&s.p, s.x, s.y, work, &other);
  T_CHECK(other.objective == info.objective && other.dual_residual == info.dual_residual &&
              other.duality_gap == info.duality_gap,
          "rows scaled: the same figures");
  for (int q = 0; q < 6; q++) free(blocks[q]);
  free(work), free(s.memory);
}

static void test_tolerances(void) {
  batten_qp_options o = {.tolerance_absolute = 1e-6, .tolerance_relative = 1e-3};
  batten_qp_info info = {.primal_residual = 1e-6, .dual_residual = 0.9e-3, .dual_scale = 1, .duality_gap = 0};
  T_CHECK(qp_certify_optimal(&info, &o) && qp_certify_feasible(&info, &o), "at the tolerance");
  info.duality_gap = 2e-6;
  T_CHECK(!qp_certify_optimal(&info, &o) && qp_certify_feasible(&info, &o), "gap beyond");
  info.primal_residual = NAN;
  T_CHECK(!qp_certify_feasible(&info, &o), "NaN is not feasible");
  static const double c[] = {1, 1}, low[] = {0}, x[] = {NAN, 1}, y[] = {0, 0, 0};
  batten_matrix rows = batten_matrix_dense(1, 2, c);
  batten_qp_problem p = {.struct_size = sizeof p, .n = 2, .c = &rows, .lower = low};
  double work[4];
  qp_certify_residuals(&p, x, y, work, &info);
  T_CHECK(!qp_certify_feasible(&info, &o), "nor is a point with NaN: %g", info.primal_residual);
}

/* ---- Proofs ---- */

static void test_infeasible(void) {
  /* x + y >= 1, x + y <= 0, x - y >= 0;  then with x <= 1/4, y <= 1/4 */
  static const double c[] = {1, 1, 3, 3, 1, -1}, low[] = {1, -INFINITY, 0}, high[] = {INFINITY, 0, INFINITY};
  static const double x_high[] = {0.25, 0.25}, none[] = {INFINITY, INFINITY};
  batten_matrix rows = batten_matrix_dense(3, 2, c);
  batten_qp_problem p = {.struct_size = sizeof p, .n = 2, .c = &rows, .lower = low, .upper = high, .x_upper = none};
  double work[4];
  struct {
    const char *what;
    double y[3];
    bool proof, with_bounds;
  } cases[] = {{"a proof, any length", {3e10, -1e10, 0}, true, true},
               {"a tiny one", {3e-300, -1e-300, 0}, true, true},
               {"wrong factor", {3, -0.9, 0}, false, true},
               {"off by 1e-9", {3, -1 + 1e-9, 0}, false, true},
               {"signs turned", {-3, 1, 0}, false, false},
               {"one row alone", {1, 0, 0}, false, true},
               {"another row alone", {0, 0, 1}, false, false},
               {"nothing", {0, 0, 0}, false, false},
               {"NaN", {NAN, -1, 0}, false, false}};
  for (size_t q = 0; q < sizeof cases / sizeof *cases; q++)
    for (int bounds = 0; bounds < 2; bounds++) {
      double y[5] = {cases[q].y[0], cases[q].y[1], cases[q].y[2], 77, -77};
      p.x_upper = bounds ? x_high : none;
      bool proof = qp_certify_infeasible(&p, y, work), expected = bounds ? cases[q].with_bounds : cases[q].proof;
      T_CHECK(proof == expected, "%s%s: %s", cases[q].what, bounds ? ", bounds" : "", proof ? "a proof" : "none");
      if (!proof) continue;
      double sum = 0, left[2] = {y[3], y[4]};
      for (int i = 0; i < 5; i++)
        if (y[i] != 0) sum += y[i] * (i > 2 ? p.x_upper[i - 3] : y[i] > 0 ? low[i] : high[i]);
      for (int i = 0; i < 6; i++) left[i % 2] += c[i] * y[i / 2];
      T_RATIO(fmax(fabs(sum - 1), fmax(fabs(left[0]), fabs(left[1]))), 1e-15, "sums of the proof");
      T_CHECK(y[3] <= 0 && y[4] <= 0, "bounds on their side");
    }
  /* sides that cross by rounding are no contradiction; by 1e-9 they are */
  for (int q = 0; q < 2; q++) {
    double close_low[] = {1, -INFINITY, 0}, close_high[] = {INFINITY, q ? 3 - 3e-9 : 3 - 0x1p-51, INFINITY},
           y[] = {3, -1, 0, 0, 0};
    p.x_upper = NULL, p.lower = close_low, p.upper = close_high;
    T_CHECK(qp_certify_infeasible(&p, y, work) == (q == 1), "sides cross by %s", q ? "1e-9" : "rounding");
  }
}

static void test_unbounded(void) {
  /* min (x - y)^2 / 2 - x, x + y >= 0, z >= 0 */
  static const double a[] = {1, -1, 0}, g[] = {-1, 0, 0}, c[] = {1, 1, 0}, low[] = {0},
                      x_low[] = {-INFINITY, -INFINITY, 0};
  static const double h[] = {0, 0, 0, 0, 0, 0, 0, 0, 4};
  batten_matrix rows = batten_matrix_dense(1, 3, a), side = batten_matrix_dense(1, 3, c),
                hessian = batten_matrix_dense(3, 3, h);
  batten_qp_problem p = {
      .struct_size = sizeof p, .n = 3, .a = &rows, .g = g, .h = &hessian, .c = &side, .lower = low, .x_lower = x_low};
  struct {
    const char *what;
    double d[3];
    bool ray;
  } cases[] = {{"a ray, any length", {1e9, 1e9, 0}, true},
               {"rounding against a bound", {3, 3, -1e-17}, true},
               {"tiny", {1e-290, 1e-290, 0}, true},
               {"upwards", {-1, -1, 0}, false},
               {"curved by A", {1, 0.99, 0}, false},
               {"curved by H", {1, 1, 1e-6}, false},
               {"nothing", {0, 0, 0}, false},
               {"NaN", {1, 1, NAN}, false}};
  for (size_t q = 0; q < sizeof cases / sizeof *cases; q++) {
    double d[3] = {cases[q].d[0], cases[q].d[1], cases[q].d[2]}, work[3];
    bool ray = qp_certify_unbounded(&p, d, work);
    T_CHECK(ray == cases[q].ray, "%s: %s", cases[q].what, ray ? "a ray" : "none");
    if (ray) T_RATIO(fabs(d[0] - 1) + fabs(d[1] - 1) + fabs(d[2]), 1e-15, "of slope -1");
  }
  double d[3] = {1, 1, 0}, work[3];
  static const double high[] = {5};
  p.upper = high;
  T_CHECK(!qp_certify_unbounded(&p, d, work), "a side in the way");
  p.upper = NULL, p.c = NULL, p.lower = NULL;
  T_CHECK(qp_certify_unbounded(&p, d, work), "without rows");
  static const double x_high[] = {INFINITY, 3, INFINITY};
  p.x_upper = x_high;
  T_CHECK(!qp_certify_unbounded(&p, d, work), "a bound in the way");
}

static void test_not_convex(void) {
  static const double h[] = {1, 2, 2, 1}, definite[] = {2, 1, 1, 2};
  static const double down[] = {1, -1}, up[] = {1, 1}, nan[] = {NAN, 1};
  batten_matrix hessian = batten_matrix_dense(2, 2, h), other = batten_matrix_dense(2, 2, definite);
  batten_qp_problem p = {.struct_size = sizeof p, .n = 2, .h = &hessian};
  T_CHECK(qp_certify_not_convex(&p, down) && !qp_certify_not_convex(&p, up) && !qp_certify_not_convex(&p, nan),
          "negative curvature by hand");
  p.h = &other;
  T_CHECK(!qp_certify_not_convex(&p, down), "a definite H");
  p.h = NULL;
  T_CHECK(!qp_certify_not_convex(&p, down), "no H");
}

int main(void) {
  test_by_hand();
  test_against_wide(1, 1, 1, 0, 1);
  test_against_wide(7, 9, 12, 0, 2);
  test_against_wide(40, 30, 90, 0, 3);
  test_against_wide(40, 30, 90, 3, 4);
  test_tolerances();
  test_infeasible();
  test_unbounded();
  test_not_convex();
  return t_done();
}
