/* SISL's skinning beside batten's lofts: s1538, cubic across the contours, which knows nothing of their shape.
 *   peer-sisl-skin SCENE SURFACE SECONDS        files as in loft_files.h */
#include <sisl.h>
#include <string.h>
#include <time.h>

#include "loft_files.h"

static double now(void) {
  struct timespec t;
  timespec_get(&t, TIME_UTC);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* A contour in space. */
static SISLCurve *make_curve(const loft_contour_file *c, unsigned degree) {
  size_t count = c->knot_count - degree - 1;
  double *points = malloc(3 * count * sizeof *points), *knots = malloc(c->knot_count * sizeof *knots);
  SISLCurve *out = NULL;
  if (points && knots) {
    for (size_t j = 0; j < count; j++) {
      memcpy(points + 3 * j, c->points + 2 * j, 2 * sizeof *points);
      points[3 * j + 2] = c->height;
    }
    memcpy(knots, c->knots, c->knot_count * sizeof *knots);
    out = newCurve((int)count, (int)degree + 1, knots, points, 1, 3, 1);
  }
  free(points);
  free(knots);
  return out;
}

/* Points of SISL run faster in the first direction, ours in the second. */
static bool write_surface(const SISLSurf *surface, double seconds, size_t builds, size_t count,
                          const double *parameters, const char *path) {
  size_t nu = (size_t)surface->in1, nv = (size_t)surface->in2;
  double *points = malloc(3 * nu * nv * sizeof *points);
  if (!points) return false;
  for (size_t i = 0; i < nu; i++)
    for (size_t j = 0; j < nv; j++)
      memcpy(points + 3 * (i * nv + j), surface->ecoef + 3 * (j * nu + i), 3 * sizeof *points);
  loft_surface_file out = {.seconds = seconds,
                           .builds = builds,
                           .degree = {(unsigned)surface->ik1 - 1, (unsigned)surface->ik2 - 1},
                           .knot_count = {nu + (size_t)surface->ik1, nv + (size_t)surface->ik2},
                           .knots = {surface->et1, surface->et2},
                           .points = points,
                           .count = count,
                           .parameters = parameters};
  bool good = loft_surface_file_write(path, &out);
  free(points);
  return good;
}

int main(int argc, char **argv) {
  loft_scene_file s = {.count = 0};
  if (argc != 4 || !loft_scene_file_read(argv[1], &s)) {
    fprintf(stderr, "peer-sisl-skin: SCENE SURFACE SECONDS\n");
    return 1;
  }
  SISLCurve **curves = calloc(s.count, sizeof *curves);
  int *types = calloc(s.count, sizeof *types), status = curves && types ? 0 : -1;
  for (size_t i = 0; status >= 0 && i < s.count; i++) {
    types[i] = 1; /* an ordinary curve that the surface goes through */
    curves[i] = make_curve(&s.contours[i], s.degree);
    if (!curves[i]) status = -1;
  }
  double times[LOFT_REPEATS_MAX], *parameters = NULL, seconds = strtod(argv[3], NULL), begin = now();
  SISLSurf *surface = NULL;
  size_t builds = 0;
  while (status >= 0 && (builds == 0 || (builds < LOFT_REPEATS_MAX && now() - begin < seconds))) {
    if (surface) freeSurf(surface);
    free(parameters);
    surface = NULL;
    parameters = NULL;
    double start = now();
    /* open across the contours, order 4, parameters of the contours as they are */
    s1538((int)s.count, curves, types, 0, 1, 4, 0, &surface, &parameters, &status);
    times[builds++] = now() - start;
  }
  bool good = status >= 0 && surface;
  if (good) {
    qsort(times, builds, sizeof *times, loft_by_value);
    good = write_surface(surface, times[builds / 2], builds, s.count, parameters, argv[2]);
  } else {
    fprintf(stderr, "SISL: status %d\n", status);
  }
  if (surface) freeSurf(surface);
  free(parameters);
  for (size_t i = 0; curves && i < s.count; i++)
    if (curves[i]) freeCurve(curves[i]);
  free(curves);
  free(types);
  loft_scene_file_free(&s);
  return good ? 0 : 1;
}
