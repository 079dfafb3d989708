/* Householder projection onto the null space of P', and Cholesky there.
 *
 * P S = Q [R; 0] Pi' with Q = I - V T V' from k reflectors. With w = Q u the second block row says R' u1 = 0, and
 * B = Q' K Q splits into a positive definite system for u2 and a small one for c:
 *     b22 u2 = (Q'f)_2,    R Pi' c = (Q'f)_1 - b21' u2.
 * B = K - V X' - X V' with Y = K V T, M = T' V' Y, X = Y - V M / 2 (LAPACK's two-sided update, Dongarra, Sorensen,
 * Hammarling 1989). K is walked twice: for Y, and to bring B home tile by tile, the update done in double while
 * the tile is in cache. So each entry of a float b22 is rounded once, and memory is written once.
 * The first k columns of B stay in double, b22 in packed storage of the precision asked for. */
#include <float.h>
#include <string.h>

#include "rfp.h"
#include "system.h"

static const batten_la_real D = BATTEN_LA_DOUBLE;

/* ---- QR of P ---- */

void batten_saddle_qr_free(batten_saddle *s) {
  batten_free(s->ctx, s->qr.v);
  batten_free(s->ctx, s->qr.t);
  batten_free(s->ctx, s->qr.r);
  batten_free(s->ctx, s->qr.pivots);
  s->qr = (batten_saddle_qr){0};
}

/* SINGULAR when a diagonal entry of R is rounding: columns of P are then dependent on the points given. */
static batten_status check_rank(batten_saddle *s) {
  size_t n = s->matrix.n, k = s->matrix.k;
  const double *r = s->qr.r;
  /* The columns have size 1; factoring n rows perturbs R by about n eps of its largest entry. */
  double smallest = (double)(n > 10 ? n : 10) * DBL_EPSILON * fabs(r[0]);
  for (size_t j = 0; j < k; j++) {
    if (fabs(r[j + j * k]) > smallest) continue;
    return batten_fail(s->ctx, BATTEN_E_SINGULAR,
                       "matrix.p: column %zu depends on the others, rank %zu of %zu (coplanar or too few points?); "
                       "lower the polynomial degree or add points off the plane",
                       s->qr.pivots[j], j, k);
  }
  return BATTEN_OK;
}

batten_status batten_saddle_qr_new(batten_saddle *s) {
  size_t n = s->matrix.n, k = s->matrix.k;
  batten_saddle_qr *qr = &s->qr;
  batten_status st = BATTEN_E_NOMEM;
  double *tau = NULL;
  if (k == 0) return BATTEN_OK;
  qr->v = batten_alloc_array(s->ctx, n * k, sizeof *qr->v);
  if (!qr->v) goto done;
  qr->t = batten_alloc_array(s->ctx, k * k, sizeof *qr->t);
  if (!qr->t) goto done;
  qr->r = batten_alloc_array(s->ctx, k * k, sizeof *qr->r);
  if (!qr->r) goto done;
  qr->pivots = batten_alloc_array(s->ctx, k, sizeof *qr->pivots);
  if (!qr->pivots) goto done;
  tau = batten_alloc_array(s->ctx, k, sizeof *tau);
  if (!tau) goto done;
  for (size_t c = 0; c < k; c++)
    for (size_t i = 0; i < n; i++) qr->v[i + c * n] = s->matrix.p[i + c * n] * s->p_scale[c];
  st = batten_la_geqp3(s->ctx, n, k, qr->v, n, qr->pivots, tau);
  if (st < 0) goto done;
  batten_la_larft(n, k, qr->v, n, tau, qr->t, k);
  for (size_t c = 0; c < k; c++)
    for (size_t i = 0; i < k; i++) {
      bool upper = i <= c;
      qr->r[i + c * k] = upper ? qr->v[i + c * n] : 0;
      if (upper)
        qr->v[i + c * n] = i == c;
      else
        qr->t[i + c * k] = 0;
    }
  st = check_rank(s);
done:
  batten_free(s->ctx, tau);
  if (st < 0) batten_saddle_qr_free(s);
  return st;
}

