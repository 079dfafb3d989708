/* Orientation of many points by a subset of few: scenes with detail that the subset does not see, noise, uneven
 * density, lines and strays, judged by their true normals; parts by a second way; what must not matter; failures. */
#include <batten/batten.h>

#include "orient_large_scenes.h"
#include "solid/orient.h"

#include <time.h>

enum { SUBSET = 150, POINTS = 8000 };

/* Percent of wrong signs, of normals more than 90 degrees off (lines across at edges count here), degrees that half
 * and 95 in 100 of the normals' lines are off; by scene. The subset's spacing is 6 times that of all points: walls
 * are a third to two thirds of it. */
static const struct {
  double wrong, off, median, most;
} bounds[L_SCENES] = {
    {0, 0, 2, 5},        {0.05, 0.1, 6, 25}, {0.2, 0.4, 8, 20},    {0, 0.3, 0.1, 35},    {0.1, 0.5, 0.1, 40},
    {0, 0.03, 0.1, 0.1}, {0.4, 1.5, 12, 65}, {0.15, 0.3, 0.1, 45}, {0, 0, 0.5, 2},       {0, 0, 4, 8},
    {0, 0.1, 2, 15},     {0, 0, 0.5, 2},     {0.2, 0.4, 10, 35},   {0, 0, 1, 2},         {0, 0, 4, 12},
    {0, 0, 2, 5},        {0.4, 1.2, 10, 60}, {0.5, 1, 12, 60},     {0.05, 0.3, 0.1, 60},
};

static double *orient(batten_context *ctx, const large_scene *l, batten_orient_method method,
                      batten_orient_info *info) {
  batten_orient_options o = batten_orient_options_default();
  double *normals = calloc(3 * l->s.count, sizeof *normals);
  o.method = method;
  o.energy_points = SUBSET;
  T_OK(batten_orient_points(ctx, 3, l->s.count, l->s.points, &o, normals, info), ctx);
  return normals;
}

static void test_scenes(batten_context *ctx) {
  for (int which = 0; which < L_SCENES; which++) {
    large_scene l = l_scene(which, POINTS);
    batten_orient_info info;
    double *normals = orient(ctx, &l, BATTEN_ORIENT_METHOD_AUTO, &info);
    large_result r = l_judge(&l, normals);
    T_CHECK(r.wrong <= bounds[which].wrong && r.off <= bounds[which].off && r.median <= bounds[which].median &&
                r.most <= bounds[which].most && info.method == BATTEN_ORIENT_METHOD_ENERGY && info.pieces > 0,
            "%s, %zu points: %.3f %% wrong signs (%g allowed), %.3f %% beyond 90 degrees (%g), lines half within "
            "%.2f degrees (%g), 95 %% within %.1f (%g); %zu pieces, %zu strays, %zu doubtful",
            l.s.name, l.s.count, r.wrong, bounds[which].wrong, r.off, bounds[which].off, r.median,
            bounds[which].median, r.most, bounds[which].most, info.pieces, info.strays, info.doubtful);
    if (which == 15)
      T_CHECK(info.strays > (l.s.count - l.surface) / 2 && info.strays < 2 * (l.s.count - l.surface),
              "%zu strays found, %zu made", info.strays, l.s.count - l.surface);
    free(normals);
    s_free(&l.s);
  }
}

/* Where both ways are right they agree: all of a closed smooth surface without noise. */
static void test_planes(batten_context *ctx) {
  large_scene l = l_scene(9, POINTS);
  batten_orient_info info;
  double *a = orient(ctx, &l, BATTEN_ORIENT_METHOD_PLANES, &info),
         *b = orient(ctx, &l, BATTEN_ORIENT_METHOD_ENERGY, NULL);
  size_t differ = 0;
  for (size_t i = 0; i < l.s.count; i++)
    differ += (size_t) !(a[3 * i] * b[3 * i] + a[3 * i + 1] * b[3 * i + 1] + a[3 * i + 2] * b[3 * i + 2] > 0);
  T_CHECK(differ == 0 && info.method == BATTEN_ORIENT_METHOD_PLANES && info.pieces == 0 && info.lambda == 0,
          "planes and energy differ at %zu of %zu points", differ, l.s.count);
  free(a);
  free(b);
  s_free(&l.s);
}

