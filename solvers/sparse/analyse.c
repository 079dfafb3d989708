/* Supernodes from the pattern [Liu, The multifrontal method for sparse matrix solution, SIAM Review 1992; Davis,
 * Direct Methods for Sparse Linear Systems, ch. 4].
 *
 * The elimination tree and the number of rows of each column come from walks along the tree; columns with the same
 * rows make supernodes; then a child joins its parent where the zeros that this stores cost less than a front and its
 * update, by a model of time that was fitted to measurements. Row structures of what results come from walks along
 * the tree of supernodes, in order without sorting. */
#include "fronts.h"

#include <assert.h>
#include <string.h>

#include "base/checked.h"

#define NONE UINT32_MAX

double block_front_flops(double own, double below) {
  return own * own * own / 3 + own * own * below + own * below * below;
}

/* Dense work, an entry of panel or update that is cleared, formed and added, and a front's calls: fitted to the times
 * of 72 systems of spheres and squares, 9 to 8000 nodes of 1, 2 and 5 unknowns, on one core with OpenBLAS 0.3.21,
 * which it meets to within a fifth. What counts is the ratio. */
double block_front_seconds(double own, double below) {
  const double FLOP = 2.2e-11, ENTRY = 7.5e-10, FRONT = 1.0e-7;
  return FLOP * block_front_flops(own, below) + ENTRY * (own * (own + below) + below * below) + FRONT;
}

batten_status block_graph(batten_context *ctx, const block_matrix *a, sparse_graph *out) {
  sparse_graph g = {.count = a->rows};
  g.starts = batten_alloc_array(ctx, a->rows + 1, sizeof *g.starts);
  g.indices = g.starts ? batten_alloc_array(ctx, a->starts[a->rows] - a->rows, sizeof *g.indices) : NULL;
  if (!g.indices) {
    sparse_graph_free(ctx, &g);
    return BATTEN_E_NOMEM;
  }
  size_t at = 0;
  g.starts[0] = 0;
  for (size_t i = 0; i < a->rows; i++) {
    for (size_t e = a->starts[i]; e < a->starts[i + 1]; e++)
      if (a->columns[e] != i) g.indices[at++] = a->columns[e];
    g.starts[i + 1] = at;
  }
  *out = g;
  return BATTEN_OK;
}

/* Arrays of the analysis, one entry a node. */
typedef struct analysis {
  const sparse_graph *g;
  uint32_t *order, *place; /* node at a place; place of a node */
  uint32_t *parent;        /* of places, then of supernodes */
  uint32_t *below;         /* rows below the diagonal: of places, then of supernodes */
  uint32_t *own;           /* columns of supernodes */
  uint32_t *super;         /* supernode of a place */
  uint32_t *child, *next;  /* lists of children */
  uint32_t *mark;
} analysis;
enum { ANALYSIS_ARRAYS = 9 };

static void invert(const analysis *w) {
  for (size_t p = 0; p < w->g->count; p++) w->place[w->order[p]] = (uint32_t)p;
}

/* Parents of the places in the elimination tree, with shortcuts in mark. */
static void find_parents(const analysis *w) {
  for (size_t p = 0; p < w->g->count; p++) {
    uint32_t node = w->order[p];
    w->parent[p] = w->mark[p] = NONE;
    for (size_t e = w->g->starts[node]; e < w->g->starts[node + 1]; e++) {
      uint32_t q = w->place[w->g->indices[e]];
      while (q != NONE && q < p) {
        uint32_t up = w->mark[q];
        w->mark[q] = (uint32_t)p;
        if (up == NONE) w->parent[q] = (uint32_t)p;
        q = up;
      }
    }
  }
}

/* Lists of children, lowest first, roots at `roots`. */
static void list_children(size_t count, const uint32_t *parent, uint32_t *child, uint32_t *next, uint32_t *roots) {
  *roots = NONE;
  for (size_t p = 0; p < count; p++) child[p] = NONE;
  for (size_t p = count; p-- > 0;) {
    uint32_t *list = parent[p] == NONE ? roots : &child[parent[p]];
    next[p] = *list;
    *list = (uint32_t)p;
  }
}

/* New numbers so that each subtree is a run that ends with its root: to[rank] = old number. Empties the lists. */
static void postorder(uint32_t roots, const uint32_t *parent, uint32_t *child, const uint32_t *next, uint32_t *to) {
  size_t rank = 0;
  for (uint32_t root = roots; root != NONE; root = next[root]) {
    uint32_t p = root;
    for (;;) {
      if (child[p] != NONE) {
        uint32_t down = child[p];
        child[p] = next[down];
        p = down;
        continue;
      }
      to[rank++] = p;
      if (p == root) break;
      p = parent[p];
    }
  }
}

