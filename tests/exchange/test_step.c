/* STEP and IGES files taken apart: every entity that is named exists, shells are closed by edges that are used once
 * each way, curves end in their vertices, reals have points; solids, voids and shells are told apart. That CAD
 * systems take them is tested in tests/consumers/occt. */
#include "files.h"
#include "networks.h"
#include "step_doc.h"

/* Curves begin and end in the points of their vertices. */
static bool curves_end(const step_doc *d) {
  for (size_t n = 1; n <= d->count; n++) {
    if (!is_kind(d, n, "EDGE_CURVE")) continue;
    size_t curve = reference(d, n, 2), last = 0, to;
    for (size_t i = 0; (to = reference(d, curve, i)) != 0; i++) last = to;
    if (reference(d, curve, 0) != reference(d, reference(d, n, 0), 0)) return false;
    if (last != reference(d, reference(d, n, 1), 0)) return false;
  }
  return true;
}

static void check_whole(const step_doc *d, size_t faces, size_t open_edges, const char *what) {
  size_t open = 0;
  T_CHECK(references_exist(d) && reals_are_real(d), "%s: %zu entities, all that is named is there", what, d->count);
  T_CHECK(loops_close(d, &open) && open == open_edges, "%s: loops close, %zu edges are open", what, open);
  T_CHECK(curves_end(d), "%s: curves end in their vertices", what);
  T_CHECK(count_kind(d, "ADVANCED_FACE") == faces, "%s: %zu faces", what, count_kind(d, "ADVANCED_FACE"));
}

/* ---- forms ------------------------------------------------------------------------------------------- */

static bool has_name(const step_doc *d, const char *name) { return strstr(d->text, name) != NULL; }

static void test_forms(batten_context *ctx, scratch *s) {
  static const char *const names[] = {"trimmed", "quads", "degenerate"};
  double vertices[3 * 25];
  uint32_t triangles[3 * 32];
  size_t faces = network_grid(4, vertices, triangles);
  for (int form = 0; form < 3; form++) {
    batten_network *solid = NULL, *open = NULL;
    batten_write_network_options o = batten_write_network_options_default();
    o.form = (batten_cad_form)form;
    step_doc d;
    size_t per_patch = form == 1 ? 3 : 1;
    T_OK(network_of(ctx, map_flat, 4, tetrahedron, 4, tetrahedron_faces, 6, true, &solid), ctx);
    T_OK(batten_write_network(ctx, solid, &o, scratch_file(s, "solid.step")), ctx);
    T_CHECK(read_step(s->name, &d), "it is numbered without gaps");
    check_whole(&d, 8 * per_patch, 0, names[form]);
    T_CHECK(count_kind(&d, "MANIFOLD_SOLID_BREP") == 1 && count_kind(&d, "CLOSED_SHELL") == 1, "one solid");
    /* 4 vertices, 2 inner points; QUADS: a middle of each of 6 edges and 6 inner ones, 8 centres */
    T_CHECK(count_kind(&d, "VERTEX_POINT") == (form == 1 ? 6 + 12 + 8 : 6), "vertices are shared");
    T_CHECK(count_kind(&d, "EDGE_CURVE") == (form == 1 ? 2 * 12 + 3 * 8 : 12), "and edges");
    T_CHECK(form == 1 ? has_name(&d, "'face 0 part 3 quad 2'") && has_name(&d, "'face 1 quad 3'")
                      : has_name(&d, "'face 0 part 3'") && has_name(&d, "'face 1'"),
            "faces have their names");
    free_step(&d);
    T_OK(network_of(ctx, map_paraboloid, 25, vertices, faces, triangles, 7, false, &open), ctx);
    T_OK(batten_write_network(ctx, open, &o, scratch_file(s, "open.stp")), ctx);
    T_CHECK(read_step(s->name, &d), "it is numbered without gaps");
    check_whole(&d, 32 * per_patch, form == 1 ? 32 : 16, names[form]);
    T_CHECK(count_kind(&d, "SHELL_BASED_SURFACE_MODEL") == 1 && count_kind(&d, "OPEN_SHELL") == 1 &&
                count_kind(&d, "MANIFOLD_SURFACE_SHAPE_REPRESENTATION") == 1,
            "an open shell");
    T_CHECK(strstr(d.text, "B_SPLINE_CURVE_WITH_KNOTS('',2,") && !strstr(d.text, "B_SPLINE_CURVE_WITH_KNOTS('',7,") &&
                strstr(d.text, "B_SPLINE_SURFACE_WITH_KNOTS('',7,7,"),
            "edges of degree 2 bound faces of degree 7");
    free_step(&d);
    batten_network_free(solid);
    batten_network_free(open);
  }
}

