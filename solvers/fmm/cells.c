/* What is done with the numbers of one cell: moments and far fields on the way up, translations, expansions. Plans
 * (passes.c) do it for all cells of their tree, evaluators (nodes.c) for the cells that are asked for. */
#include "fmm/fmm_inner.h"

#include "base/checked.h"

#include <string.h>

enum { BATCH = 48, NODE_ARRAYS = 6 };

size_t batten_fmm_scratch(const fmm_operators *o) {
  const size_t across = 2 * BATCH * o->stride, others = NODE_ARRAYS * o->full + 8 * o->full / o->order;
  return across > others ? across : others;
}

/* ---- sources ---- */

void batten_fmm_set_terms(const fmm_points *points, const uint32_t *place, unsigned n, size_t sources,
                          const double *weights, const double *dipoles, double *to, fmm_terms *terms) {
  const size_t count = points->count;
  memset(to, 0, count * (dipoles ? 1 + n : 1) * sizeof *to);
  *terms = (fmm_terms){.w = to};
  for (unsigned a = 0; a < n; a++) {
    terms->x[a] = points->x[a];
    terms->g[a] = dipoles ? to + (1 + a) * count : NULL;
  }
  for (size_t i = 0; i < sources; i++) {
    const size_t j = place ? place[i] : i;
    if (weights) to[j] += weights[i];
    for (unsigned a = 0; a < n && dipoles; a++) to[(1 + a) * count + j] += dipoles[i * n + a];
  }
}

/* ---- tensors ---- */

/* Moves a tensor between a child and its parent: one axis after the other, by the side on which the child lies. */
const double *batten_fmm_shift(const fmm_far *f, const fmm_frame *child, const fmm_frame *parent,
                               const double (*matrices)[FMM_ORDER_MAX][FMM_ORDER_MAX], const double *tensor,
                               double *a, double *b) {
  const fmm_operators *o = f->o;
  for (unsigned k = 0; k < o->n; k++) {
    const unsigned side = child->centre[k] > parent->centre[k];
    double *to = k % 2 ? b : a;
    f->lanes->contract(o->order, o->full / o->order, matrices[side], tensor, to);
    tensor = to;
  }
  return tensor;
}

double *batten_fmm_through(const fmm_far *f, const double (*matrix)[FMM_ORDER_MAX], double *from, double *to) {
  const fmm_operators *o = f->o;
  for (unsigned k = 0; k < o->n; k++) {
    f->lanes->contract(o->order, o->full / o->order, matrix, from, to);
    double *t = from;
    from = to, to = t;
  }
  return from;
}

void batten_fmm_place_nodes(const fmm_operators *o, const fmm_frame *frame, size_t first, size_t count,
                            double *x[3]) {
  for (size_t i = 0; i < count; i++) {
    size_t rest = first + i;
    for (unsigned a = o->n; a-- > 0; rest /= o->order)
      x[a][i] = frame->centre[a] + frame->half * o->node[rest % o->order];
  }
}

/* ---- up ---- */

static void compress(const fmm_far *f, const double *tensor, double *outer, double *spare) {
  const fmm_operators *o = f->o;
  memset(outer, 0, o->stride * sizeof *outer);
  for (size_t i = 0; i < o->full; i++) spare[i] = tensor[o->members[i]];
  for (unsigned c = 0; c < o->classes; spare += o->class_full[c++])
    f->lanes->combine(o->class_full[c], o->class_rank[c], o->reduce[c], spare, outer + o->class_place[c]);
}

/* Moments and far field of a cell whose children have theirs. */
static void climb(const fmm_far *f, const fmm_tree *tree, const fmm_terms *terms, int dipoles, size_t index,
                  double *tensors, double *outer, double *scratch) {
  const fmm_operators *o = f->o;
  const fmm_cell *c = &tree->cell[index];
  double *a = scratch, *b = a + o->full, *rows = b + o->full, *tensor = tensors + index * o->full;
  if (c->s0 == c->s1) return;
  memset(tensor, 0, o->full * sizeof *tensor);
  if (fmm_is_leaf(c)) f->lanes->moments(o->n, o->order, &c->frame, dipoles, terms, c->s0, c->s1, tensor, rows);
  for (uint32_t k = c->child; k < c->child + c->children; k++) {
    const fmm_cell *child = &tree->cell[k];
    if (child->s0 == child->s1) continue;
    const double *moved =
        batten_fmm_shift(f, &child->frame, &c->frame, (const double(*)[FMM_ORDER_MAX][FMM_ORDER_MAX])o->up,
                         tensors + k * o->full, a, b);
    for (size_t q = 0; q < o->full; q++) tensor[q] += moved[q];
  }
  compress(f, tensor, outer + index * o->stride, a);
}

