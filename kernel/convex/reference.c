/* The reference surface: the least tension that makes the fit convex.   [Juettler 1998, section 3]
 *
 * F = sum of squares + w T. From w = 1 the weight is halved as long as the surface stays convex, or doubled until it
 * is. What is convex is said by the generator of inequalities, which must be able to enclose the surface; samples of
 * the Gaussian curvature spare it the hopeless ones.
 *
 * Noise that is larger than the rise of the data over their plane may leave none convex, up to the limit. A plane
 * that is bent a little then serves: its inequalities hold for every surface near the plane that bends to its side.
 * Whether the data agree with one, or are a saddle, is asked when the fit is done. */
#include "convex_inner.h"

#include "basis/shape.h"
#include "mesh/vec.h"

#include <string.h>

/* 60: 2^60 or 2^-60 of the points' own weight is no different from all or nothing. */
enum { STEPS = 60, SAMPLES = 4 };

/* Whether K > 0, and bends to one side, at SAMPLES + 1 places of each span in either direction. */
static bool samples_convex(const convex_space *space, const double *control) {
  const bspline *bu = &space->axis[0], *bv = &space->axis[1];
  double side = 0;
  for (size_t mu = bspline_first(bu); mu < bu->count; mu = bspline_next(bu, mu))
    for (size_t nu = bspline_first(bv); nu < bv->count; nu = bspline_next(bv, nu))
      for (int k = 0; k < (SAMPLES + 1) * (SAMPLES + 1); k++) {
        double part[2] = {(double)(k % (SAMPLES + 1)) / SAMPLES, (double)(k / (SAMPLES + 1)) / SAMPLES};
        double place[2] = {(1 - part[0]) * bu->knots[mu] + part[0] * bu->knots[mu + 1],
                           (1 - part[1]) * bv->knots[nu] + part[1] * bv->knots[nu + 1]};
        double jet[6][3], n[3];
        convex_jet(space, control, place, jet);
        vec_cross(jet[1], jet[2], n);
        double l = vec_dot(jet[3], n), m = vec_dot(jet[4], n), r = vec_dot(jet[5], n);
        if (!(l * r > m * m) || l * side < 0) return false;
        side = l;
      }
  return true;
}

batten_status convex_is_convex(batten_context *ctx, const convex_space *space, const double *control,
                               const convex_row_options *rows, bool *convex) {
  *convex = samples_convex(space, control);
  return *convex ? convex_rows_make(ctx, space, control, rows, convex, NULL) : BATTEN_OK;
}

typedef struct search {
  const convex_objective *o;
  const convex_space *space;
  const convex_row_options *rows;
  double *control; /* of the weight that was tried last */
} search;

/* A weight whose system is singular to rounding is no candidate. */
static batten_status try_weight(batten_context *ctx, const search *s, double w, bool *convex) {
  batten_status st = convex_objective_solve(ctx, s->o, s->space, w, s->control);
  *convex = false;
  if (st == BATTEN_E_SINGULAR) return BATTEN_OK;
  return st < 0 ? st : convex_is_convex(ctx, s->space, s->control, s->rows, convex);
}

/* From w on by factors until the answer changes or the steps are used up; control of the last convex one stays in
 * out. */
static batten_status walk(batten_context *ctx, const search *s, double w_least, convex_reference *out) {
  size_t bytes = 3 * s->o->n * sizeof *out->control;
  double w = fmax(1, w_least);
  bool convex;
  batten_status st = try_weight(ctx, s, w, &convex);
  bool down = convex;
  while (st >= 0) {
    if (convex) {
      memcpy(out->control, s->control, bytes);
      out->found = true;
      out->weight = w;
    }
    if (convex != down || (convex && !down)) return BATTEN_OK;
    double next = down ? w / 2 : 2 * w;
    if (out->steps >= STEPS || next < w_least) return BATTEN_OK;
    st = batten_progress(ctx, "reference", (double)out->steps / (STEPS + 2));
    if (st < 0) return st;
    out->steps++;
    w = next;
    st = try_weight(ctx, s, w, &convex);
  }
  return st;
}

