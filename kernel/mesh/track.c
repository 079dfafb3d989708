/* Marching tetrahedra on a body-centred cubic lattice, from the seeds along the surface.
 *
 * Lattice coordinates are doubled: cube corners are the points with even coordinates, cube centres those with odd
 * ones. A cube face has its own centre c (one even coordinate, the face's axis k). The four tetrahedra around the
 * face have the two cube centres c - e_k, c + e_k and one edge of the face, at c + s e_m, from - e_p to + e_p:
 *
 *        +-----+-----+        k: axis of the face        nodes: c - e_k, c + e_k (cube centres)
 *        |     |     |        m: towards the edge               c + s e_m - e_p, c + s e_m + e_p (corners)
 *        |  o--+--o--|-s e_m  p: along the edge
 *        +-----+-----+        number of a tetrahedron: c packed, with 2 (m != k+1) + (s > 0)
 *
 * At a face of the box, the centre outside is drawn back to the face: the tetrahedra there are halves, and the box
 * is filled exactly. So the surface ends on the box without any cutting. f >= 0 is inside, also when f = 0, so each
 * tetrahedron has one piece of one or two triangles, and the pieces fit to an oriented manifold by construction.
 *
 * A front of tetrahedra grows through faces that the surface crosses; all new nodes of a front are evaluated in one
 * batch. The crossed tetrahedra are sorted at the end: the surface found does not depend on the way to it.
 *
 * What is known of nodes and tetrahedra lies in bricks of two cubes a side, so that what is near in space is near in
 * memory, and only bricks are looked for in a table. */
#include "track.h"

#include "base/checked.h"
#include "project.h"
#include "table.h"

#include <string.h>

enum {
  COORDINATE_BITS = 20,
  CUBES_MAX = 1 << (COORDINATE_BITS - 2), /* along an axis; doubled coordinates then fit with room to spare */
  SEED_REACH = 2,                         /* cubes around a seed in which the surface is looked for */
  PROGRESS_STEP = 1 << 16,                /* tetrahedra between two calls of progress */
};

/* Crossings keep this share of their edge from its ends: no piece is degenerate. */
static const double END_MARGIN = 0.15;

/* Coordinates in a brick are 0 .. 3, and their halves say the place among the 8 of a kind. Nodes: cube corners, cube
 * centres, and those drawn back to a face of the box, which have the parities of face centres. */
enum { BRICK_BITS = 2, NODE_KINDS = 5, FACE_KINDS = 3, PLACES = 8 };

typedef struct brick {
  uint32_t nodes[NODE_KINDS * PLACES];         /* NO_NODE: none */
  unsigned char seen[FACE_KINDS * PLACES / 2]; /* four bits for each face: its tetrahedra */
  unsigned char crossed[FACE_KINDS * PLACES / 2];
} brick;

#define NO_NODE UINT32_MAX

typedef struct tracker {
  batten_sampler *sampler;
  batten_context *ctx;
  double lower[3], upper[3], half[3]; /* half: length of one doubled step */
  int32_t limit[3];                   /* doubled coordinates run from 0 to limit */
  batten_table places;                /* packed coordinates of a brick -> its number */
  brick *bricks;
  size_t brick_capacity;
  uint64_t last_keys[8]; /* bricks looked for last, one for each parity of their coordinates: a neighbourhood */
  uint32_t last_places[8];
  size_t node_count, evaluated;
  uint64_t *node_keys;
  size_t node_keys_capacity;
  double *values;
  size_t values_capacity;
  uint64_t *front, *next, *crossed;
  size_t front_count, next_count, crossed_count, front_capacity, next_capacity, crossed_capacity;
  uint32_t *front_nodes; /* [front][4] */
  size_t front_nodes_capacity;
} tracker;

typedef struct tetrahedron {
  int32_t c[3];
  int k, m, p, s;
} tetrahedron;

/* ---- the lattice -------------------------------------------------------------------------------- */

static uint64_t pack(const int32_t *c) {
  return ((uint64_t)(uint32_t)c[0] << 2 * COORDINATE_BITS) | ((uint64_t)(uint32_t)c[1] << COORDINATE_BITS) |
         (uint64_t)(uint32_t)c[2];
}

