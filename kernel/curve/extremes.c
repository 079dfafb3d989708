/* The box of a curve, and its least and largest curvature.
 *
 * Both are where a polynomial of each span vanishes: a coordinate of x' for the box, and for the curvature [x', x'']
 * / |x'|^3 the numerator of its derivative, [x', x'''] |x'|^2 - 3 [x', x''] (x' . x''), degree 4 d - 6. In Bernstein
 * form the coefficients change their sign at least as often as there are roots: parts of a span are halved until it
 * is not at all or once. Spans whose control points say that they cannot hold an extreme are passed over. */
#include "curve_inner.h"

#include "basis/refine.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum {
  TERMS = 4 * BSPLINE_DEGREE - 5, /* coefficients of the largest polynomial */
  DEPTH = 48,                     /* halvings of a span */
  VISITS = 1000                   /* parts of a span: more of them only rounding can ask for */
};

/* ---- roots --------------------------------------------------------------------------------------- */

typedef struct polynomial {
  unsigned degree;
  double noise; /* coefficients that small may have any sign */
  double c[TERMS];
} polynomial;

static double value_at(const polynomial *p, double u) {
  double work[TERMS];
  memcpy(work, p->c, (p->degree + 1) * sizeof *work);
  for (unsigned left = p->degree; left > 0; left--)
    for (unsigned k = 0; k < left; k++) work[k] = (1 - u) * work[k] + u * work[k + 1];
  return work[0];
}

/* How often the sign changes; *rises: from - to + at last. *quiet: nothing but noise. */
static unsigned count_changes(const polynomial *p, const double *c, bool *rises, bool *quiet) {
  unsigned changes = 0;
  int sign = 0;
  *rises = false;
  for (unsigned k = 0; k <= p->degree; k++) {
    int own = c[k] > p->noise ? 1 : c[k] < -p->noise ? -1 : 0;
    if (own == 0) continue;
    if (sign != 0 && own != sign) changes++;
    *rises = own > 0;
    sign = own;
  }
  *quiet = sign == 0;
  return changes;
}

static double bisect(const polynomial *p, double low, double high, bool rises) {
  for (int step = 0; step < 60; step++) {
    double middle = low + 0.5 * (high - low);
    if (!(middle > low && middle < high)) break;
    if ((value_at(p, middle) > 0) == rises)
      high = middle;
    else
      low = middle;
  }
  return low;
}

/* A walk over the parts of [0, 1] at which roots are; starts with all 0. */
typedef struct root_walk {
  unsigned depth, visits;
  double index; /* the part [index, index + 1] / 2^depth is the next */
  bool done;
} root_walk;

static void step_over(root_walk *w) {
  w->index += 1;
  while (w->depth > 0 && fmod(w->index, 2) == 0) {
    w->index *= 0.5;
    w->depth--;
  }
  w->done = w->depth == 0;
}

/* The next root, or place where there may be one; false when there are no more. */
static bool next_root(const polynomial *p, root_walk *w, double *root) {
  while (!w->done && w->visits < VISITS) {
    double width = ldexp(1, -(int)w->depth), from = w->index * width, to = from + width, c[TERMS];
    bool rises, quiet;
    memcpy(c, p->c, (p->degree + 1) * sizeof *c);
    curve_restrict(p->degree, 1, from, to, c);
    unsigned changes = count_changes(p, c, &rises, &quiet);
    w->visits++;
    if (changes > 1 && w->depth < DEPTH) {
      w->depth++;
      w->index *= 2;
      continue;
    }
    step_over(w);
    if (changes == 0 && !quiet) continue;
    *root = changes == 1 ? bisect(p, from, to, rises) : from + 0.5 * width;
    return true;
  }
  return false;
}

/* ---- the box ------------------------------------------------------------------------------------- */

static void include(const batten_curve *curve, size_t mu, double u, double lower[2], double upper[2]) {
  double point[1][2];
  curve_jet(&curve->space, curve->control_points, mu, curve_span_at(&curve->space, mu, u), 0, point);
  for (int x = 0; x < 2; x++) {
    lower[x] = fmin(lower[x], point[0][x]);
    upper[x] = fmax(upper[x], point[0][x]);
  }
}

