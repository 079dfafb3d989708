/* Planar B-spline curves of every kind that files know: degrees 1 to 9, open and closed, simple and multiple knots,
 * one span and many, in planes of every direction. */
#ifndef TEST_CURVE_CASES_H
#define TEST_CURVE_CASES_H

#include <batten/curve.h>
#include <batten/exchange.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

typedef struct curve_case {
  const char *name;
  unsigned degree;
  bool closed;
  size_t count, spans; /* control points, nonempty spans */
  double knots[24];    /* [count + degree + 1] */
  batten_plane plane;
} curve_case;

enum { CURVE_CASES = 8, CURVE_CASE_POINTS = 14 };

/* The axes of the last planes are (2, 1, 2) / 3, (-2, 2, 1) / 3, (1, 2, -2) / 3. */
static const curve_case curve_cases[CURVE_CASES] = {
    {"polygon", 1, false, 4, 3, {0, 0, 1, 1.5, 4, 4}, {{0, 0, 3}, {{1, 0, 0}, {0, 1, 0}}}},
    {"triangle", 1, true, 4, 3, {-1, -1, 0, 1, 2, 2}, {{0, 0, -2.5}, {{1, 0, 0}, {0, 1, 0}}}},
    {"parabola", 2, false, 3, 1, {0, 0, 0, 1, 1, 1}, {{0, 7, 0}, {{1, 0, 0}, {0, 0, 1}}}},
    {"cubic",
     3,
     false,
     9,
     6,
     {-0.1, -0.1, -0.1, -0.1, 0.3, 0.6, 0.7, 0.8, 2.5, 3, 3, 3, 3},
     {{1, -2, 0}, {{0, 1, 0}, {0, 0, 1}}}},
    {"double knot",
     3,
     true,
     8,
     4,
     {0, 0, 0, 0, 0.25, 0.5, 0.5, 0.75, 1, 1, 1, 1},
     {{1, 2, 3}, {{2 / 3.0, 1 / 3.0, 2 / 3.0}, {-2 / 3.0, 2 / 3.0, 1 / 3.0}}}},
    {"corner",
     2,
     false,
     6,
     3,
     {0, 0, 0, 0.4, 0.4, 0.7, 1, 1, 1},
     {{0, 0, 0}, {{1 / 3.0, 2 / 3.0, -2 / 3.0}, {-2 / 3.0, 2 / 3.0, 1 / 3.0}}}},
    {"quintic",
     5,
     true,
     9,
     4,
     {0, 0, 0, 0, 0, 0, 1, 2, 3, 4, 4, 4, 4, 4, 4},
     {{-1, 0.5, 4}, {{1 / 3.0, 2 / 3.0, -2 / 3.0}, {2 / 3.0, 1 / 3.0, 2 / 3.0}}}},
    {"high",
     9,
     false,
     11,
     2,
     {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 5, 11, 11, 11, 11, 11, 11, 11, 11, 11, 11},
     {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}}}},
};

/* Points on a wavy spiral; on a wavy ring where it is closed. */
static inline batten_status curve_case_make(batten_context *ctx, const curve_case *c, batten_curve **out) {
  double points[CURVE_CASE_POINTS][2];
  for (size_t i = 0; i < c->count; i++) {
    double angle = (c->closed ? 6.283185307179586 : 4.0) * (double)i / (double)(c->count - 1);
    double radius = 5 + (i % 3 == 1) + (c->closed ? 0 : 0.3 * (double)i);
    points[i][0] = 1.25 + radius * cos(angle);
    points[i][1] = -0.5 + radius * sin(angle);
  }
  if (c->closed) memcpy(points[c->count - 1], points[0], sizeof points[0]);
  const batten_curve_form form = {c->degree, c->count + c->degree + 1, c->knots, points[0], c->closed};
  return batten_curve_create(ctx, &form, out);
}

#endif
