/* Pairs of triangles that have more in common than the corners they share.
 *
 * Candidates come from a tree of boxes (split at the median of the centres, nodes in preorder, so that a search is
 * one pass with skips). A pair is decided by exact orientation signs alone. Corners count as shared when they lie at
 * the same place, whatever their indices. What two triangles share beyond that is found at the edges that lie
 * opposite the shared corners: the common part of two triangles is convex, so if it is more than the shared
 * corner, it reaches the far edge of one of them. */
#include "mesh_inner.h"

#include "base/checked.h"
#include "predicates.h"
#include "vec.h"

#include <stdbool.h>
#include <string.h>

enum { LEAF = 4, DEPTH_MAX = 64, TASK_TRIANGLES = 2048 };

typedef struct box {
  double lower[3], upper[3];
} box;

typedef struct node {
  box box;
  uint32_t first, count; /* triangles order[first .. first + count) below it */
  uint32_t skip;         /* the node after its subtree */
  bool leaf;
} node;

typedef const double *corners[3];

/* ---- one pair ----------------------------------------------------------------------------------- */

static bool same_place(const double *a, const double *b) { return a[0] == b[0] && a[1] == b[1] && a[2] == b[2]; }

/* Picks the coordinate plane (x, y) in which the triangle keeps its area and returns its turn there; 0: it has none.
 */
static int projection(const double *a, const double *b, const double *c, int *x, int *y) {
  for (int k = 0; k < 3; k++) {
    *x = (k + 1) % 3;
    *y = (k + 2) % 3;
    int sign = batten_orient2d(a, b, c, *x, *y);
    if (sign) return sign;
  }
  return 0;
}

static bool point_in_segment_box(const double *p, const double *a, const double *b, int x, int y) {
  return p[x] >= fmin(a[x], b[x]) && p[x] <= fmax(a[x], b[x]) && p[y] >= fmin(a[y], b[y]) && p[y] <= fmax(a[y], b[y]);
}

/* Closed segments in the plane (x, y). */
static bool segments_meet(const double *a, const double *b, const double *c, const double *d, int x, int y) {
  int sc = batten_orient2d(a, b, c, x, y), sd = batten_orient2d(a, b, d, x, y);
  int sa = batten_orient2d(c, d, a, x, y), sb = batten_orient2d(c, d, b, x, y);
  if (sc * sd < 0 && sa * sb < 0) return true;
  return (sc == 0 && point_in_segment_box(c, a, b, x, y)) || (sd == 0 && point_in_segment_box(d, a, b, x, y)) ||
         (sa == 0 && point_in_segment_box(a, c, d, x, y)) || (sb == 0 && point_in_segment_box(b, c, d, x, y));
}

static bool coplanar_segment_meets(const double *p, const double *q, const double *const *t) {
  int x, y, turn = projection(t[0], t[1], t[2], &x, &y);
  bool inside = true;
  for (int k = 0; k < 3; k++) {
    const double *a = t[k], *b = t[(k + 1) % 3];
    if (segments_meet(p, q, a, b, x, y)) return true;
    inside = inside && batten_orient2d(a, b, p, x, y) * turn >= 0;
  }
  return inside;
}

/* Closed segment p q and closed triangle t, which has an area. */
static bool segment_meets(const double *p, const double *q, const double *const *t) {
  int sp = batten_orient3d(t[0], t[1], t[2], p), sq = batten_orient3d(t[0], t[1], t[2], q);
  if (sp * sq > 0) return false;
  if (sp == 0 && sq == 0) return coplanar_segment_meets(p, q, t);
  bool positive = false, negative = false;
  for (int k = 0; k < 3; k++) {
    int side = batten_orient3d(p, q, t[k], t[(k + 1) % 3]);
    positive = positive || side > 0;
    negative = negative || side < 0;
  }
  return !(positive && negative);
}

