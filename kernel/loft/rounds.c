/* Separators and programs in turns.   [section 3; section 2.2 (iii)]
 *
 * A round has a reference: the minimum without inequalities first, the last surface then. Around it separators are
 * made for the vertices that matter: those whose turns do not hold, and in the course of the round those whose turns
 * the program's answer spoils. Of their inequalities the program gets those that its answers violate. When none is
 * left the answer is the minimum under all of them.
 *
 * As long as there is no surface whose turns all hold, inequalities give way where they must, and the next round's
 * separators, made from a surface that comes nearer and on shorter pieces, ask for less. Once there is one it
 * satisfies the inequalities around itself: pieces are bisected until it does, and where that takes too many those
 * before stay. So the objective falls from round to round. */
#include <stdlib.h>
#include <string.h>

#include "base/checked.h"
#include "loft_inner.h"

static const size_t NOBODY = SIZE_MAX;

/* A round that lowers the objective by less than this part is the last one. */
static const double GAIN = 1e-3;
/* One that leaves more than this part of what fails is, too, when giving way costs most. */
static const double PROGRESS = 0.9;
/* What a turn that gives way by a radian costs, times the length of its legs, as the objective weighs them. Too much
 * would spoil the turns around it, and the surface with them; too little would leave it where there is a solution: so
 * more from round to round. */
static const double WEIGHT = 100, HEAVIER = 10, HEAVIEST = 1e5;
/* Bisections without a feasible reference, at most: shorter pieces help only those who know where they lead. */
static const unsigned LEAST_MAX = 2;
/* Inequalities are hardly satisfied by less than this part of the contours' turn. */
static const double NEAR = 0.02;
/* Without a feasible reference: programs of a round, what they leave is left to the next one; rounds. Where more than
 * CROWD vertices fail programs take seconds, and mostly leave some of them: then, and for what they leave, the turns
 * themselves are taken, see settle.c, to the same objective in a tenth of the time. */
enum { PASSES = 6, LOST = 2, CROWD = 8 };
/* Steps in the Hessian, each to the neighbouring contours and a degree of knots either way; more cost more than they
 * lower the objective. */
static const unsigned REACH = 1;

typedef struct span {
  size_t first, count;
} span;

typedef struct work {
  batten_context *ctx;
  const loft_net *net;
  const batten_loft_options *opt;
  loft_objective *objective;
  const double *free;
  size_t vertices, groups, group_room;
  size_t *start;      /* [slabs + 1] first vertex of each, of all */
  size_t *group;      /* [vertices] or NOBODY: never in a program */
  size_t *who;        /* [groups] vertices */
  double *give;       /* [group_room] */
  double *costs;      /* [group_room] of giving way, without the weight */
  span *now, *before; /* [vertices] pieces */
  loft_pieces pieces, older;
  loft_directions *directions; /* [slabs] of the reference, made when asked for */
  loft_rows rows;
  loft_program program;
  double *y, *best;            /* [unknowns][2] */
  double *control, *reference; /* [rows of net][2] */
  double *free_control;
  bool feasible;
  unsigned least; /* bisections without a feasible reference */
  double objective_best, shortage_best;
  double seconds_rows, seconds_qp;
  loft_result result;
} work;

static void forget_directions(work *w) {
  for (size_t i = 0; w->directions && i < w->net->slab_count; i++) loft_directions_free(w->ctx, &w->directions[i]);
}

static void work_free(work *w) {
  forget_directions(w);
  loft_rows_free(w->ctx, &w->rows);
  loft_pieces_free(w->ctx, &w->older);
  loft_pieces_free(w->ctx, &w->pieces);
  batten_qp_workspace_free(w->program.workspace);
  void *const blocks[] = {w->free_control, w->reference, w->control, w->best, w->y,     w->directions, w->before,
                          w->now,          w->give,      w->costs,   w->who,  w->group, w->start};
  for (size_t k = 0; k < sizeof blocks / sizeof *blocks; k++) batten_free(w->ctx, blocks[k]);
}

