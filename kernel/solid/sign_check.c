/* The check of a solid's sign field: the data say where f = 0, not on which side f is positive.
 *
 *   far away    f on spheres about the data must be negative; when it is positive on most of the farthest, the whole
 *               solid is inside out
 *   at the data f must change sign along its gradient at each point, and the gradients of neighbours whose
 *               displacement lies in both tangent planes must not oppose each other
 *   between     on a grid over the grown box of the data, each connected piece of f = 0 must have data on it, and no
 *               part of it may be farther from all data than a few local spacings
 *
 * A grid cannot see what is thinner than a cell, so pieces of f = 0 count as having data when these are near. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/checked.h"
#include "solid/solid_inner.h"

/* ---- far away ------------------------------------------------------------------------------------ */

enum { DIRECTIONS = 64, SHELLS = 4 };
/* In half diagonals of the data's box: from just outside to where only the growth of the spline counts. */
static const double SHELL_RADII[SHELLS] = {1.5, 3, 10, 50};

/* Well-spread unit vectors: a circle, or a spiral on the sphere. */
static void direction(unsigned n, size_t i, size_t of, double *v) {
  const double golden = 2.399963229728653; /* angle that fills the circle most evenly */
  double z = n == 3 ? 1 - (2.0 * (double)i + 1) / (double)of : 0, r = sqrt(1 - z * z);
  double angle = n == 3 ? golden * (double)i : 2 * 3.141592653589793 * ((double)i + 0.5) / (double)of;
  v[0] = n == 1 ? (i % 2 ? -1 : 1) : r * cos(angle);
  if (n > 1) v[1] = r * sin(angle);
  if (n > 2) v[2] = z;
}

/* positive[s]: how many of the DIRECTIONS samples of shell s are inside. */
static batten_status look_far(batten_context *ctx, const surface_data *d, const batten_solid *s, size_t *positive) {
  size_t n = d->n, count = (size_t)DIRECTIONS * SHELLS;
  double *x = batten_alloc_array(ctx, count, n * sizeof *x), *f = batten_alloc_array(ctx, count, sizeof *f);
  batten_status st = x && f ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t i = 0; st >= 0 && i < count; i++) {
    direction(d->n, i % DIRECTIONS, DIRECTIONS, x + i * n);
    for (size_t k = 0; k < n; k++)
      x[i * n + k] = d->middle[k] + SHELL_RADII[i / DIRECTIONS] * d->radius * x[i * n + k];
  }
  if (st >= 0) st = batten_solid_evaluate(ctx, s, count, x, f, NULL, NULL);
  if (st >= 0) {
    memset(positive, 0, SHELLS * sizeof *positive);
    for (size_t i = 0; i < count; i++) positive[i / DIRECTIONS] += f[i] >= 0;
  }
  batten_free(ctx, x);
  batten_free(ctx, f);
  return st;
}

/* ---- at the data --------------------------------------------------------------------------------- */

static double dot(size_t n, const double *a, const double *b) {
  double sum = 0;
  for (size_t k = 0; k < n; k++) sum += a[k] * b[k];
  return sum;
}

