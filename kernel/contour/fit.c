/* Planar curves of wanted shape from points in order.   [Juettler: Construction of surfaces, section 2]
 *
 * The points are moved and scaled by a power of two to size 1; inflections and breaks are laid out; a reference curve
 * of the wanted shape is found. Round by round, inequalities are written around the reference, the quadratic program
 * is solved, and the points go to their nearest places. The next reference is the best curve so far blended with the
 * reference before: that lies strictly inside the inequalities. (To shrink the blend where a round gains little, as
 * fits of surfaces do, gained nothing in 300 random curves.) Beside it the fit without inequalities takes the
 * same rounds.
 *
 * What comes out, in the caller's units, is proven by batten_curve_certify. Whether the data have that shape at all
 * is asked of their noise (judge.c). */
#include <float.h>
#include <string.h>

#include "base/checked.h"
#include "curve/curve_inner.h"
#include "layout.h"

/* A curve and its points' places; its sum of squares only drops. */
typedef struct track {
  double *control, *parameters, *squares;
  double sum;
} track;

typedef struct fit {
  batten_context *ctx;
  const batten_contour_options *opt;
  contour_row_options row_options;
  contour_input in;
  contour_data data;
  contour_ends ends;
  double tension; /* weight of the integral of |x''|^2 over [0, 1] */
  contour_layout layout;
  contour_space space, plain; /* with x'' = 0 at inflections, and without */
  contour_objective objective;
  contour_rows rows;
  bool have_rows;
  batten_qp_workspace *workspace;
  size_t n;                                         /* control points */
  double *free, *trial, *first, *reference, *older; /* [n][2] first: reference */
  double *places, *squares;
  track shaped, unconstrained;
  contour_verdict verdict;
  batten_curve *curve, *other;
  batten_contour_info info;
} fit;

static batten_status make_track(fit *f, track *t) {
  t->control = batten_alloc_array(f->ctx, f->n, 2 * sizeof *t->control);
  t->parameters = batten_alloc_array(f->ctx, f->in.count, sizeof *t->parameters);
  t->squares = batten_alloc_array(f->ctx, f->in.count, sizeof *t->squares);
  t->sum = INFINITY;
  return t->control && t->parameters && t->squares ? BATTEN_OK : BATTEN_E_NOMEM;
}

static void free_track(fit *f, track *t) {
  batten_free(f->ctx, t->squares);
  batten_free(f->ctx, t->parameters);
  batten_free(f->ctx, t->control);
}

static void free_rows(fit *f) {
  if (f->have_rows) contour_rows_free(f->ctx, &f->rows);
  f->have_rows = false;
}

static void free_fit(fit *f) {
  batten_curve_free(f->other);
  batten_curve_free(f->curve);
  free_rows(f);
  free_track(f, &f->unconstrained);
  free_track(f, &f->shaped);
  batten_qp_workspace_free(f->workspace);
  contour_objective_free(f->ctx, &f->objective);
  contour_space_free(f->ctx, &f->plain);
  contour_space_free(f->ctx, &f->space);
  contour_layout_free(f->ctx, &f->layout);
  contour_input_free(f->ctx, &f->in);
  double *blocks[] = {f->free, f->trial, f->first, f->reference, f->older, f->places, f->squares};
  for (size_t i = sizeof blocks / sizeof *blocks; i-- > 0;) batten_free(f->ctx, blocks[i]);
}

/* ---- in ----------------------------------------------------------------------------------------- */

static void take_ends(fit *f, size_t count, const double *points) {
  const batten_contour_options *o = f->opt;
  for (size_t e = 0; e < 2; e++) {
    const double *given = o->end_points[e], *own = points + (e ? 2 * count - 2 : 0), *tangent = o->end_tangents[e];
    double largest = fmax(fabs(tangent[0]), fabs(tangent[1])),
           length = hypot(tangent[0] / largest, tangent[1] / largest);
    for (int k = 0; k < 2; k++) {
      double at = isnan(given[0]) ? own[k] : given[k];
      f->ends.point[e][k] = o->fix_ends[e] ? (at - f->in.middle[k]) * f->in.unit : NAN;
      f->ends.tangent[e][k] = isnan(tangent[0]) ? NAN : tangent[k] / largest / length;
    }
  }
}

