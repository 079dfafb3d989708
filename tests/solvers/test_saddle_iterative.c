/* The iterative method: numbers of iterations, solutions against dense ones, what poor products are called, starts,
 * threads. With the argument "large", 40,000 unknowns. */
#include "saddle_sums.h"

#include "saddle/schwarz.h"

/* ---- Parts ---- */

static size_t parts_by_halving(size_t n, size_t most) {
  return n <= most ? 1 : parts_by_halving(n / 2, most) + parts_by_halving(n - n / 2, most);
}

static void test_parts(void) {
  size_t wrong = 0;
  for (size_t n = 1; n < 3000; n++) wrong += batten_saddle_parts(n, 8) != parts_by_halving(n, 8);
  for (size_t n = 1; n < 300000; n += 977) wrong += batten_saddle_parts(n, 512) != parts_by_halving(n, 512);
  T_CHECK(wrong == 0, "numbers of parts, as by halving: %zu wrong", wrong);
}

/* B = exp(-|i - j| / 20) + 1 on the diagonal, in panels; x from B x. */
static void test_panels(void) {
  static const size_t sizes[] = {1, 2, 7, 8, 9, 16, 17, 31, 100, 130};
  const saddle_code *code;
  for (unsigned set = 0; (code = batten_saddle_code_at(set)) != NULL; set++)
    for (int precision = 0; precision < 2; precision++) {
      batten_la_real real = precision ? BATTEN_LA_DOUBLE : BATTEN_LA_FLOAT;
      const saddle_panels *panels = batten_saddle_panels(code, real);
      double worst = 0;
      bool found = true;
      for (size_t q = 0; q < sizeof sizes / sizeof *sizes; q++) {
        size_t n = sizes[q], rows = batten_panel_rows(real, n);
        for (size_t bad = 0; bad < 2; bad++) {
          void *b = aligned_alloc(64, batten_panel_count(real, n) * (size_t)real);
          void *x = aligned_alloc(64, rows * (size_t)real);
          memset(b, 0, batten_panel_count(real, n) * (size_t)real);
          for (size_t i = 0; i < rows; i++) {
            double sum = 0;
            for (size_t j = 0; j < rows; j++) {
              double v = exp(-fabs((double)i - (double)j) / 20) + (i == j);
              if (bad && i == n / 2 && j == i) v = 0.1; /* no longer definite there */
              if (i >= n || j >= n) v = i == j;
              sum += v * sin((double)j) * (j < n);
              if (j > i) continue;
              if (precision)
                ((double *)b)[batten_panel_at(real, i, j)] = v;
              else
                ((float *)b)[batten_panel_at(real, i, j)] = (float)v;
            }
            if (precision)
              ((double *)x)[i] = sum;
            else
              ((float *)x)[i] = (float)sum;
          }
          size_t failed = panels->factor(n, b, 1e-6);
          if (bad) {
            found = found && failed == (n / 2 > 0 ? n / 2 + 1 : 0);
          } else {
            found = found && failed == 0;
            panels->solve(n, b, x);
            for (size_t i = 0; i < n; i++)
              worst = fmax(worst, fabs((precision ? ((double *)x)[i] : (double)((float *)x)[i]) - sin((double)i)));
          }
          free(b);
          free(x);
        }
      }
      T_CHECK(found, "set %u: definite or not, and where", set);
      T_RATIO(worst, precision ? 1e-13 : 1e-4, "set %u: solutions in %s", set, precision ? "double" : "float");
    }
}

/* ---- Counts ---- */

static void test_counts(batten_context *ctx, size_t n, unsigned allowed) {
  scene s = bumpy_sphere(KERNEL_R, n, 3);
  answer a = answer_new(n);
  direct d = {0};
  batten_saddle_options o = iterative_options(2e-9); /* the iteration goes on to half of that */
  solve(ctx, &s, &d, &o, &a);
  T_CHECK(a.status == BATTEN_OK,
          "bumpy sphere, %zu points: %s, residual %.2g, %u levels, %zu domains (%zu in double)", n,
          batten_status_name(a.status), a.info.residual_rows, a.info.levels, a.info.domains, a.info.domains_double);
  T_RATIO(a.info.iterations, allowed, "iterations to 1e-9 (set-up %.2f s, solve %.2f s, %.0f MB)",
          a.info.time_setup_s, a.info.time_solve_s, (double)a.info.bytes * 1e-6);
  free(a.w);
  scene_free(&s);
}

