/* Convex surfaces from scattered points.   [Juettler 1998]
 *
 * The points are moved and scaled by a power of two to size 1. A reference surface is searched for; then, round by
 * round, inequalities are written around the reference, the quadratic program is solved, the points go to their
 * nearest places. The next reference is the best surface so far blended with the reference before: that lies strictly
 * inside the inequalities. Where a round gains too little the blend shrinks, so that the next reference is nearer to
 * the best surface, before the rounds end. Beside it the fit without inequalities takes the same rounds.
 *
 * What comes out is proven by batten_surface_certify_convex. Whether the points are those of a convex surface at all is
 * asked of the points themselves (judge.c) and of the unconstrained fit. */
#include "fit_inner.h"

#include "base/checked.h"
#include "basis/eigen3.h"
#include "mesh/vec.h"
#include "plane.h"
#include "surface/surface_inner.h"

#include <float.h>
#include <string.h>

/* Beyond these the points are no convex surface's, whatever their noise. A plane that is bent a little is held to
 * less, since it is there only for want of a better reference. */
static const double BENT_EXCESS = 2, EXCESS = 3;

typedef struct fit {
  batten_context *ctx;
  const batten_convex_options *opt;
  convex_row_options row_options;
  size_t count;
  double domain[2][2];
  double middle[3], unit;                   /* scaled = (point - middle) * unit */
  double weight_unit, total;                /* scaled weight = weight * weight_unit; their sum */
  double w;                                 /* tension beside the sum */
  double *points, *weights;                 /* scaled; weights NULL = ones */
  double *knots, *parameters;               /* the first ones, in [0, 1]^2 */
  double *free, *trial, *reference, *older; /* control points */
  double *places, *squares;
  convex_space space;
  convex_objective objective;
  convex_program program;
  convex_rows rows;
  bool have_rows;
  bool flat;     /* the points are a plane's */
  bool limited;  /* a reference was refused for its number of inequalities */
  bool bent;     /* the first reference: only the end tells whether the data have a convex surface */
  double excess; /* how many times as far the points are from the surface as noise is, root mean square */
  convex_verdict verdict;
  convex_track convex, unconstrained;
  batten_convex_info info;
} fit;

static batten_status make_track(fit *f, convex_track *t) {
  t->control = batten_alloc_array(f->ctx, 3 * convex_points(&f->space), sizeof *t->control);
  t->parameters = batten_alloc_array(f->ctx, 2 * f->count, sizeof *t->parameters);
  t->squares = batten_alloc_array(f->ctx, f->count, sizeof *t->squares);
  t->sum = INFINITY;
  return t->control && t->parameters && t->squares ? BATTEN_OK : BATTEN_E_NOMEM;
}

static void free_track(fit *f, convex_track *t) {
  batten_free(f->ctx, t->squares);
  batten_free(f->ctx, t->parameters);
  batten_free(f->ctx, t->control);
}

static void free_rows(fit *f) {
  if (f->have_rows) convex_rows_free(f->ctx, &f->rows);
  f->have_rows = false;
}

static void free_fit(fit *f) {
  free_rows(f);
  free_track(f, &f->unconstrained);
  free_track(f, &f->convex);
  convex_program_free(f->ctx, &f->program);
  convex_objective_free(f->ctx, &f->objective);
  double *blocks[] = {f->points, f->weights,   f->knots, f->parameters, f->free,
                      f->trial,  f->reference, f->older, f->places,     f->squares};
  for (size_t i = sizeof blocks / sizeof *blocks; i-- > 0;) batten_free(f->ctx, blocks[i]);
}

/* ---- in ----------------------------------------------------------------------------------------- */

