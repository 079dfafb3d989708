/* Networks as STEP files: ISO 10303-21 with the schema AP214 or AP242.
 *
 * Streamed: vertices and edges first, which faces share, then each facet's surfaces and faces, then the shells, last
 * the product that has them as its shape. Entities are written with the numbers of those before them; what is kept is
 * a number for each vertex, edge and face.
 *
 *   VERTEX_POINT    a mesh vertex, the inner point of a facet of three patches; QUADS: middles of sides, centres
 *   EDGE_CURVE      a B_SPLINE_CURVE_WITH_KNOTS of the degree that the side really has, not the patch's
 *   ADVANCED_FACE   a patch, or QUADS: a third of one; bounded by a loop of edges, no curves in parameter space
 *   CLOSED_SHELL    a closed component, normals outward: the faces of one that is inside out are turned by their
 * flags. A void's shell is the same, turned as a whole (ORIENTED_CLOSED_SHELL .F.) */
#include "network.h"
#include "step_text.h"

#include <string.h>

typedef struct wire {
  uint64_t edge[2]; /* EDGE_CURVE; QUADS: the two halves */
  uint64_t middle;  /* QUADS: VERTEX_POINT between */
} wire;

/* A wire as the side of a face. */
typedef struct side {
  wire wire;
  bool forward;
} side;

typedef struct step_file {
  step_text text;
  const bx_brep *brep;
  const bx_product *product;
  uint64_t *vertices; /* [vertices] VERTEX_POINT, 0 = not in use; the number before is its CARTESIAN_POINT */
  wire *wires;        /* [edges] */
  uint64_t *faces;    /* [patches * squares] ADVANCED_FACE */
  uint64_t *bodies;   /* [components] representation items: solids first, then surfaces */
  uint64_t *listed;   /* [patches * squares] the faces of a shell */
  uint64_t *voids;    /* [components] of a solid */
  size_t solid_count, surface_count;
  bx_square_work work;
  double squares[3][BX_SQUARE_MAX][3];
} step_file;

/* ---- curves and surfaces ----------------------------------------------------------------------------- */

static uint64_t put_vertex(step_file *s, const double point[3]) {
  uint64_t at = step_put_point(&s->text, point);
  return step_print(&s->text, "VERTEX_POINT('',#%llu)", (unsigned long long)at);
}

/* EDGE_CURVE between two vertices, whose points are the curve's ends. */
static uint64_t put_curve(step_file *s, unsigned degree, const double (*points)[3], uint64_t from, uint64_t to) {
  uint64_t ids[BX_DEGREE_MAX + 1];
  ids[0] = from - 1;
  ids[degree] = to - 1;
  for (unsigned i = 1; i < degree; i++) ids[i] = step_put_point(&s->text, points[i]);
  uint64_t curve = step_begin(&s->text);
  bx_print(s->text.w, "B_SPLINE_CURVE_WITH_KNOTS('',%u,", degree);
  step_put_references(&s->text, ids, degree + 1);
  bx_print(s->text.w, ",.UNSPECIFIED.,.F.,.F.,(%u,%u),(0.,1.),.UNSPECIFIED.);\n", degree + 1, degree + 1);
  return step_print(&s->text, "EDGE_CURVE('',#%llu,#%llu,#%llu,.T.)", (unsigned long long)from,
                    (unsigned long long)to, (unsigned long long)curve);
}

static wire put_wire(step_file *s, unsigned degree, const double (*points)[3], uint64_t from, uint64_t to) {
  wire out = {{0}, 0};
  if (s->product->form != BATTEN_CAD_QUADS) {
    out.edge[0] = put_curve(s, degree, points, from, to);
    return out;
  }
  double left[BX_DEGREE_MAX + 1][3], right[BX_DEGREE_MAX + 1][3];
  bx_curve_halve(degree, points, left, right);
  out.middle = put_vertex(s, right[0]);
  out.edge[0] = put_curve(s, degree, (const double(*)[3])left, from, out.middle);
  out.edge[1] = put_curve(s, degree, (const double(*)[3])right, out.middle, to);
  return out;
}

