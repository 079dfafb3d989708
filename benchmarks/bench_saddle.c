/* Times of the saddle solver beside bare LAPACK, as Markdown tables:
 *   1. mixed, Cholesky, LDL' (and QR up to N = 2000) with their phases, and dgesv, dsysv, dpotrf, spotrf, dgemm of
 *      the same size in the same run;
 *   2. Table 1 of the volume splines paper: a 400 x 400 system on 1 and 2 threads, with the use of processors.
 * Usage: bench-saddle [N ...]; default 1000 2000 4000. Times up to N = 4000 are medians of three. */
#include <batten/blas.h>
#include <batten/saddle.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "la/fortran.h"

/* Points in a cube, kernel -r, linear polynomials; coordinates apart, so that the fill loop is vectorised. */
typedef struct points {
  size_t n;
  double *x, *y, *z, *p, *f;
} points;

static double uniform(uint64_t *state) {
  *state = *state * 6364136223846793005u + 1442695040888963407u;
  return (double)(*state >> 11) * 0x1p-53;
}

static points make_points(size_t n) {
  points s = {.n = n, .x = malloc(n * 8 * sizeof(double))};
  if (!s.x) {
    fprintf(stderr, "out of memory\n");
    exit(1);
  }
  s.y = s.x + n, s.z = s.y + n, s.p = s.z + n, s.f = s.p + 4 * n;
  uint64_t seed = 42;
  for (size_t i = 0; i < n; i++) {
    s.x[i] = uniform(&seed), s.y[i] = uniform(&seed), s.z[i] = uniform(&seed);
    s.p[i] = 1, s.p[i + n] = s.x[i], s.p[i + 2 * n] = s.y[i], s.p[i + 3 * n] = s.z[i];
    s.f[i] = 0.25 - (s.x[i] - 0.5) * (s.x[i] - 0.5) - (s.y[i] - 0.5) * (s.y[i] - 0.5) - s.z[i] * s.z[i];
  }
  return s;
}

/* Built for several instruction sets, as a real evaluator is; chosen by the loader. */
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__linux__)
#define FILL_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define FILL_CLONES
#endif
enum { LANES = 8 };

FILL_CLONES static void fill(const void *user, size_t row0, size_t rows, size_t col0, size_t cols, double *tile,
                             size_t ld) {
  const points *s = user;
  const double *x = s->x + row0, *y = s->y + row0, *z = s->z + row0;
  for (size_t j = 0; j < cols; j++) {
    double xj = s->x[col0 + j], yj = s->y[col0 + j], zj = s->z[col0 + j], *restrict to = tile + j * ld;
    size_t i = 0;
    for (; i + LANES <= rows; i += LANES)
      for (size_t l = 0; l < LANES; l++) {
        double dx = x[i + l] - xj, dy = y[i + l] - yj, dz = z[i + l] - zj;
        to[i + l] = -sqrt(dx * dx + dy * dy + dz * dz);
      }
    for (; i < rows; i++) {
      double dx = x[i] - xj, dy = y[i] - yj, dz = z[i] - zj;
      to[i] = -sqrt(dx * dx + dy * dy + dz * dz);
    }
  }
}