static batten_status work_start(work *w) {
  size_t slabs = w->net->slab_count, unknowns = w->net->z.columns, rows = w->net->z.rows;
  w->start = batten_alloc_array(w->ctx, slabs + 1, sizeof *w->start);
  if (!w->start) return BATTEN_E_NOMEM;
  w->start[0] = 0;
  for (size_t i = 0; i < slabs; i++) w->start[i + 1] = w->start[i] + loft_vertices(&w->net->slabs[i].space);
  w->vertices = w->start[slabs];
  w->group = batten_alloc_array(w->ctx, w->vertices, sizeof *w->group);
  w->now = batten_alloc_array(w->ctx, w->vertices, sizeof *w->now);
  w->before = batten_alloc_array(w->ctx, w->vertices, sizeof *w->before);
  w->directions = batten_alloc_array(w->ctx, slabs, sizeof *w->directions);
  if (w->directions) memset(w->directions, 0, slabs * sizeof *w->directions);
  w->y = batten_alloc_array(w->ctx, unknowns, 2 * sizeof(double));
  w->best = batten_alloc_array(w->ctx, unknowns, 2 * sizeof(double));
  w->control = batten_alloc_array(w->ctx, rows, 2 * sizeof(double));
  w->reference = batten_alloc_array(w->ctx, rows, 2 * sizeof(double));
  w->free_control = batten_alloc_array(w->ctx, rows, 2 * sizeof(double));
  if (!w->group || !w->now || !w->before || !w->directions || !w->y || !w->best || !w->control || !w->reference ||
      !w->free_control)
    return BATTEN_E_NOMEM;
  for (size_t k = 0; k < w->vertices; k++) {
    w->group[k] = NOBODY;
    w->now[k] = w->before[k] = (span){0, 0};
  }
  w->program = (loft_program){
      .hessian = loft_objective_hessian(w->objective), .free = w->free, .weight = WEIGHT, .reach = REACH};
  memcpy(w->y, w->free, 2 * unknowns * sizeof *w->y);
  memcpy(w->best, w->free, 2 * unknowns * sizeof *w->best);
  loft_net_expand(w->net, w->y, w->control);
  memcpy(w->free_control, w->control, 2 * rows * sizeof *w->control);
  return batten_qp_workspace_new(w->ctx, &w->program.workspace);
}

/* The patch of vertex k of all. */
static size_t slab_of(const work *w, size_t k) {
  size_t low = 0, high = w->net->slab_count;
  while (low + 1 < high) {
    size_t middle = (low + high) / 2;
    if (w->start[middle] <= k)
      low = middle;
    else
      high = middle;
  }
  return low;
}

static double shortage_of(const work *w, const double *control, size_t k) {
  size_t i = slab_of(w, k);
  loft_bound bound;
  if (!loft_bound_of(&w->net->slabs[i], k - w->start[i], w->opt->margin, &bound)) return 0;
  return loft_shortage(w->net, control, i, k - w->start[i], &bound);
}

static batten_status enroll(work *w, size_t k) {
  if (w->groups == w->group_room) {
    size_t room = w->group_room + w->group_room / 2 + 16;
    void *who = batten_realloc_array(w->ctx, w->who, room, sizeof *w->who);
    if (who) w->who = who;
    void *give = who ? batten_realloc_array(w->ctx, w->give, room, sizeof *w->give) : NULL;
    if (give) w->give = give;
    void *costs = give ? batten_realloc_array(w->ctx, w->costs, room, sizeof *w->costs) : NULL;
    if (costs) w->costs = costs;
    if (!costs) return BATTEN_E_NOMEM;
    w->group_room = room;
  }
  size_t i = slab_of(w, k), v = k - w->start[i], legs = loft_legs(&w->net->slabs[i].space), next = (v + 1) % legs;
  double *const *length = w->net->slabs[i].length;
  w->costs[w->groups] = (length[0][v] + length[1][v] + length[0][next] + length[1][next]) / 4;
  w->give[w->groups] = 0;
  w->who[w->groups] = k;
  w->group[k] = w->groups++;
  return BATTEN_OK;
}

/* Separators of vertex k around the reference; those before where it does not satisfy new ones. */
static batten_status separate(work *w, size_t k) {
  size_t i = slab_of(w, k), first = w->pieces.count;
  loft_directions *d = &w->directions[i];
  bool strict;
  batten_status st = BATTEN_OK;
  if (!d->turned) st = loft_directions_make(w->ctx, w->net, w->reference, i, w->opt->margin, w->opt->depth_max, d);
  unsigned least = w->feasible ? 0 : w->least < w->opt->depth_max ? w->least : w->opt->depth_max;
  if (st >= 0)
    st = loft_pieces_add(w->ctx, w->net, w->reference, d, k - w->start[i], w->opt->margin, least, w->group[k],
                         &w->pieces, &strict);
  if (st < 0) return st;
  if (w->feasible && !strict && w->before[k].count > 0 && w->before[k].count <= w->pieces.room - first) {
    w->pieces.count = first + w->before[k].count;
    memcpy(w->pieces.all + first, w->older.all + w->before[k].first, w->before[k].count * sizeof *w->pieces.all);
    for (size_t j = first; j < w->pieces.count; j++) w->pieces.all[j].used = 0;
  }
  w->now[k] = (span){first, w->pieces.count - first};
  size_t each = loft_rows_each(w->net);
  if (w->pieces.count > w->opt->row_limit / each)
    return batten_fail(w->ctx, BATTEN_E_TOO_LARGE,
                       "opt.row_limit: more than %zu inequalities; raise it, or loft fewer contours at a time",
                       w->opt->row_limit);
  return BATTEN_OK;
}

