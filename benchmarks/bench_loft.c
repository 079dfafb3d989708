/* Lofts: surfaces through contours that keep the shape of their sections.
 *   bench-loft [random stacks = 500] [most contours = 200] [most spans = 200]
 *
 * 0. The paper's example: four open quadratic contours at equal distances, degree (2, 3).
 * 1. Random stacks: degrees 2 to 5, C^1 and C^2, 3 to 12 contours of 4 to 30 knots, spans over two powers of ten,
 *    turned and moved, open and closed, with and without inflections: what is proven and what that took.
 * 2. Growth with contours and with spans, cubic, for four families: closed convex contours on the same knots and each
 *    on its own, and two with inflections that have much to put right. A series ends after a loft that took
 *    SECONDS_MOST; its exponent is the slope of least squares through logarithms.
 *
 * One thread of batten's own; OPENBLAS_NUM_THREADS=1 for BLAS. */
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
  printf(
      "| degree | unknowns | inequalities | handed on | rounds | time, ms | wrong signs without | with | of pairs | "
      "proven | margin | objective without | with |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  printf("| (%u, %u) | %zu | %zu | %zu | %u | %.2f | %zu | %zu | %zu | %s | %.3g | %.6g | %.6g |\n", f->degree_t,
         f->degree_z, f->unknowns, f->rows, f->rows_used, f->rounds, 1e3 * r.seconds,
         f->sign_violations_unconstrained, f->sign_violations, f->sign_pairs, f->certified ? "yes" : "no",
         f->margin_min, f->objective_unconstrained, f->objective);
}

/* ---- random stacks ------------------------------------------------------------------------------- */

enum { MEASURES = 5 };

typedef struct tally {
  size_t tried, failed, done, proven, elastic, elastic_proven, in_need, in_need_proven, raised, settled, inserted;
  size_t pairs, pairs_free, wrong_pairs_free, wrong_pairs;
  uint64_t slowest;
  double *values[MEASURES];
} tally;

static void count_outcome(tally *t, const outcome *r, uint64_t seed) {
  const batten_loft_info *f = &r->info;
  bool elastic = f->vertices_elastic > 0, in_need = f->sign_violations_unconstrained > 0;
  t->proven += f->certified != 0;
  t->elastic += elastic;
  t->elastic_proven += elastic && f->certified;
  t->in_need += in_need;
  t->in_need_proven += in_need && f->certified;
  t->settled += f->settled != 0;
  t->raised += f->degree_raised > 0;
  t->inserted += f->knots_inserted > 0;
  t->wrong_pairs_free += f->sign_violations_unconstrained;
  t->wrong_pairs += f->sign_violations;
  t->pairs += f->sign_pairs;
  t->pairs_free += f->sign_pairs_free;
  const double values[MEASURES] = {f->interpolation_error, f->continuity_error,
                                   f->objective_unconstrained > 0 ? f->objective / f->objective_unconstrained - 1 : 0,
                                   r->seconds, (double)f->rows_used};
  for (int k = 0; k < MEASURES; k++) t->values[k][t->done] = values[k];
  double most = 0;
  for (size_t i = 0; i < t->done; i++) most = fmax(most, t->values[3][i]);
  if (r->seconds > most) t->slowest = seed;
  t->done++;
}

static void print_tally(tally *t) {
  static const char *const names[MEASURES] = {"interpolation error / size", "continuity error / size",
                                              "objective / without inequalities, less 1", "seconds",
                                              "inequalities handed on"};
  static const double at[6] = {0, 0.1, 0.5, 0.9, 0.99, 1};
  printf("\n| | stacks |\n|---|---|\n| tried | %zu |\n| failed | %zu |\n| proven | %zu |\n", t->tried, t->failed,
         t->proven);
  printf("| with wrong signs without inequalities | %zu |\n| of them proven | %zu |\n", t->in_need,
         t->in_need_proven);
  printf("| with vertices that gave way | %zu |\n| of them proven all the same | %zu |\n", t->elastic,
         t->elastic_proven);
  printf(
      "| settled by Newton's method | %zu |\n| of a higher degree than asked for | %zu |\n| with knots inserted | "
      "%zu |\n",
      t->settled, t->raised, t->inserted);
  printf(
      "\nPairs of patch and span: %zu, of which %zu have wrong signs without inequalities and %zu with them; %zu "
      "others are free. The slowest stack is %zu.\n",
      t->pairs, t->wrong_pairs_free, t->wrong_pairs, t->pairs_free, (size_t)t->slowest);
  double sum = 0;
  for (size_t i = 0; i < t->done; i++) sum += t->values[3][i];
  printf(
      "All together: %.1f s.\n\n| | least | 10 %% | median | 90 %% | 99 %% | most |\n|---|---|---|---|---|---|---|\n",
      sum);
  for (int k = 0; k < MEASURES; k++) {
    printf("| %s |", names[k]);
    for (int q = 0; q < 6; q++) printf(" %.3g |", quantile(t->done, t->values[k], at[q]));
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
    if (r.status != BATTEN_OK)
      printf("Stack %zu (degree %u, C^%u, %s): %s, %s\n\n", (size_t)seed, rule.degree, rule.smoothness,
             rule.closed ? "closed" : "open", batten_status_name(r.status), batten_error(ctx));
    if (r.status < 0)
      t.failed++;
    else
      count_outcome(&t, &r, seed);
    fflush(stdout);
  }
  print_tally(&t);
  for (int k = 0; k < MEASURES; k++) free(t.values[k]);
}

