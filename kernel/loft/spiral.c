/* Legs that turn and stretch evenly from one contour to the next: the spirals of eq. 12.
 *
 * Angle and radius are linear in the part of the height. So are the turns between neighbouring legs then, which keep
 * the signs and the bounds that they have at both contours [eq. 10, 11]. (A radius that is linear in its logarithm
 * would do as well, but not for legs of length 0.) */
#include "loft_inner.h"

void loft_spiral(const loft_slab *slab, size_t v, double zeta, double q[2]) {
  double angle[2] = {slab->angle[0][v], slab->angle[1][v]};
  double radius = (1 - zeta) * slab->length[0][v] + zeta * slab->length[1][v];
  q[0] = q[1] = 0;
  if (isnan(angle[0]) && isnan(angle[1])) return;
  /* A leg without a direction has that of its partner. */
  for (unsigned e = 0; e < 2; e++)
    if (isnan(angle[e])) angle[e] = angle[1 - e];
  double now = (1 - zeta) * angle[0] + zeta * angle[1];
  q[0] = radius * cos(now);
  q[1] = radius * sin(now);
}
