/* Triangular patches as quadrangular ones, and their sides: by hand, and against evaluation by Bernstein's formula.
 */
#include "patch_square.h"

#include "tap.h"

static const batten_cad_form forms[3] = {BATTEN_CAD_TRIMMED, BATTEN_CAD_QUADS, BATTEN_CAD_DEGENERATE};
static const char *const form_names[3] = {"trimmed", "quads", "degenerate"};

static double binomial(unsigned n, unsigned k) {
  return round(exp(lgamma(n + 1.0) - lgamma(k + 1.0) - lgamma(n - k + 1.0)));
}

/* Sum of n! / (a! b! c!) x^a y^b z^c b_abc: nothing in common with de Casteljau's algorithm. */
static void patch_point(unsigned n, const double *net, const double x[3], double out[3]) {
  out[0] = out[1] = out[2] = 0;
  for (unsigned k = 0; k <= n; k++)
    for (unsigned j = 0; j + k <= n; j++) {
      double weight = binomial(n, k) * binomial(n - k, j) * pow(x[0], n - j - k) * pow(x[1], j) * pow(x[2], k);
      for (unsigned c = 0; c < 3; c++) out[c] += weight * net[3 * (k * (2 * n + 3 - k) / 2 + j) + c];
    }
}

static void square_point(unsigned n, const double *points, double s, double t, double out[3]) {
  out[0] = out[1] = out[2] = 0;
  for (unsigned i = 0; i <= n; i++)
    for (unsigned j = 0; j <= n; j++) {
      double weight = binomial(n, i) * pow(s, i) * pow(1 - s, n - i) * binomial(n, j) * pow(t, j) * pow(1 - t, n - j);
      for (unsigned c = 0; c < 3; c++) out[c] += weight * points[3 * (i * (n + 1) + j) + c];
    }
}

static void random_net(unsigned n, uint64_t *seed, double *net) {
  for (unsigned i = 0; i < 3 * (n + 1) * (n + 2) / 2; i++) net[i] = 2 * t_uniform(seed) - 1;
}

static void test_by_hand(bx_square_work *work) {
  const double flat[9] = {0, 0, 0, 2, 0, 0, 0, 3, 1};
  double out[3 * BX_SQUARE_MAX];
  bx_corners corners;
  bx_corners_of(BATTEN_CAD_TRIMMED, 0, corners);
  bx_patch_square(work, 1, flat, (const double(*)[3])corners, out);
  const double parallelogram[12] = {0, 0, 0, 0, 3, 1, 2, 0, 0, 2, 3, 1}; /* A, C, B, B + C - A */
  T_CHECK(!memcmp(out, parallelogram, sizeof parallelogram), "a triangle becomes its parallelogram");
  bx_corners_of(BATTEN_CAD_DEGENERATE, 0, corners);
  bx_patch_square(work, 1, flat, (const double(*)[3])corners, out);
  const double drawn[12] = {0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 3, 1}; /* A, A, B, C */
  T_CHECK(!memcmp(out, drawn, sizeof drawn), "or a square with one side drawn together");
  /* z = x y over the unit triangle: b_110 = b_101 = 0, b_011 = 1/2; as a square it is the bilinear x y. */
  const double product[18] = {0, 0, 0, 0.5, 0, 0, 1, 0, 0, 0, 0.5, 0, 0.5, 0.5, 0.5, 0, 1, 0};
  bx_corners_of(BATTEN_CAD_TRIMMED, 0, corners);
  bx_patch_square(work, 2, product, (const double(*)[3])corners, out);
  double off = 0;
  for (size_t i = 0; i < 3; i++)
    for (size_t j = 0; j < 3; j++) {
      const double *p = out + 3 * (3 * i + j), s = 0.5 * (double)i, t = 0.5 * (double)j;
      off = fmax(off, fmax(fabs(p[0] - s), fmax(fabs(p[1] - t), fabs(p[2] - s * t))));
    }
  T_RATIO(off, 0, "z = x y keeps its control points");
}

static void test_squares(bx_square_work *work) {
  uint64_t seed = 11;
  double net[3 * BX_NET_MAX], out[3 * BX_SQUARE_MAX];
  for (unsigned f = 0; f < 3; f++) {
    double worst = 0, off_corner = 0;
    for (unsigned n = 1; n <= BX_DEGREE_MAX; n++)
      for (unsigned q = 0; q < bx_squares_of(forms[f]); q++) {
        bx_corners c;
        random_net(n, &seed, net);
        bx_corners_of(forms[f], q, c);
        bx_patch_square(work, n, net, (const double(*)[3])c, out);
        for (int i = 0; i < 20; i++) {
          double s = t_uniform(&seed), t = t_uniform(&seed), x[3], p[3], e[3];
          if (f == 0 && s + t > 1) s = 1 - s, t = 1 - t; /* the half that is kept */
          for (int k = 0; k < 3; k++)
            x[k] = (1 - s) * (1 - t) * c[0][k] + s * (1 - t) * c[1][k] + (1 - s) * t * c[2][k] + s * t * c[3][k];
          patch_point(n, net, x, e);
          square_point(n, out, s, t, p);
          for (int k = 0; k < 3; k++) worst = fmax(worst, fabs(p[k] - e[k]));
        }
        for (int corner = 0; corner < (f == 0 ? 3 : 4); corner++) {
          double e[3];
          patch_point(n, net, c[corner], e);
          unsigned i = corner == 1 || corner == 3 ? n : 0, j = corner >= 2 ? n : 0;
          for (unsigned k = 0; k < 3; k++) off_corner = fmax(off_corner, fabs(out[3 * (i * (n + 1) + j) + k] - e[k]));
        }
      }
    T_RATIO(worst, 2e-13, "%s: degrees 1 .. 12 evaluate to the patch (seed 11)", form_names[f]);
    T_RATIO(off_corner, 1e-14, "%s: corners are the patch's", form_names[f]);
  }
}

