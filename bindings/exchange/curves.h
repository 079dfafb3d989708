/* Writers of planar curves, on a file that is open. Errors stay with the writer until bx_commit. */
#ifndef BATTEN_EXCHANGE_CURVES_H
#define BATTEN_EXCHANGE_CURVES_H

#include "cad.h"
#include "write_file.h"

#include <stdbool.h>

/* Curves and where they lie. */
typedef struct bx_curve_set {
  size_t count;
  const batten_curve *const *curves;
  const batten_plane *planes; /* [count]; NULL = z = 0 */
  size_t point_max;           /* most control points of one */
  /* of the control points: box in the planes, largest diagonal of one curve; diagonal of the box and largest
   * coordinate in space */
  double lower[2], upper[2], extent, size, reach;
} bx_curve_set;

static inline size_t bx_curve_points(const batten_curve_form *form) { return form->knot_count - form->degree - 1; }

/* A point of curve i in space. */
void bx_curve_place(const bx_curve_set *set, size_t i, const double point[2], double out[3]);

/* What is wrong with a plane, or NULL: "origin: not finite", ... */
const char *bx_plane_fault(const batten_plane *plane);
/* z = plane->origin[2], and the axes are x and y: to the bit. */
bool bx_plane_is_horizontal(const batten_plane *plane);

void bx_write_json_curves(bx_writer *w, const bx_curve_set *set);
void bx_write_step_curves(bx_writer *w, const bx_curve_set *set, const bx_product *product);
void bx_write_iges_curves(bx_writer *w, const bx_curve_set *set, const bx_product *product);
void bx_write_svg_curves(bx_writer *w, const bx_curve_set *set, batten_length_unit unit, double tolerance);
void bx_write_vtu_curves(bx_writer *w, const bx_curve_set *set);

/* ---- points on curves -------------------------------------------------------------------------------- */

/* Places so near to each other that the polygons through them keep to the tolerance. */
typedef struct bx_curve_samples {
  size_t *starts;             /* [count + 1] */
  double *parameters;         /* [starts[count]] */
  batten_curve_point *points; /* [starts[count]] in the planes */
} bx_curve_samples;

batten_status bx_sample_curves(batten_context *ctx, const bx_curve_set *set, double tolerance, bx_curve_samples *out);
void bx_free_samples(batten_context *ctx, bx_curve_samples *samples);

void bx_write_csv_curves(bx_writer *w, const bx_curve_set *set, const bx_curve_samples *samples);
void bx_write_vtp_curves(bx_writer *w, const bx_curve_set *set, const bx_curve_samples *samples);
void bx_write_vtk_curves(bx_writer *w, const bx_curve_set *set, const bx_curve_samples *samples);

#endif
