/* Loading trees of nodes: scenes {"batten": "frep", ...} and solids of the kind "tree".
 *
 * Named nodes are made when they are first met, and then shared. While one is being made its name is marked: to meet
 * it again then is a cycle. What the arguments mean is checked by the kernel's constructors, whose texts begin with
 * the argument and are put behind the place. */
#include "format.h"
#include "json_layout.h"
#include "json_solid.h"
#include "names.h"
#include "soup.h"

#include "base/checked.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum {
  LEVELS =
      512 /* nodes in nodes, through solids in leaves as well: bounds the recursion. A tree of the kernel has 128. */
};

typedef enum progress { UNTOUCHED = 0, OPEN, MADE } progress;

typedef struct named {
  const json_t *value;
  progress state;
  batten_frep *node; /* MADE */
  size_t outer;      /* OPEN: the named node in which this one was met, SIZE_MAX = none */
} named;

typedef struct scene {
  bx_json *j;
  const char *folder; /* of files beside the scene, with its slash; NULL: files are not taken */
  unsigned depth;     /* solids and carriers around */
  size_t place;       /* of the document or solid that has the nodes: how long */
  bx_names names;
  named *list;  /* [names.count] */
  size_t inner; /* the named node in hand, SIZE_MAX = none */
} scene;

static batten_status load_node(scene *s, const json_t *object, batten_frep **out);
static batten_status load_reference(scene *s, const json_t *value, batten_frep **out);

/* ---- what the kernel says ---------------------------------------------------------------------------------- */

/* "radius: -1; give ..." at "root.b" becomes "root.b.radius: -1; give ...". Nodes of a list are `of` in scenes. */
static batten_status explain(bx_json *j, batten_status st) {
  char text[256];
  if (st >= 0 || st == BATTEN_E_NOMEM || st == BATTEN_E_CANCELLED) return st;
  snprintf(text, sizeof text, "%s", batten_error(j->ctx));
  size_t word = strspn(text, "abcdefghijklmnopqrstuvwxyz_0123456789");
  bool argument = word > 0 && (text[word] == ':' || text[word] == '['), list = !strncmp(text, "nodes[", 6);
  return batten_fail(j->ctx, st == BATTEN_E_INVALID ? BATTEN_E_FORMAT : st, "%s: %s%s%s", bx_short_path(j->path),
                     j->place,
                     list       ? ".of"
                     : argument ? "."
                                : ": ",
                     list ? text + 5 : text);
}

/* ---- kinds ---------------------------------------------------------------------------------------------------- */

static bool find_kind(const char *name, batten_frep_kind *out) {
  for (int k = 0; k < BATTEN_FREP_KIND_COUNT; k++) {
    const char *known = batten_frep_kind_name((batten_frep_kind)k);
    if (known && !strcmp(known, name)) {
      *out = (batten_frep_kind)k;
      return true;
    }
  }
  return false;
}

/* Carriers that are nodes of their own name: all shapes but those that are nodes themselves. */
static const bx_carrier_layout *find_shape(const char *name) {
  const bx_carrier_layout *layout = bx_layout_named(name);
  return layout && layout->member_count > 1 && layout->child_count == 0 ? layout : NULL;
}

static batten_status fail_kind(bx_json *j, const char *kind) {
  char quote[BX_QUOTE_SIZE], list[200] = "";
  size_t used = 0;
  for (int k = BATTEN_FREP_KIND_UNION; k < BATTEN_FREP_KIND_COUNT && used < sizeof list; k++) {
    const char *name = batten_frep_kind_name((batten_frep_kind)k);
    if (name && !strncmp(name, kind, 1)) used += (size_t)snprintf(list + used, sizeof list - used, " '%s'", name);
  }
  return bx_json_fail(j, "'%s' is no kind of node%s%s; the kinds are listed in files.md",
                      bx_quote(kind, strlen(kind), quote), used ? "; with this letter begin" : "", list);
}

/* ---- numbers --------------------------------------------------------------------------------------------------- */

typedef struct number_list {
  batten_context *ctx;
  double *values;
  size_t count, capacity;
} number_list;

