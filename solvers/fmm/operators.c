/* The far field in few numbers: what depends on kernel, order and cut alone.   [Fong, Darve 2009]
 *
 * In a cell of side 2 about 0 the kernel is interpolated at the order^n Chebyshev nodes:
 *   phi(|x - y + 2 t|) = sum tau_i(x) K_t[i][j] tau_j(y),   tau_0 = sqrt(1/order), tau_a = sqrt(2/order) T_a
 * (the discrete orthogonality of T_a at the nodes makes tau orthonormal there), i and j standing for a product over
 * the axes. One orthonormal basis U serves all offsets t that two cells of one level can meet at: the left singular
 * vectors, up to the cut, of sampled columns of all K_t; since K_-t is the transpose, U serves sources and targets
 * alike. C_t = U' K_t U is what remains.
 *
 * Mirrors: x_a -> -x_a multiplies tau_i by the parity of i along axis a. The sampled space is the same under all
 * mirrors, so U splits into the 2^n classes of parity: singular vectors of 2^n matrices of a 2^n-th of the size, and
 * offsets of other signs have the same C_t up to the signs of rows and columns: 56 operators in 3-D in place of 316.
 *
 * Permutations of the axes: the samples are closed under them, so that the classes with as many odd axes have the
 * same singular vectors but for the order of the axes, and P U = U R with a small orthogonal R for each permutation
 * P. Of the 56 operators 16 are made from the kernel, the others are R C_t R'.
 *
 * Scale: phi(h r) = h^p phi(r). With the logarithm phi(h r) = h^p (phi(r) + ln h r^p): each level has C_t + ln h D_t,
 * D_t being made of r^p as C_t is of phi. r^p is a polynomial here and no more than a few columns in the sampled
 * space. */
#include "fmm/fmm_inner.h"

#include "base/checked.h"
#include "qp/lanes.h"

#include <string.h>

/* ---- sizes ---- */

/* The 2-norm of the error was measured at 20 to 1000 cuts for r in space, by how much the sums cancel and where the
 * points lie in their cells, and somewhat more for kernels that grow faster and where derivatives come in. An
 * order one below -log10 cut interpolates well enough for that. Below FLOOR, singular values are rounding errors. */
fmm_orders batten_fmm_orders(const batten_radial *kernel, double accuracy, bool derivatives) {
  const double FLOOR = 3e-15, wanted = accuracy / (derivatives || kernel->power > 1 ? 1500 : 1000);
  const double cut = wanted > FLOOR ? wanted : FLOOR;
  const double order = fmax(4, ceil(-log10(cut) - 1));
  return (fmm_orders){order > FMM_ORDER_MAX ? FMM_ORDER_MAX : (unsigned)order, cut};
}

/* Above the ranks of r, r^3, r^7 and r^2 ln r at the orders that were tried, 5 .. 14, by a quarter as a rule. */
size_t batten_fmm_rank_guess(const batten_radial *kernel, unsigned order) {
  const double p = order;
  if (kernel->n == 2) return (size_t)(kernel->power == 1 ? 0.6 * p * p + 4 : 0.4 * p * p + 6);
  const double factor = kernel->power < 3 ? 0.3 : kernel->power < 5 ? 0.23 : 0.19;
  return (size_t)(factor * p * p * p) + 10;
}

static size_t power_of(size_t base, unsigned exponent) {
  size_t p = 1;
  while (exponent-- > 0) p *= base;
  return p;
}

/* ---- one axis ---- */

static void make_axis(fmm_operators *o) {
  const unsigned p = o->order;
  const double pi = 3.14159265358979323846;
  double norm[FMM_ORDER_MAX];
  for (unsigned a = 0; a < p; a++) norm[a] = sqrt((a ? 2.0 : 1.0) / p);
  for (unsigned k = 0; k < p; k++) {
    /* Odd about the middle to the bit, so that mirrors are exact. */
    const unsigned mirror = p - 1 - k, from = k < mirror ? k : mirror;
    const double c = 2 * k + 1 == p ? 0 : cos(pi * (2 * from + 1) / (2 * p));
    o->node[k] = k < mirror ? c : -c;
  }
  for (unsigned k = 0; k < p; k++) {
    double before = 1, now = o->node[k];
    for (unsigned a = 0; a < p; a++) {
      const double t = a == 0 ? 1 : now;
      o->at_nodes[a][k] = norm[a] * t;
      o->from_nodes[k][a] = norm[a] * t;
      if (a == 0) continue;
      const double next = 2 * o->node[k] * now - before;
      before = now, now = next;
    }
  }
  /* T_i((s +- 1) / 2) = sum_a b[a] T_a(s), by x T_a = (T_(a-1) + T_(a+1)) / 2 in the recurrence
   * T_(i+1) = 2 ((s +- 1) / 2) T_i - T_(i-1). */
  for (unsigned side = 0; side < 2; side++) {
    double b[FMM_ORDER_MAX + 1][FMM_ORDER_MAX + 2] = {{0}};
    const double shift = side ? 1 : -1;
    b[0][0] = 1;
    b[1][0] = shift / 2, b[1][1] = 0.5;
    for (unsigned i = 1; i + 1 < p; i++)
      for (unsigned a = 0; a <= i + 1; a++) {
        const double below = a > 0 ? (a == 1 ? b[i][0] : b[i][a - 1] / 2) : 0, above = b[i][a + 1] / 2;
        b[i + 1][a] = below + above + shift * b[i][a] - b[i - 1][a];
      }
    for (unsigned i = 0; i < p; i++)
      for (unsigned a = 0; a < p; a++) {
        o->up[side][a][i] = b[i][a] * norm[i] / norm[a];
        o->down[side][i][a] = o->up[side][a][i];
      }
  }
}

