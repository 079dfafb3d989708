/* From contours in space to a stack of sections.
 *
 * Contours that lie in one plane make a section; the plane is that of the largest of them, which text that was
 * rounded gives best. Parallel planes are a stack by heights, all in the same frame: of planes across a coordinate
 * axis all numbers stay. Other planes follow each other along the way from neighbour to neighbour, or as the file has
 * them if that is no longer; each frame is the one before turned as little as possible, with its origin in the middle
 * of the contours, so that frames and origins run smoothly where the planes do. */
#include "sections.h"

#include "base/checked.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Distance from a plane, as a part of the size of all contours, and radians between planes that count as parallel:
 * twice and ten times what the reader of contours lets pass, since text files round. */
static const double flat = 2e-6, parallel = 1e-5;

/* Contours are closed where their ends are at most so many of their longest edges apart. */
static const double closing_edges = 3;

/* The contours of one plane. */
typedef struct group {
  size_t first, largest; /* contours: first in the file; of the largest extent */
  double normal[3];
  double height; /* parallel planes */
  double middle[3];
} group;

typedef struct work {
  batten_context *ctx;
  const char *path;
  const batten_contours *c;
  double tolerance; /* distance from a plane */
  size_t *group_of; /* [contours] */
  size_t count;     /* groups */
  group *groups;    /* [contours] */
  size_t *order;    /* [contours] of the groups in the stack */
} work;

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Zeros are positive: they are written to files. */
static void cross(const double a[3], const double b[3], double out[3]) {
  for (int k = 0; k < 3; k++) out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3] + 0.0;
}

static double distance(const double a[3], const double b[3]) {
  return hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
}

static void normalise(double x[3]) {
  double length = sqrt(dot(x, x));
  for (int k = 0; k < 3; k++) x[k] /= length;
}

/* Point i of contour c in space. */
static void lift(const batten_contours *c, size_t contour, size_t i, double out[3]) {
  const batten_plane *p = &c->planes[contour];
  const double *x = c->points + 2 * i;
  for (int k = 0; k < 3; k++) out[k] = p->origin[k] + (x[0] * p->axes[0][k] + x[1] * p->axes[1][k]);
}

/* ---- contours ---------------------------------------------------------------------------------------- */

static batten_status check_closed(const work *w, size_t contour) {
  const batten_contours *c = w->c;
  size_t from = c->starts[contour], to = c->starts[contour + 1];
  double longest = 0;
  for (size_t i = from; i + 1 < to; i++) {
    const double *p = c->points + 2 * i;
    longest = fmax(longest, hypot(p[2] - p[0], p[3] - p[1]));
  }
  const double *a = c->points + 2 * from, *b = c->points + 2 * (to - 1);
  double ends = hypot(b[0] - a[0], b[1] - a[1]);
  if (to - from < 3 || ends <= closing_edges * longest) return BATTEN_OK;
  return batten_fail(w->ctx, BATTEN_E_FORMAT,
                     "%s: contours[%zu]: it is open: its ends are %.3g apart, its longest edge is %.3g; sections are "
                     "closed contours",
                     bx_short_path(w->path), contour, ends, longest);
}

/* extents [contours], the largest first; the size of all. */
static double measure(const work *w, bx_ranked *extents) {
  double lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY}, size = 0;
  const batten_contours *c = w->c;
  for (size_t i = 0; i < c->count; i++) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (size_t k = c->starts[i]; k < c->starts[i + 1]; k++) {
      double x[3];
      lift(c, i, k, x);
      for (int a = 0; a < 3; a++) {
        lower[a] = fmin(lower[a], x[a]);
        upper[a] = fmax(upper[a], x[a]);
      }
      for (int a = 0; a < 2; a++) {
        low[a] = fmin(low[a], c->points[2 * k + (size_t)a]);
        high[a] = fmax(high[a], c->points[2 * k + (size_t)a]);
      }
    }
    extents[i] = (bx_ranked){-hypot(high[0] - low[0], high[1] - low[1]), i};
  }
  qsort(extents, c->count, sizeof *extents, bx_by_key);
  for (int a = 0; a < 3; a++) size = fmax(size, upper[a] - lower[a]);
  return size;
}

/* ---- planes ------------------------------------------------------------------------------------------ */

/* Do all points of the contour lie in the plane through `origin` across `normal`? */
static bool lies_in(const work *w, size_t contour, const double normal[3], const double origin[3]) {
  for (size_t i = w->c->starts[contour]; i < w->c->starts[contour + 1]; i++) {
    double x[3];
    lift(w->c, contour, i, x);
    for (int k = 0; k < 3; k++) x[k] -= origin[k];
    if (!(fabs(dot(normal, x)) <= w->tolerance)) return false;
  }
  return true;
}

