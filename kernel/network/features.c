/* Creases, corners, boundary curves and polylines of a network.
 *
 * An end of a crease is an edge at one of its vertices. Its tangent is fixed before the normals are known:
 *   two ends that turn by no more than the corner angle are mates: both lie along the tangent of the circle through
 *   the three vertices, corrected by how the circles change along the crease;
 *   a single end in the mesh's inside is a dart: the surface closes around it and tells the direction;
 *   all others are corners: an end lies along the tangent of the circle that continues the edge's other end, or along
 *   the edge when that is no better known; corners.c settles the rest.
 * The creases cut the fan of a vertex into sectors, which become the nodes. The tangents at its sides fix the plane
 * of a sector: wholly (NET_CORNER), or up to the turn about one line (NET_CREASED). The curvature of the crease,
 * which the surfaces on both sides share, is that of circles along its tangents through the next vertices. */
#include "features.h"

#include "base/checked.h"

#include <string.h>

static const double RADIANS = 0.017453292519943295769;

/* Below this angle two tangents at a corner count as one. */
static const double CUSP = 1e-6;

/* Angles of coordinates in single precision that are meant to be equal differ by so much: a prism with six sides
 * turns by 60 degrees at every corner. */
static const double SLACK = 1e-6;

/* ---- ends --------------------------------------------------------------------------------------- */

/* Tangent at the middle one of three vertices of their circle, from a towards b. False when there is none. */
static bool circle_tangent(const net_topology *t, uint32_t a, uint32_t b, double *out) {
  double p[3], q[3];
  end_chord(t, a, p);
  end_chord(t, b, q);
  double pp = vec_dot(p, p), qq = vec_dot(q, q);
  for (int k = 0; k < 3; k++) out[k] = q[k] / qq - p[k] / pp;
  return vec_normalize(out);
}

/* ---- which edges -------------------------------------------------------------------------------- */

/* The edge between two vertices, or NET_NONE: by the fan of the one with fewer triangles. */
static uint32_t find_edge(const features *f, const uint32_t *valence, uint32_t a, uint32_t b) {
  const net_topology *t = f->t;
  if (a >= t->vertices || b >= t->vertices || a == b) return NET_NONE;
  if (valence[b] < valence[a]) {
    uint32_t swap = a;
    a = b;
    b = swap;
  }
  uint32_t h = f->first[a], next;
  for (bool more = true; more; h = next) {
    if (t->triangles[net_next(h)] == b) return t->edge[h];
    if (t->triangles[net_prev(h)] == b) return t->edge[net_prev(h)];
    next = t->twin[net_prev(h)];
    more = next != NET_NONE && next != f->first[a];
  }
  return NET_NONE;
}

static double dihedral(const net_topology *t, uint32_t e) {
  uint32_t face[2] = {t->half[e] / 3, t->twin[t->half[e]] / 3};
  double n[2][3];
  for (int s = 0; s < 2; s++) {
    const uint32_t *v = t->triangles + 3 * (size_t)face[s];
    vec_triangle_normal(t->points + 3 * (size_t)v[0], t->points + 3 * (size_t)v[1], t->points + 3 * (size_t)v[2],
                        n[s]);
    vec_normalize(n[s]);
  }
  return angle_between(n[0], n[1]);
}

/* is_crease [edges]. */
static batten_status find_creases(batten_context *ctx, const features *f, const batten_network_options *opt,
                                  const uint32_t *valence, unsigned char *is_crease) {
  const net_topology *t = f->t;
  if (opt->crease_count && !opt->creases)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.creases: NULL; give %zu pairs of vertices", opt->crease_count);
  for (uint32_t e = 0; e < t->edges; e++) {
    bool boundary = is_boundary_edge(t, e);
    is_crease[e] = boundary ? opt->boundary_curves != 0
                            : opt->crease_angle_deg > 0 && dihedral(t, e) > opt->crease_angle_deg * RADIANS + SLACK;
  }
  for (size_t i = 0; i < opt->crease_count; i++) {
    const uint32_t *pair = opt->creases + 2 * i;
    uint32_t e = find_edge(f, valence, pair[0], pair[1]);
    if (e == NET_NONE)
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "opt.creases[%zu]: vertices %lu and %lu; give the ends of an edge of the mesh", i,
                         (unsigned long)pair[0], (unsigned long)pair[1]);
    is_crease[e] = 1;
  }
  return BATTEN_OK;
}

