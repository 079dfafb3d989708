/* Inequalities around a reference curve: kernel/contour/wedges.c and rows.c. */
#include "contour_curves.h"

static const contour_row_options OPTIONS = {.gap = 0.1, .depth_max = 12, .margin = 1e-3, .row_limit = 2000000};

/* A random point of the space, as far from the reference as the rows allow times `part`. */
static void wander(const contour_space *space, const contour_rows *rows, const double *reference, double part,
                   uint64_t *state, double *direction, double *out) {
  size_t n = 2 * space->b.count;
  double *y = contour_test_memory(space->unknowns, sizeof *y), step = INFINITY;
  for (size_t j = 0; j < space->unknowns; j++) y[j] = t_uniform(state) - 0.5;
  for (size_t i = 0; i < n; i++) {
    direction[i] = 0;
    for (size_t at = space->starts[i]; at < space->starts[i + 1]; at++)
      direction[i] += space->values[at] * y[space->indices[at]];
  }
  for (size_t i = 0; i < rows->matrix.rows; i++) {
    double rate = contour_test_row(&rows->matrix, i, direction),
           spare = contour_test_row(&rows->matrix, i, reference) - rows->lower[i];
    if (rate < 0) step = fmin(step, -spare / rate);
  }
  if (!(step < 10)) step = 10;
  for (size_t i = 0; i < n; i++) out[i] = reference[i] + part * step * direction[i];
  free(y);
}

static void check(batten_context *ctx, const contour_curve_rule *r) {
  contour_test_curve c = contour_test_curve_make(r);
  char what[128];
  snprintf(what, sizeof what, "degree %u, C%u%s, %zu runs of %zu spans, seed %d", r->degree, r->smoothness,
           r->closed ? ", closed" : "", r->runs, r->spans_per_run, (int)r->seed);
  double bend = contour_test_curvature(&c, c.control, 16);
  T_CHECK(bend > 0, "%s: the reference bends as it should (%.2g)", what, bend);
  bool accepted = false;
  contour_rows rows;
  contour_space space;
  T_OK(contour_space_make(ctx, &c.shape, r->degree, true, NULL, &space), ctx);
  T_OK(contour_rows_make(ctx, &c.shape, &c.b, c.control, &OPTIONS, NULL, &accepted, &rows), ctx);
  if (!T_CHECK(accepted, "%s: accepted", what)) return;
  size_t n = 2 * c.b.count;
  double *direction = contour_test_memory(n, 8), *x = contour_test_memory(n, 8), *y = contour_test_memory(n, 8);
  contour_rows whole = contour_test_full(&c, &rows, c.control, OPTIONS.margin);
  printf("# %zu pieces, %zu rows of %zu, %u bisections, least slack %.2g\n", rows.wedge_count, rows.matrix.rows,
         whole.matrix.rows, rows.depth, contour_test_slack(&rows, c.control));
  T_CHECK(contour_test_slack(&rows, c.control) > 0 && rows.matrix.rows <= 2 * r->degree * rows.wedge_count,
          "the reference satisfies %zu rows strictly", rows.matrix.rows);
  double length = 0;
  for (size_t i = 0; i < rows.matrix.rows; i++) {
    double sum = 0;
    for (size_t at = rows.matrix.starts[i]; at < rows.matrix.starts[i + 1]; at++)
      sum += rows.matrix.values[at] * rows.matrix.values[at];
    length = fmax(length, fabs(sum - 1));
  }
  T_RATIO(length, 1e-14, "rows have length 1");
  /* what satisfies the rows satisfies the whole set, and bends as it should */
  uint64_t state = r->seed + 3;
  double implied = INFINITY, worst = INFINITY;
  for (int trial = 0; trial < 200; trial++) {
    wander(&space, &rows, c.control, 1 - 1e-12, &state, direction, x);
    implied = fmin(implied, contour_test_least(&whole, x));
    worst = fmin(worst, contour_test_curvature(&c, x, 8));
    /* between two of them, and out again from there */
    for (size_t i = 0; i < n; i++) y[i] = 0.5 * (x[i] + (trial % 10 ? y[i] : c.control[i]));
    wander(&space, &rows, y, 1 - 1e-12, &state, direction, x);
    implied = fmin(implied, contour_test_least(&whole, x));
    worst = fmin(worst, contour_test_curvature(&c, x, 8));
  }
  T_RATIO(-implied, 1e-13, "400 points at the border of the rows satisfy all %zu inequalities of the Lemma",
          whole.matrix.rows);
  T_CHECK(worst > 0, "and bend as they should: least sine %.2g", worst);
  free(direction);
  free(x);
  free(y);
  contour_test_full_free(&whole);
  contour_rows_free(ctx, &rows);
  contour_space_free(ctx, &space);
  contour_test_curve_free(&c);
}

