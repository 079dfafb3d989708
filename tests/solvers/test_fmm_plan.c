/* Plans of fast multipole sums: bad input, memory, cancel, sharing, threads, instruction sets, invariances. */
#include "fmm_scene.h"

#include <fmm/lanes.h>

enum { COUNT = 4000 };
static const batten_radial thin_plate = {2, 2, 1}, biharmonic = {3, 1, 0};
static fmm_scene plane, space;
static batten_context *ctx;

static batten_fmm_options options(double accuracy, int derivatives) {
  batten_fmm_options o = batten_fmm_options_default();
  o.accuracy = accuracy;
  o.gradients = o.dipoles = derivatives;
  return o;
}

static void test_bad_input(void) {
  batten_fmm *f = NULL;
  batten_fmm_options o = batten_fmm_options_default();
  double x[6] = {0, 0, 1, 1, 2, 2}, w[3] = {1, 2, 3}, u[3];
#define CREATE(k) batten_fmm_create(ctx, k, 3, x, 3, NULL, &o, &f)
  T_STATUS(CREATE((&(batten_radial){1, 1, 0})), BATTEN_E_INVALID, ctx, "kernel.n: 1; must be 2 or 3");
  T_STATUS(CREATE((&(batten_radial){2, 2, 0})), BATTEN_E_INVALID, ctx, "kernel.power: 2; must be 1, 3, 5 or 7");
  T_STATUS(CREATE((&(batten_radial){2, 3, 1})), BATTEN_E_INVALID, ctx, "kernel.power: 3; must be 2, 4 or 6");
  T_STATUS(CREATE((&(batten_radial){2, 9, 0})), BATTEN_E_INVALID, ctx, "kernel.power: 9");
  T_STATUS(CREATE((&(batten_radial){2, 2, 7})), BATTEN_E_INVALID, ctx, "kernel.logarithm: 7; must be 0 or 1");
  T_STATUS(CREATE(NULL), BATTEN_E_INVALID, ctx, "kernel: NULL");
  o.accuracy = 1e-13;
  T_STATUS(CREATE(&thin_plate), BATTEN_E_INVALID, ctx, "opt.accuracy: 1e-13; must be 1e-12 .. 1e-3");
  o.accuracy = NAN;
  T_STATUS(CREATE(&thin_plate), BATTEN_E_INVALID, ctx, "opt.accuracy: nan");
  o = (batten_fmm_options){0};
  T_STATUS(CREATE(&thin_plate), BATTEN_E_INVALID, ctx, "batten_fmm_options.struct_size: 0");
  o = batten_fmm_options_default();
  T_STATUS(batten_fmm_create(ctx, &thin_plate, 3, x, 2, NULL, &o, &f), BATTEN_E_INVALID, ctx, "target_count: 2");
  T_STATUS(batten_fmm_create(ctx, &thin_plate, 3, NULL, 3, x, &o, &f), BATTEN_E_INVALID, ctx, "sources: NULL");
  T_STATUS(batten_fmm_create(ctx, &thin_plate, SIZE_MAX / 8, x, 3, x, &o, &f), BATTEN_E_TOO_LARGE, ctx, "sources");
  x[3] = INFINITY;
  T_STATUS(CREATE(&thin_plate), BATTEN_E_INVALID, ctx, "sources[1][1]: inf; must be finite");
  x[3] = -1e31;
  T_STATUS(batten_fmm_create(ctx, &thin_plate, 1, x, 3, x, &o, &f), BATTEN_E_INVALID, ctx, "targets[1][1]: -1e+31");
  x[3] = 1;
  T_CHECK(f == NULL, "out is untouched");
  T_OK(CREATE(&thin_plate), ctx);
  T_STATUS(batten_fmm_apply(ctx, f, w, x, u, NULL), BATTEN_E_INVALID, ctx, "dipoles: given to a plan without");
  T_STATUS(batten_fmm_apply(ctx, f, w, NULL, u, x), BATTEN_E_INVALID, ctx, "gradients: asked of a plan without");
  w[2] = NAN;
  T_STATUS(batten_fmm_apply(ctx, f, w, NULL, u, NULL), BATTEN_E_INVALID, ctx, "weights[2]: nan; must be finite");
  w[2] = 3;
  T_STATUS(batten_fmm_apply(ctx, NULL, w, NULL, u, NULL), BATTEN_E_INVALID, ctx, "fmm: NULL");
  T_STATUS(batten_fmm_error(ctx, f, w, NULL, u, NULL, 3, 1, NULL, NULL), BATTEN_E_INVALID, ctx,
           "values, value_error");
  batten_fmm *g = NULL;
  o.share = f;
  T_STATUS(batten_fmm_create(ctx, &(batten_radial){2, 4, 1}, 3, x, 3, NULL, &o, &g), BATTEN_E_INVALID, ctx,
           "opt.share: a plan of power 2 in 2 dimensions");
  o.accuracy = 1e-6;
  T_STATUS(batten_fmm_create(ctx, &thin_plate, 3, x, 3, NULL, &o, &g), BATTEN_E_INVALID, ctx,
           "opt.share: a plan of accuracy 1e-08");
  o.accuracy = 1e-8, o.dipoles = 1;
  T_STATUS(batten_fmm_create(ctx, &thin_plate, 3, x, 3, NULL, &o, &g), BATTEN_E_INVALID, ctx, "without dipoles");
  batten_fmm_free(f), f = NULL;
  batten_fmm_free(NULL);
  o = batten_fmm_options_default();
  double error = 7;
  T_OK(batten_fmm_create(ctx, &thin_plate, 0, NULL, 2, x, &o, &f), ctx);
  T_OK(batten_fmm_apply(ctx, f, NULL, NULL, u, NULL), ctx);
  T_OK(batten_fmm_error(ctx, f, NULL, NULL, u, NULL, 9, 1, &error, NULL), ctx);
  T_CHECK(u[0] == 0 && u[1] == 0 && error == 0, "no sources: 0");
  batten_fmm_free(f), f = NULL;
  T_OK(batten_fmm_create(ctx, &thin_plate, 0, NULL, 0, NULL, NULL, &f), ctx);
  T_OK(batten_fmm_apply(ctx, f, NULL, NULL, u, NULL), ctx);
  batten_fmm_free(f);
}

