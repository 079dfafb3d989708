/* Links: components of two neighbouring sections that do not overlap, joined by a blend in a sheared frame.
 *
 * With c_a and c_b the centroids and s = c_b - c_a, the link at u in [0, 1] between both planes is
 *
 *   L(x, u) = (1 - u) A(x - u s) + u B(x + (1 - u) s),     A = min(F_a, (d_a - d_other) / 2),
 *
 * F_a the function of the section, scaled and saturated, d_a the signed distance to the component, positive in it,
 * and d_other that to the other components of the section. A is F_a near its own component and keeps below 0
 * elsewhere: a component is nearer to itself than others are. L is A on the first plane and B on the second, so it
 * lies below the section's functions there, and the largest of F and all links leaves both sections as they are:
 * places on the planes are not even asked. L <= (1 - u) F_a + u F_b, which costs no distances, tells most places
 * where no link shows. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "section/section_inner.h"

enum { TASK = 128 }; /* places of a task: some 100 us of distances */

/* One end of a link. */
typedef struct link_end {
  const polygon_set *loops;
  unsigned char *own, *others; /* [loops] */
  bool alone;                  /* no others */
  double shift[2];             /* of the section in the places of the stack */
} link_end;

typedef struct link_work {
  const stack *s;
  batten_context *ctx;
  size_t at;
  link_end ends[2];
  double way[2];     /* s */
  size_t count;      /* places that are between the planes */
  size_t *index;     /* [count] */
  double *sheared;   /* [2][count][2] where A and B are asked */
  double *f, *slope; /* [2][count] F_a, F_b there, [2][count][2] */
  const double *places, *u;
  double *values, *gradients;
} link_work;

/* ---- one link ------------------------------------------------------------------------------------ */

static void end_free(batten_context *ctx, link_end *e) {
  batten_free(ctx, e->own);
  batten_free(ctx, e->others);
}

static batten_status end_make(const stack *s, batten_context *ctx, size_t section, size_t outer, link_end *e,
                              double *center) {
  const polygon_set *p = e->loops = &s->sections[section].loops;
  double area;
  e->own = batten_alloc_array(ctx, p->count, 1);
  e->others = batten_alloc_array(ctx, p->count, 1);
  if (!e->own || !e->others) return BATTEN_E_NOMEM;
  e->alone = true;
  for (size_t k = 0; k < p->count; k++) {
    e->own[k] = k == outer || p->parent[k] == outer;
    e->others[k] = !e->own[k];
    if (e->others[k]) e->alone = false;
  }
  stack_shift(s, section, e->shift);
  polygon_component_measure(p, outer, &area, center);
  for (int d = 0; d < 2; d++) center[d] += e->shift[d];
  return BATTEN_OK;
}

static batten_status link_make(const stack *s, batten_context *ctx, const batten_stack_link *link, link_end ends[2],
                               double way[2]) {
  double center[2][2];
  for (int e = 0; e < 2; e++) {
    batten_status st = end_make(s, ctx, link->section + (size_t)e, link->loop[e], &ends[e], center[e]);
    if (st < 0) return st;
  }
  for (int d = 0; d < 2; d++) way[d] = center[1][d] - center[0][d];
  return BATTEN_OK;
}

/* Adds sign times a signed distance of x, off by the sign of where it lies, to the gradient. */
static void add_slope(const double *x, const double *nearest, double d, double factor, double *gradient) {
  for (int k = 0; k < 2 && d > 0; k++) gradient[k] += factor * (x[k] - nearest[k]) / d;
}

/* (d_a - d_other) / 2 at x, a place of the section's own; slope as well, unless NULL. A point of the area belongs to
 * the component whose outline is the nearer. */
static double parting(const link_end *e, const double x[2], double *slope) {
  double own_place[2], other_place[2];
  double own = polygon_nearest_to(e->loops, e->own, x, own_place);
  double other = polygon_nearest_to(e->loops, e->others, x, other_place);
  bool inside = polygon_inside(e->loops, x);
  double own_sign = inside && own <= other ? 1 : -1, other_sign = inside && own > other ? 1 : -1;
  if (slope) {
    slope[0] = slope[1] = 0;
    add_slope(x, own_place, own, own_sign / 2, slope);
    add_slope(x, other_place, other, -other_sign / 2, slope);
  }
  return (own_sign * own - other_sign * other) / 2;
}

/* min(f, (d_a - d_other) / 2) at place; slope as well, unless NULL. */
static double localized(const link_end *e, const double *place, double f, double *slope) {
  if (e->alone) return f;
  const double x[2] = {place[0] - e->shift[0], place[1] - e->shift[1]};
  double parted[2], value = parting(e, x, slope ? parted : NULL);
  if (f <= value) return f;
  if (slope) memcpy(slope, parted, sizeof parted);
  return value;
}

