/* Proofs that a section's function has the sign of its loops: what is proven must be so, and what is wrong must not
 * be proven. */
#include "base/checked.h"
#include "section/local_field.h"
#include "section/section_inner.h"
#include "stack_scenes.h"
#include "tap.h"

static polygon_set loops_of(batten_context *ctx, stack_scene *scene, size_t i) {
  polygon_set loops = {0};
  polygon_fault fault;
  const batten_section *given = stack_scene_sections(scene) + i;
  batten_status st =
      polygon_set_make(ctx, given->contour_count, given->starts, given->points, 0, &loops, NULL, &fault);
  if (st < 0) T_CHECK(false, "loops: %s", batten_error(ctx));
  return loops;
}

/* Spikes and notches at random, some thinner than the distance of points. */
static void add_jagged(stack_scene *scene, uint64_t *seed, double size) {
  double p[80];
  const size_t count = 9 + t_random(seed) % 24;
  for (size_t i = 0; i < count; i++) {
    double a = 2 * SCENE_PI * ((double)i + 0.8 * t_uniform(seed)) / (double)count, r = 0.25 + 0.75 * t_uniform(seed);
    p[2 * i] = size * r * cos(a);
    p[2 * i + 1] = size * r * sin(a);
  }
  stack_scene_slice(scene, 0);
  stack_scene_polygon(scene, count, p, 1 + t_random(seed) % 4);
}

/* ---- bounds over squares ------------------------------------------------------------------------- */

/* Down a random path of the tree: values at places of each square lie within its bounds, also those of the evaluator
 * of splines, which knows nothing of expansions; and bounds close in as squares shrink. */
static void test_field(batten_context *ctx) {
  enum { PATHS = 60, DEPTH = 24, PLACES = 32 };
  stack_scene scene = {0};
  uint64_t seed = 5;
  add_jagged(&scene, &seed, 3);
  polygon_set loops = loops_of(ctx, &scene, 0);
  batten_solid *function = NULL;
  section_figures figures;
  local_source source;
  T_CHECK(section_fit_loops(ctx, &loops, 0.1 * loops.spacing, 0.75, &function, &figures) >= 0, "%s",
          batten_error(ctx));
  T_OK(local_source_make(ctx, function, &source), ctx);
  batten_spline_parts parts;
  batten_spline_get_parts(batten_solid_spline(function), &parts);
  uint32_t *near = malloc(2 * source.count * sizeof *near), *left = near + source.count;
  size_t outside = 0, expanded = 0, asked = 0;
  double loose = 0, wide = 0;
  for (int path = 0; path < PATHS; path++) {
    local_square q = {{0, 0}, 4};
    local_field f = local_begin(&source, &q, 4);
    size_t count = source.count;
    for (size_t i = 0; i < count; i++) near[i] = (uint32_t)i;
    for (int depth = 0; depth < DEPTH; depth++) {
      double x[2 * PLACES], value[PLACES], lowest = INFINITY, highest = -INFINITY;
      const double allowed = ldexp(1e-3, -depth) / (double)source.count;
      size_t kept = local_take_far(&source, &q, allowed, count, near, left, &f);
      expanded += count - kept;
      count = kept;
      memcpy(near, left, count * sizeof *near);
      interval r = local_bounds(&source, &q, &f, count, near);
      for (size_t i = 0; i < 2 * PLACES; i++) {
        const double u = i < 8 ? (double)(i & 1 ? 1 : -1) : 2 * t_uniform(&seed) - 1;
        x[i] = parts.origin[i % 2] + parts.scale * (q.middle[i % 2] + u * q.half);
      }
      batten_solid_evaluate(ctx, function, PLACES, x, value, NULL, NULL);
      for (size_t i = 0; i < PLACES; i++) {
        outside += !(value[i] >= r.lo && value[i] <= r.hi);
        lowest = fmin(lowest, value[i]);
        highest = fmax(highest, value[i]);
      }
      asked += PLACES;
      if (depth >= 12) loose = fmax(loose, (r.hi - r.lo) / (highest - lowest + 2 * parts.scale * q.half));
      if (depth == DEPTH - 1) wide = fmax(wide, r.hi - r.lo);
      local_field whole = f;
      unsigned c = (unsigned)(t_random(&seed) >> 20) % 4;
      local_part(&whole, c, &f);
      q.half /= 2;
      q.middle[0] += c & 1 ? q.half : -q.half;
      q.middle[1] += c & 2 ? q.half : -q.half;
    }
  }
  T_CHECK(outside == 0 && expanded > 0, "%zu of %zu values beyond the bounds of their squares", outside, asked);
  T_RATIO(loose, 5, "small squares: width of the bounds over what is seen there, and the side");
  T_RATIO(wide, 1e-3, "the smallest, of %.2g: width of the bounds", parts.scale * ldexp(8, 1 - DEPTH));
  free(near);
  local_source_free(ctx, &source);
  batten_solid_free(function);
  polygon_set_free(&loops);
  stack_scene_free(&scene);
}

