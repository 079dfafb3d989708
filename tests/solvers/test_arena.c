/* Contexts out of one block. */
#include "base/arena.h"
#include "base/checked.h"
#include "tap.h"

enum { BLOCKS = 64 };

/* Blocks of random sizes come and go; each keeps what was written into it. */
static void test_blocks(void) {
  t_memory memory = {0};
  batten_context *ctx = t_context(&memory, NULL, 2);
  batten_arena *arena = NULL;
  uint64_t seed = 8;
  T_OK(batten_arena_new(ctx, 200000, &arena), ctx);
  const size_t calls = memory.calls;
  batten_context *own = batten_arena_context(arena);
  unsigned char *blocks[BLOCKS] = {NULL};
  size_t sizes[BLOCKS] = {0}, refused = 0, wrong = 0, misaligned = 0;
  for (int step = 0; step < 20000; step++) {
    size_t i = t_random(&seed) % BLOCKS;
    for (size_t k = 0; blocks[i] && k < sizes[i]; k++) wrong += blocks[i][k] != (unsigned char)i;
    batten_free(own, blocks[i]);
    sizes[i] = t_random(&seed) % 8000;
    blocks[i] = batten_alloc(own, sizes[i]);
    refused += !blocks[i];
    misaligned += (uintptr_t)blocks[i] % 64 != 0;
    if (blocks[i]) memset(blocks[i], (int)i, sizes[i]);
  }
  T_CHECK(wrong == 0 && misaligned == 0, "20000 blocks keep their content, aligned");
  T_CHECK(refused > 0 && refused < 15000, "%zu refused: 64 blocks of 4000 bytes are more than it holds", refused);
  for (size_t i = 0; i < BLOCKS; i++) batten_free(own, blocks[i]);
  T_CHECK(batten_bytes_in_use(own) == 0, "all given back");
  void *whole = batten_alloc(own, 198000);
  T_CHECK(whole, "then it is whole again");
  T_CHECK(!batten_alloc(own, 4000) && strstr(batten_error(own), "out of memory"), "and full: %s", batten_error(own));
  T_CHECK(!batten_alloc(own, SIZE_MAX - 200), "a size that overflows is refused");
  own = batten_arena_context(arena);
  T_CHECK(own && batten_alloc(own, 198000), "a new context finds it empty, with blocks of the last one left in it");
  T_CHECK(memory.calls == calls, "the host was asked for nothing meanwhile");
  batten_arena_free(ctx, arena);
  batten_arena_free(ctx, NULL);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "released");
  batten_context_free(ctx);
  T_CHECK(memory.live == 0, "nothing left");
}

static void test_edges(void) {
  t_memory memory = {0};
  batten_context *ctx = t_context(&memory, NULL, 3);
  batten_arena *arena = NULL;
  T_CHECK(batten_workers(ctx) == 3, "as many as threads");
  T_OK(batten_arena_new(ctx, 0, &arena), ctx);
  T_CHECK(!batten_arena_context(arena), "an arena of nothing holds no context");
  batten_arena_free(ctx, arena);
  T_STATUS(batten_arena_new(ctx, SIZE_MAX - 10, &arena), BATTEN_E_NOMEM, ctx, "out of memory");
  memory.fail_at = memory.calls + 1;
  T_STATUS(batten_arena_new(ctx, 1000, &arena), BATTEN_E_NOMEM, ctx, "out of memory");
  batten_context_free(ctx);
  T_CHECK(memory.live == 0, "nothing left");
}

int main(void) {
  test_blocks();
  test_edges();
  return t_done();
}