/* Triangles on the edge a b with tips c and d: they overlap when they are folded flat onto each other. Plain doubles
 * tell when they are far from that: the tips, seen from the edge, are more than 26 degrees apart. */
static bool folded(const double *a, const double *b, const double *c, const double *d) {
  double e[3], u[3], v[3];
  vec_sub(b, a, e);
  vec_sub(c, a, u);
  vec_sub(d, a, v);
  double ee = vec_dot(e, e), along_u = vec_dot(u, e) / ee, along_v = vec_dot(v, e) / ee;
  for (int k = 0; k < 3; k++) {
    u[k] -= along_u * e[k];
    v[k] -= along_v * e[k];
  }
  double uv = vec_dot(u, v), uu = vec_dot(u, u), vv = vec_dot(v, v), size = vec_dot(c, c) + vec_dot(d, d);
  /* Sides that rounding could have made are left to the exact test. */
  bool certain = uu > 1e-20 * size && vv > 1e-20 * size && ee > 1e-20 * size;
  if (certain && (uv <= 0 || uv * uv < 0.8 * uu * vv)) return false;
  if (batten_orient3d(a, b, c, d) != 0) return false;
  int x, y, side = projection(a, b, c, &x, &y);
  return batten_orient2d(a, b, d, x, y) == side;
}

/* Triangles at a with far edges b c and d e: does the plane across the difference of their directions part them? Then
 * they share a alone. Plain doubles, with a margin far above rounding; no is no answer. */
static bool parted(const double *a, const double *b, const double *c, const double *d, const double *e) {
  const double *ends[4] = {b, c, d, e};
  double u[4][3], n[3] = {0, 0, 0};
  for (int i = 0; i < 4; i++) {
    vec_sub(ends[i], a, u[i]);
    if (!vec_normalize(u[i])) return false;
    for (int k = 0; k < 3; k++) n[k] += i < 2 ? u[i][k] : -u[i][k];
  }
  for (int i = 0; i < 4; i++)
    if (!((i < 2 ? 1 : -1) * vec_dot(n, u[i]) > 1e-3)) return false;
  return true;
}

static bool cross(const double *const *s, const double *const *t) {
  int partner[3], shared = 0; /* partner[i]: corner of t at the place of corner i of s, or -1 */
  bool taken[3] = {false, false, false};
  for (int i = 0; i < 3; i++) {
    partner[i] = -1;
    for (int j = 0; j < 3; j++)
      if (!taken[j] && same_place(s[i], t[j])) partner[i] = j;
    if (partner[i] >= 0) {
      taken[partner[i]] = true;
      shared++;
    }
  }
  if (shared == 3) return true;
  for (int i = 0; i < 3; i++) {
    int n = (i + 1) % 3, l = (i + 2) % 3;
    if (shared == 2 && partner[i] < 0) return folded(s[n], s[l], s[i], t[3 - partner[n] - partner[l]]);
    if (shared == 1 && partner[i] >= 0) {
      int j = partner[i];
      if (parted(s[i], s[n], s[l], t[(j + 1) % 3], t[(j + 2) % 3])) return false;
      return segment_meets(s[n], s[l], t) || segment_meets(t[(j + 1) % 3], t[(j + 2) % 3], s);
    }
    if (shared == 0 && (segment_meets(s[i], s[n], t) || segment_meets(t[i], t[n], s))) return true;
  }
  return false;
}

/* ---- the tree ----------------------------------------------------------------------------------- */

typedef struct box_tree {
  uint32_t *order; /* [count] triangles */
  size_t count;
  node *nodes;
  uint32_t node_count;
  const double *vertices;
  const uint32_t *triangles;
} box_tree;

static void triangle_corners(const box_tree *tree, uint32_t t, corners out) {
  for (size_t k = 0; k < 3; k++) out[k] = tree->vertices + 3 * (size_t)tree->triangles[3 * (size_t)t + k];
}

static void box_add(box *b, const double *p) {
  for (int k = 0; k < 3; k++) {
    b->lower[k] = fmin(b->lower[k], p[k]);
    b->upper[k] = fmax(b->upper[k], p[k]);
  }
}

