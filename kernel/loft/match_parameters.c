/* Parameters of points: monotone functions of the length that lead inflections to their lines.
 *
 * Turned round, s = t + d_i(t) tells where on slice i parameter t lies; lines of equal t run through all slices. At
 * nodes t_m, the lines of tracks among them, d is given where the slice has that inflection, and elsewhere least is
 *   sum_i  integral d_i'^2  +  COUPLING integral (d_(i+1) - d_i)^2  +  ANCHOR integral (d_i - origin)^2:
 * parameters run as evenly as inflections allow, also from slice to slice where tracks end. A slice whose s would not
 * ascend, or nearly so, is blended with even steps between its inflections; and t(s) is the monotone cubic through
 * the nodes [Fritsch, Carlson 1980: Monotone piecewise cubic interpolation]. */
#include <string.h>

#include "base/checked.h"
#include "match.h"
#include "sparse/block.h"

enum { CELLS = 64 }; /* at least */
static const double COUPLING = 30, ANCHOR = 0.05;
static const double LEAST_STEP = 0.25; /* parts of even ones */

/* ---- inflections in t --------------------------------------------------------------------------- */

static double t_of(const match_stack *s, const match_bend *b) { return s->t[s->line[b->track]]; }

/* The first one by t; of none 0. */
static size_t first_bend(const match_stack *s, const match_slice *slice) {
  size_t first = 0;
  for (size_t j = 1; j < slice->bend_count; j++)
    if (t_of(s, slice->bends + j) < t_of(s, slice->bends + first)) first = j;
  return first;
}

void match_inflections(const match_stack *s, size_t i, double *inflections, int *sign) {
  const match_slice *slice = s->slices + i;
  size_t n = slice->bend_count, first = first_bend(s, slice);
  for (size_t j = 0; j < n; j++) inflections[j] = t_of(s, slice->bends + (first + j) % n);
  *sign = n > 0 ? -slice->bends[first].sign : slice->sign;
}

/* ---- nodes ---------------------------------------------------------------------------------------- */

/* Nodes t_0 = 0 .. t_cells = 1; closed: the last is the first. d [count][cells + 1]. */
typedef struct grid {
  size_t cells;
  double *t; /* [cells + 1] */
  double *d;
  bool *given;     /* of d */
  uint32_t *place; /* of d: number among the unknowns */
} grid;

static void grid_free(batten_context *ctx, grid *g) {
  batten_free(ctx, g->place);
  batten_free(ctx, g->given);
  batten_free(ctx, g->d);
  batten_free(ctx, g->t);
  *g = (grid){0};
}

/* Equal steps between neighbouring lines. */
static void fill_nodes(const match_stack *s, grid *g) {
  double from = 0;
  g->cells = 0;
  for (size_t k = 0; k <= s->line_count; k++) {
    double to = k < s->line_count ? s->t[k] : 1;
    size_t steps = (size_t)ceil((to - from) * CELLS);
    if (steps == 0) steps = 1;
    for (size_t j = 0; j < steps; j++) {
      double part = (double)j / (double)steps;
      g->t[g->cells++] = (1 - part) * from + part * to;
    }
    from = to;
  }
  g->t[g->cells] = 1;
}

static batten_status grid_new(batten_context *ctx, const match_stack *s, grid *g) {
  size_t room = CELLS + 2 * s->line_count + 3, nodes;
  g->t = batten_alloc_array(ctx, room, sizeof *g->t);
  if (!g->t) return BATTEN_E_NOMEM;
  fill_nodes(s, g);
  batten_mul(s->count, g->cells + 1, &nodes);
  g->d = batten_alloc_array(ctx, nodes, sizeof *g->d);
  g->given = batten_alloc_array(ctx, nodes, sizeof *g->given);
  g->place = batten_alloc_array(ctx, nodes, sizeof *g->place);
  if (!g->d || !g->given || !g->place) return BATTEN_E_NOMEM;
  for (size_t k = 0; k < nodes; k++) {
    size_t m = k % (g->cells + 1);
    g->given[k] = !s->closed && (m == 0 || m == g->cells);
    g->d[k] = s->origin;
  }
  for (size_t i = 0; i < s->count; i++)
    for (size_t j = 0, m = 0, n = s->slices[i].bend_count; j < n; j++) {
      const match_bend *b = s->slices[i].bends + (first_bend(s, s->slices + i) + j) % n;
      while (g->t[m] < t_of(s, b)) m++;
      g->given[i * (g->cells + 1) + m] = true;
      g->d[i * (g->cells + 1) + m] = b->at + b->lift - t_of(s, b);
    }
  return BATTEN_OK;
}

/* ---- the smoothest displacements ------------------------------------------------------------------ */

/* What a pair of nodes adds: weight (d_b - d_a)^2. Without matrix: pairs of unknowns are noted. */
typedef struct assembly {
  const grid *g;
  block_matrix *matrix;
  double *right;
  uint32_t *pairs;
  size_t pair_count;
} assembly;

