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
 * Where signs change, the Hessian vanishes, and the coefficients of another matrix take the place of H_rs: see
 * make_divided_axis.
 *
 * Necessary inequalities are z' H(x, y) z >= 0 at places, z the worst eigenvector. */
#include <string.h>

#include "base/checked.h"
#include "basis/bezier.h"
#include "function_inner.h"

static const double half_turn = 3.14159265358979323846;

/* Rows of a polynomial of degree n become those of degree n + 1: combinations of `order` numbers, in place. */
static void raise_rows(unsigned n, size_t order, double *rows) {
  for (unsigned r = n + 2; r-- > 0;) { /* from the last to the first: what is read is not yet written */
    double part = (double)r / (n + 1);
    for (size_t j = 0; j < order; j++)
      rows[r * order + j] =
          (r > 0 ? part * rows[(r - 1) * order + j] : 0) + (r <= n ? (1 - part) * rows[r * order + j] : 0);
  }
}

/* Divides a polynomial of degree n with a zero of order m at 0 (side 0) or at 1 by t^m or (1 - t)^m. */
static void divide_rows(unsigned n, unsigned m, int side, size_t order, double *rows) {
  for (unsigned k = 0; k + m <= n; k++) {
    unsigned from = side == 0 ? k + m : k;
    double factor = bezier_binomial[n][from] / bezier_binomial[n - m][k];
    for (size_t j = 0; j < order; j++) rows[k * order + j] = factor * rows[from * order + j];
  }
}

/* From [0, 1] to [lower, upper] in it, by blossoms; work [n + 1][order]. */
static void restrict_rows(unsigned n, double lower, double upper, size_t order, double *rows, double *work) {
  double out[FUNCTION_TABLE];
  for (unsigned i = 0; i <= n; i++) {
    memcpy(work, rows, (n + 1) * order * sizeof *work);
    for (unsigned round = 1; round <= n; round++) {
      double t = round <= n - i ? lower : upper;
      for (unsigned p = 0; p + round <= n; p++)
        for (size_t j = 0; j < order; j++)
          work[p * order + j] = (1 - t) * work[p * order + j] + t * work[(p + 1) * order + j];
    }
    memcpy(out + i * order, work, order * sizeof *out);
  }
  memcpy(rows, out, (n + 1) * order * sizeof *rows);
}

/* True when the neighbour across this side of a span pair has the opposite sign. */
static bool line_at(const function_space *space, const uint32_t span[2], int axis, int side) {
  uint32_t other[2] = {span[0], span[1]};
  if (side == 0 ? other[axis] == 0 : other[axis] + 1 == space->spans[axis]) return false;
  other[axis] += side == 0 ? UINT32_MAX : 1;
  return function_sign(space, span) * function_sign(space, other) < 0;
}

typedef struct box_tables {
  size_t first[2];                    /* of the coefficients that live there */
  size_t count[2];                    /* of Bernstein coefficients */
  double rows[2][3 * FUNCTION_TABLE]; /* [derivative][count][degree + 1], all of one degree */
} box_tables;

static void make_axis(const bspline *b, size_t mu, double lower, double upper, int i, box_tables *t) {
  unsigned d = b->degree;
  size_t order = d + 1;
  t->first[i] = mu - d;
  t->count[i] = order;
  for (unsigned k = 0; k < 3; k++) {
    double *rows = t->rows[i] + k * order * order;
    bspline_rows(b, mu, k, lower, upper, rows);
    for (unsigned n = d - k; n < d; n++) raise_rows(n, order, rows);
  }
}

static void make_tables(const function_space *space, const function_box *box, box_tables *t) {
  for (int i = 0; i < 2; i++)
    make_axis(&space->spline.axis[i], space->span[i][box->span[i]], box->lower[i], box->upper[i], i, t);
}

/* A span at an end of which the sign changes: there the spline is linear along the line, its slope across is
 * constant, and with C^2 its second derivative across vanishes, too. So, with t the distance from it, f_tt, f_ts,
 * f_ss have zeros there of orders m - 2, m - 1, m, with m = 3 (C^1: 2), and H = t^(m - 2) diag(1, t) G diag(1, t): it
 * is semidefinite where G = (f_tt / t^(m - 2), f_ts / t^(m - 1), f_ss / t^m) is. G need not vanish anywhere, while
 * the coefficients of H next to the line always do, and would not let it change along it. */
