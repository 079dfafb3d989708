/* F(x, y, t): the functions of the sections, scaled, saturated and blended along t.
 *                                                                     [Savchenko et al. 1995, section 4]
 *
 * A cubic spline along t asks 34 sections for one place, and each of their functions costs as much as a plane spline
 * of some hundred centres: all the time goes there. Places that come together often share x and y (the grids of a
 * polygoniser stand in columns along t), so places are sorted, each column (x, y) asks each section that its places
 * need once, and each section is asked for all columns of a batch at once, which its own threads share. */
#include <math.h>
#include <string.h>

#include "basis/sort_points.h"
#include "section/section_inner.h"

enum {
  BLOCK = 1 << 17, /* places that are sorted together: bounds the memory of a call */
  BATCH = 2048,    /* columns at a time: 34 values and gradients each, 1.7 MB */
  TASK = 64        /* columns a task: 34 tanh a column and as many products a place last longer than its start */
};

void stack_shift(const stack *s, size_t i, double shift[2]) {
  const stack_section *base = &s->sections[0], *at = &s->sections[i];
  for (unsigned k = 0; k < 2; k++) {
    shift[k] = 0;
    for (unsigned j = 0; j < 3 && s->parallel; j++)
      shift[k] += (at->origin[j] - base->origin[j]) * base->rotation[k][j];
  }
}

/* ---- one section ---------------------------------------------------------------------------------- */

double stack_shape(const stack_section *section, double f, double *slope) {
  double value = section->scale * f;
  *slope = section->scale;
  if (section->saturation < INFINITY) {
    double share = tanh(value / section->saturation);
    value = section->saturation * share;
    *slope *= 1 - share * share;
  }
  return value;
}

/* Minus the distance to an apex, a point or a line between two. */
static double apex_value(const stack_section *at, const double x[2], double *gradient) {
  double near[2] = {at->apex[0][0], at->apex[0][1]};
  if (at->apex_count == 2) {
    const double *a = at->apex[0], *b = at->apex[1];
    double along[2] = {b[0] - a[0], b[1] - a[1]}, square = along[0] * along[0] + along[1] * along[1];
    double u = square > 0 ? ((x[0] - a[0]) * along[0] + (x[1] - a[1]) * along[1]) / square : 0;
    u = fmax(0, fmin(1, u));
    for (unsigned k = 0; k < 2; k++) near[k] = (1 - u) * a[k] + u * b[k];
  }
  double d = hypot(x[0] - near[0], x[1] - near[1]);
  for (unsigned k = 0; k < 2 && gradient; k++) gradient[k] = d > 0 ? -(x[k] - near[k]) / d : 0;
  return -d;
}

/* The function itself, before it is shaped; places are the section's own. */
static batten_status section_values(const stack_section *at, batten_context *ctx, size_t count, const double *places,
                                    double *values, double *gradients) {
  if (at->function) return batten_solid_evaluate(ctx, at->function, count, places, values, gradients, NULL);
  for (size_t p = 0; p < count; p++) values[p] = apex_value(at, places + 2 * p, gradients ? gradients + 2 * p : NULL);
  return BATTEN_OK;
}

batten_status stack_section_evaluate(const stack *s, batten_context *ctx, size_t i, size_t count,
                                     const double *places, double *values, double *gradients) {
  double shift[2], *own = batten_alloc_array(ctx, count, 2 * sizeof *own);
  if (!own) return BATTEN_E_NOMEM;
  stack_shift(s, i, shift);
  for (size_t p = 0; p < count; p++)
    for (unsigned k = 0; k < 2; k++) own[2 * p + k] = places[2 * p + k] - shift[k];
  batten_status st = section_values(&s->sections[i], ctx, count, own, values, gradients);
  for (size_t p = 0; p < count && st >= 0; p++) {
    double slope;
    values[p] = stack_shape(&s->sections[i], values[p], &slope);
    for (unsigned k = 0; k < 2 && gradients; k++) gradients[2 * p + k] *= slope;
  }
  batten_free(ctx, own);
  return st;
}

static interval shape_bounds(const stack_section *section, interval f) {
  f = interval_scale(f, section->scale);
  double w = section->saturation;
  return w < INFINITY ? interval_scale(interval_tanh(interval_div(f, interval_of(w))), w) : f;
}

