/* Entities of STEP files that networks, surfaces and curves have in common: B-splines, topology, the product around
 * them.
 *
 *   step_begin_file(s, product); ... vertices, curves, edges, surfaces, faces, shells ...
 *   context = step_put_context(...); placement = step_put_placement(s);
 *   shape = step_put_representation(...); step_end_file(s, product, shape); */
#ifndef BATTEN_EXCHANGE_STEP_PART_H
#define BATTEN_EXCHANGE_STEP_PART_H

#include "cad.h"
#include "step_text.h"

enum { STEP_SIDES_MAX = 4 };

/* Entities in the order of a face's loop. */
typedef struct step_loop {
  uint64_t edges[STEP_SIDES_MAX];
  bool forward[STEP_SIDES_MAX];
  unsigned count;
} step_loop;

void step_begin_file(step_text *s, const bx_product *product);

/* VERTEX_POINT at a point that is written already, or just before it. */
uint64_t step_put_vertex_at(step_text *s, uint64_t point);
uint64_t step_put_vertex(step_text *s, const double point[3]);

/* B_SPLINE_CURVE_WITH_KNOTS of that name (ASCII without quotes) through points that are written already, points
 * [knot_count - degree - 1]. */
uint64_t step_put_curve(step_text *s, const char *name, unsigned degree, size_t knot_count, const double *knots,
                        const uint64_t *points, bool closed);
/* EDGE_CURVE along a curve from its start to its end. */
uint64_t step_put_edge(step_text *s, uint64_t from, uint64_t to, uint64_t curve);

/* CARTESIAN_POINTs in the order of the form and, last, their B_SPLINE_SURFACE_WITH_KNOTS. */
uint64_t step_put_surface(step_text *s, const batten_surface_form *form, const bool closed[2]);

/* ADVANCED_FACE of that name (ASCII without quotes); same_sense: its normal is the surface's. */
uint64_t step_put_face(step_text *s, const char *name, uint64_t surface, const step_loop *loop, bool same_sense);

/* Units and accuracy. */
uint64_t step_put_context(step_text *s, const bx_product *product, double uncertainty);
/* The origin and axes. */
uint64_t step_put_placement(step_text *s);
uint64_t step_put_representation(step_text *s, const char *keyword, const bx_product *product, uint64_t placement,
                                 const uint64_t *items, size_t count, uint64_t context);
/* The product whose shape that is, and the end of the file. */
void step_end_file(step_text *s, const bx_product *product, uint64_t shape);

#endif
