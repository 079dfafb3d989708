/* Fields on the mesh of a solid: gradient and curvatures of f at its vertices.
 *
 * Where f is summed directly, curvatures come from its Hessians. Fast sums have none: the unit normals, which they do
 * have, change along each edge of the mesh, and the symmetric matrix that explains these changes best is the
 * surface's shape operator.   [after Rusinkiewicz 2004, section 3] */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "body.h"

/* What the colours and the mesh take. */
typedef struct fields {
  size_t count;
  double *gradient, *mean, *gauss; /* [count][3], [count], [count] */
} fields;

/* Curvatures of the level set of F = -f through a point, from F's gradient g and Hessian h: F grows outwards, so
 * a ball of radius R has mean curvature 1 / R and Gaussian 1 / R^2.   [Goldman 2005, section 4] */
static void curvatures(const double g[3], const double h[9], double *mean, double *gauss) {
  double g2 = g[0] * g[0] + g[1] * g[1] + g[2] * g[2];
  double hg[3], ghg = 0;
  for (size_t k = 0; k < 3; k++) {
    hg[k] = h[3 * k] * g[0] + h[3 * k + 1] * g[1] + h[3 * k + 2] * g[2];
    ghg += g[k] * hg[k];
  }
  double trace = h[0] + h[4] + h[8];
  *mean = (g2 * trace - ghg) / (2 * g2 * sqrt(g2));
  double adjugate[6] = {h[4] * h[8] - h[5] * h[7], h[2] * h[7] - h[1] * h[8], h[1] * h[5] - h[2] * h[4],
                        h[0] * h[8] - h[2] * h[6], h[2] * h[3] - h[0] * h[5], h[0] * h[4] - h[1] * h[3]};
  double sum = adjugate[0] * g[0] * g[0] + adjugate[3] * g[1] * g[1] + adjugate[5] * g[2] * g[2] +
               2 * (adjugate[1] * g[0] * g[1] + adjugate[2] * g[0] * g[2] + adjugate[4] * g[1] * g[2]);
  *gauss = sum / (g2 * g2);
}

static batten_status fields_directly(body *b, fields *f) {
  enum { BATCH = 4096 };
  batten_context *ctx = b->run->ctx;
  const double *vertices = batten_mesh_vertices(b->mesh);
  double *hessian = batten_alloc_array(ctx, BATCH, 9 * sizeof *hessian);
  batten_status st = hessian ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t first = 0; st >= 0 && first < f->count; first += BATCH) {
    size_t count = f->count - first < BATCH ? f->count - first : BATCH;
    double *gradient = f->gradient + 3 * first;
    st = batten_progress(ctx, "fields", (double)first / (double)f->count);
    if (st >= 0) st = batten_solid_evaluate(ctx, b->solid, count, vertices + 3 * first, NULL, gradient, hessian);
    for (size_t i = 0; st >= 0 && i < count; i++) {
      double outward[3], bent[9];
      for (size_t k = 0; k < 3; k++) outward[k] = -gradient[3 * i + k];
      for (size_t k = 0; k < 9; k++) bent[k] = -hessian[9 * i + k];
      curvatures(outward, bent, &f->mean[first + i], &f->gauss[first + i]);
    }
  }
  batten_free(ctx, hessian);
  return st;
}

/* ---- curvatures from normals --------------------------------------------------------------------- */

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* The outward normal at a vertex and two tangents: an orthonormal frame [3][3], normal last. Of a gradient of 0 the
 * normal is 0. */
static void frame_at(const double *gradient, double frame[9]) {
  double *u = frame, *v = frame + 3, *n = frame + 6, length = sqrt(dot(gradient, gradient));
  for (int k = 0; k < 3; k++) n[k] = length > 0 ? -gradient[k] / length : 0;
  const int least = fabs(n[0]) <= fabs(n[1]) && fabs(n[0]) <= fabs(n[2]) ? 0 : fabs(n[1]) <= fabs(n[2]) ? 1 : 2;
  double axis[3] = {0, 0, 0};
  axis[least] = 1;
  const double along = dot(axis, n);
  for (int k = 0; k < 3; k++) u[k] = axis[k] - along * n[k];
  const double size = sqrt(dot(u, u));
  for (int k = 0; k < 3; k++) u[k] /= size;
  for (int k = 0; k < 3; k++) v[k] = n[(k + 1) % 3] * u[(k + 2) % 3] - n[(k + 2) % 3] * u[(k + 1) % 3];
}

/* Sums over the edges of a vertex for the least squares of S d = dn, d along the edge, in the tangents: dd', and
 * d_x n_x, d_y n_x + d_x n_y, d_y n_y; each over the edge's square, so that all count alike. */
enum { SUMS = 6 };

