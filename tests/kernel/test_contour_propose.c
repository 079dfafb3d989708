/* Inflections of data: by hand, by a dense solution of the smoothing, by counts on scenes of known shape. */
#include <batten/contour.h>

#include "contour/bends.h"
#include "contour_scenes.h"
#include "tap.h"

static batten_status propose(batten_context *ctx, size_t count, const double *points, int closed,
                             batten_contour_proposal *out) {
  batten_contour_options o = batten_contour_options_default();
  o.closed = closed;
  return batten_contour_propose(ctx, count, points, &o, out);
}

/* ---- by hand -------------------------------------------------------------------------------------- */

/* y = cos(k pi x) / 5 has its inflections at x = (i + 1/2) / k. */
static void waves(batten_context *ctx) {
  enum { COUNT = 81 };
  double points[COUNT][2], parameters[COUNT];
  for (size_t k = 1; k <= 6; k++) {
    for (size_t i = 0; i < COUNT; i++) {
      parameters[i] = points[i][0] = (double)i / (COUNT - 1);
      points[i][1] = cos(SCENE_PI * (double)k * points[i][0]) / 5;
    }
    batten_contour_options o = batten_contour_options_default();
    batten_contour_proposal p = {0};
    o.parameters = parameters;
    if (batten_contour_propose(ctx, COUNT, points[0], &o, &p) < 0) {
      t_line(false, "%s", batten_error(ctx));
      continue;
    }
    double worst = 0, unsure = 0;
    for (size_t i = 0; i < p.inflection_count && i < k; i++) {
      worst = fmax(worst, fabs(p.inflections[i] - ((double)i + 0.5) / (double)k));
      unsure = fmax(unsure, p.uncertainties[i]);
    }
    T_CHECK(p.inflection_count == k && p.sign == -1, "a cosine of %zu half periods: %zu inflections, sign %d", k,
            p.inflection_count, p.sign);
    T_RATIO(worst, 5e-4, "they are off by");
    T_RATIO(unsure, 1e-2, "and said to be uncertain by");
    batten_contour_proposal_free(ctx, &p);
  }
}

static void no_inflections(batten_context *ctx) {
  enum { COUNT = 64 };
  double points[COUNT][2];
  for (int way = -1; way <= 1; way += 2)
    for (int closed = 0; closed < 2; closed++) {
      for (size_t i = 0; i < COUNT; i++) {
        double phi = way * 2 * SCENE_PI * (double)i / COUNT;
        points[i][0] = 1000 + 3 * cos(phi);
        points[i][1] = 3 * sin(phi) - 500;
      }
      batten_contour_proposal p = {0};
      T_OK(propose(ctx, COUNT, points[0], closed, &p), ctx);
      double worst = 0;
      for (size_t i = 0; i < p.sample_count; i++) worst = fmax(worst, fabs(p.samples[4 * i + 1] - way / 3.0));
      T_CHECK(p.inflection_count == 0 && p.sign == way && !p.inflections, "a circle, closed %d: %zu, sign %d", closed,
              p.inflection_count, p.sign);
      T_RATIO(worst, 0.01 / 3, "its curvature is off by");
      batten_contour_proposal_free(ctx, &p);
    }
  /* a square: corners, and straight sides beside which a smooth curve rings */
  for (size_t side = 0, i = 0; side < 4; side++)
    for (size_t k = 0; k < COUNT / 4; k++, i++) {
      double a = (double)k / (COUNT / 4) * 2 - 1;
      points[i][0] = side == 0 ? a : side == 1 ? 1 : side == 2 ? -a : -1;
      points[i][1] = side == 0 ? -1 : side == 1 ? a : side == 2 ? 1 : -a;
    }
  batten_contour_proposal p = {0};
  T_OK(propose(ctx, COUNT, points[0], 1, &p), ctx);
  T_CHECK(p.inflection_count == 0 && p.sign == 1, "a square: %zu inflections of %zu runs", p.inflection_count,
          p.run_count);
  batten_contour_proposal_free(ctx, &p);
}

