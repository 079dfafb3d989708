/* Outward normals of unoriented points, against shapes whose normals are known; the energy against the whole Hermite
 * system; what must not change the result; bad input. */
#include <batten/batten.h>

#include "orient_scenes.h"
#include "solid/orient_energy.h"

static const batten_orient_method automatic = BATTEN_ORIENT_METHOD_AUTO, energy = BATTEN_ORIENT_METHOD_ENERGY,
                                  planes = BATTEN_ORIENT_METHOD_PLANES;

/* Shapes from sparse to dense, thin, nested, linked, noisy. least, least_30: percent within 90 and 30 degrees. */
static void test_energy(batten_context *ctx) {
  const double zero[3] = {0}, right[3] = {1, 0, 0}, up[3] = {0, 0.7, 0.7}, far[3] = {6, 0, 0};
  scene s = s_new("thick C", 2);
  s_thick_c(&s, 59);
  s_orient(ctx, &s, automatic, 1000, energy, 100, 100);
  s_free(&s);
  s = s_new("thick C, few points", 2);
  s_thick_c(&s, 25);
  s_orient(ctx, &s, automatic, 1000, energy, 100, 100);
  s_free(&s);
  s = s_new("two contours", 2);
  s_ellipse(&s, 40, 0, 0, 1, 0.6, 1);
  s_ellipse(&s, 27, 2.2, 0.4, 0.6, 0.6, 1);
  s_orient(ctx, &s, automatic, 1000, energy, 100, 100);
  s_free(&s);
  s = s_new("contour, hole, island", 2);
  s_ellipse(&s, 40, 0, 0, 1, 0.8, 1);
  s_ellipse(&s, 27, 0.1, 0, 0.5, 0.4, -1);
  s_ellipse(&s, 12, 0.1, 0, 0.2, 0.2, 1);
  s_orient(ctx, &s, automatic, 1000, energy, 100, 100);
  s_free(&s);
  for (uint64_t seed = 3; seed < 6; seed++) {
    s = s_new("cube", 3);
    s_cube(&s, 90, seed);
    s_orient(ctx, &s, automatic, 1000, energy, 100, 60);
    s_free(&s);
  }
  for (double gap = 5; gap > 0; gap -= 2) {
    s = s_new("plate, sides 5, 3, 1 spacings apart", 3);
    s_plate(&s, 8, gap, 0.3, 5);
    s_orient(ctx, &s, automatic, 1000, energy, 100, 60);
    s_free(&s);
  }
  s = s_new("torus", 3);
  s_torus(&s, 300, zero, 1, 0.35, 2, 1);
  s_orient(ctx, &s, automatic, 1000, energy, 100, 100);
  s_noise(&s, 0.04, 7);
  s.name = "torus, noise of 11 % of its thin radius";
  s_orient(ctx, &s, automatic, 1000, energy, 100, 95);
  s_free(&s);
  s = s_new("linked tori", 3);
  s_torus(&s, 250, zero, 1, 0.3, 2, 1);
  s_torus(&s, 250, right, 1, 0.3, 1, 2);
  s_orient(ctx, &s, automatic, 1000, energy, 100, 100);
  s_free(&s);
  s = s_new("shell and small far ball", 3);
  s_sphere(&s, 150, zero, 1, 1);
  s_sphere(&s, 150, zero, 0.6, -1);
  s_sphere(&s, 100, far, 0.2, 1);
  s_orient(ctx, &s, automatic, 1000, energy, 100, 100);
  s_free(&s);
  s = s_new("ball, noise of half its spacing", 3);
  s_sphere(&s, 400, zero, 1, 1);
  s_noise(&s, 0.15, 9);
  s_orient(ctx, &s, automatic, 1000, energy, 99, 50);
  s_free(&s);
  s = s_new("three small balls", 3);
  s_sphere(&s, 50, zero, 0.05, 1);
  s_sphere(&s, 50, right, 0.05, 1);
  s_sphere(&s, 50, up, 0.05, 1);
  s_orient(ctx, &s, automatic, 1000, energy, 100, 100);
  s_free(&s);
}

