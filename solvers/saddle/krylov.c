/* Krylov iterations on A = Pi K with the preconditioner M of schwarz.c, which is neither symmetric nor quite linear
 * (its products are approximate).
 *
 * FGMRES [Saad 1993]: z_j = M v_j, A Z = V H with orthonormal V (Gram and Schmidt, twice), the smallest residual over
 * the span of Z by Givens rotations. It is not restarted: what it has learned is dear, and the steps are few. Vectors
 * are taken step by step.
 *
 * Flexible conjugate gradients [Notay 2000]: A is symmetric positive definite on the null space of P'. Polak and
 * Ribiere's beta = z'(r - r_before) / (z'r)_before bears with an M that changes or is not symmetric, in four vectors;
 * it wants levels from fine to coarse. */
#include <float.h>
#include <string.h>

#include "schwarz.h"

/* ---- Sums over vectors ---- */

size_t batten_saddle_blocks(size_t n) { return (n + SADDLE_BLOCK - 1) / SADDLE_BLOCK; }

typedef struct sums {
  size_t n, m;
  const double *const *v;
  const double *c, *x;
  double *partial, *out;
} sums;

static void dot_block(void *arg, size_t block) {
  enum { LANES = 8 };
  const sums *p = arg;
  size_t low = block * SADDLE_BLOCK, high = low + SADDLE_BLOCK < p->n ? low + SADDLE_BLOCK : p->n;
  for (size_t q = 0; q < p->m; q++) {
    const double *v = p->v[q], *x = p->x;
    double s[LANES] = {0};
    size_t i = low;
    for (; i + LANES <= high; i += LANES)
      for (size_t l = 0; l < LANES; l++) s[l] += v[i + l] * x[i + l];
    for (size_t l = 0; i + l < high; l++) s[l] += v[i + l] * x[i + l];
    p->partial[block * SADDLE_DOTS + q] = ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
  }
}

void batten_saddle_dots(const batten_saddle *s, const saddle_iterative *it, size_t n, size_t m,
                        const double *const *v, const double *x, double *out) {
  size_t blocks = batten_saddle_blocks(n);
  for (size_t first = 0; first < m; first += SADDLE_DOTS) {
    size_t these = m - first < SADDLE_DOTS ? m - first : SADDLE_DOTS;
    sums p = {.n = n, .m = these, .v = v + first, .x = x, .partial = it->partial};
    batten_parallel(s->ctx, blocks, dot_block, &p);
    for (size_t q = 0; q < these; q++) {
      out[first + q] = 0;
      for (size_t b = 0; b < blocks; b++) out[first + q] += it->partial[b * SADDLE_DOTS + q];
    }
  }
}

static void combine_block(void *arg, size_t block) {
  const sums *p = arg;
  size_t low = block * SADDLE_BLOCK, high = low + SADDLE_BLOCK < p->n ? low + SADDLE_BLOCK : p->n;
  double *restrict out = p->out;
  for (size_t q = 0; q < p->m; q++) {
    const double *restrict v = p->v[q];
    for (size_t i = low; i < high; i++) out[i] += p->c[q] * v[i];
  }
}

void batten_saddle_combine(const batten_saddle *s, size_t n, size_t m, const double *const *v, const double *c,
                           double *x) {
  sums p = {.n = n, .m = m, .v = v, .c = c, .out = x};
  batten_parallel(s->ctx, batten_saddle_blocks(n), combine_block, &p);
}

double batten_saddle_norm(const batten_saddle *s, const saddle_iterative *it, size_t n, const double *x) {
  double square;
  batten_saddle_dots(s, it, n, 1, &x, x, &square);
  return sqrt(square);
}

void batten_saddle_project(const batten_saddle *s, const saddle_iterative *it, const saddle_level *l, double *x,
                           double *coefficients) {
  if (l->rank == 0) return;
  batten_saddle_dots(s, it, l->count, l->rank, l->columns, x, coefficients);
  for (size_t q = 0; q < l->rank; q++) coefficients[q] = -coefficients[q];
  batten_saddle_combine(s, l->count, l->rank, l->columns, coefficients, x);
  for (size_t q = 0; q < l->rank; q++) coefficients[q] = -coefficients[q];
}

/* y := Pi K x. */
static batten_status operate(const batten_saddle *s, const saddle_iterative *it, double fraction, const double *x,
                             double *y) {
  batten_status st = batten_progress(s->ctx, "iterate", fraction);
  if (st < 0) return st;
  st = it->sums.apply(it->plan, s->ctx, x, y);
  if (st < 0) return st;
  batten_saddle_project(s, it, &it->levels[0], y, it->coefficients);
  return BATTEN_OK;
}

