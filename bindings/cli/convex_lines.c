/* Lines on the surfaces of the picture of `batten convex`: control nets, curves of the spans, ellipses of
 * curvature. */
#include "convex_picture.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void convex_to_frame(const convex_frame *frame, const double point[3], double out[3]) {
  for (int k = 0; k < 3; k++)
    out[k] = frame->rows[k][0] * point[0] + frame->rows[k][1] * point[1] + frame->rows[k][2] * point[2];
}

batten_status convex_add_segment(batten_context *ctx, convex_segments *s, const double from[3], const double to[3]) {
  if (s->count == s->room) {
    size_t room = s->room ? 2 * s->room : 256;
    double *ends = batten_alloc_array(ctx, room, 6 * sizeof *ends);
    if (!ends) return BATTEN_E_NOMEM;
    if (s->count) memcpy(ends, s->ends, 6 * s->count * sizeof *ends);
    batten_free(ctx, s->ends);
    s->ends = ends;
    s->room = room;
  }
  double *end = s->ends + 6 * s->count++;
  memcpy(end, from, 3 * sizeof *end);
  memcpy(end + 3, to, 3 * sizeof *end);
  return BATTEN_OK;
}

/* ---- control net --------------------------------------------------------------------------------- */

batten_status convex_net(batten_context *ctx, const batten_surface *surface, const convex_frame *frame,
                         convex_segments *net, convex_segments *knots) {
  batten_surface_form f = batten_surface_get(surface);
  size_t nu = f.knot_count[0] - f.degree[0] - 1, nv = f.knot_count[1] - f.degree[1] - 1;
  batten_status st = BATTEN_OK;
  for (size_t i = 0; st >= 0 && i < nu; i++)
    for (size_t j = 0; st >= 0 && j < nv; j++) {
      double here[3], next[3];
      convex_to_frame(frame, f.control_points + 3 * (i * nv + j), here);
      st = convex_add_segment(ctx, knots, here, here);
      if (st >= 0 && i + 1 < nu) {
        convex_to_frame(frame, f.control_points + 3 * ((i + 1) * nv + j), next);
        st = convex_add_segment(ctx, net, here, next);
      }
      if (st >= 0 && j + 1 < nv) {
        convex_to_frame(frame, f.control_points + 3 * (i * nv + j + 1), next);
        st = convex_add_segment(ctx, net, here, next);
      }
    }
  return st;
}

/* ---- curves of the spans ------------------------------------------------------------------------- */

/* The curve where parameter k has a value. */
static batten_status add_curve(batten_context *ctx, const batten_surface *surface, const convex_frame *frame, int k,
                               double value, const double other[2], convex_segments *out) {
  enum { PIECES = CONVEX_GRID };
  double *places = batten_alloc_array(ctx, PIECES + 1, 2 * sizeof *places);
  batten_surface_point *points = batten_alloc_array(ctx, PIECES + 1, sizeof *points);
  batten_status st = BATTEN_E_NOMEM;
  if (!places || !points) goto done;
  for (size_t i = 0; i <= PIECES; i++) {
    double t = (double)i / PIECES;
    places[2 * i + (size_t)k] = value;
    places[2 * i + 1 - (size_t)k] = i == PIECES ? other[1] : other[0] + t * (other[1] - other[0]);
  }
  st = batten_surface_evaluate(ctx, surface, PIECES + 1, places, points);
  for (size_t i = 0; st >= 0 && i < PIECES; i++) {
    double from[3], to[3];
    convex_to_frame(frame, points[i].point, from);
    convex_to_frame(frame, points[i + 1].point, to);
    st = convex_add_segment(ctx, out, from, to);
  }
done:
  batten_free(ctx, points);
  batten_free(ctx, places);
  return st;
}

batten_status convex_span_curves(batten_context *ctx, const batten_surface *surface, const convex_frame *frame,
                                 convex_segments *out) {
  batten_surface_form f = batten_surface_get(surface);
  batten_status st = BATTEN_OK;
  for (int k = 0; k < 2; k++) {
    const double *knots = f.knots[k], *across = f.knots[1 - k];
    double other[2] = {across[0], across[f.knot_count[1 - k] - 1]};
    for (size_t i = 0; st >= 0 && i < f.knot_count[k]; i++)
      if (i == 0 || knots[i] > knots[i - 1]) st = add_curve(ctx, surface, frame, k, knots[i], other, out);
  }
  return st;
}

/* ---- ellipses of curvature ----------------------------------------------------------------------- */

enum { ELLIPSES = 7 /* in either direction */, ELLIPSE_PIECES = 40 };

