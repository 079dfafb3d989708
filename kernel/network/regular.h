/* Proofs that the normal of a patch vanishes nowhere. */
#ifndef BATTEN_NETWORK_REGULAR_H
#define BATTEN_NETWORK_REGULAR_H

#include <batten/network.h>
#include <stdbool.h>

/* Doubles of scratch for patches up to a degree. */
size_t net_regular_work(unsigned degree);

/* True: du x dv is proven to vanish nowhere on the patch. False: it vanishes, or comes near to it. degree 1 .. 12. */
bool net_regular(unsigned degree, const double (*net)[3], double *work);

/* How many patches, and faces with such patches, are not proven; either may be NULL. On the context's threads, about
 * 1 us a patch where it is not strongly curved. Progress of the phase from a fraction to 1. Fails: NOMEM, CANCELLED.
 */
batten_status net_find_irregular(batten_context *ctx, const batten_network *network, const char *phase, double from,
                                 size_t *patches, size_t *faces);

#endif
