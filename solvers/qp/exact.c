/* Feasibility that is exact. See exact.h.
 *
 * A row c'x of k products that are not zero, added up in any order, is within gamma_k sum|c_j x_j| of its exact
 * value, gamma_k = k u / (1 - k u) [Higham, Accuracy and Stability, 3.1]; within gamma_{k-1} of that where no product
 * is rounded, as all c_j are powers of two. So an exact slack of that much, at the x that is returned, proves the row
 * for everybody. Where no more than one operation rounds, it rounds monotonely, and a slack of zero will do. Slacks
 * are found by a plain sum with its own rounding allowed for, or if that does not settle it, to twice the precision.
 *
 * Bounds of x need no sum: x is clipped to them. Rows are cured by x + e (z - x), z strictly feasible: e follows from
 * the rows that fail at x, since slack is linear and the bound convex in e. It is then verified on the rounded
 * result.
 *
 * A z near x is as good as a deep one: with z the projection of x on the rows moved inwards by t, |z - x| / t does
 * not fall with t (it is convex in t and 0 at 0), and e is about (rounding / t). So the first t is small, and smaller
 * ones follow when the inside is narrow. */
#include "exact.h"

#include <float.h>

#include "base/checked.h"

static const double UNIT_ROUNDOFF = 0.5 * DBL_EPSILON;

/* Entries of row i of the caller's matrix; columns NULL where it is dense. */
static size_t row_entries(const batten_matrix *c, size_t i, const double **values, const uint32_t **columns) {
  *columns = c->dense ? NULL : c->indices + c->starts[i];
  *values = c->dense ? c->dense + i * c->columns : c->values + c->starts[i];
  return c->dense ? c->columns : c->starts[i + 1] - c->starts[i];
}

/* ---- plain sums --------------------------------------------------------------------------------------------- */

typedef struct plain_row {
  double sum, size; /* of c_j x_j, of |c_j x_j| */
  size_t count;
} plain_row;

static plain_row row_plain(const batten_matrix *c, size_t i, const double *x) {
  const double *values;
  const uint32_t *columns;
  size_t count = row_entries(c, i, &values, &columns), e = 0;
  double sum[2] = {0}, size[2] = {0}; /* two of each: the loop over all rows is where the time goes */
  for (; !columns && e + 2 <= count; e += 2) {
    double p = values[e] * x[e], q = values[e + 1] * x[e + 1];
    sum[0] += p, sum[1] += q;
    size[0] += fabs(p), size[1] += fabs(q);
  }
  for (; e < count; e++) {
    double p = values[e] * x[columns ? columns[e] : e];
    sum[0] += p;
    size[0] += fabs(p);
  }
  return (plain_row){sum[0] + sum[1], size[0] + size[1], count};
}

/* Twice gamma_k sum|c_j x_j| (ours, and anybody's), the rounding of that and of the slack, and underflow. */
static double plain_rounding(const plain_row *v) {
  double k = (double)v->count;
  return (2 * k + 8) * UNIT_ROUNDOFF * v->size + 2 * k * DBL_TRUE_MIN;
}

static bool plain_holds(const plain_row *v, double side, double sign) {
  return isinf(side) || sign * (v->sum - side) >= plain_rounding(v);
}

/* ---- twice the precision ------------------------------------------------------------------------------------ */

typedef struct row_value {
  double high, low; /* c'x = high + low */
  double size;      /* sum |c_j x_j| */
  double needed;    /* slack that proves the row */
} row_value;

static void add_exactly(row_value *v, double term) {
  double sum = v->high + term, part = sum - v->high;
  v->low += (v->high - (sum - part)) + (term - part);
  v->high = sum;
}

static bool is_power_of_two(double c) {
  int exponent;
  return fabs(frexp(c, &exponent)) == 0.5;
}

