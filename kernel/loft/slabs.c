/* The patches: between contours i and i + 1 on the knots of both [eq. 7], with the control points of both on these.
 */
#include "base/checked.h"
#include "loft_inner.h"

#include <string.h>

void loft_slabs_free(batten_context *ctx, size_t count, loft_slab *slabs) {
  for (size_t i = 0; slabs && i < count; i++) {
    loft_slab *s = &slabs[i];
    for (size_t e = 0; e < 2; e++) {
      batten_free(ctx, s->end[e]);
      batten_free(ctx, s->angle[e]);
      batten_free(ctx, s->length[e]);
    }
    batten_free(ctx, s->wanted);
    loft_space_free(ctx, &s->space);
  }
  batten_free(ctx, slabs);
}

/* A contour's control points in the larger space. */
static batten_status raise(batten_context *ctx, const loft_contour *contour, const loft_space *to, double **out) {
  loft_matrix m = {0};
  double *points = batten_alloc_array(ctx, to->count, 2 * sizeof *points);
  batten_status st = points ? loft_insertion(ctx, &contour->space, to, &m) : BATTEN_E_NOMEM;
  if (st >= 0) {
    loft_matrix_apply(&m, contour->points, points);
    *out = points;
    points = NULL;
  }
  loft_matrix_free(ctx, &m);
  batten_free(ctx, points);
  return st;
}

batten_status loft_slabs_make(batten_context *ctx, const loft_stack *stack, loft_slab **out) {
  size_t count = stack->count - 1;
  loft_slab *slabs = batten_alloc_array(ctx, count, sizeof *slabs);
  if (!slabs) return BATTEN_E_NOMEM;
  memset(slabs, 0, count * sizeof *slabs);
  batten_status st = BATTEN_OK;
  for (size_t i = 0; i < count && st >= 0; i++) {
    const loft_contour *ends = stack->contours + i;
    loft_slab *s = &slabs[i];
    s->gap = ends[1].height - ends[0].height;
    st = loft_space_union(ctx, &ends[0].space, &ends[1].space, &s->space);
    for (size_t e = 0; e < 2 && st >= 0; e++) st = raise(ctx, &ends[e], &s->space, &s->end[e]);
  }
  if (st >= 0)
    *out = slabs;
  else
    loft_slabs_free(ctx, count, slabs);
  return st;
}
