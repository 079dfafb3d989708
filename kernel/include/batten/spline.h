/* Volume splines: interpolation of scattered values (and gradients) by the Green's function of the
 * iterated Laplacian.   [Savchenko, Pasko, Okunev, Kunii 1995, section 3; Duchon 1977]
 *
 *   U(x) = sum_i w_i phi(|x - x_i|) - sum_i g_i . grad phi(x - x_i) + polynomial of degree m-1
 *   phi(r) = s r^(2m-n)        n odd       2m > n, n in {1, 2, 3}
 *   phi(r) = s r^(2m-n) ln r   n even      s = +-1 makes phi conditionally positive definite
 *
 * The second sum is there when gradients are prescribed (Hermite-Birkhoff data); it needs a kernel with
 * two derivatives to spare, 2m - n > 2. Points are centred and scaled to a unit box inside, so
 * coordinates far from the origin lose nothing but the digits that they do not have. */
#ifndef BATTEN_SPLINE_H
#define BATTEN_SPLINE_H

#include <batten/field.h>
#include <batten/saddle.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct batten_spline batten_spline;

/* Data to interpolate. */
typedef struct batten_spline_data {
  size_t struct_size;
  unsigned n;                /* dimension, 1 .. 3 */
  size_t count;              /* N points */
  const double *points;      /* [N][n], pairwise distinct */
  const double *values;      /* [N] */
  size_t gradient_count;     /* M <= N gradients, default 0 */
  const size_t *gradient_at; /* [M] indices into points, increasing; NULL = the first M */
  const double *gradients;   /* [M][n] */
} batten_spline_data;
BATTEN_API batten_spline_data batten_spline_data_default(void);

typedef struct batten_spline_options {
  size_t struct_size;
  unsigned m;       /* order of the energy, 2m > n, <= 4. Default 2. */
  double smoothing; /* rho >= 0, added to the diagonal of phi(|x_i - x_j|) in the unit box: 0 interpolates,
                       larger is smoother. Default 0. */
  const double *smoothing_per_point; /* [N] >= 0 in place of smoothing; NULL = one for all */
  size_t loo_samples;           /* leave-one-out errors of so many points, evenly drawn; SIZE_MAX = all, 0 = none.
                                   Default 256. */
  batten_saddle_options saddle; /* method, refinement, tolerance. ITERATIVE is for n = 2 and 3 and makes its products
                                   by <batten/fmm.h>; AUTO chooses it from 6,000 unknowns N + nM on where 2m - n <= 2
                                   (kernels r and r^2 ln r), and where no factor fits the memory limit. */
} batten_spline_options;
BATTEN_API batten_spline_options batten_spline_options_default(void);

typedef struct batten_spline_info {
  batten_saddle_info saddle;
  double residual_max;    /* max |U(x_i) - v_i| / (max v - min v), recomputed by the evaluator; with smoothing
                             against v_i - rho w_i. Where all v are equal: over the largest |gradient| times the
                             unit box's side, else over |v| */
  size_t residual_points; /* at how many points it was looked for: all, or by ITERATIVE, where N (N + nM) is above
                             1e9, 1e9 / (N + nM) evenly drawn ones, and 1000 at least; gradients likewise */
  double gradient_residual_max; /* the same for gradients, relative to the largest |gradient|; 0 without */
  double loo_rms;     /* root mean square of U_without_i(x_i) - v_i over the sample, unit of the values; NaN when
                         not computed (loo_samples = 0, or N + nM = k, or ITERATIVE, which has no factor) */
  size_t loo_samples; /* how many; points without which the polynomial part is undetermined are left out */
  double energy;      /* w' K w: the minimised energy up to its constant; unit box, values squared */
  double time_total_s;
} batten_spline_info;

/* Bytes at the peak of a fit, predicted; SIZE_MAX on overflow. ITERATIVE: with default options, for points
 * on a surface and the kernels r and r^2 ln r; in a volume, and for smoother kernels, two to six times as much, which a
 * fit finds out before it takes it. */
BATTEN_API size_t batten_spline_bytes(batten_saddle_method method, unsigned n, unsigned m, size_t points,
                                      size_t gradients);

/* Fits; *out is freed by batten_spline_free and untouched on failure; info may be NULL.
 * Positive status: BATTEN_W_ACCURACY when residual_max or gradient_residual_max is above 1e-10; by ITERATIVE, when
 * saddle.residual_rows (a 2-norm, on direct rows) is above opt.saddle.accuracy, and the largest miss at a point, told
 * by residual_max, may be some times that.
 * Fails: INVALID (2m <= n, non-finite, equal points: names both, fewer conditions than monomials), TOO_LARGE, NOMEM,
 * SINGULAR (points on a line or plane: names it; or nearly on one another or on the zero set of a polynomial of
 * degree m-1), CANCELLED. Time O((N + nM)^3 / 3), by ITERATIVE about O(N + nM). */
