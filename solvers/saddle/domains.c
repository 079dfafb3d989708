/* Local solves. For the members of a domain, with P = H1 .. Hr [R; 0] by Householder's reflections,
 *     w = H [0; B22^-1 (H' r)_2],   B = H' K H,
 * B22 being positive definite. It is kept as a Cholesky factor in float, which is good enough for a preconditioner
 * and halves its memory; where float finds no positive pivot (nearby points), or the caller knows K to be too smooth
 * for it, in double. Right sides are scaled to size 1 before they are rounded.
 *
 * P may have dependent columns on the members (a flat or straight piece of data): they are taken the largest first,
 * and what is but rounding is left out. It would hold fixed a direction of no meaning, even a single unknown, which
 * then no domain solves for: three straight lines of points took half as many iterations again.
 *
 * Domains are worked on by tasks of batten's own loop, by our own code: see panels.h. */
#include <string.h>

#include "schwarz.h"

/* A pivot below this part of its diagonal is rounding. */
static const double LEAST_FLOAT = 32 * 0x1p-23, LEAST_DOUBLE = 4 * 0x1p-52;

/* Columns of P have size 1; what is left of one that depends on others is below this, root mean square. */
static const double DEPENDENT = 1e-14;

/* ---- Memory ---- */

enum { GRAIN = 64 };

static size_t whole_grains(size_t bytes) { return (bytes + GRAIN - 1) / GRAIN * GRAIN; }

size_t batten_saddle_domain_bytes(batten_la_real real, size_t count, size_t k) {
  return batten_panel_count(real, count) * (size_t)real + k * (count + 1) * sizeof(double);
}

/* The matrix, P or Y, V T, M and T, the unknowns. */
size_t batten_saddle_domain_work(size_t count, size_t k) {
  return whole_grains(count * (count + 2 * k) * sizeof(double) + 3 * k * k * sizeof(double) + count * sizeof(size_t));
}

/* The vector, and what goes through the panels. */
size_t batten_saddle_domain_scratch(size_t count) {
  size_t bytes = whole_grains(count * sizeof(double));
  return bytes + batten_panel_rows(BATTEN_LA_FLOAT, count) * sizeof(double);
}

/* ---- QR of P on a domain ---- */

static double dot(size_t n, const double *a, const double *b) {
  enum { LANES = 4 };
  double s[LANES] = {0};
  size_t i = 0;
  for (; i + LANES <= n; i += LANES)
    for (size_t l = 0; l < LANES; l++) s[l] += a[i + l] * b[i + l];
  for (size_t l = 0; i + l < n; l++) s[l] += a[i + l] * b[i + l];
  return (s[0] + s[2]) + (s[1] + s[3]);
}

/* x := (I - tau v v') x, v being 0 before `first`. */
static void reflect(size_t count, size_t first, const double *v, double tau, double *x) {
  double along = tau * dot(count - first, v + first, x + first);
  for (size_t i = first; i < count; i++) x[i] -= along * v[i];
}

/* v := the reflector that brings column's entries from `at` on to the first of them; zeros and the one written out.
 * Returns tau. largest: of these entries, above 0. */
static double reflector(size_t count, size_t at, double largest, const double *column, double *v) {
  memset(v, 0, at * sizeof *v);
  double square = 0;
  for (size_t i = at; i < count; i++) {
    v[i] = column[i] / largest;
    square += v[i] * v[i];
  }
  double length = sqrt(square), head = v[at], beta = head > 0 ? -length : length;
  for (size_t i = at + 1; i < count; i++) v[i] /= head - beta;
  v[at] = 1;
  return (beta - head) / beta;
}

/* The reflectors of P on the members of d; p [k][count] is scratch. */
static void make_reflectors(const batten_saddle *s, saddle_domain *d, const size_t *unknown, double *p) {
  size_t n = s->matrix.n, k = s->matrix.k, count = d->count;
  for (size_t c = 0; c < k; c++)
    for (size_t i = 0; i < count; i++) p[i + c * count] = s->matrix.p[unknown[i] + c * n] * s->p_scale[c];
  for (d->rank = 0; d->rank < k && d->rank < count; d->rank++) {
    size_t at = d->rank, best = at;
    double most = 0, largest = 0;
    for (size_t c = at; c < k; c++) {
      double square = dot(count - at, p + c * count + at, p + c * count + at);
      if (square > most) most = square, best = c;
    }
    double *column = p + best * count;
    for (size_t i = at; i < count; i++) largest = fmax(largest, fabs(column[i]));
    if (!(most > DEPENDENT * DEPENDENT * (double)count)) return;
    double *v = d->reflectors + at * count;
    d->tau[at] = reflector(count, at, largest, column, v);
    if (best != at) memcpy(column, p + at * count, count * sizeof *column);
    for (size_t c = at + 1; c < k; c++) reflect(count, at, v, d->tau[at], p + c * count);
  }
}

