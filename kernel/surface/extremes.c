/* Extremes of curvatures, and of the area that a parameter square covers, over a whole surface.
 *
 * On each span pair alone, so that derivatives that jump at knots are taken from within: a grid first, whose places
 * that none of their neighbours beats are kept; from the best of all a descent on the closed pair. At a step h it
 * looks at the eight neighbours; no better one among these, it tries the minimum of the quadratic through them, and
 * halves h. On the sides of a pair the quadratic is one along the side. */
#include "surface_inner.h"

#include "base/checked.h"
#include "basis/shape.h"
#include "mesh/vec.h"

#include <string.h>

enum {
  LINES_MAX = 17, /* of the grid in a span, one less where there are very many spans */
  KEPT = 3,       /* places of a span pair for each extreme */
  STARTS = 16,    /* descents for each extreme */
  HALVINGS = 26,
  BATCH = 256 /* span pairs between two progress calls */
};

/* A place of a span pair, x in [0, 1]^2, and a value there that is to be small. */
typedef struct candidate {
  double value, x[2];
  size_t i, j;
} candidate;

typedef struct job {
  const batten_surface *surface;
  const surface_axis *axis;
  unsigned lines;
  size_t first;              /* span pair of the first task */
  double *values;            /* [BATCH][SURFACE_EXTREMES][lines][lines] */
  candidate *kept;           /* [BATCH][SURFACE_EXTREMES][KEPT] */
  candidate (*best)[STARTS]; /* [SURFACE_EXTREMES] */
} job;

/* ---- values --------------------------------------------------------------------------------------- */

static void make_basis(const job *j, int k, size_t span, double x, surface_basis *out) {
  const bspline *space = &j->surface->space[k];
  size_t mu = j->axis[k].span[span];
  surface_basis_make(space, mu, surface_span_at(space, mu, x), out);
}

static double domain_length(const job *j, int k, const surface_basis *basis) {
  const bspline *space = &j->surface->space[k];
  return ldexp(bspline_upper(space) - bspline_lower(space), basis->exponent);
}

/* All that is to be small, +infinity where there is no normal. */
static void find_values(const job *j, const surface_basis *u, const surface_basis *v, double out[SURFACE_EXTREMES]) {
  double jet[6][3], cross[3];
  surface_shape shape;
  surface_jet_scaled(j->surface, u, v, jet);
  vec_cross(jet[1], jet[2], cross);
  double area = vec_norm(cross) * domain_length(j, 0, u) * domain_length(j, 1, v);
  bool regular = surface_shape_make((const double(*)[3])jet, &shape);
  out[SURFACE_GAUSS_MIN] = regular ? shape.gauss : INFINITY;
  out[SURFACE_GAUSS_MAX] = regular ? -shape.gauss : INFINITY;
  out[SURFACE_MEAN_MIN] = regular ? shape.mean : INFINITY;
  out[SURFACE_MEAN_MAX] = regular ? -shape.mean : INFINITY;
  out[SURFACE_AREA_MIN] = area;
}

static double value_at(const job *j, int what, const candidate *c, const double x[2]) {
  surface_basis basis[2];
  double values[SURFACE_EXTREMES];
  make_basis(j, 0, c->i, x[0], &basis[0]);
  make_basis(j, 1, c->j, x[1], &basis[1]);
  find_values(j, &basis[0], &basis[1], values);
  return isnan(values[what]) ? INFINITY : values[what];
}

/* ---- the grid ------------------------------------------------------------------------------------- */

/* Into a list in rising order, the last one falls out; of equal ones the first stays ahead. */
static void insert(const candidate *c, size_t count, candidate *list) {
  size_t at = count;
  while (at > 0 && c->value < list[at - 1].value) at--;
  if (at == count) return;
  memmove(list + at + 1, list + at, (count - 1 - at) * sizeof *list);
  list[at] = *c;
}

static bool none_beats(unsigned n, const double *values, unsigned a, unsigned b) {
  double own = values[a * n + b];
  for (unsigned i = a > 0 ? a - 1 : 0; i <= a + 1 && i < n; i++)
    for (unsigned j = b > 0 ? b - 1 : 0; j <= b + 1 && j < n; j++)
      if (values[i * n + j] < own) return false;
  return true;
}