BATTEN_API batten_status batten_spline_fit(batten_context *ctx, const batten_spline_data *data,
                                           const batten_spline_options *opt, batten_spline **out,
                                           batten_spline_info *info);

/* Fewer centres than points. */
typedef struct batten_spline_reduce_options {
  size_t struct_size;
  double tolerance;         /* > 0: what |U(x_i) - v_i| may be at each point, unit of the values. Has no default. */
  const double *tolerances; /* [N] > 0, one for each point in place of tolerance; NULL = the same for all */
  size_t distance_count;    /* D <= N: where U stands for a field F with F(x_i) = v_i, the tolerances of the first D
                               points are distances: |f| / |grad f| <= tolerance, f = F - U. Default 0. */
  const double *field_gradients; /* [D][n] grad F(x_i) */
  size_t centers_max;       /* stops there and tells what was reached; 0 = no limit, else at least 2 n and as many as
                               the polynomial has monomials more. Default 0. */
  double share_max;         /* in (0, 1]: where more than this share of the points is wanted, all are taken.
                               Default 0.5. */
  double terms_max;         /* the final check sums directly at all points up to so many terms (N + D) C; above
                               at a part of them, 1000 at least, and rounds take fast sums; >= 0. Default 2e10, about
                               30 s of one core. n = 1 has direct sums alone. */
} batten_spline_reduce_options;
BATTEN_API batten_spline_reduce_options batten_spline_reduce_options_default(void);

enum { BATTEN_SPLINE_REDUCE_ROUNDS = 40 };

typedef struct batten_spline_reduce_round {
  size_t centers;
  double ratio_max; /* largest error over its tolerance */
} batten_spline_reduce_round;

/* Errors are |U(x_i) - v_i|; with distance_count, distances at those points alone. */
typedef struct batten_spline_reduce_info {
  size_t points;             /* N */
  size_t centers;            /* C */
  int all;                   /* non-zero: every point (of equal ones the first) has become a centre */
  unsigned rounds;           /* fits */
  batten_spline_reduce_round history[BATTEN_SPLINE_REDUCE_ROUNDS]; /* of the first rounds */
  size_t certified_points;   /* points whose error was summed directly in the end */
  double error_max, error_rms; /* at all points: direct where certified, else by fast sums */
  double error_certified;    /* error_max, all of it by direct sums, when certified_points = N. Else also a bound at
                                the others, if fast sums (values, gradients) are off there by no more than at the
                                worst of the certified */
  double ratio_max;          /* error_certified's counterpart over the tolerances: met when <= 1 */
  double time_select_s, time_fit_s, time_evaluate_s, time_certify_s, time_total_s;
  batten_spline_info fit;    /* of the last fit, to its centres; without leave-one-out errors */
} batten_spline_reduce_info;

/* Fits to so many of the points, the centres, that U meets all of them to a tolerance.   [Carr et al. 2001, section 5]
 *
 * Starts from some well-spread points; each round fits, looks at all points, and adds those that are missed by most,
 * no two of a round nearer to each other than a distance that shrinks from round to round. In the end the errors are
 * measured anew by batten_spline_evaluate(), which knows nothing of the fit nor of fast sums. Between the points
 * nothing is promised: there U is a spline of fewer data.
 *
 *   opt     smoothing holds U off its centres: with it a tolerance may not be reached. loo_samples is not read.
 *           An iteration is as accurate as the tolerance needs, in place of saddle.accuracy
 *   reduce  not NULL
 * Points may be equal: the first of them can be a centre. The choice does not depend on the order of the points up to
 * ties, nor on the threads. Where all points are taken, the result is that of batten_spline_fit().
 * Positive status: BATTEN_W_ACCURACY when ratio_max > 1 (the text names the point).
 * Time: about that of two fits of C centres and 2 N C terms, or O(N) where fast sums serve; memory about 120 N bytes
 * beside the fit. Progress phase "reduce". Fails: as batten_spline_fit(), and INVALID for gradients in the data. */
BATTEN_API batten_status batten_spline_fit_reduced(batten_context *ctx, const batten_spline_data *data,
                                                   const batten_spline_options *opt,
                                                   const batten_spline_reduce_options *reduce, batten_spline **out,
                                                   batten_spline_reduce_info *info);

