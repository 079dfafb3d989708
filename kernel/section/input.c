/* Sections as they come: what makes no sense is refused with its place, frames are made orthonormal, loops oriented,
 * and what follows from all of them is settled: parallel or not, the parameters t, the gaps, and lengths that are
 * given in gaps.
 *
 * What may not be, is asked of places rather than of angles: planes coincide when the points of a section lie on the
 * plane of the one before; two sections are out of order when each lies as a whole on the wrong side of the other's
 * plane. Planes that cross within sections pass here: crossings.c finds them. */
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "base/neighbours.h"
#include "basis/quantile.h"
#include "mesh/vec.h"
#include "section/path.h"
#include "section/rotations.h"

/* Above it the squares of distances overflow. */
static const double COORDINATE_MAX = 1e150;
/* How far rows may be from orthonormal. */
static const double FRAME_TOLERANCE = 1e-6;
/* Relative to the axes' length: frames are parallel; relative to the stack's size: planes coincide. */
static const double PARALLEL_TOLERANCE = 1e-9, COINCIDE_TOLERANCE = 1e-9;
/* Of the median distance of points; of the largest section; of the sections' mean size. */
static const double TOLERANCE_OF_SPACING = 0.1, TOLERANCE_OF_SIZE = 1e-4, TOLERANCE_OF_MEAN = 1e-3;

typedef struct taking {
  batten_context *ctx;
  size_t count;
  const batten_section *given;
  const batten_stack_options *opt;
  stack *s;
  stack_notes *notes;
  double min_area, size; /* the largest distance between two places, about */
} taking;

/* ---- notes --------------------------------------------------------------------------------------- */

batten_status stack_note_add(stack_notes *notes, batten_stack_note note) {
  if (notes->count == notes->capacity) {
    size_t more = notes->capacity ? 2 * notes->capacity : 16;
    batten_stack_note *items = batten_realloc_array(notes->ctx, notes->items, more, sizeof *items);
    if (!items) return BATTEN_E_NOMEM;
    notes->items = items;
    notes->capacity = more;
  }
  notes->items[notes->count++] = note;
  return BATTEN_OK;
}

/* ---- each section for itself --------------------------------------------------------------------- */

static size_t point_count(const batten_section *g) { return g->starts[g->contour_count] - g->starts[0]; }

static batten_status check_numbers(batten_context *ctx, size_t i, const batten_section *g) {
  for (size_t k = 0; k < 3; k++)
    if (!(fabs(g->origin[k]) < COORDINATE_MAX))
      return batten_fail(ctx, BATTEN_E_INVALID, "sections[%zu].origin[%zu]: %g; give finite numbers below 1e150", i,
                         k, g->origin[k]);
  double defect = rotation_defect(&g->rotation[0][0]);
  if (!(defect <= FRAME_TOLERANCE))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "sections[%zu].rotation: not a rotation, off by %.3g; rows must be orthonormal to 1e-6 and "
                       "right-handed",
                       i, defect);
  for (size_t k = g->starts[0]; k < g->starts[g->contour_count]; k++)
    for (size_t d = 0; d < 2; d++)
      if (!(fabs(g->points[2 * k + d]) < COORDINATE_MAX))
        return batten_fail(ctx, BATTEN_E_INVALID,
                           "sections[%zu].points[%zu]: coordinate %zu is %g; give finite numbers below 1e150", i, k,
                           d, g->points[2 * k + d]);
  return BATTEN_OK;
}

static batten_status check_section(batten_context *ctx, size_t i, const batten_section *g) {
  if (g->contour_count == 0)
    return batten_fail(ctx, BATTEN_E_INVALID, "sections[%zu].contour_count: 0; give a contour, or leave it out", i);
  if (!g->starts || !g->points)
    return batten_fail(ctx, BATTEN_E_INVALID, "sections[%zu].%s: NULL; give its contours", i,
                       g->starts ? "points" : "starts");
  for (size_t k = 0; k < g->contour_count; k++)
    if (g->starts[k + 1] < g->starts[k])
      return batten_fail(ctx, BATTEN_E_INVALID, "sections[%zu].starts[%zu]: %zu after %zu; must not decrease", i,
                         k + 1, g->starts[k + 1], g->starts[k]);
  return check_numbers(ctx, i, g);
}

