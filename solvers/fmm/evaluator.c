/* Evaluators of one sum at many points: making, asking, freeing. See <batten/fmm.h>, and fmm_inner.h for a map.
 *
 * The far field of every cell of sources is made once. Targets have a tree of their own (nodes.c), which depends on
 * the sources alone and grows where targets come: neither the values nor what they cost depend on how the host cuts
 * its points into batches. Of the lists of a plan (lists.c) only two are left, translations and near cells: a leaf of
 * targets is as large as its near sources allow, however many targets it gets, so that none is so much larger than a
 * near cell of sources that the cell's far field at nodes would pay.
 *
 * Points outside of the root need the moments of the largest cells only. With MARGIN m the sources' box of side d has
 * a distance of m d from the root's faces, and the root's half H is below 8/7 (1 + 2 m) d = 4.6 d: power of two, and
 * corners in eighths of the side. A cell of half h is not apart from such a point (batches.c) only when
 * m d - h < 3 h, h > 0.375 d > H / 13: levels 0 to 3. Their children are the last that are looked at. */
#include "fmm/evaluator.h"

#include "base/checked.h"

#include <string.h>

static const double MARGIN = 1.5;

/* Sources up to which sums are direct: there they cost less than the nodes of nearby targets. */
static const size_t DIRECT_SOURCES = 3000;

/* Sources that are summed directly at each target rather than through more places. Measured for three targets to a
 * source near a surface: half of it makes places dear, twice of it makes targets dear. The work for a place grows
 * like order^(2 n - 2), that for a target like order^n. */
static size_t near_most(unsigned n, unsigned order) { return n == 2 ? 48 * order : 12 * (size_t)order * order; }

/* ---- making ---- */

/* Far fields of all cells; of the top levels also the weights at their nodes. */
static batten_status make_far_fields(batten_context *ctx, batten_fmm_evaluator *e) {
  const fmm_operators *o = e->operators;
  const fmm_far at = {o, batten_fmm_lanes_now()};
  const unsigned top = e->tree.levels < FMM_TOP_LEVELS ? e->tree.levels : FMM_TOP_LEVELS;
  batten_status st = BATTEN_E_NOMEM;
  double *scratch = NULL, *tensors = batten_alloc_array(ctx, e->tree.cells, o->full * sizeof *tensors);
  if (!tensors) goto done;
  scratch = batten_alloc_array(ctx, FMM_GROUP, batten_fmm_scratch(o) * sizeof *scratch);
  e->outer = batten_alloc_array(ctx, e->tree.cells, o->stride * sizeof *e->outer);
  if (!scratch || !e->outer) goto done;
  st = batten_fmm_climb(ctx, &at, &e->tree, &e->terms, e->dipoles, tensors, e->outer, scratch);
  if (st < 0) goto done;
  e->top_cells = e->tree.level_first[top];
  st = BATTEN_E_NOMEM;
  e->top = batten_alloc_array(ctx, e->top_cells, o->full * sizeof *e->top);
  if (!e->top) goto done;
  for (size_t i = 0; i < e->top_cells; i++) {
    const double *w =
        batten_fmm_through(&at, (const double(*)[FMM_ORDER_MAX])o->at_nodes, tensors + i * o->full, scratch);
    memcpy(e->top + i * o->full, w, o->full * sizeof *w);
  }
  st = BATTEN_OK;
done:
  batten_free(ctx, scratch);
  batten_free(ctx, tensors);
  return st;
}

static batten_status make_terms(batten_context *ctx, batten_fmm_evaluator *e, const double *weights,
                                const double *dipoles) {
  const unsigned n = e->kernel.n;
  e->term_block = batten_alloc_array(ctx, e->tree.sources.count, (dipoles ? 1 + n : 1) * sizeof *e->term_block);
  if (!e->term_block) return BATTEN_E_NOMEM;
  batten_fmm_set_terms(&e->tree.sources, e->tree.source_place, n, e->source_count, weights, dipoles, e->term_block,
                       &e->terms);
  return BATTEN_OK;
}

static batten_status make_fast(batten_context *ctx, batten_fmm_evaluator *e, const fmm_points *sources,
                               fmm_orders orders, const batten_fmm *share) {
  const double start = batten_now();
  if (e->source_count > UINT32_MAX)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu sources; must be below 2^32", e->source_count);
  batten_status st = batten_fmm_operators_get(ctx, &e->kernel, orders, share, &e->operators);
  if (st < 0) return st;
  if (!share || share->operators != e->operators) e->info.time_operators_s = batten_now() - start;
  const size_t leaf = near_most(e->kernel.n, orders.order) / 16;
  e->near_most = near_most(e->kernel.n, orders.order);
  return batten_fmm_tree_new(ctx, e->kernel.n, sources, sources, true, MARGIN, leaf, &e->tree);
}

static void describe(batten_fmm_evaluator *e) {
  batten_fmm_evaluator_info *i = &e->info;
  i->direct = !e->operators;
  if (!e->operators) return;
  i->order = e->operators->order;
  i->rank = e->operators->rank;
  i->levels = e->tree.levels;
  i->cells = e->tree.cells;
  i->leaves = e->tree.leaves;
}

static batten_status check(batten_context *ctx, const batten_radial *kernel, size_t source_count,
                           const double *sources, const double *weights, const double *dipoles,
                           const batten_fmm_options *opt) {
  batten_status st = batten_fmm_check_plan(ctx, kernel, source_count, sources, source_count, NULL, opt);
  if (st < 0) return st;
  if (!dipoles != !opt->dipoles)
    return batten_fail(ctx, BATTEN_E_INVALID, "dipoles: %s; opt.dipoles must say whether there are any",
                       dipoles ? "given with opt.dipoles = 0" : "NULL with opt.dipoles");
  return batten_fmm_check_weights(ctx, kernel->n, source_count, weights, dipoles);
}

