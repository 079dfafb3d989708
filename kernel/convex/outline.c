/* Corners and sides of the rim.
 *
 * Corners are where the rim turns most, seen over 1/16 of its length to both sides (so that noise of single points
 * does not count), in the surface: about the mean normal of the triangles at the point, to the left. Of quadruples of
 * points the one of the largest sum of turns is taken, less a penalty for uneven sides,
 *
 *   sum of turns [radians] - sum over the sides of (length / perimeter - 1/4)^2,
 *
 * which is small beside a real corner's 1.57 but spreads the four over a rim that turns evenly, like a circle. For
 * this the rim is cut into 48 stretches of equal length, the best point of each being a candidate. */
#include "outline.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "mesh/vec.h"
#include "plane.h"

enum { STRETCHES = 48, SIGHT = 16 };

/* Turns and places nearer to each other than this part count as equal. */
static const double TIE = 1e-9;

typedef struct rim {
  size_t count;
  const convex_disc *disc;
  const double *xyz;
  double *length; /* [count + 1] along the rim up to each point, and all of it */
  double *turn;   /* [count] */
} rim;

static const double *rim_point(const rim *r, size_t i) { return r->xyz + 3 * (size_t)r->disc->rim[i % r->count]; }

static void measure_lengths(rim *r) {
  r->length[0] = 0;
  for (size_t i = 0; i < r->count; i++)
    r->length[i + 1] = r->length[i] + vec_distance(rim_point(r, i), rim_point(r, i + 1));
}

/* The point at the length `at` in [-perimeter, 2 perimeter], by linear interpolation. */
static void point_at(const rim *r, double at, double *out) {
  double perimeter = r->length[r->count];
  if (at < 0) at += perimeter;
  if (at >= perimeter) at -= perimeter;
  size_t low = 0, high = r->count;
  while (high - low > 1) {
    size_t middle = low + (high - low) / 2;
    if (r->length[middle] <= at)
      low = middle;
    else
      high = middle;
  }
  const double *p = rim_point(r, low), *q = rim_point(r, low + 1);
  double step = r->length[low + 1] - r->length[low], t = step > 0 ? fmin(1, (at - r->length[low]) / step) : 0;
  for (int k = 0; k < 3; k++) out[k] = p[k] + t * (q[k] - p[k]);
}

/* The sum of the normals of the triangles at a point, unit. */
static void normal_at(const rim *r, uint32_t point, double *out) {
  out[0] = out[1] = out[2] = 0;
  for (uint32_t h = r->disc->leaving[point]; h != MESH_NONE; h = convex_disc_turn(r->disc, h)) {
    double normal[3];
    const uint32_t *c = r->disc->corners + h - h % 3;
    vec_triangle_normal(r->xyz + 3 * (size_t)c[0], r->xyz + 3 * (size_t)c[1], r->xyz + 3 * (size_t)c[2], normal);
    for (int k = 0; k < 3; k++) out[k] += normal[k];
  }
  vec_normalize(out);
}

static void measure_turns(rim *r) {
  double sight = r->length[r->count] / SIGHT;
  for (size_t i = 0; i < r->count; i++) {
    double before[3], after[3], cross[3], normal[3];
    const double *p = rim_point(r, i);
    point_at(r, r->length[i] - sight, before);
    point_at(r, r->length[i] + sight, after);
    vec_sub(p, before, before);
    vec_sub(after, p, after);
    vec_cross(before, after, cross);
    normal_at(r, r->disc->rim[i], normal);
    r->turn[i] = atan2(vec_dot(cross, normal), vec_dot(before, after));
  }
}

static bool is_lower(const double *p, const double *q) {
  for (int k = 0; k < 3; k++)
    if (p[k] != q[k]) return p[k] < q[k];
  return false;
}

/* Where the stretches start: where the rim turns most, of equals at the lowest place. */
static size_t find_start(const rim *r) {
  double most = -INFINITY;
  for (size_t i = 0; i < r->count; i++) most = fmax(most, r->turn[i]);
  size_t start = r->count;
  for (size_t i = 0; i < r->count; i++)
    if (r->turn[i] >= most - TIE && (start == r->count || is_lower(rim_point(r, i), rim_point(r, start)))) start = i;
  return start;
}

/* candidates, in the order of the rim from its start; returns how many. */
static size_t find_candidates(const rim *r, size_t *candidates) {
  size_t start = find_start(r), count = 0, stretch = STRETCHES;
  double perimeter = r->length[r->count];
  for (size_t step = 0; step < r->count; step++) {
    size_t i = (start + step) % r->count;
    double from_start = r->length[i] - r->length[start] + (i < start ? perimeter : 0);
    double part = floor(from_start / perimeter * STRETCHES);
    size_t here = r->count <= STRETCHES ? step : part < STRETCHES ? (size_t)part : STRETCHES - 1;
    if (here != stretch)
      candidates[count++] = i;
    else if (r->turn[i] > r->turn[candidates[count - 1]])
      candidates[count - 1] = i;
    stretch = here;
  }
  return count;
}

static double unevenness(const rim *r, size_t from, size_t to) {
  double perimeter = r->length[r->count], share = (r->length[to] - r->length[from]) / perimeter;
  if (to <= from) share += 1;
  return (share - 0.25) * (share - 0.25);
}

