/* For compare_scipy.py: reads "n m smoothing accuracy N Q", N rows of coordinates and value, and Q rows of
 * coordinates; prints U at the Q points. smoothing is SciPy's: in the points' own unit, not in the unit box. accuracy
 * 0: by factors; above: by iteration to that, and U by fast sums. */
#include <batten/batten.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static int read_numbers(double *out, size_t count) {
  for (size_t i = 0; i < count; i++)
    if (scanf("%lf", out + i) != 1) return 0;
  return 1;
}

/* batten adds its rho in the unit box, whose size the first fit tells: K scales with its power 2m - n. */
static batten_status fit(batten_context *ctx, const batten_spline_data *data, unsigned m, double smoothing,
                         double accuracy, batten_spline **out) {
  batten_spline_options o = batten_spline_options_default();
  o.m = m;
  if (accuracy > 0) o.saddle.method = BATTEN_SADDLE_ITERATIVE, o.saddle.accuracy = accuracy;
  if (smoothing == 0) return batten_spline_fit(ctx, data, &o, out, NULL);
  batten_spline *plain = NULL;
  batten_status status = batten_spline_fit(ctx, data, &o, &plain, NULL);
  if (status < 0) return status;
  batten_spline_parts parts;
  batten_spline_get_parts(plain, &parts);
  o.smoothing = smoothing / pow(parts.scale, 2.0 * m - data->n);
  batten_spline_free(plain);
  return batten_spline_fit(ctx, data, &o, out, NULL);
}

static batten_status evaluate(batten_context *ctx, batten_spline *s, double accuracy, size_t count, const double *at,
                              double *out) {
  if (!(accuracy > 0)) return batten_spline_evaluate(ctx, s, count, at, out, NULL, NULL);
  batten_spline_evaluator *e = NULL;
  batten_status status = batten_spline_evaluator_new(ctx, s, 0.1 * accuracy, &e);
  if (status >= 0) status = batten_spline_evaluator_evaluate(ctx, e, count, at, out, NULL, NULL);
  batten_spline_evaluator_free(e);
  return status;
}

int main(void) {
  unsigned n, m;
  size_t count, queries;
  double smoothing, accuracy;
  if (scanf("%u %u %lf %lf %zu %zu", &n, &m, &smoothing, &accuracy, &count, &queries) != 6 || n < 1 || n > 3)
    return 2;
  double *rows = malloc(count * (n + 1) * sizeof *rows), *points = malloc(count * n * sizeof *points);
  double *values = malloc(count * sizeof *values), *at = malloc(queries * n * sizeof *at);
  double *result = malloc(queries * sizeof *result);
  if (!rows || !points || !values || !at || !result) return 1;
  if (!read_numbers(rows, count * (n + 1)) || !read_numbers(at, queries * n)) return 2;
  for (size_t i = 0; i < count; i++) {
    for (unsigned c = 0; c < n; c++) points[i * n + c] = rows[i * (n + 1) + c];
    values[i] = rows[i * (n + 1) + n];
  }

  batten_context *ctx = NULL;
  if (batten_context_new(NULL, &ctx) < 0) return 1;
  batten_spline_data data = batten_spline_data_default();
  data.n = n, data.count = count, data.points = points, data.values = values;
  batten_spline *spline = NULL;
  batten_status status = fit(ctx, &data, m, smoothing, accuracy, &spline);
  if (status >= 0) status = evaluate(ctx, spline, accuracy, queries, at, result);
  if (status < 0) fprintf(stderr, "%s\n", batten_error(ctx));
  for (size_t i = 0; status >= 0 && i < queries; i++) printf("%.17g\n", result[i]);
  batten_spline_free(spline);
  batten_context_free(ctx);
  free(rows), free(points), free(values), free(at), free(result);
  return status < 0;
}