/* ---- classes of parity ---- */

static unsigned class_of(unsigned n, unsigned order, size_t entry) {
  unsigned parity = 0;
  for (unsigned a = n; a-- > 0; entry /= order) parity |= (unsigned)(entry % order % 2) << a;
  return parity;
}

static void make_classes(fmm_operators *o) {
  size_t next = 0;
  for (unsigned c = 0; c < o->classes; c++) {
    const size_t first = o->class_first[c] = next;
    for (size_t i = 0; i < o->full; i++)
      if (class_of(o->n, o->order, i) == c) o->members[next++] = (uint32_t)i;
    o->class_full[c] = next - first;
  }
}

/* Orders of the axes; the first two for n = 2. */
enum { PERMUTATIONS = 6 };
static const unsigned char AXES[PERMUTATIONS][3] = {{0, 1, 2}, {1, 0, 2}, {0, 2, 1}, {2, 1, 0}, {1, 2, 0}, {2, 0, 1}};

static unsigned permutations(unsigned n) { return n == 2 ? 2 : PERMUTATIONS; }

/* The entry whose place along axis a is that of `entry` along axes[a]. */
static size_t permuted(const fmm_operators *o, size_t entry, const unsigned char *axes) {
  size_t at[3] = {0}, out = 0;
  for (unsigned a = o->n; a-- > 0; entry /= o->order) at[a] = entry % o->order;
  for (unsigned a = 0; a < o->n; a++) out = out * o->order + at[axes[a]];
  return out;
}

static unsigned permuted_class(unsigned n, unsigned c, const unsigned char *axes) {
  unsigned out = 0;
  for (unsigned a = 0; a < n; a++) out |= (c >> axes[a] & 1) << a;
  return out;
}

/* The class with as many odd axes that has them first, and the permutation that leads there from c. */
static unsigned first_class(unsigned n, unsigned c, const unsigned char **axes) {
  for (unsigned p = 0; p < permutations(n); p++) {
    const unsigned to = permuted_class(n, c, AXES[p]);
    *axes = AXES[p];
    if ((to & (to + 1)) == 0) return to;
  }
  return c;
}

/* Coordinates of node i of the grid of order^n, or of its mirror image. */
static void node_at(const fmm_operators *o, size_t i, double x[3]) {
  for (unsigned a = o->n; a-- > 0; i /= o->order) x[a] = o->node[i % o->order];
}

static void offset_of(unsigned kind, double t[3]) {
  for (unsigned a = 0; a < 3; a++) t[a] = 2.0 * (kind >> 2 * a & 3);
}

/* Offsets of cells that are apart: one axis has 2 or 3. */
static bool kind_exists(unsigned n, unsigned kind) {
  bool apart = false;
  for (unsigned a = 0; a < 3; a++) {
    const unsigned t = kind >> 2 * a & 3;
    if (a >= n && t) return false;
    apart = apart || t >= 2;
  }
  return apart;
}

/* The kind whose offsets fall from axis to axis, and the number of the permutation that leads there. */
static unsigned first_kind(unsigned n, unsigned kind, unsigned *permutation) {
  for (unsigned p = 0; p < permutations(n); p++) {
    unsigned to = 0;
    bool falls = true;
    for (unsigned a = 0; a < 3; a++) to |= (kind >> 2 * AXES[p][a] & 3) << 2 * a;
    for (unsigned a = 0; a + 1 < 3; a++) falls = falls && (to >> 2 * a & 3) >= (to >> 2 * (a + 1) & 3);
    *permutation = p;
    if (falls) return to;
  }
  return kind;
}

/* ---- the basis ---- */

