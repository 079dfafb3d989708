/* The surface of a network by the file's extension; what the formats have of it is told in exchange.h. */
#include "format.h"
#include "network.h"
#include "write.h"

#include <math.h>
#include <string.h>

#include "base/checked.h"

batten_write_network_options batten_write_network_options_default(void) {
  return (batten_write_network_options){.struct_size = sizeof(batten_write_network_options), .density = 8};
}

bool bx_network_goes_on(bx_writer *w, size_t done, size_t all) {
  if (w->status == BATTEN_OK && done % 1024 == 0)
    bx_writer_fail(w, batten_progress(w->ctx, "write", (double)done / (double)all));
  return w->status == BATTEN_OK;
}

/* "2026-11-22T10:00:00": digits and nothing else where they belong. */
static bool is_time_stamp(const char *text) {
  static const char shape[] = "dddd-dd-ddTdd:dd:dd";
  if (strlen(text) != sizeof shape - 1) return false;
  for (size_t i = 0; shape[i]; i++)
    if (shape[i] == 'd' ? text[i] < '0' || text[i] > '9' : text[i] != shape[i]) return false;
  return true;
}

static batten_status check_options(batten_context *ctx, const batten_write_network_options *o) {
  batten_status st = batten_check_struct(ctx, "batten_write_network_options", o->struct_size, sizeof *o);
  if (st != BATTEN_OK) return st;
  if ((unsigned)o->unit > BATTEN_UNIT_INCH)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.unit: %d; must be one of BATTEN_UNIT_MM, CM, M, INCH",
                       (int)o->unit);
  if ((unsigned)o->form > BATTEN_CAD_DEGENERATE)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.form: %d; must be one of BATTEN_CAD_TRIMMED, QUADS, DEGENERATE",
                       (int)o->form);
  if ((unsigned)o->schema > BATTEN_STEP_AP242)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.schema: %d; must be BATTEN_STEP_AP214 or BATTEN_STEP_AP242",
                       (int)o->schema);
  if (o->time_stamp && !is_time_stamp(o->time_stamp))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.time_stamp: '%.40s'; must be as 2026-11-22T10:00:00",
                       o->time_stamp);
  if (o->name && strlen(o->name) > 255)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.name: %zu bytes; at most 255", strlen(o->name));
  if (o->density < 1 || o->density > 512)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.density: %u; must be 1 .. 512", o->density);
  if (!(o->tolerance >= 0) || isinf(o->tolerance))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.tolerance: %g; must be finite and not negative", o->tolerance);
  return BATTEN_OK;
}

/* "part" of "folder/part.step". */
static void base_name(const char *path, char *out, size_t room) {
  const char *slash = strrchr(path, '/');
  if (slash) path = slash + 1;
  const char *point = strrchr(path, '.');
  size_t length = point && point > path ? (size_t)(point - path) : strlen(path);
  if (length >= room) length = room - 1;
  memcpy(out, path, length);
  out[length] = '\0';
}

/* CAD systems take places that are nearer than 1e-7 mm for one; what has so small faces does not come back. */
static batten_status check_size(batten_context *ctx, const bx_brep *brep, batten_length_unit unit) {
  static const double millimetres[] = {1, 10, 1000, 25.4};
  double size = brep->size * millimetres[unit], least = 1e-5;
  if (size >= least && isfinite(size)) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID,
                     "network: its size is %g mm; CAD files need %g mm at least: scale it or choose another unit",
                     size, least);
}

static batten_status write_cad(batten_context *ctx, const batten_network *network,
                               const batten_write_network_options *o, bx_format format, const char *path) {
  char name[256];
  bx_brep brep;
  bx_writer w;
  bx_product product = {.unit = o->unit,
                        .form = o->form,
                        .schema = o->schema,
                        .name = o->name ? o->name : name,
                        .time_stamp = o->time_stamp ? o->time_stamp : "1970-01-01T00:00:00"};
  base_name(path, name, sizeof name);
  batten_status st = bx_brep_make(ctx, network, &brep);
  if (st != BATTEN_OK) return st;
  st = check_size(ctx, &brep, o->unit);
  if (st == BATTEN_OK) st = bx_create(&w, ctx, path);
  if (st == BATTEN_OK) {
    if (format == BX_STEP)
      bx_write_step(&w, &brep, &product);
    else
      bx_write_iges(&w, &brep, &product);
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
                         ".off .stl .vtp; rename the file",
                         bx_short_path(path));
  }
}
