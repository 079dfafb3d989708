/* The iterative method: set-up, a solve, and what its result is called.
 *
 * The residual that the iteration sees belongs to its products, which are approximate, and says nothing of their
 * error: with poor ones it falls to any tolerance while the solution stays wrong. So the rows of the system are
 * summed up afresh, 1000 of them at random, and they alone decide. Where they miss what is asked for although the
 * iteration has met it, the products are planned anew, more accurate, and the iteration goes on from where it is. */
#include <float.h>
#include <string.h>

#include "base/arena.h"
#include "schwarz.h"

/* Products are the better for a margin: their error counts by |K w|, which is some ten times |Pi f| with the kernel
 * r, and with r^3 some 200 times at 20,000 unknowns. */
static const double PRODUCTS_MARGIN = 20, PRODUCTS_MARGIN_SMOOTH = 400;

/* The iteration goes on to this part of the accuracy, so that the products' error finds room beside. */
static const double ITERATION_MARGIN = 0.5;

/* Of products: what double can give, and what the levels need. Errors there are rough at the size of a cell, which
 * K^-1 amplifies: measured with the kernel r, iterations to 1e-9 of 40,000 and to 1e-6 of 1,000,000 unknowns with
 * errors of 2e-3, 2e-4, 2e-5, 2e-7: more than 30, 11, 7, 9; and -, -, 19, 7. With r^3, to 5e-9 of 20,000: 9 with
 * errors of 1e-11 and of 5e-10. */
static const double FLOOR = 1e-13, WITHIN_SMALL = 2e-5, WITHIN_LARGE = 2e-7;
static const double SMOOTH_SMALL = 5e-10, SMOOTH_LARGE = 1e-11;
enum { LARGE = 150000 };

enum { ROWS_CHECKED = 1000, STEPS_EXPECTED = 24 };

static double needed_within(const batten_saddle_options *o, size_t n) {
  if (o->smooth_kernel) return n > LARGE ? SMOOTH_LARGE : SMOOTH_SMALL;
  return n > LARGE ? WITHIN_LARGE : WITHIN_SMALL;
}

static double first_accuracy(const batten_saddle_options *o, size_t n) {
  if (o->products_accuracy > 0) return fmax(o->products_accuracy, FLOOR);
  double wanted = fmax(o->accuracy / (o->smooth_kernel ? PRODUCTS_MARGIN_SMOOTH : PRODUCTS_MARGIN), FLOOR);
  return o->smooth_kernel ? fmin(wanted, needed_within(o, n)) : wanted;
}

/* Where it is not much coarser than what the iteration itself takes, the same: plans may share what is dear to make,
 * and the dearer the smoother the kernel. */
static double accuracy_within(const batten_saddle_options *o, size_t n) {
  const double wanted = needed_within(o, n), first = first_accuracy(o, n);
  return first <= wanted && first >= (o->smooth_kernel ? 0.01 : 0.1) * wanted ? first : wanted;
}

/* ---- Memory ---- */

static void grow(size_t *total, size_t count, size_t size) {
  size_t bytes;
  batten_mul(count, size, &bytes);
  batten_add(*total, bytes, total);
}

static size_t plan_bytes(const batten_saddle_matrix *m, double accuracy, size_t rows, size_t cols) {
  return m && m->sums && m->sums->bytes ? m->sums->bytes(m->user, accuracy, rows, cols) : 0;
}

/* Vectors of a solve: f, f less its polynomial, w, r, and where the next one begins; then those of the iteration. */
static size_t vectors(batten_saddle_krylov krylov) {
  return 5 + (krylov == BATTEN_SADDLE_CG ? 3 : 2 * STEPS_EXPECTED);
}

/* Members of a domain, where unknowns lie on a surface: whole rings of neighbours make its sides so much longer. */
static size_t members_foreseen(const batten_saddle_options *o, size_t own) {
  const size_t least = own + saddle_added(own, saddle_overlap_least(o));
  const double side = sqrt((double)own) + (o->smooth_kernel ? 8.6 : 5.6);
  return o->overlap > 0 || side * side < (double)least ? least : (size_t)(side * side);
}

/* What the domains of a level take. */
typedef struct level_need {
  size_t next, domains, members, most; /* unknowns of the next level; members of all domains, and of the largest */
  size_t factors;                      /* bytes */
} level_need;

