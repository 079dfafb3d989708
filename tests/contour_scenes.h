/* Points on planar curves of known inflections and signs of curvature: what shape-preserving curves are tried on.
 * Shared by tests, benchmarks and examples. The same numbers everywhere with the same mathematical library.
 *
 *   contour_scene s = contour_scene_make(&(contour_rule){.kind = CONTOUR_WAVE, .count = 100, .inflections = 2});
 *   contour_scene_free(&s);
 *
 * A curve is a table of CONTOUR_TABLE steps, most of them made by integrating a tangent angle whose derivative has
 * the wanted signs; its inflections are read from the turns of the table itself, so that they are right whatever the
 * kind. Points lie at even or uneven steps of arc length, and may be disturbed and turned. */
#ifndef CONTOUR_SCENES_H
#define CONTOUR_SCENES_H

#include <stdlib.h>
#include <string.h>

#include "scenes.h"

typedef enum contour_kind {
  CONTOUR_WAVE = 0,     /* random, open, 0 .. 6 inflections as asked for */
  CONTOUR_LOOP,         /* random, closed, 0, 2, 4, 6 inflections */
  CONTOUR_SPIRAL,       /* Archimedean, 1 to 3 turns */
  CONTOUR_CIRCLE,       /* closed */
  CONTOUR_ELLIPSE,      /* closed, axes 1 and 0.2 .. 0.9 */
  CONTOUR_SUPERELLIPSE, /* closed, |x|^p + |y|^p = 1, p 2.5 .. 5: nearly straight sides */
  CONTOUR_FRAME,        /* of a ship: flat bottom, bilge, flat side; 1 inflection where asked for: flare */
  CONTOUR_AIRFOIL,      /* NACA of 4 digits, trailing edge, upper side, nose, lower side; 0, 1, 2 inflections */
  CONTOUR_SINE,         /* cosine, 0 .. 6 inflections as asked for */
  CONTOUR_S,            /* two arcs of circles: curvature jumps at the inflection */
  CONTOUR_BEND,         /* straight, a bend, straight */
  CONTOUR_KINDS
} contour_kind;

enum { CONTOUR_TABLE = 16384, CONTOUR_INFLECTIONS_MAX = 16 };

typedef struct contour_rule {
  contour_kind kind;
  size_t count;
  size_t inflections; /* where the kind has a choice */
  bool mirrored;      /* all signs the other way */
  bool uneven;        /* steps between a tenth and almost twice the mean */
  double noise;       /* standard deviation of each coordinate, in units of the larger side of the curve's box */
  bool turned;        /* by a rotation that the seed gives, and moved */
  uint64_t seed;      /* of the curve's form, the steps and the noise */
} contour_rule;

typedef struct contour_scene {
  size_t count;
  double *points;  /* [count][2]; closed: the first one is not repeated */
  double *truth;   /* [count][2] without noise */
  double *lengths; /* [count] from the start, as parts of the whole */
  size_t inflection_count;
  double inflections[CONTOUR_INFLECTIONS_MAX]; /* ascending, as parts of the whole length */
  int sign;                                    /* of curvature at the start */
  bool closed;
  double size; /* larger side of the box */
} contour_scene;

static inline void contour_scene_free(contour_scene *s) {
  free(s->points);
  free(s->truth);
  free(s->lengths);
  memset(s, 0, sizeof *s);
}

static inline void *contour_scene_allocate(size_t count) {
  void *p = malloc(count * sizeof(double) + 1);
  if (!p) abort(); /* scenes are small, and nothing can be tested without them */
  return p;
}

static inline bool contour_scene_closed(const contour_rule *r) {
  return r->kind == CONTOUR_LOOP || r->kind == CONTOUR_CIRCLE || r->kind == CONTOUR_ELLIPSE ||
         r->kind == CONTOUR_SUPERELLIPSE;
}

/* Standard normal. */
static inline double contour_scene_normal(uint64_t *state) {
  double radius = sqrt(-2 * log(1 - scene_uniform(state)));
  return radius * cos(2 * SCENE_PI * scene_uniform(state));
}

/* ---- curves as tables [CONTOUR_TABLE + 1][2] -------------------------------------------------------- */

/* A run of one sign turns by `turn` between parts from, to of the length, like a sine between zeros, or (half) like a
 * sine from its peak at from to zero at to (from > to: the other way round). */
