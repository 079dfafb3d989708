/* Fewer triangles by edge collapses in the order of their quadric error [Garland, Heckbert 1997].
 *
 * A vertex carries the squared distances to the planes of the triangles that it stands for, weighted by their area,
 * and to planes across the boundary, so that a boundary keeps its curve; the error of a collapse is the mean of these
 * at the new place. A little of the edge's own length decides where errors are equal: in the plane short edges go
 * first. A collapse is refused where it would change the topology (the link condition [Dey, Edelsbrunner, Guha,
 * Nekhayev 1999], here: no common neighbours but the edge's own, no vertex left with two triangles, no boundary
 * vertices joined across the surface), turn a triangle over, fold a vertex, or leave a sliver; edges that were
 * refused get another chance when all others are through. Ties go by number: the same result everywhere. */
#include <batten/mesh.h>
#include <string.h>

#include "base/checked.h"
#include "mesh_inner.h"
#include "vec.h"

/* Sum of weighted squared distances to planes: x'A x + 2 b'x + c. */
typedef struct quadric {
  double a[6]; /* xx xy xz yy yz zz */
  double b[3], c, weight;
} quadric;

typedef struct heap {
  size_t count;
  uint32_t *edge;  /* [count] half-edge that stands for the edge: the lower of two */
  uint32_t *place; /* [3 F] in edge; MESH_NONE: not there */
  double *cost;    /* [3 F] */
} heap;

typedef struct collapse {
  double error;    /* mean squared distance */
  double point[3]; /* the new place */
  int end;         /* 0, 1: that of an end, which stays where it is; -1: another */
} collapse;

typedef struct decimation {
  size_t vertex_count, triangle_count;
  uint32_t *triangles;   /* [F][3]; MESH_NONE: gone */
  uint32_t *twin;        /* [3 F] MESH_NONE at boundaries */
  uint32_t *out;         /* [V] an outgoing half-edge, at boundaries the first of the fan; MESH_NONE: not in use */
  double *points;        /* [V][3] about the centre, size about 1 */
  uint32_t *source;      /* [V] vertex whose place it has; MESH_NONE: a new one */
  quadric *quadrics;     /* [V] */
  uint32_t *mark, stamp; /* [V] */
  heap heap;
} decimation;

/* ---- queue ----------------------------------------------------------------------------------------- */

static bool sooner(const heap *q, uint32_t e, uint32_t f) {
  return q->cost[e] < q->cost[f] || (q->cost[e] == q->cost[f] && e < f);
}

static void put(heap *q, size_t place, uint32_t e) {
  q->edge[place] = e;
  q->place[e] = (uint32_t)place;
}

/* Moves what is at `place` up or down to where it belongs. */
static void settle(heap *q, size_t place) {
  uint32_t e = q->edge[place];
  while (place > 0 && sooner(q, e, q->edge[(place - 1) / 2])) {
    put(q, place, q->edge[(place - 1) / 2]);
    place = (place - 1) / 2;
  }
  for (;;) {
    size_t child = 2 * place + 1;
    if (child >= q->count) break;
    if (child + 1 < q->count && sooner(q, q->edge[child + 1], q->edge[child])) child++;
    if (!sooner(q, q->edge[child], e)) break;
    put(q, place, q->edge[child]);
    place = child;
  }
  put(q, place, e);
}

static void heap_remove(heap *q, uint32_t e) {
  size_t place = q->place[e];
  if (place == MESH_NONE) return;
  q->place[e] = MESH_NONE;
  uint32_t last = q->edge[--q->count];
  if (last == e) return;
  put(q, place, last);
  settle(q, place);
}

static void heap_insert(heap *q, uint32_t e, double cost) {
  heap_remove(q, e);
  q->cost[e] = cost;
  put(q, q->count++, e);
  settle(q, q->count - 1);
}

/* ---- around a vertex ------------------------------------------------------------------------------- */

