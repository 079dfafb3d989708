/* The Maros-Meszaros collection of convex quadratic programs [Maros, Meszaros, Optimization Methods and Software
 * 1999]: every file of a folder at three tolerances, primal and dual residual and duality gap all absolute, as the
 * public benchmarks of solvers count them. "Solved" means that the three are below the tolerance and the solver says
 * so; "correct" that what it says is what the residuals say. Each solve runs in a process of its own, so that a limit
 * that is not kept or a crash is one failure among others. Usage: maros-meszaros [--csv FILE] [--solutions FOLDER]
 * [--limit SECONDS] [--only TOLERANCE] [--engine 0..3] [FOLDER or FILE ...] Default: data/qp beneath BATTEN_SHARED,
 * 20 s a solve. The residuals are those of batten's judge; with --solutions, x and multipliers at the last tolerance
 * are written as JSON for check_solutions.py, which judges them on its own. */
#include <batten/blas.h>
#include <batten/exchange.h>
#include <dirent.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

enum { DENSE_LIMIT = 1000, PATH_LENGTH = 4096, TOLERANCES = 3 };
static const double usual_tolerances[TOLERANCES] = {1e-3, 1e-6, 1e-9};
static const char *const engine_names[] = {"-", "primal", "dual", "interior"};

typedef struct settings {
  const char *csv, *solutions;
  double limit_s;
  double tolerances[TOLERANCES];
  size_t tolerance_count;
  batten_qp_engine engine;
} settings;

/* What the process of a solve sends back. */
typedef struct outcome {
  size_t n, m;
  bool dense, definite; /* subsets */
  bool answered;        /* false: crashed, or ended past the limit */
  batten_status status;
  double seconds;
  batten_qp_info info;
} outcome;

/* ---- Subsets ---- */

static double entry(const batten_matrix *m, size_t i, size_t j) {
  if (m->dense) return m->dense[i * m->columns + j];
  for (size_t k = m->starts[i]; k < m->starts[i + 1]; k++)
    if (m->indices[k] == j) return m->values[k];
  return 0;
}

/* By Cholesky; a pivot below 1e-12 of the largest diagonal entry counts as zero, as an eigenvalue of that size would.
 */
static bool is_definite(const batten_matrix *h, size_t n) {
  if (!h || n == 0) return false;
  double largest = 0;
  for (size_t i = 0; i < n; i++) largest = fmax(largest, entry(h, i, i));
  for (size_t i = 0; i < n; i++)
    if (entry(h, i, i) <= 1e-12 * largest) return false;
  double *l = calloc(n * n, sizeof *l);
  bool definite = l != NULL;
  for (size_t i = 0; definite && i < n; i++) {
    if (h->dense)
      memcpy(l + i * n, h->dense + i * n, n * sizeof *l);
    else
      for (size_t k = h->starts[i]; k < h->starts[i + 1]; k++) l[i * n + h->indices[k]] = h->values[k];
    for (size_t j = 0; j <= i; j++) {
      double sum = l[i * n + j];
      for (size_t k = 0; k < j; k++) sum -= l[i * n + k] * l[j * n + k];
      if (j < i)
        l[i * n + j] = sum / l[j * n + j];
      else if (sum > 1e-12 * largest)
        l[i * n + i] = sqrt(sum);
      else
        definite = false;
    }
  }
  free(l);
  return definite;
}

/* ---- One solve ---- */

static const char *base_name(const char *path) {
  const char *slash = strrchr(path, '/');
  return slash ? slash + 1 : path;
}

static void write_solution(batten_context *ctx, const settings *s, const char *path, const batten_qp_file *file,
                           batten_status status, const batten_qp_solution *solution) {
  char to[PATH_LENGTH];
  const char *name = base_name(path);
  snprintf(to, sizeof to, "%s/%.*s.json", s->solutions, (int)strcspn(name, "."), name);
  if (batten_write_qp_solution(ctx, file, status, solution, to) < 0) fprintf(stderr, "%s\n", batten_error(ctx));
}

/* Reads and solves; a file that cannot be read has n = 0. */
static outcome solve_file(const settings *s, const char *path, double tolerance, bool keep) {
  outcome out = {.status = BATTEN_E_NOMEM};
  batten_context *ctx = NULL;
  batten_qp_file file;
  if (batten_context_new(NULL, &ctx) < 0) return out;
  out.status = batten_read_qp(ctx, path, &file);
  if (out.status < 0) {
    fprintf(stderr, "%s\n", batten_error(ctx));
    batten_context_free(ctx);
    return out;
  }
  const batten_qp_problem *p = &file.problem;
  out.n = p->n, out.m = p->c ? p->c->rows : 0;
  out.dense = out.n <= DENSE_LIMIT && out.m <= DENSE_LIMIT;
  out.definite = out.dense && is_definite(p->h, p->n);
  batten_qp_options o = batten_qp_options_default();
  o.tolerance_absolute = tolerance, o.tolerance_relative = 0;
  o.time_limit_s = s->limit_s;
  o.engine = s->engine;
  o.x0 = file.x0;
  double *x = malloc((2 * out.n + out.m) * sizeof *x);
  if (x) {
    batten_qp_solution solution = {.x = x, .multipliers = x + out.n};
    double start = batten_now();
    out.status = batten_qp_solve(ctx, p, &o, NULL, &solution, &out.info);
    out.seconds = batten_now() - start;
    if (keep && out.status >= 0) write_solution(ctx, s, path, &file, out.status, &solution);
  }
  free(x);
  batten_qp_file_free(ctx, &file);
  batten_context_free(ctx);
  return out;
}