static level_need need_foreseen(const batten_saddle_options *o, batten_la_real real, size_t count, size_t k) {
  level_need out = {.next = batten_saddle_parts(count, saddle_cell(count)) + SADDLE_EXTREMES,
                    .domains = batten_saddle_parts(count, SADDLE_OWN_MAX)};
  size_t own = count / out.domains + 1;
  /* Domains have the size that halving gives, or twice that less one part where only some were too large. */
  if (count / out.domains < SADDLE_OWN_MAX / 2) own = SADDLE_OWN_MAX;
  out.most = members_foreseen(o, own);
  batten_mul(out.domains, out.most, &out.members);
  batten_mul(out.domains, batten_saddle_domain_bytes(real, out.most, k), &out.factors);
  return out;
}

static level_need need_known(const saddle_level *l, batten_la_real real, size_t k) {
  level_need out = {.next = l[1].count, .domains = l->domain_count};
  for (size_t d = 0; d < l->domain_count; d++) {
    const size_t members = l->domains[d].count;
    if (members > out.most) out.most = members;
    out.members += members;
    batten_add(out.factors, batten_saddle_domain_bytes(real, members, k), &out.factors);
  }
  return out;
}

/* m: for its sums, NULL: they take nothing. cut: with the levels, NULL: as foreseen. */
static size_t bytes_with(const batten_saddle_matrix *m, const batten_saddle_options *o, const saddle_iterative *cut,
                         batten_saddle_krylov krylov, unsigned slots, size_t n, size_t k) {
  const batten_la_real real = o->smooth_kernel ? BATTEN_LA_DOUBLE : BATTEN_LA_FLOAT;
  size_t count = n, held = sizeof(saddle_iterative), most = 0, cutting = 0, largest = 0;
  if (n > SIZE_MAX / 4096) return SIZE_MAX;
  grow(&held, k * (k + 2), sizeof(double));
  grow(&held, batten_saddle_blocks(n) * SADDLE_DOTS, sizeof(double));
  for (size_t q = 0;; q++) {
    grow(&held, count, (k + 2) * sizeof(double) + 2 * sizeof(size_t));
    if (count <= SADDLE_EXACT_MAX) break;
    const level_need need = cut ? need_known(&cut->levels[q], real, k) : need_foreseen(o, real, count, k);
    grow(&held, need.members, sizeof(size_t));
    grow(&held, need.domains, sizeof(saddle_domain));
    batten_add(held, need.factors, &held);
    if (need.most > most) most = need.most;
    if (need.domains > largest) largest = need.domains;
    if (count == n) cutting = count * (6 * 3 + 7 + SADDLE_OVERLAP_MAX + SADDLE_GRAPH) * sizeof(double);
    batten_add(held, plan_bytes(m, accuracy_within(o, n), count, need.next), &held);
    count = need.next;
  }
  batten_add(held, plan_bytes(m, first_accuracy(o, n), n, n), &held);
  grow(&held, slots, batten_saddle_domain_scratch(most));
  size_t exact = batten_saddle_bytes(BATTEN_SADDLE_CHOLESKY, count, k < count ? k : 0), peak = cutting;
  size_t work, solving = 0;
  batten_mul(batten_saddle_domain_work(most, k), slots < largest ? slots : largest, &work);
  grow(&solving, n, vectors(krylov) * sizeof(double));
  batten_add(solving, exact, &solving); /* its scratch is a part of that, and small */
  if (work > peak) peak = work;
  if (solving > peak) peak = solving;
  batten_add(held, peak, &held);
  return held;
}

/* As bytes_with; *krylov AUTO becomes what has room within allowed: CG where FGMRES has none. */
static size_t bytes_within(const batten_saddle_matrix *m, const batten_saddle_options *o, const saddle_iterative *cut,
                           unsigned slots, size_t n, size_t k, size_t allowed, batten_saddle_krylov *krylov) {
  const bool automatic = *krylov == BATTEN_SADDLE_KRYLOV_AUTO;
  if (automatic) *krylov = BATTEN_SADDLE_FGMRES;
  size_t bytes = bytes_with(m, o, cut, *krylov, slots, n, k);
  if (!automatic || bytes <= allowed) return bytes;
  *krylov = BATTEN_SADDLE_CG;
  return bytes_with(m, o, cut, *krylov, slots, n, k);
}

