/* What a loft leaves of interpolation and continuity, from its patches alone: what they are at a contour is compared
 * with the contour as it was given and with one another, at degree + 2 parameters of every span of either. There both
 * are splines on known knots, so that no more can be between these parameters than a small multiple. */
#include "base/checked.h"
#include "basis/refine.h"
#include "loft_inner.h"

/* A spline whose control points are numbers of rows: combination weights [row] of these; [count][row][2]. */
typedef struct strip {
  bspline space;
  size_t row;
  const double *points;
} strip;

static void strip_at(const strip *s, const double *weights, double t, double out[2]) {
  double table[BSPLINE_ORDER];
  unsigned d = s->space.degree;
  size_t mu = bspline_span(&s->space, t);
  bspline_basis(&s->space, mu, t, 0, table);
  const double *from = s->points + 2 * s->row * (mu - d);
  out[0] = out[1] = 0;
  for (unsigned j = 0; j <= d; j++)
    for (size_t k = 0; k < s->row; k++, from += 2) {
      out[0] += table[j] * weights[k] * from[0];
      out[1] += table[j] * weights[k] * from[1];
    }
}

/* The k-th derivative by the part of the height at the lower or upper end: the k-th difference of the first or last
 * Bezier points, n! / (n - k)! times; weights [n + 1]. */
static void end_weights(unsigned n, unsigned k, bool upper, double *weights) {
  for (unsigned j = 0; j <= n; j++) weights[j] = 0;
  double factor = 1, binomial = 1;
  for (unsigned j = 0; j < k; j++) factor *= n - j;
  for (unsigned j = 0; j <= k; j++) {
    unsigned from_end = upper ? n - j : j;
    bool minus = upper ? j % 2 == 1 : (k - j) % 2 == 1;
    weights[from_end] = (minus ? -factor : factor) * binomial;
    binomial = binomial * (k - j) / (j + 1);
  }
}

typedef struct gauge {
  const batten_loft *loft;
  const batten_curve *const *contours;
  double *interpolation, *continuity; /* [contours] */
} gauge;

/* At t at contour i: patches above and below it, which of them there are. */
static void compare_at(const gauge *g, size_t i, const strip *below, const strip *above, const strip *contour,
                       double t) {
  const batten_loft *loft = g->loft;
  static const double one[1] = {1};
  unsigned n = loft->degree[1];
  double weights[BSPLINE_ORDER], at[2], ends[2][2], stretch = 1, ratio = 0;
  strip_at(contour, one, t, at);
  if (below && above) ratio = (loft->heights[i] - loft->heights[i - 1]) / (loft->heights[i + 1] - loft->heights[i]);
  for (unsigned k = 0; k <= loft->smoothness && (k == 0 || (below && above)); k++, stretch *= ratio) {
    for (size_t e = 0; e < 2; e++) {
      const strip *s = e ? above : below;
      if (!s) continue;
      end_weights(n, k, e == 0, weights);
      strip_at(s, weights, t, ends[e]);
      if (k == 0) g->interpolation[i] = fmax(g->interpolation[i], hypot(ends[e][0] - at[0], ends[e][1] - at[1]));
    }
    if (below && above)
      g->continuity[i] =
          fmax(g->continuity[i], hypot(stretch * ends[1][0] - ends[0][0], stretch * ends[1][1] - ends[0][1]));
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
    *interpolation = fmax(*interpolation, g.interpolation[i]);
    *continuity = fmax(*continuity, g.continuity[i]);
  }
  batten_free(ctx, worst);
  return BATTEN_OK;
}