static uint32_t start_of(const decimation *d, uint32_t h) { return d->triangles[h]; }
static uint32_t end_of(const decimation *d, uint32_t h) { return d->triangles[mesh_next(h)]; }
static uint32_t edge_of(const decimation *d, uint32_t h) {
  return d->twin[h] != MESH_NONE && d->twin[h] < h ? d->twin[h] : h;
}
static bool on_boundary(const decimation *d, uint32_t v) { return d->twin[d->out[v]] == MESH_NONE; }
/* The next outgoing half-edge, counter-clockwise; MESH_NONE at the end. */
static uint32_t turn(const decimation *d, uint32_t v, uint32_t h) {
  uint32_t next = d->twin[mesh_previous(h)];
  return next == d->out[v] ? MESH_NONE : next;
}

/* h: an outgoing half-edge of v; d->out[v] becomes the first of its fan. */
static void find_first(decimation *d, uint32_t v, uint32_t h) {
  uint32_t first = h;
  while (d->twin[first] != MESH_NONE) {
    first = mesh_next(d->twin[first]);
    if (first == h) break;
  }
  d->out[v] = first;
}

/* ---- quadrics -------------------------------------------------------------------------------------- */

static void add_plane(quadric *q, const double normal[3], const double *point, double weight) {
  double offset = -vec_dot(normal, point);
  for (int i = 0, at = 0; i < 3; i++) {
    for (int j = i; j < 3; j++) q->a[at++] += weight * normal[i] * normal[j];
    q->b[i] += weight * offset * normal[i];
  }
  q->c += weight * offset * offset;
  q->weight += weight;
}

static void add_quadric(quadric *q, const quadric *other) {
  for (int i = 0; i < 6; i++) q->a[i] += other->a[i];
  for (int i = 0; i < 3; i++) q->b[i] += other->b[i];
  q->c += other->c;
  q->weight += other->weight;
}

static double evaluate(const quadric *q, const double *x) {
  double sum = q->c + 2 * vec_dot(q->b, x);
  sum += x[0] * (q->a[0] * x[0] + 2 * (q->a[1] * x[1] + q->a[2] * x[2]));
  sum += x[1] * (q->a[3] * x[1] + 2 * q->a[4] * x[2]) + x[2] * q->a[5] * x[2];
  return sum > 0 && q->weight > 0 ? sum / q->weight : 0;
}

/* The place of least error, held to `near` by a millionth where the planes leave it free. */
static void minimize(const quadric *q, const double near[3], double out[3]) {
  double hold = 1e-6 * (q->a[0] + q->a[3] + q->a[5]);
  double xx = q->a[0] + hold, yy = q->a[3] + hold, zz = q->a[5] + hold, xy = q->a[1], xz = q->a[2], yz = q->a[4];
  double r[3]; /* minus the gradient at near, halved */
  r[0] = -q->b[0] - (q->a[0] * near[0] + xy * near[1] + xz * near[2]);
  r[1] = -q->b[1] - (xy * near[0] + q->a[3] * near[1] + yz * near[2]);
  r[2] = -q->b[2] - (xz * near[0] + yz * near[1] + q->a[5] * near[2]);
  memcpy(out, near, 3 * sizeof *out);
  if (!(hold > 0)) return;
  /* L D L', which exists: positive definite */
  double l10 = xy / xx, l20 = xz / xx, d1 = yy - l10 * xy, e = yz - l20 * xy, l21 = e / d1;
  double d2 = zz - l20 * xz - l21 * e;
  double y0 = r[0], y1 = r[1] - l10 * y0, y2 = r[2] - l20 * y0 - l21 * y1;
  double s2 = y2 / d2, s1 = y1 / d1 - l21 * s2, s0 = y0 / xx - l10 * s1 - l20 * s2;
  if (!isfinite(s0) || !isfinite(s1) || !isfinite(s2)) return;
  out[0] += s0, out[1] += s1, out[2] += s2;
}

static void make_quadrics(decimation *d) {
  const double BOUNDARY = 3; /* a square on the boundary edge counts so many times */
  memset(d->quadrics, 0, d->vertex_count * sizeof *d->quadrics);
  for (uint32_t t = 0; t < d->triangle_count; t++) {
    const uint32_t *v = d->triangles + 3 * (size_t)t;
    double normal[3], across[3], along[3];
    vec_triangle_normal(d->points + 3 * (size_t)v[0], d->points + 3 * (size_t)v[1], d->points + 3 * (size_t)v[2],
                        normal);
    double area = vec_norm(normal) / 2;
    if (!vec_normalize(normal)) continue;
    for (uint32_t k = 0; k < 3; k++) {
      const double *a = d->points + 3 * (size_t)v[k], *b = d->points + 3 * (size_t)v[(k + 1) % 3];
      add_plane(&d->quadrics[v[k]], normal, a, area / 3);
      if (d->twin[3 * t + k] != MESH_NONE) continue;
      vec_sub(b, a, along);
      double square = vec_dot(along, along);
      vec_cross(normal, along, across);
      if (!vec_normalize(across)) continue;
      add_plane(&d->quadrics[v[k]], across, a, BOUNDARY * square);
      add_plane(&d->quadrics[v[(k + 1) % 3]], across, a, BOUNDARY * square);
    }
  }
}

