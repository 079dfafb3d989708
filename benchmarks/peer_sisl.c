/* SISL's data reduction beside batten's fits: the cubic spline with as few knots as it finds within a tolerance of
 * the points [Lyche, Morken 1987]. SISL has no least squares for knots that are given. peer-sisl SCENE CURVE SECONDS
 * files as contour_fits.c has them; where SISL finds nothing that is said */
#include <sisl.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { HEAD = 8, REPEATS_MAX = 25 };

static double now(void) {
  struct timespec t;
  timespec_get(&t, TIME_UTC);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int by_value(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

int main(int argc, char **argv) {
  double head[HEAD], times[REPEATS_MAX];
  FILE *file = argc == 4 ? fopen(argv[1], "rb") : NULL;
  if (!file || fread(head, sizeof *head, HEAD, file) != HEAD) {
    fprintf(stderr, "peer-sisl: SCENE CURVE SECONDS\n");
    return 1;
  }
  size_t count = (size_t)head[0];
  int status = 0;
  double *data = malloc(3 * count * sizeof *data), *errors = malloc(2 * sizeof *errors);
  if (!data || !errors || fread(data, sizeof *data, 3 * count, file) != 3 * count) return 1;
  fclose(file);
  double tolerance[2] = {head[6], head[6]}, seconds = strtod(argv[3], NULL), begin = now();
  SISLCurve *curve = NULL;
  int fits = 0;
  while (status >= 0 && (fits == 0 || (fits < REPEATS_MAX && now() - begin < seconds))) {
    if (curve) freeCurve(curve);
    curve = NULL;
    double start = now();
    s1961(data + count, (int)count, 2, 3, data, tolerance, 0, 0, 1, 0, 10, (int)head[1] + 1, &curve, errors, &status);
    times[fits++] = now() - start;
  }
  if (status < 0 || !curve) {
    fprintf(stderr, "SISL: status %d\n", status);
    return 1;
  }
  qsort(times, (size_t)fits, sizeof *times, by_value);
  double out[5] = {times[fits / 2], fits, 0, curve->ik - 1, curve->in + curve->ik};
  size_t knots = (size_t)(curve->in + curve->ik), points = 2 * (size_t)curve->in;
  file = fopen(argv[2], "wb");
  int good = file && fwrite(out, sizeof *out, 5, file) == 5 &&
             fwrite(curve->et, sizeof(double), knots, file) == knots &&
             fwrite(curve->ecoef, sizeof(double), points, file) == points;
  if (file && fclose(file) != 0) good = 0;
  freeCurve(curve);
  free(errors);
  free(data);
  return good ? 0 : 1;
}
