/* The proof that w is positive on a rectangle, by bisection of its Bernstein coefficients.
 *
 * On a box all coefficients of w have to be positive by more than their errors. A coefficient at a corner is a value
 * of w; one that is not positive beyond its error stays so, and ends the proof.
 *
 * Where w vanishes at s = 0, as it does at flat points of the sections, w = w_0(r) + s q(s, r), and beside w itself q
 * may be positive: its coefficients are q_(i-1) = n / i (w_i - w_0). With q >= k > 0 and w_0 >= -z then w > 0 beyond
 * s = z / k, and w >= -z up to there; z has to be below what the rounding of the control points leaves open.
 *
 * Of the margin: with |x_u|^2 = S between S_0 and S_1 on a box |x_u|^3 is below the chord alpha + beta S of S^(3/2),
 * and w - kappa (alpha + beta S) > 0 shows that the curvature is above kappa, a share of the least that can be proven
 * at places that were met, which falls while the proof goes on. Chord and coefficients come near the values with the
 * square of a box's size. */
#include "certify_sections.h"

#include <math.h>
#include <string.h>

#include "certify.h"

/* No zero may be further from a flat end than this part of the stretch. */
static const double FAR = 0.25;

/* ---- sheets --------------------------------------------------------------------------------------- */

/* De Casteljau's algorithm at 1/2, as for the rows themselves, which are rounded once on each level. */
static void halve_bounds(unsigned degree, double *lower, double *upper, const double *most) {
  double work[SECTIONS_ROWS], size[SECTIONS_ROWS];
  memcpy(work, lower, (degree + 1) * sizeof *work);
  memcpy(size, most, (degree + 1) * sizeof *size);
  for (unsigned level = 0;; level++) {
    unsigned last = degree - level;
    lower[level] = work[0];
    upper[last] = work[last];
    if (last == 0) return;
    for (unsigned i = 0; i < last; i++) {
      size[i] = 0.5 * (size[i] + size[i + 1]) * CERTIFY_UP;
      work[i] = (0.5 * (work[i] + work[i + 1]) + CERTIFY_EPS * size[i]) * CERTIFY_UP + CERTIFY_TINY;
    }
  }
}

void sections_halve(unsigned axis, sections_sheet *lower, sections_sheet *upper, double *work) {
  unsigned degree = lower->degree[axis];
  double *c = upper->c;
  certify_bisect(axis, lower->dim, lower->degree[0] + 1, lower->degree[1] + 1, lower->c, c, work);
  if (axis == 0) {
    double most[SECTIONS_ROWS], upper_error[SECTIONS_ROWS], upper_most[SECTIONS_ROWS];
    memcpy(most, lower->most, sizeof most);
    halve_bounds(degree, lower->error, upper_error, most);
    halve_bounds(degree, lower->most, upper_most, most);
    *upper = *lower;
    memcpy(upper->error, upper_error, (degree + 1) * sizeof *upper_error);
    memcpy(upper->most, upper_most, (degree + 1) * sizeof *upper_most);
  } else {
    for (unsigned k = 0; k <= lower->degree[0]; k++) {
      lower->error[k] = (lower->error[k] + degree * CERTIFY_EPS * lower->most[k]) * CERTIFY_UP + CERTIFY_TINY;
      lower->most[k] *= CERTIFY_UP;
    }
    *upper = *lower;
  }
  upper->c = c;
}

static void swap(double *a, double *b) {
  double keep = *a;
  *a = *b;
  *b = keep;
}

void sections_reverse(sections_sheet *p) {
  size_t rows = p->degree[0] + 1, columns = p->degree[1] + 1;
  for (unsigned i = 0, j = p->degree[0]; i < j; i++, j--) {
    swap(&p->error[i], &p->error[j]);
    swap(&p->most[i], &p->most[j]);
    for (size_t x = 0; x < p->dim; x++)
      for (size_t l = 0; l < columns; l++)
        swap(&p->c[(x * rows + i) * columns + l], &p->c[(x * rows + j) * columns + l]);
  }
}

/* ---- places --------------------------------------------------------------------------------------- */

/* |a|^3 from above at coefficient (k, l). */
static double cube_above(const sections_sheet *a, size_t k, size_t l) {
  size_t columns = a->degree[1] + 1, count = (a->degree[0] + 1) * columns;
  double square = 0;
  for (size_t x = 0; x < a->dim; x++) {
    double c = fabs(a->c[x * count + k * columns + l]) + a->error[k];
    square += c * c;
  }
  square = square * CERTIFY_UP + CERTIFY_TINY;
  return square * sqrt(square) * CERTIFY_UP + CERTIFY_TINY; /* which may underflow */
}