static void unpack(uint64_t key, int32_t *c) {
  for (int k = 2; k >= 0; k--, key >>= COORDINATE_BITS)
    c[k] = (int32_t)(key & (((uint64_t)1 << COORDINATE_BITS) - 1));
}

static uint64_t tetrahedron_number(const int32_t *c, int k, int m, int s) {
  return pack(c) << 2 | (uint64_t)(m != (k + 1) % 3) << 1 | (uint64_t)(s > 0);
}

static tetrahedron tetrahedron_of(uint64_t number) {
  tetrahedron t;
  unpack(number >> 2, t.c);
  t.k = t.c[0] % 2 == 0 ? 0 : t.c[1] % 2 == 0 ? 1 : 2;
  int other = (int)(number >> 1 & 1);
  t.m = (t.k + 1 + other) % 3;
  t.p = (t.k + 2 - other) % 3;
  t.s = number & 1 ? 1 : -1;
  return t;
}

/* Four node keys, positively oriented: det [x1 - x0, x2 - x0, x3 - x0] > 0. */
static void tetrahedron_nodes(const tracker *tr, const tetrahedron *t, uint64_t *keys) {
  int even = t->m == (t->k + 1) % 3 ? 1 : -1; /* is (k, m, p) an even permutation? */
  int first = t->s * even > 0 ? -1 : 1;
  for (int i = 0; i < 4; i++) {
    int32_t c[3] = {t->c[0], t->c[1], t->c[2]};
    if (i < 2) {
      c[t->k] += i == 0 ? first : -first;
      if (c[t->k] < 0) c[t->k] = 0;
      if (c[t->k] > tr->limit[t->k]) c[t->k] = tr->limit[t->k];
    } else {
      c[t->m] += t->s;
      c[t->p] += i == 2 ? -1 : 1;
    }
    keys[i] = pack(c);
  }
}

/* Number of the neighbour across the face opposite node i; false at the box. */
static bool neighbour(const tracker *tr, const tetrahedron *t, int i, uint64_t *number) {
  if (i >= 2) {
    *number = tetrahedron_number(t->c, t->k, t->p, i == 2 ? 1 : -1);
    return true;
  }
  int even = t->m == (t->k + 1) % 3 ? 1 : -1, first = t->s * even > 0 ? -1 : 1;
  int gone = i == 0 ? first : -first; /* side of the cube centre that is left behind */
  int32_t c[3] = {t->c[0], t->c[1], t->c[2]};
  c[t->k] -= gone;
  c[t->m] += t->s;
  if (c[t->k] < 0 || c[t->k] > tr->limit[t->k]) return false;
  *number = tetrahedron_number(c, t->m, t->k, gone);
  return true;
}

static void node_position(const tracker *tr, uint64_t key, double *x) {
  int32_t c[3];
  unpack(key, c);
  for (int k = 0; k < 3; k++) x[k] = c[k] == tr->limit[k] ? tr->upper[k] : tr->lower[k] + c[k] * tr->half[k];
}

/* ---- bricks ------------------------------------------------------------------------------------- */

static uint64_t brick_key(const int32_t *c, unsigned *parity) {
  const int32_t b[3] = {c[0] >> BRICK_BITS, c[1] >> BRICK_BITS, c[2] >> BRICK_BITS};
  *parity = (unsigned)((b[0] & 1) << 2 | (b[1] & 1) << 1 | (b[2] & 1));
  return pack(b);
}

/* Of the 8 places of the coordinates' parities, and those: bit 2 for c[0], as the places. */
static unsigned brick_place(const int32_t *c) {
  return (unsigned)((c[0] >> 1 & 1) << 2 | (c[1] >> 1 & 1) << 1 | (c[2] >> 1 & 1));
}
static unsigned parities(const int32_t *c) { return (unsigned)((c[0] & 1) << 2 | (c[1] & 1) << 1 | (c[2] & 1)); }

