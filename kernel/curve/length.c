/* Arc length, parameters at lengths, samples.
 *
 * Lengths are integrals of |x'| over parts of spans that are short enough for the rule of Gauss and Legendre. The
 * inverse keeps these parts: between their ends the same rule gives the length up to any place, and a few steps of
 * Newton, safeguarded by bisection, the place of a length. */
#include "curve_inner.h"

#include "base/checked.h"
#include "basis/refine.h"

#include <string.h>

/* ---- lengths ------------------------------------------------------------------------------------- */

/* Of a piece between two parts of it. */
static double piece_length(const curve_piece *piece, double from, double to) {
  curve_walk walk;
  curve_sum sum = {0, 0};
  double a, b, integrals[CURVE_INTEGRALS];
  curve_walk_start(&walk, piece, curve_speed, from, to);
  while (curve_walk_next(&walk, &a, &b, integrals)) curve_sum_add(&sum, integrals[0]);
  return curve_sum_get(&sum);
}

/* From one parameter to another in the domain, from <= to. */
static double length_between(const batten_curve *curve, double from, double to) {
  const bspline *b = &curve->space;
  curve_sum sum = {0, 0};
  double middle[2];
  curve_find_middle(curve, middle);
  for (size_t mu = bspline_span(b, from); mu < b->count && b->knots[mu] < to; mu = bspline_next(b, mu)) {
    curve_piece piece;
    curve_piece_make(curve, mu, middle, &piece);
    double start = from > b->knots[mu] ? curve_span_part(b, mu, from) : 0;
    double end = to < b->knots[mu + 1] ? curve_span_part(b, mu, to) : 1;
    if (start < end) curve_sum_add(&sum, piece_length(&piece, start, end));
  }
  return curve_sum_get(&sum);
}

double curve_whole_length(const batten_curve *curve) {
  return length_between(curve, bspline_lower(&curve->space), bspline_upper(&curve->space));
}

/* The same of any parameters of a closed curve: how often round, and what is left. */
static double length_round(const batten_curve *curve, double from, double to) {
  double lower = bspline_lower(&curve->space), upper = bspline_upper(&curve->space), period = upper - lower;
  double a = curve_wrap(curve, from), b = curve_wrap(curve, to);
  double rounds = round((to - b) / period - (from - a) / period);
  double length =
      a <= b ? length_between(curve, a, b) : length_between(curve, a, upper) + length_between(curve, lower, b);
  if (a > b) rounds -= 1;
  return rounds == 0 ? length : length + rounds * curve_whole_length(curve);
}

batten_status batten_curve_length(batten_context *ctx, const batten_curve *curve, double from, double to,
                                  double *length) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!curve || !length)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a curve and room for a length",
                       curve ? "length" : "curve");
  batten_status st = curve_check_parameter(ctx, curve, "from", SIZE_MAX, from);
  if (st >= 0) st = curve_check_parameter(ctx, curve, "to", SIZE_MAX, to);
  if (st < 0) return st;
  double least = fmin(from, to), most = fmax(from, to);
  double size = curve->closed ? length_round(curve, least, most) : length_between(curve, least, most);
  size = ldexp(size, -curve->exponent);
  if (!isfinite(size))
    return batten_fail(ctx, BATTEN_E_INVALID, "to: %g; the length from %g is beyond a double", to, from);
  *length = to < from ? -size : size;
  return BATTEN_OK;
}

/* ---- parameters at lengths ------------------------------------------------------------------------ */

enum { LENGTHS = 128 }; /* a task: about 300 us */

/* A part of a span on which the rule is good, and the length before it. */
typedef struct leaf {
  size_t mu, piece;
  double from, to, before;
} leaf;

typedef struct table {
  const batten_curve *curve;
  curve_piece *pieces;
  leaf *leaves; /* [count + 1]: the last one is the end, at which `before` is the whole */
  size_t count, room;
  size_t length_count;
  const double *lengths;
  double *parameters;
} table;

static batten_status add_leaf(batten_context *ctx, table *t, leaf new) {
  if (t->count == t->room) {
    size_t room = 2 * t->room + 16;
    leaf *more = batten_realloc_array(ctx, t->leaves, room, sizeof *more);
    if (!more) return BATTEN_E_NOMEM;
    t->leaves = more;
    t->room = room;
  }
  t->leaves[t->count++] = new;
  return BATTEN_OK;
}