static row_value row_at(const batten_matrix *c, size_t i, const double *x) {
  const double *values;
  const uint32_t *columns;
  size_t count = row_entries(c, i, &values, &columns), terms = 0;
  row_value v = {0};
  bool rounded = false; /* some product is */
  for (size_t e = 0; e < count; e++) {
    double a = values[e], b = x[columns ? columns[e] : e], p = a * b;
    if (a == 0 || b == 0) continue;
    add_exactly(&v, p);
    v.low += fma(a, b, -p);
    v.size += fabs(p);
    terms++;
    rounded = rounded || !is_power_of_two(a) || fabs(p) < DBL_MIN;
  }
  double roundings = (double)terms - (rounded ? 0 : 1);
  if (roundings > 1) v.needed = (roundings + 2) * UNIT_ROUNDOFF * v.size;
  if (rounded && v.size < 0x1p-900) v.needed += 2 * (double)terms * DBL_TRUE_MIN; /* fma() may have lost a part */
  return v;
}

static double slack_of(const row_value *v, double side, double sign) {
  row_value w = *v;
  add_exactly(&w, -side);
  return sign * (w.high + w.low);
}

static bool side_holds(const row_value *v, double side, double sign) {
  return isinf(side) || slack_of(v, side, sign) >= v->needed;
}

/* ---- all rows ----------------------------------------------------------------------------------------------- */

/* What exactness is asked of: everything but equalities. */
typedef struct asked {
  const batten_qp_problem *problem;
  size_t m;
} asked;

static double lower_of(const asked *a, size_t i) { return a->problem->lower ? a->problem->lower[i] : -INFINITY; }
static double upper_of(const asked *a, size_t i) { return a->problem->upper ? a->problem->upper[i] : INFINITY; }

static bool row_holds(const asked *a, size_t i, const double *x) {
  double lower = lower_of(a, i), upper = upper_of(a, i);
  if (lower == upper) return true;
  plain_row plain = row_plain(a->problem->c, i, x);
  if (plain_holds(&plain, lower, 1) && plain_holds(&plain, upper, -1)) return true;
  row_value v = row_at(a->problem->c, i, x);
  return side_holds(&v, lower, 1) && side_holds(&v, upper, -1);
}

/* First row from `from` on that is not proven at x, or m. */
static size_t next_failing(const asked *a, size_t from, const double *x) {
  while (from < a->m && row_holds(a, from, x)) from++;
  return from;
}

/* First equality that z misses by more than this part of its terms, or m: z is then no point of the set at all. */
static size_t next_unequal(const asked *a, const double *z) {
  const double PART = 1e-9;
  size_t i = 0;
  for (; i < a->m; i++) {
    if (lower_of(a, i) != upper_of(a, i)) continue;
    plain_row v = row_plain(a->problem->c, i, z);
    if (!(fabs(v.sum - lower_of(a, i)) <= PART * fmax(v.size, fabs(lower_of(a, i))))) break;
  }
  return i;
}

static void clip(const batten_qp_problem *p, double *x) {
  for (size_t j = 0; j < p->n; j++) {
    if (p->x_lower && x[j] < p->x_lower[j]) x[j] = p->x_lower[j];
    if (p->x_upper && x[j] > p->x_upper[j]) x[j] = p->x_upper[j];
  }
}

/* x + e (z - x) within the bounds. */
static void blend_to(const batten_qp_problem *p, const double *x, const double *z, double e, double *out) {
  for (size_t j = 0; j < p->n; j++) out[j] = e < 1 ? x[j] + e * (z[j] - x[j]) : z[j];
  clip(p, out);
}

/* Smallest e for one side of a failing row: slack less what is needed, linear between its values at x and z. Rounding
 * of the blended point takes a little more; seldom as much as allowed here. */
static double side_fraction(const row_value *at_x, const row_value *at_z, double side, double sign) {
  const double BLENDED = UNIT_ROUNDOFF;
  if (isinf(side)) return 0;
  double short_of = at_x->needed + BLENDED * at_x->size - slack_of(at_x, side, sign);
  double beyond = slack_of(at_z, side, sign) - at_z->needed - BLENDED * at_z->size;
  if (!(short_of > 0)) return 0;
  return beyond > 0 ? short_of / (short_of + beyond) : 1;
}

/* The smallest e, up to a small factor, at which the blend of x and z is proven, and the blend itself in out. z is
 * proven. */
