/* batten_loft_build: the order of things.   [section 3.3]
 *
 * Contours are prepared once; then one attempt after another is made, of rising degree and, where no degree will do,
 * with more knots next to the vertices that had no solution. An attempt is good when all its inequalities hold, or
 * when its surface is proven without that: they are sufficient, not necessary. If none is, the one with the fewest
 * span pairs that are not proven is returned, and says where. */
#include <float.h>
#include <string.h>

#include "base/checked.h"
#include "loft_inner.h"

/* ---- an attempt ---------------------------------------------------------------------------------- */

/* What the proofs of all patches say together. */
typedef struct proof {
  size_t pairs, free, violations, unproven;
  double margin;
  size_t worst_patch;
  double worst_at[2];
  bool certified;
} proof;

typedef struct attempt {
  unsigned degree;
  loft_slab *slabs; /* not its own */
  loft_net net;
  loft_result result;
  double objective, objective_free;
  batten_loft *loft, *unconstrained;
  proof proof;
} attempt;

static void attempt_free(batten_context *ctx, attempt *a) {
  batten_loft_free(a->loft);
  batten_loft_free(a->unconstrained);
  loft_result_free(ctx, &a->result);
  loft_net_free(ctx, &a->net);
  *a = (attempt){0};
}

typedef struct build {
  batten_context *ctx;
  const batten_loft_options *opt;
  const batten_curve *const *contours;
  const double *heights;
  loft_stack stack;
  size_t patches;
  loft_slab *slabs, *best_slabs; /* of the trial; of the best attempt, where they are others */
  attempt best, trial;
  bool have_best;
  unsigned rounds;
  size_t iterations;
  batten_loft_info info;
} build;

static void build_free(build *b) {
  attempt_free(b->ctx, &b->trial);
  attempt_free(b->ctx, &b->best);
  if (b->best_slabs != b->slabs) loft_slabs_free(b->ctx, b->patches, b->best_slabs);
  loft_slabs_free(b->ctx, b->patches, b->slabs);
  loft_stack_free(b->ctx, &b->stack);
}

/* ---- proof --------------------------------------------------------------------------------------- */

static void add_proof(proof *all, size_t patch, const batten_sections *s) {
  all->pairs += s->pairs;
  all->free += s->pairs_free;
  all->violations += s->violations;
  all->unproven += s->unproven;
  /* A patch that is not certified tells the least that it met, which is what one wants to know then. */
  bool first_bad = !s->certified && all->certified;
  if (first_bad || (s->certified == all->certified && !(s->margin_min >= all->margin))) {
    all->margin = s->margin_min;
    all->worst_patch = patch;
    memcpy(all->worst_at, s->worst_at, sizeof all->worst_at);
  }
  all->certified = all->certified && s->certified;
}

/* Of each patch by itself, as it is handed out. */
static batten_status prove(batten_context *ctx, const batten_loft *loft, proof *out) {
  proof all = {.certified = true, .margin = NAN};
  batten_status st = BATTEN_OK;
  for (size_t i = 0; i + 1 < loft->contours && st >= 0; i++) {
    batten_surface *patch = NULL;
    batten_sections sections;
    st = batten_loft_patch(ctx, loft, i, &patch);
    if (st >= 0) st = batten_surface_certify_sections(ctx, patch, NULL, &sections, NULL);
    if (st >= 0) add_proof(&all, i, &sections);
    batten_surface_free(patch);
  }
  if (st >= 0) *out = all;
  return st;
}

/* ---- one attempt --------------------------------------------------------------------------------- */

static batten_status make_loft(build *b, attempt *a, const double *y, double *control, batten_loft **out) {
  loft_net_expand(&a->net, y, control);
  return loft_make(b->ctx, &b->stack, &a->net, b->heights, control, out);
}

