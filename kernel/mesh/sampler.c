/* Batches of field values for the polygoniser. See sampler.h. */
#include "sampler.h"

#include "base/checked.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { DIFFERENCE_CHUNK = 4096 }; /* points whose neighbours are held at a time: 0.6 MB */

/* The field at the points, in its own unit. */
static batten_status ask(const batten_sampler *s, size_t count, const double *points, double *values,
                         double *gradients) {
  const batten_field *f = s->field;
  if (s->exponent == 0) return f->evaluate(f->user, s->ctx, count, points, values, gradients, NULL);
  const size_t n = f->dimension;
  double *own = batten_alloc_array(s->ctx, count, n * sizeof *own);
  if (!own) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < count * n; i++) own[i] = ldexp(points[i], s->exponent);
  batten_status st = f->evaluate(f->user, s->ctx, count, own, values, gradients, NULL);
  for (size_t i = 0; gradients && st >= 0 && i < count * n; i++) gradients[i] = ldexp(gradients[i], s->exponent);
  batten_free(s->ctx, own);
  return st;
}

static batten_status evaluate(batten_sampler *s, size_t count, const double *points, double *values,
                              double *gradients) {
  unsigned n = s->field->dimension;
  if (count == 0) return BATTEN_OK;
  if (s->evaluations_max && count > s->evaluations_max - s->evaluations)
    return batten_fail(s->ctx, BATTEN_E_TOO_LARGE,
                       "opt.evaluations_max: %zu; %zu evaluations done, %zu more asked for; raise it or opt.cell",
                       s->evaluations_max, s->evaluations, count);
  batten_status st = ask(s, count, points, values, gradients);
  if (st < 0) return st;
  s->evaluations += count;
  size_t bad = batten_first_nonfinite(count, values);
  if (bad == count) return BATTEN_OK;
  char place[128];
  double p[3] = {0, 0, 0};
  for (unsigned k = 0; k < n; k++) p[k] = ldexp(points[n * bad + k], s->exponent);
  if (n == 2)
    snprintf(place, sizeof place, "(%.17g, %.17g)", p[0], p[1]);
  else
    snprintf(place, sizeof place, "(%.17g, %.17g, %.17g)", p[0], p[1], p[2]);
  return batten_fail(s->ctx, BATTEN_E_INVALID,
                     "field: %g at the point %s; the field must be finite within the box and a cell around it",
                     values[bad], place);
}

batten_status batten_sampler_values(batten_sampler *s, size_t count, const double *points, double *values) {
  return evaluate(s, count, points, values, NULL);
}

/* Central differences of one chunk; around [2 n count][n], sides [2 n count]. */
static batten_status differences(batten_sampler *s, size_t count, const double *points, double *gradients,
                                 double *around, double *sides) {
  size_t n = s->field->dimension;
  for (size_t i = 0; i < count; i++)
    for (size_t j = 0; j < 2 * n; j++) {
      double *p = around + n * (2 * n * i + j);
      memcpy(p, points + n * i, n * sizeof *p);
      p[j / 2] += j % 2 ? s->difference : -s->difference;
    }
  batten_status st = evaluate(s, 2 * n * count, around, sides, NULL);
  for (size_t i = 0; st >= 0 && i < count * n; i++) {
    size_t back = n * (2 * i) + i % n, ahead = n * (2 * i + 1) + i % n;
    gradients[i] = (sides[2 * i + 1] - sides[2 * i]) / (around[ahead] - around[back]);
  }
  return st;
}

batten_status batten_sampler_gradients(batten_sampler *s, size_t count, const double *points, double *values,
                                       double *gradients) {
  size_t n = s->field->dimension;
  batten_status st = BATTEN_OK;
  if (s->field->order >= 1) {
    st = evaluate(s, count, points, values, gradients);
  } else {
    size_t chunk = count < DIFFERENCE_CHUNK ? count : DIFFERENCE_CHUNK;
    double *around = batten_alloc_array(s->ctx, chunk, 2 * n * (n + 1) * sizeof *around);
    if (!around) return BATTEN_E_NOMEM;
    st = evaluate(s, count, points, values, NULL);
    for (size_t i = 0; st >= 0 && i < count; i += chunk) {
      size_t m = count - i < chunk ? count - i : chunk;
      st = differences(s, m, points + n * i, gradients + n * i, around, around + 2 * n * n * chunk);
    }
    batten_free(s->ctx, around);
  }
  for (size_t i = 0; st >= 0 && i < n * count; i++)
    if (!isfinite(gradients[i])) memset(gradients + i / n * n, 0, n * sizeof *gradients);
  return st < 0 ? st : BATTEN_OK;
}
