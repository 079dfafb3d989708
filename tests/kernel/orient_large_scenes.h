/* Scenes of many points with known outward normals: detail far finer than a subset of a thousand points, noise,
 * uneven density, lines, strays. Points come in no particular order. */
#ifndef ORIENT_LARGE_SCENES_H
#define ORIENT_LARGE_SCENES_H

#include "orient_scenes.h"

/* Percentages come with what a scene asks for. Points from `surface` on are strays: nobody knows their normals. */
typedef struct large_scene {
  scene s;
  size_t surface;
  double spacing; /* root of area over points */
  double volume;  /* of the solid; 0: not known */
} large_scene;

static inline large_scene l_new(const char *name, size_t capacity) {
  large_scene l = {{name, 3, 0, calloc(capacity * 3, sizeof(double)), calloc(capacity * 3, sizeof(double))}, 0, 0, 0};
  return l;
}

/* Standard normal, from a sum of twelve. */
static inline double l_gauss(uint64_t *seed) {
  double sum = -6;
  for (int i = 0; i < 12; i++) sum += t_uniform(seed);
  return sum;
}

static inline void l_unit(double v[3], uint64_t *seed) {
  double z = 2 * t_uniform(seed) - 1, r = sqrt(1 - z * z), a = 2 * s_pi * t_uniform(seed);
  v[0] = r * cos(a), v[1] = r * sin(a), v[2] = z;
}

/* Star r = 1 + 0.1 sin(5 x) sin(5 y) sin(5 z), x on the unit sphere; random points. */
static inline void l_bumpy(large_scene *l, size_t count, uint64_t seed) {
  for (size_t i = 0; i < count; i++) {
    double u[3], x[3], v[3], grad[3], along = 0;
    l_unit(u, &seed);
    double s[3], c[3];
    for (int k = 0; k < 3; k++) s[k] = sin(5 * u[k]), c[k] = cos(5 * u[k]);
    double r = 1 + 0.1 * s[0] * s[1] * s[2];
    grad[0] = 0.5 * c[0] * s[1] * s[2], grad[1] = 0.5 * s[0] * c[1] * s[2], grad[2] = 0.5 * s[0] * s[1] * c[2];
    for (int k = 0; k < 3; k++) along += grad[k] * u[k];
    for (int k = 0; k < 3; k++) {
      x[k] = r * u[k];
      v[k] = u[k] - (grad[k] - along * u[k]) / r; /* gradient of |x| - r(x / |x|) */
    }
    s_add(&l->s, x, v);
  }
  l->spacing = sqrt(4 * s_pi / (double)count);
}

/* Box [0, a] x [0, b] x [0, c] at `at`, random points by area; side -1: a cavity. rim 0: the faces of z alone. */
static inline void l_box(large_scene *l, size_t count, const double at[3], const double size[3], double side, int rim,
                         uint64_t seed) {
  double area[3] = {rim ? size[1] * size[2] : 0, rim ? size[0] * size[2] : 0, size[0] * size[1]};
  double total = area[0] + area[1] + area[2];
  for (size_t i = 0; i < count; i++) {
    double t = total * t_uniform(&seed), x[3], v[3] = {0};
    int face = t < area[0] ? 0 : t < area[0] + area[1] ? 1 : 2;
    double high = t_uniform(&seed) < 0.5 ? 0 : 1;
    for (int k = 0; k < 3; k++) x[k] = at[k] + size[k] * (k == face ? high : t_uniform(&seed));
    v[face] = side * (2 * high - 1);
    s_add(&l->s, x, v);
  }
  l->spacing = sqrt(2 * total / (double)count);
  l->volume += side * size[0] * size[1] * size[2];
}

