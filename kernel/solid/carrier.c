/* Carriers: making, sharing, evaluating, saving. The formulas are in carrier_shapes.c and carrier_compose.c. */
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "solid/carrier_inner.h"
#include "solid/solid_form.h"

/* ---- making -------------------------------------------------------------------------------------- */

static batten_status check_out(batten_context *ctx, const void *out) {
  return out ? BATTEN_OK : batten_fail(ctx, BATTEN_E_INVALID, "out: NULL; give the place for the carrier");
}

static batten_status check_dimension(batten_context *ctx, unsigned n) {
  if (n >= 1 && n <= 3) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "n: %u; give 1, 2 or 3", n);
}

static batten_status check_numbers(batten_context *ctx, const char *name, size_t count, const double *values) {
  if (!values) return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give %zu numbers", name, count);
  size_t bad = batten_first_nonfinite(count, values);
  if (bad == count) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "%s[%zu]: %g; give a finite number", name, bad, values[bad]);
}

static batten_status check_positive(batten_context *ctx, const char *name, size_t count, const double *values) {
  batten_status st = check_numbers(ctx, name, count, values);
  for (size_t i = 0; st >= 0 && i < count; i++)
    if (!(values[i] > 0)) {
      st = batten_fail(ctx, BATTEN_E_INVALID, "%s[%zu]: %g; give a positive length", name, i, values[i]);
      break;
    }
  return st;
}

static batten_status check_length(batten_context *ctx, const char *name, double value) {
  if (value > 0 && isfinite(value)) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "%s: %g; give a positive finite length", name, value);
}

static batten_status check_rounding(batten_context *ctx, double rounding, double limit) {
  if (rounding >= 0 && rounding <= limit) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "rounding: %g; give 0 to %g, the smallest half extent", rounding, limit);
}

static batten_status check_rotation(batten_context *ctx, unsigned n, const double *rotation) {
  batten_status st = check_numbers(ctx, "rotation", (size_t)n * n, rotation);
  for (unsigned i = 0; st >= 0 && i < n; i++)
    for (unsigned j = 0; st >= 0 && j <= i; j++) {
      double dot = 0;
      for (unsigned k = 0; k < n; k++) dot += rotation[i * n + k] * rotation[j * n + k];
      /* 1e-9: what the header promises; rotations from single precision files must be made orthonormal first */
      if (fabs(dot - (i == j)) > 1e-9)
        st = batten_fail(ctx, BATTEN_E_INVALID,
                         "rotation: rows %u and %u have the product %.12g, not %d; give "
                         "orthonormal rows",
                         j, i, dot, i == j);
    }
  return st;
}

static double norm(unsigned n, const double *v) {
  double sum = 0;
  for (unsigned i = 0; i < n; i++) sum += v[i] * v[i];
  return sqrt(sum);
}

static batten_status check_direction(batten_context *ctx, const char *name, unsigned n, const double *v) {
  batten_status st = check_numbers(ctx, name, n, v);
  double length = st < 0 ? 1 : norm(n, v);
  if (length > 0 && isfinite(length)) return st;
  return batten_fail(ctx, BATTEN_E_INVALID, "%s: its length is %g; give a direction", name, length);
}

static batten_carrier *new_carrier(batten_context *ctx, batten_carrier_kind kind, unsigned n) {
  batten_carrier *c = batten_alloc(ctx, sizeof *c);
  if (!c) return NULL;
  *c = (batten_carrier){.ctx = ctx, .kind = kind, .n = n};
  atomic_init(&c->owners, 1);
  return c;
}

static void append(batten_carrier *c, size_t count, const double *values) {
  memcpy(c->parameters + c->parameter_count, values, count * sizeof *values);
  c->parameter_count += count;
}

static void append_rotation(batten_carrier *c, const double *rotation) {
  const double identity[3][9] = {{1}, {1, 0, 0, 1}, {1, 0, 0, 0, 1, 0, 0, 0, 1}};
  append(c, (size_t)c->n * c->n, rotation ? rotation : identity[c->n - 1]);
}

