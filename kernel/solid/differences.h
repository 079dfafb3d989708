/* Derivatives that a field does not supply, by central differences; for kernel/solid only. */
#ifndef BATTEN_SOLID_DIFFERENCES_H
#define BATTEN_SOLID_DIFFERENCES_H

#include <stdbool.h>
#include <stddef.h>

/* The most points about one: n = 3, second differences of values; as many numbers as 6 gradients. */
enum { DIFFERENCE_POINTS = 6 + 12 };

/* The points of the differences about x: x +- h e_a for every axis, then, if mixed (second differences of values),
 * x +- h e_a +- h e_b for every a < b. Into at [2 n | 4 pairs][n]; returns how many. */
size_t batten_difference_points(unsigned n, const double *x, double h, bool mixed, double *at);

/* From the values v at these points (mixed where a Hessian is wanted) and the one in the middle; each may be NULL. */
void batten_differences_of_values(unsigned n, double h, double middle, const double *v, double *gradient,
                                  double *hessian);
/* Hessian [n][n], symmetric, from the gradients g [2 n][n] at the points that are not mixed. */
void batten_differences_of_gradients(unsigned n, double h, const double *g, double *hessian);

#endif
