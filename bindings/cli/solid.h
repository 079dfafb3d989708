/* What the parts of `batten solid` share: the request of the command line, and the work's state. */
#ifndef BATTEN_CLI_SOLID_H
#define BATTEN_CLI_SOLID_H

#include "cli.h"

typedef enum solid_color { SOLID_PLAIN = 0, SOLID_GRADIENT, SOLID_MEAN, SOLID_GAUSS } solid_color;

typedef struct solid_request {
  cli_request common;
  const char *carrier, *box;
  batten_solid_options fit;
  batten_polygonize_options surface;
  batten_picture_options picture;
  solid_color color;
  bool dots;
} solid_request;

typedef struct solid_work {
  solid_request *request;
  cli_run run;
  batten_cloud cloud;
  batten_carrier *carrier; /* NULL = the library's own choice */
  batten_solid *solid;
  batten_solid_info info;
  batten_mesh *mesh;       /* in space */
  batten_outline *outline; /* in the plane */
  batten_polygonize_info surface;
  batten_mesh_measures measures;
  size_t self_intersections;
  double *color; /* [V] what the picture shows */
  double gradient_min, gradient_max;
  batten_status status; /* the first warning */
  double time_read_s, time_surface_s, time_write_s;
} solid_work;

/* Gradient and curvatures of f at the mesh's vertices, as fields of the mesh and for the picture. */
batten_status solid_add_fields(solid_work *w);
const double *solid_color_values(const solid_work *w); /* NULL = plain */

void solid_report(const solid_work *w, cli_report *r);
void solid_summary(const solid_work *w);

#endif
