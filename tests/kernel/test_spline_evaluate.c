/* Evaluation of volume splines: against a scalar reference in long double, differences, itself in other batches, on
 * other threads and instruction sets. The splines are made from random parts. */
#include "basis/green.h"
#include "basis/polynomial.h"
#include "spline/inner.h"
#include "tap.h"

#include <batten/spline.h>
#include <float.h>

enum { CENTRES = 150, GRADIENTS = 40, POINTS = 203 };

typedef struct scene {
  double centers[CENTRES * 3], coefficients[CENTRES], gradient_coefficients[GRADIENTS * 3];
  double polynomial[BATTEN_POLYNOMIAL_MAX];
  size_t gradient_at[GRADIENTS];
  double points[POINTS * 3];
  batten_spline_parts parts;
} scene;

/* Random parts with box side 8 about (100, -50, 3); gradients where the kernel allows them. */
static void make_scene(scene *s, unsigned n, unsigned m, uint64_t seed) {
  const double origin[3] = {100, -50, 3};
  for (int i = 0; i < CENTRES; i++) {
    for (unsigned a = 0; a < n; a++) s->centers[i * (int)n + (int)a] = origin[a] + 8 * (t_uniform(&seed) - 0.5);
    s->coefficients[i] = t_uniform(&seed) - 0.5;
  }
  for (int q = 0; q < GRADIENTS; q++) {
    s->gradient_at[q] = (size_t)(q * 3 + q % 2);
    for (unsigned a = 0; a < n; a++) s->gradient_coefficients[q * (int)n + (int)a] = t_uniform(&seed) - 0.5;
  }
  for (int q = 0; q < BATTEN_POLYNOMIAL_MAX; q++) s->polynomial[q] = t_uniform(&seed) - 0.5;
  for (int i = 0; i < POINTS; i++)
    for (unsigned a = 0; a < n; a++) s->points[i * (int)n + (int)a] = origin[a] + 10 * (t_uniform(&seed) - 0.5);
  s->parts = (batten_spline_parts){.struct_size = sizeof s->parts,
                                   .n = n,
                                   .m = m,
                                   .count = CENTRES,
                                   .centers = s->centers,
                                   .coefficients = s->coefficients,
                                   .gradient_count = 2 * m - n > 2 ? GRADIENTS : 0,
                                   .gradient_at = s->gradient_at,
                                   .gradient_coefficients = s->gradient_coefficients,
                                   .polynomial_count = batten_polynomial_count(n, m - 1),
                                   .polynomial = s->polynomial,
                                   .origin = {origin[0], origin[1], origin[2]},
                                   .scale = 8};
}

/* ---- the reference: straight from the formula, in long double ---- */

static void radial(unsigned power, long double r, long double f[4]) {
  long double a = power % 2 ? 0 : 1, b = power % 2 ? 1 : 0;
  for (int k = 0, q = (int)power; k < 4; k++, q -= 2) {
    f[k] = r == 0 ? 0 : (a == 0 ? b : a * logl(r) + b) * powl(r, q);
    b = b * q + a;
    a *= q;
  }
}

typedef struct jet {
  long double v, g[3], h[3][3], size; /* size: sum of the absolute terms of v */
} jet;

