/* The proof of convexity: it must hold for what is convex and never for what is not. Judged by samples in long double
 * from de Boor's algorithm, which shares no code with it. */
#include <batten/surface.h>
#include <float.h>

#include "surface/certify.h"
#include "tap.h"

enum { ORDER = BATTEN_SURFACE_DEGREE_MAX + 1, SPANS = 3, POINTS = ORDER * SPANS };

/* A surface with room of its own. */
typedef struct scene {
  unsigned degree[2];
  size_t count[2];
  double knots[2][POINTS + ORDER], points[POINTS * POINTS][3];
} scene;

static batten_surface *surface_of(batten_context *ctx, const scene *s) {
  batten_surface_form form = {.degree = {s->degree[0], s->degree[1]},
                              .knot_count = {s->count[0] + s->degree[0] + 1, s->count[1] + s->degree[1] + 1},
                              .knots = {s->knots[0], s->knots[1]},
                              .control_points = s->points[0]};
  batten_surface *out = NULL;
  if (batten_surface_create(ctx, &form, &out) != BATTEN_OK) printf("# %s\n", batten_error(ctx));
  return out;
}

static void bezier_axis(scene *s, int axis, unsigned degree) {
  s->degree[axis] = degree;
  s->count[axis] = degree + 1;
  for (unsigned k = 0; k < 2 * (degree + 1); k++) s->knots[axis][k] = k > degree;
}

/* ---- evaluation that knows nothing of the kernel ------------------------------------------------- */

/* De Boor's algorithm and its derivatives: the functions of the span of t, table [3][degree + 1]; returns the first
 * one's index. */
static size_t basis_at(const scene *s, int axis, long double t, long double table[3][ORDER]) {
  const double *knots = s->knots[axis];
  unsigned d = s->degree[axis];
  size_t mu = d;
  while (mu + 1 < s->count[axis] && t >= (long double)knots[mu + 1]) mu++;
  for (unsigned j = 0; j <= d; j++)
    for (unsigned order = 0; order < 3; order++) {
      long double c[ORDER] = {0};
      c[j] = 1;
      for (unsigned r = 1; r <= d; r++)
        for (unsigned i = d; i >= r; i--) {
          long double a = knots[mu - d + i], b = knots[mu + i + 1 - r], length = b - a;
          bool difference = order <= d && r > d - order; /* a round with a direction in place of t */
          c[i] = difference ? (c[i] - c[i - 1]) / length : ((b - t) * c[i - 1] + (t - a) * c[i]) / length;
        }
      long double factor = 1;
      for (unsigned k = 0; k < order; k++) factor *= (long double)d - k;
      table[order][j] = order > d ? 0 : factor * c[d];
    }
  return mu - d;
}

typedef struct sample {
  long double l, m, n, d, v, gauss, cross[3];
} sample;

static sample sample_at(const scene *s, long double u, long double v) {
  static const int order[5][2] = {{1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}};
  long double bu[3][ORDER], bv[3][ORDER], x[5][3] = {{0}}, *c;
  size_t iu = basis_at(s, 0, u, bu), iv = basis_at(s, 1, v, bv);
  for (unsigned i = 0; i <= s->degree[0]; i++)
    for (unsigned j = 0; j <= s->degree[1]; j++)
      for (int k = 0; k < 5; k++)
        for (int d = 0; d < 3; d++)
          x[k][d] += bu[order[k][0]][i] * bv[order[k][1]][j] * s->points[(iu + i) * s->count[1] + iv + j][d];
  sample out = {0};
  c = out.cross;
  for (int d = 0; d < 3; d++) c[d] = x[0][(d + 1) % 3] * x[1][(d + 2) % 3] - x[0][(d + 2) % 3] * x[1][(d + 1) % 3];
  for (int d = 0; d < 3; d++) {
    out.l += x[2][d] * c[d];
    out.m += x[3][d] * c[d];
    out.n += x[4][d] * c[d];
    out.v += c[d] * c[d];
  }
  out.d = out.l * out.n - out.m * out.m;
  out.v *= out.v;
  out.gauss = out.d / out.v;
  return out;
}

/* Least Gaussian curvature on a grid of a part of the domain. */
static double least_within(const scene *s, int grid, const double lower[2], const double upper[2]) {
  long double least = INFINITY;
  for (int i = 0; i <= grid; i++)
    for (int j = 0; j <= grid; j++) {
      long double a = (long double)i / grid, b = (long double)j / grid;
      sample p = sample_at(s, lower[0] * (1 - a) + upper[0] * a, lower[1] * (1 - b) + upper[1] * b);
      if (p.gauss < least) least = p.gauss;
    }
  return (double)least;
}
static double least_gauss(const scene *s, int grid) {
  return least_within(s, grid, (const double[2]){s->knots[0][0], s->knots[1][0]},
                      (const double[2]){s->knots[0][s->count[0]], s->knots[1][s->count[1]]});
}

/* ---- scenes --------------------------------------------------------------------------------------- */

static double choose(unsigned n, unsigned k) {
  double out = 1;
  for (unsigned i = 0; i < k; i++) out = out * (n - i) / (i + 1);
  return out;
}

