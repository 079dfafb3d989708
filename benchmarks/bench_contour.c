/* Shape-preserving curves through points of the plane.
 *   bench-contour [random cases = 1000] [most points = 100000]
 *
 * 0. The paper's experiment: two sets of eight sections, two rounds.
 * 1. Growth: 100 to 100,000 points with spans in proportion, up to 2,000: times of the parts, one thread.
 * 2. Random cases: 20 to 2,000 points, degrees 2 to 6, C^1 and C^2, 0 to 6 inflections, noise to 5 %; with the
 *    inflections given, and found. What is proven, whether a second round is ever worse, the sum of squares beside
 *    that without inequalities, and how often construction 1 stands in for 2. CSV lines start with "csv,". */
#include <batten/batten.h>
#include <batten/contour.h>
#include <stdio.h>

#include "contour_scenes.h"

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

static void run_paper(batten_context *ctx) {
  printf("\n## The paper's experiment: 296 points, 16 cubic C^2 curves of 8 or more spans, two rounds\n\n");
  printf(
      "| set | curve | points | inflections of least squares | wanted | found | sum of least squares | reference | "
      "round 1 | round 2 | proven |\n|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (int aft = 0; aft < 2; aft++) {
    double sums[4] = {0};
    size_t points = 0, counts[3] = {0}, proven = 0;
    for (size_t k = 0; k < CONTOUR_SECTIONS; k++) {
      contour_scene s = contour_section(aft, k);
      batten_contour_options o = batten_contour_options_default();
      batten_contour_info f = {0};
      batten_curve *curve = NULL;
      o.parameters = s.lengths;
      o.spans = 8;
      o.rounds = 2;
      o.sign = s.sign;
      o.inflection_count = s.inflection_count;
      o.inflections = s.inflections;
      if (batten_contour_fit(ctx, s.count, s.points, &o, &curve, NULL, NULL, &f) < 0)
        printf("%s\n", batten_error(ctx));
      const double row[4] = {f.lsq_unconstrained, f.lsq_reference, f.lsq_per_round[0], f.lsq};
      printf("| %s | %zu | %zu | %zu | %zu | %zu | %.3g | %.3g | %.3g | %.3g | %s |\n", aft ? "aft" : "fore", k + 1,
             s.count, f.inflections_unconstrained, f.inflections_wanted, f.inflections_found, row[0], row[1], row[2],
             row[3], f.shape.certified ? "yes" : "no");
      for (int i = 0; i < 4; i++) sums[i] += row[i];
      points += s.count;
      counts[0] += f.inflections_unconstrained;
      counts[1] += f.inflections_wanted;
      counts[2] += f.inflections_found;
      proven += f.shape.certified != 0;
      batten_curve_free(curve);
      contour_scene_free(&s);
    }
    printf("| %s | all | %zu | %zu | %zu | %zu | %.3g | %.3g | %.3g | %.3g | %zu |\n", aft ? "aft" : "fore", points,
           counts[0], counts[1], counts[2], sums[0], sums[1], sums[2], sums[3], proven);
  }
}

/* ---- growth -------------------------------------------------------------------------------------- */

static void print_growth(size_t count, double seconds, double last, const batten_contour_info *f, batten_status st) {
  printf("| %zu | %zu | %.1f | %.2f | %.1f | %.1f | %.1f | %.1f | %.1f | %.1f | %.1f | %zu | %s |\n", count, f->spans,
         1e3 * seconds, last > 0 ? seconds / last : NAN, 1e3 * f->time_parameters_s, 1e3 * f->time_knots_s,
         1e3 * f->time_reference_s, 1e3 * f->time_rows_s, 1e3 * f->time_qp_s, 1e3 * f->time_correction_s,
         1e3 * f->time_check_s, f->iterations,
         st < 0               ? batten_status_name(st)
         : f->shape.certified ? "yes"
                              : "no");
  printf("csv,growth,%zu,%zu,%.6f,%u,%.6g,%.6g\n", count, f->spans, seconds, f->rounds, f->lsq, f->lsq_unconstrained);
  fflush(stdout);
}

