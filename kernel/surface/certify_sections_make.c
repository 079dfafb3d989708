/* x_u and w on a span pair in Bernstein form, by Boehm's knot insertion.   [Boehm 1980]
 *
 * Differences of control points in u come first, as these were given: they are what the proof is about, and lose
 * nothing by points that are far from the origin. */
#include "certify_sections.h"

#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "certify.h"

enum { ORDER = BATTEN_SURFACE_DEGREE_MAX + 1 };

/* Control points in u, each a row of numbers; with bounds of their errors by rounding, and by data_error. */
typedef struct strip {
  unsigned degree;
  size_t width;
  double *row; /* [degree + 1][width] */
  double error[ORDER], noise[ORDER], most[ORDER];
} strip;

/* ---- plan ----------------------------------------------------------------------------------------- */

static double largest_coordinate(const batten_surface *s, unsigned dim, const unsigned axis[3]) {
  double most = 0;
  for (size_t i = 0; i < s->space[0].count * s->space[1].count; i++)
    for (unsigned x = 0; x < dim; x++) most = fmax(most, fabs(s->control_points[3 * i + axis[x]]));
  return most;
}

void sections_plan_make(const batten_surface *surface, const double normal[3], sections_plan *out) {
  *out = (sections_plan){.surface = surface, .dim = 3, .axis = {0, 1, 2}, .length = 1};
  double largest = fmax(fabs(normal[0]), fmax(fabs(normal[1]), fabs(normal[2]))), scale = batten_unit(largest);
  for (unsigned x = 0; x < 3; x++) {
    out->normal[x] = scale * normal[x];
    unsigned y = (x + 1) % 3, z = (x + 2) % 3;
    if (normal[y] != 0 || normal[z] != 0) continue;
    out->dim = 2;
    out->axis[0] = normal[x] > 0 ? y : z;
    out->axis[1] = normal[x] > 0 ? z : y;
    break;
  }
  const double *n = out->normal;
  if (out->dim == 3) out->length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) * CERTIFY_UP;
  double most = largest_coordinate(surface, out->dim, out->axis);
  out->exponent = most > 0 ? -ilogb(most) : 0;
  if (out->exponent > 1000) out->exponent = 1000; /* 2^exponent is a double */
  out->unit = ldexp(1, out->exponent);
  out->data_error = 4 * CERTIFY_EPS * out->unit * most;
  for (int k = 0; k < 2; k++) out->degree[k] = surface->space[k].degree;
  unsigned m = out->degree[0] - 1, q = out->degree[1];
  for (unsigned k = 0; k < 2; k++) {
    unsigned degree = k == 1 ? m : m > 0 ? m - 1 : 0;
    certify_binomials(degree, out->own[k]);
    certify_binomials(2 * degree, out->both[k]);
    for (unsigned i = 0; i <= 2 * degree; i++) out->both[k][i] = 1 / out->both[k][i];
  }
  certify_binomials(q, out->own_v);
  certify_binomials(2 * q, out->both_v);
  for (unsigned i = 0; i <= 2 * q; i++) out->both_v[i] = 1 / out->both_v[i];
}

size_t sections_a_count(const sections_plan *plan) {
  return plan->dim * (size_t)plan->degree[0] * (plan->degree[1] + 1);
}

static unsigned rows_of_w(const sections_plan *plan) { return plan->degree[0] > 1 ? 2 * plan->degree[0] - 3 : 1; }

size_t sections_w_count(const sections_plan *plan) { return (size_t)rows_of_w(plan) * (2 * plan->degree[1] + 1); }

/* Two nets, x_uu, n x x_u and both scaled; or |x_u|^2, w of its degree and two scaled factors. */
size_t sections_room(const sections_plan *plan) {
  return 6 * sections_a_count(plan) + 2 * (size_t)(2 * plan->degree[0] - 1) * (2 * plan->degree[1] + 1);
}

/* ---- along u -------------------------------------------------------------------------------------- */

