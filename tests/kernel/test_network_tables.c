/* Ranges of the Gaussian curvature of surfaces through known meshes, by each way of making them, against what another
 * implementation of the same methods reached.
 *
 * That one's figures are rounded to the digits given here, so one unit of the last digit is allowed. On the meshes
 * that are the same (the platonic ones, the torus, the long ellipsoid, the sphere of 42 vertices) ranges must lie
 * within its ranges. Where the mesh comes from random numbers or from a function of our own, the least and largest K
 * belong to other triangles: there our range must be as narrow as its range. The cells where ours is wider are:
 *   - the graph by plain Shirman-Sequin and PN triangles, rivals that are the same to the digit on the same meshes:
 *     ours is the harder graph (and every optimised way has a narrower range all the same);
 *   - the noisy sphere: radii of ours are off by as much as 5 % evenly, and the plain way shows 1.4 times the range
 *     that the other noise gave it. Judged by the share of the plain way's range that is left, over several seeds;
 *   - the irregular blob of 642 vertices with the paper's networks, where one bad triangle decides;
 *   - the irregular ellipsoid with the fair fill: 5.54 beside 5.48, where the ellipsoid itself has 5.34;
 *   - the vertex shifted by (1.2, .72): a narrower range, but 1.023 beside 1.020 at its upper end;
 *   - the upper end on the torus with the fair fill: .4733 beside .471 (exact .446). .4721 is what an early stop
 *     gives; the energy's minimum has .4732, and -1.0446 at the lower end beside -1.045. The linear fill: .4638
 *     beside .460;
 *   - the tip of the long ellipsoid by the weighted network of second order: 11.6 beside 12.2 (exact 16.7), but -.12
 *     beside -.51 at the lower end (exact .25);
 *   - Peters' fill on the shifted octahedron: 2.2 degrees beside 1.98; .6 with the default weights, and less than
 *     the other on all other meshes.
 * K is measured by batten_network_measure on 15 rows with edges and corners of patches, where it is worst. */
#include "network_tables.h"
#include "tap.h"

static batten_context *ctx;

/* ---- the paper's ways, inside the patches ----------------------------------------------------------- */

enum { ROWS = 12 };

/* Over the middles of the upright ones of ROWS^2 small triangles on each patch. */
static void inner_range(const batten_network *network, double range[2]) {
  range[0] = INFINITY;
  range[1] = -INFINITY;
  for (size_t p = 0; p < batten_network_patch_count(network); p++) {
    batten_place places[ROWS * (ROWS + 1) / 2];
    batten_surface_point points[ROWS * (ROWS + 1) / 2];
    size_t count = 0;
    for (int i = 0; i < ROWS; i++)
      for (int j = 0; i + j < ROWS; j++)
        places[count++] = (batten_place){(uint32_t)p, (i + 1 / 3.) / ROWS, (j + 1 / 3.) / ROWS};
    if (batten_network_evaluate(ctx, network, count, places, points) < 0) range[0] = range[1] = NAN;
    for (size_t i = 0; i < count; i++) {
      range[0] = fmin(range[0], points[i].gauss);
      range[1] = fmax(range[1], points[i].gauss);
    }
  }
}

typedef struct inner_row {
  const char *name;
  scene_mesh (*make)(void);
  struct {
    double jump_deg, range[2]; /* jump 0: exact */
  } ways[5];
} inner_row;

static const table_way inner_ways[5] = {TABLE_PN, TABLE_PLAIN, TABLE_G1, TABLE_PETERS, TABLE_G2};

static const inner_row inner_rows[] = {
    {"octahedron",
     scene_mesh_octahedron,
     {{46, {.11, 3.7}}, {0, {.28, 2.38}}, {0, {.65, 1.34}}, {2e-12, {.91, 1.31}}, {0, {.91, 1.29}}}},
    {"shifted octahedron",
     table_shifted,
     {{60, {.07, 5.7}}, {0, {.20, 3.45}}, {0, {.24, 4.2}}, {2.3, {-.84, 6.2}}, {0, {.35, 3.6}}}},
    {"sphere 42",
     table_sphere_42,
     {{2.6, {.69, 1.28}}, {0, {.87, 1.18}}, {0, {.94, 1.06}}, {4e-7, {.98, 1.05}}, {0, {.98, 1.05}}}},
    {"torus 10 x 6",
     scene_mesh_torus_10_6,
     {{13, {-2.0, 1.0}}, {0, {-2.8, 2.0}}, {0, {-1.38, .77}}, {.90, {-1.17, .69}}, {0, {-1.09, .73}}}},
    {"graph 7 x 7", /* the first two are our own figures; the others' ranges are for the width */
     scene_mesh_graph_7,
     {{2.4, {-1.0, 1.0}}, {0, {-1.9, 2.3}}, {0, {-1.24, .15}}, {.32, {-1.06, .04}}, {0, {-1.05, .11}}}},
};

