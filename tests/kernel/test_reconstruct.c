/* The unoriented hard cases from points to surface, with default options: the right number of pieces and the right
 * genus, no phantom sheet, sides right. Prints the table of docs/solids.md: what needed the cure. */
#include <batten/batten.h>

#include "phobos.h"
#include "scenes.h"
#include "tap.h"

enum { POINTS_MAX = 6000, PROBES = 4000 };

typedef struct shape {
  const char *name;
  unsigned n;
  size_t (*points)(double *points); /* returns how many, 0 = not at hand */
  double (*truth)(const double *p); /* positive inside; NULL = not known */
  size_t components;                /* of the surface */
  long genus;                       /* in the plane: holes */
} shape;

static size_t read_xyz(const char *name, double *points) {
  char path[4096];
  const char *folder = getenv("BATTEN_SHARED");
  snprintf(path, sizeof path, "%s/data/vipss/%s", folder ? folder : "", name);
  FILE *file = folder ? fopen(path, "r") : NULL;
  size_t count = 0;
  if (!file) return 0;
  while (count < POINTS_MAX && fscanf(file, "%lf %lf %lf%*[^\n]", points, points + 1, points + 2) == 3)
    points += 3, count++;
  fclose(file);
  return count;
}

static size_t thick_c(double *p) { return scene_c_points(59, p), (size_t)59; }
static size_t two_contours(double *p) { return scene_pair_points(67, p), (size_t)67; }
static size_t sphere(double *p) { return scene_sphere_points(1, 300, p), (size_t)300; }
static size_t shell(double *p) { return scene_shell_points(1, 700, p), (size_t)700; }
static size_t torus(double *p) { return scene_torus_points(1, 600, p), (size_t)600; }
static size_t links(double *p) { return scene_links_points(1, 900, p), (size_t)900; }
static size_t plate(double *p) { return scene_plate_points(1, p); }
static size_t cube(double *p) { return scene_cube_points(1, 90, p), (size_t)90; }
static size_t moon(double *p) { return scene_moon_points(1, 942, p), (size_t)942; }
static size_t torus_parallel(double *p) { return read_xyz("torus_parallelcut.xyz", p); }
static size_t torus_crossed(double *p) { return read_xyz("torus_crosscut_nonparallel.xyz", p); }
static size_t vertebra(double *p) { return read_xyz("vertebra_500.xyz", p); }
static size_t phobos_942(double *p) {
  phobos all = phobos_points();
  phobos_draw(&all, 1);
  memcpy(p, all.points, 942 * 3 * sizeof *p);
  free(all.points);
  return all.real ? 942 : 0;
}

static const shape shapes[] = {
    {"thick C, 59 points", 2, thick_c, scene_c, 1, 0},
    {"two contours, 67 points", 2, two_contours, scene_pair, 2, 0},
    {"sphere, 300 points", 3, sphere, scene_sphere, 1, 0},
    {"hollow ball, 700 points", 3, shell, scene_shell, 2, 0},
    {"cube, 90 points", 3, cube, scene_cube, 1, 0},
    {"small moon, 942 points", 3, moon, scene_moon, 1, 0},
    {"torus, 600 points", 3, torus, scene_torus, 1, 1},
    {"two linked tori, 900 points", 3, links, scene_links, 2, 2},
    {"thin plate, sides 5 spacings apart", 3, plate, scene_plate, 1, 0},
    {"torus on parallel cuts (VIPSS)", 3, torus_parallel, NULL, 1, 1},
    {"torus on crossing cuts (VIPSS)", 3, torus_crossed, NULL, 1, 1},
    {"vertebra (VIPSS)", 3, vertebra, NULL, 1, 1},
    {"Phobos, 942 points", 3, phobos_942, NULL, 1, 0},
};

/* Share of random points around the box, farther than `margin` from the true surface, whose side is wrong. */
static double wrong_sides(batten_context *ctx, const shape *s, const batten_solid *solid, double margin) {
  static double probes[PROBES * 3], values[PROBES];
  uint64_t seed = 7;
  size_t made = 0;
  double lower[3], upper[3];
  batten_solid_box(solid, lower, upper);
  while (made < PROBES) {
    double *p = probes + made * s->n;
    for (unsigned c = 0; c < s->n; c++) p[c] = lower[c] + (upper[c] - lower[c]) * (1.4 * scene_uniform(&seed) - 0.2);
    if (fabs(s->truth(p)) > margin) made++;
  }
  if (batten_solid_evaluate(ctx, solid, PROBES, probes, values, NULL, NULL) < 0) return 1;
  size_t wrong = 0;
  for (size_t i = 0; i < PROBES; i++) wrong += (s->truth(probes + i * s->n) > 0) != (values[i] >= 0);
  return (double)wrong / PROBES;
}