/* t [r][r]: H1 .. Hr = I - V T V'. */
static void make_t(const saddle_domain *d, double *t) {
  size_t r = d->rank, count = d->count;
  for (size_t j = 0; j < r; j++) {
    const double *v = d->reflectors + j * count;
    for (size_t i = 0; i < j; i++) t[i + j * r] = -d->tau[j] * dot(count, d->reflectors + i * count, v);
    for (size_t i = 0; i < j; i++) {
      double sum = 0;
      for (size_t l = i; l < j; l++) sum += t[i + l * r] * t[l + j * r];
      t[i + j * r] = sum;
    }
    t[j + j * r] = d->tau[j];
    for (size_t i = j + 1; i < r; i++) t[i + j * r] = 0;
  }
}

/* ---- Factor ---- */

enum { FILL_COLUMNS = 64 };

/* The lower triangle of K on the members, [count][count]. */
static void fill_matrix(const batten_saddle *s, const saddle_iterative *it, size_t count, const size_t *unknown,
                        double *a) {
  for (size_t j = 0; j < count; j += FILL_COLUMNS) {
    size_t wide = count - j < FILL_COLUMNS ? count - j : FILL_COLUMNS;
    batten_saddle_entries(s, &it->sums, count - j, unknown + j, wide, unknown + j, a + j + j * count, count);
  }
}

/* x [r][count] := Y - V M / 2, Y = A V T, M = T' V' Y (see project.c); z [r][count] and small [2][r][r] scratch. */
static void make_update(const saddle_code *code, const saddle_domain *d, const double *a, const double *t, double *z,
                        double *small, double *x) {
  size_t r = d->rank, count = d->count;
  const double *v = d->reflectors;
  for (size_t j = 0; j < r; j++)
    for (size_t i = 0; i < count; i++) {
      double sum = 0;
      for (size_t l = 0; l <= j; l++) sum += v[i + l * count] * t[l + j * r];
      z[i + j * count] = sum;
    }
  code->multiply(count, count, a, r, z, x);
  for (size_t j = 0; j < r; j++)
    for (size_t i = 0; i < r; i++) small[i + j * r] = dot(count, v + i * count, x + j * count);
  double *m = small + r * r;
  for (size_t j = 0; j < r; j++)
    for (size_t i = 0; i < r; i++) {
      double sum = 0;
      for (size_t l = 0; l <= i; l++) sum += t[l + i * r] * small[l + j * r];
      m[i + j * r] = sum;
    }
  for (size_t j = 0; j < r; j++)
    for (size_t l = 0; l < r; l++) {
      double half = 0.5 * m[l + j * r];
      for (size_t i = 0; i < count; i++) x[i + j * count] -= half * v[i + l * count];
    }
}

/* The trailing block of a, scaled, to panels. */
static void pack(const saddle_domain *d, const double *a) {
  size_t r = d->rank, count = d->count, n = count - r, width = batten_panel_width(d->real);
  size_t rows = batten_panel_rows(d->real, n);
  memset(d->factor, 0, batten_panel_count(d->real, n) * (size_t)d->real);
  for (size_t j = 0; j < n; j++) {
    const double *column = a + (j + r) * count + r;
    for (size_t i = j; i < n; i += width - i % width) {
      size_t end = i + width - i % width, at = batten_panel_at(d->real, i, j);
      if (end > n) end = n;
      if (d->real == BATTEN_LA_DOUBLE)
        for (size_t q = i; q < end; q++) ((double *)d->factor)[at + q - i] = d->scale * column[q];
      else
        for (size_t q = i; q < end; q++) ((float *)d->factor)[at + q - i] = (float)(d->scale * column[q]);
    }
  }
  for (size_t i = n; i < rows; i++) {
    size_t at = batten_panel_at(d->real, i, i);
    if (d->real == BATTEN_LA_DOUBLE)
      ((double *)d->factor)[at] = 1;
    else
      ((float *)d->factor)[at] = 1;
  }
}

