/* Stacks below batten_stack_build: from the sections of a scene, or of plane functions given in closed form. */
#ifndef STACK_RIG_H
#define STACK_RIG_H

#include "section/section_inner.h"
#include "stack_scenes.h"
#include "tap.h"

/* Takes what has been released too. */
static inline void rig_release(stack *s) {
  if (s->ctx) stack_release(s);
  *s = (stack){0};
}

/* What stack_prepare does for parallel planes. */
static inline batten_status rig_prepare(batten_context *ctx, stack *s) {
  double *t = batten_alloc_array(ctx, s->count, sizeof *t);
  if (!t) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < s->count; i++) t[i] = s->sections[i].t;
  batten_status st = stack_weights_make(ctx, s->between, s->shape, s->count, t, &s->weights);
  batten_free(ctx, t);
  return st < 0 ? st : stack_end_prepare(ctx, s);
}

/* A scene's sections, fitted. */
static inline batten_status rig_fit(batten_context *ctx, stack_scene *scene, const batten_stack_options *opt,
                                    stack *s) {
  const batten_section *sections = stack_scene_sections(scene);
  stack_notes notes = {.ctx = ctx};
  *s = (stack){0};
  batten_status st = stack_take_sections(ctx, scene->count, sections, opt, s, &notes);
  section_figures *figures = st < 0 ? NULL : batten_alloc_array(ctx, scene->count, sizeof *figures);
  if (st >= 0 && !figures) st = BATTEN_E_NOMEM;
  if (st >= 0) st = stack_fit_all(ctx, s, sections, opt, 0.1 * s->spacing, figures);
  if (st >= 0) st = rig_prepare(ctx, s);
  batten_free(ctx, figures);
  batten_free(ctx, notes.items);
  if (st < 0) rig_release(s);
  return st;
}

/* ---- discs as plane solids: max of R - |x - c| over up to four, the exact distance where they do not overlap -- */

typedef struct rig_discs {
  batten_context *ctx;
  size_t count;
  double at[4][3]; /* x, y, R */
} rig_discs;

static inline batten_status rig_discs_evaluate(const void *state, batten_context *ctx, size_t count,
                                               const double *points, double *values, double *gradients,
                                               double *hessians) {
  const rig_discs *d = state;
  (void)ctx, (void)hessians;
  for (size_t i = 0; i < count; i++) {
    double best = -INFINITY, g[2] = {0, 0};
    for (size_t k = 0; k < d->count; k++) {
      double x = points[2 * i] - d->at[k][0], y = points[2 * i + 1] - d->at[k][1], r = hypot(x, y);
      if (d->at[k][2] - r <= best) continue;
      best = d->at[k][2] - r;
      g[0] = r > 0 ? -x / r : 0;
      g[1] = r > 0 ? -y / r : 0;
    }
    if (values) values[i] = best;
    if (gradients) memcpy(gradients + 2 * i, g, sizeof g);
  }
  return BATTEN_OK;
}
static inline batten_status rig_discs_bounds(const void *state, batten_context *ctx, size_t count,
                                             const double *boxes, double *ranges) {
  const rig_discs *d = state;
  (void)ctx;
  for (size_t i = 0; i < count; i++) {
    interval best = {-INFINITY, -INFINITY};
    for (size_t k = 0; k < d->count; k++) {
      interval x = interval_sub((interval){boxes[4 * i], boxes[4 * i + 2]}, interval_of(d->at[k][0]));
      interval y = interval_sub((interval){boxes[4 * i + 1], boxes[4 * i + 3]}, interval_of(d->at[k][1]));
      best = interval_max(best, interval_sub(interval_of(d->at[k][2]), interval_hypot(x, y)));
    }
    ranges[2 * i] = best.lo;
    ranges[2 * i + 1] = best.hi;
  }
  return BATTEN_OK;
}
static inline void rig_discs_release(void *state) { batten_free(((rig_discs *)state)->ctx, state); }
static const solid_form rig_discs_form = {.kind = BATTEN_SOLID_TREE,
                                          .order = 1,
                                          .evaluate = rig_discs_evaluate,
                                          .bounds = rig_discs_bounds,
                                          .release = rig_discs_release};

static inline batten_status rig_discs_make(batten_context *ctx, size_t count, const double (*at)[3],
                                           batten_solid **out) {
  rig_discs *d = batten_alloc(ctx, sizeof *d);
  if (!d) return BATTEN_E_NOMEM;
  *d = (rig_discs){.ctx = ctx, .count = count};
  double lower[2] = {INFINITY, INFINITY}, upper[2] = {-INFINITY, -INFINITY};
  for (size_t k = 0; k < count; k++) {
    memcpy(d->at[k], at[k], sizeof d->at[k]);
    for (unsigned c = 0; c < 2; c++) {
      lower[c] = fmin(lower[c], at[k][c] - at[k][2]);
      upper[c] = fmax(upper[c], at[k][c] + at[k][2]);
    }
  }
  const double point[2] = {at[0][0] + at[0][2], at[0][1]};
  batten_status st = batten_solid_make(ctx, &rig_discs_form, d, 2, 0, lower, upper, 1, point, out);
  if (st < 0) batten_free(ctx, d);
  return st;
}

/* A scene of discs (each loop a circle about the mean of its points, all of a section disjoint), with functions in
 * closed form in place of fits. */
static inline batten_status rig_exact(batten_context *ctx, stack_scene *scene, const batten_stack_options *opt,
                                      stack *s) {
  stack_notes notes = {.ctx = ctx};
  *s = (stack){0};
  batten_status st = stack_take_sections(ctx, scene->count, stack_scene_sections(scene), opt, s, &notes);
  for (size_t i = 0; i < s->count && st >= 0; i++) {
    const polygon_set *p = &s->sections[i].loops;
    double at[4][3];
    if (s->sections[i].apex_count) continue;
    for (size_t k = 0; k < p->count && k < 4; k++) {
      size_t n = p->starts[k + 1] - p->starts[k];
      const double *x = p->points + 2 * p->starts[k];
      at[k][0] = at[k][1] = 0;
      for (size_t j = 0; j < 2 * n; j++) at[k][j % 2] += x[j] / (double)n;
      at[k][2] = hypot(x[0] - at[k][0], x[1] - at[k][1]);
    }
    st = rig_discs_make(ctx, p->count, (const double(*)[3])at, &s->sections[i].function);
  }
  if (st >= 0) st = rig_prepare(ctx, s);
  batten_free(ctx, notes.items);
  if (st < 0) rig_release(s);
  return st;
}

#endif
