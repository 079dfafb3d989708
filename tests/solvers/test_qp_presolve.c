/* From the caller's rows to the engines' constraints and back: what is merged, dropped, refused; multipliers by hand;
 * the same constraints however rows are scaled, turned and permuted. */
#include "qp/certify.h"
#include "qp/presolve.h"
#include "tap.h"

static double uniform(uint64_t *seed) { return 2 * t_uniform(seed) - 1; }

/* 3 unknowns; every kind of row once. */
static void test_by_hand(batten_context *ctx) {
  static const double c[] = {3,  4,  0,  /* 0: length 5 */
                             0,  0,  0,  /* 1: zeros that hold */
                             -6, -8, 0,  /* 2: antiparallel to 0, tighter above: -6x - 8y >= -20 is 3x + 4y <= 10 */
                             0,  -2, 0,  /* 3: a bound: -2y <= 2 is y >= -1 */
                             1,  1,  1,  /* 4: no sides */
                             1,  0,  2,  /* 5: implied by the bounds above */
                             0,  4,  0}; /* 6: a bound that is not the tightest */
  static const double lower[] = {-5, -1, -20, -INFINITY, -INFINITY, -INFINITY, -8};
  static const double upper[] = {INFINITY, 1, INFINITY, 2, INFINITY, 7.5, 4};
  static const double x_lower[] = {-INFINITY, -3, 1}, x_upper[] = {5, 7, 1};
  batten_matrix rows = batten_matrix_dense(7, 3, c);
  batten_qp_problem p = (batten_qp_problem){.struct_size = sizeof p, .n = 3};
  p.c = &rows, p.lower = lower, p.upper = upper, p.x_lower = x_lower, p.x_upper = x_upper;
  qp_presolve s;
  double certificate[10];
  T_OK(qp_presolve_new(ctx, &p, 0, &s, certificate), ctx);
  const qp_rows *r = &s.rows;
  T_CHECK(r->m == 4 && r->row[0] == 0 && r->row[1] == 7 && r->row[2] == 8 && r->row[3] == 9, "%zu constraints", r->m);
  T_CHECK(fabs(r->scale[0] - 0.2) < 1e-16 && r->lower[0] == -1 && fabs(r->upper[0] - 2) < 1e-15,
          "merged row of length 1: [%g, %g]", r->lower[0], r->upper[0]);
  T_CHECK(r->lower[2] == -1 && r->upper[2] == 1, "bounds of y: [%g, %g]", r->lower[2], r->upper[2]);
  T_CHECK(qp_rows_is_equality(r, 3) && !qp_rows_is_equality(r, 1), "a fixed unknown is an equality");

  /* gradient = sum y_k a_k must be C'y + y_bounds of the caller, at sides that exist */
  static const double core[4][4] = {{10, -1, 2, 5}, {-10, -1, -2, -5}, {0, 1, 0, 0}, {0, 0, 0, 0}};
  static const signed char held[4][4] = {{-1, 1, -1, 2}, {1, 1, 1, 2}, {0, 0, 0, 0}, {1, 0, -1, 0}};
  static const double back[2][10] = {{2, 0, 0, -1, 0, 0, 0, -1, 0, 5}, {0, 0, 1, 0, 0, 0, -0.5, -1, 0, -5}};
  for (size_t q = 0; q < 4; q++) {
    double y[10];
    signed char active[10], again[4];
    qp_presolve_back(&s, core[q], held[q], y, active);
    double worst = 0;
    for (size_t i = 0; q < 2 && i < 10; i++) worst = fmax(worst, fabs(y[i] - back[q][i]));
    T_RATIO(worst, 1e-15, "multipliers by hand");
    for (size_t j = 0; j < 3; j++) {
      double of_core = 0, of_caller = y[7 + j];
      static const double bound[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
      of_core = core[q][0] * 0.2 * c[j];
      for (size_t k = 0; k < 3; k++) of_core += core[q][1 + k] * bound[k][j];
      for (size_t i = 0; i < 7; i++) of_caller += y[i] * c[3 * i + j];
      if (q != 2)
        worst = fmax(worst, fabs(of_core - of_caller)); /* 2: x has no lower bound, its multiplier is dropped */
    }
    T_RATIO(worst, 1e-15, "the same gradient");
    qp_presolve_forward(&s, active, again);
    T_CHECK(!memcmp(again, held[q], 4), "working set there and back: %d %d %d %d", again[0], again[1], again[2],
            again[3]);
  }
  signed char active[10];
  qp_presolve_back(&s, core[1], held[1], NULL, active);
  T_CHECK(active[2] == -1 && active[6] == 1 && active[7] == 1 && active[9] == 2 && active[0] == 0,
          "the caller's working set: row 2 turned round is at its lower side");
  qp_presolve_free(ctx, &s);
}

/* Problems without a solution: status, text, and a proof that the judge accepts. */
static void refuse(batten_context *ctx, const char *text, size_t m, size_t n, const double *c, const double *lower,
                   const double *upper, const double *x_lower, const double *x_upper) {
  batten_matrix rows = batten_matrix_dense(m, n, c);
  batten_qp_problem p = (batten_qp_problem){.struct_size = sizeof p, .n = n};
  p.c = &rows, p.lower = lower, p.upper = upper, p.x_lower = x_lower, p.x_upper = x_upper;
  qp_presolve s;
  double y[16], work[16], sum = 0;
  T_STATUS(qp_presolve_new(ctx, &p, 0, &s, y), BATTEN_E_INFEASIBLE, ctx, text);
  qp_presolve_free(ctx, &s);
  T_CHECK(qp_certify_infeasible(&p, y, work), "the judge accepts the proof");
  for (size_t i = 0; i < m + n; i++) {
    const double *low = i < m ? lower : x_lower, *high = i < m ? upper : x_upper;
    if (y[i] != 0) sum += y[i] * (y[i] > 0 ? low : high)[i < m ? i : i - m];
  }
  T_RATIO(fabs(sum - 1), 1e-12, "sum of sides");
}

static void test_infeasible(batten_context *ctx) {
  const double inf = INFINITY;
  refuse(ctx, "row 1 of c: zeros, but sides [0.5", 2, 2, (double[]){1, 1, 0, 0}, (double[]){0, 0.5},
         (double[]){inf, inf}, NULL, NULL);
  refuse(ctx, "row 0 of c: zeros, but sides [-inf, -1]", 1, 2, (double[]){0, 0}, (double[]){-inf}, (double[]){-1},
         NULL, NULL);
  refuse(ctx, "row 0 of c and row 1 of c: the sides cross", 2, 2, (double[]){1, 2, -2, -4}, (double[]){1, -1},
         (double[]){inf, inf}, NULL, NULL);
  refuse(ctx, "the bounds of x[1] and row 0 of c", 1, 2, (double[]){0, 3}, (double[]){-inf}, (double[]){5},
         (double[]){-inf, 2}, (double[]){inf, inf});
  refuse(ctx, "row 1 of c and row 0 of c", 2, 1, (double[]){-1, 1e150}, (double[]){1, 1e151}, (double[]){inf, inf},
         NULL, NULL);
  /* the bound of x[0] is row 1, which has its part in the proof */
  refuse(ctx, "row 0 of c: within the bounds of x it is in [-inf, 3]", 2, 2, (double[]){1, 1, 2, 0},
         (double[]){4, -inf}, (double[]){inf, 2}, (double[]){-inf, -inf}, (double[]){inf, 2});
  refuse(ctx, "row 0 of c: within the bounds of x it is in [3, inf]", 3, 2, (double[]){-1, 1, -2, 0, 0, -3},
         (double[]){-inf, 2, -inf}, (double[]){2.5, inf, -6}, NULL, NULL);
  refuse(ctx, "row 0 of c: within the bounds of x it is in [-3, 3]", 1, 2, (double[]){1, -2}, (double[]){4},
         (double[]){inf}, (double[]){-1, -1}, (double[]){1, 1});
  refuse(ctx, "row 0 of c: within the bounds of x it is in [-3, 3]", 1, 2, (double[]){1, -2}, (double[]){-inf},
         (double[]){-4}, (double[]){-1, -1}, (double[]){1, 1});
}

/* Sides that cross by rounding hold together. */
static void test_rounding(batten_context *ctx) {
  static const double c[] = {1, 1, 3, 3, 3, 0};
  double third = 1.0 / 3, lower[] = {0.1, -INFINITY, 3 * third}, upper[] = {INFINITY, 0.3, 3 * third};
  lower[0] = nextafter(0.1, 1);
  double x_lower[] = {-INFINITY, -1}, x_upper[] = {third, 1};
  x_upper[0] = nextafter(third, 0);
  batten_matrix rows = batten_matrix_dense(3, 2, c);
  batten_qp_problem p = (batten_qp_problem){.struct_size = sizeof p, .n = 2};
  p.c = &rows, p.lower = lower, p.upper = upper, p.x_lower = x_lower, p.x_upper = x_upper;
  qp_presolve s;
  T_OK(qp_presolve_new(ctx, &p, 0, &s, NULL), ctx);
  T_CHECK(s.rows.m == 3 && qp_rows_is_equality(&s.rows, 0) && qp_rows_is_equality(&s.rows, 1),
          "sides are made equal");
  double y[3] = {1, -1, 0}, back[5];
  signed char active[3] = {2, 2, 0}, caller[5], again[3];
  qp_presolve_back(&s, y, active, back, caller);
  T_CHECK(back[0] > 0 && back[1] == 0 && caller[0] == -1 && caller[1] == 0, "multiplier at the lower side");
  qp_presolve_forward(&s, caller, again);
  T_CHECK(!memcmp(active, again, 3), "working set there and back");
  qp_presolve_free(ctx, &s);
}

/* Rows scaled by powers from 1e-150 to 1e150, turned round and repeated among m: as many constraints as there were
 * rows to start from, with the same unit sides. */
static void test_many(batten_context *ctx, size_t m, size_t originals, size_t n, bool sparse, uint64_t seed) {
  double *base = malloc(originals * n * sizeof *base), *c = malloc(m * n * sizeof *c),
         *lower = malloc(m * sizeof *lower);
  double *upper = malloc(m * sizeof *upper), *tightest = malloc(originals * 2 * sizeof *tightest);
  size_t *starts = malloc((m + 1) * sizeof *starts), *of = malloc(m * sizeof *of), entries = 0;
  uint32_t *indices = malloc(m * n * sizeof *indices);
  for (size_t q = 0; q < originals * n; q++) base[q] = sparse && q % n > 4 ? 0 : uniform(&seed);
  for (size_t q = 0; q < originals; q++) tightest[2 * q] = -INFINITY, tightest[2 * q + 1] = INFINITY;
  starts[0] = 0;
  for (size_t i = 0; i < m; i++) {
    size_t q = of[i] = i < originals ? i : (size_t)(t_uniform(&seed) * (double)originals);
    double factor = pow(10, 300 * t_uniform(&seed) - 150) * (t_random(&seed) % 2 ? 1 : -1), length = 0;
    double low = -1 - t_uniform(&seed), high = 1 + t_uniform(&seed);
    for (size_t j = 0; j < n; j++) length = hypot(length, base[q * n + j]);
    tightest[2 * q] = fmax(tightest[2 * q], low), tightest[2 * q + 1] = fmin(tightest[2 * q + 1], high);
    lower[i] = (factor > 0 ? low : -high) * length * fabs(factor);
    upper[i] = (factor > 0 ? high : -low) * length * fabs(factor);
    for (size_t e = 0; e < n; e++) {
      size_t j = (e + i) % n; /* entries of a row in any order */
      c[i * n + j] = factor * base[q * n + j];
      if (!sparse || base[q * n + j] == 0) continue;
      indices[entries++] = (uint32_t)j;
    }
    starts[i + 1] = entries;
  }
  double *values = malloc((entries + 1) * sizeof *values);
  for (size_t i = 0; i < m; i++)
    for (size_t e = starts[i]; e < starts[i + 1]; e++) values[e] = c[i * n + indices[e]];
  batten_matrix rows = sparse ? batten_matrix_sparse(m, n, starts, indices, values) : batten_matrix_dense(m, n, c);
  batten_qp_problem p = (batten_qp_problem){.struct_size = sizeof p, .n = n};
  p.c = &rows, p.lower = lower, p.upper = upper;
  qp_presolve s;
  double before = batten_now();
  batten_status st = qp_presolve_new(ctx, &p, 0, &s, NULL);
  double time = batten_now() - before, worst = 0, length = 0, *x = malloc(n * sizeof *x);
  T_CHECK(st == BATTEN_OK && s.rows.m == originals, "%zu %s rows of %zu: %zu constraints, %.2g ms", m,
          sparse ? "sparse" : "dense", originals, s.rows.m, 1e3 * time);
  for (size_t k = 0; st == BATTEN_OK && k < s.rows.m; k++) {
    size_t q = of[s.row[k]];
    double low = tightest[2 * q], high = tightest[2 * q + 1];
    bool turned = (c[s.row[k] * n] > 0) != (base[q * n] > 0);
    worst = fmax(worst, fmax(fabs(s.lower[k] - (turned ? -high : low)), fabs(s.upper[k] - (turned ? -low : high))));
    memset(x, 0, n * sizeof *x);
    qp_rows_add(&s.rows, k, 1, x);
    double norm = 0;
    for (size_t j = 0; j < n; j++) norm = hypot(norm, x[j]);
    length = fmax(length, fabs(norm - 1));
  }
  T_RATIO(worst, 1e-14, "their sides");
  T_RATIO(length, 1e-14, "their lengths less 1");
  qp_presolve_free(ctx, &s);
  free(x), free(values), free(indices), free(of), free(starts), free(tightest), free(upper), free(lower), free(c),
      free(base);
}

/* Subnormal and nearly overflowing rows. */
static void test_range(batten_context *ctx) {
  static const double c[] = {1e-310, 1e-310, 1.7e308, 1.7e308, 1e-200, -1e-200, 0x1p-1074, 0};
  static const double lower[] = {1e-310, -1.7e308, -1, 0}, upper[] = {INFINITY, INFINITY, 1e-200, INFINITY};
  batten_matrix rows = batten_matrix_dense(4, 2, c);
  batten_qp_problem p = (batten_qp_problem){.struct_size = sizeof p, .n = 2};
  p.c = &rows, p.lower = lower, p.upper = upper;
  qp_presolve s;
  T_OK(qp_presolve_new(ctx, &p, 0, &s, NULL), ctx);
  bool finite = true;
  for (size_t k = 0; k < s.rows.m; k++) finite = finite && s.scale[k] > 0 && isfinite(s.scale[k]);
  T_CHECK(finite && s.rows.m >= 3, "%zu constraints, scales in range", s.rows.m);
  T_CHECK(s.lower_from[0] == 0 || s.rows.m == 4, "the tiny row is kept");
  qp_presolve_free(ctx, &s);

  batten_qp_problem none = {.struct_size = sizeof none};
  T_OK(qp_presolve_new(ctx, &none, 0, &s, NULL), ctx);
  T_CHECK(s.rows.m == 0, "nothing gives nothing");
  qp_presolve_free(ctx, &s);
}

static batten_status with_memory(batten_context *ctx, void *arg) {
  qp_presolve s;
  batten_status st = qp_presolve_new(ctx, arg, 0, &s, NULL);
  qp_presolve_free(ctx, &s);
  return st;
}

static void test_memory(void) {
  static const double c[] = {1, 2, 2, 4}, lower[] = {0, 1};
  batten_matrix rows = batten_matrix_dense(2, 2, c);
  batten_qp_problem p = (batten_qp_problem){.struct_size = sizeof p, .n = 2};
  p.c = &rows, p.lower = lower;
  t_fail_every_allocation("presolve", with_memory, &p);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_by_hand(ctx);
  test_infeasible(ctx);
  test_rounding(ctx);
  test_many(ctx, 5000, 700, 6, false, 1);
  test_many(ctx, 5000, 40, 30, true, 2);
  test_many(ctx, 27000, 27000, 48, false, 3);
  test_range(ctx);
  test_memory();
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all memory is given back");
  batten_context_free(ctx);
  return t_done();
}
