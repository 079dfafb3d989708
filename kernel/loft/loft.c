/* The handle of lofts: control points in the caller's units, patches as surfaces, sections as curves.
 *
 * A patch is kept over clamped knots in t, also where the contours are closed, since that is what curves and surfaces
 * are made of; by z it is a Bezier form. z itself is a coordinate whose control points are Greville abscissas, and
 * all control points of a column have the same one, so that sections z = const are plane to the bit. */
#include "base/checked.h"
#include "basis/refine.h"
#include "curve/curve_inner.h"
#include "loft_inner.h"

#include <string.h>

/* ---- making it ----------------------------------------------------------------------------------- */

/* Rises with t; 0 and 1 are the ends of the domain. */
static double to_domain(const double domain[2], double t) {
  return t < 1 ? fmin(domain[0] + t * (domain[1] - domain[0]), domain[1]) : domain[1];
}

/* Control points of patch i, of all t [space.count][row][2] -> [m->rows][row][2]. */
static void clamp_points(const loft_stack *stack, const loft_matrix *m, size_t row, const double *points,
                         double *out) {
  for (size_t j = 0; j < m->rows; j++, out += 2 * row) {
    for (size_t k = 0; k < 2 * row; k++) out[k] = 0;
    for (size_t e = m->starts[j]; e < m->starts[j + 1]; e++) {
      const double *from = points + 2 * row * m->indices[e];
      for (size_t k = 0; k < 2 * row; k++) out[k] += m->values[e] * from[k];
    }
    for (size_t k = 0; k < 2 * row; k++) out[k] = out[k] / stack->unit + stack->middle[k % 2];
  }
}

static batten_status make_patch(batten_context *ctx, const loft_stack *stack, const loft_net *net, size_t i,
                                const double *control, loft_patch *out) {
  loft_matrix m = {0};
  size_t row = net->degree + 1;
  batten_status st = loft_clamped(ctx, &net->slabs[i].space, &out->knot_count, &out->knots, &m);
  if (st < 0) return st;
  for (size_t k = 0; k < out->knot_count; k++) out->knots[k] = to_domain(stack->domain, out->knots[k]);
  out->count = m.rows;
  out->control = batten_alloc_array(ctx, m.rows, row * 2 * sizeof *out->control);
  if (out->control) clamp_points(stack, &m, row, control + 2 * net->start[i], out->control);
  loft_matrix_free(ctx, &m);
  return out->control ? BATTEN_OK : BATTEN_E_NOMEM;
}

batten_status loft_make(batten_context *ctx, const loft_stack *stack, const loft_net *net, const double *heights,
                        const double *control, batten_loft **out) {
  batten_loft *loft = batten_alloc(ctx, sizeof *loft);
  if (!loft) return BATTEN_E_NOMEM;
  *loft = (batten_loft){.ctx = ctx,
                        .contours = stack->count,
                        .degree = {stack->degree, net->degree},
                        .smoothness = net->smoothness,
                        .closed = stack->closed,
                        .domain = {stack->domain[0], stack->domain[1]},
                        .note_count = stack->note_count};
  batten_status st = BATTEN_E_NOMEM;
  loft->heights = batten_alloc_array(ctx, stack->count, sizeof *loft->heights);
  if (!loft->heights) goto done;
  memcpy(loft->heights, heights, stack->count * sizeof *heights);
  if (stack->note_count > 0) {
    loft->notes = batten_alloc_array(ctx, stack->note_count, sizeof *loft->notes);
    if (!loft->notes) goto done;
    memcpy(loft->notes, stack->notes, stack->note_count * sizeof *loft->notes);
  }
  loft->patches = batten_alloc_array(ctx, stack->count - 1, sizeof *loft->patches);
  if (!loft->patches) goto done;
  memset(loft->patches, 0, (stack->count - 1) * sizeof *loft->patches);
  st = BATTEN_OK;
  for (size_t i = 0; i + 1 < stack->count && st >= 0; i++)
    st = make_patch(ctx, stack, net, i, control, &loft->patches[i]);
done:
  if (st >= 0)
    *out = loft;
  else
    batten_loft_free(loft);
  return st;
}

