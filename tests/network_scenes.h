/* Triangle meshes for surfaces through meshes, with the curvature they should have where that is known: shared by
 * tests, benchmarks and examples. The same bits everywhere with the same mathematical library.
 *
 * Each function returns a mesh that scene_mesh_free frees, triangles counter-clockwise from outside (or above). */
#ifndef NETWORK_SCENES_H
#define NETWORK_SCENES_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "scenes.h"

typedef struct scene_mesh {
  size_t vertices, triangles, lines;
  double *points;          /* [vertices][3] */
  uint32_t *corners;       /* [triangles][3] */
  size_t *line_starts;     /* [lines + 1] into line_vertices; NULL without lines */
  uint32_t *line_vertices; /* closed lines give the first again at the end */
} scene_mesh;

static inline void scene_mesh_free(scene_mesh *m) {
  free(m->points);
  free(m->corners);
  free(m->line_starts);
  free(m->line_vertices);
  *m = (scene_mesh){0};
}

static inline void *scene_allocate(size_t bytes) {
  void *p = malloc(bytes ? bytes : 1);
  if (!p) abort(); /* scenes are small, and nothing can be tested without them */
  return p;
}

static inline scene_mesh scene_mesh_make(size_t vertices, size_t triangles) {
  scene_mesh m = {.vertices = vertices, .triangles = triangles};
  m.points = scene_allocate(3 * vertices * sizeof *m.points);
  m.corners = scene_allocate(3 * triangles * sizeof *m.corners);
  return m;
}

static inline scene_mesh scene_mesh_from(size_t vertices, const double *points, size_t triangles,
                                         const uint32_t *corners) {
  scene_mesh m = scene_mesh_make(vertices, triangles);
  memcpy(m.points, points, 3 * vertices * sizeof *points);
  memcpy(m.corners, corners, 3 * triangles * sizeof *corners);
  return m;
}

static inline void scene_point_set(double *p, double x, double y, double z) {
  p[0] = x;
  p[1] = y;
  p[2] = z;
}

static inline void scene_point_unit(double *p) {
  double r = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
  for (int k = 0; k < 3; k++) p[k] /= r;
}

static inline void scene_triangle_set(uint32_t *t, size_t a, size_t b, size_t c) {
  t[0] = (uint32_t)a;
  t[1] = (uint32_t)b;
  t[2] = (uint32_t)c;
}

/* (a x b) . c: positive when a b c turn counter-clockwise seen from outside around the origin. */
static inline double scene_turn(const double *a, const double *b, const double *c) {
  return (a[1] * b[2] - a[2] * b[1]) * c[0] + (a[2] * b[0] - a[0] * b[2]) * c[1] + (a[0] * b[1] - a[1] * b[0]) * c[2];
}

/* ---- on the unit sphere: K = 1 ---------------------------------------------------------------------- */

static inline scene_mesh scene_mesh_octahedron(void) {
  static const double points[18] = {1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1};
  static const uint32_t corners[24] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
  return scene_mesh_from(6, points, 8, corners);
}

/* The octahedron with its top vertex moved to unit(x, y, 1). The paper's figure 4 with (.5, .3); further on with
 * (1, .6) and (1.2, .72) the mesh gets ever harder. */
static inline scene_mesh scene_mesh_octahedron_shifted(double x, double y) {
  scene_mesh m = scene_mesh_octahedron();
  scene_point_set(m.points + 12, x, y, 1);
  scene_point_unit(m.points + 12);
  return m;
}

static inline scene_mesh scene_mesh_tetrahedron(void) {
  static const double points[12] = {1, 1, 1, 1, -1, -1, -1, 1, -1, -1, -1, 1};
  static const uint32_t corners[12] = {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2};
  scene_mesh m = scene_mesh_from(4, points, 4, corners);
  for (size_t v = 0; v < 4; v++) scene_point_unit(m.points + 3 * v);
  return m;
}

static inline scene_mesh scene_mesh_icosahedron(void) {
  static const double g = 1.6180339887498949;
  const double points[36] = {-1, g,  0,  1, g, 0,  -1, -g, 0,  1, -g, 0, 0,  -1, g,  0,  1, g,
                             0,  -1, -g, 0, 1, -g, g,  0,  -1, g, 0,  1, -g, 0,  -1, -g, 0, 1};
  static const uint32_t corners[60] = {0, 11, 5,  0, 5,  1, 0, 1, 7, 0, 7,  10, 0, 10, 11, 1, 5, 9, 5, 11,
                                       4, 11, 10, 2, 10, 7, 6, 7, 1, 8, 3,  9,  4, 3,  4,  2, 3, 2, 6, 3,
                                       6, 8,  3,  8, 9,  4, 9, 5, 2, 4, 11, 6,  2, 10, 8,  6, 7, 9, 8, 1};
  scene_mesh m = scene_mesh_from(12, points, 20, corners);
  for (size_t v = 0; v < 12; v++) scene_point_unit(m.points + 3 * v);
  return m;
}

