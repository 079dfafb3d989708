/* The objective of lofts: cylinders and cones, sums over samples and Gauss' rule, dense normal equations, turned and
 * scaled stacks, tiny legs. */
#include <batten/loft.h>
#include <float.h>
#include <math.h>

#include "basis/gauss8.h"
#include "loft/loft_inner.h"
#include "loft_rig.h"
#include "tap.h"

typedef struct fixture {
  loft_stack stack;
  loft_slab *slabs;
  loft_net net;
  loft_objective *objective;
  double *y; /* [unknowns][2] the minimum */
} fixture;

static void fixture_free(batten_context *ctx, fixture *f) {
  batten_free(ctx, f->y);
  loft_objective_free(ctx, f->objective);
  loft_net_free(ctx, &f->net);
  if (f->slabs) loft_slabs_free(ctx, f->stack.count - 1, f->slabs);
}

/* Takes the stack over only for looking. */
static batten_status fixture_make(batten_context *ctx, const loft_stack *stack, unsigned degree,
                                  const batten_loft_options *opt, fixture *f) {
  *f = (fixture){.stack = *stack};
  batten_status st = rig_slabs(ctx, stack, &f->slabs);
  if (st >= 0) st = loft_net_make(ctx, stack, f->slabs, degree, &f->net);
  if (st >= 0) st = loft_objective_new(ctx, stack, &f->net, opt, &f->objective);
  if (st >= 0) {
    f->y = batten_alloc_array(ctx, f->net.z.columns, 2 * sizeof *f->y);
    st = f->y ? loft_objective_minimum(ctx, f->objective, f->y) : BATTEN_E_NOMEM;
  }
  if (st < 0) fixture_free(ctx, f);
  return st;
}

/* ---- a second opinion ---------------------------------------------------------------------------- */

static void bezier(unsigned n, const double *points, double x, double out[2]) {
  double work[10][2];
  for (unsigned k = 0; k <= n; k++)
    for (unsigned c = 0; c < 2; c++) work[k][c] = points[2 * k + c];
  for (unsigned r = n; r > 0; r--)
    for (unsigned k = 0; k < r; k++)
      for (unsigned c = 0; c < 2; c++) work[k][c] += x * (work[k + 1][c] - work[k][c]);
  memcpy(out, work[0], sizeof work[0]);
}

/* The integral of the square of the second derivative, whose control points are differences. */
static double bending(unsigned n, const double *points) {
  double second[10][2], sum = 0;
  for (unsigned k = 0; k + 2 <= n; k++)
    for (unsigned c = 0; c < 2; c++)
      second[k][c] = n * (n - 1) * (points[2 * k + c] - 2 * points[2 * k + 2 + c] + points[2 * k + 4 + c]);
  for (unsigned g = 0; g < GAUSS8; g++) {
    double x, weight, value[2];
    gauss8_node(g, &x, &weight);
    bezier(n - 2, second[0], x, value);
    sum += weight * (value[0] * value[0] + value[1] * value[1]);
  }
  return sum;
}

