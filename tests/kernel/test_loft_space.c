/* kernel/loft/space.c and slabs.c: knots by hand, functions by another route (open ones as bspline.c has them,
 * periodic ones by averaging over periods), insertion as the same curve, spaces that unions have in common, clamped
 * knots. */
#include "tap.h"

#include "basis/refine.h"
#include "loft/loft_inner.h"

enum { MOST = 400 };

/* A space of random breaks, the shortest spans a hundredth of the longest; folds up to degree - 1. `grid`: breaks are
 * multiples of 1 / grid, so that spaces share some. */
static loft_space random_space(batten_context *ctx, uint64_t *seed, unsigned degree, bool closed, size_t spans,
                               size_t grid) {
  double breaks[64] = {0};
  unsigned folds[64];
  size_t used = 0;
  for (size_t i = 0; i <= spans; i++) folds[i] = 1 + (unsigned)(t_random(seed) % (degree - 1));
  if (grid > 0) {
    for (size_t g = 1; g < grid && used + 1 < spans; g++)
      if (t_uniform(seed) < 0.5) breaks[++used] = (double)g / (double)grid;
    spans = used + 1;
  } else
    for (size_t i = 1; i <= spans; i++) breaks[i] = breaks[i - 1] + pow(10, -2 * t_uniform(seed));
  double all = breaks[spans - (grid > 0)];
  for (size_t i = 1; i < spans && grid == 0; i++) breaks[i] /= all;
  breaks[spans] = 1;
  loft_space s = {0};
  T_OK(loft_space_make(ctx, degree, closed, spans, breaks, folds, &s), ctx);
  return s;
}

static unsigned fold_at(const loft_space *s, double t) {
  for (size_t i = 0; i <= s->spans; i++)
    if (s->breaks[i] == t) return s->folds[i];
  return 0;
}

/* The k-th derivative at t of a spline in a space, from its unrolled functions. */
static void value(const loft_space *s, const double *points, unsigned k, double t, double out[2]) {
  double table[(BSPLINE_ORDER) * (BSPLINE_ORDER)];
  size_t span = s->spans - 1;
  while (span > 0 && t < s->breaks[span]) span--;
  bspline_basis(&s->b, s->first[span] + s->degree, t, k, table);
  out[0] = out[1] = 0;
  for (unsigned j = 0; j <= s->degree; j++)
    for (size_t x = 0; x < 2; x++)
      out[x] += table[k * (s->degree + 1) + j] * points[2 * ((s->first[span] + j) % s->count) + x];
}

static void random_points(uint64_t *seed, size_t count, double *points) {
  for (size_t k = 0; k < 2 * count; k++) points[k] = 2 * t_uniform(seed) - 1;
}

/* ---- by hand ------------------------------------------------------------------------------------- */