static void find_most(strip *p, unsigned j) {
  double most = 0;
  const double *row = p->row + j * p->width;
  for (size_t x = 0; x < p->width; x++) most = fabs(row[x]) > most ? fabs(row[x]) : most;
  p->most[j] = most;
}

/* The control points of x_u on span mu, those of v that count on span nu, by the part of the span. knots[0 .. 2
 * degree + 1] in u. */
static void differentiate_points(const sections_plan *plan, size_t mu, size_t nu, const double *knots, strip *out) {
  const batten_surface *s = plan->surface;
  unsigned d = plan->degree[0], columns = plan->degree[1] + 1;
  size_t stride = 3 * s->space[1].count;
  double length = knots[d + 1] - knots[d];
  out->degree = d - 1;
  out->width = (size_t)plan->dim * columns;
  for (unsigned j = 0; j < d; j++) {
    double factor = d * (length / (knots[j + d + 1] - knots[j + 1])), *row = out->row + j * out->width;
    const double *from = s->control_points + (mu - d + j) * stride + 3 * (nu - plan->degree[1]);
    for (unsigned x = 0; x < plan->dim; x++)
      for (unsigned k = 0; k < columns; k++) {
        const double *p = from + 3 * k + plan->axis[x];
        row[x * columns + k] = factor * (plan->unit * (p[stride] - p[0]));
      }
    find_most(out, j);
    out->error[j] = 6 * CERTIFY_EPS * out->most[j] * CERTIFY_UP + CERTIFY_TINY;
    out->noise[j] = 2 * factor * plan->data_error * CERTIFY_UP;
  }
}

/* The same for x_uu from those of x_u, the span being knots[degree + 1 .. degree + 2] there. */
static void differentiate(const strip *p, const double *knots, strip *out) {
  unsigned m = p->degree;
  double length = knots[m + 2] - knots[m + 1];
  out->degree = m - 1;
  out->width = p->width;
  for (unsigned j = 0; j < m; j++) {
    double factor = m * (length / (knots[j + m + 2] - knots[j + 2])), *row = out->row + j * p->width;
    const double *from = p->row + j * p->width;
    for (size_t x = 0; x < p->width; x++) row[x] = factor * (from[x + p->width] - from[x]);
    find_most(out, j);
    out->error[j] =
        (factor * (p->error[j] + p->error[j + 1]) + 6 * CERTIFY_EPS * out->most[j]) * CERTIFY_UP + CERTIFY_TINY;
    out->noise[j] = factor * (p->noise[j] + p->noise[j + 1]) * CERTIFY_UP;
  }
}

/* The power of two by which the largest number becomes 1 .. 2, as far as products stay far from overflow. */
static int normalise(strip *p) {
  double most = 0;
  for (unsigned j = 0; j <= p->degree; j++) most = fmax(most, p->most[j]);
  if (!(most > 0)) return 0;
  int exponent = -ilogb(most);
  if (exponent > 800) exponent = 800; /* CERTIFY_TINY becomes 2^-100 */
  double factor = ldexp(1, exponent);
  for (size_t x = 0; x < (p->degree + 1) * p->width; x++) p->row[x] *= factor;
  for (unsigned j = 0; j <= p->degree; j++) {
    p->most[j] *= factor;
    p->error[j] = p->error[j] * factor + CERTIFY_TINY;
    p->noise[j] *= factor;
  }
  return exponent;
}

/* Row `into` becomes from row_j + to row_(j+1). Both parts are off by 3 roundings, products and sum by one each. */
static void blend(strip *p, unsigned j, double from, double to, unsigned into) {
  const double *a = p->row + j * p->width, *b = a + p->width;
  double *out = p->row + into * p->width, most = from * p->most[j] + to * p->most[j + 1];
  for (size_t x = 0; x < p->width; x++) out[x] = from * a[x] + to * b[x];
  p->error[into] = (from * p->error[j] + to * p->error[j + 1] + 8 * CERTIFY_EPS * most) * CERTIFY_UP + CERTIFY_TINY;
  p->noise[into] = (from * p->noise[j] + to * p->noise[j + 1]) * CERTIFY_UP;
  p->most[into] = most * CERTIFY_UP;
}