static uint64_t put_surface(step_file *s, unsigned degree, const double (*points)[3]) {
  uint64_t ids[BX_DEGREE_MAX + 1], first = s->text.last + 1;
  unsigned width = degree + 1;
  for (unsigned i = 0; i < width * width; i++) step_put_point(&s->text, points[i]);
  uint64_t surface = step_begin(&s->text);
  bx_print(s->text.w, "B_SPLINE_SURFACE_WITH_KNOTS('',%u,%u,(\n", degree, degree);
  for (unsigned i = 0; i < width; i++) {
    for (unsigned j = 0; j < width; j++) ids[j] = first + i * width + j;
    step_put_references(&s->text, ids, width);
    bx_put_text(s->text.w, i + 1 < width ? ",\n" : ")");
  }
  bx_print(s->text.w, ",.UNSPECIFIED.,.F.,.F.,.F.,(%u,%u),(%u,%u),(0.,1.),(0.,1.),.UNSPECIFIED.);\n", width, width,
           width, width);
  return surface;
}

/* ---- faces ------------------------------------------------------------------------------------------- */

typedef struct bound {
  uint64_t edges[4];
  bool forward[4];
  unsigned count;
} bound;

static void put_name(step_file *s, const batten_network_patch *patch, unsigned quad) {
  bx_print(s->text.w, "'face %lu", (unsigned long)patch->face);
  if (patch->part) bx_print(s->text.w, " part %u", patch->part);
  if (quad) bx_print(s->text.w, " quad %u", quad);
  bx_put_u8(s->text.w, '\'');
}

static uint64_t put_face(step_file *s, const batten_network_patch *patch, unsigned quad, uint64_t surface,
                         const bound *b) {
  uint64_t oriented[4];
  const char *sense = s->brep->components[s->brep->component[patch->face]].inward ? ".F." : ".T.";
  for (unsigned i = 0; i < b->count; i++)
    oriented[i] = step_print(&s->text, "ORIENTED_EDGE('',*,*,#%llu,%s)", (unsigned long long)b->edges[i],
                             b->forward[i] ? ".T." : ".F.");
  uint64_t loop = step_begin(&s->text);
  bx_put_text(s->text.w, "EDGE_LOOP('',");
  step_put_references(&s->text, oriented, b->count);
  bx_put_text(s->text.w, ");\n");
  uint64_t outer = step_print(&s->text, "FACE_OUTER_BOUND('',#%llu,%s)", (unsigned long long)loop, sense);
  uint64_t face = step_begin(&s->text);
  bx_put_text(s->text.w, "ADVANCED_FACE(");
  put_name(s, patch, quad);
  bx_print(s->text.w, ",(#%llu),#%llu,%s);\n", (unsigned long long)outer, (unsigned long long)surface, sense);
  return face;
}

static void make_squares(step_file *s, const batten_network_patch *patch) {
  for (unsigned q = 0; q < bx_squares_of(s->product->form); q++) {
    bx_corners corners;
    bx_corners_of(s->product->form, q, corners);
    bx_patch_square(&s->work, patch->degree, patch->control_points, (const double(*)[3])corners,
                    &s->squares[q][0][0]);
  }
}

/* One face around the whole patch. */
static void put_triangle(step_file *s, const batten_network_patch *patch, const side sides[3], uint64_t *faces) {
  uint64_t surface = put_surface(s, patch->degree, (const double(*)[3])s->squares[0]);
  bound b = {.count = 3};
  for (unsigned k = 0; k < 3; k++) {
    b.edges[k] = sides[k].wire.edge[0];
    b.forward[k] = sides[k].forward;
  }
  faces[0] = put_face(s, patch, 0, surface, &b);
}

/* Three faces, each about a corner: to the middle of the next side, to the centre, to the middle of the last side,
 * and back. Square k has its side s = 1 along the spoke from the middle of side k to the centre. */
