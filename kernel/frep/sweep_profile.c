/* Profiles swept along a path: the union of all places of a plane solid g in the planes across the path.
 *
 * Smooth paths: f(x) = max over all t at which the plane across the path passes through x of meet(g(y), w), y the
 * place of x in the frame there, w the way along the path to its nearer end (of open paths; beyond the ends the path
 * goes straight on, where w is negative). There is always such a t: on the straight rays, or the nearest place of a
 * closed path. Where planes cross within the profile f is still the exact union.
 *
 * Gradient. The frame turns as little as can be: r' = -(r . T') T, so that at a root dy/dt = 0 and dy/dx are the
 * frame's axes; the spin that closes a closed path adds (y2, -y1) spin dt/dx, and dt/dx = -o' / h_t.
 *
 * Bounds. A piece of the path counts for a box where its h may be 0; where h falls all along the piece, its slope
 * tells in which part of it. For x with a root in that part, |h| <= H = length + reach turn all along it (length and
 * turn of the part), and y there differs from y in the frame of its middle by at most turn H, as dy/dt = -(r . T') h.
 * The frame by double reflection is not quite that: it is transported along another curve on the sphere of
 * directions, and the angle between both is the area between the curves and what a turn along a small circle of
 * radius almost 1 adds: together below 3 turn^2 of the piece so far; from the middle of the part to the root it
 * changes by less than 12 times the turn of the piece by that of the part. From below: pieces that count follow upon
 * one another in groups. Where h is of one sign ahead of a group and of the other behind it, there is a root within
 * it, and f is at least the least value of the group.
 *
 * Polylines: the union of straight pieces, each ended by the planes through its ends. */
#include <string.h>

#include "frep/gather.h"
#include "frep/sweep_profile.h"

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void difference(const double *a, const double *b, double *out) {
  for (int k = 0; k < 3; k++) out[k] = a[k] - b[k];
}

/* y in a frame at o. */
static void put_place(frep_place *p, double axes[2][3], const double *q) {
  for (int i = 0; i < 2; i++) {
    p->y[i] = dot(axes[i], q);
    memcpy(p->jacobian[i], axes[i], sizeof p->jacobian[i]);
  }
}

/* ---- points, smooth paths --------------------------------------------------------------------------- */

static void place_at(const sweep_path *path, size_t piece, double u, const double *x, frep_place *place) {
  const sweep_piece *p = path->piece + piece;
  double o[3], slope[3], bend[3], q[3], axes[2][3];
  sweep_piece_at(p, u, o, slope, bend);
  sweep_frame_at(path, piece, u, axes);
  difference(x, o, q);
  put_place(place, axes, q);
  place->limit = INFINITY;
  double square = dot(slope, slope), fall = square - dot(bend, q);
  /* at a fold two planes become one, and t jumps: no slope */
  double rate = fabs(fall) > 1e-12 * square ? p->span / fall : 0;
  double t = p->start + p->span * u;
  if (!path->closed) {
    place->limit = fmin(t, path->total - t);
    double way = t <= path->total - t ? rate : -rate;
    for (int k = 0; k < 3; k++) place->limit_slope[k] = way * slope[k];
  } else {
    for (int k = 0; k < 3; k++) {
      double by = path->spin * rate * slope[k];
      place->jacobian[0][k] += by * place->y[1];
      place->jacobian[1][k] -= by * place->y[0];
    }
  }
}

/* The straight rays: end 0 before the path, 1 after it. False where x lies within. */
static bool place_beyond(const sweep_path *path, int end, const double *x, frep_place *place) {
  const sweep_node *node = path->node + (end ? path->pieces : 0);
  size_t piece = end ? path->pieces - 1 : 0;
  double q[3], axes[2][3], slope[3], o[3], span = path->piece[piece].span;
  difference(x, node->o, q);
  double side = dot(node->tangent, q);
  if (end ? !(side >= 0) : side >= 0) return false;
  sweep_piece_at(path->piece + piece, end, o, slope, NULL);
  sweep_frame_at(path, piece, end, axes);
  put_place(place, axes, q);
  double rate = (end ? -1 : 1) * span / sqrt(dot(slope, slope)); /* of t by the way along the tangent */
  place->limit = side * rate;
  for (int k = 0; k < 3; k++) place->limit_slope[k] = rate * node->tangent[k];
  return true;
}

