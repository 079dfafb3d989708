/* The proof that a surface is convex, by Bernstein coefficients of D = L'N' - M'^2.
 *
 * With L' = x_uu . (x_u x x_v), M' and N' likewise and V = |x_u x x_v|^4 the Gaussian curvature is K = D / V. On each
 * span pair D - kappa V is shown to be positive, kappa a share of the least K that was met: then D > 0, so that x_u x
 * x_v vanishes nowhere and K > kappa > 0; and L' has one sign, since L'N' > M'^2 lets it vanish nowhere either. One
 * value of it tells which. Degrees: L' (3m-3, 3n-1), M' (3m-2, 3n-2), N' (3m-1, 3n-3), D (6m-4, 6n-4), V (8m-4,
 * 8n-4). Points are multiplied by a power of two, and so are the parameters: that changes no digit. */
#include "certify.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "mesh/vec.h"

enum { NORMALS = 5 }; /* in either direction on a span pair */

typedef struct certifier {
  batten_context *ctx;
  const batten_surface *surface;
  const batten_convexity_options *opt;
  double unit;     /* that points are multiplied by */
  double rounding; /* of the control points themselves, times unit */
  size_t spans[2];
  unsigned degree[2]; /* of the jets */
  double *block;      /* everything below */
  double *room;       /* of a jet */
  certify_jet jet;
  certify_poly cross[3], form[3], square, determinant; /* x_u x x_v, (L', M', N'), |x_u x x_v|^2, D */
  double *slots, *work, *faces;
  certify_box *stack;
  double (*normals)[3]; /* [spans][NORMALS * NORMALS], as many as there are */
  size_t normal_count;
} certifier;

/* What was found with L', M', N' multiplied by one sign. */
typedef struct verdict {
  certify_proof proof;
  bool certified, creased;
  int sign; /* that L' has, times the sign; 2 while there is none, 0 when it is not one */
} verdict;

batten_convexity_options batten_convexity_options_default(void) {
  return (batten_convexity_options){
      .struct_size = sizeof(batten_convexity_options), .depth_max = 20, .box_limit = 1000000};
}

static batten_status check(batten_context *ctx, const batten_surface *surface, const batten_convexity_options *opt,
                           const batten_convexity *out) {
  if (!surface || !out)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a surface and room for the result",
                       surface ? "out" : "surface");
  batten_status st = batten_check_struct(ctx, "batten_convexity_options", opt->struct_size, sizeof *opt);
  if (st < 0) return st;
  if (!(opt->slack >= 0) || isinf(opt->slack))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.slack: %g; give 0 or more", opt->slack);
  if (opt->depth_max > 30)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.depth_max: %u; give 0 to 30", opt->depth_max);
  if (opt->box_limit < 1) return batten_fail(ctx, BATTEN_E_INVALID, "opt.box_limit: 0; give 1 or more");
  size_t spans[2] = {bspline_span_count(&surface->space[0]), bspline_span_count(&surface->space[1])};
  for (size_t k = 0; opt->signs && k < spans[0] * spans[1]; k++)
    if (opt->signs[k] < -1 || opt->signs[k] > 1)
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.signs[%zu][%zu]: %d; give -1, 0 or 1", k / spans[1],
                         k % spans[1], opt->signs[k]);
  return BATTEN_OK;
}

/* The power of two that brings the points' box to size 1. */
static void find_unit(certifier *c) {
  const batten_surface *s = c->surface;
  size_t count = s->space[0].count * s->space[1].count;
  double size = 0, most = 0;
  for (int x = 0; x < 3; x++) {
    double low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < count; i++) {
      low = fmin(low, s->control_points[3 * i + (size_t)x]);
      high = fmax(high, s->control_points[3 * i + (size_t)x]);
    }
    size = fmax(size, 0.5 * high - 0.5 * low);
    most = fmax(most, fmax(fabs(low), fabs(high)));
  }
  c->unit = size > 0 ? 0.5 * batten_unit(size) : 1;
  c->rounding = 4 * CERTIFY_EPS * c->unit * most;
}

/* Takes count doubles of the block, which may be NULL when only their number is asked for. */
static double *take(certifier *c, size_t *used, size_t count) {
  double *at = c->block ? c->block + *used : NULL;
  batten_add(*used, count, used);
  return at;
}

