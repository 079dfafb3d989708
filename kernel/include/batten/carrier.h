/* Carriers: the simple solids whose function f_c the volume spline corrects.  [Savchenko et al. 1995, section 3]
 *
 * Every carrier is positive inside. Immutable and shared: free drops one owner; a composite keeps its parts
 * alive. The context must outlive the carrier. Units: the caller's length; rotations are [n][n] row-major with
 * the local axes as rows, orthonormal to 1e-9 (NULL = none). */
#ifndef BATTEN_CARRIER_H
#define BATTEN_CARRIER_H

#include <batten/field.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct batten_carrier batten_carrier;
struct batten_solid;

typedef enum batten_carrier_kind {
  BATTEN_CARRIER_NONE = 0,      /* f_c = 0: for splines through oriented data */
  BATTEN_CARRIER_BALL,          /* R^2 - |x - c|^2 */
  BATTEN_CARRIER_ELLIPSOID,     /* a_min^2 (1 - sum (y_i / a_i)^2), y = rotation (x - c): the ball where all a_i = R */
  BATTEN_CARRIER_BOX,           /* signed distance, with rounding radius */
  BATTEN_CARRIER_CYLINDER,      /* signed distance of a capped cylinder, n = 3, with rounding radius */
  BATTEN_CARRIER_TORUS,         /* signed distance, n = 3 */
  BATTEN_CARRIER_HALF_SPACE,    /* -(x - p) . normal / |normal|: the normal points outwards */
  BATTEN_CARRIER_UNION,         /* R-function (f + g + sqrt(f^2 + g^2 - 2 a f g)) / (1 + a) */
  BATTEN_CARRIER_INTERSECTION,  /* the same with - sqrt */
  BATTEN_CARRIER_CALLBACK,      /* the host's field */
  BATTEN_CARRIER_SOLID          /* another fitted solid */
} batten_carrier_kind;

BATTEN_API batten_status batten_carrier_none(batten_context *ctx, unsigned n, batten_carrier **out);
BATTEN_API batten_status batten_carrier_ball(batten_context *ctx, unsigned n, const double *center, double radius,
                                             batten_carrier **out);
BATTEN_API batten_status batten_carrier_ellipsoid(batten_context *ctx, unsigned n, const double *center,
                                                  const double *semi_axes, const double *rotation,
                                                  batten_carrier **out);
/* 0 <= rounding <= smallest half extent: edges and corners get this radius, the outer size stays. */
BATTEN_API batten_status batten_carrier_box(batten_context *ctx, unsigned n, const double *center,
                                            const double *half_extents, const double *rotation, double rounding,
                                            batten_carrier **out);
BATTEN_API batten_status batten_carrier_cylinder(batten_context *ctx, const double a[3], const double b[3],
                                                 double radius, double rounding, batten_carrier **out);
BATTEN_API batten_status batten_carrier_torus(batten_context *ctx, const double center[3], const double axis[3],
                                              double major_radius, double minor_radius, batten_carrier **out);
BATTEN_API batten_status batten_carrier_half_space(batten_context *ctx, unsigned n, const double *point,
                                                   const double *normal, batten_carrier **out);
/* -1 < alpha <= 1; 1 gives max / min; 0 is the usual choice, smooth but where both fields vanish. There (and where
 * they are equal, for alpha = 1) the derivatives are the mean of both sides: (grad f + grad g) / (1 + alpha), no
 * second-order term. a and b stay the caller's. Up to 64 levels of composites and solids: combine many in pairs,
 * not in a chain. */
BATTEN_API batten_status batten_carrier_union(batten_context *ctx, batten_carrier *a, batten_carrier *b,
                                              double alpha, batten_carrier **out);
BATTEN_API batten_status batten_carrier_intersection(batten_context *ctx, batten_carrier *a, batten_carrier *b,
                                                     double alpha, batten_carrier **out);
/* field->user must outlive the carrier. Missing derivatives are taken by central differences with the step
 * difference_step (caller's length unit, > 0; ignored when field->order is 2). */
BATTEN_API batten_status batten_carrier_callback(batten_context *ctx, const batten_field *field,
                                                 double difference_step, batten_carrier **out);
BATTEN_API batten_status batten_carrier_solid(batten_context *ctx, struct batten_solid *solid, batten_carrier **out);

/* Ellipsoid fitted to points [count][n], count > n: centre and principal axes of the points' second moments,
 * semi-axes sqrt(n * variance along them). Points spread evenly over a sphere give that sphere. Of an ellipsoid
 * sampled evenly by area the long axes come out too short and the short ones too long: by 8 and 4 % for axes 1 : 1
 * : 2, by 13 and 6 % for 1 : 1 : 10. What `auto` means. Fails: INVALID, NOMEM, SINGULAR (flat: names the
 * direction). */
BATTEN_API batten_status batten_carrier_fit(batten_context *ctx, unsigned n, size_t count, const double *points,
                                            batten_carrier **out);

/* points [count][n]; values [count], gradients [count][n], hessians [count][n][n]; each may be NULL. On kinks
 * (edges of a box's distance field, the axis of a cylinder or torus) one side's derivatives, or 0 where none is
 * preferred. */
BATTEN_API batten_status batten_carrier_evaluate(batten_context *ctx, const batten_carrier *c, size_t count,
                                                 const double *points, double *values, double *gradients,
                                                 double *hessians);
/* Bounds of f_c over boxes, as batten_field says: boxes [count][2][n], ranges [count][2]; of CALLBACK those of the host's
 * field, else -INFINITY, INFINITY. */
BATTEN_API batten_status batten_carrier_bounds(batten_context *ctx, const batten_carrier *c, size_t count,
                                               const double *boxes, double *ranges);
BATTEN_API batten_field batten_carrier_field(const batten_carrier *c);

/* For saving: kind, its numbers in the order of the constructor's arguments (rotations spelled out), children.
 * Pointers into the carrier. */
typedef struct batten_carrier_parts {
  batten_carrier_kind kind;
  unsigned n;
  const double *parameters;
  size_t parameter_count;
  batten_carrier *children[2]; /* of union and intersection, else NULL; not retained */
  struct batten_solid *solid;  /* of SOLID, else NULL; not retained */
} batten_carrier_parts;
BATTEN_API void batten_carrier_get_parts(const batten_carrier *c, batten_carrier_parts *parts);
/* The inverse of get_parts, for every kind but CALLBACK; checks all it is given. Children and solid are retained. */
BATTEN_API batten_status batten_carrier_create(batten_context *ctx, const batten_carrier_parts *parts,
                                               batten_carrier **out);
/* "ball", "ellipsoid", ... */
BATTEN_API const char *batten_carrier_kind_name(batten_carrier_kind kind);

BATTEN_API batten_carrier *batten_carrier_retain(batten_carrier *c);
BATTEN_API void batten_carrier_free(batten_carrier *c);

#ifdef __cplusplus
}
#endif
#endif
