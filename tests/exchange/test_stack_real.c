/* Solids of real sections: a clinical heart, a ship's table of offsets, a torus that was cut by planes in all
 * directions. Against sums of slices, trapezoids of the table, slices that were held out, the true torus; and against
 * what is done elsewhere, linear blending of exact distance fields. Twins that are made here stand in without the
 * data. */
#include <batten/batten.h>
#include <batten/exchange.h>
#include <stdio.h>
#include <string.h>

#include "mesh_distance.h"
#include "stack_scenes.h"
#include "tap.h"

static const char *shared_path(const char *name) {
  static char path[1024];
  const char *shared = getenv("BATTEN_SHARED");
  if (!shared || snprintf(path, sizeof path, "%s/data/%s", shared, name) >= (int)sizeof path) return NULL;
  FILE *file = fopen(path, "r");
  if (file) fclose(file);
  return file ? path : NULL;
}

/* ---- meshes ---------------------------------------------------------------------------------------- */

static batten_mesh *surface_of(batten_context *ctx, const batten_solid *solid, double cell, const double *box,
                               batten_mesh_measures *measures) {
  batten_polygonize_options p = batten_polygonize_options_default();
  batten_field field = batten_solid_field(solid);
  batten_mesh *mesh = NULL;
  size_t seeds = 0;
  const double *points = box ? NULL : batten_solid_points(solid, &seeds);
  p.cell = cell;
  for (size_t k = 0; box && k < 3; k++) {
    p.lower[k] = box[k];
    p.upper[k] = box[3 + k];
  }
  batten_status st = batten_polygonize(ctx, &field, seeds, points, &p, &mesh, NULL);
  if (st >= 0) st = batten_mesh_measure(ctx, mesh, measures);
  if (st < 0) printf("# %s\n", batten_error(ctx));
  return mesh;
}

/* Every `step`-th point of the sections at `first`, first + stride, ... in space; malloc. */
static double *held_points(const batten_section_set *set, size_t first, size_t stride, size_t step, size_t *count) {
  double *out = NULL;
  *count = 0;
  for (size_t i = first; i < set->count; i += stride) {
    const batten_section *s = set->sections + i;
    for (size_t k = s->starts[0]; k < s->starts[s->contour_count]; k += step) {
      out = stack_scene_grow(out, 3 * (*count + 1) * sizeof *out);
      for (int d = 0; d < 3; d++)
        out[3 * *count + (size_t)d] =
            s->origin[d] + s->points[2 * k] * s->rotation[0][d] + s->points[2 * k + 1] * s->rotation[1][d];
      ++*count;
    }
  }
  return out;
}

/* ---- a heart ---------------------------------------------------------------------------------------- */

static double loop_area(const batten_section *s, size_t k) {
  double twice = 0;
  size_t first = s->starts[k], end = s->starts[k + 1];
  for (size_t i = first; i < end; i++) {
    const double *a = s->points + 2 * i, *b = s->points + 2 * (i + 1 < end ? i + 1 : first);
    twice += a[0] * b[1] - a[1] * b[0];
  }
  return fabs(twice) / 2;
}

/* Area times distance, one contour a slice. */
static double sum_of_slices(const batten_section_set *set) {
  double sum = 0, gap = fabs(set->sections[1].origin[2] - set->sections[0].origin[2]);
  for (size_t i = 0; i < set->count; i++) sum += gap * loop_area(set->sections + i, 0);
  return sum;
}