/* An arc, a straight piece, an arc the other way: the inflection is in the middle. */
static void straight_between(batten_context *ctx) {
  enum { COUNT = 150 };
  double points[COUNT][2], x = 0, y = 0, angle = 0;
  uint64_t state = 3;
  for (size_t i = 0; i < COUNT; i++) {
    points[i][0] = x + 1e-4 * contour_scene_normal(&state);
    points[i][1] = y + 1e-4 * contour_scene_normal(&state);
    angle += i < 50 ? 0.03 : i < 100 ? 0 : -0.03;
    x += 0.01 * cos(angle);
    y += 0.01 * sin(angle);
  }
  batten_contour_proposal p = {0};
  T_OK(propose(ctx, COUNT, points[0], 0, &p), ctx);
  T_CHECK(p.inflection_count == 1 && p.sign == 1, "between two arcs: %zu inflections", p.inflection_count);
  if (p.inflection_count == 1) {
    T_RATIO(fabs(p.inflections[0] - 0.5), 0.1, "off the middle of the straight third by");
    T_CHECK(p.uncertainties[0] > 0.02, "and known to be uncertain: %g", p.uncertainties[0]);
  }
  batten_contour_proposal_free(ctx, &p);
}

/* A frame with a bulb, a hollow and a flare at 15 waterlines, to 4 decimals: a sharp hollow beside a calm flare. */
static void few_points(batten_context *ctx) {
  enum { COUNT = 15 };
  static const double half[COUNT] = {0.1021, 0.6184, 0.9307, 1.0702, 1.0218, 0.7406, 0.4597, 0.7402,
                                     1.2118, 1.6809, 2.1391, 2.5870, 3.0203, 3.4352, 3.8284};
  double points[COUNT][2];
  for (size_t i = 0; i < COUNT; i++) {
    points[i][0] = half[i];
    points[i][1] = 0.5 * (double)(i + 1);
  }
  batten_contour_proposal p = {0};
  T_OK(propose(ctx, COUNT, points[0], 0, &p), ctx);
  T_CHECK(p.inflection_count == 2 && p.sign == 1, "bulb, hollow, flare at %d points: %zu inflections", COUNT,
          p.inflection_count);
  batten_contour_proposal_free(ctx, &p);
}

/* Cambered airfoils turn by a few degrees behind the inflection of their lower side, after a sharp nose. */
static void airfoils(batten_context *ctx) {
  size_t found = 0, cases = 0;
  for (uint64_t seed = 0; seed < 12; seed++) {
    contour_rule r = {
        .kind = CONTOUR_AIRFOIL, .count = 22 + 6 * seed, .inflections = 1, .turned = true, .seed = seed};
    contour_scene s = contour_scene_make(&r);
    batten_contour_proposal p = {0};
    T_OK(propose(ctx, s.count, s.points, 0, &p), ctx);
    /* the formula wiggles by a thousandth degree behind it: two inflections more that nobody sees */
    found += p.inflection_count == 1 && fabs(p.inflections[0] - s.inflections[0]) < 0.1;
    cases++;
    batten_contour_proposal_free(ctx, &p);
    contour_scene_free(&s);
  }
  T_CHECK(found + 1 >= cases, "the rear inflections of %zu of %zu airfoils", found, cases);
}

/* Deviations that neighbours share: sums of waves around the outline whose amplitudes fall with their number. */
static void outlines(batten_context *ctx) {
  enum { COUNT = 120, WAVES = COUNT / 2, CASES = 8 };
  size_t right = 0, most = 0;
  for (uint64_t seed = 0; seed < CASES; seed++) {
    contour_rule r = {.kind = CONTOUR_LOOP, .count = COUNT, .inflections = seed % 2 ? 2 : 0, .seed = seed};
    contour_scene s = contour_scene_make(&r);
    uint64_t state = seed;
    for (size_t k = 6; k <= WAVES; k++) {
      double size = 0.004 * s.size * pow(6 / (double)k, 1.5);
      for (size_t d = 0; d < 2; d++) {
        double a = size * contour_scene_normal(&state), b = size * contour_scene_normal(&state);
        for (size_t i = 0; i < COUNT; i++) {
          double phi = 2 * SCENE_PI * (double)(k * i) / COUNT;
          s.points[2 * i + d] += a * cos(phi) + b * sin(phi);
        }
      }
    }
    batten_contour_proposal p = {0};
    T_OK(propose(ctx, COUNT, s.points, 1, &p), ctx);
    if (p.inflection_count > most) most = p.inflection_count;
    right += p.inflection_count <= s.inflection_count + 2;
    batten_contour_proposal_free(ctx, &p);
    contour_scene_free(&s);
  }
  T_CHECK(right + 1 >= CASES, "outlines with deviations that neighbours share: %zu of %d without wiggles, most %zu",
          right, CASES, most);
}

