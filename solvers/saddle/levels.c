/* Nested levels of the unknowns, and the domains of each.
 *
 * A kd-tree halves the points of a level down to cells of at most 8 (4 before the last level, where that then still
 * has room). In each cell the one next to the middle of the cell's box goes to the next level, which so has an eighth
 * of the unknowns or somewhat more, spread as they are; with the extreme ones along each axis, as an outlier alone
 * holds a polynomial. The halves of at most 512 are the domains' own unknowns. A domain grows beyond them along the
 * graph of the nearest neighbours, ring by ring, and in a ring nearest ones first: by distance to its box it would
 * starve on the side where points are sparse. */
#include <string.h>

#include "base/neighbours.h"
#include "schwarz.h"

size_t batten_saddle_parts(size_t n, size_t most) {
  size_t parts = 1;
  while (n / parts > most) parts *= 2;
  /* The larger ones are once more too large where only the smaller ones are not. */
  return n / parts == most ? parts + n % parts : parts;
}

void batten_saddle_entries(const batten_saddle *s, const batten_saddle_sums *sums, size_t rows, const size_t *row,
                           size_t cols, const size_t *col, double *tile, size_t ld) {
  const batten_saddle_matrix *m = &s->matrix;
  if (sums->entries) {
    sums->entries(m->user, rows, row, cols, col, tile, ld);
    return;
  }
  for (size_t j = 0, wide; j < cols; j += wide) {
    for (wide = 1; j + wide < cols && col[j + wide] == col[j] + wide;) wide++;
    for (size_t i = 0, high; i < rows; i += high) {
      for (high = 1; i + high < rows && row[i + high] == row[i] + high;) high++;
      m->fill(m->user, row[i], high, col[j], wide, tile + i + j * ld, ld);
    }
  }
}

/* ---- Polynomials of a level ---- */

/* What is left of a column that depends on others is rounding, below this part of it. */
static const double DEPENDENT = 1e-14;

static double dot(size_t n, const double *a, const double *b) {
  double sum = 0;
  for (size_t i = 0; i < n; i++) sum += a[i] * b[i];
  return sum;
}

static void swap_columns(size_t n, double *a, double *b) {
  for (size_t i = 0; i < n; i++) {
    double t = a[i];
    a[i] = b[i];
    b[i] = t;
  }
}

/* q := orthonormal basis of the rows of P S, by Gram and Schmidt, the largest column first, each made orthogonal to
 * the others twice. factor [k][k] and pivots [k] (NULL: not wanted): P S by columns of pivots = q factor. */
static void orthonormal(const batten_saddle *s, saddle_level *l, double *factor, size_t *pivots) {
  size_t n = s->matrix.n, k = s->matrix.k, count = l->count;
  l->rank = 0;
  for (size_t c = 0; c < k; c++) {
    for (size_t i = 0; i < count; i++)
      l->q[i + c * count] = s->matrix.p[saddle_unknown(l, i) + c * n] * s->p_scale[c];
    if (pivots) pivots[c] = c;
  }
  for (size_t j = 0; j < k; j++) {
    size_t best = j;
    double largest = 0, *column = l->q + j * count;
    for (size_t c = j; c < k; c++) {
      double left = dot(count, l->q + c * count, l->q + c * count);
      if (left > largest) largest = left, best = c;
    }
    if (best != j) {
      swap_columns(count, column, l->q + best * count);
      if (pivots) {
        size_t t = pivots[j];
        pivots[j] = pivots[best];
        pivots[best] = t;
        swap_columns(k, factor + j * k, factor + best * k);
      }
    }
    double before = sqrt(largest);
    for (size_t c = 0; c < j; c++) {
      double along = dot(count, l->q + c * count, column);
      for (size_t i = 0; i < count; i++) column[i] -= along * l->q[i + c * count];
      if (factor) factor[c + j * k] += along;
    }
    /* Columns have size 1 at most, so that their length is sqrt(count) or less. */
    double length = sqrt(dot(count, column, column));
    if (!(length > DEPENDENT * sqrt((double)count) && length > 0.5 * before)) break;
    for (size_t i = 0; i < count; i++) column[i] /= length;
    if (factor) factor[j + j * k] = length;
    for (size_t c = j + 1; c < k; c++) {
      double along = dot(count, column, l->q + c * count);
      for (size_t i = 0; i < count; i++) l->q[i + c * count] -= along * column[i];
      if (factor) factor[j + c * k] = along;
    }
    l->rank++;
  }
  for (size_t c = 0; c < l->rank; c++) l->columns[c] = l->q + c * count;
}

