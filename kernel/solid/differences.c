/* Central differences about points. */
#include "solid/differences.h"

size_t batten_difference_points(unsigned n, const double *x, double h, bool mixed, double *at) {
  size_t made = 0;
  for (unsigned a = 0; a < n; a++)
    for (int side = 1; side >= -1; side -= 2, made++) {
      for (unsigned i = 0; i < n; i++) at[made * n + i] = x[i];
      at[made * n + a] += side * h;
    }
  for (unsigned a = 0; mixed && a < n; a++)
    for (unsigned b = a + 1; b < n; b++)
      for (unsigned corner = 0; corner < 4; corner++, made++) {
        for (unsigned i = 0; i < n; i++) at[made * n + i] = x[i];
        at[made * n + a] += corner & 1 ? -h : h;
        at[made * n + b] += corner & 2 ? -h : h;
      }
  return made;
}

void batten_differences_of_values(unsigned n, double h, double middle, const double *v, double *gradient,
                                  double *hessian) {
  for (unsigned a = 0; gradient && a < n; a++) gradient[a] = (v[2 * a] - v[2 * a + 1]) / (2 * h);
  const double *corner = v + 2 * n;
  for (unsigned a = 0; hessian && a < n; a++) {
    hessian[a * n + a] = ((v[2 * a] - middle) - (middle - v[2 * a + 1])) / (h * h);
    for (unsigned b = a + 1; b < n; b++, corner += 4)
      hessian[a * n + b] = hessian[b * n + a] = ((corner[0] - corner[1]) - (corner[2] - corner[3])) / (4 * h * h);
  }
}

void batten_differences_of_gradients(unsigned n, double h, const double *g, double *hessian) {
  for (unsigned a = 0; a < n; a++)
    for (unsigned b = 0; b < n; b++) {
      double ab = g[2 * a * n + b] - g[(2 * a + 1) * n + b], ba = g[2 * b * n + a] - g[(2 * b + 1) * n + a];
      hessian[a * n + b] = (ab + ba) / (4 * h);
    }
}
