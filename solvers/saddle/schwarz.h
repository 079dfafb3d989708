/* The inside of the iterative method: a Krylov iteration on
 *     A = Pi K,   Pi = I - Q Q',   Q an orthonormal basis of P,
 * for the weights, which lie in the null space of P', with a multilevel Schwarz preconditioner made of small exact
 * solves.                        [Beatson, Light, Billings 2000, SIAM J. Sci. Comput. 22; Cai, Sarkis 1999; Saad
 * 1993]
 *
 *   panels.c     Cholesky for the local solves, without BLAS
 *   levels.c     nested subsets of the unknowns, each cut into domains that overlap
 *   domains.c    factors and solves of the domains
 *   schwarz.c    the preconditioner: domains of all levels, one after the other, and the exact level
 *   krylov.c     FGMRES, flexible conjugate gradients; sums over vectors
 *   iterative.c  phases of set-up and of a solve, memory, what the result is called
 *
 * Who computes what is fixed by the sizes alone: same bits for any thread count, where the products are such. */
#ifndef BATTEN_SADDLE_SCHWARZ_H
#define BATTEN_SADDLE_SCHWARZ_H

#include "panels.h"
#include "system.h"

enum {
  SADDLE_EXTREMES = 6,     /* unknowns that a level may have beyond one for each cell */
  SADDLE_LEVELS_MAX = 20,  /* each but the last has less than a third of the one before */
  SADDLE_EXACT_MAX = 3000, /* unknowns that are solved exactly */
  SADDLE_OWN_MAX = 512,    /* unknowns of a domain without the overlap: the domains have 256 to 512 */
  SADDLE_CELL_MAX = 8,     /* unknowns of which one goes to the next level, see saddle_cell() */
  SADDLE_GRAPH = 10,       /* nearest neighbours along which the overlap grows */
  SADDLE_RINGS = 2,        /* rings of these that are taken whole */
  SADDLE_RINGS_SMOOTH = 3, /* with a smooth kernel */
  SADDLE_OVERLAP_MAX = 4,  /* times a domain's own unknowns */
  SADDLE_BLOCK = 16384,    /* entries of a vector that are summed up at a time */
  SADDLE_DOTS = 32         /* scalar products at a time */
};

/* A local solve: with K and P of the members, [K P; P' 0] [w; .] = [r; 0], of which w is kept at the own members. */
typedef struct saddle_domain {
  size_t own, count;    /* members, the own ones first */
  const size_t *member; /* [count] places on the level */
  size_t rank;          /* of P here */
  double *reflectors;   /* [k][count] of the QR of P, rank of them in use */
  double *tau;          /* [k] */
  batten_la_real real;
  double scale;  /* a power of two, that brings the projected matrix to size 1 */
  void *factor;  /* panels of order count - rank */
  size_t failed; /* 0, or 1-based which member has no pivot */
} saddle_domain;

typedef struct saddle_level {
  size_t count;
  size_t *index;  /* [count] unknowns of the level, increasing; NULL: all */
  size_t *parent; /* [count] where they stand on the next finer level; NULL on the finest */
  size_t rank;
  double *q;              /* [rank][count] orthonormal, spans the rows of P */
  const double **columns; /* [rank] of q */
  size_t domain_count;    /* 0 on the exact level */
  saddle_domain *domains;
  size_t *members; /* of all domains */
  void *plan;      /* product that links the level with the next coarser one */
  double *r, *w;   /* [count] right side and weights */
} saddle_level;

typedef struct saddle_iterative {
  const saddle_code *code;
  batten_saddle_sums sums;
  unsigned slots;  /* tasks of a loop over domains */
  bool fine_first; /* levels from fine to coarse, else from coarse to fine */
  size_t level_count;
  saddle_level levels[SADDLE_LEVELS_MAX]; /* nested, the finest first, the last one exact */
  size_t domain_most;                     /* members of the largest domain */
  batten_saddle *exact;                   /* factor of the last level */
  double *exact_x;                        /* [its count + rank] */
  double *p_factor;                       /* [k][k] P S Pi' = Q R on the finest level: R */
  size_t *p_pivots;                       /* [k] */
  void *plan;                             /* of A */
  double accuracy, accuracy_within;       /* of the plan, and of those of the levels */
  double *partial;                        /* [blocks][SADDLE_DOTS] */
  double *coefficients;                   /* [2][k]: q'x of a projection, and room */
  void *scratch;                          /* [slots][scratch_bytes] for local solves */
  size_t scratch_bytes;
} saddle_iterative;

