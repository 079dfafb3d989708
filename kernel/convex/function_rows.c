/* Linear inequalities that make a spline function convex.   [Juettler: Surface fitting using convex tensor-product
 * splines, 1997]
 *
 * On a box the Hessian H(x, y) has Bernstein coefficients H_rs, symmetric matrices that are linear in the spline's
 * own coefficients, once f_xx, f_xy, f_yy are raised to the same degrees. All H_rs semidefinite: H is. A matrix is
 * semidefinite if
 *     z_a' H z_(a + 1) >= 0,  a = 0 .. P - 1,   z_P = -z_0,
 * for P >= 3 directions in the order of their angles, neighbours less than half a turn apart: these are the facets of
 * the cone of the matrices n_a n_a', n_a across z_a, which is inscribed in the circular cone of semidefinite ones.
 *
 * Any directions will do, and each coefficient of each box has its own: those along and across the eigenvectors of
 * what this coefficient is of a reference (its H_rs is then in the cone if it is semidefinite at all, so that a
 * reference that is feasible stays so), and two on either side of the direction of least curvature, the closer the
 * nearer it is to singular. So few directions are as good as very many fixed ones.
 *
 * Necessary inequalities are z' H(x, y) z >= 0 at places, z the worst eigenvector. */
#include <string.h>

#include "base/checked.h"
#include "basis/bezier.h"
#include "function_inner.h"

static const double half_turn = 3.14159265358979323846;

void function_axis_rows(const bspline *b, size_t mu, double lower, double upper, double *rows) {
  unsigned d = b->degree, order = d + 1;
  for (unsigned k = 0; k < 3; k++) {
    double *table = rows + k * order * order;
    bspline_rows(b, mu, k, lower, upper, table);
    for (unsigned degree = d - k; degree < d; degree++)
      for (unsigned r = degree + 1; r + 1 > 0; r--) { /* in place: from the last to the first */
        double part = (double)r / (degree + 1);
        for (unsigned j = 0; j < order; j++)
          table[r * order + j] =
              (r ? part * table[(r - 1) * order + j] : 0) + (r <= degree ? (1 - part) * table[r * order + j] : 0);
        if (r == 0) break;
      }
  }
}

typedef struct box_tables {
  size_t first[2]; /* of the coefficients that live there */
  double rows[2][3 * FUNCTION_TABLE];
} box_tables;

static void make_tables(const function_space *space, const function_box *box, box_tables *t) {
  for (int i = 0; i < 2; i++) {
    const bspline *b = &space->spline.axis[i];
    size_t mu = space->span[i][box->span[i]];
    t->first[i] = mu - b->degree;
    function_axis_rows(b, mu, box->lower[i], box->upper[i], t->rows[i]);
  }
}

/* out [n_0][n_1][3] = the three products of derivatives (2, 0), (1, 1), (0, 2) of local coefficients [n_0][n_1]. */
static void apply_tables(const function_space *space, const box_tables *t, const double *x, double *out) {
  size_t n0 = space->spline.axis[0].degree + 1, n1 = space->spline.axis[1].degree + 1;
  size_t stride = space->spline.axis[1].count;
  double half[FUNCTION_TABLE];
  for (unsigned k = 0; k < 3; k++) {
    const double *u = t->rows[0] + (2 - k) * n0 * n0, *v = t->rows[1] + k * n1 * n1;
    for (size_t i = 0; i < n0; i++)
      for (size_t s = 0; s < n1; s++) {
        const double *c = x + (t->first[0] + i) * stride + t->first[1];
        double sum = 0;
        for (size_t j = 0; j < n1; j++) sum += v[s * n1 + j] * c[j];
        half[i * n1 + s] = sum;
      }
    for (size_t r = 0; r < n0; r++)
      for (size_t s = 0; s < n1; s++) {
        double sum = 0;
        for (size_t i = 0; i < n0; i++) sum += u[r * n0 + i] * half[i * n1 + s];
        out[(r * n1 + s) * 3 + k] = sum;
      }
  }
}

void function_hessian_box(const function_space *space, const function_box *box, const double *x, double *out) {
  box_tables t;
  make_tables(space, box, &t);
  apply_tables(space, &t, x, out);
}

