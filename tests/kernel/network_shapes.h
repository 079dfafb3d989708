/* Networks whose surface is known exactly, for tests of what is asked of networks: nothing here knows how networks
 * are made. Patches interpolate a polynomial map at as many places as they have control points. */
#ifndef NETWORK_SHAPES_H
#define NETWORK_SHAPES_H

#include <batten/network.h>

#include "basis/triangular.h"
#include "tap.h"

typedef struct shape {
  size_t vertices, faces, patches, creases;
  double *points;      /* [vertices][3] */
  uint32_t *triangles; /* [faces][3] */
  uint32_t crease[8][2];
  batten_network_patch *patch;
  double *control; /* of all patches */
} shape;

/* (x, y) -> out; polynomial on the triangle that is asked for. */
typedef void shape_map(const double xy[2], double out[3]);

static inline void shape_free(shape *s) {
  free(s->points);
  free(s->triangles);
  free(s->patch);
  free(s->control);
}

/* The net of degree n whose surface is the map over the triangle: interpolation, by elimination with pivots. */
static inline void shape_net(unsigned n, shape_map *map, const double corner[3][2], double (*net)[3]) {
  size_t count = triangular_count(n);
  double *a = malloc(count * (count + 3) * sizeof *a);
  for (unsigned k = 0, i = 0; k <= n; k++)
    for (unsigned j = 0; j + k <= n; j++, i++) {
      double u = (double)j / n, v = (double)k / n, xy[2], *row = a + i * (count + 3);
      for (int d = 0; d < 2; d++)
        xy[d] = corner[0][d] + u * (corner[1][d] - corner[0][d]) + v * (corner[2][d] - corner[0][d]);
      triangular_basis(n, u, v, 0, row);
      map(xy, row + count);
    }
  for (size_t c = 0; c < count; c++) {
    size_t pivot = c;
    for (size_t r = c; r < count; r++)
      if (fabs(a[r * (count + 3) + c]) > fabs(a[pivot * (count + 3) + c])) pivot = r;
    for (size_t k = 0; k < count + 3; k++) {
      double swap = a[c * (count + 3) + k];
      a[c * (count + 3) + k] = a[pivot * (count + 3) + k];
      a[pivot * (count + 3) + k] = swap;
    }
    for (size_t r = 0; r < count; r++) {
      if (r == c) continue;
      double factor = a[r * (count + 3) + c] / a[c * (count + 3) + c];
      for (size_t k = c; k < count + 3; k++) a[r * (count + 3) + k] -= factor * a[c * (count + 3) + k];
    }
  }
  for (size_t c = 0; c < count; c++)
    for (int d = 0; d < 3; d++) net[c][d] = a[c * (count + 3) + count + (size_t)d] / a[c * (count + 3) + c];
  free(a);
}

static inline shape shape_room(size_t vertices, size_t faces, size_t patches) {
  shape s = {.vertices = vertices, .faces = faces, .patches = patches};
  s.points = malloc(vertices * 3 * sizeof *s.points);
  s.triangles = malloc(faces * 3 * sizeof *s.triangles);
  s.patch = malloc(patches * sizeof *s.patch);
  s.control = malloc(patches * 3 * TRIANGULAR_MAX * sizeof *s.control);
  for (size_t p = 0; p < patches; p++) s.patch[p].control_points = s.control + p * 3 * TRIANGULAR_MAX;
  return s;
}

/* Facet with one patch, or three that meet at `inner` of it (barycentric coordinates of its corners 1 and 2). */
static inline void shape_facet(shape *s, size_t face, size_t *patch, unsigned degree, shape_map *map,
                               const double corner[3][2], const double *inner) {
  for (unsigned part = inner ? 1 : 0; part <= (inner ? 3 : 0); part++, (*patch)++) {
    batten_network_patch *p = &s->patch[*patch];
    double at[3][2];
    memcpy(at, corner, sizeof at);
    if (inner) {
      memcpy(at[0], corner[part - 1], sizeof at[0]);
      memcpy(at[1], corner[part % 3], sizeof at[1]);
      for (int d = 0; d < 2; d++)
        at[2][d] = corner[0][d] + inner[0] * (corner[1][d] - corner[0][d]) + inner[1] * (corner[2][d] - corner[0][d]);
    }
    p->degree = degree;
    p->face = (uint32_t)face;
    p->part = part;
    shape_net(degree, map, (const double(*)[2])at, (double(*)[3])(s->control + *patch * 3 * TRIANGULAR_MAX));
  }
}

