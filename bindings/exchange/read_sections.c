/* Sections of solids from files: contours put together by planes, tables of offsets, points in no order, documents.
 */
#include "contours.h"
#include "format.h"
#include "sections.h"

#include "base/checked.h"

batten_read_sections_options batten_read_sections_options_default(void) {
  return (batten_read_sections_options){.struct_size = sizeof(batten_read_sections_options)};
}

batten_status bx_section_make(batten_context *ctx, size_t contours, size_t points, batten_section *out) {
  size_t *starts = batten_alloc_array(ctx, contours + 1, sizeof *starts);
  double *xy = batten_alloc_array(ctx, points, 2 * sizeof *xy);
  if (!starts || !xy) {
    batten_free(ctx, starts);
    batten_free(ctx, xy);
    return BATTEN_E_NOMEM;
  }
  out->contour_count = contours;
  out->starts = starts;
  out->points = xy;
  return BATTEN_OK;
}

int bx_by_key(const void *a, const void *b) {
  const bx_ranked *p = a, *q = b;
  if (p->key < q->key || p->key > q->key) return p->key < q->key ? -1 : 1;
  return (p->index > q->index) - (p->index < q->index);
}

size_t *bx_section_starts(const batten_section *section) { return (size_t *)(uintptr_t)section->starts; }

double *bx_section_points(const batten_section *section) { return (double *)(uintptr_t)section->points; }

void batten_section_set_free(batten_context *ctx, batten_section_set *set) {
  if (!set) return;
  for (size_t i = 0; i < set->count; i++) {
    batten_free(ctx, bx_section_starts(&set->sections[i]));
    batten_free(ctx, bx_section_points(&set->sections[i]));
  }
  batten_free(ctx, set->sections);
  batten_free(ctx, set->deck);
  *set = (batten_section_set){0};
}

/* Contours x y, each a section over the plane of x and y. */
static batten_status stack_planar(bx_reader *r, const batten_contours *c, double gap, bool closed,
                                  batten_section_set *out) {
  if (c->count > 1 && !(gap > 0))
    return batten_fail(r->ctx, BATTEN_E_FORMAT,
                       "%s: %zu contours without heights; give points x y z, or the distance of sections (opt.gap)",
                       bx_short_path(r->path), c->count);
  batten_contours lifted = *c;
  lifted.planes = batten_alloc_array(r->ctx, c->count, sizeof *lifted.planes);
  if (!lifted.planes) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < c->count; i++)
    lifted.planes[i] = (batten_plane){{0, 0, i ? (double)i * gap : 0}, {{1, 0, 0}, {0, 1, 0}}};
  batten_status st = bx_stack_contours(r->ctx, r->path, &lifted, closed, out);
  batten_free(r->ctx, lifted.planes);
  return st;
}

static batten_status read_contours(bx_reader *r, double gap, batten_section_set *out) {
  batten_contours c = {0};
  bool offsets;
  batten_status st = bx_parse_contours(r, true, &c, &offsets);
  if (st != BATTEN_OK) return st;
  if (offsets)
    st = bx_stack_offsets(r->ctx, r->path, &c, out);
  else if (c.planes)
    st = bx_stack_contours(r->ctx, r->path, &c, true, out);
  else
    st = stack_planar(r, &c, gap, true, out);
  batten_contours_free(r->ctx, &c);
  return st;
}

/* In no order. */
static batten_status read_cuts(bx_reader *r, bx_format format, batten_section_set *out) {
  batten_cloud cloud = {0};
  batten_contours cuts = {0};
  batten_status st = bx_read_points_from(r, format, 0, &cloud);
  if (st != BATTEN_OK) return st;
  if (cloud.n == 3) {
    st = bx_find_cuts(r, cloud.count, cloud.points, &cuts);
    if (st == BATTEN_OK) st = bx_stack_contours(r->ctx, r->path, &cuts, false, out);
  } else {
    size_t starts[2] = {0, cloud.count};
    batten_contours one = {.count = 1, .starts = starts, .points = cloud.points};
    st = stack_planar(r, &one, 0, false, out);
  }
  batten_contours_free(r->ctx, &cuts);
  batten_cloud_free(r->ctx, &cloud);
  return st;
}

batten_status bx_read_sections_from(bx_reader *r, bx_format format, const batten_read_sections_options *opt,
                                    batten_section_set *out) {
  if (format == BX_JSON) return bx_read_json_sections(r, out);
  return opt->points ? read_cuts(r, format, out) : read_contours(r, opt->gap, out);
}

static bool is_cloud(bx_format format) {
  return format == BX_PLY || format == BX_OBJ || format == BX_OFF || format == BX_STL;
}

batten_status batten_read_sections(batten_context *ctx, const char *path, const batten_read_sections_options *opt,
                                   batten_section_set *out) {
  batten_read_sections_options o = opt ? *opt : batten_read_sections_options_default();
  bx_reader r;
  bool gz;
  batten_status st = bx_check_pointers(ctx, path, out, "out");
  if (st == BATTEN_OK) st = batten_check_struct(ctx, "batten_read_sections_options", o.struct_size, sizeof o);
  if (st != BATTEN_OK) return st;
  if (!(o.gap >= 0 && o.gap < INFINITY))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.gap: %g; give the distance of sections, or 0", o.gap);
  bx_format format = bx_format_of(path, &gz);
  if (format != BX_TEXT && format != BX_JSON && !(o.points && is_cloud(format)))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "%s: sections are read from .txt .xyz .csv .tsv .asc .dat .json, each also with .gz; %s",
                       bx_short_path(path),
                       is_cloud(format) ? "its points in no order with opt.points" : "rename the file");
  st = bx_open(&r, ctx, path);
  if (st != BATTEN_OK) return st;
  st = bx_read_sections_from(&r, format, &o, out);
  bx_close(&r);
  return st;
}
