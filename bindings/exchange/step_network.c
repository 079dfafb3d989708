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
#include "step_part.h"

#include <stdio.h>
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
  batten_cad_form form;
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

/* EDGE_CURVE between two vertices, whose points are the curve's ends. */
static uint64_t put_curve(step_file *s, unsigned degree, const double (*points)[3], uint64_t from, uint64_t to) {
  uint64_t ids[BX_DEGREE_MAX + 1];
  double knots[2 * BX_DEGREE_MAX + 2];
  size_t count = bx_bezier_knots(degree, knots);
  ids[0] = from - 1;
  ids[degree] = to - 1;
  for (unsigned i = 1; i < degree; i++) ids[i] = step_put_point(&s->text, points[i]);
  uint64_t curve = step_put_curve(&s->text, "", degree, count, knots, ids, false);
  return step_put_edge(&s->text, from, to, curve);
}

static wire put_wire(step_file *s, unsigned degree, const double (*points)[3], uint64_t from, uint64_t to) {
  wire out = {{0}, 0};
  if (s->form != BATTEN_CAD_QUADS) {
    out.edge[0] = put_curve(s, degree, points, from, to);
    return out;
  }
  double left[BX_DEGREE_MAX + 1][3], right[BX_DEGREE_MAX + 1][3];
  bx_curve_halve(degree, points, left, right);
  out.middle = step_put_vertex(&s->text, right[0]);
  out.edge[0] = put_curve(s, degree, (const double(*)[3])left, from, out.middle);
  out.edge[1] = put_curve(s, degree, (const double(*)[3])right, out.middle, to);
  return out;
}

static uint64_t put_surface(step_file *s, unsigned degree, const double (*points)[3]) {
  static const bool open[2] = {false, false};
  double knots[2 * BX_DEGREE_MAX + 2];
  batten_surface_form form = bx_square_form(degree, points[0], knots);
  return step_put_surface(&s->text, &form, open);
}

/* ---- faces ------------------------------------------------------------------------------------------- */

/* "face 17 part 2 quad 1", quads being counted from 1; 0 = the patch is one face. */
static uint64_t put_face(step_file *s, const batten_network_patch *patch, unsigned quad, uint64_t surface,
                         const step_loop *loop) {
  char name[64];
  int at = snprintf(name, sizeof name, "face %lu", (unsigned long)patch->face);
  if (patch->part) at += snprintf(name + at, sizeof name - (size_t)at, " part %u", patch->part);
  if (quad) snprintf(name + at, sizeof name - (size_t)at, " quad %u", quad);
  return step_put_face(&s->text, name, surface, loop, !s->brep->components[s->brep->component[patch->face]].inward);
}

static void make_squares(step_file *s, const batten_network_patch *patch) {
  for (unsigned q = 0; q < bx_squares_of(s->form); q++) {
    bx_corners corners;
    bx_corners_of(s->form, q, corners);
    bx_patch_square(&s->work, patch->degree, patch->control_points, (const double(*)[3])corners,
                    &s->squares[q][0][0]);
  }
}

