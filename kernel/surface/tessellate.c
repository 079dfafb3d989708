/* Triangle meshes of surfaces: a regular grid, whose lines the spans of each direction have as many of as they need.
 *
 * On a cell of a x b parameters, cut along a diagonal, linear interpolation is off by at most
 *   (a^2 M_uu + 2 a b M_uv + b^2 M_vv) / 8   [Filip, Magedson, Markot 1986],
 * M the largest norms of the second derivatives. With 2 a b M_uv <= M_uv (r a^2 + b^2 / r) for any r > 0 each
 * direction gets half of the tolerance: 1 / a = sqrt((M_uu + r M_uv) / (4 tolerance)), 1 / b alike. r = sqrt(M_uu /
 * M_vv) makes the product of both, the number of cells, least; no direction wants less than one segment. */
#include "surface_inner.h"

#include "base/checked.h"
#include "mesh/mesh_inner.h"
#include "mesh/vec.h"

#include <string.h>

enum { DENSITY_MAX = 1024 };

batten_surface_tessellate_options batten_surface_tessellate_options_default(void) {
  return (batten_surface_tessellate_options){.struct_size = sizeof(batten_surface_tessellate_options), .density = 16};
}

typedef struct grid {
  const batten_surface *surface;
  surface_axis axis[2];
  unsigned *segments[2]; /* [spans of the direction] */
  size_t lines[2];
  surface_basis *basis[2]; /* [lines] */
  double *t[2];            /* [lines] parameters */
  double *points, *gauss, *mean, *normal, *place;
  uint32_t *triangles;
} grid;

/* ---- how many ------------------------------------------------------------------------------------ */

static double largest(double so_far, const double a[3], const double b[3], const double c[3], const double d[3]) {
  double x[3];
  for (int k = 0; k < 3; k++) x[k] = (a[k] - b[k]) - (c[k] - d[k]);
  return fmax(so_far, vec_dot(x, x));
}

/* Bounds of the second derivatives uu, uv, vv of a patch by its own parameters, from 0 to 1. */
static void bound_second(unsigned p, unsigned q, const double (*net)[3], double bound[3]) {
  size_t row = q + 1;
  memset(bound, 0, 3 * sizeof *bound);
  for (size_t i = 0; i <= p; i++)
    for (size_t j = 0; j <= q; j++) {
      const double(*b)[3] = net + i * row + j;
      if (i + 2 <= p) bound[0] = largest(bound[0], b[2 * row], b[row], b[row], b[0]);
      if (i + 1 <= p && j + 1 <= q) bound[1] = largest(bound[1], b[row + 1], b[row], b[1], b[0]);
      if (j + 2 <= q) bound[2] = largest(bound[2], b[2], b[1], b[1], b[0]);
    }
  bound[0] = p * (p - 1.) * sqrt(bound[0]);
  bound[1] = p * (double)q * sqrt(bound[1]);
  bound[2] = q * (q - 1.) * sqrt(bound[2]);
}

/* bound over 4 tolerances, so that a direction alone needs its root many segments. */
static void count_segments(const double bound[3], double steps[2]) {
  double uu = bound[0], uv = bound[1], vv = bound[2], r = 1;
  if (uv > 0 && uu != vv) r = sqrt((uu + uv / 8) / (vv + uv / 8));
  /* The share of M_uv that fills up a direction's one segment costs it nothing. */
  if (uv > 0 && vv < 1) r = fmin(r, uv / (1 - vv));
  if (uv > 0 && uu < 1) r = fmax(r, (1 - uu) / uv);
  steps[0] = sqrt(uu + (uv > 0 ? r * uv : 0));
  steps[1] = sqrt(vv + (uv > 0 ? uv / r : 0));
}