static double smallest_blend(const asked *a, const double *x, const double *z, double *out) {
  const double MORE = 1.25; /* what is left to verify is rounding in e itself: once is nearly always enough */
  double e = 0;
  for (size_t i = next_failing(a, 0, x); i < a->m; i = next_failing(a, i + 1, x)) {
    row_value at_x = row_at(a->problem->c, i, x), at_z = row_at(a->problem->c, i, z);
    e = fmax(e, side_fraction(&at_x, &at_z, lower_of(a, i), 1));
    e = fmax(e, side_fraction(&at_x, &at_z, upper_of(a, i), -1));
  }
  for (e = fmin(fmax(e, DBL_MIN), 1);; e = fmin(e * MORE, 1)) {
    blend_to(a->problem, x, z, e, out);
    if (e >= 1 || next_failing(a, 0, out) == a->m) return e;
  }
}

/* ---- a strictly feasible point ------------------------------------------------------------------------------ */

/* Scratch of the projection; one of the two engines is used. */
typedef struct finder {
  batten_context *ctx;
  const qp_rows *rows;
  const qp_limits *limits;
  bool dense;
  double *lower, *upper, *size; /* [m] the moved sides; sum |a_kj x_j| */
  double *y, *ray, *r, *g;      /* [m], [n]; dense: r [n][n]; sparse: g [n] and the unit matrix */
  signed char *active;
  size_t *starts;
  double *ones;
} finder;

static void finder_free(finder *f) {
  void *const blocks[] = {f->lower, f->upper, f->size, f->y, f->ray, f->r, f->g, f->active, f->starts, f->ones};
  for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) batten_free(f->ctx, blocks[i]);
}

static batten_matrix unit_matrix(const finder *f) {
  size_t n = f->rows->n;
  return batten_matrix_sparse(n, n, f->starts, f->rows->identity, f->ones);
}

/* Few unknowns: dual. Else whichever costs less. */
static batten_status choose_engine(finder *f) {
  const size_t FEW = 200;
  size_t n = f->rows->n;
  f->dense = true;
  if (n <= FEW) return BATTEN_OK;
  f->starts = batten_alloc_array(f->ctx, n + 1, sizeof *f->starts);
  f->ones = batten_alloc_array(f->ctx, n, sizeof *f->ones);
  if (!f->starts || !f->ones) return BATTEN_E_NOMEM;
  for (size_t j = 0; j <= n; j++) f->starts[j] = j;
  for (size_t j = 0; j < n; j++) f->ones[j] = 1;
  batten_matrix unit = unit_matrix(f);
  qp_cost dense = qp_dual_cost(f->rows), sparse;
  batten_status st = qp_interior_cost(f->ctx, &unit, f->rows, &sparse);
  f->dense = dense.flops <= sparse.flops;
  return st;
}

static batten_status finder_new(finder *f) {
  size_t n = f->rows->n, m = f->rows->m, square;
  batten_status st = choose_engine(f);
  if (st < 0) return st;
  if (!batten_mul(n, n, &square)) return batten_fail(f->ctx, BATTEN_E_TOO_LARGE, "n = %zu", n);
  f->lower = batten_alloc_array(f->ctx, m, sizeof *f->lower);
  f->upper = batten_alloc_array(f->ctx, m, sizeof *f->upper);
  f->size = batten_alloc_array(f->ctx, m, sizeof *f->size);
  f->y = batten_alloc_array(f->ctx, m, sizeof *f->y);
  f->active = batten_alloc_array(f->ctx, m, sizeof *f->active);
  f->ray = batten_alloc_array(f->ctx, n, sizeof *f->ray);
  f->g = batten_alloc_array(f->ctx, n, sizeof *f->g);
  f->r = batten_alloc_array(f->ctx, f->dense ? square : 0, sizeof *f->r);
  if (!f->lower || !f->upper || !f->size || !f->y || !f->active || !f->ray || !f->g || !f->r) return BATTEN_E_NOMEM;
  if (!f->dense) return BATTEN_OK;
  for (size_t i = 0; i < square; i++) f->r[i] = 0;
  for (size_t j = 0; j < n; j++) f->r[j * n + j] = 1;
  return BATTEN_OK;
}

