/* A loop over many points. See points.h. */
#include "base/points.h"

/* A piece lasts some hundredths of a second, a task of batten_parallel longer than the making of a thread. */
enum { POINTS_PER_TASK = 256, PIECE = 1 << 16 };

typedef struct piece {
  size_t first, last;
  void (*task)(void *arg, size_t i);
  void *arg;
} piece;

static void run_block(void *arg, size_t block) {
  const piece *p = arg;
  const size_t first = p->first + block * POINTS_PER_TASK, end = first + POINTS_PER_TASK;
  for (size_t i = first; i < end && i < p->last; i++) p->task(p->arg, i);
}

batten_status batten_for_points(batten_context *ctx, const char *phase, size_t count,
                                void (*task)(void *arg, size_t i), void *arg) {
  piece p = {.task = task, .arg = arg};
  for (; p.first < count; p.first = p.last) {
    batten_status st = count > PIECE ? batten_progress(ctx, phase, (double)p.first / (double)count) : BATTEN_OK;
    if (st < 0) return st;
    p.last = count - p.first < PIECE ? count : p.first + PIECE;
    batten_parallel(ctx, (p.last - p.first + POINTS_PER_TASK - 1) / POINTS_PER_TASK, run_block, &p);
  }
  return BATTEN_OK;
}
