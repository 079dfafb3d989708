/* The smoothing spline, and the noise that it tells.
 *
 * The penalty is the integral of the third derivative squared: it is 0 for parabolas, so that curvature is not drawn
 * towards 0 where data are few and at the ends, as that of the second derivative would do. The degree 5 then gives
 * the natural smoothing spline but for the equal spans, which are made short enough to follow what the data tell:
 * from a middle number they are halved or doubled until they are a few times shorter than the bandwidth. Much shorter
 * ones would cost digits: the condition is about (bandwidth / span)^6.
 *
 * lambda minimizes -2 log of the restricted likelihood [Wood: Generalized additive models], of two coordinates:
 *   (2 n - 2 q) log J + 2 log det(gram + lambda penalty) - 2 (functions - q) log lambda,   J the least sum,
 * q = 3 (closed: 1) functions without penalty. Generalized cross-validation would too often take too small a lambda,
 * and so give wiggles. */
#include "smooth.h"

#include <string.h>

#include "base/checked.h"
#include "deviations.h"
#include "sparse/band.h"

/* The weight of |x''|^2 beside |x'''|^2: makes the sum definite where points have only two parameters. */
static const double BENDING = 1e-6;
/* The bandwidth is between these multiples of a span when spans are as they should be, and looked for in .. */
static const double SHORT = 3, LONG = 9;
static const double SHORTEST = 0.25, LONGEST = 24;
/* The noise that is left lies between these multiples of what neighbours tell of it. */
static const double LOOSE = 2.4, TIGHT = 0.85;
/* The bandwidth becomes shorter by such steps of log 2, until it does. */
static const double FINER = 0.5;
enum { SPANS_MIN = 16, SPANS_FIRST = 128, SPANS_MAX = 2048, STEPS = 14 };

/* Of uniform B-splines of a degree the values on the span where they are not 0, by their recursion. */
static void uniform_basis(unsigned degree, double u, double *values) {
  values[0] = 1;
  for (unsigned d = 1; d <= degree; d++) {
    values[d] = 0;
    for (unsigned k = d + 1; k-- > 0;) {
      double before = k > 0 ? (u + d - k) * values[k - 1] : 0;
      values[k] = (before + (1 - u + k) * values[k]) / d;
    }
  }
}

void contour_smooth_basis(const contour_smooth *s, double u, unsigned order, double values[SMOOTH_ORDER]) {
  memset(values, 0, SMOOTH_ORDER * sizeof *values);
  uniform_basis(SMOOTH_DEGREE - order, u, values);
  for (unsigned r = 0; r < order; r++)
    for (size_t k = SMOOTH_ORDER; k-- > 0;) values[k] = ((k > 0 ? values[k - 1] : 0) - values[k]) * (double)s->spans;
}

void contour_smooth_jet(const contour_smooth *s, const double *control, double t, double jet[3][2]) {
  double u, values[SMOOTH_ORDER];
  size_t span = contour_smooth_span(s, t, &u);
  for (unsigned r = 0; r < 3; r++) {
    contour_smooth_basis(s, u, r, values);
    jet[r][0] = jet[r][1] = 0;
    for (size_t k = 0; k < SMOOTH_ORDER; k++) {
      size_t row = contour_smooth_row(s, span + k);
      jet[r][0] += values[k] * control[row];
      jet[r][1] += values[k] * control[s->functions + row];
    }
  }
}

/* Entry (i, j) of a band. */
static double *entry(const contour_smooth *s, double *band, size_t i, size_t j) {
  return i >= j ? &band[j * (s->width + 1) + i - j] : &band[i * (s->width + 1) + j - i];
}

/* band += weight values values' at a span. */
static void add_square(const contour_smooth *s, double *band, size_t span, double weight, const double *values) {
  size_t rows[SMOOTH_ORDER];
  for (size_t k = 0; k < SMOOTH_ORDER; k++) rows[k] = contour_smooth_row(s, span + k);
  for (size_t i = 0; i < SMOOTH_ORDER; i++)
    for (size_t j = 0; j <= i; j++) *entry(s, band, rows[i], rows[j]) += weight * values[i] * values[j];
}

double contour_smooth_variance(const contour_smooth *s, double t) {
  double u, values[SMOOTH_ORDER], variance = 0;
  size_t span = contour_smooth_span(s, t, &u);
  contour_smooth_basis(s, u, 2, values);
  for (size_t i = 0; i < SMOOTH_ORDER; i++)
    for (size_t j = 0; j < SMOOTH_ORDER; j++)
      variance += values[i] * values[j] *
                  *entry(s, s->inverse, contour_smooth_row(s, span + i), contour_smooth_row(s, span + j));
  return fmax(variance, 0);
}

