/* One volume spline in space through the centres of all sections, for planes in no sequence.
 *
 * The kernel is r^3: what lies between planes that cross is smoother with it than with r, and its error there is less
 * by a third. The sections' functions have chosen their centres; these go to space with their values: 0 on the loops,
 * the signed distance in the plane beside them. Two planes that meet disagree a little:
 *   - centres of two planes that nearly coincide become one;
 *   - a centre off the loops falls to another plane near it where that plane's loops say the other sign.
 * Shells of points far around hold f down there, as in fits of oriented points in space. */
#include "base/checked.h"
#include "base/neighbours.h"
#include "section/section_inner.h"

#include <string.h>

enum { DIRECTIONS = 32, SHELLS = 2 };
static const double SHELL_RADII[SHELLS] = {2, 4}; /* half diagonals of the points' box */
/* Centres nearer to each other than this part of the distance that one stands off the loops, or of the spacing, are
 * one. */
static const double MEET = 0.25, MEET_ON = 0.05;

typedef struct space_fit {
  batten_context *ctx;
  const stack *s;
  double pair_distance;
  bool ordered;
  size_t capacity, on, count; /* those on the surface come first */
  double *points, *values;    /* [capacity][3], [capacity] of f */
  size_t *section;            /* [capacity] */
  double *df;                 /* [capacity][2] of a section's points */
  double middle[3], radius;
  double lower[3], upper[3];
} space_fit;

static void place(const stack_section *s, const double *x, double *out) {
  for (unsigned k = 0; k < 3; k++) out[k] = s->origin[k] + x[0] * s->rotation[0][k] + x[1] * s->rotation[1][k];
}

static void add(space_fit *t, size_t section, const double *x, double value) {
  place(&t->s->sections[section], x, t->points + 3 * t->count);
  t->section[t->count] = section;
  t->values[t->count++] = value;
}

/* ---- centres of one section ---------------------------------------------------------------------- */

static batten_spline_parts parts_of(const stack_section *s) {
  batten_spline_parts parts;
  batten_spline_get_parts(batten_solid_spline(s->function), &parts);
  return parts;
}

static void add_on(space_fit *t, size_t i) {
  const stack_section *s = &t->s->sections[i];
  size_t count = s->apex_count;
  const double *x = count ? s->apex[0] : batten_solid_points(s->function, &count);
  for (size_t j = 0; j < count; j++) add(t, i, x + 2 * j, 0);
}

/* Those of the function's centres that are neither on the loops nor far around. */
static void add_off(space_fit *t, size_t i) {
  const stack_section *s = &t->s->sections[i];
  const polygon_set *p = &s->loops;
  const batten_spline_parts parts = parts_of(s);
  const double near = 0.5 * hypot(p->upper[0] - p->lower[0], p->upper[1] - p->lower[1]);
  for (size_t j = 0; j < parts.count; j++) {
    const double *x = parts.centers + 2 * j;
    double distance = polygon_distance(p, x, NULL, NULL);
    double from = hypot(x[0] - 0.5 * (p->lower[0] + p->upper[0]), x[1] - 0.5 * (p->lower[1] + p->upper[1]));
    if (from < 1.99 * near && fabs(distance) > 1e-9 * near) add(t, i, x, distance);
  }
}

/* Sections of points in no order: pairs along the gradient of their function. */
static batten_status add_pairs(space_fit *t, size_t i) {
  const batten_solid *function = t->s->sections[i].function;
  size_t count, nearest;
  const double *x = batten_solid_points(function, &count);
  batten_tree *tree = NULL;
  batten_status st = batten_tree_new(t->ctx, 2, count, x, &tree);
  if (st >= 0) st = batten_solid_evaluate(t->ctx, function, count, x, NULL, t->df, NULL);
  for (size_t j = 0; st >= 0 && j < count; j++) {
    double apart, length = hypot(t->df[2 * j], t->df[2 * j + 1]);
    if (!batten_tree_nearest(tree, x + 2 * j, 1, j, &nearest, &apart) || !(length > 0)) continue;
    for (int side = -1; side <= 1; side += 2) {
      double offset = side * t->pair_distance * apart, y[2], back;
      for (unsigned k = 0; k < 2; k++) y[k] = x[2 * j + k] + offset / length * t->df[2 * j + k];
      batten_tree_nearest(tree, y, 1, SIZE_MAX, &nearest, &back);
      if (nearest == j) add(t, i, y, offset);
    }
  }
  batten_tree_free(t->ctx, tree);
  return st;
}