/* The outline of the pixels whose middles lie in a shape, as a tracer gives it: one point a row or column, on the
 * border between two pixels. */
static void pixels(batten_context *ctx) {
  enum { COUNT = 180 };
  for (int dented = 0; dented < 2; dented++) {
    double points[COUNT][2];
    for (size_t i = 0; i < COUNT; i++) {
      double phi = 2 * SCENE_PI * (double)i / COUNT, radius = dented ? 40 * (1 - 0.4 * exp(-8 * (1 - cos(phi)))) : 40;
      points[i][0] = round(1.2 * radius * cos(phi));
      points[i][1] = round(radius * sin(phi));
    }
    batten_contour_proposal p = {0};
    T_OK(propose(ctx, COUNT, points[0], 1, &p), ctx);
    T_CHECK(p.inflection_count == (dented ? 2 : 0) && p.sign == (dented ? -1 : 1),
            "points on pixels, %s: %zu inflections", dented ? "one dent" : "convex", p.inflection_count);
    batten_contour_proposal_free(ctx, &p);
  }
}

/* A straight piece, a bend, a straight piece at few exact points: the smoothing rings, the points are convex. */
static void bends_of_few(batten_context *ctx) {
  enum { CASES = 40 };
  size_t right = 0;
  for (uint64_t seed = 0; seed < CASES; seed++) {
    contour_rule r = {.kind = CONTOUR_BEND,
                      .count = 10 + seed % 31,
                      .noise = seed % 2 ? 1e-5 : 0,
                      .turned = true,
                      .seed = 300000 + seed};
    contour_scene s = contour_scene_make(&r);
    batten_contour_proposal p = {0};
    T_OK(propose(ctx, s.count, s.points, 0, &p), ctx);
    right += p.inflection_count == 0;
    batten_contour_proposal_free(ctx, &p);
    contour_scene_free(&s);
  }
  T_CHECK(right + 1 >= CASES, "bends of 10 to 40 points: %zu of %d without inflections", right, CASES);
}

/* ---- a second route: the smoothing by dense matrices ---------------------------------------------- */

enum { DENSE = 160 };
static double dense[DENSE][DENSE], gram[DENSE][DENSE], rough[DENSE][DENSE];

/* Cholesky factor below; the log of the determinant. */
static double factor(size_t n) {
  double determinant = 0;
  for (size_t j = 0; j < n; j++)
    for (size_t i = j; i < n; i++) {
      double sum = dense[i][j];
      for (size_t k = 0; k < j; k++) sum -= dense[i][k] * dense[j][k];
      dense[i][j] = i == j ? sqrt(sum) : sum / dense[j][j];
      if (i == j) determinant += 2 * log(dense[i][j]);
    }
  return determinant;
}
static void solve_dense(size_t n, double *x) {
  for (size_t i = 0; i < n; i++) {
    for (size_t k = 0; k < i; k++) x[i] -= dense[i][k] * x[k];
    x[i] /= dense[i][i];
  }
  for (size_t i = n; i-- > 0;) {
    for (size_t k = i + 1; k < n; k++) x[i] -= dense[k][i] * x[k];
    x[i] /= dense[i][i];
  }
}

/* -2 log of the restricted likelihood; control [2][n] at the minimum. */
static double likelihood(size_t n, double lambda, size_t count, const double *points, double (*right)[DENSE],
                         double (*control)[DENSE]) {
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < n; j++) dense[i][j] = gram[i][j] + lambda * rough[i][j];
  double determinant = factor(n), least = 0;
  for (size_t i = 0; i < 2 * count; i++) least += points[i] * points[i];
  for (size_t k = 0; k < 2; k++) {
    memcpy(control[k], right[k], n * sizeof(double));
    solve_dense(n, control[k]);
    for (size_t i = 0; i < n; i++) least -= right[k][i] * control[k][i];
  }
  return 2 * ((double)count - 3) * log(least) + 2 * determinant - 2 * ((double)n - 3) * log(lambda);
}

