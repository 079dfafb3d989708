/* Outlines of plane solids: marching triangles from the seeds along f = 0, then even spacing. See <batten/mesh.h>.
 *
 * Squares of the lattice are cut into four triangles by their centre; lattice coordinates are doubled, so corners are
 * even, centres odd. A triangle has the square's centre c and the side at c + s e_m, from there - e_p to + e_p. Each
 * crossed triangle has one piece of the outline, which enters through one side and leaves through another with the
 * solid on its left; pieces are chained at the crossed edges. The squares fill the box, so chains end on the box or
 * are closed. Chains are then divided anew at equal distances along them and put on f = 0, a few times over. */
#include "polygonize.h"
#include "project.h"
#include "table.h"

#include "base/checked.h"

#include <string.h>

enum {
  COORDINATE_BITS = 30,
  SQUARES_MAX = 1 << (COORDINATE_BITS - 2),
  SEED_REACH = 2, /* squares around a seed in which the outline is looked for */
  DIVISIONS = 4,  /* times that a chain is divided anew */
  LOOP_LEAST = 8, /* vertices of the smallest loop */
  CHAIN_LEAST = 2,
};

/* Crossings keep this share of their edge from its ends: no piece is degenerate. */
static const double END_MARGIN = 0.15;

struct batten_outline {
  batten_context *ctx;
  size_t loop_count, vertex_count;
  size_t *first;         /* [loops + 1] */
  unsigned char *closed; /* [loops] */
  double *vertices;      /* [vertex_count][2] */
  double area, length;
};

typedef struct walker {
  batten_sampler *sampler;
  batten_context *ctx;
  double lower[2], upper[2], half[2];
  int32_t limit[2];
  batten_table nodes, triangles, edges; /* packed node -> number; triangle -> crossed; two nodes -> vertex */
  uint64_t *node_keys, *front, *next, *crossed;
  double *values;
  size_t node_count, evaluated, front_count, next_count, crossed_count;
  size_t node_capacity, value_capacity, front_capacity, next_capacity, crossed_capacity;
  /* The chained pieces. */
  double *vertices;     /* [V][2] */
  unsigned char *faces; /* [V] */
  uint32_t *following;  /* [V] next vertex, or UINT32_MAX */
  unsigned char *head;  /* [V] 1: none comes before */
  size_t vertex_count, vertices_capacity, faces_capacity, following_capacity, head_capacity;
} walker;

/* ---- the lattice -------------------------------------------------------------------------------- */

static uint64_t pack(const int32_t *c) {
  return (uint64_t)(uint32_t)c[0] << COORDINATE_BITS | (uint64_t)(uint32_t)c[1];
}

static void unpack(uint64_t key, int32_t *c) {
  c[0] = (int32_t)(key >> COORDINATE_BITS);
  c[1] = (int32_t)(key & (((uint64_t)1 << COORDINATE_BITS) - 1));
}

static uint64_t triangle_number(const int32_t *c, int m, int s) {
  return pack(c) << 2 | (uint64_t)m << 1 | (uint64_t)(s > 0);
}

/* Centre, then the ends of the side, counter-clockwise. */
static void triangle_nodes(uint64_t number, uint64_t *keys) {
  int32_t c[2], side[2];
  unpack(number >> 2, c);
  int m = (int)(number >> 1 & 1), s = number & 1 ? 1 : -1;
  int turn = (m == 0 ? 1 : -1) * s; /* e_m, then e_p: counter-clockwise for m = 0 */
  keys[0] = pack(c);
  for (int i = 0; i < 2; i++) {
    side[m] = c[m] + s;
    side[1 - m] = c[1 - m] + (i == 0 ? -turn : turn);
    keys[1 + i] = pack(side);
  }
}