/* What is told of the way: each mark is where an iteration that is asked for no more ends. */
static void test_marks(batten_context *ctx, batten_saddle_krylov krylov) {
  enum { N = 5000 };
  scene s = bumpy_sphere(KERNEL_R, N, 3);
  answer a = answer_new(N), part = answer_new(N);
  direct d = {0};
  batten_saddle_options o = iterative_options(2e-9);
  o.krylov = krylov;
  solve(ctx, &s, &d, &o, &a);
  const unsigned *to = a.info.iterations_to;
  T_CHECK(0 < to[0] && to[0] < to[1] && to[1] < to[2] && to[2] == a.info.iterations,
          "1e-3, 1e-6, 1e-9 after %u, %u, %u of %u iterations", to[0], to[1], to[2], a.info.iterations);
  const size_t *size = a.info.level_sizes;
  T_CHECK(a.info.levels == 2 && size[0] == N && 0 < size[1] && size[1] < N / 2 && size[2] == 0 && size[7] == 0,
          "levels of %zu, %zu", size[0], size[1]);
  for (int q = 0; q < 2; q++) {
    o.accuracy = q ? 2e-6 : 2e-3;
    o.products_accuracy = a.info.products_accuracy;
    solve(ctx, &s, &d, &o, &part);
    T_CHECK(part.info.iterations == to[q] && part.info.iterations_to[q] == to[q] && part.info.iterations_to[2] == 0,
            "asked for %g: %u iterations", 0.5 * o.accuracy, part.info.iterations);
  }
  free(a.w);
  free(part.w);
  scene_free(&s);
}

/* ---- Against dense solutions ---- */

/* Values of the spline at random points between the data. */
static void evaluate(const scene *s, const double *w, const double *c, size_t count, double *out) {
  uint64_t seed = 12;
  for (size_t q = 0; q < count; q++) {
    size_t i = t_random(&seed) % s->n, j = t_random(&seed) % s->n;
    double x[3];
    for (int a = 0; a < 3; a++) x[a] = 0.7 * s->x[3 * i + (size_t)a] + 0.3 * s->x[3 * j + (size_t)a];
    out[q] = 0;
    for (size_t p = 0; p < s->k; p++) out[q] += p == 0 ? c[0] : p < 4 ? c[p] * x[p - 1] : 0;
    for (size_t p = 0; p < s->n; p++) {
      double dx = x[0] - s->x[3 * p], dy = x[1] - s->x[3 * p + 1], dz = x[2] - s->x[3 * p + 2];
      out[q] += s->factor * w[p] * scene_phi(s->kernel, dx * dx + dy * dy + dz * dz);
    }
  }
}

static void against_dense(batten_context *ctx, scene *s, const batten_saddle_options *o, double bound,
                          const char *what) {
  enum { PLACES = 50 };
  double here[PLACES], there[PLACES], worst = 0, most = 0;
  answer a = answer_new(s->n), b = answer_new(s->n);
  direct d = {0};
  batten_saddle_matrix m = scene_matrix(s);
  batten_saddle_options dense = batten_saddle_options_default();
  batten_saddle *h = NULL;
  dense.smooth_kernel = o->smooth_kernel;
  b.status = batten_saddle_factor(ctx, &m, &dense, &h);
  if (b.status == BATTEN_OK) b.status = batten_saddle_solve(ctx, h, s->f, b.w, b.c);
  batten_saddle_free(h);
  solve(ctx, s, &d, o, &a);
  T_CHECK(a.status == BATTEN_OK && b.status >= 0,
          "%s: %u iterations, residual %.2g, %zu of %zu domains in double%s%s", what, a.info.iterations,
          a.info.residual_rows, a.info.domains_double, a.info.domains, a.status ? ", " : "",
          a.status ? batten_error(ctx) : "");
  evaluate(s, a.w, a.c, PLACES, here);
  evaluate(s, b.w, b.c, PLACES, there);
  for (size_t q = 0; q < PLACES; q++) {
    worst = fmax(worst, fabs(here[q] - there[q]));
    most = fmax(most, fabs(there[q]));
  }
  T_RATIO(worst / most, bound, "%s: values against the dense solution", what);
  T_RATIO(orthogonality_of(s, &a), 1e-10, "%s: P'w", what);
  free(a.w);
  free(b.w);
}