static void find_segments(grid *g, double tolerance, unsigned density) {
  const batten_surface *s = g->surface;
  for (int k = 0; k < 2; k++)
    for (size_t i = 0; i < g->axis[k].count; i++) g->segments[k][i] = tolerance > 0 ? 1 : density;
  for (size_t i = 0; i < g->axis[0].count && tolerance > 0; i++)
    for (size_t j = 0; j < g->axis[1].count; j++) {
      double net[BSPLINE_ORDER * BSPLINE_ORDER][3], bound[3], steps[2];
      const double *origin = s->control_points;
      surface_patch_net(s, g->axis, i, j, origin, s->exponent, net);
      bound_second(g->axis[0].degree, g->axis[1].degree, (const double(*)[3])net, bound);
      for (int k = 0; k < 3; k++) bound[k] /= 4 * ldexp(tolerance, s->exponent);
      count_segments(bound, steps);
      const size_t at[2] = {i, j};
      for (int k = 0; k < 2; k++) {
        unsigned n = steps[k] < density ? (unsigned)ceil(steps[k]) : density;
        if (n > g->segments[k][at[k]]) g->segments[k][at[k]] = n;
      }
    }
}

/* ---- lines --------------------------------------------------------------------------------------- */

/* False when there are more vertices or triangles than indices can number. */
static bool count_lines(grid *g) {
  for (int k = 0; k < 2; k++) {
    g->lines[k] = 1;
    for (size_t i = 0; i < g->axis[k].count; i++) batten_add(g->lines[k], g->segments[k][i], &g->lines[k]);
  }
  size_t six;
  return batten_mul3(g->lines[0], g->lines[1], 6, &six) && six < UINT32_MAX;
}

static void make_lines(grid *g, int k) {
  const bspline *space = &g->surface->space[k];
  size_t at = 0;
  for (size_t i = 0; i < g->axis[k].count; i++) {
    size_t mu = g->axis[k].span[i];
    unsigned n = g->segments[k][i];
    bool last = i + 1 == g->axis[k].count;
    for (unsigned step = 0; step < n + last; step++, at++) {
      g->t[k][at] = surface_span_at(space, mu, (double)step / n);
      surface_basis_make(space, mu, g->t[k][at], &g->basis[k][at]);
    }
  }
}

static void make_vertices(void *arg, size_t row) {
  grid *g = arg;
  size_t columns = g->lines[1], v = row * columns;
  for (size_t j = 0; j < columns; j++, v++) {
    batten_surface_point p;
    surface_point_make(g->surface, &g->basis[0][row], &g->basis[1][j], &p);
    memcpy(g->points + 3 * v, p.point, sizeof p.point);
    memcpy(g->normal + 3 * v, p.normal, sizeof p.normal);
    g->gauss[v] = p.gauss;
    g->mean[v] = p.mean;
    g->place[2 * v] = g->t[0][row];
    g->place[2 * v + 1] = g->t[1][j];
  }
}

/* Cells are cut along the shorter diagonal. */
static void make_triangles(void *arg, size_t row) {
  grid *g = arg;
  size_t columns = g->lines[1];
  uint32_t *t = g->triangles + 6 * row * (columns - 1);
  for (size_t j = 0; j + 1 < columns; j++, t += 6) {
    uint32_t a = (uint32_t)(row * columns + j), b = (uint32_t)(a + columns), c = b + 1, d = a + 1;
    const double *x = g->points;
    bool ac =
        vec_distance(x + 3 * (size_t)a, x + 3 * (size_t)c) <= vec_distance(x + 3 * (size_t)b, x + 3 * (size_t)d);
    const uint32_t cell[6] = {a, b, ac ? c : d, ac ? a : b, c, d};
    memcpy(t, cell, sizeof cell);
  }
}

/* ---- the call ------------------------------------------------------------------------------------ */

static batten_status check(batten_context *ctx, const batten_surface *surface,
                           const batten_surface_tessellate_options *opt, batten_mesh **out) {
  if (!surface) return batten_fail(ctx, BATTEN_E_INVALID, "surface: NULL; give a surface");
  if (!out) return batten_fail(ctx, BATTEN_E_INVALID, "out: NULL; give the address of the result");
  batten_status st = batten_check_struct(ctx, "batten_surface_tessellate_options", opt->struct_size,
                                         sizeof(batten_surface_tessellate_options));
  if (st < 0) return st;
  if (opt->density < 1 || opt->density > DENSITY_MAX)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.density: %u; give 1 to %d", opt->density, DENSITY_MAX);
  if (!(opt->tolerance >= 0) || !isfinite(opt->tolerance))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.tolerance: %g; give a distance, or 0 for density everywhere",
                       opt->tolerance);
  return BATTEN_OK;
}

