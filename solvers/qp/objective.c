/* The objective of a quadratic program: values from the caller's data, triangular factors for the dense engines.
 *
 * Unknowns are scaled by powers of two (metric) to columns of length about one, so that rank is judged alike in
 * whatever units they come. With U'U = H, sums of squares are brought to a triangle by Householder QR, rows by blocks
 * and groups of unknowns that no row connects apart, once for all rho:
 *   [W^1/2 A | W^1/2 b; U | 0] -> [T | t; 0 | *],   then for rho   [T | t; rho^1/2 I | 0] -> [R | c; 0 | *],
 * so that A'A, and with it the square of A's condition, never appears. See objective.h. */
#include "objective.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

#include "base/checked.h"
#include "la/la.h"
#include "matrix_row.h"

static const batten_la_real D = BATTEN_LA_DOUBLE;

struct qp_objective_state {
  bool convex;      /* H is known to be semidefinite */
  size_t rows;      /* of the triangle, at most n */
  double *triangle; /* [n + 1][rows]: T and t of scaled unknowns; NULL = not yet made */
};

/* ---- Values ---- */

static double weight_of(const batten_qp_problem *p, size_t i) { return p->weights ? p->weights[i] : 1; }

/* out := m x, or out += m x */
static void times(const batten_matrix *m, const double *x, bool add, double *out) {
  if (m->dense && batten_la_fits(m->rows) && batten_la_fits(m->columns) && m->columns > 0) {
    batten_la_gemv(D, 'T', m->columns, m->rows, 1, m->dense, m->columns, x, add ? 1 : 0, out);
    return;
  }
  for (size_t i = 0; i < m->rows; i++) {
    qp_matrix_row row = qp_row_of(m, i);
    double sum = 0;
    for (size_t e = 0; e < row.count; e++) sum += row.values[e] * x[qp_row_column(&row, e)];
    out[i] = add ? out[i] + sum : sum;
  }
}

/* out += m'y */
static void add_transposed(const batten_matrix *m, const double *y, double *out) {
  if (m->dense && batten_la_fits(m->rows) && batten_la_fits(m->columns)) {
    batten_la_gemv(D, 'N', m->columns, m->rows, 1, m->dense, m->columns, y, 1, out);
    return;
  }
  for (size_t i = 0; i < m->rows; i++) {
    qp_matrix_row row = qp_row_of(m, i);
    for (size_t e = 0; e < row.count; e++) out[qp_row_column(&row, e)] += y[i] * row.values[e];
  }
}

/* o->residual := A x - b */
static void residual_at(const qp_objective *o, const double *x) {
  const batten_qp_problem *p = o->problem;
  if (o->k == 0) return;
  times(p->a, x, false, o->residual);
  for (size_t i = 0; p->b && i < o->k; i++) o->residual[i] -= p->b[i];
}

void qp_objective_gradient(const qp_objective *o, const double *x, double *gradient) {
  const batten_qp_problem *p = o->problem;
  for (size_t j = 0; j < o->n; j++) gradient[j] = p->g ? p->g[j] : 0;
  if (p->h) times(p->h, x, true, gradient);
  if (o->k == 0) return;
  residual_at(o, x);
  for (size_t i = 0; i < o->k; i++) o->residual[i] *= weight_of(p, i);
  add_transposed(p->a, o->residual, gradient);
}

/* ---- Metric ---- */

/* unit [n] := the power of two that brings the largest |W^1/2 A| of each column to about 1. */
static void units_of_columns(const qp_objective *o, double *unit) {
  memset(unit, 0, o->n * sizeof *unit);
  for (size_t i = 0; i < o->k; i++) {
    qp_matrix_row row = qp_row_of(o->problem->a, i);
    double w = sqrt(weight_of(o->problem, i));
    for (size_t e = 0; e < row.count; e++) {
      size_t j = qp_row_column(&row, e);
      double size = w * fabs(row.values[e]);
      unit[j] = size > unit[j] ? size : unit[j];
    }
  }
  for (size_t j = 0; j < o->n; j++) unit[j] = unit[j] > 0 ? batten_unit(fmin(unit[j], DBL_MAX)) : 1;
}

