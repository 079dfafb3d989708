/* The largest value along a track of places.
 *
 * 1. The ends of all pieces: value and slope along the track.
 * 2. Pieces whose bounds allow no more than what has been found are out.
 * 3. The others are halved, with value and slope in the middle.
 * 4. A half that rises from one end, and at the other rises inwards too or is no higher, holds a maximum: it is
 * closed in by false position on the slope (Illinois; halving where that is slow), to 1e-9 of the piece. All searches
 * of a batch go on together, so that the child sees many points at a time. So maxima are found for sure where a
 * piece's half holds but one; between their ends and middles narrow peaks may be missed. The value is that of a place
 * that has been looked at, so never too large.
 *
 * Gradient: at a maximum within the track the slope along it is 0, at an end the place does not move: either way the
 * gradient is the child's, taken across.
 *
 * Bounds. From above the largest of the pieces'. From below: every value is at least that at the ends of pieces, as
 * step 1 has seen them. */
#include <string.h>

#include "base/checked.h"
#include "frep/gather.h"
#include "frep/highest.h"

enum {
  STEPS = 60 /* closing in by halves alone takes 30 */
};

/* A bracket: the value rises from `a` towards `b`; at b it rises towards a (slope[1] < 0), or is no higher than at a.
 * Slopes are along a -> b. */
typedef struct search {
  size_t point, piece;
  double u[2], value[2], slope[2];
  double width; /* two steps before */
  int kept;     /* the end that stayed last time */
} search;

typedef struct batch {
  const frep_track *track;
  batten_context *ctx;
  size_t count, pieces; /* points, pieces */
  const double *points;
  double *values, *slopes;            /* of the best: [count], [count][3] */
  double *places, *answer, *gradient; /* [room][3], [room], [room][3] */
  size_t room;
  double *ends, *rises; /* [count][pieces + 1] values; [count][pieces][2] slopes at both ends of a piece */
  double *boxes, *most; /* [count][pieces][2][3], [..][2] */
  size_t *alive;        /* [count * pieces] */
  search *searches;     /* [2 count pieces] */
  size_t searching;
} batch;

/* A block at a time. */
static batten_status evaluate(const batch *b, size_t count) {
  batten_status st = BATTEN_OK;
  for (size_t at = 0; st >= 0 && at < count; at += FREP_BLOCK) {
    size_t now = count - at < FREP_BLOCK ? count - at : FREP_BLOCK;
    st = frep_evaluate_block(b->track->child, b->ctx, now, b->places + 3 * at, b->answer + at, b->gradient + 3 * at);
  }
  return st;
}

static double rise(const batch *b, size_t piece, double u, const double *gradient) {
  double v[3];
  b->track->velocity(b->track->user, piece, u, v);
  return gradient[0] * v[0] + gradient[1] * v[1] + gradient[2] * v[2];
}

static void place(const batch *b, size_t point, size_t piece, double u, double *y) {
  b->track->place(b->track->user, piece, u, b->points + point * b->track->n, y);
}

static void keep_best(const batch *b, size_t point, size_t at) {
  if (!(b->answer[at] > b->values[point])) return;
  b->values[point] = b->answer[at];
  memcpy(b->slopes + 3 * point, b->gradient + 3 * at, 3 * sizeof(double));
}

static batten_status see_ends(const batch *b) {
  size_t all = b->pieces + 1;
  for (size_t i = 0; i < b->count; i++)
    for (size_t k = 0; k < all; k++)
      place(b, i, k < b->pieces ? k : k - 1, k < b->pieces ? 0 : 1, b->places + 3 * (i * all + k));
  batten_status st = evaluate(b, b->count * all);
  for (size_t i = 0; st >= 0 && i < b->count; i++) {
    memcpy(b->slopes + 3 * i, b->gradient + 3 * i * all, 3 * sizeof(double));
    b->values[i] = b->answer[i * all];
    for (size_t k = 0; k < all; k++) {
      size_t at = i * all + k;
      b->ends[at] = b->answer[at];
      keep_best(b, i, at);
      if (k < b->pieces) b->rises[2 * (i * b->pieces + k)] = rise(b, k, 0, b->gradient + 3 * at);
      if (k > 0) b->rises[2 * (i * b->pieces + k - 1) + 1] = rise(b, k - 1, 1, b->gradient + 3 * at);
    }
  }
  return st;
}

