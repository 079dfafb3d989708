/* Stacks of contours of known shape: what lofts are tried on. Shared by tests, benchmarks and examples. The same
 * numbers everywhere with the same mathematical library.
 *
 *   loft_scene s = loft_scene_make(ctx, &(loft_rule){.kind = LOFT_STACK, .degree = 3, .smoothness = 2, .contours =
 * 5}); batten_loft_build(ctx, s.count, (const batten_curve *const *)s.contours, s.heights, ...); loft_scene_free(&s);
 *
 * A contour is made from its tangent angle theta(t), which runs monotonously from inflection to inflection: legs of
 * the control polygon have the length of their knot interval times a speed, and the direction theta at the Greville
 * abscissa of x'. Polygons so turn as theta does, whatever the knots, and as they turn less than pi over the legs of
 * a span, so do the curves. Where x'' is to vanish both legs beside that vertex have one direction and speed.
 * Inflections are knots: degree - smoothness fold for smoothness 1, degree - 2 fold for smoothness 2 (so are all
 * knots). Closed polygons are closed by legs that lie against the gap becoming longer. */
#ifndef LOFT_SCENES_H
#define LOFT_SCENES_H

#include <batten/curve.h>
#include <stdlib.h>
#include <string.h>

#include "scenes.h"

typedef enum loft_kind {
  LOFT_STACK = 0, /* random contours that resemble their neighbours, each on knots of its own, turned and moved */
  LOFT_PAPER,     /* four open quadratic ones on different knots at equal distances, as in figure 5 */
  LOFT_CYLINDER,  /* all the same */
  LOFT_CONE,      /* shrinking evenly towards a point above the last one */
  LOFT_STRAIGHT,  /* open, two bends with a straight piece between */
  LOFT_KINDS
} loft_kind;

enum { LOFT_SPANS_MAX = 1024, LOFT_RUNS_MAX = 8 };

typedef struct loft_rule {
  loft_kind kind;
  unsigned degree, smoothness; /* 2 .. 5; 1, or 2 from degree 3 on */
  bool closed;
  size_t contours;    /* >= 2 */
  size_t spans;       /* of each contour, 0: 3 .. 29 as the seed says. Closed ones can have a few more */
  size_t inflections; /* of each contour, at the same t in all; closed: even */
  bool unmatched;     /* some contours have one of them elsewhere */
  bool slopes;        /* ends with given dy/dz */
  double decades;     /* over how many powers of ten spans are spread */
  double rotation;    /* from contour to contour, at most, radians */
  uint64_t seed;
} loft_rule;

typedef struct loft_scene {
  size_t count;
  batten_curve **contours;
  double *heights;
  batten_curve *slopes[2]; /* NULL without */
} loft_scene;

static inline void loft_scene_free(loft_scene *s) {
  for (size_t i = 0; i < s->count; i++) batten_curve_free(s->contours[i]);
  for (unsigned e = 0; e < 2; e++) batten_curve_free(s->slopes[e]);
  free(s->contours);
  free(s->heights);
  memset(s, 0, sizeof *s);
}

static inline void *loft_scene_memory(size_t count, size_t size) {
  void *p = calloc(count + 1, size);
  if (!p) abort(); /* scenes are small, and nothing can be tested without them */
  return p;
}

static inline double loft_scene_between(uint64_t *state, double a, double b) {
  return a + (b - a) * scene_uniform(state);
}

/* ---- splines of a degree on [0, 1], inner knots degree - smoothness fold -------------------------- */

typedef struct loft_scene_space {
  unsigned degree, fold;
  bool closed;
  size_t spans;
  const double *breaks; /* [spans + 1] */
} loft_scene_space;

/* Control points; closed: modulo this. */
static inline size_t loft_scene_count(const loft_scene_space *s) {
  return s->closed ? s->spans * s->fold : s->degree + 1 + (s->spans - 1) * s->fold;
}
/* Knot j over open ends. */
static inline double loft_scene_clamped(const loft_scene_space *s, size_t j) {
  size_t inner = (s->spans - 1) * s->fold;
  if (j <= s->degree) return 0;
  j -= s->degree + 1;
  return j < inner ? s->breaks[1 + j / s->fold] : 1;
}
/* Control point j lives on knots j .. j + degree + 1. */
static inline double loft_scene_knot(const loft_scene_space *s, size_t j) {
  if (!s->closed) return loft_scene_clamped(s, j);
  size_t count = loft_scene_count(s);
  return s->breaks[(j % count) / s->fold] + (double)(j / count);
}
/* Where x' has its control point v. */
static inline double loft_scene_greville(const loft_scene_space *s, size_t v) {
  double first = loft_scene_knot(s, v + 2), sum = 0;
  for (size_t j = v + 3; j <= v + s->degree; j++) sum += loft_scene_knot(s, j) - first;
  return first + sum / (s->degree - 1);
}

