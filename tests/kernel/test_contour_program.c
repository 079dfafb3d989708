/* The quadratic program of a round: kernel/contour/program.c. */
#include "contour_curves.h"

static const contour_row_options OPTIONS = {.gap = 0.1, .depth_max = 12, .margin = 1e-3, .row_limit = 2000000};

typedef struct problem {
  contour_test_curve c;
  contour_space space;
  contour_rows rows;
  contour_objective objective;
  contour_data data;
  double *points, *parameters, *free, *x, *y;
} problem;

static void problem_make(batten_context *ctx, const contour_curve_rule *r, size_t count, double noise, double tension,
                         problem *p) {
  *p = (problem){.c = contour_test_curve_make(r)};
  uint64_t state = r->seed + 1000;
  size_t n = 2 * p->c.b.count;
  bool accepted = false;
  double table[BSPLINE_ORDER];
  p->points = contour_test_memory(2 * count, 8);
  p->parameters = contour_test_memory(count, 8);
  p->free = contour_test_memory(n, 8);
  p->x = contour_test_memory(n, 8);
  p->y = contour_test_memory(n, 8);
  for (size_t i = 0; i < count; i++) {
    double t = p->parameters[i] = ((double)i + 0.5) / (double)count;
    size_t mu = bspline_span(&p->c.b, t);
    bspline_basis(&p->c.b, mu, t, 0, table);
    for (size_t k = 0; k < 2; k++) {
      for (size_t j = 0; j <= r->degree; j++)
        p->points[2 * i + k] += table[j] * p->c.control[2 * (mu - r->degree + j) + k];
      p->points[2 * i + k] += noise * (t_uniform(&state) + t_uniform(&state) + t_uniform(&state) - 1.5);
    }
  }
  p->data = (contour_data){count, p->points, NULL};
  T_OK(contour_space_make(ctx, &p->c.shape, r->degree, true, NULL, &p->space), ctx);
  T_OK(contour_rows_make(ctx, &p->c.shape, &p->c.b, p->c.control, &OPTIONS, NULL, &accepted, &p->rows), ctx);
  T_OK(contour_objective_new(ctx, &p->c.b, &p->objective), ctx);
  contour_objective_set(&p->objective, &p->data, p->parameters, tension);
  T_OK(contour_objective_solve(ctx, &p->objective, &p->space, p->free), ctx);
}

static void problem_free(batten_context *ctx, problem *p) {
  contour_objective_free(ctx, &p->objective);
  contour_rows_free(ctx, &p->rows);
  contour_space_free(ctx, &p->space);
  contour_test_curve_free(&p->c);
  free(p->points);
  free(p->parameters);
  free(p->free);
  free(p->x);
  free(p->y);
}

/* (x - free)'N (x - free), by the whole matrix. */
static double above(const problem *p, const double *x) {
  const contour_objective *o = &p->objective;
  size_t order = o->b.degree + 1, n = o->b.count;
  double sum = 0;
  for (size_t i = 0; i < n; i++)
    for (size_t j = i; j < n && j < i + order; j++)
      for (size_t k = 0; k < 2; k++)
        sum += (i == j ? 1 : 2) * o->band[i * order + j - i] * (x[2 * i + k] - p->free[2 * i + k]) *
               (x[2 * j + k] - p->free[2 * j + k]);
  return sum;
}

/* ---- by hand-written dense algebra --------------------------------------------------------------- */

/* The problem in y: minimise y'H y / 2 - g'y, C y >= side. */
typedef struct dense {
  size_t n, rows;
  double *h, *g, *c, *side;
} dense;

