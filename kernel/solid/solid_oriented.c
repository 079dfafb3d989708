/* Fits in which outward unit normals v_i are data, and what holds the field down far away.
 *
 *   gradients   U(x_i) = 0, grad U(x_i) = v_i, no carrier: f = -U falls with slope 1 through every point. The kernel
 *               is the smoothest step above the caller's m that has two derivatives to spare (r^3, r^4 ln r).
 *   pairs       the points x_i +- h_i v_i get f = -+ c h_i, so U = f_c +- c h_i there; c is the carrier's own slope,
 * so that the pairs and the carrier agree on what steep means, whatever the unit of length.
 *
 * Oriented data alone say nothing about far away, where both fits can turn positive: a few points on a sphere of
 * twice the data's size take minus the distance to the data. A pair is shortened, in the end dropped, where it would
 * come nearer to another point of the surface than to its own: thin parts, tight concavities. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/checked.h"
#include "base/points.h"
#include "solid/solid_inner.h"

enum { HALVINGS = 3 };

/* The data of an oriented fit while it is put together: surface points first. */
typedef struct collection {
  unsigned n;
  size_t count, capacity;
  double *points, *values, *smoothing; /* smoothing NULL = the same for all */
} collection;

static batten_status open_collection(batten_context *ctx, const surface_data *d, size_t capacity, collection *c) {
  *c = (collection){.n = d->n, .capacity = capacity};
  c->points = batten_alloc_array(ctx, capacity, d->n * sizeof(double));
  c->values = batten_alloc_array(ctx, capacity, sizeof(double));
  if (!c->points || !c->values) return BATTEN_E_NOMEM;
  if (!d->smoothing) return BATTEN_OK;
  c->smoothing = batten_alloc_array(ctx, capacity, sizeof(double));
  return c->smoothing ? BATTEN_OK : BATTEN_E_NOMEM;
}

static void close_collection(batten_context *ctx, collection *c) {
  batten_free(ctx, c->points);
  batten_free(ctx, c->values);
  batten_free(ctx, c->smoothing);
}

static void add(collection *c, const double *x, double value, double smoothing) {
  memcpy(c->points + c->count * c->n, x, c->n * sizeof *x);
  c->values[c->count] = value;
  if (c->smoothing) c->smoothing[c->count] = smoothing;
  c->count++;
}

static void add_surface(collection *c, const surface_data *d) {
  for (size_t i = 0; i < d->count; i++) add(c, d->points + i * d->n, 0, d->smoothing ? d->smoothing[i] : 0);
}

/* ---- far away ------------------------------------------------------------------------------------ */

enum { SHELLS = 2 };
static const double SHELL_RADII[SHELLS] = {2, 4}; /* in half diagonals of the data's box */

/* Enough that no direction is more than about 30 degrees from one of them. In one dimension the slopes suffice. */
static size_t far_directions(unsigned n) { return n == 3 ? 32 : n == 2 ? 16 : 0; }
static size_t far_count(unsigned n) { return SHELLS * far_directions(n); }

/* f falls a little faster than the distance grows: a spline that contains quadratics then goes on downwards. */
static void add_far(collection *c, const surface_data *d) {
  size_t of = far_directions(d->n);
  for (size_t i = 0; i < SHELLS * of; i++) {
    double at = (double)(i % of), radius = SHELL_RADII[i / of] * d->radius;
    double z = d->n == 3 ? 1 - (2 * at + 1) / (double)of : 0, r = sqrt(1 - z * z);
    double angle = d->n == 3 ? 2.399963229728653 * at : 2 * 3.141592653589793 * at / (double)of;
    double v[3] = {r * cos(angle), r * sin(angle), z}, x[3], distance;
    size_t nearest;
    for (unsigned k = 0; k < d->n; k++) x[k] = d->middle[k] + radius * v[k];
    batten_tree_nearest(d->tree, x, 1, SIZE_MAX, &nearest, &distance);
    add(c, x, -distance * (1 + distance / (2 * d->radius)), 0);
  }
}

static double range_of(size_t count, const double *values) {
  double least = INFINITY, most = -INFINITY;
  for (size_t i = 0; i < count; i++) {
    least = fmin(least, values[i]);
    most = fmax(most, values[i]);
  }
  return most - least;
}

