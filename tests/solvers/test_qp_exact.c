/* Exact feasibility: rows hold in exact arithmetic and in any order of summation, at the least possible blend. */
#include "qp/exact.h"
#include "qp_check.h"
#include "tap.h"

/* The engines' view of a problem without presolve: all rows, then all bounds that are there. */
typedef struct view {
  qp_rows rows;
  size_t *row;
  uint32_t *identity;
  double *scale, *lower, *upper;
} view;

static view view_new(const batten_qp_problem *p) {
  size_t n = p->n, m = p->c ? p->c->rows : 0, count = 0;
  view v = {.row = malloc((m + n) * sizeof *v.row),
            .identity = malloc(n * sizeof *v.identity),
            .scale = malloc((m + n) * sizeof *v.scale),
            .lower = malloc((m + n) * sizeof *v.lower),
            .upper = malloc((m + n) * sizeof *v.upper)};
  for (size_t j = 0; j < n; j++) v.identity[j] = (uint32_t)j;
  for (size_t i = 0; i < m + n; i++) {
    double low = i < m ? qp_check_side(p->lower, i, -INFINITY) : qp_check_side(p->x_lower, i - m, -INFINITY);
    double high = i < m ? qp_check_side(p->upper, i, INFINITY) : qp_check_side(p->x_upper, i - m, INFINITY),
           square = 0;
    if (isinf(low) && isinf(high)) continue;
    for (size_t j = 0; i < m && p->c->dense && j < n; j++) square += pow(p->c->dense[i * n + j], 2);
    for (size_t e = 0; i < m && !p->c->dense && e < p->c->starts[i + 1] - p->c->starts[i]; e++)
      square += pow(p->c->values[p->c->starts[i] + e], 2);
    v.row[count] = i;
    v.scale[count] = i < m ? 1 / sqrt(square) : 1;
    v.lower[count] = low * v.scale[count], v.upper[count] = high * v.scale[count];
    count++;
  }
  v.rows = (qp_rows){n, count, p->c, v.row, v.identity, v.scale, v.lower, v.upper};
  return v;
}
static void view_free(view *v) { free(v->row), free(v->identity), free(v->scale), free(v->lower), free(v->upper); }

static uint64_t seed_noise = 9;
static const qp_limits no_limits = {.iterations = SIZE_MAX, .deadline = INFINITY, .tolerance = 1e-12};

static batten_status exact(batten_context *ctx, const batten_qp_problem *p, const double *interior, const double *x0,
                           double *x, double *blend) {
  view v = view_new(p);
  batten_status st = qp_exact(ctx, p, &v.rows, &no_limits, interior, x0, x, blend);
  view_free(&v);
  return st;
}

/* How many rows and bounds fail: exactly (long double, far below the slack that is asked for), or in double, the
 * products of a row added up forwards, backwards, in random orders, by size up and down, and fused. */
static size_t failing(const batten_qp_problem *p, const double *x) {
  size_t bad = 0, n = p->n, m = p->c ? p->c->rows : 0;
  double *a = malloc(n * sizeof *a), *b = malloc(n * sizeof *b);
  uint64_t seed = 5;
  for (size_t i = 0; i < m; i++) {
    double low = qp_check_side(p->lower, i, -INFINITY), high = qp_check_side(p->upper, i, INFINITY);
    size_t count = 0;
    if (low == high) continue;
    for (size_t j = 0; p->c->dense && j < n; j++) a[count] = p->c->dense[i * n + j], b[count++] = x[j];
    for (size_t e = p->c->dense ? 0 : p->c->starts[i]; !p->c->dense && e < p->c->starts[i + 1]; e++)
      a[count] = p->c->values[e], b[count++] = x[p->c->indices[e]];
    long double value = qp_scene_dot(p->c, i, x);
    bool ok = value >= low && value <= high;
    for (int order = 0; order < 12; order++) {
      double sum = 0, fused = 0;
      for (size_t k = count; k > 1 && order > 1; k--) {
        size_t other = qp_scene_pick(&seed, k);
        double s = a[k - 1], t = b[k - 1];
        a[k - 1] = a[other], b[k - 1] = b[other], a[other] = s, b[other] = t;
      }
      for (size_t k = 0; k < count; k++) {
        size_t at = order == 0 ? k : count - 1 - k;
        sum += a[at] * b[at];
        fused = fma(a[at], b[at], fused);
      }
      double positive = 0, negative = 0; /* the order that cancels most */
      for (size_t k = 0; k < count; k++) *(a[k] * b[k] > 0 ? &positive : &negative) += a[k] * b[k];
      ok = ok && sum >= low && sum <= high && fused >= low && fused <= high && positive + negative >= low &&
           positive + negative <= high;
    }
    bad += !ok;
  }
  for (size_t j = 0; j < n; j++)
    bad += x[j] < qp_check_side(p->x_lower, j, -INFINITY) || x[j] > qp_check_side(p->x_upper, j, INFINITY);
  free(a), free(b);
  return bad;
}