/* Points in steps of about sqrt(10); a span for 50 of them. */
static void run_growth(batten_context *ctx, size_t most) {
  static const size_t counts[] = {100, 300, 1000, 3000, 10000, 30000, 100000};
  double last = 0;
  printf("\n## Growth: cubic, C^2, 4 inflections, noise 0.1 %%, two rounds of three corrections; times in ms\n\n");
  printf(
      "| points | spans | whole | times the last | parameters | knots | reference | rows | programs | correction | "
      "proof | iterations | proven |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (size_t i = 0; i < sizeof counts / sizeof *counts && counts[i] <= most; i++) {
    contour_scene s = contour_scene_make(
        &(contour_rule){.kind = CONTOUR_WAVE, .count = counts[i], .inflections = 4, .noise = 0.001, .seed = 9});
    batten_contour_options o = batten_contour_options_default();
    batten_contour_info f = {0};
    batten_curve *curve = NULL;
    o.spans = counts[i] / 50 > 12 ? counts[i] / 50 : 12;
    o.rounds = 2;
    o.inflection_count = s.inflection_count;
    o.inflections = s.inflections;
    o.parameters = s.lengths;
    o.domain[0] = 0;
    o.domain[1] = 1;
    double start = batten_now();
    batten_status st = batten_contour_fit(ctx, s.count, s.points, &o, &curve, NULL, NULL, &f);
    double seconds = batten_now() - start;
    print_growth(counts[i], seconds, last, &f, st);
    if (st < 0) printf("%s\n", batten_error(ctx));
    last = seconds;
    batten_curve_free(curve);
    contour_scene_free(&s);
  }
}

/* ---- random cases -------------------------------------------------------------------------------- */

enum { MEASURES = 5 };

typedef struct tally {
  size_t tried, proven, accepted, refused, unproven, failed; /* refused: the data have another shape */
  size_t worse, fallbacks, below, right;                     /* right: as many inflections as the curve has */
  size_t done;
  size_t noisy, exact;
  double *ratios, *reference, *seconds, *rows; /* ratios: of noisy cases, two coordinates an unknown at least */
  double *off;                                 /* of exact ones: root mean square distance, parts of the size */
} tally;

static batten_contour_options random_options(const contour_scene *s, uint64_t seed, bool given) {
  batten_contour_options o = batten_contour_options_default();
  uint64_t state = seed ^ 0x6a09e667f3bcc909u;
  o.degree = 2 + (unsigned)(5 * scene_uniform(&state));
  o.smoothness = o.degree > 2 && scene_uniform(&state) < 0.6 ? 2 : 1;
  o.closed = s->closed;
  if (!given) return o;
  o.inflection_count = s->inflection_count;
  o.inflections = s->inflections;
  o.sign = s->sign;
  o.parameters = s->lengths;
  o.domain[0] = 0;
  o.domain[1] = 1;
  return o;
}

static void count_fit(tally *t, uint64_t seed, const contour_rule *rule, const contour_scene *s,
                      const batten_contour_options *o, batten_status st, const batten_contour_info *f,
                      double seconds) {
  t->accepted += st == BATTEN_OK;
  t->refused += st == BATTEN_W_SHAPE;
  t->unproven += st == BATTEN_W_ACCURACY;
  t->proven += f->shape.certified != 0;
  t->fallbacks += f->fallback != 0;
  t->below += f->lsq <= f->lsq_reference;
  t->right += f->inflections_found == s->inflection_count;
  for (unsigned r = 1; r < f->rounds && r < BATTEN_CONTOUR_ROUNDS_MAX; r++)
    if (f->lsq_per_round[r] > f->lsq_per_round[r - 1]) {
      t->worse++;
      break;
    }
  if (rule->noise > 0 && s->count >= f->unknowns) /* else least squares nearly interpolate */
    t->ratios[t->noisy++] = f->lsq / f->lsq_unconstrained;
  else if (rule->noise == 0)
    t->off[t->exact++] = f->rms / s->size;
  t->reference[t->done] = f->lsq_reference > 0 ? f->lsq / f->lsq_reference : 1;
  t->seconds[t->done] = seconds;
  t->rows[t->done] = f->rounds ? (double)f->rows_per_round[f->rounds - 1] : 0;
  t->done++;
  printf("csv,random,%zu,%d,%zu,%u,%u,%.4g,%zu,%zu,%zu,%zu,%s,%.6g,%.6g,%.6g,%u,%u,%.4f\n", (size_t)seed,
         (int)rule->kind, s->count, o->degree, o->smoothness, rule->noise, s->inflection_count, f->inflections_wanted,
         f->inflections_found, f->spans, batten_status_name(st), f->lsq_unconstrained, f->lsq_reference, f->lsq,
         f->construction, f->rounds, seconds);
}