/* The triangle across the edge opposite node i of triangle_nodes; false at the box. */
static bool neighbour(const walker *w, uint64_t number, int i, uint64_t *beyond) {
  int32_t c[2];
  unpack(number >> 2, c);
  int m = (int)(number >> 1 & 1), s = number & 1 ? 1 : -1, turn = (m == 0 ? 1 : -1) * s;
  if (i > 0) { /* the edge from the centre to the other end of the side */
    *beyond = triangle_number(c, 1 - m, i == 1 ? turn : -turn);
    return true;
  }
  c[m] += 2 * s;
  if (c[m] < 0 || c[m] > w->limit[m]) return false;
  *beyond = triangle_number(c, m, -s);
  return true;
}

static void node_position(const walker *w, uint64_t key, double *x) {
  int32_t c[2];
  unpack(key, c);
  for (int k = 0; k < 2; k++) x[k] = c[k] == w->limit[k] ? w->upper[k] : w->lower[k] + c[k] * w->half[k];
}

/* ---- the front ---------------------------------------------------------------------------------- */

static batten_status push(walker *w, uint64_t number) {
  int is_new;
  if (!batten_table_insert(w->ctx, &w->triangles, number, 0, &is_new)) return BATTEN_E_NOMEM;
  if (!is_new) return BATTEN_OK;
  if (batten_reserve(w->ctx, (void **)&w->next, &w->next_capacity, w->next_count + 1, sizeof *w->next) < 0)
    return BATTEN_E_NOMEM;
  w->next[w->next_count++] = number;
  return BATTEN_OK;
}

static batten_status add_nodes(walker *w, uint64_t number) {
  uint64_t keys[3];
  triangle_nodes(number, keys);
  for (int i = 0; i < 3; i++) {
    int is_new;
    if (w->node_count >= UINT32_MAX)
      return batten_fail(w->ctx, BATTEN_E_TOO_LARGE, "opt.cell: %zu lattice nodes are too many; enlarge it",
                         w->node_count);
    if (!batten_table_insert(w->ctx, &w->nodes, keys[i], (uint32_t)w->node_count, &is_new)) return BATTEN_E_NOMEM;
    if (!is_new) continue;
    if (batten_reserve(w->ctx, (void **)&w->node_keys, &w->node_capacity, w->node_count + 1, sizeof *w->node_keys) <
        0)
      return BATTEN_E_NOMEM;
    w->node_keys[w->node_count++] = keys[i];
  }
  return BATTEN_OK;
}

static batten_status evaluate_new_nodes(walker *w) {
  size_t count = w->node_count - w->evaluated;
  if (batten_reserve(w->ctx, (void **)&w->values, &w->value_capacity, w->node_count, sizeof *w->values) < 0)
    return BATTEN_E_NOMEM;
  double *points = batten_alloc_array(w->ctx, count, 2 * sizeof *points);
  if (!points) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < count; i++) node_position(w, w->node_keys[w->evaluated + i], points + 2 * i);
  batten_status st = batten_sampler_values(w->sampler, count, points, w->values + w->evaluated);
  batten_free(w->ctx, points);
  if (st < 0) return st;
  w->evaluated = w->node_count;
  return BATTEN_OK;
}

/* Nodes of a triangle by number, and how many are inside. */
static int look_up(const walker *w, uint64_t number, uint32_t *node, bool *inside) {
  uint64_t keys[3];
  int count = 0;
  triangle_nodes(number, keys);
  for (int i = 0; i < 3; i++) {
    node[i] = *batten_table_find(&w->nodes, keys[i]);
    count += inside[i] = w->values[node[i]] >= 0;
  }
  return count;
}

static batten_status cross_one(walker *w, uint64_t number) {
  uint32_t node[3];
  bool inside[3];
  int count = look_up(w, number, node, inside);
  if (count == 0 || count == 3) return BATTEN_OK;
  *batten_table_find(&w->triangles, number) = 1;
  if (batten_reserve(w->ctx, (void **)&w->crossed, &w->crossed_capacity, w->crossed_count + 1, sizeof *w->crossed) <
      0)
    return BATTEN_E_NOMEM;
  w->crossed[w->crossed_count++] = number;
  for (int i = 0; i < 3; i++) {
    uint64_t beyond;
    if (count - inside[i] == 1 && neighbour(w, number, i, &beyond) && push(w, beyond) < 0) return BATTEN_E_NOMEM;
  }
  return BATTEN_OK;
}