/* Inserts the ends of the span until they are `degree` fold. knots[1 .. 2 degree], t_degree and t_(degree+1) the
 * ends; point j is the blossom's value at t_(j+1) .. t_(j+degree). */
static void to_bezier_u(strip *p, double *knots) {
  unsigned d = p->degree;
  if (d == 0) return;
  double lower = knots[d], upper = knots[d + 1];
  while (knots[1] < lower) {
    for (unsigned j = 0; j < d; j++) {
      double left = knots[j + 1], right = knots[j + 1 + d], width = right - left;
      if (left < lower) blend(p, j, (right - lower) / width, (lower - left) / width, j);
    }
    for (unsigned i = 1; i < d; i++) knots[i] = knots[i + 1];
  }
  while (knots[2 * d] > upper) {
    for (unsigned j = d; j > 0; j--) {
      double left = knots[j], right = knots[j + d], width = right - left;
      if (right > upper) blend(p, j - 1, (right - upper) / width, (upper - left) / width, j);
    }
    for (unsigned i = 2 * d; i > d + 1; i--) knots[i] = knots[i - 1];
  }
}

/* ---- along v -------------------------------------------------------------------------------------- */

/* Columns j and j + 1 of all rows and coordinates. */
static void blend_columns(strip *p, unsigned columns, unsigned j, double from, double to, unsigned into) {
  size_t all = (p->degree + 1) * p->width;
  for (double *c = p->row; c < p->row + all; c += columns) c[into] = from * c[j] + to * c[j + 1];
}

static void inserted(strip *p) {
  for (unsigned j = 0; j <= p->degree; j++) {
    p->error[j] = (p->error[j] + 8 * CERTIFY_EPS * p->most[j]) * CERTIFY_UP + CERTIFY_TINY;
    p->most[j] *= CERTIFY_UP;
    p->noise[j] *= CERTIFY_UP;
  }
}

/* As to_bezier_u, of the knots around span nu. */
static void to_bezier_v(const bspline *v, size_t nu, strip *p) {
  unsigned d = v->degree;
  double knots[2 * ORDER], lower = v->knots[nu], upper = v->knots[nu + 1];
  memcpy(knots, v->knots + nu - d, (2 * d + 2) * sizeof *knots);
  for (; knots[1] < lower; inserted(p)) {
    for (unsigned j = 0; j < d; j++) {
      double left = knots[j + 1], right = knots[j + 1 + d], width = right - left;
      if (left < lower) blend_columns(p, d + 1, j, (right - lower) / width, (lower - left) / width, j);
    }
    for (unsigned i = 1; i < d; i++) knots[i] = knots[i + 1];
  }
  for (; knots[2 * d] > upper; inserted(p)) {
    for (unsigned j = d; j > 0; j--) {
      double left = knots[j], right = knots[j + d], width = right - left;
      if (right > upper) blend_columns(p, d + 1, j - 1, (right - upper) / width, (upper - left) / width, j);
    }
    for (unsigned i = 2 * d; i > d + 1; i--) knots[i] = knots[i - 1];
  }
}

/* ---- products ------------------------------------------------------------------------------------- */

/* Times the binomials; rows of the result follow each other. */
static void scale(const sections_plan *plan, unsigned rows, const double *own, const sections_sheet *f, double *to) {
  unsigned columns = plan->degree[1] + 1;
  for (unsigned x = 0; x < f->dim; x++)
    for (unsigned k = 0; k < rows; k++) {
      const double *from = f->c + ((size_t)x * (f->degree[0] + 1) + k) * columns;
      for (unsigned l = 0; l < columns; l++) *to++ = own[k] * plan->own_v[l] * from[l];
    }
}

