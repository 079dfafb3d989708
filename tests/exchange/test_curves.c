/* Planar curves in files: documents that read back to the same bits, what is refused and where, the entities of STEP
 * and IGES, the pieces of SVG and VTK, points. That CAD systems take them is tested in tests/consumers/occt. */
#include "curve_cases.h"
#include "curves.h"
#include "files.h"
#include "step_doc.h"

typedef struct curves {
  batten_curve *items[CURVE_CASES];
  batten_plane planes[CURVE_CASES];
} curves;

static const batten_curve *const *all(const curves *c) { return (const batten_curve *const *)c->items; }

static curves make_all(batten_context *ctx) {
  curves c = {{NULL}, {{{0}, {{0}}}}};
  for (size_t i = 0; i < CURVE_CASES; i++) {
    T_OK(curve_case_make(ctx, &curve_cases[i], &c.items[i]), ctx);
    c.planes[i] = curve_cases[i].plane;
  }
  return c;
}

static void free_all(curves *c) {
  for (size_t i = 0; i < CURVE_CASES; i++) batten_curve_free(c->items[i]);
}

static char *text_of(const char *path) {
  size_t size;
  char *text = (char *)file_read(path, &size);
  text[size] = '\0';
  return text;
}

/* ---- documents --------------------------------------------------------------------------------------- */

static bool same_curves(const batten_curve *a, const batten_curve *b) {
  batten_curve_form x = batten_curve_get(a), y = batten_curve_get(b);
  return x.degree == y.degree && x.knot_count == y.knot_count && !x.closed == !y.closed &&
         !memcmp(x.knots, y.knots, x.knot_count * sizeof *x.knots) &&
         !memcmp(x.control_points, y.control_points, 2 * bx_curve_points(&x) * sizeof(double));
}

static void check_back(batten_context *ctx, scratch *s, size_t count, const batten_curve *const *items,
                       const batten_plane *planes, const char *what) {
  batten_write_curves_options o = batten_write_curves_options_default();
  batten_curves back = {0};
  batten_file_kind kind = BATTEN_FILE_UNKNOWN;
  char first[400];
  o.planes = planes;
  snprintf(first, sizeof first, "%s", scratch_file(s, "a.json"));
  T_OK(batten_write_curves(ctx, count, items, &o, first), ctx);
  T_OK(batten_read_curves(ctx, first, &back), ctx);
  bool same = back.count == count && (back.planes != NULL) == (planes != NULL);
  for (size_t i = 0; same && i < count; i++)
    same = same_curves(items[i], back.curves[i]) && (!planes || !memcmp(&planes[i], &back.planes[i], sizeof *planes));
  T_CHECK(same, "%s: the same bits come back", what);
  o.planes = back.planes;
  T_OK(batten_write_curves(ctx, back.count, (const batten_curve *const *)back.curves, &o, scratch_file(s, "b.json")),
       ctx);
  T_CHECK(files_equal(first, s->name), "%s: written again: the same bytes", what);
  T_CHECK(batten_file_identify(ctx, first, &kind) == BATTEN_OK && kind == BATTEN_FILE_CURVES, "%s: told to be curves",
          what);
  batten_curves_free(ctx, &back);
  T_CHECK(!back.curves && !back.planes && !back.count, "empty after it is freed");
}

static void test_back(batten_context *ctx, scratch *s) {
  curves c = make_all(ctx);
  for (size_t i = 0; i < CURVE_CASES; i++) {
    check_back(ctx, s, 1, all(&c) + i, NULL, curve_cases[i].name);
    check_back(ctx, s, 1, all(&c) + i, c.planes + i, curve_cases[i].name);
  }
  check_back(ctx, s, CURVE_CASES, all(&c), NULL, "all");
  check_back(ctx, s, CURVE_CASES, all(&c), c.planes, "all in their planes");
  free_all(&c);
  static const double knots[] = {1e-300, 1e-300, 1e-300, 2e-300, 3e-300, 3e-300, 3e-300};
  static const double points[8] = {0.1, -0.0, 5e-324, 1 / 3.0, -1e-310, 4.35e9, 123456789.123456789, 1e100};
  /* a z of -0 and axes with a -0, which are other bits than those of a horizontal plane */
  const batten_plane odd[3] = {{{0, 0, -0.0}, {{1, 0, 0}, {0, 1, 0}}},
                               {{0, -0.0, 7}, {{1, 0, 0}, {0, 1, 0}}},
                               {{0, 0, 0.1}, {{1, 0, -0.0}, {0, 1, 0}}}};
  batten_curve *curve = NULL;
  T_OK(batten_curve_create(ctx, &(batten_curve_form){2, 7, knots, points, 0}, &curve), ctx);
  for (size_t i = 0; i < 3; i++)
    check_back(ctx, s, 1, (const batten_curve *const *)&curve, &odd[i], "odd numbers in an odd plane");
  batten_curve_free(curve);
}

static batten_status read_bytes(batten_context *ctx, const void *text, size_t size, batten_curves *out) {
  bx_reader r;
  batten_status st = bx_open_memory(&r, ctx, "bad.json", text, size);
  if (st != BATTEN_OK) return st;
  st = bx_read_curves_from(&r, out);
  bx_close(&r);
  return st;
}