static batten_spline_options spline_options(const batten_solid_options *opt, const collection *c) {
  batten_spline_options o = opt->spline;
  o.smoothing_per_point = c->smoothing;
  return o;
}

/* ---- gradients ----------------------------------------------------------------------------------- */

batten_status batten_solid_fit_gradients(batten_context *ctx, const surface_data *d, const double *normals,
                                         const batten_solid_options *opt, batten_solid **out,
                                         batten_spline_info *info, double *value_range) {
  collection c;
  batten_spline *spline = NULL;
  batten_carrier *none = NULL;
  batten_status st = open_collection(ctx, d, d->count + far_count(d->n), &c);
  if (st < 0) goto done;
  add_surface(&c, d);
  add_far(&c, d);
  for (size_t i = 0; i < c.count; i++) c.values[i] = -c.values[i]; /* U = -f */
  batten_spline_options o = spline_options(opt, &c);
  while (2 * o.m - d->n <= 2) o.m++;
  batten_spline_data data = batten_spline_data_default();
  data.n = d->n;
  data.count = c.count;
  data.points = c.points;
  data.values = c.values;
  data.gradient_count = d->count;
  data.gradients = normals;
  st = batten_spline_fit(ctx, &data, &o, &spline, info);
  if (st == BATTEN_E_SINGULAR) /* its text names an order that the caller has not chosen */
    st = batten_fail(ctx, st,
                     "points: with their normals as gradients the system of %zu points is singular to working "
                     "precision; set opt.orient_data to pairs, or give opt.merge_radius or opt.spline.smoothing",
                     d->count);
  if (st >= 0) st = batten_carrier_none(ctx, d->n, &none);
  if (st >= 0) st = batten_solid_new(ctx, spline, none, 1, d->count, d->points, d->lower, d->upper, out);
  if (st >= 0) *value_range = fmax(range_of(c.count, c.values), d->radius);
done:
  batten_spline_free(spline);
  batten_carrier_free(none);
  close_collection(ctx, &c);
  return st;
}

/* ---- pairs --------------------------------------------------------------------------------------- */

/* x = point i + h side normal */
static void pair_at(const surface_data *d, const double *normals, size_t i, int side, double h, double *x) {
  for (unsigned k = 0; k < d->n; k++) x[k] = d->points[i * d->n + k] + side * h * normals[i * d->n + k];
}

/* The longest h, h / 2, ... that keeps the pair nearest to its own point; 0 when there is none. */
static double place_pair(const surface_data *d, const double *normals, size_t i, int side, double h) {
  for (int halving = 0; halving <= HALVINGS; halving++, h /= 2) {
    size_t nearest;
    double distance, x[3];
    pair_at(d, normals, i, side, h, x);
    batten_tree_nearest(d->tree, x, 1, SIZE_MAX, &nearest, &distance);
    if (nearest == i) return h;
  }
  return 0;
}

typedef struct pair_query {
  const surface_data *data;
  const double *normals;
  const unsigned char *bearer; /* [count] whether it has a pair */
  double pair_distance;
  double *heights; /* [count][2] outside, inside; 0: none */
} pair_query;

static void place_pairs(void *arg, size_t i) {
  const pair_query *q = arg;
  const double h = q->pair_distance * q->data->spacing[i];
  q->heights[2 * i] = q->heights[2 * i + 1] = 0;
  if (!q->bearer[i]) return;
  q->heights[2 * i] = place_pair(q->data, q->normals, i, 1, h);
  q->heights[2 * i + 1] = place_pair(q->data, q->normals, i, -1, h);
}

typedef struct meeting_query {
  const collection *c;
  const batten_tree *tree;
  size_t first;
  unsigned char *gone; /* [count - first] whether somebody is near */
} meeting_query;

static double meeting_radius(const collection *c, size_t i) { return 0.1 * fabs(c->values[i]); }

static void find_meeting(void *arg, size_t i) {
  const meeting_query *q = arg;
  const collection *c = q->c;
  q->gone[i] = batten_tree_any_within(q->tree, c->points + (q->first + i) * c->n, meeting_radius(c, q->first + i), i);
}

