/* Creases of f = 0 as chains of mesh edges (Kobbelt, Botsch, Schwanecke, Seidel 2001, "Feature sensitive surface
 * extraction from volume data"; the squared distances to tangent planes: Ju, Losasso, Schaefer, Warren 2002, "Dual
 * contouring of Hermite data").
 *
 * All vertices of the even mesh lie on f = 0, so that its triangles chamfer a crease. Edges whose ends have normals
 * that differ by more than the angle may cross one. Where they do is found with planes from both sides (crease.c),
 * and there they are split: the new vertices of a triangle with two such edges are joined by an edge that follows the
 * crease. A triangle with three of them has a corner, which goes between the three new vertices. A triangle over
 * whose corners the gradient turns but whose edges cross no crease may have a tip, as that of a cone. What is no
 * crease, or none that is found safely, stays as it was. Rounds of improvement that keep to the creases (improve.c)
 * follow, and all is tried once more where their ends lie apart. */
#include "sharp.h"

#include "base/checked.h"
#include "improve.h"
#include "project.h"
#include "vec.h"

#include <stdlib.h>
#include <string.h>

static const double CANDIDATE = 0.7;                 /* of the angle: between the normals at the ends of an edge */
static const double AVOID = 3;                       /* edges around places that could not be made sharp */
static const double FAN_REACH = 2, FAN_FACING = 0.8; /* around tips: edges, and a cosine that asks for a turn */
static const double MERGE = 0.1;                     /* corners nearer than so many edges are one */

enum { PASSES = 3, ROUNDS_FIRST = 4, ROUNDS_LATER = 2, FAN_MAX = 12 };

static double *point(const mesh_surface *s, uint32_t v) { return s->points + 3 * (size_t)v; }
static double *normal(const mesh_surface *s, uint32_t v) { return s->normals + 3 * (size_t)v; }
static bool is_marked(const mesh_surface *s, uint32_t v) { return (s->faces[v] & MESH_MARKS) != 0; }

/* ---- creases of the mesh ------------------------------------------------------------------------ */

/* Adds ring triangle h's normal and centre to a sheet. */
static void add_to_sheet(const mesh_surface *s, uint32_t h, double *n, double *centre) {
  const double *a = point(s, s->origin[h]), *b = point(s, s->origin[mesh_next(h)]);
  const double *c = point(s, s->origin[mesh_previous(h)]);
  double own[3];
  vec_triangle_normal(a, b, c, own);
  for (int k = 0; k < 3; k++) {
    n[k] += own[k];
    centre[k] += b[k] - a[k] + (c[k] - a[k]);
  }
}

/* The sheets beside v, inside of a crease: its triangles on both sides of the sharp edges. */
static bool crease_at(const mesh_surface *s, uint32_t v, double share, batten_crease *c) {
  uint32_t ring[SURFACE_RING_MAX];
  size_t count = mesh_surface_ring(s, v, ring), sharp = 0, ends[2] = {0, 0};
  bool boundary = count && mesh_surface_on_boundary(s, v);
  if (count == 0 || (s->faces[v] & MESH_CORNER)) return false;
  for (size_t i = 0; i < count; i++) {
    if (!s->sharp[ring[i]]) continue;
    if (sharp < 2) ends[sharp] = i;
    sharp++;
  }
  if (boundary ? sharp != 1 || ends[0] == 0 : sharp != 2) return false;
  *c = (batten_crease){.sheets = 2, .faces = (unsigned char)(s->faces[v] & ~MESH_MARKS), .found = true};
  memcpy(c->x, point(s, v), sizeof c->x);
  for (size_t i = 0; i < count; i++) {
    unsigned side = boundary ? i >= ends[0] : i >= ends[0] && i < ends[1];
    add_to_sheet(s, ring[i], c->normal[side], c->home[side]);
  }
  for (unsigned side = 0; side < 2; side++) {
    if (!vec_normalize(c->normal[side])) return false;
    if (c->faces) { /* stays on the box: the neighbour there tells the side */
      uint32_t h = side == 0 ? ring[0] : ring[count - 1];
      memcpy(c->home[side], point(s, s->origin[side == 0 ? mesh_next(h) : mesh_previous(h)]), sizeof c->x);
      continue;
    }
    for (unsigned k = 0; k < 3; k++) c->home[side][k] += c->x[k];
  }
  if (!boundary) {
    const double *p = point(s, s->origin[mesh_next(ring[ends[0]])]),
                 *q = point(s, s->origin[mesh_next(ring[ends[1]])]);
    for (unsigned k = 0; k < 3; k++) c->x[k] += share * (0.5 * (p[k] + q[k]) - c->x[k]);
  }
  return true;
}

