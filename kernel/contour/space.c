/* Curves that satisfy the equalities of a fit, by elimination.   [Juettler: Construction of surfaces, section 2.2]
 *
 * Periodic curves have de Boor points p_j on the knots v_i, v_(q m) = ... = v_(q m + m - 1) the break q of the line
 * on which breaks are repeated by the period. The clamped points near the seam are values of blossoms there: rounds
 * of knot insertion, which are convex combinations of l + 1 neighbours; all other clamped points are p's.
 *
 * Breaks are d - 2 fold where l = 2, so that x''(break) is itself a control point of x'', to which three points
 * belong: x''(break) = 0   <=>   p_(j + 1) = (w_2 p_j + w_1 p_(j + 2)) / (w_1 + w_2), w_1, w_2 the lengths of the
 * supports of the two legs. The point in the middle is eliminated. For d = 3 those of neighbouring breaks would need
 * each other: a piece with x'' linear and 0 at both ends is straight. */
#include "contour_inner.h"

#include <string.h>

#include "base/checked.h"

/* What became of a base point: periodic ones of closed curves, else the clamped ones. */
enum { FREE, JOINED, FIXED, ALONG };

/* 3 points near the seam, each of them joined to 2, each of those along a tangent from an end: at most this many. */
enum { ENTRIES = 12 };

typedef struct combination {
  size_t count;
  uint32_t indices[ENTRIES];
  double values[ENTRIES];
  double offset;
} combination;

typedef struct builder {
  batten_context *ctx;
  const contour_shape *shape;
  const contour_ends *ends;
  unsigned degree, fold; /* fold of inner breaks */
  size_t count;          /* of clamped points */
  size_t bases;
  unsigned char *kinds; /* [bases] */
  uint32_t *first;      /* [bases] unknown of coordinate 0, or of the way along a tangent */
  double *parts;        /* [bases] weight of the point before, where joined */
} builder;

/* ---- knots -------------------------------------------------------------------------------------- */

/* Break q of the line seen from the seam: the same differences on both sides of it, to the bit. */
static double break_at(const contour_shape *s, ptrdiff_t q) {
  ptrdiff_t n = (ptrdiff_t)s->spans, turns = q / n;
  if (q - turns * n < 0) turns--;
  ptrdiff_t rest = q - turns * n;
  if (turns < 0 && rest > 0) return (double)(turns + 1) - (1 - s->breaks[rest]);
  return (double)turns + s->breaks[rest];
}

static double knot_at(const builder *b, ptrdiff_t i) {
  ptrdiff_t m = b->fold, q = i / m;
  if (i - q * m < 0) q--;
  return break_at(b->shape, q);
}

/* Knot i of base points: point j lives on the knots j .. j + degree + 1. */
static double base_knot(const builder *b, const double *clamped, ptrdiff_t i) {
  return b->shape->closed ? knot_at(b, i) : clamped[i];
}

static size_t base_index(const builder *b, ptrdiff_t j) {
  ptrdiff_t n = (ptrdiff_t)b->bases, rest = j % n;
  return (size_t)(rest < 0 ? rest + n : rest);
}

/* ---- equalities --------------------------------------------------------------------------------- */

/* x'' = 0 at break i. */
static batten_status join(builder *b, const double *clamped, size_t i) {
  bool closed = b->shape->closed;
  ptrdiff_t j = (ptrdiff_t)(i * b->fold) - (closed ? (ptrdiff_t)b->shape->smoothness + 1 : 0);
  ptrdiff_t d = b->degree;
  size_t middle = base_index(b, j + 1);
  double w1 = base_knot(b, clamped, j + d + 1) - base_knot(b, clamped, j + 1);
  double w2 = base_knot(b, clamped, j + d + 2) - base_knot(b, clamped, j + 2);
  b->kinds[middle] = JOINED;
  b->parts[middle] = w2 / (w1 + w2);
  if (b->kinds[base_index(b, j)] != JOINED && b->kinds[base_index(b, j + 2)] != JOINED) return BATTEN_OK;
  return batten_fail(b->ctx, BATTEN_E_INVALID,
                     "opt.inflections: those next to the parameter %g (of [0, 1]) have no other knot between them; "
                     "add a break there, or raise the degree above 3",
                     b->shape->breaks[i]);
}

static batten_status join_all(builder *b, const double *clamped, size_t *equalities) {
  const contour_shape *s = b->shape;
  for (size_t i = s->closed ? 0 : 1; i < s->spans; i++) {
    if (!contour_inflection(s, i)) continue;
    batten_status st = join(b, clamped, i);
    if (st < 0) return st;
    *equalities += 2;
  }
  return BATTEN_OK;
}

static bool point_fixed(const contour_ends *ends, int end) { return ends && !isnan(ends->point[end][0]); }
static bool tangent_fixed(const contour_ends *ends, int end) { return ends && !isnan(ends->tangent[end][0]); }