/* Drops points off the surface, from `first` on, that come nearer to an earlier one than a tenth of their height:
 * both sides of something thin meet in its middle. Nearly all meet nobody, which is found by tasks. */
static batten_status drop_meeting(batten_context *ctx, collection *c, size_t first) {
  size_t n = c->n, count = c->count - first, kept = first;
  batten_tree *tree = NULL;
  size_t *near = batten_alloc_array(ctx, count, sizeof *near);
  unsigned char *gone = batten_alloc_array(ctx, count, 1);
  batten_status st = near && gone ? batten_tree_new(ctx, c->n, count, c->points + first * n, &tree) : BATTEN_E_NOMEM;
  meeting_query q = {c, tree, first, gone};
  if (st >= 0) st = batten_for_points(ctx, "pairs", count, find_meeting, &q);
  if (st < 0) goto done;
  for (size_t i = 0; i < count; i++) {
    if (!gone[i]) continue;
    size_t found = batten_tree_within(tree, c->points + (first + i) * n, meeting_radius(c, first + i), near);
    gone[i] = 0;
    for (size_t j = 0; j < found; j++) gone[i] = gone[i] || (near[j] < i && !gone[near[j]]);
  }
  for (size_t i = 0; i < count; i++) {
    if (gone[i]) continue;
    memmove(c->points + kept * n, c->points + (first + i) * n, n * sizeof(double));
    c->values[kept] = c->values[first + i];
    if (c->smoothing) c->smoothing[kept] = c->smoothing[first + i];
    kept++;
  }
  c->count = kept;
done:
  batten_tree_free(ctx, tree);
  batten_free(ctx, near);
  batten_free(ctx, gone);
  return st;
}

static int compare_doubles(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

/* Median of |grad f_c| at the points, 1 where the carrier is flat. */
static batten_status slope_of(batten_context *ctx, const batten_carrier *carrier, const surface_data *d,
                              double *slope) {
  size_t n = d->n;
  double *gradients = batten_alloc_array(ctx, d->count, n * sizeof *gradients);
  double *lengths = batten_alloc_array(ctx, d->count, sizeof *lengths);
  batten_status st = gradients && lengths ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0) st = batten_carrier_evaluate(ctx, carrier, d->count, d->points, NULL, gradients, NULL);
  if (st < 0) goto done;
  for (size_t i = 0; i < d->count; i++) {
    double square = 0;
    for (size_t k = 0; k < n; k++) square += gradients[i * n + k] * gradients[i * n + k];
    lengths[i] = sqrt(square);
  }
  qsort(lengths, d->count, sizeof *lengths, compare_doubles);
  *slope = lengths[d->count / 2] > 0 ? lengths[d->count / 2] : 1;
done:
  batten_free(ctx, gradients);
  batten_free(ctx, lengths);
  return st;
}

/* Up to so many points each has its pair: the sign and slope are then wanted everywhere, and the system of three
 * times as many unknowns is still small. Above that every point keeps its own zero, and of eight that lie together,
 * as a tree has them, one has a pair, another one where it looks the other way: the two sides of something thin. */
enum { PAIRS_EVERYWHERE = 50000, TOGETHER = 8 };

/* bearer [count]: whether a point gets a pair. */
static batten_status choose_bearers(batten_context *ctx, const surface_data *d, const double *normals,
                                    unsigned char *bearer) {
  memset(bearer, d->count <= PAIRS_EVERYWHERE, d->count);
  if (d->count <= PAIRS_EVERYWHERE) return BATTEN_OK;
  size_t *order = batten_alloc_array(ctx, d->count, sizeof *order);
  if (!order) return BATTEN_E_NOMEM;
  batten_tree_order(d->tree, order);
  for (size_t low = 0; low < d->count; low += TOGETHER) {
    const double *first = normals + order[low] * d->n;
    bearer[order[low]] = 1;
    for (size_t q = low + 1; q < low + TOGETHER && q < d->count; q++) {
      const double *v = normals + order[q] * d->n;
      double along = 0;
      for (unsigned k = 0; k < d->n; k++) along += first[k] * v[k];
      if (along >= 0) continue;
      bearer[order[q]] = 1;
      break;
    }
  }
  batten_free(ctx, order);
  return BATTEN_OK;
}