/* out = f . g, the first `rows` rows of both; of the degree in v of the surface. */
static void multiply(const sections_plan *plan, unsigned rows, const double *own, const double *both,
                     const sections_sheet *f, const sections_sheet *g, double *room, sections_sheet *out) {
  unsigned columns = plan->degree[1] + 1, wide = 2 * columns - 1, dim = f->dim, last = 2 * rows - 2;
  double *a = room, *b = room + (size_t)dim * rows * columns;
  scale(plan, rows, own, f, a);
  scale(plan, rows, own, g, b);
  *out = (sections_sheet){.dim = 1, .degree = {last, wide - 1}, .c = out->c};
  memset(out->c, 0, sections_count(out) * sizeof *out->c);
  for (unsigned x = 0; x < dim; x++)
    for (unsigned k = 0; k < rows; k++)
      for (unsigned i = 0; i < rows; i++) {
        const double *p = a + ((size_t)x * rows + k) * columns, *q = b + ((size_t)x * rows + i) * columns;
        double *to = out->c + (size_t)(k + i) * wide;
        for (unsigned l = 0; l < columns; l++)
          for (unsigned j = 0; j < columns; j++) to[l + j] += p[l] * q[j];
      }
  /* Scaling twice each, product, one over the binomials and their products; a sum for each term. Weights of a
   * coefficient have the sum 1, and in v for each pair of rows. */
  double roundings = (double)dim * rows * columns + 10;
  for (unsigned k = 0; k < rows; k++)
    for (unsigned i = 0; i < rows; i++) {
      double weight = dim * own[k] * own[i] * both[k + i], size = f->most[k] * g->most[i];
      out->most[k + i] += weight * size;
      out->error[k + i] += weight * (f->error[k] * g->most[i] + f->most[k] * g->error[i] + f->error[k] * g->error[i]);
    }
  for (unsigned r = 0; r <= last; r++) {
    double *to = out->c + (size_t)r * wide;
    for (unsigned c = 0; c < wide; c++) to[c] *= both[r] * plan->both_v[c];
    out->most[r] = (out->most[r] + out->error[r]) * CERTIFY_UP + CERTIFY_TINY;
    out->error[r] = (out->error[r] + roundings * CERTIFY_EPS * out->most[r]) * CERTIFY_UP + CERTIFY_TINY;
  }
}

void sections_square(const sections_plan *plan, const sections_sheet *a, double *room, sections_sheet *out) {
  multiply(plan, plan->degree[0], plan->own[1], plan->both[1], a, a, room, out);
}

/* n x a: in the plane a turned to the left. */
static void turn(const sections_plan *plan, const sections_sheet *a, sections_sheet *out) {
  size_t count = sections_count(a) / a->dim;
  const double *x = a->c, *y = x + count, *z = y + count, *n = plan->normal;
  *out = (sections_sheet){.dim = a->dim, .degree = {a->degree[0], a->degree[1]}, .c = out->c};
  double factor = a->dim == 3 ? 4 : 1; /* above |n_y| + |n_z| */
  for (unsigned k = 0; k <= a->degree[0]; k++) {
    out->most[k] = factor * a->most[k] * CERTIFY_UP;
    out->error[k] = (factor * a->error[k] + (a->dim == 3 ? 3 * CERTIFY_EPS * out->most[k] : 0)) * CERTIFY_UP;
  }
  for (size_t i = 0; i < count; i++) {
    if (a->dim == 2) {
      out->c[i] = -y[i];
      out->c[count + i] = x[i];
    } else {
      out->c[i] = n[1] * z[i] - n[2] * y[i];
      out->c[count + i] = n[2] * x[i] - n[0] * z[i];
      out->c[2 * count + i] = n[0] * y[i] - n[1] * x[i];
    }
  }
}

/* ---- a span pair ---------------------------------------------------------------------------------- */

static void to_sheet(const strip *p, unsigned dim, sections_sheet *out) {
  size_t columns = p->width / dim, rows = p->degree + 1;
  *out = (sections_sheet){.dim = dim, .degree = {p->degree, (unsigned)columns - 1}, .c = out->c};
  for (size_t x = 0; x < dim; x++)
    for (size_t j = 0; j < rows; j++)
      memcpy(out->c + (x * rows + j) * columns, p->row + j * p->width + x * columns, columns * sizeof *out->c);
  memcpy(out->error, p->error, rows * sizeof *out->error);
  memcpy(out->most, p->most, rows * sizeof *out->most);
}

