/* Saddle systems: bad input, singular systems, memory predicted and refused, failing allocations, cancel. */
#include "saddle_scene.h"

static batten_status factor(batten_context *ctx, const batten_saddle_matrix *m, batten_saddle_method method) {
  batten_saddle_options o = batten_saddle_options_default();
  batten_saddle *h = NULL;
  o.method = method;
  batten_status st = batten_saddle_factor(ctx, m, &o, &h);
  if ((st >= 0) != (h != NULL)) t_line(false, "a handle comes with success, and only then");
  batten_saddle_free(h);
  return st;
}

/* Factor and solve. */
static batten_status run(batten_context *ctx, const scene *s, batten_saddle_method method) {
  batten_saddle_matrix m = scene_matrix(s);
  batten_saddle_options o = batten_saddle_options_default();
  batten_saddle *h = NULL;
  double *w = malloc((s->n + s->k) * sizeof *w);
  o.method = method;
  batten_status st = batten_saddle_factor(ctx, &m, &o, &h);
  if (st == BATTEN_OK) st = batten_saddle_solve(ctx, h, s->f, w, w + s->n);
  batten_saddle_free(h);
  free(w);
  return st;
}

static void test_names(void) {
  static const char *const names[] = {"auto", "cholesky", "cholesky-mixed", "ldl", "qr", "iterative"};
  for (int q = 0; q < 6; q++)
    T_CHECK(!strcmp(batten_saddle_method_name((batten_saddle_method)q), names[q]), "name %s", names[q]);
  T_CHECK(!strcmp(batten_saddle_method_name((batten_saddle_method)9), "unknown method"),
          "name of a method that is none");
}