typedef struct sampler {
  fmm_operators *o;
  fmm_near_function *near;
  const fmm_lanes *lanes;
  unsigned power;
  bool logarithm;
  double *grid[3]; /* [full] the nodes */
  size_t kinds;    /* those whose offsets fall from axis to axis */
  unsigned kind[FMM_KINDS];
  size_t per_kind, columns;
  uint32_t *place;                 /* [full] of an entry within its class */
  double *samples;                 /* [columns][full] */
  double *class_work[FMM_CLASSES]; /* [class_full^2] triangle of a class; the first of those with as many odd axes */
  double *singular[FMM_CLASSES];   /* [class_full] the same */
  double *scratch;                 /* [columns][2 * full], then [permutations * columns][class_full] for each class */
} sampler;

/* A tensor over the nodes to one over the polynomials (or the reverse, by the matrix); ends in `in`. */
static void through(const fmm_operators *o, const fmm_lanes *lanes, const double (*matrix)[FMM_ORDER_MAX], double *in,
                    double *spare) {
  double *from = in, *to = spare;
  for (unsigned a = 0; a < o->n; a++) {
    lanes->contract(o->order, o->full / o->order, matrix, from, to);
    double *t = from;
    from = to, to = t;
  }
  if (from != in) memcpy(in, from, o->full * sizeof *in);
}

/* r^power from a point to the nodes: the polynomial beside a logarithm. */
static void fill_power(const sampler *s, const double y[3], double *out) {
  for (size_t i = 0; i < s->o->full; i++) {
    double d2 = 0;
    for (unsigned a = 0; a < s->o->n; a++) d2 += (s->grid[a][i] - y[a]) * (s->grid[a][i] - y[a]);
    out[i] = d2;
    for (unsigned q = 2; q < s->power; q += 2) out[i] *= d2;
  }
}

/* Column `index` of the samples: a node of a cell at one of the offsets, spread evenly by the golden ratio. */
static void sample_task(void *arg, size_t index) {
  const sampler *s = arg;
  const fmm_operators *o = s->o;
  double *out = s->samples + index * o->full, *work = s->scratch + index * 2 * o->full, y[3], t[3];
  const size_t column = index % (s->kinds * s->per_kind);
  const double golden = 0.6180339887498949 * (double)(column + 1);
  node_at(o, (size_t)((golden - floor(golden)) * (double)o->full), y);
  offset_of(s->kind[column % s->kinds], t);
  for (unsigned a = 0; a < o->n; a++) y[a] -= t[a];
  if (column == index) {
    const double one = 1;
    const fmm_terms term = {.x = {&y[0], &y[1], &y[2]}, .w = &one};
    for (size_t i = 0; i < o->full; i += FMM_LANES) {
      double x[3][FMM_LANES] = {{0}}, sums[FMM_SUMS][FMM_LANES] = {{0}};
      for (size_t lane = 0; lane < FMM_LANES; lane++)
        for (unsigned a = 0; a < o->n; a++) x[a][lane] = s->grid[a][i + lane < o->full ? i + lane : i];
      s->near(&term, 0, 1, (const double(*)[FMM_LANES])x, sums);
      for (size_t lane = 0; lane < FMM_LANES && i + lane < o->full; lane++) work[i + lane] = sums[0][lane];
    }
  } else {
    fill_power(s, y, work);
  }
  through(o, s->lanes, (const double(*)[FMM_ORDER_MAX])o->from_nodes, work, work + o->full);
  memcpy(out, work, o->full * sizeof *out);
}

/* Householder QR of the samples of a class, one column for each of its m entries and a row for each sample: x has the
 * columns one after the other. Leaves R transposed in r: column j of r is row j of R. */
static void triangle(const qp_lanes *lanes, size_t rows, size_t m, double *x, double *dots, double *r) {
  for (size_t j = 0; j < m; j++) {
    double *v = x + j * rows + j, square = 0;
    const size_t length = rows - j;
    lanes->dots(length, 1, v, length, v, &square);
    const double norm = sqrt(square), diagonal = v[0] > 0 ? -norm : norm;
    for (size_t i = 0; i < m; i++) r[j * m + i] = i < j ? 0 : i == j ? diagonal : x[i * rows + j];
    if (norm == 0) continue;
    v[0] -= diagonal; /* I - v v' / (norm (norm + |v0|)) */
    lanes->dots(length, m - j - 1, v + rows, rows, v, dots);
    for (size_t i = 0; i < m - j - 1; i++) dots[i] /= norm * fabs(v[0]);
    lanes->subtract(length, m - j - 1, v + rows, rows, v, dots);
    for (size_t i = j + 1; i < m; i++) r[j * m + i] = x[i * rows + j];
  }
}

/* One-sided Jacobi: rotates the columns of r [m][m] until they are orthogonal: they are singular vectors times
 * singular values then. Accurate to each column's own size, so that cuts of 1e-14 are safe.   [Demmel, Veselic 1992]
 */
