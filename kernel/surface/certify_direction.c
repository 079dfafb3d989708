/* One direction against all normals: the surface has no folds over the plane across it.
 *
 * A direction with positive products with all of some vectors is that of the point of their convex hull nearest to 0
 * [Gilbert 1966]: the current point is moved to the nearest one of its segment to the vector of least product with
 * it.
 */
#include <math.h>

#include "certify.h"
#include "mesh/vec.h"

static size_t worst_normal(size_t count, const double (*normals)[3], const double *g) {
  size_t worst = 0;
  double least = INFINITY;
  for (size_t i = 0; i < count; i++) {
    double product = vec_dot(normals[i], g);
    if (product < least) {
      least = product;
      worst = i;
    }
  }
  return worst;
}

bool certify_direction(size_t count, const double (*normals)[3], double direction[3]) {
  double g[3] = {0};
  if (count == 0) return false;
  for (size_t i = 0; i < count; i++)
    for (int x = 0; x < 3; x++) g[x] += normals[i][x] / (double)count;
  for (int turn = 0; turn < 256; turn++) { /* more find nothing that could be proven */
    size_t worst = worst_normal(count, normals, g);
    double to[3], length = vec_dot(g, g);
    vec_sub(normals[worst], g, to);
    /* g . normal >= |g|^2 for all: the nearest point. */
    if (vec_dot(to, g) >= -1e-3 * length) break;
    double part = fmin(1, -vec_dot(to, g) / vec_dot(to, to));
    for (int x = 0; x < 3; x++) g[x] += part * to[x];
  }
  if (!vec_normalize(g) || !(vec_dot(normals[worst_normal(count, normals, g)], g) > 0)) return false;
  for (int x = 0; x < 3; x++) direction[x] = g[x];
  return true;
}

bool certify_faces(const certify_poly cross[3], const double direction[3], double *room) {
  enum { STACK = 24, BOXES = 4096 };
  certify_poly constant = {.degree = {0, 0}, .most = 0, .error = 0}, f = cross[0];
  f.c = room;
  certify_clear(&f, cross[0].degree[0], cross[0].degree[1]);
  for (int x = 0; x < 3; x++) {
    double value = direction[x];
    constant.c = &value;
    constant.most = fabs(value);
    certify_add_product(&f, 1, &cross[x], &constant, 3);
  }
  certify_unscale(&f);
  double *work = room + (STACK + 1) * CERTIFY_CROSS, error[STACK + 1] = {f.error};
  unsigned depth[STACK + 1] = {0}; /* bisections, of u and v in turn */
  size_t rows = f.degree[0] + 1, columns = f.degree[1] + 1, n = rows * columns, count = 1;
  for (size_t boxes = 0; count > 0; boxes++) {
    size_t at = count - 1;
    double *c = room + at * CERTIFY_CROSS, least = INFINITY, most = 0;
    for (size_t x = 0; x < n; x++) {
      least = fmin(least, c[x]);
      most = fmax(most, fabs(c[x]));
    }
    if (least > error[at]) {
      count--;
      continue;
    }
    double corner = fmin(fmin(c[0], c[columns - 1]), fmin(c[n - columns], c[n - 1]));
    if (!(corner > error[at]) || depth[at] + 1 >= STACK || boxes >= BOXES) return false;
    unsigned axis = depth[at] % 2;
    certify_bisect(axis, 1, rows, columns, c, c + CERTIFY_CROSS, work);
    error[at] = (error[at] + f.degree[axis] * CERTIFY_EPS * most) * CERTIFY_UP + CERTIFY_TINY;
    error[at + 1] = error[at];
    depth[at + 1] = ++depth[at];
    count++;
  }
  return true;
}
