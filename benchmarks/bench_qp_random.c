/* How often each engine solves random quadratic programs whose solution is known, as a Markdown table.
 * Usage: bench-qp-random [FIRST COUNT [MOST_N MOST_M]]; default 0 10000 500 50000.
 * What counts as solved is stated in tests/qp_trials.h. The interior point gets no problem on which its cost, m n^2 +
 * n^3 by step, is above 1e8: its place is elsewhere; how many these are is printed. */
#include "qp_trials.h"

static unsigned long long argument(int argc, char **argv, int i, unsigned long long otherwise) {
  return argc > i ? strtoull(argv[i], NULL, 10) : otherwise;
}

int main(int argc, char **argv) {
  const double DEAR = 1e8;
  unsigned long long first = argument(argc, argv, 1, 0), count = argument(argc, argv, 2, 10000);
  size_t most_n = (size_t)argument(argc, argv, 3, 500), most_m = (size_t)argument(argc, argv, 4, 50000), dear = 0;
  batten_context *ctx = NULL;
  batten_qp_workspace *workspace = NULL;
  if (batten_context_new(NULL, &ctx) < 0 || batten_qp_workspace_new(ctx, &workspace) < 0) {
    fprintf(stderr, "out of memory\n");
    return 1;
  }
  qp_trials t = {0};
  for (unsigned long long number = first; number < first + count; number++) {
    fflush(stdout);
    qp_scene_spec spec = qp_scene_spec_random(number, most_n, most_m);
    double n = (double)spec.n, step = (spec.sparse ? 64 : n * n) * (double)spec.m + n * n * n;
    bool is_dear = step > DEAR;
    dear += is_dear;
    qp_trials_run(ctx, workspace, &t, number, &spec, is_dear ? 0x7 : 0xf);
  }
  printf(
      "Problems %llu to %llu of the generator, n to %zu, m to %zu, condition to 1e10, every twentieth semidefinite;\n"
      "%zu of them too dear for the interior point.\n\n"
      "| engine | solved | of | %% | semidefinite | of | primal | dual | gap | x / allowed | seconds | steps |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|\n",
      first, first + count - 1, most_n, most_m, dear);
  bool all = true;
  for (int e = 0; e < 4; e++) {
    printf("| %s | %zu | %zu | %.2f | %zu | %zu | %.1e | %.1e | %.1e | %.2g | %.1f | %zu |\n", qp_engine_names[e],
           t.passed[e], t.runs[e], t.runs[e] ? 100 * (double)t.passed[e] / (double)t.runs[e] : 100,
           t.semidefinite_passed[e], t.semidefinite[e], t.primal[e], t.dual[e], t.gap[e], t.off[e], t.seconds[e],
           t.pivots[e]);
    all = all && t.passed[e] == t.runs[e];
  }
  batten_qp_workspace_free(workspace);
  batten_context_free(ctx);
  return !all;
}