/* Renumbers the places in postorder: order, place and parent. */
static void renumber(const analysis *w) {
  size_t n = w->g->count;
  uint32_t roots, *to = w->below, *rank = w->own, *old = w->super;
  list_children(n, w->parent, w->child, w->next, &roots);
  postorder(roots, w->parent, w->child, w->next, to);
  memcpy(old, w->order, n * sizeof *old);
  for (size_t r = 0; r < n; r++) {
    w->order[r] = old[to[r]];
    rank[to[r]] = (uint32_t)r;
  }
  memcpy(old, w->parent, n * sizeof *old);
  for (size_t r = 0; r < n; r++) w->parent[r] = old[to[r]] == NONE ? NONE : rank[old[to[r]]];
  invert(w);
}

/* Rows below the diagonal of each column: row p has entries on the ways from its neighbours up to p. */
static void count_rows(const analysis *w) {
  size_t n = w->g->count;
  memset(w->below, 0, n * sizeof *w->below);
  for (size_t p = 0; p < n; p++) {
    uint32_t node = w->order[p];
    w->mark[p] = (uint32_t)p;
    for (size_t e = w->g->starts[node]; e < w->g->starts[node + 1]; e++) {
      uint32_t q = w->place[w->g->indices[e]];
      for (; q < p && w->mark[q] != p; q = w->parent[q]) {
        w->mark[q] = (uint32_t)p;
        w->below[q]++;
      }
    }
  }
}

/* Joins each column to the one before where only that one's diagonal is missing. Parents, own and below become those
 * of supernodes: returns how many. */
static size_t find_supernodes(const analysis *w) {
  size_t n = w->g->count, count = 0;
  for (size_t p = 0; p < n; p++) {
    bool joins = p > 0 && w->parent[p - 1] == p && w->below[p - 1] == w->below[p] + 1;
    if (!joins) w->own[count++] = 0;
    w->super[p] = (uint32_t)count - 1;
    w->own[count - 1]++;
  }
  for (size_t s = 0, p = 0; s < count; s++) { /* writes behind what it reads */
    p += w->own[s];
    uint32_t up = w->parent[p - 1];
    w->below[s] = w->below[p - 1];
    w->parent[s] = up == NONE ? NONE : w->super[up];
  }
  return count;
}

/* Joins children to parents where that saves time: mark[s] becomes the supernode that s belongs to. Each link is
 * looked at once for each parent that it comes to. */
static void amalgamate(const analysis *w, size_t count, unsigned size) {
  uint32_t roots;
  list_children(count, w->parent, w->child, w->next, &roots);
  for (size_t s = 0; s < count; s++) {
    w->mark[s] = (uint32_t)s;
    uint32_t *link = &w->child[s];
    while (*link != NONE) {
      uint32_t c = *link;
      double own = (double)w->own[s] * size, below = (double)w->below[s] * size;
      double child_own = (double)w->own[c] * size, child_below = (double)w->below[c] * size;
      if (block_front_seconds(own + child_own, below) >
          block_front_seconds(own, below) + block_front_seconds(child_own, child_below)) {
        link = &w->next[c];
        continue;
      }
      w->mark[c] = (uint32_t)s;
      w->own[s] += w->own[c];
      *link = w->child[c]; /* its children are the next to be looked at */
      uint32_t *end = link;
      while (*end != NONE) end = &w->next[*end];
      *end = w->next[c];
    }
  }
}

