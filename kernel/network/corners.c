/* Corners of creases: where the tangents of the ends at a vertex leave a sector no clear plane.
 *
 * A triangle that is a sector by itself has an angle there, and so must the creases at its sides: with a common
 * tangent its patch would be singular. Every triangulation of a flat face without vertices inside has two such ears.
 * The surface on the other side of the creases, a wall across the flat face, can then not be smooth: its plane would
 * have to hold both tangents, and lie in the face. One of the wall's own edges becomes a crease there, as faint as
 * the angle of the rim is flat; it ends at the next crease, or fades away at the edge's other vertex. */
#include "features.h"

#include <string.h>

static const double PI = 3.14159265358979323846;

/* Tangents at the two sides of a sector say little of its plane when they are nearly opposite; and where two creases
 * meet at an angle, both sectors would have to lie in their plane, even if one is a wall across it. Mates are made of
 * ends that turn by less than STRAIGHT, and of those that turn by less than BENT and whose plane leaves the mean
 * plane of the sector's triangles by more than ASTRAY (radians: 3, 120, 45 degrees). */
static const double STRAIGHT = 0.05, BENT = 2.1, ASTRAY = 0.8;

/* Sines of angles between creases that are too small to make a plane. */
static const double TOO_NARROW = 0.2;

/* Angle-weighted normal of the triangles from the side `end`, counter-clockwise, to the next crease. */
static void sector_normal(const features *f, uint32_t end, double *out) {
  const net_topology *t = f->t;
  uint32_t h = t->half[end / 2];
  if (end % 2) h = t->twin[h]; /* sectors do not begin at the end of a boundary edge's only half-edge */
  out[0] = out[1] = out[2] = 0;
  for (;;) {
    const double *p = t->points + 3 * (size_t)t->triangles[h], *q = t->points + 3 * (size_t)t->triangles[net_next(h)],
                 *r = t->points + 3 * (size_t)t->triangles[net_prev(h)];
    double n[3], angle = vec_angle(p, q, r);
    vec_triangle_normal(p, q, r, n);
    vec_normalize(n);
    for (int k = 0; k < 3; k++) out[k] += angle * n[k];
    uint32_t in = net_prev(h);
    if (t->twin[in] == NET_NONE || t->kind[t->edge[in]] == NET_CREASE) break;
    h = t->twin[in];
  }
  vec_normalize(out);
}

/* How far the sector between two ends without mates turns, when its plane is better left to the triangles; else
 * INFINITY. */
static double straightness(const features *f, uint32_t a, uint32_t b) {
  if (f->mate[a] != NET_NONE || f->mate[b] != NET_NONE || share_triangle(f->t, a, b)) return INFINITY;
  const double *p = f->t->guide + 3 * (size_t)a, *q = f->t->guide + 3 * (size_t)b;
  double turn = turn_between(p, q), plane[3], normal[3];
  if (turn < STRAIGHT) return turn;
  if (turn > BENT) return INFINITY;
  vec_cross(p, q, plane);
  sector_normal(f, a, normal);
  double astray = angle_between(plane, normal);
  return fmin(astray, PI - astray) > ASTRAY ? turn : INFINITY;
}

/* A triangle between two ends that turn by less than half of what its edges do. Both go half of the way back. */
static void open_ears(features *f, size_t count, size_t sectors) {
  for (size_t i = 0; i < sectors; i++) {
    uint32_t side[2] = {f->ends[i], f->ends[(i + 1) % count]};
    double *guide[2] = {f->t->guide + 3 * (size_t)side[0], f->t->guide + 3 * (size_t)side[1]};
    if (!share_triangle(f->t, side[0], side[1])) continue;
    if (turn_between(guide[0], guide[1]) >= 0.5 * chord_turn(f->t, side[0], side[1])) continue;
    for (int s = 0; s < 2; s++) {
      double chord[3];
      end_chord(f->t, side[s], chord);
      vec_normalize(chord);
      for (int k = 0; k < 3; k++) guide[s][k] += chord[k];
      vec_normalize(guide[s]);
    }
  }
}