batten_status mesh_surface_creases(const mesh_surface *s, double share, size_t *count, uint32_t **vertices,
                                   batten_crease **creases) {
  size_t room = 0, used = 0;
  for (uint32_t v = 0; v < s->vertex_count; v++) room += s->out[v] != MESH_NONE && is_marked(s, v);
  if (room == 0) return BATTEN_OK;
  if (!(*vertices = batten_alloc_array(s->ctx, room, sizeof **vertices)) ||
      !(*creases = batten_alloc_array(s->ctx, room, sizeof **creases)))
    return BATTEN_E_NOMEM;
  for (uint32_t v = 0; v < s->vertex_count; v++) {
    if (s->out[v] == MESH_NONE || !is_marked(s, v)) continue;
    if (!crease_at(s, v, share, *creases + used) || !batten_crease_aside(*creases + used)) continue;
    (*vertices)[used++] = v;
  }
  *count = used;
  return BATTEN_OK;
}

/* ---- where creases cross the mesh --------------------------------------------------------------- */

typedef struct centre_site {
  uint32_t triangle;    /* where it lies, as long as no edge of that is split */
  uint32_t vertices[3]; /* of that */
  uint32_t corners[3];  /* crossings of its sides; MESH_NONE: a tip within the triangle */
  double off;           /* of a tip, beside the middle of the triangle, seen along its normal */
} centre_site;

typedef struct sharpener {
  mesh_surface *s;
  batten_sampler *sampler;
  double edge, angle;
  const batten_tree *avoid; /* places to leave as they are */
  size_t crossing_count, centre_count, link_count;
  uint32_t *crossing_of;    /* [3 T] number of the crossing at a half-edge, or MESH_NONE */
  batten_crease *crossings; /* of creases and edges */
  uint32_t (*ends)[2];      /* of these edges */
  uint32_t *made;           /* the vertices there */
  batten_crease *centres;
  centre_site *sites;
  uint32_t (*links)[2]; /* crossings joined by a crease; the second may be a vertex: + crossing_count */
} sharpener;

static void sharpener_free(sharpener *w) {
  batten_context *ctx = w->s->ctx;
  batten_free(ctx, w->links);
  batten_free(ctx, w->sites);
  batten_free(ctx, w->centres);
  batten_free(ctx, w->made);
  batten_free(ctx, w->ends);
  batten_free(ctx, w->crossings);
  batten_free(ctx, w->crossing_of);
}

/* Unit normals from the gradients at the vertices themselves: they tell the sheet that a vertex lies in. */
static batten_status take_normals(mesh_surface *s, batten_sampler *sampler) {
  batten_context *ctx = s->ctx;
  double *values = batten_alloc_array(ctx, s->vertex_count, sizeof *values);
  double *gradients = values ? batten_alloc_array(ctx, s->vertex_count, 3 * sizeof *gradients) : NULL;
  batten_status st =
      gradients ? batten_sampler_gradients(sampler, s->vertex_count, s->points, values, gradients) : BATTEN_E_NOMEM;
  for (uint32_t v = 0; st >= 0 && v < s->vertex_count; v++) {
    double n[3];
    if (is_marked(s, v)) continue;
    for (size_t k = 0; k < 3; k++) n[k] = -gradients[3 * (size_t)v + k];
    if (vec_normalize(n)) memcpy(normal(s, v), n, sizeof n);
  }
  batten_free(ctx, gradients);
  batten_free(ctx, values);
  return st;
}