static batten_status begin(fit *f, size_t count, const double *points) {
  double start = batten_now();
  batten_status st = batten_progress(f->ctx, "parameters", 0);
  if (st >= 0) st = contour_input_make(f->ctx, count, points, f->opt, &f->in);
  if (st < 0) return st;
  f->info.time_parameters_s = batten_now() - start;
  f->data = (contour_data){f->in.count, f->in.points, f->in.weights};
  take_ends(f, count, points);
  st = contour_layout_make(f->ctx, &f->data, &f->in, f->opt, &f->layout);
  if (st < 0) return st;
  const contour_shape *shape = &f->layout.shape;
  f->tension = contour_tension(f->opt->tension, shape->spans);
  st = contour_space_make(f->ctx, shape, shape->degree, true, &f->ends, &f->space);
  if (st >= 0) st = contour_space_make(f->ctx, shape, shape->degree, false, &f->ends, &f->plain);
  if (st >= 0) st = contour_objective_new(f->ctx, &f->space.b, &f->objective);
  if (st >= 0) st = batten_qp_workspace_new(f->ctx, &f->workspace);
  if (st < 0) return st;
  f->n = f->space.b.count;
  double **blocks[] = {&f->free, &f->trial, &f->first, &f->reference, &f->older};
  for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++)
    if (!(*blocks[i] = batten_alloc_array(f->ctx, f->n, 2 * sizeof(double)))) return BATTEN_E_NOMEM;
  f->places = batten_alloc_array(f->ctx, f->in.count, sizeof *f->places);
  f->squares = batten_alloc_array(f->ctx, f->in.count, sizeof *f->squares);
  if (!f->places || !f->squares) return BATTEN_E_NOMEM;
  st = make_track(f, &f->shaped);
  return st < 0 ? st : make_track(f, &f->unconstrained);
}

/* ---- rounds ------------------------------------------------------------------------------------- */

static double weight_of(const fit *f, size_t i) { return f->in.weights ? f->in.weights[i] : 1; }

static double unscaled(const fit *f, double sum) { return sum / f->in.unit / f->in.unit / f->in.weight_unit; }

/* Points go to nearer places of `control` from `from`; the track takes that over if its sum drops. */
static bool offer(fit *f, track *t, const double *control, const double *from) {
  double start = batten_now(), sum = 0;
  memcpy(f->places, from, f->in.count * sizeof *f->places);
  contour_correct(f->ctx, &f->space.b, f->opt->closed != 0, control, &f->data, f->opt->correction_passes, f->places,
                  f->squares);
  f->info.time_correction_s += batten_now() - start;
  for (size_t i = 0; i < f->in.count; i++) sum += weight_of(f, i) * f->squares[i];
  if (!(sum < t->sum)) return false;
  t->sum = sum;
  memcpy(t->control, control, 2 * f->n * sizeof *control);
  memcpy(t->parameters, f->places, f->in.count * sizeof *f->places);
  memcpy(t->squares, f->squares, f->in.count * sizeof *f->squares);
  return true;
}

/* The minimum in a space with points at parameters: f->free. */
static batten_status solve_free(fit *f, const contour_space *space, const double *parameters) {
  contour_objective_set(&f->objective, &f->data, parameters, f->tension);
  return contour_objective_solve(f->ctx, &f->objective, space, f->free);
}

/* Rows around the reference; where it does not bend clearly enough any more, those before stay. */
static batten_status make_rows(fit *f, bool *accepted) {
  contour_rows rows;
  batten_status st = contour_rows_make(f->ctx, &f->layout.shape, &f->space.b, f->reference, &f->row_options,
                                       f->have_rows ? &f->rows : NULL, accepted, &rows);
  if (st < 0 || !*accepted) return st;
  free_rows(f);
  f->rows = rows;
  f->have_rows = true;
  return BATTEN_OK;
}