/* The trial's surface, and the one without inequalities. */
static batten_status solve(build *b, attempt *a) {
  batten_context *ctx = b->ctx;
  loft_objective *objective = NULL;
  double *free = NULL, *control = NULL, start = batten_now();
  batten_status st = batten_progress(ctx, "objective", 0);
  if (st >= 0) st = loft_net_make(ctx, &b->stack, b->slabs, a->degree, &a->net);
  if (st >= 0) st = loft_objective_new(ctx, &b->stack, &a->net, b->opt, &objective);
  if (st < 0) goto done;
  free = batten_alloc_array(ctx, 2 * a->net.z.columns, sizeof *free);
  control = batten_alloc_array(ctx, 2 * a->net.z.rows, sizeof *control);
  st = free && control ? loft_objective_minimum(ctx, objective, free) : BATTEN_E_NOMEM;
  b->info.time_objective_s += batten_now() - start;
  if (st >= 0)
    st = loft_rounds(ctx, &a->net, objective, b->opt, free, &b->info.time_rows_s, &b->info.time_qp_s, &a->result);
  if (st < 0) goto done;
  b->rounds += a->result.rounds;
  b->iterations += a->result.iterations;
  a->objective = loft_objective_value(objective, a->result.y);
  a->objective_free = loft_objective_value(objective, free);
  st = make_loft(b, a, a->result.y, control, &a->loft);
  if (st >= 0) st = make_loft(b, a, free, control, &a->unconstrained);
done:
  batten_free(ctx, control);
  batten_free(ctx, free);
  loft_objective_free(ctx, objective);
  return st;
}

static size_t missing(const proof *p) { return p->violations + p->unproven; }

/* Keeps the trial where it is better; takes its slabs along. */
static void keep_better(build *b) {
  attempt *t = &b->trial;
  bool better =
      !b->have_best || missing(&t->proof) < missing(&b->best.proof) ||
      (missing(&t->proof) == missing(&b->best.proof) && t->result.elastic_count < b->best.result.elastic_count);
  if (!better) {
    attempt_free(b->ctx, t);
    return;
  }
  attempt_free(b->ctx, &b->best);
  if (b->have_best && b->best_slabs != b->slabs) loft_slabs_free(b->ctx, b->patches, b->best_slabs);
  b->best = *t;
  *t = (attempt){0};
  b->best_slabs = b->slabs;
  b->have_best = true;
}

/* *failing: vertices of this attempt that do. */
static batten_status try_degree(build *b, unsigned degree, size_t *failing, bool *done) {
  attempt *a = &b->trial;
  a->degree = degree;
  batten_status st = solve(b, a);
  double start = batten_now();
  if (st >= 0) st = batten_progress(b->ctx, "certify", 0);
  if (st >= 0) st = prove(b->ctx, a->loft, &a->proof);
  b->info.time_check_s += batten_now() - start;
  if (st < 0) return st;
  *failing = a->result.elastic_count;
  keep_better(b);
  *done = b->best.proof.certified;
  return BATTEN_OK;
}

/* ---- more knots ---------------------------------------------------------------------------------- */

/* The middle of the span around vertex v of a patch becomes a knot of both contours. */
static batten_status insert_near(build *b, const loft_elastic *e) {
  const loft_space *s = &b->best_slabs[e->slab].space;
  double t = loft_greville(s, (ptrdiff_t)(e->vertex + 1)), whole;
  if (s->closed) t = modf(t + 1, &whole);
  size_t span = 0;
  while (span + 1 < s->spans && s->breaks[span + 1] <= t) span++;
  double knot = 0.5 * (s->breaks[span] + s->breaks[span + 1]);
  unsigned fold = 1;
  batten_status st = loft_stack_insert(b->ctx, &b->stack, e->slab, 1, &knot, &fold);
  return st < 0 ? st : loft_stack_insert(b->ctx, &b->stack, e->slab + 1, 1, &knot, &fold);
}

static batten_status make_slabs(build *b) {
  if (b->slabs != b->best_slabs) loft_slabs_free(b->ctx, b->patches, b->slabs);
  b->slabs = NULL;
  batten_status st = loft_slabs_make(b->ctx, &b->stack, &b->slabs);
  for (size_t i = 0; i < b->patches && st >= 0; i++) st = loft_vertices_make(b->ctx, &b->stack, i, &b->slabs[i]);
  return st;
}

/* ---- phases -------------------------------------------------------------------------------------- */

static batten_status prepare(build *b, size_t count) {
  double start = batten_now();
  batten_status st = batten_progress(b->ctx, "contours", 0);
  if (st >= 0) st = loft_stack_make(b->ctx, count, b->contours, b->heights, b->opt, &b->stack);
  if (st >= 0) st = loft_shape_prepare(b->ctx, &b->stack, b->opt);
  b->patches = count - 1;
  if (st >= 0) st = make_slabs(b);
  b->info.time_prepare_s = batten_now() - start;
  return st;
}

