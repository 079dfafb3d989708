/* Fits of many points by iteration on fast sums, as a Markdown table: random points of a bumpy sphere, the values of
 * a ball. Usage: bench-large [--accuracy EPS] [--order M] [--dense] [N ...]; default 1e-6, 2 (kernel r),
 * 10000 40000 100000. --dense fits by factors too where N <= 16000. */
#include "tap.h"

#include <batten/batten.h>
#include <unistd.h>

typedef struct row {
  size_t n, bytes;
  double total, product, dense;
  batten_spline_info info;
} row;

/* A ball's function is a polynomial that splines of order 3 reproduce: theirs is the distance from the sphere. */
static void make_points(size_t n, unsigned order, double *points, double *values) {
  uint64_t seed = 1;
  for (size_t i = 0; i < n; i++) {
    double z = 2 * t_uniform(&seed) - 1, a = 8 * atan(1) * t_uniform(&seed), s = sqrt(1 - z * z), *x = points + 3 * i;
    double radius = 1 + 0.1 * sin(5 * a) * s * s + 0.05 * cos(9 * z);
    x[0] = radius * s * cos(a), x[1] = radius * s * sin(a), x[2] = radius * z;
    double square = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
    values[i] = 1 - (order > 2 ? sqrt(square) : square);
  }
}

/* One product of all points with all, as accurate as the fit had it; the second, so that memory is warm. */
static double product_time(batten_context *ctx, const batten_spline_data *d, int power, double accuracy) {
  batten_fmm_options o = batten_fmm_options_default();
  o.accuracy = fmin(fmax(accuracy, 1e-12), 1e-3);
  batten_radial kernel = {.n = 3, .power = power};
  batten_fmm *sums = NULL;
  double *y = malloc(d->count * sizeof *y), time = NAN;
  batten_status st = y ? batten_fmm_create(ctx, &kernel, d->count, d->points, d->count, NULL, &o, &sums) : -1;
  for (int k = 0; st >= 0 && k < 2; k++) {
    double start = batten_now();
    st = batten_fmm_apply(ctx, sums, d->values, NULL, y, NULL);
    time = batten_now() - start;
  }
  batten_fmm_free(sums);
  free(y);
  return st >= 0 ? time : NAN;
}

static bool fit(batten_context *ctx, const batten_spline_data *d, const batten_spline_options *o, row *out) {
  batten_spline *s = NULL;
  double start = batten_now();
  batten_bytes_peak_reset(ctx);
  batten_status st = batten_spline_fit(ctx, d, o, &s, &out->info);
  out->total = batten_now() - start;
  out->bytes = batten_bytes_peak(ctx);
  if (st != BATTEN_OK) printf("N = %zu: %s: %s\n", d->count, batten_status_text(st), batten_error(ctx));
  batten_spline_free(s);
  return st >= 0;
}

static bool measure(batten_context *ctx, size_t n, unsigned order, double accuracy, bool dense, row *out) {
  batten_spline_data d = batten_spline_data_default();
  batten_spline_options o = batten_spline_options_default();
  double *points = malloc(4 * n * sizeof *points), *values = points + 3 * n;
  *out = (row){.n = n, .dense = NAN};
  if (!points) return false;
  make_points(n, order, points, values);
  d.count = n, d.points = points, d.values = values;
  o.m = order;
  o.loo_samples = 0;
  row other = {0};
  o.saddle.method = BATTEN_SADDLE_CHOLESKY_MIXED;
  if (dense && n <= 16000 && fit(ctx, &d, &o, &other)) out->dense = other.total;
  o.saddle.method = BATTEN_SADDLE_ITERATIVE;
  o.saddle.accuracy = accuracy;
  bool ok = fit(ctx, &d, &o, out);
  if (ok) out->product = product_time(ctx, &d, 2 * (int)order - 3, out->info.saddle.products_accuracy);
  free(points);
  return ok;
}

/* Slope of log(set-up + solve) over log N, by least squares. */
static double exponent(const row *rows, size_t count) {
  double x = 0, y = 0, xx = 0, xy = 0, n = (double)count;
  for (size_t i = 0; i < count; i++) {
    double a = log((double)rows[i].n), b = log(rows[i].info.saddle.time_setup_s + rows[i].info.saddle.time_solve_s);
    x += a, y += b, xx += a * a, xy += a * b;
  }
  return (n * xy - x * y) / (n * xx - x * x);
}

static void print_row(const row *r) {
  const batten_saddle_info *s = &r->info.saddle;
  printf("| %zu | %u | %zu (%zu) | %.2f | %u | %.3f | %.2f | %.2f | %.2f | %.2f | %.1e | %.0e | %.1e |", r->n,
         s->levels, s->domains, s->domains_double, s->time_setup_s, s->iterations, r->product, s->time_solve_s,
         s->time_setup_s + s->time_solve_s, r->total, (double)r->bytes / 1e9, s->residual_rows, s->products_accuracy,
         r->info.residual_max);
  if (isnan(r->dense))
    printf(" - |\n");
  else
    printf(" %.2f |\n", r->dense);
  fflush(stdout);
}

int main(int argc, char **argv) {
  enum { MOST = 16 };
  size_t sizes[MOST] = {10000, 40000, 100000}, count = 0, done = 0;
  unsigned order = 2;
  double accuracy = 1e-6;
  bool dense = false;
  for (int i = 1; i < argc; i++) {
    if (!strcmp(argv[i], "--accuracy") && i + 1 < argc)
      accuracy = strtod(argv[++i], NULL);
    else if (!strcmp(argv[i], "--order") && i + 1 < argc)
      order = (unsigned)strtoul(argv[++i], NULL, 10);
    else if (!strcmp(argv[i], "--dense"))
      dense = true;
    else if (count < MOST)
      sizes[count++] = (size_t)strtoul(argv[i], NULL, 10);
  }
  if (count == 0) count = 3;
  batten_context_options o = batten_context_options_default();
  o.threads = (unsigned)sysconf(_SC_NPROCESSORS_ONLN);
  batten_context *ctx = NULL;
  if (batten_context_new(&o, &ctx) < 0) return 1;
  char blas[256];
  batten_blas_describe(blas, sizeof blas);
  printf("batten %s, %u threads, BLAS: %s, %u threads\n", batten_version(), o.threads, blas, batten_blas_threads());
  printf("bumpy sphere, seed 1, order %u, accuracy %g; residual on 1000 direct rows, largest over the range\n\n",
         order, accuracy);
  printf(
      "| N | levels | domains (double) | set-up s | iterations | s per product | solve s | set-up + solve s | "
      "whole fit s | GB | residual | products | largest residual | factors s |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  row rows[MOST];
  for (size_t i = 0; i < count; i++)
    if (sizes[i] > 10 && measure(ctx, sizes[i], order, accuracy, dense, &rows[done])) print_row(&rows[done++]);
  if (done > 1) printf("\nSet-up and solve grow as N^%.2f.\n", exponent(rows, done));
  batten_context_free(ctx);
  return done == 0;
}