/* F from its definition, all from the control points. */
static double opinion(const fixture *f, double tension, unsigned samples, const double *control) {
  const loft_net *net = &f->net;
  unsigned n = net->degree;
  double gap = 0, polygon = 0, sum = 0;
  for (size_t i = 0; i < net->slab_count; i++) {
    const loft_slab *s = &f->slabs[i];
    gap += s->gap / (double)net->slab_count;
    for (size_t v = 0; v < loft_legs(&s->space); v++)
      polygon += (s->length[0][v] + s->length[1][v]) / 2 / (double)net->slab_count;
  }
  for (size_t i = 0; i < net->slab_count; i++) {
    const loft_slab *s = &f->slabs[i];
    double g = s->gap / gap;
    for (size_t v = 0; v < loft_legs(&s->space); v++) {
      double leg[20], rho = (s->length[0][v] + s->length[1][v]) / 2, near = 0;
      const double *a = control + 2 * loft_at(net, i, v, 0);
      const double *b = control + 2 * loft_at(net, i, (v + 1) % s->space.count, 0);
      for (unsigned k = 0; k < 2 * (n + 1); k++) leg[k] = b[k] - a[k];
      for (unsigned r = 0; r <= samples; r++) {
        double p[2], q[2], zeta = (double)r / samples;
        bezier(n, leg, zeta, p);
        loft_spiral(s, v, zeta, q);
        near += (pow(p[0] - q[0], 2) + pow(p[1] - q[1], 2)) / (samples + 1);
      }
      sum += g / (rho * polygon) * (near + tension * bending(n, leg));
    }
    for (size_t j = 0; j < s->space.count; j++) {
      double share = j == 0 || j + 1 == s->space.count;
      if (s->space.closed)
        share = (loft_knot(&s->space, (ptrdiff_t)(j + s->space.degree + 1)) - loft_knot(&s->space, (ptrdiff_t)j)) /
                (s->space.degree + 1);
      sum += share * tension * bending(n, control + 2 * loft_at(net, i, j, 0)) / (g * g * g * polygon * polygon);
    }
  }
  return sum;
}

static double opinion_at(const fixture *f, double tension, unsigned samples, const double *y, double *control) {
  loft_net_expand(&f->net, y, control);
  return opinion(f, tension, samples, control);
}

/* x := a^-1 x by elimination with pivots. */
static void eliminate(size_t n, double *a, double *x) {
  for (size_t j = 0; j < n; j++) {
    size_t best = j;
    for (size_t i = j; i < n; i++)
      if (fabs(a[i * n + j]) > fabs(a[best * n + j])) best = i;
    for (size_t k = 0; k < n; k++) {
      double swap = a[j * n + k];
      a[j * n + k] = a[best * n + k];
      a[best * n + k] = swap;
    }
    double swap = x[j];
    x[j] = x[best];
    x[best] = swap;
    for (size_t i = j + 1; i < n; i++) {
      double factor = a[i * n + j] / a[j * n + j];
      for (size_t k = j; k < n; k++) a[i * n + k] -= factor * a[j * n + k];
      x[i] -= factor * x[j];
    }
  }
  for (size_t i = n; i-- > 0;) {
    for (size_t k = i + 1; k < n; k++) x[i] -= a[i * n + k] * x[k];
    x[i] /= a[i * n + i];
  }
}

/* Values, the matrix and the minimum of one coordinate from values of the definition alone: F is quadratic, so that
 * its differences are exact. */
