/* Measures of a surface: integrals by quadrature, quantiles and tangent planes by sampling; extremes.c and box.c.
 *
 * Span pairs are cut into cells of 8 x 8 Gauss points. A cell whose integrands have too large a share of the Legendre
 * polynomials of degree 7, the last that the nodes can tell, is cut in four: where coefficients fall like those of
 * smooth functions, the rule's error is about the square of that share. The points of the cells before they are cut
 * are samples for the quantiles. All is measured from the middle of the control points' box, in a unit of about its
 * size. */
#include "surface_inner.h"

#include "base/checked.h"
#include "basis/gauss8.h"
#include "basis/quantile.h"
#include "basis/shape.h"
#include "mesh/box_tree.h"
#include "mesh/vec.h"

#include <string.h>

enum {
  POINTS = GAUSS8 * GAUSS8,
  CELLS = 24,      /* of a surface of few spans in each direction, so that quantiles have enough samples */
  SAMPLED = 16384, /* cells all of whose points are samples; of more cells fewer points each */
  DEPTH = 6,
  EACH = 8,   /* cells of a task: about 100 us */
  BATCH = 32, /* tasks between two progress calls */
  LINES = 49  /* of the grid of tangent planes, in both directions */
};
/* Of the highest coefficients in a cell's integrals; K: solid angle, 1 being that of much of a sphere. */
static const double SHARE = 1e-6, SOLID_ANGLE = 1e-10;
/* |H| times the size of the surface, below which rounding may tell to which side it bends. */
static const double FLAT = 1e-9;

typedef struct sums {
  double area, moment[3], gauss;
} sums;

typedef struct job {
  const batten_surface *surface;
  surface_axis axis[2];
  double middle[3];
  size_t cuts, cells;   /* cells of a span in each direction; in all */
  size_t stride, slots; /* every stride-th Gauss point of a cell is a sample: [cells][slots] */
  size_t first_task;
  sums *sums; /* [tasks] */
  weighted_sample *samples;
  double (*points)[3], (*normals)[3]; /* [LINES][LINES], for the tangent planes */
  double *mean;                       /* [LINES][LINES], NaN without a normal */
  double *gaps;                       /* [LINES] */
} job;

/* ---- one cell ------------------------------------------------------------------------------------ */

/* A rectangle of a span pair, in parts of its spans. */
typedef struct cell {
  double lower[2], width;
  unsigned depth;
} cell;

/* Eight lines of a cell in direction k, and their weights in u' or v'. */
static void make_lines(const job *j, int k, size_t span, const cell *c, surface_basis *basis, double *weight) {
  const bspline *space = &j->surface->space[k];
  size_t mu = j->axis[k].span[span];
  double length = space->knots[mu + 1] - space->knots[mu];
  for (unsigned i = 0; i < GAUSS8; i++) {
    double x, w;
    gauss8_node(i, &x, &w);
    surface_basis_make(space, mu, surface_span_at(space, mu, c->lower[k] + c->width * x), &basis[i]);
    weight[i] = w * c->width * ldexp(length, basis[i].exponent);
  }
}

/* The Legendre polynomial of degree 7 on [0, 1]. */
static double last_polynomial(double x) {
  double t = 2 * x - 1, s = t * t;
  return t * (((429 * s - 693) * s + 315) * s - 35) / 16;
}

/* Integrals over a cell; samples of K and area when not NULL. False when they need smaller cells. */
static bool integrate_cell(const job *j, size_t i, size_t k, const cell *c, sums *out, weighted_sample *samples) {
  surface_basis u[GAUSS8], v[GAUSS8];
  double wu[GAUSS8], wv[GAUSS8], high[GAUSS8], rest[4] = {0}, angle = 0, unit = ldexp(1, j->surface->exponent);
  make_lines(j, 0, i, c, u, wu);
  make_lines(j, 1, k, c, v, wv);
  for (unsigned a = 0; a < GAUSS8; a++) {
    double x, w;
    gauss8_node(a, &x, &w);
    high[a] = last_polynomial(x);
  }
  *out = (sums){0};
  for (unsigned p = 0; p < POINTS; p++) {
    unsigned a = p / GAUSS8, b = p % GAUSS8;
    double jet[6][3], cross[3];
    surface_shape shape;
    surface_jet_scaled(j->surface, &u[a], &v[b], jet);
    vec_cross(jet[1], jet[2], cross);
    bool regular = surface_shape_make((const double(*)[3])jet, &shape);
    double area = wu[a] * wv[b] * vec_norm(cross), gauss = regular ? area * shape.gauss : 0;
    out->area += area;
    out->gauss += gauss;
    for (int d = 0; d < 3; d++) out->moment[d] += area * ((jet[0][d] - j->middle[d]) * unit);
    rest[0] += high[a] * area;
    rest[1] += high[b] * area;
    rest[2] += high[a] * gauss;
    rest[3] += high[b] * gauss;
    angle += fabs(gauss);
    if (samples && (p + i + k) % j->stride == 0) *samples++ = (weighted_sample){shape.gauss, regular ? area : 0};
  }
  return fabs(rest[0]) + fabs(rest[1]) <= SHARE * out->area &&
         fabs(rest[2]) + fabs(rest[3]) <= SHARE * angle + SOLID_ANGLE;
}