static void search_pair(void *arg, size_t index) {
  const job *j = arg;
  unsigned n = j->lines;
  size_t pair = j->first + index, size = (size_t)n * n, i = pair / j->axis[1].count, k = pair % j->axis[1].count;
  double *values = j->values + index * SURFACE_EXTREMES * size;
  candidate *kept = j->kept + index * SURFACE_EXTREMES * KEPT;
  surface_basis across[LINES_MAX], along;
  for (unsigned b = 0; b < n; b++) make_basis(j, 1, k, (double)b / (n - 1), &across[b]);
  for (unsigned a = 0; a < n; a++) {
    make_basis(j, 0, i, (double)a / (n - 1), &along);
    for (unsigned b = 0; b < n; b++) {
      double all[SURFACE_EXTREMES];
      find_values(j, &along, &across[b], all);
      for (int e = 0; e < SURFACE_EXTREMES; e++) values[(size_t)e * size + a * n + b] = all[e];
    }
  }
  for (int e = 0; e < SURFACE_EXTREMES; e++) {
    const double *own = values + (size_t)e * size;
    for (int s = 0; s < KEPT; s++) kept[e * KEPT + s] = (candidate){.value = INFINITY};
    for (unsigned a = 0; a < n; a++)
      for (unsigned b = 0; b < n; b++) {
        candidate c = {own[a * n + b], {(double)a / (n - 1), (double)b / (n - 1)}, i, k};
        if (c.value < INFINITY && none_beats(n, own, a, b)) insert(&c, KEPT, kept + e * KEPT);
      }
  }
}

/* ---- the descent ---------------------------------------------------------------------------------- */

/* Where the quadratic through values [3][3] at x + h (-1, 0, 1)^2 is least, at most h away; false when it has no
 * minimum. at_side[k]: x_k stays. */
static bool step_to_minimum(const double f[3][3], const bool at_side[2], double step[2]) {
  double g[2] = {0.5 * (f[2][1] - f[0][1]), 0.5 * (f[1][2] - f[1][0])};
  double uu = f[2][1] - 2 * f[1][1] + f[0][1], vv = f[1][2] - 2 * f[1][1] + f[1][0];
  double uv = 0.25 * (f[2][2] - f[2][0] - f[0][2] + f[0][0]);
  step[0] = step[1] = 0;
  if (at_side[0] && at_side[1]) return false;
  if (at_side[0] || at_side[1]) {
    int k = at_side[0] ? 1 : 0;
    double h = k ? vv : uu;
    step[k] = -g[k] / h;
    return h > 0 && fabs(step[k]) <= 1;
  }
  double det = uu * vv - uv * uv;
  step[0] = (uv * g[1] - vv * g[0]) / det;
  step[1] = (uv * g[0] - uu * g[1]) / det;
  return uu > 0 && det > 0 && fabs(step[0]) <= 1 && fabs(step[1]) <= 1;
}

static void descend(const job *j, int what, candidate *c) {
  double h = 0.5 / (j->lines - 1);
  for (int level = 0, pass = 0; level < HALVINGS && pass < 8 * HALVINGS; pass++) {
    double f[3][3], best[2] = {c->x[0], c->x[1]}, least = c->value, step[2];
    for (int a = 0; a < 3; a++)
      for (int b = 0; b < 3; b++) {
        const double x[2] = {fmin(fmax(c->x[0] + (a - 1) * h, 0), 1), fmin(fmax(c->x[1] + (b - 1) * h, 0), 1)};
        f[a][b] = a == 1 && b == 1 ? c->value : value_at(j, what, c, x);
        if (f[a][b] < least) {
          least = f[a][b];
          memcpy(best, x, sizeof x);
        }
      }
    const bool at_side[2] = {c->x[0] < h || c->x[0] > 1 - h, c->x[1] < h || c->x[1] > 1 - h};
    bool better = least < c->value;
    if (step_to_minimum((const double(*)[3])f, at_side, step)) {
      const double x[2] = {fmin(fmax(c->x[0] + h * step[0], 0), 1), fmin(fmax(c->x[1] + h * step[1], 0), 1)};
      double value = value_at(j, what, c, x);
      if (value < least) {
        least = value;
        memcpy(best, x, sizeof x);
      }
    }
    memcpy(c->x, best, sizeof best);
    c->value = least;
    if (better) continue;
    h *= 0.5;
    level++;
  }
}