/* ---- tangents ----------------------------------------------------------------------------------- */

/* Mates and open ends at v; guides of mates. */
static void judge_vertex(features *f, uint32_t v) {
  size_t count = gather_ends(f, v);
  const uint32_t *ends = f->ends;
  double tangent[3];
  if (count == 1 && (!is_on_boundary(f, v) || is_boundary_edge(f->t, ends[0] / 2))) f->open[ends[0]] = 1;
  if (count == 2 && chord_turn(f->t, ends[0], ends[1]) <= f->corner_angle &&
      !share_triangle(f->t, ends[0], ends[1]) && circle_tangent(f->t, ends[0], ends[1], tangent))
    join_ends(f, ends[0], ends[1], tangent);
}

/* out = curvature vector of the circle that leaves along the end's guide and comes to the other vertex. */
static void end_curvature(const net_topology *t, uint32_t end, double *out) {
  const double *d = t->guide + 3 * (size_t)end;
  double chord[3];
  end_chord(t, end, chord);
  double square = vec_dot(chord, chord), along = vec_dot(chord, d);
  for (int k = 0; k < 3; k++) out[k] = 2 * (chord[k] - along * d[k]) / square;
}

static double end_length(const net_topology *t, uint32_t end) {
  double chord[3];
  end_chord(t, end, chord);
  return vec_norm(chord);
}

/* Change of the circles' curvature along the curve, out of the vertex of `end` over its edge, across the guide. False
 * at the curve's last circle. */
static bool end_slope(const features *f, uint32_t end, double *out) {
  uint32_t far = end ^ 1, beyond = f->mate[far];
  if (beyond == NET_NONE) return false;
  const double *d = f->t->guide + 3 * (size_t)end, *here = f->curvature + 3 * (size_t)end,
               *there = f->curvature + 3 * (size_t)far;
  double back = end_length(f->t, f->mate[end]), step = end_length(f->t, end), next = end_length(f->t, beyond);
  /* A circle has the curve's curvature at the middle of its three places. */
  double distance = step + (next - step) / 3 - (step - back) / 3;
  for (int k = 0; k < 3; k++) out[k] = (there[k] - here[k]) / distance;
  double along = vec_dot(out, d);
  for (int k = 0; k < 3; k++) out[k] -= along * d[k];
  return true;
}

/* Along a curve of curvature k + s k' the circle through places at -h1, 0, h2 has a tangent at 0 that is off by
 * h1 h2 k' / 6. k' is a mean of the changes on both sides, which is 0 as soon as one of them is or they disagree:
 * tangents of straight lines and of circles stay as they are, to the last vertex. */
static void refine_mates(features *f) {
  static const double turn_max = 0.1; /* 6 degrees; more comes of noise */
  net_topology *t = f->t;
  for (uint32_t end = 0; end < 2 * t->edges; end++)
    if (f->mate[end] != NET_NONE) end_curvature(t, end, f->curvature + 3 * (size_t)end);
  for (uint32_t b = 0; b < 2 * t->edges; b++) {
    uint32_t a = f->mate[b];
    double back[3], on[3], tangent[3];
    if (a == NET_NONE || b < a || !end_slope(f, a, back) || !end_slope(f, b, on)) continue;
    double p = vec_norm(back), q = vec_norm(on), agree = -vec_dot(back, on); /* back counts from b to a */
    if (!(agree > 0)) continue;
    double factor = agree / (p * q) / (p + q) * end_length(t, a) * end_length(t, b) / 6;
    for (int k = 0; k < 3; k++) tangent[k] = factor * (p * on[k] - q * back[k]);
    double turn = vec_norm(tangent), part = turn > turn_max ? turn_max / turn : 1;
    for (int k = 0; k < 3; k++) tangent[k] = t->guide[3 * (size_t)b + (size_t)k] - part * tangent[k];
    vec_normalize(tangent);
    join_ends(f, a, b, tangent);
  }
}

