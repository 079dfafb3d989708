/* Even triangles on f = 0 (Botsch, Kobbelt 2004, "A remeshing approach to multiresolution modeling"): a round splits
 * long edges, collapses short ones, flips towards Delaunay, and moves vertices towards the mean of their neighbours
 * in the tangent plane, then, every second round, back to the surface by one Newton step. A move along the tangent
 * plane leaves the surface by its square only: the field is asked only for vertices whose way since they were on it,
 * with the curvature that the normals around show, says that this matters. Values come in one batch.
 *
 * No step may turn a triangle over: a change is made only when the new triangles face as the old ones did and as the
 * gradients at their corners ask for. Vertices on the box stay on their faces of it, corners on an edge of the box
 * stay on that edge. Sharp edges are not turned, and vertices on creases move along these only (sharp.c). */
#include "improve.h"

#include "base/checked.h"
#include "project.h"
#include "sharp.h"
#include "table.h"
#include "vec.h"

#include <string.h>

static const double LONG_EDGE = 4.0 / 3, SHORT_EDGE = 4.0 / 5; /* the paper's bounds: a split makes no short edge */
static const double SMOOTHING = 0.7;                           /* of the way to the neighbours' mean */
static const double REACH = 1.5;       /* of the last search for f = 0, in edges: more than a cube of the lattice */
static const double STEP_MAX = 0.3;    /* Newton step, in edges */
static const double TURN_MIN = 0.5;    /* cosine between a triangle's normals before and after a change */
static const double FACE_MIN = 0.2;    /* cosine between its normal and its corners' gradients */
static const double QUALITY_MIN = 0.3; /* changes make no triangle worse than this, unless it was worse before */

enum { FLIP_SWEEPS = 4, VALENCE_MAX = 12 };

enum { TASK_VERTICES = 4096, TASK_TRIANGLES = 4096 };
enum { PROGRESS_STEP = 1 << 17 }; /* edges, triangles or vertices looked at between two calls of progress */

typedef struct improver {
  mesh_surface *s;
  batten_sampler *sampler;
  const double *lower, *upper; /* the box */
  double edge;
  const char *phase; /* of progress, how far it is, and what was looked at since it was told */
  double fraction;
  size_t looks;
  double angle;         /* of creases, 0 = there are none */
  size_t most;          /* triangles: needles that are halved across give ever more needles */
  unsigned char *flags; /* [3 T] half-edges, or [T] triangles, to be looked at */
  size_t flags_room;
  uint32_t *touched; /* vertices whose rings are no more as they were when edges were last turned */
  size_t touched_count, touched_room;
  bool touched_all;
  bool (*wanted)(const struct improver *, uint32_t);
  unsigned char *inner; /* [V] for collapses in parts */
  uint32_t *by_part;    /* half-edges, those of a part from part_first on */
  size_t part_first[17], part_done;
  double *target, *turned; /* [V][3] places and normals that vertices shall get, */
  unsigned char *share;    /* [V] and how much of the way: 2^-share, STAY = nothing */
  size_t room;             /* vertices that these hold */
  const uint32_t *listed;  /* triangles that are checked, NULL = all */
  size_t listed_count;
} improver;

static double *point(const mesh_surface *s, uint32_t v) { return s->points + 3 * (size_t)v; }
static double *normal(const mesh_surface *s, uint32_t v) { return s->normals + 3 * (size_t)v; }
static unsigned char box_faces(const mesh_surface *s, uint32_t v) { return s->faces[v] & (unsigned char)~MESH_MARKS; }

/* ---- progress ----------------------------------------------------------------------------------- */

static batten_status tell(improver *im, double fraction) {
  im->fraction = fraction;
  im->looks = 0;
  return batten_progress(im->s->ctx, im->phase, fraction);
}

/* Tells again when enough was looked at since: small surfaces need no more than the steps of a round. */
static batten_status count_looks(improver *im, size_t looks) {
  im->looks += looks;
  return im->looks < PROGRESS_STEP ? BATTEN_OK : tell(im, im->fraction);
}

/* ---- what a change does to a triangle ----------------------------------------------------------- */

/* 1 for the equilateral triangle, 0 without area: 4 sqrt(3) area / sum of squared sides. */
static double quality(const double *a, const double *b, const double *c, double twice_area) {
  double ab[3], bc[3], ca[3];
  vec_sub(b, a, ab);
  vec_sub(c, b, bc);
  vec_sub(a, c, ca);
  double squares = vec_dot(ab, ab) + vec_dot(bc, bc) + vec_dot(ca, ca);
  return squares > 0 ? 3.4641016151377546 * twice_area / squares : 0;
}

typedef struct facet {
  double n[3]; /* unit normal, 0 without area */
  double quality;
  double facing; /* cosine with the sum of the corners' normals */
} facet;

static facet facet_of(const double *a, const double *b, const double *c, const double *na, const double *nb,
                      const double *nc) {
  facet f;
  double sum[3];
  vec_triangle_normal(a, b, c, f.n);
  double twice_area = vec_norm(f.n);
  f.quality = quality(a, b, c, twice_area);
  for (int k = 0; k < 3; k++) {
    sum[k] = na[k] + nb[k] + nc[k];
    f.n[k] = twice_area > 0 ? f.n[k] / twice_area : 0;
  }
  double length = vec_norm(sum); /* of unit vectors, or 0 */
  f.facing = length > 0 ? vec_dot(sum, f.n) / length : 0;
  return f;
}

