/* Parallel planes as heights over one of them, and surfaces from there to space. */
#include "curves.h"

#include "base/checked.h"

#include <math.h>
#include <string.h>

/* Radians: planes through points that a text file has rounded are no more parallel than that. */
static const double parallel = 1e-5;

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const double a[3], const double b[3], double out[3]) {
  for (int k = 0; k < 3; k++) out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static void normal_of(const batten_plane *p, double out[3]) { cross(p->axes[0], p->axes[1], out); }

static batten_status check(batten_context *ctx, size_t count, const batten_plane *planes) {
  double first[3] = {0}, normal[3], turned[3];
  for (size_t i = 0; i < count; i++) {
    const char *fault = bx_plane_fault(&planes[i]);
    if (fault) return batten_fail(ctx, BATTEN_E_INVALID, "planes[%zu].%s", i, fault);
    normal_of(&planes[i], normal);
    if (i == 0) memcpy(first, normal, sizeof first);
    cross(first, normal, turned);
    double sine = sqrt(dot(turned, turned));
    if (!(sine <= parallel))
      return batten_fail(
          ctx, BATTEN_E_INVALID,
          "planes[%zu]: turned by %.3g degrees against planes[0]; they must be parallel, leave out those "
          "that are not",
          i, atan2(sine, fabs(dot(first, normal))) * 57.29577951308232);
  }
  return BATTEN_OK;
}

static batten_plane_place place_of(const batten_plane *base, const double normal[3], const batten_plane *p) {
  batten_plane_place out = {.height = dot(normal, p->origin), .matrix = {1, 0, 0, 1}};
  double from[3];
  for (int k = 0; k < 3; k++) from[k] = p->origin[k] - base->origin[k];
  bool same = !memcmp(p->axes, base->axes, sizeof p->axes); /* then it is the identity to the bit */
  for (int r = 0; r < 2; r++) {
    out.shift[r] = dot(base->axes[r], from);
    for (int c = 0; !same && c < 2; c++) out.matrix[2 * r + c] = dot(base->axes[r], p->axes[c]);
  }
  return out;
}

batten_status batten_plane_stack(batten_context *ctx, size_t count, const batten_plane *planes, batten_plane *base,
                                 batten_plane_place *places) {
  if (!ctx) return BATTEN_E_INVALID;
  if (count == 0) return batten_fail(ctx, BATTEN_E_INVALID, "count: 0; must be 1 or more");
  if (!planes || !base || !places)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL", !planes ? "planes" : !base ? "base" : "places");
  batten_status st = check(ctx, count, planes);
  if (st != BATTEN_OK) return st;
  batten_plane b = planes[0];
  double normal[3];
  normal_of(&b, normal);
  double height = dot(normal, b.origin);
  for (int k = 0; k < 3; k++) b.origin[k] -= height * normal[k];
  for (size_t i = 0; i < count; i++) {
    batten_plane_place p = place_of(&b, normal, &planes[i]);
    if (!isfinite(p.height) || !isfinite(p.shift[0]) || !isfinite(p.shift[1]))
      return batten_fail(ctx, BATTEN_E_INVALID, "planes[%zu].origin: beyond a double from the others; scale it", i);
  }
  for (size_t i = 0; i < count; i++) places[i] = place_of(&b, normal, &planes[i]);
  *base = b;
  return BATTEN_OK;
}

batten_status batten_plane_lift(batten_context *ctx, const batten_plane *base, const batten_surface *surface,
                                batten_surface **out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!base || !surface || !out)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL", !base ? "base" : !surface ? "surface" : "out");
  const char *fault = bx_plane_fault(base);
  if (fault) return batten_fail(ctx, BATTEN_E_INVALID, "base.%s", fault);
  batten_surface_form form = batten_surface_get(surface);
  size_t count = (form.knot_count[0] - form.degree[0] - 1) * (form.knot_count[1] - form.degree[1] - 1);
  double *points = batten_alloc_array(ctx, count, 3 * sizeof *points), normal[3];
  if (!points) return BATTEN_E_NOMEM;
  normal_of(base, normal);
  for (size_t i = 0; i < count; i++) {
    const double *p = form.control_points + 3 * i;
    for (int k = 0; k < 3; k++)
      points[3 * i + (size_t)k] =
          base->origin[k] + (p[0] * base->axes[0][k] + p[1] * base->axes[1][k] + p[2] * normal[k]);
  }
  form.control_points = points;
  batten_status st = batten_surface_create(ctx, &form, out);
  batten_free(ctx, points);
  return st;
}