/* Guides of ends without mates. */
static void continue_ends(features *f) {
  net_topology *t = f->t;
  for (uint32_t end = 0; end < 2 * t->edges; end++) {
    if (t->kind[end / 2] != NET_CREASE || f->mate[end] != NET_NONE || f->open[end]) continue;
    double *guide = t->guide + 3 * (size_t)end, chord[3];
    end_chord(t, end, chord);
    if (f->mate[end ^ 1] == NET_NONE)
      memcpy(guide, chord, sizeof chord);
    else
      mirror(chord, t->guide + 3 * (size_t)(end ^ 1), guide);
    vec_normalize(guide);
  }
}

/* ---- curvatures --------------------------------------------------------------------------------- */

/* With a tangent that is right, the circles to both sides tell k - h1 k' / 3 and k + h2 k' / 3. */
static void find_bends(features *f) {
  net_topology *t = f->t;
  for (uint32_t end = 0; end < 2 * t->edges; end++)
    if (t->kind[end / 2] == NET_CREASE && !f->open[end]) end_curvature(t, end, t->bend + 3 * (size_t)end);
  for (uint32_t b = 0; b < 2 * t->edges; b++) {
    uint32_t a = f->mate[b];
    if (a == NET_NONE || b < a) continue;
    double *p = t->bend + 3 * (size_t)a, *q = t->bend + 3 * (size_t)b, h1 = end_length(t, a), h2 = end_length(t, b);
    for (int k = 0; k < 3; k++) p[k] = q[k] = (h2 * p[k] + h1 * q[k]) / (h1 + h2);
  }
}

/* ---- nodes -------------------------------------------------------------------------------------- */

/* The constraint of the sector from end a to end b, counter-clockwise; NET_NONE: a side without crease. */
static void constrain(const features *f, uint32_t a, uint32_t b, net_constraint *out) {
  *out = (net_constraint){.kind = NET_FREE};
  if (a == NET_NONE) {
    a = b;
    b = NET_NONE;
  }
  if (a == NET_NONE || f->open[a]) return;
  uint32_t ends[2] = {a, b};
  out->kind = NET_CREASED;
  if (b != NET_NONE && f->mate[a] != b) {
    double plane[3];
    vec_cross(f->t->guide + 3 * (size_t)a, f->t->guide + 3 * (size_t)b, plane);
    if (vec_norm(plane) > CUSP) out->kind = NET_CORNER;
  }
  for (size_t s = 0; s < (out->kind == NET_CORNER ? 2 : 1); s++) {
    memcpy(out->d[s], f->t->guide + 3 * (size_t)ends[s], sizeof out->d[s]);
    memcpy(out->k[s], f->t->bend + 3 * (size_t)ends[s], sizeof out->k[s]);
  }
}

/* Half-edge with which the sectors of v are counted: the boundary, else the first crease. */
static uint32_t sector_start(const features *f, uint32_t v) {
  const net_topology *t = f->t;
  uint32_t h = f->first[v];
  if (is_on_boundary(f, v)) return h;
  do {
    if (t->kind[t->edge[h]] == NET_CREASE) return h;
    h = t->twin[net_prev(h)];
  } while (h != f->first[v]);
  return h;
}

/* Sectors of v, from node on; the number of the next. node_vertex NULL: they are counted alone. */
static uint32_t number_sectors(const features *f, uint32_t v, uint32_t node, uint32_t *node_vertex,
                               uint32_t *node_first, net_constraint *constraint) {
  net_topology *t = f->t;
  uint32_t start = sector_start(f, v), h = start, begin = start, next;
  for (bool more = true; more; h = next) {
    if (node_vertex) t->node[h] = node;
    uint32_t in = net_prev(h);
    next = t->twin[in];
    more = next != NET_NONE && next != start;
    bool crease = t->kind[t->edge[in]] == NET_CREASE;
    if (more && !crease) continue;
    if (node_vertex) {
      bool from_crease = t->kind[t->edge[begin]] == NET_CREASE;
      node_vertex[node] = v;
      node_first[node] = begin;
      constrain(f, from_crease ? end_at_start(t, begin) : NET_NONE, crease ? end_at_end(t, in) : NET_NONE,
                constraint + node);
    }
    node++;
    begin = next;
  }
  return node;
}

