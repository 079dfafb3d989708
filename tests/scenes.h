/* Shapes with a known inside, and points on them: shared by tests, benchmarks and examples.
 *
 * Each shape is a function scene_X(p), positive inside, zero on the surface, and a sampler scene_X_points(seed,
 * count, points) that spreads points evenly by area (curves: by length, without a seed). The same numbers everywhere.
 */
#ifndef SCENES_H
#define SCENES_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define SCENE_PI 3.14159265358979323846

/* splitmix64, uniform in [0, 1). */
static inline double scene_uniform(uint64_t *state) {
  uint64_t z = (*state += 0x9e3779b97f4a7c15u);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  z ^= z >> 31;
  return (double)(z >> 11) * 0x1p-53;
}

/* Outward unit normal of a scene by differences; n = 2 or 3. */
static inline void scene_normal(unsigned n, double (*scene)(const double *), const double *p, double *normal) {
  const double h = 1e-6;
  double square = 0;
  for (unsigned k = 0; k < n; k++) {
    double a[3] = {p[0], p[1], n > 2 ? p[2] : 0}, b[3] = {p[0], p[1], n > 2 ? p[2] : 0};
    a[k] -= h;
    b[k] += h;
    normal[k] = scene(a) - scene(b);
    square += normal[k] * normal[k];
  }
  for (unsigned k = 0; k < n; k++) normal[k] /= sqrt(square);
}

/* ---- solids ------------------------------------------------------------------------------------- */

static inline double scene_sphere(const double *p) { return 1 - sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]); }
static inline void scene_sphere_point(uint64_t *seed, double *p) {
  double z = 2 * scene_uniform(seed) - 1, a = 2 * SCENE_PI * scene_uniform(seed), r = sqrt(1 - z * z);
  p[0] = r * cos(a);
  p[1] = r * sin(a);
  p[2] = z;
}
static inline void scene_sphere_points(uint64_t seed, size_t count, double *points) {
  for (size_t i = 0; i < count; i++) scene_sphere_point(&seed, points + 3 * i);
}

/* Hollow ball: radii 1 and 0.5. Two sevenths of the points lie inside. */
static inline double scene_shell(const double *p) {
  double r = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
  return fmin(1 - r, r - 0.5);
}
static inline void scene_shell_points(uint64_t seed, size_t count, double *points) {
  scene_sphere_points(seed, count, points);
  for (size_t i = 0; i < 3 * (count * 2 / 7); i++) points[i] *= 0.5;
}

/* Torus of radii 1 and 0.4 about z. */
static inline double scene_torus(const double *p) {
  double out = sqrt(p[0] * p[0] + p[1] * p[1]) - 1;
  return 0.4 - sqrt(out * out + p[2] * p[2]);
}
static inline void scene_torus_point(uint64_t *seed, double major, double minor, double *p) {
  double tube;
  do tube = 2 * SCENE_PI * scene_uniform(seed); /* area grows with the distance from the axis */
  while (scene_uniform(seed) * (major + minor) > major + minor * cos(tube));
  double a = 2 * SCENE_PI * scene_uniform(seed), r = major + minor * cos(tube);
  p[0] = r * cos(a);
  p[1] = r * sin(a);
  p[2] = minor * sin(tube);
}
static inline void scene_torus_points(uint64_t seed, size_t count, double *points) {
  for (size_t i = 0; i < count; i++) scene_torus_point(&seed, 1, 0.4, points + 3 * i);
}

/* Two links of a chain: tori of radii 1 and 0.25, one about z at the origin, one about y at x = 1. */
static inline double scene_links(const double *p) {
  double a = sqrt(p[0] * p[0] + p[1] * p[1]) - 1, b = sqrt((p[0] - 1) * (p[0] - 1) + p[2] * p[2]) - 1;
  return fmax(0.25 - sqrt(a * a + p[2] * p[2]), 0.25 - sqrt(b * b + p[1] * p[1]));
}
static inline void scene_links_points(uint64_t seed, size_t count, double *points) {
  for (size_t i = 0; i < count; i++) {
    double *p = points + 3 * i;
    scene_torus_point(&seed, 1, 0.25, p);
    if (i % 2 == 0) continue;
    double y = p[1];
    p[0] += 1;
    p[1] = p[2];
    p[2] = y;
  }
}

static inline double scene_box(const double *half, const double *p) {
  double inner = -INFINITY, outer = 0;
  for (int k = 0; k < 3; k++) {
    double e = fabs(p[k]) - half[k];
    inner = fmax(inner, e);
    outer += e > 0 ? e * e : 0;
  }
  return outer > 0 ? -sqrt(outer) : -inner;
}
static inline void scene_box_points(const double *half, uint64_t seed, size_t count, double *points) {
  double area[3] = {half[1] * half[2], half[0] * half[2], half[0] * half[1]}, all = area[0] + area[1] + area[2];
  for (size_t i = 0; i < count; i++, points += 3) {
    double pick = scene_uniform(&seed) * all;
    int face = pick < area[0] ? 0 : pick < area[0] + area[1] ? 1 : 2;
    for (int k = 0; k < 3; k++) points[k] = half[k] * (2 * scene_uniform(&seed) - 1);
    points[face] = scene_uniform(&seed) < 0.5 ? -half[face] : half[face];
  }
}
static const double scene_cube_half[3] = {1, 1, 1};
static inline double scene_cube(const double *p) { return scene_box(scene_cube_half, p); }
static inline void scene_cube_points(uint64_t seed, size_t count, double *points) {
  scene_box_points(scene_cube_half, seed, count, points);
}

