/* Isophotes and reflection lines: against lines known in closed form, and by their values at both ends. */
#include "mesh/vec.h"
#include "network_shapes.h"
#include "tap.h"

/* Light from above on a cap: isophotes are circles, n_z = (1 + r^2)^(-1/2). */
static void test_isophotes(batten_context *ctx) {
  shape s = shape_graph(4, 2, 3, shape_cap);
  batten_network *n = network_of(ctx, &s);
  batten_lines_options o = batten_lines_options_default();
  memcpy(o.direction, (double[3]){0, 0, 5}, 24);
  double errors[2];
  for (unsigned fine = 0; fine < 2; fine++) {
    size_t count = 0, inside = 0, circles = 0;
    double *segments = NULL, worst = 0, length = 0, expected = 0;
    o.density = fine ? 16 : 8;
    T_OK(batten_network_lines(ctx, n, &o, &count, &segments), ctx);
    for (int level = 0; level < 24; level++) {
      double nz = 2 * (level + 0.5) / 24 - 1, rr = nz > 0 ? 1 / (nz * nz) - 1 : INFINITY;
      if (rr < 1) {
        circles++;
        expected += 2 * 3.14159265358979323846 * sqrt(rr);
      }
    }
    for (size_t i = 0; i < count; i++) {
      const double(*p)[3] = (const double(*)[3])(segments + 6 * i);
      double level[2], rr = p[0][0] * p[0][0] + p[0][1] * p[0][1];
      for (int end = 0; end < 2; end++) {
        double x = p[end][0], y = p[end][1];
        level[end] = 12 * (1 + 1 / sqrt(1 + x * x + y * y));
        worst = fmax(worst, fabs(level[end] - floor(level[end]) - 0.5));
      }
      if (rr > 1) continue;
      inside++;
      length += vec_distance(p[0], p[1]);
      /* Brighter, that is the middle, on the left. */
      if (p[0][0] * p[1][1] - p[0][1] * p[1][0] < -1e-9) worst = INFINITY;
    }
    errors[fine] = worst;
    T_CHECK(circles == 4 && inside > 100, "density %u: %zu segments, %zu circles within", o.density, count, circles);
    T_RATIO(fabs(length - expected) / expected, fine ? 2e-3 : 8e-3, "their length");
    batten_free(ctx, segments);
  }
  T_RATIO(errors[0], 0.06, "segments end on their levels");
  T_RATIO(errors[1], 0.3 * errors[0], "to second order in the density");
  batten_network_free(n);
  shape_free(&s);
}

/* On a ridge the normal depends on x alone, and so does every line: from end to end in y. With the eye above and the
 * lights along y, the ray mirrored at slope a is at the angle 2 a from the eye: lines are where 2 atan(x) is a level.
 */
static void test_reflections(batten_context *ctx) {
  shape s = shape_graph(4, 2, 0, shape_ridge);
  batten_network *n = network_of(ctx, &s);
  batten_lines_options o = batten_lines_options_default();
  o.kind = BATTEN_LINES_REFLECTION;
  memcpy(o.direction, (double[3]){0, 0, 1}, 24);
  memcpy(o.light_axis, (double[3]){0, -2, 0}, 24);
  o.count = 36;
  o.density = 40;
  size_t count = 0;
  double *segments = NULL, worst = 0, length = 0;
  T_OK(batten_network_lines(ctx, n, &o, &count, &segments), ctx);
  for (size_t i = 0; i < count; i++) {
    const double *p = segments + 6 * i;
    double level =
        2 * atan(p[0]) * 36 / (2 * 3.14159265358979323846); /* counted from the top; levels at whole + 1/2 */
    worst = fmax(worst, fabs(level - floor(level) - 0.5));
    worst = fmax(worst, fabs(p[0] - p[3]));
    length += fabs(p[4] - p[1]);
  }
  T_RATIO(worst, 1e-3, "reflections on a ridge: straight, and where they should be");
  T_RATIO(fabs(length - 18 * 2), 1e-9, "18 lines from end to end, also where the angle jumps");
  batten_free(ctx, segments);
  batten_network_free(n);
  shape_free(&s);
}

/* The torus has normals of all directions: with the axis along the rays nothing is drawn there, and nothing breaks.
 */
static void test_all_around(batten_context *ctx) {
  shape s = shape_torus(4);
  batten_network *n = network_of(ctx, &s);
  batten_lines_options o = batten_lines_options_default();
  o.kind = BATTEN_LINES_REFLECTION;
  size_t count = 0;
  double *segments = NULL;
  T_OK(batten_network_lines(ctx, n, &o, &count, &segments), ctx);
  bool finite = true;
  double longest = 0;
  for (size_t i = 0; i < count; i++) {
    for (int d = 0; d < 6; d++) finite = finite && isfinite(segments[6 * i + (size_t)d]);
    longest = fmax(longest, vec_distance(segments + 6 * i, segments + 6 * i + 3));
  }
  T_CHECK(finite && count > 1000 && longest < 0.5, "torus: %zu segments, none longer than %.2g", count, longest);
  batten_free(ctx, segments);
  batten_mesh *mesh = NULL;
  batten_tessellate_options t = batten_tessellate_options_default();
  T_OK(batten_network_tessellate(ctx, n, &t, &mesh), ctx);
  size_t vertices = batten_mesh_vertex_count(mesh);
  double *values = malloc(vertices * sizeof *values), low, high;
  for (int kind = 0; kind < 2; kind++) {
    o.kind = kind ? BATTEN_LINES_REFLECTION : BATTEN_LINES_ISOPHOTE;
    T_OK(batten_network_line_values(ctx, mesh, &o, values), ctx);
    low = INFINITY;
    high = -INFINITY;
    for (size_t i = 0; i < vertices; i++) {
      low = fmin(low, values[i]);
      high = fmax(high, values[i]);
    }
    T_CHECK(low >= 0 && low < 0.5 && high <= 24 && high > 23.5, "values from %.2f to %.2f", low, high);
  }
  free(values);
  batten_mesh_free(mesh);
  batten_network_free(n);
  shape_free(&s);
}