void batten_loft_free(batten_loft *loft) {
  if (!loft) return;
  batten_context *ctx = loft->ctx;
  for (size_t i = 0; loft->patches && i + 1 < loft->contours; i++) {
    batten_free(ctx, loft->patches[i].knots);
    batten_free(ctx, loft->patches[i].control);
  }
  batten_free(ctx, loft->patches);
  batten_free(ctx, loft->notes);
  batten_free(ctx, loft->heights);
  batten_free(ctx, loft);
}

batten_loft_form batten_loft_get(const batten_loft *loft) {
  return (batten_loft_form){.contours = loft->contours,
                            .heights = loft->heights,
                            .degree = {loft->degree[0], loft->degree[1]},
                            .smoothness = loft->smoothness,
                            .closed = loft->closed};
}

const batten_loft_note *batten_loft_notes(const batten_loft *loft, size_t *count) {
  *count = loft->note_count;
  return loft->notes;
}

/* ---- sections ------------------------------------------------------------------------------------ */

static batten_status check(batten_context *ctx, const batten_loft *loft, const void *out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (loft && out) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a loft and room for the result", loft ? "out" : "loft");
}

batten_status batten_loft_section(batten_context *ctx, const batten_loft *loft, double z, batten_curve **out) {
  batten_status st = check(ctx, loft, out);
  if (st < 0) return st;
  size_t i = 0, last = loft->contours - 1;
  if (!(z >= loft->heights[0] && z <= loft->heights[last]))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "z: %.17g; must be between the first and the last contour, %.17g .. %.17g", z,
                       loft->heights[0], loft->heights[last]);
  for (size_t above = last; above - i > 1;) {
    size_t middle = i + (above - i) / 2;
    if (z < loft->heights[middle])
      above = middle;
    else
      i = middle;
  }
  const loft_patch *p = &loft->patches[i];
  double *points = batten_alloc_array(ctx, p->count, 2 * sizeof *points);
  if (!points) return BATTEN_E_NOMEM;
  double part = (z - loft->heights[i]) / (loft->heights[i + 1] - loft->heights[i]);
  const double(*net)[2] = (const double(*)[2])p->control;
  for (size_t j = 0; j < p->count; j++, net += loft->degree[1] + 1)
    curve_net_at(loft->degree[1], net, part, points + 2 * j);
  st = curve_make(ctx, &(bspline){loft->degree[0], p->count, p->knots}, points, loft->closed, out);
  batten_free(ctx, points);
  return st;
}

/* ---- surfaces ------------------------------------------------------------------------------------ */

/* Greville abscissas [count]: at knots as often as the degree these themselves. */
static void find_heights(const bspline *b, double *out) {
  for (size_t j = 0; j < b->count; j++) {
    double sum = 0;
    for (unsigned k = 2; k <= b->degree; k++) sum += b->knots[j + k] - b->knots[j + 1];
    out[j] = b->knots[j + 1] + sum / b->degree;
  }
}