/* The map over cells x cells squares of [-1, 1]^2, two triangles each. Every split-th face (0: none) has three
 * patches, of one degree more. */
static inline shape shape_graph(unsigned cells, unsigned degree, unsigned split, shape_map *map) {
  size_t side = cells + 1, faces = 2 * (size_t)cells * cells, splits = split ? (faces + split - 1) / split : 0;
  shape s = shape_room(side * side, faces, faces + 2 * splits);
  size_t patch = 0;
  for (size_t i = 0; i < side * side; i++) {
    double xy[2] = {2.0 * (double)(i % side) / cells - 1, 2.0 * (double)(i / side) / cells - 1};
    map(xy, s.points + 3 * i);
  }
  for (size_t f = 0; f < faces; f++) {
    size_t cell = f / 2, at = cell / cells * side + cell % cells;
    size_t v[2][3] = {{at, at + 1, at + side + 1}, {at, at + side + 1, at + side}};
    double corner[3][2];
    const double inner[2] = {0.3, 0.37};
    for (int k = 0; k < 3; k++) {
      size_t i = v[f % 2][k];
      s.triangles[3 * f + (size_t)k] = (uint32_t)i;
      corner[k][0] = 2.0 * (double)(i % side) / cells - 1;
      corner[k][1] = 2.0 * (double)(i / side) / cells - 1;
    }
    bool splits_here = split && f % split == 0;
    shape_facet(&s, f, &patch, degree + splits_here, map, (const double(*)[2])corner, splits_here ? inner : NULL);
  }
  return s;
}

/* ---- a torus of bicubic B-splines: exactly C2, polynomial on each cell ------------------------------- */

static const double SHAPE_PI = 3.14159265358979323846;
enum { TORUS_LONG = 12, TORUS_SHORT = 8 };

/* Weights of the four control points of cubic B-splines in cell floor(x), taken from the left at whole x + 1. */
static inline int shape_spline(double x, double cell, double w[4]) {
  double t = x - cell, s = 1 - t;
  w[0] = s * s * s / 6;
  w[1] = (3 * t * t * t - 6 * t * t + 4) / 6;
  w[2] = (3 * s * s * s - 6 * s * s + 4) / 6;
  w[3] = t * t * t / 6;
  return (int)cell;
}

static double shape_cell[2]; /* the cell whose polynomial shape_torus_map gives */

static inline void shape_torus_map(const double xy[2], double out[3]) {
  double a[4], b[4];
  int i = shape_spline(xy[0], shape_cell[0], a), j = shape_spline(xy[1], shape_cell[1], b);
  out[0] = out[1] = out[2] = 0;
  for (int k = 0; k < 4; k++)
    for (int l = 0; l < 4; l++) {
      double p = 2 * SHAPE_PI * ((i + k) % TORUS_LONG) / TORUS_LONG,
             q = 2 * SHAPE_PI * ((j + l) % TORUS_SHORT) / TORUS_SHORT;
      double w = a[k] * b[l], r = 2 + 0.8 * cos(q) + 0.1 * sin(2 * p);
      out[0] += w * r * cos(p);
      out[1] += w * r * sin(p);
      out[2] += w * 0.8 * sin(q);
    }
}

