/* Newton's method on f with its gradient, and bisection where that does not settle. See project.h. */
#include "project.h"

#include "base/checked.h"

#include <string.h>

enum {
  NEWTON_ROUNDS = 6,   /* a smooth field needs one to three */
  BISECTIONS_MAX = 60, /* enough for any tolerance in doubles */
  BRACKETS = 5,        /* distances looked at on each side: reach, reach / 2, ... */
};

/* Length of a, without over- or underflow; a becomes a unit vector (or stays 0). */
static double normalize(unsigned n, double *a) {
  double largest = 0, sum = 0;
  for (unsigned k = 0; k < n; k++) largest = fmax(largest, fabs(a[k]));
  if (!(largest > 0) || isinf(largest)) return 0;
  for (unsigned k = 0; k < n; k++) {
    a[k] /= largest;
    sum += a[k] * a[k];
  }
  sum = sqrt(sum);
  for (unsigned k = 0; k < n; k++) a[k] /= sum;
  return largest * sum;
}

double batten_newton_step(unsigned n, double f, const double *gradient, unsigned char faces, double limit, double *x,
                          double *outward) {
  double d[3];
  memcpy(d, gradient, n * sizeof *d);
  if (outward && normalize(n, d) > 0)
    for (unsigned k = 0; k < n; k++) outward[k] = -d[k];
  for (unsigned k = 0; k < n; k++) d[k] = batten_on_face(faces, k) ? 0 : gradient[k];
  double slope = normalize(n, d);
  if (!(slope > 0)) return f == 0 ? 0 : INFINITY;
  double step = -f / slope;
  if (!(step < limit)) step = limit;
  if (!(step > -limit)) step = -limit;
  for (unsigned k = 0; k < n; k++) x[k] += step * d[k];
  return fabs(f) / slope;
}

typedef struct work {
  unsigned n;
  size_t active;     /* points that are not settled, list[0 .. active) */
  size_t *list;      /* [count] */
  double *home;      /* [count][n] where they came from */
  double *x;         /* [room][n] what is evaluated */
  double *values;    /* [room] */
  double *gradients; /* [count][n] last known */
  double *batch;     /* [count][n] gradients of a batch */
} work;

/* Along the unit vector d from home by t, without leaving the faces. */
static void along(const work *w, size_t i, const double *d, double t, double *x) {
  for (unsigned k = 0; k < w->n; k++) x[k] = w->home[w->n * i + k] + t * d[k];
}

static batten_status newton(batten_sampler *s, work *w, double *x, const unsigned char *faces, double reach,
                            double tolerance, double *outward, double *distance) {
  unsigned n = w->n;
  for (int round = 0; w->active > 0 && round <= NEWTON_ROUNDS; round++) {
    batten_status st = batten_progress(s->ctx, "settle", (double)round / (NEWTON_ROUNDS + 2));
    if (st < 0) return st;
    for (size_t j = 0; j < w->active; j++) memcpy(w->x + n * j, x + n * w->list[j], n * sizeof *x);
    st = batten_sampler_gradients(s, w->active, w->x, w->values, w->batch);
    if (st < 0) return st;
    size_t left = 0;
    for (size_t j = 0; j < w->active; j++) {
      size_t i = w->list[j];
      double off = 0;
      memcpy(w->gradients + n * i, w->batch + n * j, n * sizeof *x);
      distance[i] = batten_newton_step(n, w->values[j], w->batch + n * j, faces ? faces[i] : 0, 0.5 * reach,
                                       w->x + n * j, outward ? outward + n * i : NULL);
      if (distance[i] <= tolerance) continue;
      w->list[left++] = i;
      for (unsigned k = 0; k < n; k++) off = fmax(off, fabs(w->x[n * j + k] - w->home[n * i + k]));
      if (off <= reach && round < NEWTON_ROUNDS) memcpy(x + n * i, w->x + n * j, n * sizeof *x);
    }
    w->active = left;
  }
  return BATTEN_OK;
}

/* Offset number j of 2 BRACKETS + 1: 0, then outwards on both sides. */
static double offset_of(int j, double reach) {
  return j == 0 ? 0 : ldexp(j % 2 ? reach : -reach, (j - 1) / 2 - (BRACKETS - 1));
}

/* Where to look for the surface: along the gradient, or the outward direction that the caller has, on the faces. */
static void search_direction(const work *w, size_t i, const unsigned char *faces, const double *outward, double *d) {
  unsigned n = w->n;
  for (int source = 0; source < 2; source++) {
    const double *from = source == 0 ? w->gradients : outward;
    for (unsigned k = 0; k < n; k++) d[k] = !from || (faces && batten_on_face(faces[i], k)) ? 0 : from[n * i + k];
    if (normalize(n, d) > 0) return;
  }
}

/* For the listed points: the nearest interval along the gradient over which f changes its sign. from, to [active],
 * equal where there is none. direction [active][n]. */
