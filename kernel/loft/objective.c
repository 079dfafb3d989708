/* The objective: legs near spirals and smooth [eq. 12], trajectories under tension [eq. 13].
 *
 * With g_i = gap_i / mean gap, P the mean length of the contours' polygons, p_v(zeta) the leg v between two contours,
 * q_v its spiral and rho_v its mean length at both,
 *
 *   F = sum_i g_i sum_v 1 / (rho_v P) (mean_r |p_v(r / S) - q_v(r / S)|^2 + a int_0^1 |p_v''|^2)
 *     + a sum_i 1 / g_i^3 sum_j w_j int_0^1 |d_j''|^2 / P^2.
 *
 * F has no unit: of a contour turned into one that is smaller by a part e the first sum is about e^2. Legs are as
 * long as their knot interval times x', so that 1 / rho_v makes the sum over legs an integral over t, and errors of
 * direction count alike on short and long legs. (With equal weights for all legs, as in the paper, short ones lose
 * their direction to errors that are nothing on long ones.) The tension of legs is not in the paper: spirals have
 * kinks at contours, and what lies nearest to them turns as fast as continuity lets it, all at once beside the
 * contours; a rounds this to about a^(1/4) of a patch. The tension of trajectories is int |d^2/dz^2 d_j|^2 dz times
 * (mean gap)^3 / P^2, so that stacks of other proportions of height to width have the same. (With 0.001 for a, random
 * stacks bend by 1.1 to 1.3 times as much as with tension alone, where spirals alone bend by 2 to 6 times as much,
 * and fewest of their sections have wrong turns: half as many as with spirals alone, and as with ten times the
 * tension.) w_j: 1 for the first and the last trajectory; those of closed contours all have their part, the integral
 * of their B-spline over t. So what is left of the tension to the mean of x over t, which no leg says anything about
 * and which is the same on any knots, is that of a spline through the contours' means.
 *
 * The spiral is replaced by the polynomial b_v nearest to it at the r / S: up to a constant the mean of squares is
 * (e - b)' M (e - b), with the control points e of p_v and M = mean_r B_k(r / S) B_l(r / S). So values and gradients
 * come from differences that are small where the fit is good, and the matrix, for which 1 / rho_v of tiny legs is
 * large, need not be exact: the solution is refined by gradients that have all digits.
 *
 * Every sum has a fixed order. */
#include <string.h>

#include "base/checked.h"
#include "objective.h"

enum { REFINEMENTS = 2 };

/* What is 0 of tension: without any the whole surface could shift. */
static const double LEAST_TENSION = 1e-6;
/* Legs count as no shorter than this part of what their knot interval has of the polygon: where they have no length
 * x' is nearly 0 and need not have a direction. And than this part of the polygon: 1 / rho has to leave digits. */
static const double SHORT = 1e-3, SHORTEST = 1e-9;

/* ---- Bernstein polynomials ----------------------------------------------------------------------- */

static double binomial(unsigned n, unsigned k) {
  double value = 1;
  for (unsigned i = 1; i <= k; i++) value = value * (n - k + i) / i;
  return value;
}

static void bernstein(unsigned n, double x, double *values) {
  values[0] = 1;
  for (unsigned m = 1; m <= n; m++) {
    double carry = 0;
    for (unsigned k = 0; k < m; k++) {
      double part = values[k];
      values[k] = carry + (1 - x) * part;
      carry = x * part;
    }
    values[m] = carry;
  }
}

/* gram: (n (n - 1))^2 int_0^1 of products of degree n - 2, by int B_i^p B_j^p = C(p, i) C(p, j) / (C(2 p, i + j)
 * (2 p + 1)), which second differences of control points are combined by. bent: int_0^1 B_k'' B_l'', the same for
 * control points. */
static void make_bent(unsigned n, form *gram, form *bent) {
  static const double second[3] = {1, -2, 1};
  unsigned p = n - 2;
  double factor = (double)n * (n - 1);
  for (unsigned i = 0; i <= p; i++)
    for (unsigned j = 0; j <= p; j++) {
      double product = binomial(p, i) * binomial(p, j) / (binomial(2 * p, i + j) * (2 * p + 1));
      gram->at[i][j] = factor * factor * product;
      for (unsigned k = 0; k < 3; k++)
        for (unsigned l = 0; l < 3; l++) bent->at[i + k][j + l] += gram->at[i][j] * second[k] * second[l];
    }
}

