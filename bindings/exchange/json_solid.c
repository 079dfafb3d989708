/* Loading the documents that json_write.c writes. Shapes, types and counts are checked here, with the place in the
 * document; what numbers mean is checked by the kernel's constructors, whose texts are passed on behind the place. */
#include "format.h"
#include "json_carrier.h"
#include "json_solid.h"

#include <stdio.h>
#include <string.h>

batten_status bx_explain(bx_json *j, batten_status st) {
  const char *text = batten_error(j->ctx); /* options of making a solid are members of the document */
  return st == BATTEN_E_INVALID ? bx_json_fail(j, "%s", text + (strncmp(text, "opt.", 4) ? 0 : 4)) : st;
}

batten_status bx_get_choice(bx_json *j, const json_t *object, const char *key, size_t count, const char *const *names,
                            int *out) {
  const char *text = "";
  char quote[BX_QUOTE_SIZE];
  if (!json_object_get(object, key)) return BATTEN_OK;
  batten_status st = bx_get_text(j, object, key, &text);
  if (st != BATTEN_OK) return st;
  for (size_t i = 0; i < count; i++)
    if (!strcmp(text, names[i])) {
      *out = (int)i;
      return BATTEN_OK;
    }
  char list[128] = "";
  for (size_t i = 0, used = 0; i < count && used < sizeof list; i++)
    used += (size_t)snprintf(list + used, sizeof list - used, "%s%s", i ? ", " : "", names[i]);
  return bx_json_fail(j, "'%s' is '%s', which is none of %s", key, bx_quote(text, strlen(text), quote), list);
}

batten_status bx_get_dimension(bx_json *j, const json_t *object, unsigned *n) {
  int64_t value = 0;
  batten_status st = bx_get_whole(j, object, "n", 1, 3, &value);
  if (st == BATTEN_OK) *n = (unsigned)value;
  return st;
}

/* ---- splines ------------------------------------------------------------------------------------ */

typedef struct spline_arrays {
  double *centers, *coefficients, *gradient_coefficients, *polynomial, *gradient_at_values;
  size_t *gradient_at;
} spline_arrays;

static batten_status get_indices(bx_json *j, const json_t *object, size_t *count, spline_arrays *a) {
  batten_status st = bx_get_rows(j, object, "gradient_at", 0, count, &a->gradient_at_values);
  if (st != BATTEN_OK) return st;
  a->gradient_at = batten_alloc_array(j->ctx, *count, sizeof *a->gradient_at);
  if (!a->gradient_at) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < *count; i++) {
    double value = a->gradient_at_values[i];
    /* 2^53: beyond, doubles are no longer all whole numbers */
    if (!(value >= 0 && value <= 0x1p53) || value > (double)(size_t)value) {
      size_t key = bx_enter(j, "gradient_at");
      bx_enter_item(j, i);
      st = bx_json_fail(j, "%g, where the number of a center is expected", value);
      bx_leave(j, key);
      return st;
    }
    a->gradient_at[i] = (size_t)value;
  }
  return BATTEN_OK;
}

static batten_status check_count(bx_json *j, const char *key, size_t count, const char *other, size_t expected) {
  if (count == expected) return BATTEN_OK;
  return bx_json_fail(j, "%zu in '%s', but %zu in '%s'", count, key, expected, other);
}

static batten_status get_arrays(bx_json *j, const json_t *object, batten_spline_parts *p, spline_arrays *a) {
  size_t count = 0;
  batten_status st = bx_get_rows(j, object, "polynomial", 0, &p->polynomial_count, &a->polynomial);
  if (st == BATTEN_OK) st = bx_get_rows(j, object, "centers", p->n, &p->count, &a->centers);
  if (st == BATTEN_OK) st = bx_get_rows(j, object, "coefficients", 0, &count, &a->coefficients);
  if (st == BATTEN_OK) st = check_count(j, "coefficients", count, "centers", p->count);
  if (st != BATTEN_OK || !json_object_get(object, "gradient_at")) return st;
  st = get_indices(j, object, &p->gradient_count, a);
  if (st == BATTEN_OK) st = bx_get_rows(j, object, "gradient_coefficients", p->n, &count, &a->gradient_coefficients);
  if (st == BATTEN_OK) st = check_count(j, "gradient_coefficients", count, "gradient_at", p->gradient_count);
  return st;
}

