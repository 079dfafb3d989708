/* Legs and turns of the polygons of both contours of a patch, and the turns that must keep their sign [eq. 10].
 *
 * Where knots of the two contours lie close together the polygons on the union of their knots have legs that drown in
 * the rounding of control points: of a leg of 1e-9 of the polygon half the digits are left, of the turn at a vertex
 * beside it none. So nothing is taken from differences on the union. The control points of x' and x'' on the
 * contour's own knots are refined to the union by convex combinations, which lose no digits: leg v is x'_v times its
 * knot interval / degree, and [leg_v, leg_(v+1)] has the sign of [x'_v, x''_v]. Bounds of what rounding can have made
 * of them take part in the same combinations as a third coordinate.
 *
 * A turn keeps its sign where both contours have it beyond these bounds. Where x'' is 0 in both, at inflections that
 * have found their partner or along straight pieces, sections have x'' = 0 too (LOFT_FLAT). Where only one is 0 no
 * room is left for a sign: a section next to that contour may turn to either side by as little as one likes. */
#include <float.h>
#include <string.h>

#include "base/checked.h"
#include "basis/refine.h"
#include "loft_inner.h"

static const double PI = 3.14159265358979323846;
/* Rounding of a control point, in units of what it was rounded at: once by the caller, when it was scaled, and by the
 * insertion of knots. */
static const double ROUNDED = 4 * DBL_EPSILON;
/* x'' that is less than this times the mean of |x'| is 0: over the whole contour it would not bend by more. */
static const double STRAIGHT = 1e-10;
/* Where rounding is more than this times the mean of |x'|, whether x'' is 0 cannot be told. */
static const double UNTOLD = 1e-6;

/* What a contour's turn at a vertex is known to be: -1, +1, or these. */
enum { TURN_NONE = 0, TURN_UNKNOWN = 3 };

/* ---- x' and x'' of one contour ------------------------------------------------------------------- */

/* Control points of x' [legs][3] and x'' [vertices][3] on the patch's knots: both coordinates, and a bound of the
 * rounding error in them. */
typedef struct derivatives {
  double *first, *second;
  double speed; /* mean of |x'| over the polygon */
} derivatives;

static void derivatives_free(batten_context *ctx, derivatives *d) {
  batten_free(ctx, d->second);
  batten_free(ctx, d->first);
}

/* Control points [count][3] of the derivative of those of degree `degree` at points [count + 1][3]; the knots of the
 * derivative are knots [0 ..]. */
static void differentiate(unsigned degree, size_t count, const double *knots, const double *points, double *out) {
  for (size_t j = 0; j < count; j++) {
    const double *a = points + 3 * j, *b = a + 3;
    double factor = degree / (knots[j + degree] - knots[j]), size = 0;
    for (unsigned k = 0; k < 2; k++) {
      out[3 * j + k] = factor * (b[k] - a[k]);
      size = fmax(size, fabs(out[3 * j + k]));
    }
    out[3 * j + 2] = factor * (a[2] + b[2]) + DBL_EPSILON * size;
  }
}

/* The same points [..][3] over more knots; degree 0, which bspline_refine has not, are steps. */
static void refine(const bspline *from, const double *points, const bspline *to, double *out) {
  if (from->degree > 0) {
    bspline_refine(from, 3, points, to, out);
    return;
  }
  for (size_t v = 0, j = 0; v < to->count; v++) {
    while (from->knots[j + 1] <= to->knots[v]) j++;
    memcpy(out + 3 * v, points + 3 * j, 3 * sizeof *out);
  }
}

/* Points of a contour, one for each function that it has on [0, 1]. */
static void unroll(const loft_stack *stack, const loft_contour *contour, double *points) {
  double far = fmax(fabs(stack->middle[0]), fabs(stack->middle[1])) * stack->unit;
  for (size_t j = 0; j < contour->space.b.count; j++) {
    const double *p = contour->points + 2 * (j % contour->space.count);
    points[3 * j] = p[0];
    points[3 * j + 1] = p[1];
    points[3 * j + 2] = ROUNDED * (stack->size + far);
  }
}

static batten_status derivatives_make(batten_context *ctx, const loft_stack *stack, const loft_contour *contour,
                                      const loft_space *to, derivatives *out) {
  const bspline *own = &contour->space.b;
  unsigned d = own->degree;
  size_t legs = loft_legs(to), vertices = loft_vertices(to);
  const bspline own_first = {d - 1, own->count - 1, own->knots + 1};
  const bspline own_second = {d - 2, own->count - 2, own->knots + 2};
  const bspline to_first = {d - 1, legs, to->knots + 1}, to_second = {d - 2, vertices, to->knots + 2};
  batten_status st = BATTEN_E_NOMEM;
  derivatives result = {0};
  double *points = batten_alloc_array(ctx, own->count, 6 * sizeof *points);
  result.first = batten_alloc_array(ctx, legs, 3 * sizeof *result.first);
  result.second = batten_alloc_array(ctx, vertices, 3 * sizeof *result.second);
  if (!points || !result.first || !result.second) goto done;
  double *tangents = points + 3 * own->count;
  unroll(stack, contour, points);
  differentiate(d, own_first.count, own->knots + 1, points, tangents);
  refine(&own_first, tangents, &to_first, result.first);
  differentiate(d - 1, own_second.count, own->knots + 2, tangents, points);
  refine(&own_second, points, &to_second, result.second);
  for (size_t v = 0; v < legs; v++) {
    const double *x = result.first + 3 * v;
    result.speed += hypot(x[0], x[1]) * loft_interval(to, (ptrdiff_t)v) / d;
  }
  *out = result;
  result = (derivatives){0};
  st = BATTEN_OK;
done:
  derivatives_free(ctx, &result);
  batten_free(ctx, points);
  return st;
}

