/* The tree of places of an evaluator: found for a batch of targets, made where none of an earlier batch came.
 *
 * The root is that of the sources' tree. A node has a list of near cells: those of its level that it touches, and
 * leaves of lower levels that came down from its parent. A child gets from its parent
 *
 *   its expansion                                           shifted down,
 *   children of near cells that the child does not touch    through translations, offsets in {-3 .. 3}^n,
 *   what it touches of these, and leaves                    as its own near cells.
 *
 * Leaves that the child no longer touches stay near: a few hundred terms that each target sums directly. Where the
 * density of sources falls over many levels they add up; when there are more than near_most of them their sums at the
 * nodes go into the expansion. A node whose near cells that could still be cut have near_most sources or fewer is a
 * leaf.
 *
 * All of this depends on the sources alone, and each number is made in one order (translations by kind, then in the
 * order of the sources' tree). So a target gets the same bits in any batch, and nodes can be forgotten and made
 * again. New nodes are made level by level for all points of a batch, so that translations of one kind go together.
 */
#include "fmm/evaluator.h"

#include "base/checked.h"

#include <string.h>

/* ---- room ---- */

static bool make_room(batten_context *ctx, void **array, size_t *room, size_t needed, size_t size) {
  if (needed <= *room) return true;
  const size_t more = needed + needed / 2 + 64;
  void *grown = batten_realloc_array(ctx, *array, more, size);
  if (!grown) return false;
  *array = grown;
  *room = more;
  return true;
}

static bool make_slabs(batten_context *ctx, batten_fmm_evaluator *e) {
  fmm_nodes *t = &e->nodes;
  const size_t needed = (t->count + FMM_SLAB_NODES - 1) / FMM_SLAB_NODES;
  if (!make_room(ctx, (void **)&t->slab, &t->slab_room, needed, sizeof *t->slab)) return false;
  for (; t->slabs < needed; t->slabs++) {
    t->slab[t->slabs] = batten_alloc_array(ctx, FMM_SLAB_NODES, e->operators->full * sizeof(double));
    if (!t->slab[t->slabs]) return false;
  }
  return true;
}

void batten_fmm_nodes_drop(batten_fmm_evaluator *e) {
  fmm_nodes *t = &e->nodes;
  for (size_t i = 0; i < t->slabs; i++) batten_free(e->ctx, t->slab[i]);
  batten_free(e->ctx, t->slab);
  batten_free(e->ctx, t->near);
  batten_free(e->ctx, t->node);
  *t = (fmm_nodes){0};
}

/* Bytes of that many nodes, roughly: 2 * 27 near cells are more than most have. */
static double node_bytes(const batten_fmm_evaluator *e, size_t nodes) {
  return (double)nodes * (double)(e->operators->full * sizeof(double) + sizeof(fmm_node) + 54 * sizeof(uint32_t));
}

/* ---- new nodes ---- */

/* Leaf or not: by what is left to be cut. */
static void settle(const batten_fmm_evaluator *e, fmm_node *t) {
  size_t could_be_cut = 0;
  t->near_sources = 0;
  for (size_t i = 0; i < t->near_count; i++) {
    const fmm_cell *s = &e->tree.cell[e->nodes.near[t->near_begin + i]];
    t->near_sources += s->s1 - s->s0;
    if (!fmm_is_leaf(s)) could_be_cut += s->s1 - s->s0;
  }
  t->is_leaf = could_be_cut <= e->near_most || !batten_fmm_can_part(e->kernel.n, &t->frame, t->level);
}

