/* The iterative method: bad input, memory predicted and refused, failing allocations, callbacks that fail, cancel. */
#include "saddle_sums.h"

static batten_status factor(batten_context *ctx, const batten_saddle_matrix *m, const batten_saddle_options *o) {
  batten_saddle *h = NULL;
  batten_status st = batten_saddle_factor(ctx, m, o, &h);
  if ((st >= 0) != (h != NULL)) t_line(false, "a handle comes with success, and only then");
  batten_saddle_free(h);
  return st;
}

static void test_arguments(batten_context *ctx) {
  scene s = scene_new(SCENE_RANDOM, KERNEL_R, 40, 4, 1);
  direct d = {0};
  const batten_saddle_sums good = direct_sums(&s, &d);
  batten_saddle_sums sums = good;
  batten_saddle_matrix m = scene_matrix(&s);
  batten_saddle_options o = iterative_options(1e-6);
  T_STATUS(factor(ctx, &m, &o), BATTEN_E_INVALID, ctx, "matrix.sums: NULL, but opt.method is iterative");
  m.sums = &sums;
  sums.dimension = 4;
  T_STATUS(factor(ctx, &m, &o), BATTEN_E_INVALID, ctx, "matrix.sums.dimension: 4; give 1 .. 3");
  sums.dimension = 0;
  T_STATUS(factor(ctx, &m, &o), BATTEN_E_INVALID, ctx, "matrix.sums.dimension: 0");
  sums = good, sums.plan = NULL;
  T_STATUS(factor(ctx, &m, &o), BATTEN_E_INVALID, ctx, "matrix.sums.plan: NULL");
  sums = good, sums.apply = NULL;
  T_STATUS(factor(ctx, &m, &o), BATTEN_E_INVALID, ctx, "matrix.sums.apply: NULL");
  sums = good, sums.release = NULL;
  T_STATUS(factor(ctx, &m, &o), BATTEN_E_INVALID, ctx, "matrix.sums.release: NULL");
  sums = good, sums.points = NULL;
  T_STATUS(factor(ctx, &m, &o), BATTEN_E_INVALID, ctx, "matrix.sums.points: NULL");
  sums = good;
  s.x[3 * 7 + 2] = NAN;
  T_STATUS(factor(ctx, &m, &o), BATTEN_E_INVALID, ctx, "matrix.sums.points[7]: coordinate 2 is nan");
  s.x[3 * 7 + 2] = 1e160;
  T_STATUS(factor(ctx, &m, &o), BATTEN_E_INVALID, ctx, "matrix.sums.points[7]: coordinate 2 is 1e+160");
  s.x[3 * 7 + 2] = 0.5;
  s.p[7 + 3 * 40] = 0.5;

  static const double accuracies[] = {0, -1, 1e-14, 0.2, NAN};
  for (int q = 0; q < 5; q++) {
    o.accuracy = accuracies[q];
    T_STATUS(factor(ctx, &m, &o), BATTEN_E_INVALID, ctx, "opt.accuracy: ");
  }
  o = iterative_options(1e-6), o.products_accuracy = -1;
  T_STATUS(factor(ctx, &m, &o), BATTEN_E_INVALID, ctx, "opt.products_accuracy: -1");
  o = iterative_options(1e-6), o.products_accuracy = NAN;
  T_STATUS(factor(ctx, &m, &o), BATTEN_E_INVALID, ctx, "opt.products_accuracy: nan");
  o = iterative_options(1e-6), o.overlap = 5;
  T_STATUS(factor(ctx, &m, &o), BATTEN_E_INVALID, ctx, "opt.overlap: 5; give 0 .. 4");
  o = iterative_options(1e-6), o.overlap = NAN;
  T_STATUS(factor(ctx, &m, &o), BATTEN_E_INVALID, ctx, "opt.overlap: nan");
  o = iterative_options(1e-6), o.krylov = (batten_saddle_krylov)3;
  T_STATUS(factor(ctx, &m, &o), BATTEN_E_INVALID, ctx, "opt.krylov: 3");
  o = iterative_options(1e-6), o.iterations_max = 0;
  T_STATUS(factor(ctx, &m, &o), BATTEN_E_INVALID, ctx, "opt.iterations_max: 0");
  o = iterative_options(1e-6);
  T_OK(factor(ctx, &m, &o), ctx);
  T_CHECK(d.live == 0, "no plan is left over");
  scene_free(&s);
}

/* ---- Memory ---- */