static void link_task(void *arg, size_t task) {
  const link_work *w = arg;
  size_t last = (task + 1) * TASK < w->count ? (task + 1) * TASK : w->count;
  for (size_t k = task * TASK; k < last; k++) {
    size_t i = w->index[k];
    double u = w->u[i], a = w->f[k], b = w->f[w->count + k];
    if ((1 - u) * a + u * b <= w->values[i]) continue;
    double *slope_a = w->gradients ? w->slope + 2 * k : NULL;
    double *slope_b = w->gradients ? w->slope + 2 * (w->count + k) : NULL;
    a = localized(&w->ends[0], w->sheared + 2 * k, a, slope_a);
    b = localized(&w->ends[1], w->sheared + 2 * (w->count + k), b, slope_b);
    double value = (1 - u) * a + u * b;
    if (value <= w->values[i]) continue;
    w->values[i] = value;
    if (!w->gradients) continue;
    double *g = w->gradients + 3 * i;
    for (int d = 0; d < 2; d++) g[d] = (1 - u) * slope_a[d] + u * slope_b[d];
    g[2] = b - a - (g[0] * w->way[0] + g[1] * w->way[1]);
  }
}

static batten_status apply_link(link_work *w, const batten_stack_link *link) {
  memset(w->ends, 0, sizeof w->ends);
  batten_status st = link_make(w->s, w->ctx, link, w->ends, w->way);
  for (size_t k = 0; st >= 0 && k < w->count; k++)
    for (size_t d = 0; d < 2; d++) {
      double x = w->places[2 * w->index[k] + d], u = w->u[w->index[k]];
      w->sheared[2 * k + d] = x - u * w->way[d];
      w->sheared[2 * (w->count + k) + d] = x + (1 - u) * w->way[d];
    }
  for (size_t e = 0; st >= 0 && e < 2; e++)
    st = stack_section_evaluate(w->s, w->ctx, w->at + e, w->count, w->sheared + 2 * e * w->count, w->f + e * w->count,
                                w->gradients ? w->slope + 2 * e * w->count : NULL);
  if (st >= 0) batten_parallel(w->ctx, (w->count + TASK - 1) / TASK, link_task, w);
  for (int e = 0; e < 2; e++) end_free(w->ctx, &w->ends[e]);
  return st;
}

/* The links of a section: first [0], behind the last [1]. */
static void links_of(const stack *s, size_t at, size_t range[2]) {
  range[0] = 0;
  while (range[0] < s->link_count && s->links[range[0]].section < at) range[0]++;
  range[1] = range[0];
  while (range[1] < s->link_count && s->links[range[1]].section == at) range[1]++;
}

/* ---- bounds -------------------------------------------------------------------------------------- */

/* Where an end's function is asked over boxes [count][2][3]: in its section's own x and y, [count][2][2]. */
static void sheared_boxes(const link_end *e, const double *way, bool upper, size_t count, const double *boxes,
                          double *out) {
  for (size_t i = 0; i < count; i++) {
    const double *low = boxes + 6 * i, *high = low + 3;
    interval u = {fmin(fmax(low[2], 0), 1), fmax(fmin(high[2], 1), 0)}; /* links are asked in [0, 1] alone */
    interval turn = upper ? interval_sub(interval_of(1), u) : interval_neg(u);
    for (int d = 0; d < 2; d++) {
      interval x = interval_add((interval){low[d], high[d]}, interval_scale(turn, way[d]));
      x = interval_sub(x, interval_of(e->shift[d]));
      out[4 * i + (size_t)d] = x.lo;
      out[4 * i + 2 + (size_t)d] = x.hi;
    }
  }
}

/* As stack_shape, which increases. */
static interval shape_bounds(const stack_section *section, interval f) {
  f = interval_scale(f, section->scale);
  if (section->saturation == INFINITY) return f;
  return interval_scale(interval_tanh(interval_div(f, interval_of(section->saturation))), section->saturation);
}

/* A over a box of the section's own, f: of F_a there. Distances change by no more than their place moves. */
static interval localized_bounds(const link_end *e, const double *box, interval f) {
  if (e->alone) return f;
  double middle[2], half[2], size = 0;
  for (int d = 0; d < 2; d++) {
    middle[d] = box[d] / 2 + box[2 + d] / 2;
    half[d] = fmax(box[2 + d] - middle[d], middle[d] - box[d]);
    size += fabs(middle[d]) + half[d] + fabs(e->loops->lower[d]) + fabs(e->loops->upper[d]);
  }
  double reach = hypot(half[0], half[1]) * (1 + 4 * DBL_EPSILON) + 32 * DBL_EPSILON * size;
  double value = parting(e, middle, NULL);
  return interval_min(f, (interval){value - reach, value + reach});
}

