/* Triangle meshes of networks, without cracks.
 *
 * Every edge, of the mesh and inside split facets, has a number of segments that both of its patches know, so that
 * they meet in the same vertices; a patch whose edges differ is joined to them by strips (pattern.h). On a triangle
 * with corners x_i the linear interpolant of a quadratic is off by
 *   sum_(i < j) l_i l_j |Q(x_i - x_j)| / 2 <= (1/6) (5/4) M d^2,
 * where sum l_i l_j <= 1/3, d is the largest difference of a barycentric coordinate, M bounds the second derivative
 * along the three edges' directions, and |Q| <= 5/4 M in all others of that size. In lattices d = 1 / N; in strips,
 * whose triangles lean, up to about sqrt2 / N. So N^2 = (5/12) M / tolerance, with M from the second differences of
 * the control points, and an edge takes the larger N of its two patches. */
#include "base/checked.h"
#include "mesh/mesh_inner.h"
#include "network/pattern.h"
#include "basis/shape.h"
#include "network/surface.h"

#include <string.h>

enum { DENSITY_MAX = 512, FACES_PER_TASK = 32 };
static const double ERROR_FACTOR = 5. / 12;

batten_tessellate_options batten_tessellate_options_default(void) {
  return (batten_tessellate_options){.struct_size = sizeof(batten_tessellate_options), .density = 8};
}

/* What a vertex collects from the patches at it. */
typedef struct gather {
  double gauss, mean, normal[3], count; /* count: of patches with a normal there */
} gather;

typedef struct tessellation {
  const batten_network *network;
  double tolerance;
  unsigned density;
  bool shared;
  uint16_t *need;        /* [P] segments that the patch asks for */
  uint32_t *edge_first;  /* [3 F] first vertex inside the edge, when shared */
  uint32_t *face_first;  /* [F] first vertex of the face's own */
  size_t *face_triangle; /* [F + 1] */
  gather *corners;       /* [3 F], when shared */
  size_t vertex_count;
  double *points, *gauss, *mean, *normal, *patch; /* patch: not when shared */
  uint32_t *triangles;
} tessellation;

/* ---- how many ------------------------------------------------------------------------------------ */

/* The largest second difference of the control points along the edges' directions. */
static double second_difference(unsigned n, const double (*net)[3]) {
  double largest = 0;
  for (unsigned k = 0; k + 2 <= n; k++)
    for (unsigned j = 0; j + k + 2 <= n; j++) {
      const double *end[3] = {net[triangular_index(n, j, k)], net[triangular_index(n, j + 2, k)],
                              net[triangular_index(n, j, k + 2)]};
      const double *middle[3] = {net[triangular_index(n, j + 1, k)], net[triangular_index(n, j + 1, k + 1)],
                                 net[triangular_index(n, j, k + 1)]};
      for (unsigned e = 0; e < 3; e++) {
        double d[3];
        for (unsigned x = 0; x < 3; x++) d[x] = end[e][x] - 2 * middle[e][x] + end[(e + 1) % 3][x];
        largest = fmax(largest, vec_dot(d, d));
      }
    }
  return sqrt(largest);
}

static void find_need(void *arg, size_t task) {
  tessellation *t = arg;
  size_t from = task * FACES_PER_TASK, to = from + FACES_PER_TASK;
  for (size_t p = from; p < to && p < t->network->patch_count; p++) {
    unsigned n = net_surface_degree(t->network, p);
    double bend = n * (n - 1.) * second_difference(n, (const double(*)[3])net_surface_points(t->network, p));
    double steps = t->tolerance > 0 ? ceil(sqrt(ERROR_FACTOR * bend / t->tolerance)) : t->density;
    t->need[p] = (uint16_t)(steps >= t->density ? t->density : steps > 1 ? steps : 1);
  }
}

static unsigned larger(unsigned a, unsigned b) { return a > b ? a : b; }

