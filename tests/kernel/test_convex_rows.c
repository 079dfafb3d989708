/* Linear inequalities around a convex reference: whatever satisfies them is convex. That is looked at from outside,
 * on dense samples, at corners and random places of the polyhedron; so that a wrong row, or a missing one, shows. */
#include "tap.h"

#include <batten/qp.h>
#include <float.h>

#include "convex/boxes.h"

enum { KNOTS = 64, POINTS = 24 * 24 };

typedef struct scene {
  double knots[2][KNOTS], reference[POINTS][3];
  convex_space space;
} scene;

static const convex_row_options defaults = {
    .directions = 4, .depth_max = 6, .row_share = 0.15, .margin = 1e-3, .row_limit = 500000};

static void set_space(scene *s, const unsigned *degree, const unsigned *smoothness, const size_t *spans) {
  for (int d = 0; d < 2; d++) {
    size_t knots = bspline_make_knots(degree[d], smoothness[d], spans[d], NULL, 0, 1, s->knots[d]);
    s->space.axis[d] = (bspline){degree[d], knots - degree[d] - 1, s->knots[d]};
  }
}

static double normal(uint64_t *seed) {
  double sum = 0;
  for (int i = 0; i < 12; i++) sum += t_uniform(seed);
  return sum - 6;
}

/* Control points at the abscissas of Greville on a cap of an ellipsoid (1 / bend: its size), noise, turned at random.
 */
static void set_cap(scene *s, double bend, double noise, uint64_t *seed) {
  double u[KNOTS], v[KNOTS], a = normal(seed), b = normal(seed), c = normal(seed), d = normal(seed),
                             size = a * a + b * b + c * c + d * d;
  double turn[3][3] = {{a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)},
                       {2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)},
                       {2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d}};
  bspline_greville(&s->space.axis[0], u);
  bspline_greville(&s->space.axis[1], v);
  double skew = 0.3 * (t_uniform(seed) - 0.5);
  for (size_t i = 0; i < s->space.axis[0].count; i++)
    for (size_t j = 0; j < s->space.axis[1].count; j++) {
      double x = u[i] - 0.5 + skew * v[j], y = v[j] - 0.5, z = -bend * (x * x + 0.8 * y * y + 0.3 * x * y), p[3];
      z += bend * bend * 0.2 * z * z;
      double local[3] = {x + noise * normal(seed), y + noise * normal(seed), z + noise * normal(seed)};
      for (int k = 0; k < 3; k++)
        p[k] = (turn[k][0] * local[0] + turn[k][1] * local[1] + turn[k][2] * local[2]) / size;
      memcpy(s->reference[i * s->space.axis[1].count + j], p, sizeof p);
    }
}

/* ---- an evaluation of its own: de Boor on each row of points, differences for derivatives' points ---- */

/* Value of the derivative of order k at t of the spline with points [count] by stride. */
static double spline_value(const bspline *axis, const double *points, size_t stride, unsigned order, double t) {
  double q[KNOTS];
  const double *u = axis->knots;
  size_t count = axis->count;
  unsigned d = axis->degree;
  for (size_t i = 0; i < count; i++) q[i] = points[i * stride];
  for (; order > 0; order--, d--, count--, u++)
    for (size_t i = 0; i + 1 < count; i++) {
      double width = u[i + d + 1] - u[i + 1];
      q[i] = width > 0 ? d * (q[i + 1] - q[i]) / width : 0;
    }
  size_t mu = d;
  while (mu + 1 < count && !(t < u[mu + 1])) mu++;
  for (unsigned r = 1; r <= d; r++)
    for (size_t i = mu; i >= mu - d + r; i--) {
      double part = (t - u[i]) / (u[i + d + 1 - r] - u[i]);
      q[i] = (1 - part) * q[i - 1] + part * q[i];
    }
  return q[mu];
}