size_t batten_saddle_iterative_bytes(const batten_saddle *s, size_t n, size_t k) {
  batten_saddle_options o = s ? s->options : batten_saddle_options_default();
  const unsigned slots = s ? batten_workers(s->ctx) : 8;
  const size_t allowed = s ? batten_bytes_available(s->ctx) : SIZE_MAX;
  return bytes_within(s ? &s->matrix : NULL, &o, NULL, slots, n, k, allowed, &o.krylov);
}

/* Which iteration there is room for, now that the domains are known: those of unknowns that fill a volume are larger
 * than was foreseen. before: bytes in use before the set-up. */
static batten_status check_room(const batten_saddle *s, saddle_iterative *it, size_t before) {
  const size_t n = s->matrix.n, taken = batten_bytes_in_use(s->ctx) - before;
  batten_saddle_krylov krylov = s->options.krylov;
  size_t allowed;
  batten_add(batten_bytes_available(s->ctx), taken, &allowed);
  size_t bytes = bytes_within(&s->matrix, &s->options, it, it->slots, n, s->matrix.k, allowed, &krylov);
  it->fine_first = krylov == BATTEN_SADDLE_CG;
  if (bytes <= allowed) return BATTEN_OK;
  return batten_fail(s->ctx, BATTEN_E_TOO_LARGE,
                     "matrix.n: %zu rows by iterative, whose local solves have up to %zu rows, take %zu bytes, the "
                     "context allows %zu; raise memory_limit or use fewer points",
                     n, it->domain_most, bytes, allowed);
}

/* ---- Set-up ---- */

void batten_saddle_iterative_free(batten_saddle *s) {
  saddle_iterative *it = s->iterative;
  if (!it) return;
  if (it->plan) it->sums.release(it->plan);
  batten_saddle_links_free(it);
  batten_saddle_free(it->exact);
  batten_free(s->ctx, it->exact_x);
  batten_saddle_levels_free(s, it);
  batten_free(s->ctx, it->p_factor);
  batten_free(s->ctx, it->p_pivots);
  batten_free(s->ctx, it->partial);
  batten_free(s->ctx, it->coefficients);
  batten_free(s->ctx, it->scratch);
  batten_free(s->ctx, it);
  s->iterative = NULL;
}

static batten_status plan_products(batten_saddle *s, saddle_iterative *it, double accuracy) {
  batten_status st = batten_progress(s->ctx, "plans", 1);
  if (st < 0) return st;
  if (it->plan) it->sums.release(it->plan);
  it->plan = NULL;
  it->accuracy = accuracy;
  return it->sums.plan(s->matrix.user, s->ctx, accuracy, s->matrix.n, NULL, s->matrix.n, NULL, &it->plan);
}

static void count_domains(batten_saddle *s, const saddle_iterative *it, size_t before) {
  s->info.levels = (unsigned)it->level_count;
  s->info.domains = s->info.domains_double = 0;
  const size_t told = sizeof s->info.level_sizes / sizeof *s->info.level_sizes;
  for (size_t q = 0; q < told; q++) s->info.level_sizes[q] = q < it->level_count ? it->levels[q].count : 0;
  for (size_t q = 0; q < it->level_count; q++)
    for (size_t d = 0; d < it->levels[q].domain_count; d++) {
      s->info.domains++;
      s->info.domains_double += it->levels[q].domains[d].real == BATTEN_LA_DOUBLE;
    }
  size_t now = batten_bytes_in_use(s->ctx);
  s->info.bytes = now > before ? now - before : 0;
}

