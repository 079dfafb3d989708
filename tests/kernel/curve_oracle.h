/* What the tests of the certificate share: an oracle that samples in long double by de Boor's algorithm on the
 * curve's own derivatives, and curves whose shape is known by variation diminishing. */
#ifndef CURVE_ORACLE_H
#define CURVE_ORACLE_H

#include "curve_case.h"

/* x', x'' at t on the span [u_mu, u_mu+1], by parts of the span; degree >= 2. */
static inline void oracle_jet(const curve_case *c, size_t mu, long double t, long double jet[2][2]) {
  long double p[10][2], h = (long double)c->knots[mu + 1] - c->knots[mu];
  unsigned d = c->degree;
  for (unsigned j = 0; j <= d; j++)
    for (int x = 0; x < 2; x++) p[j][x] = c->control[mu - d + j][x];
  for (unsigned order = 1; order <= 2; order++) {
    unsigned m = d + 1 - order; /* of what is differentiated */
    for (unsigned j = 0; j < m; j++)
      for (int x = 0; x < 2; x++)
        p[j][x] = m * h * (p[j + 1][x] - p[j][x]) / ((long double)c->knots[mu + j + 1] - c->knots[mu - m + j + 1]);
    long double w[10][2];
    memcpy(w, p, sizeof w);
    for (unsigned round = 1; round <= m - 1; round++)
      for (unsigned j = 0; j + round <= m - 1; j++) {
        long double left = c->knots[mu - (m - 1) + j + round], right = c->knots[mu + j + 1];
        long double part = (t - left) / (right - left);
        for (int x = 0; x < 2; x++) w[j][x] = (1 - part) * w[j][x] + part * w[j + 1][x];
      }
    for (int x = 0; x < 2; x++) jet[order - 1][x] = w[0][x];
  }
}

/* [x', x''], and by |x'|^3: the curvature. */
static inline long double oracle_bend(const curve_case *c, size_t mu, long double t, long double *curvature) {
  long double jet[2][2];
  oracle_jet(c, mu, t, jet);
  long double bend = jet[0][0] * jet[1][1] - jet[0][1] * jet[1][0], speed = hypotl(jet[0][0], jet[0][1]);
  if (curvature) *curvature = bend / (speed * speed * speed);
  return bend;
}

static inline size_t next_span(const curve_case *c, size_t mu) {
  size_t n = curve_case_count(c);
  do mu++;
  while (mu < n && !(c->knots[mu] < c->knots[mu + 1]));
  return mu;
}

enum { SAMPLES = 64, MOST = 200 };

/* All changes of sign inside spans, by samples and bisection; false where they are not clear, or also at knots. */
static inline bool oracle_inflections(const curve_case *c, size_t *count, double *at, int *sign) {
  *count = 0;
  int before = 0;
  *sign = 1;
  for (size_t mu = c->degree; mu < curve_case_count(c); mu = next_span(c, mu)) {
    long double from = c->knots[mu], to = c->knots[mu + 1], last = from;
    for (int i = 0; i <= SAMPLES; i++) {
      long double t = from + (to - from) * i / SAMPLES, bend = oracle_bend(c, mu, t, NULL);
      int now = bend < 0 ? -1 : 1;
      if (before == 0) *sign = now;
      if (before && now != before) {
        if (i == 0) return false;
        long double a = last, b = t;
        for (int k = 0; k < 70; k++) {
          long double middle = (a + b) / 2;
          if ((oracle_bend(c, mu, middle, NULL) < 0 ? -1 : 1) == now)
            b = middle;
          else
            a = middle;
        }
        if (*count == MOST) return false;
        at[(*count)++] = (double)a;
      }
      before = now;
      last = t;
    }
  }
  return true;
}

/* The least of sign curvature / rho at samples, rho as in the header; jump: inflections are at knots where the
 * curvature jumps. */
