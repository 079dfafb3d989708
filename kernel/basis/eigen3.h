/* Eigenvalues and vectors of small symmetric matrices: principal axes of point sets. */
#ifndef BATTEN_BASIS_EIGEN3_H
#define BATTEN_BASIS_EIGEN3_H

/* a [n][n] symmetric and finite (the upper triangle is read), 1 <= n <= 3. values [n] ascending; vectors [n][n],
 * row i is the unit eigenvector of values[i]; the rows form a right-handed system. vectors may be NULL. */
void batten_eigen_symmetric(unsigned n, const double *a, double *values, double *vectors);

#endif