static jet reference(const batten_spline_parts *p, const double *x) {
  const unsigned n = p->n;
  jet out = {0};
  size_t q = 0;
  for (size_t i = 0; i < p->count; i++) {
    long double d[3] = {0}, r2 = 0, f[4], s = batten_green_sign(2 * p->m - n), w = s * p->coefficients[i];
    for (unsigned a = 0; a < n; a++) {
      d[a] = ((long double)x[a] - p->centers[i * n + a]) / p->scale;
      r2 += d[a] * d[a];
    }
    radial(2 * p->m - n, sqrtl(r2), f);
    out.v += w * f[0];
    out.size += fabsl(w * f[0]);
    for (unsigned a = 0; a < n; a++) {
      out.g[a] += w * f[1] * d[a];
      for (unsigned b = 0; b < n; b++) out.h[a][b] += w * (f[1] * (a == b) + f[2] * d[a] * d[b]);
    }
    if (q == p->gradient_count || p->gradient_at[q] != i) continue;
    for (unsigned c = 0; c < n; c++) {
      long double g = s * p->gradient_coefficients[q * n + c];
      out.v -= g * f[1] * d[c];
      out.size += fabsl(g * f[1] * d[c]);
      for (unsigned a = 0; a < n; a++) {
        out.g[a] -= g * (f[1] * (a == c) + f[2] * d[a] * d[c]);
        for (unsigned b = 0; b < n; b++)
          out.h[a][b] -=
              g * (f[2] * ((a == b) * d[c] + (a == c) * d[b] + (b == c) * d[a]) + f[3] * d[a] * d[b] * d[c]);
      }
    }
    q++;
  }
  for (unsigned a = 0; a < n; a++) {
    out.g[a] /= p->scale;
    for (unsigned b = 0; b < n; b++) out.h[a][b] /= (long double)p->scale * p->scale;
  }
  batten_polynomial basis = batten_polynomial_basis(n, p->m - 1);
  double y[3] = {0}, sums[10];
  for (unsigned a = 0; a < n; a++) y[a] = (x[a] - p->origin[a]) / p->scale;
  batten_polynomial_sum(&basis, p->polynomial, y, 2, sums);
  static const int at[3][3] = {{4, 5, 6}, {5, 7, 8}, {6, 8, 9}};
  out.v += sums[0];
  for (unsigned a = 0; a < n; a++) {
    out.g[a] += sums[1 + a] / p->scale;
    for (unsigned b = 0; b < n; b++) out.h[a][b] += sums[at[a][b]] / p->scale / p->scale;
  }
  return out;
}

typedef struct result {
  double v[POINTS], g[POINTS * 3], h[POINTS * 9];
} result;

static void test_reference(batten_context *ctx, unsigned n, unsigned m) {
  static scene sc;
  static result got;
  make_scene(&sc, n, m, 10 * n + m);
  batten_spline *s = NULL;
  if (batten_spline_create(ctx, &sc.parts, &s) != BATTEN_OK) {
    T_CHECK(false, "create: %s", batten_error(ctx));
    return;
  }
  /* Every 20th point is a centre with gradient data, every 20th a centre without. */
  for (size_t i = 0; i < POINTS; i += 10) {
    size_t c = sc.gradient_at[i / 10 % GRADIENTS] + (i / 10) % 2;
    memcpy(sc.points + i * n, sc.centers + c * n, n * sizeof(double));
  }
  batten_spline_evaluate(ctx, s, POINTS, sc.points, got.v, got.g, got.h);
  double worst[3] = {0}, size[3] = {0}, asymmetry = 0;
  for (size_t i = 0; i < POINTS; i++) {
    jet want = reference(&sc.parts, sc.points + i * n);
    worst[0] = fmax(worst[0], (double)(fabsl(got.v[i] - want.v) / want.size));
    for (unsigned a = 0; a < n; a++) {
      worst[1] = fmax(worst[1], (double)fabsl(got.g[i * n + a] - want.g[a]));
      size[1] = fmax(size[1], fabs(got.g[i * n + a]));
      for (unsigned b = 0; b < n; b++) {
        double h = got.h[(i * n + a) * n + b];
        worst[2] = fmax(worst[2], (double)fabsl(h - want.h[a][b]) / fmax(1, fabs(h)));
        asymmetry = fmax(asymmetry, fabs(h - got.h[(i * n + b) * n + a]));
      }
    }
  }
  T_RATIO(worst[0], 1e-14, "n = %u, m = %u: values against long double, relative to the sum of the terms", n, m);
  T_RATIO(worst[1] / size[1], 1e-14, "n = %u, m = %u: gradients", n, m);
  /* Near a centre second derivatives of r^1 grow like 1/r and pass on the rounding of r. */
  T_RATIO(worst[2], 1e-12, "n = %u, m = %u: Hessians", n, m);
  T_CHECK(asymmetry == 0, "n = %u, m = %u: Hessians symmetric to the bit", n, m);
  batten_spline_free(s);
}