static void set_axis(batten_carrier *c, unsigned n, const double *direction) {
  double length = norm(n, direction);
  for (unsigned i = 0; i < n; i++) c->axis[i] = direction[i] / length;
}

batten_status batten_carrier_none(batten_context *ctx, unsigned n, batten_carrier **out) {
  batten_status st = check_out(ctx, out);
  if (st >= 0) st = check_dimension(ctx, n);
  if (st < 0) return st;
  batten_carrier *c = new_carrier(ctx, BATTEN_CARRIER_NONE, n);
  if (!c) return BATTEN_E_NOMEM;
  *out = c;
  return BATTEN_OK;
}

batten_status batten_carrier_ball(batten_context *ctx, unsigned n, const double *center, double radius,
                                  batten_carrier **out) {
  batten_status st = check_out(ctx, out);
  if (st >= 0) st = check_dimension(ctx, n);
  if (st >= 0) st = check_numbers(ctx, "center", n, center);
  if (st >= 0) st = check_length(ctx, "radius", radius);
  if (st < 0) return st;
  batten_carrier *c = new_carrier(ctx, BATTEN_CARRIER_BALL, n);
  if (!c) return BATTEN_E_NOMEM;
  append(c, n, center);
  append(c, 1, &radius);
  *out = c;
  return BATTEN_OK;
}

batten_status batten_carrier_ellipsoid(batten_context *ctx, unsigned n, const double *center, const double *semi_axes,
                                       const double *rotation, batten_carrier **out) {
  batten_status st = check_out(ctx, out);
  if (st >= 0) st = check_dimension(ctx, n);
  if (st >= 0) st = check_numbers(ctx, "center", n, center);
  if (st >= 0) st = check_positive(ctx, "semi_axes", n, semi_axes);
  if (st >= 0 && rotation) st = check_rotation(ctx, n, rotation);
  if (st < 0) return st;
  batten_carrier *c = new_carrier(ctx, BATTEN_CARRIER_ELLIPSOID, n);
  if (!c) return BATTEN_E_NOMEM;
  append(c, n, center);
  append(c, n, semi_axes);
  append_rotation(c, rotation);
  *out = c;
  return BATTEN_OK;
}

batten_status batten_carrier_box(batten_context *ctx, unsigned n, const double *center, const double *half_extents,
                                 const double *rotation, double rounding, batten_carrier **out) {
  batten_status st = check_out(ctx, out);
  if (st >= 0) st = check_dimension(ctx, n);
  if (st >= 0) st = check_numbers(ctx, "center", n, center);
  if (st >= 0) st = check_positive(ctx, "half_extents", n, half_extents);
  if (st >= 0 && rotation) st = check_rotation(ctx, n, rotation);
  double least = INFINITY;
  for (unsigned i = 0; st >= 0 && i < n; i++) least = fmin(least, half_extents[i]);
  if (st >= 0) st = check_rounding(ctx, rounding, least);
  if (st < 0) return st;
  batten_carrier *c = new_carrier(ctx, BATTEN_CARRIER_BOX, n);
  if (!c) return BATTEN_E_NOMEM;
  append(c, n, center);
  append(c, n, half_extents);
  append_rotation(c, rotation);
  append(c, 1, &rounding);
  *out = c;
  return BATTEN_OK;
}

