/* The inside of a fit with fewer centres than points, for kernel/spline/reduce*.c only.
 *
 *   reduce.c          checks, rounds, the result
 *   reduce_select.c   which points: the first ones, and the worst of a round
 *   reduce_measure.c  errors at all points, by direct or fast sums; the final check */
#ifndef BATTEN_SPLINE_REDUCE_H
#define BATTEN_SPLINE_REDUCE_H

#include "base/neighbours.h"
#include "spline/inner.h"

typedef enum reduce_state {
  REDUCE_FREE = 0,
  REDUCE_CENTRE,
  REDUCE_TWIN, /* equal to an earlier point */
  REDUCE_HELD  /* free, but near to one that has just been chosen; within a round alone */
} reduce_state;

typedef struct reduction {
  batten_context *ctx;
  const batten_spline_data *data;
  batten_spline_options opt;
  batten_spline_reduce_options reduce;
  batten_tree *tree;    /* of all points */
  unsigned char *state; /* [N] reduce_state */
  size_t distinct;      /* points that are not twins */
  size_t centres;       /* so far */
  double apart;         /* no two points added in one round are nearer */

  batten_spline *spline; /* of the last round */
  double *values;        /* [N] U */
  double *gradients;     /* [D][n] grad U */
  double *error, *ratio; /* [N] as in batten_spline_reduce_info, and over the tolerance */
  double allowed;        /* typical |U(x_i) - v_i| that the tolerances allow */
  bool direct;           /* values are direct sums, all of them */
  double accuracy;       /* of fast sums, carried from round to round */
  size_t *heap;          /* [N] scratch */
  size_t *near, *chosen; /* [N] scratch */
  batten_spline_reduce_info info;
} reduction;

/* ---- reduce_select.c ---- */

/* Marks twins, makes the tree. */
batten_status batten_reduce_prepare(reduction *r);
/* About `wanted` well-spread points and those that span the box become centres, in addition to those there are; up to
 * `most` of all. */
batten_status batten_reduce_start(reduction *r, size_t wanted, size_t most);
/* Of the free points with ratio > 1 the worst become centres, at most `most`. Returns how many. */
size_t batten_reduce_add_worst(reduction *r, size_t most);
/* A heap of point indices by ratio, the largest on top; of equal ones the lowest index. */
void batten_reduce_heap_make(const reduction *r, size_t *heap, size_t count);
void batten_reduce_heap_pop(const reduction *r, size_t *heap, size_t count); /* heap[0] goes, count - 1 are left */

/* ---- reduce_measure.c ---- */

/* What the tolerance allows where nothing has been measured yet. */
double batten_reduce_allowed_at_first(const reduction *r);
/* error and ratio of r->spline at all points. */
batten_status batten_reduce_measure(reduction *r);
/* The final check: error and ratio again by direct sums, and what of info tells of it. */
batten_status batten_reduce_certify(reduction *r);

static inline double batten_reduce_tolerance(const reduction *r, size_t i) {
  return r->reduce.tolerances ? r->reduce.tolerances[i] : r->reduce.tolerance;
}

#endif