/* (1 - u) a + u b over u; for any a and b it is least and largest at ends of u. */
static interval link_between(interval a, interval b, interval u) {
  interval sum = {INFINITY, -INFINITY};
  if (!(fabs(a.lo) < INFINITY && fabs(a.hi) < INFINITY && fabs(b.lo) < INFINITY && fabs(b.hi) < INFINITY))
    return interval_hull(a, b);
  for (int end = 0; end < 2; end++) {
    interval here = interval_of(end ? u.hi : u.lo);
    interval part = interval_mul(interval_sub(interval_of(1), here), a);
    part = interval_add(part, interval_mul(here, b));
    sum = end ? interval_hull(sum, part) : part;
  }
  return sum;
}

/* Distances are asked where the blend of F_a and F_b, which a link never exceeds, comes above what is there without
 * it. On the planes and outside of them there is no link; on the planes it would add nothing, so that only what goes
 * beyond them keeps its lower end. */
static batten_status bound_link(const stack *s, batten_context *ctx, const batten_stack_link *link, size_t count,
                                const double *boxes, double *own, double *f, double *ranges) {
  link_end ends[2] = {{0}, {0}};
  double way[2];
  batten_status st = link_make(s, ctx, link, ends, way);
  for (size_t e = 0; st >= 0 && e < 2; e++) {
    sheared_boxes(&ends[e], way, e == 1, count, boxes, own + 4 * e * count);
    st = batten_solid_bounds(ctx, s->sections[link->section + e].function, count, own + 4 * e * count,
                             f + 2 * e * count);
  }
  for (size_t i = 0; st >= 0 && i < count; i++) {
    interval u = {fmin(fmax(boxes[6 * i + 2], 0), 1), fmax(fmin(boxes[6 * i + 5], 1), 0)}, part[2];
    for (size_t e = 0; e < 2; e++) {
      const double *range = f + 2 * (e * count + i);
      part[e] = shape_bounds(&s->sections[link->section + e], (interval){range[0], range[1]});
    }
    if (link_between(part[0], part[1], u).hi <= ranges[2 * i]) continue;
    for (size_t e = 0; e < 2; e++) part[e] = localized_bounds(&ends[e], own + 4 * (e * count + i), part[e]);
    interval here = link_between(part[0], part[1], u);
    bool within = boxes[6 * i + 2] >= 0 && boxes[6 * i + 5] <= 1;
    if (within) ranges[2 * i] = fmax(ranges[2 * i], here.lo);
    ranges[2 * i + 1] = fmax(ranges[2 * i + 1], here.hi);
  }
  for (int e = 0; e < 2; e++) end_free(ctx, &ends[e]);
  return st;
}

/* ---- entries ------------------------------------------------------------------------------------- */

batten_status stack_link_evaluate(const stack *s, batten_context *ctx, size_t at, size_t count, const double *places,
                                  const double *u, double *values, double *gradients) {
  size_t range[2], inner = 0;
  links_of(s, at, range);
  for (size_t i = 0; i < count; i++) inner += u[i] > 0 && u[i] < 1;
  if (range[0] == range[1] || inner == 0) return BATTEN_OK;
  link_work w = {.s = s, .ctx = ctx, .at = at, .places = places, .u = u, .values = values, .gradients = gradients};
  w.index = batten_alloc_array(ctx, inner, sizeof *w.index);
  w.sheared = batten_alloc_array(ctx, inner, 4 * sizeof *w.sheared);
  w.f = batten_alloc_array(ctx, inner, 2 * sizeof *w.f);
  w.slope = gradients ? batten_alloc_array(ctx, inner, 4 * sizeof *w.slope) : NULL;
  batten_status st = w.index && w.sheared && w.f && (w.slope || !gradients) ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t i = 0; st >= 0 && i < count; i++)
    if (u[i] > 0 && u[i] < 1) w.index[w.count++] = i;
  for (size_t k = range[0]; st >= 0 && k < range[1]; k++) st = apply_link(&w, &s->links[k]);
  batten_free(ctx, w.index);
  batten_free(ctx, w.sheared);
  batten_free(ctx, w.f);
  batten_free(ctx, w.slope);
  return st;
}

batten_status stack_link_bounds(const stack *s, batten_context *ctx, size_t at, size_t count, const double *boxes,
                                double *ranges) {
  size_t range[2];
  links_of(s, at, range);
  if (range[0] == range[1]) return BATTEN_OK;
  double *own = batten_alloc_array(ctx, count, 8 * sizeof *own);
  double *f = batten_alloc_array(ctx, count, 4 * sizeof *f);
  batten_status st = own && f ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t k = range[0]; st >= 0 && k < range[1]; k++)
    st = bound_link(s, ctx, &s->links[k], count, boxes, own, f, ranges);
  batten_free(ctx, own);
  batten_free(ctx, f);
  return st;
}