/* Central differences of values and gradients away from the centres. */
static void test_differences(batten_context *ctx, unsigned n, unsigned m) {
  static scene sc;
  make_scene(&sc, n, m, 77 + 10 * n + m);
  batten_spline *s = NULL;
  batten_spline_create(ctx, &sc.parts, &s);
  const double h = 1e-4;
  double worst[2] = {0}, size[2] = {0};
  for (size_t i = 0; i < 40; i++) {
    const double *x = sc.points + i * n;
    double g[3], hessian[9], nearest = INFINITY;
    for (size_t c = 0; c < CENTRES; c++) {
      double d2 = 0;
      for (unsigned a = 0; a < n; a++) d2 += pow(x[a] - sc.centers[c * n + a], 2);
      nearest = fmin(nearest, sqrt(d2));
    }
    if (nearest < 100 * h) continue;
    batten_spline_evaluate(ctx, s, 1, x, NULL, g, hessian);
    for (unsigned a = 0; a < n; a++) {
      double y[6], v[2], dg[6];
      for (unsigned b = 0; b < n; b++) y[b] = y[n + b] = x[b];
      y[a] -= h;
      y[n + a] += h;
      batten_spline_evaluate(ctx, s, 2, y, v, dg, NULL);
      worst[0] = fmax(worst[0], fabs((v[1] - v[0]) / (2 * h) - g[a]));
      size[0] = fmax(size[0], fabs(g[a]));
      for (unsigned b = 0; b < n; b++) {
        worst[1] = fmax(worst[1], fabs((dg[n + b] - dg[b]) / (2 * h) - hessian[a * n + b]));
        size[1] = fmax(size[1], fabs(hessian[a * n + b]));
      }
    }
  }
  T_RATIO(worst[0] / size[0], 1e-4, "n = %u, m = %u: gradients against differences", n, m);
  T_RATIO(worst[1] / fmax(size[1], 1e-3), 1e-4, "n = %u, m = %u: Hessians against differences", n, m);
  batten_spline_free(s);
}

/* ---- same bits ---- */

static void test_batches(unsigned n, unsigned m) {
  static scene sc;
  static result all, other;
  batten_context *ctx = t_context(NULL, NULL, 1);
  make_scene(&sc, n, m, 5);
  batten_spline *s = NULL;
  batten_spline_create(ctx, &sc.parts, &s);
  batten_spline_evaluate(ctx, s, POINTS, sc.points, all.v, all.g, all.h);
  for (size_t i = 0, step = 1; i < POINTS; i += step, step = step * 2 % 37 + 1) {
    size_t count = i + step < POINTS ? step : POINTS - i;
    batten_spline_evaluate(ctx, s, count, sc.points + i * n, other.v + i, other.g + i * n, other.h + i * n * n);
  }
  bool same = !memcmp(all.v, other.v, sizeof all.v) && !memcmp(all.g, other.g, POINTS * n * sizeof(double)) &&
              !memcmp(all.h, other.h, POINTS * n * n * sizeof(double));
  memset(&other, 0, sizeof other);
  batten_spline_evaluate(ctx, s, POINTS, sc.points, other.v, NULL, NULL);
  same = same && !memcmp(all.v, other.v, sizeof all.v);
  batten_spline_evaluate(ctx, s, POINTS, sc.points, NULL, other.g, NULL);
  same = same && !memcmp(all.g, other.g, POINTS * n * sizeof(double));
  T_CHECK(same, "n = %u, m = %u: same bits in any batch, with and without derivatives", n, m);

  batten_spline_parts parts;
  batten_spline *again = NULL;
  batten_spline_get_parts(s, &parts);
  batten_spline_create(ctx, &parts, &again);
  batten_spline_free(s);
  batten_spline_evaluate(ctx, again, POINTS, sc.points, other.v, other.g, other.h);
  T_CHECK(!memcmp(all.v, other.v, sizeof all.v) && !memcmp(all.h, other.h, POINTS * n * n * sizeof(double)),
          "n = %u, m = %u: same bits through parts", n, m);
  batten_spline_free(again);
  batten_context_free(ctx);
}

