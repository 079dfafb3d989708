/* Pairs of triangles that have more in common than the corners they share.
 *
 * Candidates come from a perfect binary tree of boxes, split at the medians of the centres. Node h has the children
 * 2 h and 2 h + 1, and what follows the subtree of h in a walk over all is (h + 1) without its trailing zeros, so no
 * links are stored. Each leaf looks for others behind itself only: every pair comes once. A pair is decided by exact
 * orientation signs alone. Corners count as shared when they lie at the same place, whatever their indices. What two
 * triangles share beyond that is found at the edges that lie opposite the shared corners: the common part of two
 * triangles is convex, so if it is more than the shared corner, it reaches the far edge of one of them. */
#include "mesh_inner.h"

#include "base/checked.h"
#include "predicates.h"
#include "vec.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <string.h>

enum {
  LEAF = 8, /* triangles at most; half of it at least, but in the smallest trees */
  TASK_LEAVES = 256,
  TASK_ITEMS = 8192, /* vertices or triangles */
  TASKS = 256,       /* between two calls of progress: some 0.3 s */
  LEVELS_ALONE = 6,  /* halved one level after the other, the 2^6 parts below side by side, */
  PARTS_STEP = 32    /* these between two calls of progress */
};

typedef struct box {
  double lower[3], upper[3];
} box;

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

typedef struct item {
  double centre[3]; /* 3 times */
  uint32_t triangle;
} item;

typedef struct search {
  const double *vertices; /* [V][3] scaled */
  const uint32_t *triangles;
  size_t vertex_count, triangle_count;
  size_t count;      /* of the triangles that have an area */
  item *items;       /* [count] while the tree is made */
  uint32_t *order;   /* [count] triangles in the order of the leaves */
  unsigned depth;    /* leaf j: node 2^depth + j, the triangles order[first_of(depth, j) .. first_of(depth, j + 1)) */
  box *boxes;        /* [2^(depth + 1)] by node, from 1 */
  size_t *pairs;     /* [tasks] */
  atomic_uchar *hit; /* [F] by triangle: NO_AREA, or whether it takes part */
  double scale[2];   /* whose product is the power of two */
  const double *source;
  double *copy;
  size_t first_task;
  unsigned level;
} search;

enum { NO_AREA = 2 };

static void triangle_corners(const search *s, uint32_t t, corners out) {
  for (size_t k = 0; k < 3; k++) out[k] = s->vertices + 3 * (size_t)s->triangles[3 * (size_t)t + k];
}

static box triangle_box(const search *s, uint32_t t) {
  box b;
  corners c;
  triangle_corners(s, t, c);
  for (int k = 0; k < 3; k++) {
    double x = c[0][k], y = c[1][k], z = c[2][k], low = x < y ? x : y, high = x < y ? y : x;
    b.lower[k] = low < z ? low : z;
    b.upper[k] = high > z ? high : z;
  }
  return b;
}

static void box_join(box *b, const box *other) {
  for (int k = 0; k < 3; k++) {
    if (other->lower[k] < b->lower[k]) b->lower[k] = other->lower[k];
    if (other->upper[k] > b->upper[k]) b->upper[k] = other->upper[k];
  }
}

static bool boxes_meet(const box *a, const box *b) {
  for (int k = 0; k < 3; k++)
    if (a->upper[k] < b->lower[k] || b->upper[k] < a->lower[k]) return false;
  return true;
}

static bool before(const item *a, const item *b, int axis) {
  return a->centre[axis] < b->centre[axis] || (a->centre[axis] == b->centre[axis] && a->triangle < b->triangle);
}

/* Brings the `wanted` first ones along the axis to the front: quickselect, middle as pivot. */
static void split_at(item *items, size_t count, size_t wanted, int axis) {
  size_t low = 0, high = count - 1;
  while (low < high) {
    item pivot = items[low + (high - low) / 2];
    size_t i = low, j = high;
    for (;;) {
      while (before(items + i, &pivot, axis)) i++;
      while (before(&pivot, items + j, axis)) j--;
      if (i >= j) break;
      item t = items[i];
      items[i++] = items[j];
      items[j--] = t;
    }
    if (j >= wanted)
      high = j;
    else
      low = j + 1;
  }
}

