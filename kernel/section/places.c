/* Places along the loops of a section and beside them.
 *
 * Contours come with vertices a hundredth of their usual distance apart and with edges many times as long: places are
 * even to a factor of some three whatever the vertices, but keep the corners. */
#include "section/places.h"

#include "base/checked.h"
#include "basis/quantile.h"

#include <string.h>

enum { PLACES_MAX = 65536 };

static const double *vertex(const polygon_set *p, size_t loop, size_t i) {
  size_t first = p->starts[loop], count = p->starts[loop + 1] - first;
  return p->points + 2 * (first + i % count);
}

static double edge_length(const polygon_set *p, size_t loop, size_t i) {
  const double *a = vertex(p, loop, i), *b = vertex(p, loop, i + 1);
  return hypot(b[0] - a[0], b[1] - a[1]);
}

/* The edge at which half of the length is reached, for every loop; *perimeter of all. */
static batten_status measure_edges(batten_context *ctx, const polygon_set *p, double *edge, double *perimeter) {
  weighted_sample *samples = batten_alloc_array(ctx, p->starts[p->count], sizeof *samples);
  if (!samples) return BATTEN_E_NOMEM;
  *perimeter = 0;
  for (size_t loop = 0; loop < p->count; loop++) {
    size_t count = p->starts[loop + 1] - p->starts[loop];
    for (size_t i = 0; i < count; i++) {
      double length = edge_length(p, loop, i);
      samples[i] = (weighted_sample){length, length};
      *perimeter += length;
    }
    edge[loop] = weighted_quantile(count, samples, 0.5);
  }
  batten_free(ctx, samples);
  return BATTEN_OK;
}

/* The area lies on the left of an edge, so its right is outward. */
static void edge_normal(const double *a, const double *b, double *normal) {
  double x = b[0] - a[0], y = b[1] - a[1], length = hypot(x, y);
  normal[0] = y / length;
  normal[1] = -x / length;
}

/* The bisector of both edges' normals; at a spike, where they cancel, the one edge's. */
static void vertex_normal(const polygon_set *p, size_t loop, size_t i, double *normal) {
  size_t count = p->starts[loop + 1] - p->starts[loop];
  double before[2], after[2];
  edge_normal(vertex(p, loop, i + count - 1), vertex(p, loop, i), before);
  edge_normal(vertex(p, loop, i), vertex(p, loop, i + 1), after);
  double x = before[0] + after[0], y = before[1] + after[1], length = hypot(x, y);
  bool spike = !(length > 1e-6);
  normal[0] = spike ? after[0] : x / length;
  normal[1] = spike ? after[1] : y / length;
}

/* Places of one loop; x and outward NULL: only counted. */
static size_t walk(const polygon_set *p, size_t loop, double step, double *x, double *outward) {
  size_t count = p->starts[loop + 1] - p->starts[loop], made = 0;
  double since = INFINITY; /* length from the last place to vertex i */
  for (size_t i = 0; i < count; i++) {
    const double *a = vertex(p, loop, i), *b = vertex(p, loop, i + 1);
    double length = edge_length(p, loop, i), pieces = ceil(length / step);
    size_t left = count - i; /* never fewer than three places */
    size_t first = since < step / 8 && made + left > 3 ? 1 : 0;
    for (size_t j = first; j < (size_t)pieces; j++, made++) {
      double t = (double)j / pieces;
      since = (1 - t) * length;
      if (!x) continue;
      for (unsigned k = 0; k < 2; k++) x[2 * made + k] = j ? (1 - t) * a[k] + t * b[k] : a[k];
      if (j)
        edge_normal(a, b, outward + 2 * made);
      else
        vertex_normal(p, loop, i, outward + 2 * made);
    }
    if (first == 1 && pieces == 1) since += length;
  }
  return made;
}

batten_status loop_places_make(batten_context *ctx, const polygon_set *p, double step, double step_max,
                               loop_places *out) {
  loop_places made = {0};
  double perimeter;
  batten_status st = BATTEN_E_NOMEM;
  made.edge = batten_alloc_array(ctx, p->count, sizeof *made.edge);
  made.starts = batten_alloc_array(ctx, p->count + 1, sizeof *made.starts);
  if (!made.edge || !made.starts) goto done;
  if ((st = measure_edges(ctx, p, made.edge, &perimeter)) < 0) goto done;
  double least = perimeter / PLACES_MAX;
  made.starts[0] = 0;
  for (size_t loop = 0; loop < p->count; loop++)
    made.starts[loop + 1] =
        made.starts[loop] + walk(p, loop, fmax(fmin(step * made.edge[loop], step_max), least), NULL, NULL);
  made.count = made.starts[p->count];
  st = BATTEN_E_NOMEM;
  made.x = batten_alloc_array(ctx, made.count, 2 * sizeof *made.x);
  made.outward = batten_alloc_array(ctx, made.count, 2 * sizeof *made.outward);
  if (!made.x || !made.outward) goto done;
  for (size_t loop = 0; loop < p->count; loop++)
    walk(p, loop, fmax(fmin(step * made.edge[loop], step_max), least), made.x + 2 * made.starts[loop],
         made.outward + 2 * made.starts[loop]);
  *out = made;
  made = (loop_places){0};
  st = BATTEN_OK;
done:
  loop_places_free(ctx, &made);
  return st;
}

void loop_places_free(batten_context *ctx, loop_places *p) {
  batten_free(ctx, p->starts);
  batten_free(ctx, p->x);
  batten_free(ctx, p->outward);
  batten_free(ctx, p->edge);
  *p = (loop_places){0};
}

enum { OFFSETS_LEAST = 4, OFFSETS_MOST = 16 };

batten_status loop_places_beside(batten_context *ctx, const polygon_set *p, const loop_places *along, double near,
                                 size_t cells, double shift, double **out, size_t *out_count) {
  const double width = p->upper[0] - p->lower[0], height = p->upper[1] - p->lower[1];
  const double margin = 0.25 * hypot(width, height), cell = fmax(width, height) / (double)cells;
  const size_t columns = (size_t)((width + 2 * margin) / cell) + 1, rows = (size_t)((height + 2 * margin) / cell) + 1;
  size_t offsets = OFFSETS_LEAST;
  while (offsets < OFFSETS_MOST && near * (double)(1u << offsets) < cell) offsets++;
  double *x = batten_alloc_array(ctx, columns * rows + along->count * 2 * offsets, 2 * sizeof *x), *next = x;
  if (!x) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < columns * rows; i++) {
    *next++ = p->lower[0] - margin + ((double)(i % columns) + shift) * cell;
    *next++ = p->lower[1] - margin + ((double)(i / columns) + shift) * cell;
  }
  for (size_t i = 0; i < along->count; i++)
    for (size_t j = 0; j < 2 * offsets; j++) {
      double offset = (j % 2 ? -near : near) * (double)(1u << j / 2);
      for (unsigned k = 0; k < 2; k++) *next++ = along->x[2 * i + k] + offset * along->outward[2 * i + k];
    }
  *out = x;
  *out_count = (size_t)(next - x) / 2;
  return BATTEN_OK;
}
