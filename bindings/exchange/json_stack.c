/* Solids from sections in documents:
 *
 * {..., "kind": "stack", "n": 3, "method", "between", "shape", "below": {"end", "length"}, "above", "rotation",
 * "path", "parameter", "links": [[section, loop, loop], ...], "sections": [{"t", "scale", "saturation",
 * "angular_velocity", "origin", "rotation", "contours", "function": {plane solid}}, ...]}
 *
 * All that batten_stack_create takes, so that the solid evaluates to the same bits. saturation is left out where
 * there is none, function where the solid ends in the section's points. */
#include "json_solid.h"
#include "sections.h"
#include "write.h"

#include "base/checked.h"

#include <string.h>

static const char *const betweens[] = {"natural", "not-a-knot", "monotone", "linear", "rational"};
static const char *const end_rules[] = {"flat", "plane", "rounded", "open"};
static const char *const rotations[] = {"spherical", "geodesic", "logarithm", "velocity"};
static const char *const paths[] = {"cubic", "linear"};
static const char *const parameters[] = {"root", "ratio"};
static const char *const methods[] = {"pairs", "points", "carrier"};
#define COUNT_OF(names) (sizeof(names) / sizeof *(names))

/* ---- loading -------------------------------------------------------------------------------------------- */

/* The arrays of batten_stack_parts, to be filled. */
typedef struct arrays {
  size_t count; /* sections that have been begun */
  batten_section *sections;
  batten_solid **functions;
  double *parameters, *scales, *saturations, *angular_velocity;
  batten_stack_link *links;
} arrays;

static void free_arrays(batten_context *ctx, arrays *a) {
  for (size_t i = 0; i < a->count; i++) {
    batten_free(ctx, bx_section_starts(&a->sections[i]));
    batten_free(ctx, bx_section_points(&a->sections[i]));
    batten_solid_free(a->functions[i]);
  }
  batten_free(ctx, a->sections);
  batten_free(ctx, a->functions);
  batten_free(ctx, a->parameters);
  batten_free(ctx, a->scales);
  batten_free(ctx, a->saturations);
  batten_free(ctx, a->angular_velocity);
  batten_free(ctx, a->links);
}

static batten_status allocate(batten_context *ctx, size_t count, bool turning, arrays *a) {
  a->sections = batten_alloc_array(ctx, count, sizeof *a->sections);
  a->functions = batten_alloc_array(ctx, count, sizeof(batten_solid *));
  a->parameters = batten_alloc_array(ctx, count, sizeof *a->parameters);
  a->scales = batten_alloc_array(ctx, count, sizeof *a->scales);
  a->saturations = batten_alloc_array(ctx, count, sizeof *a->saturations);
  if (turning) a->angular_velocity = batten_alloc_array(ctx, count, 3 * sizeof *a->angular_velocity);
  bool all = a->sections && a->functions && a->parameters && a->scales && a->saturations;
  return all && (!turning || a->angular_velocity) ? BATTEN_OK : BATTEN_E_NOMEM;
}

static batten_status get_function(bx_json *j, const json_t *object, unsigned depth, batten_solid **out) {
  json_t *function = json_object_get(object, "function");
  if (!function) return BATTEN_OK;
  size_t mark = bx_enter(j, "function");
  batten_status st = bx_load_solid_members(j, function, depth + 1, out);
  bx_leave(j, mark);
  return st;
}

static batten_status load_section(bx_json *j, const json_t *object, unsigned depth, size_t i, arrays *a) {
  a->sections[i] = (batten_section){.contour_count = 0};
  a->functions[i] = NULL;
  a->saturations[i] = INFINITY;
  a->scales[i] = 1;
  a->count++;
  batten_status st = bx_get_number(j, object, "t", &a->parameters[i]);
  if (st == BATTEN_OK && json_object_get(object, "scale")) st = bx_get_number(j, object, "scale", &a->scales[i]);
  if (st == BATTEN_OK && json_object_get(object, "saturation"))
    st = bx_get_number(j, object, "saturation", &a->saturations[i]);
  if (st == BATTEN_OK && a->angular_velocity)
    st = bx_get_numbers(j, object, "angular_velocity", 3, a->angular_velocity + 3 * i);
  if (st == BATTEN_OK) st = bx_get_section(j, object, &a->sections[i]);
  return st == BATTEN_OK ? get_function(j, object, depth, &a->functions[i]) : st;
}