static void descend_some(void *arg, size_t index) {
  const job *j = arg;
  candidate *c = &j->best[index / STARTS][index % STARTS];
  if (c->value < INFINITY) descend(j, (int)(index / STARTS), c);
}

/* ---- the whole ------------------------------------------------------------------------------------ */

static batten_status search_grid(batten_context *ctx, job *j, double from, double to) {
  size_t pairs = j->axis[0].count * j->axis[1].count;
  for (int e = 0; e < SURFACE_EXTREMES; e++)
    for (int s = 0; s < STARTS; s++) j->best[e][s] = (candidate){.value = INFINITY};
  for (j->first = 0; j->first < pairs; j->first += BATCH) {
    batten_status st = batten_progress(ctx, "measure", from + (to - from) * (double)j->first / (double)pairs);
    if (st < 0) return st;
    size_t now = pairs - j->first < BATCH ? pairs - j->first : BATCH;
    batten_parallel(ctx, now, search_pair, j);
    for (size_t p = 0; p < now; p++)
      for (size_t e = 0; e < SURFACE_EXTREMES; e++)
        for (size_t s = 0; s < KEPT; s++) insert(&j->kept[(p * SURFACE_EXTREMES + e) * KEPT + s], STARTS, j->best[e]);
  }
  return batten_progress(ctx, "measure", to);
}

static void take_best(const job *j, surface_extreme out[SURFACE_EXTREMES]) {
  for (int e = 0; e < SURFACE_EXTREMES; e++) {
    const candidate *best = &j->best[e][0];
    for (int s = 1; s < STARTS; s++)
      if (j->best[e][s].value < best->value) best = &j->best[e][s];
    double sign = e == SURFACE_GAUSS_MAX || e == SURFACE_MEAN_MAX ? -1 : 1;
    out[e] = (surface_extreme){NAN, {NAN, NAN}};
    if (!(best->value < INFINITY)) continue;
    out[e].value = sign * best->value;
    const size_t span[2] = {best->i, best->j};
    for (int k = 0; k < 2; k++)
      out[e].at[k] = surface_span_at(&j->surface->space[k], j->axis[k].span[span[k]], best->x[k]);
  }
}

batten_status surface_find_extremes(batten_context *ctx, const batten_surface *surface, const surface_axis axis[2],
                                    double from, double to, surface_extreme out[SURFACE_EXTREMES]) {
  size_t pairs = axis[0].count * axis[1].count, batch = pairs < BATCH ? pairs : BATCH;
  job j = {.surface = surface, .axis = axis, .lines = pairs <= 1024 ? LINES_MAX : pairs <= 65536 ? 9 : 5};
  batten_status st = BATTEN_E_NOMEM;
  j.values = batten_alloc_array(ctx, batch * SURFACE_EXTREMES, j.lines * j.lines * sizeof *j.values);
  j.kept = batten_alloc_array(ctx, batch * SURFACE_EXTREMES, KEPT * sizeof *j.kept);
  j.best = batten_alloc_array(ctx, SURFACE_EXTREMES, sizeof *j.best);
  if (!j.values || !j.kept || !j.best) goto done;
  st = search_grid(ctx, &j, from, to);
  if (st < 0) goto done;
  batten_parallel(ctx, SURFACE_EXTREMES * STARTS, descend_some, &j);
  take_best(&j, out);
done:
  batten_free(ctx, j.best);
  batten_free(ctx, j.kept);
  batten_free(ctx, j.values);
  return st;
}

batten_status surface_gauss_range(batten_context *ctx, const batten_surface *surface, double range[2]) {
  surface_axis axis[2] = {{0}};
  surface_extreme found[SURFACE_EXTREMES];
  batten_status st = BATTEN_OK;
  for (int k = 0; k < 2 && st >= 0; k++) st = surface_axis_make(ctx, &surface->space[k], &axis[k]);
  if (st >= 0) st = surface_find_extremes(ctx, surface, axis, 0, 1, found);
  for (int k = 0; k < 2; k++) surface_axis_free(ctx, &axis[k]);
  if (st < 0) return st;
  double unit = ldexp(1, surface->exponent);
  range[0] = found[SURFACE_GAUSS_MIN].value * unit * unit;
  range[1] = found[SURFACE_GAUSS_MAX].value * unit * unit;
  return BATTEN_OK;
}
