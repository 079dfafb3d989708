/* The best convex spline between two bounds.
 *
 * From below: the quadratic program with necessary inequalities only. Wherever its solution is not convex, cuts are
 * added there; every minimum on the way is a bound. It converges to the best convex spline, from outside.
 * From above, in each round, two splines that are convex:
 *   - the minimum with the sufficient inequalities. Their directions are those of the last such minimum, which stays
 *     feasible, so that objectives never rise; boxes with active inequalities are quartered, and coefficients that
 *     are nearly singular get more directions. In the limit nothing convex is excluded.
 *   - where all signs are equal: the solution from below, with as much of (x^2 + y^2) / 2 added as its least
 *     eigenvalue asks for. That eigenvalue is bounded by subdivision, so this is a proof, too, and where it is least
 *     is where the next cut is. This nearly always closes the gap alone; the sufficient inequalities of high degrees,
 *     which are weak, are then not needed.
 * Equal signs: the Hessian less `margin` times the identity is to be semidefinite, so that convexity is strict. With
 * both signs no bowl serves all, and where they touch the Hessian vanishes: nothing strict is asked for. */
#include <string.h>

#include "base/checked.h"
#include "function_inner.h"

enum { CUT_STEPS = 40, CHOOSE_STEPS = 30, BOX_DEPTH = 8, ROW_LIMIT = 200000, LEAST_BOXES = 1000000 };

enum { ROW_LEFT = 0, ROW_CHOSEN, ROW_ACTIVE };

typedef struct rounds_state {
  batten_context *ctx;
  const function_space *space;
  const function_terms *terms;
  const function_rounds_options *opt;
  function_rounds_info *info;
  batten_qp_workspace *workspace;
  function_matrix cuts, rows, chosen;
  size_t *row_box, *chosen_row; /* [row_room] */
  size_t row_room, equalities;
  signed char *cut_active, *chosen_active; /* [rows + n] */
  signed char *row_state;                  /* [row_room] of rows */
  function_place least_at;                 /* of the spline that was considered last */
  function_box *boxes;
  size_t box_count, box_room;
  double *outer, *inner, *best, *bowl, *work; /* [n] */
  bool have_inner;
  unsigned stuck; /* programs that were too hard, and rounds that closed less than a tenth of the gap: after two of
                     them the next would be no better */
  double margin, scale, objective, lower;
} rounds_state;

static double objective_of(const rounds_state *s, const double *x) {
  return function_terms_squares(s->terms, x) + function_terms_tension(s->terms, x);
}

/* Minimises with rows (NULL: none). *bound: a lower bound of the objective, -INFINITY where the solver did not prove
 * its result. *solved = false when there is none. */
static batten_status minimise(rounds_state *s, const function_matrix *rows, bool with_tension, const double *start,
                              const signed char *active_start, double *x, signed char *active, double *bound,
                              bool *solved) {
  size_t n = s->space->n;
  batten_matrix a = function_matrix_view(&s->terms->design, n), h = function_matrix_view(&s->terms->tension, n), c;
  batten_qp_problem p = batten_qp_problem_default(n);
  batten_qp_options o = batten_qp_options_default();
  p.a = &a;
  p.b = s->terms->right;
  if (with_tension && s->terms->tension.rows > 0) p.h = &h;
  if (rows && rows->rows > 0) {
    c = function_matrix_view(rows, n);
    p.c = &c;
    p.lower = rows->lower;
    p.upper = rows->upper;
  }
  o.x0 = start;
  o.active = active_start;
  batten_qp_solution out = {.x = x, .active = active};
  batten_qp_info info;
  double begin = batten_now();
  batten_status st = batten_qp_solve(s->ctx, &p, &o, s->workspace, &out, &info);
  s->info->time_qp += batten_now() - begin;
  *bound = -INFINITY;
  if (st == BATTEN_W_STOPPED && info.cancelled)
    return batten_fail(s->ctx, BATTEN_E_CANCELLED, "cancelled by the host during quadratic program");
  *solved = st == BATTEN_OK || st == BATTEN_W_ACCURACY;
  s->stuck += st == BATTEN_W_STOPPED;
  if (st == BATTEN_OK) *bound = 2 * (info.objective - fabs(info.duality_gap));
  if (st == BATTEN_E_LIMIT || st == BATTEN_E_INFEASIBLE) return BATTEN_OK; /* spans of very different lengths */
  return st < 0 ? st : BATTEN_OK;
}

