/* Edges and corners of solids that lie along kinks of f; for kernel/mesh only. */
#ifndef BATTEN_MESH_SHARP_H
#define BATTEN_MESH_SHARP_H

#include "base/neighbours.h"
#include "crease.h"
#include "surface.h"

/* Makes mesh edges follow the creases of a surface of even triangles on f = 0: where unit gradients differ by more
 * than angle (radians) over a kink, but near none of the places avoid (mesh_surface_is_near). *count: vertices on
 * creases; 0: the surface is as before, but for its normals. Fails: NOMEM, TOO_LARGE, CANCELLED, as the
 * sampler fails. */
batten_status mesh_surface_sharpen(mesh_surface *s, batten_sampler *sampler, const double *lower, const double *upper,
                                   double edge, double angle, const batten_tree *avoid, size_t *count);

/* Is x nearer than three edges to one of the places? NULL: there are none. */
bool mesh_surface_is_near(const double *x, double edge, const batten_tree *places);

/* The vertices inside of creases, with what is known of these there; x: share of the way to the mean of the two
 * neighbours on the crease. Both lists are the caller's (batten_free), NULL where there are none. */
batten_status mesh_surface_creases(const mesh_surface *s, double share, size_t *count, uint32_t **vertices,
                                   batten_crease **creases);

#endif