batten_status batten_carrier_cylinder(batten_context *ctx, const double a[3], const double b[3], double radius,
                                      double rounding, batten_carrier **out) {
  batten_status st = check_out(ctx, out);
  if (st >= 0) st = check_numbers(ctx, "a", 3, a);
  if (st >= 0) st = check_numbers(ctx, "b", 3, b);
  if (st >= 0) st = check_length(ctx, "radius", radius);
  if (st < 0) return st;
  double along[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, length = norm(3, along);
  if (!(length > 0 && isfinite(length)))
    return batten_fail(ctx, BATTEN_E_INVALID, "b: at distance %g from a; give two different ends", length);
  st = check_rounding(ctx, rounding, fmin(radius, length / 2));
  if (st < 0) return st;
  batten_carrier *c = new_carrier(ctx, BATTEN_CARRIER_CYLINDER, 3);
  if (!c) return BATTEN_E_NOMEM;
  append(c, 3, a);
  append(c, 3, b);
  append(c, 1, &radius);
  append(c, 1, &rounding);
  set_axis(c, 3, along);
  for (unsigned i = 0; i < 3; i++) c->middle[i] = a[i] + along[i] / 2;
  c->half_length = length / 2;
  *out = c;
  return BATTEN_OK;
}

batten_status batten_carrier_torus(batten_context *ctx, const double center[3], const double axis[3],
                                   double major_radius, double minor_radius, batten_carrier **out) {
  batten_status st = check_out(ctx, out);
  if (st >= 0) st = check_numbers(ctx, "center", 3, center);
  if (st >= 0) st = check_direction(ctx, "axis", 3, axis);
  if (st >= 0) st = check_length(ctx, "major_radius", major_radius);
  if (st >= 0) st = check_length(ctx, "minor_radius", minor_radius);
  if (st >= 0 && minor_radius >= major_radius)
    st = batten_fail(ctx, BATTEN_E_INVALID, "minor_radius: %g; give less than major_radius, %g", minor_radius,
                     major_radius);
  if (st < 0) return st;
  batten_carrier *c = new_carrier(ctx, BATTEN_CARRIER_TORUS, 3);
  if (!c) return BATTEN_E_NOMEM;
  append(c, 3, center);
  append(c, 3, axis);
  append(c, 1, &major_radius);
  append(c, 1, &minor_radius);
  set_axis(c, 3, axis);
  *out = c;
  return BATTEN_OK;
}

batten_status batten_carrier_half_space(batten_context *ctx, unsigned n, const double *point, const double *normal,
                                        batten_carrier **out) {
  batten_status st = check_out(ctx, out);
  if (st >= 0) st = check_dimension(ctx, n);
  if (st >= 0) st = check_numbers(ctx, "point", n, point);
  if (st >= 0) st = check_direction(ctx, "normal", n, normal);
  if (st < 0) return st;
  batten_carrier *c = new_carrier(ctx, BATTEN_CARRIER_HALF_SPACE, n);
  if (!c) return BATTEN_E_NOMEM;
  append(c, n, point);
  append(c, n, normal);
  set_axis(c, n, normal);
  *out = c;
  return BATTEN_OK;
}

static batten_status compose(batten_context *ctx, batten_carrier_kind kind, batten_carrier *a, batten_carrier *b,
                             double alpha, batten_carrier **out) {
  batten_status st = check_out(ctx, out);
  if (st < 0) return st;
  if (!a || !b) return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give two carriers", a ? "b" : "a");
  if (a->n != b->n)
    return batten_fail(ctx, BATTEN_E_INVALID, "b: of dimension %u beside a of dimension %u; give equal ones", b->n,
                       a->n);
  if (!(alpha > -1 && alpha <= 1))
    return batten_fail(ctx, BATTEN_E_INVALID, "alpha: %g; give -1 < alpha <= 1 (0 smooth, 1 max and min)", alpha);
  unsigned depth = 1 + (a->depth > b->depth ? a->depth : b->depth);
  if (depth > CARRIER_DEPTH)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE,
                       "a, b: nested %u levels deep, %d are allowed; combine in pairs rather "
                       "than in a chain",
                       depth, CARRIER_DEPTH);
  batten_carrier *c = new_carrier(ctx, kind, a->n);
  if (!c) return BATTEN_E_NOMEM;
  append(c, 1, &alpha);
  c->depth = depth;
  c->children[0] = batten_carrier_retain(a);
  c->children[1] = batten_carrier_retain(b);
  *out = c;
  return BATTEN_OK;
}

batten_status batten_carrier_union(batten_context *ctx, batten_carrier *a, batten_carrier *b, double alpha,
                                   batten_carrier **out) {
  return compose(ctx, BATTEN_CARRIER_UNION, a, b, alpha, out);
}

batten_status batten_carrier_intersection(batten_context *ctx, batten_carrier *a, batten_carrier *b, double alpha,
                                          batten_carrier **out) {
  return compose(ctx, BATTEN_CARRIER_INTERSECTION, a, b, alpha, out);
}

