/* Sections from files: contours put together by planes, the way through planes that are not parallel, offsets of
 * hulls, points in no order, documents; what is refused. */
#include "files.h"

static batten_status read_text(batten_context *ctx, const char *name, const char *text, double gap, int points,
                               batten_section_set *out) {
  batten_read_sections_options o = batten_read_sections_options_default();
  bx_reader r;
  bool gz;
  o.gap = gap;
  o.points = points;
  batten_status st = bx_open_memory(&r, ctx, name, text, strlen(text));
  if (st != BATTEN_OK) return st;
  st = bx_read_sections_from(&r, bx_format_of(name, &gz), &o, out);
  bx_close(&r);
  return st;
}

static batten_section_set good(batten_context *ctx, const char *text, double gap, int points) {
  batten_section_set set = {0};
  T_OK(read_text(ctx, "a.txt", text, gap, points, &set), ctx);
  return set;
}

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void lift(const batten_section *s, size_t i, double *out) {
  for (int k = 0; k < 3; k++)
    out[k] = s->origin[k] + s->points[2 * i] * s->rotation[0][k] + s->points[2 * i + 1] * s->rotation[1][k];
}

/* Rows orthonormal and right-handed. */
static double frame_error(const batten_section *s) {
  const double *x = s->rotation[0], *y = s->rotation[1], *z = s->rotation[2];
  double worst = fmax(fabs(dot(x, y)), fmax(fabs(dot(y, z)), fabs(dot(z, x))));
  for (int k = 0; k < 3; k++) {
    worst = fmax(worst, fabs(dot(s->rotation[k], s->rotation[k]) - 1));
    worst = fmax(worst, fabs(x[(k + 1) % 3] * y[(k + 2) % 3] - x[(k + 2) % 3] * y[(k + 1) % 3] - z[k]));
  }
  return worst;
}

static bool same_sections(const batten_section_set *a, const batten_section_set *b) {
  bool same = a->count == b->count;
  for (size_t i = 0; same && i < a->count; i++) {
    const batten_section *p = &a->sections[i], *q = &b->sections[i];
    same = !memcmp(p->origin, q->origin, sizeof p->origin) && !memcmp(p->rotation, q->rotation, sizeof p->rotation) &&
           p->contour_count == q->contour_count &&
           !memcmp(p->starts, q->starts, (p->contour_count + 1) * sizeof *p->starts) &&
           !memcmp(p->points, q->points, 2 * p->starts[p->contour_count] * sizeof *p->points);
  }
  return same;
}

/* ---- parallel planes --------------------------------------------------------------------------------- */

/* Contours of one slice stand anywhere in the file; heights ascend; numbers stay. */
static void test_grouping(batten_context *ctx) {
  static const double ring[] = {0.1, 0.1, 3, 0.1, 3, 4.7, 0.1, 4.7}, hole[] = {1, 1, 2, 1, 2, 2};
  batten_section_set s = good(ctx,
                              "x,y,z,contour\n.1,.1,7.3,a\n3,.1,7.3,a\n3,4.7,7.3,a\n.1,4.7,7.3,a\n"
                              "0,0,-1.25,b\n1,0,-1.25,b\n1,1,-1.25,b\n"
                              "1,1,7.3,c\n2,1,7.3,c\n2,2,7.3,c\n",
                              0, 0);
  T_CHECK(s.count == 2 && s.sections[0].origin[2] == -1.25 && s.sections[1].origin[2] == 7.3 && !s.deck,
          "two sections by height: %zu", s.count);
  if (s.count == 2) {
    const batten_section *top = &s.sections[1];
    T_CHECK(top->contour_count == 2 && top->starts[0] == 0 && top->starts[1] == 4 && top->starts[2] == 7 &&
                !memcmp(top->points, ring, sizeof ring) && !memcmp(top->points + 8, hole, sizeof hole),
            "the upper one has both of its contours, to the bit");
    T_CHECK(frame_error(top) == 0 && top->rotation[0][0] == 1 && top->rotation[2][2] == 1, "in the frame of space");
  }
  batten_section_set_free(ctx, &s);
  s = good(ctx, "1 -4 0\n2 -4 0\n1 -4 1\n\n1 5 0\n2 5 0\n1 5 1\n", 0, 0);
  T_CHECK(s.count == 2 && s.sections[0].origin[1] == 5 && s.sections[0].rotation[2][1] == -1 &&
              s.sections[1].points[2] == 2 && frame_error(&s.sections[0]) == 0,
          "planes y = const by descending y, in x z");
  batten_section_set_free(ctx, &s);
  s = good(ctx, "contour 1\n5 5 3\ncontour 3\n0 0 0\n1 0 0\n1 1 0\n", 0, 0);
  T_CHECK(s.count == 2 && s.sections[1].starts[1] == 1, "a point may end a stack");
  batten_section_set_free(ctx, &s);
}