enum { MONOMIALS = 5 };
/* The graph of sum a[k][l] u^k v^l over [0, 1]^2. */
static scene graph(unsigned m, unsigned n, const double a[MONOMIALS][MONOMIALS]) {
  static scene s;
  bezier_axis(&s, 0, m);
  bezier_axis(&s, 1, n);
  for (unsigned i = 0; i <= m; i++)
    for (unsigned j = 0; j <= n; j++) {
      double *p = s.points[i * (n + 1) + j];
      p[0] = (double)i / m;
      p[1] = (double)j / n;
      p[2] = 0;
      for (unsigned k = 0; k < MONOMIALS && k <= i; k++)
        for (unsigned l = 0; l < MONOMIALS && l <= j; l++)
          if (k <= m && l <= n) p[2] += a[k][l] * choose(i, k) / choose(m, k) * choose(j, l) / choose(n, l);
    }
  return s;
}

static scene paraboloid(unsigned m, unsigned n) {
  return graph(m, n, (const double[MONOMIALS][MONOMIALS]){{0, 0.3, 0.5}, {-0.5, 0.25}, {0.75}});
}

/* A net around an ellipsoid, the angles a and b to both sides, moved by noise. */
static scene cap(unsigned m, unsigned n, double a, double b, double noise, uint64_t *seed) {
  static scene s;
  bezier_axis(&s, 0, m);
  bezier_axis(&s, 1, n);
  for (unsigned i = 0; i <= m; i++)
    for (unsigned j = 0; j <= n; j++) {
      double *p = s.points[i * (n + 1) + j], x = a * (2.0 * i / m - 1), y = b * (2.0 * j / n - 1);
      p[0] = 2 * sin(x) * cos(y);
      p[1] = 1.5 * sin(y);
      p[2] = cos(x) * cos(y);
      for (int d = 0; d < 3 && seed; d++) p[d] += noise * (2 * t_uniform(seed) - 1);
    }
  return s;
}

static batten_convexity prove(batten_context *ctx, const scene *s, const batten_convexity_options *opt) {
  batten_convexity c = {.certified = -1};
  batten_surface *surface = surface_of(ctx, s);
  if (batten_surface_certify_convex(ctx, surface, opt, &c) != BATTEN_OK) printf("# %s\n", batten_error(ctx));
  batten_surface_free(surface);
  return c;
}

/* ---- convex ones ----------------------------------------------------------------------------------- */

/* z = 0.75 u^2 + 0.25 u v + 0.5 v^2 - 0.5 u + 0.3 v: K = (4 0.75 0.5 - 0.25^2) / (1 + z_u^2 + z_v^2)^2 is least at
 * (1, 1), with z_u = 1.25, z_v = 1.55. */
static void test_by_hand(batten_context *ctx) {
  static const unsigned degrees[6][2] = {{2, 2}, {2, 5}, {3, 3}, {5, 4}, {7, 7}, {9, 9}};
  double least = (1.5 - 0.0625) / pow(1 + 1.25 * 1.25 + 1.55 * 1.55, 2);
  for (int k = 0; k < 6; k++) {
    scene s = paraboloid(degrees[k][0], degrees[k][1]);
    batten_convexity c = prove(ctx, &s, NULL);
    T_CHECK(c.certified && c.sign == 1 && !c.flat && c.unproven == 0 && c.graph, "paraboloid of degree (%u, %u)",
            degrees[k][0], degrees[k][1]);
    T_CHECK(c.margin_min > 0.9 * least && c.margin_min < least && c.worst_at[0] == 1 && c.worst_at[1] == 1,
            "K > %.5f, it is %.5f; %zu boxes", c.margin_min, least, c.boxes);
    T_CHECK(c.direction[2] > 0.3 && fabs(hypot(hypot(c.direction[0], c.direction[1]), c.direction[2]) - 1) < 1e-15,
            "seen from %.3f %.3f %.3f", c.direction[0], c.direction[1], c.direction[2]);
  }
}

static void test_caps(batten_context *ctx) {
  uint64_t seed = 11;
  for (unsigned m = 2; m <= 9; m++) {
    scene s = cap(m, m < 9 ? m + 1 : 3, 0.9, 0.7, 0, NULL);
    batten_convexity c = prove(ctx, &s, NULL);
    double least = least_gauss(&s, 60);
    T_CHECK(c.certified && c.sign == -1 && c.margin_min > 0.9 * least && c.margin_min < least,
            "ellipsoid of degree %u: K > %.5f of %.5f; %zu boxes, depth %u", m, c.margin_min, least, c.boxes,
            c.depth);
  }
  /* Beyond a half turn: convex in the small, but nothing sees all of it. */
  scene s = cap(9, 5, 2.4, 0.5, 0, &seed);
  batten_convexity c = prove(ctx, &s, NULL);
  T_CHECK(c.certified && !c.graph && c.direction[0] == 0 && c.direction[2] == 0, "wrapped around: K > %.4f, no graph",
          c.margin_min);
}

/* f_uu = 16 + v^2, f_vv = (v - v0)^2 + (u - u0)^2 + bottom, f_uv = 2 (u - u0) v: the determinant is 16 bottom at the
 * place, and larger everywhere else. */
static scene spot(double bottom) {
  const double u0 = 0.37, v0 = 0.61;
  double a[MONOMIALS][MONOMIALS] = {{0}};
  a[2][0] = 8;
  a[2][2] = 0.5;
  a[1][2] = -u0;
  a[0][2] = 0.5 * (u0 * u0 + v0 * v0 + bottom);
  a[0][3] = -v0 / 3;
  a[0][4] = 1 / 12.;
  return graph(2, 4, (const double(*)[MONOMIALS])a);
}