/* Distances change by no more than their place moves: from the middle of the box to its corners. */
static interval apex_bounds(const stack_section *at, const double *box) {
  double middle[2] = {0.5 * (box[0] + box[2]), 0.5 * (box[1] + box[3])};
  double reach = hypot(0.5 * (box[2] - box[0]), 0.5 * (box[3] - box[1])), d = apex_value(at, middle, NULL);
  double size = fabs(box[0]) + fabs(box[1]) + fabs(box[2]) + fabs(box[3]);
  for (unsigned k = 0; k < at->apex_count; k++) size += fabs(at->apex[k][0]) + fabs(at->apex[k][1]);
  double slack = 16 * 0x1p-52 * size;
  return (interval){d - reach - slack, fmin(0, d + reach + slack)};
}

batten_status stack_section_bounds(const stack *s, batten_context *ctx, size_t i, size_t count, const double *boxes,
                                   double *ranges) {
  const stack_section *at = &s->sections[i];
  double shift[2], *own = batten_alloc_array(ctx, count, 4 * sizeof *own);
  if (!own) return BATTEN_E_NOMEM;
  stack_shift(s, i, shift); /* differences of doubles grow with them, rounded: corners are to be shifted as places */
  for (size_t b = 0; b < 2 * count; b++)
    for (unsigned k = 0; k < 2; k++) own[2 * b + k] = boxes[2 * b + k] - shift[k];
  batten_status st = at->function ? batten_solid_bounds(ctx, at->function, count, own, ranges) : BATTEN_OK;
  for (size_t b = 0; b < count && st >= 0; b++) {
    interval f = at->function ? (interval){ranges[2 * b], ranges[2 * b + 1]} : apex_bounds(at, own + 4 * b);
    f = shape_bounds(at, f);
    ranges[2 * b] = f.lo;
    ranges[2 * b + 1] = f.hi;
  }
  batten_free(ctx, own);
  return st;
}

/* ---- batches of columns --------------------------------------------------------------------------- */

/* Places of one (x, y) whose windows of sections join. */
typedef struct column {
  double x[2];
  size_t first, count; /* places, in the sorted order */
  size_t low, high;    /* sections */
  size_t offset;       /* of the section low in the table */
} column;

typedef struct blend_batch {
  const stack *s;
  const double *places; /* of the block */
  const uint32_t *order;
  double *values, *gradients; /* of the block; gradients may be NULL */
  size_t columns, capacity;   /* capacity of columns; of the table: 34 times as much */
  column *column;
  double *table, *slopes; /* by column and section: function, its gradient */
  double *asked, *answer, *answer_slopes;
} blend_batch;

static void batch_free(batten_context *ctx, blend_batch *b) {
  batten_free(ctx, b->column);
  batten_free(ctx, b->table);
  batten_free(ctx, b->slopes);
  batten_free(ctx, b->asked);
  batten_free(ctx, b->answer);
  batten_free(ctx, b->answer_slopes);
}

/* To be freed whatever comes of it. */
static batten_status batch_make(batten_context *ctx, const stack *s, size_t count, bool gradients, blend_batch *b) {
  size_t n = count < BATCH ? count : BATCH, width = s->count < STACK_WINDOW ? s->count : STACK_WINDOW;
  *b = (blend_batch){.s = s, .capacity = n};
  b->column = batten_alloc_array(ctx, n, sizeof *b->column);
  b->table = batten_alloc_array(ctx, n, width * sizeof *b->table);
  b->asked = batten_alloc_array(ctx, n, 2 * sizeof *b->asked);
  b->answer = batten_alloc_array(ctx, n, sizeof *b->answer);
  if (gradients) {
    b->slopes = batten_alloc_array(ctx, n, 2 * width * sizeof *b->slopes);
    b->answer_slopes = batten_alloc_array(ctx, n, 2 * sizeof *b->answer_slopes);
  }
  bool made = b->column && b->table && b->asked && b->answer && (!gradients || (b->slopes && b->answer_slopes));
  return made ? BATTEN_OK : BATTEN_E_NOMEM;
}

