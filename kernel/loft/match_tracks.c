/* Inflections, followed through slices.
 *
 * Partners of two neighbouring slices: pairs in order, of the same change of sign, so that
 *   sum over pairs of (distance along the slice, across it, and between the tangents, squared, each over what is
 *   usual)  +  LONELY times the inflections without a partner
 * is least: dynamic programming over both lists, as sequences are aligned. Closed slices: the second list is one
 * period of inflections that go on for ever, and may begin with any of them; so no pairs cross, however they lie
 * about the start. Partners of partners are a track. */
#include "base/checked.h"
#include "match.h"

/* What is usual between neighbours: parts of the length, of the radius, and radians. */
static const double USUAL_LENGTH = 0.04, USUAL_PLACE = 0.25, USUAL_TURN = 0.6;
static const double LONELY = 2;
static const double FAR = 0.2; /* parts of the length: never partners */

/* ---- inflections of a slice ---------------------------------------------------------------------- */

static batten_status take_bends(batten_context *ctx, const batten_contour_proposal *p, match_slice *s) {
  batten_curve_point *at = batten_alloc_array(ctx, p->inflection_count, sizeof *at);
  s->bends = batten_alloc_array(ctx, p->inflection_count, sizeof *s->bends);
  batten_status st = at && s->bends ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0) st = batten_curve_evaluate(ctx, p->smoothed, p->inflection_count, p->inflections, at);
  if (st < 0) goto done;
  s->sign = p->sign;
  s->bend_count = p->inflection_count;
  int sign = p->sign;
  for (size_t i = 0; i < s->bend_count; i++) {
    if (p->inflections[i] > 0) sign = -sign; /* at the start it is already that after it */
    match_bend *b = s->bends + i;
    *b = (match_bend){.at = p->inflections[i], .sign = sign, .before = MATCH_NONE, .after = MATCH_NONE};
    for (size_t c = 0; c < 2; c++) b->place[c] = at[i].point[c] - s->middle[c];
    b->angle = atan2(at[i].tangent[1], at[i].tangent[0]);
  }
done:
  batten_free(ctx, at);
  return st;
}

static batten_status find_bends(batten_context *ctx, const batten_contour_options *fit, size_t i, bool closed,
                                match_slice *s) {
  batten_contour_options o = batten_contour_options_default();
  batten_contour_proposal p = {0};
  o.closed = closed;
  o.parameters = s->lengths;
  o.domain[0] = 0;
  o.domain[1] = 1;
  o.weights = s->weights;
  o.significance = fit->significance;
  batten_status st = batten_contour_propose(ctx, s->count, s->points, &o, &p);
  if (st < 0) return match_fail_in(ctx, i, st);
  st = take_bends(ctx, &p, s);
  batten_contour_proposal_free(ctx, &p);
  return st;
}

/* ---- partners ------------------------------------------------------------------------------------ */

static double square(double x) { return x * x; }

/* What it costs that inflections are partners, b moved by `lift`; INFINITY: they cannot be. */
static double unlike(const match_slice *s, const match_bend *a, const match_slice *r, const match_bend *b,
                     double lift) {
  double way = b->at + lift - a->at, turn = remainder(b->angle - a->angle, 4 * acos(0));
  double radius = fmax(s->radius, r->radius);
  if (a->sign != b->sign || fabs(way) > FAR) return INFINITY;
  double across = hypot(b->place[0] - a->place[0], b->place[1] - a->place[1]) / radius;
  return square(way / USUAL_LENGTH) + square(across / USUAL_PLACE) + square(turn / USUAL_TURN);
}

typedef struct pairing {
  const match_slice *lower, *upper;
  double *least; /* [n + 1][m + 1] of the first i and the first j inflections */
} pairing;

static double *entry(const pairing *p, size_t i, size_t j) { return p->least + i * (p->upper->bend_count + 1) + j; }

/* The upper list's j-th inflection where it begins `turn` - m after its own begin, and its period. */
static size_t upper_at(const pairing *p, size_t j, size_t turn, double *lift) {
  size_t m = p->upper->bend_count, k = j + turn;
  *lift = (double)(k / m) - 1;
  return k % m;
}

