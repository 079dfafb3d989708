/* Even triangles on f = 0 (Botsch, Kobbelt 2004, "A remeshing approach to multiresolution modeling"): a round splits
 * long edges, collapses short ones, flips towards Delaunay, and moves vertices towards the mean of their neighbours
 * in the tangent plane, then, every second round, back to the surface by one Newton step: a move along the tangent
 * plane leaves the surface by its square only, so that the rounds between need no field. Values come in one batch.
 *
 * No step may turn a triangle over: a change is made only when the new triangles face as the old ones did and as the
 * gradients at their corners ask for. Vertices on the box stay on their faces of it, corners on an edge of the box
 * stay on that edge. Sharp edges are not turned, and vertices on creases move along these only (sharp.c). */
#include "improve.h"

#include "base/checked.h"
#include "project.h"
#include "sharp.h"
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

typedef struct improver {
  mesh_surface *s;
  batten_sampler *sampler;
  const double *lower, *upper; /* the box */
  double edge;
  double *target, *values, *gradients; /* [V][3], [V], [V][3] */
  size_t room;                         /* vertices that they hold */
  double angle;                        /* of creases, 0 = there are none */
  size_t most;                         /* triangles: needles that are halved across give ever more needles */
} improver;

static double *point(const mesh_surface *s, uint32_t v) { return s->points + 3 * (size_t)v; }
static double *normal(const mesh_surface *s, uint32_t v) { return s->normals + 3 * (size_t)v; }
static unsigned char box_faces(const mesh_surface *s, uint32_t v) { return s->faces[v] & (unsigned char)~MESH_MARKS; }

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
  f.quality = quality(a, b, c, vec_norm(f.n));
  vec_normalize(f.n);
  for (int k = 0; k < 3; k++) sum[k] = na[k] + nb[k] + nc[k];
  vec_normalize(sum);
  f.facing = vec_dot(sum, f.n);
  return f;
}

/* May the triangle `before` become `after`? */
static bool may_become(const facet *before, const facet *after) {
  bool flat = before->quality < 0.02; /* its normal says nothing */
  if (!flat && !(vec_dot(before->n, after->n) > TURN_MIN)) return false;
  if (!(after->facing > FACE_MIN) && !(after->facing > before->facing)) return false;
  return after->quality > QUALITY_MIN || after->quality > before->quality;
}

/* ---- split and collapse ------------------------------------------------------------------------- */

static double edge_length(const mesh_surface *s, uint32_t h) {
  return vec_distance(point(s, s->origin[h]), point(s, s->origin[mesh_next(h)]));
}

static batten_status split_long(improver *im) {
  mesh_surface *s = im->s;
  for (uint32_t h = 0; h < 3 * s->triangle_count && s->triangle_count < im->most; h++) { /* halves come later in it */
    if (s->origin[h] == MESH_NONE || !(edge_length(s, h) > LONG_EDGE * im->edge)) continue;
    const double *a = point(s, s->origin[h]), *b = point(s, s->origin[mesh_next(h)]);
    double middle[3];
    for (int k = 0; k < 3; k++) middle[k] = 0.5 * a[k] + 0.5 * b[k];
    if (mesh_surface_split(s, h, middle) == MESH_NONE) return BATTEN_E_NOMEM;
  }
  return BATTEN_OK;
}

