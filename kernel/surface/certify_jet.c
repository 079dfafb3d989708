/* Derivatives of a surface on a span pair in Bernstein form, by Boehm's knot insertion.   [Boehm 1980]
 *
 * Differences come first, of the control points as they were given: they are what the proof is about, and lose
 * nothing by points that are far from the origin. */
#include "certify.h"

#include <math.h>
#include <string.h>

#include "base/checked.h"

enum { ORDER = BATTEN_SURFACE_DEGREE_MAX + 1 };

/* Points of one variable, [degree + 1] rows of `width` numbers, with what they are off by at most. */
typedef struct net {
  unsigned degree;
  size_t width;
  double *rows;
  double error;
} net;

static double most_of(const net *n) {
  double most = 0;
  for (size_t x = 0; x < (n->degree + 1) * n->width; x++) most = fmax(most, fabs(n->rows[x]));
  return most * CERTIFY_UP;
}

/* knots[0 .. 2 degree + 1] of the points, the span is the middle. The derivative by a parameter of the span's length
 * 1 has the points degree (c_(j+1) - c_j) length / (t_(j+degree+1) - t_(j+1)), and loses the outer knots. */
static void differentiate(net *n, const double *knots, double length) {
  double largest = 0;
  for (unsigned j = 0; j < n->degree; j++) {
    double factor = n->degree * (length / (knots[j + n->degree + 1] - knots[j + 1]));
    double *row = n->rows + j * n->width;
    for (size_t x = 0; x < n->width; x++) row[x] = factor * (row[x + n->width] - row[x]);
    largest = fmax(largest, factor);
  }
  n->degree--;
  n->error = (2 * largest * n->error + 8 * CERTIFY_EPS * most_of(n)) * CERTIFY_UP;
}

/* Row j (1 - part) + part row j + 1 of `from` is put to `to`. */
static void blend(const net *n, unsigned j, double part, unsigned to) {
  const double *a = n->rows + j * n->width, *b = a + n->width;
  double *out = n->rows + to * n->width;
  for (size_t x = 0; x < n->width; x++) out[x] = (1 - part) * a[x] + part * b[x];
}

/* Inserts the ends of the span until they are `degree` fold. knots[1 .. 2 degree], t_degree and t_(degree+1) the
 * ends; point j is the blossom's value at t_(j+1) .. t_(j+degree). */
static void to_bezier(net *n, double *knots) {
  unsigned d = n->degree;
  if (d == 0) return;
  double lower = knots[d], upper = knots[d + 1], most = most_of(n) + n->error;
  unsigned insertions = 0;
  for (; knots[1] < lower; insertions++) {
    for (unsigned j = 0; j < d; j++) blend(n, j, (lower - knots[j + 1]) / (knots[j + 1 + d] - knots[j + 1]), j);
    for (unsigned i = 1; i < d; i++) knots[i] = knots[i + 1];
  }
  for (; knots[2 * d] > upper; insertions++) {
    for (unsigned j = d; j > 0; j--) blend(n, j - 1, (upper - knots[j]) / (knots[j + d] - knots[j]), j);
    for (unsigned i = 2 * d; i > d + 1; i--) knots[i] = knots[i - 1];
  }
  /* A part is off by 4 eps, the products and the sum by one each. */
  n->error = (n->error + insertions * 12 * CERTIFY_EPS * most) * CERTIFY_UP;
}

/* The derivative of this order along the axis, in Bernstein form, of degree max(degree, 2) - order. */
static void along_axis(const bspline *space, size_t mu, unsigned order, net *n) {
  unsigned d = space->degree;
  double knots[2 * ORDER];
  for (unsigned i = 0; i <= 2 * d + 1; i++) knots[i] = space->knots[mu - d + i];
  double length = knots[d + 1] - knots[d];
  for (unsigned level = 0; level < order && n->degree > 0; level++) differentiate(n, knots + level, length);
  if (d == 1 && order == 2) { /* of a straight line */
    memset(n->rows, 0, n->width * sizeof *n->rows);
    n->error = 0;
    return;
  }
  to_bezier(n, knots + order);
  if (d > 1) return;
  double *rows = n->rows; /* straight: two points, or the one of the derivative, become one more */
  n->degree++;
  memcpy(rows + n->degree * n->width, rows + (n->degree - 1) * n->width, n->width * sizeof *rows);
  if (order == 0) {
    blend(n, 0, 0.5, 1);
    n->error = (n->error + CERTIFY_EPS * most_of(n)) * CERTIFY_UP;
  }
}

