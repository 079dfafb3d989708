/* Bounds of a volume spline over boxes.
 *
 * Value, gradient and Hessian in the middle of the box come from the evaluator: exact sums, in which the terms cancel
 * as they do in U. What the quadratic model leaves out of one term psi is at most each of three bounds, the least of
 * which counts; rho is the half diagonal of the box, sup is taken over the box:
 *
 *   sup |D3 psi| rho^3 / 6   with the term's gradient and Hessian in the model
 *   sup |D2 psi| rho^2 / 2   with its Hessian taken out of the model again
 *   sup |D psi| rho          with both taken out: all that is left where a centre lies in the box and psi has a kink
 *
 *
 * and of a spline with gradient data, whose large coefficients cancel in exact sums alone, also
 *
 *   sup |D4 psi| rho^4 / 24  with its third derivatives in the middle added to those of others, whose sum is bounded
 *
 * and of its gradient, by the same choice, sup |D4 psi| rho^3 / 6, sup |D3 psi| rho^2 / 2, sup |D2 psi| rho or sup |D
 * psi|.
 *
 * |D^k psi| is the norm of a symmetric k-linear form, the largest of |D^k psi[u, .., u]| over unit vectors u. With
 * phi = F_0(r), F_(j+1) = F_j' / r and c the cosine between u and x - centre
 *
 *   D^k phi[u, .., u] = sum over j of  k! / ((2 j - k)! (k - j)! 2^(k - j))  F_j (r c)^(2 j - k),  k / 2 <= j <= k
 *
 * where each F_j is (a ln r + b) r^(p - 2 j), so |D^k phi| <= (alpha_k |ln r| + beta_k) r^(p - k); a gradient term
 * counts as the derivative by one more order. Far clusters of centres are taken at once: by their sum of |w|, or by
 * their moments, in which the coefficients cancel (clusters.h).
 *
 * Everything is in the unit box. The evaluator takes a point there by spline_to_box, which is monotone in floating
 * point too, so the images of the corners hold what becomes of the points between. */
#include "spline/bounds.h"

#include "base/checked.h"
#include "spline/inner.h"

enum { BLOCK = 256, TASK_BOXES = 16, STACK = 128, ORDERS = 8, THIRDS = 10 };
/* A cluster is taken at once where its diagonal is at most this share of the distance: half of it gives bounds
 * tighter by a twentieth in four times the time. */
static const double OPENING = 1.2;
/* Least distance from the middle at which third derivatives are summed: their powers of it do not overflow. */
static const double THIRDS_APART = 1e-40;
/* Unit of rounding errors, twice that of rounding to nearest; the steps of one term and of the sum's two stages, see
 * sum.c (64 terms in a chunk, one addition for every chunk): an ample count of the former. */
static const double EPS = 0x1p-52, STEPS = 160, CHUNK = 64;

/* |D^k phi| <= (alpha[k] |ln r| + beta[k]) r^(power - k) */
typedef struct radial_norms {
  int power;
  double alpha[ORDERS], beta[ORDERS];
  double a[ORDERS], b[ORDERS]; /* F_j = (a ln r + b) r^(power - 2 j) */
} radial_norms;

typedef struct distances {
  double r[2], l[2]; /* least and most; |ln r|, where the kernel has a logarithm */
} distances;

typedef struct bounding {
  const batten_spline *spline;
  spline_sum_function *sum;
  radial_norms norms;
  double rounding; /* relative to the sum of the terms' sizes */
  size_t count;
  const taylor_box *boxes;
  const double *values, *gradients, *hessians; /* in the middles */
  taylor *models;
} bounding;

/* What is added up for one box. */
typedef struct tally {
  double lower[3], upper[3], middle[3], radius[3], rho; /* unit box */
  double rest, rest_slope;
  double size, size1, size2; /* of the terms, their gradients (both anywhere in the box), their Hessians (middle) */
  double taken[SPLINE_SUMS]; /* gradient and Hessian to take out of the model */
  double thirds[THIRDS];     /* third derivatives in the middle: xxx xxy xxz xyy xyz xzz yyy yyz yzz zzz */
  double size3;              /* of what is added up in them */
} tally;

/* ---- norms of derivatives of the kernel ---------------------------------------------------------- */

static double factorial(int k) {
  double product = 1;
  for (int i = 2; i <= k; i++) product *= i;
  return product;
}