static bool has_near(const batten_tree *places, const double *x, double reach) {
  size_t nearest;
  double distance;
  return places && batten_tree_nearest(places, x, 1, SIZE_MAX, &nearest, &distance) == 1 && distance < reach;
}

bool mesh_surface_is_near(const double *x, double edge, const batten_tree *places) {
  return has_near(places, x, AVOID * edge);
}

static bool may_cross(const sharpener *w, uint32_t h) {
  const mesh_surface *s = w->s;
  uint32_t a = s->origin[h], b = s->origin[mesh_next(h)], g = s->twin[h];
  if ((g != MESH_NONE && g < h) || is_marked(s, a) || is_marked(s, b)) return false;
  if (!(vec_dot(normal(s, a), normal(s, b)) < cos(CANDIDATE * w->angle))) return false;
  return !mesh_surface_is_near(point(s, a), w->edge, w->avoid);
}

/* Of a crease that is there. */
static bool is_end(const mesh_surface *s, uint32_t v) {
  return is_marked(s, v) && mesh_surface_sharp_count(s, v) == 1;
}

/* A turn that is not narrow counts where it goes on with one that is, from triangle to triangle. */
static batten_status keep_continued(sharpener *w) {
  mesh_surface *s = w->s;
  size_t top = 0;
  uint32_t *waiting = batten_alloc_array(s->ctx, w->crossing_count, sizeof *waiting); /* half-edges */
  if (!waiting) return BATTEN_E_NOMEM;
  for (uint32_t h = 0; h < 3 * s->triangle_count; h++) {
    uint32_t i = w->crossing_of[h], g = s->twin[h];
    if (i == MESH_NONE || !w->crossings[i].found || (g != MESH_NONE && g < h)) continue;
    bool beside =
        is_end(s, s->origin[mesh_previous(h)]) || (g != MESH_NONE && is_end(s, s->origin[mesh_previous(g)]));
    if (beside) w->crossings[i].rounds = BATTEN_CREASE_ROUNDS;
    if (w->crossings[i].rounds >= BATTEN_CREASE_NARROW) waiting[top++] = h;
  }
  while (top > 0) {
    const uint32_t h = waiting[--top], sides[2] = {h, s->twin[h]};
    for (int k = 0; k < 2 && sides[k] != MESH_NONE; k++)
      for (uint32_t b = mesh_next(sides[k]); b != sides[k]; b = mesh_next(b)) {
        uint32_t i = w->crossing_of[b];
        if (i == MESH_NONE || !w->crossings[i].found || w->crossings[i].rounds >= BATTEN_CREASE_NARROW) continue;
        w->crossings[i].rounds = BATTEN_CREASE_NARROW;
        waiting[top++] = b;
      }
  }
  for (size_t i = 0; i < w->crossing_count; i++)
    if (w->crossings[i].rounds < BATTEN_CREASE_NARROW) w->crossings[i].found = false;
  batten_free(s->ctx, waiting);
  return BATTEN_OK;
}