static batten_status room_for(number_list *l, size_t more, double **to) {
  void *values = l->values;
  batten_status st = bx_grow(l->ctx, &values, &l->capacity, l->count + more, sizeof *l->values);
  l->values = values;
  if (st != BATTEN_OK) return st;
  *to = l->values + l->count;
  l->count += more;
  return BATTEN_OK;
}

static batten_status get_some(bx_json *j, const json_t *object, const char *key, size_t count, number_list *l) {
  double *to;
  batten_status st = room_for(l, count, &to);
  return st == BATTEN_OK ? bx_get_numbers(j, object, key, count, to) : st;
}

static batten_status get_rows(bx_json *j, const json_t *object, const char *key, size_t width, size_t expected,
                              number_list *l) {
  double *rows = NULL, *to;
  size_t count = 0;
  batten_status st = bx_get_rows(j, object, key, width, &count, &rows);
  if (st != BATTEN_OK) return st;
  if (expected != SIZE_MAX && count != expected)
    st = bx_json_fail(j, "%zu rows in '%s', where %zu are expected", count, key, expected);
  if (st == BATTEN_OK) st = room_for(l, count * width, &to);
  if (st == BATTEN_OK) memcpy(to, rows, count * width * sizeof *to);
  batten_free(j->ctx, rows);
  return st;
}

static batten_status get_axis(bx_json *j, const json_t *object, const char *key, double *out) {
  const char *text = json_string_value(json_object_get(object, key));
  if (!text) return bx_get_number(j, object, key, out);
  if (!text[0] || text[1] || !strchr("xyz", text[0]))
    return bx_json_fail(j, "'%s' is not \"x\", \"y\" or \"z\"", key);
  *out = text[0] - 'x';
  return BATTEN_OK;
}

/* One number; where it is left out, what it then is. */
static batten_status get_single(bx_json *j, const json_t *object, const bx_node_layout *layout, unsigned i,
                                double *out) {
  const char *key = layout->members[i].name;
  bool flag = false;
  batten_status st;
  switch (layout->members[i].shape) {
    case BX_NODE_FLAG:
      st = bx_get_flag(j, object, key, &flag);
      *out = flag;
      return st;
    case BX_NODE_AXIS:
      return get_axis(j, object, key, out);
    case BX_NODE_BELOW:
      *out = -INFINITY;
      break;
    case BX_NODE_ABOVE:
      *out = INFINITY;
      break;
    default:
      *out = layout->members[i].fallback;
  }
  return isnan(*out) || json_object_get(object, key) ? bx_get_number(j, object, key, out) : BATTEN_OK;
}

static batten_status get_member(bx_json *j, const json_t *object, const bx_node_layout *layout, unsigned i,
                                unsigned n, number_list *l) {
  const char *key = layout->members[i].name;
  bool given = json_object_get(object, key);
  double *to;
  batten_status st;
  switch (layout->members[i].shape) {
    case BX_NODE_VECTOR:
      return get_some(j, object, key, n, l);
    case BX_NODE_SPACE:
      return get_some(j, object, key, 3, l);
    case BX_NODE_UP:
    case BX_NODE_SHIFT:
      if (layout->members[i].shape == BX_NODE_UP) n = 3;
      if (given) return get_some(j, object, key, n, l);
      st = room_for(l, n, &to);
      for (unsigned k = 0; st == BATTEN_OK && k < n; k++) to[k] = 0;
      return st;
    case BX_NODE_MATRIX:
      if (given) return get_rows(j, object, key, n, n, l);
      st = room_for(l, (size_t)n * n, &to);
      for (unsigned k = 0; st == BATTEN_OK && k < n * n; k++) to[k] = k % (n + 1) == 0;
      return st;
    case BX_NODE_AXES:
      return get_rows(j, object, key, 3, 2, l);
    case BX_NODE_PATH:
      st = get_rows(j, object, key, 3, SIZE_MAX, l);
      return st == BATTEN_OK && l->count < 6 ? bx_json_fail(j, "'%s' has fewer than 2 points; give 2 or more", key)
                                             : st;
    case BX_NODE_PLACES:
      return get_rows(j, object, key, n, i ? l->count / n : SIZE_MAX, l);
    case BX_NODE_CONTOURS:
      return BATTEN_OK; /* get_contours */
    default:
      st = room_for(l, 1, &to);
      return st == BATTEN_OK ? get_single(j, object, layout, i, to) : st;
  }
}

