/* The handle of lofts and its measures: by hand; patches, the whole surface and sections against one another and
 * against splines of their own; jumps of known size; every bad input. The lofts are made from derivatives by z at
 * contours that are drawn by lot, so that continuity is exact but for rounding. */
#include "tap.h"

#include "basis/gauss8.h"
#include "loft/loft_inner.h"

enum { CONTOURS = 5, POINTS = 200 };

/* ---- scenes -------------------------------------------------------------------------------------- */

typedef struct scene {
  loft_stack stack;
  loft_contour contours[CONTOURS];
  double heights[CONTOURS];
  double points[CONTOURS][2 * POINTS], slopes[CONTOURS][2][2 * POINTS]; /* scaled; derivatives by z */
  loft_slab *slabs;
  loft_net net; /* as loft_make wants it: without unknowns */
  size_t start[CONTOURS];
  double *control;
  batten_curve *curves[CONTOURS]; /* caller's unit */
} scene;

static void draw(uint64_t *seed, size_t count, double *out) {
  for (size_t k = 0; k < count; k++) out[k] = t_uniform(seed) - 0.5;
}

static batten_status draw_space(batten_context *ctx, uint64_t *seed, unsigned degree, unsigned l, bool closed,
                                loft_space *out) {
  double breaks[20] = {0};
  unsigned folds[20];
  size_t spans = 0;
  for (size_t g = 1; g < 16; g++)
    if (t_uniform(seed) < 0.4) breaks[++spans] = (double)g / 16;
  while (spans < degree) {
    breaks[spans + 1] = spans > 0 ? (1 + breaks[spans]) / 2 : 0.5;
    spans++;
  }
  breaks[++spans] = 1;
  for (size_t i = 0; i <= spans; i++) folds[i] = degree - l;
  return loft_space_make(ctx, degree, closed, spans, breaks, folds, out);
}

/* The caller's: a power of two and a shift away. */
static batten_status make_curve(batten_context *ctx, const loft_stack *s, const loft_contour *c, batten_curve **out) {
  size_t knots;
  double *u = NULL, points[2 * POINTS];
  loft_matrix m = {0};
  batten_status st = loft_clamped(ctx, &c->space, &knots, &u, &m);
  if (st < 0) return st;
  loft_matrix_apply(&m, c->points, points);
  for (size_t k = 0; k < 2 * m.rows; k++) points[k] = points[k] / s->unit + s->middle[k % 2];
  for (size_t k = 0; k < knots; k++) u[k] = s->domain[0] + u[k] * (s->domain[1] - s->domain[0]);
  batten_curve_form form = {s->degree, knots, u, points, s->closed};
  st = batten_curve_create(ctx, &form, out);
  loft_matrix_free(ctx, &m);
  batten_free(ctx, u);
  return st;
}

/* Bezier points 0 .. l from below, n - l .. n from above [eq. 9], as the derivatives at both contours say:
 * b_r = sum over k <= r of C(r, k) (n - k)! / n! (+- gap)^k times the k-th derivative. */
static batten_status join(batten_context *ctx, scene *s, size_t i, unsigned e) {
  loft_slab *slab = &s->slabs[i];
  loft_matrix m = {0};
  batten_status st = loft_insertion(ctx, &s->contours[i + e].space, &slab->space, &m);
  if (st < 0) return st;
  unsigned n = s->net.degree, l = s->net.smoothness;
  double step = e ? -slab->gap : slab->gap, derivative[2][2 * POINTS];
  for (unsigned k = 0; k < l; k++) loft_matrix_apply(&m, s->slopes[i + e][k], derivative[k]);
  for (size_t j = 0; j < slab->space.count; j++)
    for (unsigned r = 0; r <= l; r++) {
      double *to = s->control + 2 * loft_at(&s->net, i, j, e ? n - r : r);
      for (size_t x = 0; x < 2; x++) {
        to[x] = slab->end[e][2 * j + x] + (r > 0 ? r * step / n * derivative[0][2 * j + x] : 0);
        if (r == 2) to[x] += step * step / (n * (n - 1)) * derivative[1][2 * j + x];
      }
    }
  loft_matrix_free(ctx, &m);
  return st;
}