static void test_exactness(batten_context *ctx) {
  enum { N = 3300 };
  batten_saddle_options o = iterative_options(1e-9);
  scene s = scene_new(SCENE_RANDOM, KERNEL_R, N, 4, 5);
  smooth_data(&s);
  against_dense(ctx, &s, &o, 1e-8, "-r in a cube");
  o.krylov = BATTEN_SADDLE_CG;
  against_dense(ctx, &s, &o, 1e-8, "-r by conjugate gradients");
  o.krylov = BATTEN_SADDLE_KRYLOV_AUTO;
  s.nugget = 0.01;
  against_dense(ctx, &s, &o, 1e-8, "-r with a nugget");
  s.nugget = 0;
  s.k = 1;
  against_dense(ctx, &s, &o, 1e-8, "-r with a constant");
  scene_free(&s);

  s = bumpy_sphere(KERNEL_R3, N, 4);
  o.smooth_kernel = 1;
  against_dense(ctx, &s, &o, 1e-7, "r^3 on a bumpy sphere");
  scene_free(&s);

  s = scene_new(SCENE_RANDOM, KERNEL_R2LOGR, N, 3, 6); /* thin plate: in the plane, 1, x, y */
  for (size_t i = 0; i < s.n; i++) s.x[3 * i + 2] = 0;
  smooth_data(&s);
  o.smooth_kernel = 0;
  against_dense(ctx, &s, &o, 1e-7, "r^2 ln r in a plane");
  scene_free(&s);
}

/* What is asked for: as much as may be, and none at all. */
static void test_overlap(batten_context *ctx) {
  enum { N = 3300 };
  static const double overlaps[] = {4, 1e-3};
  static const unsigned allowed[] = {5, 60};
  scene s = scene_new(SCENE_RANDOM, KERNEL_R, N, 4, 5);
  smooth_data(&s);
  for (int q = 0; q < 2; q++) {
    answer a = answer_new(N);
    direct d = {0};
    batten_saddle_options o = iterative_options(1e-6);
    o.overlap = overlaps[q];
    solve(ctx, &s, &d, &o, &a);
    T_CHECK(a.status == BATTEN_OK, "overlap %g: %s", o.overlap, a.status ? batten_error(ctx) : "");
    T_RATIO(a.info.iterations, allowed[q], "overlap %g: iterations", o.overlap);
    T_RATIO(residual_of(&s, &a, a.c), 2e-6, "overlap %g: residual of all rows", o.overlap);
    free(a.w);
  }
  scene_free(&s);
}

/* ---- Poor products ---- */

static void test_products(batten_context *ctx) {
  enum { N = 4000 };
  scene s = bumpy_sphere(KERNEL_R, N, 16);
  answer a = answer_new(N);
  batten_saddle_options o = iterative_options(1e-6);
  direct fine = {.honest = true};
  solve(ctx, &s, &fine, &o, &a);
  T_CHECK(a.status == BATTEN_OK && fine.plans == 2, "products as good as asked: residual %.2g after %u iterations",
          a.info.residual_rows, a.info.iterations);
  T_RATIO(fabs(log(residual_of(&s, &a, a.c) / a.info.residual_rows)), log(1.5), "what is told against all rows");

  o.products_accuracy = 1e-3;
  direct poor = {.honest = true};
  solve(ctx, &s, &poor, &o, &a);
  T_CHECK(a.status == BATTEN_OK && poor.plans > 2 && poor.last_accuracy < 1e-5 &&
              a.info.products_accuracy == poor.last_accuracy,
          "poor at first: planned anew at %.2g, residual %.2g after %u iterations", poor.last_accuracy,
          a.info.residual_rows, a.info.iterations);
  T_RATIO(residual_of(&s, &a, a.c), 2e-6, "poor at first: residual of all rows");

  direct wrong = {.worst = 1e-5};
  o.products_accuracy = 0;
  solve(ctx, &s, &wrong, &o, &a);
  T_CHECK(a.status == BATTEN_W_ACCURACY && strstr(batten_error(ctx), "above opt.accuracy 1e-06"), "poor for ever: %s",
          batten_error(ctx));
  T_CHECK(a.info.residual_rows > 1e-6 && a.info.residual == a.info.residual_rows && a.info.rows_checked == 1000,
          "poor for ever: called what it is, %.2g on %zu rows", a.info.residual_rows, a.info.rows_checked);

  direct exact = {0};
  o.iterations_max = 2;
  solve(ctx, &s, &exact, &o, &a);
  T_CHECK(a.status == BATTEN_W_ACCURACY && a.info.iterations == 2 && strstr(batten_error(ctx), "iterations_max"),
          "two iterations: %s", batten_error(ctx));
  free(a.w);
  scene_free(&s);
}