static void test_spots(batten_context *ctx) {
  for (int k = 2; k <= 14; k++) {
    double depth = pow(10, -k);
    scene s = spot(-depth);
    batten_convexity c = prove(ctx, &s, NULL);
    T_CHECK(!c.certified && c.unproven > 0 && c.margin_min <= 0,
            "a spot of radius 1e-%.1f with K < 0 is refused: K = %.2g at %.5f %.5f, %zu boxes", 0.5 * k, c.margin_min,
            c.worst_at[0], c.worst_at[1], c.boxes);
    s = spot(depth);
    c = prove(ctx, &s, NULL);
    double r = fmin(0.3, 60 * depth); /* the metric moves the minimum by about 15 depth */
    double least = fmin(least_gauss(&s, 50), least_within(&s, 60, (const double[2]){0.37 - r, 0.61 - r},
                                                          (const double[2]){0.37 + r, 0.61 + r}));
    if (k > 9) continue; /* rounding of the control points may have the better of it */
    T_CHECK(c.certified && c.margin_min > 0.9 * least * (1 - 1e-3) && c.margin_min < least,
            "and one of K > 0 too: K > %.3g of %.3g, %zu boxes, depth %u", c.margin_min, least, c.boxes, c.depth);
  }
}

/* K is within doubles, the square of the unit in which it was proven is not. */
static void test_tiny(batten_context *ctx) {
  scene s = graph(3, 3, (const double[MONOMIALS][MONOMIALS]){{0, 0, 0.5e-4}, {0}, {0.5e-4}}), t = s;
  for (size_t i = 0; i < 16; i++)
    for (int x = 0; x < 3; x++) t.points[i][x] = ldexp(t.points[i][x], -514);
  batten_convexity c = prove(ctx, &s, NULL), tiny = prove(ctx, &t, NULL);
  T_CHECK(tiny.certified && tiny.margin_min == ldexp(c.margin_min, 1028) && tiny.margin_min < INFINITY,
          "K > %.3g of a surface of size 2^-514", tiny.margin_min);
}

/* Nearly cylinders: certified as long as that can be told. */
static void test_nearly_flat(batten_context *ctx) {
  for (int k = 2; k <= 20; k += 3) {
    double small = pow(10, -k);
    scene s = graph(3, 3, (const double[MONOMIALS][MONOMIALS]){{0, 0, 0.5 * small}, {0}, {0.5}});
    batten_convexity c = prove(ctx, &s, NULL);
    double least = small / 4; /* at u = 1 */
    T_CHECK(k <= 8   ? c.certified && c.margin_min > 0.89 * least && c.margin_min < least * (1 + 1e-6)
            : k > 17 ? !c.certified
                     : !c.certified || c.margin_min > 0,
            "K = %.1g: %s, K > %.3g", least, c.certified ? "certified" : "not certified", c.margin_min);
  }
}

static void test_not_convex(batten_context *ctx) {
  static const struct {
    const char *what;
    double a[MONOMIALS][MONOMIALS];
    int flat;
  } cases[] = {
      {"saddle", {{0, 0, -1}, {0}, {1}}, 0},
      {"twisted", {{0}, {0, 1}}, 0},
      {"cylinder", {{0}, {0}, {1}}, 0},
      {"plane", {{0.1, 0.3}, {-0.7}}, 1},
      {"plane of thirds", {{1 / 3., 1 / 7.}, {-1 / 9.}}, 1},
      {"quartic bottom", {{0, 0, 0, 0, 1}, {0}, {1}}, 0},
      {"inflection", {{0, 0, 1}, {0}, {-0.5}, {1 / 3.}}, 0},
  };
  for (size_t k = 0; k < sizeof cases / sizeof *cases; k++)
    for (unsigned m = 4; m <= 6; m++) {
      scene s = graph(m, 4, cases[k].a);
      batten_convexity c = prove(ctx, &s, NULL);
      T_CHECK(!c.certified && c.flat == cases[k].flat && c.margin_min <= 0 && c.sign == 0 && c.graph,
              "%s of degree %u is not: K = %.3g, flat %d, %zu boxes", cases[k].what, m, c.margin_min, c.flat,
              c.boxes);
      if (!cases[k].flat) continue;
      for (size_t i = 0; i < s.count[0] * s.count[1]; i++) { /* turned and far away: flat to rounding of its points */
        double x = s.points[i][0], z = s.points[i][2];
        s.points[i][0] = 0.8 * x - 0.6 * z + 100;
        s.points[i][2] = 0.6 * x + 0.8 * z - 1000 / 3.;
      }
      c = prove(ctx, &s, NULL);
      T_CHECK(!c.certified && c.flat, "and turned, far from the origin, still flat");
    }
}

/* ---- at random ------------------------------------------------------------------------------------- */

