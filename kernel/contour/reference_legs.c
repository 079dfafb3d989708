/* Construction 1: legs of prescribed directions.   [Juettler: contour data, section 2.2 (i)]
 *
 * The legs of the control polygon, divided by the lengths of their supports, are control points q_j of x', and the
 * turn from q_j to q_(j + 1) is the sign of a control point of x''. With directions that turn to the wanted side, by
 * less than a right angle (smoothness 1: than two), signs are right whatever the lengths. The lengths are found by
 * least squares.
 *
 * Departures from the paper, which turns the directions evenly within a run: they follow those of a smoothed curve,
 * as near as directions can that turn to the right side everywhere (a quadratic program in the angles). Evenly turned
 * ones cannot follow a frame with its flat side, bilge and flat bottom, nor a spiral. And the lengths of neighbours
 * may differ the less the less the legs turn, for where x'' is nearly parallel to x' no linear inequalities enclose
 * the curve; q_j of one length always pass. Unknowns are the control points rather than the lengths, so that
 * everything is banded:
 *   min sum |x(t_i) - p_i|^2   [r_j, q_j] = 0,   r_j q_j >= least,   ratio of r_j q_j and r_(j + 1) q_(j + 1) bounded
 */
#include "reference.h"

#include "base/checked.h"

#include <math.h>
#include <string.h>

static const double pi = 3.14159265358979323846;
/* Smoothing for the directions: from the first on by this factor, until the legs turn mostly to the right side. */
static const double smoothing_first = 1e-10, smoothing_most = 1e-2, smoothing_factor = 8, calm = 0.05;
/* A leg is at least this part of the mean one. */
static const double length_least = 0.02;

/* What is tried in turn. The last two are for fixed ends that only a curve with nearly all of its turn at one of them
 * can join. */
typedef struct attempt {
  double turn_most;  /* of neighbours, in units of turn_unit */
  double turn_least; /* of a run, as a part of what the smoothed curve has there; and at least this, radians */
  double ratio;      /* lengths of neighbours differ at most by this times their turn */
} attempt;
static const attempt attempts[] = {{1.5, 0.05, 3},   {0.9, 0.05, 3},   {1.5, 0.1, 1},  {0.9, 0.1, 1},
                                   {1.5, 0.2, 0.25}, {0.9, 0.2, 0.25}, {1.5, 0.2, 12}, {1.5, 0.2, 60}};

/* A degree higher gives more legs. That is tried when neighbours turn by more than so many right angles (smoothness
 * 1: 1.2 of them), for their turn is limited. */
static const double turn_many = 0.75;
static double turn_unit(const contour_shape *s) { return pi / 2 * (s->smoothness == 1 ? 1.2 : 1); }

typedef struct legs {
  const reference_task *task;
  contour_space space; /* with all equalities */
  size_t first, count; /* legs first .. first + count - 1; those of closed curves once */
  size_t vertices;     /* count - 1; closed: count, the last one leads back to the first leg */
  signed char *signs;  /* [vertices] of the turn from leg first + i to the next; 0: none */
  double *share;       /* [vertices] of the length of its run */
  double *turns;       /* [vertices] of the smoothed curve */
  double *wanted;      /* [count] its angles */
  double *weights;     /* [count] */
  double *angles;      /* [count] those of the reference */
  double whole, speed; /* closed: turn of a round; mean length of x' */
  double most;         /* of turns */
  bool far, unclear;   /* see read_turns; unclear: it makes a difference */
} legs;

static double support(const bspline *b, size_t leg) { return b->knots[leg + b->degree + 1] - b->knots[leg + 1]; }

/* Direction of x' that belongs to a leg. */
static void leg_vector(const bspline *b, const double *control, size_t leg, double q[2]) {
  double factor = b->degree / support(b, leg);
  for (size_t k = 0; k < 2; k++) q[k] = factor * (control[2 * leg + 2 + k] - control[2 * leg + k]);
}

/* Break at a knot, and the span right of it. */
static size_t break_of(const contour_shape *s, const bspline *b, size_t knot) {
  size_t fold = b->degree - s->smoothness;
  if (knot <= b->degree) return 0;
  if (knot >= b->count) return s->spans;
  return (knot - b->degree - 1) / fold + 1;
}

