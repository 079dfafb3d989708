/* Checked options of a network; for network.c. */
#ifndef BATTEN_NETWORK_OPTIONS_H
#define BATTEN_NETWORK_OPTIONS_H

#include <batten/network.h>

/* Options as given or default, in range. */
batten_status net_options_check(batten_context *ctx, const batten_network_options *given,
                                batten_network_options *out);

/* What AUTO stands for; any other fill is itself. */
batten_network_fill net_options_fill(const batten_network_options *o, size_t faces);

/* 1 or 2: the network that a fill (not AUTO) is made for. */
unsigned net_fill_continuity(batten_network_fill fill);

/* Of its patches: their degree, and how many make up a facet. */
void net_fill_degree(batten_network_fill fill, unsigned *degree, unsigned *parts);

#endif
