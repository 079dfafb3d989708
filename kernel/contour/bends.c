/* The curvature plot of the smoothing spline, and which of its runs of one sign count.
 *
 * Between the zeros of the smoothed data's curvature lie runs of one sign. What speaks for a run is by how much the
 * fit worsens without it: the smoothing spline is fitted again with the run's sign turned into that of its
 * neighbours (smooth_forced.c). The rise of the sum, in squares of the noise, is about chi-squared where the run is
 * but noise; its root is the run's significance, in standard deviations. The least significant run joins its
 * neighbours, until all that are left are significant [backward elimination]. So straight pieces, the ringing of a
 * smooth curve beside a corner, and wiggles do not count, and a weak but long bend does.
 *
 * Runs join first, without fits, that parabolas of their turn and length show to be less than the noise. (Their
 * curvature beside its standard deviation would not do: long weak bends are below it everywhere.) An inflection lies
 * where the sign is as likely the one before as the one after: in a straight piece that is its middle. */
#include "bends.h"

#include <string.h>

#include "base/checked.h"
#include "smooth_forced.h"

/* Curvature that is so small a part of its standard deviation has no sign. */
static const double NO_SIGN = 1e-3;
/* The sign of curvature is certain from here on, in its standard deviations. */
static const double CERTAIN = 2;
/* Runs that a parabola shows to be so few standard deviations join without a fit. In a curve that bends the other way
 * around the run the fit finds up to seven times as many: there its neighbours must give way far. */
static const double NOISE_ALONE = 0.2;
/* Roughness counts no less than this part of what it does in the smoothing. */
static const double ROUGH_LEAST = 0.1;
/* Between two inflections, and beyond the last one, lie so many points, or nothing speaks for a run. */
enum { POINTS_MIN = 2 };
enum { PER_SPAN = 4, BISECTIONS = 40, PLACES = 64 }; /* PER_SPAN: samples of the plot */
/* Groups on either side of one that is turned, whose signs are kept. */
enum { NEIGHBOURS = 2 };

/* ---- the plot ----------------------------------------------------------------------------------- */

/* Of the curvature [x', x''] / |x'|^3 only the part that x'' has, along the normal, is uncertain to speak of. */
static void sample_at(const contour_smooth *s, double t, double *out, double *angle) {
  double jet[3][2];
  contour_smooth_jet(s, s->control, t, jet);
  double speed2 = jet[1][0] * jet[1][0] + jet[1][1] * jet[1][1], speed = sqrt(speed2);
  out[0] = t;
  out[1] = speed > 0 ? contour_cross(jet[1], jet[2]) / (speed2 * speed) : 0;
  out[2] =
      speed > 0 ? fmax(s->noise, CONTOUR_EXACT * s->size) * sqrt(contour_smooth_variance(s, t)) / speed2 : INFINITY;
  *angle = atan2(jet[1][1], jet[1][0]);
}

batten_status contour_plot_make(batten_context *ctx, const contour_smooth *s, contour_plot *out) {
  contour_plot p = {.count = PER_SPAN * s->spans + 1};
  p.samples = batten_alloc_array(ctx, p.count, 4 * sizeof(double));
  p.angles = p.samples ? batten_alloc_array(ctx, p.count, sizeof(double)) : NULL;
  if (!p.angles) {
    batten_free(ctx, p.samples);
    return BATTEN_E_NOMEM;
  }
  const double pi = acos(-1);
  double length = 0, before[3][2], jet[3][2];
  for (size_t i = 0; i < p.count; i++) {
    double t = (double)i / (double)(p.count - 1), angle, *at = p.samples + 4 * i;
    sample_at(s, t, at, &angle);
    if (i > 0) {
      double middle[3][2], h = 1 / (double)(p.count - 1);
      contour_smooth_jet(s, s->control, t - 0.5 * h, middle);
      contour_smooth_jet(s, s->control, t, jet);
      length +=
          h / 6 *
          (hypot(before[1][0], before[1][1]) + 4 * hypot(middle[1][0], middle[1][1]) + hypot(jet[1][0], jet[1][1]));
      double turn = angle - p.angles[i - 1];
      p.angles[i] = p.angles[i - 1] + turn - 2 * pi * round(turn / (2 * pi));
    } else {
      contour_smooth_jet(s, s->control, t, jet);
      p.angles[0] = angle;
    }
    for (int k = 0; k < 2; k++) before[1][k] = jet[1][k];
    at[3] = length;
  }
  *out = p;
  return BATTEN_OK;
}