static batten_status run_fronts(walker *w) {
  while (w->next_count > 0) {
    uint64_t *list = w->front;
    size_t capacity = w->front_capacity;
    w->front = w->next;
    w->front_count = w->next_count;
    w->front_capacity = w->next_capacity;
    w->next = list;
    w->next_count = 0;
    w->next_capacity = capacity;
    batten_status st = BATTEN_OK;
    for (size_t i = 0; st >= 0 && i < w->front_count; i++) st = add_nodes(w, w->front[i]);
    if (st >= 0) st = evaluate_new_nodes(w);
    for (size_t i = 0; st >= 0 && i < w->front_count; i++) st = cross_one(w, w->front[i]);
    double found = (double)w->crossed_count, left = (double)w->next_count;
    if (st >= 0) st = batten_progress(w->ctx, "outline", found > 0 ? found / (found + 4 * left + 1) : 0);
    if (st < 0) return st;
  }
  return BATTEN_OK;
}

/* ---- seeds -------------------------------------------------------------------------------------- */

static bool seed_square(const walker *w, const double *seed, int32_t *square) {
  for (int k = 0; k < 2; k++) {
    if (!(seed[k] >= w->lower[k] && seed[k] <= w->upper[k])) return false;
    square[k] = 2 * (int32_t)((seed[k] - w->lower[k]) / w->half[k] / 2) + 1;
    if (square[k] > w->limit[k] - 1) square[k] = w->limit[k] - 1;
  }
  return true;
}

static int visit_around(walker *w, const int32_t *square, int32_t reach, int (*visit)(walker *, uint64_t)) {
  int32_t side = 2 * reach + 1;
  for (int32_t i = 0; i < side * side; i++) {
    int32_t c[2] = {square[0] + 2 * (i % side - reach), square[1] + 2 * (i / side - reach)};
    if (c[0] < 0 || c[1] < 0 || c[0] > w->limit[0] || c[1] > w->limit[1]) continue;
    for (int edge = 0; edge < 4; edge++) {
      int answer = visit(w, triangle_number(c, edge / 2, edge % 2 ? 1 : -1));
      if (answer) return answer;
    }
  }
  return 0;
}

static int visit_push(walker *w, uint64_t number) { return push(w, number) < 0; }

static int visit_crossed(walker *w, uint64_t number) {
  uint32_t *state = batten_table_find(&w->triangles, number);
  return state && *state;
}

/* The squares of the seeds, then the squares around those of seeds that found nothing. */
static batten_status run_seeds(walker *w, size_t seed_count, const double *seeds, unsigned char *missed) {
  batten_status st = BATTEN_OK;
  int32_t square[2];
  memset(missed, 1, seed_count);
  for (int32_t reach = 0; reach <= SEED_REACH; reach++) {
    for (size_t i = 0; st >= 0 && i < seed_count; i++)
      if (missed[i] && seed_square(w, seeds + 2 * i, square) && visit_around(w, square, reach, visit_push))
        st = BATTEN_E_NOMEM;
    if (st >= 0) st = run_fronts(w);
    for (size_t i = 0; st >= 0 && i < seed_count; i++)
      if (missed[i] && seed_square(w, seeds + 2 * i, square))
        missed[i] = !visit_around(w, square, reach, visit_crossed);
  }
  return st;
}

/* ---- pieces and chains -------------------------------------------------------------------------- */