/* Supernodes that stay, in postorder, with their places together, children's first. */
static void number_supernodes(const analysis *w, size_t count, block_fronts *f) {
  uint32_t *to = f->order, roots; /* order [nodes] is still free */
  for (size_t s = count; s-- > 0;)
    if (w->mark[s] != s) w->mark[s] = w->mark[w->mark[s]];
  for (size_t s = 0; s < count; s++)
    if (w->mark[s] == s && w->parent[s] != NONE) w->parent[s] = w->mark[w->parent[s]];
  /* lists of those that stay only */
  roots = NONE;
  for (size_t s = 0; s < count; s++) w->child[s] = NONE;
  for (size_t s = count; s-- > 0;) {
    if (w->mark[s] != s) continue;
    uint32_t *list = w->parent[s] == NONE ? &roots : &w->child[w->parent[s]];
    w->next[s] = *list;
    *list = (uint32_t)s;
    f->count++;
  }
  postorder(roots, w->parent, w->child, w->next, to);
  uint32_t *rank = w->next;
  f->first[0] = 0;
  f->row_starts[0] = 0;
  for (size_t r = 0; r < f->count; r++) {
    rank[to[r]] = (uint32_t)r;
    f->first[r + 1] = f->first[r] + w->own[to[r]];
    f->row_starts[r + 1] = f->row_starts[r] + w->below[to[r]];
    f->subtree[r] = 1;
  }
  for (size_t r = 0; r < f->count; r++) f->parent[r] = w->parent[to[r]] == NONE ? NONE : rank[w->parent[to[r]]];
  for (size_t r = 0; r < f->count; r++)
    if (f->parent[r] != NONE) f->subtree[f->parent[r]] += f->subtree[r];
  /* places: those of a supernode in their old order, so descendants stay ahead */
  uint32_t *at = w->child;
  for (size_t r = 0; r < f->count; r++) at[r] = f->first[r];
  for (size_t p = 0; p < w->g->count; p++) f->order[p] = NONE;
  for (size_t p = 0; p < w->g->count; p++) {
    uint32_t r = rank[w->mark[w->super[p]]];
    f->order[at[r]++] = w->order[p];
  }
  memcpy(w->order, f->order, w->g->count * sizeof *w->order);
  invert(w);
  for (size_t r = 0; r < f->count; r++)
    for (size_t p = f->first[r]; p < f->first[r + 1]; p++) w->super[p] = (uint32_t)r;
}

/* Rows of the supernodes, by walks from the neighbours of each place up the tree, and where they are in the parents.
 */
static void fill_rows(const analysis *w, block_fronts *f) {
  uint32_t *filled = w->below;
  for (size_t s = 0; s < f->count; s++) {
    filled[s] = 0;
    w->mark[s] = NONE;
  }
  for (size_t p = 0; p < f->nodes; p++) {
    uint32_t node = f->order[p], home = w->super[p];
    for (size_t e = w->g->starts[node]; e < w->g->starts[node + 1]; e++) {
      size_t q = w->place[w->g->indices[e]];
      if (q > p) continue;
      for (uint32_t s = w->super[q]; s != home && w->mark[s] != p; s = f->parent[s]) {
        w->mark[s] = (uint32_t)p;
        f->rows[f->row_starts[s] + filled[s]++] = (uint32_t)p;
      }
    }
  }
  for (size_t s = 0; s < f->count; s++) {
    assert(filled[s] == block_front_below(f, s));
    uint32_t up = f->parent[s];
    if (up == NONE) continue;
    size_t t = f->row_starts[up];
    for (size_t e = f->row_starts[s]; e < f->row_starts[s + 1]; e++) {
      if (f->rows[e] < f->first[up + 1]) {
        f->relative[e] = f->rows[e] - f->first[up];
        continue;
      }
      while (f->rows[t] < f->rows[e]) t++;
      f->relative[e] = (uint32_t)(block_front_own(f, up) + t - f->row_starts[up]);
    }
  }
}

/* Sizes in doubles; false when they overflow. */
static bool measure(block_fronts *f) {
  f->panel[0] = 0;
  for (size_t s = 0; s < f->count; s++) {
    size_t height = block_front_height(f, s), own = block_front_own(f, s) * f->size, doubles, square;
    if (!batten_mul(height, own, &doubles) || !batten_add(f->panel[s], doubles, &f->panel[s + 1]) ||
        !batten_mul(height, height, &square))
      return false;
    if (height > f->height_most) f->height_most = height;
    f->flops += block_front_flops((double)own, (double)(height - own));
    f->seconds += block_front_seconds((double)own, (double)(height - own));
  }
  return true;
}

static bool take_fronts(batten_context *ctx, size_t n, block_fronts *f) {
  return (f->order = batten_alloc_array(ctx, n, sizeof *f->order)) &&
         (f->first = batten_alloc_array(ctx, n + 1, sizeof *f->first)) &&
         (f->parent = batten_alloc_array(ctx, n, sizeof *f->parent)) &&
         (f->subtree = batten_alloc_array(ctx, n, sizeof *f->subtree)) &&
         (f->row_starts = batten_alloc_array(ctx, n + 1, sizeof *f->row_starts)) &&
         (f->panel = batten_alloc_array(ctx, n + 1, sizeof *f->panel));
}