/* max over |c| <= 1 of |D^k phi[u, .., u]| r^(k - p), f[j] = F_j r^(2 j - p); for n = 1 c is 1. */
static double largest_form(unsigned n, int k, const double *f) {
  /* A polynomial of degree k is nowhere larger than 1 / cos(pi k / (2 N)) times what it is at N Chebyshev points
   * [Ehlich, Zeller 1964]: 1.011 for k = 6. */
  enum { POINTS = 64 };
  double most = 0;
  for (int i = 0; i < (n == 1 ? 1 : POINTS); i++) {
    double c = n == 1 ? 1 : cos(3.14159265358979323846 * (i + 0.5) / POINTS), sum = 0;
    for (int j = (k + 1) / 2; j <= k; j++)
      sum += factorial(k) / (factorial(2 * j - k) * factorial(k - j) * ldexp(1, k - j)) * f[j] * pow(c, 2 * j - k);
    most = fmax(most, fabs(sum));
  }
  return n == 1 ? most : 1.02 * most;
}

static radial_norms norms_of(unsigned n, unsigned power) {
  radial_norms out = {.power = (int)power};
  double a[ORDERS] = {power % 2 ? 0 : 1}, b[ORDERS] = {power % 2 ? 1 : 0};
  for (int j = 0; j + 1 < ORDERS; j++) {
    a[j + 1] = (out.power - 2 * j) * a[j];
    b[j + 1] = (out.power - 2 * j) * b[j] + a[j];
  }
  for (int k = 0; k < ORDERS; k++) {
    out.a[k] = a[k];
    out.b[k] = b[k];
    out.alpha[k] = largest_form(n, k, a);
    out.beta[k] = largest_form(n, k, b);
  }
  return out;
}

static double whole_power(double x, int p) {
  double product = 1, factor = p < 0 ? 1 / x : x;
  for (int i = p < 0 ? -p : p; i > 0; i--) product *= factor;
  return product;
}

static distances between(const radial_norms *norms, double r0, double r1) {
  distances d = {{r0, r1}, {0, 0}};
  if (norms->power % 2 == 0) {
    d.l[0] = fabs(log(r0));
    d.l[1] = fabs(log(r1));
  }
  return d;
}

/* sup of |D^k phi| over the distances; more by alpha times the power for sizes that roundings are relative to: the
 * evaluator's ln r is off by as much where ln r is 0. */
static double largest(const radial_norms *norms, int k, const distances *d, bool for_rounding) {
  int q = norms->power - k;
  if (q < 0 && d->r[0] == 0) return INFINITY; /* a kink, also where what is on both sides of it is straight */
  if (norms->alpha[k] == 0 && norms->beta[k] == 0) return 0;
  double power = q == 0 ? 1 : whole_power(d->r[q > 0], q), sup = norms->beta[k] * power;
  if (norms->alpha[k] == 0) return sup;
  if (for_rounding) sup += norms->alpha[k] * power;
  if (q == 0) return sup + norms->alpha[k] * fmax(d->l[0], d->l[1]);
  double most = 0;
  for (int i = 0; i < 2; i++)
    if (d->r[i] > 0) most = fmax(most, whole_power(d->r[i], q) * d->l[i]);
  /* Between 0 and 1 r^q |ln r| has its peak 1 / (e q) at r = e^(-1/q); those of q = 1 .. 6 lie in here. */
  if (d->r[0] < 0.85 && d->r[1] > 0.36) most = fmax(most, 1 / (2.718281828459045 * q));
  return sup + norms->alpha[k] * most;
}

/* ---- one box ------------------------------------------------------------------------------------- */

static distances distances_of_box(const bounding *b, const tally *t, const double *lower, const double *upper) {
  double near = 0, far = 0;
  for (unsigned a = 0; a < b->spline->parts.n; a++) {
    double gap = fmax(fmax(lower[a] - t->upper[a], t->lower[a] - upper[a]), 0);
    double reach = fmax(upper[a] - t->lower[a], t->upper[a] - lower[a]);
    near += gap * gap;
    far += reach * reach;
  }
  return between(&b->norms, sqrt(near) * (1 - 0x1p-45), sqrt(far) * (1 + 0x1p-45));
}

/* A term (or cluster) with |w| and |g| takes part in the sizes. */
static void add_sizes(const bounding *b, const distances *d, const distances *middle, double w, double g, tally *t) {
  const radial_norms *norms = &b->norms;
  t->size += w * largest(norms, 0, d, true);
  t->size1 += w * largest(norms, 1, d, true);
  t->size2 += w * largest(norms, 2, middle, true);
  if (g == 0) return;
  t->size += g * largest(norms, 1, d, true);
  t->size1 += g * largest(norms, 2, d, true);
  t->size2 += g * largest(norms, 3, middle, true);
}