/* Inequalities of vertex k that `control` violates more than its vertex gives way, and with them those that it hardly
 * satisfies; or all that it hardly satisfies. */
static batten_status take_rows(work *w, const double *control, size_t k, bool violated) {
  batten_status st = BATTEN_OK;
  double give = w->give[w->group[k]];
  for (size_t j = 0; j < w->now[k].count && st >= 0; j++) {
    loft_piece *piece = &w->pieces.all[w->now[k].first + j];
    double near = NEAR * piece->turn - give, below = violated ? -give - piece->inside / 2 : near;
    st = loft_rows_add(w->ctx, w->net, control, piece, below, near, &w->rows);
  }
  return st;
}

/* Separators of those who were in a program before, and the inequalities that the minimum violates or the reference
 * hardly satisfies. */
static batten_status begin_round(work *w) {
  double start = batten_now();
  loft_pieces pieces = w->older;
  span *now = w->before;
  w->older = w->pieces;
  w->pieces = pieces;
  w->pieces.count = 0;
  w->before = w->now;
  w->now = now;
  for (size_t k = 0; k < w->vertices; k++) w->now[k] = (span){0, 0};
  forget_directions(w);
  loft_rows_free(w->ctx, &w->rows);
  memcpy(w->reference, w->control, 2 * w->net->z.rows * sizeof *w->reference);
  batten_status st = BATTEN_OK;
  for (size_t g = 0; g < w->groups && st >= 0; g++) {
    size_t k = w->who[g];
    w->give[g] = 0;
    st = separate(w, k);
    if (st >= 0) st = take_rows(w, w->free_control, k, true);
    if (st >= 0) st = take_rows(w, w->reference, k, false);
  }
  w->seconds_rows += batten_now() - start;
  return st;
}

/* What the last answer violates: vertices whose turns do not hold, and inequalities. */
static batten_status extend(work *w, bool *more) {
  double start = batten_now();
  size_t rows = w->rows.rows;
  batten_status st = BATTEN_OK;
  for (size_t k = 0; k < w->vertices && st >= 0; k++)
    if (w->now[k].count == 0 && shortage_of(w, w->control, k) > 0) {
      if (w->group[k] == NOBODY) st = enroll(w, k);
      if (st >= 0) st = separate(w, k);
    }
  for (size_t g = 0; g < w->groups && st >= 0; g++) st = take_rows(w, w->control, w->who[g], true);
  *more = w->rows.rows > rows;
  w->seconds_rows += batten_now() - start;
  return st;
}

static batten_status solve_round(work *w) {
  batten_status st = begin_round(w);
  bool more = st >= 0 && w->rows.rows > 0;
  if (st >= 0 && !more) st = extend(w, &more);
  for (unsigned pass = 0; st >= 0 && more && (w->feasible || pass < PASSES); pass++) {
    double start = batten_now();
    st = loft_program_solve(w->ctx, &w->program, &w->rows, w->groups, w->costs, w->y, w->give);
    w->seconds_qp += batten_now() - start;
    if (st < 0) break;
    loft_net_expand(w->net, w->y, w->control);
    st = extend(w, &more);
  }
  return st;
}

/* Of all vertices together; *count (may be NULL) of them fail. */
static double whole_shortage(const work *w, const double *control, size_t *count) {
  double sum = 0;
  size_t failing = 0;
  for (size_t k = 0; k < w->vertices; k++) {
    double shortage = shortage_of(w, control, k);
    sum += shortage;
    failing += shortage > 0;
  }
  if (count) *count = failing;
  return sum;
}

static void take(work *w, double objective, double shortage) {
  memcpy(w->best, w->y, 2 * w->net->z.columns * sizeof *w->y);
  w->objective_best = objective;
  w->shortage_best = shortage;
  size_t all = 0, each = loft_rows_each(w->net);
  loft_bound bound;
  for (size_t k = 0; k < w->vertices; k++) {
    size_t i = slab_of(w, k);
    if (loft_bound_of(&w->net->slabs[i], k - w->start[i], w->opt->margin, &bound))
      all += each * (w->now[k].count ? w->now[k].count : 1);
  }
  w->result.rows = all;
  w->result.rows_used = w->rows.rows;
}