static void place_vertex(walker *w, uint32_t a, uint32_t b) {
  if (w->node_keys[a] > w->node_keys[b]) { /* one order for both triangles of the edge */
    uint32_t t = a;
    a = b;
    b = t;
  }
  int32_t ca[2], cb[2];
  double p[2], q[2], t = w->values[a] / (w->values[a] - w->values[b]);
  if (!(t > END_MARGIN)) t = END_MARGIN;
  if (t > 1 - END_MARGIN) t = 1 - END_MARGIN;
  unpack(w->node_keys[a], ca);
  unpack(w->node_keys[b], cb);
  node_position(w, w->node_keys[a], p);
  node_position(w, w->node_keys[b], q);
  unsigned char *faces = w->faces + w->vertex_count;
  *faces = 0;
  for (int k = 0; k < 2; k++) {
    w->vertices[2 * w->vertex_count + (size_t)k] = ca[k] == cb[k] ? p[k] : p[k] + t * (q[k] - p[k]);
    if (ca[k] == cb[k] && ca[k] == 0) *faces |= (unsigned char)(BATTEN_LOWER_FACE << 2 * k);
    if (ca[k] == cb[k] && ca[k] == w->limit[k]) *faces |= (unsigned char)(BATTEN_UPPER_FACE << 2 * k);
  }
  w->following[w->vertex_count] = UINT32_MAX;
  w->head[w->vertex_count++] = 1;
}

static batten_status add_vertex(walker *w, uint32_t a, uint32_t b, uint32_t *vertex) {
  int is_new;
  uint64_t key = a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a;
  size_t n = w->vertex_count + 1;
  if (n >= UINT32_MAX)
    return batten_fail(w->ctx, BATTEN_E_TOO_LARGE, "opt.cell: %zu vertices are too many; enlarge it", n);
  uint32_t *place = batten_table_insert(w->ctx, &w->edges, key, (uint32_t)w->vertex_count, &is_new);
  if (!place) return BATTEN_E_NOMEM;
  *vertex = *place;
  if (!is_new) return BATTEN_OK;
  if (batten_reserve(w->ctx, (void **)&w->vertices, &w->vertices_capacity, n, 2 * sizeof *w->vertices) < 0 ||
      batten_reserve(w->ctx, (void **)&w->faces, &w->faces_capacity, n, 1) < 0 ||
      batten_reserve(w->ctx, (void **)&w->following, &w->following_capacity, n, sizeof *w->following) < 0 ||
      batten_reserve(w->ctx, (void **)&w->head, &w->head_capacity, n, 1) < 0)
    return BATTEN_E_NOMEM;
  place_vertex(w, a, b);
  return BATTEN_OK;
}

static batten_status extract(walker *w) {
  batten_status st = batten_sort_keys(w->ctx, w->crossed_count, w->crossed);
  for (size_t i = 0; st >= 0 && i < w->crossed_count; i++) {
    uint32_t node[3], ends[2];
    bool inside[3];
    int count = look_up(w, w->crossed[i], node, inside), lone = 0;
    while (inside[lone] != (count == 1)) lone++;
    /* Around a lone inside node the solid is on the left from its next edge to its previous one. */
    for (int e = 0; st >= 0 && e < 2; e++) {
      int other = (lone + ((e == 0) == (count == 1) ? 1 : 2)) % 3;
      st = add_vertex(w, node[lone], node[other], ends + e);
    }
    if (st < 0) break;
    w->following[ends[0]] = ends[1];
    w->head[ends[1]] = 0;
  }
  return st;
}

/* ---- even chains -------------------------------------------------------------------------------- */

static double distance2(const double *a, const double *b) { return hypot(b[0] - a[0], b[1] - a[1]); }

/* Writes the chain that starts at vertex v to path (a closed one with its first vertex again at the end): how many.
 */
static size_t follow(const walker *w, uint32_t v, unsigned char *seen, double *path, unsigned char *faces) {
  size_t count = 0;
  uint32_t start = v;
  do {
    seen[v] = 1;
    memcpy(path + 2 * count, w->vertices + 2 * (size_t)v, 2 * sizeof *path);
    faces[count++] = w->faces[v];
    v = w->following[v];
  } while (v != UINT32_MAX && v != start);
  if (v == start) {
    memcpy(path + 2 * count, path, 2 * sizeof *path);
    faces[count] = faces[0];
    count++;
  }
  return count;
}

