/* Neighbours, local planes, and what normals of neighbours say about each other.
 *
 * The plane through a point is the one of least squares through its k nearest points and itself. Two normals are
 * compared after reflection in the bisector plane of their points (after Koenig and Gumhold 2009, "Consistent
 * propagation of normal orientations"): a plain scalar product calls the two sides of a rim alike or unalike by
 * chance. */
#include "orient.h"

#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "base/neighbours.h"
#include "basis/eigen3.h"

/* Neighbours: enough to span a plane where points crowd along scan lines, few enough to stay local. */
enum { NEIGHBOURS_2D = 4, NEIGHBOURS_3D = 10, CHUNK = 256, WIDE = 64 };
/* Neighbours that spread over less than this part of their length lie on a scan line or contour: no plane. */
static const double THREAD = 0.3;

static double dot(unsigned n, const double *a, const double *b) {
  double s = 0;
  for (unsigned c = 0; c < n; c++) s += a[c] * b[c];
  return s;
}

typedef struct plane_task {
  batten_orient_graph *graph;
  const batten_tree *tree;
} plane_task;

/* Principal axes of a point and its neighbours: values [n] ascending, vectors [n][n] in rows. */
static void principal_axes(const batten_orient_graph *g, size_t i, double *values, double *vectors) {
  unsigned n = g->n;
  double mean[3] = {0}, second[9] = {0};
  const double *x = g->points;
  for (size_t q = 0; q <= g->k; q++) {
    size_t j = q < g->k ? g->index[i * g->k + q] : i;
    for (unsigned c = 0; c < n; c++) mean[c] += x[j * n + c] / (double)(g->k + 1);
  }
  for (size_t q = 0; q <= g->k; q++) {
    size_t j = q < g->k ? g->index[i * g->k + q] : i;
    for (unsigned r = 0; r < n; r++)
      for (unsigned c = 0; c < n; c++) second[r * n + c] += (x[j * n + r] - mean[r]) * (x[j * n + c] - mean[c]);
  }
  batten_eigen_symmetric(n, second, values, vectors);
}

/* Keeps the nearer half of the neighbours; the others become the nearest ones that stand off the line along axis. */
static void look_beside(const batten_orient_graph *g, const batten_tree *tree, size_t i, const double *axis) {
  size_t index[WIDE], keep = g->k / 2, found;
  double distance[WIDE];
  const double *x = g->points;
  found = batten_tree_nearest(tree, x + i * 3, WIDE, i, index, distance);
  for (size_t q = keep; q < found && keep < g->k; q++) {
    double e[3];
    for (int c = 0; c < 3; c++) e[c] = x[index[q] * 3 + (size_t)c] - x[i * 3 + (size_t)c];
    double along = dot(3, e, axis);
    /* off by 30 degrees, or no more candidates than places */
    if (along * along > 0.75 * dot(3, e, e) && found - q > g->k - keep) continue;
    g->index[i * g->k + keep] = index[q];
    g->distance[i * g->k + keep++] = distance[q];
  }
}

static void fit_planes(void *task, size_t chunk) {
  plane_task *t = task;
  batten_orient_graph *g = t->graph;
  size_t end = (chunk + 1) * CHUNK < g->count ? (chunk + 1) * CHUNK : g->count;
  for (size_t i = chunk * CHUNK; i < end; i++) {
    double values[3], vectors[9];
    principal_axes(g, i, values, vectors);
    if (g->n == 3 && values[1] < THREAD * THREAD * values[2]) {
      look_beside(g, t->tree, i, vectors + 6);
      principal_axes(g, i, values, vectors);
    }
    memcpy(g->plane + i * g->n, vectors, g->n * sizeof *vectors);
    g->flatness[i] = values[1] > 0 ? 1 - sqrt(fmax(values[0], 0) / values[1]) : 0;
  }
}

void batten_orient_graph_free(batten_context *ctx, batten_orient_graph *g) {
  batten_free(ctx, g->index);
  batten_free(ctx, g->distance);
  batten_free(ctx, g->plane);
  batten_free(ctx, g->flatness);
  *g = (batten_orient_graph){0};
}

batten_status batten_orient_graph_new(batten_context *ctx, unsigned n, size_t count, const double *points,
                                      batten_orient_graph *graph) {
  size_t k = n == 3 ? NEIGHBOURS_3D : NEIGHBOURS_2D, pairs;
  if (k > count - 1) k = count - 1;
  if (!batten_mul(count, k, &pairs)) return batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu points", count);
  batten_orient_graph g = {.n = n, .count = count, .k = k, .points = points};
  batten_tree *tree = NULL;
  batten_status status = BATTEN_E_NOMEM;
  if (!(g.index = batten_alloc_array(ctx, pairs, sizeof *g.index)) ||
      !(g.distance = batten_alloc_array(ctx, pairs, sizeof *g.distance)) ||
      !(g.plane = batten_alloc_array(ctx, count, n * sizeof *g.plane)) ||
      !(g.flatness = batten_alloc_array(ctx, count, sizeof *g.flatness)))
    goto done;
  if ((status = batten_neighbours(ctx, n, count, points, k, g.index, g.distance)) < 0) goto done;
  if ((status = batten_tree_new(ctx, n, count, points, &tree)) < 0) goto done;
  batten_parallel(ctx, (count + CHUNK - 1) / CHUNK, fit_planes, &(plane_task){&g, tree});
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

double batten_orient_area(const batten_orient_graph *g, size_t i) {
  const double pi = 3.141592653589793;
  double radius = g->distance[i * g->k + g->k - 1];
  return (g->n == 2 ? 2 * radius : pi * radius * radius) / (double)(g->k + 1);
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
    double area = batten_orient_area(g, i);
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
