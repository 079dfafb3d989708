/* Lofts through the slices of a heart and the frames of a ship: proven, and the same solid by other means. The heart
 * beside the volume spline through points of its slices (volume, distances) and beside its slices' areas; the ship's
 * displacement beside trapezoids of its table of offsets. Twins that are made here stand in without the data. */
#include <batten/loft.h>
#include <batten/mesh.h>

#include "loft_slices.h"

enum { EVERY = 6, PARTS = 6, STEPS = 400 };

/* ---- lofts ---------------------------------------------------------------------------------------- */

static batten_loft *make_loft(batten_context *ctx, const char *what, const stack *s, batten_loft_info *info) {
  batten_curve *curves[SLICES] = {NULL};
  batten_loft *loft = NULL;
  batten_loft_match_options m = batten_loft_match_options_default();
  m.fit.closed = s->closed;
  batten_status st = batten_loft_match(ctx, s->count, s->starts, s->points[0], &m, curves, NULL);
  if (st >= 0) {
    st = batten_loft_build(ctx, s->count, (const batten_curve *const *)curves, s->heights, NULL, &loft, NULL, info);
    T_CHECK(st == BATTEN_OK && info->certified && info->sign_violations == 0 && info->sign_pairs > 0,
            "%s: all %zu pairs proven, %zu free, %zu wrong without inequalities; margin %.3g %s", what,
            info->sign_pairs, info->sign_pairs_free, info->sign_violations_unconstrained, info->margin_min,
            st ? batten_error(ctx) : "");
  } else
    t_line(false, "%s: %s", what, batten_error(ctx));
  if (loft) {
    T_RATIO(info->interpolation_error, 1e-12, "%s: off the contours, in parts of the size", what);
    T_RATIO(info->continuity_error, 1e-10, "%s: jumps of derivatives", what);
    printf(
        "# %s: %zu contours, degree (%u, %u), %zu unknowns, %zu inequalities; prepare %.2f objective %.2f rows "
        "%.2f programs %.2f check %.2f s\n",
        what, info->contours, info->degree_t, info->degree_z, info->unknowns, info->rows, info->time_prepare_s,
        info->time_objective_s, info->time_rows_s, info->time_qp_s, info->time_check_s);
  }
  for (size_t i = 0; i < s->count; i++) batten_curve_free(curves[i]);
  return loft;
}

/* ---- a heart -------------------------------------------------------------------------------------- */

/* The solid between the planes of the first and last slice. */
static batten_mesh *make_mesh(batten_context *ctx, const stack *s) {
  batten_mesh *mesh = NULL;
  batten_polygonize_options p = batten_polygonize_options_default();
  double start = batten_now();
  batten_solid *solid = slices_solid(ctx, s, EVERY);
  if (!T_CHECK(solid, "the solid of the slices: %s", solid ? "" : batten_error(ctx))) return NULL;
  batten_field field = batten_solid_field(solid);
  size_t count;
  const double *points = batten_solid_points(solid, &count);
  batten_solid_box(solid, p.lower, p.upper);
  for (size_t c = 0; c < 2; c++) {
    double room = 0.25 * (p.upper[c] - p.lower[c]);
    p.lower[c] -= room;
    p.upper[c] += room;
  }
  p.lower[2] = s->heights[0];
  p.upper[2] = s->heights[s->count - 1];
  p.cell = (p.upper[0] - p.lower[0]) / 40;
  p.accuracy = 1e-4;
  p.improve = 1;
  T_CHECK(batten_polygonize(ctx, &field, count, points, &p, &mesh, NULL) == BATTEN_W_CLIPPED,
          "polygonised and cut at the end planes: %s", batten_error(ctx));
  printf("# solid of %zu points, polygonised: %.2f s\n", count, batten_now() - start);
  batten_solid_free(solid);
  return mesh;
}

