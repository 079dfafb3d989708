/* The polygoniser alone, by the number of triangles, as a Markdown table: surfaces of cheap fields (a bumpy ball, a
 * torus) with seeds all over, seconds of its phases and of the field in them, evaluations, memory, on one and two
 * threads. Usage: bench-polygonize [--threads N] [--cpu] [TRIANGLES ...]; default 1 and 2, 30000 300000 3000000.
 * --cpu gives the seconds of all threads together, which a busy machine changes less. */
#include "tap.h"

#include <batten/batten.h>
#include <time.h>

typedef struct shape {
  const char *name;
  double area; /* about */
  long genus;
  batten_status (*evaluate)(const void *, batten_context *, size_t, const double *, double *, double *, double *);
  void (*seed)(uint64_t *, double *);
} shape;

static double field_seconds; /* of the run */
static bool use_cpu;         /* seconds of all threads in place of those of a clock */

static double now(void) {
  struct timespec t;
  if (!use_cpu) return batten_now();
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* ---- fields -------------------------------------------------------------------------------------- */

/* 1 + h - |x| with the bumps h = a sin(kx) sin(ky) sin(kz). */
static const double BUMP = 0.1, WAVE = 6;

static double bumps(const double *x, double *gradient) {
  double s[3], c[3];
  for (int k = 0; k < 3; k++) s[k] = sin(WAVE * x[k]), c[k] = cos(WAVE * x[k]);
  if (gradient)
    for (int k = 0; k < 3; k++) gradient[k] = BUMP * WAVE * c[k] * s[(k + 1) % 3] * s[(k + 2) % 3];
  return BUMP * s[0] * s[1] * s[2];
}

static double bumpy_ball_at(const double *x, double *g) {
  double length = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]), value = 1 + bumps(x, g) - length;
  for (int k = 0; g && k < 3; k++) g[k] -= x[k] / length;
  return value;
}

static double torus_at(const double *x, double *g) {
  double ring = sqrt(x[0] * x[0] + x[1] * x[1]), u = ring - 1, d = sqrt(u * u + x[2] * x[2]);
  if (g) g[0] = -u / d * x[0] / ring, g[1] = -u / d * x[1] / ring, g[2] = -x[2] / d;
  return 0.4 - d;
}

typedef struct batch {
  double (*at)(const double *, double *);
  size_t count;
  const double *points;
  double *values, *gradients;
} batch;

enum { TASK = 4096 };

static void evaluate_task(void *arg, size_t task) {
  const batch *b = arg;
  size_t end = (task + 1) * TASK < b->count ? (task + 1) * TASK : b->count;
  for (size_t i = task * TASK; i < end; i++)
    b->values[i] = b->at(b->points + 3 * i, b->gradients ? b->gradients + 3 * i : NULL);
}

static batten_status evaluate(batten_context *ctx, batch b) {
  double start = now();
  batten_parallel(ctx, (b.count + TASK - 1) / TASK, evaluate_task, &b);
  field_seconds += now() - start;
  return BATTEN_OK;
}

static batten_status evaluate_ball(const void *user, batten_context *ctx, size_t count, const double *points,
                                   double *values, double *gradients, double *hessians) {
  (void)user, (void)hessians;
  return evaluate(ctx, (batch){bumpy_ball_at, count, points, values, gradients});
}

static batten_status evaluate_torus(const void *user, batten_context *ctx, size_t count, const double *points,
                                    double *values, double *gradients, double *hessians) {
  (void)user, (void)hessians;
  return evaluate(ctx, (batch){torus_at, count, points, values, gradients});
}

static void ball_seed(uint64_t *state, double *x) {
  double z = 2 * t_uniform(state) - 1, a = 8 * atan(1) * t_uniform(state), s = sqrt(1 - z * z), length = 1;
  const double d[3] = {s * cos(a), s * sin(a), z};
  for (int round = 0; round < 20; round++) {
    for (int k = 0; k < 3; k++) x[k] = length * d[k];
    length = 0.5 * length + 0.5 * (1 + bumps(x, NULL));
  }
}

static void torus_seed(uint64_t *state, double *x) {
  double a = 8 * atan(1) * t_uniform(state), b = 8 * atan(1) * t_uniform(state), ring = 1 + 0.4 * cos(b);
  x[0] = ring * cos(a), x[1] = ring * sin(a), x[2] = 0.4 * sin(b);
}

static const shape shapes[] = {{"bumpy ball", 14.3, 0, evaluate_ball, ball_seed},
                               {"torus", 15.8, 1, evaluate_torus, torus_seed}};

/* ---- one run ------------------------------------------------------------------------------------- */

static const char *const phases[] = {"surface", "improve", "settle", "crossings"};
enum { PHASES = sizeof phases / sizeof *phases };

typedef struct clock {
  double last, seconds[PHASES], longest; /* between two calls */
  int phase;
} stopwatch;

