/* Leaves that the caller has: carriers, solids of any kind, polygons. */
#include "base/checked.h"
#include "basis/polygon.h"
#include "frep/frep_inner.h"
#include "solid/carrier_inner.h"
#include "solid/solid_form.h"

/* ---- carriers and solids: fields ------------------------------------------------------------------------ */

static batten_field field_of(const batten_frep *a) {
  return a->carrier ? batten_carrier_field(a->carrier) : batten_solid_field(a->solid);
}

static batten_status field_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                    double *values, double *gradients) {
  batten_field field = field_of(a);
  return field.evaluate(field.user, ctx, count, points, values, gradients, NULL);
}

static batten_status field_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                  double *ranges) {
  batten_field field = field_of(a);
  if (field.bounds) return field.bounds(field.user, ctx, count, boxes, ranges);
  for (size_t i = 0; i < count; i++) {
    ranges[2 * i] = -INFINITY;
    ranges[2 * i + 1] = INFINITY;
  }
  return BATTEN_OK;
}

/* Kinds that are signed distances. */
static bool carrier_is_distance(const batten_carrier *c) {
  return c->kind == BATTEN_CARRIER_BOX || c->kind == BATTEN_CARRIER_CYLINDER || c->kind == BATTEN_CARRIER_TORUS ||
         c->kind == BATTEN_CARRIER_HALF_SPACE;
}

static batten_status field_both(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                double *ranges, double *slopes) {
  if (a->carrier) return batten_carrier_slopes(ctx, a->carrier, count, boxes, ranges, slopes);
  return batten_solid_slopes(ctx, a->solid, count, boxes, ranges, slopes);
}

/* Box of one carrier without children: half sizes about its middle. 1e-8: rotations and axes are right to 1e-9. */
static bool shape_box(const batten_carrier *c, double *lower, double *upper) {
  const double *v = c->parameters;
  const unsigned n = c->n;
  double half[3];
  const double *middle = c->kind == BATTEN_CARRIER_CYLINDER ? c->middle : v;
  for (unsigned k = 0; k < n; k++) {
    double across = sqrt(fmax(1 - c->axis[k] * c->axis[k], 0)), sum = 0, squares = 0;
    for (unsigned i = 0; i < n && (c->kind == BATTEN_CARRIER_BOX || c->kind == BATTEN_CARRIER_ELLIPSOID); i++) {
      double reach = fabs(v[2 * n + i * n + k]) * v[n + i]; /* of the local axis i along k */
      sum += reach;
      squares += reach * reach;
    }
    switch (c->kind) {
      case BATTEN_CARRIER_BALL:
        half[k] = v[n];
        break;
      case BATTEN_CARRIER_ELLIPSOID:
        half[k] = sqrt(squares);
        break;
      case BATTEN_CARRIER_BOX:
        half[k] = sum;
        break;
      case BATTEN_CARRIER_CYLINDER:
        half[k] = fabs(c->axis[k]) * c->half_length + across * v[6];
        break;
      case BATTEN_CARRIER_TORUS:
        half[k] = across * v[6] + v[7];
        break;
      default:
        return false;
    }
  }
  double size = 0;
  for (unsigned k = 0; k < n; k++) size = fmax(size, half[k]);
  for (unsigned k = 0; k < n; k++) {
    interval r = interval_add(interval_of(middle[k]), interval_of(half[k] + 1e-8 * size));
    upper[k] = r.hi;
    r = interval_sub(interval_of(middle[k]), interval_of(half[k] + 1e-8 * size));
    lower[k] = r.lo;
  }
  return true;
}

/* A reconstructed solid may bulge beyond its data between them: by how much the data do not tell. A quarter of the
 * diagonal is far more than a solid does that has passed the check of its sign. */
static bool solid_box(const batten_solid *s, double *lower, double *upper) {
  const unsigned n = batten_solid_dimension(s);
  double diagonal = 0;
  batten_solid_box(s, lower, upper);
  for (unsigned k = 0; k < n; k++) diagonal = hypot(diagonal, upper[k] - lower[k]);
  for (unsigned k = 0; k < n; k++) {
    lower[k] -= diagonal / 4;
    upper[k] += diagonal / 4;
  }
  return true;
}

/* Recursion no deeper than CARRIER_DEPTH. */
static bool carrier_box_of(const batten_carrier *c, double *lower, double *upper) {
  if (c->kind == BATTEN_CARRIER_SOLID) return solid_box(c->solid, lower, upper);
  if (!c->children[0]) return shape_box(c, lower, upper);
  double low[3], high[3];
  bool all = c->kind == BATTEN_CARRIER_UNION;
  bool first = carrier_box_of(c->children[0], lower, upper), second = carrier_box_of(c->children[1], low, high);
  for (unsigned k = 0; second && k < c->n; k++) {
    lower[k] = !first ? low[k] : all ? fmin(lower[k], low[k]) : fmax(lower[k], low[k]);
    upper[k] = !first ? high[k] : all ? fmax(upper[k], high[k]) : fmin(upper[k], high[k]);
  }
  return all ? first && second : first || second;
}