static batten_status whole_life(batten_context *c, void *arg) {
  const fmm_scene *s = &plane;
  const batten_fmm_options o = options(1e-3, 1);
  batten_fmm *f = NULL;
  double error;
  (void)arg;
  batten_status st = batten_fmm_create(c, &thin_plate, COUNT, s->y, COUNT, NULL, &o, &f);
  if (st >= 0 && batten_fmm_get_info(f).direct) st = BATTEN_E_INTERNAL;
  if (st >= 0) st = batten_fmm_apply(c, f, s->w, s->g, s->u, s->du);
  if (st >= 0) st = batten_fmm_error(c, f, s->w, s->g, s->u, NULL, 10, 1, &error, NULL);
  batten_fmm_free(f);
  return st;
}

/* Values and gradients of a scene by `threads` threads; copies of both, one after the other. */
static double *product(const fmm_scene *s, const batten_radial *k, unsigned threads, const double *y, const double *w,
                       double accuracy) {
  batten_context *c = t_context(NULL, NULL, threads);
  const batten_fmm_options o = options(accuracy, 1);
  double *out = calloc(s->sources * (1 + s->n), sizeof *out);
  batten_fmm *f = NULL;
  if (batten_fmm_create(c, k, s->sources, y, s->sources, NULL, &o, &f) < 0 ||
      batten_fmm_apply(c, f, w, s->g, out, out + s->sources) < 0)
    printf("# %s\n", batten_error(c));
  batten_fmm_free(f);
  batten_context_free(c);
  return out;
}

static double difference(size_t count, const double *a, const double *b) {
  double d = 0, norm = 0;
  for (size_t i = 0; i < count; i++) d += (a[i] - b[i]) * (a[i] - b[i]), norm += b[i] * b[i];
  return sqrt(d / norm);
}