static void try_heart(batten_context *ctx, const batten_section_set *set, const char *what) {
  batten_solid *solid = NULL;
  batten_stack_info info = {0};
  batten_status st = batten_stack_build(ctx, set->count, set->sections, NULL, &solid, &info, NULL, NULL);
  if (!T_CHECK(st == BATTEN_OK, "%s: %s", what, st ? batten_error(ctx) : "done")) return;
  T_CHECK(info.certified == set->count && info.wrong_sign_max <= info.tolerance,
          "%s: no wrong sign deeper than %.3g on any of %zu slices: %.3g; %zu centres of %zu points, fit %.2f s",
          what, info.tolerance, info.sections, info.wrong_sign_max, info.centers, info.points_given, info.time_fit_s);
  T_CHECK(info.pieces == 1 && info.non_overlaps == 0, "%s: one piece", what);
  batten_mesh_measures m = {0};
  batten_mesh *mesh = surface_of(ctx, solid, 2, NULL, &m);
  double slices = sum_of_slices(set);
  T_CHECK(m.closed && m.manifold && m.oriented && m.components == 1 && m.genus == 0,
          "%s: a closed manifold of one piece", what);
  T_RATIO(fabs(m.volume / slices - 1), 0.003, "%s: volume %.1f cm3, sum of slices %.1f", what, m.volume / 1000,
          slices / 1000);
  batten_mesh_free(mesh);
  batten_solid_free(solid);
}

/* The clinical standard: exact distance fields of the polygons, linear between. */
static batten_status distance_fields(batten_context *ctx, size_t count, const batten_section *sections,
                                     batten_solid **out) {
  batten_solid *functions[64] = {NULL};
  double numbers[3 * 64];
  batten_status st = BATTEN_OK;
  for (size_t i = 0; i < count && st >= 0; i++) {
    batten_frep *tree = NULL;
    st = batten_frep_polygon(ctx, sections[i].contour_count, sections[i].starts, sections[i].points, &tree);
    if (st >= 0) st = batten_frep_to_solid(ctx, tree, NULL, NULL, 0, &functions[i]);
    batten_frep_free(tree);
    numbers[i] = fabs(sections[i].origin[2] - sections[0].origin[2]);
    numbers[count + i] = 1;
    numbers[2 * count + i] = INFINITY;
  }
  double gap = numbers[1] - numbers[0];
  batten_stack_parts parts = {.struct_size = sizeof parts,
                              .count = count,
                              .sections = sections,
                              .functions = functions,
                              .parameters = numbers,
                              .scales = numbers + count,
                              .saturations = numbers + 2 * count,
                              .between = BATTEN_BETWEEN_LINEAR,
                              .shape = 1,
                              .end_lengths = {gap / 2, gap / 2}};
  if (st >= 0) st = batten_stack_create(ctx, &parts, out);
  for (size_t i = 0; i < count; i++) batten_solid_free(functions[i]);
  return st;
}

/* Slices 0, 2, 4, ... were drawn, those between are means of their neighbours: only the drawn ones can be held out.
 */
static void try_held_out(batten_context *ctx, const batten_section_set *set) {
  batten_section kept[64];
  size_t count = 0, held;
  for (size_t i = 0; i < set->count; i += 4) kept[count++] = set->sections[i];
  double *points = held_points(set, 2, 4, 2, &held), mean[2] = {0}, most[2] = {0};
  for (int way = 0; way < 2; way++) {
    batten_solid *solid = NULL;
    batten_mesh_measures m = {0};
    batten_status st = way ? distance_fields(ctx, count, kept, &solid)
                           : batten_stack_build(ctx, count, kept, NULL, &solid, NULL, NULL, NULL);
    if (!T_CHECK(st >= 0, "held-out slices: %s", st < 0 ? batten_error(ctx) : way ? "distance fields" : "batten"))
      continue;
    batten_mesh *mesh = surface_of(ctx, solid, 2, NULL, &m);
    mesh_distance(mesh, held, points, &mean[way], &most[way]);
    batten_mesh_free(mesh);
    batten_solid_free(solid);
  }
  T_RATIO(mean[0], 2.35, "held-out drawn slices: mean distance %.3f mm, largest %.1f", mean[0], most[0]);
  T_CHECK(mean[0] < mean[1], "better than linear blending of distance fields: mean %.3f mm, largest %.1f", mean[1],
          most[1]);
  free(points);
}

