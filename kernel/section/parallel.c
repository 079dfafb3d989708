/* f in space where planes are parallel: a point's x and y are measured across the normal of the first section from
 * its origin, t runs with the height along that normal, straight from section to section. [Savchenko et al. 1995,
 * section 4] */
#include <math.h>
#include <string.h>

#include "section/section_inner.h"

enum { BLOCK = 1 << 17 }; /* points at a time: bounds the memory of a call; as large as stack_blend's */

/* Where a point is. */
enum { WITHIN = 0, BELOW, ABOVE, CLASSES };

typedef struct parallel_view {
  const stack *s;
  double *heights; /* [count] of the sections */
} parallel_view;

static double height_of(const stack *s, const double *p) {
  const stack_section *base = &s->sections[0];
  double h = 0;
  for (unsigned k = 0; k < 3; k++) h += (p[k] - base->origin[k]) * base->rotation[2][k];
  return h;
}

static batten_status view_make(const stack *s, batten_context *ctx, parallel_view *v) {
  *v = (parallel_view){.s = s, .heights = batten_alloc_array(ctx, s->count, sizeof *v->heights)};
  if (!v->heights) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < s->count; i++) v->heights[i] = height_of(s, s->sections[i].origin);
  return BATTEN_OK;
}

/* t at a height within the sections, exact at each of them; *rate: dt by height. It grows. */
static double t_of(const parallel_view *v, double height, double *rate) {
  size_t low = 0, high = v->s->count - 1;
  *rate = 1;
  if (high == 0) return v->s->sections[0].t;
  while (high - low > 1) {
    size_t middle = low + (high - low) / 2;
    if (height < v->heights[middle])
      high = middle;
    else
      low = middle;
  }
  double h0 = v->heights[low], h1 = v->heights[high], t0 = v->s->sections[low].t, t1 = v->s->sections[high].t;
  *rate = (t1 - t0) / (h1 - h0);
  if (height >= h1) return t1;
  return fmin(t0 + (height - h0) * *rate, t1);
}

/* A block of points, those of a kind together. */
typedef struct parallel_block {
  uint32_t *order; /* [BLOCK] */
  size_t starts[CLASSES + 1];
  double *places;    /* [BLOCK][3]: x, y, t within the sections, x, y beyond them */
  double *beyond;    /* [BLOCK]: height from the first section, */
  double *rates;     /* [BLOCK]: dt by it */
  double *values;    /* [BLOCK] */
  double *gradients; /* [BLOCK][3], or NULL */
} parallel_block;

static void block_free(batten_context *ctx, parallel_block *b) {
  batten_free(ctx, b->order);
  batten_free(ctx, b->places);
  batten_free(ctx, b->beyond);
  batten_free(ctx, b->rates);
  batten_free(ctx, b->values);
  batten_free(ctx, b->gradients);
}

/* To be freed whatever comes of it. */
static batten_status block_make(batten_context *ctx, size_t count, bool gradients, parallel_block *b) {
  *b = (parallel_block){0};
  b->order = batten_alloc_array(ctx, count, sizeof *b->order);
  b->places = batten_alloc_array(ctx, count, 3 * sizeof *b->places);
  b->beyond = batten_alloc_array(ctx, count, sizeof *b->beyond);
  b->rates = batten_alloc_array(ctx, count, sizeof *b->rates);
  b->values = batten_alloc_array(ctx, count, sizeof *b->values);
  if (gradients) b->gradients = batten_alloc_array(ctx, count, 3 * sizeof *b->gradients);
  bool made = b->order && b->places && b->beyond && b->rates && b->values && (!gradients || b->gradients);
  return made ? BATTEN_OK : BATTEN_E_NOMEM;
}

static void sort_points(const parallel_view *v, size_t count, const double *points, parallel_block *b) {
  const stack_section *base = &v->s->sections[0];
  double top = v->heights[v->s->count - 1];
  size_t made = 0;
  for (unsigned kind = 0; kind < CLASSES; kind++) {
    b->starts[kind] = made;
    for (size_t i = 0; i < count; i++) {
      const double *p = points + 3 * i;
      double height = height_of(v->s, p), x[2];
      if (kind != (height < 0 ? BELOW : height > top ? ABOVE : WITHIN)) continue;
      for (unsigned k = 0; k < 2; k++) {
        x[k] = 0;
        for (unsigned j = 0; j < 3; j++) x[k] += (p[j] - base->origin[j]) * base->rotation[k][j];
      }
      double *place = b->places + (kind == WITHIN ? 3 * made : 3 * b->starts[kind] + 2 * (made - b->starts[kind]));
      memcpy(place, x, sizeof x);
      if (kind == WITHIN) place[2] = t_of(v, height, &b->rates[made]);
      b->beyond[made] = height;
      b->order[made++] = (uint32_t)i;
    }
  }
  b->starts[CLASSES] = made;
}