/* Third derivatives of term j in the middle of the box, at least THIRDS_APART from its centre: with d = x - centre, t
 * = g . d, F_j as above and sym the sum over the three places of an index, sym(delta_ab u_c) - F_3 sym(g_a d_b d_c) +
 * k d_a d_b d_c,   u = (w F_2 - t F_3) d - F_2 g,  k = w F_3 - t F_4 */
static void add_thirds(const bounding *b, size_t j, tally *t) {
  const spline_terms *terms = &b->spline->terms;
  const bool hermite = j >= terms->plain;
  double d[3] = {0, 0, 0}, g[3] = {0, 0, 0}, u[3], square = 0, along = 0;
  for (unsigned a = 0; a < terms->n; a++) {
    d[a] = t->middle[a] - terms->x[a][j];
    if (hermite) g[a] = terms->g[a][j - terms->plain];
    square += d[a] * d[a];
    along += g[a] * d[a];
  }
  const radial_norms *norms = &b->norms;
  const double w = terms->w[j], r = sqrt(square), l = norms->power % 2 ? 0 : log(r);
  const double inverse = 1 / square, r4 = norms->power == 3 ? r * inverse : whole_power(r, norms->power - 4);
  const double r6 = r4 * inverse, r8 = r6 * inverse; /* r^(p - 4), r^(p - 6), ... */
  const double f2 = (norms->a[2] * l + norms->b[2]) * r4, f3 = (norms->a[3] * l + norms->b[3]) * r6;
  const double k = w * f3 - along * (norms->a[4] * l + norms->b[4]) * r8;
  for (unsigned a = 0; a < 3; a++) u[a] = (w * f2 - along * f3) * d[a] - f2 * g[a];
  double m[3]; /* sum over the places: k d d d / 3 - F_3 g d d = m d d */
  for (unsigned a = 0; a < 3; a++) m[a] = k / 3 * d[a] - f3 * g[a];
  const double xx = d[0] * d[0], yy = d[1] * d[1], zz = d[2] * d[2];
  const double xy = d[0] * d[1], xz = d[0] * d[2], yz = d[1] * d[2];
  double *out = t->thirds;
  out[0] += 3 * (m[0] * xx + u[0]);
  out[1] += m[1] * xx + 2 * m[0] * xy + u[1];
  out[2] += m[2] * xx + 2 * m[0] * xz + u[2];
  out[3] += m[0] * yy + 2 * m[1] * xy + u[0];
  out[4] += m[0] * yz + m[1] * xz + m[2] * xy;
  out[5] += m[0] * zz + 2 * m[2] * xz + u[0];
  out[6] += 3 * (m[1] * yy + u[1]);
  out[7] += m[2] * yy + 2 * m[1] * yz + u[2];
  out[8] += m[1] * zz + 2 * m[2] * yz + u[1];
  out[9] += 3 * (m[2] * zz + u[2]);
}

/* What the third derivatives add to f and its gradient over the box, at most, is left out too. */
static void close_thirds(const bounding *b, tally *t) {
  double square = 0, all = 0;
  for (unsigned p = 0; p < b->spline->parts.n; p++) {
    double along = 0;
    for (unsigned q = 0; q < b->spline->parts.n; q++)
      for (unsigned s = 0; s < b->spline->parts.n; s++) {
        static const unsigned char place[3][3][3] = {
            {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}}, {{1, 3, 4}, {3, 6, 7}, {4, 7, 8}}, {{2, 4, 5}, {4, 7, 8}, {5, 8, 9}}};
        along += fabs(t->thirds[place[p][q][s]]) * t->radius[q] * t->radius[s];
      }
    square += along * along;
    all += along * t->radius[p];
  }
  double rounding = b->rounding * t->size3 * t->rho * t->rho;
  t->rest += all / 6 + rounding * t->rho;
  t->rest_slope += sqrt(square) / 2 + rounding;
}