/* May the triangle `before` become `after`? */
static bool may_become(const facet *before, const facet *after) {
  bool flat = before->quality < 0.02; /* its normal says nothing */
  if (!flat && !(vec_dot(before->n, after->n) > TURN_MIN)) return false;
  if (!(after->facing > FACE_MIN) && !(after->facing > before->facing)) return false;
  return after->quality > QUALITY_MIN || after->quality > before->quality;
}

/* ---- what is to be looked at -------------------------------------------------------------------- */

/* Long loops first find what may want a change, side by side; the few changes are then made one after the other,
 * each looked at again, in the order of their numbers: nothing depends on the threads. */
static void flag_task(void *arg, size_t task) {
  const improver *im = arg;
  const size_t half_edges = 3 * im->s->triangle_count, first = 3 * TASK_TRIANGLES * task;
  size_t end = first + 3 * TASK_TRIANGLES < half_edges ? first + 3 * TASK_TRIANGLES : half_edges;
  for (size_t h = first; h < end; h++) {
    uint32_t g = im->s->twin[h];
    bool own = im->s->origin[h] != MESH_NONE && (g == MESH_NONE || h < g); /* an edge is looked at once */
    im->flags[h] = own && im->wanted(im, (uint32_t)h);
  }
}

static batten_status make_flags(improver *im) {
  size_t count = 3 * im->s->triangle_count;
  if (count <= im->flags_room) return BATTEN_OK;
  batten_free(im->s->ctx, im->flags);
  im->flags_room = 0;
  im->flags = batten_alloc_array(im->s->ctx, count, 1);
  if (!im->flags) return BATTEN_E_NOMEM;
  im->flags_room = count;
  return BATTEN_OK;
}

static batten_status flag_edges(improver *im, bool (*wanted)(const improver *, uint32_t)) {
  batten_status st = make_flags(im);
  if (st < 0) return st;
  im->wanted = wanted;
  batten_parallel(im->s->ctx, (im->s->triangle_count + TASK_TRIANGLES - 1) / TASK_TRIANGLES, flag_task, im);
  return count_looks(im, im->s->triangle_count);
}

static batten_status touch(improver *im, uint32_t v) {
  if (im->touched_all) return BATTEN_OK;
  if (im->touched_count > im->s->vertex_count / 8) {
    im->touched_all = true;
    return BATTEN_OK;
  }
  if (batten_reserve(im->s->ctx, (void **)&im->touched, &im->touched_room, im->touched_count + 1,
                     sizeof *im->touched) < 0)
    return BATTEN_E_NOMEM;
  im->touched[im->touched_count++] = v;
  return BATTEN_OK;
}

/* ---- split and collapse ------------------------------------------------------------------------- */

static double edge_square(const mesh_surface *s, uint32_t h) {
  double d[3];
  vec_sub(point(s, s->origin[h]), point(s, s->origin[mesh_next(h)]), d);
  return vec_dot(d, d);
}

static bool is_long(const improver *im, uint32_t h) {
  double most = LONG_EDGE * im->edge;
  return edge_square(im->s, h) > most * most;
}

static bool is_short(const improver *im, uint32_t h) {
  double least = SHORT_EDGE * im->edge;
  return edge_square(im->s, h) < least * least;
}

static batten_status split_long(improver *im) {
  mesh_surface *s = im->s;
  batten_status st = flag_edges(im, is_long);
  size_t flagged = 3 * s->triangle_count;
  for (uint32_t h = 0; st >= 0 && h < 3 * s->triangle_count && s->triangle_count < im->most; h++) {
    if (h < flagged && !im->flags[h]) continue; /* halves come later in it, or are what is left of h */
    while (st >= 0 && is_long(im, h) && s->triangle_count < im->most) {
      const double *a = point(s, s->origin[h]), *b = point(s, s->origin[mesh_next(h)]);
      double middle[3];
      for (int k = 0; k < 3; k++) middle[k] = 0.5 * a[k] + 0.5 * b[k];
      uint32_t m = mesh_surface_split(s, h, middle);
      st = m == MESH_NONE ? BATTEN_E_NOMEM : touch(im, m);
      if (st >= 0) st = count_looks(im, 1);
    }
  }
  return st;
}

/* Would edges from x to the neighbours of v, but `other`, be short enough? */
static bool lengths_allow(const improver *im, uint32_t v, uint32_t other, const double *x) {
  const mesh_surface *s = im->s;
  uint32_t around[SURFACE_RING_MAX + 1];
  size_t count = mesh_surface_neighbours(s, v, around);
  const double most = LONG_EDGE * im->edge;
  for (size_t i = 0; i < count; i++) {
    double d[3];
    vec_sub(x, point(s, around[i]), d);
    if (around[i] != other && vec_dot(d, d) > most * most) return false;
  }
  return count > 0;
}