static double path_length(size_t count, const double *path) {
  double length = 0;
  for (size_t i = 1; i < count; i++) length += distance2(path + 2 * (i - 1), path + 2 * i);
  return length;
}

/* out [pieces + 1]: equal distances along the path; the ends are the path's own. */
static void divide(size_t count, const double *path, size_t pieces, double *out) {
  double total = path_length(count, path), gone = 0;
  size_t i = 1;
  memcpy(out, path, 2 * sizeof *out);
  for (size_t j = 1; j < pieces; j++) {
    double wanted = total * (double)j / (double)pieces, step;
    while ((step = distance2(path + 2 * (i - 1), path + 2 * i)), gone + step < wanted && i + 1 < count) {
      gone += step;
      i++;
    }
    double t = step > 0 ? fmin(1, (wanted - gone) / step) : 0;
    for (size_t k = 0; k < 2; k++)
      out[2 * j + k] = path[2 * (i - 1) + k] + t * (path[2 * i + k] - path[2 * (i - 1) + k]);
  }
  memcpy(out + 2 * pieces, path + 2 * (count - 1), 2 * sizeof *out);
}

typedef struct chain_list {
  size_t loops, vertices;          /* so far */
  size_t *first;                   /* [loops + 1] */
  unsigned char *closed;           /* [loops] */
  double *path, *other, *distance; /* [room] one chain */
  unsigned char *faces;
  size_t room;
  double distance_max;
  double *points; /* [vertices][2] */
  size_t first_capacity, closed_capacity, points_capacity;
} chain_list;

static batten_status keep_chain(walker *w, chain_list *c, size_t own, bool closed) {
  if (batten_reserve(w->ctx, (void **)&c->points, &c->points_capacity, c->vertices + own, 2 * sizeof *c->points) <
          0 ||
      batten_reserve(w->ctx, (void **)&c->first, &c->first_capacity, c->loops + 2, sizeof *c->first) < 0 ||
      batten_reserve(w->ctx, (void **)&c->closed, &c->closed_capacity, c->loops + 1, 1) < 0)
    return BATTEN_E_NOMEM;
  memcpy(c->points + 2 * c->vertices, c->path, own * 2 * sizeof *c->path);
  c->first[c->loops] = c->vertices;
  c->vertices += own;
  c->closed[c->loops++] = closed;
  c->first[c->loops] = c->vertices;
  return BATTEN_OK;
}

/* Divides the chain in path and puts it on f = 0, DIVISIONS times over. */
static batten_status settle_chain(walker *w, chain_list *c, size_t count, bool closed, double cell,
                                  double tolerance) {
  unsigned char ends[2] = {c->faces[0], c->faces[count - 1]};
  size_t own = 0;
  batten_status st = BATTEN_OK;
  for (int pass = 0; st >= 0 && pass < DIVISIONS; pass++) {
    double wanted = round(path_length(count, c->path) / cell), least = closed ? LOOP_LEAST : CHAIN_LEAST;
    size_t pieces = (size_t)fmin(fmax(wanted, least), (double)(c->room - 1));
    divide(count, c->path, pieces, c->other);
    double *t = c->path;
    c->path = c->other;
    c->other = t;
    count = pieces + 1;
    own = closed ? pieces : count;
    memset(c->faces, 0, count);
    c->faces[0] = ends[0];
    c->faces[count - 1] = ends[1];
    st = batten_project_points(w->sampler, own, c->path, c->faces, cell, tolerance, NULL, c->distance);
    if (closed) memcpy(c->path + 2 * own, c->path, 2 * sizeof *c->path);
  }
  for (size_t i = 0; st >= 0 && i < own; i++) c->distance_max = fmax(c->distance_max, c->distance[i]);
  return st < 0 ? st : keep_chain(w, c, own, closed);
}

