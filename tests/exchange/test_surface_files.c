/* Surfaces in files: documents that read back to the same bits, what is refused and where, faces and their sides in
 * STEP and IGES, VTK's Bezier quadrilaterals, meshes. That CAD systems take them is tested in tests/consumers/occt.
 */
#include "files.h"
#include "step_doc.h"
#include "surface.h"
#include "surface_sides.h"

static batten_surface *make(batten_context *ctx, const char *name) {
  batten_surface *surface = NULL;
  for (size_t i = 0; i < SURFACE_SIDE_CASES; i++)
    if (!strcmp(surface_side_cases[i].name, name))
      T_OK(surface_sides_make(ctx, &surface_side_cases[i], &surface), ctx);
  return surface;
}

/* ---- documents --------------------------------------------------------------------------------------- */

static bool same_surfaces(const batten_surface *a, const batten_surface *b) {
  batten_surface_form x = batten_surface_get(a), y = batten_surface_get(b);
  size_t points = 3 * bx_form_points(&x, 0) * bx_form_points(&x, 1);
  for (int i = 0; i < 2; i++)
    if (x.degree[i] != y.degree[i] || x.knot_count[i] != y.knot_count[i] ||
        memcmp(x.knots[i], y.knots[i], x.knot_count[i] * sizeof(double)))
      return false;
  return !memcmp(x.control_points, y.control_points, points * sizeof(double));
}

static void check_back(batten_context *ctx, scratch *s, const batten_surface *surface, const char *what) {
  batten_surface *back = NULL;
  char first[400];
  snprintf(first, sizeof first, "%s", scratch_file(s, "a.json"));
  T_OK(batten_write_surface(ctx, surface, NULL, first), ctx);
  T_OK(batten_read_surface(ctx, first, &back), ctx);
  T_CHECK(back && same_surfaces(surface, back), "%s comes back to the same bits", what);
  if (back) T_OK(batten_write_surface(ctx, back, NULL, scratch_file(s, "b.json")), ctx);
  T_CHECK(files_equal(first, s->name), "written again: the same bytes");
  batten_surface_free(back);
}

static void test_back(batten_context *ctx, scratch *s) {
  static const char *const names[] = {"paraboloid", "wave", "high", "ring"};
  for (size_t i = 0; i < 4; i++) {
    batten_surface *surface = make(ctx, names[i]);
    check_back(ctx, s, surface, names[i]);
    batten_surface_free(surface);
  }
  static const double knots[2][4] = {{-0.1, -0.1, 0.3, 0.3}, {1e-300, 1e-300, 1e-299, 1e-299}};
  static const double points[12] = {0.1,   -0.0,   5e-324, 1 / 3.0, 1e22, -1e-310,
                                    1e100, 4.35e9, -0.3,   2 / 3.0, 7,    123456789.123456789};
  const batten_surface_form form = {{1, 1}, {4, 4}, {knots[0], knots[1]}, points};
  batten_surface *surface = NULL;
  T_OK(batten_surface_create(ctx, &form, &surface), ctx);
  check_back(ctx, s, surface, "a bilinear patch of odd numbers");
  batten_file_kind kind = BATTEN_FILE_UNKNOWN;
  T_CHECK(batten_file_identify(ctx, scratch_file(s, "a.json"), &kind) == BATTEN_OK && kind == BATTEN_FILE_SURFACE,
          "told to be a surface");
  batten_surface_free(surface);
}

static batten_status read_bytes(batten_context *ctx, const void *text, size_t size) {
  bx_reader r;
  batten_surface *surface = NULL;
  batten_status st = bx_open_memory(&r, ctx, "bad.json", text, size);
  if (st != BATTEN_OK) return st;
  st = bx_read_surface_from(&r, &surface);
  bx_close(&r);
  if (st != BATTEN_OK && surface) t_line(false, "a result in spite of a failure");
  batten_surface_free(surface);
  return st;
}

static batten_status read_text(batten_context *ctx, const char *text) { return read_bytes(ctx, text, strlen(text)); }

