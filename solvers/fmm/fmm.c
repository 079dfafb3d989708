/* Plans of sums of radial kernels: making and applying. See <batten/fmm.h>, and fmm_inner.h for a map. */
#include "fmm/fmm_inner.h"

#include "base/checked.h"

#include <string.h>

batten_fmm_options batten_fmm_options_default(void) {
  return (batten_fmm_options){
      .struct_size = sizeof(batten_fmm_options), .accuracy = 1e-8, .cache_bytes = (size_t)1 << 30};
}

/* ---- direct or fast ---- */

/* Terms below which a tree is not even tried: some hundredths of a second at most, and less than its set-up. */
static const double DIRECT_TERMS = 4e6;

/* Points of a leaf: as many as make direct sums cost about what the translations do. */
static size_t leaf_points(unsigned n, unsigned order) {
  if (n == 2) return 6 * (size_t)order;
  return order <= 6 ? 128 : order <= 8 ? 224 : 384;
}

/* Whether terms summed directly cost less than what is left of them and the far fields. In units of a term of near.c
 * (0.4 ns): an operation of a small product costs a fortieth of it, those of polynomials an eighth. Operators that
 * have to be made are thought to serve PRODUCTS times. */
static bool is_direct_cheaper(const batten_fmm *f, fmm_orders orders, bool shared) {
  enum { PRODUCTS = 20 };
  const double order = orders.order, n = f->kernel.n, full = pow(order, n),
               rank = (double)batten_fmm_rank_guess(&f->kernel, orders.order);
  const double translations = (double)f->lists.kind_begin[f->lists.chunks * FMM_KINDS];
  const double points = (double)f->tree.sources.count + (double)f->tree.targets.count;
  const double fast = (double)f->lists.pairs + (double)f->lists.node_terms + translations * 2 * rank * rank / 40 +
                      (points * 2 * full + (double)f->tree.cells * 8 * n * full * order) / 8 +
                      (shared ? 0 : (n == 2 ? 7 : 16) * 2 * full * full * rank / 40 / PRODUCTS);
  return (double)f->sources.count * (double)f->targets.count < fast;
}

/* ---- making ---- */

batten_status batten_fmm_copy_points(batten_context *ctx, unsigned n, size_t count, const double *from,
                                     fmm_points *to) {
  to->block = batten_alloc_array(ctx, count * n, sizeof *to->block);
  if (!to->block) return BATTEN_E_NOMEM;
  to->count = count;
  for (unsigned a = 0; a < n; a++) {
    to->x[a] = to->block + a * count;
    for (size_t i = 0; i < count; i++) to->x[a][i] = from[i * n + a];
  }
  return BATTEN_OK;
}

/* Tree and lists, unless direct sums are cheaper; f->tree.cells = 0 then. */
static batten_status plan_tree(batten_context *ctx, batten_fmm *f, fmm_orders orders, bool shared) {
  const unsigned n = f->kernel.n;
  if ((double)f->sources.count * (double)f->targets.count <= DIRECT_TERMS) return BATTEN_OK;
  if (f->sources.count > UINT32_MAX || f->targets.count > UINT32_MAX)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu sources and %zu targets; each must be below 2^32",
                       f->sources.count, f->targets.count);
  size_t full = 1;
  for (unsigned a = 0; a < n; a++) full *= orders.order;
  batten_status st =
      batten_fmm_tree_new(ctx, n, &f->sources, &f->targets, f->same, 0, leaf_points(n, orders.order), &f->tree);
  if (st < 0) return st;
  if ((st = batten_fmm_lists_new(ctx, n, full, &f->tree, &f->lists)) < 0) return st;
  if (!is_direct_cheaper(f, orders, shared)) return BATTEN_OK;
  batten_fmm_lists_free(ctx, &f->lists);
  batten_fmm_tree_free(ctx, &f->tree);
  return BATTEN_OK;
}

batten_status batten_fmm_operators_get(batten_context *ctx, const batten_radial *kernel, fmm_orders orders,
                                       const batten_fmm *share, fmm_operators **out) {
  if (!share || !share->operators) return batten_fmm_operators_new(ctx, kernel, orders, out);
  *out = batten_fmm_operators_retain(share->operators);
  return BATTEN_OK;
}

