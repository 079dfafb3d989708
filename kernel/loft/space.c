/* Spline spaces in t, open and periodic: unions and what unions have in common, knot insertion as matrices.
 *
 * A periodic space is kept unrolled: degree + 1 functions for each span of [0, 1], on knots that go on beyond both
 * ends as far as these functions reach. Every knot outside is one inside plus a whole number, added once, so that
 * what lies a period apart differs by rounding of that sum alone, and equal knots of two spaces stay equal. Spaces
 * are combined as lists of breaks and how often each is a knot. Knot insertion is local in the unrolled sequence, so
 * that the open case and the periodic one are the same. */
#include "base/checked.h"
#include "basis/refine.h"
#include "loft_inner.h"

#include <assert.h>
#include <string.h>

/* What spaces are made of: breaks [spans + 1] ascending from 0 to 1. */
typedef struct ladder {
  size_t spans;
  const double *breaks;
  const unsigned *folds;
} ladder;

static ladder ladder_of(const loft_space *s) { return (ladder){s->spans, s->breaks, s->folds}; }

/* ---- knots --------------------------------------------------------------------------------------- */

/* The knots in [0, 1) of a period begin at degree - folds[0] + 1, so that the last copy of 0 is knot `degree`. */
static ptrdiff_t seam(const loft_space *s) { return (ptrdiff_t)(s->degree - s->folds[0] + 1); }

/* j to first .. first + count - 1; returns by how many periods. */
static ptrdiff_t wrap(const loft_space *s, ptrdiff_t first, ptrdiff_t *j) {
  ptrdiff_t count = (ptrdiff_t)s->count, off = *j - first;
  ptrdiff_t periods = off >= 0 ? off / count : -((count - 1 - off) / count);
  *j -= periods * count;
  return periods;
}

double loft_knot(const loft_space *s, ptrdiff_t j) {
  if (!s->closed) return s->knots[j];
  ptrdiff_t periods = wrap(s, seam(s), &j);
  return s->knots[j] + (double)periods;
}

double loft_greville(const loft_space *s, ptrdiff_t j) {
  ptrdiff_t periods = s->closed ? wrap(s, 0, &j) : 0;
  double sum = 0;
  for (unsigned k = 1; k <= s->degree; k++) sum += s->knots[j + (ptrdiff_t)k];
  return sum / s->degree + (double)periods;
}

double loft_interval(const loft_space *s, ptrdiff_t v) {
  if (s->closed) wrap(s, 0, &v);
  return s->knots[v + (ptrdiff_t)s->degree + 1] - s->knots[v + 1];
}

/* ---- spaces -------------------------------------------------------------------------------------- */

void loft_space_free(batten_context *ctx, loft_space *s) {
  batten_free(ctx, s->breaks);
  *s = (loft_space){0};
}

/* One block: breaks, knots, first, folds. The rest of s is made. */
static batten_status allocate(batten_context *ctx, size_t knots, loft_space *s) {
  size_t breaks = s->spans + 1, words, bytes;
  static const size_t word = sizeof(double) > sizeof(size_t) ? sizeof(double) : sizeof(size_t);
  batten_mul(breaks, 3, &words); /* breaks, first, folds */
  batten_add(words, knots, &words);
  if (!batten_mul(words, word, &bytes))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "contours: %zu spans of t; give fewer knots", s->spans);
  double *block = batten_alloc(ctx, bytes);
  if (!block) return BATTEN_E_NOMEM;
  s->breaks = block;
  s->knots = block + breaks;
  s->first = (size_t *)(s->knots + knots);
  s->folds = (unsigned *)(s->first + breaks);
  return BATTEN_OK;
}

/* Knots from the last copy of 0 on to 1, and the first function of each span. Returns the next knot's index. */
static size_t lay_knots(loft_space *s) {
  size_t at = s->degree;
  s->knots[at++] = 0;
  for (size_t i = 0; i < s->spans; i++) {
    s->first[i] = at - 1 - s->degree;
    for (unsigned k = 0; k < s->folds[i + 1]; k++) s->knots[at++] = s->breaks[i + 1];
  }
  return at;
}