/* Inside a mesh that is open at planes z = const alone, which add nothing: integral of x by the normal's x. */
static double open_volume(const batten_mesh *mesh) {
  const double *v = batten_mesh_vertices(mesh);
  const uint32_t *t = batten_mesh_triangles(mesh);
  double sum = 0;
  for (size_t k = 0; k < batten_mesh_triangle_count(mesh); k++) {
    const double *a = v + 3 * t[3 * k], *b = v + 3 * t[3 * k + 1], *c = v + 3 * t[3 * k + 2];
    double normal = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1]);
    sum += (a[0] + b[0] + c[0]) / 3 * normal / 2;
  }
  return sum;
}

static int by_value(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

typedef struct heart_bounds {
  double areas, volume, mean, most; /* volumes in parts; distances over the gap of slices */
} heart_bounds;

static void check_heart(batten_context *ctx, const char *what, const stack *s, heart_bounds allowed) {
  batten_loft_info info;
  batten_loft_measures measures;
  batten_surface *surface = NULL;
  batten_loft *loft = make_loft(ctx, what, s, &info);
  if (!loft) return;
  T_OK(batten_loft_measure(ctx, loft, &measures), ctx);
  T_OK(batten_loft_surface(ctx, loft, &surface), ctx);
  double areas = 0, ends = 0, gap = (s->heights[s->count - 1] - s->heights[0]) / (double)(s->count - 1);
  for (size_t i = 0; i < s->count; i++) {
    double area = fabs(slice_area(s, i)), half = i == 0 || i + 1 == s->count ? 0.5 : 1;
    areas += half * area * gap;
    ends += (1 - half) * area * gap;
  }
  double volume = fabs(measures.volume);
  printf("# %s: volume %.6g, of slices %.6g between the end planes, %.6g with half a gap beyond\n", what, volume,
         areas, areas + ends);
  T_RATIO(fabs(volume / areas - 1), allowed.areas, "%s: volume beside the areas of its slices", what);
  batten_mesh *mesh = make_mesh(ctx, s);
  if (mesh && surface) {
    size_t count = batten_mesh_vertex_count(mesh);
    double *places = malloc(2 * count * sizeof *places), *distances = malloc(count * sizeof *distances), mean = 0;
    if (!places || !distances) abort();
    double solid = open_volume(mesh), start = batten_now();
    batten_status st = batten_surface_closest(ctx, surface, count, batten_mesh_vertices(mesh), places, distances);
    T_CHECK(st >= 0, "%s: distances of %zu vertices: %s", what, count, st ? batten_error(ctx) : "");
    for (size_t k = 0; k < count; k++) mean += distances[k] / (double)count;
    qsort(distances, count, sizeof *distances, by_value);
    printf(
        "# %s: %zu vertices of the solid, volume %.6g, off the loft: mean %.3g, 90 %% %.3g, largest %.3g; %.2f s\n",
        what, count, solid, mean, distances[count * 9 / 10], distances[count - 1], batten_now() - start);
    T_RATIO(fabs(volume / solid - 1), allowed.volume, "%s: volume beside the volume spline", what);
    T_RATIO(mean / gap, allowed.mean, "%s: mean distance from the volume spline, in gaps of slices", what);
    T_RATIO(distances[count - 1] / gap, allowed.most, "%s: largest distance", what);
    free(places);
    free(distances);
  }
  batten_mesh_free(mesh);
  batten_surface_free(surface);
  batten_loft_free(loft);
}

/* ---- a ship --------------------------------------------------------------------------------------- */

/* Integral of x dy over a polyline below y = draught. */
static double area_below(size_t count, const double (*p)[2], double draught) {
  double sum = 0;
  for (size_t k = 1; k < count; k++) {
    double a[2] = {p[k - 1][0], p[k - 1][1]}, b[2] = {p[k][0], p[k][1]};
    if (fmin(a[1], b[1]) >= draught) continue;
    double part = (draught - a[1]) / (b[1] - a[1]), cut[2] = {a[0] + part * (b[0] - a[0]), draught};
    if (b[1] > draught) memcpy(b, cut, sizeof b);
    if (a[1] > draught) memcpy(a, cut, sizeof a);
    sum += 0.5 * (a[0] + b[0]) * (b[1] - a[1]);
  }
  return sum;
}

static double table_displacement(const stack *s, double draught) {
  double sum = 0, last = 0;
  for (size_t i = 0; i < s->count; i++) {
    double own = area_below(s->starts[i + 1] - s->starts[i], (const double(*)[2])s->points + s->starts[i], draught);
    if (i > 0) sum += (last + own) * (s->heights[i] - s->heights[i - 1]); /* of both sides */
    last = own;
  }
  return sum;
}

/* By trapezoids of sections, so many steps from station to station. */
static double displacement(batten_context *ctx, const batten_loft *loft, size_t parts, double draught) {
  static batten_curve_point at[STEPS + 1];
  static double polyline[STEPS + 1][2], t[STEPS + 1];
  batten_loft_form f = batten_loft_get(loft);
  double sum = 0, last_area = 0, last_z = 0;
  for (size_t k = 0; k <= STEPS; k++) t[k] = (double)k / STEPS;
  for (size_t i = 0; i <= (f.contours - 1) * parts; i++) {
    batten_curve *section = NULL;
    size_t below = i / parts;
    double part = (double)(i % parts) / (double)parts, z = f.heights[below];
    if (part > 0) z += part * (f.heights[below + 1] - z);
    if (batten_loft_section(ctx, loft, z, &section) < 0 || batten_curve_evaluate(ctx, section, STEPS + 1, t, at) < 0)
      t_line(false, "section at %g: %s", z, batten_error(ctx));
    for (size_t k = 0; k <= STEPS; k++) memcpy(polyline[k], at[k].point, sizeof polyline[k]);
    double area = area_below(STEPS + 1, (const double(*)[2])polyline, draught);
    if (i > 0) sum += (area + last_area) * (z - last_z); /* of both sides */
    last_area = area;
    last_z = z;
    batten_curve_free(section);
  }
  return sum;
}

/* Trapezoids lie inside round bilges: through few waterlines the table holds less than its frames by some percent.
 * Sections at the stations alone hold what all sections do. */
static void check_ship(batten_context *ctx, const char *what, const stack *s, const double draughts[2],
                       const double allowed[2]) {
  batten_loft_info info;
  batten_loft *loft = make_loft(ctx, what, s, &info);
  for (size_t k = 0; k < 2 && loft; k++) {
    double own = displacement(ctx, loft, PARTS, draughts[k]), at_stations = displacement(ctx, loft, 1, draughts[k]);
    double table = table_displacement(s, draughts[k]);
    printf("# %s: displacement at draught %g: %.6g, by sections at stations %.6g, by the table %.6g\n", what,
           draughts[k], own, at_stations, table);
    T_RATIO(fabs(own / table - 1), allowed[k], "%s: displacement at draught %g beside the table", what, draughts[k]);
    T_RATIO(fabs(own / at_stations - 1), 0.005, "%s: the same beside sections at stations", what);
  }
  batten_loft_free(loft);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  static stack heart = {.closed = true}, heart_twin = {.closed = true}, ship, ship_twin;
  make_heart(&heart_twin);
  make_ship(&ship_twin);
  check_heart(ctx, "pixels", &heart_twin, (heart_bounds){0.005, 0.005, 0.15, 1.5});
  check_ship(ctx, "frames", &ship_twin, (double[2]){0.4, 0.8}, (double[2]){0.015, 0.005});
  if (read_heart(&heart))
    check_heart(ctx, "heart", &heart, (heart_bounds){0.005, 0.005, 0.15, 1.5});
  else
    t_skip("heart", "no data");
  if (read_ship(&ship))
    check_ship(ctx, "ship", &ship, (double[2]){2, 4}, (double[2]){0.04, 0.015});
  else
    t_skip("ship", "no data");
  T_CHECK(batten_bytes_in_use(ctx) == 0, "no memory is left");
  batten_context_free(ctx);
  return t_done();
}