/* Segments of half-edge h of the mesh; of a split face's edge from corner k to the inner point. */
static unsigned edge_segments(const tessellation *t, uint32_t h) {
  uint32_t twin = t->network->twin[h];
  unsigned here = t->need[net_surface_side(t->network, h).patch];
  return twin == NET_NONE ? here : larger(here, t->need[net_surface_side(t->network, twin).patch]);
}
static unsigned inner_segments(const tessellation *t, size_t face, unsigned k) {
  net_side sides[2];
  net_surface_inner(t->network, face, k, sides);
  return larger(t->need[sides[0].patch], t->need[sides[1].patch]);
}

/* The half-edge that numbers the vertices of its edge. */
static bool owns(const batten_network *network, uint32_t h) {
  return network->twin[h] == NET_NONE || network->twin[h] > h;
}

static void patch_segments(const tessellation *t, size_t face, unsigned part, unsigned segments[3]) {
  uint32_t h = (uint32_t)(3 * face);
  if (net_surface_parts(t->network, face) == 1) {
    for (unsigned k = 0; k < 3; k++) segments[k] = edge_segments(t, h + k);
  } else {
    segments[0] = edge_segments(t, h + part);
    segments[1] = inner_segments(t, face, (part + 1) % 3);
    segments[2] = inner_segments(t, face, part);
  }
}

/* Vertices of a face's own before those inside its patches: of a split face when shared, the inner point and those of
 * the edges to it. */
static size_t own_count(const tessellation *t, size_t face) {
  if (!t->shared || net_surface_parts(t->network, face) == 1) return 0;
  size_t count = 1;
  for (unsigned k = 0; k < 3; k++) count += inner_segments(t, face, k) - 1;
  return count;
}

/* Vertices of a patch's own. */
static size_t patch_count(const tessellation *t, const unsigned segments[3]) {
  size_t border = t->shared ? 0 : (size_t)segments[0] + segments[1] + segments[2];
  return border + net_pattern_inner_count(segments);
}

/* Numbers for all; false when there are too many. */
static bool number(tessellation *t) {
  const batten_network *network = t->network;
  size_t next = t->shared ? network->vertex_count : 0, triangles = 0;
  for (uint32_t h = 0; h < 3 * network->face_count && t->shared; h++) {
    t->edge_first[h] = (uint32_t)next;
    if (owns(network, h)) next += edge_segments(t, h) - 1;
    if (next >= UINT32_MAX) return false;
  }
  for (uint32_t h = 0; h < 3 * network->face_count && t->shared; h++)
    if (!owns(network, h)) t->edge_first[h] = t->edge_first[network->twin[h]];
  for (size_t f = 0; f < network->face_count; f++) {
    t->face_first[f] = (uint32_t)next;
    t->face_triangle[f] = triangles;
    next += own_count(t, f);
    for (unsigned part = 0; part < net_surface_parts(network, f); part++) {
      unsigned segments[3];
      patch_segments(t, f, part, segments);
      next += patch_count(t, segments);
      triangles += net_pattern_triangle_count(segments);
    }
    if (next >= UINT32_MAX || triangles > (UINT32_MAX - 1) / 3) return false;
  }
  t->face_triangle[network->face_count] = triangles;
  t->vertex_count = next;
  return true;
}

/* ---- vertices ------------------------------------------------------------------------------------ */

/* Adds the patch's shape at a place to a vertex; its point when asked for. */
static void sample(const tessellation *t, size_t patch, double u, double v, gather *sum, double *point) {
  double jet[6][3];
  surface_shape shape;
  triangular_jet(net_surface_degree(t->network, patch), (const double(*)[3])net_surface_points(t->network, patch), u,
                 v, 2, jet);
  if (point) memcpy(point, jet[0], sizeof jet[0]);
  if (!surface_shape_make((const double(*)[3])jet, &shape)) return;
  sum->gauss += shape.gauss;
  sum->mean += shape.mean;
  for (int x = 0; x < 3; x++) sum->normal[x] += shape.normal[x];
  sum->count += 1;
}

