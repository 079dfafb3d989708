/* Noise, or a dent: do the data depart from the best convex surface by more than from the unconstrained one?
 *
 * If they are a convex surface and noise of deviation s across it, the two sums of squares differ by no more than the
 * freedom that the inequalities took away: (S_c - S_f) / s^2 is at most chi-squared with k degrees of freedom, k the
 * control points, and S_f / s^2 is chi-squared with count - k. Their quotient is Fisher's F, which Paulson's
 * approximation [Annals of Mathematical Statistics 13, 1942] makes standard normal: the misfit. */
#include "fit_inner.h"

#include "base/checked.h"
#include "mesh/vec.h"

/* 6: once in a billion by noise. */
static const double MISFIT = 6;

static double misfit_of(double extra, double k, double rest, double freedom) {
  if (!(extra > 0)) return 0;
  if (!(rest > 0) || !(freedom >= 1)) return freedom >= 1 ? INFINITY : 0;
  double root = cbrt(extra / k / (rest / freedom)), a = 2 / (9 * k), b = 2 / (9 * freedom);
  return ((1 - b) * root - (1 - a)) / sqrt(b * root * root + a);
}

batten_status convex_judge(batten_context *ctx, const convex_space *space, size_t count, const double *points,
                           const double *weights, bool corrected, const convex_track *convex,
                           const convex_track *free, convex_verdict *out) {
  (void)ctx;
  (void)points;
  double parts = corrected ? 1 : 3, k = parts * (double)convex_points(space), freedom = parts * (double)count - k;
  convex_verdict v = {.misfit = misfit_of(convex->sum - free->sum, k, free->sum, freedom)};
  for (size_t i = 0; i < count; i++)
    if ((!weights || weights[i] > 0) && convex->squares[i] > v.depth) {
      v.depth = convex->squares[i];
      v.worst = i;
    }
  v.depth = sqrt(v.depth);
  v.dent = v.misfit > MISFIT;
  *out = v;
  return BATTEN_OK;
}