static void compare(batten_context *ctx, uint64_t seed, unsigned degree, bool closed, unsigned n, double tension) {
  batten_loft_options opt = batten_loft_options_default();
  opt.tension = tension;
  opt.samples = 12;
  loft_stack stack = rig_random(ctx, seed, degree, closed, 3, 2.0);
  fixture f;
  if (fixture_make(ctx, &stack, n, &opt, &f) < 0) {
    t_line(false, "seed %d: %s", (int)seed, batten_error(ctx));
    return;
  }
  size_t m = f.net.z.columns;
  double *control = malloc(2 * f.net.z.rows * sizeof *control), *y = calloc(2 * m, sizeof *y);
  double *h = malloc(m * m * sizeof *h), *g = malloc(m * sizeof *g), *once = malloc(m * sizeof *once);
  uint64_t state = seed;
  for (size_t p = 0; p < 2 * m; p++) y[p] = t_uniform(&state) - 0.5;
  double value = loft_objective_value(f.objective, y), other = opinion_at(&f, tension, 12, y, control);
  T_RATIO(fabs(value / other - 1), 1e-13, "seed %d: value %g against the definition", (int)seed, value);
  memset(y, 0, 2 * m * sizeof *y);
  double zero = opinion_at(&f, tension, 12, y, control), least = opinion_at(&f, tension, 12, f.y, control);
  for (size_t p = 0; p < m; p++) {
    y[2 * p] = 1;
    once[p] = opinion_at(&f, tension, 12, y, control);
    y[2 * p] = -1;
    g[p] = -(once[p] - opinion_at(&f, tension, 12, y, control)) / 2;
    y[2 * p] = 0;
  }
  batten_matrix hessian = loft_objective_hessian(f.objective);
  double off = 0, most = 0, apart = 0, scale = 0;
  for (size_t p = 0; p < m; p++)
    for (size_t q = 0; q < m; q++) {
      y[2 * p] += 1;
      y[2 * q] += 1;
      h[p * m + q] = opinion_at(&f, tension, 12, y, control) - once[p] - once[q] + zero;
      y[2 * p] = y[2 * q] = 0;
    }
  for (size_t p = 0; p < m; p++)
    for (size_t q = 0; q < m; q++) {
      double mine = 0;
      for (size_t e = hessian.starts[p]; e < hessian.starts[p + 1]; e++)
        if (hessian.indices[e] == q) mine = hessian.values[e];
      off = fmax(off, fabs(mine - h[p * m + q]));
      most = fmax(most, fabs(h[p * m + q]));
    }
  T_RATIO(off / most, 1e-11, "matrix of %zu against differences of values", m);
  eliminate(m, h, g);
  for (size_t p = 0; p < m; p++) {
    apart = fmax(apart, fabs(g[p] - f.y[2 * p]));
    scale = fmax(scale, fabs(g[p]));
  }
  T_RATIO(apart / scale, 1e-8, "minimum against normal equations");
  T_RATIO(fabs(loft_objective_value(f.objective, f.y) / least - 1), 1e-11, "its value %g", least);
  /* The other coordinate, and that nothing near is lower. */
  bool lowest = true;
  for (int trial = 0; trial < 20; trial++) {
    for (size_t p = 0; p < 2 * m; p++) y[p] = f.y[p] + 1e-4 * (t_uniform(&state) - 0.5);
    lowest = lowest && loft_objective_value(f.objective, y) > loft_objective_value(f.objective, f.y);
  }
  T_CHECK(lowest, "nothing near the minimum is lower");
  free(once);
  free(g);
  free(h);
  free(y);
  free(control);
  fixture_free(ctx, &f);
  loft_stack_free_rig(ctx, &stack);
}

/* ---- known surfaces ------------------------------------------------------------------------------ */

/* Contours that are the first one scaled and shifted: trajectories are straight where both are linear in height. */
static void straight(batten_context *ctx, bool closed, double shrink) {
  loft_stack stack = rig_random(ctx, 8, 3, closed, 1, 1);
  rig_contour c[4];
  double *points[4];
  static const double heights[4] = {0, 0.7, 2, 2.4};
  size_t count = stack.contours[0].space.count;
  for (size_t i = 0; i < 4; i++) {
    points[i] = malloc(2 * count * sizeof **points);
    for (size_t j = 0; j < 2 * count; j++)
      points[i][j] = (1 - shrink * heights[i]) * stack.contours[0].points[j] + 0.3 * heights[i];
    c[i] = (rig_contour){heights[i], stack.contours[0].space.spans, stack.contours[0].space.breaks, NULL, points[i]};
  }
  loft_stack all = rig_stack(ctx, 3, closed, 4, c, 1);
  batten_loft_options opt = batten_loft_options_default();
  fixture f;
  T_OK(fixture_make(ctx, &all, 4, &opt, &f), ctx);
  double *control = malloc(2 * f.net.z.rows * sizeof *control), off = 0;
  loft_net_expand(&f.net, f.y, control);
  for (size_t i = 0; i < 3; i++)
    for (size_t j = 0; j < count; j++)
      for (unsigned k = 0; k <= 4; k++)
        for (unsigned x = 0; x < 2; x++) {
          double line = points[i][2 * j + x] + (points[i + 1][2 * j + x] - points[i][2 * j + x]) * k / 4;
          off = fmax(off, fabs(control[2 * loft_at(&f.net, i, j, k) + x] - line));
        }
  T_RATIO(off, 1e-13, "%s: straight trajectories", shrink > 0 ? "cone" : "cylinder");
  T_RATIO(loft_objective_value(f.objective, f.y), 1e-27, "which leave nothing of the objective");
  free(control);
  fixture_free(ctx, &f);
  loft_stack_free_rig(ctx, &all);
  loft_stack_free_rig(ctx, &stack);
  for (size_t i = 0; i < 4; i++) free(points[i]);
}

