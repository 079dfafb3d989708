/* Evaluators of fast multipole sums: against sums in long double, and bits that no batch, order, number of threads,
 * memory or earlier batch changes. */
#include "fmm_scene.h"

static batten_context *ctx;
static const batten_radial thin_plate = {2, 2, 1}, biharmonic = {3, 1, 0};

static batten_fmm_options options(double accuracy, bool gradients, bool dipoles) {
  batten_fmm_options o = batten_fmm_options_default();
  o.accuracy = accuracy;
  o.gradients = gradients, o.dipoles = dipoles;
  return o;
}

/* A plan whose operators are used again: making them is most of the work here. */
static batten_fmm *shared;

static void share(const batten_radial *k, double accuracy, bool derivatives) {
  fmm_scene s = fmm_scene_new(PLACE_VOLUME, k->n, 12000, 0, 1);
  const batten_fmm_options o = options(accuracy, derivatives, derivatives);
  batten_fmm_free(shared);
  shared = NULL;
  T_OK(batten_fmm_create(ctx, k, s.sources, s.y, s.sources, NULL, &o, &shared), ctx);
  T_CHECK(shared && !batten_fmm_get_info(shared).direct, "it has operators");
  fmm_scene_free(&s);
}

/* `derivatives`: gradients of sums with dipoles. */
static batten_fmm_evaluator *make(batten_context *c, const batten_radial *k, const fmm_scene *s, double accuracy,
                                  bool derivatives) {
  batten_fmm_options o = options(accuracy, derivatives, derivatives);
  batten_fmm_evaluator *e = NULL;
  if (c == ctx) o.share = shared;
  if (batten_fmm_evaluator_new(c, k, s->sources, s->y, s->w, derivatives ? s->g : NULL, &o, &e) < 0)
    T_CHECK(false, "an evaluator is made: %s", batten_error(c));
  return e;
}

/* ---- accuracy ---- */

/* Targets are moved by `shift` and stretched by `stretch` about the origin. */
static void check(fmm_place place, const batten_radial *k, size_t sources, size_t targets, double accuracy,
                  bool derivatives, double stretch, double shift, double slack) {
  fmm_scene s = fmm_scene_new(place, k->n, sources, targets, 5);
  for (size_t i = 0; i < s.targets * s.n; i++) s.x[i] = stretch * s.x[i] + (i % s.n == 0 ? shift : 0);
  batten_fmm_evaluator *e = make(ctx, k, &s, accuracy, derivatives);
  double value, gradient;
  if (!e) return;
  T_OK(batten_fmm_evaluator_evaluate(ctx, e, s.targets, s.x, s.u, derivatives ? s.du : NULL), ctx);
  scene_errors(&s, k, derivatives, s.targets / 60 + 1, &value, &gradient);
  const batten_fmm_evaluator_info i = batten_fmm_evaluator_get_info(e);
  printf("# order %u, rank %zu, %u levels, %zu cells, %zu nodes, %zu translations, %.3f s\n", i.order, i.rank,
         i.levels, i.cells, i.nodes, i.translations, i.time_evaluate_s);
  char what[160];
  snprintf(what, sizeof what, "%s, r^%d%s in %u-D, %zu to %zu, %g%s, times %g plus %g", place_names[place], k->power,
           k->logarithm ? " ln r" : "", k->n, sources, s.targets, accuracy, derivatives ? ", derivatives" : "",
           stretch, shift);
  T_CHECK(!i.direct, "%s is not summed directly", what);
  T_RATIO(value, slack * accuracy, "%s: values", what);
  if (derivatives) T_RATIO(gradient, 30 * slack * accuracy, "%s: gradients", what);
  batten_fmm_evaluator_free(e);
  fmm_scene_free(&s);
}

