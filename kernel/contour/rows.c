/* Linear inequalities around a reference curve.   [section 2.2 (ii), Lemma, eq. 3]
 *
 * Of the 4 d - 2 inequalities of a piece (see wedges.h; here for sign +) 2 d are enough: a_(i+1) is a_i plus a
 * positive multiple of c_i, so that
 *
 *   [u, a_(i+1)] >= [u, a_i]   where [u, c_i] >= 0,      [a_i, v] >= [a_(i+1), v]   where [v, c_i] >= 0,
 *
 * and [u, a_0], [a_(d-1), v] bring the others with them.
 *
 * Where two pieces meet, the last vector of one is the first one of the other, and their inequalities for it are half
 * planes [w, c] >= 0 or [w, a] >= 0 that hold strictly for the reference: all w lie in an open half plane, and one
 * that is a combination of two others with coefficients >= 0 is implied by them. So
 *
 *   - of the four u, v for the second derivative, where it is continuous, the two outermost stay;
 *   - of the two rows for the first derivative, [a, v] of the piece before and that with u of the piece after, one
 * goes if the other and what the piece already knows of a imply it. Inside a run the two bound opposite sides, and
 * that is rare; at an inflection they bound the same side, and it is the rule.
 *
 * What is implied holds with its own margin too, as right sides are linear in the row. A row for the second
 * derivative at an inflection of a C^2 curve is 0 by the equalities and is never written. */
#include <string.h>

#include "base/checked.h"
#include "wedges.h"

/* Rounds that make a place as straight, or as slow, as they may each leave `margin` of what it had: after some,
 * nothing that rounding does not swallow. Rows of first and second differences with little left keep this, or nine
 * tenths. What they assure of [x', x''] is at least the product of both, and has to stay above rounding. */
static const double FLOORS[2] = {1e-6, 1e-10};

/* Rows that are not written. */
enum {
  FIRST_U = 1, /* [u, a_0] */
  LAST_V = 2,  /* [a_(d-1), v] */
  SECOND_FIRST_U = 4,
  SECOND_FIRST_V = 8, /* of c_0 */
  SECOND_LAST_U = 16,
  SECOND_LAST_V = 32 /* of c_(d-2) */
};

/* w = p a + q b with p, q >= 0? */
static bool implied(const double w[2], const double a[2], const double b[2]) {
  double size = contour_cross(a, b), sign = size < 0 ? -1 : 1;
  return size != 0 && sign * contour_cross(w, b) >= 0 && sign * contour_cross(a, w) >= 0;
}

/* The same second derivative at the end of piece q and the begin of piece r. */
static void thin_second(const contour_wedge *q, const contour_wedge *r, unsigned char *drop_q,
                        unsigned char *drop_r) {
  const double *w[4] = {q->u, q->v, r->u, r->v};
  const unsigned char bit[4] = {SECOND_LAST_U, SECOND_LAST_V, SECOND_FIRST_U, SECOND_FIRST_V};
  int low = 0, high = 0;
  for (int i = 1; i < 4; i++) {
    if (contour_cross(w[i], w[low]) > 0) low = i;
    if (contour_cross(w[high], w[i]) > 0) high = i;
  }
  for (int i = 0; i < 4; i++)
    if (i != low && i != high) *(i < 2 ? drop_q : drop_r) |= bit[i];
}

/* The same first derivative. That of q has [u_q, a] from its begin on, that of r has [a, v_r] from its end on: what q
 * knows comes from before, and what r knows from behind, so that no two rows go because of each other. Round a closed
 * curve they might; nothing that comes from further away is used at its seam. */
static void thin_first(const contour_wedge *q, const contour_wedge *r, bool seam, unsigned char *drop_q,
                       unsigned char *drop_r) {
  bool same = q->sign == r->sign;
  double side = same ? 1 : -1;
  const double ahead[2] = {side * r->u[0], side * r->u[1]}, behind[2] = {-q->v[0], -q->v[1]};
  const double far[2] = {-r->v[0], -r->v[1]};
  if (!seam && implied(ahead, q->u, behind))
    *drop_r |= FIRST_U;
  else if ((!seam || !same) && implied(behind, ahead, same ? far : q->u))
    *drop_q |= LAST_V;
}

static void thin(const contour_shape *shape, size_t count, const contour_wedge *wedges, unsigned char *drop) {
  for (size_t i = 0; i < count; i++) {
    size_t next = i + 1 < count ? i + 1 : 0;
    bool seam = next == 0;
    if (seam && !shape->closed) continue;
    const contour_wedge *q = &wedges[i], *r = &wedges[next];
    bool inside = q->mu == r->mu && !seam;
    if (q->sign == r->sign && (inside || shape->smoothness > 1)) thin_second(q, r, &drop[i], &drop[next]);
    thin_first(q, r, seam, &drop[i], &drop[next]);
  }
}

/* ---- writing ------------------------------------------------------------------------------------ */

typedef struct writer {
  size_t rows, entries;
  double *values, *lower;
  size_t *starts;
  uint32_t *indices;
} writer;

/* sign [w, A x] >= margin of what the reference has, or `least`. */
static void write_row(writer *out, const bspline *b, const double *coefficients, const contour_wedge *piece,
                      const double w[2], double sign, const double *reference, double margin, double least) {
  double size = 0, value = 0;
  for (unsigned j = 0; j <= b->degree; j++) size += coefficients[j] * coefficients[j];
  size = sqrt(size);
  for (unsigned j = 0; j <= b->degree; j++) {
    if (coefficients[j] == 0) continue;
    size_t point = piece->mu - b->degree + j;
    for (int k = 0; k < 2; k++) {
      double entry = sign * (k == 0 ? -w[1] : w[0]) * (coefficients[j] / size);
      value += entry * reference[2 * point + (size_t)k];
      out->indices[out->entries] = (uint32_t)(2 * point) + (uint32_t)k;
      out->values[out->entries++] = entry;
    }
  }
  out->lower[out->rows++] = fmax(margin * value, fmin(0.9 * value, least));
  out->starts[out->rows] = out->entries;
}

