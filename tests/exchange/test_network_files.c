/* Networks in files: documents that read back to the same bits, what is refused and where, VTK's Bezier triangles. */
#include "files.h"
#include "network.h"
#include "networks.h"

static batten_network *make_split(batten_context *ctx, unsigned degree) {
  static double vertices[3 * 25];
  static uint32_t triangles[3 * 32];
  size_t faces = network_grid(4, vertices, triangles);
  batten_network *network = NULL;
  T_OK(network_of(ctx, map_paraboloid, 25, vertices, faces, triangles, degree, true, &network), ctx);
  return network;
}

static bool same_networks(const batten_network *a, const batten_network *b) {
  size_t v = batten_network_vertex_count(a), f = batten_network_face_count(a), p = batten_network_patch_count(a);
  size_t c = batten_network_crease_count(a);
  if (batten_network_vertex_count(b) != v || batten_network_face_count(b) != f ||
      batten_network_patch_count(b) != p || batten_network_crease_count(b) != c ||
      memcmp(batten_network_vertices(a), batten_network_vertices(b), 3 * v * sizeof(double)) ||
      memcmp(batten_network_triangles(a), batten_network_triangles(b), 3 * f * sizeof(uint32_t)) ||
      (c && memcmp(batten_network_creases(a), batten_network_creases(b), 2 * c * sizeof(uint32_t))))
    return false;
  for (size_t i = 0; i < p; i++) {
    batten_network_patch x = batten_network_get_patch(a, i), y = batten_network_get_patch(b, i);
    size_t numbers = 3 * (size_t)(x.degree + 1) * (x.degree + 2) / 2;
    if (x.degree != y.degree || x.face != y.face || x.part != y.part ||
        memcmp(x.control_points, y.control_points, numbers * sizeof(double)))
      return false;
  }
  return true;
}

static void test_back(batten_context *ctx, scratch *s) {
  batten_network *network = make_split(ctx, 4), *back = NULL, *creased = NULL;
  char first[400];
  snprintf(first, sizeof first, "%s", scratch_file(s, "a.json"));
  T_OK(batten_write_network(ctx, network, NULL, first), ctx);
  T_OK(batten_read_network(ctx, first, &back), ctx);
  T_CHECK(back && same_networks(network, back), "facets of one and of three patches come back to the same bits");
  if (back) T_OK(batten_write_network(ctx, back, NULL, scratch_file(s, "b.json")), ctx);
  T_CHECK(files_equal(first, s->name), "written again: the same bytes");
  batten_file_kind kind = BATTEN_FILE_UNKNOWN;
  T_CHECK(batten_file_identify(ctx, first, &kind) == BATTEN_OK && kind == BATTEN_FILE_NETWORK,
          "told to be a network");
  batten_network_free(back);

  const uint32_t creases[4] = {0, 1, 2, 3};
  batten_network_patch patches[4];
  double nets[4][9];
  for (uint32_t f = 0; f < 4; f++) {
    for (size_t k = 0; k < 3; k++)
      memcpy(nets[f] + 3 * k, tetrahedron + 3 * tetrahedron_faces[3 * f + k], 3 * sizeof(double));
    patches[f] = (batten_network_patch){.degree = 1, .face = f, .control_points = nets[f]};
  }
  T_OK(batten_network_create(ctx, 4, tetrahedron, 4, tetrahedron_faces, 4, patches, 2, creases, &creased), ctx);
  T_OK(batten_write_network(ctx, creased, NULL, first), ctx);
  back = NULL;
  T_OK(batten_read_network(ctx, first, &back), ctx);
  T_CHECK(back && same_networks(creased, back), "and so do creases");
  batten_network_free(back);
  batten_network_free(creased);
  batten_network_free(network);
}

/* ---- what is refused --------------------------------------------------------------------------------- */