static bool carrier_box(const batten_frep *a, double *lower, double *upper) {
  return carrier_box_of(a->carrier, lower, upper);
}

static bool solid_leaf_box(const batten_frep *a, double *lower, double *upper) {
  return solid_box(a->solid, lower, upper);
}

static batten_status check_dimension(batten_context *ctx, const char *name, unsigned n) {
  if (n == 2 || n == 3) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "%s: of dimension %u; give one of dimension 2 or 3", name, n);
}

batten_status batten_frep_carrier(batten_context *ctx, batten_carrier *carrier, batten_frep **out) {
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0 && !carrier) st = batten_fail(ctx, BATTEN_E_INVALID, "carrier: NULL; give a carrier");
  if (st >= 0) st = check_dimension(ctx, "carrier", carrier->n);
  if (st < 0) return st;
  batten_frep_parts parts = {.n = carrier->n, .carrier = carrier};
  return frep_make(ctx, &frep_class_carrier, &parts, carrier_is_distance(carrier), NULL, out);
}

batten_status batten_frep_solid(batten_context *ctx, batten_solid *solid, batten_frep **out) {
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0 && !solid) st = batten_fail(ctx, BATTEN_E_INVALID, "solid: NULL; give a solid");
  if (st >= 0) st = check_dimension(ctx, "solid", batten_solid_dimension(solid));
  if (st < 0) return st;
  batten_frep_parts parts = {.n = batten_solid_dimension(solid), .solid = solid};
  return frep_make(ctx, &frep_class_solid, &parts, false, NULL, out);
}

static batten_status create_carrier(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  batten_status st = frep_check_parts(ctx, parts, 0, 0);
  return st < 0 ? st : batten_frep_carrier(ctx, parts->carrier, out);
}
static batten_status create_solid(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  batten_status st = frep_check_parts(ctx, parts, 0, 0);
  return st < 0 ? st : batten_frep_solid(ctx, parts->solid, out);
}

const frep_class frep_class_carrier = {.kind = BATTEN_FREP_KIND_CARRIER,
                                       .name = "carrier",
                                       .evaluate = field_evaluate,
                                       .bounds = field_bounds,
                                       .both = field_both,
                                       .box = carrier_box,
                                       .create = create_carrier};
const frep_class frep_class_solid = {.kind = BATTEN_FREP_KIND_SOLID,
                                     .name = "solid",
                                     .evaluate = field_evaluate,
                                     .bounds = field_bounds,
                                     .both = field_both,
                                     .box = solid_leaf_box,
                                     .create = create_solid};

/* ---- polygons ------------------------------------------------------------------------------------------- */

enum { POLYGON_CHUNK = 128 }; /* points of a task: a fraction of a millisecond */

typedef struct polygon_task {
  const polygon_set *set;
  size_t count;
  const double *points;
  double *values, *gradients;
} polygon_task;

/* Towards the inside: along the way from or to the nearest point where that is a corner; elsewhere across the nearest
 * edge, whose left side is the inside, which holds on the edge too. */
static void polygon_gradient(const polygon_set *p, const double *x, double f, const double *near, size_t edge,
                             double *g) {
  size_t loop = 0, high = p->count;
  while (high - loop > 1) { /* the loop that the edge belongs to */
    size_t middle = (loop + high) / 2;
    if (p->starts[middle] <= edge)
      loop = middle;
    else
      high = middle;
  }
  const double *from = p->points + 2 * edge;
  const double *to = p->points + 2 * (edge + 1 < p->starts[loop + 1] ? edge + 1 : p->starts[loop]);
  bool corner = (near[0] == from[0] && near[1] == from[1]) || (near[0] == to[0] && near[1] == to[1]);
  double dx = corner ? x[0] - near[0] : from[1] - to[1], dy = corner ? x[1] - near[1] : to[0] - from[0];
  double length = hypot(dx, dy), turn = corner && f < 0 ? -1 : 1;
  if (!(length > 0)) { /* on a corner */
    dx = from[1] - to[1];
    dy = to[0] - from[0];
    length = hypot(dx, dy);
  }
  g[0] = turn * dx / length;
  g[1] = turn * dy / length;
}

static void polygon_chunk(void *arg, size_t index) {
  const polygon_task *t = arg;
  size_t last = (index + 1) * POLYGON_CHUNK < t->count ? (index + 1) * POLYGON_CHUNK : t->count;
  for (size_t i = index * POLYGON_CHUNK; i < last; i++) {
    double near[2];
    size_t edge;
    t->values[i] = polygon_distance(t->set, t->points + 2 * i, near, &edge);
    if (t->gradients) polygon_gradient(t->set, t->points + 2 * i, t->values[i], near, edge, t->gradients + 2 * i);
  }
}

