/* A spline of many real points by iteration: Phobos, or a made body on the same grid where the data are not at hand.
 * The grid crowds at the poles, 1 : 100 in density, and the surface is rough. */
#include "phobos.h"
#include "spline_cloud.h"

enum { HELD_OUT = 2000, ROWS = 200 };

/* Ellipsoid of Phobos's size, 1 at its surface, and the length of its gradient. */
static double carrier(const double *x, double *slope) {
  const double axes[3] = {13, 11.4, 9.2};
  double sum = 0, square = 0;
  for (int c = 0; c < 3; c++) {
    sum += x[c] * x[c] / (axes[c] * axes[c]);
    square += pow(2 * x[c] / (axes[c] * axes[c]), 2);
  }
  *slope = sqrt(square);
  return sum;
}

/* Root mean square of s - f and the largest over points first .. last, as distances. Sums are direct. */
static double distance(batten_context *ctx, const batten_spline *s, const phobos *p, size_t first, size_t count,
                       double *largest) {
  double *u = malloc(count * sizeof *u), square = 0;
  T_OK(batten_spline_evaluate(ctx, s, count, p->points + 3 * first, u, NULL, NULL), ctx);
  *largest = 0;
  for (size_t i = 0; i < count; i++) {
    double slope, off = carrier(p->points + 3 * (first + i), &slope) - u[i];
    square += off * off / (slope * slope);
    *largest = fmax(*largest, fabs(off / slope));
  }
  free(u);
  return sqrt(square / (double)count);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  phobos p = phobos_points();
  if (!p.real) t_skip("Phobos", "no ../shared/data: a made body in its place");
  phobos_draw(&p, 3);
  size_t count = p.count - HELD_OUT;
  double *values = malloc(count * sizeof *values), slope, largest, range = 0;
  for (size_t i = 0; i < count; i++) {
    values[i] = carrier(p.points + 3 * i, &slope);
    range = fmax(range, fabs(values[i] - 1));
  }
  batten_spline_data d = batten_spline_data_default();
  d.n = 3;
  d.count = count;
  d.points = p.points;
  d.values = values;
  batten_spline_options o = options_of(2, BATTEN_SADDLE_ITERATIVE, 1e-6);
  o.loo_samples = 0;
  batten_spline_info info = {0};
  batten_spline *s = fit(ctx, &d, &o, &info);
  const batten_saddle_info *i = &info.saddle;
  printf("# %zu points: %u levels, %u iterations, products %.0e, residual %.1e (2-norm) %.1e (largest)\n", count,
         i->levels, i->iterations, i->products_accuracy, i->residual_rows, info.residual_max);
  T_RATIO(i->iterations, 8, "iterations to 1e-6");
  T_RATIO(i->residual_rows, 1e-6, "residual in rows summed directly");
  double rms = distance(ctx, s, &p, 0, ROWS, &largest);
  T_RATIO(rms, 2e-6, "km off %d of the points, evaluated directly; the largest %.1e", ROWS, largest);
  rms = distance(ctx, s, &p, count, HELD_OUT, &largest);
  T_RATIO(rms, 0.01, "km (root mean square) off %d points that were left out; the largest %.2f", HELD_OUT, largest);
  T_CHECK(range > 0.1, "values differ by %.2f from a constant", range);
  batten_spline_free(s);
  free(values);
  free(p.points);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left behind");
  batten_context_free(ctx);
  return t_done();
}