/* May the triangles of v, but those that also have `other`, have v at x with the normal n? */
static bool ring_allows(const improver *im, uint32_t v, uint32_t other, const double *x, const double *n) {
  const mesh_surface *s = im->s;
  uint32_t ring[SURFACE_RING_MAX];
  size_t count = mesh_surface_ring(s, v, ring);
  for (size_t i = 0; i < count; i++) {
    uint32_t p = s->origin[mesh_next(ring[i])], q = s->origin[mesh_previous(ring[i])];
    if (p == other || q == other) continue;
    facet before = facet_of(point(s, v), point(s, p), point(s, q), normal(s, v), normal(s, p), normal(s, q));
    facet after = facet_of(x, point(s, p), point(s, q), n, normal(s, p), normal(s, q));
    if (!may_become(&before, &after)) return false;
  }
  return count > 0;
}

/* May the origin of h go, as far as creases are concerned: to a vertex of the same crease along it? A loop of three
 * sharp edges stays. */
static bool creases_allow(const mesh_surface *s, uint32_t h) {
  uint32_t a = s->origin[h], g = s->twin[h];
  if (!(s->faces[a] & MESH_MARKS)) return true;
  if ((s->faces[a] & MESH_CORNER) || !s->sharp[h]) return false;
  if (mesh_surface_sharp_count(s, a) != (mesh_surface_on_boundary(s, a) ? 1u : 2u)) return false;
  if (mesh_surface_on_boundary(s, a)) return false;
  if (s->sharp[mesh_next(h)] && s->sharp[mesh_previous(h)]) return false;
  return g == MESH_NONE || !(s->sharp[mesh_next(g)] && s->sharp[mesh_previous(g)]);
}

static bool may_meet_halfway(const mesh_surface *s, uint32_t a, uint32_t b) {
  return s->faces[a] == s->faces[b] && !(s->faces[a] & MESH_MARKS);
}

/* Draws the origin of h into its end when that is allowed; to the middle where both may move. */
static bool try_collapse(const improver *im, uint32_t h) {
  mesh_surface *s = im->s;
  uint32_t a = s->origin[h], b = s->origin[mesh_next(h)];
  if (box_faces(s, a) & ~box_faces(s, b)) return false; /* would leave a face of the box */
  if (!creases_allow(s, h)) return false;
  bool even = may_meet_halfway(s, a, b);
  double x[3], n[3], half = 0.5 * sqrt(edge_square(s, h));
  for (int k = 0; k < 3; k++) {
    x[k] = even ? 0.5 * point(s, a)[k] + 0.5 * point(s, b)[k] : point(s, b)[k];
    n[k] = (s->faces[b] & MESH_MARKS ? 0 : normal(s, a)[k]) + normal(s, b)[k];
  }
  vec_normalize(n);
  if (!lengths_allow(im, a, b, x) || (even && !lengths_allow(im, b, a, x))) return false;
  if (!mesh_surface_may_collapse(s, h)) return false;
  if (!ring_allows(im, a, b, x, n) || (even && !ring_allows(im, b, a, x, n))) return false;
  mesh_surface_collapse(s, h);
  memcpy(point(s, b), x, sizeof x);
  memcpy(normal(s, b), n, sizeof n);
  if (even) s->drift[b] = (float)(fmax(s->drift[a], s->drift[b]) + half);
  return true;
}

/* The edge of h either way: the vertex that stays, or MESH_NONE. */
static uint32_t collapse_edge(const improver *im, uint32_t h) {
  const mesh_surface *s = im->s;
  uint32_t a = s->origin[h], b = s->origin[mesh_next(h)], g = s->twin[h];
  if (try_collapse(im, h)) return b;
  if (g == MESH_NONE || may_meet_halfway(s, a, b)) return MESH_NONE; /* then both ways are the same */
  return try_collapse(im, g) ? a : MESH_NONE;
}

/* Vertices whose neighbours are all in their part, of which there are PARTS by their numbers. As long as only edges
 * between such vertices and with such vertices opposite to them are collapsed, nothing that lies in another part, or
 * between parts, is read or changed; and neighbours stay in the part. */
enum {
  PARTS = 16,
  PARTS_FROM = 1 << 17, /* vertices from which on it is worth it */
  PART_STEP = 1 << 15   /* edges of a part between two calls of progress: some tenths of a second */
};

static size_t part_of(const mesh_surface *s, uint32_t v) { return (size_t)v * PARTS / s->vertex_count; }

static void inner_task(void *arg, size_t part) {
  const improver *im = arg;
  const mesh_surface *s = im->s;
  size_t first = (part * s->vertex_count + PARTS - 1) / PARTS,
         end = ((part + 1) * s->vertex_count + PARTS - 1) / PARTS;
  for (size_t v = first; v < end; v++) {
    uint32_t around[SURFACE_RING_MAX + 1];
    im->inner[v] = 0;
    if (s->out[v] == MESH_NONE) continue;
    size_t count = mesh_surface_neighbours(s, (uint32_t)v, around), own = 0;
    while (own < count && around[own] >= first && around[own] < end) own++;
    im->inner[v] = count > 0 && own == count;
  }
}

static bool is_inner(const improver *im, uint32_t h) {
  const mesh_surface *s = im->s;
  uint32_t g = s->twin[h];
  return im->inner[s->origin[h]] && im->inner[s->origin[mesh_next(h)]] && im->inner[s->origin[mesh_previous(h)]] &&
         (g == MESH_NONE || im->inner[s->origin[mesh_previous(g)]]);
}

