/* Gauss-Newton equations of the fair fill: made for each facet, freed of the unknowns that no other facet shares,
 * added up.
 *
 * The residuals are a last column beside the Jacobian: products of columns then hold the matrix, the gradient and the
 * energy at once, and elimination carries the right side along. Inner unknowns come first, to be eliminated first.
 * Damping adds to each diagonal entry a part of itself: units of the unknowns do not matter, nor the facet's size. */
#include <string.h>

#include "fair.h"

enum { LAST = FAIR_UNKNOWNS, WIDTH = FAIR_UNKNOWNS + 2 /* even */ };

/* Inner points may slide along the surface, which costs next to no energy but regularity, and feeds on the error of
 * the quadrature: so each is tied to where the thin plate has it by this part of what it costs to move off. */
static const double TIE = 1e-3;
/* The linear rows have no idea of parameters and slide further. */
static const double TIE_LINEAR = 0.1;
/* Where a facet leaves an unknown free altogether, in parts of its mean diagonal entry. */
static const double FLOOR = 1e-15;

/* ---- products of the columns ----------------------------------------------------------------------------- */

/* Columns of the corners: a row of derivatives by the net, times those of the net. */
static void outer_columns(const double (*row)[FAIR_NET], const double (*slopes)[FAIR_NET][FAIR_LANES], double *out) {
  double sum[FAIR_LANES] = {0};
  for (unsigned x = 0; x < 3; x++)
    for (unsigned p = 0; p < FAIR_NET; p++)
      for (unsigned l = 0; l < FAIR_LANES; l++) sum[l] += row[x][p] * slopes[x][p][l];
  for (unsigned l = 0; l < FAIR_OUTER; l++) out[l] = sum[l];
}

static void inner_columns(const double (*row)[FAIR_NET], const double (*axes)[3][3], double *out) {
  for (unsigned i = 0; i < 3; i++) {
    unsigned p = NET_DEGREE7_INTERIOR[i];
    for (unsigned a = 0; a < 3; a++)
      out[3 * i + a] = row[0][p] * axes[i][a][0] + row[1][p] * axes[i][a][1] + row[2][p] * axes[i][a][2];
  }
}

/* Adds the products of four rows; whole even-numbered pairs, so that the loop is the same for two rows of the matrix.
 */
static void add_products(const double (*v)[WIDTH], double (*products)[WIDTH]) {
  for (unsigned i = 0; i <= LAST; i++) {
    double a = v[0][i], b = v[1][i], c = v[2][i], d = v[3][i];
    for (unsigned j = i & ~1u; j < WIDTH; j++)
      products[i][j] += a * v[0][j] + b * v[1][j] + c * v[2][j] + d * v[3][j];
  }
}

void fair_equations_make(const fair_tables *tables, fair_model model, const double (*inner)[3], fair_scratch *scratch,
                         fair_equations *out) {
  double residual[FAIR_ROWS];
  memset(scratch->products, 0, sizeof scratch->products);
  memset(scratch->columns, 0, sizeof scratch->columns);
  for (unsigned g = 0; g < FAIR_POINTS; g++) {
    fair_residual(tables, (const double(*)[FAIR_NET])scratch->net, g, model, residual, scratch->rows, NULL);
    for (unsigned r = 0; r < FAIR_ROWS; r++) {
      const double(*row)[FAIR_NET] = (const double(*)[FAIR_NET])scratch->rows[r];
      inner_columns(row, (const double(*)[3][3])out->axes, scratch->columns[r]);
      outer_columns(row, (const double(*)[FAIR_NET][FAIR_LANES])scratch->slopes, scratch->columns[r] + FAIR_INNER);
      scratch->columns[r][LAST] = residual[r];
    }
    add_products((const double(*)[WIDTH])scratch->columns, scratch->products);
  }
  double *to = out->products;
  out->tie = model == FAIR_LINEAR ? TIE_LINEAR : TIE;
  for (unsigned i = 0; i <= LAST; i++)
    for (unsigned j = i; j <= LAST; j++) *to++ = scratch->products[i][j];
  for (unsigned i = 0; i < 3; i++)
    for (unsigned a = 0; a < 2; a++) out->slid[i][a] = vec_dot(inner[i], out->axes[i][1 + a]);
}

double fair_equations_ties(const fair_equations *equations, const double (*inner)[3]) {
  double sum = 0;
  for (unsigned i = 0; i < 3; i++) {
    unsigned row = 3 * i, diagonal = row * (2 * (LAST + 1) - row + 1) / 2;
    for (unsigned a = 0; a < 2; a++) {
      double along = vec_dot(inner[i], equations->axes[i][1 + a]);
      sum += equations->tie * equations->products[diagonal] * along * along;
    }
  }
  return sum;
}

/* ---- elimination ----------------------------------------------------------------------------------------- */

static void damp(const fair_equations *equations, double (*a)[WIDTH], double damping,
                 const double corner_damping[3]) {
  double mean = 0;
  for (unsigned i = 0; i < FAIR_UNKNOWNS; i++) mean += a[i][i] / FAIR_UNKNOWNS;
  for (unsigned i = 0; i < 3; i++)
    for (unsigned k = 0; k < 2; k++) {
      unsigned row = 3 * i + 1 + k;
      double tie = equations->tie * a[3 * i][3 * i];
      a[row][row] += tie;
      a[row][LAST] += tie * equations->slid[i][k];
    }
  for (unsigned i = 0; i < FAIR_UNKNOWNS; i++)
    a[i][i] += (i < FAIR_INNER ? damping : corner_damping[(i - FAIR_INNER) / 5]) * a[i][i] + FLOOR * mean;
}