/* In how many of both end sections x_uu is 0 to the noise at row k. */
static unsigned count_flat(const strip *second, unsigned dim, unsigned k) {
  size_t columns = second->width / dim;
  const double *row = second->row + k * second->width;
  bool flat[2] = {true, true};
  for (size_t x = 0; x < dim; x++)
    for (size_t end = 0; end < 2; end++)
      if (!(fabs(row[x * columns + end * (columns - 1)]) <= second->noise[k] + second->error[k])) flat[end] = false;
  return (unsigned)flat[0] + (unsigned)flat[1];
}

/* What noise and rounding leave of n . (a x b), rows k of both. */
static double allowed_at(const sections_plan *plan, const strip *first, const strip *second, unsigned k) {
  double ea = first->noise[k] + first->error[k], eb = second->noise[k] + second->error[k];
  double size = plan->dim == 3 ? 12 : 2; /* n x a, coordinate by coordinate */
  return size * (ea * second->most[k] + eb * first->most[k] + ea * eb) * CERTIFY_UP;
}

static void make_w(const sections_plan *plan, const strip *first, const strip *second, double *room,
                   sections_pair *out) {
  unsigned m = first->degree;
  sections_sheet b = {.c = room}, turned = {.c = room + sections_a_count(plan)};
  room += 2 * sections_a_count(plan);
  to_sheet(second, plan->dim, &b);
  turn(plan, &out->a, &turned);
  multiply(plan, m, plan->own[0], plan->both[0], &turned, &b, room, &out->w);
  for (unsigned side = 0; side < 2; side++) {
    unsigned k = side ? m - 1 : 0;
    unsigned flat = m > 1 ? count_flat(second, plan->dim, k) : 0;
    out->flat[side] = flat == 2;
    out->lonely[side] = flat == 1;
    out->allowed[side] = allowed_at(plan, first, second, k) + out->w.error[side ? 2 * m - 2 : 0];
  }
}

void sections_pair_make(const sections_plan *plan, size_t mu, size_t nu, double *room, sections_pair *out) {
  unsigned d = plan->degree[0];
  double knots[2 * ORDER], work[2 * ORDER];
  strip first = {.row = room}, second = {.row = room + sections_a_count(plan)};
  room += 2 * sections_a_count(plan);
  memcpy(knots, plan->surface->space[0].knots + mu - d, (2 * d + 2) * sizeof *knots);
  differentiate_points(plan, mu, nu, knots, &first);
  int exponent = normalise(&first);
  if (d > 1) {
    differentiate(&first, knots, &second);
    exponent -= normalise(&second);
    memcpy(work, knots + 2, (2 * d - 2) * sizeof *work);
    to_bezier_u(&second, work);
    to_bezier_v(&plan->surface->space[1], nu, &second);
  }
  memcpy(work, knots + 1, 2 * d * sizeof *work);
  to_bezier_u(&first, work);
  to_bezier_v(&plan->surface->space[1], nu, &first);
  to_sheet(&first, plan->dim, &out->a);
  /* An exponent beyond what products bear is cut, or tells nothing. */
  exponent = exponent > 900 ? 900 : exponent;
  out->factor = exponent < -900 ? 0 : ldexp(1, exponent) / plan->length;
  if (plan->dim == 3) out->factor /= CERTIFY_UP;
  if (d > 1) {
    make_w(plan, &first, &second, room, out);
    return;
  }
  out->w = (sections_sheet){.dim = 1, .degree = {0, 2 * plan->degree[1]}, .c = out->w.c};
  memset(out->w.c, 0, sections_count(&out->w) * sizeof *out->w.c);
  out->flat[0] = out->flat[1] = out->lonely[0] = out->lonely[1] = false;
  out->allowed[0] = out->allowed[1] = 0;
}
