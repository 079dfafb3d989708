/* Context, memory, status, parallel loop. */
#include <float.h>
#include <pthread.h>
#include <signal.h>
#include <time.h>

#include "base/checked.h"
#include "tap.h"

static void test_status(void) {
  T_CHECK(!strcmp(batten_status_name(BATTEN_E_NOMEM), "BATTEN_E_NOMEM"), "status name");
  T_CHECK(!strcmp(batten_status_text(BATTEN_OK), "done"), "status text");
  T_CHECK(!strcmp(batten_status_name((batten_status)77), "unknown status"), "name of a status that is none");
  T_CHECK(!strcmp(batten_version(), "0.1.0"), "version %s", batten_version());
}

static void test_options(void) {
  batten_context *ctx = NULL;
  batten_context_options zero = {0}, o = batten_context_options_default();
  T_CHECK(batten_context_new(&zero, &ctx) == BATTEN_E_INVALID && !ctx, "zeroed options are refused");
  o.threads = 0;
  T_CHECK(batten_context_new(&o, &ctx) == BATTEN_E_INVALID && !ctx, "no threads are refused");
  o = batten_context_options_default();
  o.allocate = t_allocate;
  T_CHECK(batten_context_new(&o, &ctx) == BATTEN_E_INVALID && !ctx, "half a pair of memory hooks is refused");
  T_CHECK(batten_context_new(NULL, NULL) == BATTEN_E_INVALID, "no result pointer is refused");
  T_CHECK(!strcmp(batten_error(NULL), ""), "no context has no error text");
}

static void test_memory(void) {
  t_memory memory = {0};
  batten_context *ctx = t_context(&memory, NULL, 1);
  double *a = batten_alloc_array(ctx, 10, sizeof *a);
  T_CHECK((uintptr_t)a % 64 == 0 && batten_bytes_in_use(ctx) == 80, "80 bytes, aligned");
  for (int i = 0; i < 10; i++) a[i] = i;
  a = batten_realloc_array(ctx, a, 1000, sizeof *a);
  T_CHECK(a && a[9] == 9 && batten_bytes_in_use(ctx) == 8000, "grown, content kept");
  T_CHECK(batten_bytes_peak(ctx) == 8080, "peak counts both blocks");
  T_CHECK(!batten_alloc_array(ctx, SIZE_MAX / 4, 8) && strstr(batten_error(ctx), "out of memory"),
          "product overflow");
  T_CHECK(!batten_alloc(ctx, SIZE_MAX - 4), "sum overflow");
  memory.fail_at = memory.calls + 1;
  T_CHECK(!batten_realloc_array(ctx, a, 2000, sizeof *a) && a[9] == 9, "failed growth leaves the block");
  batten_free(ctx, a);
  batten_free(ctx, NULL);
  batten_free(ctx, batten_alloc(ctx, 0));
  T_CHECK(batten_bytes_in_use(ctx) == 0 && memory.live == 1, "all released");
  batten_context_free(ctx);
  T_CHECK(memory.live == 0, "context released");

  batten_context_options o = batten_context_options_default();
  o.memory_limit = 1000;
  ctx = NULL;
  batten_context_new(&o, &ctx);
  void *b = batten_alloc(ctx, 900);
  T_CHECK(b && !batten_alloc(ctx, 200) && strstr(batten_error(ctx), "limit is 1000"), "limit: %s", batten_error(ctx));
  batten_free(ctx, b);
  batten_context_free(ctx);
}

static void test_checked(void) {
  size_t out;
  T_CHECK(batten_unit(1) == 1 && batten_unit(0.75) == 2 && batten_unit(DBL_MAX) * DBL_MAX < 2 &&
              batten_unit(DBL_MAX) * DBL_MAX >= 1 && batten_unit(0x1p-1074) == 0x1p1022,
          "units, also of the largest and the smallest number");
  T_CHECK(batten_mul(3, 5, &out) && out == 15, "product");
  T_CHECK(!batten_mul(SIZE_MAX / 2, 3, &out) && out == SIZE_MAX, "product saturates");
  T_CHECK(!batten_mul3(SIZE_MAX / 2, 3, 1, &out) && out == SIZE_MAX, "triple product saturates");
  T_CHECK(batten_mul3(0, SIZE_MAX, 9, &out) && out == 0, "zero");
  T_CHECK(!batten_add(SIZE_MAX, 1, &out) && out == SIZE_MAX, "sum saturates");
  double v[3] = {1, NAN, INFINITY};
  T_CHECK(batten_first_nonfinite(3, v) == 1 && batten_first_nonfinite(1, v) == 1, "first non-finite value");
}