/* ---- spacing ------------------------------------------------------------------------------------- */

/* Distances between neighbouring points along the contours of a section, ends joined; 0 counts for nothing. */
static void edge_samples(const batten_section *g, weighted_sample *samples) {
  for (size_t k = 0; k < g->contour_count; k++)
    for (size_t i = g->starts[k]; i < g->starts[k + 1]; i++) {
      const double *a = g->points + 2 * i, *b = g->points + 2 * (i + 1 < g->starts[k + 1] ? i + 1 : g->starts[k]);
      double length = hypot(b[0] - a[0], b[1] - a[1]);
      samples[i - g->starts[0]] = (weighted_sample){length, length > 0 ? 1 : 0};
    }
}

/* Distances to the nearest other point. */
static batten_status neighbour_samples(batten_context *ctx, const batten_section *g, weighted_sample *samples) {
  size_t count = point_count(g);
  for (size_t i = 0; i < count; i++) samples[i] = (weighted_sample){0, 0};
  if (count < 2) return BATTEN_OK;
  size_t *index = batten_alloc_array(ctx, count, sizeof *index);
  double *distance = batten_alloc_array(ctx, count, sizeof *distance);
  batten_status st = index && distance ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0) st = batten_neighbours(ctx, 2, count, g->points + 2 * g->starts[0], 1, index, distance);
  for (size_t i = 0; st >= 0 && i < count; i++) samples[i] = (weighted_sample){distance[i], distance[i] > 0 ? 1 : 0};
  batten_free(ctx, index);
  batten_free(ctx, distance);
  return st;
}

static batten_status settle_spacing(taking *t) {
  size_t total = 0, at = 0;
  for (size_t i = 0; i < t->count; i++)
    if (!batten_add(total, point_count(&t->given[i]), &total))
      return batten_fail(t->ctx, BATTEN_E_TOO_LARGE, "sections: too many points");
  weighted_sample *samples = batten_alloc_array(t->ctx, total, sizeof *samples);
  if (!samples) return BATTEN_E_NOMEM;
  batten_status st = BATTEN_OK;
  for (size_t i = 0; st >= 0 && i < t->count; i++) {
    if (t->opt->method == BATTEN_SECTION_PAIRS)
      edge_samples(&t->given[i], samples + at);
    else
      st = neighbour_samples(t->ctx, &t->given[i], samples + at);
    at += point_count(&t->given[i]);
  }
  double spacing = weighted_quantile(total, samples, 0.5);
  t->s->spacing = spacing > 0 ? spacing : 0; /* NaN: not one edge */
  t->min_area = t->opt->min_area > 0 ? t->opt->min_area : t->s->spacing * t->s->spacing / 4;
  batten_free(t->ctx, samples);
  return st;
}

/* ---- loops --------------------------------------------------------------------------------------- */

/* A section of one contour that has but one or two places. */
static bool take_apex(const batten_section *g, stack_section *out) {
  if (g->contour_count != 1) return false;
  unsigned made = 0;
  for (size_t i = g->starts[0]; i < g->starts[1]; i++) {
    const double *x = g->points + 2 * i;
    bool known = false;
    for (unsigned k = 0; k < made; k++) known = known || (out->apex[k][0] == x[0] && out->apex[k][1] == x[1]);
    if (known) continue;
    if (made == 2) return false;
    memcpy(out->apex[made++], x, sizeof out->apex[0]);
  }
  if (made == 0) return false;
  out->apex_count = made;
  return true;
}

