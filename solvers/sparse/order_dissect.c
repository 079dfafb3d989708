/* Nested dissection [George 1973; George, Liu 1981, ch. 8]: a few nodes whose loss splits the graph come last, the
 * two halves are split in the same way, small parts are ordered by minimum degree.
 *
 * The first separator of a part is a level of breadth first search from a node at its rim. It is then refined in the
 * way of Fiduccia and Mattheyses [1982], for separators of nodes [Ashcraft, Liu 1997]: a node leaves the separator
 * for a side, its neighbours on the other side come in; moves that lose are tried as well, and taken back down to the
 * best state that was met. Ties go by number: the same order everywhere. */
#include "fronts.h"

#include <string.h>

#include "base/checked.h"

#define NONE UINT32_MAX

enum { LEAF = 120 }; /* nodes: below, minimum degree is as good (measured on meshes) */
enum { SIDE_A = 0, SIDE_B = 1, SEPARATOR = 2 };

typedef struct dissection {
  const sparse_graph *g;
  uint32_t *order;              /* [n] parts are ranges of it; done at the end */
  uint32_t *part;               /* [n] stamp of the part that a node is in */
  uint32_t *level;              /* [n] of the last search; NONE: not reached */
  uint32_t *queue;              /* [n] */
  uint32_t *separator;          /* [n] */
  uint32_t *log;                /* [n] moves of a pass: nodes that left the separator */
  uint32_t *widths;             /* [n] nodes in a level */
  unsigned char *side, *locked; /* [n] */
  size_t (*stack)[2];           /* [n + 1] ranges to do */
  size_t depth;
  uint32_t stamp;
} dissection;

/* Breadth first from root within its part; returns how many nodes, in queue. */
static size_t search(dissection *d, const uint32_t *nodes, size_t count, uint32_t root) {
  size_t head = 0, tail = 0;
  for (size_t i = 0; i < count; i++) d->level[nodes[i]] = NONE;
  d->queue[tail++] = root;
  d->level[root] = 0;
  while (head < tail) {
    uint32_t i = d->queue[head++];
    for (size_t e = d->g->starts[i]; e < d->g->starts[i + 1]; e++) {
      uint32_t j = d->g->indices[e];
      if (d->part[j] != d->stamp || d->level[j] != NONE) continue;
      d->level[j] = d->level[i] + 1;
      d->queue[tail++] = j;
    }
  }
  return tail;
}

/* Ranges of the components of a part go to the stack, their nodes together. */
static void split_components(dissection *d, size_t low, size_t high) {
  size_t count = high - low, tail = 0;
  uint32_t *nodes = d->order + low;
  for (size_t i = 0; i < count; i++) d->level[nodes[i]] = NONE;
  for (size_t i = 0; i < count; i++) {
    if (d->level[nodes[i]] != NONE) continue;
    size_t first = tail, head = tail;
    d->queue[tail++] = nodes[i];
    d->level[nodes[i]] = 0;
    while (head < tail) {
      uint32_t p = d->queue[head++];
      for (size_t e = d->g->starts[p]; e < d->g->starts[p + 1]; e++) {
        uint32_t q = d->g->indices[e];
        if (d->part[q] != d->stamp || d->level[q] != NONE) continue;
        d->level[q] = 0;
        d->queue[tail++] = q;
      }
    }
    d->stack[d->depth][0] = low + first;
    d->stack[d->depth++][1] = low + tail;
  }
  memcpy(nodes, d->queue, count * sizeof *nodes);
}

/* The level that splits best: few nodes, halves alike. Sides are set; false: there are no three levels. */
static bool split_by_level(dissection *d, size_t count) {
  size_t depth = d->level[d->queue[count - 1]] + 1, before = 0, best = 0;
  double least = INFINITY;
  if (depth < 3) return false;
  memset(d->widths, 0, depth * sizeof *d->widths);
  for (size_t i = 0; i < count; i++) d->widths[d->level[d->queue[i]]]++;
  for (size_t l = 1; l + 1 < depth; l++) {
    before += d->widths[l - 1];
    double cost = d->widths[l] / ((double)before * (double)(count - before - d->widths[l]));
    if (cost < least) least = cost, best = l;
  }
  for (size_t i = 0; i < count; i++) {
    uint32_t v = d->queue[i];
    d->side[v] = d->level[v] < best ? SIDE_A : d->level[v] > best ? SIDE_B : SEPARATOR;
  }
  return true;
}

/* ---- refinement ------------------------------------------------------------------------------------- */

typedef struct state {
  size_t sizes[3];
} state;

