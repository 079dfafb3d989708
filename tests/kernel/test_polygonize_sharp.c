/* Creases of f = 0 in the polygoniser's meshes: edges and corners of known solids, by distance from them. */
#include "polygonize_cases.h"

static batten_context *ctx;
static double seeds[3 * SEEDS_MAX];

/* ---- solids -------------------------------------------------------------------------------------- */

static double smaller(double a, const double *ga, double b, const double *gb, double *g) {
  memcpy(g, a <= b ? ga : gb, 3 * sizeof *g);
  return a <= b ? a : b;
}

static double ball_at(const double *x, double cx, double r, double *g) {
  double d[3] = {x[0] - cx, x[1], x[2]}, length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  for (int k = 0; k < 3; k++) g[k] = length > 0 ? -d[k] / length : 0;
  return r - length;
}

/* Around the z axis. */
static double tube_at(const double *x, double r, double *g) {
  double rho = hypot(x[0], x[1]);
  g[0] = rho > 0 ? -x[0] / rho : 0;
  g[1] = rho > 0 ? -x[1] / rho : 0;
  g[2] = 0;
  return r - rho;
}

static double slab_at(const double *x, double half, double *g) {
  g[0] = g[1] = 0;
  g[2] = x[2] > 0 ? -1 : 1;
  return half - fabs(x[2]);
}

static double shape_cylinder(const double *x, double *g) {
  double ga[3], gb[3], a = tube_at(x, 0.5, ga), b = slab_at(x, 0.6, gb);
  return smaller(a, ga, b, gb, g);
}

static double shape_half_ball(const double *x, double *g) {
  static const double down[3] = {0, 0, -1};
  double ga[3], a = ball_at(x, 0, 0.8, ga);
  return smaller(a, ga, 0.3 - x[2], down, g);
}

static double shape_two_balls(const double *x, double *g) {
  double ga[3], gb[3], a = ball_at(x, -0.35, 0.6, ga), b = ball_at(x, 0.35, 0.6, gb);
  return shape_larger(a, ga, b, gb, g);
}

static double shape_bored(const double *x, double *g) {
  double ga[3], gb[3], a = shape_cube(x, ga), b = tube_at(x, 0.25, gb);
  for (int k = 0; k < 3; k++) gb[k] = -gb[k];
  return smaller(a, ga, -b, gb, g);
}

/* The same two bodies joined by an R-function: its gradient turns smoothly everywhere but at the crease. */
static double shape_r_half_ball(const double *x, double *g) {
  double ga[3], a = ball_at(x, 0, 0.8, ga), b = 0.3 - x[2], r = hypot(a, b);
  for (int k = 0; k < 3; k++) g[k] = r > 0 ? ga[k] * (1 - a / r) - (k == 2) * (1 - b / r) : 0;
  return a + b - r;
}

/* Radius of shape_rounded's edge: mean, and what of it swings four times around. */
static double rounding, swing;

/* The half ball with a round edge. */
static double shape_rounded(const double *x, double *g) {
  static const double down[3] = {0, 0, -1};
  double ga[3], a = ball_at(x, 0, 0.8, ga), b = 0.3 - x[2];
  double radius = rounding * (1 + swing * sin(4 * atan2(x[1], x[0])));
  double u = radius - a, v = radius - b, r = hypot(u, v);
  if (!(u > 0 && v > 0)) return smaller(a, ga, b, down, g);
  for (int k = 0; k < 3; k++) g[k] = (u * ga[k] + v * down[k]) / r;
  return radius - r;
}

/* Half angle 30 degrees, tip at z = 0.6, floor z = -0.6. */
static double shape_cone(const double *x, double *g) {
  static const double up[3] = {0, 0, 1};
  double rho = hypot(x[0], x[1]), c = cos(acos(-1) / 6), s = 0.5;
  double side[3] = {rho > 0 ? -c * x[0] / rho : 0, rho > 0 ? -c * x[1] / rho : 0, -s};
  return smaller((0.6 - x[2]) * s - rho * c, side, x[2] + 0.6, up, g);
}

/* ---- curves -------------------------------------------------------------------------------------- */

/* Point number i of count on the solid's creases; false beyond the last. */
typedef bool (*crease_function)(size_t i, double *u);

enum { ON_EDGE = 11, ON_CIRCLE = 49 };