static void scale_points(fit *f, const double *points) {
  double lower[3], upper[3], size = 0;
  for (int k = 0; k < 3; k++) lower[k] = upper[k] = points[k];
  for (size_t i = 0; i < 3 * f->count; i++) {
    lower[i % 3] = fmin(lower[i % 3], points[i]);
    upper[i % 3] = fmax(upper[i % 3], points[i]);
  }
  for (int k = 0; k < 3; k++) {
    f->middle[k] = lower[k] + (upper[k] - lower[k]) / 2;
    size = fmax(size, upper[k] - lower[k]);
  }
  f->unit = batten_unit(size);
  for (size_t i = 0; i < 3 * f->count; i++) f->points[i] = (points[i] - f->middle[i % 3]) * f->unit;
}

static void scale_weights(fit *f) {
  double largest = 0;
  f->weight_unit = 1;
  f->total = (double)f->count;
  if (!f->opt->weights) return;
  for (size_t i = 0; i < f->count; i++) largest = fmax(largest, f->opt->weights[i]);
  f->weight_unit = batten_unit(largest);
  f->total = 0;
  for (size_t i = 0; i < f->count; i++) f->total += f->weights[i] = f->opt->weights[i] * f->weight_unit;
}

/* Parameters in [0, 1]^2, and the domain. */
static batten_status find_parameters(fit *f, const double *points) {
  batten_status st = BATTEN_OK;
  const double *given = f->opt->parameters;
  double begin = batten_now();
  if (!given) st = batten_parametrize(f->ctx, f->count, points, &f->opt->parametrize, f->parameters);
  f->info.time_parameters_s = batten_now() - begin;
  if (st < 0) return st;
  batten_convex_options unit = *f->opt; /* what is estimated lies in [0, 1]^2, whatever the domain of the surface */
  if (!given)
    for (int k = 0; k < 4; k++) unit.domain[k / 2][k % 2] = k % 2;
  st = convex_domain(f->ctx, f->count, given ? given : f->parameters, &unit, f->domain);
  if (st < 0) return st;
  for (size_t i = 0; i < 2 * f->count && given; i++) {
    const double *d = f->domain[i % 2];
    f->parameters[i] = (given[i] - d[0]) / (d[1] - d[0]);
  }
  return BATTEN_OK;
}

/* The domain that the caller sees where parameters are estimated: [0, 1]^2 where it is to be their box. */
static batten_status check_domain(fit *f) {
  size_t absent = 0;
  for (int k = 0; k < 4; k++) absent += isnan(f->opt->domain[k / 2][k % 2]) ? 1 : 0;
  if (f->opt->parameters || absent == 4) return BATTEN_OK;
  memcpy(f->domain, f->opt->domain, sizeof f->domain);
  return convex_domain_check(f->ctx, f->opt->domain);
}

static batten_status make_space(fit *f) {
  size_t knots[2];
  unsigned smooth[2];
  for (int k = 0; k < 2; k++) {
    smooth[k] = f->opt->smoothness[k] ? f->opt->smoothness[k] : f->opt->degree[k] - 1;
    knots[k] = bspline_make_knots(f->opt->degree[k], smooth[k], f->opt->spans[k], NULL, 0, 1, NULL);
  }
  f->knots = batten_alloc_array(f->ctx, knots[0] + knots[1], sizeof *f->knots);
  if (!f->knots) return BATTEN_E_NOMEM;
  for (int k = 0; k < 2; k++) {
    double *at = f->knots + (k ? knots[0] : 0);
    bspline_make_knots(f->opt->degree[k], smooth[k], f->opt->spans[k], NULL, 0, 1, at);
    f->space.axis[k] = (bspline){f->opt->degree[k], knots[k] - f->opt->degree[k] - 1, at};
  }
  return BATTEN_OK;
}