static void test_threads(void) {
  enum { MANY = 3000 };
  static scene sc;
  static double points[MANY * 3], one[MANY * 4], v[MANY * 4];
  uint64_t seed = 3;
  make_scene(&sc, 3, 3, 6);
  for (size_t i = 0; i < MANY * 3; i++) points[i] = 100 * t_uniform(&seed);
  for (unsigned threads = 1; threads <= 8; threads++) {
    batten_context *ctx = t_context(NULL, NULL, threads);
    batten_spline *s = NULL;
    batten_spline_create(ctx, &sc.parts, &s);
    double *to = threads == 1 ? one : v;
    batten_spline_evaluate(ctx, s, MANY, points, to, to + MANY, NULL);
    if (threads > 1) T_CHECK(!memcmp(one, v, sizeof v), "same bits on %u threads", threads);
    batten_spline_free(s);
    batten_context_free(ctx);
  }
}

/* Every compiled instruction set, called directly: sums and tiles. */
static void test_instruction_sets(void) {
  static scene sc;
  unsigned codes = 0;
  while (batten_spline_code_at(codes)) codes++;
  printf("# this processor runs %u of the compiled codes, and takes %s\n", codes, batten_spline_code()->name);
  T_CHECK(codes >= 1 && !strcmp(batten_spline_code_at(codes - 1)->name, "baseline"), "the baseline is always there");
  for (unsigned index = 0; index + 1 < codes; index++) {
    const spline_code *code = batten_spline_code_at(index), *baseline = batten_spline_code_at(codes - 1);
    bool same = true, tiles = true;
    for (unsigned n = 1; n <= 3; n++)
      for (unsigned m = 1; m <= 4; m++) {
        if (!batten_green_exists(n, m)) continue;
        make_scene(&sc, n, m, 9);
        const double *x = sc.coefficients, *y = sc.polynomial;
        const size_t hermite = sc.parts.gradient_count;
        spline_terms t = {.n = n,
                          .power = 2 * m - n,
                          .plain = CENTRES - 30 - hermite,
                          .hermite = hermite,
                          .x = {x, x + 10, x + 20},
                          .w = x + 30,
                          .g = {x + 7, x + 3, x}};
        for (unsigned order = 0; order < 3; order++) {
          double at[3][SPLINE_LANES], a[SPLINE_SUMS][SPLINE_LANES] = {{0}}, b[SPLINE_SUMS][SPLINE_LANES] = {{0}};
          for (unsigned i = 0; i < SPLINE_LANES; i++)
            for (unsigned axis = 0; axis < 3; axis++) at[axis][i] = i == 3 ? x[axis * 10] : y[i + axis];
          code->sum(&t, order, at, a);
          baseline->sum(&t, order, at, b);
          same = same && !memcmp(a, b, sizeof a);
        }
        for (int r = -1; r < (hermite ? (int)n : 0); r++)
          for (int c = -1; c < (hermite ? (int)n : 0); c++) {
            double a[19 * 11], b[19 * 11], mirror[19 * 11];
            spline_tile tile = {.n = n,
                                .power = 2 * m - n,
                                .row_axis = r,
                                .col_axis = c,
                                .rows = 19,
                                .cols = 11,
                                .row_x = {x, x + 20, x + 40},
                                .col_x = {x + 60, x + 80, x + 100},
                                .tile = a,
                                .ld = 19};
            code->tile(&tile);
            tile.tile = b;
            baseline->tile(&tile);
            tiles = tiles && !memcmp(a, b, sizeof a);
            tile = (spline_tile){.n = n,
                                 .power = 2 * m - n,
                                 .row_axis = c,
                                 .col_axis = r,
                                 .rows = 11,
                                 .cols = 19,
                                 .row_x = {x + 60, x + 80, x + 100},
                                 .col_x = {x, x + 20, x + 40},
                                 .tile = mirror,
                                 .ld = 11};
            code->tile(&tile);
            for (int i = 0; i < 19; i++)
              for (int j = 0; j < 11; j++) tiles = tiles && a[i + 19 * j] == mirror[j + 11 * i];
          }
      }
    T_CHECK(same, "%s: sums have the bits of the baseline, all kernels and orders", code->name);
    T_CHECK(tiles, "%s: tiles have the bits of the baseline and are symmetric to the bit", code->name);
  }
}

/* ---- edges ---- */

