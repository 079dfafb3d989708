/* Planar curves as IGES files: entities 126 that stand for themselves, with the normals of their planes. */
#include "curves.h"
#include "iges_text.h"

typedef struct parts {
  const bx_curve_set *set;
  double *points; /* [point_max][3] scratch */
} parts;

static void put_curves(iges_file *f, void *user) {
  static const batten_plane flat = {{0}, {{1, 0, 0}, {0, 1, 0}}};
  const parts *p = user;
  size_t count = p->set->count;
  for (size_t i = 0; i < count && bx_goes_on(f->w, i + (f->directory ? 0 : count), 2 * count); i++) {
    batten_curve_form form = batten_curve_get(p->set->curves[i]);
    const batten_plane *plane = p->set->planes ? &p->set->planes[i] : &flat;
    const double *x = plane->axes[0], *y = plane->axes[1];
    const double normal[3] = {x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]};
    for (size_t k = 0; k < bx_curve_points(&form); k++)
      bx_curve_place(p->set, i, form.control_points + 2 * k, p->points + 3 * k);
    iges_put_curve(f, &(iges_curve){.degree = form.degree,
                                    .knot_count = form.knot_count,
                                    .knots = form.knots,
                                    .points = p->points,
                                    .closed = form.closed != 0,
                                    .normal = normal,
                                    .role = IGES_WHOLE,
                                    .label = "CURVE",
                                    .number = (unsigned long)i});
  }
}

void bx_write_iges_curves(bx_writer *w, const bx_curve_set *set, const bx_product *product) {
  parts p = {.set = set, .points = batten_alloc_array(w->ctx, set->point_max, 3 * sizeof(double))};
  if (!p.points)
    bx_writer_fail(w, BATTEN_E_NOMEM);
  else
    bx_write_iges(w, product, set->size, set->reach, put_curves, &p);
  batten_free(w->ctx, p.points);
}