/* The closed curve's control point j over open ends: its blossom at those knots, in their first span. */
static inline void loft_scene_unroll(const loft_scene_space *s, const double *points, size_t j, double out[2]) {
  size_t span = j <= s->degree ? 0 : 1 + (j - s->degree - 1) / s->fold, mu = span * s->fold + s->fold - 1;
  size_t count = loft_scene_count(s), laps = (s->degree + count) / count; /* so that indices stay above 0 */
  double net[16][2], base = (double)laps;
  for (size_t k = 0; k <= s->degree; k++)
    memcpy(net[k], points + 2 * ((mu + laps * count + k - s->degree) % count), sizeof net[k]);
  for (size_t r = 1; r <= s->degree; r++) {
    double t = loft_scene_clamped(s, j + r);
    for (size_t k = s->degree; k >= r; k--) {
      size_t i = mu + laps * count + k - s->degree;
      double a = loft_scene_knot(s, i) - base, b = loft_scene_knot(s, i + s->degree + 1 - r) - base;
      double part = (t - a) / (b - a);
      for (unsigned c = 0; c < 2; c++) net[k][c] = (1 - part) * net[k - 1][c] + part * net[k][c];
    }
  }
  memcpy(out, net[s->degree], sizeof net[0]);
}

static inline batten_curve *loft_scene_curve(batten_context *ctx, const loft_scene_space *s, const double *points) {
  loft_scene_space open = *s;
  open.closed = false;
  size_t count = loft_scene_count(&open), knot_count = count + s->degree + 1;
  double *knots = loft_scene_memory(knot_count, sizeof *knots), *all = loft_scene_memory(2 * count, sizeof *all);
  for (size_t j = 0; j < knot_count; j++) knots[j] = loft_scene_clamped(&open, j);
  if (s->closed) {
    for (size_t j = 0; j + 1 < count; j++) loft_scene_unroll(s, points, j, all + 2 * j);
    memcpy(all + 2 * (count - 1), all, 2 * sizeof *all);
  } else
    memcpy(all, points, 2 * count * sizeof *all);
  batten_curve *out = NULL;
  if (batten_curve_create(ctx, &(batten_curve_form){s->degree, knot_count, knots, all, s->closed}, &out) < 0) abort();
  free(knots);
  free(all);
  return out;
}

/* ---- knots --------------------------------------------------------------------------------------- */

/* Breaks [LOFT_SPANS_MAX + 1] on [0, 1], marks [mark_count] ascending inside (0, 1) among them, two spans or more
 * beside each: spans of lengths spread evenly over their logarithm. Returns their number. */
static inline size_t loft_scene_breaks(uint64_t *state, size_t spans, size_t mark_count, const double *marks,
                                       double decades, bool closed, double *breaks) {
  size_t share[LOFT_RUNS_MAX + 1], pieces = mark_count + 1, given = 0, made = 0;
  for (size_t p = 0; p < pieces; p++) given += share[p] = !mark_count ? 1 : closed ? 4 : 2;
  for (; given < spans; given++) share[(size_t)(scene_uniform(state) * (double)pieces)]++;
  for (size_t p = 0; p < pieces; p++) {
    double a = p ? marks[p - 1] : 0, b = p < mark_count ? marks[p] : 1, sum = 0;
    size_t from = made;
    breaks[made++] = a;
    for (size_t k = 0; k < share[p]; k++) sum += breaks[made++] = pow(10, decades * scene_uniform(state));
    double at = 0;
    for (size_t k = 1; k <= share[p]; k++) {
      at += breaks[from + k];
      breaks[from + k] = a + (b - a) * at / sum;
    }
    made--;
    if (p + 1 == pieces) breaks[made] = 1;
  }
  /* A closed polygon needs legs all around. */
  for (size_t s = 0; closed && s < made;) {
    if (breaks[s + 1] - breaks[s] <= 0.26 || made == LOFT_SPANS_MAX) {
      s++;
      continue;
    }
    memmove(breaks + s + 2, breaks + s + 1, (made - s) * sizeof *breaks);
    breaks[s + 1] = 0.5 * (breaks[s] + breaks[s + 2]);
    made++;
  }
  return made;
}

