/* Which points become centres.
 *
 * First: the points nearest to the middles of the cells of a balanced tree, and those that span the box, so that the
 * unit box is the same in all rounds. Then, round by round, the worst: in order of their errors, none nearer to
 * another of the same round than a distance, because the error about a bad place falls as soon as one point there is
 * a centre. Distances shrink from round to round, and within one where they leave too few. */
#include "spline/reduce.h"

#include "basis/sort_points.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

/* Distances shrink by this factor from round to round: on a surface rounds may then double the centres. */
static const double SHRINK = 1.5;

/* A round that adds less than a quarter of the centres there are, though more points than twice its number ask for
 * it and the worst misses by far, goes on with a smaller distance. */
static const size_t LEAST_PART = 4;
static const double FAR = 2;

/* Where the worst misses by no more than that, points that are nearly missed become centres too: they spare rounds in
 * each of which a few more would be missed by a little. */
static const double NEARLY = 0.9;

/* ---- preparation ---- */

static batten_status mark_twins(reduction *r) {
  const batten_spline_data *d = r->data;
  const size_t n = d->n;
  if (d->count > UINT32_MAX)
    return batten_fail(r->ctx, BATTEN_E_TOO_LARGE, "data.count: %zu; at most 2^32 - 1 are reduced", d->count);
  uint32_t *order = batten_alloc_array(r->ctx, d->count, sizeof *order);
  batten_status st = order ? batten_sort_points(r->ctx, d->n, d->count, d->points, order) : BATTEN_E_NOMEM;
  memset(r->state, REDUCE_FREE, d->count);
  r->distinct = d->count;
  for (size_t q = 1; st >= 0 && q < d->count; q++) {
    const double *a = d->points + order[q - 1] * n, *b = d->points + order[q] * n;
    bool same = true;
    for (size_t k = 0; k < n; k++) same = same && a[k] == b[k];
    if (!same) continue;
    r->state[order[q]] = REDUCE_TWIN;
    r->distinct--;
  }
  batten_free(r->ctx, order);
  return st;
}

batten_status batten_reduce_prepare(reduction *r) {
  batten_status st = mark_twins(r);
  return st < 0 ? st : batten_tree_new(r->ctx, r->data->n, r->data->count, r->data->points, &r->tree);
}

/* ---- the first centres ---- */

static void make_centre(reduction *r, size_t i) {
  if (r->state[i] != REDUCE_FREE) return;
  r->state[i] = REDUCE_CENTRE;
  r->centres++;
}

static void add_extremes(reduction *r) {
  const size_t n = r->data->n, count = r->data->count;
  const double *x = r->data->points;
  for (size_t a = 0; a < n; a++) {
    size_t low = SIZE_MAX, high = SIZE_MAX;
    for (size_t i = 0; i < count; i++) {
      if (r->state[i] == REDUCE_TWIN) continue;
      if (low == SIZE_MAX || x[i * n + a] < x[low * n + a]) low = i;
      if (high == SIZE_MAX || x[i * n + a] > x[high * n + a]) high = i;
    }
    make_centre(r, low);
    make_centre(r, high);
  }
}

/* Of count points by index, the one nearest to the middle of their box. */
static size_t middle_point(const reduction *r, const size_t *index, size_t count) {
  const size_t n = r->data->n;
  const double *x = r->data->points;
  double middle[3] = {0}, best = INFINITY;
  size_t found = SIZE_MAX;
  for (size_t a = 0; a < n; a++) {
    double lower = INFINITY, upper = -INFINITY;
    for (size_t q = 0; q < count; q++) {
      lower = fmin(lower, x[index[q] * n + a]);
      upper = fmax(upper, x[index[q] * n + a]);
    }
    middle[a] = lower / 2 + upper / 2;
  }
  for (size_t q = 0; q < count; q++) {
    if (r->state[index[q]] == REDUCE_TWIN) continue;
    double square = 0;
    for (size_t a = 0; a < n; a++) square += (x[index[q] * n + a] - middle[a]) * (x[index[q] * n + a] - middle[a]);
    if (square < best || (square == best && index[q] < found)) {
      best = square;
      found = index[q];
    }
  }
  return found;
}

/* Half the distance of a centre to the nearest other one, in the middle of all. */
static batten_status measure_apart(reduction *r) {
  const size_t n = r->data->n, count = r->centres;
  batten_status st = BATTEN_E_NOMEM;
  double *x = batten_alloc_array(r->ctx, count, n * sizeof *x);
  double *distance = batten_alloc_array(r->ctx, count, sizeof *distance), sum = 0;
  size_t *index = batten_alloc_array(r->ctx, count, sizeof *index);
  if (!x || !distance || !index) goto done;
  for (size_t i = 0, q = 0; i < r->data->count; i++)
    if (r->state[i] == REDUCE_CENTRE) memcpy(x + n * q++, r->data->points + i * n, n * sizeof *x);
  st = BATTEN_OK;
  if (count > 1) st = batten_neighbours(r->ctx, r->data->n, count, x, 1, index, distance);
  for (size_t q = 0; q < count && count > 1 && st >= 0; q++) sum += distance[q];
  r->apart = sum / (double)count;
done:
  batten_free(r->ctx, index);
  batten_free(r->ctx, distance);
  batten_free(r->ctx, x);
  return st;
}