/* ---- all of them --------------------------------------------------------------------------------- */

static batten_status open_fit(space_fit *t) {
  size_t room = DIRECTIONS * SHELLS;
  for (size_t i = 0; i < t->s->count; i++) {
    const stack_section *s = &t->s->sections[i];
    size_t on = s->apex_count;
    if (!on) batten_solid_points(s->function, &on); /* a function may have fewer centres than points, or more */
    room += on;
    if (!s->apex_count) room += t->ordered ? parts_of(s).count : 2 * on; /* of points in no order: pairs */
  }
  t->capacity = room;
  t->points = batten_alloc_array(t->ctx, room, 3 * sizeof *t->points);
  t->values = batten_alloc_array(t->ctx, room, sizeof *t->values);
  t->section = batten_alloc_array(t->ctx, room, sizeof *t->section);
  t->df = batten_alloc_array(t->ctx, room, 2 * sizeof *t->df);
  return t->points && t->values && t->section && t->df ? BATTEN_OK : BATTEN_E_NOMEM;
}

static void close_fit(space_fit *t) {
  batten_free(t->ctx, t->points);
  batten_free(t->ctx, t->values);
  batten_free(t->ctx, t->section);
  batten_free(t->ctx, t->df);
}

static batten_status collect(space_fit *t) {
  batten_status st = BATTEN_OK;
  for (size_t i = 0; i < t->s->count; i++) add_on(t, i);
  t->on = t->count;
  for (size_t i = 0; st >= 0 && i < t->s->count; i++) {
    if (t->s->sections[i].apex_count) continue;
    if (t->ordered)
      add_off(t, i);
    else
      st = add_pairs(t, i);
  }
  return st;
}

/* Does another plane near centre i have it on the other side of its loops, by more than the plane is off? */
static bool contradicted(const space_fit *t, size_t i) {
  const double *x = t->points + 3 * i, value = t->values[i];
  for (size_t j = 0; j < t->s->count; j++) {
    const stack_section *s = &t->s->sections[j];
    double local[3] = {0, 0, 0};
    if (j == t->section[i] || !s->loops.count) continue;
    for (unsigned a = 0; a < 3; a++)
      for (unsigned k = 0; k < 3; k++) local[a] += s->rotation[a][k] * (x[k] - s->origin[k]);
    if (fabs(local[2]) > 0.5 * fabs(value)) continue;
    double there = polygon_distance(&s->loops, local, NULL, NULL);
    if (there * value < 0 && fabs(there) > fabs(local[2])) return true;
  }
  return false;
}

/* Of centres that nearly coincide the first stays: those on the surface go before the others. */
static batten_status drop_meeting(space_fit *t) {
  size_t kept = 0, kept_on = 0;
  batten_tree *tree = NULL;
  size_t *near = batten_alloc_array(t->ctx, t->count, sizeof *near);
  unsigned char *gone = batten_alloc_array(t->ctx, t->count, 1);
  batten_status st = near && gone ? batten_tree_new(t->ctx, 3, t->count, t->points, &tree) : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  for (size_t i = 0; i < t->count; i++) {
    const double reach = i < t->on ? MEET_ON * t->s->spacing : MEET * fabs(t->values[i]);
    size_t found = batten_tree_within(tree, t->points + 3 * i, reach, near);
    gone[i] = i >= t->on && contradicted(t, i);
    /* Of its own section's centres each is needed: pairs of thin parts are close. */
    for (size_t j = 0; j < found; j++)
      gone[i] |= near[j] < i && !gone[near[j]] && t->section[near[j]] != t->section[i];
  }
  for (size_t i = 0; i < t->count; i++) {
    if (gone[i]) continue;
    memmove(t->points + 3 * kept, t->points + 3 * i, 3 * sizeof *t->points);
    t->values[kept] = t->values[i];
    kept++;
    kept_on += i < t->on;
  }
  t->count = kept;
  t->on = kept_on;
done:
  batten_tree_free(t->ctx, tree);
  batten_free(t->ctx, near);
  batten_free(t->ctx, gone);
  return st;
}

