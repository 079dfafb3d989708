/* A surface whose turns hold, from one in which some do not.
 *
 * Separators bound each leg by itself, and so ask for more than that [p, q] keeps its sign for legs p and q that turn
 * and stretch together. Where programs leave vertices without a solution, the turns themselves are taken, at some
 * heights zeta of a patch: minimise the objective F subject to
 *
 *   c_0(zeta) = [p turned by lower, q] >= 0,   c_1(zeta) = -[p turned by upper, q] >= 0
 *
 * over |p| |q| of the surface before, so that they are about radians where legs become short between contours too.
 * They are bilinear in the unknowns, and kept by an augmented Lagrangian F + mu / 2 sum w max(0, lambda / mu - c)^2.
 * Its minima in y are found by Newton's method with the Hessian of F and the squares of the gradients of c:
 * symmetric, positive definite, and as sparse as H [Nocedal, Wright: Numerical Optimization, ch. 17]. Heights at
 * which a condition fails most are added on the way. Twice the margin is asked for, so that what lies between the
 * heights holds too: loft_shortage, which proves it for all heights, decides. Where contours hardly turn, that would
 * be lost in rounding: sections away from them are asked for a bit more, by how much rises with the square of the
 * distance, as turns may that touch zero. */
#include <string.h>

#include "base/checked.h"
#include "loft_inner.h"
#include "objective.h"

/* Heights of a vertex at first, and at most; where others are looked for. Rounds of multipliers, Newton steps of
 * each, halvings of a step. Neighbours of a failing vertex that are looked after too. */
enum {
  HEIGHTS = 19,
  HEIGHTS_MAX = 48,
  FINE = 400,
  OUTER = 30,
  INNER = 20,
  HALVINGS = 20,
  AROUND = 2,
  STALE = 8,
  SHORTER = 2
};

static const double PI = 3.14159265358979323846;
static const double MU_FIRST = 100, MU_RAISE = 4, MU_MOST = 1e6;
/* A round that does not bring the worst condition below this part of what it was raises mu. */
static const double FALLS = 0.5;
/* Newton's method has done when a step promises less than this part of the penalty. */
static const double ENOUGH = 1e-3;
static const double ARMIJO = 1e-4;
/* Where legs become short the conditions bend more than H and the squares of their gradients say: steps that had to
 * be halved more than SHORTER times raise the part of H. */
static const double DAMP = 10, DAMP_MOST = 1e8;
/* Of vertices that only keep eq. 11, what counts as failing, radians. */
static const double FREE_SIZE = 1e-3;
/* The bit that sections half way between contours turn beyond what they must, radians. */
static const double BIT = 1e-6;
/* Legs count as no shorter than this part of what they are at the contours. */
static const double SHORTEST = 1e-2;
/* Rounds of multipliers without falling below this part of the least that was missing, after which there is no
 * solution. */
static const double LESS = 0.9;

/* A vertex with its legs as functions of the unknowns that they depend on. */
typedef struct corner {
  size_t slab, v;
  double weight;     /* of the objective's legs there */
  double turn[2][2]; /* by lower and by upper: cosine and sine */
  double length[2];  /* mean ones at the contours */
  double size;       /* of the margin, radians */
  bool free;         /* only eq. 11 is asked for */
  size_t count;      /* unknowns */
  uint32_t *unknown; /* [count] */
  double *leg[2];    /* [degree + 1][count] */
  size_t heights;
  double at[HEIGHTS_MAX], lambda[2][HEIGHTS_MAX];
  double area[HEIGHTS_MAX]; /* |p| |q| of the last surface */
} corner;

typedef struct work {
  batten_context *ctx;
  const loft_net *net;
  const loft_objective *objective;
  const double *free;
  double margin, mu;
  double damping; /* times H, in the matrix of Newton's method */
  size_t count, room;
  corner *corners;
  size_t *start; /* [slabs + 1] first vertex of each, of all */
  bool *in;      /* [vertices] has a corner */
  size_t unknowns_most;
  block_matrix a;
  block_plan *plan;
  double *y, *step, *trial, *gradient; /* [unknowns][2] */
  double *control;                     /* of the point that was looked at last */
  double *local, *by;                  /* [2 unknowns_most]^2, [2 unknowns_most] */
  double penalty;                      /* of the value that was asked for last */
  size_t steps;
} work;

