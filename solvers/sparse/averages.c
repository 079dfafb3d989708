/* Elimination without subtractions [Grassmann, Taksar, Heyman 1985; O'Cinneide 1993].
 *
 * When unknown k is eliminated, its average is put in for it: w_ij += w_ik w_kj / d_k, with d_k the sum of what is
 * left in row k. A share that comes back to i itself would be taken from the diagonal; instead, since the weights of
 * an average sum to the diagonal, that is formed anew as their sum. So only positive numbers are added, multiplied
 * and divided, no digit is lost to cancellation, and neither pivoting nor refinement is called for.
 *
 * Rows are made one after another (up-looking): row i takes in those rows before it that it refers to, by a path up
 * the elimination tree [Liu 1990]; rows are kept as averages, weights summing to 1 with the given ones. The order is
 * by nested dissection: the pattern is that of a symmetric matrix. */
#include "averages.h"

#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "order.h"

#define NONE UINT32_MAX

typedef struct elimination {
  const sparse_averages *a;
  uint32_t *order, *place; /* [n] place -> unknown and back */
  uint32_t *parent;        /* [n] in the elimination tree of places, NONE at roots */
  uint32_t *mark;          /* [n] last row that has met it */
  uint32_t *path;          /* [n] rows to take in, ascending in the tree from path[top] on */
  size_t *starts;          /* [n + 1] of the rows */
  uint32_t *columns;       /* places above the row's own */
  double *weights;
  double *row; /* [n] weights of the row in hand, else 0 */
  double *sum; /* [n][2] given values of the average: first the right side, then x, by places */
  double *own; /* [n] weight of the given values in the average */
} elimination;

/* parent, and starts as the lengths of the rows [Liu 1990, algorithm 4.2 and the row subtrees of 3.2]. */
static void find_tree(elimination *s) {
  const sparse_averages *a = s->a;
  uint32_t *ancestor = s->path;
  for (uint32_t i = 0; i < a->count; i++) {
    s->parent[i] = ancestor[i] = NONE;
    size_t unknown = s->order[i];
    for (size_t e = a->starts[unknown]; e < a->starts[unknown + 1]; e++) {
      uint32_t j = s->place[a->columns[e]];
      while (j < i) {
        uint32_t next = ancestor[j];
        ancestor[j] = i;
        if (next == NONE) s->parent[j] = i;
        j = next < i ? next : i;
      }
    }
  }
  memset(s->starts, 0, (a->count + 1) * sizeof *s->starts);
  for (uint32_t i = 0; i < a->count; i++) {
    s->mark[i] = i;
    size_t unknown = s->order[i];
    for (size_t e = a->starts[unknown]; e < a->starts[unknown + 1]; e++)
      for (uint32_t j = s->place[a->columns[e]]; j < i && s->mark[j] != i; j = s->parent[j]) {
        s->mark[j] = i;
        s->starts[j + 1]++;
      }
  }
  for (size_t i = 0; i < a->count; i++) s->starts[i + 1] += s->starts[i];
  memset(s->mark, 0xff, a->count * sizeof *s->mark);
}

/* Scatters row i into s->row; the rows to take in are path[result .. n - 1], each before those that it leads to. */
static size_t scatter_row(elimination *s, uint32_t i) {
  const sparse_averages *a = s->a;
  size_t top = a->count, unknown = s->order[i];
  s->mark[i] = i;
  for (size_t e = a->starts[unknown]; e < a->starts[unknown + 1]; e++) {
    uint32_t j = s->place[a->columns[e]];
    s->row[j] = a->weights[e];
    size_t length = 0;
    for (; j < i && s->mark[j] != i; j = s->parent[j]) {
      s->mark[j] = i;
      s->path[length++] = j;
    }
    while (length > 0) s->path[--top] = s->path[--length];
  }
  return top;
}

/* The places above i that row i refers to, once for each. */
static size_t list_columns(elimination *s, uint32_t i, size_t top) {
  const sparse_averages *a = s->a;
  size_t first = s->starts[i], count = 0, unknown = s->order[i];
  uint32_t *columns = s->columns + first;
  for (size_t e = a->starts[unknown]; e < a->starts[unknown + 1]; e++) {
    uint32_t j = s->place[a->columns[e]];
    if (j <= i || s->mark[j] == i) continue;
    s->mark[j] = i;
    columns[count++] = j;
  }
  for (size_t p = top; p < a->count; p++) {
    uint32_t k = s->path[p];
    if (s->parent[k] != i) continue; /* what others lead to, the tree's children have as well */
    for (size_t e = s->starts[k]; e < s->starts[k + 1]; e++) {
      uint32_t j = s->columns[e];
      if (j <= i || s->mark[j] == i) continue;
      s->mark[j] = i;
      columns[count++] = j;
    }
  }
  return count;
}