static batten_status check_degree(build *b, unsigned *degree) {
  unsigned l = b->stack.smoothness, least = 2 * l + 1;
  *degree = b->opt->degree_z ? b->opt->degree_z : 2 * l + 2;
  if (b->opt->degree_z && *degree < least)
    return batten_fail(b->ctx, BATTEN_E_INVALID,
                       "opt.degree_z: %u; must be %u or more for smoothness %u, which the contours have", *degree,
                       least, l);
  if (b->opt->degree_z_max < least)
    return batten_fail(b->ctx, BATTEN_E_INVALID,
                       "opt.degree_z_max: %u; must be %u or more for smoothness %u, which the contours have",
                       b->opt->degree_z_max, least, l);
  if (*degree > b->opt->degree_z_max) *degree = b->opt->degree_z_max;
  return BATTEN_OK;
}

/* The degree rises, and knots are inserted, as long as fewer vertices fail for it: what helps none of them at once is
 * no matter of unknowns, and attempts become dearer each time. */
static batten_status attempts(build *b, unsigned degree) {
  bool done = false;
  batten_status st = BATTEN_OK;
  size_t least = SIZE_MAX;
  for (unsigned knots = 0; st >= 0 && !done; knots++) {
    size_t before = SIZE_MAX, failing = SIZE_MAX;
    for (unsigned n = degree; n <= b->opt->degree_z_max && st >= 0 && !done; n++) {
      before = failing;
      st = try_degree(b, n, &failing, &done);
      if (failing >= before) break;
    }
    size_t left = b->best.result.elastic_count;
    if (st < 0 || done || knots == b->opt->knot_rounds || left == 0 || left >= least) break;
    least = left;
    for (size_t k = 0; k < b->best.result.elastic_count && st >= 0; k++)
      st = insert_near(b, &b->best.result.elastic[k]);
    if (st >= 0) st = make_slabs(b);
  }
  return st;
}

static batten_status add_notes(build *b) {
  const attempt *a = &b->best;
  batten_loft *loft = a->loft;
  size_t count = a->proof.certified ? 0 : a->result.elastic_count, all = loft->note_count + count;
  if (count == 0) return BATTEN_OK;
  batten_loft_note *notes = batten_realloc_array(b->ctx, loft->notes, all, sizeof *notes);
  if (!notes) return BATTEN_E_NOMEM;
  loft->notes = notes;
  for (size_t k = 0; k < count; k++) {
    const loft_elastic *e = &a->result.elastic[k];
    double t = loft_greville(&b->best_slabs[e->slab].space, (ptrdiff_t)(e->vertex + 1)), whole;
    if (loft->closed) t = modf(t + 1, &whole);
    notes[loft->note_count++] = (batten_loft_note){.remark = BATTEN_LOFT_ELASTIC,
                                                   .contour = e->slab,
                                                   .other = e->slab + 1,
                                                   .t = loft->domain[0] + t * (loft->domain[1] - loft->domain[0]),
                                                   .amount = e->amount};
  }
  return BATTEN_OK;
}

/* Whether both contours of some patch bend to one side over a span, as far as their polygons tell. */
static bool seem_to_bend(const build *b) {
  static const double CLEARLY = 1e-3; /* radians */
  for (size_t i = 0; i < b->patches; i++) {
    const loft_slab *slab = &b->best_slabs[i];
    size_t vertices = loft_vertices(&slab->space);
    for (size_t k = 0; k < slab->space.spans; k++) {
      double least = INFINITY, most = -INFINITY;
      for (size_t v = slab->space.first[k]; v <= slab->space.first[k] + slab->space.degree - 2; v++)
        for (unsigned end = 0; end < 2; end++) {
          double turn = loft_turn(slab, end, v % vertices);
          least = isnan(turn) ? -INFINITY : fmin(least, turn);
          most = isnan(turn) ? INFINITY : fmax(most, turn);
        }
      if (least > CLEARLY || most < -CLEARLY) return true;
    }
  }
  return false;
}