static size_t reversed(size_t number, unsigned bits) {
  size_t back = 0;
  for (unsigned bit = 0; bit < bits; bit++) back |= (number >> bit & 1) << (bits - 1 - bit);
  return back;
}

batten_status batten_reduce_start(reduction *r, size_t wanted, size_t most) {
  const size_t count = r->data->count;
  unsigned halvings = 0;
  while (((size_t)1 << halvings) < wanted && ((size_t)2 << halvings) <= count && ((size_t)1 << halvings) < most)
    halvings++;
  add_extremes(r);
  batten_tree_order(r->tree, r->heap);
  for (size_t turn = 0; turn < (size_t)1 << halvings && r->centres < most; turn++) {
    const size_t cell = reversed(turn, halvings); /* well spread wherever it stops */
    size_t low = 0, high = count;
    for (unsigned bit = halvings; bit-- > 0;) {
      const size_t middle = low + (high - low) / 2;
      if (cell >> bit & 1)
        low = middle;
      else
        high = middle;
    }
    const size_t i = middle_point(r, r->heap + low, high - low);
    if (i != SIZE_MAX) make_centre(r, i);
  }
  return measure_apart(r);
}

/* ---- the worst ---- */

static bool worse(const reduction *r, size_t i, size_t j) {
  return r->ratio[i] > r->ratio[j] || (r->ratio[i] == r->ratio[j] && i < j);
}

static void sift(const reduction *r, size_t *heap, size_t root, size_t count) {
  for (size_t child; (child = 2 * root + 1) < count; root = child) {
    if (child + 1 < count && worse(r, heap[child + 1], heap[child])) child++;
    if (!worse(r, heap[child], heap[root])) return;
    const size_t t = heap[root];
    heap[root] = heap[child];
    heap[child] = t;
  }
}

void batten_reduce_heap_make(const reduction *r, size_t *heap, size_t count) {
  for (size_t root = count / 2; root-- > 0;) sift(r, heap, root, count);
}

void batten_reduce_heap_pop(const reduction *r, size_t *heap, size_t count) {
  heap[0] = heap[count - 1];
  sift(r, heap, 0, count - 1);
}

/* Free points within r->apart of point i wait for the next round. */
static void hold_around(reduction *r, size_t i) {
  const size_t found = batten_tree_within(r->tree, r->data->points + i * r->data->n, r->apart, r->near);
  for (size_t q = 0; q < found; q++)
    if (r->state[r->near[q]] == REDUCE_FREE) r->state[r->near[q]] = REDUCE_HELD;
}

static void release_held(reduction *r) {
  for (size_t i = 0; i < r->data->count; i++)
    if (r->state[i] == REDUCE_HELD) r->state[i] = REDUCE_FREE;
}

/* Makes centres of the worst free points with ratio > least, so that this round has at most `most`, in chosen
 * [added ..). Returns how many it has then; *asking: free points that asked. */
static size_t pass(reduction *r, double least, size_t most, size_t added, size_t *asking) {
  size_t left = 0;
  for (size_t i = 0; i < r->data->count; i++)
    if (r->state[i] == REDUCE_FREE && r->ratio[i] > least) r->heap[left++] = i;
  *asking = left;
  batten_reduce_heap_make(r, r->heap, left);
  for (size_t q = 0; q < added; q++) hold_around(r, r->chosen[q]);
  while (left > 0 && added < most) {
    const size_t i = r->heap[0];
    batten_reduce_heap_pop(r, r->heap, left--);
    if (r->state[i] != REDUCE_FREE) continue;
    make_centre(r, i);
    r->chosen[added++] = i;
    hold_around(r, i);
  }
  release_held(r);
  return added;
}

size_t batten_reduce_add_worst(reduction *r, size_t most) {
  const size_t enough = most < r->centres / LEAST_PART ? most : r->centres / LEAST_PART;
  size_t asking, added = 0;
  double worst = 0;
  for (size_t i = 0; i < r->data->count; i++)
    if (r->state[i] == REDUCE_FREE && r->ratio[i] > worst) worst = r->ratio[i];
  if (worst <= 1) return 0;
  do {
    r->apart /= SHRINK;
    added = pass(r, worst > FAR ? 1 : NEARLY, most, added, &asking);
  } while (worst > FAR && added < enough && 2 * added < asking);
  return added;
}