static void dense_route(batten_context *ctx) {
  static double right[2][DENSE], control[2][DENSE], other[2][DENSE], knots[DENSE + 6];
  contour_rule r = {.kind = CONTOUR_WAVE, .count = 80, .inflections = 2, .uneven = true, .noise = 0.01, .seed = 11};
  contour_scene scene = contour_scene_make(&r);
  contour_data data = {scene.count, scene.points, NULL};
  contour_smooth s = {0};
  T_OK(contour_smooth_fit(ctx, &data, scene.lengths, false, &s), ctx);
  size_t n = s.spans + 5, made = bspline_make_knots(5, 4, s.spans, NULL, 0, 1, knots);
  T_CHECK(made <= DENSE, "%zu knots", made);
  if (made > DENSE) return;
  bspline b = {5, n, knots};
  double table[4 * 6];
  memset(gram, 0, sizeof gram);
  memset(rough, 0, sizeof rough);
  for (size_t i = 0; i < scene.count; i++) {
    size_t mu = bspline_span(&b, scene.lengths[i]);
    bspline_basis(&b, mu, scene.lengths[i], 0, table);
    for (size_t j = 0; j < 6; j++) {
      for (size_t k = 0; k < 6; k++) gram[mu - 5 + j][mu - 5 + k] += table[j] * table[k];
      for (size_t k = 0; k < 2; k++) right[k][mu - 5 + j] += table[j] * scene.points[2 * i + k];
    }
  }
  enum { FINE = 200 }; /* midpoints: another rule than the library's */
  for (size_t i = 0; i < FINE * s.spans; i++) {
    double h = 1 / (double)(FINE * s.spans), t = ((double)i + 0.5) * h;
    size_t mu = bspline_span(&b, t);
    bspline_basis(&b, mu, t, 3, table);
    for (size_t j = 0; j < 6; j++)
      for (size_t k = 0; k < 6; k++)
        rough[mu - 5 + j][mu - 5 + k] += h * (table[18 + j] * table[18 + k] + 1e-6 * table[12 + j] * table[12 + k]);
  }
  double at = likelihood(n, s.lambda, scene.count, scene.points, right, control);
  double worst = 0, variance = 0;
  for (size_t i = 0; i <= 50; i++) {
    double t = (double)i / 50, jet[3][2], column[DENSE] = {0}, x[2] = {0, 0}, second = 0;
    size_t mu = bspline_span(&b, t);
    bspline_basis(&b, mu, t, 2, table);
    for (size_t j = 0; j < 6; j++) {
      for (size_t k = 0; k < 2; k++) x[k] += table[j] * control[k][mu - 5 + j];
      column[mu - 5 + j] = table[12 + j];
    }
    contour_smooth_jet(&s, s.control, t, jet);
    for (size_t k = 0; k < 2; k++) worst = fmax(worst, fabs(jet[0][k] - x[k]));
    solve_dense(n, column);
    for (size_t j = 0; j < 6; j++) second += table[12 + j] * column[mu - 5 + j];
    variance = fmax(variance, fabs(contour_smooth_variance(&s, t) / second - 1));
  }
  T_RATIO(worst, 1e-5, "the curve beside that of dense matrices");
  T_RATIO(variance, 1e-3, "the variance of second derivatives beside that of dense matrices, in parts");
  double more = likelihood(n, s.lambda * 8, scene.count, scene.points, right, other);
  double less = likelihood(n, s.lambda / 8, scene.count, scene.points, right, other);
  T_CHECK(at < more && at < less, "lambda is likelier than others: %g beside %g, %g", at, more, less);
  T_RATIO(fabs(s.noise / (0.01 * scene.size) - 1), 0.3, "the noise is off by a part of");
  contour_smooth_free(ctx, &s);
  contour_scene_free(&scene);
}

/* ---- invariances ---------------------------------------------------------------------------------- */

