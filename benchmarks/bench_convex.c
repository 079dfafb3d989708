/* Convex surfaces from scattered points.
 *   bench-convex [experiments = 100] [random sets = 500]
 *
 * 1. The experiment of [Juettler 1998, section 6] over noise seeds, beside the paper's figures.
 * 2. Random convex data sets: bodies, outlines, 30 to 5,000 points, noise to 10 %, degrees (2, 2) to (6, 6).
 * 3. The same with dents of six deviations of the noise.
 * 4. Times of a round against the inequalities: 48 unknowns, one core.
 * 5. Functions: distance from the lower bound, inequalities, times by degree and spans.
 * Each result is certified by batten_surface_certify_convex; what is not is counted. CSV lines start with "csv,". */
#include <batten/batten.h>
#include <batten/convex.h>

#include <stdio.h>

#include "convex_scenes.h"

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

/* ---- the paper's experiment ---------------------------------------------------------------------- */

enum { FIGURES = 8 };

static void run_paper(batten_context *ctx, size_t seeds, unsigned rounds) {
  static const char *names[FIGURES] = {
      "unconstrained",       "reference",          "convex", "convex / unconstrained", "K_min", "K_max",
      "K_min unconstrained", "K_max unconstrained"};
  static const double paper[FIGURES] = {0.153, 0.422, 0.244, 0.244 / 0.153, 0.01, 2.32, -63.33, 12.44};
  double *values[FIGURES], rows[2] = {0, 0};
  size_t done = 0, certified = 0, below = 0;
  for (int k = 0; k < FIGURES; k++) values[k] = convex_allocate(seeds, sizeof(double));
  double start = batten_now();
  for (uint64_t seed = 0; seed < seeds; seed++) {
    convex_scene s = convex_scene_paper(seed);
    batten_convex_options o = batten_convex_options_default();
    batten_convex_info f;
    batten_surface *surface = NULL;
    o.rounds = rounds;
    if (batten_convex_fit(ctx, s.count, s.points, &o, &surface, NULL, &f) >= 0) {
      const double figures[FIGURES] = {f.lsq_unconstrained,
                                       f.lsq_reference,
                                       f.lsq,
                                       f.lsq / f.lsq_unconstrained,
                                       f.gauss_min,
                                       f.gauss_max,
                                       f.gauss_min_unconstrained,
                                       f.gauss_max_unconstrained};
      for (int k = 0; k < FIGURES; k++) values[k][done] = figures[k];
      for (int k = 0; k < 2; k++) rows[k] += (double)f.rows_per_round[k];
      certified += f.convexity.certified != 0;
      below += f.lsq < f.lsq_reference;
      done++;
    }
    batten_surface_free(surface);
    convex_scene_free(&s);
  }
  double time = batten_now() - start;
  printf("\n## The paper's experiment, %zu seeds, %u rounds\n", seeds, rounds);
  printf("%-24s %9s %9s %9s %9s %9s %9s\n", "", "paper", "least", "10 %", "median", "90 %", "most");
  for (int k = 0; k < FIGURES && done; k++) {
    printf("%-24s %9.4g", names[k], paper[k]);
    for (int q = 0; q < 5; q++) {
      static const double at[5] = {0, 0.1, 0.5, 0.9, 1};
      printf(" %9.3g", quantile(done, values[k], at[q]));
    }
    printf("\n");
  }
  printf("rows in rounds 1 and 2, mean: %.0f, %.0f (paper: 1761, 9674)\n", rows[0] / (double)done,
         rows[1] / (double)done);
  printf("certified %zu of %zu, below the reference %zu, %.1f ms each\n", certified, seeds, below,
         1e3 * time / (double)seeds);
  printf("csv,paper,%u,%zu,%zu,%.4f\n", rounds, seeds, certified, quantile(done, values[3], 0.5));
  for (int k = 0; k < FIGURES; k++) free(values[k]);
}

/* ---- random sets --------------------------------------------------------------------------------- */

typedef struct trial {
  size_t unknowns;
  bool certified;
  double rows, boxes, seconds, ratio;
} trial;