/* The unit of a figure's last digit that is not 0, cap at most: zeros at the end have been given too. */
static double last_digit(double figure, double cap) {
  double unit = 0.001;
  while (unit < cap && fabs(figure / unit / 10 - round(figure / unit / 10)) < 1e-6) unit *= 10;
  return fmin(unit, cap);
}

/* Such as the paper's ways have: two digits behind the point, or fewer for large figures. */
static double coarse_digit(double figure) {
  return last_digit(figure, fabs(figure) < 2 ? 0.01 : fabs(figure) < 10 ? 0.1 : 1);
}

static void test_inner(void) {
  for (size_t i = 0; i < sizeof inner_rows / sizeof *inner_rows; i++)
    for (int w = 0; w < 5; w++) {
      const inner_row *row = &inner_rows[i];
      bool own = row->make == scene_mesh_graph_7;
      const double *bound = row->ways[w].range;
      double allowed = row->ways[w].jump_deg, range[2];
      scene_mesh scene = row->make();
      batten_network_options o = table_options(inner_ways[w]);
      batten_mesh *mesh = NULL;
      batten_network *network = NULL;
      batten_network_info info;
      batten_status st = batten_mesh_create(ctx, scene.vertices, scene.points, scene.triangles, scene.corners, &mesh);
      if (st == BATTEN_OK) st = batten_network_build(ctx, mesh, &o, &network, &info);
      if (st < 0) {
        t_line(false, "%s", batten_error(ctx));
        return;
      }
      inner_range(network, range);
      double half = allowed >= 10 ? 0.5 : allowed >= 1 ? 0.05 : 0; /* of the unit of the last digit */
      double lower = coarse_digit(bound[0]), upper = coarse_digit(bound[1]),
             width = bound[1] - bound[0] + lower + upper;
      T_CHECK(own ? range[1] - range[0] <= width : range[0] >= bound[0] - lower && range[1] <= bound[1] + upper,
              "%s, %s: K inside %.3f .. %.3f beside %g .. %g", row->name, table_way_names[inner_ways[w]], range[0],
              range[1], bound[0], bound[1]);
      if (!own && (inner_ways[w] == TABLE_PN || inner_ways[w] == TABLE_PLAIN || inner_ways[w] == TABLE_G1))
        T_CHECK(fabs(range[0] - bound[0]) <= lower && fabs(range[1] - bound[1]) <= upper,
                "the same to the digits given");
      if (allowed > 0)
        T_RATIO(info.normal_jump_max_deg, allowed + half, "normals differ, degrees");
      else
        T_CHECK(st == BATTEN_OK && info.normal_jump_max_deg < 1e-11, "exact: %.1e degrees", info.normal_jump_max_deg);
      batten_network_free(network);
      batten_mesh_free(mesh);
      scene_mesh_free(&scene);
    }
}

/* ---- all ways, with edges and corners ------------------------------------------------------------------- */

enum { COLUMNS = 6 };
static const table_way column_ways[COLUMNS] = {TABLE_PLAIN,       TABLE_G1,          TABLE_G2,
                                               TABLE_G2_WEIGHTED, TABLE_FAIR_LINEAR, TABLE_FAIR};

typedef struct outer_row {
  const char *name;
  scene_mesh (*make)(void);
  bool same;                 /* mesh: within the range; else as narrow as it */
  double tip;                /* the largest K that there is, where all ways round it: nearer is better; else 0 */
  double ranges[COLUMNS][2]; /* the other implementation's, 0, 0: none */
  double quantiles[2];       /* fair, 2 and 98 % */
  double own_width[COLUMNS]; /* where ours is wider, as told above; else 0 */
} outer_row;

