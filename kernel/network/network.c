/* batten_network_build: from a mesh to a surface, as a list of phases.
 *
 *   scale, topology, features -> normals -> network (2N, then 5N) -> fill (or the fair fill) -> unscale -> check
 *
 * Everything before the check works on coordinates scaled by a power of two and shifted, so that 2^k times the mesh
 * gives 2^k times the surface bit for bit, and constants below may take the size to be about 1. The check knows the
 * finished surface alone, in the caller's coordinates. */
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "net.h"
#include "options.h"
#include "regular.h"
#include "surface.h"

enum { FACES_PER_TASK = 256 };

static const double JUMP_TOLERANCE_DEG = 1e-9;                  /* what counts as exact G1 */
static const double SIZE_SMALLEST = 1e-70, SIZE_LARGEST = 1e70; /* powers to the 4th occur in measures */
static const double GAP_TOLERANCE = 1e-12;                      /* of the size */
/* Two or three places can agree by symmetry alone: PN triangles at the ends and the middle of an edge. */
enum { SAMPLES_LEAST = 9 };

typedef struct net_work {
  batten_context *ctx;
  const batten_mesh *mesh;
  batten_network_options opt;
  batten_network_fill fill;
  double center[3], scale, size; /* scaled = (given - center) * scale; size of the mesh's box, given */
  double *points;                /* [V][3] scaled */
  net_topology topology;
  double *normals;      /* [nodes][3] */
  net_local *local;     /* [edges] */
  net_node *nodes;      /* [nodes], quintic networks */
  unsigned char *marks; /* [F] degree 7 is not regular there; or a substitute was taken */
  net_figures figures;
  batten_network *network;
  batten_network_info info;
} net_work;

/* ---- scaling --------------------------------------------------------------------------------------- */

static batten_status scale_points(net_work *w) {
  size_t count = batten_mesh_vertex_count(w->mesh);
  const double *vertices = batten_mesh_vertices(w->mesh);
  double lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t i = 0; i < 3 * count; i++) {
    lower[i % 3] = fmin(lower[i % 3], vertices[i]);
    upper[i % 3] = fmax(upper[i % 3], vertices[i]);
  }
  for (size_t k = 0; k < 3; k++) {
    w->center[k] = count ? 0.5 * lower[k] + 0.5 * upper[k] : 0;
    w->size = fmax(w->size, count ? upper[k] - lower[k] : 0);
  }
  if (count && !(w->size >= SIZE_SMALLEST && w->size <= SIZE_LARGEST))
    return batten_fail(w->ctx, BATTEN_E_INVALID,
                       "vertices: their box has the size %g; must be %g .. %g: scale the mesh", w->size,
                       SIZE_SMALLEST, SIZE_LARGEST);
  w->scale = count ? batten_unit(w->size) : 1;
  w->points = batten_alloc_array(w->ctx, count, 3 * sizeof *w->points);
  if (!w->points) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < 3 * count; i++) w->points[i] = (vertices[i] - w->center[i % 3]) * w->scale;
  return BATTEN_OK;
}

/* ---- phases up to the nodes -------------------------------------------------------------------------- */

static batten_status make_topology(net_work *w) {
  batten_status st = batten_progress(w->ctx, "topology", 0);
  if (st >= 0) st = scale_points(w);
  if (st >= 0)
    st = net_topology_make(w->ctx, batten_mesh_vertex_count(w->mesh), w->points, batten_mesh_triangle_count(w->mesh),
                           batten_mesh_triangles(w->mesh), &w->topology);
  if (st >= 0) st = net_features_make(w->ctx, &w->opt, &w->topology);
  if (st >= 0) st = net_folds_make(w->ctx, &w->topology);
  return st;
}

/* Nodes for the fair fill to start from: normals as estimated, as flat as the creases allow. */
static void flat_nodes(net_work *w) {
  for (size_t i = 0; i < w->topology.nodes; i++) {
    const net_constraint *c = w->topology.constraint ? &w->topology.constraint[i] : NULL;
    double columns[5][5];
    unsigned dof;
    net_frame(w->normals + 3 * i, c && c->kind != NET_FREE ? c->d[0] : NULL, &w->nodes[i]);
    net_node_freedom(c, &w->nodes[i], w->nodes[i].x, columns, &dof);
  }
}