static void test_invariance(batten_context *ctx) {
  const double rotation[3][3] = {{0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}};
  large_scene l = l_scene(10, 6000), m = l_scene(10, 6000);
  size_t n = l.s.count, changed = 0;
  double *base = orient(ctx, &l, BATTEN_ORIENT_METHOD_AUTO, NULL);
  for (size_t i = 0; i < n; i++) { /* 7919 is prime and no divisor of n: another order, turned, far away */
    size_t from = i * 7919 % n;
    for (size_t r = 0; r < 3; r++) {
      m.s.points[3 * i + r] = 1e3;
      for (size_t c = 0; c < 3; c++) m.s.points[3 * i + r] += rotation[r][c] * l.s.points[3 * from + c];
    }
  }
  double *turned = orient(ctx, &m, BATTEN_ORIENT_METHOD_AUTO, NULL);
  for (size_t i = 0; i < n; i++) {
    double cosine = 0;
    for (size_t r = 0; r < 3; r++)
      for (size_t c = 0; c < 3; c++) cosine += turned[3 * i + r] * rotation[r][c] * base[3 * (i * 7919 % n) + c];
    changed += cosine < 0;
  }
  T_CHECK(n % 7919 != 0 && changed == 0, "turned, moved, in another order: %zu of %zu signs change", changed, n);
  batten_context *many = t_context(NULL, NULL, 7);
  double *other = orient(many, &l, BATTEN_ORIENT_METHOD_AUTO, NULL);
  T_CHECK(!memcmp(other, base, 3 * n * sizeof *base), "the same bits on 7 threads of our own loops");
  batten_context_free(many);
  free(other);
  free(turned);
  free(base);
  s_free(&l.s);
  s_free(&m.s);
}

/* The subset in blocks is the plain farthest-point subset. */
static void test_spread(batten_context *ctx) {
  enum { N = 3000, E = 200 };
  static double points[3 * N], work[N], nearest[N];
  static size_t chosen[E], order[N];
  large_scene l = l_scene(13, N);
  batten_tree *tree = NULL;
  T_OK(batten_tree_new(ctx, 3, N, l.s.points, &tree), ctx);
  batten_tree_order(tree, order);
  batten_tree_free(ctx, tree);
  for (size_t i = 0; i < N; i++) memcpy(points + 3 * i, l.s.points + 3 * order[i], 3 * sizeof *points);
  batten_orient_graph g = {0};
  T_OK(batten_orient_graph_new(ctx, 3, N, points, false, 0, &g), ctx);
  size_t found = E, bad = 0;
  T_OK(batten_orient_spread(ctx, &g, &found, chosen, work), ctx);
  for (size_t i = 0; i < N; i++) nearest[i] = INFINITY;
  for (size_t e = 0; e < found; e++) {
    double far = 0;
    for (size_t i = 0; e > 0 && i < N; i++) far = fmax(far, nearest[i]);
    bad += e > 0 && nearest[chosen[e]] != far;
    for (size_t i = 0; i < N; i++) {
      double square = 0;
      for (size_t c = 0; c < 3; c++)
        square += (points[3 * i + c] - points[3 * chosen[e] + c]) * (points[3 * i + c] - points[3 * chosen[e] + c]);
      nearest[i] = fmin(nearest[i], square);
    }
  }
  T_CHECK(found == E && bad == 0, "%zu of %zu are not the farthest from those before", bad, found);
  batten_orient_graph_free(ctx, &g);
  s_free(&l.s);
}

enum { GAUSS_POINTS = 6000, PIECES = 16 };

/* Pieces of a sphere and of a cavity's wall, their normals turned at random: Gauss's formula turns them all back,
 * without any vote. Returns the processor's time for it, in seconds. */