typedef struct contour_arc {
  double from, to, turn;
  bool half, constant;
} contour_arc;

static inline double contour_arc_curvature(const contour_arc *a, double s) {
  double part = (s - a->from) / (a->to - a->from), length = fabs(a->to - a->from);
  if (part < 0 || part > 1) return 0;
  if (a->constant) return a->turn / length;
  double angle = SCENE_PI * (a->half ? 0.5 + part / 2 : part);
  return a->turn * SCENE_PI / (2 * length) * sin(angle);
}

static inline void contour_integrate(size_t arcs, const contour_arc *arc, double *table) {
  double angle = 0, h = 1.0 / CONTOUR_TABLE;
  table[0] = table[1] = 0;
  for (size_t i = 0; i < CONTOUR_TABLE; i++) {
    double curvature = 0, s = ((double)i + 0.5) * h;
    for (size_t k = 0; k < arcs; k++) curvature += contour_arc_curvature(&arc[k], s);
    table[2 * i + 2] = table[2 * i] + h * cos(angle + curvature * h / 2);
    table[2 * i + 3] = table[2 * i + 1] + h * sin(angle + curvature * h / 2);
    angle += curvature * h;
  }
}

/* inflections + 1 runs of uneven lengths, each turning by 0.6 to 2.4. */
static inline void contour_wave(size_t inflections, uint64_t *state, double *table) {
  contour_arc arc[CONTOUR_INFLECTIONS_MAX + 1];
  double at[CONTOUR_INFLECTIONS_MAX + 2] = {0};
  size_t runs = inflections + 1;
  for (size_t i = 0; i < runs; i++) at[i + 1] = at[i] + 0.5 + scene_uniform(state);
  for (size_t i = 0; i < runs; i++) {
    double turn = (i % 2 ? -1 : 1) * (0.6 + 1.8 * scene_uniform(state));
    bool first = i == 0, last = i + 1 == runs;
    arc[i] = (contour_arc){at[i] / at[runs], at[i + 1] / at[runs], turn, false, false};
    if (first && last)
      arc[i].constant = true;
    else if (first)
      arc[i] = (contour_arc){0, at[1] / at[runs], turn, true, false};
    else if (last)
      arc[i] = (contour_arc){1, at[i] / at[runs], turn, true, false};
  }
  contour_integrate(runs, arc, table);
}

/* r = 1 + a cos(m phi), stretched: m = inflections / 2 dents where a > 1 / (1 + m^2) (m = 1: 0.5). */
static inline void contour_loop(size_t inflections, uint64_t *state, double *table) {
  size_t m = inflections >= 2 ? inflections / 2 : 3;
  double least = 1 / (1 + (double)(m * m)), a = inflections < 2 ? 0.07 * scene_uniform(state)
                                                : m == 1        ? 0.6 + 0.1 * scene_uniform(state)
                                                                : (1.5 + scene_uniform(state)) * least;
  double start = scene_uniform(state), stretch = 0.6 + 0.4 * scene_uniform(state), shear = scene_uniform(state) - 0.5;
  for (size_t i = 0; i <= CONTOUR_TABLE; i++) {
    double phi = 2 * SCENE_PI * (start + (double)(i % CONTOUR_TABLE) / CONTOUR_TABLE);
    double r = 1 + a * cos((double)m * phi), x = r * cos(phi), y = stretch * r * sin(phi);
    table[2 * i] = x + shear * y;
    table[2 * i + 1] = y;
  }
}

/* Height of a section table's mean line and half thickness at x. */
static inline void contour_naca(double camber, double at, double thick, double x, double *mean, double *half) {
  double p = x < at ? at : 1 - at;
  *mean = camber / (p * p) * (x < at ? 2 * at * x - x * x : 1 - 2 * at + 2 * at * x - x * x);
  *half = 5 * thick * (0.2969 * sqrt(x) + x * (-0.1260 + x * (-0.3516 + x * (0.2843 - 0.1015 * x))));
}