/* One parabola: control points (0, 0), (1, 0), (2, 1). x' = (2, 0), (2, 2), x'' = (0, 2): directions 0, 45 and 90
 * degrees. v has four fifths of the 45 degrees between them, 81; u as much of the 90 degrees below 0, -72. */
static void by_hand(batten_context *ctx) {
  const double breaks[2] = {0, 1}, knots[6] = {0, 0, 0, 1, 1, 1}, control[6] = {0, 0, 1, 0, 2, 1}, pi = acos(-1);
  const signed char sign = 1;
  const contour_shape shape = {2, 1, false, 1, breaks, &sign};
  const bspline b = {2, 3, knots};
  bool accepted = false;
  contour_rows r;
  T_OK(contour_rows_make(ctx, &shape, &b, control, &OPTIONS, NULL, &accepted, &r), ctx);
  double u[2] = {cos(-0.4 * pi), sin(-0.4 * pi)}, v[2] = {cos(0.45 * pi), sin(0.45 * pi)};
  const double expected[4] = {-u[1] / sqrt(2), u[0] / sqrt(6), v[0] / sqrt(6), (v[1] - v[0]) / sqrt(2)};
  T_CHECK(accepted && r.matrix.rows == 4 && r.wedge_count == 1 && r.depth == 0, "a parabola: four rows");
  double worst = 0, worst_lower = 0;
  for (size_t i = 0; i < 4; i++) {
    worst = fmax(worst, fabs(contour_test_row(&r.matrix, i, control) - expected[i]));
    worst_lower = fmax(worst_lower, fabs(r.lower[i] - 1e-3 * expected[i]));
  }
  T_RATIO(worst, 4e-16, "their values by hand");
  T_RATIO(worst_lower, 4e-19, "their right sides");
  contour_rows_free(ctx, &r);
}

static contour_rows make(batten_context *ctx, const contour_test_curve *c, const contour_row_options *opt,
                         const contour_rows *old, bool *accepted) {
  contour_rows r = {.depth = 77};
  T_OK(contour_rows_make(ctx, &c->shape, &c->b, c->control, opt, old, accepted, &r), ctx);
  return r;
}

/* Largest relative difference of right sides. */
static double differ(const contour_rows *a, const contour_rows *b) {
  double worst = a->matrix.rows == b->matrix.rows ? 0 : INFINITY;
  for (size_t i = 0; i < a->matrix.rows && worst < INFINITY; i++)
    worst = fmax(worst, fabs(a->lower[i] - b->lower[i]) / a->lower[i]);
  return worst;
}

/* A quarter turn and a reflection change no right side beyond rounding; the way back has as
 * many rows. */
static void invariance(batten_context *ctx, const contour_curve_rule *rule) {
  contour_test_curve c = contour_test_curve_make(rule);
  bool accepted = false;
  contour_rows a = make(ctx, &c, &OPTIONS, NULL, &accepted);
  size_t n = c.b.count, spans = c.shape.spans;
  for (size_t i = 0; i < n; i++) {
    double x = c.control[2 * i];
    c.control[2 * i] = -c.control[2 * i + 1];
    c.control[2 * i + 1] = x;
  }
  contour_rows b = make(ctx, &c, &OPTIONS, NULL, &accepted);
  T_RATIO(differ(&a, &b), 1e-12, "degree %u, C%u: a quarter turn changes %zu right sides by", rule->degree,
          rule->smoothness, a.matrix.rows);
  contour_rows_free(ctx, &b);
  for (size_t i = 0; i < n; i++) c.control[2 * i] = -c.control[2 * i];
  for (size_t i = 0; i < spans; i++) c.signs[i] = (signed char)-c.signs[i];
  b = make(ctx, &c, &OPTIONS, NULL, &accepted);
  T_RATIO(differ(&a, &b), 1e-12, "a reflection");
  contour_rows_free(ctx, &a);
  a = b;
  for (size_t i = 0; i < n / 2; i++)
    for (size_t k = 0; k < 2; k++) {
      double x = c.control[2 * i + k];
      c.control[2 * i + k] = c.control[2 * (n - 1 - i) + k];
      c.control[2 * (n - 1 - i) + k] = x;
    }
  for (size_t i = 0; i < spans / 2; i++) {
    signed char sign = c.signs[i];
    c.signs[i] = c.signs[spans - 1 - i];
    c.signs[spans - 1 - i] = sign;
  }
  for (size_t i = 0; i < spans; i++) c.signs[i] = (signed char)-c.signs[i];
  for (size_t i = 0; i <= spans / 2; i++) {
    double low = c.breaks[i];
    c.breaks[i] = 1 - c.breaks[spans - i];
    c.breaks[spans - i] = 1 - low;
  }
  bspline_make_knots(rule->degree, rule->smoothness, spans, c.breaks + 1, 0, 1, c.knots);
  b = make(ctx, &c, &OPTIONS, NULL, &accepted);
  double worst = accepted && a.wedge_count == b.wedge_count ? 0 : INFINITY;
  for (size_t q = 0; q < a.wedge_count && worst < INFINITY; q++) {
    const contour_wedge *w = &a.wedges[q], *z = &b.wedges[a.wedge_count - 1 - q];
    for (int k = 0; k < 2; k++) worst = fmax(worst, fmax(fabs(w->u[k] + z->v[k]), fabs(w->v[k] + z->u[k])));
  }
  T_RATIO(worst, 1e-9, "the way back: the same directions, u and v change places");
  T_CHECK(a.matrix.rows == b.matrix.rows, "%zu rows of %zu", b.matrix.rows, a.matrix.rows);
  contour_rows_free(ctx, &b);
  contour_rows_free(ctx, &a);
  contour_test_curve_free(&c);
}

