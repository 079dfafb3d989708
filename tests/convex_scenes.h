/* Points of surfaces that are convex, nearly convex or not at all, and of functions: what convex fits are tried on.
 * Shared by tests, benchmarks and examples. The same numbers everywhere with the same mathematical library.
 *
 *   convex_scene s = convex_scene_paper(seed);                            the experiment of the paper
 *   convex_scene s = convex_scene_make(&(convex_rule){.body = ..., ...}); any other
 *   convex_scene_free(&s);
 *
 * A body is a height z(s, t) over the square [-1, 1]^2, stretched by the axes; points lie evenly in an outline there,
 * may be pushed in to a dent, are disturbed, and turned at last. */
#ifndef CONVEX_SCENES_H
#define CONVEX_SCENES_H

#include <stdlib.h>
#include <string.h>

#include "scenes.h"

typedef enum convex_body {
  CONVEX_ELLIPSOID = 0, /* the upper cap over reach times the square: sqrt(1 - s^2 - t^2) */
  CONVEX_PARABOLOID,    /* -(s^2 + t^2) / 2 */
  CONVEX_SUPERQUADRIC,  /* (1 - |s|^power - |t|^power)^(1 / power): K = 0 along s = 0 and t = 0 where power > 2 */
  CONVEX_HALF_PIPE,     /* sqrt(1 - s^2): a cylinder, K = 0 everywhere */
  CONVEX_SADDLE,        /* (s^2 - t^2) / 2 */
  CONVEX_PLANE,         /* 0 */
  CONVEX_LINE,          /* t = 0, z = 0: all points on a line */
  CONVEX_BODIES
} convex_body;

typedef enum convex_outline {
  CONVEX_RECTANGLE = 0,
  CONVEX_DISC,
  CONVEX_TRIANGLE,
  CONVEX_ELL, /* the square without its quarter s, t > 0 */
  CONVEX_OUTLINES
} convex_outline;

typedef struct convex_rule {
  convex_body body;
  convex_outline outline;
  size_t count;
  double axes[3];    /* 0, 0, 0 = 1, 1, 1 */
  double reach;      /* part of the body that is taken, (0, 1); 0 = 0.65 */
  double power;      /* of superquadrics, >= 2; 0 = 3 */
  double noise;      /* standard deviation of each coordinate, in units of the axes' mean */
  bool along_normal; /* noise that moves points across the surface only */
  double dent_depth; /* 0 = none; smooth, down to this depth, same unit */
  double dent_size;  /* its radius in (s, t) of the square; 0 = 0.4 */
  double dent_at[2]; /* its middle */
  bool turned;       /* by a rotation that the seed gives, and moved */
  bool grid;         /* a regular grid in place of random points; the count becomes the next square below */
  uint64_t seed;
} convex_rule;

typedef struct convex_scene {
  size_t count;
  double *points;     /* [count][3] */
  double *parameters; /* [count][2] in [0, 1]^2: ((s, t) + 1) / 2 */
  double *truth;      /* [count][3] without noise (with the dent) */
  bool *dent;         /* [count] moved by more than a tenth of the dent's depth */
} convex_scene;

static inline void convex_scene_free(convex_scene *s) {
  free(s->points);
  free(s->parameters);
  free(s->truth);
  free(s->dent);
  *s = (convex_scene){0};
}

/* Standard normal. */
static inline double convex_normal(uint64_t *state) {
  double radius = sqrt(-2 * log(1 - scene_uniform(state)));
  return radius * cos(2 * SCENE_PI * scene_uniform(state));
}

static inline bool convex_inside(convex_outline outline, double s, double t) {
  switch (outline) {
    case CONVEX_DISC: return s * s + t * t <= 1;
    case CONVEX_TRIANGLE: return s + t <= 0;
    case CONVEX_ELL: return s <= 0 || t <= 0;
    default: return true;
  }
}

/* Height over (s, t) in [-reach, reach]^2, without the axes. */
static inline double convex_height(const convex_rule *r, double s, double t) {
  double power = r->power > 0 ? r->power : 3;
  switch (r->body) {
    case CONVEX_ELLIPSOID: return sqrt(fmax(0, 1 - s * s - t * t));
    case CONVEX_PARABOLOID: return -(s * s + t * t) / 2;
    case CONVEX_SUPERQUADRIC: return pow(fmax(0, 1 - pow(fabs(s), power) - pow(fabs(t), power)), 1 / power);
    case CONVEX_HALF_PIPE: return sqrt(fmax(0, 1 - s * s));
    case CONVEX_SADDLE: return (s * s - t * t) / 2;
    default: return 0;
  }
}

