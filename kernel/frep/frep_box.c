/* The box of a tree: a box that holds f >= 0, found by bounds.
 *
 * A list of boxes holds all that may be inside; one that bounds prove to be outside is dropped. What is known to be
 * inside (a middle where f >= 0, a box where f >= 0 throughout) makes the inner hull; only boxes that stick out of it
 * are halved again, along the axis on which they do: so the work is on the faces of the result, and a flat face costs
 * no more than its tiles. The search starts from the box that the structure tells; else from a box a million times as
 * large as what the leaves tell, and what reaches the faces of that has no end. */
#include <string.h>

#include "base/checked.h"
#include "frep/frep_inner.h"

enum {
  BOX_LIMIT = 1 << 18,            /* boxes in the list: a surface of 200 x 200 tiles on each side has as many */
  BOX_LIMIT_STRUCTURAL = 1 << 15, /* where the structure's box will do when bounds are too wide to make it tighter */
  BOX_LIMIT_ROUGH = 1 << 12,      /* where only a start for a later search is wanted */
  BOX_ROUNDS = 200 /* rounds of halving: 20 for a million along each axis, and 7 for a hundredth, three times */
};
#define BOX_TIGHT 0.005 /* of the largest extent: how far a box may stick out of what is known to be inside */
#define BOX_ROUGH 0.04  /* the same where a start for a later search is wanted */
#define BOX_SLACK 0.004 /* of it, added at last: the surface shall not lie on a face, where a mesh would be cut */

typedef struct box_search {
  const batten_frep *a;
  size_t count, room;
  double *boxes;                     /* [room][2][n]; those beyond count are being made */
  double *ranges, *middles, *values; /* of FREP_BLOCK boxes */
  double inner[6];                   /* lower and upper [3] each */
  bool some;                         /* anything is known to be inside */
  double tight;                      /* BOX_TIGHT or BOX_ROUGH */
} box_search;

static void include(box_search *s, const double *lower, const double *upper) {
  for (unsigned k = 0; k < s->a->n; k++) {
    s->inner[k] = s->some ? fmin(s->inner[k], lower[k]) : lower[k];
    s->inner[3 + k] = s->some ? fmax(s->inner[3 + k], upper[k]) : upper[k];
  }
  s->some = true;
}

/* How far a box sticks out of the inner hull at most, and along which axis. */
static double sticks_out(const box_search *s, const double *box, unsigned *axis) {
  const unsigned n = s->a->n;
  double most = -INFINITY;
  for (unsigned k = 0; k < n; k++) {
    double out = fmax(s->inner[k] - box[k], box[n + k] - s->inner[3 + k]);
    if (out > most) {
      most = out;
      *axis = k;
    }
  }
  return most;
}

static double inner_size(const box_search *s) {
  double size = 0;
  for (unsigned k = 0; k < s->a->n; k++) size = fmax(size, s->inner[3 + k] - s->inner[k]);
  return size;
}

/* Halves a box in place; the other half to other. Along the axis on which it sticks out, unless it is a thin tile
 * there already: then bounds are wide because of its other extents. */
static void halve(const box_search *s, double *box, double *other) {
  const unsigned n = s->a->n;
  unsigned widest = 0, axis;
  for (unsigned k = 1; k < n; k++)
    if (box[n + k] - box[k] > box[n + widest] - box[widest]) widest = k;
  axis = widest;
  if (s->some) {
    sticks_out(s, box, &axis);
    if (box[n + axis] - box[axis] < (box[n + widest] - box[widest]) / 8) axis = widest;
  }
  memcpy(other, box, 2 * n * sizeof *box);
  box[n + axis] = other[axis] = box[axis] / 2 + box[n + axis] / 2;
}

/* Judges count boxes: keeps at *kept those that may hold something, lets the inner hull grow by what they do hold. */
static batten_status judge(box_search *s, batten_context *ctx, size_t first, size_t count, size_t *kept) {
  const unsigned n = s->a->n;
  batten_status st = BATTEN_OK;
  for (size_t done = 0; st >= 0 && done < count;) {
    size_t now = count - done < FREP_BLOCK ? count - done : FREP_BLOCK, left = 0;
    double *from = s->boxes + 2 * n * (first + done), *to = s->boxes + 2 * n * *kept;
    st = frep_bounds_block(s->a, ctx, now, from, s->ranges);
    for (size_t i = 0; st >= 0 && i < now; i++) {
      const double *box = from + 2 * n * i;
      if (s->ranges[2 * i + 1] < 0) continue;
      if (s->ranges[2 * i] >= 0) include(s, box, box + n);
      for (unsigned k = 0; k < n; k++) s->middles[n * left + k] = box[k] / 2 + box[n + k] / 2;
      memmove(to + 2 * n * left++, box, 2 * n * sizeof *box);
    }
    if (st >= 0 && left > 0) st = frep_evaluate_block(s->a, ctx, left, s->middles, s->values, NULL);
    for (size_t i = 0; st >= 0 && i < left; i++)
      if (s->values[i] >= 0) include(s, s->middles + n * i, s->middles + n * i);
    *kept += left;
    done += now;
  }
  return st;
}

/* One round: boxes that stick out of the inner hull are halved and judged, others are no longer needed. *done: none
 * was, or there is no more room. */