/* Surface points and pairs with their heights, f over the slope. */
static batten_status collect_pairs(batten_context *ctx, const surface_data *d, const double *normals,
                                   const unsigned char *bearer, double pair_distance, collection *c) {
  double *heights = batten_alloc_array(ctx, d->count, 2 * sizeof *heights);
  pair_query q = {d, normals, bearer, pair_distance, heights};
  batten_status st = heights ? batten_for_points(ctx, "pairs", d->count, place_pairs, &q) : BATTEN_E_NOMEM;
  add_surface(c, d);
  for (size_t i = 0; st >= 0 && i < d->count; i++)
    for (int side = 1; side >= -1; side -= 2) {
      double x[3], h = heights[2 * i + (side < 0)];
      if (!(h > 0)) continue;
      pair_at(d, normals, i, side, h, x);
      add(c, x, -side * h, d->smoothing ? d->smoothing[i] : 0);
    }
  batten_free(ctx, heights);
  return st < 0 ? st : drop_meeting(ctx, c, d->count);
}

/* Turns the heights of f into the values of U = f_c - slope f. Far points, from first_far on, stay only where the
 * carrier is not far down by itself: there U is better left to follow it (a quadratic carrier rises above a U that is
 * tied down at a few places). */
static void subtract_from_carrier(collection *c, size_t first_far, double slope, const double *of_carrier) {
  size_t kept = first_far, n = c->n;
  for (size_t i = 0; i < c->count; i++) {
    double f = slope * c->values[i];
    if (i < first_far) {
      c->values[i] = of_carrier[i] - f;
    } else if (of_carrier[i] > f / 4) {
      memmove(c->points + kept * n, c->points + i * n, n * sizeof(double));
      if (c->smoothing) c->smoothing[kept] = c->smoothing[i];
      c->values[kept++] = of_carrier[i] - f;
    }
  }
  c->count = kept;
}

batten_status batten_solid_fit_pairs(batten_context *ctx, const surface_data *d, const double *normals,
                                     batten_carrier *carrier, const batten_solid_options *opt, batten_solid **out,
                                     batten_spline_info *info, batten_spline_reduce_info *reduced,
                                     double *value_range) {
  collection c = {0};
  batten_spline *spline = NULL;
  double *of_carrier = NULL, slope = 1;
  size_t capacity;
  unsigned char *bearer = batten_alloc_array(ctx, d->count, 1);
  batten_status st = bearer ? choose_bearers(ctx, d, normals, bearer) : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  capacity = d->count;
  for (size_t i = 0; i < d->count; i++) capacity += 2u * bearer[i]; /* far from overflow: the points are held */
  st = open_collection(ctx, d, capacity + far_count(d->n), &c);
  if (st >= 0) st = collect_pairs(ctx, d, normals, bearer, opt->pair_distance, &c);
  if (st >= 0) st = slope_of(ctx, carrier, d, &slope);
  if (st < 0) goto done;
  size_t first_far = c.count;
  add_far(&c, d);
  of_carrier = batten_alloc_array(ctx, c.count, sizeof *of_carrier);
  st = of_carrier ? batten_carrier_evaluate(ctx, carrier, c.count, c.points, of_carrier, NULL, NULL) : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  subtract_from_carrier(&c, first_far, slope, of_carrier);
  batten_spline_options o = spline_options(opt, &c);
  batten_spline_data data = batten_spline_data_default();
  data.n = d->n;
  data.count = c.count;
  data.points = c.points;
  data.values = c.values;
  st = batten_solid_fit_spline(ctx, opt, carrier, d->count, &data, &o, &spline, info, reduced);
  if (st >= 0) st = batten_solid_new(ctx, spline, carrier, 1, d->count, d->points, d->lower, d->upper, out);
  if (st >= 0) *value_range = range_of(c.count, c.values);
done:
  batten_spline_free(spline);
  batten_free(ctx, bearer);
  batten_free(ctx, of_carrier);
  close_collection(ctx, &c);
  return st;
}