batten_status batten_saddle_iterative_new(batten_saddle *s) {
  const size_t k = s->matrix.k, n = s->matrix.n, before = batten_bytes_in_use(s->ctx);
  double start = batten_now();
  batten_status st = BATTEN_E_NOMEM;
  saddle_iterative *it = batten_alloc(s->ctx, sizeof *it);
  if (!it) return BATTEN_E_NOMEM;
  *it = (saddle_iterative){.code = batten_saddle_code(), .sums = *s->matrix.sums, .slots = batten_workers(s->ctx)};
  s->iterative = it;
  it->p_factor = batten_alloc_array(s->ctx, k * k, sizeof *it->p_factor);
  if (!it->p_factor) goto done;
  memset(it->p_factor, 0, k * k * sizeof *it->p_factor);
  it->p_pivots = batten_alloc_array(s->ctx, k, sizeof *it->p_pivots);
  if (!it->p_pivots) goto done;
  it->coefficients = batten_alloc_array(s->ctx, k, 2 * sizeof *it->coefficients);
  if (!it->coefficients) goto done;
  it->partial = batten_alloc_array(s->ctx, batten_saddle_blocks(n), SADDLE_DOTS * sizeof *it->partial);
  if (!it->partial) goto done;

  st = batten_saddle_levels_new(s, it);
  if (st < 0) goto done;
  st = check_room(s, it, before);
  if (st < 0) goto done;
  st = batten_saddle_domains_factor(s, it);
  if (st < 0) goto done;
  st = BATTEN_E_NOMEM;
  it->scratch_bytes = batten_saddle_domain_scratch(it->domain_most);
  it->scratch = batten_alloc_array(s->ctx, it->slots, it->scratch_bytes);
  if (!it->scratch) goto done;
  st = batten_saddle_exact_new(s, it);
  if (st < 0) goto done;
  st = batten_saddle_links_new(s, it, accuracy_within(&s->options, n));
  if (st < 0) goto done;
  if (n > 0) st = plan_products(s, it, first_accuracy(&s->options, n));
  if (st < 0) goto done;
  count_domains(s, it, before);
  s->info.time_setup_s = batten_now() - start;
done:
  if (st < 0) batten_saddle_iterative_free(s);
  return st;
}

/* Plans that an earlier solve could not make anew. */
static batten_status complete_plans(batten_saddle *s, saddle_iterative *it) {
  batten_status st = BATTEN_OK;
  bool links = true;
  for (size_t q = 0; q + 1 < it->level_count; q++) links = links && it->levels[q].plan;
  if (!links) st = batten_saddle_links_new(s, it, it->accuracy_within);
  if (st == BATTEN_OK && s->matrix.n > 0 && !it->plan) st = plan_products(s, it, it->accuracy);
  return st;
}

/* ---- Direct rows ---- */

typedef struct rows {
  const batten_saddle *s;
  const double *f, *w, *c;
  const size_t *row;
  size_t first, end;
  double *residual; /* [rows] */
  double *tiles;    /* [slots][TILE] */
} rows;

enum { TILE = 2048 };

static void check_slot(void *arg, size_t slot) {
  const rows *p = arg;
  const batten_saddle_matrix *m = &p->s->matrix;
  double *tile = p->tiles + slot * TILE;
  for (size_t q = p->first + slot; q < p->end; q += p->s->iterative->slots) {
    size_t i = p->row[q];
    double sum = 0;
    for (size_t j = 0; j < m->n; j += TILE) { /* the row as a part of a column: K is symmetric to the bit */
      double part = 0;
      size_t count = m->n - j < TILE ? m->n - j : TILE;
      m->fill(m->user, j, count, i, 1, tile, TILE);
      for (size_t l = 0; l < count; l++) part += tile[l] * p->w[j + l];
      sum += part;
    }
    for (size_t a = 0; a < m->k; a++) sum += m->p[i + a * m->n] * p->c[a];
    p->residual[q] = p->f[i] - sum;
  }
}

/* Draws from splitmix64: the same rows every time. */
static size_t draw(uint64_t *state, size_t n) {
  uint64_t z = (*state += 0x9e3779b97f4a7c15u);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return (size_t)((z ^ (z >> 31)) % n);
}

/* *out := 2-norm of f - K w - P c per row, over rows whose entries are computed afresh; relative to norm / sqrt(N).
 */
static batten_status check_rows(batten_saddle *s, const double *f, const double *w, const double *c, double norm,
                                double *out) {
  enum { ENTRIES = 1 << 24 }; /* between two progress calls: 0.1 s or so */
  size_t n = s->matrix.n, count = n < ROWS_CHECKED ? n : ROWS_CHECKED, portion = ENTRIES / n + 1;
  uint64_t state = 9;
  batten_status st = BATTEN_E_NOMEM;
  rows p = {.s = s, .f = f, .w = w, .c = c};
  double *tiles = NULL, *residual = NULL;
  size_t *row = batten_alloc_array(s->ctx, count, sizeof *row);
  if (!row) goto done;
  residual = batten_alloc_array(s->ctx, count, sizeof *residual);
  if (!residual) goto done;
  tiles = batten_alloc_array(s->ctx, s->iterative->slots, TILE * sizeof *tiles);
  if (!tiles) goto done;
  for (size_t q = 0; q < count; q++) row[q] = count == n ? q : draw(&state, n);
  p.row = row;
  p.residual = residual;
  p.tiles = tiles;
  for (p.first = 0; p.first < count; p.first = p.end) {
    p.end = count - p.first < portion ? count : p.first + portion;
    st = batten_progress(s->ctx, "check", (double)p.first / (double)count);
    if (st < 0) goto done;
    batten_parallel(s->ctx, s->iterative->slots, check_slot, &p);
  }
  double square = 0;
  for (size_t q = 0; q < count; q++) square += residual[q] / norm * (residual[q] / norm);
  *out = sqrt(square * ((double)n / (double)count));
  s->info.rows_checked = count;
  st = BATTEN_OK;
done:
  batten_free(s->ctx, tiles);
  batten_free(s->ctx, residual);
  batten_free(s->ctx, row);
  return st;
}