static void add_pair(assembly *s, size_t a, size_t b, double weight) {
  const grid *g = s->g;
  if (g->given[a] && g->given[b]) return;
  if (!s->matrix) {
    if (g->given[a] || g->given[b]) return;
    s->pairs[2 * s->pair_count] = g->place[a];
    s->pairs[2 * s->pair_count++ + 1] = g->place[b];
    return;
  }
  for (int side = 0; side < 2; side++) {
    size_t own = side ? b : a, other = side ? a : b;
    if (g->given[own]) continue;
    *block_matrix_at(s->matrix, g->place[own], g->place[own]) += weight;
    if (g->given[other])
      s->right[g->place[own]] += weight * g->d[other];
    else
      *block_matrix_at(s->matrix, g->place[own], g->place[other]) -= weight;
  }
}

/* Length of t that node m stands for. */
static double share(const match_stack *s, const grid *g, size_t m) {
  double before = m > 0 ? g->t[m] - g->t[m - 1] : s->closed ? 1 - g->t[g->cells - 1] : 0;
  return 0.5 * (before + (m < g->cells ? g->t[m + 1] - g->t[m] : 0));
}

static void assemble(const match_stack *s, assembly *a) {
  const grid *g = a->g;
  size_t row = g->cells + 1, nodes = s->closed ? g->cells : row;
  for (size_t i = 0; i < s->count; i++) {
    for (size_t m = 0; m < g->cells; m++) {
      size_t next = s->closed && m + 1 == g->cells ? 0 : m + 1;
      add_pair(a, i * row + m, i * row + next, 1 / (g->t[m + 1] - g->t[m]));
    }
    for (size_t m = 0; m < nodes; m++) {
      size_t at = i * row + m;
      if (i + 1 < s->count) add_pair(a, at, at + row, COUPLING * share(s, g, m));
      if (!a->matrix || g->given[at]) continue;
      *block_matrix_at(a->matrix, g->place[at], g->place[at]) += ANCHOR * share(s, g, m);
      a->right[g->place[at]] += ANCHOR * share(s, g, m) * s->origin;
    }
  }
}

static batten_status smooth(batten_context *ctx, const match_stack *s, grid *g) {
  size_t row = g->cells + 1, nodes = s->closed ? g->cells : row, unknowns = 0;
  assembly a = {.g = g};
  block_matrix matrix = {0};
  block_plan *plan = NULL;
  batten_status st = BATTEN_E_NOMEM;
  for (size_t i = 0; i < s->count; i++)
    for (size_t m = 0; m < nodes; m++)
      if (!g->given[i * row + m]) g->place[i * row + m] = (uint32_t)unknowns++;
  a.pairs = batten_alloc_array(ctx, s->count * row, 4 * sizeof *a.pairs);
  a.right = batten_alloc_array(ctx, unknowns, sizeof *a.right);
  if (!a.pairs || !a.right) goto done;
  memset(a.right, 0, unknowns * sizeof *a.right);
  assemble(s, &a);
  st = block_matrix_new(ctx, unknowns, 1, a.pair_count, a.pairs, &matrix);
  if (st < 0) goto done;
  a.matrix = &matrix;
  assemble(s, &a);
  st = block_plan_new(ctx, &matrix, BLOCK_AUTO, &plan);
  if (st >= 0) st = block_factor(ctx, plan, &matrix, NULL);
  if (st < 0) goto done;
  block_solve(ctx, plan, a.right);
  for (size_t i = 0; i < s->count; i++) {
    for (size_t m = 0; m < nodes; m++)
      if (!g->given[i * row + m]) g->d[i * row + m] = a.right[g->place[i * row + m]];
    if (s->closed) g->d[i * row + g->cells] = g->d[i * row];
  }
done:
  block_plan_free(ctx, plan);
  block_matrix_free(ctx, &matrix);
  batten_free(ctx, a.right);
  batten_free(ctx, a.pairs);
  return st;
}

/* ---- one slice ------------------------------------------------------------------------------------ */

/* Steps of s = t + d from node `from` to node `to`, past the end of closed slices: no shorter than a part of even
 * ones. */
static void even_out(const grid *g, double *s, size_t from, size_t to) {
  size_t n = g->cells;
  double width = 0, way = 0, blend = 0;
#define STEP_T(m) (g->t[(m) % n + 1] - g->t[(m) % n])
#define STEP_S(m) (s[(m) + 1] - s[m])
  for (size_t m = from; m < to; m++) width += STEP_T(m);
  way = s[to] - s[from];
  for (size_t m = from; m < to; m++) {
    double even = way * STEP_T(m) / width, own = STEP_S(m);
    if (own < LEAST_STEP * even) blend = fmax(blend, (LEAST_STEP * even - own) / (even - own));
  }
  double at = s[from], last = at;
  for (size_t m = from; m + 1 < to && blend > 0; m++) {
    double own = s[m + 1] - last;
    last = s[m + 1];
    at += (1 - blend) * own + blend * way * STEP_T(m) / width;
    s[m + 1] = at;
  }
#undef STEP_S
#undef STEP_T
}

