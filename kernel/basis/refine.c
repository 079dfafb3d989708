/* The same curve in a larger spline space.   [Ramshaw: Blossoming; Prautzsch]
 *
 * Control point j over the knots u' is the blossom at u'_(j + 1) .. u'_(j + d). Among these arguments the knots that
 * the old curve has too are consecutive ones of it, t_(i + 1) .. t_(i + m), and all the others lie between t_i and
 * t_(i + m + 1). So the old control points whose arguments contain all of these, i + m - d .. i, and d - m rounds of
 * de Boor's triangle for the others give it, by convex combinations throughout; m = d copies a point.
 *
 * To a degree d + e: the blossom at d + e arguments is the mean, over all choices of d among them, of the old one. As
 * every knot has become e times more frequent, what is left of u' when e knots are left out still refines the old
 * knots: each term is a control point as above. */
#include "refine.h"

#include <assert.h>
#include <stdbool.h>

enum { DIM_MAX = 3 };

/* Knots below x, from a place on where all before it are: both rise together in a walk over rising x. */
static size_t count_below(const bspline *b, size_t from, double x) {
  size_t all = b->count + b->degree + 1;
  while (from < all && b->knots[from] < x) from++;
  return from;
}

static size_t count_up_to(const bspline *b, size_t from, double x) {
  size_t all = b->count + b->degree + 1;
  while (from < all && b->knots[from] <= x) from++;
  return from;
}

/* Rounds of the triangle: work [at most BSPLINE_ORDER][dim] holds control points first .. first + rounds; the knots
 * that point q - 1 and point q do not share are t_q and t_(q + d), and each round takes one off the upper end. */
static void run_rounds(const bspline *b, unsigned dim, size_t first, unsigned rounds, const double *arguments,
                       double *work) {
  for (unsigned round = 0; round < rounds; round++)
    for (unsigned k = 0; k + round < rounds; k++) {
      size_t right = first + k + 1 + b->degree, left = first + k + 1 + round;
      double start = b->knots[left], part = (arguments[round] - start) / (b->knots[right] - start);
      for (unsigned x = 0; x < dim; x++)
        work[k * dim + x] = bspline_blend(work[k * dim + x], work[(k + 1) * dim + x], part);
    }
}

/* What stands around the arguments of a new control point: of the old knots those up to the new knot before them, of
 * which `low` equal it, and those below the new knot behind them, of which `high` are equal to that. */
typedef struct surroundings {
  double before, behind;
  size_t up_to, low, below, high;
} surroundings;

/* The walk on to new control point j; from one to the next all rise. */
typedef struct walk {
  surroundings at;
  size_t below_before, up_to_behind;
} walk;

static void step(const bspline *from, const bspline *to, size_t j, walk *w) {
  surroundings *s = &w->at;
  s->before = to->knots[j];
  s->behind = to->knots[j + to->degree + 1];
  w->below_before = count_below(from, w->below_before, s->before);
  s->up_to = count_up_to(from, s->up_to, s->before);
  s->below = count_below(from, s->below, s->behind);
  w->up_to_behind = count_up_to(from, w->up_to_behind, s->behind);
  s->low = s->up_to - w->below_before;
  s->high = w->up_to_behind - s->below;
}

/* Of arguments [degree] in rising order those that are no knots of the old curve: fresh. Returns how many, and the
 * first of the one more old control points that the blossom there is made of. */
static unsigned find_fresh(const bspline *from, const surroundings *s, const double *arguments,
                           double fresh[BSPLINE_DEGREE], size_t *first) {
  unsigned d = from->degree;
  size_t low = 0, high = 0;
  for (unsigned k = 0; k < d; k++) {
    low += arguments[k] == s->before;
    high += arguments[k] == s->behind;
  }
  /* Old ones among the arguments: of several equal knots at the sides those that are nearest. */
  size_t start = s->up_to - (low < s->low ? low : s->low), end = s->below + (high < s->high ? high : s->high);
  unsigned rounds = 0;
  size_t next = start;
  for (unsigned k = 0; k < d; k++) {
    if (next < end && arguments[k] == from->knots[next])
      next++;
    else
      fresh[rounds++] = arguments[k];
  }
  assert(next == end);
  assert(start > rounds && start - 1 < from->count);
  *first = start - 1 - rounds; /* i + m - d, as t_(i + 1) is knot `start` and m = d - rounds */
  return rounds;
}

