/* Tests that print TAP: each check is a line with what was measured beside what is allowed.
 *   T_CHECK(condition, "what %d", i)       a fact
 *   T_RATIO(value, bound, "what")          value <= bound; prints value / bound
 *   T_STATUS(call, BATTEN_E_INVALID, ctx, "points[17]")   status, and the error text contains a part
 * End main with `return t_done();`. Test doubles: a counting allocator that can fail, and a progress
 * callback that can cancel. */
#ifndef TAP_H
#define TAP_H

#include <batten/base.h>
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int t_count, t_failed;

BATTEN_PRINTF(2, 3) static inline bool t_line(bool ok, const char *format, ...) {
  va_list args;
  va_start(args, format);
  printf("%s %d - ", ok ? "ok" : "not ok", ++t_count);
  vprintf(format, args);
  printf("\n");
  fflush(stdout);
  va_end(args);
  if (!ok) t_failed++;
  return ok;
}

static inline int t_done(void) {
  printf("1..%d\n", t_count);
  return t_failed != 0;
}

#define T_CHECK(condition, ...) t_line((condition), __VA_ARGS__)

#define T_RATIO(value, bound, ...)                                                                          \
  do {                                                                                                      \
    double t_value = (value), t_bound = (bound);                                                            \
    char t_what[256];                                                                                       \
    snprintf(t_what, sizeof t_what, __VA_ARGS__);                                                           \
    t_line(t_value <= t_bound, "%s: %.3g, allowed %.3g", t_what, t_value, t_bound);                         \
  } while (0)

#define T_STATUS(call, expected, ctx, part)                                                                 \
  do {                                                                                                      \
    batten_status t_status = (call);                                                                        \
    bool t_ok = t_status == (expected) && strstr(batten_error(ctx), (part));                                \
    t_line(t_ok, "%s %s: %s", batten_status_name(t_status), #call, t_status ? batten_error(ctx) : "");      \
  } while (0)

#define T_OK(call, ctx)                                                                                     \
  do {                                                                                                      \
    batten_status t_status = (call);                                                                        \
    t_line(t_status == BATTEN_OK, "%s %s %s", batten_status_name(t_status), #call,                          \
           t_status ? batten_error(ctx) : "");                                                              \
  } while (0)

static inline void t_skip(const char *what, const char *why) {
  printf("ok %d - %s # SKIP %s\n", ++t_count, what, why);
}

/* splitmix64: the same numbers everywhere. Seed it, print the seed. */
static inline uint64_t t_random(uint64_t *state) {
  uint64_t z = (*state += 0x9e3779b97f4a7c15u);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}
/* Uniform in [0, 1). */
static inline double t_uniform(uint64_t *state) { return (double)(t_random(state) >> 11) * 0x1p-53; }

/* Allocator that counts live blocks and refuses the call number `fail_at` (1 = first; 0 = never), and all
 * later ones with fail_forever. */
typedef struct t_memory {
  size_t calls, live, fail_at;
  bool fail_forever;
} t_memory;

static inline void *t_allocate(void *user, size_t bytes) {
  t_memory *m = user;
  m->calls++;
  if (m->fail_at && (m->calls == m->fail_at || (m->fail_forever && m->calls > m->fail_at))) return NULL;
  m->live++;
  return malloc(bytes);
}
static inline void t_release(void *user, void *block) {
  ((t_memory *)user)->live--;
  free(block);
}

/* Progress callback that cancels at call number cancel_at (0 = never). */
typedef struct t_progress {
  size_t calls, cancel_at;
} t_progress;
static inline int t_progress_call(void *user, const char *phase, double fraction) {
  t_progress *p = user;
  (void)phase;
  if (!(fraction >= 0 && fraction <= 1)) t_line(false, "progress of %s within [0, 1]: %g", phase, fraction);
  return ++p->calls == p->cancel_at;
}

static inline batten_context *t_context(t_memory *memory, t_progress *progress, unsigned threads) {
  batten_context_options o = batten_context_options_default();
  o.threads = threads;
  if (memory) {
    o.allocate = t_allocate;
    o.release = t_release;
    o.memory_user = memory;
  }
  if (progress) {
    o.progress = t_progress_call;
    o.progress_user = progress;
  }
  batten_context *ctx = NULL;
  return batten_context_new(&o, &ctx) == BATTEN_OK ? ctx : NULL;
}

/* Runs call(ctx, arg) with the k-th allocation failing, k = 1, 2, ..., once and for ever after, until it passes:
 * each failure must be NOMEM and leave nothing. call must release what it made when it succeeds. */
static inline void t_fail_every_allocation(const char *what, batten_status (*call)(batten_context *, void *),
                                           void *arg) {
  for (int forever = 0; forever < 2; forever++) {
    bool ok = true;
    size_t k = 0;
    batten_status status = BATTEN_E_NOMEM;
    while (ok && status == BATTEN_E_NOMEM && k < 100000) {
      t_memory memory = {0};
      batten_context *ctx = t_context(&memory, NULL, 2);
      memory = (t_memory){.live = memory.live, .fail_at = ++k, .fail_forever = forever != 0};
      status = call(ctx, arg);
      ok = memory.live == 1 && batten_bytes_in_use(ctx) == 0 && (status >= 0 || status == BATTEN_E_NOMEM);
      if (!ok) printf("# allocation %zu: %s, %zu blocks live: %s\n", k, batten_status_name(status), memory.live,
                      batten_error(ctx));
      batten_context_free(ctx);
    }
    t_line(ok && status >= 0, "%s survives the failure of each of its %zu allocations%s", what, k - 1,
           forever ? " and all later ones" : "");
  }
}

/* The same with cancel at the k-th progress call. */
static inline void t_cancel_every_progress(const char *what, batten_status (*call)(batten_context *, void *),
                                           void *arg) {
  bool ok = true;
  size_t k = 0;
  batten_status status = BATTEN_E_CANCELLED;
  while (ok && status == BATTEN_E_CANCELLED && k < 100000) {
    t_memory memory = {0};
    t_progress progress = {.cancel_at = ++k};
    batten_context *ctx = t_context(&memory, &progress, 2);
    status = call(ctx, arg);
    ok = memory.live == 1 && (status >= 0 || status == BATTEN_E_CANCELLED);
    if (!ok) printf("# progress call %zu: %s, %zu blocks live: %s\n", k, batten_status_name(status), memory.live,
                    batten_error(ctx));
    batten_context_free(ctx);
  }
  t_line(ok && status >= 0 && k > 1, "%s can be cancelled at each of its %zu progress calls", what, k - 1);
}

#endif
