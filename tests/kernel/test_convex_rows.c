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

/* ---- tests that the tests above bite ------------------------------------------------------------- */

/* Rows of one box stand in the order x_u, x_v, forms. Without any of the three classes, or without one direction's
 * forms, some corner of the polyhedron is not convex. */
static void test_all_needed(void) {
  batten_context *ctx = plain();
  uint64_t seed = 21;
  scene *s = malloc(sizeof *s);
  unsigned degree[2] = {3, 3}, smoothness[2] = {2, 2};
  size_t spans[2] = {1, 1};
  set_space(s, degree, smoothness, spans);
  set_cap(s, 0.8, 0, &seed);
  bool accepted;
  convex_rows rows;
  T_OK(convex_rows_make(ctx, &s->space, s->reference[0], &defaults, &accepted, &rows), ctx);
  T_CHECK(accepted && rows.boxes == 1 && rows.depth == 0 && rows.matrix.rows == 352 && rows.matrix.columns == 48,
          "a bicubic cap: 352 rows, here %zu", rows.matrix.rows);
  double x[48], direction[48], *part = malloc(352 * 48 * sizeof *part), lower[352];
  for (int without = -1; without < 7; without++) {
    size_t count = 0;
    for (size_t i = 0; i < 352; i++) {
      int kind = i < 48 ? 0 : i < 96 ? 1 : 2;
      int rank = kind == 2 ? (int)((i - 96) / 4 % 4) : -1; /* of the direction */
      if (kind == without || (without >= 3 && rank == without - 3)) continue;
      memcpy(part + 48 * count, rows.matrix.dense + 48 * i, 48 * sizeof *part);
      lower[count++] = rows.lower[i];
    }
    convex_rows fewer = {.matrix = batten_matrix_dense(count, 48, part), .lower = lower};
    double least = INFINITY;
    for (int k = 0; k < 12; k++) {
      for (int i = 0; i < 48; i++) direction[i] = normal(&seed);
      if (corner(ctx, &fewer, s->reference[0], direction, 0.3, x))
        least = fmin(least, least_definite(s, x, rows.sign, 12));
    }
    static const char *const names[] = {"all rows",
                                        "rows but those of x_u",
                                        "rows but those of x_v",
                                        "rows but forms",
                                        "rows but direction 0",
                                        "rows but direction 1",
                                        "rows but direction 2",
                                        "rows but direction 3"};
    T_CHECK((least > 0) == (without < 0), "%zu %s: %.3g", count, names[without + 1], least);
  }
  free(part);
  convex_rows_free(ctx, &rows);
  free(s);
  batten_context_free(ctx);
}

/* A symmetric matrix with z_a'H z_(a+1) >= 0 over a half turn is semidefinite, for any angles below a half turn. */
static void test_theorem(void) {
  uint64_t seed = 31;
  size_t tried = 0, held = 0, wrong = 0;
  double nearest = INFINITY;
  for (int P = 3; P <= 16; P++)
    for (int k = 0; k < 4000; k++, tried++) {
      double z[17][2], r[4], h[3] = {normal(&seed), normal(&seed), normal(&seed)};
      if (k % 2) { /* near the border of definite ones */
        h[0] = r[0] = normal(&seed), r[1] = normal(&seed), r[2] = 0.3 * normal(&seed);
        h[0] = r[0] * r[0] + r[2], h[1] = r[0] * r[1], h[2] = r[1] * r[1] + 0.3 * normal(&seed);
      }
      for (int i = 0; i < 4; i++) r[i] = normal(&seed);
      for (int a = 0; a <= P; a++) {
        double angle = acos(-1) * a / P;
        z[a][0] = r[0] * cos(angle) + r[1] * sin(angle);
        z[a][1] = r[2] * cos(angle) + r[3] * sin(angle);
      }
      bool holds = true;
      for (int a = 0; a < P; a++)
        holds = holds && h[0] * z[a][0] * z[a + 1][0] + h[1] * (z[a][0] * z[a + 1][1] + z[a][1] * z[a + 1][0]) +
                                 h[2] * z[a][1] * z[a + 1][1] >=
                             0;
      if (!holds) continue;
      held++;
      double least = (h[0] + h[2] - hypot(h[0] - h[2], 2 * h[1])) / 2;
      nearest = fmin(nearest, fabs(least));
      if (least < -1e-12 * (fabs(h[0]) + fabs(h[2]))) wrong++;
    }
  T_CHECK(wrong == 0 && held > 1000, "%zu of %zu matrices have P forms >= 0, all are semidefinite; nearest %.2g",
          held, tried, nearest);
}