static void derivative(const scene *s, const double *x, unsigned order_u, unsigned order_v, const double *at,
                       double *out) {
  double column[KNOTS];
  size_t n = s->space.axis[1].count;
  for (size_t k = 0; k < 3; k++) {
    for (size_t i = 0; i < s->space.axis[0].count; i++)
      column[i] = spline_value(&s->space.axis[1], x + 3 * i * n + k, 3, order_v, at[1]);
    out[k] = spline_value(&s->space.axis[0], column, 1, order_u, at[0]);
  }
}

static double det(const double *a, const double *b, const double *c) {
  return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/* Least smaller eigenvalue of the second fundamental form (times the sign) over its trace on a grid; > 0: convex. */
static double least_definite(const scene *s, const double *x, int sign, int grid) {
  double least = INFINITY;
  for (int i = 0; i <= grid; i++)
    for (int j = 0; j <= grid; j++) {
      double at[2] = {(double)i / grid, (double)j / grid}, xu[3], xv[3], w[3];
      derivative(s, x, 1, 0, at, xu);
      derivative(s, x, 0, 1, at, xv);
      derivative(s, x, 2, 0, at, w);
      double l = sign * det(xu, xv, w);
      derivative(s, x, 1, 1, at, w);
      double m = sign * det(xu, xv, w);
      derivative(s, x, 0, 2, at, w);
      double n = sign * det(xu, xv, w);
      double size = fabs(l) + fabs(n);
      least = fmin(least, (l + n - hypot(l - n, 2 * m)) / 2 / (size > 0 ? size : 1));
    }
  return least;
}

/* ---- rows ---------------------------------------------------------------------------------------- */

static double row_value(const batten_matrix *m, size_t row, const double *x) {
  double sum = 0;
  if (m->dense) {
    for (size_t j = 0; j < m->columns; j++) sum += m->dense[row * m->columns + j] * x[j];
  } else {
    for (size_t e = m->starts[row]; e < m->starts[row + 1]; e++) sum += m->values[e] * x[m->indices[e]];
  }
  return sum;
}

static double row_length(const batten_matrix *m, size_t row) {
  const double *v = m->dense ? m->dense + row * m->columns : m->values + m->starts[row];
  size_t count = m->dense ? m->columns : m->starts[row + 1] - m->starts[row];
  double sum = 0;
  for (size_t j = 0; j < count; j++) sum += v[j] * v[j];
  return sqrt(sum);
}

static batten_context *plain(void) {
  batten_context *ctx = NULL;
  return batten_context_new(NULL, &ctx) == BATTEN_OK ? ctx : NULL;
}

/* The corner of the polyhedron that is lowest in a direction, bounded by a ball-like term around the reference. */
static bool corner(batten_context *ctx, const convex_rows *rows, const double *reference, const double *direction,
                   double weight, double *x) {
  size_t n = rows->matrix.columns;
  double *identity = calloc(n * n, sizeof *identity), *g = malloc(n * sizeof *g);
  for (size_t i = 0; i < n; i++) {
    identity[i * n + i] = weight;
    g[i] = direction[i] - weight * reference[i];
  }
  batten_matrix h = batten_matrix_dense(n, n, identity);
  batten_qp_problem p = batten_qp_problem_default(n);
  p.h = &h;
  p.g = g;
  p.c = &rows->matrix;
  p.lower = rows->lower;
  batten_qp_solution solution = {.x = x};
  batten_status status = batten_qp_solve(ctx, &p, NULL, NULL, &solution, NULL);
  free(identity);
  free(g);
  return status == BATTEN_OK;
}

/* As far along a direction as the rows allow, at most `most`. */
static double reach(const convex_rows *rows, const double *x, const double *direction, double most) {
  for (size_t i = 0; i < rows->matrix.rows; i++) {
    double slope = row_value(&rows->matrix, i, direction), room = row_value(&rows->matrix, i, x) - rows->lower[i];
    if (slope < 0) most = fmin(most, room / -slope);
  }
  return most;
}

typedef struct figures {
  size_t references, accepted, rows, boxes, wrong_rows, lost;
  unsigned depth;
  double length, least_reference, least_random, least_corner, most_reach;
} figures;

static void look(batten_context *ctx, scene *s, int corners, uint64_t *seed, figures *f) {
  bool accepted, asked;
  convex_rows rows;
  const double *y = s->reference[0];
  f->references++;
  if (convex_rows_make(ctx, &s->space, y, &defaults, &accepted, &rows) < 0 ||
      convex_rows_make(ctx, &s->space, y, &defaults, &asked, NULL) < 0 || asked != accepted) {
    f->lost++;
    return;
  }
  if (!accepted) return;
  size_t n = rows.matrix.columns;
  f->accepted++;
  f->rows += rows.matrix.rows;
  f->boxes += rows.boxes;
  f->depth = rows.depth > f->depth ? rows.depth : f->depth;
  for (size_t i = 0; i < rows.matrix.rows; i++) {
    double value = row_value(&rows.matrix, i, y);
    if (!(rows.lower[i] > 0) || !(value > rows.lower[i]) || fabs(rows.lower[i] / value - 1e-3) > 1e-9)
      f->wrong_rows++;
    f->length = fmax(f->length, fabs(row_length(&rows.matrix, i) - 1));
  }
  f->least_reference = fmin(f->least_reference, least_definite(s, y, rows.sign, 10));
  double *x = malloc(n * sizeof *x), *direction = malloc(n * sizeof *x);
  for (int k = 0; k < 4; k++) {
    for (size_t i = 0; i < n; i++) direction[i] = normal(seed);
    double step = reach(&rows, y, direction, 10);
    f->most_reach = fmax(f->most_reach, step);
    for (size_t i = 0; i < n; i++) x[i] = y[i] + step * direction[i];
    f->least_random = fmin(f->least_random, least_definite(s, x, rows.sign, 16));
  }
  for (int k = 0; k < corners; k++) {
    for (size_t i = 0; i < n; i++) direction[i] = normal(seed);
    if (!corner(ctx, &rows, y, direction, k % 2 ? 1 : 0.01, x)) f->lost++;
    f->least_corner = fmin(f->least_corner, least_definite(s, x, rows.sign, 20));
  }
  free(x);
  free(direction);
  convex_rows_free(ctx, &rows);
}

static void test_polyhedra(void) {
  batten_context *ctx = plain();
  uint64_t seed = 5;
  for (unsigned kind = 0; kind < 10; kind++) {
    figures f = {.least_reference = INFINITY, .least_random = INFINITY, .least_corner = INFINITY};
    unsigned degree[2] = {2 + kind % 6, kind < 6 ? 2 + kind % 6 : 2 + (kind * 5) % 4}, smoothness[2] = {1, 1};
    size_t spans[2] = {kind < 6 ? 1 : 1 + kind % 3, kind < 6 ? 1 : 2};
    scene *s = malloc(sizeof *s);
    set_space(s, degree, smoothness, spans);
    for (int k = 0; k < 6; k++) {
      set_cap(s, 0.3 + 1.2 * t_uniform(&seed), 0.002 * k / degree[0] / degree[1], &seed);
      look(ctx, s, k % 2 == 0 && k < 4 ? 2 : 0, &seed, &f);
    }
    T_CHECK(f.accepted >= 3 && f.lost == 0,
            "degree (%u, %u), spans %zu x %zu: %zu of %zu accepted, %zu boxes, %zu rows, depth %u", degree[0],
            degree[1], spans[0], spans[1], f.accepted, f.references, f.boxes, f.rows, f.depth);
    T_CHECK(f.wrong_rows == 0, "the reference satisfies all rows by 1000 times the lower side");
    T_RATIO(f.length, 20 * DBL_EPSILON, "length of rows");
    T_CHECK(f.least_reference > 0, "the reference is convex: %.3g", f.least_reference);
    T_CHECK(f.least_random > 0 && f.most_reach < 10, "random places of the boundary are: %.3g", f.least_random);
    T_CHECK(f.least_corner > 0, "corners are: %.3g", f.least_corner);
    free(s);
  }
  batten_context_free(ctx);
}

int main(void) {
  test_polyhedra();
  return t_done();
}