/* One row for each range of unknowns. */
static void print_trials(size_t count, const trial *trials) {
  static const size_t bounds[] = {27, 36, 60, 90, 147};
  double *of[4];
  for (int k = 0; k < 4; k++) of[k] = convex_allocate(count, sizeof(double));
  printf(
      "| unknowns | sets | certified | rows of the last round: median, most | boxes: median, most | "
      "seconds: median, 90 %%, most | convex / unconstrained: median, 90 %% |\n|---|---|---|---|---|---|---|\n");
  for (size_t b = 1; b < sizeof bounds / sizeof *bounds; b++) {
    size_t n = 0, certified = 0, least = b == 1 ? bounds[0] : bounds[b - 1] + 1;
    for (size_t i = 0; i < count; i++) {
      const trial *t = &trials[i];
      if (t->unknowns < least || t->unknowns > bounds[b]) continue;
      const double figures[4] = {t->rows, t->boxes, t->seconds, t->ratio};
      for (int k = 0; k < 4; k++) of[k][n] = figures[k];
      certified += t->certified;
      n++;
    }
    printf("| %zu to %zu | %zu | %zu | %.0f, %.0f | %.0f, %.0f | %.2f, %.2f, %.1f | %.2f, %.2f |\n", least, bounds[b],
           n, certified, quantile(n, of[0], 0.5), quantile(n, of[0], 1), quantile(n, of[1], 0.5),
           quantile(n, of[1], 1), quantile(n, of[2], 0.5), quantile(n, of[2], 0.9), quantile(n, of[2], 1),
           quantile(n, of[3], 0.5), quantile(n, of[3], 0.9));
  }
  for (int k = 0; k < 4; k++) free(of[k]);
}

static void run_random(batten_context *ctx, size_t sets, double dent) {
  size_t counts[3] = {0, 0, 0}, planes = 0, found = 0, wide = 0, failed = 0;
  double *times = convex_allocate(sets, sizeof *times), *rows = convex_allocate(sets, sizeof *rows);
  double *misfits = convex_allocate(sets, sizeof *misfits);
  trial *trials = convex_allocate(sets, sizeof *trials);
  memset(trials, 0, sets * sizeof *trials);
  printf("\n## %zu random convex sets, dent %g deviations of noise\n", sets, dent);
  for (uint64_t seed = 0; seed < sets; seed++) {
    convex_rule rule = convex_rule_random(seed);
    uint64_t state = seed;
    batten_convex_options o = batten_convex_options_default();
    for (int k = 0; k < 2; k++) o.degree[k] = 2 + (unsigned)(5 * scene_uniform(&state));
    if (dent > 0) {
      rule.noise = fmin(rule.noise, 0.3 / dent);
      rule.dent_depth = dent * rule.noise;
      rule.dent_at[0] = -0.2;
      rule.dent_at[1] = -0.3;
    }
    convex_scene s = convex_scene_make(&rule);
    size_t inside = 0;
    for (size_t i = 0; i < s.count; i++) inside += s.dent[i];
    batten_convex_info f = {0};
    batten_surface *surface = NULL;
    double start = batten_now();
    batten_status st = batten_convex_fit(ctx, s.count, s.points, &o, &surface, NULL, &f);
    times[seed] = batten_now() - start;
    rows[seed] = f.rounds ? (double)f.rows_per_round[f.rounds - 1] : 0;
    misfits[seed] = f.misfit;
    if (st < 0) {
      printf("seed %zu: %s %s\n", (size_t)seed, batten_status_name(st), batten_error(ctx));
      failed++;
    } else {
      counts[st == BATTEN_OK ? 0 : st == BATTEN_W_SHAPE ? 1 : 2]++;
      planes += f.plane != 0;
      trials[seed] = (trial){f.unknowns,  f.convexity.certified != 0,
                             rows[seed],  f.rounds ? (double)f.boxes_per_round[f.rounds - 1] : 0,
                             times[seed], f.lsq / f.lsq_unconstrained};
      wide += inside >= 30;
      found += inside >= 30 && st == BATTEN_W_SHAPE;
      printf("csv,random,%g,%zu,%d,%d,%zu,%u,%u,%.4g,%s,%.6g,%.6g,%.6g,%.2f,%zu,%zu,%.4f\n", dent, (size_t)seed,
             (int)rule.body, (int)rule.outline, s.count, o.degree[0], o.degree[1], rule.noise, batten_status_name(st),
             f.lsq_unconstrained, f.lsq_reference, f.lsq, f.misfit, (size_t)rows[seed],
             f.rounds ? f.boxes_per_round[f.rounds - 1] : 0, times[seed]);
    }
    batten_surface_free(surface);
    convex_scene_free(&s);
  }
  if (dent == 0) print_trials(sets, trials);
  printf("certified and accepted %zu, refused by shape %zu (planes %zu), not proven %zu, failed %zu\n", counts[0],
         counts[1], planes, counts[2], failed);
  if (dent > 0) printf("dents of 30 points or more: %zu, found %zu\n", wide, found);
  printf("seconds: median %.3f, 90 %% %.3f, most %.3f\n", quantile(sets, times, 0.5), quantile(sets, times, 0.9),
         quantile(sets, times, 1));
  printf("rows of the last round: median %.0f, most %.0f; misfit: median %.1f, most %.1f\n",
         quantile(sets, rows, 0.5), quantile(sets, rows, 1), quantile(sets, misfits, 0.5),
         quantile(sets, misfits, 1));
  free(trials);
  free(misfits);
  free(rows);
  free(times);
}