static void test_planar(batten_context *ctx) {
  static const char two[] = "0 0\n1 0\n0 1\n\n5 5\n6 5\n5 6\n";
  batten_section_set s = good(ctx, two, 1.5, 0);
  T_CHECK(s.count == 2 && s.sections[1].origin[2] == 1.5 && s.sections[1].points[1] == 5, "planar contours by a gap");
  batten_section_set_free(ctx, &s);
  s = good(ctx, "0 0\n1 0\n0 1\n", 0, 0);
  T_CHECK(s.count == 1 && s.sections[0].origin[2] == 0, "one alone needs none");
  batten_section_set_free(ctx, &s);
  T_STATUS(read_text(ctx, "a.txt", two, 0, 0, &s), BATTEN_E_FORMAT, ctx, "a.txt: 2 contours without heights;");
}

enum { SLICES = 9, CORNERS = 24 };

/* Slices in space, each an ellipse in its plane, in shuffled order; place(slice, x, y) -> space. Returns the text. */
typedef void placement(double slice, double x, double y, double *out);
static char *slices_of(placement *place, double (*points)[3]) {
  static const int order[SLICES] = {4, 0, 7, 2, 8, 1, 6, 3, 5};
  char *text = malloc(SLICES * CORNERS * 90 + SLICES * 20), *to = text;
  for (int i = 0; i < SLICES; i++) {
    to += sprintf(to, "contour %d\n", CORNERS);
    for (int k = 0; k < CORNERS; k++) {
      double a = 2 * 3.14159265358979 * k / CORNERS, *p = points[order[i] * CORNERS + k];
      place(order[i], 2 * cos(a) + 0.3 * cos(2 * a), 1.2 * sin(a), p);
      to += sprintf(to, "%.17g %.17g %.17g\n", p[0], p[1], p[2]);
    }
  }
  return text;
}

static double worst_gap(const batten_section_set *s, double (*points)[3], bool turned) {
  double worst = s->count == SLICES ? 0 : INFINITY;
  for (size_t i = 0; i < s->count && worst < 1; i++)
    for (size_t k = 0; k < CORNERS; k++) {
      double x[3], *p = points[(turned ? SLICES - 1 - i : i) * CORNERS + k];
      lift(&s->sections[i], k, x);
      for (int c = 0; c < 3; c++) worst = fmax(worst, fabs(x[c] - p[c]));
    }
  return worst;
}

static void place_tilted(double slice, double x, double y, double *out) {
  static const double e[3][3] = {{0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}};
  for (int k = 0; k < 3; k++) out[k] = 10 + x * e[0][k] + y * e[1][k] + 0.5 * slice * e[2][k];
}