/* A domain whose memory is there. work: domain_work. */
static void factor_domain(const batten_saddle *s, const saddle_iterative *it, const saddle_level *l, saddle_domain *d,
                          void *work) {
  size_t count = d->count, k = s->matrix.k;
  double *a = work, *x = a + count * count, *z = x + k * count, *t = z + k * count, *small = t + k * k;
  size_t *unknown = (size_t *)(void *)(small + 2 * k * k);
  for (size_t i = 0; i < count; i++) unknown[i] = saddle_unknown(l, d->member[i]);
  make_reflectors(s, d, unknown, x);
  size_t n = count - d->rank;
  fill_matrix(s, it, count, unknown, a);
  make_t(d, t);
  make_update(it->code, d, a, t, z, small, x);
  it->code->update(count, count, a, d->rank, d->reflectors, x);
  double largest = 0;
  for (size_t i = d->rank; i < count; i++) largest = fmax(largest, a[i + i * count]);
  d->scale = largest > 0 && largest <= 1e300 ? batten_unit(largest) : 1;
  pack(d, a);
  double least = d->real == BATTEN_LA_DOUBLE ? LEAST_DOUBLE : LEAST_FLOAT;
  d->failed = batten_saddle_panels(it->code, d->real)->factor(n, d->factor, least);
  if (d->failed) d->failed += d->rank;
}

/* ---- All of them ---- */

typedef struct factoring {
  const batten_saddle *s;
  const saddle_iterative *it;
  const saddle_level *level;
  size_t slots;      /* tasks, as many as there are domains at most */
  size_t first, end; /* domains of this portion */
  bool again;        /* those alone that failed */
  char *work;
  size_t work_bytes;
} factoring;

static void factor_slot(void *arg, size_t slot) {
  const factoring *f = arg;
  for (size_t i = f->first + slot; i < f->end; i += f->slots) {
    saddle_domain *d = &f->level->domains[i];
    if (!f->again || d->failed) factor_domain(f->s, f->it, f->level, d, f->work + slot * f->work_bytes);
  }
}

/* Memory for the domains of a portion, or for those of them that failed, in double. */
static batten_status take_memory(const batten_saddle *s, const factoring *f) {
  size_t k = s->matrix.k;
  for (size_t i = f->first; i < f->end; i++) {
    saddle_domain *d = &f->level->domains[i];
    if (f->again && !d->failed) continue;
    d->real = f->again || s->options.smooth_kernel ? BATTEN_LA_DOUBLE : BATTEN_LA_FLOAT;
    if (!d->reflectors) {
      d->reflectors = batten_alloc_array(s->ctx, k * (d->count + 1), sizeof(double));
      if (!d->reflectors) return BATTEN_E_NOMEM;
      d->tau = d->reflectors + k * d->count;
    }
    batten_free(s->ctx, d->factor);
    d->factor = batten_alloc(s->ctx, batten_panel_count(d->real, d->count) * (size_t)d->real);
    if (!d->factor) return BATTEN_E_NOMEM;
  }
  return BATTEN_OK;
}

/* What failed in float comes again in double. */
static batten_status factor_portion(batten_saddle *s, factoring *f) {
  for (int attempt = 0; attempt < 2; attempt++) {
    size_t failed = f->end;
    f->again = attempt > 0;
    batten_status st = take_memory(s, f);
    if (st < 0) return st;
    batten_parallel(s->ctx, f->slots, factor_slot, f);
    for (size_t i = f->end; i-- > f->first;)
      if (f->level->domains[i].failed) failed = i;
    if (failed == f->end) return BATTEN_OK;
    const saddle_domain *d = &f->level->domains[failed];
    if (d->real == BATTEN_LA_DOUBLE)
      return batten_fail(
          s->ctx, BATTEN_E_SINGULAR,
          "matrix: not positive definite near row %zu to working precision, among %zu neighbours; merge "
          "near points or check the kernel's sign",
          saddle_unknown(f->level, d->member[d->failed - 1]), d->count);
  }
  return BATTEN_OK;
}