/* Icosahedron with every edge in n parts, projected onto the sphere: 10 n^2 + 2 vertices, 20 n^2 triangles; 42, 162
 * and 642 vertices for n = 2, 4, 8. Vertices: the corners, then those inside edges, then those inside faces. */
static inline scene_mesh scene_mesh_icosphere(size_t n) {
  scene_mesh base = scene_mesh_icosahedron(), m = scene_mesh_make(10 * n * n + 2, 20 * n * n);
  uint32_t number[12][12]; /* of the edge from the smaller corner to the larger one */
  size_t made = 12, t = 0;
  memcpy(m.points, base.points, 36 * sizeof *m.points);
  for (uint32_t a = 0; a < 12; a++)
    for (uint32_t b = 0; b < 12; b++) number[a][b] = UINT32_MAX;
  for (size_t h = 0; h < 60; h++) {
    uint32_t a = base.corners[h], b = base.corners[h % 3 == 2 ? h - 2 : h + 1];
    if (a > b) continue; /* each edge has one half-edge that goes up */
    number[a][b] = (uint32_t)made;
    for (size_t i = 1; i < n; i++, made++)
      for (size_t k = 0; k < 3; k++)
        m.points[3 * made + k] = ((double)(n - i) * base.points[3 * a + k] + (double)i * base.points[3 * b + k]);
  }
  uint32_t *row = scene_allocate(2 * (n + 1) * sizeof *row), *below = row + n + 1;
  for (size_t f = 0; f < 20; f++) {
    const uint32_t *c = base.corners + 3 * f;
    for (size_t k = 0; k <= n; k++) { /* row k: from edge (0, 2) to edge (1, 2), n - k segments */
      uint32_t *swap = row;
      row = below;
      below = swap;
      for (size_t j = 0; j + k <= n; j++) {
        size_t w[3] = {n - j - k, j, k};
        size_t zeros = (size_t)!w[0] + (size_t)!w[1] + (size_t)!w[2], v;
        if (zeros == 2) {
          v = c[w[0] ? 0 : w[1] ? 1 : 2];
        } else if (zeros == 1) {
          size_t p = w[0] == 0 ? 1 : 0, q = w[2] == 0 ? 1 : 2;
          v = c[p] < c[q] ? number[c[p]][c[q]] + w[q] - 1 : number[c[q]][c[p]] + w[p] - 1;
        } else {
          v = made++;
          for (size_t x = 0; x < 3; x++) {
            m.points[3 * v + x] = 0;
            for (size_t y = 0; y < 3; y++) m.points[3 * v + x] += (double)w[y] * base.points[3 * c[y] + x];
          }
        }
        row[j] = (uint32_t)v;
      }
      for (size_t j = 0; k > 0 && j + k <= n; j++) {
        scene_triangle_set(m.corners + 3 * t++, below[j], below[j + 1], row[j]);
        if (j + k < n) scene_triangle_set(m.corners + 3 * t++, below[j + 1], row[j + 1], row[j]);
      }
    }
  }
  free(row < below ? row : below);
  for (size_t v = 12; v < m.vertices; v++) scene_point_unit(m.points + 3 * v);
  scene_mesh_free(&base);
  return m;
}

/* Vertices moved by up to `shift` in each coordinate, then back onto the sphere. */
static inline void scene_mesh_shift(scene_mesh *m, double shift, uint64_t seed) {
  for (size_t i = 0; i < 3 * m->vertices; i++) m->points[i] += shift * (2 * scene_uniform(&seed) - 1);
  for (size_t v = 0; v < m->vertices; v++) scene_point_unit(m->points + 3 * v);
}

static inline void scene_mesh_scale(scene_mesh *m, double x, double y, double z) {
  for (size_t v = 0; v < m->vertices; v++) {
    m->points[3 * v] *= x;
    m->points[3 * v + 1] *= y;
    m->points[3 * v + 2] *= z;
  }
}

static inline scene_mesh scene_mesh_sphere_irregular(void) {
  scene_mesh m = scene_mesh_icosphere(2);
  scene_mesh_shift(&m, 0.18, 1);
  return m;
}

/* Every radius off by up to 5 %. */
static inline scene_mesh scene_mesh_sphere_noisy(void) {
  scene_mesh m = scene_mesh_icosphere(2);
  uint64_t seed = 5;
  for (size_t v = 0; v < m.vertices; v++) {
    double r = 1 + 0.05 * (2 * scene_uniform(&seed) - 1);
    for (size_t k = 0; k < 3; k++) m.points[3 * v + k] *= r;
  }
  return m;
}

/* ---- other closed surfaces ------------------------------------------------------------------------ */

