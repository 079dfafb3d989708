/* The surface f = 0 of known shapes: topology, figures, quality of the triangles. */
#include "polygonize_cases.h"

static batten_context *ctx;
static double seeds[3 * SEEDS_MAX];

typedef struct expected {
  const char *name;
  shape_function function;
  double reach, cell;
  size_t components;
  long genus;
  double area, volume; /* 0 = not known in closed form */
} expected;

static void check_shape(const expected *e) {
  shape s = shape_make(e->function);
  shape_turn(&s, 0.7, 1.1);
  size_t n = shape_seeds(&s, 0.55 * e->reach, 500, 11, seeds);
  batten_polygonize_options o = shape_options(&s, e->reach, e->cell);
  polygonized p = polygonize(ctx, &s, &o, n, seeds);
  polygonized_print(e->name, &p);
  T_CHECK(p.status == BATTEN_OK && p.m.closed && p.m.manifold && p.m.oriented, "%s: closed oriented manifold",
          e->name);
  T_CHECK(p.m.components == e->components && p.m.genus == e->genus, "%s: %zu components of genus %ld", e->name,
          p.m.components, p.m.genus);
  T_CHECK(p.crossings == 0, "%s: %zu self-intersections", e->name, p.crossings);
  T_CHECK(p.m.angles_above_20deg >= 0.99, "%s: all angles >= 20 degrees in %.2f %% of the triangles", e->name,
          100 * p.m.angles_above_20deg);
  double box = sqrt(3.0) * 2.015625 * e->reach;
  T_RATIO(p.info.distance_max / box, 1e-6, "%s: distance from f = 0 over the box", e->name);
  T_CHECK(!p.info.clipped && p.info.seeds_missed == 0 && p.info.evaluations == s.points,
          "%s: %zu evaluations counted", e->name, p.info.evaluations);
  if (e->volume > 0) {
    /* Corners on a surface with radii of curvature >= 0.35: chords lie inside by less than (edge / 2)^2 / 0.35. */
    double bound = e->cell * e->cell / 0.35 * e->area;
    T_RATIO(fabs(p.m.volume - e->volume), 0.35 * bound, "%s: volume", e->name);
    T_RATIO(fabs(p.m.area - e->area), bound, "%s: area", e->name);
  }
  batten_mesh_free(p.mesh);
}

static void test_shapes(void) {
  const double pi = acos(-1);
  const expected shapes[] = {
      {"ball", shape_ball, 1.3, 0.08, 1, 0, 4 * pi, 4 * pi / 3},
      {"torus", shape_torus, 1.5, 0.08, 1, 1, 4 * pi * pi * 0.35, 2 * pi * pi * 0.35 * 0.35},
      {"links", shape_links, 2.6, 0.1, 2, 2, 8 * pi * pi * 0.35, 4 * pi * pi * 0.35 * 0.35},
      {"eight", shape_eight, 1.3, 0.05, 1, 2, 0, 0},
      {"plate", shape_plate, 1.6, 0.04, 1, 0, 0, 0},
      {"cube", shape_cube, 0.95, 0.04, 1, 0, 0, 0},
  };
  for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) check_shape(shapes + i);
}

/* Halving the cell divides the error by 4. */
static void test_convergence(void) {
  double volume[3], area[3];
  const double pi = acos(-1);
  shape s = shape_make(shape_ball);
  size_t n = shape_seeds(&s, 1.3, 100, 5, seeds);
  for (int i = 0; i < 3; i++) {
    batten_polygonize_options o = shape_options(&s, 1.3, ldexp(0.2, -i));
    polygonized p = polygonize(ctx, &s, &o, n, seeds);
    volume[i] = fabs(p.m.volume - 4 * pi / 3);
    area[i] = fabs(p.m.area - 4 * pi);
    batten_mesh_free(p.mesh);
  }
  for (int i = 0; i < 2; i++) {
    double order_volume = log2(volume[i] / volume[i + 1]), order_area = log2(area[i] / area[i + 1]);
    T_CHECK(fabs(order_volume - 2) < 0.25 && fabs(order_area - 2) < 0.25,
            "orders of volume and area %.2f %.2f, expected 2", order_volume, order_area);
  }
}

int main(void) {
  ctx = t_context(NULL, NULL, 2);
  test_shapes();
  test_convergence();
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all released");
  batten_context_free(ctx);
  return t_done();
}