static double far(size_t n, const double *x, const double *y) {
  double worst = 0;
  for (size_t j = 0; j < n; j++) worst = fmax(worst, fabs(x[j] - y[j]));
  return worst;
}

/* x_1 + x_2 + x_3 >= 1 at (0.1, 0.2, 0.7), which sums to 1 or less than 1 as it is added; inside (1, 1, 1), slack 2.
 */
static void test_by_hand(batten_context *ctx) {
  double row[3] = {1, 1, 1}, lower = 1, inside[3] = {1, 1, 1}, x[3] = {0.1, 0.2, 0.7}, before[3] = {0.1, 0.2, 0.7};
  double blend = -1, found[3] = {0.1, 0.2, 0.7};
  batten_matrix c = batten_matrix_dense(1, 3, row);
  batten_qp_problem p = batten_qp_problem_default(3);
  p.c = &c, p.lower = &lower;
  T_CHECK(failing(&p, x) == 1, "0.1 + 0.2 + 0.7 >= 1 depends on the order");
  T_OK(exact(ctx, &p, inside, NULL, x, &blend), ctx);
  /* Two additions round, products do not: 2 u and what the bound and the blended point add, 5 u in all, over a slack
   * of 2. */
  T_CHECK(failing(&p, x) == 0 && blend > 0x1p-53 && blend < 4 * 0x1p-53, "cured by a blend of %.3g", blend);
  T_RATIO(far(3, x, before), 5e-16, "moved");
  T_OK(exact(ctx, &p, inside, NULL, x, &blend), ctx);
  T_CHECK(blend == 0, "and again: %g", blend);
  T_OK(exact(ctx, &p, NULL, NULL, found, &blend), ctx);
  T_CHECK(failing(&p, found) == 0, "without an inside point, one is found: blend %.3g", blend);
  T_RATIO(far(3, found, before), 5e-16, "moved");
  double start[3] = {1, 1, 1}, near[3] = {0.1, 0.2, 0.7 + 1e-15}, other[3] = {0.1, 0.2, 0.7};
  memcpy(found, before, sizeof found);
  T_OK(exact(ctx, &p, NULL, start, found, &blend), ctx);
  T_CHECK(failing(&p, found) == 0 && blend < 4 * 0x1p-53, "a start inside serves: blend %.3g", blend);
  T_OK(exact(ctx, &p, NULL, near, other, &blend), ctx);
  T_CHECK(failing(&p, other) == 0 && blend < 1e-6, "a start that all but touches the row does not: blend %.3g",
          blend);
}