/* K of the ellipsoid of these half axes at a point on it. */
static inline double scene_ellipsoid_gauss(const double axes[3], const double *p) {
  double s = 0, product = 1;
  for (int k = 0; k < 3; k++) {
    s += p[k] * p[k] / (axes[k] * axes[k] * axes[k] * axes[k]);
    product *= axes[k];
  }
  return 1 / (product * product * s * s);
}

/* Half axes 1, .75, .55: K from .54 to 5.88. */
static const double scene_ellipsoid_axes[3] = {1, 0.75, 0.55};
static inline scene_mesh scene_mesh_ellipsoid_irregular(void) {
  scene_mesh m = scene_mesh_sphere_irregular();
  scene_mesh_scale(&m, scene_ellipsoid_axes[0], scene_ellipsoid_axes[1], scene_ellipsoid_axes[2]);
  return m;
}

/* Half axes 2, .7, .7: K from .25 to 16.7, on 42 vertices. */
static const double scene_ellipsoid_long_axes[3] = {2, 0.7, 0.7};
static inline scene_mesh scene_mesh_ellipsoid_long(void) {
  scene_mesh m = scene_mesh_icosphere(2);
  scene_mesh_scale(&m, 2, 0.7, 0.7);
  return m;
}

/* A star-shaped body: distance from the origin in direction u (unit). K from -3.60 to 4.75. */
static inline double scene_blob_radius(const double *u) {
  return 1 + 0.18 * sin(3 * u[0] + 1) * cos(2.5 * u[1]) + 0.12 * sin(4 * u[2]);
}
/* Vertices of the icosphere of frequency n, shifted before the radius is given to them. */
static inline scene_mesh scene_mesh_blob(size_t n, double shift) {
  scene_mesh m = scene_mesh_icosphere(n);
  scene_mesh_shift(&m, shift, 3);
  for (size_t v = 0; v < m.vertices; v++) {
    double r = scene_blob_radius(m.points + 3 * v);
    for (size_t k = 0; k < 3; k++) m.points[3 * v + k] *= r;
  }
  return m;
}
static inline scene_mesh scene_mesh_blob_162(void) { return scene_mesh_blob(4, 0.09); }
static inline scene_mesh scene_mesh_blob_642(void) { return scene_mesh_blob(8, 0.045); }

/* K of the blob in direction u (unit): F(p) = |p| - radius(p / |p|) vanishes on it, K = g' adj(H) g / |g|^4 with the
 * gradient and Hessian of F by differences (about seven digits). */
static inline double scene_blob_field(const double *p) {
  double u[3] = {p[0], p[1], p[2]}, r = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
  scene_point_unit(u);
  return r - scene_blob_radius(u);
}
static inline double scene_blob_gauss(const double *u) {
  const double h = 1e-4;
  double r = scene_blob_radius(u), p[3] = {r * u[0], r * u[1], r * u[2]}, f = scene_blob_field(p), g[3], d[3][3];
  for (int i = 0; i < 3; i++)
    for (int j = i; j < 3; j++) {
      double v[4];
      for (int s = 0; s < 4; s++) {
        double q[3] = {p[0], p[1], p[2]};
        q[i] += s & 1 ? h : -h;
        if (j != i) q[j] += s & 2 ? h : -h;
        v[s] = scene_blob_field(q);
      }
      if (i == j) g[i] = (v[1] - v[0]) / (2 * h);
      d[i][j] = d[j][i] = i == j ? (v[1] - 2 * f + v[0]) / (h * h) : (v[3] - v[2] - v[1] + v[0]) / (4 * h * h);
    }
  double sum = 0, square = g[0] * g[0] + g[1] * g[1] + g[2] * g[2];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, e = (j + 2) % 3;
      sum += g[i] * g[j] * (d[a][c] * d[b][e] - d[a][e] * d[b][c]);
    }
  return sum / (square * square);
}

/* Torus about z of radii 2 and .8: n rings (an even number) of m vertices, every other one turned by half a step, so
 * that the triangles are isosceles: K from -1.042 to .446. */
#define SCENE_TORUS_MAJOR 2.0
#define SCENE_TORUS_MINOR 0.8
static inline scene_mesh scene_mesh_torus(size_t n, size_t m) {
  scene_mesh out = scene_mesh_make(n * m, 2 * n * m);
  uint32_t *t = out.corners;
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < m; j++) {
      double a = 2 * SCENE_PI * (double)i / (double)n, b = 2 * SCENE_PI * ((double)j + (i % 2 ? 0.5 : 0)) / (double)m;
      double r = SCENE_TORUS_MAJOR + SCENE_TORUS_MINOR * cos(b);
      scene_point_set(out.points + 3 * (i * m + j), r * cos(a), r * sin(a), SCENE_TORUS_MINOR * sin(b));
      size_t near = i * m + j, far = (i + 1) % n * m + j;
      size_t near_next = i * m + (j + 1) % m, far_next = (i + 1) % n * m + (j + 1) % m;
      scene_triangle_set(t, near, far, i % 2 ? far_next : near_next);
      scene_triangle_set(t + 3, i % 2 ? near : far, far_next, near_next);
      t += 6;
    }
  return out;
}
static inline scene_mesh scene_mesh_torus_10_6(void) { return scene_mesh_torus(10, 6); }
/* K at a point near it. */
static inline double scene_torus_gauss(const double *p) {
  double out = sqrt(p[0] * p[0] + p[1] * p[1]) - SCENE_TORUS_MAJOR, c = out / sqrt(out * out + p[2] * p[2]);
  return c / (SCENE_TORUS_MINOR * (SCENE_TORUS_MAJOR + SCENE_TORUS_MINOR * c));
}

