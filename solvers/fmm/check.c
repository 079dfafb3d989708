/* What can be wrong with the arguments of fast multipole sums. */
#include "fmm/fmm_inner.h"

#include "base/checked.h"

/* Coordinates below it have differences whose seventh powers, and sums of them, stay far from overflow. */
static const double COORDINATE_MAX = 1e30;

static batten_status check_kernel(batten_context *ctx, const batten_radial *kernel) {
  if (kernel->n != 2 && kernel->n != 3)
    return batten_fail(ctx, BATTEN_E_INVALID, "kernel.n: %u; must be 2 or 3", kernel->n);
  if (kernel->logarithm != 0 && kernel->logarithm != 1)
    return batten_fail(ctx, BATTEN_E_INVALID, "kernel.logarithm: %d; must be 0 or 1", kernel->logarithm);
  if (kernel->power < 1 || kernel->power > 7 || kernel->power % 2 == kernel->logarithm)
    return batten_fail(ctx, BATTEN_E_INVALID, "kernel.power: %d; must be %s", kernel->power,
                       kernel->logarithm ? "2, 4 or 6 with a logarithm" : "1, 3, 5 or 7 without a logarithm");
  return BATTEN_OK;
}

static batten_status check_options(batten_context *ctx, const batten_radial *kernel, const batten_fmm_options *opt) {
  batten_status st = batten_check_struct(ctx, "batten_fmm_options", opt->struct_size, sizeof *opt);
  if (st < 0) return st;
  if (!(opt->accuracy >= 1e-12 && opt->accuracy <= 1e-3))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.accuracy: %g; must be 1e-12 .. 1e-3", opt->accuracy);
  const batten_fmm *share = opt->share;
  if (share && share->ctx != ctx) /* whose memory its operators are */
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "opt.share: a plan of another context; share plans of the context that is passed");
  if (share && (share->kernel.n != kernel->n || share->kernel.power != kernel->power))
    return batten_fail(
        ctx, BATTEN_E_INVALID,
        "opt.share: a plan of power %d in %u dimensions, this one has power %d in %u; share plans of the "
        "same kernel only",
        share->kernel.power, share->kernel.n, kernel->power, kernel->n);
  if (share && share->accuracy != opt->accuracy)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.share: a plan of accuracy %g, this one has %g; share equal ones",
                       share->accuracy, opt->accuracy);
  if (share && (!share->gradients != !opt->gradients || !share->dipoles != !opt->dipoles))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "opt.share: a plan with%s gradients and with%s dipoles; share plans that have the same",
                       share->gradients ? "" : "out", share->dipoles ? "" : "out");
  return BATTEN_OK;
}

batten_status batten_fmm_check_points(batten_context *ctx, const char *name, unsigned n, size_t count,
                                      const double *points) {
  size_t doubles;
  if (!batten_mul3(count, n, 16 * sizeof(double), &doubles)) /* 16: more than the plan keeps for a coordinate */
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%s: %zu points", name, count);
  if (count && !points) return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL with %zu points", name, count);
  for (size_t i = 0; i < count * n; i++)
    if (!(fabs(points[i]) < COORDINATE_MAX))
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "%s[%zu][%zu]: %g; must be finite and below %g in size, drop the point", name, i / n, i % n,
                         points[i], COORDINATE_MAX);
  return BATTEN_OK;
}

batten_status batten_fmm_check_plan(batten_context *ctx, const batten_radial *kernel, size_t source_count,
                                    const double *sources, size_t target_count, const double *targets,
                                    const batten_fmm_options *opt) {
  batten_status st = check_kernel(ctx, kernel);
  if (st < 0) return st;
  if ((st = check_options(ctx, kernel, opt)) < 0) return st;
  if ((st = batten_fmm_check_points(ctx, "sources", kernel->n, source_count, sources)) < 0) return st;
  if (targets) return batten_fmm_check_points(ctx, "targets", kernel->n, target_count, targets);
  if (target_count != source_count)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "target_count: %zu without targets; then the targets are the %zu sources, give that number",
                       target_count, source_count);
  return BATTEN_OK;
}

batten_status batten_fmm_check_weights(batten_context *ctx, size_t n, size_t count, const double *weights,
                                       const double *dipoles) {
  size_t i = weights ? batten_first_nonfinite(count, weights) : count;
  if (i < count) return batten_fail(ctx, BATTEN_E_INVALID, "weights[%zu]: %g; must be finite", i, weights[i]);
  i = dipoles ? batten_first_nonfinite(count * n, dipoles) : count * n;
  if (i < count * n)
    return batten_fail(ctx, BATTEN_E_INVALID, "dipoles[%zu][%zu]: %g; must be finite", i / n, i % n, dipoles[i]);
  return BATTEN_OK;
}

batten_status batten_fmm_check_terms(batten_context *ctx, const batten_fmm *fmm, const double *weights,
                                     const double *dipoles) {
  if (dipoles && !fmm->dipoles)
    return batten_fail(ctx, BATTEN_E_INVALID, "dipoles: given to a plan without; set opt.dipoles when it is made");
  return batten_fmm_check_weights(ctx, fmm->kernel.n, fmm->sources.count, weights, dipoles);
}