static void sample_side(const tessellation *t, net_side side, double at, gather *sum, double *point) {
  double uv[2];
  net_side_place(side.side, at, uv);
  sample(t, side.patch, uv[0], uv[1], sum, point);
}

static void finish(const tessellation *t, size_t vertex, const gather *sum) {
  double *normal = t->normal + 3 * vertex;
  memcpy(normal, sum->normal, sizeof sum->normal);
  vec_normalize(normal);
  t->gauss[vertex] = sum->count > 0 ? sum->gauss / sum->count : NAN;
  t->mean[vertex] = sum->count > 0 ? sum->mean / sum->count : NAN;
}

/* The vertices inside an edge, from one or both of its sides; the first side runs as the vertices are numbered. */
static void make_edge(const tessellation *t, unsigned segments, const net_side sides[2], bool both, size_t first) {
  for (unsigned s = 1; s < segments; s++, first++) {
    gather sum = {0};
    double at = (double)s / segments;
    sample_side(t, sides[0], at, &sum, t->points + 3 * first);
    if (both) sample_side(t, sides[1], 1 - at, &sum, NULL);
    finish(t, first, &sum);
  }
}

/* What of a face its neighbours share with it: vertices on edges, the inner point, what corners collect. */
static void make_shared(const tessellation *t, size_t face) {
  const batten_network *network = t->network;
  for (unsigned k = 0; k < 3; k++) {
    uint32_t h = (uint32_t)(3 * face) + k, twin = network->twin[h];
    net_side before = net_surface_side(network, net_prev(h)), sides[2] = {net_surface_side(network, h), {0, 0}};
    gather *corner = &t->corners[h];
    *corner = (gather){0};
    sample_side(t, sides[0], 0, corner, NULL);
    if (before.patch != sides[0].patch) sample_side(t, before, 1, corner, NULL);
    if (twin != NET_NONE) sides[1] = net_surface_side(network, twin);
    if (owns(network, h)) make_edge(t, edge_segments(t, h), sides, twin != NET_NONE, t->edge_first[h]);
  }
  if (net_surface_parts(network, face) == 1) return;
  size_t next = t->face_first[face], patch = net_surface_first(network, face);
  gather middle = {0};
  for (unsigned part = 0; part < 3; part++) sample(t, patch + part, 0, 1, &middle, t->points + 3 * next);
  finish(t, next++, &middle);
  for (unsigned k = 0; k < 3; k++) {
    net_side sides[2];
    unsigned segments = inner_segments(t, face, k);
    net_surface_inner(network, face, k, sides);
    make_edge(t, segments, sides, true, next);
    next += segments - 1;
  }
}

/* Numbers of a patch's vertices; `next`: the first of its own. */
static void number_patch(const tessellation *t, size_t face, unsigned part, uint32_t next, net_pattern *out) {
  const batten_network *network = t->network;
  uint32_t h = (uint32_t)(3 * face);
  *out = (net_pattern){.inner = next};
  patch_segments(t, face, part, out->segments);
  if (!t->shared) {
    for (unsigned k = 0; k < 3; k++) out->corner[k] = out->inner++;
    for (unsigned k = 0; k < 3; k++) {
      out->first[k] = out->inner;
      out->inner += out->segments[k] - 1;
    }
  } else if (net_surface_parts(network, face) == 1) {
    for (unsigned k = 0; k < 3; k++) {
      out->corner[k] = network->triangles[h + k];
      out->first[k] = t->edge_first[h + k];
      out->back[k] = !owns(network, h + k);
    }
  } else {
    uint32_t inner[3] = {t->face_first[face] + 1}; /* first vertex of the edge from each corner */
    for (unsigned k = 0; k < 2; k++) inner[k + 1] = inner[k] + inner_segments(t, face, k) - 1;
    unsigned end = (part + 1) % 3;
    out->corner[0] = network->triangles[h + part];
    out->corner[1] = network->triangles[h + end];
    out->corner[2] = t->face_first[face];
    out->first[0] = t->edge_first[h + part];
    out->first[1] = inner[end];
    out->first[2] = inner[part];
    out->back[0] = !owns(network, h + part);
    out->back[2] = true;
  }
}

