/* Bounds of a section's function over the squares of a quadtree, at a cost that does not grow with its centres.
 *
 * With z = x + i y, a centre at a (from the middle of the square), u within rho of it, l = ln |a|, q = rho / |a| < 1
 *
 *   r^2 ln r = Re(conj(u - a) g(u)),   g(u) = (u - a) (l + log(1 - u / a))
 *            = - a l + (l + 1) u - sum over k >= 2 of  a^(1 - k) u^k / (k (k - 1))
 *
 * for the imaginary part of a logarithm, times |u - a|^2, is imaginary, whichever branch is taken. So the sum over
 * centres is Re(conj(u) phi(u) + chi(u)) with phi = sum of w g and chi = - sum of w conj(a) g, two power series
 * [Goursat 1898]. Cut after u^P, a centre is left out with at most
 *
 *   |w| |u - a| |a| sum over k > P of q^k / (k (k - 1))  <=  |w| |a|^2 (1 + q) q^(P + 1) / (P (P + 1) (1 - q)).
 *
 * The polynomials are moved to the middle of a quarter of the square, without a loss but for rounding, so a centre is
 * expanded once for all squares in the one over which it has become far.
 *
 * What is nearer than 1.5 rho lies within r <= R = |a| + rho: there r^2 ln r = r^2 ln R + r^2 ln(r / R), of which the
 * first term is a polynomial as above and the second lies in [-R^2 / (2 e), 0].
 *
 * Roundings are relative to sizes: of a term, |w| (|a| + rho)^2 (|ln |a|| + 2), which bounds all its coefficients
 * times the powers of rho, and what the evaluator adds up; of polynomials that are moved, the same sum over their
 * coefficients. u is counted in half sides, so that halves and moves by 1 are exact. */
#include "section/local_field.h"

#include "base/checked.h"
#include "spline/inner.h"

static const double EPS = 0x1p-52, STEPS = 256; /* ample for the roundings in one coefficient */
static const double RHO = 1.4142135623730952;   /* of the square |x|, |y| <= 1, rounded up */
static const double NEAREST = 1.5;              /* rho: no nearer centre is expanded */
static const double DIP = 0.18393972058572117;  /* 1 / (2 e), rounded up */

/* ---- the centres --------------------------------------------------------------------------------- */

batten_status local_source_make(batten_context *ctx, const batten_solid *function, local_source *out) {
  const batten_spline *spline = batten_solid_spline(function);
  batten_carrier_parts carrier;
  batten_spline_parts p;
  *out = (local_source){0};
  if (!spline || batten_solid_sign(function) != 1) return BATTEN_OK;
  batten_carrier_get_parts(batten_solid_carrier(function), &carrier);
  if (carrier.kind != BATTEN_CARRIER_NONE) return BATTEN_OK;
  batten_spline_get_parts(spline, &p);
  if (p.n != 2 || p.m != 2 || p.gradient_count > 0) return BATTEN_OK;
  out->x = batten_alloc_array(ctx, p.count, 3 * sizeof *out->x);
  if (!out->x) return BATTEN_E_NOMEM;
  out->y = out->x + p.count;
  out->w = out->y + p.count;
  for (size_t i = 0; i < p.count; i++) {
    out->x[i] = spline_to_box(p.centers[2 * i], p.origin[0], p.scale);
    out->y[i] = spline_to_box(p.centers[2 * i + 1], p.origin[1], p.scale);
    out->w[i] = -p.coefficients[i];
  }
  for (unsigned k = 0; k < 3; k++) out->c[k] = -p.polynomial[k];
  out->count = p.count;
  out->rounding = EPS * (STEPS + (double)p.count);
  return BATTEN_OK;
}

void local_source_free(batten_context *ctx, local_source *s) { batten_free(ctx, s->x); }

/* ---- expansions ---------------------------------------------------------------------------------- */

local_field local_begin(const local_source *s, const local_square *square, double most) {
  local_field f = {.rest = 0};
  f.chi[0][0] = s->c[0] + s->c[1] * square->middle[0] + s->c[2] * square->middle[1];
  f.chi[1][0] = s->c[1] * square->half;
  f.chi[1][1] = -s->c[2] * square->half;
  f.rest = 4 * s->rounding * (fabs(s->c[0]) + (fabs(s->c[1]) + fabs(s->c[2])) * most);
  return f;
}

/* p((s + v) / 2) for s = sx + i sy, whose parts are 1 or -1. */
static void move(const double p[LOCAL_ORDER + 1][2], double sx, double sy, double out[LOCAL_ORDER + 1][2]) {
  double part = 1;
  for (unsigned k = 0; k <= LOCAL_ORDER; k++, part /= 2) {
    out[k][0] = part * p[k][0];
    out[k][1] = part * p[k][1];
  }
  for (unsigned i = 0; i < LOCAL_ORDER; i++)
    for (unsigned k = LOCAL_ORDER; k-- > i;) {
      out[k][0] += sx * out[k + 1][0] - sy * out[k + 1][1];
      out[k][1] += sx * out[k + 1][1] + sy * out[k + 1][0];
    }
}

static double size_of(const local_field *f) {
  double size = 0, power = 1;
  for (unsigned k = 0; k <= LOCAL_ORDER; k++, power *= RHO)
    size += power * (fabs(f->chi[k][0]) + fabs(f->chi[k][1]) + RHO * (fabs(f->phi[k][0]) + fabs(f->phi[k][1])));
  return size;
}