/* Judges the round's answer; whether another one is worth while. Its reference is the best surface. */
static bool judge(work *w) {
  double objective = loft_objective_value(w->objective, w->y), shortage = whole_shortage(w, w->control, NULL);
  bool feasible = shortage == 0, last = w->program.weight >= HEAVIEST, gains = !last;
  if (!feasible && !last) w->program.weight *= HEAVIER;
  if (w->least < LEAST_MAX) w->least++;
  if (feasible ? !w->feasible || objective < w->objective_best : !w->feasible && shortage < w->shortage_best) {
    if (feasible)
      gains = !w->feasible || objective < (1 - GAIN) * w->objective_best;
    else if (last)
      gains = shortage < PROGRESS * w->shortage_best;
    take(w, objective, shortage);
    w->feasible = feasible;
  } else {
    gains = gains && !feasible;
    loft_net_expand(w->net, w->best, w->control);
  }
  return gains;
}

/* From the minimum without inequalities: nearer to the best surface than what programs gave way to. */
static batten_status settle(work *w) {
  double start = batten_now();
  bool feasible = false;
  memcpy(w->y, w->free, 2 * w->net->z.columns * sizeof *w->y);
  batten_status st =
      loft_settle(w->ctx, w->net, w->objective, w->opt->margin, w->free, w->y, &w->program.iterations, &feasible);
  w->seconds_qp += batten_now() - start;
  if (st < 0) return st;
  loft_net_expand(w->net, w->y, w->control);
  double shortage = whole_shortage(w, w->control, NULL);
  if (shortage < w->shortage_best) take(w, loft_objective_value(w->objective, w->y), shortage);
  w->feasible = feasible;
  w->result.settled = true;
  return BATTEN_OK;
}

static int compare_elastic(const void *a, const void *b) {
  const loft_elastic *x = a, *y = b;
  if (x->amount != y->amount) return x->amount > y->amount ? -1 : 1;
  if (x->slab != y->slab) return x->slab < y->slab ? -1 : 1;
  return x->vertex < y->vertex ? -1 : x->vertex > y->vertex;
}

static batten_status name_elastic(work *w) {
  loft_result *r = &w->result;
  size_t count = 0;
  loft_net_expand(w->net, w->best, w->control);
  for (size_t k = 0; k < w->vertices; k++) count += shortage_of(w, w->control, k) > 0;
  r->elastic = batten_alloc_array(w->ctx, count, sizeof *r->elastic);
  if (!r->elastic) return BATTEN_E_NOMEM;
  for (size_t k = 0; k < w->vertices && r->elastic_count < count; k++) {
    size_t i = slab_of(w, k);
    double amount = shortage_of(w, w->control, k);
    if (amount > 0) r->elastic[r->elastic_count++] = (loft_elastic){i, k - w->start[i], amount};
  }
  if (count > 0) qsort(r->elastic, count, sizeof *r->elastic, compare_elastic);
  return BATTEN_OK;
}

void loft_result_free(batten_context *ctx, loft_result *r) {
  batten_free(ctx, r->elastic);
  batten_free(ctx, r->y);
  *r = (loft_result){.y = NULL};
}

batten_status loft_rounds(batten_context *ctx, const loft_net *net, loft_objective *objective,
                          const batten_loft_options *opt, const double *free, double *seconds_rows,
                          double *seconds_qp, loft_result *out) {
  work w = {.ctx = ctx, .net = net, .opt = opt, .objective = objective, .free = free, .least = 1};
  batten_status st = work_start(&w);
  if (st < 0) goto done;
  w.rows.columns = 2 * net->z.columns;
  size_t failing;
  double start = batten_now(), shortage = whole_shortage(&w, w.control, &failing);
  w.seconds_rows += batten_now() - start;
  take(&w, loft_objective_value(objective, free), shortage);
  w.feasible = shortage == 0;
  bool more = !w.feasible && failing <= CROWD;
  for (unsigned round = 0; round < opt->rounds && more && (w.feasible || round < LOST); round++) {
    st = batten_progress(ctx, "quadratic program", (double)round / opt->rounds);
    if (st >= 0) st = solve_round(&w);
    if (st < 0) goto done;
    more = judge(&w);
    w.result.rounds = round + 1;
  }
  if (!w.feasible) st = settle(&w);
  if (st >= 0) st = name_elastic(&w);
  if (st < 0) goto done;
  w.result.feasible = w.feasible;
  w.result.iterations = w.program.iterations;
  w.result.y = w.best;
  w.best = NULL;
  *out = w.result;
  *seconds_rows += w.seconds_rows;
  *seconds_qp += w.seconds_qp;
done:
  if (st < 0) batten_free(ctx, w.result.elastic);
  work_free(&w);
  return st;
}
