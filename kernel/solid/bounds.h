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
#endif