static double diagonal_of(const batten_matrix *h, size_t j) {
  qp_matrix_row row = qp_row_of(h, j);
  if (!row.columns) return row.values[j];
  for (size_t e = 0; e < row.count; e++)
    if (row.columns[e] == j) return row.values[e];
  return 0;
}

/* metric [n] := sums of the squares of W^1/2 A unit by columns; false when some are near the ends of the range. */
static bool sum_squares(const qp_objective *o, const double *unit) {
  memset(o->metric, 0, o->n * sizeof *o->metric);
  for (size_t i = 0; i < o->k; i++) {
    qp_matrix_row row = qp_row_of(o->problem->a, i);
    double w = sqrt(weight_of(o->problem, i));
    for (size_t e = 0; e < row.count; e++) {
      size_t j = qp_row_column(&row, e);
      double part = w * row.values[e] * unit[j];
      o->metric[j] += part * part;
    }
  }
  bool safe = true;
  for (size_t j = 0; j < o->n; j++) safe = safe && o->metric[j] > 0x1p-900 && o->metric[j] < 0x1p900;
  return safe;
}

/* Unknowns without curvature of their own are moved like the stiffest ones. Sizes stay where squares are in range. */
static void set_metric(const qp_objective *o, double *unit) {
  const double RANGE = 0x1p500;
  for (size_t j = 0; j < o->n; j++) unit[j] = 1;
  if (!sum_squares(o, unit)) {
    units_of_columns(o, unit);
    sum_squares(o, unit);
  }
  double stiffest = 0;
  for (size_t j = 0; j < o->n; j++) {
    double h = o->problem->h ? diagonal_of(o->problem->h, j) : 0;
    o->metric[j] = hypot(sqrt(o->metric[j]) / unit[j], sqrt(fmax(h, 0)));
    if (o->metric[j] > 0) o->metric[j] = 1 / batten_unit(fmin(fmax(o->metric[j], 1 / RANGE), RANGE));
    stiffest = fmax(stiffest, o->metric[j]);
  }
  for (size_t j = 0; j < o->n; j++)
    if (o->metric[j] <= 0) o->metric[j] = stiffest > 0 ? stiffest : 1;
}

batten_status qp_objective_new(batten_context *ctx, const batten_qp_problem *problem, qp_objective *out) {
  size_t n = problem->n, k = problem->a ? problem->a->rows : 0;
  *out = (qp_objective){.problem = problem, .n = n, .k = k};
  batten_status st = BATTEN_E_NOMEM;
  double *unit = NULL;
  out->state = batten_alloc(ctx, sizeof *out->state);
  if (!out->state) goto done;
  *out->state = (struct qp_objective_state){.convex = problem->h == NULL};
  out->metric = batten_alloc_array(ctx, n, sizeof *out->metric);
  if (!out->metric) goto done;
  out->residual = batten_alloc_array(ctx, k, sizeof *out->residual);
  if (!out->residual) goto done;
  unit = batten_alloc_array(ctx, n, sizeof *unit);
  if (!unit) goto done;
  set_metric(out, unit);
  st = BATTEN_OK;
done:
  batten_free(ctx, unit);
  if (st < 0) qp_objective_free(ctx, out);
  return st;
}

void qp_objective_free(batten_context *ctx, qp_objective *o) {
  if (o->state) batten_free(ctx, o->state->triangle);
  batten_free(ctx, o->state);
  batten_free(ctx, o->metric);
  batten_free(ctx, o->residual);
  *o = (qp_objective){0};
}

/* ---- Factors ---- */

