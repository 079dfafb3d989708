/* Planar curves of every kind for compare_vtk_curves.py: curves.vtu, curves.vtp, curves.vtk, curves.csv and
 * curves.svg, and what batten says of them at places in curves.places. On stdout a line each: degree, closed, spans.
 * write_curves FOLDER */
#include <batten/exchange.h>

#include <stdio.h>

#include "curve_cases.h"
#include "curve_places.h"

int main(int argc, char **argv) {
  static const char *const extensions[] = {"vtu", "vtp", "vtk", "csv", "svg"};
  batten_context *ctx = NULL;
  if (argc != 2 || batten_context_new(NULL, &ctx) < 0) return 1;
  batten_status st = BATTEN_OK;
  batten_curve *curves[CURVE_CASES] = {NULL};
  batten_plane planes[CURVE_CASES];
  char path[600];
  snprintf(path, sizeof path, "%s/curves.places", argv[1]);
  FILE *file = fopen(path, "w");
  if (!file) st = BATTEN_E_IO;
  for (size_t i = 0; i < CURVE_CASES && st >= 0; i++) {
    planes[i] = curve_cases[i].plane;
    st = curve_case_make(ctx, &curve_cases[i], &curves[i]);
    if (st >= 0 && !curve_places_put(ctx, curves[i], &planes[i], 1, file)) st = BATTEN_E_IO;
    printf("%u %d %zu\n", curve_cases[i].degree, curve_cases[i].closed, curve_cases[i].spans);
  }
  if (file && fclose(file)) st = BATTEN_E_IO;
  for (size_t i = 0; i < sizeof extensions / sizeof extensions[0] && st >= 0; i++) {
    batten_write_curves_options o = batten_write_curves_options_default();
    o.planes = planes;
    o.tolerance = 1e-3;
    snprintf(path, sizeof path, "%s/curves.%s", argv[1], extensions[i]);
    st = batten_write_curves(ctx, CURVE_CASES, (const batten_curve *const *)curves, &o, path);
  }
  if (st < 0) fprintf(stderr, "%s: %s\n", batten_status_name(st), batten_error(ctx));
  for (size_t i = 0; i < CURVE_CASES; i++) batten_curve_free(curves[i]);
  batten_context_free(ctx);
  return st < 0;
}