batten_status batten_carrier_callback(batten_context *ctx, const batten_field *field, double difference_step,
                                      batten_carrier **out) {
  batten_status st = check_out(ctx, out);
  if (st < 0) return st;
  if (!field || !field->evaluate)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give the function", field ? "field->evaluate" : "field");
  if (field->dimension < 1 || field->dimension > 3)
    return batten_fail(ctx, BATTEN_E_INVALID, "field->dimension: %u; give 1, 2 or 3", field->dimension);
  if (field->order > 2) return batten_fail(ctx, BATTEN_E_INVALID, "field->order: %u; give 0, 1 or 2", field->order);
  if (field->order < 2) st = check_length(ctx, "difference_step", difference_step);
  if (st < 0) return st;
  batten_carrier *c = new_carrier(ctx, BATTEN_CARRIER_CALLBACK, field->dimension);
  if (!c) return BATTEN_E_NOMEM;
  c->field = *field;
  c->step = difference_step;
  *out = c;
  return BATTEN_OK;
}

batten_status batten_carrier_solid(batten_context *ctx, batten_solid *solid, batten_carrier **out) {
  batten_status st = check_out(ctx, out);
  if (st < 0) return st;
  if (!solid) return batten_fail(ctx, BATTEN_E_INVALID, "solid: NULL; give a fitted solid");
  unsigned depth = 1 + batten_solid_depth(solid);
  if (depth > CARRIER_DEPTH)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE,
                       "solid: nested %u levels deep, %d are allowed; start again from a "
                       "simple carrier",
                       depth, CARRIER_DEPTH);
  batten_carrier *c = new_carrier(ctx, BATTEN_CARRIER_SOLID, batten_solid_dimension(solid));
  if (!c) return BATTEN_E_NOMEM;
  c->depth = depth;
  c->solid = batten_solid_retain(solid);
  *out = c;
  return BATTEN_OK;
}

/* ---- sharing ------------------------------------------------------------------------------------- */

batten_carrier *batten_carrier_retain(batten_carrier *c) {
  if (c) atomic_fetch_add(&c->owners, 1);
  return c;
}

/* Recursion over the children is no deeper than CARRIER_DEPTH. */
void batten_carrier_free(batten_carrier *c) {
  if (!c || atomic_fetch_sub(&c->owners, 1) != 1) return;
  batten_carrier_free(c->children[0]);
  batten_carrier_free(c->children[1]);
  batten_solid_free(c->solid);
  batten_free(c->ctx, c);
}

/* ---- evaluating ---------------------------------------------------------------------------------- */

/* Values (always), gradients and Hessians (NULL = not wanted) of up to CARRIER_BLOCK points. scratch: room for the
 * second child of each level, level_size numbers a level. Recursion no deeper than CARRIER_DEPTH. */
static batten_status evaluate_block(batten_context *ctx, const batten_carrier *c, size_t count, const double *points,
                                    double *values, double *gradients, double *hessians, double *scratch,
                                    size_t level_size) {
  if (c->kind == BATTEN_CARRIER_CALLBACK)
    return batten_carrier_call(ctx, c, count, points, values, gradients, hessians);
  if (c->kind == BATTEN_CARRIER_SOLID)
    return batten_solid_evaluate(ctx, c->solid, count, points, values, gradients, hessians);
  if (!c->children[0]) {
    batten_carrier_shape(c, count, points, values, gradients, hessians);
    return BATTEN_OK;
  }
  size_t n = c->n;
  double *g = scratch, *dg = gradients ? g + CARRIER_BLOCK : NULL,
         *ddg = hessians ? g + (1 + n) * CARRIER_BLOCK : NULL;
  double *below = scratch + level_size;
  batten_status st =
      evaluate_block(ctx, c->children[0], count, points, values, gradients, hessians, below, level_size);
  if (st >= 0) st = evaluate_block(ctx, c->children[1], count, points, g, dg, ddg, below, level_size);
  if (st >= 0)
    batten_carrier_combine(c->n, c->parameters[0], c->kind == BATTEN_CARRIER_UNION ? 1 : -1, count, values, gradients,
                           hessians, g, dg, ddg);
  return st;
}

