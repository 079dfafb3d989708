/* For large_peers.py: one fit of a volume spline and its values, in a process whose memory is then batten's.
 * Usage: large-fits FILE METHOD M ACCURACY     FILE: doubles: dimension, N, Q, N rows of coordinates and value, Q
 * rows of coordinates. Writes the values at the N points and at the Q places to FILE.out, and prints the seconds of
 * the fit and of the values, the peak of resident memory in bytes, and what the fit says of itself. */
#include <batten/batten.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "peak.h"

static double *read_all(const char *path, size_t *count) {
  FILE *file = fopen(path, "rb");
  double *out = NULL;
  long bytes = -1;
  if (file && fseek(file, 0, SEEK_END) == 0) bytes = ftell(file);
  if (bytes > 0) out = malloc((size_t)bytes);
  *count = bytes > 0 ? (size_t)bytes / sizeof *out : 0;
  if (out) rewind(file);
  if (out && fread(out, sizeof *out, *count, file) != *count) free(out), out = NULL;
  if (file) fclose(file);
  return out;
}

/* Pairs of centre and place up to which values are summed directly, in some tenths of a second: less than operators
 * of fast sums take to make. */
static const double DIRECT_MOST = 3e8;

static batten_status values_at(batten_context *ctx, batten_spline *s, double accuracy, size_t terms, size_t count,
                               const double *places, double *out) {
  if ((double)terms * (double)count <= DIRECT_MOST)
    return batten_spline_evaluate(ctx, s, count, places, out, NULL, NULL);
  batten_spline_evaluator *e = NULL;
  batten_status status = batten_spline_evaluator_new(ctx, s, accuracy, &e);
  if (status >= 0) status = batten_spline_evaluator_evaluate(ctx, e, count, places, out, NULL, NULL);
  batten_spline_evaluator_free(e);
  return status;
}

int main(int argc, char **argv) {
  if (argc != 5) return 2;
  size_t read, n = 0, count = 0, queries = 0;
  double *all = read_all(argv[1], &read);
  if (all && read >= 3) n = (size_t)all[0], count = (size_t)all[1], queries = (size_t)all[2];
  if (n < 1 || n > 3 || read != 3 + count * (n + 1) + queries * n) return 2;
  double *points = malloc(count * n * sizeof *points), *values = malloc(count * sizeof *values);
  double *out = malloc(queries * sizeof *out);
  const double *places = all + 3 + count * (n + 1);
  if (!points || !values || !out) return 1;
  for (size_t i = 0; i < count; i++) {
    memcpy(points + n * i, all + 3 + i * (n + 1), n * sizeof *points);
    values[i] = all[3 + i * (n + 1) + n];
  }

  batten_context_options c = batten_context_options_default();
  c.threads = (unsigned)sysconf(_SC_NPROCESSORS_ONLN);
  batten_context *ctx = NULL;
  if (batten_context_new(&c, &ctx) < 0) return 1;
  batten_spline_data d = batten_spline_data_default();
  d.n = (unsigned)n, d.count = count, d.points = points, d.values = values;
  batten_spline_options o = batten_spline_options_default();
  o.m = (unsigned)strtoul(argv[3], NULL, 10);
  o.loo_samples = 0;
  for (int m = BATTEN_SADDLE_AUTO; m <= BATTEN_SADDLE_ITERATIVE; m++)
    if (!strcmp(argv[2], batten_saddle_method_name((batten_saddle_method)m)))
      o.saddle.method = (batten_saddle_method)m;
  o.saddle.accuracy = strtod(argv[4], NULL);
  batten_spline *s = NULL;
  batten_spline_info info;
  double start = batten_now();
  batten_status status = batten_spline_fit(ctx, &d, &o, &s, &info);
  double fitted = batten_now();
  double sums = fmin(fmax(0.01 * o.saddle.accuracy, 1e-12), 1e-3); /* finer than what an iteration leaves */
  if (status >= 0) status = values_at(ctx, s, sums, count, queries, places, out);
  double end = batten_now();
  if (status < 0) fprintf(stderr, "%s\n", batten_error(ctx));
  char path[4096];
  snprintf(path, sizeof path, "%s.out", argv[1]);
  FILE *file = status >= 0 ? fopen(path, "wb") : NULL;
  bool written = file && fwrite(out, sizeof *out, queries, file) == queries;
  if (file) written = fclose(file) == 0 && written;
  if (written)
    printf("%.9g %.9g %zu %s, %u iterations, residual %.1e\n", fitted - start, end - fitted, peak_resident(),
           batten_saddle_method_name(info.saddle.method), info.saddle.iterations, info.saddle.residual);
  batten_spline_free(s);
  batten_context_free(ctx);
  free(all), free(points), free(values), free(out);
  return !written;
}