/* c' band c */
static double form(const contour_smooth *s, const double *band, const double *c) {
  double sum = 0;
  for (size_t j = 0; j < s->functions; j++) {
    const double *column = band + j * (s->width + 1);
    double below = 0;
    for (size_t i = 1; i <= s->width && i + j < s->functions; i++) below += column[i] * c[i + j];
    sum += c[j] * (column[0] * c[j] + 2 * below);
  }
  return sum;
}

static double dot(size_t n, const double *a, const double *b) {
  double sum = 0;
  for (size_t i = 0; i < n; i++) sum += a[i] * b[i];
  return sum;
}

double contour_smooth_cost(const contour_smooth *s, double lambda, const double *control, double *squares) {
  const size_t n = s->functions;
  double sum = s->square - 2 * dot(2 * n, s->right, control), rough = 0;
  for (size_t k = 0; k < 2; k++) {
    sum += form(s, s->gram, control + k * n);
    rough += form(s, s->penalty, control + k * n);
  }
  if (squares) *squares = sum;
  return sum + lambda * rough;
}

static void fill_penalty(contour_smooth *s) {
  /* Gauss: exact for the products, of degree 6. */
  static const double places[4] = {-0.861136311594052575, -0.339981043584856265, 0.339981043584856265,
                                   0.861136311594052575};
  static const double weights[4] = {0.347854845137453857, 0.652145154862546143, 0.652145154862546143,
                                    0.347854845137453857};
  double values[SMOOTH_ORDER], h = 1 / (double)s->spans;
  for (size_t span = 0; span < s->spans; span++)
    for (int g = 0; g < 4; g++)
      for (unsigned order = 2; order <= 3; order++) {
        contour_smooth_basis(s, 0.5 * (1 + places[g]), order, values);
        add_square(s, s->penalty, span, 0.5 * h * weights[g] * (order == 2 ? BENDING : 1), values);
      }
}

static void fill_gram(contour_smooth *s, const contour_data *data, const double *parameters) {
  double total = 0, values[SMOOTH_ORDER];
  s->count = 0;
  for (size_t i = 0; i < data->count; i++) {
    double w = data->weights ? data->weights[i] : 1;
    total += w;
    s->count += w > 0;
  }
  s->square = 0;
  double box[2][2] = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
  for (size_t i = 0; i < data->count; i++) {
    double u, w = (data->weights ? data->weights[i] : 1) * (s->count / total);
    if (!(w > 0)) continue;
    const double *p = data->points + 2 * i;
    size_t span = contour_smooth_span(s, parameters[i], &u);
    contour_smooth_basis(s, u, 0, values);
    add_square(s, s->gram, span, w, values);
    for (size_t k = 0; k < SMOOTH_ORDER; k++) {
      size_t row = contour_smooth_row(s, span + k);
      for (size_t d = 0; d < 2; d++) s->right[d * s->functions + row] += w * values[k] * p[d];
    }
    s->square += w * (p[0] * p[0] + p[1] * p[1]);
    for (size_t d = 0; d < 2; d++) {
      box[0][d] = fmin(box[0][d], p[d]);
      box[1][d] = fmax(box[1][d], p[d]);
    }
  }
  s->size = fmax(box[1][0] - box[0][0], box[1][1] - box[0][1]);
}

static double free_functions(const contour_smooth *s) { return s->closed ? 1 : 3; }

/* Solves for a bandwidth; returns -2 log likelihood, INFINITY where rounding keeps it from a factor. */
static double solve(contour_smooth *s, double bandwidth) {
  const size_t n = s->functions, ld = s->width + 1;
  s->bandwidth = bandwidth;
  s->lambda = s->count * pow(bandwidth, 6);
  for (size_t i = 0; i < n * ld; i++) s->factor[i] = s->gram[i] + s->lambda * s->penalty[i];
  if (sparse_band_cholesky(n, s->width, s->factor)) return INFINITY;
  double determinant = 0;
  for (size_t j = 0; j < n; j++) determinant -= 2 * log(s->factor[j * ld]);
  memcpy(s->control, s->right, 2 * n * sizeof *s->control);
  for (size_t k = 0; k < 2; k++) {
    sparse_band_forward(n, s->width, s->factor, s->control + k * n);
    sparse_band_backward(n, s->width, s->factor, s->control + k * n);
  }
  double exact = CONTOUR_EXACT * s->size;
  double least = fmax(contour_smooth_cost(s, s->lambda, s->control, NULL), 0) + 2 * s->count * exact * exact;
  double freedom = fmax(s->count - free_functions(s), 1);
  return 2 * freedom * log(least) + 2 * determinant - 2 * ((double)n - free_functions(s)) * log(s->lambda);
}

