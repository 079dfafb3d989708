/* Points, weights and long double sums for the tests of fast multipole sums. */
#ifndef FMM_SCENE_H
#define FMM_SCENE_H

#include <batten/fmm.h>

#include "tap.h"

typedef struct fmm_scene {
  unsigned n;
  size_t sources, targets;
  double *y, *x;  /* [sources][n], [targets][n] */
  double *w, *g;  /* [sources], [sources][n] */
  double *u, *du; /* [targets], [targets][n]: results */
} fmm_scene;

typedef enum fmm_place {
  PLACE_VOLUME,
  PLACE_SURFACE,
  PLACE_FAR_OFF,    /* coordinates of 7e6 */
  PLACE_PLANE,      /* coplanar, in 2-D collinear, askew */
  PLACE_LINE,       /* along an axis */
  PLACE_DUPLICATES, /* each point twice, and a quarter of all at two places */
  PLACE_CLUSTERS,   /* half of the points within 1e-10 of two places */
  PLACE_OUTLIER,    /* one point 1e6 away */
  PLACE_UNEVEN,     /* density 1 : 1000 */
  PLACE_GRADED,     /* distances from the origin fall like 2^-k, k to 300 */
  PLACES
} fmm_place;
static const char *const place_names[] = {"volume", "surface",    "coordinates of 7e6", "plane",
                                          "line",   "duplicates", "clusters",           "outlier",
                                          "uneven", "graded"};

static inline void place_point(fmm_place place, unsigned n, size_t i, uint64_t *seed, double *x) {
  double norm = 0;
  for (unsigned a = 0; a < n; a++) x[a] = 2 * t_uniform(seed) - 1, norm += x[a] * x[a];
  norm = sqrt(norm);
  const double pick = t_uniform(seed);
  for (unsigned a = 0; a < n; a++) switch (place) {
      case PLACE_SURFACE:
        x[a] /= norm;
        break;
      case PLACE_FAR_OFF:
        x[a] = 7e6 + 500 * x[a];
        break;
      case PLACE_PLANE:
        x[a] = a + 1 == n ? 0.3 * x[0] - (n > 2 ? 0.7 * x[1] : 0) : x[a];
        break;
      case PLACE_LINE:
        x[a] = a == 0 ? x[a] : 0.25;
        break;
      case PLACE_DUPLICATES:
        x[a] = pick < 0.25 ? (pick < 0.125 ? 0.5 : 0.5 + 1e-9) : x[a];
        break;
      case PLACE_CLUSTERS:
        x[a] = pick < 0.5 ? (pick < 0.25 ? 0.125 : -0.7) + 1e-10 * x[a] : x[a];
        break;
      case PLACE_OUTLIER:
        x[a] = i == 17 ? 1e6 : x[a];
        break;
      case PLACE_UNEVEN:
        x[a] = pick < 0.9 ? 0.1 * x[a] + 0.3 : x[a];
        break;
      case PLACE_GRADED:
        x[a] = ldexp(x[a] / norm, -(int)(300 * pick));
        break;
      default:
        break;
    }
}

/* targets = 0: the sources. */
static inline fmm_scene fmm_scene_new(fmm_place place, unsigned n, size_t sources, size_t targets, uint64_t seed) {
  const size_t t = targets ? targets : sources;
  fmm_scene s = {.n = n, .sources = sources, .targets = t};
  double *block = calloc(sources * (2 * n + 1) + t * (2 * n + 1) + 1, sizeof *block);
  s.y = block, s.w = s.y + sources * n, s.g = s.w + sources;
  s.x = s.g + sources * n, s.u = s.x + t * n, s.du = s.u + t;
  for (size_t i = 0; i < sources; i++) {
    if (place == PLACE_DUPLICATES && i % 2)
      memcpy(s.y + i * n, s.y + (i - 1) * n, n * sizeof(double));
    else
      place_point(place, n, i, &seed, s.y + i * n);
    s.w[i] = 2 * t_uniform(&seed) - 1;
    for (unsigned a = 0; a < n; a++) s.g[i * n + a] = 0.1 * (2 * t_uniform(&seed) - 1);
  }
  for (size_t i = 0; i < t; i++)
    if (targets)
      place_point(place, n, i, &seed, s.x + i * n);
    else
      memcpy(s.x + i * n, s.y + i * n, n * sizeof(double));
  return s;
}
static inline void fmm_scene_free(fmm_scene *s) { free(s->y); }

/* phi, phi'/r, and its derivative over r, by the textbook. */
static inline void scene_radial(const batten_radial *k, long double r, long double f[3]) {
  const long double p = k->power;
  f[0] = f[1] = f[2] = 0;
  if (r == 0) return;
  const long double l = k->logarithm ? logl(r) : 1, e = k->logarithm ? 1 : 0;
  long double power = 1;
  for (int i = 0; i < k->power; i++) power *= r;
  f[0] = power * l;
  f[1] = power / (r * r) * (p * l + e);
  f[2] = power / (r * r) / (r * r) * ((p - 2) * (p * l + e) + p * e);
}

/* Relative 2-norms of the errors of s->u and s->du at every step-th target. */
static inline void scene_errors(const fmm_scene *s, const batten_radial *k, bool dipoles, size_t step, double *value,
                                double *gradient) {
  long double norm[2] = {0, 0}, error[2] = {0, 0};
  for (size_t i = 0; i < s->targets; i += step) {
    long double u[4] = {0, 0, 0, 0};
    for (size_t j = 0; j < s->sources; j++) {
      long double d[3] = {0, 0, 0}, r2 = 0, t = 0, f[3];
      for (unsigned a = 0; a < s->n; a++) {
        d[a] = (long double)s->x[i * s->n + a] - s->y[j * s->n + a];
        r2 += d[a] * d[a];
        if (dipoles) t += s->g[j * s->n + a] * d[a];
      }
      scene_radial(k, sqrtl(r2), f);
      u[0] += s->w[j] * f[0] - t * f[1];
      for (unsigned a = 0; a < s->n; a++) {
        u[1 + a] += (s->w[j] * f[1] - t * f[2]) * d[a];
        if (dipoles) u[1 + a] -= s->g[j * s->n + a] * f[1];
      }
    }
    error[0] += (s->u[i] - u[0]) * (s->u[i] - u[0]), norm[0] += u[0] * u[0];
    for (unsigned a = 0; a < s->n; a++) {
      const long double e = s->du[i * s->n + a] - u[1 + a];
      error[1] += e * e, norm[1] += u[1 + a] * u[1 + a];
    }
  }
  *value = (double)sqrtl(error[0] / norm[0]);
  *gradient = (double)sqrtl(error[1] / norm[1]);
}

#endif