static void measure(finder *f, const double *x) {
  for (size_t k = 0; k < f->rows->m; k++) {
    const double *values;
    const uint32_t *columns;
    size_t count = qp_rows_entries(f->rows, k, &values, &columns);
    double size = 0;
    for (size_t e = 0; e < count; e++) size += fabs(values[e] * x[columns ? columns[e] : e]);
    f->size[k] = f->rows->scale[k] * size;
  }
}

/* Moves both sides of the inequalities inwards by `part` of the row's terms, which is what its rounding is measured
 * by, and a little of everything's size for rows whose terms vanish; at most to a quarter of a narrow row. */
static void move_inwards(finder *f, double part, double all) {
  const double LITTLE = 1e-3, NARROW = 0.25;
  for (size_t k = 0; k < f->rows->m; k++) {
    double lower = f->rows->lower[k], upper = f->rows->upper[k], sides = 0;
    if (isfinite(lower)) sides = fabs(lower);
    if (isfinite(upper)) sides = fmax(sides, fabs(upper));
    double t =
        lower == upper ? 0 : fmin(part * fmax(fmax(f->size[k], sides), LITTLE * all), NARROW * (upper - lower));
    f->lower[k] = lower + t;
    f->upper[k] = upper - t;
  }
}

/* z := projection of x on the moved rows. */
static batten_status project(finder *f, const double *x, double *z) {
  size_t n = f->rows->n, m = f->rows->m;
  qp_rows moved = *f->rows;
  moved.lower = f->lower;
  moved.upper = f->upper;
  qp_point point = {.x = z, .y = f->y, .active = f->active, .ray = f->ray};
  for (size_t k = 0; k < m; k++) f->active[k] = QP_FREE;
  for (size_t j = 0; j < n; j++) z[j] = x[j];
  if (f->dense) {
    qp_dense distance = {.n = n, .r = f->r, .target = x};
    return qp_dual(f->ctx, &distance, &moved, f->limits, &point);
  }
  for (size_t j = 0; j < n; j++) f->g[j] = -x[j];
  batten_matrix unit = unit_matrix(f);
  qp_sparse distance = {.n = n, .h = &unit, .g = f->g};
  return qp_interior(f->ctx, &distance, &moved, f->limits, &point);
}

/* Leaves a strictly feasible point in z: BATTEN_OK, or W_ACCURACY if there is none to be found. */
static batten_status find_interior(batten_context *ctx, const asked *a, const qp_rows *rows, const qp_limits *limits,
                                   const double *x, double *z) {
  static const double parts[] = {1e-4, 1e-6, 1e-8, 1e-10, 1e-12};
  finder f = {.ctx = ctx, .rows = rows, .limits = limits};
  batten_status st = finder_new(&f);
  if (st < 0) goto done;
  double all = 0;
  for (size_t j = 0; j < rows->n; j++) all = fmax(all, fabs(x[j]));
  measure(&f, x);
  for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
    move_inwards(&f, parts[i], all > 0 ? all : 1);
    st = project(&f, x, z);
    if (st == BATTEN_E_NOMEM || st == BATTEN_E_CANCELLED) goto done;
    clip(a->problem, z);
    if (st >= 0 && next_failing(a, 0, z) == a->m && next_unequal(a, z) == a->m) {
      st = BATTEN_OK;
      goto done;
    }
    if (st == BATTEN_E_LIMIT) break;
  }
  st = st == BATTEN_E_LIMIT
           ? batten_fail(ctx, BATTEN_W_ACCURACY,
                         "options.exact: a limit was met while looking for a strictly feasible point; give one in "
                         "options.interior or raise the limit")
           : batten_fail(
                 ctx, BATTEN_W_ACCURACY,
                 "options.exact: no strictly feasible point was found, so the inside may be empty; state rows that "
                 "hold as equalities by lower = upper, or give options.interior");
done:
  finder_free(&f);
  return st;
}

/* ---- the call ----------------------------------------------------------------------------------------------- */