static batten_status begin(fit *f, const double *points) {
  size_t count = f->count;
  f->points = batten_alloc_array(f->ctx, 3 * count, sizeof(double));
  f->weights = f->opt->weights ? batten_alloc_array(f->ctx, count, sizeof(double)) : NULL;
  f->parameters = batten_alloc_array(f->ctx, 2 * count, sizeof(double));
  f->places = batten_alloc_array(f->ctx, 2 * count, sizeof(double));
  f->squares = batten_alloc_array(f->ctx, count, sizeof(double));
  if (!f->points || !f->parameters || !f->places || !f->squares || (f->opt->weights && !f->weights))
    return BATTEN_E_NOMEM;
  batten_status st = find_parameters(f, points);
  if (st >= 0) st = check_domain(f);
  if (st >= 0) st = make_space(f);
  if (st < 0) return st;
  scale_points(f, points);
  scale_weights(f);
  f->w = f->opt->tension * f->total;
  size_t n = convex_points(&f->space);
  f->info.unknowns = 3 * n;
  double **blocks[] = {&f->free, &f->trial, &f->reference, &f->older};
  for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++)
    if (!(*blocks[i] = batten_alloc_array(f->ctx, 3 * n, sizeof(double)))) return BATTEN_E_NOMEM;
  st = make_track(f, &f->convex);
  if (st >= 0) st = make_track(f, &f->unconstrained);
  if (st >= 0) st = convex_objective_new(f->ctx, &f->space, count, f->points, f->weights, &f->objective);
  return st < 0 ? st : convex_program_new(f->ctx, &f->space, &f->program);
}

/* ---- rounds ------------------------------------------------------------------------------------- */

static double weight_of(const fit *f, size_t i) { return f->weights ? f->weights[i] : 1; }

static double weighted_sum(const fit *f, const double *squares) {
  double sum = 0;
  for (size_t i = 0; i < f->count; i++) sum += weight_of(f, i) * squares[i];
  return sum;
}

/* Points go to nearer places of `control` from `from`; the track takes that over if its sum drops. */
static bool offer(fit *f, convex_track *t, const double *control, const double *from) {
  double start = batten_now();
  memcpy(f->places, from, 2 * f->count * sizeof *f->places);
  convex_correct(f->ctx, &f->space, control, f->count, f->points, f->opt->correction_passes, f->places, f->squares);
  f->info.time_correction_s += batten_now() - start;
  double sum = weighted_sum(f, f->squares);
  if (!(sum < t->sum)) return false;
  t->sum = sum;
  memcpy(t->control, control, 3 * convex_points(&f->space) * sizeof *control);
  memcpy(t->parameters, f->places, 2 * f->count * sizeof *f->places);
  memcpy(t->squares, f->squares, f->count * sizeof *f->squares);
  return true;
}

/* reference = (1 - blend) best + blend older */
static void blend(fit *f, double part) {
  for (size_t i = 0; i < 3 * convex_points(&f->space); i++)
    f->reference[i] = (1 - part) * f->convex.control[i] + part * f->older[i];
}

/* Rows around the best surface, blended with the reference before by `part` or, where the generator cannot enclose
 * that, by more; in the end the rows before stay. */
static batten_status next_rows(fit *f, double part) {
  double start = batten_now();
  size_t bytes = 3 * convex_points(&f->space) * sizeof(double);
  batten_status st = BATTEN_OK;
  bool accepted = false;
  convex_rows rows;
  memcpy(f->older, f->reference, bytes);
  for (; !accepted && part < 1 && st >= 0; part = fmax(2 * part, 0.25)) {
    blend(f, part);
    st = convex_rows_make(f->ctx, &f->space, f->reference, &f->row_options, &accepted, &rows);
  }
  if (st >= 0 && accepted) {
    free_rows(f);
    f->rows = rows;
    f->have_rows = true;
  } else
    memcpy(f->reference, f->older, bytes);
  f->info.time_rows_s += batten_now() - start;
  return st;
}

static batten_status first_rows(fit *f) {
  bool accepted = false;
  double start = batten_now();
  batten_status st = convex_rows_make(f->ctx, &f->space, f->reference, &f->row_options, &accepted, &f->rows);
  f->info.time_rows_s += batten_now() - start;
  if (st >= 0 && !accepted)
    return batten_fail(f->ctx, BATTEN_E_INTERNAL, "the reference surface lost its inequalities");
  f->have_rows = st >= 0;
  return st;
}

