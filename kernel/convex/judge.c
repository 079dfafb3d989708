/* Noise, or a dent: do the data themselves bend inwards somewhere?
 *
 * The domain is parted into squares of several sizes, shifted by halves. Of three squares in a row (along u, v or a
 * diagonal) with means m_1, m_0, m_2 of their points, m_0 lies outside the chord from m_1 to m_2 where the data are
 * those of a convex surface: up to noise, whose means over n points have the deviation s / sqrt(n), n = (sum of
 * weights)^2 / sum of their squares where these are not even. How far m_0 lies inside, in deviations of that
 * difference, tells how sure a dent is. The largest over all triples is the misfit. It asks nothing of the space of
 * surfaces: what that cannot follow is no dent, and a dent that it cannot follow is one.
 *
 * The convex surface serves as a datum: the means are those of the points' distances along its outward normal, the
 * rise of its own points over their chord is added. The noise s is the median deviation about the means of small
 * squares, which dents and slopes of the residual hardly touch. Points whose place is on the border may lie beyond
 * it, where the surface is not; they are left out. */
#include "fit_inner.h"

#include "base/checked.h"
#include "basis/quantile.h"
#include "mesh/vec.h"

#include <string.h>

/* 6 deviations: noise does that once in a billion triples. */
static const double MISFIT = 6;
/* Between two and three points of even weight: from three on a square has a mean. */
static const double FEWEST = 2.5;
/* A row with a square of fewer counts so much less: a single point may be an outlier of a noise that has more of them
 * than the normal distribution. It still shows a dent of few points that is far deeper than the noise. */
static const double FEW = 0.5;
/* How far the middle one of three may lie beside the chord, of its length. */
static const double BESIDE = 0.05;
/* 36 = MISFIT^2: more points of a square count as 36, so that a dent below the noise itself, which matters to nobody,
 * is not one however many points make it sure. */
enum { LEVELS = 5, COUNTED = 36, TYPICAL = 6, DIRECTIONS = 4 };

typedef struct square {
  double weight, weights, sum, squares, place[2]; /* of weights, their squares, of distances, of places */
} square;

typedef struct scan {
  const convex_space *space;
  const double *control;
  size_t count;
  const double *weights, *places;
  const double *heights; /* [count] outwards */
  double noise;
  square *squares;         /* [(2^LEVELS + 1)^2] */
  weighted_sample *spread; /* likewise: of noise in squares */
  double misfit, depth;    /* of the worst triple, in deviations and in length */
  unsigned level;          /* and where its middle is */
  int shift[2];
  size_t at;
} scan;

/* 0 of points that are left out. */
static double weight_of(const scan *s, size_t i) {
  const double *place = s->places + 2 * i;
  bool inner = place[0] > 0 && place[0] < 1 && place[1] > 0 && place[1] < 1;
  return !inner ? 0 : s->weights ? s->weights[i] : 1;
}

/* How many points of even weight have a mean as sure. */
static double points_of(const square *q) { return q->weight > 0 ? q->weight * q->weight / q->weights : 0; }

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

static void fill_squares(scan *s, unsigned level, const int *shift) {
  size_t side = ((size_t)1 << level) + 1;
  memset(s->squares, 0, side * side * sizeof *s->squares);
  for (size_t i = 0; i < s->count; i++) {
    double weight = weight_of(s, i);
    if (!(weight > 0)) continue;
    square *q = &s->squares[square_of(s->places + 2 * i, level, shift)];
    q->weight += weight;
    q->weights += weight * weight;
    q->sum += weight * s->heights[i];
    q->squares += weight * s->heights[i] * s->heights[i];
    for (size_t k = 0; k < 2; k++) q->place[k] += weight * s->places[2 * i + k];
  }
}

/* The median over squares of some TYPICAL points of what their points deviate from their mean. */
static double find_noise(scan *s) {
  unsigned level = 0;
  size_t used = 0;
  fill_squares(s, 0, (const int[2]){0, 0});
  while (level < LEVELS && points_of(&s->squares[0]) > TYPICAL * ldexp(1, 2 * (int)level + 2)) level++;
  size_t side = ((size_t)1 << level) + 1;
  fill_squares(s, level, (const int[2]){0, 0});
  for (size_t k = 0; k < side * side; k++) {
    const square *q = &s->squares[k];
    double n = points_of(q);
    if (n < FEWEST) continue;
    double mean = q->sum / q->weight, freedom = n - 1;
    double variance = fmax(q->squares / q->weight - mean * mean, 0) * n / freedom;
    /* the median of chi-squared is below its mean */
    s->spread[used++] = (weighted_sample){variance / pow(1 - 2 / (9 * freedom), 3), 1};
  }
  return used ? sqrt(weighted_quantile(used, s->spread, 0.5)) : INFINITY;
}

/* How far the surface rises over the chord between two places, at part b of it, outwards. */
static double rise_over_chord(const scan *s, const double *from, const double *to, double b) {
  double ends[2][6][3], middle[6][3], normal[3], d[3];
  double place[2] = {(1 - b) * from[0] + b * to[0], (1 - b) * from[1] + b * to[1]};
  convex_jet(s->space, s->control, from, ends[0]);
  convex_jet(s->space, s->control, to, ends[1]);
  convex_jet(s->space, s->control, place, middle);
  vec_cross(middle[1], middle[2], normal);
  vec_normalize(normal);
  for (int k = 0; k < 3; k++) d[k] = middle[0][k] - (1 - b) * ends[0][0][k] - b * ends[1][0][k];
  return vec_dot(middle[3], normal) > 0 ? -vec_dot(d, normal) : vec_dot(d, normal);
}

