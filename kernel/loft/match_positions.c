/* One parameter for each track.
 *
 * Between two neighbouring tracks of a slice, ds of its length apart, parameters run (t_b - t_a) / ds times as fast
 * as the length. What is least is, over all slices, integral of log(dt / ds)^2 dt  ~  sum (t_b - t_a - ds)^2 / (t_b -
 * t_a), the denominators from the solution before, and a little of (t - s)^2, under the inequalities that tracks that
 * meet keep their order and a distance. These have a solution: tracks do not cross, so "left of" has no cycles.
 *
 * Tracks of different slices that came to lie near to each other then share a line, for each line is a knot of all
 * slices; and lines, in the order in which they lie, are placed once more. */
#include <string.h>

#include <batten/matrix.h>
#include <batten/qp.h>

#include "base/checked.h"
#include "match.h"

enum { PASSES = 4 };
static const double ANCHOR = 0.3;     /* weight of (t - s)^2 */
static const double SAME_LINE = 0.03; /* t of tracks that may share a line */

/* Rows of one or two entries +1, -1 of lines. */
typedef struct rows {
  size_t count, *starts;
  uint32_t *indices;
  double *values, *right, *weights;
} rows;

static batten_status rows_new(batten_context *ctx, size_t room, rows *out) {
  *out = (rows){0};
  out->starts = batten_alloc_array(ctx, room + 1, sizeof *out->starts);
  out->indices = batten_alloc_array(ctx, room, 2 * sizeof *out->indices);
  out->values = batten_alloc_array(ctx, room, 2 * sizeof *out->values);
  out->right = batten_alloc_array(ctx, room, sizeof *out->right);
  out->weights = batten_alloc_array(ctx, room, sizeof *out->weights);
  if (!out->starts || !out->indices || !out->values || !out->right || !out->weights) return BATTEN_E_NOMEM;
  out->starts[0] = 0;
  return BATTEN_OK;
}

static void rows_free(batten_context *ctx, rows *r) {
  batten_free(ctx, r->weights);
  batten_free(ctx, r->right);
  batten_free(ctx, r->values);
  batten_free(ctx, r->indices);
  batten_free(ctx, r->starts);
  *r = (rows){0};
}

/* (t of line to, or 0) - (t of line from, or 0) beside right. */
static void add_row(rows *r, size_t from, size_t to, double right, double weight) {
  size_t at = r->starts[r->count];
  if (to != MATCH_NONE) {
    r->indices[at] = (uint32_t)to;
    r->values[at++] = 1;
  }
  if (from != MATCH_NONE) {
    r->indices[at] = (uint32_t)from;
    r->values[at++] = -1;
  }
  r->right[r->count] = right;
  r->weights[r->count] = weight;
  r->starts[++r->count] = at;
}

static batten_matrix matrix_of(const rows *r, size_t columns) {
  return batten_matrix_sparse(r->count, columns, r->starts, r->indices, r->values);
}

/* ---- the program --------------------------------------------------------------------------------- */

/* A step between neighbouring inflections, or to an end. In t: t[to] - t[from] + turn. */
typedef struct step {
  size_t from, to; /* lines, MATCH_NONE: an end */
  double turn;
  double length; /* of the slice */
} step;

static size_t step_count(const match_stack *s, const match_slice *slice) {
  return slice->bend_count + (s->closed ? 0 : 1);
}

/* From inflection j - 1 to j. */
static step step_at(const match_stack *s, const match_slice *slice, size_t j) {
  size_t n = slice->bend_count;
  const match_bend *a = j > 0 ? slice->bends + j - 1 : s->closed ? slice->bends + n - 1 : NULL;
  const match_bend *b = j < n ? slice->bends + j : NULL;
  step out = {MATCH_NONE, MATCH_NONE, s->closed && j == 0 ? 1 : 0, 0};
  out.length = (b ? b->at : 1) - (a ? a->at : 0) + out.turn;
  if (!b) out.turn += 1;
  if (a) {
    out.from = s->line[a->track];
    out.turn += a->lift;
  }
  if (b) {
    out.to = s->line[b->track];
    out.turn -= b->lift;
  }
  return out;
}