static void collapse_task(void *arg, size_t part) {
  const improver *im = arg;
  const mesh_surface *s = im->s;
  size_t first = im->part_first[part] + im->part_done, end = im->part_first[part + 1];
  for (size_t i = first; i < end && i < first + PART_STEP; i++) {
    uint32_t h = im->by_part[i];
    if (s->origin[h] == MESH_NONE || !is_short(im, h) || !is_inner(im, h)) continue;
    collapse_edge(im, h);
  }
}

static batten_status collapse_by_part(improver *im) {
  size_t longest = 0;
  batten_status st = count_looks(im, im->part_first[PARTS]);
  for (size_t p = 0; p < PARTS; p++) {
    size_t count = im->part_first[p + 1] - im->part_first[p];
    if (count > longest) longest = count;
  }
  if (st >= 0) batten_parallel(im->s->ctx, PARTS, inner_task, im);
  for (im->part_done = 0; st >= 0 && im->part_done < longest; im->part_done += PART_STEP) {
    batten_parallel(im->s->ctx, PARTS, collapse_task, im);
    st = tell(im, im->fraction);
  }
  im->touched_all = true;
  return st;
}

/* Where many edges are short, those that lie within parts of the surface, part beside part. The flags stay. */
static batten_status collapse_parts(improver *im) {
  mesh_surface *s = im->s;
  batten_context *ctx = s->ctx;
  size_t half_edges = 3 * s->triangle_count, count = 0;
  memset(im->part_first, 0, sizeof im->part_first);
  if (s->vertex_count < PARTS_FROM) return BATTEN_OK;
  for (size_t h = 0; h < half_edges; h++) {
    if (!im->flags[h]) continue;
    im->part_first[part_of(s, s->origin[h]) + 1]++;
    count++;
  }
  if (count < s->vertex_count / 4) return BATTEN_OK;
  size_t next[PARTS];
  for (size_t p = 0; p < PARTS; p++) {
    im->part_first[p + 1] += im->part_first[p];
    next[p] = im->part_first[p];
  }
  im->inner = batten_alloc_array(ctx, s->vertex_count, 1);
  im->by_part = im->inner ? batten_alloc_array(ctx, count, sizeof *im->by_part) : NULL;
  for (uint32_t h = 0; im->by_part && h < half_edges; h++)
    if (im->flags[h]) im->by_part[next[part_of(s, s->origin[h])]++] = h;
  batten_status st = im->by_part ? collapse_by_part(im) : BATTEN_E_NOMEM;
  batten_free(ctx, im->by_part);
  batten_free(ctx, im->inner);
  im->by_part = NULL;
  im->inner = NULL;
  return st;
}

static batten_status collapse_short(improver *im) {
  mesh_surface *s = im->s;
  batten_status st = flag_edges(im, is_short);
  if (st >= 0) st = collapse_parts(im);
  if (st >= 0) st = tell(im, im->fraction);
  for (uint32_t h = 0; st >= 0 && h < 3 * s->triangle_count; h++) {
    if (!im->flags[h] || s->origin[h] == MESH_NONE || !is_short(im, h)) continue;
    st = count_looks(im, 1);
    uint32_t v = st >= 0 ? collapse_edge(im, h) : MESH_NONE;
    if (v != MESH_NONE) st = touch(im, v);
  }
  return st;
}

/* ---- flip --------------------------------------------------------------------------------------- */

/* Sine of the sum of the angles at c and d, which see a b: negative when it is above pi. */
static double opposite_angles(const double *a, const double *b, const double *c, const double *d) {
  double ca[3], cb[3], da[3], db[3], n[3];
  vec_sub(a, c, ca);
  vec_sub(b, c, cb);
  vec_sub(a, d, da);
  vec_sub(b, d, db);
  double dot_c = vec_dot(ca, cb), dot_d = vec_dot(da, db);
  if (dot_c >= 0 && dot_d >= 0) return 1; /* both at most a right angle */
  vec_cross(ca, cb, n);
  double sine_c = vec_norm(n);
  vec_cross(da, db, n);
  double sine_d = vec_norm(n);
  return (sine_c * dot_d + dot_c * sine_d) / (hypot(sine_c, dot_c) * hypot(sine_d, dot_d));
}

/* An edge is turned when the angles opposite to it add up to more than pi (not Delaunay), the two triangles lie about
 * flat or get flatter by it, and both new ones face outward. */
