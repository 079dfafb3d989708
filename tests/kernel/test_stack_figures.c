/* How near solids of sections come to what was cut: a torus that leans by 45 degrees, and the paper's test function
 * of two variables. Errors fall with the fourth power of the slices' distance by cubic splines, with the second by
 * lines. [Savchenko et al. 1995, sections 4 and 5.5] */
#include <batten/batten.h>

#include "stack_function.h"
#include "stack_scenes.h"
#include "tap.h"

static const double LEAN = SCENE_PI / 4;

/* Mean distance of the surface's vertices between the end planes from the torus, outer radius 1. */
static double torus_error(batten_context *ctx, size_t slices, batten_stack_between between) {
  stack_scene s = {0};
  stack_scene_leaning_torus(&s, LEAN, slices, 0.03);
  const batten_section *given = stack_scene_sections(&s);
  batten_stack_options o = batten_stack_options_default();
  batten_polygonize_options p = batten_polygonize_options_default();
  batten_solid *solid = NULL;
  batten_mesh *mesh = NULL;
  o.between = between;
  o.saturation = INFINITY; /* a smooth body */
  o.tolerance = 0.002;
  p.cell = 0.09;
  batten_status st = batten_stack_build(ctx, slices, given, &o, &solid, NULL, NULL, NULL);
  double mean = 0, top = given[slices - 1].origin[2];
  size_t count = 0, seeds = 0;
  if (st >= 0) {
    batten_field field = batten_solid_field(solid);
    const double *points = batten_solid_points(solid, &seeds);
    st = batten_polygonize(ctx, &field, seeds, points, &p, &mesh, NULL);
  }
  T_CHECK(st >= 0, "%zu slices: %s", slices, st < 0 ? batten_error(ctx) : "a surface");
  for (size_t i = 0; st >= 0 && i < batten_mesh_vertex_count(mesh); i++) {
    const double *v = batten_mesh_vertices(mesh) + 3 * i;
    if (fabs(v[2]) > top) continue;
    mean += fabs(scene_leaning_torus(LEAN, v));
    count++;
  }
  batten_mesh_free(mesh);
  batten_solid_free(solid);
  stack_scene_free(&s);
  return count ? mean / (double)count : NAN;
}

static void test_torus(batten_context *ctx) {
  static const struct {
    const char *name;
    batten_stack_between between;
    size_t slices;
    double most;
  } trials[] = {{"linear", BATTEN_BETWEEN_LINEAR, 12, 0.0055},
                {"natural", BATTEN_BETWEEN_NATURAL, 8, 0.0045},
                {"natural", BATTEN_BETWEEN_NATURAL, 12, 0.002},
                {"natural", BATTEN_BETWEEN_NATURAL, 24, 0.0006},
                {"not-a-knot", BATTEN_BETWEEN_NOT_A_KNOT, 12, 0.002}};
  for (size_t i = 0; i < sizeof trials / sizeof *trials; i++) {
    double mean = torus_error(ctx, trials[i].slices, trials[i].between);
    T_RATIO(mean, trials[i].most, "torus of %zu slices, %s: mean %.5f of its radius", trials[i].slices,
            trials[i].name, mean);
  }
}

static void test_function(batten_context *ctx) {
  double linear = function_error(ctx, 50, 50, BATTEN_BETWEEN_LINEAR);
  double coarse = function_error(ctx, 25, 50, BATTEN_BETWEEN_LINEAR);
  double smooth = function_error(ctx, 50, 50, BATTEN_BETWEEN_NOT_A_KNOT);
  double natural = function_error(ctx, 50, 50, BATTEN_BETWEEN_NATURAL);
  T_CHECK(linear >= 0 && smooth >= 0 && natural >= 0 && coarse >= 0, "the paper's function, 50 nodes on each slice");
  T_RATIO(linear, 0.006, "50 slices, linear: RMS %.4f of a range of 8.4", linear);
  T_RATIO(smooth, 0.001, "50 slices, not-a-knot: RMS %.5f", smooth);
  printf("# natural: RMS %.5f\n", natural);
  T_CHECK(coarse > 3 * linear, "25 slices, linear: RMS %.4f, four times as much", coarse);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_torus(ctx);
  test_function(ctx);
  batten_context_free(ctx);
  return t_done();
}
