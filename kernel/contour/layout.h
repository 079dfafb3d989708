/* Pieces of a fit and their signs (layout.c). */
#ifndef BATTEN_CONTOUR_LAYOUT_H
#define BATTEN_CONTOUR_LAYOUT_H

#include "contour_inner.h"

typedef struct contour_layout {
  size_t inflection_count;
  double *inflections; /* [inflection_count] of the caller's domain; each is a mark */
  int sign;            /* at the start */
  size_t pieces;
  double *marks;       /* [pieces + 1] breaks of the caller's domain */
  double *breaks;      /* [pieces + 1] the same in [0, 1] */
  signed char *signs;  /* [pieces] */
  contour_shape shape; /* of breaks and signs */
  double time_inflections_s, time_knots_s;
} contour_layout;

/* Progress phase "knots". Fails: INVALID, NOMEM, TOO_LARGE, CANCELLED. */
batten_status contour_layout_make(batten_context *ctx, const contour_data *data, const contour_input *in,
                                  const batten_contour_options *opt, contour_layout *out);
void contour_layout_free(batten_context *ctx, contour_layout *l);

#endif