/* x := Q x or Q' x for m columns, x [m][N]; work [2][k]. Column by column: m is small or k is. */
static void apply_q(const batten_saddle *s, bool transposed, size_t m, double *x, double *work) {
  size_t n = s->matrix.n, k = s->matrix.k;
  double *projected = work, *combined = work + k;
  for (size_t j = 0; j < m && k > 0; j++) {
    double *column = x + j * n;
    batten_la_gemv(D, 'T', n, k, 1, s->qr.v, n, column, 0, projected);
    batten_la_gemv(D, transposed ? 'T' : 'N', k, k, 1, s->qr.t, k, projected, 0, combined);
    batten_la_gemv(D, 'N', n, k, -1, s->qr.v, n, combined, 1, column);
  }
}

/* to := from, rounded to real. */
static void copy_to(batten_la_real real, size_t count, const double *from, double factor, void *to) {
  if (real == BATTEN_LA_DOUBLE) {
    double *d = to;
    for (size_t i = 0; i < count; i++) d[i] = factor * from[i];
  } else {
    float *f = to;
    for (size_t i = 0; i < count; i++) f[i] = (float)(factor * from[i]);
  }
}

static void copy_from(batten_la_real real, size_t count, const void *from, double factor, double *to) {
  if (real == BATTEN_LA_DOUBLE) {
    const double *d = from;
    for (size_t i = 0; i < count; i++) to[i] = factor * d[i];
  } else {
    const float *f = from;
    for (size_t i = 0; i < count; i++) to[i] = factor * (double)f[i];
  }
}

static batten_rfp trailing(const batten_saddle *s) {
  return batten_rfp_view(s->real, s->matrix.n - s->matrix.k, s->rfp);
}

/* ---- Projection ---- */

/* x [k][N] := X = Y - V M / 2, Y = s K V T, M = T' V' Y. */
static batten_status projection(batten_saddle *s, double *x) {
  size_t n = s->matrix.n, k = s->matrix.k;
  const batten_saddle_qr *qr = &s->qr;
  batten_status st = BATTEN_E_NOMEM;
  double *m = NULL, *z = batten_alloc_array(s->ctx, n * k, sizeof *z);
  if (!z) goto done;
  m = batten_alloc_array(s->ctx, k * k, 2 * sizeof *m);
  if (!m) goto done;
  batten_la_gemm(D, 'N', 'N', n, k, k, s->scale, qr->v, n, qr->t, k, 0, z, n);
  st = batten_saddle_product(s, "projection", false, k, z, x);
  if (st < 0) goto done;
  batten_la_gemm(D, 'T', 'N', k, k, n, 1, qr->v, n, x, n, 0, m, k);
  batten_la_gemm(D, 'T', 'N', k, k, k, 1, qr->t, k, m, k, 0, m + k * k, k);
  batten_la_gemm(D, 'N', 'N', n, k, k, -0.5, qr->v, n, m + k * k, k, 1, x, n);
done:
  batten_free(s->ctx, m);
  batten_free(s->ctx, z);
  return st;
}

typedef struct assembly {
  const batten_saddle *s;
  const double *x; /* [k][N] */
  batten_rfp b22;
} assembly;

/* column[i] = s K - V X' - X V' for count rows from row0 of column col. */
static void project_column(const batten_saddle *s, const double *x, size_t row0, size_t count, size_t col,
                           double *restrict column) {
  size_t n = s->matrix.n;
  for (size_t i = 0; i < count; i++) column[i] *= s->scale;
  for (size_t q = 0; q < s->matrix.k; q++) {
    const double *v = s->qr.v + q * n, *xq = x + q * n;
    double of_x = xq[col], of_v = v[col];
    for (size_t i = 0; i < count; i++) column[i] -= v[row0 + i] * of_x + xq[row0 + i] * of_v;
  }
}