/* Whether the minimum without inequalities is convex by itself. */
static batten_status free_is_convex(fit *f, bool *convex) {
  double start = batten_now();
  batten_status st = convex_is_convex(f->ctx, &f->space, f->free, &f->row_options, convex);
  f->info.time_rows_s += batten_now() - start;
  return st;
}

/* One round of the convex track: f->trial. */
static batten_status solve_round(fit *f, unsigned round, double part) {
  bool convex = false, solved = false;
  convex_objective_set(&f->objective, &f->space, f->convex.parameters);
  batten_status st = convex_objective_solve(f->ctx, &f->objective, &f->space, f->w, f->free);
  if (st >= 0) st = free_is_convex(f, &convex);
  if (st < 0) return st;
  f->info.rows_active = 0;
  if (convex) {
    memcpy(f->trial, f->free, 3 * f->objective.n * sizeof *f->free);
    return BATTEN_OK;
  }
  st = f->have_rows ? next_rows(f, part) : first_rows(f);
  if (st < 0) return st;
  f->info.rows_per_round[round] = f->rows.matrix.rows;
  f->info.boxes_per_round[round] = f->rows.boxes;
  double start = batten_now();
  st = convex_program_solve(f->ctx, &f->program, &f->objective, &f->space, f->w, &f->rows, f->free, f->reference,
                            f->trial, &f->info.rows_active, &solved);
  if (st >= 0 && !solved) memcpy(f->trial, f->reference, 3 * f->objective.n * sizeof *f->trial);
  f->info.time_qp_s += batten_now() - start;
  return st;
}

static double unscaled(const fit *f, double sum) { return sum / f->unit / f->unit / f->weight_unit; }

static batten_status run_rounds(fit *f) {
  double part = f->opt->blend;
  unsigned round = 0, divided = 0;
  for (; round < f->opt->rounds; round++) {
    batten_status st = batten_progress(f->ctx, "fit", (double)round / f->opt->rounds / 2);
    if (st >= 0) st = solve_round(f, round, part);
    if (st < 0) return st;
    double before = f->convex.sum;
    if (offer(f, &f->convex, f->trial, f->convex.parameters)) f->info.round_best = round + 1;
    f->info.lsq_per_round[round] = unscaled(f, f->convex.sum);
    if (f->convex.sum < (1 - f->opt->rounds_tol) * before) continue;
    if (divided++ == 3) {
      round++;
      break;
    }
    part /= 3;
  }
  f->info.rounds = round;
  return BATTEN_OK;
}

/* The fit without inequalities: its own rounds, at last one from where the convex fit led the points. For corrections
 * may lead them further there, and what is compared is to be inequalities, not luck. */
static batten_status run_unconstrained(fit *f) {
  const double *at = f->parameters;
  unsigned rounds = f->info.rounds + 1;
  for (unsigned round = 0; round < rounds; round++) {
    batten_status st = batten_progress(f->ctx, "fit", 0.5 + (double)round / rounds / 2);
    if (st < 0) return st;
    if (round > 0) at = round < f->info.rounds ? f->unconstrained.parameters : f->convex.parameters;
    convex_objective_set(&f->objective, &f->space, at);
    st = convex_objective_solve(f->ctx, &f->objective, &f->space, f->w, f->trial);
    if (st < 0) return st;
    if (round == 0)
      f->info.lsq_unconstrained_first = unscaled(f, convex_objective_sum(&f->objective, &f->space, f->trial));
    offer(f, &f->unconstrained, f->trial, at);
  }
  f->info.lsq_unconstrained = unscaled(f, f->unconstrained.sum);
  return BATTEN_OK;
}

/* ---- out ---------------------------------------------------------------------------------------- */

