/* Turns of frames. A frame is a rotation M [3][3] whose rows are the axes, passed
 * as the address of its nine numbers; a turn is a vector in the frame's own
 * coordinates, along the axis, as long as the angle. */
#ifndef BATTEN_SECTION_ROTATIONS_H
#define BATTEN_SECTION_ROTATIONS_H

#include <batten/stack.h>

/* sin x / x, (1 - cos x) / x^2 and (x - sin x) / x^3 at x^2 = square, to rounding: decreasing in square up to x = pi.
 */
void rotation_factors(double square, double *s, double *a, double *b);

/* The frame turned by v is turn M, turn = exp(-[v]x): turn w = w - s v x w + a v x (v x w). */
void rotation_turn(const double v[3], double *turn);
/* The turn, by pi at most, that takes the frame `from` to `to`. By pi itself one of the two ways there. */
void rotation_between(const double *from, const double *to, double v[3]);
/* The angular velocity of a frame turned by v(t), in its coordinates: omega = dv - a v x dv + b v x (v x dv); and dv
 * from it (|v| < 2 pi). */
void rotation_rate(const double v[3], const double dv[3], double omega[3]);
void rotation_rate_inverse(const double v[3], const double omega[3], double dv[3]);

void rotation_multiply(const double *a, const double *b, double *out);
/* How far m is from a rotation: the largest entry of |m m' - 1|; INFINITY for reflections and what is not finite. */
double rotation_defect(const double *m);
/* The nearest rotation, in place; defect below 0.1. */
void rotation_orthonormalize(double *m);

enum { ROTATION_STEPS = 4 }; /* of the integration in an interval between two samples */

/* gamma' + omega x gamma = 0 from `first` at times[0] on, for batten_rotations_integrate: frames [ROTATION_STEPS
 * (count - 1) + 1][3][3] at the ends of the steps, which divide the intervals evenly. slopes: of omega, both
 * [count][3]. Returns the drift. */
double rotation_integrate(batten_kinematics method, size_t count, const double *times, const double *omega,
                          const double *slopes, const double *first, double *frames);

#endif