static void print_tally(tally *t) {
  printf("proven %zu of %zu: accepted %zu, refused for their shape %zu, not proven %zu; failed %zu\n", t->proven,
         t->tried, t->accepted, t->refused, t->unproven, t->failed);
  printf(
      "a later round worse than the one before: %zu; knot removal gave no reference, legs stood in: %zu; no worse "
      "than the first "
      "reference: %zu; as many inflections as the true curve: %zu\n",
      t->worse, t->fallbacks, t->below, t->right);
  printf("| | least | 10 %% | median | 90 %% | 99 %% | most |\n|---|---|---|---|---|---|---|\n");
  static const char *const names[MEASURES] = {
      "noise, two coordinates an unknown or more: sum / sum without inequalities",
      "no noise: root mean square distance / size", "sum / sum of the reference", "seconds",
      "inequalities of the last round"};
  double *values[MEASURES] = {t->ratios, t->off, t->reference, t->seconds, t->rows};
  const size_t counts[MEASURES] = {t->noisy, t->exact, t->done, t->done, t->done};
  for (int k = 0; k < MEASURES; k++) {
    static const double at[6] = {0, 0.1, 0.5, 0.9, 0.99, 1};
    printf("| %s |", names[k]);
    for (int q = 0; q < 6; q++) printf(" %.4g |", quantile(counts[k], values[k], at[q]));
    printf("\n");
  }
}

static void run_random(batten_context *ctx, size_t cases, bool given) {
  tally t = {.tried = cases};
  double **values[MEASURES] = {&t.ratios, &t.off, &t.reference, &t.seconds, &t.rows};
  for (int k = 0; k < MEASURES; k++) *values[k] = contour_scene_allocate(cases);
  printf("\n## %zu random cases, inflections %s\n\n", cases, given ? "given" : "found");
  for (uint64_t seed = 0; seed < cases; seed++) {
    contour_rule rule = contour_rule_random(seed);
    contour_scene s = contour_scene_make(&rule);
    batten_contour_options o = random_options(&s, seed, given);
    batten_contour_info f = {0};
    batten_curve *curve = NULL;
    double start = batten_now();
    batten_status st = batten_contour_fit(ctx, s.count, s.points, &o, &curve, NULL, NULL, &f);
    double seconds = batten_now() - start;
    if (st < 0) {
      printf("case %zu: %s %s\n", (size_t)seed, batten_status_name(st), batten_error(ctx));
      t.failed++;
    } else {
      count_fit(&t, seed, &rule, &s, &o, st, &f, seconds);
    }
    batten_curve_free(curve);
    contour_scene_free(&s);
  }
  print_tally(&t);
  for (int k = 0; k < MEASURES; k++) free(*values[k]);
}

int main(int argc, char **argv) {
  size_t cases = argc > 1 ? strtoul(argv[1], NULL, 10) : 1000, most = argc > 2 ? strtoul(argv[2], NULL, 10) : 100000;
  batten_context *ctx = NULL;
  if (batten_context_new(NULL, &ctx) < 0) return 1;
  printf("batten %s, compiler %s, one thread of batten's own\n", batten_version(), __VERSION__);
  run_paper(ctx);
  run_growth(ctx, most);
  if (cases) {
    run_random(ctx, cases, true);
    run_random(ctx, cases, false);
  }
  batten_context_free(ctx);
  return 0;
}
