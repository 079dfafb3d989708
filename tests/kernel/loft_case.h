/* A scene of lofts, up to the minimum without inequalities: what tests of inequalities begin with. */
#ifndef LOFT_CASE_H
#define LOFT_CASE_H

#include "loft/loft_inner.h"
#include "loft_scenes.h"
#include "tap.h"

static const double CASE_PI = 3.14159265358979323846;

typedef struct loft_case {
  batten_context *ctx;
  batten_loft_options opt;
  loft_stack stack;
  loft_slab *slabs;
  size_t slab_count;
  loft_net net;
  loft_objective *objective;
  double *free; /* [unknowns][2] */
} loft_case;

static inline void loft_case_free(loft_case *c) {
  batten_free(c->ctx, c->free);
  loft_objective_free(c->ctx, c->objective);
  loft_net_free(c->ctx, &c->net);
  loft_slabs_free(c->ctx, c->slab_count, c->slabs);
  loft_stack_free(c->ctx, &c->stack);
  memset(c, 0, sizeof *c);
}

static inline void loft_case_scale(batten_context *ctx, batten_curve **curve, double scale) {
  if (!*curve || scale == 1) return;
  batten_curve_form form = batten_curve_get(*curve);
  size_t count = form.knot_count - form.degree - 1;
  double *points = loft_scene_memory(2 * count, sizeof *points);
  for (size_t j = 0; j < 2 * count; j++) points[j] = scale * form.control_points[j];
  form.control_points = points;
  batten_curve *larger = NULL;
  if (batten_curve_create(ctx, &form, &larger) < 0) abort();
  batten_curve_free(*curve);
  *curve = larger;
  free(points);
}

/* Contours times a power of two. The scene has a context of its own: memory that fails is the case's. */
static inline batten_status loft_case_stack(loft_case *c, const loft_rule *rule, double scale) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  loft_scene scene = loft_scene_make(ctx, rule);
  for (size_t i = 0; i < scene.count; i++) loft_case_scale(ctx, &scene.contours[i], scale);
  for (unsigned e = 0; e < 2; e++) {
    loft_case_scale(ctx, &scene.slopes[e], scale);
    c->opt.slopes[e] = scene.slopes[e];
  }
  batten_status st = loft_stack_make(c->ctx, scene.count, (const batten_curve *const *)scene.contours, scene.heights,
                                     &c->opt, &c->stack);
  if (st >= 0) st = loft_shape_prepare(c->ctx, &c->stack, &c->opt);
  for (unsigned e = 0; e < 2; e++) c->opt.slopes[e] = NULL;
  loft_scene_free(&scene);
  batten_context_free(ctx);
  return st;
}

/* degree 0: as usual. The objective keeps pointers into the case: it stays where it is. */
static inline batten_status loft_case_make(batten_context *ctx, const loft_rule *rule, unsigned degree, double scale,
                                           const batten_loft_options *opt, loft_case *c) {
  *c = (loft_case){.ctx = ctx, .opt = opt ? *opt : batten_loft_options_default()};
  batten_status st = loft_case_stack(c, rule, scale);
  if (st >= 0) st = loft_slabs_make(ctx, &c->stack, &c->slabs);
  if (st >= 0) c->slab_count = c->stack.count - 1;
  for (size_t i = 0; i < c->slab_count && st >= 0; i++) st = loft_vertices_make(ctx, &c->stack, i, &c->slabs[i]);
  if (!degree) degree = 2 * c->stack.smoothness + 2;
  if (st >= 0) st = loft_net_make(ctx, &c->stack, c->slabs, degree, &c->net);
  if (st >= 0) st = loft_objective_new(ctx, &c->stack, &c->net, &c->opt, &c->objective);
  if (st >= 0 && !(c->free = batten_alloc_array(ctx, c->net.z.columns, 2 * sizeof *c->free))) st = BATTEN_E_NOMEM;
  if (st >= 0) st = loft_objective_minimum(ctx, c->objective, c->free);
  if (st < 0) loft_case_free(c);
  return st;
}

/* Leg v of patch i at zeta, by de Casteljau's algorithm. */
static inline void loft_case_leg(const loft_case *c, const double *control, size_t i, size_t v, double zeta,
                                 double out[2]) {
  const loft_net *net = &c->net;
  const loft_space *space = &c->slabs[i].space;
  unsigned n = net->degree;
  for (unsigned x = 0; x < 2; x++) {
    double work[16];
    for (unsigned k = 0; k <= n; k++)
      work[k] = control[2 * loft_at(net, i, (v + 1) % space->count, k) + x] -
                control[2 * loft_at(net, i, v % space->count, k) + x];
    for (unsigned level = n; level > 0; level--)
      for (unsigned k = 0; k < level; k++) work[k] = (1 - zeta) * work[k] + zeta * work[k + 1];
    out[x] = work[0];
  }
}

static inline double loft_case_turn(const loft_case *c, const double *control, size_t i, size_t v, double zeta) {
  double p[2], q[2];
  loft_case_leg(c, control, i, v, zeta, p);
  loft_case_leg(c, control, i, v + 1, zeta, q);
  return atan2(loft_cross(p, q), p[0] * q[0] + p[1] * q[1]);
}

/* What dense samples of the sections' turns say: vertices that turn to the wrong side or too far somewhere. */
typedef struct loft_tally {
  size_t vertices, wrong, wide;
  double worst; /* smallest turn with its sign over the smaller one of both contours */
} loft_tally;

static inline loft_tally loft_case_tally(const loft_case *c, const double *y) {
  loft_tally t = {.worst = INFINITY};
  double *control = loft_scene_memory(2 * c->net.z.rows, sizeof *control);
  loft_net_expand(&c->net, y, control);
  for (size_t i = 0; i < c->slab_count; i++) {
    const loft_slab *slab = &c->slabs[i];
    for (size_t v = 0; v < loft_vertices(&slab->space); v++) {
      int wanted = slab->wanted[v];
      double first = loft_turn(slab, 0, v), last = loft_turn(slab, 1, v);
      if (wanted == LOFT_FLAT || isnan(first) || isnan(last)) continue;
      double most = fmax(CASE_PI / (c->stack.degree - 1), 1.0100001 * fmax(fabs(first), fabs(last)));
      bool wrong = false, wide = false;
      for (unsigned r = 0; r <= 200; r++) {
        double turn = loft_case_turn(c, control, i, v, r / 200.0);
        if (wanted != LOFT_FREE) {
          wrong = wrong || !(wanted * turn > 0);
          t.worst = fmin(t.worst, wanted * turn / fmin(fabs(first), fabs(last)));
        }
        wide = wide || !(fabs(turn) <= most);
      }
      t.vertices++;
      t.wrong += wrong;
      t.wide += wide;
    }
  }
  free(control);
  return t;
}

#endif