static void put_quads(step_file *s, const batten_network_patch *patch, const side sides[3], uint64_t *faces) {
  unsigned n = patch->degree, width = n + 1;
  uint64_t centre = put_vertex(s, s->squares[0][width * width - 1]), spokes[3];
  for (unsigned k = 0; k < 3; k++) {
    double points[BX_DEGREE_MAX + 1][3];
    memcpy(points, s->squares[k] + n * width, width * sizeof points[0]);
    unsigned degree = bx_curve_reduce(n, points, bx_brep_rounding(s->brep));
    spokes[k] = put_curve(s, degree, (const double(*)[3])points, sides[k].wire.middle, centre);
  }
  for (unsigned k = 0; k < 3; k++) {
    const side *next = &sides[k], *last = &sides[(k + 2) % 3];
    uint64_t surface = put_surface(s, n, (const double(*)[3])s->squares[k]);
    bound b = {.count = 4,
               .edges = {next->wire.edge[next->forward ? 0 : 1], spokes[k], spokes[(k + 2) % 3],
                         last->wire.edge[last->forward ? 1 : 0]},
               .forward = {next->forward, true, false, last->forward}};
    faces[k] = put_face(s, patch, k + 1, surface, &b);
  }
}

/* The curves from the corners of a split facet to its inner point. */
static void put_inner_wires(step_file *s, size_t face, const batten_network_patch parts[3], wire inner[3]) {
  const uint32_t *corners = batten_network_triangles(s->brep->network) + 3 * face;
  double points[BX_DEGREE_MAX + 1][3];
  uint64_t centre = 0;
  for (unsigned k = 0; k < 3; k++) {
    unsigned degree = bx_patch_curve(s->brep, &parts[k], 2, points);
    if (!centre) centre = put_vertex(s, points[0]);
    bx_curve_reverse(degree, points);
    inner[k] = put_wire(s, degree, (const double(*)[3])points, s->vertices[corners[k]], centre);
  }
}

static side mesh_side(const step_file *s, size_t face, unsigned k) {
  uint32_t h = (uint32_t)(3 * face) + k, edge = s->brep->edge[h];
  return (side){s->wires[edge], s->brep->half[edge] == h};
}

static void put_facet(step_file *s, size_t face) {
  size_t first;
  unsigned count = batten_network_face_patches(s->brep->network, face, &first),
           squares = bx_squares_of(s->product->form);
  batten_network_patch parts[3];
  wire inner[3];
  for (unsigned i = 0; i < count; i++) parts[i] = batten_network_get_patch(s->brep->network, first + i);
  if (count == 3) put_inner_wires(s, face, parts, inner);
  for (unsigned i = 0; i < count; i++) {
    side sides[3];
    for (unsigned k = 0; k < 3; k++) sides[k] = mesh_side(s, face, k);
    if (count == 3) {
      sides[0] = mesh_side(s, face, i);
      sides[1] = (side){inner[(i + 1) % 3], true};
      sides[2] = (side){inner[i], false};
    }
    make_squares(s, &parts[i]);
    (squares == 3 ? put_quads : put_triangle)(s, &parts[i], sides, s->faces + squares * (first + i));
  }
}

/* ---- vertices, edges, facets, shells ------------------------------------------------------------------- */

static void put_vertices_and_edges(step_file *s) {
  const bx_brep *b = s->brep;
  const uint32_t *triangles = batten_network_triangles(b->network);
  const double *vertices = batten_network_vertices(b->network);
  double points[BX_DEGREE_MAX + 1][3];
  memset(s->vertices, 0, batten_network_vertex_count(b->network) * sizeof *s->vertices);
  for (size_t i = 0; i < 3 * b->face_count; i++)
    if (!s->vertices[triangles[i]]) s->vertices[triangles[i]] = put_vertex(s, vertices + 3 * (size_t)triangles[i]);
  for (size_t e = 0; e < b->edge_count && bx_network_goes_on(s->text.w, e, 4 * b->edge_count); e++) {
    uint32_t h = b->half[e], from = triangles[h], to = triangles[h - h % 3 + (h + 1) % 3];
    unsigned degree = bx_brep_curve(b, e, points);
    s->wires[e] = put_wire(s, degree, (const double(*)[3])points, s->vertices[from], s->vertices[to]);
  }
}

