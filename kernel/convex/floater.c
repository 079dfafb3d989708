/* Parameters as convex combinations [Floater 1997, "Parametrization and smooth approximation of surface
 * triangulations"; 2003, "One-to-one piecewise linear mappings over triangulations"].
 *
 * The rim of a triangulated disc goes to the boundary of the square. Each inner point is an average of its
 * neighbours, with weights that are positive and reproduce the points where these lie in a plane: the fan around a
 * point is flattened with its lengths and with its angles in proportion; for each neighbour, the point is written as
 * a combination of it and of the two across, and the mean of these combinations counts.
 *
 * Such a map folds nowhere, unless an edge through the inside has both ends on one side of the square, which is flat
 * [Floater 2003, theorem 4.1]. Those edges are given a point in their middle first. Whether all triangles then are
 * positive in the square is checked by exact signs. */
#include "floater.h"

#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "cloud.h"
#include "mesh/predicates.h"
#include "mesh/vec.h"
#include "outline.h"
#include "sparse/averages.h"

/* Puts a point in the middle of inner edges with both ends on one side. xyz and side have room for it. */
static void split_flat_edges(convex_disc *disc, double *xyz, unsigned char *side) {
  for (uint32_t h = 0; h < 3 * disc->triangles; h++) {
    if (disc->twin[h] == MESH_NONE) continue;
    size_t a = disc->corners[h], b = disc->corners[disc->twin[h]], m = disc->points;
    if (!(side[a] & side[b])) continue;
    convex_disc_split(disc, h);
    side[m] = 0;
    for (size_t k = 0; k < 3; k++) xyz[3 * m + k] = 0.5 * (xyz[3 * a + k] + xyz[3 * b + k]);
  }
}

/* ---- weights -------------------------------------------------------------------------------------- */

typedef struct fan {
  size_t count, room;
  uint32_t *neighbour; /* [room], counter-clockwise */
  double *angle;       /* [room + 1] of the flat fan, from the first neighbour on: 0 .. 2 pi */
  double *flat;        /* [room][2] */
  double *weight;      /* [room] */
} fan;

static void fan_free(batten_context *ctx, fan *f) {
  batten_free(ctx, f->neighbour);
  batten_free(ctx, f->angle);
  batten_free(ctx, f->flat);
  batten_free(ctx, f->weight);
}

static batten_status fan_new(batten_context *ctx, size_t room, fan *out) {
  fan f = {.room = room};
  f.neighbour = batten_alloc_array(ctx, room, sizeof *f.neighbour);
  f.angle = f.neighbour ? batten_alloc_array(ctx, room + 1, sizeof *f.angle) : NULL;
  f.flat = f.angle ? batten_alloc_array(ctx, room, 2 * sizeof *f.flat) : NULL;
  f.weight = f.flat ? batten_alloc_array(ctx, room, sizeof *f.weight) : NULL;
  *out = f;
  return f.weight ? BATTEN_OK : BATTEN_E_NOMEM;
}

static void list_neighbours(const convex_disc *disc, uint32_t point, fan *f) {
  uint32_t h = disc->leaving[point];
  f->count = 0;
  do {
    f->neighbour[f->count++] = disc->corners[mesh_next(h)];
    h = convex_disc_turn(disc, h);
  } while (h != disc->leaving[point]);
}

/* The flat fan; false when the point has a neighbour at its place or no angles. */
static bool flatten(const double *xyz, uint32_t point, fan *f) {
  const double two_pi = 6.283185307179586, *p = xyz + 3 * (size_t)point;
  double largest = 0;
  f->angle[0] = 0;
  for (size_t k = 0; k < f->count; k++) {
    const double *q = xyz + 3 * (size_t)f->neighbour[k], *r = xyz + 3 * (size_t)f->neighbour[(k + 1) % f->count];
    f->angle[k + 1] = f->angle[k] + vec_angle(p, q, r);
    f->weight[k] = vec_distance(p, q);
    largest = fmax(largest, f->weight[k]);
  }
  double total = f->angle[f->count];
  bool is_fan = total > 0;
  for (size_t k = 0; k < f->count; k++) {
    double length = f->weight[k] / largest;
    if (!(f->weight[k] > 0)) is_fan = false;
    f->angle[k] *= two_pi / total;
    f->flat[2 * k] = length * cos(f->angle[k]);
    f->flat[2 * k + 1] = length * sin(f->angle[k]);
  }
  f->angle[f->count] = two_pi;
  return is_fan;
}

static double cross(const double *p, const double *q) { return p[0] * q[1] - p[1] * q[0]; }

/* Weights are positive, but those of flat fans to rounding only: at least this keeps points off straight lines, by so
 * little that planes are still reproduced. */
static const double WEIGHT_LEAST = 1e-12;

