/* Bounds of the swept solid over boxes in space: where in the moving frame a box is, for which t. See swept.c.
 *
 * With y = M (p - o) a point moves in the moving frame by y' = -omega x y - M o'. Over a piece of the path rate and
 * velocity are known as intervals, and so y over the piece from y at its middle, for all points of the box together.
 * Where the height g = y_z is certain not to vanish the box has no place in the piece; where its derivative is
 * certain not to vanish, Newton's method for intervals narrows t. What is left is a unit: a box in (x, y, t), whose
 * bounds the blend tells.
 *
 * f is the largest value of all places of a point, each of which lies in some unit, and every point has one: f lies
 * between the least lower bound and the largest upper one of all units. Units beside each other form a cluster; where
 * g has certain and different signs before and after it, every point has a place in that cluster alone, and its lower
 * bound counts. */
#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "base/checked.h"
#include "mesh/vec.h"
#include "section/path.h"

enum { FLUSH = 4096 }; /* units that are blended together */

/* A box by its middle and half extents, and how large rounding makes its heights. */
typedef struct space_box {
  double middle[3], half[3], reach, slack;
} space_box;

typedef struct swept_unit {
  size_t box;
  ptrdiff_t at;      /* between the sections at and at + 1; -1, count - 1: beyond an end */
  interval beyond;   /* there */
  int before, after; /* sign of g at the sections at and at + 1: -1, 1; 0: not certain */
} swept_unit;

typedef struct swept_units {
  const stack *s;
  const stack_plane *planes;
  const stack_piece *pieces;
  size_t count, capacity;
  swept_unit *units;
  double (*boxes)[2][3]; /* x, y, t */
} swept_units;

static space_box take_box(const double *box) {
  space_box b = {.reach = 0};
  double size = 0;
  for (int k = 0; k < 3; k++) {
    b.middle[k] = box[k] / 2 + box[3 + k] / 2;
    b.half[k] = fmax(box[3 + k] - b.middle[k], b.middle[k] - box[k]);
    size = fmax(size, fmax(fabs(box[k]), fabs(box[3 + k])));
  }
  b.reach = vec_norm(b.half) * (1 + 4 * DBL_EPSILON);
  b.slack = 32 * DBL_EPSILON * size;
  return b;
}

/* row . (p - origin) over the box. */
static interval box_coordinate(const space_box *b, const double row[3], const double origin[3]) {
  double d[3], far = 0, size = 0;
  vec_sub(b->middle, origin, d);
  for (int k = 0; k < 3; k++) {
    far += fabs(row[k]) * b->half[k];
    size = fmax(size, fabs(origin[k]));
  }
  double at = vec_dot(row, d);
  far += b->slack + 32 * DBL_EPSILON * size;
  return (interval){at - far, at + far};
}

static int certain_sign(interval g) { return g.lo > 0 ? 1 : g.hi < 0 ? -1 : 0; }

/* y over [t0, t1] within a piece, and y'. */
static void moving_box(const stack_piece *piece, const space_box *b, double t0, double t1, interval y[3],
                       interval middle[3], interval dy[3]) {
  stack_frame f;
  double t = t0 + (t1 - t0) / 2, half = fmax(t1 - t, t - t0);
  stack_piece_frame(piece, t, &f);
  double far = vec_distance(b->middle, piece->middle) + piece->reach + b->reach; /* |y| at most, over the piece */
  far = far * (1 + 8 * DBL_EPSILON) + b->slack;
  interval crude[3];
  for (int k = 0; k < 3; k++) {
    middle[k] = box_coordinate(b, f.rotation[k], f.origin);
    crude[k] = (interval){-far, far};
  }
  interval from = {-half, half};
  for (int round = 0; round < 2; round++) /* y' from what is known of y, and y from that */
    for (int i = 0; i < 3; i++) {
      int j = (i + 1) % 3, k = (i + 2) % 3;
      const interval *known = round ? y : crude;
      interval turn = interval_sub(interval_mul(piece->rate[k], known[j]), interval_mul(piece->rate[j], known[k]));
      dy[i] = interval_sub(turn, piece->velocity[i]);
      if (round) continue;
      y[i] = interval_add(middle[i], interval_mul(from, dy[i]));
    }
  for (int i = 0; i < 3; i++) y[i] = interval_meet(y[i], interval_add(middle[i], interval_mul(from, dy[i])));
}

/* What a box has in an interval so far. */
typedef struct unit_hull {
  bool any;
  interval x, y, t;
} unit_hull;

static void hull_add(unit_hull *u, const interval y[3], double t0, double t1) {
  interval t = {t0, t1};
  u->x = u->any ? interval_hull(u->x, y[0]) : y[0];
  u->y = u->any ? interval_hull(u->y, y[1]) : y[1];
  u->t = u->any ? interval_hull(u->t, t) : t;
  u->any = true;
}

