/* Spline curves of known signs of curvature, made from legs or polygons that turn as they should.
 *   [section 2.2 (i), construction 1]
 *
 * Open curves: smoothness 1, degree 2: the sign of span s is that of the turn from leg s to leg s + 1. Smoothness 2,
 * degree 3: x'' at break s has the direction of the turn from leg s to leg s + 1; an inflection is no turn, and legs
 * in the ratio that makes x'' = 0. Closed ones likewise, from a periodic polygon. Degrees are then raised. */
#ifndef CONTOUR_CURVES_H
#define CONTOUR_CURVES_H

#include <stdlib.h>

#include "basis/refine.h"
#include "contour/contour_inner.h"
#include "tap.h"

typedef struct contour_curve_rule {
  unsigned degree, smoothness;
  bool closed;
  size_t runs, spans_per_run; /* closed: runs even or 1 */
  double turn;                /* of a run, at most, radians; closed ones turn as they must */
  uint64_t seed;
} contour_curve_rule;

typedef struct contour_test_curve {
  contour_shape shape;
  bspline b;
  double *breaks, *knots, *control;
  signed char *signs;
} contour_test_curve;

static inline void *contour_test_memory(size_t count, size_t size) {
  void *p = calloc(count + 1, size);
  if (!p) abort(); /* nothing can be tested without it */
  return p;
}

static inline void contour_test_curve_free(contour_test_curve *c) {
  free(c->breaks);
  free(c->knots);
  free(c->control);
  free(c->signs);
}

/* Control points of the lowest degree, size about one. knots: open, clamped. */
static inline void contour_test_legs(const contour_test_curve *c, const bspline *low, double turn, uint64_t *state,
                                     double *control) {
  const double *u = low->knots;
  unsigned l = c->shape.smoothness;
  size_t spans = c->shape.spans, legs = spans + l;
  double angle = 6 * t_uniform(state), size = 0;
  memset(control, 0, 2 * low->count * sizeof *control);
  double before = 0;
  for (size_t j = 0; j < legs; j++) {
    bool flat = l == 2 && j > 0 && j <= spans && contour_inflection(&c->shape, j - 1);
    double leg = (u[j + l + 2] - u[j + 1]) * (0.7 + 0.6 * t_uniform(state));
    if (flat) leg = before * (u[j + 4] - u[j + 1]) / (u[j + 3] - u[j]); /* (u_(w+5) - u_(w+2)) / (..), w = j - 1 */
    if (j > 0 && !flat) {
      size_t span = j - 1 < spans ? j - 1 : spans - 1;
      size_t in = 0;
      for (size_t s = span; s < spans && c->shape.signs[s] == c->shape.signs[span]; s++) in++;
      for (size_t s = span; s-- > 0 && c->shape.signs[s] == c->shape.signs[span];) in++;
      angle += c->shape.signs[span] * turn / (double)(in + 1) * (0.4 + 0.6 * t_uniform(state));
    }
    control[2 * j + 2] = control[2 * j] + leg * cos(angle);
    control[2 * j + 3] = control[2 * j + 1] + leg * sin(angle);
    size = fmax(size, fmax(fabs(control[2 * j + 2]), fabs(control[2 * j + 3])));
    before = leg;
  }
  for (size_t i = 0; i < 2 * low->count; i++) control[i] /= size;
}

/* A closed one on equal spans: [spans] points of a periodic polygon, point i belongs to break i (smoothness 2) or to
 * the middle of span i (1). Signs are read from it. */
static inline void contour_test_polygon(contour_test_curve *c, size_t runs, uint64_t *state, double *points) {
  size_t spans = c->shape.spans;
  double dent = runs < 2 ? 0 : 2.0 / (1 + (double)(runs * runs) / 4), start = t_uniform(state);
  for (size_t i = 0; i < spans; i++) {
    double phi = 2 * acos(-1) * ((double)i + 0.25 * (start + 0.2 * t_uniform(state)) * (runs < 2)) / (double)spans;
    double r = 0.5 * (1 + dent * cos((double)runs / 2 * (phi + 0.3 * start)));
    points[2 * i] = r * cos(phi);
    points[2 * i + 1] = 0.8 * r * sin(phi);
  }
  double *turn = contour_test_memory(spans, sizeof *turn);
  for (int pass = 0; pass < 2; pass++) {
    for (size_t i = 0; i < spans; i++) {
      const double *p = points + 2 * ((i + spans - 1) % spans), *q = points + 2 * i,
                   *r = points + 2 * ((i + 1) % spans);
      turn[i] = (q[0] - p[0]) * (r[1] - q[1]) - (q[1] - p[1]) * (r[0] - q[0]);
    }
    for (size_t i = 0; i < spans && pass == 0 && c->shape.smoothness == 2; i++) {
      size_t before = (i + spans - 1) % spans, flat = fabs(turn[before]) < fabs(turn[i]) ? before : i;
      const double *p = points + 2 * ((flat + spans - 1) % spans), *r = points + 2 * ((flat + 1) % spans);
      if (turn[before] * turn[i] < 0)
        for (size_t k = 0; k < 2; k++) points[2 * flat + k] = 0.5 * (p[k] + r[k]);
    }
  }
  /* smoothness 2: x'' at the begin of span i has the turn of point i, 0 at an inflection */
  for (size_t i = 0; i < spans; i++) {
    double t = turn[i], next = turn[(i + 1) % spans];
    if (c->shape.smoothness == 2 && fabs(t) < fabs(next)) t = next;
    c->signs[i] = t < 0 ? -1 : 1;
  }
  free(turn);
}