static void test_random(batten_context *ctx) {
  size_t certified = 0, convex = 0, wrong = 0, missed = 0, low = 0, boxes = 0, most = 0;
  uint64_t seed = 5;
  for (int k = 0; k < 240; k++) {
    unsigned m = 2 + (unsigned)(t_random(&seed) % 4), n = 2 + (unsigned)(t_random(&seed) % 4);
    double a = 0.3 + t_uniform(&seed), b = 0.3 + 0.7 * t_uniform(&seed), noise = 0.2 * pow(t_uniform(&seed), 2);
    scene s = cap(m, n, a, b, noise, &seed);
    batten_convexity c = prove(ctx, &s, NULL);
    double least = least_gauss(&s, 25);
    certified += c.certified != 0;
    convex += least > 0;
    wrong += c.certified && !(least > c.margin_min);
    missed += !c.certified && least > 0.01;
    low += c.certified && c.margin_min < 0.85 * least; /* the grid is coarse */
    boxes += c.boxes;
    most = c.boxes > most ? c.boxes : most;
  }
  printf("# %zu certified, %zu without K <= 0 on the grid, %zu boxes, %zu at most\n", certified, convex, boxes, most);
  T_CHECK(certified > 80 && certified < 200, "of 240 surfaces %zu certified", certified);
  T_CHECK(wrong == 0, "%zu of them with a sample below what is proven", wrong);
  T_CHECK(missed == 0, "%zu with K > 0.01 on the grid are missed", missed);
  T_CHECK(low <= 3, "%zu whose bound is far below the grid's", low);
}

/* ---- coefficients ---------------------------------------------------------------------------------- */

/* L', M', N', x_u x x_v of the jet against samples; then D's coefficients after bisections. */
static void test_coefficients(batten_context *ctx) {
  static double room[CERTIFY_JET_DOUBLES], block[8][60 * 60];
  uint64_t seed = 3;
  for (unsigned m = 1; m <= 9; m += 2) {
    unsigned n = m == 9 ? 9 : m + 1;
    scene s = cap(m, n, 0.8, 0.9, 0.1, &seed);
    batten_surface *surface = surface_of(ctx, &s);
    certify_jet jet;
    certify_poly cross[3], form[3], d = {.c = block[6]};
    for (int k = 0; k < 3; k++) {
      cross[k].c = block[k];
      form[k].c = block[3 + k];
    }
    certify_jet_make(surface, m, n, 1, 0, room, &jet);
    certify_cross(jet.part[CERTIFY_U], jet.part[CERTIFY_V], cross);
    unsigned p = jet.degree[0], q = jet.degree[1];
    for (unsigned k = 0; k < 3; k++) {
      certify_clear(&form[k], 3 * p - 3 + k, 3 * q - 1 - k);
      for (int x = 0; x < 3; x++) certify_add_product(&form[k], 1, &jet.part[CERTIFY_UU + k][x], &cross[x], 3);
      certify_summed(&form[k]);
    }
    certify_clear(&d, 6 * p - 4, 6 * q - 4);
    certify_add_product(&d, 1, &form[0], &form[2], 2);
    certify_add_product(&d, -1, &form[1], &form[1], 2);
    certify_unscale(&d);
    double f = jet.factor[0], g = jet.factor[1], worst = 0;
    for (int k = 0; k < 50; k++) {
      double u = t_uniform(&seed), v = t_uniform(&seed);
      sample at = sample_at(&s, u, v);
      double exact[3] = {(double)at.l * f * f * f * g, (double)at.m * f * f * g * g, (double)at.n * f * g * g * g};
      for (int i = 0; i < 3; i++) {
        double off = fabs(certify_value(&form[i], true, u, v) - exact[i]);
        worst = fmax(worst, off / (form[i].error + 8 * DBL_EPSILON * form[i].most));
        off = fabs(certify_value(&cross[i], true, u, v) - (double)at.cross[i] * f * g);
        worst = fmax(worst, off / (cross[i].error + 8 * DBL_EPSILON * cross[i].most));
      }
      double off = fabs(certify_value(&d, false, u, v) - (double)at.d * pow(f, 4) * pow(g, 4));
      worst = fmax(worst, off / (d.error + 16 * DBL_EPSILON * d.most));
    }
    T_RATIO(worst, 1, "degree (%u, %u): values within their bounds", m, n);
    T_RATIO(d.error, 1e-11 * d.most, "which are %.2g of the largest coefficient", d.error / d.most);
    /* Halves, of halves, down to [3/8, 1/2] x [5/8, 3/4]. */
    static const int path[6] = {0, 1, 1, 0, 1, 0}, upper[6] = {0, 1, 0, 1, 1, 1};
    double low[2] = {0, 0}, high[2] = {1, 1};
    size_t rows = d.degree[0] + 1, columns = d.degree[1] + 1;
    certify_poly whole = d;
    static double copy[60 * 60];
    memcpy(copy, d.c, rows * columns * sizeof *copy);
    whole.c = copy;
    for (int k = 0; k < 6; k++) {
      certify_bisect((unsigned)path[k], 1, rows, columns, d.c, block[7], block[0]);
      double middle = 0.5 * (low[path[k]] + high[path[k]]);
      if (upper[k]) memcpy(d.c, block[7], rows * columns * sizeof *copy);
      *(upper[k] ? &low[path[k]] : &high[path[k]]) = middle;
    }
    worst = 0;
    for (int k = 0; k < 20; k++) {
      double u = t_uniform(&seed), v = t_uniform(&seed);
      double off = certify_value(&d, false, u, v) -
                   certify_value(&whole, false, low[0] + u * (high[0] - low[0]), low[1] + v * (high[1] - low[1]));
      worst = fmax(worst, fabs(off));
    }
    T_RATIO(worst, 60 * DBL_EPSILON * d.most, "and those of a part of it agree");
    batten_surface_free(surface);
  }
}

/* ---- knots ------------------------------------------------------------------------------------------ */