/* All places of the box in a piece. */
static void piece_roots(const stack_piece *piece, const space_box *b, unit_hull *u) {
  double t0 = piece->t0, t1 = piece->t1;
  const double least = 16 * DBL_EPSILON * fmax(fabs(t0), fabs(t1)); /* how far t is found */
  interval y[3], middle[3], dy[3];
  for (int round = 0; round < 6; round++) {
    moving_box(piece, b, t0, t1, y, middle, dy);
    if (certain_sign(y[2])) return;
    if (!certain_sign(dy[2]) || !(t1 - t0 > 4 * least)) break;
    interval t = interval_sub(interval_of(t0 + (t1 - t0) / 2), interval_div(middle[2], dy[2]));
    double low = fmax(t0, t.lo - least), high = fmin(t1, t.hi + least);
    if (!(low <= high)) return;
    bool slow = high - low > 0.7 * (t1 - t0);
    t0 = low;
    t1 = high;
    if (slow) break; /* y over the wider range will do */
  }
  hull_add(u, y, t0, t1);
}

/* The places by the ratio of distances, heights g0 and g1 over both planes. */
static void ratio_places(const stack_piece *pieces, const space_box *b, interval g0, interval g1, unit_hull *u) {
  interval share = {1, 0};
  for (int turn = 0; turn < 2; turn++) { /* from above the first plane to below the second, and the other way */
    interval a = turn ? interval_neg(g0) : g0, c = turn ? g1 : interval_neg(g1);
    if (a.hi < 0 || c.hi < 0) continue;
    a.lo = fmax(a.lo, 0);
    c.lo = fmax(c.lo, 0);
    share.lo = fmin(share.lo, a.lo + c.hi > 0 ? a.lo / (a.lo + c.hi) : 0);
    share.hi = fmax(share.hi, a.hi + c.lo > 0 ? a.hi / (a.hi + c.lo) : 1);
  }
  double from = pieces[0].t0, h = pieces[STACK_PATH_PIECES - 1].t1 - from;
  double least = 16 * DBL_EPSILON * (fabs(from) + h);
  double t0 = from + share.lo * h - least, t1 = from + share.hi * h + least;
  for (int j = 0; j < STACK_PATH_PIECES && share.lo <= share.hi; j++) {
    double low = fmax(t0, pieces[j].t0), high = fmin(t1, pieces[j].t1);
    interval y[3], middle[3], dy[3];
    if (!(low <= high)) continue;
    moving_box(pieces + j, b, low, high, y, middle, dy);
    hull_add(u, y, low, high);
  }
}

/* May g vanish between two planes at which it has the same certain sign? Not if it cannot fall so fast. */
static bool may_touch(const stack_piece *pieces, const space_box *b, interval g0, interval g1) {
  double fall = 0, h = pieces[STACK_PATH_PIECES - 1].t1 - pieces[0].t0;
  for (int j = 0; j < STACK_PATH_PIECES; j++) {
    const stack_piece *p = pieces + j;
    double far = vec_distance(b->middle, p->middle) + p->reach + b->reach;
    fall = fmax(fall, p->turn_most * far + p->advance_most);
  }
  double sum = g0.lo > 0 ? g0.lo + g1.lo : -g0.hi - g1.hi;
  return !(sum > fall * h * (1 + 8 * DBL_EPSILON));
}

/* ---- lists of units ----------------------------------------------------------------------------------------------
 */

static void put_unit(swept_units *list, size_t box, ptrdiff_t at, const unit_hull *u, interval beyond, int before,
                     int after) {
  list->units[list->count] = (swept_unit){box, at, beyond, before, after};
  double(*place)[3] = list->boxes[list->count++];
  place[0][0] = u->x.lo, place[1][0] = u->x.hi;
  place[0][1] = u->y.lo, place[1][1] = u->y.hi;
  place[0][2] = u->t.lo, place[1][2] = u->t.hi;
}

static void put_end(swept_units *list, size_t box, const space_box *b, int end, interval height) {
  const stack_plane *plane = list->planes + (end ? list->s->count - 1 : 0);
  unit_hull u = {.any = true,
                 .x = box_coordinate(b, plane->rotation[0], plane->origin),
                 .y = box_coordinate(b, plane->rotation[1], plane->origin),
                 .t = interval_of(plane->t)};
  interval beyond = end ? height : interval_neg(height);
  beyond.lo = fmax(beyond.lo, 0);
  int before = end ? certain_sign(height) : 1, after = end ? -1 : certain_sign(height);
  put_unit(list, box, end ? (ptrdiff_t)list->s->count - 1 : -1, &u, beyond, before, after);
}

