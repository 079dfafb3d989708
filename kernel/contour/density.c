/* How densely breaks lie along the data: a third as the data lie, the rest as the curve needs
 * them.
 *
 * A spline of degree d has an error of about h^(d + 1) |x^(d + 1)|, which is the same in all spans where their
 * lengths h go with |x^(d + 1)|^(-1 / (d + 1)) [de Boor: A Practical Guide to Splines, chapter XII, NEWKNOT]. That
 * derivative is told by the jumps of the third one (the second one, where d = 2) of a pilot, a cubic (quadratic)
 * spline whose breaks have equal numbers of points between them. Its number of spans is that of the least criterion
 * of Schwarz, so that noise makes no jumps; |.|^(1/4) tames what is left of them.
 *
 * The data are counted by their different parameters: equal numbers of them between breaks make all unknowns
 * determined [Schoenberg, Whitney], and the blend keeps a given part of that everywhere. */
#include "density.h"

#include <string.h>

#include "base/checked.h"
#include "deviations.h"

enum { TURN_SAMPLES = 8 };               /* of the pilot's tangent, per span */
static const double NEED_PART = 2.0 / 3; /* of the breaks */
static const double NEED_MOST = 16;      /* times the data's part: gaps and single jumps get no more */
static const double NEED_LEAST = 0.1;    /* of its mean: straight pieces have breaks, too */
/* Parts of the data's size below which structure is not worth spans. */
static const double FLOOR = 3e-5;

/* ---- least squares ------------------------------------------------------------------------------- */

void contour_least_free(batten_context *ctx, contour_least *f) {
  contour_space_free(ctx, &f->space);
  batten_free(ctx, f->control);
  *f = (contour_least){0};
}

batten_status contour_least_fit(batten_context *ctx, const contour_data *data, const double *parameters,
                                unsigned degree, unsigned smoothness, bool closed, size_t spans, const double *breaks,
                                contour_least *out) {
  contour_least f = {.spans = spans};
  contour_objective o = {0};
  signed char *signs = batten_alloc_array(ctx, spans, sizeof *signs);
  if (!signs) return BATTEN_E_NOMEM;
  memset(signs, 1, spans);
  const contour_shape shape = {degree, smoothness, closed, spans, breaks, signs};
  batten_status st = contour_space_make(ctx, &shape, degree, false, NULL, &f.space);
  if (st < 0) goto done;
  f.control = batten_alloc_array(ctx, f.space.b.count, 2 * sizeof(double));
  st = f.control ? contour_objective_new(ctx, &f.space.b, &o) : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  contour_objective_set(&o, data, parameters, contour_tension(CONTOUR_TENSION, spans));
  st = contour_objective_solve(ctx, &o, &f.space, f.control);
  if (st < 0) goto done;
  *out = f;
  f = (contour_least){0};
done:
  contour_objective_free(ctx, &o);
  contour_least_free(ctx, &f);
  batten_free(ctx, signs);
  return st;
}

static double weight_of(const contour_data *data, size_t i) { return data->weights ? data->weights[i] : 1; }

static void value_at(const bspline *b, const double *control, size_t *mu, double t, double x[4]) {
  double values[2 * BSPLINE_ORDER];
  if (!(b->knots[*mu] <= t && t < b->knots[*mu + 1])) *mu = bspline_span(b, t);
  bspline_basis(b, *mu, t, 1, values);
  memset(x, 0, 4 * sizeof *x);
  for (size_t r = 0; r < 2; r++)
    for (size_t j = 0; j <= b->degree; j++)
      for (size_t k = 0; k < 2; k++)
        x[2 * r + k] += values[r * (b->degree + 1) + j] * control[2 * (*mu - b->degree + j) + k];
}

/* Parts of the distances that are normal to the curve, by parameters that are not quite right. Those that are noise
 * are as far from their neighbours' as from 0: the mean square of their differences is twice
 * their own [von Neumann 1941]. Structure makes neighbours alike. */