static batten_status find_crossings(sharpener *w) {
  mesh_surface *s = w->s;
  size_t half_edges = 3 * s->triangle_count, count = 0;
  for (uint32_t h = 0; h < half_edges; h++) count += may_cross(w, h);
  w->crossing_count = count;
  if (count == 0) return BATTEN_OK;
  if (!(w->crossing_of = batten_alloc_array(s->ctx, half_edges, sizeof *w->crossing_of)) ||
      !(w->crossings = batten_alloc_array(s->ctx, count, sizeof *w->crossings)) ||
      !(w->ends = batten_alloc_array(s->ctx, count, sizeof *w->ends)) ||
      !(w->made = batten_alloc_array(s->ctx, count, sizeof *w->made)))
    return BATTEN_E_NOMEM;
  for (uint32_t h = 0; h < half_edges; h++) w->crossing_of[h] = MESH_NONE;
  uint32_t next = 0;
  for (uint32_t h = 0; h < half_edges; h++) {
    if (!may_cross(w, h)) continue;
    batten_crease *c = w->crossings + next;
    *c = (batten_crease){.sheets = 2};
    for (unsigned i = 0; i < 2; i++) {
      uint32_t v = w->ends[next][i] = i == 0 ? s->origin[h] : s->origin[mesh_next(h)];
      memcpy(c->home[i], point(s, v), sizeof c->home[i]);
      memcpy(c->normal[i], normal(s, v), sizeof c->normal[i]);
    }
    if (s->twin[h] == MESH_NONE)
      c->faces = s->faces[w->ends[next][0]] & s->faces[w->ends[next][1]] & (unsigned char)~MESH_MARKS;
    c->found = batten_crease_between(c);
    w->made[next] = MESH_NONE;
    w->crossing_of[h] = next;
    if (s->twin[h] != MESH_NONE) w->crossing_of[s->twin[h]] = next;
    next++;
  }
  batten_status st = batten_crease_refine(w->sampler, count, w->crossings, w->edge, w->angle);
  return st < 0 ? st : keep_continued(w);
}

/* A corner or a tip within triangle t. */
static batten_crease *add_centre(sharpener *w, uint32_t t, const uint32_t *corners) {
  const mesh_surface *s = w->s;
  batten_crease *c = w->centres + w->centre_count;
  centre_site *site = w->sites + w->centre_count++;
  *c = (batten_crease){.sheets = 3};
  site->triangle = t;
  for (uint32_t k = 0; k < 3; k++) {
    uint32_t v = s->origin[3 * t + k];
    site->vertices[k] = v;
    site->corners[k] = corners ? corners[k] : MESH_NONE;
    memcpy(c->home[k], point(s, v), sizeof c->home[k]);
    memcpy(c->normal[k], normal(s, v), sizeof c->normal[k]);
    for (unsigned d = 0; d < 3; d++) c->x[d] += point(s, v)[d] / 3;
  }
  double middle[3];
  memcpy(middle, c->x, sizeof middle);
  c->found = batten_crease_meet(c) && vec_distance(middle, c->x) < 2 * w->edge;
  return c;
}

static void add_link(sharpener *w, uint32_t a, uint32_t b) {
  w->links[w->link_count][0] = a;
  w->links[w->link_count++][1] = b;
}

/* What the crossings of the sides of triangle t make of it. */
static void take_triangle(sharpener *w, uint32_t t) {
  const mesh_surface *s = w->s;
  uint32_t found[3], opposite = 0;
  unsigned count = 0, candidates = 0, corner = 3;
  for (uint32_t k = 0; k < 3; k++) {
    uint32_t i = w->crossing_of[3 * t + k];
    candidates += i != MESH_NONE;
    if (i == MESH_NONE || !w->crossings[i].found) continue;
    if (w->crossings[i].sheets == 3) corner = count;
    opposite = s->origin[3 * t + (k + 2) % 3];
    found[count++] = i;
  }
  if (count == 0 && candidates == 3) add_centre(w, t, NULL);
  if (count == 1 && is_marked(s, opposite)) add_link(w, found[0], opposite + (uint32_t)w->crossing_count);
  if (count == 2) add_link(w, found[0], found[1]);
  if (count < 3) return;
  batten_crease *centre = add_centre(w, t, found);
  if (corner < 3) centre->found = false; /* it is there */
  for (unsigned k = 0; k < 3 && corner < 3; k++)
    if (k != corner) add_link(w, found[corner], found[k]);
}

