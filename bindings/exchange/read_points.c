/* Points from files: the format's reader fills a soup, of which the points and what belongs to them are kept. */
#include "format.h"
#include "soup.h"

#include "base/checked.h"

batten_read_points_options batten_read_points_options_default(void) {
  return (batten_read_points_options){.struct_size = sizeof(batten_read_points_options)};
}

void batten_cloud_free(batten_context *ctx, batten_cloud *cloud) {
  if (!cloud) return;
  batten_free(ctx, cloud->points);
  batten_free(ctx, cloud->normals);
  batten_free(ctx, cloud->parameters);
  batten_free(ctx, cloud->weights);
  *cloud = (batten_cloud){0};
}

/* n = 2 asked of spatial points: fine where they lie in z = 0. */
static batten_status flatten(bx_reader *r, bx_soup *soup) {
  for (size_t i = 0; i < soup->vertex_count; i++) {
    const double *x = soup->vertices + 3 * i;
    if (x[2] < 0 || x[2] > 0)
      return batten_fail(r->ctx, BATTEN_E_FORMAT,
                         "%s: points[%zu]: z = %g, but n = 2 asks for plane points; take n = 3",
                         bx_short_path(r->path), i, x[2]);
    soup->vertices[2 * i] = x[0];
    soup->vertices[2 * i + 1] = x[1];
  }
  for (size_t i = 0; i < soup->normal_count; i++) {
    soup->normals[2 * i] = soup->normals[3 * i];
    soup->normals[2 * i + 1] = soup->normals[3 * i + 1];
  }
  soup->n = 2;
  return BATTEN_OK;
}

static batten_status check_dimension(bx_reader *r, bx_soup *soup, unsigned n) {
  if (soup->vertex_count == 0)
    return batten_fail(r->ctx, BATTEN_E_FORMAT, "%s: no points in the file", bx_short_path(r->path));
  if (n == 3 && soup->n == 2)
    return batten_fail(r->ctx, BATTEN_E_FORMAT,
                       "%s: the points have x and y only, but n = 3 was asked for; take n = 2",
                       bx_short_path(r->path));
  return n == 2 && soup->n == 3 ? flatten(r, soup) : BATTEN_OK;
}

/* Whether there is a normal for each point; columns of zeros, which some programs write for want of normals, are
 * none. */
static bool has_normals(const bx_soup *soup) {
  if (soup->normal_count != soup->vertex_count) return false;
  for (size_t i = 0; i < soup->n * soup->normal_count; i++)
    if (soup->normals[i] != 0) return true;
  return false;
}

/* The array, which is no longer the soup's; NULL where it is not wanted. */
static double *take(double **array, bool wanted) {
  double *out = wanted ? *array : NULL;
  if (wanted) *array = NULL;
  return out;
}

batten_status bx_read_points_from(bx_reader *r, bx_format format, unsigned n, batten_cloud *out) {
  bx_soup soup = {.ctx = r->ctx};
  batten_status st = format == BX_TEXT  ? bx_read_text(r, &soup, n)
                     : format == BX_PLY ? bx_read_ply(r, &soup)
                     : format == BX_OBJ ? bx_read_obj(r, &soup)
                     : format == BX_OFF ? bx_read_off(r, &soup)
                                        : bx_read_stl(r, &soup);
  if (st == BATTEN_OK) st = check_dimension(r, &soup, n);
  if (st == BATTEN_OK) {
    *out = (batten_cloud){.n = soup.n, .count = soup.vertex_count};
    out->points = take(&soup.vertices, true);
    out->normals = take(&soup.normals, has_normals(&soup));
    out->parameters = take(&soup.parameters, soup.parameter_count == out->count);
    out->weights = take(&soup.weights, soup.weight_count == out->count);
  }
  bx_soup_free(&soup);
  return st;
}

batten_status batten_read_points(batten_context *ctx, const char *path, const batten_read_points_options *opt,
                                 batten_cloud *out) {
  batten_read_points_options o = opt ? *opt : batten_read_points_options_default();
  batten_status st = bx_check_pointers(ctx, path, out, "out");
  if (st == BATTEN_OK) st = batten_check_struct(ctx, "batten_read_points_options", o.struct_size, sizeof o);
  if (st != BATTEN_OK) return st;
  if (o.n != 0 && o.n != 2 && o.n != 3)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.n: %u; 2, 3, or 0 for what the file has", o.n);
  bool gz;
  bx_format format = bx_format_of(path, &gz);
  if (format < BX_TEXT || format > BX_STL)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "%s: points are read from .xyz .txt .csv .tsv .asc .dat .ply .obj .off "
                       ".stl, each also with .gz; rename the file",
                       bx_short_path(path));
  bx_reader r;
  st = bx_open(&r, ctx, path);
  if (st != BATTEN_OK) return st;
  st = bx_read_points_from(&r, format, o.n, out);
  bx_close(&r);
  return st;
}