/* Of polygons: starts [*count] are contours + 1. */
static batten_status get_contours(bx_json *j, const json_t *object, number_list *l, size_t **starts, size_t *count) {
  json_t *contours;
  batten_status st = bx_get(j, object, "contours", &contours);
  if (st != BATTEN_OK) return st;
  size_t contour_count = json_array_size(contours), mark = bx_enter(j, "contours");
  if (contour_count == 0) st = bx_json_fail(j, "it must be an array of contours, one or more");
  *starts = batten_alloc_array(j->ctx, contour_count + 1, sizeof **starts);
  if (st == BATTEN_OK && !*starts) st = BATTEN_E_NOMEM;
  for (size_t i = 0; st == BATTEN_OK && i < contour_count; i++) {
    const json_t *contour = json_array_get(contours, i);
    size_t inner = bx_enter_item(j, i);
    double *to;
    (*starts)[i] = l->count / 2;
    if (json_is_array(contour) && json_array_size(contour) < 3)
      st = bx_json_fail(j, "%zu points; give 3 or more", json_array_size(contour));
    if (st == BATTEN_OK) st = room_for(l, 2 * json_array_size(contour), &to);
    if (st == BATTEN_OK) st = bx_fill_rows(j, contour, json_array_size(contour), 2, to);
    bx_leave(j, inner);
  }
  bx_leave(j, mark);
  if (st != BATTEN_OK) return st;
  (*starts)[contour_count] = l->count / 2;
  *count = contour_count + 1;
  return BATTEN_OK;
}

/* ---- leaves
 * -------------------------------------------------------------------------------------------------------- */

/* The dimension that a leaf's first vector tells. */
static batten_status tell_dimension(bx_json *j, const json_t *object, const char *key, unsigned *n) {
  json_t *vector;
  batten_status st = bx_get(j, object, key, &vector);
  if (st != BATTEN_OK) return st;
  size_t length = json_array_size(vector);
  if (length == 2 || length == 3) {
    *n = (unsigned)length;
    return BATTEN_OK;
  }
  size_t mark = bx_enter(j, key);
  st = bx_json_fail(j, "it must be an array of 2 or 3 numbers");
  bx_leave(j, mark);
  return st;
}

static batten_status wrap_carrier(bx_json *j, batten_carrier *carrier, batten_frep **out) {
  batten_status st = explain(j, batten_frep_carrier(j->ctx, carrier, out));
  batten_carrier_free(carrier);
  return st;
}

/* {"node": "box", "center": ..., ...} */
static batten_status load_shape(scene *s, const json_t *object, const char *kind, const bx_carrier_layout *layout,
                                batten_frep **out) {
  const char *known[BX_CARRIER_MEMBERS + 1] = {NULL};
  unsigned n = 0;
  batten_carrier *carrier = NULL;
  for (unsigned i = 0; i < layout->member_count; i++) known[i] = layout->members[i].name;
  batten_status st = bx_check_members(s->j, object, kind, known);
  if (st == BATTEN_OK) st = tell_dimension(s->j, object, layout->members[0].name, &n);
  if (st == BATTEN_OK) st = bx_load_carrier_members(s->j, object, layout, n, s->depth, &carrier);
  return st == BATTEN_OK ? wrap_carrier(s->j, carrier, out) : st;
}