/* The stack turned by an angle, its points and heights times 2^k each: the same surface, turned and scaled. */
static void invariances(batten_context *ctx) {
  loft_stack stack = rig_random(ctx, 11, 3, false, 4, 3);
  batten_loft_options opt = batten_loft_options_default();
  fixture f, g;
  T_OK(fixture_make(ctx, &stack, 6, &opt, &f), ctx);
  double value = loft_objective_value(f.objective, f.y), *y = f.y, off = 0;
  size_t unknowns = f.net.z.columns;
  f.y = NULL;
  fixture_free(ctx, &f);
  for (size_t i = 0; i < stack.count; i++) {
    stack.contours[i].height *= 8;
    for (size_t j = 0; j < 2 * stack.contours[i].space.count; j++) stack.contours[i].points[j] *= 0.25;
  }
  stack.size *= 0.25;
  T_OK(fixture_make(ctx, &stack, 6, &opt, &g), ctx);
  bool same = loft_objective_value(g.objective, g.y) == value;
  for (size_t p = 0; p < 2 * unknowns; p++) same = same && g.y[p] == 0.25 * y[p];
  T_CHECK(same, "points and heights times a power of two: the same bits");
  fixture_free(ctx, &g);
  for (size_t i = 0; i < stack.count; i++)
    for (size_t j = 0; j < stack.contours[i].space.count; j++) {
      double *p = stack.contours[i].points + 2 * j, x = p[0];
      p[0] = 4 * (0.6 * x - 0.8 * p[1]);
      p[1] = 4 * (0.8 * x + 0.6 * p[1]);
    }
  stack.size *= 4;
  T_OK(fixture_make(ctx, &stack, 6, &opt, &g), ctx);
  for (size_t p = 0; p < unknowns; p++)
    off = fmax(off, hypot(g.y[2 * p] - 0.6 * y[2 * p] + 0.8 * y[2 * p + 1],
                          g.y[2 * p + 1] - 0.8 * y[2 * p] - 0.6 * y[2 * p + 1]));
  T_RATIO(off, 1e-11, "turned");
  T_RATIO(fabs(loft_objective_value(g.objective, g.y) / value - 1), 1e-11, "its value");
  fixture_free(ctx, &g);
  batten_free(ctx, y);
  loft_stack_free_rig(ctx, &stack);
}

/* ---- tiny legs ----------------------------------------------------------------------------------- */