/* Random vertices and shape problems: the point is put on its rows, with noise of either sign. */
static void test_scenes(batten_context *ctx) {
  size_t bad = 0, before = 0, runs = 0, failed = 0;
  double most = 0, moved = 0;
  for (uint64_t seed = 0; seed < 60; seed++) {
    qp_scene_spec spec = {.seed = seed,
                          .n = 6 + seed % 20,
                          .m = 40,
                          .condition = 1,
                          .active = 1 + seed % 3,
                          .two_sided = seed % 2 == 0,
                          .bounds = seed % 3 == 0,
                          .bounded = seed % 2,
                          .sparse = seed % 5 == 0,
                          .equalities = seed % 7 == 0};
    qp_scene *s = qp_scene_random(&spec);
    double x[32], blend = 0;
    for (size_t j = 0; j < spec.n; j++) x[j] = s->x[j] * (1 + 1e-15 * (scene_uniform(&seed_noise) - 0.5));
    before += failing(&s->problem, x) > 0;
    batten_status st = exact(ctx, &s->problem, NULL, NULL, x, &blend);
    failed += st != BATTEN_OK;
    if (st != BATTEN_OK || blend > 1e-6) printf("# seed %d: blend %.3g %s\n", (int)seed, blend, batten_error(ctx));
    bad += failing(&s->problem, x) > 0;
    most = fmax(most, blend);
    moved = fmax(moved, far(spec.n, x, s->x));
    runs++;
    qp_scene_free(s);
  }
  T_CHECK(before > runs / 2 && failed == 0 && bad == 0,
          "%zu of %zu random points fail before, %zu after, %zu not cured", before, runs, bad, failed);
  T_CHECK(most > 0 && most < 1e-6 && moved < 1e-11, "largest blend %.3g, moved at most %.3g", most, moved);
}

/* The patch's start scaled down onto 0, and its rows moved so that many hold there with equality. */
static void test_patch(batten_context *ctx) {
  for (size_t size = 0; size < 2; size++) {
    qp_scene *s = qp_scene_patch(size, false, 1);
    size_t m = s->c.rows;
    double x[48], blend = 0, *lower = qp_scene_array(s, m, sizeof *lower), far_inside[48];
    for (size_t i = 0; i < m; i++) lower[i] = (double)qp_scene_dot(&s->c, i, s->start) * (i % 7 ? 0.5 : 1);
    s->problem.lower = lower;
    memcpy(x, s->start, sizeof x);
    for (size_t j = 0; j < 48; j++) far_inside[j] = 1.5 * s->start[j];
    size_t before = failing(&s->problem, x);
    T_OK(exact(ctx, &s->problem, far_inside, NULL, x, &blend), ctx);
    T_CHECK(before > 0 && failing(&s->problem, x) == 0, "patch of %zu rows: %zu fail before, none after, blend %.3g",
            m, before, blend);
    memcpy(x, s->start, sizeof x);
    T_OK(exact(ctx, &s->problem, NULL, NULL, x, &blend), ctx);
    T_CHECK(failing(&s->problem, x) == 0 && far(48, x, s->start) < 1e-10,
            "and by a point found: blend %.3g, moved %.3g", blend, far(48, x, s->start));
    qp_scene_free(s);
  }
}

/* Powers of two change nothing but the scale. */
static void test_invariance(batten_context *ctx) {
  qp_scene_spec spec = {.seed = 3, .n = 6, .m = 20, .condition = 1, .active = 4};
  qp_scene *s = qp_scene_random(&spec);
  double inside[6], x[6], scaled[6], scaled_inside[6], lower[20], upper[20], blend, again;
  for (size_t j = 0; j < 6; j++) x[j] = s->x[j];
  T_OK(exact(ctx, &s->problem, NULL, NULL, x, &blend), ctx);
  for (size_t j = 0; j < 6; j++) inside[j] = s->x[j] + 1e9 * (x[j] - s->x[j]), x[j] = s->x[j];
  if (exact(ctx, &s->problem, inside, NULL, x, &blend) != BATTEN_OK) T_CHECK(false, "%s", batten_error(ctx));
  for (size_t i = 0; i < 20; i++) lower[i] = 0x1p300 * s->problem.lower[i], upper[i] = 0x1p300 * s->problem.upper[i];
  s->problem.lower = lower, s->problem.upper = upper;
  for (size_t j = 0; j < 6; j++) scaled[j] = 0x1p300 * s->x[j], scaled_inside[j] = 0x1p300 * inside[j];
  T_OK(exact(ctx, &s->problem, scaled_inside, NULL, scaled, &again), ctx);
  for (size_t j = 0; j < 6; j++) scaled[j] *= 0x1p-300;
  T_CHECK(memcmp(x, scaled, sizeof x) == 0 && blend == again && blend > 0, "the same bits times 2^300, blend %.3g",
          blend);
  qp_scene_free(s);
}