/* How far the residual has come from norm to target, by digits. */
static double fraction_of(double norm, double residual, double target) {
  double all = log(norm / target), gone = log(norm / residual);
  return all > 0 && gone > 0 ? fmin(gone / all, 1) : 0;
}

/* Tells when the residual, over norm, comes below marks for the first time; the step is not counted down yet. */
static void note_marks(batten_saddle *s, unsigned left, double within) {
  static const double MARK[] = {1e-3, 1e-6, 1e-9};
  for (size_t q = 0; q < sizeof MARK / sizeof *MARK; q++)
    if (within <= MARK[q] && s->info.iterations_to[q] == 0)
      s->info.iterations_to[q] = s->options.iterations_max - left + 1;
}

/* ---- When to give up ---- */

/* Steps in which the residual must fall to half. Where it does not, the products are not good enough. */
enum { STALL_STEPS = 15 };

typedef struct patience {
  double residual[STALL_STEPS];
  size_t steps;
} patience;

static bool stalled(patience *p, double residual) {
  double *before = &p->residual[p->steps % STALL_STEPS];
  bool stuck = p->steps >= STALL_STEPS && !(residual <= 0.5 * *before);
  *before = residual;
  p->steps++;
  return stuck || !(residual <= DBL_MAX);
}

/* ---- FGMRES ---- */

/* A step's vectors: z, v for the next step, and the column of the triangle that H becomes. */
typedef struct step {
  double *z, *v, *h;
  double c, s; /* the rotation */
} step;

typedef struct basis {
  size_t count, room;
  step *steps;
  const double **v; /* [room + 1] */
} basis;

static void free_basis(const batten_saddle *s, basis *b) {
  for (size_t j = 0; j < b->count; j++) batten_free(s->ctx, b->steps[j].z);
  batten_free(s->ctx, b->steps);
  batten_free(s->ctx, b->v);
}

/* Memory for one more step. *full: the memory limit has no room for it, and steps were made that can be used. */
static batten_status add_step(const batten_saddle *s, basis *b, bool *full) {
  size_t n = s->matrix.n, numbers = 2 * n + b->count + 2, bytes = numbers * sizeof(double);
  *full = b->count > 0 && batten_bytes_available(s->ctx) < bytes;
  if (*full) return BATTEN_OK;
  if (b->count == b->room) {
    size_t room = 2 * b->room + 16;
    step *steps = batten_realloc_array(s->ctx, b->steps, room, sizeof *steps);
    if (!steps) return BATTEN_E_NOMEM;
    b->steps = steps;
    const double **v = batten_realloc_array(s->ctx, b->v, room + 1, sizeof *v);
    if (!v) return BATTEN_E_NOMEM;
    b->v = v;
    b->room = room;
  }
  step *new = &b->steps[b->count];
  new->z = batten_alloc_array(s->ctx, numbers, sizeof *new->z);
  if (!new->z) return BATTEN_E_NOMEM;
  new->v = new->z + n;
  new->h = new->v + n;
  b->count++;
  return BATTEN_OK;
}

/* u := u - V (V'u), its part along V to h, twice; then u / |u|, |u| to h[count]. again [count + 1]: scratch. */
static void orthogonalise(const batten_saddle *s, const saddle_iterative *it, size_t count, const double *const *v,
                          double *u, double *h, double *again) {
  size_t n = s->matrix.n;
  memset(h, 0, count * sizeof *h);
  for (int pass = 0; pass < 2; pass++) {
    batten_saddle_dots(s, it, n, count, v, u, again);
    for (size_t i = 0; i < count; i++) {
      h[i] += again[i];
      again[i] = -again[i];
    }
    batten_saddle_combine(s, n, count, v, again, u);
  }
  h[count] = batten_saddle_norm(s, it, n, u);
  for (size_t i = 0; i < n && h[count] > 0; i++) u[i] /= h[count];
}

/* Rotates the new column h [j + 2] to a triangle's, and with it the right side, whose last entry is `last`: *g
 * becomes that of row j; returned is the one of the next row, the residual but for its sign. */
static double rotate(basis *b, size_t j, double *g, double last) {
  step *now = &b->steps[j];
  double *h = now->h;
  for (size_t i = 0; i < j; i++) {
    double c = b->steps[i].c, sn = b->steps[i].s, upper = c * h[i] + sn * h[i + 1];
    h[i + 1] = c * h[i + 1] - sn * h[i];
    h[i] = upper;
  }
  double length = hypot(h[j], h[j + 1]);
  now->c = length > 0 ? h[j] / length : 1;
  now->s = length > 0 ? h[j + 1] / length : 0;
  h[j] = length;
  *g = now->c * last;
  return -now->s * last;
}

