/* Three patches of degree 6 a facet.   [Kolb, Pottmann, Seidel 1995, section 6; Shirman, Sequin 1987]
 *
 * The facet is split at an inner point Z. Along an edge with curve C and field d the derivative towards Z is
 * k d + h C' with k and h linear: degree 5, the row of a patch of degree 6. The curves inside, from corner A to Z,
 * are quintics A I1 I2 I3 I4 Z; across them neighbours join by r + r' - 2 I = mu I' / 5 [Farin 1982], where r, r' are
 * the rows beside the curve, of degree 5 as the curve itself, and mu is linear: 5/2 at A, so that I1 is the mean of A
 * and its neighbours on the two edges, and 5/6 at Z, which is the mean of the three I4. Coefficient by coefficient:
 *   r_m + r'_m = 2 I_m + ((5 - m) mu_0 (I_m+1 - I_m) + m mu_1 (I_m - I_m-1)) / 5,   m = 1 .. 4.
 * m = 1: both r_1 belong to rows of the edges: gives I2. m = 2, 3: the means of the points beside the curve; their
 * differences, the skews, are free. m = 4: three equations for the three points next to Z. Free then: I3, I4 and the
 * two skews at each corner, the middle g2 of the third row beside each edge. They take the least integral of
 * S_xx^2 + 2 S_xy^2 + S_yy^2 over an equilateral parameter triangle: a linear map of what is known, the same for all
 * facets. */
#include <stdbool.h>

#include "basis/bezier.h"
#include "network/fill.h"

enum { KNOWN = 33, FREE = 5 };

static const double MU_0 = 5. / 2, MU_1 = 5. / 6;

/* The minimum. Columns: the edges' points of degree 6, six an edge, edge 0 first; points 1 to 4 of the rows beside
 * the edges; I1 at the corners. Rows for corner and edge 0, the skew being half of leaving less arriving edge. For
 * the other corners all indices turn. Solved once in rational numbers (common denominator 100831551408). */
/* clang-format off */
static const double minimum[FREE][KNOWN] = {
    {-0.08554101564002785, -0.17262978277074256, -0.1955495467506573, -0.15252154780175115, -0.05818231406815924,
     -0.004466760192725409, 0.007315749263989545, 0.017696636728118685, 0.028696699074794028,
     0.037813841032475565, 0.028696699074794028, 0.017696636728118685, 0.007315749263989545,
     -0.004466760192725409, -0.05818231406815924, -0.15252154780175115, -0.1955495467506573, -0.17262978277074256,
     0.2713924978628154, 0.47522379162955347, 0.17343408768192897, 0.02553506155609661, -0.016336842119333943,
     -0.057940579733423356, -0.057940579733423356, -0.016336842119333943, 0.02553506155609661,
     0.17343408768192897, 0.47522379162955347, 0.2713924978628154, 0.43058624826985764, -0.033096687191656426,
     -0.033096687191656426}, /* I3 */
    {-0.05306706392276598, -0.11913213148327045, -0.18392494251088753, -0.19730120703490028, -0.14606419330399678,
     -0.072330308778938, -0.021950606185202413, -0.03646379821255324, -0.0680418065198555, -0.08500377439714737,
     -0.0680418065198555, -0.03646379821255324, -0.021950606185202413, -0.072330308778938, -0.14606419330399678,
     -0.19730120703490028, -0.18392494251088753, -0.11913213148327045, 0.2298487857458594, 0.393487390226271,
     0.3088832036112948, 0.16744455032416017, 0.05629316182027578, 0.10634951868001512, 0.10634951868001512,
     0.05629316182027578, 0.16744455032416017, 0.3088832036112948, 0.393487390226271, 0.2298487857458594,
     0.2001298638592499, 0.051872870852059674, 0.051872870852059674}, /* I4 */
    {0, 0.07255088067026998, 0.07332486661921381, 0.0019922078475930536, 0.016996932825770493,
     0.013909408358946709, 0.0013370021299633002, -0.016974805644656595, -0.014661267126776647, 0,
     0.014661267126776647, 0.016974805644656595, -0.0013370021299633002, -0.013909408358946709,
     -0.016996932825770493, -0.0019922078475930536, -0.07332486661921381, -0.07255088067026998,
     -0.04911265349832849, 0.1610153930718146, -0.0008033478298100768, -0.04478714921014002, 0.04599217095485514,
     0.004847925765041999, -0.004847925765041999, -0.04599217095485514, 0.04478714921014002,
     0.0008033478298100768, -0.1610153930718146, 0.04911265349832849, 0, -0.001603374467043785,
     0.001603374467043785}, /* skew of row 2 */
    {0, -0.030886273001973368, -0.0494799026528135, -0.041530504822399825, -0.030644495823505143,
     -0.008366401411265689, 0.0046319824348447355, 0.022519871590707678, 0.018835406829308357, 0,
     -0.018835406829308357, -0.022519871590707678, -0.0046319824348447355, 0.008366401411265689,
     0.030644495823505143, 0.041530504822399825, 0.0494799026528135, 0.030886273001973368, 0.14484796863733682,
     0.17693088636325943, 0.10433396028423429, 0.04972906966104825, -0.03956334342073302, -0.01704137052346959,
     0.01704137052346959, 0.03956334342073302, -0.04972906966104825, -0.10433396028423429, -0.17693088636325943,
     -0.14484796863733682, 0, -0.023248148245927067, 0.023248148245927067}, /* skew of row 3 */
    {-0.026126465904907106, -0.14972085789807885, -0.27708312949535097, -0.26439890192827886,
     -0.27708312949535097, -0.14972085789807885, -0.026126465904907106, 0.09286209406926871, 0.07130887175290976,
     -0.02040251809352583, -0.04246765505643364, -0.03796073921854101, -0.01801195332848865, -0.03796073921854101,
     -0.04246765505643364, -0.02040251809352583, 0.07130887175290976, 0.09286209406926871, 0.39766190998841167,
     0.7240988469627693, 0.7240988469627693, 0.39766190998841167, -0.3097820629736115, 0.02301870205892568,
     0.050350805408684744, 0.04925095467296353, 0.04925095467296353, 0.050350805408684744, 0.02301870205892568,
     -0.3097820629736115, 0.06735335266755772, 0.06735335266755772, 0.05768663737468297}, /* g2 */
};
/* clang-format on */