static inline void contour_explicit(const contour_rule *r, uint64_t *state, double *table) {
  double u = scene_uniform(state), v = scene_uniform(state), w = scene_uniform(state);
  for (size_t i = 0; i <= CONTOUR_TABLE; i++) {
    double *p = table + 2 * i, s = (double)i / CONTOUR_TABLE, mean, half, radius, phi;
    if (contour_scene_closed(r) && i == CONTOUR_TABLE) s = 0;
    switch (r->kind) {
      case CONTOUR_SPIRAL:
        phi = 2 * SCENE_PI * (1 + 2 * u) * s;
        radius = 0.15 + 0.2 * v + (0.05 + 0.1 * w) * phi;
        p[0] = radius * cos(phi);
        p[1] = radius * sin(phi);
        break;
      case CONTOUR_CIRCLE:
      case CONTOUR_ELLIPSE:
        phi = 2 * SCENE_PI * (u + s);
        p[0] = cos(phi);
        p[1] = (r->kind == CONTOUR_CIRCLE ? 1 : 0.2 + 0.7 * v) * sin(phi);
        break;
      case CONTOUR_SUPERELLIPSE:
        phi = 2 * SCENE_PI * (u + s);
        radius = pow(pow(fabs(cos(phi)), 2.5 + 2.5 * v) + pow(fabs(sin(phi)), 2.5 + 2.5 * v), -1 / (2.5 + 2.5 * v));
        p[0] = radius * cos(phi);
        p[1] = (0.5 + 0.5 * w) * radius * sin(phi);
        break;
      case CONTOUR_AIRFOIL:
        p[0] = cos(SCENE_PI * s) * cos(SCENE_PI * s);
        contour_naca(r->inflections ? 0.04 + 0.02 * u : 0.02 * u, 0.4, 0.09 + 0.05 * v, p[0], &mean, &half);
        p[1] = s < 0.5 ? mean + half : mean - half;
        break;
      default: /* sine */
        p[0] = s * (1 + (double)r->inflections);
        p[1] = -(0.2 + 0.4 * u) * cos(SCENE_PI * (double)r->inflections * s);
        if (!r->inflections) p[1] = (0.2 + 0.4 * u) * (s - 0.5) * (s - 0.5);
        break;
    }
  }
}

static inline void contour_curve(const contour_rule *r, uint64_t *state, double *table) {
  double u, v;
  contour_arc arc[3];
  switch (r->kind) {
    case CONTOUR_WAVE:
      contour_wave(r->inflections, state, table);
      return;
    case CONTOUR_LOOP:
      contour_loop(r->inflections, state, table);
      return;
    case CONTOUR_FRAME:
      u = 0.25 + 0.25 * scene_uniform(state);
      v = u + 0.15 + 0.15 * scene_uniform(state);
      arc[0] = (contour_arc){u, v, 1.2 + 0.4 * scene_uniform(state), false, false};
      arc[1] = (contour_arc){v, 1, -0.3 - 0.5 * scene_uniform(state), false, false};
      contour_integrate(r->inflections ? 2 : 1, arc, table);
      return;
    case CONTOUR_S:
      u = 0.35 + 0.3 * scene_uniform(state);
      arc[0] = (contour_arc){0, u, 0.8 + 2 * scene_uniform(state), false, true};
      arc[1] = (contour_arc){u, 1, -0.8 - 2 * scene_uniform(state), false, true};
      contour_integrate(2, arc, table);
      return;
    case CONTOUR_BEND:
      u = 0.3 + 0.3 * scene_uniform(state);
      arc[0] =
          (contour_arc){u, u + 0.05 + 0.2 * scene_uniform(state), 0.3 + 1.5 * scene_uniform(state), false, false};
      contour_integrate(1, arc, table);
      return;
    default:
      contour_explicit(r, state, table);
      return;
  }
}

/* ---- points on them --------------------------------------------------------------------------------- */

/* Turn of the table at its point i, sign only; 0 where it is straight to rounding. */
static inline double contour_table_turn(const double *table, size_t i, bool closed) {
  const double *b = table + 2 * i, *a = b - 2, *c = b + 2;
  if (i == 0) a = table + 2 * (CONTOUR_TABLE - 1);
  if (i == 0 && !closed) return 0;
  double u[2] = {b[0] - a[0], b[1] - a[1]}, v[2] = {c[0] - b[0], c[1] - b[1]};
  double hu = hypot(u[0], u[1]), hv = hypot(v[0], v[1]), turn = (u[0] * v[1] - u[1] * v[0]) / (hu * hv);
  return fabs(turn) < 1e-9 + 1e-14 / fmin(hu, hv) ? 0 : turn;
}