static int longest_axis(const item *items, size_t count) {
  double lower[3], upper[3];
  memcpy(lower, items->centre, sizeof lower);
  memcpy(upper, items->centre, sizeof upper);
  for (size_t i = 1; i < count; i++)
    for (int k = 0; k < 3; k++) {
      double x = items[i].centre[k];
      if (x < lower[k]) lower[k] = x;
      if (x > upper[k]) upper[k] = x;
    }
  int axis = 0;
  for (int k = 1; k < 3; k++)
    if (upper[k] - lower[k] > upper[axis] - lower[axis]) axis = k;
  return axis;
}

/* Where part j of the 2^level parts begins. */
static size_t first_of(const search *s, unsigned level, size_t j) {
  return (size_t)((uint64_t)j * s->count >> level); /* both below 2^32 */
}

static void halve(const search *s, unsigned level, size_t j) {
  size_t first = first_of(s, level, j), count = first_of(s, level, j + 1) - first;
  size_t half = first_of(s, level + 1, 2 * j + 1) - first;
  split_at(s->items + first, count, half, longest_axis(s->items + first, count));
}

static void halve_task(void *arg, size_t j) {
  const search *s = arg;
  halve(s, s->level, j);
}

/* All below part j of the present level, and the boxes of its leaves. */
static void finish_task(void *arg, size_t task) {
  const search *s = arg;
  const size_t j = s->first_task + task;
  for (unsigned level = s->level; level < s->depth; level++)
    for (size_t i = j << (level - s->level); i < (j + 1) << (level - s->level); i++) halve(s, level, i);
  for (size_t leaf = j << (s->depth - s->level); leaf < (j + 1) << (s->depth - s->level); leaf++) {
    size_t first = first_of(s, s->depth, leaf), end = first_of(s, s->depth, leaf + 1);
    box all = triangle_box(s, s->items[first].triangle);
    for (size_t i = first; i < end; i++) {
      box one = triangle_box(s, s->items[i].triangle);
      box_join(&all, &one);
      s->order[i] = s->items[i].triangle;
    }
    s->boxes[((size_t)1 << s->depth) + leaf] = all;
  }
}

static batten_status build(batten_context *ctx, search *s) {
  batten_status st = BATTEN_OK;
  unsigned alone = s->depth < LEVELS_ALONE ? s->depth : LEVELS_ALONE;
  for (s->level = 0; st >= 0 && s->level < alone; s->level++) {
    batten_parallel(ctx, (size_t)1 << s->level, halve_task, s);
    st = batten_progress(ctx, "crossings", 0.05 * (1 + s->level));
  }
  if (st < 0) return st;
  const size_t parts = (size_t)1 << s->level;
  for (s->first_task = 0; st >= 0 && s->first_task < parts; s->first_task += PARTS_STEP) {
    size_t left = parts - s->first_task;
    batten_parallel(ctx, left < PARTS_STEP ? left : PARTS_STEP, finish_task, s);
    st = batten_progress(ctx, "crossings", 0.3 + 0.1 * (double)s->first_task / (double)parts);
  }
  if (st < 0) return st;
  for (size_t h = (size_t)1 << s->depth; h-- > 1;) {
    s->boxes[h] = s->boxes[2 * h];
    box_join(s->boxes + h, s->boxes + 2 * h + 1);
  }
  return batten_progress(ctx, "crossings", 0.4);
}

/* ---- all pairs ---------------------------------------------------------------------------------- */