/* Sign of the control point of x'' between leg j and j + 1: its arguments are the knots j + 3 .. j + degree. */
static int vertex_sign(const contour_shape *s, const bspline *b, size_t j) {
  if (s->smoothness == 1) return s->signs[break_of(s, b, j + 2)];
  size_t from = break_of(s, b, j + 3), to = break_of(s, b, j + b->degree);
  if (from == to && contour_inflection(s, from)) return 0;
  return s->signs[from < s->spans ? from : s->spans - 1];
}

static void free_legs(batten_context *ctx, legs *g) {
  batten_free(ctx, g->angles);
  batten_free(ctx, g->weights);
  batten_free(ctx, g->wanted);
  batten_free(ctx, g->turns);
  batten_free(ctx, g->share);
  batten_free(ctx, g->signs);
  contour_space_free(ctx, &g->space);
}

/* Parts of each run, by the lengths of the supports. */
static void share_runs(legs *g) {
  const bspline *b = &g->space.b;
  for (size_t from = 0, to; from < g->vertices; from = to) {
    double sum = 0;
    for (to = from; to < g->vertices && g->signs[to] == g->signs[from]; to++) {
      size_t leg = g->first + to;
      g->share[to] = support(b, leg) + support(b, to + 1 < g->count ? leg + 1 : g->first);
      sum += g->share[to];
    }
    for (size_t i = from; i < to; i++) g->share[i] /= sum;
  }
}

static batten_status make_legs(batten_context *ctx, const reference_task *task, unsigned degree, legs *g) {
  const contour_shape *s = task->shape;
  *g = (legs){.task = task};
  batten_status st = contour_space_make(ctx, s, degree, s->smoothness == 2, task->ends, &g->space);
  if (st < 0) return st;
  size_t all = g->space.b.count - 1;
  /* Closed: with smoothness 2 the first and the last leg are the same combination of their neighbours. */
  g->first = s->closed && s->smoothness == 2;
  g->count = !s->closed ? all : s->smoothness == 2 ? all - 2 : all - 1;
  g->vertices = s->closed ? g->count : g->count - 1;
  g->signs = batten_alloc_array(ctx, g->count, sizeof *g->signs);
  g->share = batten_alloc_array(ctx, g->count, sizeof *g->share);
  g->turns = batten_alloc_array(ctx, g->count, sizeof *g->turns);
  g->wanted = batten_alloc_array(ctx, g->count, sizeof *g->wanted);
  g->weights = batten_alloc_array(ctx, g->count, sizeof *g->weights);
  g->angles = batten_alloc_array(ctx, g->count, sizeof *g->angles);
  if (!g->signs || !g->share || !g->turns || !g->wanted || !g->weights || !g->angles) return BATTEN_E_NOMEM;
  /* The last vertex of closed ones leads over the start: for smoothness 2 break 0, else it is the last span's. */
  for (size_t i = 0; i < g->vertices; i++)
    g->signs[i] = (signed char)(i + 1 < g->count     ? vertex_sign(s, &g->space.b, g->first + i)
                                : s->smoothness == 2 ? (contour_inflection(s, 0) ? 0 : s->signs[0])
                                                     : s->signs[s->spans - 1]);
  share_runs(g);
  return BATTEN_OK;
}

/* ---- directions of a smoothed curve ------------------------------------------------------------- */

/* Turns of a curve, and those to the wrong side as a part of all. What seems to turn almost back, to the wrong side,
 * is noise or, on few spans, more than half a turn to the right one: g->far says which it is taken for. */
static double read_turns(legs *g, const bspline *b, const double *control) {
  double right = 0, wrong = 0;
  bool back = false;
  g->most = 0;
  for (size_t i = 0; i < g->vertices; i++) {
    double u[2], v[2];
    leg_vector(b, control, g->first + i, u);
    leg_vector(b, control, i + 1 < g->count ? g->first + i + 1 : g->first, v);
    double turn = atan2(contour_cross(u, v), u[0] * v[0] + u[1] * v[1]);
    bool almost = fabs(turn) > 0.7 * pi;
    if (almost && g->far && g->signs[i] * turn < 0) turn += 2 * pi * g->signs[i];
    g->turns[i] = turn;
    g->most = fmax(g->most, fabs(turn));
    back = back || almost;
    if (g->signs[i] != 0) *(g->signs[i] * turn < 0 ? &wrong : &right) += fabs(turn);
  }
  g->unclear = g->unclear || back;
  double part = wrong / fmax(right + wrong, 1e-300);
  return back && !g->far ? 2 + part : part;
}

