/* Sum of squares and tension of curves as banded normal equations, and their minimum.
 *
 * The tension is integrated exactly by the products of Bernstein polynomials,
 *   int_0^1 B_i^p B_j^p = C(p, i) C(p, j) / (C(2 p, i + j) (2 p + 1)).
 * In a space control = offset + Z y the matrix is Z' H Z. Unknowns are numbered along the curve, so that it is
 * banded; of closed curves they are taken from both ends by turns (first, last, second, ...), which makes neighbours
 * across the seam neighbours and doubles the band. Where no tangent is fixed the coordinates are fitted apart, by one
 * factor.
 *
 * Points are taken in one by one in their order: the same bits for any number of threads. */
#include "contour_inner.h"

#include <float.h>
#include <string.h>

#include "base/checked.h"
#include "sparse/band.h"

enum { REFINEMENTS = 1 };

/* ---- the matrix --------------------------------------------------------------------------------- */

static double binomial(unsigned n, unsigned k) {
  double value = 1;
  for (unsigned i = 1; i <= k; i++) value = value * (n - k + i) / i;
  return value;
}

/* A span of length h has coefficients of 1 / h^3: in one that is far shorter than others the data would drown in
 * rounding. STIFF is how many times as stiff as the mean span one may be. */
static void make_bend(const bspline *b, double tension, double *bend) {
  static const double STIFF = 1e3;
  double spans = (double)bspline_span_count(b) / (bspline_upper(b) - bspline_lower(b));
  unsigned d = b->degree, order = d + 1;
  memset(bend, 0, b->count * order * sizeof *bend);
  if (d < 2 || !(tension > 0)) return;
  unsigned p = d - 2;
  double gram[BSPLINE_ORDER][BSPLINE_ORDER], rows[BSPLINE_ORDER * BSPLINE_ORDER];
  for (unsigned i = 0; i <= p; i++)
    for (unsigned j = 0; j <= p; j++)
      gram[i][j] = binomial(p, i) * binomial(p, j) / (binomial(2 * p, i + j) * (2 * p + 1));
  for (size_t mu = bspline_first(b); mu < b->count; mu = bspline_next(b, mu)) {
    double lower = b->knots[mu], upper = b->knots[mu + 1];
    double h = upper - lower, weight = h * tension * fmin(1, STIFF * pow(h * spans, 3));
    bspline_rows(b, mu, 2, lower, upper, rows);
    for (unsigned i = 0; i < order; i++)
      for (unsigned j = i; j < order; j++) {
        double sum = 0;
        for (unsigned r = 0; r <= p; r++)
          for (unsigned s = 0; s <= p; s++) sum += rows[r * order + i] * gram[r][s] * rows[s * order + j];
        bend[(mu - d + i) * order + j - i] += weight * sum;
      }
  }
}

batten_status contour_objective_new(batten_context *ctx, const bspline *b, contour_objective *out) {
  contour_objective o = {.b = *b};
  size_t entries;
  batten_mul(b->count, b->degree + 1, &entries);
  o.bend = batten_alloc_array(ctx, entries, sizeof *o.bend);
  o.band = batten_alloc_array(ctx, entries, sizeof *o.band);
  o.right = batten_alloc_array(ctx, b->count, 2 * sizeof *o.right);
  if (!o.bend || !o.band || !o.right) {
    contour_objective_free(ctx, &o);
    return BATTEN_E_NOMEM;
  }
  make_bend(b, 0, o.bend);
  memset(o.band, 0, entries * sizeof *o.band);
  memset(o.right, 0, 2 * b->count * sizeof *o.right);
  *out = o;
  return BATTEN_OK;
}

void contour_objective_free(batten_context *ctx, contour_objective *o) {
  batten_free(ctx, o->right);
  batten_free(ctx, o->band);
  batten_free(ctx, o->bend);
  *o = (contour_objective){0};
}

/* The span of t, where the one before is a good guess. */
static size_t span_near(const bspline *b, size_t mu, double t) {
  return b->knots[mu] <= t && t < b->knots[mu + 1] ? mu : bspline_span(b, t);
}

/* The functions of the span at t, by the recursion of de Boor and Cox. */
static void values_at(const bspline *b, size_t mu, double t, double *values) {
  double left[BSPLINE_ORDER], right[BSPLINE_ORDER];
  values[0] = 1;
  for (unsigned r = 1; r <= b->degree; r++) {
    double carry = 0;
    left[r] = t - b->knots[mu + 1 - r];
    right[r] = b->knots[mu + r] - t;
    for (unsigned i = 0; i < r; i++) {
      double part = values[i] / (right[i + 1] + left[r - i]);
      values[i] = carry + right[i + 1] * part;
      carry = left[r - i] * part;
    }
    values[r] = carry;
  }
}