/* {"node": "carrier", "n": 3, "carrier": {...}} */
static batten_status load_carrier(scene *s, const json_t *object, batten_frep **out) {
  static const char *const known[] = {"n", "carrier", NULL};
  json_t *value = NULL;
  unsigned n = 3;
  batten_carrier *carrier = NULL;
  batten_status st = bx_check_members(s->j, object, "carrier", known);
  if (st == BATTEN_OK && json_object_get(object, "n")) st = bx_get_dimension(s->j, object, &n);
  if (st == BATTEN_OK) st = bx_get(s->j, object, "carrier", &value);
  if (st != BATTEN_OK) return st;
  size_t mark = bx_enter(s->j, "carrier");
  st = bx_load_carrier(s->j, value, n, s->depth, &carrier);
  bx_leave(s->j, mark);
  return st == BATTEN_OK ? wrap_carrier(s->j, carrier, out) : st;
}

/* A solid saved beside the scene. */
static batten_status load_file(scene *s, const json_t *object, batten_solid **out) {
  bx_json *j = s->j;
  const char *name = "";
  batten_status st = bx_get_text(j, object, "file", &name);
  if (st != BATTEN_OK) return st;
  if (!s->folder) return bx_json_fail(j, "files stand in scenes alone; put the solid itself here, as 'solid'");
  size_t folder = name[0] == '/' ? 0 : strlen(s->folder), length = strlen(name);
  char *path = batten_alloc(j->ctx, folder + length + 1);
  if (!path) return BATTEN_E_NOMEM;
  memcpy(path, s->folder, folder);
  memcpy(path + folder, name, length + 1);
  st = batten_load_solid(j->ctx, path, out);
  if (st < 0 && st != BATTEN_E_NOMEM && st != BATTEN_E_CANCELLED) {
    char text[256];
    snprintf(text, sizeof text, "%s", batten_error(j->ctx));
    st = batten_fail(j->ctx, st, "%s: %s.file: %s", bx_short_path(j->path), j->place, text);
  }
  batten_free(j->ctx, path);
  return st;
}

/* {"node": "solid", "solid": {...}} or {"node": "solid", "file": "a.json"} */
static batten_status load_solid(scene *s, const json_t *object, batten_frep **out) {
  static const char *const known[] = {"solid", "file", NULL};
  batten_solid *solid = NULL;
  json_t *value = NULL;
  batten_status st = bx_check_members(s->j, object, "solid", known);
  if (st != BATTEN_OK) return st;
  if (json_object_get(object, "file")) {
    if (json_object_get(object, "solid")) return bx_json_fail(s->j, "'solid' and 'file' at once; leave out one");
    st = load_file(s, object, &solid);
  } else {
    st = bx_get(s->j, object, "solid", &value);
    if (st != BATTEN_OK) return st;
    size_t mark = bx_enter(s->j, "solid");
    st = bx_load_solid_members(s->j, value, s->depth + 1, &solid);
    bx_leave(s->j, mark);
  }
  if (st == BATTEN_OK) st = explain(s->j, batten_frep_solid(s->j->ctx, solid, out));
  batten_solid_free(solid);
  return st;
}

/* ---- operations
 * ------------------------------------------------------------------------------------------------------ */

static const char *const child_names[] = {"a", "b"};

static batten_status load_child(scene *s, const json_t *object, unsigned i, batten_frep **out) {
  json_t *value;
  batten_status st = bx_get(s->j, object, child_names[i], &value);
  if (st != BATTEN_OK) return st;
  size_t mark = bx_enter(s->j, child_names[i]);
  st = load_reference(s, value, out);
  bx_leave(s->j, mark);
  return st;
}

/* {"node": "union", "of": [NODE, ...], "alpha": 0} */
static batten_status load_many(scene *s, const json_t *object, const char *kind, batten_frep_operation operation,
                               batten_frep **out) {
  static const char *const known[] = {"of", "alpha", NULL};
  const json_t *items = json_object_get(object, "of");
  size_t count = json_array_size(items), made = 0;
  double alpha = BATTEN_R_SMOOTH;
  batten_status st = bx_check_members(s->j, object, kind, known);
  if (st == BATTEN_OK && json_object_get(object, "alpha")) st = bx_get_number(s->j, object, "alpha", &alpha);
  if (st == BATTEN_OK && count == 0) st = bx_json_fail(s->j, "'of' must be an array of nodes, one or more");
  if (st != BATTEN_OK) return st;
  batten_frep **nodes = batten_alloc_array(s->j->ctx, count, sizeof(batten_frep *));
  if (!nodes) return BATTEN_E_NOMEM;
  while (st == BATTEN_OK && made < count) {
    size_t mark = bx_enter(s->j, "of");
    bx_enter_item(s->j, made);
    st = load_reference(s, json_array_get(items, made), &nodes[made]);
    bx_leave(s->j, mark);
    if (st == BATTEN_OK) made++;
  }
  if (st == BATTEN_OK) st = explain(s->j, batten_frep_combine_all(s->j->ctx, operation, count, nodes, alpha, out));
  for (size_t i = 0; i < made; i++) batten_frep_free(nodes[i]);
  batten_free(s->j->ctx, nodes);
  return st;
}