/* ---- invariances --------------------------------------------------------------------------------- */

static void set_kind(scene *s, int kind, uint64_t *seed) {
  unsigned degree[2] = {3, kind ? 4 : 3}, smoothness[2] = {2, 2};
  size_t spans[2] = {kind ? 2 : 1, 1};
  set_space(s, degree, smoothness, spans);
  set_cap(s, 1.5, 0.003, seed);
}

static void test_invariance(void) {
  batten_context *ctx = plain();
  uint64_t seed = 41;
  scene *s = malloc(sizeof *s), *t = malloc(sizeof *t);
  for (int kind = 0; kind < 2; kind++) {
    bool accepted, accepted_too;
    convex_rows rows, others;
    do {
      set_kind(s, kind, &seed);
      convex_rows_make(ctx, &s->space, s->reference[0], &defaults, &accepted, NULL);
    } while (!accepted);
    convex_rows_make(ctx, &s->space, s->reference[0], &defaults, &accepted, &rows);
    size_t n = rows.matrix.columns, points = n / 3;
    size_t entries = kind ? rows.matrix.starts[rows.matrix.rows] : rows.matrix.rows * n;
    T_CHECK((rows.matrix.dense == NULL) == (kind != 0), "one span pair is dense, others sparse: %zu boxes, depth %u",
            rows.boxes, rows.depth);

    for (int exponent = -61; exponent <= 60; exponent += 11) {
      *t = *s;
      for (size_t i = 0; i < points; i++)
        for (int k = 0; k < 3; k++) t->reference[i][k] = ldexp(s->reference[i][k], exponent);
      convex_rows_make(ctx, &s->space, t->reference[0], &defaults, &accepted_too, &others);
      bool same = accepted_too && others.matrix.rows == rows.matrix.rows && others.boxes == rows.boxes;
      same = same && memcmp(kind ? others.matrix.values : others.matrix.dense,
                            kind ? rows.matrix.values : rows.matrix.dense, entries * sizeof(double)) == 0;
      for (size_t i = 0; same && i < rows.matrix.rows; i++) same = others.lower[i] == ldexp(rows.lower[i], exponent);
      T_CHECK(same, "scaled by 2^%d: the same bits", exponent);
      if (accepted_too) convex_rows_free(ctx, &others);
    }

    for (int k = 0; k < 3; k++) { /* turned about some axis, moved, and reversed */
      double c = cos(k + 0.3), d = sin(k + 0.3);
      *t = *s;
      for (size_t i = 0; i < points; i++) {
        double *p = t->reference[i], a = p[k % 3], b = p[(k + 1) % 3];
        p[k % 3] = c * a - d * b + 0.7;
        p[(k + 1) % 3] = d * a + c * b - 3;
      }
      convex_rows_make(ctx, &s->space, t->reference[0], &defaults, &accepted_too, &others);
      T_CHECK(accepted_too && others.boxes == rows.boxes && others.depth == rows.depth && others.sign == rows.sign &&
                  others.matrix.rows == rows.matrix.rows,
              "turned and moved: %zu boxes, %zu rows", others.boxes, others.matrix.rows);
      convex_rows_free(ctx, &others);
    }
    for (size_t i = 0; i < points; i++) {
      memcpy(t->reference[i], s->reference[i], sizeof t->reference[i]);
      t->reference[i][2] = -t->reference[i][2];
    }
    convex_rows_make(ctx, &s->space, t->reference[0], &defaults, &accepted_too, &others);
    T_CHECK(accepted_too && others.boxes == rows.boxes && others.sign == -rows.sign, "mirrored: the other sign");
    convex_rows_free(ctx, &others);

    /* u and v change places: the same rows with columns permuted, in another order. */
    for (int d = 0; d < 2; d++) {
      memcpy(t->knots[d], s->knots[1 - d], sizeof t->knots[d]);
      t->space.axis[d] = s->space.axis[1 - d];
      t->space.axis[d].knots = t->knots[d];
    }
    size_t n0 = s->space.axis[0].count, n1 = s->space.axis[1].count;
    for (size_t i = 0; i < n0; i++)
      for (size_t j = 0; j < n1; j++) memcpy(t->reference[j * n0 + i], s->reference[i * n1 + j], 3 * sizeof(double));
    convex_rows_make(ctx, &t->space, t->reference[0], &defaults, &accepted_too, &others);
    T_CHECK(accepted_too && others.boxes == rows.boxes && others.sign == -rows.sign &&
                others.matrix.rows == rows.matrix.rows,
            "u and v change places: %zu boxes, sign %d", others.boxes, others.sign);
    /* The same polyhedron: it ends at the same place in any direction. */
    double worst = 0, *direction = malloc(2 * n * sizeof *direction);
    for (int k = 0; k < 20; k++) {
      for (size_t i = 0; i < n0; i++)
        for (size_t j = 0; j < n1; j++)
          for (size_t e = 0; e < 3; e++)
            direction[3 * (i * n1 + j) + e] = direction[n + 3 * (j * n0 + i) + e] = normal(&seed);
      double one = reach(&rows, s->reference[0], direction, 10),
             other = reach(&others, t->reference[0], direction + n, 10);
      worst = fmax(worst, fabs(one - other) / one);
    }
    T_RATIO(worst, 1e-9, "the polyhedra with u and v changed agree");
    free(direction);
    convex_rows_free(ctx, &others);

    size_t twice = 0;
    for (size_t i = 0; !kind && i < rows.matrix.rows; i++)
      for (size_t j = 0; j < i; j++)
        if (memcmp(rows.matrix.dense + i * n, rows.matrix.dense + j * n, n * sizeof(double)) == 0) twice++;
    T_CHECK(twice == 0, "no row is there twice");
    convex_rows_free(ctx, &rows);
  }
  free(s);
  free(t);
  batten_context_free(ctx);
}

