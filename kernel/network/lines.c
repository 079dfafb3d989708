/* Isophotes and reflection lines: where a quantity of the normal passes its levels, on a tessellation.
 *
 * An isophote keeps n . d, d the unit direction, which runs over [-1, 1]: the value is (n . d + 1) / 2 count. A
 * reflection line keeps the angle phi about the axis of the mirrored ray r = 2 (n . d) n - d, which goes all around:
 * the value is (phi / 2 pi + 1 / 2) count, and jumps by count somewhere. Levels are at 1/2, 3/2, .. count - 1/2 in
 * both. Patches are tessellated apart, so that lines break where normals do. */
#include <batten/network.h>

#include "base/checked.h"
#include "mesh/levels.h"
#include "mesh/vec.h"

#include <string.h>

static const double TURN = 6.283185307179586477; /* 2 pi */

batten_lines_options batten_lines_options_default(void) {
  return (batten_lines_options){.struct_size = sizeof(batten_lines_options),
                                .direction = {1, 0.6, 0.8},
                                .light_axis = {0, 0, 1},
                                .count = 24,
                                .density = 8};
}

typedef struct light {
  batten_line_kind kind;
  double direction[3], across[2][3]; /* unit; across: orthonormal, orthogonal to the axis */
  double count;
} light;

static batten_status unit_vector(batten_context *ctx, const char *name, const double *from, double *out) {
  memcpy(out, from, 3 * sizeof *out);
  size_t bad = batten_first_nonfinite(3, from);
  if (bad < 3)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s[%zu]: %g; give a finite vector", name, bad, from[bad]);
  if (!vec_normalize(out))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s: 0 0 0; give a vector of some length", name);
  return BATTEN_OK;
}

static batten_status make_light(batten_context *ctx, const batten_lines_options *opt, light *out) {
  batten_status st = batten_check_struct(ctx, "batten_lines_options", opt->struct_size, sizeof *opt);
  if (st < 0) return st;
  if (opt->kind != BATTEN_LINES_ISOPHOTE && opt->kind != BATTEN_LINES_REFLECTION)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.kind: %d; give BATTEN_LINES_ISOPHOTE or _REFLECTION",
                       (int)opt->kind);
  if (opt->count < 1 || opt->count > 1000)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.count: %u; give 1 to 1000", opt->count);
  *out = (light){.kind = opt->kind, .count = opt->count};
  st = unit_vector(ctx, "direction", opt->direction, out->direction);
  if (st < 0 || opt->kind == BATTEN_LINES_ISOPHOTE) return st;
  double axis[3];
  st = unit_vector(ctx, "light_axis", opt->light_axis, axis);
  if (st < 0) return st;
  /* The coordinate axis that is least along it, made orthogonal. */
  int least = 0;
  for (int d = 1; d < 3; d++)
    if (fabs(axis[d]) < fabs(axis[least])) least = d;
  for (int d = 0; d < 3; d++) out->across[0][d] = (d == least) - axis[least] * axis[d];
  vec_normalize(out->across[0]);
  vec_cross(axis, out->across[0], out->across[1]);
  return BATTEN_OK;
}

/* NaN without a normal, and where the mirrored ray is along the axis. */
static double value_of(const light *l, const double *normal) {
  double cosine = vec_dot(normal, l->direction), ray[3];
  if (!(vec_dot(normal, normal) > 0.25)) return NAN;
  if (l->kind == BATTEN_LINES_ISOPHOTE) return 0.5 * (cosine + 1) * l->count;
  for (int d = 0; d < 3; d++) ray[d] = 2 * cosine * normal[d] - l->direction[d];
  double x = vec_dot(ray, l->across[0]), y = vec_dot(ray, l->across[1]);
  return hypot(x, y) > 1e-12 ? (atan2(y, x) / TURN + 0.5) * l->count : NAN;
}

/* Normals of the tessellation, or NULL with the error set. */
static const double *normals_of(batten_context *ctx, const batten_mesh *mesh) {
  for (size_t i = 0; i < batten_mesh_field_count(mesh); i++) {
    const char *name;
    size_t components;
    const double *values = batten_mesh_field(mesh, i, &name, &components);
    if (strcmp(name, "normal") == 0 && components == 3) return values;
  }
  batten_fail(ctx, BATTEN_E_INVALID,
              "tessellation: no field \"normal\" of 3 components; give a mesh of batten_network_tessellate");
  return NULL;
}