/* The point over (s, t) of the square, with the dent. */
static inline void convex_point(const convex_rule *r, double s, double t, double *p) {
  double reach = r->reach > 0 ? r->reach : 0.65, size = r->dent_size > 0 ? r->dent_size : 0.4;
  const double *a = r->axes;
  bool unit = a[0] == 0;
  p[0] = (unit ? 1 : a[0]) * reach * s;
  p[1] = (unit ? 1 : a[1]) * (r->body == CONVEX_LINE ? 0 : reach * t);
  p[2] = (unit ? 1 : a[2]) * convex_height(r, reach * s, reach * t);
  double away = hypot(s - r->dent_at[0], t - r->dent_at[1]) / size;
  double mean = unit ? 1 : (a[0] + a[1] + a[2]) / 3;
  if (away < 1) p[2] -= mean * r->dent_depth * pow(1 - away * away, 2);
}

/* Unit normal over (s, t), by differences. */
static inline void convex_point_normal(const convex_rule *r, double s, double t, double *normal) {
  const double h = 1e-5;
  double a[3], b[3], c[3], d[3], length = 0;
  convex_point(r, s + h, t, a);
  convex_point(r, s - h, t, b);
  convex_point(r, s, t + h, c);
  convex_point(r, s, t - h, d);
  for (int k = 0; k < 3; k++) {
    int i = (k + 1) % 3, j = (k + 2) % 3;
    normal[k] = (a[i] - b[i]) * (c[j] - d[j]) - (a[j] - b[j]) * (c[i] - d[i]);
    length += normal[k] * normal[k];
  }
  for (int k = 0; k < 3 && length > 0; k++) normal[k] /= sqrt(length);
}

/* A rotation matrix, evenly distributed: from a unit quaternion. */
static inline void convex_rotation(uint64_t *state, double m[3][3]) {
  double q[4], length = 0;
  for (int k = 0; k < 4; k++) {
    q[k] = convex_normal(state);
    length += q[k] * q[k];
  }
  for (int k = 0; k < 4; k++) q[k] /= sqrt(length);
  for (int i = 0; i < 3; i++) {
    int j = (i + 1) % 3, k = (i + 2) % 3;
    m[i][i] = 1 - 2 * (q[j + 1] * q[j + 1] + q[k + 1] * q[k + 1]);
    m[i][j] = 2 * (q[i + 1] * q[j + 1] - q[k + 1] * q[0]);
    m[j][i] = 2 * (q[i + 1] * q[j + 1] + q[k + 1] * q[0]);
  }
}

static inline void convex_turn(const double m[3][3], const double *move, double *p) {
  double q[3];
  for (int i = 0; i < 3; i++) q[i] = m[i][0] * p[0] + m[i][1] * p[1] + m[i][2] * p[2] + move[i];
  memcpy(p, q, sizeof q);
}

static inline void *convex_allocate(size_t count, size_t size) {
  void *p = malloc(count * size + 1);
  if (!p) abort(); /* scenes are small, and nothing can be tested without them */
  return p;
}

static inline convex_scene convex_scene_new(size_t count) {
  convex_scene s = {.count = count};
  s.points = convex_allocate(3 * count, sizeof *s.points);
  s.parameters = convex_allocate(2 * count, sizeof *s.parameters);
  s.truth = convex_allocate(3 * count, sizeof *s.truth);
  s.dent = convex_allocate(count, sizeof *s.dent);
  return s;
}

static inline convex_scene convex_scene_make(const convex_rule *r) {
  uint64_t state = r->seed;
  size_t side = (size_t)sqrt((double)r->count + 0.5), at = 0;
  size_t count = r->grid ? side * side : r->count;
  convex_scene scene = convex_scene_new(count);
  double unit = r->axes[0] == 0 ? 1 : (r->axes[0] + r->axes[1] + r->axes[2]) / 3;
  for (size_t i = 0; i < count; i++) {
    double s, t, normal[3], whole[3];
    bool inside;
    do {
      s = r->grid && side > 1 ? 2.0 * (double)(at / side) / (double)(side - 1) - 1 : 2 * scene_uniform(&state) - 1;
      t = r->grid && side > 1 ? 2.0 * (double)(at % side) / (double)(side - 1) - 1 : 2 * scene_uniform(&state) - 1;
      inside = convex_inside(r->outline, s, t);
      at++;
    } while (!inside && !(r->grid && at >= side * side));
    if (r->grid && (!inside || at > side * side)) { /* the grid is used up: the outline holds fewer points */
      scene.count = i;
      break;
    }
    double *p = scene.points + 3 * i;
    convex_point(r, s, t, p);
    memcpy(scene.truth + 3 * i, p, 3 * sizeof *p);
    scene.parameters[2 * i] = (s + 1) / 2;
    scene.parameters[2 * i + 1] = (t + 1) / 2;
    convex_rule smooth = *r;
    smooth.dent_depth = 0;
    convex_point(&smooth, s, t, whole);
    scene.dent[i] = r->dent_depth != 0 && fabs(whole[2] - p[2]) > 0.1 * unit * fabs(r->dent_depth);
    if (!(r->noise > 0)) continue;
    if (r->along_normal) convex_point_normal(&smooth, s, t, normal);
    double across = r->noise * unit * convex_normal(&state);
    for (int k = 0; k < 3; k++) p[k] += r->along_normal ? across * normal[k] : r->noise * unit * convex_normal(&state);
  }
  if (r->turned) {
    double m[3][3], move[3];
    convex_rotation(&state, m);
    for (int k = 0; k < 3; k++) move[k] = 10 * scene_uniform(&state) - 5;
    for (size_t i = 0; i < scene.count; i++) {
      convex_turn((const double(*)[3])m, move, scene.points + 3 * i);
      convex_turn((const double(*)[3])m, move, scene.truth + 3 * i);
    }
  }
  return scene;
}

