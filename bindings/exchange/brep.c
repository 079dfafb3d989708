/* Edges, components and their nesting: see brep.h.
 *
 * Half-edges are sorted by their ends; two that run against each other are one edge. Components are found by merging
 * faces over edges. A closed one encloses a volume whose sign says which way its triangles face; it lies inside
 * another when the other winds once around a vertex of it (sum of the solid angles of a tessellation). Nested at odd
 * depth a component is a void of the least one around it, at even depth a solid of its own. */
#include "brep.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/checked.h"

enum {
  GRID = 6,    /* rows of the tessellation that decides inside and outside */
  SAMPLES = 9, /* places on an edge where its two sides are compared */
  GRID_POINTS = (GRID + 1) * (GRID + 2) / 2
};

static const double joint_tolerance = 1e-9; /* of the size: CAD systems join at 1e-7 and coarser */

/* ---- sides and their curves ------------------------------------------------------------------------ */

batten_network_patch bx_brep_side(const bx_brep *b, uint32_t half_edge, unsigned *side) {
  size_t first;
  unsigned k = half_edge % 3, count = batten_network_face_patches(b->network, half_edge / 3, &first);
  *side = count == 3 ? 0 : k; /* part k + 1 lies along side k and has it as its first */
  return batten_network_get_patch(b->network, count == 3 ? first + k : first);
}

double bx_brep_rounding(const bx_brep *b) { return 64 * 0x1p-53 * fmax(b->size, b->reach); }

unsigned bx_patch_curve(const bx_brep *b, const batten_network_patch *patch, unsigned side, double (*points)[3]) {
  bx_patch_side(patch->degree, patch->control_points, side, points);
  return bx_curve_reduce(patch->degree, points, bx_brep_rounding(b));
}

unsigned bx_brep_curve(const bx_brep *b, size_t edge, double (*points)[3]) {
  unsigned side;
  batten_network_patch patch = bx_brep_side(b, b->half[edge], &side);
  return bx_patch_curve(b, &patch, side, points);
}

/* ---- edges ----------------------------------------------------------------------------------------- */

typedef struct edge_key {
  uint32_t low, high, half;
} edge_key;

static int compare_keys(const void *a, const void *b) {
  const edge_key *p = a, *q = b;
  if (p->low != q->low) return p->low < q->low ? -1 : 1;
  if (p->high != q->high) return p->high < q->high ? -1 : 1;
  return p->half < q->half ? -1 : p->half > q->half;
}

static uint32_t corner(const bx_brep *b, uint32_t half_edge, unsigned ahead) {
  return batten_network_triangles(b->network)[half_edge - half_edge % 3 + (half_edge + ahead) % 3];
}

/* Edges numbered by their lowest half-edge; keys [3 faces] is work space. */
static void number_edges(bx_brep *b, edge_key *keys) {
  size_t halves = 3 * b->face_count;
  for (uint32_t h = 0; h < halves; h++) {
    uint32_t from = corner(b, h, 0), to = corner(b, h, 1);
    keys[h] = (edge_key){from < to ? from : to, from < to ? to : from, h};
    b->edge[h] = h; /* until it is numbered: the half-edge with which it makes an edge */
  }
  qsort(keys, halves, sizeof *keys, compare_keys);
  for (size_t i = 0; i < halves;) {
    size_t end = i + 1;
    while (end < halves && keys[end].low == keys[i].low && keys[end].high == keys[i].high) end++;
    if (end == i + 2 && corner(b, keys[i].half, 0) != corner(b, keys[i + 1].half, 0)) {
      b->edge[keys[i].half] = keys[i + 1].half;
      b->edge[keys[i + 1].half] = keys[i].half;
    }
    i = end;
  }
  uint32_t count = 0;
  for (uint32_t h = 0; h < halves; h++) {
    uint32_t twin = b->edge[h];
    b->edge[h] = twin < h ? b->edge[twin] : count;
    if (twin >= h) b->half[count++] = h;
  }
  b->edge_count = count;
}

/* ---- do the patches meet? -------------------------------------------------------------------------- */

static double distance(const double *a, const double *b) {
  double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
}