static double weight_of(const contour_data *data, size_t i) { return data->weights ? data->weights[i] : 1; }

void contour_objective_set(contour_objective *o, const contour_data *data, const double *parameters, double tension) {
  const bspline *b = &o->b;
  size_t order = b->degree + 1, mu = bspline_first(b);
  double total = 0, values[BSPLINE_ORDER];
  memset(o->right, 0, 2 * b->count * sizeof *o->right);
  if (tension != o->tension) make_bend(b, tension, o->bend);
  o->tension = tension;
  memcpy(o->band, o->bend, b->count * order * sizeof *o->band);
  for (size_t i = 0; i < data->count; i++) total += weight_of(data, i);
  for (size_t i = 0; i < data->count; i++) {
    double weight = weight_of(data, i) / total;
    mu = span_near(b, mu, parameters[i]);
    values_at(b, mu, parameters[i], values);
    size_t first = mu - b->degree;
    for (size_t j = 0; j < order; j++) {
      double value = weight * values[j], *line = o->band + (first + j) * order;
      for (size_t k = j; k < order; k++) line[k - j] += value * values[k];
      o->right[2 * (first + j)] += value * data->points[2 * i];
      o->right[2 * (first + j) + 1] += value * data->points[2 * i + 1];
    }
  }
}

double contour_sum(const bspline *b, const double *control, const contour_data *data, const double *parameters) {
  size_t mu = bspline_first(b);
  double sum = 0, values[BSPLINE_ORDER];
  for (size_t i = 0; i < data->count; i++) {
    mu = span_near(b, mu, parameters[i]);
    values_at(b, mu, parameters[i], values);
    const double *first = control + 2 * (mu - b->degree);
    double x = -data->points[2 * i], y = -data->points[2 * i + 1];
    for (size_t j = 0; j <= b->degree; j++) {
      x += values[j] * first[2 * j];
      y += values[j] * first[2 * j + 1];
    }
    sum += weight_of(data, i) * (x * x + y * y);
  }
  return sum;
}

/* ---- the minimum in a space --------------------------------------------------------------------- */

/* Z' H Z in band form. Apart: one matrix for both coordinates, of unknowns / 2. */
typedef struct reduced {
  const contour_objective *o;
  const contour_space *space;
  bool apart, folded;
  size_t n, width;
  double *factor; /* [n][width + 1] */
  double *scale;  /* [n] that makes the diagonal ones */
} reduced;

/* Whether no row of Z mixes coordinates. */
static bool is_apart(const contour_space *s) {
  for (size_t row = 0; row < 2 * s->b.count; row++)
    for (size_t i = s->starts[row]; i < s->starts[row + 1]; i++)
      if (s->indices[i] % 2 != row % 2) return false;
  return s->unknowns % 2 == 0;
}

/* Whether the curve's two ends share unknowns. */
static bool is_closed(const contour_space *s) {
  size_t last = 2 * s->b.count - 2;
  return s->starts[1] > s->starts[0] && s->starts[last + 1] - s->starts[last] == s->starts[1] - s->starts[0] &&
         s->indices[s->starts[last]] == s->indices[s->starts[0]];
}

/* The place of an unknown in the band. */
static size_t place_of(const reduced *r, size_t unknown) {
  size_t i = r->apart ? unknown / 2 : unknown, count = r->n;
  if (!r->folded) return i;
  return i < (count + 1) / 2 ? 2 * i : 2 * (count - 1 - i) + 1;
}

/* One coefficient of H between rows a and b of Z: into the band, or (factor NULL) only its width. */
static void add_pair(reduced *r, size_t a, size_t b, double h) {
  const contour_space *s = r->space;
  for (size_t i = s->starts[a]; i < s->starts[a + 1]; i++)
    for (size_t j = s->starts[b]; j < s->starts[b + 1]; j++) {
      size_t p = place_of(r, s->indices[i]), q = place_of(r, s->indices[j]);
      if (!r->factor) {
        size_t apart = p > q ? p - q : q - p;
        if (apart > r->width) r->width = apart;
        continue;
      }
      double value = h * s->values[i] * s->values[j];
      if (a != b && p == q) value *= 2; /* (a, b) and (b, a) */
      if (a == b && p < q) continue;    /* comes again as (q, p) */
      size_t low = p < q ? p : q, high = p < q ? q : p;
      r->factor[low * (r->width + 1) + high - low] += value;
    }
}

static void add_pairs(reduced *r) {
  size_t n = r->o->b.count, order = r->o->b.degree + 1;
  for (size_t i = 0; i < n; i++)
    for (size_t k = 0; k < order && i + k < n; k++)
      for (size_t c = 0; c < (r->apart ? 1 : 2); c++)
        add_pair(r, 2 * i + c, 2 * (i + k) + c, r->o->band[i * order + k]);
}