typedef struct climber {
  const fmm_far *f;
  const fmm_tree *tree;
  const fmm_terms *terms;
  int dipoles;
  double *tensors, *outer, *scratch;
  size_t scratch_each, first, last; /* cells of the level, from those of the group on */
} climber;

static void climb_task(void *arg, size_t index) {
  const climber *c = arg;
  const size_t begin = c->first + index * FMM_CELLS_TOGETHER;
  for (size_t i = begin; i < begin + FMM_CELLS_TOGETHER && i < c->last; i++)
    climb(c->f, c->tree, c->terms, c->dipoles, i, c->tensors, c->outer, c->scratch + index * c->scratch_each);
}

batten_status batten_fmm_climb(batten_context *ctx, const fmm_far *f, const fmm_tree *tree, const fmm_terms *terms,
                               int dipoles, double *tensors, double *outer, double *scratch) {
  climber c = {f, tree, terms, dipoles, tensors, outer, scratch, batten_fmm_scratch(f->o), 0, 0};
  batten_status st = BATTEN_OK;
  for (unsigned level = tree->levels; level-- > 0;) {
    c.last = tree->level_first[level + 1];
    for (c.first = tree->level_first[level]; c.first < c.last; c.first += FMM_GROUP * FMM_CELLS_TOGETHER) {
      if ((st = batten_progress(ctx, "sums", 0)) < 0) return st;
      const size_t tasks = (c.last - c.first + FMM_CELLS_TOGETHER - 1) / FMM_CELLS_TOGETHER;
      batten_parallel(ctx, tasks < FMM_GROUP ? tasks : FMM_GROUP, climb_task, &c);
    }
  }
  return st;
}

/* ---- across ---- */

unsigned batten_fmm_kind(unsigned n, const fmm_frame *target, const fmm_frame *source, uint32_t *mirror) {
  unsigned kind = 0;
  *mirror = 0;
  for (unsigned a = 0; a < n; a++) {
    const int steps = (int)lround((target->centre[a] - source->centre[a]) / (2 * target->half));
    kind |= (unsigned)(steps < 0 ? -steps : steps) << 2 * a;
    *mirror |= (uint32_t)(steps < 0) << a;
  }
  return kind;
}

/* +-factor by the parity of class c and the mirrored axes. */
static double signed_factor(unsigned c, uint32_t mirror, double factor) {
  const unsigned odd = c & mirror;
  return ((odd ^ odd >> 1 ^ odd >> 2) & 1) ? -factor : factor;
}

static void gather(const fmm_operators *o, const fmm_translation *t, double factor, const double *outer, double *b) {
  outer += t->source * o->stride;
  for (unsigned c = 0; c < o->classes; c++) {
    const double sign = signed_factor(c, t->mirror, factor);
    for (size_t i = o->class_place[c]; i < o->class_place[c] + o->class_rank[c]; i++) b[i] = sign * outer[i];
  }
}

static void scatter(const fmm_operators *o, const fmm_translation *t, const double *y, double *inner) {
  inner += t->target * o->stride;
  for (unsigned c = 0; c < o->classes; c++) {
    const double sign = signed_factor(c, t->mirror, 1);
    for (size_t i = o->class_place[c]; i < o->class_place[c] + o->class_rank[c]; i++) inner[i] += sign * y[i];
  }
}