/* weight: means of the coordinates of 0 in the triangles of each neighbour l and the two across, r and r + 1. */
static void average(fan *f) {
  const double pi = 3.141592653589793;
  size_t n = f->count, r = 0;
  memset(f->weight, 0, n * sizeof *f->weight);
  for (size_t l = 0; l < n; l++) {
    /* r < 2 n: the last neighbour at an angle of at most pi from l, counted on around the fan. */
    if (r < l + 1) r = l + 1;
    while (r + 1 < l + n - 1 && f->angle[(r + 1) % n] + (r + 1 < n ? 0 : 2 * pi) - f->angle[l] <= pi) r++;
    size_t a = r % n, b = (r + 1) % n;
    const double *p = f->flat + 2 * l, *q = f->flat + 2 * a, *s = f->flat + 2 * b;
    double part[3] = {fmax(0, cross(q, s)), fmax(0, cross(s, p)), fmax(0, cross(p, q))};
    double sum = part[0] + part[1] + part[2];
    if (!(sum > 0)) continue; /* a fan that is flat to rounding */
    f->weight[l] += part[0] / sum;
    f->weight[a] += part[1] / sum;
    f->weight[b] += part[2] / sum;
  }
  for (size_t k = 0; k < n; k++) f->weight[k] = fmax(f->weight[k] / (double)n, WEIGHT_LEAST);
}

static void find_weights(const convex_disc *disc, const double *xyz, uint32_t point, fan *f) {
  list_neighbours(disc, point, f);
  if (flatten(xyz, point, f)) {
    average(f);
  } else {
    for (size_t k = 0; k < f->count; k++) f->weight[k] = 1 / (double)f->count;
  }
}

/* ---- the system ----------------------------------------------------------------------------------- */

typedef struct network {
  uint32_t *number; /* [points] of the unknown, MESH_NONE for others */
  uint32_t *point;  /* [count] */
  size_t count, fan_max;
  size_t *starts;
  uint32_t *columns;
  double *weights, *given, *values, *x;
} network;

static void network_free(batten_context *ctx, network *w) {
  batten_free(ctx, w->number);
  batten_free(ctx, w->point);
  batten_free(ctx, w->starts);
  batten_free(ctx, w->columns);
  batten_free(ctx, w->weights);
  batten_free(ctx, w->given);
  batten_free(ctx, w->values);
  batten_free(ctx, w->x);
}

static batten_status network_new(batten_context *ctx, const convex_disc *disc, network *w) {
  w->number = batten_alloc_array(ctx, disc->points, sizeof *w->number);
  w->point = w->number ? batten_alloc_array(ctx, disc->points, sizeof *w->point) : NULL;
  w->starts = w->point ? batten_alloc_array(ctx, disc->points + 1, sizeof *w->starts) : NULL;
  if (!w->starts) return BATTEN_E_NOMEM;
  size_t entries = 0;
  w->fan_max = 1;
  for (uint32_t i = 0; i < disc->points; i++) {
    bool inner = disc->leaving[i] != MESH_NONE && !convex_disc_is_rim(disc, i);
    w->number[i] = inner ? (uint32_t)w->count : MESH_NONE;
    if (!inner) continue;
    w->point[w->count++] = i;
    size_t before = entries;
    uint32_t h = disc->leaving[i];
    do {
      entries++;
      h = convex_disc_turn(disc, h);
    } while (h != disc->leaving[i]);
    if (entries - before > w->fan_max) w->fan_max = entries - before;
  }
  w->columns = batten_alloc_array(ctx, entries, sizeof *w->columns);
  w->weights = w->columns ? batten_alloc_array(ctx, entries, sizeof *w->weights) : NULL;
  w->given = w->weights ? batten_alloc_array(ctx, w->count, sizeof *w->given) : NULL;
  w->values = w->given ? batten_alloc_array(ctx, w->count, 2 * sizeof *w->values) : NULL;
  w->x = w->values ? batten_alloc_array(ctx, w->count, 2 * sizeof *w->x) : NULL;
  return w->x ? BATTEN_OK : BATTEN_E_NOMEM;
}

static void fill_row(const convex_disc *disc, const double *xyz, const double *uv, size_t i, fan *f, network *w) {
  size_t end = w->starts[i];
  find_weights(disc, xyz, w->point[i], f);
  w->given[i] = w->values[2 * i] = w->values[2 * i + 1] = 0;
  for (size_t k = 0; k < f->count; k++) {
    uint32_t neighbour = f->neighbour[k];
    if (w->number[neighbour] != MESH_NONE) {
      w->columns[end] = w->number[neighbour];
      w->weights[end++] = f->weight[k];
      continue;
    }
    w->given[i] += f->weight[k];
    for (size_t c = 0; c < 2; c++) w->values[2 * i + c] += f->weight[k] * uv[2 * (size_t)neighbour + c];
  }
  w->starts[i + 1] = end;
}