/* Clamped control points of the periodic curve: blossoms of its span. */
static inline void contour_test_clamp(const contour_test_curve *c, const double *points, const bspline *low,
                                      double *control) {
  unsigned d = low->degree;
  size_t spans = c->shape.spans, count = spans + d;
  double *knots = contour_test_memory(count + d + 1, sizeof *knots), *turned = contour_test_memory(2 * count, 8);
  for (size_t i = 0; i < count + d + 1; i++) knots[i] = ((double)i - d) / (double)spans;
  /* Point of break i has its support centred there (degree 3), or in the middle of span i (degree 2). */
  for (size_t i = 0; i < count; i++)
    for (size_t k = 0; k < 2; k++) turned[2 * i + k] = points[2 * ((i + spans - 1) % spans) + k];
  const bspline loop = {d, count, knots};
  for (size_t j = 0; j < low->count; j++) {
    size_t at = j; /* any span that the function lives on */
    while (!(low->knots[at] < low->knots[at + 1])) at++;
    size_t mu = d + (size_t)lround(low->knots[at] * (double)spans);
    bspline_blossom(&loop, 2, turned, mu, low->knots + j + 1, control + 2 * j);
  }
  free(knots);
  free(turned);
}

static inline contour_test_curve contour_test_curve_make(const contour_curve_rule *r) {
  uint64_t state = r->seed * 77 + 5;
  size_t spans = r->runs * r->spans_per_run;
  contour_test_curve c = {.shape = {r->degree, r->smoothness, r->closed, spans, NULL, NULL}};
  unsigned l = r->smoothness;
  c.breaks = contour_test_memory(spans + 1, sizeof *c.breaks);
  c.signs = contour_test_memory(spans, sizeof *c.signs);
  for (size_t i = 0; i < spans; i++) c.breaks[i + 1] = c.breaks[i] + (r->closed ? 1 : 0.4 + t_uniform(&state));
  for (size_t i = 0; i <= spans; i++)
    c.breaks[i] = r->closed ? (double)i / (double)spans : c.breaks[i] / c.breaks[spans];
  signed char first = t_random(&state) % 2 ? 1 : -1;
  for (size_t i = 0; i < spans; i++) c.signs[i] = (signed char)(i / r->spans_per_run % 2 ? -first : first);
  c.shape.breaks = c.breaks;
  c.shape.signs = c.signs;

  double *knots = contour_test_memory(spans + 2 * l + 3, sizeof *knots);
  size_t count = bspline_make_knots(l + 1, l, spans, c.breaks + 1, 0, 1, knots) - l - 2;
  const bspline low = {l + 1, count, knots};
  double *control = contour_test_memory(2 * count, sizeof *control);
  if (r->closed) {
    double *points = contour_test_memory(2 * spans, sizeof *points);
    contour_test_polygon(&c, r->runs, &state, points);
    contour_test_clamp(&c, points, &low, control);
    free(points);
  } else {
    contour_test_legs(&c, &low, r->turn, &state, control);
  }
  size_t folds = r->degree - l;
  c.knots = contour_test_memory(folds * spans + 2 * (r->degree + 1), sizeof *c.knots);
  count = bspline_make_knots(r->degree, l, spans, c.breaks + 1, 0, 1, c.knots) - r->degree - 1;
  c.b = (bspline){r->degree, count, c.knots};
  c.control = contour_test_memory(2 * count, sizeof *c.control);
  bspline_refine(&low, 2, control, &c.b, c.control);
  free(knots);
  free(control);
  return c;
}

