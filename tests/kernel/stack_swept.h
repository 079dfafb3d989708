/* Stacks whose section functions are known exactly, made by hand from their parts: for tests of how sections move. */
#ifndef STACK_SWEPT_H
#define STACK_SWEPT_H

#include "section/path.h"

#include "stack_scenes.h"
#include "tap.h"

/* Distance to a rectangle, positive inside: a plane solid whose bounds are exact. */
typedef struct rectangle {
  double half[2];
} rectangle;

static inline double rectangle_value(const rectangle *r, const double *p, double *gradient) {
  double x = fabs(p[0]) - r->half[0], y = fabs(p[1]) - r->half[1], gx = 0, gy = 0, value;
  if (x > 0 && y > 0) {
    value = -hypot(x, y);
    gx = x / value;
    gy = y / value;
  } else {
    value = -fmax(x, y);
    if (x > y)
      gx = -1;
    else
      gy = -1;
  }
  if (gradient) {
    gradient[0] = p[0] < 0 ? -gx : gx;
    gradient[1] = p[1] < 0 ? -gy : gy;
  }
  return value;
}
static inline batten_status rectangle_evaluate(const void *state, batten_context *ctx, size_t count,
                                               const double *points, double *values, double *gradients,
                                               double *hessians) {
  (void)ctx;
  (void)hessians;
  for (size_t i = 0; i < count; i++) {
    double g[2], value = rectangle_value(state, points + 2 * i, g);
    if (values) values[i] = value;
    if (gradients) memcpy(gradients + 2 * i, g, sizeof g);
  }
  return BATTEN_OK;
}
static inline batten_status rectangle_bounds(const void *state, batten_context *ctx, size_t count,
                                             const double *boxes, double *ranges) {
  (void)ctx;
  for (size_t i = 0; i < count; i++) { /* falls with |x| and |y| */
    double near[2], far[2];
    for (int k = 0; k < 2; k++) {
      double lo = boxes[4 * i + (size_t)k], hi = boxes[4 * i + 2 + (size_t)k];
      near[k] = lo <= 0 && hi >= 0 ? 0 : fmin(fabs(lo), fabs(hi));
      far[k] = fmax(fabs(lo), fabs(hi));
    }
    interval r = interval_widen(rectangle_value(state, far, NULL), rectangle_value(state, near, NULL), 4);
    ranges[2 * i] = r.lo;
    ranges[2 * i + 1] = r.hi;
  }
  return BATTEN_OK;
}
static inline void rectangle_release(void *state) { (void)state; }
static const solid_form rectangle_form = {.kind = BATTEN_SOLID_TREE,
                                          .order = 1,
                                          .evaluate = rectangle_evaluate,
                                          .bounds = rectangle_bounds,
                                          .release = rectangle_release};

/* A stack of such rectangles in the sections' frames of a scene; t: chord lengths, or given. */
typedef struct swept_case {
  rectangle section;
  double omega[64][3];
  stack_section sections[64];
  stack s;
} swept_case;

static inline void swept_case_release(batten_context *ctx, swept_case *c) {
  (void)ctx;
  stack_path_free(c->s.path);
  stack_weights_free(c->s.weights);
  if (c->sections[0].function) batten_solid_free(c->sections[0].function);
  c->s.path = NULL;
  c->s.weights = NULL;
  c->sections[0].function = NULL;
}

/* options: rotation, path, parameter(s), between, ends and saturation are read; H is half a gap, or 0 with PLANE. */
static inline batten_status swept_case_make(batten_context *ctx, const stack_scene *scene,
                                            const batten_stack_options *options, const rectangle *section,
                                            swept_case *c) {
  const batten_section *given = scene->sections;
  memset(&c->s, 0, sizeof c->s);
  memset(c->sections, 0, sizeof c->sections);
  c->section = *section;
  double t = 0, ts[64], gap;
  const double lower[2] = {-section->half[0], -section->half[1]}, on[2] = {section->half[0], 0};
  batten_solid *function = NULL;
  batten_status st =
      batten_solid_make(ctx, &rectangle_form, &c->section, 2, 0, lower, section->half, 1, on, &function);
  if (st < 0) return st;
  for (size_t i = 0; i < scene->count; i++) {
    stack_section *made = c->sections + i;
    memcpy(made->origin, given[i].origin, sizeof made->origin);
    memcpy(made->rotation, given[i].rotation, sizeof made->rotation);
    if (i > 0) {
      double square = 0;
      for (int k = 0; k < 3; k++) square += pow(given[i].origin[k] - given[i - 1].origin[k], 2);
      t += sqrt(square);
    }
    if (options->parameters) t = options->parameters[i];
    made->t = ts[i] = t;
    made->scale = 1;
    made->saturation = options->saturation;
    made->function = function;
  }
  gap = t / (double)(scene->count - 1);
  c->s = (stack){.ctx = ctx,
                 .count = scene->count,
                 .sections = c->sections,
                 .between = options->between,
                 .shape = 1,
                 .rotation = options->rotation,
                 .path_kind = options->path,
                 .parameter = options->parameter,
                 .angular_velocity = options->angular_velocity ? c->omega[0] : NULL,
                 .gap = gap,
                 .spacing = gap};
  for (int k = 0; k < 2; k++) {
    c->s.ends[k] = options->ends[k];
    c->s.end_lengths[k] = options->ends[k] == BATTEN_END_PLANE ? 0 : gap / 2;
  }
  if (options->angular_velocity) memcpy(c->omega, options->angular_velocity, scene->count * sizeof c->omega[0]);
  st = stack_weights_make(ctx, options->between, 1, scene->count, ts, &c->s.weights);
  if (st >= 0) st = stack_path_make(ctx, &c->s, &c->s.path);
  if (st < 0) swept_case_release(ctx, c);
  return st;
}

static inline batten_stack_options swept_options(void) {
  batten_stack_options o;
  memset(&o, 0, sizeof o);
  o.struct_size = sizeof o;
  o.saturation = INFINITY;
  o.between = BATTEN_BETWEEN_LINEAR;
  return o;
}

#endif
