/* Contours that no surface can go through: what is told before anything is computed, and neighbours that run against
 * each other. */
#include "contours_inner.h"

#include <stdio.h>

#include "base/checked.h"

/* Of the largest coordinate: boxes below that are rounding. */
static const double POINT = 0x1p-46;
/* Of the domain's length: what domains may differ by. */
static const double DOMAIN = 0x1p-40;

static void get_domain(const batten_curve_form *f, double out[2]) {
  out[0] = f->knots[0];
  out[1] = f->knots[f->knot_count - 1];
}

static batten_status check_heights(batten_context *ctx, size_t count, const double *heights) {
  size_t bad = batten_first_nonfinite(count, heights);
  if (bad < count)
    return batten_fail(ctx, BATTEN_E_INVALID, "heights[%zu]: %g; give finite heights", bad, heights[bad]);
  for (size_t i = 1; i < count; i++)
    if (!(heights[i - 1] < heights[i]))
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "heights[%zu]: %.17g is not above heights[%zu], %.17g; sort contours by height, and give "
                         "one for each height",
                         i, heights[i], i - 1, heights[i - 1]);
  double mean = (heights[count - 1] / 2 - heights[0] / 2) / (double)(count - 1) * 2;
  if (!isfinite(heights[count - 1] - heights[0]) || !isfinite(mean))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "heights[%zu]: %g is further from heights[0], %g, than a double can say; scale them",
                       count - 1, heights[count - 1], heights[0]);
  for (size_t i = 1; i < count; i++)
    if (!(heights[i - 1] - heights[0] < heights[i] - heights[0]))
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "heights[%zu]: %.17g and heights[%zu], %.17g, do not differ to rounding seen from "
                         "heights[0], %.17g; leave one of the contours out",
                         i, heights[i], i - 1, heights[i - 1], heights[0]);
  return BATTEN_OK;
}

/* Kind and domain, as those of the first. */
static batten_status check_kind(batten_context *ctx, const char *name, const batten_curve_form *first,
                                const batten_curve_form *f) {
  static const char *const kinds[2] = {"open", "closed"};
  if ((f->closed != 0) != (first->closed != 0))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "%s: %s, but contours[0] is %s; give all open, or all closed ones (batten_curve_part opens a "
                       "closed curve)",
                       name, kinds[f->closed != 0], kinds[first->closed != 0]);
  double a[2], b[2];
  get_domain(first, a);
  get_domain(f, b);
  double most = DOMAIN * (a[1] - a[0]);
  if (!(fabs(a[0] - b[0]) <= most && fabs(a[1] - b[1]) <= most))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "%s: from t = %.17g to %.17g, but contours[0] from %.17g to %.17g; bring it there by "
                       "batten_curve_transform",
                       name, b[0], b[1], a[0], a[1]);
  return BATTEN_OK;
}

static batten_status check_contour(batten_context *ctx, size_t i, const batten_curve_form *f) {
  if (f->degree < 2)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "contours[%zu]: of degree 1, a polygon, which has no curvature; fit a curve of degree 2 or "
                       "more (batten_contour_fit)",
                       i);
  size_t count = f->knot_count - f->degree - 1;
  double lower[2], upper[2], most = 0;
  for (size_t x = 0; x < 2; x++) {
    lower[x] = upper[x] = f->control_points[x];
    for (size_t j = 0; j < count; j++) {
      lower[x] = fmin(lower[x], f->control_points[2 * j + x]);
      upper[x] = fmax(upper[x], f->control_points[2 * j + x]);
    }
    most = fmax(most, fmax(fabs(lower[x]), fabs(upper[x])));
  }
  if (!(fmax(upper[0] - lower[0], upper[1] - lower[1]) > POINT * most))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "contours[%zu]: all its control points are (%.17g, %.17g), to rounding; a contour needs a "
                       "length: leave it out",
                       i, f->control_points[0], f->control_points[1]);
  return BATTEN_OK;
}

static batten_status check_slopes(batten_context *ctx, const batten_loft_options *opt, unsigned degree,
                                  const batten_curve_form *first) {
  for (size_t e = 0; e < 2; e++) {
    if (!opt->slopes[e]) continue;
    batten_curve_form f = batten_curve_get(opt->slopes[e]);
    char name[32];
    snprintf(name, sizeof name, "opt.slopes[%zu]", e);
    if (f.degree > degree)
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "%s: of degree %u, the contours of %u; give one of that degree or a lower one, or raise the "
                         "contours by batten_curve_elevate",
                         name, f.degree, degree);
    batten_status st = check_kind(ctx, name, first, &f);
    if (st < 0) return st;
  }
  return BATTEN_OK;
}