static batten_status load_sections(bx_json *j, const json_t *object, unsigned depth, size_t *count, arrays *a) {
  json_t *array;
  batten_status st = bx_get(j, object, "sections", &array);
  if (st != BATTEN_OK) return st;
  *count = json_array_size(array); /* 0 for what is no array */
  if (*count == 0) return bx_json_fail(j, "'sections' must be an array of one or more");
  st = allocate(j->ctx, *count, json_object_get(json_array_get(array, 0), "angular_velocity"), a);
  for (size_t i = 0; st == BATTEN_OK && i < *count; i++) {
    size_t mark = bx_enter(j, "sections");
    bx_enter_item(j, i);
    st = load_section(j, json_array_get(array, i), depth, i, a);
    bx_leave(j, mark);
    if (st == BATTEN_OK && i % 16 == 0) st = batten_progress(j->ctx, "read", (double)i / (double)*count);
  }
  return st;
}

static batten_status load_links(bx_json *j, const json_t *object, size_t *count, arrays *a) {
  double *rows = NULL;
  batten_status st = BATTEN_OK;
  if (!json_object_get(object, "links")) return BATTEN_OK;
  st = bx_get_rows(j, object, "links", 3, count, &rows);
  if (st != BATTEN_OK) return st;
  a->links = batten_alloc_array(j->ctx, *count, sizeof *a->links);
  if (!a->links) st = BATTEN_E_NOMEM;
  for (size_t i = 0; st == BATTEN_OK && i < 3 * *count; i++) {
    size_t mark = bx_enter(j, "links");
    bx_enter_item(j, i / 3);
    if (!(rows[i] >= 0 && rows[i] < 0x1p31) || rows[i] > (double)(size_t)rows[i])
      st = bx_json_fail(j, "%g, where the number of a section or loop is expected", rows[i]);
    bx_leave(j, mark);
  }
  for (size_t i = 0; st == BATTEN_OK && i < *count; i++) {
    const double *row = rows + 3 * i;
    a->links[i] = (batten_stack_link){(size_t)row[0], {(size_t)row[1], (size_t)row[2]}};
  }
  batten_free(j->ctx, rows);
  return st;
}

static batten_status get_ends(bx_json *j, const json_t *object, batten_stack_parts *p) {
  static const char *const keys[] = {"below", "above"};
  batten_status st = BATTEN_OK;
  for (int i = 0; st == BATTEN_OK && i < 2; i++) {
    json_t *end;
    int rule = BATTEN_END_FLAT;
    st = bx_get(j, object, keys[i], &end);
    if (st != BATTEN_OK) return st;
    size_t mark = bx_enter(j, keys[i]);
    if (!json_is_object(end)) st = bx_json_fail(j, "it must be an object {\"end\": RULE, \"length\": ...}");
    if (st == BATTEN_OK) st = bx_get_choice(j, end, "end", COUNT_OF(end_rules), end_rules, &rule);
    p->ends[i] = (batten_stack_end)rule;
    if (st == BATTEN_OK && json_object_get(end, "length")) st = bx_get_number(j, end, "length", &p->end_lengths[i]);
    bx_leave(j, mark);
  }
  return st;
}

static batten_status get_choices(bx_json *j, const json_t *object, batten_stack_parts *p) {
  int method = 0, between = 0, rotation = 0, path = 0, parameter = 0;
  batten_status st = bx_get_choice(j, object, "method", COUNT_OF(methods), methods, &method);
  if (st == BATTEN_OK) st = bx_get_choice(j, object, "between", COUNT_OF(betweens), betweens, &between);
  if (st == BATTEN_OK) st = bx_get_choice(j, object, "rotation", COUNT_OF(rotations), rotations, &rotation);
  if (st == BATTEN_OK) st = bx_get_choice(j, object, "path", COUNT_OF(paths), paths, &path);
  if (st == BATTEN_OK) st = bx_get_choice(j, object, "parameter", COUNT_OF(parameters), parameters, &parameter);
  p->method = (batten_section_method)method;
  p->between = (batten_stack_between)between;
  p->rotation = (batten_stack_rotation)rotation;
  p->path = (batten_stack_path)path;
  p->parameter = (batten_stack_parameter)parameter;
  p->shape = 1;
  if (st == BATTEN_OK && json_object_get(object, "shape")) st = bx_get_number(j, object, "shape", &p->shape);
  return st;
}