/* Takes columns from place `from` of the sorted order on until the batch is full; returns the place behind. A column
 * takes no more room in the table than its places would apart: its windows join. */
static size_t take_columns(blend_batch *b, size_t from, size_t count) {
  size_t offset = 0, taken = from;
  b->columns = 0;
  column *last = NULL;
  for (; taken < count && taken - from < b->capacity; taken++) {
    const double *p = b->places + 3 * (size_t)b->order[taken];
    size_t low, high = stack_window(b->s->weights, p[2], &low);
    high += low - 1;
    if (last && last->x[0] == p[0] && last->x[1] == p[1] && low <= last->high + 1) {
      offset += high - last->high; /* t grows, and so does high */
      last->high = high;
      last->count++;
      continue;
    }
    last = &b->column[b->columns++];
    *last = (column){.x = {p[0], p[1]}, .first = taken, .count = 1, .low = low, .high = high, .offset = offset};
    offset += high - low + 1;
  }
  return taken;
}

/* Asks section i for all columns that need it. */
static batten_status ask_section(blend_batch *b, batten_context *ctx, size_t i) {
  double shift[2];
  size_t asked = 0;
  stack_shift(b->s, i, shift);
  for (size_t c = 0; c < b->columns; c++) {
    const column *at = &b->column[c];
    if (i < at->low || i > at->high) continue;
    for (unsigned k = 0; k < 2; k++) b->asked[2 * asked + k] = at->x[k] - shift[k];
    asked++;
  }
  if (asked == 0) return BATTEN_OK;
  batten_status st =
      section_values(&b->s->sections[i], ctx, asked, b->asked, b->answer, b->slopes ? b->answer_slopes : NULL);
  if (st < 0) return st;
  asked = 0;
  for (size_t c = 0; c < b->columns; c++) {
    const column *at = &b->column[c];
    if (i < at->low || i > at->high) continue;
    size_t entry = at->offset + (i - at->low);
    b->table[entry] = b->answer[asked];
    if (b->slopes) memcpy(b->slopes + 2 * entry, b->answer_slopes + 2 * asked, 2 * sizeof *b->slopes);
    asked++;
  }
  return BATTEN_OK;
}

/* Shapes the table's rows of some columns and blends them at their places. */
static void blend_task(void *arg, size_t index) {
  const blend_batch *b = arg;
  size_t end = (index + 1) * TASK < b->columns ? (index + 1) * TASK : b->columns;
  for (size_t c = index * TASK; c < end; c++) {
    const column *at = &b->column[c];
    double *table = b->table + at->offset, *slopes = b->slopes ? b->slopes + 2 * at->offset : NULL;
    for (size_t i = at->low; i <= at->high; i++) {
      double slope, *f = &table[i - at->low];
      *f = stack_shape(&b->s->sections[i], *f, &slope);
      for (unsigned k = 0; k < 2 && slopes; k++) slopes[2 * (i - at->low) + k] *= slope;
    }
    for (size_t p = at->first; p < at->first + at->count; p++) {
      size_t place = b->order[p], low, count = stack_window(b->s->weights, b->places[3 * place + 2], &low);
      double weights[STACK_WINDOW], dt;
      b->values[place] =
          stack_weigh(b->s->weights, b->places[3 * place + 2], table + (low - at->low), &dt, slopes ? weights : NULL);
      if (!slopes) continue;
      double sum[2] = {0, 0};
      const double *d = slopes + 2 * (low - at->low);
      for (size_t i = 0; i < count; i++, d += 2) {
        sum[0] += weights[i] * d[0];
        sum[1] += weights[i] * d[1];
      }
      memcpy(b->gradients + 3 * place, (double[3]){sum[0], sum[1], dt}, 3 * sizeof dt);
    }
  }
}

static batten_status blend_block(blend_batch *b, batten_context *ctx, size_t count) {
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
    batten_parallel(ctx, (b->columns + TASK - 1) / TASK, blend_task, b);
  }
  return BATTEN_OK;
}

/* ---- links ---------------------------------------------------------------------------------------- */

/* Places between section `at` and the next one, asked of its links at once. */
typedef struct link_batch {
  uint32_t *index;                    /* [BATCH] of the places */
  double *x, *u, *values, *gradients; /* gradients NULL: not wanted */
} link_batch;