/* The corners and tips in the mesh. *out NULL: there are none. */
static batten_status corner_places(const mesh_surface *s, batten_tree **out) {
  size_t count = 0;
  *out = NULL;
  for (uint32_t v = 0; v < s->vertex_count; v++) count += (s->faces[v] & MESH_CORNER) != 0;
  if (count == 0) return BATTEN_OK;
  double *places = batten_alloc_array(s->ctx, count, 3 * sizeof *places);
  if (!places) return BATTEN_E_NOMEM;
  count = 0;
  for (uint32_t v = 0; v < s->vertex_count; v++)
    if (s->faces[v] & MESH_CORNER) memcpy(places + 3 * count++, point(s, v), 3 * sizeof *places);
  batten_status st = batten_tree_new(s->ctx, 3, count, places, out);
  batten_free(s->ctx, places);
  return st;
}

/* How far beside its triangle each centre lies; tips at places that are taken are given up. */
static void measure_tips(sharpener *w, const batten_tree *taken) {
  const mesh_surface *s = w->s;
  for (size_t i = 0; i < w->centre_count; i++) {
    const uint32_t *v = w->sites[i].vertices;
    double n[3], d[3];
    vec_triangle_normal(point(s, v[0]), point(s, v[1]), point(s, v[2]), n);
    vec_normalize(n);
    for (size_t k = 0; k < 3; k++)
      d[k] = w->centres[i].x[k] - (point(s, v[0])[k] + point(s, v[1])[k] + point(s, v[2])[k]) / 3;
    double along = vec_dot(d, n);
    bool tip = w->sites[i].corners[0] == MESH_NONE;
    if (tip && w->centres[i].found && has_near(taken, w->centres[i].x, w->edge)) w->centres[i].found = false;
    w->sites[i].off = sqrt(fmax(0, vec_dot(d, d) - along * along));
  }
}

static int compare_indices(const void *a, const void *b) {
  size_t x = *(const size_t *)a, y = *(const size_t *)b;
  return (x > y) - (x < y);
}

/* Several triangles around a tip may find it: the one stays that it lies above. tips [count]: centres, of which
 * places are the tree; near [count] is scratch. */
static void thin_tips(sharpener *w, size_t count, const size_t *tips, const batten_tree *places, size_t *near) {
  for (size_t i = 0; i < count; i++) {
    batten_crease *a = w->centres + tips[i];
    size_t found = batten_tree_within(places, a->x, 0.5 * w->edge, near);
    qsort(near, found, sizeof *near, compare_indices);
    for (size_t j = 0; j < found && near[j] < i; j++) {
      batten_crease *b = w->centres + tips[near[j]];
      if (!a->found || !b->found) continue;
      if (w->sites[tips[i]].off < w->sites[tips[near[j]]].off)
        b->found = false;
      else
        a->found = false;
    }
  }
}

static batten_status choose_tips(sharpener *w) {
  batten_context *ctx = w->s->ctx;
  size_t count = 0, *tips = NULL, *near = NULL;
  double *places = NULL;
  batten_tree *taken = NULL, *tree = NULL;
  batten_status st = corner_places(w->s, &taken);
  if (st < 0) return st;
  measure_tips(w, taken);
  batten_tree_free(ctx, taken);
  if (!(tips = batten_alloc_array(ctx, w->centre_count, sizeof *tips)) ||
      !(near = batten_alloc_array(ctx, w->centre_count, sizeof *near)) ||
      !(places = batten_alloc_array(ctx, w->centre_count, 3 * sizeof *places)))
    st = BATTEN_E_NOMEM;
  for (size_t i = 0; st >= 0 && i < w->centre_count; i++) {
    if (!w->centres[i].found || w->sites[i].corners[0] != MESH_NONE) continue;
    memcpy(places + 3 * count, w->centres[i].x, 3 * sizeof *places);
    tips[count++] = i;
  }
  if (st >= 0 && count > 1) st = batten_tree_new(ctx, 3, count, places, &tree);
  if (tree) thin_tips(w, count, tips, tree, near);
  batten_tree_free(ctx, tree);
  batten_free(ctx, places);
  batten_free(ctx, near);
  batten_free(ctx, tips);
  return st < 0 ? st : BATTEN_OK;
}

