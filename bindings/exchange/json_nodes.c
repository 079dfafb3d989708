/* Saving trees of nodes: {"nodes": {NAME: NODE, ...}, "root": NODE}. Nodes that stand in several places are in
 * `nodes`, named 1, 2, ... in an order in which each follows those that it is made of; all others stand where they
 * are used. */
#include "format.h"
#include "json_layout.h"
#include "json_solid.h"
#include "soup.h"
#include "write.h"

#include "base/checked.h"

#include <math.h>
#include <string.h>

/* ---- the nodes of a tree, each once ------------------------------------------------------------------- */

typedef struct entry {
  const batten_frep *node;
  size_t uses; /* by other nodes */
  size_t name; /* 0: none */
} entry;

/* Entries in an order in which children come first, found by a hash of their addresses. */
typedef struct node_list {
  batten_context *ctx;
  entry *entries;
  size_t count, capacity;
  size_t *slots; /* [slot_count] entries + 1, 0 = empty; slot_count a power of two, at most half full */
  size_t slot_count;
} node_list;

static void free_list(node_list *l) {
  batten_free(l->ctx, l->entries);
  batten_free(l->ctx, l->slots);
}

static size_t slot_of(const node_list *l, const batten_frep *node) {
  uint64_t hash = (uint64_t)(uintptr_t)node * 0x9e3779b97f4a7c15u;
  size_t at = (size_t)(hash >> 32) & (l->slot_count - 1);
  while (l->slots[at] && l->entries[l->slots[at] - 1].node != node) at = (at + 1) & (l->slot_count - 1);
  return at;
}

static entry *find(const node_list *l, const batten_frep *node) {
  size_t at = l->slot_count ? l->slots[slot_of(l, node)] : 0;
  return at ? &l->entries[at - 1] : NULL;
}

static batten_status add(node_list *l, const batten_frep *node) {
  void *entries = l->entries;
  batten_status st = bx_grow(l->ctx, &entries, &l->capacity, l->count + 1, sizeof *l->entries);
  l->entries = entries;
  if (st != BATTEN_OK) return st;
  if (2 * (l->count + 1) > l->slot_count) {
    size_t more = l->slot_count ? 2 * l->slot_count : 64;
    size_t *slots = batten_alloc_array(l->ctx, more, sizeof *slots);
    if (!slots) return BATTEN_E_NOMEM;
    memset(slots, 0, more * sizeof *slots);
    batten_free(l->ctx, l->slots);
    l->slots = slots;
    l->slot_count = more;
    for (size_t i = 0; i < l->count; i++) slots[slot_of(l, l->entries[i].node)] = i + 1;
  }
  size_t at = slot_of(l, node);
  l->entries[l->count] = (entry){.node = node};
  l->slots[at] = ++l->count;
  return BATTEN_OK;
}

/* node and all below it. The kernel bounds the depth of trees, and so of this recursion. */
static batten_status collect(node_list *l, const batten_frep *node) {
  if (find(l, node)) return BATTEN_OK;
  batten_frep_parts p;
  batten_frep_get_parts(node, &p);
  batten_status st = BATTEN_OK;
  for (size_t i = 0; st == BATTEN_OK && i < p.child_count; i++) {
    st = collect(l, p.children[i]);
    if (st == BATTEN_OK) find(l, p.children[i])->uses++;
  }
  return st == BATTEN_OK ? add(l, node) : st;
}

batten_status bx_check_nodes(batten_context *ctx, const batten_frep *root) {
  node_list l = {.ctx = ctx};
  batten_status st = collect(&l, root);
  for (size_t i = 0; st == BATTEN_OK && i < l.count; i++) {
    batten_frep_parts p;
    batten_frep_get_parts(l.entries[i].node, &p);
    if (p.carrier) st = bx_check_carrier(ctx, p.carrier);
    if (st == BATTEN_OK && p.solid) st = bx_check_solid(ctx, p.solid);
  }
  free_list(&l);
  return st;
}

/* ---- writing --------------------------------------------------------------------------------------------- */

static void put_contours(bx_writer *w, const batten_frep_parts *p) {
  bx_put_u8(w, '[');
  for (size_t i = 0; i + 1 < p->start_count; i++) {
    if (i) bx_put_text(w, ",\n");
    bx_put_json_rows(w, p->numbers + 2 * p->starts[i], p->starts[i + 1] - p->starts[i], 2, ", ");
  }
  bx_put_u8(w, ']');
}

/* How many numbers a member has; those of the layout that follow from the length share what the others leave. */
static size_t numbers_of(const bx_node_layout *layout, const batten_frep_parts *p, unsigned member,
                         const double *at) {
  unsigned n = p->n;
  size_t left = p->number_count - (size_t)(at - p->numbers);
  switch (layout->members[member].shape) {
    case BX_NODE_VECTOR:
    case BX_NODE_SHIFT:
      return n;
    case BX_NODE_MATRIX:
      return (size_t)n * n;
    case BX_NODE_SPACE:
    case BX_NODE_UP:
      return 3;
    case BX_NODE_AXES:
      return 6;
    case BX_NODE_PATH: /* before two flags and a direction */
      return left - 5;
    case BX_NODE_PLACES: /* from and to */
      return p->number_count / 2;
    case BX_NODE_CONTOURS:
      return left;
    default:
      return 1;
  }
}