/* Root of the mean square of the Hessian over Bernstein coefficients of all span pairs. */
static double curvature_scale(const function_space *space, const double *x) {
  size_t points = (space->spline.axis[0].degree + 1) * (size_t)(space->spline.axis[1].degree + 1);
  size_t spans = space->spans[0] * space->spans[1];
  double sum = 0, h[3 * FUNCTION_TABLE];
  for (size_t k = 0; k < spans; k++) {
    function_box box = {.span = {(uint32_t)(k / space->spans[1]), (uint32_t)(k % space->spans[1])}};
    for (int i = 0; i < 2; i++) {
      box.lower[i] = space->spline.axis[i].knots[space->span[i][box.span[i]]];
      box.upper[i] = space->spline.axis[i].knots[space->span[i][box.span[i]] + 1];
    }
    function_hessian_box(space, &box, x, h);
    for (size_t p = 0; p < points; p++)
      sum += h[3 * p] * h[3 * p] + 2 * h[3 * p + 1] * h[3 * p + 1] + h[3 * p + 2] * h[3 * p + 2];
  }
  return sqrt(sum / (double)(spans * points));
}

/* Takes x as the result when it is better and convex; where signs are equal it is made convex, which changes x. */
static batten_status consider(rounds_state *s, double *x) {
  double least;
  batten_status st = function_least(s->ctx, s->space, x, s->margin / 2, LEAST_BOXES, &least, &s->least_at);
  if (st < 0) return st;
  if (!s->space->opposite && least < s->margin / 2) {
    double add = s->margin - least;
    for (size_t k = 0; k < s->space->n; k++) x[k] += add * s->bowl[k];
    least += add;
  }
  double objective = objective_of(s, x);
  if (!(objective < s->objective)) return BATTEN_OK;
  s->objective = objective;
  s->info->margin = least;
  memcpy(s->best, x, s->space->n * sizeof *x);
  return BATTEN_OK;
}

static bool close_enough(const rounds_state *s) {
  return s->objective - s->lower <= s->opt->gap_tol * s->lower + s->opt->floor;
}

/* ---- from below ---------------------------------------------------------------------------------- */

/* The working set of the last solve, with room for more rows: [rows + n], new rows outside. */
static batten_status grow_active(rounds_state *s, size_t rows_before) {
  size_t n = s->space->n, rows = s->cuts.rows;
  signed char *active = batten_realloc_array(s->ctx, s->cut_active, rows + n, 1);
  if (!active) return BATTEN_E_NOMEM;
  s->cut_active = active;
  memmove(active + rows, active + rows_before, n);
  memset(active + rows_before, 0, rows - rows_before);
  return BATTEN_OK;
}

static batten_status from_below(rounds_state *s, unsigned round) {
  size_t n = s->space->n;
  /* Where a bowl makes it convex, cuts go on until that costs little; else to ever less curvature. */
  bool bowl = !s->space->opposite && !s->opt->rows_only;
  double tolerance = bowl ? s->margin : s->scale * pow(0.1, 3 + round);
  const function_place *also = NULL;
  for (unsigned step = 0; step < CUT_STEPS; step++) {
    double worst, bound, begin = batten_now();
    size_t before = s->cuts.rows;
    batten_status st = function_cuts(s->ctx, s->space, s->outer, tolerance, also, &s->cuts, &worst);
    if (st < 0) return st;
    s->info->time_rows += batten_now() - begin;
    if (s->cuts.rows == before) break;
    st = grow_active(s, before);
    if (st < 0) return st;
    bool solved;
    st = minimise(s, &s->cuts, true, s->outer, s->cut_active, s->work, s->cut_active, &bound, &solved);
    if (st < 0) return st;
    if (!solved) break;
    memcpy(s->outer, s->work, n * sizeof *s->outer);
    s->lower = fmax(s->lower, bound);
    if (bowl && worst > -0.1 * s->scale) {
      st = consider(s, s->work);
      if (st < 0) return st;
      also = &s->least_at;
      if (close_enough(s)) break;
    }
    st = batten_progress(s->ctx, "fit", (round + (double)step / CUT_STEPS / 2) / s->opt->rounds);
    if (st < 0) return st;
  }
  return BATTEN_OK;
}

