/* The paper's experiment, its figure 2: two sets of eight cubic C^2 curves for 296 points, two rounds. */
#include "tap.h"

#include <batten/contour.h>

#include "contour_scenes.h"

static void test_section(batten_context *ctx, bool aft, size_t number, double sums[3], size_t *wiggles) {
  contour_scene s = contour_section(aft, number);
  batten_contour_options o = batten_contour_options_default();
  batten_contour_info f = {0};
  batten_curve *curve = NULL;
  batten_curve_shape proof = {0};
  o.parameters = s.lengths;
  o.spans = 8;
  o.rounds = 2;
  o.sign = s.sign;
  o.inflection_count = s.inflection_count;
  o.inflections = s.inflections;
  T_OK(batten_contour_fit(ctx, s.count, s.points, &o, &curve, NULL, NULL, &f), ctx);
  T_CHECK(f.shape.certified && f.inflections_found == s.inflection_count, "%s %zu: %zu inflections, proven",
          aft ? "aft" : "fore", number + 1, f.inflections_found);
  T_CHECK(f.lsq <= f.lsq_per_round[0] && f.lsq_per_round[0] <= f.lsq_reference, "rounds lower the sum: %g, %g, %g",
          f.lsq_reference, f.lsq_per_round[0], f.lsq);
  T_CHECK(f.lsq >= f.lsq_unconstrained, "not below that without inequalities, %g", f.lsq_unconstrained);
  /* The other sign is refused, and so is an inflection less. */
  batten_curve_shape_options wanted = batten_curve_shape_options_default();
  wanted.sign = -s.sign;
  wanted.inflection_count = s.inflection_count;
  wanted.inflections = s.inflections;
  T_OK(batten_curve_certify(ctx, curve, &wanted, &proof), ctx);
  T_CHECK(!proof.certified, "the other signs are not proven");
  wanted.sign = s.sign;
  wanted.inflection_count--;
  T_OK(batten_curve_certify(ctx, curve, &wanted, &proof), ctx);
  T_CHECK(!proof.certified, "nor an inflection less");
  sums[0] += f.lsq_unconstrained;
  sums[1] += f.lsq_reference;
  sums[2] += f.lsq;
  *wiggles += f.inflections_unconstrained - f.inflections_wanted;
  batten_curve_free(curve);
  contour_scene_free(&s);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  for (int aft = 0; aft < 2; aft++) {
    double sums[3] = {0};
    size_t wiggles = 0;
    for (size_t k = 0; k < CONTOUR_SECTIONS; k++) test_section(ctx, aft, k, sums, &wiggles);
    T_CHECK(wiggles >= 16, "least squares alone wave: %zu inflections too many", wiggles);
    T_RATIO(sums[2] / sums[0], 1.8, "the wanted shape costs little: sums %g, %g, reference %g", sums[0], sums[2],
            sums[1]);
  }
  batten_context_free(ctx);
  return t_done();
}