static void add_sums(const sums *from, sums *to) {
  to->area += from->area;
  to->gauss += from->gauss;
  for (int d = 0; d < 3; d++) to->moment[d] += from->moment[d];
}

static void integrate_whole_cell(const job *j, size_t index, sums *out) {
  size_t of_pair = j->cuts * j->cuts, pair = index / of_pair, at = index % of_pair;
  size_t i = pair / j->axis[1].count, k = pair % j->axis[1].count, height = 1;
  double width = 1 / (double)j->cuts;
  cell stack[3 * DEPTH + 1] = {{{(double)(at / j->cuts) * width, (double)(at % j->cuts) * width}, width, 0}};
  weighted_sample *samples = j->samples + index * j->slots;
  for (size_t s = 0; s < j->slots; s++) samples[s].weight = 0;
  while (height > 0) {
    cell c = stack[--height];
    sums own;
    if (integrate_cell(j, i, k, &c, &own, c.depth == 0 ? samples : NULL) || c.depth == DEPTH) {
      add_sums(&own, out);
      continue;
    }
    for (int q = 0; q < 4; q++)
      stack[height++] = (cell){
          {c.lower[0] + (q & 1) * 0.5 * c.width, c.lower[1] + (q >> 1) * 0.5 * c.width}, 0.5 * c.width, c.depth + 1};
  }
}

static void integrate_some(void *arg, size_t index) {
  const job *j = arg;
  size_t task = j->first_task + index, from = task * EACH;
  sums s = {0};
  for (size_t c = from; c < from + EACH && c < j->cells; c++) integrate_whole_cell(j, c, &s);
  j->sums[task] = s;
}

static batten_status integrate(batten_context *ctx, job *j, sums *out) {
  size_t tasks = j->cells / EACH + (j->cells % EACH > 0);
  *out = (sums){0};
  for (size_t done = 0; done < tasks; done += BATCH) {
    batten_status st = batten_progress(ctx, "measure", 0.6 * (double)done / (double)tasks);
    if (st < 0) return st;
    j->first_task = done;
    batten_parallel(ctx, tasks - done < BATCH ? tasks - done : BATCH, integrate_some, j);
  }
  for (size_t i = 0; i < tasks; i++) add_sums(&j->sums[i], out);
  return BATTEN_OK;
}

/* ---- tangent planes ------------------------------------------------------------------------------ */

/* Line `index` of LINES, spread evenly over the spans. */
static void make_line(const job *j, int k, size_t index, surface_basis *out) {
  const surface_axis *axis = &j->axis[k];
  double at = (double)axis->count * (double)index / (LINES - 1);
  size_t span = at < (double)(axis->count - 1) ? (size_t)at : axis->count - 1;
  const bspline *space = &j->surface->space[k];
  surface_basis_make(space, axis->span[span], surface_span_at(space, axis->span[span], at - (double)span), out);
}

static void make_planes(void *arg, size_t row) {
  const job *j = arg;
  surface_basis u, v;
  double unit = ldexp(1, j->surface->exponent);
  make_line(j, 0, row, &u);
  for (size_t column = 0, p = row * LINES; column < LINES; column++, p++) {
    double jet[6][3];
    surface_shape shape;
    make_line(j, 1, column, &v);
    surface_jet_scaled(j->surface, &u, &v, jet);
    j->mean[p] = surface_shape_make((const double(*)[3])jet, &shape) ? shape.mean : NAN;
    memcpy(j->normals[p], shape.normal, sizeof shape.normal);
    for (int d = 0; d < 3; d++) j->points[p][d] = (jet[0][d] - j->middle[d]) * unit;
  }
}

/* The most that a point lies beyond a plane of this row. Where the surface is flat no side is its own: the better. */
static void find_gap(void *arg, size_t row) {
  const job *j = arg;
  double gap = 0;
  for (size_t p = row * LINES; p < (row + 1) * LINES; p++) {
    if (isnan(j->mean[p])) continue;
    const double *n = j->normals[p];
    double own = vec_dot(n, j->points[p]), above = own, below = own;
    for (size_t i = 0; i < LINES * LINES; i++) {
      double height = vec_dot(n, j->points[i]);
      above = height > above ? height : above;
      below = height < below ? height : below;
    }
    above -= own;
    below = own - below;
    gap = fmax(gap, j->mean[p] > FLAT ? above : j->mean[p] < -FLAT ? below : fmin(above, below));
  }
  j->gaps[row] = gap;
}

static double supporting_gap(batten_context *ctx, job *j) {
  double gap = 0;
  batten_parallel(ctx, LINES, make_planes, j);
  batten_parallel(ctx, LINES, find_gap, j);
  for (size_t row = 0; row < LINES; row++) gap = fmax(gap, j->gaps[row]);
  return gap;
}

/* ---- the whole ----------------------------------------------------------------------------------- */