static batten_status fix_ends(builder *b, size_t *equalities) {
  bool both = tangent_fixed(b->ends, 0) && tangent_fixed(b->ends, 1);
  if (both && b->count < 4)
    return batten_fail(b->ctx, BATTEN_E_INVALID,
                       "opt.end_tangents: one piece of degree 2 cannot have both; ask for two spans at least");
  for (int end = 0; end < 2; end++) {
    size_t last = end ? b->count - 1 : 0, next = end ? b->count - 2 : 1;
    if (point_fixed(b->ends, end)) {
      b->kinds[last] = FIXED;
      *equalities += 2;
    }
    if (tangent_fixed(b->ends, end)) {
      b->kinds[next] = ALONG;
      *equalities += 1;
    }
  }
  return BATTEN_OK;
}

bool contour_forward(const contour_ends *ends, size_t count, const double *control) {
  for (int end = 0; end < 2; end++) {
    const double *a = control + (end ? 2 * count - 4 : 0);
    if (!tangent_fixed(ends, end)) continue;
    const double *t = ends->tangent[end];
    if (!((a[2] - a[0]) * t[0] + (a[3] - a[1]) * t[1] > 0)) return false;
  }
  return true;
}

static size_t number_unknowns(builder *b) {
  size_t unknowns = 0;
  for (size_t j = 0; j < b->bases; j++) {
    b->first[j] = (uint32_t)unknowns;
    unknowns += b->kinds[j] == FREE ? 2 : b->kinds[j] == ALONG ? 1 : 0;
  }
  return unknowns;
}

/* ---- rows of Z ---------------------------------------------------------------------------------- */

static void add_entry(combination *c, size_t index, double value) {
  size_t at = 0;
  if (value == 0) return;
  while (at < c->count && c->indices[at] != index) at++;
  if (at == c->count) {
    c->indices[at] = (uint32_t)index;
    c->values[at] = 0;
    c->count++;
  }
  c->values[at] += value;
}

/* An end's point, or one that is free. */
static void add_point(const builder *b, size_t j, int k, double weight, combination *c) {
  if (b->kinds[j] == FREE)
    add_entry(c, b->first[j] + (size_t)k, weight);
  else
    c->offset += weight * b->ends->point[j > 0][k];
}

/* Also one along a tangent. */
static void add_plain(const builder *b, size_t j, int k, double weight, combination *c) {
  if (b->kinds[j] != ALONG) {
    add_point(b, j, k, weight, c);
    return;
  }
  int end = b->count == 3 ? !tangent_fixed(b->ends, 0) : j != 1;
  add_point(b, end ? b->count - 1 : 0, k, weight, c);
  add_entry(c, b->first[j], weight * (end ? -1 : 1) * b->ends->tangent[end][k]);
}

static void add_base(const builder *b, ptrdiff_t index, int k, double weight, combination *c) {
  size_t j = base_index(b, index);
  if (b->kinds[j] != JOINED) {
    add_plain(b, j, k, weight, c);
    return;
  }
  double part = b->parts[j];
  add_plain(b, base_index(b, index - 1), k, weight * part, c);
  add_plain(b, base_index(b, index + 1), k, weight * (1 - part), c);
}

/* The value of the blossom with `rounds` arguments 0 (the seam) in place of knots: weights [rounds + 1] of the points
 * index - rounds .. index. */
static void seam_weights(const builder *b, ptrdiff_t index, unsigned rounds, double *weights) {
  double work[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}; /* row i: point index - rounds + i */
  ptrdiff_t d = b->degree;
  for (unsigned r = 1; r <= rounds; r++)
    for (unsigned i = rounds; i >= r; i--) {
      ptrdiff_t at = index - (ptrdiff_t)(rounds - i);
      double left = knot_at(b, at), right = knot_at(b, at + d - (ptrdiff_t)r + 1);
      double part = -left / (right - left);
      for (unsigned j = 0; j <= rounds; j++) work[i][j] = (1 - part) * work[i - 1][j] + part * work[i][j];
    }
  for (unsigned j = 0; j <= rounds; j++) weights[j] = work[rounds][j];
}

/* Coordinate k of clamped point j. */
static void make_row(const builder *b, size_t j, int k, combination *c) {
  *c = (combination){0};
  if (!b->shape->closed) {
    add_base(b, (ptrdiff_t)j, k, 1, c);
    return;
  }
  unsigned l = b->shape->smoothness;
  ptrdiff_t index = (ptrdiff_t)j - (ptrdiff_t)l - 1;
  size_t from_end = b->count - 1 - j;
  unsigned rounds = 0;
  double weights[3] = {1, 0, 0};
  if (j < l) {
    rounds = l - (unsigned)j;
    index = -1;
  } else if (from_end < l) {
    rounds = l - (unsigned)from_end;
    index = -1 - (ptrdiff_t)from_end;
  }
  seam_weights(b, index, rounds, weights);
  for (unsigned i = 0; i <= rounds; i++) add_base(b, index - (ptrdiff_t)(rounds - i), k, weights[i], c);
}

/* Ascending indices. */
static void sort_row(combination *c) {
  for (size_t i = 1; i < c->count; i++)
    for (size_t j = i; j > 0 && c->indices[j - 1] > c->indices[j]; j--) {
      uint32_t index = c->indices[j];
      double value = c->values[j];
      c->indices[j] = c->indices[j - 1];
      c->values[j] = c->values[j - 1];
      c->indices[j - 1] = index;
      c->values[j - 1] = value;
    }
}