/* Ends that close in on each other go back to their edges, which stand apart. */
static void part_ends(features *f, size_t count, size_t sectors) {
  for (size_t i = 0; i < count; i++) f->straight[i] = 0;
  for (size_t i = 0; i < sectors; i++) {
    size_t side[2] = {i, (i + 1) % count};
    double chord[2][3];
    for (int s = 0; s < 2; s++) end_chord(f->t, f->ends[side[s]], chord[s]);
    const double *p = f->t->guide + 3 * (size_t)f->ends[side[0]], *q = f->t->guide + 3 * (size_t)f->ends[side[1]];
    if (angle_between(p, q) < 0.5 * angle_between(chord[0], chord[1]))
      f->straight[side[0]] = f->straight[side[1]] = 1;
  }
  for (size_t i = 0; i < count; i++) {
    double *guide = f->t->guide + 3 * (size_t)f->ends[i];
    if (!f->straight[i]) continue;
    end_chord(f->t, f->ends[i], guide);
    vec_normalize(guide);
  }
}

/* Where continued tangents leave a sector no clear plane: ends that oppose each other become mates, the straightest
 * first. */
void net_settle_corner(features *f, uint32_t v) {
  size_t count = gather_ends(f, v), sectors = is_on_boundary(f, v) ? count - 1 : count;
  if (count < 2 || f->mate[f->ends[0]] != NET_NONE) return;
  part_ends(f, count, sectors);
  open_ears(f, count, sectors);
  for (;;) {
    size_t best = count;
    double least = INFINITY, tangent[3];
    for (size_t i = 0; i < sectors; i++) {
      double turn = straightness(f, f->ends[i], f->ends[(i + 1) % count]);
      if (turn >= least) continue;
      least = turn;
      best = i;
    }
    if (best == count) return;
    uint32_t a = f->ends[best], b = f->ends[(best + 1) % count];
    vec_sub(f->t->guide + 3 * (size_t)b, f->t->guide + 3 * (size_t)a, tangent);
    vec_normalize(tangent);
    join_ends(f, a, b, tangent);
  }
}

/* ---- walls -------------------------------------------------------------------------------------- */

/* Cosine of the angle between the plane of two tangents and a sector's normal; 0 when they make no plane. */
static double plane_seen(const double *p, const double *q, const double *normal, double *plane) {
  vec_cross(p, q, plane);
  if (!(vec_norm(plane) > TOO_NARROW * vec_norm(p) * vec_norm(q))) return 0;
  vec_normalize(plane);
  return fabs(vec_dot(plane, normal));
}

/* The crease ends to both sides of the smooth edge of `end` at its vertex, clockwise and counter-clockwise; NET_NONE:
 * there is none all around. False at boundaries and darts. */
static bool crease_beside(const features *f, uint32_t end, uint32_t out[2]) {
  const net_topology *t = f->t;
  uint32_t start = end % 2 ? t->twin[t->half[end / 2]] : t->half[end / 2], h = start;
  out[0] = out[1] = NET_NONE;
  do {
    uint32_t in = net_prev(h);
    if (t->kind[t->edge[in]] == NET_CREASE) out[1] = end_at_end(t, in);
    h = t->twin[in];
    if (h == NET_NONE && out[1] == NET_NONE) return false;
  } while (out[1] == NET_NONE && h != start);
  if (out[1] == NET_NONE) return true;
  for (h = start; out[0] == NET_NONE;) {
    uint32_t in = t->twin[h];
    if (in == NET_NONE) return false;
    h = net_next(in);
    if (t->kind[t->edge[h]] == NET_CREASE) out[0] = end_at_start(t, h);
  }
  return out[0] != out[1] && !f->open[out[0]] && !f->open[out[1]];
}

/* The tangent that a new crease has at an end where others are: along its edge, in the plane of its sector, so that
 * both halves keep this. False when they would be too narrow. */
