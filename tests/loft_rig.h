/* Stacks of contours in scaled form, without what makes such from curves: for tests of single parts of lofts. */
#ifndef LOFT_RIG_H
#define LOFT_RIG_H

#include <stdlib.h>
#include <string.h>

#include "loft/loft_inner.h"
#include "tap.h"

typedef struct rig_contour {
  double height;
  size_t spans;
  const double *breaks;  /* [spans + 1] */
  const unsigned *folds; /* [spans + 1] NULL: degree - smoothness */
  const double *points;  /* [count][2] */
} rig_contour;

/* Fails: never (aborts). ctx NULL: one of its own, which stays. */
static inline batten_context *rig_context(batten_context *ctx) {
  static batten_context *own;
  if (ctx) return ctx;
  if (!own) own = t_context(NULL, NULL, 1);
  return own;
}

static inline loft_stack rig_stack(batten_context *given, unsigned degree, bool closed, size_t count,
                                   const rig_contour *contours, unsigned smoothness) {
  batten_context *ctx = rig_context(given);
  loft_stack s = {.degree = degree,
                  .smoothness = smoothness,
                  .closed = closed,
                  .count = count,
                  .unit = 1,
                  .height_unit = 1,
                  .domain = {0, 1},
                  .size = 1};
  s.contours = batten_alloc_array(ctx, count, sizeof *s.contours);
  for (size_t i = 0; i < count; i++) {
    const rig_contour *r = &contours[i];
    loft_contour *c = &s.contours[i];
    *c = (loft_contour){.height = r->height};
    unsigned *folds = malloc((r->spans + 1) * sizeof *folds);
    for (size_t k = 0; folds && k <= r->spans; k++) folds[k] = r->folds ? r->folds[k] : degree - smoothness;
    if (!folds || loft_space_make(ctx, degree, closed, r->spans, r->breaks, folds, &c->space) < 0) abort();
    free(folds);
    c->points = batten_alloc_array(ctx, c->space.count, 2 * sizeof *c->points);
    c->flat_above = batten_alloc_array(ctx, r->spans + 1, 1);
    memcpy(c->points, r->points, c->space.count * 2 * sizeof *c->points);
    memset(c->flat_above, 0, r->spans + 1);
  }
  return s;
}

static inline void loft_stack_free_rig(batten_context *given, loft_stack *s) {
  batten_context *ctx = rig_context(given);
  for (size_t i = 0; i < s->count; i++) {
    loft_space_free(ctx, &s->contours[i].space);
    batten_free(ctx, s->contours[i].points);
    batten_free(ctx, s->contours[i].flat_above);
  }
  batten_free(ctx, s->contours);
  *s = (loft_stack){0};
}

/* Patches with angles and signs; none on failure. */
static inline batten_status rig_slabs(batten_context *ctx, const loft_stack *stack, loft_slab **out) {
  loft_slab *slabs = NULL;
  *out = NULL;
  batten_status st = loft_slabs_make(ctx, stack, &slabs);
  for (size_t i = 0; st >= 0 && i + 1 < stack->count; i++) st = loft_vertices_make(ctx, stack, i, &slabs[i]);
  if (st >= 0)
    *out = slabs;
  else if (slabs)
    loft_slabs_free(ctx, stack->count - 1, slabs);
  return st;
}

/* Contours whose polygons turn to the left (closed: once around, nearly circles), on random breaks, each a little
 * turned from the last; gaps between heights 1, times 1 / spread .. spread. */
static inline loft_stack rig_random(batten_context *given, uint64_t seed, unsigned degree, bool closed, size_t count,
                                    double spread) {
  uint64_t state = seed * 977 + 3;
  unsigned smoothness = degree > 2 && seed % 2 ? 2 : 1;
  rig_contour *c = calloc(count, sizeof *c);
  double turned = 0, height = 0;
  if (!c) abort();
  for (size_t i = 0; i < count; i++) {
    size_t spans = (closed ? degree + 1 : 2) + (size_t)(6 * t_uniform(&state)), fold = degree - smoothness;
    size_t points = closed ? spans * fold : degree + 1 + (spans - 1) * fold;
    double *breaks = malloc((spans + 1) * sizeof *breaks), *p = calloc(points, 2 * sizeof *p);
    if (!breaks || !p) abort();
    breaks[0] = 0;
    for (size_t k = 0; k < spans; k++) breaks[k + 1] = breaks[k] + pow(10, -1.5 * t_uniform(&state));
    for (size_t k = 1; k <= spans; k++) breaks[k] /= breaks[spans];
    breaks[spans] = 1;
    double whole = 2 * acos(-1) * (closed ? 1 : 0.4) / (double)points;
    for (size_t j = 0; j < points; j++) {
      double a = turned + whole * ((double)j + 0.2 * t_uniform(&state)), r = 0.4 + 0.005 * t_uniform(&state);
      p[2 * j] = r * cos(a);
      p[2 * j + 1] = r * sin(a) * (1 + 0.2 * t_uniform(&state) / (double)points);
    }
    c[i] = (rig_contour){height, spans, breaks, NULL, p};
    turned += 0.8 * (t_uniform(&state) - 0.5);
    height += pow(spread, 2 * t_uniform(&state) - 1);
  }
  loft_stack s = rig_stack(given, degree, closed, count, c, smoothness);
  for (size_t i = 0; i < count; i++) {
    free((void *)(uintptr_t)c[i].breaks);
    free((void *)(uintptr_t)c[i].points);
  }
  free(c);
  return s;
}

#endif
