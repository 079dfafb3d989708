/* Nearest points: a balanced kd-tree over points [count][n], n = 1 .. 3.
 *
 * Answers are the same for any thread count and any order of the work: ties in distance go to the lower index.
 * Distances are compared by their squares: coordinates between 1e-150 and 1e150.
 * Time: O(N log N) to build, O(k log N) a query for points that lie on curves and surfaces. */
#ifndef BATTEN_BASE_NEIGHBOURS_H
#define BATTEN_BASE_NEIGHBOURS_H

#include <batten/base.h>
#include <stdbool.h>

typedef struct batten_tree batten_tree;

/* Copies the points. More than 10,000 are split by tasks, with progress (phase "tree") between. Fails: INVALID (n,
 * non-finite point), TOO_LARGE, NOMEM, CANCELLED. Queries only read the tree and need no context: they may run in
 * worker tasks. */
batten_status batten_tree_new(batten_context *ctx, unsigned n, size_t count, const double *points, batten_tree **out);
void batten_tree_free(batten_context *ctx, batten_tree *tree);

/* order [count]: the points such that neighbours stand together: halves of it, their halves (the first one the smaller
 * where they cannot be equal) and so on down to 8 points lie on two sides of a plane. */
void batten_tree_order(const batten_tree *tree, size_t *order);

/* The k nearest points to x, nearest first: index [k], distance [k]. skip: an index that does not count (SIZE_MAX =
 * none). Returns how many there are, min(k, points without skip). k is meant to be small (insertion into a list). */
size_t batten_tree_nearest(const batten_tree *tree, const double *x, size_t k, size_t skip, size_t *index,
                           double *distance);

/* All points with |p - x| <= radius, in no particular but fixed order: index [count of the tree]. Returns how many.
 */
size_t batten_tree_within(const batten_tree *tree, const double *x, double radius, size_t *index);

/* Whether some point but number `skip` is within radius: stops at the first. */
bool batten_tree_any_within(const batten_tree *tree, const double *x, double radius, size_t skip);

/* The k nearest other points of every point of the tree: index [count][k], distance [count][k] (NULL = not wanted),
 * nearest first. Many points are looked up piece by piece, with progress (phase "neighbours") between. Fails: INVALID
 * (k >= count unless count = 0), TOO_LARGE, NOMEM, CANCELLED. */
batten_status batten_tree_neighbours(batten_context *ctx, const batten_tree *tree, size_t k, size_t *index,
                                     double *distance);

/* The same for points [count][n] without a tree of theirs. */
batten_status batten_neighbours(batten_context *ctx, unsigned n, size_t count, const double *points, size_t k,
                                size_t *index, double *distance);

#endif
