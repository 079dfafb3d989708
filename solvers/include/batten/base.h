/* batten ground floor: status codes, the context, memory, progress, threads.
 *
 * Everything that batten remembers lives in a batten_context: allocator, thread
 * count of its own loops, progress callback, text of the last error. There is no
 * global state. One context serves one host thread at a time; different contexts
 * are independent. The library never prints, exits, aborts, or changes locale,
 * rounding mode, signals or the thread count of BLAS. */
#ifndef BATTEN_BASE_H
#define BATTEN_BASE_H

#include <stddef.h>

#if defined(_WIN32)
#define BATTEN_API
#elif defined(__GNUC__)
#define BATTEN_API __attribute__((visibility("default")))
#else
#define BATTEN_API
#endif

#if defined(__GNUC__)
#define BATTEN_PRINTF(text, first) __attribute__((format(printf, text, first)))
#else
#define BATTEN_PRINTF(text, first)
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define BATTEN_VERSION_MAJOR 0
#define BATTEN_VERSION_MINOR 1
#define BATTEN_VERSION_PATCH 0

/* The one list of status codes: X(name, value, text).
 * 0 done; negative: could not, and no output argument was touched (but the arrays of a
 * batch of field values, see <batten/field.h>, and the proofs that a quadratic program
 * gives, see <batten/qp.h>); positive: done, outputs are valid, but look at the result
 * struct and at batten_error(). */
#define BATTEN_STATUS_LIST(X)                                                            \
  X(BATTEN_OK, 0, "done")                                                                \
  X(BATTEN_W_ACCURACY, 1, "done, but a residual misses its tolerance")                   \
  X(BATTEN_W_AMBIGUOUS, 2, "done, but the sign of the solid is not settled by the data") \
  X(BATTEN_W_CLIPPED, 3, "done, but the surface is cut by its box")                      \
  X(BATTEN_W_STOPPED, 4, "stopped at a feasible point that is not the optimum")          \
  X(BATTEN_W_SHAPE, 5, "done, but the data have another shape than was asked for")       \
  X(BATTEN_E_INVALID, -1, "invalid argument")                                            \
  X(BATTEN_E_NOMEM, -2, "out of memory")                                                 \
  X(BATTEN_E_TOO_LARGE, -3, "too large")                                                 \
  X(BATTEN_E_SINGULAR, -4, "singular or not definite")                                   \
  X(BATTEN_E_CANCELLED, -5, "cancelled")                                                 \
  X(BATTEN_E_NOT_FOUND, -6, "nothing found")                                             \
  X(BATTEN_E_IO, -7, "file cannot be read or written")                                   \
  X(BATTEN_E_FORMAT, -8, "file content is not valid")                                    \
  X(BATTEN_E_INTERNAL, -9, "internal error, please report")                              \
  X(BATTEN_E_INFEASIBLE, -10, "no point satisfies the constraints")                      \
  X(BATTEN_E_UNBOUNDED, -11, "the objective falls without end")                          \
  X(BATTEN_E_NOT_CONVEX, -12, "the objective is not convex")                             \
  X(BATTEN_E_LIMIT, -13, "a limit was met before there was a result")

typedef enum batten_status {
#define BATTEN_STATUS_ENUM(name, value, text) name = value,
  BATTEN_STATUS_LIST(BATTEN_STATUS_ENUM)
#undef BATTEN_STATUS_ENUM
} batten_status;

/* Name ("BATTEN_E_INVALID") and one-line text of a status; never NULL. */
BATTEN_API const char *batten_status_name(batten_status status);
BATTEN_API const char *batten_status_text(batten_status status);

/* "0.1.0" of the library that is loaded. */
BATTEN_API const char *batten_version(void);

typedef struct batten_context batten_context;