static void make_own(const tessellation *t, size_t patch, const net_pattern *p) {
  unsigned n = net_pattern_steps(p->segments);
  size_t vertex = p->inner;
  for (unsigned k = 1; k + 1 < n; k++)
    for (unsigned j = 1; j + k < n; j++, vertex++) {
      gather sum = {0};
      sample(t, patch, (double)j / n, (double)k / n, &sum, t->points + 3 * vertex);
      finish(t, vertex, &sum);
    }
  if (t->shared) return;
  for (unsigned side = 0; side < 3; side++)
    for (unsigned s = 0; s < p->segments[side]; s++) {
      gather sum = {0};
      size_t at = net_pattern_vertex(p, side, s);
      sample_side(t, (net_side){patch, side}, (double)s / p->segments[side], &sum, t->points + 3 * at);
      finish(t, at, &sum);
    }
  for (size_t i = p->corner[0]; i < vertex; i++) t->patch[i] = (double)patch;
}

static void make_faces(void *arg, size_t task) {
  const tessellation *t = arg;
  size_t from = task * FACES_PER_TASK, to = from + FACES_PER_TASK;
  for (size_t f = from; f < to && f < t->network->face_count; f++) {
    uint32_t next = t->face_first[f] + (uint32_t)own_count(t, f);
    uint32_t(*triangles)[3] = (uint32_t(*)[3])(t->triangles + 3 * t->face_triangle[f]);
    if (t->shared) make_shared(t, f);
    for (unsigned part = 0; part < net_surface_parts(t->network, f); part++) {
      net_pattern p;
      number_patch(t, f, part, next, &p);
      make_own(t, net_surface_first(t->network, f) + part, &p);
      net_pattern_triangulate(&p, triangles);
      triangles += net_pattern_triangle_count(p.segments);
      next += (uint32_t)patch_count(t, p.segments);
    }
  }
}

/* The network's vertices, from what the faces' corners collected; `sums` [V] is scratch. */
static void make_vertices(const tessellation *t, gather *sums) {
  const batten_network *network = t->network;
  memset(sums, 0, network->vertex_count * sizeof *sums);
  memcpy(t->points, network->vertices, 3 * network->vertex_count * sizeof *t->points);
  for (size_t h = 0; h < 3 * network->face_count; h++) {
    gather *sum = &sums[network->triangles[h]];
    const gather *corner = &t->corners[h];
    sum->gauss += corner->gauss;
    sum->mean += corner->mean;
    for (int x = 0; x < 3; x++) sum->normal[x] += corner->normal[x];
    sum->count += corner->count;
  }
  for (size_t v = 0; v < network->vertex_count; v++) finish(t, v, &sums[v]);
}

/* ---- the call ------------------------------------------------------------------------------------ */

static batten_status check(batten_context *ctx, const batten_network *network, const batten_tessellate_options *opt,
                           batten_mesh **out) {
  if (!network) return batten_fail(ctx, BATTEN_E_INVALID, "network: NULL; give a network");
  if (!out) return batten_fail(ctx, BATTEN_E_INVALID, "out: NULL; give the address of the result");
  batten_status st =
      batten_check_struct(ctx, "batten_tessellate_options", opt->struct_size, sizeof(batten_tessellate_options));
  if (st < 0) return st;
  if (opt->density < 1 || opt->density > DENSITY_MAX)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.density: %u; give 1 to %d", opt->density, DENSITY_MAX);
  if (!(opt->tolerance >= 0) || !isfinite(opt->tolerance))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.tolerance: %g; give a distance, or 0 for density everywhere",
                       opt->tolerance);
  return BATTEN_OK;
}