static batten_status plan(batten_context *ctx, job *j) {
  const batten_surface *s = j->surface;
  for (int k = 0; k < 2; k++) {
    batten_status st = surface_axis_make(ctx, &s->space[k], &j->axis[k]);
    if (st < 0) return st;
  }
  box3 box = box3_of_points(s->space[0].count * s->space[1].count, (const double(*)[3])s->control_points);
  for (int d = 0; d < 3; d++) j->middle[d] = 0.5 * box.lower[d] + 0.5 * box.upper[d];
  size_t larger = j->axis[0].count > j->axis[1].count ? j->axis[0].count : j->axis[1].count;
  size_t pairs = j->axis[0].count * j->axis[1].count;
  j->cuts = larger < CELLS ? CELLS / larger : 1;
  j->cells = pairs * j->cuts * j->cuts;
  j->stride = j->cells / SAMPLED + 1;
  if (j->stride > POINTS) j->stride = POINTS;
  j->slots = (POINTS + j->stride - 1) / j->stride;
  j->sums = batten_alloc_array(ctx, j->cells / EACH + 1, sizeof *j->sums);
  j->samples = batten_alloc_array(ctx, j->cells, j->slots * sizeof *j->samples);
  j->points = batten_alloc_array(ctx, LINES * LINES, sizeof *j->points);
  j->normals = batten_alloc_array(ctx, LINES * LINES, sizeof *j->normals);
  j->mean = batten_alloc_array(ctx, LINES * LINES, sizeof *j->mean);
  j->gaps = batten_alloc_array(ctx, LINES, sizeof *j->gaps);
  return j->sums && j->samples && j->points && j->normals && j->mean && j->gaps ? BATTEN_OK : BATTEN_E_NOMEM;
}

static void set_integrals(const job *j, const sums *total, batten_surface_measures *m) {
  double size = ldexp(1, -j->surface->exponent);
  m->area = total->area * size * size;
  m->gauss_integral = total->gauss;
  for (int d = 0; d < 3; d++)
    m->centroid[d] = j->middle[d] + (total->area > 0 ? total->moment[d] / total->area * size : 0);
}

static void set_extremes(const job *j, const surface_extreme found[SURFACE_EXTREMES], double area,
                         batten_surface_measures *m) {
  double unit = ldexp(1, j->surface->exponent);
  m->gauss_min = found[SURFACE_GAUSS_MIN].value * unit * unit;
  m->gauss_max = found[SURFACE_GAUSS_MAX].value * unit * unit;
  memcpy(m->gauss_min_at, found[SURFACE_GAUSS_MIN].at, sizeof m->gauss_min_at);
  memcpy(m->gauss_max_at, found[SURFACE_GAUSS_MAX].at, sizeof m->gauss_max_at);
  m->mean_min = found[SURFACE_MEAN_MIN].value * unit;
  m->mean_max = found[SURFACE_MEAN_MAX].value * unit;
  m->regularity_min = area > 0 ? found[SURFACE_AREA_MIN].value / area : 0;
}

static batten_status set_quantiles(batten_context *ctx, const job *j, batten_surface_measures *m) {
  static const double part[3] = {0.01, 0.5, 0.99};
  double *value[3] = {&m->gauss_p01, &m->gauss_p50, &m->gauss_p99}, unit = ldexp(1, j->surface->exponent);
  for (int i = 0; i < 3; i++) {
    batten_status st = batten_progress(ctx, "measure", 0.8 + 0.05 * i);
    if (st < 0) return st;
    *value[i] = weighted_quantile(j->cells * j->slots, j->samples, part[i]) * unit * unit;
  }
  return BATTEN_OK;
}

static batten_status measure(batten_context *ctx, job *j, batten_surface_measures *m) {
  sums total;
  surface_extreme found[SURFACE_EXTREMES];
  batten_status st = integrate(ctx, j, &total);
  if (st < 0) return st;
  set_integrals(j, &total, m);
  st = surface_find_extremes(ctx, j->surface, j->axis, 0.6, 0.8, found);
  if (st < 0) return st;
  set_extremes(j, found, total.area, m);
  st = set_quantiles(ctx, j, m);
  if (st < 0) return st;
  m->supporting_gap = ldexp(supporting_gap(ctx, j), -j->surface->exponent);
  st = batten_progress(ctx, "measure", 0.95);
  if (st < 0) return st;
  return surface_find_box(ctx, j->surface, j->axis, m->lower, m->upper);
}

batten_status batten_surface_measure(batten_context *ctx, const batten_surface *surface,
                                     batten_surface_measures *out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!surface || !out)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a surface and room for its measures",
                       surface ? "out" : "surface");
  job j = {.surface = surface};
  batten_surface_measures m;
  memset(&m, 0, sizeof m);
  batten_status st = plan(ctx, &j);
  if (st >= 0) st = measure(ctx, &j, &m);
  batten_free(ctx, j.gaps);
  batten_free(ctx, j.mean);
  batten_free(ctx, j.normals);
  batten_free(ctx, j.points);
  batten_free(ctx, j.samples);
  batten_free(ctx, j.sums);
  for (int k = 0; k < 2; k++) surface_axis_free(ctx, &j.axis[k]);
  if (st < 0) return st;
  *out = m;
  return BATTEN_OK;
}