static void by_hand(batten_context *ctx) {
  /* Quadratic, open: knots 0 0 0 1/4 1 1 1. */
  double breaks[] = {0, 0.25, 1};
  unsigned folds[] = {7, 1, 7};
  loft_space s = {0};
  T_OK(loft_space_make(ctx, 2, false, 2, breaks, folds, &s), ctx);
  T_CHECK(s.count == 4 && s.b.count == 4 && s.first[0] == 0 && s.first[1] == 1, "open: 4 functions, spans on 0, 1");
  T_CHECK(loft_legs(&s) == 3 && loft_vertices(&s) == 2, "3 legs, 2 vertices");
  T_CHECK(s.knots[2] == 0 && s.knots[3] == 0.25 && s.knots[4] == 1 && s.knots[6] == 1, "its knots");
  T_CHECK(loft_greville(&s, 1) == 0.125 && loft_greville(&s, 3) == 1, "its Greville abscissas");
  T_CHECK(loft_interval(&s, 0) == 0.25 && loft_interval(&s, 1) == 1 && loft_interval(&s, 2) == 0.75, "its intervals");
  /* 1/2 inserted: the middle control point splits by 1/4 .. 1. */
  double half = 0.5;
  unsigned once = 1;
  loft_space finer = {0};
  loft_matrix m = {0};
  T_OK(loft_space_insert(ctx, &s, 1, &half, &once, &finer), ctx);
  T_OK(loft_insertion(ctx, &s, &finer, &m), ctx);
  double x[] = {0, 0, 1, 0, 2, 8, 3, 5}, y[10];
  loft_matrix_apply(&m, x, y);
  /* d'_2 = x[1/4, 1/2] = between d_1 (0, 1/4) and d_2 (1/4, 1): half way; d'_3 = x[1/2, 1]: a third from d_2 to d_3
   */
  T_CHECK(m.rows == 5 && m.starts[5] == 7 && y[2] == 1 && y[4] == 1.5 && y[5] == 4 &&
              fabs(y[6] - (2 + 1. / 3)) < 1e-15 && y[8] == 3,
          "a knot inserted: (%g, %g), (%g, %g)", y[4], y[5], y[6], y[7]);
  loft_matrix_free(ctx, &m);
  loft_space_free(ctx, &finer);
  loft_space_free(ctx, &s);

  /* Cubic, closed, knots 0 (double), 1/4, 1/2: of 4 functions a period. */
  double around[] = {0, 0.25, 0.5, 1};
  unsigned twice[] = {2, 1, 1, 9};
  T_OK(loft_space_make(ctx, 3, true, 3, around, twice, &s), ctx);
  T_CHECK(s.count == 4 && loft_legs(&s) == 4 && loft_vertices(&s) == 4 && s.folds[3] == 2, "closed: 4 functions");
  double knots[] = {-0.75, -0.5, 0, 0, 0.25, 0.5, 1, 1, 1.25, 1.5, 2};
  bool same = s.b.count == 7;
  for (size_t j = 0; j < 11; j++) same = same && s.knots[j] == knots[j];
  T_CHECK(same && s.first[0] == 0 && s.first[1] == 1 && s.first[2] == 2, "its knots");
  T_CHECK(loft_knot(&s, -2) == -1 && loft_knot(&s, 13) == 2.5, "knots far off");
  T_CHECK(loft_interval(&s, 3) == 0.75 && loft_interval(&s, -1) == 0.75 && loft_interval(&s, 7) == 0.75,
          "intervals modulo 4");
  T_CHECK(loft_greville(&s, 4) == 1 + loft_greville(&s, 0) && loft_greville(&s, -1) == loft_greville(&s, 3) - 1,
          "Greville abscissas beyond");
  loft_space_free(ctx, &s);
}

/* ---- functions ----------------------------------------------------------------------------------- */

/* All functions sum up to 1, the Greville abscissas to t, and legs are intervals times x' / degree. */
static void functions(batten_context *ctx, uint64_t *seed, unsigned degree, bool closed) {
  loft_space s = random_space(ctx, seed, degree, closed, 9, 0);
  double one = 0, identity = 0, steps = 0, ones[2 * MOST], greville[2 * MOST];
  for (size_t j = 0; j < s.b.count; j++) greville[j] = loft_greville(&s, (ptrdiff_t)j);
  for (size_t j = 0; j < 2 * s.count; j++) ones[j] = 1;
  for (size_t span = 0; span < s.spans; span++)
    for (unsigned k = 0; k <= 4; k++) {
      double t = s.breaks[span] + k / 4. * (s.breaks[span + 1] - s.breaks[span]), at[2], sum = 0;
      double table[BSPLINE_ORDER];
      bspline_basis(&s.b, s.first[span] + degree, t, 0, table);
      for (unsigned j = 0; j <= degree; j++) sum += table[j] * greville[s.first[span] + j];
      value(&s, ones, 0, t, at);
      one = fmax(one, fabs(at[0] - 1));
      identity = fmax(identity, fabs(sum - t));
    }
  for (size_t v = 0; v < loft_legs(&s); v++) {
    double step = loft_greville(&s, (ptrdiff_t)v + 1) - loft_greville(&s, (ptrdiff_t)v);
    steps = fmax(steps, fabs(loft_interval(&s, (ptrdiff_t)v) - degree * step));
  }
  T_RATIO(one, 1e-13, "degree %u%s: functions sum up to 1", degree, closed ? ", closed" : "");
  T_RATIO(identity, 1e-13, "Greville abscissas make t");
  T_RATIO(steps, 1e-14, "intervals are degree times their steps");
  loft_space_free(ctx, &s);
}

