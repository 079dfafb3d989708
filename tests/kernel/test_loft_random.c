/* batten_loft_build on random stacks of contours: degrees 2 to 5, smoothness 1 and 2, 3 to 12 contours of 4 to 30
 * knots, unevenly spread, turned and moved from contour to contour, open and closed, with inflections that have
 * partners and some that have none. What it says of itself, and the same by other means: points and derivatives of
 * patches beside the contours, curvatures of sections beside those of their neighbours.
 *
 * Stacks 1 .. COUNT, of 3 to 5 contours to be quick; with an argument that many of any size, from the one on that a
 * second argument gives. */
#include "loft_scenes.h"
#include "tap.h"

#include <batten/loft.h>

enum { COUNT = 30, PLACES = 160, HEIGHTS = 5 };

typedef struct tally {
  size_t stacks, certified, raised, elastic, with_knots, unmatched, pairs, violations_before, violations_after;
  size_t wrong_places, places;
  double interpolation, continuity, through, jump; /* largest */
} tally;

/* Between knots: nowhere where a derivative jumps but by accident. */
static void make_places(uint64_t seed, double *t) {
  for (size_t k = 0; k < PLACES; k++) t[k] = ((double)k + 0.1 + 0.8 * t_uniform(&seed)) / PLACES;
}

static double box_size(const loft_scene *s) {
  double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
  for (size_t i = 0; i < s->count; i++) {
    batten_curve_form f = batten_curve_get(s->contours[i]);
    for (size_t k = 0; k < 2 * (f.knot_count - f.degree - 1); k++) {
      low[k % 2] = fmin(low[k % 2], f.control_points[k]);
      high[k % 2] = fmax(high[k % 2], f.control_points[k]);
    }
  }
  return fmax(high[0] - low[0], high[1] - low[1]);
}

/* Points at contours beside the contours', derivatives by z beside those from the other side. */
static void check_joints(batten_context *ctx, const loft_scene *s, const batten_loft *loft, const double *t,
                         tally *sum) {
  double size = box_size(s);
  unsigned l = batten_loft_get(loft).smoothness;
  static batten_curve_point contour[PLACES];
  static batten_surface_point at[2][PLACES];
  static double places[PLACES][2];
  batten_surface *beside[2] = {NULL, NULL};
  for (size_t i = 0; i < s->count; i++) {
    batten_surface_free(beside[0]);
    beside[0] = beside[1];
    beside[1] = NULL;
    if (i + 1 < s->count && batten_loft_patch(ctx, loft, i, &beside[1]) < 0) abort();
    if (batten_curve_evaluate(ctx, s->contours[i], PLACES, t, contour) < 0) abort();
    for (size_t k = 0; k < PLACES; k++) {
      places[k][0] = t[k];
      places[k][1] = s->heights[i];
    }
    for (unsigned e = 0; e < 2; e++) {
      if (!beside[e]) continue;
      if (batten_surface_evaluate(ctx, beside[e], PLACES, places[0], at[e]) < 0) abort();
      for (size_t k = 0; k < PLACES; k++)
        sum->through =
            fmax(sum->through,
                 hypot(at[e][k].point[0] - contour[k].point[0], at[e][k].point[1] - contour[k].point[1]) / size);
    }
    double gap = i > 0 ? s->heights[i] - s->heights[i - 1] : 0;
    for (size_t k = 0; k < PLACES && beside[0] && beside[1]; k++)
      for (unsigned x = 0; x < 2; x++) {
        double first = at[0][k].dv[x] - at[1][k].dv[x], second = at[0][k].dvv[x] - at[1][k].dvv[x];
        sum->jump = fmax(sum->jump, fabs(first) * gap / size);
        if (l > 1) sum->jump = fmax(sum->jump, fabs(second) * gap * gap / size);
      }
  }
  batten_surface_free(beside[0]);
  batten_surface_free(beside[1]);
}

/* Where both neighbours bend to one side, sections between do. */
static void check_sections(batten_context *ctx, const loft_scene *s, const batten_loft *loft, const double *t,
                           tally *sum) {
  static batten_curve_point ends[2][PLACES], between[PLACES];
  for (size_t i = 0; i + 1 < s->count; i++) {
    for (size_t e = 0; e < 2; e++)
      if (batten_curve_evaluate(ctx, s->contours[i + e], PLACES, t, ends[e]) < 0) abort();
    for (size_t h = 1; h <= HEIGHTS; h++) {
      double z = s->heights[i] + (s->heights[i + 1] - s->heights[i]) * (double)h / (HEIGHTS + 1);
      batten_curve *section = NULL;
      if (batten_loft_section(ctx, loft, z, &section) < 0 ||
          batten_curve_evaluate(ctx, section, PLACES, t, between) < 0)
        abort();
      batten_curve_free(section);
      for (size_t k = 0; k < PLACES; k++) {
        double a = ends[0][k].curvature, b = ends[1][k].curvature, c = between[k].curvature;
        if (!(fmin(fabs(a), fabs(b)) > 1e-6) || (a > 0) != (b > 0)) continue;
        sum->places++;
        sum->wrong_places += !((c > 0) == (a > 0));
      }
    }
  }
}