static void test_kernels(void) {
  /* The inner loops of all kernels are those of plans (test_fmm.c); here both dimensions, with and without logarithm.
   */
  static const batten_radial kernels[] = {{2, 1, 0}, {2, 6, 1}, {2, 7, 0}, {3, 2, 1}, {3, 5, 0}, {3, 7, 0}};
  for (size_t i = 0; i < sizeof kernels / sizeof *kernels; i++)
    check(PLACE_VOLUME, &kernels[i], 6000, 3000, 1e-3, true, 1, 0, 1);
  check(PLACE_VOLUME, &thin_plate, 10000, 3000, 1e-9, true, 1, 0, 1);
  share(&(batten_radial){3, 3, 0}, 1e-5, true);
  check(PLACE_SURFACE, &(batten_radial){3, 3, 0}, 12000, 3000, 1e-5, true, 1.01, 0, 1);
  check(PLACE_SURFACE, &(batten_radial){3, 3, 0}, 6000, 0, 1e-5, true, 1, 0, 1); /* targets on the sources */
}

static void test_places(void) {
  share(&biharmonic, 1e-4, false);
  for (fmm_place p = 0; p < PLACES; p++) /* graded points lie in the corners of their cells, all of them */
    check(p, &biharmonic, 8000, 2000, 1e-4, false, 1, 0, p == PLACE_GRADED ? 30 : 2);
  check(PLACE_VOLUME, &biharmonic, 8000, 2000, 1e-4, false, 1000, 1e9, 2); /* so far that the sources are a point */
  share(&biharmonic, 1e-4, true);
  check(PLACE_SURFACE, &biharmonic, 12000, 4000, 1e-4, true, 8, 0, 2); /* half of the targets outside */
  check(PLACE_VOLUME, &biharmonic, 12000, 2000, 1e-4, true, 1, 7, 2);  /* all of them */
  share(&thin_plate, 1e-6, true);
  for (fmm_place p = 0; p < PLACES; p++)
    if (p !=
        PLACE_GRADED) /* third derivatives would be those of its nearest pair, 1e-90 apart: that is no distance */
      check(p, &thin_plate, 5000, 2000, 1e-6, true, 1, 0, 2);
  check(PLACE_VOLUME, &thin_plate, 8000, 4000, 1e-6, true, 8, 0, 2);
  batten_fmm_free(shared);
  shared = NULL;
}

/* ---- bits ---- */

enum { COUNT = 6000, ASKED = 3000 };
static const double BITS_AT = 1e-3;

/* Points near, inside, and far outside of the sources' root. */
static fmm_scene scattered(const batten_radial *k) {
  fmm_scene s = fmm_scene_new(PLACE_UNEVEN, k->n, COUNT, ASKED, 8);
  for (size_t i = 0; i < ASKED; i += 3)
    for (unsigned a = 0; a < k->n; a++) s.x[i * k->n + a] *= i % 2 ? 30 : 1.2;
  return s;
}

static double *results(void) { return calloc(ASKED * 4, sizeof(double)); }

static void ask(batten_context *c, batten_fmm_evaluator *e, const fmm_scene *s, double *out) {
  T_OK(batten_fmm_evaluator_evaluate(c, e, ASKED, s->x, out, out + ASKED), c);
}

static bool same(const fmm_scene *s, const double *a, const double *b) {
  return !memcmp(a, b, ASKED * (1 + s->n) * sizeof *a);
}