static void test_memory(void) {
  static const size_t sizes[] = {100, 3000, 3300, 9000};
  for (int krylov = BATTEN_SADDLE_FGMRES; krylov <= BATTEN_SADDLE_CG; krylov++)
    for (size_t q = 0; q < sizeof sizes / sizeof *sizes; q++) {
      size_t n = sizes[q], predicted = batten_saddle_bytes(BATTEN_SADDLE_ITERATIVE, n, 4);
      scene s = bumpy_sphere(KERNEL_R, n, 20);
      answer a = answer_new(n);
      direct d = {0};
      batten_saddle_options o = iterative_options(0.05);
      batten_context *ctx = t_context(NULL, NULL, 2);
      o.krylov = (batten_saddle_krylov)krylov;
      solve(ctx, &s, &d, &o, &a);
      T_CHECK(a.status == BATTEN_OK, "N = %zu: %u iterations %s", n, a.info.iterations,
              a.status ? batten_error(ctx) : "");
      T_RATIO((double)batten_bytes_peak(ctx) * 1e-6, (double)predicted * 1e-6, "N = %zu: MB taken and predicted", n);
      T_CHECK(a.info.bytes <= batten_bytes_peak(ctx), "N = %zu: %.3g MB held", n, (double)a.info.bytes * 1e-6);
      batten_context_free(ctx);
      free(a.w);
      scene_free(&s);
    }
  size_t million = batten_saddle_bytes(BATTEN_SADDLE_ITERATIVE, 1000000, 4);
  T_CHECK(million > 1000000000 && million < 4000000000, "a million points: %.2f GB", (double)million * 1e-9);
  T_CHECK(batten_saddle_bytes(BATTEN_SADDLE_ITERATIVE, SIZE_MAX / 2, 4) == SIZE_MAX, "too many points");
  T_CHECK(batten_saddle_bytes(BATTEN_SADDLE_ITERATIVE, 0, 0) < 1000000, "no points");
}

static void test_limit(void) {
  enum { N = 9000 };
  scene s = bumpy_sphere(KERNEL_R, N, 21);
  answer a = answer_new(N);
  direct d = {0};
  batten_saddle_options o = iterative_options(1e-3);
  batten_context_options c = batten_context_options_default();
  size_t took[2];
  for (int q = 0; q < 2; q++) { /* what each iteration takes */
    batten_context *ctx = t_context(NULL, NULL, 1);
    o.krylov = q ? BATTEN_SADDLE_CG : BATTEN_SADDLE_FGMRES;
    solve(ctx, &s, &d, &o, &a);
    took[q] = batten_bytes_peak(ctx);
    batten_context_free(ctx);
  }
  o.krylov = BATTEN_SADDLE_KRYLOV_AUTO;
  c.memory_limit = took[1] + 2500000; /* CG is predicted 1.7 MB higher; FGMRES, with 24 steps, 5 MB */
  batten_context *ctx = NULL;
  batten_context_new(&c, &ctx);
  solve(ctx, &s, &d, &o, &a);
  T_CHECK(a.status == BATTEN_OK && batten_bytes_peak(ctx) <= c.memory_limit,
          "%.3g MB are allowed, FGMRES has taken %.3g, CG %.3g: %u iterations in %.3g %s",
          (double)c.memory_limit * 1e-6, (double)took[0] * 1e-6, (double)took[1] * 1e-6, a.info.iterations,
          (double)batten_bytes_peak(ctx) * 1e-6, a.status ? batten_error(ctx) : "");
  o.overlap = 4;
  solve(ctx, &s, &d, &o, &a);
  T_CHECK(a.status == BATTEN_E_TOO_LARGE && strstr(batten_error(ctx), "9000 rows by iterative take"), "no room: %s",
          batten_error(ctx));
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is held");
  batten_context_free(ctx);
  scene_free(&s);

  /* In a volume domains are larger than foreseen: told when they are known, before their factors are taken. */
  s = scene_new(SCENE_RANDOM, KERNEL_R, N, 4, 21);
  smooth_data(&s);
  o = iterative_options(1e-3);
  c.memory_limit = batten_saddle_bytes(BATTEN_SADDLE_ITERATIVE, N, 4);
  batten_context_new(&c, &ctx);
  solve(ctx, &s, &d, &o, &a);
  T_CHECK(a.status == BATTEN_E_TOO_LARGE && strstr(batten_error(ctx), "whose local solves have up to"),
          "no room for neighbours: %s", batten_error(ctx));
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is held");
  batten_context_free(ctx);
  c.memory_limit *= 2;
  batten_context_new(&c, &ctx);
  solve(ctx, &s, &d, &o, &a);
  T_CHECK(a.status == BATTEN_OK, "twice as much is enough for points of a cube: %.3g MB %s",
          (double)batten_bytes_peak(ctx) * 1e-6, a.status ? batten_error(ctx) : "");
  batten_context_free(ctx);
  free(a.w);
  scene_free(&s);
}

/* ---- Failures ---- */