static batten_status make_surface(fit *f, const double *control, batten_surface **out) {
  size_t n = convex_points(&f->space), knots = 0;
  batten_surface_form form = {.degree = {f->opt->degree[0], f->opt->degree[1]}};
  for (int k = 0; k < 2; k++) knots += form.knot_count[k] = f->space.axis[k].count + f->opt->degree[k] + 1;
  double *block = batten_alloc_array(f->ctx, 3 * n + knots, sizeof *block), *at = block;
  if (!block) return BATTEN_E_NOMEM;
  for (int k = 0; k < 2; k++) {
    form.knots[k] = at;
    for (size_t i = 0; i < form.knot_count[k]; i++) {
      double t = f->space.axis[k].knots[i];
      *at++ = t < 1 ? f->domain[k][0] + t * (f->domain[k][1] - f->domain[k][0]) : f->domain[k][1];
    }
  }
  form.control_points = at;
  for (size_t i = 0; i < 3 * n; i++) at[i] = control[i] / f->unit + f->middle[i % 3];
  batten_status st = batten_surface_create(f->ctx, &form, out);
  batten_free(f->ctx, block);
  return st;
}

static void describe(fit *f) {
  f->info.lsq = unscaled(f, f->convex.sum);
  f->info.rms = sqrt(f->convex.sum / f->total) / f->unit;
  double largest = -1;
  for (size_t i = 0; i < f->count; i++)
    if (weight_of(f, i) > 0 && f->convex.squares[i] > largest) {
      largest = f->convex.squares[i];
      f->info.max_error_index = i;
    }
  f->info.max_error = sqrt(largest) / f->unit;
}

static batten_status certify(fit *f, const batten_surface *convex, const batten_surface *unconstrained) {
  double start = batten_now();
  double range[2][2];
  batten_status st = batten_surface_certify_convex(f->ctx, convex, NULL, &f->info.convexity);
  if (st >= 0) st = surface_gauss_range(f->ctx, convex, range[0]);
  if (st >= 0) st = surface_gauss_range(f->ctx, unconstrained, range[1]);
  if (st < 0) return st;
  f->info.gauss_min = range[0][0];
  f->info.gauss_max = range[0][1];
  f->info.gauss_min_unconstrained = range[1][0];
  f->info.gauss_max_unconstrained = range[1][1];
  f->info.time_check_s = batten_now() - start;
  return BATTEN_OK;
}

/* The best plane as a surface: the least rectangle in it that holds the points. */
static batten_status fit_plane(fit *f) {
  size_t nu = f->space.axis[0].count, nv = f->space.axis[1].count;
  double size[2], axes[2][3], mean[3] = {0, 0, 0}, flat[2] = {0, 0};
  const convex_scale as_they_are = {.scale = 1, .unit = 1, .rounding = DBL_EPSILON};
  batten_status st =
      convex_plane_project(f->ctx, f->count, f->points, f->weights, &as_they_are, f->parameters, size, axes);
  if (st < 0) return st;
  for (size_t i = 0; i < f->count; i++) {
    double weight = weight_of(f, i) / f->total;
    for (size_t k = 0; k < 3; k++) mean[k] += weight * f->points[3 * i + k];
    for (size_t k = 0; k < 2; k++) {
      flat[k] += weight * f->parameters[2 * i + k];
      f->parameters[2 * i + k] = fmin(f->parameters[2 * i + k] / size[k], 1);
    }
  }
  bspline_greville(&f->space.axis[0], f->free);
  bspline_greville(&f->space.axis[1], f->free + nu);
  for (size_t i = 0; i < nu * nv; i++) {
    double s = f->free[i / nv] * size[0] - flat[0], t = f->free[nu + i % nv] * size[1] - flat[1];
    for (size_t k = 0; k < 3; k++) f->trial[3 * i + k] = mean[k] + s * axes[0][k] + t * axes[1][k];
  }
  f->convex.sum = INFINITY;
  offer(f, &f->convex, f->trial, f->parameters);
  return BATTEN_OK;
}

