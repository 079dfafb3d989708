/* Affine maps: f(matrix^-1 (x - shift)).
 *
 * Multiples of rotations and mirrors keep distances: f is multiplied by the factor. */
#include <string.h>

#include "base/checked.h"
#include "frep/axis_frame.h"

/* y = inverse x + offset */
typedef struct affine_state {
  double inverse[9], offset[3];
  double scale;   /* of f: 1 but for multiples of a rotation or mirror */
  double stretch; /* |inverse| at most */
} affine_state;

static unsigned affine_places(const batten_frep *a, const double *x, frep_place *p) {
  const affine_state *s = a->state;
  unsigned n = a->n;
  for (unsigned i = 0; i < n; i++) {
    double sum = 0;
    for (unsigned j = 0; j < n; j++) {
      sum += s->inverse[i * n + j] * x[j];
      p->jacobian[i][j] = s->inverse[i * n + j];
    }
    p->y[i] = sum + s->offset[i];
  }
  p->limit = INFINITY;
  return 1;
}

static unsigned affine_images(const batten_frep *a, const interval *x, frep_image *image) {
  const affine_state *s = a->state;
  for (unsigned i = 0; i < a->n; i++)
    image->y[i] = interval_add(frep_linear_range(a->n, s->inverse + i * a->n, x), interval_of(s->offset[i]));
  *image = (frep_image){
      .y = {image->y[0], image->y[1], image->y[2]}, .limit = {INFINITY, INFINITY}, .stretch = s->stretch};
  return 1;
}

static batten_status affine_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                     double *values, double *gradients) {
  double scale = ((const affine_state *)a->state)->scale;
  batten_status st = frep_map_evaluate(a, ctx, affine_places, count, points, values, gradients);
  for (size_t i = 0; st >= 0 && i < count; i++) values[i] *= scale;
  for (size_t i = 0; st >= 0 && gradients && i < count * a->n; i++) gradients[i] *= scale;
  return st;
}

static batten_status affine_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                   double *ranges) {
  double scale = ((const affine_state *)a->state)->scale;
  batten_status st = frep_map_bounds(a, ctx, affine_images, count, boxes, ranges, NULL);
  for (size_t i = 0; st >= 0 && scale != 1 && i < count; i++) {
    interval r = interval_scale((interval){ranges[2 * i], ranges[2 * i + 1]}, scale);
    ranges[2 * i] = r.lo;
    ranges[2 * i + 1] = r.hi;
  }
  return st;
}

static batten_status affine_slopes(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                   double *slopes) {
  batten_status st = frep_map_bounds(a, ctx, affine_images, count, boxes, NULL, slopes);
  for (size_t i = 0; st >= 0 && i < count; i++) slopes[i] *= ((const affine_state *)a->state)->scale;
  return st;
}

static bool affine_box(const batten_frep *a, double *lower, double *upper) {
  unsigned n = a->n;
  double low[3], high[3];
  if (!frep_structural_box(a->children[0], low, high)) return false;
  bool empty = frep_box_empty(n, low, high);
  for (unsigned i = 0; i < n; i++) {
    interval x[3];
    for (unsigned k = 0; k < n; k++) x[k] = (interval){low[k], high[k]};
    if (empty) {
      lower[i] = 1, upper[i] = -1;
      continue;
    }
    interval range = interval_add(frep_linear_range(n, a->numbers + i * n, x), interval_of(a->numbers[n * n + i]));
    lower[i] = range.lo;
    upper[i] = range.hi;
  }
  return true;
}

/* Inverse by cofactors of the matrix brought to about 1 by a power of two; false where it has none: det below the
 * rounding of its terms. */