static batten_status fault_text(batten_context *ctx, size_t i, const polygon_fault *f) {
  if (f->loop[0] == f->loop[1])
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "sections[%zu].contours[%zu]: crosses or overlaps itself at (%.9g, %.9g), edges from "
                       "points[%zu] and points[%zu]; remove the points of one side",
                       i, f->loop[0], f->at[0], f->at[1], f->edge[0], f->edge[1]);
  return batten_fail(ctx, BATTEN_E_INVALID,
                     "sections[%zu].contours[%zu]: crosses or overlaps contours[%zu] at (%.9g, %.9g), edges from "
                     "points[%zu] and points[%zu]; contours of a section must lie apart or within each other",
                     i, f->loop[0], f->loop[1], f->at[0], f->at[1], f->edge[0], f->edge[1]);
}

/* Nothing is left of a section: says what its first contour wants. */
static batten_status nothing_left(const taking *t, size_t i, size_t distinct, double area) {
  const batten_section *g = &t->given[i];
  bool end = i == 0 || i + 1 == t->count, one = g->contour_count == 1;
  const char *remedy = end && one && distinct > 0 ? "; give at least 3, or set opt.apex to end the solid there"
                                                  : "; give at least 3, or leave the section out";
  if (distinct < 3)
    return batten_fail(t->ctx, BATTEN_E_INVALID, "sections[%zu].contours[0]: %zu point%s%s", i, distinct,
                       distinct == 1 ? "" : "s", remedy);
  return batten_fail(t->ctx, BATTEN_E_INVALID,
                     "sections[%zu].contours[0]: area %.3g below %.3g; give a contour with more, or a smaller "
                     "opt.min_area",
                     i, fabs(area), t->min_area);
}

/* Places of a contour that differ from the one before. */
static size_t distinct_points(const double *points, size_t count) {
  size_t made = 0;
  for (size_t i = 0; i < count; i++) {
    const double *a = points + 2 * (i > 0 ? i - 1 : count - 1), *b = points + 2 * i;
    made += count == 1 || a[0] != b[0] || a[1] != b[1];
  }
  return made > 0 || count == 0 ? made : 1;
}

static batten_status take_loops(const taking *t, size_t i, unsigned char *dropped) {
  const batten_section *g = &t->given[i];
  polygon_set *loops = &t->s->sections[i].loops;
  polygon_fault fault = {POLYGON_SOUND, {0, 0}, {0, 0}, {0, 0}};
  batten_status st =
      polygon_set_make(t->ctx, g->contour_count, g->starts, g->points, t->min_area, loops, dropped, &fault);
  if (fault.kind != POLYGON_SOUND) return fault_text(t->ctx, i, &fault);
  for (size_t k = 0; st >= 0 && k < g->contour_count; k++) {
    if (!dropped[k]) continue;
    size_t points = g->starts[k + 1] - g->starts[k];
    const double *first = g->points + 2 * g->starts[k];
    double area = points > 2 ? fabs(polygon_loop_area(points, first)) : 0;
    if (loops->count == 0) return nothing_left(t, i, distinct_points(first, points), area);
    st = stack_note_add(t->notes,
                        (batten_stack_note){BATTEN_NOTE_DROPPED, i, k, .above = 0, .other = SIZE_MAX, .value = area});
  }
  return st;
}

static batten_status take_section(const taking *t, size_t i) {
  const batten_section *g = &t->given[i];
  stack_section *out = &t->s->sections[i];
  memcpy(out->origin, g->origin, sizeof out->origin);
  memcpy(out->rotation, g->rotation, sizeof out->rotation);
  rotation_orthonormalize(&out->rotation[0][0]);
  out->scale = t->opt->scales ? t->opt->scales[i] : 1;
  if (t->opt->apex && (i == 0 || i + 1 == t->count) && take_apex(g, out)) return BATTEN_OK;
  if (t->opt->method != BATTEN_SECTION_PAIRS) {
    size_t points = point_count(g);
    return points >= 3
               ? BATTEN_OK
               : batten_fail(t->ctx, BATTEN_E_INVALID, "sections[%zu]: %zu points; give at least 3", i, points);
  }
  unsigned char *dropped = batten_alloc_array(t->ctx, g->contour_count, 1);
  batten_status st = dropped ? take_loops(t, i, dropped) : BATTEN_E_NOMEM;
  batten_free(t->ctx, dropped);
  return st;
}

