/* Times of the quadratic programming layer, as Markdown tables:
 *   1. shape problems of 48 unknowns with 352 to 27,104 rows: engines against each other, setup and solve apart, cold
 * and with a workspace; from A and b and from their Hessian;
 *   2. banded problems of 300 to 10,000 unknowns;
 *   3. warm starts after two kinds of 1 % change of the data: pivots and time in parts of those of a cold solve.
 * All to 1e-9 absolute, residuals beside times; times are medians. Usage: bench-qp [CSV] */
#include <batten/blas.h>
#include <batten/qp.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "qp_scenes.h"

enum { REPEATS = 15 };
static const double TOLERANCE = 1e-9, BUDGET_S = 1.5, LIMIT_S = 20;
static const char *const engine_names[] = {"auto", "primal", "dual", "interior"};

/* Blocks that the host was asked for. */
static void *counting_allocate(void *user, size_t bytes) {
  ++*(size_t *)user;
  return malloc(bytes);
}
static void counting_release(void *user, void *block) {
  (void)user;
  free(block);
}

static int by_value(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

typedef struct bench {
  batten_context *ctx;
  size_t blocks; /* taken from the host so far */
  FILE *csv;
} bench;

typedef struct run {
  batten_status status;
  double seconds, setup_s, solve_s; /* medians */
  size_t blocks;                    /* from the host in the last solve */
  batten_qp_info info;
} run;

/* Median of several solves; the first, which warms caches and fills the workspace, is not counted when there are
 * others. */
static run solve(bench *b, const batten_qp_problem *p, const batten_qp_options *o, batten_qp_workspace *workspace,
                 const batten_qp_solution *to) {
  double total[REPEATS], setup[REPEATS], engines[REPEATS], began = batten_now();
  batten_qp_solution s = to ? *to : (batten_qp_solution){0};
  run r = {0};
  size_t count = 0;
  for (size_t q = 0; q <= REPEATS; q++) {
    size_t blocks = b->blocks;
    double start = batten_now();
    r.status = batten_qp_solve(b->ctx, p, o, workspace, &s, &r.info);
    double seconds = batten_now() - start;
    r.blocks = b->blocks - blocks;
    if (q == 1) count = 0;
    total[count] = seconds, setup[count] = r.info.time_setup_s, engines[count++] = r.info.time_solve_s;
    if (r.status < 0 || batten_now() - began > BUDGET_S) break;
  }
  qsort(total, count, sizeof *total, by_value);
  qsort(setup, count, sizeof *setup, by_value);
  qsort(engines, count, sizeof *engines, by_value);
  r.seconds = total[count / 2], r.setup_s = setup[count / 2], r.solve_s = engines[count / 2];
  return r;
}

static batten_qp_options options(batten_qp_engine engine) {
  batten_qp_options o = batten_qp_options_default();
  o.engine = engine, o.tolerance_absolute = TOLERANCE, o.tolerance_relative = 0, o.time_limit_s = LIMIT_S;
  return o;
}

static void print_row(bench *b, const char *name, const char *what, const batten_qp_problem *p, const run *r,
                      double again_s) {
  const batten_qp_info *i = &r->info;
  size_t m = p->c ? p->c->rows : 0;
  if (r->status < 0) {
    printf("| %s | %s | %zu | %zu | %s | | | | | | | | | | |\n", name, what, p->n, m, batten_status_name(r->status));
  } else {
    printf("| %s | %s | %zu | %zu | %.3f | %.3f | %.3f | %.3f | %zu | %zu | %zu | %zu | %.1e | %.1e | %.1e |%s\n",
           name, what, p->n, m, 1e3 * r->seconds, 1e3 * r->setup_s, 1e3 * r->solve_s, 1e3 * again_s, i->iterations,
           i->factorizations, i->rows_used, i->rows_active, i->primal_residual, i->dual_residual, i->duality_gap,
           r->status == BATTEN_OK ? "" : " misses the tolerance");
  }
  fflush(stdout);
  if (b->csv)
    fprintf(b->csv, "%s,%s,%zu,%zu,%s,%.6g,%.6g,%.6g,%.6g,%zu,%zu,%zu,%zu,%.3e,%.3e,%.3e\n", name, what, p->n, m,
            batten_status_name(r->status), r->seconds, r->setup_s, r->solve_s, again_s, i->iterations,
            i->factorizations, i->rows_used, i->rows_active, i->primal_residual, i->dual_residual, i->duality_gap);
}

static void table_head(void) {
  printf(
      "| problem | engine | n | m | ms | setup | engine ms | again with workspace | iterations | factorisations | "
      "rows used |"
      " active | primal | dual | gap |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
}

static void table_row(bench *b, const char *name, const batten_qp_problem *p, batten_qp_engine engine) {
  batten_qp_options o = options(engine);
  batten_qp_workspace *workspace = NULL;
  run cold = solve(b, p, &o, NULL, NULL), again = {0};
  if (cold.status >= 0 && batten_qp_workspace_new(b->ctx, &workspace) == BATTEN_OK)
    again = solve(b, p, &o, workspace, NULL);
  batten_qp_workspace_free(workspace);
  char what[32];
  snprintf(what, sizeof what, "%s%s%s", engine_names[engine],
           engine == BATTEN_QP_AUTO && cold.status >= 0 ? ": " : "",
           engine == BATTEN_QP_AUTO && cold.status >= 0 ? engine_names[cold.info.engine] : "");
  print_row(b, name, what, p, &cold, again.seconds);
  if (again.blocks) printf("\n%s: %zu blocks were taken from the host with a workspace\n\n", name, again.blocks);
}

static void shape_problems(bench *b) {
  printf("\n## Convex Bezier patches, 48 unknowns\n\n");
  table_head();
  for (size_t size = 0; size < 4; size++)
    for (int hessian = 0; hessian < 2; hessian++) {
      qp_scene *s = qp_scene_patch(size, hessian, 1);
      const char *name = hessian ? "patch, H" : "patch, A and b";
      table_row(b, name, &s->problem, BATTEN_QP_AUTO);
      table_row(b, name, &s->problem, BATTEN_QP_DUAL);
      table_row(b, name, &s->problem, BATTEN_QP_PRIMAL);
      if (size < 2) table_row(b, name, &s->problem, BATTEN_QP_INTERIOR);
      qp_scene_free(s);
    }
}

static void banded_problems(bench *b) {
  static const size_t sizes[] = {300, 1000, 10000};
  printf("\n## Banded problems\n\n");
  table_head();
  for (size_t q = 0; q < 3; q++)
    for (int curve = 0; curve < 2; curve++) {
      qp_scene *s = curve ? qp_scene_curve(sizes[q] / 2, 0.3, 1) : qp_scene_convex(sizes[q], 2, 0.1, 1);
      const char *name = curve ? "curve" : "convex sequence";
      table_row(b, name, &s->problem, BATTEN_QP_AUTO);
      table_row(b, name, &s->problem, BATTEN_QP_INTERIOR);
      if (sizes[q] <= 300) {
        table_row(b, name, &s->problem, BATTEN_QP_DUAL);
        table_row(b, name, &s->problem, BATTEN_QP_PRIMAL);
      }
      qp_scene_free(s);
    }
}

/* ---- Warm starts ---- */

typedef qp_scene *(*make_scene)(size_t size, uint64_t seed);
static qp_scene *make_patch(size_t size, uint64_t seed) { return qp_scene_patch(size, false, seed); }
static qp_scene *make_curve(size_t size, uint64_t seed) { return qp_scene_curve(size, 0.3, seed); }
static qp_scene *make_sequence(size_t size, uint64_t seed) { return qp_scene_convex(size, 2, 0.1, seed); }

static const double *data_of(const qp_scene *s) { return s->problem.a ? s->problem.b : s->problem.g; }

/* The data moved by 1 % towards those of other noise; or each number by up to 1 % of the largest. */
static double *changed(const qp_scene *s, const qp_scene *other) {
  size_t count = s->problem.a ? s->problem.a->rows : s->problem.n;
  double *out = malloc((count ? count : 1) * sizeof *out), largest = 0;
  uint64_t seed = 7;
  if (!out) exit(1);
  const double *data = data_of(s), *to = other ? data_of(other) : NULL;
  for (size_t i = 0; i < count; i++) largest = fmax(largest, fabs(data[i]));
  for (size_t i = 0; i < count; i++)
    out[i] = data[i] + 0.01 * (to ? to[i] - data[i] : largest * (2 * scene_uniform(&seed) - 1));
  return out;
}

static void warm_row(bench *b, const char *name, make_scene make, size_t size, batten_qp_engine engine, bool noise) {
  qp_scene *s = make(size, 1), *other = noise ? NULL : make(size, 2);
  batten_qp_problem p = s->problem;
  size_t m = p.c->rows;
  double *x = malloc(p.n * sizeof *x), *data = changed(s, other);
  signed char *active = malloc(m + p.n);
  if (!x || !active) exit(1);
  batten_qp_options o = options(engine);
  batten_qp_solution to = {.x = x, .active = active};
  run first = solve(b, &p, &o, NULL, &to);
  if (p.a)
    p.b = data;
  else
    p.g = data;
  run cold = solve(b, &p, &o, NULL, NULL);
  o.x0 = x, o.active = active;
  run warm = solve(b, &p, &o, NULL, NULL);
  const char *kind = noise ? "noise" : "1 % of the way";
  if (first.status == BATTEN_OK && cold.status == BATTEN_OK && warm.status == BATTEN_OK)
    printf("| %s | %s | %s | %zu | %zu | %zu | %zu | %.0f %% | %.3f | %.3f | %.0f %% | %.1e | %.1e | %.1e |\n", name,
           kind, engine_names[engine], p.n, m, cold.info.iterations, warm.info.iterations,
           100 * (double)warm.info.iterations / (double)(cold.info.iterations ? cold.info.iterations : 1),
           1e3 * cold.seconds, 1e3 * warm.seconds, 100 * warm.seconds / cold.seconds, warm.info.primal_residual,
           warm.info.dual_residual, warm.info.duality_gap);
  else
    printf("| %s | %s | %s | %zu | %zu | %s, %s, %s | | | | | | | | |\n", name, kind, engine_names[engine], p.n, m,
           batten_status_name(first.status), batten_status_name(cold.status), batten_status_name(warm.status));
  fflush(stdout);
  free(active);
  free(data);
  free(x);
  qp_scene_free(other);
  qp_scene_free(s);
}

static void warm_starts(bench *b) {
  printf(
      "\n## Warm starts\n\nThe data moved by 1 %% towards those of other noise, or noise of 1 %% of the largest "
      "added.\n\n| problem |"
      " change | engine | n | m | pivots cold | warm | part | ms cold | warm | part | primal | dual | gap |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (int noise = 0; noise < 2; noise++)
    for (batten_qp_engine engine = BATTEN_QP_PRIMAL; engine <= BATTEN_QP_DUAL; engine++) {
      for (size_t size = 0; size < 4; size++) warm_row(b, "patch", make_patch, size, engine, noise);
      warm_row(b, "curve", make_curve, 100, engine, noise);
      warm_row(b, "convex sequence", make_sequence, 200, engine, noise);
    }
}

int main(int argc, char **argv) {
  char blas[256];
  bench b = {0};
  batten_blas_describe(blas, sizeof blas);
  batten_context_options o = batten_context_options_default();
  o.allocate = counting_allocate, o.release = counting_release, o.memory_user = &b.blocks;
  if (batten_context_new(&o, &b.ctx) < 0) return 1;
  b.csv = argc > 1 ? fopen(argv[1], "w") : NULL;
  if (b.csv)
    fprintf(b.csv,
            "problem,engine,n,m,status,seconds,setup,solve,again,iterations,factorizations,rows_used,rows_active,"
            "primal,dual,gap\n");
  printf("# Quadratic programs, tolerance %g absolute\n\nBLAS: %s, %u threads; batten %s, 1 thread; compiler %s\n",
         TOLERANCE, blas, batten_blas_threads(), batten_version(), __VERSION__);
  shape_problems(&b);
  banded_problems(&b);
  warm_starts(&b);
  batten_context_free(b.ctx);
  return b.csv && fclose(b.csv) != 0;
}