typedef struct call {
  scene *s;
  batten_saddle_krylov krylov;
  size_t fail_plan, fail_apply; /* which of them fails */
  size_t plans, calls;
} call;

static batten_status run(batten_context *ctx, void *arg) {
  const call *c = arg;
  answer a = answer_new(c->s->n);
  direct d = {0};
  batten_saddle_options o = iterative_options(0.05);
  o.krylov = c->krylov;
  solve(ctx, c->s, &d, &o, &a);
  free(a.w);
  return a.status;
}

static call *failing;

static batten_status fail_plan(const void *user, batten_context *ctx, double accuracy, size_t row_count,
                               const size_t *rows, size_t col_count, const size_t *cols, void **plan) {
  if (++failing->plans == failing->fail_plan)
    return batten_fail(ctx, BATTEN_E_LIMIT, "plan %zu fails", failing->plans);
  return direct_new(user, ctx, accuracy, row_count, rows, col_count, cols, plan);
}

static batten_status fail_apply(void *plan, batten_context *ctx, const double *x, double *y) {
  if (++failing->calls == failing->fail_apply)
    return batten_fail(ctx, BATTEN_E_LIMIT, "call %zu fails", failing->calls);
  return direct_apply(plan, ctx, x, y);
}

/* Each of the caller's functions failing once: its status and text come back, w untouched, and nothing is left. */
static void test_callbacks(batten_context *ctx, scene *s) {
  double *w = calloc(s->n, sizeof *w), c[4] = {7};
  for (int kind = 0; kind < 2; kind++) {
    bool ok = true;
    size_t k = 0;
    batten_status st = BATTEN_E_LIMIT;
    while (ok && st == BATTEN_E_LIMIT) {
      call now = {.fail_plan = kind ? 0 : k + 1, .fail_apply = kind ? k + 1 : 0};
      direct d = {.honest = true};
      batten_saddle_sums sums = direct_sums(s, &d);
      batten_saddle_matrix m = scene_matrix(s);
      batten_saddle_options o = iterative_options(1e-3);
      batten_saddle *h = NULL;
      k++;
      failing = &now;
      sums.plan = fail_plan;
      sums.apply = fail_apply;
      m.sums = &sums;
      o.products_accuracy = 0.03; /* so that it is planned anew */
      w[3] = c[0] = 7;
      st = batten_saddle_factor(ctx, &m, &o, &h);
      if (st == BATTEN_OK) st = batten_saddle_solve(ctx, h, s->f, w, c);
      ok = st >= 0 || (w[3] == 7 && c[0] == 7 && strstr(batten_error(ctx), "fails"));
      if (h && st < 0) ok = ok && batten_saddle_solve(ctx, h, s->f, w, c) == BATTEN_OK; /* it stays usable */
      batten_saddle_free(h);
      ok = ok && d.live == 0 && batten_bytes_in_use(ctx) == 0;
    }
    T_CHECK(ok && st >= 0 && k > 3, "each of %zu calls of %s fails once: %s", k - 1, kind ? "apply" : "plan",
            batten_status_name(st));
  }
  free(w);
}

static batten_status apply_nan(void *plan, batten_context *ctx, const double *x, double *y) {
  batten_status st = direct_apply(plan, ctx, x, y);
  y[0] = NAN;
  return st;
}

static void test_nan(batten_context *ctx, scene *s) {
  double *w = calloc(s->n, sizeof *w), c[4];
  direct d = {0};
  batten_saddle_sums sums = direct_sums(s, &d);
  batten_saddle_matrix m = scene_matrix(s);
  batten_saddle_options o = iterative_options(1e-3);
  batten_saddle *h = NULL;
  sums.apply = apply_nan;
  m.sums = &sums;
  T_OK(batten_saddle_factor(ctx, &m, &o, &h), ctx);
  T_STATUS(batten_saddle_solve(ctx, h, s->f, w, c), BATTEN_E_INVALID, ctx, "products or entries are not finite");
  s->f[9] = INFINITY;
  T_STATUS(batten_saddle_solve(ctx, h, s->f, w, c), BATTEN_E_INVALID, ctx, "f[9]: inf is not finite");
  s->f[9] = 0;
  batten_saddle_free(h);
  free(w);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  scene s = bumpy_sphere(KERNEL_R, 3010, 22);
  call gmres = {.s = &s}, cg = {.s = &s, .krylov = BATTEN_SADDLE_CG};
  test_arguments(ctx);
  test_memory();
  test_limit();
  test_callbacks(ctx, &s);
  test_nan(ctx, &s);
  t_cancel_every_progress("factor and solve", run, &gmres);
  t_cancel_every_progress("factor and solve by conjugate gradients", run, &cg);
  t_fail_every_allocation("factor and solve", run, &gmres);
  scene_free(&s);
  batten_context_free(ctx);
  return t_done();
}
