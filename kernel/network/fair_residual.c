/* The covariant derivative of the second fundamental form over a patch of degree 7: what the fair fill makes small.
 *
 * grad II vanishes exactly on planes, spheres and cylinders. Its integral over the surface, of |grad II|^2, scales by
 * 1/L^2 and knows nothing of parameters: it is the energy to which second derivatives alone cannot come, whose
 * extremals under a frozen metric are polyharmonic, hence no spheres.
 *
 * With parameter derivatives S_i, S_ij, S_ijk, the dual basis S^l (S^l . S_i = 1 if l = i, else 0), unit normal n,
 * Christoffel symbols G^l_ij = S^l . S_ij and L_ij = n . S_ij,
 *   r_ijk = n . S_ijk - G^l_ij L_lk - G^l_jk L_li - G^l_ki L_lj,
 * symmetric in all indices [Codazzi]. In an orthonormal frame of the tangent plane e_a = A_a^i S_i, e_1 along S_1,
 *   R_abc = A_a^i A_b^j A_c^k r_ijk, |grad II|^2 = R_111^2 + 3 R_112^2 + 3 R_122^2 + R_222^2.
 * With A and the area held still, from dn = -S^m (n . dS_m) and dS^l = -S^q (S^l . dS_q) + n g^lm (n . dS_m) follows
 *   d r_ijk = n . dS_ijk - (S^m . S_ijk) (n . dS_m) - sum of three [ G^l_ij dL_lk + L_lk dG^l_ij ],
 *   dL_ij = n . dS_ij - G^q_ij n . dS_q,  dG^l_ij = L_ij g^lm n . dS_m + S^l . dS_ij - G^q_ij S^l . dS_q.
 * So it has three parts, along n, S^1 and S^2, each a combination of the fields dS_*, hence of the control points. */
#include <math.h>
#include <string.h>

#include "basis/triangular.h"
#include "fair.h"

/* Indices 0, 1 of i, j, k name fields by their sum. */
enum { FIRST = 0, SECOND = 2, THIRD = 5, LOWER = 5 /* fields of order 1 and 2 */ };

/* ---- constants ---------------------------------------------------------------------------------------- */

/* 16 places with the symmetry of the triangle, exact to degree 8 [Dunavant 1985]: what a facet gets does not depend
 * on the corner with which it begins. An orbit: weight, and the three barycentric coordinates. */
static const double orbits[5][4] = {{0.144315607677787, 1. / 3, 1. / 3, 1. / 3},
                                    {0.095091634267285, 0.081414823414554, 0.459292588292723, 0.459292588292723},
                                    {0.103217370534718, 0.658861384496480, 0.170569307751760, 0.170569307751760},
                                    {0.032458497623198, 0.898905543365938, 0.050547228317031, 0.050547228317031},
                                    {0.027230314174435, 0.008394777409958, 0.263112829634638, 0.728492392955404}};

