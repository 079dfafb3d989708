/* The tree of clusters: a kd-tree gives the order of the terms, halves of it are the clusters. */
#include "spline/clusters.h"

#include "base/checked.h"
#include "base/neighbours.h"

/* Nodes of a tree in which every cluster of more than CLUSTER_LEAF is halved, as places of a heap: a level is whole
 * or not there, since clusters of a level differ by one term at most. */
static size_t node_count(size_t terms) {
  size_t nodes = 1, level = 1;
  for (size_t largest = terms; largest > CLUSTER_LEAF; largest -= largest / 2) nodes += level *= 2;
  return nodes;
}

static void find_box(const spline_terms *t, const size_t *order, spline_cluster *c) {
  for (unsigned a = 0; a < 3; a++) {
    c->lower[a] = a < t->n ? INFINITY : 0;
    c->upper[a] = a < t->n ? -INFINITY : 0;
  }
  for (size_t i = c->low; i < c->high; i++)
    for (unsigned a = 0; a < t->n; a++) {
      c->lower[a] = fmin(c->lower[a], t->x[a][order[i]]);
      c->upper[a] = fmax(c->upper[a], t->x[a][order[i]]);
    }
}

static void find_contents(const spline_terms *t, const size_t *order, spline_cluster *c) {
  const unsigned n = t->n;
  double m0 = 0, m1[3] = {0, 0, 0}, m2[9] = {0}, size1 = 0, size2 = 0, rest = 0, middle[3];
  c->w = c->g = 0;
  for (unsigned a = 0; a < 3; a++) middle[a] = (c->lower[a] + c->upper[a]) / 2;
  for (size_t i = c->low; i < c->high; i++) {
    size_t j = order[i];
    double w = t->w[j], g[3] = {0, 0, 0}, d[3] = {0, 0, 0}, length = 0, distance = 0;
    for (unsigned a = 0; a < n; a++) {
      d[a] = t->x[a][j] - middle[a];
      if (j >= t->plain) g[a] = t->g[a][j - t->plain];
      length += g[a] * g[a];
      distance += d[a] * d[a];
    }
    length = sqrt(length);
    distance = sqrt(distance);
    m0 += w;
    for (unsigned a = 0; a < n; a++) {
      m1[a] += w * d[a] + g[a];
      for (unsigned b = 0; b < n; b++) m2[3 * a + b] += w * d[a] * d[b] / 2 + (g[a] * d[b] + g[b] * d[a]) / 2;
    }
    c->w += fabs(w);
    c->g += length;
    size1 += fabs(w) * distance + length;
    size2 += (fabs(w) * distance / 2 + length) * distance;
    rest += (fabs(w) * distance / 6 + length / 2) * distance * distance;
  }
  /* Rounding of sums that cancel; 3: components, and the root of their number. */
  double rounding = 3 * ((double)(c->high - c->low) + 16) * 0x1p-52, square1 = 0, square2 = 0;
  for (unsigned a = 0; a < 3; a++) square1 += m1[a] * m1[a];
  for (unsigned a = 0; a < 9; a++) square2 += m2[a] * m2[a];
  c->moments[0] = fabs(m0) + rounding * c->w;
  c->moments[1] = sqrt(square1) + rounding * size1;
  c->moments[2] = sqrt(n * square2) + rounding * size2;
  c->moments[3] = rest * (1 + rounding);
}

/* Which terms the nodes [count] have. */
static void divide(const spline_terms *t, size_t count, spline_cluster *nodes) {
  nodes[0].low = 0;
  nodes[0].high = t->plain + t->hermite;
  for (size_t i = 0; 2 * i + 2 < count; i++) {
    size_t low = nodes[i].low, high = nodes[i].high, middle = low + (high - low) / 2;
    /* Where a leaf's place has children, these hold nothing and nobody goes there. */
    if (spline_cluster_is_leaf(nodes + i)) middle = low = high;
    nodes[2 * i + 1].low = low;
    nodes[2 * i + 1].high = nodes[2 * i + 2].low = middle;
    nodes[2 * i + 2].high = high;
  }
}

/* Nodes of a level, so many to a task. */
typedef struct filling {
  const spline_terms *terms;
  const size_t *order;
  spline_cluster *nodes;
  size_t first, last, each;
} filling;

static void fill_nodes(void *arg, size_t task) {
  const filling *f = arg;
  const size_t first = f->first + task * f->each;
  for (size_t i = first; i < first + f->each && i < f->last; i++) {
    if (f->nodes[i].low == f->nodes[i].high) continue;
    find_box(f->terms, f->order, f->nodes + i);
    find_contents(f->terms, f->order, f->nodes + i);
  }
}

enum {
  TASKS = 512,      /* of a level at most */
  LASTING = 1 << 16 /* terms from which on a level takes time to tell of */
};

/* nodes [count] from the terms in their order. Each level looks at all terms once. */
static batten_status fill(batten_context *ctx, const spline_terms *t, const size_t *order, size_t count,
                          spline_cluster *nodes) {
  filling f = {.terms = t, .order = order, .nodes = nodes};
  divide(t, count, nodes);
  for (size_t level = 1; f.first < count; level *= 2, f.first = f.last) {
    batten_status st =
        nodes[0].high < LASTING ? BATTEN_OK : batten_progress(ctx, "clusters", (double)f.first / (double)count);
    if (st < 0) return st;
    f.last = f.first + level;
    f.each = (level + TASKS - 1) / TASKS;
    batten_parallel(ctx, (level + f.each - 1) / f.each, fill_nodes, &f);
  }
  return BATTEN_OK;
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
  st = fill(ctx, terms, made.order, nodes, made.nodes);
  if (st < 0) goto done;
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