/* Double knots of neighbours as near as 1e-9, and contours that turn: the gradient vanishes, legs keep direction. */
static void tiny_legs(batten_context *ctx) {
  for (double apart = 1e-3; apart > 5e-10; apart *= 1e-2) {
    double breaks[3][5], points[3][10][2];
    rig_contour c[3];
    for (size_t e = 0; e < 3; e++) {
      const double own[5] = {0, 0.2 + 0.1 * (double)e, 0.5 + (e == 1 ? apart : 0), 0.7 + 0.03 * (double)e, 1};
      memcpy(breaks[e], own, sizeof own);
      for (size_t j = 0; j < 10; j++) {
        double a = 0.2 * (double)j + 0.4 * (double)e;
        points[e][j][0] = cos(a);
        points[e][j][1] = sin(a);
      }
      c[e] = (rig_contour){(double)e, 4, breaks[e], NULL, points[e][0]};
    }
    loft_stack stack = rig_stack(ctx, 3, false, 3, c, 1);
    batten_loft_options opt = batten_loft_options_default();
    fixture f;
    T_OK(fixture_make(ctx, &stack, 4, &opt, &f), ctx);
    double *control = malloc(2 * f.net.z.rows * sizeof *control), worst = 0, shortest = INFINITY;
    loft_net_expand(&f.net, f.y, control);
    for (size_t i = 0; i < 2; i++)
      for (size_t v = 0; v < loft_legs(&f.slabs[i].space); v++)
        for (unsigned k = 1; k < 8; k++) {
          const double *a = control + 2 * loft_at(&f.net, i, v, 0), *b = control + 2 * loft_at(&f.net, i, v + 1, 0);
          double zeta = k / 8.0, q[2], p[2], leg[10], size = f.slabs[i].length[0][v] + f.slabs[i].length[1][v];
          for (unsigned x = 0; x < 10; x++) leg[x] = b[x] - a[x];
          bezier(4, leg, zeta, p);
          loft_spiral(&f.slabs[i], v, zeta, q);
          worst = fmax(worst, (hypot(p[0] - q[0], p[1] - q[1]) - DBL_EPSILON) / (size / 2));
          shortest = fmin(shortest, size / 2);
        }
    T_RATIO(worst, 0.15, "legs of %g and more: off their spirals, over the length", shortest);
    /* No change of coordinates by 1e-3 of rounding's leave lowers it. */
    double value = loft_objective_value(f.objective, f.y), lower = 0, *y = malloc(2 * f.net.z.columns * sizeof *y);
    for (size_t p = 0; p < 2 * f.net.z.columns; p++)
      for (int side = -1; side <= 1; side += 2) {
        memcpy(y, f.y, 2 * f.net.z.columns * sizeof *y);
        y[p] += side * 1e-6;
        lower = fmax(lower, 1 - loft_objective_value(f.objective, y) / value);
      }
    T_RATIO(lower, 1e-9, "part by which the objective becomes lower when a coordinate moves");
    free(y);
    free(control);
    fixture_free(ctx, &f);
    loft_stack_free_rig(ctx, &stack);
  }
}

/* H times what solve makes of x is x. */
static void solves(batten_context *ctx) {
  loft_stack stack = rig_random(ctx, 21, 4, true, 6, 3);
  batten_loft_options opt = batten_loft_options_default();
  fixture f;
  T_OK(fixture_make(ctx, &stack, 6, &opt, &f), ctx);
  size_t m = f.net.z.columns;
  double *x = malloc(m * sizeof *x), off = 0;
  uint64_t state = 3;
  batten_matrix h = loft_objective_hessian(f.objective);
  for (size_t p = 0; p < m; p++) x[p] = t_uniform(&state);
  loft_objective_solve(f.objective, x);
  state = 3;
  for (size_t p = 0; p < m; p++) {
    double sum = -t_uniform(&state);
    for (size_t e = h.starts[p]; e < h.starts[p + 1]; e++) sum += h.values[e] * x[h.indices[e]];
    off = fmax(off, fabs(sum));
  }
  T_RATIO(off, 1e-9, "%zu unknowns: H H^-1 x", m);
  free(x);
  fixture_free(ctx, &f);
  /* Tension 0 is the least one. */
  opt.tension = 0;
  T_OK(fixture_make(ctx, &stack, 6, &opt, &f), ctx);
  fixture_free(ctx, &f);
  loft_stack_free_rig(ctx, &stack);
}

static batten_status run(batten_context *ctx, void *arg) {
  fixture f;
  batten_loft_options opt = batten_loft_options_default();
  batten_status st = fixture_make(ctx, arg, 4, &opt, &f);
  if (st >= 0) fixture_free(ctx, &f);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  compare(ctx, 1, 3, false, 6, 0.01);
  compare(ctx, 2, 2, true, 4, 0.1);
  compare(ctx, 4, 3, false, 3, 1);
  straight(ctx, false, 0);
  straight(ctx, true, 0.3);
  invariances(ctx);
  tiny_legs(ctx);
  solves(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  loft_stack stack = rig_random(ctx, 2, 2, true, 2, 1.0);
  t_fail_every_allocation("objective and minimum", run, &stack);
  t_cancel_every_progress("objective and minimum", run, &stack);
  loft_stack_free_rig(ctx, &stack);
  batten_context_free(ctx);
  return t_done();
}