static bool wants_flip(const improver *im, uint32_t h) {
  const mesh_surface *s = im->s;
  uint32_t g = s->twin[h];
  if (g == MESH_NONE || s->sharp[h]) return false;
  uint32_t v[4] = {s->origin[h], s->origin[g], s->origin[mesh_previous(h)], s->origin[mesh_previous(g)]};
  const double *a = point(s, v[0]), *b = point(s, v[1]), *c = point(s, v[2]), *d = point(s, v[3]);
  const double *na = normal(s, v[0]), *nb = normal(s, v[1]), *nc = normal(s, v[2]), *nd = normal(s, v[3]);
  if (!(opposite_angles(a, b, c, d) < -1e-3)) return false; /* a margin, so that four points on a circle rest */
  facet left = facet_of(a, b, c, na, nb, nc), right = facet_of(b, a, d, nb, na, nd);
  facet first = facet_of(d, c, a, nd, nc, na), second = facet_of(c, d, b, nc, nd, nb);
  double bend = vec_dot(left.n, right.n), bend_after = vec_dot(first.n, second.n);
  double worst = fmin(left.quality, right.quality), worst_after = fmin(first.quality, second.quality);
  if (!(bend_after > 0.8) && !(bend_after > bend)) return false;
  if (!(fmin(first.facing, second.facing) > fmin(0.5, fmin(left.facing, right.facing)))) return false;
  return worst_after > worst;
}

typedef struct edge_list {
  uint32_t *half_edges;
  size_t count, room;
} edge_list;

static batten_status list_edge(improver *im, edge_list *list, uint32_t h) {
  if (batten_reserve(im->s->ctx, (void **)&list->half_edges, &list->room, list->count + 1, sizeof *list->half_edges) <
      0)
    return BATTEN_E_NOMEM;
  list->half_edges[list->count++] = h;
  return BATTEN_OK;
}

/* The edges of touched vertices and those around them, or of all of the surface. */
static batten_status list_edges(improver *im, edge_list *list) {
  const mesh_surface *s = im->s;
  batten_status st = BATTEN_OK;
  if (im->touched_all) {
    st = flag_edges(im, wants_flip);
    for (uint32_t h = 0; st >= 0 && h < 3 * s->triangle_count; h++)
      if (im->flags[h]) st = list_edge(im, list, h);
  }
  for (size_t i = 0; st >= 0 && !im->touched_all && i < im->touched_count; i++) {
    uint32_t ring[SURFACE_RING_MAX];
    if (s->out[im->touched[i]] == MESH_NONE) continue;
    size_t count = mesh_surface_ring(s, im->touched[i], ring);
    for (size_t k = 0; st >= 0 && k < count; k++) {
      st = list_edge(im, list, ring[k]);
      if (st >= 0) st = list_edge(im, list, mesh_next(ring[k]));
    }
  }
  im->touched_count = 0;
  im->touched_all = false;
  return st;
}

/* A sweep looks at the edges around those that the one before turned. */
static batten_status flip_sweeps(improver *im) {
  mesh_surface *s = im->s;
  edge_list now = {0}, next = {0};
  batten_status st = list_edges(im, &now);
  for (int sweep = 0; st >= 0 && sweep < FLIP_SWEEPS && now.count > 0; sweep++) {
    next.count = 0;
    for (size_t i = 0; st >= 0 && i < now.count; i++) {
      uint32_t h = now.half_edges[i], g = s->twin[h];
      st = count_looks(im, 1);
      if (st < 0 || !wants_flip(im, h) || !mesh_surface_may_flip(s, h)) continue;
      mesh_surface_flip(s, h);
      const uint32_t around[4] = {mesh_next(h), mesh_previous(h), mesh_next(g), mesh_previous(g)};
      for (int k = 0; st >= 0 && k < 4; k++) st = list_edge(im, &next, around[k]);
    }
    edge_list t = now;
    now = next;
    next = t;
  }
  batten_free(s->ctx, now.half_edges);
  batten_free(s->ctx, next.half_edges);
  return st;
}

/* ---- smoothing and projection ------------------------------------------------------------------- */

/* Takes the coordinates out of d that a vertex on the box must keep. */
static void keep_on_faces(unsigned char faces, double *d) {
  for (unsigned k = 0; k < 3; k++)
    if (batten_on_face(faces, k)) d[k] = 0;
}

/* Where v should go along the surface: towards the mean of its neighbours; on the box, of its two neighbours there.
 */
static void smooth_target(const improver *im, uint32_t v, double *x) {
  const mesh_surface *s = im->s;
  uint32_t around[SURFACE_RING_MAX + 1];
  size_t count = mesh_surface_neighbours(s, v, around), used = 0;
  double d[3] = {0, 0, 0}, n[3];
  unsigned char faces = box_faces(s, v);
  memcpy(x, point(s, v), sizeof d);
  for (size_t i = 0; i < count; i++) {
    if (faces && i != 0 && i != count - 1) continue;
    for (int k = 0; k < 3; k++) d[k] += point(s, around[i])[k] - x[k];
    used++;
  }
  if (used == 0 || (s->faces[v] & MESH_MARKS)) return;
  for (int k = 0; k < 3; k++) d[k] *= SMOOTHING / (double)used;
  memcpy(n, normal(s, v), sizeof n);
  keep_on_faces(faces, d);
  keep_on_faces(faces, n);
  vec_normalize(n);
  double off = vec_dot(d, n);
  if (faces && (faces & (faces - 1))) return; /* on an edge of the box: only the surface decides */
  for (int k = 0; k < 3; k++) x[k] += d[k] - off * n[k];
}