/* ---- Starts, threads, callbacks ---- */

static void test_starts(batten_context *ctx) {
  enum { N = 3300 };
  scene s = bumpy_sphere(KERNEL_R, N, 17);
  direct d = {0};
  batten_saddle_sums sums = direct_sums(&s, &d);
  batten_saddle_matrix m = scene_matrix(&s);
  batten_saddle_options o = iterative_options(1e-7);
  batten_saddle *h = NULL;
  double *w = malloc(N * sizeof *w), *f = malloc(N * sizeof *f), c[4], entry = 0;
  uint64_t seed = 3;
  m.sums = &sums;
  T_OK(batten_saddle_factor(ctx, &m, &o, &h), ctx);
  T_OK(batten_saddle_solve(ctx, h, s.f, w, c), ctx);
  unsigned cold = batten_saddle_get_info(h).iterations;
  T_OK(batten_saddle_solve(ctx, h, s.f, f, c), ctx);
  T_CHECK(cold > 2 && batten_saddle_get_info(h).iterations == 0, "from zero %u iterations, again none", cold);
  for (size_t i = 0; i < N; i++) f[i] = s.f[i] + 1e-9 * t_uniform(&seed);
  T_OK(batten_saddle_solve(ctx, h, f, f, c), ctx); /* in place */
  T_CHECK(batten_saddle_get_info(h).iterations <= 1, "data a little different: %u",
          batten_saddle_get_info(h).iterations);
  T_OK(batten_saddle_begin_at(ctx, h, NULL), ctx);
  T_OK(batten_saddle_solve(ctx, h, s.f, f, c), ctx);
  T_CHECK(batten_saddle_get_info(h).iterations == cold && !memcmp(f, w, N * sizeof *w), "from zero: the same bits");
  for (size_t i = 0; i < N; i++) f[i] = 1e6 * t_uniform(&seed);
  T_OK(batten_saddle_begin_at(ctx, h, f), ctx);
  T_OK(batten_saddle_solve(ctx, h, s.f, f, c), ctx);
  T_CHECK(!memcmp(f, w, N * sizeof *w), "from nonsense: as from zero");
  T_OK(batten_saddle_begin_at(ctx, h, NULL), ctx);
  T_OK(batten_saddle_begin_at(ctx, h, w), ctx);
  T_OK(batten_saddle_solve(ctx, h, s.f, f, c), ctx);
  T_CHECK(batten_saddle_get_info(h).iterations == 0, "from given weights: none");
  f[5] = NAN;
  T_STATUS(batten_saddle_begin_at(ctx, h, f), BATTEN_E_INVALID, ctx, "w[5]: nan is not finite");
  T_CHECK(batten_saddle_begin_at(ctx, NULL, f) == BATTEN_E_INVALID, "no handle");
  T_STATUS(batten_saddle_inverse_diagonal(ctx, h, 1, (size_t[]){0}, &entry), BATTEN_E_INVALID, ctx,
           "method iterative has no factor");

  /* A polynomial is reproduced without weights, and 0. */
  for (size_t i = 0; i < N; i++) f[i] = 3 - s.x[3 * i] + 2 * s.x[3 * i + 1];
  T_OK(batten_saddle_solve(ctx, h, f, w, c), ctx);
  T_RATIO(fmax(fmax(fabs(c[0] - 3), fabs(c[1] + 1)), fmax(fabs(c[2] - 2), fabs(c[3]))), 1e-12, "a linear f: c");
  T_CHECK(w[0] == 0 && w[N - 1] == 0 && batten_saddle_get_info(h).iterations == 0, "a linear f: no weights");
  /* Powers of two: the same bits, huge or tiny. */
  double *huge = malloc(2 * N * sizeof *huge), *tiny = huge + N;
  for (size_t i = 0; i < N; i++) f[i] = ldexp(s.f[i], 1000);
  T_OK(batten_saddle_begin_at(ctx, h, NULL), ctx);
  T_OK(batten_saddle_solve(ctx, h, f, huge, c), ctx);
  for (size_t i = 0; i < N; i++) f[i] = ldexp(s.f[i], -900), huge[i] = ldexp(huge[i], -1900);
  T_OK(batten_saddle_begin_at(ctx, h, NULL), ctx);
  T_OK(batten_saddle_solve(ctx, h, f, tiny, c), ctx);
  T_CHECK(!memcmp(huge, tiny, N * sizeof *huge), "f times powers of two: the same bits");
  free(huge);
  memset(f, 0, N * sizeof *f);
  T_OK(batten_saddle_solve(ctx, h, f, w, c), ctx);
  T_CHECK(w[7] == 0 && c[0] == 0, "f = 0");
  batten_saddle_free(h);
  T_CHECK(d.live == 0, "no plan is left over");
  free(w);
  free(f);
  scene_free(&s);
}

