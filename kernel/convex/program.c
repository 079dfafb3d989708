/* The quadratic program of a round.   [Juettler 1998, section 5]
 *
 * In the unknown d = control - free, from the minimum without inequalities: minimise d'H d / 2 subject to
 * C d >= lower - C free. So that minimum keeps all its digits, and where it satisfies the rows there is nothing to
 * solve. H = (N + w T) (x) I_3, scaled to a diagonal of about one.
 *
 * Of tens of thousands of rows some tens hold with equality, and most are never touched. So only the most violated
 * are handed to the solver; those that its answer violates most join them, until none is left: each solution is the
 * minimum over a larger set, the last one over all rows. What rounding leaves is taken away by moving towards the
 * reference, which satisfies every row strictly. */
#include "fit_inner.h"

#include "base/checked.h"

#include <string.h>

/* Rows have length 1, points size 1: violations below are left to settle(). */
static const double TOLERANCE = 1e-11;

enum { DUAL_UNKNOWNS = 600 };

batten_status convex_program_new(batten_context *ctx, const convex_space *space, convex_program *out) {
  size_t n = convex_points(space), unknowns = 3 * n, size;
  convex_program p = {.point = NULL};
  bool dense = bspline_span_count(&space->axis[0]) * bspline_span_count(&space->axis[1]) == 1;
  p.point = batten_alloc_array(ctx, unknowns, sizeof *p.point);
  bool all = p.point;
  if (dense) {
    batten_mul(unknowns, unknowns, &size);
    p.hessian = batten_alloc_array(ctx, size, sizeof *p.hessian);
    all = all && p.hessian;
  } else {
    size = 3; /* each control point meets those of degree steps either way */
    for (int k = 0; k < 2; k++) {
      size_t band = (2 * (size_t)space->axis[k].degree + 1) * space->axis[k].count;
      batten_mul(size, band, &size);
    }
    p.starts = batten_alloc_array(ctx, unknowns + 1, sizeof *p.starts);
    p.indices = batten_alloc_array(ctx, size, sizeof *p.indices);
    p.values = batten_alloc_array(ctx, size, sizeof *p.values);
    all = all && p.starts && p.indices && p.values;
  }
  batten_status st = all ? batten_qp_workspace_new(ctx, &p.workspace) : BATTEN_E_NOMEM;
  if (st < 0)
    convex_program_free(ctx, &p);
  else
    *out = p;
  return st;
}

void convex_program_free(batten_context *ctx, convex_program *p) {
  batten_qp_workspace_free(p->workspace);
  batten_free(ctx, p->values);
  batten_free(ctx, p->indices);
  batten_free(ctx, p->starts);
  batten_free(ctx, p->hessian);
  batten_free(ctx, p->point);
  *p = (convex_program){.point = NULL};
}

static batten_matrix dense_hessian(convex_program *p, const convex_objective *o, double w, double scale) {
  size_t n = o->n, unknowns = 3 * n;
  memset(p->hessian, 0, unknowns * unknowns * sizeof *p->hessian);
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < n; j++)
      for (size_t k = 0; k < 3; k++)
        p->hessian[(3 * i + k) * unknowns + 3 * j + k] = scale * (o->normal[i * n + j] + w * o->tension[i * n + j]);
  return batten_matrix_dense(unknowns, unknowns, p->hessian);
}

static batten_matrix sparse_hessian(convex_program *p, const convex_objective *o, const convex_space *space, double w,
                                    double scale) {
  size_t n = o->n, nv = space->axis[1].count, at = 0;
  for (size_t row = 0; row < 3 * n; row++) {
    size_t i = row / 3, k = row % 3;
    p->starts[row] = at;
    for (size_t j = 0; j < n; j++) {
      size_t du = i / nv > j / nv ? i / nv - j / nv : j / nv - i / nv;
      size_t dv = i % nv > j % nv ? i % nv - j % nv : j % nv - i % nv;
      if (du > space->axis[0].degree || dv > space->axis[1].degree) continue;
      p->indices[at] = (uint32_t)(3 * j + k);
      p->values[at++] = scale * (o->normal[i * n + j] + w * o->tension[i * n + j]);
    }
  }
  p->starts[3 * n] = at;
  return batten_matrix_sparse(3 * n, 3 * n, p->starts, p->indices, p->values);
}

static double row_times(const batten_matrix *m, size_t row, const double *x) {
  double sum = 0;
  if (m->dense)
    for (size_t j = 0; j < m->columns; j++) sum += m->dense[row * m->columns + j] * x[j];
  else
    for (size_t at = m->starts[row]; at < m->starts[row + 1]; at++) sum += m->values[at] * x[m->indices[at]];
  return sum;
}

/* ---- the rows in play --------------------------------------------------------------------------- */

