/* Fits of many points by iteration on fast sums, as Markdown tables: one for each accuracy, a row for each N, and how
 * the time grows from row to row. Random points of a bumpy sphere, or of a cube, the values of a ball; or points of a
 * file, all of them. Usage:
 *   bench-large [--accuracy EPS]... [--order M] [--cube] [--data FILE] [--dense N_MAX] [--json FILE] [N ...]
 *   --accuracy  of the residual on direct rows; default 1e-6, then 2e-9: the iteration goes on to half of that
 *   --order     2 (kernel r, the default), 3 (r^3)
 *   --cube      points that fill a volume, in place of a surface
 *   --data      lines "x y z", or "x y z value"; without values those of a ball around the points
 *   --dense     a fit by factors too, up to that N: Cholesky, from 2000 on its mixed form
 *   N           default 10000 40000 100000 300000
 * "silent" is the longest time without a progress call, which is what a host waits at most for a cancel, and its
 * phase. Each row is a process of its own, whose peak of resident memory is told beside what batten had taken at
 * most. Short fits are repeated, the fastest counts. */
#include "tap.h"

#include <batten/batten.h>
#include <sys/wait.h>
#include <unistd.h>

#include "peak.h"
#include "silence.h"

enum { MOST_SIZES = 32, MOST_ACCURACIES = 8, REPEATS = 5 };
static const double REPEAT_BELOW_S = 0.3;

typedef struct settings {
  unsigned order, threads;
  bool cube;
  const char *data;
  size_t dense_most, sizes[MOST_SIZES], size_count;
  double accuracies[MOST_ACCURACIES];
  size_t accuracy_count;
} settings;

typedef struct row {
  bool done;
  size_t n, bytes, resident, dense_bytes;
  double accuracy, total, product, dense;
  silence silence;
  batten_spline_info info;
} row;

/* ---- Points ---- */

/* A ball's function is a polynomial that splines of order 3 reproduce: theirs is the distance from the sphere. */
static double ball(const double x[3], const double center[3], double radius, unsigned order) {
  double square = 0;
  for (int a = 0; a < 3; a++) square += (x[a] - center[a]) * (x[a] - center[a]) / (radius * radius);
  return 1 - (order > 2 ? sqrt(square) : square);
}

static void bumpy_sphere(size_t n, unsigned order, double *points, double *values) {
  uint64_t seed = 1;
  for (size_t i = 0; i < n; i++) {
    double z = 2 * t_uniform(&seed) - 1, a = 8 * atan(1) * t_uniform(&seed), s = sqrt(1 - z * z), *x = points + 3 * i;
    double radius = 1 + 0.1 * sin(5 * a) * s * s + 0.05 * cos(9 * z);
    x[0] = radius * s * cos(a), x[1] = radius * s * sin(a), x[2] = radius * z;
    values[i] = ball(x, (double[3]){0}, 1, order);
  }
}

static void cube(size_t n, unsigned order, double *points, double *values) {
  uint64_t seed = 1;
  for (size_t i = 0; i < n; i++) {
    for (int a = 0; a < 3; a++) points[3 * i + (size_t)a] = 2 * t_uniform(&seed) - 1;
    values[i] = ball(points + 3 * i, (double[3]){0}, 1, order);
  }
}

static void ball_around(size_t n, unsigned order, const double *points, double *values) {
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, center[3], radius = 0;
  for (size_t i = 0; i < 3 * n; i++) {
    low[i % 3] = fmin(low[i % 3], points[i]);
    high[i % 3] = fmax(high[i % 3], points[i]);
  }
  for (int a = 0; a < 3; a++) {
    center[a] = 0.5 * (low[a] + high[a]);
    radius = fmax(radius, 0.5 * (high[a] - low[a]));
  }
  for (size_t i = 0; i < n; i++) values[i] = ball(points + 3 * i, center, radius, order);
}