static void read_angles(legs *g, const bspline *b, const double *control) {
  double length = 0, u[2];
  for (size_t i = 0; i < g->count; i++) {
    leg_vector(b, control, g->first + i, u);
    g->wanted[i] = i ? g->wanted[i - 1] + g->turns[i - 1] : atan2(u[1], u[0]);
    g->weights[i] = hypot(u[0], u[1]) * support(b, g->first + i);
    length += g->weights[i];
  }
  g->speed = length / b->degree;
  for (size_t i = 0; i < g->count; i++) g->weights[i] = fmax(g->weights[i] / fmax(length, 1e-300), 1e-6);
  g->whole = 0;
  for (size_t i = 0; i < g->vertices; i++) g->whole += g->turns[i];
  g->whole = 2 * pi * round(g->whole / (2 * pi));
  bool both = false;
  for (size_t i = 1; i < g->vertices; i++) both = both || g->signs[i] * g->signs[0] < 0;
  if (g->whole == 0 && !both && g->vertices > 0) g->whole = 2 * pi * g->signs[0];
}

/* The curve of least smoothing whose legs turn mostly to the right side; if none, that with the least wrong turns.
 * *found: rounding, over spans that are much too short, left one. */
static batten_status smooth_angles(batten_context *ctx, legs *g, bool *found) {
  const reference_task *task = g->task;
  contour_space space = {0};
  contour_objective objective = {0};
  batten_status st = contour_space_make(ctx, task->shape, g->space.b.degree, false, task->ends, &space);
  if (st < 0) return st;
  double *control = batten_alloc_array(ctx, 4 * space.b.count, sizeof *control), least = INFINITY;
  double *best = control ? control + 2 * space.b.count : NULL;
  st = control ? contour_objective_new(ctx, &space.b, &objective) : BATTEN_E_NOMEM;
  for (double w = fmax(task->tension, smoothing_first); st >= 0 && least > calm; w *= smoothing_factor) {
    contour_objective_set(&objective, task->data, task->parameters, w);
    st = contour_objective_solve(ctx, &objective, &space, control);
    if (st == BATTEN_E_SINGULAR)
      st = batten_expect(ctx, st, BATTEN_E_SINGULAR);
    else if (st >= 0) {
      double wrong = read_turns(g, &space.b, control);
      if (wrong < least) {
        least = wrong;
        memcpy(best, control, 2 * space.b.count * sizeof *best);
      }
    }
    if (w > smoothing_most) break;
  }
  *found = least < INFINITY;
  if (st >= 0 && *found) {
    read_turns(g, &space.b, best);
    read_angles(g, &space.b, best);
  }
  batten_free(ctx, control);
  contour_objective_free(ctx, &objective);
  contour_space_free(ctx, &space);
  return st;
}

/* ---- quadratic programs ------------------------------------------------------------------------- */

/* Whether a program gave x. What keeps it from that is no error but for want of memory and the host's wish. */
static batten_status solve(batten_context *ctx, const batten_qp_problem *problem, double *x, bool *solved) {
  batten_qp_options opt = batten_qp_options_default();
  batten_qp_solution solution = {.x = x};
  batten_qp_info info;
  batten_status st = batten_qp_solve(ctx, problem, &opt, NULL, &solution, &info);
  *solved = st >= 0;
  if (st == BATTEN_W_STOPPED && info.cancelled) return batten_fail(ctx, BATTEN_E_CANCELLED, "cancelled by the host");
  if (st == BATTEN_E_NOMEM || st == BATTEN_E_CANCELLED || st == BATTEN_E_TOO_LARGE) return st;
  return BATTEN_OK;
}

typedef struct system {
  size_t rows;
  size_t *starts; /* [capacity + 1] */
  uint32_t *indices;
  double *values, *lower, *upper;
} system;

static void free_system(batten_context *ctx, system *s) {
  batten_free(ctx, s->upper);
  batten_free(ctx, s->lower);
  batten_free(ctx, s->values);
  batten_free(ctx, s->indices);
  batten_free(ctx, s->starts);
  *s = (system){0};
}

static batten_status make_system(batten_context *ctx, size_t rows, size_t entries, system *s) {
  size_t all;
  batten_mul(rows, entries, &all);
  *s = (system){0};
  s->starts = batten_alloc_array(ctx, rows + 1, sizeof *s->starts);
  s->indices = batten_alloc_array(ctx, all, sizeof *s->indices);
  s->values = batten_alloc_array(ctx, all, sizeof *s->values);
  s->lower = batten_alloc_array(ctx, rows, sizeof *s->lower);
  s->upper = batten_alloc_array(ctx, rows, sizeof *s->upper);
  if (!s->starts || !s->indices || !s->values || !s->lower || !s->upper) {
    free_system(ctx, s);
    return BATTEN_E_NOMEM;
  }
  s->starts[0] = 0;
  return BATTEN_OK;
}

