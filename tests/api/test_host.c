/* What a call into batten leaves unchanged in its host, and where it can be called from: the host's floating-point
 * modes, locale, signals, random numbers, files and threads; after a fork; on a small stack; from several threads. */
#define _GNU_SOURCE /* RTLD_DEFAULT */
#include <batten/batten.h>
#include <dlfcn.h>
#include <fenv.h>
#include <dirent.h>
#include <locale.h>
#include <pthread.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include "tap.h"
#ifdef __SSE2__
#include <xmmintrin.h>
#endif

enum { POINTS = 150, PROBES = 64, SIGNALS = 65 };

/* ---- the work: a fit of a bumpy ball, its surface, and what is wrong input ------------------------ */

typedef struct work {
  double points[POINTS][3], probes[PROBES][3];
  double values[PROBES], gradients[PROBES][3]; /* result */
  batten_status status;
} work;

static void make_work(work *w) {
  uint64_t seed = 20;
  memset(w, 0, sizeof *w);
  for (size_t i = 0; i < POINTS; i++) {
    /* Spiral points, so that none come close together. */
    double z = 1 - (2 * (double)i + 1) / POINTS, angle = 2.399963229728653 * (double)i, r = sqrt(1 - z * z);
    double bump = 1 + 0.1 * sin(5 * z) * cos(3 * angle);
    w->points[i][0] = bump * r * cos(angle);
    w->points[i][1] = bump * r * sin(angle);
    w->points[i][2] = bump * z;
  }
  for (size_t i = 0; i < PROBES; i++)
    for (size_t k = 0; k < 3; k++) w->probes[i][k] = 3 * t_uniform(&seed) - 1.5;
}

static batten_status fit(work *w, unsigned threads) {
  batten_context *ctx = t_context(NULL, NULL, threads);
  batten_solid *solid = NULL;
  if (!ctx) return w->status = BATTEN_E_NOMEM;
  w->status = batten_solid_fit(ctx, 3, POINTS, w->points[0], NULL, &solid, NULL);
  if (w->status == BATTEN_OK)
    w->status = batten_solid_evaluate(ctx, solid, PROBES, w->probes[0], w->values, w->gradients[0], NULL);
  if (w->status != BATTEN_OK) printf("# %s\n", batten_error(ctx));
  batten_solid_free(solid);
  batten_context_free(ctx);
  return w->status;
}

static bool same_result(const work *a, const work *b) {
  return a->status == BATTEN_OK && b->status == BATTEN_OK && !memcmp(a->values, b->values, sizeof a->values) &&
         !memcmp(a->gradients, b->gradients, sizeof a->gradients);
}

