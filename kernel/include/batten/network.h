/* Smooth surfaces through triangle meshes: minimum norm networks, their fills, and what can be asked of the result.
 *   [Kolb, Pottmann, Seidel: Surface reconstruction based upon minimum norm networks, 1995]
 *
 * A triangle mesh, closed or open, of any topology, becomes a surface of polynomial Bezier triangles that passes
 * through every vertex with a continuous normal. The boundary curves of the patches depend linearly on the surface's
 * derivatives at the vertices; those are chosen by minimising an integral over all curves. Then each facet is filled.
 *
 * A patch of degree n has the control points b_abc, a + b + c = n, at index k (n + 1) - k (k - 1) / 2 + j for
 * (a, b, c) = (n - j - k, j, k): j runs fastest, the corners a = n, b = n, c = n are counter-clockwise from outside.
 * A place on it is (u, v): barycentric coordinates (1 - u - v, u, v). */
#ifndef BATTEN_NETWORK_H
#define BATTEN_NETWORK_H

#include <batten/mesh.h>
#include <batten/surface.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct batten_network batten_network;

/* ---- choices ------------------------------------------------------------------------------------ */

typedef enum batten_network_fill {
  BATTEN_FILL_AUTO = 0,    /* FAIR up to fair_faces_max facets, then DEGREE7; with continuity 1: SS */
  BATTEN_FILL_FAIR,        /* degree 7, normals and curvatures by the nonlinear fair fill, see below */
  BATTEN_FILL_FAIR_LINEAR, /* its linear variant: a fixed number of linear solves */
  BATTEN_FILL_SS,          /* three quartics a facet [Shirman, Sequin 1987], scaled as the paper's section 4 says */
  BATTEN_FILL_SS_CLASSIC,  /* the same without the scaling */
  BATTEN_FILL_PETERS,      /* one quintic a facet [after Peters 1991]; not exactly G1: its residual is told */
  BATTEN_FILL_DEGREE7,     /* one patch of degree 7 a facet [section 6], DEGREE6 where that would be singular */
  BATTEN_FILL_DEGREE6,     /* three patches of degree 6 a facet */
  BATTEN_FILL_PN /* one cubic a facet from estimated normals [Vlachos et al. 2001], for comparison: only G0, and with
                    gaps at creases */
} batten_network_fill;

typedef enum batten_normal_weights {                           /* of the triangles' normals at a vertex */
                                     BATTEN_NORMALS_ANGLE = 0, /* by the angle at the vertex */
                                     BATTEN_NORMALS_AREA,
                                     BATTEN_NORMALS_INVERSE_AREA,
                                     BATTEN_NORMALS_SPHERE /* sin(angle) / product of the edges: exact on spheres [Max
                                                              1999] */
} batten_normal_weights;

typedef enum batten_network_direction { /* of an edge's curve in the tangent plane [section 3.1] */
                                        BATTEN_DIRECTION_D2 =
                                            0, /* plane through the edge and the sum of the normals at its ends */
                                        BATTEN_DIRECTION_D1 /* projection of the edge */
} batten_network_direction;

typedef enum batten_network_length { /* of the derivative at its end. L3 and L4 shape the curves; normals are
           optimised with L2, since with the others they come to no rest */
                                     BATTEN_LENGTH_L2 = 0, /* arc of the circle */
                                     BATTEN_LENGTH_L1,     /* chord */
                                     BATTEN_LENGTH_L3,     /* planar cubic of given curvatures [de Boor, Hollig, Sabin
                                                              1987] */
                                     BATTEN_LENGTH_L4 /* the same with a space cubic, whose second derivative is taken
                                                         over too; our reading: the paper names L4 without defining it
                                                       */
} batten_network_length;

typedef enum batten_network_functional {
  BATTEN_FUNCTIONAL_SIMPLE = 0,      /* integral of |C''|^2 dt */
  BATTEN_FUNCTIONAL_LAPLACE_BELTRAMI /* by the arc length of the pass before [section 3.2] */
} batten_network_functional;

typedef enum batten_network_solver {
  BATTEN_NETWORK_AUTO = 0, /* CG, but DIRECT for the 5N system of few nodes and for the fair fill */
  BATTEN_NETWORK_CG,       /* conjugate gradients, block-Jacobi */
  BATTEN_NETWORK_DIRECT    /* Cholesky */
} batten_network_solver;