batten_status batten_loft_patch(batten_context *ctx, const batten_loft *loft, size_t i, batten_surface **out) {
  batten_status st = check(ctx, loft, out);
  if (st < 0) return st;
  if (i + 1 >= loft->contours)
    return batten_fail(ctx, BATTEN_E_INVALID, "i: %zu; the patches are 0 .. %zu", i, loft->contours - 2);
  const loft_patch *p = &loft->patches[i];
  size_t row = loft->degree[1] + 1;
  double *points = batten_alloc_array(ctx, p->count, row * 3 * sizeof *points);
  if (!points) return BATTEN_E_NOMEM;
  double knots[2 * BSPLINE_ORDER], heights[BSPLINE_ORDER];
  for (size_t k = 0; k < row; k++) {
    knots[k] = loft->heights[i];
    knots[row + k] = loft->heights[i + 1];
  }
  find_heights(&(bspline){loft->degree[1], row, knots}, heights);
  for (size_t k = 0; k < p->count * row; k++) {
    points[3 * k] = p->control[2 * k];
    points[3 * k + 1] = p->control[2 * k + 1];
    points[3 * k + 2] = heights[k % row];
  }
  batten_surface_form form = {.degree = {loft->degree[0], loft->degree[1]},
                              .knot_count = {p->knot_count, 2 * row},
                              .knots = {p->knots, knots},
                              .control_points = points};
  st = batten_surface_create(ctx, &form, out);
  batten_free(ctx, points);
  return st;
}

/* The whole as one surface: its control points over the knots of all patches are those of the patches, refined; by z
 * those Bezier points stay whose knots do. */
typedef struct whole {
  bspline along, across; /* in t, z */
  double *knots[2], *points, *heights;
  size_t *first; /* [along.count] and rows: a patch's control points in `along` */
  double *rows;
} whole;

static size_t unite(size_t n, const double *a, size_t m, const double *b, double *out) {
  size_t i = 0, j = 0, count = 0;
  while (i < n || j < m) {
    bool own = j == m || (i < n && a[i] <= b[j]), other = i == n || (j < m && b[j] <= a[i]);
    out[count++] = own ? a[i] : b[j];
    i += own;
    j += other;
  }
  return count;
}

/* Every knot of all patches as often as in the one that has it most often. */
static batten_status unite_knots(batten_context *ctx, const batten_loft *loft, size_t *count, double **out) {
  size_t room = 0, used = 0;
  for (size_t i = 0; i + 1 < loft->contours; i++) batten_add(room, loft->patches[i].knot_count, &room);
  double *knots = batten_alloc_array(ctx, room, sizeof *knots), *next = batten_alloc_array(ctx, room, sizeof *next);
  if (!knots || !next) {
    batten_free(ctx, next);
    batten_free(ctx, knots);
    return BATTEN_E_NOMEM;
  }
  for (size_t i = 0; i + 1 < loft->contours; i++) {
    used = unite(used, knots, loft->patches[i].knot_count, loft->patches[i].knots, next);
    double *swap = knots;
    knots = next;
    next = swap;
  }
  batten_free(ctx, next);
  *out = knots;
  *count = used;
  return BATTEN_OK;
}

/* Knots by z: those at contours inside n - l fold. */
static void lay_heights(const batten_loft *loft, double *knots) {
  unsigned n = loft->degree[1];
  for (size_t i = 0; i < loft->contours; i++) {
    bool end = i == 0 || i + 1 == loft->contours;
    for (unsigned k = 0; k < (end ? n + 1 : n - loft->smoothness); k++) *knots++ = loft->heights[i];
  }
}

/* Column i (n - l) + k of the surface is the blossom at n knots. For l <= k <= n - l these are the patch's, and that
 * is its Bezier point k. For l = 2 there is one more above each contour, that at z_(i - 1), z_i (n - 2 times) and
 * z_(i + 1): of both polynomials, from the shorter patch, where that goes beyond it by less than its own height. Row
 * [n + 1][2] of patch i goes to columns [across.count][3] of a row of the surface. */
static void place_row(const batten_loft *loft, size_t i, const double (*row)[2], double *out) {
  unsigned n = loft->degree[1], l = loft->smoothness;
  const double *z = loft->heights + i;
  bool bottom = i == 0, top = i + 2 == loft->contours;
  double gap = z[1] - z[0], below = bottom ? 0 : z[0] - z[-1], above = top ? 0 : z[2] - z[1];
  out += 3 * (i * (n - l));
  for (unsigned k = bottom ? 0 : l; k <= (top ? n : n - l); k++) memcpy(out + 3 * k, row[k], sizeof *row);
  if (l < 2) return;
  for (size_t x = 0; x < 2; x++) {
    if (!bottom && below < gap) out[3 + x] = row[1][x] - below / gap * (row[2][x] - row[1][x]);
    if (!top && above <= gap) out[3 * (n - 1) + x] = row[n - 1][x] + above / gap * (row[n - 1][x] - row[n - 2][x]);
  }
}