/* The same surface with one more knot [Boehm 1980]. */
static void insert_knot(scene *s, int axis, double t) {
  static scene old;
  old = *s;
  unsigned d = s->degree[axis];
  size_t mu = d, other = s->count[1 - axis];
  while (t >= s->knots[axis][mu + 1]) mu++;
  memmove(s->knots[axis] + mu + 2, s->knots[axis] + mu + 1, (s->count[axis] + d - mu) * sizeof(double));
  s->knots[axis][mu + 1] = t;
  s->count[axis]++;
  for (size_t i = 0; i < s->count[axis]; i++) {
    const double *k = old.knots[axis];
    double part = i <= mu - d ? 1 : i > mu ? 0 : (t - k[i]) / (k[i + d] - k[i]);
    for (size_t j = 0; j < other; j++)
      for (int x = 0; x < 3; x++) {
        size_t here = axis == 0 ? i * other + j : j * old.count[1] + i;
        size_t before = axis == 0 ? here - other : here - 1, to = axis == 0 ? here : j * s->count[1] + i;
        double a = part < 1 ? old.points[before][x] : 0, b = part > 0 ? old.points[here][x] : 0;
        s->points[to][x] = (1 - part) * a + part * b;
      }
  }
}

static void elevate_u(scene *s) {
  static scene old;
  old = *s;
  unsigned m = s->degree[0] + 1;
  bezier_axis(s, 0, m);
  for (unsigned i = 0; i <= m; i++)
    for (size_t j = 0; j < s->count[1]; j++)
      for (int x = 0; x < 3; x++) {
        double part = (double)i / m, a = i > 0 ? old.points[(i - 1) * s->count[1] + j][x] : 0;
        s->points[i * s->count[1] + j][x] = part * a + (i < m ? (1 - part) * old.points[i * s->count[1] + j][x] : 0);
      }
}

static void reverse_u(scene *s) {
  static scene old;
  old = *s;
  for (size_t i = 0; i < s->count[0]; i++)
    memcpy(s->points[i * s->count[1]], old.points[(s->count[0] - 1 - i) * s->count[1]],
           s->count[1] * sizeof *s->points);
}

static void swap_axes(scene *s) {
  static scene old;
  old = *s;
  for (int k = 0; k < 2; k++) {
    s->degree[k] = old.degree[1 - k];
    s->count[k] = old.count[1 - k];
    memcpy(s->knots[k], old.knots[1 - k], sizeof s->knots[k]);
  }
  for (size_t i = 0; i < s->count[0]; i++)
    for (size_t j = 0; j < s->count[1]; j++)
      memcpy(s->points[i * s->count[1] + j], old.points[j * old.count[1] + i], sizeof *s->points);
}

static void check_same(const char *what, batten_convexity a, batten_convexity b, double scale, int sign) {
  T_CHECK(b.certified && b.sign == sign * a.sign && b.graph == a.graph, "%s: certified, %zu boxes", what, b.boxes);
  T_RATIO(fabs(b.margin_min * scale - a.margin_min), 0.01 * a.margin_min, "%s: margin", what);
}

static void test_invariances(batten_context *ctx) {
  uint64_t seed = 21;
  scene s = cap(4, 3, 0.8, 0.9, 0.02, &seed), t;
  batten_convexity c = prove(ctx, &s, NULL), other;
  T_CHECK(c.certified && c.sign == -1 && c.graph, "a noisy cap, %zu boxes", c.boxes);
  for (int k = -900; k <= 900; k += 450) {
    t = s;
    for (size_t i = 0; i < t.count[0] * t.count[1]; i++)
      for (int x = 0; x < 3; x++) t.points[i][x] = ldexp(t.points[i][x], k);
    other = prove(ctx, &t, NULL);
    double expected = fmin(ldexp(c.margin_min, -2 * k), DBL_MAX); /* no K is larger than infinity */
    T_CHECK(other.certified && other.margin_min == expected && other.boxes == c.boxes &&
                memcmp(other.worst_at, c.worst_at, sizeof c.worst_at) == 0,
            "times 2^%d: the same bits", k);
  }
  t = s;
  for (size_t i = 0; i < t.count[0] * t.count[1]; i++) {
    const double *p = s.points[i];
    double q[3] = {0.8 * p[0] - 0.6 * p[1], 0.6 * p[0] + 0.8 * p[1], p[2]};
    memcpy(t.points[i], (double[3]){q[0] + 50, 0.8 * q[1] - 0.6 * q[2] - 70, 0.6 * q[1] + 0.8 * q[2] + 20}, 24);
  }
  check_same("turned and moved", c, prove(ctx, &t, NULL), 1, 1);
  t = s;
  reverse_u(&t);
  check_same("reversed", c, prove(ctx, &t, NULL), 1, -1);
  t = s;
  swap_axes(&t);
  check_same("swapped", c, prove(ctx, &t, NULL), 1, -1);
  t = s;
  elevate_u(&t);
  elevate_u(&t);
  check_same("raised", c, prove(ctx, &t, NULL), 1, 1);
  t = s;
  for (size_t k = 0; k < t.count[0] + t.degree[0] + 1; k++) t.knots[0][k] = 3 + 1e-5 * t.knots[0][k];
  check_same("of other parameters", c, prove(ctx, &t, NULL), 1, 1);
  t = s;
  insert_knot(&t, 0, 0.3);
  insert_knot(&t, 0, 0.3);
  insert_knot(&t, 1, 0.55);
  insert_knot(&t, 0, 0.31);
  insert_knot(&t, 1, 0.7);
  T_CHECK(t.count[0] == 8 && t.count[1] == 6 &&
              fabs((double)(sample_at(&t, 0.4, 0.6).d / sample_at(&s, 0.4, 0.6).d) - 1) < 1e-12,
          "knots inserted");
  check_same("with knots", c, prove(ctx, &t, NULL), 1, 1);
}