batten_status bx_load_stack(bx_json *j, const json_t *object, unsigned depth, batten_solid **out) {
  batten_stack_parts p = {.struct_size = sizeof p};
  arrays a = {0};
  batten_status st = get_choices(j, object, &p);
  if (st == BATTEN_OK) st = get_ends(j, object, &p);
  if (st == BATTEN_OK) st = load_sections(j, object, depth, &p.count, &a);
  if (st == BATTEN_OK) st = load_links(j, object, &p.link_count, &a);
  if (st == BATTEN_OK) {
    p.sections = a.sections;
    p.functions = a.functions;
    p.parameters = a.parameters;
    p.scales = a.scales;
    p.saturations = a.saturations;
    p.angular_velocity = a.angular_velocity;
    p.links = a.links;
    st = bx_explain(j, batten_stack_create(j->ctx, &p, out));
  }
  free_arrays(j->ctx, &a);
  return st;
}

/* ---- saving --------------------------------------------------------------------------------------------- */

batten_status bx_check_stack(batten_context *ctx, const batten_solid *solid) {
  batten_stack_parts p = {.struct_size = sizeof p};
  batten_status st = batten_stack_get_parts(ctx, solid, &p);
  for (size_t i = 0; st == BATTEN_OK && i < p.count; i++)
    if (p.functions[i]) st = bx_check_solid(ctx, p.functions[i]);
  return st;
}

static void put_choice(bx_writer *w, const char *key, const char *name) {
  bx_print(w, ",\n\"%s\": \"%s\"", key, name);
}

static void put_number(bx_writer *w, const char *key, double value) {
  bx_print(w, ", \"%s\": ", key);
  bx_put_number(w, value);
}

static void put_section(bx_writer *w, const batten_stack_parts *p, size_t i) {
  bx_put_text(w, "{\"t\": ");
  bx_put_number(w, p->parameters[i]);
  put_number(w, "scale", p->scales[i]);
  if (isfinite(p->saturations[i])) put_number(w, "saturation", p->saturations[i]);
  if (p->angular_velocity) {
    bx_put_text(w, ", \"angular_velocity\": ");
    bx_put_json_numbers(w, p->angular_velocity + 3 * i, 3);
  }
  bx_put_text(w, ",\n");
  bx_put_section_members(w, &p->sections[i]);
  if (p->functions[i]) {
    bx_put_text(w, ",\n\"function\": {");
    bx_put_solid_members(w, p->functions[i]);
    bx_put_text(w, "}");
  }
  bx_put_text(w, "}");
}

void bx_put_stack(bx_writer *w, const batten_solid *solid) {
  static const char *const sides[] = {"below", "above"};
  batten_stack_parts p = {.struct_size = sizeof p};
  batten_status st = batten_stack_get_parts(w->ctx, solid, &p);
  if (st != BATTEN_OK) {
    bx_writer_fail(w, st);
    return;
  }
  bx_put_text(w, "\"kind\": \"stack\", \"n\": 3");
  put_choice(w, "method", methods[p.method]);
  put_choice(w, "between", betweens[p.between]);
  put_number(w, "shape", p.shape);
  for (int i = 0; i < 2; i++) {
    bx_print(w, ",\n\"%s\": {\"end\": \"%s\"", sides[i], end_rules[p.ends[i]]);
    if (isfinite(p.end_lengths[i])) put_number(w, "length", p.end_lengths[i]);
    bx_put_text(w, "}");
  }
  put_choice(w, "rotation", rotations[p.rotation]);
  put_choice(w, "path", paths[p.path]);
  put_choice(w, "parameter", parameters[p.parameter]);
  if (p.link_count) bx_put_text(w, ",\n\"links\": [");
  for (size_t i = 0; i < p.link_count; i++)
    bx_print(w, "%s[%zu, %zu, %zu]", i ? ", " : "", p.links[i].section, p.links[i].loop[0], p.links[i].loop[1]);
  bx_put_text(w, p.link_count ? "],\n\"sections\": [\n" : ",\n\"sections\": [\n");
  for (size_t i = 0; i < p.count; i++) {
    if (i) bx_put_text(w, ",\n");
    put_section(w, &p, i);
  }
  bx_put_text(w, "]");
}