static batten_status evaluate_composite(batten_context *ctx, const batten_carrier *c, size_t count,
                                        const double *points, double *values, double *gradients, double *hessians) {
  size_t n = c->n, level_size = (1 + n + n * n) * CARRIER_BLOCK;
  /* A level for what the caller does not want but the R-functions do, and one for each level of children. */
  double *scratch = batten_alloc_array(ctx, (c->depth + 1u) * level_size, sizeof *scratch);
  if (!scratch) return BATTEN_E_NOMEM;
  batten_status st = BATTEN_OK;
  for (size_t first = 0; st >= 0 && first < count; first += CARRIER_BLOCK) {
    size_t now = count - first < CARRIER_BLOCK ? count - first : CARRIER_BLOCK;
    double *f = values ? values + first : scratch;
    double *df = gradients ? gradients + first * n : hessians ? scratch + CARRIER_BLOCK : NULL;
    st = evaluate_block(ctx, c, now, points + first * n, f, df, hessians ? hessians + first * n * n : NULL,
                        scratch + level_size, level_size);
  }
  batten_free(ctx, scratch);
  return st;
}

batten_status batten_carrier_evaluate(batten_context *ctx, const batten_carrier *c, size_t count,
                                      const double *points, double *values, double *gradients, double *hessians) {
  if (!c) return batten_fail(ctx, BATTEN_E_INVALID, "carrier: NULL; give a carrier");
  if (count == 0) return BATTEN_OK;
  if (!points) return batten_fail(ctx, BATTEN_E_INVALID, "points: NULL; give [%zu][%u] numbers", count, c->n);
  if (c->children[0] || c->kind == BATTEN_CARRIER_CALLBACK)
    return evaluate_composite(ctx, c, count, points, values, gradients, hessians);
  return evaluate_block(ctx, c, count, points, values, gradients, hessians, NULL, 0);
}

static batten_status evaluate_field(const void *user, batten_context *ctx, size_t count, const double *points,
                                    double *values, double *gradients, double *hessians) {
  return batten_carrier_evaluate(ctx, user, count, points, values, gradients, hessians);
}

static batten_status bounds_of_field(const void *user, batten_context *ctx, size_t count, const double *boxes,
                                     double *ranges) {
  return batten_carrier_bounds(ctx, user, count, boxes, ranges);
}

batten_field batten_carrier_field(const batten_carrier *c) {
  return (batten_field){
      .dimension = c->n, .order = 2, .evaluate = evaluate_field, .user = c, .bounds = bounds_of_field};
}

/* ---- saving -------------------------------------------------------------------------------------- */

const char *batten_carrier_kind_name(batten_carrier_kind kind) {
  switch (kind) {
    case BATTEN_CARRIER_NONE:
      return "none";
    case BATTEN_CARRIER_BALL:
      return "ball";
    case BATTEN_CARRIER_ELLIPSOID:
      return "ellipsoid";
    case BATTEN_CARRIER_BOX:
      return "box";
    case BATTEN_CARRIER_CYLINDER:
      return "cylinder";
    case BATTEN_CARRIER_TORUS:
      return "torus";
    case BATTEN_CARRIER_HALF_SPACE:
      return "half-space";
    case BATTEN_CARRIER_UNION:
      return "union";
    case BATTEN_CARRIER_INTERSECTION:
      return "intersection";
    case BATTEN_CARRIER_CALLBACK:
      return "callback";
    case BATTEN_CARRIER_SOLID:
      return "solid";
  }
  return "unknown";
}

void batten_carrier_get_parts(const batten_carrier *c, batten_carrier_parts *parts) {
  *parts = (batten_carrier_parts){.kind = c->kind,
                                  .n = c->n,
                                  .parameters = c->parameters,
                                  .parameter_count = c->parameter_count,
                                  .children = {c->children[0], c->children[1]},
                                  .solid = c->solid};
}