/* Changes of sign of the turns; a straight piece between counts in its middle. */
static inline void contour_find_inflections(contour_scene *s, const double *table, const double *length) {
  double last = 0, last_at = 0, first = 0, first_at = 0, whole = length[CONTOUR_TABLE];
  for (size_t i = 0; i < CONTOUR_TABLE; i++) {
    double turn = contour_table_turn(table, i, s->closed), at = length[i] / whole;
    if (turn == 0) continue;
    if (first == 0) {
      first = turn;
      first_at = at;
    }
    bool next = (at - last_at) * CONTOUR_TABLE < 8; /* no straight piece: where the turn vanishes */
    if (last * turn < 0 && s->inflection_count < CONTOUR_INFLECTIONS_MAX)
      s->inflections[s->inflection_count++] = last_at + (at - last_at) * (next ? last / (last - turn) : 0.5);
    last = turn;
    last_at = at;
  }
  s->sign = first < 0 ? -1 : 1;
  if (s->closed && last * first < 0 && s->inflection_count < CONTOUR_INFLECTIONS_MAX) {
    double at = last_at + (1 + first_at - last_at) / 2;
    if (at < 1) {
      s->inflections[s->inflection_count++] = at;
    } else { /* the first run begins after the start */
      memmove(s->inflections + 1, s->inflections, s->inflection_count * sizeof *s->inflections);
      s->inflections[0] = at - 1;
      s->inflection_count++;
      s->sign = -s->sign;
    }
  }
}

static inline void contour_find_points(const contour_rule *r, contour_scene *s, const double *table,
                                       const double *length, uint64_t *state) {
  size_t steps = s->closed ? r->count : r->count - 1, k = 0;
  double at = 0, whole = 0;
  for (size_t i = 0; i < r->count; i++) { /* the step after point i */
    s->lengths[i] = at;
    at += r->uneven ? 0.1 + 1.8 * scene_uniform(state) : 1;
    if (i + 1 == steps) whole = at;
  }
  for (size_t i = 0; i < r->count; i++) {
    s->lengths[i] = fmin(1, s->lengths[i] / whole);
    double l = s->lengths[i] * length[CONTOUR_TABLE];
    while (k + 1 < CONTOUR_TABLE && length[k + 1] < l) k++;
    double part = (l - length[k]) / (length[k + 1] - length[k]);
    for (size_t c = 0; c < 2; c++) {
      s->truth[2 * i + c] = (1 - part) * table[2 * k + c] + part * table[2 * k + 2 + c];
      s->points[2 * i + c] = s->truth[2 * i + c] + r->noise * s->size * contour_scene_normal(state);
    }
  }
}

/* count >= 3 points. */
static inline contour_scene contour_scene_make(const contour_rule *r) {
  uint64_t state = r->seed ^ 0x2545f4914f6cdd1du;
  contour_scene s = {.count = r->count, .closed = contour_scene_closed(r)};
  double *table = contour_scene_allocate(2 * CONTOUR_TABLE + 2), *length = contour_scene_allocate(CONTOUR_TABLE + 1);
  double lower[2] = {INFINITY, INFINITY}, upper[2] = {-INFINITY, -INFINITY};
  s.points = contour_scene_allocate(2 * r->count);
  s.truth = contour_scene_allocate(2 * r->count);
  s.lengths = contour_scene_allocate(r->count);
  contour_curve(r, &state, table);
  double angle = r->turned ? 2 * SCENE_PI * scene_uniform(&state) : 0, c = cos(angle), sn = sin(angle);
  double move[2] = {r->turned ? 10 * scene_uniform(&state) - 5 : 0, r->turned ? 10 * scene_uniform(&state) - 5 : 0};
  length[0] = 0;
  for (size_t i = 0; i <= CONTOUR_TABLE; i++) {
    double *p = table + 2 * i, x = p[0], y = r->mirrored ? -p[1] : p[1];
    p[0] = c * x - sn * y + move[0];
    p[1] = sn * x + c * y + move[1];
    if (i) length[i] = length[i - 1] + hypot(p[0] - p[-2], p[1] - p[-1]);
    for (size_t k = 0; k < 2; k++) {
      lower[k] = fmin(lower[k], p[k]);
      upper[k] = fmax(upper[k], p[k]);
    }
  }
  s.size = fmax(upper[0] - lower[0], upper[1] - lower[1]);
  contour_find_inflections(&s, table, length);
  contour_find_points(r, &s, table, length, &state);
  free(table);
  free(length);
  return s;
}