static batten_status renumber_nodes(batten_context *ctx, features *f) {
  net_topology *t = f->t;
  uint32_t nodes = 0;
  for (uint32_t v = 0; v < t->vertices; v++) nodes = number_sectors(f, v, nodes, NULL, NULL, NULL);
  uint32_t *vertex = batten_alloc_array(ctx, nodes, sizeof *vertex);
  uint32_t *first = vertex ? batten_alloc_array(ctx, nodes, sizeof *first) : NULL;
  t->constraint = first ? batten_alloc_array(ctx, nodes, sizeof *t->constraint) : NULL;
  if (!t->constraint) {
    batten_free(ctx, first);
    batten_free(ctx, vertex);
    return BATTEN_E_NOMEM;
  }
  uint32_t node = 0;
  for (uint32_t v = 0; v < t->vertices; v++) node = number_sectors(f, v, node, vertex, first, t->constraint);
  batten_free(ctx, t->node_vertex);
  batten_free(ctx, t->node_first);
  t->node_vertex = vertex;
  t->node_first = first;
  t->nodes = nodes;
  return BATTEN_OK;
}

static batten_status make_creases(batten_context *ctx, features *f, const unsigned char *is_crease) {
  net_topology *t = f->t;
  bool any = false;
  for (uint32_t e = 0; e < t->edges; e++) {
    if (!is_crease[e]) continue;
    any = true;
    t->kind[e] = NET_CREASE;
    t->crease_edges++;
  }
  if (!any) return BATTEN_OK;
  t->bend = batten_alloc_array(ctx, t->edges, 6 * sizeof *t->bend);
  if (!t->bend) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < 6 * t->edges; i++) t->bend[i] = 0;
  for (uint32_t v = 0; v < t->vertices; v++) judge_vertex(f, v);
  refine_mates(f);
  continue_ends(f);
  for (uint32_t v = 0; v < t->vertices; v++) net_settle_corner(f, v);
  for (uint32_t v = 0; v < t->vertices; v++) net_split_walls(f, v);
  find_bends(f);
  return renumber_nodes(ctx, f);
}

/* ---- lines -------------------------------------------------------------------------------------- */

/* Line edges meet in a vertex: they become mates, unless the line has a corner there, or a crease stands between
 * them or tells the direction already. */
static void guide_line(features *f, uint32_t a, uint32_t b) {
  net_topology *t = f->t;
  double tangent[3];
  if (vec_norm(t->guide + 3 * (size_t)a) > 0 || vec_norm(t->guide + 3 * (size_t)b) > 0) return;
  if (net_edge_node(t, a / 2, a % 2, 0) != net_edge_node(t, b / 2, b % 2, 0)) return;
  if (chord_turn(t, a, b) > f->corner_angle || !circle_tangent(t, a, b, tangent)) return;
  join_ends(f, a, b, tangent);
}

static batten_status check_lines(batten_context *ctx, const batten_network_options *opt) {
  if (opt->line_count && (!opt->line_starts || !opt->line_vertices))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s: NULL; give %zu lines",
                       opt->line_starts ? "line_vertices" : "line_starts", opt->line_count);
  if (opt->line_count && opt->line_starts[0] != 0)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.line_starts[0]: %zu; it must be 0", opt->line_starts[0]);
  for (size_t i = 0; i < opt->line_count; i++)
    if (opt->line_starts[i + 1] < opt->line_starts[i] || opt->line_starts[i + 1] - opt->line_starts[i] < 2)
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "opt.line_starts[%zu]: %zu after %zu; a line has two vertices or more", i + 1,
                         opt->line_starts[i + 1], opt->line_starts[i]);
  return BATTEN_OK;
}

/* is_line [edges]: those seen. */
static batten_status make_line(batten_context *ctx, features *f, const uint32_t *valence, const uint32_t *vertices,
                               size_t from, size_t to, unsigned char *is_line) {
  net_topology *t = f->t;
  uint32_t head = NET_NONE, last = NET_NONE;
  for (size_t i = from; i + 1 < to; i++) {
    uint32_t a = vertices[i], b = vertices[i + 1], e = find_edge(f, valence, a, b);
    if (e == NET_NONE)
      return batten_fail(
          ctx, BATTEN_E_INVALID,
          "opt.line_vertices[%zu]: no edge from vertex %lu to vertex %lu; lines run along edges of the "
          "mesh",
          i + 1, (unsigned long)a, (unsigned long)b);
    if (is_line[e])
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "opt.line_vertices[%zu]: the edge from vertex %lu to vertex %lu is in a line already; give "
                         "an edge to one line, once",
                         i + 1, (unsigned long)a, (unsigned long)b);
    is_line[e] = 1;
    t->line_edges++;
    uint32_t begin = 2 * e + (end_vertex(t, 2 * e) != a);
    if (i == from) head = begin;
    if (i > from) guide_line(f, last, begin);
    last = begin ^ 1;
  }
  if (vertices[from] == vertices[to - 1]) guide_line(f, last, head);
  return BATTEN_OK;
}

