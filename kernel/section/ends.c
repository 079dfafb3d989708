/* What closes a stack at its first and last section. With s the distance beyond the plane, F held at its value there,
 * and H the length of the end:
 *
 *   flat, plane  min(F, H - s), H = 0 of the latter: it counts inside of the plane too, so that f has no jump there
 *   rounded      F - rho (s / H)^2: rho is the largest F of the component around (x, y), so that each closes at H.
 * The ends of a disc of radius R under F = R - r are then paraboloids of volume 8/15 of H times its area open F
 *
 * An apex closes the solid by itself: there F <= 0 at the plane already, and what is beyond is cut as by a plane.
 *
 * Off the components rho is that of the nearest one, and runs to the largest of all within half of the distance
 * between components: f is continuous where the nearest changes. */
#include <math.h>
#include <string.h>

#include "section/section_inner.h"

static const stack_section *end_section(const stack *s, unsigned end) { return &s->sections[end ? s->count - 1 : 0]; }

static batten_stack_end end_rule(const stack *s, unsigned end) {
  return end_section(s, end)->function ? s->ends[end] : BATTEN_END_PLANE;
}

static double end_length(const stack *s, unsigned end) {
  return end_rule(s, end) == BATTEN_END_PLANE ? 0 : s->end_lengths[end];
}

/* The outer loop of the component that a loop bounds. */
static size_t outer_of(const polygon_set *p, size_t loop) { return p->depth[loop] % 2 ? p->parent[loop] : loop; }

static size_t loop_of_edge(const polygon_set *p, size_t edge) {
  size_t low = 0, high = p->count;
  while (high - low > 1) {
    size_t middle = low + (high - low) / 2;
    if (edge < p->starts[middle])
      high = middle;
    else
      low = middle;
  }
  return low;
}

static void peak_range(const stack *s, unsigned end, double range[2]) {
  const polygon_set *loops = &end_section(s, end)->loops;
  const double *peak = s->end_peak[end];
  range[0] = INFINITY;
  range[1] = 0;
  for (size_t k = 0; k < (loops->count ? loops->count : 1); k++) {
    size_t outer = loops->count ? outer_of(loops, k) : 0;
    range[0] = fmin(range[0], peak[outer]);
    range[1] = fmax(range[1], peak[outer]);
  }
}

/* rho at x, a place of the section's own; gradient [2]. */
static double end_peak(const stack *s, unsigned end, const double x[2], double gradient[2]) {
  const polygon_set *loops = &end_section(s, end)->loops;
  const double *peak = s->end_peak[end];
  double range[2], near[2];
  gradient[0] = gradient[1] = 0;
  peak_range(s, end, range);
  if (range[0] == range[1]) return range[1];
  size_t edge;
  double d = polygon_distance(loops, x, near, &edge), rho = peak[outer_of(loops, loop_of_edge(loops, edge))];
  if (d >= 0) return rho;
  double share = -d / s->end_apart[end];
  if (!(share < 1)) return range[1];
  double rise = range[1] - rho, slope = rise * 6 * share * (1 - share) / s->end_apart[end];
  for (unsigned k = 0; k < 2; k++) gradient[k] = slope * (x[k] - near[k]) / -d;
  return rho + rise * share * share * (3 - 2 * share);
}

void stack_end_apply(const stack *s, unsigned end, const double *x, double beyond, double *value, double *gradient) {
  batten_stack_end rule = end_rule(s, end);
  if (rule == BATTEN_END_OPEN) return;
  double length = end_length(s, end);
  if (rule != BATTEN_END_ROUNDED) {
    double cap = length - beyond;
    if (*value <= cap) return;
    *value = cap;
    if (gradient) memcpy(gradient, (double[3]){0, 0, -1}, 3 * sizeof *gradient);
    return;
  }
  if (beyond <= 0) return;
  double share = beyond / length, slope[2], rho = end_peak(s, end, x, slope);
  *value -= rho * share * share;
  if (!gradient) return;
  for (unsigned k = 0; k < 2; k++) gradient[k] -= slope[k] * share * share;
  gradient[2] -= 2 * rho * share / length;
}