static batten_status polygon_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                      double *values, double *gradients) {
  polygon_task task = {a->state, count, points, values, gradients};
  batten_parallel(ctx, (count + POLYGON_CHUNK - 1) / POLYGON_CHUNK, polygon_chunk, &task);
  return BATTEN_OK;
}

static batten_status polygon_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                    double *ranges) {
  (void)ctx;
  for (size_t i = 0; i < count; i++)
    polygon_distance_bounds(a->state, boxes + 4 * i, boxes + 4 * i + 2, ranges + 2 * i);
  return BATTEN_OK;
}

static bool polygon_box(const batten_frep *a, double *lower, double *upper) {
  const polygon_set *set = a->state;
  for (unsigned k = 0; k < 2; k++) {
    lower[k] = set->lower[k];
    upper[k] = set->upper[k];
  }
  return true;
}

static void polygon_release(void *state) {
  polygon_set *set = state;
  batten_context *ctx = set->ctx;
  polygon_set_free(set);
  batten_free(ctx, set);
}

static batten_status check_polygon(batten_context *ctx, size_t count, const size_t *starts, const double *points) {
  if (count == 0) return batten_fail(ctx, BATTEN_E_INVALID, "count: 0; give at least one polygon");
  if (!starts) return batten_fail(ctx, BATTEN_E_INVALID, "starts: NULL; give %zu numbers", count + 1);
  if (starts[0] != 0) return batten_fail(ctx, BATTEN_E_INVALID, "starts[0]: %zu; give 0", starts[0]);
  for (size_t i = 0; i < count; i++)
    if (starts[i + 1] < starts[i] || starts[i + 1] - starts[i] < 3)
      return batten_fail(ctx, BATTEN_E_INVALID, "starts[%zu]: %zu after %zu; give each polygon at least 3 points",
                         i + 1, starts[i + 1], starts[i]);
  size_t all;
  if (!batten_mul(starts[count], 2, &all))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "starts[%zu]: %zu points", count, starts[count]);
  if (!points) return batten_fail(ctx, BATTEN_E_INVALID, "points: NULL; give [%zu][2] numbers", starts[count]);
  for (size_t i = 0; i < all; i++)
    if (!(fabs(points[i]) < 1e150))
      return batten_fail(ctx, BATTEN_E_INVALID, "points[%zu][%zu]: %g; give a finite coordinate below 1e150", i / 2,
                         i % 2, points[i]);
  return BATTEN_OK;
}

batten_status batten_frep_polygon(batten_context *ctx, size_t count, const size_t *starts, const double *points,
                                  batten_frep **out) {
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0) st = check_polygon(ctx, count, starts, points);
  if (st < 0) return st;
  polygon_set *set = batten_alloc(ctx, sizeof *set);
  if (!set) return BATTEN_E_NOMEM;
  *set = (polygon_set){0};
  polygon_fault fault = {0};
  st = polygon_set_make(ctx, count, starts, points, 0, set, NULL, &fault);
  if (st < 0 && fault.kind == POLYGON_CROSSING)
    st =
        batten_fail(ctx, BATTEN_E_INVALID,
                    "points: polygons %zu (edge %zu) and %zu (edge %zu) cross at (%g, %g); give polygons that do not "
                    "cross",
                    fault.loop[0], fault.edge[0], fault.loop[1], fault.edge[1], fault.at[0], fault.at[1]);
  if (st >= 0 && set->count == 0)
    st = batten_fail(ctx, BATTEN_E_INVALID,
                     "points: no polygon has an area; give polygons with three different points");
  batten_frep_parts parts = {
      .n = 2, .number_count = 2 * starts[count], .numbers = points, .start_count = count + 1, .starts = starts};
  if (st >= 0) st = frep_make(ctx, &frep_class_polygon, &parts, true, set, out);
  if (st < 0) {
    polygon_set_free(set);
    batten_free(ctx, set);
  }
  return st;
}

static batten_status create_polygon(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  size_t count = parts->start_count;
  if (count < 2 || !parts->starts || parts->number_count % 2 || parts->starts[count - 1] != parts->number_count / 2)
    return batten_fail(
        ctx, BATTEN_E_INVALID,
        "parts.starts: a node \"polygon\" takes the first point of each polygon, and the count of all; "
        "%zu starts are given with %zu numbers",
        count, parts->number_count);
  return batten_frep_polygon(ctx, count - 1, parts->starts, parts->numbers, out);
}

const frep_class frep_class_polygon = {.kind = BATTEN_FREP_KIND_POLYGON,
                                       .name = "polygon",
                                       .evaluate = polygon_evaluate,
                                       .bounds = polygon_bounds,
                                       .box = polygon_box,
                                       .create = create_polygon,
                                       .release = polygon_release};
