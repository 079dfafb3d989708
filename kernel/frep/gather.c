/* Nodes whose value is that of one child elsewhere: blocks of places, and how the child's answers become the node's.
 *
 * meet(g, w) is min(g, w), and where g is a distance and both are negative -sqrt(g^2 + w^2): the distance to the edge
 * at which wall and end meet. It grows with both, so that its bounds are those of the ends.
 *
 * Bounds. The node's value is the largest of those at a point's places. From above the largest image counts. From
 * below any place may be taken: of a group that holds one for sure the least image; the best group wins. Where no
 * group is sure, there is a place in one of all the images. */
#include <float.h>
#include <string.h>

#include "base/checked.h"
#include "frep/gather.h"

enum { WIDEN = 4 }; /* roundings of the meet, in interval.h's unit */

struct frep_gather {
  batten_context *ctx;
  const batten_frep *child;
  unsigned n, m;
  bool round; /* meets as of distances */
  size_t count, filled, capacity;
  size_t *owner;              /* [capacity] point or box */
  double *input;              /* [capacity][m], boxes [capacity][2][m] */
  double *answer, *slopes;    /* of the child: [capacity], [capacity][m]; ranges [capacity][2] */
  frep_place *places;         /* [capacity] */
  frep_image *images;         /* [capacity] */
  double *values, *gradients; /* the node's */
  double *ranges, *steepest;
  double *least; /* [count][2] of boxes: the least of all images, of the current group */
  size_t *group; /* [count] the current group */
};

void frep_gather_free(frep_gather *g) {
  if (!g) return;
  batten_context *ctx = g->ctx;
  batten_free(ctx, g->owner);
  batten_free(ctx, g->input);
  batten_free(ctx, g->answer);
  batten_free(ctx, g->slopes);
  batten_free(ctx, g->places);
  batten_free(ctx, g->images);
  batten_free(ctx, g->least);
  batten_free(ctx, g->group);
  batten_free(ctx, g);
}

static frep_gather *new_gather(batten_context *ctx, const batten_frep *a, size_t count, bool boxes) {
  frep_gather *g = batten_alloc(ctx, sizeof *g);
  if (!g) return NULL;
  const batten_frep *child = a->children[0];
  *g = (frep_gather){.ctx = ctx, .child = child, .n = a->n, .m = child->n, .round = child->distance, .count = count};
  g->capacity = count < 64 ? 64 : count < FREP_BLOCK ? count : FREP_BLOCK;
  g->owner = batten_alloc_array(ctx, g->capacity, sizeof *g->owner);
  g->input = batten_alloc_array(ctx, g->capacity * 2 * g->m, sizeof *g->input);
  g->answer = batten_alloc_array(ctx, g->capacity * 2, sizeof *g->answer);
  bool complete = g->owner && g->input && g->answer;
  if (complete && boxes) {
    g->images = batten_alloc_array(ctx, g->capacity, sizeof *g->images);
    g->least = batten_alloc_array(ctx, count, 2 * sizeof *g->least);
    g->group = batten_alloc_array(ctx, count, sizeof *g->group);
    complete = g->images && g->least && g->group;
  } else if (complete) {
    g->places = batten_alloc_array(ctx, g->capacity, sizeof *g->places);
    complete = g->places != NULL;
  }
  if (complete) return g;
  frep_gather_free(g);
  return NULL;
}

/* ---- points --------------------------------------------------------------------------------------- */

batten_status frep_gather_new(batten_context *ctx, const batten_frep *a, size_t count, double *values,
                              double *gradients, frep_gather **out) {
  frep_gather *g = new_gather(ctx, a, count, false);
  if (!g) return BATTEN_E_NOMEM;
  g->values = values;
  g->gradients = gradients;
  if (gradients) {
    g->slopes = batten_alloc_array(ctx, g->capacity * g->m, sizeof *g->slopes);
    if (!g->slopes) {
      frep_gather_free(g);
      return BATTEN_E_NOMEM;
    }
  }
  for (size_t i = 0; i < count; i++) values[i] = -INFINITY;
  *out = g;
  return BATTEN_OK;
}

