/* Does a section's function have the sign of its loops, and how far does it miss them?
 *
 * Even-odd and the exact distance to the polygons are the oracle; nothing of how the function was made is used.
 * Places are looked at first, for they tell how deep a wrong sign is, and where; if none is too deep, prove.c is
 * asked.
 *
 *   sign   at a grid of 64 cells along the longest side, moved by a part of a cell that no other grid in this folder
 *          has, at places on both sides of the loops - twice as dense as their vertices and no farther apart than
 *          five tolerances, just above one tolerance off, two, four, and so on to a cell -, and on circles from 2 to
 *          100 half diagonals away: where F and the distance oppose, the distance is the depth
 *   miss   |F| / |grad F| at the vertices of the loops */
#include "base/checked.h"
#include "section/places.h"
#include "section/section_inner.h"

#include <string.h>

enum { CELLS = 64, CIRCLES = 4, DIRECTIONS = 64 };
static const double SHIFT = 0.381966;                 /* of a cell */
static const double RADII[CIRCLES] = {2, 6, 25, 100}; /* half diagonals */
static const double STEP = 0.5, STEP_MAX = 5;         /* of an edge, of a tolerance */
static const double NEAR = 1.001;                     /* tolerances: deep enough not to pass when it is wrong */

/* x [CIRCLES DIRECTIONS][2] */
static void far_places(const polygon_set *p, double *x) {
  const double radius = 0.5 * hypot(p->upper[0] - p->lower[0], p->upper[1] - p->lower[1]);
  for (size_t i = 0; i < CIRCLES * DIRECTIONS; i++) {
    /* half a step: not at the directions of the centres that hold the function down */
    double angle = 2 * 3.141592653589793 * ((double)(i % DIRECTIONS) + 0.5) / DIRECTIONS;
    double r = RADII[i / DIRECTIONS] * radius;
    x[2 * i] = 0.5 * (p->lower[0] + p->upper[0]) + r * cos(angle);
    x[2 * i + 1] = 0.5 * (p->lower[1] + p->upper[1]) + r * sin(angle);
  }
}

static batten_status find_wrong_signs(batten_context *ctx, const polygon_set *loops, const batten_solid *function,
                                      size_t count, const double *x, section_wrong *wrong) {
  double *f = batten_alloc_array(ctx, count, sizeof *f);
  batten_status st = f ? batten_solid_evaluate(ctx, function, count, x, f, NULL, NULL) : BATTEN_E_NOMEM;
  for (size_t i = 0; st >= 0 && i < count; i++) {
    bool inside = polygon_inside(loops, x + 2 * i);
    if (f[i] == 0 || inside == (f[i] > 0)) continue;
    section_add_wrong(wrong, x + 2 * i,
                      isnan(f[i]) ? INFINITY : fabs(polygon_distance(loops, x + 2 * i, NULL, NULL)));
  }
  batten_free(ctx, f);
  return st;
}

static batten_status find_miss(batten_context *ctx, const polygon_set *loops, const batten_solid *function,
                               double *miss) {
  const size_t count = loops->starts[loops->count];
  double *f = batten_alloc_array(ctx, count, sizeof *f), *df = batten_alloc_array(ctx, count, 2 * sizeof *df);
  batten_status st =
      f && df ? batten_solid_evaluate(ctx, function, count, loops->points, f, df, NULL) : BATTEN_E_NOMEM;
  *miss = 0;
  for (size_t i = 0; st >= 0 && i < count; i++) {
    double distance = f[i] == 0 ? 0 : fabs(f[i]) / hypot(df[2 * i], df[2 * i + 1]);
    if (!(distance <= *miss)) *miss = distance;
  }
  batten_free(ctx, f);
  batten_free(ctx, df);
  return st;
}

batten_status section_certify(batten_context *ctx, const polygon_set *loops, const batten_solid *function,
                              double tolerance, section_figures *figures, section_wrong *wrong) {
  loop_places along = {0};
  section_wrong found = {0};
  bool proven = false;
  double *beside = NULL, *far = NULL, miss = 0;
  size_t count = 0;
  batten_status st = loop_places_make(ctx, loops, STEP, STEP_MAX * tolerance, &along);
  if (st < 0) goto done;
  st = loop_places_beside(ctx, loops, &along, NEAR * tolerance, CELLS, SHIFT, &beside, &count);
  if (st < 0) goto done;
  st = BATTEN_E_NOMEM;
  far = batten_alloc_array(ctx, CIRCLES * DIRECTIONS, 2 * sizeof *far);
  if (!far) goto done;
  far_places(loops, far);
  if ((st = find_wrong_signs(ctx, loops, function, count, beside, &found)) < 0) goto done;
  if ((st = find_wrong_signs(ctx, loops, function, CIRCLES * DIRECTIONS, far, &found)) < 0) goto done;
  if ((st = find_miss(ctx, loops, function, &miss)) < 0) goto done;
  if (found.depth <= tolerance && (st = section_prove(ctx, loops, function, tolerance, &proven, &found)) < 0)
    goto done;
  figures->residual_max = miss;
  figures->wrong_sign_max = found.depth;
  figures->certified = proven;
  if (wrong) *wrong = found;
  st = BATTEN_OK;
done:
  loop_places_free(ctx, &along);
  batten_free(ctx, beside);
  batten_free(ctx, far);
  return st;
}