batten_status contours_check(batten_context *ctx, size_t count, const batten_curve *const *contours,
                             const double *heights, const batten_loft_options *opt) {
  if (!contours || !heights)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give %zu", contours ? "heights" : "contours", count);
  if (count < 2) return batten_fail(ctx, BATTEN_E_INVALID, "count: %zu contours; give 2 or more", count);
  for (size_t i = 0; i < count; i++)
    if (!contours[i]) return batten_fail(ctx, BATTEN_E_INVALID, "contours[%zu]: NULL; give a curve", i);
  batten_status st = check_heights(ctx, count, heights);
  batten_curve_form first = batten_curve_get(contours[0]);
  unsigned degree = 0;
  for (size_t i = 0; i < count && st >= 0; i++) {
    batten_curve_form f = batten_curve_get(contours[i]);
    char name[32];
    snprintf(name, sizeof name, "contours[%zu]", i);
    if (f.degree > degree) degree = f.degree;
    st = check_contour(ctx, i, &f);
    if (st >= 0) st = check_kind(ctx, name, &first, &f);
  }
  return st < 0 ? st : check_slopes(ctx, opt, degree, &first);
}

/* ---- directions ---------------------------------------------------------------------------------- */

enum { CHORDS = 64 };

/* Of the chords of a contour at equal steps of t: their directions, 0 for chords that vanish. */
typedef struct course {
  double point[CHORDS + 1][2], chord[CHORDS][2];
  double area, length, turn; /* of that polygon; turn: the sum of angles between chords */
} course;

static void walk(const contours_raw *r, course *out) {
  double row[BSPLINE_ORDER];
  for (size_t k = 0; k <= CHORDS; k++) {
    double t = (double)k / CHORDS;
    size_t mu = bspline_span(&r->b, t);
    bspline_basis(&r->b, mu, t, 0, row);
    for (size_t x = 0; x < 2; x++) {
      double sum = 0;
      for (size_t j = 0; j <= r->b.degree; j++) sum += row[j] * r->points[2 * (mu - r->b.degree + j) + x];
      out->point[k][x] = sum;
    }
  }
  out->area = out->length = out->turn = 0;
  const double *last = NULL;
  for (size_t k = 0; k < CHORDS; k++) {
    double from[2], to[2];
    for (size_t x = 0; x < 2; x++) {
      out->chord[k][x] = out->point[k + 1][x] - out->point[k][x];
      from[x] = out->point[k][x] - out->point[0][x];
      to[x] = out->point[k + 1][x] - out->point[0][x];
    }
    out->area += loft_cross(from, to) / 2;
    double *c = out->chord[k], length = hypot(c[0], c[1]);
    out->length += length;
    for (size_t x = 0; x < 2; x++) c[x] = length > 0 ? c[x] / length : 0;
    if (last && length > 0) out->turn += atan2(loft_cross(last, c), last[0] * c[0] + last[1] * c[1]);
    if (length > 0) last = c;
  }
}

/* Mean cosine between chords of a and b; of b reversed. */
static double agreement(const course *a, const course *b, bool reversed) {
  double sum = 0;
  for (size_t k = 0; k < CHORDS; k++) {
    const double *p = a->chord[k], *q = b->chord[reversed ? CHORDS - 1 - k : k];
    sum += (reversed ? -1 : 1) * (p[0] * q[0] + p[1] * q[1]);
  }
  return sum / CHORDS;
}

/* Closed ones: around opposite sides, beyond what figures of eight leave of an area, and turning so (lines that cross
 * themselves may enclose more of the other side). Open ones: the second one's
 * chords fit those of the first better when it is reversed, and do not fit as they are; where both bend to the same
 * side on the whole they are not reversed but turned (reversing makes left bends right ones). */
static bool run_against(bool closed, const course *a, const course *b) {
  static const double ROUND = 1e-3, BENT = 0.5, FITS = 0.25;
  if (closed)
    return a->area * b->area < 0 && a->turn * b->turn < 0 && fmin(fabs(a->turn), fabs(b->turn)) > BENT &&
           fabs(a->area) > ROUND * a->length * a->length && fabs(b->area) > ROUND * b->length * b->length;
  bool same_side = a->turn * b->turn > 0 && fmin(fabs(a->turn), fabs(b->turn)) > BENT;
  double as_is = agreement(a, b, false);
  return !same_side && as_is < FITS && agreement(a, b, true) > as_is;
}

batten_status contours_check_directions(batten_context *ctx, size_t count, const contours_raw *raw) {
  course *both = batten_alloc_array(ctx, 2, sizeof *both);
  if (!both) return BATTEN_E_NOMEM;
  batten_status st = BATTEN_OK;
  walk(raw, both);
  for (size_t i = 1; i < count && st >= 0; i++) {
    walk(raw + i, both + i % 2);
    if (run_against(raw->closed, both + (i - 1) % 2, both + i % 2))
      st = batten_fail(ctx, BATTEN_E_INVALID,
                       "contours[%zu]: runs against contours[%zu]%s; reverse it by batten_curve_reverse", i, i - 1,
                       raw->closed ? ", one clockwise and the other counter-clockwise" : " for most of its length");
  }
  batten_free(ctx, both);
  return st;
}