static void invariances(batten_context *ctx) {
  for (int closed = 0; closed < 2; closed++) {
    contour_rule r = {.kind = closed ? CONTOUR_LOOP : CONTOUR_WAVE,
                      .count = 200,
                      .inflections = 4,
                      .noise = 2e-3,
                      .turned = true,
                      .seed = 7};
    contour_scene s = contour_scene_make(&r);
    batten_contour_proposal p = {0}, q = {0}, z = {0};
    double *turned = contour_scene_allocate(2 * s.count), *scaled = contour_scene_allocate(2 * s.count);
    for (size_t i = 0; i < s.count; i++)
      for (size_t k = 0; k < 2; k++) {
        /* closed: from the same point */
        size_t from = closed ? (s.count - i) % s.count : s.count - 1 - i;
        turned[2 * i + k] = s.points[2 * from + k];
        scaled[2 * i + k] = ldexp(s.points[2 * i + k], 40);
      }
    T_OK(propose(ctx, s.count, s.points, closed, &p), ctx);
    T_OK(propose(ctx, s.count, turned, closed, &q), ctx);
    T_OK(propose(ctx, s.count, scaled, closed, &z), ctx);
    size_t n = p.inflection_count;
    T_CHECK(n == 4 && p.sign == s.sign, "4 inflections, closed %d: %zu, sign %d of %d", closed, n, p.sign, s.sign);
    if (n == q.inflection_count && n == z.inflection_count) {
      double worst = 0;
      for (size_t i = 0; i < n; i++) worst = fmax(worst, fabs(p.inflections[i] - (1 - q.inflections[n - 1 - i])));
      T_RATIO(worst, 1e-6, "reversed: inflections at 1 - t but for");
      int end = n % 2 ? -p.sign : p.sign;
      T_CHECK(q.sign == -end, "and the sign %d is that of the other end, turned", q.sign);
      bool same = p.sign == z.sign && ldexp(p.noise, 40) == z.noise && p.sample_count == z.sample_count &&
                  !memcmp(p.inflections, z.inflections, n * sizeof(double)) &&
                  !memcmp(p.uncertainties, z.uncertainties, n * sizeof(double));
      for (size_t i = 0; same && i < p.sample_count; i++)
        same = ldexp(p.samples[4 * i + 1], -40) == z.samples[4 * i + 1] &&
               ldexp(p.samples[4 * i + 3], 40) == z.samples[4 * i + 3];
      T_CHECK(same, "scaled by 2^40: the same bits");
    } else {
      t_line(false, "counts %zu %zu %zu", n, q.inflection_count, z.inflection_count);
    }
    double worst = 0, most = 0, length = 0;
    batten_curve_point at = {0}, before;
    for (size_t i = 0; i < p.sample_count; i++) {
      before = at;
      if (batten_curve_evaluate(ctx, p.smoothed, 1, &p.samples[4 * i], &at) < 0) worst = INFINITY;
      worst = fmax(worst, fabs(at.curvature - p.samples[4 * i + 1]));
      most = fmax(most, fabs(at.curvature));
      if (i > 0) length += hypot(at.point[0] - before.point[0], at.point[1] - before.point[1]);
    }
    T_RATIO(worst, 1e-8 * most, "the samples are the smoothed curve's curvature but for");
    T_RATIO(fabs(p.samples[4 * p.sample_count - 1] / length - 1), 1e-3, "and lengths those of its polygon, but for");
    batten_contour_proposal_free(ctx, &p);
    batten_contour_proposal_free(ctx, &q);
    batten_contour_proposal_free(ctx, &z);
    free(turned);
    free(scaled);
    contour_scene_free(&s);
  }
}

/* ---- counts on scenes ------------------------------------------------------------------------------ */