/* All of it: a surface, and input that is refused, which is where a library is tempted to speak. */
static void work_through(work *w) {
  fit(w, 2);
  batten_context *ctx = t_context(NULL, NULL, 2);
  batten_solid *solid = NULL;
  batten_mesh *mesh = NULL;
  if (batten_solid_fit(ctx, 3, POINTS, w->points[0], NULL, &solid, NULL) == BATTEN_OK) {
    batten_field field = batten_solid_field(solid);
    if (batten_polygonize(ctx, &field, POINTS, w->points[0], NULL, &mesh, NULL) < 0) w->status = BATTEN_E_INTERNAL;
  }
  batten_mesh_free(mesh);
  batten_solid_free(solid);
  solid = NULL;
  double bad[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (size_t count = 0; count <= 4; count++) {
    if (batten_solid_fit(ctx, 3, count, bad[0], NULL, &solid, NULL) >= 0) batten_solid_free(solid);
  }
  bad[2][1] = NAN;
  if (batten_solid_fit(ctx, 3, 4, bad[0], NULL, &solid, NULL) >= 0) w->status = BATTEN_E_INTERNAL;
  batten_context_free(ctx);
}

/* ---- the host's state --------------------------------------------------------------------------- */

typedef struct host_state {
  int rounding, traps, blas_threads;
  unsigned control; /* of the SSE unit, without the flags of past operations */
  char locale[256], folder[1024];
  struct sigaction actions[SIGNALS];
  sigset_t mask;
  mode_t umask_bits;
  size_t environment, files;
} host_state;

static int blas_number(const char *function) {
  int (*get)(void);
  *(void **)&get = dlsym(RTLD_DEFAULT, function);
  return get ? get() : -1;
}

static size_t count_entries(const char *folder) {
  size_t count = 0;
  DIR *d = opendir(folder);
  if (!d) return 0;
  while (readdir(d)) count++;
  closedir(d);
  return count;
}

static void look(host_state *s) {
  extern char **environ;
  memset(s, 0, sizeof *s);
  s->rounding = fegetround();
#ifdef __GLIBC__
  s->traps = fegetexcept();
#endif
#ifdef __SSE2__
  s->control = _mm_getcsr() & ~0x3fu;
#endif
  s->blas_threads = blas_number("openblas_get_num_threads");
  snprintf(s->locale, sizeof s->locale, "%s", setlocale(LC_ALL, NULL));
  if (!getcwd(s->folder, sizeof s->folder)) s->folder[0] = '\0';
  for (int i = 1; i < SIGNALS; i++) sigaction(i, NULL, &s->actions[i]);
  pthread_sigmask(SIG_SETMASK, NULL, &s->mask);
  umask(s->umask_bits = umask(0));
  for (char **e = environ; *e; e++) s->environment++;
  s->files = count_entries("/proc/self/fd");
}

/* By what counts: the library may fill the rest of struct sigaction as it likes. */
static bool same_actions(const struct sigaction *a, const struct sigaction *b) {
  for (int i = 1; i < SIGNALS; i++) {
    bool same = a[i].sa_handler == b[i].sa_handler && a[i].sa_flags == b[i].sa_flags;
    for (int j = 1; j < SIGNALS; j++) same = same && sigismember(&a[i].sa_mask, j) == sigismember(&b[i].sa_mask, j);
    if (!same) {
      printf("# signal %d: handler, flags or mask changed\n", i);
      return false;
    }
  }
  return true;
}

static void on_signal(int number) { (void)number; }

/* Bytes that went to a descriptor since it was turned to a file. */
typedef struct capture {
  int descriptor, saved;
  FILE *file;
} capture;

static capture capture_start(FILE *stream) {
  fflush(stream);
  capture c = {.descriptor = fileno(stream), .file = tmpfile()};
  c.saved = dup(c.descriptor);
  if (c.file) dup2(fileno(c.file), c.descriptor);
  return c;
}

static long capture_end(capture *c, FILE *stream) {
  fflush(stream);
  long bytes = c->file ? (long)lseek(fileno(c->file), 0, SEEK_END) : -1;
  dup2(c->saved, c->descriptor);
  close(c->saved);
  if (c->file) fclose(c->file);
  return bytes;
}

static void test_state(const char *when, const work *input) {
  static host_state before, after;
  static work w;
  w = *input;
  srand(7);
  int first = rand(), second = rand();
  srand(7);
  bool stream = rand() == first;
  capture out = capture_start(stdout), err = capture_start(stderr);
  look(&before);
  work_through(&w);
  look(&after);
  long out_bytes = capture_end(&out, stdout), err_bytes = capture_end(&err, stderr);
  T_CHECK(w.status == BATTEN_OK, "%s: the work is done: %s", when, batten_status_name(w.status));
  T_CHECK(out_bytes == 0 && err_bytes == 0, "%s: %ld bytes on stdout, %ld on stderr", when, out_bytes, err_bytes);
  T_CHECK(stream && rand() == second, "%s: the host's random numbers go on", when);
  T_CHECK(before.rounding == after.rounding && before.traps == after.traps, "%s: rounding mode and traps", when);
  T_CHECK(before.control == after.control, "%s: control bits of the floating-point unit %#x", when, after.control);
  T_CHECK(!strcmp(before.locale, after.locale), "%s: locale %s", when, after.locale);
  T_CHECK(same_actions(before.actions, after.actions), "%s: signal handlers", when);
  T_CHECK(!memcmp(&before.mask, &after.mask, sizeof before.mask), "%s: signal mask", when);
  T_CHECK(!strcmp(before.folder, after.folder) && before.umask_bits == after.umask_bits, "%s: folder, umask", when);
  T_CHECK(before.environment == after.environment, "%s: %zu environment variables", when, after.environment);
  T_CHECK(before.files == after.files, "%s: open files", when);
  T_CHECK(before.blas_threads == after.blas_threads, "%s: BLAS threads %d", when, after.blas_threads);
}

/* The same with everything set to what is unusual. */
static void test_unusual_state(const work *input) {
  setlocale(LC_ALL, "C.UTF-8");
  struct sigaction action = {.sa_handler = on_signal}, old[3];
  const int signals[3] = {SIGINT, SIGFPE, SIGUSR1};
  for (int i = 0; i < 3; i++) sigaction(signals[i], &action, &old[i]);
#ifdef __SSE2__
  unsigned control = _mm_getcsr();
  _mm_setcsr(control | 0x8040); /* flush to zero, denormals are zero */
#endif
  test_state("unusual", input);
#ifdef __SSE2__
  _mm_setcsr(control);
#endif
  for (int i = 0; i < 3; i++) sigaction(signals[i], &old[i], NULL);
  setlocale(LC_ALL, "C");
}

/* ---- where it can be called from ---------------------------------------------------------------- */

static void test_fork(const work *serial) {
  if (blas_number("openblas_get_parallel") == 2) {
    t_skip("a child solves after a fork", "OpenBLAS on OpenMP hangs after a fork");
    return;
  }
  fflush(stdout);
  pid_t child = fork();
  if (child == 0) {
    static work w;
    alarm(10); /* a hang ends here */
    w = *serial;
    memset(w.values, 0, sizeof w.values);
    fit(&w, 2);
    _exit(same_result(&w, serial) ? 0 : 1);
  }
  int status = -1;
  bool waited = child > 0 && waitpid(child, &status, 0) == child;
  T_CHECK(waited && status == 0, "a child solves after a fork, with the same bits: wait status %d", status);
  static work w;
  w = *serial;
  fit(&w, 2);
  T_CHECK(same_result(&w, serial), "and so does the parent");
}

static void *fit_on_thread(void *arg) {
  fit(arg, 1);
  return NULL;
}

static void test_small_stack(const work *serial) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  size_t stack = 1 << 20; /* sanitizers put guards around everything on the stack */
#else
  size_t stack = 128 << 10;
#endif
  static work w;
  w = *serial;
  memset(w.values, 0, sizeof w.values);
  pthread_attr_t attributes;
  pthread_t thread;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, stack);
  bool started = pthread_create(&thread, &attributes, fit_on_thread, &w) == 0;
  if (started) pthread_join(thread, NULL);
  pthread_attr_destroy(&attributes);
  T_CHECK(started && same_result(&w, serial), "a fit on a thread of %zu KiB stack", stack >> 10);
}

