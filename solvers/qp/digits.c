/* Digits below the rounding of x and y. At a solution of size 1e6 and more, rounding each number to the nearest
 * double leaves residuals and a gap above 1e-9, though other doubles next to them fit better: sums can be met more
 * closely than their terms. Three steps, each kept only if the judge finds the largest residual smaller:
 *
 *   dual residual  one multiplier after the other goes to the neighbouring double if that lessens sum r_j^4
 *   gap            the multiplier whose side is largest against its row takes gap / side
 *   gap            x moves along the gradient of x'Px + q'x, by gap / length: tiny when there are many unknowns */
#include <float.h>
#include <string.h>

#include "certify.h"
#include "driver.h"
#include "matrix_row.h"

typedef struct digits {
  const batten_qp_problem *p;
  const batten_qp_options *o;
  size_t n, m;
  double *x, *y;    /* [n], [m + n] */
  double *residual; /* [2 n] the judge leaves the dual residual here, as the sum of two */
  double *step;     /* [n] */
  batten_qp_info *info;
} digits;

static double allowed(const batten_qp_options *o, double scale) {
  return o->tolerance_absolute + o->tolerance_relative * scale;
}
static double allowed_gap(const digits *d) { return allowed(d->o, d->info->gap_scale); }
static double allowed_dual(const digits *d) { return allowed(d->o, d->info->dual_scale); }

static double merit(const batten_qp_info *f, const batten_qp_options *o) {
  double primal = f->primal_residual / allowed(o, f->primal_scale),
         dual = f->dual_residual / allowed(o, f->dual_scale);
  return fmax(fmax(primal, dual), f->duality_gap / allowed(o, f->gap_scale));
}

/* Whether x and y are better than what info says, which they then are. */
static bool better(digits *d) {
  batten_qp_info trial = *d->info;
  qp_certify_residuals(d->p, d->x, d->y, d->residual, &trial);
  if (!(merit(&trial, d->o) < merit(d->info, d->o))) return false;
  *d->info = trial;
  return true;
}

/* ---- Dual residual ---- */

static double fourth(double v) { return v * v * v * v; }

/* Change of sum (r_j / unit)^4 when y_i grows by step. */
static double change(const qp_matrix_row *row, const double *r, double step, double unit) {
  double sum = 0;
  for (size_t e = 0; e < row->count; e++) {
    double before = r[qp_row_column(row, e)];
    sum += fourth((before - step * row->values[e]) / unit) - fourth(before / unit);
  }
  return sum;
}

static bool move_row(digits *d, size_t i, double *r, double unit) {
  qp_matrix_row row = qp_row_of(d->p->c, i);
  double y = d->y[i], spacing = nextafter(fabs(y), INFINITY) - fabs(y);
  for (int sign = -1; sign <= 1; sign += 2) {
    if (!(change(&row, r, sign * spacing, unit) < 0)) continue;
    d->y[i] = y + sign * spacing;
    for (size_t e = 0; e < row.count; e++) r[qp_row_column(&row, e)] -= sign * spacing * row.values[e];
    return true;
  }
  return false;
}

static void round_multipliers(digits *d) {
  enum { SWEEPS = 20 };
  double *r = d->residual, unit = allowed_dual(d);
  for (size_t j = 0; j < d->n; j++) r[j] += r[d->n + j];
  bool moved = true;
  for (int sweep = 0; moved && sweep < SWEEPS; sweep++) {
    moved = false;
    for (size_t i = 0; i < d->m; i++)
      if (d->y[i] != 0) moved |= move_row(d, i, r, unit);
    for (size_t j = 0; j < d->n; j++) {
      double *y = &d->y[d->m + j], next = *y + r[j];
      if (*y == 0 || next * *y <= 0) continue;
      r[j] -= next - *y;
      *y = next;
    }
  }
}

/* ---- Gap ---- */

static double side_of(const digits *d, size_t k) {
  const batten_qp_problem *p = d->p;
  bool low = d->y[k] > 0;
  if (k < d->m) return low ? (p->lower ? p->lower[k] : -INFINITY) : p->upper ? p->upper[k] : INFINITY;
  return low ? (p->x_lower ? p->x_lower[k - d->m] : -INFINITY) : p->x_upper ? p->x_upper[k - d->m] : INFINITY;
}

