/* Neighbours, and what normals of neighbours say about each other.
 *
 * Two normals are compared after reflection in the bisector plane of their points (after Koenig and Gumhold 2009,
 * "Consistent propagation of normal orientations"): a plain scalar product calls the two sides of a rim alike or
 * unalike by chance. */
#include "orient.h"

#include <math.h>
#include <string.h>

#include "base/checked.h"

/* Neighbours: enough to span a plane where points crowd along scan lines, few enough to stay local. */
enum { NEIGHBOURS_2D = 4, NEIGHBOURS_3D = 10 };

static double dot(unsigned n, const double *a, const double *b) {
  double s = 0;
  for (unsigned c = 0; c < n; c++) s += a[c] * b[c];
  return s;
}

void batten_orient_graph_free(batten_context *ctx, batten_orient_graph *g) {
  batten_free(ctx, g->index);
  batten_free(ctx, g->distance);
  batten_free(ctx, g->plane);
  batten_free(ctx, g->flatness);
  batten_free(ctx, g->surface);
  batten_free(ctx, g->area);
  *g = (batten_orient_graph){0};
}

batten_status batten_orient_graph_new(batten_context *ctx, unsigned n, size_t count, const double *points, bool adapt,
                                      double part, batten_orient_graph *graph) {
  size_t k = n == 3 ? NEIGHBOURS_3D : NEIGHBOURS_2D, pairs;
  if (k > count - 1) k = count - 1;
  if (!batten_mul(count, k, &pairs)) return batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu points", count);
  batten_orient_graph g = {.n = n, .count = count, .k = k, .points = points};
  batten_tree *tree = NULL;
  batten_status status = BATTEN_E_NOMEM;
  if (!(g.index = batten_alloc_array(ctx, pairs, sizeof *g.index)) ||
      !(g.distance = batten_alloc_array(ctx, pairs, sizeof *g.distance)) ||
      !(g.plane = batten_alloc_array(ctx, count, n * sizeof *g.plane)) ||
      !(g.flatness = batten_alloc_array(ctx, count, sizeof *g.flatness)) ||
      !(g.surface = batten_alloc_array(ctx, count, n * sizeof *g.surface)) ||
      !(g.area = batten_alloc_array(ctx, count, sizeof *g.area)))
    goto done;
  if ((status = batten_tree_new(ctx, n, count, points, &tree)) < 0) goto done;
  status = batten_orient_fit_planes(ctx, tree, adapt, part, &g);
done:
  batten_tree_free(ctx, tree);
  if (status < 0) batten_orient_graph_free(ctx, &g);
  *graph = g;
  return status;
}

double batten_orient_agreement(unsigned n, const double *a, const double *b, const double *u, const double *v) {
  double e[3] = {0}, square = 0;
  for (unsigned c = 0; c < n; c++) {
    e[c] = b[c] - a[c];
    square += e[c] * e[c];
  }
  double agreement = dot(n, u, v);
  return square > 0 ? agreement - 2 * dot(n, e, u) * dot(n, e, v) / square : agreement;
}

/* Mean of (1 - agreement) / 2 over the neighbour pairs: 1/2 for random normals. */
static double roughness(const batten_orient_graph *g, const double *normals) {
  unsigned n = g->n;
  double sum = 0;
  for (size_t i = 0; i < g->count; i++)
    for (size_t q = 0; q < g->k; q++) {
      size_t j = g->index[i * g->k + q];
      sum += 1 - batten_orient_agreement(n, g->points + i * n, g->points + j * n, normals + i * n, normals + j * n);
    }
  return sum / (2 * (double)g->count * (double)g->k);
}

/* |sum of area_i normal_i| / sum of area_i: 0 for a closed surface (divergence theorem), 1 for a sheet. The areas are
 * those of the disks (lengths of the pieces) that hold the neighbours. */
static double openness(const batten_orient_graph *g, const double *normals) {
  double sum[3] = {0}, total = 0;
  for (size_t i = 0; i < g->count; i++) {
    double area = g->area[i];
    for (unsigned c = 0; c < g->n; c++) sum[c] += area * normals[i * g->n + c];
    total += area;
  }
  return total > 0 ? sqrt(dot(g->n, sum, sum)) / total : 1;
}

double batten_orient_doubt(const batten_orient_graph *g, const double *normals) {
  return roughness(g, normals) + openness(g, normals);
}

size_t batten_orient_pieces(const batten_orient_graph *g, const double *normals, double threshold, size_t *piece) {
  unsigned n = g->n;
  /* Union by lower root with path halving: a root is the lowest point of its piece. */
  for (size_t i = 0; i < g->count; i++) piece[i] = i;
  for (size_t i = 0; i < g->count; i++)
    for (size_t q = 0; q < g->k; q++) {
      size_t j = g->index[i * g->k + q], a = i, b = j;
      if (batten_orient_agreement(n, g->points + i * n, g->points + j * n, normals + i * n, normals + j * n) <=
          threshold)
        continue;
      while (piece[a] != a) a = piece[a] = piece[piece[a]];
      while (piece[b] != b) b = piece[b] = piece[piece[b]];
      if (a < b)
        piece[b] = a;
      else
        piece[a] = b;
    }
  size_t pieces = 0;
  for (size_t i = 0; i < g->count; i++) /* parents come before children: their entry is a label already */
    piece[i] = piece[i] == i ? pieces++ : piece[piece[i]];
  return pieces;
}

/* Direction d of `count` spread evenly over the circle or (Fibonacci's spiral) the sphere. */
static void direction(unsigned n, size_t d, size_t count, double u[3]) {
  const double turn = 6.283185307179586, golden = 0.6180339887498949;
  if (n == 2) {
    u[0] = cos(turn * (double)d / (double)count);
    u[1] = sin(turn * (double)d / (double)count);
    return;
  }
  u[2] = 1 - (2 * (double)d + 1) / (double)count;
  double r = sqrt(1 - u[2] * u[2]), angle = turn * golden * (double)d;
  u[0] = r * cos(angle);
  u[1] = r * sin(angle);
}

double batten_orient_outwardness(unsigned n, const double *points, const double *normals, size_t count,
                                 const size_t *members) {
  const size_t directions = n == 2 ? 32 : 64;
  double sum = 0;
  for (size_t d = 0; d < directions; d++) {
    double u[3], best = -INFINITY;
    size_t at = 0;
    direction(n, d, directions, u);
    for (size_t q = 0; q < count; q++) {
      size_t i = members ? members[q] : q;
      double height = dot(n, u, points + i * n);
      if (height > best) best = height, at = i;
    }
    if (count) sum += dot(n, u, normals + at * n);
  }
  return sum;
}