static batten_status make_lines(batten_context *ctx, features *f, const batten_network_options *opt,
                                const uint32_t *valence, unsigned char *is_line) {
  memset(is_line, 0, f->t->edges);
  for (size_t i = 0; i < 2 * f->t->edges; i++) f->mate[i] = NET_NONE; /* those of creases are done with */
  batten_status st = BATTEN_OK;
  for (size_t i = 0; i < opt->line_count && st == BATTEN_OK; i++)
    st = make_line(ctx, f, valence, opt->line_vertices, opt->line_starts[i], opt->line_starts[i + 1], is_line);
  if (st == BATTEN_OK) refine_mates(f);
  return st;
}

static uint32_t count_valences(const net_topology *t, uint32_t *valence) {
  uint32_t most = 0;
  memset(valence, 0, t->vertices * sizeof *valence);
  for (size_t h = 0; h < 3 * t->faces; h++) {
    uint32_t count = ++valence[t->triangles[h]];
    most = count > most ? count : most;
  }
  return most;
}

batten_status net_features_make(batten_context *ctx, const batten_network_options *opt, net_topology *t) {
  bool wanted = opt->crease_angle_deg > 0 || opt->crease_count || opt->line_count ||
                (opt->boundary_curves && t->boundary_edges);
  if (!wanted) return BATTEN_OK;
  batten_status st = check_lines(ctx, opt);
  if (st < 0) return st;
  st = BATTEN_E_NOMEM;
  features f = {.t = t, .corner_angle = opt->corner_angle_deg * RADIANS + SLACK};
  unsigned char *is_chosen = NULL;
  uint32_t *valence = batten_alloc_array(ctx, t->vertices, sizeof *valence);
  if (!valence) goto done;
  uint32_t most = count_valences(t, valence);
  if (!(is_chosen = batten_alloc_array(ctx, t->edges, sizeof *is_chosen)) ||
      !(f.first = batten_alloc_array(ctx, t->vertices, sizeof *f.first)) ||
      !(f.mate = batten_alloc_array(ctx, 2 * t->edges, sizeof *f.mate)) ||
      !(f.open = batten_alloc_array(ctx, 2 * t->edges, sizeof *f.open)) ||
      !(f.ends = batten_alloc_array(ctx, (size_t)most + 1, sizeof *f.ends)) ||
      !(f.straight = batten_alloc_array(ctx, (size_t)most + 1, sizeof *f.straight)) ||
      !(f.curvature = batten_alloc_array(ctx, t->edges, 6 * sizeof *f.curvature)) ||
      !(t->guide = batten_alloc_array(ctx, t->edges, 6 * sizeof *t->guide)))
    goto done;
  memcpy(f.first, t->node_first, t->vertices * sizeof *f.first);
  for (size_t i = 0; i < 6 * t->edges; i++) t->guide[i] = 0;
  for (size_t i = 0; i < 2 * t->edges; i++) {
    f.mate[i] = NET_NONE;
    f.open[i] = 0;
  }
  st = find_creases(ctx, &f, opt, valence, is_chosen);
  if (st == BATTEN_OK) st = make_creases(ctx, &f, is_chosen);
  if (st == BATTEN_OK) st = make_lines(ctx, &f, opt, valence, is_chosen);
done:
  batten_free(ctx, f.curvature);
  batten_free(ctx, f.straight);
  batten_free(ctx, f.ends);
  batten_free(ctx, f.open);
  batten_free(ctx, f.mate);
  batten_free(ctx, f.first);
  batten_free(ctx, is_chosen);
  batten_free(ctx, valence);
  return st;
}