batten_status batten_fmm_evaluator_new(batten_context *ctx, const batten_radial *kernel, size_t source_count,
                                       const double *sources, const double *weights, const double *dipoles,
                                       const batten_fmm_options *opt, batten_fmm_evaluator **out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!kernel || !out) return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL", kernel ? "out" : "kernel");
  const batten_fmm_options options = opt ? *opt : batten_fmm_options_default();
  batten_status st = check(ctx, kernel, source_count, sources, weights, dipoles, &options);
  if (st < 0) return st;
  const double start = batten_now();
  const size_t before = batten_bytes_in_use(ctx);
  const fmm_orders orders = batten_fmm_orders(kernel, options.accuracy, options.gradients || options.dipoles);
  fmm_points points = {0};
  st = BATTEN_E_NOMEM;
  batten_fmm_evaluator *e = batten_alloc(ctx, sizeof *e);
  if (!e) goto done;
  *e = (batten_fmm_evaluator){.ctx = ctx,
                              .kernel = *kernel,
                              .gradients = options.gradients,
                              .source_count = source_count,
                              .tree.same = true,
                              .dipoles = dipoles != NULL,
                              .cache_bytes = options.cache_bytes};
  if ((st = batten_fmm_copy_points(ctx, kernel->n, source_count, sources, &points)) < 0) goto done;
  if (source_count > DIRECT_SOURCES) {
    st = make_fast(ctx, e, &points, orders, options.share);
  } else {
    e->tree.sources = points;
    points.block = NULL;
  }
  if (st < 0 || (st = make_terms(ctx, e, weights, dipoles)) < 0) goto done;
  if (e->operators && (st = make_far_fields(ctx, e)) < 0) goto done;
  batten_free(ctx, points.block);
  points.block = NULL;
  describe(e);
  e->info.bytes = batten_bytes_in_use(ctx) - before;
  if (options.share && e->operators && options.share->operators == e->operators) e->info.bytes += e->operators->bytes;
  e->info.time_sources_s = batten_now() - start - e->info.time_operators_s;
  *out = e;
  e = NULL;
done:
  batten_free(ctx, points.block);
  batten_fmm_evaluator_free(e);
  return st;
}

void batten_fmm_evaluator_free(batten_fmm_evaluator *e) {
  if (!e) return;
  batten_fmm_nodes_drop(e);
  for (unsigned level = 0; level < FMM_LEVELS_MAX; level++) batten_free(e->ctx, e->level_transfer[level]);
  batten_free(e->ctx, e->top);
  batten_free(e->ctx, e->outer);
  batten_free(e->ctx, e->term_block);
  batten_fmm_tree_free(e->ctx, &e->tree);
  batten_fmm_operators_free(e->operators);
  batten_free(e->ctx, e);
}

/* ---- asking ---- */

batten_fmm_evaluator_info batten_fmm_evaluator_get_info(const batten_fmm_evaluator *e) {
  batten_fmm_evaluator_info i = e->info;
  const fmm_nodes *t = &e->nodes;
  i.nodes = t->count;
  i.bytes += t->room * sizeof *t->node + t->near_room * sizeof *t->near + t->slab_room * sizeof *t->slab;
  if (!e->operators) return i;
  i.bytes += t->slabs * FMM_SLAB_NODES * e->operators->full * sizeof(double);
  for (unsigned level = 0; level < FMM_LEVELS_MAX; level++)
    if (e->level_transfer[level]) i.bytes += batten_fmm_level_transfer_bytes(e->operators);
  return i;
}

/* Room for the results, for which an evaluator gives up its nodes. */
static double *make_results(batten_context *ctx, batten_fmm_evaluator *e, size_t count, size_t each) {
  double *results = batten_alloc_array(ctx, count, each * sizeof *results);
  if (results || !e->nodes.count) return results;
  batten_fmm_nodes_drop(e);
  e->info.drops++;
  results = batten_alloc_array(ctx, count, each * sizeof *results);
  if (results) batten_expect(ctx, BATTEN_E_NOMEM, BATTEN_E_NOMEM); /* nothing is left to be told */
  return results;
}

batten_status batten_fmm_evaluator_evaluate(batten_context *ctx, batten_fmm_evaluator *e, size_t count,
                                            const double *points, double *values, double *gradients) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!e) return batten_fail(ctx, BATTEN_E_INVALID, "e: NULL; make it with batten_fmm_evaluator_new()");
  if (e->ctx != ctx)
    return batten_fail(ctx, BATTEN_E_INVALID, "e: made with another context; pass the one it was made with");
  if (gradients && !e->gradients)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "gradients: asked of an evaluator without; set opt.gradients when it is made, or pass NULL");
  const size_t n = e->kernel.n;
  batten_status st = batten_fmm_check_points(ctx, "points", (unsigned)n, count, points);
  if (st < 0) return st;
  const double start = batten_now();
  double *u = make_results(ctx, e, count, gradients ? 1 + n : 1), *g = gradients ? u + count : NULL;
  if (!u) return BATTEN_E_NOMEM;
  st = batten_fmm_batch(ctx, e, count, points, u, g);
  if (st >= 0 && values && count) memcpy(values, u, count * sizeof *u);
  if (st >= 0 && g && count) memcpy(gradients, g, count * n * sizeof *g);
  if (st >= 0) e->info.time_evaluate_s = batten_now() - start;
  batten_free(ctx, u);
  return st;
}