static void work_free(work *w) {
  for (size_t k = 0; k < w->count; k++) {
    batten_free(w->ctx, w->corners[k].leg[0]);
    batten_free(w->ctx, w->corners[k].unknown);
  }
  block_plan_free(w->ctx, w->plan);
  block_matrix_free(w->ctx, &w->a);
  void *const blocks[] = {w->by,   w->local, w->control, w->gradient, w->trial,
                          w->step, w->y,     w->in,      w->start,    w->corners};
  for (size_t k = 0; k < sizeof blocks / sizeof *blocks; k++) batten_free(w->ctx, blocks[k]);
}

static batten_status work_start(work *w, const double *y) {
  size_t slabs = w->net->slab_count, numbers = 2 * w->net->z.columns;
  w->start = batten_alloc_array(w->ctx, slabs + 1, sizeof *w->start);
  w->y = batten_alloc_array(w->ctx, numbers, sizeof *w->y);
  w->step = batten_alloc_array(w->ctx, numbers, sizeof *w->step);
  w->trial = batten_alloc_array(w->ctx, numbers, sizeof *w->trial);
  w->gradient = batten_alloc_array(w->ctx, numbers, sizeof *w->gradient);
  w->control = batten_alloc_array(w->ctx, w->net->z.rows, 2 * sizeof *w->control);
  if (!w->start || !w->y || !w->step || !w->trial || !w->gradient || !w->control) return BATTEN_E_NOMEM;
  w->start[0] = 0;
  for (size_t i = 0; i < slabs; i++) w->start[i + 1] = w->start[i] + loft_vertices(&w->net->slabs[i].space);
  w->in = batten_alloc_array(w->ctx, w->start[slabs], sizeof *w->in);
  if (!w->in) return BATTEN_E_NOMEM;
  memset(w->in, 0, w->start[slabs] * sizeof *w->in);
  memcpy(w->y, y, numbers * sizeof *y);
  loft_net_expand(w->net, w->y, w->control);
  return BATTEN_OK;
}

/* ---- conditions ---------------------------------------------------------------------------------- */

/* Both conditions of a corner at a height. */
typedef struct spot {
  double basis[ORDER], p[2], q[2], value[2];
} spot;

static void get_legs(const work *w, const corner *c, double (*leg)[ORDER][2]) {
  for (size_t e = 0; e < 2; e++) loft_leg(w->net, w->control, c->slab, c->v + e, leg[e]);
}

/* What turns are asked for beyond their bound. */
static double bit(const corner *c, double zeta) {
  double rise = 4 * zeta * (1 - zeta);
  return c->free ? 0 : BIT * rise * rise;
}

/* |p| |q| */
static double area_at(const corner *c, const spot *at) {
  return fmax(hypot(at->p[0], at->p[1]), SHORTEST * c->length[0]) *
         fmax(hypot(at->q[0], at->q[1]), SHORTEST * c->length[1]);
}

/* area 0: as it is there. */
static void look(const work *w, const corner *c, double (*leg)[ORDER][2], double zeta, double area, spot *out) {
  unsigned n = w->net->degree;
  *out = (spot){.basis = {1}};
  for (unsigned r = 1; r <= n; r++)
    for (unsigned k = r + 1; k-- > 0;)
      out->basis[k] = (k < r ? (1 - zeta) * out->basis[k] : 0) + (k ? zeta * out->basis[k - 1] : 0);
  for (unsigned k = 0; k <= n; k++)
    for (int x = 0; x < 2; x++) {
      out->p[x] += out->basis[k] * leg[0][k][x];
      out->q[x] += out->basis[k] * leg[1][k][x];
    }
  if (area == 0) area = area_at(c, out);
  for (int f = 0; f < 2; f++) {
    const double *turn = c->turn[f];
    double turned[2] = {turn[0] * out->p[0] - turn[1] * out->p[1], turn[1] * out->p[0] + turn[0] * out->p[1]};
    out->value[f] = (f ? -1 : 1) * loft_cross(turned, out->q) / area - bit(c, zeta);
  }
}