static batten_status make_room(improver *im) {
  size_t count = im->s->vertex_count;
  batten_context *ctx = im->s->ctx;
  batten_status st = make_flags(im);
  if (st < 0 || count <= im->room) return st;
  batten_free(ctx, im->target);
  batten_free(ctx, im->turned);
  batten_free(ctx, im->share);
  im->room = 0;
  im->target = im->turned = NULL;
  im->share = NULL;
  if (!(im->target = batten_alloc_array(ctx, count, 3 * sizeof *im->target)) ||
      !(im->turned = batten_alloc_array(ctx, count, 3 * sizeof *im->turned)) ||
      !(im->share = batten_alloc_array(ctx, count, 1)))
    return BATTEN_E_NOMEM;
  im->room = count;
  return BATTEN_OK;
}

static bool in_box(const improver *im, const double *x) {
  for (int k = 0; k < 3; k++)
    if (!(x[k] >= im->lower[k] && x[k] <= im->upper[k])) return false;
  return true;
}

/* Vertices on creases to the mean of their neighbours there (share of the way), and onto the crease. */
static batten_status slide(improver *im, double share) {
  mesh_surface *s = im->s;
  batten_crease *creases = NULL;
  uint32_t *vertices = NULL;
  size_t count = 0;
  batten_status st = mesh_surface_creases(s, share, &count, &vertices, &creases);
  if (st >= 0) st = batten_crease_refine(im->sampler, count, creases, 0.5 * im->edge, im->angle);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    double n[3];
    uint32_t v = vertices[i];
    for (int k = 0; k < 3; k++) n[k] = creases[i].normal[0][k] + creases[i].normal[1][k];
    if (!creases[i].found || !vec_normalize(n)) continue;
    if (!in_box(im, creases[i].x) || !ring_allows(im, v, MESH_NONE, creases[i].x, n)) continue;
    memcpy(point(s, v), creases[i].x, sizeof n);
    memcpy(normal(s, v), n, sizeof n);
  }
  batten_free(s->ctx, creases);
  batten_free(s->ctx, vertices);
  return st;
}

/* ---- the moves of all vertices at a time ---------------------------------------------------------- */

/* How far f may be from where a vertex is taken to be on it, in edges, and how much the normal may have turned,
 * radians, before the field is asked again. */
static const double OFF_MAX = 0.005, STALE_MAX = 0.1;

enum { STAY = 3, HELD = 4 }; /* share: all of the way, half, a quarter, nothing; held back in this pass */
enum { LISTED = 2 };         /* flag of a triangle that is to be looked at again */

static void target_task(void *arg, size_t task) {
  const improver *im = arg;
  const mesh_surface *s = im->s;
  size_t end = (task + 1) * TASK_VERTICES < s->vertex_count ? (task + 1) * TASK_VERTICES : s->vertex_count;
  for (size_t v = task * TASK_VERTICES; v < end; v++) {
    smooth_target(im, (uint32_t)v, im->target + 3 * v);
    memcpy(im->turned + 3 * v, s->normals + 3 * v, 3 * sizeof *s->normals);
    im->share[v] = s->faces[v] & MESH_MARKS ? STAY : 0;
    im->flags[v] = 0;
    if (im->share[v] == STAY) continue;
    s->drift[v] += (float)vec_distance(im->target + 3 * v, s->points + 3 * v);
  }
}

/* Curvature from the normals around times the way since f was known tells how far off that led. */
static bool is_stale(const improver *im, uint32_t v) {
  const mesh_surface *s = im->s;
  uint32_t around[SURFACE_RING_MAX + 1];
  size_t count = mesh_surface_neighbours(s, v, around);
  double bend = 0, way = s->drift[v];
  for (size_t i = 0; i < count; i++) {
    double d[3], n[3];
    vec_sub(point(s, around[i]), point(s, v), d);
    vec_sub(normal(s, around[i]), normal(s, v), n);
    bend = fmax(bend, vec_dot(n, n) / vec_dot(d, d));
  }
  bend = sqrt(bend);
  return !(0.5 * bend * way * way <= OFF_MAX * im->edge && bend * way <= STALE_MAX);
}

static void stale_task(void *arg, size_t task) {
  const improver *im = arg;
  const mesh_surface *s = im->s;
  size_t end = (task + 1) * TASK_VERTICES < s->vertex_count ? (task + 1) * TASK_VERTICES : s->vertex_count;
  for (size_t v = task * TASK_VERTICES; v < end; v++)
    im->flags[v] = im->share[v] != STAY && is_stale(im, (uint32_t)v);
}

/* The targets of vertices of which f is not known well enough go to f = 0 by a Newton step, their normals against the
 * gradient. One batch. */
static batten_status step_to_field(improver *im) {
  mesh_surface *s = im->s;
  batten_context *ctx = s->ctx;
  size_t count = 0, vertices = s->vertex_count;
  batten_parallel(ctx, (vertices + TASK_VERTICES - 1) / TASK_VERTICES, stale_task, im);
  for (size_t v = 0; v < vertices; v++) count += im->flags[v];
  if (count == 0) return BATTEN_OK;
  double *points = batten_alloc_array(ctx, count, 7 * sizeof *points), *values = points, *gradients = points;
  if (!points) return BATTEN_E_NOMEM;
  values += 3 * count;
  gradients += 4 * count;
  for (size_t v = 0, i = 0; v < vertices; v++)
    if (im->flags[v]) memcpy(points + 3 * i++, im->target + 3 * v, 3 * sizeof *points);
  batten_status st = batten_sampler_gradients(im->sampler, count, points, values, gradients);
  for (size_t v = 0, i = 0; st >= 0 && v < vertices; v++) {
    if (!im->flags[v]) continue;
    double *x = im->target + 3 * v;
    batten_newton_step(3, values[i], gradients + 3 * i, s->faces[v], STEP_MAX * im->edge, x, im->turned + 3 * v);
    s->drift[v] = (float)vec_distance(x, points + 3 * i++);
  }
  batten_free(ctx, points);
  return st;
}