/* ---- Neighbours ---- */

enum {
  QUERIES = 256,     /* of a task */
  PORTION = 1 << 16, /* queries between two progress calls */
  SAMPLES = 500,     /* unknowns that tell how many share a point */
  GRAPH_MAX = 40
};

typedef struct graph {
  const batten_tree *tree;
  const double *x;
  unsigned dimension;
  size_t count, first, k;
  size_t *near;  /* [count][k] */
  size_t *found; /* [count] how many of them */
  size_t *twin;  /* [count] a neighbour at no distance, or itself */
} graph;

static void find_neighbours(void *arg, size_t task) {
  const graph *g = arg;
  double distance[GRAPH_MAX];
  size_t low = g->first + task * QUERIES, high = low + QUERIES < g->count ? low + QUERIES : g->count;
  for (size_t i = low; i < high; i++) {
    size_t *near = g->near + i * g->k;
    g->found[i] = batten_tree_nearest(g->tree, g->x + i * g->dimension, g->k, i, near, distance);
    g->twin[i] = g->found[i] > 0 && !(distance[0] > 0) ? near[0] : i;
  }
}

/* Neighbours of each: as many more as unknowns share a point, so that the graph does not fall into its points. */
static size_t graph_degree(const graph *g) {
  size_t near[GRAPH_MAX], samples = g->count < SAMPLES ? g->count : SAMPLES, shared = 0;
  double distance[GRAPH_MAX];
  for (size_t i = 0; i < samples; i++) {
    size_t at = i * (g->count - 1) / samples;
    size_t found = batten_tree_nearest(g->tree, g->x + at * g->dimension, GRAPH_MAX, at, near, distance);
    for (size_t j = 0; j < found && !(distance[j] > 0); j++) shared++;
  }
  size_t degree = SADDLE_GRAPH * (1 + (shared + samples / 2) / samples);
  return degree < GRAPH_MAX ? degree : GRAPH_MAX;
}

/* Unknowns at one point are the same when K and P say so: their rows are then equal. */
static batten_status check_twins(const batten_saddle *s, const saddle_iterative *it, const saddle_level *l,
                                 const graph *g) {
  size_t n = s->matrix.n;
  for (size_t i = 0; i < g->count; i++) {
    for (size_t j = 0; j < g->found[i] && g->twin[i] != i; j++) {
      size_t pair[2] = {saddle_unknown(l, i), saddle_unknown(l, g->near[i * g->k + j])};
      double k[4];
      if (memcmp(g->x + i * g->dimension, g->x + g->near[i * g->k + j] * g->dimension,
                 g->dimension * sizeof(double)) != 0)
        break;
      batten_saddle_entries(s, &it->sums, 2, pair, 2, pair, k, 2);
      bool same = k[0] == k[1] && k[0] == k[3];
      for (size_t c = 0; c < s->matrix.k && same; c++)
        same = s->matrix.p[pair[0] + c * n] == s->matrix.p[pair[1] + c * n];
      if (same)
        return batten_fail(s->ctx, BATTEN_E_SINGULAR,
                           "matrix: rows %zu and %zu are equal, at the same point; merge duplicate points",
                           pair[0] < pair[1] ? pair[0] : pair[1], pair[0] < pair[1] ? pair[1] : pair[0]);
    }
  }
  return BATTEN_OK;
}

