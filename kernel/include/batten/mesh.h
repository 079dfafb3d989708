/* Triangle meshes: storage, topology, measures; the polygoniser of f = 0; outlines of plane solids. */
#ifndef BATTEN_MESH_H
#define BATTEN_MESH_H

#include <batten/field.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct batten_mesh batten_mesh;

/* Copies. vertices [V][3], triangles [F][3] indices < V, counter-clockwise seen from outside.
 * Fails: INVALID (names triangle and index), TOO_LARGE, NOMEM. */
BATTEN_API batten_status batten_mesh_create(batten_context *ctx, size_t vertex_count, const double *vertices,
                                            size_t triangle_count, const uint32_t *triangles, batten_mesh **out);
BATTEN_API void batten_mesh_free(batten_mesh *mesh);
BATTEN_API size_t batten_mesh_vertex_count(const batten_mesh *mesh);
BATTEN_API size_t batten_mesh_triangle_count(const batten_mesh *mesh);
BATTEN_API const double *batten_mesh_vertices(const batten_mesh *mesh);
BATTEN_API const uint32_t *batten_mesh_triangles(const batten_mesh *mesh);

/* Named numbers at the vertices: values [V][components], components 1 .. 9, any values; copied; replaces one of the
 * same name. Fails: INVALID, TOO_LARGE, NOMEM; the mesh is then as before. batten_mesh_field: NULL beyond the last.
 */
BATTEN_API batten_status batten_mesh_set_field(batten_context *ctx, batten_mesh *mesh, const char *name,
                                               size_t components, const double *values);
BATTEN_API size_t batten_mesh_field_count(const batten_mesh *mesh);
BATTEN_API const double *batten_mesh_field(const batten_mesh *mesh, size_t index, const char **name,
                                           size_t *components);

/* normals [V][3]: unit, angle-weighted; 0 at vertices without area. Fails: INVALID, NOMEM; normals are then as before.
 */
BATTEN_API batten_status batten_mesh_vertex_normals(batten_context *ctx, const batten_mesh *mesh, double *normals);

/* Where a quantity that is linear on triangles passes its levels: values [V] at the vertices, levels [level_count];
 * triangles with a corner that is not finite have no lines. *segments [*count][2][3], in the order of the levels and
 * triangles, freed by batten_free(ctx, *segments); NULL when there are none. Fails: INVALID, NOMEM, TOO_LARGE. */
BATTEN_API batten_status batten_mesh_level_lines(batten_context *ctx, const batten_mesh *mesh, const double *values,
                                                 size_t level_count, const double *levels, size_t *count,
                                                 double **segments);

typedef struct batten_mesh_measures {
  size_t vertices, edges, triangles;     /* vertices: those in use */
  size_t components;                     /* triangles joined through edges */
  int closed;                            /* no boundary edge, and at least one triangle */
  int manifold;                          /* every edge in <= 2 triangles, every vertex's triangles one fan */
  int oriented;                          /* every inner edge is passed as often one way as the other */
  size_t boundary_edges, boundary_loops; /* edges of one triangle, and the loops that they form */
  size_t nonmanifold_edges;              /* in more than two triangles, or with both ends at one vertex */
  size_t nonmanifold_vertices;           /* whose triangles fall apart into more than one fan */
  long euler;                            /* V - E + F */
  long genus;                            /* total over the components of a closed oriented manifold, else -1 */
  double area;
  double volume;        /* signed; NaN unless closed and oriented */
  double centroid[3];   /* of the enclosed volume when closed, else of the surface */
  double inertia[3][3]; /* of the enclosed volume about the centroid, unit density, the same when turned inside
                           out; NaN unless closed, oriented and of some volume */
  double lower[3], upper[3];
  double angle_min_deg, angle_max_deg;
  double angles_above_20deg; /* share of triangles with all angles >= 20 degrees */
  double edge_min, edge_mean, edge_max;
} batten_mesh_measures;
/* Lengths, angles and the box are 0 for a mesh without triangles. Figures keep their digits far from the origin, and
 * in any unit that does not overflow itself. Time O(V + F), the figures on the context's threads. Progress phase
 * "measure". Fails: INVALID, NOMEM, CANCELLED. */
