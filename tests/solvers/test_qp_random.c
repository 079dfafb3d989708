/* Random quadratic programs whose solution is known, by every engine; see qp_trials.h for what counts as right.
 * Usage: test [FIRST COUNT], to run other problems than those of the suite. */
#include "qp_trials.h"
#include "tap.h"

static void report(const char *what, const qp_trials *t) {
  for (int e = 0; e < 4; e++) {
    if (!t->runs[e]) continue;
    T_CHECK(t->passed[e] == t->runs[e],
            "%s, %s: %zu of %zu right (semidefinite: %zu of %zu); worst primal %.2g, dual %.2g, gap %.2g, x %.2g of "
            "what is "
            "allowed; %.2f s",
            what, qp_engine_names[e], t->passed[e], t->runs[e], t->semidefinite_passed[e], t->semidefinite[e],
            t->primal[e], t->dual[e], t->gap[e], t->off[e], t->seconds[e]);
  }
}

/* The scenes whose solution is not known: residuals and gap alone, and engines against each other. */
static void test_shape(batten_context *ctx, const char *what, qp_scene *s, unsigned mask) {
  size_t n = s->problem.n, m = s->c.rows;
  double *x = qp_scene_array(s, n, sizeof *x), *y = qp_scene_array(s, m + n, sizeof *y), objective = NAN;
  for (int e = 0; e < 4; e++) {
    if (!(mask >> e & 1)) continue;
    batten_qp_options o = batten_qp_options_default();
    batten_qp_info info = {0};
    batten_qp_solution solution = {.x = x, .multipliers = y};
    o.engine = qp_engines[e];
    o.x0 = s->start;
    batten_status status = batten_qp_solve(ctx, &s->problem, &o, NULL, &solution, &info);
    qp_verdict v = {.primal = INFINITY};
    if (status >= 0) v = qp_check(&s->problem, x, y);
    T_CHECK(
        status == BATTEN_OK && qp_check_within(&v, 1e-9, 1e-3),
        "%s of %zu x %zu, %s: primal %.2g, dual %.2g of %.2g, gap %.2g of %.2g, %zu active, %zu pivots, %.4f s %s",
        what, n, m, qp_engine_names[e], v.primal, v.dual, v.dual_scale, v.gap, v.gap_scale, info.rows_active,
        info.iterations, info.time_s, status ? batten_error(ctx) : "");
    if (isnan(objective)) objective = v.objective;
    T_RATIO(fabs(v.objective - objective) / fmax(fabs(objective), 1e-3 * v.gap_scale), 1e-8,
            "objective %.12g against the first", v.objective);
  }
  qp_scene_free(s);
}

int main(int argc, char **argv) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  batten_qp_workspace *workspace = NULL;
  T_OK(batten_qp_workspace_new(ctx, &workspace), ctx);
  uint64_t first = argc > 1 ? strtoull(argv[1], NULL, 10) : 0, count = argc > 2 ? strtoull(argv[2], NULL, 10) : 250;
  qp_trials small = {0}, large = {0};
  for (uint64_t number = first; number < first + count; number++) {
    qp_scene_spec spec = qp_scene_spec_random(number, 60, 2000);
    qp_trials_run(ctx, workspace, &small, number, &spec, 0xf);
  }
  report("small problems", &small);
  if (argc <= 1) {
    /* Sizes at the end of the range, each once; of 500 unknowns those two that take less than a second. */
    static const qp_scene_spec specs[] = {
        {.seed = 1, .n = 500, .m = 800, .condition = 1e10, .active = 20, .sparse = true},
        {.seed = 2, .n = 20, .m = 50000, .condition = 1e6, .active = 15, .two_sided = true, .sparse = true},
        {.seed = 3, .n = 30, .m = 10000, .condition = 1e4, .active = 25, .lsq = true},
        {.seed = 4,
         .n = 100,
         .m = 400,
         .condition = 1e8,
         .active = 40,
         .equalities = 20,
         .bounds = true,
         .lsq = true}};
    for (size_t i = 0; i < sizeof specs / sizeof *specs; i++)
      qp_trials_run(ctx, workspace, &large, i, &specs[i], i == 0 ? 0x5 : 0xf);
    report("large problems", &large);
    test_shape(ctx, "patch", qp_scene_patch(0, false, 1), 0xf);
    test_shape(ctx, "patch", qp_scene_patch(1, true, 2), 0xf);
    test_shape(ctx, "curve", qp_scene_curve(30, 0.1, 3), 0xf);
    test_shape(ctx, "banded curve", qp_scene_curve(500, 0.1, 3), 0x9);
    test_shape(ctx, "3-convex", qp_scene_convex(60, 3, 0.1, 3), 0xf);
    test_shape(ctx, "banded 3-convex", qp_scene_convex(1000, 3, 0.1, 3), 0x9);
  }
  batten_qp_workspace_free(workspace);
  batten_context_free(ctx);
  return t_done();
}