static bool is_fair(batten_network_fill fill) { return fill == BATTEN_FILL_FAIR || fill == BATTEN_FILL_FAIR_LINEAR; }

static batten_status make_network(net_work *w) {
  const net_topology *t = &w->topology;
  bool cold = w->fill == BATTEN_FILL_FAIR && !w->opt.fair_warm; /* the linear variant needs a good start */
  bool optimise = !cold && w->fill != BATTEN_FILL_PN;           /* PN triangles know estimated normals alone */
  batten_status st;
  w->normals = batten_alloc_array(w->ctx, t->nodes, 3 * sizeof *w->normals);
  w->local = w->normals ? batten_alloc_array(w->ctx, t->edges, sizeof *w->local) : NULL;
  if (!w->local) return BATTEN_E_NOMEM;
  if (net_fill_continuity(w->fill) == 2) {
    w->nodes = batten_alloc_array(w->ctx, t->nodes, sizeof *w->nodes);
    if (!w->nodes) return BATTEN_E_NOMEM;
  }
  double start = batten_now();
  st = net_normals_make(w->ctx, t, &w->opt, w->normals);
  if (st >= 0 && optimise) st = net_g1(w->ctx, t, &w->opt, w->normals, w->local, &w->figures);
  w->info.time_normals_s = batten_now() - start;
  if (st < 0) return st;
  start = batten_now();
  if (cold)
    flat_nodes(w);
  else if (w->nodes)
    st = net_g2(w->ctx, t, &w->opt, w->normals, w->nodes, w->local, &w->figures);
  w->info.time_network_s = batten_now() - start;
  return st;
}

/* ---- fill ------------------------------------------------------------------------------------------- */

/* The handle, its control points still to be written. */
static batten_status make_surface(net_work *w) {
  const net_topology *t = &w->topology;
  unsigned degree, parts;
  net_fill_degree(w->fill, &degree, &parts);
  size_t count = 0;
  uint32_t *creases = batten_alloc_array(w->ctx, t->crease_edges, 2 * sizeof *creases);
  if (!creases) return BATTEN_E_NOMEM;
  for (size_t e = 0; e < t->edges; e++) {
    if (t->kind[e] != NET_CREASE) continue;
    creases[2 * count] = t->triangles[t->half[e]];
    creases[2 * count++ + 1] = t->triangles[net_next(t->half[e])];
  }
  batten_status st = net_surface_new(w->ctx, t->vertices, batten_mesh_vertices(w->mesh), t->faces, t->triangles,
                                     t->twin, count, creases, degree, parts, &w->network);
  batten_free(w->ctx, creases);
  return st;
}

static void fill_cubic_face(const net_work *w, size_t f, unsigned char *clamped) {
  double edges[3][4][3], normals[3][3];
  double(*out)[3] = net_surface_points(w->network, net_surface_first(w->network, f));
  net_facet_cubics(&w->topology, w->normals, w->local, f, edges, normals);
  if (w->fill == BATTEN_FILL_PN) {
    double corners[3][3];
    for (size_t k = 0; k < 3; k++) memcpy(corners[k], edges[k][0], sizeof corners[k]);
    net_fill_pn((const double(*)[3])corners, (const double(*)[3])normals, out);
  } else {
    *clamped = net_fill_ss(w->fill == BATTEN_FILL_SS_CLASSIC, (const double(*)[4][3])edges,
                           (const double(*)[3])normals, (double(*)[15][3])out);
  }
}

static void fill_quintic_face(const net_work *w, size_t f, unsigned char *singular) {
  net_node corners[3];
  net_ribbon ribbons[3];
  double(*out)[3] = net_surface_points(w->network, net_surface_first(w->network, f));
  net_facet_ribbons(&w->topology, w->nodes, w->local, f, corners, ribbons);
  if (w->fill == BATTEN_FILL_DEGREE6)
    net_fill_degree6(corners, ribbons, (double(*)[28][3])out);
  else
    *singular = !net_fill_degree7(corners, ribbons, out);
}

