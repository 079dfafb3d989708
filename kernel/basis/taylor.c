/* Quadratic models over boxes: their range, how steep they are, and the difference of two. */
#include "basis/taylor.h"

#include "base/checked.h"

/* Above the relative rounding error of all steps that are taken here with one model. */
static const double ROUNDING = 0x1p-47;

batten_status batten_check_boxes(batten_context *ctx, unsigned n, size_t count, const double *boxes,
                                 const double *ranges) {
  size_t numbers;
  if (!boxes) return batten_fail(ctx, BATTEN_E_INVALID, "boxes: NULL; give [%zu][2][%u] numbers", count, n);
  if (!ranges) return batten_fail(ctx, BATTEN_E_INVALID, "ranges: NULL; give room for [%zu][2] numbers", count);
  if (!batten_mul3(count, 6, sizeof(double), &numbers))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu; too many", count);
  for (size_t i = 0; i < count; i++)
    for (unsigned k = 0; k < n; k++) {
      double lower = boxes[2 * n * i + k], upper = boxes[2 * n * i + n + k];
      if (!isfinite(lower) || !isfinite(upper) || lower > upper)
        return batten_fail(ctx, BATTEN_E_INVALID,
                           "boxes[%zu]: from %g to %g along axis %u; give finite bounds in order", i, lower, upper,
                           k);
    }
  return BATTEN_OK;
}

taylor_box batten_taylor_box(unsigned n, const double *box) {
  taylor_box b = {{0}, {0}, {0}, {0}};
  for (unsigned k = 0; k < n; k++) {
    double lower = box[k], upper = box[n + k], middle = lower / 2 + upper / 2;
    /* Halves of subnormal numbers may round out of the box. */
    b.lower[k] = lower;
    b.upper[k] = upper;
    b.middle[k] = fmin(fmax(middle, lower), upper);
    b.radius[k] = fmax(upper - b.middle[k], b.middle[k] - lower) * (1 + 0x1p-51);
  }
  return b;
}

double batten_taylor_size(unsigned n, const taylor_box *box, const taylor *t) {
  double size = fabs(t->value);
  for (unsigned a = 0; a < n; a++) {
    size += fabs(t->slope[a]) * box->radius[a];
    for (unsigned b = 0; b < n; b++) size += fabs(t->bend[TAYLOR_BEND[a][b]]) * box->radius[a] * box->radius[b] / 2;
  }
  return size;
}

/* slope d + bend d^2 / 2 for |d| <= radius */
static interval parabola(double slope, double bend, double radius) {
  double ends = bend / 2 * radius * radius, tilt = fabs(slope) * radius;
  interval r = {ends - tilt, ends + tilt};
  if (fabs(slope) < fabs(bend) * radius) { /* the vertex is inside */
    double vertex = -slope * slope / bend / 2;
    r = (interval){fmin(r.lo, vertex), fmax(r.hi, vertex)};
  }
  return r;
}

interval batten_taylor_range(unsigned n, const taylor_box *box, const taylor *t) {
  if (!(t->rest < INFINITY)) return t->range;
  double lo = t->value, hi = t->value;
  for (unsigned a = 0; a < n; a++) {
    interval along = parabola(t->slope[a], t->bend[TAYLOR_BEND[a][a]], box->radius[a]);
    lo += along.lo;
    hi += along.hi;
    for (unsigned b = a + 1; b < n; b++) {
      double mixed = fabs(t->bend[TAYLOR_BEND[a][b]]) * box->radius[a] * box->radius[b];
      lo -= mixed;
      hi += mixed;
    }
  }
  double slack = t->rest + ROUNDING * batten_taylor_size(n, box, t);
  lo -= slack;
  hi += slack;
  if (!(lo <= hi)) return t->range; /* NaN: the model has overflowed */
  return interval_meet(t->range, (interval){lo, hi});
}

/* slope + bend d is longest in a corner of the box. Along the slope in the middle it is at least what the bend leaves
 * of it. */
interval batten_taylor_steep(unsigned n, const taylor_box *box, const taylor *t) {
  if (!(t->rest_slope < INFINITY)) return t->steep;
  double most = 0, square = 0, size = 0, change = 0;
  for (unsigned corner = 0; corner < 1u << n; corner++) {
    double length = 0;
    for (unsigned a = 0; a < n; a++) {
      double g = t->slope[a];
      for (unsigned b = 0; b < n; b++)
        g += t->bend[TAYLOR_BEND[a][b]] * (corner >> b & 1 ? box->radius[b] : -box->radius[b]);
      length += g * g;
    }
    most = fmax(most, length);
  }
  for (unsigned a = 0; a < n; a++) {
    square += t->slope[a] * t->slope[a];
    for (unsigned b = 0; b < n; b++) size += fabs(t->bend[TAYLOR_BEND[a][b]]) * box->radius[b];
  }
  most = sqrt(most);
  double middle = sqrt(square);
  for (unsigned b = 0; b < n && middle > 0; b++) {
    double along = 0;
    for (unsigned a = 0; a < n; a++) along += t->slope[a] / middle * t->bend[TAYLOR_BEND[a][b]];
    change += fabs(along) * box->radius[b];
  }
  double slack = t->rest_slope + ROUNDING * (middle + size) + 0x1p-500; /* squares that vanish */
  double lo = fmax(middle - change - slack, 0), hi = most + slack;
  if (!(lo <= hi)) return t->steep; /* NaN: the model has overflowed */
  return interval_meet(t->steep, (interval){lo, hi});
}

interval batten_steep_add(interval f, interval g) {
  interval r = interval_widen(fmax(f.lo - g.hi, g.lo - f.hi), f.hi + g.hi, 1);
  if (!(r.lo > 0)) r.lo = 0;
  return r;
}

taylor batten_taylor_of_range(double lo, double hi, interval steep) {
  taylor t = {.rest = INFINITY, .rest_slope = INFINITY, .range = interval_all(), .steep = batten_steep_unknown()};
  if (steep.lo <= steep.hi && steep.lo >= 0) t.steep = steep;
  if (lo <= hi) t.range = (interval){lo, hi};
  return t;
}

taylor batten_taylor_difference(unsigned n, const taylor_box *box, int sign, const taylor *f, const taylor *g) {
  taylor t = {.value = sign * (f->value - g->value)};
  for (unsigned k = 0; k < 3; k++) t.slope[k] = sign * (f->slope[k] - g->slope[k]);
  for (unsigned k = 0; k < 6; k++) t.bend[k] = sign * (f->bend[k] - g->bend[k]);
  t.rest = f->rest + g->rest +
           ROUNDING * (batten_taylor_size(n, box, f) + batten_taylor_size(n, box, g) + f->rest + g->rest);
  t.rest_slope = (f->rest_slope + g->rest_slope) * (1 + ROUNDING);
  for (unsigned k = 0; k < n; k++) {
    double size = fabs(f->slope[k]) + fabs(g->slope[k]);
    for (unsigned j = 0; j < n; j++)
      size += (fabs(f->bend[TAYLOR_BEND[k][j]]) + fabs(g->bend[TAYLOR_BEND[k][j]])) * box->radius[j];
    t.rest_slope += ROUNDING * size;
  }
  t.steep = batten_steep_add(f->steep, g->steep);
  t.range = interval_sub(f->range, g->range);
  if (sign < 0) t.range = interval_neg(t.range);
  return t;
}