/* The same in a process of its own that is ended past the limit. before: of an earlier tolerance, whose sizes hold.
 */
static outcome solve_apart(const settings *s, const char *path, double tolerance, bool keep, const outcome *before) {
  outcome out = *before;
  out.answered = false;
  int ends[2];
  if (pipe(ends)) return out;
  fflush(stdout);
  pid_t child = fork();
  if (child == 0) {
    outcome own = solve_file(s, path, tolerance, keep);
    _exit(write(ends[1], &own, sizeof own) != (ssize_t)sizeof own);
  }
  close(ends[1]);
  struct pollfd ready = {.fd = ends[0], .events = POLLIN};
  outcome got;
  if (child > 0 && poll(&ready, 1, (int)(1e3 * (1.5 * s->limit_s + 5))) > 0 &&
      read(ends[0], &got, sizeof got) == (ssize_t)sizeof got)
    out = got, out.answered = true;
  close(ends[0]);
  if (child > 0) {
    kill(child, SIGKILL);
    waitpid(child, NULL, 0);
  }
  return out;
}

/* ---- Counting ---- */

static bool holds(const outcome *o, double tolerance) {
  return o->answered && o->status >= 0 && o->info.primal_residual <= tolerance &&
         o->info.dual_residual <= tolerance && o->info.duality_gap <= tolerance;
}
static bool solved(const outcome *o, double tolerance) { return o->status == BATTEN_OK && holds(o, tolerance); }
static bool claims(const outcome *o) { return o->answered && o->status == BATTEN_OK; }

typedef struct count {
  size_t given, solved, correct;
  double log_sum; /* of time + 10 s, failures at the limit */
} count;
typedef enum subset { ALL, DENSE, DENSE_DEFINITE, SUBSETS } subset;
static const char *const subset_names[] = {"all", "dense (n, m <= 1000)", "dense, H positive definite"};

static void add(count *c, const outcome *o, double tolerance, double limit_s) {
  c->given++;
  c->solved += solved(o, tolerance);
  c->correct += claims(o) == holds(o, tolerance);
  c->log_sum += log(10 + (solved(o, tolerance) ? o->seconds : limit_s));
}

static void print_row(FILE *csv, const char *path, double tolerance, const outcome *o) {
  const char *name = base_name(path);
  int length = (int)strcspn(name, ".");
  const batten_qp_info *i = &o->info;
  const char *status = o->answered ? batten_status_name(o->status) : "ended from outside";
  const char *engine = engine_names[o->answered && (unsigned)i->engine < 4 ? i->engine : 0];
  printf("| %.*s | %zu | %zu | %s%s | %.0e | %s | %s | %s | %zu | %.3g | %.1e | %.1e | %.1e |\n", length, name, o->n,
         o->m, o->dense ? "d" : "", o->definite ? "p" : "", tolerance, solved(o, tolerance) ? "yes" : "**no**",
         status, engine, i->iterations, 1e3 * o->seconds, i->primal_residual, i->dual_residual, i->duality_gap);
  fflush(stdout);
  if (csv)
    fprintf(csv, "%.*s,%zu,%zu,%d,%d,%.0e,%d,%s,%s,%zu,%zu,%zu,%.6g,%.3e,%.3e,%.3e,%.17g\n", length, name, o->n, o->m,
            o->dense, o->definite, tolerance, solved(o, tolerance), status, engine, i->iterations, i->proximal_steps,
            i->rows_active, o->seconds, i->primal_residual, i->dual_residual, i->duality_gap, i->objective);
}

static void print_rates(const settings *s, count counts[TOLERANCES][SUBSETS]) {
  printf(
      "\n| problems | tolerance | solved | of | rate | correct | time, shifted geometric mean (10 s) |\n"
      "|---|---|---|---|---|---|---|\n");
  for (int q = 0; q < SUBSETS; q++)
    for (size_t t = 0; t < s->tolerance_count; t++) {
      const count *c = &counts[t][q];
      if (c->given == 0) continue;
      double given = (double)c->given;
      printf("| %s | %.0e | %zu | %zu | %.1f %% | %.1f %% | %.4f s |\n", subset_names[q], s->tolerances[t], c->solved,
             c->given, 100 * (double)c->solved / given, 100 * (double)c->correct / given,
             exp(c->log_sum / given) - 10);
    }
}