/* ---- from above ---------------------------------------------------------------------------------- */

static batten_status add_box(rounds_state *s, const function_box *box) {
  if (s->box_count == s->box_room) {
    size_t room = 2 * s->box_room + 64;
    function_box *boxes = batten_realloc_array(s->ctx, s->boxes, room, sizeof *boxes);
    if (!boxes) return BATTEN_E_NOMEM;
    s->boxes = boxes;
    s->box_room = room;
  }
  s->boxes[s->box_count++] = *box;
  return BATTEN_OK;
}

static batten_status first_boxes(rounds_state *s) {
  const function_space *space = s->space;
  for (uint32_t i = 0; i < space->spans[0]; i++)
    for (uint32_t j = 0; j < space->spans[1]; j++) {
      function_box box = {.span = {i, j}};
      if (function_sign(space, box.span) == 0) continue;
      for (int k = 0; k < 2; k++) {
        box.lower[k] = space->spline.axis[k].knots[space->span[k][box.span[k]]];
        box.upper[k] = space->spline.axis[k].knots[space->span[k][box.span[k]] + 1];
      }
      batten_status st = add_box(s, &box);
      if (st < 0) return st;
    }
  return BATTEN_OK;
}

static batten_status make_rows(rounds_state *s, unsigned round) {
  double begin = batten_now();
  function_directions opt = {.extra = round < 3 ? round : 3,
                             .bunch = fmax(0.03 * pow(0.25, round), 1e-5),
                             .margin = s->space->opposite ? 0 : s->margin};
  const double *reference = s->have_inner ? s->inner : s->opt->rows_only ? s->outer : s->best;
  s->rows.rows = 0;
  batten_status st = function_equalities(s->ctx, s->space, &s->rows);
  if (st < 0) return st;
  s->equalities = s->rows.rows;
  for (size_t b = 0; b < s->box_count; b++) {
    size_t before = s->rows.rows;
    st = function_rows_box(s->ctx, s->space, &s->boxes[b], &opt, reference, s->have_inner ? s->outer : NULL, s->scale,
                           &s->rows);
    if (st < 0) return st;
    if (s->rows.rows > s->row_room) {
      size_t room = s->rows.row_room;
      size_t *grown = batten_realloc_array(s->ctx, s->row_box, room, sizeof *grown);
      if (!grown) return BATTEN_E_NOMEM;
      s->row_box = grown;
      grown = batten_realloc_array(s->ctx, s->chosen_row, room, sizeof *grown);
      if (!grown) return BATTEN_E_NOMEM;
      s->chosen_row = grown;
      signed char *state = batten_realloc_array(s->ctx, s->row_state, room, 1);
      if (!state) return BATTEN_E_NOMEM;
      s->row_state = state;
      s->row_room = room;
    }
    for (size_t r = before; r < s->rows.rows; r++) s->row_box[r] = b;
  }
  s->info->time_rows += batten_now() - begin;
  return BATTEN_OK;
}

/* Quarters boxes with active rows, as long as there are not too many. */
static batten_status refine_boxes(rounds_state *s) {
  size_t last = SIZE_MAX, count = s->box_count, per_box = s->rows.rows / (count ? count : 1) + 1;
  for (size_t r = s->equalities; r < s->rows.rows; r++) {
    size_t b = s->row_box[r];
    if (s->row_state[r] != ROW_ACTIVE || b == last || s->boxes[b].depth == BOX_DEPTH ||
        s->box_count * per_box > ROW_LIMIT)
      continue;
    last = b;
    function_box whole = s->boxes[b];
    double middle[2];
    for (int k = 0; k < 2; k++) middle[k] = whole.lower[k] / 2 + whole.upper[k] / 2;
    for (int quarter = 0; quarter < 4; quarter++) {
      function_box box = whole;
      int side[2] = {quarter / 2, quarter % 2};
      box.depth++;
      for (int k = 0; k < 2; k++) {
        if (side[k])
          box.lower[k] = middle[k];
        else
          box.upper[k] = middle[k];
      }
      if (quarter == 0) {
        s->boxes[b] = box;
        continue;
      }
      batten_status st = add_box(s, &box);
      if (st < 0) return st;
    }
  }
  return BATTEN_OK;
}