/* The boundary of a body of unit cells, each square in two triangles: cells [nx][ny][nz] non-zero inside. No two
 * cells may touch in an edge or corner alone. smooth: passes of moving every vertex half-way to its neighbours' mean.
 */
static inline scene_mesh scene_mesh_cells(size_t nx, size_t ny, size_t nz, const unsigned char *cells,
                                          unsigned smooth) {
  size_t size[3] = {nx, ny, nz}, stride[3] = {ny * nz, nz, 1}, grid = (nx + 1) * (ny + 1) * (nz + 1);
  size_t step[3] = {(ny + 1) * (nz + 1), nz + 1, 1};
  uint32_t *number = scene_allocate(grid * sizeof *number);
  memset(number, 0xff, grid * sizeof *number);
  scene_mesh m = scene_mesh_make(grid, 12 * nx * ny * nz);
  m.vertices = m.triangles = 0;
  for (size_t cell = 0; cell < nx * ny * nz; cell++) {
    if (!cells[cell]) continue;
    size_t at[3] = {cell / stride[0], cell / stride[1] % ny, cell % nz};
    for (int axis = 0; axis < 3; axis++)
      for (int side = 0; side < 2; side++) {
        bool last = side ? at[axis] + 1 == size[axis] : at[axis] == 0;
        if (!last && cells[side ? cell + stride[axis] : cell - stride[axis]]) continue;
        int u = (axis + (side ? 1 : 2)) % 3, v = (axis + (side ? 2 : 1)) % 3;
        uint32_t c[4];
        for (int k = 0; k < 4; k++) {
          size_t place[3] = {at[0], at[1], at[2]};
          place[axis] += (size_t)side;
          if (k == 1 || k == 2) place[u]++;
          if (k >= 2) place[v]++;
          size_t id = place[0] * step[0] + place[1] * step[1] + place[2];
          if (number[id] == UINT32_MAX) {
            number[id] = (uint32_t)m.vertices;
            scene_point_set(m.points + 3 * m.vertices++, (double)place[0], (double)place[1], (double)place[2]);
          }
          c[k] = number[id];
        }
        scene_triangle_set(m.corners + 3 * m.triangles++, c[0], c[1], c[2]);
        scene_triangle_set(m.corners + 3 * m.triangles++, c[0], c[2], c[3]);
      }
  }
  double *mean = scene_allocate(4 * m.vertices * sizeof *mean);
  for (; smooth > 0; smooth--) {
    memset(mean, 0, 4 * m.vertices * sizeof *mean);
    for (size_t h = 0; h < 3 * m.triangles; h++) {
      uint32_t a = m.corners[h], b = m.corners[h % 3 == 2 ? h - 2 : h + 1];
      for (size_t k = 0; k < 3; k++) mean[4 * a + k] += m.points[3 * b + k];
      mean[4 * a + 3] += 1;
    }
    for (size_t v = 0; v < m.vertices; v++)
      for (size_t k = 0; k < 3; k++)
        m.points[3 * v + k] = 0.5 * (m.points[3 * v + k] + mean[4 * v + k] / mean[4 * v + 3]);
  }
  free(mean);
  free(number);
  return m;
}

/* A bar 7 : 3 : 1 with three square holes, of cells of half that thickness, smoothed: genus 3. */
static inline scene_mesh scene_mesh_genus3(void) {
  unsigned char cells[14 * 6 * 2];
  for (size_t i = 0; i < 14; i++)
    for (size_t j = 0; j < 6; j++)
      for (size_t k = 0; k < 2; k++) cells[(6 * i + j) * 2 + k] = !(i / 2 % 2 == 1 && j / 2 == 1);
  return scene_mesh_cells(14, 6, 2, cells, 3);
}

/* The cube [-1, 1]^3 with 3 x 3 vertices a side, diagonals through the middles of the sides: sharp, and treated as if
 * it were smooth. 26 vertices, 48 triangles. */