static batten_status make_root(batten_context *ctx, batten_fmm_evaluator *e) {
  fmm_nodes *t = &e->nodes;
  if (t->count) return BATTEN_OK;
  if (!make_room(ctx, (void **)&t->node, &t->room, 1, sizeof *t->node)) return BATTEN_E_NOMEM;
  if (!make_room(ctx, (void **)&t->near, &t->near_room, 1, sizeof *t->near)) return BATTEN_E_NOMEM;
  t->count = 1;
  if (!make_slabs(ctx, e)) {
    t->count = 0;
    return BATTEN_E_NOMEM;
  }
  memset(fmm_expansion(e, 0), 0, e->operators->full * sizeof(double));
  t->near[0] = 0;
  t->near_count = 1;
  t->node[0] = (fmm_node){.frame = e->tree.cell[0].frame, .near_count = 1};
  settle(e, &t->node[0]);
  return BATTEN_OK;
}

/* Takes back the nodes from `first` on, and their lists from near_first on. */
static void take_back(batten_fmm_evaluator *e, size_t first, size_t near_first) {
  fmm_nodes *t = &e->nodes;
  for (size_t i = first; i < t->count; i++) {
    fmm_node *parent = &t->node[t->node[i].parent];
    parent->child[fmm_octant(e->kernel.n, &parent->frame, t->node[i].frame.centre)] = 0;
  }
  t->count = first;
  t->near_count = near_first;
}

/* ---- lists of new nodes ---- */

/* Sources of a larger leaf that go into the expansion of a node. */
typedef struct leaf_link {
  uint32_t node, cell;
} leaf_link;

/* A translation with its place: chunk of FMM_CHUNK_CELLS nodes, and kind. */
typedef struct link {
  fmm_translation with; /* target: the place of the node in its chunk */
  uint32_t list;        /* chunk * FMM_KINDS + kind */
} link;

/* New nodes of one level, some chunks at a time. */
typedef struct piece {
  batten_fmm_evaluator *e;
  fmm_far at;
  size_t first, last, chunks;
  size_t links, link_room;
  link *link;
  size_t leaf_links, leaf_link_room;
  leaf_link *leaf_link; /* by node */
  size_t *kind_begin;   /* [chunks * FMM_KINDS + 1] */
  size_t sorted_room;
  fmm_translation *sorted;
  double *scratch; /* [chunks][scratch_each] */
  size_t scratch_each;
} piece;

/* Room for what a cell near to the parent can give to a child. */
static bool make_list_room(batten_context *ctx, piece *p) {
  fmm_nodes *t = &p->e->nodes;
  return make_room(ctx, (void **)&t->near, &t->near_room, t->near_count + FMM_CLASSES, sizeof *t->near) &&
         make_room(ctx, (void **)&p->link, &p->link_room, p->links + FMM_CLASSES, sizeof *p->link);
}

/* The children of a near cell of the parent: near, or through a translation. */
static void meet_children(piece *p, size_t index, const fmm_cell *s) {
  batten_fmm_evaluator *e = p->e;
  fmm_node *t = &e->nodes.node[index];
  for (uint32_t k = s->child; k < s->child + s->children; k++) {
    const fmm_cell *c = &e->tree.cell[k];
    if (fmm_side_by_side(e->kernel.n, &t->frame, &c->frame)) {
      e->nodes.near[e->nodes.near_count++] = k;
      t->near_count++;
      continue;
    }
    link *l = &p->link[p->links++];
    l->with = (fmm_translation){.target = (uint32_t)((index - p->first) % FMM_CHUNK_CELLS), .source = k};
    const unsigned kind = batten_fmm_kind(e->kernel.n, &t->frame, &c->frame, &l->with.mirror);
    l->list = (uint32_t)((index - p->first) / FMM_CHUNK_CELLS * FMM_KINDS + kind);
  }
}