static void test_tilted(batten_context *ctx) {
  double points[SLICES * CORNERS][3];
  char *text = slices_of(place_tilted, points);
  batten_section_set s = good(ctx, text, 0, 0);
  bool turned = s.count && s.sections[0].rotation[2][2] < 0, one = true;
  double worst = worst_gap(&s, points, turned), steps = 0;
  for (size_t i = 0; i < s.count; i++) {
    one = one && !memcmp(s.sections[i].rotation, s.sections[0].rotation, sizeof s.sections[0].rotation);
    double d[3];
    for (int k = 0; i && k < 3; k++) d[k] = s.sections[i].origin[k] - s.sections[i - 1].origin[k];
    if (i) steps = fmax(steps, fabs(dot(d, s.sections[0].rotation[2]) - 0.5));
  }
  T_CHECK(worst < 1e-13 && one && steps < 1e-13 && frame_error(&s.sections[0]) < 1e-14,
          "tilted slices share one frame: points to %.2g, distances to %.2g", worst, steps);
  batten_section_set_free(ctx, &s);
  free(text);
}

/* A bent and lifted tube: planes turn by 120 degrees, each across the path. */
static void place_bent(double slice, double x, double y, double *out) {
  double a = slice / (SLICES - 1) * 2.0944;
  out[0] = (6 + x) * cos(a);
  out[1] = (6 + x) * sin(a);
  out[2] = y + 0.1 * slice;
}

static void test_bent(batten_context *ctx) {
  double points[SLICES * CORNERS][3], turn = 0, shear = INFINITY, frame = 0;
  char *text = slices_of(place_bent, points);
  batten_section_set s = good(ctx, text, 0, 0);
  double d[3];
  T_CHECK(s.count == SLICES, "as many sections as slices: %zu", s.count);
  lift(&s.sections[0], 0, d);
  bool turned = fabs(d[0] - points[0][0]) > 0.5;
  double worst = worst_gap(&s, points, turned);
  for (size_t i = 0; i < s.count; i++) {
    frame = fmax(frame, frame_error(&s.sections[i]));
    if (i == 0) continue;
    for (int k = 0; k < 3; k++) {
      turn = fmax(turn, acos(fmin(1, dot(s.sections[i].rotation[k], s.sections[i - 1].rotation[k]))));
      d[k] = s.sections[i].origin[k] - s.sections[i - 1].origin[k];
    }
    shear = fmin(shear, dot(d, s.sections[i].rotation[2]) / sqrt(dot(d, d)));
  }
  T_CHECK(worst < 1e-13 && frame < 1e-13, "bent slices are put along their way: points to %.2g, frames to %.2g",
          worst, frame);
  /* 120 degrees in 8 steps; no frame turns farther than its plane */
  T_CHECK(fabs(turn - 2.0944 / 8) < 1e-3 && shear > 0.9, "frames turn by %.4g a step and face ahead (%.3g)", turn,
          shear);
  batten_section_set_free(ctx, &s);
  free(text);
}

/* ---- hulls ---------------------------------------------------------------------------------------------- */