/* Curvature of w; a huge one is cut. */
static double scaled(double w, double cube, double factor) {
  double value = w / cube * factor;
  return isnan(value) ? 0 : fmax(fmin(value, 0x1p1000), -0x1p1000);
}

static void meet(const sections_stretch *t, const sections_box *b, int k, double value, sections_record *record) {
  if (!(value < record->least)) return;
  double part[2] = {b->lower[0] + (k & 1 ? b->width[0] : 0), b->lower[1] + (k & 2 ? b->width[1] : 0)};
  record->least = value;
  for (int i = 0; i < 2; i++) record->least_at[i] = (1 - part[i]) * t->from[i] + part[i] * t->to[i];
}

/* q at s = 0 in column l, with its error. */
static double slope_at(const sections_sheet *w, size_t l, double *error) {
  double n = w->degree[0], up = w->c[w->degree[1] + 1 + l], at = w->c[l];
  *error = n * (w->error[0] + w->error[1] + 4 * CERTIFY_EPS * (fabs(up) + fabs(at))) * CERTIFY_UP + CERTIFY_TINY;
  return n * (up - at);
}

/* At a corner of a flat end: w may be 0 there when it grows from there on. */
static int look_at_flat(const sections_stretch *t, const sections_box *b, size_t l) {
  double w = b->w.c[l], error;
  if (w > b->w.error[0]) return SECTIONS_OPEN;
  if (b->w.error[0] - w > 2 * t->allowed) return SECTIONS_VIOLATED;
  double slope = slope_at(&b->w, l, &error);
  return slope > error ? SECTIONS_OPEN : slope < -error ? SECTIONS_VIOLATED : SECTIONS_UNPROVEN;
}

/* VIOLATED: w is not positive at a corner beyond rounding. UNPROVEN: no proof can include a corner. */
static int look_at_corners(const sections_stretch *t, const sections_box *b, sections_record *record) {
  const sections_sheet *w = &b->w, *a = &b->a;
  int verdict = SECTIONS_OPEN;
  for (int k = 0; k < 4; k++) {
    size_t i = k & 1 ? w->degree[0] : 0, l = k & 2 ? w->degree[1] : 0;
    double value = w->c[i * (w->degree[1] + 1) + l];
    double cube = cube_above(a, k & 1 ? a->degree[0] : 0, k & 2 ? a->degree[1] : 0);
    meet(t, b, k, scaled(value, cube, t->factor), record);
    int found = SECTIONS_OPEN;
    if (t->flat && b->lower[0] == 0 && !(k & 1)) {
      found = look_at_flat(t, b, l);
    } else {
      record->target = fmin(record->target, scaled(value - w->error[i], cube, t->factor));
      if (!(value > w->error[i])) found = SECTIONS_VIOLATED;
    }
    if (found == SECTIONS_VIOLATED || verdict == SECTIONS_OPEN) verdict = found;
  }
  return verdict;
}

/* ---- boxes ---------------------------------------------------------------------------------------- */

/* The direction in which c bends more: the distance of coefficients from values shrinks with the squares of sides. */
static unsigned longer_axis(const sections_sheet *p) {
  size_t rows = p->degree[0] + 1, columns = p->degree[1] + 1;
  double across[2] = {0, 0};
  for (size_t x = 0; x + 2 * columns < rows * columns; x++)
    across[0] = fmax(across[0], fabs(p->c[x] - 2 * p->c[x + columns] + p->c[x + 2 * columns]));
  for (size_t i = 0; i < rows; i++)
    for (size_t j = 0; j + 2 < columns; j++) {
      const double *c = p->c + i * columns + j;
      across[1] = fmax(across[1], fabs(c[0] - 2 * c[1] + c[2]));
    }
  for (int axis = 0; axis < 2; axis++) across[axis] *= p->degree[axis] * (double)p->degree[axis];
  return across[1] > across[0];
}

static double least_of(const sections_sheet *w) {
  double least = INFINITY;
  const double *c = w->c;
  for (unsigned i = 0; i <= w->degree[0]; i++)
    for (unsigned j = 0; j <= w->degree[1]; j++, c++) least = *c - w->error[i] < least ? *c - w->error[i] : least;
  return least;
}

/* What the coefficients of w and of x_u tell of curvature. */
static double rough_bound(const sections_stretch *t, const sections_box *b) {
  double cube = 0;
  for (size_t k = 0; k <= b->a.degree[0]; k++)
    for (size_t l = 0; l <= b->a.degree[1]; l++) cube = fmax(cube, cube_above(&b->a, k, l));
  double bound = scaled(b->least / CERTIFY_UP, cube, t->factor);
  return bound / CERTIFY_UP;
}

