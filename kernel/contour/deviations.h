/* What neighbouring points tell of their noise, whatever the curve does. */
#ifndef BATTEN_CONTOUR_DEVIATIONS_H
#define BATTEN_CONTOUR_DEVIATIONS_H

#include "contour_inner.h"

typedef struct contour_deviations {
  double local;      /* standard deviation that next neighbours tell; NaN: too few of them to tell */
  double correlated; /* of deviations that are alike for neighbours; 0: there are none to be seen */
  size_t reach;      /* so many points are alike then */
} contour_deviations;

/* parameters ascend. Fails: NOMEM. */
batten_status contour_deviations_find(batten_context *ctx, const contour_data *data, const double *parameters,
                                      bool closed, contour_deviations *out);

#endif