BATTEN_API batten_status batten_mesh_measure(batten_context *ctx, const batten_mesh *mesh, batten_mesh_measures *out);

/* Pairs of triangles that have more in common than the corners that they share: crossing, touching, folded onto each
 * other, or given twice. Corners are shared when they lie at the same place, whatever their indices; triangles
 * without area take no part. Exact: by signs of determinants in expansion arithmetic. Time O(F log F) for even
 * meshes; on the context's threads. Memory: about 75 bytes a triangle. Progress phase "crossings". Fails: INVALID,
 * NOMEM, CANCELLED. */
BATTEN_API batten_status batten_mesh_self_intersections(batten_context *ctx, const batten_mesh *mesh, size_t *pairs);

/* ---- defects and repair -------------------------------------------------------------------------- */

/* How many there are of what stands between a mesh and an oriented manifold, and the first of each (SIZE_MAX, or
 * UINT32_MAX, when there is none). */
typedef struct batten_mesh_defects {
  size_t isolated_vertices, isolated_vertex;
  size_t duplicate_vertices; /* at the place of an earlier one, where an edge of one triangle alone lies upon another
                                edge: welding would join triangles. (Parts may touch in a vertex, or closed ones) */
  uint32_t duplicate_vertex[2];
  size_t degenerate_triangles, degenerate_triangle;  /* a corner twice, or the corners on one line to rounding */
  size_t duplicate_triangles, duplicate_triangle[2]; /* the same three corners */
  size_t nonmanifold_edges;                          /* in more than two triangles */
  uint32_t nonmanifold_edge[2];                      /* its ends, and: */
  size_t nonmanifold_triangle[3];                    /* three of the triangles */
  size_t flipped_edges;                              /* passed the same way by both of their triangles */
  uint32_t flipped_edge[2];
  size_t flipped_triangle[2];
  size_t nonmanifold_vertices, nonmanifold_vertex; /* whose triangles fall apart into more than one fan */
} batten_mesh_defects;
/* Time O(V + F) in the mean. Fails: INVALID, NOMEM. */
BATTEN_API batten_status batten_mesh_find_defects(batten_context *ctx, const batten_mesh *mesh,
                                                  batten_mesh_defects *out);

typedef struct batten_mesh_repair_options {
  size_t struct_size;
  double weld_radius; /* caller's unit; a vertex nearer than this to an earlier one that stays becomes the first
                         such: none moves further. Default 0: those at the same place. Negative: no welding */
  int orient;         /* non-zero: triangles are turned so that neighbours agree and closed parts enclose a positive
                         volume, of open ones as few as can be; parts that have no orientation (a Moebius strip) fail
                         with INVALID. Default 1. */
  int split; /* non-zero: vertices whose triangles fall apart into fans become one for each fan. Default 1. */
} batten_mesh_repair_options;
BATTEN_API batten_mesh_repair_options batten_mesh_repair_options_default(void);
typedef struct batten_mesh_repair_info {
  size_t welded_vertices, split_vertices, removed_vertices; /* removed: isolated */
  size_t removed_triangles;                                 /* degenerate or duplicate */
  size_t swapped_edges; /* sides of triangles without area, swapped so that no slit opens where these were */
  size_t turned_triangles;
} batten_mesh_repair_info;
/* A mesh without the defects that can be mended; edges of more than two triangles cannot (INVALID, names the edge).
 * Vertices and triangles that stay keep their order. Fields are taken along. info may be NULL. Fails: INVALID, NOMEM.
 */
BATTEN_API batten_status batten_mesh_repair(batten_context *ctx, const batten_mesh *mesh,
                                            const batten_mesh_repair_options *opt, batten_mesh **out,
                                            batten_mesh_repair_info *info);

/* ---- noise and size ------------------------------------------------------------------------------- */

