/* Normal and curvatures of a surface at a place, from its derivatives. */
#ifndef BATTEN_BASIS_SHAPE_H
#define BATTEN_BASIS_SHAPE_H

#include <stdbool.h>

typedef struct surface_shape {
  double normal[3];                                   /* unit, along du x dv; 0 where that vanishes */
  double gauss, mean, principal[2], directions[2][3]; /* as in batten_surface_point; NaN, 0 without a normal */
} surface_shape;

/* jet: S, S_u, S_v, S_uu, S_uv, S_vv. False without a normal. */
bool surface_shape_make(const double (*jet)[3], surface_shape *out);

/* Unit normal alone: du x dv / |du x dv|, *area = |du x dv|. False and 0 where it vanishes: where it is below the
 * rounding of du and dv. */
bool surface_shape_normal(const double du[3], const double dv[3], double normal[3], double *area);

#endif
