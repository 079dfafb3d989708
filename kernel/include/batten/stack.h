/* Solids from planar cross-sections: stacks of contours, parallel or not.   [Savchenko et al. 1995, section 4]
 *
 * Each section becomes a plane solid F_i(x, y) >= 0, a volume spline with the kernel r^2 ln r; between sections
 *
 *   F(x, y, t) = (1 - g(t)) F_i(x, y) + g(t) F_(i+1)(x, y),   g = 0 on section i, 1 on section i + 1
 *
 * or a one-dimensional spline in t over all sections. In parallel planes t is the height. Otherwise a point's t is
 * that of the moving plane, whose frame M(t) and origin o(t) are interpolated, through the point, and x, y are its
 * coordinates in that frame. The result is a batten_solid: it is evaluated, meshed, saved, combined (<batten/frep.h>)
 * and taken as a carrier as any other.
 *
 * Where batten departs from the paper: sections of ordered contours take no carrier but centres off the curve with
 * the exact distance to the polygon as their values, since carriers alone fill concave parts with phantoms; section
 * functions are saturated; t = d_1 / (d_1 + d_2) is 0 on the first plane, so that the weights of the paper's M(t) are
 * exchanged; that M(t) depends on the frame of reference, so that it is not the default. */
#ifndef BATTEN_STACK_H
#define BATTEN_STACK_H

#include <batten/solid.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Closed contours in one plane. Point (x, y) of the section is origin + x rotation[0] + y rotation[1] in space;
 * rotation[2] is the plane's normal, towards the next section. Several contours are parted by even-odd: those inside
 * of another are holes, those inside of a hole solid again; which way round they run does not matter. The first point
 * may be given once more at the end. A hole may be tied to its outer contour by edges that run there and back between
 * the same points: these are taken out, and it counts as a contour of its own. */
typedef struct batten_section {
  double origin[3];
  double rotation[3][3]; /* rows orthonormal to 1e-6 and right-handed; made exactly so inside */
  size_t contour_count;
  const size_t *starts; /* [contour_count + 1]: contour k has points starts[k] .. starts[k + 1] - 1 */
  const double *points; /* [starts[contour_count]][2], caller's unit */
} batten_section;

typedef enum batten_section_method {
  BATTEN_SECTION_PAIRS = 0, /* ordered contours: centres on the curve and off it, with the distance to the polygon;
                               chosen greedily until the curve is within the tolerance; sign certified */
  BATTEN_SECTION_POINTS,    /* points in no order: carrier, check of the sign and cure of batten_solid_fit */
  BATTEN_SECTION_CARRIER    /* the paper's way: the carrier alone, through all points */
} batten_section_method;

typedef enum batten_stack_between {
  BATTEN_BETWEEN_NATURAL = 0, /* C2 cubic spline in t over all sections, natural ends */
  BATTEN_BETWEEN_NOT_A_KNOT,  /* the same, ends not-a-knot: for smooth bodies cut finely */
  BATTEN_BETWEEN_MONOTONE,    /* C1 cubics without overshoot; gradients across t jump where slopes change sign */
  BATTEN_BETWEEN_LINEAR,      /* g = t */
  BATTEN_BETWEEN_RATIONAL     /* g = t / (t + shape (1 - t)): linear after F_i is multiplied by the shape */
} batten_stack_between;

typedef enum batten_stack_end {
  BATTEN_END_FLAT = 0, /* the end section goes on to end_height gaps beyond its plane; default half a gap: the volume
                          is that of the sum of slices */
  BATTEN_END_PLANE,    /* flat at the plane of the end section */
  BATTEN_END_ROUNDED,  /* F_end - rho (s / H)^2, rho the largest F_end of each component: closes at H = end_height
                          gaps, default 1; adds from 8/15 (F a cone) to 2/3 (a paraboloid) of H times a disc's area */
  BATTEN_END_OPEN      /* the end section goes on for ever; the solid's box ends at the plane, surfaces are cut there
                          (parallel planes); a mesh has boundary loops */
} batten_stack_end;