/* Where the collapse of edge h would go. */
static collapse plan(const decimation *d, uint32_t h) {
  uint32_t ends[2] = {start_of(d, h), end_of(d, h)};
  const double *p[2] = {d->points + 3 * (size_t)ends[0], d->points + 3 * (size_t)ends[1]};
  quadric q = d->quadrics[ends[0]];
  collapse best = {.end = -1};
  add_quadric(&q, &d->quadrics[ends[1]]);
  bool fixed[2] = {on_boundary(d, ends[0]), on_boundary(d, ends[1])};
  if (fixed[0] != fixed[1]) { /* onto the boundary, which stays as it is */
    best.end = fixed[1];
    memcpy(best.point, p[best.end], sizeof best.point);
    best.error = evaluate(&q, best.point);
    return best;
  }
  double middle[3];
  for (int k = 0; k < 3; k++) middle[k] = (p[0][k] + p[1][k]) / 2;
  minimize(&q, middle, best.point);
  best.error = evaluate(&q, best.point);
  for (int end = 0; end < 2; end++) {
    double error = evaluate(&q, p[end]);
    if (error > best.error) continue;
    best.error = error;
    best.end = end;
    memcpy(best.point, p[end], sizeof best.point);
  }
  return best;
}

static void queue_edge(decimation *d, uint32_t h) {
  const double SHORT = 1e-6; /* an edge that bends by a thousandth counts as much by its length as by its error */
  const double *a = d->points + 3 * (size_t)start_of(d, h), *b = d->points + 3 * (size_t)end_of(d, h);
  double side[3];
  vec_sub(b, a, side);
  heap_insert(&d->heap, edge_of(d, h), plan(d, h).error + SHORT * vec_dot(side, side));
}

/* ---- guards ---------------------------------------------------------------------------------------- */

static unsigned valence(const decimation *d, uint32_t v) {
  unsigned count = on_boundary(d, v);
  for (uint32_t h = d->out[v]; h != MESH_NONE; h = turn(d, v, h)) count++;
  return count;
}

/* Neighbours of v get the stamp, or are counted when they have it. */
static unsigned visit(decimation *d, uint32_t v, bool count) {
  unsigned met = 0;
  for (uint32_t h = d->out[v]; h != MESH_NONE; h = turn(d, v, h)) {
    uint32_t ends[2] = {end_of(d, h), start_of(d, mesh_previous(h))};
    int both = d->twin[mesh_previous(h)] == MESH_NONE; /* the last of a boundary fan */
    for (int k = 0; k <= both; k++) {
      if (count)
        met += d->mark[ends[k]] == d->stamp;
      else
        d->mark[ends[k]] = d->stamp;
    }
  }
  return met;
}

/* The triangle behind half-edge h would go, its other two edges become one: both must not be boundary, and the vertex
 * between them must keep three edges. */
static bool triangle_may_go(const decimation *d, uint32_t h) {
  uint32_t apex = start_of(d, mesh_previous(h));
  if (d->twin[mesh_next(h)] == MESH_NONE && d->twin[mesh_previous(h)] == MESH_NONE) return false;
  return on_boundary(d, apex) || valence(d, apex) > 3;
}

static bool keeps_topology(decimation *d, uint32_t h) {
  uint32_t a = start_of(d, h), b = end_of(d, h), g = d->twin[h];
  if (g != MESH_NONE && on_boundary(d, a) && on_boundary(d, b)) return false;
  if (!triangle_may_go(d, h) || (g != MESH_NONE && !triangle_may_go(d, g))) return false;
  d->stamp++;
  visit(d, a, false);
  return visit(d, b, true) == (g == MESH_NONE ? 1u : 2u);
}