static void check_stack(batten_context *ctx, uint64_t seed, bool small, tally *sum) {
  loft_rule r = loft_rule_random(seed);
  if (small) r.contours = 3 + r.contours % 3;
  loft_scene s = loft_scene_make(ctx, &r);
  batten_loft_options o = batten_loft_options_default();
  o.smooth_z = r.smoothness;
  for (unsigned e = 0; e < 2; e++) o.slopes[e] = s.slopes[e];
  batten_loft *loft = NULL;
  batten_loft_info info = {0};
  batten_status st =
      batten_loft_build(ctx, s.count, (const batten_curve *const *)s.contours, s.heights, &o, &loft, NULL, &info);
  if (st < 0) T_CHECK(false, "stack %zu: %s", (size_t)seed, batten_error(ctx));
  if (st >= 0) {
    tally own = {0};
    double t[PLACES];
    make_places(seed, t);
    check_joints(ctx, &s, loft, t, &own);
    check_sections(ctx, &s, loft, t, &own);
    bool feasible = info.vertices_elastic == 0;
    /* A proof, or vertices named that have no solution; never neither. Sections of what is proven are right. */
    bool ok = (st == BATTEN_OK) == (info.certified != 0) && (info.certified || !feasible) &&
              (!info.certified || r.unmatched || own.wrong_places == 0) &&
              (r.unmatched || info.inflections_unmatched == 0) && (!info.certified || info.sign_violations == 0) &&
              info.interpolation_error <= 1e-12 && info.continuity_error <= 1e-10 && own.through <= 1e-12 &&
              own.jump <= 1e-10;
    T_CHECK(ok,
            "stack %zu, degree (%u, %u), l = %u, %s, %zu contours, %zu inflections%s%s: %s, %zu elastic, %zu of %zu "
            "pairs wrong before, %zu after, off %.1e, jumps %.1e (told %.1e, %.1e), %zu places wrong",
            (size_t)seed, r.degree, info.degree_z, r.smoothness, r.closed ? "closed" : "open", r.contours,
            r.inflections, r.unmatched ? ", some alone" : "", r.slopes ? ", slopes" : "",
            info.certified ? "proven" : "not proven", info.vertices_elastic, info.sign_violations_unconstrained,
            info.sign_pairs, info.sign_violations, own.through, own.jump, info.interpolation_error,
            info.continuity_error, own.wrong_places);
    sum->stacks++;
    sum->certified += info.certified != 0;
    sum->raised += info.degree_raised > 0;
    sum->elastic += !feasible;
    sum->unmatched += r.unmatched;
    sum->with_knots += info.knots_inserted > 0;
    sum->pairs += info.sign_pairs;
    sum->violations_before += info.sign_violations_unconstrained;
    sum->violations_after += info.sign_violations;
    sum->places += own.places;
    sum->wrong_places += own.wrong_places;
    sum->interpolation = fmax(sum->interpolation, info.interpolation_error);
    sum->continuity = fmax(sum->continuity, info.continuity_error);
    sum->through = fmax(sum->through, own.through);
    sum->jump = fmax(sum->jump, own.jump);
  }
  batten_loft_free(loft);
  loft_scene_free(&s);
}

int main(int argc, char **argv) {
  size_t count = argc > 1 ? strtoul(argv[1], NULL, 10) : COUNT, first = argc > 2 ? strtoul(argv[2], NULL, 10) : 1;
  batten_context *ctx = t_context(NULL, NULL, 1);
  tally sum = {0};
  for (size_t k = 0; k < count; k++) check_stack(ctx, first + k, argc < 2, &sum);
  printf("# %zu stacks: %zu proven, %zu of a higher degree, %zu with knots inserted, %zu with elastic vertices\n",
         sum.stacks, sum.certified, sum.raised, sum.with_knots, sum.elastic);
  printf("# %zu of %zu pairs of patch and span wrong without inequalities, %zu with; %zu of %zu places wrong\n",
         sum.violations_before, sum.pairs, sum.violations_after, sum.wrong_places, sum.places);
  T_RATIO(fmax(sum.interpolation, sum.through), 1e-12, "largest interpolation error of %zu stacks", sum.stacks);
  T_RATIO(fmax(sum.continuity, sum.jump), 1e-10, "largest jump of derivatives by z");
  T_CHECK(sum.violations_before > sum.stacks / 5, "the stacks are hard: %zu pairs wrong without inequalities",
          sum.violations_before);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all memory is given back");
  batten_context_free(ctx);
  return t_done();
}