/* Where v is at its share of the way. */
static void place(const improver *im, uint32_t v, double *x) {
  static const double share[STAY + 1] = {1, 0.5, 0.25, 0};
  const double *from = point(im->s, v), *to = im->target + 3 * (size_t)v, w = share[im->share[v]];
  for (int k = 0; k < 3; k++) x[k] = w * to[k] + (1 - w) * from[k];
}

static bool triangle_allows(const improver *im, uint32_t t) {
  const mesh_surface *s = im->s;
  const uint32_t *v = s->origin + 3 * (size_t)t;
  const double *n[3];
  double x[3][3];
  bool moves = false;
  for (int k = 0; k < 3; k++) {
    place(im, v[k], x[k]);
    moves = moves || im->share[v[k]] != STAY;
    n[k] = im->share[v[k]] == STAY ? normal(s, v[k]) : im->turned + 3 * (size_t)v[k];
  }
  if (!moves) return true;
  facet before =
      facet_of(point(s, v[0]), point(s, v[1]), point(s, v[2]), normal(s, v[0]), normal(s, v[1]), normal(s, v[2]));
  facet after = facet_of(x[0], x[1], x[2], n[0], n[1], n[2]);
  return may_become(&before, &after);
}

static void check_task(void *arg, size_t task) {
  const improver *im = arg;
  size_t end = (task + 1) * TASK_TRIANGLES < im->listed_count ? (task + 1) * TASK_TRIANGLES : im->listed_count;
  for (size_t i = task * TASK_TRIANGLES; i < end; i++) {
    uint32_t t = im->listed ? im->listed[i] : (uint32_t)i;
    im->flags[t] = !triangle_allows(im, t);
  }
}

static void box_task(void *arg, size_t task) {
  const improver *im = arg;
  size_t vertices = im->s->vertex_count;
  size_t end = (task + 1) * TASK_VERTICES < vertices ? (task + 1) * TASK_VERTICES : vertices;
  for (size_t v = task * TASK_VERTICES; v < end; v++) {
    double x[3];
    for (place(im, (uint32_t)v, x); im->share[v] < STAY && !in_box(im, x); place(im, (uint32_t)v, x)) im->share[v]++;
  }
}

static void move_task(void *arg, size_t task) {
  const improver *im = arg;
  const mesh_surface *s = im->s;
  size_t end = (task + 1) * TASK_VERTICES < s->vertex_count ? (task + 1) * TASK_VERTICES : s->vertex_count;
  for (size_t v = task * TASK_VERTICES; v < end; v++) {
    double x[3];
    if (im->share[v] == STAY) continue;
    place(im, (uint32_t)v, x);
    memcpy(point(s, (uint32_t)v), x, sizeof x);
    memcpy(normal(s, (uint32_t)v), im->turned + 3 * v, sizeof x);
  }
}

/* Lists the triangles around v that are not listed yet: flags LISTED. */
static batten_status list_around(improver *im, uint32_t v, uint32_t **list, size_t *count, size_t *room) {
  const mesh_surface *s = im->s;
  uint32_t h = s->out[v];
  do {
    uint32_t t = h / 3;
    if (im->flags[t] != LISTED) {
      if (batten_reserve(s->ctx, (void **)list, room, *count + 1, sizeof **list) < 0) return BATTEN_E_NOMEM;
      im->flags[t] = LISTED;
      (*list)[(*count)++] = t;
    }
    h = s->twin[mesh_previous(h)];
  } while (h != MESH_NONE && h != s->out[v]);
  return BATTEN_OK;
}

/* Corners of triangles that do not allow the moves go half as far, until all do: only triangles around vertices that
 * were held back are looked at again. */
static batten_status hold_back(improver *im) {
  const mesh_surface *s = im->s;
  batten_context *ctx = s->ctx;
  uint32_t *lists[2] = {NULL, NULL}, *held = NULL; /* triangles of this pass and the next; vertices */
  size_t rooms[2] = {0, 0}, held_room = 0;
  batten_status st = BATTEN_OK;
  im->listed = NULL;
  im->listed_count = s->triangle_count;
  for (int pass = 0; st >= 0 && im->listed_count > 0; pass++) {
    size_t held_count = 0, count = 0;
    batten_parallel(ctx, (im->listed_count + TASK_TRIANGLES - 1) / TASK_TRIANGLES, check_task, im);
    st = count_looks(im, im->listed_count);
    for (size_t i = 0; st >= 0 && i < im->listed_count; i++) {
      uint32_t t = im->listed ? im->listed[i] : (uint32_t)i;
      for (uint32_t k = 0; im->flags[t] && st >= 0 && k < 3; k++) {
        uint32_t v = s->origin[3 * t + k];
        if (im->share[v] >= STAY) continue; /* or held in this pass */
        st = batten_reserve(ctx, (void **)&held, &held_room, held_count + 1, sizeof *held);
        if (st >= 0) held[held_count++] = v;
        im->share[v] |= HELD;
      }
    }
    for (size_t i = 0; st >= 0 && i < held_count; i++) {
      im->share[held[i]] = (unsigned char)((im->share[held[i]] & ~HELD) + 1);
      st = list_around(im, held[i], &lists[pass % 2], &count, &rooms[pass % 2]);
    }
    im->listed = lists[pass % 2];
    im->listed_count = count;
  }
  batten_free(ctx, held);
  batten_free(ctx, lists[1]);
  batten_free(ctx, lists[0]);
  return st;
}