/* Where rows of [A b; U 0] come from while they are brought to a triangle by blocks. */
typedef struct row_source {
  const qp_objective *o;
  const double *root; /* [n][n] of H, or NULL */
  size_t rank;
  double *inverse; /* [n] of the metric */
  struct sized_row *order;
  size_t n, rows;  /* unknowns and rows taken: all, or those of one group */
  uint32_t *place; /* [o->n] column of an unknown among them */
} row_source;

typedef struct sized_row {
  double size;
  size_t row;
} sized_row;

static int larger_first(const void *one, const void *other) {
  const sized_row *a = one, *b = other;
  if (a->size != b->size) return a->size < b->size ? 1 : -1;
  return a->row < b->row ? -1 : a->row > b->row;
}

/* Large rows first: then reflections keep the small digits of small rows, and weights may be 1e20 apart [Cox, Higham
 * 1998, Stability of Householder QR factorization for weighted least squares problems]. */
static void order_rows(const row_source *s) {
  const double ALIKE = 100; /* two digits may go */
  const qp_objective *o = s->o;
  size_t rows = o->k + s->rank;
  double most = 0, least = INFINITY;
  for (size_t i = 0; i < rows; i++) {
    double size = 0;
    if (i < o->k) {
      qp_matrix_row row = qp_row_of(o->problem->a, i);
      for (size_t e = 0; e < row.count; e++) {
        double entry = fabs(row.values[e]) * s->inverse[qp_row_column(&row, e)];
        size = entry > size ? entry : size;
      }
      size *= sqrt(weight_of(o->problem, i));
    }
    for (size_t j = 0; i >= o->k && j < o->n; j++)
      size = fmax(size, fabs(s->root[i - o->k + j * o->n]) * s->inverse[j]);
    s->order[i] = (sized_row){size, i};
    most = size > most ? size : most;
    least = size > 0 && size < least ? size : least;
  }
  if (most > ALIKE * least) qsort(s->order, rows, sizeof *s->order, larger_first);
}

/* Row i of the scaled [W^1/2 A | W^1/2 b; U | 0] -> row `at` of block [n + 1][ld]. What is not 0 in it belongs to
 * unknowns that are taken. */
static void put_row(const row_source *s, size_t i, double *block, size_t at, size_t ld) {
  const qp_objective *o = s->o;
  for (size_t j = 0; j <= s->n; j++) block[at + j * ld] = 0;
  if (i >= o->k) {
    for (size_t j = 0; j < o->n; j++) {
      double value = s->root[(i - o->k) + j * o->n];
      if (value != 0) block[at + s->place[j] * ld] = value * s->inverse[j];
    }
    return;
  }
  qp_matrix_row row = qp_row_of(o->problem->a, i);
  double w = sqrt(weight_of(o->problem, i));
  for (size_t e = 0; e < row.count; e++) {
    size_t j = qp_row_column(&row, e);
    if (row.values[e] != 0) block[at + s->place[j] * ld] = w * (row.values[e] * s->inverse[j]);
  }
  block[at + s->n * ld] = o->problem->b ? w * o->problem->b[i] : 0;
}

