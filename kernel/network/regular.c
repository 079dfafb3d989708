/* Proofs that the normal of a patch vanishes nowhere.
 *
 * du and dv are means of their Bernstein coefficients a_i, b_j, so N = du x dv is a mean of the a_i x b_j. Whenever
 * all of these have a positive product with one direction d, N . d > 0. The quick proof looks at the a_i and b_j in
 * the plane orthogonal to d: it is enough that the cone of the a_i and the cone of the b_j lie apart, which four
 * products of extreme vectors show. Where that fails, the coefficients of N itself, of degree 2 n - 2, are nearer to
 * it, and parts of the patch have directions of their own: the net of N is split until all parts are proven, or a
 * part of 1/64 is not. */
#include "regular.h"

#include "base/checked.h"
#include "surface.h"

#include <string.h>

enum {
  DEPTH = 6,   /* splits of a part */
  BLOCK = 256, /* patches of a task */
  BATCH = 32   /* tasks between two progress calls; each has scratch */
};
/* Products below this part of the product of lengths are rounding, and prove nothing. */
static const double MARGIN = 1e-12;

/* ---- the quick proof ---------------------------------------------------------------------------- */

typedef struct cone {
  double low[2], high[2]; /* extreme vectors, clockwise and counter-clockwise */
} cone;

static double cross2(const double a[2], const double b[2]) { return a[0] * b[1] - a[1] * b[0]; }
static bool clearly_left(const double a[2], const double b[2]) {
  return cross2(a, b) > MARGIN * sqrt((a[0] * a[0] + a[1] * a[1]) * (b[0] * b[0] + b[1] * b[1]));
}

/* The cone of the differences between neighbours along u (right = 1, up = 0) or v (0, 1), in the plane of x and y;
 * false when they do not all lie on one side of a line: the one orthogonal to `middle`. */
static bool find_cone(unsigned n, const double (*net)[3], unsigned right, unsigned up, const double x[3],
                      const double y[3], const double middle[2], cone *out) {
  bool first = true;
  for (unsigned k = 0; k < n; k++)
    for (unsigned j = 0; j + k < n; j++) {
      double a[3], p[2];
      vec_sub(net[triangular_index(n, j + right, k + up)], net[triangular_index(n, j, k)], a);
      p[0] = vec_dot(a, x);
      p[1] = vec_dot(a, y);
      if (!(p[0] * middle[0] + p[1] * middle[1] > 0)) return false;
      if (first || cross2(out->low, p) < 0) memcpy(out->low, p, sizeof p);
      if (first || cross2(out->high, p) > 0) memcpy(out->high, p, sizeof p);
      first = false;
    }
  return true;
}

static bool cones_apart(unsigned n, const double (*net)[3]) {
  double a[3], b[3], x[3], y[3], d[3];
  vec_sub(net[n], net[0], a);
  vec_sub(net[triangular_count(n) - 1], net[0], b);
  vec_cross(a, b, d);
  memcpy(x, a, sizeof x);
  if (!vec_normalize(d) || !vec_normalize(x)) return false;
  vec_cross(d, x, y);
  const double u[2] = {vec_dot(a, x), vec_dot(a, y)}, v[2] = {vec_dot(b, x), vec_dot(b, y)};
  cone p, q;
  if (!find_cone(n, net, 1, 0, x, y, u, &p) || !find_cone(n, net, 0, 1, x, y, v, &q)) return false;
  return clearly_left(p.low, q.low) && clearly_left(p.low, q.high) && clearly_left(p.high, q.low) &&
         clearly_left(p.high, q.high);
}

/* ---- by the normal's coefficients --------------------------------------------------------------- */

/* All on one side of the plane orthogonal to their sum. */
static bool on_one_side(size_t count, const double (*normals)[3]) {
  double sum[3] = {0, 0, 0}, most = 0;
  for (size_t i = 0; i < count; i++)
    for (int d = 0; d < 3; d++) {
      sum[d] += normals[i][d];
      most = fmax(most, fabs(normals[i][d]));
    }
  if (!vec_normalize(sum)) return false;
  for (size_t i = 0; i < count; i++)
    if (!(vec_dot(normals[i], sum) > MARGIN * most)) return false;
  return true;
}