static batten_status plan(batten_context *ctx, grid *g, const batten_surface_tessellate_options *opt) {
  for (int k = 0; k < 2; k++) {
    batten_status st = surface_axis_make(ctx, &g->surface->space[k], &g->axis[k]);
    if (st < 0) return st;
    g->segments[k] = batten_alloc_array(ctx, g->axis[k].count, sizeof *g->segments[k]);
    if (!g->segments[k]) return BATTEN_E_NOMEM;
  }
  find_segments(g, opt->tolerance, opt->density);
  if (!count_lines(g))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE,
                       "opt.density: %u on %zu x %zu spans gives more vertices or triangles than indices can number; "
                       "lower it, or set a larger tolerance",
                       opt->density, g->axis[0].count, g->axis[1].count);
  for (int k = 0; k < 2; k++) {
    g->basis[k] = batten_alloc_array(ctx, g->lines[k], sizeof *g->basis[k]);
    g->t[k] = g->basis[k] ? batten_alloc_array(ctx, g->lines[k], sizeof *g->t[k]) : NULL;
    if (!g->t[k]) return BATTEN_E_NOMEM;
    make_lines(g, k);
  }
  return BATTEN_OK;
}

static batten_status make(batten_context *ctx, grid *g, batten_mesh *mesh) {
  size_t vertices = g->lines[0] * g->lines[1], rows = g->lines[0] - 1;
  mesh->vertex_count = vertices;
  mesh->triangle_count = 2 * rows * (g->lines[1] - 1);
  batten_status st = BATTEN_E_NOMEM;
  g->points = mesh->vertices = batten_alloc_array(ctx, vertices, 3 * sizeof *mesh->vertices);
  g->triangles = mesh->triangles = batten_alloc_array(ctx, mesh->triangle_count, 3 * sizeof *mesh->triangles);
  g->gauss = batten_alloc_array(ctx, vertices, 7 * sizeof *g->gauss);
  if (!g->points || !g->triangles || !g->gauss) goto done;
  g->mean = g->gauss + vertices;
  g->normal = g->mean + vertices;
  g->place = g->normal + 3 * vertices;
  batten_parallel(ctx, rows + 1, make_vertices, g);
  batten_parallel(ctx, rows, make_triangles, g);
  st = batten_mesh_set_field(ctx, mesh, "gauss", 1, g->gauss);
  if (st >= 0) st = batten_mesh_set_field(ctx, mesh, "mean", 1, g->mean);
  if (st >= 0) st = batten_mesh_set_field(ctx, mesh, "normal", 3, g->normal);
  if (st >= 0) st = batten_mesh_set_field(ctx, mesh, "place", 2, g->place);
done:
  batten_free(ctx, g->gauss);
  return st;
}

batten_status batten_surface_tessellate(batten_context *ctx, const batten_surface *surface,
                                        const batten_surface_tessellate_options *opt, batten_mesh **out) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_surface_tessellate_options defaults = batten_surface_tessellate_options_default();
  if (!opt) opt = &defaults;
  batten_status st = check(ctx, surface, opt, out);
  if (st < 0) return st;
  grid g = {.surface = surface};
  batten_mesh *mesh = batten_alloc(ctx, sizeof *mesh);
  if (!mesh) return BATTEN_E_NOMEM;
  *mesh = (batten_mesh){.ctx = ctx};
  st = plan(ctx, &g, opt);
  if (st >= 0) st = make(ctx, &g, mesh);
  for (int k = 0; k < 2; k++) {
    batten_free(ctx, g.t[k]);
    batten_free(ctx, g.basis[k]);
    batten_free(ctx, g.segments[k]);
    surface_axis_free(ctx, &g.axis[k]);
  }
  if (st < 0) {
    batten_mesh_free(mesh);
    return st;
  }
  *out = mesh;
  return BATTEN_OK;
}