static unsigned node_slot(const int32_t *c) {
  static const unsigned char kind[8] = {0, 0, 0, 2, 0, 3, 4, 1}; /* 0: even, 7: odd, 3 5 6: one of them even */
  return kind[parities(c)] * PLACES + brick_place(c);
}

/* The byte of a tetrahedron's face and the bit in it. */
static unsigned face_bit(uint64_t number, const int32_t *c, unsigned char *bit) {
  static const unsigned char kind[8] = {0, 0, 0, 0, 0, 1, 2, 0}; /* 3 5 6 */
  unsigned face = kind[parities(c)] * PLACES + brick_place(c);
  *bit = (unsigned char)(1u << (4 * (face & 1) + (number & 3)));
  return face / 2;
}

/* The brick around c; valid until the next one is added. */
static brick *find_brick(tracker *tr, const int32_t *c) {
  unsigned parity;
  uint64_t key = brick_key(c, &parity);
  if (tr->last_keys[parity] == key) return tr->bricks + tr->last_places[parity];
  const uint32_t *place = batten_table_find(&tr->places, key);
  if (!place) return NULL;
  tr->last_keys[parity] = key;
  tr->last_places[parity] = *place;
  return tr->bricks + *place;
}

/* And added when it is not there; NULL: out of memory. */
static brick *take_brick(tracker *tr, const int32_t *c) {
  unsigned parity;
  size_t count = tr->places.count;
  brick *b = find_brick(tr, c);
  if (b) return b;
  if (batten_reserve(tr->ctx, (void **)&tr->bricks, &tr->brick_capacity, count + 1, sizeof *tr->bricks) < 0 ||
      !batten_table_insert(tr->ctx, &tr->places, brick_key(c, &parity), (uint32_t)count, NULL))
    return NULL;
  b = tr->bricks + count;
  *b = (brick){.seen = {0}};
  memset(b->nodes, 0xff, sizeof b->nodes);
  return b;
}

static bool is_crossed(tracker *tr, uint64_t number) {
  int32_t c[3];
  unsigned char bit;
  unpack(number >> 2, c);
  const brick *b = find_brick(tr, c);
  return b && b->crossed[face_bit(number, c, &bit)] & bit;
}

static uint32_t find_node(tracker *tr, uint64_t key) {
  int32_t c[3];
  unpack(key, c);
  return find_brick(tr, c)->nodes[node_slot(c)];
}

/* ---- the front ---------------------------------------------------------------------------------- */

static batten_status push(tracker *tr, uint64_t number) {
  int32_t c[3];
  unsigned char bit;
  unpack(number >> 2, c);
  brick *b = take_brick(tr, c);
  if (!b) return BATTEN_E_NOMEM;
  unsigned byte = face_bit(number, c, &bit);
  if (b->seen[byte] & bit) return BATTEN_OK;
  b->seen[byte] |= bit;
  if (batten_reserve(tr->ctx, (void **)&tr->next, &tr->next_capacity, tr->next_count + 1, sizeof *tr->next) < 0)
    return BATTEN_E_NOMEM;
  tr->next[tr->next_count++] = number;
  return BATTEN_OK;
}

static batten_status add_node(tracker *tr, uint64_t key, uint32_t *node) {
  int32_t c[3];
  if (tr->node_count >= UINT32_MAX)
    return batten_fail(tr->ctx, BATTEN_E_TOO_LARGE, "opt.cell: %zu lattice nodes are too many; enlarge it",
                       tr->node_count);
  unpack(key, c);
  brick *b = take_brick(tr, c);
  if (!b) return BATTEN_E_NOMEM;
  uint32_t *place = b->nodes + node_slot(c);
  *node = *place;
  if (*place != NO_NODE) return BATTEN_OK;
  if (batten_reserve(tr->ctx, (void **)&tr->node_keys, &tr->node_keys_capacity, tr->node_count + 1,
                     sizeof *tr->node_keys) < 0)
    return BATTEN_E_NOMEM;
  tr->node_keys[tr->node_count] = key;
  *node = *place = (uint32_t)tr->node_count++;
  return BATTEN_OK;
}

