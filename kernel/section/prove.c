/* Has a section's function F the sign of its loops everywhere, but for a band along them?
 *
 * A square of 100 half diagonals around the section is parted in four, and so on. A box is settled when all of it
 * lies within the tolerance of the loops, or when the bounds of F over it have one sign and the bounds of the signed
 * distance d to the polygons the same. What is left when boxes are smaller than a share of the tolerance is not
 * proven; F in its middle tells whether it is wrong.
 *
 * A band as narrow as the tolerance takes some ten boxes for each tolerance of its length, so a box must cost little.
 * Two things are handed down from a box to its parts, and concern few centres and edges then:
 *
 *   F   an expansion of the centres that are far from the box, and the list of the others (local_field.h)
 *   d   the edges that are the nearest ones of any place in the box: d changes no faster than its argument, so none
 *       of them is farther from the middle than the nearest one there and twice the half diagonal rho.
 *
 * Bounds of |d|, h the half side. From above: the nearest place of the middle m, seen from the farthest corner. From
 * below: if an edge lies beyond a line, n . (y - m) >= s for all its y, n a unit vector, then it is no nearer to the
 * box than s - h (|n_x| + |n_y|); n points from m to the edge's nearest place. The least of this over the edges
 * counts, and where it is positive, the sign of d is one all over the box and its parts.
 *
 * Boxes are those of the spline's unit box, with middles and sides that are exact in floating point: the side of the
 * whole has 17 bits, its corner is a multiple of 2^-20 of the next power of two and no farther away than 8 of it, and
 * 31 levels take as many bits. The evaluator takes a place into the unit box with two roundings, by 2^-52 of its
 * coordinates, and distances have some more, all relative to the largest coordinates: `slack` is an ample bound of
 * them, by which boxes are larger and bounds wider. Squares of lengths lose a multiple of 2^-1074, and their roots
 * 2^-535: where that is no longer little beside `slack`, nothing is proven. */
#include "base/checked.h"
#include "section/local_field.h"
#include "section/section_inner.h"

#include <float.h>
#include <string.h>

enum {
  LEVELS = 31,
  BOXES_MAX = 2000000,
  UNPROVEN_MAX = 1024 /* there is no proof after the first: the others are looked at for places that are wrong */
};
static const double REACH = 100;      /* half diagonals */
static const double LEAST = 1.0 / 32; /* side of a box that is not parted, in tolerances ... */
static const double LEAST_SEEN = 0.5; /* ... and once one has not been settled */
/* A part as thick as twice the tolerance is nowhere deeper than that, but boxes across its middle reach beyond: the
 * smallest ones, which are settled within this many tolerances if F is not seen to be wrong beyond one in their
 * middle. No box that meets the tolerance and is as small as LEAST reaches farther. */
static const double BAND = 1.0625;
static const double SLACK_LEAST = 0x1p-520;
static const double LEFT_OUT = 1. / 64; /* of the distance or the tolerance: by all expansions */

typedef struct frame {
  uint32_t at[2];
  unsigned part; /* the next one to be looked at */
  int sign;      /* of d all over the box, 0: unknown */
  local_square square;
  local_field field;
  size_t near_count, edge_count;
  uint32_t *near, *edges;
  double middle[2], distances[2]; /* caller's unit: of the middle, of d over the box */
} frame;

typedef struct proof {
  batten_context *ctx;
  const polygon_set *loops;
  const batten_solid *function;
  local_source source;
  double tolerance, origin[2], scale, corner[2], side, slack;
  size_t seen, unproven;
  frame *frames;     /* [LEVELS + 1] */
  uint32_t *lists;   /* [LEVELS + 1][centres + edges] */
  double *distances; /* [edges] from the middle */
  section_wrong *wrong;
} proof;

static double side_of(const proof *p, size_t level) { return ldexp(p->side, -(int)level); }

/* Without a proof boxes are only looked at for places that are wrong. */
static bool can_part(const proof *p, size_t level) {
  const double least = p->unproven ? LEAST_SEEN : LEAST;
  return level < LEVELS && side_of(p, level) * p->scale > least * p->tolerance;
}

/* ---- places that are wrong ----------------------------------------------------------------------- */

/* The deepest ones, some way apart from each other. */
static void note_place(section_wrong *wrong, const double *x, double depth) {
  size_t to = wrong->count, least = 0;
  for (size_t i = 0; i < wrong->count; i++) {
    if (hypot(wrong->places[i][0] - x[0], wrong->places[i][1] - x[1]) <= 0.5 * fmax(depth, wrong->depths[i])) {
      to = i;
      break;
    }
    if (wrong->depths[i] < wrong->depths[least]) least = i;
  }
  if (to == SECTION_WRONG_MAX) to = least;
  if (to < wrong->count && wrong->depths[to] >= depth) return;
  if (to == wrong->count) wrong->count++;
  for (unsigned k = 0; k < 2; k++) wrong->places[to][k] = x[k];
  wrong->depths[to] = depth;
}