static void test_edges(batten_context *ctx) {
  double rows[4] = {3, 3, -3, -3}, lower[2] = {0, 0}, x[2] = {0.1, -0.1}, blend = 7;
  batten_matrix c = batten_matrix_dense(2, 2, rows);
  batten_qp_problem p = batten_qp_problem_default(2);
  /* An equality in disguise has no inside; x is left alone. */
  p.c = &c, p.lower = lower;
  T_STATUS(exact(ctx, &p, NULL, NULL, x, &blend), BATTEN_W_ACCURACY, ctx,
           "options.exact: no strictly feasible point");
  T_CHECK(x[0] == 0.1 && x[1] == -0.1 && blend == 7, "nothing touched");
  double zero[2] = {0, 0}, outside[2] = {1, 1};
  T_OK(exact(ctx, &p, NULL, NULL, zero, &blend), ctx);
  T_CHECK(blend == 0, "zero satisfies it exactly all the same");
  T_STATUS(exact(ctx, &p, outside, NULL, x, &blend), BATTEN_W_ACCURACY, ctx, "options.interior: row 1 is -6");
  /* Where a single addition rounds, and monotonely, zero slack will do. */
  double twin[2] = {0.1, -0.1};
  rows[0] = rows[1] = 0.5, rows[2] = rows[3] = -2;
  T_OK(exact(ctx, &p, NULL, NULL, twin, &blend), ctx);
  T_CHECK(blend == 0, "0.5 x + 0.5 y >= 0 >= 2 x + 2 y at (0.1, -0.1): nothing to do");
  rows[0] = rows[1] = 1;
  /* An inside 1e-7 wide. */
  rows[2] = rows[3] = 1, lower[0] = 1;
  double upper[2] = {INFINITY, 1 + 1e-7}, narrow[2] = {1. / 3, 2. / 3};
  lower[1] = -INFINITY;
  p.upper = upper;
  T_OK(exact(ctx, &p, NULL, NULL, narrow, &blend), ctx);
  T_CHECK(failing(&p, narrow) == 0, "inside of 1e-7: blend %.3g", blend);
  /* Bounds: clipped, an interior beyond them is refused; single entries hold with equality. */
  double low[2] = {0, 0}, below[2] = {-1e-17, 1}, single[4] = {3, 0, 0, 1}, third[2] = {1, 1};
  batten_matrix d = batten_matrix_dense(2, 2, single);
  p = batten_qp_problem_default(2);
  p.x_lower = low;
  T_OK(exact(ctx, &p, NULL, NULL, below, &blend), ctx);
  T_CHECK(below[0] == 0 && blend == 0, "bounds are met by clipping");
  p.c = &d, p.lower = third;
  double at[2] = {0x1.5555555555556p-2, 1}, less[2] = {0x1.5555555555555p-2, 1}, beyond[2] = {-1, 3};
  T_OK(exact(ctx, &p, NULL, NULL, at, &blend), ctx);
  T_CHECK(blend == 0, "3 x >= 1 at the double above 1/3");
  T_OK(exact(ctx, &p, NULL, NULL, less, &blend), ctx);
  T_CHECK(blend > 0 && less[0] > 0x1.5555555555555p-2, "but not at the one below: blend %.3g", blend);
  less[0] = 0x1.5555555555555p-2;
  T_STATUS(exact(ctx, &p, beyond, NULL, less, &blend), BATTEN_W_ACCURACY, ctx,
           "options.interior[0]: -1 is beyond the bound 0");
  /* Equalities are left as they are, and an inside that misses them is none. */
  double both[4] = {1, 1, 1, -1}, low2[2] = {1, 0.4}, high2[2] = {1, INFINITY}, on[2] = {0.7, 0.3},
         in[2] = {0.8, 0.2}, off[2] = {1, 1};
  d = batten_matrix_dense(2, 2, both);
  p = batten_qp_problem_default(2);
  p.c = &d, p.lower = low2, p.upper = high2;
  T_STATUS(exact(ctx, &p, off, NULL, on, &blend), BATTEN_W_ACCURACY, ctx, "options.interior: row");
  T_OK(exact(ctx, &p, in, NULL, on, &blend), ctx);
  T_CHECK(failing(&p, on) == 0 && fabs(on[0] + on[1] - 1) < 4e-16, "beside an equality: off by %.2g",
          on[0] + on[1] - 1);
  /* Terms that underflow are no proof. */
  double tiny[4] = {0x1p-600, 0x1p-600, 0, 0}, small[2] = {0x1p-600, -0x1p-600}, inside[2] = {1, 1};
  d = batten_matrix_dense(1, 2, tiny);
  lower[0] = 0;
  p = batten_qp_problem_default(2);
  p.c = &d, p.lower = lower;
  T_OK(exact(ctx, &p, inside, NULL, small, &blend), ctx);
  T_CHECK(blend > 0, "products below the smallest double are taken as rounding: blend %.3g", blend);
}