static void test_threads(void) {
  enum { N = 3300 };
  static const unsigned threads[] = {1, 2, 5};
  answer a[4];
  scene s = bumpy_sphere(KERNEL_R, N, 18);
  for (int q = 0; q < 4; q++) {
    batten_context *ctx = t_context(NULL, NULL, threads[q % 3]);
    batten_saddle_options o = iterative_options(1e-6);
    direct d = {0};
    a[q] = answer_new(N);
    if (q < 3) {
      solve(ctx, &s, &d, &o, &a[q]);
    } else { /* entries by fill */
      batten_saddle_sums sums = direct_sums(&s, &d);
      batten_saddle_matrix m = scene_matrix(&s);
      batten_saddle *h = NULL;
      sums.entries = NULL;
      m.sums = &sums;
      a[q].status = batten_saddle_factor(ctx, &m, &o, &h);
      if (a[q].status == BATTEN_OK) a[q].status = batten_saddle_solve(ctx, h, s.f, a[q].w, a[q].c);
      batten_saddle_free(h);
    }
    T_CHECK(a[q].status == BATTEN_OK && !memcmp(a[q].w, a[0].w, N * sizeof(double)) &&
                !memcmp(a[q].c, a[0].c, sizeof a[q].c),
            "%s %u: the same bits", q < 3 ? "threads" : "entries by fill, threads", threads[q % 3]);
    batten_context_free(ctx);
  }
  for (int q = 0; q < 4; q++) free(a[q].w);
  scene_free(&s);
}

/* Two points at distance 2, kernel -r, P = 1: f1 = -2 w2 + c, f2 = -2 w1 + c, w1 + w2 = 0. */
static void test_by_hand(batten_context *ctx) {
  double x[6] = {0, 0, 0, 2, 0, 0}, p[2] = {1, 1}, f[2] = {5, 1};
  scene s = {.n = 2, .k = 1, .kernel = KERNEL_R, .factor = 1, .x = x, .p = p, .f = f};
  answer a = answer_new(2);
  direct d = {0};
  batten_saddle_options o = iterative_options(1e-12);
  solve(ctx, &s, &d, &o, &a);
  T_CHECK(a.status == BATTEN_OK && fabs(a.w[0] - 1) < 1e-12 && fabs(a.w[1] + 1) < 1e-12 && fabs(a.c[0] - 3) < 1e-12,
          "two points: w = %g %g, c = %g", a.w[0], a.w[1], a.c[0]);
  s.n = 1, s.k = 0, s.nugget = 4;
  solve(ctx, &s, &d, &o, &a);
  T_CHECK(a.status == BATTEN_OK && fabs(a.w[0] - 1.25) < 1e-12, "1 x 1: %g", a.w[0]);
  s.n = 0;
  solve(ctx, &s, &d, &o, &a);
  T_CHECK(a.status == BATTEN_OK, "N = k = 0 %s", a.status ? batten_error(ctx) : "");
  free(a.w);
}

int main(int argc, char **argv) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  if (argc > 1 && !strcmp(argv[1], "large")) {
    test_counts(ctx, 40000, 10);
  } else {
    test_parts();
    test_panels();
    test_by_hand(ctx);
    test_counts(ctx, 10000, 8);
    test_marks(ctx, BATTEN_SADDLE_FGMRES);
    test_marks(ctx, BATTEN_SADDLE_CG);
    test_exactness(ctx);
    test_overlap(ctx);
    test_products(ctx);
    test_starts(ctx);
    test_threads();
  }
  batten_context_free(ctx);
  return t_done();
}