static batten_status read_text(batten_context *ctx, const char *text) {
  bx_reader r;
  batten_network *network = NULL;
  batten_status st = bx_open_memory(&r, ctx, "bad.json", text, strlen(text));
  if (st != BATTEN_OK) return st;
  st = bx_read_network_from(&r, &network);
  bx_close(&r);
  batten_network_free(network);
  return st;
}

#define HEAD "{\"batten\": \"network\", \"version\": 1, "
#define VERTICES "\"vertices\": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "
#define TRIANGLES "\"triangles\": [[0, 1, 2]], "
#define PATCHES(text) "\"patches\": [" text "]}"
#define PATCH "{\"degree\": 1, \"face\": 0, \"control_points\": [[0, 0, 0], [1, 0, 0], [0, 1, 0]]}"

static void test_refused(batten_context *ctx) {
  static const struct {
    const char *text, *error;
  } cases[] = {
      {"", "bad.json:1: JSON:"},
      {"[]", "document: an array, where an object is expected"},
      {"{\"batten\": \"qp\", \"version\": 1}", "document: it holds a batten 'qp', not a network"},
      {"{\"batten\": \"network\", \"version\": 2}", "document.version: 2, where a whole number"},
      {HEAD "\"triangles\": []}", "network: 'vertices' is missing"},
      {HEAD "\"vertices\": 5}", "network.vertices: a number, where an array is expected"},
      {HEAD "\"vertices\": [[0, 0]]}", "network.vertices[0]: 2 numbers, where 3 are expected"},
      {HEAD "\"vertices\": [[0, 0, null]]}", "network.vertices[0][2]: null, where a number is expected"},
      {HEAD VERTICES "\"x\": 0}", "network: 'triangles' is missing"},
      {HEAD VERTICES "\"triangles\": [[0, 1]]}", "network.triangles[0]: 2 numbers, where 3 are expected"},
      {HEAD VERTICES "\"triangles\": [[0, 1, 3]]}",
       "network.triangles[0][2]: 3, where the number of one of 3 vertices"},
      {HEAD VERTICES "\"triangles\": [[0, 1, -1]]}", "network.triangles[0][2]: -1, where"},
      {HEAD VERTICES "\"triangles\": [[0, 1.5, 2]]}", "network.triangles[0][1]: 1.5, where"},
      {HEAD VERTICES "\"triangles\": [[0, 1, 1e300]]}", "network.triangles[0][2]: 1e+300, where"},
      {HEAD VERTICES TRIANGLES "\"creases\": [[0, 9]], " PATCHES(PATCH), "network.creases[0][1]: 9, where"},
      {HEAD VERTICES TRIANGLES "\"creases\": [0]}", "network.creases[0]: a number, where an array is expected"},
      {HEAD VERTICES TRIANGLES "\"creases\": []}", "network: 'patches' is missing"},
      {HEAD VERTICES TRIANGLES "\"patches\": {}}", "network: 'patches' must be an array of objects"},
      {HEAD VERTICES TRIANGLES PATCHES("7"), "network.patches[0]: a number, where an object is expected"},
      {HEAD VERTICES TRIANGLES PATCHES("{}"), "network.patches[0]: 'degree' is missing"},
      {HEAD VERTICES TRIANGLES PATCHES("{\"degree\": 0}"),
       "network.patches[0].degree: 0, where a whole number from 1 to 12"},
      {HEAD VERTICES TRIANGLES PATCHES("{\"degree\": 13}"), "network.patches[0].degree: 13, where"},
      {HEAD VERTICES TRIANGLES PATCHES("{\"degree\": 1}"), "network.patches[0]: 'face' is missing"},
      {HEAD VERTICES TRIANGLES PATCHES("{\"degree\": 1, \"face\": 1}"), "network.patches[0].face: 1, where"},
      {HEAD VERTICES TRIANGLES PATCHES("{\"degree\": 1, \"face\": 0, \"part\": 4}"), "network.patches[0].part: 4"},
      {HEAD VERTICES TRIANGLES PATCHES("{\"degree\": 1, \"face\": 0}"),
       "network.patches[0]: 'control_points' is missing"},
      {HEAD VERTICES TRIANGLES PATCHES("{\"degree\": 2, \"face\": 0, \"control_points\": [[0, 0, 0]]}"),
       "network.patches[0].control_points: 1 points, where degree 2 has 6"},
      {HEAD VERTICES TRIANGLES PATCHES(
           "{\"degree\": 1, \"face\": 0, \"control_points\": [[0, 0, 0], [1, \"a\", 0]]}"),
       "network.patches[0].control_points[1][1]: a text, where a number is expected"},
      {HEAD VERTICES TRIANGLES PATCHES(""), "network: "},
      {HEAD VERTICES TRIANGLES PATCHES(PATCH "," PATCH), "network: "},
      {HEAD VERTICES "\"triangles\": [[0, 1, 1]], " PATCHES(PATCH), "network: "},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    batten_status st = read_text(ctx, cases[i].text);
    T_CHECK(st == BATTEN_E_FORMAT && strstr(batten_error(ctx), cases[i].error), "%s", batten_error(ctx));
  }
  T_OK(read_text(ctx, HEAD VERTICES TRIANGLES PATCHES(PATCH)), ctx);
  T_OK(read_text(ctx, "\xef\xbb\xbf" HEAD VERTICES TRIANGLES PATCHES(PATCH)), ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left behind");
}

static void test_calls(batten_context *ctx, scratch *s) {
  batten_network *network = make_split(ctx, 2), *none = NULL;
  const batten_write_network_options good = batten_write_network_options_default();
  batten_write_network_options o = good;
  char path[400];
  snprintf(path, sizeof path, "%s", scratch_file(s, "calls.step"));
  T_STATUS(batten_write_network(ctx, NULL, NULL, path), BATTEN_E_INVALID, ctx, "network: NULL");
  T_STATUS(batten_write_network(ctx, network, NULL, NULL), BATTEN_E_INVALID, ctx, "path: NULL");
  T_STATUS(batten_write_network(ctx, network, NULL, "a.dxf"), BATTEN_E_INVALID, ctx,
           "a.dxf: networks are written as .step .stp .iges .igs .json .vtu");
  T_STATUS(batten_write_network(ctx, network, NULL, "none/a.step"), BATTEN_E_IO, ctx, "make the directory first");
  o.struct_size = 3;
  T_STATUS(batten_write_network(ctx, network, &o, path), BATTEN_E_INVALID, ctx, "struct_size: 3");
  o = good, o.unit = (batten_length_unit)4;
  T_STATUS(batten_write_network(ctx, network, &o, path), BATTEN_E_INVALID, ctx, "opt.unit: 4");
  o = good, o.form = (batten_cad_form)3;
  T_STATUS(batten_write_network(ctx, network, &o, path), BATTEN_E_INVALID, ctx, "opt.form: 3");
  o = good, o.schema = (batten_step_schema)2;
  T_STATUS(batten_write_network(ctx, network, &o, path), BATTEN_E_INVALID, ctx, "opt.schema: 2");
  o = good, o.time_stamp = "today";
  T_STATUS(batten_write_network(ctx, network, &o, path), BATTEN_E_INVALID, ctx, "opt.time_stamp: 'today'");
  o = good, o.time_stamp = "2026-11-22 10:00:00";
  T_STATUS(batten_write_network(ctx, network, &o, path), BATTEN_E_INVALID, ctx, "must be as 2026-11-22T10:00:00");
  o = good, o.density = 0;
  T_STATUS(batten_write_network(ctx, network, &o, path), BATTEN_E_INVALID, ctx, "opt.density: 0");
  o = good, o.density = 513;
  T_STATUS(batten_write_network(ctx, network, &o, path), BATTEN_E_INVALID, ctx, "opt.density: 513");
  o = good, o.tolerance = NAN;
  T_STATUS(batten_write_network(ctx, network, &o, path), BATTEN_E_INVALID, ctx, "opt.tolerance: nan");
  T_STATUS(batten_read_network(ctx, "none.json", &none), BATTEN_E_IO, ctx, "none.json: cannot open");
  T_STATUS(batten_read_network(ctx, "a.step", &none), BATTEN_E_INVALID, ctx, "a.step: networks are read from .json");
  T_STATUS(batten_read_network(ctx, "a.json", NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_CHECK(!none && scratch_count(s) == 0, "no file was begun, and no result given");
  batten_network_free(network);
}

/* Too small for CAD systems in mm, but not in m. */
static void test_size(batten_context *ctx, scratch *s) {
  double vertices[12];
  for (int i = 0; i < 12; i++) vertices[i] = 1e-6 * tetrahedron[i];
  batten_network *network = NULL;
  T_OK(network_of(ctx, map_flat, 4, vertices, 4, tetrahedron_faces, 1, false, &network), ctx);
  batten_write_network_options o = batten_write_network_options_default();
  const char *path = scratch_file(s, "small.step");
  T_STATUS(batten_write_network(ctx, network, &o, path), BATTEN_E_INVALID, ctx,
           "network: its size is 3.74166e-06 mm; CAD files need 1e-05 mm at least: scale it or choose another unit");
  T_CHECK(scratch_count(s) == 0, "and no file is begun");
  o.unit = BATTEN_UNIT_M;
  T_OK(batten_write_network(ctx, network, &o, path), ctx);
  unlink(path);
  batten_network_free(network);
}

/* ---- VTK --------------------------------------------------------------------------------------------- */

/* The rule as VTK states it: corners, then sides 0-1, 1-2, 2-0, then the inside likewise. */
static void test_vtk_order(void) {
  static const unsigned quadratic[] = {0, 2, 5, 1, 4, 3}, cubic[] = {0, 3, 9, 1, 2, 6, 8, 7, 4, 5};
  static const unsigned quartic[] = {0, 4, 14, 1, 2, 3, 8, 11, 13, 12, 9, 5, 6, 7, 10};
  unsigned order[91];
  T_CHECK(bx_vtk_triangle_order(2, order) == 6 && !memcmp(order, quadratic, sizeof quadratic), "degree 2");
  T_CHECK(bx_vtk_triangle_order(3, order) == 10 && !memcmp(order, cubic, sizeof cubic), "degree 3");
  T_CHECK(bx_vtk_triangle_order(4, order) == 15 && !memcmp(order, quartic, sizeof quartic), "degree 4");
  bool all = true;
  for (unsigned n = 1; n <= 12; n++) {
    bool seen[91] = {false};
    size_t count = bx_vtk_triangle_order(n, order);
    all = all && count == (size_t)(n + 1) * (n + 2) / 2;
    for (size_t i = 0; i < count; i++) {
      all = all && order[i] < count && !seen[order[i]];
      seen[order[i] % 91] = true;
    }
  }
  T_CHECK(all, "degrees 1 .. 12 name every point once");
}

static uint64_t word(const unsigned char *at) {
  uint64_t value = 0;
  for (int i = 7; i >= 0; i--) value = value << 8 | at[i];
  return value;
}

static void test_vtu(batten_context *ctx, scratch *s) {
  batten_network *network = make_split(ctx, 4);
  size_t size, patches = batten_network_patch_count(network), points = 15 * patches;
  T_OK(batten_write_network(ctx, network, NULL, scratch_file(s, "a.vtu")), ctx);
  unsigned char *bytes = file_read(s->name, &size), *at = NULL;
  for (size_t i = 0; i + 1 < size && !at; i++)
    if (bytes[i] == '_' && i > 7 && !memcmp(bytes + i - 7, "\"raw\">\n", 7)) at = bytes + i + 1;
  T_CHECK(at && word(at) == points * 24, "the first block holds the points");
  batten_network_patch patch = batten_network_get_patch(network, 1);
  unsigned order[15];
  bx_vtk_triangle_order(4, order);
  double value;
  uint64_t bits = at ? word(at + 8 + 24 * (15 + 7)) : 0; /* x of the eighth point of the second cell */
  memcpy(&value, &bits, sizeof value);
  T_CHECK(value == patch.control_points[3 * order[7]], "in VTK's order");
  const unsigned char *end = bytes + size - strlen("\n  </AppendedData>\n</VTKFile>\n");
  size_t types = 0;
  while (at && types < patches && end[-1 - (long)types] == 76) types++;
  T_CHECK(types == patches, "all %zu cells are Bezier triangles", types);
  free(bytes);
  batten_network_free(network);
}

/* ---- tessellated --------------------------------------------------------------------------------------- */

static void test_tessellated(batten_context *ctx, scratch *s) {
  static const char *const names[] = {"t.ply", "t.obj", "t.off", "t.stl", "t.vtp"};
  batten_network *network = NULL;
  batten_write_network_options o = batten_write_network_options_default();
  o.density = 5;
  T_OK(network_of(ctx, map_flat, 4, tetrahedron, 4, tetrahedron_faces, 3, false, &network), ctx);
  for (size_t i = 0; i < 5; i++) {
    batten_mesh *mesh = NULL;
    batten_mesh_measures m;
    T_OK(batten_write_network(ctx, network, &o, scratch_file(s, names[i])), ctx);
    if (i == 4) continue; /* VTK's files are not read */
    T_OK(batten_read_mesh(ctx, s->name, &mesh), ctx);
    T_OK(batten_mesh_measure(ctx, mesh, &m), ctx);
    T_CHECK(m.triangles == 4 * 25 && m.closed && m.oriented && fabs(m.volume - 1) < 1e-6,
            "%s: %zu triangles, closed, volume %g", names[i], m.triangles, m.volume);
    batten_mesh_free(mesh);
  }
  batten_network_free(network);
}

/* ---- failures ---------------------------------------------------------------------------------------- */

typedef struct job {
  const batten_network *network;
  char path[400];
} job;

static batten_status write_again(batten_context *ctx, void *arg) {
  job *j = arg;
  return batten_write_network(ctx, j->network, NULL, j->path);
}

static batten_status read_again(batten_context *ctx, void *arg) {
  job *j = arg;
  batten_network *network = NULL;
  batten_status st = batten_read_network(ctx, j->path, &network);
  batten_network_free(network);
  return st;
}

static void test_failures(batten_context *ctx, scratch *s) {
  static const char *const names[] = {"f.step", "f.iges", "f.vtu", "f.ply", "f.json"};
  job j = {make_split(ctx, 3), ""};
  for (size_t i = 0; i < 5; i++) {
    snprintf(j.path, sizeof j.path, "%s", scratch_file(s, names[i]));
    T_OK(write_again(ctx, &j), ctx);
    size_t files = scratch_count(s);
    t_fail_every_allocation(names[i], write_again, &j);
    if (i != 2 && i != 3) t_cancel_every_progress(names[i], write_again, &j);
    T_CHECK(scratch_count(s) == files, "no part files are left");
  }
  t_fail_every_allocation("reading", read_again, &j);
  t_cancel_every_progress("reading", read_again, &j);
  batten_network_free((batten_network *)j.network);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  scratch s;
  scratch_open(&s);
  test_calls(ctx, &s);
  test_size(ctx, &s);
  test_back(ctx, &s);
  test_refused(ctx);
  test_vtk_order();
  test_vtu(ctx, &s);
  test_tessellated(ctx, &s);
  test_failures(ctx, &s);
  scratch_close(&s);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all is released");
  batten_context_free(ctx);
  return t_done();
}