static void fill_task(void *arg, size_t index) {
  net_work *w = arg;
  size_t first = index * FACES_PER_TASK, last = first + FACES_PER_TASK;
  bool cubic = net_fill_continuity(w->fill) == 1;
  if (last > w->topology.faces) last = w->topology.faces;
  for (size_t f = first; f < last; f++) {
    w->marks[f] = 0;
    if (cubic)
      fill_cubic_face(w, f, &w->marks[f]);
    else
      fill_quintic_face(w, f, &w->marks[f]);
  }
}

/* Facets where one patch would be singular get three: neighbours share curve and field only, so the joints stay. */
static batten_status split_singular(net_work *w) {
  size_t count = 0;
  for (size_t f = 0; f < w->topology.faces; f++) count += w->marks[f];
  w->info.fallback_faces = count;
  if (count == 0) return BATTEN_OK;
  uint32_t *faces = batten_alloc_array(w->ctx, count, sizeof *faces);
  if (!faces) return BATTEN_E_NOMEM;
  count = 0;
  for (size_t f = 0; f < w->topology.faces; f++)
    if (w->marks[f]) faces[count++] = (uint32_t)f;
  batten_status st = net_surface_split(w->network, count, faces, 6);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    net_node corners[3];
    net_ribbon ribbons[3];
    size_t patch = net_surface_first(w->network, faces[i]);
    net_facet_ribbons(&w->topology, w->nodes, w->local, faces[i], corners, ribbons);
    double three[3][28][3];
    net_fill_degree6(corners, ribbons, three);
    for (size_t k = 0; k < 3; k++) memcpy(net_surface_points(w->network, patch + k), three[k], sizeof three[k]);
  }
  batten_free(w->ctx, faces);
  return st;
}

/* The fair fill writes all patches itself. Where its inner points have left a patch that is not regular, the usual
 * ones take their place, and facets that have no regular patch of one piece are split as others are. */
static batten_status fill_fair(net_work *w) {
  double *scratch = batten_alloc_array(w->ctx, net_regular_work(7), sizeof *scratch);
  if (!scratch) return BATTEN_E_NOMEM;
  batten_status st = net_fair(w->ctx, &w->topology, &w->opt, w->fill == BATTEN_FILL_FAIR_LINEAR, w->nodes,
                              (double(*)[36][3])net_surface_points(w->network, 0), &w->figures);
  for (uint32_t e = 0; st >= 0 && e < w->topology.edges; e++)
    net_tangent_edge(&w->topology, &w->opt, w->nodes, NULL, e, &w->local[e]);
  for (size_t f = 0; st >= 0 && f < w->topology.faces; f++) {
    net_node corners[3];
    net_ribbon ribbons[3];
    double usual[36][3], (*kept)[3] = net_surface_points(w->network, f);
    net_facet_ribbons(&w->topology, w->nodes, w->local, f, corners, ribbons);
    w->marks[f] = !net_fill_degree7(corners, ribbons, usual);
    if (!w->marks[f] && !net_regular(7, (const double(*)[3])kept, scratch)) memcpy(kept, usual, sizeof usual);
  }
  batten_free(w->ctx, scratch);
  return st;
}

/* From scaled coordinates to the caller's; corners are the vertices to the bit. */
static void unscale_task(void *arg, size_t index) {
  net_work *w = arg;
  batten_network *n = w->network;
  size_t first = index * FACES_PER_TASK, last = first + FACES_PER_TASK;
  double back = 1 / w->scale; /* a power of two */
  if (last > w->topology.faces) last = w->topology.faces;
  for (size_t f = first; f < last; f++) {
    unsigned parts = net_surface_parts(n, f);
    for (unsigned part = 0; part < parts; part++) {
      size_t patch = net_surface_first(n, f) + part;
      unsigned degree = net_surface_degree(n, patch);
      double(*points)[3] = net_surface_points(n, patch);
      for (size_t i = 0; i < triangular_count(degree); i++)
        for (size_t k = 0; k < 3; k++) points[i][k] = points[i][k] * back + w->center[k];
      for (unsigned corner = 0; corner < (parts == 1 ? 3 : 2); corner++) {
        unsigned mesh_corner = parts == 1 ? corner : (part + corner) % 3;
        memcpy(points[net_side_index(degree, corner, 0, 0)],
               n->vertices + 3 * (size_t)n->triangles[3 * f + mesh_corner], sizeof points[0]);
      }
    }
  }
}

