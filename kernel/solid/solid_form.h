/* How other parts of the kernel make solids of their own form: a solid is a spline under a carrier, or has a form
 * whose functions evaluate it. Everything that takes a batten_solid takes them alike. */
#ifndef BATTEN_SOLID_FORM_H
#define BATTEN_SOLID_FORM_H

#include <batten/solid.h>

typedef struct solid_form {
  batten_solid_kind kind;
  unsigned order; /* 1 or 2: derivatives that evaluate supplies; Hessians beyond are differences of gradients */
  /* As batten_field. hessians NULL when order is 1. */
  batten_status (*evaluate)(const void *state, batten_context *ctx, size_t count, const double *points,
                            double *values, double *gradients, double *hessians);
  batten_status (*bounds)(const void *state, batten_context *ctx, size_t count, const double *boxes, double *ranges);
  void (*release)(void *state);
  /* Ranges as bounds gives them, and slopes [count][2]: lower and upper bounds of |grad f| over the boxes, 0 and
   * INFINITY where nothing is known. NULL: nothing is. */
  batten_status (*slopes)(const void *state, batten_context *ctx, size_t count, const double *boxes, double *ranges,
                          double *slopes);
} solid_form;

/* depth: levels of nested carriers and solids below (limits recursion: CARRIER_DEPTH). state goes to the solid, which
 * releases it; on failure it stays the caller's. lower, upper [n]; points [count][n], at least one, copied. */
batten_status batten_solid_make(batten_context *ctx, const solid_form *form, void *state, unsigned n, unsigned depth,
                                const double *lower, const double *upper, size_t count, const double *points,
                                batten_solid **out);
/* The state of a solid of this very form (not NULL), NULL of others. */
void *batten_solid_state(const batten_solid *s, const solid_form *form);
unsigned batten_solid_depth(const batten_solid *s);

/* batten_solid_bounds and batten_carrier_bounds, and slopes [count][2] as above: what first-order distances are
 * bounded by. For spline solids and primitives both narrow as the box shrinks. */
batten_status batten_solid_slopes(batten_context *ctx, const batten_solid *s, size_t count, const double *boxes,
                                  double *ranges, double *slopes);
batten_status batten_carrier_slopes(batten_context *ctx, const batten_carrier *c, size_t count, const double *boxes,
                                    double *ranges, double *slopes);

#endif
