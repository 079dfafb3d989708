/* Inflections, followed through slices.
 *
 * Partners of two neighbouring slices: pairs in order, of the same change of sign, so that
 *   sum over pairs of (distance along the slice, across it, and between the tangents, squared, each over what is
 *   usual)  +  LONELY times the inflections without a partner
 * is least: dynamic programming over both lists, as sequences are aligned. Closed slices: the second list is one
 * period of inflections that go on for ever, and may begin with any of them; so no pairs cross, however they lie
 * about the start. Partners of partners are a track.
 *
 * What a slice tells of a faint bend is weak beside what its neighbours tell: where these have it, it is likely there
 * although noise hides it. So each slice has a choice of lists, those of significances from half of the one that is
 * asked for, at a price; and the sum of prices and of the sums above is least over all slices: dynamic programming
 * from slice to slice [Viterbi]. The other way round nothing is given up: bends that no neighbour has are real where
 * frames have few points, and without them curves were off by 3 % of a ship's size. */
#include "base/checked.h"
#include "contour/bends.h"
#include "match.h"

/* What is usual between neighbours: parts of the length, of the radius, and radians. */
static const double USUAL_LENGTH = 0.04, USUAL_PLACE = 0.25, USUAL_TURN = 0.6;
static const double LONELY = 2;
static const double FAR = 0.2; /* parts of the length: never partners */

/* Steps of significance, from half of it. Price of each inflection more than at the one asked for, where its bend has
 * half of that; a bend has two, and without it in one slice four inflections of neighbours are lonely. */
enum { STEPS = 4, LISTS = STEPS + 1 };
static const double PRICE = 0.5;

typedef struct list {
  size_t count;
  match_bend *bends; /* [count], batten's */
  int sign;
  double price, least; /* least: of all up to this slice, with this list */
  size_t before;       /* the list of the slice before for that */
} list;

/* The lists of a slice. */
typedef struct choice {
  const match_slice *slice;
  size_t count;
  list lists[LISTS];
} choice;

static void choice_free(batten_context *ctx, choice *c) {
  for (size_t k = 0; k < c->count; k++) batten_free(ctx, c->lists[k].bends);
  c->count = 0;
}

/* ---- inflections of a slice ---------------------------------------------------------------------- */

static batten_status take_list(batten_context *ctx, const contour_smooth *smooth, const contour_input *in,
                               const contour_bends *bends, const match_slice *s, list *out) {
  int sign = bends->sign;
  *out = (list){.count = bends->count, .sign = sign};
  out->bends = batten_alloc_array(ctx, bends->count, sizeof *out->bends);
  if (!out->bends) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < bends->count; i++) {
    double at = bends->inflections[i], jet[3][2];
    if (at > 0) sign = -sign; /* at the start it is already that after it */
    match_bend *b = out->bends + i;
    *b = (match_bend){.at = at, .sign = sign, .before = MATCH_NONE, .after = MATCH_NONE};
    contour_smooth_jet(smooth, smooth->control, at, jet);
    for (size_t c = 0; c < 2; c++) b->place[c] = jet[0][c] / in->unit + in->middle[c] - s->middle[c];
    b->angle = atan2(jet[1][1], jet[1][0]);
  }
  return BATTEN_OK;
}

/* Lists that differ, with their prices. bends [count] ascending by significance, the last one is asked for. */
static batten_status take_lists(batten_context *ctx, const contour_smooth *smooth, const contour_input *in,
                                size_t count, const contour_bends *bends, choice *c) {
  double prices[LISTS];
  prices[count - 1] = 0;
  for (size_t k = count - 1; k-- > 0;)
    prices[k] = prices[k + 1] +
                PRICE * (double)(bends[k].count - bends[k + 1].count) * ((double)(count - 1 - k) - 0.5) / STEPS;
  for (size_t k = 0; k < count; k++) {
    if (k > 0 && bends[k].count == bends[k - 1].count) continue;
    list *l = c->lists + c->count++;
    batten_status st = take_list(ctx, smooth, in, bends + k, c->slice, l);
    if (st < 0) return st;
    l->price = prices[k];
  }
  return BATTEN_OK;
}

static batten_status find_lists(batten_context *ctx, const batten_loft_match_options *opt, size_t i, bool closed,
                                choice *c) {
  const match_slice *s = c->slice;
  batten_contour_options o = batten_contour_options_default();
  contour_input in = {0};
  contour_smooth smooth = {0};
  contour_plot plot = {0};
  contour_bends bends[LISTS] = {{0}};
  double significances[LISTS];
  size_t count = opt->features ? LISTS : 1;
  for (size_t k = 0; k < count; k++)
    significances[k] = opt->fit.significance * exp2(((double)k - (double)(count - 1)) / STEPS);
  o.closed = closed;
  o.parameters = s->lengths;
  o.domain[0] = 0;
  o.domain[1] = 1;
  o.weights = s->weights;
  batten_status st = contour_input_make(ctx, s->count, s->points, &o, &in);
  const contour_data data = {in.count, in.points, in.weights};
  if (st >= 0) st = contour_smooth_fit(ctx, &data, in.parameters, closed, &smooth);
  if (st >= 0) st = contour_plot_make(ctx, &smooth, &plot);
  if (st >= 0) st = contour_bends_find(ctx, &smooth, &plot, in.count, in.parameters, count, significances, bends);
  if (st >= 0) st = take_lists(ctx, &smooth, &in, count, bends, c);
  for (size_t k = 0; k < count; k++) contour_bends_free(ctx, bends + k);
  contour_plot_free(ctx, &plot);
  contour_smooth_free(ctx, &smooth);
  contour_input_free(ctx, &in);
  return st < 0 ? match_fail_in(ctx, i, st) : st;
}

