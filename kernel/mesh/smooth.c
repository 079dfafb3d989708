/* Smoothing of noisy scans by the discrepancy principle [Morozov 1966] with the umbrella operator [Kobbelt, Campagna,
 * Vorsatz, Seidel 1998]: (L x)_i = x_i - mean of the neighbours; on boundaries the neighbours along them, so that
 * they smooth as curves and do not pull in.
 *
 * x minimises |x - x0|^2 + lambda |L x|^2: the move d = x - x0 solves (I + lambda L'L) d = -lambda L'L x0. Its right
 * side comes from differences of coordinates, so a mesh far from the origin loses nothing. All three axes go
 * through conjugate gradients side by side, L and L' one after the other: hubs of many triangles, which would fill
 * L'L, cost no more than their edges. The move grows with lambda, and 1 / |d| is nearly a line over 1 / lambda (one
 * eigenvalue: exactly), so a few secants find the move wanted. */
#include <batten/mesh.h>
#include <string.h>

#include "base/checked.h"
#include "mesh_inner.h"
#include "vec.h"

/* Rows of L: neighbours of i; the same by columns: vertices that have i as a neighbour. */
typedef struct umbrella {
  size_t count;
  size_t *starts, *back_starts; /* [count + 1] */
  uint32_t *columns, *back;
  double *weight; /* [count] 1 / neighbours; 0 without */
} umbrella;

static void umbrella_free(batten_context *ctx, umbrella *l) {
  batten_free(ctx, l->starts);
  batten_free(ctx, l->back_starts);
  batten_free(ctx, l->columns);
  batten_free(ctx, l->back);
  batten_free(ctx, l->weight);
}

typedef struct edge {
  uint32_t a, b;
  bool boundary;
} edge;

/* The edge whose half-edges begin at order[*at]; *at moves behind them. False: both ends are the same. */
static bool next_edge(size_t half_edges, const uint32_t *triangles, const uint32_t *order, size_t *at, edge *out) {
  uint32_t a = triangles[order[*at]], b = triangles[mesh_next(order[*at])];
  size_t first = *at;
  for (; *at < half_edges; ++*at) {
    uint32_t c = triangles[order[*at]], d = triangles[mesh_next(order[*at])];
    if (!(c == a && d == b) && !(c == b && d == a)) break;
  }
  *out = (edge){a, b, *at - first == 1};
  return a != b;
}

/* Counts (fill = false) or enters (true) the neighbours that edge e makes. starts are one ahead while counting, and
 * move on while entering. */
static void add_edge(umbrella *l, const unsigned char *on_boundary, const edge *e, bool fill) {
  const uint32_t ends[2] = {e->a, e->b};
  for (int k = 0; k < 2; k++) {
    uint32_t i = ends[k], j = ends[!k];
    if (on_boundary[i] && !e->boundary) continue;
    if (fill) {
      l->columns[l->starts[i]++] = j;
      l->back[l->back_starts[j]++] = i;
    } else {
      l->starts[i + 1]++;
      l->back_starts[j + 1]++;
    }
  }
}