static batten_status evaluate_new_nodes(tracker *tr) {
  size_t count = tr->node_count - tr->evaluated;
  if (batten_reserve(tr->ctx, (void **)&tr->values, &tr->values_capacity, tr->node_count, sizeof *tr->values) < 0)
    return BATTEN_E_NOMEM;
  double *points = batten_alloc_array(tr->ctx, count, 3 * sizeof *points);
  if (!points) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < count; i++) node_position(tr, tr->node_keys[tr->evaluated + i], points + 3 * i);
  batten_status st = batten_sampler_values(tr->sampler, count, points, tr->values + tr->evaluated);
  batten_free(tr->ctx, points);
  if (st < 0) return st;
  tr->evaluated = tr->node_count;
  return BATTEN_OK;
}

/* How large the surface is nobody knows beforehand: the front's share of what is found says how much is left. */
static batten_status report(tracker *tr) {
  double found = (double)tr->crossed_count, left = (double)tr->next_count;
  return batten_progress(tr->ctx, "surface", found > 0 ? found / (found + 4 * left + 1) : 0);
}

/* The next front becomes the front; its nodes get their numbers. */
static batten_status take_front(tracker *tr) {
  uint64_t *list = tr->front;
  size_t capacity = tr->front_capacity;
  tr->front = tr->next;
  tr->front_capacity = tr->next_capacity;
  tr->front_count = tr->next_count;
  tr->next = list;
  tr->next_capacity = capacity;
  tr->next_count = 0;
  if (batten_reserve(tr->ctx, (void **)&tr->front_nodes, &tr->front_nodes_capacity, tr->front_count,
                     4 * sizeof *tr->front_nodes) < 0)
    return BATTEN_E_NOMEM;
  for (size_t i = 0; i < tr->front_count; i++) {
    tetrahedron t = tetrahedron_of(tr->front[i]);
    uint64_t keys[4];
    batten_status st = i % PROGRESS_STEP == 0 ? report(tr) : BATTEN_OK;
    if (st < 0) return st;
    tetrahedron_nodes(tr, &t, keys);
    for (size_t j = 0; j < 4; j++) {
      st = add_node(tr, keys[j], tr->front_nodes + 4 * i + j);
      if (st < 0) return st;
    }
  }
  return BATTEN_OK;
}

static batten_status cross_one(tracker *tr, uint64_t number, const uint32_t *nodes) {
  bool inside[4];
  int count = 0;
  for (int j = 0; j < 4; j++) count += inside[j] = tr->values[nodes[j]] >= 0;
  if (count == 0 || count == 4) return BATTEN_OK;
  tetrahedron t = tetrahedron_of(number);
  unsigned char bit;
  unsigned byte = face_bit(number, t.c, &bit);
  find_brick(tr, t.c)->crossed[byte] |= bit;
  if (batten_reserve(tr->ctx, (void **)&tr->crossed, &tr->crossed_capacity, tr->crossed_count + 1,
                     sizeof *tr->crossed) < 0)
    return BATTEN_E_NOMEM;
  tr->crossed[tr->crossed_count++] = number;
  for (int j = 0; j < 4; j++) {
    int others = count - inside[j]; /* inside nodes of the face opposite node j */
    uint64_t beyond;
    if (others == 0 || others == 3 || !neighbour(tr, &t, j, &beyond)) continue;
    if (push(tr, beyond) < 0) return BATTEN_E_NOMEM;
  }
  return BATTEN_OK;
}

static batten_status run_fronts(tracker *tr) {
  while (tr->next_count > 0) {
    batten_status st = take_front(tr);
    if (st >= 0) st = evaluate_new_nodes(tr);
    for (size_t i = 0; st >= 0 && i < tr->front_count; i++) {
      if (i % PROGRESS_STEP == 0) st = report(tr);
      if (st >= 0) st = cross_one(tr, tr->front[i], tr->front_nodes + 4 * i);
    }
    if (st >= 0) st = report(tr);
    if (st < 0) return st;
  }
  return BATTEN_OK;
}

/* ---- seeds -------------------------------------------------------------------------------------- */

