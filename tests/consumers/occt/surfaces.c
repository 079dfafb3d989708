/* Surfaces of every kind as STEP and IGES files, beside each what batten says of it at places, and on stdout the
 * lines of the manifest that judge.cpp reads: "surface FILE PLACES EDGES CLOSED AREA". surfaces FOLDER */
#include <batten/exchange.h>

#include <stdio.h>

#include "surface_places.h"
#include "surface_sides.h"

typedef struct batch {
  batten_context *ctx;
  const char *folder;
  bool failed;
} batch;

static bool done(batch *b, batten_status st, const char *what) {
  if (st >= 0) return true;
  fprintf(stderr, "%s: %s: %s\n", what, batten_status_name(st), batten_error(b->ctx));
  b->failed = true;
  return false;
}

static void write_files(batch *b, const surface_side_case *shape) {
  batten_surface *surface = NULL;
  batten_surface_measures m;
  char path[600], places[620];
  if (!done(b, surface_sides_make(b->ctx, shape, &surface), shape->name)) return;
  if (done(b, batten_surface_measure(b->ctx, surface, &m), shape->name))
    for (int i = 0; i < 4; i++) {
      batten_write_surface_options o = batten_write_surface_options_default();
      double scale = i >= 2 ? 10 : 1;
      o.unit = i >= 2 ? BATTEN_UNIT_CM : BATTEN_UNIT_MM;
      o.schema = i >= 2 ? BATTEN_STEP_AP242 : BATTEN_STEP_AP214;
      snprintf(path, sizeof path, "%s/%s-%s.%s", b->folder, shape->name, i >= 2 ? "cm" : "mm",
               i % 2 ? "igs" : "step");
      snprintf(places, sizeof places, "%s.places", path);
      if (shape->iges_only && i % 2 == 0) continue;
      if (!done(b, batten_write_surface(b->ctx, surface, &o, path), path)) break;
      if (!surface_places_write(b->ctx, surface, scale, places)) b->failed = true;
      printf("surface %s %s %u %d %.17g\n", path, places, shape->edges, shape->uses == 2 * shape->edges,
             scale * scale * m.area);
    }
  batten_surface_free(surface);
}

int main(int argc, char **argv) {
  batch b = {.folder = argc > 1 ? argv[1] : "."};
  if (batten_context_new(NULL, &b.ctx) < 0) return 1;
  for (size_t i = 0; i < SURFACE_SIDE_CASES; i++) write_files(&b, &surface_side_cases[i]);
  batten_context_free(b.ctx);
  return b.failed;
}
