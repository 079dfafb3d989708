/* The proof that a curve has the wanted curvature signs: spans, knots, inflections.
 *
 * Spans are cut at wanted inflections inside of them; each part, a stretch, is proven by itself (certify_prove.c).
 * What happens at the joints between them depends on what is known to be continuous there: at cuts and at knots that
 * leave x'' continuous a change of sign is a zero of [x', x''], which both sides enclose. At knots where x'' may jump
 * both sides are proven up to the knot; only where [x', x''] vanishes there to the rounding of the control points are
 * they proven like zeros, wrong signs below that rounding left aside. So it is at the ends of closed curves, where
 * nothing but the point is continuous to the bit. There and at corners the tangent may turn the right way, or not
 * beyond rounding. */
#include "certify.h"

#include <float.h>
#include <math.h>

#include "base/checked.h"

enum zero { ZERO_NONE, ZERO_SMOOTH, ZERO_JUMP };

/* Between two spans, or an end. */
typedef struct joint {
  size_t wanted;  /* inflections */
  double offset;  /* from where they are wanted */
  enum zero zero; /* what an inflection is here: SMOOTH where x'' is continuous */
  bool corner;    /* x' may jump */
} joint;

/* The tangent at the end of a span with what rounding of the control points leaves open. */
typedef struct tangent {
  double a[2], error;
} tangent;

typedef struct certifier {
  const batten_curve *curve;
  const batten_curve_shape_options *opt;
  certify_proof proof;
  double data_error;
  joint ends; /* of the domain */
  int sign, first_sign;
  size_t next; /* inflection */
  tangent first, last;
} certifier;

/* A stretch with its two ends and the span's length; `noisy` is the same with the errors of the control points. */
typedef struct extent {
  bend b, noisy;
  double from, to, span;
  enum zero zero[2];
  double offset[2];
} extent;

batten_curve_shape_options batten_curve_shape_options_default(void) {
  return (batten_curve_shape_options){
      .struct_size = sizeof(batten_curve_shape_options), .slack = 1e-9, .depth_max = 40};
}

static batten_status check(batten_context *ctx, const batten_curve *curve, const batten_curve_shape_options *opt,
                           const batten_curve_shape *out) {
  if (!curve || !out)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a curve and room for the result",
                       curve ? "out" : "curve");
  batten_status st = batten_check_struct(ctx, "batten_curve_shape_options", opt->struct_size, sizeof *opt);
  if (st < 0) return st;
  if (opt->sign < -1 || opt->sign > 1)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.sign: %d; give -1, 0 or 1", opt->sign);
  if (!(opt->slack > 0) || isinf(opt->slack))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.slack: %g; give a finite number above 0", opt->slack);
  if (opt->depth_max > 50)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.depth_max: %u; give 0 to 50", opt->depth_max);
  size_t count = opt->inflection_count;
  if (count && !opt->inflections)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.inflections: NULL; give %zu parameters", count);
  if (curve->closed && count % 2)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.inflection_count: %zu; of a closed curve it is even", count);
  double lower = bspline_lower(&curve->space), upper = bspline_upper(&curve->space);
  for (size_t i = 0; i < count; i++) {
    double t = opt->inflections[i];
    if (!(t >= lower && t < upper) || (t == lower && !curve->closed))
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "opt.inflections[%zu]: %.17g; give one inside the domain, %.17g to %.17g", i, t, lower,
                         upper);
    if (i > 0 && !(opt->inflections[i - 1] < t))
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "opt.inflections[%zu]: %.17g is not above the one before it; sort them", i, t);
  }
  return BATTEN_OK;
}

/* ---- stretches ------------------------------------------------------------------------------------ */

/* One zero at most; at the end `side`. */
static void prove(certifier *c, const extent *e, int side, double allowed) {
  certify_stretch s = {.b = e->b, .from = e->from, .to = e->to, .zero = e->zero[side] != ZERO_NONE};
  s.share = fabs(e->to - e->from) / e->span * CERTIFY_UP;
  s.allowed = allowed;
  s.slack = e->zero[side] == ZERO_SMOOTH ? c->opt->slack : 0;
  s.offset = e->offset[side];
  if (c->sign < 0) bend_negate(&s.b);
  if (side == 1) {
    bend_reverse(&s.b);
    s.from = e->to;
    s.to = e->from;
  }
  curve_prove(&c->proof, &s);
}

/* What g may be off by at an end, and whether it is beyond that and right. */
static double end_error(const extent *e, int side) { return e->noisy.g_error[side ? e->noisy.n : 0]; }