static batten_status load_spline(bx_json *j, const json_t *object, batten_spline **out) {
  batten_spline_parts p = {.struct_size = sizeof p};
  spline_arrays a = {0};
  int64_t m = 0;
  batten_status st = bx_get_dimension(j, object, &p.n);
  if (st == BATTEN_OK) st = bx_get_whole(j, object, "m", 1, 4, &m);
  if (st == BATTEN_OK) st = bx_get_numbers(j, object, "origin", p.n, p.origin);
  if (st == BATTEN_OK) st = bx_get_number(j, object, "scale", &p.scale);
  if (st == BATTEN_OK) st = get_arrays(j, object, &p, &a);
  if (st == BATTEN_OK) {
    p.m = (unsigned)m;
    p.centers = a.centers;
    p.coefficients = a.coefficients;
    p.polynomial = a.polynomial;
    p.gradient_at = a.gradient_at;
    p.gradient_coefficients = a.gradient_coefficients;
    st = bx_explain(j, batten_spline_create(j->ctx, &p, out));
  }
  batten_free(j->ctx, a.centers);
  batten_free(j->ctx, a.coefficients);
  batten_free(j->ctx, a.polynomial);
  batten_free(j->ctx, a.gradient_coefficients);
  batten_free(j->ctx, a.gradient_at_values);
  batten_free(j->ctx, a.gradient_at);
  return st;
}

/* ---- carriers and solids, which nest ------------------------------------------------------------ */

/* [n][n]; left out: the identity. */
static batten_status get_matrix(bx_json *j, const json_t *object, const char *key, unsigned n, double *out) {
  double *rows = NULL;
  size_t count = 0;
  for (unsigned i = 0; i < n * n; i++) out[i] = i % (n + 1) == 0;
  if (!json_object_get(object, key)) return BATTEN_OK;
  batten_status st = bx_get_rows(j, object, key, n, &count, &rows);
  if (st == BATTEN_OK) st = check_count(j, key, count, "n", n);
  if (st == BATTEN_OK) memcpy(out, rows, (size_t)n * n * sizeof *out);
  batten_free(j->ctx, rows);
  return st;
}

static batten_status get_members(bx_json *j, const json_t *object, const bx_carrier_layout *layout, unsigned n,
                                 double *values, size_t *count) {
  batten_status st = BATTEN_OK;
  *count = 0;
  for (unsigned i = 0; st == BATTEN_OK && i < layout->member_count; i++) {
    const char *key = layout->members[i].name;
    switch (layout->members[i].shape) {
      case BX_NUMBER:
        values[*count] = 0;
        if (json_object_get(object, key) || strcmp(key, "rounding"))
          st = bx_get_number(j, object, key, values + *count);
        *count += 1;
        break;
      case BX_VECTOR:
        st = bx_get_numbers(j, object, key, n, values + *count);
        *count += n;
        break;
      case BX_MATRIX:
        st = get_matrix(j, object, key, n, values + *count);
        *count += (size_t)n * n;
    }
  }
  return st;
}

static batten_status get_children(bx_json *j, const json_t *object, unsigned n, unsigned depth,
                                  batten_carrier *children[2]) {
  json_t *array;
  batten_status st = bx_get(j, object, "children", &array);
  if (st == BATTEN_OK && json_array_size(array) != 2) /* 0 for what is no array */
    st = bx_json_fail(j, "'children' must be an array of two carriers");
  for (size_t i = 0; st == BATTEN_OK && i < 2; i++) {
    size_t mark = bx_enter(j, "children");
    bx_enter_item(j, i);
    st = bx_load_carrier(j, json_array_get(array, i), n, depth + 1, &children[i]);
    bx_leave(j, mark);
  }
  return st;
}