/* Thin plate, 5 spacings thick. */
#define SCENE_PLATE_SPACING 0.1
static const double scene_plate_half[3] = {1, 1, 0.25};
static inline double scene_plate(const double *p) { return scene_box(scene_plate_half, p); }
/* Points of all sides on a lattice, jittered by a tenth of the spacing; returns how many. points NULL: only counts.
 */
static inline size_t scene_plate_points(uint64_t seed, double *points) {
  size_t made = 0;
  for (int face = 0; face < 3; face++) {
    int u = (face + 1) % 3, v = (face + 2) % 3;
    int nu = (int)lround(2 * scene_plate_half[u] / SCENE_PLATE_SPACING);
    int nv = (int)lround(2 * scene_plate_half[v] / SCENE_PLATE_SPACING);
    for (int side = -1; side <= 1; side += 2)
      for (int i = 0; i < nu; i++)
        for (int j = 0; j < nv; j++, made++) {
          double a = i + 0.5 + 0.2 * (scene_uniform(&seed) - 0.5), b = j + 0.5 + 0.2 * (scene_uniform(&seed) - 0.5);
          if (!points) continue;
          points[3 * made + (size_t)face] = side * scene_plate_half[face];
          points[3 * made + (size_t)u] = -scene_plate_half[u] + a * SCENE_PLATE_SPACING;
          points[3 * made + (size_t)v] = -scene_plate_half[v] + b * SCENE_PLATE_SPACING;
        }
  }
  return made;
}

/* A body like a small moon: an ellipsoid 1.3 : 1.1 : 0.9 with broad bumps and a few dents. Star-shaped. */
static inline double scene_moon_radius(const double *u) {
  double e = u[0] * u[0] / 1.69 + u[1] * u[1] / 1.21 + u[2] * u[2] / 0.81;
  double bumps =
      0.04 * sin(4 * u[0] + 1) * cos(3 * u[1]) + 0.03 * sin(5 * u[1] + 4 * u[2]) + 0.02 * cos(7 * u[2] - 3 * u[0]);
  double dx = u[0] + 0.8, dy = u[1] - 0.5, dz = u[2] - 0.33; /* one large crater */
  return (1 + bumps - 0.10 * exp(-12 * (dx * dx + dy * dy + dz * dz))) / sqrt(e);
}
static inline double scene_moon(const double *p) {
  double r = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
  if (r == 0) return 0.9;
  const double u[3] = {p[0] / r, p[1] / r, p[2] / r};
  return scene_moon_radius(u) - r;
}
/* Directions are even on the sphere, kept with a chance of the area that they carry, r^2 up to a third. */
static inline void scene_moon_points(uint64_t seed, size_t count, double *points) {
  for (size_t i = 0; i < count;) {
    double u[3];
    scene_sphere_point(&seed, u);
    double r = scene_moon_radius(u);
    if (scene_uniform(&seed) * 2.25 > r * r) continue;
    for (int k = 0; k < 3; k++) points[3 * i + (size_t)k] = r * u[k];
    i++;
  }
}

/* ---- plane shapes ------------------------------------------------------------------------------- */

/* A thick C: the ring 0.6 < r < 1 without the sector |angle| < 30 degrees about the x axis. */
static inline double scene_c(const double *p) {
  double r = sqrt(p[0] * p[0] + p[1] * p[1]), ring = 0.2 - fabs(r - 0.8);
  double side = r * sin(fmin(fabs(atan2(p[1], p[0])), SCENE_PI / 2 + SCENE_PI / 6) - SCENE_PI / 6);
  return fmin(ring, side);
}
/* Evenly along the contour, counter-clockwise. */
static inline void scene_c_points(size_t count, double *points) {
  const double half = SCENE_PI / 6, sweep = 2 * SCENE_PI - 2 * half;
  const double part[4] = {sweep, 0.4, 0.6 * sweep, 0.4}, all = 1.6 * sweep + 0.8;
  for (size_t i = 0; i < count; i++, points += 2) {
    double s = all * ((double)i + 0.5) / (double)count, angle, r;
    int k = 0;
    while (k < 3 && s > part[k]) s -= part[k++];
    if (k == 0)
      angle = half + s, r = 1;
    else if (k == 1)
      angle = -half, r = 1 - s;
    else if (k == 2)
      angle = -half - s / 0.6, r = 0.6;
    else
      angle = half, r = 0.6 + s;
    points[0] = r * cos(angle);
    points[1] = r * sin(angle);
  }
}

/* Two closed contours: an ellipse and a lobed disk beside it (the paper's figure 2 has two such). 37 + 30 points for
 * count = 67. */
static inline double scene_pair_lobe(double angle) { return 0.7 + 0.12 * cos(3 * angle); }
static inline double scene_pair(const double *p) {
  double x = (p[0] + 1.1) / 0.8, y = p[1] / 1.2, r = sqrt((p[0] - 0.9) * (p[0] - 0.9) + p[1] * p[1]);
  return fmax(0.8 * (1 - sqrt(x * x + y * y)), scene_pair_lobe(atan2(p[1], p[0] - 0.9)) - r);
}
static inline void scene_pair_points(size_t count, double *points) {
  size_t first = (count * 37 + 33) / 67;
  for (size_t i = 0; i < count; i++, points += 2) {
    if (i < first) {
      double a = 2 * SCENE_PI * (double)i / (double)first;
      points[0] = -1.1 + 0.8 * cos(a);
      points[1] = 1.2 * sin(a);
    } else {
      double a = 2 * SCENE_PI * (double)(i - first) / (double)(count - first), r = scene_pair_lobe(a);
      points[0] = 0.9 + r * cos(a);
      points[1] = r * sin(a);
    }
  }
}

#endif