/* ---- growth -------------------------------------------------------------------------------------- */

static const double SECONDS_MOST = 20;

typedef struct family {
  const char *name;
  loft_rule rule;
} family;

static const family families[] = {
    {"closed, convex, all on the same knots", {.closed = true, .rotation = 0.2}},
    {"closed, convex, each on its own knots over one power of ten", {.closed = true, .rotation = 0.2, .decades = 1}},
    {"open, two inflections, own knots over one power of ten", {.inflections = 2, .rotation = 0.6, .decades = 1}},
    {"closed, four inflections, own knots over one power of ten",
     {.closed = true, .inflections = 4, .rotation = 0.6, .decades = 1}}};

/* Seconds; NaN where it failed. */
static double run_size(batten_context *ctx, const loft_rule *given, size_t contours, size_t spans) {
  loft_rule rule = *given;
  rule.degree = 3;
  rule.smoothness = 2;
  rule.seed = 11;
  rule.contours = contours;
  rule.spans = spans;
  outcome r = run(ctx, &rule, NULL);
  const batten_loft_info *f = &r.info;
  if (r.status < 0) {
    printf("| %zu | %zu | %s: %s |\n", contours, spans, batten_status_name(r.status), batten_error(ctx));
    return NAN;
  }
  printf("| %zu | %zu | %zu | %zu | %zu | %.3f | %.3f | %.3f | %.3f | %.3f | %.3f | %zu | %zu | %zu | %s | %.3g |\n",
         contours, spans, f->unknowns, f->rows, f->rows_used, r.seconds, f->time_prepare_s, f->time_objective_s,
         f->time_rows_s, f->time_qp_s, f->time_check_s, f->sign_violations_unconstrained, f->sign_violations,
         f->sign_pairs, f->certified ? "yes" : "no", 1e6 * r.seconds / (double)(contours * spans));
  fflush(stdout);
  return r.seconds;
}

/* Sizes [count] of contours (spans 60) or of spans (20 contours). */
static void run_series(batten_context *ctx, const family *f, bool contours, size_t count, const size_t *sizes,
                       size_t most) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, seconds = 0;
  printf("\n%s, %s:\n\n", f->name, contours ? "60 spans" : "20 contours");
  printf(
      "| contours | spans | unknowns | inequalities | handed on | whole, s | prepare | objective | rows | programs | "
      "check | wrong without | wrong | of pairs | proven | us per contour and span |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (size_t i = 0; i < count && sizes[i] <= most && !(seconds > SECONDS_MOST); i++) {
    seconds = contours ? run_size(ctx, &f->rule, sizes[i], 60) : run_size(ctx, &f->rule, 20, sizes[i]);
    if (!(seconds > 0)) continue;
    double a = log((double)sizes[i]), b = log(seconds);
    n++, x += a, y += b, xx += a * a, xy += a * b;
  }
  if (seconds > SECONDS_MOST) printf("\nThe series ends here: the last one took over %g s.\n", SECONDS_MOST);
  if (n > 1)
    printf("\nTime grows as %s to the power %.2f.\n", contours ? "contours" : "spans",
           (n * xy - x * y) / (n * xx - x * x));
}

static void run_growth(batten_context *ctx, size_t most_contours, size_t most_spans) {
  static const size_t contours[] = {4, 10, 20, 50, 100, 200}, spans[] = {8, 20, 60, 120, 200};
  printf("\n## Growth\n");
  for (size_t k = 0; k < sizeof families / sizeof *families; k++) {
    run_series(ctx, &families[k], true, sizeof contours / sizeof *contours, contours, most_contours);
    run_series(ctx, &families[k], false, sizeof spans / sizeof *spans, spans, most_spans);
  }
}

int main(int argc, char **argv) {
  size_t cases = argc > 1 ? strtoul(argv[1], NULL, 10) : 500;
  size_t contours = argc > 2 ? strtoul(argv[2], NULL, 10) : 200, spans = argc > 3 ? strtoul(argv[3], NULL, 10) : 200;
  batten_context *ctx = NULL;
  if (batten_context_new(NULL, &ctx) < 0) return 1;
  printf("# Lofts\n\nbatten %s, compiler %s, one thread of batten's own\n", batten_version(), __VERSION__);
  run_paper(ctx);
  if (cases) run_random(ctx, cases);
  run_growth(ctx, contours, spans);
  batten_context_free(ctx);
  return 0;
}
