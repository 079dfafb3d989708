/* The planes in which points in no order lie: scans along cuts, stacks without contours.
 *
 * Cuts across a coordinate axis are looked for first, then planes through three points taken by chance [Fischler,
 * Bolles 1981]: one that holds six points or more, to the rounding of text, is no chance. Of its points a triangle as
 * large as can be had gives the plane better; and where all other points lie in planes parallel to it, these are
 * taken at once. Points on the line where two planes cross belong to the plane that was found first. The choice is
 * the same in every run. */
#include "contours.h"
#include "sections.h"

#include "base/checked.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  SUPPORT = 6,       /* points of a plane: three that span it, three that are no chance */
  CUT_POINTS = 3,    /* of a cut in a direction that is known */
  TRIALS = 200000,   /* for one plane */
  WORK_MAX = 1 << 30 /* distances for one plane: about two seconds */
};

/* Distance from a plane, as a part of the size of all points: what text files round. */
static const double flat = 2e-6;

typedef struct search {
  batten_context *ctx;
  size_t count;
  const double (*points)[3];
  double tolerance;
  size_t *cut;  /* [count] number of the plane */
  size_t *left; /* [left_count] points without one */
  size_t left_count, cuts;
  bx_ranked *ranked; /* [count] of left, by height along a direction */
  uint64_t seed;
} search;

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* The unit normal of a triangle; false: it has hardly an area. */
static bool normal_of(const double a[3], const double b[3], const double c[3], double out[3]) {
  double u[3], v[3];
  for (int k = 0; k < 3; k++) u[k] = b[k] - a[k], v[k] = c[k] - a[k];
  for (int k = 0; k < 3; k++) out[k] = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
  double area = sqrt(dot(out, out)), sides = sqrt(dot(u, u) * dot(v, v));
  if (!(area > 1e-3 * sides)) return false; /* a sliver's normal is noise */
  for (int k = 0; k < 3; k++) out[k] /= area;
  return true;
}

/* splitmix64 [Steele, Lea, Flood 2014] */
static size_t choose(search *s) {
  uint64_t z = s->seed += 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return s->left[(size_t)((z ^ (z >> 31)) % s->left_count)];
}

static double height(const search *s, const double normal[3], const double through[3], size_t point) {
  double x[3];
  for (int k = 0; k < 3; k++) x[k] = s->points[point][k] - through[k];
  return dot(normal, x);
}

/* ---- parallel cuts ------------------------------------------------------------------------------------- */

/* Do all points that are left lie in cuts across the direction, three or more in each? They are then taken. */
static bool take_parallel(search *s, const double normal[3]) {
  const double *through = s->points[s->left[0]];
  for (size_t i = 0; i < s->left_count; i++)
    s->ranked[i] = (bx_ranked){height(s, normal, through, s->left[i]), s->left[i]};
  qsort(s->ranked, s->left_count, sizeof *s->ranked, bx_by_key);
  for (int put = 0; put < 2; put++) /* look, then take */
    for (size_t from = 0, to; from < s->left_count; from = to) {
      for (to = from; to < s->left_count; to++) {
        if (s->ranked[to].key - s->ranked[from].key > 2 * s->tolerance) break;
        if (put) s->cut[s->ranked[to].index] = s->cuts;
      }
      if (to - from < CUT_POINTS) return false;
      if (put) s->cuts++;
    }
  s->left_count = 0;
  return true;
}

/* ---- one plane after the other ---------------------------------------------------------------------------- */

static size_t count_in(const search *s, const double normal[3], const double through[3]) {
  size_t count = 0;
  for (size_t i = 0; i < s->left_count; i++) count += fabs(height(s, normal, through, s->left[i])) <= s->tolerance;
  return count;
}

/* Of the plane's points those that are farthest from each other and from the line between them. */
static void spread_out(const search *s, double normal[3], double through[3]) {
  const double *corner[3] = {through, through, through};
  double best = 0, wide[3];
  for (int turn = 0; turn < 2; turn++) { /* twice: from the first to the farthest from it, and back */
    double farthest = -1;
    const double *from = corner[0];
    for (size_t i = 0; i < s->left_count; i++) {
      const double *p = s->points[s->left[i]];
      if (fabs(height(s, normal, through, s->left[i])) > s->tolerance) continue;
      double d = hypot(hypot(p[0] - from[0], p[1] - from[1]), p[2] - from[2]);
      if (d > farthest) farthest = d, corner[1] = p;
    }
    corner[0] = corner[1];
    corner[1] = from;
  }
  for (size_t i = 0; i < s->left_count; i++) {
    const double *p = s->points[s->left[i]];
    double area = 0, u[3], v[3];
    if (fabs(height(s, normal, through, s->left[i])) > s->tolerance) continue;
    for (int k = 0; k < 3; k++) u[k] = corner[1][k] - corner[0][k], v[k] = p[k] - corner[0][k];
    area = dot(u, u) * dot(v, v) - dot(u, v) * dot(u, v);
    if (area > best) best = area, corner[2] = p;
  }
  if (!normal_of(corner[0], corner[1], corner[2], wide)) return;
  memcpy(normal, wide, sizeof wide);
  memcpy(through, corner[0], sizeof wide);
}