#define HEAD "{\"batten\": \"surface\", \"version\": 1, "
#define DEGREE "\"degree\": [1, 2], "
#define KNOTS "\"knots\": [[0, 0, 1, 1], [0, 0, 0, 2, 2, 2]], "
#define POINTS "\"control_points\": [[[0, 0, 0], [0, 1, 0], [0, 2, 0]], [[1, 0, 0], [1, 1, 1], [1, 2, 0]]]}"
#define DEEP "[[[[[[[[[[[[[[[[[[[["

static void test_refused(batten_context *ctx) {
  static const struct {
    const char *text, *error;
  } cases[] = {
      {"", "bad.json:1: JSON:"},
      {"[]", "document: an array, where an object is expected"},
      {"{}", "document: 'batten' is missing"},
      {"{\"batten\": \"network\", \"version\": 1}", "document: it holds a batten 'network', not a surface"},
      {"{\"batten\": \"surface\", \"version\": 2}", "document.version: 2, where a whole number"},
      {HEAD "\"x\": 0}", "surface: 'degree' is missing"},
      {HEAD "\"degree\": 3}", "surface.degree: a number, where an array is expected"},
      {HEAD "\"degree\": [3]}", "surface.degree: 1 numbers, where 2 are expected"},
      {HEAD "\"degree\": [0, 1]}", "surface.degree[0]: 0, where a whole number from 1 to 9 is expected"},
      {HEAD "\"degree\": [1, 10]}", "surface.degree[1]: 10, where"},
      {HEAD "\"degree\": [1, 1.5]}", "surface.degree[1]: 1.5, where"},
      {HEAD "\"degree\": [-1, 1]}", "surface.degree[0]: -1, where"},
      {HEAD "\"degree\": [1e300, 1]}", "surface.degree[0]: 1e+300, where"},
      {HEAD "\"degree\": [1, null]}", "surface.degree[1]: null, where a number is expected"},
      {HEAD DEGREE "\"x\": 0}", "surface: 'knots' is missing"},
      {HEAD DEGREE "\"knots\": [[0, 0, 1, 1]]}", "surface.knots: 1 items, where 2 are expected"},
      {HEAD DEGREE "\"knots\": {}}", "surface.knots: an object, where an array is expected"},
      {HEAD DEGREE "\"knots\": [0, 0]}", "surface.knots[0]: a number, where an array is expected"},
      {HEAD DEGREE "\"knots\": [[0, 0, 1], []]}", "surface.knots[0]: 3 knots, where degree 1 needs 4 at least"},
      {HEAD DEGREE "\"knots\": [[0, 0, 1, 1], []]}", "surface.knots[1]: 0 knots, where degree 2 needs 6 at least"},
      {HEAD DEGREE "\"knots\": [[0, 0, 1, \"a\"], []]}", "surface.knots[0][3]: a text, where a number is expected"},
      {HEAD DEGREE "\"knots\": [[0, 0, 1, NaN], []]}", "bad.json:1: JSON:"},
      {HEAD DEGREE "\"knots\": [[0, 0, 1, 1e999], []]}", "bad.json:1: JSON:"},
      {HEAD DEGREE KNOTS "\"x\": 0}", "surface: 'control_points' is missing"},
      {HEAD DEGREE KNOTS "\"control_points\": 1}", "surface.control_points: a number, where an array is expected"},
      {HEAD DEGREE KNOTS "\"control_points\": []}", "surface.control_points: 0 items, where 2 are expected"},
      {HEAD DEGREE KNOTS "\"control_points\": [[], []]}", "surface.control_points[0]: 0 rows, where 3 are expected"},
      {HEAD DEGREE KNOTS "\"control_points\": [7, []]}",
       "surface.control_points[0]: a number, where an array is expected"},
      {HEAD DEGREE KNOTS "\"control_points\": [[[0, 0, 0], [0, 1], [0, 2, 0]], []]}",
       "surface.control_points[0][1]: 2 numbers, where 3 are expected"},
      {HEAD DEGREE KNOTS "\"control_points\": [[[0, 0, 0], [0, 1, true], [0, 2, 0]], []]}",
       "surface.control_points[0][1][2]: true or false, where a number is expected"},
      {HEAD DEGREE KNOTS "\"control_points\": [" DEEP, "bad.json:1: JSON:"},
      {HEAD DEGREE "\"knots\": [[0, 1, 1, 1], [0, 0, 0, 2, 2, 2]], " POINTS, "surface: knots[0][1]: 1;"},
      {HEAD DEGREE "\"knots\": [[0, 0, 1, 1], [0, 0, 0, 2, 2, 1]], " POINTS, "surface: knots[1][5]: 1 is below"},
      {HEAD DEGREE "\"knots\": [[-1e308, -1e308, 1e308, 1e308], [0, 0, 0, 2, 2, 2]], " POINTS,
       "surface: knots[0]: -1e+308 to 1e+308"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    batten_status st = read_text(ctx, cases[i].text);
    T_CHECK(st == BATTEN_E_FORMAT && strstr(batten_error(ctx), cases[i].error), "%s", batten_error(ctx));
  }
  T_OK(read_text(ctx, HEAD DEGREE KNOTS POINTS), ctx);
  T_OK(read_text(ctx, "\xef\xbb\xbf" HEAD DEGREE KNOTS POINTS), ctx);
  const char *whole = HEAD DEGREE KNOTS POINTS;
  size_t wrong = 0, size = strlen(whole);
  for (size_t cut = 0; cut < size; cut++) { /* exact-size blocks, so that a sanitizer sees a byte too far */
    char *part = malloc(cut ? cut : 1);
    memcpy(part, whole, cut);
    wrong += read_bytes(ctx, part, cut) != BATTEN_E_FORMAT;
    free(part);
  }
  T_CHECK(wrong == 0, "each of the %zu shorter files is refused", size);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left behind");
}

/* ---- calls ------------------------------------------------------------------------------------------- */

static void test_calls(batten_context *ctx, scratch *s) {
  batten_surface *surface = make(ctx, "bicubic"), *none = NULL;
  const batten_write_surface_options good = batten_write_surface_options_default();
  batten_write_surface_options o = good;
  char path[400];
  snprintf(path, sizeof path, "%s", scratch_file(s, "calls.step"));
  T_STATUS(batten_write_surface(ctx, NULL, NULL, path), BATTEN_E_INVALID, ctx, "surface: NULL");
  T_STATUS(batten_write_surface(ctx, surface, NULL, NULL), BATTEN_E_INVALID, ctx, "path: NULL");
  T_STATUS(batten_write_surface(ctx, surface, NULL, "a.dxf"), BATTEN_E_INVALID, ctx,
           "a.dxf: surfaces are written as .step .stp .iges .igs .json .vtu, and tessellated as .ply");
  T_STATUS(batten_write_surface(ctx, surface, NULL, "none/a.step"), BATTEN_E_IO, ctx, "make the directory first");
  o.struct_size = 3;
  T_STATUS(batten_write_surface(ctx, surface, &o, path), BATTEN_E_INVALID, ctx, "struct_size: 3");
  o = good, o.unit = (batten_length_unit)4;
  T_STATUS(batten_write_surface(ctx, surface, &o, path), BATTEN_E_INVALID, ctx, "opt.unit: 4");
  o = good, o.schema = (batten_step_schema)2;
  T_STATUS(batten_write_surface(ctx, surface, &o, path), BATTEN_E_INVALID, ctx, "opt.schema: 2");
  o = good, o.time_stamp = "today";
  T_STATUS(batten_write_surface(ctx, surface, &o, path), BATTEN_E_INVALID, ctx, "opt.time_stamp: 'today'");
  char name[300];
  memset(name, 'n', sizeof name);
  name[299] = '\0';
  o = good, o.name = name;
  T_STATUS(batten_write_surface(ctx, surface, &o, path), BATTEN_E_INVALID, ctx, "opt.name: 299 bytes; at most 255");
  o = good, o.density = 0;
  T_STATUS(batten_write_surface(ctx, surface, &o, path), BATTEN_E_INVALID, ctx, "opt.density: 0; must be 1 .. 1024");
  o = good, o.density = 1025;
  T_STATUS(batten_write_surface(ctx, surface, &o, path), BATTEN_E_INVALID, ctx, "opt.density: 1025");
  o = good, o.tolerance = -1;
  T_STATUS(batten_write_surface(ctx, surface, &o, path), BATTEN_E_INVALID, ctx, "opt.tolerance: -1");
  T_STATUS(batten_read_surface(ctx, "none.json", &none), BATTEN_E_IO, ctx, "none.json: cannot open");
  T_STATUS(batten_read_surface(ctx, "a.step", &none), BATTEN_E_INVALID, ctx, "a.step: surfaces are read from .json");
  T_STATUS(batten_read_surface(ctx, "a.json", NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_CHECK(!none && scratch_count(s) == 0, "no file was begun, and no result given");
  batten_surface_free(surface);
}

/* A bilinear patch between corners (0, 0), (1, 0), (0, 1), (1, 1). */
static batten_surface *bilinear(batten_context *ctx, const double corners[4][3]) {
  static const double knots[4] = {0, 0, 1, 1};
  double points[4][3];
  for (int i = 0; i < 4; i++) memcpy(points[i / 2 + 2 * (i % 2)], corners[i], sizeof points[0]);
  const batten_surface_form form = {{1, 1}, {4, 4}, {knots, knots}, points[0]};
  batten_surface *surface = NULL;
  T_OK(batten_surface_create(ctx, &form, &surface), ctx);
  return surface;
}

/* What CAD systems cannot have. */
static void test_no_face(batten_context *ctx, scratch *s) {
  static const struct {
    const char *error;
    double corners[4][3];
  } cases[] = {
      {"surface: its size is 0 mm; CAD files need 1e-05 mm at least", {{1, 2, 3}, {1, 2, 3}, {1, 2, 3}, {1, 2, 3}}},
      {"surface: its size is 4.24264e-06 mm", {{0, 0, 0}, {3e-6, 0, 0}, {0, 3e-6, 0}, {3e-6, 3e-6, 0}}},
      {"surface: its control points span no area", {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}},
      {"surface: its control points span no area", {{0, 0, 0}, {1, 2, 3}, {0, 0, 0}, {1, 2, 3}}},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    batten_surface *surface = bilinear(ctx, cases[i].corners);
    T_STATUS(batten_write_surface(ctx, surface, NULL, scratch_file(s, "a.step")), BATTEN_E_INVALID, ctx,
             cases[i].error);
    T_STATUS(batten_write_surface(ctx, surface, NULL, scratch_file(s, "a.igs")), BATTEN_E_INVALID, ctx,
             cases[i].error);
    batten_surface_free(surface);
  }
  batten_write_surface_options o = batten_write_surface_options_default();
  batten_surface *small = bilinear(ctx, cases[1].corners);
  o.unit = BATTEN_UNIT_M;
  T_CHECK(scratch_count(s) == 0, "no file is begun");
  T_OK(batten_write_surface(ctx, small, &o, scratch_file(s, "small.step")), ctx);
  unlink(s->name);
  batten_surface_free(small);
}

/* ---- sides and STEP ---------------------------------------------------------------------------------- */

static void test_sides(batten_context *ctx) {
  static const struct {
    const char *name;
    bool point[4], closed[2];
    unsigned corner[4];
  } cases[] = {
      {"wave", {0, 0, 0, 0}, {0, 0}, {0, 1, 2, 3}},  {"cone", {0, 0, 0, 1}, {0, 0}, {0, 1, 2, 0}},
      {"slice", {1, 0, 1, 0}, {0, 0}, {0, 0, 2, 2}}, {"tube", {0, 0, 0, 0}, {1, 0}, {0, 0, 2, 2}},
      {"pipe", {0, 0, 0, 0}, {0, 1}, {0, 1, 1, 0}},  {"cap", {1, 0, 0, 0}, {1, 0}, {0, 0, 2, 2}},
      {"ring", {0, 0, 0, 0}, {1, 1}, {0, 0, 0, 0}},  {"leaf", {1, 0, 0, 1}, {0, 0}, {0, 0, 2, 0}},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    batten_surface *surface = make(ctx, cases[i].name);
    batten_surface_form form = batten_surface_get(surface);
    bx_sides sides;
    T_OK(bx_find_sides(ctx, &form, BATTEN_UNIT_MM, &sides), ctx);
    T_CHECK(!memcmp(sides.point, cases[i].point, sizeof sides.point) &&
                !memcmp(sides.closed, cases[i].closed, sizeof sides.closed) &&
                !memcmp(sides.corner, cases[i].corner, sizeof sides.corner),
            "%s: points %d %d %d %d, closed %d %d, corners %u %u %u %u", cases[i].name, sides.point[0],
            sides.point[1], sides.point[2], sides.point[3], sides.closed[0], sides.closed[1], sides.corner[0],
            sides.corner[1], sides.corner[2], sides.corner[3]);
    batten_surface_free(surface);
  }
}

static void test_step(batten_context *ctx, scratch *s) {
  for (size_t i = 0; i < SURFACE_SIDE_CASES; i++) {
    const surface_side_case *c = &surface_side_cases[i];
    batten_surface *surface = make(ctx, c->name);
    if (c->iges_only) {
      T_STATUS(
          batten_write_surface(ctx, surface, NULL, scratch_file(s, "no.step")), BATTEN_E_INVALID, ctx,
          "surface: its neighbouring sides at lower u and lower v are points, which STEP faces cannot have; write "
          ".iges");
    } else {
      step_doc d;
      size_t open = 0, points = c->points[0] * c->points[1];
      bool closed = c->uses == 2 * c->edges;
      char head[80];
      snprintf(head, sizeof head, "B_SPLINE_SURFACE_WITH_KNOTS('',%u,%u,", c->degree[0], c->degree[1]);
      T_OK(batten_write_surface(ctx, surface, NULL, scratch_file(s, "a.step")), ctx);
      T_CHECK(read_step(s->name, &d), "%s: numbered without gaps", c->name);
      T_CHECK(references_exist(&d) && reals_are_real(&d), "%s: %zu entities, all that is named is there", c->name,
              d.count);
      T_CHECK(loops_close(&d, &open) && open == 2 * (size_t)c->edges - c->uses &&
                  count_kind(&d, "EDGE_CURVE") == c->edges,
              "%s: the loop closes, of %zu edges %zu are open", c->name, count_kind(&d, "EDGE_CURVE"), open);
      T_CHECK(count_kind(&d, "ADVANCED_FACE") == 1 && count_kind(&d, "OPEN_SHELL") == !closed &&
                  count_kind(&d, "CLOSED_SHELL") == closed && strstr(d.text, head) && strstr(d.text, "'face 1'"),
              "%s: one face of the surface's degree", c->name);
      /* one is the origin of the placement */
      T_CHECK(count_kind(&d, "CARTESIAN_POINT") == points + 1, "%s: %zu control points, none twice", c->name, points);
      free_step(&d);
    }
    batten_surface_free(surface);
  }
}

/* Knots and their multiplicities, names and stamps, units. */
static void test_words(batten_context *ctx, scratch *s) {
  static const double u[] = {0, 0, 0, 0, 0.3, 0.6, 0.6, 1, 1, 1, 1}, v[] = {-1, -1, 3, 3};
  double points[7 * 2 * 3];
  for (int i = 0; i < 14; i++) memcpy(points + 3 * i, (double[3]){i / 2, i % 2, 0.125 * i * i}, 3 * sizeof(double));
  const batten_surface_form form = {{3, 1}, {11, 4}, {u, v}, points};
  batten_surface *surface = NULL;
  batten_write_surface_options o = batten_write_surface_options_default();
  size_t size;
  T_OK(batten_surface_create(ctx, &form, &surface), ctx);
  o.schema = BATTEN_STEP_AP242;
  o.unit = BATTEN_UNIT_INCH;
  o.name = "d\xc3\xb6me's";
  o.time_stamp = "2026-11-22T10:00:00";
  T_OK(batten_write_surface(ctx, surface, &o, scratch_file(s, "words.stp")), ctx);
  char *text = (char *)file_read(s->name, &size);
  text[size] = '\0';
  T_CHECK(strstr(text, ",.UNSPECIFIED.,.F.,.F.,.F.,(4,1,2,4),(2,2),(0.,0.3,0.6,1.),(-1.,3.),.UNSPECIFIED.);"),
          "knots and how often they are there");
  T_CHECK(strstr(text, ",.UNSPECIFIED.,.F.,.F.,(4,1,2,4),(0.,0.3,0.6,1.),.UNSPECIFIED.);"), "of sides, too");
  T_CHECK(strstr(text,
                 "FILE_DESCRIPTION(('B-spline "
                 "surface'),'2;1');\nFILE_NAME('d\\X2\\00F6\\X0\\me''s','2026-11-22T10:00:00'") &&
              strstr(text, "'INCH'") && strstr(text, "AP242"),
          "name, date, unit, schema");
  free(text);
  T_OK(batten_write_surface(ctx, surface, &o, scratch_file(s, "words.igs")), ctx);
  text = (char *)file_read(s->name, &size);
  text[size] = '\0';
  T_CHECK(strstr(text, "\n128,6,1,3,1,0,0,1,0,0,0.,0.,0.,0.,0.3,0.6,0.6,1.,1.,1.,1.,-1., ") &&
              strstr(text, "\n144,1,0,0,0;") && strstr(text, ",1,2HIN,"),
          "the same as IGES");
  bool lines = size % 81 == 0;
  for (size_t i = 80; i < size; i += 81) lines = lines && text[i] == '\n';
  T_CHECK(lines, "in lines of 80 columns");
  free(text);
  batten_surface_free(surface);
}

/* ---- VTK --------------------------------------------------------------------------------------------- */

/* Corners, then the sides v = 0, u = 1, v = 1, u = 0, then the inside, u first. */
static void test_vtk_order(void) {
  static const unsigned linear[] = {0, 2, 3, 1}, cubic_quadratic[] = {0, 9, 11, 2, 3, 6, 10, 5, 8, 1, 4, 7};
  unsigned order[BX_SPAN_MAX];
  T_CHECK(bx_vtk_quadrilateral_order(1, 1, order) == 4 && !memcmp(order, linear, sizeof linear), "degree 1 x 1");
  T_CHECK(bx_vtk_quadrilateral_order(3, 2, order) == 12 && !memcmp(order, cubic_quadratic, sizeof cubic_quadratic),
          "degree 3 x 2");
  bool all = true;
  for (unsigned p = 1; p <= 9; p++)
    for (unsigned q = 1; q <= 9; q++) {
      bool seen[BX_SPAN_MAX] = {false};
      size_t count = bx_vtk_quadrilateral_order(p, q, order);
      all = all && count == (size_t)(p + 1) * (q + 1);
      for (size_t i = 0; i < count; i++) {
        all = all && order[i] < count && !seen[order[i]];
        seen[order[i] % BX_SPAN_MAX] = true;
      }
    }
  T_CHECK(all, "degrees 1 .. 9 name every point once");
}

/* De Casteljau's algorithm in both directions. */
static void bezier_at(unsigned p, unsigned q, const double (*points)[3], double s, double t, double out[3]) {
  double rows[10][3], line[10][3];
  for (unsigned i = 0; i <= p; i++) {
    memcpy(line, points + i * (q + 1), (q + 1) * sizeof line[0]);
    for (unsigned left = q; left > 0; left--)
      for (unsigned j = 0; j < left; j++)
        for (int x = 0; x < 3; x++) line[j][x] = (1 - t) * line[j][x] + t * line[j + 1][x];
    memcpy(rows[i], line[0], sizeof rows[i]);
  }
  for (unsigned left = p; left > 0; left--)
    for (unsigned i = 0; i < left; i++)
      for (int x = 0; x < 3; x++) rows[i][x] = (1 - s) * rows[i][x] + s * rows[i + 1][x];
  memcpy(out, rows[0], sizeof rows[0]);
}

/* The Bezier form of every span pair has the points of the surface. */
static void test_spans(batten_context *ctx) {
  for (size_t i = 0; i < SURFACE_SIDE_CASES; i++) {
    const surface_side_case *c = &surface_side_cases[i];
    batten_surface *surface = make(ctx, c->name);
    batten_surface_form form = batten_surface_get(surface);
    size_t end[2] = {bx_form_points(&form, 0), bx_form_points(&form, 1)}, mu[2], pairs = 0;
    double worst = 0, points[BX_SPAN_MAX][3], x[3];
    for (mu[0] = bx_next_span(&form, 0, 0); mu[0] < end[0]; mu[0] = bx_next_span(&form, 0, mu[0]))
      for (mu[1] = bx_next_span(&form, 1, 0); mu[1] < end[1]; mu[1] = bx_next_span(&form, 1, mu[1]), pairs++) {
        bx_span_points(&form, (const size_t *)mu, points);
        for (int k = 0; k < 16; k++) {
          double part[2] = {(k % 4) / 3.0, (k / 4) / 3.0}, at[2];
          batten_surface_point p;
          for (int d = 0; d < 2; d++)
            at[d] = (1 - part[d]) * form.knots[d][mu[d]] + part[d] * form.knots[d][mu[d] + 1];
          if (batten_surface_evaluate(ctx, surface, 1, at, &p) < 0) worst = INFINITY;
          bezier_at(form.degree[0], form.degree[1], (const double(*)[3])points, part[0], part[1], x);
          for (int d = 0; d < 3; d++) worst = fmax(worst, fabs(x[d] - p.point[d]));
        }
      }
    T_CHECK(pairs == bx_span_count(&form, 0) * bx_span_count(&form, 1) &&
                pairs == (c->points[0] - c->degree[0]) * (c->points[1] - c->degree[1]),
            "%s: %zu span pairs", c->name, pairs);
    T_RATIO(worst, 64 * 0x1p-53 * 7, "%s: points of the Bezier forms", c->name); /* coordinates are below 7 */
    if (pairs == 1)
      T_CHECK(!memcmp(points, form.control_points, end[0] * end[1] * sizeof points[0]),
              "%s: the form is the surface's own, to the bit", c->name);
    batten_surface_free(surface);
  }
}

static uint64_t word(const unsigned char *at) {
  uint64_t value = 0;
  for (int i = 7; i >= 0; i--) value = value << 8 | at[i];
  return value;
}

static double real(const unsigned char *at) {
  uint64_t bits = word(at);
  double value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

static void test_vtu(batten_context *ctx, scratch *s) {
  batten_surface *surface = make(ctx, "wave"); /* degree 3 x 2, 4 x 2 spans */
  batten_surface_form form = batten_surface_get(surface);
  enum { CELLS = 8, EACH = 12 };
  size_t size;
  T_OK(batten_write_surface(ctx, surface, NULL, scratch_file(s, "a.vtu")), ctx);
  unsigned char *bytes = file_read(s->name, &size), *at = NULL;
  for (size_t i = 0; i + 1 < size && !at; i++)
    if (bytes[i] == '_' && i > 7 && !memcmp(bytes + i - 7, "\"raw\">\n", 7)) at = bytes + i + 1;
  T_CHECK(at && word(at) == CELLS * EACH * 24, "the first block holds the points");
  if (at) {
    double points[BX_SPAN_MAX][3];
    unsigned order[BX_SPAN_MAX];
    const size_t mu[2] = {3, 3}; /* the second pair */
    bx_span_points(&form, mu, points);
    bx_vtk_quadrilateral_order(3, 2, order);
    bool same = true;
    for (size_t i = 0; i < 3 * EACH; i++)
      same = same && real(at + 8 + 8 * (3 * EACH + i)) == points[order[i / 3]][i % 3];
    T_CHECK(same, "in VTK's order");
    const unsigned char *degrees = at + 8 + CELLS * EACH * 24, *domains = degrees + 8 + CELLS * 24;
    T_CHECK(
        word(degrees) == CELLS * 24 && real(degrees + 8) == 3 && real(degrees + 16) == 2 && real(degrees + 24) == 0,
        "with their degrees");
    T_CHECK(word(domains) == CELLS * 32 && real(domains + 8 + 32) == form.knots[0][3] &&
                real(domains + 8 + 40) == form.knots[0][4] && real(domains + 8 + 48) == form.knots[1][3] &&
                real(domains + 8 + 56) == form.knots[1][4],
            "and domains");
  }
  const unsigned char *end = bytes + size - strlen("\n  </AppendedData>\n</VTKFile>\n");
  size_t types = 0;
  while (at && types < CELLS && end[-1 - (long)types] == 77) types++;
  T_CHECK(types == CELLS, "all %zu cells are Bezier quadrilaterals", types);
  free(bytes);
  batten_surface_free(surface);
}

/* ---- tessellated --------------------------------------------------------------------------------------- */

static void test_tessellated(batten_context *ctx, scratch *s) {
  static const char *const names[] = {"t.ply", "t.obj", "t.off", "t.stl", "t.vtp"};
  static const double corners[4][3] = {{0, 0, 0}, {2, 0, 0}, {0, 3, 0}, {2, 3, 0}};
  batten_surface *surface = bilinear(ctx, corners);
  batten_write_surface_options o = batten_write_surface_options_default();
  o.density = 5;
  for (size_t i = 0; i < 5; i++) {
    batten_mesh *mesh = NULL;
    batten_mesh_measures m;
    T_OK(batten_write_surface(ctx, surface, &o, scratch_file(s, names[i])), ctx);
    if (i == 4) continue; /* VTK's files are not read */
    T_OK(batten_read_mesh(ctx, s->name, &mesh), ctx);
    T_OK(batten_mesh_measure(ctx, mesh, &m), ctx);
    T_CHECK(m.triangles == 50 && m.oriented && fabs(m.area - 6) < 1e-6, "%s: %zu triangles, area %g", names[i],
            m.triangles, m.area);
    T_CHECK(i > 0 || batten_mesh_field_count(mesh) == 7, "PLY has K, H, the normal and the place");
    batten_mesh_free(mesh);
  }
  batten_surface_free(surface);
}

/* ---- failures ---------------------------------------------------------------------------------------- */

typedef struct job {
  const batten_surface *surface;
  char path[400];
} job;

static batten_status write_again(batten_context *ctx, void *arg) {
  job *j = arg;
  return batten_write_surface(ctx, j->surface, NULL, j->path);
}

static batten_status read_again(batten_context *ctx, void *arg) {
  job *j = arg;
  batten_surface *surface = NULL;
  batten_status st = batten_read_surface(ctx, j->path, &surface);
  batten_surface_free(surface);
  return st;
}

static void test_failures(batten_context *ctx, scratch *s) {
  static const char *const names[] = {"f.step", "f.iges", "f.vtu", "f.ply", "f.json"};
  batten_surface *surface = make(ctx, "wave");
  job j = {surface, ""};
  for (size_t i = 0; i < 5; i++) {
    snprintf(j.path, sizeof j.path, "%s", scratch_file(s, names[i]));
    T_OK(write_again(ctx, &j), ctx);
    size_t files = scratch_count(s);
    t_fail_every_allocation(names[i], write_again, &j);
    if (i != 3) t_cancel_every_progress(names[i], write_again, &j);
    T_CHECK(scratch_count(s) == files, "no part files are left");
  }
  t_fail_every_allocation("reading", read_again, &j);
  t_cancel_every_progress("reading", read_again, &j);
  batten_surface_free(surface);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  scratch s;
  scratch_open(&s);
  test_calls(ctx, &s);
  test_no_face(ctx, &s);
  test_back(ctx, &s);
  test_refused(ctx);
  test_sides(ctx);
  test_step(ctx, &s);
  test_words(ctx, &s);
  test_vtk_order();
  test_spans(ctx);
  test_vtu(ctx, &s);
  test_tessellated(ctx, &s);
  test_failures(ctx, &s);
  scratch_close(&s);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all is released");
  batten_context_free(ctx);
  return t_done();
}