/* Capsule from a to b: a cylinder with round ends. */
static inline void l_capsule(large_scene *l, size_t count, const double a[3], const double b[3], double radius,
                             uint64_t seed) {
  double axis[3], length = 0, u[3], v[3];
  for (int k = 0; k < 3; k++) length += (b[k] - a[k]) * (b[k] - a[k]);
  length = sqrt(length);
  for (int k = 0; k < 3; k++) axis[k] = (b[k] - a[k]) / length;
  int least = fabs(axis[0]) < 0.6 ? 0 : 1;
  for (int k = 0; k < 3; k++) u[k] = (k == least) - axis[least] * axis[k];
  double norm = sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
  for (int k = 0; k < 3; k++) u[k] /= norm;
  for (int k = 0; k < 3; k++) v[k] = axis[(k + 1) % 3] * u[(k + 2) % 3] - axis[(k + 2) % 3] * u[(k + 1) % 3];
  for (size_t i = 0; i < count; i++) {
    double x[3], w[3], angle = 2 * s_pi * t_uniform(&seed);
    if (t_uniform(&seed) * (length + 2 * radius) < length) {
      double t = t_uniform(&seed) * length;
      for (int k = 0; k < 3; k++) {
        w[k] = cos(angle) * u[k] + sin(angle) * v[k];
        x[k] = a[k] + t * axis[k] + radius * w[k];
      }
    } else {
      double along = 0;
      l_unit(w, &seed);
      for (int k = 0; k < 3; k++) along += w[k] * axis[k];
      for (int k = 0; k < 3; k++) x[k] = (along < 0 ? a[k] : b[k]) + radius * w[k];
    }
    s_add(&l->s, x, w);
  }
}

/* A ball with five fingers, each `width` of a spacing thick; points inside of the ball or another finger left out. */
static inline void l_hand(large_scene *l, size_t count, double thickness, uint64_t seed) {
  const double origin[3] = {0};
  size_t before = l->s.count, kept = before;
  double a[5][3], b[5][3];
  s_sphere(&l->s, count * 6 / 10, origin, 1, 1);
  for (int f = 0; f < 5; f++) {
    double angle = 0.35 * (f - 2);
    for (int k = 0; k < 3; k++) {
      double way = k == 0 ? sin(angle) : k == 2 ? cos(angle) : 0;
      a[f][k] = 0.9 * way, b[f][k] = 2 * way;
    }
    l_capsule(l, count * 8 / 100, a[f], b[f], thickness / 2, seed + (uint64_t)f);
  }
  for (size_t i = before; i < l->s.count; i++) {
    const double *x = l->s.points + 3 * i;
    bool inside = x[0] * x[0] + x[1] * x[1] + x[2] * x[2] < 1 - 1e-9;
    for (int f = 0; f < 5; f++) {
      double t = 0, square = 0, length = 0;
      for (int k = 0; k < 3; k++) {
        t += (x[k] - a[f][k]) * (b[f][k] - a[f][k]);
        length += (b[f][k] - a[f][k]) * (b[f][k] - a[f][k]);
      }
      t = fmin(fmax(t / length, 0), 1);
      for (int k = 0; k < 3; k++) {
        double e = x[k] - a[f][k] - t * (b[f][k] - a[f][k]);
        square += e * e;
      }
      inside = inside || square < thickness * thickness / 4 * (1 - 1e-9);
    }
    if (inside) continue;
    memmove(l->s.points + 3 * kept, x, 3 * sizeof(double));
    memmove(l->s.normals + 3 * kept++, l->s.normals + 3 * i, 3 * sizeof(double));
  }
  l->s.count = kept;
  l->spacing = sqrt(4 * s_pi / ((double)count * 0.6));
}

/* Unit sphere of count points, the half z > 0 with a thousand times the density of the other. */
static inline void l_uneven(large_scene *l, size_t count, uint64_t seed) {
  for (size_t i = 0; i < count;) {
    double u[3];
    l_unit(u, &seed);
    if (u[2] < 0 && t_uniform(&seed) > 1e-3) continue;
    double x[3], v[3];
    for (int k = 0; k < 3; k++) x[k] = u[k] * (k == 0 ? 1.5 : 1), v[k] = u[k] / (k == 0 ? 1.5 : 1);
    s_add(&l->s, x, v);
    i++;
  }
  l->spacing = sqrt(2 * s_pi / (double)count);
}