void section_add_wrong(section_wrong *wrong, const double *x, double depth) {
  wrong->depth = fmax(wrong->depth, depth);
  note_place(wrong, x, depth);
}

/* A box that bounds do not settle, by its middle. */
static batten_status judge(proof *p, const frame *f) {
  const bool thin = fmax(-f->distances[0], f->distances[1]) <= BAND * p->tolerance;
  const double *x = f->middle, distance = polygon_distance(p->loops, x, NULL, NULL);
  double value = 0;
  batten_status st = batten_solid_evaluate(p->ctx, p->function, 1, x, &value, NULL, NULL);
  if (st < 0 || (thin && (fabs(distance) <= p->tolerance || value * distance > 0))) return st;
  if (isnan(value))
    section_add_wrong(p->wrong, x, INFINITY);
  else if (value * distance < 0)
    section_add_wrong(p->wrong, x, fabs(distance));
  else if (p->unproven == 0)
    note_place(p->wrong, x, fabs(distance)); /* but F is as good as 0 */
  p->unproven++;
  return BATTEN_OK;
}

/* ---- boxes --------------------------------------------------------------------------------------- */

/* How a segment lies to a place m: from its nearest place to m, and the least of n . (y - m) over it, which lies at
 * one of its ends. In exact numbers that is the distance. */
typedef struct near_segment {
  double to[2], distance, least;
} near_segment;

static near_segment segment_near(const double *ends, const double *m) {
  const double u[2] = {ends[2] - ends[0], ends[3] - ends[1]}, v[2] = {m[0] - ends[0], m[1] - ends[1]};
  const double along = u[0] * v[0] + u[1] * v[1], all = u[0] * u[0] + u[1] * u[1];
  const double s = along <= 0 ? 0 : along >= all ? 1 : along / all;
  near_segment n = {{v[0] - s * u[0], v[1] - s * u[1]}, 0, 0};
  n.distance = sqrt(n.to[0] * n.to[0] + n.to[1] * n.to[1]);
  const double first = n.to[0] * v[0] + n.to[1] * v[1], change = n.to[0] * u[0] + n.to[1] * u[1];
  n.least = (first - fmax(change, 0)) / n.distance;
  return n;
}

/* The list of edges, the sign and the bounds of d, from the edges [count] of the box around. */
static void bound_distance(proof *p, frame *f, size_t count, const uint32_t *edges) {
  const double half = p->scale * f->square.half + p->slack, rho = half * 1.4142135623730952;
  double nearest = INFINITY, gap = INFINITY, far = 0;
  for (size_t i = 0; i < count; i++) {
    const near_segment n = segment_near(p->loops->tree.leaves + 4 * (size_t)edges[i], f->middle);
    const double x = fabs(n.to[0]), y = fabs(n.to[1]);
    p->distances[i] = n.distance;
    gap = n.distance > rho ? fmin(gap, n.least - half * (x + y) / n.distance) : 0;
    if (n.distance >= nearest) continue;
    nearest = n.distance;
    far = sqrt((x + half) * (x + half) + (y + half) * (y + half)) + p->slack;
  }
  f->edge_count = 0;
  for (size_t i = 0; i < count; i++)
    if (p->distances[i] <= nearest + 2 * rho) f->edges[f->edge_count++] = edges[i];
  gap -= p->slack;
  if (f->sign == 0 && gap > 0 && far > p->tolerance) f->sign = polygon_inside(p->loops, f->middle) ? 1 : -1;
  f->distances[0] = f->sign > 0 ? gap : -far;
  f->distances[1] = f->sign < 0 ? -gap : far;
}

static void place_box(const proof *p, frame *f, size_t level) {
  const double side = side_of(p, level);
  f->square.half = side / 2;
  f->part = 0;
  for (unsigned k = 0; k < 2; k++) {
    f->square.middle[k] = p->corner[k] + (f->at[k] + 0.5) * side;
    f->middle[k] = p->origin[k] + p->scale * f->square.middle[k];
  }
}

/* Centres that have become far are taken into the expansion. */
static void take_far(const proof *p, frame *f, size_t count, const uint32_t *near) {
  const double depth = fmax(fmax(f->distances[0], -f->distances[1]), p->tolerance);
  f->near_count = local_take_far(&p->source, &f->square, LEFT_OUT * depth / (double)p->source.count, count, near,
                                 f->near, &f->field);
}

static bool in_band(const proof *p, const frame *f) {
  return fmax(-f->distances[0], f->distances[1]) <= p->tolerance;
}

/* *part: the box, which is not in the band, must be parted. */
static batten_status settle(proof *p, const frame *f, size_t level, bool *part) {
  const double *d = f->distances;
  *part = f->sign == 0 && can_part(p, level);
  if (*part) return BATTEN_OK;
  const interval r = local_bounds(&p->source, &f->square, &f->field, f->near_count, f->near);
  if ((r.lo > 0 && d[0] > 0) || (r.hi < 0 && d[1] < 0)) return BATTEN_OK;
  const bool opposite = (r.lo > 0 && d[1] < -p->tolerance) || (r.hi < 0 && d[0] > p->tolerance);
  *part = can_part(p, level) && !opposite;
  return *part ? BATTEN_OK : judge(p, f);
}