static batten_status fill(net_work *w) {
  size_t faces = w->topology.faces, tasks = (faces + FACES_PER_TASK - 1) / FACES_PER_TASK;
  double start = batten_now();
  w->marks = batten_alloc_array(w->ctx, faces, 1);
  batten_status st = w->marks ? batten_progress(w->ctx, "fill", 0) : BATTEN_E_NOMEM;
  if (st >= 0) st = make_surface(w);
  if (st < 0) return st;
  memset(w->marks, 0, faces);
  if (is_fair(w->fill))
    st = fill_fair(w);
  else if (w->fill == BATTEN_FILL_PETERS)
    st = net_fill_peters(w->ctx, &w->topology, w->normals, w->local,
                         (double(*)[21][3])net_surface_points(w->network, 0));
  else
    batten_parallel(w->ctx, tasks, fill_task, w);
  if (st >= 0 && net_fill_continuity(w->fill) == 2) st = split_singular(w);
  if (st >= 0) {
    for (size_t f = 0; f < faces && net_fill_continuity(w->fill) == 1; f++) w->info.clamped_faces += w->marks[f];
    batten_parallel(w->ctx, tasks, unscale_task, w);
    st = batten_progress(w->ctx, "fill", 1);
  }
  w->info.time_fill_s = batten_now() - start;
  return st;
}

/* ---- check ------------------------------------------------------------------------------------------ */

/* What was measured and proven. */
static batten_status measure(net_work *w, batten_network_continuity *c) {
  batten_network_info *i = &w->info;
  double start = batten_now();
  batten_status st = batten_network_measure_continuity(w->ctx, w->network, w->opt.check_samples, c);
  if (st >= 0) st = net_find_irregular(w->ctx, w->network, "check", 0.5, NULL, &i->irregular_faces);
  if (st < 0) return st;
  size_t samples = c->smooth.samples + c->inner.samples;
  double squares = (double)c->smooth.samples * c->smooth.normal_rms_deg * c->smooth.normal_rms_deg +
                   (double)c->inner.samples * c->inner.normal_rms_deg * c->inner.normal_rms_deg;
  i->normal_jump_max_deg = fmax(c->smooth.normal_max_deg, c->inner.normal_max_deg);
  i->normal_jump_rms_deg = samples ? sqrt(squares / (double)samples) : 0;
  i->gap_max = fmax(fmax(c->smooth.gap_max, c->inner.gap_max), fmax(c->crease.gap_max, c->corner_gap_max));
  i->time_check_s = batten_now() - start;
  return BATTEN_OK;
}

/* What rounding far from the origin may have spoilt, when that is all. */
static const char *remedy_for(const net_work *w, double jump_deg) {
  double reach = fmax(fmax(fabs(w->center[0]), fabs(w->center[1])), fabs(w->center[2]));
  bool rounding = reach > 1e3 * w->size && jump_deg < 1e-3;
  return rounding ? "; the mesh is far from the origin, where numbers are coarse: shift it" : "";
}