/* References that hardly bend: what is needed is relative. */
static void nearly_straight(batten_context *ctx, double flat) {
  contour_test_curve c = contour_test_curve_make(&(contour_curve_rule){3, 2, false, 3, 4, 1.5, 5});
  for (size_t i = 0; i < c.b.count; i++) c.control[2 * i + 1] *= flat;
  bool accepted = false;
  contour_rows r = make(ctx, &c, &OPTIONS, NULL, &accepted);
  if (T_CHECK(accepted, "flattened to %g of its height: accepted", flat)) {
    contour_rows full = contour_test_full(&c, &r, c.control, OPTIONS.margin);
    T_CHECK(contour_test_slack(&r, c.control) > 0 && contour_test_least(&full, c.control) > 0,
            "%zu rows, %u bisections, spare %.2g", r.matrix.rows, r.depth, contour_test_slack(&r, c.control));
    contour_test_full_free(&full);
    contour_rows_free(ctx, &r);
  }
  contour_test_curve_free(&c);
}

/* A span whose gap is between what two askers want: the second one gets the piece of the first. */
static void old_pieces(batten_context *ctx) {
  const contour_row_options easy = {.gap = 0.02, .margin = 1e-3, .row_limit = 1000},
                            hard = {.gap = 0.4, .margin = 1e-3, .row_limit = 1000};
  contour_test_curve c;
  bool by_easy = false, by_hard = true;
  for (double turn = 0.5; turn < 6 && (!by_easy || by_hard); turn += 0.05) {
    c = contour_test_curve_make(&(contour_curve_rule){4, 2, false, 1, 1, turn, 3});
    batten_status st = contour_rows_make(ctx, &c.shape, &c.b, c.control, &easy, NULL, &by_easy, NULL);
    if (st >= 0) st = contour_rows_make(ctx, &c.shape, &c.b, c.control, &hard, NULL, &by_hard, NULL);
    if (st < 0) T_OK(st, ctx);
    if (!by_easy || by_hard) contour_test_curve_free(&c);
  }
  if (!T_CHECK(by_easy && !by_hard, "a span that is between")) return;
  contour_rows old = make(ctx, &c, &easy, NULL, &by_easy), r = make(ctx, &c, &hard, &old, &by_hard);
  T_CHECK(by_hard && differ(&old, &r) == 0, "old pieces stay where bisection fails");
  contour_rows_free(ctx, &r);
  /* those that the reference does not satisfy are none */
  old.wedges[0].v[0] = -old.wedges[0].v[0];
  old.wedges[0].v[1] = -old.wedges[0].v[1];
  r = make(ctx, &c, &hard, &old, &by_hard);
  T_CHECK(!by_hard && r.depth == 77, "but not those that the reference leaves");
  contour_rows_free(ctx, &old);
  contour_test_curve_free(&c);
}