static bool cube_crease(size_t i, double *u) {
  size_t edge = i / ON_EDGE, axis = edge / 4;
  if (edge >= 12) return false;
  u[axis] = -0.5 + (double)(i % ON_EDGE) / (ON_EDGE - 1);
  u[(axis + 1) % 3] = edge & 1 ? 0.5 : -0.5;
  u[(axis + 2) % 3] = edge & 2 ? 0.5 : -0.5;
  return true;
}

static bool circle(size_t i, double r, double z, double *u) {
  double a = 2 * acos(-1) * (double)i / ON_CIRCLE;
  u[0] = r * cos(a);
  u[1] = r * sin(a);
  u[2] = z;
  return i < ON_CIRCLE;
}

static bool cylinder_crease(size_t i, double *u) {
  return circle(i % ON_CIRCLE, 0.5, i < ON_CIRCLE ? 0.6 : -0.6, u) && i < 2 * ON_CIRCLE;
}
static bool half_ball_crease(size_t i, double *u) { return circle(i, sqrt(0.55), 0.3, u); }
static bool two_balls_crease(size_t i, double *u) {
  double turned[3];
  bool more = circle(i, sqrt(0.36 - 0.35 * 0.35), 0, turned);
  u[0] = 0;
  u[1] = turned[0];
  u[2] = turned[1];
  return more;
}
static bool bored_crease(size_t i, double *u) {
  if (i < 2 * ON_CIRCLE) return circle(i % ON_CIRCLE, 0.25, i < ON_CIRCLE ? 0.5 : -0.5, u);
  return cube_crease(i - 2 * ON_CIRCLE, u);
}
static bool cone_crease(size_t i, double *u) {
  if (i > 0) return circle(i - 1, 1.2 * tan(acos(-1) / 6), -0.6, u);
  u[0] = u[1] = 0;
  u[2] = 0.6;
  return true;
}

/* ---- distances ----------------------------------------------------------------------------------- */

/* Squared distance of p from the triangle a b c: of its nearest point by regions (corner, side, inside). */
static double triangle_distance2(const double *p, const double *a, const double *b, const double *c) {
  double e[3], f[3], d[3], ee = 0, ef = 0, ff = 0, ed = 0, fd = 0, best = INFINITY;
  for (int k = 0; k < 3; k++) {
    e[k] = b[k] - a[k];
    f[k] = c[k] - a[k];
    d[k] = p[k] - a[k];
    ee += e[k] * e[k];
    ef += e[k] * f[k];
    ff += f[k] * f[k];
    ed += e[k] * d[k];
    fd += f[k] * d[k];
  }
  double det = ee * ff - ef * ef, s = (ff * ed - ef * fd) / det, t = (ee * fd - ef * ed) / det;
  if (det > 0 && s >= 0 && t >= 0 && s + t <= 1) {
    double sum = 0;
    for (int k = 0; k < 3; k++) sum += (d[k] - s * e[k] - t * f[k]) * (d[k] - s * e[k] - t * f[k]);
    return sum;
  }
  const double *side[4] = {a, b, c, a};
  for (int i = 0; i < 3; i++) {
    double along = 0, length = 0, sum = 0;
    for (int k = 0; k < 3; k++) {
      along += (p[k] - side[i][k]) * (side[i + 1][k] - side[i][k]);
      length += (side[i + 1][k] - side[i][k]) * (side[i + 1][k] - side[i][k]);
    }
    double u = length > 0 ? fmin(fmax(along / length, 0), 1) : 0;
    for (int k = 0; k < 3; k++) {
      double off = p[k] - side[i][k] - u * (side[i + 1][k] - side[i][k]);
      sum += off * off;
    }
    best = fmin(best, sum);
  }
  return best;
}

/* Triangles with a corner that is farther than the nearest so far by more than the longest edge are left out. */
static double mesh_distance(const polygonized *mesh, const double *p) {
  const double *v = batten_mesh_vertices(mesh->mesh);
  const uint32_t *t = batten_mesh_triangles(mesh->mesh);
  double best = INFINITY, reach = INFINITY;
  for (size_t i = 0; i < batten_mesh_triangle_count(mesh->mesh); i++) {
    const double *a = v + 3 * t[3 * i], d[3] = {p[0] - a[0], p[1] - a[1], p[2] - a[2]};
    if (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] > reach) continue;
    double here = triangle_distance2(p, a, v + 3 * t[3 * i + 1], v + 3 * t[3 * i + 2]);
    if (!(here < best)) continue;
    best = here;
    reach = sqrt(best) + 1.001 * mesh->m.edge_max;
    reach *= reach;
  }
  return sqrt(best);
}