interval stack_end_bounds(const stack *s, unsigned end, interval value, interval beyond) {
  batten_stack_end rule = end_rule(s, end);
  if (rule == BATTEN_END_OPEN) return value;
  double length = end_length(s, end);
  if (rule != BATTEN_END_ROUNDED) return interval_min(value, interval_sub(interval_of(length), beyond));
  if (beyond.hi <= 0) return value;
  double range[2];
  peak_range(s, end, range);
  interval share = interval_div((interval){fmax(0, beyond.lo), beyond.hi}, interval_of(length));
  interval fall = interval_mul(interval_widen(range[0], range[1], 4), interval_square(share));
  return interval_sub(value, fall);
}

/* ---- rho ------------------------------------------------------------------------------------------ */

/* Largest value of the end section's function in each component: a grid over its box, then smaller grids about the
 * best place. Inside is what the loops say; the middles of neighbours' chords are tried too, since each polygon has
 * ears, so that no component is too thin to have a place. Components are the loops of even depth; of a section
 * without loops the whole is one, over the box of its function. */
enum {
  GRID = 24,   /* places along each side of the box */
  SMALL = 5,   /* of the smaller grids, */
  ROUNDS = 12, /* each of half the size: a 30,000th of the first step in the end */
};

typedef struct peak {
  size_t loop;
  double lower[2], upper[2], best[2], value; /* value -INFINITY: no place yet */
} peak;

/* Of places [count][2], those in the peak's component. */
static batten_status try_places(const stack *s, unsigned end, batten_context *ctx, size_t count, double *places,
                                peak *p) {
  const stack_section *at = end_section(s, end);
  size_t kept = 0;
  for (size_t i = 0; i < count; i++) {
    const double *x = places + 2 * i;
    size_t edge;
    bool inside = at->loops.count == 0 || (polygon_distance(&at->loops, x, NULL, &edge) > 0 &&
                                           outer_of(&at->loops, loop_of_edge(&at->loops, edge)) == p->loop);
    if (inside) memmove(places + 2 * kept++, x, 2 * sizeof *x);
  }
  double *values = batten_alloc_array(ctx, kept + 1, sizeof *values);
  if (!values) return BATTEN_E_NOMEM;
  batten_status st = kept ? batten_solid_evaluate(ctx, at->function, kept, places, values, NULL, NULL) : BATTEN_OK;
  for (size_t i = 0; i < kept && st >= 0; i++) {
    double slope, value = stack_shape(at, values[i], &slope);
    if (value <= p->value) continue;
    p->value = value;
    memcpy(p->best, places + 2 * i, sizeof p->best);
  }
  batten_free(ctx, values);
  return st;
}

static void grid_places(const double lower[2], const double upper[2], size_t side, double *places) {
  for (size_t i = 0; i < side * side; i++)
    for (unsigned k = 0; k < 2; k++) {
      double u = ((double)(k ? i / side : i % side) + 0.5) / (double)side;
      places[2 * i + k] = lower[k] + u * (upper[k] - lower[k]);
    }
}

static batten_status find_peak(const stack *s, unsigned end, batten_context *ctx, double *places, peak *p) {
  const polygon_set *loops = &end_section(s, end)->loops;
  grid_places(p->lower, p->upper, GRID, places);
  batten_status st = try_places(s, end, ctx, (size_t)GRID * GRID, places, p);
  if (st < 0) return st;
  if (loops->count) {
    size_t first = loops->starts[p->loop], count = loops->starts[p->loop + 1] - first;
    const double *x = loops->points + 2 * first;
    for (size_t i = 0; i < count; i++)
      for (unsigned k = 0; k < 2; k++)
        places[2 * i + k] = 0.5 * (x[2 * ((i + count - 1) % count) + k] + x[2 * ((i + 1) % count) + k]);
    st = try_places(s, end, ctx, count, places, p);
  }
  double step[2] = {(p->upper[0] - p->lower[0]) / GRID, (p->upper[1] - p->lower[1]) / GRID};
  for (unsigned round = 0; round < ROUNDS && st >= 0 && p->value > -INFINITY; round++) {
    double lower[2], upper[2];
    for (unsigned k = 0; k < 2; k++) {
      lower[k] = p->best[k] - step[k];
      upper[k] = p->best[k] + step[k];
      step[k] /= 2;
    }
    grid_places(lower, upper, SMALL, places);
    st = try_places(s, end, ctx, (size_t)SMALL * SMALL, places, p);
  }
  return st;
}