static void jacobi(const qp_lanes *lanes, size_t m, double *r, double *squares) {
  for (unsigned sweep = 0; sweep < 30; sweep++) {
    bool quiet = true;
    for (size_t i = 0; i < m; i++) lanes->dots(m, 1, r + i * m, m, r + i * m, &squares[i]);
    for (size_t i = 0; i + 1 < m; i++)
      for (size_t j = i + 1; j < m; j++) {
        double c = 0, *a = r + i * m, *b = r + j * m;
        lanes->dots(m, 1, a, m, b, &c);
        if (fabs(c) <= 1e-14 * sqrt(squares[i]) * sqrt(squares[j])) continue;
        quiet = false;
        const double zeta = (squares[j] - squares[i]) / (2 * c);
        const double t = (zeta > 0 ? 1 : -1) / (fabs(zeta) + sqrt(1 + zeta * zeta)), cosine = 1 / sqrt(1 + t * t);
        lanes->rotate(m, cosine, -cosine * t, a, b);
        squares[i] -= t * c, squares[j] += t * c;
        if (squares[i] < 0) squares[i] = 0;
        if (squares[j] < 0) squares[j] = 0;
      }
    if (quiet) break;
  }
  for (size_t i = 0; i < m; i++) lanes->dots(m, 1, r + i * m, m, r + i * m, &squares[i]);
}

/* Samples of the class with the first `odd` axes odd, under all permutations. */
static void class_task(void *arg, size_t odd) {
  const sampler *s = arg;
  const fmm_operators *o = s->o;
  const qp_lanes *lanes = qp_lanes_now();
  const unsigned c = (1u << odd) - 1, copies = permutations(o->n);
  const size_t m = o->class_full[c], rows = copies * s->columns;
  size_t before = 0;
  for (size_t k = 0; k < odd; k++) before += o->class_full[(1u << k) - 1];
  double *x = s->scratch + before * rows, *squares = s->singular[c];
  const uint32_t *member = o->members + o->class_first[c];
  for (unsigned p = 0; p < copies; p++)
    for (size_t j = 0; j < m; j++) {
      const double *from = s->samples + permuted(o, member[j], AXES[p]);
      for (size_t i = 0; i < s->columns; i++) x[j * rows + i * copies + p] = from[i * o->full];
    }
  triangle(lanes, rows, m, x, squares, s->class_work[c]);
  jacobi(lanes, m, s->class_work[c], squares);
  for (size_t j = 0; j < m; j++) squares[j] = sqrt(squares[j]);
}

/* Columns of the triangles that are above the cut, normalised: the basis and its transpose. */
static batten_status keep_basis(batten_context *ctx, const sampler *s, double cut) {
  fmm_operators *o = s->o;
  const unsigned char *axes;
  double largest = 0;
  size_t numbers = 0;
  for (unsigned odd = 0; odd <= o->n; odd++)
    for (size_t j = 0; j < o->class_full[(1u << odd) - 1]; j++)
      largest = fmax(largest, s->singular[(1u << odd) - 1][j]);
  for (unsigned c = 0; c < o->classes; c++) {
    const double *singular = s->singular[first_class(o->n, c, &axes)];
    o->class_place[c] = o->rank;
    for (size_t j = 0; j < o->class_full[c]; j++) o->class_rank[c] += singular[j] > cut * largest;
    o->rank += o->class_rank[c];
    numbers += 2 * o->class_rank[c] * o->class_full[c];
  }
  o->stride = (o->rank + FMM_PANEL - 1) / FMM_PANEL * FMM_PANEL;
  double *to = batten_alloc_array(ctx, numbers, sizeof *to);
  if (!to) return BATTEN_E_NOMEM;
  o->block = to;
  for (unsigned c = 0; c < o->classes; c++) {
    const unsigned from = first_class(o->n, c, &axes);
    const size_t m = o->class_full[c], rank = o->class_rank[c];
    const uint32_t *member = o->members + o->class_first[c];
    o->reduce[c] = to, to += m * rank;
    o->expand[c] = to, to += m * rank;
    for (size_t i = 0; i < m; i++) {
      const size_t at = s->place[permuted(o, member[i], axes)];
      for (size_t j = 0, k = 0; j < m; j++) {
        const double value = s->singular[from][j];
        if (!(value > cut * largest)) continue;
        const double u = s->class_work[from][j * m + at] / value;
        o->reduce[c][i * rank + k] = u, o->expand[c][k * m + i] = u;
        k++;
      }
    }
  }
  return BATTEN_OK;
}