static void test_heart(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  batten_section_set set = {0};
  const char *path = shared_path("contours/rt_Heart.txt");
  if (!path) t_skip("heart", "no rt_Heart.txt under BATTEN_SHARED");
  if (path && T_CHECK(batten_read_sections(ctx, path, NULL, &set) == BATTEN_OK, "sections are read")) {
    T_RATIO(fabs(sum_of_slices(&set) / 439700 - 1), 1e-3, "sum of slices %.1f cm3", sum_of_slices(&set) / 1000);
    try_heart(ctx, &set, "heart");
    try_held_out(ctx, &set);
  }
  batten_section_set_free(ctx, &set);
  batten_context_free(ctx);
}

/* An egg in lobed slices, 3 apart: as the heart. */
static void test_heart_twin(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  stack_scene s = {0};
  for (int i = 0; i < 33; i++) {
    double z = 3 * (i - 16), r = sqrt(fmax(1 - z * z / 2601, 0)), p[2 * 140];
    stack_scene_slice(&s, z);
    for (int k = 0; k < 140; k++) {
      double a = 2 * SCENE_PI * k / 140, radius = r * (45 + 5 * cos(2 * a + 0.05 * z) + 3 * cos(3 * a - 0.03 * z));
      p[2 * k] = 0.1 * z + radius * cos(a);
      p[2 * k + 1] = radius * sin(a);
    }
    stack_scene_loop(&s, 140, p);
  }
  stack_scene_sections(&s);
  batten_section_set set = {.count = s.count, .sections = s.sections};
  try_heart(ctx, &set, "twin of the heart");
  stack_scene_free(&s);
  batten_context_free(ctx);
}

/* ---- a hull ------------------------------------------------------------------------------------------ */

/* Volume below a height by trapezoids along waterlines, then along stations: the table's own. */
static double table_displacement(const char *path, double draught) {
  enum { ROWS = 4096 };
  static double rows[ROWS][3];
  size_t count = 0;
  FILE *file = fopen(path, "r");
  char line[256];
  while (file && fgets(line, sizeof line, file) && count < ROWS)
    if (sscanf(line, "%lf,%lf,%lf", &rows[count][0], &rows[count][1], &rows[count][2]) == 3) count++;
  if (file) fclose(file);
  double volume = 0, station = 0, area = 0;
  bool first = true;
  for (double x = -INFINITY;;) {
    double next = INFINITY;
    for (size_t i = 0; i < count; i++)
      if (rows[i][0] > x) next = fmin(next, rows[i][0]);
    if (isinf(next)) return volume;
    double half = 0, z = -INFINITY, y = 0;
    for (;;) {
      double above = INFINITY, width = 0;
      for (size_t i = 0; i < count; i++)
        if (!(rows[i][0] < next) && !(rows[i][0] > next) && rows[i][1] > z && rows[i][1] < above)
          above = rows[i][1], width = rows[i][2];
      if (isinf(above)) break;
      if (z >= draught) break;
      if (!isinf(z)) {
        double top = fmin(above, draught), share = (top - z) / (above - z);
        half += (top - z) * (y + y + share * (width - y)) / 2;
      }
      z = above;
      y = width;
    }
    if (!first) volume += (next - station) * (half + area);
    first = false;
    station = x = next;
    area = half;
  }
}

/* The volume of a closed surface below a height T: integral of (z - T) n_z over what lies below. */
static double volume_below(const batten_mesh *mesh, double height) {
  const double *x = batten_mesh_vertices(mesh);
  const uint32_t *t = batten_mesh_triangles(mesh);
  double volume = 0;
  for (size_t i = 0; i < batten_mesh_triangle_count(mesh); i++) {
    double p[4][3]; /* the triangle below the plane */
    size_t n = 0;
    for (size_t j = 0; j < 3; j++) {
      const double *a = x + 3 * (size_t)t[3 * i + j], *b = x + 3 * (size_t)t[3 * i + (j + 1) % 3];
      if (a[2] <= height) memcpy(p[n++], a, sizeof *p);
      if ((a[2] <= height) == (b[2] <= height)) continue;
      double u = (height - a[2]) / (b[2] - a[2]);
      for (size_t k = 0; k < 3; k++) p[n][k] = a[k] + u * (b[k] - a[k]);
      n++;
    }
    for (size_t j = 2; j < n; j++) {
      double area = (p[j - 1][0] - p[0][0]) * (p[j][1] - p[0][1]) - (p[j - 1][1] - p[0][1]) * (p[j][0] - p[0][0]);
      volume += area / 2 * ((p[0][2] + p[j - 1][2] + p[j][2]) / 3 - height);
    }
  }
  return volume;
}

