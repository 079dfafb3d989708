/* Where the plane across a path passes through a point: all roots of h(u) = o'(u) . (x - o(u)) in a piece, see
 * sweep_path.c. */
#include <math.h>
#include <string.h>

#include "frep/sweep_path.h"

enum {
  DEGREE = 5,
  DEPTH = 40 /* halvings: roots closer than 1e-12 of a piece are one */
};

typedef struct stretch {
  double c[DEGREE + 1], from, to;
  int depth;
} stretch;

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Number that tells on which side of the plane at a node x lies: >= 0 ahead. */
static double side_of(const sweep_node *node, const double *x) {
  const double q[3] = {x[0] - node->o[0], x[1] - node->o[1], x[2] - node->o[2]};
  return dot(node->tangent, q);
}

static unsigned changes_of(const double *c) {
  unsigned changes = 0;
  for (int i = 0; i < DEGREE; i++) changes += (c[i] >= 0) != (c[i + 1] >= 0);
  return changes;
}

static void halve(const stretch *s, stretch *left, stretch *right) {
  double c[DEGREE + 1];
  memcpy(c, s->c, sizeof c);
  double middle = s->from / 2 + s->to / 2;
  for (int i = 0; i <= DEGREE; i++) {
    left->c[i] = c[0];
    right->c[DEGREE - i] = c[DEGREE - i];
    for (int j = 0; j < DEGREE - i; j++) c[j] = c[j] / 2 + c[j + 1] / 2;
  }
  left->from = s->from;
  left->to = right->from = middle;
  right->to = s->to;
  left->depth = right->depth = s->depth + 1;
}

/* The one root between from and to: Newton's steps, halves where they leave the bracket or are slow. */
static double close_in(const sweep_piece *p, const double *x, double from, double to, bool rising) {
  double u = from / 2 + to / 2;
  for (int step = 0; step < 60; step++) {
    double o[3], slope[3], bend[3], width = to - from;
    sweep_piece_at(p, u, o, slope, bend);
    const double q[3] = {x[0] - o[0], x[1] - o[1], x[2] - o[2]};
    double h = dot(slope, q), dh = dot(bend, q) - dot(slope, slope);
    if (h == 0) return u;
    if ((h > 0) == rising)
      to = u;
    else
      from = u;
    double next = u - h / dh;
    if (!(next > from && next < to) || (step > 8 && to - from > width / 2)) next = from / 2 + to / 2;
    if (fabs(next - u) <= 1e-16 || next == u) return next;
    u = next;
  }
  return u;
}

size_t sweep_roots(const sweep_path *path, size_t piece, const double *x, double roots[5]) {
  const sweep_piece *p = path->piece + piece;
  const double q[3] = {x[0] - p->b[0][0], x[1] - p->b[0][1], x[2] - p->b[0][2]};
  double left = side_of(path->node + piece, x), right = side_of(path->node + piece + 1, x);
  bool one = (left >= 0) != (right >= 0);
  /* short of the middle of the bend, where h falls all along, and across straight pieces its sign changes at most
   * once */
  double turned = fmax(dot(p->second[0], q), dot(p->second[1], q)) + p->bend * p->length;
  if (turned < p->slow * p->slow || p->turn == 0) {
    if (!one) return 0;
    roots[0] = close_in(p, x, 0, 1, left < 0);
    return 1;
  }
  stretch stack[DEPTH + 2];
  size_t open = 1, found = 0;
  stack[0] = (stretch){.to = 1};
  for (int i = 0; i <= DEGREE; i++) stack[0].c[i] = dot(p->plane[i], q) - p->offset[i];
  if ((stack[0].c[0] >= 0) != (left >= 0)) stack[0].c[0] = left;
  if ((stack[0].c[DEGREE] >= 0) != (right >= 0)) stack[0].c[DEGREE] = right;
  while (open > 0 && found < 5) {
    stretch s = stack[--open];
    unsigned changes = changes_of(s.c);
    if (changes == 0) continue;
    if (changes == 1 || s.depth == DEPTH) {
      roots[found++] = changes == 1 ? close_in(p, x, s.from, s.to, s.c[0] < 0) : s.from;
      continue;
    }
    halve(&s, &stack[open + 1], &stack[open]); /* the left half is looked at first */
    open += 2;
  }
  return found;
}