/* How many parameters a kind has in n dimensions, SIZE_MAX where it does not exist. */
static size_t parameters_of(batten_carrier_kind kind, size_t n) {
  switch (kind) {
    case BATTEN_CARRIER_NONE:
    case BATTEN_CARRIER_SOLID:
      return 0;
    case BATTEN_CARRIER_BALL:
      return n + 1;
    case BATTEN_CARRIER_ELLIPSOID:
      return 2 * n + n * n;
    case BATTEN_CARRIER_BOX:
      return 2 * n + n * n + 1;
    case BATTEN_CARRIER_CYLINDER:
    case BATTEN_CARRIER_TORUS:
      return n == 3 ? 8 : SIZE_MAX;
    case BATTEN_CARRIER_HALF_SPACE:
      return 2 * n;
    case BATTEN_CARRIER_UNION:
    case BATTEN_CARRIER_INTERSECTION:
      return 1;
    case BATTEN_CARRIER_CALLBACK:
      break;
  }
  return SIZE_MAX;
}

batten_status batten_carrier_create(batten_context *ctx, const batten_carrier_parts *parts, batten_carrier **out) {
  if (!parts) return batten_fail(ctx, BATTEN_E_INVALID, "parts: NULL; give the parts");
  unsigned n = parts->n;
  batten_status st = check_dimension(ctx, n);
  if (st < 0) return st;
  size_t expected = parameters_of(parts->kind, n);
  const char *name = batten_carrier_kind_name(parts->kind);
  if (expected == SIZE_MAX)
    return batten_fail(ctx, BATTEN_E_INVALID, "parts.kind: %s (%d) in %u dimensions cannot be made from parts", name,
                       (int)parts->kind, n);
  if (parts->parameter_count != expected)
    return batten_fail(ctx, BATTEN_E_INVALID, "parts.parameter_count: %zu; a %s in %u dimensions has %zu",
                       parts->parameter_count, name, n, expected);
  const double *p = parts->parameters;
  if (expected && !p) return batten_fail(ctx, BATTEN_E_INVALID, "parts.parameters: NULL; give %zu numbers", expected);
  switch (parts->kind) {
    case BATTEN_CARRIER_NONE:
      return batten_carrier_none(ctx, n, out);
    case BATTEN_CARRIER_BALL:
      return batten_carrier_ball(ctx, n, p, p[n], out);
    case BATTEN_CARRIER_ELLIPSOID:
      return batten_carrier_ellipsoid(ctx, n, p, p + n, p + 2 * n, out);
    case BATTEN_CARRIER_BOX:
      return batten_carrier_box(ctx, n, p, p + n, p + 2 * n, p[2 * n + n * n], out);
    case BATTEN_CARRIER_CYLINDER:
      return batten_carrier_cylinder(ctx, p, p + 3, p[6], p[7], out);
    case BATTEN_CARRIER_TORUS:
      return batten_carrier_torus(ctx, p, p + 3, p[6], p[7], out);
    case BATTEN_CARRIER_HALF_SPACE:
      return batten_carrier_half_space(ctx, n, p, p + n, out);
    case BATTEN_CARRIER_UNION:
    case BATTEN_CARRIER_INTERSECTION:
      for (int i = 0; i < 2; i++)
        if (parts->children[i] && parts->children[i]->n != n)
          return batten_fail(ctx, BATTEN_E_INVALID, "parts.children[%d]: of dimension %u, not %u", i,
                             parts->children[i]->n, n);
      return compose(ctx, parts->kind, parts->children[0], parts->children[1], p[0], out);
    case BATTEN_CARRIER_SOLID:
      if (parts->solid && batten_solid_dimension(parts->solid) != n)
        return batten_fail(ctx, BATTEN_E_INVALID, "parts.solid: of dimension %u, not %u",
                           batten_solid_dimension(parts->solid), n);
      return batten_carrier_solid(ctx, parts->solid, out);
    case BATTEN_CARRIER_CALLBACK:
      break;
  }
  return batten_fail(ctx, BATTEN_E_INTERNAL, "parts.kind: %d", (int)parts->kind);
}
