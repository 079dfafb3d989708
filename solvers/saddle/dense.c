/* LDL' (Bunch-Kaufman) and Householder QR of the whole scaled matrix [sK PS; SP' 0]: the general method and
 * cross-check, and the literal method of the paper. Both keep (N+k)^2 doubles. */
#include <float.h>
#include <string.h>

#include "system.h"

typedef struct assembly {
  double *a, scale;
  size_t order;
  bool mirror; /* both triangles are wanted */
} assembly;

static void store_tile(void *arg, size_t worker, const batten_saddle_tile *t) {
  const assembly *d = arg;
  (void)worker;
  for (size_t j = 0; j < t->cols; j++) {
    double *to = d->a + t->row0 + (t->col0 + j) * d->order;
    for (size_t i = 0; i < t->rows; i++) to[i] = d->scale * t->data[i + j * t->ld];
  }
  if (!d->mirror || t->row0 == t->col0) return;
  for (size_t i = 0; i < t->rows; i++) {
    double *to = d->a + t->col0 + (t->row0 + i) * d->order;
    for (size_t j = 0; j < t->cols; j++) to[j] = d->scale * t->data[i + j * t->ld];
  }
}

static batten_status assemble(batten_saddle *s, bool mirror) {
  size_t n = s->matrix.n, k = s->matrix.k, order = n + k;
  assembly d = {.a = s->a, .scale = s->scale, .order = order, .mirror = mirror};
  batten_status st = batten_saddle_walk(s, "assembly", NULL, true, store_tile, &d);
  if (st < 0) return st;
  for (size_t j = 0; j < n; j++)
    for (size_t c = 0; c < k; c++) s->a[n + c + j * order] = s->p_scale[c] * s->matrix.p[j + c * n];
  for (size_t c = 0; c < k; c++) {
    double *column = s->a + (n + c) * order;
    for (size_t i = 0; i < n; i++) column[i] = s->p_scale[c] * s->matrix.p[i + c * n];
    memset(column + n, 0, k * sizeof *column);
  }
  return BATTEN_OK;
}

size_t batten_saddle_dense_bytes(batten_saddle_method method, size_t n, size_t k) {
  size_t order, bytes, extra;
  if (!batten_add(n, k, &order) || !batten_mul3(order, order, sizeof(double), &bytes)) return SIZE_MAX;
  bool qr = method == BATTEN_SADDLE_QR;
  size_t work = (qr ? batten_la_geqrf_work(order, order) : batten_la_sytrf_work(order)) * sizeof(double);
  size_t condition = order * ((qr ? 3 : 2) * sizeof(double) + sizeof(batten_la_int));
  size_t solve = batten_saddle_solve_bytes(n, k); /* more than a walk's */
  extra = work > condition ? work : condition;
  if (solve > extra) extra = solve;
  extra += order * (qr ? sizeof(double) : sizeof(batten_la_int));
  return batten_add(bytes, extra, &bytes) ? bytes : SIZE_MAX;
}

/* After a factor with a zero on the diagonal: a pivot at rounding level lets inverse iteration find the null vector.
 */
static void mend_zero(batten_saddle *s, size_t at, double norm) {
  s->a[at + at * batten_saddle_order(s)] = DBL_EPSILON * (norm > 0 ? norm : 1);
}

static batten_status factor_ldl(batten_saddle *s) {
  size_t order = batten_saddle_order(s), zero = 0;
  s->pivots = batten_alloc_array(s->ctx, order, sizeof *s->pivots);
  if (!s->pivots) return BATTEN_E_NOMEM;
  double *work = batten_alloc_array(s->ctx, order, sizeof *work);
  if (!work) return BATTEN_E_NOMEM;
  double norm = batten_la_norm_sy(order, s->a, order, work);
  batten_free(s->ctx, work);
  batten_status st = batten_la_sytrf(s->ctx, order, s->a, order, s->pivots, &zero);
  if (st == BATTEN_E_SINGULAR) {
    mend_zero(s, zero, norm);
    return batten_saddle_dense_singular(s);
  }
  if (st < 0) return st;
  st = batten_la_sycon(s->ctx, order, s->a, order, s->pivots, norm, &s->info.rcond);
  if (st < 0) return st;
  return s->info.rcond < BATTEN_SADDLE_RCOND_MIN ? batten_saddle_dense_singular(s) : BATTEN_OK;
}

