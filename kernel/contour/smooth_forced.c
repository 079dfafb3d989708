/* The smoothing spline with signs of curvature.
 *
 * With the direction of x' taken from the last solution the sign of [x', x''] is a linear inequality. A site that
 * bends the wrong way gets a stiff spring that holds its [x', x''] / |x'| at 0, one that bends the right way none:
 * Newton's method for the sum with the squares of violations, which ends when the springs stay the same.
 *   [Bollaerts, Eilers, van Mechelen: Simple and multiple P-splines regression with shape constraints] */
#include "smooth_forced.h"

#include <string.h>

#include "base/checked.h"
#include "sparse/band.h"

/* Of springs, in parts of what holds a site already, 1 / variance; each with the direction and the springs that the
 * one before has led to. Runs are longer than the bandwidth, and held by the data the better the longer they are;
 * that much more does not yet cost the sum its digits. */
static const double STIFF[] = {1e2, 1e4, 1e6};
enum { LEVELS = sizeof STIFF / sizeof *STIFF, STEPS = 12, HALVINGS = 30 };

/* Sites in a span. x'' is cubic there: where it bends one way at both, it does so in the mean. */
static const double GAUSS[CONTOUR_SITES] = {0.211324865405187118, 0.788675134594812882};
/* So far may x' turn from that of the smoothing spline where its sign is told, before springs follow it no more. */
static const double TURN_MOST = 1;

static size_t band_width(const contour_smooth *s) { return 2 * s->width + 1; }

batten_status contour_forced_new(batten_context *ctx, const contour_smooth *s, double lambda, contour_forced *out) {
  contour_forced f = {.smooth = s, .lambda = lambda, .count = CONTOUR_SITES * s->spans};
  const size_t n = 2 * s->functions;
  f.sites = batten_alloc_array(ctx, f.count, sizeof *f.sites);
  f.system = f.sites ? batten_alloc_array(ctx, n * (band_width(s) + 1), sizeof *f.system) : NULL;
  f.right = f.system ? batten_alloc_array(ctx, n, sizeof *f.right) : NULL;
  f.control = f.right ? batten_alloc_array(ctx, n, sizeof *f.control) : NULL;
  f.direction = f.control ? batten_alloc_array(ctx, n, sizeof *f.direction) : NULL;
  f.step = f.direction ? batten_alloc_array(ctx, n, sizeof *f.step) : NULL;
  if (!f.step) {
    contour_forced_free(ctx, &f);
    return BATTEN_E_NOMEM;
  }
  /* the variance of second derivatives goes with the bandwidth to the power of -5 */
  double stiff = pow(lambda / s->lambda, 5.0 / 6);
  for (size_t i = 0; i < f.count; i++) {
    size_t span = i / CONTOUR_SITES;
    double u = GAUSS[i % CONTOUR_SITES];
    double variance = contour_smooth_variance(s, ((double)span + u) / (double)s->spans);
    f.sites[i] = (contour_site){.span = span, .u = u, .stiff = stiff / variance};
  }
  *out = f;
  return BATTEN_OK;
}

void contour_forced_free(batten_context *ctx, contour_forced *f) {
  if (!f) return;
  batten_free(ctx, f->step);
  batten_free(ctx, f->direction);
  batten_free(ctx, f->control);
  batten_free(ctx, f->right);
  batten_free(ctx, f->system);
  batten_free(ctx, f->sites);
  *f = (contour_forced){0};
}

/* gram + lambda penalty for both coordinates. */
static void fill_system(contour_forced *f) {
  const contour_smooth *s = f->smooth;
  const size_t w = band_width(s), n = s->functions;
  memset(f->system, 0, 2 * n * (w + 1) * sizeof *f->system);
  for (size_t j = 0; j < n; j++) {
    for (size_t i = 0; i <= s->width && i + j < n; i++) {
      double value = s->gram[j * (s->width + 1) + i] + f->lambda * s->penalty[j * (s->width + 1) + i];
      for (size_t k = 0; k < 2; k++) f->system[(2 * j + k) * (w + 1) + 2 * i] = value;
    }
    for (size_t k = 0; k < 2; k++) f->right[2 * j + k] = s->right[k * n + j];
  }
}

/* The direction of x', but not far from that of the smoothing spline: else a run could turn its sign by a loop
 * between points, where these are few. */
static void limit_turn(const double smooth[2], double d[2]) {
  double size = hypot(smooth[0], smooth[1]), along = smooth[0] * d[0] + smooth[1] * d[1];
  double across = smooth[0] * d[1] - smooth[1] * d[0], angle = atan2(across, along);
  if (!(size > 0) || fabs(angle) <= TURN_MOST) return;
  double c = cos(TURN_MOST), sn = angle > 0 ? sin(TURN_MOST) : -sin(TURN_MOST);
  d[0] = c * smooth[0] - sn * smooth[1];
  d[1] = sn * smooth[0] + c * smooth[1];
}

