/* Points, derivatives and curvatures at places on a network. */
#include "basis/shape.h"
#include "surface.h"

#include "base/checked.h"

#include <string.h>

enum { PLACES = 256 }; /* a task: about 100 us */

typedef struct job {
  const batten_network *network;
  size_t count;
  const batten_place *places;
  batten_surface_point *out;
} job;

static void evaluate(const batten_network *network, const batten_place *place, batten_surface_point *out) {
  double jet[6][3];
  surface_shape shape;
  triangular_jet(net_surface_degree(network, place->patch),
                 (const double(*)[3])net_surface_points(network, place->patch), place->u, place->v, 2, jet);
  surface_shape_make((const double(*)[3])jet, &shape);
  memcpy(out->point, jet[0], sizeof jet[0]);
  memcpy(out->du, jet[1], sizeof jet[1]);
  memcpy(out->dv, jet[2], sizeof jet[2]);
  memcpy(out->duu, jet[3], sizeof jet[3]);
  memcpy(out->duv, jet[4], sizeof jet[4]);
  memcpy(out->dvv, jet[5], sizeof jet[5]);
  memcpy(out->normal, shape.normal, sizeof shape.normal);
  out->gauss = shape.gauss;
  out->mean = shape.mean;
  memcpy(out->principal, shape.principal, sizeof shape.principal);
  memcpy(out->directions, shape.directions, sizeof shape.directions);
}

static void evaluate_some(void *arg, size_t index) {
  const job *j = arg;
  size_t from = index * PLACES, to = from + PLACES < j->count ? from + PLACES : j->count;
  for (size_t i = from; i < to; i++) evaluate(j->network, &j->places[i], &j->out[i]);
}

batten_status batten_network_evaluate(batten_context *ctx, const batten_network *network, size_t count,
                                      const batten_place *places, batten_surface_point *out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!network) return batten_fail(ctx, BATTEN_E_INVALID, "network: NULL; give a network");
  if (count && (!places || !out))
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give %zu places and room for as many points",
                       places ? "out" : "places", count);
  for (size_t i = 0; i < count; i++) {
    if (places[i].patch >= network->patch_count)
      return batten_fail(ctx, BATTEN_E_INVALID, "places[%zu].patch: %lu, but there are %zu patches", i,
                         (unsigned long)places[i].patch, network->patch_count);
    if (!isfinite(places[i].u) || !isfinite(places[i].v))
      return batten_fail(ctx, BATTEN_E_INVALID, "places[%zu]: (%g, %g); give finite u, v", i, places[i].u,
                         places[i].v);
  }
  job j = {network, count, places, out};
  batten_parallel(ctx, count / PLACES + (count % PLACES > 0), evaluate_some, &j);
  return BATTEN_OK;
}