typedef struct facet {
  double edge[3][7][3];  /* of degree 6 */
  double row[3][6][3];   /* beside it */
  double inner[3][6][3]; /* A I1 I2 I3 I4 Z */
  double skew[2][3][3];  /* by row, corner */
  double middle[3][3];   /* g2 */
} facet;

/* (r_m + r'_m) / 2 beside the inner curve I. */
static void beside(const double (*inner)[3], unsigned m, double *out) {
  double next = (5 - m) * MU_0 / 10, last = m * MU_1 / 10;
  for (int x = 0; x < 3; x++)
    out[x] = inner[m][x] + next * (inner[m + 1][x] - inner[m][x]) + last * (inner[m][x] - inner[m - 1][x]);
}

/* I1 at the corner of node i. */
static void first_inner(const net_ribbon *leave, const net_ribbon *arrive, double *out) {
  for (int x = 0; x < 3; x++)
    out[x] = leave->c[0][x] + ((leave->c[1][x] - leave->c[0][x]) + (arrive->c[4][x] - arrive->c[5][x])) / 3;
}

/* k or h at a corner: f = k d + h c in the plane of d and c, least squares. */
static void components(const double *f, const double *d, const double *c, double *k, double *h) {
  double dd = vec_dot(d, d), dc = vec_dot(d, c), cc = vec_dot(c, c), fd = vec_dot(f, d), fc = vec_dot(f, c);
  double area = dd * cc - dc * dc;
  *k = (fd * cc - fc * dc) / area;
  *h = (fc * dd - fd * dc) / area;
}

/* The row beside an edge; its ends are settled by the inner curves. */
static void row_make(const net_ribbon *ribbon, const double *first_i, const double *first_j, double (*row)[3],
                     double k[2]) {
  double rate[5][3], f[2][3], h[2], slide[6][3], turn[5][3], turns[6][3];
  bezier_difference(5, 3, ribbon->c[0], rate[0]);
  for (int x = 0; x < 3; x++) {
    f[0][x] = 5. / 6 * (first_i[x] - ribbon->c[0][x]);
    f[1][x] = 5. / 6 * (first_j[x] - ribbon->c[5][x]);
  }
  components(f[0], ribbon->d[0], rate[0], &k[0], &h[0]);
  components(f[1], ribbon->d[3], rate[4], &k[1], &h[1]);
  bezier_multiply(1, k, 3, 3, ribbon->d[0], turn[0]);
  bezier_elevate(4, 3, turn[0], turns[0]);
  bezier_multiply(1, h, 4, 3, rate[0], slide[0]);
  for (unsigned m = 0; m < 6; m++)
    for (int x = 0; x < 3; x++) row[m][x] = ribbon->c[m][x] + turns[m][x] + slide[m][x];
}