static batten_status draw(batten_context *ctx, void *arg) {
  batten_network *n = NULL;
  size_t count = 0;
  double *segments = NULL;
  batten_status st = shape_network(ctx, arg, &n);
  if (st == BATTEN_OK) st = batten_network_lines(ctx, n, NULL, &count, &segments);
  batten_free(ctx, segments);
  batten_network_free(n);
  return st;
}

static void test_bad(batten_context *ctx) {
  shape s = shape_octahedron();
  memset(s.control, 0, 72); /* a patch without a normal */
  batten_network *n = network_of(ctx, &s);
  size_t count = 7;
  double values[6], *segments = values;
  batten_lines_options o = batten_lines_options_default();
  batten_mesh *mesh = NULL;
  T_OK(batten_mesh_create(ctx, s.vertices, s.points, s.faces, s.triangles, &mesh), ctx);
  T_STATUS(batten_network_line_values(ctx, mesh, &o, values), BATTEN_E_INVALID, ctx, "no field \"normal\"");
  const double normals[6][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, 0}};
  T_OK(batten_mesh_set_field(ctx, mesh, "normal", 3, normals[0]), ctx);
  memcpy(o.direction, (double[3]){2, 0, 0}, 24);
  T_OK(batten_network_line_values(ctx, mesh, &o, values), ctx);
  T_CHECK(values[0] == 24 && values[1] == 0 && values[2] == 12 && values[4] == 12 && isnan(values[5]),
          "values by hand");
  o.kind = BATTEN_LINES_REFLECTION;
  memcpy(o.light_axis, (double[3]){1, 0, 0}, 24);
  T_OK(batten_network_line_values(ctx, mesh, &o, values), ctx);
  T_CHECK(isnan(values[0]) && isnan(values[2]), "rays along the axis have no angle");
  T_STATUS(batten_network_line_values(ctx, NULL, &o, values), BATTEN_E_INVALID, ctx, "tessellation: NULL");
  T_STATUS(batten_network_line_values(ctx, mesh, &o, NULL), BATTEN_E_INVALID, ctx, "values: NULL");
  T_CHECK(batten_network_line_values(NULL, mesh, &o, values) == BATTEN_E_INVALID &&
              batten_network_lines(NULL, n, &o, &count, &segments) == BATTEN_E_INVALID,
          "no context");
  T_STATUS(batten_network_lines(ctx, NULL, &o, &count, &segments), BATTEN_E_INVALID, ctx, "network: NULL");
  T_STATUS(batten_network_lines(ctx, n, &o, NULL, &segments), BATTEN_E_INVALID, ctx, "count: NULL");
  T_STATUS(batten_network_lines(ctx, n, &o, &count, NULL), BATTEN_E_INVALID, ctx, "segments: NULL");
  o.struct_size = 0;
  T_STATUS(batten_network_lines(ctx, n, &o, &count, &segments), BATTEN_E_INVALID, ctx,
           "batten_lines_options.struct_size: 0");
  o = batten_lines_options_default();
  o.count = 0;
  T_STATUS(batten_network_lines(ctx, n, &o, &count, &segments), BATTEN_E_INVALID, ctx, "opt.count: 0");
  o.count = 1001;
  T_STATUS(batten_network_lines(ctx, n, &o, &count, &segments), BATTEN_E_INVALID, ctx, "opt.count: 1001");
  o.count = 5;
  o.density = 513;
  T_STATUS(batten_network_lines(ctx, n, &o, &count, &segments), BATTEN_E_INVALID, ctx, "opt.density: 513");
  o.density = 3;
  o.kind = (batten_line_kind)2;
  T_STATUS(batten_network_lines(ctx, n, &o, &count, &segments), BATTEN_E_INVALID, ctx, "opt.kind: 2");
  o.kind = BATTEN_LINES_REFLECTION;
  memset(o.light_axis, 0, 24);
  T_STATUS(batten_network_lines(ctx, n, &o, &count, &segments), BATTEN_E_INVALID, ctx, "opt.light_axis: 0 0 0");
  o.direction[1] = NAN;
  T_STATUS(batten_network_lines(ctx, n, &o, &count, &segments), BATTEN_E_INVALID, ctx, "opt.direction[1]: nan");
  T_CHECK(count == 7 && segments == values, "failures leave the results alone");
  T_OK(batten_network_lines(ctx, n, NULL, &count, &segments), ctx);
  T_CHECK(count == 0, "flat facets have no lines");
  batten_free(ctx, segments);
  batten_mesh_free(mesh);
  batten_network_free(n);
  shape_free(&s);
  s = shape_graph(2, 2, 3, shape_cap);
  t_fail_every_allocation("batten_network_lines", draw, &s);
  shape_free(&s);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_isophotes(ctx);
  test_reflections(ctx);
  test_all_around(ctx);
  test_bad(ctx);
  batten_context_free(ctx);
  return t_done();
}