static batten_status plan(batten_context *ctx, tessellation *t) {
  const batten_network *network = t->network;
  t->need = batten_alloc_array(ctx, network->patch_count, sizeof *t->need);
  t->edge_first = batten_alloc_array(ctx, network->face_count, 3 * sizeof *t->edge_first);
  t->face_first = batten_alloc_array(ctx, network->face_count, sizeof *t->face_first);
  t->face_triangle = batten_alloc_array(ctx, network->face_count + 1, sizeof *t->face_triangle);
  if (!t->need || !t->edge_first || !t->face_first || !t->face_triangle) return BATTEN_E_NOMEM;
  batten_parallel(ctx, (network->patch_count + FACES_PER_TASK - 1) / FACES_PER_TASK, find_need, t);
  if (!number(t))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE,
                       "opt.density: %u on %zu facets gives more vertices or triangles than indices can number; "
                       "lower it, or set a larger tolerance",
                       t->density, network->face_count);
  return BATTEN_OK;
}

static batten_status make(batten_context *ctx, tessellation *t, batten_mesh *mesh) {
  const batten_network *network = t->network;
  size_t corners = t->shared ? 3 * network->face_count : 0, vertices = t->shared ? network->vertex_count : 0;
  gather *sums = NULL;
  batten_status st = BATTEN_E_NOMEM;
  mesh->vertex_count = t->vertex_count;
  mesh->triangle_count = t->face_triangle[network->face_count];
  t->points = mesh->vertices = batten_alloc_array(ctx, mesh->vertex_count, 3 * sizeof *mesh->vertices);
  t->triangles = mesh->triangles = batten_alloc_array(ctx, mesh->triangle_count, 3 * sizeof *mesh->triangles);
  t->gauss = batten_alloc_array(ctx, mesh->vertex_count, 6 * sizeof *t->gauss);
  t->corners = batten_alloc_array(ctx, corners, sizeof *t->corners);
  sums = batten_alloc_array(ctx, vertices, sizeof *sums);
  if (!t->points || !t->triangles || !t->gauss || !t->corners || !sums) goto done;
  t->mean = t->gauss + mesh->vertex_count;
  t->normal = t->mean + mesh->vertex_count;
  t->patch = t->normal + 3 * mesh->vertex_count;
  batten_parallel(ctx, (network->face_count + FACES_PER_TASK - 1) / FACES_PER_TASK, make_faces, t);
  if (t->shared) make_vertices(t, sums);
  st = batten_mesh_set_field(ctx, mesh, "gauss", 1, t->gauss);
  if (st >= 0) st = batten_mesh_set_field(ctx, mesh, "mean", 1, t->mean);
  if (st >= 0) st = batten_mesh_set_field(ctx, mesh, "normal", 3, t->normal);
  if (st >= 0 && !t->shared) st = batten_mesh_set_field(ctx, mesh, "patch", 1, t->patch);
done:
  batten_free(ctx, sums);
  batten_free(ctx, t->corners);
  batten_free(ctx, t->gauss);
  return st;
}

batten_status batten_network_tessellate(batten_context *ctx, const batten_network *network,
                                        const batten_tessellate_options *opt, batten_mesh **out) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_tessellate_options defaults = batten_tessellate_options_default();
  if (!opt) opt = &defaults;
  batten_status st = check(ctx, network, opt, out);
  if (st < 0) return st;
  tessellation t = {
      .network = network, .tolerance = opt->tolerance, .density = opt->density, .shared = opt->per_patch == 0};
  batten_mesh *mesh = batten_alloc(ctx, sizeof *mesh);
  if (!mesh) return BATTEN_E_NOMEM;
  *mesh = (batten_mesh){.ctx = ctx};
  st = plan(ctx, &t);
  if (st >= 0) st = make(ctx, &t, mesh);
  batten_free(ctx, t.face_triangle);
  batten_free(ctx, t.face_first);
  batten_free(ctx, t.edge_first);
  batten_free(ctx, t.need);
  if (st < 0) {
    batten_mesh_free(mesh);
    return st;
  }
  *out = mesh;
  return BATTEN_OK;
}