/* ---- Files ---- */

typedef struct files {
  char **paths;
  size_t length;
} files;

static int by_text(const void *a, const void *b) { return strcmp(*(char *const *)a, *(char *const *)b); }

static void add_path(files *f, const char *folder, const char *name) {
  size_t length = strlen(folder) + strlen(name) + 2;
  char **grown = realloc(f->paths, (f->length + 1) * sizeof *grown), *path = malloc(length);
  if (!grown || !path) exit(1);
  snprintf(path, length, "%s%s%s", folder, *folder ? "/" : "", name);
  f->paths = grown;
  f->paths[f->length++] = path;
}

static bool ends_with(const char *text, const char *end) {
  size_t a = strlen(text), b = strlen(end);
  return a > b && !strcmp(text + a - b, end);
}

static void add_place(files *f, const char *place) {
  DIR *folder = opendir(place);
  if (!folder) {
    add_path(f, "", place);
    return;
  }
  for (struct dirent *entry; (entry = readdir(folder));)
    if (ends_with(entry->d_name, ".mat") || ends_with(entry->d_name, ".QPS") || ends_with(entry->d_name, ".SIF") ||
        ends_with(entry->d_name, ".qps"))
      add_path(f, place, entry->d_name);
  closedir(folder);
}

static bool read_arguments(int argc, char **argv, settings *s, files *f) {
  for (int q = 1; q < argc; q++) {
    const char *next = q + 1 < argc ? argv[q + 1] : NULL;
    if (argv[q][0] != '-') {
      add_place(f, argv[q]);
      continue;
    }
    if (!next) return false;
    q++;
    if (!strcmp(argv[q - 1], "--csv"))
      s->csv = next;
    else if (!strcmp(argv[q - 1], "--solutions"))
      s->solutions = next;
    else if (!strcmp(argv[q - 1], "--limit"))
      s->limit_s = strtod(next, NULL);
    else if (!strcmp(argv[q - 1], "--only"))
      s->tolerances[0] = strtod(next, NULL), s->tolerance_count = 1;
    else if (!strcmp(argv[q - 1], "--engine"))
      s->engine = (batten_qp_engine)strtoul(next, NULL, 10);
    else
      return false;
  }
  const char *shared = getenv("BATTEN_SHARED");
  if (f->length == 0 && shared) {
    char place[PATH_LENGTH];
    snprintf(place, sizeof place, "%s/data/qp", shared);
    add_place(f, place);
    if (f->length == 1 && !strcmp(f->paths[0], place)) f->length = 0;
  }
  if (f->length) qsort(f->paths, f->length, sizeof *f->paths, by_text);
  return true;
}

int main(int argc, char **argv) {
  settings s = {.limit_s = 20, .tolerance_count = TOLERANCES};
  memcpy(s.tolerances, usual_tolerances, sizeof usual_tolerances);
  files f = {0};
  if (!read_arguments(argc, argv, &s, &f)) {
    fprintf(stderr,
            "usage: maros-meszaros [--csv FILE] [--solutions FOLDER] [--limit SECONDS] [--only TOLERANCE]"
            " [--engine 0..3] [FOLDER or FILE ...]\n");
    return 2;
  }
  char blas[256];
  batten_blas_describe(blas, sizeof blas);
  printf("# Maros-Meszaros problems: %zu files, %.0f s a solve\n\nBLAS: %s, %u threads; batten %s; compiler %s\n",
         f.length, s.limit_s, blas, batten_blas_threads(), batten_version(), __VERSION__);
  if (f.length == 0) {
    printf("\nNo problems: name a folder, or set BATTEN_SHARED.\n");
    return 0;
  }
  FILE *csv = s.csv ? fopen(s.csv, "w") : NULL;
  if (csv)
    fprintf(
        csv,
        "name,n,m,dense,definite,tolerance,solved,status,engine,iterations,proximal,active,seconds,primal,dual,gap,"
        "objective\n");
  printf(
      "\nd: dense, p: positive definite H. Residuals are absolute.\n\n| name | n | m | | tolerance | solved | status "
      "|"
      " engine | iterations | ms | primal | dual | gap |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  count counts[TOLERANCES][SUBSETS] = {0};
  for (size_t i = 0; i < f.length; i++) {
    outcome o = {0};
    for (size_t t = 0; t < s.tolerance_count; t++) {
      double tolerance = s.tolerances[t];
      o = solve_apart(&s, f.paths[i], tolerance, s.solutions && t + 1 == s.tolerance_count, &o);
      print_row(csv, f.paths[i], tolerance, &o);
      add(&counts[t][ALL], &o, tolerance, s.limit_s);
      if (o.dense) add(&counts[t][DENSE], &o, tolerance, s.limit_s);
      if (o.definite) add(&counts[t][DENSE_DEFINITE], &o, tolerance, s.limit_s);
    }
    free(f.paths[i]);
  }
  free(f.paths);
  print_rates(&s, counts);
  return csv && fclose(csv) != 0;
}