static double pair_cost(const pairing *p, size_t i, size_t j, size_t turn) {
  double lift;
  size_t k = upper_at(p, j, turn, &lift);
  return unlike(p->lower, p->lower->bends + i, p->upper, p->upper->bends + k, lift);
}

/* The least sum for one begin of the upper list. */
static double fill(const pairing *p, size_t turn) {
  size_t n = p->lower->bend_count, m = p->upper->bend_count;
  for (size_t i = 0; i <= n; i++)
    for (size_t j = 0; j <= m; j++) {
      double best = i + j == 0 ? 0 : INFINITY;
      if (i > 0) best = fmin(best, *entry(p, i - 1, j) + LONELY);
      if (j > 0) best = fmin(best, *entry(p, i, j - 1) + LONELY);
      if (i > 0 && j > 0) best = fmin(best, *entry(p, i - 1, j - 1) + pair_cost(p, i - 1, j - 1, turn));
      *entry(p, i, j) = best;
    }
  return *entry(p, n, m);
}

static void trace(const pairing *p, size_t turn) {
  size_t i = p->lower->bend_count, j = p->upper->bend_count;
  while (i > 0 && j > 0) {
    double value = *entry(p, i, j);
    if (value == *entry(p, i - 1, j - 1) + pair_cost(p, i - 1, j - 1, turn)) {
      double lift;
      size_t k = upper_at(p, j - 1, turn, &lift);
      p->lower->bends[i - 1].after = k;
      p->upper->bends[k].before = i - 1;
      p->upper->bends[k].lift = lift;
      i--;
      j--;
    } else if (value == *entry(p, i - 1, j) + LONELY) {
      i--;
    } else {
      j--;
    }
  }
}

static batten_status find_partners(batten_context *ctx, const match_slice *lower, const match_slice *upper,
                                   bool closed) {
  pairing p = {lower, upper, NULL};
  size_t n = lower->bend_count, m = upper->bend_count, best_turn = m;
  double best = INFINITY;
  if (n == 0 || m == 0) return BATTEN_OK;
  p.least = batten_alloc_array(ctx, n + 1, (m + 1) * sizeof *p.least);
  if (!p.least) return BATTEN_E_NOMEM;
  for (size_t turn = closed ? 1 : m; turn < (closed ? 2 * m : m + 1); turn++) {
    double value = fill(&p, turn);
    if (value >= best) continue;
    best = value;
    best_turn = turn;
  }
  fill(&p, best_turn);
  trace(&p, best_turn);
  batten_free(ctx, p.least);
  return BATTEN_OK;
}

/* ---- tracks -------------------------------------------------------------------------------------- */

static batten_status number_tracks(batten_context *ctx, match_stack *s) {
  size_t all = 0;
  for (size_t i = 0; i < s->count; i++) all += s->slices[i].bend_count;
  s->first = batten_alloc_array(ctx, all, sizeof *s->first);
  s->last = batten_alloc_array(ctx, all, sizeof *s->last);
  s->line = batten_alloc_array(ctx, all, sizeof *s->line);
  if (!s->first || !s->last || !s->line) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < s->count; i++)
    for (size_t j = 0; j < s->slices[i].bend_count; j++) {
      match_bend *b = s->slices[i].bends + j;
      if (b->before == MATCH_NONE) {
        b->track = s->track_count++;
        b->lift = 0;
        s->first[b->track] = i;
      } else {
        const match_bend *a = s->slices[i - 1].bends + b->before;
        b->track = a->track;
        b->lift += a->lift;
      }
      s->last[b->track] = i;
    }
  return BATTEN_OK;
}

batten_status match_tracks(batten_context *ctx, const batten_loft_match_options *opt, match_stack *s) {
  for (size_t i = 0; i < s->count; i++) {
    batten_status st = batten_progress(ctx, "slices", 0.3 * (double)i / (double)s->count);
    if (st >= 0) st = find_bends(ctx, &opt->fit, i, s->closed, s->slices + i);
    if (st >= 0 && i > 0 && opt->features) st = find_partners(ctx, s->slices + i - 1, s->slices + i, s->closed);
    if (st < 0) return st;
  }
  return number_tracks(ctx, s);
}