/* The rows of source -> *triangle [n + 1][*rows], *rows = min(n, all rows). */
static batten_status reduce_rows(batten_context *ctx, const row_source *source, double **triangle, size_t *rows) {
  size_t n = source->n, all = source->rows, kept = 0, next = 0;
  /* 4 n: the triangle that is carried along costs a quarter more; 512: a block is worth its calls */
  size_t block_rows = 4 * n > 512 ? 4 * n : 512, ld = all < n + block_rows ? all : n + block_rows, count;
  batten_status st = BATTEN_E_NOMEM;
  double *block = NULL, *tau = NULL, *out = NULL;
  *rows = all < n ? all : n;
  if (!batten_la_fits(ld) || !batten_la_fits(n + 1))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "n: %zu unknowns; use the interior engine", n);
  if (!batten_mul(ld, n + 1, &count)) return batten_fail(ctx, BATTEN_E_TOO_LARGE, "n: %zu unknowns", n);
  block = batten_alloc_array(ctx, count, sizeof *block);
  if (!block) goto done;
  tau = batten_alloc_array(ctx, n + 1, sizeof *tau);
  if (!tau) goto done;
  out = batten_alloc_array(ctx, *rows, (n + 1) * sizeof *out);
  if (!out) goto done;
  do {
    size_t filled = kept;
    while (next < all && filled < ld) put_row(source, source->order[next++].row, block, filled++, ld);
    st = batten_la_geqrf(ctx, filled, n + 1, block, ld, tau);
    if (st < 0) goto done;
    kept = filled < n ? filled : n;
    for (size_t j = 0; j <= n; j++)
      for (size_t i = j + 1; i < kept; i++) block[i + j * ld] = 0;
    st = batten_progress(ctx, "objective", all ? (double)next / (double)all : 1);
    if (st < 0) goto done;
    st = BATTEN_E_NOMEM;
  } while (next < all);
  for (size_t j = 0; j <= n; j++) memcpy(out + j * *rows, block + j * ld, *rows * sizeof *out);
  *triangle = out;
  out = NULL;
  st = BATTEN_OK;
done:
  batten_free(ctx, out);
  batten_free(ctx, tau);
  batten_free(ctx, block);
  return st;
}

/* ---- Groups of unknowns that no row connects: each is brought to its own triangle ---- */

static size_t leader_of(uint32_t *group, size_t j) {
  while (group[j] != j) j = group[j] = group[group[j]];
  return j;
}

/* Row i of the source as its entries' unknowns meet in one group; its leader, or SIZE_MAX for a row of zeros. */
static size_t join(const row_source *s, size_t i, uint32_t *group) {
  const qp_objective *o = s->o;
  size_t first = SIZE_MAX;
  bool from_a = i < o->k;
  qp_matrix_row row = from_a ? qp_row_of(o->problem->a, i) : (qp_matrix_row){.count = o->n};
  for (size_t e = 0; e < row.count; e++) {
    size_t j = from_a ? qp_row_column(&row, e) : e;
    if ((from_a ? row.values[e] : s->root[(i - o->k) + j * o->n]) == 0) continue;
    if (group[j] == first) continue;
    j = leader_of(group, j);
    if (first == SIZE_MAX) first = j;
    /* the least unknown leads */
    size_t low = j < first ? j : first, high = j < first ? first : j;
    group[high] = (uint32_t)low;
    first = low;
  }
  return first;
}

/* The unknowns of `leader` take the places 0, 1, .. in their order; returns how many. */
static size_t number(const row_source *s, const uint32_t *group, size_t leader, uint32_t *place) {
  size_t count = 0;
  for (size_t j = 0; j < s->o->n; j++)
    if (group[j] == leader) place[j] = (uint32_t)count++;
  return count;
}

/* One triangle of all. */
static batten_status reduce_all(batten_context *ctx, row_source *source, double **triangle, size_t *rows) {
  source->n = source->o->n;
  source->rows = source->o->k + source->rank;
  for (size_t j = 0; j < source->n; j++) source->place[j] = (uint32_t)j;
  return reduce_rows(ctx, source, triangle, rows);
}

/* Triangles of the groups, put into one of all: unknowns keep their order, so it is one. group: leaders of unknowns;
 * each has as many rows as unknowns. row_group [rows], list [rows] scratch. */