static batten_status evaluate_smooth(const sweep_path *path, frep_gather *g, size_t count, const double *points) {
  batten_status st = BATTEN_OK;
  frep_place place = {0};
  for (size_t i = 0; st >= 0 && i < count; i++) {
    double x[3], roots[5];
    difference(points + 3 * i, path->base, x);
    for (int end = 0; st >= 0 && end < 2 && !path->closed; end++)
      if (place_beyond(path, end, x, &place)) st = frep_gather_add(g, i, &place);
    for (size_t k = sweep_next_near(path, 0, x, 0); st >= 0 && k < path->pieces;
         k = sweep_next_near(path, k + 1, x, 0)) {
      size_t found = sweep_roots(path, k, x, roots);
      for (size_t j = 0; st >= 0 && j < found; j++) {
        place_at(path, k, roots[j], x, &place);
        st = frep_gather_add(g, i, &place);
      }
    }
  }
  return st;
}

/* ---- points, polylines ------------------------------------------------------------------------------ */

static double way_along(const sweep_path *path, size_t piece, const double *x, double *q) {
  const sweep_node *node = path->node + piece;
  difference(x, node->o, q);
  return dot(node->tangent, q);
}

static double limit_of(const sweep_path *path, size_t piece, const double *x) {
  double q[3], t = way_along(path, piece, x, q);
  return fmin(t, path->piece[piece].span - t);
}

static void place_straight(const sweep_path *path, size_t piece, const double *x, frep_place *place) {
  double q[3], axes[2][3], t = way_along(path, piece, x, q), rest = path->piece[piece].span - t;
  sweep_frame_at(path, piece, 0, axes);
  put_place(place, axes, q);
  place->limit = fmin(t, rest);
  for (int k = 0; k < 3; k++) place->limit_slope[k] = (t <= rest ? 1 : -1) * path->node[piece].tangent[k];
}

static size_t farthest_in(const sweep_path *path, const double *x) {
  size_t best = 0;
  double most = -INFINITY;
  for (size_t k = 0; k < path->pieces; k++) {
    double limit = limit_of(path, k, x);
    if (!(limit > most)) continue;
    most = limit;
    best = k;
  }
  return best;
}

/* A piece cannot give more than its limit: first the one of the highest, then those that may still give more. */
static batten_status evaluate_straight(const sweep_path *path, frep_gather *g, size_t count, const double *points,
                                       const double *values) {
  batten_status st = BATTEN_OK;
  frep_place place = {0};
  double x[3];
  for (size_t i = 0; st >= 0 && i < count; i++) {
    difference(points + 3 * i, path->base, x);
    place_straight(path, farthest_in(path, x), x, &place);
    st = frep_gather_add(g, i, &place);
  }
  if (st >= 0) st = frep_gather_flush(g);
  for (size_t i = 0; st >= 0 && i < count && path->pieces > 1; i++) {
    difference(points + 3 * i, path->base, x);
    size_t first = farthest_in(path, x);
    for (size_t k = 0; st >= 0 && k < path->pieces; k++) {
      if (k == first || !(limit_of(path, k, x) > values[i])) continue;
      place_straight(path, k, x, &place);
      st = frep_gather_add(g, i, &place);
    }
  }
  return st;
}

batten_status frep_profile_evaluate(const batten_frep *a, const sweep_path *path, batten_context *ctx, size_t count,
                                    const double *points, double *values, double *gradients) {
  frep_gather *g = NULL;
  batten_status st = frep_gather_new(ctx, a, count, values, gradients, &g);
  if (st >= 0)
    st = path->smooth ? evaluate_smooth(path, g, count, points) : evaluate_straight(path, g, count, points, values);
  if (st >= 0) st = frep_gather_flush(g);
  frep_gather_free(g);
  return st;
}

/* ---- boxes ------------------------------------------------------------------------------------------ */

static void offset_from(const interval *x, const double *o, interval *q) {
  for (int k = 0; k < 3; k++) q[k] = interval_sub(x[k], interval_of(o[k]));
}

static double reach_of(const interval *q) {
  interval all = {0, 0};
  for (int k = 0; k < 3; k++) all = interval_add(all, interval_square(q[k]));
  return sqrt(all.hi) * (1 + 1e-15);
}

/* Rounding of what is computed from places of this size along the path: some hundred operations. */
static double rounding(const sweep_path *path, const interval *x) {
  double size = path->total;
  for (int k = 0; k < 3; k++) size += fabs(x[k].lo) + fabs(x[k].hi);
  return 1e-13 * size;
}

static interval wider(interval a, double by) { return (interval){a.lo - by, a.hi + by}; }

/* How the sign of h at a node stands in a box: > 0, < 0, 0 where both may be. */
static int sign_at(const sweep_path *path, size_t node, const interval *x) {
  interval q[3];
  offset_from(x, path->node[node].o, q);
  interval h = wider(frep_linear_range(3, path->node[node].tangent, q), rounding(path, x));
  return h.lo > 0 ? 1 : h.hi < 0 ? -1 : 0;
}

/* What most pieces are: all coefficients of h at the middle of the box are farther from 0, on one side, than they
 * change in it, as no plane's normal is longer than the fastest slope. */
