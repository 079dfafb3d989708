/* Measures of a triangle mesh: counts, area, volume, centroid, inertia, angles, edges.
 *
 * Lengths are measured from the middle of the bounding box in units of a power of two near its size: a mesh far
 * from the origin loses no digits to its place, and none over- or underflows on the way. The volume integrals are
 * sums over the signed tetrahedra (middle, a, b, c). */
#include "mesh_inner.h"

#include "base/checked.h"
#include "topology.h"
#include "vec.h"

static const double DEGREES = 57.295779513082320877;

typedef struct frame {
  double middle[3];
  int exponent;    /* unit = 2^exponent */
  double scale[2]; /* two factors whose product is 2^-exponent, which itself might overflow */
} frame;

typedef struct sums {
  double area, volume;
  double area_moment[3];      /* integral of x over the surface */
  double volume_moment[3];    /* integral of x over the solid */
  double volume_second[3][3]; /* integral of x x' */
  double angle_min, angle_max;
  size_t good_triangles;
  double edge_min, edge_max, edge_sum;
} sums;

static frame box_of(const batten_mesh *mesh, batten_mesh_measures *m) {
  frame f = {.exponent = 0};
  for (int k = 0; k < 3; k++) {
    m->lower[k] = mesh->triangle_count ? INFINITY : 0;
    m->upper[k] = mesh->triangle_count ? -INFINITY : 0;
  }
  for (size_t h = 0; h < 3 * mesh->triangle_count; h++) {
    const double *p = mesh->vertices + 3 * (size_t)mesh->triangles[h];
    for (int k = 0; k < 3; k++) {
      if (p[k] < m->lower[k]) m->lower[k] = p[k];
      if (p[k] > m->upper[k]) m->upper[k] = p[k];
    }
  }
  double size = 0;
  for (int k = 0; k < 3; k++) {
    f.middle[k] = 0.5 * m->lower[k] + 0.5 * m->upper[k];
    size = fmax(size, 0.5 * m->upper[k] - 0.5 * m->lower[k]);
  }
  if (size > 0) frexp(size, &f.exponent);
  f.scale[0] = ldexp(1, -f.exponent / 2);
  f.scale[1] = ldexp(1, -f.exponent - -f.exponent / 2);
  return f;
}

static void to_frame(const frame *f, const double *p, double *out) {
  for (int k = 0; k < 3; k++) out[k] = (p[k] - f->middle[k]) * f->scale[0] * f->scale[1];
}

static void add_integrals(const double *a, const double *b, const double *c, sums *s) {
  double n[3], bc[3];
  vec_triangle_normal(a, b, c, n);
  double area = 0.5 * vec_norm(n);
  vec_cross(b, c, bc);
  double det = vec_dot(a, bc); /* 6 times the tetrahedron */
  double sum[3];
  for (int k = 0; k < 3; k++) sum[k] = a[k] + b[k] + c[k];
  s->area += area;
  s->volume += det / 6;
  for (int k = 0; k < 3; k++) {
    s->area_moment[k] += area * sum[k] / 3;
    s->volume_moment[k] += det * sum[k] / 24;
    /* Second moments of a tetrahedron with one corner at 0: det / 120 (sum of x x' + (sum x)(sum x)'). */
    for (int l = 0; l < 3; l++)
      s->volume_second[k][l] += det / 120 * (sum[k] * sum[l] + a[k] * a[l] + b[k] * b[l] + c[k] * c[l]);
  }
}

static void add_angles(const double *const *p, sums *s) {
  double least = INFINITY;
  for (int k = 0; k < 3; k++) {
    double angle = DEGREES * vec_angle(p[k], p[(k + 1) % 3], p[(k + 2) % 3]);
    least = fmin(least, angle);
    s->angle_max = fmax(s->angle_max, angle);
  }
  s->angle_min = fmin(s->angle_min, least);
  s->good_triangles += least >= 20;
}

enum { TASK = 8192 };

typedef struct triangle_work {
  const batten_mesh *mesh;
  const frame *f;
  sums *parts; /* [tasks] */
} triangle_work;

static void triangle_task(void *arg, size_t task) {
  const triangle_work *w = arg;
  const batten_mesh *mesh = w->mesh;
  sums s = {.angle_min = INFINITY, .edge_min = INFINITY};
  size_t end = (task + 1) * TASK < mesh->triangle_count ? (task + 1) * TASK : mesh->triangle_count;
  for (size_t t = task * TASK; t < end; t++) {
    double p[3][3];
    for (size_t k = 0; k < 3; k++) to_frame(w->f, mesh->vertices + 3 * (size_t)mesh->triangles[3 * t + k], p[k]);
    const double *corners[3] = {p[0], p[1], p[2]};
    add_integrals(p[0], p[1], p[2], &s);
    add_angles(corners, &s);
  }
  w->parts[task] = s;
}

static void add_sums(const sums *part, sums *s) {
  s->area += part->area;
  s->volume += part->volume;
  for (int k = 0; k < 3; k++) {
    s->area_moment[k] += part->area_moment[k];
    s->volume_moment[k] += part->volume_moment[k];
    for (int l = 0; l < 3; l++) s->volume_second[k][l] += part->volume_second[k][l];
  }
  s->angle_min = fmin(s->angle_min, part->angle_min);
  s->angle_max = fmax(s->angle_max, part->angle_max);
  s->good_triangles += part->good_triangles;
}

static batten_status add_triangles(batten_context *ctx, const batten_mesh *mesh, const frame *f, sums *s) {
  size_t tasks = (mesh->triangle_count + TASK - 1) / TASK;
  triangle_work w = {mesh, f, batten_alloc_array(ctx, tasks, sizeof *w.parts)};
  if (!w.parts) return BATTEN_E_NOMEM;
  batten_parallel(ctx, tasks, triangle_task, &w);
  for (size_t i = 0; i < tasks; i++) add_sums(w.parts + i, s);
  batten_free(ctx, w.parts);
  return BATTEN_OK;
}