/* ---- solids, voids, shells ----------------------------------------------------------------------------- */

/* Tetrahedra about the centroid of the first, of given sizes, turned inside out where negative; and a lone triangle.
 */
static batten_status nested(batten_context *ctx, size_t count, const double *sizes, const double (*shifts)[3],
                            bool triangle, batten_network **out) {
  double vertices[3 * 64];
  uint32_t triangles[3 * 64];
  size_t v = 0, f = 0;
  for (size_t i = 0; i < count; i++) {
    for (size_t k = 0; k < 4; k++)
      for (size_t c = 0; c < 3; c++) {
        double centre = (tetrahedron[c] + tetrahedron[3 + c] + tetrahedron[6 + c] + tetrahedron[9 + c]) / 4;
        vertices[3 * (v + k) + c] = centre + fabs(sizes[i]) * (tetrahedron[3 * k + c] - centre) + shifts[i][c];
      }
    for (size_t k = 0; k < 4; k++, f++)
      for (size_t c = 0; c < 3; c++)
        triangles[3 * f + c] = (uint32_t)v + tetrahedron_faces[3 * k + (sizes[i] < 0 ? 2 - c : c)];
    v += 4;
  }
  if (triangle) {
    const double far[9] = {20, 0, 0, 21, 0, 0, 20, 1, 0};
    memcpy(vertices + 3 * v, far, sizeof far);
    for (size_t c = 0; c < 3; c++) triangles[3 * f + c] = (uint32_t)(v + c);
    v += 3;
    f++;
  }
  return network_of(ctx, map_flat, v, vertices, f, triangles, 2, false, out);
}

static void test_nesting(batten_context *ctx, scratch *s) {
  static const double shifts[5][3] = {{0}, {0}, {0}, {16, 0, 0}, {16, 0, 0}};
  static const struct {
    const char *what;
    size_t count;
    double sizes[5];
    bool triangle;
    size_t solids, voids, closed, open, turned; /* turned: faces with same_sense .F. */
  } cases[] = {
      {"a void", 2, {1, -0.5}, false, 1, 1, 2, 0, 4},
      {"a void that is oriented as a solid", 2, {1, 0.5}, false, 1, 1, 2, 0, 0},
      {"a solid inside out", 1, {-1}, false, 1, 0, 1, 0, 4},
      {"a solid in a void", 3, {4, -2, 1}, false, 2, 1, 3, 0, 4},
      {"the same, the least one first", 3, {1, -2, 4}, false, 2, 1, 3, 0, 4},
      {"two solids, one with a void", 5, {4, -2, 1, 2, -1}, false, 3, 2, 5, 0, 8},
      {"a solid and a shell", 1, {1}, true, 1, 0, 1, 1, 0},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    batten_network *network = NULL;
    step_doc d;
    T_OK(nested(ctx, cases[i].count, cases[i].sizes, shifts, cases[i].triangle, &network), ctx);
    T_OK(batten_write_network(ctx, network, NULL, scratch_file(s, "nested.step")), ctx);
    T_CHECK(read_step(s->name, &d), "it is numbered without gaps");
    size_t solids = count_kind(&d, "MANIFOLD_SOLID_BREP") + count_kind(&d, "BREP_WITH_VOIDS"), turned = 0;
    for (size_t n = 1; n <= d.count; n++)
      if (is_kind(&d, n, "ADVANCED_FACE")) turned += !strncmp(strchr(d.entity[n], ';') - 4, ".F.", 3);
    T_CHECK(solids == cases[i].solids && count_kind(&d, "ORIENTED_CLOSED_SHELL") == cases[i].voids &&
                count_kind(&d, "CLOSED_SHELL") == cases[i].closed && count_kind(&d, "OPEN_SHELL") == cases[i].open &&
                turned == cases[i].turned,
            "%s: %zu solids, %zu voids, %zu closed shells, %zu open ones, %zu faces turned", cases[i].what, solids,
            count_kind(&d, "ORIENTED_CLOSED_SHELL"), count_kind(&d, "CLOSED_SHELL"), count_kind(&d, "OPEN_SHELL"),
            turned);
    if (cases[i].triangle)
      T_CHECK(count_kind(&d, "SHAPE_REPRESENTATION_RELATIONSHIP") == 2, "both belong to the product");
    free_step(&d);
    batten_network_free(network);
  }
}