static bool tangent_between(const features *f, uint32_t end, const uint32_t beside[2], double *out) {
  const double *p = f->t->guide + 3 * (size_t)beside[0], *q = f->t->guide + 3 * (size_t)beside[1];
  double normal[3], plane[3];
  sector_normal(f, beside[0], normal);
  if (f->mate[beside[0]] == beside[1]) {
    double part = vec_dot(normal, p);
    for (int k = 0; k < 3; k++) normal[k] -= part * p[k];
    vec_normalize(normal);
  } else if (plane_seen(p, q, normal, plane) > cos(ASTRAY)) {
    memcpy(normal, plane, sizeof plane);
  }
  end_chord(f->t, end, out);
  double part = vec_dot(normal, out);
  for (int k = 0; k < 3; k++) out[k] -= part * normal[k];
  return vec_normalize(out) && plane_seen(out, p, normal, plane) > 0 && plane_seen(out, q, normal, plane) > 0;
}

/* Tangents of the edge of `end` at both ends if it were a crease; those of the other end 0 0 0 when it fades away
 * there. How well the two planes into which it parts the sector from a to b fit their triangles; 0 not at all. */
static double judge_split(features *f, uint32_t end, uint32_t a, uint32_t b, double tangent[2][3]) {
  uint32_t beside[2];
  double chord[3], normal[3], plane[3];
  if (!crease_beside(f, end ^ 1, beside)) return 0;
  end_chord(f->t, end, chord);
  memcpy(tangent[0], chord, sizeof chord);
  memset(tangent[1], 0, sizeof tangent[1]);
  if (beside[0] != NET_NONE) {
    if (!tangent_between(f, end ^ 1, beside, tangent[1])) return 0;
    mirror(chord, tangent[1], tangent[0]);
  }
  vec_normalize(tangent[0]);
  f->t->kind[end / 2] = NET_CREASE;
  sector_normal(f, a, normal);
  double first = plane_seen(f->t->guide + 3 * (size_t)a, tangent[0], normal, plane);
  sector_normal(f, end, normal);
  double second = plane_seen(f->t->guide + 3 * (size_t)b, tangent[0], normal, plane);
  f->t->kind[end / 2] = NET_SMOOTH;
  return fmin(first, second);
}

/* True when an edge between the ends a and b, which follow each other, has become a crease. */
static bool split_wall(features *f, uint32_t a, uint32_t b) {
  net_topology *t = f->t;
  double normal[3], plane[3], best = cos(ASTRAY), tangent[2][3], found[2][3];
  uint32_t h = t->half[a / 2], end = NET_NONE;
  if (f->mate[a] == b || f->open[a] || f->open[b]) return false;
  sector_normal(f, a, normal);
  vec_cross(t->guide + 3 * (size_t)a, t->guide + 3 * (size_t)b, plane);
  if (!vec_normalize(plane) || fabs(vec_dot(plane, normal)) > cos(ASTRAY)) return false;
  if (a % 2) h = t->twin[h];
  while (t->edge[net_prev(h)] != b / 2) {
    h = t->twin[net_prev(h)];
    double fit = judge_split(f, end_at_start(t, h), a, b, tangent);
    if (fit <= best) continue;
    best = fit;
    end = end_at_start(t, h);
    memcpy(found, tangent, sizeof found);
  }
  if (end == NET_NONE) return false;
  t->kind[end / 2] = NET_CREASE;
  t->crease_edges++;
  memcpy(t->guide + 3 * (size_t)end, found[0], sizeof found[0]);
  memcpy(t->guide + 3 * (size_t)(end ^ 1), found[1], sizeof found[1]);
  f->open[end ^ 1] = vec_dot(found[1], found[1]) == 0;
  return true;
}

void net_split_walls(features *f, uint32_t v) {
  for (bool split = true; split;) {
    size_t count = gather_ends(f, v), sectors = is_on_boundary(f, v) ? count - 1 : count;
    split = false;
    for (size_t i = 0; i < sectors && count >= 2 && !split; i++)
      split = split_wall(f, f->ends[i], f->ends[(i + 1) % count]);
  }
}