static void place_patch(const batten_loft *loft, size_t i, whole *w) {
  const loft_patch *p = &loft->patches[i];
  size_t width = loft->degree[0] + 1, row = loft->degree[1] + 1;
  bspline_insertion(&(bspline){loft->degree[0], p->count, p->knots}, &w->along, w->first, w->rows);
  for (size_t j = 0; j < w->along.count; j++) {
    double points[BSPLINE_ORDER][2] = {{0}};
    for (size_t a = 0; a < width; a++) {
      double weight = w->rows[j * width + a];
      if (weight == 0) continue; /* may stand for a point that is not there */
      const double *from = p->control + 2 * row * (w->first[j] + a);
      for (size_t k = 0; k < row; k++) {
        points[k][0] += weight * from[2 * k];
        points[k][1] += weight * from[2 * k + 1];
      }
    }
    place_row(loft, i, (const double(*)[2])points, w->points + 3 * j * w->across.count);
  }
}

static void whole_free(batten_context *ctx, whole *w) {
  batten_free(ctx, w->rows);
  batten_free(ctx, w->first);
  batten_free(ctx, w->heights);
  batten_free(ctx, w->points);
  batten_free(ctx, w->knots[1]);
  batten_free(ctx, w->knots[0]);
}

static batten_status whole_make(batten_context *ctx, const batten_loft *loft, whole *w) {
  unsigned d = loft->degree[0], n = loft->degree[1];
  size_t knots, numbers, columns = n + 1 + (loft->contours - 2) * (n - loft->smoothness);
  batten_status st = unite_knots(ctx, loft, &knots, &w->knots[0]);
  if (st < 0) return st;
  w->along = (bspline){d, knots - d - 1, w->knots[0]};
  if (!batten_mul3(w->along.count, columns, 3 * sizeof *w->points, &numbers))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "loft: %zu x %zu control points; take its patches", w->along.count,
                       columns);
  w->knots[1] = batten_alloc_array(ctx, columns + n + 1, sizeof *w->knots[1]);
  w->points = batten_alloc(ctx, numbers);
  w->heights = batten_alloc_array(ctx, columns, sizeof *w->heights);
  w->first = batten_alloc_array(ctx, w->along.count, sizeof *w->first);
  w->rows = batten_alloc_array(ctx, w->along.count, (d + 1) * sizeof *w->rows);
  if (!w->knots[1] || !w->points || !w->heights || !w->first || !w->rows) return BATTEN_E_NOMEM;
  lay_heights(loft, w->knots[1]);
  w->across = (bspline){n, columns, w->knots[1]};
  find_heights(&w->across, w->heights);
  for (size_t i = 0; i + 1 < loft->contours; i++) place_patch(loft, i, w);
  for (size_t k = 0; k < w->along.count * columns; k++) w->points[3 * k + 2] = w->heights[k % columns];
  return BATTEN_OK;
}

batten_status batten_loft_surface(batten_context *ctx, const batten_loft *loft, batten_surface **out) {
  batten_status st = check(ctx, loft, out);
  if (st < 0) return st;
  whole w = {.points = NULL};
  st = whole_make(ctx, loft, &w);
  if (st >= 0) {
    batten_surface_form form = {
        .degree = {w.along.degree, w.across.degree},
        .knot_count = {w.along.count + w.along.degree + 1, w.across.count + w.across.degree + 1},
        .knots = {w.knots[0], w.knots[1]},
        .control_points = w.points};
    st = batten_surface_create(ctx, &form, out);
  }
  whole_free(ctx, &w);
  return st;
}