static double turn_back(batten_context *ctx, bool mingled, double least_margin) {
  enum { N = GAUSS_POINTS };
  static double points[3 * N], normals[3 * N];
  static size_t piece[N], order[N];
  scene s = {"shell", 3, 0, calloc(3 * N, sizeof(double)), calloc(3 * N, sizeof(double))};
  s_sphere(&s, N * 6 / 10, (double[3]){0}, 1, 1);
  s_sphere(&s, N * 4 / 10, (double[3]){0.1, 0, 0}, 0.7, -1);
  batten_tree *tree = NULL;
  T_OK(batten_tree_new(ctx, 3, N, s.points, &tree), ctx);
  batten_tree_order(tree, order);
  batten_tree_free(ctx, tree);
  double votes[PIECES] = {0}, margin[PIECES], least = 1;
  signed char signs[PIECES];
  size_t wrong = 0;
  const unsigned turned = 0xb2e5;
  for (size_t i = 0; i < N; i++) {
    const double *x = s.points + 3 * order[i];
    memcpy(points + 3 * i, x, 3 * sizeof *x);
    piece[i] = (mingled ? order[i] % 2 : (size_t)(x[0] > 0.05)) + 2 * (size_t)(x[1] > 0) + 4 * (size_t)(x[2] > 0) +
               8 * (size_t)(order[i] >= N * 6 / 10);
    for (size_t c = 0; c < 3; c++)
      normals[3 * i + c] = s.normals[3 * order[i] + c] * (turned >> piece[i] & 1 ? -1 : 1);
  }
  batten_orient_graph g = {0};
  T_OK(batten_orient_graph_new(ctx, 3, N, points, false, 0, &g), ctx);
  clock_t start = clock();
  T_OK(batten_orient_gauss(ctx, &g, normals, piece, PIECES, votes, votes, signs, margin), ctx);
  double time = (double)(clock() - start) / CLOCKS_PER_SEC;
  for (size_t p = 0; p < PIECES; p++) {
    wrong += (signs[p] < 0) != (turned >> p & 1);
    least = fmin(least, margin[p]);
  }
  T_CHECK(wrong == 0 && least > least_margin, "%s: %zu of %d pieces are turned wrong, least margin %.3g",
          mingled ? "pieces that mingle" : "caps", wrong, PIECES, least);
  batten_orient_graph_free(ctx, &g);
  s_free(&s);
  return time;
}

/* Pieces that mingle (noise, walls that touch) must not be summed point by point: 10 times the work for so few
 * points, hours for a million. */
static void test_gauss(batten_context *ctx) {
  double caps = INFINITY, mingled = INFINITY;
  for (int run = 0; run < 3; run++) {
    caps = fmin(caps, turn_back(ctx, false, 0.1));
    mingled = fmin(mingled, turn_back(ctx, true, 0.1));
  }
  T_RATIO(mingled, 6 * caps, "time for pieces that mingle (caps take %.3f s)", caps);
}

/* The part done never falls. */
typedef struct listener {
  double last;
  size_t calls, fallen;
} listener;

static int listen(void *user, const char *phase, double fraction) {
  listener *l = user;
  if (strcmp(phase, "orient") != 0) return 0; /* of the trees within */
  l->fallen += fraction < l->last || fraction > 1;
  l->last = fraction;
  l->calls++;
  return 0;
}

static void test_progress(void) {
  large_scene l = l_scene(12, POINTS);
  for (size_t count = 200; count <= POINTS; count *= 40) { /* below and above energy_points */
    listener heard = {0};
    batten_context_options o = batten_context_options_default();
    o.progress = listen;
    o.progress_user = &heard;
    batten_context *ctx = NULL;
    T_OK(batten_context_new(&o, &ctx), NULL);
    batten_orient_options options = batten_orient_options_default();
    options.energy_points = 200;
    double *normals = calloc(3 * count, sizeof *normals);
    T_OK(batten_orient_points(ctx, 3, count, l.s.points, &options, normals, NULL), ctx);
    T_CHECK(heard.calls > 20 && heard.fallen == 0, "%zu points: the part done falls at %zu of %zu calls", count,
            heard.fallen, heard.calls);
    free(normals);
    batten_context_free(ctx);
  }
  s_free(&l.s);
}

static batten_status refined_call(batten_context *ctx, void *unused) {
  (void)unused;
  double normals[240], before[240];
  scene s = s_new("small", 3);
  s_sphere(&s, 80, (double[3]){0}, 1, 1);
  batten_orient_options o = batten_orient_options_default();
  batten_orient_info info = {0};
  o.energy_points = 20;
  for (int i = 0; i < 240; i++) normals[i] = before[i] = 77;
  batten_status status = batten_orient_points(ctx, 3, s.count, s.points, &o, normals, &info);
  if (status < 0 && (memcmp(normals, before, sizeof normals) || info.method))
    t_line(false, "output touched on failure");
  if (status >= 0 && info.pieces == 0) t_line(false, "this should be refined");
  s_free(&s);
  return status;
}

static void test_failures(batten_context *ctx) {
  double normals[15] = {0};
  batten_orient_options o = {0};
  t_fail_every_allocation("batten_orient_points", refined_call, NULL);
  t_cancel_every_progress("batten_orient_points", refined_call, NULL);
  T_STATUS(batten_orient_points(ctx, 3, 5, normals, &o, normals, NULL), BATTEN_E_INVALID, ctx,
           "batten_orient_options");
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_spread(ctx);
  test_gauss(ctx);
  test_scenes(ctx);
  test_planes(ctx);
  test_invariance(ctx);
  test_progress();
  test_failures(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left behind");
  batten_context_free(ctx);
  return t_done();
}