/* One face around the whole patch. */
static void put_triangle(step_file *s, const batten_network_patch *patch, const side sides[3], uint64_t *faces) {
  uint64_t surface = put_surface(s, patch->degree, (const double(*)[3])s->squares[0]);
  step_loop b = {.count = 3};
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
  uint64_t centre = step_put_vertex(&s->text, s->squares[0][width * width - 1]), spokes[3];
  for (unsigned k = 0; k < 3; k++) {
    double points[BX_DEGREE_MAX + 1][3];
    memcpy(points, s->squares[k] + n * width, width * sizeof points[0]);
    unsigned degree = bx_curve_reduce(n, points, bx_brep_rounding(s->brep));
    spokes[k] = put_curve(s, degree, (const double(*)[3])points, sides[k].wire.middle, centre);
  }
  for (unsigned k = 0; k < 3; k++) {
    const side *next = &sides[k], *last = &sides[(k + 2) % 3];
    uint64_t surface = put_surface(s, n, (const double(*)[3])s->squares[k]);
    step_loop b = {.count = 4,
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
    if (!centre) centre = step_put_vertex(&s->text, points[0]);
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
  unsigned count = batten_network_face_patches(s->brep->network, face, &first), squares = bx_squares_of(s->form);
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
    if (!s->vertices[triangles[i]])
      s->vertices[triangles[i]] = step_put_vertex(&s->text, vertices + 3 * (size_t)triangles[i]);
  for (size_t e = 0; e < b->edge_count && bx_goes_on(s->text.w, e, 4 * b->edge_count); e++) {
    uint32_t h = b->half[e], from = triangles[h], to = triangles[h - h % 3 + (h + 1) % 3];
    unsigned degree = bx_brep_curve(b, e, points);
    s->wires[e] = put_wire(s, degree, (const double(*)[3])points, s->vertices[from], s->vertices[to]);
  }
}

static void put_facets(step_file *s) {
  size_t faces = s->brep->face_count;
  for (size_t f = 0; f < faces && bx_goes_on(s->text.w, f + faces / 3, faces + faces / 3); f++) put_facet(s, f);
}

/* CLOSED_SHELL or OPEN_SHELL of a component. */
static uint64_t put_shell(step_file *s, const bx_component *c) {
  unsigned squares = bx_squares_of(s->form);
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

/* Solids and shells may not stand in one representation of those two kinds: with both there is a plain one, to which
 * each is related. */
static uint64_t put_shape(step_file *s) {
  static const char *const solids = "ADVANCED_BREP_SHAPE_REPRESENTATION";
  static const char *const surfaces = "MANIFOLD_SURFACE_SHAPE_REPRESENTATION";
  step_text *text = &s->text;
  size_t solid_count = s->solid_count, surface_count = s->surface_count;
  uint64_t context = step_put_context(text, s->product, bx_cad_uncertainty(s->brep->size));
  uint64_t placement = step_put_placement(text), of[2];
  if (surface_count == 0)
    return step_put_representation(text, solids, s->product, placement, s->bodies, solid_count, context);
  if (solid_count == 0)
    return step_put_representation(text, surfaces, s->product, placement, s->bodies, surface_count, context);
  uint64_t plain = step_put_representation(text, "SHAPE_REPRESENTATION", s->product, placement, NULL, 0, context);
  of[0] = step_put_representation(text, solids, s->product, placement, s->bodies, solid_count, context);
  of[1] =
      step_put_representation(text, surfaces, s->product, placement, s->bodies + solid_count, surface_count, context);
  for (int i = 0; i < 2; i++)
    step_print(&s->text, "SHAPE_REPRESENTATION_RELATIONSHIP('','',#%llu,#%llu)", (unsigned long long)plain,
               (unsigned long long)of[i]);
  return plain;
}

void bx_write_step_network(bx_writer *w, const bx_brep *brep, batten_cad_form form, const bx_product *product) {
  size_t faces = batten_network_patch_count(brep->network) * bx_squares_of(form);
  step_file *s = batten_alloc(w->ctx, sizeof *s);
  if (!s) {
    bx_writer_fail(w, BATTEN_E_NOMEM);
    return;
  }
  s->text = (step_text){.w = w};
  s->brep = brep;
  s->form = form;
  s->product = product;
  s->solid_count = s->surface_count = 0;
  s->vertices = batten_alloc_array(w->ctx, batten_network_vertex_count(brep->network), sizeof *s->vertices);
  s->wires = batten_alloc_array(w->ctx, brep->edge_count, sizeof *s->wires);
  s->faces = batten_alloc_array(w->ctx, faces, sizeof *s->faces);
  s->listed = batten_alloc_array(w->ctx, faces, sizeof *s->listed);
  s->bodies = batten_alloc_array(w->ctx, brep->component_count, sizeof *s->bodies);
  s->voids = batten_alloc_array(w->ctx, brep->component_count, sizeof *s->voids);
  if (s->vertices && s->wires && s->faces && s->listed && s->bodies && s->voids) {
    step_begin_file(&s->text, product);
    put_vertices_and_edges(s);
    put_facets(s);
    put_bodies(s);
    step_end_file(&s->text, product, put_shape(s));
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