static void begin_row(system *s, double lower, double upper) {
  s->lower[s->rows] = lower;
  s->upper[s->rows] = upper;
  s->starts[s->rows + 1] = s->starts[s->rows];
  s->rows++;
}

/* The last row takes in value times unknown `index`. */
static void add_entry(system *s, size_t index, double value) {
  size_t at = s->starts[s->rows - 1], end = s->starts[s->rows];
  while (at < end && s->indices[at] != index) at++;
  if (at == end) {
    s->indices[at] = (uint32_t)index;
    s->values[at] = 0;
    s->starts[s->rows]++;
  }
  s->values[at] += value;
}

/* ... value times coordinate k of control point j, which is a combination of unknowns. */
static void add_control(system *s, const contour_space *space, size_t j, size_t k, double value) {
  size_t row = 2 * j + k;
  for (size_t i = space->starts[row]; i < space->starts[row + 1]; i++)
    add_entry(s, space->indices[i], value * space->values[i]);
  s->lower[s->rows - 1] -= value * space->offset[row];
  s->upper[s->rows - 1] -= value * space->offset[row];
}

/* ... value times [r, q] (across) or r q of leg first + i, q in units of the mean speed. */
static void add_leg(system *s, const legs *g, size_t i, bool across, double value) {
  const bspline *b = &g->space.b;
  size_t leg = g->first + i;
  double factor = value * b->degree / (support(b, leg) * g->speed), c = cos(g->angles[i]), n = sin(g->angles[i]);
  double r[2] = {across ? -n : c, across ? c : n};
  for (size_t k = 0; k < 2; k++) {
    add_control(s, &g->space, leg + 1, k, factor * r[k]);
    add_control(s, &g->space, leg, k, -factor * r[k]);
  }
}

/* Most entries of a row of Z. */
static size_t widest(const contour_space *space) {
  size_t most = 0;
  for (size_t row = 0; row < 2 * space->b.count; row++) {
    size_t count = space->starts[row + 1] - space->starts[row];
    if (count > most) most = count;
  }
  return most;
}

/* ---- directions --------------------------------------------------------------------------------- */

static bool tangent_fixed(const contour_ends *ends, int end) { return ends && !isnan(ends->tangent[end][0]); }

/* Bounds of the angles: those of fixed tangents, the turn of them nearest to what is wanted. */
static void bound_angles(const legs *g, double *lower, double *upper) {
  const contour_ends *ends = g->task->ends;
  for (size_t i = 0; i < g->count; i++) {
    lower[i] = -INFINITY;
    upper[i] = INFINITY;
  }
  for (int end = 0; end < 2 && !g->task->shape->closed; end++) {
    if (!tangent_fixed(ends, end)) continue;
    size_t i = end ? g->count - 1 : 0;
    double angle = atan2(ends->tangent[end][1], ends->tangent[end][0]);
    lower[i] = upper[i] = angle + 2 * pi * round((g->wanted[i] - angle) / (2 * pi));
  }
}

/* The least turn of each vertex, [vertices]: its share of the least of its run. */
static void least_turns(const legs *g, const attempt *a, double *least) {
  for (size_t from = 0, to; from < g->vertices; from = to) {
    double turn = 0;
    for (to = from; to < g->vertices && g->signs[to] == g->signs[from]; to++) turn += g->turns[to] * g->signs[from];
    for (size_t i = from; i < to; i++) least[i] = g->share[i] * a->turn_least * fmax(1, turn);
  }
}

