/* Which format a path means. */
#ifndef BATTEN_EXCHANGE_FORMAT_H
#define BATTEN_EXCHANGE_FORMAT_H

#include "stream.h"

#include <batten/exchange.h>

typedef enum bx_format {
  BX_UNKNOWN = 0,
  BX_TEXT, /* .xyz .txt .csv .tsv .asc .dat */
  BX_PLY,
  BX_OBJ,
  BX_OFF,
  BX_STL,
  BX_VTP,
  BX_VTU,
  BX_VTK,
  BX_SVG,
  BX_JSON,
  BX_QPS, /* .qps .sif .mps */
  BX_MAT,
  BX_STEP, /* .step .stp */
  BX_IGES  /* .iges .igs */
} bx_format;

/* By the extension, in any case of letters; a last .gz is looked through when gz is not NULL, and then told. */
bx_format bx_format_of(const char *path, bool *gz);

/* Is that the extension (in small letters, without its point), in any case of letters? A last .gz is looked through.
 */
bool bx_has_extension(const char *path, const char *lower_case);

/* Options, path and result pointer are there? INVALID otherwise. */
batten_status bx_check_pointers(batten_context *ctx, const char *path, const void *out, const char *out_name);

/* Fields that the options of several writers have: INVALID names them. */
batten_status bx_check_density(batten_context *ctx, unsigned density, unsigned most);
batten_status bx_check_tolerance(batten_context *ctx, double tolerance);

/* The readers behind the public calls, on any stream: what tests and fuzzers feed. */
batten_status bx_read_points_from(bx_reader *r, bx_format format, unsigned n, batten_cloud *out);
batten_status bx_read_mesh_from(bx_reader *r, bx_format format, batten_mesh **out);
batten_status bx_load_solid_from(bx_reader *r, batten_solid **out);
batten_status bx_load_carrier_from(bx_reader *r, batten_carrier **out);
batten_status bx_load_frep_from(bx_reader *r, batten_frep **out);
batten_status bx_read_qp_from(bx_reader *r, bx_format format, batten_qp_file *out);
batten_status bx_read_network_from(bx_reader *r, batten_network **out);
batten_status bx_read_surface_from(bx_reader *r, batten_surface **out);
batten_status bx_read_contours_from(bx_reader *r, batten_contours *out);
batten_status bx_read_curves_from(bx_reader *r, batten_curves *out);
batten_status bx_read_sections_from(bx_reader *r, bx_format format, const batten_read_sections_options *opt,
                                    batten_section_set *out);

#endif
