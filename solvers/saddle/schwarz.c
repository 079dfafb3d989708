/* The preconditioner: on every level the restricted solves of the domains, then the exact solve of the last level,
 * each applied to what the others left over (multiplicatively: adding them up takes two to four times the
 * iterations).
 *
 *     coarse to fine     the exact level first; then level by level: right side less K times the weights so far,
 * which lie on the next coarser level alone fine to coarse     the finest level first; right side on the next level
 * less K times the weights just found
 *
 * so that one product links two levels, from or to a subset. After every solve the weights are brought back into the
 * null space of P': what the restriction leaves there would be a wrong far field. */
#include <string.h>

#include "schwarz.h"

/* ---- The exact level ---- */

/* The system of the exact level for batten_saddle_factor: entries of the unknowns that it has. */
typedef struct exact_system {
  const batten_saddle *s;
  const saddle_iterative *it;
  const saddle_level *level;
} exact_system;

static void fill_exact(const void *user, size_t row0, size_t rows, size_t col0, size_t cols, double *tile,
                       size_t ld) {
  const exact_system *e = user;
  const batten_saddle_matrix *m = &e->s->matrix;
  if (e->level->index)
    batten_saddle_entries(e->s, &e->it->sums, rows, e->level->index + row0, cols, e->level->index + col0, tile, ld);
  else
    m->fill(m->user, row0, rows, col0, cols, tile, ld);
}

batten_status batten_saddle_exact_new(batten_saddle *s, saddle_iterative *it) {
  const saddle_level *l = &it->levels[it->level_count - 1];
  exact_system e = {s, it, l};
  batten_saddle_matrix matrix = {.n = l->count, .k = l->rank, .p = l->q, .fill = fill_exact, .user = &e};
  batten_saddle_options options = batten_saddle_options_default();
  options.method = BATTEN_SADDLE_CHOLESKY;
  it->exact_x = batten_alloc_array(s->ctx, l->count + l->rank, sizeof *it->exact_x);
  if (!it->exact_x) return BATTEN_E_NOMEM;
  if (l->rank == l->count) return BATTEN_OK; /* as many conditions as unknowns: the weights are 0 */
  return batten_saddle_factor(s->ctx, &matrix, &options, &it->exact);
}

/* w := the exact solve for r on the last level. */
static batten_status solve_exact(const saddle_iterative *it, const double *r, double *w) {
  const saddle_level *l = &it->levels[it->level_count - 1];
  size_t n = l->count;
  memset(w, 0, n * sizeof *w);
  if (!it->exact) return BATTEN_OK;
  memcpy(it->exact_x, r, n * sizeof *r);
  memset(it->exact_x + n, 0, l->rank * sizeof *r);
  batten_status st = batten_saddle_apply(it->exact, it->exact_x);
  if (st == BATTEN_OK) memcpy(w, it->exact_x, n * sizeof *w);
  return st;
}

/* ---- Products between levels ---- */

void batten_saddle_links_free(saddle_iterative *it) {
  for (size_t q = 0; q < it->level_count; q++) {
    if (it->levels[q].plan) it->sums.release(it->levels[q].plan);
    it->levels[q].plan = NULL;
  }
}

batten_status batten_saddle_links_new(batten_saddle *s, saddle_iterative *it, double accuracy) {
  batten_saddle_links_free(it);
  it->accuracy_within = accuracy;
  for (size_t q = 0; q + 1 < it->level_count; q++) {
    saddle_level *fine = &it->levels[q];
    const saddle_level *coarse = fine + 1, *to = it->fine_first ? coarse : fine,
                       *from = it->fine_first ? fine : coarse;
    batten_status st = batten_progress(s->ctx, "plans", (double)q / (double)it->level_count);
    if (st < 0) return st;
    st = it->sums.plan(s->matrix.user, s->ctx, accuracy, to->count, to->index, from->count, from->index, &fine->plan);
    if (st < 0) return st;
  }
  return BATTEN_OK;
}

/* ---- One application ---- */

/* The domains of a level for its r: its w. */
static batten_status solve_level(const batten_saddle *s, const saddle_iterative *it, const saddle_level *l,
                                 double fraction, double *coefficients) {
  batten_status st = batten_progress(s->ctx, "iterate", fraction);
  if (st < 0) return st;
  batten_saddle_domains_solve(s, it, l, l->r, l->w);
  batten_saddle_project(s, it, l, l->w, coefficients);
  return BATTEN_OK;
}

static batten_status coarse_to_fine(const batten_saddle *s, const saddle_iterative *it, double fraction,
                                    double *coefficients) {
  size_t last = it->level_count - 1;
  for (size_t q = 1; q <= last; q++) {
    const saddle_level *l = &it->levels[q], *finer = l - 1;
    for (size_t i = 0; i < l->count; i++) l->r[i] = finer->r[l->parent[i]];
  }
  batten_status st = solve_exact(it, it->levels[last].r, it->levels[last].w);
  for (size_t q = last; q-- > 0 && st == BATTEN_OK;) {
    const saddle_level *l = &it->levels[q], *coarser = l + 1;
    st = batten_progress(s->ctx, "iterate", fraction);
    if (st < 0) return st;
    st = it->sums.apply(l->plan, s->ctx, coarser->w, l->w);
    if (st < 0) return st;
    for (size_t i = 0; i < l->count; i++) l->r[i] -= l->w[i];
    st = solve_level(s, it, l, fraction, coefficients);
    for (size_t i = 0; i < coarser->count; i++) l->w[coarser->parent[i]] += coarser->w[i];
  }
  return st;
}

static batten_status fine_to_coarse(const batten_saddle *s, const saddle_iterative *it, double fraction,
                                    double *coefficients) {
  size_t last = it->level_count - 1;
  for (size_t q = 0; q < last; q++) {
    const saddle_level *l = &it->levels[q], *coarser = l + 1;
    batten_status st = solve_level(s, it, l, fraction, coefficients);
    if (st < 0) return st;
    st = batten_progress(s->ctx, "iterate", fraction);
    if (st < 0) return st;
    st = it->sums.apply(l->plan, s->ctx, l->w, coarser->w);
    if (st < 0) return st;
    for (size_t i = 0; i < coarser->count; i++) coarser->r[i] = l->r[coarser->parent[i]] - coarser->w[i];
  }
  batten_status st = solve_exact(it, it->levels[last].r, it->levels[last].w);
  for (size_t q = last; q-- > 0 && st == BATTEN_OK;) {
    const saddle_level *l = &it->levels[q], *coarser = l + 1;
    for (size_t i = 0; i < coarser->count; i++) l->w[coarser->parent[i]] += coarser->w[i];
  }
  return st;
}

batten_status batten_saddle_precondition(batten_saddle *s, saddle_iterative *it, double fraction, const double *r,
                                         double *z) {
  size_t n = s->matrix.n;
  const saddle_level *finest = &it->levels[0];
  double *coefficients = it->coefficients;
  memcpy(finest->r, r, n * sizeof *r);
  batten_status st =
      it->fine_first ? fine_to_coarse(s, it, fraction, coefficients) : coarse_to_fine(s, it, fraction, coefficients);
  if (st < 0) return st;
  memcpy(z, finest->w, n * sizeof *z);
  batten_saddle_project(s, it, finest, z, coefficients);
  return BATTEN_OK;
}