static batten_status find_brackets(batten_sampler *s, work *w, const unsigned char *faces, const double *outward,
                                   double reach, double *direction, double *from, double *to) {
  unsigned n = w->n;
  enum { OFFSETS = 2 * BRACKETS + 1 };
  for (size_t j = 0; j < w->active; j++) {
    size_t i = w->list[j];
    double *d = direction + n * j;
    search_direction(w, i, faces, outward, d);
    for (int o = 0; o < OFFSETS; o++) along(w, i, d, offset_of(o, reach), w->x + n * (OFFSETS * j + (size_t)o));
  }
  batten_status st = batten_sampler_values(s, OFFSETS * w->active, w->x, w->values);
  if (st < 0) return st;
  for (size_t j = 0; j < w->active; j++) {
    const double *f = w->values + OFFSETS * j;
    from[j] = to[j] = 0;
    for (int o = 1; o < OFFSETS && from[j] == to[j]; o++) {
      int inner = o <= 2 ? 0 : o - 2;
      if ((f[o] >= 0) == (f[inner] >= 0)) continue;
      bool inside = f[inner] >= 0; /* from: inside, to: outside */
      from[j] = offset_of(inside ? inner : o, reach);
      to[j] = offset_of(inside ? o : inner, reach);
    }
  }
  return BATTEN_OK;
}

static batten_status bisect(batten_sampler *s, work *w, double *x, const unsigned char *faces, const double *outward,
                            double reach, double tolerance, double *distance) {
  unsigned n = w->n;
  batten_context *ctx = s->ctx;
  double *direction = NULL, *from = NULL, *to = NULL;
  batten_status st = BATTEN_E_NOMEM;
  size_t room = (2 * BRACKETS + 1) * w->active, left = w->active;
  batten_free(ctx, w->x);
  batten_free(ctx, w->values);
  w->x = w->values = NULL;
  if (!(w->x = batten_alloc_array(ctx, room, n * sizeof *w->x)) ||
      !(w->values = batten_alloc_array(ctx, room, sizeof *w->values)) ||
      !(direction = batten_alloc_array(ctx, w->active, n * sizeof *direction)) ||
      !(from = batten_alloc_array(ctx, w->active, sizeof *from)) ||
      !(to = batten_alloc_array(ctx, w->active, sizeof *to)))
    goto done;
  st = find_brackets(s, w, faces, outward, reach, direction, from, to);
  for (int round = 0; st >= 0 && left > 0 && round < BISECTIONS_MAX; round++) {
    left = 0;
    for (size_t j = 0; j < w->active; j++)
      if (fabs(to[j] - from[j]) > tolerance)
        along(w, w->list[j], direction + n * j, 0.5 * from[j] + 0.5 * to[j], w->x + n * left++);
    st = batten_sampler_values(s, left, w->x, w->values);
    for (size_t j = 0, m = 0; st >= 0 && j < w->active; j++) {
      if (!(fabs(to[j] - from[j]) > tolerance)) continue;
      double middle = 0.5 * from[j] + 0.5 * to[j];
      if (w->values[m++] >= 0)
        from[j] = middle;
      else
        to[j] = middle;
    }
  }
  for (size_t j = 0; st >= 0 && j < w->active; j++) {
    size_t i = w->list[j];
    if (from[j] == to[j]) continue; /* no bracket: where Newton's method left it */
    along(w, i, direction + n * j, from[j], x + n * i);
    distance[i] = fabs(to[j] - from[j]);
  }
done:
  batten_free(ctx, to);
  batten_free(ctx, from);
  batten_free(ctx, direction);
  return st;
}

batten_status batten_project_points(batten_sampler *sampler, size_t count, double *x, const unsigned char *faces,
                                    double reach, double tolerance, double *outward, double *distance) {
  batten_context *ctx = sampler->ctx;
  unsigned n = sampler->field->dimension;
  work w = {.n = n, .active = count};
  batten_status st = BATTEN_E_NOMEM;
  if (!(w.list = batten_alloc_array(ctx, count, sizeof *w.list)) ||
      !(w.home = batten_alloc_array(ctx, count, n * sizeof *w.home)) ||
      !(w.x = batten_alloc_array(ctx, count, n * sizeof *w.x)) ||
      !(w.values = batten_alloc_array(ctx, count, sizeof *w.values)) ||
      !(w.gradients = batten_alloc_array(ctx, count, n * sizeof *w.gradients)) ||
      !(w.batch = batten_alloc_array(ctx, count, n * sizeof *w.batch)))
    goto done;
  for (size_t i = 0; i < count; i++) w.list[i] = i;
  memcpy(w.home, x, count * n * sizeof *x);
  st = newton(sampler, &w, x, faces, reach, tolerance, outward, distance);
  if (st >= 0 && w.active > 0) st = bisect(sampler, &w, x, faces, outward, reach, tolerance, distance);
done:
  batten_free(ctx, w.batch);
  batten_free(ctx, w.gradients);
  batten_free(ctx, w.values);
  batten_free(ctx, w.x);
  batten_free(ctx, w.home);
  batten_free(ctx, w.list);
  return st;
}