static inline scene_mesh scene_mesh_cube_26(void) {
  const unsigned char cells[8] = {1, 1, 1, 1, 1, 1, 1, 1};
  scene_mesh m = scene_mesh_cells(2, 2, 2, cells, 0);
  for (size_t i = 0; i < 3 * m.vertices; i++) m.points[i] -= 1;
  for (uint32_t *t = m.corners; t < m.corners + 3 * m.triangles; t += 6) {
    uint32_t c[4] = {t[0], t[1], t[2], t[5]}; /* a square */
    size_t middle = 0;
    for (size_t k = 0; k < 4; k++) {
      const double *p = m.points + 3 * c[k];
      if (fabs(p[0]) + fabs(p[1]) + fabs(p[2]) == 1) middle = k;
    }
    for (size_t k = 0; k < 2; k++)
      scene_triangle_set(t + 3 * k, c[middle], c[(middle + 1 + k) % 4], c[(middle + 2 + k) % 4]);
  }
  return m;
}

/* ---- open surfaces ---------------------------------------------------------------------------------- */

/* A grid of nx x ny places, squares halved along one diagonal; the points are still to be set. The corners (0, 0) and
 * (nx - 1, ny - 1) get two triangles, the other two are ears: vertices of valence 2. */
static inline scene_mesh scene_mesh_grid(size_t nx, size_t ny) {
  scene_mesh m = scene_mesh_make(nx * ny, 2 * (nx - 1) * (ny - 1));
  uint32_t *t = m.corners;
  for (size_t j = 0; j + 1 < ny; j++)
    for (size_t i = 0; i + 1 < nx; i++, t += 6) {
      size_t a = j * nx + i;
      scene_triangle_set(t, a, a + 1, a + nx + 1);
      scene_triangle_set(t + 3, a, a + nx + 1, a + nx);
    }
  return m;
}

/* A saddle over [-1, 1]^2, nowhere symmetric: K from -.631 to -.050. */
static inline double scene_graph_height(double x, double y) {
  return 0.4 * x * x - 0.351 * y * y + 0.16 * x * y + 0.098 * x * x * x;
}
static inline double scene_graph_gauss(double x, double y) {
  double fx = 0.8 * x + 0.16 * y + 0.294 * x * x, fy = 0.16 * x - 0.702 * y, s = 1 + fx * fx + fy * fy;
  return ((0.8 + 0.588 * x) * -0.702 - 0.16 * 0.16) / (s * s);
}
static inline scene_mesh scene_mesh_graph(size_t n) {
  scene_mesh m = scene_mesh_grid(n, n);
  for (size_t v = 0; v < m.vertices; v++) {
    double x = 2 * (double)(v % n) / (double)(n - 1) - 1, y = 2 * (double)(v / n) / (double)(n - 1) - 1;
    scene_point_set(m.points + 3 * v, x, y, scene_graph_height(x, y));
  }
  return m;
}
static inline scene_mesh scene_mesh_graph_7(void) { return scene_mesh_graph(7); }

/* A plane grid, tilted. */
static inline scene_mesh scene_mesh_plane(size_t n) {
  scene_mesh m = scene_mesh_graph(n);
  for (size_t v = 0; v < m.vertices; v++) {
    double *p = m.points + 3 * v;
    p[2] = 0.5 * p[0] - 0.25 * p[1] + 0.125;
  }
  return m;
}

/* A disk with an ear, a vertex of valence 2, at every boundary edge: n triangles around the middle, n ears; on the
 * saddle. n = 3 .. */
static inline scene_mesh scene_mesh_ears(size_t n) {
  scene_mesh m = scene_mesh_make(2 * n + 1, 2 * n);
  for (size_t i = 0; i <= 2 * n; i++) {
    double a = 2 * SCENE_PI * (i <= n ? (double)i : (double)i + 0.5) / (double)n, r = i == 0 ? 0 : i <= n ? 0.5 : 0.9;
    double x = r * cos(a), y = r * sin(a);
    scene_point_set(m.points + 3 * i, x, y, scene_graph_height(x, y));
  }
  for (size_t i = 0; i < n; i++) {
    size_t a = 1 + i, b = 1 + (i + 1) % n;
    scene_triangle_set(m.corners + 3 * i, 0, a, b);
    scene_triangle_set(m.corners + 3 * (n + i), a, n + a, b);
  }
  return m;
}

/* One triangle, and two at an edge: nothing but ears. */
static inline scene_mesh scene_mesh_triangle(void) {
  static const double points[9] = {0, 0, 0, 1, 0, 0, 0.3, 0.9, 0.2};
  static const uint32_t corners[3] = {0, 1, 2};
  return scene_mesh_from(3, points, 1, corners);
}
static inline scene_mesh scene_mesh_hinge(void) {
  static const double points[12] = {0, 0, 0, 1, 0, 0.1, 0.3, 0.9, 0.2, 1.2, 1.1, -0.1};
  static const uint32_t corners[6] = {0, 1, 2, 2, 1, 3};
  return scene_mesh_from(4, points, 2, corners);
}