/* A part of the rows, in the order in which they came in. */
typedef struct part {
  const batten_matrix *whole;
  const double *bound; /* [whole->rows] of C d */
  double *missing;     /* [whole->rows] bound - C d; -INFINITY of rows that are in */
  size_t rows, room, entries, entry_room;
  double *values; /* [room][columns], or entries of compressed rows */
  size_t *starts;
  uint32_t *indices;
  double *lower;
  signed char *active; /* [room + columns] */
} part;

static void part_free(batten_context *ctx, part *p) {
  batten_free(ctx, p->active);
  batten_free(ctx, p->lower);
  batten_free(ctx, p->indices);
  batten_free(ctx, p->starts);
  batten_free(ctx, p->values);
  batten_free(ctx, p->missing);
}

static bool grow(batten_context *ctx, void *array, size_t count, size_t size) {
  void **block = array;
  void *larger = batten_realloc_array(ctx, *block, count, size);
  if (larger) *block = larger;
  return larger != NULL;
}

/* Room for `rows` more, which have `entries`. */
static batten_status part_reserve(batten_context *ctx, part *p, size_t rows, size_t entries) {
  size_t columns = p->whole->columns, room = p->rows + rows;
  bool all = true;
  if (room > p->room) {
    room += room / 2;
    all = grow(ctx, &p->lower, room, sizeof *p->lower) && grow(ctx, &p->active, room + columns, 1) &&
          grow(ctx, &p->starts, room + 1, sizeof *p->starts);
    if (all) p->room = room;
  }
  size_t needed = p->entries + entries;
  if (all && needed > p->entry_room) {
    needed += needed / 2;
    all = grow(ctx, &p->values, needed, sizeof *p->values) &&
          (p->whole->dense || grow(ctx, &p->indices, needed, sizeof *p->indices));
    if (all) p->entry_room = needed;
  }
  return all ? BATTEN_OK : BATTEN_E_NOMEM;
}

static size_t entries_of(const batten_matrix *m, size_t row) {
  return m->dense ? m->columns : m->starts[row + 1] - m->starts[row];
}

static void part_take(part *p, size_t row) {
  const batten_matrix *m = p->whole;
  size_t entries = entries_of(m, row), at = m->dense ? row * m->columns : m->starts[row];
  p->starts[p->rows] = p->entries;
  memcpy(p->values + p->entries, (m->dense ? m->dense : m->values) + at, entries * sizeof *p->values);
  if (!m->dense) memcpy(p->indices + p->entries, m->indices + at, entries * sizeof *p->indices);
  p->entries += entries;
  p->lower[p->rows] = p->bound[row];
  p->active[p->rows++] = 0;
  p->starts[p->rows] = p->entries;
  p->missing[row] = -INFINITY;
}

/* Which violations are to come in: those of at least *least, every *stride-th of them, some `wanted`. They are
 * counted in classes of a factor of two. */
static void choose(const part *p, size_t wanted, double tolerance, double *least, size_t *stride) {
  enum { CLASSES = 64 };
  size_t counts[CLASSES] = {0}, sum = 0;
  int class = CLASSES;
  for (size_t i = 0; i < p->whole->rows; i++) {
    if (!(p->missing[i] > tolerance)) continue;
    int c = ilogb(p->missing[i] / tolerance);
    counts[c < CLASSES ? c : CLASSES - 1]++;
  }
  while (class > 0 && sum + counts[class - 1] <= wanted) sum += counts[--class];
  if (sum == 0 && class > 0) sum = counts[--class]; /* the largest ones alone are too many */
  *least = ldexp(tolerance, class);
  *stride = (sum + wanted - 1) / wanted;
}

/* Takes in some `wanted` of the rows that d violates most; *taken of them. */
static batten_status part_extend(batten_context *ctx, part *p, size_t wanted, double tolerance, size_t *taken) {
  double least;
  size_t stride, entries = 0, met = 0;
  choose(p, wanted, tolerance, &least, &stride);
  *taken = 0;
  for (size_t i = 0; i < p->whole->rows; i++)
    if (p->missing[i] > tolerance && p->missing[i] >= least && met++ % stride == 0) {
      entries += entries_of(p->whole, i);
      ++*taken;
    }
  if (*taken == 0) return BATTEN_OK;
  batten_status st = part_reserve(ctx, p, *taken, entries);
  met = 0;
  for (size_t i = 0; i < p->whole->rows && st >= 0; i++)
    if (p->missing[i] > tolerance && p->missing[i] >= least && met++ % stride == 0) part_take(p, i);
  return st;
}

/* missing = bound - C d, but of the rows that are in. */
static void part_measure(part *p, const double *d) {
  for (size_t i = 0; i < p->whole->rows; i++)
    if (p->missing[i] > -INFINITY) p->missing[i] = p->bound[i] - row_times(p->whole, i, d);
}