/* Tiles do not straddle k and k + n1: each lies in the head, in the trapezoid, or (across) in the upper triangle. */
static void store_tile(void *arg, size_t worker, const batten_saddle_tile *t) {
  const assembly *d = arg;
  const batten_rfp *b = &d->b22;
  const batten_saddle *s = d->s;
  size_t k = s->matrix.k;
  (void)worker;
  if (t->across) {
    size_t col = t->col0 - k - b->n1, row = t->row0 - k - b->n1;
    for (size_t i = 0; i < t->rows; i++) {
      size_t count = t->row0 == t->col0 ? i + 1 : t->cols;
      project_column(s, d->x, t->col0, count, t->row0 + i, t->data + i * t->ld);
      copy_to(b->real, count, t->data + i * t->ld, 1, batten_la_at(b->real, b->b22, col + (row + i) * b->ld));
    }
    return;
  }
  for (size_t j = 0; j < t->cols; j++) {
    size_t col = t->col0 + j, skip = col >= k && t->row0 == t->col0 ? j : 0, count = t->rows - skip;
    double *column = t->data + skip + j * t->ld;
    project_column(s, d->x, t->row0 + skip, count, col, column);
    if (col < k)
      copy_to(D, count, column, 1, s->head + t->row0 + col * s->matrix.n);
    else
      copy_to(b->real, count, column, 1, batten_la_at(b->real, b->b11, t->row0 + skip - k + (col - k) * b->ld));
  }
}

/* head and b22 := the blocks of Q' s K Q. */
static batten_status assemble(batten_saddle *s, const double *x) {
  assembly d = {.s = s, .x = x, .b22 = trailing(s)};
  size_t k = s->matrix.k, breaks[2] = {k, k + d.b22.n1};
  batten_status st = batten_saddle_walk(s, "assembly", breaks, true, store_tile, &d);
  for (size_t j = 0; j < k && st == BATTEN_OK; j++) /* blocks above the diagonal, when k spans several */
    for (size_t i = 0; i < j; i++) s->head[i + j * s->matrix.n] = s->head[j + i * s->matrix.n];
  return st;
}

/* ---- Factor ---- */

typedef struct inverse {
  batten_rfp b22;
  void *rounded; /* [N-k] in b22's precision */
} inverse;

/* x := b22^-1 x. x is brought to size 1 first, so that a small residual survives in float. */
static void apply_inverse(void *arg, double *x) {
  inverse *v = arg;
  double largest = 0;
  for (size_t i = 0; i < v->b22.n; i++) largest = fmax(largest, fabs(x[i]));
  if (!(largest > 0 && largest <= DBL_MAX)) return;
  double unit = batten_unit(largest);
  copy_to(v->b22.real, v->b22.n, x, unit, v->rounded);
  batten_rfp_forward(&v->b22, 1, v->rounded, v->b22.n);
  batten_rfp_backward(&v->b22, 1, v->rounded, v->b22.n);
  copy_from(v->b22.real, v->b22.n, v->rounded, 1 / unit, x);
}

/* Smallest pivot over the largest that a float factor may have. Duplicates leave up to some hundred eps where 0
 * should be; kernel r on distinct points has about their smallest distance over the box, 1e4 eps and more. */
static const double PIVOT_MIN_FLOAT = 1024 * (double)FLT_EPSILON;