/* BATTEN_OK only for what was measured and proven. */
static batten_status check(net_work *w) {
  batten_network_continuity c;
  const batten_network_info *i = &w->info;
  if (!w->opt.check_samples)
    return batten_fail(w->ctx, BATTEN_W_ACCURACY, "opt.check_samples: 0, so that nothing was checked");
  batten_status st = measure(w, &c);
  if (st < 0) return st;
  const char *remedy = remedy_for(w, i->normal_jump_max_deg);
  if (!(i->gap_max <= GAP_TOLERANCE * w->size))
    return batten_fail(w->ctx, BATTEN_W_ACCURACY, "the sides of an edge are %.2g apart, of the size %.2g%s",
                       i->gap_max, w->size, remedy);
  if (!(i->normal_jump_max_deg <= JUMP_TOLERANCE_DEG)) {
    if (c.inner.normal_max_deg > c.smooth.normal_max_deg)
      return batten_fail(w->ctx, BATTEN_W_ACCURACY, "normals differ by up to %.2g degrees inside triangle %lu%s",
                         i->normal_jump_max_deg, (unsigned long)c.inner.worst_face[0], remedy);
    return batten_fail(w->ctx, BATTEN_W_ACCURACY,
                       "normals differ by up to %.2g degrees across the edge between triangles %lu and %lu%s",
                       i->normal_jump_max_deg, (unsigned long)c.smooth.worst_face[0],
                       (unsigned long)c.smooth.worst_face[1], remedy);
  }
  if (i->irregular_faces)
    return batten_fail(w->ctx, BATTEN_W_ACCURACY, "%zu facets are not proven to have a normal everywhere",
                       i->irregular_faces);
  if (w->opt.check_samples < SAMPLES_LEAST)
    return batten_fail(w->ctx, BATTEN_W_ACCURACY,
                       "opt.check_samples: %u places on an edge can agree by chance; give %d or more",
                       w->opt.check_samples, SAMPLES_LEAST);
  return BATTEN_OK;
}

/* ---- the call --------------------------------------------------------------------------------------- */

/* Energies were counted on scaled coordinates: each is homogeneous in the lengths. */
static void tell(net_work *w) {
  const net_topology *t = &w->topology;
  const net_figures *g = &w->figures;
  batten_network_info *i = &w->info;
  double degree = is_fair(w->fill) ? -2 : 2 - w->opt.weight_power;
  double unit = pow(w->scale, -degree);
  i->fill = w->fill;
  i->continuity = net_fill_continuity(w->fill);
  i->vertices = t->vertices;
  i->edges = t->edges;
  i->faces = t->faces;
  i->patches = batten_network_patch_count(w->network);
  i->boundary_edges = t->boundary_edges;
  i->crease_edges = t->crease_edges;
  i->line_edges = t->line_edges;
  i->nodes = t->nodes;
  i->unknowns = g->unknowns;
  i->normal_passes = g->normal_passes;
  i->normal_change_rad = g->normal_change;
  i->cg_iterations = g->cg_iterations;
  i->residual = g->residual;
  i->clamped_faces += g->clamped;
  i->fairing_passes = g->fairing_passes;
  i->energy_start = g->energy_start * unit;
  i->energy = g->energy * unit;
}

static void work_free(net_work *w) {
  net_topology_free(w->ctx, &w->topology);
  batten_free(w->ctx, w->marks);
  batten_free(w->ctx, w->nodes);
  batten_free(w->ctx, w->local);
  batten_free(w->ctx, w->normals);
  batten_free(w->ctx, w->points);
}

batten_status batten_network_build(batten_context *ctx, const batten_mesh *mesh, const batten_network_options *opt,
                                   batten_network **out, batten_network_info *info) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!mesh) return batten_fail(ctx, BATTEN_E_INVALID, "mesh: NULL; give a mesh");
  if (!out) return batten_fail(ctx, BATTEN_E_INVALID, "out: NULL; give the address of the result");
  net_work w = {.ctx = ctx, .mesh = mesh};
  w.info.normal_jump_max_deg = w.info.normal_jump_rms_deg = w.info.gap_max = NAN;
  double start = batten_now();
  batten_status st = net_options_check(ctx, opt, &w.opt);
  if (st >= 0) st = make_topology(&w);
  w.info.time_topology_s = batten_now() - start;
  if (st >= 0) {
    w.fill = net_options_fill(&w.opt, w.topology.faces);
    st = make_network(&w);
  }
  if (st >= 0) st = fill(&w);
  if (st >= 0) tell(&w);
  work_free(&w); /* the check needs none of it */
  if (st >= 0) st = check(&w);
  if (st < 0) {
    batten_network_free(w.network);
    return st;
  }
  *out = w.network;
  if (info) *info = w.info;
  return st;
}
