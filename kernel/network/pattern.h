/* Triangles between places on a triangle whose sides are cut into different numbers of segments. */
#ifndef BATTEN_NETWORK_PATTERN_H
#define BATTEN_NETWORK_PATTERN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Places are the inner ones of a lattice of `steps` = max(segments) rows, (j, k) / steps with j, k >= 1, j + k <
 * steps, and on the sides: side i runs from corner i to corner (i + 1) % 3 in segments[i] equal steps. Numbers of the
 * vertices there: corner[i]; first[i] .. along side i, or against it when back[i]; inner .. row by row, j fastest. */
typedef struct net_pattern {
  unsigned segments[3];
  uint32_t corner[3], first[3], inner;
  bool back[3];
} net_pattern;

static inline unsigned net_pattern_steps(const unsigned segments[3]) {
  unsigned n = segments[0] > segments[1] ? segments[0] : segments[1];
  return n > segments[2] ? n : segments[2];
}
static inline size_t net_pattern_inner_count(const unsigned segments[3]) {
  size_t n = net_pattern_steps(segments);
  return n < 3 ? 0 : (n - 1) * (n - 2) / 2;
}
size_t net_pattern_triangle_count(const unsigned segments[3]);

/* Vertex at step s of side i, 0 <= s <= segments[i]. */
static inline uint32_t net_pattern_vertex(const net_pattern *p, unsigned i, unsigned s) {
  if (s == 0) return p->corner[i];
  if (s == p->segments[i]) return p->corner[(i + 1) % 3];
  return p->first[i] + (p->back[i] ? p->segments[i] - 1 - s : s - 1);
}

/* The triangles, counter-clockwise as the corners: out [net_pattern_triangle_count][3]. */
void net_pattern_triangulate(const net_pattern *p, uint32_t (*out)[3]);

#endif
