/* Sums of radial kernels over many points, in time that grows with the number of points and not with its square: a
 * kernel-independent fast multipole method (H2 matrix).   [Fong, Darve 2009; Hackbusch, Boerm 2002]
 *
 *   u(x_t) = sum_j w_j phi(|x_t - y_j|) - sum_j g_j . grad phi(x_t - y_j)        phi(r) = r^p  or  r^p ln r
 *
 * A plan is made for the points once and applied to as many weights as wanted. Where direct sums are faster, the plan
 * takes them by itself. */
#ifndef BATTEN_FMM_H
#define BATTEN_FMM_H

#include <batten/base.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* phi(r) = r^power, power 1, 3, 5 or 7; with logarithm r^power ln r, power 2, 4 or 6. In n = 2 or 3 dimensions. */
typedef struct batten_radial {
  unsigned n;
  int power;
  int logarithm; /* 0 or 1 */
} batten_radial;

typedef struct batten_fmm batten_fmm;

typedef struct batten_fmm_options {
  size_t struct_size;
  double accuracy; /* 2-norm of the error of the values over that of the values, wanted for weights of mixed signs;
                      1e-12 .. 1e-3. Smaller costs more. Default 1e-8. It is what points and weights without order
                      get, mostly a few times less; batten_fmm_error() says what others got: sums that cancel further
                      lose as many digits as they would in a precision of that many digits, points that all lie near
                      corners of cells of the tree lose one. */
  int gradients;   /* non-zero: batten_fmm_apply() will be asked for gradients. Default 0. */
  int dipoles;     /* non-zero: sources may have gradient terms g_j. Default 0. */
  const batten_fmm *share; /* a plan of the same context, kernel, accuracy, gradients and dipoles, whose operators
                              are used again in place of new ones; it may be freed before this plan. Default NULL. */
  size_t cache_bytes;      /* of an evaluator: what it may keep for batches to come, see there. Default 2^30. */
} batten_fmm_options;
BATTEN_API batten_fmm_options batten_fmm_options_default(void);

typedef struct batten_fmm_info {
  int direct;      /* non-zero: the plan sums directly, and all below but pairs, bytes and times is 0 */
  unsigned order;  /* Chebyshev polynomials for each axis of a cell */
  size_t rank;     /* of the far field of a cell, <= order^n */
  unsigned levels; /* of the tree */
  size_t cells, leaves;
  size_t pairs;                         /* terms summed directly by one product */
  size_t translations;                  /* pairs of cells whose far field passes from one to the other */
  size_t bytes;                         /* held by the plan, shared operators included */
  double time_operators_s, time_plan_s; /* operators (0 where shared), everything else of batten_fmm_create() */
  double time_apply_s;                  /* of the last product */
} batten_fmm_info;

/* Bytes that batten_fmm_create() and one product will take at their peak, told before anything is taken: what points
 * spread over a volume or a surface need; points of very uneven density can need about twice as much. SIZE_MAX on
 * overflow. kernel and opt as in batten_fmm_create(), opt may be NULL. */
BATTEN_API size_t batten_fmm_bytes(const batten_radial *kernel, size_t source_count, size_t target_count,
                                   const batten_fmm_options *opt);

/* Plans the sums.
 *   sources  [source_count][n], finite, < 1e30 in size. Equal points are allowed.
 *   targets  [target_count][n]; NULL: the sources, target_count is then their count
 *   opt      NULL for defaults
 *   out      freed by batten_fmm_free; untouched on failure
 * The arrays are copied. Fails: INVALID, TOO_LARGE, NOMEM, CANCELLED. Time O(S + T), and that of the operators
 * (rising steeply with the accuracy, the same for all numbers of points) unless they are shared. */
BATTEN_API batten_status batten_fmm_create(batten_context *ctx, const batten_radial *kernel, size_t source_count,
                                           const double *sources, size_t target_count, const double *targets,
                                           const batten_fmm_options *opt, batten_fmm **out);

/* One product.
 *   weights    [source_count], finite; NULL: all 0
 *   dipoles    [source_count][n] g_j, finite; NULL: none. Only for plans made with opt.dipoles.
 *   values     [target_count] u; may be NULL
 *   gradients  [target_count][n] grad u; may be NULL. Only for plans made with opt.gradients.
 * Terms that have no limit at r = 0 count as 0 there, as batten_spline_evaluate() has it. The same bits for any
 * number of threads and any instruction set. One product at a time on a plan. ctx is the one that the plan was made
 * with. Fails: INVALID, NOMEM, CANCELLED (phase "sums"); outputs are untouched then. */
