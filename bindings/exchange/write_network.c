/* The surface of a network by the file's extension; what the formats have of it is told in exchange.h. */
#include "format.h"
#include "network.h"
#include "write.h"

#include "base/checked.h"

batten_write_network_options batten_write_network_options_default(void) {
  return (batten_write_network_options){.struct_size = sizeof(batten_write_network_options), .density = 8};
}

static bx_product product_of(const batten_write_network_options *o) {
  return (bx_product){.unit = o->unit,
                      .schema = o->schema,
                      .name = o->name,
                      .time_stamp = o->time_stamp,
                      .description = "smooth surface through a triangle mesh"};
}

static batten_status check_options(batten_context *ctx, const batten_write_network_options *o) {
  batten_status st = batten_check_struct(ctx, "batten_write_network_options", o->struct_size, sizeof *o);
  if (st != BATTEN_OK) return st;
  if ((unsigned)o->form > BATTEN_CAD_DEGENERATE)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.form: %d; must be one of BATTEN_CAD_TRIMMED, QUADS, DEGENERATE",
                       (int)o->form);
  bx_product product = product_of(o);
  st = bx_check_product(ctx, &product);
  if (st != BATTEN_OK) return st;
  st = bx_check_density(ctx, o->density, 512);
  return st == BATTEN_OK ? bx_check_tolerance(ctx, o->tolerance) : st;
}

static batten_status write_cad(batten_context *ctx, const batten_network *network,
                               const batten_write_network_options *o, bx_format format, const char *path) {
  char name[BX_PRODUCT_NAME];
  bx_brep brep;
  bx_writer w;
  bx_product product = product_of(o);
  bx_complete_product(&product, path, name);
  batten_status st = bx_brep_make(ctx, network, &brep);
  if (st != BATTEN_OK) return st;
  st = bx_check_cad_size(ctx, "network", brep.size, o->unit);
  if (st == BATTEN_OK) st = bx_create(&w, ctx, path);
  if (st == BATTEN_OK) {
    if (format == BX_STEP)
      bx_write_step_network(&w, &brep, o->form, &product);
    else
      bx_write_iges_network(&w, &brep, o->form, &product);
    st = bx_commit(&w);
  }
  bx_brep_free(ctx, &brep);
  return st;
}

static batten_status write_tessellated(batten_context *ctx, const batten_network *network,
                                       const batten_write_network_options *o, const char *path) {
  batten_tessellate_options t = batten_tessellate_options_default();
  batten_mesh *mesh = NULL;
  t.density = o->density;
  t.tolerance = o->tolerance;
  batten_status st = batten_network_tessellate(ctx, network, &t, &mesh);
  if (st >= 0) st = batten_write_mesh(ctx, mesh, path);
  batten_mesh_free(mesh);
  return st;
}

batten_status batten_write_network(batten_context *ctx, const batten_network *network,
                                   const batten_write_network_options *opt, const char *path) {
  batten_write_network_options o = opt ? *opt : batten_write_network_options_default();
  batten_status st = bx_check_pointers(ctx, path, network, "network");
  if (st == BATTEN_OK) st = check_options(ctx, &o);
  if (st != BATTEN_OK) return st;
  bx_writer w;
  bx_format format = bx_format_of(path, NULL);
  switch (format) {
    case BX_STEP:
    case BX_IGES:
      return write_cad(ctx, network, &o, format, path);
    case BX_PLY:
    case BX_OBJ:
    case BX_OFF:
    case BX_STL:
    case BX_VTP:
    case BX_VTK:
      return write_tessellated(ctx, network, &o, path);
    case BX_JSON:
    case BX_VTU:
      st = bx_create(&w, ctx, path);
      if (st != BATTEN_OK) return st;
      if (format == BX_JSON)
        bx_write_json_network(&w, network);
      else
        bx_write_vtu_network(&w, network);
      return bx_commit(&w);
    default:
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "%s: networks are written as .step .stp .iges .igs .json .vtu, and tessellated as .ply .obj "
                         ".off .stl .vtp .vtk; rename the file",
                         bx_short_path(path));
  }
}
