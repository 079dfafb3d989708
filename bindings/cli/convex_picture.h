/* The picture of `batten convex`, after figures 3 and 4 of the paper: the surfaces in space above, plots of their
 * Gaussian curvature below. */
#ifndef BATTEN_CLI_CONVEX_PICTURE_H
#define BATTEN_CLI_CONVEX_PICTURE_H

#include <batten/exchange.h>
#include <batten/surface.h>
#include <stdbool.h>

/* The unconstrained fit (left) beside the convex one, at one scale and from one side:
 *   above  data points, control net, level curves, and on the convex surface ellipses whose axes are the principal
 *          directions and whose diameters are proportional to the principal curvatures
 *   below  K over (u, v), each over its own range; 0 is in it unless all K are about the same
 * Both are blue where K > 0 and red where K < 0.
 *   unconstrained  NULL: the convex surface alone, its plot beside it
 *   shape          what the convex surface is called over its panels
 *   points         [count][3], may be none
 *   view           size, camera, up_axis and title of the picture; its other fields do not count
 *   path           .png
 * What is up: up_axis of the view for functions, and wherever the mean normal is within 15 degrees of it. Else the
 * surface is turned, with its points, so that its mean normal points up on the side to which it bulges: a patch in
 * any position is seen from outside. Level curves are heights above the plane across what is up. */
batten_status cli_convex_picture(batten_context *ctx, const batten_surface *unconstrained,
                                 const batten_surface *convex, const char *shape, size_t count, const double *points,
                                 const batten_picture_options *view, const char *path);

/* ---- convex_lines.c: what is drawn on the surfaces ---- */

/* Turns points of the surface into those of the picture: rows are its x, y and z. */
typedef struct convex_frame {
  double rows[3][3];
} convex_frame;
void convex_to_frame(const convex_frame *frame, const double point[3], double out[3]);

/* Points of a surface on a grid over its domain. */
typedef struct convex_grid {
  double lower[2], upper[2];    /* the domain */
  batten_surface_point *points; /* [CONVEX_GRID + 1][CONVEX_GRID + 1], v runs faster */
} convex_grid;
enum { CONVEX_GRID = 96 }; /* segments in either direction: a multiple of many numbers of lines */

/* Segments that grow. */
typedef struct convex_segments {
  size_t count, room;
  double *ends; /* [count][2][3] */
} convex_segments;
batten_status convex_add_segment(batten_context *ctx, convex_segments *s, const double from[3], const double to[3]);

/* The control net, and its points as segments without length. */
batten_status convex_net(batten_context *ctx, const batten_surface *surface, const convex_frame *frame,
                         convex_segments *net, convex_segments *knots);
/* The boundary of the surface, and the curves where its spans join. */
batten_status convex_span_curves(batten_context *ctx, const batten_surface *surface, const convex_frame *frame,
                                 convex_segments *out);
/* Ellipses about a regular grid of places, the largest almost as wide as is between neighbours. None on a plane. */
batten_status convex_ellipses(batten_context *ctx, const batten_surface *surface, const convex_frame *frame,
                              convex_segments *out);
#endif
