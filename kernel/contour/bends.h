/* Runs of one sign of curvature in smoothed data, and which of them the data speak for. */
#ifndef BATTEN_CONTOUR_BENDS_H
#define BATTEN_CONTOUR_BENDS_H

#include "smooth.h"

/* The curvature plot: samples at equal steps of t, of closed curves the first once more at the end. */
typedef struct contour_plot {
  size_t count;
  double *samples; /* [count][4] t, curvature, its standard deviation, length from the start */
  double *angles;  /* [count] of the tangent, unwrapped */
} contour_plot;
batten_status contour_plot_make(batten_context *ctx, const contour_smooth *s, contour_plot *out);
void contour_plot_free(batten_context *ctx, contour_plot *p);

typedef struct contour_bends {
  size_t run_count;
  batten_contour_run *runs; /* [run_count] as in the header; of closed curves the last may reach beyond 1 */
  size_t count;
  double *inflections, *uncertainties; /* [count] */
  int sign;                            /* at the start */
} contour_bends;
/* What counts at each of `count` significances, which ascend: each out [count] has some of the inflections of the one
 * before; the last one has the runs. parameters [points] are for telling how many points speak for a run. Fails:
 * NOMEM, CANCELLED. */
batten_status contour_bends_find(batten_context *ctx, const contour_smooth *s, const contour_plot *plot,
                                 size_t points, const double *parameters, size_t count, const double *significances,
                                 contour_bends *out);
void contour_bends_free(batten_context *ctx, contour_bends *b);

/* No noise is taken for less than this part of the points' size where there are as many points as this; where they
 * are more, it is that of neighbours alike, so that they tell no more of it: what is even to the eye does not bend,
 * however many points make it sure. */
static const double CONTOUR_EVEN = 1e-4, CONTOUR_EVEN_COUNT = 100;

#endif