void contour_left_of(const bspline *b, const double *control, const contour_data *data, const double *parameters,
                     contour_left *out) {
  double squares = 0, differences = 0, total = 0, pairs = 0, last = 0, most = 0, last_weight = 0;
  size_t mu = bspline_first(b);
  for (size_t i = 0; i < data->count; i++) {
    double x[4], e[2], weight = weight_of(data, i);
    value_at(b, control, &mu, parameters[i], x);
    for (size_t k = 0; k < 2; k++) e[k] = data->points[2 * i + k] - x[k];
    double speed = hypot(x[2], x[3]), off = speed > 0 ? contour_cross(x + 2, e) / speed : 0;
    double both = sqrt(weight * last_weight);
    squares += weight * off * off;
    total += weight;
    differences += both * (off - last) * (off - last);
    pairs += both;
    if (weight > 0) most = fmax(most, e[0] * e[0] + e[1] * e[1]);
    last_weight = weight;
    last = off;
  }
  out->rms = sqrt(squares / total);
  out->most = sqrt(most);
  out->noise = pairs > 0 ? sqrt(differences / (2 * pairs)) : 0;
}

double contour_schwarz(size_t count, double rms, double floor, size_t unknowns) {
  double n = (double)count;
  return n * log(rms * rms + floor * floor) + (double)unknowns * log(n);
}

/* ---- cells --------------------------------------------------------------------------------------- */

/* Cells between the different parameters of points that have weight, and their parts of the data: a whole one between
 * two places, and what is left at the ends: half a one; what is left of a closed curve's is one in both ends
 * together.
 */
static void make_cells(const contour_data *data, const double *parameters, bool closed, contour_density *d) {
  size_t n = 0;
  d->at[0] = 0;
  for (size_t i = 0; i < data->count; i++) {
    double t = parameters[i];
    if (weight_of(data, i) <= 0 || (closed && t >= 1 && n > 0)) continue;
    if (n > 0 && t <= d->at[n]) continue;
    d->at[++n] = t;
  }
  d->places = n;
  double first = d->at[1], rest = 1 - d->at[n], ends = first + rest;
  d->at[n + 1] = 1;
  for (size_t i = 0; i <= n; i++) d->data[i] = 1;
  d->data[0] = closed && ends > 0 ? first / ends : 0.5;
  d->data[n] = closed && ends > 0 ? rest / ends : 0.5;
  /* Ends without length are no cells. */
  d->cells = n + 1;
  if (!(first > 0)) {
    memmove(d->at, d->at + 1, (n + 1) * sizeof *d->at);
    memmove(d->data, d->data + 1, n * sizeof *d->data);
    d->cells--;
  }
  if (!(rest > 0)) d->cells--;
  double total = 0;
  for (size_t i = 0; i < d->cells; i++) total += d->data[i];
  for (size_t i = 0; i < d->cells; i++) d->data[i] /= total;
}

static void measure_floor(const contour_data *data, contour_density *d) {
  double mean[2] = {0, 0}, total = 0, squares = 0;
  for (size_t i = 0; i < data->count; i++) {
    for (size_t k = 0; k < 2; k++) mean[k] += weight_of(data, i) * data->points[2 * i + k];
    total += weight_of(data, i);
  }
  for (size_t i = 0; i < data->count; i++)
    for (size_t k = 0; k < 2; k++) {
      double e = data->points[2 * i + k] - mean[k] / total;
      squares += weight_of(data, i) * e * e;
    }
  d->floor = FLOOR * sqrt(squares / total);
}

/* What neighbours deviate alike by is no structure either. */
static batten_status raise_floor(batten_context *ctx, const contour_data *data, const double *parameters, bool closed,
                                 contour_density *d) {
  contour_deviations deviations;
  batten_status st = contour_deviations_find(ctx, data, parameters, closed, &deviations);
  if (st >= 0) d->floor = fmax(d->floor, deviations.correlated);
  return st;
}

/* ---- the pilot ----------------------------------------------------------------------------------- */

