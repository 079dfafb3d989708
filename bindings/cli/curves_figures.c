/* Figures that planar curves themselves have: the report's keys (docs/report.md), lines of the summary. */
#include "curves.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const double DEGREES = 57.29577951308232; /* of a radian */

/* ---- form -------------------------------------------------------------------------------------------- */

typedef struct sizes {
  unsigned degree_min, degree_max;
  size_t spans, points, closed;
} sizes;

static sizes sizes_of(size_t count, const batten_curve *const *curves) {
  sizes s = {.degree_min = BATTEN_CURVE_DEGREE_MAX};
  for (size_t i = 0; i < count; i++) {
    batten_curve_form form = batten_curve_get(curves[i]);
    if (form.degree < s.degree_min) s.degree_min = form.degree;
    if (form.degree > s.degree_max) s.degree_max = form.degree;
    for (size_t k = 1; k < form.knot_count; k++) s.spans += form.knots[k] > form.knots[k - 1];
    s.points += form.knot_count - form.degree - 1;
    s.closed += form.closed != 0;
  }
  return s;
}

void curves_report_form(size_t count, const batten_curve *const *curves, cli_report *r) {
  sizes s = sizes_of(count, curves);
  cli_report_count(r, "curves", count);
  cli_report_count(r, "curves_closed", s.closed);
  if (s.degree_min == s.degree_max)
    cli_report_count(r, "degree", s.degree_max);
  else
    cli_report_null(r, "degree");
  cli_report_count(r, "spans", s.spans);
  cli_report_count(r, "control_points", s.points);
}

void curves_print_form(size_t count, const batten_curve *const *curves) {
  sizes s = sizes_of(count, curves);
  char degree[40];
  if (s.degree_min == s.degree_max)
    snprintf(degree, sizeof degree, "degree %u", s.degree_max);
  else
    snprintf(degree, sizeof degree, "degrees %u to %u", s.degree_min, s.degree_max);
  if (count == 1)
    cli_line("curve", "%s, %s, %zu control points, %zu span%s", s.closed ? "closed" : "open", degree, s.points,
             s.spans, s.spans == 1 ? "" : "s");
  else
    cli_line("curves", "%zu, %zu of them closed, %s, %zu control points, %zu spans", count, s.closed, degree,
             s.points, s.spans);
}

/* ---- measures ---------------------------------------------------------------------------------------- */

typedef struct totals {
  double length, area, energy, centroid[2], lower[2], upper[2], curvature_min, curvature_max;
  size_t inflections, min_curve, max_curve;
} totals;

static totals add_up(size_t count, const batten_curve_measures *m) {
  totals t = {.lower = {INFINITY, INFINITY},
              .upper = {-INFINITY, -INFINITY},
              .curvature_min = INFINITY,
              .curvature_max = -INFINITY};
  for (size_t i = 0; i < count; i++) {
    t.length += m[i].length;
    t.area += m[i].area;
    t.energy += m[i].energy;
    t.inflections += m[i].inflections;
    for (int k = 0; k < 2; k++) {
      t.centroid[k] += m[i].length * m[i].centroid[k];
      t.lower[k] = fmin(t.lower[k], m[i].lower[k]);
      t.upper[k] = fmax(t.upper[k], m[i].upper[k]);
    }
    if (m[i].curvature_min < t.curvature_min) {
      t.curvature_min = m[i].curvature_min;
      t.min_curve = i;
    }
    if (m[i].curvature_max > t.curvature_max) {
      t.curvature_max = m[i].curvature_max;
      t.max_curve = i;
    }
  }
  for (int k = 0; k < 2; k++) t.centroid[k] = count == 1 ? m[0].centroid[k] : t.centroid[k] / t.length;
  return t;
}

typedef double figure(const batten_curve_measures *m);
static double length_of(const batten_curve_measures *m) { return m->length; }
static double area_of(const batten_curve_measures *m) { return m->area; }
static double minimum_of(const batten_curve_measures *m) { return m->curvature_min; }
static double maximum_of(const batten_curve_measures *m) { return m->curvature_max; }
static double turn_of(const batten_curve_measures *m) { return m->turn * DEGREES; }
static double energy_of(const batten_curve_measures *m) { return m->energy; }