static batten_status find_centres(sharpener *w) {
  mesh_surface *s = w->s;
  size_t touched = 0;
  for (uint32_t t = 0; t < s->triangle_count; t++)
    for (uint32_t k = 0; k < 3; k++)
      if (w->crossing_of[3 * t + k] != MESH_NONE) {
        touched++;
        break;
      }
  if (!(w->centres = batten_alloc_array(s->ctx, touched, sizeof *w->centres)) ||
      !(w->sites = batten_alloc_array(s->ctx, touched, sizeof *w->sites)) ||
      !(w->links = batten_alloc_array(s->ctx, touched, 2 * sizeof *w->links)))
    return BATTEN_E_NOMEM;
  for (uint32_t t = 0; t < s->triangle_count; t++) take_triangle(w, t);
  batten_status st = batten_crease_refine(w->sampler, w->centre_count, w->centres, w->edge, w->angle);
  for (size_t i = 0; i < w->centre_count; i++) /* tips; corners are where creases meet that are */
    if (w->sites[i].corners[0] == MESH_NONE && w->centres[i].rounds < BATTEN_CREASE_NARROW)
      w->centres[i].found = false;
  return st >= 0 ? choose_tips(w) : st;
}

/* ---- putting them into the mesh ----------------------------------------------------------------- */

static void set_normal(const mesh_surface *s, uint32_t v, const batten_crease *c) {
  double *n = normal(s, v);
  for (unsigned k = 0; k < 3; k++) {
    n[k] = 0;
    for (unsigned i = 0; i < c->sheets; i++) n[k] += c->normal[i][k];
  }
  vec_normalize(n);
}

static batten_status split_crossings(sharpener *w) {
  mesh_surface *s = w->s;
  for (size_t i = 0; i < w->crossing_count; i++) {
    const batten_crease *c = w->crossings + i;
    if (!c->found) continue;
    uint32_t h = mesh_surface_find(s, w->ends[i][0], w->ends[i][1]);
    if (h == MESH_NONE && (h = mesh_surface_find(s, w->ends[i][1], w->ends[i][0])) == MESH_NONE) continue;
    uint32_t m = mesh_surface_split(s, h, c->x);
    if (m == MESH_NONE) return BATTEN_E_NOMEM;
    s->faces[m] |= c->sheets == 3 ? MESH_CREASE | MESH_CORNER : MESH_CREASE;
    set_normal(s, m, c);
    w->made[i] = m;
  }
  return BATTEN_OK;
}

static void make_sharp(mesh_surface *s, uint32_t a, uint32_t b) {
  uint32_t h = mesh_surface_find(s, a, b), g = mesh_surface_find(s, b, a);
  if (h != MESH_NONE) s->sharp[h] = 1;
  if (g != MESH_NONE) s->sharp[g] = 1;
}

/* A triangle split at three sides has the new vertices as one of its four parts once two of these are turned. */
static void open_centres(sharpener *w) {
  mesh_surface *s = w->s;
  for (size_t i = 0; i < w->centre_count; i++) {
    const uint32_t *around = w->sites[i].corners;
    if (around[0] == MESH_NONE) continue;
    for (int k = 0; k < 3; k++) {
      uint32_t a = w->made[around[k]], b = w->made[around[(k + 1) % 3]], c = w->made[around[(k + 2) % 3]];
      if (a == MESH_NONE || b == MESH_NONE || c == MESH_NONE) break;
      if (mesh_surface_find(s, a, b) != MESH_NONE || mesh_surface_find(s, b, a) != MESH_NONE) continue;
      uint32_t h = mesh_surface_find(s, c, w->sites[i].vertices[(k + 1) % 3]);
      if (h != MESH_NONE && mesh_surface_may_flip(s, h)) mesh_surface_flip(s, h);
    }
  }
}