/* False when it is settled by its distance. */
static bool open_part(proof *p, const frame *whole, unsigned c, frame *f, size_t level) {
  for (unsigned k = 0; k < 2; k++) f->at[k] = 2 * whole->at[k] + (c >> k & 1);
  f->sign = whole->sign;
  place_box(p, f, level);
  bound_distance(p, f, whole->edge_count, whole->edges);
  if (in_band(p, f)) return false;
  local_part(&whole->field, c, &f->field);
  take_far(p, f, whole->near_count, whole->near);
  return true;
}

/* Depth first: a frame for each level. */
static batten_status walk(proof *p) {
  bool part;
  size_t level = 0;
  batten_status st = settle(p, p->frames, 0, &part);
  if (st < 0 || !part) return st;
  while (st >= 0 && p->seen < BOXES_MAX && p->unproven < UNPROVEN_MAX) {
    frame *whole = p->frames + level, *f = whole + 1;
    if (whole->part == 4) {
      if (level-- == 0) return BATTEN_OK;
      continue;
    }
    p->seen++;
    if (!open_part(p, whole, whole->part++, f, level + 1)) continue;
    st = settle(p, f, level + 1, &part);
    if (part) level++;
  }
  p->unproven++; /* what is left */
  return st;
}

/* ---- the whole ----------------------------------------------------------------------------------- */

/* False when the function lies elsewhere, or roundings come near the tolerance. */
static bool open_square(proof *p) {
  const polygon_set *loops = p->loops;
  const double radius = 0.5 * hypot(loops->upper[0] - loops->lower[0], loops->upper[1] - loops->lower[1]);
  int e;
  double share = frexp(2 * REACH * radius / p->scale * (1 + 0x1p-12), &e), size = 0;
  p->side = ldexp(ceil(ldexp(share, 16)), e - 16);
  for (unsigned k = 0; k < 2; k++) {
    const double middle = (0.5 * (loops->lower[k] + loops->upper[k]) - p->origin[k]) / p->scale;
    p->corner[k] = ldexp(rint(ldexp(middle - 0.5 * p->side, 20 - e)), e - 20);
    if (!(fabs(p->corner[k]) <= 8 * p->side)) return false;
    size += fabs(p->origin[k]) + 9 * p->scale * p->side;
  }
  p->slack = 64 * DBL_EPSILON * size;
  return p->slack >= SLACK_LEAST && p->slack < LEAST / 16 * p->tolerance;
}

static void open_frames(proof *p) {
  const size_t centers = p->source.count, edges = p->loops->tree.boxes.count;
  uint32_t *const near = p->lists + LEVELS * (centers + edges), *const all = near + centers; /* of the last level */
  for (size_t level = 0; level <= LEVELS; level++) {
    p->frames[level].near = p->lists + level * (centers + edges);
    p->frames[level].edges = p->frames[level].near + centers;
  }
  for (size_t i = 0; i < centers; i++) near[i] = (uint32_t)i;
  for (size_t i = 0; i < edges; i++) all[i] = (uint32_t)i;
  frame *f = p->frames;
  f->at[0] = f->at[1] = 0;
  f->sign = 0;
  place_box(p, f, 0);
  bound_distance(p, f, edges, all);
  f->field = local_begin(&p->source, &f->square, 9 * p->side);
  take_far(p, f, centers, near);
}

batten_status section_prove(batten_context *ctx, const polygon_set *loops, const batten_solid *function,
                            double tolerance, bool *proven, section_wrong *wrong) {
  proof p = {.ctx = ctx, .loops = loops, .function = function, .tolerance = tolerance, .wrong = wrong};
  const size_t edges = loops->tree.boxes.count;
  batten_spline_parts parts;
  batten_status st = local_source_make(ctx, function, &p.source);
  if (st < 0) return st;
  *proven = false;
  if (p.source.count == 0 || edges == 0 || edges > UINT32_MAX || p.source.count > UINT32_MAX) goto done;
  batten_spline_get_parts(batten_solid_spline(function), &parts);
  memcpy(p.origin, parts.origin, sizeof p.origin);
  p.scale = parts.scale;
  st = BATTEN_E_NOMEM;
  p.frames = batten_alloc_array(ctx, LEVELS + 1, sizeof *p.frames);
  p.lists = batten_alloc_array(ctx, edges + p.source.count, (LEVELS + 1) * sizeof *p.lists);
  p.distances = batten_alloc_array(ctx, edges, sizeof *p.distances);
  if (!p.frames || !p.lists || !p.distances) goto done;
  st = BATTEN_OK;
  if (!open_square(&p)) goto done;
  open_frames(&p);
  st = walk(&p);
  if (st >= 0) *proven = p.unproven == 0;
done:
  batten_free(ctx, p.distances);
  batten_free(ctx, p.lists);
  batten_free(ctx, p.frames);
  local_source_free(ctx, &p.source);
  return st;
}
