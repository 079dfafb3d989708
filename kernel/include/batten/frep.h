/* The algebra of solids: trees of functions f >= 0 inside.   [Savchenko et al. 1995, sections 1, 3 and 6; Rvachev's
 * R-functions; Pasko, Savchenko 1994 for blends and solid noise]
 *
 * A batten_frep is a node: a primitive, a reconstructed solid, or an operation over other nodes. Nodes are immutable
 * and shared: a node may stand in many places of many trees (the whole is a graph without cycles, as nodes can only
 * be built over finished ones). Every constructor adds an owner to the nodes that it is given, which stay the
 * caller's; batten_frep_free drops one. Owners are counted atomically and evaluation changes nothing, so several
 * threads may use one tree at a time, each with a context of its own; the context that a node was made with must
 * outlive it, and its last owner must let go while no call is under way on that context.
 *
 * Every node evaluates values and gradients, and bounds over boxes that hold for every point of the box, rounding
 * included. On kinks gradients are those of one side, or the mean of both.
 *
 * Lengths are the caller's unit, angles radians. n is 2 or 3; nodes of different n do not mix, except where said. */
#ifndef BATTEN_FREP_H
#define BATTEN_FREP_H

#include <batten/carrier.h>
#include <batten/mesh.h>
#include <batten/solid.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct batten_frep batten_frep;

/* The a of the R-functions, in (-1, 1]. */
#define BATTEN_R_SMOOTH 0.0  /* f + g +- sqrt(f^2 + g^2): smooth but where f = g = 0 */
#define BATTEN_R_MIN_MAX 1.0 /* max and min: exact where f and g are distances; a kink wherever f = g */

/* ---- leaves -------------------------------------------------------------------------------------- */

/* Any carrier: signed distances of box, cylinder, torus, half-space; ellipsoid and so on as there. CALLBACK carriers
 * have no bounds (-inf, inf) and cannot be saved. */
BATTEN_API batten_status batten_frep_carrier(batten_context *ctx, batten_carrier *carrier, batten_frep **out);
/* A reconstructed solid, of n = 2 or 3, whatever its form. */
BATTEN_API batten_status batten_frep_solid(batten_context *ctx, batten_solid *solid, batten_frep **out);
/* Signed distance R - |x - c|. (The carrier of that name is R^2 - |x - c|^2.) */
BATTEN_API batten_status batten_frep_ball(batten_context *ctx, unsigned n, const double *center, double radius,
                                          batten_frep **out);
/* Signed distance of a capped cone from a (radius_a) to b (radius_b); radii >= 0, not both 0. n = 3. */
BATTEN_API batten_status batten_frep_cone(batten_context *ctx, const double a[3], const double b[3], double radius_a,
                                          double radius_b, batten_frep **out);
/* Signed distance of closed polygons in the plane, parted by even-odd; starts [count + 1], points [..][2]. n = 2. */
BATTEN_API batten_status batten_frep_polygon(batten_context *ctx, size_t count, const size_t *starts,
                                             const double *points, batten_frep **out);
/* Lattice of one sheet: the gyroid G = sin X cos Y + sin Y cos Z + sin Z cos X = 0, X = 2 pi x / period, as a slab
 * of about the thickness: f = thickness / 2 - |G| period / (2 pi 1.531). 1.531 is the mean slope of G on G = 0,
 * where it is from 1.414 to 1.732: the slab is from 8 % thicker to 12 % thinner. n = 3. */
BATTEN_API batten_status batten_frep_gyroid(batten_context *ctx, double period, double thickness, batten_frep **out);

/* ---- set operations and blends ------------------------------------------------------------------- */

typedef enum batten_frep_operation {
  BATTEN_FREP_UNION = 0,    /* (f + g + sqrt(f^2 + g^2 - 2 a f g)) / (1 + a) */
  BATTEN_FREP_INTERSECTION, /* the same with - sqrt */
  BATTEN_FREP_DIFFERENCE    /* intersection of f and -g */
} batten_frep_operation;
BATTEN_API batten_status batten_frep_combine(batten_context *ctx, batten_frep_operation operation, batten_frep *a,
                                             batten_frep *b, double alpha, batten_frep **out);
/* The operation over count >= 1 nodes in a balanced tree; a difference takes all others from the first. */
BATTEN_API batten_status batten_frep_combine_all(batten_context *ctx, batten_frep_operation operation, size_t count,
                                                 batten_frep *const *nodes, double alpha, batten_frep **out);
