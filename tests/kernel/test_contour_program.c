/* The quadratic program of a round: kernel/contour/program.c. */
#include "contour_curves.h"

static const contour_row_options OPTIONS = {.gap = 0.02, .depth_max = 12, .margin = 1e-3, .row_limit = 2000000};

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
  contour_objective_set(ctx, &p->objective, &p->data, p->parameters, tension);
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

static double worst_row(const contour_rows *rows, const double *x) {
  double worst = -INFINITY;
  const batten_matrix *m = &rows->matrix;
  for (size_t i = 0; i < m->rows; i++) {
    double sum = 0;
    for (size_t at = m->starts[i]; at < m->starts[i + 1]; at++) sum += m->values[at] * x[m->indices[at]];
    worst = fmax(worst, rows->lower[i] - sum);
  }
  return worst;
}

static void check(batten_context *ctx, const contour_curve_rule *r, size_t count, double noise, double tension) {
  problem p;
  problem_make(ctx, r, count, noise, tension, &p);
  contour_program_figures f = {0};
  double t0 = batten_now();
  T_OK(contour_program_solve(ctx, NULL, &p.objective, &p.space, &p.rows, p.free, p.c.control, p.x, &f), ctx);
  double t1 = batten_now();
  printf(
      "# degree %u C%u %zu spans, %zu points: %zu unknowns, %zu rows, %zu active, %zu iterations, %.3g ms; %.6g of "
      "%.6g, worst %.2g\n",
      r->degree, r->smoothness, p.c.shape.spans, count, p.space.unknowns, p.rows.matrix.rows, f.active, f.iterations,
      1e3 * (t1 - t0), above(&p, p.x), above(&p, p.c.control), worst_row(&p.rows, p.x));
  T_CHECK(f.solved && worst_row(&p.rows, p.x) <= 0, "solved, all rows hold");
  problem_free(ctx, &p);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  size_t spans[] = {2, 5, 10, 20, 40, 80, 160, 320, 640};
  for (int k = 0; k < 9; k++) {
    check(ctx, &(contour_curve_rule){3, 2, false, 3, spans[k], 2.0, 1}, 30 * spans[k], 0.01, 1e-12);
    check(ctx, &(contour_curve_rule){5, 2, false, 3, spans[k], 2.0, 1}, 30 * spans[k], 0.01, 1e-12);
  }
  batten_context_free(ctx);
  return t_done();
}