static void test_subset(batten_context *ctx) {
  scene s = s_new("linked tori, a tenth of the points", 3);
  s_torus(&s, 2000, (double[3]){0}, 1, 0.3, 2, 1);
  s_torus(&s, 2000, (double[3]){1, 0, 0}, 1, 0.3, 1, 2);
  s_orient(ctx, &s, automatic, 400, energy, 100, 99.9);
  s_free(&s);
  s = s_new("plate, sides a third of the subset's spacing apart", 3);
  s_plate(&s, 60, 2, 0.3, 5);
  s_orient(ctx, &s, automatic, 200, energy, 100, 85); /* the subset sees one sheet, Gauss's formula two */
  s_free(&s);
  s = s_new("torus, every point twice", 3);
  s_torus(&s, 200, (double[3]){0}, 1, 0.35, 2, 1);
  s_torus(&s, 200, (double[3]){0}, 1, 0.35, 2, 1);
  s_orient(ctx, &s, energy, 1000, energy, 100, 95);
  s_free(&s);
  s = s_new("ball, every point 12 times", 3); /* more than there are neighbours */
  for (int i = 0; i < 12; i++) s_sphere(&s, 60, (double[3]){0}, 1, 1);
  for (size_t energy_points = 40; energy_points <= 1000; energy_points *= 5) {
    s_orient(ctx, &s, energy, energy_points, energy, 100, 100);
    s_orient(ctx, &s, planes, energy_points, planes, 100, 100);
  }
  s_free(&s);
}

static void test_planes(batten_context *ctx) {
  scene s = s_new("torus", 3);
  s_torus(&s, 600, (double[3]){0}, 1, 0.35, 2, 1);
  s_orient(ctx, &s, planes, 0, planes, 100, 98);
  s_free(&s);
  s = s_new("thick C", 2);
  s_thick_c(&s, 59);
  s_orient(ctx, &s, planes, 0, planes, 100, 100);
  s_free(&s);
  s = s_new("plate, sides 5 spacings apart", 3);
  s_plate(&s, 20, 5, 0.3, 5);
  s_orient(ctx, &s, planes, 0, planes, 100, 80);
  s_free(&s);
  s = s_new("linked tori", 3); /* one pair of neighbours joins them */
  s_torus(&s, 400, (double[3]){0}, 1, 0.3, 2, 1);
  s_torus(&s, 400, (double[3]){1, 0, 0}, 1, 0.3, 1, 2);
  s_orient(ctx, &s, planes, 0, planes, 100, 98);
  s_free(&s);
  s = s_new("shell, three balls in it", 3);
  s_sphere(&s, 2000, (double[3]){0}, 1, 1);
  s_sphere(&s, 2000, (double[3]){0}, 0.8, -1);
  for (int i = 0; i < 3; i++) s_sphere(&s, 60, (double[3]){0.4 * (i == 1), 0.4 * (i == 2), 0}, 0.1, 1);
  s_orient(ctx, &s, planes, 0, planes, 100, 99);
  s_free(&s);
}

/* ---- the same energy from the whole Hermite matrix ------------------------------------------------ */

typedef struct hermite {
  unsigned n;
  size_t count;
  const double *x;
  double lambda;
} hermite;

/* Unknowns: a_0 .. a_N-1, then b_0, b_1, ... of n components. */
static double hermite_entry(const hermite *h, size_t row, size_t col) {
  unsigned n = h->n;
  size_t N = h->count, i = row < N ? row : (row - N) / n, j = col < N ? col : (col - N) / n;
  unsigned r = row < N ? 0 : (unsigned)((row - N) % n), c = col < N ? 0 : (unsigned)((col - N) % n);
  double e[3] = {0}, square = 0;
  for (unsigned q = 0; q < n; q++) {
    e[q] = h->x[i * n + q] - h->x[j * n + q];
    square += e[q] * e[q];
  }
  double length = sqrt(square);
  if (row < N && col < N) return length * length * length + (i == j ? h->lambda : 0);
  if (row < N) return -3 * length * e[c];
  if (col < N) return 3 * length * e[r];
  return length > 0 ? -3 * ((r == c) * length + e[r] * e[c] / length) : 0;
}
static void hermite_fill(const void *user, size_t row0, size_t rows, size_t col0, size_t cols, double *tile,
                         size_t ld) {
  for (size_t j = 0; j < cols; j++)
    for (size_t i = 0; i < rows; i++) tile[i + j * ld] = hermite_entry(user, row0 + i, col0 + j);
}

