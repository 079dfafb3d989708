/* How far a loft through the slices of a heart is from the volume spline of the same slices, as a picture for the
 * manual. Usage: loft-distance PICTURE.png, with BATTEN_SHARED as for tests; exits with 3 without the data. */
#include <batten/exchange.h>
#include <batten/loft.h>
#include <stdio.h>

#include "loft_slices.h"

enum { EVERY = 4 };

static batten_status make_loft(batten_context *ctx, const stack *s, batten_loft **out) {
  batten_curve *curves[SLICES] = {NULL};
  batten_loft_match_options m = batten_loft_match_options_default();
  m.fit.closed = s->closed;
  batten_status st = batten_loft_match(ctx, s->count, s->starts, s->points[0], &m, curves, NULL);
  if (st >= 0)
    st = batten_loft_build(ctx, s->count, (const batten_curve *const *)curves, s->heights, NULL, out, NULL, NULL);
  for (size_t i = 0; i < s->count; i++) batten_curve_free(curves[i]);
  return st;
}

/* Of the loft's vertices from the solid, positive outside; first order, as f / |gradient|. */
static batten_status measure(batten_context *ctx, const stack *s, const batten_mesh *mesh, double *distances) {
  size_t count = batten_mesh_vertex_count(mesh);
  double *gradients = batten_alloc_array(ctx, count, 3 * sizeof *gradients);
  batten_solid *solid = slices_solid(ctx, s, EVERY);
  batten_status st = !gradients ? BATTEN_E_NOMEM : !solid ? BATTEN_E_SINGULAR : BATTEN_OK;
  if (st >= 0) st = batten_solid_evaluate(ctx, solid, count, batten_mesh_vertices(mesh), distances, gradients, NULL);
  for (size_t k = 0; st >= 0 && k < count; k++) {
    const double *g = gradients + 3 * k;
    distances[k] /= -sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
  }
  batten_solid_free(solid);
  batten_free(ctx, gradients);
  return st;
}

static batten_status draw(batten_context *ctx, const batten_mesh *mesh, const double *distances, const char *path) {
  batten_picture_options sides[2], whole = batten_picture_options_default();
  batten_picture_panel panels[2];
  for (int k = 0; k < 2; k++) {
    batten_picture_options *o = &sides[k];
    *o = batten_picture_options_default();
    o->azimuth_deg = k == 0 ? 35 : 215;
    o->colors = distances;
    o->color_map = BATTEN_MAP_PARTED;
    o->color_lower = -1.5;
    o->color_upper = 1.5;
    o->color_label = "mm outside";
    o->no_color_bar = k == 0;
    o->both_sides = 1;
    panels[k] = (batten_picture_panel){.mesh = mesh, .opt = o};
  }
  whole.width = 1400;
  whole.height = 700;
  return batten_picture_panels(ctx, 1, 2, panels, &whole, path);
}

int main(int argc, char **argv) {
  static stack heart = {.closed = true};
  if (argc != 2) return 2;
  if (!read_heart(&heart)) return 3;
  batten_context *ctx = NULL;
  if (batten_context_new(NULL, &ctx) < 0) return 1;
  batten_loft *loft = NULL;
  batten_surface *surface = NULL;
  batten_mesh *mesh = NULL;
  double *distances = NULL;
  batten_surface_tessellate_options t = batten_surface_tessellate_options_default();
  t.density = 4;
  batten_status st = make_loft(ctx, &heart, &loft);
  if (st >= 0) st = batten_loft_surface(ctx, loft, &surface);
  if (st >= 0) st = batten_surface_tessellate(ctx, surface, &t, &mesh);
  if (st >= 0) {
    distances = batten_alloc_array(ctx, batten_mesh_vertex_count(mesh), sizeof *distances);
    if (!distances) st = BATTEN_E_NOMEM;
  }
  if (st >= 0) st = measure(ctx, &heart, mesh, distances);
  if (st >= 0) st = draw(ctx, mesh, distances, argv[1]);
  if (st < 0) fprintf(stderr, "loft-distance: %s\n", batten_error(ctx));
  batten_free(ctx, distances);
  batten_mesh_free(mesh);
  batten_surface_free(surface);
  batten_loft_free(loft);
  batten_context_free(ctx);
  return st < 0;
}