/* Around the best curve, blended with the reference before. */
static batten_status next_rows(fit *f) {
  bool accepted = !f->have_rows;
  double part = f->opt->blend;
  memcpy(f->older, f->reference, 2 * f->n * sizeof *f->older);
  for (size_t i = 0; i < 2 * f->n && f->have_rows; i++)
    f->reference[i] = (1 - part) * f->shaped.control[i] + part * f->older[i];
  batten_status st = make_rows(f, &accepted);
  if (st < 0 || accepted) return st;
  if (!f->have_rows) return batten_fail(f->ctx, BATTEN_E_INTERNAL, "the reference curve lost its inequalities");
  memcpy(f->reference, f->older, 2 * f->n * sizeof *f->older);
  return BATTEN_OK;
}

/* One round of the curve with inequalities: f->trial. */
static batten_status solve_round(fit *f, unsigned round) {
  bool shaped = false;
  contour_program_figures figures = {0};
  batten_status st = solve_free(f, &f->space, f->shaped.parameters);
  double start = batten_now();
  if (st >= 0)
    st = contour_rows_make(f->ctx, &f->layout.shape, &f->space.b, f->free, &f->row_options, NULL, &shaped, NULL);
  shaped = shaped && contour_forward(&f->ends, f->n, f->free);
  if (st >= 0 && !shaped) st = next_rows(f);
  f->info.time_rows_s += batten_now() - start;
  if (st < 0) return st;
  f->info.rows_active = 0;
  if (shaped) {
    memcpy(f->trial, f->free, 2 * f->n * sizeof *f->trial);
    return BATTEN_OK;
  }
  f->info.rows_per_round[round] = f->rows.matrix.rows;
  f->info.segments_per_round[round] = f->rows.wedge_count;
  start = batten_now();
  st = contour_program_solve(f->ctx, f->workspace, &f->objective, &f->space, &f->rows, f->free, f->reference,
                             f->trial, &figures);
  if (st >= 0 && !figures.solved) memcpy(f->trial, f->reference, 2 * f->n * sizeof *f->trial);
  f->info.time_qp_s += batten_now() - start;
  f->info.rows_active = figures.active;
  f->info.iterations += figures.iterations;
  return st;
}

static batten_status run_rounds(fit *f) {
  bool gains = true;
  unsigned round = 0;
  for (; round < f->opt->rounds && gains; round++) {
    batten_status st = batten_progress(f->ctx, "fit", (double)round / f->opt->rounds / 2);
    if (st >= 0) st = solve_round(f, round);
    if (st < 0) return st;
    double before = f->shaped.sum;
    if (offer(f, &f->shaped, f->trial, f->shaped.parameters)) f->info.round_best = round + 1;
    f->info.lsq_per_round[round] = unscaled(f, f->shaped.sum);
    gains = f->shaped.sum < (1 - f->opt->rounds_tol) * before;
  }
  f->info.rounds = round;
  return BATTEN_OK;
}

/* The fit without inequalities: its own rounds, at last one from where the other fit led the points. For corrections
 * may lead them further there, and what is compared is to be inequalities, not luck. */
static batten_status run_unconstrained(fit *f) {
  const double *at = f->in.parameters;
  unsigned rounds = f->info.rounds + 1;
  for (unsigned round = 0; round < rounds; round++) {
    batten_status st = batten_progress(f->ctx, "fit", 0.5 + (double)round / rounds / 2);
    if (st < 0) return st;
    if (round > 0) at = round < f->info.rounds ? f->unconstrained.parameters : f->shaped.parameters;
    st = solve_free(f, &f->plain, at);
    if (st < 0) return st;
    if (round == 0) f->info.lsq_unconstrained_first = unscaled(f, contour_sum(&f->space.b, f->free, &f->data, at));
    offer(f, &f->unconstrained, f->free, at);
  }
  f->info.lsq_unconstrained = unscaled(f, f->unconstrained.sum);
  return BATTEN_OK;
}

