/* Points onto f = 0, in batches; for kernel/mesh only. */
#ifndef BATTEN_MESH_PROJECT_H
#define BATTEN_MESH_PROJECT_H

#include "sampler.h"

/* Two bits a coordinate: the point lies on the lower or the upper face of the box there and stays on it. */
enum { BATTEN_LOWER_FACE = 1, BATTEN_UPPER_FACE = 2 };
static inline int batten_on_face(unsigned char faces, unsigned k) { return faces >> 2 * k & 3; }

/* One Newton step, at most limit long, within the faces: x [n] moves, outward [n] (NULL = not wanted) gets the unit
 * vector against the gradient, or stays when there is none. Returns |f| / |grad f|, INFINITY without a gradient. */
double batten_newton_step(unsigned n, double f, const double *gradient, unsigned char faces, double limit, double *x,
                          double *outward);

/* Moves the points x [count][n] onto f = 0 until |f| / |grad f| <= tolerance, each at most `reach` from its place or
 * little more; faces [count] or NULL; outward [count][n] or NULL: unit normals as far as
 * known (else 0) on entry, against the gradient afterwards. What Newton's method does not settle (kinks, flat
 * places) is bracketed along the last gradient and bisected. distance [count]: what is left, |f| / |grad f| or the
 * width of a bracket over which f changes its sign, whichever decided. */
batten_status batten_project_points(batten_sampler *sampler, size_t count, double *x, const unsigned char *faces,
                                    double reach, double tolerance, double *outward, double *distance);

#endif