static batten_status reduce_groups(batten_context *ctx, const row_source *source, const uint32_t *group,
                                   const uint32_t *row_group, sized_row *list, double **triangle) {
  size_t n = source->o->n, all = source->o->k + source->rank;
  double *whole = batten_alloc_array(ctx, n, (n + 1) * sizeof *whole);
  if (!whole) return BATTEN_E_NOMEM;
  memset(whole, 0, n * (n + 1) * sizeof *whole);
  for (size_t leader = 0; leader < n; leader++) {
    if (group[leader] != leader) continue;
    row_source part = *source;
    double *own = NULL;
    size_t kept;
    part.n = number(source, group, leader, part.place);
    part.rows = 0;
    part.order = list;
    for (size_t i = 0; i < all; i++)
      if (row_group[source->order[i].row] == leader) list[part.rows++] = source->order[i];
    batten_status st = reduce_rows(ctx, &part, &own, &kept);
    if (st < 0) {
      batten_free(ctx, whole);
      return st;
    }
    for (size_t j = leader; j <= n; j++) { /* column n: the right side */
      if (j < n && group[j] != leader) continue;
      const double *column = own + (j < n ? part.place[j] : part.n) * kept;
      for (size_t i = leader; i < n && i <= j; i++)
        if (group[i] == leader) whole[i + j * n] = column[part.place[i]];
    }
    batten_free(ctx, own);
  }
  *triangle = whole;
  return BATTEN_OK;
}

/* Groups of unknowns and rows; true when there are several, each with as many rows as unknowns at least. count [n]
 * scratch. */
static bool find_groups(const row_source *source, uint32_t *group, uint32_t *row_group, size_t *count) {
  const uint32_t NONE = UINT32_MAX;
  size_t n = source->o->n, all = source->o->k + source->rank, groups = 0;
  for (size_t j = 0; j < n; j++) group[j] = (uint32_t)j;
  for (size_t i = 0; i < all; i++) {
    size_t leader = join(source, i, group);
    row_group[i] = leader == SIZE_MAX ? NONE : (uint32_t)leader;
  }
  memset(count, 0, n * sizeof *count);
  for (size_t i = 0; i < all; i++) {
    if (row_group[i] == NONE) continue;
    row_group[i] = (uint32_t)leader_of(group, row_group[i]);
    count[row_group[i]]++;
  }
  for (size_t j = 0; j < n; j++) group[j] = (uint32_t)leader_of(group, j);
  bool full = true;
  for (size_t j = n; j-- > 0;) {
    /* a group's unknowns are taken from its count as they are met, its leader last */
    full = full && count[group[j]] > 0;
    count[group[j]] -= count[group[j]] > 0;
    groups += group[j] == j;
  }
  return full && groups > 1;
}

static batten_status reduce_by_groups(batten_context *ctx, row_source *source, double **triangle, size_t *rows) {
  size_t n = source->o->n, all = source->o->k + source->rank;
  batten_status st = BATTEN_E_NOMEM;
  uint32_t *group = NULL;
  sized_row *list = NULL;
  size_t *count = batten_alloc_array(ctx, n, sizeof *count);
  if (!count) goto done;
  group = batten_alloc_array(ctx, n + all, sizeof *group);
  if (!group) goto done;
  if (!find_groups(source, group, group + n, count)) {
    st = reduce_all(ctx, source, triangle, rows);
    goto done;
  }
  list = batten_alloc_array(ctx, all, sizeof *list);
  if (!list) goto done;
  *rows = n;
  st = reduce_groups(ctx, source, group, group + n, list, triangle);
done:
  batten_free(ctx, list);
  batten_free(ctx, group);
  batten_free(ctx, count);
  return st;
}

/* The triangle of A and H, made by the first call. */
static batten_status make_triangle(batten_context *ctx, const qp_objective *o) {
  struct qp_objective_state *state = o->state;
  if (state->triangle) return BATTEN_OK;
  batten_status st;
  row_source source = {.o = o};
  double *root = NULL;
  if (o->problem->h) {
    root = batten_alloc_array(ctx, o->n, o->n * sizeof *root);
    if (!root) return BATTEN_E_NOMEM;
    st = qp_hessian_root(ctx, o->problem->h, root, &source.rank);
    if (st < 0) goto done;
    source.root = root;
  }
  st = BATTEN_E_NOMEM;
  source.order = batten_alloc_array(ctx, o->k + source.rank, sizeof *source.order);
  if (!source.order) goto done;
  source.inverse = batten_alloc_array(ctx, o->n, sizeof *source.inverse);
  if (!source.inverse) goto done;
  source.place = batten_alloc_array(ctx, o->n, sizeof *source.place);
  if (!source.place) goto done;
  for (size_t j = 0; j < o->n; j++) source.inverse[j] = 1 / o->metric[j];
  order_rows(&source);
  st = reduce_by_groups(ctx, &source, &state->triangle, &state->rows);
done:
  batten_free(ctx, source.place);
  batten_free(ctx, source.inverse);
  batten_free(ctx, source.order);
  batten_free(ctx, root);
  return st;
}