static void test_system(batten_context *ctx, unsigned n) {
  enum { N = 25, SIZE = 4 * N };
  double x[3 * N], g[3 * N], mg[3 * N], back[3 * N], a[N], b[3 * N], c[3], p[4 * SIZE] = {0}, rhs[SIZE] = {0};
  double w[SIZE], poly[4];
  uint64_t seed = 11;
  for (size_t i = 0; i < n * N; i++) {
    x[i] = t_uniform(&seed) - 0.5;
    g[i] = t_uniform(&seed) - 0.5;
  }
  for (unsigned q = 0; q < n; q++) { /* the system moves its points to the centroid: so that both see the same */
    double mean = 0;
    for (size_t i = 0; i < N; i++) mean += x[i * n + q] / N;
    for (size_t i = 0; i < N; i++) x[i * n + q] -= mean;
  }
  size_t size = (n + 1) * N;
  hermite h = {n, N, x, 1e-3};
  for (size_t i = 0; i < N; i++) {
    p[i] = 1;
    for (unsigned q = 0; q < n; q++) {
      p[(q + 1) * size + i] = x[i * n + q];
      p[(q + 1) * size + N + i * n + q] = 1;
      rhs[N + i * n + q] = g[i * n + q];
    }
  }
  batten_saddle_matrix matrix = {size, n + 1, p, hermite_fill, &h, NULL};
  batten_saddle_options options = batten_saddle_options_default();
  options.method = BATTEN_SADDLE_LDL;
  batten_saddle *saddle = NULL;
  T_OK(batten_saddle_factor(ctx, &matrix, &options, &saddle), ctx);
  T_CHECK(batten_saddle_solve(ctx, saddle, rhs, w, poly) >= 0, "Hermite system solved by LDL'");
  batten_saddle_free(saddle);

  batten_orient_system s = {0};
  T_OK(batten_orient_system_new(ctx, n, N, x, &s), ctx);
  T_OK(batten_orient_system_factor(ctx, &s, 1), ctx); /* a factor can be replaced */
  T_OK(batten_orient_system_factor(ctx, &s, h.lambda), ctx);
  batten_orient_system_solve(&s, g, mg);
  batten_orient_system_multiply(&s, mg, back);
  T_OK(batten_orient_system_field(ctx, &s, g, a, b, c), ctx);
  double largest = 0, off_mg = 0, off_back = 0, off_a = 0, off_c = 0;
  for (size_t i = 0; i < n * N; i++) {
    largest = fmax(largest, fabs(w[N + i]));
    off_mg = fmax(off_mg, fabs(mg[i] - w[N + i]));
    off_back = fmax(off_back, fabs(back[i] - g[i]));
  }
  for (size_t i = 0; i < N; i++) off_a = fmax(off_a, fabs(a[i] - w[i]));
  for (unsigned q = 0; q < n; q++) off_c = fmax(off_c, fabs(c[q] - poly[q + 1]));
  T_RATIO(off_mg, 1e-9 * largest, "n = %u: M g is the Hermite system's solution", n);
  T_RATIO(off_a, 1e-7 * largest, "n = %u: value coefficients", n);
  T_RATIO(off_c, 1e-8 * largest, "n = %u: linear part", n);
  T_RATIO(off_back, 1e-9, "n = %u: S M g = g", n);

  batten_orient_field f = {.n = n, .count = N, .points = x, .a = a, .b = b, .c = {c[0], c[1], c[2]}};
  batten_orient_field_gradients(ctx, &f, N, x, back);
  double off = 0;
  for (size_t i = 0; i < n * N; i++) off = fmax(off, fabs(back[i] - g[i]));
  T_RATIO(off, 1e-9 * largest, "n = %u: the field has the gradients", n);
  batten_orient_system_free(ctx, &s);
}

/* ---- what must not matter ------------------------------------------------------------------------- */

static double worst_cosine(size_t values, unsigned n, const double *u, const double *v) {
  double worst = 1;
  for (size_t i = 0; i < values; i += n) {
    double cosine = 0;
    for (unsigned c = 0; c < n; c++) cosine += u[i + c] * v[i + c];
    worst = fmin(worst, cosine);
  }
  return worst;
}