/* alpha + beta S >= S^(3/2) between S_0 and S_1. */
static void find_chord(const sections_sheet *square, double *alpha, double *beta) {
  double low = INFINITY, high = 0;
  const double *c = square->c;
  for (unsigned i = 0; i <= square->degree[0]; i++)
    for (unsigned j = 0; j <= square->degree[1]; j++, c++) {
      low = fmin(low, *c - square->error[i]);
      high = fmax(high, *c + square->error[i]);
    }
  low = fmax(low, 0) / CERTIFY_UP;
  high *= CERTIFY_UP;
  double at_low = low * sqrt(low), at_high = high * sqrt(high), width = high - low;
  *beta = width > 1e-6 * high ? (at_high - at_low) / width : 1.5 * sqrt(high);
  *alpha = fmax(at_high - *beta * high, at_low - *beta * low) + 16 * CERTIFY_EPS * (at_high + *beta * high);
  *alpha += CERTIFY_TINY; /* powers may underflow */
}

/* w of a degree higher by 2 in s. */
static void raise_twice(const sections_sheet *w, sections_sheet *out) {
  unsigned p = w->degree[0];
  size_t columns = w->degree[1] + 1;
  double from[SECTIONS_ROWS], to[SECTIONS_ROWS];
  const double two[3] = {1, 2, 1};
  certify_binomials(p, from);
  certify_binomials(p + 2, to);
  *out = (sections_sheet){.dim = 1, .degree = {p + 2, w->degree[1]}, .c = out->c};
  memset(out->c, 0, sections_count(out) * sizeof *out->c);
  for (unsigned i = 0; i <= p; i++)
    for (unsigned k = 0; k < 3; k++) {
      double weight = from[i] * two[k] / to[i + k];
      for (size_t j = 0; j < columns; j++) out->c[(i + k) * columns + j] += weight * w->c[i * columns + j];
      out->error[i + k] += weight * w->error[i];
      out->most[i + k] += weight * w->most[i];
    }
  for (unsigned i = 0; i <= p + 2; i++) {
    out->most[i] *= CERTIFY_UP;
    out->error[i] = (out->error[i] + 8 * CERTIFY_EPS * out->most[i]) * CERTIFY_UP + CERTIFY_TINY;
  }
}

/* Whether curvature is above kappa on the box, which otherwise is prepared for bisection. */
static bool is_above(const sections_search *search, const sections_stretch *t, double kappa, sections_box *b) {
  double local = kappa / t->factor * CERTIFY_UP, alpha, beta;
  if (!(local < 0x1p500)) return false; /* nothing but products beyond doubles */
  sections_sheet p = {.c = search->room}, square = {.c = NULL};
  raise_twice(&b->w, &p);
  square.c = p.c + sections_count(&p);
  sections_square(search->plan, &b->a, square.c + sections_count(&p), &square);
  find_chord(&square, &alpha, &beta);
  double constant = local * alpha, slope = local * beta;
  size_t columns = p.degree[1] + 1;
  bool above = true;
  for (size_t i = 0; i <= p.degree[0]; i++) {
    double size = p.most[i] + slope * square.most[i] + fabs(constant);
    double error = (p.error[i] + slope * square.error[i] + 6 * CERTIFY_EPS * size) * CERTIFY_UP + CERTIFY_TINY;
    for (size_t x = i * columns; x < (i + 1) * columns; x++) {
      p.c[x] -= constant + slope * square.c[x];
      above = above && p.c[x] > error;
    }
  }
  if (!above) b->axis = longer_axis(&p);
  return above;
}

/* Whether q is positive on a box at a flat end, and w beyond a place near enough to it. */
static bool grows(const sections_stretch *t, const sections_box *b) {
  const sections_sheet *w = &b->w;
  size_t n = w->degree[0], columns = w->degree[1] + 1;
  double z = 0, least = INFINITY;
  for (size_t l = 0; l < columns; l++) z = fmax(z, w->error[0] - w->c[l]);
  z *= CERTIFY_UP;
  if (n == 0 || !(z <= 2 * t->allowed)) return false;
  for (size_t i = 1; i <= n; i++) {
    double factor = (double)n / (double)i;
    for (size_t l = 0; l < columns; l++) {
      double up = w->c[i * columns + l], at = w->c[l];
      double error = w->error[i] + w->error[0] + 4 * CERTIFY_EPS * (fabs(up) + fabs(at));
      least = fmin(least, factor * (up - at - error * CERTIFY_UP));
    }
  }
  least /= CERTIFY_UP;
  /* q in the box's own part: w > 0 beyond s = z / least of it. */
  return least > 0 && z / least * CERTIFY_UP <= fmin(1, FAR / b->width[0]);
}