static void square(void *arg, size_t i) {
  double *v = arg;
  for (int k = 0; k < 100; k++) v[i] = v[i] * 0.5 + (double)(i * i);
}

static void executor(void *user, size_t tasks, void (*task)(void *, size_t), void *arg) {
  (*(int *)user)++;
  for (size_t i = tasks; i-- > 0;) task(arg, i);
}

/* A failure that was expected leaves no text; another one stays. */
static void test_expected(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  batten_status st = batten_fail(ctx, BATTEN_E_SINGULAR, "points: too few");
  st = batten_expect(ctx, st, BATTEN_E_SINGULAR);
  T_CHECK(st == BATTEN_OK && strcmp(batten_error(ctx), "") == 0, "a failure that was expected is none: \"%s\"",
          batten_error(ctx));
  st = batten_fail(ctx, BATTEN_E_NOMEM, "no more");
  st = batten_expect(ctx, st, BATTEN_E_SINGULAR);
  T_CHECK(st == BATTEN_E_NOMEM && strcmp(batten_error(ctx), "no more") == 0, "another one stays, with its text");
  batten_context_free(ctx);
}

static void test_parallel(void) {
  enum { N = 1000 };
  static double one[N], v[N];
  batten_context *ctx = t_context(NULL, NULL, 1);
  batten_parallel(ctx, N, square, one);
  batten_parallel(ctx, 0, square, NULL);
  batten_context_free(ctx);
  for (unsigned threads = 2; threads <= 128; threads *= 4) {
    memset(v, 0, sizeof v);
    ctx = t_context(NULL, NULL, threads);
    batten_parallel(ctx, N, square, v);
    batten_context_free(ctx);
    T_CHECK(!memcmp(one, v, sizeof v), "same bits on %u threads", threads);
  }
  int calls = 0;
  batten_context_options o = batten_context_options_default();
  o.parallel_for = executor;
  o.parallel_user = &calls;
  ctx = NULL;
  batten_context_new(&o, &ctx);
  memset(v, 0, sizeof v);
  batten_parallel(ctx, N, square, v);
  batten_context_free(ctx);
  T_CHECK(calls == 1 && !memcmp(one, v, sizeof v), "same bits on the host's executor");
}

/* The host's signal handlers must not find themselves on a thread that the host knows nothing of. */
typedef struct signals {
  pthread_t caller;
  int open[64]; /* per task: signals that a batten thread would take */
} signals;

static void look_at_signals(void *arg, size_t i) {
  signals *s = arg;
  sigset_t mask;
  struct timespec wait = {.tv_nsec = 200000}; /* so that every thread gets a task */
  nanosleep(&wait, NULL);
  pthread_sigmask(SIG_BLOCK, NULL, &mask);
  if (pthread_equal(pthread_self(), s->caller)) return;
  s->open[i] = !sigismember(&mask, SIGALRM) || !sigismember(&mask, SIGTERM) || sigismember(&mask, SIGSEGV) ? 1 : -1;
}

static void test_signals(void) {
  signals s = {.caller = pthread_self()};
  batten_context *ctx = t_context(NULL, NULL, 4);
  sigset_t before, after;
  pthread_sigmask(SIG_BLOCK, NULL, &before);
  batten_parallel(ctx, 64, look_at_signals, &s);
  pthread_sigmask(SIG_BLOCK, NULL, &after);
  int open = 0, closed = 0;
  for (int i = 0; i < 64; i++) open += s.open[i] > 0, closed += s.open[i] < 0;
  T_CHECK(open == 0 && closed > 0, "%d tasks on own threads, %d of them take the host's signals", closed + open,
          open);
  T_CHECK(!sigismember(&before, SIGALRM) && !sigismember(&after, SIGALRM), "the caller goes on taking them");
  batten_context_free(ctx);
}

static void test_progress(void) {
  t_progress progress = {.cancel_at = 2};
  batten_context *ctx = t_context(NULL, &progress, 1);
  T_OK(batten_progress(ctx, "work", 0), ctx);
  T_STATUS(batten_progress(ctx, "work", 0.5), BATTEN_E_CANCELLED, ctx, "during work");
  batten_fail(ctx, BATTEN_E_INVALID, "outer: %s", batten_error(ctx));
  T_CHECK(!strcmp(batten_error(ctx), "outer: cancelled by the host during work"), "an error text may quote the last");
  batten_context_free(ctx);
}

int main(void) {
  test_status();
  test_options();
  test_memory();
  test_checked();
  test_expected();
  test_parallel();
  test_signals();
  test_progress();
  double a = batten_now();
  T_CHECK(batten_now() >= a, "clock does not run backwards");
  return t_done();
}