void contour_plot_free(batten_context *ctx, contour_plot *p) {
  if (!p) return;
  batten_free(ctx, p->angles);
  batten_free(ctx, p->samples);
  *p = (contour_plot){0};
}

/* ---- runs --------------------------------------------------------------------------------------- */

/* Runs that are joined: a part of a ring or chain of all that are left. */
typedef struct group {
  size_t before, after; /* neighbours; NONE at open ends */
  double from, to;
  size_t peak; /* sample of greatest curvature of its sign, in standard deviations */
  int sign;
  double parabola, significance; /* NaN: not known */
  bool joined;                   /* to another one: no more there */
} group;
static const size_t NONE = (size_t)-1;

typedef struct search {
  const contour_smooth *smooth;
  const contour_plot *plot;
  size_t points;
  const double *parameters;
  size_t count, left; /* of runs; of groups that are not joined */
  batten_contour_run *runs;
  group *groups; /* [count] */
  contour_forced forced;
  double noise;
} search;

static double value(const search *s, size_t sample) {
  const double *at = s->plot->samples + 4 * sample;
  return at[2] > 0 ? at[1] / at[2] : 0;
}

static int sign_of(const search *s, size_t sample) {
  double z = value(s, sample);
  return fabs(z) <= NO_SIGN ? 0 : z > 0 ? 1 : -1;
}

static double bend_at(const search *s, double t) {
  double jet[3][2];
  contour_smooth_jet(s->smooth, s->smooth->control, t, jet);
  return contour_cross(jet[1], jet[2]);
}

/* Where the curvature leaves a sign between two parameters. */
static double find_zero(const search *s, double from, double to, int sign) {
  for (int i = 0; i < BISECTIONS; i++) {
    double middle = 0.5 * (from + to);
    if (bend_at(s, middle) * sign > 0)
      from = middle;
    else
      to = middle;
  }
  return 0.5 * (from + to);
}

/* The tangent's angle; beyond the end of closed curves it goes on. */
static double angle_at(const search *s, double t) {
  double add = 0, steps = (double)(s->plot->count - 1);
  if (t > 1) {
    t -= 1;
    add = s->plot->angles[s->plot->count - 1] - s->plot->angles[0];
  }
  double at = t * steps;
  size_t i = at < steps ? (size_t)at : s->plot->count - 2;
  return add + s->plot->angles[i] + (at - (double)i) * (s->plot->angles[i + 1] - s->plot->angles[i]);
}

static double length_at(const search *s, double t) {
  const size_t steps = s->plot->count - 1;
  const double *samples = s->plot->samples;
  double add = t > 1 ? samples[4 * steps + 3] : 0, at = (t > 1 ? t - 1 : t) * (double)steps;
  size_t i = at < (double)steps ? (size_t)at : steps - 1;
  return add + samples[4 * i + 3] + (at - (double)i) * (samples[4 * i + 7] - samples[4 * i + 3]);
}

/* Changes of sign in the plot: how many, and where (changes NULL: only how many). *first: the sign before. */
static size_t find_changes(const search *s, double *changes, int *first) {
  size_t count = 0, last = 0;
  int before = 0;
  for (size_t i = 0; i < s->plot->count; i++) {
    int sign = sign_of(s, i);
    if (!sign) continue;
    if (before && sign != before) {
      if (changes) changes[count] = find_zero(s, s->plot->samples[4 * last], s->plot->samples[4 * i], before);
      count++;
    }
    if (!before) *first = sign;
    before = sign;
    last = i;
  }
  if (!before) *first = 1;
  return count;
}

