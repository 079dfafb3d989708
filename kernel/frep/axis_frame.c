/* Frames about an axis: into them, out of them, boxes through them, and what maps in them have in common. */
#include <string.h>

#include "base/checked.h"
#include "frep/axis_frame.h"

bool frep_box_empty(unsigned n, const double *lower, const double *upper) {
  for (unsigned k = 0; k < n; k++)
    if (lower[k] > upper[k]) return true;
  return false;
}

static void cross(const double *a, const double *b, double *out) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* u along `towards` (made orthogonal), false where it lies along the axis. */
bool frep_frame_set(frep_frame *f, const double *origin, const double *axis, const double *towards) {
  memcpy(f->origin, origin, sizeof f->origin);
  memcpy(f->rows[2], axis, sizeof f->rows[2]);
  double along = dot(axis, towards), square = 0;
  for (unsigned k = 0; k < 3; k++) {
    f->rows[0][k] = towards[k] - along * axis[k];
    square += f->rows[0][k] * f->rows[0][k];
  }
  if (!(square > 1e-18)) return false; /* towards is a unit vector: within 1e-9 of the axis nothing is left of it */
  for (unsigned k = 0; k < 3; k++) f->rows[0][k] /= sqrt(square);
  cross(f->rows[2], f->rows[0], f->rows[1]);
  return true;
}

/* Any u: the coordinate axis that lies farthest from the axis. */
void frep_frame_any(frep_frame *f, const double *origin, const double *axis) {
  unsigned least = 0;
  for (unsigned k = 1; k < 3; k++)
    if (fabs(axis[k]) < fabs(axis[least])) least = k;
  double towards[3] = {0};
  towards[least] = 1;
  frep_frame_set(f, origin, axis, towards);
}

void frep_frame_into(const frep_frame *f, const double *x, double *q) {
  double d[3];
  for (unsigned k = 0; k < 3; k++) d[k] = x[k] - f->origin[k];
  for (unsigned i = 0; i < 3; i++) q[i] = f->rows[i][0] * d[0] + f->rows[i][1] * d[1] + f->rows[i][2] * d[2];
}

void frep_frame_into_range(const frep_frame *f, const interval *x, interval *q) {
  interval d[3];
  for (unsigned k = 0; k < 3; k++) d[k] = interval_sub(x[k], interval_of(f->origin[k]));
  for (unsigned i = 0; i < 3; i++) q[i] = frep_linear_range(3, f->rows[i], d);
}

/* The place in space of psi(q) with its derivatives by q. */
void frep_frame_back(const frep_frame *f, const double psi[3], double psi_q[3][3], frep_place *p) {
  double half[3][3];
  for (unsigned i = 0; i < 3; i++)
    for (unsigned j = 0; j < 3; j++)
      half[i][j] = psi_q[i][0] * f->rows[0][j] + psi_q[i][1] * f->rows[1][j] + psi_q[i][2] * f->rows[2][j];
  for (unsigned k = 0; k < 3; k++) {
    p->y[k] = f->origin[k] + (f->rows[0][k] * psi[0] + f->rows[1][k] * psi[1] + f->rows[2][k] * psi[2]);
    for (unsigned j = 0; j < 3; j++)
      p->jacobian[k][j] = f->rows[0][k] * half[0][j] + f->rows[1][k] * half[1][j] + f->rows[2][k] * half[2][j];
  }
  p->limit = INFINITY;
}

static void back_range(const frep_frame *f, const interval *psi, interval *y) {
  for (unsigned k = 0; k < 3; k++) {
    const double column[3] = {f->rows[0][k], f->rows[1][k], f->rows[2][k]};
    y[k] = interval_add(interval_of(f->origin[k]), frep_linear_range(3, column, psi));
  }
}

frep_image frep_frame_image(const frep_frame *f, const interval *psi, double stretch) {
  frep_image image = {.limit = {INFINITY, INFINITY}, .stretch = stretch * (1 + 1e-12)};
  back_range(f, psi, image.y);
  return image;
}

/* The child's box in the frame: false where there is none; *empty where it holds nothing. */
bool frep_frame_child_box(const batten_frep *a, const frep_frame *f, interval *q, bool *empty) {
  double low[3], high[3];
  if (!frep_structural_box(a->children[0], low, high)) return false;
  *empty = frep_box_empty(3, low, high);
  const interval x[3] = {{low[0], high[0]}, {low[1], high[1]}, {low[2], high[2]}};
  if (!*empty) frep_frame_into_range(f, x, q);
  return true;
}

void frep_frame_box(const frep_frame *f, bool empty, const interval *q, double *lower, double *upper) {
  interval x[3];
  if (!empty) back_range(f, q, x);
  for (unsigned k = 0; k < 3; k++) {
    lower[k] = empty ? 1 : x[k].lo;
    upper[k] = empty ? -1 : x[k].hi;
  }
}

batten_status frep_frame_make(batten_context *ctx, const frep_class *cls, batten_frep *a, size_t count,
                              const double *numbers, const void *state, size_t bytes, batten_frep **out) {
  void *own = batten_alloc(ctx, bytes);
  if (!own) return BATTEN_E_NOMEM;
  memcpy(own, state, bytes);
  batten_frep_parts parts = {.n = 3, .number_count = count, .numbers = numbers, .child_count = 1, .children = {a}};
  batten_status st = frep_make(ctx, cls, &parts, false, own, out);
  if (st < 0) batten_free(ctx, own);
  return st;
}

batten_status frep_frame_check(batten_context *ctx, batten_frep *a, const double *origin, const double *axis,
                               double *unit, batten_frep **out) {
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0) st = frep_check_node(ctx, "a", a, 3);
  if (st >= 0) st = frep_check_numbers(ctx, "origin", 3, origin);
  if (st >= 0) st = frep_check_direction(ctx, "axis", 3, axis, unit);
  return st;
}

batten_status frep_frame_check_heights(batten_context *ctx, double lower, double upper) {
  batten_status st = frep_check_numbers(ctx, "lower", 1, &lower);
  if (st >= 0) st = frep_check_numbers(ctx, "upper", 1, &upper);
  if (st >= 0 && !(lower < upper))
    st = batten_fail(ctx, BATTEN_E_INVALID, "upper: %g, lower: %g; give lower < upper", upper, lower);
  return st;
}