static void test_bits(const batten_radial *k) {
  share(k, BITS_AT, true);
  fmm_scene s = scattered(k);
  const unsigned n = k->n;
  double *one = results(), *other = results();
  batten_fmm_evaluator *e = make(ctx, k, &s, BITS_AT, true);
  ask(ctx, e, &s, one);
  const size_t made = batten_fmm_evaluator_get_info(e).translations;
  ask(ctx, e, &s, other);
  T_CHECK(same(&s, one, other), "%u-D: the same bits when asked again", n);
  T_CHECK(made > 0 && batten_fmm_evaluator_get_info(e).translations == made, "and nothing is made anew");
  T_OK(batten_fmm_evaluator_evaluate(ctx, e, ASKED, s.x, other, NULL), ctx);
  T_CHECK(!memcmp(one, other, ASKED * sizeof *one), "%u-D: the same values without gradients", n);
  batten_fmm_evaluator_free(e);

  e = make(ctx, k, &s, BITS_AT, true); /* the last first, in batches of 1, 2, 4, 8 ... and back to 1 */
  memset(other, 0, ASKED * 4 * sizeof *other);
  for (size_t left = ASKED, size = 1; left > 0; size = size < 600 ? 2 * size : 1) {
    const size_t now = size < left ? size : left;
    left -= now;
    if (batten_fmm_evaluator_evaluate(ctx, e, now, s.x + left * n, other + left, other + ASKED + left * n) < 0) break;
  }
  T_CHECK(same(&s, one, other), "%u-D: the same bits in small batches from the end", n);
  batten_fmm_evaluator_free(e);

  fmm_scene t = scattered(k); /* shuffled: point i is 1009 i mod ASKED */
  for (size_t i = 0; i < ASKED; i++) memcpy(t.x + i * n, s.x + 1009 * i % ASKED * n, n * sizeof(double));
  e = make(ctx, k, &s, BITS_AT, true);
  ask(ctx, e, &t, other);
  size_t differ = 0;
  for (size_t i = 0; i < ASKED; i++) {
    const size_t j = 1009 * i % ASKED;
    differ += memcmp(other + i, one + j, sizeof *one) ||
              memcmp(other + ASKED + i * n, one + ASKED + j * n, n * sizeof *one);
  }
  T_CHECK(differ == 0, "%u-D: the same bits in another order (%zu differ)", n, differ);
  batten_fmm_evaluator_free(e);

  for (unsigned threads = 1; threads <= 5; threads += 4) {
    batten_context *c = t_context(NULL, NULL, threads);
    e = make(c, k, &s, BITS_AT, true);
    ask(c, e, &s, other);
    T_CHECK(same(&s, one, other), "%u-D: the same bits by %u threads", n, threads);
    const size_t told = batten_fmm_evaluator_get_info(e).bytes, held = batten_bytes_in_use(c);
    T_CHECK(told == held, "%u-D: %zu bytes are told, %zu held", n, told, held);
    batten_fmm_evaluator_free(e);
    batten_context_free(c);
  }
  fmm_scene_free(&s), fmm_scene_free(&t);
  free(one), free(other);
}

/* ---- memory ---- */

/* Little room for nodes, by the option or by the context: they are dropped, and the bits are the same. */
static void test_drops(const batten_radial *k) {
  fmm_scene s = scattered(k);
  double *one = results(), *other = results();
  batten_fmm_evaluator *e = make(ctx, k, &s, BITS_AT, true);
  ask(ctx, e, &s, one);
  const batten_fmm_evaluator_info all = batten_fmm_evaluator_get_info(e);
  T_CHECK(all.drops == 0, "all fits: nothing is dropped");
  batten_fmm_evaluator_free(e);
  for (size_t part = 2; part <= 32; part *= 4) {
    batten_fmm_options o = options(BITS_AT, true, true);
    o.share = shared;
    o.cache_bytes = part == 32 ? 0 : all.nodes * all.order * all.order * sizeof(double) / part;
    e = NULL;
    T_OK(batten_fmm_evaluator_new(ctx, k, s.sources, s.y, s.w, s.g, &o, &e), ctx);
    memset(other, 0, ASKED * 4 * sizeof *other);
    ask(ctx, e, &s, other);
    const batten_fmm_evaluator_info i = batten_fmm_evaluator_get_info(e);
    T_CHECK(same(&s, one, other), "%u-D: the same bits with %zu bytes for nodes", k->n, o.cache_bytes);
    T_CHECK(i.drops > 0 && i.nodes < all.nodes, "nodes are dropped, %zu times", i.drops);
    T_CHECK(!strcmp(batten_error(ctx), ""), "of which no error tells: \"%s\"", batten_error(ctx));
    batten_fmm_evaluator_free(e);
  }
  fmm_scene_free(&s);
  free(one), free(other);
}