/* The caller's own point, checked. */
static batten_status take_interior(batten_context *ctx, const asked *a, const double *interior, double *z) {
  for (size_t j = 0; j < a->problem->n; j++) z[j] = interior[j];
  clip(a->problem, z);
  for (size_t j = 0; j < a->problem->n; j++)
    if (z[j] != interior[j])
      return batten_fail(
          ctx, BATTEN_W_ACCURACY,
          "options.interior[%zu]: %g is beyond the bound %g; give a strictly feasible point, or NULL to have "
          "one found",
          j, interior[j], z[j]);
  size_t bad = next_failing(a, 0, z);
  if (bad == a->m) bad = next_unequal(a, z);
  if (bad == a->m) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_W_ACCURACY,
                     "options.interior: row %zu is %g there, not strictly within [%g, %g]; give a strictly feasible "
                     "point, or NULL to have one found",
                     bad, row_plain(a->problem->c, bad, z).sum, lower_of(a, bad), upper_of(a, bad));
}

static bool is_interior(const asked *a, const double *x0, double *z) {
  for (size_t j = 0; j < a->problem->n; j++) z[j] = x0[j];
  clip(a->problem, z);
  return next_failing(a, 0, z) == a->m && next_unequal(a, z) == a->m;
}

static double distance(size_t n, const double *x, const double *z) {
  double square = 0;
  for (size_t j = 0; j < n; j++) square += (x[j] - z[j]) * (x[j] - z[j]);
  return sqrt(square);
}

/* x0 where it is inside and not too near the rows, else a point that is found, else what x0 gives. z, other: scratch.
 */
static batten_status own_blend(batten_context *ctx, const asked *a, const qp_rows *rows, const qp_limits *limits,
                               const double *x0, const double *x, double *z, double *other, double *out,
                               double *blend) {
  const double NEAR = 1e-6;
  size_t n = a->problem->n;
  bool started = x0 && is_interior(a, x0, z);
  if (started) *blend = smallest_blend(a, x, z, out);
  if (started && *blend <= NEAR) return BATTEN_OK;
  batten_status st = find_interior(ctx, a, rows, limits, x, z);
  if (st != BATTEN_OK) return started && st == BATTEN_W_ACCURACY ? BATTEN_OK : st;
  double found = smallest_blend(a, x, z, other);
  if (started && distance(n, x, out) <= distance(n, x, other)) return BATTEN_OK;
  *blend = found;
  for (size_t j = 0; j < n; j++) out[j] = other[j];
  return BATTEN_OK;
}

batten_status qp_exact(batten_context *ctx, const batten_qp_problem *problem, const qp_rows *rows,
                       const qp_limits *limits, const double *interior, const double *x0, double *x, double *blend) {
  size_t n = problem->n;
  asked a = {.problem = problem, .m = problem->c ? problem->c->rows : 0};
  double fraction = 0;
  batten_status st = BATTEN_E_NOMEM;
  double *clipped = batten_alloc_array(ctx, n, sizeof *clipped), *z = batten_alloc_array(ctx, n, sizeof *z);
  double *out = batten_alloc_array(ctx, n, sizeof *out), *other = batten_alloc_array(ctx, n, sizeof *other);
  if (!clipped || !z || !out || !other) goto done;
  st = BATTEN_OK;
  for (size_t j = 0; j < n; j++) clipped[j] = x[j];
  clip(problem, clipped);
  if (next_failing(&a, 0, clipped) == a.m) {
    for (size_t j = 0; j < n; j++) out[j] = clipped[j];
  } else if (interior) {
    st = take_interior(ctx, &a, interior, z);
    if (st == BATTEN_OK) fraction = smallest_blend(&a, clipped, z, out);
  } else {
    st = own_blend(ctx, &a, rows, limits, x0, clipped, z, other, out, &fraction);
  }
  if (st != BATTEN_OK) goto done;
  for (size_t j = 0; j < n; j++) x[j] = out[j];
  *blend = fraction;
done:
  batten_free(ctx, clipped);
  batten_free(ctx, z);
  batten_free(ctx, out);
  batten_free(ctx, other);
  return st;
}