static void test_offsets(batten_context *ctx) {
  static const double bulb[] = {0, 0, 0.5, 1, 0, 1.95, -0.5, 1}, bow[] = {0, 2.05, 1, 3, 3, 5, -3, 5, -1, 3};
  static const double stern[] = {2, 0, 3, 1, 5, 3, -5, 3, -3, 1, -2, 0},
                      inwards[] = {2, 0, 1.5, 1, 0.75, 2.5, -0.75, 2.5, -1.5, 1, -2, 0};
  batten_section_set s = good(ctx,
                              "station,waterline,half_breadth\n10,0,0\n10,1,.5\n10,2,0\n10,3,1\n"
                              "0,0,2\n0,1,3\n5,0,2\n5,1,1.5\n20,0,0\n20,1,0\n15,1,0\n15,2,1\n15,3,0\n15,4,0\n",
                              0, 0);
  T_CHECK(s.count == 5, "four stations and a stem: %zu", s.count);
  if (s.count == 5) {
    const batten_section *t = s.sections;
    T_CHECK(t[2].contour_count == 2 && t[2].starts[1] == 4 && t[2].starts[2] == 9 && t[2].origin[0] == 10 &&
                !memcmp(t[2].points, bulb, sizeof bulb) && !memcmp(t[2].points + 8, bow, sizeof bow),
            "bulb and bow are two contours that do not touch; the bow goes on above");
    T_CHECK(t[0].contour_count == 1 && t[0].starts[1] == 6 && !memcmp(t[0].points, stern, sizeof stern),
            "a flat bottom; the side goes straight on");
    T_CHECK(t[1].starts[1] == 6 && !memcmp(t[1].points, inwards, sizeof inwards), "not to the middle");
    T_CHECK(t[3].starts[1] == 4, "one that is closed above stays so");
    T_CHECK(t[4].contour_count == 1 && t[4].starts[1] == 2 && t[4].points[1] == 0 && t[4].points[3] == 1,
            "the stem is a line from its lowest row to its highest");
    T_CHECK(frame_error(t) == 0 && t[0].rotation[2][0] == 1, "in planes across x");
    T_CHECK(s.deck_count == 3 && s.deck[0] == 0 && s.deck[1] == 1 && s.deck[4] == 10 && s.deck[5] == 3,
            "the deck has the %zu open ones", s.deck_count);
  }
  batten_section_set_free(ctx, &s);
  T_STATUS(read_text(ctx, "a.csv", "station,waterline,half_breadth\n1,0,0\n1,1,-2\n", 0, 0, &s), BATTEN_E_FORMAT, ctx,
           "a.csv: station 1, waterline 1: half-breadth -2; it must not be negative");
}

/* ---- points in no order ---------------------------------------------------------------------------------- */

/* Circles in planes, rounded as text is, in a random order. */
static char *shuffled_cuts(size_t planes, const double (*normals)[3], const double *heights, size_t each) {
  size_t count = planes * each;
  double(*p)[3] = malloc(count * sizeof *p);
  uint64_t seed = 11;
  for (size_t i = 0; i < count; i++) {
    const double *n = normals[i / each];
    double u[3] = {n[1], n[2], n[0]}, v[3], a = 6.283 * t_uniform(&seed), along = dot(u, n);
    for (int k = 0; k < 3; k++) u[k] -= along * n[k];
    double length = sqrt(dot(u, u));
    for (int k = 0; k < 3; k++) u[k] /= length;
    for (int k = 0; k < 3; k++) v[k] = n[(k + 1) % 3] * u[(k + 2) % 3] - n[(k + 2) % 3] * u[(k + 1) % 3];
    for (int k = 0; k < 3; k++) p[i][k] = heights[i / each] * n[k] + cos(a) * u[k] + sin(a) * v[k];
  }
  for (size_t i = count - 1; i > 0; i--) {
    size_t j = (size_t)(t_random(&seed) % (i + 1));
    for (int k = 0; k < 3; k++) {
      double x = p[i][k];
      p[i][k] = p[j][k];
      p[j][k] = x;
    }
  }
  char *text = malloc(count * 48), *to = text;
  for (size_t i = 0; i < count; i++) to += sprintf(to, "%.6f %.6f %.6f\n", p[i][0], p[i][1], p[i][2]);
  free(p);
  return text;
}

static void check_cuts(batten_context *ctx, const char *what, size_t planes, const double (*normals)[3],
                       const double *heights, bool in_order) {
  enum { EACH = 40 };
  char *text = shuffled_cuts(planes, normals, heights, EACH);
  batten_section_set s = good(ctx, text, 0, 1);
  size_t points = 0;
  double worst = 0, tilt = 0;
  for (size_t i = 0; i < s.count; i++) {
    const batten_section *q = &s.sections[i];
    double best = INFINITY;
    for (size_t k = 0; k < planes; k++) {
      double off = hypot(fabs(dot(q->rotation[2], normals[k])) - 1, fabs(dot(q->origin, normals[k]) - heights[k]));
      if (in_order && k != i) continue;
      best = fmin(best, off);
    }
    tilt = fmax(tilt, best);
    points += q->starts[q->contour_count];
    for (size_t k = 0; k < q->starts[q->contour_count]; k++) {
      double x[3];
      lift(q, k, x);
      worst = fmax(worst, fabs(dot(x, q->rotation[2]) - dot(q->origin, q->rotation[2])));
    }
  }
  T_CHECK(s.count == planes && points == planes * EACH && tilt < 1e-5, "%s: %zu cuts with %zu points, to %.2g", what,
          s.count, points, tilt);
  batten_section_set_free(ctx, &s);
  free(text);
}

