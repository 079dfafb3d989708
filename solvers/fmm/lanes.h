/* The inner loops of fast multipole sums, once per instruction set; batten_fmm_lanes_now() gives the widest that the processor
 * has.
 *
 * Every number is made by the same IEEE operations in the same order in each set, and no product is contracted with a
 * sum: the choice changes the time and no bit. */
#ifndef BATTEN_FMM_LANES_H
#define BATTEN_FMM_LANES_H

#include <stddef.h>

enum {
  FMM_LANES = 8, /* targets that are summed side by side: one AVX-512 register */
  FMM_SUMS = 4   /* u, u_x, u_y, u_z */
};

/* Sources, one array for each axis; g is read by sums with dipoles only. */
typedef struct fmm_terms {
  const double *x[3], *w, *g[3];
} fmm_terms;

/* sums[q][lane] += the terms first .. last - 1 at the points x[axis][lane]; those of derivatives and of axes that the
 * function does not have are untouched. */
typedef void fmm_near_function(const fmm_terms *terms, size_t first, size_t last, const double x[3][FMM_LANES],
                               double sums[FMM_SUMS][FMM_LANES]);

typedef struct fmm_lanes {
  const char *name; /* of the instruction set */
  /* By dimension, power, whether gradients are wanted, and whether sources have dipoles; NULL where there is no such
   * kernel. */
  fmm_near_function *(*near)(unsigned n, unsigned power, int gradients, int dipoles);
} fmm_lanes;

/* The names that sources built for a set give to what they make. */
#define FMM_JOIN_(a, b) a##_##b
#define FMM_JOIN(a, b) FMM_JOIN_(a, b)
#define FMM_OF_SET(name) FMM_JOIN(name, FMM_ISA)
#if defined(FMM_ISA)
fmm_near_function *FMM_OF_SET(batten_fmm_near)(unsigned n, unsigned power, int gradients, int dipoles);
extern const fmm_lanes FMM_OF_SET(batten_fmm_lanes);
#endif

const fmm_lanes *batten_fmm_lanes_now(void);
/* The sets that run here, widest first; NULL when there are no more. */
const fmm_lanes *batten_fmm_lanes_at(unsigned index);

#endif
