/* Writers of tensor-product surfaces, on a file that is open. Errors stay with the writer until bx_commit. */
#ifndef BATTEN_EXCHANGE_SURFACE_H
#define BATTEN_EXCHANGE_SURFACE_H

#include "cad.h"
#include "write_file.h"

#include <stdbool.h>

/* Sides of a surface, in the order of the loop around it: u runs along v = lower, v along u = upper, u back along v =
 * upper, v back along u = lower. */
enum { BX_SIDES = 4 };

/* How the sides of a surface meet. */
typedef struct bx_sides {
  bool point[BX_SIDES];      /* the side is one point */
  bool closed[2];            /* u, v: the sides at its lower and upper end are one curve */
  unsigned corner[BX_SIDES]; /* at which sides begin: the number of the first corner in the same place */
  double size, reach;        /* diagonal of the box of the control points, largest coordinate */
} bx_sides;

/* Places nearer than the accuracy that CAD files tell are one. INVALID: the surface is a curve or a point. */
batten_status bx_find_sides(batten_context *ctx, const batten_surface_form *form, batten_length_unit unit,
                            bx_sides *out);

/* Control points of form in a direction. */
static inline size_t bx_form_points(const batten_surface_form *form, int direction) {
  return form->knot_count[direction] - form->degree[direction] - 1;
}

void bx_write_step_surface(bx_writer *w, const batten_surface_form *form, const bx_sides *sides,
                           const bx_product *product);
void bx_write_iges_surface(bx_writer *w, const batten_surface_form *form, const bx_sides *sides,
                           const bx_product *product);
void bx_write_json_surface(bx_writer *w, const batten_surface_form *form);
void bx_write_vtu_surface(bx_writer *w, const batten_surface_form *form);

/* ---- span pairs -------------------------------------------------------------------------------------- */

/* Nonempty spans in a direction. */
size_t bx_span_count(const batten_surface_form *form, int direction);
/* The knot index mu of the nonempty span [knots[mu], knots[mu + 1]] behind that of mu; 0 gives the first. */
size_t bx_next_span(const batten_surface_form *form, int direction, size_t mu);

enum { BX_SPAN_MAX = (BATTEN_SURFACE_DEGREE_MAX + 1) * (BATTEN_SURFACE_DEGREE_MAX + 1) };
/* Bezier form on a span pair: points [degree[0] + 1][degree[1] + 1], to rounding; the same bits where the knots have
 * only that span. */
void bx_span_points(const batten_surface_form *form, const size_t mu[2], double (*points)[3]);

/* VTK's order of the control points of a Bezier quadrilateral: indices into [p + 1][q + 1]. Returns how many. */
size_t bx_vtk_quadrilateral_order(unsigned p, unsigned q, unsigned order[]);

#endif