/* Derivatives up to degree - fold are the same from both sides of each break, and at the seam of closed spaces. */
static void smoothness(batten_context *ctx, uint64_t *seed, unsigned degree) {
  loft_space s = random_space(ctx, seed, degree, true, 7, 0);
  double points[2 * MOST], worst = 0, jump = INFINITY;
  random_points(seed, s.count, points);
  for (size_t i = 0; i < s.spans; i++) {
    size_t before = i > 0 ? i - 1 : s.spans - 1;
    double tables[2][BSPLINE_ORDER * BSPLINE_ORDER], size = 0;
    bspline_basis(&s.b, s.first[before] + degree, i > 0 ? s.breaks[i] : 1, degree, tables[0]);
    bspline_basis(&s.b, s.first[i] + degree, s.breaks[i], degree, tables[1]);
    for (unsigned k = 0; k <= degree - s.folds[i] + 1; k++) {
      double at[2] = {0, 0};
      for (unsigned j = 0; j <= degree; j++) {
        size_t place = k * (degree + 1) + j;
        at[0] += tables[0][place] * points[2 * ((s.first[before] + j) % s.count)];
        at[1] += tables[1][place] * points[2 * ((s.first[i] + j) % s.count)];
        size = fmax(size, fmax(fabs(tables[0][place]), fabs(tables[1][place])));
      }
      double off = fabs(at[1] - at[0]) / size;
      if (k <= degree - s.folds[i])
        worst = fmax(worst, off);
      else
        jump = fmin(jump, off);
    }
  }
  T_RATIO(worst, 1e-10, "degree %u: derivatives go on through breaks", degree);
  T_CHECK(jump > 1e-6, "and the next one jumps: %g", jump);
  loft_space_free(ctx, &s);
}

/* ---- combinations -------------------------------------------------------------------------------- */

static double most_apart(const loft_space *a, const double *x, const loft_space *b, const double *y, unsigned k) {
  double worst = 0;
  for (size_t i = 0; i < 500; i++) {
    double t = ((double)i + 0.37) / 500, p[2], q[2];
    value(a, x, k, t, p);
    value(b, y, k, t, q);
    worst = fmax(worst, fmax(fabs(p[0] - q[0]), fabs(p[1] - q[1])));
  }
  return worst;
}