static batten_status eliminate_row(batten_context *ctx, elimination *s, uint32_t i) {
  size_t top = scatter_row(s, i), unknown = s->order[i];
  double sum[2] = {s->a->values[2 * unknown], s->a->values[2 * unknown + 1]}, own = s->a->given[unknown];
  for (size_t p = top; p < s->a->count; p++) {
    uint32_t k = s->path[p];
    double w = s->row[k];
    s->row[k] = 0;
    for (size_t e = s->starts[k]; e < s->starts[k + 1]; e++) s->row[s->columns[e]] += w * s->weights[e];
    for (size_t c = 0; c < 2; c++) sum[c] += w * s->sum[2 * (size_t)k + c];
    own += w * s->own[k];
  }
  s->row[i] = 0; /* comes back to itself: see above */
  size_t first = s->starts[i], count = list_columns(s, i, top);
  double total = own;
  for (size_t e = first; e < first + count; e++) total += s->row[s->columns[e]];
  if (!(total > 0) || !isfinite(total))
    return batten_fail(ctx, BATTEN_E_SINGULAR,
                       "unknown %zu: its average has the weight %g; connect it to given values", unknown, total);
  for (size_t e = first; e < first + count; e++) {
    s->weights[e] = s->row[s->columns[e]] / total;
    s->row[s->columns[e]] = 0;
  }
  for (size_t c = 0; c < 2; c++) s->sum[2 * (size_t)i + c] = sum[c] / total;
  s->own[i] = own / total;
  return BATTEN_OK;
}

static void put_back(elimination *s, double *x) {
  for (size_t i = s->a->count; i-- > 0;) {
    double sum[2] = {s->sum[2 * i], s->sum[2 * i + 1]};
    for (size_t e = s->starts[i]; e < s->starts[i + 1]; e++)
      for (size_t c = 0; c < 2; c++) sum[c] += s->weights[e] * s->sum[2 * (size_t)s->columns[e] + c];
    for (size_t c = 0; c < 2; c++) x[2 * (size_t)s->order[i] + c] = s->sum[2 * i + c] = sum[c];
  }
}

static batten_status find_order(batten_context *ctx, elimination *s) {
  const sparse_averages *a = s->a;
  /* The graph is the orderings' own form of the same pattern; they only read it. */
  sparse_graph graph = {.count = a->count};
  graph.starts = batten_alloc_array(ctx, a->count + 1, sizeof *graph.starts);
  graph.indices = graph.starts ? batten_alloc_array(ctx, a->starts[a->count], sizeof *graph.indices) : NULL;
  batten_status st = graph.indices ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0) {
    memcpy(graph.starts, a->starts, (a->count + 1) * sizeof *graph.starts);
    memcpy(graph.indices, a->columns, a->starts[a->count] * sizeof *graph.indices);
    st = sparse_order_dissection(ctx, &graph, s->order);
  }
  sparse_graph_free(ctx, &graph);
  for (uint32_t i = 0; st >= 0 && i < a->count; i++) s->place[s->order[i]] = i;
  return st;
}

static batten_status new_elimination(batten_context *ctx, elimination *s) {
  size_t n = s->a->count;
  s->order = batten_alloc_array(ctx, n, sizeof *s->order);
  s->place = s->order ? batten_alloc_array(ctx, n, sizeof *s->place) : NULL;
  s->parent = s->place ? batten_alloc_array(ctx, n, sizeof *s->parent) : NULL;
  s->mark = s->parent ? batten_alloc_array(ctx, n, sizeof *s->mark) : NULL;
  s->path = s->mark ? batten_alloc_array(ctx, n, sizeof *s->path) : NULL;
  s->starts = s->path ? batten_alloc_array(ctx, n + 1, sizeof *s->starts) : NULL;
  s->row = s->starts ? batten_alloc_array(ctx, n, sizeof *s->row) : NULL;
  s->sum = s->row ? batten_alloc_array(ctx, n, 2 * sizeof *s->sum) : NULL;
  s->own = s->sum ? batten_alloc_array(ctx, n, sizeof *s->own) : NULL;
  if (!s->own) return BATTEN_E_NOMEM;
  batten_status st = find_order(ctx, s);
  if (st < 0) return st;
  find_tree(s);
  s->columns = batten_alloc_array(ctx, s->starts[n], sizeof *s->columns);
  s->weights = s->columns ? batten_alloc_array(ctx, s->starts[n], sizeof *s->weights) : NULL;
  if (!s->weights) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < n; i++) s->row[i] = 0;
  return BATTEN_OK;
}

batten_status sparse_solve_averages(batten_context *ctx, const sparse_averages *a, const char *phase, double from,
                                    double *x) {
  if (a->count >= NONE)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu unknowns; at most %u fit", a->count, NONE - 1);
  if (a->count == 0) return BATTEN_OK;
  elimination s = {.a = a};
  batten_status st = new_elimination(ctx, &s);
  for (uint32_t i = 0; st >= 0 && i < a->count; i++) {
    if (i % 4096 == 0) st = batten_progress(ctx, phase, from + (1 - from) * ((double)i / (double)a->count));
    if (st >= 0) st = eliminate_row(ctx, &s, i);
  }
  if (st >= 0) put_back(&s, x);
  batten_free(ctx, s.weights);
  batten_free(ctx, s.columns);
  batten_free(ctx, s.own);
  batten_free(ctx, s.sum);
  batten_free(ctx, s.row);
  batten_free(ctx, s.starts);
  batten_free(ctx, s.path);
  batten_free(ctx, s.mark);
  batten_free(ctx, s.parent);
  batten_free(ctx, s.place);
  batten_free(ctx, s.order);
  return st;
}