static int on_progress(void *user, const char *phase, double fraction) {
  stopwatch *w = user;
  double time = now();
  (void)fraction;
  if (w->phase >= 0) w->seconds[w->phase] += time - w->last;
  w->longest = fmax(w->longest, time - w->last);
  w->last = time;
  for (int i = 0; i < PHASES; i++)
    if (!strcmp(phase, phases[i])) w->phase = i;
  return 0;
}

typedef struct row {
  size_t triangles;
  double total;
} row;

static bool run(const shape *s, size_t wanted, unsigned threads, row *out) {
  stopwatch watch = {.phase = -1};
  batten_context_options o = batten_context_options_default();
  o.threads = threads;
  o.progress = on_progress;
  o.progress_user = &watch;
  batten_context *ctx = NULL;
  size_t count = wanted / 3;
  double *seeds = malloc(count * 3 * sizeof *seeds);
  if (!seeds || batten_context_new(&o, &ctx) < 0) return false;
  uint64_t state = 1;
  for (size_t i = 0; i < count; i++) s->seed(&state, seeds + 3 * i);
  batten_field field = {.dimension = 3, .order = 1, .evaluate = s->evaluate};
  batten_polygonize_options p = batten_polygonize_options_default();
  p.cell = 1.445 * sqrt(s->area / (double)wanted); /* 1.52 sqrt for equilateral triangles */
  batten_mesh *mesh = NULL;
  batten_polygonize_info info;
  batten_mesh_measures m = {0};
  field_seconds = 0;
  double start = now();
  watch.last = start;
  batten_status st = batten_polygonize(ctx, &field, count, seeds, &p, &mesh, &info);
  on_progress(&watch, "", 0);
  double total = now() - start, field_total = field_seconds;
  double peak = (double)batten_bytes_peak(ctx);
  watch.phase = -1;
  watch.last = start = now();
  if (st >= 0) st = batten_mesh_measure(ctx, mesh, &m);
  double measure = now() - start;
  if (st != BATTEN_OK || !m.closed || !m.manifold || m.genus != s->genus)
    printf("%s: %s: %s; genus %ld\n", s->name, batten_status_text(st), batten_error(ctx), m.genus);
  if (st >= 0) {
    const double *t = watch.seconds;
    printf("| %s | %u | %zu | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f | %.0f | %.1f | %.3f | %.2f |\n",
           s->name, threads, m.triangles, t[0], t[1], t[2], t[3], total, field_total, measure,
           (double)info.evaluations / (double)m.triangles, peak / (double)m.vertices, m.angle_min_deg,
           m.angles_above_20deg * 100, watch.longest);
    fflush(stdout);
    *out = (row){m.triangles, total - field_total};
  }
  batten_mesh_free(mesh);
  batten_context_free(ctx);
  free(seeds);
  return st >= 0;
}

/* Slope of log time over log triangles by least squares. */
static double exponent(const row *rows, size_t count) {
  double x = 0, y = 0, xx = 0, xy = 0, n = (double)count;
  for (size_t i = 0; i < count; i++) {
    double a = log((double)rows[i].triangles), b = log(rows[i].total);
    x += a, y += b, xx += a * a, xy += a * b;
  }
  return (n * xy - x * y) / (n * xx - x * x);
}

int main(int argc, char **argv) {
  enum { MOST = 16 };
  size_t sizes[MOST] = {30000, 300000, 3000000}, count = 0;
  unsigned least = 1, most = 2;
  for (int i = 1; i < argc; i++) {
    if (!strcmp(argv[i], "--threads") && i + 1 < argc)
      least = most = (unsigned)strtoul(argv[++i], NULL, 10);
    else if (!strcmp(argv[i], "--cpu"))
      use_cpu = true;
    else if (count < MOST)
      sizes[count++] = (size_t)strtoul(argv[i], NULL, 10);
  }
  if (count == 0) count = 3;
  printf(
      "batten %s; a third as many seeds as triangles, options as they are by default but for the cell\n\n"
      "| surface | threads | triangles | track s | improve s | settle s | crossings s | all s | of it the field s | "
      "measure s | evaluations a triangle | bytes a vertex | least angle | angles above 20 deg, %% | longest without "
      "progress s |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
      batten_version());
  for (size_t k = 0; k < sizeof shapes / sizeof *shapes; k++)
    for (unsigned threads = least; threads <= most; threads++) {
      row rows[MOST];
      size_t done = 0;
      for (size_t i = 0; i < count; i++)
        if (sizes[i] >= 100) done += run(shapes + k, sizes[i], threads, rows + done);
      if (done > 1)
        printf("\nThe time without the field grows as F^%.2f (%s, %u threads).\n\n", exponent(rows, done),
               shapes[k].name, threads);
    }
  return 0;
}