static void insertions(batten_context *ctx, uint64_t *seed, unsigned degree, bool closed) {
  loft_space a = random_space(ctx, seed, degree, closed, 10, 24), b = random_space(ctx, seed, degree, closed, 10, 24),
             c = random_space(ctx, seed, degree, closed, 10, 24), both = {0}, other = {0}, common = {0}, same = {0};
  T_OK(loft_space_union(ctx, &a, &b, &both), ctx);
  T_OK(loft_space_union(ctx, &c, &b, &other), ctx);
  T_OK(loft_space_common(ctx, &a, &b, &c, &common), ctx);
  bool right = true;
  for (size_t g = 0; g < 24; g++) {
    double t = (double)g / 24;
    unsigned f[3] = {fold_at(&a, t), fold_at(&b, t), fold_at(&c, t)};
    unsigned least = f[0] < f[2] ? f[0] : f[2];
    right = right && fold_at(&both, t) == (f[0] > f[1] ? f[0] : f[1]);
    right = right && fold_at(&common, t) == (f[1] > least ? f[1] : least);
  }
  T_CHECK(right, "degree %u%s: folds of unions and what they have in common", degree, closed ? ", closed" : "");

  double x[2 * MOST], y[2 * MOST], z[2 * MOST];
  loft_matrix m = {0}, direct = {0}, next = {0};
  random_points(seed, b.count, x);
  T_OK(loft_insertion(ctx, &b, &both, &direct), ctx);
  loft_matrix_apply(&direct, x, y);
  T_RATIO(most_apart(&b, x, &both, y, 0), 1e-13, "the same curve in the union");
  bool convex = true, sorted = true;
  double sum_off = 0;
  for (size_t i = 0; i < direct.rows; i++) {
    double sum = 0;
    for (size_t e = direct.starts[i]; e < direct.starts[i + 1]; e++) {
      convex = convex && direct.values[e] > 0;
      sorted = sorted && (e == direct.starts[i] || direct.indices[e] > direct.indices[e - 1]);
      sum += direct.values[e];
    }
    convex = convex && direct.starts[i + 1] - direct.starts[i] <= degree + 1;
    sum_off = fmax(sum_off, fabs(sum - 1));
  }
  T_CHECK(convex && sorted && direct.rows == both.count && direct.columns == b.count,
          "rows are convex combinations, columns ascend");
  T_RATIO(sum_off, 1e-15, "their sums are 1");

  if (!closed) {
    bspline_refine(&b.b, 2, x, &both.b, z);
    double off = 0;
    for (size_t k = 0; k < 2 * both.count; k++) off = fmax(off, fabs(y[k] - z[k]));
    T_RATIO(off, 1e-15, "as bspline_refine has it");
  }

  /* By way of the common space, which lies between b and both. */
  T_OK(loft_insertion(ctx, &b, &common, &m), ctx);
  T_OK(loft_insertion(ctx, &common, &both, &next), ctx);
  double between[2 * MOST];
  loft_matrix_apply(&m, x, between);
  loft_matrix_apply(&next, between, z);
  double apart = 0;
  for (size_t k = 0; k < 2 * both.count; k++) apart = fmax(apart, fabs(y[k] - z[k]));
  T_RATIO(apart, 1e-14, "the same by way of what unions have in common");
  loft_matrix_free(ctx, &m);
  loft_matrix_free(ctx, &next);
  T_OK(loft_insertion(ctx, &common, &other, &next), ctx);
  loft_matrix_apply(&next, between, z);
  T_RATIO(most_apart(&b, x, &other, z, 0), 1e-13, "and into the other union");
  loft_matrix_free(ctx, &next);
  loft_matrix_free(ctx, &direct);

  /* Nothing inserted: the identity. */
  T_OK(loft_space_insert(ctx, &b, 0, NULL, NULL, &same), ctx);
  T_OK(loft_insertion(ctx, &b, &same, &m), ctx);
  loft_matrix_apply(&m, x, y);
  T_CHECK(m.starts[m.rows] == b.count && memcmp(x, y, 2 * b.count * sizeof *x) == 0, "nothing inserted: a copy");
  loft_matrix_free(ctx, &m);

  /* As clamped knots. */
  size_t knots;
  double *u;
  T_OK(loft_clamped(ctx, &b, &knots, &u, &m), ctx);
  loft_matrix_apply(&m, x, y);
  bspline space = {degree, m.rows, u};
  double off = 0, table[BSPLINE_ORDER];
  for (size_t i = 0; i <= 500; i++) {
    double t = (double)i / 500, p[2], q[2] = {0, 0};
    size_t mu = bspline_span(&space, t);
    bspline_basis(&space, mu, t, 0, table);
    for (unsigned j = 0; j <= degree; j++)
      for (size_t k = 0; k < 2; k++) q[k] += table[j] * y[2 * (mu - degree + j) + k];
    value(&b, x, 0, t, p);
    off = fmax(off, fmax(fabs(p[0] - q[0]), fabs(p[1] - q[1])));
  }
  T_RATIO(off, 1e-13, "the same curve over clamped knots");
  T_CHECK(knots == m.rows + degree + 1 && u[degree] == 0 && u[degree + 1] > 0 && u[m.rows] == 1 &&
              u[m.rows - 1] < 1 && memcmp(y, y + (closed ? 2 * (m.rows - 1) : 0), 2 * sizeof *y) == 0,
          "which are clamped%s", closed ? "; the last point is the first" : "");
  if (!closed) T_CHECK(memcmp(x, y, 2 * b.count * sizeof *x) == 0, "open: a copy");
  batten_free(ctx, u);
  loft_matrix_free(ctx, &m);
  loft_space *all[] = {&a, &b, &c, &both, &other, &common, &same};
  for (size_t k = 0; k < sizeof all / sizeof *all; k++) loft_space_free(ctx, all[k]);
}