static void choose_four(const rim *r, size_t count, const size_t *candidates, size_t corners[4]) {
  double best = -INFINITY;
  for (size_t a = 0; a < count; a++)
    for (size_t b = a + 1; b < count; b++)
      for (size_t c = b + 1; c < count; c++)
        for (size_t d = c + 1; d < count; d++) {
          size_t four[4] = {candidates[a], candidates[b], candidates[c], candidates[d]};
          double score = 0;
          for (int k = 0; k < 4; k++) score += r->turn[four[k]] - unevenness(r, four[k], four[(k + 1) % 4]);
          if (score <= best + TIE) continue;
          best = score;
          memcpy(corners, four, sizeof four);
        }
}

/* Turns the corners around so that u runs as in the best plane. */
static void choose_first(const rim *r, size_t count, size_t *corners) {
  double normal[3] = {0}, best = -INFINITY;
  for (size_t t = 0; t < r->disc->triangles; t++) {
    const uint32_t *c = r->disc->corners + 3 * t;
    double part[3];
    vec_triangle_normal(r->xyz + 3 * (size_t)c[0], r->xyz + 3 * (size_t)c[1], r->xyz + 3 * (size_t)c[2], part);
    for (int k = 0; k < 3; k++) normal[k] += part[k];
  }
  size_t first = 0, turned[4];
  for (size_t i = 0; i < count; i++) {
    double u[3];
    const double *p = rim_point(r, corners[i]), *q = rim_point(r, corners[(i + 1) % count]);
    vec_sub(q, p, u);
    if (count == 4) {
      p = rim_point(r, corners[(i + 3) % 4]);
      q = rim_point(r, corners[(i + 2) % 4]);
      for (int k = 0; k < 3; k++) u[k] += q[k] - p[k];
    }
    vec_normalize(u);
    double score = convex_plane_suits_u(normal, u);
    if (score <= best) continue;
    best = score;
    first = i;
  }
  for (size_t i = 0; i < count; i++) turned[i] = corners[(first + i) % count];
  memcpy(corners, turned, count * sizeof *corners);
}

batten_status convex_outline_choose(batten_context *ctx, const convex_disc *disc, const double *xyz, size_t *count,
                                    size_t corners[4]) {
  rim r = {.count = disc->rim_count, .disc = disc, .xyz = xyz};
  r.length = batten_alloc_array(ctx, r.count + 1, sizeof *r.length);
  r.turn = r.length ? batten_alloc_array(ctx, r.count, sizeof *r.turn) : NULL;
  batten_status st = r.turn ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0) {
    size_t candidates[STRETCHES];
    measure_lengths(&r);
    measure_turns(&r);
    size_t found = find_candidates(&r, candidates);
    /* Rims that are nearly all one edge have few stretches with a point: take any points then. */
    if (found < 4)
      for (found = 0; found < 4 && found < r.count; found++) candidates[found] = found * r.count / 4;
    *count = r.count < 4 ? 3 : 4;
    if (*count == 4)
      choose_four(&r, found, candidates, corners);
    else
      for (size_t i = 0; i < 3; i++) corners[i] = i;
    choose_first(&r, *count, corners);
  }
  batten_free(ctx, r.turn);
  batten_free(ctx, r.length);
  return st;
}

batten_status convex_outline_given(batten_context *ctx, const convex_disc *disc, const uint32_t points[4],
                                   size_t corners[4]) {
  for (size_t k = 0; k < 4; k++) {
    size_t i = 0;
    while (i < disc->rim_count && disc->rim[i] != points[k]) i++;
    if (i == disc->rim_count)
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.corners[%zu]: point %lu is not on the boundary; take one of it",
                         k, (unsigned long)points[k]);
    corners[k] = i;
  }
  size_t length = 0;
  for (size_t k = 0; k < 4; k++) {
    size_t next = corners[(k + 1) % 4];
    length += next > corners[k] ? next - corners[k] : next + disc->rim_count - corners[k];
  }
  if (length == disc->rim_count) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID,
                     "opt.corners: %lu, %lu, %lu, %lu do not follow each other counter-clockwise around the boundary",
                     (unsigned long)points[0], (unsigned long)points[1], (unsigned long)points[2],
                     (unsigned long)points[3]);
}

void convex_outline_map(const convex_disc *disc, const double *xyz, size_t count, const size_t corners[4], double *uv,
                        unsigned char *side) {
  static const double square[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, triangle[3][2] = {{0, 0}, {1, 0}, {0, 1}};
  const double(*ends)[2] = count == 4 ? square : triangle;
  rim r = {.count = disc->rim_count, .disc = disc, .xyz = xyz};
  memset(side, 0, disc->points);
  for (size_t k = 0; k < count; k++) {
    size_t first = corners[k], last = corners[(k + 1) % count] + (corners[(k + 1) % count] > first ? 0 : r.count);
    double chords = 0, length = 0, passed = 0;
    for (size_t i = first; i < last; i++) chords += vec_distance(rim_point(&r, i), rim_point(&r, i + 1));
    double least = chords > 0 ? 2 * DBL_EPSILON * chords : 1; /* points at one place stay apart */
    /* Added up as below, to the bit: no point comes after the corner. */
    for (size_t i = first; i < last; i++) length += vec_distance(rim_point(&r, i), rim_point(&r, i + 1)) + least;
    const double *from = ends[k], *to = ends[(k + 1) % count];
    for (size_t i = first; i <= last; i++) {
      size_t point = disc->rim[i % r.count];
      side[point] |= (unsigned char)(1 << k);
      for (size_t c = 0; c < 2 && i < last; c++) uv[2 * point + c] = from[c] + passed / length * (to[c] - from[c]);
      passed += vec_distance(rim_point(&r, i), rim_point(&r, i + 1)) + least;
    }
  }
}
