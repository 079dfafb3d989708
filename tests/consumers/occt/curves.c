/* Planar curves of every kind as STEP and IGES files, beside each what batten says of them at places, and on stdout
 * the lines of the manifest that judge.cpp reads: "curves FILE PLACES COUNT". curves FOLDER */
#include <batten/exchange.h>

#include <stdio.h>

#include "curve_cases.h"
#include "curve_places.h"

typedef struct batch {
  batten_context *ctx;
  const char *folder;
  batten_curve *curves[CURVE_CASES];
  batten_plane planes[CURVE_CASES], flat[CURVE_CASES];
} batch;

/* Files of `count` curves from `first` on; variants: in the plane or in space, mm or cm, AP214 or AP242. */
static batten_status write_files(batch *b, const char *name, size_t first, size_t count) {
  for (int i = 0; i < 4; i++) {
    char path[600], places[620];
    batten_write_curves_options o = batten_write_curves_options_default();
    const batten_plane *planes = (i >= 2 ? b->planes : b->flat) + first;
    o.planes = i >= 2 ? planes : NULL;
    o.unit = i >= 2 ? BATTEN_UNIT_CM : BATTEN_UNIT_MM;
    o.schema = i >= 2 ? BATTEN_STEP_AP242 : BATTEN_STEP_AP214;
    snprintf(path, sizeof path, "%s/%s-%s.%s", b->folder, name, i >= 2 ? "cm" : "mm", i % 2 ? "igs" : "step");
    snprintf(places, sizeof places, "%s.places", path);
    batten_status st = batten_write_curves(b->ctx, count, (const batten_curve *const *)b->curves + first, &o, path);
    if (st < 0) return st;
    FILE *file = fopen(places, "w");
    bool good = file != NULL;
    for (size_t k = 0; good && k < count; k++)
      good = curve_places_put(b->ctx, b->curves[first + k], &planes[k], i >= 2 ? 10 : 1, file);
    if (file) good = fclose(file) == 0 && good;
    if (!good) return BATTEN_E_IO;
    printf("curves %s %s %zu\n", path, places, count);
  }
  return BATTEN_OK;
}

int main(int argc, char **argv) {
  batch b = {.folder = argc > 1 ? argv[1] : "."};
  if (batten_context_new(NULL, &b.ctx) < 0) return 1;
  batten_status st = BATTEN_OK;
  for (size_t i = 0; i < CURVE_CASES && st >= 0; i++) {
    b.planes[i] = curve_cases[i].plane;
    b.flat[i] = (batten_plane){{0}, {{1, 0, 0}, {0, 1, 0}}};
    st = curve_case_make(b.ctx, &curve_cases[i], &b.curves[i]);
  }
  if (st >= 0) st = write_files(&b, "curves", 0, CURVE_CASES);
  if (st >= 0) st = write_files(&b, "curve", CURVE_CASES - 2, 1);
  if (st < 0) fprintf(stderr, "%s: %s\n", batten_status_name(st), batten_error(b.ctx));
  for (size_t i = 0; i < CURVE_CASES; i++) batten_curve_free(b.curves[i]);
  batten_context_free(b.ctx);
  return st < 0;
}