/* ---- the fit ------------------------------------------------------------------------------------ */

static batten_status find_reference(fit *f, bool *found) {
  double start = batten_now();
  convex_objective_set(&f->objective, &f->space, f->parameters);
  convex_reference r = {.control = f->reference};
  batten_status st =
      convex_reference_find(f->ctx, &f->objective, &f->space, f->parameters, &f->row_options, f->w, &r);
  f->info.time_reference_s = batten_now() - start;
  if (st < 0) return st;
  *found = r.found;
  f->bent = r.bent;
  f->info.tension_steps = r.steps;
  if (!r.found) return BATTEN_OK;
  f->info.tension_weight = r.weight / f->weight_unit;
  f->info.lsq_reference = unscaled(f, convex_objective_sum(&f->objective, &f->space, f->reference));
  offer(f, &f->convex, f->reference, f->parameters);
  return BATTEN_OK;
}

/* Whether the points that count are a plane's, to rounding of their coordinates. */
static bool is_flat(const fit *f) {
  double mean[3] = {0, 0, 0}, moments[9] = {0}, values[3], axes[9], far = 1, off = 0;
  for (size_t i = 0; i < 3 * f->count; i++) mean[i % 3] += weight_of(f, i / 3) * f->points[i] / f->total;
  for (size_t i = 0; i < f->count; i++)
    for (size_t k = 0; k < 9; k++)
      moments[k] +=
          weight_of(f, i) * (f->points[3 * i + k / 3] - mean[k / 3]) * (f->points[3 * i + k % 3] - mean[k % 3]);
  batten_eigen_symmetric(3, moments, values, axes);
  for (int k = 0; k < 3; k++) far = fmax(far, fabs(f->middle[k]) * f->unit);
  for (size_t i = 0; i < f->count; i++) {
    double d[3];
    if (!(weight_of(f, i) > 0)) continue;
    vec_sub(f->points + 3 * i, mean, d);
    off = fmax(off, fabs(vec_dot(d, axes)));
  }
  return off <= 64 * DBL_EPSILON * far;
}

/* Noise is what the unconstrained fit tells where there are points enough: each takes a coordinate across the
 * surface, each control point gives one. What waves in that fit between the points, and what its parameters have over
 * the convex one's, are factors below 2. */
static double find_excess(const fit *f) {
  double points = 0, free = (double)f->objective.n;
  for (size_t i = 0; i < f->count; i++) points += !f->weights || f->weights[i] > 0;
  if (points < 1.5 * free) return 0;
  double noise = fmax(sqrt(f->unconstrained.sum / f->total * points / (points - free)), CONVEX_EVEN);
  return sqrt(f->convex.sum / f->total) / noise;
}

static batten_status run(fit *f) {
  bool found = false;
  batten_status st = BATTEN_OK;
  f->info.lsq_reference = f->info.tension_weight = f->verdict.misfit = NAN;
  memcpy(f->convex.parameters, f->parameters, 2 * f->count * sizeof *f->parameters);
  f->flat = is_flat(f);
  if (!f->flat) st = find_reference(f, &found);
  if (st >= 0 && found) st = run_rounds(f);
  if (st >= 0) st = run_unconstrained(f);
  if (st >= 0 && found)
    st = convex_judge(f->ctx, &f->space, f->count, f->points, f->weights, &f->convex, &f->verdict);
  if (st < 0) return st;
  f->info.misfit = f->verdict.misfit;
  f->excess = found ? find_excess(f) : 0;
  f->info.plane = !found || (f->bent && (f->verdict.dent || f->excess > BENT_EXCESS));
  return f->info.plane ? fit_plane(f) : BATTEN_OK;
}

