/* Memory of a context: the host's hooks, counted and limited, every block aligned to a cache line.
 *
 * Layout of a block: [raw ... | header | payload], payload on a multiple of ALIGNMENT, the header just before it. */
#include "checked.h"
#include "context.h"

#include <string.h>

enum { ALIGNMENT = 64 }; /* one cache line, and the widest vector register */

typedef struct block_header {
  void *raw;
  size_t bytes; /* payload */
} block_header;

static block_header *header_of(void *block) { return (block_header *)(void *)((char *)block - sizeof(block_header)); }

void *batten_alloc(batten_context *ctx, size_t bytes) {
  const batten_context_options *o = &ctx->options;
  size_t total;
  if (!batten_add(bytes, sizeof(block_header) + ALIGNMENT, &total)) {
    batten_fail(ctx, BATTEN_E_NOMEM, "out of memory: %zu bytes asked for", bytes);
    return NULL;
  }
  if (o->memory_limit && (bytes > o->memory_limit || ctx->bytes > o->memory_limit - bytes)) {
    batten_fail(ctx, BATTEN_E_NOMEM, "out of memory: %zu bytes asked for, %zu held, the context's limit is %zu", bytes,
                ctx->bytes, o->memory_limit);
    return NULL;
  }
  char *raw = o->allocate(o->memory_user, total);
  if (!raw) {
    batten_fail(ctx, BATTEN_E_NOMEM, "out of memory: %zu bytes asked for, %zu held", bytes, ctx->bytes);
    return NULL;
  }
  uintptr_t first = (uintptr_t)raw + sizeof(block_header);
  char *payload = raw + sizeof(block_header) + (ALIGNMENT - first % ALIGNMENT) % ALIGNMENT;
  *header_of(payload) = (block_header){raw, bytes};
  ctx->bytes += bytes;
  if (ctx->bytes > ctx->bytes_peak) ctx->bytes_peak = ctx->bytes;
  return payload;
}

void batten_free(batten_context *ctx, void *block) {
  if (!block) return;
  block_header header = *header_of(block);
  ctx->bytes -= header.bytes;
  ctx->options.release(ctx->options.memory_user, header.raw);
}

void *batten_alloc_array(batten_context *ctx, size_t count, size_t size) {
  size_t bytes;
  if (!batten_mul(count, size, &bytes)) {
    batten_fail(ctx, BATTEN_E_NOMEM, "out of memory: %zu items of %zu bytes", count, size);
    return NULL;
  }
  return batten_alloc(ctx, bytes);
}

void *batten_realloc_array(batten_context *ctx, void *block, size_t count, size_t size) {
  void *grown = batten_alloc_array(ctx, count, size);
  if (!grown || !block) return grown;
  size_t old = header_of(block)->bytes, now = count * size;
  memcpy(grown, block, old < now ? old : now);
  batten_free(ctx, block);
  return grown;
}

size_t batten_bytes_in_use(const batten_context *ctx) { return ctx->bytes; }
size_t batten_bytes_peak(const batten_context *ctx) { return ctx->bytes_peak; }
void batten_bytes_peak_reset(batten_context *ctx) { ctx->bytes_peak = ctx->bytes; }

size_t batten_bytes_available(const batten_context *ctx) {
  size_t limit = ctx->options.memory_limit;
  return limit == 0 ? SIZE_MAX : limit > ctx->bytes ? limit - ctx->bytes : 0;
}