static void quadrature(double (*place)[2], double *weight) {
  static const unsigned char turns[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  unsigned count = 0;
  for (unsigned o = 0; o < 5; o++) {
    unsigned size = o == 0 ? 1 : o < 4 ? 3 : 6;
    for (unsigned k = 0; k < size; k++, count++) {
      place[count][0] = orbits[o][1 + turns[k][0]];
      place[count][1] = orbits[o][1 + turns[k][1]];
      weight[count] = 0.5 * orbits[o][0];
    }
  }
}

void fair_tables_make(fair_tables *out) {
  double place[FAIR_POINTS][2], jet[TRIANGULAR_JET][FAIR_NET];
  memset(out, 0, sizeof *out);
  quadrature(place, out->weight);
  for (unsigned g = 0; g < FAIR_POINTS; g++) {
    triangular_basis(7, place[g][0], place[g][1], 3, jet[0]);
    memcpy(out->jets[g], jet[1], sizeof out->jets[g]);
    for (unsigned p = 0; p < FAIR_NET; p++)
      for (unsigned f = 0; f < FAIR_FIELDS; f++) out->nets[g][p][f] = jet[1 + f][p];
  }
  for (unsigned i = 0; i < 3; i++) { /* normals over the inner points are asked for at their own places */
    triangular_basis(7, i == 1 ? 3. / 7 : 2. / 7, i == 2 ? 3. / 7 : 2. / 7, 1, jet[0]);
    memcpy(out->inner[i], jet[1], sizeof out->inner[i]);
  }
}

/* ---- the surface at a point ---------------------------------------------------------------------------- */

typedef struct fair_form {
  double normal[3], dual[2][3];     /* n, S^l */
  double metric[2][2];              /* g^lm */
  double connection[2][3], form[3]; /* G^l_ij, L_ij by i + j */
  double r[4];                      /* r_ijk by i + j + k */
  double third[2][4];               /* S^m . S_ijk */
  double frame[4][4];               /* residuals from r: A three times, with the factors 1, 3, 3, 1 under a root */
  double tangent[2][2], cotangent[2][2]; /* A_a^i; e_a . S_l */
  double area;                           /* |S_1 x S_2| */
} fair_form;

static double dot3(const double (*s)[3], unsigned field, const double v[3]) { return vec_dot(s[field], v); }

static bool make_form(const double (*s)[3], fair_form *out) {
  double e = vec_dot(s[0], s[0]), f = vec_dot(s[0], s[1]), g = vec_dot(s[1], s[1]), cross[3];
  vec_cross(s[0], s[1], cross);
  double area = vec_norm(cross), squared = area * area;
  out->area = area;
  if (!(squared > 0) || !isfinite(squared)) return false;
  out->metric[0][0] = g / squared;
  out->metric[0][1] = out->metric[1][0] = -f / squared;
  out->metric[1][1] = e / squared;
  for (unsigned c = 0; c < 3; c++) {
    out->normal[c] = cross[c] / area;
    for (unsigned l = 0; l < 2; l++) out->dual[l][c] = out->metric[l][0] * s[0][c] + out->metric[l][1] * s[1][c];
  }
  for (unsigned ij = 0; ij < 3; ij++) {
    out->form[ij] = dot3(s, SECOND + ij, out->normal);
    for (unsigned l = 0; l < 2; l++) out->connection[l][ij] = dot3(s, SECOND + ij, out->dual[l]);
  }
  for (unsigned ijk = 0; ijk < 4; ijk++)
    for (unsigned m = 0; m < 2; m++) out->third[m][ijk] = dot3(s, THIRD + ijk, out->dual[m]);
  for (unsigned ijk = 0; ijk < 4; ijk++) {
    unsigned index[3] = {ijk > 2, ijk > 1, ijk > 0};
    out->r[ijk] = dot3(s, THIRD + ijk, out->normal);
    for (unsigned c = 0; c < 3; c++) {
      unsigned last = index[c], pair = ijk - last;
      for (unsigned l = 0; l < 2; l++) out->r[ijk] -= out->connection[l][pair] * out->form[l + last];
    }
  }
  double mu = area / sqrt(e), a = 1 / sqrt(e), b = -f / (e * mu), d = 1 / mu, root = sqrt(3);
  out->tangent[0][0] = a;
  out->tangent[0][1] = 0;
  out->tangent[1][0] = b;
  out->tangent[1][1] = d;
  for (unsigned k = 0; k < 2; k++) {
    out->cotangent[k][0] = out->tangent[k][0] * e + out->tangent[k][1] * f;
    out->cotangent[k][1] = out->tangent[k][0] * f + out->tangent[k][1] * g;
  }
  const double frame[4][4] = {{a * a * a},
                              {root * a * a * b, root * a * a * d},
                              {root * a * b * b, root * 2 * a * b * d, root * a * d * d},
                              {b * b * b, 3 * b * b * d, 3 * b * d * d, d * d * d}};
  memcpy(out->frame, frame, sizeof frame);
  return true;
}

/* Factors of the fields in d r_ijk: parts [0] along n, [1 + l] along S^l. */
static void make_factors(const fair_form *p, unsigned ijk, fair_model model, double (*part)[FAIR_FIELDS]) {
  unsigned index[3] = {ijk > 2, ijk > 1, ijk > 0};
  memset(part, 0, 3 * sizeof *part);
  part[0][THIRD + ijk] = 1;
  if (model != FAIR_LINEAR)
    for (unsigned m = 0; m < 2; m++) part[0][FIRST + m] -= p->third[m][ijk];
  for (unsigned c = 0; c < 3; c++) {
    unsigned last = index[c], pair = ijk - last;
    for (unsigned l = 0; l < 2; l++) {
      double gamma = p->connection[l][pair], form = p->form[l + last];
      part[0][SECOND + l + last] -= gamma;
      if (model == FAIR_LINEAR) continue;
      part[1 + l][SECOND + pair] -= form;
      for (unsigned q = 0; q < 2; q++) {
        part[0][FIRST + q] += gamma * p->connection[q][l + last] - form * p->form[pair] * p->metric[l][q];
        part[1 + l][FIRST + q] += form * p->connection[q][pair];
      }
    }
  }
}

/* What the metric's change adds to row `a`, which has the index 2 a times, as factors of dS_i along S^l. With
 * h_ab = (e_a . d e_b + e_b . d e_a) / 2, d e_a = A_a^i dS_i, the frame that stays orthonormal and does not spin
 * takes h_ad R_dbc from R_abc for each of its indices, and the root of the area adds (h_11 + h_22) R_abc / 2. */
static void add_metric(const fair_form *p, unsigned a, const double *residual, double (*part)[FAIR_FIELDS]) {
  static const double count[4] = {1, 1.7320508075688772, 1.7320508075688772, 1}; /* roots of 1, 3, 3, 1 */
  double twos = a, ones = 3 - twos, h[2][2];
  h[0][0] = (0.5 - ones) * residual[a];
  h[1][1] = (0.5 - twos) * residual[a];
  h[0][1] = 0;
  if (a < 3) h[0][1] -= ones * count[a] / count[a + 1] * residual[a + 1];
  if (a > 0) h[0][1] -= twos * count[a] / count[a - 1] * residual[a - 1];
  h[0][1] = h[1][0] = 0.5 * h[0][1];
  for (unsigned b = 0; b < 2; b++)
    for (unsigned c = 0; c < 2; c++)
      for (unsigned i = 0; i < 2; i++)
        for (unsigned l = 0; l < 2; l++)
          part[1 + l][FIRST + i] +=
              0.5 * h[b][c] * (p->tangent[b][i] * p->cotangent[c][l] + p->tangent[c][i] * p->cotangent[b][l]);
}

/* Combination of the basis functions' fields. */
static void combine(const double (*jets)[FAIR_NET], unsigned fields, const double *factor, double *out) {
  for (unsigned p = 0; p < FAIR_NET; p++) out[p] = factor[0] * jets[0][p];
  for (unsigned f = 1; f < fields; f++)
    for (unsigned p = 0; p < FAIR_NET; p++) out[p] += factor[f] * jets[f][p];
}

static void make_row(const fair_form *form, const double (*jets)[FAIR_NET], const double (*factor)[FAIR_FIELDS],
                     fair_model model, fair_net row) {
  fair_net along;
  combine(jets, FAIR_FIELDS, factor[0], along[0]);
  if (model == FAIR_LINEAR) {
    for (unsigned c = 0; c < 3; c++)
      for (unsigned p = 0; p < FAIR_NET; p++) row[c][p] = form->normal[c] * along[0][p];
    return;
  }
  combine(jets, LOWER, factor[1], along[1]);
  combine(jets, LOWER, factor[2], along[2]);
  for (unsigned c = 0; c < 3; c++) {
    double n = form->normal[c], a = form->dual[0][c], b = form->dual[1][c];
    for (unsigned p = 0; p < FAIR_NET; p++) row[c][p] = n * along[0][p] + a * along[1][p] + b * along[2][p];
  }
}

static void make_fields(const fair_tables *tables, const fair_net net, unsigned g, double (*s)[3]) {
  double sum[3][FAIR_FIELDS + 1] = {{0}};
  for (unsigned p = 0; p < FAIR_NET; p++)
    for (unsigned c = 0; c < 3; c++)
      for (unsigned f = 0; f < FAIR_FIELDS + 1; f++) sum[c][f] += net[c][p] * tables->nets[g][p][f];
  for (unsigned f = 0; f < FAIR_FIELDS; f++)
    for (unsigned c = 0; c < 3; c++) s[f][c] = sum[c][f];
}

void fair_residual(const fair_tables *tables, const fair_net net, unsigned g, fair_model model,
                   double residual[FAIR_ROWS], fair_net *rows, double normal[3]) {
  double s[FAIR_FIELDS][3];
  fair_form form;
  make_fields(tables, net, g, s);
  bool regular = make_form((const double(*)[3])s, &form);
  if (normal) vec_cross(s[0], s[1], normal);
  memset(residual, 0, FAIR_ROWS * sizeof *residual);
  if (rows) memset(rows, 0, FAIR_ROWS * sizeof *rows);
  if (!regular) return;
  double root = sqrt(form.area * tables->weight[g]), factor[4][3][FAIR_FIELDS];
  for (unsigned ijk = 0; rows && ijk < 4; ijk++) make_factors(&form, ijk, model, factor[ijk]);
  for (unsigned a = 0; a < FAIR_ROWS; a++)
    for (unsigned ijk = 0; ijk <= a; ijk++) residual[a] += root * form.frame[a][ijk] * form.r[ijk];
  for (unsigned a = 0; rows && a < FAIR_ROWS; a++) {
    double turned[3][FAIR_FIELDS] = {{0}};
    for (unsigned ijk = 0; ijk <= a; ijk++) {
      double t = root * form.frame[a][ijk];
      for (unsigned k = 0; k < 3; k++)
        for (unsigned f = 0; f < FAIR_FIELDS; f++) turned[k][f] += t * factor[ijk][k][f];
    }
    if (model == FAIR_FULL) add_metric(&form, a, residual, turned);
    make_row(&form, tables->jets[g], (const double(*)[FAIR_FIELDS])turned, model, rows[a]);
  }
}

double fair_patch_energy(const double (*patch)[3]) {
  double place[FAIR_POINTS][2], weight[FAIR_POINTS], jet[TRIANGULAR_JET][3], sum = 0;
  quadrature(place, weight);
  for (unsigned g = 0; g < FAIR_POINTS; g++) {
    fair_form form;
    triangular_jet(7, patch, place[g][0], place[g][1], 3, jet);
    if (!make_form((const double(*)[3])jet + 1, &form)) continue;
    for (unsigned a = 0; a < FAIR_ROWS; a++) {
      double r = 0;
      for (unsigned ijk = 0; ijk <= a; ijk++) r += form.frame[a][ijk] * form.r[ijk];
      sum += weight[g] * form.area * r * r;
    }
  }
  return sum;
}
