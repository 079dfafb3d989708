/* Measures of a network: integrals by quadrature, curvatures on a grid and their quantiles, topology, regularity.
 *
 * Integrals are sums over 8 x 8 Gauss points of the square that is folded onto the triangle by u = x, v = y (1 - x).
 * With N = du x dv and S measured from the middle of the box, by the divergence theorem
 *   area = int |N|,  3 volume = int S . N,  4 volume centroid_k = int S_k (S . N).
 * The fairness is the squared norm of the covariant derivative of the second fundamental form L_ij = n . S_ij,
 *   r_ijk = n . S_ijk - G^l_ij L_lk - G^l_jk L_li - G^l_ki L_lj,  G^l_ij = S^l . S_ij,
 * which is symmetric [Codazzi], taken in an orthonormal frame: R111^2 + 3 R112^2 + 3 R122^2 + R222^2. */
#include "surface.h"

#include "base/checked.h"
#include "basis/gauss8.h"
#include "basis/quantile.h"
#include "basis/shape.h"
#include "box.h"
#include "mesh/topology.h"
#include "regular.h"

#include <string.h>

enum {
  POINTS = GAUSS8 * GAUSS8,
  ROWS = 15,
  SAMPLED = 16384, /* patches whose Gauss points all count for the quantiles; of more patches fewer points each */
  BATCH = 32       /* tasks between two progress calls */
};
typedef struct sums {
  double area, volume, surface_moment[3], volume_moment[3], gauss, fairness;
  double gauss_min, gauss_max, mean_min, mean_max, regularity;
  double lower[3], upper[3]; /* of the grid */
} sums;
typedef struct job {
  const batten_network *network;
  double middle[3];
  size_t first_task, each;  /* patches of a task */
  sums *sums;               /* [tasks] */
  size_t stride, slots;     /* every stride-th Gauss point of a patch is a sample: [patches][slots] */
  weighted_sample *samples; /* of K, by area */
} job;

/* ---- one place ---------------------------------------------------------------------------------- */

/* |grad II|^2; jet of order 3, n its normal. */
static double grad_form(const double (*s)[3], const double n[3]) {
  double e = vec_dot(s[1], s[1]), f = vec_dot(s[1], s[2]), g = vec_dot(s[2], s[2]);
  double cross[3], raised[2][3], l[3], gamma[3][2], r[4];
  vec_cross(s[1], s[2], cross);
  double det = vec_dot(cross, cross);
  for (int d = 0; d < 3; d++) {
    raised[0][d] = (g * s[1][d] - f * s[2][d]) / det;
    raised[1][d] = (e * s[2][d] - f * s[1][d]) / det;
  }
  for (int i = 0; i < 3; i++) {
    l[i] = vec_dot(n, s[3 + i]);
    for (int k = 0; k < 2; k++) gamma[i][k] = vec_dot(raised[k], s[3 + i]);
  }
  /* ijk = 111, 112, 122, 222; ij is entry i + j of l and gamma, counted from 0. */
  for (int t = 0; t < 4; t++) {
    int i = t > 2, j = t > 1, k = t > 0;
    r[t] = vec_dot(n, s[6 + t]);
    for (int m = 0; m < 2; m++)
      r[t] -= gamma[i + j][m] * l[m + k] + gamma[j + k][m] * l[m + i] + gamma[k + i][m] * l[m + j];
  }
  double a = 1 / sqrt(e), mu = sqrt(det / e), b = -f / (e * mu), c = 1 / mu;
  double r1 = a * a * a * r[0], r2 = a * a * (b * r[0] + c * r[1]);
  double r3 = a * (b * b * r[0] + 2 * b * c * r[1] + c * c * r[2]);
  double r4 = b * b * b * r[0] + 3 * b * b * c * r[1] + 3 * b * c * c * r[2] + c * c * c * r[3];
  return r1 * r1 + 3 * r2 * r2 + 3 * r3 * r3 + r4 * r4;
}

/* Adds a Gauss point; returns |du x dv|. */
static double add_point(const double (*jet)[3], double weight, sums *s, weighted_sample *out) {
  double cross[3], area;
  surface_shape shape;
  vec_cross(jet[1], jet[2], cross);
  bool regular = surface_shape_make(jet, &shape);
  area = vec_norm(cross);
  double height = vec_dot(jet[0], cross);
  s->area += weight * area;
  s->volume += weight * height / 3;
  for (int d = 0; d < 3; d++) {
    s->surface_moment[d] += weight * area * jet[0][d];
    s->volume_moment[d] += weight * height * jet[0][d] / 4;
  }
  if (regular) {
    s->gauss += weight * area * shape.gauss;
    s->fairness += weight * area * grad_form(jet, shape.normal);
  }
  if (out) *out = (weighted_sample){shape.gauss, regular ? weight * area : 0};
  return area;
}

