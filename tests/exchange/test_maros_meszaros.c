/* The Maros-Meszaros problems at 1e-9 absolute: how many are solved, primal and dual residual and gap all checked,
 * and that no answer claims what does not hold. Skips where the data are absent; then, and besides, problems of the
 * same make: a semi-infinite one with many nearly parallel rows (as KSIP) and k-convex least squares (as the
 * LISWETs). */
#include <batten/exchange.h>
#include <dirent.h>

#include "qp_scenes.h"
#include "tap.h"

static const double TOLERANCE = 1e-9, LIMIT_S = 5;

/* ---- The judge's figures once more, in long double ---- */

typedef struct residuals {
  long double primal, dual, gap;
} residuals;

static void add_side(residuals *r, long double *products, long double y, double lower, double upper,
                     long double row) {
  if (lower > -INFINITY) r->primal = fmaxl(r->primal, lower - row);
  if (upper < INFINITY) r->primal = fmaxl(r->primal, row - upper);
  double side = y > 0 ? lower : upper;
  if (y == 0) return;
  if (fabs(side) < INFINITY)
    *products += y * side;
  else
    r->dual = fmaxl(r->dual, fabsl(y));
}

static residuals judge(const batten_qp_problem *p, const double *x, const double *y) {
  residuals r = {0};
  size_t n = p->n, m = p->c ? p->c->rows : 0;
  long double *gradient = calloc(n + 1, sizeof *gradient), products = 0, objective = 0;
  if (!gradient) exit(1);
  for (size_t j = 0; j < n; j++) {
    gradient[j] = p->h ? qp_scene_dot(p->h, j, x) : 0;
    if (p->g) gradient[j] += p->g[j];
    objective += gradient[j] * x[j]; /* x'Hx + g'x */
    gradient[j] -= y[m + j];
    add_side(&r, &products, y[m + j], p->x_lower ? p->x_lower[j] : -INFINITY, p->x_upper ? p->x_upper[j] : INFINITY,
             x[j]);
  }
  for (size_t i = 0; i < m; i++) {
    qp_scene_add(p->c, i, -(long double)y[i], gradient);
    add_side(&r, &products, y[i], p->lower ? p->lower[i] : -INFINITY, p->upper ? p->upper[i] : INFINITY,
             qp_scene_dot(p->c, i, x));
  }
  for (size_t j = 0; j < n; j++) r.dual = fmaxl(r.dual, fabsl(gradient[j]));
  r.gap = fabsl(objective - products);
  free(gradient);
  return r;
}

typedef struct answer {
  bool claimed, holds;
  batten_status status;
  residuals r;
  double seconds;
} answer;

static answer solve(batten_context *ctx, const batten_qp_problem *p, double limit_s) {
  answer a = {.status = BATTEN_E_NOMEM};
  batten_qp_options o = batten_qp_options_default();
  o.tolerance_absolute = TOLERANCE, o.tolerance_relative = 0, o.time_limit_s = limit_s;
  double *x = malloc((2 * p->n + (p->c ? p->c->rows : 0)) * sizeof *x), start = batten_now();
  if (!x) return a;
  batten_qp_solution s = {.x = x, .multipliers = x + p->n};
  a.status = batten_qp_solve(ctx, p, &o, NULL, &s, NULL);
  a.seconds = batten_now() - start;
  a.claimed = a.status == BATTEN_OK;
  if (a.status >= 0) {
    a.r = judge(p, x, x + p->n);
    a.holds = a.r.primal <= TOLERANCE && a.r.dual <= TOLERANCE && a.r.gap <= TOLERANCE;
  }
  free(x);
  return a;
}

/* ---- The collection ---- */

enum { DENSE_LIMIT = 1000 };

/* Problems with n, m <= 1000 (bounds not counted) whose Hessian has smallest eigenvalue above 1e-14, as the public
 * benchmark counts them. */
static const char *const definite[] = {"DUAL1",    "DUAL2",    "DUAL3",    "DUAL4",    "DUALC1",  "DUALC5",
                                       "HS118",    "HS21",     "HS268",    "HS35",     "HS35MOD", "HS76",
                                       "QPCBLEND", "QPCBOEI1", "QPCBOEI2", "QPCSTAIR", "QPTEST",  "S268"};
/* Larger ones that have to be solved too. */
static const char *const asked[] = {"KSIP", "LASER", "LISWET"};

static bool listed(const char *name, const char *const *list, size_t count, bool prefix) {
  size_t length = strcspn(name, ".");
  for (size_t q = 0; q < count; q++) {
    size_t own = strlen(list[q]);
    if (!strncmp(name, list[q], own) && (prefix || own == length)) return true;
  }
  return false;
}

typedef struct tally {
  size_t given, solved;
} tally;

static void take(tally *t, const answer *a) {
  t->given++;
  t->solved += a->claimed && a->holds;
}

