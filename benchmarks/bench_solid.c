/* The paper's Table 2 and beyond: matrix formation, solution, 10,000 surface nodes, on random points of Phobos, with
 * the error over the points that were not used. [Savchenko et al. 1995, section 5.1] Usage: bench-solid [N ...]
 * default 184 377 628 942 2000 4000 8000 16000 */
#include "phobos.h"

#include <batten/batten.h>
#include <unistd.h>

enum { NODES = 10000, SEED = 1 };

typedef struct row {
  size_t n;
  double form, solve, nodes;
  batten_saddle_info saddle;
  phobos_error error;
} row;

static int compare(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

static double median(double *v, size_t n) {
  qsort(v, n, sizeof *v, compare);
  return v[n / 2];
}

/* 10,000 nodes just off the surface: data points scaled by 0.9 .. 1.1. */
static void make_nodes(const phobos *p, double *nodes) {
  uint64_t seed = SEED;
  for (size_t i = 0; i < NODES; i++) {
    double s = 0.9 + 0.2 * t_uniform(&seed);
    for (int c = 0; c < 3; c++) nodes[3 * i + (size_t)c] = s * p->points[3 * (i % p->count) + (size_t)c];
  }
}

static bool measure(batten_context *ctx, const phobos *p, size_t n, const double *nodes, row *out) {
  size_t repeats = n <= 2000 ? 5 : n <= 8000 ? 3 : 1;
  double form[5], solve[5], evaluate[5], *values = malloc(NODES * sizeof *values);
  bool ok = true;
  out->n = n;
  for (size_t k = 0; ok && k < repeats; k++) {
    batten_solid_options o = batten_solid_options_default();
    o.orientation = BATTEN_ORIENT_NEVER; /* the paper's method: the carrier alone */
    o.spline.loo_samples = 0;
    o.spline.saddle.method = n < 2000 ? BATTEN_SADDLE_CHOLESKY : BATTEN_SADDLE_CHOLESKY_MIXED;
    batten_solid *solid = NULL;
    batten_solid_info info;
    batten_status status = batten_solid_fit(ctx, 3, n, p->points, &o, &solid, &info);
    if (status < 0) {
      printf("N = %zu: %s\n", n, batten_error(ctx));
      ok = false;
      break;
    }
    out->saddle = info.spline.saddle;
    form[k] = info.spline.saddle.time_assemble_s;
    solve[k] = info.spline.saddle.time_project_s + info.spline.saddle.time_factor_s + info.spline.saddle.time_solve_s;
    double start = batten_now();
    batten_solid_evaluate(ctx, solid, NODES, nodes, values, NULL, NULL);
    evaluate[k] = batten_now() - start;
    if (k + 1 == repeats) {
      batten_field field = batten_solid_field(solid);
      out->error = phobos_errors(ctx, &field, p, n);
    }
    batten_solid_free(solid);
  }
  free(values);
  if (!ok) return false;
  out->form = median(form, repeats);
  out->solve = median(solve, repeats);
  out->nodes = median(evaluate, repeats);
  return true;
}

/* Slope of log(time) over log(N) by least squares. */
static double exponent(const row *rows, size_t count, size_t n_min) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0, m = 0;
  for (size_t i = 0; i < count; i++) {
    if (rows[i].n < n_min) continue;
    double x = log((double)rows[i].n), y = log(rows[i].solve);
    sx += x, sy += y, sxx += x * x, sxy += x * y, m++;
  }
  return m < 2 ? NAN : (m * sxy - sx * sy) / (m * sxx - sx * sx);
}

int main(int argc, char **argv) {
  static const size_t sizes[] = {184, 377, 628, 942, 2000, 4000, 8000, 16000};
  static const double paper[4][3] = {{3, 6, 38}, {11, 42, 70}, {30, 192, 113}, {66, 633, 167}};
  size_t count = argc > 1 ? (size_t)argc - 1 : sizeof sizes / sizeof *sizes;
  row rows[32] = {0};
  if (count > 32) count = 32;
  phobos p = phobos_points();
  phobos_draw(&p, SEED);
  double diameter = phobos_diameter(&p), *nodes = malloc(NODES * 3 * sizeof *nodes);
  make_nodes(&p, nodes);

  batten_context_options o = batten_context_options_default();
  o.threads = (unsigned)sysconf(_SC_NPROCESSORS_ONLN);
  batten_context *ctx = NULL;
  if (batten_context_new(&o, &ctx) < 0) return 1;
  char blas[256];
  batten_blas_describe(blas, sizeof blas);
  printf("batten %s, %u threads, BLAS: %s, %u threads\n", batten_version(), o.threads, blas, batten_blas_threads());
  printf("%s, %zu points, largest diameter %.2f km, seed %d\n\n", p.real ? "Phobos (Thomas)" : "bumpy ellipsoid",
         p.count, diameter, SEED);
  printf(
      "| N | formation s | solution s | 10,000 nodes s | paper (6 transputers) | method | steps | residual | mean "
      "error %% of "
      "mean radius | max error %% of diameter |\n|---|---|---|---|---|---|---|---|---|---|\n");
  size_t done = 0;
  for (size_t i = 0; i < count; i++) {
    size_t n = argc > 1 ? (size_t)strtoul(argv[i + 1], NULL, 10) : sizes[i];
    if (n < 10 || n > p.count || !measure(ctx, &p, n, nodes, &rows[done])) continue;
    const row *r = &rows[done++];
    char old[64] = "";
    for (size_t k = 0; k < 4; k++)
      if (sizes[k] == n) snprintf(old, sizeof old, "%g / %g / %g", paper[k][0], paper[k][1], paper[k][2]);
    printf("| %zu | %.4f | %.4f | %.4f | %s | %s | %u | %.1e | ", n, r->form, r->solve, r->nodes, old,
           batten_saddle_method_name(r->saddle.method), r->saddle.refinements, r->saddle.residual);
    if (p.count - n >= 100)
      printf("%.3f | %.2f |\n", 100 * r->error.mean / r->error.mean_radius, 100 * r->error.max / diameter);
    else
      printf("- | - |\n");
    fflush(stdout);
  }
  printf("\nSolution time grows as N^%.2f for N >= 2000.\n", exponent(rows, done, 2000));
  batten_context_free(ctx);
  free(nodes);
  free(p.points);
  return done == 0;
}