batten_status batten_network_line_values(batten_context *ctx, const batten_mesh *tessellation,
                                         const batten_lines_options *opt, double *values) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!tessellation) return batten_fail(ctx, BATTEN_E_INVALID, "tessellation: NULL; give a mesh");
  size_t count = batten_mesh_vertex_count(tessellation);
  if (count && !values) return batten_fail(ctx, BATTEN_E_INVALID, "values: NULL; give room for %zu", count);
  light l;
  batten_lines_options defaults = batten_lines_options_default();
  if (!opt) opt = &defaults;
  batten_status st = make_light(ctx, opt, &l);
  if (st < 0) return st;
  const double *normals = normals_of(ctx, tessellation);
  if (!normals) return BATTEN_E_INVALID;
  for (size_t i = 0; i < count; i++) values[i] = value_of(&l, normals + 3 * i);
  return BATTEN_OK;
}

/* ---- lines -------------------------------------------------------------------------------------- */

/* Values at the corners without the jump, or false when there is nothing between them: no normal, or the angle goes
 * all around within the triangle. */
static bool unwrap(const light *l, const double *values, const uint32_t *corners, double out[3]) {
  for (int k = 0; k < 3; k++) {
    out[k] = values[corners[k]];
    if (!isfinite(out[k])) return false;
    if (l->kind == BATTEN_LINES_REFLECTION) out[k] -= l->count * nearbyint((out[k] - out[0]) / l->count);
  }
  return l->kind == BATTEN_LINES_ISOPHOTE || fabs(out[1] - out[2]) <= 0.5 * l->count;
}

/* Segments of one triangle; out NULL: only their number. Ends on an edge agree for both of its triangles but for the
 * rounding of unwrapped values. */
static size_t cut_triangle(const double *vertices, const uint32_t *corners, const double v[3], double (*out)[2][3]) {
  double least = fmin(v[0], fmin(v[1], v[2])), most = fmax(v[0], fmax(v[1], v[2]));
  size_t count = 0;
  for (double level = floor(least - 0.5) + 0.5; level <= most; level += 1)
    if (levels_cut(vertices, corners, v, level, out ? out[count] : NULL)) count++;
  return count;
}

static size_t cut_all(const light *l, const batten_mesh *mesh, const double *values, double (*out)[2][3]) {
  const uint32_t *triangles = batten_mesh_triangles(mesh);
  size_t count = 0;
  for (size_t t = 0; t < batten_mesh_triangle_count(mesh); t++) {
    double v[3];
    if (!unwrap(l, values, triangles + 3 * t, v)) continue;
    count += cut_triangle(batten_mesh_vertices(mesh), triangles + 3 * t, v, out ? out + count : NULL);
  }
  return count;
}

batten_status batten_network_lines(batten_context *ctx, const batten_network *network,
                                   const batten_lines_options *opt, size_t *count, double **segments) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!network || !count || !segments)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a network and the addresses of the results",
                       !network ? "network"
                       : count  ? "segments"
                                : "count");
  light l;
  batten_lines_options defaults = batten_lines_options_default();
  if (!opt) opt = &defaults;
  batten_status st = make_light(ctx, opt, &l);
  if (st < 0) return st;
  batten_tessellate_options tessellate = batten_tessellate_options_default();
  tessellate.density = opt->density;
  tessellate.per_patch = 1;
  if (tessellate.density < 1 || tessellate.density > 512)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.density: %u; give 1 to 512", tessellate.density);
  batten_mesh *mesh = NULL;
  double *values = NULL;
  st = batten_network_tessellate(ctx, network, &tessellate, &mesh);
  if (st < 0) goto done;
  st = BATTEN_E_NOMEM;
  values = batten_alloc_array(ctx, batten_mesh_vertex_count(mesh), sizeof *values);
  if (!values) goto done;
  st = batten_network_line_values(ctx, mesh, opt, values);
  if (st < 0) goto done;
  size_t found = cut_all(&l, mesh, values, NULL);
  double(*lines)[2][3] = batten_alloc_array(ctx, found, sizeof *lines);
  st = lines ? BATTEN_OK : BATTEN_E_NOMEM;
  if (!lines) goto done;
  cut_all(&l, mesh, values, lines);
  *count = found;
  *segments = lines[0][0];
done:
  batten_free(ctx, values);
  batten_mesh_free(mesh);
  return st;
}