static void check_rate(const tally *t, double above, const char *what) {
  double rate = 100 * (double)t->solved / (double)t->given;
  T_CHECK(rate > above, "%s: %zu of %zu solved at %g, %.1f %%, asked: above %g %%", what, t->solved, t->given,
          TOLERANCE, rate, above);
}

static void run_collection(batten_context *ctx, const char *folder, DIR *open) {
  tally dense = {0}, positive = {0}, others = {0};
  size_t wrong = 0;
  for (struct dirent *entry; (entry = readdir(open));) {
    const char *name = entry->d_name;
    char path[4096];
    batten_qp_file file;
    if (!strstr(name, ".mat")) continue;
    if ((size_t)snprintf(path, sizeof path, "%s/%s", folder, name) >= sizeof path) {
      T_CHECK(false, "%s/%s: the path is too long", folder, name);
      continue;
    }
    bool is_asked = listed(name, asked, sizeof asked / sizeof *asked, true);
    bool is_definite = listed(name, definite, sizeof definite / sizeof *definite, false);
    if (batten_read_qp(ctx, path, &file) < 0) {
      T_CHECK(false, "%s is read: %s", name, batten_error(ctx));
      continue;
    }
    size_t m = file.problem.c ? file.problem.c->rows : 0;
    bool is_dense = file.problem.n <= DENSE_LIMIT && m <= DENSE_LIMIT;
    if (is_asked || is_dense) {
      answer a = solve(ctx, &file.problem, LIMIT_S);
      if (is_dense) take(&dense, &a);
      if (is_dense && is_definite) take(&positive, &a);
      if (is_asked) take(&others, &a);
      wrong += a.claimed && !a.holds;
      if (!a.claimed || !a.holds)
        printf("# %s: %s%s, primal %.1Le, dual %.1Le, gap %.1Le, %.2f s\n", name, batten_status_name(a.status),
               a.claimed ? " (WRONGLY)" : "", a.r.primal, a.r.dual, a.r.gap, a.seconds);
    }
    batten_qp_file_free(ctx, &file);
  }
  check_rate(&positive, 84, "dense problems with positive definite Hessian");
  check_rate(&dense, 80, "dense problems");
  T_CHECK(others.solved == others.given && others.given > 0, "KSIP, LASER and the LISWETs: %zu of %zu solved",
          others.solved, others.given);
  T_CHECK(wrong == 0, "nothing is called optimal that is not: %zu", wrong);
}

static void test_collection(batten_context *ctx) {
  const char *shared = getenv("BATTEN_SHARED");
  char folder[4000] = "";
  if (shared) snprintf(folder, sizeof folder, "%s/data/qp", shared);
  DIR *open = shared ? opendir(folder) : NULL;
  if (!open) {
    t_skip("the Maros-Meszaros problems", "no ../shared/data/qp");
    return;
  }
  run_collection(ctx, folder, open);
  closedir(open);
}

/* ---- Problems of the same make ---- */

static void check_solved(batten_context *ctx, const batten_qp_problem *p, const char *what) {
  answer a = solve(ctx, p, 20);
  T_CHECK(a.claimed && a.holds, "%s: %s, primal %.1Le, dual %.1Le, gap %.1Le, %.3f s", what,
          batten_status_name(a.status), a.r.primal, a.r.dual, a.r.gap, a.seconds);
}

/* min sum x_j^2 / (2 j) + x_j / j with sum x_j t^(j-1) >= tan t on [0, 1]: a semi-infinite program at 1001 points. */
static void test_semi_infinite(batten_context *ctx) {
  enum { N = 20, POINTS = 1001 };
  static double rows[POINTS * N], lower[POINTS], h[N * N], g[N];
  for (size_t i = 0; i < POINTS; i++) {
    double t = (double)i / (POINTS - 1), power = 1;
    for (size_t j = 0; j < N; j++) rows[i * N + j] = power, power *= t;
    lower[i] = tan(t);
  }
  for (size_t j = 0; j < N; j++) h[j * N + j] = g[j] = 1 / (double)(j + 1);
  batten_matrix hessian = batten_matrix_dense(N, N, h), c = batten_matrix_dense(POINTS, N, rows);
  batten_qp_problem p = batten_qp_problem_default(N);
  p.h = &hessian, p.g = g, p.c = &c, p.lower = lower;
  check_solved(ctx, &p, "semi-infinite program, 1001 rows");
}

/* Lengths whose condition, (length / pi)^(2 k), double precision can bear. */
static void test_convex_sequences(batten_context *ctx) {
  static const size_t lengths[] = {2000, 2000, 300, 100};
  for (size_t k = 1; k <= 4; k++) {
    qp_scene *s = qp_scene_convex(lengths[k - 1], k, 0.1, k);
    char what[64];
    snprintf(what, sizeof what, "sequence of %zu with differences %zu >= 0", lengths[k - 1], k);
    check_solved(ctx, &s->problem, what);
    qp_scene_free(s);
  }
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_semi_infinite(ctx);
  test_convex_sequences(ctx);
  test_collection(ctx);
  batten_context_free(ctx);
  return t_done();
}
