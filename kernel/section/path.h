/* The moving frame's path in pieces, for those who need bounds of its motion. */
#ifndef BATTEN_SECTION_PATH_H
#define BATTEN_SECTION_PATH_H

#include "section/section_inner.h"

enum { STACK_PATH_PIECES = 4 }; /* in an interval between two sections */

typedef struct stack_piece {
  double t0, t1;
  double base[3][3], turn[4][3]; /* M = exp(-[v]x) base with v the Bezier polynomial of these points over the piece */
  double origin[4][3];           /* Bezier points */
  interval rate[3];              /* of the angular velocity and of M o', both in the moving frame, over the piece */
  interval velocity[3];
  double middle[3], reach;        /* the origin stays in this ball */
  double turn_most, advance_most; /* of the rate across the normal, and of the velocity along it */
} stack_piece;

/* The plane of a section: g(p) = normal . (p - origin) is a point's height over it. As the plane moves on, g has the
 * derivative slope . (p - origin) - advance; [0] before the section, [1] after it. */
typedef struct stack_plane {
  double t, origin[3], rotation[3][3]; /* normal: rotation[2] */
  double slope[2][3], advance[2];
} stack_plane;

/* Piece STACK_PATH_PIECES i + j is the j-th between the sections i and i + 1. */
size_t stack_path_pieces(const stack_path *p, const stack_piece **pieces);
size_t stack_path_planes(const stack_path *p, const stack_plane **planes);
/* Length for a unit of t beside the first (end 0) or last section, above 0. */
double stack_path_speed(const stack_path *p, unsigned end);
/* The frame at t, held to the piece's ends. */
void stack_piece_frame(const stack_piece *piece, double t, stack_frame *out);

#endif