/* u_g and u_w of the meet u: how it follows either. */
static double meet(bool round, double g, double w, double *u_g, double *u_w) {
  if (round && g < 0 && w < 0) {
    double edge = hypot(g, w);
    *u_g = -g / edge;
    *u_w = -w / edge;
    return -edge;
  }
  *u_g = g <= w;
  *u_w = 1 - *u_g;
  return g <= w ? g : w;
}

static void fold_place(const frep_gather *g, size_t at) {
  const frep_place *p = g->places + at;
  size_t owner = g->owner[at];
  double u_g, u_w, u = meet(g->round, g->answer[at], p->limit, &u_g, &u_w);
  /* not a number is handed on: a child tells so that it has been asked where it cannot answer */
  if (!(u > g->values[owner] || isnan(u) || g->values[owner] == -INFINITY)) return;
  g->values[owner] = u;
  if (!g->gradients) return;
  const double *slope = g->slopes + at * g->m;
  for (unsigned j = 0; j < g->n; j++) {
    double sum = 0;
    for (unsigned i = 0; i < g->m; i++) sum += slope[i] * p->jacobian[i][j];
    g->gradients[owner * g->n + j] = u_w > 0 ? u_g * sum + u_w * p->limit_slope[j] : sum;
  }
}

static batten_status flush_places(frep_gather *g) {
  batten_status st = frep_evaluate_block(g->child, g->ctx, g->filled, g->input, g->answer, g->slopes);
  for (size_t i = 0; st >= 0 && i < g->filled; i++) fold_place(g, i);
  return st;
}

batten_status frep_gather_add(frep_gather *g, size_t point, const frep_place *place) {
  size_t at = g->filled++;
  g->owner[at] = point;
  g->places[at] = *place;
  memcpy(g->input + at * g->m, place->y, g->m * sizeof *g->input);
  return g->filled == g->capacity ? frep_gather_flush(g) : BATTEN_OK;
}

/* ---- boxes ---------------------------------------------------------------------------------------- */

batten_status frep_gather_boxes(batten_context *ctx, const batten_frep *a, size_t count, double *ranges,
                                double *slopes, frep_gather **out) {
  frep_gather *g = new_gather(ctx, a, count, true);
  if (!g) return BATTEN_E_NOMEM;
  g->ranges = ranges;
  g->steepest = slopes;
  for (size_t i = 0; i < count; i++) {
    if (ranges) ranges[2 * i] = ranges[2 * i + 1] = -INFINITY;
    if (slopes) slopes[i] = 0;
    g->least[2 * i] = g->least[2 * i + 1] = INFINITY;
    g->group[i] = 0;
  }
  *out = g;
  return BATTEN_OK;
}

static interval meet_range(bool round, interval g, interval w) {
  double u_g, u_w;
  double lo = meet(round, g.lo, w.lo, &u_g, &u_w), hi = meet(round, g.hi, w.hi, &u_g, &u_w);
  return round && lo < 0 ? interval_widen(lo, hi, WIDEN) : (interval){lo, hi};
}

static void fold_image(const frep_gather *g, size_t at) {
  const frep_image *image = g->images + at;
  size_t owner = g->owner[at];
  if (!g->ranges) { /* steepest where the child is, or the limit, which is a length, moves along */
    double child = g->answer[at] * image->stretch;
    double slope = image->limit.lo < INFINITY ? hypot(child, 1) * (1 + 1e-12) : child;
    if (!(slope <= g->steepest[owner])) g->steepest[owner] = isnan(slope) ? INFINITY : slope;
    return;
  }
  interval range = meet_range(g->round, (interval){g->answer[2 * at], g->answer[2 * at + 1]}, image->limit);
  double *all = g->least + 2 * owner, *of_group = all + 1, *out = g->ranges + 2 * owner;
  out[1] = fmax(out[1], range.hi);
  *all = fmin(*all, range.lo);
  if (image->group != g->group[owner]) {
    if (g->group[owner] > 0) out[0] = fmax(out[0], *of_group);
    g->group[owner] = image->group;
    *of_group = INFINITY;
  }
  *of_group = fmin(*of_group, range.lo);
}

