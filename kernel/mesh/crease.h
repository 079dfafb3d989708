/* Points on kinks of f = 0, where smooth sheets meet; for kernel/mesh only. */
#ifndef BATTEN_MESH_CREASE_H
#define BATTEN_MESH_CREASE_H

#include "sampler.h"

#include <stdbool.h>

/* Fewer rounds tell a turn that is rounded: within a sixteenth of an edge after NARROW, a quarter after one. */
enum { BATTEN_CREASE_ROUNDS = 4, BATTEN_CREASE_NARROW = 2 };

/* A place where two sheets (an edge) or three (a corner, or a tip) meet. */
typedef struct batten_crease {
  double x[3];
  double normal[3][3]; /* of the sheets beside x, unit, outward */
  double home[3][3];   /* a point in each sheet, to tell its side */
  double aside[3][3];  /* directions from x into the sheets, unit */
  unsigned sheets;     /* 2 or 3 */
  unsigned char faces; /* of the box, on which x stays */
  bool found;
  unsigned char rounds; /* of refinement in which the sheets lay apart: BATTEN_CREASE_ROUNDS at a kink */
} batten_crease;

/* Sets x of an edge's crease (sheets = 2) from a = home[0] and b = home[1] in the sheets, on f = 0, and their
 * normals: where the planes there meet, and the line from a to b when the sheets are unrolled. False: not plausible.
 */
bool batten_crease_between(batten_crease *c);
/* Sets x to the point nearest to itself that all planes at the homes have in common; false: there is none. */
bool batten_crease_meet(batten_crease *c);

/* Sets the directions at x; false: the sheets do not bend as one crease. */
bool batten_crease_aside(batten_crease *c);

/* Refines the creases that are found by samples beside them, nearer by 4 in each round, from edge / 4 on; a turn that
 * is rounded is left as the last round knew it. Those that turn out to be none (lost, or smooth within edge / 4) are
 * no longer found. A third sheet that shows up beside an edge makes a corner of it. angle: in radians, by which the
 * normals of sheets differ at least. One evaluation a round and sheet. */
batten_status batten_crease_refine(batten_sampler *sampler, size_t count, batten_crease *creases, double edge,
                                   double angle);

#endif