/* Torus in scan lines: points `ratio` times denser along meridians than the meridians lie. */
static inline void l_scanned(large_scene *l, size_t count, double ratio, uint64_t seed) {
  double major = 1, minor = 0.4;
  size_t lines = (size_t)sqrt((double)count * major / minor / ratio);
  for (size_t i = 0; i < count; i++) {
    double u = 2 * s_pi * (double)(i % lines) / (double)lines, v = 2 * s_pi * t_uniform(&seed);
    double w[3] = {cos(u) * cos(v), sin(u) * cos(v), sin(v)};
    double x[3] = {(major + minor * cos(v)) * cos(u), (major + minor * cos(v)) * sin(u), minor * sin(v)};
    s_add(&l->s, x, w);
  }
  l->spacing = 2 * s_pi * sqrt(major * minor / (double)count);
}

/* Normally distributed noise along the normal, `size` in spacings. */
static inline void l_noise(large_scene *l, double size, uint64_t seed) {
  for (size_t i = 0; i < l->s.count; i++) {
    double along = size * l->spacing * l_gauss(&seed);
    for (int k = 0; k < 3; k++) l->s.points[3 * i + (size_t)k] += along * l->s.normals[3 * i + (size_t)k];
  }
}

/* Puts the points in random order and `part` of them as strays behind, anywhere in twice their box. */
static inline void l_finish(large_scene *l, double part, uint64_t seed) {
  scene *s = &l->s;
  double lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t i = s->count; i-- > 1;) {
    size_t j = (size_t)(t_uniform(&seed) * (double)(i + 1));
    for (size_t k = 0; k < 3; k++) {
      double t = s->points[3 * i + k], v = s->normals[3 * i + k];
      s->points[3 * i + k] = s->points[3 * j + k], s->normals[3 * i + k] = s->normals[3 * j + k];
      s->points[3 * j + k] = t, s->normals[3 * j + k] = v;
    }
  }
  for (size_t i = 0; i < s->count; i++)
    for (size_t k = 0; k < 3; k++) {
      lower[k] = fmin(lower[k], s->points[3 * i + k]);
      upper[k] = fmax(upper[k], s->points[3 * i + k]);
    }
  l->surface = s->count;
  for (size_t i = 0; i < (size_t)(part * (double)l->surface); i++) {
    double x[3];
    for (int k = 0; k < 3; k++) x[k] = lower[k] + (upper[k] - lower[k]) * (2 * t_uniform(&seed) - 0.5);
    s_add(s, x, (double[3]){0, 0, 1});
  }
}

enum { L_SCENES = 19 };

