/* The rule of Gauss and Legendre with 8 nodes on [0, 1]: exact for polynomials of degree 15. */
#ifndef BATTEN_BASIS_GAUSS8_H
#define BATTEN_BASIS_GAUSS8_H

enum { GAUSS8 = 8 };

/* Node i, in rising order, and its weight; the weights have sum 1. */
static inline void gauss8_node(unsigned i, double *x, double *weight) {
  static const double node[GAUSS8 / 2] = {0.18343464249564980494, 0.52553240991632898582, 0.79666647741362673959,
                                          0.96028985649753623168};
  static const double share[GAUSS8 / 2] = {0.36268378337836198297, 0.31370664587788728734, 0.22238103445337447054,
                                           0.10122853629037625915};
  unsigned k = i < GAUSS8 / 2 ? GAUSS8 / 2 - 1 - i : i - GAUSS8 / 2;
  *x = 0.5 + (i < GAUSS8 / 2 ? -0.5 : 0.5) * node[k];
  *weight = 0.5 * share[k];
}

#endif
