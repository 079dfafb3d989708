/* Proof that D > kappa V on a square by bisection of their Bernstein coefficients.
 *
 * On a box all coefficients of D - kappa V must be above the bound of their errors. Where they are not the box is cut
 * in the direction in which the second differences are larger: the distance of coefficients from values shrinks with
 * their squares. Corners are values: they lower kappa, and end the search where D itself is not above its error. */
#include "certify.h"

#include <math.h>
#include <string.h>

static size_t coefficients(const certify_square *s) { return (size_t)(s->degree[0] + 1) * (s->degree[1] + 1); }

static void meet(certify_proof *proof, double value, double u, double v) {
  if (!(value < proof->least)) return;
  proof->least = value;
  proof->least_at[0] = u;
  proof->least_at[1] = v;
}

void certify_sample(certify_proof *proof, const certify_square *s) {
  enum { GRID = 9 };
  certify_poly d = {.degree = {s->degree[0], s->degree[1]}, .c = s->slots}, v = d;
  v.c += coefficients(s);
  for (int i = 0; i < GRID; i++)
    for (int j = 0; j < GRID; j++) {
      double a = (double)i / (GRID - 1), b = (double)j / (GRID - 1);
      double denominator = certify_value(&v, false, a, b);
      if (!(denominator > 8 * s->error[1])) continue;
      meet(proof, certify_value(&d, false, a, b) / denominator, (1 - a) * s->lower[0] + a * s->upper[0],
           (1 - b) * s->lower[1] + b * s->upper[1]);
    }
}

/* False when a corner shows that no part of the box that keeps it can be proven. */
static bool look_at_corners(certify_proof *proof, const certify_square *s, const certify_box *b) {
  size_t n = coefficients(s), columns = s->degree[1] + 1;
  bool possible = true;
  for (int k = 0; k < 4; k++) {
    size_t at = (k & 1 ? n - columns : 0) + (k & 2 ? columns - 1 : 0);
    double d = b->c[at], v = b->c[n + at];
    if (v > 8 * b->error[1]) meet(proof, d / v, k & 1 ? b->upper[0] : b->lower[0], k & 2 ? b->upper[1] : b->lower[1]);
    possible = possible && d > b->error[0];
  }
  return possible;
}

/* Largest second difference of c times the square of the degree, in rows and in columns: the larger is bisected. */
static unsigned longer_axis(const certify_square *s, const double *c) {
  size_t rows = s->degree[0] + 1, columns = s->degree[1] + 1, n = rows * columns;
  double across[2] = {0, 0};
  for (size_t x = 0; x + 2 * columns < n; x++)
    across[0] = fmax(across[0], fabs(c[x] - 2 * c[x + columns] + c[x + 2 * columns]));
  for (size_t i = 0; i < rows; i++)
    for (size_t j = 0; j + 2 < columns; j++) {
      const double *p = c + i * columns + j;
      across[1] = fmax(across[1], fabs(p[0] - 2 * p[1] + p[2]));
    }
  for (int axis = 0; axis < 2; axis++) across[axis] *= s->degree[axis] * (double)s->degree[axis];
  return across[1] > across[0];
}

/* True when the box is proven; otherwise it is prepared for bisection. */
static bool examine(certify_proof *proof, const certify_square *s, certify_box *b) {
  size_t n = coefficients(s);
  const double *d = b->c, *v = b->c + n;
  double kappa = fmax(0, CERTIFY_SHARE * proof->least), least = INFINITY, d_least = INFINITY;
  double most[2] = {0, 0}, *p = s->work;
  for (size_t x = 0; x < n; x++) {
    p[x] = d[x] - kappa * v[x];
    least = p[x] < least ? p[x] : least;
    d_least = d[x] < d_least ? d[x] : d_least;
    most[0] = fabs(d[x]) > most[0] ? fabs(d[x]) : most[0];
    most[1] = fabs(v[x]) > most[1] ? fabs(v[x]) : most[1];
  }
  double need = b->error[0] + kappa * b->error[1] + 3 * CERTIFY_EPS * (most[0] + kappa * most[1]);
  memcpy(b->most, most, sizeof most);
  b->least = least;
  b->bound = (d_least - b->error[0]) / ((most[1] + b->error[1]) * CERTIFY_UP);
  b->bound /= CERTIFY_UP;
  if (least > need * CERTIFY_UP + CERTIFY_TINY) return true;
  b->axis = longer_axis(s, p);
  return false;
}