/* Four times the area's root-free share of an even triangle: 1 for that, 0 for a line. normal: twice the area. */
static double shape(const double *a, const double *b, const double *c, double normal[3]) {
  double u[3], v[3], w[3];
  vec_sub(b, a, u);
  vec_sub(c, b, v);
  vec_sub(a, c, w);
  vec_cross(u, v, normal);
  double squares = vec_dot(u, u) + vec_dot(v, v) + vec_dot(w, w);
  return squares > 0 ? 2 * sqrt(3) * vec_norm(normal) / squares : 0;
}

/* Triangles at v but not at `other`: none may turn over, or become a sliver that is worse than before. */
static bool keeps_shape(const decimation *d, uint32_t v, uint32_t other, const double *point) {
  const double TURN = 0.2, SLIVER = 0.1; /* cosine of 78 degrees; a height of a seventeenth of the side */
  for (uint32_t h = d->out[v]; h != MESH_NONE; h = turn(d, v, h)) {
    uint32_t b = end_of(d, h), c = start_of(d, mesh_previous(h));
    if (b == other || c == other) continue;
    const double *p = d->points + 3 * (size_t)b, *q = d->points + 3 * (size_t)c;
    double before[3], after[3], old = shape(d->points + 3 * (size_t)v, p, q, before), now = shape(point, p, q, after);
    if (now < SLIVER && now < old) return false;
    if (!(vec_dot(before, after) > TURN * vec_norm(before) * vec_norm(after))) return false;
  }
  return true;
}

/* Vertices a and b as they are (point NULL), or both at the point. */
typedef struct joined {
  uint32_t a, b;
  const double *point;
} joined;

static const double *place_of(const decimation *d, const joined *j, uint32_t v) {
  return j->point && (v == j->a || v == j->b) ? j->point : d->points + 3 * (size_t)v;
}

/* Unit normal of the triangle behind h; false when it goes, or has none. */
static bool joined_normal(const decimation *d, const joined *j, uint32_t h, double n[3]) {
  uint32_t v[3] = {start_of(d, h), end_of(d, h), start_of(d, mesh_previous(h))};
  unsigned moved = 0;
  for (int k = 0; k < 3; k++) moved += v[k] == j->a || v[k] == j->b;
  if (j->point && moved == 2) return false;
  vec_triangle_normal(place_of(d, j, v[0]), place_of(d, j, v[1]), place_of(d, j, v[2]), n);
  return vec_normalize(n);
}

/* The least product of w with the normals of the fans of v and `other` (MESH_NONE: none); which [3]: that normal. */
static double least_product(const decimation *d, const joined *j, uint32_t v, uint32_t other, const double *w,
                            double which[3]) {
  double least = 1, n[3];
  for (int fan = 0; fan < 2 && v != MESH_NONE; fan++, v = other)
    for (uint32_t h = d->out[v]; h != MESH_NONE; h = turn(d, v, h)) {
      double product = joined_normal(d, j, h, n) ? vec_dot(n, w) : 1;
      if (!(product < least)) continue;
      least = product;
      memcpy(which, n, sizeof n);
    }
  return least;
}

/* How far a plane at the vertex sees all its triangles from the front: nearly the most that the least product of its
 * normal with theirs can be, up to `enough`. */
static double frontness(const decimation *d, const joined *j, uint32_t v, uint32_t other, double enough) {
  double w[3] = {0}, n[3], best = -1;
  uint32_t fans[2] = {v, other};
  for (int fan = 0; fan < 2 && fans[fan] != MESH_NONE; fan++)
    for (uint32_t h = d->out[fans[fan]]; h != MESH_NONE; h = turn(d, fans[fan], h))
      for (int k = 0; joined_normal(d, j, h, n) && k < 3; k++) w[k] += n[k];
  for (int step = 1; step < 8 && best < enough && vec_normalize(w); step++) {
    best = fmax(best, least_product(d, j, v, other, w, n));
    for (int k = 0; k < 3; k++) w[k] += n[k] / (step + 1);
  }
  return best;
}