static dense dense_make(const problem *p, const contour_rows *rows) {
  size_t n = p->space.unknowns, points = 2 * p->c.b.count, order = p->c.b.degree + 1;
  dense d = {n,
             rows->matrix.rows,
             contour_test_memory(n * n, 8),
             contour_test_memory(n, 8),
             contour_test_memory(rows->matrix.rows * n, 8),
             contour_test_memory(rows->matrix.rows, 8)};
  double *z = contour_test_memory(points * n, 8), *nz = contour_test_memory(points * n, 8);
  for (size_t i = 0; i < points; i++)
    for (size_t at = p->space.starts[i]; at < p->space.starts[i + 1]; at++)
      z[i * n + p->space.indices[at]] = p->space.values[at];
  for (size_t i = 0; i < points; i++) {
    double right = p->objective.right[i];
    for (size_t j = 0; j < points; j++) {
      size_t low = i / 2 < j / 2 ? i / 2 : j / 2, high = i / 2 + j / 2 - low;
      if (i % 2 != j % 2 || high - low >= order) continue;
      double value = p->objective.band[low * order + high - low];
      for (size_t k = 0; k < n; k++) nz[i * n + k] += value * z[j * n + k];
      right -= value * p->space.offset[j];
    }
    for (size_t k = 0; k < n; k++) d.g[k] += z[i * n + k] * right;
  }
  for (size_t i = 0; i < points; i++)
    for (size_t k = 0; k < n; k++)
      for (size_t l = 0; l < n; l++) d.h[k * n + l] += z[i * n + k] * nz[i * n + l];
  for (size_t r = 0; r < d.rows; r++) {
    d.side[r] = rows->lower[r] - contour_test_row(&rows->matrix, r, p->space.offset);
    for (size_t at = rows->matrix.starts[r]; at < rows->matrix.starts[r + 1]; at++)
      for (size_t k = 0; k < n; k++) d.c[r * n + k] += rows->matrix.values[at] * z[rows->matrix.indices[at] * n + k];
  }
  free(z);
  free(nz);
  return d;
}

static void dense_free(dense *d) {
  free(d->h);
  free(d->g);
  free(d->c);
  free(d->side);
}

/* m x = r by elimination; false when singular. */
static bool eliminate(size_t n, double *m, double *r) {
  for (size_t k = 0; k < n; k++) {
    size_t pivot = k;
    for (size_t i = k + 1; i < n; i++)
      if (fabs(m[i * n + k]) > fabs(m[pivot * n + k])) pivot = i;
    if (!(fabs(m[pivot * n + k]) > 1e-14)) return false;
    for (size_t j = k; j < n; j++) {
      double t = m[k * n + j];
      m[k * n + j] = m[pivot * n + j];
      m[pivot * n + j] = t;
    }
    double t = r[k];
    r[k] = r[pivot];
    r[pivot] = t;
    for (size_t i = k + 1; i < n; i++) {
      double f = m[i * n + k] / m[k * n + k];
      for (size_t j = k; f != 0 && j < n; j++) m[i * n + j] -= f * m[k * n + j];
      r[i] -= f * r[k];
    }
  }
  for (size_t k = n; k-- > 0;) {
    for (size_t j = k + 1; j < n; j++) r[k] -= m[k * n + j] * r[j];
    r[k] /= m[k * n + k];
  }
  return true;
}

/* Every set of rows in turn as equalities, until one has a feasible point and multipliers >= 0: y [n]. */
static bool enumerate(const dense *d, double *y, size_t *tried) {
  size_t n = d->n, all = n + d->rows;
  double *m = contour_test_memory(all * all, 8), *r = contour_test_memory(all, 8);
  bool found = false;
  for (size_t set = 0; set < (size_t)1 << d->rows && !found; set++) {
    size_t count = 0, row[32];
    for (size_t i = 0; i < d->rows; i++)
      if (set >> i & 1) row[count++] = i;
    size_t size = n + count;
    memset(m, 0, size * size * sizeof *m);
    for (size_t i = 0; i < n; i++) {
      r[i] = d->g[i];
      for (size_t j = 0; j < n; j++) m[i * size + j] = d->h[i * n + j];
      for (size_t k = 0; k < count; k++) m[(n + k) * size + i] = m[i * size + n + k] = d->c[row[k] * n + i];
    }
    for (size_t k = 0; k < count; k++) r[n + k] = d->side[row[k]];
    ++*tried;
    if (count > n || !eliminate(size, m, r)) continue;
    found = true; /* H y - g = -C' r: multipliers are -r */
    for (size_t k = 0; k < count; k++) found = found && r[n + k] <= 1e-12;
    for (size_t i = 0; i < d->rows && found; i++) {
      double value = -d->side[i];
      for (size_t j = 0; j < n; j++) value += d->c[i * n + j] * r[j];
      found = value >= -1e-11;
    }
    if (found) memcpy(y, r, n * sizeof *y);
  }
  free(m);
  free(r);
  return found;
}