/* Hands the block out, or only counts. */
static size_t lay_out(certifier *c) {
  size_t used = 0, m = c->degree[0], n = c->degree[1], slots, pairs;
  size_t full = 2 * (8 * m - 3) * (8 * n - 3);
  c->room = take(c, &used, CERTIFY_JET_DOUBLES);
  for (int x = 0; x < 3; x++) c->cross[x].c = take(c, &used, 4 * m * n);
  for (int k = 0; k < 3; k++) c->form[k].c = take(c, &used, 9 * m * n);
  c->square.c = take(c, &used, (4 * m - 1) * (4 * n - 1));
  c->determinant.c = take(c, &used, (6 * m - 3) * (6 * n - 3));
  c->faces = take(c, &used, CERTIFY_FACES_DOUBLES);
  c->work = take(c, &used, full);
  batten_mul(2 * (size_t)c->opt->depth_max + 2, full, &slots);
  c->slots = take(c, &used, slots);
  size_t boxes = (2 * (size_t)c->opt->depth_max + 2) * sizeof(certify_box) / sizeof(double);
  c->stack = (certify_box *)take(c, &used, boxes);
  batten_mul3(c->spans[0], c->spans[1], 3 * NORMALS * NORMALS, &pairs);
  c->normals = (double(*)[3])take(c, &used, pairs);
  return used;
}

/* ---- one span pair -------------------------------------------------------------------------------- */

/* Jet, cross product and forms. */
static void make_forms(certifier *c, size_t mu, size_t nu) {
  static const int second[3] = {CERTIFY_UU, CERTIFY_UV, CERTIFY_VV};
  unsigned m = c->degree[0], n = c->degree[1];
  certify_jet_make(c->surface, mu, nu, c->unit, 0, c->room, &c->jet);
  certify_cross(c->jet.part[CERTIFY_U], c->jet.part[CERTIFY_V], c->cross);
  for (unsigned k = 0; k < 3; k++) {
    certify_clear(&c->form[k], 3 * m - 3 + k, 3 * n - 1 - k);
    for (int x = 0; x < 3; x++) certify_add_product(&c->form[k], 1, &c->jet.part[second[k]][x], &c->cross[x], 3);
    certify_summed(&c->form[k]);
  }
}

static void collect_normals(certifier *c) {
  for (int i = 0; i < NORMALS; i++)
    for (int j = 0; j < NORMALS; j++) {
      double normal[3];
      for (int x = 0; x < 3; x++)
        normal[x] = certify_value(&c->cross[x], true, i / (NORMALS - 1.0), j / (NORMALS - 1.0));
      if (vec_normalize(normal)) memcpy(c->normals[c->normal_count++], normal, sizeof normal);
    }
}

/* The slack in the units of the jet's L' and N', not above it; a slack too large for a double is cut. In halves and
 * exponents, since parts of the product may be beyond doubles where the whole is not. */
static double local_slack(const certifier *c, int direction) {
  const double along = c->jet.factor[direction], across = c->jet.factor[1 - direction];
  const double parts[] = {c->opt->slack, c->unit, c->unit, c->unit, along, along, along, across};
  double slack = 1 - 0x1p-40;
  int exponent = 0;
  /* Spans that long or short may have lost digits. */
  if (!(fmin(along, across) > 0x1p-1000 && fmax(along, across) < 0x1p1000)) return 0;
  for (size_t k = 0; k < sizeof parts / sizeof *parts; k++) {
    int e;
    slack *= frexp(parts[k], &e);
    exponent += e;
  }
  return exponent > 100 ? fmin(slack, 0.5) * 0x1p100 : ldexp(slack, exponent);
}

/* The forms times sign, and with the slack. */
static void apply_slack(certifier *c, int sign) {
  if (!(c->opt->slack > 0)) return;
  for (int k = 0; k < 3; k++)
    for (size_t x = 0; x < certify_count(&c->form[k]) && sign < 0; x++) c->form[k].c[x] = -c->form[k].c[x];
  certify_add_constant(&c->form[0], local_slack(c, 0));
  certify_add_constant(&c->form[2], local_slack(c, 1));
}