/* A strip of n squares, closed after half a turn: no orientation fits. */
static inline scene_mesh scene_mesh_moebius(size_t n) {
  scene_mesh m = scene_mesh_make(2 * n, 2 * n);
  for (size_t i = 0; i < n; i++) {
    double a = 2 * SCENE_PI * (double)i / (double)n;
    bool last = i + 1 == n;
    size_t low = 2 * i, high = 2 * i + 1, next_low = last ? 1 : 2 * i + 2, next_high = last ? 0 : 2 * i + 3;
    for (int side = 0; side < 2; side++) {
      double r = 1 + (side ? 0.35 : -0.35) * cos(a / 2);
      scene_point_set(m.points + 3 * (2 * i + (size_t)side), r * cos(a), r * sin(a),
                      (side ? 0.35 : -0.35) * sin(a / 2));
    }
    scene_triangle_set(m.corners + 6 * i, low, next_low, next_high);
    scene_triangle_set(m.corners + 6 * i + 3, low, next_high, high);
  }
  return m;
}

/* Like an outer panel of a car: a gently curved sheet 3 x 1.5, a regular grid of 37 x 21, with a feature line and a
 * dent for a handle. Where neither is near, cells of 2 x 2 squares lose the middles of the sides that they share with
 * others of their kind, and become fans about their middle. */
static inline double scene_panel_height(double x, double y) {
  double dent = exp(-18 * ((x - 0.4) * (x - 0.4) + 2.2 * (y - 0.2) * (y - 0.2)));
  double line = y + 0.25 + 0.04 * x;
  return -0.09 * x * x - 0.16 * y * y - 0.11 * dent + 0.035 * tanh(9 * line);
}
static inline scene_mesh scene_mesh_panel(void) {
  enum { NX = 37, NY = 21, CX = (NX - 1) / 2, CY = (NY - 1) / 2 };
  scene_mesh m = scene_mesh_make(NX * NY, 8 * CX * CY);
  bool coarse[CX][CY];
  uint32_t number[NX * NY];
  for (size_t i = 0; i < CX; i++)
    for (size_t j = 0; j < CY; j++) {
      double x = ((double)(2 * i + 1) / (NX - 1) - 0.5) * 3, y = ((double)(2 * j + 1) / (NY - 1) - 0.5) * 1.5;
      coarse[i][j] = fabs(y + 0.25 + 0.04 * x) > 0.24 && hypot(x - 0.4, 1.5 * (y - 0.2)) > 0.5;
    }
  m.vertices = m.triangles = 0;
  for (size_t j = 0; j < NY; j++)
    for (size_t i = 0; i < NX; i++) {
      /* gone when every cell that has it in the middle of a side is coarse; at the rim there is one such cell */
      bool gone = (i + j) % 2 == 1;
      if (gone && i % 2 == 1)
        gone = (j == 0 || coarse[i / 2][j / 2 - 1]) && (j == NY - 1 || coarse[i / 2][j / 2]);
      else if (gone)
        gone = (i == 0 || coarse[i / 2 - 1][j / 2]) && (i == NX - 1 || coarse[i / 2][j / 2]);
      number[j * NX + i] = gone ? UINT32_MAX : (uint32_t)m.vertices;
      if (gone) continue;
      double x = ((double)i / (NX - 1) - 0.5) * 3, y = ((double)j / (NY - 1) - 0.5) * 1.5;
      scene_point_set(m.points + 3 * m.vertices++, x, y, scene_panel_height(x, y));
    }
  for (size_t i = 0; i < CX; i++)
    for (size_t j = 0; j < CY; j++) {
      static const size_t ring[9][2] = {{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}, {0, 0}};
      uint32_t middle = number[(2 * j + 1) * NX + 2 * i + 1], before = number[2 * j * NX + 2 * i];
      for (size_t k = 1; k < 9; k++) {
        uint32_t v = number[(2 * j + ring[k][1]) * NX + 2 * i + ring[k][0]];
        if (v == UINT32_MAX) continue;
        scene_triangle_set(m.corners + 3 * m.triangles++, middle, before, v);
        before = v;
      }
    }
  return m;
}

/* Like a valve's body: a bent tube with a bulge, given by curves: 13 closed sections of 12 points and the 12 curves
 * along it, each polygon a line; the diagonals of the squares are not. Open at both ends. */