static batten_status singular(batten_context *ctx, double rho) {
  return batten_fail(ctx, BATTEN_E_SINGULAR, "objective: not strictly convex with a proximal term of %g", rho);
}

/* r, c := the triangle of scaled unknowns with rho^1/2 below it. SINGULAR by its condition. */
static batten_status factor_squares(batten_context *ctx, const qp_objective *o, double rho, double *r, double *c) {
  const struct qp_objective_state *state = o->state;
  size_t n = o->n, rows = state->rows, ld = rows + (rho > 0 ? n : 0);
  if (ld < n) return singular(ctx, rho);
  batten_status st = BATTEN_E_NOMEM;
  double rcond = 0, *tau = NULL, *stacked = batten_alloc_array(ctx, ld, (n + 1) * sizeof *stacked);
  if (!stacked) goto done;
  tau = batten_alloc_array(ctx, n + 1, sizeof *tau);
  if (!tau) goto done;
  for (size_t j = 0; j <= n; j++) {
    memcpy(stacked + j * ld, state->triangle + j * rows, rows * sizeof *stacked);
    for (size_t i = rows; i < ld; i++) stacked[i + j * ld] = i - rows == j ? sqrt(rho) : 0;
  }
  st = rho > 0 ? batten_la_geqrf(ctx, ld, n + 1, stacked, ld, tau) : BATTEN_OK;
  if (st < 0) goto done;
  for (size_t j = 0; j < n; j++) memcpy(r + j * n, stacked + j * ld, (j + 1) * sizeof *r);
  memcpy(c, stacked + n * ld, n * sizeof *c);
  st = batten_la_trcon(ctx, n, r, n, &rcond);
  /* 10: small problems have rounding, too */
  if (st >= 0 && n > 0 && rcond < (double)(n > 10 ? n : 10) * DBL_EPSILON) st = singular(ctx, rho);
done:
  batten_free(ctx, tau);
  batten_free(ctx, stacked);
  return st;
}

/* r := Cholesky factor of D^-1 H D^-1 + rho. SINGULAR where what is left of a column is rounding, or by condition:
 * that of R is the root of H's, so beyond eps^-1/2 nothing of the smallest eigenvalues is known. */
static batten_status factor_hessian(batten_context *ctx, const qp_objective *o, double rho, double *r) {
  size_t n = o->n;
  double rcond = 0, *inverse = batten_alloc_array(ctx, n, sizeof *inverse);
  if (!inverse) return BATTEN_E_NOMEM;
  for (size_t j = 0; j < n; j++) inverse[j] = 1 / o->metric[j]; /* powers of two */
  memset(r, 0, n * n * sizeof *r);
  for (size_t i = 0; o->problem->h && i < n; i++) {
    qp_matrix_row row = qp_row_of(o->problem->h, i);
    double unit = 0.5 * inverse[i];
    for (size_t e = 0; e < row.count; e++) {
      size_t j = qp_row_column(&row, e), low = i < j ? i : j, high = i < j ? j : i;
      r[low + high * n] += row.values[e] * unit * inverse[j];
    }
    r[i + i * n] *= 2; /* was met once */
  }
  batten_free(ctx, inverse);
  for (size_t j = 0; j < n; j++) r[j + j * n] += rho;
  if (!batten_la_fits(n)) return batten_fail(ctx, BATTEN_E_TOO_LARGE, "n: %zu unknowns; use the interior engine", n);
  bool lost = batten_la_potrf(D, 'U', n, r, n) != 0;
  for (size_t j = 0; j < n && !lost; j++) {
    double whole = 0, left = r[j + j * n];
    for (size_t i = 0; i <= j; i++) whole += r[i + j * n] * r[i + j * n];
    lost = left * left <= 4 * (double)n * DBL_EPSILON * whole;
  }
  if (lost) return singular(ctx, rho);
  batten_status st = batten_la_trcon(ctx, n, r, n, &rcond);
  return st >= 0 && n > 0 && rcond < sqrt(DBL_EPSILON) ? singular(ctx, rho) : st;
}

