/* Slices of a heart and frames of a ship become contours that correspond. Where the data are not there, twins that
 * are made here stand in; both are judged by the same checks. */
#include <batten/loft.h>

#include "loft_slices.h"

enum { TIMES = 128 };

/* ---- what is asked of the result ----------------------------------------------------------------- */

typedef struct figures {
  double apart;  /* mean distance of points of equal t in neighbouring slices, over the least there can be */
  double speed;  /* least, over the mean one */
  double length; /* largest length of a curve over that of its points' polygon */
  size_t shared; /* inflections that a neighbour has at the same t, to the bit of a knot */
} figures;

static double polygon(size_t count, double points[][2], bool closed) {
  double sum = 0;
  for (size_t k = 1; k < count + closed; k++) {
    const double *a = points[k - 1], *b = points[k % count];
    sum += hypot(b[0] - a[0], b[1] - a[1]);
  }
  return sum;
}

static void sample(batten_context *ctx, const batten_curve *curve, double out[TIMES + 1][2]) {
  static batten_curve_point at[TIMES + 1];
  double t[TIMES + 1];
  for (size_t k = 0; k <= TIMES; k++) t[k] = (double)k / TIMES;
  if (batten_curve_evaluate(ctx, curve, TIMES + 1, t, at) < 0) t_line(false, "%s", batten_error(ctx));
  for (size_t k = 0; k <= TIMES; k++) memcpy(out[k], at[k].point, sizeof at[k].point);
}

static size_t shared_with(batten_context *ctx, const batten_curve *a, const batten_curve *b) {
  size_t n = 0, m = 0, same = 0;
  double *p = NULL, *q = NULL;
  if (batten_curve_inflections(ctx, a, &n, &p) >= 0 && batten_curve_inflections(ctx, b, &m, &q) >= 0)
    for (size_t i = 0; i < n; i++)
      for (size_t j = 0; j < m; j++) same += fabs(p[i] - q[j]) < 1e-7;
  batten_free(ctx, p);
  batten_free(ctx, q);
  return same;
}

static figures judge(batten_context *ctx, stack *s, batten_curve *const *curves) {
  static double own[TIMES + 1][2], last[TIMES + 1][2];
  figures f = {.speed = INFINITY};
  double apart = 0, least = 0;
  for (size_t i = 0; i < s->count; i++) {
    sample(ctx, curves[i], own);
    double length = polygon(TIMES + 1, own, false);
    f.length = fmax(f.length, length / polygon(s->starts[i + 1] - s->starts[i], s->points + s->starts[i], s->closed));
    for (size_t k = 0; k < TIMES; k++)
      f.speed = fmin(f.speed, hypot(own[k + 1][0] - own[k][0], own[k + 1][1] - own[k][1]) * TIMES / length);
    for (size_t k = 0; k < TIMES && i > 0; k++) {
      double nearest = INFINITY;
      for (size_t j = 0; j <= TIMES; j++)
        nearest = fmin(nearest, hypot(own[k][0] - last[j][0], own[k][1] - last[j][1]));
      apart += hypot(own[k][0] - last[k][0], own[k][1] - last[k][1]);
      least += nearest;
    }
    if (i > 0) f.shared += shared_with(ctx, curves[i - 1], curves[i]);
    memcpy(last, own, sizeof own);
  }
  f.apart = apart / least;
  return f;
}

static double size_of(const stack *s) {
  double lower[2] = {INFINITY, INFINITY}, upper[2] = {-INFINITY, -INFINITY};
  for (size_t k = 0; k < s->starts[s->count]; k++)
    for (size_t c = 0; c < 2; c++) {
      lower[c] = fmin(lower[c], s->points[k][c]);
      upper[c] = fmax(upper[c], s->points[k][c]);
    }
  return fmax(upper[0] - lower[0], upper[1] - lower[1]);
}

typedef struct bounds {
  double rms, apart, speed; /* rms in parts of the size */
} bounds;

static void check(batten_context *ctx, const char *what, stack *s, bounds allowed) {
  batten_curve *curves[SLICES] = {NULL};
  batten_loft_match_options o = batten_loft_match_options_default();
  batten_loft_match_info info;
  o.fit.closed = s->closed;
  batten_status st = batten_loft_match(ctx, s->count, s->starts, s->points[0], &o, curves, &info);
  T_CHECK(st >= 0 && info.certified == s->count, "%s: %zu slices, all proven: %s", what, s->count,
          st ? batten_error(ctx) : "");
  if (st < 0) return;
  figures f = judge(ctx, s, curves);
  T_RATIO(info.rms / size_of(s), allowed.rms, "%s: rms in parts of the size, on %zu spans", what, info.spans);
  T_RATIO(f.apart, allowed.apart, "%s: points of equal t apart, over the least", what);
  T_RATIO(allowed.speed, f.speed, "%s: parameters do not crowd: their least speed", what);
  T_RATIO(f.length, 1.1, "%s: length of a curve over that of its points", what);
  T_CHECK(2 * f.shared >= info.inflections_matched && info.inflections_matched > 0,
          "%s: %zu of %zu inflections have all partners, on %zu tracks; %zu pairs at one t", what,
          info.inflections_matched, info.inflections, info.tracks, f.shared);
  printf("# %s: largest distance %.3g of the size, in slice %zu; %zu of another shape; %.2f s\n", what,
         info.max_error / size_of(s), info.max_error_slice, info.told, info.time_s);
  for (size_t i = 0; i < s->count; i++) batten_curve_free(curves[i]);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  static stack heart = {.closed = true}, heart_twin = {.closed = true}, ship, ship_twin;
  make_heart(&heart_twin);
  make_ship(&ship_twin);
  check(ctx, "pixels", &heart_twin, (bounds){0.002, 1.5, 0.4});
  check(ctx, "frames", &ship_twin, (bounds){0.002, 2, 0.1});
  if (read_heart(&heart))
    check(ctx, "heart", &heart, (bounds){0.003, 2, 0.1});
  else
    t_skip("heart", "no data");
  if (read_ship(&ship))
    check(ctx, "ship", &ship, (bounds){0.006, 2, 0.05});
  else
    t_skip("ship", "no data");
  T_CHECK(batten_bytes_in_use(ctx) == 0, "no memory is left");
  batten_context_free(ctx);
  return t_done();
}
