/* Tensor-product surfaces of all ways in which sides can meet, for tests of files and of what reads them. Control
 * points are those of a shape at equally spaced places; one is known exactly. */
#ifndef TEST_SURFACE_SIDES_H
#define TEST_SURFACE_SIDES_H

#include <batten/surface.h>
#include <math.h>
#include <stdbool.h>

typedef struct surface_side_case {
  const char *name;
  unsigned degree[2];
  size_t points[2];
  void (*at)(double s, double t, double out[3]);
  unsigned edges, uses; /* of the face: different edges, and how often the loop passes one */
  bool iges_only;       /* STEP has no such faces */
} surface_side_case;

enum { SURFACE_SIDE_POINTS_MAX = 200, SURFACE_SIDE_KNOTS_MAX = 40 };

#define SURFACE_SIDE_TURN 6.283185307179586

/* As control points of degree 2 x 2: z = x^2 / 2 + y^2 / 4 over [0, 2] x [0, 2]. */
static inline void shape_paraboloid(double s, double t, double out[3]) {
  out[0] = 2 * s;
  out[1] = 2 * t;
  out[2] = (s > 0.75 ? 2 : 0) + (t > 0.75 ? 1 : 0);
}
static inline void shape_wave(double s, double t, double out[3]) {
  out[0] = 6 * s + 0.3 * t;
  out[1] = 3 * t - 0.5 * s * t;
  out[2] = 0.4 * sin(6 * s) + t * t * cos(5 * s);
}
static inline void shape_cone(double s, double t, double out[3]) {
  out[0] = s * cos(1.2 * t);
  out[1] = s * sin(1.2 * t);
  out[2] = 2 - 0.7 * s;
}
/* Two neighbouring sides are points. */
static inline void shape_leaf(double s, double t, double out[3]) {
  out[0] = 3 * s * t;
  out[1] = s * t * (s - t);
  out[2] = 0.3 * s * t * (2 - s * t);
}
static inline void shape_slice(double s, double t, double out[3]) {
  out[0] = sin(0.5 * SURFACE_SIDE_TURN * t) * cos(1.5 * s);
  out[1] = sin(0.5 * SURFACE_SIDE_TURN * t) * sin(1.5 * s);
  out[2] = -cos(0.5 * SURFACE_SIDE_TURN * t);
}
static inline void shape_tube(double s, double t, double out[3]) {
  out[0] = (1 + 0.2 * t) * cos(SURFACE_SIDE_TURN * s);
  out[1] = (1 - 0.1 * t) * sin(SURFACE_SIDE_TURN * s);
  out[2] = 4 * t;
}
/* The same, closed in the other parameter. */
static inline void shape_pipe(double s, double t, double out[3]) { shape_tube(t, s, out); }
static inline void shape_cap(double s, double t, double out[3]) {
  out[0] = t * cos(SURFACE_SIDE_TURN * s);
  out[1] = t * sin(SURFACE_SIDE_TURN * s);
  out[2] = -t * t;
}
static inline void shape_balloon(double s, double t, double out[3]) {
  out[0] = 2 * sin(0.5 * SURFACE_SIDE_TURN * t) * cos(SURFACE_SIDE_TURN * s);
  out[1] = sin(0.5 * SURFACE_SIDE_TURN * t) * sin(SURFACE_SIDE_TURN * s);
  out[2] = -1.5 * cos(0.5 * SURFACE_SIDE_TURN * t);
}
static inline void shape_ring(double s, double t, double out[3]) {
  double r = 3 + cos(SURFACE_SIDE_TURN * t);
  out[0] = r * cos(SURFACE_SIDE_TURN * s);
  out[1] = r * sin(SURFACE_SIDE_TURN * s);
  out[2] = sin(SURFACE_SIDE_TURN * t);
}

static const surface_side_case surface_side_cases[] = {
    {"paraboloid", {2, 2}, {3, 3}, shape_paraboloid, 4, 4, false},
    {"bicubic", {3, 3}, {4, 4}, shape_wave, 4, 4, false},
    {"wave", {3, 2}, {7, 4}, shape_wave, 4, 4, false},
    {"high", {9, 7}, {11, 9}, shape_wave, 4, 4, false},
    {"plane", {1, 1}, {2, 2}, shape_cone, 3, 3, false},
    {"cone", {2, 3}, {3, 5}, shape_cone, 3, 3, false},
    {"leaf", {3, 3}, {5, 5}, shape_leaf, 2, 2, true},
    {"slice", {2, 3}, {4, 7}, shape_slice, 2, 2, false},
    {"tube", {3, 1}, {12, 2}, shape_tube, 3, 4, false},
    {"pipe", {2, 3}, {4, 12}, shape_pipe, 3, 4, false},
    {"cap", {3, 2}, {12, 4}, shape_cap, 2, 3, false},
    {"balloon", {3, 3}, {12, 8}, shape_balloon, 1, 2, false},
    {"ring", {3, 3}, {12, 12}, shape_ring, 2, 4, false},
};
enum { SURFACE_SIDE_CASES = sizeof surface_side_cases / sizeof surface_side_cases[0] };

/* Knots with equal spans from `from`, each of them `width` long. */
static inline size_t surface_sides_knots(unsigned degree, size_t points, double from, double width, double *knots) {
  size_t count = points + degree + 1;
  for (size_t i = 0; i < count; i++) {
    size_t span = i <= degree ? 0 : i >= points ? points - degree : i - degree;
    knots[i] = from + width * (double)span;
  }
  return count;
}

/* On domains that begin at 0 and at -1, and are not of length 1 where there are inner knots. */
static inline batten_status surface_sides_make(batten_context *ctx, const surface_side_case *shape,
                                               batten_surface **out) {
  double knots[2][SURFACE_SIDE_KNOTS_MAX], points[3 * SURFACE_SIDE_POINTS_MAX];
  batten_surface_form form = {.degree = {shape->degree[0], shape->degree[1]}, .control_points = points};
  for (int i = 0; i < 2; i++) {
    form.knot_count[i] =
        surface_sides_knots(shape->degree[i], shape->points[i], -(double)i, 1.0 + 0.25 * i, knots[i]);
    form.knots[i] = knots[i];
  }
  for (size_t i = 0; i < shape->points[0]; i++)
    for (size_t j = 0; j < shape->points[1]; j++)
      shape->at((double)i / (double)(shape->points[0] - 1), (double)j / (double)(shape->points[1] - 1),
                points + 3 * (i * shape->points[1] + j));
  return batten_surface_create(ctx, &form, out);
}

#endif
