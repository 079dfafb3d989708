/* Parameter correction: every point goes to a nearer place of the curve.   [Hoschek, Lasser 1993]
 *
 * A step is Newton's for half the squared distance; where that has no minimum Gauss and Newton's, or as long as the
 * curvature of the square says. It is halved until the distance drops, or not made. It may lead into other spans; the
 * ends of open curves hold points that are beyond them, closed curves go round.
 *
 * The first and last points of open curves stay at the ends. Were they free, no point would hold an end: each round
 * they might go farther inside, and the curve run on beyond the data. */
#include "contour_inner.h"

#include "base/checked.h"

#include <string.h>

enum { HALVINGS = 6, CHUNK = 512 }; /* points of a task: some 100 us */

typedef struct job {
  const bspline *space;
  const double *control;
  const contour_data *data;
  unsigned passes;
  bool closed;
  size_t first, last; /* points that count */
  double *parameters, *squares;
} job;

/* The span of t, from one that is near: places of neighbours are. */
static size_t walk(const bspline *b, size_t mu, double t) {
  const double *u = b->knots;
  for (unsigned steps = 0; steps < 4; steps++) {
    if (t < u[mu]) {
      do mu--;
      while (mu > b->degree && !(u[mu] < u[mu + 1]));
      if (mu <= b->degree) return bspline_span(b, t);
    } else if (t >= u[mu + 1] && mu + 1 < b->count) {
      size_t next = bspline_next(b, mu);
      if (next >= b->count) return mu;
      mu = next;
    } else {
      return mu;
    }
  }
  return bspline_span(b, t);
}

/* Value and two derivatives at t in span mu: de Boor's triangle, whose last rounds hold the differences. degree >= 2.
 */
static void curve_jet(const bspline *b, const double *control, size_t mu, double t, double jet[3][2]) {
  double p[BSPLINE_ORDER][2];
  unsigned d = b->degree;
  const double *u = b->knots;
  memcpy(p, control + 2 * (mu - d), (d + 1) * sizeof *p);
  for (unsigned r = 1; r <= d; r++) {
    if (r == d - 1) { /* three points of degree 2: their second difference by its knots */
      double w = u[mu + 1] - u[mu], left = u[mu + 1] - u[mu - 1], right = u[mu + 2] - u[mu];
      for (int k = 0; k < 2; k++)
        jet[2][k] = (double)d * (d - 1) * ((p[2][k] - p[1][k]) / right - (p[1][k] - p[0][k]) / left) / w;
    }
    if (r == d)
      for (int k = 0; k < 2; k++) jet[1][k] = d * (p[1][k] - p[0][k]) / (u[mu + 1] - u[mu]);
    for (unsigned i = 0; i + r <= d; i++) {
      double low = u[mu - d + i + r], part = (t - low) / (u[mu + i + 1] - low);
      for (int k = 0; k < 2; k++) p[i][k] += part * (p[i + 1][k] - p[i][k]);
    }
  }
  memcpy(jet[0], p[0], sizeof jet[0]);
}

static double square_of(double jet[3][2], const double *point, double e[2]) {
  for (int k = 0; k < 2; k++) e[k] = jet[0][k] - point[k];
  return e[0] * e[0] + e[1] * e[1];
}

/* Where a step leads: round the closed curve, or no farther than an end. */
static double place_of(const job *j, double t) {
  if (!j->closed) return fmin(fmax(t, 0), 1);
  t -= floor(t);
  return t < 1 ? t : 0; /* of a step below 0 by less than rounding */
}

static double newton_step(double jet[3][2], const double e[2]) {
  double slope = e[0] * jet[1][0] + e[1] * jet[1][1];
  double gauss = jet[1][0] * jet[1][0] + jet[1][1] * jet[1][1];
  double newton = gauss + e[0] * jet[2][0] + e[1] * jet[2][1];
  double curve = newton > 0.1 * gauss ? newton : fmax(gauss, -newton);
  return curve > 0 ? -slope / curve : 0;
}

/* Whether point i is to stay: the first and the last that count at the ends of an open curve. */
static bool held(const job *j, size_t i) {
  if (j->closed) return false;
  return (i == j->first && j->parameters[i] == 0) || (i == j->last && j->parameters[i] == 1);
}

static double correct_point(const job *j, unsigned passes, const double *point, size_t *span, double *parameter) {
  double jet[3][2], next[3][2], e[2], off[2];
  size_t mu = *span = walk(j->space, *span, *parameter);
  curve_jet(j->space, j->control, mu, *parameter, jet);
  double square = square_of(jet, point, e);
  for (unsigned pass = 0; pass < passes; pass++) {
    double step = newton_step(jet, e), there = *parameter, less = square;
    step = fmin(fmax(step, -0.5), 0.5); /* no farther than round half a closed curve */
    bool nearer = false;
    for (int k = 0; k <= HALVINGS && !nearer; k++, step /= 2) {
      there = place_of(j, *parameter + step);
      if (there == *parameter) break;
      mu = walk(j->space, *span, there);
      curve_jet(j->space, j->control, mu, there, next);
      less = square_of(next, point, off);
      nearer = less < square;
    }
    if (!nearer) break;
    square = less;
    *parameter = there;
    *span = mu;
    memcpy(jet, next, sizeof jet);
    memcpy(e, off, sizeof e);
  }
  return square;
}

static void correct_task(void *arg, size_t index) {
  const job *j = arg;
  size_t begin = index * CHUNK, end = begin + CHUNK < j->data->count ? begin + CHUNK : j->data->count;
  size_t span = bspline_span(j->space, j->parameters[begin]);
  for (size_t i = begin; i < end; i++)
    j->squares[i] = correct_point(j, held(j, i) ? 0 : j->passes, j->data->points + 2 * i, &span, j->parameters + i);
}

void contour_correct(batten_context *ctx, const bspline *space, bool closed, const double *control,
                     const contour_data *data, unsigned passes, double *parameters, double *squares) {
  job j = {space, control, data, passes, closed, 0, data->count - 1, parameters, squares};
  while (data->weights && j.first < j.last && !(data->weights[j.first] > 0)) j.first++;
  while (data->weights && j.last > j.first && !(data->weights[j.last] > 0)) j.last--;
  batten_parallel(ctx, data->count / CHUNK + (data->count % CHUNK != 0), correct_task, &j);
}