/* ---- what is proven ------------------------------------------------------------------------------ */

/* The deepest wrong sign at a grid, and on both sides along the loops; in tolerances. */
static double deepest(batten_context *ctx, const polygon_set *loops, const batten_solid *function, double tolerance) {
  enum { SIDE = 240, ALONG = 150, OFFSETS = 6 };
  const size_t edges = loops->starts[loops->count], grid = (size_t)SIDE * SIDE;
  const size_t count = grid + edges * ALONG * OFFSETS;
  double *x = malloc(count * 2 * sizeof *x), *f = malloc(count * sizeof *f), worst = 0;
  for (size_t i = 0; i < grid; i++)
    for (size_t k = 0; k < 2; k++) {
      double u = ((double)(k ? i / SIDE : i % SIDE) + 0.5) / SIDE, margin = 0.2 * (loops->upper[k] - loops->lower[k]);
      x[2 * i + k] = loops->lower[k] - margin + u * (loops->upper[k] - loops->lower[k] + 2 * margin);
    }
  double *to = x + 2 * grid;
  for (size_t loop = 0; loop < loops->count; loop++)
    for (size_t i = loops->starts[loop]; i < loops->starts[loop + 1]; i++) {
      size_t next = i + 1 < loops->starts[loop + 1] ? i + 1 : loops->starts[loop];
      const double *a = loops->points + 2 * i, *b = loops->points + 2 * next;
      double length = hypot(b[0] - a[0], b[1] - a[1]), n[2] = {(b[1] - a[1]) / length, (a[0] - b[0]) / length};
      for (int j = 0; j < ALONG; j++)
        for (int o = 0; o < OFFSETS; o++) {
          double u = 1.2 * (j + 0.5) / ALONG - 0.1, offset = tolerance * (o % 2 ? -1 : 1) * (1.064 + 0.15 * (o / 2));
          for (int k = 0; k < 2; k++) *to++ = (1 - u) * a[k] + u * b[k] + offset * n[k];
        }
    }
  batten_solid_evaluate(ctx, function, count, x, f, NULL, NULL);
  for (size_t i = 0; i < count; i++) {
    if (f[i] != 0 && (f[i] > 0) == polygon_inside(loops, x + 2 * i)) continue;
    worst = fmax(worst, fabs(polygon_distance(loops, x + 2 * i, NULL, NULL)) / tolerance);
  }
  free(x);
  free(f);
  return worst;
}

static void test_jagged(batten_context *ctx) {
  enum { COUNT = 40 };
  stack_scene scene = {0};
  uint64_t seed = 77;
  size_t certified = 0, first = 0, agree = 0;
  double worst = 0, told = 0;
  for (size_t i = 0; i < COUNT; i++) add_jagged(&scene, &seed, 10);
  for (size_t i = 0; i < COUNT; i++) {
    polygon_set loops = loops_of(ctx, &scene, i);
    const double tolerance = 0.1 * loops.spacing;
    batten_solid *function = NULL, *once = NULL;
    section_figures figures, own;
    T_CHECK(section_fit_loops(ctx, &loops, tolerance, 0.75, &once, &own) >= 0, "%s", batten_error(ctx));
    T_OK(section_certify(ctx, &loops, once, tolerance, &own, NULL), ctx);
    first += own.certified;
    T_CHECK(section_fit_proven(ctx, &loops, tolerance, 0.75, &function, &figures) >= 0, "%s", batten_error(ctx));
    certified += figures.certified;
    const double depth = deepest(ctx, &loops, function, tolerance);
    if (figures.certified) worst = fmax(worst, depth);
    if (figures.certified) told = fmax(told, figures.wrong_sign_max / tolerance);
    agree += figures.certified || depth > 0.9 || figures.wrong_sign_max > 0.9 * tolerance;
    batten_solid_free(function);
    batten_solid_free(once);
    polygon_set_free(&loops);
  }
  T_CHECK(certified >= COUNT - 4 && first <= certified, "jagged: %zu of %d certified, %zu at the first fit",
          certified, COUNT, first);
  T_RATIO(worst, 17. / 16, "jagged: deepest wrong sign of those that are, in tolerances");
  T_RATIO(told, 1, "jagged: and the deepest that was told");
  T_CHECK(agree == COUNT, "jagged: of the others one is seen near the tolerance or beyond");
  stack_scene_free(&scene);
}