/* x := a^-1 x [n + 1][2], a positive definite of at most ORDER rows; a becomes its factor. */
static void solve_small(unsigned n, form *factor, double (*x)[2]) {
  double(*a)[ORDER] = factor->at;
  for (unsigned j = 0; j <= n; j++) {
    for (unsigned k = 0; k < j; k++) a[j][j] -= a[j][k] * a[j][k];
    a[j][j] = sqrt(a[j][j]);
    for (unsigned i = j + 1; i <= n; i++) {
      for (unsigned k = 0; k < j; k++) a[i][j] -= a[i][k] * a[j][k];
      a[i][j] /= a[j][j];
    }
  }
  for (unsigned c = 0; c < 2; c++) {
    for (unsigned i = 0; i <= n; i++) {
      for (unsigned k = 0; k < i; k++) x[i][c] -= a[i][k] * x[k][c];
      x[i][c] /= a[i][i];
    }
    for (unsigned i = n + 1; i-- > 0;) {
      for (unsigned k = i + 1; k <= n; k++) x[i][c] -= a[k][i] * x[k][c];
      x[i][c] /= a[i][i];
    }
  }
}

/* ---- legs and trajectories ----------------------------------------------------------------------- */

/* Control points [n + 1][2] of trajectory j of patch i. */
static void trajectory(const loft_net *net, const double *y, size_t i, size_t j, double (*out)[2]) {
  for (unsigned k = 0; k <= net->degree; k++) {
    size_t row = loft_at(net, i, j, k);
    for (unsigned c = 0; c < 2; c++) {
      out[k][c] = net->offset[2 * row + c];
      for (size_t e = net->z.starts[row]; e < net->z.starts[row + 1]; e++)
        out[k][c] += net->z.values[e] * y[2 * net->z.indices[e] + c];
    }
  }
}

/* g of patch i. */
static double relative_gap(const loft_objective *o, size_t i) { return o->net->slabs[i].gap / o->mean_gap; }

double objective_trajectory_weight(const loft_objective *o, size_t i, size_t j) {
  const loft_space *s = &o->net->slabs[i].space;
  double g = relative_gap(o, i), share;
  if (o->closed)
    share = (loft_knot(s, (ptrdiff_t)(j + s->degree + 1)) - loft_knot(s, (ptrdiff_t)j)) / (s->degree + 1);
  else
    share = j == 0 || j + 1 == s->count;
  return share * o->tension / (g * g * g * o->polygon * o->polygon);
}

/* out := weight a x, x [n + 1][2]; returns x'out. */
static double weigh(unsigned n, double weight, const form *a, double (*x)[2], double (*out)[2]) {
  double sum = 0;
  for (unsigned k = 0; k <= n; k++)
    for (unsigned c = 0; c < 2; c++) {
      double value = 0;
      for (unsigned l = 0; l <= n; l++) value += a->at[k][l] * x[l][c];
      out[k][c] = weight * value;
      sum += out[k][c] * x[k][c];
    }
  return sum;
}

/* The same with a = bent, by second differences: straight trajectories leave nothing. */
static double bend(const loft_objective *o, double weight, double (*x)[2], double (*out)[2]) {
  unsigned n = o->net->degree;
  double second[ORDER][2], product[ORDER][2];
  for (unsigned k = 0; k + 2 <= n; k++)
    for (unsigned c = 0; c < 2; c++) second[k][c] = (x[k + 2][c] - x[k + 1][c]) - (x[k + 1][c] - x[k][c]);
  double sum = weigh(n - 2, weight, &o->gram, second, product);
  memset(out, 0, (n + 1) * sizeof *out);
  for (unsigned k = 0; k + 2 <= n; k++)
    for (unsigned c = 0; c < 2; c++) {
      out[k][c] += product[k][c];
      out[k + 1][c] -= 2 * product[k][c];
      out[k + 2][c] += product[k][c];
    }
  return sum;
}

/* to += sign x */
static void push(unsigned n, double sign, double (*x)[2], double *to) {
  for (unsigned k = 0; k <= n; k++)
    for (unsigned c = 0; c < 2; c++) to[2 * k + c] += sign * x[k][c];
}

/* What leg v of patch i adds to F, between two trajectories; to force as in evaluate. */
static double add_spiral(const loft_objective *o, size_t i, size_t v, double (*from)[2], double (*to)[2],
                         double *force) {
  const loft_net *net = o->net;
  unsigned n = net->degree;
  size_t leg = o->leg_start[i] + v;
  const double *target = o->target + 2 * leg * (n + 1);
  double x[ORDER][2], near[ORDER][2], smooth[ORDER][2], sum;
  for (unsigned k = 0; k <= n; k++)
    for (unsigned c = 0; c < 2; c++) x[k][c] = to[k][c] - from[k][c];
  sum = bend(o, o->weight[leg] * o->tension, x, smooth);
  for (unsigned k = 0; k <= n; k++)
    for (unsigned c = 0; c < 2; c++) x[k][c] -= target[2 * k + c];
  sum += weigh(n, o->weight[leg], &o->sampled, x, near);
  if (!force) return sum;
  double *ends[2] = {force + 2 * loft_at(net, i, v, 0),
                     force + 2 * loft_at(net, i, objective_after(&net->slabs[i].space, v), 0)};
  for (unsigned e = 0; e < 2; e++) {
    push(n, e == 0 ? -1 : 1, near, ends[e]);
    push(n, e == 0 ? -1 : 1, smooth, ends[e]);
  }
  return sum;
}