static void make_divided_axis(const function_space *space, const function_box *box, int i, const bool line[2],
                              box_tables *t) {
  const bspline *b = &space->spline.axis[i];
  size_t mu = space->span[i][box->span[i]], order = b->degree + 1;
  double begin = b->knots[mu], length = b->knots[mu + 1] - begin, work[FUNCTION_TABLE];
  int degree[3], most = -1;
  t->first[i] = mu - b->degree;
  for (unsigned k = 0; k < 3; k++) {
    double *rows = t->rows[i] + k * order * order;
    unsigned zeros = (space->smoothness[i] >= 2 ? 3 : 2) - k;
    degree[k] = (int)(b->degree - k);
    bspline_rows(b, mu, k, begin, b->knots[mu + 1], rows);
    for (int side = 0; side < 2; side++) {
      if (!line[side] || degree[k] < 0) continue;
      if (degree[k] >= (int)zeros) divide_rows((unsigned)degree[k], zeros, side, order, rows);
      degree[k] -= (int)zeros; /* below 0: nothing but 0 has so many zeros */
    }
    if (degree[k] > most) most = degree[k];
  }
  t->count[i] = (size_t)(most + 1);
  for (unsigned k = 0; k < 3 && most >= 0; k++) {
    double *rows = t->rows[i] + k * order * order;
    if (degree[k] < 0) memset(rows, 0, order * order * sizeof *rows);
    for (int n = degree[k]; n >= 0 && n < most; n++) raise_rows((unsigned)n, order, rows);
    restrict_rows((unsigned)most, (box->lower[i] - begin) / length, (box->upper[i] - begin) / length, order, rows,
                  work);
  }
}

/* As make_tables, but of G along the first axis across which the sign changes. */
static void make_divided_tables(const function_space *space, const function_box *box, box_tables *t) {
  make_tables(space, box, t);
  for (int i = 0; i < 2; i++) {
    bool line[2] = {line_at(space, box->span, i, 0), line_at(space, box->span, i, 1)};
    if (!line[0] && !line[1]) continue;
    make_divided_axis(space, box, i, line, t);
    return;
  }
}