static int by_value(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

enum { REPEATS = 3 };

static size_t repeats(size_t n) { return n <= 4000 ? REPEATS : 1; }

static double median(double *times, size_t count) {
  qsort(times, count, sizeof *times, by_value);
  return times[count / 2];
}

/* ---- batten ---- */

typedef struct run {
  double total, cpu;
  batten_saddle_info info;
} run;

static int by_total(const void *a, const void *b) {
  return by_value(&((const run *)a)->total, &((const run *)b)->total);
}

static run solve_once(batten_context *ctx, const points *s, batten_saddle_method method) {
  batten_saddle_matrix m = {.n = s->n, .k = 4, .p = s->p, .fill = fill, .user = s};
  batten_saddle_options o = batten_saddle_options_default();
  o.method = method;
  batten_saddle *h = NULL;
  double *w = malloc((s->n + 4) * sizeof *w), start = batten_now();
  clock_t cpu = clock();
  batten_status st = w ? batten_saddle_factor(ctx, &m, &o, &h) : BATTEN_E_NOMEM;
  if (st >= 0) st = batten_saddle_solve(ctx, h, s->f, w, w + s->n);
  run r = {.total = batten_now() - start, .cpu = (double)(clock() - cpu) / CLOCKS_PER_SEC};
  if (st < 0)
    fprintf(stderr, "N = %zu, %s: %s\n", s->n, batten_saddle_method_name(method), batten_error(ctx));
  else
    r.info = batten_saddle_get_info(h);
  batten_saddle_free(h);
  free(w);
  return r;
}

static run solve_median(batten_context *ctx, const points *s, batten_saddle_method method, size_t count) {
  run runs[REPEATS];
  for (size_t q = 0; q < count; q++) runs[q] = solve_once(ctx, s, method);
  qsort(runs, count, sizeof *runs, by_total);
  return runs[count / 2];
}

/* ---- Bare LAPACK ---- */

typedef enum bare { DGESV, DSYSV, DPOTRF, SPOTRF, DGEMM } bare;
static const char *const bare_names[] = {"dgesv", "dsysv", "dpotrf", "spotrf", "dgemm"};

/* The saddle matrix for dgesv and dsysv; a definite one for the Cholesky routines. */
static void fill_bare(bare routine, const points *s, size_t order, double *a) {
  fill(s, 0, s->n, 0, s->n, a, order);
  for (size_t j = 0; j < s->n; j++) {
    for (size_t c = 0; c < order - s->n; c++)
      a[s->n + c + j * order] = a[j + (s->n + c) * order] = s->p[j + c * s->n];
    if (routine == DPOTRF || routine == SPOTRF) a[j + j * order] = (double)s->n;
  }
  for (size_t c = s->n; c < order; c++) memset(a + s->n + c * order, 0, (order - s->n) * sizeof *a);
}

/* Seconds; *cpu: those of all processors. */
static double time_bare_once(bare routine, const points *s, double *cpu) {
  size_t order = s->n + (routine == DGESV || routine == DSYSV ? 4 : 0), lwork = 64 * order;
  double *a = malloc((order * order + order + lwork) * sizeof *a), time = NAN;
  double *c = routine == DGEMM ? malloc(order * order * sizeof *c) : NULL;
  batten_la_int *pivots = malloc(order * sizeof *pivots);
  if (!a || !pivots || (routine == DGEMM && !c)) goto done;
  double *b = a + order * order, *work = b + order;
  batten_la_int n = (batten_la_int)order, one = 1, lw = (batten_la_int)lwork, info = 0;
  memcpy(b, s->f, s->n * sizeof *b);
  for (size_t i = s->n; i < order; i++) b[i] = 0;
  fill_bare(routine, s, order, a);
  if (routine == SPOTRF) { /* in place: the floats overtake nothing that is still to be read */
    float *f = (float *)(void *)work;
    for (size_t j = 0; j < order; j++) {
      for (size_t i = 0; i < order; i++) f[i] = (float)a[i + j * order];
      memcpy((char *)a + j * order * sizeof *f, f, order * sizeof *f);
    }
  }
  const double plus = 1, zero = 0;
  double start = batten_now();
  clock_t cpu_start = clock();
  switch (routine) {
    case DGESV:
      FORTRAN(dgesv)(&n, &one, a, &n, pivots, b, &n, &info);
      break;
    case DSYSV:
      FORTRAN(dsysv)("L", &n, &one, a, &n, pivots, b, &n, work, &lw, &info, 1);
      break;
    case DPOTRF:
      FORTRAN(dpotrf)("L", &n, a, &n, &info, 1);
      break;
    case SPOTRF:
      FORTRAN(spotrf)("L", &n, (float *)(void *)a, &n, &info, 1);
      break;
    case DGEMM:
      FORTRAN(dgemm)("N", "N", &n, &n, &n, &plus, a, &n, a, &n, &zero, c, &n, 1, 1);
      break;
  }
  time = batten_now() - start;
  *cpu = (double)(clock() - cpu_start) / CLOCKS_PER_SEC;
  if (info != 0) fprintf(stderr, "%s: info = %ld\n", bare_names[routine], (long)info);
done:
  free(pivots);
  free(c);
  free(a);
  return time;
}

static double time_bare(bare routine, const points *s, size_t count) {
  double times[REPEATS], cpu;
  for (size_t q = 0; q < count; q++) times[q] = time_bare_once(routine, s, &cpu);
  return median(times, count);
}

/* ---- Tables ---- */

static void table_of_size(batten_context *ctx, size_t n) {
  static const batten_saddle_method methods[] = {BATTEN_SADDLE_CHOLESKY_MIXED, BATTEN_SADDLE_CHOLESKY,
                                                 BATTEN_SADDLE_LDL, BATTEN_SADDLE_QR};
  points s = make_points(n);
  size_t count = repeats(n);
  double sysv = time_bare(DSYSV, &s, count);
  printf(
      "\n### N = %zu\n\n| | total s | assemble | project | factor | solve | refinements | residual | rcond | MB |"
      " / dsysv |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
      n);
  for (size_t q = 0; q < sizeof methods / sizeof *methods; q++) {
    if (methods[q] == BATTEN_SADDLE_QR && n > 2000) continue;
    run r = solve_median(ctx, &s, methods[q], count);
    printf("| %s%s | %.4f | %.4f | %.4f | %.4f | %.4f | %u | %.1e | %.1e | %.0f | %.3f |\n",
           batten_saddle_method_name(r.info.method), r.info.fallbacks ? " (fallen back)" : "", r.total,
           r.info.time_assemble_s, r.info.time_project_s, r.info.time_factor_s, r.info.time_solve_s,
           r.info.refinements, r.info.residual, r.info.rcond, (double)r.info.bytes / 1e6, r.total / sysv);
    fflush(stdout);
  }
  for (bare routine = DGESV; routine <= DGEMM; routine++) {
    double time = routine == DSYSV ? sysv : time_bare(routine, &s, count);
    printf("| %s | %.4f | | | %.4f | | | | | | %.3f |\n", bare_names[routine], time, time, time / sysv);
    fflush(stdout);
  }
  free(s.x);
}

/* OpenBLAS's thread count is the process's: the benchmark, unlike the library, may set it. */
void openblas_set_num_threads(int threads) __attribute__((weak));

enum { TIMES = 200 };

static void row_400(unsigned threads, const char *name, double wall, double cpu) {
  printf("| %u | %u | %s | %.3f | %.0f %% |\n", threads, batten_blas_threads(), name, 1e3 * wall / TIMES,
         100 * cpu / (wall * threads));
}

/* 396 points and 4 monomials: the saddle matrix has order 400, as that of the bare solvers. */
static void table_400(void) {
  static const batten_saddle_method methods[] = {BATTEN_SADDLE_CHOLESKY, BATTEN_SADDLE_LDL, BATTEN_SADDLE_QR};
  points s = make_points(396);
  printf(
      "\n### Table 1: a 400 x 400 system, mean of %d\n\n| threads | of BLAS | | ms | use of processors |\n"
      "|---|---|---|---|---|\n",
      TIMES);
  for (unsigned threads = 1; threads <= 2; threads++) {
    batten_context_options o = batten_context_options_default();
    batten_context *ctx = NULL;
    o.threads = threads;
    if (openblas_set_num_threads) openblas_set_num_threads((int)threads);
    if (batten_context_new(&o, &ctx) < 0) continue;
    for (size_t q = 0; q < 3; q++) {
      double wall = 0, cpu = 0;
      for (int i = 0; i < TIMES; i++) {
        run r = solve_once(ctx, &s, methods[q]);
        wall += r.total;
        cpu += r.cpu;
      }
      row_400(threads, batten_saddle_method_name(methods[q]), wall, cpu);
    }
    for (bare routine = DGESV; routine <= DGEMM; routine++) {
      double wall = 0, cpu = 0;
      for (int i = 0; i < TIMES; i++) {
        double once = 0;
        wall += time_bare_once(routine, &s, &once);
        cpu += once;
      }
      row_400(threads, bare_names[routine], wall, cpu);
    }
    batten_context_free(ctx);
  }
  free(s.x);
}

int main(int argc, char **argv) {
  char blas[256];
  batten_blas_describe(blas, sizeof blas);
  batten_context_options o = batten_context_options_default();
  batten_context *ctx = NULL;
  o.threads = batten_blas_threads() ? batten_blas_threads() : 1;
  if (batten_context_new(&o, &ctx) < 0) return 1;
  printf("# Saddle solver, kernel -r in 3-D, k = 4\n\nBLAS: %s, %u threads; batten %s, %u threads; compiler %s\n",
         blas, batten_blas_threads(), batten_version(), o.threads, __VERSION__);
  static const size_t usual[] = {1000, 2000, 4000};
  for (int q = 1; q < argc; q++) table_of_size(ctx, strtoul(argv[q], NULL, 10));
  for (size_t q = 0; argc == 1 && q < 3; q++) table_of_size(ctx, usual[q]);
  table_400();
  batten_context_free(ctx);
  return 0;
}