static void against_enumeration(batten_context *ctx, unsigned degree, unsigned smoothness, uint64_t seed) {
  problem p;
  problem_make(ctx, &(contour_curve_rule){degree, smoothness, false, 1, 2, 1.5, seed}, 40, 0.1, 1e-4, &p);
  contour_program_figures f = {0};
  T_OK(contour_program_solve(ctx, NULL, &p.objective, &p.space, &p.rows, p.free, p.c.control, p.x, &f), ctx);
  dense d = dense_make(&p, &p.rows);
  double *y = contour_test_memory(d.n, 8), worst = 0;
  size_t tried = 0;
  if (T_CHECK(enumerate(&d, y, &tried), "seed %d: %zu rows, %zu sets of them tried", (int)seed, d.rows, tried)) {
    contour_space_expand(&p.space, y, p.y);
    for (size_t i = 0; i < 2 * p.c.b.count; i++) worst = fmax(worst, fabs(p.x[i] - p.y[i]));
    T_RATIO(worst, 1e-7, "the same minimum, %zu rows active", f.active);
  }
  free(y);
  dense_free(&d);
  problem_free(ctx, &p);
}

/* ---- by another engine, and by the whole set ------------------------------------------------------ */

static void solve(batten_context *ctx, problem *p, const contour_rows *rows, double *x) {
  contour_program_figures f = {0};
  T_OK(contour_program_solve(ctx, NULL, &p->objective, &p->space, rows, p->free, p->c.control, x, &f), ctx);
  if (!f.solved) t_line(false, "solved");
}

static void against_others(batten_context *ctx, const contour_curve_rule *r, double noise, double tension) {
  problem p;
  problem_make(ctx, r, 20 * r->runs * r->spans_per_run, noise, tension, &p);
  contour_program_figures f = {0};
  T_OK(contour_program_solve(ctx, NULL, &p.objective, &p.space, &p.rows, p.free, p.c.control, p.x, &f), ctx);
  double mine = above(&p, p.x), slack = contour_test_slack(&p.rows, p.x);
  T_CHECK(f.solved && slack >= 0 && mine > 0 && mine < above(&p, p.c.control),
          "degree %u, C%u%s, %zu unknowns: %zu rows hold, %zu active", r->degree, r->smoothness,
          r->closed ? ", closed" : "", p.space.unknowns, p.rows.matrix.rows, f.active);
  dense d = dense_make(&p, &p.rows);
  double *y = contour_test_memory(d.n, 8);
  batten_matrix h = batten_matrix_dense(d.n, d.n, d.h), c = batten_matrix_dense(d.rows, d.n, d.c);
  batten_qp_problem q = batten_qp_problem_default(d.n);
  for (size_t i = 0; i < d.n; i++) d.g[i] = -d.g[i];
  q.h = &h;
  q.g = d.g;
  q.c = &c;
  q.lower = d.side;
  batten_qp_options opt = batten_qp_options_default();
  opt.hand_over = 0;
  batten_qp_solution solution = {.x = y};
  for (int engine = BATTEN_QP_PRIMAL; engine <= BATTEN_QP_DUAL; engine++) {
    opt.engine = (batten_qp_engine)engine;
    T_OK(batten_qp_solve(ctx, &q, &opt, NULL, &solution, NULL), ctx);
    contour_space_expand(&p.space, y, p.y);
    T_RATIO(fabs(above(&p, p.y) - mine) / mine, 1e-6, "engine %d in control points: %.8g of %.8g", engine,
            above(&p, p.y), mine);
  }
  free(y);
  dense_free(&d);
  /* all inequalities of the Lemma: no other minimum */
  contour_rows full = contour_test_full(&p.c, &p.rows, p.c.control, OPTIONS.margin);
  solve(ctx, &p, &full, p.y);
  T_RATIO(fabs(above(&p, p.y) - mine) / mine, 1e-6, "all %zu inequalities of the Lemma", full.matrix.rows);
  T_RATIO(-contour_test_least(&full, p.x), 1e-13, "which the solution for %zu of them satisfies", p.rows.matrix.rows);
  T_CHECK(contour_test_curvature(&p.c, p.x, 50) > 0, "and has the right signs, least sine %.2g",
          contour_test_curvature(&p.c, p.x, 50));
  contour_test_full_free(&full);
  problem_free(ctx, &p);
}