/* The inverse within the band, from the last column back: Z = L^-T L^-1 satisfies L' Z = L^-1, which is 0 above the
 * diagonal.   [Takahashi, Fagan, Chin 1973] */
static void invert(contour_smooth *s) {
  const size_t n = s->functions, w = s->width;
  for (size_t j = n; j-- > 0;) {
    const double *l = s->factor + j * (w + 1); /* l[0] is the inverse of the diagonal */
    size_t below = n - 1 - j < w ? n - 1 - j : w;
    double *z = s->inverse + j * (w + 1);
    for (size_t i = below; i > 0; i--) {
      double sum = 0;
      for (size_t k = 1; k <= below; k++) sum += l[k] * *entry(s, s->inverse, j + i, j + k);
      z[i] = -sum * l[0];
    }
    double sum = 0;
    for (size_t k = 1; k <= below; k++) sum += l[k] * z[k];
    z[0] = (l[0] - sum) * l[0];
  }
}

/* What the fit leaves of the points across the curve, by the degrees of freedom that it leaves. Along the curve
 * points have hardly a distance where their parameters are estimated from themselves. */
static void find_noise(contour_smooth *s, const contour_data *data, const double *parameters) {
  double used = 0, squares = 0, total = 0;
  for (size_t j = 0; j < s->functions; j++)
    for (size_t i = 0; i <= s->width && i + j < s->functions; i++)
      used += (i ? 2 : 1) * s->gram[j * (s->width + 1) + i] * s->inverse[j * (s->width + 1) + i];
  for (size_t i = 0; i < data->count; i++) total += data->weights ? data->weights[i] : 1;
  for (size_t i = 0; i < data->count; i++) {
    double jet[3][2], w = (data->weights ? data->weights[i] : 1) * (s->count / total);
    if (!(w > 0)) continue;
    contour_smooth_jet(s, s->control, parameters[i], jet);
    double d[2] = {data->points[2 * i] - jet[0][0], data->points[2 * i + 1] - jet[0][1]};
    double speed = hypot(jet[1][0], jet[1][1]), across = speed > 0 ? contour_cross(jet[1], d) / speed : 0;
    squares += w * across * across;
  }
  /* A curve through nearly all points leaves no freedom to tell noise by: then its roughness tells, as likely as
   * the residual where both are. */
  double left = s->count - used;
  if (left < 0.1 * s->count) {
    squares = fmax(squares, 0.5 * contour_smooth_cost(s, s->lambda, s->control, NULL));
    left = fmax(s->count - free_functions(s), 1);
  }
  s->noise = sqrt(squares / left);
}

/* Shorter bandwidths, from log 2 at, until the fit leaves no more than neighbours tell of noise. */
static bool follow_data(contour_smooth *s, const contour_data *data, const double *parameters, double local,
                        double first, double at) {
  const double most = fmax(LOOSE * local, CONTOUR_EXACT * s->size);
  if (!(solve(s, exp2(at)) < INFINITY)) return false;
  for (;;) {
    invert(s);
    find_noise(s, data, parameters);
    if (!(s->noise > most) || at - FINER < first) return true;
    if (!(solve(s, exp2(at - FINER)) < INFINITY)) break;
    at -= FINER;
  }
  /* too short for the numbers: the last one that was not */
  if (!(solve(s, exp2(at)) < INFINITY)) return false;
  invert(s);
  find_noise(s, data, parameters);
  return true;
}

/* The likeliest bandwidth within what these spans can tell, and its solution. One for the whole curve is too long
 * where it bends sharply at a place: then the likelihood takes that place for noise, and neighbours know better. It
 * is no shorter than half of what neighbours deviate alike over, since that is not the curve's. */