/* ---- legs ---------------------------------------------------------------------------------------- */

static size_t leg_after(const loft_space *s, size_t v) { return v + 1 == loft_legs(s) ? 0 : v + 1; }

/* To (-pi, pi]. */
static double least_turn(double angle) {
  double turn = remainder(angle, 2 * PI);
  return turn <= -PI ? PI : turn;
}

/* Angles go on along the polygon by the least turn from one leg that is not 0 to the next. */
static void set_legs(const derivatives *d, const loft_space *space, double *angle, double *length) {
  double last = NAN;
  for (size_t v = 0; v < loft_legs(space); v++) {
    const double *x = d->first + 3 * v;
    double speed = hypot(x[0], x[1]), direction = atan2(x[1], x[0]);
    length[v] = speed * loft_interval(space, (ptrdiff_t)v) / space->degree;
    angle[v] = NAN;
    if (!(speed > x[2])) continue;
    angle[v] = isnan(last) ? direction : direction + 2 * PI * rint((last - direction) / (2 * PI));
    last = angle[v];
  }
}

/* Turns the upper polygon by whole turns so that the way from the lower one is shortest on the mean over legs: the
 * first leg alone may have turned by more than others and lead all of them the long way round. */
static void turn_back(loft_slab *slab) {
  double sum = 0, weight = 0;
  size_t legs = loft_legs(&slab->space);
  for (size_t v = 0; v < legs; v++) {
    double turn = slab->angle[1][v] - slab->angle[0][v], length = slab->length[0][v] + slab->length[1][v];
    if (isnan(turn)) continue;
    sum += length * turn;
    weight += length;
  }
  if (!(weight > 0)) return;
  double whole = 2 * PI * rint(sum / weight / (2 * PI));
  for (size_t v = 0; v < legs; v++) slab->angle[1][v] -= whole;
}

double loft_turn(const loft_slab *slab, unsigned end, size_t v) {
  const double *angle = slab->angle[end];
  return least_turn(angle[leg_after(&slab->space, v)] - angle[v]);
}

/* ---- signs --------------------------------------------------------------------------------------- */

static int turn_of(const derivatives *d, size_t v) {
  const double *a = d->first + 3 * v, *c = d->second + 3 * v;
  double speed = hypot(a[0], a[1]), bend = hypot(c[0], c[1]), straight = STRAIGHT * d->speed;
  if (c[2] <= UNTOLD * d->speed && bend <= fmax(c[2], straight)) return TURN_NONE;
  double across = loft_cross(a, c) / speed; /* NaN: no leg, no turn */
  if (speed > a[2] && fabs(across) > c[2] + bend * a[2] / speed && fabs(across) > straight)
    return across > 0 ? 1 : -1;
  return TURN_UNKNOWN;
}

/* Whether break t of the lower contour is a flat point that the upper one has too. */
static bool is_flat_at(const loft_contour *contour, double t) {
  size_t low = 0, high = contour->space.spans;
  while (low < high) {
    size_t middle = low + (high - low) / 2;
    if (contour->space.breaks[middle] < t)
      low = middle + 1;
    else
      high = middle;
  }
  return contour->space.breaks[low] == t && contour->flat_above[low];
}

/* Control point v of x'' is x'' itself at a knot that is degree - 2 fold. */
static bool is_flat(const loft_contour *lower, const loft_space *space, size_t v) {
  if (space->degree < 3) return false;
  double t = space->knots[v + 3];
  if (t != space->knots[v + space->degree]) return false;
  return is_flat_at(lower, space->closed && t > 1 ? t - 1 : t);
}

static signed char wanted_of(const loft_contour *lower, const loft_space *space, const derivatives d[2], size_t v) {
  if (is_flat(lower, space, v)) return LOFT_FLAT;
  int turns[2] = {turn_of(&d[0], v), turn_of(&d[1], v)};
  if (turns[0] != turns[1] || turns[0] == TURN_UNKNOWN) return LOFT_FREE;
  return turns[0] == TURN_NONE ? (signed char)LOFT_FLAT : (signed char)turns[0];
}

batten_status loft_vertices_make(batten_context *ctx, const loft_stack *stack, size_t i, loft_slab *slab) {
  const loft_space *space = &slab->space;
  size_t legs = loft_legs(space), vertices = loft_vertices(space);
  batten_status st = BATTEN_E_NOMEM;
  derivatives d[2] = {{0}, {0}};
  slab->wanted = batten_alloc_array(ctx, vertices, sizeof *slab->wanted);
  if (!slab->wanted) return st;
  for (size_t e = 0; e < 2; e++) {
    slab->angle[e] = batten_alloc_array(ctx, legs, sizeof *slab->angle[e]);
    slab->length[e] = batten_alloc_array(ctx, legs, sizeof *slab->length[e]);
    st = BATTEN_E_NOMEM;
    if (!slab->angle[e] || !slab->length[e]) goto done;
    st = derivatives_make(ctx, stack, &stack->contours[i + e], space, &d[e]);
    if (st < 0) goto done;
    set_legs(&d[e], space, slab->angle[e], slab->length[e]);
  }
  turn_back(slab);
  for (size_t v = 0; v < vertices; v++) slab->wanted[v] = wanted_of(&stack->contours[i], space, d, v);
done:
  derivatives_free(ctx, &d[1]);
  derivatives_free(ctx, &d[0]);
  return st;
}
