/* Solids and carriers as JSON documents.
 *
 * {"batten": "solid", "version": 1, "n": 3, "sign": 1, "lower": [...], "upper": [...],
 *  "spline": {"n", "m", "origin", "scale", "polynomial", "gradient_at", "gradient_coefficients", "coefficients",
 *             "centers"},
 *  "carrier": {"kind": "ball", "center": [...], "radius": ...}, "points": [...]}
 * {"batten": "carrier", "version": 1, "n": 3, "carrier": {...}}
 *
 * Written straight to the file, number by number, each in the shortest text that reads back to the same bits: a
 * library's tree of a large solid would take ten times its memory. */
#include "format.h"
#include "json_carrier.h"
#include "json_solid.h"
#include "write.h"

#include <string.h>

/* ---- layouts of carriers ------------------------------------------------------------------------ */

static const bx_carrier_layout layouts[] = {
    {BATTEN_CARRIER_NONE, 0, {{0}}, 0},
    {BATTEN_CARRIER_BALL, 2, {{"center", BX_VECTOR}, {"radius", BX_NUMBER}}, 0},
    {BATTEN_CARRIER_ELLIPSOID, 3, {{"center", BX_VECTOR}, {"semi_axes", BX_VECTOR}, {"rotation", BX_MATRIX}}, 0},
    {BATTEN_CARRIER_BOX,
     4,
     {{"center", BX_VECTOR}, {"half_extents", BX_VECTOR}, {"rotation", BX_MATRIX}, {"rounding", BX_NUMBER}},
     0},
    {BATTEN_CARRIER_CYLINDER,
     4,
     {{"a", BX_VECTOR}, {"b", BX_VECTOR}, {"radius", BX_NUMBER}, {"rounding", BX_NUMBER}},
     0},
    {BATTEN_CARRIER_TORUS,
     4,
     {{"center", BX_VECTOR}, {"axis", BX_VECTOR}, {"major_radius", BX_NUMBER}, {"minor_radius", BX_NUMBER}},
     0},
    {BATTEN_CARRIER_HALF_SPACE, 2, {{"point", BX_VECTOR}, {"normal", BX_VECTOR}}, 0},
    {BATTEN_CARRIER_UNION, 1, {{"alpha", BX_NUMBER}}, 2},
    {BATTEN_CARRIER_INTERSECTION, 1, {{"alpha", BX_NUMBER}}, 2},
    {BATTEN_CARRIER_SOLID, 0, {{0}}, 0},
};
enum { LAYOUTS = sizeof layouts / sizeof layouts[0] };

const bx_carrier_layout *bx_layout_of(batten_carrier_kind kind) {
  for (int i = 0; i < LAYOUTS; i++)
    if (layouts[i].kind == kind) return &layouts[i];
  return NULL;
}

const bx_carrier_layout *bx_layout_named(const char *kind_name) {
  for (int i = 0; i < LAYOUTS; i++)
    if (!strcmp(batten_carrier_kind_name(layouts[i].kind), kind_name)) return &layouts[i];
  return NULL;
}

/* ---- can it be saved? --------------------------------------------------------------------------- */

/* Before a file is opened: is there a callback? The kernel nests no deeper than BX_CARRIER_DEPTH, so this recursion,
 * and that of writing, goes no deeper either. */
batten_status bx_check_solid(batten_context *ctx, const batten_solid *solid) {
  switch (batten_solid_kind_of(solid)) {
    case BATTEN_SOLID_STACK:
      return bx_check_stack(ctx, solid);
    case BATTEN_SOLID_TREE:
      return bx_check_nodes(ctx, batten_solid_tree(solid));
    case BATTEN_SOLID_SPLINE:
      break;
  }
  return bx_check_carrier(ctx, batten_solid_carrier(solid));
}

batten_status bx_check_carrier(batten_context *ctx, const batten_carrier *carrier) {
  batten_carrier_parts parts;
  batten_carrier_get_parts(carrier, &parts);
  if (!bx_layout_of(parts.kind))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "carrier: a %s cannot be saved, its function is the host's; replace it by "
                       "another carrier",
                       batten_carrier_kind_name(parts.kind));
  batten_status st = BATTEN_OK;
  for (int i = 0; st == BATTEN_OK && i < 2 && parts.children[i]; i++) st = bx_check_carrier(ctx, parts.children[i]);
  if (st == BATTEN_OK && parts.solid) st = bx_check_solid(ctx, parts.solid);
  return st;
}

/* ---- writing ------------------------------------------------------------------------------------ */

/* One row a line. */
void bx_put_solid_rows(bx_writer *w, const double *values, size_t rows, size_t width) {
  bx_put_u8(w, '\n');
  bx_put_json_rows(w, values, rows, width, ",\n");
}