/* Scene `which` of about count points. */
static inline large_scene l_scene(int which, size_t count) {
  const double zero[3] = {0}, right[3] = {1, 0, 0}, unit[3] = {1, 1, 1};
  large_scene l = l_new("", count + count / 8 + 64);
  double part = 0, h = sqrt(2.0 / (double)count); /* spacing on two sides of a unit square */
  switch (which) {
    case 0:
      l.s.name = "bumpy sphere";
      l_bumpy(&l, count, 1);
      break;
    case 1:
    case 2:
      l.s.name = which == 1 ? "bumpy sphere, noise of half a spacing" : "bumpy sphere, noise of a spacing";
      l_bumpy(&l, count, 1);
      l_noise(&l, which == 1 ? 0.5 : 1, 2);
      break;
    case 3:
    case 4:
      l.s.name = which == 3 ? "plate, 3 spacings thick" : "plate, 2 spacings thick";
      l_box(&l, count, zero, (double[3]){1, 1, (which == 3 ? 3 : 2) * h}, 1, 1, 3);
      break;
    case 5:
      l.s.name = "plate without a rim, 3 spacings thick";
      l_box(&l, count, zero, (double[3]){1, 1, 3 * h}, 1, 0, 3);
      break;
    case 6:
      l.s.name = "plate, 4 spacings thick, noise of half a spacing";
      l_box(&l, count, zero, (double[3]){1, 1, 4 * h}, 1, 1, 3);
      l_noise(&l, 0.5, 2);
      break;
    case 7:
      l.s.name = "cube with a fin 3 spacings thick";
      l_box(&l, count / 2, zero, unit, 1, 1, 4);
      l_box(&l, count / 2, (double[3]){1 + 8 * h, 0, 0.5}, (double[3]){1, 1, 3 * h * sqrt(2)}, 1, 1, 5);
      break;
    case 8:
      l.s.name = "two spheres, 3 spacings apart";
      s_sphere(&l.s, count / 2, zero, 1, 1);
      l.spacing = sqrt(8 * s_pi / (double)count);
      s_sphere(&l.s, count / 2, (double[3]){2 + 3 * l.spacing, 0, 0}, 1, 1);
      break;
    case 9:
      l.s.name = "linked tori";
      s_torus(&l.s, count / 2, zero, 1, 0.35, 2, 1);
      s_torus(&l.s, count / 2, right, 1, 0.35, 1, 2);
      l.spacing = 2 * s_pi * sqrt(2 * 0.35 / (double)count);
      break;
    case 10:
      l.s.name = "hand, fingers 6 spacings thick";
      l_hand(&l, count, 6 * sqrt(4 * s_pi / (0.6 * (double)count)), 3);
      break;
    case 11:
      l.s.name = "hollow shell";
      s_sphere(&l.s, count * 6 / 10, zero, 1, 1);
      s_sphere(&l.s, count * 4 / 10, zero, 0.8, -1);
      l.spacing = sqrt(4 * s_pi / (0.6 * (double)count));
      break;
    case 12:
      l.s.name = "shell with a wall of 4 spacings, noise of half a spacing";
      l.spacing = sqrt(8 * s_pi / (double)count);
      s_sphere(&l.s, count / 2, zero, 1, 1);
      s_sphere(&l.s, count / 2, zero, 1 - 4 * l.spacing, -1);
      l_noise(&l, 0.5, 3);
      break;
    case 13:
      l.s.name = "uneven 1:1000";
      l_uneven(&l, count, 3);
      break;
    case 14:
      l.s.name = "scan lines 8 times as far apart as their points";
      l_scanned(&l, count, 8, 3);
      break;
    case 15:
      l.s.name = "bumpy sphere, 1 % strays";
      l_bumpy(&l, count, 1);
      part = 0.01;
      break;
    case 16:
      l.s.name = "linked tori, noise of half a spacing, 1 % strays";
      s_torus(&l.s, count / 2, zero, 1, 0.35, 2, 1);
      s_torus(&l.s, count / 2, right, 1, 0.35, 1, 2);
      l.spacing = 2 * s_pi * sqrt(2 * 0.35 / (double)count);
      l_noise(&l, 0.5, 3);
      part = 0.01;
      break;
    case 17:
      l.s.name = "cube with a cubic cavity, noise of half a spacing";
      l_box(&l, count * 8 / 10, zero, unit, 1, 1, 4);
      l_box(&l, count * 2 / 10, (double[3]){0.25, 0.25, 0.25}, (double[3]){0.5, 0.5, 0.5}, -1, 1, 5);
      l_noise(&l, 0.5, 3);
      break;
    default:
      l.s.name = "boards 4 spacings thick and as far apart";
      l.volume = 0;
      for (int b = 0; b < 5; b++)
        l_box(&l, count / 5, (double[3]){0, 0, 8 * b * h * sqrt(5)}, (double[3]){1, 1, 4 * h * sqrt(5)}, 1, 1,
              5 + (uint64_t)b);
  }
  l_finish(&l, part, 9);
  return l;
}

typedef struct large_result {
  double wrong; /* percent of wrong signs: the normal's line is within 60 degrees of the truth, the normal is not */
  double off;   /* percent of normals more than 90 degrees off: also where a line is across, at edges */
  double median, most; /* angle to the true normal line, degrees: median, and 95 % are below */
} large_result;

static inline int l_compare(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

static inline large_result l_judge(const large_scene *l, const double *normals) {
  double *angle = calloc(l->surface, sizeof *angle);
  size_t wrong = 0, off = 0;
  for (size_t i = 0; i < l->surface; i++) {
    double cosine = 0;
    for (size_t k = 0; k < 3; k++) cosine += normals[3 * i + k] * l->s.normals[3 * i + k];
    wrong += (size_t) !(cosine > -0.5);
    off += (size_t) !(cosine > 0);
    angle[i] = acos(fmin(fabs(cosine), 1)) * 180 / s_pi;
  }
  qsort(angle, l->surface, sizeof *angle, l_compare);
  large_result r = {100 * (double)wrong / (double)l->surface, 100 * (double)off / (double)l->surface,
                    angle[l->surface / 2], angle[l->surface * 95 / 100]};
  free(angle);
  return r;
}

#endif