/* Lines that do not begin with three numbers are passed over. NULL: no such file, or no memory. */
static double *read_points(const char *path, unsigned order, size_t *count) {
  FILE *file = fopen(path, "r");
  char line[1024];
  double *points = NULL, *values = NULL;
  size_t n = 0, room = 0, valued = 0;
  if (!file) return NULL;
  while (fgets(line, sizeof line, file)) {
    double x[4];
    int numbers = sscanf(line, "%lf%*1[ ,;\t]%lf%*1[ ,;\t]%lf%*1[ ,;\t]%lf", x, x + 1, x + 2, x + 3);
    if (numbers < 3) continue;
    if (n == room) {
      room = 2 * room + 1024;
      double *more = realloc(points, 3 * room * sizeof *points);
      if (more) points = more;
      double *also = more ? realloc(values, room * sizeof *values) : NULL;
      if (!also) break;
      values = also;
    }
    memcpy(points + 3 * n, x, 3 * sizeof *x);
    values[n++] = numbers > 3 ? x[3] : 0;
    valued += numbers > 3;
  }
  fclose(file);
  double *all = n ? malloc(4 * n * sizeof *all) : NULL;
  if (all) {
    memcpy(all, points, 3 * n * sizeof *all);
    if (valued == n)
      memcpy(all + 3 * n, values, n * sizeof *all);
    else
      ball_around(n, order, all, all + 3 * n);
  }
  free(points);
  free(values);
  *count = n;
  return all;
}

/* points [n][3], then values [n]. */
static double *make_data(const settings *s, size_t *n) {
  if (s->data) return read_points(s->data, s->order, n);
  double *points = malloc(4 * *n * sizeof *points);
  if (points) (s->cube ? cube : bumpy_sphere)(*n, s->order, points, points + 3 * *n);
  return points;
}

/* ---- Measuring ---- */

/* One product of all points with all, as accurate as the fit had it; the second, so that memory is warm. */
static double product_time(batten_context *ctx, const batten_spline_data *d, int power, double accuracy) {
  batten_fmm_options o = batten_fmm_options_default();
  o.accuracy = fmin(fmax(accuracy, 1e-12), 1e-3);
  batten_radial kernel = {.n = 3, .power = power};
  batten_fmm *sums = NULL;
  double *y = malloc(d->count * sizeof *y), time = NAN;
  batten_status st = y ? batten_fmm_create(ctx, &kernel, d->count, d->points, d->count, NULL, &o, &sums) : -1;
  for (int k = 0; st >= 0 && k < 2; k++) {
    double start = batten_now();
    st = batten_fmm_apply(ctx, sums, d->values, NULL, y, NULL);
    time = batten_now() - start;
  }
  batten_fmm_free(sums);
  free(y);
  return st >= 0 ? time : NAN;
}

static bool fit(batten_context *ctx, const batten_spline_data *d, const batten_spline_options *o, row *out) {
  double all = 0;
  out->total = INFINITY;
  for (int k = 0; k < REPEATS && (k == 0 || all < REPEAT_BELOW_S); k++) {
    batten_spline *s = NULL;
    batten_spline_info info;
    batten_bytes_peak_reset(ctx);
    double start = batten_now();
    silence_begin(&out->silence);
    batten_status st = batten_spline_fit(ctx, d, o, &s, &info);
    silence_end(&out->silence);
    double time = batten_now() - start;
    batten_spline_free(s);
    if (st != BATTEN_OK) printf("\nN = %zu: %s: %s\n\n", d->count, batten_status_text(st), batten_error(ctx));
    if (st < 0) return false;
    if (time < out->total) out->total = time, out->info = info;
    out->bytes = batten_bytes_peak(ctx);
    all += time;
  }
  return true;
}

static row measure(const settings *s, size_t n, double accuracy, bool dense) {
  row out = {.n = n, .accuracy = accuracy, .dense = NAN};
  batten_context_options c = batten_context_options_default();
  batten_context *ctx = NULL;
  batten_spline_data d = batten_spline_data_default();
  batten_spline_options o = batten_spline_options_default();
  double *points = make_data(s, &out.n);
  c.threads = s->threads;
  c.progress = silence_heard, c.progress_user = &out.silence;
  if (points && batten_context_new(&c, &ctx) >= 0) {
    d.count = out.n, d.points = points, d.values = points + 3 * out.n;
    o.m = s->order;
    o.loo_samples = 0;
    o.saddle.method = !dense         ? BATTEN_SADDLE_ITERATIVE
                      : out.n < 2000 ? BATTEN_SADDLE_CHOLESKY
                                     : BATTEN_SADDLE_CHOLESKY_MIXED;
    o.saddle.accuracy = accuracy;
    out.done = fit(ctx, &d, &o, &out);
    out.resident = peak_resident();
    if (out.done && !dense)
      out.product = product_time(ctx, &d, 2 * (int)s->order - 3, out.info.saddle.products_accuracy);
  }
  batten_context_free(ctx);
  free(points);
  return out;
}