static box triangle_box(const box_tree *tree, uint32_t t) {
  box b = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
  corners c;
  triangle_corners(tree, t, c);
  for (int k = 0; k < 3; k++) box_add(&b, c[k]);
  return b;
}

static bool boxes_meet(const box *a, const box *b) {
  for (int k = 0; k < 3; k++)
    if (a->upper[k] < b->lower[k] || b->upper[k] < a->lower[k]) return false;
  return true;
}

static double centre(const box_tree *tree, uint32_t t, int axis) {
  corners c;
  triangle_corners(tree, t, c);
  return c[0][axis] / 3 + c[1][axis] / 3 + c[2][axis] / 3;
}

static bool before(const box_tree *tree, uint32_t s, uint32_t t, int axis) {
  double a = centre(tree, s, axis), b = centre(tree, t, axis);
  return a < b || (a == b && s < t);
}

/* Brings the lower half of order[0 .. count) along the axis to the front: quickselect, middle as pivot. */
static void split_at_median(const box_tree *tree, uint32_t *order, uint32_t count, int axis) {
  uint32_t low = 0, high = count - 1, wanted = count / 2;
  while (low < high) {
    uint32_t pivot = order[low + (high - low) / 2], i = low, j = high;
    for (;;) {
      while (before(tree, order[i], pivot, axis)) i++;
      while (before(tree, pivot, order[j], axis)) j--;
      if (i >= j) break;
      uint32_t t = order[i];
      order[i++] = order[j];
      order[j--] = t;
    }
    if (j >= wanted)
      high = j;
    else
      low = j + 1;
  }
}

static box box_of(const box_tree *tree, uint32_t first, uint32_t count) {
  box all = triangle_box(tree, tree->order[first]);
  for (uint32_t i = 1; i < count; i++) {
    box b = triangle_box(tree, tree->order[first + i]);
    box_add(&all, b.lower);
    box_add(&all, b.upper);
  }
  return all;
}

static void build(box_tree *tree) {
  struct {
    uint32_t first, count;
  } stack[DEPTH_MAX];
  int depth = 0;
  stack[depth].first = 0;
  stack[depth].count = (uint32_t)tree->count;
  depth++;
  while (depth > 0) {
    uint32_t first = stack[--depth].first, count = stack[depth].count, id = tree->node_count++;
    node *n = tree->nodes + id;
    *n = (node){.box = box_of(tree, first, count), .first = first, .count = count, .leaf = count <= LEAF};
    if (n->leaf) continue;
    int axis = 0;
    for (int k = 1; k < 3; k++)
      if (n->box.upper[k] - n->box.lower[k] > n->box.upper[axis] - n->box.lower[axis]) axis = k;
    split_at_median(tree, tree->order + first, count, axis);
    uint32_t half = count / 2;
    stack[depth].first = first + half;
    stack[depth++].count = count - half;
    stack[depth].first = first;
    stack[depth++].count = half;
  }
  /* Preorder: a subtree ends where the next node begins after its last triangle. */
  for (uint32_t i = tree->node_count; i-- > 0;) {
    node *n = tree->nodes + i;
    n->skip = i + 1;
    if (!n->leaf) n->skip = tree->nodes[tree->nodes[i + 1].skip].skip;
  }
}

/* ---- all pairs ---------------------------------------------------------------------------------- */

typedef struct search {
  box_tree tree;
  size_t *pairs;      /* [tasks] */
  unsigned char *hit; /* [F] by triangle; only its own task writes it */
} search;