/* ---- Solve ---- */

typedef struct solve {
  batten_saddle *s;
  saddle_iterative *it;
  double unit;            /* a power of two: f is the caller's times that, of size 1 */
  double *f, *pf, *w, *r; /* [N] f, Pi f, weights, Pi (f - K w) */
  double *c;              /* [k] */
  double norm;            /* |Pi f| */
  double within;          /* |r| / norm, by the products */
  double rows;            /* the same by direct rows: what counts */
} solve;

/* c from the coefficients Q'(f - K w). */
static void polynomial(const solve *v, const double *coefficients) {
  const saddle_iterative *it = v->it;
  size_t k = v->s->matrix.k;
  double *y = it->coefficients + k;
  for (size_t j = k; j-- > 0;) {
    double sum = coefficients[j];
    for (size_t l = j + 1; l < k; l++) sum -= it->p_factor[j + l * k] * y[l];
    y[j] = sum / it->p_factor[j + j * k];
  }
  for (size_t j = 0; j < k; j++) v->c[it->p_pivots[j]] = y[j] * v->s->p_scale[it->p_pivots[j]];
}

/* r and c for w. */
static batten_status renew(solve *v) {
  size_t n = v->s->matrix.n;
  batten_status st = batten_progress(v->s->ctx, "iterate", 1);
  if (st < 0) return st;
  st = v->it->sums.apply(v->it->plan, v->s->ctx, v->w, v->r);
  if (st < 0) return st;
  for (size_t i = 0; i < n; i++) v->r[i] = v->f[i] - v->r[i];
  batten_saddle_project(v->s, v->it, &v->it->levels[0], v->r, v->it->coefficients);
  polynomial(v, v->it->coefficients);
  v->within = batten_saddle_norm(v->s, v->it, n, v->r) / v->norm;
  return BATTEN_OK;
}

/* Where the last solve ended, if that is nearer than zero. */
static batten_status begin(solve *v) {
  size_t n = v->s->matrix.n;
  if (v->s->begin) {
    for (size_t i = 0; i < n; i++) v->w[i] = v->unit * v->s->begin[i];
    batten_saddle_project(v->s, v->it, &v->it->levels[0], v->w, v->it->coefficients);
    batten_status st = renew(v);
    if (st < 0 || v->within < 1) return st;
  }
  memset(v->w, 0, n * sizeof *v->w);
  memcpy(v->r, v->pf, n * sizeof *v->r);
  v->within = 1;
  return BATTEN_OK;
}

/* More accurate products: by what the direct rows miss, where the iteration has come that far; of the levels too
 * where it has not. *done: there is nothing to gain. */
static batten_status improve(solve *v, saddle_end end, bool *done) {
  batten_saddle *s = v->s;
  saddle_iterative *it = v->it;
  bool met = end == SADDLE_MET;
  double factor = met ? fmax(0.2 * s->options.accuracy / v->rows, 1e-4) : 0.01;
  bool main_left = it->accuracy > FLOOR, levels_left = !met && it->level_count > 1 && it->accuracy_within > FLOOR;
  *done = !main_left && !levels_left;
  if (*done) return BATTEN_OK;
  batten_status st = BATTEN_OK;
  if (levels_left) st = batten_saddle_links_new(s, it, fmax(factor * it->accuracy_within, FLOOR));
  if (st == BATTEN_OK && main_left) st = plan_products(s, it, fmax(factor * it->accuracy, FLOOR));
  return st;
}