/* What the caller is told. */
static batten_status judge(fit *f) {
  const double *at = f->info.convexity.worst_at;
  const convex_verdict *v = &f->verdict;
  if (f->flat)
    return batten_fail(f->ctx, BATTEN_W_SHAPE,
                       "points: all lie in a plane to rounding, and so does the result: it bends to neither side");
  if (f->info.plane && isnan(f->info.lsq_reference) && f->limited)
    return batten_fail(f->ctx, BATTEN_W_SHAPE,
                       "opt.row_limit: %zu inequalities are too few for a convex surface of this degree and these "
                       "spans near the points; the result is their best plane; raise it, or ask for fewer spans",
                       f->opt->row_limit);
  if (f->info.plane)
    return batten_fail(f->ctx, BATTEN_W_SHAPE,
                       "points: no convex surface near them was found; the result is their best plane, which misses "
                       "points[%zu] by %g; split the data into parts that bend one way",
                       f->info.max_error_index, f->info.max_error);
  if (!f->info.convexity.certified)
    return batten_fail(f->ctx, BATTEN_W_ACCURACY,
                       "the surface is not proven convex near (%g, %g), where its Gaussian curvature is %g; raise "
                       "opt.margin or opt.tension",
                       at[0], at[1], f->info.convexity.margin_min);
  if (!v->dent && f->excess > EXCESS)
    return batten_fail(f->ctx, BATTEN_W_SHAPE,
                       "points: the convex surface is %.1f times as far from them as their noise explains, "
                       "points[%zu] the furthest, by %g; split the data into parts that bend one way, take a higher "
                       "degree, or accept the surface",
                       f->excess, f->info.max_error_index, f->info.max_error);
  if (!v->dent) return BATTEN_OK;
  const double *place = f->convex.parameters + 2 * v->worst;
  double there[2];
  for (int k = 0; k < 2; k++) there[k] = f->domain[k][0] + place[k] * (f->domain[k][1] - f->domain[k][0]);
  return batten_fail(
      f->ctx, BATTEN_W_SHAPE,
      "points: they bend inwards by more than noise does (%.1f standard deviations): near (%g, %g) the "
      "mean of %zu point%s, points[%zu] the deepest, lies %g inside the chord of those on both sides; leave "
      "out the points of the dent, split the data, or accept the flattened surface",
      v->misfit, there[0], there[1], v->points, v->points == 1 ? "" : "s", v->worst, v->depth / f->unit);
}

batten_status batten_convex_fit(batten_context *ctx, size_t count, const double *points,
                                const batten_convex_options *opt, batten_surface **out,
                                batten_surface **unconstrained, batten_convex_info *info) {
  batten_convex_options defaults = batten_convex_options_default();
  if (!opt) opt = &defaults;
  batten_surface *convex = NULL, *other = NULL;
  batten_status st = convex_options_check(ctx, opt);
  if (st >= 0 && !out) st = batten_fail(ctx, BATTEN_E_INVALID, "out: NULL; give a place for the surface");
  if (st >= 0) st = convex_data_check(ctx, count, points, opt);
  if (st < 0) return st;
  fit f = {.ctx = ctx, .opt = opt, .count = count};
  f.row_options =
      (convex_row_options){opt->directions, opt->depth_max, opt->row_share, opt->margin, opt->row_limit, &f.limited};
  st = begin(&f, points);
  if (st >= 0) st = run(&f);
  if (st >= 0) st = make_surface(&f, f.convex.control, &convex);
  if (st >= 0) st = make_surface(&f, f.unconstrained.control, &other);
  if (st < 0) goto done;
  describe(&f);
  st = certify(&f, convex, other);
  if (st >= 0) st = judge(&f);
  if (st < 0) goto done;
  *out = convex;
  convex = NULL;
  if (info) *info = f.info;
  if (unconstrained) {
    *unconstrained = other;
    other = NULL;
  }
done:
  batten_surface_free(other);
  batten_surface_free(convex);
  free_fit(&f);
  return st;
}