static batten_matrix part_matrix(const part *p) {
  return p->whole->dense ? batten_matrix_dense(p->rows, p->whole->columns, p->values)
                         : batten_matrix_sparse(p->rows, p->whole->columns, p->starts, p->indices, p->values);
}

/* ---- solving ------------------------------------------------------------------------------------ */

/* Minimum over the rows in play. *solved as in convex_program_solve. */
static batten_status solve_part(batten_context *ctx, convex_program *p, const batten_matrix *h, part *rows, double *d,
                                size_t *active, bool *solved) {
  batten_matrix c = part_matrix(rows);
  batten_qp_problem problem = batten_qp_problem_default(h->rows);
  problem.h = h;
  problem.c = &c;
  problem.lower = rows->lower;
  batten_qp_options opt = batten_qp_options_default();
  /* For some hundred unknowns the dual engine takes less time than weighing the others against it. */
  opt.hand_over = h->rows > DUAL_UNKNOWNS;
  opt.engine = opt.hand_over ? BATTEN_QP_AUTO : BATTEN_QP_DUAL;
  opt.active = rows->active;
  memset(rows->active + rows->rows, 0, h->rows);
  batten_qp_solution solution = {.x = d, .active = rows->active};
  batten_qp_info info;
  batten_status st = batten_qp_solve(ctx, &problem, &opt, p->workspace, &solution, &info);
  if (!opt.hand_over && (st == BATTEN_W_ACCURACY || st == BATTEN_E_LIMIT || st == BATTEN_E_INFEASIBLE ||
                         (st == BATTEN_W_STOPPED && !info.cancelled))) {
    opt.engine = BATTEN_QP_AUTO;
    opt.hand_over = 1;
    st = batten_qp_solve(ctx, &problem, &opt, p->workspace, &solution, &info);
  }
  if (st == BATTEN_W_STOPPED && info.cancelled)
    return batten_fail(ctx, BATTEN_E_CANCELLED, "cancelled by the host during quadratic program");
  *solved = st == BATTEN_OK || st == BATTEN_W_ACCURACY;
  if (*solved) *active = info.rows_active;
  return *solved || (st != BATTEN_E_NOMEM && st != BATTEN_E_CANCELLED && st != BATTEN_E_TOO_LARGE) ? BATTEN_OK : st;
}

/* control = free + d, moved towards the reference until all rows hold, to rounding of their sums. */
static void settle(const convex_rows *rows, const double *free, const double *d, const double *reference,
                   double *control) {
  size_t unknowns = rows->matrix.columns;
  double move = 0;
  for (size_t i = 0; i < unknowns; i++) control[i] = free[i] + d[i];
  for (size_t i = 0; i < rows->matrix.rows; i++) {
    double missing = rows->lower[i] - row_times(&rows->matrix, i, control);
    if (missing <= 0) continue;
    double slack = row_times(&rows->matrix, i, reference) - rows->lower[i];
    move = fmax(move, missing / (missing + slack));
  }
  for (size_t i = 0; i < unknowns && move > 0; i++)
    control[i] = move < 1 ? (1 - move) * control[i] + move * reference[i] : reference[i];
}

batten_status convex_program_solve(batten_context *ctx, convex_program *p, const convex_objective *o,
                                   const convex_space *space, double w, const convex_rows *rows, const double *free,
                                   const double *reference, double *control, size_t *active, bool *solved) {
  size_t unknowns = 3 * o->n, m = rows->matrix.rows, taken;
  double *d = p->point, largest = 0;
  part in = {.whole = &rows->matrix};
  batten_status st = BATTEN_E_NOMEM;
  double *bound = batten_alloc_array(ctx, m, sizeof *bound);
  in.missing = batten_alloc_array(ctx, m, sizeof *in.missing);
  if (!bound || !in.missing) goto done;
  in.bound = bound;
  for (size_t i = 0; i < m; i++) in.missing[i] = bound[i] = rows->lower[i] - row_times(&rows->matrix, i, free);
  for (size_t i = 0; i < o->n; i++)
    largest = fmax(largest, o->normal[i * (o->n + 1)] + w * o->tension[i * (o->n + 1)]);
  double scale = batten_unit(largest);
  batten_matrix h = p->hessian ? dense_hessian(p, o, w, scale) : sparse_hessian(p, o, space, w, scale);
  memset(d, 0, unknowns * sizeof *d);
  *active = 0;
  *solved = true;
  for (;;) {
    st = part_extend(ctx, &in, 2 * unknowns, TOLERANCE, &taken);
    if (st < 0 || taken == 0) break;
    st = solve_part(ctx, p, &h, &in, d, active, solved);
    if (st < 0 || !*solved) break;
    part_measure(&in, d);
  }
  if (st >= 0 && *solved) settle(rows, free, d, reference, control);
done:
  part_free(ctx, &in);
  batten_free(ctx, bound);
  return st;
}