/* out [count_0][count_1][3]: f_xx, f_xy, f_yy. */
static void apply_tables(const function_space *space, const box_tables *t, const double *x, double *out) {
  size_t n0 = space->spline.axis[0].degree + 1, n1 = space->spline.axis[1].degree + 1;
  size_t stride = space->spline.axis[1].count;
  double half[FUNCTION_TABLE];
  for (unsigned k = 0; k < 3; k++) {
    const double *u = t->rows[0] + (2 - k) * n0 * n0, *v = t->rows[1] + k * n1 * n1;
    for (size_t i = 0; i < n0; i++)
      for (size_t s = 0; s < t->count[1]; s++) {
        const double *c = x + (t->first[0] + i) * stride + t->first[1];
        double sum = 0;
        for (size_t j = 0; j < n1; j++) sum += v[s * n1 + j] * c[j];
        half[i * n1 + s] = sum;
      }
    for (size_t r = 0; r < t->count[0]; r++)
      for (size_t s = 0; s < t->count[1]; s++) {
        double sum = 0;
        for (size_t i = 0; i < n0; i++) sum += u[r * n0 + i] * half[i * n1 + s];
        out[(r * t->count[1] + s) * 3 + k] = sum;
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

/* Where the sign changes across a side of the span pair: of G, which is then what is to be semidefinite, also on the
 * line itself. The Bernstein coefficients on a point are all the value there. */
static void make_place(const function_space *space, const uint32_t span[2], const double place[2], place_tables *t) {
  bool divided = false;
  for (int side = 0; side < 4 && space->opposite; side++)
    divided = divided || line_at(space, span, side / 2, side % 2);
  for (int i = 0; i < 2 && !divided; i++) {
    const bspline *b = &space->spline.axis[i];
    size_t mu = space->span[i][span[i]];
    t->first[i] = mu - b->degree;
    bspline_basis(b, mu, place[i], 2, t->basis[i]);
  }
  if (!divided) return;
  function_box box = {.span = {span[0], span[1]}, .lower = {place[0], place[1]}, .upper = {place[0], place[1]}};
  box_tables tables;
  make_divided_tables(space, &box, &tables);
  for (int i = 0; i < 2; i++) {
    size_t order = space->spline.axis[i].degree + 1;
    t->first[i] = tables.first[i];
    for (size_t k = 0; k < 3; k++)
      for (size_t j = 0; j < order; j++)
        t->basis[i][k * order + j] = tables.count[i] > 0 ? tables.rows[i][k * order * order + j] : 0;
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

void function_eigen(const double h[3], double values[2], double *angle) {
  double mean = (h[0] + h[2]) / 2, off = (h[0] - h[2]) / 2, radius = hypot(off, h[1]);
  values[0] = mean + radius;
  values[1] = mean - radius;
  if (angle) *angle = radius > 0 ? atan2(h[1], off) / 2 : 0;
}

/* The blossom of t^2 is the mean of products of pairs. */
void function_bowl(const function_space *space, double *out) {
  const bspline *b = space->spline.axis;
  for (size_t k = 0; k < space->n; k++) {
    size_t at[2] = {k / b[1].count, k % b[1].count};
    out[k] = 0;
    for (int i = 0; i < 2; i++) {
      const double *knots = b[i].knots + at[i] + 1;
      double sum = 0;
      unsigned d = b[i].degree;
      for (unsigned p = 0; p < d; p++)
        for (unsigned q = p + 1; q < d; q++) sum += knots[p] * knots[q];
      out[k] += sum / (d * (d - 1)); /* half of the mean over d (d - 1) / 2 pairs */
    }
  }
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

/* The direction of an angle; along an axis exactly: the rounding of cos(pi / 2) is no inequality, but where the rest
 * of a row vanishes it would be scaled up to one. */
static void direction(double angle, double z[2]) {
  z[0] = cos(angle);
  z[1] = sin(angle);
  for (int k = 0; k < 2; k++)
    if (fabs(z[k]) < 1e-15) z[k] = 0;
}

/* Ends the row whose `used` entries have been written behind the others: to length 1, nothing when that is 0. */
static void finish_row(function_matrix *rows, size_t used, double lower, double upper) {
  size_t begin = rows->starts[rows->rows];
  double square = 0;
  for (size_t k = begin; k < begin + used; k++) square += rows->values[k] * rows->values[k];
  if (!(square > 0)) return;
  double scale = 1 / sqrt(square);
  for (size_t k = begin; k < begin + used; k++) rows->values[k] *= scale;
  rows->lower[rows->rows] = lower * scale;
  rows->upper[rows->rows++] = upper * scale;
  rows->starts[rows->rows] = begin + used;
}

/* part[0] u_2 (x) v_0 + part[1] u_1 (x) v_1 + part[2] u_0 (x) v_2 of rows u [3] and v [3] of one variable. */
static void append_row(const function_space *space, const size_t first[2], const double *const *u,
                       const double *const *v, const double part[3], double lower, double upper,
                       function_matrix *rows) {
  size_t n0 = space->spline.axis[0].degree + 1, n1 = space->spline.axis[1].degree + 1;
  size_t stride = space->spline.axis[1].count, begin = rows->starts[rows->rows], used = 0;
  for (size_t i = 0; i < n0; i++)
    for (size_t j = 0; j < n1; j++) {
      double value = part[0] * u[2][i] * v[0][j] + part[1] * u[1][i] * v[1][j] + part[2] * u[0][i] * v[2][j];
      if (value == 0) continue;
      rows->indices[begin + used] = (uint32_t)((first[0] + i) * stride + first[1] + j);
      rows->values[begin + used++] = value;
    }
  finish_row(rows, used, lower, upper);
}

batten_status function_rows_box(batten_context *ctx, const function_space *space, const function_box *box,
                                const function_directions *opt, const double *reference, const double *other,
                                double scale, function_matrix *rows) {
  size_t n0 = space->spline.axis[0].degree + 1, n1 = space->spline.axis[1].degree + 1, points = n0 * n1;
  double sign = function_sign(space, box->span), h[2][3 * FUNCTION_TABLE];
  box_tables t;
  batten_status st = function_matrix_reserve(ctx, rows, points * DIRECTIONS_MAX, points * points * DIRECTIONS_MAX);
  if (st < 0) return st;
  make_divided_tables(space, box, &t);
  apply_tables(space, &t, reference, h[0]);
  if (other) apply_tables(space, &t, other, h[1]);
  for (int which = 0; which < (other ? 2 : 1); which++)
    for (size_t k = 0; k < 3 * t.count[0] * t.count[1]; k++) h[which][k] *= sign;
  for (size_t r = 0; r < t.count[0]; r++)
    for (size_t s = 0; s < t.count[1]; s++) {
      double angles[DIRECTIONS_MAX];
      const double *u[3], *v[3];
      for (size_t k = 0; k < 3; k++) {
        u[k] = t.rows[0] + (k * n0 + r) * n0;
        v[k] = t.rows[1] + (k * n1 + s) * n1;
      }
      size_t at = 3 * (r * t.count[1] + s);
      unsigned count = choose_directions(opt, h[0] + at, other ? h[1] + at : NULL, scale, angles);
      for (unsigned a = 0; a < count; a++) {
        bool last = a + 1 == count;
        double from = angles[a], to = last ? angles[0] + half_turn : angles[a + 1];
        double z[2][2];
        direction(from, z[0]);
        direction(to, z[1]);
        double part[3] = {sign * z[0][0] * z[1][0], sign * (z[0][0] * z[1][1] + z[0][1] * z[1][0]),
                          sign * z[0][1] * z[1][1]};
        append_row(space, t.first, u, v, part, opt->margin * cos(to - from), INFINITY, rows);
      }
    }
  return BATTEN_OK;
}

/* ---- necessary inequalities ---------------------------------------------------------------------- */

static void append_cut(const function_space *space, const uint32_t span[2], const double place[2], const double z[2],
                       function_matrix *cuts) {
  place_tables t;
  double sign = function_sign(space, span),
         part[3] = {sign * z[0] * z[0], 2 * sign * z[0] * z[1], sign * z[1] * z[1]};
  const double *u[3], *v[3];
  make_place(space, span, place, &t);
  for (size_t k = 0; k < 3; k++) {
    u[k] = t.basis[0] + k * (space->spline.axis[0].degree + 1);
    v[k] = t.basis[1] + k * (space->spline.axis[1].degree + 1);
  }
  append_row(space, t.first, u, v, part, 0, INFINITY, cuts);
}

/* Where the sign changes across the upper side of a span pair in direction `axis`. Coefficients along the line that
 * the pair before, if it has this line, too, shares by continuity are left out. */
static void append_equalities(const function_space *space, const uint32_t span[2], int axis, function_matrix *rows) {
  int along = 1 - axis;
  const bspline *b[2] = {&space->spline.axis[0], &space->spline.axis[1]};
  uint32_t before[2] = {span[0], span[1]};
  bool goes_on = span[along] > 0;
  if (goes_on) before[along]--;
  goes_on = goes_on && line_at(space, before, axis, 1);
  double natural[2][3][FUNCTION_TABLE];
  size_t mu[2], first[2];
  for (int i = 0; i < 2; i++) {
    mu[i] = space->span[i][span[i]];
    first[i] = mu[i] - b[i]->degree;
    for (unsigned k = 0; k < 3; k++)
      bspline_rows(b[i], mu[i], k, b[i]->knots[mu[i]], b[i]->knots[mu[i] + 1], natural[i][k]);
  }
  for (unsigned k = 0; k < (space->smoothness[axis] >= 2 ? 3u : 2u); k++) { /* k across, 2 - k along */
    size_t skip = goes_on ? space->smoothness[along] - 1 + k : 0, order[2] = {b[0]->degree + 1, b[1]->degree + 1};
    for (size_t s = skip; s < order[along] - 2 + k; s++) {
      const double *u[2][3];
      double part[3] = {0};
      for (unsigned l = 0; l < 3; l++) {
        u[axis][l] = natural[axis][k] + (order[axis] - 1 - k) * order[axis];
        u[along][l] = natural[along][2 - k] + s * order[along];
      }
      part[axis == 0 ? 2 - k : k] = 1;
      append_row(space, first, u[0], u[1], part, 0, 0, rows);
    }
  }
}

batten_status function_equalities(batten_context *ctx, const function_space *space, function_matrix *rows) {
  size_t points = (space->spline.axis[0].degree + 1) * (size_t)(space->spline.axis[1].degree + 1);
  for (uint32_t i = 0; i < space->spans[0]; i++)
    for (uint32_t j = 0; j < space->spans[1]; j++)
      for (int axis = 0; axis < 2; axis++) {
        uint32_t span[2] = {i, j};
        if (!line_at(space, span, axis, 1)) continue;
        batten_status st = function_matrix_reserve(ctx, rows, 3 * FUNCTION_ORDER, 3 * FUNCTION_ORDER * points);
        if (st < 0) return st;
        append_equalities(space, span, axis, rows);
      }
  return BATTEN_OK;
}

/* The least signed eigenvalue at a place, and its direction. */
static double least_at(const function_space *space, const uint32_t span[2], const double place[2], const double *x,
                       double z[2]) {
  double h[3], values[2], angle, sign = function_sign(space, span);
  place_tables t;
  make_place(space, span, place, &t);
  place_hessian(space, &t, x, h);
  for (int k = 0; k < 3; k++) h[k] *= sign;
  function_eigen(h, values, &angle);
  direction(angle + half_turn / 2, z);
  return values[1];
}

/* From a place to a nearby one that is worse, by steps that are halved. */
static double descend(const function_space *space, const uint32_t span[2], const double *lower, const double *upper,
                      const double *x, double place[2], double z[2]) {
  double best = least_at(space, span, place, x, z), step = 0.125;
  for (int halvings = 0; halvings < 7; step /= 2, halvings++)
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

enum { CUT_GRID = 2 * (FUNCTION_ORDER - 1) };

/* Whether none of the places around this one of a grid is worse; of equal ones the first counts. */
static bool is_lowest(const unsigned grid[2], const double *values, size_t a, size_t b) {
  double here = values[a * (CUT_GRID + 1) + b];
  for (size_t i = a > 0 ? a - 1 : 0; i <= a + 1 && i <= grid[0]; i++)
    for (size_t j = b > 0 ? b - 1 : 0; j <= b + 1 && j <= grid[1]; j++) {
      double there = values[i * (CUT_GRID + 1) + j];
      if (there < here || (there == here && (i < a || (i == a && j < b)))) return false;
    }
  return true;
}

/* Cuts of one span pair, from where the lowest places of a grid descend to. The grid is closer at the ends, where
 * polynomials turn the fastest: with equal steps of that number valleys along the sides are not seen. */
static double cut_span(const function_space *space, const uint32_t span[2], const double *x, double tolerance,
                       function_matrix *cuts) {
  unsigned grid[2];
  double at[2][CUT_GRID + 1], lower[2], upper[2], worst = 0, values[(CUT_GRID + 1) * (CUT_GRID + 1)], z[2];
  for (int i = 0; i < 2; i++) {
    const double *knots = space->spline.axis[i].knots + space->span[i][span[i]];
    lower[i] = knots[0];
    upper[i] = knots[1];
    grid[i] = 2 * space->spline.axis[i].degree;
    for (unsigned k = 0; k <= grid[i]; k++) {
      double part = (1 - cos(half_turn * k / grid[i])) / 2;
      at[i][k] = (1 - part) * lower[i] + part * upper[i];
    }
  }
  for (int pass = 0; pass < 2; pass++)
    for (unsigned a = 0; a <= grid[0]; a++)
      for (unsigned b = 0; b <= grid[1]; b++) {
        double place[2] = {at[0][a], at[1][b]};
        if (pass == 0) {
          values[a * (CUT_GRID + 1) + b] = least_at(space, span, place, x, z);
        } else if (is_lowest(grid, values, a, b)) {
          double near = descend(space, span, lower, upper, x, place, z);
          worst = fmin(worst, near);
          if (near < -tolerance) append_cut(space, span, place, z, cuts);
        }
      }
  return worst;
}

batten_status function_cuts(batten_context *ctx, const function_space *space, const double *x, double tolerance,
                            const function_place *also, function_matrix *cuts, double *worst) {
  size_t points = (space->spline.axis[0].degree + 1) * (size_t)(space->spline.axis[1].degree + 1);
  size_t most = (CUT_GRID + 1) * (CUT_GRID + 1) + 1;
  *worst = 0;
  for (size_t s = 0; s < space->spans[0] * space->spans[1]; s++) {
    uint32_t span[2] = {(uint32_t)(s / space->spans[1]), (uint32_t)(s % space->spans[1])};
    if (function_sign(space, span) == 0) continue;
    batten_status st = function_matrix_reserve(ctx, cuts, most, most * points);
    if (st < 0) return st;
    *worst = fmin(*worst, cut_span(space, span, x, tolerance, cuts));
    if (!also || also->span[0] != span[0] || also->span[1] != span[1]) continue;
    double z[2], value = least_at(space, span, also->at, x, z);
    *worst = fmin(*worst, value);
    if (value < -tolerance) append_cut(space, span, also->at, z, cuts);
  }
  return BATTEN_OK;
}
