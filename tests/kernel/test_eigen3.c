/* Jacobi eigenvalues of symmetric matrices up to 3 x 3. */
#include "basis/eigen3.h"
#include "tap.h"

#include <float.h>

static void test_by_hand(void) {
  double value, vector;
  batten_eigen_symmetric(1, (double[]){-3}, &value, &vector);
  T_CHECK(value == -3 && vector == 1, "1 x 1");
  double values[3], vectors[9];
  batten_eigen_symmetric(2, (double[]){2, 1, 1, 2}, values, vectors);
  T_RATIO(fabs(values[0] - 1) + fabs(values[1] - 3), 4 * DBL_EPSILON, "[2 1; 1 2] has 1 and 3");
  T_RATIO(fabs(vectors[0] + vectors[1]) + fabs(vectors[2] - vectors[3]), 4 * DBL_EPSILON, "along the diagonals");
  batten_eigen_symmetric(3, (double[]){2, -1, 0, -1, 2, -1, 0, -1, 2}, values, NULL);
  T_RATIO(fabs(values[0] - (2 - sqrt(2))) + fabs(values[1] - 2) + fabs(values[2] - (2 + sqrt(2))), 8 * DBL_EPSILON,
          "second difference: 2 - sqrt 2, 2, 2 + sqrt 2");
  batten_eigen_symmetric(3, (double[9]){0}, values, vectors);
  T_CHECK(values[0] == 0 && values[2] == 0 && vectors[0] == 1 && vectors[4] == 1 && vectors[8] == 1, "zero matrix");
  batten_eigen_symmetric(2, (double[]){0, 5, 5, 0}, values, vectors);
  T_RATIO(fabs(values[0] + 5) + fabs(values[1] - 5), 20 * DBL_EPSILON, "zero diagonal");
}

/* A = sum_i values_i v_i v_i' again, rows orthonormal, right-handed, ascending. */
static void test_random(void) {
  uint64_t seed = 11;
  double worst = 0, orthogonal = 0, hand = 0;
  bool ascending = true;
  for (int run = 0; run < 3000; run++) {
    double scale = ldexp(1, (int)(t_random(&seed) % 400) - 200), a[3][3], values[3], v[3][3];
    for (int i = 0; i < 3; i++)
      for (int j = i; j < 3; j++)
        a[i][j] = a[j][i] = scale * (2 * t_uniform(&seed) - 1) * pow(10, -8.0 * (run % 2) * t_uniform(&seed));
    batten_eigen_symmetric(3, &a[0][0], values, &v[0][0]);
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) {
        double sum = 0, dot = 0;
        for (int k = 0; k < 3; k++) {
          sum += values[k] * v[k][i] * v[k][j];
          dot += v[i][k] * v[j][k];
        }
        worst = fmax(worst, fabs(sum - a[i][j]) / scale);
        orthogonal = fmax(orthogonal, fabs(dot - (i == j)));
      }
    double det = 0;
    for (int i = 0; i < 3; i++)
      det += v[0][i] * (v[1][(i + 1) % 3] * v[2][(i + 2) % 3] - v[1][(i + 2) % 3] * v[2][(i + 1) % 3]);
    hand = fmax(hand, fabs(det - 1));
    if (values[0] > values[1] || values[1] > values[2]) ascending = false;
  }
  T_RATIO(worst, 20 * DBL_EPSILON, "V' D V = A, 3000 matrices, seed 11");
  T_RATIO(orthogonal, 20 * DBL_EPSILON, "rows orthonormal");
  T_RATIO(hand, 20 * DBL_EPSILON, "right-handed");
  T_CHECK(ascending, "ascending");
}

/* A graded matrix D B D: the tiny eigenvalue is right to its own digits. */
static void test_graded(void) {
  double d[3] = {1, 1e-5, 1e-10}, a[9], values[3];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) a[3 * i + j] = d[i] * d[j] * (i == j ? 1 : 0.25);
  batten_eigen_symmetric(3, a, values, NULL);
  /* det B = 1 + 2/64 - 3/16, and the three eigenvalues multiply to det A. */
  double product = values[0] * values[1] * values[2], det = (1 + 2.0 / 64 - 3.0 / 16) * 1e-30;
  T_RATIO(fabs(product / det - 1), 1e-14, "graded matrix: determinant");
}

int main(void) {
  test_by_hand();
  test_random();
  test_graded();
  return t_done();
}