/* ---- patches ------------------------------------------------------------------------------------- */

static batten_status make_slabs(batten_context *ctx, void *arg) {
  const loft_stack *stack = arg;
  loft_slab *slabs = NULL;
  batten_status st = loft_slabs_make(ctx, stack, &slabs);
  if (st >= 0) loft_slabs_free(ctx, stack->count - 1, slabs);
  return st;
}

static void patches(batten_context *ctx, uint64_t *seed, bool closed) {
  loft_contour contours[3] = {{.height = 0}, {.height = 1.5}, {.height = 2}};
  double points[3][2 * MOST];
  for (size_t i = 0; i < 3; i++) {
    contours[i].space = random_space(ctx, seed, 3, closed, 8, 20);
    contours[i].points = points[i];
    random_points(seed, contours[i].space.count, points[i]);
  }
  loft_stack stack = {.degree = 3, .smoothness = 1, .closed = closed, .count = 3, .contours = contours};
  loft_slab *slabs = NULL;
  T_OK(loft_slabs_make(ctx, &stack, &slabs), ctx);
  double worst = 0;
  for (size_t i = 0; i < 2; i++)
    for (size_t e = 0; e < 2; e++)
      worst = fmax(worst, most_apart(&contours[i + e].space, points[i + e], &slabs[i].space, slabs[i].end[e], 0));
  T_CHECK(slabs[0].gap == 1.5 && slabs[1].gap == 0.5, "gaps of patches");
  T_RATIO(worst, 1e-13, "patches%s end in their contours", closed ? ", closed," : "");
  loft_slabs_free(ctx, 2, slabs);
  t_fail_every_allocation("loft_slabs_make", make_slabs, &stack);
  for (size_t i = 0; i < 3; i++) loft_space_free(ctx, &contours[i].space);
}

/* ---- failures ------------------------------------------------------------------------------------ */

static batten_status make_all(batten_context *ctx, void *arg) {
  (void)arg;
  double breaks[] = {0, 0.25, 0.5, 1}, knot = 0;
  unsigned folds[] = {1, 1, 2, 1}, twice = 2;
  loft_space a = {0}, b = {0};
  loft_matrix m = {0}, clamped = {0};
  double *knots = NULL;
  size_t count;
  batten_status st = loft_space_make(ctx, 3, true, 3, breaks, folds, &a);
  if (st >= 0) st = loft_space_insert(ctx, &a, 1, &knot, &twice, &b);
  if (st >= 0) st = loft_insertion(ctx, &a, &b, &m);
  if (st >= 0) st = loft_clamped(ctx, &b, &count, &knots, &clamped);
  batten_free(ctx, knots);
  loft_matrix_free(ctx, &clamped);
  loft_matrix_free(ctx, &m);
  loft_space_free(ctx, &b);
  loft_space_free(ctx, &a);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  uint64_t seed = 20;
  by_hand(ctx);
  for (unsigned degree = 2; degree <= 9; degree += degree < 6 ? 1 : 3)
    for (int closed = 0; closed < 2; closed++) {
      functions(ctx, &seed, degree, closed);
      if (closed) smoothness(ctx, &seed, degree);
      for (int k = 0; k < 3; k++) insertions(ctx, &seed, degree, closed);
    }
  for (int closed = 0; closed < 2; closed++) patches(ctx, &seed, closed);
  t_fail_every_allocation("spaces and matrices", make_all, NULL);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  batten_context_free(ctx);
  return t_done();
}