/* ---- contours ------------------------------------------------------------------------------------ */

/* The tangent angle: start + the sum of the turns of whole runs and a monotonous part of the one where t is. */
typedef struct loft_scene_angle {
  bool closed;
  size_t runs;
  bool flat;                     /* its derivative vanishes at inflections */
  double end[LOFT_RUNS_MAX + 1]; /* from 0 to 1, closed: from origin on */
  double turn[LOFT_RUNS_MAX], warp[LOFT_RUNS_MAX];
  double start, origin;
  double wave[2]; /* of the speed: size, phase */
} loft_scene_angle;

static inline double loft_scene_theta(const loft_scene_angle *a, double t) {
  double sum = a->start, x = t - a->origin, laps = floor(x);
  if (!a->closed) laps = 0;
  x -= laps;
  for (size_t r = 0; r < a->runs; r++) sum += laps * a->turn[r];
  size_t r = 0;
  for (; r + 1 < a->runs && x >= a->end[r + 1]; r++) sum += a->turn[r];
  double u = fmin(fmax((x - a->end[r]) / (a->end[r + 1] - a->end[r]), 0), 1);
  u += a->warp[r] * sin(2 * SCENE_PI * u) / (2 * SCENE_PI);
  bool inflections = a->closed ? a->runs > 1 : true, from = inflections && (a->closed || r > 0),
       to = inflections && (a->closed || r + 1 < a->runs);
  if (a->flat && from && to)
    u = u * u * (3 - 2 * u);
  else if (a->flat && from)
    u = u * u;
  else if (a->flat && to)
    u = u * (2 - u);
  return sum + u * a->turn[r];
}
static inline double loft_scene_speed(const loft_scene_angle *a, double t) {
  return 1 + a->wave[0] * sin(2 * SCENE_PI * t + a->wave[1]);
}

/* Legs [2 * count] by lengths that close the polygon; false where some would have to be short or backward. */
static inline bool loft_scene_close(size_t count, double *legs) {
  double m[3] = {0}, gap[2] = {0}; /* sum of |leg| e e' lambda = -gap, e the direction of a leg */
  for (size_t v = 0; v < count; v++) {
    const double *p = legs + 2 * v;
    double length = hypot(p[0], p[1]);
    gap[0] += p[0];
    gap[1] += p[1];
    m[0] += p[0] * p[0] / length;
    m[1] += p[0] * p[1] / length;
    m[2] += p[1] * p[1] / length;
  }
  double det = m[0] * m[2] - m[1] * m[1], x = (m[1] * gap[1] - m[2] * gap[0]) / det,
         y = (m[1] * gap[0] - m[0] * gap[1]) / det;
  bool ok = det > 0;
  for (size_t v = 0; v < count; v++) {
    double *p = legs + 2 * v, factor = 1 + (x * p[0] + y * p[1]) / hypot(p[0], p[1]);
    ok = ok && factor > 0.15;
    p[0] *= factor;
    p[1] *= factor;
  }
  return ok;
}