/* extents: sorted, so that the first contour of a group is its largest. */
static batten_status find_groups(work *w, const bx_ranked *extents) {
  batten_status st = BATTEN_OK;
  for (size_t i = 0; st == BATTEN_OK && i < w->c->count; i++) {
    size_t contour = extents[i].index, g = 0;
    while (g < w->count && !lies_in(w, contour, w->groups[g].normal, w->c->planes[w->groups[g].largest].origin)) g++;
    w->group_of[contour] = g;
    if (g == w->count) {
      const batten_plane *p = &w->c->planes[contour];
      w->groups[w->count++] = (group){.first = contour, .largest = contour};
      cross(p->axes[0], p->axes[1], w->groups[g].normal);
    } else if (contour < w->groups[g].first) {
      w->groups[g].first = contour;
    }
    if (i % 1024 == 0) st = batten_progress(w->ctx, "read", (double)i / (double)w->c->count);
  }
  return st;
}

static bool has_axes_of(const batten_plane *a, const batten_plane *b) {
  return !memcmp(a->axes, b->axes, sizeof a->axes);
}

/* Heights over the plane of the largest contour; false: the planes are not parallel. Of small contours, whose own
 * planes are unsure, the points decide. */
static bool find_heights(work *w) {
  const group *base = &w->groups[0];
  const batten_plane *plane = &w->c->planes[base->largest];
  for (size_t g = 0; g < w->count; g++) {
    group *o = &w->groups[g];
    size_t from = w->c->starts[o->largest], to = w->c->starts[o->largest + 1];
    double turned[3], mean[3] = {0};
    if (has_axes_of(&w->c->planes[o->largest], plane)) {
      o->height = dot(base->normal, w->c->planes[o->largest].origin);
      continue;
    }
    for (size_t i = from; i < to; i++) {
      double x[3];
      lift(w->c, o->largest, i, x);
      for (int k = 0; k < 3; k++) mean[k] += x[k] / (double)(to - from);
    }
    cross(base->normal, o->normal, turned);
    if (!(sqrt(dot(turned, turned)) <= parallel) && !lies_in(w, o->largest, base->normal, mean)) return false;
    o->height = dot(base->normal, mean);
  }
  return true;
}

/* order: the groups by their heights, or as they come in the file. */
static batten_status sort_groups(work *w, bool heights) {
  bx_ranked *all = batten_alloc_array(w->ctx, w->count, sizeof *all);
  if (!all) return BATTEN_E_NOMEM;
  for (size_t g = 0; g < w->count; g++)
    all[g] = (bx_ranked){heights ? w->groups[g].height : (double)w->groups[g].first, g};
  qsort(all, w->count, sizeof *all, bx_by_key);
  for (size_t g = 0; g < w->count; g++) w->order[g] = all[g].index;
  batten_free(w->ctx, all);
  return BATTEN_OK;
}

/* ---- the way through planes that are not parallel ------------------------------------------------------ */

/* The middle of a group's edges, closing ones included: it stays in place when points are put between others. */
static void find_middles(work *w, bool closed) {
  const batten_contours *c = w->c;
  for (size_t g = 0; g < w->count; g++) {
    double sum[3] = {0}, length = 0, mean[3] = {0}, points = 0;
    for (size_t i = 0; i < c->count; i++) {
      if (w->group_of[i] != g) continue;
      double a[3], b[3];
      lift(c, i, c->starts[i + 1] - 1, a);
      for (size_t k = c->starts[i]; k < c->starts[i + 1]; k++, points++) {
        lift(c, i, k, b);
        double edge = closed ? distance(a, b) : 0;
        for (int n = 0; n < 3; n++) {
          sum[n] += edge * (a[n] + b[n]) / 2;
          mean[n] += b[n];
          a[n] = b[n];
        }
        length += edge;
      }
    }
    for (int n = 0; n < 3; n++) w->groups[g].middle[n] = length > 0 ? sum[n] / length : mean[n] / points;
  }
}

static double gap(const work *w, size_t a, size_t b) { return distance(w->groups[a].middle, w->groups[b].middle); }

static double length_of(const work *w, const size_t *way) {
  double length = 0;
  for (size_t i = 1; i < w->count; i++) length += gap(w, way[i - 1], way[i]);
  return length;
}

