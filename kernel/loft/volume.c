/* Area and volume of a loft: the rule of Gauss and Legendre on each span of t of each patch, in more and more parts
 * of both parameters until the area stays. The volume is exact but for the highest degrees, of which four parts leave
 * next to nothing. */
#include "base/checked.h"
#include "basis/gauss8.h"
#include "loft_inner.h"

enum { PARTS_MAX = 8 };
/* Twice as many parts have at least half as many digits more, unless there is a cusp. */
static const double SAME_AREA = 1e-7;

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

/* One line of nodes t = const of a span: its control points by z, and those of the derivative by t. Points are
 * times unit, the area too, of a patch `gap` high; the volume is times unit^2, of one 1 high. */
static void add_line(unsigned n, double gap, double unit, unsigned parts, const double (*point)[2],
                     const double (*along)[2], double weight, sums *out) {
  for (unsigned part = 0; part < parts; part++)
    for (unsigned q = 0; q < GAUSS8; q++) {
      double node, share, value[BSPLINE_ORDER], slope[BSPLINE_ORDER], x[2] = {0}, t[2] = {0}, z[2] = {0};
      gauss8_node(q, &node, &share);
      bernstein(n, (part + node) / parts, value, slope);
      for (unsigned k = 0; k <= n; k++)
        for (int c = 0; c < 2; c++) {
          x[c] += value[k] * point[k][c];
          t[c] += value[k] * along[k][c];
          z[c] += slope[k] * point[k][c];
        }
      out->area += weight * share / parts * hypot(gap * hypot(t[0], t[1]), loft_cross(t, z) / unit);
      out->volume += weight * share / parts * 0.5 * loft_cross(x, t);
    }
}

/* Points relative to origin, so that the volume of what lies far away keeps its digits; times unit, so that squares
 * are doubles. */
typedef struct frame {
  double origin[2], unit;
} frame;

static frame frame_of(const batten_loft *loft) {
  const double *first = loft->patches[0].control;
  frame f = {.origin = {first[0], first[1]}};
  double most = 0;
  for (size_t i = 0; i + 1 < loft->contours; i++) {
    const loft_patch *p = &loft->patches[i];
    for (size_t k = 0; k < 2 * p->count * (loft->degree[1] + 1); k++)
      most = fmax(most, fabs(p->control[k] - f.origin[k % 2]));
  }
  f.unit = most > 0 ? batten_unit(most) : 1;
  return f;
}

/* A span of a patch. */
static sums measure_span(const loft_patch *patch, const bspline *b, unsigned n, double gap, size_t mu, unsigned parts,
                         const frame *f) {
  unsigned d = b->degree;
  double width = b->knots[mu + 1] - b->knots[mu];
  sums s = {0};
  for (unsigned part = 0; part < parts; part++)
    for (unsigned q = 0; q < GAUSS8; q++) {
      double node, share, table[2 * BSPLINE_ORDER], point[BSPLINE_ORDER][2] = {{0}}, along[BSPLINE_ORDER][2] = {{0}};
      gauss8_node(q, &node, &share);
      bspline_basis(b, mu, b->knots[mu] + (part + node) / parts * width, 1, table);
      for (unsigned j = 0; j <= d; j++)
        for (unsigned k = 0; k <= n; k++)
          for (int c = 0; c < 2; c++) {
            double at = patch->control[((mu - d + j) * (n + 1) + k) * 2 + (size_t)c] - f->origin[c];
            at *= f->unit;
            point[k][c] += table[j] * at;
            along[k][c] += table[d + 1 + j] * width * at;
          }
      add_line(n, gap, f->unit, parts, (const double(*)[2])point, (const double(*)[2])along, share / parts, &s);
    }
  return s;
}

static void add_patch(const batten_loft *loft, size_t i, const frame *f, sums *out) {
  const loft_patch *patch = &loft->patches[i];
  unsigned n = loft->degree[1];
  bspline b = {loft->degree[0], patch->count, patch->knots};
  double gap = loft->heights[i + 1] - loft->heights[i];
  /* The volume is a polynomial of degree 2 n by z and 2 d - 1 by t; the rule is exact to 2 GAUSS8 - 1. */
  unsigned least = 2 * n >= 2 * GAUSS8 || 2 * b.degree > 2 * GAUSS8 ? 2 : 1;
  for (size_t mu = bspline_first(&b); mu < b.count; mu = bspline_next(&b, mu)) {
    unsigned parts = least;
    sums s = measure_span(patch, &b, n, gap, mu, parts, f), last;
    do {
      last = s;
      parts *= 2;
      s = measure_span(patch, &b, n, gap, mu, parts, f);
    } while (parts < PARTS_MAX && fabs(s.area - last.area) > SAME_AREA * s.area);
    out->area += s.area;
    out->volume += s.volume * gap;
  }
}

batten_status batten_loft_measure(batten_context *ctx, const batten_loft *loft, batten_loft_measures *out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!loft || !out)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a loft and a place for its measures",
                       loft ? "out" : "loft");
  sums s = {0};
  frame f = frame_of(loft);
  for (size_t i = 0; i + 1 < loft->contours; i++) {
    batten_status st = batten_progress(ctx, "measure", (double)i / (double)(loft->contours - 1));
    if (st < 0) return st;
    add_patch(loft, i, &f, &s);
  }
  *out = (batten_loft_measures){.area = s.area / f.unit, .volume = loft->closed ? s.volume / f.unit / f.unit : NAN};
  return BATTEN_OK;
}