/* Looks at a new box. OPEN: to be bisected. */
static int judge(const sections_search *search, const sections_stretch *t, sections_box *b, sections_record *record) {
  record->boxes++;
  unsigned depth = b->depth[0] > b->depth[1] ? b->depth[0] : b->depth[1];
  if (depth > record->depth) record->depth = depth;
  int verdict = look_at_corners(t, b, record);
  if (verdict != SECTIONS_OPEN) return verdict;
  b->least = least_of(&b->w);
  b->bound = 0;
  b->axis = longer_axis(&b->w);
  if (b->least > 0) {
    if (!t->margin) return SECTIONS_PROVEN;
    double kappa = SECTIONS_SHARE * record->target;
    b->bound = rough_bound(t, b);
    if (b->bound > 0 && b->bound >= kappa) {
      record->bound = fmin(record->bound, b->bound);
      return SECTIONS_PROVEN;
    }
    if (kappa > 0 && search->box_limit > 0 && is_above(search, t, kappa, b)) {
      record->bound = fmin(record->bound, kappa);
      return SECTIONS_PROVEN;
    }
  } else if (t->flat && b->lower[0] == 0 && grows(t, b)) {
    return SECTIONS_PROVEN;
  }
  return SECTIONS_OPEN;
}

/* True when the box has a direction left to be bisected in: sets its axis. */
static bool can_cut(const sections_search *search, const sections_record *record, sections_box *b) {
  if (record->boxes >= search->box_limit) return false;
  if (b->depth[b->axis] >= search->depth_max) b->axis = 1 - b->axis;
  return b->depth[b->axis] < search->depth_max;
}

sections_box *sections_box_at(sections_search *search, size_t k) {
  sections_box *b = &search->stack[k];
  if (k < search->made) return b;
  size_t a = sections_a_count(search->plan), w = sections_w_count(search->plan);
  b->a.c = search->coefficients + k * (a + w);
  b->w.c = b->a.c + a;
  search->made = k + 1;
  return b;
}

/* Cuts the box into itself and `other`. */
static void cut(const sections_search *search, sections_box *b, sections_box *other) {
  unsigned axis = b->axis;
  double *a = other->a.c, *w = other->w.c;
  sections_sheet upper[2] = {{.c = a}, {.c = w}};
  sections_halve(axis, &b->a, &upper[0], search->room);
  sections_halve(axis, &b->w, &upper[1], search->room);
  b->depth[axis]++;
  b->width[axis] *= 0.5;
  *other = *b;
  other->a = upper[0];
  other->w = upper[1];
  other->lower[axis] = b->lower[axis] + b->width[axis];
}

/* A box that will not be cut: proven with what it has, or given up. */
static int settle(const sections_box *b, sections_record *record) {
  if (!(b->bound > 0)) return SECTIONS_UNPROVEN;
  record->bound = fmin(record->bound, b->bound);
  return SECTIONS_PROVEN;
}

/* Depth first, the worse half first: a wrong sign is found soon. */
void sections_prove(sections_search *search, const sections_stretch *t, sections_record *record) {
  sections_box *stack = search->stack;
  stack[0].lower[0] = stack[0].lower[1] = 0;
  stack[0].width[0] = stack[0].width[1] = 1;
  stack[0].depth[0] = stack[0].depth[1] = 0;
  int verdict = judge(search, t, &stack[0], record);
  size_t count = verdict == SECTIONS_PROVEN ? 0 : 1;
  if (verdict == SECTIONS_OPEN && search->box_limit == 0) {
    if (stack[0].bound > 0) record->bound = fmin(record->bound, stack[0].bound);
    record->verdict = SECTIONS_OPEN;
    return;
  }
  while (count > 0 && verdict >= SECTIONS_OPEN) {
    sections_box *b = &stack[count - 1];
    if (!can_cut(search, record, b)) {
      verdict = settle(b, record);
      count--;
      continue;
    }
    cut(search, b, sections_box_at(search, count));
    int found[2] = {judge(search, t, b, record), judge(search, t, b + 1, record)};
    verdict = found[0] < found[1] ? found[0] : found[1];
    if (found[0] == SECTIONS_VIOLATED || found[1] == SECTIONS_VIOLATED) verdict = SECTIONS_VIOLATED;
    bool first = found[0] == SECTIONS_OPEN, second = found[1] == SECTIONS_OPEN;
    if (second && (!first || b[0].least < b[1].least)) {
      sections_box other = b[0];
      b[0] = b[1];
      b[1] = other;
    }
    count = count - 1 + (size_t)first + (size_t)second;
  }
  record->verdict = (signed char)(verdict >= SECTIONS_OPEN ? SECTIONS_PROVEN : verdict);
}