/* Control points of a contour of about length 1 around 0. */
static inline bool loft_scene_polygon(const loft_scene_space *s, const loft_scene_angle *angle, double *points) {
  size_t count = loft_scene_count(s), legs = s->closed ? count : count - 1;
  double *leg = loft_scene_memory(2 * legs, sizeof *leg);
  for (size_t v = 0; v < legs; v++) {
    double at = loft_scene_greville(s, v);
    /* The vertex before it, or after it, at which x'' is 0: its knots but the outermost are the inflection. */
    for (size_t w = v ? v - 1 : v; angle->flat && angle->runs > 1 && w <= v; w++) {
      double a = loft_scene_knot(s, w + 3), b = loft_scene_knot(s, w + s->degree), x = a - angle->origin;
      if (angle->closed) x -= floor(x);
      bool inflection = angle->closed && fmin(x, 1 - x) < 1e-12;
      for (size_t r = 1; r < angle->runs; r++) inflection = inflection || fabs(x - angle->end[r]) < 1e-12;
      if (a == b && inflection) at = a;
    }
    if (v == 0 && angle->closed && angle->flat && angle->runs > 1) { /* the vertex before leg 0 is the last one */
      double a = loft_scene_knot(s, count + 2), b = loft_scene_knot(s, count + s->degree - 1), x = a - angle->origin;
      if (a == b && fabs(x - round(x)) < 1e-12) at = a - 1;
      for (size_t r = 1; r < angle->runs; r++)
        if (a == b && fabs(x - floor(x) - angle->end[r]) < 1e-12) at = a - 1;
    }
    double interval = loft_scene_knot(s, v + s->degree + 1) - loft_scene_knot(s, v + 1);
    double length = interval / s->degree * loft_scene_speed(angle, at), theta = loft_scene_theta(angle, at);
    leg[2 * v] = length * cos(theta);
    leg[2 * v + 1] = length * sin(theta);
  }
  bool ok = !s->closed || loft_scene_close(legs, leg);
  double middle[2] = {0};
  points[0] = points[1] = 0;
  for (size_t v = 0; v + 1 < count; v++)
    for (unsigned c = 0; c < 2; c++) points[2 * v + 2 + c] = points[2 * v + c] + leg[2 * v + c];
  for (size_t j = 0; j < 2 * count; j++) middle[j % 2] += points[j] / (double)count;
  for (size_t j = 0; j < 2 * count; j++) points[j] -= middle[j % 2];
  free(leg);
  return ok;
}

/* The tangent angle that all contours of a stack resemble. */
static inline loft_scene_angle loft_scene_common(const loft_rule *r, uint64_t *state) {
  loft_scene_angle a = {.closed = r->closed, .flat = r->smoothness == 2, .runs = 1, .end = {0, 1}};
  if (r->kind == LOFT_STRAIGHT) {
    a.runs = 3;
    a.flat = false;
    a.turn[0] = 1.1, a.turn[1] = 0, a.turn[2] = 0.7;
    a.end[1] = 0.35, a.end[2] = 0.65, a.end[3] = 1;
    return a;
  }
  if (r->inflections) a.runs = r->closed ? r->inflections : r->inflections + 1;
  double side = scene_uniform(state) < 0.5 ? -1 : 1;
  for (size_t k = 0; k < a.runs; k++) {
    a.end[k + 1] = k + 1 == a.runs ? 1 : ((double)k + loft_scene_between(state, 0.85, 1.15)) / (double)a.runs;
    a.turn[k] = side * loft_scene_between(state, 0.7, a.runs > 1 ? 1.6 : 2.5);
    if (k % 2) a.turn[k] = -a.turn[k];
    a.warp[k] = loft_scene_between(state, -0.6, 0.6);
  }
  a.start = loft_scene_between(state, -3, 3);
  if (r->closed) a.origin = r->seed % 4 ? loft_scene_between(state, 0.02, 0.9) : 0;
  return a;
}

/* Turns of closed contours: a whole one, those that bend inwards a little. */
static inline void loft_scene_whole_turn(loft_scene_angle *a, double inward) {
  double side = a->turn[0] < 0 ? -1 : 1, in = 0, sum = 0;
  for (size_t k = 1; k < a->runs; k += 2) {
    a->turn[k] = -side * inward * fmin(fabs(a->turn[k]), 1);
    in += fabs(a->turn[k]);
  }
  for (size_t k = 0; k < a->runs; k += 2) sum += fabs(a->turn[k]);
  for (size_t k = 0; k < a->runs; k += 2) a->turn[k] *= (2 * SCENE_PI + in) / sum;
}

/* Less of all that keeps polygons from closing. */
static inline void loft_scene_calm(loft_scene_angle *a) {
  double mean[2] = {0};
  for (size_t k = 0; k < a->runs; k++) mean[k % 2] += a->turn[k] / (double)((a->runs + 1 - k % 2) / 2);
  for (size_t k = 0; k < a->runs; k++) {
    a->turn[k] += 0.5 * (mean[k % 2] - a->turn[k]);
    a->warp[k] *= 0.5;
  }
  a->wave[0] *= 0.5;
}