enum { HOST_THREADS = 4, REPEATS = 8 };

typedef struct caller {
  const work *serial;
  work mine;
  int wrong;
} caller;

static void *call_often(void *arg) {
  caller *c = arg;
  for (int i = 0; i < REPEATS; i++) {
    c->mine = *c->serial;
    memset(c->mine.values, 0, sizeof c->mine.values);
    fit(&c->mine, 1 + (unsigned)i % 2);
    if (!same_result(&c->mine, c->serial)) c->wrong++;
  }
  return NULL;
}

static void test_host_threads(const work *serial) {
  static caller callers[HOST_THREADS];
  pthread_t threads[HOST_THREADS];
  int started = 0, wrong = 0;
  while (started < HOST_THREADS) {
    callers[started].serial = serial;
    if (pthread_create(&threads[started], NULL, call_often, &callers[started])) break;
    started++;
  }
  for (int i = 0; i < started; i++) {
    pthread_join(threads[i], NULL);
    wrong += callers[i].wrong;
  }
  T_CHECK(started == HOST_THREADS && wrong == 0, "%d host threads with %d fits each: %d differ from the serial bits",
          started, REPEATS, wrong);
}

/* A solid does not change once made: several host threads evaluate one, each with a context of its own. */
typedef struct reader {
  const batten_solid *solid;
  work mine;
} reader;

static void *evaluate_often(void *arg) {
  reader *r = arg;
  batten_context *ctx = t_context(NULL, NULL, 2);
  r->mine.status = ctx ? BATTEN_OK : BATTEN_E_NOMEM;
  for (int i = 0; i < REPEATS && r->mine.status == BATTEN_OK; i++)
    r->mine.status =
        batten_solid_evaluate(ctx, r->solid, PROBES, r->mine.probes[0], r->mine.values, r->mine.gradients[0], NULL);
  batten_context_free(ctx);
  return NULL;
}

static void test_shared_solid(const work *serial) {
  static reader readers[HOST_THREADS];
  pthread_t threads[HOST_THREADS];
  batten_context *ctx = t_context(NULL, NULL, 1);
  batten_solid *solid = NULL;
  int started = 0, right = 0;
  T_OK(batten_solid_fit(ctx, 3, POINTS, serial->points[0], NULL, &solid, NULL), ctx);
  while (started < HOST_THREADS) {
    readers[started].solid = solid;
    readers[started].mine = *serial;
    memset(readers[started].mine.values, 0, sizeof serial->values);
    if (pthread_create(&threads[started], NULL, evaluate_often, &readers[started])) break;
    started++;
  }
  for (int i = 0; i < started; i++) {
    pthread_join(threads[i], NULL);
    right += same_result(&readers[i].mine, serial);
  }
  T_CHECK(right == HOST_THREADS, "%d of %d host threads evaluate one solid to the serial bits", right, HOST_THREADS);
  batten_solid_free(solid);
  batten_context_free(ctx);
}

static void test_thread_counts(const work *serial) {
  static work w;
  for (unsigned threads = 2; threads <= 8; threads += 3) {
    w = *serial;
    memset(w.values, 0, sizeof w.values);
    fit(&w, threads);
    T_CHECK(same_result(&w, serial), "same bits on %u threads", threads);
  }
}

int main(void) {
  static work serial;
  make_work(&serial);
  T_CHECK(fit(&serial, 1) == BATTEN_OK, "the reference fit: %s", batten_status_name(serial.status));
  test_state("usual", &serial);
  test_unusual_state(&serial);
  test_thread_counts(&serial);
  test_fork(&serial);
  test_small_stack(&serial);
  test_host_threads(&serial);
  test_shared_solid(&serial);
  return t_done();
}