/* The terms of a leaf, each with the order of its model that leaves least open: how[i] = 0 .. 3. */
static void choose_orders(const bounding *b, const size_t *order, size_t count, tally *t, unsigned char *how) {
  const spline_terms *terms = &b->spline->terms;
  const double square_half = t->rho * t->rho / 2, cube = square_half * t->rho / 3;
  const double weight[4] = {t->rho, square_half, cube, cube * t->rho / 4},
               slope_weight[4] = {1, t->rho, square_half, cube};
  for (size_t i = 0; i < count; i++) {
    size_t j = order[i];
    double x[3] = {0, 0, 0}, square = 0, from_middle = 0;
    for (unsigned a = 0; a < terms->n; a++) {
      x[a] = terms->x[a][j];
      double h = j >= terms->plain ? terms->g[a][j - terms->plain] : 0;
      square += h * h;
      from_middle += (x[a] - t->middle[a]) * (x[a] - t->middle[a]);
    }
    double w = fabs(terms->w[j]), g = sqrt(square), least = INFINITY, middle = sqrt(from_middle), slope = INFINITY;
    distances d = distances_of_box(b, t, x, x);
    how[i] = 0;
    for (int k = terms->hermite && middle > THIRDS_APART ? 3 : 2; k >= 0; k--) {
      double left = w * largest(&b->norms, k + 1, &d, false);
      if (g > 0) left += g * largest(&b->norms, k + 2, &d, false);
      if (!(left * weight[k] < least)) continue;
      least = left * weight[k];
      slope = left * slope_weight[k];
      how[i] = (unsigned char)k;
    }
    t->rest += least;
    t->rest_slope += slope;
    /* At a distance that counts as 0 the evaluator leaves the derivatives out. */
    distances at = between(&b->norms, fmax(middle, 1e-90), fmax(middle, 1e-90));
    add_sizes(b, &d, &at, w, g, t);
    if (how[i] < 3) continue;
    t->size3 += w * largest(&b->norms, 3, &d, true) + g * largest(&b->norms, 4, &d, true);
    add_thirds(b, j, t);
  }
}

/* Derivatives in the middle of those terms of a leaf whose model has order `wanted`, by the evaluator's own sum. */
static void sum_terms(const bounding *b, const size_t *order, size_t count, const unsigned char *how, unsigned wanted,
                      const tally *t, double sums[SPLINE_SUMS]) {
  const spline_terms *all = &b->spline->terms;
  double x[3][CLUSTER_LEAF], w[CLUSTER_LEAF], g[3][CLUSTER_LEAF];
  double at[3][SPLINE_LANES], lanes[SPLINE_SUMS][SPLINE_LANES] = {{0}};
  spline_terms few = {.n = all->n, .power = all->power, .x = {x[0], x[1], x[2]}, .w = w, .g = {g[0], g[1], g[2]}};
  for (int hermite = 0; hermite < 2; hermite++)
    for (size_t i = 0; i < count; i++) {
      size_t j = order[i], to = few.plain + few.hermite;
      if (how[i] != wanted || (j >= all->plain) != hermite) continue;
      w[to] = all->w[j];
      for (unsigned a = 0; a < all->n; a++) {
        x[a][to] = all->x[a][j];
        if (hermite) g[a][few.hermite] = all->g[a][j - all->plain];
      }
      *(hermite ? &few.hermite : &few.plain) += 1;
    }
  if (few.plain + few.hermite == 0) return;
  for (unsigned a = 0; a < 3; a++)
    for (unsigned lane = 0; lane < SPLINE_LANES; lane++) at[a][lane] = t->middle[a];
  b->sum(&few, 2, at, lanes);
  for (unsigned q = 0; q < SPLINE_SUMS; q++) sums[q] += lanes[q][0];
}

static void add_leaf(const bounding *b, const spline_cluster *c, tally *t) {
  unsigned char how[CLUSTER_LEAF];
  const size_t *order = b->spline->clusters.order + c->low;
  size_t count = c->high - c->low;
  choose_orders(b, order, count, t, how);
  double constant[SPLINE_SUMS] = {0}, linear[SPLINE_SUMS] = {0};
  sum_terms(b, order, count, how, 0, t, constant);
  sum_terms(b, order, count, how, 1, t, linear);
  for (unsigned q = 1; q < SPLINE_SUMS; q++) t->taken[q] += constant[q] + (q < 4 ? 0 : linear[q]);
}

/* |D^order| of a far cluster, order 3 or 4. */
static double norm_of_cluster(const bounding *b, const spline_cluster *c, const distances *d, int order) {
  double norm[4], apart, together = 0;
  for (int k = 0; k < 4; k++) norm[k] = largest(&b->norms, order + k, d, false);
  apart = c->w * norm[0] + c->g * norm[1];
  for (int k = 0; k < 4; k++) together += c->moments[k] * norm[k];
  return fmin(apart, together);
}