/* From the two that are nearest to each other on, at either end the nearest of the others. */
static batten_status follow_neighbours(work *w, size_t *way) {
  size_t count = w->count, low = count, high = count + 1, a = 0, b = 1;
  size_t *room = batten_alloc_array(w->ctx, 2 * count, sizeof *room); /* way in its middle, growing both ways */
  bool *used = batten_alloc_array(w->ctx, count, sizeof *used);
  if (!room || !used) {
    batten_free(w->ctx, room);
    batten_free(w->ctx, used);
    return BATTEN_E_NOMEM;
  }
  for (size_t i = 0; i < count; i++) {
    used[i] = false;
    for (size_t k = i + 1; k < count; k++)
      if (gap(w, i, k) < gap(w, a, b)) a = i, b = k;
  }
  room[low - 1] = a;
  room[low] = b;
  low--;
  used[a] = used[b] = true;
  while (high - low < count) {
    double least = INFINITY;
    size_t next = 0;
    bool at_low = false;
    for (size_t i = 0; i < count; i++) {
      if (used[i]) continue;
      double below = gap(w, i, room[low]), above = gap(w, i, room[high - 1]);
      if (fmin(below, above) < least) {
        least = fmin(below, above);
        next = i;
        at_low = below < above;
      }
    }
    used[next] = true;
    if (at_low)
      room[--low] = next;
    else
      room[high++] = next;
  }
  memcpy(way, room + low, count * sizeof *way);
  batten_free(w->ctx, room);
  batten_free(w->ctx, used);
  return BATTEN_OK;
}

static batten_status find_way(work *w) {
  size_t *found = batten_alloc_array(w->ctx, w->count, sizeof *found);
  batten_status st = found ? sort_groups(w, false) : BATTEN_E_NOMEM;
  if (st == BATTEN_OK) st = follow_neighbours(w, found);
  if (st == BATTEN_OK && length_of(w, found) < length_of(w, w->order)) {
    bool turned = w->groups[found[0]].first > w->groups[found[w->count - 1]].first;
    for (size_t i = 0; i < w->count; i++) w->order[i] = found[turned ? w->count - 1 - i : i];
  }
  batten_free(w->ctx, found);
  return st;
}

/* x turned as a is turned into b, both of length 1, by the shortest way. */
static void turn(const double a[3], const double b[3], double x[3]) {
  double axis[3], once[3], twice[3], cosine = dot(a, b);
  if (!(cosine > -1 + 1e-12)) return; /* opposite: x, across a, is across b */
  cross(a, b, axis);
  cross(axis, x, once);
  cross(axis, once, twice);
  for (int k = 0; k < 3; k++) x[k] += once[k] + twice[k] / (1 + cosine);
}

/* Frames along the way, into the rotations and origins of the sections. */
static void put_frames(const work *w, batten_section *sections) {
  for (size_t i = 0; i < w->count; i++) {
    const group *g = &w->groups[w->order[i]];
    const group *back = &w->groups[w->order[i ? i - 1 : 0]];
    const group *on = &w->groups[w->order[i + 1 < w->count ? i + 1 : i]];
    batten_section *s = &sections[i];
    double ahead[3], normal[3], *x = s->rotation[0];
    for (int k = 0; k < 3; k++) ahead[k] = on->middle[k] - back->middle[k];
    double along = dot(g->normal, ahead), reach = sqrt(dot(ahead, ahead));
    /* A plane that the way hardly crosses faces as the one before does. */
    if (i && fabs(along) < 0.1 * reach) along = dot(g->normal, sections[i - 1].rotation[2]);
    for (int k = 0; k < 3; k++) normal[k] = along < 0 ? -g->normal[k] : g->normal[k];
    if (i) {
      memcpy(x, sections[i - 1].rotation[0], sizeof s->rotation[0]);
      turn(sections[i - 1].rotation[2], normal, x);
    } else {
      memcpy(x, w->c->planes[g->largest].axes[0], sizeof s->rotation[0]);
    }
    double part = dot(x, normal);
    for (int k = 0; k < 3; k++) x[k] -= part * normal[k];
    normalise(x);
    memcpy(s->rotation[2], normal, sizeof normal);
    cross(normal, x, s->rotation[1]);
    memcpy(s->origin, g->middle, sizeof s->origin);
  }
}

/* ---- parallel planes ------------------------------------------------------------------------------------ */

static void put_heights(const work *w, batten_section *sections) {
  const group *base = &w->groups[0];
  const batten_plane *plane = &w->c->planes[base->largest];
  for (size_t i = 0; i < w->count; i++)
    for (int k = 0; k < 3; k++) {
      sections[i].rotation[0][k] = plane->axes[0][k];
      sections[i].rotation[1][k] = plane->axes[1][k];
      sections[i].rotation[2][k] = base->normal[k];
      sections[i].origin[k] = w->groups[w->order[i]].height * base->normal[k] + 0.0;
    }
}