batten_status loft_space_make(batten_context *ctx, unsigned degree, bool closed, size_t spans, const double *breaks,
                              const unsigned *folds, loft_space *out) {
  loft_space s = {.degree = degree, .closed = closed, .spans = spans, .count = closed ? 0 : degree + 1};
  for (size_t i = closed ? 0 : 1; i < spans; i++)
    if (!batten_add(s.count, folds[i], &s.count)) break;
  size_t all; /* closed: functions 0 .. count + degree - 1 at most */
  batten_add(s.count, (closed ? 2 : 1) * (size_t)degree + 1, &all);
  batten_status st = allocate(ctx, all, &s);
  if (st < 0) return st;
  memcpy(s.breaks, breaks, (spans + 1) * sizeof *breaks);
  memcpy(s.folds, folds, (spans + 1) * sizeof *folds);
  if (closed) {
    assert(s.count > degree);
    s.folds[spans] = s.folds[0];
    for (size_t at = lay_knots(&s); at < all; at++) s.knots[at] = 0; /* until they are known */
    ptrdiff_t first = seam(&s), beyond = first + (ptrdiff_t)s.count;
    for (ptrdiff_t j = first; j < (ptrdiff_t)degree; j++) s.knots[j] = 0;
    for (ptrdiff_t j = 0; j < (ptrdiff_t)all; j++)
      if (j < first || j >= beyond) s.knots[j] = loft_knot(&s, j);
  } else {
    s.folds[0] = s.folds[spans] = degree + 1;
    for (unsigned j = 0; j < degree; j++) s.knots[j] = 0;
    lay_knots(&s);
  }
  s.b = (bspline){degree, all - degree - 1, s.knots};
  *out = s;
  return BATTEN_OK;
}

/* ---- combinations -------------------------------------------------------------------------------- */

/* The breaks of all three, each max(middle, min(below, above)) fold, those that are then 0 fold left out. breaks and
 * folds have room for those of all. Returns the number of spans. */
static size_t combine(const ladder *below, const ladder *middle, const ladder *above, double *breaks,
                      unsigned *folds) {
  const ladder *from[3] = {below, middle, above};
  size_t at[3] = {0}, count = 0;
  for (;;) {
    double next = INFINITY;
    unsigned fold[3] = {0};
    for (size_t k = 0; k < 3; k++)
      if (at[k] <= from[k]->spans) next = fmin(next, from[k]->breaks[at[k]]);
    if (next == INFINITY) return count - 1;
    for (size_t k = 0; k < 3; k++)
      while (at[k] <= from[k]->spans && from[k]->breaks[at[k]] == next) {
        unsigned f = from[k]->folds[at[k]++];
        if (f > fold[k]) fold[k] = f;
      }
    unsigned least = fold[0] < fold[2] ? fold[0] : fold[2];
    breaks[count] = next;
    folds[count] = fold[1] > least ? fold[1] : least;
    if (folds[count] > 0) count++;
  }
}

/* Like: degree and whether closed. */
static batten_status combine_into(batten_context *ctx, const loft_space *like, const ladder *below,
                                  const ladder *middle, const ladder *above, loft_space *out) {
  size_t room;
  batten_add(below->spans, middle->spans, &room);
  batten_add(room, above->spans, &room);
  batten_add(room, 3, &room);
  double *breaks = batten_alloc_array(ctx, room, sizeof *breaks);
  unsigned *folds = batten_alloc_array(ctx, room, sizeof *folds);
  batten_status st = BATTEN_E_NOMEM;
  if (breaks && folds) {
    size_t spans = combine(below, middle, above, breaks, folds);
    st = loft_space_make(ctx, like->degree, like->closed, spans, breaks, folds, out);
  }
  batten_free(ctx, folds);
  batten_free(ctx, breaks);
  return st;
}

batten_status loft_space_union(batten_context *ctx, const loft_space *a, const loft_space *b, loft_space *out) {
  ladder first = ladder_of(a), second = ladder_of(b);
  return combine_into(ctx, a, &second, &first, &second, out);
}

batten_status loft_space_common(batten_context *ctx, const loft_space *below, const loft_space *middle,
                                const loft_space *above, loft_space *out) {
  ladder lower = ladder_of(below), own = ladder_of(middle), upper = ladder_of(above);
  return combine_into(ctx, middle, &lower, &own, &upper, out);
}

batten_status loft_space_insert(batten_context *ctx, const loft_space *from, size_t count, const double *knots,
                                const unsigned *folds, loft_space *out) {
  ladder own = ladder_of(from), further = {count - 1, knots, folds};
  if (count == 0) further = own;
  return combine_into(ctx, from, &further, &own, &further, out);
}

/* ---- matrices ------------------------------------------------------------------------------------ */