static int compare_doubles(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

/* Step off the surface, in local spacings: outside the tip that r and r^2 ln r have at a centre, inside the shape. */
static const double PROBE = 0.1;

/* A point and its two probes. */
typedef struct probes {
  const surface_data *data;
  const double *unit; /* [count][n] gradients of length 1, or 0 where they are under 1 % of the median */
  double *x;          /* [count][2][n] */
  double *at, *f;     /* [count] f at the points, [count][2] at the probes */
} probes;

static bool is_strong(const probes *p, size_t i) {
  return dot(p->data->n, p->unit + i * p->data->n, p->unit + i * p->data->n) > 0;
}

/* at: 0 but for smoothing */
static bool changes_sign(double at, const double *f) { return f[0] > at && f[1] < at; }

/* Fast sums may be too coarse for points that nearly coincide, whose probes are as near: such that seem weak are
 * summed directly, as long as these sums are few. */
static batten_status sum_again(batten_context *ctx, const batten_solid *s, const batten_solid_evaluator *e,
                               const probes *p) {
  const size_t n = p->data->n, count = p->data->count;
  size_t weak = 0, taken = 0;
  if (batten_solid_evaluator_get_info(e).method == BATTEN_EVALUATE_DIRECT) return BATTEN_OK;
  for (size_t i = 0; i < count; i++) weak += is_strong(p, i) && !changes_sign(p->at[i], p->f + 2 * i);
  if (weak == 0 || weak > batten_solid_points_to_sum(s, count)) return BATTEN_OK;
  double *x = batten_alloc_array(ctx, weak, 3 * (n + 1) * sizeof *x), *f = x ? x + 3 * n * weak : NULL;
  size_t *which = batten_alloc_array(ctx, weak, sizeof *which);
  batten_status st = x && which ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t i = 0; st >= 0 && i < count; i++) {
    if (!is_strong(p, i) || changes_sign(p->at[i], p->f + 2 * i)) continue;
    memcpy(x + 3 * n * taken, p->data->points + i * n, n * sizeof *x);
    memcpy(x + 3 * n * taken + n, p->x + 2 * i * n, 2 * n * sizeof *x);
    which[taken++] = i;
  }
  if (st >= 0) st = batten_solid_evaluate(ctx, s, 3 * weak, x, f, NULL, NULL);
  for (size_t j = 0; st >= 0 && j < weak; j++) {
    p->at[which[j]] = f[3 * j];
    memcpy(p->f + 2 * which[j], f + 3 * j + 1, 2 * sizeof *f);
  }
  batten_free(ctx, which);
  batten_free(ctx, x);
  return st;
}

/* Unit gradients at the points, length 0 where they are weak: under 1 % of the median, or without a change of sign
 * along them. */
static batten_status gradients_at_data(batten_context *ctx, const surface_data *d, const batten_solid *s,
                                       batten_solid_evaluator *e, double *unit, size_t *weak) {
  size_t n = d->n, count = d->count;
  double *length = batten_alloc_array(ctx, count, 2 * sizeof *length), *sorted = length ? length + count : NULL;
  double *x = batten_alloc_array(ctx, count, 2 * n * sizeof *x);
  double *f = batten_alloc_array(ctx, count, 3 * sizeof *f), *at = f ? f + 2 * count : NULL;
  probes p = {d, unit, x, at, f};
  batten_status st = length && x && f ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0) st = batten_solid_evaluator_evaluate(ctx, e, count, d->points, at, unit);
  if (st < 0) goto done;
  for (size_t i = 0; i < count; i++) sorted[i] = length[i] = sqrt(dot(n, unit + i * n, unit + i * n));
  qsort(sorted, count, sizeof *sorted, compare_doubles);
  double least = 0.01 * sorted[count / 2];
  for (size_t i = 0; i < count; i++) {
    bool strong = length[i] > least;
    for (size_t k = 0; k < n; k++) {
      double u = strong ? unit[i * n + k] / length[i] : 0, y = d->points[i * n + k], h = PROBE * d->spacing[i];
      unit[i * n + k] = u;
      x[2 * i * n + k] = y + h * u;
      x[(2 * i + 1) * n + k] = y - h * u;
    }
  }
  st = batten_solid_evaluator_evaluate(ctx, e, 2 * count, x, f, NULL);
  if (st >= 0) st = sum_again(ctx, s, e, &p);
  if (st < 0) goto done;
  *weak = 0;
  for (size_t i = 0; i < count; i++) {
    if (is_strong(&p, i) && changes_sign(at[i], f + 2 * i)) continue;
    (*weak)++;
    for (size_t k = 0; k < n; k++) unit[i * n + k] = 0;
  }
done:
  batten_free(ctx, length);
  batten_free(ctx, x);
  batten_free(ctx, f);
  return st;
}

enum { NEIGHBOURS = 6 };

static size_t count_flipped(const surface_data *d, size_t k, const size_t *index, const double *distance,
                            const double *unit) {
  size_t n = d->n, flipped = 0;
  for (size_t i = 0; i < d->count; i++)
    for (size_t j = 0; j < k; j++) {
      size_t o = index[i * k + j];
      const double *a = unit + i * n, *b = unit + o * n;
      double along_a = 0, along_b = 0, step = distance[i * k + j];
      if (dot(n, a, b) > -0.5) continue; /* within 120 degrees of each other */
      for (size_t c = 0; c < n; c++) {
        double e = (d->points[o * n + c] - d->points[i * n + c]) / step;
        along_a += e * a[c];
        along_b += e * b[c];
      }
      /* Displacements within 30 degrees of both tangent planes: not two sides of something thin. */
      flipped += fabs(along_a) < 0.5 && fabs(along_b) < 0.5;
    }
  return flipped;
}

