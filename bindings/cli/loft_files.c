/* Files of `batten loft`: surfaces, contours and sections in space, the picture. */
#include <stdlib.h>
#include <string.h>

#include "loft.h"

static const char *path_of(const cli_output *f) { return f->staged ? f->staged : f->target; }

static batten_status write_surface(loft_work *w, const batten_loft *loft, const cli_output *f) {
  batten_context *ctx = w->run.ctx;
  batten_write_surface_options o = w->request->write;
  batten_surface *flat = NULL, *surface = NULL;
  char *name = cli_product_name(f->path);
  batten_status st = name ? batten_loft_surface(ctx, loft, &flat) : BATTEN_E_NOMEM;
  if (st >= 0) st = batten_plane_lift(ctx, &w->base, flat, &surface);
  o.name = name;
  if (st >= 0) st = batten_write_surface(ctx, surface, &o, path_of(f));
  batten_surface_free(surface);
  batten_surface_free(flat);
  free(name);
  return st;
}

/* ---- contours and sections ----------------------------------------------------------------------- */

static batten_plane plane_at(const batten_plane *base, double height) {
  const double(*a)[3] = base->axes;
  batten_plane out = *base;
  for (int k = 0; k < 3; k++) {
    int i = (k + 1) % 3, j = (k + 2) % 3;
    out.origin[k] += height * (a[0][i] * a[1][j] - a[0][j] * a[1][i]);
  }
  return out;
}

static batten_status write_curves(loft_work *w, size_t count, const batten_curve *const *curves,
                                  const double *heights, const cli_output *f) {
  batten_write_curves_options o = batten_write_curves_options_default();
  batten_plane *planes = batten_alloc_array(w->run.ctx, count, sizeof *planes);
  char *name = cli_product_name(f->path);
  batten_status st = planes && name ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0) {
    for (size_t i = 0; i < count; i++) planes[i] = plane_at(&w->base, heights[i]);
    o.planes = planes;
    o.name = name;
    o.unit = w->request->write.unit;
    st = batten_write_curves(w->run.ctx, count, curves, &o, path_of(f));
  }
  free(name);
  batten_free(w->run.ctx, planes);
  return st;
}

/* The contours, and sections at equal steps between neighbours. */
static batten_status write_sections(loft_work *w, const cli_output *f) {
  batten_context *ctx = w->run.ctx;
  size_t steps = w->request->between + 1, count = (w->count - 1) * steps + 1, made = 0;
  double *heights = batten_alloc_array(ctx, count, sizeof *heights);
  batten_curve **sections = batten_alloc_array(ctx, count, sizeof *sections);
  batten_status st = heights && sections ? BATTEN_OK : BATTEN_E_NOMEM;
  for (; st >= 0 && made < count; made++) {
    size_t i = made / steps, k = made % steps;
    double part = (double)k / (double)steps;
    heights[made] = k == 0 ? w->heights[i] : (1 - part) * w->heights[i] + part * w->heights[i + 1];
    st = batten_loft_section(ctx, w->loft, heights[made], &sections[made]);
    if (st < 0) break;
  }
  if (st >= 0) st = write_curves(w, count, (const batten_curve *const *)sections, heights, f);
  for (size_t i = 0; i < made; i++) batten_curve_free(sections[i]);
  batten_free(ctx, sections);
  batten_free(ctx, heights);
  return st;
}

/* ---- picture ------------------------------------------------------------------------------------- */

static batten_status get_patches(loft_work *w, const batten_loft *loft, batten_surface **out) {
  batten_status st = BATTEN_OK;
  for (size_t i = 0; i + 1 < w->count && st >= 0; i++) st = batten_loft_patch(w->run.ctx, loft, i, &out[i]);
  return st;
}

static batten_status draw(loft_work *w, const cli_output *f) {
  batten_context *ctx = w->run.ctx;
  size_t count = w->count - 1;
  batten_surface **patches = batten_alloc_array(ctx, 2 * count, sizeof *patches);
  if (!patches) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < 2 * count; i++) patches[i] = NULL;
  batten_status st = get_patches(w, w->loft, patches);
  if (st >= 0) st = get_patches(w, w->unconstrained, patches + count);
  const loft_scene scene = {.contour_count = w->count,
                            .contours = (const batten_curve *const *)w->contours,
                            .heights = w->heights,
                            .patches = (const batten_surface *const *)patches,
                            .unconstrained = (const batten_surface *const *)patches + count,
                            .base = &w->base};
  if (st >= 0) st = loft_draw(ctx, &scene, &w->request->picture, path_of(f));
  for (size_t i = 0; i < 2 * count; i++) batten_surface_free(patches[i]);
  batten_free(ctx, patches);
  return st;
}

batten_status loft_write(loft_work *w, const cli_output *f) {
  switch (f->kind) {
    case CLI_OUTPUT_PATCH:
      return write_surface(w, w->loft, f);
    case CLI_OUTPUT_UNCONSTRAINED:
      return write_surface(w, w->unconstrained, f);
    case CLI_OUTPUT_CONTOURS:
      return write_curves(w, w->count, (const batten_curve *const *)w->contours, w->heights, f);
    case CLI_OUTPUT_SECTIONS:
      return write_sections(w, f);
    case CLI_OUTPUT_SHADED:
      return draw(w, f);
    default:
      return BATTEN_OK; /* reports come last: they tell the times of the others */
  }
}