/* ---- what is refused ----------------------------------------------------------------------------- */

static bool is_accepted(batten_context *ctx, const scene *s, const convex_row_options *opt) {
  bool accepted = true;
  convex_rows rows = {.boxes = 77};
  batten_status status = convex_rows_make(ctx, &s->space, s->reference[0], opt, &accepted, &rows);
  if (status < 0) return false;
  if (accepted)
    convex_rows_free(ctx, &rows);
  else if (rows.boxes != 77)
    T_CHECK(false, "what is refused writes nothing");
  return accepted;
}

static void test_refused(void) {
  batten_context *ctx = plain();
  uint64_t seed = 51;
  scene *s = malloc(sizeof *s);
  unsigned degree[2] = {3, 3}, smoothness[2] = {2, 2};
  size_t spans[2] = {1, 2};
  set_space(s, degree, smoothness, spans);
  double u[KNOTS], v[KNOTS];
  bspline_greville(&s->space.axis[0], u);
  bspline_greville(&s->space.axis[1], v);
  static const char *const names[] = {"paraboloid", "saddle",    "plane",
                                      "cylinder",   "one point", "line",
                                      "wavy sheet", "no number", "convex but for one corner"};
  for (int kind = 0; kind < 9; kind++) {
    for (size_t i = 0; i < s->space.axis[0].count; i++)
      for (size_t j = 0; j < s->space.axis[1].count; j++) {
        double x = u[i] - 0.5, y = v[j] - 0.5, z = x * x + y * y;
        if (kind == 1) z = x * x - y * y;
        if (kind == 2) z = 0.3 * x - y;
        if (kind == 3) z = x * x;
        if (kind == 4) x = y = z = 1;
        if (kind == 5) y = z = x;
        if (kind == 6) z = (i + j) % 2 ? 0.1 : 0;
        if (kind == 7 && i == 2 && j == 2) z = NAN;
        if (kind == 8 && i == 0 && j == 0) z -= 0.3;
        double p[3] = {x, y, z};
        memcpy(s->reference[i * s->space.axis[1].count + j], p, sizeof p);
      }
    T_CHECK(is_accepted(ctx, s, &defaults) == (kind == 0), "%s: %s", names[kind], kind ? "refused" : "accepted");
  }

  /* Limits: a surface that needs bisection. */
  bool accepted;
  convex_rows rows = {0};
  do {
    convex_rows_free(ctx, &rows);
    set_cap(s, 1.5, 0.004, &seed);
    convex_rows_make(ctx, &s->space, s->reference[0], &defaults, &accepted, &rows);
  } while (!accepted || rows.depth == 0);
  size_t count = rows.matrix.rows;
  unsigned depth = rows.depth;
  T_CHECK(accepted && depth > 0 && rows.boxes > 2, "a cap that needs bisection: %zu boxes, %zu rows, depth %u",
          rows.boxes, count, depth);
  convex_rows_free(ctx, &rows);
  convex_row_options o = defaults;
  o.row_limit = count;
  T_CHECK(is_accepted(ctx, s, &o), "row_limit %zu", count);
  o.row_limit = count - 1;
  T_CHECK(!is_accepted(ctx, s, &o), "row_limit %zu", count - 1);
  for (o = defaults, o.depth_max = 0; o.depth_max <= depth; o.depth_max++) {
    bool enough = is_accepted(ctx, s, &o);
    T_CHECK(enough || o.depth_max < depth, "depth_max %u: %s", o.depth_max, enough ? "accepted" : "refused");
    T_CHECK(!enough || o.depth_max > 0, "no depth, no bisection");
  }
  set_cap(s, 1.2, 0, &seed);
  for (unsigned directions = 3; directions <= 16; directions += directions < 8 ? 1 : 4) {
    o = defaults;
    o.directions = directions;
    convex_rows_make(ctx, &s->space, s->reference[0], &o, &accepted, &rows);
    printf("# %u directions: %zu boxes, %zu rows\n", directions, rows.boxes, rows.matrix.rows);
    T_CHECK(accepted, "%u directions", directions);
    if (accepted) convex_rows_free(ctx, &rows);
  }
  free(s);
  batten_context_free(ctx);
}

