/* Pairs of sections whose planes cross within both.
 *
 * Two planes that are not parallel meet in a line. It cuts each section's convex hull in an interval or not at all;
 * where both intervals have a common part there are places that belong to both sections, and no order of the sections
 * in which a moving plane would sweep the solid once. */
#include "base/checked.h"
#include "section/section_inner.h"

#include <stdlib.h>
#include <string.h>

/* Less than this part of the hulls' size is no crossing: sections that share an edge or a corner only. */
static const double TOUCH = 1e-9;

typedef struct hull {
  size_t count;
  double *points;   /* [count][2], counter-clockwise; in the block of all */
  double middle[3]; /* of a ball about it, in space */
  double radius;
} hull;

static int compare_points(const void *left, const void *right) {
  const double *a = left, *b = right;
  if (a[0] != b[0]) return a[0] < b[0] ? -1 : 1;
  return (a[1] > b[1]) - (a[1] < b[1]);
}

static double turn(const double *a, const double *b, const double *c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/* The convex hull [return][2] of sorted points [count][2], with room for 2 count + 1 points: the lower chain from
 * left to right, then the upper one back [Andrew 1979]. */
static size_t make_hull(size_t count, const double *sorted, double *points) {
  size_t made = 0, least = 1;
  for (size_t step = 0; step < 2 * count; step++) {
    const double *p = sorted + 2 * (step < count ? step : 2 * count - 1 - step);
    if (step == count) least = made; /* the lower chain stays */
    while (made > least && turn(points + 2 * (made - 2), points + 2 * (made - 1), p) <= 0) made--;
    memcpy(points + 2 * made++, p, 2 * sizeof *p);
  }
  return made > 1 ? made - 1 : made; /* the first point has come again */
}

/* All that lies in a section's plane. */
static const double *points_of(const stack_section *s, size_t *count) {
  if (s->apex_count) {
    *count = s->apex_count;
    return s->apex[0];
  }
  if (s->loops.count) {
    *count = s->loops.starts[s->loops.count];
    return s->loops.points;
  }
  *count = 0;
  return s->function ? batten_solid_points(s->function, count) : NULL;
}

static void measure_hull(const stack_section *s, hull *h) {
  double lower[2] = {INFINITY, INFINITY}, upper[2] = {-INFINITY, -INFINITY}, middle[2];
  for (size_t i = 0; i < h->count; i++)
    for (unsigned k = 0; k < 2; k++) {
      lower[k] = fmin(lower[k], h->points[2 * i + k]);
      upper[k] = fmax(upper[k], h->points[2 * i + k]);
    }
  for (unsigned k = 0; k < 2; k++) middle[k] = lower[k] + 0.5 * (upper[k] - lower[k]);
  h->radius = 0.5 * hypot(upper[0] - lower[0], upper[1] - lower[1]);
  for (unsigned k = 0; k < 3; k++)
    h->middle[k] = s->origin[k] + middle[0] * s->rotation[0][k] + middle[1] * s->rotation[1][k];
}

/* Hulls [count] with their points in one block. */
static batten_status make_hulls(batten_context *ctx, const stack *s, hull *hulls, double **block) {
  size_t all = 0, most = 0, count;
  for (size_t i = 0; i < s->count; i++) {
    points_of(&s->sections[i], &count);
    all += 2 * count + 1; /* the chains before the upper one is cut back */
    if (count > most) most = count;
  }
  double *sorted = batten_alloc_array(ctx, most, 2 * sizeof *sorted);
  *block = batten_alloc_array(ctx, all, 2 * sizeof **block);
  batten_status st = sorted && *block ? BATTEN_OK : BATTEN_E_NOMEM;
  double *next = *block;
  for (size_t i = 0; st >= 0 && i < s->count; i++) {
    const double *points = points_of(&s->sections[i], &count);
    if (count) memcpy(sorted, points, count * 2 * sizeof *sorted);
    qsort(sorted, count, 2 * sizeof *sorted, compare_points);
    hulls[i] = (hull){.count = make_hull(count, sorted, next), .points = next};
    measure_hull(&s->sections[i], &hulls[i]);
    next += 2 * hulls[i].count;
  }
  batten_free(ctx, sorted);
  return st;
}

/* ---- two planes ---------------------------------------------------------------------------------- */

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
static void cross(const double *a, const double *b, double *out) {
  for (unsigned k = 0; k < 3; k++) out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

/* The line of both planes: at [3], unit direction along [3]. false: parallel. */
static bool meet_planes(const stack_section *a, const stack_section *b, double *at, double *along) {
  double direction[3], off[3], to[3];
  cross(a->rotation[2], b->rotation[2], direction);
  const double square = dot(direction, direction), length = sqrt(square);
  if (!(length > 1e-9)) return false; /* as stack.parallel */
  for (unsigned k = 0; k < 3; k++) to[k] = b->origin[k] - a->origin[k];
  cross(direction, a->rotation[2], off); /* in plane a, square to the line */
  const double distance = dot(b->rotation[2], to) / square;
  for (unsigned k = 0; k < 3; k++) {
    at[k] = a->origin[k] + distance * off[k];
    along[k] = direction[k] / length;
  }
  return true;
}

/* The part of the line in the hull; false: it does not go through. */
static bool cut_hull(const stack_section *s, const hull *h, const double *at, const double *along, double range[2]) {
  double q[2], v[2], to[3], least = INFINITY, most = -INFINITY;
  for (unsigned k = 0; k < 3; k++) to[k] = at[k] - s->origin[k];
  for (unsigned k = 0; k < 2; k++) {
    q[k] = dot(s->rotation[k], to);
    v[k] = dot(s->rotation[k], along);
  }
  range[0] = INFINITY;
  range[1] = -INFINITY;
  for (size_t i = 0; i < h->count; i++) {
    const double *a = h->points + 2 * i, *b = h->points + 2 * ((i + 1) % h->count);
    double side_a = v[0] * (a[1] - q[1]) - v[1] * (a[0] - q[0]), side_b = v[0] * (b[1] - q[1]) - v[1] * (b[0] - q[0]);
    least = fmin(least, side_a);
    most = fmax(most, side_a);
    if ((side_a > 0) == (side_b > 0)) continue;
    double u = side_a / (side_a - side_b), p = 0;
    for (unsigned k = 0; k < 2; k++) p += v[k] * ((1 - u) * a[k] + u * b[k] - q[k]);
    range[0] = fmin(range[0], p);
    range[1] = fmax(range[1], p);
  }
  return least < -TOUCH * h->radius && most > TOUCH * h->radius;
}

static bool planes_cross(const stack *s, const hull *hulls, size_t i, size_t j) {
  const stack_section *a = &s->sections[i], *b = &s->sections[j];
  const hull *of[2] = {&hulls[i], &hulls[j]};
  double at[3], along[3], ranges[2][2], to[3], reach = of[0]->radius + of[1]->radius;
  for (unsigned k = 0; k < 3; k++) to[k] = of[1]->middle[k] - of[0]->middle[k];
  if (!(dot(to, to) < reach * reach) || !meet_planes(a, b, at, along)) return false;
  if (!cut_hull(a, of[0], at, along, ranges[0]) || !cut_hull(b, of[1], at, along, ranges[1])) return false;
  return fmin(ranges[0][1], ranges[1][1]) - fmax(ranges[0][0], ranges[1][0]) > TOUCH * reach;
}

batten_status stack_find_crossings(batten_context *ctx, const stack *s, stack_notes *notes, size_t *crossings) {
  size_t found = 0;
  *crossings = 0;
  if (s->parallel || s->count < 2) return BATTEN_OK;
  double *block = NULL;
  hull *hulls = batten_alloc_array(ctx, s->count, sizeof *hulls);
  batten_status st = hulls ? make_hulls(ctx, s, hulls, &block) : BATTEN_E_NOMEM;
  for (size_t i = 0; i < s->count; i++)
    for (size_t j = i + 1; st >= 0 && j < s->count; j++) {
      if (!planes_cross(s, hulls, i, j)) continue;
      found++;
      st = stack_note_add(
          notes, (batten_stack_note){
                     .kind = BATTEN_NOTE_CROSSING, .section = i, .contour = SIZE_MAX, .above = 1, .other = j});
    }
  if (st >= 0) *crossings = found;
  batten_free(ctx, block);
  batten_free(ctx, hulls);
  return st;
}
