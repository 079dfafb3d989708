/* Places along the loops of a section and beside them: where its function is made to fit, and where it is judged. */
#ifndef BATTEN_SECTION_PLACES_H
#define BATTEN_SECTION_PLACES_H

#include "basis/polygon.h"

typedef struct loop_places {
  size_t count;
  size_t *starts;  /* [loops + 1] places by loop */
  double *x;       /* [count][2] on the loops, in their order */
  double *outward; /* [count][2] unit normals out of the area; of an edge, or the bisector at a vertex */
  double *edge;    /* [loops] the edge length at which half of the loop's length lies in longer edges */
} loop_places;

/* Edges longer than step (of the loop: step times loop_places.edge, at most step_max, but no more places than 65536
 * in all) are cut evenly; vertices that follow the last place by less than an eighth of the step are passed over. A
 * loop has at least three places. */
batten_status loop_places_make(batten_context *ctx, const polygon_set *loops, double step, double step_max,
                               loop_places *out);
void loop_places_free(batten_context *ctx, loop_places *p); /* takes a zeroed struct too */

/* Places off the loops: a grid of square cells, `cells` along the longest side of the box of the loops, beyond which
 * it goes on for half of its half diagonal; and on both sides of every place, offset along the normal by 1, 2, 4, 8
 * times `near`, and so on up to a cell, where the grid takes over. shift in [0, 1) of a cell moves the grid. x
 * [*count][2] is freed by batten_free. */
batten_status loop_places_beside(batten_context *ctx, const polygon_set *loops, const loop_places *along, double near,
                                 size_t cells, double shift, double **x, size_t *count);

#endif