typedef struct batten_network_options {
  size_t struct_size;
  batten_network_fill fill; /* default AUTO */
  unsigned continuity;      /* of the curve network: 1 (cubics: SS, SS_CLASSIC, PETERS, PN), 2 (quintics: the other
                               fills), 0 = what the fill wants. Default 0. */
  size_t fair_faces_max;    /* AUTO: FAIR up to so many facets. Default 5000. */

  batten_normal_weights normals; /* to start from. Default ANGLE. */
  const double *normals_given;   /* [V][3] to start from instead, or NULL; zero rows are estimated. Not at vertices
                                    with creases. */
  unsigned normal_passes;        /* most passes of optimisation; 0 keeps the normals. Default 30. */
  double normal_tol_rad;         /* stop when no normal turns by more, radians. Default 1e-6. */
  batten_network_direction direction;   /* default D2 */
  batten_network_length length;         /* default L2 */
  batten_network_functional functional; /* default SIMPLE */
  double weight_power; /* edges count |E|^-weight_power, 0 .. 6; with LAPLACE_BELTRAMI |E|^(3 - weight_power), which
                          weighs alike. Default 3; the paper has 0. */
  double field_weight; /* of the cross-boundary field in the 5N system, >= 0. Default 0.32. */
  batten_network_solver solver; /* default AUTO */

  double crease_angle_deg;       /* edges whose triangles' normals differ by more are creases; 0 = none. Default 0. */
  size_t crease_count;           /* further creases */
  const uint32_t *creases;       /* [crease_count][2] ends of mesh edges */
  double corner_angle_deg;       /* a crease or line that turns by more at a vertex has a corner there. Default 60. */
  int boundary_curves;           /* non-zero: boundary edges form G1 curves of their own, as creases do. Default 0. */
  size_t line_count;             /* polylines along mesh edges, each of which becomes one G1 curve */
  const size_t *line_starts;     /* [line_count + 1] into line_vertices */
  const uint32_t *line_vertices; /* the first again at the end: closed */

  unsigned fair_passes; /* most passes of FAIR (each at most one Gauss-Newton step). Default 12. */
  double fair_tol;      /* stop when a pass lowers the energy by a smaller part. Default 1e-3. */
  int fair_warm;        /* non-zero: start from the G2 network; 0: from normals alone, safer. Default 0. */

  unsigned check_samples; /* places on each edge where the finished joints are measured, 0 = not at all, 2 .. 1000.
                             Below 9, which can agree by symmetry, the status is W_ACCURACY. Default 9. */
} batten_network_options;
BATTEN_API batten_network_options batten_network_options_default(void);

typedef struct batten_network_info {
  batten_network_fill fill; /* that was taken */
  unsigned continuity;
  size_t vertices, edges, faces, patches;          /* vertices: those in use */
  size_t boundary_edges, crease_edges, line_edges; /* creases: those that walls at a corner needed, too */
  size_t nodes;                                    /* tangent planes: one a vertex, more where creases meet */
  size_t unknowns;                                 /* of the largest linear system */
  unsigned normal_passes;
  double normal_change_rad; /* largest turn in the last pass */
  size_t cg_iterations;     /* over all passes */
  double residual;          /* of the last linear system, relative */
  size_t fallback_faces;    /* DEGREE7, FAIR, FAIR_LINEAR: facets that took DEGREE6 */
  size_t clamped_faces;     /* edges, and facets of SS, where a degenerate case was met by its stated substitute */
  unsigned fairing_passes;
  double energy_start, energy; /* FAIR: integral of |grad II|^2; else the functional of the network; caller's unit */
  double normal_jump_max_deg, normal_jump_rms_deg; /* over smooth edges and inside facets; NaN when not measured */
  double gap_max;                                  /* largest distance of the two sides of an edge, caller's unit */
  size_t irregular_faces;                          /* facets whose normal was not proven to vanish nowhere */
  double time_topology_s, time_normals_s, time_network_s, time_fill_s, time_check_s;
} batten_network_info;

/* The surface through the vertices of a mesh.
 *   mesh   oriented manifold, closed or open, without duplicate or isolated vertices and triangles of no area (see
 *          batten_mesh_repair)
 *   info   NULL, or the figures
 * Progress phases: "topology", "normals", "network", "fair", "fill", "check".
 * BATTEN_OK: every joint across smooth edges and inside facets was measured and normals agree to 1e-9 degrees, gaps
 * are below 1e-12 of the size, and every facet is proven regular. Else BATTEN_W_ACCURACY, and the error text says
 * what was missed (PETERS and PN on all but the simplest meshes).
 * Same bits for any number of threads. Time O(F) for all but the direct solves.
 * Fails: INVALID (options; the mesh, with indices), NOMEM, TOO_LARGE, SINGULAR, CANCELLED. */