/* A host that has so many bytes, and no more. */
typedef struct budget {
  size_t held, most, limit; /* 0: none */
} budget;

static void *budget_allocate(void *user, size_t bytes) {
  budget *b = user;
  if (b->limit && b->held + bytes > b->limit) return NULL;
  size_t *block = malloc(bytes + 64);
  if (!block) return NULL;
  *block = bytes;
  b->held += bytes;
  if (b->held > b->most) b->most = b->held;
  return block + 8;
}

static void budget_release(void *user, void *block) {
  size_t *start = (size_t *)block - 8;
  ((budget *)user)->held -= *start;
  free(start);
}

/* Hosts with less and less memory for batches: the same bits, or none. */
static void test_limits(void) {
  enum { FEW = 2000, HOSTS = 12 };
  fmm_scene s = fmm_scene_new(PLACE_VOLUME, 2, 10000, FEW, 8);
  double *right = malloc(FEW * sizeof *right), *u = malloc(FEW * sizeof *u);
  size_t drops = 0, refused = 0, wrong = 0, taken = 0;
  for (size_t host = 0; host < HOSTS; host++) {
    budget memory = {0, 0, 0};
    batten_context_options co = batten_context_options_default();
    co.allocate = budget_allocate, co.release = budget_release, co.memory_user = &memory;
    batten_context *c = NULL;
    if (batten_context_new(&co, &c) < 0) return;
    batten_fmm_evaluator *e = make(c, &thin_plate, &s, 1e-5, false);
    const size_t held = memory.most = memory.held;
    if (host) memory.limit = held + taken / HOSTS * (HOSTS - host);
    u[FEW - 1] = -7;
    const batten_status st = batten_fmm_evaluator_evaluate(c, e, FEW, s.x, u, NULL);
    if (host == 0) memcpy(right, u, FEW * sizeof *u), taken = memory.most - held;
    refused += st == BATTEN_E_NOMEM;
    wrong += st < 0 ? st != BATTEN_E_NOMEM || u[FEW - 1] != -7 : memcmp(u, right, FEW * sizeof *u) != 0;
    if (st >= 0) drops += batten_fmm_evaluator_get_info(e).drops;
    batten_fmm_evaluator_free(e);
    batten_context_free(c);
  }
  T_CHECK(wrong == 0 && drops > 0, "%d hosts with less and less than %zu bytes: %zu wrong, %zu refused, %zu drops",
          HOSTS, taken, wrong, refused, drops);
  fmm_scene_free(&s);
  free(right), free(u);
}

/* Each allocation of a batch fails, once: it is done all the same, or it is not and leaves the results as they were;
 * the next batch is right in any case. */
static void test_batch_without_memory(void) {
  enum { FEW = 400 };
  fmm_scene s = fmm_scene_new(PLACE_VOLUME, 2, 4000, FEW, 8);
  double right[3 * FEW], u[3 * FEW];
  size_t k = 0, failed = 0, wrong = 0, allocations = 1;
  for (; k <= allocations; k++) {
    t_memory memory = {0};
    batten_context *c = t_context(&memory, NULL, 1);
    batten_fmm_evaluator *e = make(c, &thin_plate, &s, 1e-4, true);
    memory.fail_at = k ? memory.calls + k : 0;
    const size_t before = memory.calls;
    for (size_t i = 0; i < 3 * FEW; i++) u[i] = -7;
    const batten_status st = batten_fmm_evaluator_evaluate(c, e, FEW, s.x, u, u + FEW);
    if (k == 0) memcpy(right, u, sizeof u), allocations = memory.calls - before;
    failed += st < 0;
    if (st < 0) wrong += st != BATTEN_E_NOMEM || u[0] != -7 || u[3 * FEW - 1] != -7;
    if (st >= 0) wrong += memcmp(u, right, sizeof u) != 0;
    memory.fail_at = 0;
    wrong += batten_fmm_evaluator_evaluate(c, e, FEW, s.x, u, u + FEW) < 0 || memcmp(u, right, sizeof u) != 0;
    batten_fmm_evaluator_free(e);
    wrong += batten_bytes_in_use(c) != 0;
    batten_context_free(c);
  }
  T_CHECK(wrong == 0, "a batch with each of its %zu allocations failing: %zu wrong, %zu failed", allocations, wrong,
          failed);
  fmm_scene_free(&s);
}

