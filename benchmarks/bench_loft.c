/* Lofts: surfaces through contours that keep the shape of their sections.
 *   bench-loft [random stacks = 500] [most contours = 200] [most spans = 200]
 *
 * 0. The paper's example: four open quadratic contours at equal distances, degree (2, 3).
 * 1. Random stacks: degrees 2 to 5, C^1 and C^2, 3 to 12 contours of 4 to 30 knots, spans over two powers of ten,
 *    turned and moved, open and closed, with and without inflections: what is proven and what that took.
 * 2. Growth: 4 to 200 contours of 60 spans, 8 to 200 spans in 20 contours, closed and cubic, all on the same knots
 * and each on its own; times of the parts, one thread; the last column is the time over contours x spans. CSV lines
 * start with "csv,". */
#include <batten/batten.h>
#include <batten/loft.h>
#include <stdio.h>

#include "loft_scenes.h"

static int by_value(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

/* Quantile of values that are put in order. */
static double quantile(size_t n, double *values, double q) {
  if (n == 0) return NAN;
  qsort(values, n, sizeof *values, by_value);
  return values[(size_t)(q * (double)(n - 1))];
}

typedef struct outcome {
  batten_status status;
  batten_loft_info info;
  double seconds;
} outcome;

static outcome run(batten_context *ctx, const loft_rule *rule, const batten_loft_options *opt) {
  outcome out = {0};
  loft_scene s = loft_scene_make(ctx, rule);
  batten_loft_options o = opt ? *opt : batten_loft_options_default();
  batten_loft *loft = NULL;
  for (int e = 0; e < 2; e++) o.slopes[e] = s.slopes[e];
  double start = batten_now();
  out.status =
      batten_loft_build(ctx, s.count, (const batten_curve *const *)s.contours, s.heights, &o, &loft, NULL, &out.info);
  out.seconds = batten_now() - start;
  batten_loft_free(loft);
  loft_scene_free(&s);
  return out;
}

/* ---- the paper's example ------------------------------------------------------------------------- */

static void run_paper(batten_context *ctx) {
  batten_loft_options o = batten_loft_options_default();
  o.degree_z = 3;
  outcome r = run(ctx, &(loft_rule){.kind = LOFT_PAPER, .degree = 2, .smoothness = 1}, &o);
  const batten_loft_info *f = &r.info;
  printf("\n## The paper's example: four quadratic C^1 contours on different knots, equal distances\n\n");
  if (r.status < 0) {
    printf("%s\n", batten_error(ctx));
    return;
  }
  printf("degree (%u, %u), asked for (2, 3); %zu unknowns; %zu inequalities, %zu handed on; %u rounds; %.1f ms\n",
         f->degree_t, f->degree_z, f->unknowns, f->rows, f->rows_used, f->rounds, 1e3 * r.seconds);
  printf("wrong signs without inequalities: %zu of %zu pairs; with them: %zu; proven: %s, margin %.3g\n",
         f->sign_violations_unconstrained, f->sign_pairs, f->sign_violations, f->certified ? "yes" : "no",
         f->margin_min);
  printf("objective %.6g, without inequalities %.6g\n", f->objective, f->objective_unconstrained);
}

/* ---- random stacks ------------------------------------------------------------------------------- */

enum { MEASURES = 5 };

typedef struct tally {
  size_t tried, failed, proven, elastic, proven_feasible, wrong_free, wrong, raised[10], inserted, pairs, free_pairs;
  size_t wrong_pairs_free, wrong_pairs;
  size_t done;
  double *values[MEASURES];
} tally;

static void count_outcome(tally *t, const outcome *r, uint64_t seed, const loft_rule *rule) {
  const batten_loft_info *f = &r->info;
  bool elastic = f->vertices_elastic > 0;
  t->proven += f->certified != 0;
  t->elastic += elastic;
  t->proven_feasible += f->certified && !elastic;
  t->wrong_free += f->sign_violations_unconstrained > 0;
  t->wrong += f->sign_violations > 0;
  t->wrong_pairs_free += f->sign_violations_unconstrained;
  t->wrong_pairs += f->sign_violations;
  t->pairs += f->sign_pairs;
  t->free_pairs += f->sign_pairs_free;
  t->raised[f->degree_raised < 9 ? f->degree_raised : 9]++;
  t->inserted += f->knots_inserted > 0;
  const double values[MEASURES] = {f->interpolation_error, f->continuity_error,
                                   f->objective_unconstrained > 0 ? f->objective / f->objective_unconstrained : 1,
                                   r->seconds, (double)f->rows};
  for (int k = 0; k < MEASURES; k++) t->values[k][t->done] = values[k];
  t->done++;
  printf("csv,random,%zu,%u,%u,%d,%zu,%zu,%s,%u,%u,%zu,%zu,%zu,%zu,%zu,%d,%zu,%.3g,%.3g,%.6g,%.6g,%.4f\n",
         (size_t)seed, rule->degree, rule->smoothness, rule->closed, rule->contours, rule->inflections,
         batten_status_name(r->status), f->degree_z, f->degree_raised, f->knots_inserted, f->sign_pairs,
         f->sign_pairs_free, f->sign_violations_unconstrained, f->sign_violations, f->certified, f->vertices_elastic,
         f->interpolation_error, f->continuity_error, f->objective, f->objective_unconstrained, r->seconds);
}

static void print_tally(tally *t) {
  static const char *const names[MEASURES] = {"interpolation error / size", "continuity error / size",
                                              "objective / without inequalities", "seconds", "inequalities"};
  static const double at[6] = {0, 0.1, 0.5, 0.9, 0.99, 1};
  printf("\nproven %zu of %zu; without elastic vertices %zu, of these proven %zu; failed %zu\n", t->proven, t->tried,
         t->done - t->elastic, t->proven_feasible, t->failed);
  printf(
      "stacks with wrong signs: %zu without inequalities, %zu with them; pairs of patch and span: %zu and %zu of "
      "%zu (%zu others free)\n",
      t->wrong_free, t->wrong, t->wrong_pairs_free, t->wrong_pairs, t->pairs, t->free_pairs);
  printf("degree raised by 0, 1, 2, ...:");
  for (int k = 0; k < 10; k++) printf(" %zu", t->raised[k]);
  printf("; with inserted knots: %zu\n", t->inserted);
  printf("\n| | least | 10 %% | median | 90 %% | 99 %% | most |\n|---|---|---|---|---|---|---|\n");
  for (int k = 0; k < MEASURES; k++) {
    printf("| %s |", names[k]);
    for (int q = 0; q < 6; q++) printf(" %.4g |", quantile(t->done, t->values[k], at[q]));
    printf("\n");
  }
}

static void run_random(batten_context *ctx, size_t cases) {
  tally t = {.tried = cases};
  for (int k = 0; k < MEASURES; k++) t.values[k] = loft_scene_memory(cases, sizeof(double));
  printf("\n## %zu random stacks\n\n", cases);
  for (uint64_t seed = 0; seed < cases; seed++) {
    loft_rule rule = loft_rule_random(seed);
    outcome r = run(ctx, &rule, NULL);
    if (r.status < 0) {
      printf("stack %zu: %s %s\n", (size_t)seed, batten_status_name(r.status), batten_error(ctx));
      t.failed++;
    } else {
      count_outcome(&t, &r, seed, &rule);
    }
    fflush(stdout);
  }
  print_tally(&t);
  for (int k = 0; k < MEASURES; k++) free(t.values[k]);
}

/* ---- growth -------------------------------------------------------------------------------------- */

static void run_size(batten_context *ctx, size_t contours, size_t spans, double decades) {
  loft_rule rule = {.degree = 3,
                    .smoothness = 2,
                    .closed = true,
                    .contours = contours,
                    .spans = spans,
                    .rotation = 0.2,
                    .seed = 11};
  outcome r = run(ctx, &rule, NULL);
  const batten_loft_info *f = &r.info;
  if (r.status < 0) {
    printf("| %zu | %zu | %s |\n%s\n", contours, spans, batten_status_name(r.status), batten_error(ctx));
    return;
  }
  printf("| %zu | %zu | %zu | %zu | %zu | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f | %zu of %zu | %s | %.3g |\n",
         contours, spans, f->unknowns, f->rows, f->rows_used, r.seconds, f->time_prepare_s, f->time_objective_s,
         f->time_rows_s, f->time_qp_s, f->time_check_s, f->sign_violations_unconstrained, f->sign_pairs,
         f->certified ? "yes" : "no", 1e6 * r.seconds / (double)(contours * spans));
  printf("csv,growth,%zu,%zu,%g,%zu,%zu,%zu,%.6f,%d\n", contours, spans, decades, f->unknowns, f->rows, f->rows_used,
         r.seconds, f->certified);
  fflush(stdout);
}

static void run_growth(batten_context *ctx, size_t most_contours, size_t most_spans) {
  static const size_t contours[] = {4, 10, 20, 50, 100, 200}, spans[] = {8, 20, 60, 120, 200};
  printf(
      "\n## Growth: closed, cubic, C^2; times in s, the last column in us\n\n| contours | spans | unknowns | "
      "inequalities | handed on | whole | prepare | objective | rows | programs | check | wrong without | proven | "
      "per contour and span |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (size_t i = 0; i < sizeof contours / sizeof *contours; i++)
    if (contours[i] <= most_contours) run_size(ctx, contours[i], most_spans < 60 ? most_spans : 60, 0);
  for (size_t i = 0; i < sizeof spans / sizeof *spans; i++)
    if (spans[i] <= most_spans) run_size(ctx, most_contours < 20 ? most_contours : 20, spans[i], 0);
  printf("the same, each contour on knots of its own, spans over one power of ten:\n");
  for (size_t i = 1; i < sizeof contours / sizeof *contours; i += 3)
    if (contours[i] <= most_contours) run_size(ctx, contours[i], most_spans < 60 ? most_spans : 60, 1);
}

int main(int argc, char **argv) {
  size_t cases = argc > 1 ? strtoul(argv[1], NULL, 10) : 500;
  size_t contours = argc > 2 ? strtoul(argv[2], NULL, 10) : 200, spans = argc > 3 ? strtoul(argv[3], NULL, 10) : 200;
  batten_context *ctx = NULL;
  if (batten_context_new(NULL, &ctx) < 0) return 1;
  printf("batten %s, compiler %s, one thread of batten's own\n", batten_version(), __VERSION__);
  run_paper(ctx);
  if (cases) run_random(ctx, cases);
  run_growth(ctx, contours, spans);
  batten_context_free(ctx);
  return 0;
}
