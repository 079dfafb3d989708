/* What the parts of `batten loft` share. */
#ifndef BATTEN_CLI_LOFT_H
#define BATTEN_CLI_LOFT_H

#include "cli.h"

typedef struct loft_request {
  cli_request common;
  batten_loft_options options;
  batten_loft_match_options match;
  batten_write_surface_options write;
  batten_picture_options picture;
  double slopes[2][2]; /* NaN = free */
  double gap;          /* between contours of files that tell no heights; NaN = not given */
  size_t between;      /* sections between neighbouring contours that --sections writes */
  bool fit_options;    /* some option says how slices are to be fitted */
} loft_request;

typedef struct loft_work {
  loft_request *request;
  cli_run run;
  size_t count;
  batten_curve **contours; /* [count] */
  double *heights;         /* [count] ascending */
  batten_plane base;       /* where they begin */
  bool planar;             /* the file knows of no planes: heights are along z */
  bool matched;            /* the contours come from slices */
  size_t left_out;         /* of them: too few points */
  batten_loft_match_info match;
  batten_curve *slopes[2];
  batten_loft *loft, *unconstrained;
  batten_loft_info info;
  batten_loft_measures measures;
  batten_status status; /* the first warning */
  double time_read_s, time_match_s, time_measure_s, time_write_s;
} loft_work;

/* ---- loft_input.c: contours with heights, of slices or curves ------------------------------------ */

batten_status loft_read(loft_work *w);

/* ---- loft_files.c: what is written --------------------------------------------------------------- */

batten_status loft_write(loft_work *w, const cli_output *f);

/* ---- loft_report.c ------------------------------------------------------------------------------- */

void loft_report(const loft_work *w, cli_report *r);
void loft_summary(const loft_work *w);

/* ---- loft_picture.c ------------------------------------------------------------------------------ */

/* What is drawn: contours, and the patches between them with u = t, v = height, of one span in v, as
 * batten_loft_patch gives them. */
typedef struct loft_scene {
  size_t contour_count; /* >= 2 */
  const batten_curve *const *contours;
  const double *heights;                      /* [contour_count] ascending */
  const batten_surface *const *patches;       /* [contour_count - 1] */
  const batten_surface *const *unconstrained; /* [contour_count - 1] the same without inequalities, drawn above the
                                                 result; NULL: none */
  const batten_plane *base; /* where the heights begin: (x, y, z) is drawn at origin + x axes[0] + y axes[1] + z
                               (axes[0] x axes[1]); NULL: as they are */
  double height_scale;      /* heights are drawn so many times larger; 0 = as is, unless the stack is so low or so
                               high beside its contours that nothing could be told apart; then the caption says it */
} loft_scene;

/* After figure 5 of the paper: the control polygons of the sections, with the control points of their trajectories
 * in grey; the contours and sections between them, with the control polygons of the contours in grey; the surface,
 * blue where its Gaussian curvature is positive, red where it is negative; the surface in the same colours by the
 * curvature of its sections, blue to the side to which most of it bends, with red lines between both. Of stacks of
 * many contours not all have lines. Two rows and two columns; with unconstrained two rows and four columns.
 *   view  size, camera, up_axis and title of the picture; its other fields do not count
 *   path  .png */
batten_status loft_draw(batten_context *ctx, const loft_scene *scene, const batten_picture_options *view,
                        const char *path);

#endif