static void put_facets(step_file *s) {
  size_t faces = s->brep->face_count;
  for (size_t f = 0; f < faces && bx_network_goes_on(s->text.w, f + faces / 3, faces + faces / 3); f++)
    put_facet(s, f);
}

/* CLOSED_SHELL or OPEN_SHELL of a component. */
static uint64_t put_shell(step_file *s, const bx_component *c) {
  unsigned squares = bx_squares_of(s->product->form);
  size_t count = 0;
  for (uint32_t i = 0; i < c->faces; i++) {
    size_t first;
    unsigned patches = batten_network_face_patches(s->brep->network, s->brep->sorted[c->first + i], &first);
    for (size_t k = 0; k < (size_t)patches * squares; k++) s->listed[count++] = s->faces[first * squares + k];
  }
  uint64_t shell = step_begin(&s->text);
  bx_put_text(s->text.w, c->closed ? "CLOSED_SHELL('',\n" : "OPEN_SHELL('',\n");
  step_put_references(&s->text, s->listed, count);
  bx_put_text(s->text.w, ");\n");
  return shell;
}

/* A closed component with those inside it, or an open one. */
static uint64_t put_body(step_file *s, uint32_t component) {
  const bx_component *components = s->brep->components, *body = &components[component];
  uint64_t outer = put_shell(s, body);
  size_t voids = 0;
  for (uint32_t c = 0; c < s->brep->component_count; c++) {
    if (components[c].parent != component) continue;
    uint64_t shell = put_shell(s, &components[c]);
    s->voids[voids++] = step_print(&s->text, "ORIENTED_CLOSED_SHELL('',*,#%llu,.F.)", (unsigned long long)shell);
  }
  uint64_t item = step_begin(&s->text);
  bx_put_text(s->text.w, !body->closed ? "SHELL_BASED_SURFACE_MODEL("
                         : voids       ? "BREP_WITH_VOIDS("
                                       : "MANIFOLD_SOLID_BREP(");
  step_put_text(&s->text, s->product->name);
  bx_print(s->text.w, body->closed ? ",#%llu" : ",(#%llu)", (unsigned long long)outer);
  if (voids) {
    bx_put_u8(s->text.w, ',');
    step_put_references(&s->text, s->voids, voids);
  }
  bx_put_text(s->text.w, ");\n");
  return item;
}

static void put_bodies(step_file *s) {
  for (int closed = 1; closed >= 0; closed--)
    for (uint32_t c = 0; c < s->brep->component_count; c++) {
      const bx_component *component = &s->brep->components[c];
      if (component->parent != BX_NONE || component->closed != closed) continue;
      s->bodies[s->solid_count + s->surface_count] = put_body(s, c);
      if (closed)
        s->solid_count++;
      else
        s->surface_count++;
    }
}

/* ---- the product ------------------------------------------------------------------------------------- */

static void put_head(step_file *s) {
  bx_writer *w = s->text.w;
  bool ap242 = s->product->schema == BATTEN_STEP_AP242;
  bx_put_text(w,
              "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION(('smooth surface through a triangle mesh'),'2;1');\n"
              "FILE_NAME(");
  step_put_text(&s->text, s->product->name);
  bx_print(w, ",'%s',(''),(''),'batten %s','batten','');\n", s->product->time_stamp, batten_version());
  bx_print(w, "FILE_SCHEMA(('%s'));\nENDSEC;\nDATA;\n",
           ap242 ? "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF { 1 0 10303 442 1 1 4 }"
                 : "AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }");
}