static inline size_t saddle_unknown(const saddle_level *l, size_t place) {
  return l->index ? l->index[place] : place;
}

/* Parts that halving cuts n things into until none has more than `most`. Their sizes differ by one at most, but where
 * `most` lies between. */
size_t batten_saddle_parts(size_t n, size_t most);

/* Unknowns of a cell of which one goes to the next level. Half as many where the next level would be solved exactly
 * and has less than half of what may be: 1,000 unknowns leave more to the iteration than 2,000. */
static inline size_t saddle_cell(size_t count) {
  return batten_saddle_parts(count, SADDLE_CELL_MAX) < SADDLE_EXACT_MAX / 2 ? SADDLE_CELL_MAX / 2 : SADDLE_CELL_MAX;
}

/* What a domain takes in around its own unknowns at least, over these. */
static inline double saddle_overlap_least(const batten_saddle_options *o) {
  return o->overlap > 0 ? o->overlap : o->smooth_kernel ? 1 : 0.5;
}

static inline size_t saddle_added(size_t own, double overlap) { return (size_t)(overlap * (double)own); }

/* ---- levels.c ---- */

/* Makes it->levels, with domains whose factors are missing; phase "levels". SINGULAR: two unknowns are the same. */
batten_status batten_saddle_levels_new(const batten_saddle *s, saddle_iterative *it);
void batten_saddle_levels_free(const batten_saddle *s, saddle_iterative *it);

/* K[row[i]][col[j]] by whatever the caller gave. */
void batten_saddle_entries(const batten_saddle *s, const batten_saddle_sums *sums, size_t rows, const size_t *row,
                           size_t cols, const size_t *col, double *tile, size_t ld);

/* ---- domains.c ---- */

/* Bytes of one domain's factor beside its members, and of what a task takes to make it. */
size_t batten_saddle_domain_bytes(batten_la_real real, size_t count, size_t k);
size_t batten_saddle_domain_work(size_t count, size_t k);
/* Bytes that a task takes to solve with it. */
size_t batten_saddle_domain_scratch(size_t count);

/* Factors of all domains of all levels; phase "domains". SINGULAR where double does not do. */
batten_status batten_saddle_domains_factor(batten_saddle *s, saddle_iterative *it);
/* w [count] := the restricted solves of all domains of the level for r [count]. */
void batten_saddle_domains_solve(const batten_saddle *s, const saddle_iterative *it, const saddle_level *l,
                                 const double *r, double *w);

/* ---- schwarz.c ---- */

/* The factor of the exact level. */
batten_status batten_saddle_exact_new(batten_saddle *s, saddle_iterative *it);
/* The products that link the levels; those at hand are given back first. */
batten_status batten_saddle_links_new(batten_saddle *s, saddle_iterative *it, double accuracy);
void batten_saddle_links_free(saddle_iterative *it);
/* z [N] := M r, in the null space of P'. fraction: for progress. */
batten_status batten_saddle_precondition(batten_saddle *s, saddle_iterative *it, double fraction, const double *r,
                                         double *z);

/* ---- krylov.c ---- */

size_t batten_saddle_blocks(size_t n);
/* out[i] = v_i'x, i < m; sums over blocks, which are added in order. */
void batten_saddle_dots(const batten_saddle *s, const saddle_iterative *it, size_t n, size_t m,
                        const double *const *v, const double *x, double *out);
/* x += sum_i c[i] v_i */
void batten_saddle_combine(const batten_saddle *s, size_t n, size_t m, const double *const *v, const double *c,
                           double *x);
double batten_saddle_norm(const batten_saddle *s, const saddle_iterative *it, size_t n, const double *x);
/* x -= q (q'x) on a level; coefficients [k]: q'x. */
void batten_saddle_project(const batten_saddle *s, const saddle_iterative *it, const saddle_level *l, double *x,
                           double *coefficients);

/* Why an iteration ended. */
typedef enum saddle_end { SADDLE_MET, SADDLE_STALLED, SADDLE_SPENT, SADDLE_SHORT } saddle_end;

/* Moves w so that the 2-norm of r = Pi (f - K w), which is given and overwritten, falls to target (as the recurrence
 * sees it); norm: |Pi f|, for progress. At most *left steps, which are counted down. SHORT: no memory for more. */
batten_status batten_saddle_fgmres(batten_saddle *s, saddle_iterative *it, double *w, double *r, double norm,
                                   double target, unsigned *left, saddle_end *end);
batten_status batten_saddle_cg(batten_saddle *s, saddle_iterative *it, double *w, double *r, double norm,
                               double target, unsigned *left, saddle_end *end);

#endif