/* Counts entries, and writes them where there is room. */
static size_t make_rows(const builder *b, contour_space *out) {
  size_t at = 0;
  combination c;
  for (size_t row = 0; row < 2 * b->count; row++) {
    make_row(b, row / 2, row % 2, &c);
    sort_row(&c);
    if (out->values) {
      out->starts[row] = at;
      out->offset[row] = c.offset;
      memcpy(out->indices + at, c.indices, c.count * sizeof *c.indices);
      memcpy(out->values + at, c.values, c.count * sizeof *c.values);
    }
    at += c.count;
  }
  if (out->values) out->starts[2 * b->count] = at;
  return at;
}

/* ---- the space ---------------------------------------------------------------------------------- */

static batten_status check_size(batten_context *ctx, const contour_shape *shape, unsigned degree) {
  size_t fold = degree - shape->smoothness, bases;
  if (!batten_mul(shape->spans, fold, &bases) || bases > (UINT32_MAX - 64) / 2)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "opt.spans: %zu spans of degree %u; ask for fewer", shape->spans,
                       degree);
  if (shape->closed && bases < 3)
    return batten_fail(
        ctx, BATTEN_E_INVALID,
        "opt.spans: a closed curve of %zu span%s has %zu free point%s, and it takes 3; ask for %zu spans "
        "or a higher degree",
        shape->spans, shape->spans == 1 ? "" : "s", bases, bases == 1 ? "" : "s", (3 + fold - 1) / fold);
  return BATTEN_OK;
}

static batten_status make_knots(batten_context *ctx, const contour_shape *shape, unsigned degree,
                                contour_space *out) {
  size_t count = bspline_make_knots(degree, shape->smoothness, shape->spans, shape->breaks + 1, 0, 1, NULL);
  out->knots = batten_alloc_array(ctx, count, sizeof *out->knots);
  if (!out->knots) return BATTEN_E_NOMEM;
  bspline_make_knots(degree, shape->smoothness, shape->spans, shape->breaks + 1, 0, 1, out->knots);
  out->b = (bspline){degree, count - degree - 1, out->knots};
  return BATTEN_OK;
}

static batten_status make_matrix(const builder *b, contour_space *out) {
  size_t entries = make_rows(b, out);
  out->starts = batten_alloc_array(b->ctx, 2 * b->count + 1, sizeof *out->starts);
  out->offset = batten_alloc_array(b->ctx, 2 * b->count, sizeof *out->offset);
  out->indices = batten_alloc_array(b->ctx, entries, sizeof *out->indices);
  out->values = batten_alloc_array(b->ctx, entries, sizeof *out->values);
  if (!out->starts || !out->offset || !out->indices || !out->values) return BATTEN_E_NOMEM;
  make_rows(b, out);
  return BATTEN_OK;
}

void contour_space_free(batten_context *ctx, contour_space *s) {
  batten_free(ctx, s->values);
  batten_free(ctx, s->indices);
  batten_free(ctx, s->offset);
  batten_free(ctx, s->starts);
  batten_free(ctx, s->knots);
  *s = (contour_space){0};
}

batten_status contour_space_make(batten_context *ctx, const contour_shape *shape, unsigned degree, bool inflections,
                                 const contour_ends *ends, contour_space *out) {
  contour_space space = {0};
  builder b = {.ctx = ctx, .shape = shape, .ends = ends, .degree = degree, .fold = degree - shape->smoothness};
  batten_status st = check_size(ctx, shape, degree);
  if (st >= 0) st = make_knots(ctx, shape, degree, &space);
  if (st < 0) return st;
  b.count = space.b.count;
  b.bases = shape->closed ? shape->spans * b.fold : b.count;
  b.kinds = batten_alloc_array(ctx, b.bases, sizeof *b.kinds);
  b.first = batten_alloc_array(ctx, b.bases, sizeof *b.first);
  b.parts = batten_alloc_array(ctx, b.bases, sizeof *b.parts);
  if (!b.kinds || !b.first || !b.parts) {
    st = BATTEN_E_NOMEM;
    goto done;
  }
  memset(b.kinds, FREE, b.bases);
  if (inflections && shape->smoothness == 2) st = join_all(&b, space.knots, &space.equalities);
  if (st >= 0 && !shape->closed) st = fix_ends(&b, &space.equalities);
  if (st < 0) goto done;
  space.unknowns = number_unknowns(&b);
  st = make_matrix(&b, &space);
  if (st < 0) goto done;
  *out = space;
  space = (contour_space){0};
done:
  contour_space_free(ctx, &space);
  batten_free(ctx, b.parts);
  batten_free(ctx, b.first);
  batten_free(ctx, b.kinds);
  return st;
}

void contour_space_expand(const contour_space *s, const double *y, double *control) {
  for (size_t row = 0; row < 2 * s->b.count; row++) {
    double sum = s->offset[row];
    for (size_t i = s->starts[row]; i < s->starts[row + 1]; i++) sum += s->values[i] * y[s->indices[i]];
    control[row] = sum;
  }
}