/* The three squares of QUADS have the spokes in common, and the middles of the sides. */
static void test_spokes(bx_square_work *work) {
  enum { N = 7, WIDTH = N + 1 };
  uint64_t seed = 5;
  double net[3 * BX_NET_MAX], squares[3][WIDTH][WIDTH][3], worst = 0, side[N + 1][3], left[N + 1][3], right[N + 1][3];
  random_net(N, &seed, net);
  for (unsigned q = 0; q < 3; q++) {
    bx_corners c;
    bx_corners_of(BATTEN_CAD_QUADS, q, c);
    bx_patch_square(work, N, net, (const double(*)[3])c, &squares[q][0][0][0]);
  }
  for (unsigned q = 0; q < 3; q++) {
    bx_patch_side(N, net, q, side);
    bx_curve_halve(N, (const double(*)[3])side, left, right);
    for (unsigned i = 0; i <= N; i++)
      for (int k = 0; k < 3; k++) {
        worst = fmax(worst, fabs(squares[q][N][i][k] - squares[(q + 1) % 3][i][N][k])); /* the spoke of side q */
        worst = fmax(worst, fabs(squares[q][i][0][k] - left[i][k]));
        worst = fmax(worst, fabs(squares[(q + 1) % 3][0][N - i][k] - right[i][k]));
      }
  }
  T_RATIO(worst, 1e-14, "three squares share spokes and halves of the sides");
}

static void test_curves(void) {
  uint64_t seed = 21;
  double worst = 0, off = 0;
  bool degrees = true, ends = true;
  for (unsigned n = 1; n <= BX_DEGREE_MAX; n++)
    for (unsigned real = 1; real <= n; real++) {
      double p[BX_DEGREE_MAX + 1][3], raised[BX_DEGREE_MAX + 1][3], x[3], y[3];
      for (unsigned i = 0; i <= real; i++)
        for (int k = 0; k < 3; k++) p[i][k] = 2 * t_uniform(&seed) - 1;
      /* raised at once: q_j = sum over i of C(real, i) C(n - real, j - i) / C(n, j) p_i */
      for (unsigned j = 0; j <= n; j++)
        for (int k = 0; k < 3; k++) {
          raised[j][k] = 0;
          for (unsigned i = 0; i <= real && i <= j; i++)
            if (j - i <= n - real)
              raised[j][k] += binomial(real, i) * binomial(n - real, j - i) / binomial(n, j) * p[i][k];
        }
      double first = raised[0][0], last = raised[n][2];
      bx_curve_at(n, (const double(*)[3])raised, 0.3, y);
      unsigned degree = bx_curve_reduce(n, raised, 1e-14);
      degrees = degrees && degree == real;
      ends = ends && raised[0][0] == first && raised[degree][2] == last;
      for (unsigned i = 0; i <= real && degree == real; i++)
        for (int k = 0; k < 3; k++) worst = fmax(worst, fabs(raised[i][k] - p[i][k]));
      bx_curve_at(degree, (const double(*)[3])raised, 0.3, x);
      for (int k = 0; k < 3; k++) off = fmax(off, fabs(x[k] - y[k]));
      bx_curve_reverse(degree, raised);
      bx_curve_at(degree, (const double(*)[3])raised, 0.7, y);
      for (int k = 0; k < 3; k++) off = fmax(off, fabs(x[k] - y[k]));
    }
  T_CHECK(degrees, "raised curves are lowered to the degree that they have");
  T_CHECK(ends, "their ends stay to the bit");
  T_RATIO(worst, 2e-12, "control points come back (seed 21)");
  T_RATIO(off, 1e-13, "and they run as before, also backwards");
}

static void test_sides(bx_square_work *work) {
  enum { N = 6 };
  uint64_t seed = 9;
  double net[3 * BX_NET_MAX], side[N + 1][3], worst = 0;
  random_net(N, &seed, net);
  for (unsigned k = 0; k < 3; k++) {
    bx_patch_side(N, net, k, side);
    for (int i = 0; i <= 10; i++) {
      double t = i / 10.0, x[3] = {0}, p[3], e[3], at[3];
      x[k] = 1 - t;
      x[(k + 1) % 3] = t;
      patch_point(N, net, x, e);
      bx_curve_at(N, (const double(*)[3])side, t, p);
      bx_patch_at(work, N, net, x[1], x[2], at);
      for (int c = 0; c < 3; c++) worst = fmax(worst, fmax(fabs(p[c] - e[c]), fabs(at[c] - e[c])));
    }
  }
  T_RATIO(worst, 1e-14, "sides run from corner to corner on the patch");
}

int main(void) {
  bx_square_work *work = malloc(sizeof *work);
  test_by_hand(work);
  test_squares(work);
  test_spokes(work);
  test_curves();
  test_sides(work);
  free(work);
  return t_done();
}
