/* Fast multipole sums: time of a product and its true error, against direct sums of the same points; and of one sum
 * at targets that come in batches.
 *
 *   bench-fmm [N ...]            products; default 10,000 40,000 100,000
 *   bench-fmm evaluator [N ...]  batches of 3 N lattice points near the surface; default 100,000
 *
 * Points at random on a bumpy sphere in space and in a square, weights in [-1, 1] with the sum 0. "order" and "rank"
 * are what the accuracy asked for takes; errors are 2-norms over 1000 random rows of direct sums, relative to those
 * of the values. Times are the best of three on two threads. Prints tables in Markdown. */
#include <batten/blas.h>
#include <batten/fmm.h>

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { RUNS = 3, ROWS = 1000 };

static double uniform(uint64_t *state) {
  *state = *state * 6364136223846793005u + 1442695040888963407u;
  return 2 * ((double)(*state >> 11) * 0x1p-53) - 1;
}

static void make_points(unsigned n, size_t count, double *x, double *w) {
  uint64_t seed = 17;
  double mean = 0;
  for (size_t i = 0; i < count; i++) {
    double u[3] = {0}, square = 0;
    do {
      square = 0;
      for (unsigned a = 0; a < n; a++) u[a] = uniform(&seed), square += u[a] * u[a];
    } while (n == 3 && (square > 1 || square < 0.01));
    const double bump = 1 + 0.1 * sin(5 * u[0] / sqrt(square)) * cos(4 * u[1] / sqrt(square));
    for (unsigned a = 0; a < n; a++) x[i * n + a] = n == 3 ? bump * u[a] / sqrt(square) : u[a];
    mean += w[i] = uniform(&seed);
  }
  for (size_t i = 0; i < count; i++) w[i] -= mean / (double)count;
}

static void row(batten_context *ctx, const batten_radial *k, size_t count, const double *x, const double *w,
                double accuracy, double *values) {
  batten_fmm_options o = batten_fmm_options_default();
  o.accuracy = accuracy;
  batten_fmm *f = NULL;
  double best = INFINITY, error = NAN, start;
  batten_status st = batten_fmm_create(ctx, k, count, x, count, NULL, &o, &f);
  for (int run = 0; run < RUNS && st >= 0; run++) {
    st = batten_fmm_apply(ctx, f, w, NULL, values, NULL);
    best = fmin(best, f ? batten_fmm_get_info(f).time_apply_s : INFINITY);
  }
  if (st < 0) {
    printf("| %g | %s |\n", accuracy, batten_error(ctx));
    batten_fmm_free(f);
    return;
  }
  start = batten_now();
  batten_fmm_error(ctx, f, w, NULL, values, NULL, ROWS, 1, &error, NULL);
  const double direct = (batten_now() - start) * (double)count / ROWS;
  const batten_fmm_info i = batten_fmm_get_info(f);
  printf("| %zu | %.0e | %u | %zu | %.3f | %.3f | %.3f | %.1e | %s%.2f | %.0f |\n", count, accuracy, i.order, i.rank,
         i.time_operators_s, i.time_plan_s, best, error, i.direct ? "taken: " : "", direct, (double)i.bytes * 1e-6);
  fflush(stdout);
  batten_fmm_free(f);
}

/* ---- batches ---- */

static double bumpy_radius(const double *x, double r) { return 1 + 0.1 * sin(5 * x[0] / r) * cos(4 * x[1] / r); }

/* Up to `most` points of a lattice within two steps of the surface, where a polygoniser asks. */
static size_t make_lattice(size_t most, double *x) {
  const double step = sqrt(4 * 4 * 3.14159265358979323846 / (double)most);
  const int side = (int)(1.2 / step) + 1;
  size_t count = 0;
  for (int i = -side; i <= side; i++)
    for (int j = -side; j <= side; j++)
      for (int k = -side; k <= side && count < most; k++) {
        const double p[3] = {i * step, j * step, k * step}, r = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
        if (r < 0.5 || fabs(r - bumpy_radius(p, r)) > 2 * step) continue;
        for (unsigned a = 0; a < 3; a++) x[3 * count + a] = p[a];
        count++;
      }
  return count;
}

/* The true error of values [targets] at ROWS of them, and the time of direct sums there, for each value. */
static double direct_sums(batten_context *ctx, const batten_radial *k, size_t count, const double *y, const double *w,
                          size_t targets, const double *x, const double *values, double *seconds) {
  const size_t step = targets / ROWS + 1, at_a_time = 4000000 / count + 1;
  double difference = 0, norm = 0, places[3 * ROWS], u[ROWS];
  size_t rows = 0;
  for (size_t i = 0; i < targets; i += step, rows++)
    for (unsigned a = 0; a < 3; a++) places[3 * rows + a] = x[3 * i + a];
  *seconds = 0;
  for (size_t i = 0; i < rows; i += at_a_time) {
    batten_fmm *f = NULL; /* so few targets that it sums directly */
    if (batten_fmm_create(ctx, k, count, y, rows - i < at_a_time ? rows - i : at_a_time, places + 3 * i, NULL, &f) <
            0 ||
        batten_fmm_apply(ctx, f, w, NULL, u + i, NULL) < 0)
      return NAN;
    *seconds += batten_fmm_get_info(f).time_apply_s / (double)rows;
    batten_fmm_free(f);
  }
  for (size_t i = 0; i < rows; i++) {
    difference += (values[i * step] - u[i]) * (values[i * step] - u[i]);
    norm += u[i] * u[i];
  }
  return sqrt(difference / norm);
}