static bool is_far(const sweep_piece *p, const interval *x, double slack) {
  double q[3], half[3], least = INFINITY, most = -INFINITY;
  for (int k = 0; k < 3; k++) {
    half[k] = x[k].hi / 2 - x[k].lo / 2;
    q[k] = x[k].lo / 2 + x[k].hi / 2 - p->b[0][k];
  }
  for (int i = 0; i < 6; i++) {
    double h = dot(p->plane[i], q) - p->offset[i];
    least = fmin(least, h);
    most = fmax(most, h);
  }
  double change = p->fast * sqrt(dot(half, half)) * (1 + 1e-12) + slack;
  return least > change || most < -change;
}

/* May the piece have a root for some x of the box; if so, where. */
static bool root_range(const sweep_path *path, size_t piece, const interval *x, interval *u) {
  const sweep_piece *p = path->piece + piece;
  interval q[3], hull = {INFINITY, -INFINITY}, h[6];
  double slack = rounding(path, x) * p->fast;
  if (is_far(p, x, slack)) return false;
  offset_from(x, p->b[0], q);
  for (int i = 0; i < 6; i++) {
    h[i] = wider(interval_sub(frep_linear_range(3, p->plane[i], q), interval_of(p->offset[i])), slack);
    hull = interval_hull(hull, h[i]);
  }
  *u = (interval){0, 1};
  if (hull.lo > 0 || hull.hi < 0) return false;
  interval turned = interval_hull(frep_linear_range(3, p->second[0], q), frep_linear_range(3, p->second[1], q));
  turned = wider(turned, p->bend * p->length + rounding(path, x) * p->bend);
  double slow = p->slow * p->slow - turned.hi, fast = p->fast * p->fast - turned.lo;
  if (!(slow > 0)) return true;
  /* h falls by slow .. fast all along: from both ends */
  if (h[0].hi < 0 || h[5].lo > 0) return false;
  slow *= 1 - 1e-14;
  fast *= 1 + 1e-14;
  double from = fmax(h[0].lo > 0 ? h[0].lo / fast : 0, 1 + fmin(h[5].lo, 0) / slow);
  double to = fmin(fmax(h[0].hi, 0) / slow, h[5].hi < 0 ? 1 + h[5].hi / fast : 1);
  *u = (interval){fmax(from - 1e-13, 0), fmin(to + 1e-13, 1)};
  if (u->lo > u->hi) *u = (interval){0, 1};
  return true;
}

static interval limit_range(const sweep_path *path, interval t) {
  if (path->closed) return (interval){INFINITY, INFINITY};
  interval rest = interval_sub(interval_of(path->total), t);
  interval limit = interval_min(t, rest);
  limit.hi = fmin(limit.hi, path->total / 2 * (1 + 1e-15));
  return wider(limit, 1e-14 * path->total);
}

static frep_image image_at(const sweep_path *path, size_t piece, const interval *x, interval u) {
  const sweep_piece *p = path->piece + piece;
  interval q[3];
  double o[3], axes[2][3], part = u.hi - u.lo, length = fmin(p->length, p->fast * part), turn = p->turn;
  sweep_piece_at(p, u.lo / 2 + u.hi / 2, o, NULL, NULL);
  sweep_frame_at(path, piece, u.lo / 2 + u.hi / 2, axes);
  offset_from(x, o, q);
  if (p->bend * part < turn * p->slow) turn = p->bend * part / p->slow;
  double reach = reach_of(q) + length;
  double slack =
      turn * (length + reach * turn) + 12 * p->turn * turn * reach + fabs(path->spin) * p->span * part * reach;
  slack = slack * (1 + 1e-12) + rounding(path, x);
  frep_image image = {.stretch = INFINITY};
  for (int i = 0; i < 2; i++) image.y[i] = wider(frep_linear_range(3, axes[i], q), slack);
  interval t = {p->start + p->span * u.lo, p->start + p->span * u.hi};
  image.limit = limit_range(path, t);
  return image;
}

/* The ray beyond an end, of which t is linear. */
static frep_image image_beyond(const sweep_path *path, int end, const interval *x) {
  const sweep_node *node = path->node + (end ? path->pieces : 0);
  size_t piece = end ? path->pieces - 1 : 0;
  double slope[3], axes[2][3];
  interval q[3];
  offset_from(x, node->o, q);
  sweep_piece_at(path->piece + piece, end, NULL, slope, NULL);
  sweep_frame_at(path, piece, end, axes);
  double rate = (end ? -1 : 1) * path->piece[piece].span / sqrt(dot(slope, slope)), slack = rounding(path, x);
  frep_image image = {.stretch = INFINITY};
  for (int i = 0; i < 2; i++) image.y[i] = wider(frep_linear_range(3, axes[i], q), slack);
  image.limit = wider(interval_scale(frep_linear_range(3, node->tangent, q), rate), slack);
  image.limit.hi = fmin(image.limit.hi, 0);
  return image;
}

