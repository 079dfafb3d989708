/* Order of unknowns for little fill: approximate minimum degree on the quotient graph [Amestoy, Davis, Duff, SIAM J.
 * Matrix Anal. Appl. 17 (1996) 886].
 *
 * The graph after some eliminations is kept as variables and elements (cliques left by pivots). The list of a
 * variable has its elements first, then its variables; that of an element has the variables of its clique. Variables
 * with equal lists are merged; degrees are bounded from above by sums over elements, which costs no set union. Lists
 * never need more room than the graph had, but new ones are put at the end, so they are moved together now and then.
 */
#include <string.h>

#include "base/checked.h"
#include "order.h"

static const uint32_t NONE = UINT32_MAX;

typedef struct quotient {
  size_t n, left;         /* nodes, those not eliminated */
  uint32_t *list, *spare; /* [room] */
  size_t room, used;
  size_t *start;      /* [n] of node's list */
  uint32_t *length;   /* [n] of list */
  uint32_t *elements; /* [n] how many of a variable's list are elements */
  int64_t
      *weight; /* [n] of a variable: nodes merged into it; < 0 while in the pivot's clique; 0: gone or an element */
  uint32_t *degree; /* [n] bound of the outer degree; of an element: weight of its clique */
  uint64_t *stamp;  /* [n] of an element: 0 dead, else mark */
  uint64_t mark;
  uint32_t *head, *next, *before; /* [n] lists by degree; head of hashes share next */
  uint32_t *hash_head;            /* [n] */
  uint32_t *into;                 /* [n] node that this one was merged into; NONE: itself a pivot */
  uint32_t *tag, tags;            /* [n] tag[node] == tags: in the list that others are compared with */
  uint32_t least;                 /* no variable has a smaller degree */
} quotient;

static void unlink_degree(quotient *q, uint32_t i) {
  if (q->before[i] != NONE)
    q->next[q->before[i]] = q->next[i];
  else
    q->head[q->degree[i]] = q->next[i];
  if (q->next[i] != NONE) q->before[q->next[i]] = q->before[i];
}

static void link_degree(quotient *q, uint32_t i) {
  uint32_t d = q->degree[i], first = q->head[d];
  q->next[i] = first;
  q->before[i] = NONE;
  if (first != NONE) q->before[first] = i;
  q->head[d] = i;
  if (d < q->least) q->least = d;
}

static bool alive(const quotient *q, uint32_t i) { return q->weight[i] != 0 || q->stamp[i] != 0; }

/* Moves the lists of live nodes together. */
static void gather(quotient *q) {
  size_t at = 0;
  for (uint32_t i = 0; i < q->n; i++) {
    if (!alive(q, i)) continue;
    memcpy(q->spare + at, q->list + q->start[i], q->length[i] * sizeof *q->list);
    q->start[i] = at;
    at += q->length[i];
  }
  uint32_t *swap = q->list;
  q->list = q->spare;
  q->spare = swap;
  q->used = at;
}

/* Takes variable i into the pivot's clique unless it is there. */
static size_t take(quotient *q, uint32_t i, size_t at) {
  if (q->weight[i] <= 0) return at;
  q->weight[i] = -q->weight[i];
  unlink_degree(q, i);
  q->list[at] = i;
  return at + 1;
}

/* The clique of the pivot: all variables that its elements and its own list name. Those elements are absorbed. */
static void form(quotient *q, uint32_t pivot) {
  size_t bound = 0;
  for (uint32_t e = 0; e < q->length[pivot]; e++)
    bound += e < q->elements[pivot] ? q->length[q->list[q->start[pivot] + e]] : 1;
  if (bound > q->left) bound = q->left;
  if (q->used + bound > q->room) gather(q);
  size_t first = q->used, at = first;
  for (uint32_t e = 0; e < q->elements[pivot]; e++) {
    uint32_t element = q->list[q->start[pivot] + e];
    for (uint32_t v = 0; v < q->length[element]; v++) at = take(q, q->list[q->start[element] + v], at);
    q->stamp[element] = 0;
  }
  for (uint32_t v = q->elements[pivot]; v < q->length[pivot]; v++) at = take(q, q->list[q->start[pivot] + v], at);
  q->start[pivot] = first;
  q->length[pivot] = (uint32_t)(at - first);
  q->used = at;
}

/* stamp[e] - mark = weight of the part of element e outside the pivot's clique, for all elements that touch it. */
static void mark_outside(quotient *q, uint32_t pivot) {
  for (uint32_t v = 0; v < q->length[pivot]; v++) {
    uint32_t i = q->list[q->start[pivot] + v];
    uint64_t w = (uint64_t)-q->weight[i];
    for (uint32_t e = 0; e < q->elements[i]; e++) {
      uint32_t element = q->list[q->start[i] + e];
      if (q->stamp[element] >= q->mark)
        q->stamp[element] -= w;
      else if (q->stamp[element] != 0)
        q->stamp[element] = q->mark + q->degree[element] - w;
    }
  }
}