/* ---- partners ------------------------------------------------------------------------------------ */

static double square(double x) { return x * x; }

typedef struct pairing {
  double radius;
  const list *lower, *upper;
  double *least; /* [n + 1][m + 1] of the first i and the first j inflections */
} pairing;

/* What it costs that inflections are partners, b moved by `lift`; INFINITY: they cannot be. */
static double unlike(const pairing *p, const match_bend *a, const match_bend *b, double lift) {
  double way = b->at + lift - a->at, turn = remainder(b->angle - a->angle, 4 * acos(0));
  if (a->sign != b->sign || fabs(way) > FAR) return INFINITY;
  double across = hypot(b->place[0] - a->place[0], b->place[1] - a->place[1]) / p->radius;
  return square(way / USUAL_LENGTH) + square(across / USUAL_PLACE) + square(turn / USUAL_TURN);
}

static double *entry(const pairing *p, size_t i, size_t j) { return p->least + i * (p->upper->count + 1) + j; }

/* The upper list's j-th inflection where it begins `turn` - m after its own begin, and its period. */
static size_t upper_at(const pairing *p, size_t j, size_t turn, double *lift) {
  size_t m = p->upper->count, k = j + turn;
  *lift = (double)(k / m) - 1;
  return k % m;
}

static double pair_cost(const pairing *p, size_t i, size_t j, size_t turn) {
  double lift;
  size_t k = upper_at(p, j, turn, &lift);
  return unlike(p, p->lower->bends + i, p->upper->bends + k, lift);
}

/* The least sum for one begin of the upper list. */
static double fill(const pairing *p, size_t turn) {
  size_t n = p->lower->count, m = p->upper->count;
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
  size_t i = p->lower->count, j = p->upper->count;
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

/* The least sum over all begins of the upper list, and the begin. */
static double best_pairing(const pairing *p, bool closed, size_t *best_turn) {
  size_t n = p->lower->count, m = p->upper->count;
  double best = INFINITY;
  if (n == 0 || m == 0) return LONELY * (double)(n + m);
  for (size_t turn = closed ? 1 : m; turn < (closed ? 2 * m : m + 1); turn++) {
    double value = fill(p, turn);
    if (value >= best) continue;
    best = value;
    *best_turn = turn;
  }
  return best;
}

static pairing pairing_of(const choice *lower, size_t i, const choice *upper, size_t j, double *room) {
  return (pairing){fmax(lower->slice->radius, upper->slice->radius), lower->lists + i, upper->lists + j, room};
}

/* The largest lists come first. */
static size_t room_of(size_t count, const choice *choices) {
  size_t most = 0;
  for (size_t i = 0; i < count; i++)
    if (choices[i].lists[0].count > most) most = choices[i].lists[0].count;
  return most + 1;
}

/* A list for each slice, which its bends are then, with their partners. room for pairings. */
static void choose(match_stack *s, choice *choices, bool pairs, double *room) {
  for (size_t i = 0; i < s->count; i++)
    for (size_t j = 0; j < choices[i].count; j++) {
      list *own = choices[i].lists + j;
      double best = i == 0 || !pairs ? 0 : INFINITY;
      for (size_t k = 0; k < (i == 0 || !pairs ? 0 : choices[i - 1].count); k++) {
        size_t turn;
        pairing p = pairing_of(choices + i - 1, k, choices + i, j, room);
        double sum = choices[i - 1].lists[k].least + best_pairing(&p, s->closed, &turn);
        if (sum >= best) continue;
        best = sum;
        own->before = k;
      }
      own->least = best + own->price;
    }
  size_t at = 0;
  for (size_t j = 1; j < choices[s->count - 1].count; j++)
    if (choices[s->count - 1].lists[j].least < choices[s->count - 1].lists[at].least) at = j;
  for (size_t i = s->count; i-- > 0;) {
    list *own = choices[i].lists + at;
    if (i > 0 && pairs) {
      size_t turn = 0;
      pairing p = pairing_of(choices + i - 1, own->before, choices + i, at, room);
      best_pairing(&p, s->closed, &turn);
      if (p.lower->count > 0 && p.upper->count > 0) {
        fill(&p, turn);
        trace(&p, turn);
      }
    }
    s->slices[i].bend_count = own->count;
    s->slices[i].bends = own->bends;
    s->slices[i].sign = own->sign;
    own->bends = NULL;
    at = own->before;
  }
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
  choice *choices = batten_alloc_array(ctx, s->count, sizeof *choices);
  double *room = NULL;
  batten_status st = choices ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t i = 0; i < s->count && choices; i++) choices[i] = (choice){.slice = s->slices + i};
  for (size_t i = 0; i < s->count && st >= 0; i++) {
    st = batten_progress(ctx, "slices", 0.3 * (double)i / (double)s->count);
    if (st >= 0) st = find_lists(ctx, opt, i, s->closed, choices + i);
  }
  if (st < 0) goto done;
  size_t side = room_of(s->count, choices);
  room = batten_alloc_array(ctx, side, side * sizeof *room);
  st = room ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  choose(s, choices, opt->features != 0, room);
  st = number_tracks(ctx, s);
done:
  for (size_t i = 0; i < s->count && choices; i++) choice_free(ctx, choices + i);
  batten_free(ctx, room);
  batten_free(ctx, choices);
  return st;
}
