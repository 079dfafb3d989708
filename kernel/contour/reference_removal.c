/* Construction 2: least squares on as many of the knots as leave the wanted signs.   [Juettler: contour data, section
 * 2.2 (i)]
 *
 * Where spans bend to the wrong side, knots are removed there until none does. Inflections stay, and for smoothness 2
 * one knot more between two of them: a cubic without is straight there.
 *
 * Departures from the paper, which deletes "systematically". Its one knot at a time with a fit for each candidate
 * would cost the square of their number. Here every group of neighbouring wrong spans gives up half of its knots at
 * once, those at which the jump of the highest derivative moves the curve least, so that there are about as many fits
 * as the logarithm of the number of knots. Where no knot is left to remove, tension grows. And spans count as wrong
 * already when x'' is nearly parallel to x': linear inequalities could not enclose the curve there. */
#include "reference.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/checked.h"

/* 64: fits; some ten are common. Tension grows by 8 up to TENSION_MOST: that is near to a straight line. */
enum { FITS = 64, TENSION_FACTOR = 8, CLOSED_SPANS = 4 };
static const double tension_first = 1e-9, tension_most = 1e-3;
/* Least sines of the angle from x' to x'' that pass: at first, and where inequalities refuse what has passed. */
static const double sine_first = 0.04, sine_most = 0.5;

typedef struct candidate {
  size_t at; /* break of the subset */
  double cost;
} candidate;

typedef struct removal {
  const reference_task *task;
  size_t spans;          /* of the subset */
  size_t *kept;          /* [spans + 1] breaks of the shape */
  double *breaks;        /* [spans + 1] */
  signed char *signs;    /* [spans] */
  bool *drop;            /* [spans + 1] */
  double *quality;       /* [spans] */
  candidate *candidates; /* [spans + 1] */
  unsigned degree;
  double tension, sine;
} removal;

static contour_shape subset(const removal *r) {
  contour_shape s = *r->task->shape;
  s.spans = r->spans;
  s.breaks = r->breaks;
  s.signs = r->signs;
  s.degree = r->degree;
  return s;
}

/* The subset without the breaks that drop names. */
static void shrink(removal *r) {
  const contour_shape *shape = r->task->shape;
  size_t to = 0;
  for (size_t i = 0; i <= r->spans; i++)
    if (!r->drop[i]) r->kept[to++] = r->kept[i];
  r->spans = to - 1;
  for (size_t i = 0; i <= r->spans; i++) {
    r->breaks[i] = shape->breaks[r->kept[i]];
    if (i < r->spans) r->signs[i] = shape->signs[r->kept[i]];
    r->drop[i] = false;
  }
}

/* How far the curve moves, about, when break i of the subset goes: the jump of the highest derivative there. */
static double cost_of(const removal *r, const bspline *b, const double *control, size_t i) {
  double rows[BSPLINE_ORDER], jump[2] = {0, 0};
  unsigned d = b->degree, fold = d - r->task->shape->smoothness;
  size_t mu = d + i * fold; /* the span right of the break */
  double left = r->breaks[i] - r->breaks[i - 1], right = r->breaks[i + 1] - r->breaks[i];
  for (int side = 0; side < 2; side++) {
    size_t span = side ? mu : mu - fold;
    bspline_rows(b, span, d, b->knots[span], b->knots[span + 1], rows);
    for (unsigned j = 0; j <= d; j++)
      for (unsigned k = 0; k < 2; k++) jump[k] += (side ? 1 : -1) * rows[j] * control[2 * (span - d + j) + k];
  }
  return hypot(jump[0], jump[1]) * pow(left * right / (left + right), d);
}

static int by_cost(const void *x, const void *y) {
  const candidate *a = x, *b = y;
  if (a->cost != b->cost) return a->cost < b->cost ? -1 : 1;
  return a->at < b->at ? -1 : a->at > b->at;
}

/* Whether break i may go: it is no inflection, and its run keeps what it needs with those that stay. left: the next
 * break below that stays. */
static bool removable(const removal *r, const contour_shape *s, size_t i, size_t spans_left) {
  if (i == 0 || i == s->spans || contour_inflection(s, i)) return false;
  if (s->closed && spans_left <= CLOSED_SPANS) return false;
  if (s->smoothness == 1 || r->degree > 3) return true;
  size_t a = i, b = i;
  do a--;
  while (r->drop[a]);
  do b++;
  while (r->drop[b]);
  return !(contour_inflection(s, a) && contour_inflection(s, b));
}