/* Domains of a slot between two progress calls: some 0.1 s, of the large ones of a volume one at a time. */
static size_t portion_of(size_t most) {
  enum { PORTION = 16 };
  const double whole = PORTION * pow(640 / (double)most, 3);
  return whole < 1 ? 1 : whole < PORTION ? (size_t)whole : PORTION;
}

batten_status batten_saddle_domains_factor(batten_saddle *s, saddle_iterative *it) {
  size_t total = 0, done = 0, largest = 0;
  factoring f = {.s = s, .it = it, .work_bytes = batten_saddle_domain_work(it->domain_most, s->matrix.k)};
  batten_status st = BATTEN_OK;
  for (size_t q = 0; q < it->level_count; q++) {
    total += it->levels[q].domain_count;
    if (it->levels[q].domain_count > largest) largest = it->levels[q].domain_count;
  }
  if (total == 0) return BATTEN_OK;
  f.slots = it->slots < largest ? it->slots : largest;
  f.work = batten_alloc_array(s->ctx, f.slots, f.work_bytes);
  if (!f.work) return BATTEN_E_NOMEM;
  for (size_t q = 0; q < it->level_count; q++) {
    f.level = &it->levels[q];
    for (f.first = 0; f.first < f.level->domain_count; f.first = f.end) {
      size_t left = f.level->domain_count - f.first, most = portion_of(it->domain_most) * f.slots;
      f.end = f.first + (left < most ? left : most);
      st = batten_progress(s->ctx, "domains", (double)done / (double)total);
      if (st < 0) goto done;
      st = factor_portion(s, &f);
      if (st < 0) goto done;
      done += f.end - f.first;
    }
  }
done:
  batten_free(s->ctx, f.work);
  return st;
}

/* ---- Solve ---- */

/* u [n] := B22^-1 u. rounded: aligned scratch. */
static void apply_factor(const saddle_iterative *it, const saddle_domain *d, size_t n, double *u, void *rounded) {
  size_t rows = batten_panel_rows(d->real, n);
  double largest = 0;
  for (size_t i = 0; i < n; i++) largest = fmax(largest, fabs(u[i]));
  if (!(largest > 0)) return;
  const saddle_panels *panels = batten_saddle_panels(it->code, d->real);
  if (d->real == BATTEN_LA_DOUBLE) {
    double *x = rounded;
    for (size_t i = 0; i < rows; i++) x[i] = i < n ? u[i] : 0;
    panels->solve(n, d->factor, x);
    for (size_t i = 0; i < n; i++) u[i] = d->scale * x[i];
  } else {
    float *x = rounded;
    for (size_t i = 0; i < rows; i++) x[i] = i < n ? (float)(u[i] / largest) : 0;
    panels->solve(n, d->factor, x);
    for (size_t i = 0; i < n; i++) u[i] = d->scale * (largest * (double)x[i]);
  }
}

typedef struct solving {
  const batten_saddle *s;
  const saddle_iterative *it;
  const saddle_level *level;
  const double *r;
  double *w;
} solving;

static void solve_slot(void *arg, size_t slot) {
  const solving *p = arg;
  char *scratch = (char *)p->it->scratch + slot * p->it->scratch_bytes;
  double *u = (double *)(void *)scratch;
  for (size_t i = slot; i < p->level->domain_count; i += p->it->slots) {
    const saddle_domain *d = &p->level->domains[i];
    size_t count = d->count;
    for (size_t q = 0; q < count; q++) u[q] = p->r[d->member[q]];
    for (size_t j = 0; j < d->rank; j++) reflect(count, j, d->reflectors + j * count, d->tau[j], u);
    for (size_t j = 0; j < d->rank; j++) u[j] = 0;
    apply_factor(p->it, d, count - d->rank, u + d->rank, scratch + whole_grains(count * sizeof(double)));
    for (size_t j = d->rank; j-- > 0;) reflect(count, j, d->reflectors + j * count, d->tau[j], u);
    for (size_t q = 0; q < d->own; q++) p->w[d->member[q]] = u[q];
  }
}

void batten_saddle_domains_solve(const batten_saddle *s, const saddle_iterative *it, const saddle_level *l,
                                 const double *r, double *w) {
  solving p = {s, it, l, r, w};
  batten_parallel(s->ctx, it->slots, solve_slot, &p);
}