static batten_status make_basis(batten_context *ctx, sampler *s, double cut) {
  fmm_operators *o = s->o;
  batten_status st = BATTEN_E_NOMEM;
  const size_t copies = permutations(o->n);
  size_t largest = 0, squares = 0, entries = 0;
  for (unsigned odd = 0; odd <= o->n; odd++) {
    const size_t m = o->class_full[(1u << odd) - 1];
    if (m > largest) largest = m;
    squares += m * (m + 1);
    entries += m;
  }
  /* 6 samples for each entry of the largest class */
  s->per_kind = (6 * largest + copies * s->kinds - 1) / (copies * s->kinds);
  s->columns = s->kinds * s->per_kind * (s->logarithm ? 2 : 1);
  const size_t sampling = 2 * o->full, factoring = copies * entries;
  double *work = NULL;
  s->samples = batten_alloc_array(ctx, s->columns, o->full * sizeof(double));
  s->scratch = batten_alloc_array(ctx, s->columns, (sampling > factoring ? sampling : factoring) * sizeof(double));
  s->place = batten_alloc_array(ctx, o->full, sizeof *s->place);
  work = batten_alloc_array(ctx, squares, sizeof(double));
  if (!s->samples || !s->scratch || !s->place || !work) goto done;
  for (unsigned c = 0; c < o->classes; c++)
    for (size_t i = 0; i < o->class_full[c]; i++) s->place[o->members[o->class_first[c] + i]] = (uint32_t)i;
  squares = 0;
  for (unsigned odd = 0; odd <= o->n; odd++) {
    const unsigned c = (1u << odd) - 1;
    s->singular[c] = work + squares, squares += o->class_full[c];
    s->class_work[c] = work + squares, squares += o->class_full[c] * o->class_full[c];
  }
  if ((st = batten_progress(ctx, "operators", 0)) < 0) goto done;
  batten_parallel(ctx, s->columns, sample_task, s);
  if ((st = batten_progress(ctx, "operators", 0.1)) < 0) goto done;
  batten_parallel(ctx, o->n + 1, class_task, s);
  st = keep_basis(ctx, s, cut);
done:
  batten_free(ctx, work);
  batten_free(ctx, s->scratch);
  batten_free(ctx, s->samples);
  return st;
}

/* ---- transfers ---- */

enum { COLUMN_BLOCK = 64 };

typedef struct transfers {
  const sampler *s;
  fmm_fill_function *fill;
  double *columns; /* [rank up to FMM_COLUMNS][full] the basis at the nodes */
  double *panels;  /* [stride / FMM_PANEL][full][FMM_PANEL] the same as panels */
  double *scratch; /* for each task */
  size_t scratch_each, first;
  size_t blocks; /* of columns: each task has one kind and one block */
  bool of_power;
  double *rotation[PERMUTATIONS]; /* by class c: R' [of the class it comes from][of c] */
} transfers;

/* Basis vector k as a tensor over the nodes. */
static void basis_at_nodes(const fmm_operators *o, const fmm_lanes *lanes, size_t k, double *out, double *spare) {
  memset(out, 0, o->full * sizeof *out);
  for (unsigned c = 0; c < o->classes; c++)
    if (k >= o->class_place[c] && k < o->class_place[c] + o->class_rank[c])
      for (size_t i = 0; i < o->class_full[c]; i++)
        out[o->members[o->class_first[c] + i]] = o->expand[c][(k - o->class_place[c]) * o->class_full[c] + i];
  through(o, lanes, (const double(*)[FMM_ORDER_MAX])o->at_nodes, out, spare);
}

/* Rows first .. first + FMM_PANEL - 1 of K_t; rows beyond the last repeat it. */
static void kernel_panel(const transfers *w, const double t[3], size_t first, double *panel) {
  const sampler *s = w->s;
  const size_t full = s->o->full;
  double rows[3][FMM_PANEL];
  for (size_t i = 0; i < FMM_PANEL; i++)
    for (unsigned a = 0; a < 3; a++)
      rows[a][i] = a < s->o->n ? s->grid[a][first + i < full ? first + i : full - 1] + t[a] : 0;
  if (!w->of_power) {
    w->fill((const double(*)[FMM_PANEL])rows, full, (const double *const *)s->grid, panel);
    return;
  }
  for (size_t i = 0; i < FMM_PANEL; i++)
    for (size_t j = 0; j < full; j++) {
      double d2 = 0;
      for (unsigned a = 0; a < s->o->n; a++) d2 += (rows[a][i] - s->grid[a][j]) * (rows[a][i] - s->grid[a][j]);
      double f = d2;
      for (unsigned q = 2; q < s->power; q += 2) f *= d2;
      panel[j * FMM_PANEL + i] = f;
    }
}

/* Columns of C_t = U' (K_t U) for one kind. scratch: panel [full][FMM_PANEL], product [COLUMN_BLOCK][full up to
 * panels], tile [FMM_COLUMNS][FMM_PANEL]. */