static batten_status umbrella_make(batten_context *ctx, const batten_mesh *mesh, umbrella *out) {
  size_t n = mesh->vertex_count, half_edges = 3 * mesh->triangle_count;
  umbrella l = {.count = n};
  batten_status st = BATTEN_E_NOMEM;
  edge e;
  unsigned char *on_boundary = batten_alloc(ctx, n);
  uint32_t *order = on_boundary ? batten_alloc_array(ctx, half_edges, sizeof *order) : NULL;
  if (!order || !(l.starts = batten_alloc_array(ctx, n + 1, sizeof *l.starts)) ||
      !(l.back_starts = batten_alloc_array(ctx, n + 1, sizeof *l.back_starts)) ||
      !(l.weight = batten_alloc_array(ctx, n, sizeof *l.weight)))
    goto done;
  st = batten_mesh_sort_edges(ctx, n, mesh->triangle_count, mesh->triangles, order);
  if (st < 0) goto done;
  memset(on_boundary, 0, n);
  for (size_t at = 0; at < half_edges;)
    if (next_edge(half_edges, mesh->triangles, order, &at, &e) && e.boundary) on_boundary[e.a] = on_boundary[e.b] = 1;
  memset(l.starts, 0, (n + 1) * sizeof *l.starts);
  memset(l.back_starts, 0, (n + 1) * sizeof *l.back_starts);
  for (size_t at = 0; at < half_edges;)
    if (next_edge(half_edges, mesh->triangles, order, &at, &e)) add_edge(&l, on_boundary, &e, false);
  for (size_t i = 0; i < n; i++) {
    l.weight[i] = l.starts[i + 1] ? 1 / (double)l.starts[i + 1] : 0;
    l.starts[i + 1] += l.starts[i];
    l.back_starts[i + 1] += l.back_starts[i];
  }
  st = BATTEN_E_NOMEM;
  if (!(l.columns = batten_alloc_array(ctx, l.starts[n], sizeof *l.columns)) ||
      !(l.back = batten_alloc_array(ctx, l.starts[n], sizeof *l.back)))
    goto done;
  for (size_t at = 0; at < half_edges;)
    if (next_edge(half_edges, mesh->triangles, order, &at, &e)) add_edge(&l, on_boundary, &e, true);
  memmove(l.starts + 1, l.starts, n * sizeof *l.starts);
  memmove(l.back_starts + 1, l.back_starts, n * sizeof *l.back_starts);
  l.starts[0] = l.back_starts[0] = 0;
  *out = l;
  l = (umbrella){0};
  st = BATTEN_OK;
done:
  umbrella_free(ctx, &l);
  batten_free(ctx, order);
  batten_free(ctx, on_boundary);
  return st;
}

/* ---- conjugate gradients on three right sides ------------------------------------------------------ */

enum { PART = 4096 }; /* vertices of a task: some 100 us */

typedef struct descent {
  umbrella l;
  double lambda;
  const double *from;        /* of umbrella_part: what L is applied to */
  double *d, *r, *p, *y, *t; /* [count][3]: move, residual, direction, product or preconditioned residual, L p */
  double *diagonal;          /* [count] of L'L */
  double *bend;              /* [count][3] L'L x0 */
  double (*share)[3];        /* [parts] sums of the pass */
  double step[3], mix[3];
} descent;

static size_t parts_of(const descent *s) { return (s->l.count + PART - 1) / PART; }
static size_t part_end(const descent *s, size_t part) {
  return (part + 1) * PART < s->l.count ? (part + 1) * PART : s->l.count;
}

/* t = L from. */
static void umbrella_part(void *arg, size_t part) {
  descent *s = arg;
  const umbrella *l = &s->l;
  for (size_t i = part * PART; i < part_end(s, part); i++) {
    double sum[3] = {0};
    const double *own = s->from + 3 * i;
    for (size_t e = l->starts[i]; e < l->starts[i + 1]; e++) {
      const double *other = s->from + 3 * (size_t)l->columns[e];
      for (int k = 0; k < 3; k++) sum[k] += own[k] - other[k];
    }
    for (int k = 0; k < 3; k++) s->t[3 * i + (size_t)k] = sum[k] * l->weight[i];
  }
}

/* (L't)_i. */
static void back_row(const descent *s, size_t i, double out[3]) {
  const umbrella *l = &s->l;
  for (int k = 0; k < 3; k++) out[k] = l->weight[i] > 0 ? s->t[3 * i + (size_t)k] : 0;
  for (size_t e = l->back_starts[i]; e < l->back_starts[i + 1]; e++) {
    size_t j = l->back[e];
    for (int k = 0; k < 3; k++) out[k] -= l->weight[j] * s->t[3 * j + (size_t)k];
  }
}