/* A plane through the middles of the sides of `limit`, bent to the side to which `limit` bends the more. False: there
 * is no plane. */
static bool bend(const convex_space *space, const double *limit, double *control) {
  static const double sides[4][2] = {{0, 0.5}, {1, 0.5}, {0.5, 0}, {0.5, 1}};
  /* 0.1: flat enough for few boxes, and far from flat to rounding */
  const double rise = 0.1;
  double jet[4][6][3], u[3], v[3], n[3], middle[3], bends = 0;
  for (int k = 0; k < 4; k++) convex_jet(space, limit, sides[k], jet[k]);
  vec_sub(jet[1][0], jet[0][0], u);
  vec_sub(jet[3][0], jet[2][0], v);
  vec_cross(u, v, n);
  double size = fmin(vec_norm(u), vec_norm(v)), area = vec_norm(n);
  if (!(area > 1e-3 * vec_norm(u) * vec_norm(v))) return false;
  for (int k = 0; k < 3; k++) middle[k] = (jet[0][0][k] + jet[1][0][k] + jet[2][0][k] + jet[3][0][k]) / 4;
  bends = vec_dot(jet[0][3], n) / vec_dot(u, u) + vec_dot(jet[0][5], n) / vec_dot(v, v);
  double height = (bends < 0 ? -rise : rise) * size / area;
  size_t nv = space->axis[1].count;
  for (size_t i = 0; i < space->axis[0].count; i++)
    for (size_t j = 0; j < nv; j++) {
      double s[2], t[2];
      convex_quadratic(&space->axis[0], i, 0.5, 1, s);
      convex_quadratic(&space->axis[1], j, 0.5, 1, t);
      for (size_t k = 0; k < 3; k++)
        control[3 * (i * nv + j) + k] = middle[k] + s[0] * u[k] + t[0] * v[k] + height * (s[1] + t[1]) * n[k];
    }
  return true;
}

batten_status convex_reference_find(batten_context *ctx, const convex_objective *o, const convex_space *space,
                                    const double *parameters, const convex_row_options *rows, double w_least,
                                    convex_reference *out) {
  size_t bytes = 3 * o->n * sizeof *out->control;
  bool convex;
  convex_reference best = {.control = out->control};
  double *control = batten_alloc_array(ctx, 3 * o->n, sizeof *control);
  double *limit = batten_alloc_array(ctx, 3 * o->n, sizeof *limit);
  batten_status st = control && limit ? BATTEN_OK : BATTEN_E_NOMEM;
  search s = {o, space, rows, control};
  /* The limit first: where it is not determined nothing is. */
  if (st >= 0) st = convex_objective_limit(ctx, o, space, parameters, limit);
  if (st >= 0) st = try_weight(ctx, &s, w_least, &convex);
  if (st < 0) goto done;
  if (convex) {
    memcpy(out->control, control, bytes);
    best.weight = w_least;
    best.found = best.whole = true;
    goto found;
  }
  st = walk(ctx, &s, w_least, &best);
  if (st < 0) goto done;
  if (!best.found) {
    st = convex_is_convex(ctx, space, limit, rows, &convex);
    if (st < 0) goto done;
    if (!convex && bend(space, limit, control)) {
      memcpy(limit, control, bytes);
      st = convex_is_convex(ctx, space, limit, rows, &convex);
      if (st < 0) goto done;
      best.bent = convex;
    }
    if (convex) {
      memcpy(out->control, limit, bytes);
      best.weight = INFINITY;
      best.found = true;
    }
  }
found:
  *out = best;
  st = batten_progress(ctx, "reference", 1);
done:
  batten_free(ctx, limit);
  batten_free(ctx, control);
  return st;
}