/* -f: the complement. */
BATTEN_API batten_status batten_frep_negation(batten_context *ctx, batten_frep *a, batten_frep **out);
/* Operation + a0 / (1 + (f / a1)^2 + (g / a2)^2), a of the R-function 0: a0 > 0 adds material, a0 < 0 takes some
 * away; a1, a2 > 0 say how far from either surface. Where |g| = d the function changes by at most e = |a0| / (1 + (d
 * / a2)^2), and the surface f = 0 of a distance moves there by at most 1.71 e where that is under d (by about e
 * where it is far under); likewise with f and a1. */
BATTEN_API batten_status batten_frep_blend(batten_context *ctx, batten_frep_operation operation, batten_frep *a,
                                           batten_frep *b, double a0, double a1, double a2, batten_frep **out);

/* ---- one solid ----------------------------------------------------------------------------------- */

/* f / sqrt(|grad f|^2 + (f / L)^2), L ten times the size of the solid as its leaves tell it (1e30 where they tell
 * none): f / |grad f|, the distance to the surface to first order near it, but never beyond L. What offset and shell
 * put below f unless the node is a distance already (leaves that say so, and what moves, mirrors, offsets, unites,
 * intersects (alpha = 1) or negates them), or normalized. The gradient takes two more gradients of f. Bounds are
 * narrow only where the slope of f is bounded too, which it is not for stacks: there they tell the sign alone. Making
 * one looks for the box of the node, roughly. */
BATTEN_API batten_status batten_frep_normalize(batten_context *ctx, batten_frep *a, batten_frep **out);
/* Is |f| at most the distance to the surface, and equal to it near the surface but beside edges that set operations
 * make? Known by construction. */
BATTEN_API int batten_frep_is_distance(const batten_frep *a);
/* Grows (distance > 0) or shrinks by a distance; f is normalized first where it is no distance. */
BATTEN_API batten_status batten_frep_offset(batten_context *ctx, batten_frep *a, double distance, batten_frep **out);
/* What lies within thickness / 2 of the surface. */
BATTEN_API batten_status batten_frep_shell(batten_context *ctx, batten_frep *a, double thickness, batten_frep **out);
/* (1 - t) f + t g, t in [0, 1]: metamorphosis; t = 0 and t = 1 give f and g to the bit. */
BATTEN_API batten_status batten_frep_morph(batten_context *ctx, batten_frep *a, batten_frep *b, double t,
                                           batten_frep **out);
/* f + amplitude noise(x): solid noise of the paper's section 5.5, the product over the axes in a ring (x y in the
 * plane, x y z in space) of s(p, q) = sin(w p) + sin(w p / 1.35 + phase sin(w q)) / 1.17; |noise| is at most (1 + 1
 * / 1.17)^n. (The paper has the amplitude in s, the second time squared.) w = frequency > 0 in radians per unit,
 * amplitude in the unit of f. */
BATTEN_API batten_status batten_frep_noise(batten_context *ctx, batten_frep *a, double amplitude, double frequency,
                                           double phase, batten_frep **out);

/* ---- dimensions ---------------------------------------------------------------------------------- */

/* n = 2 to 3: the plane solid between z = lower and upper (-INFINITY, INFINITY: without end). */
BATTEN_API batten_status batten_frep_extrude(batten_context *ctx, batten_frep *a, double lower, double upper,
                                             batten_frep **out);
/* n = 2 to 3: turned about z; the plane's x is the distance from the axis, its y becomes z. */
BATTEN_API batten_status batten_frep_revolve(batten_context *ctx, batten_frep *a, batten_frep **out);
/* n = 3 to 2: the shadow along an axis (0, 1, 2): the union over its interval, max f, closed in to 1e-9 of a step
 * between `samples` (2 .. 10^6) even places, of which the node's bounds tell what may be left out. Where f has more
 * than one peak in half a step, all but one of them may be missed. The plane has the two other coordinates in the
 * order x y z. */
BATTEN_API batten_status batten_frep_project(batten_context *ctx, batten_frep *a, unsigned axis, double lower,
                                             double upper, size_t samples, batten_frep **out);
/* Cut of a solid by the plane through origin with the orthonormal axes: n = 3 to 2. */
BATTEN_API batten_status batten_frep_section(batten_context *ctx, batten_frep *a, const double origin[3],
                                             const double axes[2][3], batten_frep **out);
