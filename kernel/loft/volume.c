/* Area and volume of a loft: the rule of Gauss and Legendre on each span of t, and on halves of each patch by z. With
 * both, degrees up to 15 are exact, and of higher ones less is left than rounding leaves. */
#include "base/checked.h"
#include "basis/gauss8.h"
#include "loft_inner.h"

enum { HALVES = 2 };

typedef struct sums {
  double area, volume;
} sums;

/* B_k^n at zeta and their derivatives. */
static void bernstein(unsigned n, double zeta, double *value, double *slope) {
  double lower[BSPLINE_ORDER] = {1}; /* degree n - 1 */
  for (unsigned r = 1; r < n; r++)
    for (unsigned k = r + 1; k-- > 0;) lower[k] = (k < r ? (1 - zeta) * lower[k] : 0) + (k ? zeta * lower[k - 1] : 0);
  for (unsigned k = 0; k <= n; k++) {
    double before = k ? lower[k - 1] : 0, here = k < n ? lower[k] : 0;
    value[k] = (1 - zeta) * here + zeta * before;
    slope[k] = n * (before - here);
  }
}

/* One line of nodes t = const of a span: its control points by z, and those of the derivative by t. */
static void add_line(unsigned n, double gap, const double (*point)[2], const double (*along)[2], double weight,
                     sums *out) {
  for (unsigned half = 0; half < HALVES; half++)
    for (unsigned q = 0; q < GAUSS8; q++) {
      double node, share, value[BSPLINE_ORDER], slope[BSPLINE_ORDER], x[2] = {0}, t[2] = {0}, z[2] = {0};
      gauss8_node(q, &node, &share);
      bernstein(n, (half + node) / HALVES, value, slope);
      for (unsigned k = 0; k <= n; k++)
        for (int c = 0; c < 2; c++) {
          x[c] += value[k] * point[k][c];
          t[c] += value[k] * along[k][c];
          z[c] += slope[k] * point[k][c] / gap;
        }
      double area = sqrt(t[0] * t[0] + t[1] * t[1] + loft_cross(t, z) * loft_cross(t, z));
      out->area += weight * share / HALVES * gap * area;
      out->volume += weight * share / HALVES * gap * 0.5 * loft_cross(x, t);
    }
}

/* Points relative to origin, so that the volume of what lies far away keeps its digits. */
static void add_patch(const batten_loft *loft, size_t i, const double origin[2], sums *out) {
  const loft_patch *patch = &loft->patches[i];
  unsigned d = loft->degree[0], n = loft->degree[1];
  bspline b = {d, patch->count, patch->knots};
  double gap = loft->heights[i + 1] - loft->heights[i];
  for (size_t mu = bspline_first(&b); mu < b.count; mu = bspline_next(&b, mu))
    for (unsigned q = 0; q < GAUSS8; q++) {
      double node, share, table[2 * BSPLINE_ORDER], width = b.knots[mu + 1] - b.knots[mu];
      double point[BSPLINE_ORDER][2] = {{0}}, along[BSPLINE_ORDER][2] = {{0}};
      gauss8_node(q, &node, &share);
      bspline_basis(&b, mu, b.knots[mu] + node * width, 1, table);
      for (unsigned j = 0; j <= d; j++)
        for (unsigned k = 0; k <= n; k++)
          for (int c = 0; c < 2; c++) {
            double at = patch->control[((mu - d + j) * (n + 1) + k) * 2 + (size_t)c] - origin[c];
            point[k][c] += table[j] * at;
            along[k][c] += table[d + 1 + j] * at;
          }
      add_line(n, gap, (const double(*)[2])point, (const double(*)[2])along, share * width, out);
    }
}

batten_status batten_loft_measure(batten_context *ctx, const batten_loft *loft, batten_loft_measures *out) {
  if (!loft || !out)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a loft and a place for its measures",
                       loft ? "out" : "loft");
  sums s = {0};
  const double *origin = loft->patches[0].control;
  for (size_t i = 0; i + 1 < loft->contours; i++) {
    batten_status st = batten_progress(ctx, "measure", (double)i / (double)(loft->contours - 1));
    if (st < 0) return st;
    add_patch(loft, i, origin, &s);
  }
  *out = (batten_loft_measures){.area = s.area, .volume = loft->closed ? s.volume : NAN};
  return BATTEN_OK;
}