/* The sample where the run bends most, in standard deviations. */
static size_t find_peak(const search *s, const batten_contour_run *r) {
  const size_t steps = s->plot->count - 1;
  size_t from = (size_t)ceil(r->from * (double)steps), to = (size_t)floor(r->to * (double)steps);
  size_t peak = (size_t)(0.5 * (r->from + r->to) * (double)steps) % steps;
  double best = -1;
  for (size_t k = from; k <= to; k++) {
    size_t sample = k > steps ? k - steps : k;
    double z = value(s, sample) * r->sign;
    if (z <= best) continue;
    best = z;
    peak = sample;
  }
  return peak;
}

static batten_status find_runs(batten_context *ctx, search *s) {
  int first = 1;
  bool closed = s->smooth->closed;
  size_t changes = find_changes(s, NULL, &first);
  /* Rounding may let the ends of a closed plot differ. */
  if (closed) changes -= changes % 2;
  s->count = s->left = closed && changes ? changes : changes + 1;
  double *at = batten_alloc_array(ctx, changes + 2, sizeof *at);
  s->runs = at ? batten_alloc_array(ctx, s->count, sizeof *s->runs) : NULL;
  s->groups = s->runs ? batten_alloc_array(ctx, s->count, sizeof *s->groups) : NULL;
  if (!s->groups) {
    batten_free(ctx, at);
    return BATTEN_E_NOMEM;
  }
  find_changes(s, at, &first);
  for (size_t i = 0; i < s->count; i++) {
    batten_contour_run r = {.from = 0, .to = 1, .sign = i % 2 ? -first : first};
    if (closed && changes) {
      r.sign = -r.sign;
      r.from = at[i];
      r.to = i + 1 < changes ? at[i + 1] : at[0] + 1;
    } else {
      if (i > 0) r.from = at[i - 1];
      if (i < changes) r.to = at[i];
    }
    r.turn = angle_at(s, r.to) - angle_at(s, r.from);
    s->runs[i] = r;
    s->groups[i] = (group){.before = i ? i - 1 : NONE,
                           .after = i + 1 < s->count ? i + 1 : NONE,
                           .from = r.from,
                           .to = r.to,
                           .sign = r.sign,
                           .peak = find_peak(s, &r),
                           .parabola = NAN,
                           .significance = NAN};
  }
  if (closed && changes) {
    s->groups[0].before = s->count - 1;
    s->groups[s->count - 1].after = 0;
  }
  batten_free(ctx, at);
  return BATTEN_OK;
}

/* Group i joins its neighbours: of three one remains, the one before if there is one. */
static size_t join(search *s, size_t i) {
  group *g = s->groups;
  size_t before = g[i].before, after = g[i].after, to = before != NONE ? before : after;
  group *keep = &g[to];
  g[i].joined = true;
  s->left--;
  if (before == NONE) {
    keep->from = g[i].from;
    keep->before = NONE;
  } else if (after == NONE) {
    keep->to = g[i].to;
    keep->after = NONE;
  } else if (before == after) { /* two on a ring */
    keep->before = keep->after = NONE;
    keep->from = 0;
    keep->to = 1;
  } else {
    group *other = &g[after];
    other->joined = true;
    s->left--;
    keep->to = other->to > keep->from ? other->to : other->to + 1;
    keep->after = other->after;
    if (fabs(value(s, other->peak)) > fabs(value(s, keep->peak))) keep->peak = other->peak;
    if (keep->after != NONE) g[keep->after].before = to;
  }
  return to;
}

/* The first group that is left. */
static size_t first_group(const search *s) {
  size_t i = 0;
  while (s->groups[i].joined) i++;
  return i;
}

