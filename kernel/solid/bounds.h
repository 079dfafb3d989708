/* Quadratic models of carriers and solids over boxes: what their bounds are made of; for kernel/solid only. */
#ifndef BATTEN_SOLID_BOUNDS_H
#define BATTEN_SOLID_BOUNDS_H

#include "basis/taylor.h"
#include "solid/carrier_inner.h"

/* A primitive (ball .. half-space, none) over one box. */
taylor batten_carrier_shape_model(const batten_carrier *c, const taylor_box *box);
/* R-function of two models, sign as in batten_carrier_combine. */
taylor batten_carrier_join_models(unsigned n, const taylor_box *box, double alpha, double sign, const taylor *f,
                                  const taylor *g);
/* Bound of the slope of an R-function from those of both: |c_f df + c_g dg| with c_f, c_g the partial derivatives. For
 * alpha = 1 one of them is 0 and the other 1, for alpha = 0 they are 1 + cos and 1 + sin of an angle, and within [0, 2
 * / (1 + alpha)] in general. */
double batten_carrier_join_steep(double alpha, double f, double g);

#endif
