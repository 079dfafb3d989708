/* Points, derivatives and curvatures at places on a surface.
 *
 * Derivatives are sums over differences of neighbouring control points, with weights that come out of the triangle of
 * Cox and de Boor on the way: far from the origin nothing is lost. They are taken by parameters and in a unit in
 * which spans and surface have a size of about 1, by powers of two: curvatures do not depend on the former, and no
 * product of derivatives overflows that could be said in the caller's units. */
#include "surface_inner.h"

#include "base/checked.h"
#include "basis/shape.h"

#include <string.h>

enum { PLACES = 256 }; /* a task: about 60 us */

/* ---- one parameter ------------------------------------------------------------------------------ */

/* The exponent that brings the span to about 1, as far as that keeps the whole domain within range. */
static int span_exponent(const bspline *b, size_t mu) {
  int own = -ilogb(b->knots[mu + 1] - b->knots[mu]), most = 1000 - ilogb(bspline_upper(b) - bspline_lower(b));
  int e = own < most ? own : most;
  return e < -1022 ? -1022 : e > 1023 ? 1023 : e;
}

void surface_basis_make(const bspline *b, size_t mu, double t, surface_basis *out) {
  unsigned d = b->degree;
  const double *knots = b->knots + mu; /* the span is knots[0 .. 1] */
  double *value = out->value, slope[BSPLINE_ORDER] = {0};
  out->first = mu - d;
  out->exponent = span_exponent(b, mu);
  double unit = ldexp(1, out->exponent);
  value[0] = 1;
  for (unsigned level = 1; level <= d; level++) {
    /* From the functions of degree level - 1 to those of degree level. */
    double saved = 0, over = 0;
    for (unsigned r = 0; r < level; r++) {
      double start = *(knots + r + 1 - level), width = knots[r + 1] - start, part = (t - start) / width;
      double old = value[r];
      if (level + 1 >= d) {
        /* Their derivatives are differences of neighbouring quotients: those of the control points' differences are
         * the quotients themselves. */
        double per = level / (width * unit), quotient = old * per;
        if (level == d) {
          out->slope[r] = quotient;
          out->bend[r] = slope[r] * per;
        } else {
          slope[r] = over - quotient;
          over = quotient;
        }
      }
      value[r] = saved + (1 - part) * old;
      saved = part * old;
    }
    value[level] = saved;
    if (level + 1 == d) slope[level] = over;
  }
}

/* ---- a place ------------------------------------------------------------------------------------ */

void surface_net_jet(unsigned p, unsigned q, size_t stride, const double *row, double unit, const surface_basis *u,
                     const surface_basis *v, double (*jet)[3]) {
  unsigned columns = 3 * (q + 1);
  /* Along u first: the point, its differences by v, its derivatives by u. */
  double point[3 * BSPLINE_ORDER] = {0}, across[3 * BSPLINE_ORDER] = {0}, first[3 * BSPLINE_ORDER] = {0},
                   second[3 * BSPLINE_ORDER] = {0};
  for (unsigned i = 0; i <= p; i++, row += stride) {
    double value = u->value[i], scaled = value * unit;
    for (unsigned x = 0; x < columns; x++) point[x] += value * row[x];
    for (unsigned x = 0; x + 3 < columns; x++) across[x] += scaled * (row[x + 3] - row[x]);
    if (i == p) break;
    double slope = u->slope[i] * unit, bend = u->bend[i] * unit;
    for (unsigned x = 0; x < columns; x++) {
      double difference = row[stride + x] - row[x];
      first[x] += slope * difference;
      second[x] += bend * difference;
    }
  }
  memset(jet, 0, 6 * sizeof *jet);
  for (unsigned j = 0; j <= q; j++)
    for (unsigned d = 0; d < 3; d++) {
      jet[0][d] += v->value[j] * point[3 * j + d];
      jet[1][d] += v->value[j] * first[3 * j + d];
      jet[3][d] += v->value[j] * second[3 * j + d];
    }
  for (unsigned j = 0; j < q; j++)
    for (unsigned d = 0; d < 3; d++) {
      jet[2][d] += v->slope[j] * across[3 * j + d];
      jet[5][d] += v->bend[j] * across[3 * j + d];
      jet[4][d] += v->slope[j] * (first[3 * j + 3 + d] - first[3 * j + d]);
    }
}