/* Points with parameters in [from, to], to maybe beyond 1; no more than `most`. */
static size_t count_points(const search *s, double from, double to, size_t most) {
  size_t count = 0;
  for (size_t i = 0; i < s->points && count < most; i++) {
    double t = s->parameters[i];
    count += (t >= from && t <= to) || t + 1 <= to;
  }
  return count;
}

/* The significance of a group if it bent evenly between straight pieces and became straight: m points on a parabola
 * of length l that turns by a are off their line by (a l)^2 / 720 in the mean square. */
static double parabola(const search *s, const group *g) {
  double turn = fmax((angle_at(s, g->to) - angle_at(s, g->from)) * g->sign, 0);
  double length = length_at(s, g->to) - length_at(s, g->from);
  return turn * length * sqrt((double)count_points(s, g->from, g->to, s->points) / 720) / s->noise;
}

static void join_noise(search *s) {
  while (s->left > 1) {
    size_t least = NONE;
    for (size_t i = 0; i < s->count; i++) {
      group *g = &s->groups[i];
      if (g->joined) continue;
      if (isnan(g->parabola)) g->parabola = parabola(s, g);
      if (least == NONE || g->parabola < s->groups[least].parabola) least = i;
    }
    if (s->groups[least].parabola >= NOISE_ALONE) return;
    s->groups[join(s, least)].parabola = NAN;
  }
}

/* How far from a change at t, one way (step +1, -1), the sign is uncertain: walks the plot to where curvature of the
 * sign there is certain, at most to the group's peak. Beyond 1 and below 0 on closed curves. */
static double uncertain_until(const search *s, double t, int step, const group *g) {
  const size_t steps = s->plot->count - 1;
  double at = t * (double)steps, z_before = 0, where = at;
  double next = step > 0 ? floor(at) + 1 : ceil(at) - 1;
  for (size_t k = 0; k <= steps; k++, next += step) {
    if (!s->smooth->closed && (next < 0 || next > (double)steps)) break;
    double folded = next - floor(next / (double)steps) * (double)steps;
    size_t sample = s->smooth->closed ? (size_t)folded : (size_t)next;
    double z = value(s, sample) * g->sign;
    if (z >= CERTAIN) {
      double part = z > z_before ? (CERTAIN - z_before) / (z - z_before) : 1;
      return (where + fmin(fmax(part, 0), 1) * (next - where)) / (double)steps;
    }
    where = next;
    z_before = z;
    if (sample == g->peak) break;
  }
  return where / (double)steps;
}

/* Sites between two parameters (to may be beyond 1) may bend one way. */
static void set_ways(search *s, double from, double to, int way) {
  const size_t count = s->forced.count;
  for (size_t k = (size_t)fmax(floor(from * (double)count), 0); k < 2 * count; k++) {
    double t = ((double)k + 0.5) / (double)count;
    if (t > to || (k >= count && !s->smooth->closed)) break;
    if (t >= from) s->forced.sites[k % count].way = (signed char)way;
  }
}

/* The least sum with the signs of group i and its neighbours, and (turned) with that of group i turned round. What is
 * further away bends as it likes: it does not matter, and what is not asked is found in few steps. */
static double cost(search *s, size_t i, bool turned) {
  const group *g = s->groups;
  set_ways(s, 0, 1, 0);
  if (s->left == 1) {
    set_ways(s, 0, 1, turned ? -g[i].sign : g[i].sign);
    return contour_forced_solve(&s->forced, NULL);
  }
  size_t begin = i, count = 1;
  for (; count <= NEIGHBOURS && count < s->left && g[begin].before != NONE; count++) begin = g[begin].before;
  for (size_t k = 0, end = i; k < NEIGHBOURS && count < s->left && g[end].after != NONE; k++, count++)
    end = g[end].after;
  for (size_t k = 0, at = begin; k < count; k++, at = g[at].after)
    set_ways(s, g[at].from, g[at].to, turned && at == i ? -g[at].sign : g[at].sign);
  for (size_t k = 0, at = begin; k < count; k++) { /* between groups of different sign the change may move */
    size_t next = g[at].after;
    if (next == NONE || (k + 1 == count && count < s->left)) break;
    if (!turned || (at != i && next != i)) {
      double from = uncertain_until(s, g[next].from, -1, &g[at]), to = uncertain_until(s, g[next].from, 1, &g[next]);
      set_ways(s, from < 0 ? from + 1 : from, from < 0 ? to + 1 : to, 0);
    }
    at = next;
  }
  return contour_forced_solve(&s->forced, NULL);
}

