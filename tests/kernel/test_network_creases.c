/* Surfaces with creases, boundary curves and lines, from the mesh to the finished patches. */
#include <batten/network.h>

#include "network_scenes.h"
#include "tap.h"

static batten_context *ctx;

static const batten_network_fill fills[] = {BATTEN_FILL_SS, BATTEN_FILL_DEGREE7, BATTEN_FILL_DEGREE6,
                                            BATTEN_FILL_FAIR, BATTEN_FILL_FAIR_LINEAR};
static const char *const fill_names[] = {"ss", "degree7", "degree6", "fair", "fair-linear"};
enum { FILLS = sizeof fills / sizeof *fills };

static batten_network *build(const scene_mesh *m, const batten_network_options *opt, batten_network_info *info,
                             batten_status *status) {
  batten_mesh *mesh = NULL;
  batten_network *network = NULL;
  *status = batten_mesh_create(ctx, m->vertices, m->points, m->triangles, m->corners, &mesh);
  if (*status == BATTEN_OK) *status = batten_network_build(ctx, mesh, opt, &network, info);
  batten_mesh_free(mesh);
  if (network) return network;
  T_CHECK(false, "built: %s", batten_error(ctx));
  exit(t_done());
}

/* ---- flat faces --------------------------------------------------------------------------------- */

/* A block with three holes; and steps with corners that turn in and out. */
static scene_mesh holes(void) {
  unsigned char cells[14 * 6];
  for (size_t i = 0; i < 14; i++)
    for (size_t j = 0; j < 6; j++) cells[6 * i + j] = !(i / 2 % 2 == 1 && j / 2 == 1);
  return scene_mesh_cells(14, 6, 1, cells, 0);
}
static scene_mesh steps(void) {
  unsigned char cells[4 * 3 * 3];
  for (size_t i = 0; i < 4; i++)
    for (size_t j = 0; j < 3; j++)
      for (size_t k = 0; k < 3; k++)
        cells[(3 * i + j) * 3 + k] = k == 0 || (i + j < 3 && k == 1) || (i == 0 && j == 0);
  return scene_mesh_cells(4, 3, 3, cells, 0);
}

static void test_blocks(void) {
  for (int which = 0; which < 2; which++)
    for (int i = 0; i < FILLS; i++) {
      scene_mesh m = which ? steps() : holes();
      batten_network_options opt = batten_network_options_default();
      batten_network_info info;
      batten_network_measures size;
      batten_network_continuity joints;
      batten_status status;
      opt.crease_angle_deg = 30;
      opt.fill = fills[i];
      batten_network *network = build(&m, &opt, &info, &status);
      T_CHECK(status == BATTEN_OK, "%s, %s: %s, %zu creases, %zu nodes", which ? "steps" : "holes", fill_names[i],
              status ? batten_error(ctx) : "exact", info.crease_edges, info.nodes);
      T_OK(batten_network_measure(ctx, network, &size), ctx);
      T_OK(batten_network_measure_continuity(ctx, network, 5, &joints), ctx);
      double volume = which ? 19 : 72, area = which ? 54 : 2 * 72 + 40 + 3 * 8;
      T_RATIO(fabs(size.volume / volume - 1) + fabs(size.area / area - 1), 1e-13, "the same volume and area");
      T_RATIO(fmax(fabs(size.gauss_min), fabs(size.gauss_max)), 1e-20, "flat");
      T_RATIO(joints.crease.gap_max, 1e-13, "creases closed");
      T_RATIO(fabs(joints.crease.normal_max_deg - 90), 1e-9, "and sharp");
      batten_network_free(network);
      scene_mesh_free(&m);
    }
}

/* ---- a can -------------------------------------------------------------------------------------- */

static scene_mesh can(size_t n) {
  scene_mesh m = scene_mesh_make(2 * n + 2, 4 * n);
  for (size_t i = 0; i < n; i++) {
    double a = 2 * SCENE_PI * (double)i / (double)n;
    scene_point_set(m.points + 3 * i, cos(a), sin(a), -1);
    scene_point_set(m.points + 3 * (n + i), cos(a), sin(a), 1);
    size_t j = (i + 1) % n;
    scene_triangle_set(m.corners + 12 * i, i, j, n + j);
    scene_triangle_set(m.corners + 12 * i + 3, i, n + j, n + i);
    scene_triangle_set(m.corners + 12 * i + 6, 2 * n, j, i);
    scene_triangle_set(m.corners + 12 * i + 9, 2 * n + 1, n + i, n + j);
  }
  scene_point_set(m.points + 6 * n, 0, 0, -1);
  scene_point_set(m.points + 6 * n + 3, 0, 0, 1);
  return m;
}