/* Iterates until the direct rows are content, or there is nothing left to try. */
static batten_status iterate(solve *v) {
  batten_saddle *s = v->s;
  saddle_iterative *it = v->it;
  const double target = ITERATION_MARGIN * s->options.accuracy * v->norm;
  unsigned left = s->options.iterations_max;
  double last = INFINITY;
  batten_status st = begin(v);
  while (st == BATTEN_OK) {
    saddle_end end;
    bool done = false;
    st = (it->fine_first ? batten_saddle_cg : batten_saddle_fgmres)(s, it, v->w, v->r, v->norm, target, &left, &end);
    if (st < 0) return st;
    s->info.iterations = s->options.iterations_max - left;
    st = renew(v);
    if (st < 0) return st;
    st = check_rows(s, v->f, v->w, v->c, v->norm, &v->rows);
    if (st < 0) return st;
    if (!(v->rows <= DBL_MAX))
      return batten_fail(s->ctx, BATTEN_E_INVALID, "matrix.sums: products or entries are not finite");
    if (v->rows <= s->options.accuracy || left == 0) return BATTEN_OK;
    /* Twice in vain: it is rounding, or the problem. */
    bool gained = v->rows <= 0.5 * last;
    if (!gained && end != SADDLE_SHORT && last < INFINITY) return BATTEN_OK;
    last = v->rows;
    if (end == SADDLE_SHORT && gained) continue;
    st = improve(v, end, &done);
    if (st < 0 || done) return st;
    st = renew(v);
  }
  return st;
}

/* The caller's w and c, and w for the next solve to begin at. */
static batten_status give(const solve *v, double *w, double *c) {
  batten_saddle *s = v->s;
  size_t n = s->matrix.n;
  if (!s->begin) s->begin = batten_alloc_array(s->ctx, n, sizeof *s->begin);
  if (!s->begin) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < n; i++) s->begin[i] = v->w[i] / v->unit;
  if (n > 0) memcpy(w, s->begin, n * sizeof *w);
  for (size_t q = 0; q < s->matrix.k; q++) c[q] = v->c[q] / v->unit;
  return BATTEN_OK;
}

batten_status batten_saddle_iterative_solve(batten_saddle *s, const double *f, double *w, double *c) {
  size_t n = s->matrix.n, k = s->matrix.k;
  saddle_iterative *it = s->iterative;
  solve v = {.s = s, .it = it, .unit = 1};
  double largest = 0;
  batten_status st = complete_plans(s, it);
  if (st < 0) return st;
  st = BATTEN_E_NOMEM;
  v.c = batten_alloc_array(s->ctx, k, sizeof *v.c);
  if (!v.c) goto done;
  v.f = batten_alloc_array(s->ctx, n, 4 * sizeof *v.f);
  if (!v.f) goto done;
  v.pf = v.f + n;
  v.w = v.pf + n;
  v.r = v.w + n;
  for (size_t i = 0; i < n; i++) largest = fmax(largest, fabs(f[i]));
  if (largest > 0) v.unit = batten_unit(largest);
  for (size_t i = 0; i < n; i++) v.f[i] = v.pf[i] = v.unit * f[i];
  batten_saddle_project(s, it, &it->levels[0], v.pf, it->coefficients);
  polynomial(&v, it->coefficients);
  v.norm = batten_saddle_norm(s, it, n, v.pf);
  s->info.iterations = 0;
  memset(s->info.iterations_to, 0, sizeof s->info.iterations_to);
  s->info.residual_rows = 0;
  s->info.rows_checked = 0;
  st = BATTEN_OK;
  /* A polynomial to rounding: no weights. */
  if (v.norm <= 64 * DBL_EPSILON * batten_saddle_norm(s, it, n, v.f)) {
    memset(v.w, 0, n * sizeof *v.w);
  } else {
    st = iterate(&v);
    s->info.residual_rows = v.rows;
  }
  s->info.residual = s->info.residual_rows;
  s->info.products_accuracy = it->accuracy;
  if (st == BATTEN_OK) st = give(&v, w, c);
  if (st < 0) goto done;
  if (!(s->info.residual_rows <= s->options.accuracy))
    st = batten_fail(s->ctx, BATTEN_W_ACCURACY,
                     "residual: %.3g on %zu rows after %u iterations, above opt.accuracy %.3g; %s",
                     s->info.residual_rows, s->info.rows_checked, s->info.iterations, s->options.accuracy,
                     s->info.iterations >= s->options.iterations_max ? "raise opt.iterations_max"
                                                                     : "add a nugget, or give opt.overlap above 2");
done:
  batten_free(s->ctx, v.f);
  batten_free(s->ctx, v.c);
  return st;
}
