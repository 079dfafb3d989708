/* See pattern.h. With equal sides the lattice itself. Else the lattice without its outermost strips, and three strips
 * that join each side to the inner lattice's side beside it; where there is no inner lattice, one or two triangles
 * fewer than the lattice of two steps has. */
#include "network/pattern.h"

#include <math.h>

#include "basis/triangular.h"

size_t net_pattern_triangle_count(const unsigned segments[3]) {
  size_t n = net_pattern_steps(segments), around = (size_t)segments[0] + segments[1] + segments[2];
  return n < 3 ? n == 2 && around == 6 ? 4 : around - 2 : (n - 3) * (n - 3) + 3 * (n - 3) + around;
}

static void put(uint32_t (*out)[3], size_t *made, uint32_t a, uint32_t b, uint32_t c) {
  uint32_t *t = out[(*made)++];
  t[0] = a;
  t[1] = b;
  t[2] = c;
}

/* Vertex (j, k) of the lattice of n steps with equal sides. */
static uint32_t lattice(const net_pattern *p, unsigned n, unsigned j, unsigned k) {
  if (k == 0) return net_pattern_vertex(p, 0, j);
  if (j + k == n) return net_pattern_vertex(p, 1, k);
  if (j == 0) return net_pattern_vertex(p, 2, n - k);
  return p->inner + (uint32_t)triangular_index(n - 3, j - 1, k - 1);
}

/* The triangles of lattice rows from .. n - from, between places with all coordinates >= from. */
static void fill_lattice(const net_pattern *p, unsigned n, unsigned from, uint32_t (*out)[3], size_t *made) {
  for (unsigned k = from; k + 2 * from < n; k++)
    for (unsigned j = from; j + k + from < n; j++) {
      put(out, made, lattice(p, n, j, k), lattice(p, n, j + 1, k), lattice(p, n, j, k + 1));
      if (j + k + from + 1 < n)
        put(out, made, lattice(p, n, j + 1, k), lattice(p, n, j + 1, k + 1), lattice(p, n, j, k + 1));
    }
}

/* Vertex s of the inner lattice's side that lies beside side i. */
static uint32_t beside(const net_pattern *p, unsigned n, unsigned i, unsigned s) {
  unsigned rest = n - 3 - s;
  unsigned j = i == 0 ? s : i == 1 ? rest : 0, k = i == 0 ? 0 : i == 1 ? s : rest;
  return p->inner + (uint32_t)triangular_index(n - 3, j, k);
}

/* Strip along side i: the shorter of the two possible edges each time, by their places along the side. */
static void fill_strip(const net_pattern *p, unsigned n, unsigned i, uint32_t (*out)[3], size_t *made) {
  unsigned outer = p->segments[i], inner = n - 3, a = 0, b = 0;
  while (a < outer || b < inner) {
    double here = (double)a / outer, next = (double)(a + 1) / outer;
    double there = (b + 1.5) / n, beyond = (b + 2.5) / n;
    uint32_t from = net_pattern_vertex(p, i, a), to = beside(p, n, i, b);
    if (b == inner || (a < outer && fabs(next - there) <= fabs(beyond - here)))
      put(out, made, from, net_pattern_vertex(p, i, ++a), to);
    else
      put(out, made, from, beside(p, n, i, ++b), to);
  }
}

/* One or two sides of two segments, the rest of one. */
static void fill_small(const net_pattern *p, uint32_t (*out)[3], size_t *made) {
  unsigned i = 0; /* the side that is cut; of two, the first */
  while (p->segments[i] == 1 || p->segments[(i + 2) % 3] == 2) i++;
  uint32_t a = p->corner[i], b = p->corner[(i + 1) % 3], c = p->corner[(i + 2) % 3];
  uint32_t middle = net_pattern_vertex(p, i, 1);
  if (p->segments[(i + 1) % 3] == 1) {
    put(out, made, middle, b, c);
  } else {
    uint32_t other = net_pattern_vertex(p, (i + 1) % 3, 1);
    put(out, made, middle, b, other);
    put(out, made, middle, other, c);
  }
  put(out, made, middle, c, a);
}

void net_pattern_triangulate(const net_pattern *p, uint32_t (*out)[3]) {
  unsigned n = net_pattern_steps(p->segments);
  size_t made = 0;
  if (p->segments[0] == n && p->segments[1] == n && p->segments[2] == n) {
    fill_lattice(p, n, 0, out, &made);
  } else if (n < 3) {
    fill_small(p, out, &made);
  } else {
    fill_lattice(p, n, 1, out, &made);
    for (unsigned i = 0; i < 3; i++) fill_strip(p, n, i, out, &made);
  }
}