/* Rounds, as the fit has them: wedges that follow the solution. */
static void rounds(batten_context *ctx, const contour_curve_rule *r, double noise) {
  problem p;
  problem_make(ctx, r, 20 * r->runs * r->spans_per_run, noise, 1e-12, &p);
  double first = 0, best = INFINITY, least = INFINITY, bend = INFINITY;
  size_t n = 2 * p.c.b.count, rows = 0;
  bool accepted = true;
  for (int round = 0; round < 6 && accepted; round++) {
    contour_rows next;
    contour_program_figures f = {0};
    T_OK(contour_program_solve(ctx, NULL, &p.objective, &p.space, &p.rows, p.free, p.c.control, p.x, &f), ctx);
    contour_rows full = contour_test_full(&p.c, &p.rows, p.c.control, OPTIONS.margin);
    least = fmin(least, contour_test_least(&full, p.x));
    bend = fmin(bend, contour_test_curvature(&p.c, p.x, 50));
    rows = p.rows.matrix.rows;
    contour_test_full_free(&full);
    best = fmin(best, above(&p, p.x));
    if (round == 0) first = best;
    for (size_t i = 0; i < n; i++) p.c.control[i] = 0.9 * p.x[i] + 0.1 * p.c.control[i];
    T_OK(contour_rows_make(ctx, &p.c.shape, &p.c.b, p.c.control, &OPTIONS, &p.rows, &accepted, &next), ctx);
    if (!accepted) break;
    contour_rows_free(ctx, &p.rows);
    p.rows = next;
  }
  T_CHECK(accepted && best < first, "degree %u, C%u, noise %g, %zu rows: the sum beyond the minimum falls by %.2g",
          r->degree, r->smoothness, noise, rows, best / first);
  T_RATIO(-least, 1e-13, "every round satisfies all inequalities of the Lemma");
  T_CHECK(bend > 0, "and has the right signs, least sine %.2g", bend);
  problem_free(ctx, &p);
}

/* Data in a tenth of the domain only: tension of 1e-12 holds the rest. */
static void gap(batten_context *ctx) {
  problem p;
  problem_make(ctx, &(contour_curve_rule){3, 2, false, 3, 20, 2.0, 7}, 1200, 0.01, 1e-12, &p);
  double *weights = contour_test_memory(1200, 8);
  for (size_t i = 0; i < 1200; i++) weights[i] = i < 120 || i >= 1100 ? 1 : 0;
  p.data.weights = weights;
  contour_objective_set(&p.objective, &p.data, p.parameters, 1e-12);
  T_OK(contour_objective_solve(ctx, &p.objective, &p.space, p.free), ctx);
  contour_program_figures f = {0};
  T_OK(contour_program_solve(ctx, NULL, &p.objective, &p.space, &p.rows, p.free, p.c.control, p.x, &f), ctx);
  T_CHECK(f.solved && contour_test_slack(&p.rows, p.x) >= 0 && above(&p, p.x) < 0.5 * above(&p, p.c.control) &&
              contour_test_curvature(&p.c, p.x, 20) > 0,
          "no data in the middle 80 %%: %zu iterations, %.3g of %.3g", f.iterations, above(&p, p.x),
          above(&p, p.c.control));
  free(weights);
  problem_free(ctx, &p);
}