/* rcond from the norm of b22 and its factor; SINGULAR when solves would have no correct digit left. */
static batten_status condition(batten_saddle *s, double norm) {
  inverse v = {.b22 = trailing(s)};
  double inverse_norm = 0;
  v.rounded = batten_alloc_array(s->ctx, v.b22.n, (size_t)s->real);
  if (!v.rounded) return BATTEN_E_NOMEM;
  batten_status st = batten_la_norm1_estimate(s->ctx, v.b22.n, apply_inverse, &v, &inverse_norm);
  batten_free(s->ctx, v.rounded);
  if (st < 0) return st;
  s->info.rcond = v.b22.n == 0 ? 1 : 1 / (norm * inverse_norm);
  /* Double: no correct digit would be left. Float: a pivot may be nothing but rounding. Whether
   * refinement with a float factor contracts is seen when it is tried: rounding hits far less than eps / rcond says.
   */
  double pivot;
  size_t row = batten_rfp_weakest(&v.b22, &pivot);
  bool usable = s->real == BATTEN_LA_DOUBLE ? s->info.rcond >= BATTEN_SADDLE_RCOND_MIN : pivot >= PIVOT_MIN_FLOAT;
  if (!usable)
    return batten_fail(s->ctx, BATTEN_E_SINGULAR,
                       "matrix: not positive definite at row %zu to working precision: rcond %.3g", s->matrix.k + row,
                       s->info.rcond);
  return BATTEN_OK;
}

size_t batten_saddle_project_bytes(batten_la_real real, size_t n, size_t k) {
  size_t rest = n - k, packed, head, bytes;
  if (!batten_rfp_count(rest, &packed) || !batten_mul(packed, (size_t)real, &packed) ||
      !batten_mul3(n, k, sizeof(double), &head))
    return SIZE_MAX;
  /* X, Z and the product that makes X: more than X and the tiles of the assembly. */
  size_t scratch = 2 * head + 2 * k * k * sizeof(double) + batten_saddle_product_bytes(n, k);
  size_t norms = rest * (2 * sizeof(double) + sizeof(batten_la_int) + (size_t)real);
  size_t solve = batten_saddle_solve_bytes(n, k);
  if (norms > scratch) scratch = norms;
  if (solve > scratch) scratch = solve;
  return batten_add(packed, head, &bytes) && batten_add(bytes, scratch, &bytes) ? bytes : SIZE_MAX;
}

batten_status batten_saddle_project_factor(batten_saddle *s, batten_la_real real) {
  size_t n = s->matrix.n, k = s->matrix.k, count = 0, failed;
  double start = batten_now();
  batten_status st = BATTEN_E_NOMEM;
  double *sums = NULL, *x = NULL;
  batten_rfp_count(n - k, &count);
  s->real = real;
  s->rfp = batten_alloc_array(s->ctx, count, (size_t)real); /* the large one first: the work is lost without it */
  if (!s->rfp) goto done;
  s->head = batten_alloc_array(s->ctx, n * k, sizeof *s->head);
  if (!s->head) goto done;
  x = batten_alloc_array(s->ctx, n * k, sizeof *x);
  if (!x) goto done;
  st = k > 0 ? projection(s, x) : BATTEN_OK;
  if (st < 0) goto done;
  double projected = batten_now();
  s->info.time_project_s = projected - start;

  st = assemble(s, x);
  if (st < 0) goto done;
  batten_free(s->ctx, x);
  x = NULL;
  double assembled = batten_now();
  s->info.time_assemble_s = assembled - projected;

  batten_rfp b22 = trailing(s);
  st = BATTEN_E_NOMEM;
  sums = batten_alloc_array(s->ctx, n - k, sizeof *sums);
  if (!sums) goto done;
  double norm = batten_rfp_norm1(&b22, sums);
  st = batten_rfp_cholesky(s->ctx, &b22, &failed);
  if (st == BATTEN_E_SINGULAR) /* rows below the first k keep their place in the projection */
    batten_fail(s->ctx, st, "matrix: not positive definite at row %zu", k + failed - 1);
  if (st < 0) goto done;
  batten_free(s->ctx, sums);
  sums = NULL;
  st = condition(s, norm);
  s->info.time_factor_s = batten_now() - assembled;
  s->info.bytes = count * (size_t)real + n * k * sizeof(double);
done:
  batten_free(s->ctx, x);
  batten_free(s->ctx, sums);
  if (st < 0) batten_saddle_project_free(s);
  return st;
}