void loft_matrix_free(batten_context *ctx, loft_matrix *m) {
  batten_free(ctx, m->starts);
  batten_free(ctx, m->indices);
  batten_free(ctx, m->values);
  *m = (loft_matrix){0};
}

void loft_matrix_apply(const loft_matrix *m, const double *x, double *y) {
  for (size_t i = 0; i < m->rows; i++) {
    double sum[2] = {0, 0};
    for (size_t e = m->starts[i]; e < m->starts[i + 1]; e++)
      for (size_t k = 0; k < 2; k++) sum[k] += m->values[e] * x[2 * m->indices[e] + k];
    y[2 * i] = sum[0];
    y[2 * i + 1] = sum[1];
  }
}

/* Rows [rows][width] that begin at function first[i] of an unrolled space: without zeros, columns modulo `columns`
 * and ascending. Appends to m, whose arrays have room. */
static void compress(size_t rows, size_t width, const size_t *first, const double *dense, loft_matrix *m) {
  size_t entries = 0;
  m->starts[0] = 0;
  for (size_t i = 0; i < rows; i++) {
    for (size_t k = 0; k < width; k++) {
      double value = dense[i * width + k];
      if (value == 0) continue;
      uint32_t column = (uint32_t)((first[i] + k) % m->columns);
      size_t at = entries++;
      for (; at > m->starts[i] && m->indices[at - 1] > column; at--) {
        m->indices[at] = m->indices[at - 1];
        m->values[at] = m->values[at - 1];
      }
      m->indices[at] = column;
      m->values[at] = value;
    }
    m->starts[i + 1] = entries;
  }
}

/* Control points over knots `to` of those in `from`; `around`: the last of them is the first. */
static batten_status insertion(batten_context *ctx, const loft_space *from, const bspline *to, bool around,
                               loft_matrix *out) {
  size_t rows = to->count, width = (size_t)from->degree + 1, entries = 0;
  if (from->count > UINT32_MAX)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "contours: %zu control points; give fewer knots", from->count);
  loft_matrix m = {.rows = rows, .columns = from->count};
  batten_status st = BATTEN_E_NOMEM;
  double *dense = batten_alloc_array(ctx, rows, width * sizeof *dense);
  size_t *first = batten_alloc_array(ctx, rows, sizeof *first);
  if (!dense || !first) goto done;
  bspline_insertion(&from->b, to, first, dense);
  if (around) {
    first[rows - 1] = first[0];
    memcpy(dense + (rows - 1) * width, dense, width * sizeof *dense);
  }
  for (size_t k = 0; k < rows * width; k++) entries += dense[k] != 0;
  m.starts = batten_alloc_array(ctx, rows + 1, sizeof *m.starts);
  m.indices = batten_alloc_array(ctx, entries, sizeof *m.indices);
  m.values = batten_alloc_array(ctx, entries, sizeof *m.values);
  if (!m.starts || !m.indices || !m.values) goto done;
  compress(rows, width, first, dense, &m);
  *out = m;
  m = (loft_matrix){0};
  st = BATTEN_OK;
done:
  loft_matrix_free(ctx, &m);
  batten_free(ctx, first);
  batten_free(ctx, dense);
  return st;
}

batten_status loft_insertion(batten_context *ctx, const loft_space *from, const loft_space *to, loft_matrix *out) {
  /* Of a periodic space one period of functions. */
  bspline knots = {to->degree, to->count, to->knots};
  return insertion(ctx, from, &knots, false, out);
}

batten_status loft_clamped(batten_context *ctx, const loft_space *from, size_t *knot_count, double **knots,
                           loft_matrix *out) {
  unsigned d = from->degree;
  size_t inner = from->count - (from->closed ? from->folds[0] : d + 1), all = inner + 2 * ((size_t)d + 1);
  double *u = batten_alloc_array(ctx, all, sizeof *u);
  if (!u) return BATTEN_E_NOMEM;
  for (size_t k = 0; k <= d; k++) {
    u[k] = 0;
    u[d + 1 + inner + k] = 1;
  }
  memcpy(u + d + 1, from->knots + d + 1, inner * sizeof *u);
  bspline to = {d, inner + d + 1, u};
  batten_status st = insertion(ctx, from, &to, from->closed, out);
  if (st >= 0) {
    *knots = u;
    *knot_count = all;
    u = NULL;
  }
  batten_free(ctx, u);
  return st;
}