static batten_status bound_boxes(const frep_track *track, batten_context *ctx, size_t count, const double *boxes,
                                 double *ranges) {
  batten_status st = BATTEN_OK;
  for (size_t at = 0; st >= 0 && at < count; at += FREP_BLOCK) {
    size_t now = count - at < FREP_BLOCK ? count - at : FREP_BLOCK;
    st = frep_bounds_block(track->child, ctx, now, boxes + 6 * at, ranges + 2 * at);
  }
  return st;
}

/* Pieces that may hold more than what has been found. */
static batten_status find_alive(const batch *b, size_t *alive) {
  const frep_track *track = b->track;
  for (size_t i = 0; i < b->count; i++)
    for (size_t k = 0; k < b->pieces; k++) {
      interval x[3], y[3];
      for (unsigned j = 0; j < track->n; j++) x[j] = interval_of(b->points[i * track->n + j]);
      track->image(track->user, k, 0, 1, x, y);
      frep_intervals_box(3, y, b->boxes + 6 * (i * b->pieces + k));
    }
  batten_status st = bound_boxes(track, b->ctx, b->count * b->pieces, b->boxes, b->most);
  *alive = 0;
  for (size_t at = 0; st >= 0 && at < b->count * b->pieces; at++)
    if (b->most[2 * at + 1] > b->values[at / b->pieces]) b->alive[(*alive)++] = at;
  return st;
}

static void start_search(batch *b, size_t point, size_t piece, const double u[2], const double value[2],
                         const double slope[2]) {
  search s = {.point = point, .piece = piece, .width = INFINITY, .kept = -1};
  int first;
  if (slope[0] > 0 && (slope[1] < 0 || value[1] <= value[0]))
    first = 0;
  else if (slope[1] < 0 && value[0] <= value[1])
    first = 1;
  else
    return;
  double way = first ? -1 : 1;
  for (int k = 0; k < 2; k++) {
    int from = first ? 1 - k : k;
    s.u[k] = u[from];
    s.value[k] = value[from];
    s.slope[k] = way * slope[from];
  }
  b->searches[b->searching++] = s;
}

static batten_status halve(batch *b, size_t alive) {
  for (size_t j = 0; j < alive; j++)
    place(b, b->alive[j] / b->pieces, b->alive[j] % b->pieces, 0.5, b->places + 3 * j);
  batten_status st = evaluate(b, alive);
  for (size_t j = 0; st >= 0 && j < alive; j++) {
    size_t at = b->alive[j], point = at / b->pieces, piece = at % b->pieces;
    double middle = rise(b, piece, 0.5, b->gradient + 3 * j);
    const double *value = b->ends + point * (b->pieces + 1) + piece, *slope = b->rises + 2 * at;
    keep_best(b, point, j);
    start_search(b, point, piece, (const double[2]){0, 0.5}, (const double[2]){value[0], b->answer[j]},
                 (const double[2]){slope[0], middle});
    start_search(b, point, piece, (const double[2]){0.5, 1}, (const double[2]){b->answer[j], value[1]},
                 (const double[2]){middle, slope[1]});
  }
  return st;
}

static double next_place(search *s, int step) {
  double width = fabs(s->u[1] - s->u[0]), middle = s->u[0] + (s->u[1] - s->u[0]) / 2;
  bool slow = width > 0.5 * s->width; /* not halved in two steps */
  if (step % 2 == 0) s->width = width;
  if (slow || !(s->slope[1] < 0)) return middle;
  double u = s->u[0] + (s->u[1] - s->u[0]) * (s->slope[0] / (s->slope[0] - s->slope[1]));
  double least = fmin(s->u[0], s->u[1]), most = fmax(s->u[0], s->u[1]), inset = 0.25e-9;
  return fmin(fmax(u, least + inset), most - inset);
}