static batten_status ask_links(const stack *s, batten_context *ctx, size_t at, size_t count, const link_batch *b,
                               const double *places, double *values, double *gradients) {
  double t = s->sections[at].t, gap = s->sections[at + 1].t - t;
  for (size_t i = 0; i < count; i++) {
    size_t p = b->index[i];
    memcpy(b->x + 2 * i, places + 3 * p, 2 * sizeof *b->x);
    b->u[i] = (places[3 * p + 2] - t) / gap;
    b->values[i] = values[p];
    if (!gradients) continue;
    memcpy(b->gradients + 3 * i, gradients + 3 * p, 3 * sizeof *gradients);
    b->gradients[3 * i + 2] *= gap;
  }
  batten_status st = stack_link_evaluate(s, ctx, at, count, b->x, b->u, b->values, b->gradients);
  for (size_t i = 0; i < count && st >= 0; i++) {
    size_t p = b->index[i];
    if (b->values[i] == values[p]) continue; /* no link, and its gradient keeps its bits */
    values[p] = b->values[i];
    if (!gradients) continue;
    memcpy(gradients + 3 * p, b->gradients + 3 * i, 3 * sizeof *gradients);
    gradients[3 * p + 2] /= gap;
  }
  return st;
}

static batten_status join_links(const stack *s, batten_context *ctx, size_t count, const double *places,
                                double *values, double *gradients) {
  size_t n = count < BATCH ? count : BATCH;
  batten_status st = BATTEN_E_NOMEM;
  link_batch b = {.index = batten_alloc_array(ctx, n, sizeof *b.index)};
  b.x = batten_alloc_array(ctx, n, 2 * sizeof *b.x);
  b.u = batten_alloc_array(ctx, n, sizeof *b.u);
  b.values = batten_alloc_array(ctx, n, sizeof *b.values);
  if (gradients) b.gradients = batten_alloc_array(ctx, n, 3 * sizeof *b.gradients);
  if (!b.index || !b.x || !b.u || !b.values || (gradients && !b.gradients)) goto done;
  st = BATTEN_OK;
  for (size_t k = 0; k < s->link_count && st >= 0; k++) { /* by section: the links of one are asked together */
    size_t at = s->links[k].section, asked = 0;
    if (k > 0 && s->links[k - 1].section == at) continue;
    for (size_t p = 0; p < count && st >= 0; p++) {
      if (places[3 * p + 2] > s->sections[at].t && places[3 * p + 2] < s->sections[at + 1].t)
        b.index[asked++] = (uint32_t)p; /* on the planes links add nothing */
      if (asked < n && p + 1 < count) continue;
      if (asked) st = ask_links(s, ctx, at, asked, &b, places, values, gradients);
      asked = 0;
    }
  }
done:
  batten_free(ctx, b.index);
  batten_free(ctx, b.x);
  batten_free(ctx, b.u);
  batten_free(ctx, b.values);
  batten_free(ctx, b.gradients);
  return st;
}

batten_status stack_blend(const stack *s, batten_context *ctx, size_t count, const double *places, double *values,
                          double *gradients) {
  if (count == 0) return BATTEN_OK;
  blend_batch batch;
  batten_status st = batch_make(ctx, s, count, gradients != NULL, &batch);
  uint32_t *order = st < 0 ? NULL : batten_alloc_array(ctx, count < BLOCK ? count : BLOCK, sizeof *order);
  if (!order) st = BATTEN_E_NOMEM;
  for (size_t from = 0; from < count && st >= 0; from += BLOCK) {
    size_t some = count - from < BLOCK ? count - from : BLOCK;
    batch.places = places + 3 * from;
    batch.order = order;
    batch.values = values + from;
    batch.gradients = gradients ? gradients + 3 * from : NULL;
    st = batten_sort_points(ctx, 3, some, batch.places, order);
    if (st >= 0) st = blend_block(&batch, ctx, some);
    if (st >= 0 && s->link_count) st = join_links(s, ctx, some, batch.places, batch.values, batch.gradients);
  }
  batten_free(ctx, order);
  batch_free(ctx, &batch);
  return st;
}