/* The centre of the seed's cube, and the seed seen from there in [-1, 1]^3; false outside of the box. */
static bool seed_cube(const tracker *tr, const double *seed, int32_t *cube, double *offset) {
  for (int k = 0; k < 3; k++) {
    if (!(seed[k] >= tr->lower[k] && seed[k] <= tr->upper[k])) return false;
    double u = (seed[k] - tr->lower[k]) / tr->half[k];
    cube[k] = 2 * (int32_t)(u / 2) + 1;
    if (cube[k] > tr->limit[k] - 1) cube[k] = tr->limit[k] - 1;
    offset[k] = u - cube[k];
  }
  return true;
}

/* The tetrahedron that holds the seed. */
static uint64_t seed_tetrahedron(const int32_t *cube, const double *offset) {
  int k = 0;
  for (int i = 1; i < 3; i++)
    if (fabs(offset[i]) > fabs(offset[k])) k = i;
  int m = (k + 1) % 3, p = (k + 2) % 3;
  if (fabs(offset[p]) > fabs(offset[m])) m = p;
  int32_t c[3] = {cube[0], cube[1], cube[2]};
  c[k] += offset[k] < 0 ? -1 : 1;
  return tetrahedron_number(c, k, m, offset[m] < 0 ? -1 : 1);
}

/* Calls visit for all tetrahedra of the cubes within reach of cube, until it answers non-zero. */
static int visit_around(tracker *tr, const int32_t *cube, int32_t reach, int (*visit)(tracker *, uint64_t)) {
  int32_t side = 2 * reach + 1;
  for (int32_t i = 0; i < side * side * side; i++) {
    int32_t c[3] = {cube[0] + 2 * (i % side - reach), cube[1] + 2 * (i / side % side - reach),
                    cube[2] + 2 * (i / (side * side) - reach)};
    if (c[0] < 0 || c[1] < 0 || c[2] < 0 || c[0] > tr->limit[0] || c[1] > tr->limit[1] || c[2] > tr->limit[2])
      continue;
    for (int face = 0; face < 6; face++) {
      int k = face / 2;
      int32_t centre[3] = {c[0], c[1], c[2]};
      centre[k] += face % 2 ? 1 : -1;
      for (int edge = 0; edge < 4; edge++) {
        int answer = visit(tr, tetrahedron_number(centre, k, (k + 1 + edge / 2) % 3, edge % 2 ? 1 : -1));
        if (answer) return answer;
      }
    }
  }
  return 0;
}

static int visit_push(tracker *tr, uint64_t number) { return push(tr, number) < 0; }

static int visit_crossed(tracker *tr, uint64_t number) { return is_crossed(tr, number); }

/* The tetrahedra that hold the seeds, in the order of the lattice: neighbours then come one after the other. */
static batten_status push_seeds(tracker *tr, size_t seed_count, const double *seeds) {
  int32_t cube[3];
  double offset[3];
  size_t count = 0;
  uint64_t *numbers = batten_alloc_array(tr->ctx, seed_count, sizeof *numbers);
  if (!numbers) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < seed_count; i++)
    if (seed_cube(tr, seeds + 3 * i, cube, offset)) numbers[count++] = seed_tetrahedron(cube, offset);
  batten_status st = batten_sort_keys(tr->ctx, count, numbers);
  for (size_t i = 0; st >= 0 && i < count; i++)
    if (i == 0 || numbers[i] != numbers[i - 1]) st = push(tr, numbers[i]);
  batten_free(tr->ctx, numbers);
  return st;
}

/* Level by level: the tetrahedra that hold the seeds, then for seeds that found nothing their cubes, then the cubes
 * around these. missed [seed_count]. */