/* bend = L't and the diagonal of L'L; sums of bend^2. */
static void bend_part(void *arg, size_t part) {
  descent *s = arg;
  const umbrella *l = &s->l;
  memset(s->share[part], 0, sizeof s->share[part]);
  for (size_t i = part * PART; i < part_end(s, part); i++) {
    back_row(s, i, s->bend + 3 * i);
    s->diagonal[i] = l->weight[i] > 0;
    for (size_t e = l->back_starts[i]; e < l->back_starts[i + 1]; e++)
      s->diagonal[i] += l->weight[l->back[e]] * l->weight[l->back[e]];
    for (int k = 0; k < 3; k++) s->share[part][k] += s->bend[3 * i + (size_t)k] * s->bend[3 * i + (size_t)k];
  }
}

/* y = p + lambda L't, sums of p y. */
static void product_part(void *arg, size_t part) {
  descent *s = arg;
  double sum[3] = {0}, row[3];
  for (size_t i = part * PART; i < part_end(s, part); i++) {
    back_row(s, i, row);
    for (int k = 0; k < 3; k++) {
      size_t at = 3 * i + (size_t)k;
      s->y[at] = s->p[at] + s->lambda * row[k];
      sum[k] += s->p[at] * s->y[at];
    }
  }
  memcpy(s->share[part], sum, sizeof sum);
}

/* r = -lambda bend - (d + lambda L't), t = L d; y = r over the diagonal; sums of r y. */
static void residual_part(void *arg, size_t part) {
  descent *s = arg;
  double sum[3] = {0}, row[3];
  for (size_t i = part * PART; i < part_end(s, part); i++) {
    back_row(s, i, row);
    double inverse = 1 / (1 + s->lambda * s->diagonal[i]);
    for (int k = 0; k < 3; k++) {
      size_t at = 3 * i + (size_t)k;
      s->r[at] = -s->lambda * (s->bend[at] + row[k]) - s->d[at];
      s->y[at] = inverse * s->r[at];
      sum[k] += s->r[at] * s->y[at];
    }
  }
  memcpy(s->share[part], sum, sizeof sum);
}

/* Sums of (lambda bend)^2 over the diagonal: the right side in the norm of the residual. */
static void norm_part(void *arg, size_t part) {
  descent *s = arg;
  double sum[3] = {0};
  for (size_t i = part * PART; i < part_end(s, part); i++) {
    double factor = s->lambda * s->lambda / (1 + s->lambda * s->diagonal[i]);
    for (int k = 0; k < 3; k++) sum[k] += factor * s->bend[3 * i + (size_t)k] * s->bend[3 * i + (size_t)k];
  }
  memcpy(s->share[part], sum, sizeof sum);
}

/* The step along p, y = r over the diagonal; sums of r y. */
static void step_part(void *arg, size_t part) {
  descent *s = arg;
  double sum[3] = {0};
  for (size_t i = part * PART; i < part_end(s, part); i++) {
    double inverse = 1 / (1 + s->lambda * s->diagonal[i]);
    for (int k = 0; k < 3; k++) {
      size_t at = 3 * i + (size_t)k;
      s->d[at] += s->step[k] * s->p[at];
      s->r[at] -= s->step[k] * s->y[at];
      s->y[at] = inverse * s->r[at];
      sum[k] += s->r[at] * s->y[at];
    }
  }
  memcpy(s->share[part], sum, sizeof sum);
}

static void turn_part(void *arg, size_t part) {
  descent *s = arg;
  for (size_t i = part * PART; i < part_end(s, part); i++)
    for (size_t k = 0; k < 3; k++) s->p[3 * i + k] = s->y[3 * i + k] + s->mix[k] * s->p[3 * i + k];
}

/* Sums of d^2. */
static void move_part(void *arg, size_t part) {
  descent *s = arg;
  double sum[3] = {0};
  for (size_t i = part * PART; i < part_end(s, part); i++)
    for (size_t k = 0; k < 3; k++) sum[k] += s->d[3 * i + k] * s->d[3 * i + k];
  memcpy(s->share[part], sum, sizeof sum);
}

static void total(batten_context *ctx, descent *s, void (*pass)(void *arg, size_t part), double sum[3]) {
  batten_parallel(ctx, parts_of(s), pass, s);
  sum[0] = sum[1] = sum[2] = 0;
  for (size_t i = 0; i < parts_of(s); i++)
    for (int k = 0; k < 3; k++) sum[k] += s->share[i][k];
}