/* A paraboloid with parameters that run unevenly, u -> u + bend u (1 - u), has large second derivatives along the
 * surface; they do not count. Control points by interpolation: the degree is 4, the space holds it. */
static void test_parameters_along(void) {
  batten_context *ctx = plain();
  scene *s = malloc(sizeof *s);
  unsigned degree[2] = {4, 4}, smoothness[2] = {3, 3};
  size_t spans[2] = {1, 1};
  set_space(s, degree, smoothness, spans);
  /* 1, 4, 25 and too many with them. */
  static const size_t most[4] = {1, 1, 12, 100};
  for (int k = 0; k <= 3; k++) {
    double bend = 0.3 * k;
    /* Bernstein coefficients of degree 4 of p = u + bend u (1 - u) - 1/2 and of its square. */
    double two[3] = {-0.5, (1 + bend) / 2 - 0.5, 0.5}, p[5], q[5] = {0};
    static const double raise[5][3] = {{1, 0, 0}, {0.5, 0.5, 0}, {1. / 6, 4. / 6, 1. / 6}, {0, 0.5, 0.5}, {0, 0, 1}};
    static const double choose[5] = {1, 4, 6, 4, 1};
    for (int i = 0; i < 5; i++) p[i] = raise[i][0] * two[0] + raise[i][1] * two[1] + raise[i][2] * two[2];
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) q[i + j] += (i == 1 ? 2 : 1) * (j == 1 ? 2 : 1) / choose[i + j] * two[i] * two[j];
    for (int i = 0; i < 5; i++)
      for (int j = 0; j < 5; j++) {
        double point[3] = {p[i], p[j], (q[i] + q[j]) / 2};
        memcpy(s->reference[5 * i + j], point, sizeof point);
      }
    bool accepted;
    convex_rows rows = {0};
    convex_rows_make(ctx, &s->space, s->reference[0], &defaults, &accepted, &rows);
    T_CHECK(accepted && rows.boxes <= most[k], "a paraboloid, parameters bent by %.1f: %zu boxes", bend, rows.boxes);
    convex_rows_free(ctx, &rows);
  }
  free(s);
  batten_context_free(ctx);
}

static batten_status make(batten_context *ctx, void *arg) {
  scene *s = arg;
  bool accepted;
  convex_rows rows;
  batten_status status = convex_rows_make(ctx, &s->space, s->reference[0], &defaults, &accepted, &rows);
  if (status == BATTEN_OK) convex_rows_free(ctx, &rows);
  return status;
}

static void test_memory(void) {
  uint64_t seed = 61;
  scene *s = malloc(sizeof *s);
  for (int kind = 0; kind < 2; kind++) {
    set_kind(s, kind, &seed);
    set_cap(s, 1, 0, &seed);
    t_fail_every_allocation(kind ? "sparse rows" : "dense rows", make, s);
  }
  free(s);
}

int main(void) {
  test_polyhedra();
  test_all_needed();
  test_theorem();
  test_invariance();
  test_refused();
  test_parameters_along();
  test_memory();
  return t_done();
}
