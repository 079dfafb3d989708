/* What features.c and corners.c share: ends of creases. */
#ifndef BATTEN_NETWORK_FEATURES_H
#define BATTEN_NETWORK_FEATURES_H

#include "network/net.h"

typedef struct features {
  net_topology *t;
  uint32_t *first;         /* [V] half-edge with which the fan of a vertex begins: creases do not end it */
  uint32_t *mate;          /* [2 edges] by end: the end on which the curve goes on, or NET_NONE */
  unsigned char *open;     /* [2 edges] non-zero: an end whose direction is free, at a dart */
  uint32_t *ends;          /* [most triangles at a vertex + 1] ends at the vertex in hand, counter-clockwise */
  unsigned char *straight; /* [as many] */
  double *curvature;       /* [2 edges][3] scratch: curvature vectors at mates */
  double corner_angle;
} features;

/* End 2 e + 0 is edge e at its start, 2 e + 1 at its end. */
static inline uint32_t end_at_start(const net_topology *t, uint32_t h) {
  return 2 * t->edge[h] + (t->half[t->edge[h]] != h);
}
static inline uint32_t end_at_end(const net_topology *t, uint32_t h) { return end_at_start(t, h) ^ 1; }

static inline uint32_t end_vertex(const net_topology *t, uint32_t end) {
  uint32_t h = t->half[end / 2];
  return t->triangles[end % 2 ? net_next(h) : h];
}

/* From the end's vertex to the other. */
static inline void end_chord(const net_topology *t, uint32_t end, double *out) {
  vec_sub(t->points + 3 * (size_t)end_vertex(t, end ^ 1), t->points + 3 * (size_t)end_vertex(t, end), out);
}

static inline double angle_between(const double *a, const double *b) {
  double c[3];
  vec_cross(a, b, c);
  return atan2(vec_norm(c), vec_dot(a, b));
}

/* The turn of a curve that comes in along a and goes out along b, both directions pointing out. */
static inline double turn_between(const double *a, const double *b) {
  double back[3] = {-a[0], -a[1], -a[2]};
  return angle_between(back, b);
}

/* The turn of the edges themselves. */
static inline double chord_turn(const net_topology *t, uint32_t a, uint32_t b) {
  double p[3], q[3];
  end_chord(t, a, p);
  end_chord(t, b, q);
  return turn_between(p, q);
}

/* out = direction at one end of an arc over the chord whose other end leaves along d: its mirror image. */
static inline void mirror(const double *chord, const double *d, double *out) {
  double factor = 2 * vec_dot(d, chord) / vec_dot(chord, chord);
  for (int k = 0; k < 3; k++) out[k] = d[k] - factor * chord[k];
}

/* a and b become mates with a common tangent that points out along b. */
static inline void join_ends(features *f, uint32_t a, uint32_t b, const double *tangent) {
  for (int k = 0; k < 3; k++) {
    f->t->guide[3 * (size_t)a + (size_t)k] = -tangent[k];
    f->t->guide[3 * (size_t)b + (size_t)k] = tangent[k];
  }
  f->mate[a] = b;
  f->mate[b] = a;
}

/* The crease ends at v in f->ends; their number. */
static inline size_t gather_ends(const features *f, uint32_t v) {
  const net_topology *t = f->t;
  size_t count = 0;
  uint32_t h = f->first[v], next;
  for (bool more = true; more; h = next) {
    if (t->kind[t->edge[h]] == NET_CREASE) f->ends[count++] = end_at_start(t, h);
    uint32_t in = net_prev(h);
    next = t->twin[in];
    more = next != NET_NONE && next != f->first[v];
    if (next == NET_NONE && t->kind[t->edge[in]] == NET_CREASE) f->ends[count++] = end_at_end(t, in);
  }
  return count;
}

static inline bool is_on_boundary(const features *f, uint32_t v) { return f->t->twin[f->first[v]] == NET_NONE; }
static inline bool is_boundary_edge(const net_topology *t, uint32_t e) { return t->twin[t->half[e]] == NET_NONE; }

/* Both ends belong to one triangle: with one tangent it would have to make half a turn between them, and be singular.
 */
static inline bool share_triangle(const net_topology *t, uint32_t a, uint32_t b) {
  uint32_t h = t->half[a / 2];
  for (int side = 0; side < 2 && h != NET_NONE; side++, h = t->twin[h])
    if (t->edge[net_next(h)] == b / 2 || t->edge[net_prev(h)] == b / 2) return true;
  return false;
}

/* Ends at v that have no mates, once all ends have guides. */
void net_settle_corner(features *f, uint32_t v);
/* Creases that walls need where the creases at v leave them no plane; after all corners are settled. */
void net_split_walls(features *f, uint32_t v);

#endif