static bool strict_at(const certifier *c, const extent *e, int side) {
  return c->sign * e->b.g[side ? e->b.n : 0] > end_error(e, side);
}

static void prove_extent(certifier *c, extent *e) {
  double allowed[2] = {0, 0};
  for (int side = 0; side < 2; side++) {
    if (e->zero[side] == ZERO_JUMP && strict_at(c, e, side)) {
      e->zero[side] = ZERO_NONE;
      c->proof.error = fmax(c->proof.error, e->offset[side]);
    }
    /* z, from above, has the error of g in it once more. */
    if (e->zero[side] != ZERO_NONE) allowed[side] = 2 * end_error(e, side);
  }
  if (e->zero[0] == ZERO_NONE || e->zero[1] == ZERO_NONE) {
    int side = e->zero[1] != ZERO_NONE;
    prove(c, e, side, allowed[side]);
    return;
  }
  extent upper = *e;
  bend_split(&e->b, 0.5, &upper.b);
  e->to = upper.from = 0.5 * e->from + 0.5 * e->to;
  e->zero[1] = upper.zero[0] = ZERO_NONE;
  prove(c, e, 0, allowed[0]);
  prove(c, &upper, 1, allowed[1]);
}

/* ---- joints --------------------------------------------------------------------------------------- */

/* Takes the inflections up to `reach` as those of a joint at t. */
static void take_inflections(certifier *c, double t, double reach, joint *j) {
  for (; c->next < c->opt->inflection_count && c->opt->inflections[c->next] <= reach; c->next++) {
    j->wanted++;
    j->offset = fmax(j->offset, fabs(c->opt->inflections[c->next] - t));
  }
}

static double reach_of(const certifier *c, size_t mu) {
  const double *knots = c->curve->space.knots + mu;
  return fmin(c->opt->slack, 0.25) * (knots[1] - knots[0]);
}

/* Between span mu and the one after it. */
static joint joint_after(certifier *c, size_t mu, size_t next) {
  size_t d = c->curve->space.degree, fold = next - mu;
  double t = c->curve->space.knots[next];
  joint j = {.zero = fold + 2 <= d ? ZERO_SMOOTH : ZERO_JUMP, .corner = fold >= d};
  take_inflections(c, t, t + reach_of(c, next), &j);
  return j;
}

/* Of closed curves: its inflections may be the first and the last of the list. */
static joint joint_of_ends(certifier *c, size_t first_mu, size_t last_mu) {
  joint j = {.zero = ZERO_JUMP, .corner = c->curve->closed};
  if (!c->curve->closed) return j;
  double lower = bspline_lower(&c->curve->space), upper = bspline_upper(&c->curve->space);
  take_inflections(c, lower, lower + reach_of(c, first_mu), &j);
  size_t count = c->opt->inflection_count;
  while (count > c->next && c->opt->inflections[count - 1] >= upper - reach_of(c, last_mu)) {
    count--;
    j.wanted++;
    j.offset = fmax(j.offset, upper - c->opt->inflections[count]);
  }
  return j;
}

/* From the last tangent to a, between spans of signs `before` and c->sign. */
static void certify_corner(certifier *c, const tangent *a, const tangent *b, int before, double t) {
  const double across[2] = {-b->a[1], b->a[0]};
  int turn = bend_turn(a->a, a->error, b->a, b->error);
  bool forward = bend_turn(a->a, a->error, across, b->error) > 0;
  if (turn == 0 ? forward : before != c->sign || turn == c->sign) return;
  c->proof.failed = true;
  if (c->proof.least > 0) {
    c->proof.least = 0;
    c->proof.least_at = t;
  }
}

/* ---- spans ---------------------------------------------------------------------------------------- */

static tangent tangent_of(const bend *noisy, bool upper) {
  unsigned k = upper ? noisy->m : 0;
  return (tangent){{noisy->a[k][0], noisy->a[k][1]}, noisy->a_error[k]};
}

/* The part of the extent up to `at`. */
static double part_of(const extent *e, double at) { return (at - e->from) / (e->to - e->from); }

/* The sign that most of the first span has, up to its first inflection. */
static int sign_of(const certifier *c, const extent *e) {
  bend b = e->b, rest;
  double s = c->next < c->opt->inflection_count ? part_of(e, c->opt->inflections[c->next]) : 1, sum = 0;
  if (s > 0 && s < 1) bend_split(&b, s, &rest);
  for (unsigned i = 0; i <= b.n; i++) sum += b.g[i];
  return sum < 0 ? -1 : 1;
}

