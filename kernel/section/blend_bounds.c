/* Bounds of F(x, y, t) over boxes: those of the sections' functions over the boxes' x and y, blended along t
 * (stack_weigh_bounds). As in blend.c the sections take all the time, and boxes that come together often share x and
 * y: boxes are sorted, and each section is asked once for boxes that are the same to it. */
#include <math.h>
#include <string.h>

#include "basis/sort_points.h"
#include "section/section_inner.h"

enum {
  BLOCK = 1 << 15, /* boxes that are sorted together */
  BATCH = 1024,    /* columns asked together; their sections: */
  ROOM = BATCH * STACK_WINDOW
};

/* Boxes of one x and y whose sections join. */
typedef struct box_column {
  size_t first, count; /* boxes, in the sorted order */
  size_t low, high;    /* sections */
  size_t offset;       /* of the section low in the table */
} box_column;

typedef struct bounds_batch {
  const stack *s;
  const double *keys;    /* [block][6]: x and y of the lower, of the upper corner, t of both */
  const uint32_t *order; /* [block] */
  double *ranges;        /* of the block */
  size_t columns, room;  /* room of the table */
  box_column *column;    /* [BATCH] */
  interval *table;       /* [room], by column and section */
  double *asked, *answer;
} bounds_batch;

/* Sections that count for a box. A box in the plane of a section, as those beyond the ends are, needs that one. */
static void box_sections(const stack *s, const double *key, size_t *low, size_t *high) {
  size_t first, last, count = stack_window(s->weights, key[5], &last);
  *high = last + count - 1;
  count = stack_window(s->weights, key[4], &first);
  *low = first;
  for (size_t i = first; key[4] == key[5] && i < first + count; i++)
    if (s->sections[i].t == key[4]) *low = *high = i;
}

/* Takes columns from box `from` of the sorted order on; returns the box behind. One box always fits. */
static size_t take_columns(bounds_batch *b, size_t from, size_t count) {
  size_t used = 0, taken = from;
  box_column *last = NULL;
  b->columns = 0;
  for (; taken < count; taken++) {
    const double *key = b->keys + 6 * (size_t)b->order[taken];
    size_t low, high;
    box_sections(b->s, key, &low, &high);
    bool same = last && memcmp(key, b->keys + 6 * (size_t)b->order[last->first], 4 * sizeof *key) == 0;
    if (same && low >= last->low && low <= last->high + 1) {
      size_t more = high > last->high ? high - last->high : 0;
      if (used + more > b->room) break;
      used += more;
      last->high += more;
      last->count++;
      continue;
    }
    if (b->columns == BATCH || used + (high - low + 1) > b->room) break;
    last = &b->column[b->columns++];
    *last = (box_column){.first = taken, .count = 1, .low = low, .high = high, .offset = used};
    used += high - low + 1;
  }
  return taken;
}

static batten_status ask_section(bounds_batch *b, batten_context *ctx, size_t i) {
  size_t asked = 0;
  for (size_t c = 0; c < b->columns; c++) {
    const box_column *at = &b->column[c];
    if (i < at->low || i > at->high) continue;
    memcpy(b->asked + 4 * asked++, b->keys + 6 * (size_t)b->order[at->first], 4 * sizeof *b->asked);
  }
  if (asked == 0) return BATTEN_OK;
  batten_status st = stack_section_bounds(b->s, ctx, i, asked, b->asked, b->answer);
  asked = 0;
  for (size_t c = 0; c < b->columns && st >= 0; c++) {
    const box_column *at = &b->column[c];
    if (i < at->low || i > at->high) continue;
    b->table[at->offset + (i - at->low)] = (interval){b->answer[2 * asked], b->answer[2 * asked + 1]};
    asked++;
  }
  return st;
}

static void blend_columns(const bounds_batch *b) {
  for (size_t c = 0; c < b->columns; c++) {
    const box_column *at = &b->column[c];
    for (size_t k = at->first; k < at->first + at->count; k++) {
      size_t box = b->order[k], low, high;
      const double *key = b->keys + 6 * box;
      box_sections(b->s, key, &low, &high);
      const interval *f = b->table + at->offset + (low - at->low);
      interval r = low == high ? *f : stack_weigh_bounds(b->s->weights, key[4], key[5], low, f);
      b->ranges[2 * box] = r.lo;
      b->ranges[2 * box + 1] = r.hi;
    }
  }
}