/* z = (u - 0.6)^3 + v^2 on two spans: a saddle left of the knot, convex right of it, K = 0 between. */
static void test_signs(batten_context *ctx) {
  scene s = graph(3, 3, (const double[MONOMIALS][MONOMIALS]){{0, 0, 1}, {1.08}, {-1.8}, {1}});
  batten_convexity_options o = batten_convexity_options_default();
  insert_knot(&s, 0, 0.6);
  insert_knot(&s, 0, 0.7);
  insert_knot(&s, 1, 0.5);
  signed char signs[3][2] = {{0, 0}, {0, 0}, {1, 1}};
  o.signs = signs[0];
  batten_convexity c = prove(ctx, &s, &o);
  T_CHECK(c.certified && c.sign == 1 && c.margin_min > 0, "the spans where it is convex: K > %.3g", c.margin_min);
  signs[2][1] = -1;
  c = prove(ctx, &s, &o);
  T_CHECK(!c.certified && c.sign == 0, "asked to be concave there it is not");
  signs[2][1] = 0;
  signs[0][1] = 1;
  c = prove(ctx, &s, &o);
  T_CHECK(!c.certified && c.margin_min < -0.05, "where it is a saddle it is not: K = %.3g", c.margin_min);
  memset(signs, 0, sizeof signs);
  c = prove(ctx, &s, &o);
  T_CHECK(c.certified && c.boxes == 0 && c.margin_min == 0 && c.sign == 0, "nothing asked, nothing missed");
  c = prove(ctx, &s, NULL);
  T_CHECK(!c.certified, "all of it is not");
  /* Two bowls, one upwards and one downwards, joined along a crease. */
  s = graph(2, 2, (const double[MONOMIALS][MONOMIALS]){{0, 0, 1}, {0}, {1}});
  insert_knot(&s, 0, 0.5);
  insert_knot(&s, 0, 0.5);
  for (size_t i = 3; i < 5; i++)
    for (size_t j = 0; j < 3; j++) s.points[i * 3 + j][2] = 9 - 20 * s.points[i * 3 + j][2];
  batten_convexity all = prove(ctx, &s, NULL);
  o.signs = (const signed char[2]){1, 0};
  c = prove(ctx, &s, &o);
  T_CHECK(c.certified && !all.certified, "of a bowl and what is no bowl the one");
}

/* z = (u - 1/2)^3: a cylinder that is concave first and convex then, for which only slack proves something. */
static void test_slack(batten_context *ctx) {
  scene s = graph(3, 2, (const double[MONOMIALS][MONOMIALS]){{0}, {0.75}, {-1.5}, {1}});
  batten_convexity_options o = batten_convexity_options_default();
  insert_knot(&s, 0, 0.5);
  const signed char right[2] = {-1, 1}, wrong[2] = {1, -1};
  for (int k = 1; k <= 10; k += 3) {
    o.slack = pow(10, -k);
    o.signs = right;
    batten_convexity c = prove(ctx, &s, &o);
    T_CHECK(c.certified && c.sign == 0 && c.margin_min > 0, "slack %.0e: concave, then convex; %zu boxes", o.slack,
            c.boxes);
    o.signs = wrong;
    c = prove(ctx, &s, &o);
    T_CHECK(!c.certified, "and not the other way round");
    o.signs = NULL;
    c = prove(ctx, &s, &o);
    T_CHECK(!c.certified, "nor of one sign");
  }
  o.slack = 3.01; /* L' is from -3 to 3 */
  T_CHECK(prove(ctx, &s, &o).certified, "slack of all there is");
  o.slack = 2.9;
  T_CHECK(!prove(ctx, &s, &o).certified, "and of less");
  o.slack = 1e-6;
  for (int sign = -1; sign <= 1; sign += 2) { /* one sign, whichever: a cylinder u^2 */
    s = graph(3, 2, (const double[MONOMIALS][MONOMIALS]){{0}, {0}, {sign}});
    for (size_t k = 0; k < s.count[0] + 4; k++) s.knots[0][k] *= 4; /* L' = 2 / 16 u', in these units */
    batten_convexity c = prove(ctx, &s, &o);
    T_CHECK(c.certified && c.sign == sign, "cylinder: sign %d", c.sign);
  }
}

/* ---- creases ---------------------------------------------------------------------------------------- */

/* Bowls of degree 2 on two spans in direction axis, whose slopes jump by `jump` (up or down) along the knot at 1/2.
 */
static scene roof(int axis, double jump, double bend) {
  scene s = graph(2, 2, (const double[MONOMIALS][MONOMIALS]){{0, 0.1, bend}, {0.2}, {bend}});
  insert_knot(&s, axis, 0.5);
  insert_knot(&s, axis, 0.5);
  for (size_t i = 0; i < s.count[0]; i++)
    for (size_t j = 0; j < s.count[1]; j++) {
      double *p = s.points[i * s.count[1] + j];
      p[2] += jump * fmax(p[axis] - 0.5, 0);
    }
  return s;
}