/* Curvatures that are less, of 1 / distance between ellipses, are those of a plane but for rounding. */
static const double flat_curvature = 1e-7;

static int compare_doubles(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

/* The median distance between neighbouring places. */
static double usual_gap(const batten_surface_point *p, double *gaps) {
  size_t count = 0;
  for (size_t i = 0; i < ELLIPSES; i++)
    for (size_t j = 0; j < ELLIPSES; j++)
      for (size_t way = 0; way < 2; way++) {
        size_t a = i + (way == 0), b = j + (way == 1);
        if (a == ELLIPSES || b == ELLIPSES) continue;
        const double *x = p[i * ELLIPSES + j].point, *y = p[a * ELLIPSES + b].point;
        gaps[count++] = hypot(hypot(x[0] - y[0], x[1] - y[1]), x[2] - y[2]);
      }
  qsort(gaps, count, sizeof *gaps, compare_doubles);
  return gaps[count / 2];
}

/* The place that lies a, b along the principal directions, on the surface to second order: curvatures are positive
 * where it bends away from the normal. */
static void on_surface(const batten_surface_point *p, const convex_frame *frame, double a, double b, double out[3]) {
  double drop = 0.5 * (p->principal[0] * a * a + p->principal[1] * b * b), place[3];
  for (int k = 0; k < 3; k++)
    place[k] = p->point[k] + a * p->directions[0][k] + b * p->directions[1][k] - drop * p->normal[k];
  convex_to_frame(frame, place, out);
}

static batten_status add_ellipse(batten_context *ctx, const batten_surface_point *p, const convex_frame *frame,
                                 double scale, convex_segments *out) {
  const double pi = 3.14159265358979323846;
  double a = 0.5 * scale * fabs(p->principal[0]), b = 0.5 * scale * fabs(p->principal[1]), from[3], to[3];
  batten_status st = BATTEN_OK;
  if (!isfinite(a + b)) return st;
  on_surface(p, frame, a, 0, from);
  for (int i = 1; st >= 0 && i <= ELLIPSE_PIECES; i++) {
    double angle = 2 * pi * i / ELLIPSE_PIECES;
    on_surface(p, frame, a * cos(angle), b * sin(angle), to);
    st = convex_add_segment(ctx, out, from, to);
    memcpy(from, to, sizeof from);
  }
  for (int i = -4; st >= 0 && i < 4; i++) { /* the axes */
    on_surface(p, frame, a * i / 4, 0, from);
    on_surface(p, frame, a * (i + 1) / 4, 0, to);
    st = convex_add_segment(ctx, out, from, to);
    on_surface(p, frame, 0, b * i / 4, from);
    on_surface(p, frame, 0, b * (i + 1) / 4, to);
    if (st >= 0) st = convex_add_segment(ctx, out, from, to);
  }
  return st;
}

batten_status convex_ellipses(batten_context *ctx, const batten_surface *surface, const convex_frame *frame,
                              convex_segments *out) {
  enum { COUNT = ELLIPSES * ELLIPSES };
  batten_surface_form f = batten_surface_get(surface);
  double *places = batten_alloc_array(ctx, COUNT, 2 * sizeof *places);
  double *gaps = batten_alloc_array(ctx, COUNT, 2 * sizeof *gaps), largest = 0;
  batten_surface_point *points = batten_alloc_array(ctx, COUNT, sizeof *points);
  batten_status st = BATTEN_E_NOMEM;
  if (!places || !gaps || !points) goto done;
  for (size_t i = 0; i < COUNT; i++)
    for (size_t k = 0; k < 2; k++) {
      double lower = f.knots[k][0], upper = f.knots[k][f.knot_count[k] - 1];
      double t = ((double)(k == 0 ? i / ELLIPSES : i % ELLIPSES) + 0.5) / ELLIPSES;
      places[2 * i + k] = lower + t * (upper - lower);
    }
  st = batten_surface_evaluate(ctx, surface, COUNT, places, points);
  if (st < 0) goto done;
  for (size_t i = 0; i < COUNT; i++)
    for (size_t k = 0; k < 2; k++)
      if (isfinite(points[i].principal[k])) largest = fmax(largest, fabs(points[i].principal[k]));
  double gap = usual_gap(points, gaps), scale = 0.9 * gap / largest;
  if (!(largest * gap > flat_curvature)) goto done;
  for (size_t i = 0; st >= 0 && i < COUNT && isfinite(scale); i++)
    st = add_ellipse(ctx, &points[i], frame, scale, out);
done:
  batten_free(ctx, points);
  batten_free(ctx, gaps);
  batten_free(ctx, places);
  return st;
}
