/* Ties between neighbours, and the forest of their firmest.   [after Hoppe, DeRose, Duchamp, McDonald, Stuetzle 1992]
 *
 * Each pair of neighbours ties the signs of two planes, the firmer the better the planes fit to one surface and the
 * more the pair lies in both (batten_orient_agreement). Kruskal's minimum spanning forest settles the firmest ties
 * first; a union-find with parity carries the signs, so no walk over the tree is needed. Loose ties do not join what
 * is closed already: bodies that nearly touch.
 *
 * Weights have 15 bits, so that a counting sort puts them in order in linear time. */
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "orient.h"

/* A tie with less than 0.3 left of its agreement does not join two trees that are closed surfaces already. */
static const double LOOSE = 0.7;
/* Ties of planes less flat than SURE come behind the firm ones of others. */
static const double SURE = 0.5, UNSURE = 0.3;
static const double CLOSED = 0.1; /* openness of random samples of a torus: 0.03 */
/* Weights 0 .. STEPS of ties, STRAY .. STRAY + STEPS of strays' ties; NO_TIE: the pair counts elsewhere. */
enum {
  CHUNK = 1024,
  SLICE = 1 << 18,
  STEPS = 32766,
  STRAY = STEPS + 1,
  NO_TIE = STRAY + STEPS + 1, /* 65534: weights are unsigned short */
  BUCKETS = NO_TIE + 1
};

typedef struct weigh_task {
  const batten_orient_graph *graph;
  unsigned short *weight;
} weigh_task;

static double tie_weight(const batten_orient_graph *g, size_t i, size_t j) {
  unsigned n = g->n;
  const double *x = g->surface + i * n, *y = g->surface + j * n, *u = g->plane + i * n, *v = g->plane + j * n;
  double eu = 0, ev = 0, square = 0;
  for (unsigned c = 0; c < n; c++) {
    double e = y[c] - x[c];
    square += e * e;
    eu += e * u[c];
    ev += e * v[c];
  }
  /* part of the pair that stands off the planes: noise there looks like the other side of a wall */
  double off = square > 0 ? fmax(eu * eu, ev * ev) / square : 0;
  double loose = 1 - fabs(batten_orient_agreement(n, x, y, u, v)) * (1 - off);
  return fmin(g->flatness[i], g->flatness[j]) < SURE ? UNSURE + (1 - UNSURE) * loose : loose;
}

/* Each pair counts once: at the lower one of two that are each other's neighbours. */
static bool is_repeated(const batten_orient_graph *g, size_t i, size_t j) {
  if (i < j) return false;
  for (size_t q = 0; q < g->k; q++)
    if (g->index[j * g->k + q] == i) return true;
  return false;
}

static void weigh(void *task, size_t chunk) {
  weigh_task *t = task;
  const batten_orient_graph *g = t->graph;
  size_t end = (chunk + 1) * CHUNK < g->count ? (chunk + 1) * CHUNK : g->count;
  for (size_t i = chunk * CHUNK; i < end; i++)
    for (size_t q = 0; q < g->k; q++) {
      size_t j = g->index[i * g->k + q];
      bool stray = g->area[i] == 0 || g->area[j] == 0;
      long weight = NO_TIE;
      if (!is_repeated(g, i, j)) weight = (stray ? STRAY : 0) + lround(fmin(fmax(tie_weight(g, i, j), 0), 1) * STEPS);
      t->weight[i * g->k + q] = (unsigned short)weight;
    }
}

/* Counting sort; equal weights keep the order of the points. first [BUCKETS + 1]. */
static void sort_ties(size_t pairs, size_t *first, batten_orient_forest *f) {
  memset(first, 0, (BUCKETS + 1) * sizeof *first);
  for (size_t p = 0; p < pairs; p++) first[f->weight[p] + 1]++;
  for (size_t b = 0; b < BUCKETS; b++) first[b + 1] += first[b];
  f->count = first[NO_TIE];
  for (size_t p = 0; p < pairs; p++)
    if (f->weight[p] != NO_TIE) f->ties[first[f->weight[p]]++] = p;
}

void batten_orient_forest_plant(const batten_orient_graph *g, batten_orient_forest *f) {
  for (size_t i = 0; i < g->count; i++) {
    f->parent[i] = i;
    f->turned[i] = f->rank[i] = 0;
    f->total[i] = g->area[i];
    for (unsigned c = 0; c < 3; c++) f->sum[3 * i + c] = c < g->n ? g->area[i] * g->plane[i * g->n + c] : 0;
  }
  f->next = 0;
}

