/* Slices of a heart and frames of a ship become contours that correspond. Where the data are not there, twins that
 * are made here stand in; both are judged by the same checks. */
#include <batten/loft.h>

#include "tap.h"

enum { POINTS = 8192, SLICES = 128, TIMES = 128 };
static const double PI = 3.14159265358979323846;

typedef struct stack {
  size_t count, starts[SLICES + 1], used; /* points; those beyond the last slice begin the next */
  double points[POINTS][2];
  bool closed;
} stack;

static FILE *open_shared(const char *name) {
  const char *shared = getenv("BATTEN_SHARED");
  char path[1024];
  if (!shared || snprintf(path, sizeof path, "%s/data/%s", shared, name) >= (int)sizeof path) return NULL;
  return fopen(path, "r");
}

static void add_point(stack *s, double x, double y) {
  double *p = s->points[s->used++];
  p[0] = x;
  p[1] = y;
}

/* The points since the last call are a slice; fewer than `least` are none. */
static void end_slice(stack *s, size_t least) {
  if (s->used - s->starts[s->count] < least)
    s->used = s->starts[s->count];
  else
    s->starts[++s->count] = s->used;
}

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

/* ---- a heart ------------------------------------------------------------------------------------ */

static bool read_heart(stack *s) {
  FILE *file = open_shared("contours/rt_Heart.txt");
  char line[256];
  double x, y;
  if (!file) return false;
  while (fgets(line, sizeof line, file) && s->count + 1 < SLICES && s->used < POINTS) {
    if (strncmp(line, "contour", 7) == 0) end_slice(s, 3);
    if (sscanf(line, "%lf %lf", &x, &y) == 2) add_point(s, x, y);
  }
  end_slice(s, 3);
  fclose(file);
  return s->count > 0;
}

/* Outlines on pixels of 1, from 25 to 40 wide, that move and turn, with a dent that comes and goes; each begins
 * somewhere, every seventh runs backwards. */
static void make_heart(stack *s) {
  uint64_t seed = 5;
  for (size_t i = 0; i < 24; i++) {
    double z = (double)i / 23, size = 25 + 60 * z * (1 - z), dent = 0.35 * sin(PI * z) * (z > 0.2 && z < 0.8);
    double start = 2 * PI * t_uniform(&seed);
    size_t count = (size_t)(4 * size);
    for (size_t k = 0; k < count; k++) {
      double a = start + (i % 7 == 6 ? -2 : 2) * PI * (double)k / (double)count;
      double r = size * (1 + 0.1 * cos(2 * a + z) - dent * exp(-pow(remainder(a - 1 - z, 2 * PI) / 0.4, 2)));
      add_point(s, 5 * z + r * cos(a) + 0.3 * t_uniform(&seed), r * sin(a) + 0.3 * t_uniform(&seed));
    }
    end_slice(s, 3);
  }
}

/* ---- a ship ------------------------------------------------------------------------------------- */

static int by_station(const void *a, const void *b) {
  const double *p = a, *q = b;
  for (int k = 0; k < 2; k++)
    if (p[k] != q[k]) return p[k] < q[k] ? -1 : 1;
  return 0;
}

/* Half-breadths by waterline; of those that are 0 at the keel the highest is kept. */
static bool read_ship(stack *s) {
  FILE *file = open_shared("hulls/gunnerus_offsets.csv");
  static double table[POINTS][3];
  char line[256];
  size_t rows = 0;
  if (!file) return false;
  while (rows < POINTS && fgets(line, sizeof line, file))
    if (sscanf(line, "%lf,%lf,%lf", &table[rows][0], &table[rows][1], &table[rows][2]) == 3) rows++;
  fclose(file);
  qsort(table, rows, sizeof table[0], by_station);
  for (size_t i = 0; i < rows && s->count + 1 < SLICES; i++) {
    bool ends = i + 1 == rows || table[i + 1][0] != table[i][0];
    if (table[i][2] > 0 || (!ends && table[i + 1][2] > 0)) add_point(s, table[i][2], table[i][1]);
    if (ends) end_slice(s, 5);
  }
  return s->count > 0;
}

/* Frames of a hull that is hollow in the bow. */
static void make_ship(stack *s) {
  for (size_t i = 0; i < 30; i++) {
    double z = (double)i / 29, full = 0.3 + 0.7 * sqrt(1 - z), hollow = 0.45 * z;
    for (size_t k = 0; k <= 14; k++) {
      double h = (double)k / 14;
      add_point(s, full * (pow(h, 0.5 + z) - hollow * sin(PI * h) * h), h);
    }
    end_slice(s, 5);
  }
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