static void test_creases(batten_context *ctx) {
  for (int axis = 0; axis < 2; axis++)
    for (int sign = -1; sign <= 1; sign += 2)
      for (int k = 0; k <= 15; k += 3) {
        double jump = 2 * pow(10, -k) * sign;
        scene s = roof(axis, jump, 0.5 * sign);
        batten_convexity c = prove(ctx, &s, NULL);
        T_CHECK(c.certified && !c.creased && c.sign == sign, "slopes in %c that jump by %g, bent to %+d: convex",
                "uv"[axis], jump, sign);
        s = roof(axis, -jump, 0.5 * sign);
        c = prove(ctx, &s, NULL);
        if (k <= 12)
          T_CHECK(!c.certified && c.creased && c.sign == 0 && c.worst_at[axis] == 0.5 && c.margin_min == 0,
                  "and by %g: not, at %g %g", -jump, c.worst_at[0], c.worst_at[1]);
        batten_convexity_options o = batten_convexity_options_default();
        signed char signs[2] = {(signed char)sign, (signed char)sign};
        o.signs = signs;
        if (k <= 12) T_CHECK(!prove(ctx, &s, &o).certified, "nor asked for");
        o.slack = 1e-3;
        if (k <= 12) T_CHECK(!prove(ctx, &s, &o).certified, "which slack does not soften");
        o.slack = 0;
        signs[1] = 0;
        T_CHECK(prove(ctx, &s, &o).certified, "asked of one side alone there is no crease");
      }
  /* A crease that turns the right way at one end only, and by nothing in the middle. */
  scene s = roof(0, 0, 0.5);
  for (size_t j = 0; j < 3; j++)
    for (size_t i = 3; i < 5; i++) s.points[i * 3 + j][2] += 0.1 * (s.points[i * 3][0] - 0.5) * (1.0 - (double)j);
  batten_convexity c = prove(ctx, &s, NULL);
  T_CHECK(!c.certified && c.creased && c.worst_at[0] == 0.5 && c.worst_at[1] >= 0.49, "half of a crease: at %g %g",
          c.worst_at[0], c.worst_at[1]);
  /* The second span goes back over the first one: every span pair is convex. */
  s = roof(0, 0, 0.5);
  for (size_t j = 0; j < 3; j++)
    for (size_t i = 3; i < 5; i++) memcpy(s.points[i * 3 + j], s.points[(4 - i) * 3 + j], sizeof *s.points);
  batten_convexity_options o = batten_convexity_options_default();
  T_CHECK(!prove(ctx, &s, &o).certified, "turned back on itself");
  o.signs = (const signed char[2]){1, 1};
  T_CHECK(!prove(ctx, &s, &o).certified, "nor asked for");
  /* Smooth surfaces of full knots, turned and moved: a bound that took creases for what rounding leaves would fail.
   */
  uint64_t seed = 5;
  for (unsigned m = 2; m <= 6; m++) {
    s = cap(m, m == 6 ? 3 : m + 1, 0.8, 0.9, 0.01, &seed);
    bool convex = prove(ctx, &s, NULL).certified;
    for (int axis = 0; axis < 2; axis++)
      for (unsigned k = 0; k < s.degree[axis]; k++) insert_knot(&s, axis, axis ? 0.55 : 1 / 3.0);
    for (size_t i = 0; i < s.count[0] * s.count[1]; i++) {
      const double *p = s.points[i];
      double q[3] = {0.8 * p[0] - 0.6 * p[1] + 0.1, 0.6 * p[0] + 0.8 * p[1], p[2] + 3};
      memcpy(s.points[i], q, sizeof q);
    }
    c = prove(ctx, &s, NULL);
    T_CHECK(convex && c.certified && !c.creased, "degree %u with knots to the full: certified, %zu boxes", m,
            c.boxes);
  }
}

/* A saddle, tiny on a tiny domain: slack far below L' must not pass for much, though parts of it overflow. */
static void test_scaled_slack(batten_context *ctx) {
  for (int k = -650; k <= 650; k += 130) {
    scene s = graph(2, 2, (const double[MONOMIALS][MONOMIALS]){{0, 0, -1}, {0}, {1}});
    for (size_t i = 0; i < 9; i++)
      for (int x = 0; x < 3; x++) s.points[i][x] = ldexp(s.points[i][x], k);
    for (int x = 0; x < 2; x++)
      for (size_t i = 0; i < 6; i++) s.knots[x][i] = ldexp(s.knots[x][i], k);
    batten_convexity_options o = batten_convexity_options_default();
    o.slack = ldexp(1, -k); /* L' and N' are -+2 of this */
    T_CHECK(!prove(ctx, &s, &o).certified, "a saddle times 2^%d with a slack of half its bend", k);
    o.slack *= 2.01;
    T_CHECK(prove(ctx, &s, &o).certified, "and of all of it");
  }
}

/* ---- edges ------------------------------------------------------------------------------------------ */