typedef struct place_tables {
  size_t first[2];
  double basis[2][3 * BSPLINE_ORDER]; /* [derivative][degree + 1] */
} place_tables;

static void make_place(const function_space *space, const uint32_t span[2], const double place[2], place_tables *t) {
  for (int i = 0; i < 2; i++) {
    const bspline *b = &space->spline.axis[i];
    size_t mu = space->span[i][span[i]];
    t->first[i] = mu - b->degree;
    bspline_basis(b, mu, place[i], 2, t->basis[i]);
  }
}

static void place_hessian(const function_space *space, const place_tables *t, const double *x, double out[3]) {
  size_t n0 = space->spline.axis[0].degree + 1, n1 = space->spline.axis[1].degree + 1;
  size_t stride = space->spline.axis[1].count;
  for (int k = 0; k < 3; k++) out[k] = 0;
  for (size_t i = 0; i < n0; i++) {
    const double *c = x + (t->first[0] + i) * stride + t->first[1];
    double sum[3] = {0};
    for (size_t j = 0; j < n1; j++)
      for (size_t k = 0; k < 3; k++) sum[k] += t->basis[1][k * n1 + j] * c[j];
    for (size_t k = 0; k < 3; k++) out[k] += t->basis[0][(2 - k) * n0 + i] * sum[k];
  }
}

void function_hessian_at(const function_space *space, const uint32_t span[2], const double place[2], const double *x,
                         double out[3]) {
  place_tables t;
  make_place(space, span, place, &t);
  place_hessian(space, &t, x, out);
}

void function_eigen(const double h[3], double values[2], double *angle) {
  double mean = (h[0] + h[2]) / 2, off = (h[0] - h[2]) / 2, radius = hypot(off, h[1]);
  values[0] = mean + radius;
  values[1] = mean - radius;
  if (angle) *angle = radius > 0 ? atan2(h[1], off) / 2 : 0;
}

/* ---- sufficient inequalities --------------------------------------------------------------------- */

enum { DIRECTIONS_MAX = 16 };

/* Adds an angle, in [0, half a turn), unless it is there already: to 1e-3, below which rows are parallel to the
 * digits that they are solved to. */
static void add_angle(double angle, unsigned *count, double *angles) {
  angle -= half_turn * floor(angle / half_turn);
  for (unsigned i = 0; i < *count; i++) {
    double off = fabs(angle - angles[i]);
    if (fmin(off, half_turn - off) < 1e-3) return;
  }
  if (*count == DIRECTIONS_MAX) return;
  unsigned at = (*count)++;
  for (; at > 0 && angles[at - 1] > angle; at--) angles[at] = angles[at - 1];
  angles[at] = angle;
}

/* Directions for a coefficient that is h of the reference. */
static unsigned choose_directions(const function_directions *opt, const double h[3], const double *other,
                                  double scale, double *angles) {
  double values[2], angle, ratio;
  unsigned count = 0;
  function_eigen(h, values, &angle);
  double large = fmax(values[0], 1e-3 * scale); /* of next to nothing directions say nothing */
  ratio = fmin(fmax(values[1] / large, opt->bunch), 1);
  double least = angle + half_turn / 2;
  add_angle(angle, &count, angles);
  add_angle(least, &count, angles);
  double step = atan(sqrt(ratio));
  add_angle(least + step, &count, angles);
  add_angle(least - step, &count, angles);
  if (other && values[1] < 0.3 * large) {
    double there[2], turn;
    function_eigen(other, there, &turn);
    if (there[0] - there[1] > 1e-3 * scale) add_angle(turn + half_turn / 2, &count, angles);
  }
  /* Between the innermost and those across: steps that grow by a constant factor. */
  for (unsigned k = 1; k <= opt->extra && values[1] < 0.3 * large; k++) {
    double wide = atan(pow(ratio, 0.5 * (opt->extra + 1 - k) / (opt->extra + 1)));
    add_angle(least + wide, &count, angles);
    add_angle(least - wide, &count, angles);
  }
  return count;
}