static batten_status make_table(batten_context *ctx, table *t) {
  const bspline *b = &t->curve->space;
  double middle[2];
  size_t at = 0;
  curve_sum sum = {0, 0};
  t->pieces = batten_alloc_array(ctx, bspline_span_count(b), sizeof *t->pieces);
  if (!t->pieces) return BATTEN_E_NOMEM;
  curve_find_middle(t->curve, middle);
  for (size_t mu = bspline_first(b); mu < b->count; mu = bspline_next(b, mu), at++) {
    curve_walk walk;
    leaf new = {.mu = mu, .piece = at};
    double integrals[CURVE_INTEGRALS];
    curve_sum own = {0, 0}, before = sum; /* as in length_between: the whole has the same bits */
    curve_piece_make(t->curve, mu, middle, &t->pieces[at]);
    curve_walk_start(&walk, &t->pieces[at], curve_speed, 0, 1);
    while (curve_walk_next(&walk, &new.from, &new.to, integrals)) {
      curve_sum here = before;
      curve_sum_add(&here, curve_sum_get(&own));
      new.before = curve_sum_get(&here);
      if (add_leaf(ctx, t, new) < 0) return BATTEN_E_NOMEM;
      curve_sum_add(&own, integrals[0]);
    }
    curve_sum_add(&sum, curve_sum_get(&own));
  }
  batten_status st = add_leaf(ctx, t, (leaf){.before = curve_sum_get(&sum)});
  if (st >= 0) t->count--;
  return st;
}

/* The part of the piece at which a length has passed since the leaf's start. */
static double solve(const curve_piece *piece, const leaf *l, double length, double whole) {
  double low = l->from, high = l->to, all = l[1].before - l->before;
  double u = all > 0 ? low + (high - low) * fmin(fmax(length / all, 0), 1) : low;
  for (int step = 0; step < 60; step++) {
    double speed[CURVE_INTEGRALS], error = curve_gauss_speed(piece, l->from, u) - length;
    curve_speed(piece, u, speed);
    double newton = error / speed[0];
    if (fabs(error) <= 1e-16 * whole || fabs(newton) <= 0x1p-53) break;
    if (error > 0)
      high = u;
    else
      low = u;
    double next = u - newton;
    if (!(next > low && next < high)) next = low + 0.5 * (high - low);
    if (!(next > low && next < high)) break;
    u = next;
  }
  return u;
}

static double find_parameter(const table *t, double length) {
  const bspline *b = &t->curve->space;
  const leaf *leaves = t->leaves;
  double whole = leaves[t->count].before, lower = bspline_lower(b), upper = bspline_upper(b), rounds = 0;
  length = ldexp(length, t->curve->exponent);
  if (t->curve->closed && whole > 0 && !(length >= 0 && length <= whole)) {
    rounds = floor(length / whole);
    length = fmod(length, whole);
    if (length < 0) length += whole;
  }
  double turned = rounds * (upper - lower);
  if (length <= 0) return lower + turned;
  if (length >= whole) return upper + turned;
  size_t low = 0, high = t->count;
  while (high - low > 1) {
    size_t middle = low + (high - low) / 2;
    if (leaves[middle].before <= length)
      low = middle;
    else
      high = middle;
  }
  const leaf *l = &leaves[low];
  double u = solve(&t->pieces[l->piece], l, length - l->before, whole);
  return curve_span_at(b, l->mu, u) + turned;
}

static void find_some(void *arg, size_t index) {
  const table *t = arg;
  size_t from = index * LENGTHS, to = from + LENGTHS < t->length_count ? from + LENGTHS : t->length_count;
  for (size_t i = from; i < to; i++) t->parameters[i] = find_parameter(t, t->lengths[i]);
}

static batten_status check_lengths(batten_context *ctx, const table *t) {
  double whole = ldexp(t->leaves[t->count].before, -t->curve->exponent), slack = 1e-12 * whole;
  double period = bspline_upper(&t->curve->space) - bspline_lower(&t->curve->space);
  for (size_t i = 0; i < t->length_count; i++) {
    double length = t->lengths[i];
    double rounds = whole > 0 ? length / whole : length == 0 ? 0 : INFINITY;
    if (!(t->curve->closed ? isfinite(ldexp(length, t->curve->exponent)) && isfinite(rounds * period)
                           : length >= -slack && length - whole <= slack))
      return batten_fail(ctx, BATTEN_E_INVALID, "lengths[%zu]: %.17g; the curve has those from 0 to %.17g%s", i,
                         length, whole, t->curve->closed && whole > 0 ? ", and beyond" : "");
  }
  return BATTEN_OK;
}

batten_status batten_curve_at_lengths(batten_context *ctx, const batten_curve *curve, size_t count,
                                      const double *lengths, double *parameters) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!curve) return batten_fail(ctx, BATTEN_E_INVALID, "curve: NULL; give a curve");
  if (count && (!lengths || !parameters))
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give %zu lengths and room for as many parameters",
                       lengths ? "parameters" : "lengths", count);
  table t = {.curve = curve, .length_count = count, .lengths = lengths, .parameters = parameters};
  batten_status st = make_table(ctx, &t);
  if (st >= 0) st = check_lengths(ctx, &t);
  if (st >= 0) batten_parallel(ctx, count / LENGTHS + (count % LENGTHS > 0), find_some, &t);
  batten_free(ctx, t.leaves);
  batten_free(ctx, t.pieces);
  return st;
}