/* One derivative into its three polynomials, not scaled yet. */
static void make_part(const batten_surface *s, size_t mu, size_t nu, const unsigned order[2], double unit,
                      double data_error, double *work, certify_poly part[3]) {
  double *a = work, *b = work + 3 * CERTIFY_NET;
  const bspline *u = &s->space[0], *v = &s->space[1];
  size_t width = (v->degree + 1) * 3;
  for (size_t i = 0; i <= u->degree; i++) {
    const double *from = s->control_points + ((mu - u->degree + i) * v->count + nu - v->degree) * 3;
    for (size_t x = 0; x < width; x++) a[i * width + x] = unit * from[x];
  }
  net n = {.degree = u->degree, .width = width, .rows = a, .error = data_error + CERTIFY_TINY};
  along_axis(u, mu, order[0], &n);
  unsigned degree = n.degree;
  for (size_t i = 0; i <= degree; i++)
    for (size_t j = 0; j <= v->degree; j++)
      memcpy(b + (j * (degree + 1) + i) * 3, a + i * width + j * 3, 3 * sizeof *a);
  n = (net){.degree = v->degree, .width = (size_t)(degree + 1) * 3, .rows = b, .error = n.error};
  along_axis(v, nu, order[1], &n);
  for (int x = 0; x < 3; x++) {
    certify_poly *p = &part[x];
    p->degree[0] = degree;
    p->degree[1] = n.degree;
    p->error = n.error;
    p->most = 0;
    for (size_t i = 0; i <= degree; i++)
      for (size_t j = 0; j <= n.degree; j++) p->c[i * (n.degree + 1) + j] = b[(j * (degree + 1) + i) * 3 + (size_t)x];
  }
}

/* Power of two that brings a derivative to size 1, as far as its squares stay far from overflow. */
static double factor_of(const certify_poly part[3]) {
  double most = 0;
  for (int x = 0; x < 3; x++)
    for (size_t k = 0; k < certify_count(&part[x]); k++) most = fmax(most, fabs(part[x].c[k]));
  return most > 0x1p-200 ? batten_unit(most) : most > 0 ? 0x1p200 : 1;
}

void certify_jet_make(const batten_surface *surface, size_t mu, size_t nu, double unit, double data_error,
                      double *room, certify_jet *out) {
  static const unsigned order[CERTIFY_DERIVATIVES][2] = {{1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}};
  double *work = room + CERTIFY_DERIVATIVES * 3 * CERTIFY_NET;
  for (int k = 0; k < CERTIFY_DERIVATIVES; k++) {
    for (int x = 0; x < 3; x++, room += CERTIFY_NET) out->part[k][x].c = room;
    make_part(surface, mu, nu, order[k], unit, data_error, work, out->part[k]);
  }
  double factor[2] = {factor_of(out->part[CERTIFY_U]), factor_of(out->part[CERTIFY_V])};
  for (int k = 0; k < CERTIFY_DERIVATIVES; k++)
    for (int x = 0; x < 3; x++) {
      certify_poly *p = &out->part[k][x];
      for (int i = 0; i < 2; i++)
        for (unsigned r = 0; r < order[k][i]; r++) {
          for (size_t c = 0; c < certify_count(p); c++) p->c[c] *= factor[i];
          p->error *= factor[i];
        }
      certify_scale(p);
    }
  for (int i = 0; i < 2; i++) {
    const bspline *b = &surface->space[i];
    size_t span = i == 0 ? mu : nu;
    out->degree[i] = b->degree < 2 ? 2 : b->degree;
    out->factor[i] = factor[i] * (b->knots[span + 1] - b->knots[span]);
  }
}

void certify_cross(const certify_poly u[3], const certify_poly v[3], certify_poly cross[3]) {
  for (int x = 0; x < 3; x++) {
    int y = (x + 1) % 3, z = (x + 2) % 3;
    certify_clear(&cross[x], u->degree[0] + v->degree[0], u->degree[1] + v->degree[1]);
    certify_add_product(&cross[x], 1, &u[y], &v[z], 2);
    certify_add_product(&cross[x], -1, &u[z], &v[y], 2);
    certify_summed(&cross[x]);
  }
}