static void meet(const search *s, uint32_t t, const double *const *a, uint32_t u, size_t *pairs) {
  corners b;
  triangle_corners(s, u, b);
  if (!cross(a, b)) return;
  atomic_store_explicit(s->hit + t, 1, memory_order_relaxed); /* several tasks may, but the same */
  atomic_store_explicit(s->hit + u, 1, memory_order_relaxed);
  ++*pairs;
}

static void search_leaf(const search *s, size_t leaf, size_t *pairs) {
  size_t first = first_of(s, s->depth, leaf), count = first_of(s, s->depth, leaf + 1) - first;
  const size_t leaves = (size_t)1 << s->depth;
  const box *own = s->boxes + leaves + leaf;
  const uint32_t *t = s->order + first;
  box boxes[LEAF];
  corners a[LEAF];
  for (size_t i = 0; i < count; i++) {
    boxes[i] = triangle_box(s, t[i]);
    triangle_corners(s, t[i], a[i]);
    for (size_t j = 0; j < i; j++)
      if (boxes_meet(boxes + i, boxes + j)) meet(s, t[j], a[j], t[i], pairs);
  }
  for (size_t h = leaves + leaf;;) {
    for (h++; !(h & 1);) h >>= 1;
    if (h == 1) return;
    while (h < leaves && boxes_meet(own, s->boxes + h)) h *= 2;
    if (!boxes_meet(own, s->boxes + h)) continue;
    size_t from = first_of(s, s->depth, h - leaves), to = first_of(s, s->depth, h - leaves + 1);
    for (size_t j = from; j < to; j++) {
      box other = triangle_box(s, s->order[j]);
      if (!boxes_meet(own, &other)) continue;
      for (size_t i = 0; i < count; i++)
        if (boxes_meet(boxes + i, &other)) meet(s, t[i], a[i], s->order[j], pairs);
    }
  }
}

static void search_task(void *arg, size_t task) {
  search *s = arg;
  size_t pairs = 0, leaves = (size_t)1 << s->depth, first = (s->first_task + task) * TASK_LEAVES;
  for (size_t i = first; i < leaves && i < first + TASK_LEAVES; i++) search_leaf(s, i, &pairs);
  s->pairs[s->first_task + task] = pairs;
}

static batten_status search_all(batten_context *ctx, search *s, size_t tasks, size_t *total) {
  *total = 0;
  for (s->first_task = 0; s->first_task < tasks; s->first_task += TASKS) {
    size_t now = tasks - s->first_task < TASKS ? tasks - s->first_task : TASKS;
    batten_parallel(ctx, now, search_task, s);
    for (size_t i = 0; i < now; i++) *total += s->pairs[s->first_task + i];
    batten_status st = batten_progress(ctx, "crossings", 0.4 + 0.6 * (double)(s->first_task + now) / (double)tasks);
    if (st < 0) return st;
  }
  return BATTEN_OK;
}

static void scale_task(void *arg, size_t task) {
  const search *s = arg;
  size_t end = 3 * (task + 1) * TASK_ITEMS;
  if (end > 3 * s->vertex_count) end = 3 * s->vertex_count;
  for (size_t i = 3 * task * TASK_ITEMS; i < end; i++) s->copy[i] = s->source[i] * s->scale[0] * s->scale[1];
}

/* A copy of the vertices in a power-of-two unit near their size: exact, and the determinants stay in range. */
static batten_status take_scaled(batten_context *ctx, search *s) {
  s->copy = batten_alloc_array(ctx, s->vertex_count, 3 * sizeof *s->copy);
  if (!s->copy) return BATTEN_E_NOMEM;
  int exponent = 0;
  double size = batten_mesh_size(s->vertex_count, s->source);
  frexp(size, &exponent);
  s->scale[0] = ldexp(1, -exponent / 2); /* the whole might overflow */
  s->scale[1] = ldexp(1, -exponent - -exponent / 2);
  batten_parallel(ctx, (s->vertex_count + TASK_ITEMS - 1) / TASK_ITEMS, scale_task, s);
  s->vertices = s->copy;
  return BATTEN_OK;
}