static uint64_t put_length_unit(step_file *s) {
  static const char *const prefixes[] = {".MILLI.", ".CENTI.", "$"};
  if (s->product->unit != BATTEN_UNIT_INCH)
    return step_print(&s->text, "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(%s,.METRE.))", prefixes[s->product->unit]);
  uint64_t mm = step_print(&s->text, "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))");
  uint64_t inch =
      step_print(&s->text, "LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#%llu)", (unsigned long long)mm);
  uint64_t length = step_print(&s->text, "DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)");
  return step_print(&s->text, "(CONVERSION_BASED_UNIT('INCH',#%llu)LENGTH_UNIT()NAMED_UNIT(#%llu))",
                    (unsigned long long)inch, (unsigned long long)length);
}

/* Units and accuracy. */
static uint64_t put_context(step_file *s) {
  uint64_t length = put_length_unit(s);
  uint64_t angle = step_print(&s->text, "(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))");
  uint64_t solid_angle = step_print(&s->text, "(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())");
  uint64_t uncertainty = step_begin(&s->text);
  bx_put_text(s->text.w, "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(");
  step_put_real(&s->text, bx_brep_uncertainty(s->brep));
  bx_print(s->text.w, "),#%llu,'distance_accuracy_value','largest gap of what belongs together');\n",
           (unsigned long long)length);
  return step_print(&s->text,
                    "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#%llu))"
                    "GLOBAL_UNIT_ASSIGNED_CONTEXT((#%llu,#%llu,#%llu))REPRESENTATION_CONTEXT('',''))",
                    (unsigned long long)uncertainty, (unsigned long long)length, (unsigned long long)angle,
                    (unsigned long long)solid_angle);
}

static uint64_t put_representation(step_file *s, const char *keyword, uint64_t placement, const uint64_t *items,
                                   size_t count, uint64_t context) {
  uint64_t representation = step_begin(&s->text);
  s->listed[0] = placement; /* [patches] is room enough: with an item there is a patch, and one place is spare */
  if (count) memcpy(s->listed + 1, items, count * sizeof *items);
  bx_print(s->text.w, "%s(", keyword);
  step_put_text(&s->text, s->product->name);
  bx_put_u8(s->text.w, ',');
  step_put_references(&s->text, s->listed, count + 1);
  bx_print(s->text.w, ",#%llu);\n", (unsigned long long)context);
  return representation;
}

/* Solids and shells may not stand in one representation of those two kinds: with both there is a plain one, to which
 * each is related. */
static uint64_t put_shape(step_file *s) {
  static const char *const solids = "ADVANCED_BREP_SHAPE_REPRESENTATION";
  static const char *const surfaces = "MANIFOLD_SURFACE_SHAPE_REPRESENTATION";
  uint64_t context = put_context(s);
  uint64_t origin = step_put_point(&s->text, (double[3]){0, 0, 0});
  uint64_t z = step_print(&s->text, "DIRECTION('',(0.,0.,1.))"), x = step_print(&s->text, "DIRECTION('',(1.,0.,0.))");
  uint64_t placement = step_print(&s->text, "AXIS2_PLACEMENT_3D('',#%llu,#%llu,#%llu)", (unsigned long long)origin,
                                  (unsigned long long)z, (unsigned long long)x);
  if (s->surface_count == 0) return put_representation(s, solids, placement, s->bodies, s->solid_count, context);
  if (s->solid_count == 0) return put_representation(s, surfaces, placement, s->bodies, s->surface_count, context);
  uint64_t plain = put_representation(s, "SHAPE_REPRESENTATION", placement, NULL, 0, context), of[2];
  of[0] = put_representation(s, solids, placement, s->bodies, s->solid_count, context);
  of[1] = put_representation(s, surfaces, placement, s->bodies + s->solid_count, s->surface_count, context);
  for (int i = 0; i < 2; i++)
    step_print(&s->text, "SHAPE_REPRESENTATION_RELATIONSHIP('','',#%llu,#%llu)", (unsigned long long)plain,
               (unsigned long long)of[i]);
  return plain;
}