/* Fits pilots of 4, 8, ... spans until they leave nothing but noise and the criterion rises. */
static batten_status find_pilot(batten_context *ctx, const contour_data *data, const double *parameters,
                                unsigned degree, bool closed, contour_density *d) {
  unsigned pilot_degree = degree < 3 ? degree : 3;
  size_t limit = d->places / 3, worse = 0;
  double best = INFINITY, *breaks = NULL;
  batten_status st = BATTEN_OK;
  if (limit < 4) limit = 4;
  breaks = batten_alloc_array(ctx, limit + 1, sizeof *breaks);
  if (!breaks) return BATTEN_E_NOMEM;
  contour_density_blend(d, 1);
  for (size_t spans = 4; spans <= limit; spans *= 2) {
    contour_least f = {0};
    contour_left left;
    size_t cell = 0;
    st = batten_progress(ctx, "knots", 0);
    if (st < 0) break;
    for (size_t i = 0; i <= spans; i++)
      breaks[i] = i == 0 ? 0 : i == spans ? 1 : contour_density_place(d, (double)i / (double)spans, &cell);
    st = contour_least_fit(ctx, data, parameters, pilot_degree, pilot_degree - 1, closed, spans, breaks, &f);
    if (st == BATTEN_E_SINGULAR) { /* too many already */
      st = batten_expect(ctx, st, BATTEN_E_SINGULAR);
      break;
    }
    if (st < 0) break;
    contour_left_of(&f.space.b, f.control, data, parameters, &left);
    double value = contour_schwarz(d->places, left.rms, d->floor, f.space.unknowns / 2);
    bool better = value < best;
    worse = better ? 0 : worse + 1;
    if (better) {
      contour_least_free(ctx, &d->pilot);
      d->pilot = f;
      best = value;
    } else {
      contour_least_free(ctx, &f);
    }
    bool noise = left.rms <= (1 + 2 / sqrt((double)d->places)) * left.noise + d->floor;
    if (worse >= 2 && noise) break;
  }
  batten_free(ctx, breaks);
  return st;
}

/* The derivative of highest degree of the pilot in its span mu. */
static void top_derivative(const contour_least *f, size_t mu, double out[2]) {
  const bspline *b = &f->space.b;
  double row[BSPLINE_ORDER];
  bspline_rows(b, mu, b->degree, b->knots[mu], b->knots[mu + 1], row);
  out[0] = out[1] = 0;
  for (size_t j = 0; j <= b->degree; j++)
    for (size_t k = 0; k < 2; k++) out[k] += row[j] * f->control[2 * (mu - b->degree + j) + k];
}

/* What the jump between spans mu and next tells of the derivative beyond the highest. */
static double jump_at(const contour_least *f, size_t mu, size_t next, double width) {
  double a[2], c[2];
  top_derivative(f, mu, a);
  top_derivative(f, next, c);
  return 2 * hypot(c[0] - a[0], c[1] - a[1]) / width;
}

/* Density of breaks that span i of the pilot (spans are d + i, as its knots are simple) needs. */
static double span_need(const contour_least *f, bool closed, size_t i) {
  const double *u = f->space.knots;
  size_t d = f->space.b.degree, n = f->spans, sides = 0;
  double sum = 0, width = u[d + i + 1] - u[d + i];
  if (i > 0 || closed) {
    size_t before = i > 0 ? i - 1 : n - 1;
    sum += jump_at(f, d + before, d + i, width + u[d + before + 1] - u[d + before]);
    sides++;
  }
  if (i + 1 < n || closed) {
    size_t after = i + 1 < n ? i + 1 : 0;
    sum += jump_at(f, d + i, d + after, width + u[d + after + 1] - u[d + after]);
    sides++;
  }
  return pow(sum / (double)sides, 1.0 / (double)(d + 1));
}

/* Need per cell from densities [pilot.spans]. */
static void spread_need(contour_density *d, const double *densities) {
  const contour_least *f = &d->pilot;
  const double *breaks = f->space.knots + f->space.b.degree;
  size_t span = 0;
  double total = 0;
  for (size_t i = 0; i < d->cells; i++) {
    double from = d->at[i], to = d->at[i + 1], need = 0;
    while (span + 1 < f->spans && breaks[span + 1] <= from) span++;
    for (size_t s = span; s < f->spans && breaks[s] < to; s++)
      need += densities[s] * (fmin(to, breaks[s + 1]) - fmax(from, breaks[s]));
    d->need[i] = need;
    total += need;
  }
  double sum = 0;
  for (size_t i = 0; i < d->cells; i++) {
    d->need[i] = fmin(d->need[i] / total, NEED_MOST * d->data[i]);
    sum += d->need[i];
  }
  for (size_t i = 0; i < d->cells; i++) d->need[i] /= sum;
}

static batten_status find_need(batten_context *ctx, bool closed, contour_density *d) {
  const contour_least *f = &d->pilot;
  double *densities = batten_alloc_array(ctx, f->spans, sizeof *densities), mean = 0;
  if (!densities) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < f->spans; i++) {
    densities[i] = span_need(f, closed, i);
    mean += densities[i] * (f->space.knots[f->space.b.degree + i + 1] - f->space.knots[f->space.b.degree + i]);
  }
  for (size_t i = 0; i < f->spans; i++) densities[i] = mean > 0 ? fmax(densities[i], NEED_LEAST * mean) : 1;
  spread_need(d, densities);
  batten_free(ctx, densities);
  return BATTEN_OK;
}