static batten_status read_text(batten_context *ctx, const char *text) {
  batten_curves c = {.count = 77};
  batten_status st = read_bytes(ctx, text, strlen(text), &c);
  if (st == BATTEN_OK)
    batten_curves_free(ctx, &c);
  else if (c.count != 77)
    t_line(false, "a result in spite of a failure");
  return st;
}

#define ONE "{\"batten\": \"curve\", \"version\": 1, "
#define MANY "{\"batten\": \"contours\", \"version\": 1, \"curves\": "
#define FORM "\"degree\": 1, \"knots\": [0, 0, 1, 1], \"control_points\": [[0, 0], [1, 2]]"
#define RING "\"degree\": 1, \"knots\": [0, 0, 1, 2, 2], \"control_points\": [[0, 0], [1, 2], [0, 0]]"

static void test_refused(batten_context *ctx) {
  static const struct {
    const char *text, *error;
  } cases[] = {
      {"", "bad.json:1: JSON:"},
      {"[]", "document: an array, where an object is expected"},
      {"{}", "document: 'batten' is missing"},
      {"{\"batten\": 3}", "document.batten: a number, where a text is expected"},
      {"{\"batten\": \"surface\", \"version\": 1}", "document: it holds a batten 'surface', not a curve"},
      {"{\"batten\": \"curve\", \"version\": 2}", "document.version: 2, where a whole number"},
      {"{\"batten\": \"contours\", \"version\": 0}", "document.version: 0, where a whole number"},
      {MANY "{}}", "contours.curves: an object, where an array is expected"},
      {MANY "[]}", "contours: 'curves' is empty; there must be one or more"},
      {"{\"batten\": \"contours\", \"version\": 1}", "contours: 'curves' is missing"},
      {MANY "[3]}", "contours.curves[0]: a number, where an object is expected"},
      {MANY "[{" FORM "}, {}]}", "contours.curves[1]: 'degree' is missing"},
      {ONE "\"x\": 0}", "curve: 'degree' is missing"},
      {ONE "\"degree\": 0}", "curve.degree: 0, where a whole number from 1 to 9 is expected"},
      {ONE "\"degree\": 10}", "curve.degree: 10, where"},
      {ONE "\"degree\": 1.5}", "curve.degree: 1.5, where"},
      {ONE "\"degree\": \"3\"}", "curve.degree: a text, where a number is expected"},
      {ONE "\"degree\": 1, \"periodic\": 1}", "curve.periodic: a number, where true or false is expected"},
      {ONE "\"degree\": 1, \"periodic\": null}", "curve.periodic: null, where true or false is expected"},
      {ONE "\"degree\": 1}", "curve: 'knots' is missing"},
      {ONE "\"degree\": 1, \"knots\": 4}", "curve.knots: a number, where an array is expected"},
      {ONE "\"degree\": 1, \"knots\": [0, 0, [], 1]}", "curve.knots[2]: an array, where a number is expected"},
      {ONE "\"degree\": 2, \"knots\": [0, 0, 1, 1]}", "curve.knots: 4 knots, where degree 2 needs 6 at least"},
      {ONE "\"degree\": 1, \"knots\": [0, 0, 1, 1]}", "curve: 'control_points' is missing"},
      {ONE "\"degree\": 1, \"knots\": [0, 0, 1, 1], \"control_points\": [[0, 0]]}",
       "curve.control_points: 1 points, where the knots and the degree need 2"},
      {ONE "\"degree\": 1, \"knots\": [0, 0, 1, 1], \"control_points\": [[0, 0], [1, 2, 3]]}",
       "curve.control_points[1]: 3 numbers, where 2 are expected"},
      {ONE "\"degree\": 1, \"knots\": [0, 0, 1, 1], \"control_points\": [[0, 0], [1, true]]}",
       "curve.control_points[1][1]: true or false, where a number is expected"},
      {ONE "\"degree\": 1, \"knots\": [0, 1, 1, 1], \"control_points\": [[0, 0], [1, 2]]}", "curve: knots["},
      {ONE "\"degree\": 1, \"knots\": [0, 0, 2, 1, 3, 3], \"control_points\": [[0, 0], [1, 2], [0, 1], [3, 3]]}",
       "curve: knots[3]: 1"},
      {ONE "\"periodic\": true, " FORM "}", "curve: control_points["},
      {ONE FORM ", \"z\": \"a\"}", "curve.z: a text, where a number is expected"},
      {ONE FORM ", \"z\": 1, \"plane\": {}}", "curve: 'z' and 'plane' at once; leave out one of them"},
      {ONE FORM ", \"plane\": 1}", "curve.plane: a number, where an object is expected"},
      {ONE FORM ", \"plane\": {}}", "curve.plane: 'origin' is missing"},
      {ONE FORM ", \"plane\": {\"origin\": [0, 0]}}", "curve.plane.origin: 2 numbers, where 3 are expected"},
      {ONE FORM ", \"plane\": {\"origin\": [0, 0, 0]}}", "curve.plane: 'axes' is missing"},
      {ONE FORM ", \"plane\": {\"origin\": [0, 0, 0], \"axes\": [[1, 0, 0]]}}",
       "curve.plane.axes: 1 items, where 2 are expected"},
      {ONE FORM ", \"plane\": {\"origin\": [0, 0, 0], \"axes\": [[1, 0, 0], [0, 1]]}}",
       "curve.plane.axes[1]: 2 numbers, where 3 are expected"},
      {ONE FORM ", \"plane\": {\"origin\": [0, 0, 0], \"axes\": [[1, 0, 0], [0, 2, 0]]}}",
       "curve.plane: axes: not of length 1; divide by their lengths"},
      {ONE FORM ", \"plane\": {\"origin\": [0, 0, 0], \"axes\": [[1, 0, 0], [0.6, 0.8, 0]]}}",
       "curve.plane: axes: not at a right angle; turn one of them"},
      {MANY "[{" FORM "}, {" FORM ", \"plane\": {\"origin\": [0, 0, 0], \"axes\": [[1, 0, 0], [1, 0, 0]]}}]}",
       "contours.curves[1].plane: axes: not at a right angle"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    batten_status st = read_text(ctx, cases[i].text);
    T_CHECK(st == BATTEN_E_FORMAT && strstr(batten_error(ctx), cases[i].error), "%s", batten_error(ctx));
  }
  static const char *const good[] = {ONE FORM "}", "\xef\xbb\xbf" ONE FORM ", \"periodic\": false}",
                                     ONE "\"periodic\": true, " RING "}", ONE FORM ", \"z\": -3}",
                                     MANY "[{" FORM "}, {" FORM ", \"z\": 1}]}"};
  for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) T_OK(read_text(ctx, good[i]), ctx);
  batten_curves c = {0};
  T_OK(read_bytes(ctx, good[4], strlen(good[4]), &c), ctx);
  T_CHECK(c.count == 2 && c.planes && c.planes[0].origin[2] == 0 && c.planes[0].axes[0][0] == 1 &&
              c.planes[1].origin[2] == 1,
          "where only some say where they lie, the others lie in z = 0");
  batten_curves_free(ctx, &c);
  const char *whole = good[4];
  size_t wrong = 0, size = strlen(whole);
  for (size_t cut = 0; cut < size; cut++) { /* exact-size blocks, so that a sanitizer sees a byte too far */
    char *part = malloc(cut ? cut : 1);
    memcpy(part, whole, cut);
    wrong += read_bytes(ctx, part, cut, &c) != BATTEN_E_FORMAT;
    free(part);
  }
  T_CHECK(wrong == 0, "each of the %zu shorter files is refused", size);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left behind");
}

