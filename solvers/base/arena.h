/* Contexts for tasks. What runs in batten_parallel may not touch the caller's context, whose memory hooks belong to the
 * calling thread; work that is written for a context, and asks for memory in the middle, runs there in an arena: a
 * private context whose memory comes out of one block that the calling thread took beforehand.
 *
 *   arenas, one for each of batten_workers(ctx) tasks    batten_arena_new      calling thread
 *   a task runs pieces of work, one after the other:     batten_arena_context  its thread; empties the arena
 *   results leave it as plain numbers, into arrays that the calling thread took
 *   a piece that ends in NOMEM is done again             with the caller's context, on the calling thread
 *
 * No progress is told, no threads are started from within. */
#ifndef BATTEN_BASE_ARENA_H
#define BATTEN_BASE_ARENA_H

#include <batten/base.h>

typedef struct batten_arena batten_arena;

/* How many tasks of ctx's loops run at a time: its threads; where the host runs the loops, which does not say, 8. */
unsigned batten_workers(const batten_context *ctx);

/* bytes: of the blocks held at a time, as batten_bytes_peak counts them, with what lies between them. NOMEM. */
batten_status batten_arena_new(batten_context *ctx, size_t bytes, batten_arena **out);
void batten_arena_free(batten_context *ctx, batten_arena *arena); /* with everything in it; NULL is fine */

/* A new context in the arena, with one thread; what was in it before is gone. NULL where it is too small even for
 * that. Valid until the next call; need not be freed. */
batten_context *batten_arena_context(batten_arena *arena);

#endif
