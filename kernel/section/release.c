/* What a stack holds, given back: at any stage of its making. */
#include "section/section_inner.h"

void stack_release(stack *s) {
  for (size_t i = 0; s->sections && i < s->count; i++) {
    polygon_set_free(&s->sections[i].loops);
    batten_solid_free(s->sections[i].function);
  }
  batten_free(s->ctx, s->sections);
  batten_free(s->ctx, s->angular_velocity);
  batten_free(s->ctx, s->links);
  batten_free(s->ctx, s->end_peak[0]);
  batten_free(s->ctx, s->end_peak[1]);
  stack_weights_free(s->weights);
  stack_path_free(s->path);
}