static void test_edges(batten_context *ctx) {
  /* One centre, -r with weight 2 in the unit box of side 4: U = -2 |x - c| / 4 + 7. */
  batten_spline_parts p = {.struct_size = sizeof p,
                           .n = 3,
                           .m = 2,
                           .count = 1,
                           .centers = (double[]){1, 2, 3},
                           .coefficients = (double[]){2},
                           .polynomial_count = 4,
                           .polynomial = (double[]){7, 0, 0, 0},
                           .origin = {1, 2, 3},
                           .scale = 4};
  batten_spline *s = NULL;
  T_OK(batten_spline_create(ctx, &p, &s), ctx);
  double v[3], g[9], h[27], x[9] = {1, 2, 7, 1, 2, 3, NAN, 0, 0};
  T_OK(batten_spline_evaluate(ctx, s, 3, x, v, g, h), ctx);
  T_CHECK(v[0] == 5 && g[0] == 0 && g[1] == 0 && g[2] == -0.5, "one centre by hand: %g, gradient %g %g %g", v[0],
          g[0], g[1], g[2]);
  T_CHECK(h[0] == -0.125 && h[4] == -0.125 && h[8] == 0, "its Hessian: -1/8, -1/8, 0");
  T_CHECK(v[1] == 7 && g[3] == 0 && g[5] == 0 && h[9] == 0, "at the centre its term is 0, and its derivatives are");
  T_CHECK(isnan(v[2]) && isnan(g[6]) && isnan(g[8]) && isnan(h[26]), "NaN in, NaN out, in every number");
  T_OK(batten_spline_evaluate(ctx, s, 0, NULL, NULL, NULL, NULL), ctx);
  T_OK(batten_spline_evaluate(ctx, s, 3, x, NULL, NULL, NULL), ctx);
  T_STATUS(batten_spline_evaluate(ctx, s, 3, NULL, v, NULL, NULL), BATTEN_E_INVALID, ctx, "points: NULL");
  T_STATUS(batten_spline_evaluate(ctx, NULL, 3, x, v, NULL, NULL), BATTEN_E_INVALID, ctx, "s: NULL");
  T_CHECK(batten_spline_evaluate(NULL, s, 3, x, v, NULL, NULL) == BATTEN_E_INVALID &&
              batten_spline_create(NULL, &p, &s) == BATTEN_E_INVALID,
          "no context is refused");
  batten_field f = batten_spline_field(s);
  T_OK(f.evaluate(f.user, ctx, 1, x, v, NULL, NULL), ctx);
  T_CHECK(f.dimension == 3 && f.order == 2 && v[0] == 5, "as a field");
  T_CHECK(batten_spline_retain(s) == s && !batten_spline_retain(NULL), "retain");
  batten_spline_free(s);
  T_CHECK(batten_bytes_in_use(ctx) > 0, "one owner of two gone");
  batten_spline_free(s);
  batten_spline_free(NULL);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all owners gone");

  p.count = 0;
  T_OK(batten_spline_create(ctx, &p, &s), ctx);
  T_OK(batten_spline_evaluate(ctx, s, 1, x, v, NULL, NULL), ctx);
  T_CHECK(v[0] == 7, "no centre at all: the polynomial");
  batten_spline_free(s);
}

