/* Values, gradients and Hessians of the primitive carriers, each positive inside.
 *
 * Box, cylinder and torus are signed distances: the shape is a core (a smaller box, a smaller cylinder, a circle)
 * grown by a radius r, f = r - distance to the core. On the medial set, where the distance has a kink, the one-sided
 * derivatives of the part that comes first are taken, and 0 where there is none (axis, circle of the torus). */
#include <math.h>
#include <string.h>

#include "solid/carrier_inner.h"

/* Signed distance to the box [-q, q] seen from its surface: e_i = |y_i| - q_i per axis, its value, d/de and d2/de2.
 * Outside |max(e, 0)|, inside max e. */
static double corner_distance(unsigned n, const double *e, double *de, double *dde) {
  double squares = 0;
  unsigned largest = 0;
  for (unsigned i = 0; i < n; i++) {
    double out = e[i] > 0 ? e[i] : 0;
    squares += out * out;
    if (e[i] > e[largest]) largest = i;
  }
  memset(dde, 0, n * n * sizeof *dde);
  if (squares > 0) {
    double d = sqrt(squares);
    for (unsigned i = 0; i < n; i++) de[i] = e[i] > 0 ? e[i] / d : 0;
    for (unsigned i = 0; i < n; i++)
      for (unsigned j = 0; j < n; j++) dde[i * n + j] = ((i == j && e[i] > 0) - de[i] * de[j]) / d;
    return d;
  }
  for (unsigned i = 0; i < n; i++) de[i] = i == largest;
  return e[largest];
}

/* y = rotation (x - center) */
static void to_local(unsigned n, const double *center, const double *rotation, const double *x, double *y) {
  for (unsigned i = 0; i < n; i++) {
    y[i] = 0;
    for (unsigned j = 0; j < n; j++) y[i] += rotation[i * n + j] * (x[j] - center[j]);
  }
}

/* g = rotation' local g, H = rotation' local H rotation, both negated: from a distance to a field. */
static void gradient_to_world(unsigned n, const double *rotation, const double *local, double *g) {
  for (unsigned j = 0; j < n; j++) {
    g[j] = 0;
    for (unsigned i = 0; i < n; i++) g[j] -= rotation[i * n + j] * local[i];
  }
}
static void hessian_to_world(unsigned n, const double *rotation, const double *local, double *h) {
  for (unsigned a = 0; a < n; a++)
    for (unsigned b = 0; b < n; b++) {
      double sum = 0;
      for (unsigned i = 0; i < n; i++)
        for (unsigned j = 0; j < n; j++) sum += rotation[i * n + a] * local[i * n + j] * rotation[j * n + b];
      h[a * n + b] = -sum;
    }
}

static void none_at(const batten_carrier *c, const double *x, double *f, double *g, double *h) {
  (void)x;
  if (f) *f = 0;
  if (g) memset(g, 0, c->n * sizeof *g);
  if (h) memset(h, 0, c->n * c->n * sizeof *h);
}

static void ball_at(const batten_carrier *c, const double *x, double *f, double *g, double *h) {
  unsigned n = c->n;
  double radius = c->parameters[n], square = 0;
  for (unsigned i = 0; i < n; i++) {
    double d = x[i] - c->parameters[i];
    square += d * d;
    if (g) g[i] = -2 * d;
  }
  if (f) *f = radius * radius - square;
  if (h)
    for (unsigned i = 0; i < n * n; i++) h[i] = i % (n + 1) == 0 ? -2 : 0;
}

static void ellipsoid_at(const batten_carrier *c, const double *x, double *f, double *g, double *h) {
  unsigned n = c->n;
  const double *axes = c->parameters + n, *rotation = axes + n;
  double y[3], local[9], least = axes[0], sum = 0;
  for (unsigned i = 1; i < n; i++) least = fmin(least, axes[i]);
  to_local(n, c->parameters, rotation, x, y);
  for (unsigned i = 0; i < n; i++) {
    double weight = (least / axes[i]) * (least / axes[i]);
    sum += weight * y[i] * y[i];
    y[i] *= 2 * weight;
    for (unsigned j = 0; j < n; j++) local[i * n + j] = i == j ? 2 * weight : 0;
  }
  if (f) *f = least * least - sum;
  if (g) gradient_to_world(n, rotation, y, g);
  if (h) hessian_to_world(n, rotation, local, h);
}

static void box_at(const batten_carrier *c, const double *x, double *f, double *g, double *h) {
  unsigned n = c->n;
  const double *half = c->parameters + n, *rotation = half + n;
  double rounding = rotation[n * n], y[3], e[3], de[3], dde[9];
  to_local(n, c->parameters, rotation, x, y);
  for (unsigned i = 0; i < n; i++) e[i] = fabs(y[i]) - (half[i] - rounding);
  double distance = corner_distance(n, e, de, dde);
  for (unsigned i = 0; i < n; i++) {
    double side = y[i] < 0 ? -1 : 1;
    de[i] *= side;
    for (unsigned j = 0; j < n; j++) {
      dde[i * n + j] *= side;
      dde[j * n + i] *= side;
    }
  }
  if (f) *f = rounding - distance;
  if (g) gradient_to_world(n, rotation, de, g);
  if (h) hessian_to_world(n, rotation, dde, h);
}

