/* Are these the knots of a spline that a caller may give? */
#include "check_knots.h"

#include "base/checked.h"

batten_status bspline_check_knots(batten_context *ctx, const char *which, unsigned degree, unsigned degree_max,
                                  size_t count, const double *knots) {
  unsigned d = degree;
  if (d < 1 || d > degree_max)
    return batten_fail(ctx, BATTEN_E_INVALID, "degree%s: %u; give 1 to %u", which, d, degree_max);
  if (count < 2 * (size_t)(d + 1))
    return batten_fail(ctx, BATTEN_E_INVALID, "knot_count%s: %zu; degree %u needs %u knots at least", which, count, d,
                       2 * (d + 1));
  if (!knots) return batten_fail(ctx, BATTEN_E_INVALID, "knots%s: NULL; give %zu", which, count);
  size_t bad = batten_first_nonfinite(count, knots);
  if (bad < count)
    return batten_fail(ctx, BATTEN_E_INVALID, "knots%s[%zu]: %g; give finite knots", which, bad, knots[bad]);
  for (size_t k = 0; k + 1 < count; k++)
    if (knots[k] > knots[k + 1])
      return batten_fail(ctx, BATTEN_E_INVALID, "knots%s[%zu]: %.17g is below the knot before it; sort them", which,
                         k + 1, knots[k + 1]);
  if (knots[0] == knots[count - 1])
    return batten_fail(ctx, BATTEN_E_INVALID, "knots%s: all are %.17g; give a domain of some length", which,
                       knots[0]);
  size_t functions = count - d - 1;
  for (size_t k = 1; k < count; k++) {
    bool end = k <= d || k > functions;
    bool equal = knots[k] == knots[k - 1];
    if (end && !equal)
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "knots%s[%zu]: %.17g; the first and the last %u knots of degree %u must be equal", which, k,
                         knots[k], d + 1, d);
    /* One inner knot at the upper end is one too many; those at the lower one repeat the first d + 1. */
    if (!end && k >= d && (knots[k] == knots[k - d] || (k == functions && equal)))
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "knots%s[%zu]: %.17g repeats too often; inner knots may be there %u times", which, k,
                         knots[k], d);
  }
  if (!isfinite(knots[count - 1] - knots[0]))
    return batten_fail(ctx, BATTEN_E_INVALID, "knots%s: %g to %g; their distance is beyond a double", which, knots[0],
                       knots[count - 1]);
  return BATTEN_OK;
}