/* ---- sections ------------------------------------------------------------------------------------------- */

/* Points of a contour in the frame of its section; the numbers stay where axes and their zero are the same. */
static void place_points(const work *w, size_t contour, const batten_section *s, double *out) {
  const batten_contours *c = w->c;
  const batten_plane *p = &c->planes[contour];
  size_t from = c->starts[contour], to = c->starts[contour + 1];
  double shift[3];
  for (int k = 0; k < 3; k++) shift[k] = p->origin[k] - s->origin[k];
  if (!memcmp(p->axes, s->rotation, sizeof p->axes) && dot(shift, s->rotation[0]) == 0 &&
      dot(shift, s->rotation[1]) == 0) {
    memcpy(out, c->points + 2 * from, 2 * (to - from) * sizeof *out);
    return;
  }
  for (size_t i = from; i < to; i++, out += 2) {
    double x[3];
    lift(c, contour, i, x);
    for (int k = 0; k < 3; k++) x[k] -= s->origin[k];
    out[0] = dot(s->rotation[0], x);
    out[1] = dot(s->rotation[1], x);
  }
}

static batten_status fill_section(const work *w, size_t g, batten_section *s) {
  const batten_contours *c = w->c;
  size_t contours = 0, points = 0;
  for (size_t i = 0; i < c->count; i++)
    if (w->group_of[i] == g) {
      contours++;
      points += c->starts[i + 1] - c->starts[i];
    }
  batten_section made = {.contour_count = 0};
  batten_status st = bx_section_make(w->ctx, contours, points, &made);
  if (st != BATTEN_OK) return st;
  size_t *starts = bx_section_starts(&made), used = 0;
  double *to = bx_section_points(&made);
  contours = 0;
  for (size_t i = 0; i < c->count; i++) {
    if (w->group_of[i] != g) continue;
    starts[contours++] = used;
    place_points(w, i, s, to + 2 * used);
    used += c->starts[i + 1] - c->starts[i];
  }
  starts[contours] = used;
  s->contour_count = contours;
  s->starts = starts;
  s->points = to;
  if (batten_first_nonfinite(2 * used, to) < 2 * used || batten_first_nonfinite(3, s->origin) < 3)
    return batten_fail(w->ctx, BATTEN_E_FORMAT, "%s: contours[%zu]: its coordinates are beyond a double; scale it",
                       bx_short_path(w->path), w->groups[g].first);
  return BATTEN_OK;
}

static batten_status put_sections(work *w, bool heights, batten_section_set *out) {
  batten_section_set set = {0};
  set.sections = batten_alloc_array(w->ctx, w->count, sizeof *set.sections);
  if (!set.sections) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < w->count; i++) set.sections[i] = (batten_section){.contour_count = 0};
  set.count = w->count;
  if (heights)
    put_heights(w, set.sections);
  else
    put_frames(w, set.sections);
  batten_status st = BATTEN_OK;
  for (size_t i = 0; st == BATTEN_OK && i < w->count; i++) st = fill_section(w, w->order[i], &set.sections[i]);
  if (st == BATTEN_OK)
    *out = set;
  else
    batten_section_set_free(w->ctx, &set);
  return st;
}

batten_status bx_stack_contours(batten_context *ctx, const char *path, const batten_contours *c, bool closed,
                                batten_section_set *out) {
  work w = {.ctx = ctx, .path = path, .c = c};
  batten_status st = BATTEN_OK;
  bx_ranked *extents = batten_alloc_array(ctx, c->count, sizeof *extents);
  w.group_of = batten_alloc_array(ctx, c->count, sizeof *w.group_of);
  w.groups = batten_alloc_array(ctx, c->count, sizeof *w.groups);
  w.order = batten_alloc_array(ctx, c->count, sizeof *w.order);
  if (!extents || !w.group_of || !w.groups || !w.order) st = BATTEN_E_NOMEM;
  for (size_t i = 0; closed && st == BATTEN_OK && i < c->count; i++) st = check_closed(&w, i);
  if (st == BATTEN_OK) {
    w.tolerance = flat * measure(&w, extents);
    st = find_groups(&w, extents);
  }
  bool heights = st == BATTEN_OK && find_heights(&w);
  if (heights) {
    st = sort_groups(&w, true);
  } else if (st == BATTEN_OK) {
    find_middles(&w, closed);
    st = find_way(&w);
  }
  if (st == BATTEN_OK) st = put_sections(&w, heights, out);
  batten_free(ctx, extents);
  batten_free(ctx, w.group_of);
  batten_free(ctx, w.groups);
  batten_free(ctx, w.order);
  return st;
}