static bool takes_many(batten_frep_kind kind, batten_frep_operation *operation) {
  *operation = kind == BATTEN_FREP_KIND_UNION          ? BATTEN_FREP_UNION
               : kind == BATTEN_FREP_KIND_INTERSECTION ? BATTEN_FREP_INTERSECTION
                                                       : BATTEN_FREP_DIFFERENCE;
  return kind == BATTEN_FREP_KIND_UNION || kind == BATTEN_FREP_KIND_INTERSECTION ||
         kind == BATTEN_FREP_KIND_DIFFERENCE;
}

static batten_status check_arguments(bx_json *j, const json_t *object, const char *kind,
                                     const bx_node_layout *layout) {
  const char *known[BX_NODE_MEMBERS + 3] = {NULL};
  unsigned count = 0;
  while (count < layout->children) {
    known[count] = child_names[count];
    count++;
  }
  for (unsigned i = 0; i < layout->member_count; i++) known[count++] = layout->members[i].name;
  return bx_check_members(j, object, kind, known);
}

static batten_status load_operation(scene *s, const json_t *object, const char *kind, const bx_node_layout *layout,
                                    batten_frep **out) {
  batten_frep_parts p = {.struct_size = sizeof p, .kind = layout->kind, .n = layout->n};
  number_list numbers = {.ctx = s->j->ctx};
  size_t *starts = NULL;
  batten_status st = check_arguments(s->j, object, kind, layout);
  while (st == BATTEN_OK && p.child_count < layout->children) {
    st = load_child(s, object, (unsigned)p.child_count, &p.children[p.child_count]);
    if (st == BATTEN_OK) p.child_count++;
  }
  if (st == BATTEN_OK && p.n == 0 && p.child_count) p.n = batten_frep_dimension(p.children[0]);
  if (st == BATTEN_OK && p.n == 0) st = tell_dimension(s->j, object, layout->members[0].name, &p.n);
  for (unsigned i = 0; st == BATTEN_OK && i < layout->member_count; i++)
    st = get_member(s->j, object, layout, i, p.n, &numbers);
  if (st == BATTEN_OK && layout->kind == BATTEN_FREP_KIND_POLYGON)
    st = get_contours(s->j, object, &numbers, &starts, &p.start_count);
  if (st == BATTEN_OK) {
    p.number_count = numbers.count;
    p.numbers = numbers.values;
    p.starts = starts;
    st = explain(s->j, batten_frep_create(s->j->ctx, &p, out));
  }
  for (size_t i = 0; i < p.child_count; i++) batten_frep_free(p.children[i]);
  batten_free(s->j->ctx, numbers.values);
  batten_free(s->j->ctx, starts);
  return st;
}

static batten_status load_node(scene *s, const json_t *object, batten_frep **out) {
  batten_frep_kind kind = BATTEN_FREP_KIND_COUNT;
  batten_frep_operation operation;
  const char *name = "";
  batten_status st = bx_get_text(s->j, object, "node", &name);
  if (st != BATTEN_OK) return st;
  if (!find_kind(name, &kind)) {
    const bx_carrier_layout *shape = find_shape(name);
    return shape ? load_shape(s, object, name, shape, out) : fail_kind(s->j, name);
  }
  if (kind == BATTEN_FREP_KIND_CARRIER) return load_carrier(s, object, out);
  if (kind == BATTEN_FREP_KIND_SOLID) return load_solid(s, object, out);
  if (takes_many(kind, &operation) && json_object_get(object, "of"))
    return load_many(s, object, name, operation, out);
  return load_operation(s, object, name, bx_node_layout_of(kind), out);
}

