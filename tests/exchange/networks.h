/* Networks whose surface is known exactly: polyhedra, pieces of z = quadratic, both in any degree, whole or in parts.
 */
#ifndef TEST_NETWORKS_H
#define TEST_NETWORKS_H

#include <batten/network.h>

#include "tap.h"

enum { NETWORK_POINTS_MAX = 13 * 14 / 2 };

/* Where to in space the plane of the net goes: a function of total degree <= 2. */
typedef void network_map(const double at[3], double out[3]);

static inline void map_flat(const double at[3], double out[3]) { memcpy(out, at, 3 * sizeof *out); }
static inline void map_paraboloid(const double at[3], double out[3]) {
  out[0] = at[0];
  out[1] = at[1];
  out[2] = at[0] * at[0] + 0.5 * at[1] * at[1] - 0.75 * at[0] * at[1] + at[2];
}

/* Quadratic net of map over the triangle a b c: corners, and middles by their interpolation; raised to the degree. */
static inline void network_net(network_map *map, const double *const corners[3], unsigned degree, double *out) {
  double net[NETWORK_POINTS_MAX][3], raised[NETWORK_POINTS_MAX][3], middle[3], x[3][3];
  static const int at[3] = {0, 2, 5}, between[3] = {1, 4, 3}; /* b_200 b_020 b_002; b_110 b_011 b_101 */
  for (int k = 0; k < 3; k++) {
    map(corners[k], x[k]);
    memcpy(net[at[k]], x[k], sizeof net[0]);
  }
  for (int k = 0; k < 3; k++) {
    const double *p = corners[k], *q = corners[(k + 1) % 3];
    double m[3] = {0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1]), 0.5 * (p[2] + q[2])};
    map(m, middle);
    for (int c = 0; c < 3; c++) net[between[k]][c] = 2 * middle[c] - 0.5 * (x[k][c] + x[(k + 1) % 3][c]);
  }
  if (degree == 1)
    for (int k = 0; k < 3; k++) memcpy(out + 3 * k, x[k], sizeof x[k]);
  for (unsigned n = 2; n < degree; n++) {
    for (unsigned k = 0; k <= n + 1; k++)
      for (unsigned j = 0; j + k <= n + 1; j++) {
        unsigned a = n + 1 - j - k;
        double *to = raised[k * (2 * n + 5 - k) / 2 + j];
        for (int c = 0; c < 3; c++) {
          to[c] = a ? a * net[k * (2 * n + 3 - k) / 2 + j][c] : 0;
          if (j) to[c] += j * net[k * (2 * n + 3 - k) / 2 + j - 1][c];
          if (k) to[c] += k * net[(k - 1) * (2 * n + 4 - k) / 2 + j][c];
          to[c] /= n + 1;
        }
      }
    memcpy(net, raised, sizeof net);
  }
  if (degree > 1) memcpy(out, net, (size_t)(degree + 1) * (degree + 2) / 2 * sizeof net[0]);
}

/* split: three parts for facet 0, 2, 4, ... */
static inline batten_status network_of(batten_context *ctx, network_map *map, size_t vertex_count,
                                       const double *vertices, size_t faces, const uint32_t *triangles,
                                       unsigned degree, bool split, batten_network **out) {
  batten_network_patch *patches = malloc(3 * faces * sizeof *patches);
  double *points = malloc(3 * faces * NETWORK_POINTS_MAX * 3 * sizeof *points);
  double *mapped = malloc(3 * vertex_count * sizeof *mapped);
  size_t count = 0;
  for (size_t v = 0; v < vertex_count; v++) map(vertices + 3 * v, mapped + 3 * v);
  for (size_t f = 0; f < faces; f++) {
    const double *corners[3], *part[3];
    double centre[3];
    for (int k = 0; k < 3; k++) corners[k] = vertices + 3 * triangles[3 * f + (size_t)k];
    for (int c = 0; c < 3; c++) centre[c] = (corners[0][c] + corners[1][c] + corners[2][c]) / 3;
    unsigned parts = split && f % 2 == 0 ? 3 : 1;
    for (unsigned p = 0; p < parts; p++, count++) {
      double *net = points + count * NETWORK_POINTS_MAX * 3;
      for (unsigned k = 0; k < 3; k++) part[k] = parts == 1 ? corners[k] : k == 2 ? centre : corners[(p + k) % 3];
      network_net(map, part, degree, net);
      patches[count] = (batten_network_patch){
          .degree = degree, .face = (uint32_t)f, .part = parts == 3 ? p + 1 : 0, .control_points = net};
    }
  }
  batten_status st = batten_network_create(ctx, vertex_count, mapped, faces, triangles, count, patches, 0, NULL, out);
  free(mapped);
  free(points);
  free(patches);
  return st;
}

static const double tetrahedron[12] = {0, 0, 0, 3, 0, 0, 0, 2, 0, 0, 0, 1};
static const uint32_t tetrahedron_faces[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};

/* (cells + 1)^2 vertices over [-1, 1]^2, moved about a little. */
static inline size_t network_grid(unsigned cells, double *vertices, uint32_t *triangles) {
  uint64_t seed = 3;
  size_t faces = 0;
  for (unsigned i = 0; i <= cells; i++)
    for (unsigned j = 0; j <= cells; j++) {
      double *v = vertices + 3 * (i * (cells + 1) + j);
      v[0] = 2.0 * i / cells - 1 + 0.2 * (t_uniform(&seed) - 0.5) / cells;
      v[1] = 2.0 * j / cells - 1 + 0.2 * (t_uniform(&seed) - 0.5) / cells;
      v[2] = 0;
    }
  for (unsigned i = 0; i < cells; i++)
    for (unsigned j = 0; j < cells; j++) {
      uint32_t a = i * (cells + 1) + j, b = a + cells + 1;
      uint32_t both[6] = {a, b, a + 1, a + 1, b, b + 1};
      memcpy(triangles + 3 * faces, both, sizeof both);
      faces += 2;
    }
  return faces;
}

#endif