static double step_size(const step *p, const double *t) {
  return (p->to != MATCH_NONE ? t[p->to] : 0) - (p->from != MATCH_NONE ? t[p->from] : 0) + p->turn;
}

/* What t are to be. t NULL: the first time. */
static void add_wishes(const match_stack *s, const double *t, double gap, rows *r) {
  for (size_t i = 0; i < s->count; i++) {
    const match_slice *slice = s->slices + i;
    for (size_t j = 0; j < step_count(s, slice) && slice->bend_count > 0; j++) {
      step p = step_at(s, slice, j);
      double size = fmax(t ? step_size(&p, t) : p.length, gap);
      add_row(r, p.from, p.to, p.length - p.turn, 1 / size);
    }
    for (size_t j = 0; j < slice->bend_count; j++) {
      const match_bend *b = slice->bends + j;
      add_row(r, MATCH_NONE, s->line[b->track], b->at + b->lift, ANCHOR);
    }
  }
}

/* Steps of slices, or of the lines as they lie, are no shorter than gap. */
static void add_needs(const match_stack *s, bool in_order, double gap, rows *r) {
  size_t n = s->line_count;
  for (size_t i = 0; i < s->count && !in_order; i++)
    for (size_t j = 0; j < step_count(s, s->slices + i) && s->slices[i].bend_count > 0; j++) {
      step p = step_at(s, s->slices + i, j);
      add_row(r, p.from, p.to, gap - p.turn, 1);
    }
  for (size_t k = 1; k < n && in_order; k++) add_row(r, k - 1, k, gap, 1);
  if (in_order && s->closed && n > 1) add_row(r, n - 1, 0, gap - 1, 1);
  if (in_order && !s->closed) {
    add_row(r, MATCH_NONE, 0, gap, 1);
    add_row(r, n - 1, MATCH_NONE, gap - 1, 1);
  }
}

static batten_status solve(batten_context *ctx, size_t n, const rows *wishes, const rows *needs, double *t) {
  batten_matrix a = matrix_of(wishes, n), c = matrix_of(needs, n);
  batten_qp_problem problem = batten_qp_problem_default(n);
  problem.a = &a;
  problem.b = wishes->right;
  problem.weights = wishes->weights;
  problem.c = &c;
  problem.lower = needs->right;
  batten_qp_solution solution = {.x = t};
  batten_qp_info info;
  batten_status st = batten_qp_solve(ctx, &problem, NULL, NULL, &solution, &info);
  if (st == BATTEN_W_STOPPED && info.cancelled)
    return batten_fail(ctx, BATTEN_E_CANCELLED, "cancelled by the host during slices");
  if (st == BATTEN_E_NOMEM || st == BATTEN_E_TOO_LARGE || st == BATTEN_E_CANCELLED || st == BATTEN_OK) return st;
  if (st == BATTEN_W_ACCURACY) return batten_expect(ctx, st, BATTEN_W_ACCURACY);
  return batten_fail(ctx, BATTEN_E_INTERNAL, "tracks of inflections have no order");
}

/* t of all lines. */
static batten_status place(batten_context *ctx, const match_stack *s, bool in_order, double *t) {
  size_t room = 2;
  for (size_t i = 0; i < s->count; i++) room += 2 * s->slices[i].bend_count + 1;
  room += s->line_count;
  double gap = match_gap(s->line_count);
  rows wishes = {0}, needs = {0};
  batten_status st = rows_new(ctx, room, &wishes);
  if (st >= 0) st = rows_new(ctx, room, &needs);
  if (st >= 0) add_needs(s, in_order, gap, &needs);
  for (int pass = 0; pass < PASSES && st >= 0; pass++) {
    wishes.count = 0;
    add_wishes(s, pass ? t : NULL, gap, &wishes);
    st = solve(ctx, s->line_count, &wishes, &needs, t);
  }
  rows_free(ctx, &needs);
  rows_free(ctx, &wishes);
  return st;
}

/* ---- lines --------------------------------------------------------------------------------------- */