static batten_status find_reference(fit *f) {
  double start = batten_now();
  contour_reference r = {.control = f->reference};
  batten_status st = batten_progress(f->ctx, "reference", 0);
  if (st >= 0)
    st = contour_reference_find(f->ctx, &f->layout.shape, &f->space, &f->ends, &f->data, f->in.parameters,
                                f->opt->construction, f->tension, &f->row_options, &r);
  f->info.time_reference_s = batten_now() - start;
  if (st < 0) return st;
  f->info.construction = r.construction;
  f->info.fallback = r.fallback;
  f->info.lsq_reference = unscaled(f, contour_sum(&f->space.b, f->reference, &f->data, f->in.parameters));
  memcpy(f->first, f->reference, 2 * f->n * sizeof *f->first);
  memcpy(f->shaped.parameters, f->in.parameters, f->in.count * sizeof *f->in.parameters);
  offer(f, &f->shaped, f->reference, f->in.parameters);
  return BATTEN_OK;
}

/* ---- out ---------------------------------------------------------------------------------------- */

/* Control points and knots of the caller. */
static batten_status make_curve(fit *f, const double *control, batten_curve **out) {
  const contour_shape *s = &f->layout.shape;
  double *marks = f->layout.marks;
  size_t count = bspline_make_knots(s->degree, s->smoothness, s->spans, marks + 1, marks[0], marks[s->spans], NULL);
  double *knots = batten_alloc_array(f->ctx, count, sizeof *knots);
  if (!knots) return BATTEN_E_NOMEM;
  bspline_make_knots(s->degree, s->smoothness, s->spans, marks + 1, marks[0], marks[s->spans], knots);
  for (size_t i = 0; i < 2 * f->n; i++) f->trial[i] = control[i] / f->in.unit + f->in.middle[i % 2];
  bspline b = {s->degree, f->n, knots};
  batten_status st = curve_make(f->ctx, &b, f->trial, s->closed, out);
  batten_free(f->ctx, knots);
  return st;
}

static batten_status certify(fit *f) {
  batten_curve_shape_options o = batten_curve_shape_options_default();
  o.sign = f->layout.sign;
  o.inflection_count = f->layout.inflection_count;
  o.inflections = f->layout.inflections;
  return batten_curve_certify(f->ctx, f->curve, &o, &f->info.shape);
}

/* The best curve is certified as it is returned. Where it touches its inequalities and rounding of the caller's units
 * spoils that, as far from the origin, it moves by as little as helps: towards the last reference, which satisfies
 * the same inequalities, but keeps a small part of what the first one has; then towards the first one. */
static batten_status finish_curve(fit *f) {
  const struct {
    double part;
    const double *towards;
  } moves[] = {{0, f->reference},   {1e-6, f->reference}, {1e-4, f->reference}, {1e-2, f->reference},
               {0.1, f->reference}, {1, f->reference},    {1e-3, f->first},     {1e-2, f->first},
               {0.1, f->first},     {0.5, f->first},      {1, f->first}};
  batten_status st = BATTEN_OK;
  memcpy(f->older, f->shaped.control, 2 * f->n * sizeof *f->older);
  for (size_t k = 0; k < sizeof moves / sizeof *moves && st >= 0 && !f->info.shape.certified; k++) {
    double part = moves[k].part;
    if (k > 0) {
      f->shaped.sum = INFINITY;
      for (size_t i = 0; i < 2 * f->n; i++) f->free[i] = (1 - part) * f->older[i] + part * moves[k].towards[i];
      offer(f, &f->shaped, f->free, f->shaped.parameters);
    }
    batten_curve_free(f->curve);
    f->curve = NULL;
    st = make_curve(f, f->shaped.control, &f->curve);
    if (st >= 0) st = certify(f);
  }
  return st;
}

static batten_status count_inflections(fit *f, const batten_curve *curve, size_t *count) {
  double *found = NULL;
  batten_status st = batten_curve_inflections(f->ctx, curve, count, &found);
  if (st >= 0) batten_free(f->ctx, found);
  return st;
}

static batten_status check(fit *f) {
  double start = batten_now();
  batten_status st = batten_progress(f->ctx, "certify", 0);
  if (st >= 0) st = finish_curve(f);
  if (st >= 0) st = make_curve(f, f->unconstrained.control, &f->other);
  if (st >= 0) st = count_inflections(f, f->curve, &f->info.inflections_found);
  if (st >= 0) st = count_inflections(f, f->other, &f->info.inflections_unconstrained);
  f->info.time_check_s = batten_now() - start;
  return st;
}