/* A contour like the common angle says, its own turns, speed and knots. */
static inline batten_curve *loft_scene_contour(batten_context *ctx, const loft_rule *r,
                                               const loft_scene_angle *common, uint64_t *state, double start,
                                               double scale, const double shift[2]) {
  loft_scene_angle a = *common;
  double vary = r->kind == LOFT_STACK ? 1 : 0;
  for (size_t k = 0; k < a.runs; k++) {
    a.turn[k] *= 1 + vary * loft_scene_between(state, -0.25, 0.25);
    a.warp[k] += vary * loft_scene_between(state, -0.2, 0.2);
  }
  a.start = start;
  a.wave[0] = vary * loft_scene_between(state, 0, 0.4);
  a.wave[1] = vary * loft_scene_between(state, 0, 6);
  if (r->unmatched && a.runs > 1 && scene_uniform(state) < 0.4)
    a.end[a.runs - 1] += (scene_uniform(state) < 0.5 ? -0.2 : 0.2) / (double)a.runs;
  if (!r->closed && a.runs > 1 && r->unmatched && scene_uniform(state) < 0.2) a.runs--, a.end[a.runs] = 1;

  double marks[LOFT_RUNS_MAX + 1], *breaks = loft_scene_memory(LOFT_SPANS_MAX + 1, sizeof *breaks);
  size_t mark_count = 0;
  for (size_t k = r->closed && a.runs > 1 ? 0 : 1; k < a.runs; k++) {
    double t = a.end[k] + a.origin;
    t -= floor(t);
    if (t == 0) continue;
    size_t at = mark_count++;
    for (; at > 0 && marks[at - 1] > t; at--) marks[at] = marks[at - 1];
    marks[at] = t;
  }
  size_t wanted = r->spans ? r->spans : 3 + (size_t)(27 * scene_uniform(state));
  double *points = NULL, decades = r->decades, inward = 0.7;
  loft_scene_space s;
  size_t count;
  for (bool done = false; !done; inward *= 0.85, decades *= 0.6, wanted += 2) {
    if (points) loft_scene_calm(&a);
    if (r->closed) loft_scene_whole_turn(&a, inward);
    size_t spans = loft_scene_breaks(state, wanted, mark_count, marks, decades, r->closed, breaks);
    s = (loft_scene_space){r->degree, r->degree - r->smoothness, r->closed, spans, breaks};
    count = loft_scene_count(&s);
    free(points);
    points = loft_scene_memory(2 * count, sizeof *points);
    done = loft_scene_polygon(&s, &a, points);
    if (wanted + 64 > LOFT_SPANS_MAX) abort();
  }
  for (size_t j = 0; j < 2 * count; j++) points[j] = scale * points[j] + shift[j % 2];
  batten_curve *out = loft_scene_curve(ctx, &s, points);
  free(points);
  free(breaks);
  return out;
}

/* Slopes that keep the shape of a contour: it is turned, stretched and moved. */
static inline batten_curve *loft_scene_slope(batten_context *ctx, const batten_curve *contour, uint64_t *state) {
  batten_curve_form form = batten_curve_get(contour);
  size_t count = form.knot_count - form.degree - 1;
  double *points = loft_scene_memory(2 * count, sizeof *points), map[6];
  for (size_t k = 0; k < 6; k++) map[k] = loft_scene_between(state, -0.15, 0.15);
  for (size_t j = 0; j < count; j++)
    for (size_t c = 0; c < 2; c++)
      points[2 * j + c] =
          map[3 * c] * form.control_points[2 * j] + map[3 * c + 1] * form.control_points[2 * j + 1] + map[3 * c + 2];
  form.control_points = points;
  batten_curve *out = NULL;
  if (batten_curve_create(ctx, &form, &out) < 0) abort();
  free(points);
  return out;
}

/* ---- stacks -------------------------------------------------------------------------------------- */

/* Legs turn to and fro by up to half a right angle and some vertices hardly turn, so that without inequalities three
 * of them turn the wrong way between contours. */