/* ---- all of them together ------------------------------------------------------------------------ */

/* Point k of section i in space, from the first section's origin. */
static void place_of(const taking *t, size_t i, size_t k, double *x) {
  const stack_section *s = &t->s->sections[i];
  const double *p = t->given[i].points + 2 * k, *base = t->s->sections[0].origin;
  for (int d = 0; d < 3; d++) x[d] = s->origin[d] - base[d] + p[0] * s->rotation[0][d] + p[1] * s->rotation[1][d];
}

/* The mean of a section's points. */
static void middle_of(const taking *t, size_t i, double *x) {
  const batten_section *g = &t->given[i];
  x[0] = x[1] = x[2] = 0;
  for (size_t k = g->starts[0]; k < g->starts[g->contour_count]; k++) {
    double place[3];
    place_of(t, i, k, place);
    for (int d = 0; d < 3; d++) x[d] += place[d] / (double)point_count(g);
  }
}

static void settle_size(taking *t) {
  double lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t i = 0; i < t->count; i++)
    for (size_t k = t->given[i].starts[0]; k < t->given[i].starts[t->given[i].contour_count]; k++) {
      double x[3];
      place_of(t, i, k, x);
      for (int d = 0; d < 3; d++) {
        lower[d] = fmin(lower[d], x[d]);
        upper[d] = fmax(upper[d], x[d]);
      }
    }
  t->size = vec_distance(lower, upper);
}

/* Do frames turn by a given velocity? */
static bool frames_turn(const stack *s) {
  if (s->rotation != BATTEN_ROTATION_VELOCITY || s->count < 2) return false;
  for (size_t i = 0; i < 3 * s->count; i++)
    if (s->angular_velocity[i] != 0) return true;
  return false;
}

/* Of parallel sections all get the frame of the first, so that they are shifted and nothing else. */
static void settle_parallel(stack *s) {
  s->parallel = !frames_turn(s);
  for (size_t i = 1; i < s->count; i++)
    for (int k = 0; k < 3; k++)
      if (!(vec_distance(s->sections[i].rotation[k], s->sections[0].rotation[k]) <= PARALLEL_TOLERANCE))
        s->parallel = false;
  for (size_t i = 1; s->parallel && i < s->count; i++)
    memcpy(s->sections[i].rotation, s->sections[0].rotation, sizeof s->sections[i].rotation);
}

/* How far the points of section i lie before the plane of section j, along its normal. */
static void distances_to_plane(const taking *t, size_t i, size_t j, double *least, double *most) {
  const stack_section *plane = &t->s->sections[j];
  double foot[3];
  vec_sub(plane->origin, t->s->sections[0].origin, foot);
  *least = INFINITY;
  *most = -INFINITY;
  for (size_t k = t->given[i].starts[0]; k < t->given[i].starts[t->given[i].contour_count]; k++) {
    double x[3];
    place_of(t, i, k, x);
    vec_sub(x, foot, x);
    double d = vec_dot(x, plane->rotation[2]);
    *least = fmin(*least, d);
    *most = fmax(*most, d);
  }
}

static batten_status check_order(const taking *t) {
  double slack = COINCIDE_TOLERANCE * t->size;
  for (size_t i = 0; i + 1 < t->count; i++) {
    double low, high, low_back, high_back;
    distances_to_plane(t, i + 1, i, &low, &high);
    distances_to_plane(t, i, i + 1, &low_back, &high_back);
    if (fmax(fabs(low), fabs(high)) <= slack || fmax(fabs(low_back), fabs(high_back)) <= slack)
      return batten_fail(t->ctx, BATTEN_E_INVALID,
                         "sections[%zu]: its plane coincides with that of sections[%zu]; join their contours in one "
                         "section",
                         i + 1, i);
    if (high < 0 && low_back > 0)
      return batten_fail(t->ctx, BATTEN_E_INVALID,
                         "sections[%zu]: lies %.3g behind the plane of sections[%zu]; order sections along their "
                         "normals rotation[2], or turn these",
                         i + 1, -high, i);
  }
  return BATTEN_OK;
}

