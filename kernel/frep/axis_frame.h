/* Maps of space about an axis: q = E (x - origin) with the axis as the third row of the rotation E, y = origin + E'
 * psi(q), dy/dx = E' (dpsi/dq) E.
 *
 * An axis along a coordinate gets a frame of coordinate axes, so that boxes stay boxes and only psi widens them. */
#ifndef BATTEN_FREP_AXIS_FRAME_H
#define BATTEN_FREP_AXIS_FRAME_H

#include "frep/gather.h"

typedef struct frep_frame {
  double origin[3];
  double rows[3][3]; /* u, v, axis: right-handed */
} frep_frame;

/* axis and towards are unit vectors; u lies along towards as far as that is across the axis; false: it is not. */
bool frep_frame_set(frep_frame *f, const double *origin, const double *axis, const double *towards);
void frep_frame_any(frep_frame *f, const double *origin, const double *axis);

void frep_frame_into(const frep_frame *f, const double *x, double *q);
void frep_frame_into_range(const frep_frame *f, const interval *x, interval *q);
/* The place of psi(q) with its derivatives by q. */
void frep_frame_back(const frep_frame *f, const double psi[3], double psi_q[3][3], frep_place *p);
/* The image of a range of psi, |dpsi/dq| <= stretch. */
frep_image frep_frame_image(const frep_frame *f, const interval *psi, double stretch);

bool frep_box_empty(unsigned n, const double *lower, const double *upper);
/* The child's structural box in the frame: false where there is none; *empty: it holds nothing, q is untouched. */
bool frep_frame_child_box(const batten_frep *a, const frep_frame *f, interval *q, bool *empty);
void frep_frame_box(const frep_frame *f, bool empty, const interval *q, double *lower, double *upper);

/* unit: of the axis. */
batten_status frep_frame_check(batten_context *ctx, batten_frep *a, const double *origin, const double *axis,
                               double *unit, batten_frep **out);
batten_status frep_frame_check_heights(batten_context *ctx, double lower, double upper);
/* A node of n = 3 over a with a copy of the state, of so many bytes. */
batten_status frep_frame_make(batten_context *ctx, const frep_class *cls, batten_frep *a, size_t count,
                              const double *numbers, const void *state, size_t bytes, batten_frep **out);

#endif