/* A random one: any kind, 20 to 2,000 points, noise up to 5 %, 0 to 6 inflections. */
static inline contour_rule contour_rule_random(uint64_t seed) {
  uint64_t state = seed ^ 0x5851f42d4c957f2du;
  contour_rule r = {.seed = seed, .turned = true};
  double kind = scene_uniform(&state);
  /* Half of them the random kinds. */
  r.kind = kind < 0.35  ? CONTOUR_WAVE
           : kind < 0.5 ? CONTOUR_LOOP
                        : (contour_kind)(CONTOUR_SPIRAL + (int)((kind - 0.5) * 2 * (CONTOUR_KINDS - CONTOUR_SPIRAL)));
  r.count = (size_t)(20 * pow(100, scene_uniform(&state)));
  r.inflections = (size_t)(7 * scene_uniform(&state));
  if (r.kind == CONTOUR_LOOP) r.inflections -= r.inflections % 2;
  if (r.kind == CONTOUR_FRAME || r.kind == CONTOUR_AIRFOIL) r.inflections %= 2;
  r.mirrored = scene_uniform(&state) < 0.5;
  r.uneven = scene_uniform(&state) < 0.5;
  r.noise = scene_uniform(&state) < 0.2 ? 0 : 0.05 * scene_uniform(&state);
  return r;
}

/* ---- the paper's experiment ------------------------------------------------------------------------- */

/* Two sets of eight sections of a ship, 296 points together, as in figure 2 of the paper, whose points are not to be
 * had: the bilge turns left, the flare above it right; aft there is a hollow below the bilge. number 0 .. 7 goes from
 * the middle of the ship to its end. Errors are a hundredth of the size, less at the ends; lengths are those without.
 */
enum { CONTOUR_SECTIONS = 8 };

static inline contour_scene contour_section(bool aft, size_t number) {
  const double degree = SCENE_PI / 180, part = (double)number / (CONTOUR_SECTIONS - 1);
  const double low = aft ? 0.34 + 0.1 * part : 0.68 - 0.15 * part;
  const contour_arc fore_arcs[] = {{0, low, (78 - 30 * part) * degree, false, false},
                                   {1, low, -(10 + 38 * part) * degree, true, false}};
  const contour_arc aft_arcs[] = {{0, low, -(24 + 30 * part) * degree, true, false},
                                  {low, 0.78, (84 + 6 * part) * degree, false, false},
                                  {1, 0.78, -(14 + 12 * part) * degree, true, false}};
  const double turn = (aft ? 28 + 40 * part : 6 + 52 * part) * degree, length = 1.25 - 0.3 * part;
  uint64_t state = (aft ? 11u : 7u) + 1000 * (uint64_t)number;
  contour_scene s = {.count = 18 + number % 2, .inflection_count = aft ? 2 : 1, .sign = aft ? -1 : 1, .size = length};
  double *table = contour_scene_allocate(2 * CONTOUR_TABLE + 2);
  s.points = contour_scene_allocate(2 * s.count);
  s.truth = contour_scene_allocate(2 * s.count);
  s.lengths = contour_scene_allocate(s.count);
  s.inflections[0] = low;
  s.inflections[1] = aft ? 0.78 : 0;
  contour_integrate(aft ? 3 : 2, aft ? aft_arcs : fore_arcs, table);
  for (size_t i = 0; i < s.count; i++) {
    double t = (double)i / (double)(s.count - 1), noise = i == 0 || i == s.count - 1 ? 0.004 : 0.01;
    const double *p = table + 2 * (size_t)(t * CONTOUR_TABLE + 0.5);
    s.lengths[i] = t;
    s.truth[2 * i] = length * (cos(turn) * p[0] - sin(turn) * p[1]) + (1 - part) * (aft ? 0.15 : 0.25);
    s.truth[2 * i + 1] = length * (sin(turn) * p[0] + cos(turn) * p[1]) + 0.1 * part * part;
    for (size_t k = 0; k < 2; k++) s.points[2 * i + k] = s.truth[2 * i + k] + noise * contour_scene_normal(&state);
  }
  free(table);
  return s;
}

#endif