/* Largest distance of two sides; reversed: the second runs against the first. */
static double gap_of(const batten_network_patch *p, unsigned side_p, const batten_network_patch *q, unsigned side_q,
                     bool reversed) {
  double a[BX_DEGREE_MAX + 1][3], c[BX_DEGREE_MAX + 1][3], gap = 0;
  bx_patch_side(p->degree, p->control_points, side_p, a);
  bx_patch_side(q->degree, q->control_points, side_q, c);
  if (reversed) bx_curve_reverse(q->degree, c);
  for (int i = 0; i < SAMPLES; i++) {
    double t = (double)i / (SAMPLES - 1), x[3], y[3];
    bx_curve_at(p->degree, (const double(*)[3])a, t, x);
    bx_curve_at(q->degree, (const double(*)[3])c, t, y);
    gap = fmax(gap, distance(x, y));
  }
  return gap;
}

static batten_status check_face(batten_context *ctx, const bx_brep *b, size_t face) {
  const double *vertices = batten_network_vertices(b->network);
  double allowed = joint_tolerance * b->size;
  size_t first;
  unsigned count = batten_network_face_patches(b->network, face, &first);
  for (unsigned k = 0; k < 3; k++) {
    uint32_t h = (uint32_t)(3 * face) + k, v = corner(b, h, 0);
    double ends[BX_DEGREE_MAX + 1][3];
    unsigned side;
    batten_network_patch patch = bx_brep_side(b, h, &side);
    bx_patch_side(patch.degree, patch.control_points, side, ends);
    double off = fmax(distance(ends[0], vertices + 3 * (size_t)v),
                      distance(ends[patch.degree], vertices + 3 * (size_t)corner(b, h, 1)));
    if (!(off <= allowed))
      return batten_fail(
          ctx, BATTEN_E_INVALID,
          "network: the patch of triangle %zu is %g away from a vertex along its edge %u %u; CAD faces "
          "must meet to %g",
          face, off, v, corner(b, h, 1), allowed);
    if (count == 3) {
      batten_network_patch next = batten_network_get_patch(b->network, first + (k + 1) % 3);
      off = gap_of(&patch, 1, &next, 2, true);
      if (!(off <= allowed))
        return batten_fail(ctx, BATTEN_E_INVALID,
                           "network: parts %u and %u of triangle %zu are %g apart; CAD faces must meet to %g", k + 1,
                           (k + 1) % 3 + 1, face, off, allowed);
    }
    uint32_t half = b->half[b->edge[h]];
    if (half == h) continue;
    unsigned other_side;
    batten_network_patch other = bx_brep_side(b, half, &other_side);
    off = gap_of(&patch, side, &other, other_side, true);
    if (!(off <= allowed))
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "network: the patches of triangles %u and %zu are %g apart along the edge %u %u; CAD faces "
                         "must meet to %g",
                         half / 3, face, off, v, corner(b, h, 1), allowed);
  }
  return BATTEN_OK;
}

/* ---- components ------------------------------------------------------------------------------------ */

static uint32_t root_of(uint32_t *parent, uint32_t f) {
  while (parent[f] != f) {
    parent[f] = parent[parent[f]];
    f = parent[f];
  }
  return f;
}

/* component [faces]: the faces joined through edges, numbered by their first face; parent [faces] is work space. */
static void number_components(bx_brep *b, uint32_t *parent) {
  for (uint32_t f = 0; f < b->face_count; f++) parent[f] = f;
  for (uint32_t h = 0; h < 3 * b->face_count; h++) {
    uint32_t p = root_of(parent, h / 3), q = root_of(parent, b->half[b->edge[h]] / 3);
    if (p < q)
      parent[q] = p;
    else
      parent[p] = q;
  }
  uint32_t count = 0;
  for (uint32_t f = 0; f < b->face_count; f++) {
    uint32_t root = root_of(parent, f);
    b->component[f] = root == f ? count++ : b->component[root];
  }
  b->component_count = count;
}

typedef struct grid {
  bx_square_work work;
  double points[GRID_POINTS][3];
} grid;

static void sample_patch(grid *g, const batten_network_patch *patch) {
  size_t at = 0;
  for (unsigned k = 0; k <= GRID; k++)
    for (unsigned j = 0; j + k <= GRID; j++, at++)
      bx_patch_at(&g->work, patch->degree, patch->control_points, (double)j / GRID, (double)k / GRID, g->points[at]);
}

/* Corners of the grid's triangles, one after the other; false behind the last. */
static bool grid_triangle(unsigned index, size_t corners[3]) {
  for (unsigned k = 0; k < GRID; k++) {
    unsigned row = GRID - k, in_row = 2 * row - 1;
    if (index >= in_row) {
      index -= in_row;
      continue;
    }
    size_t start = (size_t)k * (2 * GRID + 3 - k) / 2, above = start + row + 1, j = index / 2;
    if (index % 2 == 0)
      corners[0] = start + j, corners[1] = start + j + 1, corners[2] = above + j;
    else
      corners[0] = start + j + 1, corners[1] = above + j + 1, corners[2] = above + j;
    return true;
  }
  return false;
}