static batten_status get_nested_solid(bx_json *j, const json_t *object, unsigned depth, batten_solid **out) {
  json_t *nested;
  batten_status st = bx_get(j, object, "solid", &nested);
  if (st != BATTEN_OK) return st;
  size_t mark = bx_enter(j, "solid");
  st = bx_load_solid_members(j, nested, depth + 1, out);
  bx_leave(j, mark);
  return st;
}

batten_status bx_load_carrier(bx_json *j, const json_t *object, unsigned n, unsigned depth, batten_carrier **out) {
  const char *kind = "";
  batten_status st = bx_get_text(j, object, "kind", &kind);
  if (st != BATTEN_OK) return st;
  const bx_carrier_layout *layout = bx_layout_named(kind);
  char quote[BX_QUOTE_SIZE];
  if (!layout)
    return bx_json_fail(j,
                        "kind '%s' is not none, ball, ellipsoid, box, cylinder, torus, half-space, union, "
                        "intersection or solid",
                        bx_quote(kind, strlen(kind), quote));
  return bx_load_carrier_members(j, object, layout, n, depth, out);
}

/* Recursion no deeper than BX_CARRIER_DEPTH. */
batten_status bx_load_carrier_members(bx_json *j, const json_t *object, const bx_carrier_layout *layout, unsigned n,
                                      unsigned depth, batten_carrier **out) {
  enum { VALUES_MAX = 16 }; /* of a box in space: 3 + 3 + 9 + 1 */
  double values[VALUES_MAX];
  batten_carrier *children[2] = {NULL, NULL};
  batten_solid *solid = NULL;
  if (depth >= BX_CARRIER_DEPTH) return bx_json_fail(j, "nested deeper than %d", BX_CARRIER_DEPTH);
  batten_carrier_parts p = {.kind = layout->kind, .n = n, .parameters = values};
  batten_status st = get_members(j, object, layout, n, values, &p.parameter_count);
  if (st == BATTEN_OK && layout->child_count) st = get_children(j, object, n, depth, children);
  if (st == BATTEN_OK && layout->kind == BATTEN_CARRIER_SOLID) st = get_nested_solid(j, object, depth, &solid);
  if (st == BATTEN_OK) {
    p.children[0] = children[0];
    p.children[1] = children[1];
    p.solid = solid;
    st = bx_explain(j, batten_carrier_create(j->ctx, &p, out));
  }
  batten_carrier_free(children[0]);
  batten_carrier_free(children[1]);
  batten_solid_free(solid);
  return st;
}

static batten_status get_spline(bx_json *j, const json_t *object, batten_spline **out) {
  json_t *spline;
  batten_status st = bx_get(j, object, "spline", &spline);
  if (st != BATTEN_OK) return st;
  size_t mark = bx_enter(j, "spline");
  st = load_spline(j, spline, out);
  bx_leave(j, mark);
  return st;
}

static batten_status get_carrier(bx_json *j, const json_t *object, unsigned n, unsigned depth, batten_carrier **out) {
  json_t *carrier;
  batten_status st = bx_get(j, object, "carrier", &carrier);
  if (st != BATTEN_OK) return st;
  size_t mark = bx_enter(j, "carrier");
  st = bx_load_carrier(j, carrier, n, depth, out);
  bx_leave(j, mark);
  return st;
}