/* The blend at all places of the block: gradients by x, y, height. */
static batten_status block_blend(const parallel_view *v, batten_context *ctx, parallel_block *b) {
  const size_t *starts = b->starts;
  double *g = b->gradients;
  batten_status st = stack_blend(v->s, ctx, starts[1], b->places, b->values, g);
  for (size_t i = 0; i < starts[1] && g && st >= 0; i++) g[3 * i + 2] *= b->rates[i];
  for (unsigned kind = BELOW; kind <= ABOVE && st >= 0; kind++) {
    size_t first = starts[kind], count = starts[kind + 1] - first, at = kind == BELOW ? 0 : v->s->count - 1;
    if (count == 0) continue;
    double *slopes = g ? g + 3 * first : NULL;
    st = stack_section_evaluate(v->s, ctx, at, count, b->places + 3 * first, b->values + first, slopes);
    for (size_t i = count; i-- > 0 && g && st >= 0;) { /* two apart become three apart, from behind */
      const double d[3] = {slopes[2 * i], slopes[2 * i + 1], 0};
      memcpy(slopes + 3 * i, d, sizeof d);
    }
  }
  return st;
}

/* The rules of the ends at one place. */
static void close_ends(const parallel_view *v, const double *x, double height, double *value, double *gradient) {
  for (unsigned end = 0; end < 2; end++) {
    size_t at = end ? v->s->count - 1 : 0;
    double shift[2], sign = end ? 1 : -1, beyond = sign * (height - v->heights[at]);
    stack_shift(v->s, at, shift);
    const double own[2] = {x[0] - shift[0], x[1] - shift[1]};
    if (gradient) gradient[2] *= sign;
    stack_end_apply(v->s, end, own, beyond, value, gradient);
    if (gradient) gradient[2] *= sign;
  }
}

static void block_return(const parallel_view *v, const parallel_block *b, double *values, double *gradients) {
  const stack_section *base = &v->s->sections[0];
  for (unsigned kind = 0; kind < CLASSES; kind++)
    for (size_t i = b->starts[kind]; i < b->starts[kind + 1]; i++) {
      size_t first = b->starts[kind], point = b->order[i];
      const double *x = b->places + 3 * first + (kind == WITHIN ? 3 : 2) * (i - first);
      double *g = b->gradients ? b->gradients + 3 * i : NULL;
      close_ends(v, x, b->beyond[i], &b->values[i], g);
      if (values) values[point] = b->values[i];
      for (unsigned k = 0; k < 3 && gradients; k++) {
        double sum = 0;
        for (unsigned j = 0; j < 3; j++) sum += g[j] * base->rotation[j][k];
        gradients[3 * point + k] = sum;
      }
    }
}

batten_status stack_parallel_evaluate(const stack *s, batten_context *ctx, size_t count, const double *points,
                                      double *values, double *gradients) {
  parallel_view v;
  parallel_block b = {0};
  batten_status st = view_make(s, ctx, &v);
  if (st >= 0) st = block_make(ctx, count < BLOCK ? count : BLOCK, gradients != NULL, &b);
  for (size_t from = 0; from < count && st >= 0; from += BLOCK) {
    size_t some = count - from < BLOCK ? count - from : BLOCK;
    sort_points(&v, some, points + 3 * from, &b);
    st = block_blend(&v, ctx, &b);
    if (st >= 0) block_return(&v, &b, values ? values + from : NULL, gradients ? gradients + 3 * from : NULL);
  }
  block_free(ctx, &b);
  batten_free(ctx, v.heights);
  return st;
}

/* ---- bounds --------------------------------------------------------------------------------------- */

/* Coordinate k of the points of a box. */
static interval coordinate(const stack *s, unsigned k, const double *box) {
  const stack_section *base = &s->sections[0];
  interval sum = {0, 0};
  for (unsigned j = 0; j < 3; j++) {
    interval d = interval_sub((interval){box[j], box[3 + j]}, interval_of(base->origin[j]));
    if (base->rotation[k][j] != 0) sum = interval_add(sum, interval_scale(d, base->rotation[k][j]));
  }
  return sum;
}

batten_status stack_parallel_bounds(const stack *s, batten_context *ctx, size_t count, const double *boxes,
                                    double *ranges) {
  parallel_view v;
  batten_status st = view_make(s, ctx, &v);
  double *places = st >= 0 ? batten_alloc_array(ctx, count, 6 * sizeof *places) : NULL;
  if (!places) {
    st = BATTEN_E_NOMEM;
    goto done;
  }
  double top = v.heights[s->count - 1];
  for (size_t i = 0; i < count; i++) {
    interval height = coordinate(s, 2, boxes + 6 * i);
    double *place = places + 6 * i, rate;
    for (unsigned k = 0; k < 2; k++) {
      interval x = coordinate(s, k, boxes + 6 * i);
      place[k] = x.lo;
      place[3 + k] = x.hi;
    }
    /* t_of grows with the height in each gap up to its end, rounding included */
    place[2] = t_of(&v, fmin(fmax(height.lo, 0), top), &rate);
    place[5] = t_of(&v, fmin(fmax(height.hi, 0), top), &rate);
  }
  st = stack_blend_bounds(s, ctx, count, places, ranges);
  for (size_t i = 0; i < count && st >= 0; i++) {
    interval height = coordinate(s, 2, boxes + 6 * i), value = {ranges[2 * i], ranges[2 * i + 1]};
    value = stack_end_bounds(s, 0, value, interval_neg(height));
    value = stack_end_bounds(s, 1, value, interval_sub(height, interval_of(top)));
    ranges[2 * i] = value.lo;
    ranges[2 * i + 1] = value.hi;
  }
done:
  batten_free(ctx, places);
  batten_free(ctx, v.heights);
  return st;
}
