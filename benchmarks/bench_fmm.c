/* Fast multipole sums: time of a product and its true error, against direct sums of the same points.
 *
 *   bench-fmm [N ...]        default 10,000 40,000 100,000
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