static void apply_umbrella(batten_context *ctx, descent *s, const double *from) {
  s->from = from;
  batten_parallel(ctx, parts_of(s), umbrella_part, s);
}

/* The move for s->lambda, from that in s->d. CANCELLED. */
static batten_status solve(batten_context *ctx, descent *s, double fraction) {
  const double TOLERANCE = 1e-9; /* the move's size is wanted to 1e-6 */
  const size_t MOST = 20000;     /* ten times what the largest lambda takes */
  double goal[3], rr[3], curvature[3], next[3];
  total(ctx, s, norm_part, goal);
  for (int k = 0; k < 3; k++) goal[k] *= TOLERANCE * TOLERANCE;
  apply_umbrella(ctx, s, s->d);
  total(ctx, s, residual_part, rr);
  memset(s->p, 0, s->l.count * 3 * sizeof *s->p);
  memset(s->mix, 0, sizeof s->mix);
  for (size_t iteration = 0; iteration < MOST; iteration++) {
    if (rr[0] <= goal[0] && rr[1] <= goal[1] && rr[2] <= goal[2]) break;
    batten_status st = batten_progress(ctx, "smooth", fraction);
    if (st < 0) return st;
    batten_parallel(ctx, parts_of(s), turn_part, s);
    apply_umbrella(ctx, s, s->p);
    total(ctx, s, product_part, curvature);
    for (int k = 0; k < 3; k++) s->step[k] = rr[k] > goal[k] ? rr[k] / curvature[k] : 0;
    total(ctx, s, step_part, next);
    for (int k = 0; k < 3; k++) {
      s->mix[k] = rr[k] > goal[k] ? next[k] / rr[k] : 0;
      rr[k] = next[k];
    }
  }
  return BATTEN_OK;
}

/* ---- the search for lambda ------------------------------------------------------------------------- */

enum { EVALUATIONS = 60 }; /* secants take some 6, halving all decades from 1e-12 to 1e6 some 45 */

/* lambda such that the root mean square of the move is `noise`; the move is in s->d. in_use: vertices. ACCURACY: not
 * even LAMBDA_MOST moves them so far. */
static batten_status search(batten_context *ctx, descent *s, double in_use, double noise, double first) {
  const double LAMBDA_MOST = 1e6, CLOSE = 1e-6;
  double sum[3];
  /* mu = 1 / lambda, g = noise / move - 1: low too far, high not far enough */
  double low = -1, high = -1, g_low = 0, g_high = 0;
  int side = 0;
  s->lambda = fmin(first, LAMBDA_MOST);
  for (unsigned evaluation = 0; evaluation < EVALUATIONS; evaluation++) {
    batten_status st = solve(ctx, s, evaluation / (evaluation + 4.0));
    if (st < 0) return st;
    total(ctx, s, move_part, sum);
    double g = noise / sqrt((sum[0] + sum[1] + sum[2]) / (3 * in_use)) - 1, mu = 1 / s->lambda;
    if (fabs(g) <= CLOSE) return BATTEN_OK;
    if (g > 0) {
      if (s->lambda >= LAMBDA_MOST)
        return batten_fail(ctx, BATTEN_W_ACCURACY,
                           "noise: too large; all but flat, the mesh has moved by %.6g of it; give less",
                           1 / (1 + g));
      if (side > 0) g_low /= 2; /* Illinois */
      high = mu, g_high = g, side = 1;
    } else {
      if (side < 0) g_high /= 2;
      low = mu, g_low = g, side = -1;
    }
    if (low < 0)
      s->lambda = fmin(8 * s->lambda, LAMBDA_MOST);
    else if (high < 0)
      s->lambda /= 8;
    else
      s->lambda = 1 / (low + (high - low) * (-g_low / (g_high - g_low)));
  }
  return batten_fail(ctx, BATTEN_W_ACCURACY, "noise: no lambda moves the mesh by just that; at %g it is near",
                     s->lambda);
}