BATTEN_API batten_status batten_fmm_apply(batten_context *ctx, batten_fmm *fmm, const double *weights,
                                          const double *dipoles, double *values, double *gradients);

/* What a product is really worth: u is summed directly at `rows` targets drawn by seed (all of them when rows is
 * target_count or more). *value_error and *gradient_error are the 2-norm of the difference to values and gradients
 * there over the 2-norm of the direct sums (0 when both are 0); either pair may be NULL. Time O(rows S).
 * Fails: INVALID, NOMEM, CANCELLED. */
BATTEN_API batten_status batten_fmm_error(batten_context *ctx, const batten_fmm *fmm, const double *weights,
                                          const double *dipoles, const double *values, const double *gradients,
                                          size_t rows, uint64_t seed, double *value_error, double *gradient_error);

BATTEN_API batten_fmm_info batten_fmm_get_info(const batten_fmm *fmm);
/* NULL is fine. */
BATTEN_API void batten_fmm_free(batten_fmm *fmm);

/* One sum at targets that come in many batches: sources and weights are fixed, and what a target needs depends on
 * them alone. Its bits are the same in any batch, in any order, by any number of threads and on any instruction set.
 *
 * Expansions of the far sources are made where a target first comes near, and kept: a first batch is slow, another in
 * the same region takes about a microsecond for a value. They take 8 order^n bytes for each place that about a
 * hundred sources share, or would, near targets; when they would need more than opt.cache_bytes, or than the context
 * has, they are dropped and made anew as batches ask for them, which takes time and changes no value. */
typedef struct batten_fmm_evaluator batten_fmm_evaluator;

typedef struct batten_fmm_evaluator_info {
  int direct;     /* non-zero: few sources, sums are direct, and all below but bytes and times is 0 */
  unsigned order; /* Chebyshev polynomials for each axis of a cell */
  size_t rank;    /* of the far field of a cell */
  unsigned levels;
  size_t cells, leaves;                    /* of sources */
  size_t nodes;                            /* places of targets that are kept now */
  size_t translations;                     /* far fields carried from one cell to another since it was made */
  size_t drops;                            /* how often places were forgotten */
  size_t bytes;                            /* held now, operators and places included */
  double time_operators_s, time_sources_s; /* operators (0 where shared), everything else of ..._new() */
  double time_evaluate_s;                  /* of the last batch */
} batten_fmm_evaluator_info;

/* Makes the evaluator of u above.
 *   sources  [source_count][n], finite, < 1e30 in size. Equal points are allowed.
 *   weights  [source_count], finite; NULL: all 0
 *   dipoles  [source_count][n] g_j, finite; NULL: none. opt.dipoles must say which.
 *   opt      NULL for defaults. accuracy: of the values of a batch, as of a product. share: a plan.
 *   out      freed by batten_fmm_evaluator_free; untouched on failure
 * The arrays are copied. Time O(S), and that of the operators. Fails: INVALID, TOO_LARGE, NOMEM, CANCELLED. */
BATTEN_API batten_status batten_fmm_evaluator_new(batten_context *ctx, const batten_radial *kernel,
                                                  size_t source_count, const double *sources, const double *weights,
                                                  const double *dipoles, const batten_fmm_options *opt,
                                                  batten_fmm_evaluator **out);

/* points [count][n], finite, < 1e30 in size; values [count], gradients [count][n] (only with opt.gradients), each may
 * be NULL. A value has the same bits with and without its gradient. Points may lie anywhere; those more than 1.5
 * times the longest side of the sources' box away from it take about ten times as long. One batch at a time; ctx is
 * the one that e was made with. Outputs are untouched on failure, and the evaluator stays as good as it was. Fails:
 * INVALID, NOMEM, CANCELLED (phase "evaluate"). */
BATTEN_API batten_status batten_fmm_evaluator_evaluate(batten_context *ctx, batten_fmm_evaluator *e, size_t count,
                                                       const double *points, double *values, double *gradients);

BATTEN_API batten_fmm_evaluator_info batten_fmm_evaluator_get_info(const batten_fmm_evaluator *e);
/* NULL is fine. */
BATTEN_API void batten_fmm_evaluator_free(batten_fmm_evaluator *e);

#ifdef __cplusplus
}
#endif
#endif