/* Of one kind, BATCH at most: gathered, one product, scattered. */
static void translate(const fmm_far *f, const double *transfer, const fmm_translation *t, size_t count, double factor,
                      const double *outer, double *inner, double *b, double *y) {
  const fmm_operators *o = f->o;
  for (size_t c = 0; c < count; c++) gather(o, &t[c], factor, outer, b + c * o->stride);
  for (size_t i = 0; i < o->stride; i += FMM_PANEL)
    for (size_t c = 0; c < count; c += FMM_COLUMNS) /* columns beyond the last are what was there before: not read */
      f->lanes->tile(o->rank, transfer + i * o->rank, b + c * o->stride, o->stride, y + c * o->stride + i, o->stride);
  for (size_t c = 0; c < count; c++) scatter(o, &t[c], y + c * o->stride, inner);
}

void batten_fmm_translate(const fmm_far *f, double factor, const double *level, const size_t *kind_begin,
                          const fmm_translation *translations, const double *outer, double *inner, double *scratch) {
  const fmm_operators *o = f->o;
  double *b = scratch, *y = b + BATCH * o->stride;
  memset(b, 0, BATCH * o->stride * sizeof *b);
  for (unsigned kind = 0, known = 0; kind < FMM_KINDS; kind++) {
    if (!o->transfer[kind]) continue;
    const double *transfer = level ? level + known * o->stride * o->rank : o->transfer[kind];
    known++;
    for (size_t i = kind_begin[kind], end = kind_begin[kind + 1]; i < end; i += BATCH)
      translate(f, transfer, translations + i, end - i < BATCH ? end - i : BATCH, factor, outer, inner, b, y);
  }
}

size_t batten_fmm_level_transfer_bytes(const fmm_operators *o) {
  size_t kinds = 0;
  for (unsigned k = 0; k < FMM_KINDS; k++) kinds += o->transfer[k] != NULL;
  return kinds * o->stride * o->rank * sizeof(double);
}

double *batten_fmm_level_transfer(batten_context *ctx, const fmm_operators *o, double half) {
  const size_t size = o->stride * o->rank;
  double *made = batten_alloc(ctx, batten_fmm_level_transfer_bytes(o)), *out = made;
  if (!made) return NULL;
  const double l = log(half);
  for (unsigned k = 0; k < FMM_KINDS; k++) {
    if (!o->transfer[k]) continue;
    for (size_t i = 0; i < size; i++) out[i] = o->transfer[k][i] + l * o->transfer_power[k][i];
    out += size;
  }
  return made;
}

/* ---- down ---- */

void batten_fmm_expand(const fmm_far *f, const double *inner, double *tensor, double *spare) {
  const fmm_operators *o = f->o;
  memset(spare, 0, o->full * sizeof *spare);
  for (unsigned c = 0, first = 0; c < o->classes; first += (unsigned)o->class_full[c++])
    f->lanes->combine(o->class_rank[c], o->class_full[c], o->expand[c], inner + o->class_place[c], spare + first);
  for (size_t i = 0; i < o->full; i++) tensor[o->members[i]] += spare[i];
}

void batten_fmm_add_sources(const fmm_far *f, const fmm_frame *frame, fmm_near_function *near, const fmm_terms *terms,
                            size_t first, size_t last, double *tensor, double *scratch) {
  const fmm_operators *o = f->o;
  double *nodes[3] = {scratch, scratch + o->full, scratch + 2 * o->full}, *a = scratch + 3 * o->full,
         *b = a + o->full;
  batten_fmm_place_nodes(o, frame, 0, o->full, nodes);
  for (size_t i = 0; i < o->full; i += FMM_LANES) {
    double x[3][FMM_LANES] = {{0}}, sums[FMM_SUMS][FMM_LANES] = {{0}};
    for (size_t lane = 0; lane < FMM_LANES; lane++)
      for (unsigned k = 0; k < o->n; k++) x[k][lane] = nodes[k][i + lane < o->full ? i + lane : i];
    near(terms, first, last, (const double(*)[FMM_LANES])x, sums);
    for (size_t lane = 0; lane < FMM_LANES && i + lane < o->full; lane++) a[i + lane] = sums[0][lane];
  }
  const double *moved = batten_fmm_through(f, (const double(*)[FMM_ORDER_MAX])o->from_nodes, a, b);
  for (size_t i = 0; i < o->full; i++) tensor[i] += moved[i];
}