/* Angles nearest to those wanted that turn to the right side: g->angles. */
static batten_status find_angles(batten_context *ctx, legs *g, const attempt *a, bool *solved) {
  size_t n = g->count;
  double most = a->turn_most * turn_unit(g->task->shape);
  system rows = {0}, points = {0};
  double *work = batten_alloc_array(ctx, n, 3 * sizeof *work);
  batten_status st = work ? make_system(ctx, g->vertices, 2, &rows) : BATTEN_E_NOMEM;
  if (st >= 0) st = make_system(ctx, n, 1, &points);
  if (st < 0) goto done;
  double *lower = work, *upper = work + n, *least = work + 2 * n;
  bound_angles(g, lower, upper);
  least_turns(g, a, least);
  for (size_t i = 0; i < n; i++) {
    begin_row(&points, g->wanted[i], 0);
    add_entry(&points, i, 1);
  }
  for (size_t i = 0; i < g->vertices; i++) {
    int sign = g->signs[i];
    double back = i + 1 < n ? 0 : g->whole;
    begin_row(&rows,
              (sign > 0   ? least[i]
               : sign < 0 ? -most
                          : 0) -
                  back,
              (sign > 0   ? most
               : sign < 0 ? -least[i]
                          : 0) -
                  back);
    add_entry(&rows, i, -1);
    add_entry(&rows, i + 1 < n ? i + 1 : 0, 1);
  }
  batten_matrix am = batten_matrix_sparse(n, n, points.starts, points.indices, points.values);
  batten_matrix cm = batten_matrix_sparse(rows.rows, n, rows.starts, rows.indices, rows.values);
  batten_qp_problem problem = batten_qp_problem_default(n);
  problem.a = &am;
  problem.b = points.lower;
  problem.weights = g->weights;
  problem.c = &cm;
  problem.lower = rows.lower;
  problem.upper = rows.upper;
  problem.x_lower = lower;
  problem.x_upper = upper;
  st = solve(ctx, &problem, g->angles, solved);
done:
  free_system(ctx, &points);
  free_system(ctx, &rows);
  batten_free(ctx, work);
  return st;
}

/* ---- lengths ------------------------------------------------------------------------------------ */

/* Rows of the least squares: points, then x'' at places of each span with the weight of the tension. The wanted
 * values are in `lower`. */
static batten_status make_points(batten_context *ctx, const legs *g, size_t *count, system *s, double **weights) {
  const contour_data *data = g->task->data;
  const bspline *b = &g->space.b;
  unsigned d = b->degree, places = d - 1;
  double table[3 * BSPLINE_ORDER], total = 0, tension = fmax(g->task->tension, smoothing_first);
  size_t rows = 2 * (data->count + places * g->task->shape->spans), at = 0;
  *count = rows;
  *weights = batten_alloc_array(ctx, rows, sizeof **weights);
  if (!*weights) return BATTEN_E_NOMEM;
  batten_status st = make_system(ctx, rows, (d + 1) * widest(&g->space), s);
  if (st < 0) return st;
  for (size_t i = 0; i < data->count; i++) total += data->weights ? data->weights[i] : 1;
  for (size_t i = 0; i < data->count; i++) {
    size_t mu = bspline_span(b, g->task->parameters[i]);
    bspline_basis(b, mu, g->task->parameters[i], 0, table);
    for (size_t k = 0; k < 2; k++) {
      (*weights)[at++] = (data->weights ? data->weights[i] : 1) / total;
      begin_row(s, data->points[2 * i + k], 0);
      for (unsigned j = 0; j <= d; j++) add_control(s, &g->space, mu - d + j, k, table[j]);
    }
  }
  for (size_t mu = bspline_first(b); mu < b->count; mu = bspline_next(b, mu))
    for (unsigned place = 0; place < places; place++) {
      double part = (place + 0.5) / places, h = b->knots[mu + 1] - b->knots[mu];
      bspline_basis(b, mu, b->knots[mu] + part * h, 2, table);
      for (size_t k = 0; k < 2; k++) {
        (*weights)[at++] = tension * h / places;
        begin_row(s, 0, 0);
        for (unsigned j = 0; j <= d; j++) add_control(s, &g->space, mu - d + j, k, table[2 * (d + 1) + j]);
      }
    }
  return BATTEN_OK;
}

/* A leg has its direction already: that of the one before at an inflection, or a fixed tangent. */
static bool directed(const legs *g, size_t i) {
  if (i > 0 && g->signs[i - 1] == 0) return true;
  if (g->task->shape->closed) return i + 1 == g->count && g->signs[i] == 0;
  return (i == 0 && tangent_fixed(g->task->ends, 0)) || (i + 1 == g->count && tangent_fixed(g->task->ends, 1));
}