static void transfer_task(void *arg, size_t index) {
  const transfers *w = arg;
  const sampler *s = w->s;
  const fmm_operators *o = s->o;
  const unsigned kind = s->kind[(w->first + index) / w->blocks];
  const size_t k0 = (w->first + index) % w->blocks * COLUMN_BLOCK;
  const size_t k1 = o->rank - k0 < COLUMN_BLOCK ? o->rank : k0 + COLUMN_BLOCK;
  const size_t full = o->full, padded = (full + FMM_PANEL - 1) / FMM_PANEL * FMM_PANEL;
  double *panel = w->scratch + index * w->scratch_each, *product = panel + full * FMM_PANEL;
  double *out = w->of_power ? o->transfer_power[kind] : o->transfer[kind], t[3];
  double *small = product + COLUMN_BLOCK * padded;
  offset_of(kind, t);
  for (size_t i = 0; i < full; i += FMM_PANEL) {
    kernel_panel(w, t, i, panel);
    for (size_t k = k0; k < k1; k += FMM_COLUMNS)
      s->lanes->tile(full, panel, w->columns + k * full, full, product + (k - k0) * padded + i, padded);
  }
  for (size_t i = 0; i < o->stride; i += FMM_PANEL)
    for (size_t k = k0; k < k1; k += FMM_COLUMNS) {
      s->lanes->tile(full, w->panels + i * full, product + (k - k0) * padded, padded, small, FMM_PANEL);
      for (size_t c = 0; c < FMM_COLUMNS && k + c < k1; c++)
        memcpy(out + i * o->rank + (k + c) * FMM_PANEL, small + c * FMM_PANEL, FMM_PANEL * sizeof *out);
    }
}

enum { TOGETHER = 8 }; /* tasks between two calls of the host's progress callback */

static batten_status run_transfers(batten_context *ctx, transfers *w, double from, double to) {
  const fmm_operators *o = w->s->o;
  const size_t padded = (o->full + FMM_PANEL - 1) / FMM_PANEL * FMM_PANEL, tasks = w->s->kinds * w->blocks;
  w->scratch_each = o->full * FMM_PANEL + COLUMN_BLOCK * padded + FMM_COLUMNS * FMM_PANEL;
  w->scratch = batten_alloc_array(ctx, TOGETHER, w->scratch_each * sizeof *w->scratch);
  if (!w->scratch) return BATTEN_E_NOMEM;
  batten_status st = BATTEN_OK;
  for (w->first = 0; w->first < tasks && st >= 0; w->first += TOGETHER) {
    st = batten_progress(ctx, "operators", from + (to - from) * (double)w->first / (double)tasks);
    const size_t left = tasks - w->first;
    if (st >= 0) batten_parallel(ctx, left < TOGETHER ? left : TOGETHER, transfer_task, w);
  }
  batten_free(ctx, w->scratch);
  return st;
}

/* ---- other orders of the axes ---- */

/* R = U' P U: row class c comes from the class that the permutation makes of it. */
static batten_status make_rotation(batten_context *ctx, const sampler *s, unsigned permutation, double **rotation) {
  const fmm_operators *o = s->o;
  const unsigned char *axes = AXES[permutation];
  size_t numbers = 0, largest = 0;
  for (unsigned c = 0; c < o->classes; c++) {
    numbers += o->class_rank[c] * o->class_rank[c];
    if (o->class_full[c] > largest) largest = o->class_full[c];
  }
  double *moved = batten_alloc_array(ctx, largest, sizeof *moved), *to = NULL;
  if (moved) to = *rotation = batten_alloc_array(ctx, numbers, sizeof *to);
  if (to) memset(to, 0, numbers * sizeof *to);
  for (unsigned c = 0; c < o->classes && to; c++) {
    const unsigned from = permuted_class(o->n, c, axes);
    const size_t m = o->class_full[c], rank = o->class_rank[c];
    for (size_t b = 0; b < rank; b++, to += rank) {
      for (size_t i = 0; i < m; i++)
        moved[i] = o->expand[from][b * m + s->place[permuted(o, o->members[o->class_first[c] + i], axes)]];
      s->lanes->combine(m, rank, o->reduce[c], moved, to);
    }
  }
  batten_free(ctx, moved);
  return to ? BATTEN_OK : BATTEN_E_NOMEM;
}