/* Smoothing of noisy scans: minimises |x - x0|^2 + lambda |L x|^2 over the vertices, L the umbrella operator of the
 * triangles (of the boundary polyline at boundaries), with lambda such that the vertices move by `noise` in the root
 * mean square: the standard deviation of the noise along all three axes, caller's unit, > 0. *lambda may be NULL.
 * BATTEN_W_ACCURACY: even a flat mesh would not move that far. Fields are kept as they are. Progress phase "smooth".
 * Fails: INVALID, NOMEM, CANCELLED. */
BATTEN_API batten_status batten_mesh_smooth(batten_context *ctx, const batten_mesh *mesh, double noise,
                                            batten_mesh **out, double *lambda);

/* Fewer triangles: edges are collapsed in the order of their quadric error [Garland, Heckbert 1997] until at most
 * `triangles` are left, but never where that would fold a triangle, pinch the surface or change its topology;
 * boundaries keep their shape. Fields are dropped. *distance_max (may be NULL) is the square root of the largest
 * quadric error: a mean distance to the planes of the triangles that a vertex stands for. BATTEN_W_ACCURACY: no
 * further edge may go. Progress phase "decimate". Fails: INVALID (also: not an oriented manifold), NOMEM, CANCELLED.
 */
BATTEN_API batten_status batten_mesh_decimate(batten_context *ctx, const batten_mesh *mesh, size_t triangles,
                                              batten_mesh **out, double *distance_max);

/* ---- the surface f = 0 -------------------------------------------------------------------------- */

typedef struct batten_polygonize_options {
  size_t struct_size;
  double cell; /* edge length aimed at, caller's unit. 0 = 0.7 of the median distance of seeds to their nearest
                  neighbour, but between 1/200 and 1/60 of the diagonal of the seeds' box. Parts of the solid and gaps
                  thinner than about one cell may be lost. Default 0. */
  double lower[3], upper[3]; /* clip box; all 0 = the seeds' box, each side moved out by 25 % of its largest extent.
                                The field is asked for within it only, but for Newton steps of a third of a cell and
                                differences of 1e-4 cell */
  double accuracy;  /* |f| / |grad f| over the clip box's diagonal at every vertex, in (0, 1); smaller costs at most
                       an evaluation more. Default 1e-6. */
  unsigned improve; /* rounds of mesh improvement, of which the first asks the field at every vertex and the others
                       where moves along the surface may have led off it. 0 leaves the slivers of the lattice, 4 make
                       nearly all angles > 20 degrees. Default 8. */
  size_t evaluations_max; /* give up above so many field evaluations, 0 = none. Default 0. */
  double sharp_deg; /* mesh edges follow creases of f = 0, where normals turn by more than so many degrees, 15 .. 170,
                       at a kink of f or within a sixteenth of the cell (a quarter, along such a crease); vertices go
                       to their corners and tips. Not with improve 0, and places where it is not safe stay as they
                       are. 0: creases are chamfered at the cell. Default 0. */
} batten_polygonize_options;
BATTEN_API batten_polygonize_options batten_polygonize_options_default(void);

typedef struct batten_polygonize_info {
  size_t evaluations;  /* points at which the field was evaluated, with or without gradient */
  size_t seeds_missed; /* seeds outside of the box, or without surface in their lattice cube and two around it */
  double cell;         /* what was used */
  double distance_max; /* max over the vertices of |f| / |grad f|, or of the width of an interval across the surface
                          in which f changes its sign (at kinks and jumps of f); caller's unit */
  int clipped;         /* the surface reaches the box and was cut cleanly there */
  size_t self_intersections; /* pairs of triangles that cross, see batten_mesh_self_intersections */
  size_t crease_vertices;    /* on creases, at their corners and at tips, with opt.sharp_deg */
  double time_track_s, time_improve_s;
} batten_polygonize_info;