/* Largest distance of the crease from the mesh, and of points of triangles from f = 0. */
static void distances(shape *s, const polygonized *made, crease_function crease, double *of_crease, double *of_mesh) {
  double u[3], x[3], g[3];
  *of_crease = *of_mesh = 0;
  for (size_t i = 0; crease(i, u); i++) {
    shape_to_world(s, u, x);
    *of_crease = fmax(*of_crease, mesh_distance(made, x));
  }
  const batten_mesh *mesh = made->mesh;
  const double *v = batten_mesh_vertices(mesh);
  const uint32_t *t = batten_mesh_triangles(mesh);
  for (size_t i = 0; i < batten_mesh_triangle_count(mesh); i++)
    for (int j = 0; j < 10; j++) {
      double a = (j % 4) / 3.0, b = fmin(1 - a, (j / 4) / 3.0), f = 0;
      for (size_t k = 0; k < 3; k++)
        x[k] = v[3 * t[3 * i] + k] * (1 - a - b) + v[3 * t[3 * i + 1] + k] * a + v[3 * t[3 * i + 2] + k] * b;
      batten_status st = shape_evaluate(s, ctx, 1, x, &f, g, NULL);
      double u3 = s->rotation[2][0] * (x[0] - s->origin[0]) + s->rotation[2][1] * (x[1] - s->origin[1]) +
                  s->rotation[2][2] * (x[2] - s->origin[2]);
      if (crease == cone_crease && u3 > 0.3) continue; /* few triangles go around the tip */
      if (st >= 0) *of_mesh = fmax(*of_mesh, fabs(f));
    }
}

/* ---- cases --------------------------------------------------------------------------------------- */

typedef struct expected {
  const char *name;
  shape_function function;
  crease_function crease;
  double cell, volume;
  double error; /* of chords: cell^2 / (8 r) and some more; 0 between planes */
  long genus;
} expected;

static void check_shape(const expected *e, double turn) {
  shape s = shape_make(e->function);
  double placed[3] = {0.011, -0.007, 0.013};
  memcpy(s.origin, placed, sizeof placed);
  if (turn != 0) shape_turn(&s, turn, 1.1);
  size_t n = shape_seeds(&s, 0.95, 300, 11, seeds);
  batten_polygonize_options o = shape_options(&s, 1.4, e->cell);
  polygonized plain = polygonize(ctx, &s, &o, n, seeds);
  o.sharp_deg = 35;
  polygonized p = polygonize(ctx, &s, &o, n, seeds);
  double of_crease, of_mesh, was, ignored;
  distances(&s, &plain, e->crease, &was, &ignored);
  distances(&s, &p, e->crease, &of_crease, &of_mesh);
  polygonized_print(e->name, &p);
  printf(
      "# crease vertices %zu, distance of creases %.2e (chamfered %.2e), of triangles %.2e (%.2e), volume off %.1e "
      "(%.1e), "
      "evaluations %zu of %zu, time %.3f of %.3f\n",
      p.info.crease_vertices, of_crease, was, of_mesh, ignored, p.m.volume - e->volume, plain.m.volume - e->volume,
      p.info.evaluations - plain.info.evaluations, plain.info.evaluations,
      p.info.time_improve_s - plain.info.time_improve_s, plain.info.time_improve_s);
  T_CHECK(p.status == BATTEN_OK && p.m.closed && p.m.manifold && p.m.oriented && p.m.genus == e->genus,
          "%s: closed oriented manifold of genus %ld: %s", e->name, p.m.genus, batten_error(ctx));
  T_CHECK(p.crossings == 0 && p.m.angle_min_deg > 5, "%s: no crossings, angles above %.1f degrees", e->name,
          p.m.angle_min_deg);
  T_CHECK(p.info.crease_vertices > 0 && plain.info.crease_vertices == 0, "%s: %zu vertices on creases", e->name,
          p.info.crease_vertices);
  double bound = e->error + 1e-5;
  T_RATIO(of_crease, bound, "%s: distance of its creases from the mesh", e->name);
  T_RATIO(of_mesh, bound, "%s: distance of the mesh from f = 0", e->name);
  T_RATIO(fabs(p.m.volume - e->volume), (bound)*e->volume * 6, "%s: volume", e->name);
  batten_mesh_free(plain.mesh);
  batten_mesh_free(p.mesh);
}

