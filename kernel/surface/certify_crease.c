/* Creases: sides of span pairs along an inner knot that is there as often as the degree.
 *
 * With x_a the derivative along the side and x_b, y_b those across it before and after the knot the surface turns
 * from p to q, the parts of x_b and y_b across x_a. J = y_b . n, n the normal before it (x_b, x_a in the order of u,
 * v), is |n| times what q rises over the tangent plane there: it has the sign of L' where q is turned from p by less
 * than half a turn to the side to which the surface bends. J may vanish where the sides join smoothly, which rounding
 * of the control points turns into either sign; then the normals n, m of both must not be opposite, T = n . m > 0, or
 * the surface would turn back on itself. Both are polynomials along the side: so J > error, or J >= -error and T >
 * error, on parts of it. */
#include "certify.h"

#include <math.h>

void certify_edge_make(const certify_jet *jet, int axis, bool upper, certify_edge *out) {
  for (int k = 0; k < 6; k++) {
    const certify_poly *p = &jet->part[(k < 3) == (axis == 0) ? CERTIFY_U : CERTIFY_V][k % 3];
    size_t columns = p->degree[1] + 1, step = axis == 0 ? 1 : columns;
    const double *from = p->c + (upper ? p->degree[axis] * (axis == 0 ? columns : 1) : 0);
    unsigned degree = p->degree[1 - axis];
    /* Scaled by one binomial less: that of the side is 1. */
    for (unsigned x = 0; x <= degree; x++) out->c[k][x] = from[x * step];
    *(k < 3 ? &out->across[k] : &out->along[k - 3]) =
        (certify_poly){.degree = {0, degree}, .c = out->c[k], .most = p->most, .error = p->error};
  }
}

static void normal_of(const certify_edge *e, int axis, certify_poly normal[3]) {
  certify_cross(axis == 0 ? e->across : e->along, axis == 0 ? e->along : e->across, normal);
}

static void product_of(const certify_poly a[3], const certify_poly b[3], double sign, certify_poly *out) {
  certify_clear(out, 0, a->degree[1] + b->degree[1]);
  for (int x = 0; x < 3; x++) certify_add_product(out, sign, &a[x], &b[x], 3);
  certify_unscale(out);
}

enum { TURN, TOGETHER, STACK = 28, PARTS = 4096 };

/* A part of the side: coefficients of J and T. */
typedef struct part {
  double c[2][CERTIFY_ORDER], error[2], lower;
  unsigned depth;
} part;
_Static_assert(6 * CERTIFY_ORDER + STACK * sizeof(part) / sizeof(double) <= CERTIFY_FACES_DOUBLES, "room");

/* Least coefficients, those at the ends, and the largest sizes. */
typedef struct range {
  double least[2], end[2], most[2];
} range;

static range range_of(const part *p, const unsigned degree[2]) {
  range r = {{INFINITY, INFINITY}, {0}, {0}};
  for (int k = 0; k < 2; k++) {
    for (unsigned x = 0; x <= degree[k]; x++) {
      r.least[k] = fmin(r.least[k], p->c[k][x]);
      r.most[k] = fmax(r.most[k], fabs(p->c[k][x]));
    }
    r.end[k] = fmin(p->c[k][0], p->c[k][degree[k]]);
  }
  return r;
}

static bool holds(const double value[2], const double error[2]) {
  return value[TURN] > error[TURN] || (value[TURN] >= -error[TURN] && value[TOGETHER] > error[TOGETHER]);
}

bool certify_crease(const certify_edge *before, const certify_edge *after, int axis, int sign, double *room,
                    double *at) {
  certify_poly normal[2][3], f[2];
  for (int k = 0; k < 2; k++)
    for (int x = 0; x < 3; x++, room += CERTIFY_ORDER) normal[k][x].c = room;
  part *stack = (part *)room;
  for (int k = 0; k < 2; k++) f[k].c = stack[0].c[k];
  normal_of(before, axis, normal[0]);
  normal_of(after, axis, normal[1]);
  product_of(after->across, normal[0], sign, &f[TURN]);
  product_of(normal[0], normal[1], 1, &f[TOGETHER]);
  const unsigned degree[2] = {f[TURN].degree[1], f[TOGETHER].degree[1]};
  for (int k = 0; k < 2; k++) stack[0].error[k] = f[k].error;
  stack[0].lower = 0;
  stack[0].depth = 0;
  size_t count = 1;
  for (size_t looked = 0; count > 0; looked++) {
    part *p = &stack[count - 1];
    range r = range_of(p, degree);
    if (holds(r.least, p->error)) {
      count--;
      continue;
    }
    /* The least ends may be those of different places; then halves tell. */
    bool hopeless = r.end[TURN] < -p->error[TURN];
    if (hopeless || p->depth + 2 > STACK || looked >= PARTS) {
      *at = p->lower + (p->c[TURN][0] > r.end[TURN] ? ldexp(1, -(int)p->depth) : 0);
      return false;
    }
    double work[CERTIFY_ORDER];
    for (int k = 0; k < 2; k++) {
      certify_bisect(1, 1, 1, degree[k] + 1, p->c[k], p[1].c[k], work);
      p->error[k] = (p->error[k] + degree[k] * CERTIFY_EPS * r.most[k]) * CERTIFY_UP + CERTIFY_TINY;
      p[1].error[k] = p->error[k];
    }
    p[1].depth = ++p->depth;
    p[1].lower = p->lower + ldexp(1, -(int)p->depth);
    count++;
  }
  return true;
}
