/* The paper's test function of two variables, cut into slices x = const, each known at a few nodes: what remains of
 * it when the slices' functions are blended. Shared by tests and benchmarks. [Savchenko et al. 1995, section 5.5]
 *
 * The solid is z <= F(x, y). A slice's defining function is U(y) - z, U the volume spline (n = 1, m = 2) through its
 * nodes. The function spans [14, 69] on the square; what the paper calls its normalized range, [0, 8.4], is read as a
 * linear map onto it. */
#ifndef STACK_FUNCTION_H
#define STACK_FUNCTION_H

#include <batten/frep.h>
#include <batten/stack.h>
#include <stdlib.h>

#include "scenes.h"

enum { FUNCTION_TRIALS = 469 }; /* the paper's */

static inline double function_noise_factor(double p, double q) {
  const double amplitude = 2, frequency = 0.8, phase = 1;
  double s1p = sin(frequency * p), s1q = sin(frequency * q);
  return amplitude * (s1p + amplitude / 1.17 * sin(frequency * p / 1.35 + phase * s1q));
}
static inline double function_value(double x, double y) {
  return 64 - (x - 5) * (x - 5) - (y - 5) * (y - 5) + function_noise_factor(x, y) * function_noise_factor(y, x);
}
static inline double function_scale(void) { return 8.4 / (69 - 14); }

/* F_i(y, z) = U(y) - z as a host's field. */
static inline batten_status function_slice(const void *user, batten_context *ctx, size_t count, const double *points,
                                           double *values, double *gradients, double *hessians) {
  double *y = calloc(3 * count + 1, sizeof *y);
  (void)hessians;
  if (!y) return batten_fail(ctx, BATTEN_E_NOMEM, "out of memory");
  for (size_t i = 0; i < count; i++) y[i] = points[2 * i];
  batten_status st = batten_spline_evaluate(ctx, user, count, y, y + count, y + 2 * count, NULL);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    if (values) values[i] = y[count + i] - points[2 * i + 1];
    if (gradients) {
      gradients[2 * i] = y[2 * count + i];
      gradients[2 * i + 1] = -1;
    }
  }
  free(y);
  return st;
}

/* One slice's plane solid; *u the spline that it looks at, which must outlive it. nodes: [count][2] y, z. */
static inline batten_status function_make_slice(batten_context *ctx, size_t count, const double *nodes,
                                                batten_spline **u, batten_solid **out) {
  double *y = malloc(2 * count * sizeof *y);
  if (!y) return batten_fail(ctx, BATTEN_E_NOMEM, "out of memory");
  for (size_t j = 0; j < count; j++) {
    y[j] = nodes[2 * j];
    y[count + j] = nodes[2 * j + 1];
  }
  batten_spline_data d = batten_spline_data_default();
  d.n = 1;
  d.count = count;
  d.points = y;
  d.values = y + count;
  batten_spline_options o = batten_spline_options_default();
  o.loo_samples = 0;
  batten_carrier *carrier = NULL;
  batten_frep *tree = NULL;
  const double lower[2] = {0, -20}, upper[2] = {10, 20};
  batten_status st = batten_spline_fit(ctx, &d, &o, u, NULL);
  if (st >= 0) {
    batten_field field = {.dimension = 2, .order = 1, .evaluate = function_slice, .user = *u};
    st = batten_carrier_callback(ctx, &field, 1e-4, &carrier);
  }
  if (st >= 0) st = batten_frep_carrier(ctx, carrier, &tree);
  if (st >= 0) st = batten_frep_to_solid(ctx, tree, lower, upper, 2, out);
  batten_frep_free(tree);
  batten_carrier_free(carrier);
  free(y);
  return st;
}

/* Root mean square error at random points, normalised range; negative when something failed. */
static inline double function_error(batten_context *ctx, size_t slices, size_t nodes, batten_stack_between between) {
  batten_section *sections = calloc(slices, sizeof *sections);
  batten_solid **functions = calloc(slices, sizeof(batten_solid *)), *solid = NULL;
  batten_spline **splines = calloc(slices, sizeof(batten_spline *));
  double *points = malloc(2 * slices * nodes * sizeof *points), *numbers = malloc(3 * slices * sizeof *numbers);
  size_t starts[2] = {0, nodes};
  double error = -1;
  batten_status st = sections && functions && splines && points && numbers ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t i = 0; st >= 0 && i < slices; i++) {
    double x = 10 * (double)i / (double)(slices - 1), *at = points + 2 * i * nodes;
    for (size_t j = 0; j < nodes; j++) {
      at[2 * j] = 10 * (double)j / (double)(nodes - 1);
      at[2 * j + 1] = function_scale() * (function_value(x, at[2 * j]) - 14);
    }
    sections[i] = (batten_section){.origin = {x, 0, 0},
                                   .rotation = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}},
                                   .contour_count = 1,
                                   .starts = starts,
                                   .points = at};
    numbers[i] = x;
    numbers[slices + i] = 1;
    numbers[2 * slices + i] = INFINITY;
    st = function_make_slice(ctx, nodes, at, &splines[i], &functions[i]);
  }
  batten_stack_parts parts = {.struct_size = sizeof parts,
                              .count = slices,
                              .sections = sections,
                              .functions = functions,
                              .parameters = numbers,
                              .scales = numbers + slices,
                              .saturations = numbers + 2 * slices,
                              .method = BATTEN_SECTION_POINTS,
                              .between = between,
                              .shape = 1,
                              .ends = {BATTEN_END_OPEN, BATTEN_END_OPEN}};
  if (st >= 0) st = batten_stack_create(ctx, &parts, &solid);
  double sum = 0;
  uint64_t seed = 5;
  for (int k = 0; st >= 0 && k < FUNCTION_TRIALS; k++) { /* f = z of the surface at z = 0 */
    double p[3] = {10 * scene_uniform(&seed), 10 * scene_uniform(&seed), 0}, f;
    st = batten_solid_evaluate(ctx, solid, 1, p, &f, NULL, NULL);
    double d = f - function_scale() * (function_value(p[0], p[1]) - 14);
    sum += d * d;
  }
  if (st >= 0) error = sqrt(sum / FUNCTION_TRIALS);
  batten_solid_free(solid);
  for (size_t i = 0; i < slices; i++) {
    if (functions) batten_solid_free(functions[i]);
    if (splines) batten_spline_free(splines[i]);
  }
  free(numbers);
  free(points);
  free(splines);
  free(functions);
  free(sections);
  return error;
}

#endif