/* May the triangles of v, but those that also have `other`, have v at x with the normal n? */
static bool ring_allows(const improver *im, uint32_t v, uint32_t other, const double *x, const double *n) {
  const mesh_surface *s = im->s;
  uint32_t ring[SURFACE_RING_MAX];
  size_t count = mesh_surface_ring(s, v, ring);
  for (size_t i = 0; i < count; i++) {
    uint32_t p = s->origin[mesh_next(ring[i])], q = s->origin[mesh_previous(ring[i])];
    if (p == other || q == other) continue;
    if (other != MESH_NONE &&
        (vec_distance(x, point(s, p)) > LONG_EDGE * im->edge || vec_distance(x, point(s, q)) > LONG_EDGE * im->edge))
      return false;
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

/* Draws the origin of h into its end when that is allowed; to the middle where both may move. */
static bool try_collapse(improver *im, uint32_t h) {
  mesh_surface *s = im->s;
  uint32_t a = s->origin[h], b = s->origin[mesh_next(h)];
  if (box_faces(s, a) & ~box_faces(s, b)) return false; /* would leave a face of the box */
  if (!creases_allow(s, h)) return false;
  if (!mesh_surface_may_collapse(s, h)) return false;
  bool even = s->faces[a] == s->faces[b] && !(s->faces[a] & MESH_MARKS);
  double x[3], n[3];
  for (int k = 0; k < 3; k++) {
    x[k] = even ? 0.5 * point(s, a)[k] + 0.5 * point(s, b)[k] : point(s, b)[k];
    n[k] = (s->faces[b] & MESH_MARKS ? 0 : normal(s, a)[k]) + normal(s, b)[k];
  }
  vec_normalize(n);
  if (!ring_allows(im, a, b, x, n) || (even && !ring_allows(im, b, a, x, n))) return false;
  mesh_surface_collapse(s, h);
  memcpy(point(s, b), x, sizeof x);
  memcpy(normal(s, b), n, sizeof n);
  return true;
}

static void collapse_short(improver *im) {
  mesh_surface *s = im->s;
  for (uint32_t h = 0; h < 3 * s->triangle_count; h++) {
    if (s->origin[h] == MESH_NONE || !(edge_length(s, h) < SHORT_EDGE * im->edge)) continue;
    if (!try_collapse(im, h) && s->twin[h] != MESH_NONE) try_collapse(im, s->twin[h]);
  }
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
static bool wants_flip(const mesh_surface *s, uint32_t h) {
  uint32_t g = s->twin[h];
  if (g == MESH_NONE || h > g || s->sharp[h]) return false;
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

static void flip_sweeps(improver *im) {
  mesh_surface *s = im->s;
  for (int sweep = 0; sweep < FLIP_SWEEPS; sweep++) {
    size_t flips = 0;
    for (uint32_t h = 0; h < 3 * s->triangle_count; h++) {
      if (s->origin[h] == MESH_NONE || !wants_flip(s, h) || !mesh_surface_may_flip(s, h)) continue;
      mesh_surface_flip(s, h);
      flips++;
    }
    if (flips == 0) return;
  }
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
  if (count <= im->room) return BATTEN_OK;
  batten_free(ctx, im->target);
  batten_free(ctx, im->values);
  batten_free(ctx, im->gradients);
  im->room = 0;
  im->target = im->values = im->gradients = NULL;
  if (!(im->target = batten_alloc_array(ctx, count, 3 * sizeof *im->target)) ||
      !(im->values = batten_alloc_array(ctx, count, sizeof *im->values)) ||
      !(im->gradients = batten_alloc_array(ctx, count, 3 * sizeof *im->gradients)))
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

/* One pass over all vertices of the compacted surface; on_field: back to f = 0 after the move along the surface. */
static batten_status smooth(improver *im, bool on_field) {
  mesh_surface *s = im->s;
  batten_status st = make_room(im);
  if (st < 0) return st;
  for (uint32_t v = 0; v < s->vertex_count; v++) smooth_target(im, v, im->target + 3 * (size_t)v);
  if (on_field) st = batten_sampler_gradients(im->sampler, s->vertex_count, im->target, im->values, im->gradients);
  if (st < 0) return st;
  for (uint32_t v = 0; v < s->vertex_count; v++) {
    double *x = im->target + 3 * (size_t)v, n[3];
    if (s->faces[v] & MESH_MARKS) continue;
    memcpy(n, normal(s, v), sizeof n);
    if (on_field)
      batten_newton_step(3, im->values[v], im->gradients + 3 * (size_t)v, s->faces[v], STEP_MAX * im->edge, x, n);
    for (int attempt = 0; attempt < 3; attempt++) { /* all of the way, half, a quarter */
      if (in_box(im, x) && ring_allows(im, v, MESH_NONE, x, n)) {
        memcpy(point(s, v), x, sizeof n);
        memcpy(normal(s, v), n, sizeof n);
        break;
      }
      for (int k = 0; k < 3; k++) x[k] = 0.5 * x[k] + 0.5 * point(s, v)[k];
    }
  }
  return BATTEN_OK;
}

static void improver_free(improver *im) {
  batten_free(im->s->ctx, im->target);
  batten_free(im->s->ctx, im->values);
  batten_free(im->s->ctx, im->gradients);
}

static batten_status improve_round(improver *im, bool on_field) {
  batten_status st = split_long(im);
  if (st < 0) return st;
  collapse_short(im);
  flip_sweeps(im);
  st = mesh_surface_compact(im->s);
  if (st >= 0 && on_field && im->angle > 0) st = slide(im, 0.5);
  if (st >= 0) st = smooth(im, on_field);
  if (st >= 0) flip_sweeps(im);
  return st;
}

batten_status mesh_surface_improve(mesh_surface *s, batten_sampler *sampler, const double *lower, const double *upper,
                                   double edge, unsigned rounds) {
  improver im = {.s = s, .sampler = sampler, .lower = lower, .upper = upper, .edge = edge, .most = SIZE_MAX};
  batten_status st = BATTEN_OK;
  for (unsigned round = 0; st >= 0 && round < rounds; round++) {
    st = batten_progress(s->ctx, "improve", (double)round / rounds);
    if (st >= 0) st = improve_round(&im, round % 2 == 0 || round + 1 == rounds);
  }
  improver_free(&im);
  return st;
}

batten_status mesh_surface_improve_creased(mesh_surface *s, batten_sampler *sampler, const double *lower,
                                           const double *upper, double edge, double angle, unsigned rounds) {
  improver im = {.s = s, .sampler = sampler, .lower = lower, .upper = upper, .edge = edge, .angle = angle};
  im.most = 2 * s->triangle_count + 256;
  batten_status st = BATTEN_OK;
  for (unsigned round = 0; st >= 0 && round < rounds; round++) {
    st = batten_progress(s->ctx, "sharpen", (double)(round + 1) / (rounds + 1));
    if (st >= 0) st = improve_round(&im, round % 2 == 1);
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
