/* What happens when a LAPACK routine reports a failure: this program puts its own dpotrf, spotrf, dsytrf before the
 * library's; they forward, and on request say that a pivot failed. */
#define _GNU_SOURCE /* RTLD_NEXT */
#include <dlfcn.h>

#include "la/fortran.h"
#include "saddle_scene.h"

static int fail_float, fail_double, fail_ldl;

typedef void potrf_double(const char *, const batten_la_int *, double *, const batten_la_int *, batten_la_int *,
                          size_t);
typedef void potrf_float(const char *, const batten_la_int *, float *, const batten_la_int *, batten_la_int *,
                         size_t);
typedef void sytrf_double(const char *, const batten_la_int *, double *, const batten_la_int *, batten_la_int *,
                          double *, const batten_la_int *, batten_la_int *, size_t);

static void next(const char *name, void *function, size_t size) {
  void *symbol = dlsym(RTLD_NEXT, name);
  memcpy(function, &symbol, size);
}

void FORTRAN(dpotrf)(const char *uplo, const batten_la_int *n, double *a, const batten_la_int *lda,
                     batten_la_int *info, size_t length) {
  potrf_double *forward;
  next("dpotrf_", &forward, sizeof forward);
  forward(uplo, n, a, lda, info, length);
  if (fail_double) *info = 1;
}

void FORTRAN(spotrf)(const char *uplo, const batten_la_int *n, float *a, const batten_la_int *lda,
                     batten_la_int *info, size_t length) {
  potrf_float *forward;
  next("spotrf_", &forward, sizeof forward);
  forward(uplo, n, a, lda, info, length);
  if (fail_float) *info = 1;
}

void FORTRAN(dsytrf)(const char *uplo, const batten_la_int *n, double *a, const batten_la_int *lda,
                     batten_la_int *ipiv, double *work, const batten_la_int *lwork, batten_la_int *info,
                     size_t length) {
  sytrf_double *forward;
  next("dsytrf_", &forward, sizeof forward);
  forward(uplo, n, a, lda, ipiv, work, lwork, info, length);
  if (fail_ldl && *lwork > 0) *info = (batten_la_int)fail_ldl;
}

static void check(batten_context *ctx, batten_saddle_method method, batten_saddle_method used, unsigned fallbacks) {
  double w[60], c[4];
  scene s = scene_new(SCENE_RANDOM, KERNEL_R, 60, 4, 1);
  batten_saddle_matrix m = scene_matrix(&s);
  batten_saddle_options o = batten_saddle_options_default();
  batten_saddle *h = NULL;
  o.method = method;
  T_OK(batten_saddle_factor(ctx, &m, &o, &h), ctx);
  T_OK(batten_saddle_solve(ctx, h, s.f, w, c), ctx);
  batten_saddle_info info = batten_saddle_get_info(h);
  T_CHECK(info.method == used && info.fallbacks == fallbacks, "%s ends with %s after %u",
          batten_saddle_method_name(method), batten_saddle_method_name(info.method), info.fallbacks);
  T_RATIO(scene_check(&s, w, c).residual, 1.5e-13, "its residual");
  batten_saddle_free(h);
  scene_free(&s);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  check(ctx, BATTEN_SADDLE_CHOLESKY_MIXED, BATTEN_SADDLE_CHOLESKY_MIXED, 0);
  fail_float = 1;
  check(ctx, BATTEN_SADDLE_CHOLESKY_MIXED, BATTEN_SADDLE_CHOLESKY, 1);
  fail_double = 1;
  check(ctx, BATTEN_SADDLE_CHOLESKY_MIXED, BATTEN_SADDLE_LDL, 2);
  check(ctx, BATTEN_SADDLE_CHOLESKY, BATTEN_SADDLE_LDL, 1);
  fail_ldl = 7;
  scene s = scene_new(SCENE_RANDOM, KERNEL_R, 60, 4, 1);
  batten_saddle_matrix m = scene_matrix(&s);
  batten_saddle *h = NULL;
  T_STATUS(batten_saddle_factor(ctx, &m, NULL, &h), BATTEN_E_SINGULAR, ctx, "singular to working precision; rows");
  T_CHECK(!h && batten_bytes_in_use(ctx) == 0, "nothing is left behind");
  scene_free(&s);
  batten_context_free(ctx);
  return t_done();
}