static void put_product(step_file *s, uint64_t shape) {
  bool ap242 = s->product->schema == BATTEN_STEP_AP242;
  uint64_t application = step_print(
      &s->text, "APPLICATION_CONTEXT('%s')",
      ap242 ? "managed model based 3d engineering" : "core data for automotive mechanical design processes");
  step_print(&s->text, "APPLICATION_PROTOCOL_DEFINITION('international standard','%s',%d,#%llu)",
             ap242 ? "ap242_managed_model_based_3d_engineering" : "automotive_design", ap242 ? 2014 : 2000,
             (unsigned long long)application);
  uint64_t context = step_print(&s->text, "PRODUCT_CONTEXT('',#%llu,'mechanical')", (unsigned long long)application);
  uint64_t product = step_begin(&s->text);
  bx_put_text(s->text.w, "PRODUCT(");
  step_put_text(&s->text, s->product->name);
  bx_put_u8(s->text.w, ',');
  step_put_text(&s->text, s->product->name);
  bx_print(s->text.w, ",'',(#%llu));\n", (unsigned long long)context);
  step_print(&s->text, "PRODUCT_RELATED_PRODUCT_CATEGORY('part','',(#%llu))", (unsigned long long)product);
  uint64_t formation = step_print(&s->text, "PRODUCT_DEFINITION_FORMATION('','',#%llu)", (unsigned long long)product);
  uint64_t stage = step_print(&s->text, "PRODUCT_DEFINITION_CONTEXT('part definition',#%llu,'design')",
                              (unsigned long long)application);
  uint64_t definition = step_print(&s->text, "PRODUCT_DEFINITION('design','',#%llu,#%llu)",
                                   (unsigned long long)formation, (unsigned long long)stage);
  uint64_t of = step_print(&s->text, "PRODUCT_DEFINITION_SHAPE('','',#%llu)", (unsigned long long)definition);
  step_print(&s->text, "SHAPE_DEFINITION_REPRESENTATION(#%llu,#%llu)", (unsigned long long)of,
             (unsigned long long)shape);
  bx_put_text(s->text.w, "ENDSEC;\nEND-ISO-10303-21;\n");
}

void bx_write_step(bx_writer *w, const bx_brep *brep, const bx_product *product) {
  size_t faces = batten_network_patch_count(brep->network) * bx_squares_of(product->form);
  step_file *s = batten_alloc(w->ctx, sizeof *s);
  if (!s) {
    bx_writer_fail(w, BATTEN_E_NOMEM);
    return;
  }
  s->text = (step_text){.w = w};
  s->brep = brep;
  s->product = product;
  s->solid_count = s->surface_count = 0;
  s->vertices = batten_alloc_array(w->ctx, batten_network_vertex_count(brep->network), sizeof *s->vertices);
  s->wires = batten_alloc_array(w->ctx, brep->edge_count, sizeof *s->wires);
  s->faces = batten_alloc_array(w->ctx, faces, sizeof *s->faces);
  s->listed = batten_alloc_array(w->ctx, faces + 1, sizeof *s->listed);
  s->bodies = batten_alloc_array(w->ctx, brep->component_count, sizeof *s->bodies);
  s->voids = batten_alloc_array(w->ctx, brep->component_count, sizeof *s->voids);
  if (s->vertices && s->wires && s->faces && s->listed && s->bodies && s->voids) {
    put_head(s);
    put_vertices_and_edges(s);
    put_facets(s);
    put_bodies(s);
    put_product(s, put_shape(s));
  } else {
    bx_writer_fail(w, BATTEN_E_NOMEM);
  }
  batten_free(w->ctx, s->vertices);
  batten_free(w->ctx, s->wires);
  batten_free(w->ctx, s->faces);
  batten_free(w->ctx, s->listed);
  batten_free(w->ctx, s->bodies);
  batten_free(w->ctx, s->voids);
  batten_free(w->ctx, s);
}