/* ---- times against m ------------------------------------------------------------------------------ */

static void run_times(batten_context *ctx) {
  printf("\n## Times against the inequalities: 48 unknowns, 51 points, milliseconds a round\n");
  printf("| rows | boxes | inequalities | quadratic program | parameter correction |\n|---|---|---|---|---|\n");
  for (uint64_t seed = 0; seed < 8; seed++) {
    convex_scene s = convex_scene_paper(seed);
    for (unsigned rounds = 1; rounds <= 10; rounds += 3) {
      batten_convex_options o = batten_convex_options_default();
      batten_convex_info f;
      batten_surface *surface = NULL;
      o.rounds = rounds;
      o.rounds_tol = 0;
      if (batten_convex_fit(ctx, s.count, s.points, &o, &surface, NULL, &f) >= 0) {
        double rows = 0, boxes = 0;
        for (unsigned k = 0; k < f.rounds; k++) {
          rows += (double)f.rows_per_round[k] / f.rounds;
          boxes += (double)f.boxes_per_round[k] / f.rounds;
        }
        printf("| %.0f | %.1f | %.2f | %.2f | %.2f |\n", rows, boxes, 1e3 * f.time_rows_s / f.rounds,
               1e3 * f.time_qp_s / f.rounds, 1e3 * f.time_correction_s / f.rounds);
      }
      batten_surface_free(surface);
    }
    convex_scene_free(&s);
  }
}

/* ---- functions ------------------------------------------------------------------------------------ */

static void run_function(batten_context *ctx, const char *name, convex_function function, size_t count,
                         unsigned degree, unsigned spans) {
  convex_scene s = convex_scene_function(function, count, 0.1, 1);
  batten_convex_function_options o = batten_convex_function_options_default();
  batten_convex_function_info f = {0};
  batten_surface *surface = NULL;
  for (int k = 0; k < 2; k++) {
    o.degree[k] = degree;
    o.spans[k] = spans;
  }
  double start = batten_now();
  batten_status st = batten_convex_function_fit(ctx, s.count, s.points, &o, &surface, NULL, &f);
  printf("| %s | %zu | %u | %u x %u | %zu | %.2g %% | %zu | %zu | %u | %.2f | %s |\n", name, count, degree, spans,
         spans, f.unknowns, 100 * (1 - f.objective_lower / f.objective),
         f.rounds ? f.rows_per_round[f.rounds - 1] : 0, f.rows_outer, f.rounds, batten_now() - start,
         f.convexity.certified ? st == BATTEN_OK ? "yes" : "yes, gap left" : "no");
  fflush(stdout);
  batten_surface_free(surface);
  convex_scene_free(&s);
}

static void run_functions(batten_context *ctx) {
  static const unsigned degrees[] = {2, 3, 5, 7};
  printf(
      "\n## Convex functions, noise 0.1\n| data | points | degree | spans | unknowns | above the lower bound | "
      "sufficient inequalities | necessary ones | rounds | seconds | proven |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (size_t d = 0; d < sizeof degrees / sizeof *degrees; d++)
    for (unsigned spans = 1; spans <= 4; spans += 3) {
      run_function(ctx, "soft maximum", CONVEX_F_SOFT_MAX, 400, degrees[d], spans);
      run_function(ctx, "roof", CONVEX_F_ROOF, 400, degrees[d], spans);
    }
  run_function(ctx, "soft maximum", CONVEX_F_SOFT_MAX, 2000, 3, 20);
}

int main(int argc, char **argv) {
  size_t seeds = argc > 1 ? strtoul(argv[1], NULL, 10) : 100, sets = argc > 2 ? strtoul(argv[2], NULL, 10) : 500;
  batten_context *ctx = NULL;
  if (batten_context_new(NULL, &ctx) < 0) return 1;
  printf("batten %s, compiler %s, one thread of batten's own\n", batten_version(), __VERSION__);
  if (seeds) {
    run_paper(ctx, seeds, 2);
    run_paper(ctx, seeds, 3);
    run_paper(ctx, seeds, 10);
  }
  if (sets) {
    run_random(ctx, sets, 0);
    run_random(ctx, sets / 5, 6);
  }
  run_times(ctx);
  run_functions(ctx);
  batten_context_free(ctx);
  return 0;
}