static batten_status make_graph(const batten_saddle *s, const saddle_iterative *it, const saddle_level *l, graph *g) {
  batten_context *ctx = s->ctx;
  g->k = graph_degree(g);
  g->near = batten_alloc_array(ctx, g->count, g->k * sizeof *g->near);
  if (!g->near) return BATTEN_E_NOMEM;
  g->found = batten_alloc_array(ctx, g->count, sizeof *g->found);
  if (!g->found) return BATTEN_E_NOMEM;
  g->twin = batten_alloc_array(ctx, g->count, sizeof *g->twin);
  if (!g->twin) return BATTEN_E_NOMEM;
  for (g->first = 0; g->first < g->count; g->first += PORTION) {
    size_t left = g->count - g->first, these = left < PORTION ? left : PORTION;
    batten_status st = batten_progress(ctx, "levels", (double)g->first / (double)g->count);
    if (st < 0) return st;
    batten_parallel(ctx, (these + QUERIES - 1) / QUERIES, find_neighbours, g);
  }
  return check_twins(s, it, l, g);
}

/* ---- Domains and the next level ---- */

/* A walk over the halves of an order that have at most `most` entries, left to right. */
typedef struct halves {
  size_t most, top;
  size_t low[64], high[64];
} halves;

static halves halves_of(size_t n, size_t most) {
  halves h = {.most = most, .top = n > 0};
  h.high[0] = n;
  return h;
}

static bool next_half(halves *h, size_t *low, size_t *high) {
  if (h->top == 0) return false;
  h->top--;
  *low = h->low[h->top];
  *high = h->high[h->top];
  while (*high - *low > h->most) {
    size_t mid = *low + (*high - *low) / 2;
    h->low[h->top] = mid;
    h->high[h->top++] = *high;
    *high = mid;
  }
  return true;
}

/* Adds to a domain of `count` members what is next to members low .. count - 1 and not in it, up to `wanted` in all:
 * the nearest neighbour of each, then the second of each, and so on. An overlap that is asked for ends within a
 * ring, and an unknown at the rim that got nothing across it would be solved for as if the data ended there: with
 * one unknown's neighbours after the other's 40,000 points took 9 iterations instead of 5. */
static size_t add_ring(const graph *g, size_t mark, size_t low, size_t count, size_t wanted, size_t *member,
                       size_t *stamp) {
  const size_t high = count;
  for (size_t j = 0; j < g->k && count < wanted; j++)
    for (size_t i = low; i < high && count < wanted; i++) {
      if (j >= g->found[member[i]]) continue;
      size_t at = g->near[member[i] * g->k + j];
      if (stamp[at] == mark) continue;
      stamp[at] = mark;
      member[count++] = at;
    }
  return count;
}

/* A domain's members: its own, then ring by ring along the graph, the first rings whole where opt.overlap is 0. Two
 * are 0.7 times the own unknowns on a surface and 1.8 times in a volume. With fewer, restriction cuts through the
 * large weights at the rim of a local solve; the error that this leaves reaches far, and the errors of all domains
 * add up: with overlap 0.5, enough on a surface, 40,000 points of a cube took 23 iterations and 90,000 did not
 * converge; with two rings they take 6, as 300,000 do. r^3 needs a third ring there, 24 iterations became 10, but not
 * where unknowns share points, whose rings are thick. Gives how many members there are. */
static size_t grow_domain(const graph *g, const batten_saddle_options *o, size_t mark, size_t own, size_t *member,
                          size_t *stamp) {
  const int whole = o->overlap > 0                             ? 0
                    : o->smooth_kernel && g->k == SADDLE_GRAPH ? SADDLE_RINGS_SMOOTH
                                                               : SADDLE_RINGS;
  const size_t most = own + saddle_added(own, SADDLE_OVERLAP_MAX);
  const size_t least = own + saddle_added(own, saddle_overlap_least(o));
  size_t count = own, ring = 0;
  for (size_t i = 0; i < own; i++) stamp[member[i]] = mark;
  for (int i = 0; ring < count && (i < whole || count < least); i++) {
    const size_t next = count;
    count = add_ring(g, mark, ring, count, i < whole ? most : least, member, stamp);
    ring = next;
  }
  return count;
}