/* Closed, genus 1, normals outward; degree 6. Every split-th face (0: none) has three patches. */
static inline shape shape_torus(unsigned split) {
  size_t faces = 2 * TORUS_LONG * TORUS_SHORT, splits = split ? (faces + split - 1) / split : 0, patch = 0;
  shape s = shape_room(TORUS_LONG * TORUS_SHORT, faces, faces + 2 * splits);
  for (size_t f = 0; f < faces; f++) {
    size_t i = f / 2 % TORUS_LONG, j = f / 2 / TORUS_LONG;
    static const int step[2][3][2] = {{{0, 0}, {1, 0}, {1, 1}}, {{0, 0}, {1, 1}, {0, 1}}};
    double corner[3][2];
    const double inner[2] = {0.3, 0.37};
    shape_cell[0] = (double)i;
    shape_cell[1] = (double)j;
    for (int k = 0; k < 3; k++) {
      size_t a = i + (size_t)step[f % 2][k][0], b = j + (size_t)step[f % 2][k][1];
      size_t vertex = b % TORUS_SHORT * TORUS_LONG + a % TORUS_LONG;
      corner[k][0] = (double)a;
      corner[k][1] = (double)b;
      s.triangles[3 * f + (size_t)k] = (uint32_t)vertex;
      shape_torus_map(corner[k], s.points + 3 * vertex);
    }
    shape_facet(&s, f, &patch, 6, shape_torus_map, (const double(*)[2])corner,
                split && f % split == 0 ? inner : NULL);
  }
  return s;
}

/* The mesh's own triangles as patches of degree 1: an octahedron with corners at distance 1. */
static inline shape shape_octahedron(void) {
  static const double points[6][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  static const uint32_t triangles[8][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                           {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  shape s = shape_room(6, 8, 8);
  memcpy(s.points, points, sizeof points);
  memcpy(s.triangles, triangles, sizeof triangles);
  for (size_t f = 0; f < 8; f++) {
    s.patch[f].degree = 1;
    s.patch[f].face = (uint32_t)f;
    s.patch[f].part = 0;
    for (size_t k = 0; k < 3; k++)
      memcpy(s.control + f * 3 * TRIANGULAR_MAX + 3 * k, points[triangles[f][k]], sizeof points[0]);
  }
  return s;
}

static inline batten_status shape_network(batten_context *ctx, const shape *s, batten_network **out) {
  return batten_network_create(ctx, s->vertices, s->points, s->faces, s->triangles, s->patches, s->patch, s->creases,
                               s->crease[0], out);
}

/* x -> factor R x + shift, R a fixed rotation, or the identity. */
static inline batten_network *network_of(batten_context *ctx, const shape *s) {
  batten_network *n = NULL;
  if (shape_network(ctx, s, &n) < 0) {
    printf("Bail out! %s\n", batten_error(ctx));
    exit(1);
  }
  return n;
}

/* The larger, and a NaN stays one. */
static inline double worse(double a, double b) { return isnan(a) || b <= a ? a : b; }

/* ---- maps ---- */

static inline void shape_cap(const double xy[2], double out[3]) {
  out[0] = xy[0];
  out[1] = xy[1];
  out[2] = -0.5 * (xy[0] * xy[0] + xy[1] * xy[1]);
}
static inline void shape_ridge(const double xy[2], double out[3]) {
  out[0] = xy[0];
  out[1] = xy[1];
  out[2] = -0.5 * xy[0] * xy[0];
}
static inline void shape_saddle(const double xy[2], double out[3]) {
  double x = xy[0], y = xy[1];
  out[0] = x;
  out[1] = y;
  out[2] = 0.3 * x * x * x - x * y + 0.5 * y * y;
}

static inline void shape_move(shape *s, bool turn, double factor, const double shift[3]) {
  static const double rotation[3][3] = {
      {2 / 3.0, -1 / 3.0, 2 / 3.0}, {2 / 3.0, 2 / 3.0, -1 / 3.0}, {-1 / 3.0, 2 / 3.0, 2 / 3.0}};
  for (size_t block = 0; block < 2; block++) {
    double *x = block ? s->control : s->points;
    size_t count = block ? s->patches * TRIANGULAR_MAX : s->vertices;
    for (size_t i = 0; i < count; i++, x += 3) {
      double y[3];
      for (int k = 0; k < 3; k++)
        y[k] = turn ? rotation[k][0] * x[0] + rotation[k][1] * x[1] + rotation[k][2] * x[2] : x[k];
      for (int k = 0; k < 3; k++) x[k] = factor * y[k] + shift[k];
    }
  }
}

#endif
