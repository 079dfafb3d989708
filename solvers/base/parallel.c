/* The one parallel loop. Plain POSIX threads, made for the loop and joined after it:
 *   - no runtime is loaded into the host (a second OpenMP runtime beside the host's is a known source of trouble,
 *     and libgomp's pool makes a forked child hang), nothing is left running afterwards, sanitizers see all of it;
 *   - tasks are handed out by an atomic counter, each writes its own output: who runs what changes no bit;
 *   - when a thread cannot be had, the others do its work: the loop never fails;
 *   - signals of the host go to the host's threads: its handlers know nothing of ours. */
#include "context.h"

#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>

enum { THREADS_MAX = 64 };

typedef struct loop {
  atomic_size_t next;
  size_t tasks;
  void (*task)(void *arg, size_t index);
  void *arg;
} loop;

static void *work(void *loop_ptr) {
  loop *l = loop_ptr;
  for (;;) {
    size_t i = atomic_fetch_add(&l->next, 1);
    if (i >= l->tasks) return NULL;
    l->task(l->arg, i);
  }
}

/* Starts up to `wanted` threads, with every signal blocked but those that a fault raises on its own thread, and the
 * profiler's. Returns how many. */
static size_t start(loop *l, size_t wanted, pthread_t *threads) {
  static const int kept[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGSYS, SIGPROF};
  sigset_t blocked, before;
  size_t started = 0;
  if (wanted == 0) return 0;
  sigfillset(&blocked);
  for (size_t i = 0; i < sizeof kept / sizeof *kept; i++) sigdelset(&blocked, kept[i]);
  if (pthread_sigmask(SIG_BLOCK, &blocked, &before) != 0) return 0;
  while (started < wanted && pthread_create(&threads[started], NULL, work, l) == 0) started++;
  pthread_sigmask(SIG_SETMASK, &before, NULL);
  return started;
}

void batten_parallel(batten_context *ctx, size_t tasks, void (*task)(void *arg, size_t index), void *arg) {
  const batten_context_options *o = &ctx->options;
  if (tasks == 0) return;
  if (o->parallel_for) {
    o->parallel_for(o->parallel_user, tasks, task, arg);
    return;
  }
  loop l = {.tasks = tasks, .task = task, .arg = arg};
  atomic_init(&l.next, 0);
  size_t wanted = o->threads < tasks ? o->threads : tasks;
  if (wanted > THREADS_MAX) wanted = THREADS_MAX;
  pthread_t threads[THREADS_MAX];
  size_t started = start(&l, wanted - 1, threads);
  work(&l);
  while (started > 0) pthread_join(threads[--started], NULL);
}