/* ---- the density --------------------------------------------------------------------------------- */

void contour_density_free(batten_context *ctx, contour_density *d) {
  contour_least_free(ctx, &d->pilot);
  batten_free(ctx, d->sum);
  batten_free(ctx, d->need);
  batten_free(ctx, d->data);
  batten_free(ctx, d->at);
  *d = (contour_density){0};
}

batten_status contour_density_make(batten_context *ctx, const contour_data *data, const double *parameters,
                                   unsigned degree, bool closed, contour_density *out) {
  contour_density d = {0};
  size_t room = data->count + 2;
  d.at = batten_alloc_array(ctx, room, sizeof *d.at);
  d.data = batten_alloc_array(ctx, room, sizeof *d.data);
  d.need = batten_alloc_array(ctx, room, sizeof *d.need);
  d.sum = batten_alloc_array(ctx, room, sizeof *d.sum);
  batten_status st = d.at && d.data && d.need && d.sum ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  make_cells(data, parameters, closed, &d);
  measure_floor(data, &d);
  st = raise_floor(ctx, data, parameters, closed, &d);
  if (st < 0) goto done;
  memcpy(d.need, d.data, d.cells * sizeof *d.need);
  st = find_pilot(ctx, data, parameters, degree, closed, &d);
  if (st >= 0 && d.pilot.spans > 0) st = find_need(ctx, closed, &d);
  if (st < 0) goto done;
  *out = d;
  d = (contour_density){0};
done:
  contour_density_free(ctx, &d);
  return st;
}

/* What a cell gets over its data's part, before what the cap takes from others is shared. */
static double capped(const contour_density *d, size_t i, double most) {
  return fmin(1 - NEED_PART + NEED_PART * d->need[i] / d->data[i], most);
}

void contour_density_blend(contour_density *d, double most) {
  double given = 0, sum = 0;
  for (size_t i = 0; i < d->cells; i++) given += d->data[i] * capped(d, i, most);
  double part = most > given ? (1 - given) / (most - given) : 0; /* of the room that is left below the cap */
  for (size_t i = 0; i < d->cells; i++) {
    double cell = capped(d, i, most);
    d->sum[i] = sum;
    sum += d->data[i] * (cell + part * (most - cell));
  }
  for (size_t i = 0; i < d->cells; i++) d->sum[i] /= sum;
  d->sum[d->cells] = 1;
}

double contour_density_sum(const contour_density *d, double t) {
  size_t low = 0, high = d->cells;
  while (high - low > 1) {
    size_t middle = low + (high - low) / 2;
    if (t < d->at[middle])
      high = middle;
    else
      low = middle;
  }
  double part = (t - d->at[low]) / (d->at[low + 1] - d->at[low]);
  return (1 - part) * d->sum[low] + part * d->sum[low + 1];
}

double contour_density_place(const contour_density *d, double sum, size_t *cell) {
  size_t i = *cell;
  while (i + 1 < d->cells && d->sum[i + 1] < sum) i++;
  *cell = i;
  double part = (sum - d->sum[i]) / (d->sum[i + 1] - d->sum[i]);
  part = fmin(fmax(part, 0), 1);
  return (1 - part) * d->at[i] + part * d->at[i + 1];
}

double contour_pilot_turn(const contour_least *pilot, double from, double to) {
  const bspline *b = &pilot->space.b;
  double turn = 0, last[2] = {0, 0}, table[2 * BSPLINE_ORDER];
  for (size_t mu = bspline_first(b); mu < b->count; mu = bspline_next(b, mu)) {
    double lower = fmax(b->knots[mu], from), upper = fmin(b->knots[mu + 1], to);
    if (!(lower < upper)) continue;
    for (int i = 0; i <= TURN_SAMPLES; i++) {
      double t = lower + (upper - lower) * i / TURN_SAMPLES, v[2] = {0, 0};
      bspline_basis(b, mu, t, 1, table);
      for (size_t j = 0; j <= b->degree; j++)
        for (size_t k = 0; k < 2; k++)
          v[k] += table[b->degree + 1 + j] * pilot->control[2 * (mu - b->degree + j) + k];
      if (v[0] == 0 && v[1] == 0) continue;
      if (last[0] != 0 || last[1] != 0) turn += atan2(contour_cross(last, v), last[0] * v[0] + last[1] * v[1]);
      memcpy(last, v, sizeof last);
    }
  }
  return turn;
}