/* s [2 cells + 1] at the nodes of one turn, and closed: of the next, ascending. */
static void fill_slice(const match_stack *stack, const grid *g, size_t i, double *s) {
  size_t n = g->cells, nodes = stack->closed ? 2 * n : n, first = MATCH_NONE, last = 0;
  const double *d = g->d + i * (n + 1);
  const bool *given = g->given + i * (n + 1);
  for (size_t m = 0; m <= nodes; m++) {
    size_t k = stack->closed ? m % n : m;
    s[m] = g->t[k] + d[k] + (double)(m / n) * (stack->closed ? 1 : 0);
  }
  for (size_t m = 0; m <= nodes; m++) {
    if (!given[stack->closed ? m % n : m]) continue;
    if (first == MATCH_NONE)
      first = m;
    else
      even_out(g, s, last, m);
    last = m;
  }
  if (first == MATCH_NONE) {
    even_out(g, s, 0, n); /* any node is as good: what follows is the same turn */
    first = 0;
  }
  for (size_t m = 0; m < first && stack->closed; m++) s[m] = s[m + n] - 1;
  for (size_t m = first + n + 1; m <= nodes && stack->closed; m++) s[m] = s[m - n] + 1;
}

/* Slope dt/ds at node m of [0, n], from those of the steps beside it: their weighted harmonic mean, so that the
 * cubics are monotone. */
static double slope(const grid *g, const double *s, bool closed, size_t m) {
  size_t n = g->cells, before = m > 0 ? m - 1 : n - 1, after = m < n ? m : 0;
  if (!closed && m == 0) before = 0;
  if (!closed && m == n) after = n - 1;
  double h = s[before + 1] - s[before], k = s[after + 1] - s[after];
  double p = (g->t[before + 1] - g->t[before]) / h, q = (g->t[after + 1] - g->t[after]) / k;
  return 3 * (h + k) / ((h + 2 * k) / p + (2 * h + k) / q);
}

static double cubic(const grid *g, const double *s, bool closed, size_t m, double at) {
  double h = s[m + 1] - s[m], x = fmin(1, fmax(0, (at - s[m]) / h)), y = 1 - x, rise = g->t[m + 1] - g->t[m];
  double a = slope(g, s, closed, m) * h, b = slope(g, s, closed, m + 1) * h;
  double t = g->t[m] + x * x * (3 - 2 * x) * rise + x * y * (y * a - x * b);
  return fmin(g->t[m + 1], fmax(g->t[m], t));
}

/* Parameters of the points at lengths, in [0, 1); their order may begin anywhere. */
static void map_points(const match_stack *stack, const grid *g, const double *s, match_slice *slice) {
  for (size_t i = 0, m = 0; i < slice->count; i++) {
    double at = slice->lengths[i];
    if (stack->closed) at -= floor(at - s[0]);
    if (at < s[m]) m = 0;
    while (m + 1 < g->cells && s[m + 1] <= at) m++;
    slice->parameters[i] = cubic(g, s, stack->closed, m, at);
  }
}

/* Points from the one of least parameter on; those whose parameter falls below the one before, by rounding, get its.
 */
static void rotate_points(match_slice *slice, bool closed, double *room) {
  size_t n = slice->count, first = 0;
  for (size_t i = 1; i < n && closed; i++)
    if (slice->parameters[i] < slice->parameters[i - 1]) first = i;
  struct {
    double *values;
    size_t width;
  } blocks[] = {{slice->points, 2}, {slice->weights, 1}, {slice->lengths, 1}, {slice->parameters, 1}};
  for (size_t b = 0; b < sizeof blocks / sizeof *blocks; b++) {
    size_t w = blocks[b].width;
    if (!blocks[b].values || first == 0) continue;
    memcpy(room, blocks[b].values, n * w * sizeof *room);
    for (size_t i = 0; i < n; i++) memcpy(blocks[b].values + w * i, room + w * ((first + i) % n), w * sizeof *room);
  }
  for (size_t i = 1; i < n; i++) slice->parameters[i] = fmax(slice->parameters[i], slice->parameters[i - 1]);
}

batten_status match_parameters(batten_context *ctx, match_stack *s) {
  grid g = {0};
  double *at = NULL, *room = NULL;
  size_t most = 0;
  for (size_t i = 0; i < s->count; i++)
    if (s->slices[i].count > most) most = s->slices[i].count;
  batten_status st = grid_new(ctx, s, &g);
  if (st >= 0) st = smooth(ctx, s, &g);
  if (st < 0) goto done;
  at = batten_alloc_array(ctx, 2 * g.cells + 1, sizeof *at);
  room = batten_alloc_array(ctx, most, 2 * sizeof *room);
  st = at && room ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t i = 0; i < s->count && st >= 0; i++) {
    fill_slice(s, &g, i, at);
    map_points(s, &g, at, s->slices + i);
    rotate_points(s->slices + i, s->closed, room);
  }
done:
  batten_free(ctx, room);
  batten_free(ctx, at);
  grid_free(ctx, &g);
  return st;
}