static void new_height(const work *w, corner *c, double (*leg)[ORDER][2], double zeta) {
  spot at;
  size_t s = c->heights++;
  look(w, c, leg, zeta, 0, &at);
  c->at[s] = zeta;
  c->area[s] = area_at(c, &at);
  c->lambda[0][s] = c->lambda[1][s] = 0;
}

/* ---- vertices ------------------------------------------------------------------------------------ */

/* Row of a control point of a vertex: j = 0, 1, 2 before, at and behind it. */
static size_t row_of(const work *w, const corner *c, size_t j, unsigned k) {
  return loft_at(w->net, c->slab, (c->v + j) % w->net->slabs[c->slab].space.count, k);
}

/* The unknown's number at the corner, c->count where it has none. */
static size_t find(const corner *c, uint32_t unknown) {
  size_t k = 0;
  while (k < c->count && c->unknown[k] != unknown) k++;
  return k;
}

static batten_status make_legs(work *w, corner *c) {
  const loft_matrix *z = &w->net->z;
  size_t most = 0, order = (size_t)w->net->degree + 1;
  for (size_t j = 0; j < 3; j++)
    for (unsigned k = 0; k < order; k++) {
      size_t row = row_of(w, c, j, k);
      most += z->starts[row + 1] - z->starts[row];
    }
  c->unknown = batten_alloc_array(w->ctx, most, sizeof *c->unknown);
  if (!c->unknown) return BATTEN_E_NOMEM;
  for (size_t j = 0; j < 3; j++)
    for (unsigned k = 0; k < order; k++)
      for (size_t row = row_of(w, c, j, k), at = z->starts[row]; at < z->starts[row + 1]; at++)
        if (find(c, z->indices[at]) == c->count) c->unknown[c->count++] = z->indices[at];
  c->leg[0] = batten_alloc_array(w->ctx, 2 * order * c->count, sizeof *c->leg[0]);
  if (!c->leg[0]) return BATTEN_E_NOMEM;
  c->leg[1] = c->leg[0] + order * c->count;
  memset(c->leg[0], 0, 2 * order * c->count * sizeof *c->leg[0]);
  for (size_t j = 0; j < 3; j++)
    for (unsigned k = 0; k < order; k++)
      for (size_t row = row_of(w, c, j, k), at = z->starts[row]; at < z->starts[row + 1]; at++) {
        size_t u = k * c->count + find(c, z->indices[at]);
        if (j < 2) c->leg[j][u] -= z->values[at];
        if (j > 0) c->leg[j - 1][u] += z->values[at];
      }
  if (c->count > w->unknowns_most) w->unknowns_most = c->count;
  return BATTEN_OK;
}

static batten_status enroll(work *w, size_t i, size_t v) {
  const loft_slab *slab = &w->net->slabs[i];
  size_t next = (v + 1) % loft_legs(&slab->space);
  loft_bound bound;
  double twice = fmin(2 * w->margin, 0.5 * (1 + w->margin));
  if (w->in[w->start[i] + v] || !loft_bound_of(slab, v, twice, &bound)) return BATTEN_OK;
  if (w->count == w->room) {
    size_t room = w->room + w->room / 2 + 32;
    void *corners = batten_realloc_array(w->ctx, w->corners, room, sizeof *w->corners);
    if (!corners) return BATTEN_E_NOMEM;
    w->corners = corners;
    w->room = room;
  }
  double p = (slab->length[0][v] + slab->length[1][v]) / 2, q = (slab->length[0][next] + slab->length[1][next]) / 2;
  corner *c = &w->corners[w->count];
  memset(c, 0, sizeof *c);
  c->slab = i;
  c->v = v;
  c->free = slab->wanted[v] == LOFT_FREE;
  c->weight = fmax(p, q) / w->objective->polygon;
  c->length[0] = p;
  c->length[1] = q;
  c->size = c->free ? FREE_SIZE : fmin(fabs(bound.lower), fabs(bound.upper));
  for (size_t f = 0; f < 2; f++) {
    double angle = f ? bound.upper : bound.lower;
    c->turn[f][0] = cos(angle);
    c->turn[f][1] = sin(angle);
  }
  w->count++;
  w->in[w->start[i] + v] = true;
  batten_status st = make_legs(w, c);
  if (st < 0) return st;
  double leg[2][ORDER][2];
  get_legs(w, c, leg);
  for (size_t s = 0; s < HEIGHTS; s++) new_height(w, c, leg, 0.5 - 0.5 * cos(PI * (double)(s + 1) / (HEIGHTS + 1)));
  return BATTEN_OK;
}

