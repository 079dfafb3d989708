/* batten inspect on solids of all kinds, carriers, sections and scenes. */
#include "inspect.h"

#include <math.h>
#include <stdio.h>

void inspect_box(cli_report *r, bool print, unsigned n, const double *lower, const double *upper) {
  cli_report_box(r, n, lower, upper);
  if (!print) return;
  printf("%-14s ", "box");
  for (unsigned k = 0; k < n; k++) printf("%s%.6g .. %.6g", k ? "  x  " : "", lower[k], upper[k]);
  putchar('\n');
}

static void tell_carrier_kind(cli_report *r, bool print, const batten_carrier *carrier) {
  batten_carrier_parts parts;
  batten_carrier_get_parts(carrier, &parts);
  cli_report_text(r, "carrier", batten_carrier_kind_name(parts.kind));
  if (!print) return;
  printf("%-14s %s", "carrier", batten_carrier_kind_name(parts.kind));
  for (size_t i = 0; i < parts.parameter_count && i < 16; i++) printf(" %.6g", parts.parameters[i]);
  putchar('\n');
}

/* ---- sections ----------------------------------------------------------------------------------------- */

typedef struct section_counts {
  size_t sections, contours, points;
} section_counts;

static section_counts count_sections(size_t count, const batten_section *sections) {
  section_counts c = {.sections = count};
  for (size_t i = 0; i < count; i++) {
    c.contours += sections[i].contour_count;
    c.points += sections[i].starts[sections[i].contour_count];
  }
  return c;
}

static void tell_sections(cli_report *r, bool print, const section_counts *c) {
  cli_report_count(r, "sections", c->sections);
  cli_report_count(r, "contours", c->contours);
  cli_report_count(r, "points", c->points);
  if (print) cli_line("sections", "%zu with %zu contours of %zu points", c->sections, c->contours, c->points);
}

/* The box of all contours in space. */
static void box_of(size_t count, const batten_section *sections, double *lower, double *upper) {
  for (int k = 0; k < 3; k++) lower[k] = INFINITY, upper[k] = -INFINITY;
  for (size_t i = 0; i < count; i++) {
    const batten_section *s = &sections[i];
    for (size_t p = 0; p < s->starts[s->contour_count]; p++)
      for (int k = 0; k < 3; k++) {
        double x = s->origin[k] + s->points[2 * p] * s->rotation[0][k] + s->points[2 * p + 1] * s->rotation[1][k];
        lower[k] = fmin(lower[k], x);
        upper[k] = fmax(upper[k], x);
      }
  }
}

batten_status inspect_sections(cli_run *run, const char *path, bool print, cli_report *r) {
  batten_section_set set = {0};
  double lower[3], upper[3];
  batten_status st = batten_read_sections(run->ctx, path, NULL, &set);
  if (st < 0) return st;
  section_counts c = count_sections(set.count, set.sections);
  cli_run_clear(run);
  cli_report_count(r, "dimension", 3);
  tell_sections(r, print, &c);
  if (c.points) {
    box_of(set.count, set.sections, lower, upper);
    inspect_box(r, print, 3, lower, upper);
  }
  batten_section_set_free(run->ctx, &set);
  return st;
}

/* ---- trees ---------------------------------------------------------------------------------------------- */

typedef struct node_counts {
  size_t nodes; /* shared ones as often as they stand in the tree */
  size_t leaves;
  size_t depth; /* levels */
} node_counts;

/* The kernel bounds the depth of trees, and so of this recursion, and how many nodes it passes. */
static void count_nodes(const batten_frep *node, size_t level, node_counts *c) {
  batten_frep_parts parts;
  batten_frep_get_parts(node, &parts);
  c->nodes++;
  c->leaves += parts.child_count == 0;
  if (level > c->depth) c->depth = level;
  for (size_t i = 0; i < parts.child_count; i++) count_nodes(parts.children[i], level + 1, c);
}

static void tell_tree(cli_report *r, bool print, const batten_frep *tree) {
  node_counts c = {0};
  batten_frep_parts parts;
  batten_frep_get_parts(tree, &parts);
  count_nodes(tree, 1, &c);
  cli_report_text(r, "root", batten_frep_kind_name(parts.kind));
  cli_report_count(r, "nodes", c.nodes);
  cli_report_count(r, "leaves", c.leaves);
  cli_report_count(r, "levels", c.depth);
  cli_report_bool(r, "distance", batten_frep_is_distance(tree));
  if (!print) return;
  cli_line("tree", "%s over %zu nodes in all, %zu leaves, %zu levels", batten_frep_kind_name(parts.kind), c.nodes,
           c.leaves, c.depth);
  cli_line("values", "%s", batten_frep_is_distance(tree) ? "distances" : "no distances");
}

