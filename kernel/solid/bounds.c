/* Bounds of carriers and solids over boxes, from models of their parts (basis/taylor.h): a solid's f is a difference
 * in which the slopes of carrier and spline nearly cancel, so it is their models that are subtracted, not their
 * ranges. */
#include "solid/bounds.h"

#include "base/checked.h"
#include "solid/solid_inner.h"
#include "spline/bounds.h"

static batten_status solid_models(batten_context *ctx, const batten_solid *s, bool wanted, size_t count,
                                  const double *boxes, const taylor_box *split, taylor *models);

typedef batten_status ranges_function(const void *, batten_context *, size_t, const double *, double *);
typedef batten_status slopes_function(const void *, batten_context *, size_t, const double *, double *, double *);

/* Models of a function that gives ranges alone, and slopes where it has them. */
static batten_status ask(batten_context *ctx, const void *user, ranges_function *bounds, slopes_function *slopes,
                         size_t count, const double *boxes, taylor *models) {
  double *ranges = batten_alloc_array(ctx, CARRIER_BLOCK, 4 * sizeof *ranges), *steep = ranges + 2 * CARRIER_BLOCK;
  if (!ranges) return BATTEN_E_NOMEM;
  batten_status st =
      slopes ? slopes(user, ctx, count, boxes, ranges, steep) : bounds(user, ctx, count, boxes, ranges);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    interval s = slopes ? (interval){steep[2 * i], steep[2 * i + 1]} : batten_steep_unknown();
    models[i] = batten_taylor_of_range(ranges[2 * i], ranges[2 * i + 1], s);
  }
  batten_free(ctx, ranges);
  return st;
}

/* Models over up to CARRIER_BLOCK boxes; wanted: slopes are, of forms that take time for them. Recursion no deeper
 * than CARRIER_DEPTH. */
static batten_status carrier_models(batten_context *ctx, const batten_carrier *c, bool wanted, size_t count,
                                    const double *boxes, const taylor_box *split, taylor *models) {
  if (c->kind == BATTEN_CARRIER_SOLID) return solid_models(ctx, c->solid, wanted, count, boxes, split, models);
  if (c->kind == BATTEN_CARRIER_CALLBACK) {
    if (c->field.bounds) return ask(ctx, c->field.user, c->field.bounds, NULL, count, boxes, models);
    for (size_t i = 0; i < count; i++)
      models[i] = batten_taylor_of_range(-INFINITY, INFINITY, batten_steep_unknown());
    return BATTEN_OK;
  }
  if (!c->children[0]) {
    for (size_t i = 0; i < count; i++) models[i] = batten_carrier_shape_model(c, split + i);
    return BATTEN_OK;
  }
  taylor *second = batten_alloc_array(ctx, CARRIER_BLOCK, sizeof *second);
  if (!second) return BATTEN_E_NOMEM;
  batten_status st = carrier_models(ctx, c->children[0], wanted, count, boxes, split, models);
  if (st >= 0) st = carrier_models(ctx, c->children[1], wanted, count, boxes, split, second);
  double sign = c->kind == BATTEN_CARRIER_UNION ? 1 : -1;
  for (size_t i = 0; st >= 0 && i < count; i++)
    models[i] = batten_carrier_join_models(c->n, split + i, c->parameters[0], sign, models + i, second + i);
  batten_free(ctx, second);
  return st;
}

static batten_status solid_models(batten_context *ctx, const batten_solid *s, bool wanted, size_t count,
                                  const double *boxes, const taylor_box *split, taylor *models) {
  if (s->form) return ask(ctx, s->state, s->form->bounds, wanted ? s->form->slopes : NULL, count, boxes, models);
  taylor *splines = batten_alloc_array(ctx, CARRIER_BLOCK, sizeof *splines);
  if (!splines) return BATTEN_E_NOMEM;
  batten_status st = carrier_models(ctx, s->carrier, wanted, count, boxes, split, models);
  if (st >= 0) st = batten_spline_models(ctx, s->spline, count, split, splines);
  for (size_t i = 0; st >= 0 && i < count; i++)
    models[i] = batten_taylor_difference(s->n, split + i, s->sign, models + i, splines + i);
  batten_free(ctx, splines);
  return st;
}

/* Of the solid, or of the carrier where that is NULL, in blocks; slopes may be NULL. */
static batten_status bound(batten_context *ctx, const batten_carrier *c, const batten_solid *s, unsigned n,
                           size_t count, const double *boxes, double *ranges, double *slopes) {
  if (count == 0) return BATTEN_OK;
  batten_status st = batten_check_boxes(ctx, n, count, boxes, ranges);
  if (st < 0) return st;
  taylor_box *split = batten_alloc_array(ctx, CARRIER_BLOCK, sizeof *split);
  taylor *models = split ? batten_alloc_array(ctx, CARRIER_BLOCK, sizeof *models) : NULL;
  if (!models) st = BATTEN_E_NOMEM;
  for (size_t first = 0; st >= 0 && first < count; first += CARRIER_BLOCK) {
    size_t now = count - first < CARRIER_BLOCK ? count - first : CARRIER_BLOCK;
    const double *block = boxes + first * 2 * n;
    for (size_t i = 0; i < now; i++) split[i] = batten_taylor_box(n, block + i * 2 * n);
    st = s ? solid_models(ctx, s, slopes != NULL, now, block, split, models)
           : carrier_models(ctx, c, slopes != NULL, now, block, split, models);
    for (size_t i = 0; st >= 0 && i < now; i++) {
      interval r = batten_taylor_range(n, split + i, models + i);
      ranges[2 * (first + i)] = r.lo;
      ranges[2 * (first + i) + 1] = r.hi;
      if (!slopes) continue;
      r = batten_taylor_steep(n, split + i, models + i);
      slopes[2 * (first + i)] = r.lo;
      slopes[2 * (first + i) + 1] = r.hi;
    }
  }
  batten_free(ctx, models);
  batten_free(ctx, split);
  return st;
}

batten_status batten_carrier_bounds(batten_context *ctx, const batten_carrier *c, size_t count, const double *boxes,
                                    double *ranges) {
  if (!c) return batten_fail(ctx, BATTEN_E_INVALID, "carrier: NULL; give a carrier");
  return bound(ctx, c, NULL, c->n, count, boxes, ranges, NULL);
}

batten_status batten_carrier_slopes(batten_context *ctx, const batten_carrier *c, size_t count, const double *boxes,
                                    double *ranges, double *slopes) {
  return bound(ctx, c, NULL, c->n, count, boxes, ranges, slopes);
}

batten_status batten_solid_bounds(batten_context *ctx, const batten_solid *s, size_t count, const double *boxes,
                                  double *ranges) {
  if (!s) return batten_fail(ctx, BATTEN_E_INVALID, "solid: NULL; give a solid");
  return bound(ctx, NULL, s, s->n, count, boxes, ranges, NULL);
}

batten_status batten_solid_slopes(batten_context *ctx, const batten_solid *s, size_t count, const double *boxes,
                                  double *ranges, double *slopes) {
  return bound(ctx, NULL, s, s->n, count, boxes, ranges, slopes);
}