static void describe(fit *f) {
  batten_contour_info *i = &f->info;
  i->unknowns = f->space.unknowns;
  i->equalities = f->space.equalities;
  i->spans = f->layout.pieces;
  i->inflections_wanted = f->layout.inflection_count;
  i->time_inflections_s = f->layout.time_inflections_s;
  i->time_knots_s = f->layout.time_knots_s;
  i->lsq = unscaled(f, f->shaped.sum);
  i->rms = sqrt(f->shaped.sum / f->in.total) / f->in.unit;
  double largest = -1;
  for (size_t k = 0; k < f->in.count; k++)
    if (weight_of(f, k) > 0 && f->shaped.squares[k] > largest) {
      largest = f->shaped.squares[k];
      i->max_error_index = k;
    }
  i->max_error = sqrt(largest) / f->in.unit;
  contour_judge(&f->data, f->shaped.squares, f->unconstrained.squares, f->plain.unknowns, &f->verdict);
  i->misfit = f->verdict.misfit;
}

static double parameter_of(const fit *f, double t) {
  const double *d = f->in.domain;
  return t == 1 ? d[1] : fmin(d[0] + t * (d[1] - d[0]), d[1]);
}

/* What the caller is told. */
static batten_status judge(fit *f) {
  const contour_verdict *v = &f->verdict;
  if (!f->info.shape.certified)
    return batten_fail(
        f->ctx, BATTEN_W_ACCURACY,
        "the curve is not proven to have the wanted shape near the parameter %g, where its curvature "
        "has %g to spare; raise opt.margin, ask for fewer spans, or move points that are far from the origin",
        f->info.shape.worst_at, f->info.shape.margin_min);
  if (!v->contradicts) return BATTEN_OK;
  return batten_fail(
      f->ctx, BATTEN_W_SHAPE,
      "points: the curve of the wanted shape is %.1f times as far from them as their noise explains, most "
      "near points[%zu] at the parameter %g, by %g; change the inflections or the sign there, or accept "
      "the curve",
      v->misfit, v->worst, parameter_of(f, f->shaped.parameters[v->worst]), v->distance / f->in.unit);
}

/* Of closed curves the repeated first point has its parameter, or the end of the domain. */
static void write_parameters(const fit *f, double *parameters) {
  size_t count = f->in.count;
  for (size_t i = 0; i < count; i++) parameters[i] = parameter_of(f, f->shaped.parameters[i]);
  if (f->in.repeated) parameters[count] = parameters[0] == f->in.domain[0] ? f->in.domain[1] : parameters[0];
}

batten_status batten_contour_fit(batten_context *ctx, size_t count, const double *points,
                                 const batten_contour_options *opt, batten_curve **out, double *parameters,
                                 batten_curve **unconstrained, batten_contour_info *info) {
  batten_contour_options defaults = batten_contour_options_default();
  if (!opt) opt = &defaults;
  batten_status st = contour_options_check(ctx, opt);
  if (st >= 0 && !out) st = batten_fail(ctx, BATTEN_E_INVALID, "out: NULL; give a place for the curve");
  if (st < 0) return st;
  fit f = {.ctx = ctx, .opt = opt};
  f.row_options = (contour_row_options){opt->gap, opt->depth_max, opt->margin, opt->row_limit};
  st = begin(&f, count, points);
  if (st >= 0) st = find_reference(&f);
  if (st >= 0) st = run_rounds(&f);
  if (st >= 0) st = run_unconstrained(&f);
  if (st >= 0) st = check(&f);
  if (st < 0) goto done;
  describe(&f);
  st = judge(&f);
  if (parameters) write_parameters(&f, parameters);
  if (info) *info = f.info;
  *out = f.curve;
  f.curve = NULL;
  if (unconstrained) {
    *unconstrained = f.other;
    f.other = NULL;
  }
done:
  free_fit(&f);
  return st;
}
