/* Noise, or a dent: do data lie beside the convex surface together, where they lie on the unconstrained one?
 *
 * Every point has its distances from both surfaces along the convex one's normal, s_c and s_f. The deviation s of
 * noise is that of s_f, less the freedom that the control points had. Then the domain is parted into squares of all
 * sizes, shifted by halves. Noise of n points in a square has a mean of deviation s / sqrt(n); so
 *   (|mean of s_c| - |mean of s_f|) sqrt(n) / s
 * tells in deviations how surely they lie to one side of the convex surface and not of the other. The largest of all
 * squares is the misfit. What neither surface can follow raises both means and is no dent. A mean below s itself is
 * of no matter to anybody, however many points make it sure: more than 36 = MISFIT^2 points count as 36. */
#include "fit_inner.h"

#include "base/checked.h"
#include "mesh/vec.h"

#include <string.h>

/* 6 deviations: noise does that once in a billion squares. */
static const double MISFIT = 6;
/* 1e-4 of the points' size: what departs by less is flat, or a little hollow, to the eye and the hand; surfaces that
 * are only just convex, like cylinders, are fitted by strictly convex ones as well as that. */
static const double FLOOR = 1e-4;
enum { LEVELS = 6, FEWEST = 3, COUNTED = 36 };

typedef struct square {
  size_t points;
  double weight, convex, free; /* sums */
} square;

typedef struct scan {
  size_t count;
  const double *weights, *places;
  const double *sides; /* [count][2] s_c, s_f */
  double noise;
  square *squares; /* [(2^LEVELS + 1)^2] */
  double misfit;   /* of the worst square, */
  unsigned level;  /* and where that is */
  int shift[2];
  size_t at;
} scan;

/* The square of a place: 2^level in either direction, or one more where shifted by half a square. */
static size_t square_of(const double *place, unsigned level, const int *shift) {
  size_t at = 0, side = (size_t)1 << level;
  for (int k = 0; k < 2; k++) {
    size_t last = side - 1 + (size_t)shift[k];
    size_t i = (size_t)(place[k] * (double)side + 0.5 * shift[k]);
    at = at * (side + 1) + (i < last ? i : last);
  }
  return at;
}

static double weight_of(const scan *s, size_t i) { return s->weights ? s->weights[i] : 1; }

static void scan_level(scan *s, unsigned level, const int *shift) {
  size_t side = ((size_t)1 << level) + 1;
  memset(s->squares, 0, side * side * sizeof *s->squares);
  for (size_t i = 0; i < s->count; i++) {
    double weight = weight_of(s, i);
    if (!(weight > 0)) continue;
    square *q = &s->squares[square_of(s->places + 2 * i, level, shift)];
    q->points++;
    q->weight += weight;
    q->convex += weight * s->sides[2 * i];
    q->free += weight * s->sides[2 * i + 1];
  }
  for (size_t k = 0; k < side * side; k++) {
    const square *q = &s->squares[k];
    if (q->points < FEWEST) continue;
    double excess = (fabs(q->convex) - fabs(q->free)) / q->weight;
    double misfit = excess * sqrt((double)(q->points < COUNTED ? q->points : COUNTED)) / s->noise;
    if (!(misfit > s->misfit)) continue;
    s->misfit = misfit;
    s->level = level;
    memcpy(s->shift, shift, sizeof s->shift);
    s->at = k;
  }
}

/* Distances along the convex surface's normal from both. */
static void measure_sides(const convex_space *space, size_t count, const double *points, const convex_track *convex,
                          const convex_track *free, double *sides) {
  for (size_t i = 0; i < count; i++) {
    double jet[6][3], other[6][3], normal[3], d[3];
    convex_jet(space, convex->control, convex->parameters + 2 * i, jet);
    convex_jet(space, free->control, free->parameters + 2 * i, other);
    vec_cross(jet[1], jet[2], normal);
    vec_normalize(normal);
    vec_sub(points + 3 * i, jet[0], d);
    sides[2 * i] = vec_dot(d, normal);
    vec_sub(points + 3 * i, other[0], d);
    sides[2 * i + 1] = vec_dot(d, normal);
  }
}

/* Deviation of the noise; negative when there are too few points to tell. */
static double noise_of(const scan *s, double unknowns) {
  double squares = 0, weights = 0, points = 0;
  for (size_t i = 0; i < s->count; i++) {
    squares += weight_of(s, i) * s->sides[2 * i + 1] * s->sides[2 * i + 1];
    weights += weight_of(s, i);
    points += weight_of(s, i) > 0 ? 1 : 0;
  }
  return points > unknowns + 1 ? sqrt(squares / weights * points / (points - unknowns)) : -1;
}

static void describe(const scan *s, convex_verdict *v) {
  double deepest = -1, side = s->squares[s->at].convex;
  for (size_t i = 0; i < s->count; i++) {
    if (!(weight_of(s, i) > 0) || square_of(s->places + 2 * i, s->level, s->shift) != s->at) continue;
    double depth = side < 0 ? -s->sides[2 * i] : s->sides[2 * i];
    if (depth > 2 * s->noise) v->neighbours++;
    if (!(depth > deepest)) continue;
    deepest = depth;
    v->worst = i;
  }
  v->depth = deepest;
}

batten_status convex_judge(batten_context *ctx, const convex_space *space, size_t count, const double *points,
                           const double *weights, const convex_track *convex, const convex_track *free,
                           convex_verdict *out) {
  size_t side = ((size_t)1 << LEVELS) + 1;
  convex_verdict v = {0};
  batten_status st = BATTEN_E_NOMEM;
  double *sides = batten_alloc_array(ctx, 2 * count, sizeof *sides);
  scan s = {.count = count, .weights = weights, .places = convex->parameters, .sides = sides};
  s.squares = batten_alloc_array(ctx, side * side, sizeof *s.squares);
  if (!sides || !s.squares) goto done;
  st = BATTEN_OK;
  measure_sides(space, count, points, convex, free, sides);
  s.noise = noise_of(&s, (double)convex_points(space));
  bool known = s.noise >= 0;
  s.noise = fmax(s.noise, FLOOR);
  for (unsigned level = 0; level <= LEVELS && known; level++)
    for (int shift = 0; shift < 4; shift++) scan_level(&s, level, (const int[2]){shift % 2, shift / 2});
  v.misfit = s.misfit;
  v.dent = s.misfit > MISFIT;
  if (v.dent) {
    scan_level(&s, s.level, (const int[2]){s.shift[0], s.shift[1]}); /* its sums again */
    describe(&s, &v);
  }
  *out = v;
done:
  batten_free(ctx, s.squares);
  batten_free(ctx, sides);
  return st;
}