static void add_far_cluster(const bounding *b, const spline_cluster *c, const distances *d, tally *t) {
  const double square_half = t->rho * t->rho / 2;
  double left = norm_of_cluster(b, c, d, 3) * square_half, slope = left; /* of the gradient */
  left *= t->rho / 3;
  if (b->spline->terms.hermite && d->r[0] > THIRDS_APART) {
    double fourth = norm_of_cluster(b, c, d, 4) * square_half * t->rho / 3;
    if (fourth * t->rho / 4 < left) {
      left = fourth * t->rho / 4;
      slope = fourth;
      t->size3 += c->w * largest(&b->norms, 3, d, true) + c->g * largest(&b->norms, 4, d, true);
      for (size_t i = c->low; i < c->high; i++) add_thirds(b, b->spline->clusters.order[i], t);
    }
  }
  t->rest += left;
  t->rest_slope += slope;
  add_sizes(b, d, d, c->w, c->g, t);
}

/* Walks the clusters: far ones at once, near ones term by term. */
static void add_clusters(const bounding *b, tally *t) {
  const spline_cluster *nodes = b->spline->clusters.nodes;
  size_t stack[STACK], top = 0;
  if (nodes) stack[top++] = 0;
  while (top > 0) {
    size_t i = stack[--top];
    const spline_cluster *c = nodes + i;
    distances d = distances_of_box(b, t, c->lower, c->upper);
    double square = 0;
    for (unsigned a = 0; a < b->spline->parts.n; a++)
      square += (c->upper[a] - c->lower[a]) * (c->upper[a] - c->lower[a]);
    /* Farther than the box is large, too: else a term by itself may be bounded better by a lower order. */
    if (d.r[0] > 0 && sqrt(square) <= OPENING * d.r[0] && t->rho <= d.r[0]) {
      add_far_cluster(b, c, &d, t);
    } else if (spline_cluster_is_leaf(c)) {
      add_leaf(b, c, t);
    } else {
      stack[top++] = 2 * i + 2;
      stack[top++] = 2 * i + 1;
    }
  }
}

/* Of the polynomial only cubes are missing in the model; sizes by the largest coordinate. */
static void add_polynomial(const batten_spline *s, tally *t) {
  double most = 0;
  for (unsigned a = 0; a < s->parts.n; a++) most = fmax(most, fmax(fabs(t->lower[a]), fabs(t->upper[a])));
  for (unsigned q = 0; q < s->basis.count; q++) {
    const unsigned char *e = s->basis.exponent[q];
    int degree = e[0] + e[1] + e[2];
    double c = fabs(s->parts.polynomial[q]), cube = c;
    t->size += c * whole_power(most, degree);
    if (degree > 0) t->size1 += c * degree * whole_power(most, degree - 1);
    if (degree > 1) t->size2 += c * degree * (degree - 1) * whole_power(most, degree - 2);
    for (unsigned a = 0; a < 3; a++) cube *= whole_power(t->radius[a], e[a]);
    if (degree != 3) continue;
    t->rest += cube;
    t->rest_slope += 3 * c * t->rho * t->rho; /* |D x_a x_b x_c| <= rho^2 for each of the three */
  }
}

static tally start_tally(const batten_spline *s, const taylor_box *box) {
  const batten_spline_parts *p = &s->parts;
  tally t = {.rest = 0};
  double square = 0;
  for (unsigned a = 0; a < p->n; a++) {
    t.lower[a] = spline_to_box(box->lower[a], p->origin[a], p->scale);
    t.upper[a] = spline_to_box(box->upper[a], p->origin[a], p->scale);
    t.middle[a] = spline_to_box(box->middle[a], p->origin[a], p->scale);
    t.radius[a] = fmax(box->radius[a] / p->scale, fmax(t.upper[a] - t.middle[a], t.middle[a] - t.lower[a]));
    square += t.radius[a] * t.radius[a];
  }
  t.rho = sqrt(square) * (1 + 0x1p-48);
  return t;
}