/* Vertices whose turns do not hold, and their neighbours; how much is missing together; whether some are new. */
static batten_status look_around(work *w, double *shortage, bool *more) {
  size_t before = w->count;
  batten_status st = BATTEN_OK;
  *shortage = 0;
  for (size_t i = 0; i < w->net->slab_count && st >= 0; i++) {
    const loft_slab *slab = &w->net->slabs[i];
    size_t vertices = loft_vertices(&slab->space);
    for (size_t v = 0; v < vertices && st >= 0; v++) {
      loft_bound bound;
      if (!loft_bound_of(slab, v, w->margin, &bound)) continue;
      double missing = loft_shortage(w->net, w->control, i, v, &bound);
      if (!(missing > 0)) continue;
      *shortage += missing;
      for (size_t k = 0; k <= 2 * AROUND && st >= 0; k++) {
        size_t other = v + k + (slab->space.closed ? vertices * AROUND : 0); /* by AROUND too high */
        if (slab->space.closed || (other >= AROUND && other - AROUND < vertices))
          st = enroll(w, i, (other - AROUND) % vertices);
      }
    }
  }
  *more = w->count > before;
  return st;
}

/* The pattern of H for both coordinates with all pairs of unknowns of a corner, and how it is factored. */
static batten_status make_plan(work *w) {
  const block_matrix *h = &w->objective->h;
  size_t pairs = h->starts[h->rows], at = 0;
  for (size_t k = 0; k < w->count; k++) pairs += w->corners[k].count * (w->corners[k].count - 1) / 2;
  block_plan_free(w->ctx, w->plan);
  block_matrix_free(w->ctx, &w->a);
  batten_free(w->ctx, w->local);
  batten_free(w->ctx, w->by);
  w->plan = NULL;
  w->a = (block_matrix){0};
  w->local = batten_alloc_array(w->ctx, 4 * w->unknowns_most * w->unknowns_most, sizeof *w->local);
  w->by = batten_alloc_array(w->ctx, 2 * w->unknowns_most, sizeof *w->by);
  uint32_t *list = batten_alloc_array(w->ctx, pairs, 2 * sizeof *list);
  batten_status st = w->local && w->by && list ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  for (size_t row = 0; row < h->rows; row++)
    for (size_t j = h->starts[row]; j < h->starts[row + 1]; j++)
      if (h->columns[j] > row) {
        list[at++] = (uint32_t)row;
        list[at++] = h->columns[j];
      }
  for (size_t k = 0; k < w->count; k++)
    for (size_t i = 0; i < w->corners[k].count; i++)
      for (size_t j = 0; j < i; j++) {
        list[at++] = w->corners[k].unknown[i];
        list[at++] = w->corners[k].unknown[j];
      }
  st = block_matrix_new(w->ctx, h->rows, 2, at / 2, list, &w->a);
  if (st >= 0) st = block_plan_new(w->ctx, &w->a, BLOCK_QUICK, &w->plan);
done:
  batten_free(w->ctx, list);
  return st;
}

/* ---- the Lagrangian ------------------------------------------------------------------------------ */

/* The Lagrangian. */
static double value_of(work *w, const double *y) {
  w->penalty = 0;
  loft_net_expand(w->net, y, w->control);
  for (size_t k = 0; k < w->count; k++) {
    const corner *c = &w->corners[k];
    double leg[2][ORDER][2];
    get_legs(w, c, leg);
    for (size_t s = 0; s < c->heights; s++) {
      spot at;
      look(w, c, leg, c->at[s], c->area[s], &at);
      for (int f = 0; f < 2; f++) {
        double t = fmax(0, c->lambda[f][s] / w->mu - at.value[f]);
        w->penalty += 0.5 * w->mu * c->weight * t * t;
      }
    }
  }
  return loft_objective_value(w->objective, y) + w->penalty;
}