/* ---- head, units, names ------------------------------------------------------------------------------- */

static void test_words(batten_context *ctx, scratch *s) {
  static const char *const units[] = {"SI_UNIT(.MILLI.,.METRE.))", "SI_UNIT(.CENTI.,.METRE.))", "SI_UNIT($,.METRE.))",
                                      "CONVERSION_BASED_UNIT('INCH',"};
  batten_network *network = NULL;
  batten_write_network_options o = batten_write_network_options_default();
  step_doc d;
  T_OK(network_of(ctx, map_flat, 4, tetrahedron, 4, tetrahedron_faces, 1, false, &network), ctx);
  for (int unit = 0; unit < 4; unit++) {
    o.unit = (batten_length_unit)unit;
    T_OK(batten_write_network(ctx, network, &o, scratch_file(s, "u.step")), ctx);
    read_step(s->name, &d);
    T_CHECK(has_name(&d, units[unit]) && has_name(&d, "FILE_SCHEMA(('AUTOMOTIVE_DESIGN {") &&
                has_name(&d, "PRODUCT('u','u'"),
            "unit %d, AP214, named by its file", unit);
    free_step(&d);
  }
  o.name = "it's \\ 5 \xc2\xb5m \xf0\x9f\x98\x80 \xff";
  o.time_stamp = "2026-11-22T10:00:00";
  o.schema = BATTEN_STEP_AP242;
  T_OK(batten_write_network(ctx, network, &o, scratch_file(s, "u.step")), ctx);
  read_step(s->name, &d);
  T_CHECK(has_name(&d, "PRODUCT('it''s \\\\ 5 \\X2\\00B5\\X0\\m \\X4\\0001F600\\X0\\ ?',"), "a name of all letters");
  T_CHECK(has_name(&d, "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF") && has_name(&d, "'2026-11-22T10:00:00'"),
          "AP242 and the time");
  free_step(&d);
  batten_network_free(network);
}

/* ---- what does not fit --------------------------------------------------------------------------------- */