static void test_edges(batten_context *ctx) {
  batten_convexity_options o = batten_convexity_options_default();
  scene s = cap(3, 3, 0.8, 0.9, 0, NULL);
  for (size_t j = 1; j < 4; j++) memcpy(s.points[j], s.points[0], sizeof *s.points);
  batten_convexity c = prove(ctx, &s, NULL);
  T_CHECK(!c.certified && !c.flat && !c.graph, "a side without length has no normal: not certified");
  for (size_t k = 0; k < 16; k++) memcpy(s.points[k], s.points[0], sizeof *s.points);
  c = prove(ctx, &s, NULL);
  T_CHECK(!c.certified && c.flat && !c.graph, "all points equal");
  for (size_t k = 0; k < 16; k++) s.points[k][0] = (double)(k * k % 7);
  c = prove(ctx, &s, NULL);
  T_CHECK(!c.certified && c.flat && !c.graph, "on a line");
  s = graph(1, 1, (const double[MONOMIALS][MONOMIALS]){{0.5, 2}, {-1}});
  c = prove(ctx, &s, NULL);
  T_CHECK(!c.certified && c.flat, "a plane of four points");
  s = graph(2, 1, (const double[MONOMIALS][MONOMIALS]){{0.5, 2}, {-1}});
  insert_knot(&s, 0, 0.25);
  insert_knot(&s, 0, 0.25);
  T_CHECK(prove(ctx, &s, NULL).flat, "of two parts");
  for (size_t i = 3; i < 5; i++)
    for (size_t j = 0; j < 2; j++) s.points[2 * i + j][2] += s.points[2 * i][0] - 0.25;
  c = prove(ctx, &s, NULL);
  T_CHECK(!c.certified && !c.flat, "two planes with a crease are not one");
  s = graph(1, 3, (const double[MONOMIALS][MONOMIALS]){{0, 0, 1}, {0, 0.5}});
  c = prove(ctx, &s, NULL);
  T_CHECK(!c.certified && !c.flat && c.margin_min < -0.01, "ruled: K = %.3g", c.margin_min);
  s = cap(3, 3, 0.8, 0.9, 0, NULL);
  for (size_t k = 0; k < 16; k++)
    for (int x = 0; x < 3; x++) s.points[k][x] *= 0.5e308 * (x == 2 ? 0.9 : 1);
  c = prove(ctx, &s, NULL);
  T_CHECK(c.certified && c.margin_min == 0, "as large as doubles go: certified, K below the smallest");
  o.box_limit = 1;
  o.depth_max = 0;
  s = spot(1e-5);
  c = prove(ctx, &s, NULL);
  batten_convexity rough = prove(ctx, &s, &o);
  T_CHECK(c.certified && c.boxes > 1 && rough.boxes == 1 && rough.depth == 0 &&
              (!rough.certified || rough.margin_min <= c.margin_min),
          "one box only: certified %d, K > %.3g instead of %.3g of %zu", rough.certified, rough.margin_min,
          c.margin_min, c.boxes);
}

static void test_bad(batten_context *ctx) {
  scene s = paraboloid(3, 3);
  insert_knot(&s, 1, 0.5);
  batten_surface *surface = surface_of(ctx, &s);
  batten_convexity c = {.certified = 77};
  batten_convexity_options o = batten_convexity_options_default();
  T_CHECK(batten_surface_certify_convex(NULL, surface, NULL, &c) == BATTEN_E_INVALID, "no context");
  T_STATUS(batten_surface_certify_convex(ctx, NULL, NULL, &c), BATTEN_E_INVALID, ctx, "surface: NULL");
  T_STATUS(batten_surface_certify_convex(ctx, surface, NULL, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  o.struct_size = 3;
  T_STATUS(batten_surface_certify_convex(ctx, surface, &o, &c), BATTEN_E_INVALID, ctx,
           "batten_convexity_options.struct_size: 3");
  o = batten_convexity_options_default();
  o.slack = -1;
  T_STATUS(batten_surface_certify_convex(ctx, surface, &o, &c), BATTEN_E_INVALID, ctx,
           "opt.slack: -1; give 0 or more");
  o.slack = NAN;
  T_STATUS(batten_surface_certify_convex(ctx, surface, &o, &c), BATTEN_E_INVALID, ctx, "opt.slack: nan");
  o.slack = INFINITY;
  T_STATUS(batten_surface_certify_convex(ctx, surface, &o, &c), BATTEN_E_INVALID, ctx, "opt.slack: inf");
  o.slack = 0;
  o.depth_max = 31;
  T_STATUS(batten_surface_certify_convex(ctx, surface, &o, &c), BATTEN_E_INVALID, ctx, "opt.depth_max: 31");
  o.depth_max = 5;
  o.box_limit = 0;
  T_STATUS(batten_surface_certify_convex(ctx, surface, &o, &c), BATTEN_E_INVALID, ctx, "opt.box_limit: 0");
  o.box_limit = 10;
  o.signs = (const signed char[2]){1, 2};
  T_STATUS(batten_surface_certify_convex(ctx, surface, &o, &c), BATTEN_E_INVALID, ctx, "opt.signs[0][1]: 2");
  T_CHECK(c.certified == 77, "failures leave the result alone");
  batten_surface_free(surface);
}

static batten_status certify(batten_context *ctx, void *arg) {
  batten_convexity c;
  batten_surface *surface = surface_of(ctx, arg);
  if (!surface) return BATTEN_E_NOMEM;
  batten_status st = batten_surface_certify_convex(ctx, surface, NULL, &c);
  batten_surface_free(surface);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_by_hand(ctx);
  test_caps(ctx);
  test_spots(ctx);
  test_tiny(ctx);
  test_nearly_flat(ctx);
  test_not_convex(ctx);
  test_random(ctx);
  test_coefficients(ctx);
  test_invariances(ctx);
  test_signs(ctx);
  test_slack(ctx);
  test_creases(ctx);
  test_scaled_slack(ctx);
  test_edges(ctx);
  test_bad(ctx);
  scene s = spot(1e-6);
  insert_knot(&s, 0, 0.5);
  t_fail_every_allocation("batten_surface_certify_convex", certify, &s);
  t_cancel_every_progress("batten_surface_certify_convex", certify, &s);
  batten_context_free(ctx);
  return t_done();
}
