/* Stacks of sections with a known inside: shared by tests, benchmarks and examples.
 *
 * A stack_scene grows section by section and loop by loop; stack_scene_sections hands out what batten_stack_build
 * takes. Nothing is random but what takes a seed. Running out of memory ends the program. */
#ifndef STACK_SCENES_H
#define STACK_SCENES_H

#include <batten/stack.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "scenes.h"

typedef struct stack_scene {
  size_t count, loops, points;
  batten_section *sections; /* [count] */
  size_t *section_loops;    /* [count + 1] */
  size_t *loop_points;      /* [loops + 1] */
  double *at;               /* [points][2] */
  size_t *starts;           /* [loops + count]: what the sections point to */
} stack_scene;

static inline void *stack_scene_grow(void *block, size_t bytes) {
  void *grown = realloc(block, bytes);
  if (!grown) {
    fprintf(stderr, "stack_scenes.h: out of memory\n");
    exit(1);
  }
  return grown;
}

/* A section without loops; rotation [9] NULL: that of the axes of space. */
static inline void stack_scene_section(stack_scene *s, const double *origin, const double *rotation) {
  static const double axes[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  s->sections = stack_scene_grow(s->sections, (s->count + 1) * sizeof *s->sections);
  s->section_loops = stack_scene_grow(s->section_loops, (s->count + 2) * sizeof *s->section_loops);
  batten_section *made = &s->sections[s->count];
  memset(made, 0, sizeof *made);
  memcpy(made->origin, origin, sizeof made->origin);
  memcpy(made->rotation, rotation ? rotation : axes, sizeof made->rotation);
  s->section_loops[s->count++] = s->loops;
  s->section_loops[s->count] = s->loops;
}
/* In the plane z = height. */
static inline void stack_scene_slice(stack_scene *s, double height) {
  const double origin[3] = {0, 0, height};
  stack_scene_section(s, origin, NULL);
}
/* A loop of the last section; points [count][2]. */
static inline void stack_scene_loop(stack_scene *s, size_t count, const double *points) {
  s->loop_points = stack_scene_grow(s->loop_points, (s->loops + 2) * sizeof *s->loop_points);
  s->at = stack_scene_grow(s->at, 2 * (s->points + count + 1) * sizeof *s->at);
  s->loop_points[s->loops++] = s->points;
  memcpy(s->at + 2 * s->points, points, 2 * count * sizeof *points);
  s->points += count;
  s->loop_points[s->loops] = s->points;
  s->section_loops[s->count] = s->loops;
}
/* All sections [s->count]; good until the scene grows again. */
static inline const batten_section *stack_scene_sections(stack_scene *s) {
  s->starts = stack_scene_grow(s->starts, (s->loops + s->count + 1) * sizeof *s->starts);
  size_t *starts = s->starts;
  for (size_t i = 0; i < s->count; i++) {
    size_t first = s->section_loops[i], loops = s->section_loops[i + 1] - first;
    size_t base = loops ? s->loop_points[first] : 0;
    for (size_t k = 0; k <= loops; k++) starts[k] = loops ? s->loop_points[first + k] - base : 0;
    s->sections[i].contour_count = loops;
    s->sections[i].starts = starts;
    s->sections[i].points = loops ? s->at + 2 * base : NULL;
    starts += loops + 1;
  }
  return s->sections;
}
static inline void stack_scene_free(stack_scene *s) {
  free(s->sections);
  free(s->section_loops);
  free(s->loop_points);
  free(s->at);
  free(s->starts);
  memset(s, 0, sizeof *s);
}
/* Point (x, y) of section i in space. */
static inline void stack_scene_place(const stack_scene *s, size_t i, const double *xy, double *out) {
  const batten_section *at = &s->sections[i];
  for (int k = 0; k < 3; k++) out[k] = at->origin[k] + xy[0] * at->rotation[0][k] + xy[1] * at->rotation[1][k];
}

/* ---- everything turned -------------------------------------------------------------------------- */

/* Rotation by an angle (radians) about an axis of any length: out [9], out v is v turned. */
static inline void stack_scene_rotation(const double axis[3], double angle, double *out) {
  double length = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
  const double a[3] = {axis[0] / length, axis[1] / length, axis[2] / length};
  const double cross[3][3] = {{0, -a[2], a[1]}, {a[2], 0, -a[0]}, {-a[1], a[0], 0}};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      out[3 * i + j] = (i == j ? cos(angle) : 0) + sin(angle) * cross[i][j] + (1 - cos(angle)) * a[i] * a[j];
}
static inline void stack_scene_turn_vector(const double *turn, double v[3]) {
  const double x = v[0], y = v[1], z = v[2];
  for (int k = 0; k < 3; k++) v[k] = turn[3 * k] * x + turn[3 * k + 1] * y + turn[3 * k + 2] * z;
}
/* Turns all frames about the origin of space; loops stay as they are in their planes. */
static inline void stack_scene_turn(stack_scene *s, const double *turn) {
  for (size_t i = 0; i < s->count; i++) {
    stack_scene_turn_vector(turn, s->sections[i].origin);
    for (int k = 0; k < 3; k++) stack_scene_turn_vector(turn, s->sections[i].rotation[k]);
  }
}

/* ---- loops -------------------------------------------------------------------------------------- */

static inline void stack_scene_disc(stack_scene *s, double x, double y, double radius, size_t count) {
  double *p = stack_scene_grow(NULL, 2 * count * sizeof *p);
  for (size_t i = 0; i < count; i++) {
    double a = 2 * SCENE_PI * (double)i / (double)count;
    p[2 * i] = x + radius * cos(a);
    p[2 * i + 1] = y + radius * sin(a);
  }
  stack_scene_loop(s, count, p);
  free(p);
}
/* A polygon with `side` points on each edge (its first corner and those after it). */
static inline void stack_scene_polygon(stack_scene *s, size_t corners, const double *corner, size_t side) {
  double *p = stack_scene_grow(NULL, 2 * corners * side * sizeof *p);
  for (size_t i = 0; i < corners; i++)
    for (size_t j = 0; j < side; j++)
      for (size_t k = 0; k < 2; k++) {
        double u = (double)j / (double)side, a = corner[2 * i + k], b = corner[2 * ((i + 1) % corners) + k];
        p[2 * (i * side + j) + k] = (1 - u) * a + u * b;
      }
  stack_scene_loop(s, corners * side, p);
  free(p);
}
static inline void stack_scene_rectangle(stack_scene *s, double half_x, double half_y, size_t side) {
  const double corner[8] = {-half_x, -half_y, half_x, -half_y, half_x, half_y, -half_x, half_y};
  stack_scene_polygon(s, 4, corner, side);
}
/* A moon in its last quarter: the unit disc without the disc of radius 0.9 about (0.45, 0), in these sizes; about
 * `count` points. */
static inline double scene_crescent(const double *p) {
  return fmin(1 - hypot(p[0], p[1]), hypot(p[0] - 0.45, p[1]) - 0.9);
}
static inline void stack_scene_crescent(stack_scene *s, double size, size_t count) {
  double x = (0.45 * 0.45 + 1 - 0.81) / 0.9, y = sqrt(1 - x * x); /* where both circles meet */
  double outer = atan2(y, x), inner = atan2(y, x - 0.45);
  size_t half = count / 2;
  double *p = stack_scene_grow(NULL, 4 * half * sizeof *p);
  for (size_t i = 0; i < half; i++) {
    double u = (double)i / (double)half, a = outer + u * (2 * SCENE_PI - 2 * outer);
    double b = -inner - u * (2 * SCENE_PI - 2 * inner);
    p[2 * i] = size * cos(a);
    p[2 * i + 1] = size * sin(a);
    p[2 * (half + i)] = size * (0.45 + 0.9 * cos(b));
    p[2 * (half + i) + 1] = size * 0.9 * sin(b);
  }
  stack_scene_loop(s, 2 * half, p);
  free(p);
}
/* A comb: a bar (0, 0) .. (2 teeth - 1, 1) with teeth of width 1 and this length above it. */
static inline void stack_scene_comb(stack_scene *s, size_t teeth, double length, size_t side) {
  double *corner = stack_scene_grow(NULL, 2 * (4 * teeth + 2) * sizeof *corner), *p = corner;
  double width = 2 * (double)teeth - 1;
  *p++ = 0, *p++ = 0, *p++ = width, *p++ = 0;
  for (size_t i = teeth; i-- > 0;) {
    double x = 2 * (double)i;
    if (i < teeth - 1) *p++ = x + 1, *p++ = 1;
    *p++ = x + 1, *p++ = 1 + length, *p++ = x, *p++ = 1 + length;
    if (i > 0) *p++ = x, *p++ = 1;
  }
  stack_scene_polygon(s, (size_t)(p - corner) / 2, corner, side);
  free(corner);
}
static inline double scene_comb(size_t teeth, double length, const double *p) {
  double width = 2 * (double)teeth - 1, f = fmin(fmin(p[0], width - p[0]), fmin(p[1], 1 - p[1]));
  for (size_t i = 0; i < teeth; i++) {
    double x = 2 * (double)i;
    f = fmax(f, fmin(fmin(p[0] - x, x + 1 - p[0]), fmin(p[1], 1 + length - p[1])));
  }
  return f;
}

/* ---- parallel stacks ---------------------------------------------------------------------------- */

/* Discs about the z axis at z = 0, gap, 2 gap, ...; points: on each. */
static inline void stack_scene_discs(stack_scene *s, size_t count, const double *radii, double gap, size_t points) {
  for (size_t i = 0; i < count; i++) {
    stack_scene_slice(s, gap * (double)i);
    stack_scene_disc(s, 0, 0, radii[i], points);
  }
}
/* A ball of radius 1 about 0 in `count` slices, the outermost half a gap from the poles. */
static inline void stack_scene_ball(stack_scene *s, size_t count, size_t points) {
  for (size_t i = 0; i < count; i++) {
    double z = -1 + (2 * (double)i + 1) / (double)count;
    stack_scene_slice(s, z);
    stack_scene_disc(s, 0, 0, sqrt(1 - z * z), points);
  }
}
/* A tube: annuli of radii `inner` and `outer`. One component of genus 1. */
static inline void stack_scene_annuli(stack_scene *s, size_t count, double inner, double outer, double gap,
                                      size_t points) {
  for (size_t i = 0; i < count; i++) {
    stack_scene_slice(s, gap * (double)i);
    stack_scene_disc(s, 0, 0, outer, points);
    stack_scene_disc(s, 0, 0, inner, points);
  }
}
/* A trunk and three branches: a disc of radius 10 at z = 0 and 5, discs of radius 4 at the distances 7, 11, 13 from
 * the axis at z = 10, 15, 20. One component of genus 0. */
static inline void stack_scene_branches(stack_scene *s, size_t points) {
  static const double distance[3] = {7, 11, 13};
  for (int i = 0; i < 2; i++) {
    stack_scene_slice(s, 5 * i);
    stack_scene_disc(s, 0, 0, 10, 2 * points);
  }
  for (int i = 0; i < 3; i++) {
    stack_scene_slice(s, 10 + 5 * i);
    for (int k = 0; k < 3; k++) {
      double a = 2 * SCENE_PI * k / 3 + 0.3;
      stack_scene_disc(s, distance[i] * cos(a), distance[i] * sin(a), 4, points);
    }
  }
}
/* A closed cavity: discs of radius 10 at z = 0, 4, .. 24, those but the first and last two with a hole of radius 5.
 * Two surfaces. */
static inline void stack_scene_cavity(stack_scene *s, size_t points) {
  for (int i = 0; i < 7; i++) {
    stack_scene_slice(s, 4 * i);
    stack_scene_disc(s, 0, 0, 10, points);
    if (i >= 2 && i <= 4) stack_scene_disc(s, 0, 0, 5, points);
  }
}
/* Seven columns that bulge: one in the middle, six about it. Seven components. */
static inline void stack_scene_seven(stack_scene *s, size_t count, size_t points) {
  for (size_t i = 0; i < count; i++) {
    stack_scene_slice(s, 2 * (double)i);
    double radius = 2 + 0.5 * sin(0.9 * (double)i);
    stack_scene_disc(s, 0, 0, radius, points);
    for (int k = 0; k < 6; k++)
      stack_scene_disc(s, 7 * cos(SCENE_PI * k / 3), 7 * sin(SCENE_PI * k / 3), radius, points);
  }
}
/* A slanted row: discs of a radius, each shifted by (shift, 0) from the one before. Above shift = 2 radius they do
 * not overlap: as many components as sections. */
static inline void stack_scene_shifted(stack_scene *s, size_t count, double radius, double shift, double gap,
                                       size_t points) {
  for (size_t i = 0; i < count; i++) {
    stack_scene_slice(s, gap * (double)i);
    stack_scene_disc(s, shift * (double)i, 0, radius, points);
  }
}
/* A seeded stack for trials: each slice has 1 .. 3 lobed loops side by side, the first with a hole now and then. */
static inline void stack_scene_random(stack_scene *s, uint64_t seed, size_t count, size_t points) {
  double *p = stack_scene_grow(NULL, 2 * points * sizeof *p);
  for (size_t i = 0; i < count; i++) {
    stack_scene_slice(s, (double)i + 0.4 * scene_uniform(&seed));
    size_t loops = 1 + (size_t)(3 * scene_uniform(&seed));
    for (size_t k = 0; k < loops; k++) {
      double x = 6 * (double)k + scene_uniform(&seed), y = scene_uniform(&seed), size = 1.5 + scene_uniform(&seed);
      double phase = 2 * SCENE_PI * scene_uniform(&seed), lobe = 0.3 * scene_uniform(&seed);
      for (size_t j = 0; j < points; j++) {
        double a = 2 * SCENE_PI * (double)j / (double)points, r = size * (1 + lobe * cos(3 * a + phase)) / 1.3;
        p[2 * j] = x + r * cos(a);
        p[2 * j + 1] = y + r * sin(a);
      }
      stack_scene_loop(s, points, p);
      if (k == 0 && scene_uniform(&seed) < 0.3) stack_scene_disc(s, x, y, 0.3 * size, points);
    }
  }
  free(p);
}

/* ---- a torus cut across ------------------------------------------------------------------------- */

/* The torus of radii 0.7 and 0.3 (outer radius 1) whose axis leans by `lean` (radians, in (0, pi/2]) from z towards
 * -x, cut by planes z = const. */
#define SCENE_LEAN_MAJOR 0.7
#define SCENE_LEAN_MINOR 0.3
static inline double scene_leaning_torus(double lean, const double *p) {
  double x = cos(lean) * p[0] + sin(lean) * p[2], y = p[1], z = -sin(lean) * p[0] + cos(lean) * p[2];
  return SCENE_LEAN_MINOR - hypot(hypot(x, y) - SCENE_LEAN_MAJOR, z);
}
/* Its points with the tube's angle v in the plane of a height: cos u of the ring's angle u. */
static inline double stack_scene_lean_cosine(double lean, double height, double v) {
  return (height - cos(lean) * SCENE_LEAN_MINOR * sin(v)) /
         (sin(lean) * (SCENE_LEAN_MAJOR + SCENE_LEAN_MINOR * cos(v)));
}
static inline void stack_scene_lean_point(double lean, double height, double v, double side, double *p) {
  double c = fmax(-1, fmin(1, stack_scene_lean_cosine(lean, height, v))),
         r = SCENE_LEAN_MAJOR + SCENE_LEAN_MINOR * cos(v);
  p[0] = cos(lean) * r * c - sin(lean) * SCENE_LEAN_MINOR * sin(v);
  p[1] = side * r * sqrt(1 - c * c);
}
/* One loop from a dense trace [dense][2]: its points that lie `spacing` apart, 8 at least. */
static inline void stack_scene_thin(stack_scene *s, size_t dense, double *trace, double spacing) {
  double length = 0, gone = 0;
  for (size_t i = 0; i < dense; i++) {
    const double *a = trace + 2 * i, *b = trace + 2 * ((i + 1) % dense);
    length += hypot(b[0] - a[0], b[1] - a[1]);
  }
  size_t count = (size_t)fmax(8, round(length / spacing)), made = 0;
  double last[2] = {trace[0], trace[1]};
  for (size_t i = 0; i < dense; i++) {
    double x = trace[2 * i], y = trace[2 * i + 1];
    gone += hypot(x - last[0], y - last[1]);
    last[0] = x, last[1] = y;
    if (made == count || gone < length * (double)made / (double)count) continue;
    trace[2 * made] = x, trace[2 * made + 1] = y; /* behind what is read */
    made++;
  }
  stack_scene_loop(s, made, trace);
}
static inline void stack_scene_lean_slice(stack_scene *s, double lean, double height, double spacing) {
  enum { SCAN = 4096, DENSE = 4000 };
  double *trace = stack_scene_grow(NULL, 2 * DENSE * sizeof *trace);
  int outside = -1; /* a step where no u fits */
  for (int i = 0; i < SCAN && outside < 0; i++)
    if (fabs(stack_scene_lean_cosine(lean, height, 2 * SCENE_PI * i / SCAN)) > 1) outside = i;
  stack_scene_slice(s, height);
  for (int side = -1; outside < 0 && side <= 1; side += 2) { /* the tube's whole turn, on both sides */
    for (int i = 0; i < DENSE; i++)
      stack_scene_lean_point(lean, height, 2 * SCENE_PI * i / DENSE, side, trace + 2 * i);
    stack_scene_thin(s, DENSE, trace, spacing);
  }
  double ends[2] = {0, 0};
  for (int i = outside + 1; outside >= 0 && i <= outside + SCAN; i++) {
    double a = 2 * SCENE_PI * (i - 1) / SCAN, b = 2 * SCENE_PI * i / SCAN;
    bool before = fabs(stack_scene_lean_cosine(lean, height, a)) <= 1;
    if (before == (fabs(stack_scene_lean_cosine(lean, height, b)) <= 1)) continue;
    for (int k = 0; k < 60; k++) {
      double v = (a + b) / 2;
      if ((fabs(stack_scene_lean_cosine(lean, height, v)) <= 1) == before)
        a = v;
      else
        b = v;
    }
    ends[before] = (a + b) / 2;
    if (!before) continue;
    /* both sides of the ring meet at the ends: there and back, dense where the points turn */
    for (int k = 0; k < DENSE; k++) {
      double c = cos(2 * SCENE_PI * k / DENSE), v = 0.5 * (ends[0] + ends[1]) - 0.5 * (ends[1] - ends[0]) * c;
      stack_scene_lean_point(lean, height, v, k < DENSE / 2 ? 1 : -1, trace + 2 * k);
    }
    stack_scene_thin(s, DENSE, trace, spacing);
  }
  free(trace);
}
/* In `count` slices, the outermost half a gap from the ends. */
static inline double stack_scene_lean_reach(double lean) { return SCENE_LEAN_MINOR + SCENE_LEAN_MAJOR * sin(lean); }
static inline void stack_scene_leaning_torus(stack_scene *s, double lean, size_t count, double spacing) {
  double reach = stack_scene_lean_reach(lean);
  for (size_t i = 0; i < count; i++)
    stack_scene_lean_slice(s, lean, reach * (-1 + (2 * (double)i + 1) / (double)count), spacing);
}

/* ---- the bent and twisted block ----------------------------------------------------------------- */

/* A bar whose middle line is an arc in the x-z plane from (0, 0, 0) upwards, bending towards +x about the line x =
 * radius, z = 0, while the section turns about the line. Length: radius times bend. */
typedef struct scene_block {
  double radius, bend, twist, half[2]; /* angles in radians */
} scene_block;
/* The block of figure 4: pi / 2 long, 0.5 x 0.3 across, bent and twisted by 90 degrees. */
static inline scene_block scene_block_figure4(void) {
  return (scene_block){1, SCENE_PI / 2, SCENE_PI / 2, {0.25, 0.15}};
}
static inline double scene_block_length(const scene_block *b) { return b->radius * b->bend; }
/* Frame at u in [0, 1] of the length, rows as in batten_section; omega (may be NULL): angular velocity in the frame
 * itself, by arc length. */
static inline void scene_block_frame(const scene_block *b, double u, double origin[3], double rotation[3][3],
                                     double omega[3]) {
  double a = b->bend * u, c = cos(b->twist * u), s = sin(b->twist * u);
  const double across[3] = {cos(a), 0, -sin(a)};
  origin[0] = b->radius * (1 - cos(a));
  origin[1] = 0;
  origin[2] = b->radius * sin(a);
  for (int k = 0; k < 3; k++) {
    double y = k == 1;
    rotation[0][k] = c * across[k] + s * y;
    rotation[1][k] = -s * across[k] + c * y;
  }
  rotation[2][0] = sin(a), rotation[2][1] = 0, rotation[2][2] = cos(a);
  if (omega) omega[0] = s / b->radius, omega[1] = c / b->radius, omega[2] = b->twist / scene_block_length(b);
}
/* Coordinates of a point in the moving frame, and its place u along the length. The point is nearer to the arc than
 * to the bend's axis. */
static inline double scene_block_local(const scene_block *b, const double *p, double xy[2]) {
  double r = hypot(b->radius - p[0], p[2]), u = atan2(p[2], b->radius - p[0]) / b->bend, x = b->radius - r;
  double c = cos(b->twist * u), s = sin(b->twist * u);
  xy[0] = c * x + s * p[1];
  xy[1] = -s * x + c * p[1];
  return u;
}
/* Distance in the section's plane, positive inside; the ends are left open. */
static inline double scene_block_side(const scene_block *b, const double *p) {
  double xy[2];
  scene_block_local(b, p, xy);
  double x = fabs(xy[0]) - b->half[0], y = fabs(xy[1]) - b->half[1];
  return x > 0 && y > 0 ? -hypot(x, y) : -fmax(x, y);
}
/* The same, ends flat at its first and last plane. */
static inline double scene_block_closed(const scene_block *b, const double *p) {
  double xy[2], u = scene_block_local(b, p, xy), length = scene_block_length(b);
  return fmin(scene_block_side(b, p), fmin(u, 1 - u) * length);
}
/* A point of its sides: at u of the length and v in [0, 1) around. */
static inline void scene_block_point(const scene_block *b, double u, double v, double *p) {
  double w = b->half[0], h = b->half[1], s = v * 4 * (w + h), xy[2], origin[3], m[3][3];
  if (s < 2 * w)
    xy[0] = s - w, xy[1] = -h;
  else if (s < 2 * w + 2 * h)
    xy[0] = w, xy[1] = s - 2 * w - h;
  else if (s < 4 * w + 2 * h)
    xy[0] = 3 * w + 2 * h - s, xy[1] = h;
  else
    xy[0] = -w, xy[1] = 4 * w + 3 * h - s;
  scene_block_frame(b, u, origin, m, NULL);
  for (int k = 0; k < 3; k++) p[k] = origin[k] + xy[0] * m[0][k] + xy[1] * m[1][k];
}
/* `count` sections; uneven in [0, 1): how far their places leave the even ones, seeded. side: points an edge of the
 * rectangles; 0 leaves the sections without loops (for section functions of one's own). */
static inline void stack_scene_block(stack_scene *s, const scene_block *b, size_t count, double uneven, size_t side) {
  uint64_t seed = 7;
  for (size_t i = 0; i < count; i++) {
    double u = (double)i, origin[3], rotation[3][3];
    if (i > 0 && i + 1 < count) u += uneven * (scene_uniform(&seed) - 0.5);
    scene_block_frame(b, u / (double)(count - 1), origin, rotation, NULL);
    stack_scene_section(s, origin, &rotation[0][0]);
    if (side) stack_scene_rectangle(s, b->half[0], b->half[1], side);
  }
}

#endif