static double cost_of(const state *s) {
  double a = (double)s->sizes[SIDE_A], b = (double)s->sizes[SIDE_B];
  return a > 0 && b > 0 ? (double)s->sizes[SEPARATOR] / (a * b) : INFINITY;
}

/* Neighbours of v on a side. */
static size_t meets(const dissection *d, uint32_t v, unsigned side) {
  size_t count = 0;
  for (size_t e = d->g->starts[v]; e < d->g->starts[v + 1]; e++) {
    uint32_t j = d->g->indices[e];
    count += d->part[j] == d->stamp && d->side[j] == side;
  }
  return count;
}

/* v leaves the separator for a side: its neighbours on the other side come in, at the end of the list. */
static void move(dissection *d, state *s, size_t place, unsigned to, size_t *count) {
  uint32_t v = d->separator[place];
  d->side[v] = (unsigned char)to;
  d->separator[place] = d->separator[--*count];
  s->sizes[to]++;
  for (size_t e = d->g->starts[v]; e < d->g->starts[v + 1]; e++) {
    uint32_t j = d->g->indices[e];
    if (d->part[j] != d->stamp || d->side[j] != !to) continue;
    d->side[j] = SEPARATOR;
    d->separator[(*count)++] = j;
    s->sizes[!to]--;
  }
  s->sizes[SEPARATOR] = *count;
}

/* The move of least cost now, of nodes that have not moved in this pass; false: none. */
static bool find_move(const dissection *d, const state *s, size_t count, size_t *place, unsigned *to) {
  double least = INFINITY;
  uint32_t least_node = NONE;
  for (size_t i = 0; i < count; i++) {
    uint32_t v = d->separator[i];
    if (d->locked[v]) continue;
    for (unsigned side = 0; side < 2; side++) {
      size_t in = meets(d, v, !side);
      state next = *s;
      next.sizes[side]++;
      next.sizes[!side] -= in;
      next.sizes[SEPARATOR] += in - 1;
      double cost = cost_of(&next);
      if (cost < least || (cost == least && v < least_node)) {
        least = cost, least_node = v;
        *place = i, *to = side;
      }
    }
  }
  return least < INFINITY;
}

static size_t list_separator(dissection *d, const uint32_t *nodes, size_t count, state *s) {
  size_t listed = 0;
  memset(s, 0, sizeof *s);
  for (size_t i = 0; i < count; i++) {
    s->sizes[d->side[nodes[i]]]++;
    if (d->side[nodes[i]] == SEPARATOR) d->separator[listed++] = nodes[i];
  }
  return listed;
}

/* Passes until one brings nothing. What is best is kept in level, which is free by now. */
static void refine(dissection *d, const uint32_t *nodes, size_t count) {
  enum { PASSES = 10, PATIENCE = 40 };
  for (int pass = 0; pass < PASSES; pass++) {
    state s;
    size_t listed = list_separator(d, nodes, count, &s), moved = 0, kept = 0, place;
    double start = cost_of(&s), least = start;
    unsigned to;
    for (size_t since = 0; since < PATIENCE && find_move(d, &s, listed, &place, &to); since++) {
      uint32_t v = d->separator[place];
      d->log[moved++] = v;
      d->locked[v] = 1;
      d->level[v] = to;
      move(d, &s, place, to, &listed);
      if (cost_of(&s) >= least) continue;
      least = cost_of(&s);
      kept = moved;
      since = 0;
    }
    /* take back: a node goes back into the separator, what came in for it goes back to the other side, which is all
     * of the separator that does not touch the node's side any more */
    while (moved > kept) {
      uint32_t v = d->log[--moved];
      unsigned from = d->level[v];
      d->side[v] = SEPARATOR;
      for (size_t e = d->g->starts[v]; e < d->g->starts[v + 1]; e++) {
        uint32_t j = d->g->indices[e];
        if (d->part[j] == d->stamp && d->side[j] == SEPARATOR && j != v && meets(d, j, from) == 0 &&
            meets(d, j, !from) > 0)
          d->side[j] = (unsigned char)!from;
      }
    }
    for (size_t i = 0; i < count; i++) d->locked[nodes[i]] = 0;
    list_separator(d, nodes, count, &s);
    if (!(cost_of(&s) < start)) return;
  }
}

/* ---- parts ------------------------------------------------------------------------------------------ */