/* D and V of the span pair into the square's first slot. */
static void make_square(certifier *c, size_t mu, size_t nu, certify_square *s) {
  unsigned m = c->degree[0], n = c->degree[1];
  certify_clear(&c->determinant, 6 * m - 4, 6 * n - 4);
  certify_add_product(&c->determinant, 1, &c->form[0], &c->form[2], 2);
  certify_add_product(&c->determinant, -1, &c->form[1], &c->form[1], 2);
  certify_summed(&c->determinant);
  certify_clear(&c->square, 4 * m - 2, 4 * n - 2);
  for (int x = 0; x < 3; x++) certify_add_product(&c->square, 1, &c->cross[x], &c->cross[x], 3);
  certify_summed(&c->square);
  certify_poly d = {.c = c->slots}, v = {.c = c->slots + (size_t)(8 * m - 3) * (8 * n - 3)};
  certify_raise(&c->determinant, 8 * m - 4, 8 * n - 4, c->work, &d);
  certify_unscale(&d);
  certify_clear(&v, 8 * m - 4, 8 * n - 4);
  certify_add_product(&v, 1, &c->square, &c->square, 1);
  certify_unscale(&v);
  *s = (certify_square){.degree = {d.degree[0], d.degree[1]},
                        .error = {d.error, v.error},
                        .slots = c->slots,
                        .work = c->work,
                        .stack = c->stack};
  for (int i = 0; i < 2; i++) {
    const double *knots = c->surface->space[i].knots + (i == 0 ? mu : nu);
    s->lower[i] = knots[0];
    s->upper[i] = knots[1];
  }
}

/* The sign of the diagonal forms at the corner where one is largest, 0 when that is not beyond rounding. */
static int sign_of_forms(const certifier *c) {
  double largest = 0;
  for (int k = 0; k < 3; k += 2) {
    const certify_poly *f = &c->form[k];
    size_t n = certify_count(f), columns = f->degree[1] + 1;
    const double corners[4] = {f->c[0], f->c[columns - 1], f->c[n - columns], f->c[n - 1]};
    for (int i = 0; i < 4; i++)
      if (fabs(corners[i]) > f->error && fabs(corners[i]) > fabs(largest)) largest = corners[i];
  }
  return (largest > 0) - (largest < 0);
}

/* The least coefficient of a scaled form. */
static double least_of(const certify_poly *f) {
  double first[CERTIFY_ORDER], second[CERTIFY_ORDER], least = INFINITY;
  certify_binomials(f->degree[0], first);
  certify_binomials(f->degree[1], second);
  const double *c = f->c;
  for (unsigned i = 0; i <= f->degree[0]; i++)
    for (unsigned j = 0; j <= f->degree[1]; j++) least = fmin(least, *c++ / first[i] / second[j]);
  return least;
}

/* With slack D may be as small as its square, below the rounding of products: proof by L', M', N' apart. */
static bool prove_apart(const certifier *c, verdict *v) {
  const certify_poly *f = c->form;
  double l = least_of(&f[0]) - f[0].error - 4 * CERTIFY_EPS * f[0].most;
  double n = least_of(&f[2]) - f[2].error - 4 * CERTIFY_EPS * f[2].most;
  double m = (f[1].most + f[1].error) * CERTIFY_UP;
  double largest = (c->square.most + c->square.error) * CERTIFY_UP;
  if (!(l > 0 && n > 0 && l * n > m * m * CERTIFY_UP * CERTIFY_UP + CERTIFY_TINY)) return false;
  v->proof.bound = fmin(v->proof.bound, (l * n / CERTIFY_UP - m * m) / (largest * largest * CERTIFY_UP) / CERTIFY_UP);
  v->proof.boxes++;
  return true;
}

/* ---- all span pairs -------------------------------------------------------------------------------- */

/* asked: what is to be shown of the span pair, 0 nothing; either: the sign is free but must be one. */
static batten_status certify_pair(certifier *c, size_t mu, size_t nu, int asked, bool either, verdict *v) {
  make_forms(c, mu, nu);
  collect_normals(c);
  if (asked == 0) return BATTEN_OK;
  certify_square s;
  apply_slack(c, asked);
  make_square(c, mu, nu, &s);
  certify_sample(&v->proof, &s);
  if (!v->certified) return BATTEN_OK; /* only what is met */
  if (c->opt->slack > 0 && prove_apart(c, v)) {
    if (v->sign == 2) v->sign = asked;
    return BATTEN_OK;
  }
  batten_status st = certify_prove(c->ctx, &v->proof, &s);
  if (st < 0) return st;
  int sign = sign_of_forms(c);
  int expected = c->opt->slack > 0 ? 1 : either ? (v->sign == 2 ? sign : v->sign) : asked;
  v->certified = v->proof.unproven == 0 && sign != 0 && sign == expected;
  if (v->sign == 2) v->sign = c->opt->slack > 0 ? asked : sign;
  return BATTEN_OK;
}