/* Tracks by t in [0, 1): closed ones go round by whole turns, with their inflections. */
static void reduce(match_stack *s, double *t) {
  if (!s->closed) return;
  for (size_t i = 0; i < s->count; i++)
    for (size_t j = 0; j < s->slices[i].bend_count; j++) {
      match_bend *b = s->slices[i].bends + j;
      b->lift -= floor(t[s->line[b->track]]);
    }
  for (size_t k = 0; k < s->line_count; k++) t[k] -= floor(t[k]);
}

/* Numbers [n] so that t ascends; equal ones as they were. */
static void sort_by(const double *t, size_t n, size_t *order) {
  for (size_t k = 0; k < n; k++) {
    size_t at = k;
    for (; at > 0 && t[order[at - 1]] > t[k]; at--) order[at] = order[at - 1];
    order[at] = k;
  }
}

/* Whether two tracks are in neighbouring slices somewhere, or in one: then at one t they would be partners. */
static bool meet(const match_stack *s, size_t a, size_t b) {
  return s->first[a] <= s->last[b] + 1 && s->first[b] <= s->last[a] + 1;
}

/* Tracks that lie next to each other and near, and do not meet, share a line. t is of tracks, then of lines. */
static void join_tracks(match_stack *s, const size_t *order, double *t, double *room) {
  size_t n = s->track_count, lines = 0;
  for (size_t k = 0; k < n; lines++) {
    size_t end = k + 1;
    for (bool fits = true; end < n && fits;) {
      fits = t[order[end]] - t[order[k]] < SAME_LINE;
      for (size_t j = k; j < end && fits; j++) fits = !meet(s, order[j], order[end]);
      if (fits) end++;
    }
    double sum = 0;
    for (size_t j = k; j < end; j++) {
      s->line[order[j]] = lines;
      sum += t[order[j]];
    }
    room[lines] = sum / (double)(end - k);
    k = end;
  }
  s->line_count = lines;
  memcpy(t, room, lines * sizeof *t);
}

/* Where t = 0 is to be: as it is, or a little to the side, so that no line is near. */
static double find_origin(const match_stack *s, const double *t) {
  double above = 1, below = 0;
  for (size_t k = 0; k < s->line_count; k++) {
    double at = t[k] - floor(t[k]);
    above = fmin(above, at);
    below = fmax(below, at);
  }
  below -= 1;
  double clear = fmin(2 * match_gap(s->line_count), 0.5 * (above - below));
  return fmin(fmax(0, below + clear), above - clear);
}

/* t from the origin on, in [0, 1), ascending. */
static void set_origin(match_stack *s, double *t, size_t *order, double *room) {
  size_t n = s->line_count;
  s->origin = find_origin(s, t);
  for (size_t i = 0; i < s->count; i++)
    for (size_t j = 0; j < s->slices[i].bend_count; j++) {
      match_bend *b = s->slices[i].bends + j;
      b->lift -= floor(t[s->line[b->track]] - s->origin);
    }
  for (size_t k = 0; k < n; k++) room[k] = t[k] - s->origin - floor(t[k] - s->origin);
  sort_by(room, n, order);
  size_t *place_of = s->first; /* tracks' slices have served */
  for (size_t k = 0; k < n; k++) {
    t[k] = room[order[k]];
    place_of[order[k]] = k;
  }
  for (size_t k = 0; k < s->track_count; k++) s->line[k] = place_of[s->line[k]];
}

batten_status match_positions(batten_context *ctx, match_stack *s) {
  size_t n = s->track_count;
  double *t = batten_alloc_array(ctx, n, sizeof *t), *room = batten_alloc_array(ctx, n, sizeof *room);
  size_t *order = batten_alloc_array(ctx, n, sizeof *order);
  batten_status st = t && room && order ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st < 0 || n == 0) goto done;
  for (size_t k = 0; k < n; k++) s->line[k] = k;
  s->line_count = n;
  st = place(ctx, s, false, t);
  if (st < 0) goto done;
  reduce(s, t);
  sort_by(t, n, order);
  join_tracks(s, order, t, room);
  st = place(ctx, s, true, t);
  if (st >= 0 && s->closed) set_origin(s, t, order, room);
done:
  if (st >= 0) {
    s->t = t;
    t = NULL;
  }
  batten_free(ctx, order);
  batten_free(ctx, room);
  batten_free(ctx, t);
  return st;
}