/* Appends the rows that x violates, and the equalities, to those chosen before; *more: whether there were any. */
static batten_status choose_rows(rounds_state *s, const double *x, bool *more) {
  const function_matrix *all = &s->rows;
  *more = false;
  for (size_t r = 0; r < all->rows; r++) {
    size_t begin = all->starts[r], entries = all->starts[r + 1] - begin;
    double value = -all->lower[r];
    for (size_t k = begin; k < begin + entries; k++) value += all->values[k] * x[all->indices[k]];
    if (s->row_state[r] != ROW_LEFT || (r >= s->equalities && value >= -1e-9)) continue; /* what programs leave */
    batten_status st = function_matrix_reserve(s->ctx, &s->chosen, 1, entries);
    if (st < 0) return st;
    function_matrix *to = &s->chosen;
    size_t at = to->starts[to->rows];
    memcpy(to->indices + at, all->indices + begin, entries * sizeof *to->indices);
    memcpy(to->values + at, all->values + begin, entries * sizeof *to->values);
    to->lower[to->rows] = all->lower[r];
    s->chosen_row[to->rows] = r;
    to->upper[to->rows++] = all->upper[r];
    to->starts[to->rows] = at + entries;
    s->row_state[r] = ROW_CHOSEN;
    *more = true;
  }
  return BATTEN_OK;
}

/* The minimum with all rows into s->work, by programs with the few that matter: those that the spline from below and
 * then each minimum violates. */
static batten_status minimise_above(rounds_state *s, bool *solved) {
  const double *start = s->have_inner ? s->inner : s->best;
  double bound;
  bool more;
  *solved = false;
  s->chosen.rows = 0;
  if (s->rows.rows > 0) memset(s->row_state, ROW_LEFT, s->rows.rows);
  batten_status st = choose_rows(s, s->outer, &more);
  for (unsigned step = 0; st == BATTEN_OK && step < CHOOSE_STEPS; step++) {
    signed char *active = batten_realloc_array(s->ctx, s->chosen_active, s->chosen.rows + s->space->n, 1);
    if (!active) return BATTEN_E_NOMEM;
    s->chosen_active = active;
    st = minimise(s, &s->chosen, true, start, NULL, s->work, active, &bound, solved);
    if (st < 0 || !*solved) return st;
    st = choose_rows(s, s->work, &more);
    if (st < 0 || !more) return st;
    *solved = false;
  }
  return st;
}

static batten_status from_above(rounds_state *s, unsigned round) {
  bool solved;
  batten_status st = round == 0 ? first_boxes(s) : refine_boxes(s);
  if (st == BATTEN_OK) st = make_rows(s, round);
  if (st < 0) return st;
  s->info->rows[round] = s->rows.rows;
  st = minimise_above(s, &solved);
  if (st < 0 || !solved) return st;
  for (size_t k = 0; k < s->chosen.rows; k++)
    if (s->chosen_active[k]) s->row_state[s->chosen_row[k]] = ROW_ACTIVE;
  memcpy(s->inner, s->work, s->space->n * sizeof *s->inner);
  s->have_inner = true;
  return consider(s, s->work);
}

/* The bound of the squares alone: the last cuts, without tension. */
static batten_status bound_squares(rounds_state *s) {
  double bound;
  bool solved;
  s->info->squares_lower = s->lower;
  if (s->terms->tension.rows == 0) return BATTEN_OK;
  batten_status st =
      minimise(s, &s->cuts, false, s->outer, s->cuts.rows ? s->cut_active : NULL, s->work, NULL, &bound, &solved);
  s->info->squares_lower = fmax(bound, 0);
  s->lower = fmax(s->lower, bound); /* tension only adds */
  return st;
}

