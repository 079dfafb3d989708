/* The centres of a spline in a balanced tree of boxes, with what each holds; for bounds over boxes (bounds.c). */
#ifndef BATTEN_SPLINE_CLUSTERS_H
#define BATTEN_SPLINE_CLUSTERS_H

#include <batten/base.h>

#include "spline/sum.h"

enum { CLUSTER_LEAF = 8 };

typedef struct spline_cluster {
  double lower[3], upper[3]; /* unit box */
  double w, g;               /* sums of |w| and of the lengths of the gradient coefficients */
  /* Seen from afar, with t = centre - middle of the box, the sum of w phi(x - t) - g . grad phi(x - t) is
   * M0 phi - M1 . grad phi + M2 : D2 phi, M0 = sum w, M1 = sum (w t + g), M2 = sum (w t t' / 2 + g t'), in which the
   * coefficients cancel, up to A |D3 phi|, A = sum (|w| |t|^3 / 6 + |g| |t|^2 / 2): sizes of M0, M1, M2 (the sum of
   * its |eigenvalues| is no larger) and A. */
  double moments[4];
  size_t low, high; /* its terms, as places in order[] */
} spline_cluster;

/* Node i has the children 2 i + 1 and 2 i + 2, each with half of its terms; up to CLUSTER_LEAF terms are a leaf. */
typedef struct spline_clusters {
  spline_cluster *nodes; /* NULL without centres */
  size_t *order;         /* [centres] terms, those of a cluster together */
} spline_clusters;

/* On failure nothing is held. Time O(N log N). */
batten_status batten_spline_clusters_new(batten_context *ctx, const spline_terms *terms, spline_clusters *out);
void batten_spline_clusters_free(batten_context *ctx, spline_clusters *clusters);

static inline int spline_cluster_is_leaf(const spline_cluster *c) { return c->high - c->low <= CLUSTER_LEAF; }

#endif
