/* Context: creation, error text, progress. See <batten/base.h>. */
#include "context.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static void *allocate_default(void *memory_user, size_t bytes) {
  (void)memory_user;
  return malloc(bytes);
}

static void release_default(void *memory_user, void *block) {
  (void)memory_user;
  free(block);
}

batten_context_options batten_context_options_default(void) {
  return (batten_context_options){.struct_size = sizeof(batten_context_options), .threads = 1};
}

batten_status batten_context_new(const batten_context_options *opt, batten_context **out) {
  batten_context_options options = opt ? *opt : batten_context_options_default();
  if (!out || options.struct_size != sizeof options || options.threads < 1 || options.threads > 4096 ||
      !options.allocate != !options.release)
    return BATTEN_E_INVALID;
  if (!options.allocate) {
    options.allocate = allocate_default;
    options.release = release_default;
  }
  batten_context *ctx = options.allocate(options.memory_user, sizeof *ctx);
  if (!ctx) return BATTEN_E_NOMEM;
  *ctx = (batten_context){.options = options};
  *out = ctx;
  return BATTEN_OK;
}

void batten_context_free(batten_context *ctx) {
  if (ctx) ctx->options.release(ctx->options.memory_user, ctx);
}

const char *batten_error(const batten_context *ctx) { return ctx ? ctx->error : ""; }

unsigned batten_threads(const batten_context *ctx) { return ctx->options.threads; }

batten_status batten_fail(batten_context *ctx, batten_status status, const char *format, ...) {
  va_list args;
  va_start(args, format);
  /* Formatted aside, so that an argument may be the old text. */
  char text[BATTEN_ERROR_SIZE];
  if (vsnprintf(text, sizeof text, format, args) < 0) text[0] = '\0';
  va_end(args);
  snprintf(ctx->error, sizeof ctx->error, "%s", text);
  return status;
}

batten_status batten_progress(batten_context *ctx, const char *phase, double fraction) {
  if (ctx->options.progress && ctx->options.progress(ctx->options.progress_user, phase, fraction))
    return batten_fail(ctx, BATTEN_E_CANCELLED, "cancelled by the host during %s", phase);
  return BATTEN_OK;
}

double batten_now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}