/* How well a triangle faces as the surface does at its corners but corners of creases: a cosine. */
static double facing(const mesh_surface *s, uint32_t a, uint32_t b, uint32_t c) {
  const uint32_t v[3] = {a, b, c};
  double n[3], worst = 1;
  vec_triangle_normal(point(s, a), point(s, b), point(s, c), n);
  if (!vec_normalize(n)) return -1;
  for (int k = 0; k < 3; k++)
    if (!(s->faces[v[k]] & MESH_CORNER)) worst = fmin(worst, vec_dot(n, normal(s, v[k])));
  return worst;
}

/* Joins the tip m to the vertices around it: triangles that chamfer it lie beyond the edges opposite to it, which are
 * turned where the two triangles then face better. */
static void fan_out(mesh_surface *s, uint32_t m, double reach) {
  uint32_t ring[SURFACE_RING_MAX];
  for (int turns = 0; turns < FAN_MAX; turns++) {
    size_t count = mesh_surface_ring(s, m, ring);
    uint32_t best = MESH_NONE;
    double gain = 0;
    for (size_t i = 0; i < count; i++) {
      uint32_t h = mesh_next(ring[i]), g = s->twin[h];
      if (g == MESH_NONE || s->sharp[h] || !mesh_surface_may_flip(s, h)) continue;
      uint32_t a = s->origin[h], b = s->origin[g], d = s->origin[mesh_previous(g)];
      double before = fmin(facing(s, a, b, m), facing(s, b, a, d));
      if (before > FAN_FACING || vec_distance(point(s, m), point(s, d)) > reach) continue;
      double after = fmin(facing(s, m, a, d), facing(s, m, d, b));
      if (!(after - before > gain)) continue;
      gain = after - before;
      best = h;
    }
    if (best == MESH_NONE) return;
    mesh_surface_flip(s, best);
  }
}

static batten_status poke_centres(sharpener *w) {
  mesh_surface *s = w->s;
  for (size_t i = 0; i < w->centre_count; i++) {
    const batten_crease *c = w->centres + i;
    const uint32_t *around = w->sites[i].corners;
    uint32_t v[3] = {MESH_NONE, MESH_NONE, MESH_NONE}, t = w->sites[i].triangle;
    if (!c->found) continue;
    if (around[0] != MESH_NONE) {
      for (int k = 0; k < 3; k++) v[k] = w->made[around[k]];
      if (v[0] == MESH_NONE || v[1] == MESH_NONE || v[2] == MESH_NONE) continue;
      uint32_t h = mesh_surface_find(s, v[0], v[1]);
      if (h == MESH_NONE || s->origin[mesh_previous(h)] != v[2]) continue;
      t = h / 3;
    }
    uint32_t m = mesh_surface_poke(s, t, c->x);
    if (m == MESH_NONE) return BATTEN_E_NOMEM;
    s->faces[m] = MESH_CREASE | MESH_CORNER;
    set_normal(s, m, c);
    for (int k = 0; k < 3; k++)
      if (v[k] != MESH_NONE) make_sharp(s, m, v[k]);
    if (v[0] == MESH_NONE) fan_out(s, m, FAN_REACH * w->edge);
  }
  return BATTEN_OK;
}

static void join_links(sharpener *w) {
  for (size_t i = 0; i < w->link_count; i++) {
    uint32_t a = w->made[w->links[i][0]], b = w->links[i][1];
    b = b < w->crossing_count ? w->made[b] : b - (uint32_t)w->crossing_count;
    if (a != MESH_NONE && b != MESH_NONE) make_sharp(w->s, a, b);
  }
}