static void test_arguments(batten_context *ctx) {
  scene s = scene_new(SCENE_RANDOM, KERNEL_R, 30, 4, 1);
  batten_saddle_matrix good = scene_matrix(&s), m = good;
  batten_saddle_options o = batten_saddle_options_default(), zero = {0};
  batten_saddle *h = NULL;
  double w[30], c[4];
  T_CHECK(batten_saddle_factor(NULL, &m, NULL, &h) == BATTEN_E_INVALID, "no context");
  T_STATUS(batten_saddle_factor(ctx, NULL, NULL, &h), BATTEN_E_INVALID, ctx, "matrix: NULL");
  T_STATUS(batten_saddle_factor(ctx, &m, NULL, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_STATUS(batten_saddle_factor(ctx, &m, &zero, &h), BATTEN_E_INVALID, ctx, "batten_saddle_options.struct_size: 0");
  o.method = (batten_saddle_method)7;
  T_STATUS(batten_saddle_factor(ctx, &m, &o, &h), BATTEN_E_INVALID, ctx, "opt.method: 7");
  o = batten_saddle_options_default();
  o.residual_tol = 0;
  T_STATUS(batten_saddle_factor(ctx, &m, &o, &h), BATTEN_E_INVALID, ctx, "opt.residual_tol: 0");
  o.residual_tol = NAN;
  T_STATUS(batten_saddle_factor(ctx, &m, &o, &h), BATTEN_E_INVALID, ctx, "opt.residual_tol: nan");
  T_STATUS(factor(ctx, &m, BATTEN_SADDLE_ITERATIVE), BATTEN_E_INVALID, ctx, "matrix.sums: NULL, but opt.method");
  m.p = NULL;
  T_STATUS(factor(ctx, &m, BATTEN_SADDLE_AUTO), BATTEN_E_INVALID, ctx, "matrix.p: NULL with k = 4");
  m = good;
  m.fill = NULL;
  T_STATUS(factor(ctx, &m, BATTEN_SADDLE_AUTO), BATTEN_E_INVALID, ctx, "matrix.fill: NULL");
  m = good;
  m.n = 4;
  T_STATUS(factor(ctx, &m, BATTEN_SADDLE_AUTO), BATTEN_E_INVALID, ctx,
           "matrix.k: 4 columns of P need more than 4 rows");
  m.n = 0;
  T_STATUS(factor(ctx, &m, BATTEN_SADDLE_AUTO), BATTEN_E_INVALID, ctx, "matrix.k: 4");
  for (int q = 0; q < 3; q++) {
    size_t sizes[] = {SIZE_MAX, (size_t)INT32_MAX, SIZE_MAX / 2};
    m.n = sizes[q];
    T_STATUS(factor(ctx, &m, BATTEN_SADDLE_AUTO), BATTEN_E_TOO_LARGE, ctx, "exceed LAPACK's integers");
  }
  T_CHECK(!h, "the result is untouched");
  s.p[2 * s.n + 7] = NAN;
  T_STATUS(factor(ctx, &good, BATTEN_SADDLE_AUTO), BATTEN_E_INVALID, ctx, "matrix.p[2][7]: nan is not finite");
  s.p[2 * s.n + 7] = 0.5;

  T_OK(batten_saddle_factor(ctx, &good, NULL, &h), ctx);
  T_CHECK(batten_saddle_solve(NULL, h, s.f, w, c) == BATTEN_E_INVALID, "no context");
  T_STATUS(batten_saddle_solve(ctx, NULL, s.f, w, c), BATTEN_E_INVALID, ctx, "s: NULL");
  batten_context *other = t_context(NULL, NULL, 1);
  T_STATUS(batten_saddle_solve(other, h, s.f, w, c), BATTEN_E_INVALID, other, "s: made with another context");
  T_STATUS(batten_saddle_inverse_diagonal(other, h, 1, (size_t[]){0}, w), BATTEN_E_INVALID, other,
           "s: made with another context");
  batten_context_free(other);
  T_STATUS(batten_saddle_solve(ctx, h, NULL, w, c), BATTEN_E_INVALID, ctx, "f: NULL");
  T_STATUS(batten_saddle_solve(ctx, h, s.f, NULL, c), BATTEN_E_INVALID, ctx, "w: NULL");
  T_STATUS(batten_saddle_solve(ctx, h, s.f, w, NULL), BATTEN_E_INVALID, ctx, "c: NULL");
  w[0] = 77;
  s.f[11] = INFINITY;
  T_STATUS(batten_saddle_solve(ctx, h, s.f, w, c), BATTEN_E_INVALID, ctx, "f[11]: inf is not finite");
  T_CHECK(w[0] == 77, "w is untouched");
  T_STATUS(batten_saddle_inverse_diagonal(ctx, NULL, 1, (size_t[]){0}, w), BATTEN_E_INVALID, ctx, "s: NULL");
  T_STATUS(batten_saddle_inverse_diagonal(ctx, h, 1, NULL, w), BATTEN_E_INVALID, ctx, "index: NULL");
  T_STATUS(batten_saddle_inverse_diagonal(ctx, h, 1, (size_t[]){0}, NULL), BATTEN_E_INVALID, ctx, "diagonal: NULL");
  batten_saddle_free(h);
  batten_saddle_free(NULL);
  scene_free(&s);
}

/* NaN in K: one point is bad, in each part of the storage. */
static void test_bad_entries(batten_context *ctx) {
  static const size_t where[] = {0, 3, 100, 299};
  for (size_t q = 0; q < 4; q++)
    for (int method = 1; method <= 4; method++) {
      scene s = scene_new(SCENE_RANDOM, KERNEL_R, 300, 1, 2);
      s.x[3 * where[q] + 1] = q % 2 ? NAN : 1e200;
      char part[64];
      batten_saddle_matrix m = scene_matrix(&s);
      snprintf(part, sizeof part, "matrix.fill: entry [");
      batten_status st = factor(ctx, &m, (batten_saddle_method)method);
      size_t row = 0, col = 0;
      int read = sscanf(batten_error(ctx), "matrix.fill: entry [%zu][%zu] is not finite", &row, &col);
      T_CHECK(st == BATTEN_E_INVALID && read == 2 && (row == where[q] || col == where[q]), "bad point %zu by %s: %s",
              where[q], batten_saddle_method_name((batten_saddle_method)method), batten_error(ctx));
      scene_free(&s);
    }
}

static void test_singular(batten_context *ctx) {
  /* Coplanar: z = 1 + x - y. */
  scene s = scene_new(SCENE_RANDOM, KERNEL_R, 100, 4, 3);
  for (size_t i = 0; i < s.n; i++) s.p[i + 3 * s.n] = s.x[3 * i + 2] = 1 + s.x[3 * i] - s.x[3 * i + 1];
  batten_saddle_matrix m = scene_matrix(&s);
  for (int q = 0; q <= 4; q++)
    T_STATUS(factor(ctx, &m, (batten_saddle_method)q), BATTEN_E_SINGULAR, ctx, "depends on the others, rank 3 of 4");
  /* The same far from the origin and in other units: rounding of 1e6 hides nothing. */
  for (size_t i = 0; i < s.n; i++)
    for (size_t d = 0; d < 3; d++) s.p[i + (d + 1) * s.n] = s.x[3 * i + d] * 1e6;
  T_STATUS(factor(ctx, &m, BATTEN_SADDLE_AUTO), BATTEN_E_SINGULAR, ctx, "rank 3 of 4");
  for (size_t i = 0; i < s.n; i++)
    for (size_t d = 0; d < 3; d++) s.p[i + (d + 1) * s.n] = (double)i * (double)(d + 1); /* collinear */
  T_STATUS(factor(ctx, &m, BATTEN_SADDLE_AUTO), BATTEN_E_SINGULAR, ctx, "rank 2 of 4");
  for (size_t i = 0; i < s.n; i++) s.p[i + s.n] = 0;
  T_STATUS(factor(ctx, &m, BATTEN_SADDLE_AUTO), BATTEN_E_SINGULAR, ctx, "matrix.p: column");
  scene_free(&s);

  /* Duplicates, wherever they stand. */
  static const size_t pairs[][2] = {{0, 1}, {2, 90}, {50, 51}, {30, 99}, {4, 5}, {60, 70}, {7, 8}, {98, 99}};
  for (size_t q = 0; q < sizeof pairs / sizeof *pairs; q++)
    for (int method = 0; method <= 4; method++) {
      s = scene_new(SCENE_RANDOM, KERNEL_R, 100, 4, 4 + q);
      char part[64];
      for (size_t d = 0; d < 3; d++) {
        s.x[3 * pairs[q][1] + d] = s.x[3 * pairs[q][0] + d];
        s.p[pairs[q][1] + (d + 1) * s.n] = s.p[pairs[q][0] + (d + 1) * s.n];
      }
      snprintf(part, sizeof part, "rows %zu and %zu", pairs[q][0], pairs[q][1]);
      m = scene_matrix(&s);
      T_STATUS(factor(ctx, &m, (batten_saddle_method)method), BATTEN_E_SINGULAR, ctx, part);
      scene_free(&s);
    }
}

static void test_fallback(batten_context *ctx) {
  double w[200], c[4];
  /* The wrong sign: not definite, but a fine system for LDL'. */
  scene s = scene_new(SCENE_RANDOM, KERNEL_R, 200, 4, 9);
  s.factor = -1;
  batten_saddle_matrix m = scene_matrix(&s);
  for (int method = BATTEN_SADDLE_AUTO; method <= BATTEN_SADDLE_CHOLESKY_MIXED; method++) {
    batten_saddle_options o = batten_saddle_options_default();
    batten_saddle *h = NULL;
    o.method = (batten_saddle_method)method;
    T_OK(batten_saddle_factor(ctx, &m, &o, &h), ctx);
    T_OK(batten_saddle_solve(ctx, h, s.f, w, c), ctx);
    batten_saddle_info info = batten_saddle_get_info(h);
    T_CHECK(info.method == BATTEN_SADDLE_LDL && info.fallbacks == (method == BATTEN_SADDLE_CHOLESKY_MIXED ? 2 : 1),
            "indefinite by %s: %s after %u", batten_saddle_method_name(o.method),
            batten_saddle_method_name(info.method), info.fallbacks);
    T_RATIO(scene_check(&s, w, c).residual, 1.5e-13, "its residual");
    batten_saddle_free(h);
  }
  scene_free(&s);
  /* Too ill-conditioned for float, fine for double. */
  s = scene_new(SCENE_SPHERE, KERNEL_R3, 200, 4, 10);
  m = scene_matrix(&s);
  batten_saddle_options o = batten_saddle_options_default();
  batten_saddle *h = NULL;
  o.method = BATTEN_SADDLE_CHOLESKY_MIXED;
  batten_status st = batten_saddle_factor(ctx, &m, &o, &h);
  batten_saddle_info info = st >= 0 ? batten_saddle_get_info(h) : (batten_saddle_info){0};
  T_CHECK(info.method == BATTEN_SADDLE_CHOLESKY && info.fallbacks == 1,
          "r^3 on a sphere falls from mixed to %s, rcond %.2g", batten_saddle_method_name(info.method), info.rcond);
  /* A tolerance that no double can meet is told, with the best solution. */
  o.residual_tol = 1e-30;
  batten_saddle_free(h);
  h = NULL;
  o.method = BATTEN_SADDLE_CHOLESKY;
  st = batten_saddle_factor(ctx, &m, &o, &h);
  T_STATUS(batten_saddle_solve(ctx, h, s.f, w, c), BATTEN_W_ACCURACY, ctx, "above the tolerance 1e-30");
  T_RATIO(scene_check(&s, w, c).scaled, 30, "its residual over rounding");
  batten_saddle_free(h);
  scene_free(&s);
}

/* A factor that turns out too poor for refinement, made so by changing the matrix under it: the next method takes
 * over within the solve, or, where that has no room, the best solution comes with a warning. */
static void test_stall(void) {
  double w[300], c[4];
  for (int room = 0; room < 2; room++) {
    scene s = scene_new(SCENE_RANDOM, KERNEL_R, 300, 4, 16);
    batten_saddle_matrix m = scene_matrix(&s);
    batten_context_options co = batten_context_options_default();
    batten_context *ctx = NULL;
    /* With the solve's workspace there is room for the float factor alone, or for the double one too. */
    co.memory_limit = batten_saddle_bytes(BATTEN_SADDLE_CHOLESKY_MIXED, 300, 4) + (room ? 10000000 : 0);
    batten_context_new(&co, &ctx);
    batten_saddle_options o = batten_saddle_options_default();
    batten_saddle *h = NULL;
    o.method = BATTEN_SADDLE_CHOLESKY_MIXED;
    T_OK(batten_saddle_factor(ctx, &m, &o, &h), ctx);
    s.nugget = 10;
    if (room) {
      T_OK(batten_saddle_solve(ctx, h, s.f, w, c), ctx);
      T_RATIO(scene_check(&s, w, c).residual, 1.5e-13, "residual after the fall-back within the solve");
    } else {
      T_STATUS(batten_saddle_solve(ctx, h, s.f, w, c), BATTEN_W_ACCURACY, ctx, "above the tolerance");
    }
    batten_saddle_info info = batten_saddle_get_info(h);
    T_CHECK(
        info.method == (room ? BATTEN_SADDLE_CHOLESKY : BATTEN_SADDLE_CHOLESKY_MIXED) && (int)info.fallbacks == room,
        "%s after %u fall-backs, residual %.2g", batten_saddle_method_name(info.method), info.fallbacks,
        info.residual);
    batten_saddle_free(h);
    T_CHECK(batten_bytes_in_use(ctx) == 0, "all memory is given back");
    batten_context_free(ctx);
    scene_free(&s);
  }
}

/* The same with a matrix that has become indefinite: from a stall of either factor down to LDL' within one solve. */
static void test_stall_to_ldl(batten_context *ctx) {
  double w[300], c[4];
  for (int method = BATTEN_SADDLE_CHOLESKY; method <= BATTEN_SADDLE_CHOLESKY_MIXED; method++) {
    scene s = scene_new(SCENE_RANDOM, KERNEL_R, 300, 4, 17);
    batten_saddle_matrix m = scene_matrix(&s);
    batten_saddle_options o = batten_saddle_options_default();
    batten_saddle *h = NULL;
    o.method = (batten_saddle_method)method;
    T_OK(batten_saddle_factor(ctx, &m, &o, &h), ctx);
    s.factor = -1;
    batten_status st = batten_saddle_solve(ctx, h, s.f, w, c);
    batten_saddle_info info = batten_saddle_get_info(h);
    T_CHECK(st >= 0 && info.method == BATTEN_SADDLE_LDL && info.fallbacks == (unsigned)method,
            "from %s a stall leads to %s after %u fall-backs", batten_saddle_method_name(o.method),
            batten_saddle_method_name(info.method), info.fallbacks);
    T_RATIO(scene_check(&s, w, c).scaled, 30, "residual after it over rounding");
    batten_saddle_free(h);
    scene_free(&s);
  }
}

/* The same while allocations fail and the host cancels: the handle stays usable. */
static batten_status stall(batten_context *ctx, void *arg) {
  scene *s = arg;
  double w[40] = {77}, c[4];
  batten_saddle_matrix m = scene_matrix(s);
  batten_saddle_options o = batten_saddle_options_default();
  batten_saddle *h = NULL;
  o.method = BATTEN_SADDLE_CHOLESKY_MIXED;
  s->nugget = 0;
  batten_status st = batten_saddle_factor(ctx, &m, &o, &h);
  if (st < 0) return st;
  s->nugget = 10;
  st = batten_saddle_solve(ctx, h, s->f, w, c);
  if (st < 0) {
    if (w[0] != 77) t_line(false, "w is untouched on failure");
    batten_status again = batten_saddle_solve(ctx, h, s->f, w, c);
    if (again == BATTEN_OK && scene_check(s, w, c).residual > 1.5e-13) t_line(false, "the handle stays usable");
    if (again < 0 && again != st) t_line(false, "second failure: %s", batten_error(ctx));
  }
  batten_saddle_free(h);
  return st;
}

static void test_memory(void) {
  static const size_t sizes[] = {1000, 1001, 1400};
  for (size_t q = 0; q < 3; q++)
    for (int method = 1; method <= (q == 0 ? 4 : 3); method++) {
      scene s = scene_new(SCENE_RANDOM, KERNEL_R, sizes[q], 4, 12);
      for (size_t i = 0; i < s.n; i++) s.f[i] = 1 + 0.3 * s.x[3 * i] * s.x[3 * i + 1];
      batten_context *ctx = t_context(NULL, NULL, 2);
      T_OK(run(ctx, &s, (batten_saddle_method)method), ctx);
      double predicted = (double)batten_saddle_bytes((batten_saddle_method)method, s.n, s.k);
      double peak = (double)batten_bytes_peak(ctx);
      T_CHECK(predicted >= peak, "prediction %.0f covers the peak %.0f", predicted, peak);
      T_RATIO(predicted / peak - 1, 0.05, "N = %zu by %s: prediction over peak", s.n,
              batten_saddle_method_name((batten_saddle_method)method));
      batten_context_free(ctx);

      /* The limit may be exactly the prediction, and not a byte less. */
      batten_context_options o = batten_context_options_default();
      o.memory_limit = (size_t)predicted;
      batten_context_new(&o, &ctx);
      T_OK(run(ctx, &s, (batten_saddle_method)method), ctx);
      batten_context_free(ctx);
      o.memory_limit--;
      batten_context_new(&o, &ctx);
      T_STATUS(run(ctx, &s, (batten_saddle_method)method), BATTEN_E_TOO_LARGE, ctx, "bytes, the context allows");
      T_CHECK(batten_bytes_peak(ctx) < 10000, "refused before anything large is taken: %zu", batten_bytes_peak(ctx));
      batten_context_free(ctx);
      scene_free(&s);
    }

  /* AUTO takes the float factor where the double one does not fit. */
  scene s = scene_new(SCENE_RANDOM, KERNEL_R, 600, 4, 13);
  batten_saddle_matrix m = scene_matrix(&s);
  batten_context_options o = batten_context_options_default();
  batten_context *ctx = NULL;
  batten_saddle *h = NULL;
  o.memory_limit = batten_saddle_bytes(BATTEN_SADDLE_CHOLESKY, 600, 4) - 1;
  batten_context_new(&o, &ctx);
  T_OK(batten_saddle_factor(ctx, &m, NULL, &h), ctx);
  T_CHECK(h && batten_saddle_get_info(h).method == BATTEN_SADDLE_CHOLESKY_MIXED, "auto takes mixed to fit");
  batten_saddle_free(h);
  s.kernel = KERNEL_R3; /* gives up float, and double does not fit */
  T_STATUS(factor(ctx, &m, BATTEN_SADDLE_AUTO), BATTEN_E_TOO_LARGE, ctx, "by cholesky take");
  s.kernel = KERNEL_R; /* a duplicate, and no memory for LDL' */
  for (size_t d = 0; d < 3; d++) {
    s.x[3 * 500 + d] = s.x[3 * 77 + d];
    s.p[500 + (d + 1) * s.n] = s.p[77 + (d + 1) * s.n];
  }
  batten_context_free(ctx);
  o.memory_limit = batten_saddle_bytes(BATTEN_SADDLE_CHOLESKY, 600, 4);
  batten_context_new(&o, &ctx);
  T_STATUS(factor(ctx, &m, BATTEN_SADDLE_AUTO), BATTEN_E_SINGULAR, ctx, "matrix: not positive definite at row 500");
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left behind");
  batten_context_free(ctx);
  scene_free(&s);

  T_RATIO((double)batten_saddle_bytes(BATTEN_SADDLE_CHOLESKY_MIXED, 30000, 4), 2.2e9, "N = 30,000 mixed: bytes");
  T_RATIO((double)batten_saddle_bytes(BATTEN_SADDLE_CHOLESKY_MIXED, 60000, 4), 24e9, "N = 60,000 mixed: bytes");
  T_RATIO((double)batten_saddle_bytes(BATTEN_SADDLE_CHOLESKY, 60000, 4), 24e9, "N = 60,000 double: bytes");
  T_CHECK(batten_saddle_bytes(BATTEN_SADDLE_CHOLESKY, SIZE_MAX, 4) == SIZE_MAX &&
              batten_saddle_bytes(BATTEN_SADDLE_LDL, SIZE_MAX / 4, 4) == SIZE_MAX &&
              batten_saddle_bytes(BATTEN_SADDLE_QR, (size_t)1 << 33, 4) == SIZE_MAX &&
              batten_saddle_bytes(BATTEN_SADDLE_CHOLESKY_MIXED, 3, 4) == SIZE_MAX,
          "sizes that are none predict SIZE_MAX");
}

/* N = 60,000 is accepted on 24 GB: the hook sees the right block asked for, and has no memory. */
typedef struct large_memory {
  size_t largest;
} large_memory;
static void *large_allocate(void *user, size_t bytes) {
  large_memory *m = user;
  if (bytes > m->largest) m->largest = bytes;
  return bytes > 100000000 ? NULL : malloc(bytes);
}
static void large_release(void *user, void *block) {
  (void)user;
  free(block);
}
static void test_accepted(void) {
  scene s = scene_new(SCENE_RANDOM, KERNEL_R, 60000, 4, 14);
  batten_saddle_matrix m = scene_matrix(&s);
  for (int method = 1; method <= 3; method++) {
    large_memory memory = {0};
    batten_context_options o = batten_context_options_default();
    batten_context *ctx = NULL;
    o.allocate = large_allocate;
    o.release = large_release;
    o.memory_user = &memory;
    o.memory_limit = 24000000000u;
    batten_context_new(&o, &ctx);
    if (method == BATTEN_SADDLE_LDL) {
      T_STATUS(factor(ctx, &m, BATTEN_SADDLE_LDL), BATTEN_E_TOO_LARGE, ctx, "60000 rows by ldl take");
    } else {
      T_STATUS(factor(ctx, &m, (batten_saddle_method)method), BATTEN_E_NOMEM, ctx, "out of memory");
      size_t packed = (size_t)59996 * 59997 / 2 * (method == BATTEN_SADDLE_CHOLESKY ? 8 : 4);
      T_CHECK(memory.largest >= packed && memory.largest < packed + 1000,
              "N = 60,000 is accepted: %zu bytes asked for", memory.largest);
    }
    batten_context_free(ctx);
  }
  scene_free(&s);
}

static batten_status everything(batten_context *ctx, void *arg) {
  scene *s = arg;
  double w[40], c[4], d[2];
  batten_status worst = BATTEN_OK;
  for (int method = 1; method <= 4 && worst == BATTEN_OK; method++) {
    batten_saddle_options o = batten_saddle_options_default();
    batten_saddle_matrix m = scene_matrix(s);
    batten_saddle *h = NULL;
    o.method = (batten_saddle_method)method;
    w[0] = 77;
    worst = batten_saddle_factor(ctx, &m, &o, &h);
    if (worst == BATTEN_OK) {
      worst = batten_saddle_solve(ctx, h, s->f, w, c);
      if (worst < 0 && w[0] != 77) t_line(false, "w is untouched on failure");
    }
    if (worst == BATTEN_OK) worst = batten_saddle_inverse_diagonal(ctx, h, 2, (size_t[]){3, 5}, d);
    batten_saddle_free(h);
  }
  return worst;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_names();
  test_arguments(ctx);
  test_bad_entries(ctx);
  test_singular(ctx);
  test_fallback(ctx);
  test_stall();
  test_stall_to_ldl(ctx);
  test_memory();
  test_accepted();
  scene s = scene_new(SCENE_RANDOM, KERNEL_R, 40, 4, 15);
  t_fail_every_allocation("saddle", everything, &s);
  t_cancel_every_progress("saddle", everything, &s);
  t_fail_every_allocation("saddle with a stall", stall, &s);
  t_cancel_every_progress("saddle with a stall", stall, &s);
  s.nugget = 0;
  s.factor = -1; /* through all fall-backs */
  t_fail_every_allocation("saddle with fall-backs", everything, &s);
  t_cancel_every_progress("saddle with fall-backs", everything, &s);
  scene_free(&s);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all memory is given back");
  batten_context_free(ctx);
  return t_done();
}