/* Sweep along a path of points [count][3]: the union of all places of a. n = 3: moved by path(t) - path(0) without
 * turning; n = 2: the profile in the plane across the path, in rotation-minimising frames (up [3]: the profile's y
 * axis at the start, as far as it is across the path; NULL or no length = any). smooth: C2 spline through the points
 * over chord lengths, else a polyline (of n = 2: every piece on its own, joined by union). closed: the last point is
 * followed by the first; frames of smooth closed paths are turned back evenly by what they miss. Of n = 2, f is the
 * largest of the profile's in all planes across the path through x: the exact union also where planes cross within;
 * where places of a tight bend end, f may jump. Of n = 3 the path is gone through in 32 pieces or more, as by
 * batten_frep_project: thin parts far apart may be missed where bounds do not tell. */
BATTEN_API batten_status batten_frep_sweep(batten_context *ctx, batten_frep *a, size_t count, const double *path,
                                           int smooth, int closed, const double *up, batten_frep **out);

/* ---- space mappings: f(phi^-1(x)) ----------------------------------------------------------------- */

/* x = matrix y + shift, matrix [n][n] with an inverse: the solid is moved, turned, scaled by it. Where matrix is a
 * multiple s of a rotation, f is multiplied by s, so that distances stay distances. */
BATTEN_API batten_status batten_frep_affine(batten_context *ctx, batten_frep *a, const double *matrix,
                                            const double *shift, batten_frep **out);
/* About the line through origin along axis (n = 3): turned by rate times the height along it. */
BATTEN_API batten_status batten_frep_twist(batten_context *ctx, batten_frep *a, const double origin[3],
                                           const double axis[3], double rate, batten_frep **out);
/* The height h along axis above origin becomes an arc of curvature `curvature` > 0 towards `direction` (across
 * axis), between heights lower and upper, at most one turn; beyond them straight on. Where arc and straight parts
 * come to lie in one another (from half a turn on) the solid is their union. It must stay within 1 / curvature of
 * the axis on the inside: beyond that the map folds, and f is taken at the fold. n = 3. */
BATTEN_API batten_status batten_frep_bend(batten_context *ctx, batten_frep *a, const double origin[3],
                                          const double axis[3], const double direction[3], double curvature,
                                          double lower, double upper, batten_frep **out);
/* Scaled across axis by factors that go linearly from scale_lower at height lower to scale_upper at upper (> 0),
 * constant beyond. n = 3. */
BATTEN_API batten_status batten_frep_taper(batten_context *ctx, batten_frep *a, const double origin[3],
                                           const double axis[3], double lower, double upper, double scale_lower,
                                           double scale_upper, batten_frep **out);
/* Deformation by displaced points: what was at from[i] is at to[i]; x -> x - u(x), u the volume spline (kernel r or
 * r^2 ln r) through u(to[i]) = to[i] - from[i]. points [count][n], count > n, not all on one line or plane. */
BATTEN_API batten_status batten_frep_deform(batten_context *ctx, batten_frep *a, size_t count, const double *from,
                                            const double *to, batten_frep **out);

/* ---- use ----------------------------------------------------------------------------------------- */

BATTEN_API unsigned batten_frep_dimension(const batten_frep *a);
/* points [count][n]; values [count], gradients [count][n]; each may be NULL. Solids, polygons and displaced points go
 * through the context's threads; same bits for any thread count and any batch. Fails: INVALID, NOMEM, CANCELLED, as a
 * host's field fails. */
BATTEN_API batten_status batten_frep_evaluate(batten_context *ctx, const batten_frep *a, size_t count,
                                              const double *points, double *values, double *gradients);
/* boxes [count][2][n] lower and upper corners, lower <= upper, finite; ranges [count][2]: f takes no value in the box
 * outside of [lo, hi]. Boxes may degenerate to points. */
BATTEN_API batten_status batten_frep_bounds(batten_context *ctx, const batten_frep *a, size_t count,
                                            const double *boxes, double *ranges);