static batten_status check_data(batten_context *ctx, const surface_data *d, const batten_solid *s,
                                batten_solid_evaluator *e, batten_sign_check *out) {
  size_t k = d->n == 3 ? NEIGHBOURS : 2;
  if (k > d->count - 1) k = d->count - 1;
  double *unit = batten_alloc_array(ctx, d->count, d->n * sizeof *unit);
  size_t *index = batten_alloc_array(ctx, d->count, k * sizeof *index);
  double *distance = batten_alloc_array(ctx, d->count, k * sizeof *distance);
  batten_status st = unit && index && distance ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0) st = gradients_at_data(ctx, d, s, e, unit, &out->weak_gradients);
  if (st >= 0) st = batten_tree_neighbours(ctx, d->tree, k, index, distance);
  if (st >= 0) out->flipped_neighbours = count_flipped(d, k, index, distance, unit);
  batten_free(ctx, unit);
  batten_free(ctx, index);
  batten_free(ctx, distance);
  return st;
}

/* ---- between the data ---------------------------------------------------------------------------- */

/* Nodes lower + cell * (i, j, k), i fastest; cells are named by their lowest node. In the plane one layer k. */
typedef struct check_grid {
  unsigned n;
  size_t nodes[3], total;
  double lower[3], cell;
  unsigned char *inside; /* [total] */
  uint32_t *piece;       /* [total] of a cell: NOT_CROSSED, CROSSED, or FIRST_PIECE + its number */
} check_grid;

enum { NOT_CROSSED = 0, CROSSED = 1, FIRST_PIECE = 2 };

/* Grown so that a sheet just outside of the data is seen. */
static const double MARGIN = 0.2;

static batten_status lay_grid(batten_context *ctx, const surface_data *d, size_t cells, check_grid *g) {
  double longest = 0;
  for (unsigned k = 0; k < d->n; k++) longest = fmax(longest, d->upper[k] - d->lower[k]);
  g->n = d->n;
  g->cell = longest / (double)cells;
  g->total = 1;
  for (unsigned k = 0; k < 3; k++) {
    g->nodes[k] = 1;
    if (k >= d->n) continue;
    double extent = d->upper[k] - d->lower[k] + 2 * MARGIN * longest;
    size_t along = (size_t)(extent / g->cell) + 1;
    g->nodes[k] = along + 1;
    g->lower[k] = d->middle[k] - 0.5 * g->cell * (double)along;
    if (!batten_mul(g->total, g->nodes[k], &g->total)) break;
  }
  if (g->total >= UINT32_MAX - FIRST_PIECE)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "opt.check_cells: %zu; give fewer", cells);
  g->inside = batten_alloc_array(ctx, g->total, 1);
  g->piece = batten_alloc_array(ctx, g->total, sizeof *g->piece);
  return g->inside && g->piece ? BATTEN_OK : BATTEN_E_NOMEM;
}

static void node_place(const check_grid *g, size_t node, double shift, double *x) {
  size_t at[3] = {node % g->nodes[0], node / g->nodes[0] % g->nodes[1], node / g->nodes[0] / g->nodes[1]};
  for (unsigned k = 0; k < g->n; k++) x[k] = g->lower[k] + g->cell * ((double)at[k] + shift);
}

/* Signs at all nodes, a few thousand at a time so that the host can cancel. */
static batten_status fill_signs(batten_context *ctx, batten_solid_evaluator *e, check_grid *g) {
  enum { BATCH = 8192 };
  size_t n = g->n;
  double *x = batten_alloc_array(ctx, BATCH, n * sizeof *x), *f = batten_alloc_array(ctx, BATCH, sizeof *f);
  batten_status st = x && f ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t first = 0; st >= 0 && first < g->total; first += BATCH) {
    size_t now = g->total - first < BATCH ? g->total - first : BATCH;
    for (size_t i = 0; i < now; i++) node_place(g, first + i, 0, x + i * n);
    st = batten_progress(ctx, "sign check", (double)first / (double)g->total);
    if (st >= 0) st = batten_solid_evaluator_evaluate(ctx, e, now, x, f, NULL);
    for (size_t i = 0; st >= 0 && i < now; i++) g->inside[first + i] = f[i] >= 0;
  }
  batten_free(ctx, x);
  batten_free(ctx, f);
  return st;
}