/* The end that the new place replaces; false when nothing is left to look for. */
static bool narrow(search *s, double u, double value, double slope) {
  if (slope == 0 && value >= s->value[0]) return false;
  int end = slope < 0 || value < s->value[0];
  int other = 1 - end;
  if (s->kept == other) s->slope[other] /= 2; /* Illinois */
  s->kept = other;
  s->u[end] = u;
  s->value[end] = value;
  s->slope[end] = slope;
  return fabs(s->u[1] - s->u[0]) > 1e-9;
}

static batten_status close_in(batch *b) {
  batten_status st = BATTEN_OK;
  for (int step = 0; st >= 0 && step < STEPS && b->searching > 0; step++) {
    size_t left = 0;
    for (size_t first = 0; st >= 0 && first < b->searching; first += b->room) {
      size_t now = b->searching - first < b->room ? b->searching - first : b->room;
      double *u = b->most; /* the bounds have done their work */
      for (size_t j = 0; j < now; j++) {
        search *s = b->searches + first + j;
        u[j] = next_place(s, step);
        place(b, s->point, s->piece, u[j], b->places + 3 * j);
      }
      st = evaluate(b, now);
      for (size_t j = 0; st >= 0 && j < now; j++) {
        search s = b->searches[first + j];
        double way = s.u[1] > s.u[0] ? 1 : -1;
        keep_best(b, s.point, j);
        if (narrow(&s, u[j], b->answer[j], way * rise(b, s.piece, u[j], b->gradient + 3 * j)))
          b->searches[left++] = s;
      }
    }
    b->searching = left;
  }
  return st;
}

static void free_batch(batch *b) {
  batten_free(b->ctx, b->slopes);
  batten_free(b->ctx, b->places);
  batten_free(b->ctx, b->answer);
  batten_free(b->ctx, b->gradient);
  batten_free(b->ctx, b->ends);
  batten_free(b->ctx, b->rises);
  batten_free(b->ctx, b->boxes);
  batten_free(b->ctx, b->most);
  batten_free(b->ctx, b->alive);
  batten_free(b->ctx, b->searches);
}

static bool take_batch(batch *b, size_t most) {
  size_t all = most * b->pieces; /* both at most about FREP_BLOCK, or one of them 1 */
  b->room = most * (b->pieces + 1);
  b->slopes = batten_alloc_array(b->ctx, most, 3 * sizeof *b->slopes);
  b->places = batten_alloc_array(b->ctx, b->room, 3 * sizeof *b->places);
  b->answer = batten_alloc_array(b->ctx, b->room, sizeof *b->answer);
  b->gradient = batten_alloc_array(b->ctx, b->room, 3 * sizeof *b->gradient);
  b->ends = batten_alloc_array(b->ctx, b->room, sizeof *b->ends);
  b->rises = batten_alloc_array(b->ctx, all, 2 * sizeof *b->rises);
  b->boxes = batten_alloc_array(b->ctx, all, 6 * sizeof *b->boxes);
  b->most = batten_alloc_array(b->ctx, b->room, 2 * sizeof *b->most);
  b->alive = batten_alloc_array(b->ctx, all, sizeof *b->alive);
  b->searches = batten_alloc_array(b->ctx, all, 2 * sizeof *b->searches);
  return b->slopes && b->places && b->answer && b->gradient && b->ends && b->rises && b->boxes && b->most &&
         b->alive && b->searches;
}

/* Points whose pieces fill about a block. */
static size_t batch_size(const frep_track *track, size_t count) {
  size_t most = FREP_BLOCK / (track->pieces + 1);
  return most < 1 ? 1 : most < count ? most : count;
}