static void put_member(bx_writer *w, const bx_node_layout *layout, const batten_frep_parts *p, unsigned member,
                       const double **at) {
  bx_node_shape shape = layout->members[member].shape;
  const double *v = *at;
  size_t count = numbers_of(layout, p, member, v);
  *at += count;
  if (shape == BX_NODE_BELOW && !isfinite(*v)) return;
  if (shape == BX_NODE_ABOVE && !isfinite(*v)) return;
  if (shape == BX_NODE_UP && v[0] == 0 && v[1] == 0 && v[2] == 0) return;
  bx_print(w, ", \"%s\": ", layout->members[member].name);
  switch (shape) {
    case BX_NODE_FLAG:
      bx_put_text(w, *v > 0 || *v < 0 ? "true" : "false");
      break;
    case BX_NODE_VECTOR:
    case BX_NODE_SHIFT:
    case BX_NODE_SPACE:
    case BX_NODE_UP:
      bx_put_json_numbers(w, v, count);
      break;
    case BX_NODE_MATRIX:
    case BX_NODE_PLACES:
      bx_put_json_rows(w, v, count / p->n, p->n, ", ");
      break;
    case BX_NODE_AXES:
    case BX_NODE_PATH:
      bx_put_json_rows(w, v, count / 3, 3, ", ");
      break;
    case BX_NODE_CONTOURS:
      put_contours(w, p);
      break;
    default:
      bx_put_number(w, *v);
  }
}

static void put_node(bx_writer *w, const node_list *l, const batten_frep *node);

/* As it stands in an argument: its name, or itself. */
static void put_reference(bx_writer *w, const node_list *l, const batten_frep *node) {
  const entry *e = find(l, node);
  if (e->name)
    bx_print(w, "\"%zu\"", e->name);
  else
    put_node(w, l, node);
}

/* Recursion as deep as the tree, which the kernel bounds. */
static void put_node(bx_writer *w, const node_list *l, const batten_frep *node) {
  batten_frep_parts p;
  batten_frep_get_parts(node, &p);
  const bx_node_layout *layout = bx_node_layout_of(p.kind);
  const double *at = p.numbers;
  bx_print(w, "{\"node\": \"%s\"", batten_frep_kind_name(p.kind));
  for (unsigned i = 0; layout && i < layout->member_count; i++) put_member(w, layout, &p, i, &at);
  if (p.carrier) {
    bx_print(w, ", \"n\": %u, \"carrier\": ", p.n);
    bx_put_carrier(w, p.carrier);
  }
  if (p.solid) {
    bx_put_text(w, ", \"solid\": {");
    bx_put_solid_members(w, p.solid);
    bx_put_text(w, "}");
  }
  for (size_t i = 0; i < p.child_count; i++) {
    bx_print(w, ",\n\"%c\": ", i ? 'b' : 'a');
    put_reference(w, l, p.children[i]);
  }
  bx_put_text(w, "}");
}

void bx_put_nodes(bx_writer *w, const batten_frep *root) {
  node_list l = {.ctx = w->ctx};
  batten_status st = collect(&l, root);
  if (st != BATTEN_OK) bx_writer_fail(w, st);
  size_t named = 0;
  for (size_t i = 0; st == BATTEN_OK && i < l.count; i++) {
    entry *e = &l.entries[i];
    if (e->uses < 2) continue;
    bx_print(w, "%s\"%zu\": ", named ? ",\n" : "\"nodes\": {\n", named + 1);
    put_node(w, &l, e->node);
    e->name = ++named;
  }
  if (st == BATTEN_OK) {
    bx_put_text(w, named ? "},\n\"root\": " : "\"root\": ");
    put_reference(w, &l, root);
  }
  free_list(&l);
}

void bx_put_tree(bx_writer *w, const batten_solid *solid) {
  unsigned n = batten_solid_dimension(solid);
  double lower[3], upper[3];
  size_t count;
  const double *points = batten_solid_points(solid, &count);
  batten_solid_box(solid, lower, upper);
  bx_print(w, "\"kind\": \"tree\", \"n\": %u,\n\"lower\": ", n);
  bx_put_json_numbers(w, lower, n);
  bx_put_text(w, ", \"upper\": ");
  bx_put_json_numbers(w, upper, n);
  bx_put_text(w, ",\n");
  bx_put_nodes(w, batten_solid_tree(solid));
  bx_put_text(w, ",\n\"points\": ");
  bx_put_solid_rows(w, points, count, n);
}

batten_status batten_save_frep(batten_context *ctx, const batten_frep *tree, const char *path) {
  bx_writer w;
  batten_status st = bx_check_pointers(ctx, path, tree, "tree");
  if (st == BATTEN_OK && bx_format_of(path, NULL) != BX_JSON)
    st = batten_fail(ctx, BATTEN_E_INVALID, "%s: a tree is saved as .json; rename the file", bx_short_path(path));
  if (st == BATTEN_OK) st = bx_check_nodes(ctx, tree);
  if (st == BATTEN_OK) st = bx_create(&w, ctx, path);
  if (st != BATTEN_OK) return st;
  bx_put_text(&w, "{\"batten\": \"frep\", \"version\": 1,\n");
  bx_put_nodes(&w, tree);
  bx_put_text(&w, "\n}\n");
  return bx_commit(&w);
}
