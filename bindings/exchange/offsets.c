/* Sections of a hull from its table of offsets.
 *
 * Such a table has a half-breadth for each station and waterline, in the order of either, and 0 for waterlines that
 * pass below or above the section: of a run of zeros at the lower or upper end of a station only the last one before
 * the hull is a point of it. Zeros between points off the middle (over a bulb) stay: there the section lies on the
 * middle plane. */
#include "contours.h"

#include "base/checked.h"

#include <stdlib.h>

typedef struct offset {
  double station, half_breadth, waterline;
  size_t row;
} offset;

/* By station and waterline; rows of one place stay in their order. */
static int compare(const void *a, const void *b) {
  const offset *p = a, *q = b;
  if (p->station != q->station) return p->station < q->station ? -1 : 1;
  if (p->waterline != q->waterline) return p->waterline < q->waterline ? -1 : 1;
  return (p->row > q->row) - (p->row < q->row);
}

static bool is_middle(const offset *p) { return p->half_breadth == 0; }

/* p [*count] of one station, without what lies below and above the hull. */
static const offset *trim(const offset *p, size_t *count) {
  while (*count > 1 && is_middle(&p[0]) && is_middle(&p[1])) p++, --*count;
  while (*count > 1 && is_middle(&p[*count - 1]) && is_middle(&p[*count - 2])) --*count;
  return p;
}

static bool has_two_points(const offset *p, size_t count) {
  for (size_t i = 1; i < count; i++)
    if (p[i].half_breadth != p[0].half_breadth || p[i].waterline != p[0].waterline) return true;
  return false;
}

/* The lowest and the highest row of one station that lies on the middle plane, in order; how many rows: one, if they
 * are one place. 0: it does not lie there. */
static size_t take_stem(const offset *p, size_t count, size_t *order) {
  for (size_t i = 0; i < count; i++)
    if (!is_middle(&p[i])) return 0;
  order[0] = p[0].row;
  order[1] = p[count - 1].row;
  return p[count - 1].waterline > p[0].waterline ? 2 : 1;
}

batten_status bx_arrange_offsets(bx_reader *r, bool stems, size_t count, const double *rows, size_t width,
                                 size_t *order, size_t *starts, size_t *sections) {
  offset *all = batten_alloc_array(r->ctx, count, sizeof *all);
  if (!all) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < count; i++) all[i] = (offset){rows[i * width], rows[i * width + 1], rows[i * width + 2], i};
  qsort(all, count, sizeof *all, compare);
  size_t used = 0, made = 0, breadths = 0;
  for (size_t from = 0, to; from < count; from = to) {
    to = from + 1;
    while (to < count && all[to].station == all[from].station) to++;
    size_t points = to - from, line[2], stem = take_stem(all + from, points, line);
    if (stems && stem && (from == 0 || to == count)) {
      starts[made++] = used;
      for (size_t i = 0; i < stem; i++) order[used++] = line[i];
      continue;
    }
    const offset *p = trim(all + from, &points);
    if (!has_two_points(p, points)) continue;
    breadths++;
    starts[made++] = used;
    for (size_t i = 0; i < points; i++) order[used++] = p[i].row;
  }
  starts[made] = used;
  batten_free(r->ctx, all);
  if (breadths == 0)
    return batten_fail(r->ctx, BATTEN_E_FORMAT,
                       "%s: offsets: no station has two different points with a half-breadth between them; check the "
                       "columns of stations, waterlines and half-breadths",
                       bx_short_path(r->path));
  *sections = made;
  return BATTEN_OK;
}
