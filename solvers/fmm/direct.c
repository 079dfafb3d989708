/* Sums without a tree: for problems where they are faster, and to judge a product. */
#include "fmm/fmm_inner.h"

#include "base/checked.h"

/* Sums over all sources at some targets, or all of them. */
typedef struct direct_sums {
  const batten_fmm *fmm;
  fmm_near_function *near;
  fmm_terms terms;
  size_t count;      /* of targets */
  const size_t *at;  /* [count] which ones; NULL: 0 .. count - 1 */
  double *sums;      /* [FMM_SUMS][count] */
  size_t first_task; /* of the piece that runs */
} direct_sums;

enum { TASK_TARGETS = 64 };

static void direct_task(void *arg, size_t index) {
  const direct_sums *d = arg;
  const size_t begin = (d->first_task + index) * TASK_TARGETS;
  const size_t end = d->count - begin < TASK_TARGETS ? d->count : begin + TASK_TARGETS;
  for (size_t i0 = begin; i0 < end; i0 += FMM_LANES) {
    double x[3][FMM_LANES] = {{0}}, sums[FMM_SUMS][FMM_LANES] = {{0}};
    for (size_t lane = 0; lane < FMM_LANES; lane++) {
      const size_t i = i0 + lane < end ? i0 + lane : end - 1; /* lanes left over repeat the last point */
      for (unsigned a = 0; a < d->fmm->kernel.n; a++) x[a][lane] = d->fmm->targets.x[a][d->at ? d->at[i] : i];
    }
    d->near(&d->terms, 0, d->fmm->sources.count, (const double(*)[FMM_LANES])x, sums);
    for (size_t lane = 0; lane < FMM_LANES && i0 + lane < end; lane++)
      for (unsigned q = 0; q < FMM_SUMS; q++) d->sums[q * d->count + i0 + lane] = sums[q][lane];
  }
}

/* Terms between two calls of the host's progress callback: some hundredths of a second. */
static const size_t TERMS_PROGRESS = 64000000;

/* Weights and dipoles as the inner loops read them, then the sums. */
batten_status batten_fmm_direct(batten_context *ctx, const batten_fmm *f, const double *weights,
                                const double *dipoles, bool gradients, size_t count, const size_t *at, double *sums) {
  const size_t sources = f->sources.count, n = f->kernel.n;
  direct_sums d = {.fmm = f, .count = count, .at = at, .sums = sums};
  batten_status st = BATTEN_OK;
  double *block = batten_alloc_array(ctx, sources * (dipoles ? 1 + n : 1), sizeof *block);
  if (!block) return BATTEN_E_NOMEM;
  batten_fmm_set_terms(&f->sources, NULL, (unsigned)n, sources, weights, dipoles, block, &d.terms);
  d.near = batten_fmm_lanes_now()->near((unsigned)n, (unsigned)f->kernel.power, gradients, dipoles != NULL);
  const size_t tasks = (d.count + TASK_TARGETS - 1) / TASK_TARGETS;
  const size_t piece = TERMS_PROGRESS / TASK_TARGETS / (sources ? sources : 1) + 1;
  for (size_t first = 0; first < tasks && st >= 0; first += piece) {
    st = batten_progress(ctx, "sums", (double)first / (double)tasks);
    d.first_task = first;
    if (st >= 0) batten_parallel(ctx, tasks - first < piece ? tasks - first : piece, direct_task, &d);
  }
  batten_free(ctx, block);
  return st;
}

/* ---- judging ---- */

/* Rows out of count, drawn without repetition and in order by Knuth's algorithm S; splitmix64 for the numbers. */
static void draw_rows(size_t count, size_t rows, uint64_t seed, size_t *at) {
  for (size_t i = 0, taken = 0; taken < rows; i++) {
    uint64_t z = (seed += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    const double u = (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
    if (u * (double)(count - i) < (double)(rows - taken)) at[taken++] = i;
  }
}

/* Norm of the difference to columns q0 .. q1 - 1 of the direct sums, over their norm. */
static double relative_error(size_t count, const size_t *at, const double *sums, unsigned q0, unsigned q1,
                             const double *given, size_t stride) {
  double largest = 0, difference = 0, norm = 0;
  for (size_t i = q0 * count; i < q1 * count; i++) largest = fmax(largest, fabs(sums[i]));
  const double unit = largest > 0 ? batten_unit(largest) : 1; /* so that squares neither over- nor underflow */
  for (unsigned q = q0; q < q1; q++)
    for (size_t i = 0; i < count; i++) {
      const double sum = sums[q * count + i], e = given[at[i] * stride + q - q0] - sum;
      difference += (e * unit) * (e * unit);
      norm += (sum * unit) * (sum * unit);
    }
  return difference == 0 ? 0 : sqrt(difference / norm);
}

batten_status batten_fmm_error(batten_context *ctx, const batten_fmm *fmm, const double *weights,
                               const double *dipoles, const double *values, const double *gradients, size_t rows,
                               uint64_t seed, double *value_error, double *gradient_error) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!fmm) return batten_fail(ctx, BATTEN_E_INVALID, "fmm: NULL; make it with batten_fmm_create()");
  if (!values != !value_error || !gradients != !gradient_error)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL without the other of the pair; give both or none",
                       !values != !value_error ? "values, value_error" : "gradients, gradient_error");
  batten_status st = batten_fmm_check_terms(ctx, fmm, weights, dipoles);
  if (st < 0) return st;
  const size_t count = rows < fmm->targets.count ? rows : fmm->targets.count;
  size_t *at = batten_alloc_array(ctx, count, sizeof *at);
  double *sums = batten_alloc_array(ctx, count, FMM_SUMS * sizeof *sums);
  st = BATTEN_E_NOMEM;
  if (!at || !sums) goto done;
  draw_rows(fmm->targets.count, count, seed, at);
  st = batten_fmm_direct(ctx, fmm, weights, dipoles, gradients != NULL, count, at, sums);
  if (st < 0) goto done;
  if (value_error) *value_error = relative_error(count, at, sums, 0, 1, values, 1);
  if (gradient_error)
    *gradient_error = relative_error(count, at, sums, 1, 1 + fmm->kernel.n, gradients, fmm->kernel.n);
done:
  batten_free(ctx, sums);
  batten_free(ctx, at);
  return st;
}