static inline scene_mesh scene_mesh_valve(void) {
  enum { ROWS = 13, ROUND = 12 };
  scene_mesh m = scene_mesh_make(ROWS * ROUND, 2 * (ROWS - 1) * ROUND);
  uint32_t *t = m.corners;
  for (size_t i = 0; i < ROWS; i++) {
    double s = (double)i / (ROWS - 1), bend = 0.5 * SCENE_PI * s, bulge = exp(-30 * (s - 0.45) * (s - 0.45));
    for (size_t j = 0; j < ROUND; j++) {
      double a = 2 * SCENE_PI * (double)j / ROUND;
      double across = (0.5 + 0.3 * bulge) * cos(a), up = (0.5 + 0.12 * bulge) * sin(a), r = 1.6 + across;
      scene_point_set(m.points + 3 * (i * ROUND + j), r * cos(bend), r * sin(bend), up);
      if (i + 1 == ROWS) continue;
      size_t v = i * ROUND + j, w = i * ROUND + (j + 1) % ROUND;
      scene_triangle_set(t, v, v + ROUND, w + ROUND);
      scene_triangle_set(t + 3, v, w + ROUND, w);
      t += 6;
    }
  }
  m.lines = ROWS + ROUND;
  m.line_starts = scene_allocate((m.lines + 1) * sizeof *m.line_starts);
  m.line_vertices = scene_allocate((ROWS * (ROUND + 1) + ROUND * ROWS) * sizeof *m.line_vertices);
  size_t at = 0, line = 0;
  for (size_t i = 0; i < ROWS; i++) {
    m.line_starts[line++] = at;
    for (size_t j = 0; j <= ROUND; j++) m.line_vertices[at++] = (uint32_t)(i * ROUND + j % ROUND);
  }
  for (size_t j = 0; j < ROUND; j++) {
    m.line_starts[line++] = at;
    for (size_t i = 0; i < ROWS; i++) m.line_vertices[at++] = (uint32_t)(i * ROUND + j);
  }
  m.line_starts[line] = at;
  return m;
}

/* ---- random ------------------------------------------------------------------------------------------ */

/* Half-edge of triangle corners that runs from a to b; the mesh is small. SIZE_MAX when there is none. */
static inline size_t scene_half_edge(const scene_mesh *m, uint32_t a, uint32_t b) {
  for (size_t h = 0; h < 3 * m->triangles; h++)
    if (m->corners[h] == a && m->corners[h % 3 == 2 ? h - 2 : h + 1] == b) return h;
  return SIZE_MAX;
}

/* A triangle on the unit sphere that is not too large (its plane passes the origin at .85 or more) and has no angle
 * below 9 degrees. */
static inline bool scene_triangle_good(const double *a, const double *b, const double *c) {
  double u[3], v[3], uu = 0, vv = 0, uv = 0;
  for (int k = 0; k < 3; k++) {
    u[k] = b[k] - a[k];
    v[k] = c[k] - a[k];
    uu += u[k] * u[k];
    vv += v[k] * v[k];
    uv += u[k] * v[k];
  }
  double twice = sqrt(fmax(uu * vv - uv * uv, 0)), least = fmin(uu, fmin(vv, uu + vv - 2 * uv));
  /* The shortest side is opposite to the least angle: its tangent is twice the area over the others' product. */
  double across = least == uu ? vv - uv : least == vv ? uu - uv : uv;
  return scene_turn(a, b, c) > 0.85 * twice && twice > 0.1584 * across;
}

/* Turns the edge of half-edge h, p -> q between r and s, into r - s, when no triangle gets too large or
 * flat by that, no edge doubles and all valences stay in 3 .. 20. */
static inline bool scene_flip(scene_mesh *m, unsigned *valence, size_t h) {
  uint32_t *c = m->corners, p = c[h], q = c[h % 3 == 2 ? h - 2 : h + 1], r = c[h % 3 == 0 ? h + 2 : h - 1];
  size_t g = scene_half_edge(m, q, p);
  uint32_t s = c[g % 3 == 0 ? g + 2 : g - 1];
  const double *x = m->points;
  if (valence[p] == 3 || valence[q] == 3 || valence[r] == 20 || valence[s] == 20) return false;
  if (scene_half_edge(m, r, s) != SIZE_MAX) return false;
  if (!scene_triangle_good(x + 3 * r, x + 3 * s, x + 3 * q)) return false;
  if (!scene_triangle_good(x + 3 * s, x + 3 * r, x + 3 * p)) return false;
  scene_triangle_set(c + h / 3 * 3, r, s, q);
  scene_triangle_set(c + g / 3 * 3, s, r, p);
  valence[p]--;
  valence[q]--;
  valence[r]++;
  valence[s]++;
  return true;
}