/* Half of the smallest distance of a component's corners to the others': with all components as the first one that is
 * the smallest distance between any two, which lies at a corner. */
static double half_apart(const polygon_set *loops, size_t outer, unsigned char *others) {
  double least = INFINITY;
  for (size_t k = 0; k < loops->count; k++) others[k] = outer_of(loops, k) != outer;
  for (size_t k = 0; k < loops->count; k++)
    for (size_t i = loops->starts[k]; !others[k] && i < loops->starts[k + 1]; i++)
      least = fmin(least, polygon_distance_to(loops, others, loops->points + 2 * i));
  return least / 2;
}

static void loop_box(const polygon_set *loops, size_t loop, double lower[2], double upper[2]) {
  for (unsigned k = 0; k < 2; k++) {
    lower[k] = INFINITY;
    upper[k] = -INFINITY;
    for (size_t i = loops->starts[loop]; i < loops->starts[loop + 1]; i++) {
      lower[k] = fmin(lower[k], loops->points[2 * i + k]);
      upper[k] = fmax(upper[k], loops->points[2 * i + k]);
    }
  }
}

static batten_status prepare_end(batten_context *ctx, stack *s, unsigned end) {
  const stack_section *at = end_section(s, end);
  const polygon_set *loops = &at->loops;
  size_t count = loops->count ? loops->count : 1, most = (size_t)GRID * GRID;
  for (size_t k = 0; k < loops->count; k++) {
    size_t corners = loops->starts[k + 1] - loops->starts[k];
    most = corners > most ? corners : most;
  }
  batten_status st = BATTEN_E_NOMEM;
  double *peaks = batten_alloc_array(ctx, count, sizeof *peaks), *places = NULL;
  unsigned char *others = batten_alloc(ctx, count);
  if (!peaks || !others) goto done;
  places = batten_alloc_array(ctx, most, 2 * sizeof *places);
  if (!places) goto done;
  st = BATTEN_OK;
  s->end_apart[end] = INFINITY;
  for (size_t k = 0; k < count && st >= 0; k++) {
    peaks[k] = 0;
    if (loops->count && loops->depth[k] % 2) continue;
    peak p = {.loop = k, .value = -INFINITY};
    if (loops->count) {
      loop_box(loops, k, p.lower, p.upper);
      s->end_apart[end] = fmin(s->end_apart[end], half_apart(loops, k, others));
    } else {
      batten_solid_box(at->function, p.lower, p.upper);
    }
    st = find_peak(s, end, ctx, places, &p);
    /* a function that is nowhere positive has nothing to close; any rho will do, but it must be one */
    peaks[k] = p.value > 0 ? p.value : s->end_lengths[end];
  }
  if (st < 0) goto done;
  batten_free(ctx, s->end_peak[end]);
  s->end_peak[end] = peaks;
  peaks = NULL;
done:
  batten_free(ctx, peaks);
  batten_free(ctx, others);
  batten_free(ctx, places);
  return st;
}

batten_status stack_end_prepare(batten_context *ctx, stack *s) {
  for (unsigned end = 0; end < 2; end++) {
    if (end_rule(s, end) != BATTEN_END_ROUNDED) continue;
    batten_status st = prepare_end(ctx, s, end);
    if (st < 0) return st;
  }
  return BATTEN_OK;
}
