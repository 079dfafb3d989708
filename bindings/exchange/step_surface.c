/* Surfaces as STEP files: one ADVANCED_FACE in a shell, bounded by the four sides.
 *
 * The sides' curves have the surface's own knots and control points. Sides that are a point are left out of the loop;
 * a surface whose opposite sides meet has one edge there, a seam, which the loop passes twice, once each way. */
#include "step_part.h"
#include "surface.h"

typedef struct step_surface {
  step_text text;
  const batten_surface_form *form;
  const bx_sides *sides;
  uint64_t first;              /* CARTESIAN_POINT of the first control point */
  uint64_t vertices[BX_SIDES]; /* at the corners */
  uint64_t *line;              /* [largest number of points in a direction] scratch */
} step_surface;

/* The control points at a corner, and along a side in the direction of its parameter. */
static uint64_t corner_point(const step_surface *s, unsigned corner) {
  size_t rows = bx_form_points(s->form, 0), columns = bx_form_points(s->form, 1);
  size_t i = corner == 1 || corner == 2 ? rows - 1 : 0, j = corner >= 2 ? columns - 1 : 0;
  return s->first + i * columns + j;
}

static uint64_t put_side(step_surface *s, unsigned side) {
  int direction = side % 2;
  size_t columns = bx_form_points(s->form, 1), count = bx_form_points(s->form, direction);
  unsigned from = side < 2 ? side : (side + 1) % BX_SIDES, to = side < 2 ? side + 1 : side;
  uint64_t start = corner_point(s, from), step = direction == 0 ? columns : 1;
  for (size_t i = 0; i < count; i++) s->line[i] = start + i * step;
  uint64_t curve = step_put_curve(&s->text, "", s->form->degree[direction], s->form->knot_count[direction],
                                  s->form->knots[direction], s->line, s->sides->corner[from] == s->sides->corner[to]);
  return step_put_edge(&s->text, s->vertices[from], s->vertices[to], curve);
}

static step_loop put_sides(step_surface *s) {
  step_loop loop = {.count = 0};
  uint64_t edges[BX_SIDES] = {0};
  for (unsigned c = 0; c < BX_SIDES; c++) {
    unsigned same = s->sides->corner[c];
    s->vertices[c] = same < c ? s->vertices[same] : step_put_vertex_at(&s->text, corner_point(s, c));
  }
  for (unsigned k = 0; k < BX_SIDES; k++) {
    if (s->sides->point[k]) continue;
    /* sides 0 and 2 meet where the surface is closed in v, 1 and 3 in u */
    bool seam = k >= 2 && s->sides->closed[k % 2 == 0 ? 1 : 0];
    edges[k] = seam ? edges[k - 2] : put_side(s, k);
    loop.edges[loop.count] = edges[k];
    loop.forward[loop.count++] = k < 2;
  }
  return loop;
}

static bool is_closed(const step_loop *loop) {
  for (unsigned i = 0; i < loop->count; i++) {
    bool twice = false;
    for (unsigned k = 0; k < loop->count; k++) twice = twice || (k != i && loop->edges[k] == loop->edges[i]);
    if (!twice) return false;
  }
  return true;
}

static void put_file(step_surface *s, const bx_product *product) {
  step_text *text = &s->text;
  step_begin_file(text, product);
  uint64_t surface = step_put_surface(text, s->form, s->sides->closed);
  s->first = surface - bx_form_points(s->form, 0) * bx_form_points(s->form, 1);
  step_loop loop = put_sides(s);
  uint64_t face = step_put_face(text, "face 1", surface, &loop, true);
  uint64_t shell =
      step_print(text, "%s_SHELL('',(#%llu))", is_closed(&loop) ? "CLOSED" : "OPEN", (unsigned long long)face);
  uint64_t model = step_begin(text);
  bx_put_text(text->w, "SHELL_BASED_SURFACE_MODEL(");
  step_put_text(text, product->name);
  bx_print(text->w, ",(#%llu));\n", (unsigned long long)shell);
  uint64_t context = step_put_context(text, product, bx_cad_uncertainty(s->sides->size));
  uint64_t placement = step_put_placement(text);
  uint64_t shape =
      step_put_representation(text, "MANIFOLD_SURFACE_SHAPE_REPRESENTATION", product, placement, &model, 1, context);
  step_end_file(text, product, shape);
}

void bx_write_step_surface(bx_writer *w, const batten_surface_form *form, const bx_sides *sides,
                           const bx_product *product) {
  size_t rows = bx_form_points(form, 0), columns = bx_form_points(form, 1);
  step_surface s = {.text = {.w = w}, .form = form, .sides = sides};
  s.line = batten_alloc_array(w->ctx, rows > columns ? rows : columns, sizeof *s.line);
  if (!s.line)
    bx_writer_fail(w, BATTEN_E_NOMEM);
  else if (bx_goes_on(w, 0, 1))
    put_file(&s, product);
  batten_free(w->ctx, s.line);
}