/* The way from section i to the next: what the gap is, and what t grows by unless it is given. Where origins are one
 * place the middles of the sections tell. */
static double step_of(const taking *t, size_t i) {
  const stack_section *a = &t->s->sections[i], *b = a + 1;
  double way[3], slack = COINCIDE_TOLERANCE * t->size;
  vec_sub(b->origin, a->origin, way);
  if (t->s->parallel) return vec_dot(way, t->s->sections[0].rotation[2]);
  if (vec_norm(way) > slack) return vec_norm(way);
  double from[3], to[3];
  middle_of(t, i, from);
  middle_of(t, i + 1, to);
  return vec_distance(from, to) > slack ? vec_distance(from, to) : 0;
}

/* t, the median gap, saturation lengths, lengths of the ends. With one function in space none of these counts, and
 * sections need no order: steps that make no sense are any length then. */
static batten_status settle_gaps(const taking *t) {
  stack *s = t->s;
  weighted_sample *gaps = batten_alloc_array(t->ctx, t->count, sizeof *gaps);
  if (!gaps) return BATTEN_E_NOMEM;
  batten_status st = BATTEN_OK;
  size_t steps = t->count - 1;
  if (steps == 0) gaps[0] = (weighted_sample){t->opt->gap, 1};
  for (size_t i = 0; i < steps; i++) {
    double step = step_of(t, i);
    if (!(step > 0) && t->opt->route == BATTEN_ROUTE_SECTIONS && !t->opt->parameters) {
      st =
          batten_fail(t->ctx, BATTEN_E_INVALID,
                      "sections[%zu].origin: that of sections[%zu]; give opt.parameters, or origins apart", i + 1, i);
      goto done;
    }
    gaps[i] = (weighted_sample){step > 0 ? step : t->size > 0 ? t->size : 1, 1};
  }
  s->gap = weighted_quantile(steps > 0 ? steps : 1, gaps, 0.5);
  for (size_t i = 0; i < t->count; i++) {
    stack_section *section = &s->sections[i];
    double before = gaps[i > 0 ? i - 1 : 0].value, after = gaps[i < steps ? i : steps > 0 ? steps - 1 : 0].value;
    /* The shorter one: a spline carries its slope over the longer gap beside it, and swings there by so much more. */
    section->saturation = t->opt->saturation * fmin(before, after);
    section->t = t->opt->parameters ? t->opt->parameters[i] : i > 0 ? section[-1].t + gaps[i - 1].value : 0;
  }
  /* Heights over the first plane, rounded once. */
  for (size_t i = 1; s->parallel && !t->opt->parameters && i < t->count; i++) {
    double way[3];
    vec_sub(s->sections[i].origin, s->sections[0].origin, way);
    double height = vec_dot(way, s->sections[0].rotation[2]);
    if (height > s->sections[i - 1].t) s->sections[i].t = height;
  }
  for (int e = 0; e < 2; e++) {
    double gap = gaps[e == 0 || steps == 0 ? 0 : steps - 1].value, height = t->opt->end_height[e];
    if (height == 0) height = s->ends[e] == BATTEN_END_FLAT ? 0.5 : 1;
    s->end_lengths[e] = s->ends[e] == BATTEN_END_PLANE ? 0 : height * gap;
  }
done:
  batten_free(t->ctx, gaps);
  return st;
}

/* Sections whose frames follow from the velocity stand in these; the first one's is where they begin. */
static batten_status take_frames(batten_context *ctx, stack *s) {
  stack_path *path = NULL;
  const stack_plane *planes;
  batten_status st = stack_path_make(ctx, s, &path);
  if (st < 0) return st;
  stack_path_planes(path, &planes);
  for (size_t i = 1; i < s->count; i++)
    memcpy(s->sections[i].rotation, planes[i].rotation, sizeof planes[i].rotation);
  stack_path_free(path);
  return BATTEN_OK;
}