/* w += Z y, R y = g. y [count], which holds g. */
static void add_solution(const batten_saddle *s, const basis *b, size_t count, double *y, double *w) {
  for (size_t j = count; j-- > 0;) {
    const double *h = b->steps[j].h;
    y[j] = h[j] > 0 ? y[j] / h[j] : 0;
    for (size_t i = 0; i < j; i++) y[i] -= h[i] * y[j];
  }
  for (size_t j = 0; j < count; j++) {
    const double *z = b->steps[j].z;
    batten_saddle_combine(s, s->matrix.n, 1, &z, &y[j], w);
  }
}

batten_status batten_saddle_fgmres(batten_saddle *s, saddle_iterative *it, double *w, double *r, double norm,
                                   double target, unsigned *left, saddle_end *end) {
  size_t n = s->matrix.n, room = 0, j = 0;
  basis b = {0};
  patience calm = {.steps = 0};
  double *g = NULL, *again = NULL, residual = batten_saddle_norm(s, it, n, r), last = residual;
  batten_status st = BATTEN_OK;
  *end = SADDLE_MET;
  for (size_t i = 0; i < n && residual > 0; i++) r[i] /= residual;
  for (; residual > target; j++, (*left)--) {
    double fraction = fraction_of(norm, residual, target);
    bool full;
    *end = SADDLE_SPENT;
    if (*left == 0) break;
    st = add_step(s, &b, &full);
    if (st < 0) goto done;
    *end = SADDLE_SHORT;
    if (full) break;
    if (room < b.room) {
      room = b.room;
      double *more = batten_realloc_array(s->ctx, g, room, sizeof *g);
      st = BATTEN_E_NOMEM;
      if (!more) goto done;
      g = more;
      more = batten_realloc_array(s->ctx, again, room + 1, sizeof *again);
      if (!more) goto done;
      again = more;
    }
    step *now = &b.steps[j];
    b.v[0] = r;
    st = batten_saddle_precondition(s, it, fraction, b.v[j], now->z);
    if (st < 0) goto done;
    st = operate(s, it, fraction, now->z, now->v);
    if (st < 0) goto done;
    orthogonalise(s, it, j + 1, b.v, now->v, now->h, again);
    b.v[j + 1] = now->v;
    last = rotate(&b, j, &g[j], last);
    residual = fabs(last);
    note_marks(s, *left, residual / norm);
    *end = SADDLE_MET;
    if (residual > target && stalled(&calm, residual)) {
      *end = SADDLE_STALLED;
      j++, (*left)--;
      break;
    }
  }
  add_solution(s, &b, j, g, w);
done:
  batten_free(s->ctx, again);
  batten_free(s->ctx, g);
  free_basis(s, &b);
  return st;
}

/* ---- Flexible conjugate gradients ---- */

static double dot(const batten_saddle *s, const saddle_iterative *it, const double *a, const double *b) {
  double out;
  batten_saddle_dots(s, it, s->matrix.n, 1, &a, b, &out);
  return out;
}

batten_status batten_saddle_cg(batten_saddle *s, saddle_iterative *it, double *w, double *r, double norm,
                               double target, unsigned *left, saddle_end *end) {
  size_t n = s->matrix.n;
  patience calm = {.steps = 0};
  double *z = batten_alloc_array(s->ctx, n, 3 * sizeof *z), *p, *q, along = 0, alpha = 0;
  if (!z) return BATTEN_E_NOMEM;
  p = z + n;
  q = p + n;
  batten_status st = BATTEN_OK;
  double residual = batten_saddle_norm(s, it, n, r);
  *end = SADDLE_MET;
  for (bool first = true; residual > target; first = false, (*left)--) {
    double fraction = fraction_of(norm, residual, target);
    *end = SADDLE_SPENT;
    if (*left == 0) break;
    st = batten_saddle_precondition(s, it, fraction, r, z);
    if (st < 0) goto done;
    /* r - r_before = - alpha q */
    double beta = first ? 0 : -alpha * dot(s, it, z, q) / along;
    along = dot(s, it, z, r);
    *end = SADDLE_STALLED;
    if (!(along > 0)) break; /* M is not definite enough to go on */
    for (size_t i = 0; i < n; i++) p[i] = first ? z[i] : z[i] + beta * p[i];
    st = operate(s, it, fraction, p, q);
    if (st < 0) goto done;
    double curvature = dot(s, it, p, q), slope = dot(s, it, p, r);
    if (!(curvature > 0)) break;
    alpha = slope / curvature;
    for (size_t i = 0; i < n; i++) {
      w[i] += alpha * p[i];
      r[i] -= alpha * q[i];
    }
    residual = batten_saddle_norm(s, it, n, r);
    note_marks(s, *left, residual / norm);
    if (residual > target && stalled(&calm, residual)) {
      (*left)--;
      break;
    }
    *end = SADDLE_MET;
  }
done:
  batten_free(s->ctx, z);
  return st;
}
