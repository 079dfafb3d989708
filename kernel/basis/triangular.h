/* Polynomials on a triangle in Bernstein form.
 *
 * Degree n: coefficients b_abc, a + b + c = n, at index k (n + 1) - k (k - 1) / 2 + j for (a, b, c) = (n - j - k, j,
 * k), that is row by row, j fastest, as in <batten/network.h>. A place (u, v) has the barycentric coordinates (1 - u
 * - v, u, v). A jet is a value with its derivatives by u and v in the order S, S_u, S_v, S_uu, S_uv, S_vv, S_uuu,
 * S_uuv, S_uvv, S_vvv. */
#ifndef BATTEN_BASIS_TRIANGULAR_H
#define BATTEN_BASIS_TRIANGULAR_H

#include <stddef.h>

enum {
  TRIANGULAR_DEGREE = 12, /* highest, but for the functions that say otherwise */
  TRIANGULAR_MAX = 91,    /* its coefficients */
  TRIANGULAR_JET = 10     /* entries of a jet of order 3; order 0, 1, 2: the first 1, 3, 6 */
};

static inline size_t triangular_count(unsigned n) { return (size_t)(n + 1) * (n + 2) / 2; }
static inline size_t triangular_index(unsigned n, unsigned j, unsigned k) {
  return (size_t)k * (n + 1) - (size_t)k * (k - 1u) / 2 + j;
}
/* Entries of a jet of an order 0 .. 3. */
static inline unsigned triangular_jet_count(unsigned order) { return (order + 1) * (order + 2) / 2; }

/* The jet of a net [count(n)][3] at (u, v), up to an order 0 .. 3: out [jet_count(order)][3]. Any place, inside or
 * not. */
void triangular_jet(unsigned n, const double (*net)[3], double u, double v, unsigned order, double (*out)[3]);

/* The same for the basis functions: table [jet_count(order)][count(n)], so that a jet of a net is table times net. */
void triangular_basis(unsigned n, double u, double v, unsigned order, double *table);

/* Coefficients come in groups of `dims` numbers (1: a function, 3: a net) in what follows. */

/* du x dv of a net, degree 2 n - 2 (of degree 1: a constant): out [count(2 n - 2)][3], n >= 1. */
void triangular_normal(unsigned n, const double (*net)[3], double (*out)[3]);

/* The polynomial over the triangle with these corners (u, v): out [count(n)][dims]; work [3 count(n)][dims]. Any n.
 * Fast where corners[0] is one of (0, 0), (1, 0), (0, 1). */
void triangular_part(unsigned n, unsigned dims, const double *net, const double corners[3][2], double *out,
                     double *work);

/* The four parts that the edges' midpoints cut, out [4][count(n)][dims]: at corners 0, 1, 2 with the place (u, v) of
 * the part at (u, v) / 2, (1 + u, v) / 2, (u, 1 + v) / 2 of the whole, and the middle one at (1 - u, 1 - v) / 2. */
void triangular_split(unsigned n, unsigned dims, const double *net, double *out, double *work);
static inline void triangular_split_place(unsigned part, double u, double v, double out[2]) {
  out[0] = part == 3 ? 0.5 - 0.5 * u : 0.5 * u + (part == 1 ? 0.5 : 0);
  out[1] = part == 3 ? 0.5 - 0.5 * v : 0.5 * v + (part == 2 ? 0.5 : 0);
}

#endif