static bool is_equality(const digits *d, size_t k) {
  const batten_qp_problem *p = d->p;
  if (k < d->m) return p->lower && p->upper && p->lower[k] == p->upper[k];
  return p->x_lower && p->x_upper && p->x_lower[k - d->m] == p->x_upper[k - d->m];
}

static double row_size(const digits *d, size_t k) {
  double largest = 0;
  if (k >= d->m) return 1;
  qp_matrix_row row = qp_row_of(d->p->c, k);
  for (size_t e = 0; e < row.count; e++) largest = fmax(largest, fabs(row.values[e]));
  return largest;
}

/* The multiplier that closes the gap with the least change of the dual residual, next after one whose quotient of
 * side and row was `below`: it keeps its sign and is spaced finely enough to meet the gap. m + n: none. */
static size_t closer(const digits *d, double *below) {
  size_t best = d->m + d->n;
  double most = 0;
  for (size_t k = 0; k < d->m + d->n; k++) {
    double y = fabs(d->y[k]), side = fabs(side_of(d, k));
    if (y == 0 || !isfinite(side) || DBL_EPSILON * y * side > 0.5 * allowed_gap(d)) continue;
    if (!is_equality(d, k) && d->info->duality_gap > 0.5 * y * side) continue;
    double quotient = side / row_size(d, k);
    if (!(quotient > most && quotient < *below)) continue;
    most = quotient;
    best = k;
  }
  *below = most;
  return best;
}

static void close_by_multipliers(digits *d) {
  enum { TRIES = 4 };
  double below = INFINITY;
  for (int attempt = 0; attempt < TRIES && d->info->duality_gap > allowed_gap(d); attempt++) {
    size_t k = closer(d, &below);
    if (k == d->m + d->n) return;
    double y = d->y[k], step = d->info->duality_gap / side_of(d, k);
    d->y[k] = y + step; /* which objective is the larger is not in info */
    if (better(d)) continue;
    d->y[k] = y - step;
    if (better(d)) continue;
    d->y[k] = y;
  }
}

/* The gradient of x'Px + q'x, of unknowns away from their bounds, and its squared length. */
static double gap_gradient(digits *d) {
  const batten_qp_problem *p = d->p;
  batten_qp_info unused;
  double square = 0;
  memset(d->step, 0, d->n * sizeof *d->step);
  qp_certify_residuals(p, d->step, NULL, d->residual, &unused);
  for (size_t j = 0; j < d->n; j++) d->step[j] = -d->residual[j];
  qp_certify_residuals(p, d->x, NULL, d->residual, &unused);
  for (size_t j = 0; j < d->n; j++) {
    bool at_bound = (p->x_lower && d->x[j] <= p->x_lower[j]) || (p->x_upper && d->x[j] >= p->x_upper[j]);
    d->step[j] = at_bound ? 0 : d->step[j] + 2 * d->residual[j];
    square += d->step[j] * d->step[j];
  }
  return square;
}

/* x += t step */
static void move(digits *d, double t) {
  for (size_t j = 0; j < d->n; j++) d->x[j] += t * d->step[j];
}

static void close_by_x(digits *d) {
  enum { TRIES = 3 };
  for (int attempt = 0; attempt < TRIES && d->info->duality_gap > allowed_gap(d); attempt++) {
    double square = gap_gradient(d), t = d->info->duality_gap / square;
    if (!(square > 0) || !isfinite(t)) return;
    move(d, t);
    if (better(d)) continue;
    move(d, -2 * t);
    if (better(d)) continue;
    move(d, t);
    return;
  }
}

/* ---- All ---- */

void qp_last_digits(const batten_qp_problem *problem, const batten_qp_options *o, double *x, double *y, double *work,
                    batten_qp_info *info) {
  size_t n = problem->n;
  digits d = {problem, o, n, qp_problem_rows(problem), x, y, work, work + 2 * n, info};
  qp_certify_residuals(problem, x, y, d.residual, info);
  if (info->dual_residual > allowed_dual(&d)) {
    round_multipliers(&d);
    qp_certify_residuals(problem, x, y, d.residual, info);
  }
  if (info->dual_residual > allowed_dual(&d)) return; /* not of rounding */
  close_by_multipliers(&d);
  close_by_x(&d);
}