/* Everything that defines a spline, for saving and loading: pointers into the spline. */
typedef struct batten_spline_parts {
  size_t struct_size;
  unsigned n, m;
  size_t count;                        /* N centres */
  const double *centers;               /* [N][n], caller's unit */
  const double *coefficients;          /* [N] w_i for the unit box */
  size_t gradient_count;               /* M */
  const size_t *gradient_at;           /* [M] increasing */
  const double *gradient_coefficients; /* [M][n] */
  size_t polynomial_count;             /* k = C(n+m-1, n) */
  const double *polynomial; /* [k] for the unit box; monomials by degree: 1, x, y, z, x^2, xy, xz, y^2, yz, z^2,
                               x^3, x^2 y, ... */
  double origin[3];         /* unit box coordinate = (x - origin) / scale */
  double scale;
} batten_spline_parts;
BATTEN_API void batten_spline_get_parts(const batten_spline *s, batten_spline_parts *parts);
/* The inverse: copies. Evaluates to the same bits as the spline that the parts came from. */
BATTEN_API batten_status batten_spline_create(batten_context *ctx, const batten_spline_parts *parts,
                                              batten_spline **out);

/* points [count][n]; values [count], gradients [count][n], hessians [count][n][n]; each may be NULL.
 * Threaded and vectorised; the same bits for any thread count, any batch and any instruction set. Derivatives that do
 * not exist at a centre (r^1: gradient; r^3 with gradient data: Hessian) are evaluated as if its term were 0. Points
 * that are not finite give NaN. Progress (phase "evaluate") only in batches that take long; cancelled, the outputs
 * are partly written. Fails: INVALID (outputs untouched), CANCELLED. */
BATTEN_API batten_status batten_spline_evaluate(batten_context *ctx, const batten_spline *s, size_t count,
                                                const double *points, double *values, double *gradients,
                                                double *hessians);

/* Values and gradients at many points by <batten/fmm.h>: about a microsecond for a value where other points were
 * asked for before, however many centres there are; more where a batch comes first. Worth it from some thousand
 * centres and points on. The sum over the centres is approximated; its rounding is not that of
 * batten_spline_evaluate(). */
typedef struct batten_spline_evaluator batten_spline_evaluator;

/* accuracy: 1e-12 .. 1e-3, of a batch's sums over the centres (2-norm, without the polynomial, which they may largely
 * cancel). n = 2 or 3. The spline is retained. Takes a second or more for operators (rising with the accuracy), and
 * O(N) for the centres. What it keeps of batches is bounded by batten_fmm_options.cache_bytes as it is by default.
 * Fails: INVALID, TOO_LARGE, NOMEM, CANCELLED. */
BATTEN_API batten_status batten_spline_evaluator_new(batten_context *ctx, batten_spline *s, double accuracy,
                                                     batten_spline_evaluator **out);

/* points [count][n] (finite); values [count], gradients [count][n]; each may be NULL, gradients take some times as
 * long. Points may lie anywhere. *value_error (may be NULL; unit of the values): the largest difference to
 * batten_spline_evaluate() at up to 100 of the points, evenly drawn, which are O(100 N). Values and gradients of a
 * point have the same bits in any batch, by any number of threads and on any instruction set. One batch at a time;
 * ctx is the one that e was made with. Outputs are untouched on failure, and e is as good as before. Fails: INVALID,
 * NOMEM, CANCELLED. */
BATTEN_API batten_status batten_spline_evaluator_evaluate(batten_context *ctx, batten_spline_evaluator *e,
                                                          size_t count, const double *points, double *values,
                                                          double *gradients, double *value_error);
/* NULL is fine. */
BATTEN_API void batten_spline_evaluator_free(batten_spline_evaluator *e);

/* Bounds of U over boxes, as batten_field says: boxes [count][2][n], ranges [count][2]. Far centres are taken
 * together (their sum is expanded about the middle of the box), near ones by themselves: ranges narrow with the
 * boxes. */
BATTEN_API batten_status batten_spline_bounds(batten_context *ctx, const batten_spline *s, size_t count,
                                              const double *boxes, double *ranges);

/* The spline as a field; valid as long as the spline. */
BATTEN_API batten_field batten_spline_field(const batten_spline *s);

/* Shared ownership: retain adds an owner, free drops one (NULL is fine). The context that it was made with must
 * outlive it. */
BATTEN_API batten_spline *batten_spline_retain(batten_spline *s);
BATTEN_API void batten_spline_free(batten_spline *s);

#ifdef __cplusplus
}
#endif
#endif