static bool choose_bandwidth(contour_smooth *s, const contour_data *data, const double *parameters,
                             const contour_deviations *deviations) {
  double h = 1 / (double)s->spans, logs[STEPS], values[STEPS];
  double first = log2(SHORTEST * h), last = log2(fmin(LONGEST * h, 1));
  size_t best = 0;
  for (size_t i = 0; i < STEPS; i++) {
    logs[i] = first + (last - first) * (double)i / (STEPS - 1);
    values[i] = solve(s, exp2(logs[i]));
    /* <=: of equally likely ones, as exact data have them, the smoothest */
    if (values[i] <= values[best]) best = i;
  }
  double at = logs[best];
  if (best > 0 && best + 1 < STEPS) {
    double left = values[best - 1] - values[best], right = values[best + 1] - values[best];
    if (left + right > 0 && left + right < INFINITY)
      at += 0.5 * (logs[best + 1] - logs[best]) * (left - right) / (left + right);
  }
  if (deviations->correlated > 0) at = fmax(at, fmin(log2(0.5 * (double)deviations->reach / s->count), last));
  double local = deviations->correlated > 0 || isnan(deviations->local) ? INFINITY : deviations->local;
  return follow_data(s, data, parameters, local, first, at);
}

static batten_status level_new(batten_context *ctx, bool closed, size_t spans, contour_smooth *s) {
  *s = (contour_smooth){.closed = closed, .spans = spans};
  s->functions = closed ? spans : spans + SMOOTH_DEGREE;
  s->width = closed ? 2 * SMOOTH_DEGREE : SMOOTH_DEGREE;
  const size_t size = s->functions * (s->width + 1); /* spans are few */
  double **bands[4] = {&s->gram, &s->penalty, &s->factor, &s->inverse};
  for (int i = 0; i < 4; i++)
    if (!(*bands[i] = batten_alloc_array(ctx, size, sizeof(double)))) return BATTEN_E_NOMEM;
  s->right = batten_alloc_array(ctx, s->functions, 2 * sizeof(double));
  s->control = s->right ? batten_alloc_array(ctx, s->functions, 2 * sizeof(double)) : NULL;
  if (!s->control) return BATTEN_E_NOMEM;
  memset(s->gram, 0, size * sizeof(double));
  memset(s->penalty, 0, size * sizeof(double));
  memset(s->right, 0, 2 * s->functions * sizeof(double));
  return BATTEN_OK;
}

void contour_smooth_free(batten_context *ctx, contour_smooth *s) {
  if (!s) return;
  double *blocks[6] = {s->gram, s->penalty, s->factor, s->inverse, s->right, s->control};
  for (int i = 6; i-- > 0;) batten_free(ctx, blocks[i]);
  *s = (contour_smooth){0};
}

batten_status contour_smooth_fit(batten_context *ctx, const contour_data *data, const double *parameters, bool closed,
                                 contour_smooth *out) {
  contour_smooth s = {0};
  contour_deviations deviations;
  batten_status st = contour_deviations_find(ctx, data, parameters, closed, &deviations);
  if (st < 0) return st;
  size_t most = SPANS_MIN, spans;
  int way = 0; /* +1 once spans were doubled, -1 once halved: not back again */
  while (most < SPANS_MAX && most < 2 * data->count) most *= 2;
  spans = most < SPANS_FIRST ? most : SPANS_FIRST;
  for (;;) {
    st = batten_progress(ctx, "inflections", 0);
    if (st >= 0) st = level_new(ctx, closed, spans, &s);
    if (st < 0) {
      contour_smooth_free(ctx, &s);
      return st;
    }
    fill_penalty(&s);
    fill_gram(&s, data, parameters);
    bool solved = choose_bandwidth(&s, data, parameters, &deviations);
    double relative = s.bandwidth * (double)spans;
    bool finer = solved && relative < SHORT && spans < most && way >= 0;
    bool coarser = (!solved || relative > LONG) && spans > SPANS_MIN && way <= 0;
    if (!finer && !coarser) {
      if (solved) break;
      contour_smooth_free(ctx, &s);
      return batten_fail(
          ctx, BATTEN_E_SINGULAR,
          "points: rounding keeps them from being smoothed; give opt.weights, or opt.parameters, whose "
          "sizes, or steps, differ by less");
    }
    spans = finer ? 2 * spans : spans / 2;
    way = finer ? 1 : -1;
    contour_smooth_free(ctx, &s);
  }
  s.fitted = s.noise;
  /* fmax: local may be NaN */
  s.noise = fmax(s.noise, fmax(TIGHT * deviations.local, deviations.correlated));
  *out = s;
  return BATTEN_OK;
}