static batten_status find_significances(batten_context *ctx, search *s) {
  for (size_t i = 0; i < s->count; i++) {
    group *g = &s->groups[i];
    if (g->joined || !isnan(g->significance)) continue;
    batten_status st = batten_progress(ctx, "inflections", 0.5);
    if (st < 0) return st;
    if (s->left == 1) { /* what is left may be the weaker sign's group */
      double turn = angle_at(s, 1) - angle_at(s, 0);
      if (turn * g->sign < 0) g->sign = -g->sign;
    }
    double rise = cost(s, i, true) - cost(s, i, false);
    g->significance = rise > 0 ? sqrt(rise) / s->noise : 0;
    if (s->left > 1 && count_points(s, g->from, g->to, POINTS_MIN) < POINTS_MIN) g->significance = 0;
  }
  return BATTEN_OK;
}

static bool inside(const batten_contour_run *r, const group *g) {
  double middle = 0.5 * (r->from + r->to);
  if (middle >= 1) middle -= 1;
  return r->sign == g->sign && ((middle >= g->from && middle <= g->to) || middle + 1 <= g->to);
}

/* What is known of a group, its runs have. */
static void note(search *s, const group *g, int kept) {
  for (size_t k = 0; k < s->count; k++) {
    if (!inside(&s->runs[k], g)) continue;
    s->runs[k].significance = g->significance;
    s->runs[k].kept = kept;
  }
}

static batten_status join_insignificant(batten_context *ctx, search *s, double significance) {
  for (;;) {
    batten_status st = find_significances(ctx, s);
    if (st < 0) return st;
    size_t least = NONE;
    for (size_t i = 0; i < s->count; i++)
      if (!s->groups[i].joined && (least == NONE || s->groups[i].significance < s->groups[least].significance))
        least = i;
    if (s->left == 1 || s->groups[least].significance >= significance) return BATTEN_OK;
    note(s, &s->groups[least], 0);
    group *joined = &s->groups[join(s, least)];
    joined->significance = NAN;
    if (joined->before != NONE) s->groups[joined->before].significance = NAN;
    if (joined->after != NONE) s->groups[joined->after].significance = NAN;
  }
}

/* Ascending; of a ring the last change may have gone round. */
static void sort_changes(contour_bends *b) {
  for (size_t i = 1; i < b->count; i++)
    for (size_t k = i; k > 0 && b->inflections[k] < b->inflections[k - 1]; k--) {
      double t = b->inflections[k], u = b->uncertainties[k];
      b->inflections[k] = b->inflections[k - 1];
      b->uncertainties[k] = b->uncertainties[k - 1];
      b->inflections[k - 1] = t;
      b->uncertainties[k - 1] = u;
    }
}

/* Where a change lies between two parameters (beyond 0 or 1 on closed curves) before which the curvature's sign is
 * sign_before: p(t), that it is so still at t, is about that of the curvature there being so; the mean of t is then
 * from + the integral of p, its square about from the integral of 2 (t - from) p. */
static void place_change(const search *s, double from, double to, int sign_before, double *t, double *uncertainty) {
  double step = (to - from) / PLACES, mean = 0, square = 0, steps = (double)(s->plot->count - 1);
  for (int i = 0; i < PLACES; i++) {
    double along = (i + 0.5) * step, at = from + along;
    if (s->smooth->closed) at -= floor(at);
    size_t k = at * steps < steps ? (size_t)(at * steps) : s->plot->count - 2;
    double part = at * steps - (double)k, z = (1 - part) * value(s, k) + part * value(s, k + 1);
    double p = 0.5 * erfc(-z * sign_before / sqrt(2));
    mean += step * p;
    square += 2 * step * along * p;
  }
  *t = from + mean;
  *uncertainty = sqrt(fmax(square - mean * mean, 0));
}