/* How M(t) runs through the rotations of the sections. */
typedef enum batten_stack_rotation {
  BATTEN_ROTATION_SPHERICAL = 0, /* C1 spherical spline */
  BATTEN_ROTATION_GEODESIC,      /* M_i exp(t ln(M_i' M_(i+1))); as SPHERICAL it fails where a section is half a turn
                                    from the one before */
  BATTEN_ROTATION_LOGARITHM,     /* the paper's exp((1 - t) ln M_i + t ln M_(i+1)): not the same in a turned frame of
                                    reference; fails where a section is half a turn from the axes of that frame */
  BATTEN_ROTATION_VELOCITY       /* integrated from the angular velocity, from rotation of the first section on:
                                    sections stand in these frames, rotations of the others do not count */
} batten_stack_rotation;

typedef enum batten_stack_path {
  BATTEN_PATH_CUBIC = 0, /* C2 spline through the origins, not-a-knot, over chord lengths */
  BATTEN_PATH_LINEAR
} batten_stack_path;

typedef enum batten_stack_parameter {
  BATTEN_PARAMETER_ROOT = 0, /* the moving plane goes through the point: n(t) . (p - o(t)) = 0; the largest value of
                                all such t, so that the solid is the union of what the plane sweeps. f jumps at the
                                envelope of the planes, about which the path bends: it belongs outside of sections */
  BATTEN_PARAMETER_RATIO     /* the paper's d_1 / (d_1 + d_2), distances to the planes of two neighbouring sections */
} batten_stack_parameter;

typedef enum batten_stack_route {
  BATTEN_ROUTE_AUTO = 0, /* SECTIONS; SPACE where planes cross within the sections and so have no sequence */
  BATTEN_ROUTE_SECTIONS,
  BATTEN_ROUTE_SPACE /* one volume spline in space through the centres of all sections (kernel r^3) */
} batten_stack_route;

typedef struct batten_stack_options {
  size_t struct_size;
  /* sections */
  batten_section_method method;
  double tolerance;     /* how far a section's curve may miss its points, and how deep a wrong sign may lie; caller's
                           unit. 0 = a tenth of the median distance between neighbouring points, or a thousandth of
                           the sections' mean diagonal if that is less, and at least 1e-4 of the diagonal of the
                           largest section's box. A section takes 6000 centres at most: it is told as not certified
                           if these do not do. Default 0. */
  double pair_distance; /* of centres off the curve, over the local distance of points, in (0, 1]. Default 0.75. */
  double min_area;      /* smaller contours are dropped and noted. 0 = a quarter of the square of the median
                           distance between points. Default 0. */
  int apex;             /* non-zero: a first or last section of one contour with one or two points closes the solid in
                           that point or line. Default 0: fewer than three points are an error. */
  /* between */
  batten_stack_between between;
  double shape;         /* of RATIONAL, > 0; 1 is linear. Default 1. */
  const double *scales; /* [count] > 0, factors of the section functions: above 1 draws the solid between towards that
                           section. NULL = all 1. */
  double saturation;    /* F_i becomes w tanh(F_i / w), w = saturation times the shorter of the gaps beside section i;
                           INFINITY = not at all. Default 2. */
  batten_stack_end ends[2]; /* below the first section, above the last one. Default FLAT. */
  double end_height[2];     /* gaps, > 0, or 0 = the rule's default. Default 0. */
  double gap;               /* the distance of sections where there is only one, > 0; ignored otherwise. Default 0. */
  /* planes that are not parallel */
  batten_stack_rotation rotation;
  batten_stack_path path;
  batten_stack_parameter parameter;
  const double *parameters;       /* [count] increasing: t of the sections; NULL = chord lengths of the origins,
                                     in parallel planes heights */
  const double *angular_velocity; /* [count][3] omega at t of the sections, in the section's own frame, radians per
                                     unit of t (of the chords' length where parameters are not given); for
                                     BATTEN_ROTATION_VELOCITY. NULL. */
  /* all */
  batten_stack_route route;
  int link; /* non-zero: components without a partner in the next section are joined to the nearest by blending in a
               sheared frame; the sections stay as they are. Default 0. */
} batten_stack_options;
BATTEN_API batten_stack_options batten_stack_options_default(void);