/* A condition that fails by t: its gradient, and the square of it. */
static void add_condition(work *w, const corner *c, const spot *at, size_t s, int f, double t) {
  double sign = (f ? -1 : 1) / c->area[s], weight = w->mu * c->weight;
  double cosine = c->turn[f][0], sine = c->turn[f][1];
  double by_q[2] = {-sign * (sine * at->p[0] + cosine * at->p[1]), sign * (cosine * at->p[0] - sine * at->p[1])};
  double by_p[2] = {sign * (cosine * at->q[1] - sine * at->q[0]), -sign * (cosine * at->q[0] + sine * at->q[1])};
  size_t n = 2 * c->count;
  for (size_t u = 0; u < c->count; u++) {
    double of_p = 0, of_q = 0;
    for (unsigned k = 0; k <= w->net->degree; k++) {
      of_p += at->basis[k] * c->leg[0][k * c->count + u];
      of_q += at->basis[k] * c->leg[1][k * c->count + u];
    }
    for (size_t x = 0; x < 2; x++) {
      w->by[2 * u + x] = of_p * by_p[x] + of_q * by_q[x];
      w->gradient[2 * c->unknown[u] + x] -= weight * t * w->by[2 * u + x];
    }
  }
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < n; j++) w->local[i * n + j] += weight * w->by[i] * w->by[j];
}

static void add_corner(work *w, const corner *c) {
  double leg[2][ORDER][2];
  size_t n = 2 * c->count;
  bool any = false;
  get_legs(w, c, leg);
  memset(w->local, 0, n * n * sizeof *w->local);
  for (size_t s = 0; s < c->heights; s++) {
    spot at;
    look(w, c, leg, c->at[s], c->area[s], &at);
    for (int f = 0; f < 2; f++) {
      double t = c->lambda[f][s] / w->mu - at.value[f];
      if (!(t > 0)) continue;
      add_condition(w, c, &at, s, f, t);
      any = true;
    }
  }
  for (size_t u = 0; u < c->count && any; u++)
    for (size_t v = 0; v < c->count; v++) {
      double *block = block_matrix_at(&w->a, c->unknown[u], c->unknown[v]);
      for (size_t x = 0; x < 2; x++)
        for (size_t z = 0; z < 2; z++) block[2 * x + z] += w->local[(2 * u + x) * n + 2 * v + z];
    }
}

/* Gradient of the Lagrangian at y, and the matrix of Newton's method. */
static void assemble(work *w) {
  const block_matrix *h = &w->objective->h;
  memset(w->a.values, 0, 4 * w->a.starts[w->a.rows] * sizeof *w->a.values);
  memset(w->gradient, 0, 2 * h->rows * sizeof *w->gradient);
  for (size_t row = 0; row < h->rows; row++)
    for (size_t j = h->starts[row]; j < h->starts[row + 1]; j++) {
      size_t column = h->columns[j];
      double *block = block_matrix_at(&w->a, row, column);
      block[0] = block[3] = (1 + w->damping) * h->values[j];
      for (size_t x = 0; x < 2; x++)
        w->gradient[2 * row + x] += h->values[j] * (w->y[2 * column + x] - w->free[2 * column + x]);
    }
  loft_net_expand(w->net, w->y, w->control);
  for (size_t k = 0; k < w->count; k++) add_corner(w, &w->corners[k]);
}

/* ---- Newton's method, multipliers ---------------------------------------------------------------- */

static void damp(work *w) { w->damping = fmin(fmax(DAMP * w->damping, 1), DAMP_MOST); }

