/* Limits of a solve, and the host's word on whether to go on. See engine.h. */
#include "engine.h"

batten_status qp_limits_check(batten_context *ctx, const qp_limits *limits, size_t count, double fraction) {
  batten_status st = batten_progress(ctx, "quadratic program", fmin(fmax(fraction, 0), 1));
  if (st < 0) return st;
  if (count > limits->iterations)
    return batten_fail(ctx, BATTEN_E_LIMIT, "opt.iteration_limit: %zu iterations made; allow more",
                       limits->iterations);
  if (limits->deadline < INFINITY && batten_now() > limits->deadline)
    return batten_fail(ctx, BATTEN_E_LIMIT, "opt.time_limit_s: time is up after %zu iterations; allow more", count);
  return BATTEN_OK;
}