static void test_invariance(batten_context *ctx, batten_orient_method method) {
  enum { N = 240 };
  static double moved[3 * N], base[3 * N], got[3 * N], expected[3 * N];
  scene s = s_new("two tori", 3); /* no symmetry: ties in distance are broken by the order of the points */
  s_torus(&s, 160, (double[3]){0}, 1, 0.35, 2, 1);
  s_torus(&s, 80, (double[3]){0, 0, 1}, 0.5, 0.2, 1, 2);
  T_OK(batten_orient(ctx, 3, N, s.points, method, 150, base, NULL, NULL), ctx);

  const double rotation[3][3] = {{0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}};
  for (size_t i = 0; i < N; i++)
    for (int r = 0; r < 3; r++) {
      moved[3 * i + (size_t)r] = expected[3 * i + (size_t)r] = 0;
      for (int c = 0; c < 3; c++) {
        moved[3 * i + (size_t)r] += rotation[r][c] * s.points[3 * i + (size_t)c];
        expected[3 * i + (size_t)r] += rotation[r][c] * base[3 * i + (size_t)c];
      }
    }
  T_OK(batten_orient(ctx, 3, N, moved, method, 150, got, NULL, NULL), ctx);
  T_RATIO(1 - worst_cosine(3 * N, 3, got, expected), 1e-6, "rotated points, rotated normals: 1 - cosine");

  for (size_t i = 0; i < 3 * N; i++) moved[i] = 0x1p40 * s.points[i];
  T_OK(batten_orient(ctx, 3, N, moved, method, 150, got, NULL, NULL), ctx);
  T_RATIO(1 - worst_cosine(3 * N, 3, got, base), 1e-9, "2^40 times as large: 1 - cosine");
  for (size_t i = 0; i < 3 * N; i++) moved[i] = 7e6 + s.points[i];
  T_OK(batten_orient(ctx, 3, N, moved, method, 150, got, NULL, NULL), ctx);
  T_RATIO(1 - worst_cosine(3 * N, 3, got, base), 1e-6, "7e6 from the origin: 1 - cosine");

  for (size_t i = 0; i < N; i++) { /* 77 and 240 have no common divisor */
    memcpy(moved + 3 * i, s.points + 3 * (i * 77 % N), 3 * sizeof *moved);
    memcpy(expected + 3 * i, base + 3 * (i * 77 % N), 3 * sizeof *moved);
  }
  T_OK(batten_orient(ctx, 3, N, moved, method, 150, got, NULL, NULL), ctx);
  T_RATIO(1 - worst_cosine(3 * N, 3, got, expected), 1e-6, "permuted points, permuted normals: 1 - cosine");

  batten_context *many = t_context(NULL, NULL, 7);
  T_OK(batten_orient(many, 3, N, s.points, method, 150, got, NULL, NULL), many);
  T_CHECK(!memcmp(got, base, sizeof got), "the same bits on 7 threads of our own loops");
  batten_context_free(many);
  s_free(&s);
}

/* ---- failures ------------------------------------------------------------------------------------- */

typedef struct small_case {
  unsigned n;
  batten_orient_method method;
  size_t count, energy_points;
} small_case;

static batten_status small_call(batten_context *ctx, void *arg) {
  const small_case *c = arg;
  double normals[120], before[120];
  scene s = s_new("small", c->n);
  if (c->n == 3)
    s_sphere(&s, c->count, (double[3]){0}, 1, 1);
  else
    s_ellipse(&s, c->count, 0, 0, 2, 1, 1);
  for (int i = 0; i < 120; i++) normals[i] = before[i] = 77;
  batten_status status =
      batten_orient(ctx, c->n, c->count, s.points, c->method, c->energy_points, normals, NULL, NULL);
  if (status < 0 && memcmp(normals, before, sizeof normals)) t_line(false, "output touched on failure");
  s_free(&s);
  return status;
}

static void test_failures(void) {
  small_case cases[] = {{3, planes, 40, 0}, {3, energy, 30, 30}, {3, automatic, 40, 20}, {2, automatic, 20, 30}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    t_fail_every_allocation("batten_orient", small_call, &cases[i]);
    t_cancel_every_progress("batten_orient", small_call, &cases[i]);
  }
}