/* The minimum for fixed lambda and mu. */
static batten_status minimise(work *w, double progress) {
  size_t n = 2 * w->objective->h.rows;
  double value = value_of(w, w->y);
  for (unsigned step = 0; step < INNER; step++) {
    batten_status st = batten_progress(w->ctx, "quadratic program", progress);
    if (st < 0) return st;
    assemble(w);
    st = block_factor(w->ctx, w->plan, &w->a, NULL);
    w->steps++;
    if (st == BATTEN_E_SINGULAR) { /* to rounding */
      batten_fail(w->ctx, BATTEN_OK, "%s", "");
      if (w->damping == DAMP_MOST) return BATTEN_OK;
      damp(w);
      continue;
    }
    if (st < 0) return st;
    for (size_t k = 0; k < n; k++) w->step[k] = -w->gradient[k];
    block_solve(w->ctx, w->plan, w->step);
    double slope = 0, length = 1, next = value;
    unsigned halvings = 0;
    for (size_t k = 0; k < n; k++) slope += w->gradient[k] * w->step[k];
    for (; halvings < HALVINGS; halvings++, length *= 0.5) {
      for (size_t k = 0; k < n; k++) w->trial[k] = w->y[k] + length * w->step[k];
      next = value_of(w, w->trial);
      if (next <= value + ARMIJO * length * slope) break;
    }
    if (halvings > SHORTER) damp(w);
    if (halvings == 0) w->damping = w->damping > 1 ? w->damping / DAMP : 0;
    if (halvings == HALVINGS && w->damping == DAMP_MOST) return BATTEN_OK;
    if (halvings == HALVINGS) continue;
    memcpy(w->y, w->trial, n * sizeof *w->y);
    value = next;
    if (-slope <= ENOUGH * w->penalty) return BATTEN_OK;
  }
  return BATTEN_OK;
}

/* Where a condition fails most is one more height. */
static void add_height(const work *w, corner *c, double (*leg)[ORDER][2]) {
  double worst = 0.25, height = NAN;
  for (size_t s = 1; s < FINE; s++) {
    double zeta = 0.5 - 0.5 * cos(PI * (double)s / FINE);
    spot at;
    look(w, c, leg, zeta, 0, &at);
    double fails = -fmin(at.value[0], at.value[1]) / (c->size + bit(c, zeta));
    if (fails > worst) {
      worst = fails;
      height = zeta;
    }
  }
  for (size_t s = 0; s < c->heights; s++)
    if (fabs(c->at[s] - height) < 1e-9) return;
  if (isnan(height) || c->heights == HEIGHTS_MAX) return;
  new_height(w, c, leg, height);
}

/* Multipliers of the minimum; by how many margins the worst condition fails. */
static double update(work *w) {
  double worst = 0;
  loft_net_expand(w->net, w->y, w->control);
  for (size_t k = 0; k < w->count; k++) {
    corner *c = &w->corners[k];
    double leg[2][ORDER][2];
    get_legs(w, c, leg);
    for (size_t s = 0; s < c->heights; s++) {
      spot at;
      look(w, c, leg, c->at[s], c->area[s], &at);
      double area = area_at(c, &at), before = c->area[s] / area;
      for (int f = 0; f < 2; f++) {
        double value = (at.value[f] + bit(c, c->at[s])) * before - bit(c, c->at[s]);
        c->lambda[f][s] = fmax(0, c->lambda[f][s] - w->mu * at.value[f]) / before;
        worst = fmax(worst, -value / (c->size + bit(c, c->at[s])));
      }
      c->area[s] = area;
    }
    add_height(w, c, leg);
  }
  return worst;
}

batten_status loft_settle(batten_context *ctx, const loft_net *net, const loft_objective *objective, double margin,
                          const double *free, double *y, size_t *steps, bool *feasible) {
  work w = {.ctx = ctx, .net = net, .objective = objective, .free = free, .margin = margin, .mu = MU_FIRST};
  double shortage = 0, worst = INFINITY, least = INFINITY;
  bool more = false;
  unsigned stale = 0;
  batten_status st = work_start(&w, y);
  if (st >= 0) st = look_around(&w, &shortage, &more);
  for (unsigned outer = 0; outer < OUTER && st >= 0 && shortage > 0 && stale < STALE; outer++) {
    if (more) st = make_plan(&w);
    if (st >= 0) st = minimise(&w, (double)outer / OUTER);
    if (st < 0) break;
    double now = update(&w);
    if (now > FALLS * worst) w.mu = fmin(w.mu * MU_RAISE, MU_MOST);
    worst = now;
    st = look_around(&w, &shortage, &more);
    stale = shortage < LESS * least ? 0 : stale + 1;
    least = fmin(least, shortage);
  }
  if (st >= 0) {
    memcpy(y, w.y, 2 * net->z.columns * sizeof *y);
    *steps += w.steps;
    *feasible = shortage == 0;
  }
  work_free(&w);
  return st;
}