static batten_status describe(build *b, unsigned degree) {
  const attempt *a = &b->best;
  const loft_stack *s = &b->stack;
  batten_loft_info *i = &b->info;
  double start = batten_now();
  proof unconstrained;
  batten_status st = prove(b->ctx, a->unconstrained, &unconstrained);
  if (st >= 0) st = loft_measure(b->ctx, a->loft, b->contours, &i->interpolation_error, &i->continuity_error);
  if (st >= 0) st = add_notes(b);
  if (st < 0) return st;
  double size = s->size / s->unit;
  i->interpolation_error /= size;
  i->continuity_error /= size;
  i->contours = s->count;
  i->patches = b->patches;
  i->smoothness = s->smoothness;
  i->degree_t = s->degree;
  i->degree_z = a->degree;
  i->degree_raised = a->degree - degree;
  i->knots_inserted = s->knots_inserted;
  i->knot_shift = s->knot_shift / s->unit;
  i->unknowns = 2 * a->net.z.columns;
  i->equalities = a->net.equalities;
  i->rows = a->result.rows;
  i->rows_used = a->result.rows_used;
  i->rounds = b->rounds;
  i->settled = a->result.settled;
  i->iterations = b->iterations;
  i->inflections = s->inflections;
  i->inflections_unmatched = s->unmatched;
  i->vertices_elastic = a->proof.certified ? 0 : a->result.elastic_count;
  i->self_intersecting = s->self_crossing;
  i->sign_pairs = a->proof.pairs;
  i->sign_pairs_free = a->proof.free;
  i->sign_violations = a->proof.violations;
  i->sign_violations_unconstrained = unconstrained.violations;
  /* A proof of nothing is none, where there is something to prove. */
  i->certified = a->proof.certified && (a->proof.pairs > 0 || !seem_to_bend(b));
  i->margin_min = a->proof.margin;
  i->worst_patch = a->proof.worst_patch;
  memcpy(i->worst_at, a->proof.worst_at, sizeof i->worst_at);
  i->objective = a->objective;
  i->objective_unconstrained = a->objective_free;
  i->time_check_s += batten_now() - start;
  return BATTEN_OK;
}

static batten_status judge(const build *b) {
  const batten_loft_info *i = &b->info;
  if (i->certified) return BATTEN_OK;
  if (i->sign_pairs == 0)
    return batten_fail(
        b->ctx, BATTEN_W_ACCURACY,
        "no span pair could be shown to bend to one side, though contours seem to: nothing is proven of "
        "the sections; rounding hides how they bend where neighbouring contours differ a lot in size or "
        "lie far from the origin");
  return batten_fail(
      b->ctx, BATTEN_W_ACCURACY,
      "sections are not proven to keep the contours' signs in %zu of %zu span pairs, worst in patch %zu "
      "(between contours %zu and %zu) near t = %g, z = %g; see batten_loft_notes, put a contour between these two, "
      "or give them "
      "knots that lie nearer to each other",
      missing(&b->best.proof), i->sign_pairs, i->worst_patch, i->worst_patch, i->worst_patch + 1, i->worst_at[0],
      i->worst_at[1]);
}

batten_status batten_loft_build(batten_context *ctx, size_t count, const batten_curve *const *contours,
                                const double *heights, const batten_loft_options *opt, batten_loft **out,
                                batten_loft **unconstrained, batten_loft_info *info) {
  batten_loft_options defaults = batten_loft_options_default();
  unsigned degree = 0;
  if (!opt) opt = &defaults;
  batten_status st = loft_options_check(ctx, opt);
  if (st >= 0 && !out) st = batten_fail(ctx, BATTEN_E_INVALID, "out: NULL; give a place for the loft");
  if (st >= 0 && count < 2)
    st = batten_fail(ctx, BATTEN_E_INVALID, "count: %zu; a loft goes through two contours or more", count);
  if (st < 0) return st;
  build b = {.ctx = ctx, .opt = opt, .contours = contours, .heights = heights};
  st = prepare(&b, count);
  if (st >= 0) st = check_degree(&b, &degree);
  if (st >= 0) st = attempts(&b, degree);
  if (st >= 0) st = describe(&b, degree);
  if (st < 0) goto done;
  st = judge(&b);
  if (info) *info = b.info;
  *out = b.best.loft;
  b.best.loft = NULL;
  if (unconstrained) {
    *unconstrained = b.best.unconstrained;
    b.best.unconstrained = NULL;
  }
done:
  build_free(&b);
  return st;
}
