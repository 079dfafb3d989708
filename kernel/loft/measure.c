/* What a loft leaves of interpolation and continuity, from its patches alone: what they are at a contour is compared
 * with the contour as it was given and with one another, at degree + 2 parameters of every span of either. There both
 * are splines on known knots, so that no more can be between these parameters than a small multiple. */
#include "base/checked.h"
#include "basis/refine.h"
#include "loft_inner.h"

#include <string.h>

/* Splines on the same knots: control points [space.count][row][2]. */
typedef struct strip {
  bspline space;
  size_t row;
  const double *points;
} strip;

/* Their points at t [row]: of a patch the Bezier points by z. */
static void column_at(const strip *s, double t, double (*out)[2]) {
  double table[BSPLINE_ORDER];
  unsigned d = s->space.degree;
  size_t mu = bspline_span(&s->space, t);
  bspline_basis(&s->space, mu, t, 0, table);
  const double *from = s->points + 2 * s->row * (mu - d);
  memset(out, 0, s->row * sizeof *out);
  for (unsigned j = 0; j <= d; j++)
    for (size_t k = 0; k < s->row; k++, from += 2) {
      out[k][0] += table[j] * from[0];
      out[k][1] += table[j] * from[1];
    }
}

/* Bezier points [degree + 1] become those of the derivative, times `unit`. */
static void differentiate(unsigned degree, double unit, double (*column)[2]) {
  for (unsigned k = 0; k < degree; k++)
    for (size_t x = 0; x < 2; x++) column[k][x] = unit * degree * (column[k + 1][x] - column[k][x]);
}

/* What is no number is worse than all. */
static void worsen(double *worst, double error) {
  if (error > *worst || isnan(error)) *worst = error;
}

static double distance(const double a[2], const double b[2]) { return hypot(a[0] - b[0], a[1] - b[1]); }

typedef struct gauge {
  const batten_loft *loft;
  const batten_curve *const *contours;
  double *interpolation, *continuity; /* [contours] */
} gauge;

/* At t of contour i, with the patches below and above it; NULL where there is none. */
static void compare_at(const gauge *g, size_t i, const strip *below, const strip *above, const strip *contour,
                       double t) {
  unsigned n = g->loft->degree[1];
  double at[1][2], lower[BSPLINE_ORDER][2], upper[BSPLINE_ORDER][2], *error = &g->interpolation[i];
  column_at(contour, t, at);
  if (below) {
    column_at(below, t, lower);
    worsen(error, distance(lower[n], at[0]));
  }
  if (above) {
    column_at(above, t, upper);
    worsen(error, distance(upper[0], at[0]));
  }
  if (!below || !above) return;
  const double *z = g->loft->heights + i;
  double gaps[2] = {z[0] - z[-1], z[1] - z[0]}, least = fmin(gaps[0], gaps[1]);
  for (unsigned k = 0; k <= g->loft->smoothness; k++) {
    worsen(&g->continuity[i], distance(lower[n - k], upper[0]));
    differentiate(n - k, least / gaps[0], lower);
    differentiate(n - k, least / gaps[1], upper);
  }
}

static void compare(void *arg, size_t i) {
  const gauge *g = arg;
  const batten_loft *loft = g->loft;
  batten_curve_form form = batten_curve_get(g->contours[i]);
  strip contour = {{form.degree, form.knot_count - form.degree - 1, form.knots}, 1, form.control_points}, sides[2];
  const strip *of[2] = {NULL, NULL};
  for (size_t e = 0; e < 2; e++) {
    if (e == 0 ? i == 0 : i + 1 == loft->contours) continue;
    const loft_patch *p = &loft->patches[i + e - 1];
    sides[e] = (strip){{loft->degree[0], p->count, p->knots}, loft->degree[1] + 1, p->control};
    of[e] = &sides[e];
  }
  g->interpolation[i] = g->continuity[i] = 0;
  unsigned parts = loft->degree[0] + 1;
  for (size_t e = 0; e < 2; e++)
    for (size_t j = 0; of[e] && j < of[e]->space.count; j++) {
      double from = of[e]->space.knots[j], to = of[e]->space.knots[j + 1];
      for (unsigned k = 0; from < to && k <= parts; k++)
        compare_at(g, i, of[0], of[1], &contour, bspline_blend(from, to, k / (double)parts));
    }
}

batten_status loft_measure(batten_context *ctx, const batten_loft *loft, const batten_curve *const *contours,
                           double *interpolation, double *continuity) {
  double *worst = batten_alloc_array(ctx, loft->contours, 2 * sizeof *worst);
  if (!worst) return BATTEN_E_NOMEM;
  gauge g = {loft, contours, worst, worst + loft->contours};
  batten_parallel(ctx, loft->contours, compare, &g);
  *interpolation = *continuity = 0;
  for (size_t i = 0; i < loft->contours; i++) {
    worsen(interpolation, g.interpolation[i]);
    worsen(continuity, g.continuity[i]);
  }
  batten_free(ctx, worst);
  return BATTEN_OK;
}