/* A box that will not be cut: proven with what it has, or given up. */
static void settle(certify_proof *proof, const certify_box *b) {
  if (b->bound > 0 && isfinite(b->bound))
    proof->bound = fmin(proof->bound, b->bound);
  else
    proof->unproven++;
}

/* Cuts the box into itself and `other`. */
static void cut(const certify_square *s, certify_box *b, certify_box *other) {
  double *room = other->c;
  unsigned axis = b->axis;
  certify_bisect(axis, 2, s->degree[0] + 1, s->degree[1] + 1, b->c, room, s->work);
  for (int k = 0; k < 2; k++)
    b->error[k] = (b->error[k] + s->degree[axis] * CERTIFY_EPS * b->most[k]) * CERTIFY_UP + CERTIFY_TINY;
  b->depth[axis]++;
  *other = *b;
  other->c = room;
  double middle = 0.5 * b->lower[axis] + 0.5 * b->upper[axis];
  b->upper[axis] = other->lower[axis] = middle;
}

/* True when the box has a direction left to be bisected in: sets its axis. */
static bool can_cut(const certify_proof *proof, certify_box *b) {
  if (proof->boxes >= proof->box_limit) return false;
  if (b->depth[b->axis] >= proof->depth_max) b->axis = 1 - b->axis;
  return b->depth[b->axis] < proof->depth_max;
}

/* Looks at a new box: -1 no part of it can be proven, 0 to be bisected, 1 proven. */
static int judge(certify_proof *proof, const certify_square *s, certify_box *b) {
  proof->boxes++;
  unsigned depth = b->depth[0] > b->depth[1] ? b->depth[0] : b->depth[1];
  if (depth > proof->depth) proof->depth = depth;
  if (!look_at_corners(proof, s, b)) return -1;
  return examine(proof, s, b);
}

/* Depth first, the worse half first: what cannot be proven is found soon. The boxes of the stack have been looked at.
 */
batten_status certify_prove(batten_context *ctx, certify_proof *proof, const certify_square *s) {
  certify_box *stack = s->stack;
  size_t n = 2 * coefficients(s), count = 1;
  double done = 0;
  for (size_t k = 0; k < 2 * (size_t)proof->depth_max + 2; k++) stack[k].c = s->slots + k * n;
  memcpy(stack[0].error, s->error, sizeof s->error);
  memcpy(stack[0].lower, s->lower, sizeof s->lower);
  memcpy(stack[0].upper, s->upper, sizeof s->upper);
  stack[0].depth[0] = stack[0].depth[1] = 0;
  int first = judge(proof, s, &stack[0]);
  if (first > 0) return BATTEN_OK;
  if (first < 0) proof->unproven++;
  for (size_t turn = 0; count > 0 && proof->unproven == 0; turn++) {
    certify_box *b = &stack[count - 1];
    if (turn % 128 == 0) {
      double fraction = proof->progress[0] + done * (proof->progress[1] - proof->progress[0]);
      batten_status st = batten_progress(ctx, "certify", fmin(fraction, 1));
      if (st < 0) return st;
    }
    if (!can_cut(proof, b)) {
      settle(proof, b);
      count--;
      continue;
    }
    cut(s, b, &stack[count]);
    int verdict[2] = {judge(proof, s, b), judge(proof, s, b + 1)};
    for (int k = 0; k < 2; k++) {
      if (verdict[k] > 0) done += ldexp(1, -(int)(b[k].depth[0] + b[k].depth[1]));
      if (verdict[k] < 0) proof->unproven++;
    }
    bool swap = verdict[0] == 1 ? verdict[1] != 1 : verdict[1] != 1 && b[0].least < b[1].least;
    if (swap) {
      certify_box other = b[0];
      b[0] = b[1];
      b[1] = other;
    }
    count = count + 1 - (size_t)(verdict[0] == 1) - (size_t)(verdict[1] == 1);
  }
  return BATTEN_OK;
}