/* ---- one patch ---------------------------------------------------------------------------------- */

static void measure_grid(unsigned degree, const double (*net)[3], const double middle[3], double mean_area, sums *s) {
  double least = INFINITY;
  for (unsigned k = 0; k < ROWS; k++)
    for (unsigned j = 0; j + k < ROWS; j++) {
      double jet[6][3], cross[3];
      surface_shape shape;
      triangular_jet(degree, net, (double)j / (ROWS - 1), (double)k / (ROWS - 1), 2, jet);
      vec_cross(jet[1], jet[2], cross);
      least = fmin(least, vec_norm(cross));
      for (int d = 0; d < 3; d++) {
        s->lower[d] = fmin(s->lower[d], jet[0][d] + middle[d]);
        s->upper[d] = fmax(s->upper[d], jet[0][d] + middle[d]);
      }
      if (!surface_shape_make((const double(*)[3])jet, &shape)) {
        least = 0;
        continue;
      }
      s->gauss_min = fmin(s->gauss_min, shape.gauss);
      s->gauss_max = fmax(s->gauss_max, shape.gauss);
      s->mean_min = fmin(s->mean_min, shape.mean);
      s->mean_max = fmax(s->mean_max, shape.mean);
    }
  s->regularity = fmin(s->regularity, mean_area > 0 ? least / mean_area : 0);
}

static void measure_patch(const job *j, size_t patch, sums *s) {
  unsigned degree = net_surface_degree(j->network, patch);
  const double(*from)[3] = (const double(*)[3])net_surface_points(j->network, patch);
  double net[TRIANGULAR_MAX][3], mean_area = 0;
  for (size_t i = 0; i < triangular_count(degree); i++) vec_sub(from[i], j->middle, net[i]);
  weighted_sample *samples = j->samples + patch * j->slots;
  for (size_t i = 0; i < j->slots; i++) samples[i].weight = 0;
  for (unsigned i = 0; i < POINTS; i++) {
    double x, y, wx, wy, jet[TRIANGULAR_JET][3];
    gauss8_node(i / GAUSS8, &x, &wx);
    gauss8_node(i % GAUSS8, &y, &wy);
    double weight = wx * wy * (1 - x);
    triangular_jet(degree, (const double(*)[3])net, x, y * (1 - x), 3, jet);
    /* Other points on other patches, so that all parts of patches are seen alike. */
    bool counts = (i + patch) % j->stride == 0;
    double area = add_point((const double(*)[3])jet, weight, s, counts ? samples++ : NULL);
    mean_area += 2 * weight * area;
  }
  measure_grid(degree, (const double(*)[3])net, j->middle, mean_area, s);
}

static sums no_sums(void) {
  sums s = {.gauss_min = INFINITY,
            .gauss_max = -INFINITY,
            .mean_min = INFINITY,
            .mean_max = -INFINITY,
            .regularity = INFINITY};
  for (int d = 0; d < 3; d++) {
    s.lower[d] = INFINITY;
    s.upper[d] = -INFINITY;
  }
  return s;
}

static void measure_some(void *arg, size_t index) {
  const job *j = arg;
  size_t task = j->first_task + index, from = task * j->each;
  sums s = no_sums();
  for (size_t p = from; p < from + j->each && p < j->network->patch_count; p++) measure_patch(j, p, &s);
  j->sums[task] = s;
}

static void add_sums(const sums *from, sums *to) {
  to->area += from->area;
  to->volume += from->volume;
  to->gauss += from->gauss;
  to->fairness += from->fairness;
  to->gauss_min = fmin(to->gauss_min, from->gauss_min);
  to->gauss_max = fmax(to->gauss_max, from->gauss_max);
  to->mean_min = fmin(to->mean_min, from->mean_min);
  to->mean_max = fmax(to->mean_max, from->mean_max);
  to->regularity = fmin(to->regularity, from->regularity);
  for (int d = 0; d < 3; d++) {
    to->surface_moment[d] += from->surface_moment[d];
    to->volume_moment[d] += from->volume_moment[d];
    to->lower[d] = fmin(to->lower[d], from->lower[d]);
    to->upper[d] = fmax(to->upper[d], from->upper[d]);
  }
}

/* ---- the whole ---------------------------------------------------------------------------------- */

static void find_middle(const batten_network *network, double middle[3]) {
  double lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t h = 0; h < 3 * network->face_count; h++)
    for (int d = 0; d < 3; d++) {
      double x = network->vertices[3 * (size_t)network->triangles[h] + (size_t)d];
      lower[d] = fmin(lower[d], x);
      upper[d] = fmax(upper[d], x);
    }
  for (int d = 0; d < 3; d++) middle[d] = network->face_count ? 0.5 * lower[d] + 0.5 * upper[d] : 0;
}

