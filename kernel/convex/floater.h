/* Shape-preserving parameters [Floater 1997]; for kernel/convex only. */
#ifndef BATTEN_CONVEX_FLOATER_H
#define BATTEN_CONVEX_FLOATER_H

#include <batten/convex.h>

#include "plane.h"

/* uv [count][2], as batten_parametrize says; W_ACCURACY when triangles vanish to rounding. count >= 3. */
batten_status convex_floater(batten_context *ctx, size_t count, const double *points, const convex_scale *scale,
                             const batten_parametrize_options *opt, double *uv);

#endif