static double triple(const double *a, const double *b, const double *c) {
  return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/* Six times the volume of the cone from a place over the tessellation of a patch. */
static double cone_volume(grid *g, const batten_network_patch *patch, const double from[3]) {
  double sum = 0;
  size_t at[3];
  sample_patch(g, patch);
  for (unsigned i = 0; grid_triangle(i, at); i++) {
    double p[3][3];
    for (int c = 0; c < 3; c++)
      for (int x = 0; x < 3; x++) p[c][x] = g->points[at[c]][x] - from[x];
    sum += triple(p[0], p[1], p[2]);
  }
  return sum;
}

/* Solid angle of the tessellation seen from a place [Van Oosterom, Strackee 1983]. */
static double solid_angle(grid *g, const batten_network_patch *patch, const double from[3]) {
  double sum = 0;
  size_t at[3];
  sample_patch(g, patch);
  for (unsigned i = 0; grid_triangle(i, at); i++) {
    double p[3][3], length[3], dot[3];
    for (int c = 0; c < 3; c++) {
      for (int x = 0; x < 3; x++) p[c][x] = g->points[at[c]][x] - from[x];
      length[c] = sqrt(p[c][0] * p[c][0] + p[c][1] * p[c][1] + p[c][2] * p[c][2]);
    }
    for (int c = 0; c < 3; c++) {
      const double *q = p[(c + 1) % 3], *r = p[(c + 2) % 3];
      dot[c] = q[0] * r[0] + q[1] * r[1] + q[2] * r[2];
    }
    sum += 2 * atan2(triple(p[0], p[1], p[2]), length[0] * length[1] * length[2] + dot[0] * length[0] +
                                                   dot[1] * length[1] + dot[2] * length[2]);
  }
  return sum;
}

static void widen_box(bx_component *c, const batten_network_patch *patch) {
  size_t numbers = 3 * (size_t)(patch->degree + 1) * (patch->degree + 2) / 2;
  for (size_t i = 0; i < numbers; i++) {
    c->lower[i % 3] = fmin(c->lower[i % 3], patch->control_points[i]);
    c->upper[i % 3] = fmax(c->upper[i % 3], patch->control_points[i]);
  }
}

static void measure_components(bx_brep *b, grid *g) {
  const double *vertices = batten_network_vertices(b->network);
  for (size_t c = 0; c < b->component_count; c++)
    b->components[c] = (bx_component){
        .parent = BX_NONE, .lower = {INFINITY, INFINITY, INFINITY}, .upper = {-INFINITY, -INFINITY, -INFINITY}};
  for (uint32_t f = 0; f < b->face_count; f++) {
    bx_component *c = &b->components[b->component[f]];
    size_t first;
    unsigned count = batten_network_face_patches(b->network, f, &first);
    if (c->faces++ == 0) c->vertex = corner(b, 3 * f, 0);
    for (unsigned k = 0; k < 3; k++) {
      uint32_t h = 3 * f + k; /* of two half-edges the edge has the lower one */
      if (b->half[b->edge[h]] != h) c->joints++;
    }
    for (unsigned i = 0; i < count; i++) {
      batten_network_patch patch = batten_network_get_patch(b->network, first + i);
      widen_box(c, &patch);
      c->volume += cone_volume(g, &patch, vertices + 3 * (size_t)c->vertex) / 6;
    }
  }
  uint32_t before = 0;
  for (size_t i = 0; i < b->component_count; i++) {
    bx_component *c = &b->components[i];
    c->closed = 2 * (uint64_t)c->joints == 3 * (uint64_t)c->faces;
    c->inward = c->closed && c->volume < 0;
    c->first = before;
    before += c->faces;
    c->faces = 0; /* counted again while sorting */
  }
  for (uint32_t f = 0; f < b->face_count; f++) {
    bx_component *c = &b->components[b->component[f]];
    b->sorted[c->first + c->faces++] = f;
  }
}

static bool box_within(const bx_component *inner, const bx_component *outer) {
  for (int x = 0; x < 3; x++)
    if (!(inner->lower[x] >= outer->lower[x] && inner->upper[x] <= outer->upper[x])) return false;
  return true;
}

/* Does closed component c wind around the vertex? */
static bool encloses(const bx_brep *b, grid *g, uint32_t c, uint32_t vertex) {
  double angle = 0;
  for (uint32_t i = 0; i < b->components[c].faces; i++) {
    size_t first;
    unsigned count = batten_network_face_patches(b->network, b->sorted[b->components[c].first + i], &first);
    for (unsigned k = 0; k < count; k++) {
      batten_network_patch patch = batten_network_get_patch(b->network, first + k);
      angle += solid_angle(g, &patch, batten_network_vertices(b->network) + 3 * (size_t)vertex);
    }
  }
  return fabs(angle) > 6.283185307179586; /* 0 outside, 4 pi inside */
}

static void nest_components(bx_brep *b, grid *g) {
  for (uint32_t i = 0; i < b->component_count; i++) {
    bx_component *c = &b->components[i];
    unsigned depth = 0;
    for (uint32_t k = 0; c->closed && k < b->component_count; k++) {
      bx_component *around = &b->components[k];
      if (k == i || !around->closed || !box_within(c, around) || !encloses(b, g, k, c->vertex)) continue;
      depth++;
      if (c->parent == BX_NONE || fabs(around->volume) < fabs(b->components[c->parent].volume)) c->parent = k;
    }
    if (depth % 2 == 0) c->parent = BX_NONE;
  }
}

/* ---- all of it ------------------------------------------------------------------------------------- */

void bx_brep_free(batten_context *ctx, bx_brep *b) {
  batten_free(ctx, b->edge);
  batten_free(ctx, b->half);
  batten_free(ctx, b->component);
  batten_free(ctx, b->sorted);
  batten_free(ctx, b->components);
  *b = (bx_brep){0};
}

static void measure_box(bx_brep *b) {
  const double *x = batten_network_vertices(b->network);
  double lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t i = 0; i < 3 * batten_network_vertex_count(b->network); i++) {
    lower[i % 3] = fmin(lower[i % 3], x[i]);
    upper[i % 3] = fmax(upper[i % 3], x[i]);
    b->reach = fmax(b->reach, fabs(x[i]));
  }
  b->size = hypot(hypot(upper[0] - lower[0], upper[1] - lower[1]), upper[2] - lower[2]);
}