/* Inflections where the sign changes; runs that count. */
static void conclude(search *s, contour_bends *b) {
  const group *g = s->groups;
  size_t i = first_group(s), first = i;
  double least = INFINITY; /* of the inflections: the sign before it is that at the start */
  b->sign = g[first].sign;
  do {
    size_t next = g[i].after;
    note(s, &g[i], 1);
    if (next == NONE) break;
    double from = uncertain_until(s, g[next].from, -1, &g[i]), to = uncertain_until(s, g[next].from, 1, &g[next]);
    double t;
    place_change(s, from, to, g[i].sign, &t, &b->uncertainties[b->count]);
    if (s->smooth->closed) t -= floor(t);
    if (t < least) {
      least = t;
      b->sign = t > 0 ? g[i].sign : g[next].sign;
    }
    b->inflections[b->count++] = t;
    i = next;
  } while (i != first);
  sort_changes(b);
}

void contour_bends_free(batten_context *ctx, contour_bends *b) {
  if (!b) return;
  batten_free(ctx, b->uncertainties);
  batten_free(ctx, b->inflections);
  batten_free(ctx, b->runs);
  *b = (contour_bends){0};
}

/* By what lambda grows for weighing runs. It is the square of the noise over what is expected of the third
 * derivative: where more noise is taken for granted than the fit had, the rise of the sum is that of this larger
 * lambda. But few exact points leave a curve free between them, where the smoothing spline rings beside a sharp bend;
 * without the ringing the curve is rougher, and nothing else: the fewer they are, the less does that count. */
static double rougher(const search *s) {
  double more = s->noise / fmax(s->smooth->fitted, CONTOUR_EXACT * s->smooth->size);
  double many = s->smooth->count / CONTOUR_EVEN_COUNT;
  return more <= 1 ? 1 : fmin(more * more, fmax(many * many, ROUGH_LEAST));
}

static batten_status take_bends(batten_context *ctx, search *s, contour_bends *b) {
  if (s->left > 1) {
    b->inflections = batten_alloc_array(ctx, s->left, sizeof *b->inflections);
    b->uncertainties = batten_alloc_array(ctx, s->left, sizeof *b->uncertainties);
    if (!b->inflections || !b->uncertainties) return BATTEN_E_NOMEM;
  }
  conclude(s, b);
  return BATTEN_OK;
}

batten_status contour_bends_find(batten_context *ctx, const contour_smooth *smooth, const contour_plot *plot,
                                 size_t points, const double *parameters, size_t count, const double *significances,
                                 contour_bends *out) {
  search s = {.smooth = smooth, .plot = plot, .points = points, .parameters = parameters};
  s.noise = fmax(smooth->noise, CONTOUR_EVEN * smooth->size * sqrt(fmax(1, smooth->count / CONTOUR_EVEN_COUNT)));
  for (size_t k = 0; k < count; k++) out[k] = (contour_bends){0};
  batten_status st = find_runs(ctx, &s);
  if (st >= 0) {
    join_noise(&s);
    st = contour_forced_new(ctx, smooth, smooth->lambda * rougher(&s), &s.forced);
  }
  for (size_t k = 0; k < count && st >= 0; k++) {
    st = join_insignificant(ctx, &s, significances[k]);
    if (st >= 0) st = take_bends(ctx, &s, out + k);
  }
  if (st >= 0) {
    out[count - 1].run_count = s.count;
    out[count - 1].runs = s.runs;
    s.runs = NULL;
  }
  for (size_t k = 0; k < count && st < 0; k++) contour_bends_free(ctx, out + k);
  contour_forced_free(ctx, &s.forced);
  batten_free(ctx, s.groups);
  batten_free(ctx, s.runs);
  return st;
}