static void minimise(facet *s) {
  const double *known[KNOWN];
  for (unsigned k = 0; k < 3; k++) {
    for (unsigned m = 0; m < 6; m++) known[6 * k + m] = s->edge[k][m];
    for (unsigned m = 0; m < 4; m++) known[18 + 4 * k + m] = s->row[k][m + 1];
    known[30 + k] = s->inner[k][1];
  }
  for (unsigned i = 0; i < 3; i++) {
    double *to[FREE] = {s->inner[i][3], s->inner[i][4], s->skew[0][i], s->skew[1][i], s->middle[i]};
    for (unsigned o = 0; o < FREE; o++) {
      double sum[3] = {0, 0, 0};
      for (unsigned n = 0; n < KNOWN; n++) {
        unsigned turned = n < 18 ? (n + 6 * i) % 18 : n < 30 ? 18 + (n - 18 + 4 * i) % 12 : 30 + (n - 30 + i) % 3;
        for (int x = 0; x < 3; x++) sum[x] += minimum[o][n] * known[turned][x];
      }
      for (int x = 0; x < 3; x++) to[o][x] = sum[x];
    }
  }
  for (int x = 0; x < 3; x++) {
    double z = (s->inner[0][4][x] + s->inner[1][4][x] + s->inner[2][4][x]) / 3;
    for (unsigned i = 0; i < 3; i++) s->inner[i][5][x] = z;
  }
}

/* The patch between corners k and k + 1 and Z. */
static void part_write(const facet *s, unsigned k, double (*out)[3]) {
  unsigned l = (k + 1) % 3;
  double from[7][3], to[7][3], means[5][3][3]; /* of rows 2, 3, 4 at corners */
  bezier_elevate(5, 3, s->inner[k][0], from[0]);
  bezier_elevate(5, 3, s->inner[l][0], to[0]);
  for (unsigned i = 0; i < 3; i++)
    for (unsigned m = 2; m < 5; m++) beside(s->inner[i], m, means[m][i]);
  double(*row[7])[3] = {out, out + 7, out + 13, out + 18, out + 22, out + 25, out + 27};
  for (int x = 0; x < 3; x++) {
    for (unsigned m = 0; m < 7; m++) row[0][m][x] = s->edge[k][m][x];
    for (unsigned m = 1; m < 5; m++) row[1][m][x] = s->row[k][m][x];
    for (unsigned m = 1; m < 6; m++) {
      row[m][0][x] = from[m][x];
      row[m][6 - m][x] = to[m][x];
    }
    row[2][1][x] = means[2][k][x] + s->skew[0][k][x];
    row[2][2][x] = s->middle[k][x];
    row[2][3][x] = means[2][l][x] - s->skew[0][l][x];
    row[3][1][x] = means[3][k][x] + s->skew[1][k][x];
    row[3][2][x] = means[3][l][x] - s->skew[1][l][x];
    row[4][1][x] = means[4][k][x] + means[4][l][x] - means[4][(k + 2) % 3][x];
    row[6][0][x] = from[6][x];
  }
}

bool net_fill_degree6(const net_node *nodes, const net_ribbon *ribbons, double (*out)[28][3]) {
  facet s;
  bool regular = true;
  (void)nodes; /* the ribbons say it all */
  for (unsigned i = 0; i < 3; i++) {
    for (int x = 0; x < 3; x++) s.inner[i][0][x] = ribbons[i].c[0][x];
    first_inner(&ribbons[i], &ribbons[(i + 2) % 3], s.inner[i][1]);
    bezier_elevate(5, 3, ribbons[i].c[0], s.edge[i][0]);
  }
  for (unsigned i = 0; i < 3; i++) {
    double k[2];
    row_make(&ribbons[i], s.inner[i][1], s.inner[(i + 1) % 3][1], s.row[i], k);
    regular = regular && net_across_regular(1, k, &ribbons[i]);
  }
  for (unsigned i = 0; i < 3; i++) {
    const double *arrive = s.row[(i + 2) % 3][4];
    double next = 4 * MU_0 / 5, last = MU_1 / 5;
    for (int x = 0; x < 3; x++) {
      double first = s.inner[i][1][x], rows = s.row[i][1][x] + arrive[x];
      s.inner[i][2][x] = first + (rows - 2 * first - last * (first - s.inner[i][0][x])) / next;
    }
  }
  minimise(&s);
  for (unsigned k = 0; k < 3; k++) part_write(&s, k, out[k]);
  return regular;
}
