/* What the parts of `batten network`, and `batten inspect`, share about networks. */
#ifndef BATTEN_CLI_NETWORK_H
#define BATTEN_CLI_NETWORK_H

#include "cli.h"

typedef enum network_color {
  NETWORK_GAUSS = 0,
  NETWORK_MEAN,
  NETWORK_ISOPHOTES,
  NETWORK_REFLECTION,
  NETWORK_PLAIN
} network_color;

typedef struct network_request {
  cli_request common;
  batten_network_options options;
  batten_write_network_options write;
  batten_picture_options picture;
  const char *crease_file, *line_file; /* NULL = none */
  double smooth, weld;                 /* 0 = no smoothing; weld < 0 = not asked for */
  size_t faces;                        /* 0 = all */
  bool repair;
  network_color color;
  bool no_edges;
} network_request;

/* What was done to the mesh before. */
typedef struct network_prepared {
  batten_mesh_repair_info repair;
  size_t faces_read;
  double smooth_lambda, decimate_distance; /* NaN = not done */
} network_prepared;

typedef struct network_work {
  network_request *request;
  cli_run run;
  batten_mesh *mesh;
  uint32_t *creases;   /* of --crease-edges */
  size_t *line_starts; /* of --lines */
  uint32_t *line_vertices;
  network_prepared prepared;
  batten_network *network;
  batten_network_info info;
  batten_network_measures measures;
  batten_network_continuity continuity;
  batten_status status; /* the first warning */
  double time_read_s, time_prepare_s, time_measure_s, time_write_s;
} network_work;

const char *network_fill_name(batten_network_fill fill);

/* network_picture.c: the surface coloured as asked for, with the patches' boundaries. */
batten_status network_draw(const network_work *w, const char *path);

/* index_lists.c: lines of vertex numbers, counted from 0, parted by blanks or commas, # comments. Lists of fewer than
 * two are refused. starts [*count + 1], indices: freed by batten_free. */
batten_status network_read_lists(batten_context *ctx, const char *path, size_t *count, size_t **starts,
                                 uint32_t **indices);

/* network_figures.c */
void network_report(const network_work *w, cli_report *r);
void network_summary(const network_work *w);
/* Figures that the surface itself has, for `batten inspect` too. */
void network_report_measures(const batten_network_measures *m, const batten_network_continuity *c, cli_report *r);
void network_print_measures(const batten_network_measures *m, const batten_network_continuity *c);

#endif
