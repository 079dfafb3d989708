/* The smoothing spline with signs of curvature.
 *
 * With the direction of x' taken from the last solution the sign of [x', x''] is a linear inequality. A site that
 * bends the wrong way gets a stiff spring that holds its [x', x''] / |x'| at 0, a site whose spring would pull is let
 * go: Newton's method for the sum with the squares of violations, which ends when the springs stay the same.
 *   [Bollaerts, Eilers, van Mechelen: Simple and multiple P-splines regression with shape constraints] */
#include "forced.h"

#include <string.h>

#include "base/checked.h"
#include "sparse/band.h"

/* A spring holds its site to 1 / 30 of the standard deviation that the data leave it. */
static const double STIFF = 1000;
/* Newton's steps; directions are taken anew in the first ones, so that it can end. */
enum { STEPS = 24, TURNING = 6 };

static size_t band_width(const contour_smooth *s) { return 2 * s->width + 1; }

batten_status contour_forced_new(batten_context *ctx, const contour_smooth *s, contour_forced *out) {
  contour_forced f = {.smooth = s, .count = CONTOUR_SITES * s->spans};
  const size_t n = 2 * s->functions;
  f.sites = batten_alloc_array(ctx, f.count, sizeof *f.sites);
  f.system = f.sites ? batten_alloc_array(ctx, n * (band_width(s) + 1), sizeof *f.system) : NULL;
  f.right = f.system ? batten_alloc_array(ctx, n, sizeof *f.right) : NULL;
  f.control = f.right ? batten_alloc_array(ctx, n, sizeof *f.control) : NULL;
  f.direction = f.control ? batten_alloc_array(ctx, n, sizeof *f.direction) : NULL;
  if (!f.direction) {
    contour_forced_free(ctx, &f);
    return BATTEN_E_NOMEM;
  }
  for (size_t i = 0; i < f.count; i++) {
    size_t span = i / CONTOUR_SITES;
    double u = ((double)(i % CONTOUR_SITES) + 0.5) / CONTOUR_SITES;
    double variance = contour_smooth_variance(s, ((double)span + u) / (double)s->spans);
    f.sites[i] = (contour_site){.span = span, .u = u, .stiff = STIFF / variance};
  }
  *out = f;
  return BATTEN_OK;
}

void contour_forced_free(batten_context *ctx, contour_forced *f) {
  if (!f) return;
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
      double value = s->gram[j * (s->width + 1) + i] + s->lambda * s->penalty[j * (s->width + 1) + i];
      for (size_t k = 0; k < 2; k++) f->system[(2 * j + k) * (w + 1) + 2 * i] = value;
    }
    for (size_t k = 0; k < 2; k++) f->right[2 * j + k] = s->right[k * n + j];
  }
}

/* [x', x''] / |x'| at a site, x' that of the directions, x'' that of the control; and its row: functions `rows` [6],
 * values [6][2]. */
static double bend(const contour_forced *f, const contour_site *site, size_t *rows, double (*values)[2]) {
  const contour_smooth *s = f->smooth;
  double first[SMOOTH_ORDER], second[SMOOTH_ORDER], d[2] = {0, 0}, sum = 0;
  contour_smooth_basis(s, site->u, 1, first);
  contour_smooth_basis(s, site->u, 2, second);
  for (size_t k = 0; k < SMOOTH_ORDER; k++) {
    rows[k] = contour_smooth_row(s, site->span + k);
    for (size_t c = 0; c < 2; c++) d[c] += first[k] * f->direction[c * s->functions + rows[k]];
  }
  double length = hypot(d[0], d[1]);
  if (!(length > 0)) length = 1;
  for (size_t k = 0; k < SMOOTH_ORDER; k++) {
    values[k][0] = -d[1] / length * second[k];
    values[k][1] = d[0] / length * second[k];
    for (size_t c = 0; c < 2; c++) sum += values[k][c] * f->control[c * s->functions + rows[k]];
  }
  return sum;
}

static void add_springs(contour_forced *f) {
  const size_t w = band_width(f->smooth);
  for (size_t i = 0; i < f->count; i++) {
    const contour_site *site = &f->sites[i];
    if (!site->active) continue;
    size_t rows[SMOOTH_ORDER];
    double values[SMOOTH_ORDER][2];
    bend(f, site, rows, values);
    for (size_t a = 0; a < 2 * SMOOTH_ORDER; a++)
      for (size_t b = 0; b < 2 * SMOOTH_ORDER; b++) {
        size_t row = 2 * rows[a / 2] + a % 2, column = 2 * rows[b / 2] + b % 2;
        if (row >= column)
          f->system[column * (w + 1) + row - column] += site->stiff * values[a / 2][a % 2] * values[b / 2][b % 2];
      }
  }
}

/* Sites that bend the wrong way become active, others not; how many changed. */
static size_t set_active(contour_forced *f) {
  size_t changed = 0, rows[SMOOTH_ORDER];
  double values[SMOOTH_ORDER][2];
  for (size_t i = 0; i < f->count; i++) {
    contour_site *site = &f->sites[i];
    bool active = site->way && bend(f, site, rows, values) * site->way < 0;
    changed += active != site->active;
    site->active = active;
  }
  return changed;
}

double contour_forced_solve(contour_forced *f, double *squares) {
  const contour_smooth *s = f->smooth;
  const size_t n = s->functions;
  memcpy(f->control, s->control, 2 * n * sizeof *f->control);
  memcpy(f->direction, s->control, 2 * n * sizeof *f->direction);
  for (size_t i = 0; i < f->count; i++) f->sites[i].active = false;
  size_t changed = set_active(f);
  for (size_t step = 0; step < STEPS && changed; step++) {
    fill_system(f);
    add_springs(f);
    if (sparse_band_cholesky(2 * n, band_width(s), f->system)) return INFINITY;
    sparse_band_forward(2 * n, band_width(s), f->system, f->right);
    sparse_band_backward(2 * n, band_width(s), f->system, f->right);
    for (size_t j = 0; j < 2 * n; j++) f->control[j % 2 * n + j / 2] = f->right[j];
    if (step < TURNING) memcpy(f->direction, f->control, 2 * n * sizeof *f->direction);
    changed = set_active(f);
  }
  return contour_smooth_cost(s, f->control, squares);
}