void batten_orient_forest_free(batten_context *ctx, batten_orient_forest *f) {
  batten_free(ctx, f->ties);
  batten_free(ctx, f->weight);
  batten_free(ctx, f->parent);
  batten_free(ctx, f->turned);
  batten_free(ctx, f->rank);
  batten_free(ctx, f->sum);
  batten_free(ctx, f->total);
  *f = (batten_orient_forest){0};
}

batten_status batten_orient_forest_new(batten_context *ctx, const batten_orient_graph *g,
                                       batten_orient_forest *forest) {
  size_t pairs = g->count * g->k, *first = NULL; /* the graph holds so many */
  batten_orient_forest f = {0};
  batten_status status = BATTEN_E_NOMEM;
  if (!(first = batten_alloc_array(ctx, BUCKETS + 1, sizeof *first)) ||
      !(f.ties = batten_alloc_array(ctx, pairs, sizeof *f.ties)) ||
      !(f.weight = batten_alloc_array(ctx, pairs, sizeof *f.weight)) ||
      !(f.parent = batten_alloc_array(ctx, g->count, sizeof *f.parent)) ||
      !(f.turned = batten_alloc(ctx, g->count)) || !(f.rank = batten_alloc(ctx, g->count)) ||
      !(f.sum = batten_alloc_array(ctx, g->count, 3 * sizeof *f.sum)) ||
      !(f.total = batten_alloc_array(ctx, g->count, sizeof *f.total)))
    goto done;
  if ((status = batten_progress(ctx, "orient", 0.3)) < 0) goto done;
  batten_parallel(ctx, (g->count + CHUNK - 1) / CHUNK, weigh, &(weigh_task){g, f.weight});
  if ((status = batten_progress(ctx, "orient", 0.32)) < 0) goto done;
  sort_ties(pairs, first, &f);
  batten_orient_forest_plant(g, &f);
done:
  batten_free(ctx, first);
  if (status < 0) batten_orient_forest_free(ctx, &f);
  *forest = f;
  return status;
}

size_t batten_orient_forest_root(batten_orient_forest *f, size_t i, bool *opposed) {
  while (f->parent[i] != f->parent[f->parent[i]]) { /* halve the path */
    f->turned[i] ^= f->turned[f->parent[i]];
    f->parent[i] = f->parent[f->parent[i]];
  }
  *opposed = f->parent[i] != i && f->turned[i];
  return f->parent[i];
}

static bool closed(const batten_orient_forest *f, size_t root) {
  const double *s = f->sum + 3 * root;
  return s[0] * s[0] + s[1] * s[1] + s[2] * s[2] < CLOSED * CLOSED * f->total[root] * f->total[root];
}

/* a and b are different roots. */
static void join_roots(batten_orient_forest *f, size_t a, size_t b, bool opposed) {
  if (f->rank[a] < f->rank[b]) {
    size_t r = a;
    a = b;
    b = r;
  }
  if (f->rank[a] == f->rank[b]) f->rank[a]++;
  f->parent[b] = a;
  f->turned[b] = opposed;
  f->total[a] += f->total[b];
  for (unsigned c = 0; c < 3; c++) f->sum[3 * a + c] += opposed ? -f->sum[3 * b + c] : f->sum[3 * b + c];
}

void batten_orient_forest_tie(batten_orient_forest *f, size_t i, size_t j, bool opposed) {
  bool of_i, of_j;
  size_t a = batten_orient_forest_root(f, i, &of_i), b = batten_orient_forest_root(f, j, &of_j);
  if (a != b) join_roots(f, a, b, opposed != (of_i != of_j));
}

batten_status batten_orient_forest_join(batten_context *ctx, const batten_orient_graph *g, batten_orient_forest *f,
                                        double loosest, double part) {
  unsigned n = g->n;
  const double *x = g->surface, *u = g->plane;
  for (; f->next < f->count; f->next++) {
    size_t i = f->ties[f->next] / g->k, j = g->index[f->ties[f->next]];
    double weight = (double)f->weight[f->ties[f->next]] / STEPS; /* above 1: of strays */
    if (weight > loosest) break;
    if (f->next % SLICE == 0) {
      batten_status status = batten_progress(ctx, "orient", part);
      if (status < 0) return status;
    }
    bool of_i, of_j;
    size_t a = batten_orient_forest_root(f, i, &of_i), b = batten_orient_forest_root(f, j, &of_j);
    if (a == b || (weight > LOOSE && closed(f, a) && closed(f, b))) continue;
    double agreement = batten_orient_agreement(n, x + i * n, x + j * n, u + i * n, u + j * n);
    join_roots(f, a, b, (agreement < 0) != (of_i != of_j));
  }
  return BATTEN_OK;
}