/* The surface of the solid f >= 0, tracked from the seeds [seed_count][3] through the cells that it crosses;
 * triangles counter-clockwise seen from outside (f < 0). Marching tetrahedra on a body-centred lattice, one batch of
 * evaluations for each front, then rounds of edge splits, collapses, flips and smoothing on the surface; with
 * sharp_deg, edges along creases by the tangent planes beside them, and such rounds that keep to these. The result
 * is an oriented 2-manifold: closed, or with boundary loops that lie on the box (BATTEN_W_CLIPPED). Components
 * without a seed are not found, by design. A mesh that crosses itself is made again on a lattice of half, then a
 * quarter of the cell (and then half the edges). Same bits for any order of the seeds and any number of threads.
 *   field   three-dimensional; order 0 costs six evaluations for a gradient
 *   seeds   NULL with seed_count 0, opt.lower and opt.upper given, and a field with bounds: the whole surface in the
 *           box is found (batten_find_seeds with the cell; 0 = 1/60 of the box's diagonal)
 *   Progress phases: "search" (without seeds), "surface", "improve", "settle", "crossings", "sharpen".
 *   Cost of a smooth surface, by default: 5 to 7 evaluations of the field for each vertex of the result, in few large
 *   batches, and some 10 us of processor time for each triangle, in proportion to their number; seeds all over the
 *   surface make the first batch nearly all of the lattice. Memory: below 1 KB for each vertex of the result at the
 *   peak (the lattice makes four times as many triangles as stay), beside what the field takes for a batch of two to
 *   three points for each vertex.
 * Positive status: BATTEN_W_ACCURACY (accuracy is missed, or the mesh crosses itself), BATTEN_W_CLIPPED.
 * Fails: INVALID (also: the field is not finite somewhere, the text names the point), NOMEM, TOO_LARGE (cells,
 * indices, evaluations_max), NOT_FOUND (f changes its sign near no seed), CANCELLED, and as the field fails. info may
 * be NULL, and is untouched on failure. */
BATTEN_API batten_status batten_polygonize(batten_context *ctx, const batten_field *field, size_t seed_count,
                                           const double *seeds, const batten_polygonize_options *opt,
                                           batten_mesh **out, batten_polygonize_info *info);

/* Points beside the surface f = 0 in a box, by the field's bounds: boxes whose bounds have one sign are left out, the
 * others halved until they are no larger than `cell`, and where neighbouring corners of these differ in sign there is
 * a seed between them. So no part of the surface is missed that the corners of cells of that size show. *seeds
 * [*count][n] is freed by batten_free(ctx, *seeds). n = 2 or 3. Cost: the cells near the surface. Progress phase
 * "search". Fails: INVALID (the field has no bounds, is not finite at a corner, box, cell), NOT_FOUND (no sign
 * changes: all inside, or all outside), TOO_LARGE (cell under a millionth of the box, too many boxes), NOMEM,
 * CANCELLED, as the field fails. */
BATTEN_API batten_status batten_find_seeds(batten_context *ctx, const batten_field *field, const double *lower,
                                           const double *upper, double cell, size_t *count, double **seeds);

/* ---- the outline f = 0 in the plane ------------------------------------------------------------- */

typedef struct batten_outline batten_outline;
/* As batten_polygonize in 2-D: evenly spaced polylines with the solid on their left, open ones (from box to box)
 * first. Without seeds as there. cell, lower, upper, accuracy, evaluations_max of opt count. Progress phases:
 * "search" (without seeds), "outline", "settle". */
BATTEN_API batten_status batten_trace_outline(batten_context *ctx, const batten_field *field, size_t seed_count,
                                              const double *seeds, const batten_polygonize_options *opt,
                                              batten_outline **out, batten_polygonize_info *info);
BATTEN_API void batten_outline_free(batten_outline *outline);
BATTEN_API size_t batten_outline_loop_count(const batten_outline *outline);
/* Vertices of a loop, [*count][2]; *closed non-zero: last joins first (which is not repeated). NULL beyond the last
 * loop; count, closed may be NULL. */
BATTEN_API const double *batten_outline_loop(const batten_outline *outline, size_t loop, size_t *count, int *closed);
BATTEN_API double batten_outline_area(const batten_outline *outline); /* holes subtract; NaN with open polylines */
BATTEN_API double batten_outline_length(const batten_outline *outline);

#ifdef __cplusplus
}
#endif
#endif
