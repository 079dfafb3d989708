/* Parameters of scattered points: options, checks, projection into the best plane. See <batten/convex.h>. */
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "convex_inner.h"
#include "floater.h"
#include "mesh/vec.h"
#include "plane.h"

/* AUTO projects unless more than this share of the points is tilted against the best plane by more than 65 degrees.
 * Fits to caps of a sphere with little noise have the lesser sum by projection up to about 55 degrees for square
 * caps, where corners suit, and up to 75 for round ones, which a square's corners spoil. */
static const double STEEP_SHARE = 0.05, STEEP_COSINE = 0.4226;

batten_parametrize_options batten_parametrize_options_default(void) {
  return (batten_parametrize_options){.struct_size = sizeof(batten_parametrize_options)};
}

static batten_status project(batten_context *ctx, size_t count, const double *points, const convex_scale *scale,
                             double *uv) {
  double size[2], axes[2][3];
  batten_status st = convex_plane_project(ctx, count, points, NULL, scale, uv, size, axes);
  if (st < 0) return st;
  for (size_t i = 0; i < count; i++)
    for (size_t k = 0; k < 2; k++) uv[2 * i + k] /= size[k];
  return BATTEN_OK;
}

/* normals [count][3]: sums over the triangles at a point; true when their corners are points. */
static bool sum_normals(size_t count, const double *points, const convex_scale *scale,
                        const batten_parametrize_options *o, double *normals) {
  memset(normals, 0, 3 * count * sizeof *normals);
  for (size_t t = 0; t < o->triangle_count; t++) {
    const uint32_t *c = o->triangles + 3 * t;
    double corner[3][3], normal[3];
    for (int k = 0; k < 3; k++) {
      if (c[k] >= count) return false;
      convex_scale_apply(scale, points + 3 * (size_t)c[k], corner[k]);
    }
    vec_triangle_normal(corner[0], corner[1], corner[2], normal);
    for (int k = 0; k < 3; k++)
      for (size_t d = 0; d < 3; d++) normals[3 * (size_t)c[k] + d] += normal[d];
  }
  return true;
}

/* Points whose triangles are steep against a plane, its normal taken the way in which most of the area lies. */
static size_t count_steep(size_t count, const double *normals, const double *plane_normal) {
  size_t steep = 0;
  double way = 0;
  for (size_t i = 0; i < count; i++) way += vec_dot(normals + 3 * i, plane_normal);
  for (size_t i = 0; i < count; i++) {
    double normal[3] = {normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]};
    if (vec_normalize(normal) && copysign(1, way) * vec_dot(normal, plane_normal) < STEEP_COSINE) steep++;
  }
  return steep;
}

/* What AUTO stands for. */
static batten_status choose_method(batten_context *ctx, size_t count, const double *points, const convex_scale *scale,
                                   const batten_parametrize_options *o, batten_parametrization *method) {
  *method = BATTEN_PARAMETERS_PROJECT;
  if (o->triangle_count == 0) return BATTEN_OK;
  double size[2], axes[2][3], plane_normal[3];
  double *flat = batten_alloc_array(ctx, count, 2 * sizeof *flat);
  double *normals = flat ? batten_alloc_array(ctx, count, 3 * sizeof *normals) : NULL;
  batten_status st =
      normals ? convex_plane_project(ctx, count, points, NULL, scale, flat, size, axes) : BATTEN_E_NOMEM;
  if (st >= 0) {
    vec_cross(axes[0], axes[1], plane_normal);
    bool are_points = sum_normals(count, points, scale, o, normals);
    if (!are_points || (double)count_steep(count, normals, plane_normal) > STEEP_SHARE * (double)count)
      *method = BATTEN_PARAMETERS_FLOATER; /* which names a corner that is none */
  }
  batten_free(ctx, normals);
  batten_free(ctx, flat);
  return st;
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
  if (o.method == BATTEN_PARAMETERS_AUTO) st = choose_method(ctx, count, points, &scale, &o, &o.method);
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