static void area_task(void *arg, size_t task) {
  const search *s = arg;
  size_t end = (task + 1) * TASK_ITEMS < s->triangle_count ? (task + 1) * TASK_ITEMS : s->triangle_count;
  for (size_t t = task * TASK_ITEMS; t < end; t++) {
    corners c;
    int x, y;
    triangle_corners(s, (uint32_t)t, c);
    atomic_init(s->hit + t, projection(c[0], c[1], c[2], &x, &y) ? 0 : NO_AREA);
  }
}

static void centre_task(void *arg, size_t task) {
  const search *s = arg;
  size_t end = (task + 1) * TASK_ITEMS < s->count ? (task + 1) * TASK_ITEMS : s->count;
  for (size_t i = task * TASK_ITEMS; i < end; i++) {
    corners c;
    triangle_corners(s, s->items[i].triangle, c);
    for (int k = 0; k < 3; k++) s->items[i].centre[k] = c[0][k] + c[1][k] + c[2][k];
  }
}

/* The triangles that have an area, in a tree. */
static batten_status take_triangles(batten_context *ctx, search *s) {
  s->hit = batten_alloc_array(ctx, s->triangle_count, sizeof *s->hit);
  if (!s->hit) return BATTEN_E_NOMEM;
  batten_parallel(ctx, (s->triangle_count + TASK_ITEMS - 1) / TASK_ITEMS, area_task, s);
  for (size_t t = 0; t < s->triangle_count; t++) s->count += atomic_load(s->hit + t) != NO_AREA;
  while (s->count > (size_t)LEAF << s->depth) s->depth++;
  s->items = batten_alloc_array(ctx, s->count, sizeof *s->items);
  s->order = s->items ? batten_alloc_array(ctx, s->count, sizeof *s->order) : NULL;
  s->boxes = s->order ? batten_alloc_array(ctx, (size_t)2 << s->depth, sizeof *s->boxes) : NULL;
  if (!s->boxes) return BATTEN_E_NOMEM;
  for (size_t t = 0, i = 0; t < s->triangle_count; t++)
    if (atomic_load(s->hit + t) != NO_AREA) s->items[i++].triangle = (uint32_t)t;
  batten_parallel(ctx, (s->count + TASK_ITEMS - 1) / TASK_ITEMS, centre_task, s);
  batten_status st = s->count ? build(ctx, s) : BATTEN_OK;
  batten_free(ctx, s->items);
  s->items = NULL;
  return st;
}

batten_status batten_mesh_find_crossings(batten_context *ctx, size_t vertex_count, const double *vertices,
                                         size_t triangle_count, const uint32_t *triangles, unsigned char *marks,
                                         size_t *pairs) {
  search s = {
      .source = vertices, .triangles = triangles, .vertex_count = vertex_count, .triangle_count = triangle_count};
  size_t total = 0;
  batten_status st = batten_progress(ctx, "crossings", 0);
  if (st >= 0) st = take_scaled(ctx, &s);
  if (st >= 0) st = take_triangles(ctx, &s);
  if (st < 0) goto done;
  size_t tasks = (((size_t)1 << s.depth) + TASK_LEAVES - 1) / TASK_LEAVES;
  st = BATTEN_E_NOMEM;
  s.pairs = batten_alloc_array(ctx, tasks, sizeof *s.pairs);
  if (!s.pairs) goto done;
  st = s.count ? search_all(ctx, &s, tasks, &total) : BATTEN_OK;
  if (st < 0) goto done;
  for (size_t t = 0; marks && t < triangle_count; t++) marks[t] = atomic_load(s.hit + t) == 1;
  *pairs = total;
done:
  batten_free(ctx, s.pairs);
  batten_free(ctx, s.boxes);
  batten_free(ctx, s.order);
  batten_free(ctx, s.items);
  batten_free(ctx, s.hit);
  batten_free(ctx, s.copy);
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