/* The same in a process of its own, so that nothing is left over from the row before, neither memory nor its peak. */
static row measure_apart(const settings *s, size_t n, double accuracy, bool dense) {
  row out = {.n = n};
  int ends[2];
  if (pipe(ends)) return out;
  fflush(stdout);
  pid_t child = fork();
  if (child == 0) {
    row own = measure(s, n, accuracy, dense);
    fflush(stdout);
    _exit(write(ends[1], &own, sizeof own) != (ssize_t)sizeof own);
  }
  close(ends[1]);
  row got;
  if (child > 0 && read(ends[0], &got, sizeof got) == (ssize_t)sizeof got) out = got;
  close(ends[0]);
  if (child > 0) waitpid(child, NULL, 0);
  if (!out.done) printf("\n%zu points: no result\n\n", n);
  return out;
}

/* ---- Tables ---- */

static double solving(const row *r) { return r->info.saddle.time_setup_s + r->info.saddle.time_solve_s; }

/* Slope of log(set-up + solve) over log N, by least squares. */
static double exponent(const row *rows, size_t count) {
  double x = 0, y = 0, xx = 0, xy = 0, n = (double)count;
  for (size_t i = 0; i < count; i++) {
    double a = log((double)rows[i].n), b = log(solving(&rows[i]));
    x += a, y += b, xx += a * a, xy += a * b;
  }
  return (n * xy - x * y) / (n * xx - x * x);
}

static const char *scene_name(const settings *s) {
  return s->data ? s->data : s->cube ? "cube, seed 1" : "bumpy sphere, seed 1";
}

