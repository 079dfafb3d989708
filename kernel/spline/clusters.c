/* The tree of clusters: a kd-tree gives the order of the terms, halves of it are the clusters. */
#include "spline/clusters.h"

#include "base/checked.h"
#include "basis/neighbours.h"

/* Nodes of a tree in which every cluster of more than CLUSTER_LEAF is halved, as places of a heap: a level is whole
 * or not there, since clusters of a level differ by one term at most. */
static size_t node_count(size_t terms) {
  size_t nodes = 1, level = 1;
  for (size_t largest = terms; largest > CLUSTER_LEAF; largest -= largest / 2) nodes += level *= 2;
  return nodes;
}

static void fill_leaf(const spline_terms *t, const size_t *order, spline_cluster *c) {
  for (unsigned a = 0; a < 3; a++) {
    c->lower[a] = a < t->n ? INFINITY : 0;
    c->upper[a] = a < t->n ? -INFINITY : 0;
  }
  c->w = c->g = 0;
  for (size_t i = c->low; i < c->high; i++) {
    size_t j = order[i];
    double square = 0;
    for (unsigned a = 0; a < t->n; a++) {
      c->lower[a] = fmin(c->lower[a], t->x[a][j]);
      c->upper[a] = fmax(c->upper[a], t->x[a][j]);
      if (j >= t->plain) square += t->g[a][j - t->plain] * t->g[a][j - t->plain];
    }
    c->w += fabs(t->w[j]);
    c->g += sqrt(square);
  }
}

static void join(const spline_cluster *a, const spline_cluster *b, spline_cluster *c) {
  for (unsigned k = 0; k < 3; k++) {
    c->lower[k] = fmin(a->lower[k], b->lower[k]);
    c->upper[k] = fmax(a->upper[k], b->upper[k]);
  }
  c->w = a->w + b->w;
  c->g = a->g + b->g;
}

/* nodes [count] from the terms in their order: ranges downwards, contents upwards. */
static void fill(const spline_terms *t, const size_t *order, size_t count, spline_cluster *nodes) {
  nodes[0].low = 0;
  nodes[0].high = t->plain + t->hermite;
  for (size_t i = 0; 2 * i + 2 < count; i++) {
    /* Where a leaf's place has children, these hold nothing and nobody goes there. */
    size_t low = nodes[i].low, high = nodes[i].high, middle = low + (high - low) / 2;
    if (spline_cluster_is_leaf(nodes + i)) middle = low = high;
    nodes[2 * i + 1].low = low;
    nodes[2 * i + 1].high = nodes[2 * i + 2].low = middle;
    nodes[2 * i + 2].high = high;
  }
  for (size_t i = count; i-- > 0;)
    if (spline_cluster_is_leaf(nodes + i))
      fill_leaf(t, order, nodes + i);
    else
      join(nodes + 2 * i + 1, nodes + 2 * i + 2, nodes + i);
}

batten_status batten_spline_clusters_new(batten_context *ctx, const spline_terms *terms, spline_clusters *out) {
  size_t count = terms->plain + terms->hermite, n = terms->n, nodes = node_count(count);
  spline_clusters made = {NULL, NULL};
  *out = made;
  if (count == 0) return BATTEN_OK;
  batten_tree *tree = NULL;
  batten_status st = BATTEN_E_NOMEM;
  double *points = batten_alloc_array(ctx, count, n * sizeof *points);
  made.nodes = points ? batten_alloc_array(ctx, nodes, sizeof *made.nodes) : NULL;
  made.order = made.nodes ? batten_alloc_array(ctx, count, sizeof *made.order) : NULL;
  if (!made.order) goto done;
  for (size_t j = 0; j < count; j++)
    for (size_t a = 0; a < n; a++) points[j * n + a] = terms->x[a][j];
  st = batten_tree_new(ctx, terms->n, count, points, &tree);
  if (st < 0) goto done;
  batten_tree_order(tree, made.order);
  fill(terms, made.order, nodes, made.nodes);
  *out = made;
  made = (spline_clusters){NULL, NULL};
done:
  batten_spline_clusters_free(ctx, &made);
  batten_tree_free(ctx, tree);
  batten_free(ctx, points);
  return st;
}

void batten_spline_clusters_free(batten_context *ctx, spline_clusters *clusters) {
  batten_free(ctx, clusters->order);
  batten_free(ctx, clusters->nodes);
  *clusters = (spline_clusters){NULL, NULL};
}