/* One box. Slots: 0 the ray ahead, 1 .. pieces the pieces, pieces + 1 the ray behind; closed paths have no rays and
 * are gone through from a piece that does not count. counts, roots [pieces + 2] are scratch. */
static batten_status bounds_smooth(const sweep_path *path, frep_gather *g, size_t box, const interval *x,
                                   unsigned char *counts, interval *roots) {
  size_t pieces = path->pieces, slots = pieces + 2, start = 0;
  batten_status st = BATTEN_OK;
  counts[0] = !path->closed && sign_at(path, 0, x) <= 0;
  counts[slots - 1] = !path->closed && sign_at(path, pieces, x) >= 0;
  double middle[3], half[3];
  for (int k = 0; k < 3; k++) {
    middle[k] = x[k].lo / 2 + x[k].hi / 2;
    half[k] = x[k].hi / 2 - x[k].lo / 2;
  }
  double reach = sqrt(dot(half, half));
  memset(counts + 1, 0, pieces);
  for (size_t k = sweep_next_near(path, 0, middle, reach); k < pieces;
       k = sweep_next_near(path, k + 1, middle, reach))
    counts[k + 1] = root_range(path, k, x, roots + k + 1);
  if (path->closed) {
    while (start < pieces && counts[start + 1]) start++;
    if (start == pieces) start = 0; /* all count: none is sure, but there is a root somewhere */
  }
  size_t group = 0, steps = path->closed ? pieces : slots;
  for (size_t i = 0; st >= 0 && i < steps;) {
    size_t slot = path->closed ? 1 + (start + i) % pieces : i;
    if (!counts[slot]) {
      i++;
      continue;
    }
    size_t last = i; /* the group: i .. last */
    while (last + 1 < steps && counts[path->closed ? 1 + (start + last + 1) % pieces : last + 1]) last++;
    size_t end = path->closed ? 1 + (start + last) % pieces : last;
    /* far ahead of an open path h is > 0, far behind it < 0 */
    int before = slot == 0 ? 1 : sign_at(path, slot - 1, x);
    int behind = end == slots - 1 ? -1 : sign_at(path, end, x);
    bool sure = before * behind < 0 && (!path->closed || last - i + 1 < pieces);
    for (; st >= 0 && i <= last; i++) {
      size_t at = path->closed ? 1 + (start + i) % pieces : i;
      frep_image image = at == 0           ? image_beyond(path, 0, x)
                         : at == slots - 1 ? image_beyond(path, 1, x)
                                           : image_at(path, at - 1, x, roots[at]);
      image.group = sure ? group + 1 : 0;
      st = frep_gather_image(g, box, &image);
    }
    group++;
  }
  return st;
}

static frep_image image_straight(const sweep_path *path, size_t piece, const interval *x) {
  const sweep_node *node = path->node + piece;
  double axes[2][3], span = path->piece[piece].span, slack = rounding(path, x);
  interval q[3];
  offset_from(x, node->o, q);
  sweep_frame_at(path, piece, 0, axes);
  frep_image image = {.stretch = 1, .group = piece + 1};
  for (int i = 0; i < 2; i++) image.y[i] = wider(frep_linear_range(3, axes[i], q), slack);
  interval t = frep_linear_range(3, node->tangent, q);
  image.limit = interval_min(t, interval_sub(interval_of(span), t));
  image.limit.hi = fmin(image.limit.hi, span / 2);
  image.limit = wider(image.limit, slack);
  return image;
}

batten_status frep_profile_bounds(const batten_frep *a, const sweep_path *path, batten_context *ctx, size_t count,
                                  const double *boxes, double *ranges) {
  frep_gather *g = NULL;
  size_t slots = path->pieces + 2;
  unsigned char *counts = batten_alloc_array(ctx, slots, sizeof *counts);
  interval *roots = counts ? batten_alloc_array(ctx, slots, sizeof *roots) : NULL;
  batten_status st = roots ? frep_gather_boxes(ctx, a, count, ranges, NULL, &g) : BATTEN_E_NOMEM;
  for (size_t i = 0; st >= 0 && i < count; i++) {
    interval given[3], x[3];
    frep_box_intervals(3, boxes + 6 * i, given);
    offset_from(given, path->base, x);
    if (path->smooth) st = bounds_smooth(path, g, i, x, counts, roots);
    for (size_t k = 0; st >= 0 && !path->smooth && k < path->pieces; k++) {
      frep_image image = image_straight(path, k, x);
      st = frep_gather_image(g, i, &image);
    }
  }
  if (st >= 0) st = frep_gather_flush(g);
  frep_gather_free(g);
  batten_free(ctx, roots);
  batten_free(ctx, counts);
  return st;
}