/* Each edge once: order brings the half-edges of an edge together. */
static void add_edges(const batten_mesh *mesh, const uint32_t *order, const frame *f, sums *s) {
  uint32_t last[2] = {MESH_NONE, MESH_NONE};
  for (size_t i = 0; i < 3 * mesh->triangle_count; i++) {
    uint32_t a = mesh->triangles[order[i]], b = mesh->triangles[mesh_next(order[i])];
    if ((a == last[0] && b == last[1]) || (a == last[1] && b == last[0])) continue;
    last[0] = a;
    last[1] = b;
    double p[3], q[3];
    to_frame(f, mesh->vertices + 3 * (size_t)a, p);
    to_frame(f, mesh->vertices + 3 * (size_t)b, q);
    double length = vec_distance(p, q);
    s->edge_min = fmin(s->edge_min, length);
    s->edge_max = fmax(s->edge_max, length);
    s->edge_sum += length;
  }
}

static void set_solid(const sums *s, const frame *f, batten_mesh_measures *m) {
  m->volume = ldexp(s->volume, 3 * f->exponent);
  if (s->volume == 0) return; /* flat: the surface's centroid stays */
  double c[3], second[3][3], sign = s->volume < 0 ? -1 : 1, trace = 0;
  for (int k = 0; k < 3; k++) c[k] = s->volume_moment[k] / s->volume;
  for (int k = 0; k < 3; k++) {
    for (int l = 0; l < 3; l++) second[k][l] = sign * (s->volume_second[k][l] - s->volume * c[k] * c[l]);
    trace += second[k][k];
  }
  for (int k = 0; k < 3; k++) {
    m->centroid[k] = f->middle[k] + ldexp(c[k], f->exponent);
    for (int l = 0; l < 3; l++) m->inertia[k][l] = ldexp((k == l ? trace : 0) - second[k][l], 5 * f->exponent);
  }
}

static void set_figures(const batten_mesh *mesh, const sums *s, const frame *f, batten_mesh_measures *m) {
  m->area = ldexp(s->area, 2 * f->exponent);
  m->volume = NAN;
  for (int k = 0; k < 3; k++) {
    m->centroid[k] = f->middle[k] + (s->area > 0 ? ldexp(s->area_moment[k] / s->area, f->exponent) : 0);
    for (int l = 0; l < 3; l++) m->inertia[k][l] = NAN;
  }
  if (m->closed && m->oriented) set_solid(s, f, m);
  if (mesh->triangle_count == 0) return;
  m->angle_min_deg = s->angle_min;
  m->angle_max_deg = s->angle_max;
  m->angles_above_20deg = (double)s->good_triangles / (double)mesh->triangle_count;
  m->edge_min = ldexp(s->edge_min, f->exponent);
  m->edge_max = ldexp(s->edge_max, f->exponent);
  m->edge_mean = ldexp(s->edge_sum / (double)m->edges, f->exponent);
}

static void set_topology(const batten_mesh_topology *t, size_t triangles, batten_mesh_measures *m) {
  m->vertices = t->vertices;
  m->edges = t->edges;
  m->triangles = triangles;
  m->components = t->components;
  m->boundary_edges = t->boundary_edges;
  m->boundary_loops = t->boundary_loops;
  m->nonmanifold_edges = t->nonmanifold_edges;
  m->nonmanifold_vertices = t->nonmanifold_vertices;
  m->closed = triangles > 0 && t->boundary_edges == 0;
  m->manifold = t->nonmanifold_edges == 0 && t->nonmanifold_vertices == 0;
  m->oriented = t->oriented;
  m->euler = (long)t->vertices - (long)t->edges + (long)triangles;
  /* Euler's number of a closed oriented surface of genus g is 2 - 2 g; components add up. */
  m->genus = m->closed && m->manifold && m->oriented ? (long)t->components - m->euler / 2 : -1;
}

batten_status batten_mesh_measure(batten_context *ctx, const batten_mesh *mesh, batten_mesh_measures *out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!mesh || !out)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a mesh and room for its measures",
                       mesh ? "out" : "mesh");
  batten_mesh_measures m = {0};
  batten_mesh_topology topology;
  sums s = {.angle_min = INFINITY, .edge_min = INFINITY};
  uint32_t *order = NULL;
  batten_status st = batten_progress(ctx, "measure", 0);
  if (st < 0) goto done;
  st = BATTEN_E_NOMEM;
  order = batten_alloc_array(ctx, mesh->triangle_count, 3 * sizeof *order);
  if (!order) goto done;
  st = batten_mesh_sort_edges(ctx, mesh->vertex_count, mesh->triangle_count, mesh->triangles, order);
  if (st >= 0) st = batten_progress(ctx, "measure", 0.3);
  if (st >= 0)
    st = batten_mesh_topology_of_edges(ctx, mesh->vertex_count, mesh->triangle_count, mesh->triangles, order,
                                       &topology);
  if (st >= 0) st = batten_progress(ctx, "measure", 0.7);
  if (st < 0) goto done;
  set_topology(&topology, mesh->triangle_count, &m);
  frame f = box_of(mesh, &m);
  st = add_triangles(ctx, mesh, &f, &s);
  if (st >= 0) st = batten_progress(ctx, "measure", 0.9);
  if (st < 0) goto done;
  add_edges(mesh, order, &f, &s);
  set_figures(mesh, &s, &f, &m);
  *out = m;
done:
  batten_free(ctx, order);
  return st;
}