static batten_status take_options(taking *t) {
  const batten_stack_options *o = t->opt;
  stack *s = t->s;
  s->between = o->between;
  s->shape = o->shape;
  s->ends[0] = o->ends[0];
  s->ends[1] = o->ends[1];
  s->rotation = o->rotation;
  s->path_kind = o->path;
  s->parameter = o->parameter;
  if (!o->angular_velocity) return BATTEN_OK;
  s->angular_velocity = batten_alloc_array(t->ctx, t->count, 3 * sizeof(double));
  if (!s->angular_velocity) return BATTEN_E_NOMEM;
  memcpy(s->angular_velocity, o->angular_velocity, t->count * 3 * sizeof(double));
  return BATTEN_OK;
}

static batten_status check_areas(const taking *t) {
  if (t->opt->method != BATTEN_SECTION_PAIRS) return BATTEN_OK;
  for (size_t i = 0; i < t->count; i++)
    if (t->s->sections[i].loops.count > 0) return BATTEN_OK;
  return batten_fail(t->ctx, BATTEN_E_INVALID, "sections: all are apexes; give a contour of at least 3 points");
}

/* ---- entries ------------------------------------------------------------------------------------- */

/* Where points are dense in some places alone, a share of their distance asks for more than the others can bear: long
 * straight edges would need a centre every few tolerances. Few points for a large section, on the other hand, would
 * allow a curve that bulges between them, always outwards where the loop is convex: by parts of a percent of the area.
 */
double stack_tolerance(const stack *s, const batten_stack_options *opt) {
  if (opt->tolerance > 0) return opt->tolerance;
  double size = 0, sum = 0, count = 0;
  for (size_t i = 0; i < s->count; i++) {
    const polygon_set *p = &s->sections[i].loops;
    if (p->count == 0) continue;
    double diagonal = hypot(p->upper[0] - p->lower[0], p->upper[1] - p->lower[1]);
    size = fmax(size, diagonal);
    sum += diagonal;
    count++;
  }
  double most = count > 0 ? TOLERANCE_OF_MEAN * sum / count : INFINITY;
  return fmax(fmin(TOLERANCE_OF_SPACING * s->spacing, most), TOLERANCE_OF_SIZE * size);
}

batten_status stack_take_sections(batten_context *ctx, size_t count, const batten_section *sections,
                                  const batten_stack_options *opt, stack *out, stack_notes *notes) {
  taking t = {.ctx = ctx, .count = count, .given = sections, .opt = opt, .s = out, .notes = notes};
  out->ctx = ctx;
  if (count == 0 || !sections)
    return batten_fail(ctx, BATTEN_E_INVALID, "sections: %zu; give at least one", sections ? count : 0);
  for (size_t i = 0; i < count; i++) {
    batten_status st = check_section(ctx, i, &sections[i]);
    if (st < 0) return st;
  }
  out->sections = batten_alloc_array(ctx, count, sizeof *out->sections);
  if (!out->sections) return BATTEN_E_NOMEM;
  out->count = count;
  for (size_t i = 0; i < count; i++) out->sections[i] = (stack_section){.loops = {.ctx = ctx}};
  batten_status st = settle_spacing(&t);
  for (size_t i = 0; st >= 0 && i < count; i++) st = take_section(&t, i);
  if (st >= 0) st = check_areas(&t);
  if (st >= 0) st = take_options(&t);
  if (st < 0) return st;
  settle_parallel(out);
  settle_size(&t);
  bool integrated = opt->rotation == BATTEN_ROTATION_VELOCITY && !out->parallel;
  if (integrated) st = settle_gaps(&t);
  if (st >= 0 && integrated) st = take_frames(ctx, out);
  if (st >= 0 && opt->route != BATTEN_ROUTE_SPACE) st = check_order(&t);
  return st < 0 || integrated ? st : settle_gaps(&t);
}