/* The public way: solutions of shape problems lie on their rows, and hold exactly all the same. */
static void test_solve(batten_context *ctx) {
  for (int kind = 0; kind < 6; kind++) {
    qp_scene *s = kind < 2   ? qp_scene_patch((size_t)kind, false, 3)
                  : kind < 4 ? qp_scene_curve(kind == 2 ? 40 : 300, 0.1, 3)
                             : qp_scene_convex(kind == 4 ? 100 : 200, 2, 0.1, 3);
    size_t n = s->problem.n, plain_fails;
    double *x = qp_scene_array(s, n, sizeof *x), *plain = qp_scene_array(s, n, sizeof *plain);
    batten_qp_options o = batten_qp_options_default();
    batten_qp_info info = {0}, before = {0};
    batten_qp_solution solution = {.x = plain};
    T_OK(batten_qp_solve(ctx, &s->problem, &o, NULL, &solution, &before), ctx);
    plain_fails = failing(&s->problem, plain);
    o.exact = 1;
    o.interior = kind % 2 ? s->start : NULL;
    solution.x = x;
    T_OK(batten_qp_solve(ctx, &s->problem, &o, NULL, &solution, &info), ctx);
    T_CHECK(plain_fails > 0 && failing(&s->problem, x) == 0 && info.primal_residual == 0,
            "%zu x %zu: %zu rows fail without, none with exact; blend %.3g, objective %.3g higher", n, s->c.rows,
            plain_fails, info.blend, (info.objective - before.objective) / fabs(before.objective));
    double size = 0;
    for (size_t j = 0; j < n; j++) size = fmax(size, fabs(plain[j]));
    T_RATIO(far(n, x, plain) / size, 1e-10, "moved");
    qp_scene_free(s);
  }
}

static batten_status call_exact(batten_context *ctx, void *arg) {
  double x[3] = {0.1, 0.2, 0.7}, blend;
  return exact(ctx, arg, NULL, NULL, x, &blend);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_by_hand(ctx);
  test_scenes(ctx);
  test_patch(ctx);
  test_invariance(ctx);
  test_edges(ctx);
  test_solve(ctx);
  double row[3] = {1, 1, 1}, lower = 1;
  batten_matrix c = batten_matrix_dense(1, 3, row);
  batten_qp_problem p = batten_qp_problem_default(3);
  p.c = &c, p.lower = &lower;
  t_fail_every_allocation("exact", call_exact, &p);
  batten_context_free(ctx);
  return t_done();
}