/* Moves the leaves that a node does not touch from its near cells to its expansion when they hold too much. */
static batten_status move_leaves(batten_context *ctx, piece *p, size_t index) {
  batten_fmm_evaluator *e = p->e;
  fmm_node *t = &e->nodes.node[index];
  uint32_t *near = e->nodes.near + t->near_begin, kept = 0;
  size_t apart = 0;
  for (uint32_t i = 0; i < t->near_count; i++) {
    const fmm_cell *s = &e->tree.cell[near[i]];
    if (!fmm_side_by_side(e->kernel.n, &t->frame, &s->frame)) apart += s->s1 - s->s0;
  }
  if (apart <= e->near_most) return BATTEN_OK;
  if (!make_room(ctx, (void **)&p->leaf_link, &p->leaf_link_room, p->leaf_links + t->near_count,
                 sizeof *p->leaf_link))
    return BATTEN_E_NOMEM;
  for (uint32_t i = 0; i < t->near_count; i++)
    if (fmm_side_by_side(e->kernel.n, &t->frame, &e->tree.cell[near[i]].frame))
      near[kept++] = near[i];
    else
      p->leaf_link[p->leaf_links++] = (leaf_link){(uint32_t)index, near[i]};
  t->near_count = kept;
  e->nodes.near_count = t->near_begin + kept;
  return BATTEN_OK;
}

static batten_status list_node(batten_context *ctx, piece *p, size_t index) {
  batten_fmm_evaluator *e = p->e;
  fmm_nodes *all = &e->nodes;
  fmm_node *t = &all->node[index];
  const fmm_node *parent = &all->node[t->parent];
  t->near_begin = all->near_count;
  for (size_t i = 0; i < parent->near_count; i++) {
    if (!make_list_room(ctx, p)) return BATTEN_E_NOMEM;
    const uint32_t cell = all->near[parent->near_begin + i];
    if (!fmm_is_leaf(&e->tree.cell[cell])) {
      meet_children(p, index, &e->tree.cell[cell]);
      continue;
    }
    all->near[all->near_count++] = cell;
    t->near_count++;
  }
  batten_status st = move_leaves(ctx, p, index);
  settle(e, t);
  return st;
}

/* Translations in chunks, by kind, and in the order of the walk. */
static batten_status sort_links(batten_context *ctx, piece *p) {
  const size_t lists = p->chunks * FMM_KINDS;
  if (!make_room(ctx, (void **)&p->sorted, &p->sorted_room, p->links, sizeof *p->sorted)) return BATTEN_E_NOMEM;
  memset(p->kind_begin, 0, (lists + 1) * sizeof *p->kind_begin);
  for (size_t i = 0; i < p->links; i++) p->kind_begin[p->link[i].list + 1]++;
  batten_fmm_begin_lists(p->kind_begin, lists);
  for (size_t i = 0; i < p->links; i++) p->sorted[p->kind_begin[p->link[i].list + 1]++] = p->link[i].with;
  return BATTEN_OK;
}

/* ---- expansions of new nodes ---- */

static void chunk_task(void *arg, size_t chunk) {
  const piece *p = arg;
  batten_fmm_evaluator *e = p->e;
  const fmm_operators *o = e->operators;
  const size_t first = p->first + chunk * FMM_CHUNK_CELLS;
  const size_t last = p->last - first < FMM_CHUNK_CELLS ? p->last : first + FMM_CHUNK_CELLS;
  double *inner = p->scratch + chunk * p->scratch_each, *scratch = inner + FMM_CHUNK_CELLS * o->stride;
  const fmm_node *node = e->nodes.node;
  fmm_near_function *near = p->at.lanes->near(o->n, (unsigned)e->kernel.power, 0, e->dipoles);
  memset(inner, 0, (last - first) * o->stride * sizeof *inner);
  batten_fmm_translate(&p->at, pow(node[first].frame.half, e->kernel.power), e->level_transfer[node[first].level],
                       p->kind_begin + chunk * FMM_KINDS, p->sorted, e->outer, inner, scratch);
  size_t k = 0;
  while (k < p->leaf_links && p->leaf_link[k].node < first) k++;
  for (size_t i = first; i < last; i++) {
    double *tensor = fmm_expansion(e, i);
    const double *moved = batten_fmm_shift(&p->at, &node[i].frame, &node[node[i].parent].frame,
                                           (const double(*)[FMM_ORDER_MAX][FMM_ORDER_MAX])o->down,
                                           fmm_expansion(e, node[i].parent), scratch, scratch + o->full);
    memcpy(tensor, moved, o->full * sizeof *tensor);
    batten_fmm_expand(&p->at, inner + (i - first) * o->stride, tensor, scratch);
    for (; k < p->leaf_links && p->leaf_link[k].node == i; k++) {
      const fmm_cell *s = &e->tree.cell[p->leaf_link[k].cell];
      batten_fmm_add_sources(&p->at, &node[i].frame, near, &e->terms, s->s0, s->s1, tensor, scratch);
    }
  }
}