/* The reported lambda is that of the box of longest side 1; the walk takes tens of the unit size. An ellipse with
 * axes 2 and 1, evenly in its parameter, has the root mean square radius sqrt(5/2). */
static void test_lambda(batten_context *ctx) {
  double normals[80], lambda = 0;
  scene s = s_new("ellipse", 2);
  s_ellipse(&s, 40, 0, 0, 2, 1, 1);
  T_OK(batten_orient(ctx, 2, 40, s.points, energy, 1000, normals, NULL, &lambda), ctx);
  double side = 4 * cos(s_pi / 40), unit = 2 * sqrt(2.5), box = lambda * pow(side / unit, 3);
  T_RATIO(fabs(box - 1e-3), 1e-15, "lambda of the box %.6g is 1e-3 of the unit size", lambda);
  s_free(&s);
}

static void test_bad_input(batten_context *ctx) {
  double x[15] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1}, line[8] = {0, 0, 1, 2, 2, 4, 5, 10};
  double flat[15] = {0, 0, 7, 1, 0, 7, 0, 1, 7, 1, 1, 7, 2, 1, 7}, equal[15] = {0}, v[15];
  double twice[18] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0};
  T_STATUS(batten_orient(ctx, 1, 5, x, planes, 9, v, NULL, NULL), BATTEN_E_INVALID, ctx, "n: 1");
  T_STATUS(batten_orient(ctx, 4, 5, x, planes, 9, v, NULL, NULL), BATTEN_E_INVALID, ctx, "n: 4");
  T_STATUS(batten_orient(ctx, 3, 4, x, planes, 9, v, NULL, NULL), BATTEN_E_INVALID, ctx, "count: 4; 5 points");
  T_STATUS(batten_orient(ctx, 3, 0, x, planes, 9, v, NULL, NULL), BATTEN_E_INVALID, ctx, "count: 0");
  T_STATUS(batten_orient(ctx, 3, 5, NULL, planes, 9, v, NULL, NULL), BATTEN_E_INVALID, ctx, "points: NULL");
  T_STATUS(batten_orient(ctx, 3, 5, x, planes, 9, NULL, NULL, NULL), BATTEN_E_INVALID, ctx, "normals: NULL");
  T_STATUS(batten_orient(ctx, 3, 5, x, (batten_orient_method)7, 9, v, NULL, NULL), BATTEN_E_INVALID, ctx,
           "method: 7");
  T_STATUS(batten_orient(ctx, 3, 5, x, automatic, 3, v, NULL, NULL), BATTEN_E_INVALID, ctx, "energy_points: 3");
  T_STATUS(batten_orient(ctx, 3, SIZE_MAX / 8, x, planes, 9, v, NULL, NULL), BATTEN_E_TOO_LARGE, ctx, "count");
  T_STATUS(batten_orient(ctx, 3, 5, flat, automatic, 9, v, NULL, NULL), BATTEN_E_SINGULAR, ctx,
           "plane, normal (0, 0, ");
  T_STATUS(batten_orient(ctx, 2, 4, line, planes, 9, v, NULL, NULL), BATTEN_E_SINGULAR, ctx, "line, normal (");
  T_STATUS(batten_orient(ctx, 3, 5, equal, planes, 9, v, NULL, NULL), BATTEN_E_SINGULAR, ctx, "all 5 are equal");
  T_STATUS(batten_orient(ctx, 3, 6, twice, energy, 9, v, NULL, NULL), BATTEN_E_INVALID, ctx, "4 different");
  x[7] = NAN;
  T_STATUS(batten_orient(ctx, 3, 5, x, planes, 9, v, NULL, NULL), BATTEN_E_INVALID, ctx,
           "points[2]: coordinate 1 is nan");
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_system(ctx, 2);
  test_system(ctx, 3);
  test_planes(ctx);
  test_energy(ctx);
  test_subset(ctx);
  test_invariance(ctx, planes);
  test_invariance(ctx, energy);
  test_lambda(ctx);
  test_failures();
  test_bad_input(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left behind");
  batten_context_free(ctx);
  return t_done();
}
