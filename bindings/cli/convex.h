/* What the parts of `batten convex` share. */
#ifndef BATTEN_CLI_CONVEX_H
#define BATTEN_CLI_CONVEX_H

#include "cli.h"

typedef enum convex_parameters {
  CONVEX_AUTO = 0, /* those of the file, else by projection */
  CONVEX_PROJECT,
  CONVEX_FLOATER, /* on the triangles of a mesh file, else on those of Delaunay */
  CONVEX_FILE
} convex_parameters;

typedef struct convex_request {
  cli_request common;
  batten_convex_options options;
  batten_convex_function_options function_options;
  batten_write_surface_options write;
  batten_picture_options picture;
  convex_parameters parameters;
  bool function, concave;
  const char *only_surface, *only_function; /* an option of one kind that was given; NULL = none */
  const char *signs_file;                   /* NULL = none */
} convex_request;

typedef struct convex_work {
  convex_request *request;
  cli_run run;
  batten_cloud cloud;
  batten_mesh *mesh;  /* of a file with triangles, where those are wanted; its vertices are the points */
  signed char *signs; /* of --signs or --concave */
  batten_surface *surface, *unconstrained;
  batten_convex_info info;
  batten_convex_function_info function_info;
  batten_surface_measures measures;
  batten_status status; /* the first warning */
  double time_read_s, time_measure_s, time_write_s;
} convex_work;

/* convex_signs.c: lines of +, - and 0, the upper line for the spans of largest y, the left sign for those of least x:
 * signs [nx][ny], freed by batten_free. */
batten_status convex_read_signs(batten_context *ctx, const char *path, size_t nx, size_t ny, signed char **signs);

/* convex_figures.c */
void convex_report(const convex_work *w, cli_report *r);
void convex_summary(const convex_work *w);

#endif