/* The domains' members. stamp [count]: zeros. */
static batten_status make_domains(const batten_saddle *s, saddle_level *l, const size_t *order, const graph *g,
                                  size_t *stamp, size_t *domain_most) {
  halves parts = halves_of(l->count, SADDLE_OWN_MAX);
  size_t total = 0, low, high;
  size_t *members = batten_alloc_array(s->ctx, l->count, (1 + SADDLE_OVERLAP_MAX) * sizeof *members);
  if (!members) return BATTEN_E_NOMEM;
  for (size_t d = 0; next_half(&parts, &low, &high); d++) {
    const size_t own = high - low;
    memcpy(members + total, order + low, own * sizeof *members);
    const size_t count = grow_domain(g, &s->options, d + 1, own, members + total, stamp);
    l->domains[d].own = own;
    l->domains[d].count = count;
    if (count > *domain_most) *domain_most = count;
    total += count;
  }
  l->members = batten_alloc_array(s->ctx, total, sizeof *l->members);
  if (l->members) memcpy(l->members, members, total * sizeof *members);
  batten_free(s->ctx, members);
  if (!l->members) return BATTEN_E_NOMEM;
  const size_t *member = l->members;
  for (size_t d = 0; d < l->domain_count; member += l->domains[d++].count) l->domains[d].member = member;
  return BATTEN_OK;
}

/* Of a cell's points the one that is nearest to the middle of their box. */
static size_t middle_of(unsigned dimension, const double *x, const size_t *cell, size_t count) {
  double middle[3] = {0}, least = INFINITY;
  size_t best = cell[0];
  for (unsigned d = 0; d < dimension; d++) {
    double lower = INFINITY, upper = -INFINITY;
    for (size_t i = 0; i < count; i++) {
      double v = x[cell[i] * dimension + d];
      lower = fmin(lower, v);
      upper = fmax(upper, v);
    }
    middle[d] = 0.5 * lower + 0.5 * upper;
  }
  for (size_t i = 0; i < count; i++) {
    double square = 0;
    for (unsigned d = 0; d < dimension; d++) {
      double e = x[cell[i] * dimension + d] - middle[d];
      square += e * e;
    }
    if (square < least) least = square, best = cell[i];
  }
  return best;
}

/* The least and the largest along each axis. */
static void choose_extremes(unsigned dimension, size_t count, const double *x, size_t *chosen) {
  for (unsigned d = 0; d < dimension; d++) {
    size_t least = 0, most = 0;
    for (size_t i = 1; i < count; i++) {
      if (x[i * dimension + d] < x[least * dimension + d]) least = i;
      if (x[i * dimension + d] > x[most * dimension + d]) most = i;
    }
    chosen[least] = chosen[most] = 1;
  }
}

/* The next level's places on this one and its unknowns, increasing. chosen [count]: zeros. */
static batten_status make_next(const batten_saddle *s, const saddle_level *l, const size_t *order, unsigned dimension,
                               const double *x, size_t *chosen, saddle_level *next) {
  halves cells = halves_of(l->count, saddle_cell(l->count));
  size_t low, high, at = 0, count = 0;
  while (next_half(&cells, &low, &high)) chosen[middle_of(dimension, x, order + low, high - low)] = 1;
  choose_extremes(dimension, l->count, x, chosen);
  for (size_t i = 0; i < l->count; i++) count += chosen[i];
  next->count = count;
  next->parent = batten_alloc_array(s->ctx, count, sizeof *next->parent);
  if (!next->parent) return BATTEN_E_NOMEM;
  next->index = batten_alloc_array(s->ctx, count, sizeof *next->index);
  if (!next->index) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < l->count; i++) {
    if (!chosen[i]) continue;
    next->parent[at] = i;
    next->index[at++] = saddle_unknown(l, i);
  }
  return BATTEN_OK;
}