/* Sides one after the other in the range, the separator at the end, in the order of the queue. */
static void arrange(dissection *d, size_t low, size_t count) {
  size_t at[3] = {0}, sizes[3] = {0};
  for (size_t i = 0; i < count; i++) sizes[d->side[d->queue[i]]]++;
  at[SIDE_B] = sizes[SIDE_A];
  at[SEPARATOR] = sizes[SIDE_A] + sizes[SIDE_B];
  for (size_t i = 0; i < count; i++) d->order[low + at[d->side[d->queue[i]]]++] = d->queue[i];
  for (int side = 0; side < 2; side++) {
    d->stack[d->depth][0] = low + (side ? sizes[SIDE_A] : 0);
    d->stack[d->depth++][1] = low + sizes[SIDE_A] + (side ? sizes[SIDE_B] : 0);
  }
}

/* Minimum degree on the part by itself. */
static batten_status order_leaf(batten_context *ctx, dissection *d, size_t low, size_t high) {
  uint32_t *nodes = d->order + low;
  size_t count = high - low, entries = 0;
  sparse_graph g = {.count = count};
  batten_status st = BATTEN_E_NOMEM;
  if (count < 3) return BATTEN_OK;
  for (size_t i = 0; i < count; i++) {
    d->level[nodes[i]] = (uint32_t)i;
    for (size_t e = d->g->starts[nodes[i]]; e < d->g->starts[nodes[i] + 1]; e++)
      entries += d->part[d->g->indices[e]] == d->stamp;
  }
  g.starts = batten_alloc_array(ctx, count + 1, sizeof *g.starts);
  if (!g.starts) goto done;
  g.indices = batten_alloc_array(ctx, entries, sizeof *g.indices);
  if (!g.indices) goto done;
  entries = 0;
  for (size_t i = 0; i < count; i++) {
    g.starts[i] = entries;
    for (size_t e = d->g->starts[nodes[i]]; e < d->g->starts[nodes[i] + 1]; e++)
      if (d->part[d->g->indices[e]] == d->stamp) g.indices[entries++] = d->level[d->g->indices[e]];
  }
  g.starts[count] = entries;
  st = sparse_order_degree(ctx, &g, d->separator);
  if (st < 0) goto done;
  for (size_t i = 0; i < count; i++) d->queue[i] = nodes[d->separator[i]];
  memcpy(nodes, d->queue, count * sizeof *nodes);
done:
  sparse_graph_free(ctx, &g);
  return st;
}

static batten_status dissect_part(batten_context *ctx, dissection *d, size_t low, size_t high) {
  enum { STARTS = 4 }; /* searches for a node at the rim */
  size_t count = high - low, reached = 0;
  uint32_t *nodes = d->order + low, root = nodes[0];
  d->stamp++;
  for (size_t i = 0; i < count; i++) d->part[nodes[i]] = d->stamp;
  if (count <= LEAF) return order_leaf(ctx, d, low, high);
  for (int start = 0; start < STARTS; start++) {
    reached = search(d, nodes, count, root);
    if (reached < count) {
      split_components(d, low, high);
      return BATTEN_OK;
    }
    root = d->queue[count - 1];
  }
  if (!split_by_level(d, count)) return order_leaf(ctx, d, low, high);
  refine(d, nodes, count);
  arrange(d, low, count);
  return BATTEN_OK;
}

batten_status sparse_order_dissection(batten_context *ctx, const sparse_graph *g, uint32_t *order) {
  enum { ARRAYS = 6 };
  size_t n = g->count;
  dissection d = {.g = g, .order = order};
  batten_status st = BATTEN_E_NOMEM;
  uint32_t *arrays = batten_alloc_array(ctx, n, ARRAYS * sizeof *arrays);
  if (!arrays || !(d.side = batten_alloc_array(ctx, n, 2)) ||
      !(d.stack = batten_alloc_array(ctx, n + 2, sizeof *d.stack)))
    goto done;
  d.part = arrays, d.level = arrays + n, d.queue = arrays + 2 * n;
  d.separator = arrays + 3 * n, d.log = arrays + 4 * n, d.widths = arrays + 5 * n;
  d.locked = d.side + n;
  memset(d.part, 0, n * sizeof *d.part);
  memset(d.locked, 0, n);
  for (size_t i = 0; i < n; i++) order[i] = (uint32_t)i;
  st = BATTEN_OK;
  d.stack[0][0] = 0;
  d.stack[0][1] = n;
  d.depth = n > 0;
  while (d.depth > 0 && st >= 0) {
    d.depth--;
    st = dissect_part(ctx, &d, d.stack[d.depth][0], d.stack[d.depth][1]);
  }
done:
  batten_free(ctx, d.stack);
  batten_free(ctx, d.side);
  batten_free(ctx, arrays);
  return st;
}