/* Open chains begin at their heads, closed ones at their lowest vertex; both in the order of these. */
static batten_status settle_chains(walker *w, chain_list *c, double cell, double tolerance) {
  size_t room = 4 * w->vertex_count + LOOP_LEAST + 2;
  unsigned char *seen = batten_alloc_array(w->ctx, w->vertex_count, 1);
  batten_status st = BATTEN_E_NOMEM;
  c->room = room;
  if (!seen || !(c->path = batten_alloc_array(w->ctx, room, 2 * sizeof *c->path)) ||
      !(c->other = batten_alloc_array(w->ctx, room, 2 * sizeof *c->other)) ||
      !(c->distance = batten_alloc_array(w->ctx, room, sizeof *c->distance)) ||
      !(c->faces = batten_alloc_array(w->ctx, room, 1)))
    goto done;
  memset(seen, 0, w->vertex_count);
  st = BATTEN_OK;
  for (int closed = 0; st >= 0 && closed < 2; closed++)
    for (uint32_t v = 0; st >= 0 && v < w->vertex_count; v++)
      if (!seen[v] && (closed || w->head[v]))
        st = settle_chain(w, c, follow(w, v, seen, c->path, c->faces), closed, cell, tolerance);
done:
  batten_free(w->ctx, seen);
  return st;
}

/* ---- all of it ---------------------------------------------------------------------------------- */

static batten_status fit_lattice(walker *w, const batten_frame *frame) {
  for (int k = 0; k < 2; k++) {
    double length = frame->upper[k] - frame->lower[k], squares = fmax(1, round(length / frame->cell));
    if (!(squares <= SQUARES_MAX))
      return batten_fail(w->ctx, BATTEN_E_TOO_LARGE,
                         "opt.cell: %g squares along axis %d of the box, at most %d; enlarge it", squares, k,
                         SQUARES_MAX);
    w->lower[k] = frame->lower[k];
    w->upper[k] = frame->upper[k];
    w->limit[k] = 2 * (int32_t)squares;
    w->half[k] = length / w->limit[k];
  }
  return BATTEN_OK;
}

static batten_status walk(walker *w, size_t seed_count, const double *seeds, size_t *seeds_missed) {
  unsigned char *missed = batten_alloc_array(w->ctx, seed_count, 1);
  if (!missed) return BATTEN_E_NOMEM;
  batten_status st = run_seeds(w, seed_count, seeds, missed);
  for (size_t i = 0; i < seed_count; i++) *seeds_missed += missed[i];
  batten_free(w->ctx, missed);
  if (st < 0) return st;
  if (w->crossed_count == 0)
    return batten_fail(
        w->ctx, BATTEN_E_NOT_FOUND,
        "seeds: the field does not change its sign within %d cells of any of the %zu seeds; give points "
        "on the outline, or another opt.cell",
        SEED_REACH, seed_count);
  return extract(w);
}

static void walker_free(walker *w) {
  batten_context *ctx = w->ctx;
  batten_table_free(ctx, &w->nodes);
  batten_table_free(ctx, &w->triangles);
  batten_table_free(ctx, &w->edges);
  batten_free(ctx, w->node_keys);
  batten_free(ctx, w->front);
  batten_free(ctx, w->next);
  batten_free(ctx, w->crossed);
  batten_free(ctx, w->values);
  batten_free(ctx, w->vertices);
  batten_free(ctx, w->faces);
  batten_free(ctx, w->following);
  batten_free(ctx, w->head);
}

/* Area by the trapezoid rule about the first vertex of each loop; open chains enclose none. */
static void measure(batten_outline *o) {
  for (size_t l = 0; l < o->loop_count; l++) {
    const double *p = o->vertices + 2 * o->first[l];
    size_t count = o->first[l + 1] - o->first[l], pieces = o->closed[l] ? count : count - 1;
    for (size_t i = 0; i < pieces; i++) {
      const double *a = p + 2 * i, *b = p + 2 * ((i + 1) % count);
      o->length += distance2(a, b);
      o->area += 0.5 * ((a[0] - p[0]) * (b[1] - p[1]) - (a[1] - p[1]) * (b[0] - p[0]));
    }
    if (!o->closed[l]) o->area = NAN;
  }
}