static batten_status factor_qr(batten_saddle *s) {
  size_t order = batten_saddle_order(s);
  s->tau = batten_alloc_array(s->ctx, order, sizeof *s->tau);
  if (!s->tau) return BATTEN_E_NOMEM;
  batten_status st = batten_la_geqrf(s->ctx, order, order, s->a, order, s->tau);
  if (st < 0) return st;
  bool zero = false;
  for (size_t j = 0; j < order; j++) {
    if (s->a[j + j * order] != 0) continue;
    zero = true;
    mend_zero(s, j, fabs(s->a[0]));
  }
  st = batten_la_trcon(s->ctx, order, s->a, order, &s->info.rcond);
  if (st < 0) return st;
  return zero || s->info.rcond < BATTEN_SADDLE_RCOND_MIN ? batten_saddle_dense_singular(s) : BATTEN_OK;
}

batten_status batten_saddle_dense_factor(batten_saddle *s, batten_saddle_method method) {
  size_t order = batten_saddle_order(s);
  double start = batten_now();
  batten_status st = BATTEN_E_NOMEM;
  s->a = batten_alloc_array(s->ctx, order * order, sizeof *s->a);
  if (!s->a) goto done;
  st = assemble(s, method == BATTEN_SADDLE_QR);
  if (st < 0) goto done;
  double assembled = batten_now();
  s->info.time_assemble_s = assembled - start;
  s->info.time_project_s = 0;
  st = batten_progress(s->ctx, "factor", 0);
  if (st < 0) goto done;
  st = method == BATTEN_SADDLE_QR ? factor_qr(s) : factor_ldl(s);
  s->info.time_factor_s = batten_now() - assembled;
  s->info.bytes = order * (order * sizeof *s->a + (s->tau ? sizeof *s->tau : sizeof *s->pivots));
done:
  if (st < 0) batten_saddle_dense_free(s);
  return st;
}

batten_status batten_saddle_dense_solve(const batten_saddle *s, size_t nrhs, double *b) {
  size_t order = batten_saddle_order(s);
  if (s->pivots) {
    batten_la_sytrs(order, nrhs, s->a, order, s->pivots, b, order);
    return BATTEN_OK;
  }
  batten_status st = batten_la_ormqr(s->ctx, 'T', order, nrhs, order, s->a, order, s->tau, b, order);
  if (st < 0) return st;
  batten_la_trsm(BATTEN_LA_DOUBLE, 'L', 'U', 'N', order, nrhs, 1, s->a, order, b, order);
  return BATTEN_OK;
}

void batten_saddle_dense_free(batten_saddle *s) {
  batten_free(s->ctx, s->a);
  batten_free(s->ctx, s->pivots);
  batten_free(s->ctx, s->tau);
  s->a = NULL;
  s->pivots = NULL;
  s->tau = NULL;
}

batten_status batten_saddle_dense_singular(const batten_saddle *s) {
  size_t n = s->matrix.n, order = batten_saddle_order(s), first = 0, second = 0;
  double *x = batten_alloc_array(s->ctx, order, sizeof *x);
  if (!x) return BATTEN_E_NOMEM;
  /* Any start that is not orthogonal to the null vector will do; two steps single it out. */
  for (size_t i = 0; i < order; i++) x[i] = 1 + fmod(0.6180339887498949 * (double)i, 1);
  batten_status st = BATTEN_OK;
  for (int step = 0; step < 2 && st == BATTEN_OK; step++) {
    double largest = 0;
    st = batten_saddle_dense_solve(s, 1, x);
    for (size_t i = 0; i < order; i++) largest = fmax(largest, fabs(x[i]));
    for (size_t i = 0; largest > 0 && i < order; i++) x[i] /= largest;
  }
  if (st < 0) goto done;
  for (size_t i = 1; i < n; i++)
    if (fabs(x[i]) > fabs(x[first])) first = i;
  second = first == 0 && n > 1;
  for (size_t i = 0; i < n; i++)
    if (i != first && fabs(x[i]) > fabs(x[second])) second = i;
  st = batten_fail(s->ctx, BATTEN_E_SINGULAR,
                   "matrix: singular to working precision; rows %zu and %zu take the largest part in it; merge "
                   "duplicate points or add to the diagonal",
                   first < second ? first : second, first < second ? second : first);
done:
  batten_free(s->ctx, x);
  return st;
}
