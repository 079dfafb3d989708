/* Merge sort from runs of one upwards. Items carry the first coordinate, so that memory is passed in its order but
 * where first coordinates tie. qsort would not do: it may take memory behind the context's back. */
#include "basis/sort_points.h"

#include <stdbool.h>
#include <string.h>

typedef struct item {
  double key;
  uint32_t index;
} item;

/* Whether b comes before a, which has the lower index where they are one place. */
static bool is_before(unsigned n, const double *points, const item *b, const item *a) {
  if (b->key != a->key) return b->key < a->key;
  const double *p = points + (size_t)b->index * n, *q = points + (size_t)a->index * n;
  for (unsigned k = 1; k < n; k++)
    if (p[k] != q[k]) return p[k] < q[k];
  return false;
}

static void merge(unsigned n, const double *points, const item *left, size_t left_count, const item *right,
                  size_t right_count, item *out) {
  while (left_count && right_count) {
    bool take_right = is_before(n, points, right, left);
    *out++ = take_right ? *right : *left;
    right += take_right;
    right_count -= take_right;
    left += !take_right;
    left_count -= !take_right;
  }
  memcpy(out, left, left_count * sizeof *out);
  memcpy(out + left_count, right, right_count * sizeof *out);
}

batten_status batten_sort_points(batten_context *ctx, unsigned n, size_t count, const double *points,
                                 uint32_t *order) {
  item *from = batten_alloc_array(ctx, count, sizeof *from);
  item *to = from ? batten_alloc_array(ctx, count, sizeof *to) : NULL;
  if (to) {
    for (size_t i = 0; i < count; i++) from[i] = (item){points[i * n], (uint32_t)i};
    for (size_t run = 1; run < count; run *= 2) {
      for (size_t first = 0; first < count; first += 2 * run) {
        size_t middle = count - first < run ? count : first + run;
        size_t last = count - middle < run ? count : middle + run;
        merge(n, points, from + first, middle - first, from + middle, last - middle, to + first);
      }
      item *t = from;
      from = to;
      to = t;
    }
    for (size_t i = 0; i < count; i++) order[i] = from[i].index;
  }
  batten_status st = to ? BATTEN_OK : BATTEN_E_NOMEM;
  batten_free(ctx, to);
  batten_free(ctx, from);
  return st;
}