/* The experiment of the paper (section 6): "51 points from an ellipsoid, perturbed by random numbers". It gives
 * neither axes nor noise; these bring the sums of squares and the curvatures to the size of its own: 0.153
 * unconstrained, 0.422 reference, 0.244 convex, K from 0.01 to 2.32. */
enum { CONVEX_PAPER_COUNT = 51 };
static inline convex_rule convex_rule_paper(uint64_t seed) {
  return (convex_rule){.body = CONVEX_ELLIPSOID,
                       .count = CONVEX_PAPER_COUNT,
                       .axes = {1.5, 1.2, 1},
                       .reach = 0.65,
                       .noise = 0.06,
                       .seed = seed};
}
static inline convex_scene convex_scene_paper(uint64_t seed) {
  convex_rule r = convex_rule_paper(seed);
  return convex_scene_make(&r);
}

/* A random convex data set: any body, outline and turn, noise up to 10 %, 30 to 5,000 points. */
static inline convex_rule convex_rule_random(uint64_t seed) {
  static const convex_body bodies[3] = {CONVEX_ELLIPSOID, CONVEX_PARABOLOID, CONVEX_SUPERQUADRIC};
  uint64_t state = seed ^ 0x5851f42d4c957f2du;
  convex_rule r = {.seed = seed, .turned = true};
  r.body = bodies[(size_t)(3 * scene_uniform(&state))];
  r.outline = (convex_outline)(size_t)(CONVEX_OUTLINES * scene_uniform(&state));
  r.count = (size_t)(30 * pow(5000.0 / 30, scene_uniform(&state)));
  for (int k = 0; k < 3; k++) r.axes[k] = 0.5 + 1.5 * scene_uniform(&state);
  r.reach = 0.3 + 0.38 * scene_uniform(&state);
  r.power = 2 + 2 * scene_uniform(&state);
  r.noise = 0.1 * scene_uniform(&state);
  r.along_normal = scene_uniform(&state) < 0.5;
  return r;
}

/* ---- functions ------------------------------------------------------------------------------------- */

typedef enum convex_function {
  CONVEX_F_BOWL = 0, /* x^2 + y^2 / 2 */
  CONVEX_F_EXP,      /* exp(x - y): a cylinder, convex but nowhere strictly */
  CONVEX_F_SOFT_MAX, /* log(exp(4 x) + exp(4 y) + exp(-4 x - 4 y)) / 4 */
  CONVEX_F_CONE,     /* hypot(x, y): a kink at one point */
  CONVEX_F_ROOF,     /* |x| + |y| / 2: kinks along lines */
  CONVEX_F_CUBIC,    /* x^3 + y^2 x: concave for x < 0, convex for x > 0 near y = 0 */
  CONVEX_F_WAVE,     /* sin(pi x) + sin(pi y): signs change over the quarters */
  CONVEX_F_SADDLE,   /* x^2 - y^2 */
  CONVEX_FUNCTIONS
} convex_function;

/* On [-1, 1]^2. */
static inline double convex_function_value(convex_function f, double x, double y) {
  switch (f) {
    case CONVEX_F_BOWL: return x * x + y * y / 2;
    case CONVEX_F_EXP: return exp(x - y);
    case CONVEX_F_SOFT_MAX: return log(exp(4 * x) + exp(4 * y) + exp(-4 * x - 4 * y)) / 4;
    case CONVEX_F_CONE: return hypot(x, y);
    case CONVEX_F_ROOF: return fabs(x) + fabs(y) / 2;
    case CONVEX_F_CUBIC: return x * x * x + y * y * x;
    case CONVEX_F_WAVE: return sin(SCENE_PI * x) + sin(SCENE_PI * y);
    case CONVEX_F_SADDLE: return x * x - y * y;
    default: return 0;
  }
}

/* Points (x, y, f + noise) evenly in [-1, 1]^2; parameters as above. */
static inline convex_scene convex_scene_function(convex_function f, size_t count, double noise, uint64_t seed) {
  convex_scene scene = convex_scene_new(count);
  uint64_t state = seed;
  for (size_t i = 0; i < count; i++) {
    double *p = scene.points + 3 * i, *q = scene.truth + 3 * i;
    for (int k = 0; k < 2; k++) {
      scene.parameters[2 * i + (size_t)k] = scene_uniform(&state);
      p[k] = q[k] = 2 * scene.parameters[2 * i + (size_t)k] - 1;
    }
    q[2] = convex_function_value(f, q[0], q[1]);
    p[2] = q[2] + noise * convex_normal(&state);
    scene.dent[i] = false;
  }
  return scene;
}

#endif