static batten_status refine(box_search *s, batten_context *ctx, bool *done) {
  const unsigned n = s->a->n;
  const double tight = s->some ? s->tight * inner_size(s) : 0;
  size_t out = 0;
  for (size_t i = 0; i < s->count; i++) { /* those to be halved to the front, the others after them */
    double *box = s->boxes + 2 * n * i, *place = s->boxes + 2 * n * out;
    unsigned axis;
    if (s->some && sticks_out(s, box, &axis) <= tight) continue;
    if (place != box) memmove(place, box, 2 * n * sizeof *box);
    out++;
  }
  /* what sticks out by less than the tolerance counts by widening the result */
  s->count = out;
  *done = out == 0;
  if (out == 0) return BATTEN_OK;
  if (2 * out > s->room) {
    size_t room = 4 * out;
    double *boxes = batten_realloc_array(ctx, s->boxes, room, 2 * n * sizeof *boxes);
    if (!boxes) return BATTEN_E_NOMEM;
    s->boxes = boxes;
    s->room = room;
  }
  for (size_t i = 0; i < out; i++) halve(s, s->boxes + 2 * n * i, s->boxes + 2 * n * (out + i));
  size_t kept = 0;
  batten_status st = judge(s, ctx, 0, 2 * out, &kept);
  s->count = kept;
  return st;
}

/* Where to look: false = the structure tells that there is nothing. */
static bool domain(const batten_frep *a, double *box, bool *structural) {
  const unsigned n = a->n;
  double *lower = box, *upper = box + n, size = 0;
  *structural = frep_structural_box(a, lower, upper);
  for (unsigned k = 0; *structural && k < n; k++)
    if (lower[k] > upper[k]) return false;
  if (*structural) return true;
  bool hint = frep_hint_box(a, lower, upper);
  for (unsigned k = 0; hint && k < n; k++) size = fmax(size, upper[k] - lower[k]);
  if (!hint || !(size > 0)) size = 1;
  for (unsigned k = 0; k < n; k++) {
    /* off the leaves' middle, where planes of symmetry lie that no half should end on */
    double middle = (hint ? lower[k] / 2 + upper[k] / 2 : 0) + size / 7 * (k + 1.0) / n;
    lower[k] = middle - size * 0x1p20;
    upper[k] = middle + size * 0x1p20;
  }
  return true;
}

static batten_status nothing(batten_context *ctx) {
  return batten_fail(ctx, BATTEN_E_NOT_FOUND, "a: the solid is empty: f < 0 everywhere; give a node with an inside");
}

/* The inner hull, what sticks out of it, and slack. */
static batten_status result(const box_search *s, batten_context *ctx, const double *start, bool structural,
                            double *lower, double *upper) {
  const unsigned n = s->a->n;
  box_search all = *s;
  for (size_t i = 0; i < s->count; i++) include(&all, s->boxes + 2 * n * i, s->boxes + 2 * n * i + n);
  if (!all.some) return nothing(ctx);
  double size = inner_size(&all), wider = (s->some ? s->tight * inner_size(s) : 0) + BOX_SLACK * size;
  for (unsigned k = 0; !structural && k < n; k++)
    if (all.inner[k] - wider <= start[k] || all.inner[3 + k] + wider >= start[n + k])
      return batten_fail(ctx, BATTEN_E_NOT_FOUND,
                         "a: the solid has no end along axis %u, or none that its bounds show; give lower and upper, "
                         "or intersect it with a box",
                         k);
  for (unsigned k = 0; k < n; k++) {
    double low = all.inner[k] - wider, high = all.inner[3 + k] + wider;
    lower[k] = structural ? fmax(low, start[k] - BOX_SLACK * size) : low;
    upper[k] = structural ? fmin(high, start[n + k] + BOX_SLACK * size) : high;
  }
  return BATTEN_OK;
}

static batten_status find_box(batten_context *ctx, const batten_frep *a, double tight, double *lower, double *upper) {
  batten_status st;
  const unsigned n = a->n;
  double start[6];
  bool structural, done = false;
  if (!domain(a, start, &structural)) return nothing(ctx);
  box_search s = {.a = a, .room = 1024, .tight = tight};
  s.boxes = batten_alloc_array(ctx, s.room, 2 * n * sizeof *s.boxes);
  s.ranges = batten_alloc_array(ctx, FREP_BLOCK, (3 + n) * sizeof *s.ranges);
  st = s.boxes && s.ranges ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  s.values = s.ranges + 2 * FREP_BLOCK;
  s.middles = s.values + FREP_BLOCK;
  memcpy(s.boxes, start, 2 * n * sizeof *start);
  const size_t limit = !structural ? BOX_LIMIT : tight < BOX_ROUGH ? BOX_LIMIT_STRUCTURAL : BOX_LIMIT_ROUGH;
  st = judge(&s, ctx, 0, 1, &s.count);
  for (int round = 0; st >= 0 && !done && round < BOX_ROUNDS && s.count <= limit / 2; round++) {
    st = batten_progress(ctx, "box", (double)round / BOX_ROUNDS);
    if (st >= 0) st = refine(&s, ctx, &done);
  }
  if (st >= 0) st = result(&s, ctx, start, structural, lower, upper);
done:
  batten_free(ctx, s.boxes);
  batten_free(ctx, s.ranges);
  return st;
}

batten_status frep_rough_box(batten_context *ctx, const batten_frep *a, double *lower, double *upper) {
  return find_box(ctx, a, BOX_ROUGH, lower, upper);
}

batten_status batten_frep_box(batten_context *ctx, const batten_frep *a, double *lower, double *upper) {
  batten_status st = frep_check_node(ctx, "a", a, 0);
  if (st >= 0 && (!lower || !upper))
    st = batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give the place for %u numbers", lower ? "upper" : "lower",
                     a->n);
  return st < 0 ? st : find_box(ctx, a, BOX_TIGHT, lower, upper);
}