static void test_can(void) {
  for (int i = 0; i < FILLS; i++) {
    double off[2];
    for (int fine = 0; fine < 2; fine++) {
      scene_mesh m = can(fine ? 24 : 12);
      batten_network_options opt = batten_network_options_default();
      batten_network_info info;
      batten_network_measures size;
      batten_network_continuity joints;
      batten_status status;
      opt.crease_angle_deg = 80;
      opt.fill = fills[i];
      batten_network *network = build(&m, &opt, &info, &status);
      T_CHECK(status == BATTEN_OK, "can of %d sides, %s: %s", fine ? 24 : 12, fill_names[i],
              status ? batten_error(ctx) : "exact");
      batten_network_measure(ctx, network, &size);
      batten_network_measure_continuity(ctx, network, 9, &joints);
      off[fine] = fabs(size.volume / (2 * SCENE_PI) - 1);
      T_RATIO(joints.crease.gap_max, 1e-14, "rims closed");
      T_CHECK(joints.crease.normal_max_deg > 85 && joints.crease.normal_max_deg < 95, "sharp: up to %.2f degrees",
              joints.crease.normal_max_deg);
      batten_network_free(network);
      scene_mesh_free(&m);
    }
    /* The prism of 24 sides alone has 1.1e-2 less. */
    T_RATIO(off[1], fmin(6e-3, off[0]), "volume of a cylinder but for %.1e, %.1e with half the sides, %s", off[1],
            off[0], fill_names[i]);
  }
}

/* ---- plates ------------------------------------------------------------------------------------- */

enum { PLATE_MOST = 64 };
typedef struct plate {
  size_t points, triangles;
  double xy[PLATE_MOST][2];
  size_t corners[2 * PLATE_MOST][3]; /* counter-clockwise */
  double area, slack;                /* of the shape that is meant, and what a curve through its points may miss */
} plate;

static void plate_triangle(plate *p, size_t a, size_t b, size_t c) {
  size_t *out = p->corners[p->triangles++];
  out[0] = a;
  out[1] = b;
  out[2] = c;
}

/* Bottom, top, and a wall on every side that has one triangle alone, its diagonals in turns. */
static scene_mesh plate_mesh(const plate *p, double height) {
  size_t sides = 0, count = 0, n = p->points;
  unsigned char *inner = calloc(3 * p->triangles, 1);
  for (size_t h = 0; h < 3 * p->triangles; h++) {
    const size_t *a = p->corners[h / 3];
    for (size_t g = 0; g < 3 * p->triangles; g++) {
      const size_t *b = p->corners[g / 3];
      if (a[h % 3] == b[(g + 1) % 3] && a[(h + 1) % 3] == b[g % 3]) inner[h] = 1;
    }
    sides += !inner[h];
  }
  scene_mesh m = scene_mesh_make(2 * n, 2 * p->triangles + 2 * sides);
  for (size_t i = 0; i < 2 * n; i++)
    scene_point_set(m.points + 3 * i, p->xy[i % n][0], p->xy[i % n][1], i < n ? 0 : height);
  for (size_t f = 0; f < p->triangles; f++) {
    const size_t *a = p->corners[f];
    scene_triangle_set(m.corners + 3 * count++, a[0], a[2], a[1]);
    scene_triangle_set(m.corners + 3 * count++, n + a[0], n + a[1], n + a[2]);
  }
  for (size_t h = 0; h < 3 * p->triangles; h++) {
    if (inner[h]) continue;
    size_t a = p->corners[h / 3][h % 3], b = p->corners[h / 3][(h + 1) % 3];
    scene_triangle_set(m.corners + 3 * count++, a, b, h % 2 ? n + a : n + b);
    scene_triangle_set(m.corners + 3 * count++, h % 2 ? b : a, n + b, n + a);
  }
  free(inner);
  return m;
}

/* A disk without a vertex inside: a strip that goes to and fro has an ear at both ends; or a fan. */
static plate disk(size_t n, bool fan) {
  plate p = {.points = n, .area = SCENE_PI, .slack = 0.03};
  for (size_t i = 0; i < n; i++) {
    p.xy[i][0] = cos(2 * SCENE_PI * (double)i / (double)n);
    p.xy[i][1] = sin(2 * SCENE_PI * (double)i / (double)n);
  }
  for (size_t i = 1, low = 0, high = n - 1; i + 1 < n; i++) {
    if (fan) {
      plate_triangle(&p, 0, i, i + 1);
    } else if (i % 2) {
      plate_triangle(&p, low, low + 1, high);
      low++;
    } else {
      plate_triangle(&p, low, high - 1, high);
      high--;
    }
  }
  return p;
}