/* What a context is made with. Start from batten_context_options_default(). */
typedef struct batten_context_options {
  size_t struct_size; /* set by _default(); a zeroed struct is refused */

  /* Memory hooks; both NULL = malloc and free. allocate may return NULL at any
   * time. Called on the thread that makes the call into batten, never on workers. */
  void *(*allocate)(void *memory_user, size_t bytes);
  void (*release)(void *memory_user, void *block);
  void *memory_user;
  size_t memory_limit; /* bytes that the context may hold at a time, 0 = no limit. Default 0. */

  unsigned threads; /* threads of batten's own loops, 1 .. 4096, of which no loop uses more than 64. Default 1. Results
                       do not depend on it. */

  /* Host executor for batten's own loops, in place of `threads`; NULL = own threads. Must call task(arg, i) once for
   * each i < tasks, in any order, on any threads, and return when all have returned. */
  void (*parallel_for)(void *parallel_user, size_t tasks, void (*task)(void *arg, size_t index), void *arg);
  void *parallel_user;

  /* Called from time to time on the calling thread with the phase's name and the part done, in
   * [0, 1]. Non-zero cancels: the call returns BATTEN_E_CANCELLED and leaves nothing behind (a quadratic program that
   * holds a feasible point returns that, with BATTEN_W_STOPPED). */
  int (*progress)(void *progress_user, const char *phase, double fraction);
  void *progress_user;
} batten_context_options;

BATTEN_API batten_context_options batten_context_options_default(void);

/* New context. opt NULL = defaults. Fails: BATTEN_E_INVALID, BATTEN_E_NOMEM; *out untouched then. */
BATTEN_API batten_status batten_context_new(const batten_context_options *opt, batten_context **out);

/* Frees a context; NULL is fine. Handles made with it must have been freed before. */
BATTEN_API void batten_context_free(batten_context *ctx);

/* Text of the last negative or positive status on this context: names argument, index, value and
 * remedy. "" when there was none, or ctx is NULL. Valid until the next call on the context. */
BATTEN_API const char *batten_error(const batten_context *ctx);

/* Bytes held now, and the most held at a time since the last reset. */
BATTEN_API size_t batten_bytes_in_use(const batten_context *ctx);
BATTEN_API size_t batten_bytes_peak(const batten_context *ctx);
BATTEN_API void batten_bytes_peak_reset(batten_context *ctx);

/* Bytes that the context may still take under its memory_limit, SIZE_MAX without one. */
BATTEN_API size_t batten_bytes_available(const batten_context *ctx);

BATTEN_API unsigned batten_threads(const batten_context *ctx);

/* The same hooks for code that is written on top of batten (batten's own file library uses them). */

/* Memory of the context, aligned to 64 bytes; NULL when refused, with the error text set. bytes = 0
 * gives a block that can be freed. batten_free(ctx, NULL) is fine. */
BATTEN_API void *batten_alloc(batten_context *ctx, size_t bytes);
BATTEN_API void batten_free(batten_context *ctx, void *block);

/* count * size bytes, refused when the product overflows. */
BATTEN_API void *batten_alloc_array(batten_context *ctx, size_t count, size_t size);

/* Grows or shrinks block to count * size bytes; NULL leaves the block as it was. */
BATTEN_API void *batten_realloc_array(batten_context *ctx, void *block, size_t count, size_t size);

/* Sets the error text and returns the status. */
BATTEN_API batten_status batten_fail(batten_context *ctx, batten_status status, const char *format, ...)
    BATTEN_PRINTF(3, 4);

/* BATTEN_OK, or BATTEN_E_CANCELLED when the host's callback asks for it. */
BATTEN_API batten_status batten_progress(batten_context *ctx, const char *phase, double fraction);

/* Runs task(arg, 0 .. tasks-1) on the context's threads and returns when all are done. Tasks must not
 * call into the context, and what they compute must not depend on who runs them. Cost: about 20 us
 * for each extra thread, so a task should last longer than that. */
BATTEN_API void batten_parallel(batten_context *ctx, size_t tasks, void (*task)(void *arg, size_t index),
                                void *arg);

/* Seconds of a monotonic clock. */
BATTEN_API double batten_now(void);

#ifdef __cplusplus
}
#endif
#endif
