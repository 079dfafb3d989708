/* A loop over many points: by tasks, and with an ear to the host. */
#ifndef BATTEN_BASE_POINTS_H
#define BATTEN_BASE_POINTS_H

#include <batten/base.h>

/* Runs task(arg, i) for each i < count on the context's threads; many points go piece by piece, with progress between.
 * Tasks write what is theirs, and must not call into the context. Fails: CANCELLED. */
batten_status batten_for_points(batten_context *ctx, const char *phase, size_t count,
                                void (*task)(void *arg, size_t i), void *arg);

#endif