void surface_jet_scaled(const batten_surface *surface, const surface_basis *u, const surface_basis *v,
                        double (*jet)[3]) {
  size_t stride = 3 * surface->space[1].count;
  surface_net_jet(surface->space[0].degree, surface->space[1].degree, stride,
                  surface->control_points + u->first * stride + 3 * v->first, ldexp(1, surface->exponent), u, v, jet);
}

/* out = from 2^exponent, also where that power is no double. */
static void shift(const double from[3], int exponent, double out[3]) {
  if (exponent >= -1022 && exponent <= 1023) {
    double factor = ldexp(1, exponent);
    for (int d = 0; d < 3; d++) out[d] = factor * from[d];
  } else {
    for (int d = 0; d < 3; d++) out[d] = ldexp(from[d], exponent);
  }
}

/* Derivatives in the caller's units; [6][3], from and out may be the same. */
static void unscale(const batten_surface *surface, const surface_basis *u, const surface_basis *v,
                    const double (*from)[3], double (*out)[3]) {
  int e = -surface->exponent, a = u->exponent, b = v->exponent;
  const int by[6] = {0, e + a, e + b, e + a + a, e + a + b, e + b + b};
  for (int k = 0; k < 6; k++) shift(from[k], by[k], out[k]);
}

void surface_point_make(const batten_surface *surface, const surface_basis *u, const surface_basis *v,
                        batten_surface_point *out) {
  double jet[6][3];
  surface_shape shape;
  surface_jet_scaled(surface, u, v, jet);
  surface_shape_make((const double(*)[3])jet, &shape);
  unscale(surface, u, v, (const double(*)[3])jet, jet);
  memcpy(out->point, jet[0], sizeof jet[0]);
  memcpy(out->du, jet[1], sizeof jet[1]);
  memcpy(out->dv, jet[2], sizeof jet[2]);
  memcpy(out->duu, jet[3], sizeof jet[3]);
  memcpy(out->duv, jet[4], sizeof jet[4]);
  memcpy(out->dvv, jet[5], sizeof jet[5]);
  memcpy(out->normal, shape.normal, sizeof shape.normal);
  double unit = ldexp(1, surface->exponent);
  out->gauss = shape.gauss * unit * unit;
  out->mean = shape.mean * unit;
  for (int k = 0; k < 2; k++) out->principal[k] = shape.principal[k] * unit;
  memcpy(out->directions, shape.directions, sizeof shape.directions);
}

static void make_bases(const batten_surface *surface, const double place[2], surface_basis basis[2]) {
  for (int i = 0; i < 2; i++)
    surface_basis_make(&surface->space[i], bspline_span(&surface->space[i], place[i]), place[i], &basis[i]);
}

void surface_jet(const batten_surface *surface, const double place[2], double (*jet)[3]) {
  surface_basis basis[2];
  make_bases(surface, place, basis);
  surface_jet_scaled(surface, &basis[0], &basis[1], jet);
  unscale(surface, &basis[0], &basis[1], (const double(*)[3])jet, jet);
}

/* ---- the public call ---------------------------------------------------------------------------- */

typedef struct job {
  const batten_surface *surface;
  size_t count;
  const double *places;
  batten_surface_point *out;
} job;

static void evaluate_some(void *arg, size_t index) {
  const job *j = arg;
  size_t from = index * PLACES, to = from + PLACES < j->count ? from + PLACES : j->count;
  for (size_t i = from; i < to; i++) {
    surface_basis basis[2];
    make_bases(j->surface, j->places + 2 * i, basis);
    surface_point_make(j->surface, &basis[0], &basis[1], &j->out[i]);
  }
}

batten_status batten_surface_evaluate(batten_context *ctx, const batten_surface *surface, size_t count,
                                      const double *places, batten_surface_point *out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!surface) return batten_fail(ctx, BATTEN_E_INVALID, "surface: NULL; give a surface");
  if (count && (!places || !out))
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give %zu places and room for as many points",
                       places ? "out" : "places", count);
  const bspline *s = surface->space;
  for (size_t i = 0; i < count; i++)
    for (size_t k = 0; k < 2; k++)
      if (!(places[2 * i + k] >= bspline_lower(&s[k]) && places[2 * i + k] <= bspline_upper(&s[k])))
        return batten_fail(ctx, BATTEN_E_INVALID, "places[%zu][%zu]: %.17g; give one from %.17g to %.17g", i, k,
                           places[2 * i + k], bspline_lower(&s[k]), bspline_upper(&s[k]));
  job j = {surface, count, places, out};
  batten_parallel(ctx, count / PLACES + (count % PLACES > 0), evaluate_some, &j);
  return BATTEN_OK;
}
