/* The frames of a stack's solid, for those who draw or check them. */
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "mesh/vec.h"
#include "section/section_inner.h"

/* Where planes are parallel the frame of the first section goes up along its normal, with t from section to section
 * in proportion to the height. */
static void parallel_frame(const stack *s, double t, double *rotation, double *origin) {
  const stack_section *base = s->sections;
  double way[3], height = 0;
  size_t i = 0;
  while (i + 2 < s->count && t >= s->sections[i + 1].t) i++;
  for (int side = 0; side < 2 && s->count > 1; side++) {
    const stack_section *at = s->sections + i + side, *other = s->sections + i + 1 - side;
    double share = (t - other->t) / (at->t - other->t);
    vec_sub(at->origin, base->origin, way);
    height += fmin(fmax(share, 0), 1) * vec_dot(way, base->rotation[2]);
  }
  memcpy(rotation, base->rotation, sizeof base->rotation);
  for (int k = 0; k < 3; k++) origin[k] = base->origin[k] + height * base->rotation[2][k];
}

batten_status batten_stack_frames(batten_context *ctx, const batten_solid *solid, size_t count, const double *t,
                                  double *rotations, double *origins) {
  if (!ctx) return BATTEN_E_INVALID;
  const stack *s = solid ? batten_solid_state(solid, &stack_form) : NULL;
  if (!s)
    return batten_fail(ctx, BATTEN_E_INVALID, "solid: %s; give one of batten_stack_build by its sections",
                       solid ? "not a stack" : "NULL");
  if (count && (!t || !rotations || !origins))
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give an array",
                       !t           ? "t"
                       : !rotations ? "rotations"
                                    : "origins");
  size_t bad = batten_first_nonfinite(count, t);
  if (bad < count) return batten_fail(ctx, BATTEN_E_INVALID, "t[%zu]: %g; give finite places", bad, t[bad]);
  for (size_t i = 0; i < count; i++) {
    if (s->parallel) {
      parallel_frame(s, t[i], rotations + 9 * i, origins + 3 * i);
      continue;
    }
    stack_frame f;
    stack_path_frame(s->path, t[i], &f);
    memcpy(rotations + 9 * i, f.rotation, sizeof f.rotation);
    memcpy(origins + 3 * i, f.origin, sizeof f.origin);
  }
  return BATTEN_OK;
}