size_t net_regular_work(unsigned degree) {
  size_t size = 3 * triangular_count(2 * degree - 2);
  /* The stack: three parts left at each depth, and the last four; a copy and the scratch of a split. */
  return size * (3 * DEPTH + 4 + 4);
}

bool net_regular(unsigned degree, const double (*net)[3], double *work) {
  if (cones_apart(degree, net)) return true;
  unsigned m = 2 * degree - 2, depth[3 * DEPTH + 4];
  size_t count = triangular_count(m), size = 3 * count, height = 1;
  double *split = work + size * (3 * DEPTH + 4);
  triangular_normal(degree, net, (double(*)[3])work);
  depth[0] = 0;
  while (height > 0) {
    double *top = work + --height * size;
    if (on_one_side(count, (const double(*)[3])top)) continue;
    unsigned below = depth[height] + 1;
    if (below > DEPTH) return false;
    /* A normal that vanishes at a corner will never be proven. */
    const double *corner[3] = {top, top + (size_t)3 * m, top + size - 3};
    for (int k = 0; k < 3; k++)
      if (!(vec_norm(corner[k]) > 0)) return false;
    /* The parts take the whole's place: it goes to the scratch first. */
    memcpy(split, top, size * sizeof *top);
    triangular_split(m, 3, split, top, split + size);
    for (unsigned k = 0; k < 4; k++) depth[height + k] = below;
    height += 4;
  }
  return true;
}

/* ---- all patches -------------------------------------------------------------------------------- */

typedef struct job {
  const batten_network *network;
  size_t first_task, size; /* doubles of scratch */
  double *work;            /* [BATCH][size] */
  size_t (*found)[2];      /* [BATCH]: patches, faces */
} job;

/* Tasks are runs of faces, so that no face falls into two. */
static void prove_some(void *arg, size_t index) {
  const job *j = arg;
  const batten_network *n = j->network;
  size_t from = (j->first_task + index) * BLOCK, patches = 0, faces = 0;
  for (size_t f = from; f < from + BLOCK && f < n->face_count; f++) {
    size_t first = net_surface_first(n, f), bad = 0;
    for (size_t p = first; p < first + net_surface_parts(n, f); p++)
      bad += !net_regular(net_surface_degree(n, p), (const double(*)[3])net_surface_points(n, p),
                          j->work + index * j->size);
    patches += bad;
    faces += bad > 0;
  }
  j->found[index][0] = patches;
  j->found[index][1] = faces;
}

batten_status net_find_irregular(batten_context *ctx, const batten_network *network, const char *phase, double from,
                                 size_t *patches, size_t *faces) {
  size_t tasks = network->face_count / BLOCK + (network->face_count % BLOCK > 0), sum[2] = {0, 0};
  unsigned degree = network->degree ? network->degree : 1;
  for (size_t p = 0; !network->degree && p < network->patch_count; p++)
    if (network->degrees[p] > degree) degree = network->degrees[p];
  size_t found[BATCH][2], batch = tasks < BATCH ? tasks : BATCH;
  job j = {network, 0, net_regular_work(degree), NULL, found};
  j.work = batten_alloc_array(ctx, batch, j.size * sizeof *j.work);
  if (!j.work) return BATTEN_E_NOMEM;
  batten_status st = BATTEN_OK;
  for (size_t done = 0; done < tasks && st == BATTEN_OK; done += batch) {
    st = batten_progress(ctx, phase, from + (1 - from) * (double)done / (double)tasks);
    if (st < 0) break;
    size_t now = tasks - done < batch ? tasks - done : batch;
    j.first_task = done;
    batten_parallel(ctx, now, prove_some, &j);
    for (size_t i = 0; i < now; i++) {
      sum[0] += found[i][0];
      sum[1] += found[i][1];
    }
  }
  batten_free(ctx, j.work);
  if (st < 0) return st;
  if (patches) *patches = sum[0];
  if (faces) *faces = sum[1];
  return BATTEN_OK;
}
