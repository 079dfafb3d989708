/* Parameters of scattered points: options, checks, projection into the best plane. See <batten/convex.h>. */
#include <string.h>

#include "base/checked.h"
#include "convex_inner.h"
#include "floater.h"
#include "plane.h"

batten_parametrize_options batten_parametrize_options_default(void) {
  return (batten_parametrize_options){.struct_size = sizeof(batten_parametrize_options)};
}

static batten_status project(batten_context *ctx, size_t count, const double *points, const convex_scale *scale,
                             double *uv) {
  double size[2], axes[2][3];
  batten_status st = convex_plane_project(ctx, count, points, scale, uv, size, axes);
  if (st < 0) return st;
  for (size_t i = 0; i < count; i++)
    for (size_t k = 0; k < 2; k++) uv[2 * i + k] /= size[k];
  return BATTEN_OK;
}

static batten_status check_options(batten_context *ctx, const batten_parametrize_options *given,
                                   batten_parametrize_options *out) {
  batten_parametrize_options o = batten_parametrize_options_default();
  batten_status st = BATTEN_OK;
  if (given) st = batten_check_struct(ctx, "batten_parametrize_options", given->struct_size, sizeof o);
  if (st < 0) return st;
  if (given) o = *given; /* not before its size is known */
  if ((int)o.method < 0 || o.method > BATTEN_PARAMETERS_FLOATER)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.method: %d; must be 0 .. %d", (int)o.method,
                       BATTEN_PARAMETERS_FLOATER);
  if (o.triangle_count > 0 && !o.triangles)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.triangles: NULL, but opt.triangle_count is %zu", o.triangle_count);
  if (o.method == BATTEN_PARAMETERS_AUTO)
    o.method = o.triangle_count ? BATTEN_PARAMETERS_FLOATER : BATTEN_PARAMETERS_PROJECT;
  *out = o;
  return BATTEN_OK;
}

batten_status batten_parametrize(batten_context *ctx, size_t count, const double *points,
                                 const batten_parametrize_options *opt, double *parameters) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_parametrize_options o = batten_parametrize_options_default();
  batten_status st = check_options(ctx, opt, &o);
  if (st < 0) return st;
  if (!points || !parameters) return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL", points ? "parameters" : "points");
  if (count < 3) return batten_fail(ctx, BATTEN_E_INVALID, "count: %zu; a surface needs three points", count);
  st = batten_progress(ctx, "parameters", 0);
  if (st < 0) return st;
  convex_scale scale;
  st = convex_scale_find(ctx, count, points, &scale);
  if (st < 0) return st;
  double *uv = batten_alloc_array(ctx, count, 2 * sizeof *uv);
  if (!uv) return BATTEN_E_NOMEM;
  st = o.method == BATTEN_PARAMETERS_PROJECT ? project(ctx, count, points, &scale, uv)
                                             : convex_floater(ctx, count, points, &scale, &o, uv);
  if (st >= 0) {
    batten_status go = batten_progress(ctx, "parameters", 1);
    if (go < 0) st = go;
  }
  if (st >= 0) memcpy(parameters, uv, count * 2 * sizeof *uv);
  batten_free(ctx, uv);
  return st;
}