static void test_cuts(batten_context *ctx) {
  static const double heights[5] = {-0.5, -0.2, 0.1, 0.35, 0.4};
  static const double across[5][3] = {{1, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}};
  static const double tilted[5][3] = {
      {0.36, 0.48, 0.8}, {0.36, 0.48, 0.8}, {0.36, 0.48, 0.8}, {0.36, 0.48, 0.8}, {0.36, 0.48, 0.8}};
  static const double crossing[5][3] = {{1, 0, 0}, {0, 0.6, 0.8}, {0.8, -0.6, 0}, {0.36, 0.48, 0.8}, {0, 1, 0}};
  check_cuts(ctx, "across an axis", 5, across, heights, true);
  check_cuts(ctx, "tilted", 5, tilted, heights, false);
  check_cuts(ctx, "crossing", 5, crossing, heights, false);
  batten_section_set s = good(ctx, "0 0\n3 1\n2 5\n1 1\n", 0, 1);
  T_CHECK(s.count == 1 && s.sections[0].starts[1] == 4, "in the plane: one section");
  batten_section_set_free(ctx, &s);
  char text[2048], *to = text;
  uint64_t seed = 5;
  for (int i = 0; i < 30; i++)
    to += sprintf(to, "%.9f %.9f %.9f\n", t_uniform(&seed), t_uniform(&seed), t_uniform(&seed));
  T_STATUS(read_text(ctx, "a.xyz", text, 0, 1, &s), BATTEN_E_FORMAT, ctx,
           "a.xyz: points[0] and 29 others lie in no plane with 5 more; give points of plane cuts");
}

/* ---- documents and errors --------------------------------------------------------------------------------- */

static void test_documents(batten_context *ctx, scratch *s) {
  double points[SLICES * CORNERS][3];
  char *text = slices_of(place_bent, points), path[384];
  batten_section_set a = good(ctx, text, 0, 0), b = {0};
  snprintf(path, sizeof path, "%s", scratch_file(s, "a.json"));
  T_OK(batten_write_sections(ctx, a.count, a.sections, path), ctx);
  T_OK(batten_read_sections(ctx, path, NULL, &b), ctx);
  T_CHECK(same_sections(&a, &b), "sections read back to the same bits");
  batten_section_set_free(ctx, &b);
  double bad[2] = {0, NAN};
  size_t starts[2] = {0, 1};
  batten_section wrong = {.contour_count = 1, .starts = starts, .points = bad};
  T_STATUS(batten_write_sections(ctx, 1, &wrong, path), BATTEN_E_INVALID, ctx, "sections[0].points[0]: not finite");
  starts[1] = 0;
  T_STATUS(batten_write_sections(ctx, 1, &wrong, path), BATTEN_E_INVALID, ctx, "sections[0].starts[1]: 0;");
  T_STATUS(batten_write_sections(ctx, 0, &wrong, path), BATTEN_E_INVALID, ctx, "count: 0;");
  T_STATUS(batten_write_sections(ctx, a.count, a.sections, "a.csv"), BATTEN_E_INVALID, ctx,
           "a.csv: sections are written as .json");
  batten_section_set_free(ctx, &a);
  free(text);
  T_OK(read_text(ctx, "a.json",
                 "{\"batten\": \"sections\", \"version\": 1, \"sections\": [{\"origin\": [1, 2, 3], \"contours\": "
                 "[[[0, 0], [1, 0], [0, 1]]]}]}",
                 0, 0, &a),
       ctx);
  T_CHECK(a.count == 1 && frame_error(a.sections) == 0 && a.sections[0].rotation[1][1] == 1 &&
              a.sections[0].origin[2] == 3,
          "without a rotation: that of space");
  batten_section_set_free(ctx, &a);
}