/* A plane with enough points; NOT_FOUND. */
static batten_status find_plane(search *s, double normal[3], double through[3]) {
  size_t trials = WORK_MAX / (s->left_count + 1);
  if (trials > TRIALS) trials = TRIALS;
  for (size_t i = 0; s->left_count >= SUPPORT && i < trials; i++) {
    const double *a = s->points[choose(s)], *b = s->points[choose(s)], *c = s->points[choose(s)];
    if (i % 1024 == 0) {
      batten_status st = batten_progress(s->ctx, "read", 1 - (double)s->left_count / (double)s->count);
      if (st != BATTEN_OK) return st;
    }
    if (!normal_of(a, b, c, normal) || count_in(s, normal, a) < SUPPORT) continue;
    memcpy(through, a, 3 * sizeof *through);
    spread_out(s, normal, through);
    if (count_in(s, normal, through) >= SUPPORT) return BATTEN_OK;
  }
  return BATTEN_E_NOT_FOUND;
}

static void take_plane(search *s, const double normal[3], const double through[3]) {
  size_t kept = 0;
  for (size_t i = 0; i < s->left_count; i++) {
    size_t point = s->left[i];
    if (fabs(height(s, normal, through, point)) <= s->tolerance)
      s->cut[point] = s->cuts;
    else
      s->left[kept++] = point;
  }
  s->left_count = kept;
  s->cuts++;
}

static batten_status find_cuts(search *s) {
  static const double axes[3][3] = {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}};
  for (int k = 0; k < 3; k++)
    if (take_parallel(s, axes[k])) return BATTEN_OK;
  while (s->left_count) {
    double normal[3], through[3];
    batten_status st = find_plane(s, normal, through);
    if (st != BATTEN_OK) return st;
    take_plane(s, normal, through);
    if (s->left_count && s->cuts == 1 && take_parallel(s, normal)) break;
  }
  return BATTEN_OK;
}

/* ---- contours ------------------------------------------------------------------------------------------------ */

static batten_status put_cuts(bx_reader *r, const search *s, batten_contours *out) {
  batten_contours c = {.count = s->cuts};
  double(*sorted)[3] = batten_alloc_array(s->ctx, s->count, sizeof *sorted);
  c.starts = batten_alloc_array(s->ctx, s->cuts + 2, sizeof *c.starts);
  c.points = batten_alloc_array(s->ctx, s->count, 2 * sizeof *c.points);
  c.planes = batten_alloc_array(s->ctx, s->cuts, sizeof *c.planes);
  batten_status st = sorted && c.starts && c.points && c.planes ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st != BATTEN_OK) goto done;
  memset(c.starts, 0, (s->cuts + 2) * sizeof *c.starts);
  for (size_t i = 0; i < s->count; i++) c.starts[s->cut[i] + 2]++;
  for (size_t k = 2; k < s->cuts + 2; k++) c.starts[k] += c.starts[k - 1];
  for (size_t i = 0; i < s->count; i++) memcpy(sorted[c.starts[s->cut[i] + 1]++], s->points[i], sizeof *sorted);
  st = bx_find_planes(r, c.count, c.starts, sorted[0], c.points, c.planes);
done:
  batten_free(s->ctx, sorted);
  if (st == BATTEN_OK)
    *out = c;
  else
    batten_contours_free(s->ctx, &c);
  return st;
}

batten_status bx_find_cuts(bx_reader *r, size_t count, const double *points, batten_contours *out) {
  search s = {.ctx = r->ctx, .count = count, .points = (const double(*)[3])points, .left_count = count, .seed = 1};
  double size = 0;
  batten_status st = BATTEN_E_NOMEM;
  s.cut = batten_alloc_array(r->ctx, count, sizeof *s.cut);
  s.left = batten_alloc_array(r->ctx, count, sizeof *s.left);
  s.ranked = batten_alloc_array(r->ctx, count, sizeof *s.ranked);
  if (!s.cut || !s.left || !s.ranked) goto done;
  for (int k = 0; k < 3; k++) {
    double lower = INFINITY, upper = -INFINITY;
    for (size_t i = 0; i < count; i++) {
      lower = fmin(lower, s.points[i][k]);
      upper = fmax(upper, s.points[i][k]);
    }
    size = fmax(size, upper - lower);
  }
  for (size_t i = 0; i < count; i++) s.left[i] = i;
  s.tolerance = flat * size;
  st = find_cuts(&s);
  if (st == BATTEN_E_NOT_FOUND)
    st = batten_fail(r->ctx, BATTEN_E_FORMAT,
                     "%s: points[%zu] and %zu others lie in no plane with %d more; give points of plane cuts",
                     bx_short_path(r->path), s.left[0], s.left_count - 1, SUPPORT - 1);
  if (st == BATTEN_OK) st = put_cuts(r, &s, out);
done:
  batten_free(r->ctx, s.cut);
  batten_free(r->ctx, s.left);
  batten_free(r->ctx, s.ranked);
  return st;
}