/* No vertex may come to have triangles that no plane sees all from the front, where folds begin. */
static bool keeps_fronts(const decimation *d, uint32_t a, uint32_t b, const double *point) {
  const double FRONT =
      0.1; /* 84 degrees; more would leave folded places as fine as they are, and the rest too coarse */
  joined before = {a, b, NULL}, after = {a, b, point};
  const uint32_t ends[2] = {a, b};
  double front = frontness(d, &after, a, b, FRONT);
  if (front < FRONT &&
      front < fmin(frontness(d, &before, a, MESH_NONE, FRONT), frontness(d, &before, b, MESH_NONE, FRONT)))
    return false;
  for (int end = 0; end < 2; end++)
    for (uint32_t h = d->out[ends[end]]; h != MESH_NONE; h = turn(d, ends[end], h)) {
      uint32_t last = start_of(d, mesh_previous(h));
      const uint32_t ring[2] = {end_of(d, h), d->twin[mesh_previous(h)] == MESH_NONE ? last : MESH_NONE};
      for (int k = 0; k < 2; k++) {
        if (ring[k] == MESH_NONE || ring[k] == a || ring[k] == b) continue;
        double now = frontness(d, &after, ring[k], MESH_NONE, FRONT);
        if (now < FRONT && now < frontness(d, &before, ring[k], MESH_NONE, FRONT)) return false;
      }
    }
  return true;
}

static bool may_go(decimation *d, uint32_t h, const collapse *c) {
  uint32_t a = start_of(d, h), b = end_of(d, h);
  return keeps_topology(d, h) && keeps_shape(d, a, b, c->point) && keeps_shape(d, b, a, c->point) &&
         keeps_fronts(d, a, b, c->point);
}

/* ---- collapse -------------------------------------------------------------------------------------- */

/* Takes the triangle behind h away and joins its other two edges. */
static void remove_triangle(decimation *d, uint32_t h) {
  uint32_t one = d->twin[mesh_next(h)], two = d->twin[mesh_previous(h)], apex = start_of(d, mesh_previous(h));
  if (one != MESH_NONE) d->twin[one] = two;
  if (two != MESH_NONE) d->twin[two] = one;
  for (uint32_t k = 0; k < 3; k++) d->triangles[h / 3 * 3 + k] = MESH_NONE;
  /* one runs from the apex, two to it */
  find_first(d, apex, one != MESH_NONE ? one : mesh_next(two));
}

/* The end of h goes, its start moves to the point. Returns how many triangles went. */
static size_t perform(decimation *d, uint32_t h, const collapse *c) {
  uint32_t a = start_of(d, h), b = end_of(d, h), g = d->twin[h];
  const uint32_t ends[2] = {a, b};
  for (int k = 0; k < 2; k++)
    for (uint32_t o = d->out[ends[k]]; o != MESH_NONE; o = turn(d, ends[k], o)) {
      heap_remove(&d->heap, edge_of(d, o));
      heap_remove(&d->heap, edge_of(d, mesh_previous(o)));
    }
  uint32_t one = d->twin[mesh_next(h)], two = d->twin[mesh_previous(h)];
  for (uint32_t o = d->out[b], next; o != MESH_NONE; o = next) {
    next = turn(d, b, o);
    d->triangles[o] = a;
  }
  remove_triangle(d, h);
  if (g != MESH_NONE) remove_triangle(d, g);
  find_first(d, a, two != MESH_NONE ? two : mesh_next(one));
  d->out[b] = MESH_NONE;
  add_quadric(&d->quadrics[a], &d->quadrics[b]);
  memcpy(d->points + 3 * (size_t)a, c->point, sizeof c->point);
  d->source[a] = c->end < 0 ? MESH_NONE : d->source[ends[c->end]];
  for (uint32_t o = d->out[a]; o != MESH_NONE; o = turn(d, a, o)) {
    queue_edge(d, o);
    if (d->twin[mesh_previous(o)] == MESH_NONE) queue_edge(d, mesh_previous(o));
  }
  return g == MESH_NONE ? 1 : 2;
}

static void queue_all(decimation *d) {
  for (uint32_t h = 0; h < 3 * d->triangle_count; h++)
    if (d->triangles[h] != MESH_NONE && edge_of(d, h) == h) queue_edge(d, h);
}