/* Unpacks, damps and eliminates the inner unknowns: their rows are then those of U in D^-1 times it, and the other
 * rows a system for the corners. */
static void eliminate(const fair_equations *equations, double damping, const double corner_damping[3],
                      double (*a)[WIDTH]) {
  const double *from = equations->products;
  for (unsigned i = 0; i <= LAST; i++)
    for (unsigned j = i; j <= LAST; j++) a[i][j] = *from++;
  damp(equations, a, damping, corner_damping);
  for (unsigned k = 0; k < FAIR_INNER; k++) {
    if (!(a[k][k] > 0)) a[k][k] = 1; /* a facet without any equation */
    for (unsigned i = k + 1; i <= LAST; i++) {
      double factor = a[k][i] / a[k][k];
      for (unsigned j = i; j <= LAST; j++) a[i][j] -= factor * a[k][j];
    }
  }
}

void fair_equations_reduce(const fair_equations *equations, double damping, const double corner_damping[3],
                           fair_scratch *scratch, double *reduced) {
  double(*a)[WIDTH] = scratch->products;
  eliminate(equations, damping, corner_damping, a);
  for (unsigned i = FAIR_INNER; i < LAST; i++)
    for (unsigned j = i; j < LAST; j++) *reduced++ = a[i][j];
  for (unsigned i = FAIR_INNER; i < LAST; i++) *reduced++ = -a[i][LAST];
}

void fair_equations_inner(const fair_equations *equations, double damping, const double *corner_step,
                          fair_scratch *scratch, double (*step)[3]) {
  static const double none[3] = {0};
  double(*a)[WIDTH] = scratch->products, y[FAIR_INNER];
  eliminate(equations, damping, none, a);
  for (unsigned k = FAIR_INNER; k-- > 0;) {
    double sum = -a[k][LAST];
    for (unsigned j = k + 1; j < FAIR_INNER; j++) sum -= a[k][j] * y[j];
    for (unsigned j = 0; j < FAIR_OUTER; j++) sum -= a[k][FAIR_INNER + j] * corner_step[j];
    y[k] = sum / a[k][k];
  }
  for (unsigned i = 0; i < 3; i++)
    for (unsigned x = 0; x < 3; x++) {
      step[i][x] = 0;
      for (unsigned b = 0; b < 3; b++) step[i][x] += y[3 * i + b] * equations->axes[i][b][x];
    }
}

/* ---- the system of all nodes ------------------------------------------------------------------------------ */

/* out [5][5] += P' S Q with P, Q the columns that two nodes are free in. */
static void add_block(const fair_freedom *p, const fair_freedom *q, const double (*s)[5], double *out) {
  double half[5][5];
  for (unsigned i = 0; i < 5; i++)
    for (unsigned j = 0; j < q->dof; j++) {
      half[i][j] = 0;
      for (unsigned k = 0; k < 5; k++) half[i][j] += s[i][k] * q->columns[k][j];
    }
  for (unsigned i = 0; i < p->dof; i++)
    for (unsigned j = 0; j < q->dof; j++)
      for (unsigned k = 0; k < 5; k++) out[5 * i + j] += p->columns[k][i] * half[k][j];
}

static void add_face(const uint32_t node[3], const fair_freedom *freedom, const double *reduced, block_matrix *matrix,
                     double *right) {
  double full[FAIR_OUTER][FAIR_OUTER], s[5][5];
  for (unsigned i = 0; i < FAIR_OUTER; i++)
    for (unsigned j = i; j < FAIR_OUTER; j++) full[i][j] = full[j][i] = *reduced++;
  for (unsigned a = 0; a < 3; a++) {
    const fair_freedom *p = &freedom[node[a]];
    for (unsigned i = 0; i < p->dof; i++)
      for (unsigned k = 0; k < 5; k++) right[5 * (size_t)node[a] + i] += p->columns[k][i] * reduced[5 * a + k];
    for (unsigned b = 0; b < 3; b++) {
      for (unsigned i = 0; i < 5; i++)
        for (unsigned j = 0; j < 5; j++) s[i][j] = full[5 * a + i][5 * b + j];
      add_block(p, &freedom[node[b]], (const double(*)[5])s, block_matrix_at(matrix, node[a], node[b]));
    }
  }
}

void fair_assemble(const net_topology *t, const fair_freedom *freedom, const double *reduced, block_matrix *matrix,
                   double *right) {
  memset(matrix->values, 0, matrix->starts[matrix->rows] * 25 * sizeof *matrix->values);
  memset(right, 0, 5 * t->nodes * sizeof *right);
  for (size_t f = 0; f < t->faces; f++) add_face(t->node + 3 * f, freedom, reduced + FAIR_REDUCED * f, matrix, right);
  for (size_t i = 0; i < t->nodes; i++) {
    double *diagonal = block_matrix_at(matrix, i, i);
    for (unsigned k = 0; k < 5; k++)
      if (k >= freedom[i].dof || !(diagonal[6 * k] > 0)) diagonal[6 * k] = 1; /* not free, or in no equation */
  }
}