/* ---- what is wrong ------------------------------------------------------------------------------- */

/* The function with a bump of this height at x, about as wide as `width`: far away nothing is left of it, for its
 * centres and coefficients are those of a difference quotient of fourth order, of which r^2 ln r is a fundamental
 * solution. */
static batten_solid *with_bump(batten_context *ctx, const batten_solid *function, const double *x, double width,
                               double height) {
  enum { STENCIL = 13 };
  static const signed char stencil[STENCIL][3] = {{0, 0, 20}, {1, 0, -8}, {-1, 0, -8}, {0, 1, -8},  {0, -1, -8},
                                                  {1, 1, 2},  {1, -1, 2}, {-1, 1, 2},  {-1, -1, 2}, {2, 0, 1},
                                                  {-2, 0, 1}, {0, 2, 1},  {0, -2, 1}};
  batten_spline_parts parts;
  batten_spline *spline = NULL;
  batten_carrier *none = NULL;
  batten_solid *out = NULL;
  const double lower[2] = {-1, -1}, upper[2] = {1, 1};
  batten_spline_get_parts(batten_solid_spline(function), &parts);
  double *centers = malloc((parts.count + STENCIL) * 3 * sizeof *centers), *w = centers + 2 * (parts.count + STENCIL);
  memcpy(centers, parts.centers, parts.count * 2 * sizeof *centers);
  memcpy(w, parts.coefficients, parts.count * sizeof *w);
  const double step = width / 3, unit = step / parts.scale, top = 24 * log(2.) * unit * unit;
  for (size_t i = 0; i < STENCIL; i++) {
    for (unsigned k = 0; k < 2; k++) centers[2 * (parts.count + i) + k] = x[k] + step * stencil[i][k];
    w[parts.count + i] = -height / top * stencil[i][2];
  }
  parts.count += STENCIL;
  parts.centers = centers;
  parts.coefficients = w;
  T_OK(batten_spline_create(ctx, &parts, &spline), ctx);
  T_OK(batten_carrier_none(ctx, 2, &none), ctx);
  T_OK(batten_solid_create(ctx, spline, none, 1, lower, upper, 0, NULL, &out), ctx);
  batten_carrier_free(none);
  batten_spline_free(spline);
  free(centers);
  return out;
}

static bool is_proven(batten_context *ctx, const polygon_set *loops, const batten_solid *function, double tolerance,
                      section_wrong *wrong) {
  bool proven = false;
  *wrong = (section_wrong){0};
  T_OK(section_prove(ctx, loops, function, tolerance, &proven, wrong), ctx);
  return proven;
}