static void test_invariances(const fmm_scene *s, const batten_radial *k) {
  const size_t numbers = COUNT * (1 + s->n), coordinates = COUNT * s->n;
  double *one = product(s, k, 1, s->y, s->w, 1e-5), *moved = malloc(coordinates * sizeof *moved);
  double *weights = malloc(COUNT * sizeof *weights);
  for (unsigned threads = 2; threads <= 5; threads += 3) {
    double *more = product(s, k, threads, s->y, s->w, 1e-5);
    T_CHECK(memcmp(one, more, numbers * sizeof *one) == 0, "%u-D: the same bits by %u threads", s->n, threads);
    free(more);
  }
  for (size_t i = 0; i < COUNT; i++) weights[i] = -8 * s->w[i];
  for (size_t i = 0; i < coordinates; i++) moved[i] = s->y[i] * 0x1p-20;
  if (!k->logarithm) {
    /* Dipoles keep their size: in units of the points they grow by 2^20. Without them the bits scale. */
    fmm_scene t = *s;
    t.g = calloc(coordinates, sizeof(double));
    double *plain = product(&t, k, 2, s->y, s->w, 1e-5), *scaled = product(&t, k, 2, moved, weights, 1e-5);
    size_t differ = 0;
    for (size_t i = 0; i < COUNT; i++) differ += scaled[i] != -8 * ldexp(plain[i], -20 * k->power);
    for (size_t i = COUNT; i < numbers; i++) differ += scaled[i] != -8 * ldexp(plain[i], -20 * (k->power - 1));
    T_CHECK(differ == 0, "%u-D: points times 2^-20, weights times -8: bits scale", s->n);
    free(t.g), free(plain), free(scaled);
  }
  for (size_t i = 0; i < coordinates; i++) moved[i] = s->y[i] + 3;
  double *other = product(s, k, 2, moved, s->w, 1e-5);
  T_RATIO(difference(COUNT, other, one), 2e-5, "%u-D: moved by 3", s->n);
  free(other);
  fmm_scene r = *s;
  r.g = malloc(coordinates * sizeof(double));
  for (size_t i = 0; i < COUNT; i++) {
    const size_t j = COUNT - 1 - i;
    weights[i] = s->w[j];
    memcpy(moved + i * s->n, s->y + j * s->n, s->n * sizeof(double));
    memcpy(r.g + i * s->n, s->g + j * s->n, s->n * sizeof(double));
  }
  other = product(&r, k, 2, moved, weights, 1e-5);
  double largest = 0, norm = 0;
  for (size_t i = 0; i < COUNT; i++)
    largest = fmax(largest, fabs(other[COUNT - 1 - i] - one[i])), norm = fmax(norm, fabs(one[i]));
  T_RATIO(largest, 1e-12 * norm, "%u-D: in the reverse order", s->n);
  free(r.g), free(other), free(one), free(moved), free(weights);
}

static void test_share(void) {
  batten_fmm_options o = options(1e-5, 0);
  batten_fmm *a = NULL, *b = NULL;
  double *u = malloc(COUNT * sizeof *u);
  T_OK(batten_fmm_create(ctx, &biharmonic, COUNT, space.y, COUNT, NULL, &o, &a), ctx);
  T_OK(batten_fmm_apply(ctx, a, space.w, NULL, u, NULL), ctx);
  o.share = a;
  batten_context *other = t_context(NULL, NULL, 1);
  T_STATUS(batten_fmm_create(other, &biharmonic, COUNT, space.y, COUNT, NULL, &o, &b), BATTEN_E_INVALID, other,
           "opt.share: a plan of another context");
  batten_context_free(other);
  T_OK(batten_fmm_create(ctx, &biharmonic, COUNT, space.y, COUNT, NULL, &o, &b), ctx);
  const batten_fmm_info i = batten_fmm_get_info(a), j = batten_fmm_get_info(b);
  batten_fmm_free(a);
  T_OK(batten_fmm_apply(ctx, b, space.w, NULL, space.u, NULL), ctx);
  T_CHECK(!memcmp(u, space.u, COUNT * sizeof *u), "shared operators give the same bits, after their maker is gone");
  T_CHECK(i.time_operators_s > 0 && j.time_operators_s == 0 && i.rank == j.rank, "and take no time");
  batten_fmm_free(b);
  free(u);
}

/* Each inner loop of each instruction set against that of the widest. */
static void test_same_bits(void) {
  enum { ORDER = 7, FULL = 343, TERMS = 75, DEPTH = 31, OUT = 4096 };
  static double first[OUT], other[OUT], numbers[7 * TERMS], *terms[7], panel[DEPTH * FMM_PANEL],
      b[FMM_COLUMNS * DEPTH], scratch[8 * 49];
  uint64_t seed = 4;
  size_t sets = 0, differ = 0;
  for (size_t i = 0; i < 7 * TERMS; i++) numbers[i] = 2 * t_uniform(&seed) - 1;
  for (size_t a = 0; a < 7; a++) terms[a] = numbers + a * TERMS;
  for (size_t i = 0; i < sizeof panel / sizeof *panel; i++) panel[i] = 2 * t_uniform(&seed) - 1;
  for (size_t i = 0; i < sizeof b / sizeof *b; i++) b[i] = 2 * t_uniform(&seed) - 1;
  const fmm_terms t = {{terms[0], terms[1], terms[2]}, terms[3], {terms[4], terms[5], terms[6]}};
  const fmm_frame frame = {{0, 0, 0}, 1};
  for (const fmm_lanes *l; (l = batten_fmm_lanes_at((unsigned)sets)); sets++) {
    double *out = sets ? other : first, x[3][FMM_LANES], sums[FMM_SUMS][FMM_LANES];
    size_t used = 0;
    memset(out, 0, sizeof first);
    for (unsigned a = 0; a < 3; a++)
      for (size_t i = 0; i < FMM_LANES; i++) x[a][i] = terms[a][3 * i + 1] * 0.9;
    x[0][2] = terms[0][5], x[1][2] = terms[1][5], x[2][2] = terms[2][5];
    for (unsigned n = 2; n <= 3; n++)
      for (unsigned power = 1; power <= 7; power++)
        for (int kind = 0; kind < 4; kind++) {
          memset(sums, 0, sizeof sums);
          l->near(n, power, kind & 1, kind >> 1)(&t, 3, TERMS, (const double(*)[FMM_LANES])x, sums);
          memcpy(out + used, sums, sizeof sums);
          used += sizeof sums / sizeof(double);
        }
    l->tile(DEPTH, panel, b, DEPTH, out + used, FMM_PANEL), used += FMM_COLUMNS * FMM_PANEL;
    l->moments(3, ORDER, &frame, 1, &t, 0, TERMS, out + used, scratch), used += FULL;
    l->combine(DEPTH, FMM_PANEL, panel, b, out + used), used += FMM_PANEL;
    l->contract(5, 5, (const double(*)[FMM_ORDER_MAX])panel, b, out + used), used += 25;
    memset(sums, 0, sizeof sums);
    l->evaluate(3, 6, &frame, 1, panel, (const double(*)[FMM_LANES])x, sums);
    memcpy(out + used, sums, sizeof sums), used += sizeof sums / sizeof(double);
    if (sets) differ += memcmp(first, other, sizeof first) != 0;
    if (used > OUT) t_line(false, "%zu numbers, room for %d", used, OUT);
  }
  T_CHECK(differ == 0, "%zu instruction sets give the same bits", sets);
}