/* One row: the part of H_rs along z_a, z_b, times the sign, of length 1. */
static void append_row(const function_space *space, const box_tables *t, size_t r, size_t s, const double part[3],
                       double lower, function_matrix *rows) {
  size_t n0 = space->spline.axis[0].degree + 1, n1 = space->spline.axis[1].degree + 1;
  size_t stride = space->spline.axis[1].count, begin = rows->starts[rows->rows], at = begin;
  const double *u = t->rows[0] + r * n0, *v = t->rows[1] + s * n1;
  double square = 0;
  for (size_t i = 0; i < n0; i++)
    for (size_t j = 0; j < n1; j++) {
      double value = part[0] * u[2 * n0 * n0 + i] * v[j] + part[1] * u[n0 * n0 + i] * v[n1 * n1 + j] +
                     part[2] * u[i] * v[2 * n1 * n1 + j];
      if (value == 0) continue;
      rows->indices[at] = (uint32_t)((t->first[0] + i) * stride + t->first[1] + j);
      rows->values[at++] = value;
      square += value * value;
    }
  if (!(square > 0)) return;
  double scale = 1 / sqrt(square);
  for (size_t k = begin; k < at; k++) rows->values[k] *= scale;
  rows->lower[rows->rows++] = lower * scale;
  rows->starts[rows->rows] = at;
}

batten_status function_rows_box(batten_context *ctx, const function_space *space, const function_box *box,
                                const function_directions *opt, const double *reference, const double *other,
                                double scale, function_matrix *rows) {
  size_t n0 = space->spline.axis[0].degree + 1, n1 = space->spline.axis[1].degree + 1, points = n0 * n1;
  double sign = function_sign(space, box->span), h[2][3 * FUNCTION_TABLE];
  box_tables t;
  batten_status st = function_matrix_reserve(ctx, rows, points * DIRECTIONS_MAX, points * points * DIRECTIONS_MAX);
  if (st < 0) return st;
  make_tables(space, box, &t);
  apply_tables(space, &t, reference, h[0]);
  if (other) apply_tables(space, &t, other, h[1]);
  for (int which = 0; which < (other ? 2 : 1); which++)
    for (size_t k = 0; k < 3 * points; k++) h[which][k] *= sign;
  for (size_t r = 0; r < n0; r++)
    for (size_t s = 0; s < n1; s++) {
      double angles[DIRECTIONS_MAX];
      size_t at = 3 * (r * n1 + s);
      unsigned count = choose_directions(opt, h[0] + at, other ? h[1] + at : NULL, scale, angles);
      for (unsigned a = 0; a < count; a++) {
        bool last = a + 1 == count;
        double from = angles[a], to = last ? angles[0] + half_turn : angles[a + 1];
        double z[2][2] = {{cos(from), sin(from)}, {cos(to), sin(to)}};
        double part[3] = {sign * z[0][0] * z[1][0], sign * (z[0][0] * z[1][1] + z[0][1] * z[1][0]),
                          sign * z[0][1] * z[1][1]};
        append_row(space, &t, r, s, part, opt->margin * cos(to - from), rows);
      }
    }
  return BATTEN_OK;
}

/* ---- necessary inequalities ---------------------------------------------------------------------- */

static void append_cut(const function_space *space, const uint32_t span[2], const double place[2], const double z[2],
                       function_matrix *cuts) {
  place_tables t;
  size_t n0 = space->spline.axis[0].degree + 1, n1 = space->spline.axis[1].degree + 1;
  size_t stride = space->spline.axis[1].count, begin = cuts->starts[cuts->rows], at = begin;
  double sign = function_sign(space, span), square = 0;
  make_place(space, span, place, &t);
  for (size_t i = 0; i < n0; i++)
    for (size_t j = 0; j < n1; j++) {
      const double *u = t.basis[0] + i, *v = t.basis[1] + j;
      double value =
          sign * (z[0] * z[0] * u[2 * n0] * v[0] + 2 * z[0] * z[1] * u[n0] * v[n1] + z[1] * z[1] * u[0] * v[2 * n1]);
      if (value == 0) continue;
      cuts->indices[at] = (uint32_t)((t.first[0] + i) * stride + t.first[1] + j);
      cuts->values[at++] = value;
      square += value * value;
    }
  if (!(square > 0)) return;
  for (size_t k = begin; k < at; k++) cuts->values[k] /= sqrt(square);
  cuts->lower[cuts->rows++] = 0;
  cuts->starts[cuts->rows] = at;
}