static void test_refused(batten_context *ctx) {
  static const struct {
    const char *name, *text, *error;
  } cases[] = {
      {"a.txt", "0 0 1\n1 0 1\n2 0 1\n2 1 1\n2 2 1\n2 3 1\n2 4 1\n",
       "a.txt: contours[0]: it is open: its ends are 4.47"},
      {"a.txt", "0 0 0\n1 0 0\n1 1 1\n0 1 0\n", "a.txt: contours[0]: its points lie up to"},
      {"a.txt", "", "a.txt: no points in the file"},
      {"a.json", "{\"batten\": \"solid\", \"version\": 1}",
       "a.json: document: it holds a batten 'solid', not a sections"},
      {"a.json", "{\"batten\": \"sections\", \"version\": 1}", "a.json: document: 'sections' is missing"},
      {"a.json", "{\"batten\": \"sections\", \"version\": 1, \"sections\": []}",
       "a.json: document: 'sections' must be"},
      {"a.json", "{\"batten\": \"sections\", \"version\": 1, \"sections\": [{\"origin\": [0, 0]}]}",
       "a.json: document.sections[0].origin: 2 numbers, where 3 are expected"},
      {"a.json",
       "{\"batten\": \"sections\", \"version\": 1, \"sections\": [{\"origin\": [0, 0, 0], \"contours\": [[]]}]}",
       "a.json: document.sections[0].contours[0]: it must be an array of points"},
      {"a.json",
       "{\"batten\": \"sections\", \"version\": 1, \"sections\": [{\"origin\": [0, 0, 0], \"contours\": [[[0, 0], "
       "[1]]]}]}",
       "a.json: document.sections[0].contours[0][1]: 1 numbers, where 2 are expected"},
      {"a.json",
       "{\"batten\": \"sections\", \"version\": 1, \"sections\": [{\"origin\": [0, 0, 0], \"rotation\": [[1, 0, 0]], "
       "\"contours\": []}]}",
       "a.json: document.sections[0].rotation: 1 items, where 3 are expected"},
      {"a.json",
       "{\"batten\": \"sections\", \"version\": 1, \"sections\": [{\"origin\": [0, 0, 0], \"rotatoin\": [[1, 0, 0]], "
       "\"contours\": []}]}",
       "a.json: document.sections[0]: 'rotatoin' is no argument of a section, which takes origin, rotation, "
       "contours"},
  };
  batten_section_set s = {0};
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    T_STATUS(read_text(ctx, cases[i].name, cases[i].text, 0, 0, &s), BATTEN_E_FORMAT, ctx, cases[i].error);
    T_CHECK(!s.sections, "case %zu: nothing is handed out", i);
  }
  batten_read_sections_options o = batten_read_sections_options_default();
  T_STATUS(batten_read_sections(ctx, "a.ply", &o, &s), BATTEN_E_INVALID, ctx,
           "a.ply: sections are read from .txt .xyz .csv .tsv .asc .dat .json, each also with .gz; its points in no");
  T_STATUS(batten_read_sections(ctx, "a.xyz", &o, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  o.gap = -1;
  T_STATUS(batten_read_sections(ctx, "a.xyz", &o, &s), BATTEN_E_INVALID, ctx, "opt.gap: -1;");
  o.struct_size = 1;
  T_STATUS(batten_read_sections(ctx, "a.xyz", &o, &s), BATTEN_E_INVALID, ctx, "batten_read_sections_options.struct");
}

static batten_status read_file(batten_context *ctx, void *path) {
  batten_section_set s = {0};
  batten_read_sections_options o = batten_read_sections_options_default();
  o.points = strstr(path, "points") != NULL;
  batten_status st = batten_read_sections(ctx, path, &o, &s);
  batten_section_set_free(ctx, &s);
  return st;
}

static batten_status write_file(batten_context *ctx, void *path) {
  static const double points[] = {0, 0, 1, 0, 0, 1};
  static const size_t starts[] = {0, 3};
  batten_section s = {
      .rotation = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .contour_count = 1, .starts = starts, .points = points};
  return batten_write_sections(ctx, 1, &s, path);
}

static void test_failures(scratch *s) {
  static const double heights[3] = {-0.5, -0.2, 0.1}, normals[3][3] = {{1, 0, 0}, {0, 0.6, 0.8}, {0.8, -0.6, 0}};
  double points[SLICES * CORNERS][3];
  char *text = slices_of(place_bent, points), path[384];
  snprintf(path, sizeof path, "%s", scratch_file(s, "bent.txt"));
  file_write(path, text, strlen(text));
  free(text);
  t_fail_every_allocation("reading bent slices", read_file, path);
  t_cancel_every_progress("reading bent slices", read_file, path);
  snprintf(path, sizeof path, "%s", scratch_file(s, "points.xyz"));
  text = shuffled_cuts(3, normals, heights, 12);
  file_write(path, text, strlen(text));
  free(text);
  t_fail_every_allocation("reading cuts", read_file, path);
  t_cancel_every_progress("reading cuts", read_file, path);
  snprintf(path, sizeof path, "%s", scratch_file(s, "hull.csv"));
  text = "x,z,half_breadth\n0,0,0\n0,1,1\n1,0,0\n1,1,.5\n1,2,0\n1,3,2\n";
  file_write(path, text, strlen(text));
  t_fail_every_allocation("reading offsets", read_file, path);
  snprintf(path, sizeof path, "%s", scratch_file(s, "a.json"));
  t_fail_every_allocation("writing sections", write_file, path);
  t_fail_every_allocation("reading a document", read_file, path);
  t_cancel_every_progress("reading a document", read_file, path);
}

/* ---- real data ---------------------------------------------------------------------------------------------- */

static const char *shared(const char *file) {
  static char path[512];
  const char *folder = getenv("BATTEN_SHARED");
  if (!folder) return NULL;
  snprintf(path, sizeof path, "%s/data/%s", folder, file);
  return access(path, R_OK) ? NULL : path;
}

static void check_real(batten_context *ctx, const char *file, int points, size_t sections, size_t contours) {
  const char *path = shared(file);
  if (!path) {
    t_skip(file, "BATTEN_SHARED is not set or lacks it");
    return;
  }
  batten_read_sections_options o = batten_read_sections_options_default();
  batten_section_set s = {0};
  size_t found = 0;
  o.points = points;
  T_OK(batten_read_sections(ctx, path, &o, &s), ctx);
  for (size_t i = 0; i < s.count; i++) found += s.sections[i].contour_count;
  T_CHECK(s.count == sections && found == contours, "%s: %zu sections, %zu contours", file, s.count, found);
  batten_section_set_free(ctx, &s);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  scratch s;
  scratch_open(&s);
  test_grouping(ctx);
  test_planar(ctx);
  test_tilted(ctx);
  test_bent(ctx);
  test_offsets(ctx);
  test_cuts(ctx);
  test_documents(ctx, &s);
  test_refused(ctx);
  test_failures(&s);
  check_real(ctx, "contours/rt_Heart.txt", 0, 33, 33);
  check_real(ctx, "hulls/gunnerus_offsets.csv", 0, 64, 68);
  check_real(ctx, "vipss/torus_parallelcut.xyz", 1, 6, 6);
  check_real(ctx, "vipss/torus_crosscut_nonparallel.xyz", 1, 5, 5);
  scratch_close(&s);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all is released");
  batten_context_free(ctx);
  return t_done();
}