static batten_status scene_make(batten_context *ctx, uint64_t seed, unsigned d, unsigned l, unsigned n, bool closed,
                                size_t contours, double thin, scene *s) {
  *s = (scene){.stack = {.degree = d,
                         .smoothness = l,
                         .closed = closed,
                         .count = contours,
                         .contours = s->contours,
                         .middle = {3, -5},
                         .unit = 0.25,
                         .height_unit = 2,
                         .base = 1,
                         .domain = {-1, 3}}};
  batten_status st = BATTEN_OK;
  double z = 0;
  for (size_t i = 0; i < contours && st >= 0; i++) {
    loft_contour *c = &s->contours[i];
    st = draw_space(ctx, &seed, d, l, closed, &c->space);
    c->points = s->points[i];
    c->height = z;
    s->heights[i] = z / 2 + 1;
    z += (i % 2 ? thin : 1) * (0.25 + t_uniform(&seed)); /* every other patch is thin */
    draw(&seed, 2 * POINTS, s->points[i]);
    for (size_t k = 0; k < 2; k++) draw(&seed, 2 * POINTS, s->slopes[i][k]);
    if (st >= 0) st = make_curve(ctx, &s->stack, c, &s->curves[i]);
  }
  if (st >= 0) st = loft_slabs_make(ctx, &s->stack, &s->slabs);
  if (st < 0) return st;
  s->net = (loft_net){.degree = n, .smoothness = l, .slab_count = contours - 1, .slabs = s->slabs, .start = s->start};
  for (size_t i = 0; i + 1 < contours; i++) s->start[i + 1] = s->start[i] + s->slabs[i].space.count * (n + 1);
  s->net.z.rows = s->start[contours - 1];
  s->control = batten_alloc_array(ctx, s->net.z.rows, 2 * sizeof *s->control);
  if (!s->control) return BATTEN_E_NOMEM;
  draw(&seed, 2 * s->net.z.rows, s->control);
  for (size_t i = 0; i + 1 < contours && st >= 0; i++)
    for (unsigned e = 0; e < 2 && st >= 0; e++) st = join(ctx, s, i, e);
  return st;
}

static void scene_free(batten_context *ctx, scene *s) {
  for (size_t i = 0; i < s->stack.count; i++) {
    loft_space_free(ctx, &s->contours[i].space);
    batten_curve_free(s->curves[i]);
  }
  batten_free(ctx, s->control);
  if (s->slabs) loft_slabs_free(ctx, s->stack.count - 1, s->slabs);
}

/* ---- by hand ------------------------------------------------------------------------------------- */