/* The blossom of the old curve at arguments [degree] in rising order. */
static void insert(const bspline *from, unsigned dim, const double *points, const surroundings *s,
                   const double *arguments, double *out) {
  double fresh[BSPLINE_DEGREE], work[BSPLINE_ORDER * DIM_MAX];
  size_t first;
  unsigned rounds = find_fresh(from, s, arguments, fresh, &first);
  for (unsigned k = 0; k < (rounds + 1) * dim; k++) work[k] = points[first * dim + k];
  run_rounds(from, dim, first, rounds, fresh, work);
  for (unsigned x = 0; x < dim; x++) out[x] = work[x];
}

/* The next choice of `size` out of `count` in lexicographic order; false after the last one. */
static bool next_choice(unsigned count, unsigned size, unsigned *choice) {
  unsigned at = size;
  while (at > 0 && choice[at - 1] == count - size + at - 1) at--;
  if (at == 0) return false;
  choice[at - 1]++;
  for (unsigned k = at; k < size; k++) choice[k] = choice[k - 1] + 1;
  return true;
}

/* The mean over all choices of from->degree arguments out of those [degree]. As a first value and the mean difference
 * from it: where all are equal the result is, too. */
static void insert_mean(const bspline *from, unsigned dim, const double *points, const surroundings *s,
                        unsigned degree, const double *arguments, double *out) {
  unsigned d = from->degree, choice[BSPLINE_DEGREE], count = 0;
  double some[BSPLINE_DEGREE], value[DIM_MAX], sum[DIM_MAX] = {0};
  for (unsigned k = 0; k < d; k++) choice[k] = k;
  bool all_equal = arguments[0] == arguments[degree - 1];
  do {
    for (unsigned k = 0; k < d; k++) some[k] = arguments[choice[k]];
    insert(from, dim, points, s, some, count == 0 ? out : value);
    for (unsigned x = 0; x < dim && count > 0; x++) sum[x] += value[x] - out[x];
    count++;
  } while (!all_equal && next_choice(degree, d, choice));
  for (unsigned x = 0; x < dim; x++) out[x] += sum[x] / count;
}

void bspline_refine(const bspline *from, unsigned dim, const double *points, const bspline *to, double *out) {
  assert(from->degree >= 1 && to->degree <= BSPLINE_DEGREE && from->degree <= to->degree && dim <= DIM_MAX);
  walk w = {.below_before = 0};
  for (size_t j = 0; j < to->count; j++) {
    step(from, to, j, &w);
    insert_mean(from, dim, points, &w.at, to->degree, to->knots + j + 1, out + j * dim);
  }
}

void bspline_insertion(const bspline *from, const bspline *to, size_t *first, double *rows) {
  unsigned d = from->degree;
  assert(d >= 1 && to->degree == d && d <= BSPLINE_DEGREE);
  walk w = {.below_before = 0};
  for (size_t j = 0; j < to->count; j++, rows += d + 1) {
    double fresh[BSPLINE_DEGREE];
    step(from, to, j, &w);
    unsigned rounds = find_fresh(from, &w.at, to->knots + j + 1, fresh, &first[j]);
    for (unsigned k = 0; k <= d; k++) rows[k] = k == 0;
    /* The triangle from its tip: each round hands the weights of what it makes to what it is made of. */
    for (unsigned round = rounds; round-- > 0;)
      for (unsigned k = rounds - round; k-- > 0;) {
        size_t right = first[j] + k + 1 + d, left = first[j] + k + 1 + round;
        double start = from->knots[left], part = (fresh[round] - start) / (from->knots[right] - start);
        rows[k + 1] += part * rows[k];
        rows[k] *= 1 - part;
      }
  }
}

void bspline_blossom(const bspline *b, unsigned dim, const double *points, size_t mu, const double *arguments,
                     double *out) {
  unsigned d = b->degree;
  double work[BSPLINE_ORDER * DIM_MAX];
  assert(d <= BSPLINE_DEGREE && dim <= DIM_MAX);
  for (unsigned k = 0; k < (d + 1) * dim; k++) work[k] = points[(mu - d) * dim + k];
  run_rounds(b, dim, mu - d, d, arguments, work);
  for (unsigned x = 0; x < dim; x++) out[x] = work[x];
}