/* Marks half of the knots of every group of wrong spans. The number that go. */
static size_t mark(removal *r, const bspline *b, const double *control) {
  contour_shape s = subset(r);
  size_t gone = 0;
  for (size_t from = 0; from < s.spans; from++) {
    if (r->quality[from] >= r->sine) continue;
    size_t to = from, count = 0;
    while (to < s.spans && r->quality[to] < r->sine) to++;
    for (size_t i = from; i <= to; i++)
      if (removable(r, &s, i, s.spans - gone)) r->candidates[count++] = (candidate){i, cost_of(r, b, control, i)};
    qsort(r->candidates, count, sizeof *r->candidates, by_cost);
    size_t wanted = (count + 1) / 2;
    for (size_t k = 0; k < count && wanted > 0; k++)
      if (removable(r, &s, r->candidates[k].at, s.spans - gone)) {
        r->drop[r->candidates[k].at] = true;
        gone++;
        wanted--;
      }
    from = to;
  }
  return gone;
}

/* A fit on the subset: *done = true when control is a reference. Else the next subset, or more tension; *stuck when
 * there is nothing left to try. */
static batten_status try_subset(batten_context *ctx, removal *r, double *control, bool *done, bool *stuck) {
  const reference_task *task = r->task;
  contour_shape s = subset(r);
  contour_space space = {0};
  contour_objective objective = {0};
  double *fit = NULL;
  batten_status st = contour_space_make(ctx, &s, r->degree, s.smoothness == 2, task->ends, &space);
  if (st == BATTEN_E_INVALID) { /* too few spans for the ends */
    *stuck = true;
    return BATTEN_OK;
  }
  if (st < 0) return st;
  size_t wrong = 0;
  fit = batten_alloc_array(ctx, 2 * space.b.count, sizeof *fit);
  st = fit ? contour_objective_new(ctx, &space.b, &objective) : BATTEN_E_NOMEM;
  if (st >= 0) {
    contour_objective_set(&objective, task->data, task->parameters, r->tension);
    st = contour_objective_solve(ctx, &objective, &space, fit);
  }
  bool solved = st >= 0;
  st = batten_expect(ctx, st, BATTEN_E_SINGULAR);
  if (st < 0) goto done;
  if (solved) {
    reference_assess(&s, &space.b, fit, r->quality);
    for (size_t i = 0; i < s.spans; i++) wrong += r->quality[i] < r->sine;
    if (wrong == 0) st = reference_accept(ctx, task, &space.b, fit, control, done);
    if (st < 0 || *done) goto done;
    if (wrong == 0 && r->sine < sine_most) { /* what was refused is in the spans that bend least clearly */
      r->sine *= 2;
      goto done;
    }
    if (mark(r, &space.b, fit) > 0) {
      shrink(r);
      goto done;
    }
  }
  *stuck = r->tension >= tension_most;
  r->tension = fmax(tension_first, TENSION_FACTOR * r->tension);
done:
  batten_free(ctx, fit);
  contour_objective_free(ctx, &objective);
  contour_space_free(ctx, &space);
  return st;
}

/* All knots, and the first tension. */
static void start(removal *r, unsigned degree) {
  r->degree = degree;
  r->spans = r->task->shape->spans;
  r->tension = r->task->tension;
  r->sine = sine_first;
  for (size_t i = 0; i <= r->spans; i++) {
    r->kept[i] = i;
    r->drop[i] = false;
  }
  shrink(r);
}

batten_status reference_by_removal(batten_context *ctx, const reference_task *task, double *control, double *sum) {
  size_t n = task->shape->spans + 1;
  removal r = {.task = task};
  r.kept = batten_alloc_array(ctx, n, sizeof *r.kept);
  r.breaks = batten_alloc_array(ctx, n, sizeof *r.breaks);
  r.signs = batten_alloc_array(ctx, n, sizeof *r.signs);
  r.drop = batten_alloc_array(ctx, n, sizeof *r.drop);
  r.quality = batten_alloc_array(ctx, n, sizeof *r.quality);
  r.candidates = batten_alloc_array(ctx, n, sizeof *r.candidates);
  bool all = r.kept && r.breaks && r.signs && r.drop && r.quality && r.candidates, found = false;
  batten_status st = all ? BATTEN_OK : BATTEN_E_NOMEM;
  *sum = INFINITY;
  for (unsigned degree = task->degree; st >= 0 && !found; degree++) {
    if (degree > task->shape->degree || degree > task->degree + REFERENCE_MORE_DEGREES) break;
    bool stuck = false;
    start(&r, degree);
    for (int fit = 0; st >= 0 && !found && !stuck && fit < FITS; fit++) {
      st = batten_progress(ctx, "reference", 0.5 * fit / FITS);
      if (st >= 0) st = try_subset(ctx, &r, control, &found, &stuck);
    }
  }
  if (st >= 0 && found) *sum = contour_sum(&task->space->b, control, task->data, task->parameters);
  batten_free(ctx, r.candidates);
  batten_free(ctx, r.quality);
  batten_free(ctx, r.drop);
  batten_free(ctx, r.signs);
  batten_free(ctx, r.breaks);
  batten_free(ctx, r.kept);
  return st;
}