/* A bump a third of the tolerance wide, which no grid finds, is let be while it does not reach through 0. */
static void test_bumps(batten_context *ctx) {
  enum { BUMPS = 60 };
  stack_scene scene = {0};
  stack_scene_slice(&scene, 0);
  stack_scene_crescent(&scene, 10, 80);
  polygon_set loops = loops_of(ctx, &scene, 0);
  const double tolerance = 0.1 * loops.spacing;
  batten_solid *function = NULL;
  section_figures figures;
  section_wrong wrong;
  T_CHECK(section_fit_loops(ctx, &loops, tolerance, 0.75, &function, &figures) >= 0, "%s", batten_error(ctx));
  const bool proven = is_proven(ctx, &loops, function, tolerance, &wrong);
  T_CHECK(proven && wrong.count == 0, "a crescent is proven");
  const bool finer = is_proven(ctx, &loops, function, 0.01 * tolerance, &wrong);
  T_CHECK(!finer && wrong.count > 0, "not within a hundredth: wrong signs %.3g deep are found", wrong.depth);
  size_t high = 0, low = 0, told = 0;
  uint64_t seed = 4;
  for (int k = 0; k < BUMPS; k++) {
    double x[2], f, d;
    do {
      for (int i = 0; i < 2; i++) x[i] = 24 * t_uniform(&seed) - 12;
      d = polygon_distance(&loops, x, NULL, NULL);
    } while (fabs(d) < 2 * tolerance || (k % 2 && fabs(d) > 6 * tolerance));
    T_OK(batten_solid_evaluate(ctx, function, 1, x, &f, NULL, NULL), ctx);
    batten_solid *over = with_bump(ctx, function, x, tolerance / 3, -1.05 * f);
    batten_solid *under = with_bump(ctx, function, x, tolerance / 3, -0.6 * f);
    double top;
    T_OK(batten_solid_evaluate(ctx, over, 1, x, &top, NULL, NULL), ctx);
    if (fabs(top + 0.05 * f) > 1e-6 * fabs(f)) T_CHECK(false, "bump: %g makes %g", f, top);
    high += !is_proven(ctx, &loops, over, tolerance, &wrong);
    told += wrong.depth > tolerance;
    low += is_proven(ctx, &loops, under, tolerance, &wrong);
    batten_solid_free(over);
    batten_solid_free(under);
  }
  T_CHECK(high == BUMPS, "bumps through 0: %zu of %d are not proven, of %zu a wrong sign is told", high, BUMPS, told);
  T_CHECK(low == BUMPS, "bumps that stay off it: %zu of %d are proven", low, BUMPS);
  batten_solid_free(function);
  polygon_set_free(&loops);
  stack_scene_free(&scene);
}

/* Other functions than sections have are not proven, nor is one for loops far away from it. */
static void test_others(batten_context *ctx) {
  stack_scene scene = {0};
  stack_scene_slice(&scene, 0);
  stack_scene_disc(&scene, 0, 0, 1, 40);
  stack_scene_slice(&scene, 0);
  stack_scene_disc(&scene, 1e7, 0, 1, 40);
  polygon_set loops = loops_of(ctx, &scene, 0), far = loops_of(ctx, &scene, 1);
  const double center[2] = {0, 0};
  batten_solid *function = NULL, *ball = NULL;
  batten_carrier *carrier = NULL;
  section_figures figures;
  section_wrong wrong;
  T_CHECK(section_fit_loops(ctx, &loops, 0.01, 0.75, &function, &figures) >= 0, "%s", batten_error(ctx));
  T_OK(batten_carrier_ball(ctx, 2, center, 1, &carrier), ctx);
  T_OK(batten_solid_create(ctx, batten_solid_spline(function), carrier, 1, loops.lower, loops.upper, 0, NULL, &ball),
       ctx);
  T_CHECK(is_proven(ctx, &loops, function, 0.01, &wrong), "a disc");
  T_CHECK(!is_proven(ctx, &loops, ball, 0.01, &wrong), "the same with a carrier: not proven");
  T_CHECK(!is_proven(ctx, &far, function, 0.01, &wrong), "for a disc elsewhere: not proven");
  T_CHECK(!is_proven(ctx, &loops, function, 1e-14, &wrong), "within roundings: not proven");
  batten_solid_free(ball);
  batten_solid_free(function);
  batten_carrier_free(carrier);
  polygon_set_free(&far);
  polygon_set_free(&loops);
  stack_scene_free(&scene);
}

/* In another unit the same boxes are looked at: places that are wrong are the same to the bit. */
static void test_scale(batten_context *ctx) {
  section_wrong wrong[2];
  bool proven[2][2];
  for (int k = 0; k < 2; k++) {
    const double unit = k ? 0x1p-20 : 1;
    stack_scene scene = {0};
    uint64_t seed = 3;
    add_jagged(&scene, &seed, 10 * unit);
    polygon_set loops = loops_of(ctx, &scene, 0);
    const double tolerance = 0.1 * loops.spacing;
    batten_solid *function = NULL;
    section_figures figures;
    T_CHECK(section_fit_proven(ctx, &loops, tolerance, 0.75, &function, &figures) >= 0, "%s", batten_error(ctx));
    proven[k][0] = is_proven(ctx, &loops, function, tolerance, &wrong[k]);
    proven[k][1] = is_proven(ctx, &loops, function, 0.125 * tolerance, &wrong[k]);
    for (size_t i = 0; i < wrong[k].count; i++) {
      for (unsigned d = 0; d < 2; d++) wrong[k].places[i][d] /= unit;
      wrong[k].depths[i] /= unit;
    }
    wrong[k].depth /= unit;
    batten_solid_free(function);
    polygon_set_free(&loops);
    stack_scene_free(&scene);
  }
  T_CHECK(proven[0][0] && proven[1][0] && !proven[0][1] && !proven[1][1],
          "proven in both units, not eight times finer");
  bool same = wrong[0].count == wrong[1].count && wrong[0].depth == wrong[1].depth && wrong[0].count > 0;
  for (size_t i = 0; same && i < wrong[0].count; i++)
    same = wrong[0].places[i][0] == wrong[1].places[i][0] && wrong[0].places[i][1] == wrong[1].places[i][1] &&
           wrong[0].depths[i] == wrong[1].depths[i];
  T_CHECK(same, "the %zu places that are wrong then are the same", wrong[0].count);
}

