/* Lexicographic order of points: what sums and walks over a set of points go by when they must not depend on the
 * order in which it was given. */
#ifndef BATTEN_BASIS_SORT_POINTS_H
#define BATTEN_BASIS_SORT_POINTS_H

#include <batten/base.h>
#include <stdint.h>

/* order [count]: the indices of points [count][n], n >= 1, by the first coordinate, then the second, ...; points at
 * one place by index. Finite coordinates, count <= UINT32_MAX. Time O(count log count). Fails: NOMEM. */
batten_status batten_sort_points(batten_context *ctx, unsigned n, size_t count, const double *points,
                                 uint32_t *order);

#endif
