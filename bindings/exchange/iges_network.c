/* Networks as IGES files: trimmed surfaces.
 *
 * A face is a row of entities, the same for all:
 *
 *   128  surface          110 x sides  lines in parameter space    102  their loop
 *                         126 x sides  the same as curves in space 102  their loop
 *   142  the two loops on the surface            144  the face
 *
 * DEGENERATE has faces with their natural bounds: 128 and 144 alone. */
#include "iges_text.h"
#include "network.h"

#include <string.h>

typedef struct iges_network {
  iges_file *file;
  const bx_brep *brep;
  batten_cad_form form;
  unsigned sides; /* of a face */
  bx_square_work work;
  double square[BX_SQUARE_MAX][3];
} iges_network;

/* ---- entities ---------------------------------------------------------------------------------------- */

static void put_surface(iges_network *n, unsigned degree) {
  static const bool open[2] = {false, false};
  double knots[2 * BX_DEGREE_MAX + 2];
  batten_surface_form form = bx_square_form(degree, n->square[0], knots);
  iges_put_surface(n->file, &form, open);
}

static void put_curve(iges_file *f, unsigned degree, const double (*points)[3]) {
  double knots[2 * BX_DEGREE_MAX + 2];
  size_t count = bx_bezier_knots(degree, knots);
  iges_put_curve(f, &(iges_curve){.degree = degree,
                                  .knot_count = count,
                                  .knots = knots,
                                  .points = points[0],
                                  .role = IGES_PART,
                                  .label = ""});
}

static void put_line(iges_file *f, const double from[2], const double to[2]) {
  iges_begin(f, 110, IGES_PLANE, "", 0);
  iges_put_reals(f, (double[6]){from[0], from[1], 0, to[0], to[1], 0}, 6);
  iges_end(f);
}

/* Of the sides' entities, which are those just before. */
static void put_loop(iges_file *f, unsigned sides, iges_role role) {
  iges_begin(f, 102, role, "", 0);
  iges_put_whole(f, sides);
  for (unsigned i = 0; i < sides; i++) iges_put_whole(f, iges_pointer(f->entity - sides + i));
  iges_end(f);
}

/* A face has the normal of its surface, and that points out of the material: surfaces whose own does not are
 * mirrored, which exchanges their parameters. */
static bool is_mirrored(const iges_network *n, const batten_network_patch *patch) {
  const bx_component *c = &n->brep->components[n->brep->component[patch->face]];
  return c->inward != (c->parent != BX_NONE);
}

/* Side of the face in space, in the direction of the loop. */
static unsigned side_curve(iges_network *n, const batten_network_patch *patch, unsigned side, double (*points)[3]) {
  if (n->form == BATTEN_CAD_TRIMMED) {
    bool mirrored = is_mirrored(n, patch);
    unsigned degree = bx_patch_curve(n->brep, patch, mirrored ? 2 - side : side, points);
    if (mirrored) bx_curve_reverse(degree, points);
    return degree;
  }
  unsigned degree = patch->degree, width = degree + 1;
  for (unsigned i = 0; i <= degree; i++) {
    unsigned s = side == 0 ? i : side == 1 ? degree : side == 2 ? degree - i : 0;
    unsigned t = side == 0 ? 0 : side == 1 ? i : side == 2 ? degree : degree - i;
    memcpy(points[i], n->square[s * width + t], sizeof points[i]);
  }
  return bx_curve_reduce(degree, points, bx_brep_rounding(n->brep));
}

static void put_face(iges_network *n, const batten_network_patch *patch, unsigned square) {
  static const double three[3][2] = {{0, 0}, {1, 0}, {0, 1}}, four[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  iges_file *f = n->file;
  const double(*corners)[2] = n->sides == 3 ? three : four;
  double points[BX_DEGREE_MAX + 1][3];
  bx_corners places;
  size_t first = f->entity;
  bx_corners_of(n->form, square, places);
  if (is_mirrored(n, patch))
    for (int i = 0; i < 3; i++) {
      double swap = places[1][i];
      places[1][i] = places[2][i];
      places[2][i] = swap;
    }
  bx_patch_square(&n->work, patch->degree, patch->control_points, (const double(*)[3])places, &n->square[0][0]);
  put_surface(n, patch->degree);
  if (n->sides) {
    for (unsigned i = 0; i < n->sides; i++) put_line(f, corners[i], corners[(i + 1) % n->sides]);
    put_loop(f, n->sides, IGES_PLANE);
    for (unsigned i = 0; i < n->sides; i++) {
      unsigned degree = side_curve(n, patch, i, points);
      put_curve(f, degree, (const double(*)[3])points);
    }
    put_loop(f, n->sides, IGES_PART);
    iges_begin(f, 142, IGES_PART, "", 0); /* made in no special way; surface, both loops, neither preferred */
    iges_put_whole(f, 0);
    iges_put_whole(f, iges_pointer(first));
    iges_put_whole(f, iges_pointer(first + 1 + n->sides));
    iges_put_whole(f, iges_pointer(first + 2 + 2 * n->sides));
    iges_put_whole(f, 3);
    iges_end(f);
  }
  iges_begin(f, 144, IGES_WHOLE, "FACE", patch->face); /* an outer bound or the natural one, no inner ones */
  iges_put_whole(f, iges_pointer(first));
  iges_put_whole(f, n->sides ? 1 : 0);
  iges_put_whole(f, 0);
  iges_put_whole(f, n->sides ? iges_pointer(f->entity - 1) : 0);
  iges_end(f);
}

static void put_faces(iges_file *f, void *user) {
  iges_network *n = user;
  size_t patches = batten_network_patch_count(n->brep->network);
  n->file = f;
  for (size_t p = 0; p < patches && bx_goes_on(f->w, p + (f->directory ? 0 : patches), 2 * patches); p++) {
    batten_network_patch patch = batten_network_get_patch(n->brep->network, p);
    for (unsigned q = 0; q < bx_squares_of(n->form); q++) put_face(n, &patch, q);
  }
}

void bx_write_iges_network(bx_writer *w, const bx_brep *brep, batten_cad_form form, const bx_product *product) {
  iges_network *n = batten_alloc(w->ctx, sizeof *n);
  if (!n) {
    bx_writer_fail(w, BATTEN_E_NOMEM);
    return;
  }
  n->brep = brep;
  n->form = form;
  n->sides = form == BATTEN_CAD_TRIMMED ? 3 : form == BATTEN_CAD_QUADS ? 4 : 0;
  bx_write_iges(w, product, brep->size, brep->reach, put_faces, n);
  batten_free(w->ctx, n);
}