/* A ring that is hardly wider than its arcs are high: tangents of the rims point across its diagonals. */
static plate ring(size_t n, double width) {
  plate p = {.points = 2 * n, .area = SCENE_PI * (1 - (1 - width) * (1 - width)), .slack = 0.03};
  for (size_t i = 0; i < n; i++) {
    double a = 2 * SCENE_PI * (double)i / (double)n;
    for (size_t k = 0; k < 2; k++) {
      p.xy[i + k * n][0] = (k ? 1 - width : 1) * cos(a);
      p.xy[i + k * n][1] = (k ? 1 - width : 1) * sin(a);
    }
    size_t j = (i + 1) % n;
    plate_triangle(&p, i, j, n + i);
    plate_triangle(&p, j, n + j, n + i);
  }
  return p;
}

/* A rectangle with an oblong hole: all edges go from its corners to the rim. */
static plate slot(size_t quarter) {
  plate p = {.points = 4 + 4 * quarter, .area = 6 * 4 - (2 * 2 + SCENE_PI), .slack = 0.01};
  size_t n = 4 * quarter;
  for (size_t i = 0; i < n; i++) {
    double a = SCENE_PI * ((double)(i % (n / 2)) / ((double)n / 2 - 1) - 0.5), side = i < n / 2 ? 1 : -1;
    p.xy[4 + i][0] = side * (1 + cos(a));
    p.xy[4 + i][1] = side * sin(a);
  }
  for (size_t q = 0; q < 4; q++) {
    p.xy[q][0] = q == 0 || q == 3 ? 3 : -3;
    p.xy[q][1] = q < 2 ? 2 : -2;
    for (size_t i = 0; i < quarter; i++) {
      size_t from = ((q + 1) * quarter + i) % n;
      plate_triangle(&p, q, 4 + (from + 1) % n, 4 + from);
    }
    plate_triangle(&p, q, (q + 1) % 4, 4 + (q + 2) * quarter % n);
  }
  return p;
}

static void test_plate(const char *name, const plate *p, size_t rims) {
  for (int i = 0; i < FILLS; i++) {
    scene_mesh m = plate_mesh(p, 0.8);
    batten_network_options opt = batten_network_options_default();
    batten_network_info info;
    batten_network_measures size;
    batten_network_continuity joints;
    batten_status status;
    opt.crease_angle_deg = 60;
    opt.fill = fills[i];
    batten_network *network = build(&m, &opt, &info, &status);
    T_CHECK(status == BATTEN_OK && info.irregular_faces == 0, "%s, %s: %s, %zu creases", name, fill_names[i],
            status ? batten_error(ctx) : "exact", info.crease_edges);
    T_OK(batten_network_measure(ctx, network, &size), ctx);
    T_OK(batten_network_measure_continuity(ctx, network, 9, &joints), ctx);
    /* The fair fill gives walls a belly where their rims change curvature. */
    bool fair = fills[i] == BATTEN_FILL_FAIR || fills[i] == BATTEN_FILL_FAIR_LINEAR;
    T_RATIO(fabs(size.volume / (0.8 * p->area) - 1), fair ? 0.07 : p->slack, "volume %.4f", size.volume);
    T_RATIO(joints.crease.gap_max, 1e-13, "creases closed");
    T_CHECK(info.crease_edges >= rims && info.crease_edges <= rims + 4, "%zu creases, %zu without those at ears",
            info.crease_edges, rims);
    batten_network_free(network);
    scene_mesh_free(&m);
  }
}

static void test_plates(void) {
  plate p = disk(16, false);
  test_plate("disk, strip", &p, 32);
  p = disk(16, true);
  test_plate("disk, fan", &p, 32);
  p = ring(25, 0.02);
  test_plate("narrow ring", &p, 100);
  p = slot(6);
  test_plate("slot", &p, 60);
}

/* ---- boundary curves ---------------------------------------------------------------------------- */

/* Greatest difference of the boundary curves of two networks over the same triangles. */
static double boundary_difference(const batten_network *a, const batten_network *b, const scene_mesh *m) {
  double worst = 0;
  for (size_t h = 0; h < 3 * m->triangles; h++) {
    uint32_t from = m->corners[h], to = m->corners[h % 3 == 2 ? h - 2 : h + 1];
    bool inner = false;
    for (size_t g = 0; g < 3 * m->triangles && !inner; g++)
      inner = m->corners[g] == to && m->corners[g % 3 == 2 ? g - 2 : g + 1] == from;
    if (inner) continue;
    for (int s = 0; s <= 8; s++) {
      double t = s / 8.0, weights[3] = {0};
      weights[h % 3] = 1 - t;
      weights[(h + 1) % 3] = t;
      batten_surface_point p, q;
      batten_place place = {(uint32_t)(h / 3), weights[1], weights[2]};
      batten_network_evaluate(ctx, a, 1, &place, &p);
      batten_network_evaluate(ctx, b, 1, &place, &q);
      for (int k = 0; k < 3; k++) worst = fmax(worst, fabs(p.point[k] - q.point[k]));
    }
  }
  return worst;
}