static batten_status run_seeds(tracker *tr, size_t seed_count, const double *seeds, unsigned char *missed) {
  int32_t cube[3];
  double offset[3];
  memset(missed, 1, seed_count);
  batten_status st = push_seeds(tr, seed_count, seeds);
  if (st >= 0) st = run_fronts(tr);
  for (size_t i = 0; st >= 0 && i < seed_count; i++)
    if (seed_cube(tr, seeds + 3 * i, cube, offset)) missed[i] = !visit_crossed(tr, seed_tetrahedron(cube, offset));
  for (int32_t reach = 0; reach <= SEED_REACH; reach++) {
    for (size_t i = 0; st >= 0 && i < seed_count; i++)
      if (missed[i] && seed_cube(tr, seeds + 3 * i, cube, offset) && visit_around(tr, cube, reach, visit_push))
        st = BATTEN_E_NOMEM;
    if (st >= 0) st = run_fronts(tr);
    for (size_t i = 0; st >= 0 && i < seed_count; i++)
      if (missed[i] && seed_cube(tr, seeds + 3 * i, cube, offset))
        missed[i] = !visit_around(tr, cube, reach, visit_crossed);
  }
  return st;
}

/* ---- extraction --------------------------------------------------------------------------------- */

enum { NODE_EDGES = 7 }; /* of the 14 at a node within the box those to nodes with higher keys */
#define NO_VERTEX UINT32_MAX

typedef struct extraction {
  uint32_t (*vertex_of)[NODE_EDGES]; /* [nodes] by the node with the lower key; NO_VERTEX */
  batten_table edges;                /* the two nodes of other crossed edges (on faces of the box) -> vertex */
  batten_rough_surface surface;
  size_t vertex_capacity, face_capacity, triangle_capacity;
} extraction;

static void place_vertex(const tracker *tr, uint32_t a, uint32_t b, double *x, unsigned char *faces) {
  if (tr->node_keys[a] > tr->node_keys[b]) { /* one order for all who use the edge: the same bits */
    uint32_t t = a;
    a = b;
    b = t;
  }
  uint64_t key_a = tr->node_keys[a], key_b = tr->node_keys[b];
  double p[3], q[3], t = tr->values[a] / (tr->values[a] - tr->values[b]);
  if (!(t > END_MARGIN)) t = END_MARGIN; /* also when the quotient is not a number */
  if (t > 1 - END_MARGIN) t = 1 - END_MARGIN;
  node_position(tr, key_a, p);
  node_position(tr, key_b, q);
  *faces = 0;
  int32_t ca[3], cb[3];
  unpack(key_a, ca);
  unpack(key_b, cb);
  for (int k = 0; k < 3; k++) {
    x[k] = ca[k] == cb[k] ? p[k] : p[k] + t * (q[k] - p[k]);
    if (ca[k] == cb[k] && ca[k] == 0) *faces |= (unsigned char)(BATTEN_LOWER_FACE << 2 * k);
    if (ca[k] == cb[k] && ca[k] == tr->limit[k]) *faces |= (unsigned char)(BATTEN_UPPER_FACE << 2 * k);
  }
}