BATTEN_API batten_status batten_network_build(batten_context *ctx, const batten_mesh *mesh,
                                              const batten_network_options *opt, batten_network **out,
                                              batten_network_info *info);

/* Bytes that batten_network_build takes at most for a mesh of so many vertices and triangles, and those that the
 * result keeps (where no facet is split). An estimate for what Cholesky takes, since that depends on the mesh, and
 * where creases divide many vertices. build and kept may be NULL. Fails: INVALID, TOO_LARGE. */
BATTEN_API batten_status batten_network_bytes(batten_context *ctx, size_t vertices, size_t triangles,
                                              const batten_network_options *opt, size_t *build, size_t *kept);

/* ---- the surface -------------------------------------------------------------------------------- */

typedef struct batten_network_patch {
  unsigned degree; /* 1 .. 12 */
  uint32_t face;   /* triangle of the mesh */
  unsigned part;   /* 0: the whole facet. 1, 2, 3: one of three, between corners part - 1, part and an inner point,
                      in this order */
  const double *control_points; /* [(degree + 1) (degree + 2) / 2][3], owned by the network */
} batten_network_patch;

/* From parts, as when read from a file: patches in the order of the faces, one or three each; creases
 * [crease_count][2]. All is copied. Fails: INVALID (names patch or index), NOMEM, TOO_LARGE. */
BATTEN_API batten_status batten_network_create(batten_context *ctx, size_t vertex_count, const double *vertices,
                                               size_t triangle_count, const uint32_t *triangles, size_t patch_count,
                                               const batten_network_patch *patches, size_t crease_count,
                                               const uint32_t *creases, batten_network **out);
BATTEN_API void batten_network_free(batten_network *network);
BATTEN_API size_t batten_network_vertex_count(const batten_network *network);
BATTEN_API size_t batten_network_face_count(const batten_network *network);
BATTEN_API size_t batten_network_patch_count(const batten_network *network);
BATTEN_API size_t batten_network_crease_count(const batten_network *network);
BATTEN_API const double *batten_network_vertices(const batten_network *network);    /* [V][3] */
BATTEN_API const uint32_t *batten_network_triangles(const batten_network *network); /* [F][3] */
BATTEN_API const uint32_t *batten_network_creases(const batten_network *network);   /* [crease_count][2] */
/* Patch by index; degree 0 beyond the last. */
BATTEN_API batten_network_patch batten_network_get_patch(const batten_network *network, size_t index);
/* Patches first .. first + count - 1 make up a face; count (1 or 3) is returned, 0 beyond the last. */
BATTEN_API unsigned batten_network_face_patches(const batten_network *network, size_t face, size_t *first);

/* ---- evaluation --------------------------------------------------------------------------------- */

typedef struct batten_place {
  uint32_t patch;
  double u, v; /* u, v, 1 - u - v >= 0 on the patch; further out the polynomials go on */
} batten_place;

/* places [count] -> out [count]. On the context's threads. Fails: INVALID (names the place). */
BATTEN_API batten_status batten_network_evaluate(batten_context *ctx, const batten_network *network, size_t count,
                                                 const batten_place *places, batten_surface_point *out);

/* The nearest places to points [count][3]: places [count], distances [count] (may be NULL), caller's unit. Boxes over
 * subdivided control nets, then Newton's method on the patch, its edges and corners: the distance is the least one to
 * 1e-12 of the surface's size. BATTEN_W_ACCURACY: on degenerate patches that took too long; the text names the point
 * that is worst off, and by how much its distance may be too large. Progress phase "closest". Fails: INVALID, NOMEM,
 * CANCELLED. */
BATTEN_API batten_status batten_network_closest(batten_context *ctx, const batten_network *network, size_t count,
                                                const double *points, batten_place *places, double *distances);

typedef struct batten_tessellate_options {
  size_t struct_size;
  unsigned density; /* segments of every edge, 1 .. 512. Default 8. */
  double tolerance; /* > 0: each edge gets so many segments that triangles stay within this distance of the surface,
                       caller's unit, but density at most. Default 0: density everywhere. */
  int per_patch; /* non-zero: patches share no vertices, so that fields may jump at edges. Default 0: shared, so that
                    closed surfaces give closed meshes */
} batten_tessellate_options;
BATTEN_API batten_tessellate_options batten_tessellate_options_default(void);

/* A mesh of the surface without cracks; vertices of the network are vertices of it, and come first unless per_patch.
 * Fields: "gauss", "mean" and "normal" (3), at shared vertices the mean over the patches; with per_patch also
 * "patch". Fails: INVALID, NOMEM, TOO_LARGE. */