static void add_edge(const double *x, const double *gradient, size_t from, size_t to, double *sums) {
  double a[9], b[9], d[2] = {0, 0}, e[2] = {0, 0}, *s = sums + SUMS * from;
  frame_at(gradient + 3 * from, a);
  frame_at(gradient + 3 * to, b);
  for (int k = 0; k < 3; k++) {
    const double step = x[3 * to + (size_t)k] - x[3 * from + (size_t)k], turn = b[6 + k] - a[6 + k];
    for (int t = 0; t < 2; t++) {
      d[t] += step * a[3 * t + k];
      e[t] += turn * a[3 * t + k];
    }
  }
  const double square = d[0] * d[0] + d[1] * d[1];
  if (!(square > 0)) return;
  s[0] += d[0] * d[0] / square;
  s[1] += d[0] * d[1] / square;
  s[2] += d[1] * d[1] / square;
  s[3] += d[0] * e[0] / square;
  s[4] += (d[1] * e[0] + d[0] * e[1]) / square;
  s[5] += d[1] * e[1] / square;
}

/* S = (p q; q r) from  xx p + xy q = b0,  xy p + (xx + yy) q + xy r = b1,  xy q + yy r = b2. */
static void solve_shape(const double *s, double *mean, double *gauss) {
  const double xx = s[0], xy = s[1], yy = s[2], rest = xx + yy - (xy * xy / xx + xy * xy / yy);
  const double q = (s[4] - xy * s[3] / xx - xy * s[5] / yy) / rest;
  const double p = (s[3] - xy * q) / xx, r = (s[5] - xy * q) / yy;
  *mean = (p + r) / 2;
  *gauss = p * r - q * q;
  if (isfinite(*mean) && isfinite(*gauss)) return;
  *mean = *gauss = 0; /* all edges along one line */
}

static batten_status fields_by_sums(body *b, fields *f) {
  batten_context *ctx = b->run->ctx;
  const double *x = batten_mesh_vertices(b->mesh);
  const uint32_t *corners = batten_mesh_triangles(b->mesh);
  double *sums = batten_alloc_array(ctx, f->count, SUMS * sizeof *sums);
  batten_status st = sums ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0) st = batten_solid_evaluator_evaluate(ctx, b->evaluator, f->count, x, NULL, f->gradient);
  if (st >= 0) st = batten_progress(ctx, "fields", 0);
  if (st < 0) goto done;
  memset(sums, 0, f->count * SUMS * sizeof *sums);
  for (size_t t = 0; t < batten_mesh_triangle_count(b->mesh); t++)
    for (size_t i = 0; i < 3; i++) {
      const uint32_t from = corners[3 * t + i], to = corners[3 * t + (i + 1) % 3];
      add_edge(x, f->gradient, from, to, sums);
      add_edge(x, f->gradient, to, from, sums);
    }
  for (size_t i = 0; i < f->count; i++) solve_shape(sums + SUMS * i, &f->mean[i], &f->gauss[i]);
done:
  batten_free(ctx, sums);
  return st;
}

/* ---- all fields ---------------------------------------------------------------------------------- */

batten_status body_add_fields(body *b) {
  batten_context *ctx = b->run->ctx;
  fields f = {.count = batten_mesh_vertex_count(b->mesh)};
  f.gradient = batten_alloc_array(ctx, f.count, 3 * sizeof *f.gradient);
  f.mean = batten_alloc_array(ctx, f.count, sizeof *f.mean);
  f.gauss = batten_alloc_array(ctx, f.count, sizeof *f.gauss);
  b->color = batten_alloc_array(ctx, f.count, sizeof *b->color);
  batten_status st = f.gradient && f.mean && f.gauss && b->color ? BATTEN_OK : BATTEN_E_NOMEM;
  b->gradient_min = INFINITY;
  b->gradient_max = 0;
  if (st >= 0) st = (b->evaluator ? fields_by_sums : fields_directly)(b, &f);
  for (size_t i = 0; st >= 0 && i < f.count; i++) {
    const double *g = f.gradient + 3 * i, size = hypot(hypot(g[0], g[1]), g[2]);
    b->gradient_min = fmin(b->gradient_min, size);
    b->gradient_max = fmax(b->gradient_max, size);
    b->color[i] = b->request->color == BODY_MEAN ? f.mean[i] : b->request->color == BODY_GAUSS ? f.gauss[i] : size;
  }
  if (st >= 0) st = batten_mesh_set_field(ctx, b->mesh, "gradient", 3, f.gradient);
  if (st >= 0) st = batten_mesh_set_field(ctx, b->mesh, "mean_curvature", 1, f.mean);
  if (st >= 0) st = batten_mesh_set_field(ctx, b->mesh, "gaussian_curvature", 1, f.gauss);
  batten_free(ctx, f.gauss);
  batten_free(ctx, f.mean);
  batten_free(ctx, f.gradient);
  return st;
}

const double *body_color_values(const body *b) { return b->request->color == BODY_PLAIN ? NULL : b->color; }