static batten_status integrate(batten_context *ctx, job *j, size_t tasks, sums *out) {
  *out = no_sums();
  for (size_t done = 0; done < tasks; done += BATCH) {
    batten_status st = batten_progress(ctx, "measure", 0.8 * (double)done / (double)tasks);
    if (st < 0) return st;
    j->first_task = done;
    batten_parallel(ctx, tasks - done < BATCH ? tasks - done : BATCH, measure_some, j);
  }
  for (size_t i = 0; i < tasks; i++) add_sums(&j->sums[i], out);
  return BATTEN_OK;
}

static void set_topology(const batten_mesh_topology *t, size_t faces, batten_network_measures *m) {
  m->closed = faces > 0 && t->boundary_edges == 0;
  m->components = t->components;
  m->boundary_edges = t->boundary_edges;
  m->euler = (long)t->vertices - (long)t->edges + (long)faces;
  m->genus = m->closed && t->nonmanifold_vertices == 0 ? (long)t->components - m->euler / 2 : -1;
}

static void set_integrals(const sums *s, const double middle[3], size_t patches, batten_network_measures *m) {
  bool solid = m->closed && s->volume != 0;
  m->area = s->area;
  m->volume = m->closed ? s->volume : NAN;
  for (int d = 0; d < 3; d++) {
    double away = solid ? s->volume_moment[d] / s->volume : s->area > 0 ? s->surface_moment[d] / s->area : 0;
    m->centroid[d] = middle[d] + away;
    m->lower[d] = patches ? s->lower[d] : 0;
    m->upper[d] = patches ? s->upper[d] : 0;
  }
  bool some = s->gauss_min <= s->gauss_max;
  m->gauss_min = some ? s->gauss_min : NAN;
  m->gauss_max = some ? s->gauss_max : NAN;
  m->mean_min = some ? s->mean_min : NAN;
  m->mean_max = some ? s->mean_max : NAN;
  m->gauss_integral = s->gauss;
  m->fairness = s->fairness;
  m->regularity_min = patches ? s->regularity : NAN;
}

static batten_status set_quantiles(batten_context *ctx, const job *j, batten_network_measures *m) {
  const double part[5] = {0.01, 0.02, 0.5, 0.98, 0.99};
  double *value[5] = {&m->gauss_p01, &m->gauss_p02, &m->gauss_p50, &m->gauss_p98, &m->gauss_p99};
  for (int i = 0; i < 5; i++) {
    batten_status st = batten_progress(ctx, "measure", 0.8 + 0.01 * i);
    if (st < 0) return st;
    *value[i] = weighted_quantile(j->network->patch_count * j->slots, j->samples, part[i]);
  }
  return BATTEN_OK;
}

batten_status batten_network_measure(batten_context *ctx, const batten_network *network,
                                     batten_network_measures *out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!network || !out)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a network and room for its measures",
                       network ? "out" : "network");
  size_t patches = network->patch_count, each = patches / 4096 + 1;
  if (each < 4) each = 4;
  size_t tasks = patches / each + (patches % each > 0);
  job j = {.network = network, .each = each, .stride = patches / SAMPLED + 1};
  if (j.stride > POINTS) j.stride = POINTS;
  j.slots = (POINTS + j.stride - 1) / j.stride;
  sums total;
  batten_network_measures m = {0};
  batten_mesh_topology topology;
  batten_status st =
      batten_mesh_find_topology(ctx, network->vertex_count, network->face_count, network->triangles, &topology);
  if (st < 0) return st;
  st = BATTEN_E_NOMEM;
  j.sums = batten_alloc_array(ctx, tasks, sizeof *j.sums);
  j.samples = j.sums ? batten_alloc_array(ctx, patches, j.slots * sizeof *j.samples) : NULL;
  if (!j.samples) goto done;
  find_middle(network, j.middle);
  st = integrate(ctx, &j, tasks, &total);
  if (st < 0) goto done;
  set_topology(&topology, network->face_count, &m);
  set_integrals(&total, j.middle, patches, &m);
  st = set_quantiles(ctx, &j, &m);
  if (st < 0) goto done;
  st = net_box(ctx, network, m.lower, m.upper);
  if (st < 0) goto done;
  st = net_find_irregular(ctx, network, "measure", 0.9, &m.irregular_patches, NULL);
  if (st < 0) goto done;
  *out = m;
done:
  batten_free(ctx, j.samples);
  batten_free(ctx, j.sums);
  return st;
}