/* Cuts a level into domains and makes the next one. */
static batten_status cut_level(const batten_saddle *s, saddle_iterative *it, saddle_level *l, saddle_level *next) {
  batten_context *ctx = s->ctx;
  unsigned dimension = it->sums.dimension;
  size_t count = l->count, *order = NULL, *marks = NULL;
  graph g = {.dimension = dimension, .count = count};
  batten_tree *tree = NULL;
  batten_status st = BATTEN_E_NOMEM;
  double *x = batten_alloc_array(ctx, count, dimension * sizeof *x);
  if (!x) goto done;
  for (size_t i = 0; i < count; i++)
    memcpy(x + i * dimension, it->sums.points + saddle_unknown(l, i) * dimension, dimension * sizeof *x);
  st = batten_tree_new(ctx, dimension, count, x, &tree);
  if (st < 0) goto done;
  st = BATTEN_E_NOMEM;
  order = batten_alloc_array(ctx, count, sizeof *order);
  if (!order) goto done;
  marks = batten_alloc_array(ctx, count, sizeof *marks);
  if (!marks) goto done;
  l->domain_count = batten_saddle_parts(count, SADDLE_OWN_MAX);
  l->domains = batten_alloc_array(ctx, l->domain_count, sizeof *l->domains);
  if (!l->domains) goto done;
  for (size_t d = 0; d < l->domain_count; d++) l->domains[d] = (saddle_domain){0};
  batten_tree_order(tree, order);
  g.tree = tree;
  g.x = x;
  st = make_graph(s, it, l, &g);
  if (st < 0) goto done;
  memset(marks, 0, count * sizeof *marks);
  st = make_domains(s, l, order, &g, marks, &it->domain_most);
  if (st < 0) goto done;
  memset(marks, 0, count * sizeof *marks);
  st = make_next(s, l, order, dimension, x, marks, next);
done:
  batten_free(ctx, g.near);
  batten_free(ctx, g.found);
  batten_free(ctx, g.twin);
  batten_free(ctx, marks);
  batten_free(ctx, order);
  batten_tree_free(ctx, tree);
  batten_free(ctx, x);
  return st;
}

batten_status batten_saddle_levels_new(const batten_saddle *s, saddle_iterative *it) {
  size_t k = s->matrix.k;
  it->levels[0].count = s->matrix.n;
  for (size_t q = 0; q < SADDLE_LEVELS_MAX; q++) {
    saddle_level *l = &it->levels[q];
    it->level_count = q + 1;
    l->q = batten_alloc_array(s->ctx, l->count, k * sizeof *l->q);
    if (!l->q) return BATTEN_E_NOMEM;
    l->columns = batten_alloc_array(s->ctx, k, sizeof *l->columns);
    if (!l->columns) return BATTEN_E_NOMEM;
    l->r = batten_alloc_array(s->ctx, l->count, sizeof *l->r);
    if (!l->r) return BATTEN_E_NOMEM;
    l->w = batten_alloc_array(s->ctx, l->count, sizeof *l->w);
    if (!l->w) return BATTEN_E_NOMEM;
    orthonormal(s, l, q == 0 ? it->p_factor : NULL, q == 0 ? it->p_pivots : NULL);
    if (q == 0 && l->rank < k)
      return batten_fail(
          s->ctx, BATTEN_E_SINGULAR,
          "matrix.p: rank %zu of %zu (coplanar points?); lower the polynomial degree or add points off "
          "the plane",
          l->rank, k);
    if (l->count <= SADDLE_EXACT_MAX) return BATTEN_OK;
    batten_status st = cut_level(s, it, l, l + 1);
    if (st < 0) {
      it->level_count = q + 2; /* for what the next one holds */
      return st;
    }
  }
  return batten_fail(s->ctx, BATTEN_E_TOO_LARGE, "matrix.n: %zu rows take too many levels", s->matrix.n);
}

void batten_saddle_levels_free(const batten_saddle *s, saddle_iterative *it) {
  for (size_t q = 0; q < it->level_count; q++) {
    saddle_level *l = &it->levels[q];
    for (size_t d = 0; l->domains && d < l->domain_count; d++) {
      batten_free(s->ctx, l->domains[d].reflectors);
      batten_free(s->ctx, l->domains[d].factor);
    }
    batten_free(s->ctx, l->domains);
    batten_free(s->ctx, l->members);
    batten_free(s->ctx, l->w);
    batten_free(s->ctx, l->r);
    batten_free(s->ctx, l->columns);
    batten_free(s->ctx, l->q);
    batten_free(s->ctx, l->parent);
    batten_free(s->ctx, l->index);
    *l = (saddle_level){0};
  }
  it->level_count = 0;
}