static batten_status load_spline_solid(bx_json *j, const json_t *object, unsigned depth, batten_solid **out) {
  unsigned n = 0;
  int64_t sign = 0;
  size_t count = 0;
  double lower[3], upper[3], *points = NULL;
  batten_spline *spline = NULL;
  batten_carrier *carrier = NULL;
  batten_status st = bx_get_dimension(j, object, &n);
  if (st == BATTEN_OK) st = bx_get_whole(j, object, "sign", -1, 1, &sign);
  if (st == BATTEN_OK) st = bx_get_numbers(j, object, "lower", n, lower);
  if (st == BATTEN_OK) st = bx_get_numbers(j, object, "upper", n, upper);
  if (st == BATTEN_OK) st = get_spline(j, object, &spline);
  if (st == BATTEN_OK) st = get_carrier(j, object, n, depth, &carrier);
  if (st == BATTEN_OK && json_object_get(object, "points")) st = bx_get_rows(j, object, "points", n, &count, &points);
  if (st == BATTEN_OK)
    st = bx_explain(j, batten_solid_create(j->ctx, spline, carrier, (int)sign, lower, upper, count, points, out));
  batten_free(j->ctx, points);
  batten_spline_free(spline);
  batten_carrier_free(carrier);
  return st;
}

/* Solids of the three kinds nest in each other, through carriers, section functions and leaves of trees. */
batten_status bx_load_solid_members(bx_json *j, const json_t *object, unsigned depth, batten_solid **out) {
  static const char *const kinds[] = {"spline", "stack", "tree"};
  int kind = BATTEN_SOLID_SPLINE;
  if (depth >= BX_CARRIER_DEPTH) return bx_json_fail(j, "nested deeper than %d", BX_CARRIER_DEPTH);
  batten_status st = bx_get_choice(j, object, "kind", 3, kinds, &kind);
  if (st != BATTEN_OK) return st;
  if (kind == BATTEN_SOLID_STACK) return bx_load_stack(j, object, depth, out);
  if (kind == BATTEN_SOLID_TREE) return bx_load_tree(j, object, depth, out);
  return load_spline_solid(j, object, depth, out);
}

/* ---- documents ---------------------------------------------------------------------------------- */

batten_status bx_load_solid_from(bx_reader *r, batten_solid **out) {
  bx_json j = {.ctx = r->ctx, .path = r->path};
  json_t *root = NULL;
  batten_status st = bx_json_parse(r, &root);
  if (st == BATTEN_OK) st = bx_check_head(&j, root, "solid");
  snprintf(j.place, sizeof j.place, "solid");
  if (st == BATTEN_OK) st = bx_load_solid_members(&j, root, 0, out);
  json_decref(root);
  return st;
}

batten_status bx_load_carrier_from(bx_reader *r, batten_carrier **out) {
  bx_json j = {.ctx = r->ctx, .path = r->path};
  json_t *root = NULL;
  unsigned n = 0;
  batten_status st = bx_json_parse(r, &root);
  if (st == BATTEN_OK) st = bx_check_head(&j, root, "carrier");
  if (st == BATTEN_OK) st = bx_get_dimension(&j, root, &n);
  j.place[0] = '\0';
  if (st == BATTEN_OK) st = get_carrier(&j, root, n, 0, out);
  json_decref(root);
  return st;
}

batten_status batten_load_solid(batten_context *ctx, const char *path, batten_solid **out) {
  bx_reader r;
  batten_status st = bx_check_pointers(ctx, path, out, "out");
  if (st == BATTEN_OK) st = bx_open(&r, ctx, path);
  if (st != BATTEN_OK) return st;
  st = bx_load_solid_from(&r, out);
  bx_close(&r);
  return st;
}

batten_status batten_load_carrier(batten_context *ctx, const char *path, batten_carrier **out) {
  bx_reader r;
  batten_status st = bx_check_pointers(ctx, path, out, "out");
  if (st == BATTEN_OK) st = bx_open(&r, ctx, path);
  if (st != BATTEN_OK) return st;
  st = bx_load_carrier_from(&r, out);
  bx_close(&r);
  return st;
}