static const outer_row outer_rows[] = {
    {.name = "octahedron",
     .make = scene_mesh_octahedron,
     .same = true,
     .ranges = {{.28, 2.52}, {.64, 1.36}, {.91, 1.39}, {.91, 1.39}, {.986, 1.024}, {.997, 1.005}},
     .quantiles = {.998, 1.005}},
    {.name = "shifted octahedron",
     .make = table_shifted,
     .same = true,
     .ranges = {{.19, 3.47}, {.24, 4.21}, {.34, 3.58}, {.69, 1.73}, {.917, 1.092}, {.988, 1.011}},
     .quantiles = {.993, 1.008}},
    {.name = "shifted by (1, .6)", .make = table_shifted_far, .same = true, .ranges = {[5] = {.976, 1.018}}},
    {.name = "shifted by (1.2, .72)", .make = table_shifted_farther, .ranges = {[5] = {.964, 1.020}}},
    {.name = "sphere 42",
     .make = table_sphere_42,
     .same = true,
     .ranges = {{.87, 1.21}, {.94, 1.07}, {.98, 1.06}, {.98, 1.06}, {.9999, 1.0001}, {.9999, 1.0001}},
     .quantiles = {.9999, 1.0001}},
    {.name = "tetrahedron",
     .make = scene_mesh_tetrahedron,
     .same = true,
     .ranges = {{.07, 4.11}, {.23, 1.65}, {.94, 1.53}, {.94, 1.53}, {.889, 1.095}, {.987, 1.013}},
     .quantiles = {.993, 1.012}},
    {.name = "torus 10 x 6",
     .make = scene_mesh_torus_10_6,
     .same = true,
     .ranges = {{-3.2, 2.2}, {-1.43, .79}, {-1.11, .76}, {-1.16, .52}, {-1.048, .464}, {-1.045, .473}},
     .quantiles = {-1.022, .452}},
    {.name = "graph 7 x 7",
     .make = scene_mesh_graph_7,
     .ranges = {{-2.03, 1.75}, {-1.27, .17}, {-1.10, .15}, {-.80, .01}, {-.645, -.059}, {-.645, -.059}},
     .quantiles = {-.618, -.074},
     .own_width = {4.8}},
    {.name = "irregular sphere",
     .make = scene_mesh_sphere_irregular,
     .ranges = {{-2.0, 8.7}, {-15, 16}, {-8.4, 19.4}, {-.52, 2.97}, {.990, 1.008}, {.999, 1.001}},
     .quantiles = {.9999, 1.0001}},
    {.name = "irregular ellipsoid",
     .make = scene_mesh_ellipsoid_irregular,
     .ranges = {{-34, 24}, {-29, 52}, {-11, 55}, {-2.6, 15.8}, {.44, 6.04}, {.48, 5.96}},
     .quantiles = {.54, 4.87},
     .own_width = {[4] = 5.70, [5] = 5.54}},
    {.name = "blob 162",
     .make = scene_mesh_blob_162,
     .ranges = {{-113, 131}, {-80, 65}, {-58, 85}, {-7.9, 12.7}, {-3.78, 4.66}, {-3.83, 4.66}},
     .quantiles = {-2.01, 4.00},
     .own_width = {[4] = 8.48}},
    {.name = "blob 642",
     .make = scene_mesh_blob_642,
     .ranges = {[1] = {-82, 134}, {-70, 117}, {-9.5, 12.2}, {-3.73, 4.85}, {-3.74, 4.85}},
     .quantiles = {-2.03, 4.06},
     .own_width = {[1] = 250, [2] = 230, [3] = 41}},
    {.name = "cube, 26 vertices",
     .make = scene_mesh_cube_26,
     .ranges = {{-11, 7.4}, {-46, 28}, {-26, 32}, {-16, 18}, {-5.5, 7.5}, {-5.7, 8.4}},
     .quantiles = {-3.5, 3.9}},
    {.name = "ellipsoid 2 .7 .7",
     .make = scene_mesh_ellipsoid_long,
     .same = true,
     .tip = 16.7,
     .ranges = {[1] = {-.09, 13.5}, {.03, 9.9}, {-.51, 11.6}, {.20, 11.5}, {.16, 11.0}},
     .quantiles = {.18, 7.35}},
};

static void judge(const outer_row *row, int c, const table_figures *f, double lower, double upper) {
  const double *bound = row->ranges[c];
  double width = upper - lower, slack[2];
  for (int k = 0; k < 2; k++)
    slack[k] = column_ways[c] >= TABLE_FAIR_LINEAR ? last_digit(bound[k], 0.01) : coarse_digit(bound[k]);
  bool ok;
  if (row->tip > 0)
    ok = lower >= bound[0] - slack[0] && upper >= bound[1] - slack[1] && upper <= row->tip;
  else if (row->same)
    ok = lower >= bound[0] - slack[0] && upper <= bound[1] + slack[1];
  else
    ok = width <= (row->own_width[c] > 0 ? row->own_width[c] : bound[1] - bound[0] + slack[0] + slack[1]);
  T_CHECK(ok, "%s, %s: K %.4f .. %.4f beside %g .. %g, width %.4g; regular %.2f", row->name,
          table_way_names[column_ways[c]], lower, upper, bound[0], bound[1], width, f->measures.regularity_min);
  T_CHECK(f->status == BATTEN_OK && f->info.normal_jump_max_deg < 2e-11, "exact: %.1e degrees",
          f->info.normal_jump_max_deg);
}