static void put_spline(bx_writer *w, const batten_spline *spline) {
  batten_spline_parts p = {.struct_size = sizeof p};
  batten_spline_get_parts(spline, &p);
  bx_print(w, "{\n\"n\": %u, \"m\": %u,\n\"origin\": ", p.n, p.m);
  bx_put_json_numbers(w, p.origin, p.n);
  bx_put_text(w, ", \"scale\": ");
  bx_put_number(w, p.scale);
  bx_put_text(w, ",\n\"polynomial\": ");
  bx_put_json_numbers(w, p.polynomial, p.polynomial_count);
  if (p.gradient_count) {
    bx_put_text(w, ",\n\"gradient_at\": [");
    for (size_t i = 0; i < p.gradient_count; i++) bx_print(w, i ? ", %zu" : "%zu", p.gradient_at[i]);
    bx_put_text(w, "],\n\"gradient_coefficients\": ");
    bx_put_solid_rows(w, p.gradient_coefficients, p.gradient_count, p.n);
  }
  bx_put_text(w, ",\n\"coefficients\": ");
  bx_put_json_numbers(w, p.coefficients, p.count);
  bx_put_text(w, ",\n\"centers\": ");
  bx_put_solid_rows(w, p.centers, p.count, p.n);
  bx_put_text(w, "\n}");
}

/* Recursion no deeper than BX_CARRIER_DEPTH. */
void bx_put_carrier(bx_writer *w, const batten_carrier *carrier) {
  batten_carrier_parts p;
  batten_carrier_get_parts(carrier, &p);
  const bx_carrier_layout *layout = bx_layout_of(p.kind);
  const double *values = p.parameters;
  bx_print(w, "{\"kind\": \"%s\"", batten_carrier_kind_name(p.kind));
  for (unsigned i = 0; i < layout->member_count; i++) {
    bx_print(w, ", \"%s\": ", layout->members[i].name);
    switch (layout->members[i].shape) {
      case BX_NUMBER:
        bx_put_number(w, *values++);
        break;
      case BX_VECTOR:
        bx_put_json_numbers(w, values, p.n);
        values += p.n;
        break;
      case BX_MATRIX:
        bx_put_text(w, "[");
        for (unsigned k = 0; k < p.n; k++, values += p.n) {
          if (k) bx_put_text(w, ", ");
          bx_put_json_numbers(w, values, p.n);
        }
        bx_put_text(w, "]");
    }
  }
  if (layout->child_count) {
    bx_put_text(w, ", \"children\": [\n");
    bx_put_carrier(w, p.children[0]);
    bx_put_text(w, ",\n");
    bx_put_carrier(w, p.children[1]);
    bx_put_text(w, "]");
  }
  if (p.solid) {
    bx_put_text(w, ", \"solid\": {");
    bx_put_solid_members(w, p.solid);
    bx_put_text(w, "}");
  }
  bx_put_text(w, "}");
}

static void put_spline_solid(bx_writer *w, const batten_solid *solid) {
  unsigned n = batten_solid_dimension(solid);
  double lower[3], upper[3];
  batten_solid_box(solid, lower, upper);
  bx_print(w, "\"n\": %u, \"sign\": %d,\n\"lower\": ", n, batten_solid_sign(solid));
  bx_put_json_numbers(w, lower, n);
  bx_put_text(w, ", \"upper\": ");
  bx_put_json_numbers(w, upper, n);
  bx_put_text(w, ",\n\"carrier\": ");
  bx_put_carrier(w, batten_solid_carrier(solid));
  bx_put_text(w, ",\n\"spline\": ");
  put_spline(w, batten_solid_spline(solid));
  size_t count;
  const double *points = batten_solid_points(solid, &count);
  bx_put_text(w, ",\n\"points\": ");
  bx_put_solid_rows(w, points, count, n);
}

void bx_put_solid_members(bx_writer *w, const batten_solid *solid) {
  switch (batten_solid_kind_of(solid)) {
    case BATTEN_SOLID_SPLINE:
      put_spline_solid(w, solid);
      break;
    case BATTEN_SOLID_STACK:
      bx_put_stack(w, solid);
      break;
    case BATTEN_SOLID_TREE:
      bx_put_tree(w, solid);
  }
}

static batten_status check_path(batten_context *ctx, const char *path, const void *what, const char *name) {
  batten_status st = bx_check_pointers(ctx, path, what, name);
  if (st == BATTEN_OK && bx_format_of(path, NULL) != BX_JSON)
    st = batten_fail(ctx, BATTEN_E_INVALID, "%s: a %s is saved as .json; rename the file", bx_short_path(path), name);
  return st;
}

batten_status batten_save_solid(batten_context *ctx, const batten_solid *solid, const char *path) {
  bx_writer w;
  batten_status st = check_path(ctx, path, solid, "solid");
  if (st == BATTEN_OK) st = bx_check_solid(ctx, solid);
  if (st == BATTEN_OK) st = bx_create(&w, ctx, path);
  if (st != BATTEN_OK) return st;
  bx_put_text(&w, "{\"batten\": \"solid\", \"version\": 1,\n");
  bx_put_solid_members(&w, solid);
  bx_put_text(&w, "\n}\n");
  return bx_commit(&w);
}

batten_status batten_save_carrier(batten_context *ctx, const batten_carrier *carrier, const char *path) {
  bx_writer w;
  batten_status st = check_path(ctx, path, carrier, "carrier");
  if (st == BATTEN_OK) st = bx_check_carrier(ctx, carrier);
  if (st == BATTEN_OK) st = bx_create(&w, ctx, path);
  if (st != BATTEN_OK) return st;
  batten_carrier_parts parts;
  batten_carrier_get_parts(carrier, &parts);
  bx_print(&w, "{\"batten\": \"carrier\", \"version\": 1, \"n\": %u,\n\"carrier\": ", parts.n);
  bx_put_carrier(&w, carrier);
  bx_put_text(&w, "\n}\n");
  return bx_commit(&w);
}