/* ---- samples -------------------------------------------------------------------------------------- */

/* The largest distance of the control points from the chord: the whole piece is nearer to it, and it to the piece. */
static double polygon_distance(const curve_piece *piece) {
  const double(*p)[2] = (const double(*)[2])piece->point, *from = p[0], *to = p[piece->degree];
  double chord[2] = {to[0] - from[0], to[1] - from[1]}, square = chord[0] * chord[0] + chord[1] * chord[1], most = 0;
  for (unsigned i = 1; i < piece->degree; i++) {
    double step[2] = {p[i][0] - from[0], p[i][1] - from[1]};
    double part = square > 0 ? (step[0] * chord[0] + step[1] * chord[1]) / square : 0;
    part = fmin(fmax(part, 0), 1);
    most = fmax(most, hypot(step[0] - part * chord[0], step[1] - part * chord[1]));
  }
  return most;
}

/* A bound of |x''|: of the Bernstein coefficients over eight parts. */
static double second_bound(const curve_piece *piece) {
  enum { PARTS = 8 };
  if (piece->degree < 2) return 0;
  unsigned n = piece->degree - 2;
  double most = 0;
  for (unsigned part = 0; part < PARTS; part++)
    for (unsigned i = 0; i <= n; i++) {
      double work[BSPLINE_ORDER][2];
      memcpy(work, piece->second, sizeof work);
      for (unsigned left = n; left > 0; left--) {
        double u = (double)(part + (left <= i)) / PARTS;
        for (unsigned k = 0; k < left; k++)
          for (unsigned x = 0; x < 2; x++) work[k][x] = (1 - u) * work[k][x] + u * work[k + 1][x];
      }
      most = fmax(most, hypot(work[0][0], work[0][1]));
    }
  return most;
}

/* Equal steps of u in which a chord is off by step^2 |x''| / 8 at most. */
static double count_steps(const curve_piece *piece, double tolerance) {
  if (polygon_distance(piece) <= tolerance) return 1;
  return fmax(ceil(sqrt(second_bound(piece) / tolerance / 8) * (1 + 1e-12)), 1);
}

batten_status batten_curve_sample(batten_context *ctx, const batten_curve *curve, double tolerance, size_t *count,
                                  double **parameters) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!curve || !count || !parameters)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a curve and room for its samples",
                       !curve  ? "curve"
                       : count ? "parameters"
                               : "count");
  if (!(tolerance > 0 && isfinite(tolerance)))
    return batten_fail(ctx, BATTEN_E_INVALID, "tolerance: %g; give a positive distance", tolerance);
  const bspline *b = &curve->space;
  size_t spans = bspline_span_count(b), all = 1, at = 0;
  double middle[2], scaled = ldexp(tolerance, curve->exponent), *found = NULL;
  batten_status st = BATTEN_E_NOMEM;
  size_t *steps = batten_alloc_array(ctx, spans, sizeof *steps);
  if (!steps) goto done;
  curve_find_middle(curve, middle);
  for (size_t mu = bspline_first(b); mu < b->count; mu = bspline_next(b, mu), at++) {
    curve_piece piece;
    curve_piece_make(curve, mu, middle, &piece);
    double wanted = count_steps(&piece, scaled);
    steps[at] = wanted < 0x1p40 ? (size_t)wanted : SIZE_MAX;
    if (steps[at] == SIZE_MAX || !batten_add(all, steps[at], &all)) {
      st = batten_fail(ctx, BATTEN_E_TOO_LARGE,
                       "tolerance: %g; asks for %g points from %.17g to %.17g; give a larger one", tolerance, wanted,
                       b->knots[mu], b->knots[mu + 1]);
      goto done;
    }
  }
  found = batten_alloc_array(ctx, all, sizeof *found);
  if (!found) goto done;
  size_t made = 0;
  found[made++] = bspline_lower(b);
  at = 0;
  for (size_t mu = bspline_first(b); mu < b->count; mu = bspline_next(b, mu), at++)
    for (size_t k = 1; k <= steps[at]; k++) {
      double t = k == steps[at] ? b->knots[mu + 1] : curve_span_at(b, mu, (double)k / (double)steps[at]);
      if (t > found[made - 1]) found[made++] = t; /* there may be more steps than doubles */
    }
  *count = made;
  *parameters = found;
  found = NULL;
  st = BATTEN_OK;
done:
  batten_free(ctx, found);
  batten_free(ctx, steps);
  return st;
}