batten_status batten_trace_outline(batten_context *ctx, const batten_field *field, size_t seed_count,
                                   const double *seeds, const batten_polygonize_options *opt, batten_outline **out,
                                   batten_polygonize_info *info) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_polygonize_options o = opt ? *opt : batten_polygonize_options_default();
  batten_frame frame;
  double *searched = NULL;
  size_t evaluations = 0;
  batten_status st = batten_polygonize_seeds(ctx, 2, field, out, &o, &seed_count, &seeds, &searched, &evaluations);
  if (st >= 0) st = batten_polygonize_frame(ctx, 2, field, seed_count, seeds, &o, out, &frame);
  if (st < 0) {
    batten_free(ctx, searched);
    return st;
  }
  batten_polygonize_info found = {.cell = frame.cell};
  batten_sampler sampler = {.ctx = ctx,
                            .field = field,
                            .evaluations = evaluations,
                            .evaluations_max = o.evaluations_max,
                            .difference = BATTEN_DIFFERENCE * frame.cell};
  walker w = {.sampler = &sampler, .ctx = ctx};
  chain_list chains = {.loops = 0};
  batten_outline *outline = NULL;
  double start = batten_now(), walked, tolerance = o.accuracy * frame.diagonal;
  st = fit_lattice(&w, &frame);
  if (st >= 0) st = walk(&w, seed_count, seeds, &found.seeds_missed);
  if (st < 0) goto done;
  walked = batten_now();
  st = settle_chains(&w, &chains, frame.cell, tolerance);
  if (st < 0) goto done;
  st = BATTEN_E_NOMEM;
  outline = batten_alloc(ctx, sizeof *outline);
  if (!outline) goto done;
  *outline = (batten_outline){.ctx = ctx,
                              .loop_count = chains.loops,
                              .vertex_count = chains.vertices,
                              .first = chains.first,
                              .closed = chains.closed,
                              .vertices = chains.points};
  chains.first = NULL;
  chains.closed = NULL;
  chains.points = NULL;
  measure(outline);
  for (size_t l = 0; l < outline->loop_count; l++) found.clipped = found.clipped || !outline->closed[l];
  found.evaluations = sampler.evaluations;
  found.distance_max = chains.distance_max;
  found.time_track_s = walked - start;
  found.time_improve_s = batten_now() - walked;
  *out = outline;
  if (info) *info = found;
  st = batten_polygonize_warn(ctx, &found, tolerance);
done:
  batten_free(ctx, searched);
  batten_free(ctx, chains.first);
  batten_free(ctx, chains.closed);
  batten_free(ctx, chains.points);
  batten_free(ctx, chains.path);
  batten_free(ctx, chains.other);
  batten_free(ctx, chains.distance);
  batten_free(ctx, chains.faces);
  walker_free(&w);
  return st;
}

/* ---- the outline -------------------------------------------------------------------------------- */

void batten_outline_free(batten_outline *outline) {
  if (!outline) return;
  batten_context *ctx = outline->ctx;
  batten_free(ctx, outline->first);
  batten_free(ctx, outline->closed);
  batten_free(ctx, outline->vertices);
  batten_free(ctx, outline);
}

size_t batten_outline_loop_count(const batten_outline *outline) { return outline->loop_count; }

const double *batten_outline_loop(const batten_outline *outline, size_t loop, size_t *count, int *closed) {
  if (loop >= outline->loop_count) return NULL;
  if (count) *count = outline->first[loop + 1] - outline->first[loop];
  if (closed) *closed = outline->closed[loop];
  return outline->vertices + 2 * outline->first[loop];
}

double batten_outline_area(const batten_outline *outline) { return outline->area; }
double batten_outline_length(const batten_outline *outline) { return outline->length; }