static batten_status whole_life(batten_context *c, void *arg) {
  const fmm_scene *s = arg;
  const batten_fmm_options o = options(1e-3, true, true);
  batten_fmm_evaluator *e = NULL;
  batten_status st = batten_fmm_evaluator_new(c, &thin_plate, s->sources, s->y, s->w, s->g, &o, &e);
  if (st >= 0 && batten_fmm_evaluator_get_info(e).direct) st = BATTEN_E_INTERNAL;
  if (st >= 0) st = batten_fmm_evaluator_evaluate(c, e, s->targets, s->x, s->u, s->du);
  if (st == BATTEN_E_CANCELLED && e) { /* the host changes its mind */
    const batten_status again = batten_fmm_evaluator_evaluate(c, e, s->targets, s->x, s->u, s->du);
    if (again < 0) st = again;
  }
  batten_fmm_evaluator_free(e);
  return st;
}

/* Cancelled at any place, what was kept is whole: the next batch gives the right bits. */
static void test_cancel(void) {
  fmm_scene s = fmm_scene_new(PLACE_VOLUME, 2, 4000, 2000, 8);
  double *right = malloc(2000 * sizeof *right), *u = malloc(2000 * sizeof *u);
  size_t wrong = 0, cancelled = 0;
  batten_status st = BATTEN_E_CANCELLED;
  batten_fmm_evaluator *e = make(ctx, &thin_plate, &s, 1e-4, false);
  T_OK(batten_fmm_evaluator_evaluate(ctx, e, 2000, s.x, right, NULL), ctx);
  batten_fmm_evaluator_free(e);
  for (size_t k = 1; st == BATTEN_E_CANCELLED && k < 1000; k++) {
    t_progress progress = {0};
    batten_context *c = t_context(NULL, &progress, 2);
    e = make(c, &thin_plate, &s, 1e-4, false);
    progress.cancel_at = progress.calls + k;
    u[0] = -7;
    st = batten_fmm_evaluator_evaluate(c, e, 2000, s.x, u, NULL);
    wrong += st < 0 && (st != BATTEN_E_CANCELLED || u[0] != -7);
    cancelled += st < 0;
    progress.cancel_at = 0;
    wrong += batten_fmm_evaluator_evaluate(c, e, 2000, s.x, u, NULL) < 0 || memcmp(u, right, 2000 * sizeof *u) != 0;
    batten_fmm_evaluator_free(e);
    batten_context_free(c);
  }
  T_CHECK(wrong == 0 && cancelled > 1 && st >= 0, "cancelled at each of %zu places: %zu wrong", cancelled, wrong);
  fmm_scene_free(&s);
  free(right), free(u);
}

/* ---- few sources, sharing, bad input ---- */

static void test_few(void) {
  for (size_t count = 0; count <= 500; count += 250) {
    fmm_scene s = fmm_scene_new(PLACE_VOLUME, 3, count, 300, 8);
    double value, gradient, *u = malloc(300 * sizeof *u);
    batten_fmm_evaluator *e = make(ctx, &(batten_radial){3, 3, 0}, &s, 1e-6, true);
    T_OK(batten_fmm_evaluator_evaluate(ctx, e, 300, s.x, s.u, s.du), ctx);
    scene_errors(&s, &(batten_radial){3, 3, 0}, true, 1, &value, &gradient);
    T_CHECK(batten_fmm_evaluator_get_info(e).direct, "%zu sources are summed directly", count);
    if (count) T_RATIO(value + gradient, 1e-13, "and exactly");
    if (!count) T_CHECK(s.u[0] == 0 && s.du[899] == 0, "no sources: 0");
    for (size_t i = 0; i < 300; i++)
      if (batten_fmm_evaluator_evaluate(ctx, e, 1, s.x + 3 * i, u + i, NULL) < 0) u[i] = NAN;
    T_CHECK(!memcmp(u, s.u, 300 * sizeof *u), "one at a time: the same bits");
    batten_fmm_evaluator_free(e);
    fmm_scene_free(&s);
    free(u);
  }
}