/* The function and its loops in another unit of length; not through a fit, which refuses extreme ones. */
static bool is_proven_in(batten_context *ctx, const polygon_set *loops, const batten_solid *function, double tolerance,
                         double unit) {
  batten_spline_parts parts;
  batten_spline *spline = NULL;
  batten_carrier *none = NULL;
  batten_solid *out = NULL;
  polygon_set own = {0};
  polygon_fault fault;
  section_wrong wrong;
  const size_t count = loops->starts[loops->count];
  batten_spline_get_parts(batten_solid_spline(function), &parts);
  double *centers = malloc((parts.count + count) * 2 * sizeof *centers), *points = centers + 2 * parts.count;
  for (size_t i = 0; i < 2 * parts.count; i++) centers[i] = unit * parts.centers[i];
  for (size_t i = 0; i < 2 * count; i++) points[i] = unit * loops->points[i];
  parts.centers = centers;
  parts.scale *= unit;
  for (unsigned k = 0; k < 2; k++) parts.origin[k] *= unit;
  T_OK(polygon_set_make(ctx, loops->count, loops->starts, points, 0, &own, NULL, &fault), ctx);
  T_OK(batten_spline_create(ctx, &parts, &spline), ctx);
  T_OK(batten_carrier_none(ctx, 2, &none), ctx);
  T_OK(batten_solid_create(ctx, spline, none, 1, own.lower, own.upper, 0, NULL, &out), ctx);
  const bool proven = is_proven(ctx, &own, out, unit * tolerance, &wrong);
  batten_solid_free(out);
  batten_carrier_free(none);
  batten_spline_free(spline);
  polygon_set_free(&own);
  free(centers);
  return proven;
}

/* Squares of lengths below 1e-154 are not what they should be, nor distances made of them: no proof there. */
static void test_tiny(batten_context *ctx) {
  stack_scene scene = {0};
  stack_scene_slice(&scene, 0);
  stack_scene_crescent(&scene, 1, 40);
  polygon_set loops = loops_of(ctx, &scene, 0);
  const double tolerance = 0.1 * loops.spacing;
  batten_solid *function = NULL;
  section_figures figures;
  T_CHECK(section_fit_loops(ctx, &loops, tolerance, 0.75, &function, &figures) >= 0, "%s", batten_error(ctx));
  T_CHECK(is_proven_in(ctx, &loops, function, tolerance, 0x1p-400), "a crescent 1e-120 wide is proven");
  T_CHECK(!is_proven_in(ctx, &loops, function, tolerance, 0x1p-500), "of one 1e-150 wide distances are too coarse");
  batten_solid_free(function);
  polygon_set_free(&loops);
  stack_scene_free(&scene);
}

static batten_status call_proven(batten_context *ctx, void *arg) {
  (void)arg;
  stack_scene scene = {0};
  uint64_t seed = 3;
  add_jagged(&scene, &seed, 10);
  const batten_section *given = stack_scene_sections(&scene);
  polygon_set loops = {0};
  polygon_fault fault;
  batten_solid *function = NULL;
  section_figures figures;
  batten_status st =
      polygon_set_make(ctx, given->contour_count, given->starts, given->points, 0, &loops, NULL, &fault);
  if (st >= 0) st = section_fit_proven(ctx, &loops, 0.3 * loops.spacing, 0.75, &function, &figures);
  batten_solid_free(function);
  polygon_set_free(&loops);
  stack_scene_free(&scene);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_field(ctx);
  test_jagged(ctx);
  test_bumps(ctx);
  test_others(ctx);
  test_scale(ctx);
  test_tiny(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing held");
  batten_context_free(ctx);
  t_fail_every_allocation("section_fit_proven", call_proven, NULL);
  return t_done();
}