/* What a plan has of operators, and how long they took. */
static batten_status plan_operators(batten_context *ctx, batten_fmm *f, fmm_orders orders, const batten_fmm *share) {
  const double start = batten_now();
  const batten_status st = batten_fmm_operators_get(ctx, &f->kernel, orders, share, &f->operators);
  if (!share || share->operators != f->operators) f->info.time_operators_s = batten_now() - start;
  return st;
}

static void describe(batten_fmm *f) {
  batten_fmm_info *i = &f->info;
  i->order = f->operators->order;
  i->rank = f->operators->rank;
  i->levels = f->tree.levels;
  i->cells = f->tree.cells;
  i->leaves = f->tree.leaves;
  i->pairs = f->lists.pairs;
  i->translations = f->lists.kind_begin[f->lists.chunks * FMM_KINDS];
}

batten_status batten_fmm_create(batten_context *ctx, const batten_radial *kernel, size_t source_count,
                                const double *sources, size_t target_count, const double *targets,
                                const batten_fmm_options *opt, batten_fmm **out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!kernel || !out) return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL", kernel ? "out" : "kernel");
  const batten_fmm_options options = opt ? *opt : batten_fmm_options_default();
  batten_status st = batten_fmm_check_plan(ctx, kernel, source_count, sources, target_count, targets, &options);
  if (st < 0) return st;
  const double start = batten_now();
  const size_t before = batten_bytes_in_use(ctx);
  const fmm_orders orders = batten_fmm_orders(kernel, options.accuracy, options.gradients || options.dipoles);
  st = BATTEN_E_NOMEM;
  batten_fmm *f = batten_alloc(ctx, sizeof *f);
  if (!f) goto done;
  *f = (batten_fmm){.ctx = ctx,
                    .kernel = *kernel,
                    .accuracy = options.accuracy,
                    .gradients = options.gradients,
                    .dipoles = options.dipoles,
                    .same = !targets};
  if ((st = batten_fmm_copy_points(ctx, kernel->n, source_count, sources, &f->sources)) < 0) goto done;
  if (f->same) {
    f->targets = f->sources;
    f->targets.block = NULL;
  } else if ((st = batten_fmm_copy_points(ctx, kernel->n, target_count, targets, &f->targets)) < 0) {
    goto done;
  }
  if ((st = plan_tree(ctx, f, orders, options.share && options.share->operators)) < 0) goto done;
  if (f->tree.cells) {
    if ((st = plan_operators(ctx, f, orders, options.share)) < 0) goto done;
    if ((st = batten_fmm_work_new(ctx, f)) < 0) goto done;
    describe(f);
  } else {
    f->info.direct = 1;
    batten_mul(source_count, target_count, &f->info.pairs);
  }
  f->info.bytes = batten_bytes_in_use(ctx) - before;
  if (options.share && options.share->operators == f->operators && f->operators) f->info.bytes += f->operators->bytes;
  f->info.time_plan_s = batten_now() - start - f->info.time_operators_s;
  *out = f;
  f = NULL;
done:
  batten_fmm_free(f);
  return st;
}

void batten_fmm_free(batten_fmm *f) {
  if (!f) return;
  batten_fmm_work_free(f->ctx, &f->work);
  batten_fmm_operators_free(f->operators);
  batten_fmm_lists_free(f->ctx, &f->lists);
  batten_fmm_tree_free(f->ctx, &f->tree);
  batten_free(f->ctx, f->targets.block);
  batten_free(f->ctx, f->sources.block);
  batten_free(f->ctx, f);
}

batten_fmm_info batten_fmm_get_info(const batten_fmm *fmm) { return fmm->info; }

/* ---- applying ---- */

static batten_status apply_directly(batten_context *ctx, batten_fmm *f, const double *weights, const double *dipoles,
                                    double *values, double *gradients) {
  const size_t count = f->targets.count, n = f->kernel.n;
  double *sums = batten_alloc_array(ctx, count, FMM_SUMS * sizeof *sums);
  if (!sums) return BATTEN_E_NOMEM;
  const batten_status st = batten_fmm_direct(ctx, f, weights, dipoles, gradients != NULL, count, NULL, sums);
  if (st >= 0 && values && count) memcpy(values, sums, count * sizeof *values);
  for (unsigned a = 0; a < n && gradients && st >= 0; a++)
    for (size_t i = 0; i < count; i++) gradients[i * n + a] = sums[(1 + a) * count + i];
  batten_free(ctx, sums);
  return st;
}

