/* Distances of points to the triangles of a mesh, by a tree of the triangles' boxes. Shared by tests that compare
 * surfaces. */
#ifndef MESH_DISTANCE_H
#define MESH_DISTANCE_H

#include <batten/mesh.h>
#include <math.h>
#include <stdlib.h>

/* A node of leaves [from, to) has the children node + 1 with its first half and node + 2 (middle - from) with the
 * rest: lower and upper of each node's box. */
typedef struct mesh_tree {
  const double *vertices;
  const uint32_t *triangles;
  size_t count;
  struct mesh_leaf {
    double middle[3];
    size_t triangle;
  } * leaves;         /* [count] */
  double (*boxes)[6]; /* [2 count - 1] */
} mesh_tree;

static inline int mesh_compare_x(const void *a, const void *b) {
  const double *p = ((const struct mesh_leaf *)a)->middle, *q = ((const struct mesh_leaf *)b)->middle;
  return (p[0] > q[0]) - (p[0] < q[0]);
}
static inline int mesh_compare_y(const void *a, const void *b) {
  const double *p = ((const struct mesh_leaf *)a)->middle, *q = ((const struct mesh_leaf *)b)->middle;
  return (p[1] > q[1]) - (p[1] < q[1]);
}
static inline int mesh_compare_z(const void *a, const void *b) {
  const double *p = ((const struct mesh_leaf *)a)->middle, *q = ((const struct mesh_leaf *)b)->middle;
  return (p[2] > q[2]) - (p[2] < q[2]);
}

/* Recursion of a test's own, log2(count) deep. */
static inline void mesh_tree_split(mesh_tree *t, size_t node, size_t from, size_t to) {
  static int (*const compare[3])(const void *, const void *) = {mesh_compare_x, mesh_compare_y, mesh_compare_z};
  double *box = t->boxes[node];
  for (size_t k = 0; k < 3; k++) {
    box[k] = INFINITY;
    box[3 + k] = -INFINITY;
    for (size_t i = from; i < to; i++)
      for (size_t j = 0; j < 3; j++) {
        double x = t->vertices[3 * (size_t)t->triangles[3 * t->leaves[i].triangle + j] + k];
        box[k] = fmin(box[k], x);
        box[3 + k] = fmax(box[3 + k], x);
      }
  }
  if (to - from == 1) return;
  size_t axis = 0, middle = from + (to - from) / 2;
  for (size_t k = 1; k < 3; k++)
    if (box[3 + k] - box[k] > box[3 + axis] - box[axis]) axis = k;
  qsort(t->leaves + from, to - from, sizeof *t->leaves, compare[axis]);
  mesh_tree_split(t, node + 1, from, middle);
  mesh_tree_split(t, node + 2 * (middle - from), middle, to);
}

static inline double mesh_box_distance2(const double *box, const double *p) {
  double sum = 0;
  for (size_t k = 0; k < 3; k++) {
    double d = fmax(0, fmax(box[k] - p[k], p[k] - box[3 + k]));
    sum += d * d;
  }
  return sum;
}

static inline double mesh_dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Squared distance of a point to a segment from a along e. */
static inline double mesh_segment_distance2(const double *p, const double *a, const double *e) {
  double w[3] = {p[0] - a[0], p[1] - a[1], p[2] - a[2]}, ee = mesh_dot(e, e);
  double t = ee > 0 ? fmin(1, fmax(0, mesh_dot(w, e) / ee)) : 0;
  for (int k = 0; k < 3; k++) w[k] -= t * e[k];
  return mesh_dot(w, w);
}

static inline double mesh_triangle_distance2(const double *p, const double *a, const double *b, const double *c) {
  double u[3], v[3], w[3], bc[3];
  for (int k = 0; k < 3; k++) {
    u[k] = b[k] - a[k];
    v[k] = c[k] - a[k];
    w[k] = p[k] - a[k];
    bc[k] = c[k] - b[k];
  }
  double uu = mesh_dot(u, u), uv = mesh_dot(u, v), vv = mesh_dot(v, v), wu = mesh_dot(w, u), wv = mesh_dot(w, v);
  double d = uu * vv - uv * uv, s = (vv * wu - uv * wv) / d, t = (uu * wv - uv * wu) / d;
  if (d > 0 && s >= 0 && t >= 0 && s + t <= 1) {
    for (int k = 0; k < 3; k++) w[k] -= s * u[k] + t * v[k];
    return mesh_dot(w, w);
  }
  return fmin(mesh_segment_distance2(p, a, u),
              fmin(mesh_segment_distance2(p, a, v), mesh_segment_distance2(p, b, bc)));
}

static inline double mesh_tree_distance(const mesh_tree *t, const double *p) {
  struct {
    size_t node, from, to;
    double reach;
  } open[128] = {{0, 0, t->count, mesh_box_distance2(t->boxes[0], p)}};
  size_t waiting = 1;
  double least = INFINITY;
  while (waiting > 0) {
    size_t node = open[--waiting].node, from = open[waiting].from, to = open[waiting].to;
    if (open[waiting].reach >= least) continue;
    if (to - from == 1) {
      const uint32_t *c = t->triangles + 3 * t->leaves[from].triangle;
      const double *x = t->vertices;
      least =
          fmin(least, mesh_triangle_distance2(p, x + 3 * (size_t)c[0], x + 3 * (size_t)c[1], x + 3 * (size_t)c[2]));
      continue;
    }
    size_t middle = from + (to - from) / 2, child[2] = {node + 1, node + 2 * (middle - from)};
    double reach[2] = {mesh_box_distance2(t->boxes[child[0]], p), mesh_box_distance2(t->boxes[child[1]], p)};
    for (unsigned turn = 0; turn < 2; turn++) { /* the nearer one last, so that it is next */
      unsigned c = (reach[0] > reach[1]) == (turn == 0) ? 0 : 1;
      open[waiting].node = child[c];
      open[waiting].from = c ? middle : from;
      open[waiting].to = c ? to : middle;
      open[waiting++].reach = reach[c];
    }
  }
  return sqrt(least);
}

/* Mean and largest distance of points [count][3] to a mesh; NaN where it has no triangle. */
static inline void mesh_distance(const batten_mesh *mesh, size_t count, const double *points, double *mean,
                                 double *most) {
  mesh_tree t = {batten_mesh_vertices(mesh), batten_mesh_triangles(mesh), batten_mesh_triangle_count(mesh), NULL,
                 NULL};
  t.leaves = malloc((t.count + 1) * sizeof *t.leaves);
  t.boxes = malloc((2 * t.count + 1) * sizeof *t.boxes);
  *mean = *most = t.leaves && t.boxes && t.count ? 0 : NAN;
  for (size_t i = 0; *mean == 0 && i < t.count; i++) {
    t.leaves[i].triangle = i;
    for (size_t k = 0; k < 3; k++) {
      t.leaves[i].middle[k] = 0;
      for (size_t j = 0; j < 3; j++) t.leaves[i].middle[k] += t.vertices[3 * (size_t)t.triangles[3 * i + j] + k] / 3;
    }
  }
  if (*mean == 0) mesh_tree_split(&t, 0, 0, t.count);
  for (size_t i = 0; !isnan(*mean) && i < count; i++) {
    double d = mesh_tree_distance(&t, points + 3 * i);
    *mean += d / (double)count;
    *most = fmax(*most, d);
  }
  free(t.leaves);
  free(t.boxes);
}

#endif