static inline void loft_scene_paper(batten_context *ctx, loft_scene *out) {
  static const double breaks[4][5] = {
      {0, 0.15, 0.35, 0.7, 1}, {0, 0.4, 0.7, 1}, {0, 0.15, 0.35, 0.6, 1}, {0, 0.3, 0.6, 1}};
  static const size_t spans[4] = {4, 3, 4, 3};
  static const double points[4][6][2] = {
      {{-0.22, 0.25}, {-0.23, 0.38}, {-0.02, 0.59}, {0.63, 0.78}, {1.21, 0.67}, {1.49, 0.5}},
      {{1.54, -0.31}, {1.42, -0.04}, {1.42, 0.67}, {1.65, 1.15}, {1.85, 1.28}},
      {{1.95, 0.81}, {1.99, 1}, {2.34, 1.04}, {2.72, 0.67}, {3.01, 0.32}, {3.29, -0.11}},
      {{3.12, -0.24}, {3.05, 0.12}, {3.29, 0.57}, {3.77, 1.29}, {4.19, 1.4}}};
  for (size_t i = 0; i < 4; i++) {
    loft_scene_space s = {2, 1, false, spans[i], breaks[i]};
    out->contours[i] = loft_scene_curve(ctx, &s, points[i][0]);
    out->heights[i] = (double)i;
  }
}

static inline loft_scene loft_scene_make(batten_context *ctx, const loft_rule *given) {
  loft_rule r = *given;
  if (r.kind == LOFT_PAPER) r.contours = 4;
  loft_scene out = {.count = r.contours};
  out.contours = loft_scene_memory(r.contours, sizeof(batten_curve *));
  out.heights = loft_scene_memory(r.contours, sizeof *out.heights);
  uint64_t state = r.seed * 7919 + 17;
  if (r.kind == LOFT_PAPER) {
    loft_scene_paper(ctx, &out);
    return out;
  }
  loft_scene_angle common = loft_scene_common(&r, &state);
  bool same = r.kind == LOFT_CYLINDER || r.kind == LOFT_CONE;
  double start = common.start, scale = 1, shift[2] = {0}, z = 0;
  uint64_t fixed = state;
  for (size_t i = 0; i < r.contours; i++) {
    out.heights[i] = z;
    double gap = exp(loft_scene_between(&state, -1.2, 1.2));
    uint64_t own = same ? fixed : state ^ (0x9e3779b9u * (i + 1));
    out.contours[i] = loft_scene_contour(ctx, &r, &common, &own, start, scale, shift);
    z += gap;
    if (same) continue;
    start += loft_scene_between(&state, -r.rotation, r.rotation);
    scale = loft_scene_between(&state, 0.7, 1.4);
    for (unsigned c = 0; c < 2; c++) shift[c] += loft_scene_between(&state, -0.4, 0.4);
  }
  for (size_t i = 0; r.kind == LOFT_CONE && i < r.contours; i++) { /* the apex is above the middle of the polygon */
    batten_curve_form form = batten_curve_get(out.contours[i]);
    size_t count = form.knot_count - form.degree - 1;
    double *points = loft_scene_memory(2 * count, sizeof *points), factor = 1 - out.heights[i] / (1.5 * z);
    for (size_t j = 0; j < 2 * count; j++) points[j] = factor * form.control_points[j];
    form.control_points = points;
    batten_curve *cone = NULL;
    if (batten_curve_create(ctx, &form, &cone) < 0) abort();
    batten_curve_free(out.contours[i]);
    out.contours[i] = cone;
    free(points);
  }
  for (unsigned e = 0; r.slopes && e < 2; e++)
    out.slopes[e] = loft_scene_slope(ctx, out.contours[e ? r.contours - 1 : 0], &state);
  return out;
}

/* The random stacks: degrees 2 .. 5, smoothness 1 and 2, 3 .. 12 contours of 4 .. 30 knots, spans over two powers of
 * ten; a third are closed, half have inflections, a sixth of these some without partners. */
static inline loft_rule loft_rule_random(uint64_t seed) {
  uint64_t state = seed * 104729 + 5;
  loft_rule r = {.kind = LOFT_STACK, .seed = seed, .decades = 2, .rotation = 0.6};
  r.degree = 2 + (unsigned)(4 * scene_uniform(&state));
  r.smoothness = r.degree == 2 ? 1 : 1 + (unsigned)(2 * scene_uniform(&state));
  r.contours = 3 + (size_t)(10 * scene_uniform(&state));
  r.closed = scene_uniform(&state) < 1.0 / 3;
  if (scene_uniform(&state) < 0.5)
    r.inflections = r.closed ? 2 + 2 * (size_t)(2 * scene_uniform(&state)) : 1 + (size_t)(2 * scene_uniform(&state));
  r.unmatched = scene_uniform(&state) < 1.0 / 6;
  r.slopes = scene_uniform(&state) < 1.0 / 5;
  return r;
}

#endif