batten_status block_fronts_new(batten_context *ctx, const sparse_graph *g, unsigned size, const uint32_t *order,
                               block_fronts *out) {
  size_t n = g->count;
  block_fronts f = {.nodes = n, .size = size};
  batten_status st = BATTEN_E_NOMEM;
  uint32_t *arrays = batten_alloc_array(ctx, n, ANALYSIS_ARRAYS * sizeof *arrays);
  if (!arrays || !take_fronts(ctx, n, &f)) goto done;
  analysis w = {g,
                arrays,
                arrays + n,
                arrays + 2 * n,
                arrays + 3 * n,
                arrays + 4 * n,
                arrays + 5 * n,
                arrays + 6 * n,
                arrays + 7 * n,
                arrays + 8 * n};
  memcpy(w.order, order, n * sizeof *order);
  invert(&w);
  find_parents(&w);
  renumber(&w);
  count_rows(&w);
  size_t count = find_supernodes(&w);
  amalgamate(&w, count, size);
  number_supernodes(&w, count, &f);
  f.rows = batten_alloc_array(ctx, f.row_starts[f.count], sizeof *f.rows);
  if (!f.rows) goto done;
  f.relative = batten_alloc_array(ctx, f.row_starts[f.count], sizeof *f.relative);
  if (!f.relative) goto done;
  fill_rows(&w, &f);
  st = measure(&f)
           ? BATTEN_OK
           : batten_fail(ctx, BATTEN_E_TOO_LARGE, "sparse system: %zu rows fill in beyond the address space", n);
done:
  batten_free(ctx, arrays);
  if (st < 0)
    block_fronts_free(ctx, &f);
  else
    *out = f;
  return st;
}

/* Row of the front of s that belongs to place p. */
static size_t row_in_front(const block_fronts *f, size_t s, uint32_t p) {
  if (p < f->first[s + 1]) return p - f->first[s];
  size_t low = f->row_starts[s], high = f->row_starts[s + 1];
  while (high - low > 1) {
    size_t middle = low + (high - low) / 2;
    if (f->rows[middle] <= p)
      low = middle;
    else
      high = middle;
  }
  assert(f->rows[low] == p);
  return block_front_own(f, s) + low - f->row_starts[s];
}

batten_status block_fronts_place(batten_context *ctx, const block_matrix *a, block_fronts *f) {
  size_t lower = (a->starts[a->rows] - a->rows) / 2 + a->rows, at = 0;
  uint32_t *place = batten_alloc_array(ctx, a->rows, sizeof *place);
  if (!place) return BATTEN_E_NOMEM;
  f->entry_starts = batten_alloc_array(ctx, f->count + 1, sizeof *f->entry_starts);
  f->entries = f->entry_starts ? batten_alloc_array(ctx, lower, sizeof *f->entries) : NULL;
  f->targets = f->entries ? batten_alloc_array(ctx, lower, sizeof *f->targets) : NULL;
  if (!f->targets) {
    batten_free(ctx, place);
    return BATTEN_E_NOMEM;
  }
  for (size_t p = 0; p < f->nodes; p++) place[f->order[p]] = (uint32_t)p;
  for (size_t s = 0; s < f->count; s++) {
    f->entry_starts[s] = at;
    for (uint32_t p = f->first[s]; p < f->first[s + 1]; p++) {
      size_t node = f->order[p], column = f->panel[s] + (p - f->first[s]) * f->size * block_front_height(f, s);
      for (size_t e = a->starts[node]; e < a->starts[node + 1]; e++) {
        if (place[a->columns[e]] < p) continue;
        f->entries[at] = e;
        f->targets[at++] = column + row_in_front(f, s, place[a->columns[e]]) * f->size;
      }
    }
  }
  f->entry_starts[f->count] = at;
  batten_free(ctx, place);
  return BATTEN_OK;
}

void block_fronts_free(batten_context *ctx, block_fronts *f) {
  batten_free(ctx, f->order);
  batten_free(ctx, f->first);
  batten_free(ctx, f->parent);
  batten_free(ctx, f->subtree);
  batten_free(ctx, f->row_starts);
  batten_free(ctx, f->rows);
  batten_free(ctx, f->relative);
  batten_free(ctx, f->panel);
  batten_free(ctx, f->entry_starts);
  batten_free(ctx, f->entries);
  batten_free(ctx, f->targets);
  *f = (block_fronts){0};
}

size_t block_fronts_bytes(const block_fronts *f) {
  size_t entries = f->entry_starts ? f->entry_starts[f->count] : 0;
  return f->nodes * (4 * sizeof(uint32_t) + 3 * sizeof(size_t)) + f->row_starts[f->count] * 2 * sizeof(uint32_t) +
         entries * 2 * sizeof(size_t);
}