/* Ends of creases that are neighbours belong to one; places that were found twice become one. */
static void tidy(mesh_surface *s, double edge, double angle) {
  for (uint32_t h = 0; h < 3 * s->triangle_count; h++) {
    uint32_t a = s->origin[h];
    if (a == MESH_NONE) continue;
    uint32_t b = s->origin[mesh_next(h)];
    bool one = is_marked(s, a) && is_marked(s, b) && vec_distance(point(s, a), point(s, b)) < MERGE * edge;
    if (!one || ((s->faces[a] & ~s->faces[b]) && s->faces[a] != MESH_MARKS)) continue;
    if ((s->faces[a] & MESH_CORNER) && !(s->faces[b] & MESH_CORNER)) continue;
    if (mesh_surface_may_collapse(s, h)) mesh_surface_collapse(s, h);
  }
  for (uint32_t h = 0; h < 3 * s->triangle_count; h++) {
    uint32_t a = s->origin[h], g = s->twin[h];
    if (a == MESH_NONE || g == MESH_NONE || s->sharp[h] || h > g) continue;
    uint32_t b = s->origin[g];
    if (!is_marked(s, a) || !is_marked(s, b)) continue;
    if (mesh_surface_sharp_count(s, a) != 1 || mesh_surface_sharp_count(s, b) != 1) continue;
    double left[3], right[3];
    vec_triangle_normal(point(s, a), point(s, b), point(s, s->origin[mesh_previous(h)]), left);
    vec_triangle_normal(point(s, b), point(s, a), point(s, s->origin[mesh_previous(g)]), right);
    if (vec_normalize(left) && vec_normalize(right) && vec_dot(left, right) < cos(angle)) make_sharp(s, a, b);
  }
  for (uint32_t v = 0; v < s->vertex_count; v++)
    if (s->out[v] != MESH_NONE && (s->faces[v] & MESH_MARKS) == MESH_CREASE && mesh_surface_sharp_count(s, v) == 0)
      s->faces[v] &= (unsigned char)~MESH_MARKS;
}

/* One pass over the compacted surface: *found is the number of places where creases were put into the mesh. */
static batten_status insert(mesh_surface *s, batten_sampler *sampler, double edge, double angle,
                            const batten_tree *avoid, size_t *found) {
  sharpener w = {.s = s, .sampler = sampler, .edge = edge, .angle = angle, .avoid = avoid};
  *found = 0;
  batten_status st = take_normals(s, sampler);
  if (st >= 0) st = find_crossings(&w);
  if (st >= 0 && w.crossing_count) st = find_centres(&w);
  for (size_t i = 0; st >= 0 && i < w.crossing_count; i++) *found += w.crossings[i].found;
  for (size_t i = 0; st >= 0 && i < w.centre_count; i++) *found += w.centres[i].found;
  if (st >= 0 && *found) {
    st = split_crossings(&w);
    if (st >= 0) open_centres(&w);
    if (st >= 0) join_links(&w);
    if (st >= 0) st = poke_centres(&w);
    if (st >= 0) tidy(s, edge, angle);
  }
  sharpener_free(&w);
  return st;
}

batten_status mesh_surface_sharpen(mesh_surface *s, batten_sampler *sampler, const double *lower, const double *upper,
                                   double edge, double angle, const batten_tree *avoid, size_t *count) {
  batten_status st = batten_progress(s->ctx, "sharpen", 0);
  *count = 0;
  for (int pass = 0; st >= 0 && pass < PASSES; pass++) {
    size_t found;
    st = insert(s, sampler, edge, angle, avoid, &found);
    if (st < 0 || found == 0) break;
    st = mesh_surface_improve_creased(s, sampler, lower, upper, edge, angle, pass == 0 ? ROUNDS_FIRST : ROUNDS_LATER);
    if (st >= 0) tidy(s, edge, angle);
    if (st >= 0) st = mesh_surface_compact(s);
  }
  for (uint32_t v = 0; st >= 0 && v < s->vertex_count; v++) *count += is_marked(s, v);
  return st;
}