void curve_find_box(const batten_curve *curve, double lower[2], double upper[2]) {
  const bspline *b = &curve->space;
  double middle[2], unit = ldexp(1, curve->exponent);
  curve_find_middle(curve, middle);
  for (int x = 0; x < 2; x++) lower[x] = upper[x] = curve->control_points[x];
  for (size_t mu = bspline_first(b); mu < b->count; mu = bspline_next(b, mu)) include(curve, mu, 1, lower, upper);
  for (size_t mu = bspline_first(b); mu < b->count; mu = bspline_next(b, mu)) {
    curve_piece piece;
    curve_piece_make(curve, mu, middle, &piece);
    for (int x = 0; x < 2; x++) {
      double low = (lower[x] - middle[x]) * unit, high = (upper[x] - middle[x]) * unit;
      bool beyond = false;
      for (unsigned i = 0; i <= piece.degree; i++)
        beyond = beyond || piece.point[i][x] < low || piece.point[i][x] > high;
      if (!beyond) continue;
      polynomial p = {.degree = piece.degree - 1};
      root_walk walk = {0};
      double most = 0, root;
      for (unsigned i = 0; i <= p.degree; i++) most = fmax(most, fabs(p.c[i] = piece.first[i][x]));
      p.noise = 4 * DBL_EPSILON * most;
      while (next_root(&p, &walk, &root)) include(curve, mu, root, lower, upper);
    }
  }
}

/* ---- curvature ----------------------------------------------------------------------------------- */

typedef struct extremes {
  const batten_curve *curve;
  double value[2], at[2]; /* scaled unit */
} extremes;

static double largest(unsigned degree, const double (*net)[2]) {
  double most = 0;
  for (unsigned i = 0; i <= degree; i++) most = fmax(most, hypot(net[i][0], net[i][1]));
  return most;
}

static void try_place(extremes *e, const curve_piece *piece, size_t mu, double u) {
  double first[2], second[2] = {0, 0}, tangent[2], value;
  unsigned n = piece->degree - 1;
  curve_net_at(n, (const double(*)[2])piece->first, u, first);
  if (n > 0) curve_net_at(n - 1, (const double(*)[2])piece->second, u, second);
  double speed = hypot(first[0], first[1]);
  if (!(speed > 4 * DBL_EPSILON * largest(n, (const double(*)[2])piece->first))) return;
  for (int x = 0; x < 2; x++) tangent[x] = first[x] / speed;
  value = curve_curvature(tangent, speed, second);
  for (int k = 0; k < 2; k++)
    if (isnan(e->value[k]) || (k == 0 ? value < e->value[k] : value > e->value[k])) {
      e->value[k] = value;
      e->at[k] = curve_span_at(&e->curve->space, mu, u);
    }
}

/* In the polynomials that follow coefficient k is times the binomial coefficient, so that products are plain ones. */
static void scale_row(unsigned degree, double *c, bool back) {
  double binomial = 1;
  for (unsigned k = 0; k <= degree; k++) {
    c[k] = back ? c[k] / binomial : c[k] * binomial;
    binomial = binomial * (degree - k) / (k + 1);
  }
}

/* out += factor a b */
static void add_product(unsigned p, const double *a, unsigned q, const double *b, double factor, double *out) {
  for (unsigned i = 0; i <= p; i++)
    for (unsigned j = 0; j <= q; j++) out[i + j] += factor * a[i] * b[j];
}

/* x', x'', x''' of a piece of degree >= 2 by coordinates, and [x', x'']. */
typedef struct rows {
  unsigned degree; /* of x' */
  double first[2][BSPLINE_ORDER], second[2][BSPLINE_ORDER], third[2][BSPLINE_ORDER], cross[TERMS];
} rows;

static void make_rows(const curve_piece *piece, rows *r) {
  unsigned n = r->degree = piece->degree - 1;
  memset(r->cross, 0, sizeof r->cross);
  for (int x = 0; x < 2; x++) {
    for (unsigned i = 0; i <= n; i++) r->first[x][i] = piece->first[i][x];
    for (unsigned i = 0; i + 1 <= n; i++) r->second[x][i] = piece->second[i][x];
    for (unsigned i = 0; i + 2 <= n; i++) r->third[x][i] = (n - 1) * (piece->second[i + 1][x] - piece->second[i][x]);
    scale_row(n, r->first[x], false);
    scale_row(n - 1, r->second[x], false);
    if (n > 1) scale_row(n - 2, r->third[x], false);
  }
  add_product(n, r->first[0], n - 1, r->second[1], 1, r->cross);
  add_product(n, r->first[1], n - 1, r->second[0], -1, r->cross);
}

/* Whether the piece may hold a curvature beyond those that were met: from the coefficients of [x', x''] and the least
 * that x' goes in its mean direction. */
