/* The two inner loops of volume splines: sums over all centres, and tiles of the matrix.
 *
 * sum.c is compiled once per instruction set; what it computes is the same IEEE arithmetic in each, in the same order
 * for every point, so the choice changes the time and no bit. */
#ifndef BATTEN_SPLINE_SUM_H
#define BATTEN_SPLINE_SUM_H

#include <stddef.h>

enum {
  SPLINE_LANES = 8, /* points that are summed side by side: one AVX-512 register */
  SPLINE_SUMS = 10  /* U, U_x, U_y, U_z, U_xx, U_xy, U_xz, U_yy, U_yz, U_zz */
};

/* All in the unit box. The sign s of the kernel is in w and g. */
typedef struct spline_terms {
  unsigned n, power;
  size_t plain;       /* centres 0 .. plain-1 have a value term only */
  size_t hermite;     /* the next so many have a gradient term too */
  const double *x[3]; /* [plain + hermite] */
  const double *w;    /* [plain + hermite] */
  const double *g[3]; /* [hermite] */
} spline_terms;

/* sums[q][lane] += the terms of all centres at the points x[axis][lane], for q that belong to derivatives up to order
 * (0, 1, 2) and axes below n; others are untouched. */
typedef void spline_sum_function(const spline_terms *terms, unsigned order, double x[3][SPLINE_LANES],
                                 double sums[SPLINE_SUMS][SPLINE_LANES]);

/* A tile of the matrix: rows x cols entries of one kind, tile[i + j * ld].
 * row_axis, col_axis: -1 the functional is the value at its point, 0 .. n-1 the derivative along that axis. */
typedef struct spline_tile {
  unsigned n, power;
  int row_axis, col_axis;
  size_t rows, cols;
  const double *row_x[3], *col_x[3];
  double *tile;
  size_t ld;
} spline_tile;
typedef void spline_tile_function(const spline_tile *tile);

typedef struct spline_code {
  const char *name; /* of the instruction set */
  spline_sum_function *sum;
  spline_tile_function *tile;
} spline_code;

/* The code for this processor. */
const spline_code *batten_spline_code(void);
/* Number `index` of the codes that this processor can run, widest first; NULL beyond the last. The last one is the
 * baseline. */
const spline_code *batten_spline_code_at(unsigned index);

#endif
