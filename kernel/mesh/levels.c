/* Level lines of quantities that are linear on the triangles of a mesh.
 *
 * Levels are sorted, so that a triangle meets only those between its corners; a first pass counts the segments of
 * each, a second one puts them in their places. */
#include "levels.h"

#include <batten/mesh.h>

#include "base/checked.h"
#include "basis/sort_points.h"

/* Where an edge passes the level, from its lower vertex on, whichever way the triangle goes. Halves, since the
 * difference of two doubles may be beyond one; they change no bit else. */
static void crossing(const double *vertices, uint32_t a, uint32_t b, double va, double vb, double level,
                     double out[3]) {
  if (a > b) {
    uint32_t vertex = a;
    double value = va;
    a = b;
    b = vertex;
    va = vb;
    vb = value;
  }
  double t = (0.5 * level - 0.5 * va) / (0.5 * vb - 0.5 * va);
  const double *p = vertices + 3 * (size_t)a, *q = vertices + 3 * (size_t)b;
  for (int d = 0; d < 3; d++) out[d] = p[d] + t * (q[d] - p[d]);
}

bool levels_cut(const double *vertices, const uint32_t *corners, const double v[3], double level,
                double (*segment)[3]) {
  bool above[3] = {v[0] >= level, v[1] >= level, v[2] >= level};
  if (above[0] == above[1] && above[1] == above[2]) return false;
  for (int k = 0; k < 3 && segment; k++) {
    int next = (k + 1) % 3;
    if (above[k] == above[next]) continue;
    crossing(vertices, corners[k], corners[next], v[k], v[next], level, segment[above[k] ? 0 : 1]);
  }
  return true;
}

/* The first of the sorted levels that is not below the value. */
static size_t first_level(size_t count, const double *levels, const uint32_t *order, double value) {
  size_t low = 0, high = count;
  while (low < high) {
    size_t middle = low + (high - low) / 2;
    if (levels[order[middle]] < value)
      low = middle + 1;
    else
      high = middle;
  }
  return low;
}

/* place [count]: of the next segment of each level, moved on by those that it has; out NULL: only that. */
static void cut_all(const batten_mesh *mesh, const double *values, size_t count, const double *levels,
                    const uint32_t *order, size_t *place, double (*out)[2][3]) {
  const double *vertices = batten_mesh_vertices(mesh);
  const uint32_t *triangles = batten_mesh_triangles(mesh);
  for (size_t t = 0; t < batten_mesh_triangle_count(mesh); t++) {
    const uint32_t *corners = triangles + 3 * t;
    const double v[3] = {values[corners[0]], values[corners[1]], values[corners[2]]};
    if (!isfinite(v[0]) || !isfinite(v[1]) || !isfinite(v[2])) continue;
    double least = fmin(v[0], fmin(v[1], v[2])), most = fmax(v[0], fmax(v[1], v[2]));
    for (size_t k = first_level(count, levels, order, least); k < count && levels[order[k]] <= most; k++) {
      size_t *to = &place[order[k]];
      if (levels_cut(vertices, corners, v, levels[order[k]], out ? out[*to] : NULL)) ++*to;
    }
  }
}

/* Numbers of segments become the places of the first; at the sum. */
static size_t assign_places(size_t count, size_t *place) {
  size_t sum = 0;
  for (size_t i = 0; i < count; i++) {
    size_t segments = place[i];
    place[i] = sum;
    sum += segments;
  }
  return sum;
}

static batten_status check(batten_context *ctx, const batten_mesh *mesh, const double *values, size_t level_count,
                           const double *levels, const size_t *count, double *const *segments) {
  if (!mesh || !count || !segments)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a mesh and the addresses of the results",
                       !mesh   ? "mesh"
                       : count ? "segments"
                               : "count");
  if (batten_mesh_vertex_count(mesh) && !values)
    return batten_fail(ctx, BATTEN_E_INVALID, "values: NULL; give one for each of the %zu vertices",
                       batten_mesh_vertex_count(mesh));
  if (level_count && !levels)
    return batten_fail(ctx, BATTEN_E_INVALID, "levels: NULL; give the %zu that are asked for", level_count);
  if (level_count > UINT32_MAX)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "level_count: %zu; give at most %u", level_count, UINT32_MAX);
  size_t bad = batten_first_nonfinite(level_count, levels);
  if (bad < level_count)
    return batten_fail(ctx, BATTEN_E_INVALID, "levels[%zu]: %g; give finite levels", bad, levels[bad]);
  return BATTEN_OK;
}

batten_status batten_mesh_level_lines(batten_context *ctx, const batten_mesh *mesh, const double *values,
                                      size_t level_count, const double *levels, size_t *count, double **segments) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_status st = check(ctx, mesh, values, level_count, levels, count, segments);
  if (st < 0) return st;
  double(*lines)[2][3] = NULL;
  uint32_t *order = batten_alloc_array(ctx, level_count, sizeof *order);
  size_t *place = batten_alloc_array(ctx, level_count, sizeof *place);
  st = order && place ? batten_sort_points(ctx, 1, level_count, levels, order) : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  for (size_t i = 0; i < level_count; i++) place[i] = 0;
  cut_all(mesh, values, level_count, levels, order, place, NULL);
  size_t found = assign_places(level_count, place);
  if (found > 0) {
    lines = batten_alloc_array(ctx, found, sizeof *lines);
    st = lines ? BATTEN_OK : BATTEN_E_NOMEM;
    if (!lines) goto done;
    cut_all(mesh, values, level_count, levels, order, place, lines);
  }
  *count = found;
  *segments = lines ? lines[0][0] : NULL;
done:
  batten_free(ctx, place);
  batten_free(ctx, order);
  return st;
}