static void rates(batten_context *ctx) {
  static const double noises[] = {0, 0.001, 0.005, 0.02, 0.05};
  static const size_t counts[] = {30, 100};
  static const contour_kind kinds[] = {CONTOUR_WAVE, CONTOUR_SINE,         CONTOUR_S,    CONTOUR_CIRCLE,
                                       CONTOUR_BEND, CONTOUR_SUPERELLIPSE, CONTOUR_LOOP, CONTOUR_SPIRAL};
  enum { KINDS = sizeof kinds / sizeof *kinds, SEEDS = 2 };
  size_t many_all = 0, cases_all = 0, wrong_signs = 0;
  for (size_t a = 0; a < sizeof noises / sizeof *noises; a++) {
    size_t cases = 0, right = 0, many = 0, few = 0;
    for (size_t k = 0; k < KINDS; k++)
      for (size_t c = 0; c < sizeof counts / sizeof *counts; c++)
        for (size_t seed = 0; seed < SEEDS; seed++) {
          contour_rule r = {.kind = kinds[k],
                            .count = counts[c],
                            .inflections = 2 * ((seed + k + c) % 3),
                            .noise = noises[a],
                            .mirrored = seed % 2,
                            .uneven = seed == 1,
                            .turned = true,
                            .seed = 100 * k + seed};
          contour_scene s = contour_scene_make(&r);
          batten_contour_proposal p = {0};
          if (propose(ctx, s.count, s.points, s.closed, &p) < 0) t_line(false, "%s", batten_error(ctx));
          cases++;
          right += p.inflection_count == s.inflection_count;
          many += p.inflection_count > s.inflection_count;
          few += p.inflection_count < s.inflection_count;
          wrong_signs += p.inflection_count == s.inflection_count && p.sign != s.sign;
          batten_contour_proposal_free(ctx, &p);
          contour_scene_free(&s);
        }
    printf("# noise %-6g %3zu cases: %3zu right, %2zu too many, %2zu too few\n", noises[a], cases, right, many, few);
    many_all += many;
    cases_all += cases;
    if (noises[a] <= 0.005)
      T_RATIO((double)(cases - right), 0.1 * (double)cases, "noise %g: wrong counts", noises[a]);
  }
  T_RATIO((double)many_all, 0.01 * (double)cases_all, "inflections that are not there, of %zu cases", cases_all);
  T_CHECK(wrong_signs == 0, "%zu wrong signs", wrong_signs);
}

/* ---- what the fit asks ------------------------------------------------------------------------------ */

static void guesses(batten_context *ctx) {
  for (int closed = 0; closed < 2; closed++)
    for (int mirrored = 0; mirrored < 2; mirrored++) {
      contour_rule r = {.kind = closed ? CONTOUR_LOOP : CONTOUR_WAVE,
                        .count = 150,
                        .inflections = 4,
                        .noise = 0.01,
                        .mirrored = mirrored,
                        .seed = 21};
      contour_scene s = contour_scene_make(&r);
      contour_data data = {s.count, s.points, NULL};
      int sign = 0;
      T_OK(contour_sign_guess(ctx, &data, s.lengths, closed, s.inflection_count, s.inflections, &sign), ctx);
      T_CHECK(sign == s.sign, "the sign of given inflections, closed %d: %d", closed, sign);
      T_OK(contour_sign_guess(ctx, &data, s.lengths, closed, 0, NULL, &sign), ctx);
      contour_scene_free(&s);
    }
}

