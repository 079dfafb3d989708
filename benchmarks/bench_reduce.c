/* Fewer centres than points, as a Markdown table: tolerances of 1e-2, 1e-3, 1e-4 of the diagonal of the points' box
 * as a distance from the surface, or of the range of the values; against the fit of all points. "gain" is the time of
 * 100,000 direct evaluations by the full fit over that by the reduced one. Usage: bench-reduce [--full N] [--least
 * TOLERANCE] [--kind NAME] [N]; default: full fits up to 40000 points, 1e-4, all kinds (ball, pairs, values), N =
 * 20000.
 *
 *   ball    bumpy sphere, kernel r, the function of a ball
 *   pairs   the same sphere with points off it to both sides, 3 N in all, kernel r^3; these may be missed by half
 *   values  depth below the surface, in part of the radius, along lines into it (as drill holes have it), kernel r */
#include "tap.h"

#include <batten/batten.h>
#include <unistd.h>

typedef struct data {
  const char *name;
  size_t count, distances; /* of the first so many the tolerance is a distance */
  unsigned order;
  double *points, *values, *gradients, *tolerances;
  double unit, off; /* what tolerances are of; tolerance off the surface, 0: as on it */
} data;

static double radius_at(double z, double a) { return 1 + 0.1 * sin(5 * a) * (1 - z * z) + 0.05 * cos(9 * z); }

static bool take(data *d, const char *name, size_t count, size_t distances, unsigned order) {
  *d = (data){.name = name, .count = count, .distances = distances, .order = order};
  d->points = malloc(count * 8 * sizeof(double));
  if (!d->points) return false;
  d->values = d->points + 3 * count;
  d->gradients = d->values + count;
  d->tolerances = d->gradients + 3 * count;
  return true;
}

static double diagonal(size_t count, const double *x) {
  double square = 0;
  for (size_t k = 0; k < 3; k++) {
    double least = x[k], most = x[k];
    for (size_t i = 0; i < count; i++) {
      least = fmin(least, x[3 * i + k]);
      most = fmax(most, x[3 * i + k]);
    }
    square += (most - least) * (most - least);
  }
  return sqrt(square);
}

/* Values of F = 1 - |x|^2, or of 1 - |x| where a spline reproduces that. */
static void set_field(data *d, size_t i) {
  const double *x = d->points + 3 * i, r = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
  d->values[i] = d->order > 2 ? 1 - r : 1 - r * r;
  for (size_t k = 0; k < 3; k++) d->gradients[3 * i + k] = d->order > 2 ? -x[k] / r : -2 * x[k];
}

static bool make_data(const char *kind, size_t n, data *d) {
  const bool pairs = !strcmp(kind, "pairs"), lines = !strcmp(kind, "values");
  uint64_t seed = 1;
  if (!take(d, kind, pairs ? 3 * n : n, lines ? 0 : n, pairs ? 3 : 2)) return false;
  for (size_t i = 0; i < n; i++) {
    double z = 2 * t_uniform(&seed) - 1, a = 8 * atan(1) * t_uniform(&seed), s = sqrt(1 - z * z), r = radius_at(z, a);
    double *x = d->points + 3 * i;
    if (lines && i % 100) { /* a hundred places on a line, along the direction of the first */
      const double *first = d->points + 3 * (i - i % 100);
      const double t = 0.5 * (double)(i % 100) / 100;
      for (size_t k = 0; k < 3; k++) x[k] = first[k] * (1 - t);
      d->values[i] = t;
      continue;
    }
    x[0] = r * s * cos(a), x[1] = r * s * sin(a), x[2] = r * z;
    set_field(d, i);
    if (lines) d->values[i] = 0;
    for (int side = 0; side < 2 && pairs; side++) {
      const size_t at = n + 2 * i + (size_t)side;
      for (size_t k = 0; k < 3; k++) d->points[3 * at + k] = x[k] * (side ? 1.01 : 0.99);
      set_field(d, at);
      d->values[at] += side ? 0.01 * r : -0.01 * r; /* U = F - f, f = -+ 0.01 r */
    }
  }
  d->unit = lines ? 1 : diagonal(n, d->points);
  d->off = pairs ? 0.005 : 0;
  if (lines) {
    double least = d->values[0], most = least;
    for (size_t i = 0; i < n; i++) least = fmin(least, d->values[i]), most = fmax(most, d->values[i]);
    d->unit = most - least;
  }
  return true;
}

enum { PLACES = 100000 };