static void measure_box(space_fit *t) {
  double square = 0;
  for (unsigned k = 0; k < 3; k++) {
    t->lower[k] = INFINITY;
    t->upper[k] = -INFINITY;
    for (size_t i = 0; i < t->on; i++) {
      t->lower[k] = fmin(t->lower[k], t->points[3 * i + k]);
      t->upper[k] = fmax(t->upper[k], t->points[3 * i + k]);
    }
    t->middle[k] = t->lower[k] + 0.5 * (t->upper[k] - t->lower[k]);
    square += (t->upper[k] - t->lower[k]) * (t->upper[k] - t->lower[k]);
  }
  t->radius = 0.5 * sqrt(square);
}

/* f falls a little faster than the distance grows: the spline contains quadratics, which then go on downwards. */
static batten_status add_far(space_fit *t) {
  batten_tree *tree = NULL;
  batten_status st = batten_tree_new(t->ctx, 3, t->on, t->points, &tree);
  for (unsigned i = 0; st >= 0 && i < DIRECTIONS * SHELLS; i++) {
    unsigned at = i % DIRECTIONS;
    double radius = SHELL_RADII[i / DIRECTIONS] * t->radius, distance;
    double z = 1 - (2 * (double)at + 1) / DIRECTIONS, r = sqrt(1 - z * z), angle = 2.399963229728653 * at;
    double *x = t->points + 3 * t->count, v[3] = {r * cos(angle), r * sin(angle), z};
    size_t nearest;
    for (unsigned k = 0; k < 3; k++) x[k] = t->middle[k] + radius * v[k];
    batten_tree_nearest(tree, x, 1, SIZE_MAX, &nearest, &distance);
    t->values[t->count++] = -distance * (1 + distance / (2 * t->radius));
  }
  batten_tree_free(t->ctx, tree);
  return st;
}

static batten_status fit_spline(space_fit *t, batten_solid **out) {
  batten_spline_data data = batten_spline_data_default();
  batten_spline_options options = batten_spline_options_default();
  batten_spline *spline = NULL;
  batten_carrier *none = NULL;
  for (size_t i = 0; i < t->count; i++) t->values[i] = -t->values[i]; /* a solid is minus its spline */
  data.n = 3;
  data.count = t->count;
  data.points = t->points;
  data.values = t->values;
  options.m = 3;
  options.loo_samples = 0;
  batten_status st = batten_spline_fit(t->ctx, &data, &options, &spline, NULL), made = st;
  if (made >= 0) made = batten_carrier_none(t->ctx, 3, &none);
  if (made >= 0) made = batten_solid_create(t->ctx, spline, none, 1, t->lower, t->upper, t->on, t->points, out);
  batten_carrier_free(none);
  batten_spline_free(spline);
  return made < 0 ? made : st;
}

batten_status stack_fit_space(batten_context *ctx, const stack *s, bool ordered, double pair_distance,
                              batten_solid **out, size_t *centers) {
  space_fit t = {.ctx = ctx, .s = s, .ordered = ordered, .pair_distance = pair_distance};
  batten_status st = open_fit(&t);
  if (st >= 0) st = collect(&t);
  if (st >= 0) st = drop_meeting(&t);
  if (st >= 0) {
    measure_box(&t);
    st = add_far(&t);
  }
  if (st >= 0) st = fit_spline(&t, out);
  if (st >= 0) *centers = t.count;
  close_fit(&t);
  return st;
}
