/* Surfaces by the file's extension; what the formats have of them is told in exchange.h. */
#include "format.h"
#include "surface.h"
#include "write.h"

#include "base/checked.h"

batten_write_surface_options batten_write_surface_options_default(void) {
  return (batten_write_surface_options){.struct_size = sizeof(batten_write_surface_options), .density = 16};
}

static bx_product product_of(const batten_write_surface_options *o) {
  return (bx_product){.unit = o->unit,
                      .schema = o->schema,
                      .name = o->name,
                      .time_stamp = o->time_stamp,
                      .description = "B-spline surface"};
}

static batten_status check_options(batten_context *ctx, const batten_write_surface_options *o) {
  bx_product product = product_of(o);
  batten_status st = batten_check_struct(ctx, "batten_write_surface_options", o->struct_size, sizeof *o);
  if (st == BATTEN_OK) st = bx_check_product(ctx, &product);
  if (st != BATTEN_OK) return st;
  st = bx_check_density(ctx, o->density, 1024);
  return st == BATTEN_OK ? bx_check_tolerance(ctx, o->tolerance) : st;
}

/* A loop that passes a vertex where two sides have vanished has nothing that tells which of the parameters' corners
 * it goes through: Open CASCADE then makes a face of something else. */
static batten_status check_step(batten_context *ctx, const bx_sides *sides) {
  static const char *const names[BX_SIDES] = {"lower v", "upper u", "upper v", "lower u"};
  for (unsigned k = 0; k < BX_SIDES; k++)
    if (sides->point[k] && sides->point[(k + 1) % BX_SIDES])
      return batten_fail(
          ctx, BATTEN_E_INVALID,
          "surface: its neighbouring sides at %s and %s are points, which STEP faces cannot have; write "
          ".iges, or split it",
          names[k], names[(k + 1) % BX_SIDES]);
  return BATTEN_OK;
}

static batten_status write_cad(batten_context *ctx, const batten_surface_form *form,
                               const batten_write_surface_options *o, bx_format format, const char *path) {
  char name[BX_PRODUCT_NAME];
  bx_sides sides;
  bx_writer w;
  bx_product product = product_of(o);
  bx_complete_product(&product, path, name);
  batten_status st = bx_find_sides(ctx, form, o->unit, &sides);
  if (st == BATTEN_OK && format == BX_STEP) st = check_step(ctx, &sides);
  if (st == BATTEN_OK) st = bx_create(&w, ctx, path);
  if (st != BATTEN_OK) return st;
  if (format == BX_STEP)
    bx_write_step_surface(&w, form, &sides, &product);
  else
    bx_write_iges_surface(&w, form, &sides, &product);
  return bx_commit(&w);
}

static batten_status write_tessellated(batten_context *ctx, const batten_surface *surface,
                                       const batten_write_surface_options *o, const char *path) {
  batten_surface_tessellate_options t = batten_surface_tessellate_options_default();
  batten_mesh *mesh = NULL;
  t.density = o->density;
  t.tolerance = o->tolerance;
  batten_status st = batten_surface_tessellate(ctx, surface, &t, &mesh);
  if (st >= 0) st = batten_write_mesh(ctx, mesh, path);
  batten_mesh_free(mesh);
  return st;
}

batten_status batten_write_surface(batten_context *ctx, const batten_surface *surface,
                                   const batten_write_surface_options *opt, const char *path) {
  batten_write_surface_options o = opt ? *opt : batten_write_surface_options_default();
  batten_status st = bx_check_pointers(ctx, path, surface, "surface");
  if (st == BATTEN_OK) st = check_options(ctx, &o);
  if (st != BATTEN_OK) return st;
  batten_surface_form form = batten_surface_get(surface);
  bx_format format = bx_format_of(path, NULL);
  bx_writer w;
  switch (format) {
    case BX_STEP:
    case BX_IGES:
      return write_cad(ctx, &form, &o, format, path);
    case BX_PLY:
    case BX_OBJ:
    case BX_OFF:
    case BX_STL:
    case BX_VTP:
    case BX_VTK:
      return write_tessellated(ctx, surface, &o, path);
    case BX_JSON:
    case BX_VTU:
      st = bx_create(&w, ctx, path);
      if (st != BATTEN_OK) return st;
      if (format == BX_JSON)
        bx_write_json_surface(&w, &form);
      else
        bx_write_vtu_surface(&w, &form);
      return bx_commit(&w);
    default:
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "%s: surfaces are written as .step .stp .iges .igs .json .vtu, and tessellated as .ply .obj "
                         ".off .stl .vtp .vtk; rename the file",
                         bx_short_path(path));
  }
}