/* Components and genus of the outline: outer loops and holes. */
static bool trace(batten_context *ctx, const batten_solid *solid, size_t *components, long *holes, double *area) {
  size_t count;
  const double *points = batten_solid_points(solid, &count);
  batten_field field = batten_solid_field(solid);
  batten_outline *outline = NULL;
  if (batten_trace_outline(ctx, &field, count, points, NULL, &outline, NULL) != BATTEN_OK) return false;
  *components = 0, *holes = 0;
  for (size_t i = 0; i < batten_outline_loop_count(outline); i++) {
    size_t n;
    int closed;
    const double *x = batten_outline_loop(outline, i, &n, &closed);
    double twice = 0;
    for (size_t j = 0; j < n; j++) {
      const double *a = x + 2 * j, *b = x + 2 * ((j + 1) % n);
      twice += a[0] * b[1] - a[1] * b[0];
    }
    if (twice > 0)
      ++*components;
    else
      ++*holes;
  }
  *area = batten_outline_area(outline);
  batten_outline_free(outline);
  return true;
}

static bool polygonize(batten_context *ctx, const batten_solid *solid, batten_mesh_measures *m, size_t *crossings) {
  size_t count;
  const double *points = batten_solid_points(solid, &count);
  batten_field field = batten_solid_field(solid);
  batten_mesh *mesh = NULL;
  bool ok = batten_polygonize(ctx, &field, count, points, NULL, &mesh, NULL) == BATTEN_OK &&
            batten_mesh_measure(ctx, mesh, m) == BATTEN_OK &&
            batten_mesh_self_intersections(ctx, mesh, crossings) == BATTEN_OK;
  batten_mesh_free(mesh);
  return ok;
}

static void reconstruct(batten_context *ctx, const shape *s) {
  static const char *const signs[] = {"clean", "cured", "ambiguous"};
  static const char *const orientations[] = {"none", "given", "estimated"};
  static double points[POINTS_MAX * 3];
  size_t count = s->points(points);
  if (!count) {
    t_skip(s->name, "../shared/data is not at hand");
    return;
  }
  batten_solid *solid = NULL;
  batten_solid_info info;
  batten_status status = batten_solid_fit(ctx, s->n, count, points, NULL, &solid, &info);
  if (!T_CHECK(status == BATTEN_OK, "%s: %s %s", s->name, batten_status_name(status),
               status ? batten_error(ctx) : "") &&
      status < 0)
    return;
  size_t components = 0, crossings = 0;
  long genus = 0;
  double size = 0, share = 1;
  bool closed = true;
  if (s->n == 2) {
    closed = trace(ctx, solid, &components, &genus, &size);
  } else {
    batten_mesh_measures m = {0};
    closed = polygonize(ctx, solid, &m, &crossings) && m.closed && m.manifold && m.oriented;
    components = m.components, genus = m.genus, size = m.volume, share = m.angles_above_20deg;
  }
  /* No sample says more about the surface than its spacing does. */
  double wrong = s->truth ? wrong_sides(ctx, s, solid, fmax(0.1, info.spacing)) : 0;
  printf("# | %s | %s | %s | %zu | %ld | %.4g | %.3f | %.2f |\n", s->name, signs[info.sign],
         orientations[info.orientation], components, genus, size, 100 * wrong,
         info.time_fit_s + info.time_check_s + info.time_orient_s);
  T_CHECK(closed && components == s->components && genus == s->genus,
          "%s: %zu components, genus %ld, closed manifold %d, first check: weak %zu flipped %zu pieces %zu cells %zu",
          s->name, components, genus, closed, info.check.weak_gradients, info.check.flipped_neighbours,
          info.check.phantom_components, info.check.phantom_cells);
  T_CHECK(info.check_final.clean && info.check_final.phantom_components == 0,
          "%s: no phantom sheet (%zu cells far from data)", s->name, info.check_final.phantom_cells);
  T_CHECK(crossings == 0 && share >= 0.99, "%s: %zu self-intersections, %.2f %% of the triangles above 20 degrees",
          s->name, crossings, 100 * share);
  T_RATIO(wrong, 0.0, "%s: share of probes on the wrong side", s->name);
  batten_solid_free(solid);
}

int main(int argc, char **argv) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  printf("# | shape | sign check | orientation | components | genus | volume | wrong side %% | fit s |\n");
  printf("# |---|---|---|---|---|---|---|---|\n");
  for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++)
    if (argc < 2 || strstr(shapes[i].name, argv[1])) reconstruct(ctx, &shapes[i]);
  batten_context_free(ctx);
  return t_done();
}