/* One pass over all vertices of the compacted surface; on_field: back to f = 0 where the moves along the surface may
 * have led away from it. */
static batten_status smooth(improver *im, bool on_field) {
  batten_status st = make_room(im);
  if (st < 0) return st;
  const size_t tasks = (im->s->vertex_count + TASK_VERTICES - 1) / TASK_VERTICES;
  batten_parallel(im->s->ctx, tasks, target_task, im);
  st = count_looks(im, im->s->vertex_count);
  if (st >= 0 && on_field) st = step_to_field(im);
  if (st >= 0) st = count_looks(im, im->s->vertex_count);
  if (st < 0) return st;
  batten_parallel(im->s->ctx, tasks, box_task, im);
  st = hold_back(im);
  if (st >= 0) batten_parallel(im->s->ctx, tasks, move_task, im);
  im->touched_all = true;
  return st;
}

static void improver_free(improver *im) {
  batten_context *ctx = im->s->ctx;
  batten_free(ctx, im->flags);
  batten_free(ctx, im->touched);
  batten_free(ctx, im->target);
  batten_free(ctx, im->turned);
  batten_free(ctx, im->share);
}

static batten_status improve_round(improver *im, const char *phase, unsigned round, unsigned of, bool on_field) {
  im->phase = phase;
  im->fraction = (double)round / of;
  batten_status st = split_long(im);
  if (st >= 0) st = collapse_short(im);
  if (st >= 0) st = tell(im, (round + 0.3) / of);
  if (st >= 0) st = flip_sweeps(im);
  if (st >= 0) st = count_looks(im, im->s->triangle_count);
  if (st >= 0) st = mesh_surface_compact(im->s);
  if (st >= 0 && on_field && im->angle > 0) st = slide(im, 0.5);
  if (st >= 0) st = tell(im, (round + 0.5) / of);
  if (st >= 0) st = smooth(im, on_field);
  if (st >= 0) st = tell(im, (round + 0.8) / of);
  if (st >= 0) st = flip_sweeps(im);
  return st;
}

batten_status mesh_surface_improve(mesh_surface *s, batten_sampler *sampler, const double *lower, const double *upper,
                                   double edge, unsigned rounds) {
  improver im = {.s = s,
                 .sampler = sampler,
                 .lower = lower,
                 .upper = upper,
                 .edge = edge,
                 .most = SIZE_MAX,
                 .touched_all = true};
  batten_status st = BATTEN_OK;
  for (unsigned round = 0; st >= 0 && round < rounds; round++) {
    st = batten_progress(s->ctx, "improve", (double)round / rounds);
    if (st >= 0) st = improve_round(&im, "improve", round, rounds, round % 2 == 0 || round + 1 == rounds);
  }
  improver_free(&im);
  return st;
}

batten_status mesh_surface_improve_creased(mesh_surface *s, batten_sampler *sampler, const double *lower,
                                           const double *upper, double edge, double angle, unsigned rounds) {
  improver im = {.s = s, .sampler = sampler, .lower = lower, .upper = upper, .edge = edge, .angle = angle};
  im.most = 2 * s->triangle_count + 256;
  im.touched_all = true;
  batten_status st = BATTEN_OK;
  for (unsigned round = 0; st >= 0 && round < rounds; round++) {
    st = batten_progress(s->ctx, "sharpen", (double)(round + 1) / (rounds + 1));
    if (st >= 0) st = improve_round(&im, "sharpen", round + 1, rounds + 1, round % 2 == 1);
  }
  if (st >= 0) st = slide(&im, 0);
  improver_free(&im);
  return st;
}

/* ---- settling on f = 0 -------------------------------------------------------------------------- */

batten_status mesh_surface_settle(mesh_surface *s, batten_sampler *sampler, double edge, double tolerance,
                                  double *distance_max) {
  double *distance = batten_alloc_array(s->ctx, s->vertex_count, sizeof *distance), worst = 0;
  if (!distance) return BATTEN_E_NOMEM;
  batten_status st = batten_project_points(sampler, s->vertex_count, s->points, s->faces, REACH * edge, tolerance,
                                           s->normals, distance);
  for (size_t v = 0; st >= 0 && v < s->vertex_count; v++) worst = fmax(worst, distance[v]);
  if (st >= 0) *distance_max = worst;
  batten_free(s->ctx, distance);
  return st;
}