static batten_status apply_fast(batten_context *ctx, batten_fmm *f, const double *weights, const double *dipoles,
                                double *values, double *gradients) {
  const size_t count = f->tree.targets.count, n = f->kernel.n;
  const double *sums = f->work.sums;
  const batten_status st = batten_fmm_passes(ctx, f, weights, dipoles, gradients != NULL);
  if (st < 0) return st;
  for (size_t i = 0; i < f->targets.count; i++) {
    const size_t j = f->tree.target_place[i];
    if (values) values[i] = sums[j];
    for (unsigned a = 0; a < n && gradients; a++) gradients[i * n + a] = sums[(1 + a) * count + j];
  }
  return st;
}

batten_status batten_fmm_apply(batten_context *ctx, batten_fmm *fmm, const double *weights, const double *dipoles,
                               double *values, double *gradients) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!fmm) return batten_fail(ctx, BATTEN_E_INVALID, "fmm: NULL; make it with batten_fmm_create()");
  if (gradients && !fmm->gradients)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "gradients: asked of a plan without; set opt.gradients when it is made, or pass NULL");
  batten_status st = batten_fmm_check_terms(ctx, fmm, weights, dipoles);
  if (st < 0) return st;
  const double start = batten_now();
  st = (fmm->operators ? apply_fast : apply_directly)(ctx, fmm, weights, dipoles, values, gradients);
  if (st >= 0) fmm->info.time_apply_s = batten_now() - start;
  return st;
}

/* ---- memory told beforehand ---- */

/* Sums that stay too large once they are. */
static size_t plus(size_t a, size_t b) {
  size_t sum;
  batten_add(a, b, &sum);
  return sum;
}
static size_t times(size_t a, size_t b) {
  size_t product;
  batten_mul(a, b, &product);
  return product;
}

size_t batten_fmm_bytes(const batten_radial *kernel, size_t source_count, size_t target_count,
                        const batten_fmm_options *opt) {
  const batten_fmm_options o = opt ? *opt : batten_fmm_options_default();
  const size_t n = kernel->n,
               leaf_split = n == 2 ? 6 : 10; /* 2^n / (1 - 2^-n): cells for leaves that are 2^-n full */
  const size_t points = plus(source_count, target_count);
  /* Copies in the caller's order and in that of the tree, places, records with their spare, terms and sums. */
  size_t bytes = plus(sizeof(batten_fmm), times(points, 2 * n * sizeof(double) + 4 + 64 + 5 * sizeof(double)));
  if ((double)source_count * (double)target_count <= DIRECT_TERMS) return bytes;
  const fmm_orders orders = batten_fmm_orders(kernel, o.accuracy, o.gradients || o.dipoles);
  const size_t leaf = leaf_points(kernel->n, orders.order),
               full = n == 2 ? orders.order * orders.order : orders.order * orders.order * orders.order;
  const size_t rank = batten_fmm_rank_guess(kernel, orders.order), stride = rank + FMM_PANEL;
  const size_t of_tree = source_count == target_count ? source_count : points; /* one cloud as a rule, or two */
  const size_t cells = plus(times(of_tree / leaf, leaf_split), 64);
  const size_t lists = n == 2 ? 27 * sizeof(fmm_translation) + 9 * 4 : 189 * sizeof(fmm_translation) + 27 * 4;
  const size_t each =
      (full + 2 * stride) * sizeof(double) + sizeof(fmm_cell) + lists + 4 * FMM_LISTS * sizeof(size_t);
  size_t levels = 2;
  for (size_t left = of_tree / leaf; left > 1; left /= 4) levels++;
  bytes = plus(bytes, times(cells, each));
  /* Scratch of a pass, and copies of the transfers for each level where the kernel has a logarithm. */
  const size_t across = 96 * stride, others = 7 * full, kinds = n == 2 ? 12 : 56,
               copies = kernel->logarithm ? levels * kinds * stride * rank : 0;
  const size_t later = (size_t)FMM_GROUP * (across > others ? across : others) + copies;
  return plus(bytes, batten_fmm_operator_bytes(kernel, orders, later));
}