/* A figure of each curve. */
static void report_lists(size_t count, const batten_curve_measures *m, cli_report *r) {
  static const struct {
    const char *key;
    figure *of;
  } lists[] = {{"curve_length", length_of},         {"curve_area", area_of}, {"curve_curvature_min", minimum_of},
               {"curve_curvature_max", maximum_of}, {"curve_turn", turn_of}, {"curve_energy", energy_of}};
  double *numbers = malloc(count * sizeof *numbers);
  size_t *counts = malloc(count * sizeof *counts);
  if (numbers && counts) {
    for (size_t k = 0; k < sizeof lists / sizeof lists[0]; k++) {
      for (size_t i = 0; i < count; i++) numbers[i] = lists[k].of(&m[i]);
      cli_report_numbers(r, lists[k].key, count, numbers);
    }
    for (size_t i = 0; i < count; i++) counts[i] = m[i].inflections;
    cli_report_counts(r, "curve_inflections", count, counts);
  } else {
    r->failed = true;
  }
  free(numbers);
  free(counts);
}

void curves_report_measures(size_t count, const batten_curve_measures *m, cli_report *r) {
  totals t = add_up(count, m);
  cli_report_number(r, "length", t.length);
  cli_report_number(r, "area", t.area);
  cli_report_number(r, "centroid_x", t.centroid[0]);
  cli_report_number(r, "centroid_y", t.centroid[1]);
  cli_report_box(r, 2, t.lower, t.upper);
  cli_report_number(r, "curvature_min", m[t.min_curve].curvature_min);
  cli_report_number(r, "curvature_max", m[t.max_curve].curvature_max);
  cli_report_number(r, "curvature_min_at", m[t.min_curve].curvature_min_at);
  cli_report_number(r, "curvature_max_at", m[t.max_curve].curvature_max_at);
  cli_report_count(r, "curvature_min_curve", t.min_curve);
  cli_report_count(r, "curvature_max_curve", t.max_curve);
  cli_report_number(r, "turn", count == 1 ? turn_of(&m[0]) : NAN);
  cli_report_number(r, "energy", t.energy);
  cli_report_count(r, "inflections", t.inflections);
  report_lists(count, m, r);
}

/* A line for each of several curves, as far as a screen goes. */
static void print_each(size_t count, const batten_curve_measures *m) {
  enum { SHOWN = 40 };
  for (size_t i = 0; i < count && i < SHOWN; i++) {
    char name[32];
    snprintf(name, sizeof name, "curve %zu", i);
    cli_line(name, "length %.6g, area %.6g, curvature %.4g .. %.4g, turn %.4g degrees, %zu inflection%s", m[i].length,
             m[i].area, m[i].curvature_min, m[i].curvature_max, turn_of(&m[i]), m[i].inflections,
             m[i].inflections == 1 ? "" : "s");
  }
  if (count > SHOWN) cli_line("...", "%zu more, see --report", count - SHOWN);
}

void curves_print_measures(size_t count, const batten_curve_measures *m) {
  totals t = add_up(count, m);
  cli_line("length", "%.9g", t.length);
  if (t.area > 0 || t.area < 0) cli_line("area", "%.9g", t.area);
  cli_line("centroid", "%.6g  %.6g", t.centroid[0], t.centroid[1]);
  cli_line("box", "%.6g .. %.6g  x  %.6g .. %.6g", t.lower[0], t.upper[0], t.lower[1], t.upper[1]);
  if (count == 1)
    cli_line("curvature", "%.4g at t = %.6g .. %.4g at t = %.6g", m[0].curvature_min, m[0].curvature_min_at,
             m[0].curvature_max, m[0].curvature_max_at);
  else
    cli_line("curvature", "%.4g of curve %zu .. %.4g of curve %zu", m[t.min_curve].curvature_min, t.min_curve,
             m[t.max_curve].curvature_max, t.max_curve);
  if (count == 1) cli_line("turn", "%.6g degrees", turn_of(&m[0]));
  cli_line("energy", "%.6g", t.energy);
  cli_line("inflections", "%zu", t.inflections);
  if (count > 1) print_each(count, m);
}