/* Number of the edge among those of its lower node, or -1: steps 2 0 0 and 1 +-1 +-1 from there. */
static int edge_number(uint64_t lower, uint64_t higher) {
  int32_t from[3], to[3];
  unpack(lower, from);
  unpack(higher, to);
  const int32_t d[3] = {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
  if (d[0] == 1 && d[1] && d[2]) return 3 + (d[1] > 0) + 2 * (d[2] > 0);
  for (int k = 0; k < 3; k++)
    if (d[k] == 2) return k;
  return -1;
}

/* Where the number of the edge's vertex stands, `fresh` and *is_new when there was none; NULL: out of memory. */
static uint32_t *find_vertex(tracker *tr, extraction *e, uint32_t a, uint32_t b, uint32_t fresh, int *is_new) {
  if (tr->node_keys[a] > tr->node_keys[b]) {
    uint32_t t = a;
    a = b;
    b = t;
  }
  int number = edge_number(tr->node_keys[a], tr->node_keys[b]);
  if (number < 0) return batten_table_insert(tr->ctx, &e->edges, (uint64_t)a << 32 | b, fresh, is_new);
  uint32_t *place = &e->vertex_of[a][number];
  *is_new = *place == NO_VERTEX;
  if (*is_new) *place = fresh;
  return place;
}

static batten_status add_vertex(tracker *tr, extraction *e, uint32_t a, uint32_t b, uint32_t *vertex) {
  batten_rough_surface *s = &e->surface;
  int is_new;
  if (s->vertex_count >= UINT32_MAX - 1)
    return batten_fail(tr->ctx, BATTEN_E_TOO_LARGE, "opt.cell: %zu vertices are too many; enlarge it",
                       s->vertex_count);
  const uint32_t *place = find_vertex(tr, e, a, b, (uint32_t)s->vertex_count, &is_new);
  if (!place) return BATTEN_E_NOMEM;
  *vertex = *place;
  if (!is_new) return BATTEN_OK;
  if (batten_reserve(tr->ctx, (void **)&s->vertices, &e->vertex_capacity, s->vertex_count + 1,
                     3 * sizeof *s->vertices) < 0 ||
      batten_reserve(tr->ctx, (void **)&s->faces, &e->face_capacity, s->vertex_count + 1, 1) < 0)
    return BATTEN_E_NOMEM;
  place_vertex(tr, a, b, s->vertices + 3 * s->vertex_count, s->faces + s->vertex_count);
  s->vertex_count++;
  return BATTEN_OK;
}

/* The piece of one crossed tetrahedron. Nodes are renumbered by an even permutation, so that a b c d below are
 * positively oriented as 0 1 2 3 are. */
static batten_status extract_one(tracker *tr, extraction *e, uint64_t number) {
  static const unsigned char single[4][4] = {{0, 1, 2, 3}, {1, 0, 3, 2}, {2, 3, 0, 1}, {3, 2, 1, 0}};
  static const unsigned char pair[6][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2},
                                           {1, 2, 0, 3}, {1, 3, 2, 0}, {2, 3, 0, 1}};
  tetrahedron t = tetrahedron_of(number);
  uint64_t keys[4];
  uint32_t node[4], v[4];
  unsigned inside = 0, count = 0;
  tetrahedron_nodes(tr, &t, keys);
  for (int i = 0; i < 4; i++) {
    node[i] = find_node(tr, keys[i]);
    if (tr->values[node[i]] >= 0) {
      inside |= 1u << i;
      count++;
    }
  }
  unsigned char ends[4][2]; /* inside or outside ends of the crossed edges, around the piece */
  int corners = count == 2 ? 4 : 3;
  if (count == 2) {
    const unsigned char *o = pair[0];
    for (int i = 1; (1u << o[0] | 1u << o[1]) != inside; i++) o = pair[i];
    const unsigned char around[4][2] = {{o[0], o[2]}, {o[0], o[3]}, {o[1], o[3]}, {o[1], o[2]}};
    memcpy(ends, around, sizeof ends);
  } else {
    unsigned alone = count == 1 ? inside : 15u ^ inside;
    const unsigned char *o = single[0];
    for (int i = 1; 1u << o[0] != alone; i++) o = single[i];
    for (int i = 0; i < 3; i++) { /* seen from outside: away from an inside node, towards an outside one */
      ends[i][0] = o[0];
      ends[i][1] = o[count == 1 ? 1 + i : 3 - i];
    }
  }
  for (int i = 0; i < corners; i++) {
    batten_status st = add_vertex(tr, e, node[ends[i][0]], node[ends[i][1]], v + i);
    if (st < 0) return st;
  }
  batten_rough_surface *s = &e->surface;
  if (batten_reserve(tr->ctx, (void **)&s->triangles, &e->triangle_capacity, s->triangle_count + 2,
                     3 * sizeof *s->triangles) < 0)
    return BATTEN_E_NOMEM;
  uint32_t two[6] = {v[0], v[1], v[2], v[0], v[2], corners == 4 ? v[3] : 0};
  memcpy(s->triangles + 3 * s->triangle_count, two, (corners == 4 ? 6 : 3) * sizeof *two);
  s->triangle_count += corners == 4 ? 2 : 1;
  return BATTEN_OK;
}