batten_status inspect_frep(cli_run *run, const char *path, bool print, cli_report *r) {
  batten_frep *tree = NULL;
  double lower[3], upper[3];
  batten_status st = batten_load_frep(run->ctx, path, &tree);
  if (st < 0) return st;
  unsigned n = batten_frep_dimension(tree);
  batten_status boxed = batten_frep_box(run->ctx, tree, lower, upper);
  cli_run_clear(run);
  cli_report_count(r, "dimension", n);
  tell_tree(r, print, tree);
  if (boxed >= 0)
    inspect_box(r, print, n, lower, upper);
  else if (boxed != BATTEN_E_NOT_FOUND)
    st = boxed;
  else if (print)
    cli_line("box", "none: %s", batten_error(run->ctx));
  batten_frep_free(tree);
  return st;
}

/* ---- solids ---------------------------------------------------------------------------------------------- */

static void tell_spline(const batten_solid *solid, bool print, cli_report *r) {
  batten_spline_parts parts = {.struct_size = sizeof parts};
  batten_spline_get_parts(batten_solid_spline(solid), &parts);
  int power = 2 * (int)parts.m - (int)parts.n;
  cli_report_count(r, "order", parts.m);
  cli_report_count(r, "centers", parts.count);
  cli_report_count(r, "gradients", parts.gradient_count);
  cli_report_integer(r, "sign", batten_solid_sign(solid));
  if (print) {
    cli_line("solid", "of dimension %u from %zu centres%s", parts.n, parts.count,
             parts.gradient_count ? " with gradients" : "");
    cli_line("kernel", "r^%d%s, polynomial of degree %u", power, parts.n % 2 ? "" : " ln r", parts.m - 1);
    cli_line("sign", "%+d", batten_solid_sign(solid));
  }
  tell_carrier_kind(r, print, batten_solid_carrier(solid));
}

static batten_status tell_stack(cli_run *run, const batten_solid *solid, bool print, cli_report *r) {
  static const char *const between[] = {"natural", "not-a-knot", "monotone", "linear", "rational"};
  batten_stack_parts parts = {.struct_size = sizeof parts};
  batten_status st = batten_stack_get_parts(run->ctx, solid, &parts);
  if (st < 0) return st;
  size_t centers = 0;
  for (size_t i = 0; i < parts.count; i++) {
    batten_spline_parts spline = {.struct_size = sizeof spline};
    if (!parts.functions[i] || !batten_solid_spline(parts.functions[i])) continue;
    batten_spline_get_parts(batten_solid_spline(parts.functions[i]), &spline);
    centers += spline.count;
  }
  section_counts c = count_sections(parts.count, parts.sections);
  cli_report_count(r, "centers", centers);
  cli_report_text(r, "between", between[parts.between]);
  cli_report_count(r, "links", parts.link_count);
  if (print) {
    cli_line("solid", "from sections, %zu centres", centers);
    cli_line("between", "%s", between[parts.between]);
  }
  tell_sections(r, print, &c);
  return st;
}

batten_status inspect_solid(cli_run *run, const char *path, bool print, cli_report *r) {
  static const char *const kinds[] = {"spline", "stack", "tree"};
  batten_solid *solid = NULL;
  batten_status st = batten_load_solid(run->ctx, path, &solid);
  if (st < 0) return st;
  batten_solid_kind kind = batten_solid_kind_of(solid);
  unsigned n = batten_solid_dimension(solid);
  double lower[3], upper[3];
  batten_solid_box(solid, lower, upper);
  cli_run_clear(run);
  cli_report_count(r, "dimension", n);
  cli_report_text(r, "solid_kind", kinds[kind]);
  if (kind == BATTEN_SOLID_SPLINE)
    tell_spline(solid, print, r);
  else if (kind == BATTEN_SOLID_STACK)
    st = tell_stack(run, solid, print, r);
  else
    tell_tree(r, print, batten_solid_tree(solid));
  if (st >= 0) inspect_box(r, print, n, lower, upper);
  batten_solid_free(solid);
  return st;
}

batten_status inspect_carrier(cli_run *run, const char *path, bool print, cli_report *r) {
  batten_carrier *carrier = NULL;
  batten_status st = batten_load_carrier(run->ctx, path, &carrier);
  if (st < 0) return st;
  batten_carrier_parts parts;
  batten_carrier_get_parts(carrier, &parts);
  cli_report_count(r, "dimension", parts.n);
  tell_carrier_kind(r, print, carrier);
  batten_carrier_free(carrier);
  return st;
}