/* ---- calls ------------------------------------------------------------------------------------------- */

static void test_calls(batten_context *ctx, scratch *s) {
  curves c = make_all(ctx);
  const batten_curve *holes[2] = {c.items[0], NULL};
  const batten_write_curves_options good = batten_write_curves_options_default();
  batten_write_curves_options o = good;
  batten_plane planes[2] = {c.planes[0], c.planes[0]};
  batten_curves none = {0};
  char path[400];
  snprintf(path, sizeof path, "%s", scratch_file(s, "calls.step"));
  T_STATUS(batten_write_curves(ctx, 1, NULL, NULL, path), BATTEN_E_INVALID, ctx, "curves: NULL");
  T_STATUS(batten_write_curves(ctx, 2, holes, NULL, path), BATTEN_E_INVALID, ctx, "curves[1]: NULL");
  T_STATUS(batten_write_curves(ctx, 0, holes, NULL, path), BATTEN_E_INVALID, ctx, "count: 0; must be 1 or more");
  T_STATUS(batten_write_curves(ctx, 1, holes, NULL, NULL), BATTEN_E_INVALID, ctx, "path: NULL");
  T_STATUS(batten_write_curves(ctx, 1, holes, NULL, "a.dxf"), BATTEN_E_INVALID, ctx,
           "a.dxf: curves are written as .json .step .stp .iges .igs .svg .vtu .vtp .vtk .csv; rename the file");
  T_STATUS(batten_write_curves(ctx, 1, holes, NULL, "a.txt"), BATTEN_E_INVALID, ctx, "a.txt: curves are written as");
  T_STATUS(batten_write_curves(ctx, 1, holes, NULL, "none/a.step"), BATTEN_E_IO, ctx, "make the directory first");
  o.struct_size = 3;
  T_STATUS(batten_write_curves(ctx, 1, holes, &o, path), BATTEN_E_INVALID, ctx, "struct_size: 3");
  o = good, o.unit = (batten_length_unit)4;
  T_STATUS(batten_write_curves(ctx, 1, holes, &o, path), BATTEN_E_INVALID, ctx, "opt.unit: 4");
  o = good, o.schema = (batten_step_schema)2;
  T_STATUS(batten_write_curves(ctx, 1, holes, &o, path), BATTEN_E_INVALID, ctx, "opt.schema: 2");
  o = good, o.time_stamp = "today";
  T_STATUS(batten_write_curves(ctx, 1, holes, &o, path), BATTEN_E_INVALID, ctx, "opt.time_stamp: 'today'");
  o = good, o.tolerance = -1;
  T_STATUS(batten_write_curves(ctx, 1, holes, &o, path), BATTEN_E_INVALID, ctx, "opt.tolerance: -1");
  o = good, o.tolerance = INFINITY;
  T_STATUS(batten_write_curves(ctx, 1, holes, &o, path), BATTEN_E_INVALID, ctx, "opt.tolerance: inf");
  o = good, o.planes = planes;
  planes[1].origin[2] = NAN;
  T_STATUS(batten_write_curves(ctx, 2, all(&c), &o, path), BATTEN_E_INVALID, ctx,
           "opt.planes[1].origin: not finite; give the place of (0, 0) in space");
  planes[1] = planes[0];
  planes[1].axes[0][1] = INFINITY;
  T_STATUS(batten_write_curves(ctx, 2, all(&c), &o, path), BATTEN_E_INVALID, ctx, "opt.planes[1].axes: not finite");
  planes[1] = planes[0];
  memcpy(planes[1].axes[1], planes[1].axes[0], sizeof planes[1].axes[0]);
  T_STATUS(batten_write_curves(ctx, 2, all(&c), &o, path), BATTEN_E_INVALID, ctx,
           "opt.planes[1].axes: not at a right angle");
  T_STATUS(batten_read_curves(ctx, "a.step", &none), BATTEN_E_INVALID, ctx,
           "a.step: curves are read from .json .json.gz; convert the file");
  T_STATUS(batten_read_curves(ctx, "a.json", NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_STATUS(batten_read_curves(ctx, NULL, &none), BATTEN_E_INVALID, ctx, "path: NULL");
  T_STATUS(batten_read_curves(ctx, "none.json", &none), BATTEN_E_IO, ctx, "none.json: cannot open");
  batten_curves_free(ctx, NULL);
  /* too small for CAD, which a point is */
  static const double knots[] = {0, 0, 1, 1}, same[4] = {3, 4, 3, 4};
  batten_curve *point = NULL;
  T_OK(batten_curve_create(ctx, &(batten_curve_form){1, 4, knots, same, 0}, &point), ctx);
  const batten_curve *two[2] = {c.items[0], point};
  for (int i = 0; i < 2; i++)
    T_STATUS(batten_write_curves(ctx, 2, two, NULL, i ? "p.step" : "p.igs"), BATTEN_E_INVALID, ctx,
             "curves[1]: its size is 0 mm; CAD files need 1e-05 mm at least");
  T_CHECK(scratch_count(s) == 0, "no file is begun");
  static const char *const others[] = {"p.json", "p.svg", "p.vtu", "p.csv", "p.vtp", "p.vtk"};
  for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) {
    T_OK(batten_write_curves(ctx, 1, two + 1, NULL, scratch_file(s, others[i])), ctx);
    unlink(s->name);
  }
  batten_curve_free(point);
  free_all(&c);
}

/* ---- STEP and IGES ----------------------------------------------------------------------------------- */

static void test_step(batten_context *ctx, scratch *s) {
  curves c = make_all(ctx);
  step_doc d;
  batten_write_curves_options o = batten_write_curves_options_default();
  size_t points = 1; /* the origin of the placement */
  for (size_t i = 0; i < CURVE_CASES; i++) points += curve_cases[i].count - (curve_cases[i].closed ? 1 : 0);
  T_OK(batten_write_curves(ctx, CURVE_CASES, all(&c), &o, scratch_file(s, "a.step")), ctx);
  T_CHECK(read_step(s->name, &d), "numbered without gaps");
  T_CHECK(references_exist(&d) && reals_are_real(&d), "%zu entities, all that is named is there", d.count);
  T_CHECK(count_kind(&d, "B_SPLINE_CURVE_WITH_KNOTS") == CURVE_CASES && count_kind(&d, "GEOMETRIC_CURVE_SET") == 1 &&
              count_kind(&d, "GEOMETRICALLY_BOUNDED_WIREFRAME_SHAPE_REPRESENTATION") == 1,
          "%zu curves in a set", count_kind(&d, "B_SPLINE_CURVE_WITH_KNOTS"));
  T_CHECK(count_kind(&d, "CARTESIAN_POINT") == points, "%zu control points, the ends of closed curves once", points);
  for (size_t i = 0; i < CURVE_CASES; i++) {
    char head[80];
    snprintf(head, sizeof head, "B_SPLINE_CURVE_WITH_KNOTS('curve %zu',%u,(", i, curve_cases[i].degree);
    T_CHECK(strstr(d.text, head) != NULL, "%s", head);
  }
  free_step(&d);
  o.schema = BATTEN_STEP_AP242;
  o.unit = BATTEN_UNIT_INCH;
  o.name = "d\xc3\xb6me's";
  o.time_stamp = "2026-11-22T10:00:00";
  o.planes = c.planes;
  T_OK(batten_write_curves(ctx, CURVE_CASES, all(&c), &o, scratch_file(s, "words.stp")), ctx);
  char *text = text_of(s->name);
  T_CHECK(strstr(text,
                 "FILE_DESCRIPTION(('B-spline curves'),'2;1');\nFILE_NAME('d\\X2\\00F6\\X0\\me''s',"
                 "'2026-11-22T10:00:00'") &&
              strstr(text, "'INCH'") && strstr(text, "AP242"),
          "name, date, unit, schema");
  T_CHECK(strstr(text, ",.UNSPECIFIED.,.T.,.F.,(4,1,2,1,4),(0.,0.25,0.5,0.75,1.),.UNSPECIFIED.);"),
          "closedness, knots and how often they are there");
  free(text);
  free_all(&c);
}

static void test_iges(batten_context *ctx, scratch *s) {
  static const double knots[] = {0, 0, 0, 0.5, 1, 1, 1}, points[] = {0, 0, 1, 2, 3, -1, 0, 0};
  const batten_plane plane = {{0.5, 0, -7}, {{0, 1, 0}, {0, 0, 1}}};
  batten_curve *curve = NULL;
  batten_write_curves_options o = batten_write_curves_options_default();
  size_t size;
  T_OK(batten_curve_create(ctx, &(batten_curve_form){2, 7, knots, points, 1}, &curve), ctx);
  const batten_curve *twice[2] = {curve, curve};
  o.planes = (batten_plane[2]){plane, {{0}, {{0, 1, 0}, {1, 0, 0}}}};
  T_OK(batten_write_curves(ctx, 2, twice, &o, scratch_file(s, "a.igs")), ctx);
  char *text = (char *)file_read(s->name, &size);
  text[size] = '\0';
  bool lines = size % 81 == 0;
  for (size_t i = 80; i < size; i += 81) lines = lines && text[i] == '\n';
  T_CHECK(lines, "in lines of 80 columns");
  /* upper index, degree, planar, closed, polynomial, not periodic; knots, weights, points, ends, normal */
  T_CHECK(strstr(text,
                 "\n126,3,2,1,1,1,0,0.,0.,0.,0.5,1.,1.,1.,1.,1.,1.,1.,0.5,0.,-7.,          1P      1\n"
                 "0.5,1.,-5.,0.5,3.,-8.,0.5,0.,-7.,0.,1.,1.,0.,0.;"),
          "all parameters of the first");
  T_CHECK(strstr(text, "0.,1.,0.,0.,-1.;") && strstr(text, "   CURVE       1D"), "normal and number of the second");
  free(text);
  batten_curve_free(curve);
}

/* ---- SVG --------------------------------------------------------------------------------------------- */

/* Points of an SVG path at part s of piece k, read from the file; false where there is no such piece. */
typedef struct path {
  size_t pieces;
  unsigned degree[4096];
  double points[4096][4][2]; /* with the start */
  bool closed;
} path;

static const char *read_path(const char *text, const char *id, path *out) {
  char head[40];
  double at[2] = {0, 0};
  snprintf(head, sizeof head, "<path id=\"%s\" d=\"", id);
  const char *c = strstr(text, head);
  out->pieces = 0;
  out->closed = false;
  if (!c) return NULL;
  for (c += strlen(head); *c != '"';) {
    char letter = *c++;
    unsigned degree = letter == 'L' ? 1 : letter == 'Q' ? 2 : letter == 'C' ? 3 : 0;
    if (letter == 'Z') out->closed = true;
    if (letter == 'M') {
      at[0] = strtod(c, (char **)&c);
      at[1] = strtod(c, (char **)&c);
    }
    if (!degree) continue;
    memcpy(out->points[out->pieces][0], at, sizeof at);
    for (unsigned i = 1; i <= degree; i++)
      for (int k = 0; k < 2; k++) out->points[out->pieces][i][k] = strtod(c, (char **)&c);
    memcpy(at, out->points[out->pieces][degree], sizeof at);
    out->degree[out->pieces++] = degree;
  }
  return c;
}

static void bezier_at(unsigned degree, const double *points, size_t n, double t, double *out) {
  double line[10][3];
  for (unsigned i = 0; i <= degree; i++) memcpy(line[i], points + n * i, n * sizeof *points);
  for (unsigned left = degree; left > 0; left--)
    for (unsigned i = 0; i < left; i++)
      for (size_t k = 0; k < n; k++) line[i][k] = (1 - t) * line[i][k] + t * line[i + 1][k];
  memcpy(out, line[0], n * sizeof *out);
}

static double size_of(const batten_curve_form *form) {
  double size = 0;
  for (size_t k = 0; k < 2 * bx_curve_points(form); k++) size = fmax(size, fabs(form->control_points[k]));
  return size;
}

/* How many pieces from the given one on there are to the end of a span, which all share equally. */
static size_t pieces_to(const path *p, size_t piece, const double end[2]) {
  for (size_t k = piece; k < p->pieces; k++) {
    const double *x = p->points[k][p->degree[k]];
    if (hypot(x[0] - end[0], x[1] - end[1]) < 1e-12) return k + 1 - piece;
  }
  return 0;
}

/* Largest distance of the path's pieces from the curve. */
static double path_error(batten_context *ctx, const batten_curve *curve, const path *p) {
  batten_curve_form form = batten_curve_get(curve);
  batten_curve_point at;
  double worst = 0;
  size_t piece = 0;
  for (size_t mu = form.degree; mu + form.degree + 1 < form.knot_count; mu++) {
    if (!(form.knots[mu] < form.knots[mu + 1])) continue;
    if (batten_curve_evaluate(ctx, curve, 1, &form.knots[mu + 1], &at) < 0) return INFINITY;
    size_t each = pieces_to(p, piece, at.point);
    if (each == 0) return INFINITY;
    for (size_t k = 0; k < each; k++, piece++)
      for (int i = 0; i <= 8; i++) {
        double part = ((double)k + i / 8.0) / (double)each, x[3];
        double t = (1 - part) * form.knots[mu] + part * form.knots[mu + 1];
        if (batten_curve_evaluate(ctx, curve, 1, &t, &at) < 0) return INFINITY;
        bezier_at(p->degree[piece], p->points[piece][0], 2, i / 8.0, x);
        worst = fmax(worst, hypot(x[0] - at.point[0], x[1] - at.point[1]));
      }
  }
  return piece == p->pieces ? worst : INFINITY;
}

static void test_svg(batten_context *ctx, scratch *s) {
  curves c = make_all(ctx);
  batten_write_curves_options o = batten_write_curves_options_default();
  path *p = malloc(sizeof *p);
  o.tolerance = 1e-5;
  T_OK(batten_write_curves(ctx, CURVE_CASES, all(&c), &o, scratch_file(s, "a.svg")), ctx);
  char *text = text_of(s->name);
  for (size_t i = 0; i < CURVE_CASES; i++) {
    const curve_case *k = &curve_cases[i];
    batten_curve_form form = batten_curve_get(c.items[i]);
    char id[20];
    snprintf(id, sizeof id, "curve-%zu", i);
    const char *end = read_path(text, id, p);
    T_CHECK(end && (k->degree > 3 ? p->pieces > k->spans : p->pieces == k->spans) && p->closed == k->closed,
            "%s: %zu pieces in %zu spans", k->name, p->pieces, k->spans);
    if (k->degree <= 3)
      T_RATIO(path_error(ctx, c.items[i], p), 16 * 0x1p-53 * size_of(&form), "%s: exact", k->name);
    else
      T_RATIO(path_error(ctx, c.items[i], p), 1e-5, "%s: within the tolerance", k->name);
    T_CHECK(k->degree > 3 || p->degree[0] == k->degree, "%s: lines, quadratics and cubics as they are", k->name);
    if (!end || !p->pieces) continue;
    const double *last = p->points[p->pieces - 1][p->degree[p->pieces - 1]];
    T_CHECK(!memcmp(p->points[0][0], form.control_points, 2 * sizeof(double)) &&
                !memcmp(last, form.control_points + form.knot_count * 2 - 2 * form.degree - 4, 2 * sizeof(double)),
            "%s: its ends are the control points, to the bit", k->name);
  }
  free(text);
  free(p);
  free_all(&c);
}

/* The view box has y upwards and a margin; width and height in the unit, metres as centimetres. */
static void test_svg_box(batten_context *ctx, scratch *s) {
  static const double knots[] = {0, 0, 1, 1}, points[] = {10, 100, 30, 110};
  static const char *const sizes[4] = {"width=\"22mm\" height=\"12mm\"", "width=\"22cm\" height=\"12cm\"",
                                       "width=\"2200cm\" height=\"1200cm\"", "width=\"22in\" height=\"12in\""};
  batten_write_curves_options o = batten_write_curves_options_default();
  batten_curve *curve = NULL;
  T_OK(batten_curve_create(ctx, &(batten_curve_form){1, 4, knots, points, 0}, &curve), ctx);
  for (int unit = 0; unit < 4; unit++) {
    o.unit = (batten_length_unit)unit;
    T_OK(batten_write_curves(ctx, 1, (const batten_curve *const *)&curve, &o, scratch_file(s, "box.svg")), ctx);
    char *text = text_of(s->name);
    T_CHECK(strstr(text, sizes[unit]) && strstr(text, "viewBox=\"9 -111 22 12\"") && strstr(text, "scale(1 -1)") &&
                strstr(text, "d=\"M 10 100\nL 30 110\""),
            "%s", sizes[unit]);
    free(text);
  }
  batten_curve_free(curve);
}

/* ---- VTK --------------------------------------------------------------------------------------------- */

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

/* The first appended block; the others follow it. */
static const unsigned char *first_block(const unsigned char *bytes, size_t size) {
  for (size_t i = 7; i + 1 < size; i++)
    if (bytes[i] == '_' && !memcmp(bytes + i - 7, "\"raw\">\n", 7)) return bytes + i + 1;
  return NULL;
}

static const unsigned char *next_block(const unsigned char *block) { return block + 8 + word(block); }

static void test_vtu(batten_context *ctx, scratch *s) {
  curves c = make_all(ctx);
  batten_write_curves_options o = batten_write_curves_options_default();
  size_t size, cell = 0, point = 0;
  double worst = 0;
  o.planes = c.planes;
  T_OK(batten_write_curves(ctx, CURVE_CASES, all(&c), &o, scratch_file(s, "a.vtu")), ctx);
  unsigned char *bytes = file_read(s->name, &size);
  const unsigned char *points = first_block(bytes, size), *blocks[7] = {points};
  T_CHECK(points != NULL, "blocks are appended");
  if (!points) return;
  for (int i = 1; i < 7; i++) blocks[i] = next_block(blocks[i - 1]);
  bx_curve_set set = {.count = CURVE_CASES, .curves = all(&c), .planes = c.planes};
  bool right = true;
  for (size_t i = 0; i < CURVE_CASES; i++) {
    batten_curve_form form = batten_curve_get(c.items[i]);
    for (size_t mu = form.degree; mu + form.degree + 1 < form.knot_count; mu++) {
      if (!(form.knots[mu] < form.knots[mu + 1])) continue;
      unsigned d = form.degree;
      double line[10][3];
      for (unsigned k = 0; k <= d; k++) /* both ends first */
        for (size_t x = 0; x < 3; x++)
          line[k == 0 ? 0 : k == 1 ? d : k - 1][x] = real(points + 8 + 8 * (3 * (point + k) + x));
      right = right && real(blocks[1] + 8 + 24 * cell) == d && real(blocks[2] + 8 + 16 * cell) == form.knots[mu] &&
              real(blocks[2] + 16 + 16 * cell) == form.knots[mu + 1] && word(blocks[3] + 8 + 8 * cell) == i &&
              word(blocks[5] + 8 + 8 * cell) == point + d + 1 && blocks[6][8 + cell] == 75;
      for (int k = 0; k <= 8; k++) {
        double t = (1 - k / 8.0) * form.knots[mu] + k / 8.0 * form.knots[mu + 1], x[3], place[3];
        batten_curve_point at;
        if (batten_curve_evaluate(ctx, c.items[i], 1, &t, &at) < 0) right = false;
        bezier_at(d, line[0], 3, k / 8.0, x);
        bx_curve_place(&set, i, at.point, place);
        for (int e = 0; e < 3; e++) worst = fmax(worst, fabs(x[e] - place[e]));
      }
      cell++;
      point += d + 1;
    }
  }
  T_CHECK(word(points) == 24 * point && word(blocks[4]) == 8 * point && word(blocks[6]) == cell, "%zu cells", cell);
  T_CHECK(right, "degrees, domains, numbers, ends and types of all");
  T_RATIO(worst, 64 * 0x1p-53 * 32, "the cells are the curves"); /* coordinates are below 32 */
  free(bytes);
  free_all(&c);
}

/* ---- points ------------------------------------------------------------------------------------------ */

/* Largest distance of places on the curve from the polygon's part over the same parameters. */
static double polygon_error(batten_context *ctx, const batten_curve *curve, size_t count, const double *t,
                            const double *points) {
  double worst = 0;
  for (size_t i = 0; i + 1 < count; i++)
    for (int k = 0; k <= 8; k++) {
      const double *a = points + 2 * i, *b = a + 2;
      double at = t[i] + (t[i + 1] - t[i]) * k / 8, along[2] = {b[0] - a[0], b[1] - a[1]};
      batten_curve_point p;
      if (batten_curve_evaluate(ctx, curve, 1, &at, &p) < 0) return INFINITY;
      double square = along[0] * along[0] + along[1] * along[1];
      double part = ((p.point[0] - a[0]) * along[0] + (p.point[1] - a[1]) * along[1]) / square;
      part = fmin(fmax(part, 0), 1);
      worst = fmax(worst, hypot(a[0] + part * along[0] - p.point[0], a[1] + part * along[1] - p.point[1]));
    }
  return worst;
}

/* What batten_read_contours makes of it: the points of the curves at their parameters, to the bit in the plane. */
static void test_csv(batten_context *ctx, scratch *s) {
  curves c = make_all(ctx);
  for (int space = 0; space < 2; space++) {
    batten_write_curves_options o = batten_write_curves_options_default();
    batten_contours back = {0};
    double worst = 0, off = 0;
    bool same = true;
    o.planes = space ? c.planes : NULL;
    o.tolerance = 1e-3;
    T_OK(batten_write_curves(ctx, CURVE_CASES, all(&c), &o, scratch_file(s, "a.csv")), ctx);
    T_OK(batten_read_contours(ctx, s->name, &back), ctx);
    T_CHECK(back.count == CURVE_CASES && back.parameters && (back.planes != NULL) == space, "%zu contours, %s",
            back.count, space ? "in space" : "plane");
    if (back.count != CURVE_CASES) return;
    for (size_t i = 0; i < CURVE_CASES; i++) {
      size_t first = back.starts[i], count = back.starts[i + 1] - first;
      const double *points = back.points + 2 * first, *t = back.parameters + first;
      batten_curve_form form = batten_curve_get(c.items[i]);
      same = same && t[0] == form.knots[0] && t[count - 1] == form.knots[form.knot_count - 1];
      for (size_t k = 0; k < count; k++) {
        batten_curve_point p;
        same = same && batten_curve_evaluate(ctx, c.items[i], 1, &t[k], &p) >= 0;
        if (!space) {
          same = same && !memcmp(p.point, points + 2 * k, sizeof p.point);
          continue;
        }
        for (int e = 0; e < 3; e++) {
          const batten_plane *from = &c.planes[i], *to = &back.planes[i];
          double x = from->origin[e] + p.point[0] * from->axes[0][e] + p.point[1] * from->axes[1][e];
          double y = to->origin[e] + points[2 * k] * to->axes[0][e] + points[2 * k + 1] * to->axes[1][e];
          off = fmax(off, fabs(x - y));
        }
      }
      if (!space) worst = fmax(worst, polygon_error(ctx, c.items[i], count, t, points));
      if (form.closed) same = same && !memcmp(points, points + 2 * count - 2, 2 * sizeof *points);
    }
    T_CHECK(same, "points at their parameters, from end to end; closed curves end where they begin");
    if (space)
      T_RATIO(off, 1e-14 * 32, "the same places in space");
    else
      T_RATIO(worst, 1e-3, "the polygons are within the tolerance");
    batten_contours_free(ctx, &back);
  }
  char *text = text_of(s->name);
  T_CHECK(!strncmp(text, "curve,t,x,y,z,curvature\n0,0,", 28), "columns by name");
  free(text);
  /* its first derivative vanishes at the start */
  static const double knots[] = {0, 0, 0, 1, 1, 1}, cusp[] = {0, 0, 0, 0, 1, 1};
  batten_curve *curve = NULL;
  T_OK(batten_curve_create(ctx, &(batten_curve_form){2, 6, knots, cusp, 0}, &curve), ctx);
  T_OK(batten_write_curves(ctx, 1, (const batten_curve *const *)&curve, NULL, scratch_file(s, "cusp.csv")), ctx);
  text = text_of(s->name);
  T_CHECK(!strncmp(text, "curve,t,x,y,curvature\n0,0,0,0,nan\n", 34), "no tangent, no curvature");
  free(text);
  batten_curve_free(curve);
  free_all(&c);
}

static void test_vtp(batten_context *ctx, scratch *s) {
  curves c = make_all(ctx);
  batten_write_curves_options o = batten_write_curves_options_default();
  batten_contours plane = {0};
  size_t size, legacy_size;
  o.tolerance = 0.01;
  T_OK(batten_write_curves(ctx, CURVE_CASES, all(&c), &o, scratch_file(s, "b.csv")), ctx);
  T_OK(batten_read_contours(ctx, s->name, &plane), ctx);
  T_OK(batten_write_curves(ctx, CURVE_CASES, all(&c), &o, scratch_file(s, "b.vtp")), ctx);
  unsigned char *bytes = file_read(s->name, &size);
  T_OK(batten_write_curves(ctx, CURVE_CASES, all(&c), &o, scratch_file(s, "b.vtk")), ctx);
  unsigned char *legacy = file_read(s->name, &legacy_size);
  const unsigned char *blocks[6] = {first_block(bytes, size)};
  T_CHECK(blocks[0] && plane.count == CURVE_CASES, "the same polygons as .csv has");
  if (!blocks[0] || plane.count != CURVE_CASES) return;
  for (int i = 1; i < 6; i++) blocks[i] = next_block(blocks[i - 1]);
  size_t count = plane.starts[CURVE_CASES];
  bool same = word(blocks[0]) == 24 * count && word(blocks[4]) == 8 * count && word(blocks[5]) == 8 * CURVE_CASES;
  for (size_t i = 0; same && i < count; i++)
    same = real(blocks[0] + 8 + 24 * i) == plane.points[2 * i] &&
           real(blocks[0] + 16 + 24 * i) == plane.points[2 * i + 1] && real(blocks[0] + 24 + 24 * i) == 0 &&
           real(blocks[1] + 8 + 8 * i) == plane.parameters[i] && word(blocks[4] + 8 + 8 * i) == i;
  for (size_t i = 0; same && i < CURVE_CASES; i++)
    same = word(blocks[3] + 8 + 8 * i) == i && word(blocks[5] + 8 + 8 * i) == plane.starts[i + 1];
  T_CHECK(same, "points, parameters, numbers and lines of %zu places", count);
  char head[160];
  snprintf(head, sizeof head, "# vtk DataFile Version 3.0\nbatten %s\nBINARY\nDATASET POLYDATA\nPOINTS %zu double\n",
           batten_version(), count);
  size_t at = strlen(head);
  same = legacy_size > at + 24 * count && !memcmp(legacy, head, at);
  for (size_t i = 0; same && i < 24 * count; i++) same = legacy[at + i] == blocks[0][8 + i / 8 * 8 + 7 - i % 8];
  T_CHECK(same, ".vtk: the same points, big endian");
  free(bytes);
  free(legacy);
  batten_contours_free(ctx, &plane);
  free_all(&c);
}

/* ---- failures ---------------------------------------------------------------------------------------- */

typedef struct job {
  const curves *c;
  char path[400];
} job;

static batten_status write_again(batten_context *ctx, void *arg) {
  job *j = arg;
  batten_write_curves_options o = batten_write_curves_options_default();
  o.planes = j->c->planes;
  return batten_write_curves(ctx, CURVE_CASES, all(j->c), &o, j->path);
}

static batten_status read_again(batten_context *ctx, void *arg) {
  job *j = arg;
  batten_curves c = {0};
  batten_status st = batten_read_curves(ctx, j->path, &c);
  batten_curves_free(ctx, &c);
  return st;
}

static void test_failures(batten_context *ctx, scratch *s) {
  static const char *const names[] = {"f.step", "f.iges", "f.vtu", "f.svg", "f.json", "f.csv", "f.vtp", "f.vtk"};
  curves c = make_all(ctx);
  job j = {&c, ""};
  for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
    snprintf(j.path, sizeof j.path, "%s", scratch_file(s, names[i]));
    T_OK(write_again(ctx, &j), ctx);
    size_t files = scratch_count(s);
    t_fail_every_allocation(names[i], write_again, &j);
    t_cancel_every_progress(names[i], write_again, &j);
    T_CHECK(scratch_count(s) == files, "no part files are left");
  }
  snprintf(j.path, sizeof j.path, "%s", scratch_file(s, "f.json"));
  t_fail_every_allocation("reading", read_again, &j);
  t_cancel_every_progress("reading", read_again, &j);
  free_all(&c);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  scratch s;
  scratch_open(&s);
  test_calls(ctx, &s);
  test_back(ctx, &s);
  test_refused(ctx);
  test_step(ctx, &s);
  test_iges(ctx, &s);
  test_svg(ctx, &s);
  test_svg_box(ctx, &s);
  test_vtu(ctx, &s);
  test_csv(ctx, &s);
  test_vtp(ctx, &s);
  test_failures(ctx, &s);
  scratch_close(&s);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all is released");
  batten_context_free(ctx);
  return t_done();
}