/* Least of sigma [x', x''] / (|x'| |x''|) at samples inside the spans, by the basis functions. */
static inline double contour_test_curvature(const contour_test_curve *c, const double *control, size_t samples) {
  double table[3 * BSPLINE_ORDER], least = INFINITY;
  size_t span = 0, order = c->b.degree + 1;
  for (size_t mu = bspline_first(&c->b); mu < c->b.count; mu = bspline_next(&c->b, mu), span++)
    for (size_t i = 0; i < samples; i++) {
      double part = ((double)i + 0.5) / (double)samples, d[2][2] = {{0}};
      bspline_basis(&c->b, mu, (1 - part) * c->knots[mu] + part * c->knots[mu + 1], 2, table);
      for (size_t j = 0; j < order; j++)
        for (size_t k = 0; k < 2; k++)
          for (size_t o = 0; o < 2; o++)
            d[o][k] += table[(o + 1) * order + j] * control[2 * (mu - c->b.degree + j) + k];
      double size = hypot(d[0][0], d[0][1]) * hypot(d[1][0], d[1][1]);
      least = fmin(least, c->signs[span] * contour_cross(d[0], d[1]) / size);
    }
  return least;
}

static inline double contour_test_row(const batten_matrix *m, size_t row, const double *x) {
  double sum = 0;
  for (size_t at = m->starts[row]; at < m->starts[row + 1]; at++) sum += m->values[at] * x[m->indices[at]];
  return sum;
}

/* Least slack of rows. */
static inline double contour_test_slack(const contour_rows *rows, const double *x) {
  double least = INFINITY;
  for (size_t i = 0; i < rows->matrix.rows; i++)
    least = fmin(least, contour_test_row(&rows->matrix, i, x) - rows->lower[i]);
  return least;
}

/* All 4 d - 2 inequalities of the Lemma for every piece, less those that are 0 by the equalities, as rows of length 1
 * with the right sides that `rows` would have; free with contour_test_full_free. */
static inline contour_rows contour_test_full(const contour_test_curve *c, const contour_rows *rows,
                                             const double *reference, double margin) {
  unsigned d = c->b.degree;
  size_t most = rows->wedge_count * (4 * d - 2), entries = 0, at = 0;
  size_t *starts = contour_test_memory(most + 1, sizeof *starts);
  uint32_t *indices = contour_test_memory(most * 2 * (d + 1), sizeof *indices);
  double *values = contour_test_memory(most * 2 * (d + 1), sizeof *values);
  double *lower = contour_test_memory(most, sizeof *lower), first[BSPLINE_ORDER * BSPLINE_ORDER];
  for (size_t q = 0; q < rows->wedge_count; q++) {
    const contour_wedge *w = &rows->wedges[q];
    size_t span = (w->mu - d) / (d - c->shape.smoothness);
    bool smooth = c->shape.smoothness == 2;
    bool zero_first = smooth && w->from == c->b.knots[w->mu] && contour_inflection(&c->shape, span);
    bool zero_last = smooth && w->to == c->b.knots[w->mu + 1] && contour_inflection(&c->shape, span + 1);
    for (unsigned k = 1; k <= 2; k++) {
      bspline_rows(&c->b, w->mu, k, w->from, w->to, first);
      for (unsigned i = 0; i + k <= d; i++) {
        if (k == 2 && ((zero_first && i == 0) || (zero_last && i + k == d))) continue;
        const double *row = first + i * (d + 1);
        double size = 0;
        for (unsigned j = 0; j <= d; j++) size += row[j] * row[j];
        for (int side = 0; side < 2; side++) {
          const double *dir = side ? w->v : w->u;
          double s = w->sign * (side && k == 1 ? -1 : 1) / sqrt(size), value = 0;
          for (unsigned j = 0; j <= d; j++)
            for (unsigned e = 0; e < 2; e++) {
              indices[entries] = (uint32_t)(2 * (w->mu - d + j) + e);
              values[entries] = s * row[j] * (e ? dir[0] : -dir[1]);
              value += values[entries] * reference[indices[entries]];
              entries++;
            }
          lower[at++] = fmax(margin * value, fmin(0.9 * value, k == 1 ? 1e-6 : 1e-10));
          starts[at] = entries;
        }
      }
    }
  }
  return (contour_rows){.matrix = batten_matrix_sparse(at, 2 * c->b.count, starts, indices, values), .lower = lower};
}

static inline void contour_test_full_free(contour_rows *r) {
  free((void *)(uintptr_t)r->matrix.starts);
  free((void *)(uintptr_t)r->matrix.indices);
  free((void *)(uintptr_t)r->matrix.values);
  free(r->lower);
}

/* Least value of rows, without their right sides. */
static inline double contour_test_least(const contour_rows *rows, const double *x) {
  double least = INFINITY;
  for (size_t i = 0; i < rows->matrix.rows; i++) least = fmin(least, contour_test_row(&rows->matrix, i, x));
  return least;
}

#endif