/* Equal sources: one cell that nothing can cut. */
static void test_equal_sources(void) {
  enum { MANY = 6000 };
  double *y = malloc(MANY * 3 * sizeof *y), *w = malloc(MANY * sizeof *w), u[3], du[9];
  const double x[9] = {1, 2, 3, 1, 2, 7, 1e9, 2, 3};
  for (size_t i = 0; i < MANY; i++) y[3 * i] = 1, y[3 * i + 1] = 2, y[3 * i + 2] = 3, w[i] = i % 2 ? 3 : -1;
  const batten_fmm_options o = options(1e-6, true, false);
  batten_fmm_evaluator *e = NULL;
  T_OK(batten_fmm_evaluator_new(ctx, &biharmonic, MANY, y, w, NULL, &o, &e), ctx);
  T_OK(batten_fmm_evaluator_evaluate(ctx, e, 3, x, u, du), ctx);
  T_CHECK(u[0] == 0 && du[0] == 0 && du[2] == 0, "equal sources, the target on them: 0");
  T_RATIO(fabs(u[1] / (4.0 * MANY) - 1) + fabs(du[5] / MANY - 1), 1e-14, "four away");
  T_RATIO(fabs(u[2] / ((1e9 - 1) * MANY) - 1) + fabs(du[6] / MANY - 1), 1e-14, "far away");
  batten_fmm_evaluator_free(e);
  free(y), free(w);
}

static void test_share(void) {
  batten_fmm_free(shared);
  shared = NULL;
  fmm_scene s = fmm_scene_new(PLACE_VOLUME, 2, 8000, 0, 8);
  batten_fmm_options o = options(1e-6, true, true);
  batten_fmm *plan = NULL;
  batten_fmm_evaluator *e = NULL, *own = make(ctx, &thin_plate, &s, 1e-6, true);
  double *u = malloc(8000 * sizeof *u);
  T_OK(batten_fmm_create(ctx, &thin_plate, s.sources, s.y, s.targets, NULL, &o, &plan), ctx);
  o.share = plan;
  T_OK(batten_fmm_evaluator_new(ctx, &thin_plate, s.sources, s.y, s.w, s.g, &o, &e), ctx);
  batten_fmm_free(plan);
  T_CHECK(batten_fmm_evaluator_get_info(own).time_operators_s > 0, "operators take time");
  T_CHECK(batten_fmm_evaluator_get_info(e).time_operators_s == 0, "shared ones do not");
  T_OK(batten_fmm_evaluator_evaluate(ctx, e, 8000, s.x, s.u, NULL), ctx);
  T_OK(batten_fmm_evaluator_evaluate(ctx, own, 8000, s.x, u, NULL), ctx);
  T_CHECK(!memcmp(u, s.u, 8000 * sizeof *u), "and give the same bits");
  batten_fmm_evaluator_free(e), batten_fmm_evaluator_free(own);
  fmm_scene_free(&s);
  free(u);
}

