/* The quadratic program of a round.   [section 3]
 *
 * Unknown is d = y - free, from the minimum without inequalities: minimise d'H d / 2 for both coordinates, subject to
 * C d >= lower - C free. What violates inequalities is local, and so is what helps: influence falls from contour to
 * contour and from knot to knot by constant factors. So d is 0 but for unknowns within a few steps of the rows in the
 * graph of H. All rows with an unknown among these are in the program, as they are at d = 0 for the others.
 *
 * The inequalities of a vertex may give way together by g >= 0 at a cost of weight (g + g^2 / 2): as long as the
 * weight is above the multipliers, as little as can be, and 0 where there is a solution. So a program always has one.
 *
 * Unknowns are scaled by powers of two to a diagonal of about one. */
#include <string.h>

#include "base/checked.h"
#include "loft_inner.h"

static const uint32_t OUTSIDE = UINT32_MAX;
/* Beyond, active set engines take several times the interior point's time: many rows are nearly the same. */
enum { DENSE = 200 };

typedef struct work {
  batten_context *ctx;
  const loft_program *p;
  const loft_rows *rows;
  const double *costs;
  size_t unknowns, inside, groups, variables;
  uint32_t *local; /* [unknowns] number in the program, or OUTSIDE */
  uint32_t *whole; /* [inside] and back */
  uint32_t *slack; /* [groups] variable, or OUTSIDE */
  double *scale;   /* [inside] */
  double *cost;    /* [variables - 2 inside] of giving way */
  double *linear, *lowest, *x, *bound;
  size_t *h_starts, *c_starts;
  uint32_t *h_indices, *c_indices;
  double *h_values, *c_values;
} work;

static void work_free(work *w) {
  void *const blocks[] = {w->c_values, w->h_values, w->c_indices, w->h_indices, w->c_starts,
                          w->h_starts, w->bound,    w->x,         w->lowest,    w->linear,
                          w->scale,    w->cost,     w->slack,     w->whole,     w->local};
  for (size_t k = 0; k < sizeof blocks / sizeof *blocks; k++) batten_free(w->ctx, blocks[k]);
}

/* Numbers the unknowns within reach of the rows, in the order in which they are. */
static batten_status choose_unknowns(work *w) {
  const batten_matrix *h = &w->p->hessian;
  size_t n = w->unknowns, done = 0, count = 0;
  w->local = batten_alloc_array(w->ctx, n, sizeof *w->local);
  w->whole = batten_alloc_array(w->ctx, n, sizeof *w->whole);
  if (!w->local || !w->whole) return BATTEN_E_NOMEM;
  for (size_t k = 0; k < n; k++) w->local[k] = OUTSIDE;
  for (size_t at = 0; at < w->rows->entries; at++) {
    uint32_t k = w->rows->indices[at] / 2;
    if (w->local[k] != OUTSIDE) continue;
    w->local[k] = 0;
    w->whole[count++] = k;
  }
  for (unsigned step = 0; step < w->p->reach; step++)
    for (size_t end = count; done < end; done++)
      for (size_t at = h->starts[w->whole[done]]; at < h->starts[w->whole[done] + 1]; at++) {
        uint32_t k = h->indices[at];
        if (w->local[k] != OUTSIDE) continue;
        w->local[k] = 0;
        w->whole[count++] = k;
      }
  w->inside = 0;
  for (size_t k = 0; k < n; k++)
    if (w->local[k] != OUTSIDE) {
      w->whole[w->inside] = (uint32_t)k;
      w->local[k] = (uint32_t)w->inside++;
    }
  return BATTEN_OK;
}