BATTEN_API batten_status batten_network_tessellate(batten_context *ctx, const batten_network *network,
                                                   const batten_tessellate_options *opt, batten_mesh **out);

/* ---- measures ----------------------------------------------------------------------------------- */

typedef struct batten_network_measures {
  double area;
  double volume;      /* signed; NaN unless closed */
  double centroid[3]; /* of the volume when closed, else of the surface */
  double lower[3],
      upper[3]; /* box of the surface: between the samples' and the control points', whichever is closer */
  int closed;
  size_t components, boundary_edges;
  long euler, genus;           /* genus: total over closed components, -1 when open */
  double gauss_min, gauss_max; /* over a grid of 15 rows on each patch, with
                                  edges and corners */
  double gauss_p01, gauss_p02, gauss_p50, gauss_p98, gauss_p99; /* quantiles by area */
  double mean_min, mean_max;
  double gauss_integral;    /* of K over the surface; 2 pi euler on closed G1 surfaces but for creases */
  double fairness;          /* integral of |grad II|^2 */
  double regularity_min;    /* least |du x dv| over its mean on the same patch */
  size_t irregular_patches; /* whose normal is not proven to vanish nowhere, by subdivision of the normal's Bernstein
                               form */
} batten_network_measures;
/* By quadrature, 8 x 8 Gauss points a patch. Progress phase "measure". Fails: INVALID, NOMEM, CANCELLED. */
BATTEN_API batten_status batten_network_measure(batten_context *ctx, const batten_network *network,
                                                batten_network_measures *out);

/* Joints by class of edge: of the mesh's edges the smooth ones and the creases, and the edges inside split facets.
 * What cannot be judged counts as the worst: a side without a normal 180 degrees and an infinite jump of curvature,
 * one that is not finite an infinite gap. The 99 % quantile is rounded up, by 1.6 % at most. */
typedef struct batten_joint_figures {
  size_t edges, samples;
  double gap_max, gap_rms;                               /* distance, caller's unit */
  double normal_max_deg, normal_rms_deg, normal_p99_deg; /* angle between the normals of the sides */
  double curvature_jump_max, curvature_jump_rms;         /* |K_left - K_right|, 1 / unit^2 */
  uint32_t worst_face[2], worst_corner;                  /* where normal_max_deg is: the faces, and the corner of the
                                                            first at which the edge begins */
} batten_joint_figures;
typedef struct batten_network_continuity {
  batten_joint_figures smooth, crease, inner;
  size_t boundary_edges;
  double corner_gap_max; /* largest distance of a patch's corner from its vertex; infinite when a control point is not
                            finite */
} batten_network_continuity;
/* samples places on each edge, ends included, 2 .. 1000. Uses nothing but the patches and the mesh. Progress phase
 * "check". Fails: INVALID, NOMEM, CANCELLED. */
BATTEN_API batten_status batten_network_measure_continuity(batten_context *ctx, const batten_network *network,
                                                           unsigned samples, batten_network_continuity *out);

/* ---- lines on the surface ----------------------------------------------------------------------- */

typedef enum batten_line_kind {
  BATTEN_LINES_ISOPHOTE = 0, /* normal . direction = constant */
  BATTEN_LINES_REFLECTION /* the eye at infinity in `direction` sees parallel light lines mirrored: the angle of the
                             mirrored ray about light_axis is constant */
} batten_line_kind;
typedef struct batten_lines_options {
  size_t struct_size;
  batten_line_kind kind;
  double direction[3];  /* towards the light or the eye. Default (1, 0.6, 0.8). */
  double light_axis[3]; /* REFLECTION: direction of the light lines. Default (0, 0, 1). */
  unsigned count;       /* lines over the whole range, 1 .. 1000. Default 24. */
  unsigned density;     /* segments of every edge, as in tessellation. Default 8. */
} batten_lines_options;
BATTEN_API batten_lines_options batten_lines_options_default(void);

/* The quantity of which lines show the levels 1/2, 3/2, .. count - 1/2, in units of the distance of two lines, at
 * every vertex of a mesh that batten_network_tessellate made: values [its vertices]; NaN without a normal.
 * REFLECTION: it goes all around, and jumps by count somewhere; the lines below have no seam there. */
BATTEN_API batten_status batten_network_line_values(batten_context *ctx, const batten_mesh *tessellation,
                                                    const batten_lines_options *opt, double *values);

/* The lines as segments in space: *segments [*count][2][3], freed by batten_free(ctx, *segments). */
BATTEN_API batten_status batten_network_lines(batten_context *ctx, const batten_network *network,
                                              const batten_lines_options *opt, size_t *count, double **segments);

#ifdef __cplusplus
}
#endif
#endif
