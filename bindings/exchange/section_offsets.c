/* Sections of hulls from tables of offsets, as the reader of contours leaves them: one side of each station, from the
 * keel upwards, waterlines that pass below or above left out.
 *
 * Runs of positive half-breadths, with the zeros beside them, are contours: a bulb and the bow above it are two.
 * Where they share a zero they would touch, which sections must not; both end a little before it. A run that is open
 * at its upper end goes on straight for two waterlines and is closed there: the side keeps its slope up to the deck,
 * at which the caller cuts. A first or last station that lies on the middle plane is a stem: a point or a line, in
 * which the solid ends; it goes up as far as the section beside it. */
#include "contours.h"
#include "sections.h"

#include "base/checked.h"

#include <math.h>

/* Of the waterlines' distance: how far contours stay from a zero that they share. */
static const double apart = 0.05;

/* Points from .. to - 1 of one side, (half-breadth, waterline). */
typedef struct run {
  size_t from, to;
} run;

/* The next run of positive half-breadths from `at` on; false: there is none. Zeros beside it belong to it. */
static bool next_run(const double (*side)[2], size_t count, size_t *at, run *out) {
  while (*at < count && !(side[*at][0] > 0)) ++*at;
  if (*at == count) return false;
  out->from = *at ? *at - 1 : 0;
  while (*at < count && side[*at][0] > 0) ++*at;
  out->to = *at < count ? *at + 1 : count;
  return true;
}

static bool is_open_above(const double (*side)[2], const run *r) { return side[r->to - 1][0] > 0; }

/* Where the side ends when it goes on. One that leans inwards stops before it has lost half of its breadth. */
static void go_on(const double (*side)[2], const run *r, double out[2]) {
  const double *top = side[r->to - 1];
  size_t below = r->to - 1;
  while (below > r->from && !(side[below][1] < top[1])) below--;
  double rise = top[1] - side[below][1], lean = top[0] - side[below][0], steps = 2;
  if (!(rise > 0)) { /* a single waterline: as far up as half of it is wide */
    rise = top[0];
    lean = 0;
  }
  if (lean < 0) steps = fmin(steps, top[0] / 2 / -lean);
  out[0] = top[0] + steps * lean;
  out[1] = top[1] + steps * rise;
}

/* A zero at the run's end `end` (its neighbour inside is `inner`) which the neighbouring run has too. */
static double shared_height(const double (*side)[2], size_t end, size_t inner) {
  return side[end][1] + apart * (side[inner][1] - side[end][1]);
}

/* The closed contour of a run, both sides, anticlockwise: up the side of positive half-breadths and down the other.
 * Returns how many points; out has room for 2 (to - from + 1). */
static size_t mirror(const double (*side)[2], const run *r, const run *before, const run *after, double (*out)[2]) {
  size_t count = 0;
  for (size_t i = r->from; i < r->to; i++) {
    out[count][0] = side[i][0];
    out[count][1] = side[i][1];
    if (i == r->from && before && before->to - 1 == i) out[count][1] = shared_height(side, i, i + 1);
    if (i + 1 == r->to && after && after->from == i) out[count][1] = shared_height(side, i, i - 1);
    count++;
  }
  if (is_open_above(side, r)) go_on(side, r, out[count++]);
  for (size_t i = count; i-- > 0;) {
    if (!(out[i][0] > 0)) continue; /* on the middle plane: there once */
    out[count][0] = -out[i][0];
    out[count++][1] = out[i][1];
  }
  return count;
}

static void set_frame(const batten_plane *p, batten_section *out) {
  for (int k = 0; k < 3; k++) {
    out->origin[k] = p->origin[k];
    out->rotation[0][k] = p->axes[0][k];
    out->rotation[1][k] = p->axes[1][k];
    out->rotation[2][k] = k == 0; /* stations ascend along x */
  }
}

/* The points of a stem; `beside` is the section next to it. */
static batten_status make_stem(batten_context *ctx, size_t count, const double (*side)[2], const batten_contours *c,
                               size_t beside, batten_section *out) {
  const double(*next)[2] = (const double(*)[2])c->points + c->starts[beside];
  size_t next_count = c->starts[beside + 1] - c->starts[beside], at = 0;
  double bottom = side[0][1], top = side[count - 1][1];
  batten_status st = bx_section_make(ctx, 1, 2, out);
  if (st != BATTEN_OK) return st;
  run r;
  while (next_run(next, next_count, &at, &r))
    if (at == next_count && is_open_above(next, &r) && !(top < next[r.to - 1][1])) {
      double end[2];
      go_on(next, &r, end);
      top = end[1];
    }
  double *to = bx_section_points(out);
  to[0] = to[2] = 0;
  to[1] = bottom;
  to[3] = top;
  bx_section_starts(out)[0] = 0;
  bx_section_starts(out)[1] = top > bottom ? 2 : 1;
  return BATTEN_OK;
}

static batten_status make_section(batten_context *ctx, const batten_contours *c, size_t station,
                                  batten_section *out) {
  const double(*side)[2] = (const double(*)[2])c->points + c->starts[station];
  size_t count = c->starts[station + 1] - c->starts[station], runs = 0, at = 0, points = 0;
  run r;
  while (next_run(side, count, &at, &r)) runs++;
  batten_status st = runs ? bx_section_make(ctx, runs, 4 * count + 2 * runs, out)
                          : make_stem(ctx, count, side, c, station ? station - 1 : 1, out);
  if (st != BATTEN_OK) return st;
  set_frame(&c->planes[station], out);
  if (runs == 0) return BATTEN_OK;
  size_t *starts = bx_section_starts(out);
  double(*to)[2] = (double(*)[2])bx_section_points(out);
  run before = {0}, after = {0};
  at = 0;
  bool more = next_run(side, count, &at, &r);
  for (size_t k = 0; more; k++) {
    more = next_run(side, count, &at, &after);
    starts[k] = points;
    points += mirror(side, &r, k ? &before : NULL, more ? &after : NULL, to + points);
    before = r;
    r = after;
  }
  starts[runs] = points;
  return BATTEN_OK;
}

batten_status bx_stack_offsets(batten_context *ctx, const char *path, const batten_contours *c,
                               batten_section_set *out) {
  batten_section_set set = {0};
  batten_status st = BATTEN_E_NOMEM;
  set.sections = batten_alloc_array(ctx, c->count, sizeof *set.sections);
  set.deck = batten_alloc_array(ctx, c->count, 2 * sizeof *set.deck);
  if (!set.sections || !set.deck) goto done;
  st = BATTEN_OK;
  for (size_t i = 0; st == BATTEN_OK && i < c->count; i++) {
    const double *top = c->points + 2 * (c->starts[i + 1] - 1);
    for (size_t k = c->starts[i]; st == BATTEN_OK && k < c->starts[i + 1]; k++)
      if (c->points[2 * k] < 0)
        st = batten_fail(ctx, BATTEN_E_FORMAT,
                         "%s: station %.6g, waterline %.6g: half-breadth %.6g; it must not be negative",
                         bx_short_path(path), c->planes[i].origin[0], c->points[2 * k + 1], c->points[2 * k]);
    if (st == BATTEN_OK) st = make_section(ctx, c, i, &set.sections[i]);
    if (st != BATTEN_OK) break;
    set.count++;
    if (!(top[0] > 0)) continue; /* closed above */
    set.deck[2 * set.deck_count] = c->planes[i].origin[0];
    set.deck[2 * set.deck_count++ + 1] = top[1];
  }
done:
  if (st == BATTEN_OK)
    *out = set;
  else
    batten_section_set_free(ctx, &set);
  return st;
}