/* A variable for each group that has rows. */
static batten_status choose_slacks(work *w) {
  w->slack = batten_alloc_array(w->ctx, w->groups, sizeof *w->slack);
  w->cost = batten_alloc_array(w->ctx, w->groups, sizeof *w->cost);
  if (!w->slack || !w->cost) return BATTEN_E_NOMEM;
  for (size_t k = 0; k < w->groups; k++) w->slack[k] = OUTSIDE;
  w->variables = 2 * w->inside;
  for (size_t i = 0; i < w->rows->rows; i++) {
    size_t k = w->rows->group[i];
    if (w->slack[k] != OUTSIDE) continue;
    w->cost[w->variables - 2 * w->inside] = w->p->weight * w->costs[k];
    w->slack[k] = (uint32_t)w->variables++;
  }
  return BATTEN_OK;
}

/* Both coordinates' parts of H among the unknowns inside, and the weights. */
static batten_status make_hessian(work *w) {
  const batten_matrix *h = &w->p->hessian;
  size_t entries = 0, at = 0, n = w->variables;
  for (size_t k = 0; k < w->inside; k++)
    for (size_t j = h->starts[w->whole[k]]; j < h->starts[w->whole[k] + 1]; j++)
      if (w->local[h->indices[j]] != OUTSIDE) entries += 2;
  entries += n - 2 * w->inside;
  w->h_starts = batten_alloc_array(w->ctx, n + 1, sizeof *w->h_starts);
  w->h_indices = batten_alloc_array(w->ctx, entries, sizeof *w->h_indices);
  w->h_values = batten_alloc_array(w->ctx, entries, sizeof *w->h_values);
  w->scale = batten_alloc_array(w->ctx, w->inside, sizeof *w->scale);
  if (!w->h_starts || !w->h_indices || !w->h_values || !w->scale) return BATTEN_E_NOMEM;
  for (size_t k = 0; k < w->inside; k++)
    for (size_t j = h->starts[w->whole[k]]; j < h->starts[w->whole[k] + 1]; j++)
      if (h->indices[j] == w->whole[k]) w->scale[k] = ldexp(1, ilogb(batten_unit(h->values[j])) / 2);
  for (size_t row = 0; row < 2 * w->inside; row++) {
    size_t k = row / 2;
    w->h_starts[row] = at;
    for (size_t j = h->starts[w->whole[k]]; j < h->starts[w->whole[k] + 1]; j++) {
      uint32_t other = w->local[h->indices[j]];
      if (other == OUTSIDE) continue;
      w->h_indices[at] = (uint32_t)(2 * other + row % 2);
      w->h_values[at++] = h->values[j] * w->scale[k] * w->scale[other];
    }
  }
  for (size_t row = 2 * w->inside; row < n; row++) {
    w->h_starts[row] = at;
    w->h_indices[at] = (uint32_t)row;
    w->h_values[at++] = w->cost[row - 2 * w->inside];
  }
  w->h_starts[n] = at;
  return BATTEN_OK;
}

static batten_status make_rows(work *w) {
  const loft_rows *r = w->rows;
  size_t at = 0, n = w->variables;
  w->c_starts = batten_alloc_array(w->ctx, r->rows + 1, sizeof *w->c_starts);
  w->c_indices = batten_alloc_array(w->ctx, r->entries + r->rows, sizeof *w->c_indices);
  w->c_values = batten_alloc_array(w->ctx, r->entries + r->rows, sizeof *w->c_values);
  w->bound = batten_alloc_array(w->ctx, r->rows, sizeof *w->bound);
  w->linear = batten_alloc_array(w->ctx, n, sizeof *w->linear);
  w->lowest = batten_alloc_array(w->ctx, n, sizeof *w->lowest);
  w->x = batten_alloc_array(w->ctx, n, sizeof *w->x);
  if (!w->c_starts || !w->c_indices || !w->c_values || !w->bound || !w->linear || !w->lowest || !w->x)
    return BATTEN_E_NOMEM;
  for (size_t k = 0; k < n; k++) {
    bool slack = k >= 2 * w->inside;
    w->linear[k] = slack ? w->cost[k - 2 * w->inside] : 0;
    w->lowest[k] = slack ? 0 : -INFINITY;
  }
  for (size_t i = 0; i < r->rows; i++) {
    double value = 0;
    w->c_starts[i] = at;
    for (size_t j = r->starts[i]; j < r->starts[i + 1]; j++) {
      uint32_t column = r->indices[j], k = w->local[column / 2];
      value += r->values[j] * w->p->free[column];
      w->c_indices[at] = 2 * k + column % 2;
      w->c_values[at++] = r->values[j] * w->scale[k];
    }
    w->c_indices[at] = w->slack[r->group[i]];
    w->c_values[at++] = 1;
    w->bound[i] = r->lower[i] - value;
  }
  w->c_starts[r->rows] = at;
  return BATTEN_OK;
}