/* The row of a site, [x', x''] / |x'| with x' that of the direction: functions `rows` [6], values [6][2]. */
static void make_row(const contour_forced *f, const contour_site *site, size_t *rows, double (*values)[2]) {
  const contour_smooth *s = f->smooth;
  double first[SMOOTH_ORDER], second[SMOOTH_ORDER], d[2] = {0, 0}, smooth[2] = {0, 0};
  contour_smooth_basis(s, site->u, 1, first);
  contour_smooth_basis(s, site->u, 2, second);
  for (size_t k = 0; k < SMOOTH_ORDER; k++) {
    rows[k] = contour_smooth_row(s, site->span + k);
    for (size_t c = 0; c < 2; c++) {
      d[c] += first[k] * f->direction[c * s->functions + rows[k]];
      smooth[c] += first[k] * s->control[c * s->functions + rows[k]];
    }
  }
  limit_turn(smooth, d);
  double length = hypot(d[0], d[1]);
  if (!(length > 0)) length = 1;
  for (size_t k = 0; k < SMOOTH_ORDER; k++) {
    values[k][0] = -d[1] / length * second[k];
    values[k][1] = d[0] / length * second[k];
  }
}

static double row_value(const contour_forced *f, const size_t *rows, double (*values)[2], const double *control) {
  double sum = 0;
  for (size_t k = 0; k < SMOOTH_ORDER; k++)
    for (size_t c = 0; c < 2; c++) sum += values[k][c] * control[c * f->smooth->functions + rows[k]];
  return sum;
}

/* Whether a site's spring is tense, when Newton's step is taken to a part. */
static bool tense(const contour_site *site, double part) { return (site->bend + part * site->step) * site->way < 0; }

static void add_springs(contour_forced *f, double stiff) {
  const size_t w = band_width(f->smooth);
  for (size_t i = 0; i < f->count; i++) {
    contour_site *site = &f->sites[i];
    if (!site->way) continue;
    size_t rows[SMOOTH_ORDER];
    double values[SMOOTH_ORDER][2];
    make_row(f, site, rows, values);
    site->bend = row_value(f, rows, values, f->control);
    if (!tense(site, 0)) continue;
    for (size_t a = 0; a < 2 * SMOOTH_ORDER; a++)
      for (size_t b = 0; b < 2 * SMOOTH_ORDER; b++) {
        size_t row = 2 * rows[a / 2] + a % 2, column = 2 * rows[b / 2] + b % 2;
        if (row >= column)
          f->system[column * (w + 1) + row - column] +=
              stiff * site->stiff * values[a / 2][a % 2] * values[b / 2][b % 2];
      }
  }
}

/* How far to go along the step: to where the sum with its springs, a parabola of many pieces, is least; 1 when no
 * spring changes. */
static double find_part(contour_forced *f, double stiff) {
  const contour_smooth *s = f->smooth;
  const size_t n = s->functions;
  double slope = 0, bend = 0, from = 0, to = 1;
  for (size_t k = 0; k < 2; k++) { /* of half the sum without springs */
    const double *c = f->control + k * n, *d = f->step + k * n;
    for (size_t j = 0; j < n; j++) {
      double ac = 0, ad = 0;
      for (size_t i = j > s->width ? j - s->width : 0; i < n && i <= j + s->width; i++) {
        size_t at = i < j ? i * (s->width + 1) + j - i : j * (s->width + 1) + i - j;
        double a = s->gram[at] + f->lambda * s->penalty[at];
        ac += a * c[i];
        ad += a * d[i];
      }
      slope += d[j] * (ac - s->right[k * n + j]);
      bend += d[j] * ad;
    }
  }
  size_t changed = 0;
  for (size_t i = 0; i < f->count; i++) {
    contour_site *site = &f->sites[i];
    if (!site->way) continue;
    size_t rows[SMOOTH_ORDER];
    double values[SMOOTH_ORDER][2];
    make_row(f, site, rows, values);
    site->step = row_value(f, rows, values, f->step);
    changed += tense(site, 0) != tense(site, 1);
  }
  if (!changed) return 1;
  for (int halving = 0; halving < HALVINGS; halving++) {
    double part = halving ? 0.5 * (from + to) : 1, rise = slope + part * bend;
    for (size_t i = 0; i < f->count; i++) {
      const contour_site *site = &f->sites[i];
      if (site->way && tense(site, part)) rise += stiff * site->stiff * (site->bend + part * site->step) * site->step;
    }
    if (!halving && rise <= 0) return 0.999; /* as good as the whole, but springs changed */
    if (rise > 0)
      to = part;
    else
      from = part;
  }
  return fmin(0.5 * (from + to), 0.999);
}

/* The least sum with springs of a stiffness; false where rounding keeps it from a factor. */
static bool solve_level(contour_forced *f, double stiff) {
  const contour_smooth *s = f->smooth;
  const size_t n = s->functions;
  memcpy(f->direction, f->control, 2 * n * sizeof *f->direction);
  double part = 0;
  for (size_t step = 0; step < STEPS && part < 1; step++) {
    fill_system(f);
    add_springs(f, stiff);
    if (sparse_band_cholesky(2 * n, band_width(s), f->system)) return false;
    sparse_band_forward(2 * n, band_width(s), f->system, f->right);
    sparse_band_backward(2 * n, band_width(s), f->system, f->right);
    for (size_t j = 0; j < 2 * n; j++) f->step[j % 2 * n + j / 2] = f->right[j] - f->control[j % 2 * n + j / 2];
    part = find_part(f, stiff);
    for (size_t j = 0; j < 2 * n; j++) f->control[j] += part * f->step[j];
  }
  return true;
}

double contour_forced_solve(contour_forced *f, double *squares) {
  const contour_smooth *s = f->smooth;
  memcpy(f->control, s->control, 2 * s->functions * sizeof *f->control);
  for (size_t level = 0; level < LEVELS; level++)
    if (!solve_level(f, STIFF[level])) return INFINITY;
  return contour_smooth_cost(s, f->lambda, f->control, squares);
}