batten_status bx_brep_make(batten_context *ctx, const batten_network *network, bx_brep *out) {
  bx_brep b = {.network = network, .face_count = batten_network_face_count(network)};
  batten_status st = BATTEN_E_NOMEM;
  edge_key *keys = NULL;
  uint32_t *parent = NULL;
  grid *g = NULL;
  if (b.face_count == 0)
    return batten_fail(ctx, BATTEN_E_INVALID, "network: it has no patches; CAD files need a face");
  if (b.face_count > UINT32_MAX / 3)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "network: %zu triangles; CAD files take %u", b.face_count,
                       UINT32_MAX / 3);
  measure_box(&b);
  if (!(b.size > 0))
    return batten_fail(ctx, BATTEN_E_INVALID, "network: all vertices are at the same place; CAD files need a size");
  keys = batten_alloc_array(ctx, b.face_count, 3 * sizeof *keys);
  parent = batten_alloc_array(ctx, b.face_count, sizeof *parent);
  g = batten_alloc(ctx, sizeof *g);
  b.edge = batten_alloc_array(ctx, b.face_count, 3 * sizeof *b.edge);
  b.half = batten_alloc_array(ctx, b.face_count, 3 * sizeof *b.half);
  b.component = batten_alloc_array(ctx, b.face_count, sizeof *b.component);
  b.sorted = batten_alloc_array(ctx, b.face_count, sizeof *b.sorted);
  if (!keys || !parent || !g || !b.edge || !b.half || !b.component || !b.sorted) goto done;
  number_edges(&b, keys);
  st = BATTEN_OK;
  for (size_t f = 0; st == BATTEN_OK && f < b.face_count; f++) st = check_face(ctx, &b, f);
  if (st != BATTEN_OK) goto done;
  number_components(&b, parent);
  b.components = batten_alloc_array(ctx, b.component_count, sizeof *b.components);
  st = b.components ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st != BATTEN_OK) goto done;
  measure_components(&b, g);
  nest_components(&b, g);
  *out = b;
done:
  if (st != BATTEN_OK) bx_brep_free(ctx, &b);
  batten_free(ctx, keys);
  batten_free(ctx, parent);
  batten_free(ctx, g);
  return st;
}