static bool may_exceed(const extremes *e, const curve_piece *piece, const rows *r) {
  unsigned n = r->degree;
  double sum[2] = {0, 0}, least = INFINITY, cross[TERMS], low = INFINITY, high = -INFINITY;
  for (unsigned i = 0; i <= n; i++)
    for (int x = 0; x < 2; x++) sum[x] += piece->first[i][x];
  double length = hypot(sum[0], sum[1]), most = largest(n, (const double(*)[2])piece->first);
  if (!(length > 0)) return true; /* it ends where it begins */
  for (unsigned i = 0; i <= n; i++)
    least = fmin(least, (piece->first[i][0] * sum[0] + piece->first[i][1] * sum[1]) / length);
  if (!(least > 1e-8 * most) || isnan(e->value[0])) return true;
  memcpy(cross, r->cross, sizeof cross);
  scale_row(2 * n - 1, cross, true);
  for (unsigned k = 0; k <= 2 * n - 1; k++) {
    low = fmin(low, cross[k]);
    high = fmax(high, cross[k]);
  }
  double fast = most * most * most, slow = least * least * least;
  return low / (low < 0 ? slow : fast) < e->value[0] || high / (high > 0 ? slow : fast) > e->value[1];
}

/* The numerator of the derivative of curvature. */
static void make_slope(const curve_piece *piece, const rows *r, polynomial *p) {
  unsigned n = r->degree;
  double square[TERMS] = {0}, dot[TERMS] = {0}, cross[TERMS] = {0};
  for (int x = 0; x < 2; x++) {
    add_product(n, r->first[x], n, r->first[x], 1, square);
    add_product(n, r->first[x], n - 1, r->second[x], 1, dot);
  }
  memset(p, 0, sizeof *p);
  p->degree = 4 * n - 2;
  if (n > 1) {
    add_product(n, r->first[0], n - 2, r->third[1], 1, cross);
    add_product(n, r->first[1], n - 2, r->third[0], -1, cross);
    add_product(2 * n - 2, cross, 2 * n, square, 1, p->c);
  }
  add_product(2 * n - 1, r->cross, 2 * n - 1, dot, -3, p->c);
  scale_row(p->degree, p->c, true);
  /* Both terms are products of four, the differences among which go with the second derivative. */
  double first = largest(n, (const double(*)[2])piece->first),
         second = largest(n - 1, (const double(*)[2])piece->second);
  p->noise = 8 * DBL_EPSILON * first * first * second * ((n > 1 ? 2 * (n - 1) * first : 0) + 3 * second);
}

/* The whole piece, halved where x' is not steady: parts have a noise of their own, which hides less where x' is small
 * beside what it is elsewhere. */
static void search_piece(extremes *e, const curve_piece *piece, size_t mu) {
  enum { HALVINGS = 24 };
  if (piece->degree < 2) return; /* straight */
  unsigned n = piece->degree - 1, depth = 0;
  double index = 0; /* the part [index, index + 1] / 2^depth is the next */
  for (;;) {
    double width = ldexp(1, -(int)depth), from = index * width, root;
    curve_piece part = *piece;
    rows r;
    curve_restrict(n, 2, from, from + width, part.first[0]);
    curve_restrict(n - 1, 2, from, from + width, part.second[0]);
    for (unsigned i = 0; i <= n; i++)
      for (int x = 0; x < 2; x++) {
        part.first[i][x] *= width;
        part.second[i][x] *= width * width;
      }
    make_rows(&part, &r);
    if (may_exceed(e, &part, &r)) {
      if (depth < HALVINGS && !curve_is_steady(n, (const double(*)[2])part.first)) {
        depth++;
        index *= 2;
        continue;
      }
      polynomial p;
      root_walk walk = {0};
      make_slope(&part, &r, &p);
      while (next_root(&p, &walk, &root)) try_place(e, piece, mu, from + root * width);
    }
    index += 1;
    for (; depth > 0 && fmod(index, 2) == 0; depth--) index *= 0.5;
    if (depth == 0) return;
  }
}

void curve_find_curvatures(const batten_curve *curve, double value[2], double at[2]) {
  const bspline *b = &curve->space;
  extremes e = {curve, {NAN, NAN}, {NAN, NAN}};
  double middle[2];
  curve_piece piece;
  curve_find_middle(curve, middle);
  for (size_t mu = bspline_first(b); mu < b->count; mu = bspline_next(b, mu)) {
    curve_piece_make(curve, mu, middle, &piece);
    for (int k = 0; k <= 4; k++) try_place(&e, &piece, mu, 0.25 * k);
  }
  for (size_t mu = bspline_first(b); mu < b->count; mu = bspline_next(b, mu)) {
    curve_piece_make(curve, mu, middle, &piece);
    search_piece(&e, &piece, mu);
  }
  for (int k = 0; k < 2; k++) {
    value[k] = ldexp(e.value[k], curve->exponent);
    at[k] = e.at[k];
  }
}