/* Boundary curves are made of the boundary's vertices alone: another inside leaves them as they are. */
static void test_boundary_curves(void) {
  for (int curves = 0; curves < 2; curves++) {
    scene_mesh m = scene_mesh_graph_7();
    batten_network_options opt = batten_network_options_default();
    batten_network_info info;
    batten_status status;
    opt.boundary_curves = curves;
    opt.fill = BATTEN_FILL_DEGREE7;
    batten_network *before = build(&m, &opt, &info, &status);
    T_CHECK(status == BATTEN_OK, "graph: %s", status ? batten_error(ctx) : "exact");
    for (size_t i = 1; i < 6; i++)
      for (size_t j = 1; j < 6; j++) m.points[3 * (7 * i + j) + 2] += 0.05 * sin((double)(3 * i + j));
    batten_network *after = build(&m, &opt, &info, &status);
    double difference = boundary_difference(before, after, &m);
    if (curves)
      T_RATIO(difference, 1e-14, "boundary curves do not know the inside");
    else
      T_CHECK(difference > 1e-3, "free boundaries do: %.1e", difference);
    batten_network_free(after);
    batten_network_free(before);
    scene_mesh_free(&m);
  }
}

/* ---- lines -------------------------------------------------------------------------------------- */

/* Unit direction in which the edge from a to b leaves a. */
static void direction(const batten_network *network, const scene_mesh *m, uint32_t a, uint32_t b, double *out) {
  static const double du[3] = {1, -1, 0}, dv[3] = {0, 1, -1}; /* along the sides 0 1, 1 2, 2 0 */
  for (size_t h = 0; h < 3 * m->triangles; h++) {
    uint32_t from = m->corners[h], to = m->corners[h % 3 == 2 ? h - 2 : h + 1];
    if (!(from == a && to == b) && !(from == b && to == a)) continue;
    size_t corner = from == a ? h % 3 : (h + 1) % 3;
    batten_place place = {(uint32_t)(h / 3), corner == 1, corner == 2};
    batten_surface_point p;
    batten_network_evaluate(ctx, network, 1, &place, &p);
    for (int k = 0; k < 3; k++) out[k] = (from == a ? 1 : -1) * (du[h % 3] * p.du[k] + dv[h % 3] * p.dv[k]);
    double length = sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
    for (int k = 0; k < 3; k++) out[k] /= length;
    return;
  }
}

static void test_lines(void) {
  scene_mesh m = scene_mesh_valve();
  double bend[2] = {0};
  for (int with = 0; with < 2; with++) {
    batten_network_options opt = batten_network_options_default();
    batten_network_info info;
    batten_status status;
    opt.fill = BATTEN_FILL_DEGREE7;
    opt.line_count = with ? m.lines : 0;
    opt.line_starts = m.line_starts;
    opt.line_vertices = m.line_vertices;
    batten_network *network = build(&m, &opt, &info, &status);
    T_CHECK(status == BATTEN_OK && info.fallback_faces == 0, "valve with %zu edges in lines: %s", info.line_edges,
            status ? batten_error(ctx) : "exact");
    size_t places = 0;
    for (size_t l = 0; l < m.lines; l++)
      for (size_t i = m.line_starts[l] + 1; i + 1 < m.line_starts[l + 1]; i++) {
        const uint32_t *v = m.line_vertices + i;
        double back[3], on[3], turn = 0, sum = 0;
        for (int k = 0; k < 3; k++) {
          back[k] = m.points[3 * v[0] + (size_t)k] - m.points[3 * v[-1] + (size_t)k];
          on[k] = m.points[3 * v[1] + (size_t)k] - m.points[3 * v[0] + (size_t)k];
          turn += back[k] * on[k];
        }
        double lengths = (back[0] * back[0] + back[1] * back[1] + back[2] * back[2]) *
                         (on[0] * on[0] + on[1] * on[1] + on[2] * on[2]);
        if (turn < 0.51 * sqrt(lengths)) continue; /* corners turn by more than 60 degrees */
        direction(network, &m, v[0], v[-1], back);
        direction(network, &m, v[0], v[1], on);
        for (int k = 0; k < 3; k++) sum += (back[k] + on[k]) * (back[k] + on[k]);
        bend[with] = fmax(bend[with], sqrt(sum));
        places++;
      }
    T_CHECK(places > 200, "at %zu places of %zu lines", places, m.lines);
    batten_network_free(network);
  }
  T_RATIO(bend[1], 1e-12, "lines pass their vertices without a bend");
  T_CHECK(bend[0] > 1e-3, "edges that are in no line have one: %.1e", bend[0]);
  scene_mesh_free(&m);
}

int main(void) {
  ctx = t_context(NULL, NULL, 2);
  test_blocks();
  test_can();
  test_plates();
  test_boundary_curves();
  test_lines();
  batten_context_free(ctx);
  return t_done();
}