bool frep_invert(unsigned n, const double *matrix, double *inverse) {
  double m[9], largest = 0, row[3] = {0}, det, product = 1;
  for (unsigned i = 0; i < n * n; i++) largest = fmax(largest, fabs(matrix[i]));
  if (!(largest > 0)) return false;
  double unit = batten_unit(largest);
  for (unsigned i = 0; i < n * n; i++) {
    m[i] = matrix[i] * unit;
    row[i / n] += m[i] * m[i];
  }
  for (unsigned i = 0; i < n; i++) product *= sqrt(row[i]);
  if (n == 2) {
    det = m[0] * m[3] - m[1] * m[2];
    const double adjoint[4] = {m[3], -m[1], -m[2], m[0]};
    for (unsigned i = 0; i < 4; i++) inverse[i] = adjoint[i];
  } else {
    for (unsigned i = 0; i < 3; i++)
      for (unsigned j = 0; j < 3; j++) {
        unsigned a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
        inverse[3 * i + j] = m[3 * a + c] * m[3 * b + d] - m[3 * a + d] * m[3 * b + c];
      }
    det = m[0] * inverse[0] + m[1] * inverse[3] + m[2] * inverse[6];
  }
  if (!(fabs(det) > 1e-14 * product)) return false;
  for (unsigned i = 0; i < n * n; i++) inverse[i] = inverse[i] / det * unit;
  return batten_first_nonfinite(n * n, inverse) == n * n;
}

/* s where matrix is s times a rotation or mirror, else 0. 1e-12: what products of turns computed in double precision
 * lose, and more. */
static double common_scale(unsigned n, const double *matrix) {
  double square[3][3], mean = 0;
  for (unsigned i = 0; i < n; i++)
    for (unsigned j = 0; j < n; j++) {
      square[i][j] = 0;
      for (unsigned k = 0; k < n; k++) square[i][j] += matrix[i * n + k] * matrix[j * n + k];
      if (i == j) mean += square[i][j] / n;
    }
  for (unsigned i = 0; i < n; i++)
    for (unsigned j = 0; j < n; j++)
      if (!(fabs(square[i][j] - (i == j ? mean : 0)) <= 1e-12 * mean)) return 0;
  double s = sqrt(mean);
  return fabs(s - 1) <= 1e-14 ? 1 : s;
}

batten_status batten_frep_affine(batten_context *ctx, batten_frep *a, const double *matrix, const double *shift,
                                 batten_frep **out) {
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0) st = frep_check_node(ctx, "a", a, 0);
  if (st < 0) return st;
  unsigned n = a->n;
  st = frep_check_numbers(ctx, "matrix", (size_t)n * n, matrix);
  if (st >= 0) st = frep_check_numbers(ctx, "shift", n, shift);
  if (st < 0) return st;
  affine_state s = {.scale = 1};
  if (!frep_invert(n, matrix, s.inverse))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "matrix: has no inverse; give one whose rows do not depend on each "
                       "other");
  for (unsigned i = 0; i < n; i++) {
    s.offset[i] = 0;
    for (unsigned j = 0; j < n; j++) s.offset[i] -= s.inverse[i * n + j] * shift[j];
  }
  double scale = common_scale(n, matrix);
  if (scale > 0) s.scale = scale;
  for (unsigned i = 0; i < n * n; i++) s.stretch += s.inverse[i] * s.inverse[i];
  s.stretch = scale > 0 ? (1 + 1e-11) / scale : sqrt(s.stretch) * (1 + 1e-12);
  double numbers[12];
  memcpy(numbers, matrix, n * n * sizeof *numbers);
  memcpy(numbers + n * n, shift, n * sizeof *numbers);
  affine_state *state = batten_alloc(ctx, sizeof *state);
  if (!state) return BATTEN_E_NOMEM;
  *state = s;
  batten_frep_parts parts = {
      .n = n, .number_count = n * n + n, .numbers = numbers, .child_count = 1, .children = {a}};
  st = frep_make(ctx, &frep_class_affine, &parts, scale > 0 && a->distance, state, out);
  if (st < 0) batten_free(ctx, state);
  return st;
}

static batten_status affine_create(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  size_t n = parts->n;
  batten_status st = frep_check_parts(ctx, parts, n * n + n, 1);
  if (st >= 0) st = frep_check_node(ctx, "a", parts->children[0], parts->n);
  return st < 0 ? st : batten_frep_affine(ctx, parts->children[0], parts->numbers, parts->numbers + n * n, out);
}

const frep_class frep_class_affine = {.kind = BATTEN_FREP_KIND_AFFINE,
                                      .name = "affine",
                                      .evaluate = affine_evaluate,
                                      .bounds = affine_bounds,
                                      .slopes = affine_slopes,
                                      .box = affine_box,
                                      .create = affine_create};
