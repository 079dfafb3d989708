/* Planar curves as STEP files: a GEOMETRIC_CURVE_SET of B_SPLINE_CURVE_WITH_KNOTS, the representation of wireframes
 * that need no vertices (geometrically bounded ones are in both schemas). Curves are named "curve 0", "curve 1", ...
 */
#include "curves.h"
#include "step_part.h"

#include <stdio.h>

typedef struct step_curves {
  step_text text;
  const bx_curve_set *set;
  uint64_t *points; /* [point_max] scratch */
  uint64_t *curves; /* [count] */
} step_curves;

static uint64_t put_curve(step_curves *s, size_t i) {
  batten_curve_form form = batten_curve_get(s->set->curves[i]);
  size_t count = bx_curve_points(&form);
  char name[32];
  snprintf(name, sizeof name, "curve %zu", i);
  for (size_t k = 0; k < count; k++) {
    double place[3];
    bx_curve_place(s->set, i, form.control_points + 2 * k, place);
    /* the last point of a closed curve is the first one */
    s->points[k] = form.closed && k + 1 == count ? s->points[0] : step_put_point(&s->text, place);
  }
  return step_put_curve(&s->text, name, form.degree, form.knot_count, form.knots, s->points, form.closed);
}

static void put_file(step_curves *s, const bx_product *product) {
  step_text *text = &s->text;
  size_t count = s->set->count;
  step_begin_file(text, product);
  for (size_t i = 0; i < count && bx_goes_on(text->w, i, count); i++) s->curves[i] = put_curve(s, i);
  if (text->w->status != BATTEN_OK) return;
  uint64_t model = step_begin(text);
  bx_put_text(text->w, "GEOMETRIC_CURVE_SET(");
  step_put_text(text, product->name);
  bx_put_u8(text->w, ',');
  step_put_references(text, s->curves, count);
  bx_put_text(text->w, ");\n");
  uint64_t context = step_put_context(text, product, bx_cad_uncertainty(s->set->size));
  uint64_t placement = step_put_placement(text);
  uint64_t shape = step_put_representation(text, "GEOMETRICALLY_BOUNDED_WIREFRAME_SHAPE_REPRESENTATION", product,
                                           placement, &model, 1, context);
  step_end_file(text, product, shape);
}

void bx_write_step_curves(bx_writer *w, const bx_curve_set *set, const bx_product *product) {
  step_curves s = {.text = {.w = w}, .set = set};
  s.points = batten_alloc_array(w->ctx, set->point_max, sizeof *s.points);
  s.curves = batten_alloc_array(w->ctx, set->count, sizeof *s.curves);
  if (!s.points || !s.curves)
    bx_writer_fail(w, BATTEN_E_NOMEM);
  else
    put_file(&s, product);
  batten_free(w->ctx, s.points);
  batten_free(w->ctx, s.curves);
}