static void test_shapes(void) {
  const double pi = acos(-1), cut = 0.8 - 0.3, lens = 0.6 - 0.35;
  double half_ball = 4 * pi / 3 * 0.512 - pi * cut * cut * (3 * 0.8 - cut) / 3;
  const expected shapes[] = {
      {"cube", shape_cube, cube_crease, 0.08, 1, 0, 0},
      {"cylinder", shape_cylinder, cylinder_crease, 0.06, pi * 0.25 * 1.2, 0.06 * 0.06 / 2, 0},
      {"half ball", shape_half_ball, half_ball_crease, 0.06, half_ball, 0.06 * 0.06 / 2, 0},
      {"R-function", shape_r_half_ball, half_ball_crease, 0.06, half_ball, 0.06 * 0.06 / 2, 0},
      {"two balls", shape_two_balls, two_balls_crease, 0.06,
       8 * pi / 3 * 0.216 - 2 * pi * lens * lens * (3 * 0.6 - lens) / 3, 0.06 * 0.06 / 2, 0},
      {"bored", shape_bored, bored_crease, 0.05, 1 - pi * 0.0625, 0.05 * 0.05, 1},
      {"cone", shape_cone, cone_crease, 0.06, pi * 1.728 / 9, 0.06 * 0.06, 0},
  };
  for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++)
    for (int turned = 0; turned < 3; turned++) check_shape(shapes + i, 0.7 * turned);
  const expected fine = {"cube", shape_cube, cube_crease, 0.031, 1, 0, 0};
  check_shape(&fine, 0.7);
}

/* ---- nothing to do, the box, threads, failures ------------------------------------------------------ */

static bool same_mesh(const batten_mesh *a, const batten_mesh *b) {
  size_t v = batten_mesh_vertex_count(a), f = batten_mesh_triangle_count(a);
  if (v != batten_mesh_vertex_count(b) || f != batten_mesh_triangle_count(b)) return false;
  return memcmp(batten_mesh_triangles(a), batten_mesh_triangles(b), 3 * f * sizeof(uint32_t)) == 0 &&
         memcmp(batten_mesh_vertices(a), batten_mesh_vertices(b), 3 * v * sizeof(double)) == 0;
}

static void test_smooth(void) {
  const shape_function functions[] = {shape_ball, shape_torus};
  for (int i = 0; i < 2; i++) {
    shape s = shape_make(functions[i]);
    size_t n = shape_seeds(&s, 1.4, 200, 3, seeds);
    batten_polygonize_options o = shape_options(&s, 1.5, 0.1);
    polygonized plain = polygonize(ctx, &s, &o, n, seeds);
    o.sharp_deg = 20;
    polygonized p = polygonize(ctx, &s, &o, n, seeds);
    T_CHECK(p.info.crease_vertices == 0 && same_mesh(p.mesh, plain.mesh), "smooth: the same bits, %zu on creases",
            p.info.crease_vertices);
    batten_mesh_free(plain.mesh);
    batten_mesh_free(p.mesh);
  }
}

/* An edge that is rounded within a small part of a mesh edge is followed as if it were sharp, on the surface, also
 * where it is narrow here and there alone; one that triangles can show is not. */
static void test_rounded(void) {
  const double cell = 0.08, radii[] = {0.02, 0.1, 1.5}, swings[] = {0, 0.9, 0};
  const char *names[] = {"narrow", "uneven", "rounded"};
  for (int i = 0; i < 3; i++) {
    rounding = radii[i] * cell;
    swing = swings[i];
    shape s = shape_make(shape_rounded);
    size_t n = shape_seeds(&s, 0.95, 300, 5, seeds);
    batten_polygonize_options o = shape_options(&s, 1.4, cell);
    o.sharp_deg = 35;
    polygonized p = polygonize(ctx, &s, &o, n, seeds);
    polygonized_print(names[i], &p);
    double worst = 0, u[3];
    for (size_t k = 0; half_ball_crease(k, u); k++) worst = fmax(worst, mesh_distance(&p, u));
    double diagonal = 0;
    for (int k = 0; k < 3; k++) diagonal += (o.upper[k] - o.lower[k]) * (o.upper[k] - o.lower[k]);
    T_RATIO(p.info.distance_max, o.accuracy * sqrt(diagonal), "%s: vertices on the surface", names[i]);
    if (i < 2) {
      T_CHECK(p.info.crease_vertices > 50, "%s: %zu on creases", names[i], p.info.crease_vertices);
      T_RATIO(worst, rounding * (1 + swing) + cell * cell / 2, "%s: distance of creases", names[i]);
    } else {
      T_CHECK(p.info.crease_vertices == 0, "rounded: %zu on creases", p.info.crease_vertices);
    }
    batten_mesh_free(p.mesh);
  }
}