static double evaluation_time(batten_context *ctx, const batten_spline *s, const data *d) {
  double *u = malloc(PLACES * 4 * sizeof *u), *x = u + PLACES, start;
  if (!u || !s) return NAN;
  for (size_t i = 0; i < (size_t)PLACES * 3; i++) x[i] = d->points[i % (3 * d->count)] * 1.001;
  start = batten_now();
  batten_status st = batten_spline_evaluate(ctx, s, PLACES, x, u, NULL, NULL);
  start = batten_now() - start;
  free(u);
  return st >= 0 ? start : NAN;
}

static void reduce(batten_context *ctx, const data *d, const batten_spline_data *all, double tolerance,
                   double full_fit, double full_evaluation) {
  batten_spline_options o = batten_spline_options_default();
  batten_spline_reduce_options r = batten_spline_reduce_options_default();
  batten_spline_reduce_info i = {0};
  batten_spline *s = NULL;
  o.m = d->order;
  for (size_t k = 0; k < d->count; k++)
    d->tolerances[k] = k >= d->distances && d->off > 0 ? d->off : tolerance * d->unit;
  r.tolerances = d->tolerances;
  r.distance_count = d->distances;
  r.field_gradients = d->gradients;
  batten_status st = batten_spline_fit_reduced(ctx, all, &o, &r, &s, &i);
  if (st != BATTEN_OK) printf("%s, %g: %s\n", d->name, tolerance, batten_error(ctx));
  if (st >= 0)
    printf("| %s %zu | %.0e | %zu | %u | %.2f | %.2f | %.2f | %.2f | %.2e | %.2e | %zu | %.2f | %.1f |\n", d->name,
           d->count, tolerance, i.centers, i.rounds, i.time_total_s, i.time_fit_s, i.time_evaluate_s,
           i.time_certify_s, i.error_certified / d->unit, i.error_rms / d->unit, i.certified_points, full_fit,
           full_evaluation / evaluation_time(ctx, s, d));
  fflush(stdout);
  batten_spline_free(s);
}

static void measure(batten_context *ctx, const char *kind, size_t n, size_t full, double least) {
  data d;
  if (!make_data(kind, n, &d)) return;
  batten_spline_data all = batten_spline_data_default();
  batten_spline_options o = batten_spline_options_default();
  batten_spline *s = NULL;
  double full_fit = NAN, full_evaluation = NAN;
  all.count = d.count, all.points = d.points, all.values = d.values;
  o.m = d.order;
  o.loo_samples = 0;
  if (d.count <= full) {
    double start = batten_now();
    if (batten_spline_fit(ctx, &all, &o, &s, NULL) >= 0) full_fit = batten_now() - start;
    full_evaluation = evaluation_time(ctx, s, &d);
    batten_spline_free(s);
  }
  for (double tolerance = 1e-2; tolerance > 0.99 * least; tolerance /= 10)
    reduce(ctx, &d, &all, tolerance, full_fit, full_evaluation);
  free(d.points);
}

int main(int argc, char **argv) {
  static const char *const kinds[] = {"ball", "pairs", "values"};
  const char *kind = NULL;
  size_t n = 20000, full = 40000;
  double least = 1e-4;
  for (int i = 1; i < argc; i++) {
    if (!strcmp(argv[i], "--full") && i + 1 < argc)
      full = strtoul(argv[++i], NULL, 10);
    else if (!strcmp(argv[i], "--least") && i + 1 < argc)
      least = strtod(argv[++i], NULL);
    else if (!strcmp(argv[i], "--kind") && i + 1 < argc)
      kind = argv[++i];
    else
      n = strtoul(argv[i], NULL, 10);
  }
  batten_context_options o = batten_context_options_default();
  o.threads = (unsigned)sysconf(_SC_NPROCESSORS_ONLN);
  batten_context *ctx = NULL;
  if (n < 200 || batten_context_new(&o, &ctx) < 0) return 1;
  char blas[256];
  batten_blas_describe(blas, sizeof blas);
  printf("batten %s, %u threads, BLAS: %s, %u threads\n\n", batten_version(), o.threads, blas, batten_blas_threads());
  printf(
      "| data, points | tolerance | centres | rounds | time s | fits s | errors s | final check s | error, certified "
      "| "
      "rms | certified points | all points s | gain |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++)
    if (!kind || !strcmp(kind, kinds[k])) measure(ctx, kinds[k], n, full, least);
  batten_context_free(ctx);
  return 0;
}