/* Signs and the corner where span mu begins. */
static void begin_span(certifier *c, const joint *left, const extent *e) {
  tangent start = tangent_of(&e->noisy, false);
  if (left->wanted > 1) c->proof.failed = true;
  if (c->first_sign == 0) {
    c->first_sign = c->sign = c->opt->sign ? c->opt->sign : sign_of(c, e);
    c->first = start;
    return;
  }
  int before = c->sign;
  if (left->wanted) c->sign = -before;
  if (left->corner) certify_corner(c, &c->last, &start, before, e->from);
}

/* The part up to an inflection inside the span; e becomes the rest. */
static void prove_up_to(certifier *c, extent *e, double at) {
  double s = part_of(e, at);
  if (!(s > 0 && s < 1)) {
    c->proof.failed = true;
    return;
  }
  extent part = *e;
  bend_split(&part.b, s, &e->b);
  bend_split(&part.noisy, s, &e->noisy);
  part.to = e->from = at;
  part.zero[1] = e->zero[0] = ZERO_SMOOTH;
  part.offset[1] = e->offset[0] = 8 * CERTIFY_EPS * e->span; /* s is rounded */
  prove_extent(c, &part);
  c->sign = -c->sign;
}

/* From joint `left` to the one that is returned, before span `next`. */
static joint certify_span(certifier *c, size_t mu, size_t next, const joint *left) {
  const double *knots = c->curve->space.knots + mu, *at = c->opt->inflections;
  extent e = {.from = knots[0], .to = knots[1], .span = knots[1] - knots[0]};
  bend_make(c->curve, mu, 0, &e.b);
  bend_make(c->curve, mu, c->data_error, &e.noisy);
  tangent end = tangent_of(&e.noisy, true);
  begin_span(c, left, &e);
  if (left->wanted) e.zero[0] = left->zero;
  e.offset[0] = left->offset;
  /* At the end of an open curve there is no joint that could have it. */
  bool open_end = next >= c->curve->space.count && !c->curve->closed;
  double last = open_end ? knots[1] : knots[1] - reach_of(c, mu);
  for (; c->next < c->opt->inflection_count && at[c->next] < last; c->next++) prove_up_to(c, &e, at[c->next]);
  joint right = next < c->curve->space.count ? joint_after(c, mu, next) : c->ends;
  if (right.wanted) e.zero[1] = right.zero;
  e.offset[1] = right.offset;
  prove_extent(c, &e);
  c->last = end;
  return right;
}

static void certify_all(certifier *c) {
  const bspline *b = &c->curve->space;
  size_t first = bspline_first(b), last = first, next;
  while ((next = bspline_next(b, last)) < b->count) last = next;
  joint at = c->ends = joint_of_ends(c, first, last);
  for (size_t mu = first; mu < b->count; mu = next) {
    next = bspline_next(b, mu);
    at = certify_span(c, mu, next, &at);
  }
  if (!c->curve->closed) return;
  int before = c->sign;
  c->sign = c->first_sign;
  certify_corner(c, &c->last, &c->first, before, bspline_lower(b));
}

/* A margin in the caller's unit; not above it, and 0 rather than without all its digits. */
static double margin_of(const certifier *c, double margin) {
  double value = ldexp(margin, c->curve->exponent);
  if (fabs(value) < DBL_MIN) return 0;
  return fmin(value, DBL_MAX);
}

batten_status batten_curve_certify(batten_context *ctx, const batten_curve *curve,
                                   const batten_curve_shape_options *opt, batten_curve_shape *out) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_curve_shape_options defaults = batten_curve_shape_options_default();
  if (!opt) opt = &defaults;
  batten_status st = check(ctx, curve, opt, out);
  if (st < 0) return st;
  certifier c = {.curve = curve, .opt = opt, .data_error = bend_data_error(curve)};
  c.proof = (certify_proof){.depth_max = opt->depth_max, .least = INFINITY, .target = INFINITY, .bound = INFINITY};
  c.proof.least_at = bspline_lower(&curve->space);
  c.proof.stack = batten_alloc_array(ctx, (size_t)opt->depth_max + 2, sizeof *c.proof.stack);
  if (!c.proof.stack) return BATTEN_E_NOMEM;
  certify_all(&c);
  bool certified = !c.proof.failed;
  *out = (batten_curve_shape){.certified = certified,
                              .sign = certified ? c.first_sign : 0,
                              .margin_min = margin_of(&c, certified ? c.proof.bound : c.proof.least),
                              .worst_at = c.proof.least_at,
                              .inflection_error = c.proof.error,
                              .pieces = c.proof.pieces,
                              .depth = c.proof.depth};
  batten_free(ctx, c.proof.stack);
  return BATTEN_OK;
}