/* F at y; force (may be NULL) [rows][2] := half its gradient by control points. */
static double evaluate(const loft_objective *o, const double *y, double *force) {
  const loft_net *net = o->net;
  unsigned n = net->degree;
  double sum = o->constant, from[ORDER][2], to[ORDER][2], bent[ORDER][2];
  if (force) memset(force, 0, 2 * net->z.rows * sizeof *force);
  for (size_t i = 0; i < net->slab_count; i++) {
    const loft_space *s = &net->slabs[i].space;
    trajectory(net, y, i, 0, from);
    for (size_t j = 0; j < s->count; j++) {
      if (o->closed || j == 0 || j + 1 == s->count) {
        sum += bend(o, objective_trajectory_weight(o, i, j), from, bent);
        if (force) push(n, 1, bent, force + 2 * loft_at(net, i, j, 0));
      }
      if (j == loft_legs(s)) break;
      trajectory(net, y, i, objective_after(s, j), to);
      sum += add_spiral(o, i, j, from, to, force);
      memcpy(from, to, sizeof from);
    }
  }
  return sum;
}

/* ---- the parts that depend on contours alone ----------------------------------------------------- */

static void measure_stack(loft_objective *o) {
  const loft_net *net = o->net;
  for (size_t i = 0; i < net->slab_count; i++) {
    const loft_slab *slab = &net->slabs[i];
    o->mean_gap += slab->gap;
    for (size_t e = 0; e < 2; e++)
      for (size_t v = 0; v < loft_legs(&slab->space); v++) o->polygon += slab->length[e][v];
  }
  o->mean_gap /= (double)net->slab_count;
  o->polygon /= 2 * (double)net->slab_count;
}

static double leg_weight(const loft_objective *o, size_t i, size_t v) {
  const loft_slab *slab = &o->net->slabs[i];
  const loft_space *s = &slab->space;
  double rho = (slab->length[0][v] + slab->length[1][v]) / 2;
  double share = loft_interval(s, (ptrdiff_t)v) / s->degree;
  rho = fmax(rho, fmax(SHORT * share, SHORTEST) * o->polygon);
  return relative_gap(o, i) / (rho * o->polygon);
}

/* Samples of the spiral [S + 1][2] to the polynomial nearest to them. Returns the mean of squares between. */
static double approach(const loft_objective *o, unsigned samples, const double *basis, const double *spiral,
                       double *target) {
  unsigned n = o->net->degree;
  double x[ORDER][2] = {{0}}, rest = 0;
  form a = o->sampled;
  for (unsigned r = 0; r <= samples; r++)
    for (unsigned k = 0; k <= n; k++)
      for (unsigned c = 0; c < 2; c++) x[k][c] += basis[r * (n + 1) + k] * spiral[2 * r + c] / (samples + 1);
  solve_small(n, &a, x);
  for (unsigned r = 0; r <= samples; r++)
    for (unsigned c = 0; c < 2; c++) {
      double off = -spiral[2 * r + c];
      for (unsigned k = 0; k <= n; k++) off += basis[r * (n + 1) + k] * x[k][c];
      rest += off * off / (samples + 1);
    }
  memcpy(target, x, (n + 1) * sizeof *x);
  return rest;
}

static batten_status make_targets(batten_context *ctx, unsigned samples, loft_objective *o) {
  const loft_net *net = o->net;
  unsigned n = net->degree;
  double *basis = batten_alloc_array(ctx, samples + 1, (n + 3) * sizeof *basis);
  if (!basis) return BATTEN_E_NOMEM;
  double *spiral = basis + (size_t)(samples + 1) * (n + 1);
  for (unsigned r = 0; r <= samples; r++) {
    double *row = basis + r * (n + 1);
    bernstein(n, (double)r / samples, row);
    for (unsigned k = 0; k <= n; k++)
      for (unsigned l = 0; l <= n; l++) o->sampled.at[k][l] += row[k] * row[l] / (samples + 1);
  }
  for (size_t i = 0; i < net->slab_count; i++)
    for (size_t v = 0; v < loft_legs(&net->slabs[i].space); v++) {
      size_t leg = o->leg_start[i] + v;
      for (unsigned r = 0; r <= samples; r++) loft_spiral(&net->slabs[i], v, (double)r / samples, spiral + 2 * r);
      o->weight[leg] = leg_weight(o, i, v);
      o->constant += o->weight[leg] * approach(o, samples, basis, spiral, o->target + 2 * leg * (n + 1));
    }
  batten_free(ctx, basis);
  return BATTEN_OK;
}