/* What is told before is not far from what is taken. */
static void test_bytes(void) {
  static const struct {
    fmm_place place;
    batten_radial kernel;
    double accuracy;
    bool derivatives;
  } cases[] = {{PLACE_VOLUME, {3, 1, 0}, 1e-6, false},  {PLACE_SURFACE, {3, 1, 0}, 1e-6, false},
               {PLACE_SURFACE, {3, 1, 0}, 1e-3, false}, {PLACE_SURFACE, {3, 3, 0}, 1e-8, false},
               {PLACE_VOLUME, {3, 5, 0}, 1e-6, true},   {PLACE_VOLUME, {2, 2, 1}, 1e-6, false},
               {PLACE_SURFACE, {2, 2, 1}, 1e-6, false}, {PLACE_VOLUME, {2, 1, 0}, 1e-11, false},
               {PLACE_VOLUME, {2, 4, 1}, 1e-12, true},  {PLACE_VOLUME, {2, 7, 0}, 1e-9, false}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    const size_t count = 40000;
    const batten_radial *k = &cases[i].kernel;
    fmm_scene s = fmm_scene_new(cases[i].place, k->n, count, 0, 1);
    batten_fmm_options o = options(cases[i].accuracy, 0);
    o.gradients = o.dipoles = cases[i].derivatives;
    batten_fmm *f = NULL;
    const size_t told = batten_fmm_bytes(k, count, count, &o), before = batten_bytes_in_use(ctx);
    batten_bytes_peak_reset(ctx);
    T_OK(batten_fmm_create(ctx, k, count, s.y, count, NULL, &o, &f), ctx);
    T_OK(batten_fmm_apply(ctx, f, s.w, o.dipoles ? s.g : NULL, s.u, o.gradients ? s.du : NULL), ctx);
    const double peak = (double)(batten_bytes_peak(ctx) - before);
    T_CHECK(peak <= (double)told && (double)told < 4 * peak, "%u-D, r^%d, %g: %.3g bytes taken, %.3g told", s.n,
            k->power, cases[i].accuracy, peak, (double)told);
    batten_fmm_free(f);
    fmm_scene_free(&s);
  }
  T_CHECK(batten_fmm_bytes(&biharmonic, SIZE_MAX / 4, 1, NULL) == SIZE_MAX, "too many bytes are SIZE_MAX");
}

int main(void) {
  ctx = t_context(NULL, NULL, 2);
  plane = fmm_scene_new(PLACE_VOLUME, 2, COUNT, 0, 1);
  space = fmm_scene_new(PLACE_VOLUME, 3, COUNT, 0, 2);
  test_bad_input();
  test_same_bits();
  test_share();
  test_bytes();
  test_invariances(&plane, &thin_plate);
  test_invariances(&plane, &(batten_radial){2, 3, 0});
  test_invariances(&space, &biharmonic);
  t_fail_every_allocation("a plan and a product", whole_life, NULL);
  t_cancel_every_progress("a plan and a product", whole_life, NULL);
  fmm_scene_free(&plane);
  fmm_scene_free(&space);
  batten_context_free(ctx);
  return t_done();
}