/* C_t = R C R' of the kind with falling offsets; scratch: two matrices, two rows. */
static void rotate_task(void *arg, size_t index) {
  const transfers *w = arg;
  const fmm_operators *o = w->s->o;
  unsigned permutation, seen = 0, kind = 0, from = 0;
  for (; kind < FMM_KINDS; kind++) {
    if (!kind_exists(o->n, kind) || (from = first_kind(o->n, kind, &permutation)) == kind) continue;
    if (seen++ == w->first + index) break;
  }
  const unsigned char *axes = AXES[permutation];
  const size_t rank = o->rank;
  const double *in = w->of_power ? o->transfer_power[from] : o->transfer[from];
  double *out = w->of_power ? o->transfer_power[kind] : o->transfer[kind];
  double *dense = w->scratch + index * w->scratch_each, *half = dense + rank * rank, *row = half + rank * rank;
  double *factors = row + rank;
  for (size_t i = 0; i < rank; i++)
    for (size_t k = 0; k < rank; k++)
      dense[i * rank + k] = in[i / FMM_PANEL * FMM_PANEL * rank + k * FMM_PANEL + i % FMM_PANEL];
  memset(half, 0, rank * rank * sizeof *half);
  const double *r = w->rotation[permutation];
  for (unsigned c = 0; c < o->classes; c++) {
    const size_t m = o->class_rank[c], source = o->class_place[permuted_class(o->n, c, axes)];
    for (size_t a = 0; a < m; a++) {
      for (size_t b = 0; b < m; b++) factors[b] = r[b * m + a];
      w->s->lanes->combine(m, rank, dense + source * rank, factors, half + (o->class_place[c] + a) * rank);
    }
    r += m * m;
  }
  memset(out, 0, o->stride * rank * sizeof *out);
  for (size_t i = 0; i < rank; i++) {
    memset(row, 0, rank * sizeof *row);
    r = w->rotation[permutation];
    for (unsigned c = 0; c < o->classes; c++) {
      const size_t m = o->class_rank[c], source = o->class_place[permuted_class(o->n, c, axes)];
      w->s->lanes->combine(m, m, r, half + i * rank + source, row + o->class_place[c]);
      r += m * m;
    }
    for (size_t k = 0; k < rank; k++) out[i / FMM_PANEL * FMM_PANEL * rank + k * FMM_PANEL + i % FMM_PANEL] = row[k];
  }
}

static batten_status run_rotations(batten_context *ctx, transfers *w, double at) {
  const fmm_operators *o = w->s->o;
  size_t tasks = 0;
  for (unsigned k = 0; k < FMM_KINDS; k++) tasks += kind_exists(o->n, k);
  tasks -= w->s->kinds;
  w->scratch_each = 2 * o->rank * (o->rank + 1);
  w->scratch = batten_alloc_array(ctx, TOGETHER, w->scratch_each * sizeof *w->scratch);
  if (!w->scratch) return BATTEN_E_NOMEM;
  batten_status st = BATTEN_OK;
  for (w->first = 0; w->first < tasks && st >= 0; w->first += TOGETHER) {
    st = batten_progress(ctx, "operators", at);
    const size_t left = tasks - w->first;
    if (st >= 0) batten_parallel(ctx, left < TOGETHER ? left : TOGETHER, rotate_task, w);
  }
  batten_free(ctx, w->scratch);
  return st;
}

static batten_status make_transfers(batten_context *ctx, const sampler *s) {
  fmm_operators *o = s->o;
  const size_t columns = (o->rank + FMM_COLUMNS - 1) / FMM_COLUMNS * FMM_COLUMNS;
  transfers w = {
      .s = s, .fill = s->lanes->fill(o->n, s->power), .blocks = (o->rank + COLUMN_BLOCK - 1) / COLUMN_BLOCK};
  batten_status st = BATTEN_E_NOMEM;
  w.columns = batten_alloc_array(ctx, columns + 1, o->full * sizeof(double)); /* + 1: spare of basis_at_nodes */
  w.panels = batten_alloc_array(ctx, o->stride, o->full * sizeof(double));
  if (!w.columns || !w.panels) goto done;
  for (unsigned kind = 0; kind < FMM_KINDS; kind++) {
    if (!kind_exists(o->n, kind)) continue;
    if (!(o->transfer[kind] = batten_alloc_array(ctx, o->stride * o->rank, sizeof(double)))) goto done;
    if (s->logarithm && !(o->transfer_power[kind] = batten_alloc_array(ctx, o->stride * o->rank, sizeof(double))))
      goto done;
  }
  memset(w.columns, 0, columns * o->full * sizeof(double));
  memset(w.panels, 0, o->stride * o->full * sizeof(double));
  for (size_t k = 0; k < o->rank; k++) {
    double *column = w.columns + k * o->full, *panel = w.panels + k / FMM_PANEL * FMM_PANEL * o->full + k % FMM_PANEL;
    basis_at_nodes(o, s->lanes, k, column, w.columns + columns * o->full);
    for (size_t i = 0; i < o->full; i++) panel[i * FMM_PANEL] = column[i];
  }
  for (unsigned p = 1; p < permutations(o->n); p++)
    if ((st = make_rotation(ctx, s, p, &w.rotation[p])) < 0) goto done;
  if ((st = run_transfers(ctx, &w, 0.2, s->logarithm ? 0.5 : 0.9)) < 0) goto done;
  if ((st = run_rotations(ctx, &w, s->logarithm ? 0.5 : 0.9)) < 0 || !s->logarithm) goto done;
  w.of_power = true;
  if ((st = run_transfers(ctx, &w, 0.6, 0.9)) < 0) goto done;
  st = run_rotations(ctx, &w, 0.9);
done:
  for (unsigned p = 0; p < PERMUTATIONS; p++) batten_free(ctx, w.rotation[p]);
  batten_free(ctx, w.panels);
  batten_free(ctx, w.columns);
  return st;
}

