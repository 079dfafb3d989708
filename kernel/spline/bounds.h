/* Quadratic models of splines over boxes: what bounds of solids are made of. */
#ifndef BATTEN_SPLINE_BOUNDS_H
#define BATTEN_SPLINE_BOUNDS_H

#include <batten/spline.h>

#include "basis/taylor.h"

/* models [count] of U over boxes [count], in the caller's unit. On the context's threads; same bits for any number.
 */
batten_status batten_spline_models(batten_context *ctx, const batten_spline *s, size_t count, const taylor_box *boxes,
                                   taylor *models);

#endif