static void search_one(search *s, uint32_t t, size_t *pairs) {
  const box_tree *tree = &s->tree;
  corners a, b;
  triangle_corners(tree, t, a);
  box own = triangle_box(tree, t);
  for (uint32_t i = 0; i < tree->node_count;) {
    const node *n = tree->nodes + i;
    bool near = boxes_meet(&own, &n->box);
    for (uint32_t j = 0; near && n->leaf && j < n->count; j++) {
      uint32_t u = tree->order[n->first + j];
      box other = triangle_box(tree, u);
      if (u == t || !boxes_meet(&own, &other)) continue;
      triangle_corners(tree, u, b);
      if (!cross(a, b)) continue;
      s->hit[t] = 1;
      *pairs += u < t;
    }
    i = near ? i + 1 : n->skip;
  }
}

static void search_task(void *arg, size_t task) {
  search *s = arg;
  size_t pairs = 0, end = (task + 1) * TASK_TRIANGLES < s->tree.count ? (task + 1) * TASK_TRIANGLES : s->tree.count;
  for (size_t i = task * TASK_TRIANGLES; i < end; i++) search_one(s, s->tree.order[i], &pairs);
  s->pairs[task] = pairs;
}

/* A copy of the vertices in a power-of-two unit near their size: exact, and the determinants stay in range. */
static double *scaled_copy(batten_context *ctx, size_t vertex_count, const double *vertices) {
  double *copy = batten_alloc_array(ctx, vertex_count, 3 * sizeof *copy), size = 0;
  if (!copy) return NULL;
  int exponent = 0;
  for (size_t i = 0; i < 3 * vertex_count; i++) size = fmax(size, fabs(vertices[i]));
  frexp(size, &exponent);
  for (size_t i = 0; i < 3 * vertex_count; i++) copy[i] = ldexp(vertices[i], -exponent);
  return copy;
}

batten_status batten_mesh_find_crossings(batten_context *ctx, size_t vertex_count, const double *vertices,
                                         size_t triangle_count, const uint32_t *triangles, unsigned char *marks,
                                         size_t *pairs) {
  batten_status st = BATTEN_E_NOMEM;
  double *copy = scaled_copy(ctx, vertex_count, vertices);
  search s = {.tree = {.vertices = copy, .triangles = triangles}};
  if (!copy) goto done;
  s.tree.order = batten_alloc_array(ctx, triangle_count, sizeof *s.tree.order);
  if (!s.tree.order) goto done;
  s.hit = batten_alloc_array(ctx, triangle_count, 1);
  if (!s.hit) goto done;
  for (uint32_t t = 0; t < triangle_count; t++) {
    corners c;
    int x, y;
    s.hit[t] = 0;
    triangle_corners(&s.tree, t, c);
    if (projection(c[0], c[1], c[2], &x, &y)) s.tree.order[s.tree.count++] = t; /* those without area stay out */
  }
  size_t tasks = (s.tree.count + TASK_TRIANGLES - 1) / TASK_TRIANGLES, total = 0;
  s.tree.nodes = batten_alloc_array(ctx, s.tree.count + 1, sizeof *s.tree.nodes);
  if (!s.tree.nodes) goto done;
  s.pairs = batten_alloc_array(ctx, tasks, sizeof *s.pairs);
  if (!s.pairs) goto done;
  if (s.tree.count) build(&s.tree);
  batten_parallel(ctx, tasks, search_task, &s);
  for (size_t i = 0; i < tasks; i++) total += s.pairs[i];
  if (marks && triangle_count) memcpy(marks, s.hit, triangle_count);
  *pairs = total;
  st = BATTEN_OK;
done:
  batten_free(ctx, s.pairs);
  batten_free(ctx, s.tree.nodes);
  batten_free(ctx, s.hit);
  batten_free(ctx, s.tree.order);
  batten_free(ctx, copy);
  return st;
}

batten_status batten_mesh_self_intersections(batten_context *ctx, const batten_mesh *mesh, size_t *pairs) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!mesh || !pairs)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a mesh and room for the count",
                       mesh ? "pairs" : "mesh");
  return batten_mesh_find_crossings(ctx, mesh->vertex_count, mesh->vertices, mesh->triangle_count, mesh->triangles,
                                    NULL, pairs);
}