void local_part(const local_field *whole, unsigned c, local_field *out) {
  const double sx = c & 1 ? 1 : -1, sy = c & 2 ? 1 : -1;
  move(whole->chi, sx, sy, out->chi);
  move(whole->phi, sx, sy, out->phi);
  for (unsigned k = 0; k <= LOCAL_ORDER; k++) { /* conj((s + v) / 2) phi */
    double x = out->phi[k][0] /= 2, y = out->phi[k][1] /= 2;
    out->chi[k][0] += sx * x + sy * y;
    out->chi[k][1] += sx * y - sy * x;
  }
  out->rest = whole->rest + EPS * STEPS * size_of(whole);
}

/* A centre from the middle of a square, in half sides. */
typedef struct local_place {
  double x, y, square, w; /* square = x^2 + y^2; w: for lengths in half sides */
} local_place;

static local_place place_of(const local_source *s, const local_square *q, size_t j) {
  local_place a = {(s->x[j] - q->middle[0]) / q->half, (s->y[j] - q->middle[1]) / q->half, 0,
                   s->w[j] * q->half * q->half};
  a.square = a.x * a.x + a.y * a.y;
  return a;
}

/* What is left out of one that is no nearer than NEAREST. */
static double left_out(const local_place *a) {
  const double q2 = RHO * RHO / a->square, q = sqrt(q2);
  double power = q;
  for (unsigned k = 0; k < LOCAL_ORDER; k += 2) power *= q2;
  return fabs(a->w) * a->square * power * (1 + q) / ((1 - q) * LOCAL_ORDER * (LOCAL_ORDER + 1)) * (1 + 0x1p-36);
}

static void expand(const local_source *s, const local_square *q, const local_place *a, double left, local_field *f) {
  static const double part[LOCAL_ORDER + 1] = {0,       0,       1. / 2,  1. / 6,  1. / 12, 1. / 20,
                                               1. / 30, 1. / 42, 1. / 56, 1. / 72, 1. / 90}; /* 1 / (k (k - 1)) */
  const double l = 0.5 * log(a->square) + log(q->half), w = a->w, x = a->x, y = a->y;
  const double ix = x / a->square, iy = -y / a->square;
  f->phi[0][0] -= w * l * x;
  f->phi[0][1] -= w * l * y;
  f->chi[0][0] += w * l * a->square;
  f->phi[1][0] += w * (l + 1);
  f->chi[1][0] -= w * (l + 1) * x;
  f->chi[1][1] += w * (l + 1) * y;
  double px = w * ix, py = w * iy; /* w a^(1 - k) */
  for (unsigned k = 2; k <= LOCAL_ORDER; k++) {
    double tx = part[k] * px, ty = part[k] * py, next = px * ix - py * iy;
    f->phi[k][0] -= tx;
    f->phi[k][1] -= ty;
    f->chi[k][0] += x * tx + y * ty;
    f->chi[k][1] += x * ty - y * tx;
    py = px * iy + py * ix;
    px = next;
  }
  double reach = sqrt(a->square) + RHO;
  f->rest += left + 4 * s->rounding * fabs(w) * reach * reach * (fabs(l) + 2);
}

size_t local_take_far(const local_source *s, const local_square *square, double allowed, size_t count,
                      const uint32_t *near, uint32_t *left, local_field *f) {
  size_t kept = 0;
  for (size_t i = 0; i < count; i++) {
    local_place a = place_of(s, square, near[i]);
    double lost = a.square >= NEAREST * NEAREST * RHO * RHO ? left_out(&a) : INFINITY;
    if (lost <= allowed)
      expand(s, square, &a, lost, f);
    else
      left[kept++] = near[i];
  }
  return kept;
}

/* ---- bounds -------------------------------------------------------------------------------------- */

static void enclose(const local_source *s, const local_square *q, const local_place *a, local_field *f) {
  const double reach = sqrt(a->square) + RHO, r2 = reach * reach, w = a->w, l = log(reach) + log(q->half);
  f->phi[1][0] += w * l;
  f->chi[1][0] -= 2 * w * l * a->x;
  f->chi[1][1] += 2 * w * l * a->y;
  f->chi[0][0] += w * (l * a->square - 0.5 * DIP * r2);
  f->rest += fabs(w) * r2 * (0.5 * DIP + 4 * s->rounding * (fabs(l) + 2));
}

static interval range_of(const local_field *f) {
  const double lx = f->phi[0][0] + f->chi[1][0], ly = f->phi[0][1] - f->chi[1][1];
  const double xx = f->phi[1][0] + f->chi[2][0], yy = f->phi[1][0] - f->chi[2][0];
  double around = fabs(lx) + fabs(ly) + 2 * fabs(f->chi[2][1]), power = RHO * RHO * RHO;
  for (unsigned k = 3; k <= LOCAL_ORDER + 1; k++, power *= RHO) {
    const double *p = f->phi[k - 1];
    around += power * sqrt(p[0] * p[0] + p[1] * p[1]);
    if (k > LOCAL_ORDER) break;
    p = f->chi[k];
    around += power * sqrt(p[0] * p[0] + p[1] * p[1]);
  }
  around += f->rest + EPS * STEPS * size_of(f) + 0x1p-1000;
  return (interval){f->chi[0][0] + fmin(xx, 0) + fmin(yy, 0) - around,
                    f->chi[0][0] + fmax(xx, 0) + fmax(yy, 0) + around};
}

interval local_bounds(const local_source *s, const local_square *square, const local_field *f, size_t count,
                      const uint32_t *near) {
  local_field all = *f;
  for (size_t i = 0; i < count; i++) {
    local_place a = place_of(s, square, near[i]);
    if (a.square >= NEAREST * NEAREST * RHO * RHO)
      expand(s, square, &a, left_out(&a), &all);
    else
      enclose(s, square, &a, &all);
  }
  return range_of(&all);
}