/* Collapses until `wanted` triangles are left or no edge may go; *left is in and out, *error the largest. */
static batten_status run(batten_context *ctx, decimation *d, size_t wanted, size_t *left, double *error) {
  size_t start = *left, steps = 0, since = 1;
  *error = 0;
  while (*left > wanted) {
    if (d->heap.count == 0) {
      if (since == 0) return BATTEN_OK;
      since = 0;
      queue_all(d);
    }
    if (steps++ % 1024 == 0) {
      batten_status st = batten_progress(ctx, "decimate", (double)(start - *left) / (double)(start - wanted));
      if (st < 0) return st;
    }
    uint32_t h = d->heap.edge[0];
    collapse c = plan(d, h);
    heap_remove(&d->heap, h);
    if (!may_go(d, h, &c)) continue;
    if (c.error > *error) *error = c.error;
    *left -= perform(d, h, &c);
    since++;
  }
  return BATTEN_OK;
}

/* ---- in and out ------------------------------------------------------------------------------------ */

static bool take(batten_context *ctx, const batten_mesh *mesh, decimation *d) {
  size_t n = mesh->vertex_count, half_edges = 3 * mesh->triangle_count;
  return (d->triangles = batten_alloc_array(ctx, half_edges, sizeof *d->triangles)) &&
         (d->twin = batten_alloc_array(ctx, half_edges, sizeof *d->twin)) &&
         (d->out = batten_alloc_array(ctx, n, sizeof *d->out)) &&
         (d->points = batten_alloc_array(ctx, n, 3 * sizeof *d->points)) &&
         (d->source = batten_alloc_array(ctx, n, sizeof *d->source)) &&
         (d->quadrics = batten_alloc_array(ctx, n, sizeof *d->quadrics)) &&
         (d->mark = batten_alloc_array(ctx, n, sizeof *d->mark)) &&
         (d->heap.edge = batten_alloc_array(ctx, half_edges, sizeof *d->heap.edge)) &&
         (d->heap.place = batten_alloc_array(ctx, half_edges, sizeof *d->heap.place)) &&
         (d->heap.cost = batten_alloc_array(ctx, half_edges, sizeof *d->heap.cost));
}

static void give_back(batten_context *ctx, decimation *d) {
  batten_free(ctx, d->triangles);
  batten_free(ctx, d->twin);
  batten_free(ctx, d->out);
  batten_free(ctx, d->points);
  batten_free(ctx, d->source);
  batten_free(ctx, d->quadrics);
  batten_free(ctx, d->mark);
  batten_free(ctx, d->heap.edge);
  batten_free(ctx, d->heap.place);
  batten_free(ctx, d->heap.cost);
}

/* Twins from the sorted half-edges in `order`, two of each inner edge; fans; points about the centre times unit. */
static void connect(const batten_mesh *mesh, const uint32_t *order, const double centre[3], double unit,
                    decimation *d) {
  size_t half_edges = 3 * mesh->triangle_count;
  const uint32_t *t = mesh->triangles;
  d->vertex_count = mesh->vertex_count;
  d->triangle_count = mesh->triangle_count;
  if (half_edges) memcpy(d->triangles, t, half_edges * sizeof *t);
  for (size_t i = 0; i < half_edges; i++) d->twin[i] = d->heap.place[i] = MESH_NONE;
  for (size_t i = 0; i + 1 < half_edges; i++) {
    uint32_t h = order[i], g = order[i + 1];
    if (t[h] != t[mesh_next(g)] || t[g] != t[mesh_next(h)]) continue;
    d->twin[h] = g;
    d->twin[g] = h;
  }
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    d->out[v] = MESH_NONE;
    d->mark[v] = 0;
    d->source[v] = (uint32_t)v;
    for (size_t k = 0; k < 3; k++) d->points[3 * v + k] = (mesh->vertices[3 * v + k] - centre[k]) * unit;
  }
  for (uint32_t h = 0; h < half_edges; h++)
    if (d->out[t[h]] == MESH_NONE || d->twin[h] == MESH_NONE) d->out[t[h]] = h;
}

