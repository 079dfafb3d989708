/* Lofts as STEP and IGES files, whole and patch by patch, beside each what batten says of it at places, and on stdout
 * the lines of the manifest that judge.cpp reads: "surface FILE PLACES EDGES CLOSED AREA". lofts FOLDER */
#include <batten/exchange.h>
#include <batten/loft.h>
#include <stdio.h>

#include "loft_scenes.h"
#include "surface_places.h"

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

/* An open loft has four edges; of a closed one two sides are one seam. */
static void write_files(batch *b, const batten_surface *surface, const char *name, bool closed) {
  batten_surface_measures m;
  char path[600], places[620];
  if (!done(b, batten_surface_measure(b->ctx, surface, &m), name)) return;
  for (int i = 0; i < 2; i++) {
    batten_write_surface_options o = batten_write_surface_options_default();
    snprintf(path, sizeof path, "%s/loft-%s.%s", b->folder, name, i ? "igs" : "step");
    snprintf(places, sizeof places, "%s.places", path);
    if (!done(b, batten_write_surface(b->ctx, surface, &o, path), path)) return;
    if (!surface_places_write(b->ctx, surface, 1, places)) b->failed = true;
    printf("surface %s %s %d 0 %.17g\n", path, places, closed ? 3 : 4, m.area);
  }
}

static void write_loft(batch *b, const loft_rule *rule, const char *name) {
  loft_scene s = loft_scene_make(b->ctx, rule);
  batten_loft *loft = NULL;
  batten_surface *whole = NULL, *patch = NULL;
  char patch_name[80];
  batten_status st =
      batten_loft_build(b->ctx, s.count, (const batten_curve *const *)s.contours, s.heights, NULL, &loft, NULL, NULL);
  if (done(b, st, name) && done(b, batten_loft_surface(b->ctx, loft, &whole), name))
    write_files(b, whole, name, rule->closed);
  snprintf(patch_name, sizeof patch_name, "%s-patch", name);
  if (loft && done(b, batten_loft_patch(b->ctx, loft, s.count / 2, &patch), name))
    write_files(b, patch, patch_name, rule->closed);
  batten_surface_free(patch);
  batten_surface_free(whole);
  batten_loft_free(loft);
  loft_scene_free(&s);
}

int main(int argc, char **argv) {
  static const struct {
    const char *name;
    loft_rule rule;
  } lofts[] = {
      {"paper", {.kind = LOFT_PAPER, .degree = 2, .smoothness = 1}},
      {"open", {.degree = 3, .smoothness = 2, .contours = 5, .spans = 8, .decades = 1, .rotation = 0.4, .seed = 3}},
      {"bends",
       {.degree = 3, .smoothness = 2, .contours = 4, .spans = 9, .inflections = 2, .rotation = 0.3, .seed = 4}},
      {"closed",
       {.degree = 3, .smoothness = 2, .closed = true, .contours = 6, .spans = 9, .rotation = 0.4, .seed = 5}},
      {"high", {.degree = 5, .smoothness = 1, .contours = 4, .spans = 5, .rotation = 0.4, .seed = 6}},
      {"cone",
       {.kind = LOFT_CONE, .degree = 2, .smoothness = 1, .closed = true, .contours = 3, .spans = 8, .seed = 7}},
  };
  batch b = {.folder = argc > 1 ? argv[1] : "."};
  if (batten_context_new(NULL, &b.ctx) < 0) return 1;
  for (size_t i = 0; i < sizeof lofts / sizeof *lofts; i++) write_loft(&b, &lofts[i].rule, lofts[i].name);
  batten_context_free(b.ctx);
  return b.failed;
}