static void test_outer(void) {
  for (size_t i = 0; i < sizeof outer_rows / sizeof *outer_rows; i++) {
    const outer_row *row = &outer_rows[i];
    scene_mesh scene = row->make();
    for (int c = 0; c < COLUMNS; c++) {
      if (row->ranges[c][1] == 0) continue;
      batten_network_options o = table_options(column_ways[c]);
      table_figures f = table_build(ctx, &scene, &o);
      if (f.status < 0) {
        t_line(false, "%s", batten_error(ctx));
        continue;
      }
      judge(row, c, &f, f.measures.gauss_min, f.measures.gauss_max);
      if (column_ways[c] != TABLE_FAIR || row->quantiles[1] == 0) continue;
      double lower = f.measures.gauss_p02, upper = f.measures.gauss_p98;
      double width = row->quantiles[1] - row->quantiles[0];
      /* Ours are shares of the area, the other's shares of the samples. */
      double slack = 0.002 + last_digit(row->quantiles[0], 0.01);
      T_CHECK(row->same
                  ? lower >= row->quantiles[0] - slack && (upper <= row->quantiles[1] + slack || upper < row->tip)
                  : upper - lower <= 1.02 * width + 2 * slack,
              "%s, 2 .. 98 %%: %.4f .. %.4f beside %g .. %g", row->name, lower, upper, row->quantiles[0],
              row->quantiles[1]);
    }
    scene_mesh_free(&scene);
  }
}

/* ---- against the surfaces themselves ----------------------------------------------------------------------- */

/* The fair fill's range, beside that of the surface from which the vertices were taken: no further out than a share
 * of the largest |K|, whatever the seed. */
static void test_exact(void) {
  static const struct {
    int mesh;
    double share;
  } cases[] = {{0, .005},  {1, .0125}, {2, .0225}, {3, .03},  {4, .011}, {5, .0003},
               {6, .0015}, {8, .03},   {10, .015}, {11, .03}, {12, .04}, {13, .04}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    const table_mesh *row = &table_meshes[cases[i].mesh];
    scene_mesh scene = row->make();
    batten_network_options o = table_options(TABLE_FAIR);
    table_figures f = table_build(ctx, &scene, &o);
    double largest = fmax(fabs(row->exact[0]), fabs(row->exact[1]));
    double out = fmax(row->exact[0] - f.measures.gauss_min, f.measures.gauss_max - row->exact[1]) / largest;
    T_RATIO(out, cases[i].share, "%s: K %.4f .. %.4f, exact %g .. %g, energy %.3g in %u passes; out by", row->name,
            f.measures.gauss_min, f.measures.gauss_max, row->exact[0], row->exact[1], f.info.energy,
            f.info.fairing_passes);
    scene_mesh_free(&scene);
  }
}

/* Spheres with random vertices: the fair fill knows them as spheres; with noisy ones it leaves half of the range. */
static void test_seeds(void) {
  double worst = 0, sum = 0;
  enum { SEEDS = 6 };
  for (uint64_t seed = 11; seed < 11 + SEEDS; seed++) {
    scene_mesh m = scene_mesh_icosphere(2);
    batten_network_options fair = table_options(TABLE_FAIR), plain = table_options(TABLE_PLAIN);
    scene_mesh_shift(&m, 0.18, seed);
    table_figures f = table_build(ctx, &m, &fair), g;
    worst = fmax(worst, fmax(1 - f.measures.gauss_min, f.measures.gauss_max - 1));
    scene_mesh_free(&m);
    uint64_t state = seed;
    m = scene_mesh_icosphere(2);
    for (size_t v = 0; v < m.vertices; v++) {
      double r = 1 + 0.05 * (2 * t_uniform(&state) - 1);
      for (size_t k = 0; k < 3; k++) m.points[3 * v + k] *= r;
    }
    f = table_build(ctx, &m, &fair);
    g = table_build(ctx, &m, &plain);
    sum += (f.measures.gauss_max - f.measures.gauss_min) / (g.measures.gauss_max - g.measures.gauss_min) / SEEDS;
    scene_mesh_free(&m);
  }
  T_RATIO(worst, 0.0015, "irregular spheres of %d seeds: K from 1", SEEDS);
  T_RATIO(sum, 0.52, "noisy spheres of %d seeds: mean share of the plain way's range (the other's one: .48)", SEEDS);
}

int main(void) {
  ctx = t_context(NULL, NULL, 1);
  double start = batten_now();
  void (*const tests[])(void) = {test_inner, test_outer, test_exact, test_seeds};
  for (size_t i = 0; i < sizeof tests / sizeof *tests; i++) {
    tests[i]();
    printf("# %.2f s\n", batten_now() - start);
  }
  batten_context_free(ctx);
  return t_done();
}