/* ---- names
 * --------------------------------------------------------------------------------------------------------------- */

/* "b > c > b": the names that lead from a node to itself. */
static batten_status fail_cycle(scene *s, size_t name) {
  char chain[200], quote[BX_QUOTE_SIZE];
  size_t used = 0, ways = 0, at = s->inner;
  while (at != name) at = s->list[at].outer, ways++;
  for (size_t k = 0; k <= ways + 1 && used < sizeof chain; k++) {
    at = name;
    if (k > 0 && k <= ways) { /* met k steps after `name`, that is ways - k steps before the one in hand */
      at = s->inner;
      for (size_t back = ways - k; back > 0; back--) at = s->list[at].outer;
    }
    const char *text = bx_names_get(&s->names, at);
    used += (size_t)snprintf(chain + used, sizeof chain - used, "%s%s", k ? " > " : "",
                             bx_quote(text, strlen(text), quote));
  }
  return bx_json_fail(s->j, "a cycle: %s; no node may be made of itself", chain);
}

static batten_status load_named(scene *s, size_t name, batten_frep **out) {
  bx_json *j = s->j;
  named *n = &s->list[name];
  if (n->state == OPEN) return fail_cycle(s, name);
  if (n->state == UNTOUCHED) {
    char place[sizeof j->place];
    memcpy(place, j->place, sizeof place);
    bx_leave(j, s->place);
    bx_enter(j, "nodes");
    bx_enter(j, bx_names_get(&s->names, name));
    n->state = OPEN;
    n->outer = s->inner;
    s->inner = name;
    batten_status st = load_reference(s, n->value, &n->node);
    s->inner = n->outer;
    n->state = st == BATTEN_OK ? MADE : UNTOUCHED;
    if (st != BATTEN_OK) return st;
    memcpy(j->place, place, sizeof place);
  }
  *out = batten_frep_retain(n->node);
  return BATTEN_OK;
}

/* A name, or the node itself. Recursion no deeper than LEVELS. */
static batten_status load_reference(scene *s, const json_t *value, batten_frep **out) {
  bx_json *j = s->j;
  if (j->level >= LEVELS) return bx_json_fail(j, "nodes in nodes in ...: deeper than %d", LEVELS);
  j->level++;
  batten_status st;
  if (json_is_string(value)) {
    const char *text = json_string_value(value);
    char quote[BX_QUOTE_SIZE];
    size_t name = bx_names_find(&s->names, text, strlen(text));
    st = name == SIZE_MAX
             ? bx_json_fail(j, "'%s' is the name of no node in 'nodes'; correct it, or put the node here",
                            bx_quote(text, strlen(text), quote))
             : load_named(s, name, out);
  } else if (json_is_object(value)) {
    st = load_node(s, value, out);
  } else {
    st = bx_json_fail(j, "neither the name of a node nor an object {\"node\": KIND, ...}");
  }
  j->level--;
  return st;
}

static batten_status take_names(scene *s, const json_t *nodes) {
  const char *key;
  json_t *value;
  if (!nodes) return BATTEN_OK;
  if (!json_is_object(nodes)) {
    bx_enter(s->j, "nodes");
    return bx_json_fail(s->j, "it must be an object of nodes by their names");
  }
  s->list = batten_alloc_array(s->j->ctx, json_object_size(nodes), sizeof *s->list);
  if (!s->list) return BATTEN_E_NOMEM;
  json_object_foreach((json_t *)(uintptr_t)nodes, key, value) {
    s->list[s->names.count] = (named){.value = value, .outer = SIZE_MAX};
    batten_status st = bx_names_add(&s->names, key, strlen(key));
    if (st != BATTEN_OK) return st;
  }
  return BATTEN_OK;
}