static void test_gaps(batten_context *ctx) {
  batten_network_patch patches[4];
  double nets[4][18];
  batten_network *network = NULL;
  for (uint32_t f = 0; f < 4; f++) {
    const double *corners[3];
    for (size_t k = 0; k < 3; k++) corners[k] = tetrahedron + 3 * tetrahedron_faces[3 * f + k];
    network_net(map_flat, corners, 2, nets[f]);
    patches[f] = (batten_network_patch){.degree = 2, .face = f, .control_points = nets[f]};
  }
  nets[0][3] += 1e-3; /* the middle of the edge 0 2, which triangle 3 has too */
  T_OK(batten_network_create(ctx, 4, tetrahedron, 4, tetrahedron_faces, 4, patches, 0, NULL, &network), ctx);
  T_STATUS(batten_write_network(ctx, network, NULL, "gap.step"), BATTEN_E_INVALID, ctx,
           "patches of triangles 0 and 3 are 0.0005 apart along the edge 2 0");
  T_STATUS(batten_write_network(ctx, network, NULL, "gap.igs"), BATTEN_E_INVALID, ctx,
           "patches of triangles 0 and 3");
  batten_network_free(network);
  nets[0][3] -= 1e-3;
  network = NULL;
  nets[2][15] += 1e-6; /* its corner at vertex 3 */
  if (batten_network_create(ctx, 4, tetrahedron, 4, tetrahedron_faces, 4, patches, 0, NULL, &network) == BATTEN_OK)
    T_STATUS(batten_write_network(ctx, network, NULL, "gap.step"), BATTEN_E_INVALID, ctx,
             "the patch of triangle 2 is 1e-06 away from a vertex along its edge 2 3");
  batten_network_free(network);
}

/* ---- IGES ---------------------------------------------------------------------------------------------- */

static void test_iges(batten_context *ctx, scratch *s) {
  double vertices[3 * 25];
  uint32_t triangles[3 * 32];
  size_t faces = network_grid(4, vertices, triangles);
  for (int form = 0; form < 3; form++) {
    batten_network *network = NULL;
    batten_write_network_options o = batten_write_network_options_default();
    o.form = (batten_cad_form)form;
    o.unit = BATTEN_UNIT_INCH;
    o.name = "a name that is so long that it does not fit into one line of the file, nor what comes behind it";
    T_OK(network_of(ctx, map_paraboloid, 25, vertices, faces, triangles, 5, false, &network), ctx);
    T_OK(batten_write_network(ctx, network, &o, scratch_file(s, "a.igs")), ctx);
    size_t size, lines = 0, counts[128] = {0}, directory = 0;
    char *text = (char *)file_read(s->name, &size);
    text[size] = '\0';
    bool columns = true, pointers = true;
    for (char *at = text; *at; at += 81, lines++) {
      columns = columns && strlen(at) >= 81 && at[80] == '\n' && strchr("SGDPT", at[72]);
      if (!columns) break;
      counts[(int)at[72]]++;
      columns = columns && (size_t)strtoul(at + 73, NULL, 10) == counts[(int)at[72]];
      directory += at[72] == 'D';
    }
    /* Each entity's parameters begin on the line that the directory names, and point back. */
    const char *first_d = text + 81 * (counts['S'] + counts['G']), *first_p = first_d + 81 * directory;
    for (size_t e = 0; columns && e < directory / 2; e++) {
      const char *entry = first_d + 162 * e;
      char field[9] = {0}, type[9] = {0};
      memcpy(type, entry, 8);
      memcpy(field, entry + 8, 8);
      const char *line = first_p + 81 * (strtoul(field, NULL, 10) - 1);
      memcpy(field, line + 64, 8);
      pointers =
          pointers && strtoul(field, NULL, 10) == 2 * e + 1 && strtoul(line, NULL, 10) == strtoul(type, NULL, 10);
    }
    T_CHECK(columns && counts['T'] == 1, "IGES: %zu lines of 80 columns, numbered by section", lines);
    T_CHECK(pointers, "IGES: %zu entities and their parameters name each other", directory / 2);
    T_CHECK(directory / 2 == 32u * (form == 0 ? 11 : form == 1 ? 39 : 2), "IGES: all entities of all faces");
    T_CHECK(strstr(text, ",1.,1,2HIN,1,"), "IGES: inches");
    free(text);
    batten_network_free(network);
  }
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  scratch s;
  scratch_open(&s);
  test_forms(ctx, &s);
  test_nesting(ctx, &s);
  test_words(ctx, &s);
  test_gaps(ctx);
  test_iges(ctx, &s);
  scratch_close(&s);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all is released");
  batten_context_free(ctx);
  return t_done();
}
