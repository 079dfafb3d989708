/* How the rim of a disc goes to the boundary of the square; for kernel/convex only. */
#ifndef BATTEN_CONVEX_OUTLINE_H
#define BATTEN_CONVEX_OUTLINE_H

#include "disc.h"

/* corners [4] from 0 are places in disc->rim, in their order around it, that go to (0, 0), (1, 0), (1, 1), (0, 1), by
 * the rule at batten_parametrize_options. A rim of three points has the corners (0, 0), (1, 0), (0, 1): *count = 3.
 * Fails: NOMEM. */
batten_status convex_outline_choose(batten_context *ctx, const convex_disc *disc, const double *xyz, size_t *count,
                                    size_t corners[4]);

/* The places of given points: INVALID when they are not on the rim, or not in its order. */
batten_status convex_outline_given(batten_context *ctx, const convex_disc *disc, const uint32_t points[4],
                                   size_t corners[4]);

/* uv [points][2] of the rim's points by chord length along each side; side [points] gets bit k for those on side k,
 * corners having two, 0 for points inside. */
void convex_outline_map(const convex_disc *disc, const double *xyz, size_t count, const size_t corners[4], double *uv,
                        unsigned char *side);

#endif