/* What was asked for, or found, of span pair k. */
static int sign_of_pair(const certifier *c, const verdict *v, size_t k) {
  return c->opt->signs ? c->opt->signs[k] : v->sign;
}

/* The crease before span `after` in direction axis, along span nu of the other one; rounding of the control points
 * counts, or no two sides would join smoothly. */
static void certify_side(certifier *c, int axis, size_t before, size_t after, size_t nu, int sign, verdict *v) {
  certify_edge edge[2];
  double at;
  for (int k = 0; k < 2; k++) {
    size_t mu = k ? after : before;
    certify_jet_make(c->surface, axis == 0 ? mu : nu, axis == 0 ? nu : mu, c->unit, c->rounding, c->room, &c->jet);
    certify_edge_make(&c->jet, axis, k == 0, &edge[k]);
  }
  if (certify_crease(&edge[0], &edge[1], axis, sign, c->faces, &at)) return;
  v->certified = false;
  v->creased = true;
  v->proof.least_at[axis] = c->surface->space[axis].knots[after];
  v->proof.least_at[1 - axis] = surface_span_at(&c->surface->space[1 - axis], nu, at);
}

/* Creases between span pairs of the same sign, until one is found that turns the wrong way. */
static batten_status certify_creases(certifier *c, verdict *v) {
  for (int axis = 0; axis < 2; axis++) {
    const bspline *across = &c->surface->space[axis], *along = &c->surface->space[1 - axis];
    size_t step[2] = {axis == 0 ? c->spans[1] : 1, axis == 0 ? 1 : c->spans[1]}, i = 0;
    for (size_t mu = bspline_first(across), next; (next = bspline_next(across, mu)) < across->count; mu = next, i++) {
      if (next - mu < across->degree) continue;
      batten_status st = batten_progress(c->ctx, "certify", 1);
      if (st < 0) return st;
      size_t pair = i * step[0];
      for (size_t nu = bspline_first(along); nu < along->count; nu = bspline_next(along, nu), pair += step[1]) {
        int sign = sign_of_pair(c, v, pair);
        if (sign == 0 || sign != sign_of_pair(c, v, pair + step[0])) continue;
        certify_side(c, axis, mu, next, nu, sign, v);
        if (!v->certified) return BATTEN_OK;
      }
    }
  }
  return BATTEN_OK;
}

/* sign: of the forms where one sign is free. */
static batten_status certify_all(certifier *c, int sign, verdict *v) {
  const bspline *u = &c->surface->space[0], *w = &c->surface->space[1];
  const signed char *signs = c->opt->signs;
  *v = (verdict){.certified = true, .sign = 2};
  v->proof = (certify_proof){
      .depth_max = c->opt->depth_max, .box_limit = c->opt->box_limit, .least = INFINITY, .bound = INFINITY};
  c->normal_count = 0;
  double pairs = (double)c->spans[0] * (double)c->spans[1], done = 0;
  size_t at = 0;
  for (size_t mu = bspline_first(u); mu < u->count; mu = bspline_next(u, mu))
    for (size_t nu = bspline_first(w); nu < w->count; nu = bspline_next(w, nu), at++) {
      v->proof.progress[0] = done++ / pairs;
      v->proof.progress[1] = done / pairs;
      batten_status st = batten_progress(c->ctx, "certify", v->proof.progress[0]);
      if (st >= 0) st = certify_pair(c, mu, nu, signs ? signs[at] : sign, !signs, v);
      if (st < 0) return st;
    }
  return v->certified ? certify_creases(c, v) : BATTEN_OK;
}