/* Chunks that run between two calls of the host's progress callback: about 0.2 s for each thread. */
static size_t chunks_together(const batten_context *ctx, const fmm_operators *o) {
  const double each = FMM_CHUNK_CELLS * 60.0 * 2 * (double)o->rank * (double)o->rank, threads = batten_threads(ctx);
  return (size_t)fmax(threads, fmin(32, 4e9 / each * threads));
}

static batten_status make_piece(batten_context *ctx, piece *p) {
  batten_fmm_evaluator *e = p->e;
  batten_status st = batten_progress(ctx, "evaluate", 0);
  p->chunks = (p->last - p->first + FMM_CHUNK_CELLS - 1) / FMM_CHUNK_CELLS;
  p->links = p->leaf_links = 0;
  for (size_t i = p->first; i < p->last && st >= 0; i++) st = list_node(ctx, p, i);
  if (st < 0 || (st = sort_links(ctx, p)) < 0) return st;
  const fmm_node *t = &e->nodes.node[p->first];
  double **transfer = &e->level_transfer[t->level];
  if (e->kernel.logarithm && p->links && !*transfer &&
      !(*transfer = batten_fmm_level_transfer(ctx, e->operators, t->frame.half)))
    return BATTEN_E_NOMEM;
  batten_parallel(ctx, p->chunks, chunk_task, p);
  e->info.translations += p->links;
  return BATTEN_OK;
}

/* Lists and expansions of the nodes from `first` on, all of one level. */
static batten_status make_nodes(batten_context *ctx, batten_fmm_evaluator *e, size_t first) {
  const fmm_operators *o = e->operators;
  size_t together = chunks_together(ctx, o);
  const size_t count = e->nodes.count, chunks = (count - first + FMM_CHUNK_CELLS - 1) / FMM_CHUNK_CELLS;
  if (together > chunks) together = chunks;
  piece p = {.e = e, .at = {o, batten_fmm_lanes_now()}};
  p.scratch_each = FMM_CHUNK_CELLS * o->stride + batten_fmm_scratch(o);
  batten_status st = BATTEN_E_NOMEM;
  p.kind_begin = batten_alloc_array(ctx, together * FMM_KINDS + 1, sizeof *p.kind_begin);
  p.scratch = batten_alloc_array(ctx, together, p.scratch_each * sizeof *p.scratch);
  if (!p.kind_begin || !p.scratch || !make_slabs(ctx, e)) goto done;
  st = BATTEN_OK;
  for (p.first = first; p.first < count && st >= 0; p.first = p.last) {
    p.last = count - p.first < together * FMM_CHUNK_CELLS ? count : p.first + together * FMM_CHUNK_CELLS;
    st = make_piece(ctx, &p);
  }
done:
  batten_free(ctx, p.sorted);
  batten_free(ctx, p.leaf_link);
  batten_free(ctx, p.link);
  batten_free(ctx, p.scratch);
  batten_free(ctx, p.kind_begin);
  return st;
}

/* ---- points to nodes ---- */

enum { POINTS_TOGETHER = 4096 };
static const uint32_t NO_LEVEL = UINT32_MAX;

typedef struct finder {
  batten_fmm_evaluator *e;
  size_t count;
  const size_t *which;
  const double *points;
  uint32_t *at;
  uint32_t *lowest; /* for each POINTS_TOGETHER points: of those that miss a child the lowest level, or NO_LEVEL */
} finder;

static const double *point_of(const finder *f, size_t i) {
  return f->points + (f->which ? f->which[i] : i) * f->e->kernel.n;
}