static void try_hull(batten_context *ctx, const char *path, const char *what, size_t draughts,
                     const double *draught) {
  batten_section_set set = {0};
  batten_solid *hull = NULL;
  batten_stack_info info = {0};
  batten_stack_options o = batten_stack_options_default();
  o.ends[0] = o.ends[1] = BATTEN_END_PLANE;
  o.apex = 1;
  if (!T_CHECK(batten_read_sections(ctx, path, NULL, &set) == BATTEN_OK, "sections are read")) return;
  T_CHECK(set.deck_count >= 2, "%s: %zu sections, %zu points of the deck", what, set.count, set.deck_count);
  batten_status st = batten_stack_build(ctx, set.count, set.sections, &o, &hull, &info, NULL, NULL);
  if (T_CHECK(st >= 0, "%s: %s", what, st < 0 ? batten_error(ctx) : "a hull")) {
    batten_mesh_measures m = {0};
    batten_mesh *mesh = surface_of(ctx, hull, 0.3, NULL, &m);
    printf("# %s: %zu triangles, genus %d, tolerance %.3g, %zu centres\n", what, batten_mesh_triangle_count(mesh),
           (int)m.genus, info.tolerance, info.centers);
    T_CHECK(m.closed && m.components == 1, "%s: one closed piece", what);
    for (size_t k = 0; k < draughts; k++) {
      double v = volume_below(mesh, draught[k]), t = table_displacement(path, draught[k]);
      T_RATIO(fabs(v / t - 1), 0.002, "%s: %.2f m3 at draught %g m, trapezoids of the table %.2f", what, v,
              draught[k], t);
    }
    batten_mesh_free(mesh);
  }
  batten_solid_free(hull);
  batten_section_set_free(ctx, &set);
}

static void test_hull(void) {
  static const double draughts[] = {2.787, 4};
  batten_context *ctx = t_context(NULL, NULL, 2);
  const char *path = shared_path("hulls/gunnerus_offsets.csv");
  if (path)
    try_hull(ctx, path, "Gunnerus", 2, draughts);
  else
    t_skip("hull", "no gunnerus_offsets.csv under BATTEN_SHARED");
  batten_context_free(ctx);
}

/* A ship of parabolas: y = 4 (1 - (x / 16)^2) (1 - ((6 - z) / 6)^4). */
static void test_hull_twin(void) {
  static const double draughts[] = {2.5, 5};
  char path[] = "batten-hull-XXXXXX";
  batten_context *ctx = t_context(NULL, NULL, 2);
  int descriptor = mkstemp(path);
  FILE *file = descriptor >= 0 ? fdopen(descriptor, "w") : NULL;
  if (T_CHECK(file, "a table of offsets is written")) {
    fprintf(file, "x_m,z_m,half_breadth_m\n");
    for (int i = -16; i <= 16; i++)
      for (int k = 0; k <= 12; k++) {
        double x = i, z = 0.5 * k, w = 1 - x * x / 256, d = (6 - z) / 6;
        fprintf(file, "%.6f,%.6f,%.6f\n", x, z, 4 * w * (1 - d * d * d * d));
      }
    fclose(file);
    char named[64];
    snprintf(named, sizeof named, "%s.csv", path);
    T_CHECK(rename(path, named) == 0, "named as one");
    try_hull(ctx, named, "twin of the ship", 2, draughts);
    remove(named);
  }
  batten_context_free(ctx);
}

/* ---- a torus in pieces ------------------------------------------------------------------------------- */