static size_t mark_crossed(check_grid *g) {
  size_t crossed = 0, corners = (size_t)1 << g->n;
  memset(g->piece, 0, g->total * sizeof *g->piece);
  for (size_t node = 0; node < g->total; node++) {
    size_t at[3] = {node % g->nodes[0], node / g->nodes[0] % g->nodes[1], node / g->nodes[0] / g->nodes[1]}, in = 0;
    bool cell = true;
    for (unsigned k = 0; k < g->n; k++) cell = cell && at[k] + 1 < g->nodes[k];
    if (!cell) continue;
    for (size_t c = 0; c < corners; c++)
      in += g->inside[node + (c & 1) + (c >> 1 & 1) * g->nodes[0] + (c >> 2 & 1) * g->nodes[0] * g->nodes[1]];
    if (in == 0 || in == corners) continue;
    g->piece[node] = CROSSED;
    crossed++;
  }
  return crossed;
}

/* The cells around one (itself too), those that are in the grid: at most 27. */
static size_t around(const check_grid *g, size_t node, size_t *out) {
  size_t at[3] = {node % g->nodes[0], node / g->nodes[0] % g->nodes[1], node / g->nodes[0] / g->nodes[1]}, found = 0;
  size_t low[3], high[3];
  for (unsigned k = 0; k < 3; k++) {
    low[k] = at[k] > 0 ? at[k] - 1 : 0;
    high[k] = at[k] + 1 < g->nodes[k] ? at[k] + 1 : at[k];
  }
  for (size_t k = low[2]; k <= high[2]; k++)
    for (size_t j = low[1]; j <= high[1]; j++)
      for (size_t i = low[0]; i <= high[0]; i++) out[found++] = i + g->nodes[0] * (j + g->nodes[1] * k);
  return found;
}

/* Numbers the connected pieces of crossed cells; list [crossed] gets the cells, piece by piece. */
static size_t number_pieces(check_grid *g, size_t *list) {
  size_t pieces = 0, filled = 0, near[27];
  for (size_t node = 0; node < g->total; node++) {
    if (g->piece[node] != CROSSED) continue;
    size_t next = filled;
    g->piece[node] = (uint32_t)(FIRST_PIECE + pieces);
    list[filled++] = node;
    for (; next < filled; next++) {
      size_t found = around(g, list[next], near);
      for (size_t j = 0; j < found; j++)
        if (g->piece[near[j]] == CROSSED) {
          g->piece[near[j]] = (uint32_t)(FIRST_PIECE + pieces);
          list[filled++] = near[j];
        }
    }
    pieces++;
  }
  return pieces;
}

static size_t cell_of(const check_grid *g, const double *x) {
  size_t at[3] = {0, 0, 0};
  for (unsigned k = 0; k < g->n; k++) at[k] = (size_t)((x[k] - g->lower[k]) / g->cell); /* data lie well inside */
  return at[0] + g->nodes[0] * (at[1] + g->nodes[1] * at[2]);
}

/* Gaps from the nearest point beyond which no f = 0 is due, by dimension. A contour passes half a gap from a point,
 * and bulges. Of points scattered at random on a surface the widest hole has 1.7 mean spacings to its rim (N = 1000);
 * measured on spheres and bodies of 60 to 1000 points: with 2.5, 3 cells at most of some 5000 are beyond. */
static const double REACH[3] = {1, 1, 2.5};

typedef struct cell_query {
  const check_grid *grid;
  const surface_data *data;
  const size_t *list;
  size_t count;
  double *
      excess; /* [count][2] distance to the nearest point over 1 and REACH of its gaps, less half a cell's diagonal */
} cell_query;

enum { CELLS_PER_TASK = 512 };

static void query_cells(void *arg, size_t block) {
  const cell_query *q = arg;
  size_t last = (block + 1) * CELLS_PER_TASK;
  if (last > q->count) last = q->count;
  double half_diagonal = 0.5 * q->grid->cell * sqrt(q->grid->n);
  for (size_t i = block * CELLS_PER_TASK; i < last; i++) {
    double x[3], distance;
    size_t nearest;
    node_place(q->grid, q->list[i], 0.5, x);
    batten_tree_nearest(q->data->tree, x, 1, SIZE_MAX, &nearest, &distance);
    q->excess[2 * i] = distance - half_diagonal - q->data->gap[nearest];
    q->excess[2 * i + 1] = distance - half_diagonal - REACH[q->grid->n - 1] * q->data->gap[nearest];
  }
}