BATTEN_API batten_field batten_frep_field(const batten_frep *a); /* order 1, with bounds; valid as long as the node */
/* A finite box [n] each that holds the solid f >= 0, wider than it by 0.4 to about 1 % of its largest extent on each
 * side (more where bounds are wide), found by bounds within what the structure tells: for reconstructed solids the
 * box of the data and a quarter of its diagonal, for offsets, shells and blends of what is no distance 4 times as
 * much as for a distance. Progress phase "box". NOT_FOUND: no end was found (a half-space, a negation), or the solid
 * is empty: the text says which. */
BATTEN_API batten_status batten_frep_box(batten_context *ctx, const batten_frep *a, double *lower, double *upper);
/* The tree as a solid: mesh, save, carrier of others. lower, upper [n]: the box in which its surface is looked for;
 * both NULL = batten_frep_box. cell: how fine, for the points on its surface; 0 = 1/60 of the diagonal. NOT_FOUND: no
 * surface in the box. */
BATTEN_API batten_status batten_frep_to_solid(batten_context *ctx, batten_frep *a, const double *lower,
                                              const double *upper, double cell, batten_solid **out);
/* The same from parts, as saved: box and points [count][n] on its surface, at least one, are copied, the tree is
 * retained. Fails: INVALID, NOMEM. */
BATTEN_API batten_status batten_frep_solid_create(batten_context *ctx, batten_frep *a, const double *lower,
                                                  const double *upper, size_t count, const double *points,
                                                  batten_solid **out);
/* The tree of such a solid, NULL of others; not retained. */
BATTEN_API batten_frep *batten_solid_tree(const batten_solid *s);

/* ---- saving -------------------------------------------------------------------------------------- */

typedef enum batten_frep_kind {
  BATTEN_FREP_KIND_CARRIER = 0,
  BATTEN_FREP_KIND_SOLID,
  BATTEN_FREP_KIND_BALL,
  BATTEN_FREP_KIND_CONE,
  BATTEN_FREP_KIND_POLYGON,
  BATTEN_FREP_KIND_GYROID,
  BATTEN_FREP_KIND_UNION,
  BATTEN_FREP_KIND_INTERSECTION,
  BATTEN_FREP_KIND_DIFFERENCE,
  BATTEN_FREP_KIND_NEGATION,
  BATTEN_FREP_KIND_BLEND_UNION,
  BATTEN_FREP_KIND_BLEND_INTERSECTION,
  BATTEN_FREP_KIND_BLEND_DIFFERENCE,
  BATTEN_FREP_KIND_NORMALIZE,
  BATTEN_FREP_KIND_OFFSET,
  BATTEN_FREP_KIND_SHELL,
  BATTEN_FREP_KIND_MORPH,
  BATTEN_FREP_KIND_NOISE,
  BATTEN_FREP_KIND_EXTRUDE,
  BATTEN_FREP_KIND_REVOLVE,
  BATTEN_FREP_KIND_PROJECT,
  BATTEN_FREP_KIND_SECTION,
  BATTEN_FREP_KIND_SWEEP,
  BATTEN_FREP_KIND_AFFINE,
  BATTEN_FREP_KIND_TWIST,
  BATTEN_FREP_KIND_BEND,
  BATTEN_FREP_KIND_TAPER,
  BATTEN_FREP_KIND_DEFORM,
  BATTEN_FREP_KIND_COUNT
} batten_frep_kind;

/* A node's own data: numbers in the order of its constructor's arguments (n and counts that follow from the lengths
 * left out, whole numbers and flags as numbers, polygons' starts in `starts`). Pointers into the node; children,
 * carrier and solid are not retained. */
typedef struct batten_frep_parts {
  size_t struct_size;
  batten_frep_kind kind;
  unsigned n;
  size_t number_count;
  const double *numbers;
  size_t start_count; /* of POLYGON: contours + 1 */
  const size_t *starts;
  size_t child_count; /* 0 .. 2 */
  batten_frep *children[2];
  batten_carrier *carrier;
  batten_solid *solid;
} batten_frep_parts;
BATTEN_API void batten_frep_get_parts(const batten_frep *a, batten_frep_parts *parts);
/* The inverse, through the constructors' checks. */
BATTEN_API batten_status batten_frep_create(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out);
/* "union", "blend-union", ... as in scenes; NULL beyond the last. */
BATTEN_API const char *batten_frep_kind_name(batten_frep_kind kind);

BATTEN_API batten_frep *batten_frep_retain(batten_frep *a);
BATTEN_API void batten_frep_free(batten_frep *a);

#ifdef __cplusplus
}
#endif
#endif