static batten_mesh *read_truth(batten_context *ctx, const char *path) {
  batten_mesh *mesh = NULL;
  batten_status st = batten_read_mesh(ctx, path, &mesh);
  if (st < 0) printf("# %s\n", batten_error(ctx));
  return mesh;
}

/* Both ways: points of one mesh to the other. */
static void compare(batten_context *ctx, const batten_solid *solid, const batten_mesh *truth, const char *what,
                    double mean_most, double hausdorff_most) {
  batten_mesh_measures m = {0};
  double mean[2], most[2];
  batten_mesh *mesh = surface_of(ctx, solid, 0.08, NULL, &m);
  if (!T_CHECK(mesh, "%s: has a surface", what)) return;
  mesh_distance(truth, batten_mesh_vertex_count(mesh), batten_mesh_vertices(mesh), &mean[0], &most[0]);
  mesh_distance(mesh, batten_mesh_vertex_count(truth), batten_mesh_vertices(truth), &mean[1], &most[1]);
  T_CHECK(m.components == 1 && m.closed && m.genus == 1, "%s: one closed piece with one hole", what);
  T_RATIO(fmax(mean[0], mean[1]), mean_most, "%s: mean distance %.4f, back %.4f", what, mean[0], mean[1]);
  T_RATIO(fmax(most[0], most[1]), hausdorff_most, "%s: Hausdorff distance %.4f", what, fmax(most[0], most[1]));
  batten_mesh_free(mesh);
}

static void test_torus(const char *name, const char *what, bool crossing) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  const char *path = shared_path("vipss/torus_gt.obj");
  batten_mesh *truth = path ? read_truth(ctx, path) : NULL;
  path = shared_path(name);
  if (!truth || !path) t_skip(what, "no torus under BATTEN_SHARED");
  batten_read_sections_options r = batten_read_sections_options_default();
  batten_section_set set = {0};
  batten_solid *solid = NULL;
  batten_stack_info info = {0};
  r.points = 1;
  if (truth && path &&
      T_CHECK(batten_read_sections(ctx, path, &r, &set) == BATTEN_OK, "%s: %s", what, batten_error(ctx))) {
    batten_stack_options o = batten_stack_options_default();
    o.method = BATTEN_SECTION_POINTS;
    o.saturation = INFINITY; /* a smooth body */
    o.ends[0] = o.ends[1] = BATTEN_END_ROUNDED;
    o.end_height[0] = o.end_height[1] = 0.5;
    batten_status st = batten_stack_build(ctx, set.count, set.sections, &o, &solid, &info, NULL, NULL);
    if (T_CHECK(st >= 0, "%s: %zu sections, %s", what, set.count, st < 0 ? batten_error(ctx) : "a solid")) {
      T_CHECK((info.route == BATTEN_ROUTE_SPACE) == crossing, "%s: %zu crossings, route %s", what, info.crossings,
              info.route == BATTEN_ROUTE_SPACE ? "space" : "sections");
      compare(ctx, solid, truth, what, crossing ? 0.0113 : 0.022, crossing ? 0.047 : 0.2);
    }
    batten_solid_free(solid);
    solid = NULL;
    /* the scattered way on the same points */
    size_t count;
    double *points = held_points(&set, 0, 1, 1, &count);
    st = batten_solid_fit(ctx, 3, count, points, NULL, &solid, NULL);
    if (T_CHECK(st >= 0, "%s, scattered: %s", what, st < 0 ? batten_error(ctx) : "a solid"))
      compare(ctx, solid, truth, crossing ? "crossing cuts, scattered" : "parallel cuts, scattered", 0.02, 0.2);
    batten_solid_free(solid);
    free(points);
  }
  batten_section_set_free(ctx, &set);
  batten_mesh_free(truth);
  batten_context_free(ctx);
}

int main(void) {
  test_heart();
  test_heart_twin();
  test_hull();
  test_hull_twin();
  test_torus("vipss/torus_parallelcut.xyz", "parallel cuts", false);
  test_torus("vipss/torus_crosscut_nonparallel.xyz", "crossing cuts", true);
  return t_done();
}