typedef enum batten_stack_note_kind {
  BATTEN_NOTE_DROPPED = 0, /* contour left out: under three points, or of an area below min_area */
  BATTEN_NOTE_NO_OVERLAP,  /* component overlaps none of the section above it */
  BATTEN_NOTE_THIN,        /* overlaps, but so little that the solid between thins to under two thirds */
  BATTEN_NOTE_LINKED,      /* as NO_OVERLAP, and joined to component `other` of the other section */
  BATTEN_NOTE_UNCERTIFIED, /* the section's function has a wrong sign deeper than the tolerance, or may have one; the
                              deepest that was found: `value`, less than the tolerance where it only may */
  BATTEN_NOTE_CROSSING     /* planes of `section` and `other` cross within both sections */
} batten_stack_note_kind;

typedef struct batten_stack_note {
  batten_stack_note_kind kind;
  size_t section, contour; /* as given; contour: the outer one of a component */
  int above;    /* NO_OVERLAP, THIN, LINKED: non-zero towards the next section, zero towards the one before */
  size_t other; /* LINKED: contour of the other section; CROSSING: section; else SIZE_MAX */
  double value; /* DROPPED: area; THIN: the share that is left; LINKED: shift; UNCERTIFIED: depth; unit as given */
} batten_stack_note;

typedef struct batten_stack_info {
  size_t sections, contours, holes; /* in use */
  size_t points_given, centers;     /* centres of all sections, on the curves and off them */
  size_t contours_dropped;
  size_t certified; /* sections proven to have no wrong sign farther than 17/16 tolerances from their contours, out to
                       100 half diagonals (boxes, bounds of function and distance), and of which none deeper than
                       one tolerance was found; of points in no order: those whose side is settled */
  double section_residual_max; /* farthest that a section's curve misses its points, |F| / |grad F|; caller's unit */
  double wrong_sign_max;       /* deepest place found with a wrong sign, distance to the polygon; caller's unit */
  double tolerance, spacing, gap; /* as used; spacing, gap: medians; caller's unit */
  size_t pieces;                  /* of the graph of components that overlap (or are linked) */
  size_t non_overlaps, links;
  int parallel;             /* planes are */
  size_t crossings;         /* pairs of sections whose planes cross within both */
  batten_stack_route route; /* as taken */
  double rotation_drift;    /* of VELOCITY: | |gamma|^2 - 1 | at most, the first integral; else 0 */
  double time_fit_s, time_total_s;
} batten_stack_info;

/* A solid through sections, in their order [count]. notes (may be NULL): *notes [*note_count] is freed by
 * batten_free(ctx, *notes), NULL when there are none; info may be NULL. Sections are independent of each other and
 * fitted on the context's threads; same bits for any number of threads.
 * Positive status: BATTEN_W_AMBIGUOUS (a section is not certified; planes cross in the SECTIONS route: the solid is
 * the union of all that the moving plane sweeps), BATTEN_W_ACCURACY (a centre's residual). Fails: INVALID (names
 * section and contour: fewer than three points, contours that cross themselves or each other, no contour at all,
 * planes that coincide or are out of order, rotations that are none, options), NOMEM, TOO_LARGE, SINGULAR, CANCELLED.
 * *out, *notes untouched then. Time: O(sum of centres^3), a point of evaluation O(centres of the 33 sections around
 * it), of 2 with LINEAR, RATIONAL, of 4 with MONOTONE. Progress phase "sections". */
BATTEN_API batten_status batten_stack_build(batten_context *ctx, size_t count, const batten_section *sections,
                                            const batten_stack_options *opt, batten_solid **out,
                                            batten_stack_info *info, batten_stack_note **notes, size_t *note_count);