/* A quarter-like arc and twice the same at height 3, straight between. */
static void by_hand(batten_context *ctx) {
  double breaks[] = {0, 1}, lower[] = {0, 0, 1, 0, 1, 1}, upper[] = {0, 0, 2, 0, 2, 2}, heights[] = {0, 3};
  unsigned folds[] = {3, 3};
  loft_contour contours[2] = {{.points = lower}, {.points = upper, .height = 3}};
  for (size_t i = 0; i < 2; i++) T_OK(loft_space_make(ctx, 2, false, 1, breaks, folds, &contours[i].space), ctx);
  batten_loft_note note = {.remark = BATTEN_LOFT_STEEP, .contour = 1, .other = 1, .t = 0.5};
  loft_stack stack = {.degree = 2,
                      .smoothness = 1,
                      .count = 2,
                      .contours = contours,
                      .unit = 1,
                      .height_unit = 1,
                      .domain = {0, 1},
                      .note_count = 1,
                      .notes = &note};
  loft_slab *slabs = NULL;
  T_OK(loft_slabs_make(ctx, &stack, &slabs), ctx);
  size_t start[] = {0, 12};
  loft_net net = {.degree = 3, .smoothness = 1, .slab_count = 1, .slabs = slabs, .start = start, .z = {.rows = 12}};
  double control[24];
  for (size_t j = 0; j < 3; j++)
    for (size_t k = 0; k < 4; k++)
      for (size_t x = 0; x < 2; x++) control[2 * (4 * j + k) + x] = (1 + (double)k / 3) * lower[2 * j + x];
  batten_loft *loft = NULL;
  T_OK(loft_make(ctx, &stack, &net, heights, control, &loft), ctx);
  batten_loft_form form = batten_loft_get(loft);
  T_CHECK(form.contours == 2 && form.heights[1] == 3 && form.degree[0] == 2 && form.degree[1] == 3 &&
              form.smoothness == 1 && !form.closed,
          "what it is made of");
  size_t notes;
  T_CHECK(batten_loft_notes(loft, &notes)->remark == BATTEN_LOFT_STEEP && notes == 1, "its note");
  batten_curve *section = NULL;
  T_OK(batten_loft_section(ctx, loft, 1.5, &section), ctx);
  batten_curve_form curve = batten_curve_get(section);
  T_CHECK(curve.knot_count == 6 && curve.control_points[2] == 1.5 && curve.control_points[5] == 1.5,
          "half way up it is half as large again");
  batten_curve_free(section);
  batten_surface *patch = NULL, *whole = NULL;
  T_OK(batten_loft_patch(ctx, loft, 0, &patch), ctx);
  T_OK(batten_loft_surface(ctx, loft, &whole), ctx);
  batten_surface_form a = batten_surface_get(patch), b = batten_surface_get(whole);
  T_CHECK(a.knot_count[1] == 8 && a.control_points[5] == 1 && a.control_points[8] == 2 && a.control_points[11] == 3 &&
              memcmp(a.control_points, b.control_points, sizeof(double[36])) == 0,
          "z rises evenly; the only patch is the whole");
  batten_loft_measures m;
  batten_surface_measures area;
  T_OK(batten_loft_measure(ctx, loft, &m), ctx);
  T_OK(batten_surface_measure(ctx, patch, &area), ctx);
  T_RATIO(fabs(m.area - area.area) / area.area, 1e-9, "area %g", m.area);
  T_CHECK(isnan(m.volume), "open: no volume");
  T_STATUS(batten_loft_measure(ctx, loft, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_CHECK(batten_loft_measure(NULL, loft, &m) == BATTEN_E_INVALID, "no context");
  for (size_t k = 0; k < 12; k++) control[2 * k + 1] = 0;
  batten_loft *wall = NULL;
  T_OK(loft_make(ctx, &stack, &net, heights, control, &wall), ctx);
  /* With y = 0 a plane wall: x runs from 0 to 1 below and to 2 above without turning, over a height of 3. */
  T_OK(batten_loft_measure(ctx, wall, &m), ctx);
  T_RATIO(fabs(m.area - 4.5), 1e-13, "area of a trapezoid");
  /* Sizes whose squares are no doubles: the wall next to flat, and next to a line. */
  for (size_t k = 0; k < 24; k += 2) wall->patches[0].control[k] *= 0x1p-600;
  wall->heights[1] = wall->heights[0] + 3 * 0x1p600;
  T_OK(batten_loft_measure(ctx, wall, &m), ctx);
  T_RATIO(fabs(m.area - 4.5), 1e-13, "a narrow one");
  for (size_t k = 0; k < 24; k += 2) wall->patches[0].control[k] = ldexp(wall->patches[0].control[k], 1200);
  for (size_t k = 0; k <= 5; k++) wall->patches[0].knots[k] *= 0x1p-1000;
  wall->heights[0] = 0;
  wall->heights[1] = 3 * 0x1p-600;
  T_OK(batten_loft_measure(ctx, wall, &m), ctx);
  T_RATIO(fabs(m.area - 4.5), 1e-13, "a low one over a short domain");
  batten_loft_free(wall);
  batten_surface_free(whole);
  batten_surface_free(patch);

  T_STATUS(batten_loft_section(ctx, loft, 3.5, &section), BATTEN_E_INVALID, ctx,
           "z: 3.5; must be between the first and the last contour, 0 .. 3");
  T_STATUS(batten_loft_section(ctx, loft, NAN, &section), BATTEN_E_INVALID, ctx, "z: nan; must be");
  T_STATUS(batten_loft_section(ctx, NULL, 1, &section), BATTEN_E_INVALID, ctx, "loft: NULL");
  T_STATUS(batten_loft_patch(ctx, loft, 1, &patch), BATTEN_E_INVALID, ctx, "i: 1; the patches are 0 .. 0");
  T_STATUS(batten_loft_surface(ctx, loft, NULL), BATTEN_E_INVALID, ctx, "out: NULL; give a loft and room");
  T_CHECK(batten_loft_patch(NULL, loft, 0, &patch) == BATTEN_E_INVALID, "no context");
  batten_loft_free(NULL);
  batten_loft_free(loft);
  loft_slabs_free(ctx, 1, slabs);
  for (size_t i = 0; i < 2; i++) loft_space_free(ctx, &contours[i].space);
}

/* ---- against one another ------------------------------------------------------------------------- */

static double apart(const double *a, const double *b, size_t count) {
  double worst = 0;
  for (size_t k = 0; k < count; k++) worst = fmax(worst, fabs(a[k] - b[k]));
  return worst;
}

/* Point and derivatives by z of both forms everywhere, at contours from both sides; and sections. */
static void compare_forms(batten_context *ctx, const scene *s, const batten_loft *loft) {
  batten_surface *whole = NULL;
  T_OK(batten_loft_surface(ctx, loft, &whole), ctx);
  double point = 0, slope = 0, bend = 0, section = 0, plane = 0;
  bool closed = true;
  for (size_t i = 0; i + 1 < s->stack.count; i++) {
    batten_surface *patch = NULL;
    T_OK(batten_loft_patch(ctx, loft, i, &patch), ctx);
    double gap = s->heights[i + 1] - s->heights[i];
    for (unsigned r = 0; r <= 4; r++) {
      double z = r == 4 ? s->heights[i + 1] : s->heights[i] + r / 4. * gap;
      batten_curve *curve = NULL;
      T_OK(batten_loft_section(ctx, loft, z, &curve), ctx);
      closed = closed && batten_curve_get(curve).closed == s->stack.closed;
      for (unsigned q = 0; q <= 20; q++) {
        double at[2] = {-1 + q / 5., z};
        batten_surface_point a, b;
        batten_curve_point c;
        if (batten_surface_evaluate(ctx, whole, 1, at, &a) < 0 ||
            batten_surface_evaluate(ctx, patch, 1, at, &b) < 0 || batten_curve_evaluate(ctx, curve, 1, at, &c) < 0)
          T_CHECK(false, "%s", batten_error(ctx));
        point = fmax(point, apart(a.point, b.point, 3));
        plane = fmax(plane, fabs(b.point[2] - z));
        section = fmax(section, apart(b.point, c.point, 2));
        slope = fmax(slope, apart(a.dv, b.dv, 3) * gap);
        if (s->net.smoothness > 1) bend = fmax(bend, apart(a.dvv, b.dvv, 3) * gap * gap);
      }
      batten_curve_free(curve);
    }
    batten_surface_free(patch);
  }
  T_RATIO(point, 2e-14, "whole and patches: points");
  T_RATIO(slope, 1e-12, "slopes by z");
  if (s->net.smoothness > 1) T_RATIO(bend, 2e-11, "second derivatives by z");
  T_RATIO(section, 2e-14, "sections");
  T_RATIO(plane, 4e-15, "z");
  T_CHECK(closed, "sections are closed where contours are");
  batten_surface_free(whole);
}

/* At contours sections are the contours, over more knots. */
static void compare_contours(batten_context *ctx, const scene *s, const batten_loft *loft) {
  double worst = 0;
  for (size_t i = 0; i < s->stack.count; i++) {
    batten_curve *section = NULL;
    T_OK(batten_loft_section(ctx, loft, s->heights[i], &section), ctx);
    for (unsigned q = 0; q <= 50; q++) {
      double t = -1 + 4 * q / 50.;
      batten_curve_point a, b;
      if (batten_curve_evaluate(ctx, section, 1, &t, &a) < 0 ||
          batten_curve_evaluate(ctx, s->curves[i], 1, &t, &b) < 0)
        T_CHECK(false, "%s", batten_error(ctx));
      worst = fmax(worst, apart(a.point, b.point, 2));
    }
    batten_curve_free(section);
  }
  T_RATIO(worst, 2e-14, "sections at contours are these");
}

/* Sizes are about 4 (1 / unit); jumps of derivatives are relative to a gap. */
static void measure(batten_context *ctx, scene *s, const batten_loft *loft) {
  double interpolation, continuity, moved[2];
  const batten_curve *curves[CONTOURS];
  for (size_t i = 0; i < s->stack.count; i++) curves[i] = s->curves[i];
  T_OK(loft_measure(ctx, loft, curves, &interpolation, &continuity), ctx);
  T_RATIO(interpolation, 4e-14, "measured interpolation");
  /* Rounding of the thinner patch's control points, by the height of the one below it. */
  double stretch = 1;
  for (size_t i = 0; i + 2 < s->stack.count; i++) stretch = fmax(stretch, s->slabs[i].gap / s->slabs[i + 1].gap);
  T_RATIO(continuity, 1e-14 * s->net.degree * s->net.degree * pow(stretch, s->net.smoothness), "measured continuity");
  batten_context *single = t_context(NULL, NULL, 1);
  T_OK(loft_measure(single, loft, curves, &moved[0], &moved[1]), single);
  T_CHECK(moved[0] == interpolation && moved[1] == continuity, "the same with one thread");
  batten_context_free(single);

  /* A whole column of a patch shifted by a vector of length 5: its l-th derivative at the lower contour jumps by n! /
   * (n - l)! times that, whatever t, and at the upper one none does. */
  unsigned n = s->net.degree, l = s->net.smoothness;
  if (s->stack.count < 3) return;
  for (size_t j = 0; j < s->slabs[1].space.count; j++) {
    double *to = s->control + 2 * loft_at(&s->net, 1, j, l);
    to[0] += 3 * s->stack.unit;
    to[1] += 4 * s->stack.unit;
  }
  batten_loft *other = NULL;
  T_OK(loft_make(ctx, &s->stack, &s->net, s->heights, s->control, &other), ctx);
  T_OK(loft_measure(ctx, other, curves, &moved[0], &moved[1]), ctx);
  double gaps[2] = {s->heights[1] - s->heights[0], s->heights[2] - s->heights[1]};
  double ratio = fmin(gaps[0], gaps[1]) / gaps[1]; /* in units of the lower one of both patches */
  double jump = 5 * pow(ratio, l) * (l == 1 ? n : n * (n - 1));
  T_RATIO(fabs(moved[1] - jump) / jump, 1e-12, "a jump of known size, %g", jump);
  T_CHECK(moved[0] == interpolation, "interpolation stays");
  batten_loft_free(other);

  /* The end of the last patch moved away by 5 at one control point: that far at the end of the curve. */
  size_t last = s->stack.count - 2;
  double *end = s->control + 2 * loft_at(&s->net, last, 0, n);
  end[0] -= 3 * s->stack.unit;
  end[1] -= 4 * s->stack.unit;
  T_OK(loft_make(ctx, &s->stack, &s->net, s->heights, s->control, &other), ctx);
  T_OK(loft_measure(ctx, other, curves, &moved[0], &moved[1]), ctx);
  if (s->stack.closed)
    T_CHECK(moved[0] > 0.5 && moved[0] < 5, "a point moved away: %g", moved[0]);
  else
    T_RATIO(fabs(moved[0] - 5), 1e-13, "an end moved away by 5");
  batten_loft_free(other);

  s->control[2 * loft_at(&s->net, 0, s->slabs[0].space.count / 2, n)] = NAN;
  T_OK(loft_make(ctx, &s->stack, &s->net, s->heights, s->control, &other), ctx);
  T_OK(loft_measure(ctx, other, curves, &moved[0], &moved[1]), ctx);
  T_CHECK(isnan(moved[0]) && isnan(moved[1]), "no numbers, no measures");
  batten_loft_free(other);
}

/* The area of sections by the curves' own measure, over all z by the rule of Gauss and Legendre on halves of patches.
 */
static double stacked_volume(batten_context *ctx, const batten_loft *loft) {
  batten_loft_form form = batten_loft_get(loft);
  double volume = 0;
  for (size_t h = 0; h < 4 * (form.contours - 1); h++)
    for (unsigned q = 0; q < GAUSS8; q++) {
      const double *z = form.heights + h / 4;
      double node, weight, part = (z[1] - z[0]) / 4;
      gauss8_node(q, &node, &weight);
      batten_curve *section = NULL;
      batten_curve_measures m;
      if (batten_loft_section(ctx, loft, z[0] + ((double)(h % 4) + node) * part, &section) < 0 ||
          batten_curve_measure(ctx, section, &m) < 0)
        T_CHECK(false, "%s", batten_error(ctx));
      volume += weight * part * m.area;
      batten_curve_free(section);
    }
  return volume;
}

static batten_status call_measure(batten_context *ctx, void *arg) {
  batten_loft_measures m;
  return batten_loft_measure(ctx, arg, &m);
}

static void volumes(batten_context *ctx, const batten_loft *loft) {
  batten_loft_measures m;
  T_OK(batten_loft_measure(ctx, loft, &m), ctx);
  double volume = stacked_volume(ctx, loft);
  T_RATIO(fabs(m.volume - volume) / fabs(volume), 1e-11, "volume %g, and of its sections", m.volume);
  if (batten_loft_get(loft).degree[0] == 2)
    t_cancel_every_progress("batten_loft_measure", call_measure, (void *)(uintptr_t)loft);
}

static void agree(batten_context *ctx, uint64_t seed, unsigned d, unsigned l, unsigned n, bool closed,
                  size_t contours, double thin) {
  scene s;
  batten_loft *loft = NULL;
  printf("# degree %u, %u, smoothness %u, %zu %s contours\n", d, n, l, contours, closed ? "closed" : "open");
  T_OK(scene_make(ctx, seed, d, l, n, closed, contours, thin, &s), ctx);
  T_OK(loft_make(ctx, &s.stack, &s.net, s.heights, s.control, &loft), ctx);
  compare_forms(ctx, &s, loft);
  compare_contours(ctx, &s, loft);
  if (closed && d < 4 && thin == 1) volumes(ctx, loft);
  measure(ctx, &s, loft);
  batten_loft_free(loft);
  scene_free(ctx, &s);
}

/* ---- failures ------------------------------------------------------------------------------------ */

static batten_status make_all(batten_context *ctx, void *arg) {
  scene s;
  (void)arg;
  batten_loft *loft = NULL;
  batten_surface *patch = NULL, *whole = NULL;
  batten_curve *section = NULL;
  double errors[2];
  batten_status st = scene_make(ctx, 7, 3, 2, 6, true, 3, 1, &s);
  batten_loft_note note = {.remark = BATTEN_LOFT_STEEP};
  s.stack.notes = &note;
  s.stack.note_count = 1;
  const batten_curve *curves[] = {s.curves[0], s.curves[1], s.curves[2]};
  if (st >= 0) st = loft_make(ctx, &s.stack, &s.net, s.heights, s.control, &loft);
  if (st >= 0) st = batten_loft_patch(ctx, loft, 1, &patch);
  if (st >= 0) st = batten_loft_surface(ctx, loft, &whole);
  if (st >= 0) st = batten_loft_section(ctx, loft, 1.1, &section);
  if (st >= 0) st = loft_measure(ctx, loft, curves, &errors[0], &errors[1]);
  batten_curve_free(section);
  batten_surface_free(whole);
  batten_surface_free(patch);
  batten_loft_free(loft);
  scene_free(ctx, &s);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  by_hand(ctx);
  uint64_t seed = 1;
  for (unsigned d = 2; d <= 5; d++)
    for (unsigned l = 1; l <= (d > 2 ? 2u : 1u); l++)
      for (int closed = 0; closed < 2; closed++) {
        agree(ctx, seed++, d, l, 2 * l + 2, closed, 4, 1);
        agree(ctx, seed, d, l, 2 * l + 2, closed, 4, 1e-3);
        agree(ctx, seed++, d, l, d == 3 ? 9 : 2 * l + 1, closed, d == 4 ? 2 : CONTOURS, 1);
      }
  t_fail_every_allocation("the handle", make_all, NULL);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  batten_context_free(ctx);
  return t_done();
}