void batten_saddle_project_free(batten_saddle *s) {
  batten_free(s->ctx, s->head);
  batten_free(s->ctx, s->rfp);
  s->head = NULL;
  s->rfp = NULL;
}

/* ---- Solve ---- */

batten_status batten_saddle_project_solve(const batten_saddle *s, double *b) {
  size_t n = s->matrix.n, k = s->matrix.k;
  const batten_saddle_qr *qr = &s->qr;
  inverse v = {.b22 = trailing(s)};
  batten_status st = BATTEN_E_NOMEM;
  double *small = batten_alloc_array(s->ctx, k, 4 * sizeof *small);
  if (!small) goto done;
  v.rounded = batten_alloc_array(s->ctx, n - k, (size_t)s->real);
  if (!v.rounded) goto done;
  double *work = small, *u1 = small + 2 * k, *g1 = small + 3 * k, *u2 = b + k;

  apply_q(s, true, 1, b, work);
  for (size_t j = 0; j < k; j++) {
    u1[j] = b[n + qr->pivots[j]];
    g1[j] = b[j];
  }
  /* R' u1 = Pi' b2 (rounding only, in a refinement step), then b22 u2 = g2 - b21 u1. */
  batten_la_trsv(D, 'U', 'T', k, qr->r, k, u1);
  batten_la_gemv(D, 'N', n - k, k, -1, s->head + k, n, u1, 1, u2);
  apply_inverse(&v, u2);
  /* R Pi' c = g1 - b11 u1 - b21' u2. */
  batten_la_gemv(D, 'N', k, k, -1, s->head, n, u1, 1, g1);
  batten_la_gemv(D, 'T', n - k, k, -1, s->head + k, n, u2, 1, g1);
  batten_la_trsv(D, 'U', 'N', k, qr->r, k, g1);
  for (size_t j = 0; j < k; j++) {
    b[j] = u1[j];
    b[n + qr->pivots[j]] = g1[j];
  }
  apply_q(s, false, 1, b, work);
  st = BATTEN_OK;
done:
  batten_free(s->ctx, v.rounded);
  batten_free(s->ctx, small);
  return st;
}

batten_status batten_saddle_project_diagonal(const batten_saddle *s, size_t count, const size_t *index,
                                             double *diagonal) {
  size_t n = s->matrix.n, k = s->matrix.k, rest = n - k;
  batten_rfp b22 = trailing(s);
  batten_status st = BATTEN_E_NOMEM;
  double *work = NULL;
  void *rounded = NULL;
  double *unit = batten_alloc_array(s->ctx, n, sizeof *unit);
  if (!unit) goto done;
  work = batten_alloc_array(s->ctx, k, 2 * sizeof *work);
  if (!work) goto done;
  rounded = batten_alloc_array(s->ctx, rest * count, (size_t)s->real);
  if (!rounded) goto done;
  /* The inverse is Q [0 0; 0 b22^-1] Q' in its first N rows, so its diagonal is |L^-1 (Q' e_i)_2|^2. */
  for (size_t q = 0; q < count; q++) {
    memset(unit, 0, n * sizeof *unit);
    unit[index[q]] = 1;
    apply_q(s, true, 1, unit, work);
    copy_to(s->real, rest, unit + k, 1, batten_la_at(s->real, rounded, q * rest));
  }
  batten_rfp_forward(&b22, count, rounded, rest);
  for (size_t q = 0; q < count; q++) {
    double sum = 0;
    copy_from(s->real, rest, batten_la_at_const(s->real, rounded, q * rest), 1, unit);
    for (size_t i = 0; i < rest; i++) sum += unit[i] * unit[i];
    diagonal[q] = sum;
  }
  st = BATTEN_OK;
done:
  batten_free(s->ctx, rounded);
  batten_free(s->ctx, work);
  batten_free(s->ctx, unit);
  return st;
}