static void model_box(const bounding *b, size_t i) {
  const batten_spline *s = b->spline;
  const unsigned n = s->parts.n;
  const double scale = s->parts.scale;
  tally t = start_tally(s, b->boxes + i);
  add_clusters(b, &t);
  close_thirds(b, &t);
  add_polynomial(s, &t);
  taylor m = {.value = b->values[i], .range = interval_all(), .steep = batten_steep_unknown()};
  double most = 0;
  for (unsigned a = 0; a < n; a++) {
    most = fmax(most, fmax(fabs(t.lower[a]), fabs(t.upper[a])));
    m.slope[a] = b->gradients[i * n + a] - t.taken[1 + a] / scale;
    for (unsigned c = a; c < n; c++)
      m.bend[TAYLOR_BEND[a][c]] = b->hessians[(i * n + a) * n + c] - t.taken[4 + TAYLOR_BEND[a][c]] / scale / scale;
  }
  /* Roundings: of the sum in the middle and at the point; of the coefficients; of the way into the unit box, which
   * moves the points by as much as their coordinates are wrong. */
  m.rest = t.rest * (1 + 0x1p-40) +
           b->rounding * (2 * t.size + t.size1 * (2 * t.rho + most) + t.size2 * t.rho * t.rho) + 0x1p-1000;
  m.rest_slope = (t.rest_slope * (1 + 0x1p-40) + b->rounding * (2 * t.size1 + t.size2 * (2 * t.rho + most))) / scale *
                     (1 + 0x1p-40) +
                 0x1p-1000;
  b->models[i] = m;
}

static void model_task(void *arg, size_t index) {
  const bounding *b = arg;
  size_t first = index * TASK_BOXES, last = b->count - first < TASK_BOXES ? b->count : first + TASK_BOXES;
  for (; first < last; first++) model_box(b, first);
}

/* ---- all of them --------------------------------------------------------------------------------- */

batten_status batten_spline_models(batten_context *ctx, const batten_spline *s, size_t count, const taylor_box *boxes,
                                   taylor *models) {
  const size_t n = s->parts.n;
  double *numbers = batten_alloc_array(ctx, BLOCK, (2 * n + 1 + n * n) * sizeof *numbers);
  if (!numbers) return BATTEN_E_NOMEM;
  double *values = numbers + BLOCK * n, *gradients = values + BLOCK, *hessians = gradients + BLOCK * n;
  bounding b = {.spline = s,
                .sum = batten_spline_code()->sum,
                .norms = norms_of(s->parts.n, s->terms.power),
                .rounding = EPS * (STEPS + (double)s->parts.count / CHUNK),
                .values = values,
                .gradients = gradients,
                .hessians = hessians};
  batten_status st = BATTEN_OK;
  for (size_t first = 0; st >= 0 && first < count; first += BLOCK) {
    b.count = count - first < BLOCK ? count - first : BLOCK;
    b.boxes = boxes + first;
    b.models = models + first;
    for (size_t i = 0; i < b.count; i++)
      for (size_t a = 0; a < n; a++) numbers[i * n + a] = b.boxes[i].middle[a];
    st = batten_spline_evaluate(ctx, s, b.count, numbers, values, gradients, hessians);
    if (st < 0) break;
    batten_parallel(ctx, (b.count + TASK_BOXES - 1) / TASK_BOXES, model_task, &b);
  }
  batten_free(ctx, numbers);
  return st;
}

batten_status batten_spline_bounds(batten_context *ctx, const batten_spline *s, size_t count, const double *boxes,
                                   double *ranges) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!s) return batten_fail(ctx, BATTEN_E_INVALID, "s: NULL; make it with batten_spline_fit() or _create()");
  if (count == 0) return BATTEN_OK;
  const unsigned n = s->parts.n;
  batten_status st = batten_check_boxes(ctx, n, count, boxes, ranges);
  if (st < 0) return st;
  taylor_box *box = batten_alloc_array(ctx, BLOCK, sizeof *box);
  taylor *model = box ? batten_alloc_array(ctx, BLOCK, sizeof *model) : NULL;
  if (!model) st = BATTEN_E_NOMEM;
  for (size_t first = 0; st >= 0 && first < count; first += BLOCK) {
    size_t now = count - first < BLOCK ? count - first : BLOCK;
    for (size_t i = 0; i < now; i++) box[i] = batten_taylor_box(n, boxes + (first + i) * 2 * n);
    st = batten_spline_models(ctx, s, now, box, model);
    for (size_t i = 0; st >= 0 && i < now; i++) {
      interval r = batten_taylor_range(n, box + i, model + i);
      ranges[2 * (first + i)] = r.lo;
      ranges[2 * (first + i) + 1] = r.hi;
    }
  }
  batten_free(ctx, model);
  batten_free(ctx, box);
  return st;
}