static void print_head(const settings *s, double accuracy) {
  printf("\n%s, order %u, accuracy %g\n\n", scene_name(s), s->order, accuracy);
  printf(
      "| N | levels | set-up s | its 1e-3 / 1e-6 / 1e-9 (all) | s per product | solve s | set-up + solve s | grows "
      "as N^ "
      "| whole fit s | GB (process) | residual, 1000 direct rows | products | largest | silent s "
      "| by factors s, GB |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
}

static void print_row(const row *r, const row *before) {
  const batten_saddle_info *i = &r->info.saddle;
  printf("| %zu | ", r->n);
  for (size_t q = 0; q < sizeof i->level_sizes / sizeof *i->level_sizes && i->level_sizes[q]; q++)
    printf("%s%zu", q ? ", " : "", i->level_sizes[q]);
  if (i->domains_double) printf(" (%zu of %zu domains in double)", i->domains_double, i->domains);
  printf(" | %.2f |", i->time_setup_s);
  for (int q = 0; q < 3; q++) {
    printf("%s", q ? " / " : " ");
    if (i->iterations_to[q])
      printf("%u", i->iterations_to[q]);
    else
      printf("-");
  }
  printf(" (%u) | %.3f | %.2f | %.2f |", i->iterations, r->product, i->time_solve_s, solving(r));
  if (before)
    printf(" %.2f |", log(solving(r) / solving(before)) / log((double)r->n / (double)before->n));
  else
    printf(" |");
  printf(" %.2f | %.2f (%.2f) | %.1e | %.0e | %.1e | %.2f (%s) |", r->total, (double)r->bytes / 1e9,
         (double)r->resident / 1e9, i->residual_rows, i->products_accuracy, r->info.residual_max, r->silence.longest,
         r->silence.longest_in);
  if (isnan(r->dense))
    printf(" |\n");
  else
    printf(" %.2f, %.2f |\n", r->dense, (double)r->dense_bytes / 1e9);
  fflush(stdout);
}

/* ---- For machines ---- */

static void json_number(FILE *json, const char *name, double value) {
  if (isfinite(value))
    fprintf(json, ", \"%s\": %.9g", name, value);
  else
    fprintf(json, ", \"%s\": null", name);
}

static void json_row(FILE *json, const row *r, bool first) {
  const batten_saddle_info *i = &r->info.saddle;
  fprintf(json, "%s\n    {\"n\": %zu", first ? "" : ",", r->n);
  json_number(json, "accuracy", r->accuracy);
  fprintf(json, ", \"levels\": [");
  for (size_t q = 0; q < sizeof i->level_sizes / sizeof *i->level_sizes && i->level_sizes[q]; q++)
    fprintf(json, "%s%zu", q ? ", " : "", i->level_sizes[q]);
  fprintf(json, "], \"domains\": %zu, \"domains_double\": %zu, \"iterations\": %u, \"iterations_to\": [%u, %u, %u]",
          i->domains, i->domains_double, i->iterations, i->iterations_to[0], i->iterations_to[1],
          i->iterations_to[2]);
  json_number(json, "setup_s", i->time_setup_s);
  json_number(json, "product_s", r->product);
  json_number(json, "solve_s", i->time_solve_s);
  json_number(json, "fit_s", r->total);
  json_number(json, "bytes", (double)r->bytes);
  json_number(json, "resident_bytes", (double)r->resident);
  json_number(json, "residual_rows", i->residual_rows);
  json_number(json, "products_accuracy", i->products_accuracy);
  json_number(json, "residual_max", r->info.residual_max);
  json_number(json, "silent_s", r->silence.longest);
  json_number(json, "factors_s", r->dense);
  json_number(json, "factors_bytes", isnan(r->dense) ? NAN : (double)r->dense_bytes);
  fprintf(json, "}");
}

/* ---- All ---- */

static size_t table(const settings *s, double accuracy, FILE *json, size_t told) {
  row rows[MOST_SIZES];
  size_t done = 0;
  print_head(s, accuracy);
  for (size_t i = 0; i < s->size_count; i++) {
    row r = measure_apart(s, s->sizes[i], accuracy, false);
    if (!r.done) continue;
    row dense = {.dense = NAN};
    if (r.n <= s->dense_most) dense = measure_apart(s, s->sizes[i], accuracy, true);
    if (dense.done) r.dense = dense.total, r.dense_bytes = dense.bytes;
    rows[done] = r;
    print_row(&rows[done], done ? &rows[done - 1] : NULL);
    if (json) json_row(json, &rows[done], told + done == 0);
    done++;
  }
  if (done > 1) printf("\nSet-up and solve grow as N^%.2f.\n", exponent(rows, done));
  return done;
}

static bool read_arguments(int argc, char **argv, settings *s, const char **json) {
  for (int i = 1; i < argc; i++) {
    const char *word = argv[i], *value = i + 1 < argc ? argv[i + 1] : NULL;
    if (!strcmp(word, "--cube")) {
      s->cube = true;
      continue;
    }
    if (strncmp(word, "--", 2) == 0 && !value) return false;
    if (!strcmp(word, "--accuracy") && s->accuracy_count < MOST_ACCURACIES)
      s->accuracies[s->accuracy_count++] = strtod(argv[++i], NULL);
    else if (!strcmp(word, "--order"))
      s->order = (unsigned)strtoul(argv[++i], NULL, 10);
    else if (!strcmp(word, "--data"))
      s->data = argv[++i];
    else if (!strcmp(word, "--dense"))
      s->dense_most = strtoul(argv[++i], NULL, 10);
    else if (!strcmp(word, "--json"))
      *json = argv[++i];
    else if (word[0] != '-' && s->size_count < MOST_SIZES && strtoul(word, NULL, 10) > 10)
      s->sizes[s->size_count++] = strtoul(word, NULL, 10);
    else
      return false;
  }
  return true;
}

int main(int argc, char **argv) {
  settings s = {.order = 2, .threads = (unsigned)sysconf(_SC_NPROCESSORS_ONLN)};
  const char *path = NULL;
  if (!read_arguments(argc, argv, &s, &path)) {
    fprintf(stderr,
            "usage: bench-large [--accuracy EPS]... [--order M] [--cube] [--data FILE] [--dense N_MAX] [--json FILE] "
            "[N ...]\n");
    return 2;
  }
  if (s.accuracy_count == 0) s.accuracies[s.accuracy_count++] = 1e-6, s.accuracies[s.accuracy_count++] = 2e-9;
  if (s.data) {
    s.sizes[0] = 0, s.size_count = 1;
  } else if (s.size_count == 0) {
    const size_t sizes[] = {10000, 40000, 100000, 300000};
    s.size_count = sizeof sizes / sizeof *sizes;
    memcpy(s.sizes, sizes, sizeof sizes);
  }
  FILE *json = path ? fopen(path, "w") : NULL;
  if (path && !json) {
    fprintf(stderr, "%s: cannot be written\n", path);
    return 2;
  }
  char blas[256];
  batten_blas_describe(blas, sizeof blas);
  printf("batten %s, %u threads, BLAS: %s, %u threads\n", batten_version(), s.threads, blas, batten_blas_threads());
  if (json)
    fprintf(json,
            "{\"batten\": \"%s\", \"threads\": %u, \"blas\": \"%s\", \"blas_threads\": %u, \"order\": %u, "
            "\"points\": \"%s\",\n"
            "  \"rows\": [",
            batten_version(), s.threads, blas, batten_blas_threads(), s.order, scene_name(&s));
  size_t told = 0;
  for (size_t q = 0; q < s.accuracy_count; q++) told += table(&s, s.accuracies[q], json, told);
  if (json) fprintf(json, "\n  ]}\n");
  if (json && fclose(json)) return 1;
  return told == 0;
}