static void batch_row(batten_context *ctx, const batten_radial *k, size_t count, const double *y, const double *w,
                      double accuracy, size_t targets, const double *x, double *u, double *g) {
  batten_fmm_options o = batten_fmm_options_default();
  o.accuracy = accuracy;
  o.gradients = 1;
  batten_fmm_evaluator *e = NULL;
  double cold = NAN, warm = INFINITY, gradients = INFINITY, direct;
  batten_status st = batten_fmm_evaluator_new(ctx, k, count, y, w, NULL, &o, &e);
  for (int run = 0; run <= 2 * RUNS && st >= 0; run++) {
    st = batten_fmm_evaluator_evaluate(ctx, e, targets, x, u, run > RUNS ? g : NULL);
    const double time = batten_fmm_evaluator_get_info(e).time_evaluate_s;
    if (run == 0)
      cold = time;
    else if (run <= RUNS)
      warm = fmin(warm, time);
    else
      gradients = fmin(gradients, time);
  }
  if (st < 0) {
    printf("| %g | %s |\n", accuracy, batten_error(ctx));
    batten_fmm_evaluator_free(e);
    return;
  }
  const batten_fmm_evaluator_info i = batten_fmm_evaluator_get_info(e);
  const double error = direct_sums(ctx, k, count, y, w, targets, x, u, &direct), per = 1e6 / (double)targets;
  printf("| %zu | %zu | %.0e | %u | %zu | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f | %.0f | %.1e | %zu | %.0f |\n",
         count, targets, accuracy, i.order, i.rank, i.time_operators_s, i.time_sources_s, cold, cold * per,
         warm * per, gradients * per, direct * 1e6, error, i.nodes, (double)i.bytes * 1e-6);
  fflush(stdout);
  batten_fmm_evaluator_free(e);
}

static int batches(batten_context *ctx, int argc, char **argv) {
  static const batten_radial kernels[] = {{3, 1, 0}, {3, 3, 0}};
  static const double accuracies[] = {1e-4, 1e-6, 1e-8};
  for (size_t k = 0; k < 2; k++) {
    printf("\n### %s, bumpy sphere, batches of lattice points near it\n\n", k ? "r^3" : "r");
    printf(
        "| N | targets | accuracy asked | order | rank | operators s | sources s | first batch s | us a value: first "
        "batch | later | with gradients | direct | true error | places | MB |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    for (int c = 0; c < (argc > 0 ? argc : 1); c++) {
      const size_t count = argc > 0 ? (size_t)strtoull(argv[c], NULL, 10) : 100000;
      double *y = malloc(count * 4 * sizeof *y), *w = y + 3 * count;
      double *x = malloc(count * 3 * 7 * sizeof *x), *u = x + 9 * count, *g = u + 3 * count;
      if (!y || !x) return 1;
      make_points(3, count, y, w);
      const size_t targets = make_lattice(3 * count, x);
      for (size_t a = 0; a < sizeof accuracies / sizeof *accuracies; a++)
        batch_row(ctx, &kernels[k], count, y, w, accuracies[a], targets, x, u, g);
      free(y), free(x);
    }
  }
  return 0;
}

int main(int argc, char **argv) {
  static const struct {
    const char *name;
    batten_radial kernel;
  } kernels[] = {{"r, bumpy sphere", {3, 1, 0}},
                 {"r^3, bumpy sphere", {3, 3, 0}},
                 {"r^5, bumpy sphere", {3, 5, 0}},
                 {"r^2 ln r, square", {2, 2, 1}},
                 {"r^4 ln r, square", {2, 4, 1}}};
  static const double accuracies[] = {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12};
  static const size_t usual[] = {10000, 40000, 100000};
  const size_t counts = argc > 1 ? (size_t)argc - 1 : sizeof usual / sizeof *usual;
  batten_context_options co = batten_context_options_default();
  co.threads = 2;
  batten_context *ctx = NULL;
  if (batten_context_new(&co, &ctx) < 0) return 1;
  char blas[256];
  batten_blas_describe(blas, sizeof blas);
#if defined(__VERSION__)
  printf("Compiler %s, batten %s on %u threads; %s (not used by the sums).\n", __VERSION__, batten_version(),
         co.threads, blas);
#endif
  if (argc > 1 && !strcmp(argv[1], "evaluator")) {
    const int failed = batches(ctx, argc - 2, argv + 2);
    batten_context_free(ctx);
    return failed;
  }
  for (size_t k = 0; k < sizeof kernels / sizeof *kernels; k++) {
    printf("\n### %s\n\n", kernels[k].name);
    printf(
        "| N | accuracy asked | order | rank | operators s | plan s | product s | true error | direct s (of 1000 "
        "rows) "
        "| MB |\n|---|---|---|---|---|---|---|---|---|---|\n");
    for (size_t c = 0; c < counts; c++) {
      const size_t count = argc > 1 ? (size_t)strtoull(argv[c + 1], NULL, 10) : usual[c];
      const unsigned n = kernels[k].kernel.n;
      double *x = malloc(count * n * sizeof *x), *w = malloc(count * sizeof *w), *u = malloc(count * sizeof *u);
      if (!x || !w || !u) return 1;
      make_points(n, count, x, w);
      for (size_t a = 0; a < sizeof accuracies / sizeof *accuracies; a++)
        row(ctx, &kernels[k].kernel, count, x, w, accuracies[a], u);
      free(x), free(w), free(u);
    }
  }
  batten_context_free(ctx);
  return 0;
}