/* Halves the edge of half-edge h, when the four triangles are good; the mesh has room. */
static inline bool scene_edge_split(scene_mesh *m, unsigned *valence, size_t h) {
  uint32_t *c = m->corners, p = c[h], q = c[h % 3 == 2 ? h - 2 : h + 1], r = c[h % 3 == 0 ? h + 2 : h - 1];
  size_t g = scene_half_edge(m, q, p), v = m->vertices;
  uint32_t s = c[g % 3 == 0 ? g + 2 : g - 1];
  for (size_t k = 0; k < 3; k++) m->points[3 * v + k] = m->points[3 * p + k] + m->points[3 * q + k];
  const double *x = m->points;
  scene_point_unit(m->points + 3 * v);
  if (!scene_triangle_good(x + 3 * p, x + 3 * v, x + 3 * r) ||
      !scene_triangle_good(x + 3 * v, x + 3 * q, x + 3 * r) ||
      !scene_triangle_good(x + 3 * v, x + 3 * p, x + 3 * s) || !scene_triangle_good(x + 3 * q, x + 3 * v, x + 3 * s))
    return false;
  m->vertices++;
  scene_triangle_set(c + h / 3 * 3, p, v, r);
  scene_triangle_set(c + g / 3 * 3, v, p, s);
  scene_triangle_set(c + 3 * m->triangles++, v, q, r);
  scene_triangle_set(c + 3 * m->triangles++, q, v, s);
  valence[v] = 4;
  valence[r]++;
  valence[s]++;
  return true;
}

/* Closed meshes around the origin with valences from 3 to 20: an icosphere of frequency 2 or 3, some triangles
 * split, edges flipped at random, one or two vertices fed with the edges opposite to them, which are flipped or else
 * halved, until they have up to 20, all radii off by up to 2 %. Any seed. */
static inline scene_mesh scene_mesh_random(uint64_t seed) {
  uint64_t state = seed * 0x9e3779b97f4a7c15u + 12345;
  scene_mesh base = scene_mesh_icosphere(2 + (size_t)(2 * scene_uniform(&state)));
  size_t splits = (size_t)(scene_uniform(&state) * 0.2 * (double)base.triangles);
  enum { HUBS = 2, ROOM = HUBS * 20 };
  scene_mesh m = scene_mesh_make(base.vertices + splits + ROOM, base.triangles + 2 * (splits + ROOM));
  memcpy(m.points, base.points, 3 * base.vertices * sizeof *m.points);
  memcpy(m.corners, base.corners, 3 * base.triangles * sizeof *m.corners);
  m.vertices = base.vertices;
  m.triangles = base.triangles;
  scene_mesh_free(&base);
  scene_mesh_shift(&m, 0.1, state);
  for (size_t i = 0; i < splits; i++) {
    uint32_t *t = m.corners + 3 * (size_t)(scene_uniform(&state) * (double)m.triangles), c[3] = {t[0], t[1], t[2]};
    size_t v = m.vertices;
    const double *x = m.points;
    for (size_t k = 0; k < 3; k++)
      m.points[3 * v + k] = m.points[3 * c[0] + k] + m.points[3 * c[1] + k] + m.points[3 * c[2] + k];
    scene_point_unit(m.points + 3 * v);
    if (!scene_triangle_good(x + 3 * c[0], x + 3 * c[1], x + 3 * v) ||
        !scene_triangle_good(x + 3 * c[1], x + 3 * c[2], x + 3 * v) ||
        !scene_triangle_good(x + 3 * c[2], x + 3 * c[0], x + 3 * v))
      continue;
    m.vertices++;
    scene_triangle_set(t, c[0], c[1], v);
    scene_triangle_set(m.corners + 3 * m.triangles++, c[1], c[2], v);
    scene_triangle_set(m.corners + 3 * m.triangles++, c[2], c[0], v);
  }
  unsigned *valence = scene_allocate((m.vertices + ROOM) * sizeof *valence);
  memset(valence, 0, (m.vertices + ROOM) * sizeof *valence);
  for (size_t h = 0; h < 3 * m.triangles; h++) valence[m.corners[h]]++;
  for (size_t i = 0; i < m.triangles / 2; i++)
    scene_flip(&m, valence, (size_t)(scene_uniform(&state) * (double)(3 * m.triangles)));
  for (size_t hubs = 1 + (size_t)(HUBS * scene_uniform(&state)); hubs > 0; hubs--) {
    size_t hub = (size_t)(scene_uniform(&state) * (double)m.vertices);
    unsigned aim = 8 + (unsigned)(13 * scene_uniform(&state));
    for (size_t h = 0, last = SIZE_MAX, turns = 0; valence[hub] < aim && turns < 3; h++) {
      if (h == 3 * m.triangles) {
        h = 0;
        turns++;
      }
      if (m.corners[h % 3 == 0 ? h + 2 : h - 1] != hub || scene_flip(&m, valence, h)) continue;
      size_t g = scene_half_edge(&m, m.corners[h % 3 == 2 ? h - 2 : h + 1], m.corners[h]);
      if (turns > 0 && h != last && valence[m.corners[g % 3 == 0 ? g + 2 : g - 1]] < 20)
        if (scene_edge_split(&m, valence, h)) last = h; /* half of it: some other edge next */
    }
  }
  free(valence);
  for (size_t v = 0; v < m.vertices; v++) {
    double r = 1 + 0.02 * (2 * scene_uniform(&state) - 1);
    for (size_t k = 0; k < 3; k++) m.points[3 * v + k] *= r;
  }
  return m;
}

#endif