static batten_status need(swept_units *list, batten_context *ctx, size_t more) {
  if (list->count + more <= list->capacity) return BATTEN_OK;
  size_t capacity = list->capacity + list->capacity / 2 + more;
  swept_unit *units = batten_realloc_array(ctx, list->units, capacity, sizeof *units);
  if (!units) return BATTEN_E_NOMEM;
  list->units = units;
  void *boxes = batten_realloc_array(ctx, list->boxes, capacity, sizeof *list->boxes);
  if (!boxes) return BATTEN_E_NOMEM;
  list->boxes = boxes;
  list->capacity = capacity;
  return BATTEN_OK;
}

/* The units of a box, in the order of t; room for all is there. */
static void list_units(swept_units *list, size_t box, const double *corners) {
  space_box b = take_box(corners);
  const stack_plane *plane = list->planes;
  interval before = box_coordinate(&b, plane->rotation[2], plane->origin);
  if (before.lo <= 0) put_end(list, box, &b, 0, before);
  for (size_t i = 0; i + 1 < list->s->count; i++) {
    plane = list->planes + i + 1;
    const stack_piece *pieces = list->pieces + STACK_PATH_PIECES * i;
    interval after = box_coordinate(&b, plane->rotation[2], plane->origin);
    int signs[2] = {certain_sign(before), certain_sign(after)};
    bool differ = signs[0] == 0 || signs[0] != signs[1];
    unit_hull u = {.any = false};
    if (list->s->parameter == BATTEN_PARAMETER_RATIO) {
      if (differ) ratio_places(pieces, &b, before, after, &u);
    } else if (differ || may_touch(pieces, &b, before, after)) {
      for (int j = 0; j < STACK_PATH_PIECES; j++) piece_roots(pieces + j, &b, &u);
    }
    if (u.any) put_unit(list, box, (ptrdiff_t)i, &u, interval_of(0), signs[0], signs[1]);
    before = after;
  }
  if (before.hi >= 0) put_end(list, box, &b, 1, before);
}

static interval end_rules(const stack *s, const swept_unit *u, const double (*box)[3], interval value) {
  if (u->at < 0 || u->at + 1 == (ptrdiff_t)s->count) return stack_end_bounds(s, u->at < 0 ? 0 : 1, value, u->beyond);
  for (unsigned end = 0; end < 2; end++) {
    double speed = stack_path_speed(s->path, end), edge = s->sections[end ? s->count - 1 : 0].t;
    interval along = {box[0][2], box[1][2]};
    interval beyond = interval_scale(interval_sub(along, interval_of(edge)), end ? speed : -speed);
    beyond.hi = fmin(beyond.hi, 0);
    value = stack_end_bounds(s, end, value, beyond);
  }
  return value;
}

/* Ranges of the boxes that the list has units of. */
static batten_status flush(swept_units *list, batten_context *ctx, double *ranges) {
  double *values = batten_alloc_array(ctx, list->count, 2 * sizeof *values);
  if (!values) return BATTEN_E_NOMEM;
  batten_status st = stack_blend_bounds(list->s, ctx, list->count, (double *)list->boxes, values);
  for (size_t k = 0; k < list->count && st >= 0;) {
    size_t box = list->units[k].box;
    double least = INFINITY, largest = -INFINITY, certain = -INFINITY;
    while (k < list->count && list->units[k].box == box) { /* a cluster */
      int before = list->units[k].before, after = 0;
      double cluster = INFINITY;
      ptrdiff_t at = list->units[k].at;
      for (; k < list->count && list->units[k].box == box && list->units[k].at == at; k++, at++) {
        interval r = end_rules(list->s, list->units + k, (const double(*)[3])list->boxes[k],
                               (interval){values[2 * k], values[2 * k + 1]});
        cluster = fmin(cluster, r.lo);
        largest = fmax(largest, r.hi);
        after = list->units[k].after;
      }
      least = fmin(least, cluster);
      if (before * after < 0) certain = fmax(certain, cluster);
    }
    ranges[2 * box] = fmax(least, certain);
    ranges[2 * box + 1] = largest;
  }
  list->count = 0;
  batten_free(ctx, values);
  return st;
}

batten_status stack_swept_bounds(const stack *s, batten_context *ctx, size_t count, const double *boxes,
                                 double *ranges) {
  swept_units list = {.s = s};
  stack_path_planes(s->path, &list.planes);
  stack_path_pieces(s->path, &list.pieces);
  batten_status st = BATTEN_OK;
  for (size_t i = 0; i < count && st >= 0; i++) {
    ranges[2 * i] = -INFINITY;
    ranges[2 * i + 1] = INFINITY;
    st = need(&list, ctx, s->count + 1);
    if (st < 0) break;
    list_units(&list, i, boxes + 6 * i);
    if (list.count >= FLUSH || i + 1 == count) st = flush(&list, ctx, ranges);
  }
  batten_free(ctx, list.boxes);
  batten_free(ctx, list.units);
  return st;
}