/* What is left, vertices at places of the mesh's own with the same bits. */
static batten_status write_mesh(batten_context *ctx, const batten_mesh *mesh, const double centre[3], double unit,
                                size_t left, decimation *d, batten_mesh **out) {
  uint32_t count = 0, *name = d->mark;
  size_t at = 0;
  double *points = batten_alloc_array(ctx, d->vertex_count, 3 * sizeof *points);
  uint32_t *triangles = points ? batten_alloc_array(ctx, left, 3 * sizeof *triangles) : NULL;
  batten_status st = BATTEN_E_NOMEM;
  if (triangles) {
    for (size_t v = 0; v < d->vertex_count; v++) {
      if (d->out[v] == MESH_NONE) continue;
      for (size_t k = 0; k < 3; k++)
        points[3 * (size_t)count + k] = d->source[v] == MESH_NONE ? d->points[3 * v + k] / unit + centre[k]
                                                                  : mesh->vertices[3 * (size_t)d->source[v] + k];
      name[v] = count++;
    }
    for (size_t h = 0; h < 3 * d->triangle_count; h++)
      if (d->triangles[h] != MESH_NONE) triangles[at++] = name[d->triangles[h]];
    st = batten_mesh_create(ctx, count, points, left, triangles, out);
  }
  batten_free(ctx, triangles);
  batten_free(ctx, points);
  return st;
}

static batten_status check(batten_context *ctx, const batten_mesh *mesh, size_t triangles, batten_mesh **out) {
  if (!mesh || !out)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give %s", mesh ? "out" : "mesh",
                       mesh ? "the address of the result" : "a mesh");
  if (triangles == 0) return batten_fail(ctx, BATTEN_E_INVALID, "triangles: 0; give at least 1");
  batten_mesh_defects defects;
  batten_status st = batten_mesh_find_defects_of(ctx, mesh->vertex_count, mesh->vertices, mesh->triangle_count,
                                                 mesh->triangles, &defects);
  if (st < 0) return st;
  defects.isolated_vertices = defects.duplicate_vertices = 0; /* no hindrance */
  size_t hindrances = defects.degenerate_triangles + defects.duplicate_triangles + defects.nonmanifold_edges +
                      defects.flipped_edges + defects.nonmanifold_vertices;
  return hindrances ? batten_mesh_fail_defects(ctx, &defects) : BATTEN_OK;
}

/* Centre of the box, and the power of two that brings its half to about 1. */
static double frame_of(const batten_mesh *mesh, double centre[3]) {
  double size = 0;
  for (size_t k = 0; k < 3; k++) {
    double low = INFINITY, high = -INFINITY;
    for (size_t v = 0; v < mesh->vertex_count; v++) {
      low = fmin(low, mesh->vertices[3 * v + k]);
      high = fmax(high, mesh->vertices[3 * v + k]);
    }
    centre[k] = mesh->vertex_count ? low / 2 + high / 2 : 0;
    size = fmax(size, high - centre[k]);
  }
  return size > 0 ? batten_unit(size) : 1;
}

batten_status batten_mesh_decimate(batten_context *ctx, const batten_mesh *mesh, size_t triangles, batten_mesh **out,
                                   double *distance_max) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_status st = check(ctx, mesh, triangles, out), made;
  if (st < 0) return st;
  decimation d = {0};
  uint32_t *order = batten_alloc_array(ctx, mesh->triangle_count, 3 * sizeof *order);
  double centre[3], unit = frame_of(mesh, centre), error = 0;
  size_t left = mesh->triangle_count;
  st = BATTEN_E_NOMEM;
  if (!order || !take(ctx, mesh, &d)) goto done;
  st = batten_mesh_sort_edges(ctx, mesh->vertex_count, mesh->triangle_count, mesh->triangles, order);
  if (st < 0) goto done;
  connect(mesh, order, centre, unit, &d);
  make_quadrics(&d);
  if (left > triangles) queue_all(&d);
  st = run(ctx, &d, triangles, &left, &error);
  if (st < 0) goto done;
  made = write_mesh(ctx, mesh, centre, unit, left, &d, out);
  st = made;
  if (made < 0) goto done;
  if (distance_max) *distance_max = sqrt(error) / unit;
  if (left > triangles)
    st =
        batten_fail(ctx, BATTEN_W_ACCURACY, "triangles: %zu are left of %zu, %zu were wanted; no further edge may go",
                    left, mesh->triangle_count, triangles);
done:
  give_back(ctx, &d);
  batten_free(ctx, order);
  return st;
}