static inline long double oracle_margin(const curve_case *c, int sign, size_t count, const double *inflections,
                                        double error, bool jump) {
  long double least = INFINITY;
  size_t next = 0;
  if (count && inflections[0] <= c->knots[0]) next = 1; /* of a closed curve, there the sign is the one after */
  for (size_t mu = c->degree; mu < curve_case_count(c); mu = next_span(c, mu)) {
    long double from = c->knots[mu], to = c->knots[mu + 1], h = to - from, most = h * 1e-6L;
    for (int i = 0; i <= 4 * SAMPLES; i++) {
      long double t = from + h * i / (4 * SAMPLES), curvature, rho = 1, near = INFINITY;
      long double inside = t + 1e-6L * ((from + to) / 2 - t);
      size_t passed = next;
      while (passed < count && inflections[passed] < inside) passed++;
      for (size_t k = 0; k < count && !jump; k++) {
        long double away = fabsl(t - inflections[k]);
        if (inflections[k] >= from - most && inflections[k] <= to + most && away < near) near = away;
      }
      if (near < INFINITY) rho = (near - error) / h;
      if (!(rho > 0)) continue;
      int now = (passed - next) % 2 ? -sign : sign;
      oracle_bend(c, mu, t, &curvature);
      if (now * curvature / rho < least) least = now * curvature / rho;
    }
  }
  return least;
}

static inline batten_curve_shape certify(batten_context *ctx, const curve_case *c, int sign, size_t count,
                                         const double *inflections) {
  batten_curve *curve = curve_case_make(ctx, c);
  batten_curve_shape_options o = batten_curve_shape_options_default();
  batten_curve_shape shape = {.certified = -1};
  o.sign = sign;
  o.inflection_count = count;
  o.inflections = inflections;
  if (batten_curve_certify(ctx, curve, &o, &shape) < 0) t_line(false, "certify: %s", batten_error(ctx));
  batten_curve_free(curve);
  return shape;
}

/* Control points from the differences q_j of x', that is legs along their knot intervals. */
static inline void from_tangents(curve_case *c, const double (*q)[2]) {
  size_t n = curve_case_count(c);
  for (size_t j = 0; j + 1 < n; j++)
    for (int x = 0; x < 2; x++)
      c->control[j + 1][x] = c->control[j][x] + q[j][x] * (c->knots[j + c->degree + 1] - c->knots[j + 1]) / c->degree;
}

/* x' with control vectors of turning directions: variation diminishing makes the curve bend one way. `least`: spans
 * differ up to 1 / least in length. */
static inline curve_case convex_case(uint64_t *state, unsigned degree, size_t breaks, unsigned fold, double turn,
                                     double least) {
  curve_case c = {.degree = degree};
  double at = 0, q[CASE_POINTS][2];
  for (unsigned k = 0; k <= degree; k++) c.knots[c.knot_count++] = 0;
  for (size_t s = 0; s < breaks; s++) {
    at += pow(least, t_uniform(state));
    unsigned times = 1 + (unsigned)(t_random(state) % fold);
    for (unsigned k = 0; k < times; k++) c.knots[c.knot_count++] = at;
  }
  at += pow(least, t_uniform(state));
  for (unsigned k = 0; k <= degree; k++) c.knots[c.knot_count++] = at;
  size_t n = curve_case_count(&c);
  double angle = 6 * t_uniform(state), step = turn / degree;
  for (size_t j = 0; j + 1 < n; j++) {
    double size = 0.5 + t_uniform(state);
    q[j][0] = size * cos(angle);
    q[j][1] = size * sin(angle);
    angle += step * (0.1 + 0.9 * t_uniform(state));
  }
  from_tangents(&c, (const double(*)[2])q);
  return c;
}

static inline curve_case transformed(const curve_case *c, bool mirror, bool reverse, int exponent) {
  curve_case out = *c;
  size_t n = curve_case_count(c);
  for (size_t i = 0; i < n; i++) {
    const double *p = c->control[reverse ? n - 1 - i : i];
    out.control[i][0] = ldexp(p[0], exponent);
    out.control[i][1] = ldexp(mirror ? -p[1] : p[1], exponent);
  }
  for (size_t k = 0; k < c->knot_count && reverse; k++)
    out.knots[k] = c->knots[0] + (c->knots[c->knot_count - 1] - c->knots[c->knot_count - 1 - k]);
  return out;
}

#endif