static void edges(batten_context *ctx) {
  double three[3][2] = {{0, 0}, {1, 0}, {1, 1}};
  batten_contour_proposal p = {0};
  T_OK(propose(ctx, 3, three[0], 0, &p), ctx);
  T_CHECK(p.inflection_count == 0 && p.sign == 1, "three points turn left: %zu, %d", p.inflection_count, p.sign);
  batten_contour_proposal_free(ctx, &p);
  /* every point three times; weights that leave out the worst outlier */
  enum { COUNT = 60 };
  double points[3 * COUNT][2], weights[3 * COUNT];
  for (size_t i = 0; i < 3 * COUNT; i++) {
    double t = (double)(i / 3) / (COUNT - 1);
    points[i][0] = t;
    points[i][1] = sin(2 * SCENE_PI * t) / 4;
    weights[i] = 1;
  }
  points[100][1] = 7;
  weights[100] = 0;
  batten_contour_options o = batten_contour_options_default();
  o.weights = weights;
  o.parametrization = BATTEN_CONTOUR_UNIFORM;
  T_OK(batten_contour_propose(ctx, 3 * COUNT, points[0], &o, &p), ctx);
  T_CHECK(p.inflection_count == 1 && p.sign == -1, "repeated points and one without weight: %zu", p.inflection_count);
  batten_contour_proposal_free(ctx, &p);
  /* domain and given parameters */
  double parameters[3 * COUNT];
  for (size_t i = 0; i < 3 * COUNT; i++) parameters[i] = 10 + 20 * (double)(i / 3) / (COUNT - 1);
  o.parameters = parameters;
  T_OK(batten_contour_propose(ctx, 3 * COUNT, points[0], &o, &p), ctx);
  if (p.inflection_count == 1) T_RATIO(fabs(p.inflections[0] - 20), 0.05, "the inflection at 20 in [10, 30]");
  T_CHECK(p.inflection_count == 1 && p.samples[0] == 10 && p.samples[4 * p.sample_count - 4] == 30, "the domain");
  batten_contour_proposal_free(ctx, &p);
  o = batten_contour_options_default();
  T_STATUS(batten_contour_propose(ctx, 3, three[0], &o, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  o.significance = 0;
  T_STATUS(batten_contour_propose(ctx, 3, three[0], &o, &p), BATTEN_E_INVALID, ctx, "opt.significance: 0");
  o.struct_size = 1;
  T_STATUS(batten_contour_propose(ctx, 3, three[0], &o, &p), BATTEN_E_INVALID, ctx, "struct_size");
  T_STATUS(propose(ctx, 2, three[0], 0, &p), BATTEN_E_INVALID, ctx, "count: 2");
  T_STATUS(propose(ctx, 3, NULL, 0, &p), BATTEN_E_INVALID, ctx, "points: NULL");
  three[1][1] = NAN;
  T_STATUS(propose(ctx, 3, three[0], 0, &p), BATTEN_E_INVALID, ctx, "points[1][1]");
  T_CHECK(batten_contour_propose(NULL, 3, three[0], NULL, &p) == BATTEN_E_INVALID, "no context");
  batten_contour_proposal_free(ctx, NULL);
}

static batten_status one_call(batten_context *ctx, void *arg) {
  const contour_scene *s = arg;
  batten_contour_proposal p = {0};
  batten_status st = propose(ctx, s->count, s->points, s->closed, &p);
  if (st >= 0) batten_contour_proposal_free(ctx, &p);
  return st;
}

/* Many bends that are each small beside the whole, of exact data and of almost exact ones: all are seen, be there
 * many points a wave or ten. */
static void test_many(batten_context *ctx) {
  enum { WAVES = 20, PER_WAVE = 20, MOST = 30, FEW = 10 };
  static const struct {
    size_t waves, per_wave;
    double height, noise;
  } rows[] = {{WAVES, PER_WAVE, 0.3, 0}, {WAVES, PER_WAVE, 0.3, 1e-3}, {MOST, FEW, 0.4, 0}};
  double *points = contour_scene_allocate((size_t)2 * (WAVES * PER_WAVE + MOST * FEW + 1));
  for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
    const size_t count = rows[k].waves * rows[k].per_wave + 1;
    uint64_t seed = 1;
    for (size_t i = 0; i < count; i++) {
      double x = (double)(i * rows[k].waves) / (double)(count - 1);
      points[2 * i] = x;
      points[2 * i + 1] = rows[k].height * sin(2 * SCENE_PI * x) + rows[k].noise * (t_uniform(&seed) - 0.5);
    }
    batten_contour_proposal p = {0};
    T_OK(batten_contour_propose(ctx, count, points, NULL, &p), ctx);
    T_CHECK(p.inflection_count == 2 * rows[k].waves - 1, "%zu waves of %zu points, noise %g: %zu inflections",
            rows[k].waves, rows[k].per_wave, rows[k].noise, p.inflection_count);
    batten_contour_proposal_free(ctx, &p);
  }
  free(points);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  waves(ctx);
  no_inflections(ctx);
  straight_between(ctx);
  few_points(ctx);
  airfoils(ctx);
  outlines(ctx);
  pixels(ctx);
  bends_of_few(ctx);
  dense_route(ctx);
  invariances(ctx);
  rates(ctx);
  guesses(ctx);
  edges(ctx);
  contour_rule r = {.kind = CONTOUR_WAVE, .count = 40, .inflections = 1, .noise = 0.01, .seed = 2};
  contour_scene s = contour_scene_make(&r);
  t_fail_every_allocation("batten_contour_propose", one_call, &s);
  t_cancel_every_progress("batten_contour_propose", one_call, &s);
  contour_scene_free(&s);
  test_many(ctx);
  batten_context_free(ctx);
  return t_done();
}