static void test_bad_parts(batten_context *ctx) {
  static scene sc;
  batten_spline *s = NULL;
  make_scene(&sc, 3, 3, 1);
  batten_spline_parts good = sc.parts, p = good;
  T_STATUS(batten_spline_create(ctx, NULL, &s), BATTEN_E_INVALID, ctx, "parts: NULL");
  T_STATUS(batten_spline_create(ctx, &p, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  p.struct_size = 0;
  T_STATUS(batten_spline_create(ctx, &p, &s), BATTEN_E_INVALID, ctx, "struct_size: 0");
  p = good, p.m = 1;
  T_STATUS(batten_spline_create(ctx, &p, &s), BATTEN_E_INVALID, ctx, "parts.n = 3, parts.m = 1");
  p = good, p.n = 4;
  T_STATUS(batten_spline_create(ctx, &p, &s), BATTEN_E_INVALID, ctx, "parts.n = 4");
  p = good, p.m = 0;
  T_STATUS(batten_spline_create(ctx, &p, &s), BATTEN_E_INVALID, ctx, "parts.m = 0");
  p = good, p.polynomial_count = 4;
  T_STATUS(batten_spline_create(ctx, &p, &s), BATTEN_E_INVALID, ctx, "polynomial_count: 4; 10");
  p = good, p.gradient_count = CENTRES + 1;
  T_STATUS(batten_spline_create(ctx, &p, &s), BATTEN_E_INVALID, ctx, "gradient_count: 151");
  p = good, p.m = 2, p.polynomial_count = 4;
  T_STATUS(batten_spline_create(ctx, &p, &s), BATTEN_E_INVALID, ctx, "gradients need 2m - n > 2");
  p = good, p.coefficients = NULL;
  T_STATUS(batten_spline_create(ctx, &p, &s), BATTEN_E_INVALID, ctx, "an array is NULL");
  p = good, p.count = SIZE_MAX / 4, p.gradient_count = 0;
  T_STATUS(batten_spline_create(ctx, &p, &s), BATTEN_E_TOO_LARGE, ctx, "parts.count");
  p = good, p.scale = 0;
  T_STATUS(batten_spline_create(ctx, &p, &s), BATTEN_E_INVALID, ctx, "parts.scale: 0");
  p = good, p.origin[1] = INFINITY;
  T_STATUS(batten_spline_create(ctx, &p, &s), BATTEN_E_INVALID, ctx, "parts.origin[1]: inf");
  double keep = sc.coefficients[17];
  sc.coefficients[17] = NAN;
  T_STATUS(batten_spline_create(ctx, &good, &s), BATTEN_E_INVALID, ctx, "parts.coefficients[17]: nan");
  sc.coefficients[17] = keep;
  size_t at = sc.gradient_at[2];
  sc.gradient_at[2] = sc.gradient_at[1];
  T_STATUS(batten_spline_create(ctx, &good, &s), BATTEN_E_INVALID, ctx, "gradient_at[2]: 4; must increase");
  sc.gradient_at[2] = at;
  T_CHECK(!s, "nothing was made");
}

static batten_status create_once(batten_context *ctx, void *arg) {
  batten_spline *s = NULL;
  batten_status st = batten_spline_create(ctx, &((scene *)arg)->parts, &s);
  batten_spline_free(s);
  return st;
}

/* Enough points for three pieces of a long batch: 3 * 64e6 / 20000 centres. */
enum { LONG_CENTRES = 20000, LONG_POINTS = 7000 };
static batten_status evaluate_long(batten_context *ctx, void *arg) {
  double *x = arg, *values = x + 3 * LONG_CENTRES + LONG_CENTRES;
  batten_spline_parts p = {.struct_size = sizeof p,
                           .n = 3,
                           .m = 2,
                           .count = LONG_CENTRES,
                           .centers = x,
                           .coefficients = x + 3 * LONG_CENTRES,
                           .polynomial_count = 4,
                           .polynomial = (double[]){0, 0, 0, 0},
                           .scale = 1};
  batten_spline *s = NULL;
  batten_status st = batten_spline_create(ctx, &p, &s);
  if (st == BATTEN_OK) st = batten_spline_evaluate(ctx, s, LONG_POINTS, x, values, NULL, NULL);
  batten_spline_free(s);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  for (unsigned n = 1; n <= 3; n++)
    for (unsigned m = 1; m <= 4; m++) {
      if (!batten_green_exists(n, m)) continue;
      test_reference(ctx, n, m);
      test_differences(ctx, n, m);
      test_batches(n, m);
    }
  test_threads();
  test_instruction_sets();
  test_edges(ctx);
  test_bad_parts(ctx);
  batten_context_free(ctx);
  static scene sc;
  make_scene(&sc, 3, 3, 1);
  t_fail_every_allocation("batten_spline_create", create_once, &sc);
  static double x[4 * LONG_CENTRES + LONG_POINTS];
  uint64_t seed = 2;
  for (size_t i = 0; i < 4 * LONG_CENTRES; i++) x[i] = t_uniform(&seed);
  t_cancel_every_progress("batten_spline_evaluate", evaluate_long, x);
  return t_done();
}