/* ---- the whole ----------------------------------------------------------------------------------- */

batten_status loft_objective_new(batten_context *ctx, const loft_stack *stack, const loft_net *net,
                                 const batten_loft_options *opt, loft_objective **out) {
  loft_objective *o = batten_alloc(ctx, sizeof *o);
  batten_status st = BATTEN_E_NOMEM;
  if (!o) return st;
  *o = (loft_objective){.ctx = ctx, .net = net, .closed = stack->closed};
  o->tension = fmax(opt->tension, LEAST_TENSION);
  o->leg_start = batten_alloc_array(ctx, net->slab_count + 1, sizeof *o->leg_start);
  if (!o->leg_start) goto done;
  o->leg_start[0] = 0;
  for (size_t i = 0; i < net->slab_count; i++)
    o->leg_start[i + 1] = o->leg_start[i] + loft_legs(&net->slabs[i].space);
  size_t legs = o->leg_start[net->slab_count];
  o->weight = batten_alloc_array(ctx, legs, sizeof *o->weight);
  o->target = batten_alloc_array(ctx, legs, 2 * (net->degree + 1) * sizeof *o->target);
  if (!o->weight || !o->target) goto done;
  measure_stack(o);
  make_bent(net->degree, &o->gram, &o->bent);
  st = make_targets(ctx, opt->samples > net->degree ? opt->samples : net->degree, o);
  if (st >= 0) st = objective_make_matrix(ctx, o);
  if (st >= 0 && net->z.columns > 0) st = block_plan_new(ctx, &o->h, BLOCK_QUICK, &o->plan);
  if (st >= 0 && o->plan) st = block_factor(ctx, o->plan, &o->h, NULL);
  if (st == BATTEN_E_SINGULAR)
    st = batten_fail(ctx, st,
                     "contours: knots that lie too close together leave the surface undetermined to rounding; set "
                     "opt.knot_tolerance to more than %g, or opt.tension to more than %g",
                     opt->knot_tolerance, opt->tension);
done:
  if (st < 0)
    loft_objective_free(ctx, o);
  else
    *out = o;
  return st;
}

void loft_objective_free(batten_context *ctx, loft_objective *o) {
  if (!o) return;
  block_plan_free(ctx, o->plan);
  block_matrix_free(ctx, &o->h);
  batten_free(ctx, o->target);
  batten_free(ctx, o->weight);
  batten_free(ctx, o->leg_start);
  batten_free(ctx, o);
}

void loft_objective_solve(const loft_objective *o, double *x) {
  if (o->plan) block_solve(o->ctx, o->plan, x);
}

batten_matrix loft_objective_hessian(const loft_objective *o) {
  return batten_matrix_sparse(o->h.rows, o->h.rows, o->h.starts, o->h.columns, o->h.values);
}

/* down [unknowns] := -Z' (gradient by control points), coordinate c. */
static void descent(const loft_net *net, const double *force, size_t c, double *down) {
  memset(down, 0, net->z.columns * sizeof *down);
  for (size_t row = 0; row < net->z.rows; row++)
    for (size_t e = net->z.starts[row]; e < net->z.starts[row + 1]; e++)
      down[net->z.indices[e]] -= 2 * net->z.values[e] * force[2 * row + c];
}

batten_status loft_objective_minimum(batten_context *ctx, loft_objective *o, double *y) {
  const loft_net *net = o->net;
  size_t unknowns = net->z.columns;
  batten_status st = BATTEN_E_NOMEM;
  double *force = batten_alloc_array(ctx, net->z.rows, 2 * sizeof *force);
  double *trial = batten_alloc_array(ctx, unknowns, 3 * sizeof *trial);
  if (!force || !trial) goto done;
  double *down = trial + 2 * unknowns;
  memset(trial, 0, 2 * unknowns * sizeof *trial);
  for (int pass = 0; pass <= REFINEMENTS; pass++) {
    st = batten_progress(ctx, "objective", 1);
    if (st < 0) goto done;
    evaluate(o, trial, force);
    for (size_t c = 0; c < 2; c++) {
      descent(net, force, c, down);
      loft_objective_solve(o, down);
      for (size_t p = 0; p < unknowns; p++) trial[2 * p + c] += down[p];
    }
  }
  memcpy(y, trial, 2 * unknowns * sizeof *y);
  st = BATTEN_OK;
done:
  batten_free(ctx, trial);
  batten_free(ctx, force);
  return st;
}

double loft_objective_value(const loft_objective *o, const double *y) { return evaluate(o, y, NULL); }