/* ---- the whole ---- */

/* What is allocated above: samples and their factors, then all transfers with what makes them. */
size_t batten_fmm_operator_bytes(const batten_radial *kernel, fmm_orders orders, size_t beside) {
  const size_t even = (orders.order + 1) / 2, uneven = orders.order / 2, n = kernel->n;
  const size_t full = power_of(orders.order, (unsigned)n), rank = batten_fmm_rank_guess(kernel, orders.order);
  const size_t stride = rank + FMM_PANEL, falling = n == 2 ? 7 : 16, kinds = n == 2 ? 12 : 56,
               logarithm = kernel->logarithm ? 2 : 1;
  size_t entries = 0, squares = 0;
  for (size_t odd = 0; odd <= n; odd++) {
    const size_t m = power_of(even, (unsigned)(n - odd)) * power_of(uneven, (unsigned)odd);
    entries += m, squares += m * (m + 1);
  }
  const size_t copies = permutations((unsigned)n), largest = power_of(even, (unsigned)n);
  const size_t columns = (6 * largest / (copies * falling) + 1) * falling * logarithm;
  const size_t scratch = 2 * full > copies * entries ? 2 * full : copies * entries;
  const size_t sampling = columns * (full + scratch) + squares;
  const size_t transfer = TOGETHER * (full * FMM_PANEL + COLUMN_BLOCK * (full + FMM_PANEL) + FMM_COLUMNS * FMM_PANEL);
  const size_t rotation = TOGETHER * 2 * rank * (rank + 1);
  const size_t all = kinds * stride * rank * logarithm;
  size_t making = (rank + FMM_COLUMNS + 1 + stride) * full + copies * rank * rank / 6 +
                  (transfer > rotation ? transfer : rotation);
  if (making < beside) making = beside;
  making += all;
  const size_t held = sizeof(fmm_operators) / sizeof(double) + (rank / 2 + 5) * full; /* bases, members, grid */
  return (held + (sampling > making ? sampling : making)) * sizeof(double);
}

fmm_operators *batten_fmm_operators_retain(fmm_operators *o) {
  if (o) atomic_fetch_add(&o->owners, 1);
  return o;
}

void batten_fmm_operators_free(fmm_operators *o) {
  if (!o || atomic_fetch_sub(&o->owners, 1) != 1) return;
  for (unsigned k = 0; k < FMM_KINDS; k++) {
    batten_free(o->ctx, o->transfer[k]);
    batten_free(o->ctx, o->transfer_power[k]);
  }
  batten_free(o->ctx, o->block);
  batten_free(o->ctx, o->members);
  batten_free(o->ctx, o);
}

batten_status batten_fmm_operators_new(batten_context *ctx, const batten_radial *kernel, fmm_orders orders,
                                       fmm_operators **out) {
  const size_t before = batten_bytes_in_use(ctx);
  sampler s = {
      .lanes = batten_fmm_lanes_now(), .power = (unsigned)kernel->power, .logarithm = kernel->logarithm != 0};
  s.near = s.lanes->near(kernel->n, s.power, 0, 0);
  batten_status st = BATTEN_E_NOMEM;
  fmm_operators *o = batten_alloc(ctx, sizeof *o);
  if (!o) goto done;
  *o = (fmm_operators){.ctx = ctx, .n = kernel->n, .order = orders.order, .classes = 1u << kernel->n};
  atomic_init(&o->owners, 1);
  o->full = power_of(o->order, o->n);
  s.o = o;
  if (!(o->members = batten_alloc_array(ctx, o->full, sizeof *o->members))) goto done;
  if (!(s.grid[0] = batten_alloc_array(ctx, 3 * o->full, sizeof(double)))) goto done;
  s.grid[1] = s.grid[0] + o->full, s.grid[2] = s.grid[1] + o->full;
  make_axis(o);
  make_classes(o);
  for (size_t i = 0; i < o->full; i++) {
    double x[3] = {0, 0, 0};
    node_at(o, i, x);
    for (unsigned a = 0; a < 3; a++) s.grid[a][i] = x[a];
  }
  for (unsigned k = 0, permutation; k < FMM_KINDS; k++)
    if (kind_exists(o->n, k) && first_kind(o->n, k, &permutation) == k) s.kind[s.kinds++] = k;
  if ((st = make_basis(ctx, &s, orders.cut)) < 0) goto done;
  if ((st = make_transfers(ctx, &s)) < 0) goto done;
  batten_free(ctx, s.grid[0]);
  batten_free(ctx, s.place);
  s.grid[0] = NULL, s.place = NULL;
  o->bytes = batten_bytes_in_use(ctx) - before;
  *out = o;
  o = NULL;
done:
  batten_free(ctx, s.place);
  batten_free(ctx, s.grid[0]);
  batten_fmm_operators_free(o);
  return st;
}
