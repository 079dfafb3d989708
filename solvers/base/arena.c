/* Memory out of one block: first fit from a list of gaps in the order of their addresses; neighbouring gaps grow
 * together when a block comes back. Few blocks live at a time, so that a list is enough.
 *
 * Layout: every block and every gap begins with its size, header included, in multiples of GRAIN. */
#include "arena.h"

#include "checked.h"
#include "context.h"

enum { GRAIN = 64 }; /* no less than a gap, and as what the context aligns its blocks to */

typedef struct gap {
  size_t bytes;
  struct gap *next; /* by address; of gaps only */
} gap;

struct batten_arena {
  size_t bytes;
  char *first; /* of the memory */
  gap *gaps;
};

static void *take(void *user, size_t bytes) {
  batten_arena *a = user;
  size_t wanted;
  if (!batten_add(bytes, 2 * GRAIN - 1, &wanted)) return NULL;
  wanted -= wanted % GRAIN; /* one grain for the header */
  for (gap **link = &a->gaps; *link; link = &(*link)->next) {
    gap *g = *link;
    if (g->bytes < wanted) continue;
    if (g->bytes == wanted) {
      *link = g->next;
    } else {
      gap *rest = (gap *)(void *)((char *)g + wanted);
      *rest = (gap){g->bytes - wanted, g->next};
      *link = rest;
    }
    g->bytes = wanted;
    return (char *)g + GRAIN;
  }
  return NULL;
}

static bool touch(const gap *left, const gap *right) {
  return (const char *)left + left->bytes == (const char *)right;
}

static void give_back(void *user, void *block) {
  batten_arena *a = user;
  gap *g = (gap *)(void *)((char *)block - GRAIN), *before = NULL, *after = a->gaps;
  while (after && after < g) {
    before = after;
    after = after->next;
  }
  g->next = after;
  if (after && touch(g, after)) *g = (gap){g->bytes + after->bytes, after->next};
  if (!before) {
    a->gaps = g;
  } else if (touch(before, g)) {
    *before = (gap){before->bytes + g->bytes, g->next};
  } else {
    before->next = g;
  }
}

unsigned batten_workers(const batten_context *ctx) { return ctx->options.parallel_for ? 8 : ctx->options.threads; }

batten_status batten_arena_new(batten_context *ctx, size_t bytes, batten_arena **out) {
  size_t whole;
  if (!batten_add(bytes, 4 * GRAIN, &whole)) whole = SIZE_MAX;
  char *block = batten_alloc(ctx, whole); /* refuses SIZE_MAX */
  if (!block) return BATTEN_E_NOMEM;
  batten_arena *a = (batten_arena *)(void *)block;
  *a = (batten_arena){.bytes = (whole - GRAIN) / GRAIN * GRAIN, .first = block + GRAIN};
  *out = a;
  return BATTEN_OK;
}

void batten_arena_free(batten_context *ctx, batten_arena *arena) { batten_free(ctx, arena); }

batten_context *batten_arena_context(batten_arena *a) {
  batten_context_options options = batten_context_options_default();
  batten_context *ctx = NULL;
  a->gaps = (gap *)(void *)a->first;
  *a->gaps = (gap){.bytes = a->bytes};
  options.allocate = take;
  options.release = give_back;
  options.memory_user = a;
  return batten_context_new(&options, &ctx) < 0 ? NULL : ctx;
}