/* The lower ends. */
static void settle_ranges(const frep_gather *g) {
  for (size_t i = 0; i < g->count; i++) {
    double *out = g->ranges + 2 * i;
    if (g->group[i] > 0) out[0] = fmax(out[0], g->least[2 * i + 1]);
    if (g->least[2 * i] < INFINITY) out[0] = fmax(out[0], g->least[2 * i]);
  }
}

static batten_status flush_images(frep_gather *g) {
  batten_status st;
  if (g->ranges)
    st = frep_bounds_block(g->child, g->ctx, g->filled, g->input, g->answer);
  else
    st = frep_slopes_block(g->child, g->ctx, g->filled, g->input, g->answer);
  for (size_t i = 0; st >= 0 && i < g->filled; i++) fold_image(g, i);
  return st;
}

batten_status frep_gather_image(frep_gather *g, size_t box, const frep_image *image) {
  size_t at = g->filled++;
  g->owner[at] = box;
  g->images[at] = *image;
  frep_intervals_box(g->m, image->y, g->input + at * 2 * g->m);
  if (g->filled < g->capacity) return BATTEN_OK;
  batten_status st = flush_images(g);
  g->filled = 0;
  return st;
}

batten_status frep_gather_flush(frep_gather *g) {
  batten_status st = BATTEN_OK;
  if (g->filled > 0) st = g->images ? flush_images(g) : flush_places(g);
  g->filled = 0;
  if (st >= 0 && g->ranges) settle_ranges(g);
  return st;
}

/* ---- maps ----------------------------------------------------------------------------------------- */

void frep_box_intervals(unsigned n, const double *box, interval *x) {
  for (unsigned k = 0; k < n; k++) x[k] = (interval){box[k], box[n + k]};
}

void frep_intervals_box(unsigned n, const interval *x, double *box) {
  for (unsigned k = 0; k < n; k++) {
    box[k] = fmax(x[k].lo, -DBL_MAX);
    box[n + k] = fmin(x[k].hi, DBL_MAX);
    if (!(box[k] <= box[n + k])) box[n + k] = box[k];
  }
}

interval frep_linear_range(unsigned n, const double *row, const interval *x) {
  interval sum = {0, 0};
  for (unsigned j = 0; j < n; j++)
    if (row[j] != 0) sum = interval_add(sum, interval_scale(x[j], row[j]));
  return sum;
}

batten_status frep_map_evaluate(const batten_frep *a, batten_context *ctx, frep_places_of places_of, size_t count,
                                const double *points, double *values, double *gradients) {
  frep_gather *g = NULL;
  batten_status st = frep_gather_new(ctx, a, count, values, gradients, &g);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    frep_place places[FREP_PLACES];
    unsigned made = places_of(a, points + i * a->n, places);
    for (unsigned k = 0; st >= 0 && k < made; k++) st = frep_gather_add(g, i, places + k);
  }
  if (st >= 0) st = frep_gather_flush(g);
  frep_gather_free(g);
  return st;
}

batten_status frep_map_bounds(const batten_frep *a, batten_context *ctx, frep_images_of images_of, size_t count,
                              const double *boxes, double *ranges, double *slopes) {
  frep_gather *g = NULL;
  batten_status st = frep_gather_boxes(ctx, a, count, ranges, slopes, &g);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    interval x[3];
    frep_box_intervals(a->n, boxes + i * 2 * a->n, x);
    frep_image images[FREP_IMAGES];
    unsigned made = images_of(a, x, images);
    for (unsigned k = 0; st >= 0 && k < made; k++) st = frep_gather_image(g, i, images + k);
  }
  if (st >= 0) st = frep_gather_flush(g);
  frep_gather_free(g);
  return st;
}