static void test_bad_input(void) {
  double x[6] = {0, 0, 1, 1, 2, 2}, w[3] = {1, 2, 3}, u[3] = {-7, -7, -7};
  batten_fmm_evaluator *e = NULL;
  batten_fmm_options o = options(1e-6, false, false);
#define NEW(k, y, weights, dipoles) batten_fmm_evaluator_new(ctx, k, 3, y, weights, dipoles, &o, &e)
  T_STATUS(NEW(NULL, x, w, NULL), BATTEN_E_INVALID, ctx, "kernel: NULL");
  T_STATUS(batten_fmm_evaluator_new(ctx, &thin_plate, 3, x, w, NULL, &o, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_STATUS(NEW((&(batten_radial){2, 2, 0}), x, w, NULL), BATTEN_E_INVALID, ctx, "kernel.power: 2");
  T_STATUS(NEW(&thin_plate, NULL, w, NULL), BATTEN_E_INVALID, ctx, "sources: NULL with 3 points");
  T_STATUS(NEW(&thin_plate, x, w, x), BATTEN_E_INVALID, ctx, "dipoles: given with opt.dipoles = 0");
  o.dipoles = 1;
  T_STATUS(NEW(&thin_plate, x, w, NULL), BATTEN_E_INVALID, ctx, "dipoles: NULL with opt.dipoles");
  o.dipoles = 0;
  o.accuracy = 1;
  T_STATUS(NEW(&thin_plate, x, w, NULL), BATTEN_E_INVALID, ctx, "opt.accuracy: 1; must be 1e-12 .. 1e-3");
  o.accuracy = 1e-6;
  w[1] = NAN;
  T_STATUS(NEW(&thin_plate, x, w, NULL), BATTEN_E_INVALID, ctx, "weights[1]: nan; must be finite");
  w[1] = 2, x[3] = INFINITY;
  T_STATUS(NEW(&thin_plate, x, w, NULL), BATTEN_E_INVALID, ctx, "sources[1][1]: inf");
  x[3] = 1;
  T_CHECK(e == NULL, "out is untouched");
  T_OK(NEW(&thin_plate, x, w, NULL), ctx);
  T_STATUS(batten_fmm_evaluator_evaluate(ctx, NULL, 3, x, u, NULL), BATTEN_E_INVALID, ctx, "e: NULL");
  T_STATUS(batten_fmm_evaluator_evaluate(ctx, e, 3, NULL, u, NULL), BATTEN_E_INVALID, ctx, "points: NULL with 3");
  T_STATUS(batten_fmm_evaluator_evaluate(ctx, e, 3, x, u, x), BATTEN_E_INVALID, ctx,
           "gradients: asked of an evaluator");
  x[4] = NAN;
  T_STATUS(batten_fmm_evaluator_evaluate(ctx, e, 3, x, u, NULL), BATTEN_E_INVALID, ctx, "points[2][0]: nan");
  x[4] = 1e30;
  T_STATUS(batten_fmm_evaluator_evaluate(ctx, e, 3, x, u, NULL), BATTEN_E_INVALID, ctx, "points[2][0]: 1e+30");
  T_CHECK(u[0] == -7 && u[2] == -7, "values are untouched");
  batten_context *other = t_context(NULL, NULL, 1);
  T_STATUS(batten_fmm_evaluator_evaluate(other, e, 0, NULL, NULL, NULL), BATTEN_E_INVALID, other,
           "e: made with another context");
  batten_context_free(other);
  T_OK(batten_fmm_evaluator_evaluate(ctx, e, 0, NULL, NULL, NULL), ctx);
  T_OK(batten_fmm_evaluator_evaluate(ctx, e, 2, x, NULL, NULL), ctx);
  batten_fmm_evaluator_free(e);
  batten_fmm_evaluator_free(NULL);
}

int main(void) {
  ctx = t_context(NULL, NULL, 2);
  test_kernels();
  test_places();
  test_bits(&thin_plate);
  test_drops(&thin_plate);
  test_bits(&biharmonic);
  test_drops(&biharmonic);
  test_share();
  test_limits();
  test_batch_without_memory();
  test_cancel();
  test_few();
  test_equal_sources();
  test_bad_input();
  fmm_scene s = fmm_scene_new(PLACE_VOLUME, 2, 4000, 1000, 8);
  t_fail_every_allocation("an evaluator and a batch", whole_life, &s);
  t_cancel_every_progress("an evaluator and a batch", whole_life, &s);
  fmm_scene_free(&s);
  batten_context_free(ctx);
  return t_done();
}