/* Writes the list of clique member i anew: the pivot, elements that reach outside, variables outside. Returns the
 * weight of what is outside the clique. There is room: the pivot, or an element that it absorbed, was in the list. */
static uint64_t rewrite(quotient *q, uint32_t pivot, uint32_t i, uint32_t *hash) {
  uint32_t *list = q->list + q->start[i];
  uint32_t kept = 0, count = q->length[i], elements = q->elements[i];
  uint64_t outside = 0;
  uint32_t sum = pivot, held = pivot; /* held: what goes to the next place, one behind the reader */
  for (uint32_t e = 0; e < elements; e++) {
    uint32_t element = list[e];
    if (q->stamp[element] == 0) continue;
    uint64_t part = q->stamp[element] - q->mark;
    if (part == 0) {
      q->stamp[element] = 0; /* inside the new clique: absorbed as well */
      continue;
    }
    outside += part;
    sum += element;
    list[kept++] = held;
    held = element;
  }
  /* The last held element goes over the place of a dropped element, or moves the variables by one, of which the pivot
   * is one that falls away. */
  uint32_t new_elements = kept + 1;
  uint32_t at = elements, to = kept;
  bool pending = true;
  for (; at < count; at++) {
    uint32_t v = list[at];
    if (q->weight[v] <= 0) continue;
    outside += (uint64_t)q->weight[v];
    sum += v;
    if (pending && to < at) {
      list[to++] = held;
      pending = false;
    }
    if (pending) {
      list[to++] = held;
      held = v;
    } else
      list[to++] = v;
  }
  if (pending) list[to++] = held;
  q->elements[i] = new_elements;
  q->length[i] = to;
  *hash = sum;
  return outside;
}

static bool same_lists(const quotient *q, uint32_t j, uint32_t length, uint32_t elements) {
  if (q->length[j] != length || q->elements[j] != elements) return false;
  for (uint32_t e = 0; e < length; e++)
    if (q->tag[q->list[q->start[j] + e]] != q->tags) return false;
  return true;
}

/* Merges into i those behind it in its hash list that have the same neighbours. */
static void merge_equal(quotient *q, uint32_t i) {
  if (q->next[i] == NONE) return;
  q->tags++;
  for (uint32_t e = 0; e < q->length[i]; e++) q->tag[q->list[q->start[i] + e]] = q->tags;
  uint32_t previous = i;
  for (uint32_t j = q->next[i]; j != NONE; j = q->next[j]) {
    if (same_lists(q, j, q->length[i], q->elements[i])) {
      q->weight[i] += q->weight[j]; /* both negative */
      q->weight[j] = 0;
      q->into[j] = i;
      q->next[previous] = q->next[j];
    } else
      previous = j;
  }
}

/* Bounds of the degrees of the clique's members; members with nothing outside go with the pivot, which gets heavier.
 */
static void update(quotient *q, uint32_t pivot, int64_t *pivot_weight) {
  for (uint32_t v = 0; v < q->length[pivot]; v++) {
    uint32_t i = q->list[q->start[pivot] + v], hash;
    uint64_t outside = rewrite(q, pivot, i, &hash);
    if (outside == 0) {
      *pivot_weight -= q->weight[i];
      q->weight[i] = 0;
      q->into[i] = pivot;
      continue;
    }
    if (outside < q->degree[i]) q->degree[i] = (uint32_t)outside;
    hash %= (uint32_t)q->n;
    q->before[i] = hash;
    q->next[i] = q->hash_head[hash];
    q->hash_head[hash] = i;
  }
  for (uint32_t v = 0; v < q->length[pivot]; v++) {
    uint32_t i = q->list[q->start[pivot] + v];
    if (q->weight[i] == 0) continue;
    uint32_t hash = q->before[i];
    for (uint32_t j = q->hash_head[hash]; j != NONE; j = q->next[j]) merge_equal(q, j);
    q->hash_head[hash] = NONE;
  }
}

/* Puts the members back among the variables and leaves the pivot as an element. */
static void settle(quotient *q, uint32_t pivot, int64_t pivot_weight) {
  uint64_t clique = 0;
  uint32_t kept = 0, *list = q->list + q->start[pivot];
  for (uint32_t v = 0; v < q->length[pivot]; v++)
    if (q->weight[list[v]] != 0) clique += (uint64_t)-q->weight[list[v]];
  q->left -= (size_t)pivot_weight;
  for (uint32_t v = 0; v < q->length[pivot]; v++) {
    uint32_t i = list[v];
    if (q->weight[i] == 0) continue;
    uint64_t w = (uint64_t)-q->weight[i], degree = q->degree[i] + clique - w;
    if (degree > q->left - w) degree = q->left - w;
    q->weight[i] = (int64_t)w;
    q->degree[i] = (uint32_t)degree;
    link_degree(q, i);
    list[kept++] = i;
  }
  q->length[pivot] = kept;
  q->degree[pivot] = (uint32_t)clique;
  q->stamp[pivot] = kept > 0; /* an empty element is dead */
  q->used = q->start[pivot] + kept;
}