/* A field F(rho, z) of the distance rho from an axis and the place z along it, turned into space.
 * dF = (F_rho, F_z), ddF row-major; e is the unit vector away from the axis, 0 on it. */
static void revolve(const double axis[3], const double e[3], double rho, const double dF[2], const double ddF[4],
                    double *g, double *h) {
  if (g)
    for (unsigned i = 0; i < 3; i++) g[i] = dF[0] * e[i] + dF[1] * axis[i];
  if (!h) return;
  double around = rho > 0 ? dF[0] / rho : 0; /* curvature of the circles about the axis */
  for (unsigned i = 0; i < 3; i++)
    for (unsigned j = 0; j < 3; j++)
      h[3 * i + j] = ddF[0] * e[i] * e[j] + ddF[1] * e[i] * axis[j] + ddF[2] * axis[i] * e[j] +
                     ddF[3] * axis[i] * axis[j] + around * ((i == j) - axis[i] * axis[j] - e[i] * e[j]);
}

/* z along the axis and rho, e away from it. */
static double cylindrical(const double center[3], const double axis[3], const double *x, double *rho, double e[3]) {
  double z = 0, square = 0;
  for (unsigned i = 0; i < 3; i++) z += (x[i] - center[i]) * axis[i];
  for (unsigned i = 0; i < 3; i++) {
    e[i] = x[i] - center[i] - z * axis[i];
    square += e[i] * e[i];
  }
  *rho = sqrt(square);
  for (unsigned i = 0; i < 3; i++) e[i] = *rho > 0 ? e[i] / *rho : 0;
  return z;
}

static void cylinder_at(const batten_carrier *c, const double *x, double *f, double *g, double *h) {
  double radius = c->parameters[6], rounding = c->parameters[7], rho, e[3], dF[2], ddF[4];
  double z = cylindrical(c->middle, c->axis, x, &rho, e), side = z < 0 ? -1 : 1;
  double edge[2] = {rho - (radius - rounding), fabs(z) - (c->half_length - rounding)};
  double distance = corner_distance(2, edge, dF, ddF);
  if (f) *f = rounding - distance;
  dF[0] = -dF[0];
  dF[1] *= -side;
  ddF[0] = -ddF[0];
  ddF[1] *= -side;
  ddF[2] *= -side;
  ddF[3] = -ddF[3];
  revolve(c->axis, e, rho, dF, ddF, g, h);
}

static void torus_at(const batten_carrier *c, const double *x, double *f, double *g, double *h) {
  double rho, e[3], z = cylindrical(c->parameters, c->axis, x, &rho, e), out = rho - c->parameters[6];
  double d = sqrt(out * out + z * z), dF[2] = {0, 0}, ddF[4] = {0, 0, 0, 0};
  if (f) *f = c->parameters[7] - d;
  if (d > 0) { /* F = r - d: dF = -(out, z) / d, ddF = -(I - dF dF') / d */
    dF[0] = -out / d;
    dF[1] = -z / d;
    ddF[0] = (dF[0] * dF[0] - 1) / d;
    ddF[1] = ddF[2] = dF[0] * dF[1] / d;
    ddF[3] = (dF[1] * dF[1] - 1) / d;
  }
  revolve(c->axis, e, rho, dF, ddF, g, h);
}

static void half_space_at(const batten_carrier *c, const double *x, double *f, double *g, double *h) {
  unsigned n = c->n;
  double sum = 0;
  for (unsigned i = 0; i < n; i++) {
    sum += (c->parameters[i] - x[i]) * c->axis[i];
    if (g) g[i] = -c->axis[i];
  }
  if (f) *f = sum;
  if (h) memset(h, 0, n * n * sizeof *h);
}

void batten_carrier_shape(const batten_carrier *c, size_t count, const double *points, double *values,
                          double *gradients, double *hessians) {
  size_t n = c->n;
  /* The loop stands inside each case so that the shape is compiled into it. */
#define AT_ALL(shape)                                                                        \
  for (size_t i = 0; i < count; i++)                                                         \
  shape(c, points + i * n, values ? values + i : NULL, gradients ? gradients + i * n : NULL, \
        hessians ? hessians + i * n * n : NULL)
  switch (c->kind) {
    case BATTEN_CARRIER_BALL:
      AT_ALL(ball_at);
      break;
    case BATTEN_CARRIER_ELLIPSOID:
      AT_ALL(ellipsoid_at);
      break;
    case BATTEN_CARRIER_BOX:
      AT_ALL(box_at);
      break;
    case BATTEN_CARRIER_CYLINDER:
      AT_ALL(cylinder_at);
      break;
    case BATTEN_CARRIER_TORUS:
      AT_ALL(torus_at);
      break;
    case BATTEN_CARRIER_HALF_SPACE:
      AT_ALL(half_space_at);
      break;
    case BATTEN_CARRIER_NONE:
    case BATTEN_CARRIER_UNION:
    case BATTEN_CARRIER_INTERSECTION:
    case BATTEN_CARRIER_CALLBACK:
    case BATTEN_CARRIER_SOLID:
      AT_ALL(none_at);
      break;
  }
#undef AT_ALL
}