static void refused(batten_context *ctx) {
  contour_test_curve c = contour_test_curve_make(&(contour_curve_rule){4, 2, false, 2, 2, 4.5, 3});
  contour_row_options opt = OPTIONS;
  bool accepted = false;
  contour_rows fine = make(ctx, &c, &opt, NULL, &accepted), r;
  T_CHECK(accepted && fine.depth > 0, "spans that turn much: %u bisections", fine.depth);
  /* no deeper than that: the same; not as deep: not accepted */
  opt.depth_max = 0;
  r = make(ctx, &c, &opt, NULL, &accepted);
  T_CHECK(!accepted && r.depth == 77, "without bisection: not accepted, nothing written");
  T_OK(contour_rows_make(ctx, &c.shape, &c.b, c.control, &opt, NULL, &accepted, NULL), ctx);
  T_CHECK(!accepted, "and the question alone has the same answer");
  opt = OPTIONS;
  opt.row_limit = 2;
  T_STATUS(contour_rows_make(ctx, &c.shape, &c.b, c.control, &opt, NULL, &accepted, &r), BATTEN_E_TOO_LARGE, ctx,
           "row_limit: 2 inequalities are not enough; raise it, or lower depth_max");
  opt.row_limit = fine.matrix.rows - 1;
  T_STATUS(contour_rows_make(ctx, &c.shape, &c.b, c.control, &opt, NULL, &accepted, &r), BATTEN_E_TOO_LARGE, ctx,
           "raise it, or lower depth_max");
  opt.row_limit = fine.matrix.rows;
  contour_rows_free(ctx, &fine);
  fine = make(ctx, &c, &opt, NULL, &accepted);
  T_CHECK(accepted, "as many as are needed are enough");
  contour_rows_free(ctx, &fine);
  /* what bends the other way, or not at all */
  opt = OPTIONS;
  c.signs[0] = (signed char)-c.signs[0];
  r = make(ctx, &c, &opt, NULL, &accepted);
  T_CHECK(!accepted, "the other sign in one span is refused");
  c.signs[0] = (signed char)-c.signs[0];
  for (size_t i = 0; i < c.b.count; i++) {
    double part = (double)i / (double)c.b.count;
    c.control[2 * i] = 0.3 * part;
    c.control[2 * i + 1] = 0.7 * part;
  }
  r = make(ctx, &c, &opt, NULL, &accepted);
  T_CHECK(!accepted, "a straight line is refused");
  memset(c.control, 0, 2 * c.b.count * sizeof *c.control);
  r = make(ctx, &c, &opt, NULL, &accepted);
  T_CHECK(!accepted, "a point is refused");
  contour_test_curve_free(&c);
}

static batten_status make_once(batten_context *ctx, void *arg) {
  const contour_test_curve *c = arg;
  bool accepted = false;
  contour_rows r = {.depth = 0};
  batten_status st = contour_rows_make(ctx, &c->shape, &c->b, c->control, &OPTIONS, NULL, &accepted, &r);
  if (st >= 0) contour_rows_free(ctx, &r);
  return st;
}

static void large(batten_context *ctx) {
  contour_test_curve c = contour_test_curve_make(&(contour_curve_rule){3, 2, false, 4, 500, 2.0, 1});
  bool accepted = false;
  double time = batten_now();
  contour_rows r = make(ctx, &c, &OPTIONS, NULL, &accepted);
  time = batten_now() - time;
  T_CHECK(accepted && contour_test_slack(&r, c.control) > 0, "%zu spans: %zu rows of %zu pieces in %.3g ms",
          c.shape.spans, r.matrix.rows, r.wedge_count, 1e3 * time);
  contour_rows_free(ctx, &r);
  t_fail_every_allocation("rows of 2,000 spans", make_once, &c);
  contour_test_curve_free(&c);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  for (unsigned degree = 2; degree <= 6; degree++)
    for (unsigned l = 1; l <= 2 && l < degree; l++) {
      check(ctx, &(contour_curve_rule){degree, l, false, 1, 1, 1.0, 1});
      check(ctx, &(contour_curve_rule){degree, l, false, 3, 3, 2.0, degree});
      check(ctx, &(contour_curve_rule){degree, l, false, 2, 6, 5.0, degree + 10});
      check(ctx, &(contour_curve_rule){degree, l, true, 1, 7, 0, degree + 20});
      check(ctx, &(contour_curve_rule){degree, l, true, 4, 10, 0, degree + 30});
    }
  by_hand(ctx);
  invariance(ctx, &(contour_curve_rule){3, 2, false, 3, 4, 2.0, 2});
  invariance(ctx, &(contour_curve_rule){4, 1, false, 2, 3, 3.0, 4});
  for (int k = 1; k <= 7; k += 2) nearly_straight(ctx, pow(10, -k));
  old_pieces(ctx);
  refused(ctx);
  large(ctx);
  batten_context_free(ctx);
  return t_done();
}