static void edges(batten_context *ctx) {
  problem p;
  problem_make(ctx, &(contour_curve_rule){3, 2, false, 2, 4, 2.0, 1}, 200, 0.05, 1e-6, &p);
  size_t n = 2 * p.c.b.count;
  contour_program_figures f = {0};
  T_OK(contour_program_solve(ctx, NULL, &p.objective, &p.space, &p.rows, p.c.control, p.c.control, p.x, &f), ctx);
  T_CHECK(f.solved && f.active == 0 && f.iterations == 0 && !memcmp(p.x, p.c.control, n * sizeof *p.x),
          "a minimum inside stays");
  /* what has no solution, as rounding may have it, is said and leaves the place alone */
  const size_t starts[3] = {0, 1, 2};
  const uint32_t indices[2] = {0, 0};
  const double values[2] = {1, -1};
  double lower[2] = {9, 9};
  const contour_rows none = {.matrix = batten_matrix_sparse(2, n, starts, indices, values), .lower = lower};
  memcpy(p.y, p.x, n * sizeof *p.x);
  T_OK(contour_program_solve(ctx, NULL, &p.objective, &p.space, &none, p.free, p.c.control, p.x, &f), ctx);
  T_CHECK(!f.solved && !memcmp(p.x, p.y, n * sizeof *p.x), "no solution: said, nothing written");
  /* the same bits with a workspace, twice, and on more threads */
  batten_qp_workspace *workspace;
  batten_context *more = t_context(NULL, NULL, 3);
  T_OK(batten_qp_workspace_new(ctx, &workspace), ctx);
  solve(ctx, &p, &p.rows, p.x);
  for (int k = 0; k < 3; k++) {
    T_OK(contour_program_solve(k < 2 ? ctx : more, k < 2 ? workspace : NULL, &p.objective, &p.space, &p.rows, p.free,
                               p.c.control, p.y, &f),
         ctx);
    T_CHECK(!memcmp(p.x, p.y, n * sizeof *p.x), "the same bits again");
  }
  batten_qp_workspace_free(workspace);
  batten_context_free(more);
  problem_free(ctx, &p);
}

static batten_status solve_once(batten_context *ctx, void *arg) {
  problem *p = arg;
  contour_program_figures f;
  return contour_program_solve(ctx, NULL, &p->objective, &p->space, &p->rows, p->free, p->c.control, p->x, &f);
}

static void failures(batten_context *ctx, size_t spans) {
  problem p;
  problem_make(ctx, &(contour_curve_rule){3, 2, false, 2, spans, 2.0, 4}, 100 * spans, 0.02, 1e-9, &p);
  t_fail_every_allocation("program", solve_once, &p);
  /* a few unknowns are solved for before anyone can ask */
  if (spans > 10) t_cancel_every_progress("program", solve_once, &p);
  problem_free(ctx, &p);
}

static void large(batten_context *ctx, unsigned degree, size_t spans) {
  problem p;
  problem_make(ctx, &(contour_curve_rule){degree, 2, false, 4, spans / 4, 2.0, 1}, 10 * spans, 0.01, 1e-12, &p);
  contour_program_figures f = {0};
  double time = batten_now();
  T_OK(contour_program_solve(ctx, NULL, &p.objective, &p.space, &p.rows, p.free, p.c.control, p.x, &f), ctx);
  time = batten_now() - time;
  T_CHECK(f.solved && contour_test_slack(&p.rows, p.x) >= 0 && above(&p, p.x) < above(&p, p.c.control),
          "degree %u, %zu spans, %zu unknowns, %zu rows: %zu active, %zu iterations, %.3g ms", degree, spans,
          p.space.unknowns, p.rows.matrix.rows, f.active, f.iterations, 1e3 * time);
  problem_free(ctx, &p);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  for (uint64_t seed = 1; seed <= 4; seed++) {
    against_enumeration(ctx, 2, 1, seed);
    against_enumeration(ctx, 3, 2, seed);
  }
  for (unsigned degree = 2; degree <= 5; degree++)
    for (unsigned l = 1; l <= 2 && l < degree; l++) {
      against_others(ctx, &(contour_curve_rule){degree, l, false, 2, 4, 2.0, degree}, 0.03, 1e-9);
      against_others(ctx, &(contour_curve_rule){degree, l, true, 1, 8, 0, degree}, degree < 3 ? 0.2 : 0.03, 1e-9);
      against_others(ctx, &(contour_curve_rule){degree, l, true, 4, 10, 0, degree}, 0.03, 1e-12);
      rounds(ctx, &(contour_curve_rule){degree, l, false, 3, 5, 2.5, degree}, 0.02);
    }
  gap(ctx);
  edges(ctx);
  failures(ctx, 2);
  failures(ctx, 30);
  large(ctx, 3, 500);
  large(ctx, 3, 2000);
  large(ctx, 5, 2000);
  batten_context_free(ctx);
  return t_done();
}
