/* Inequalities around a reference curve: kernel/contour/wedges.c and rows.c. */
#include "contour_curves.h"
#include "contour/wedges.h"

static const contour_row_options OPTIONS = {.gap = 0.02, .depth_max = 12, .margin = 1e-3, .row_limit = 2000000};

static double row_value(const batten_matrix *m, size_t row, const double *x) {
  double sum = 0;
  for (size_t at = m->starts[row]; at < m->starts[row + 1]; at++) sum += m->values[at] * x[m->indices[at]];
  return sum;
}

/* Least slack of rows. */
static double slack(const contour_rows *rows, const double *x) {
  double least = INFINITY;
  for (size_t i = 0; i < rows->matrix.rows; i++) least = fmin(least, row_value(&rows->matrix, i, x) - rows->lower[i]);
  return least;
}

/* All 4 d - 2 inequalities of the Lemma for every piece, least value of rows of length 1; and how many. */
static double full_set(const contour_test_curve *c, const contour_rows *rows, const double *control, size_t *count) {
  double least = INFINITY;
  unsigned d = c->b.degree;
  contour_piece p;
  *count = 0;
  for (size_t q = 0; q < rows->wedge_count; q++) {
    const contour_wedge *w = &rows->wedges[q];
    contour_piece_set(&p, &c->shape, &c->b, w);
    for (unsigned k = 1; k <= 2; k++)
      for (unsigned i = 0; i + k <= d; i++) {
        const double *row = (k == 1 ? p.first : p.second) + i * (d + 1);
        double z[2] = {0}, size = 0;
        for (unsigned j = 0; j <= d; j++) {
          size += row[j] * row[j];
          for (int e = 0; e < 2; e++) z[e] += row[j] * control[2 * (w->mu - d + j) + (size_t)e];
        }
        double u = w->sign * contour_cross(w->u, z), v = w->sign * contour_cross(w->v, z);
        least = fmin(least, fmin(u, k == 1 ? -v : v) / sqrt(size));
        *count += 2;
      }
  }
  return least;
}

/* A random point of the space, as far from the reference as the rows allow times `part`. */
static void wander(const contour_space *space, const contour_rows *rows, const double *reference, double part,
                   uint64_t *state, double *direction, double *out) {
  size_t n = 2 * space->b.count;
  double *y = contour_test_memory(space->unknowns, sizeof *y), step = INFINITY;
  for (size_t j = 0; j < space->unknowns; j++) y[j] = t_uniform(state) - 0.5;
  for (size_t i = 0; i < n; i++) {
    direction[i] = 0;
    for (size_t at = space->starts[i]; at < space->starts[i + 1]; at++)
      direction[i] += space->values[at] * y[space->indices[at]];
  }
  for (size_t i = 0; i < rows->matrix.rows; i++) {
    double rate = row_value(&rows->matrix, i, direction),
           spare = row_value(&rows->matrix, i, reference) - rows->lower[i];
    if (rate < 0) step = fmin(step, -spare / rate);
  }
  if (!(step < 10)) step = 10;
  for (size_t i = 0; i < n; i++) out[i] = reference[i] + part * step * direction[i];
  free(y);
}

static void check(batten_context *ctx, const contour_curve_rule *r) {
  contour_test_curve c = contour_test_curve_make(r);
  char what[128];
  snprintf(what, sizeof what, "degree %u, C%u%s, %zu runs of %zu spans, seed %d", r->degree, r->smoothness,
           r->closed ? ", closed" : "", r->runs, r->spans_per_run, (int)r->seed);
  double bend = contour_test_curvature(&c, c.control, 16);
  T_CHECK(bend > 0, "%s: the reference bends as it should (%.2g)", what, bend);
  bool accepted = false;
  contour_rows rows;
  contour_space space;
  T_OK(contour_space_make(ctx, &c.shape, r->degree, true, NULL, &space), ctx);
  T_OK(contour_rows_make(ctx, &c.shape, &c.b, c.control, &OPTIONS, NULL, &accepted, &rows), ctx);
  if (!T_CHECK(accepted, "%s: accepted", what)) return;
  size_t full, n = 2 * c.b.count;
  double *direction = contour_test_memory(n, 8), *x = contour_test_memory(n, 8), *y = contour_test_memory(n, 8);
  full_set(&c, &rows, c.control, &full);
  printf("# %zu pieces, %zu rows of %zu, %u bisections, least slack %.2g\n", rows.wedge_count, rows.matrix.rows, full,
         rows.depth, slack(&rows, c.control));
  T_CHECK(slack(&rows, c.control) > 0 && rows.matrix.rows <= 2 * r->degree * rows.wedge_count,
          "the reference satisfies %zu rows strictly", rows.matrix.rows);
  double length = 0;
  for (size_t i = 0; i < rows.matrix.rows; i++) {
    double sum = 0;
    for (size_t at = rows.matrix.starts[i]; at < rows.matrix.starts[i + 1]; at++)
      sum += rows.matrix.values[at] * rows.matrix.values[at];
    length = fmax(length, fabs(sum - 1));
  }
  T_RATIO(length, 1e-14, "rows have length 1");
  /* what satisfies the rows satisfies the whole set, and bends as it should */
  uint64_t state = r->seed + 3;
  double implied = INFINITY, worst = INFINITY;
  for (int trial = 0; trial < 200; trial++) {
    wander(&space, &rows, c.control, 1 - 1e-12, &state, direction, x);
    implied = fmin(implied, full_set(&c, &rows, x, &full));
    worst = fmin(worst, contour_test_curvature(&c, x, 8));
    /* between two of them, and out again from there */
    for (size_t i = 0; i < n; i++) y[i] = 0.5 * (x[i] + (trial % 10 ? y[i] : c.control[i]));
    wander(&space, &rows, y, 1 - 1e-12, &state, direction, x);
    implied = fmin(implied, full_set(&c, &rows, x, &full));
    worst = fmin(worst, contour_test_curvature(&c, x, 8));
  }
  T_RATIO(-implied, 1e-13, "400 points at the border of the rows satisfy all %zu inequalities of the Lemma", full);
  T_CHECK(worst > 0, "and bend as they should: least sine %.2g", worst);
  free(direction);
  free(x);
  free(y);
  contour_rows_free(ctx, &rows);
  contour_space_free(ctx, &space);
  contour_test_curve_free(&c);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  for (unsigned degree = 2; degree <= 6; degree++)
    for (unsigned l = 1; l <= 2 && l < degree; l++) {
      check(ctx, &(contour_curve_rule){degree, l, false, 1, 1, 1.0, 1});
      check(ctx, &(contour_curve_rule){degree, l, false, 3, 3, 2.0, degree});
      check(ctx, &(contour_curve_rule){degree, l, false, 2, 6, 5.0, degree + 10});
      check(ctx, &(contour_curve_rule){degree, l, true, 1, 7, 0, degree + 20});
      check(ctx, &(contour_curve_rule){degree, l, true, 4, 10, 0, degree + 30});
    }
  batten_context_free(ctx);
  return t_done();
}