static bool prove_graph(certifier *c, double direction[3]) {
  const bspline *u = &c->surface->space[0], *w = &c->surface->space[1];
  if (!certify_direction(c->normal_count, (const double(*)[3])c->normals, direction)) return false;
  for (size_t mu = bspline_first(u); mu < u->count; mu = bspline_next(u, mu))
    for (size_t nu = bspline_first(w); nu < w->count; nu = bspline_next(w, nu)) {
      certify_jet_make(c->surface, mu, nu, c->unit, 0, c->room, &c->jet);
      certify_cross(c->jet.part[CERTIFY_U], c->jet.part[CERTIFY_V], c->cross);
      if (!certify_faces(c->cross, direction, c->faces)) return false;
    }
  return true;
}

/* The one sign that was asked for, 0 when there are both or none. */
static int common_sign(const certifier *c) {
  int sign = 0;
  for (size_t k = 0; k < c->spans[0] * c->spans[1]; k++) {
    int s = c->opt->signs[k];
    if (s != 0 && sign != 0 && s != sign) return 0;
    if (s != 0) sign = s;
  }
  return sign;
}

/* All control points in one plane to their rounding: the one through the first, the furthest from it and the furthest
 * from the line of both, of which all others are combinations with small factors. */
static bool is_flat(const certifier *c) {
  size_t count = c->surface->space[0].count * c->surface->space[1].count;
  const double *points = c->surface->control_points;
  double along[3] = {0}, across[3] = {0}, off[3] = {0};
  for (int pass = 0; pass < 3; pass++)
    for (size_t i = 0; i < count; i++) {
      double p[3];
      for (int x = 0; x < 3; x++) p[x] = c->unit * points[3 * i + (size_t)x] - c->unit * points[x];
      double *furthest = pass == 0 ? along : pass == 1 ? across : off;
      for (int k = 0; k < pass; k++) {
        const double *axis = k == 0 ? along : across;
        double part = vec_dot(axis, axis) > 0 ? vec_dot(p, axis) / vec_dot(axis, axis) : 0;
        for (int x = 0; x < 3; x++) p[x] -= part * axis[x];
      }
      if (vec_norm(p) > vec_norm(furthest)) memcpy(furthest, p, sizeof p);
    }
  return vec_norm(off) <= 4 * c->rounding;
}

static void report(certifier *c, const verdict *v, batten_convexity *out) {
  const certify_proof *p = &v->proof;
  double unit = c->unit, least = p->least;
  batten_convexity r = {.certified = v->certified,
                        .flat = !(v->certified && c->opt->slack == 0) && is_flat(c),
                        .creased = v->creased,
                        .boxes = p->boxes,
                        .depth = p->depth,
                        .unproven = p->unproven,
                        .worst_at = {p->least_at[0], p->least_at[1]}};
  if (v->certified)
    r.margin_min = isfinite(least) ? fmin(fmax(0, fmin(CERTIFY_SHARE * least, p->bound)) * unit * unit, DBL_MAX) : 0;
  else
    r.margin_min = fmin(least, 0) * unit * unit;
  if (v->certified) r.sign = c->opt->signs ? common_sign(c) : v->sign == 2 ? 0 : v->sign;
  r.graph = prove_graph(c, r.direction);
  if (!r.graph) memset(r.direction, 0, sizeof r.direction);
  *out = r;
}

batten_status batten_surface_certify_convex(batten_context *ctx, const batten_surface *surface,
                                            const batten_convexity_options *opt, batten_convexity *out) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_convexity_options defaults = batten_convexity_options_default();
  if (!opt) opt = &defaults;
  batten_status st = check(ctx, surface, opt, out);
  if (st < 0) return st;
  certifier c = {.ctx = ctx, .surface = surface, .opt = opt};
  for (int i = 0; i < 2; i++) {
    c.spans[i] = bspline_span_count(&surface->space[i]);
    c.degree[i] = surface->space[i].degree < 2 ? 2 : surface->space[i].degree;
  }
  find_unit(&c);
  c.block = batten_alloc_array(ctx, lay_out(&c), sizeof *c.block);
  if (!c.block) return BATTEN_E_NOMEM;
  lay_out(&c);
  verdict v, other;
  st = certify_all(&c, 1, &v);
  if (st >= 0 && !opt->signs && opt->slack > 0 && !v.certified) { /* then the other sign */
    st = certify_all(&c, -1, &other);
    if (st >= 0 && other.certified) v = other;
  }
  if (st >= 0) report(&c, &v, out);
  batten_free(ctx, c.block);
  return st;
}