/* The least signed eigenvalue at a place, and its direction. */
static double least_at(const function_space *space, const uint32_t span[2], const double place[2], const double *x,
                       double z[2]) {
  double h[3], values[2], angle, sign = function_sign(space, span);
  function_hessian_at(space, span, place, x, h);
  for (int k = 0; k < 3; k++) h[k] *= sign;
  function_eigen(h, values, &angle);
  z[0] = -sin(angle);
  z[1] = cos(angle);
  return values[1];
}

/* From a place to a nearby one that is worse, by steps that are halved. */
static double descend(const function_space *space, const uint32_t span[2], const double *lower, const double *upper,
                      const double *x, double step, double place[2], double z[2]) {
  double best = least_at(space, span, place, x, z);
  for (int halvings = 0; halvings < 5; step /= 2, halvings++)
    for (int side = 0; side < 4; side++) {
      int i = side / 2;
      double there[2] = {place[0], place[1]}, w[2];
      there[i] += (side % 2 ? step : -step) * (upper[i] - lower[i]);
      there[i] = fmin(fmax(there[i], lower[i]), upper[i]);
      double value = least_at(space, span, there, x, w);
      if (!(value < best)) continue;
      best = value;
      for (int k = 0; k < 2; k++) {
        place[k] = there[k];
        z[k] = w[k];
      }
    }
  return best;
}

/* Cuts of one span pair: of all places of the grid that are nearly as bad as the worst, and of the worst near it. */
static double cut_span(const function_space *space, const uint32_t span[2], const double *x, double tolerance,
                       unsigned grid, function_matrix *cuts) {
  double lower[2], upper[2], worst = INFINITY, at[2] = {0}, z[2];
  for (int i = 0; i < 2; i++) {
    const double *knots = space->spline.axis[i].knots + space->span[i][span[i]];
    lower[i] = knots[0];
    upper[i] = knots[1];
  }
  for (int pass = 0; pass < 2; pass++) {
    for (unsigned a = 0; a <= grid; a++)
      for (unsigned b = 0; b <= grid; b++) {
        double part[2] = {(double)a / grid, (double)b / grid};
        double place[2] = {(1 - part[0]) * lower[0] + part[0] * upper[0],
                           (1 - part[1]) * lower[1] + part[1] * upper[1]};
        double value = least_at(space, span, place, x, z);
        if (pass == 1 && value < -tolerance && value <= worst / 4) append_cut(space, span, place, z, cuts);
        if (pass == 0 && value < worst) {
          worst = value;
          at[0] = place[0];
          at[1] = place[1];
        }
      }
    if (worst > tolerance) return 0; /* nothing near zero here */
  }
  double near = descend(space, span, lower, upper, x, 0.5 / grid, at, z);
  if (near < -tolerance && near < worst) append_cut(space, span, at, z, cuts);
  return fmin(near, 0);
}

batten_status function_cuts(batten_context *ctx, const function_space *space, const double *x, double tolerance,
                            unsigned grid, function_matrix *cuts, double *worst) {
  size_t points = (space->spline.axis[0].degree + 1) * (size_t)(space->spline.axis[1].degree + 1);
  size_t most = (size_t)(grid + 1) * (grid + 1) + 1;
  *worst = 0;
  for (size_t s = 0; s < space->spans[0] * space->spans[1]; s++) {
    uint32_t span[2] = {(uint32_t)(s / space->spans[1]), (uint32_t)(s % space->spans[1])};
    if (function_sign(space, span) == 0) continue;
    batten_status st = function_matrix_reserve(ctx, cuts, most, most * points);
    if (st < 0) return st;
    *worst = fmin(*worst, cut_span(space, span, x, tolerance, grid, cuts));
  }
  return BATTEN_OK;
}