static batten_status solve(work *w, size_t *iterations) {
  size_t n = w->variables;
  batten_matrix h = batten_matrix_sparse(n, n, w->h_starts, w->h_indices, w->h_values);
  batten_matrix c = batten_matrix_sparse(w->rows->rows, n, w->c_starts, w->c_indices, w->c_values);
  batten_qp_problem problem = batten_qp_problem_default(n);
  problem.h = &h;
  problem.g = w->linear;
  problem.c = &c;
  problem.lower = w->bound;
  problem.x_lower = w->lowest;
  batten_qp_options opt = batten_qp_options_default();
  if (n > DENSE) {
    opt.engine = BATTEN_QP_INTERIOR;
    opt.hand_over = 0;
  }
  batten_qp_solution solution = {.x = w->x};
  batten_qp_info info = {.iterations = 0};
  batten_status st = batten_qp_solve(w->ctx, &problem, &opt, w->p->workspace, &solution, &info);
  *iterations += info.iterations;
  if (st == BATTEN_W_STOPPED && info.cancelled)
    return batten_fail(w->ctx, BATTEN_E_CANCELLED, "cancelled by the host during quadratic program");
  if (st == BATTEN_W_STOPPED) return BATTEN_W_ACCURACY;
  if (st >= 0 || st == BATTEN_E_NOMEM || st == BATTEN_E_CANCELLED || st == BATTEN_E_TOO_LARGE) return st;
  memset(w->x, 0, n * sizeof *w->x); /* the objective is positive definite and slacks have room: only a limit */
  return BATTEN_W_ACCURACY;
}

batten_status loft_program_solve(batten_context *ctx, loft_program *p, const loft_rows *rows, size_t groups,
                                 const double *costs, double *y, double *give) {
  work w = {.ctx = ctx, .p = p, .rows = rows, .unknowns = p->hessian.rows, .groups = groups, .costs = costs};
  batten_status st = choose_unknowns(&w), accuracy = BATTEN_OK;
  if (st >= 0) st = choose_slacks(&w);
  if (st >= 0 && w.variables >= OUTSIDE)
    st = batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu unknowns of a quadratic program; loft fewer contours at a time",
                     w.variables);
  if (st >= 0) st = make_hessian(&w);
  if (st >= 0) st = make_rows(&w);
  if (st >= 0) st = accuracy = solve(&w, &p->iterations);
  if (st < 0) goto done;
  for (size_t k = 0; k < 2 * w.unknowns; k++) {
    uint32_t local = w.local[k / 2];
    y[k] = p->free[k] + (local == OUTSIDE ? 0 : w.x[2 * local + k % 2] * w.scale[local]);
  }
  for (size_t k = 0; k < groups; k++) give[k] = w.slack[k] == OUTSIDE ? 0 : fmax(w.x[w.slack[k]], 0);
  if (accuracy == BATTEN_W_ACCURACY) batten_fail(ctx, BATTEN_OK, "%s", "");
  st = accuracy == BATTEN_OK ? BATTEN_OK : BATTEN_W_ACCURACY;
done:
  work_free(&w);
  return st;
}