/* lonely [pieces] scratch. A piece has data when a point lies in or beside one of its cells, or within its spacing.
 */
static void count_phantoms(const check_grid *g, const surface_data *d, const cell_query *q, size_t pieces,
                           unsigned char *lonely, batten_sign_check *out) {
  size_t near[27];
  memset(lonely, 1, pieces);
  for (size_t i = 0; i < d->count; i++) {
    size_t found = around(g, cell_of(g, d->points + i * d->n), near);
    for (size_t j = 0; j < found; j++)
      if (g->piece[near[j]] >= FIRST_PIECE) lonely[g->piece[near[j]] - FIRST_PIECE] = 0;
  }
  for (size_t i = 0; i < q->count; i++) {
    if (q->excess[2 * i] <= 0) lonely[g->piece[q->list[i]] - FIRST_PIECE] = 0;
    out->phantom_cells += q->excess[2 * i + 1] > 0;
  }
  for (size_t p = 0; p < pieces; p++) out->phantom_components += lonely[p];
}

static batten_status check_between(batten_context *ctx, const surface_data *d, size_t cells,
                                   batten_solid_evaluator *e, size_t *crossed_cells, batten_sign_check *out) {
  check_grid g = {0};
  size_t *list = NULL;
  double *excess = NULL;
  unsigned char *lonely = NULL;
  batten_status st = lay_grid(ctx, d, cells, &g);
  if (st >= 0) st = fill_signs(ctx, e, &g);
  if (st < 0) goto done;
  size_t crossed = *crossed_cells = mark_crossed(&g);
  st = BATTEN_E_NOMEM;
  list = batten_alloc_array(ctx, crossed, sizeof *list);
  excess = batten_alloc_array(ctx, crossed, 2 * sizeof *excess);
  if (!list || !excess) goto done;
  size_t pieces = number_pieces(&g, list);
  lonely = batten_alloc_array(ctx, pieces, 1);
  if (!lonely) goto done;
  cell_query q = {&g, d, list, crossed, excess};
  batten_parallel(ctx, (crossed + CELLS_PER_TASK - 1) / CELLS_PER_TASK, query_cells, &q);
  count_phantoms(&g, d, &q, pieces, lonely, out);
  st = BATTEN_OK;
done:
  batten_free(ctx, list);
  batten_free(ctx, excess);
  batten_free(ctx, lonely);
  batten_free(ctx, g.inside);
  batten_free(ctx, g.piece);
  return st;
}

/* Part of the crossed cells that may be far from data in a clean field. */
static const double STRAY_CELLS = 0.002;

batten_status batten_solid_check_sign(batten_context *ctx, const surface_data *d, size_t cells, int may_turn,
                                      batten_solid *s, batten_solid_evaluator *e, batten_sign_check *out) {
  batten_sign_check check = {0};
  size_t positive[SHELLS], crossed = 0;
  batten_status st = look_far(ctx, d, s, positive);
  if (st < 0) return st;
  if (may_turn && positive[SHELLS - 1] > DIRECTIONS / 2) {
    s->sign = -s->sign;
    check.inside_out = 1;
    for (size_t i = 0; i < SHELLS; i++) positive[i] = DIRECTIONS - positive[i];
  }
  if (d->n > 1) st = check_data(ctx, d, s, e, &check);
  if (st >= 0 && d->n > 1) st = check_between(ctx, d, cells, e, &crossed, &check);
  if (st < 0) return st;
  /* A sheet that nobody asked for takes many cells; a few are where samples happen to lie far apart. */
  bool few = (double)check.phantom_cells <= STRAY_CELLS * (double)crossed, bounded = true;
  for (size_t i = 0; i < SHELLS; i++) {
    bounded = bounded && positive[i] == 0;
    check.phantom_cells += positive[i];
  }
  check.clean =
      check.weak_gradients == 0 && check.flipped_neighbours == 0 && check.phantom_components == 0 && few && bounded;
  *out = check;
  return BATTEN_OK;
}