/* Rows of a piece; out NULL: their number only. */
static size_t write_piece(writer *out, const contour_shape *shape, const bspline *b, const contour_wedge *w,
                          unsigned char drop, const double *reference, double margin) {
  contour_piece p;
  unsigned order = b->degree + 1, last = b->degree - 2;
  size_t rows = 0;
  contour_piece_set(&p, shape, b, w);
  if (!(drop & FIRST_U)) {
    if (out) write_row(out, b, p.first, w, w->u, w->sign, reference, margin, FLOORS[0]);
    rows++;
  }
  for (unsigned i = p.zero_first ? 1 : 0; i + (p.zero_last ? 1 : 0) <= last; i++) {
    unsigned char bits = 0;
    if (i == 0) bits |= drop & (SECOND_FIRST_U | SECOND_FIRST_V);
    if (i == last) bits |= drop & (SECOND_LAST_U | SECOND_LAST_V);
    if (!(bits & (SECOND_FIRST_U | SECOND_LAST_U))) {
      if (out) write_row(out, b, p.second + i * order, w, w->u, w->sign, reference, margin, FLOORS[1]);
      rows++;
    }
    if (!(bits & (SECOND_FIRST_V | SECOND_LAST_V))) {
      if (out) write_row(out, b, p.second + i * order, w, w->v, w->sign, reference, margin, FLOORS[1]);
      rows++;
    }
  }
  if (!(drop & LAST_V)) {
    if (out) write_row(out, b, p.first + (b->degree - 1) * order, w, w->v, -w->sign, reference, margin, FLOORS[0]);
    rows++;
  }
  return rows;
}

static batten_status writer_start(batten_context *ctx, writer *w, const bspline *b, size_t rows, size_t row_limit) {
  if (rows > row_limit)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE,
                       "row_limit: %zu inequalities are too few, %zu are needed; raise it, or lower depth_max",
                       row_limit, rows);
  size_t entries, longest = 2 * ((size_t)b->degree + 1);
  if (b->count > UINT32_MAX / 2 || !batten_mul(rows, longest, &entries))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu inequalities for %zu control points are too many", rows,
                       b->count);
  w->lower = batten_alloc_array(ctx, rows, sizeof *w->lower);
  w->starts = batten_alloc_array(ctx, rows + 1, sizeof *w->starts);
  w->indices = batten_alloc_array(ctx, entries, sizeof *w->indices);
  w->values = batten_alloc_array(ctx, entries, sizeof *w->values);
  if (!w->lower || !w->starts || !w->indices || !w->values) return BATTEN_E_NOMEM;
  w->starts[0] = 0;
  return BATTEN_OK;
}

static void writer_free(batten_context *ctx, writer *w) {
  batten_free(ctx, w->values);
  batten_free(ctx, w->indices);
  batten_free(ctx, w->starts);
  batten_free(ctx, w->lower);
}

batten_status contour_rows_make(batten_context *ctx, const contour_shape *shape, const bspline *b,
                                const double *reference, const contour_row_options *opt, const contour_rows *old,
                                bool *accepted, contour_rows *out) {
  contour_wedge *wedges = NULL;
  unsigned char *drop = NULL;
  writer w = {.rows = 0};
  size_t count = 0, rows = 0;
  unsigned depth = 0;
  batten_status st = contour_wedges_make(ctx, shape, b, reference, opt, old, accepted, out ? &wedges : NULL, &count);
  if (st < 0 || !*accepted || !out) return st;
  st = BATTEN_E_NOMEM;
  drop = batten_alloc_array(ctx, count, sizeof *drop);
  if (!drop) goto done;
  memset(drop, 0, count);
  thin(shape, count, wedges, drop);
  for (size_t i = 0; i < count; i++) {
    rows += write_piece(NULL, shape, b, &wedges[i], drop[i], reference, opt->margin);
    double whole = b->knots[wedges[i].mu + 1] - b->knots[wedges[i].mu];
    unsigned halved = (unsigned)lround(log2(whole / (wedges[i].to - wedges[i].from)));
    if (halved > depth) depth = halved;
  }
  st = writer_start(ctx, &w, b, rows, opt->row_limit);
  if (st < 0) goto done;
  for (size_t i = 0; i < count; i++) write_piece(&w, shape, b, &wedges[i], drop[i], reference, opt->margin);
  *out = (contour_rows){batten_matrix_sparse(w.rows, 2 * b->count, w.starts, w.indices, w.values), w.lower, wedges,
                        count, depth};
  w = (writer){.rows = 0};
  wedges = NULL;
done:
  writer_free(ctx, &w);
  batten_free(ctx, drop);
  batten_free(ctx, wedges);
  return st;
}

void contour_rows_free(batten_context *ctx, contour_rows *rows) {
  batten_free(ctx, (void *)(uintptr_t)rows->matrix.starts);
  batten_free(ctx, (void *)(uintptr_t)rows->matrix.indices);
  batten_free(ctx, (void *)(uintptr_t)rows->matrix.values);
  batten_free(ctx, rows->lower);
  batten_free(ctx, rows->wedges);
  *rows = (contour_rows){.depth = 0};
}