static bool is_inside(unsigned n, const fmm_frame *frame, const double *x) {
  for (unsigned a = 0; a < n; a++)
    if (fabs(x[a] - frame->centre[a]) > frame->half) return false;
  return true;
}

/* Points down as far as there are nodes. */
static void descend_task(void *arg, size_t index) {
  const finder *f = arg;
  const unsigned n = f->e->kernel.n;
  const fmm_node *node = f->e->nodes.node;
  const size_t begin = index * POINTS_TOGETHER;
  uint32_t lowest = NO_LEVEL;
  for (size_t i = begin; i < begin + POINTS_TOGETHER && i < f->count; i++) {
    if (f->at[i] == FMM_OUTSIDE) continue;
    const double *x = point_of(f, i);
    const fmm_node *t = &node[f->at[i]];
    while (!t->is_leaf) {
      const uint32_t child = t->child[fmm_octant(n, &t->frame, x)];
      if (!child) {
        if (t->level < lowest) lowest = t->level;
        break;
      }
      f->at[i] = child;
      t = &node[child];
    }
  }
  f->lowest[index] = lowest;
}

/* Nodes for points that miss a child of a node of this level. */
static batten_status add_level(batten_context *ctx, finder *f, uint32_t level, bool forced) {
  batten_fmm_evaluator *e = f->e;
  fmm_nodes *all = &e->nodes;
  const size_t first = all->count, near_first = all->near_count;
  batten_status st = BATTEN_OK;
  for (size_t i = 0; i < f->count && st >= 0; i++) {
    if (i % POINTS_TOGETHER == 0 && f->lowest[i / POINTS_TOGETHER] != level) {
      i += POINTS_TOGETHER - 1;
      continue;
    }
    if (f->at[i] == FMM_OUTSIDE) continue;
    fmm_node *t = &all->node[f->at[i]];
    if (t->is_leaf || t->level != level) continue;
    const unsigned octant = fmm_octant(e->kernel.n, &t->frame, point_of(f, i));
    if (t->child[octant]) continue;
    if (all->count == FMM_OUTSIDE || (!forced && node_bytes(e, all->count + 1) > (double)e->cache_bytes) ||
        !make_room(ctx, (void **)&all->node, &all->room, all->count + 1, sizeof *all->node)) {
      st = BATTEN_E_NOMEM;
      continue;
    }
    t = &all->node[f->at[i]];
    t->child[octant] = (uint32_t)all->count;
    all->node[all->count++] =
        (fmm_node){.frame = fmm_child_frame(e->kernel.n, &t->frame, octant), .parent = f->at[i], .level = level + 1};
  }
  if (st >= 0) st = make_nodes(ctx, e, first);
  if (st < 0) take_back(e, first, near_first);
  return st;
}

batten_status batten_fmm_nodes_find(batten_context *ctx, batten_fmm_evaluator *e, size_t count, const size_t *which,
                                    const double *points, bool forced, uint32_t *at) {
  const size_t tasks = (count + POINTS_TOGETHER - 1) / POINTS_TOGETHER;
  finder f = {.e = e, .count = count, .which = which, .points = points, .at = at};
  batten_status st = make_root(ctx, e);
  if (st < 0) return st;
  f.lowest = batten_alloc_array(ctx, tasks, sizeof *f.lowest);
  if (!f.lowest) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < count; i++)
    at[i] = is_inside(e->kernel.n, &e->nodes.node[0].frame, point_of(&f, i)) ? 0 : FMM_OUTSIDE;
  while (st >= 0) {
    uint32_t level = NO_LEVEL;
    batten_parallel(ctx, tasks, descend_task, &f);
    for (size_t i = 0; i < tasks; i++) level = f.lowest[i] < level ? f.lowest[i] : level;
    if (level == NO_LEVEL) break;
    st = add_level(ctx, &f, level, forced);
  }
  batten_free(ctx, f.lowest);
  return st;
}