static double shape_noisy(const double *x, double *g) {
  double f = shape_cube(x, g), s[3], c[3];
  for (int k = 0; k < 3; k++) {
    s[k] = sin(40 * x[k]);
    c[k] = cos(40 * x[k]);
  }
  for (int k = 0; k < 3; k++) g[k] += 0.03 * 40 * c[k] * s[(k + 1) % 3] * s[(k + 2) % 3];
  return f + 0.03 * s[0] * s[1] * s[2];
}

/* Creases all over: followed or not, the surface crosses itself no more than without. */
static void test_noisy(void) {
  shape s = shape_make(shape_noisy);
  size_t n = shape_seeds(&s, 0.95, 300, 7, seeds);
  batten_polygonize_options o = shape_options(&s, 1.4, 0.04);
  polygonized plain = polygonize(ctx, &s, &o, n, seeds);
  o.sharp_deg = 35;
  polygonized p = polygonize(ctx, &s, &o, n, seeds);
  T_CHECK(p.m.manifold && p.crossings <= 2 * plain.crossings,
          "noisy: %zu pairs cross, %zu without creases (%zu on them)", p.crossings, plain.crossings,
          p.info.crease_vertices);
  batten_mesh_free(plain.mesh);
  batten_mesh_free(p.mesh);
}

/* The cylinder cut by a box through its axis: the circles end on the box. */
static void test_clipped(void) {
  shape s = shape_make(shape_cylinder);
  size_t n = shape_seeds(&s, 0.95, 300, 11, seeds);
  batten_polygonize_options o = shape_options(&s, 1.4, 0.06);
  o.sharp_deg = 35;
  o.lower[0] = 0.1;
  polygonized p = polygonize(ctx, &s, &o, n, seeds);
  double worst = 0, u[3];
  for (size_t i = 0; cylinder_crease(i, u); i++)
    if (u[0] >= 0.1) worst = fmax(worst, mesh_distance(&p, u));
  polygonized_print("clipped", &p);
  T_CHECK(p.status == BATTEN_W_CLIPPED && p.m.manifold && p.m.oriented && p.m.boundary_loops == 1 && p.crossings == 0,
          "clipped: one boundary loop, %zu vertices on creases", p.info.crease_vertices);
  T_CHECK(p.m.lower[0] == 0.1, "clipped: ends on the box");
  T_RATIO(worst, 0.06 * 0.06 / 2, "clipped: distance of creases");
  batten_mesh_free(p.mesh);
}

static batten_status call(batten_context *other, void *arg) {
  shape s = *(shape *)arg;
  batten_polygonize_options o = shape_options(&s, 1.4, 0.25);
  batten_field field = shape_field(&s);
  batten_mesh *mesh = NULL;
  double seed[3];
  double u[3] = {0.5, 0.1, 0.2};
  shape_to_world(&s, u, seed);
  o.sharp_deg = 35;
  batten_status st = batten_polygonize(other, &field, 1, seed, &o, &mesh, NULL);
  batten_mesh_free(mesh);
  return st;
}

static void test_invariance(void) {
  shape s = shape_make(shape_bored);
  shape_turn(&s, 0.7, 1.1);
  size_t n = shape_seeds(&s, 0.95, 300, 11, seeds);
  batten_polygonize_options o = shape_options(&s, 1.4, 0.07);
  o.sharp_deg = 35;
  polygonized first = polygonize(ctx, &s, &o, n, seeds);
  for (unsigned threads = 1; threads <= 5; threads += 4) {
    batten_context *other = t_context(NULL, NULL, threads);
    polygonized p = polygonize(other, &s, &o, 1, seeds + 3 * threads);
    T_CHECK(same_mesh(first.mesh, p.mesh), "%u threads, one seed: the same bits", threads);
    batten_mesh_free(p.mesh);
    batten_context_free(other);
  }
  batten_mesh_free(first.mesh);
  shape small = shape_make(shape_cube);
  t_fail_every_allocation("sharp edges", call, &small);
  t_cancel_every_progress("sharp edges", call, &small);
  o.sharp_deg = 5;
  polygonized p = polygonize(ctx, &s, &o, n, seeds);
  T_STATUS(p.status, BATTEN_E_INVALID, ctx, "opt.sharp_deg: 5; give an angle from 15 to 170 degrees, or 0");
}

int main(void) {
  ctx = t_context(NULL, NULL, 2);
  test_shapes();
  test_smooth();
  test_rounded();
  test_noisy();
  test_clipped();
  test_invariance();
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all released");
  batten_context_free(ctx);
  return t_done();
}