/* False: not definite to rounding. */
static bool factor_scaled(reduced *r) {
  size_t n = r->n, line = r->width + 1;
  for (size_t i = 0; i < n; i++) {
    double diagonal = r->factor[i * line];
    if (!(diagonal > 0)) return false;
    r->scale[i] = 1 / sqrt(diagonal);
  }
  for (size_t j = 0; j < n; j++)
    for (size_t i = j; i < n && i <= j + r->width; i++) r->factor[j * line + i - j] *= r->scale[i] * r->scale[j];
  if (sparse_band_cholesky(n, r->width, r->factor) != 0) return false;
  double most = 0; /* inverses of the pivots' roots */
  for (size_t i = 0; i < n; i++) most = fmax(most, r->factor[i * line]);
  return 1 / (most * most) > 4 * (double)line * DBL_EPSILON;
}

/* right - H control, row by row of Z: residual [count][2]. */
static void residual_of(const contour_objective *o, const double *control, double *residual) {
  size_t n = o->b.count, order = o->b.degree + 1;
  memcpy(residual, o->right, 2 * n * sizeof *residual);
  for (size_t i = 0; i < n; i++)
    for (size_t k = 0; k < order && i + k < n; k++) {
      double h = o->band[i * order + k];
      size_t j = i + k;
      for (size_t c = 0; c < 2; c++) {
        residual[2 * i + c] -= h * control[2 * j + c];
        if (k > 0) residual[2 * j + c] -= h * control[2 * i + c];
      }
    }
}

/* y += (Z' H Z)^-1 Z' residual; work [n] */
static void correct(const reduced *r, const double *residual, double *work, double *y) {
  const contour_space *s = r->space;
  for (size_t c = 0; c < (r->apart ? 2 : 1); c++) {
    memset(work, 0, r->n * sizeof *work);
    for (size_t row = c; row < 2 * s->b.count; row += r->apart ? 2 : 1)
      for (size_t i = s->starts[row]; i < s->starts[row + 1]; i++)
        work[place_of(r, s->indices[i])] += s->values[i] * residual[row];
    for (size_t i = 0; i < r->n; i++) work[i] *= r->scale[i];
    sparse_band_forward(r->n, r->width, r->factor, work);
    sparse_band_backward(r->n, r->width, r->factor, work);
    for (size_t i = 0; i < r->n; i++) work[i] *= r->scale[i];
    for (size_t i = 0; i < r->n; i++) {
      size_t unknown = r->apart ? 2 * i + c : i;
      y[unknown] += work[place_of(r, unknown)];
    }
  }
}

batten_status contour_objective_solve(batten_context *ctx, const contour_objective *o, const contour_space *space,
                                      double *control) {
  reduced r = {.o = o, .space = space, .apart = is_apart(space), .folded = is_closed(space)};
  size_t entries;
  batten_status st = BATTEN_E_NOMEM;
  r.n = r.apart ? space->unknowns / 2 : space->unknowns;
  add_pairs(&r);
  batten_mul(r.n, r.width + 1, &entries);
  double *residual = batten_alloc_array(ctx, 2 * o->b.count, sizeof *residual);
  double *trial = batten_alloc_array(ctx, 2 * o->b.count, sizeof *trial);
  double *y = batten_alloc_array(ctx, space->unknowns, sizeof *y);
  double *work = batten_alloc_array(ctx, r.n, sizeof *work);
  r.scale = batten_alloc_array(ctx, r.n, sizeof *r.scale);
  r.factor = batten_alloc_array(ctx, entries, sizeof *r.factor);
  if (!residual || !trial || !y || !work || !r.scale || !r.factor) goto done;
  memset(r.factor, 0, entries * sizeof *r.factor);
  memset(y, 0, space->unknowns * sizeof *y);
  add_pairs(&r);
  if (!factor_scaled(&r)) {
    st = batten_fail(
        ctx, BATTEN_E_SINGULAR,
        "opt.parameters: they leave some of the %zu unknown coordinates undetermined; ask for fewer spans "
        "or a lower degree, or set opt.tension > 0",
        space->unknowns);
    goto done;
  }
  for (int pass = 0; pass <= REFINEMENTS; pass++) {
    contour_space_expand(space, y, trial);
    residual_of(o, trial, residual);
    correct(&r, residual, work, y);
  }
  contour_space_expand(space, y, control);
  st = BATTEN_OK;
done:
  batten_free(ctx, r.factor);
  batten_free(ctx, r.scale);
  batten_free(ctx, work);
  batten_free(ctx, y);
  batten_free(ctx, trial);
  batten_free(ctx, residual);
  return st;
}