static batten_status bounds_block(bounds_batch *b, batten_context *ctx, size_t count) {
  for (size_t from = 0; from < count;) {
    from = take_columns(b, from, count);
    size_t low = SIZE_MAX, high = 0;
    for (size_t c = 0; c < b->columns; c++) {
      low = b->column[c].low < low ? b->column[c].low : low;
      high = b->column[c].high > high ? b->column[c].high : high;
    }
    for (size_t i = low; i <= high; i++) {
      batten_status st = ask_section(b, ctx, i);
      if (st < 0) return st;
    }
    blend_columns(b);
  }
  return BATTEN_OK;
}

/* Ranges [count] rise where boxes lie between sections with links. */
static batten_status join_links(const stack *s, batten_context *ctx, size_t count, const double *boxes,
                                double *ranges) {
  size_t n = count < BATCH ? count : BATCH;
  batten_status st = BATTEN_E_NOMEM;
  double *parts = batten_alloc_array(ctx, n, 6 * sizeof *parts), *own = batten_alloc_array(ctx, n, 2 * sizeof *own);
  uint32_t *index = batten_alloc_array(ctx, n, sizeof *index);
  if (!parts || !own || !index) goto done;
  st = BATTEN_OK;
  for (size_t k = 0; k < s->link_count && st >= 0; k++) {
    size_t at = s->links[k].section, asked = 0;
    double t0 = s->sections[at].t, t1 = s->sections[at + 1].t;
    if (k > 0 && s->links[k - 1].section == at) continue;
    for (size_t i = 0; i < count && st >= 0; i++) {
      const double *box = boxes + 6 * i;
      if (box[2] < t1 && box[5] > t0) {
        double u0 = (box[2] - t0) / (t1 - t0), u1 = (box[5] - t0) / (t1 - t0);
        memcpy(own + 2 * asked, ranges + 2 * i, 2 * sizeof *own);
        memcpy(parts + 6 * asked, (double[6]){box[0], box[1], u0, box[3], box[4], u1}, 6 * sizeof *parts);
        index[asked++] = (uint32_t)i;
      }
      if (asked == 0 || (asked < n && i + 1 < count)) continue;
      st = stack_link_bounds(s, ctx, at, asked, parts, own);
      for (size_t j = 0; j < asked && st >= 0; j++)
        memcpy(ranges + 2 * (size_t)index[j], own + 2 * j, 2 * sizeof *own);
      asked = 0;
    }
  }
done:
  batten_free(ctx, parts);
  batten_free(ctx, own);
  batten_free(ctx, index);
  return st;
}

batten_status stack_blend_bounds(const stack *s, batten_context *ctx, size_t count, const double *boxes,
                                 double *ranges) {
  if (count == 0) return BATTEN_OK;
  size_t block = count < BLOCK ? count : BLOCK, columns = count < BATCH ? count : BATCH;
  batten_status st = BATTEN_E_NOMEM;
  double *keys = batten_alloc_array(ctx, block, 6 * sizeof *keys);
  uint32_t *order = batten_alloc_array(ctx, block, sizeof *order);
  bounds_batch b = {.s = s, .keys = keys, .order = order, .room = s->count > ROOM ? s->count : ROOM};
  if (s->count <= b.room / columns) b.room = s->count * columns;
  b.column = batten_alloc_array(ctx, columns, sizeof *b.column);
  b.table = batten_alloc_array(ctx, b.room, sizeof *b.table);
  b.asked = batten_alloc_array(ctx, columns, 4 * sizeof *b.asked);
  b.answer = batten_alloc_array(ctx, columns, 2 * sizeof *b.answer);
  if (!keys || !order || !b.column || !b.table || !b.asked || !b.answer) goto done;
  st = BATTEN_OK;
  for (size_t from = 0; from < count && st >= 0; from += block) {
    size_t some = count - from < block ? count - from : block;
    for (size_t i = 0; i < some; i++) {
      const double *box = boxes + 6 * (from + i);
      memcpy(keys + 6 * i, (double[6]){box[0], box[1], box[3], box[4], box[2], box[5]}, 6 * sizeof *keys);
    }
    b.ranges = ranges + 2 * from;
    st = batten_sort_points(ctx, 6, some, keys, order);
    if (st >= 0) st = bounds_block(&b, ctx, some);
    if (st >= 0 && s->link_count) st = join_links(s, ctx, some, boxes + 6 * from, ranges + 2 * from);
  }
done:
  batten_free(ctx, keys);
  batten_free(ctx, order);
  batten_free(ctx, b.column);
  batten_free(ctx, b.table);
  batten_free(ctx, b.asked);
  batten_free(ctx, b.answer);
  return st;
}
