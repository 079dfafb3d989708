/* The list of all kinds of nodes: their names in scenes, what they are made of, and making them again from it. */
#include "base/checked.h"
#include "frep/frep_inner.h"

/* In the order of batten_frep_kind. */
static const frep_class *const classes[] = {
    &frep_class_carrier,
    &frep_class_solid,
    &frep_class_ball,
    &frep_class_cone,
    &frep_class_polygon,
    &frep_class_gyroid,
    &frep_class_union,
    &frep_class_intersection,
    &frep_class_difference,
    &frep_class_negation,
    &frep_class_blend_union,
    &frep_class_blend_intersection,
    &frep_class_blend_difference,
    &frep_class_normalize,
    &frep_class_offset,
    &frep_class_shell,
    &frep_class_morph,
    &frep_class_noise,
    &frep_class_extrude,
    &frep_class_revolve,
    &frep_class_project,
    &frep_class_section,
    &frep_class_sweep,
    &frep_class_affine,
    &frep_class_twist,
    &frep_class_bend,
    &frep_class_taper,
    &frep_class_deform,
};

static const frep_class *find_class(batten_frep_kind kind) {
  for (size_t i = 0; i < sizeof classes / sizeof *classes; i++)
    if (classes[i]->kind == kind) return classes[i];
  return NULL;
}

const char *batten_frep_kind_name(batten_frep_kind kind) {
  const frep_class *cls = find_class(kind);
  return cls ? cls->name : NULL;
}

void batten_frep_get_parts(const batten_frep *a, batten_frep_parts *parts) {
  *parts = (batten_frep_parts){.struct_size = sizeof *parts,
                               .kind = a->cls->kind,
                               .n = a->n,
                               .number_count = a->number_count,
                               .numbers = a->numbers,
                               .start_count = a->start_count,
                               .starts = a->starts,
                               .child_count = a->child_count,
                               .children = {a->children[0], a->children[1]},
                               .carrier = a->carrier,
                               .solid = a->solid};
}

batten_status batten_frep_create(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0 && !parts) st = batten_fail(ctx, BATTEN_E_INVALID, "parts: NULL; give the parts of a node");
  if (st >= 0 && parts->struct_size != sizeof *parts)
    st = batten_fail(ctx, BATTEN_E_INVALID,
                     "parts.struct_size: %zu, expected %zu; set it to sizeof(batten_frep_parts)", parts->struct_size,
                     sizeof *parts);
  if (st < 0) return st;
  const frep_class *cls = find_class(parts->kind);
  if (!cls) return batten_fail(ctx, BATTEN_E_INVALID, "parts.kind: %d; give a kind of node", (int)parts->kind);
  if (parts->n < 2 || parts->n > 3) return batten_fail(ctx, BATTEN_E_INVALID, "parts.n: %u; give 2 or 3", parts->n);
  if (parts->number_count && !parts->numbers)
    return batten_fail(ctx, BATTEN_E_INVALID, "parts.numbers: NULL; give %zu numbers", parts->number_count);
  return cls->create(ctx, parts, out);
}

batten_status frep_check_parts(batten_context *ctx, const batten_frep_parts *parts, size_t number_count,
                               size_t child_count) {
  if (parts->number_count != number_count)
    return batten_fail(ctx, BATTEN_E_INVALID, "parts.number_count: %zu; a node \"%s\" takes %zu", parts->number_count,
                       batten_frep_kind_name(parts->kind), number_count);
  if (parts->child_count != child_count)
    return batten_fail(ctx, BATTEN_E_INVALID, "parts.child_count: %zu; a node \"%s\" takes %zu", parts->child_count,
                       batten_frep_kind_name(parts->kind), child_count);
  return BATTEN_OK;
}