static batten_status extract(tracker *tr, extraction *e) {
  e->vertex_of = batten_alloc_array(tr->ctx, tr->node_count, sizeof *e->vertex_of);
  if (!e->vertex_of) return BATTEN_E_NOMEM;
  memset(e->vertex_of, 0xff, tr->node_count * sizeof *e->vertex_of);
  batten_status st = batten_progress(tr->ctx, "surface", 1);
  if (st >= 0) st = batten_sort_keys(tr->ctx, tr->crossed_count, tr->crossed);
  for (size_t i = 0; st >= 0 && i < tr->crossed_count; i++) {
    if (i % PROGRESS_STEP == 0) st = batten_progress(tr->ctx, "surface", 1);
    if (st >= 0) st = extract_one(tr, e, tr->crossed[i]);
  }
  if (st >= 0 && e->surface.triangle_count > (UINT32_MAX - 1) / 3)
    st = batten_fail(tr->ctx, BATTEN_E_TOO_LARGE, "opt.cell: %zu triangles are too many; enlarge it",
                     e->surface.triangle_count);
  return st;
}

/* ---- all of it ---------------------------------------------------------------------------------- */

void batten_rough_surface_free(batten_context *ctx, batten_rough_surface *surface) {
  batten_free(ctx, surface->vertices);
  batten_free(ctx, surface->faces);
  batten_free(ctx, surface->triangles);
  *surface = (batten_rough_surface){0};
}

static batten_status fit_lattice(tracker *tr, const double *lower, const double *upper, double cell) {
  for (int k = 0; k < 3; k++) {
    double length = upper[k] - lower[k], cubes = fmax(1, round(length / cell));
    if (!(cubes <= CUBES_MAX))
      return batten_fail(tr->ctx, BATTEN_E_TOO_LARGE,
                         "opt.cell: %g cubes along axis %d of the box, at most %d; "
                         "enlarge it",
                         cubes, k, CUBES_MAX);
    tr->lower[k] = lower[k];
    tr->upper[k] = upper[k];
    tr->limit[k] = 2 * (int32_t)cubes;
    tr->half[k] = length / tr->limit[k];
  }
  return BATTEN_OK;
}

batten_status batten_track_surface(batten_sampler *sampler, const double *lower, const double *upper, double cell,
                                   size_t seed_count, const double *seeds, batten_rough_surface *out) {
  batten_context *ctx = sampler->ctx;
  tracker tr = {.sampler = sampler, .ctx = ctx};
  memset(tr.last_keys, 0xff, sizeof tr.last_keys); /* of no brick */
  extraction e = {.surface = {0}};
  unsigned char *missed = NULL;
  batten_status st = fit_lattice(&tr, lower, upper, cell);
  if (st < 0) goto done;
  st = BATTEN_E_NOMEM;
  missed = batten_alloc_array(ctx, seed_count, 1);
  if (!missed) goto done;
  st = run_seeds(&tr, seed_count, seeds, missed);
  if (st < 0) goto done;
  for (size_t i = 0; i < seed_count; i++) e.surface.seeds_missed += missed[i];
  if (tr.crossed_count == 0) {
    st = batten_fail(ctx, BATTEN_E_NOT_FOUND,
                     "seeds: the field does not change its sign within %d cells of any of the %zu seeds; give points "
                     "on the surface, or another opt.cell",
                     SEED_REACH, seed_count);
    goto done;
  }
  batten_free(ctx, tr.front); /* no need of them while the triangles are made */
  batten_free(ctx, tr.next);
  batten_free(ctx, tr.front_nodes);
  tr.front = tr.next = NULL;
  tr.front_nodes = NULL;
  st = extract(&tr, &e);
  if (st < 0) goto done;
  *out = e.surface;
done:
  if (st < 0) batten_rough_surface_free(ctx, &e.surface);
  batten_table_free(ctx, &e.edges);
  batten_free(ctx, e.vertex_of);
  batten_table_free(ctx, &tr.places);
  batten_free(ctx, tr.bricks);
  batten_free(ctx, tr.node_keys);
  batten_free(ctx, tr.values);
  batten_free(ctx, tr.front);
  batten_free(ctx, tr.next);
  batten_free(ctx, tr.crossed);
  batten_free(ctx, tr.front_nodes);
  batten_free(ctx, missed);
  return st;
}