static double variance_of(const square *q) { return 1 / fmin(points_of(q), COUNTED); }

/* How far the middle one of three lies inside the chord of the others; negative outside. *deviation: of noise there.
 */
static double inside_chord(const scan *s, const square *one, const square *middle, const square *two,
                           double *deviation) {
  double from[2], to[2], at[2], along = 0, length = 0, away = 0;
  for (int k = 0; k < 2; k++) {
    from[k] = one->place[k] / one->weight;
    to[k] = two->place[k] / two->weight;
    at[k] = middle->place[k] / middle->weight;
    along += (at[k] - from[k]) * (to[k] - from[k]);
    length += (to[k] - from[k]) * (to[k] - from[k]);
    away += (at[k] - from[k]) * (at[k] - from[k]);
  }
  double b = along / length;
  /* The means must be a row: beside the chord, what the surface does not follow of the data has another height. */
  bool row = b > 0.2 && b < 0.8 && away - b * along <= BESIDE * BESIDE * length;
  if (!row) return -INFINITY;
  double rise = middle->sum / middle->weight - (1 - b) * one->sum / one->weight - b * two->sum / two->weight;
  double variance = variance_of(middle) + (1 - b) * (1 - b) * variance_of(one) + b * b * variance_of(two);
  *deviation = s->noise * sqrt(variance);
  if (-rise <= s->misfit * *deviation) return -INFINITY; /* the surface's own rise only makes it less */
  return -rise - rise_over_chord(s, from, to, b);
}

static void scan_level(scan *s, unsigned level, const int *shift) {
  static const int steps[DIRECTIONS][2] = {{1, 0}, {0, 1}, {1, 1}, {1, -1}};
  size_t side = ((size_t)1 << level) + 1;
  fill_squares(s, level, shift);
  for (size_t i = 0; i < side; i++)
    for (size_t j = 0; j < side; j++)
      for (int d = 0; d < DIRECTIONS; d++) {
        bool inner = (!steps[d][0] || (i > 0 && i + 1 < side)) && (!steps[d][1] || (j > 0 && j + 1 < side));
        if (!inner) continue;
        const square *q = &s->squares[i * side + j];
        ptrdiff_t step = steps[d][0] * (ptrdiff_t)side + steps[d][1];
        double fewest = fmin(points_of(q), fmin(points_of(q - step), points_of(q + step)));
        if (!(fewest > 0)) continue;
        double deviation = 1, depth = inside_chord(s, q - step, q, q + step, &deviation);
        double misfit = (fewest < FEWEST ? FEW : 1) * depth / deviation;
        if (!(misfit > s->misfit)) continue;
        s->misfit = misfit;
        s->depth = depth;
        s->level = level;
        memcpy(s->shift, shift, sizeof s->shift);
        s->at = i * side + j;
      }
}

/* Distances along the outward normal. */
static void measure_heights(const scan *s, const double *points, double *heights) {
  for (size_t i = 0; i < s->count; i++) {
    double jet[6][3], normal[3], d[3];
    convex_jet(s->space, s->control, s->places + 2 * i, jet);
    vec_cross(jet[1], jet[2], normal);
    vec_normalize(normal);
    vec_sub(points + 3 * i, jet[0], d);
    heights[i] = vec_dot(jet[3], normal) > 0 ? -vec_dot(d, normal) : vec_dot(d, normal);
  }
}

/* The points of the middle square, and the deepest. */
static void describe(const scan *s, convex_verdict *v) {
  double deepest = -INFINITY;
  v->depth = s->depth;
  for (size_t i = 0; i < s->count; i++) {
    if (!(weight_of(s, i) > 0) || square_of(s->places + 2 * i, s->level, s->shift) != s->at) continue;
    v->points++;
    if (!(-s->heights[i] > deepest)) continue;
    deepest = -s->heights[i];
    v->worst = i;
  }
}

batten_status convex_judge(batten_context *ctx, const convex_space *space, size_t count, const double *points,
                           const double *weights, const convex_track *convex, convex_verdict *out) {
  size_t side = ((size_t)1 << LEVELS) + 1;
  convex_verdict v = {0};
  double *heights = batten_alloc_array(ctx, count, sizeof *heights);
  scan s = {.space = space, .control = convex->control, .count = count, .weights = weights};
  s.places = convex->parameters;
  s.heights = heights;
  s.squares = batten_alloc_array(ctx, side * side, sizeof *s.squares);
  s.spread = batten_alloc_array(ctx, side * side, sizeof *s.spread);
  batten_status st = heights && s.squares && s.spread ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0) {
    measure_heights(&s, points, heights);
    s.noise = fmax(find_noise(&s), CONVEX_EVEN);
    for (unsigned level = 1; level <= LEVELS; level++)
      for (int shift = 0; shift < 4; shift++) scan_level(&s, level, (const int[2]){shift % 2, shift / 2});
    v.misfit = s.misfit;
    v.dent = s.misfit > MISFIT;
    if (v.dent) describe(&s, &v);
    *out = v;
  }
  batten_free(ctx, s.spread);
  batten_free(ctx, s.squares);
  batten_free(ctx, heights);
  return st;
}