/* The tree of a document's or solid's members `nodes` and `root`. */
static batten_status load_nodes(bx_json *j, const json_t *object, const char *folder, unsigned depth,
                                batten_frep **out) {
  scene s = {.j = j, .folder = folder, .depth = depth, .names = {.ctx = j->ctx}, .inner = SIZE_MAX};
  json_t *root = NULL;
  batten_frep *tree = NULL, *unused = NULL;
  batten_status st = bx_get(j, object, "root", &root);
  if (st == BATTEN_OK) st = take_names(&s, json_object_get(object, "nodes"));
  s.place = strlen(j->place);
  if (st == BATTEN_OK) {
    bx_enter(j, "root");
    st = load_reference(&s, root, &tree);
    bx_leave(j, s.place);
  }
  for (size_t i = 0; st == BATTEN_OK && i < s.names.count; i++) { /* also those that nothing is made of */
    st = load_named(&s, i, &unused);
    if (st == BATTEN_OK) batten_frep_free(unused);
  }
  for (size_t i = 0; s.list && i < s.names.count; i++)
    if (s.list[i].state == MADE) batten_frep_free(s.list[i].node);
  batten_free(j->ctx, s.list);
  bx_names_free(&s.names);
  if (st == BATTEN_OK)
    *out = tree;
  else
    batten_frep_free(tree);
  return st;
}

/* ---- documents
 * ------------------------------------------------------------------------------------------------------------- */

batten_status bx_load_tree(bx_json *j, const json_t *object, unsigned depth, batten_solid **out) {
  batten_frep *tree = NULL;
  unsigned n = 0;
  size_t count = 0;
  double lower[3], upper[3], *points = NULL;
  batten_status st = bx_get_dimension(j, object, &n);
  if (st == BATTEN_OK) st = bx_get_numbers(j, object, "lower", n, lower);
  if (st == BATTEN_OK) st = bx_get_numbers(j, object, "upper", n, upper);
  if (st == BATTEN_OK) st = bx_get_rows(j, object, "points", n, &count, &points);
  if (st == BATTEN_OK) st = load_nodes(j, object, NULL, depth, &tree);
  if (st == BATTEN_OK && batten_frep_dimension(tree) != n)
    st = bx_json_fail(j, "'n' is %u, but its root is of dimension %u", n, batten_frep_dimension(tree));
  if (st == BATTEN_OK) st = bx_explain(j, batten_frep_solid_create(j->ctx, tree, lower, upper, count, points, out));
  batten_frep_free(tree);
  batten_free(j->ctx, points);
  return st;
}

/* The folder of a path, with its slash; "" for that in which the program runs. */
static batten_status folder_of(batten_context *ctx, const char *path, char **out) {
  const char *slash = strrchr(path, '/');
  size_t length = slash ? (size_t)(slash - path) + 1 : 0;
  *out = batten_alloc(ctx, length + 1);
  if (!*out) return BATTEN_E_NOMEM;
  memcpy(*out, path, length);
  (*out)[length] = '\0';
  return BATTEN_OK;
}

batten_status bx_load_frep_from(bx_reader *r, batten_frep **out) {
  bx_json j = {.ctx = r->ctx, .path = r->path};
  json_t *root = NULL;
  char *folder = NULL;
  batten_status st = bx_json_parse(r, &root);
  if (st == BATTEN_OK) st = bx_check_head(&j, root, "frep");
  if (st == BATTEN_OK && r->file >= 0) st = folder_of(r->ctx, r->path, &folder);
  if (st == BATTEN_OK && !json_object_get(root, "root")) st = bx_json_fail(&j, "'root' is missing");
  j.place[0] = '\0';
  if (st == BATTEN_OK) st = load_nodes(&j, root, folder, 0, out);
  batten_free(r->ctx, folder);
  json_decref(root);
  return st;
}

batten_status batten_load_frep(batten_context *ctx, const char *path, batten_frep **out) {
  bx_reader r;
  batten_status st = bx_open_document(&r, ctx, path, out, "scenes");
  if (st != BATTEN_OK) return st;
  st = bx_load_frep_from(&r, out);
  bx_close(&r);
  return st;
}