static void eliminate(quotient *q, uint32_t pivot) {
  int64_t weight = q->weight[pivot];
  unlink_degree(q, pivot);
  q->weight[pivot] = -weight; /* not taken into its own clique, and its list survives gathering */
  form(q, pivot);
  q->mark += 2 * q->n + 2; /* above any stamp + weight before */
  mark_outside(q, pivot);
  q->stamp[pivot] = UINT64_MAX;
  q->weight[pivot] = 0;
  update(q, pivot, &weight);
  settle(q, pivot, weight);
}

/* Pivots in their order, each with the nodes merged into it behind it. */
static void write_order(quotient *q, const uint32_t *pivots, size_t count, uint32_t *order) {
  for (uint32_t i = 0; i < q->n; i++) q->head[i] = NONE;
  for (size_t i = q->n; i-- > 0;) {
    if (q->into[i] == NONE) continue;
    uint32_t root = q->into[i];
    while (q->into[root] != NONE) root = q->into[root];
    for (uint32_t j = (uint32_t)i; j != root;) { /* shorter ways for those that follow */
      uint32_t up = q->into[j];
      q->into[j] = root;
      j = up;
    }
    q->next[i] = q->head[root];
    q->head[root] = (uint32_t)i;
  }
  size_t at = 0;
  for (size_t p = 0; p < count; p++) {
    order[at++] = pivots[p];
    for (uint32_t i = q->head[pivots[p]]; i != NONE; i = q->next[i]) order[at++] = i;
  }
}

/* Nodes that meet a large part of all come last: they would only make every degree the same. */
static bool dense(size_t n, size_t degree) { return degree > 16 && (double)degree > 10 * sqrt((double)n); }

batten_status sparse_order_degree(batten_context *ctx, sparse_graph *g, uint32_t *order) {
  size_t n = g->count, entries = n ? g->starts[n] : 0, count = 0, bytes;
  if (n == 0) {
    sparse_graph_free(ctx, g);
    return BATTEN_OK;
  }
  const size_t WORDS = 10, LONG_WORDS = 3;
  batten_status st = BATTEN_E_NOMEM;
  uint64_t *longs = NULL;
  uint32_t *words = NULL, *pivots = NULL;
  quotient q = {.n = n, .left = n, .room = entries + entries / 4 + 2 * n, .used = entries, .mark = 1, .least = 0};
  if (!batten_mul3(q.room, 2, sizeof *q.list, &bytes)) goto done;
  q.list = batten_alloc(ctx, bytes);
  if (!q.list) goto done;
  uint32_t *lists = q.list;
  q.spare = q.list + q.room;
  words = batten_alloc_array(ctx, WORDS * n, sizeof *words);
  if (!words) goto free_lists;
  longs = batten_alloc_array(ctx, LONG_WORDS * n, sizeof *longs);
  if (!longs) goto free_lists;
  q.length = words, q.elements = words + n, q.degree = words + 2 * n, q.head = words + 3 * n;
  q.next = words + 4 * n, q.before = words + 5 * n, q.hash_head = words + 6 * n, q.into = words + 7 * n;
  q.tag = words + 8 * n, pivots = words + 9 * n;
  q.stamp = longs, q.weight = (int64_t *)longs + n, q.start = (size_t *)longs + 2 * n;
  memset(longs, 0, LONG_WORDS * n * sizeof *longs);
  memset(words, 0, WORDS * n * sizeof *words);
  memcpy(q.list, g->indices, entries * sizeof *q.list);
  for (size_t i = 0; i < n; i++) {
    q.head[i] = q.hash_head[i] = q.into[i] = NONE;
    q.start[i] = g->starts[i];
    q.length[i] = q.degree[i] = (uint32_t)(g->starts[i + 1] - g->starts[i]);
    q.weight[i] = 1;
  }
  sparse_graph_free(ctx, g);
  size_t last = 0; /* dense nodes, at the end of pivots */
  for (uint32_t i = 0; i < n; i++)
    if (dense(n, q.degree[i])) {
      q.weight[i] = 0;
      pivots[n - ++last] = i;
    }
  q.left = n - last;
  for (uint32_t i = 0; i < n; i++)
    if (q.weight[i]) link_degree(&q, i);
  while (q.left > 0) {
    while (q.head[q.least] == NONE) q.least++;
    uint32_t pivot = q.head[q.least];
    pivots[count++] = pivot;
    eliminate(&q, pivot);
  }
  memmove(pivots + count, pivots + (n - last), last * sizeof *pivots);
  write_order(&q, pivots, count + last, order);
  st = BATTEN_OK;
free_lists:
  batten_free(ctx, lists);
done:
  sparse_graph_free(ctx, g);
  batten_free(ctx, longs);
  batten_free(ctx, words);
  return st;
}