static batten_status allocate(rounds_state *s) {
  size_t n = s->space->n;
  s->outer = batten_alloc_array(s->ctx, 5 * n, sizeof *s->outer);
  s->cut_active = batten_alloc(s->ctx, n);
  if (!s->outer || !s->cut_active) return BATTEN_E_NOMEM;
  s->inner = s->outer + n;
  s->best = s->inner + n;
  s->bowl = s->best + n;
  s->work = s->bowl + n;
  memset(s->cut_active, 0, n);
  function_bowl(s->space, s->bowl);
  batten_status st = batten_qp_workspace_new(s->ctx, &s->workspace);
  if (st == BATTEN_OK) st = function_equalities(s->ctx, s->space, &s->cuts);
  if (st == BATTEN_OK) st = grow_active(s, 0);
  return st;
}

/* The minimum without inequalities; and the flattest spline that is allowed, to begin with. */
static batten_status start(rounds_state *s, double *unconstrained) {
  bool solved;
  size_t n = s->space->n;
  batten_status st = minimise(s, NULL, true, NULL, NULL, s->outer, NULL, &s->lower, &solved);
  if (st < 0) return st;
  if (!solved)
    return batten_fail(s->ctx, BATTEN_E_SINGULAR, "points: they do not determine the spline; raise opt.tension");
  s->lower = fmax(s->lower, 0);
  memcpy(unconstrained, s->outer, n * sizeof *unconstrained);
  s->scale = fmax(curvature_scale(s->space, s->outer), s->opt->noise);
  /* A margin adds its bowl, at most margin / 8 or so, to a spline that is off by the root of lower: little enough
   * that it takes a twentieth of what the gap may be. */
  double gap = s->opt->gap_tol * s->lower + s->opt->floor, off = sqrt(s->lower);
  double margin = fmin(1e-6 * s->scale, fmin(0.08 * gap / fmax(off, 1e-300), sqrt(0.5 * gap)));
  s->margin = fmax(margin, s->opt->noise);
  for (size_t k = 0; k < n; k++) s->work[k] = s->space->opposite ? 0 : s->margin * s->bowl[k];
  s->objective = INFINITY;
  st = consider(s, s->work);
  if (st < 0) return st;
  double least;
  st = function_least(s->ctx, s->space, s->outer, s->margin / 2, LEAST_BOXES, &least, &s->least_at);
  if (st < 0 || least < s->margin / 2) return st;
  s->info->margin = least; /* a minimum of all splines */
  s->objective = s->lower = objective_of(s, s->outer);
  memcpy(s->best, s->outer, n * sizeof *s->best);
  return BATTEN_OK;
}

batten_status function_rounds(batten_context *ctx, const function_space *space, const function_terms *terms,
                              const function_rounds_options *opt, double *x, double *unconstrained,
                              function_rounds_info *info) {
  rounds_state s = {.ctx = ctx, .space = space, .terms = terms, .opt = opt, .info = info};
  *info = (function_rounds_info){0};
  batten_status st = allocate(&s);
  if (st == BATTEN_OK) st = start(&s, unconstrained);
  for (unsigned round = 0; st == BATTEN_OK && round < opt->rounds && !close_enough(&s); round++) {
    double gap = s.objective - s.lower;
    st = from_below(&s, round);
    if (st == BATTEN_OK && !close_enough(&s)) st = from_above(&s, round);
    if (st < 0) break;
    info->upper[round] = s.objective;
    info->rounds = round + 1;
    st = batten_progress(ctx, "fit", (round + 1.0) / opt->rounds);
    s.stuck += s.objective - s.lower > 0.9 * gap;
    if (s.stuck > 1) break;
  }
  if (st == BATTEN_OK) st = bound_squares(&s);
  if (st == BATTEN_OK) {
    memcpy(x, s.best, space->n * sizeof *x);
    info->objective = s.objective;
    info->lower = s.lower;
    info->cuts = s.cuts.rows;
    info->scale = s.scale;
    info->least_margin = s.margin;
  }
  batten_qp_workspace_free(s.workspace);
  function_matrix_free(ctx, &s.cuts);
  function_matrix_free(ctx, &s.rows);
  function_matrix_free(ctx, &s.chosen);
  batten_free(ctx, s.row_box);
  batten_free(ctx, s.cut_active);
  batten_free(ctx, s.chosen_active);
  batten_free(ctx, s.row_state);
  batten_free(ctx, s.chosen_row);
  batten_free(ctx, s.boxes);
  batten_free(ctx, s.outer);
  return st;
}