static bool take(batten_context *ctx, descent *s) {
  size_t n = s->l.count;
  double **arrays[] = {&s->d, &s->r, &s->p, &s->y, &s->t, &s->bend};
  for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
    if (!(*arrays[k] = batten_alloc_array(ctx, n, 3 * sizeof **arrays[k]))) return false;
  return (s->diagonal = batten_alloc_array(ctx, n, sizeof *s->diagonal)) &&
         (s->share = batten_alloc_array(ctx, parts_of(s), sizeof *s->share));
}

static void give_back(batten_context *ctx, descent *s) {
  umbrella_free(ctx, &s->l);
  double *arrays[] = {s->d, s->r, s->p, s->y, s->t, s->bend, s->diagonal};
  for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++) batten_free(ctx, arrays[k]);
  batten_free(ctx, s->share);
}

/* Moves [V][3] of the vertices, in s->d, and lambda, for coordinates `points` times `unit`. */
static batten_status find_move(batten_context *ctx, descent *s, const double *points, double unit, double noise,
                               double *scaled) {
  size_t n = s->l.count;
  double in_use = 0, sum[3];
  for (size_t i = 0; i < n; i++) in_use += s->l.weight[i] > 0;
  for (size_t k = 0; k < 3 * n; k++) scaled[k] = points[k] * unit;
  memset(s->d, 0, n * 3 * sizeof *s->d);
  apply_umbrella(ctx, s, scaled);
  total(ctx, s, bend_part, sum);
  /* the first term of the move in lambda: too short a guess */
  double bend = in_use > 0 ? sqrt((sum[0] + sum[1] + sum[2]) / (3 * in_use)) : 0;
  if (!(bend > 0))
    return batten_fail(ctx, BATTEN_W_ACCURACY, "noise: %g, but the mesh is smooth as it is", noise / unit);
  return search(ctx, s, in_use, noise, noise / bend);
}

static batten_status copy_mesh(batten_context *ctx, const batten_mesh *mesh, const double *vertices,
                               batten_mesh **out) {
  batten_mesh *copy;
  batten_status st =
      batten_mesh_create(ctx, mesh->vertex_count, vertices, mesh->triangle_count, mesh->triangles, &copy);
  if (st < 0) return st;
  for (size_t i = 0; i < mesh->field_count && st == BATTEN_OK; i++)
    st = batten_mesh_set_field(ctx, copy, mesh->fields[i].name, mesh->fields[i].components, mesh->fields[i].values);
  if (st < 0)
    batten_mesh_free(copy);
  else
    *out = copy;
  return st;
}

batten_status batten_mesh_smooth(batten_context *ctx, const batten_mesh *mesh, double noise, batten_mesh **out,
                                 double *lambda) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!mesh || !out)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give %s", mesh ? "out" : "mesh",
                       mesh ? "the address of the result" : "a mesh");
  if (!(noise > 0) || !isfinite(noise))
    return batten_fail(ctx, BATTEN_E_INVALID, "noise: %g; give the standard deviation along an axis, above 0", noise);
  size_t n = mesh->vertex_count;
  descent s = {0};
  double *moved = NULL, size = batten_mesh_size(n, mesh->vertices), unit = size > 0 ? batten_unit(size) : 1;
  batten_status st = umbrella_make(ctx, mesh, &s.l), made;
  if (st < 0) goto done;
  st = BATTEN_E_NOMEM;
  if (!take(ctx, &s) || !(moved = batten_alloc_array(ctx, n, 3 * sizeof *moved))) goto done;
  st = find_move(ctx, &s, mesh->vertices, unit, noise * unit, moved);
  if (st < 0) goto done;
  for (size_t k = 0; k < 3 * n; k++) moved[k] = mesh->vertices[k] + s.d[k] / unit;
  made = copy_mesh(ctx, mesh, moved, out);
  if (made < 0)
    st = made;
  else if (lambda)
    *lambda = s.lambda;
done:
  batten_free(ctx, moved);
  give_back(ctx, &s);
  return st;
}