/* uv of the inner points from those of the rim. */
static batten_status find_inner(batten_context *ctx, const convex_disc *disc, const double *xyz, double *uv) {
  network w = {0};
  fan f = {0};
  batten_status st = network_new(ctx, disc, &w);
  if (st >= 0) st = fan_new(ctx, w.fan_max, &f);
  if (st >= 0) {
    w.starts[0] = 0;
    for (size_t i = 0; i < w.count; i++) fill_row(disc, xyz, uv, i, &f, &w);
    sparse_averages system = {w.count, w.starts, w.columns, w.weights, w.given, w.values};
    st = sparse_solve_averages(ctx, &system, "parameters", 0.5, w.x);
  }
  for (size_t i = 0; st >= 0 && i < w.count; i++) memcpy(uv + 2 * (size_t)w.point[i], w.x + 2 * i, 2 * sizeof *uv);
  fan_free(ctx, &f);
  network_free(ctx, &w);
  return st;
}

/* W_ACCURACY when a triangle is not positive in the square. count: points but those of splits, which are nobody's:
 * where these have only points of the rim around them, nothing is lost when they fall together. */
static batten_status check_folds(batten_context *ctx, const convex_disc *disc, size_t count, const double *uv) {
  size_t folds = 0;
  uint32_t near = 0;
  for (size_t t = disc->triangles; t-- > 0;) {
    const uint32_t *c = disc->corners + 3 * t;
    const double *p = uv + 2 * (size_t)c[0], *q = uv + 2 * (size_t)c[1], *r = uv + 2 * (size_t)c[2];
    bool has_split = false, has_inner = false;
    for (int k = 0; k < 3; k++) {
      has_split = has_split || c[k] >= count;
      has_inner = has_inner || (c[k] < count && !convex_disc_is_rim(disc, c[k]));
    }
    if ((has_split && !has_inner) || batten_orient2d(p, q, r, 0, 1) > 0) continue;
    folds++;
    for (int k = 0; k < 3; k++)
      if (c[k] < count) near = c[k];
  }
  if (folds == 0) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_W_ACCURACY,
                     "parameters[%lu]: a triangle at this point has no area in the square to the rounding of "
                     "parameters, one of %zu; the surface is too deep for one square, cut it",
                     (unsigned long)near, folds);
}

static batten_status check_corners(batten_context *ctx, size_t count, const uint32_t *corners) {
  for (size_t k = 0; corners && k < 4; k++)
    if (corners[k] >= count)
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.corners[%zu]: %lu, but there are %zu points", k,
                         (unsigned long)corners[k], count);
  return BATTEN_OK;
}

batten_status convex_floater(batten_context *ctx, size_t count, const double *points, const convex_scale *scale,
                             const batten_parametrize_options *opt, double *uv) {
  convex_disc disc = {0};
  double *xyz = NULL, *places = NULL;
  unsigned char *side = NULL;
  size_t corner_count = 4, corners[4];
  uint32_t given[4] = {0};
  batten_status st = check_corners(ctx, count, opt->corners);
  if (st < 0) return st;
  uint32_t *first = batten_alloc_array(ctx, count, sizeof *first);
  st = !first                ? BATTEN_E_NOMEM
       : opt->triangle_count ? convex_disc_new(ctx, count, NULL, opt->triangle_count, opt->triangles, &disc)
                             : convex_cloud_triangulate(ctx, count, points, scale, first, &disc);
  if (st < 0) goto done;
  for (uint32_t i = 0; opt->triangle_count && i < count; i++) first[i] = i;
  for (size_t k = 0; opt->corners && k < 4; k++) given[k] = first[opt->corners[k]];
  st = batten_progress(ctx, "parameters", 0.3);
  if (st < 0) goto done;

  /* Splits add fewer points than the rim has. */
  xyz = batten_alloc_array(ctx, 2 * count, 3 * sizeof *xyz);
  places = xyz ? batten_alloc_array(ctx, 2 * count, 2 * sizeof *places) : NULL;
  side = places ? batten_alloc_array(ctx, 2 * count, 1) : NULL;
  st = side ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  for (size_t i = 0; i < count; i++) convex_scale_apply(scale, points + 3 * i, xyz + 3 * i);
  st = opt->corners ? convex_outline_given(ctx, &disc, given, corners)
                    : convex_outline_choose(ctx, &disc, xyz, &corner_count, corners);
  if (st < 0) goto done;
  convex_outline_map(&disc, xyz, corner_count, corners, places, side);
  split_flat_edges(&disc, xyz, side);
  st = find_inner(ctx, &disc, xyz, places);
  if (st < 0) goto done;
  st = check_folds(ctx, &disc, count, places);
  for (size_t i = 0; i < count; i++) memcpy(uv + 2 * i, places + 2 * (size_t)first[i], 2 * sizeof *uv);

done:
  batten_free(ctx, side);
  batten_free(ctx, places);
  batten_free(ctx, xyz);
  batten_free(ctx, first);
  convex_disc_free(ctx, &disc);
  return st;
}