static batten_status make_rows(batten_context *ctx, const legs *g, const attempt *a, system *s) {
  size_t n = g->count;
  batten_status st = make_system(ctx, 2 * n + 2 * g->vertices, 8 * widest(&g->space), s);
  if (st < 0) return st;
  for (size_t i = 0; i < n; i++) {
    if (!directed(g, i)) {
      begin_row(s, 0, 0);
      add_leg(s, g, i, true, 1);
    }
    begin_row(s, length_least, INFINITY);
    add_leg(s, g, i, false, 1);
  }
  for (size_t i = 0; i < g->vertices; i++) {
    size_t next = i + 1 < n ? i + 1 : 0;
    if (g->signs[i] == 0) continue;
    double turn = g->angles[next] - g->angles[i] + (next ? 0 : g->whole), ratio = 1 + a->ratio * fabs(turn);
    for (int side = 0; side < 2; side++) {
      begin_row(s, 0, INFINITY);
      add_leg(s, g, i, false, side ? ratio : -1);
      add_leg(s, g, next, false, side ? -1 : ratio);
    }
  }
  return BATTEN_OK;
}

/* Control points of the curve with these directions that is nearest to the data. */
static batten_status find_lengths(batten_context *ctx, legs *g, const attempt *a, double *control, bool *solved) {
  size_t n = g->space.unknowns, count = 0;
  system points = {0}, rows = {0};
  double *weights = NULL, *y = batten_alloc_array(ctx, n, sizeof *y);
  batten_status st = y ? make_points(ctx, g, &count, &points, &weights) : BATTEN_E_NOMEM;
  if (st >= 0) st = make_rows(ctx, g, a, &rows);
  if (st < 0) goto done;
  batten_matrix am = batten_matrix_sparse(count, n, points.starts, points.indices, points.values);
  batten_matrix cm = batten_matrix_sparse(rows.rows, n, rows.starts, rows.indices, rows.values);
  batten_qp_problem problem = batten_qp_problem_default(n);
  problem.a = &am;
  problem.b = points.lower;
  problem.weights = weights;
  problem.c = &cm;
  problem.lower = rows.lower;
  problem.upper = rows.upper;
  st = solve(ctx, &problem, y, solved);
  if (st >= 0 && *solved) contour_space_expand(&g->space, y, control);
done:
  free_system(ctx, &rows);
  free_system(ctx, &points);
  batten_free(ctx, weights);
  batten_free(ctx, y);
  return st;
}

/* The first attempt that inequalities accept: into control, where it is nearer to the data than *sum, which becomes
 * its own. */
static batten_status try_attempts(batten_context *ctx, legs *g, double *control, double *sum) {
  const reference_task *task = g->task;
  size_t n = 2 * task->space->b.count;
  double *reference = batten_alloc_array(ctx, 2 * g->space.b.count, sizeof *reference);
  double *trial = batten_alloc_array(ctx, n, sizeof *trial);
  batten_status st = reference && trial ? BATTEN_OK : BATTEN_E_NOMEM;
  bool accepted = false;
  for (size_t k = 0; st >= 0 && !accepted && k < sizeof attempts / sizeof *attempts; k++) {
    bool solved = false;
    st = batten_progress(ctx, "reference", 0.5 + 0.05 * (double)k);
    if (st >= 0) st = find_angles(ctx, g, &attempts[k], &solved);
    if (st >= 0 && solved) st = find_lengths(ctx, g, &attempts[k], reference, &solved);
    if (st >= 0 && solved) st = reference_accept(ctx, task, &g->space.b, reference, trial, &accepted);
  }
  if (st >= 0 && accepted) {
    double own = contour_sum(&task->space->b, trial, task->data, task->parameters);
    if (own < *sum) {
      *sum = own;
      memcpy(control, trial, n * sizeof *control);
    }
  }
  batten_free(ctx, trial);
  batten_free(ctx, reference);
  return st;
}

batten_status reference_by_legs(batten_context *ctx, const reference_task *task, double *control, double *sum) {
  batten_status st = BATTEN_OK;
  unsigned last = task->degree + REFERENCE_MORE_DEGREES;
  bool enough = false;
  *sum = INFINITY;
  for (unsigned degree = task->degree; st >= 0 && !enough && degree <= last; degree++) {
    if (degree > task->shape->degree) break;
    legs g;
    st = make_legs(ctx, task, degree, &g);
    double most = 0;
    for (int far = 0; st >= 0 && far < 2 && (far == 0 || g.unclear); far++) {
      g.far = far;
      bool found = false;
      st = smooth_angles(ctx, &g, &found);
      if (st >= 0 && found) st = try_attempts(ctx, &g, control, sum);
      most = fmax(most, g.most);
    }
    enough = *sum < INFINITY && !g.unclear && most < turn_many * turn_unit(task->shape);
    free_legs(ctx, &g);
  }
  return st;
}