/* Everything that defines a stack's solid, for saving and loading: pointers into the solid. */
typedef struct batten_stack_link {
  size_t section; /* between it and the next one */
  size_t loop[2]; /* outer loops of both components */
} batten_stack_link;
typedef struct batten_stack_parts {
  size_t struct_size;
  size_t count; /* sections */
  const batten_section
      *sections; /* [count] frames, and the loops in use: outer ones counter-clockwise, holes clockwise */
  batten_solid *const *functions; /* [count] plane solids F_i; not retained; NULL at an apex */
  const double *parameters;       /* [count] t of the sections */
  const double *scales;           /* [count] */
  const double *saturations;      /* [count] w_i, INFINITY = none */
  const double *angular_velocity; /* [count][3] or NULL */
  batten_section_method method;   /* POINTS, CARRIER: a section's one contour is its points, in no order */
  batten_stack_between between;
  double shape;
  batten_stack_end ends[2];
  double end_lengths[2]; /* H, caller's unit */
  batten_stack_rotation rotation;
  batten_stack_path path;
  batten_stack_parameter parameter;
  size_t link_count;
  const batten_stack_link *links;
} batten_stack_parts;
/* INVALID when the solid is not of this form. */
BATTEN_API batten_status batten_stack_get_parts(batten_context *ctx, const batten_solid *solid,
                                                batten_stack_parts *parts);
/* The inverse: copies, functions are retained; checks all it is given. Evaluates to the same bits. */
BATTEN_API batten_status batten_stack_create(batten_context *ctx, const batten_stack_parts *parts,
                                             batten_solid **out);

/* ---- parts that serve alone ---------------------------------------------------------------------- */

/* The plane solid of one section's contours, as batten_stack_build makes it (frames are not read).
 * residual_max, wrong_sign_max, holes (may be NULL) as in batten_stack_info. Fails as batten_stack_build. */
BATTEN_API batten_status batten_section_fit(batten_context *ctx, const batten_section *section,
                                            const batten_stack_options *opt, batten_solid **out,
                                            batten_stack_info *info);

/* Frames and origins of a stack at t [count], held beyond its ends, for pictures and checks: rotations [count][3][3],
 * origins [count][3]. Where planes are parallel the first section's frame goes up along its normal. Fails: INVALID
 * (not a solid of batten_stack_build by its sections), outputs untouched then. */
BATTEN_API batten_status batten_stack_frames(batten_context *ctx, const batten_solid *solid, size_t count,
                                             const double *t, double *rotations, double *origins);

/* M(t) from its angular velocity: gamma' + omega x gamma = 0 for each of the three columns of direction cosines
 * [Savchenko et al. 1995, section 4]; rows of M are the axes, as in batten_section.
 *   count      samples of omega, at least 2
 *   times      [count] finite, increasing
 *   omega      [count][3] in the moving frame, radians per unit of time; a C2 spline (not-a-knot) runs through them
 *   first      [3][3] M at times[0], a rotation to 1e-6
 *   at         [at_count] in any order, within times[0] .. times[count - 1]
 *   rotations  [at_count][3][3] M there, rotations to rounding
 *   drift      largest | |gamma|^2 - 1 | on the way; may be NULL
 * MAGNUS: exponentials of order 4, which keep the first integral |gamma| = 1 to rounding. RUNGE_KUTTA: order 4,
 * columns made unit after each step; drift is what they were before. Both step by a quarter of the samples' distance.
 * Time: O(count + at_count log count). Fails: INVALID, NOMEM, TOO_LARGE; outputs untouched then. */
typedef enum batten_kinematics { BATTEN_KINEMATICS_MAGNUS = 0, BATTEN_KINEMATICS_RUNGE_KUTTA } batten_kinematics;
BATTEN_API batten_status batten_rotations_integrate(batten_context *ctx, batten_kinematics method, size_t count,
                                                    const double *times, const double *omega, const double *first,
                                                    size_t at_count, const double *at, double *rotations,
                                                    double *drift);

#ifdef __cplusplus
}
#endif
#endif