batten_status frep_highest(const frep_track *track, batten_context *ctx, size_t count, const double *points,
                           double *values, double *slopes) {
  batch b = {.track = track, .ctx = ctx, .pieces = track->pieces};
  size_t most = batch_size(track, count), alive = 0;
  batten_status st = take_batch(&b, most) ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t first = 0; st >= 0 && first < count; first += most) {
    b.count = count - first < most ? count - first : most;
    b.points = points + first * track->n;
    b.values = values + first;
    b.searching = 0;
    st = see_ends(&b);
    if (st >= 0) st = find_alive(&b, &alive);
    if (st >= 0) st = halve(&b, alive);
    if (st >= 0) st = close_in(&b);
    if (st >= 0 && slopes) memcpy(slopes + 3 * first, b.slopes, 3 * b.count * sizeof *slopes);
  }
  free_batch(&b);
  return st;
}

/* ---- boxes ---------------------------------------------------------------------------------------- */

/* Images of the pieces, then of their ends: boxes [2 pieces + 1][2][3]. */
static size_t put_images(const frep_track *track, const double *box, bool ends, double *boxes) {
  interval x[3], y[3];
  frep_box_intervals(track->n, box, x);
  size_t made = 0;
  for (size_t k = 0; k < track->pieces; k++) {
    track->image(track->user, k, 0, 1, x, y);
    frep_intervals_box(3, y, boxes + 6 * made++);
  }
  for (size_t k = 0; ends && k <= track->pieces; k++) {
    bool last = k == track->pieces;
    track->image(track->user, last ? k - 1 : k, last, last, x, y);
    frep_intervals_box(3, y, boxes + 6 * made++);
  }
  return made;
}

batten_status frep_highest_bounds(const frep_track *track, batten_context *ctx, size_t count, const double *boxes,
                                  double *ranges) {
  size_t each = 2 * track->pieces + 1, most = batch_size(track, count);
  double *images = batten_alloc_array(ctx, most * each, 6 * sizeof *images);
  double *found = images ? batten_alloc_array(ctx, most * each, 2 * sizeof *found) : NULL;
  batten_status st = found ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t first = 0; st >= 0 && first < count; first += most) {
    size_t now = count - first < most ? count - first : most;
    for (size_t i = 0; i < now; i++)
      put_images(track, boxes + (first + i) * 2 * track->n, true, images + 6 * i * each);
    st = bound_boxes(track, ctx, now * each, images, found);
    for (size_t i = 0; st >= 0 && i < now; i++) {
      const double *of = found + 2 * i * each;
      double *range = ranges + 2 * (first + i);
      range[0] = range[1] = -INFINITY;
      for (size_t k = 0; k < track->pieces; k++) range[1] = fmax(range[1], of[2 * k + 1]);
      for (size_t k = track->pieces; k < each; k++) range[0] = fmax(range[0], of[2 * k]);
      range[1] = fmax(range[1], range[0]);
    }
  }
  batten_free(ctx, found);
  batten_free(ctx, images);
  return st;
}

batten_status frep_highest_slopes(const frep_track *track, batten_context *ctx, size_t count, const double *boxes,
                                  double *slopes) {
  double *images = batten_alloc_array(ctx, track->pieces, 6 * sizeof *images);
  double *found = images ? batten_alloc_array(ctx, track->pieces, sizeof *found) : NULL;
  batten_status st = found ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t i = 0; st >= 0 && i < count; i++) {
    put_images(track, boxes + i * 2 * track->n, false, images);
    slopes[i] = 0;
    for (size_t at = 0; st >= 0 && at < track->pieces; at += FREP_BLOCK) {
      size_t now = track->pieces - at < FREP_BLOCK ? track->pieces - at : FREP_BLOCK;
      st = frep_slopes_block(track->child, ctx, now, images + 6 * at, found + at);
    }
    for (size_t k = 0; st >= 0 && k < track->pieces; k++) slopes[i] = fmax(slopes[i], found[k]);
  }
  batten_free(ctx, found);
  batten_free(ctx, images);
  return st;
}