/* Whether H is semidefinite: once. */
static batten_status check_hessian(batten_context *ctx, const qp_objective *o, size_t *index, double *ray) {
  if (o->state->convex) return BATTEN_OK;
  batten_status st = qp_hessian_convex(ctx, o->problem->h, index, ray);
  if (st >= 0) o->state->convex = true;
  return st;
}

/* From scaled to the caller's unknowns, diagonal > 0; base := c - R^-T g. */
static void finish_factor(const qp_objective *o, double *r, double *base) {
  size_t n = o->n;
  for (size_t i = 0; i < n; i++) {
    if (r[i + i * n] >= 0) continue;
    for (size_t j = i; j < n; j++) r[i + j * n] = -r[i + j * n];
    base[i] = -base[i];
  }
  for (size_t j = 0; j < n; j++) {
    for (size_t i = 0; i <= j; i++) r[i + j * n] *= o->metric[j];
    for (size_t i = j + 1; i < n; i++) r[i + j * n] = 0;
  }
}

batten_status qp_objective_factor(batten_context *ctx, const qp_objective *o, double rho, double *r, double *base,
                                  size_t *index, double *ray) {
  size_t n = o->n;
  batten_status st;
  double *shift = batten_alloc_array(ctx, n, sizeof *shift);
  if (!shift) return BATTEN_E_NOMEM;
  memset(base, 0, n * sizeof *base);
  if (o->k > 0) {
    st = check_hessian(ctx, o, index, ray);
    if (st >= 0) st = make_triangle(ctx, o);
    if (st >= 0) st = factor_squares(ctx, o, rho, r, base);
  } else {
    st = factor_hessian(ctx, o, rho, r);
    if (st == BATTEN_OK && rho <= 0) o->state->convex = true; /* the factor of H itself tells */
    if (st >= 0 || st == BATTEN_E_SINGULAR) {
      batten_status convex = check_hessian(ctx, o, index, ray);
      if (convex < 0) st = convex;
    }
  }
  if (st < 0) goto done;
  finish_factor(o, r, base);
  if (o->problem->g) {
    memcpy(shift, o->problem->g, n * sizeof *shift);
    batten_la_trsv(D, 'U', 'T', n, r, n, shift);
    for (size_t j = 0; j < n; j++) base[j] -= shift[j];
  }
done:
  batten_free(ctx, shift);
  return st;
}

void qp_objective_target(const qp_objective *o, double rho, const double *r, const double *base, const double *center,
                         double *target) {
  size_t n = o->n;
  for (size_t j = 0; j < n; j++) target[j] = rho * (o->metric[j] * (o->metric[j] * center[j]));
  batten_la_trsv(D, 'U', 'T', n, r, n, target);
  for (size_t j = 0; j < n; j++) target[j] += base[j];
}

batten_status qp_objective_convex(batten_context *ctx, const qp_objective *o, size_t *index, double *ray) {
  if (o->state->convex) return BATTEN_OK;
  batten_status st = qp_hessian_convex_sparse(ctx, o->problem->h, index, ray);
  if (st >= 0) o->state->convex = true;
  return st;
}
