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

/* Named numbers at the vertices: values [V][components], components 1 .. 9; copied; replaces one of the same name. */
BATTEN_API batten_status batten_mesh_set_field(batten_context *ctx, batten_mesh *mesh, const char *name,
                                               size_t components, const double *values);
BATTEN_API size_t batten_mesh_field_count(const batten_mesh *mesh);
BATTEN_API const double *batten_mesh_field(const batten_mesh *mesh, size_t index, const char **name,
                                           size_t *components);

/* normals [V][3]: unit, angle-weighted; 0 at vertices without area. */
BATTEN_API batten_status batten_mesh_vertex_normals(batten_context *ctx, const batten_mesh *mesh, double *normals);

typedef struct batten_mesh_measures {
  size_t vertices, edges, triangles; /* vertices: those in use */
  size_t components;
  int closed;               /* no boundary edge, and at least one triangle */
  int manifold;             /* every edge in <= 2 triangles, every vertex's triangles one fan */
  int oriented;             /* neighbours agree */
  size_t boundary_edges, boundary_loops, nonmanifold_edges, nonmanifold_vertices;
  long euler;               /* V - E + F */
  long genus;               /* total over the components of a closed oriented manifold, else -1 */
  double area;
  double volume;            /* signed; NaN unless closed and oriented */
  double centroid[3];       /* of the enclosed volume when closed, else of the surface */
  double inertia[3][3];     /* of the enclosed volume about the centroid, unit density; NaN unless closed */
  double lower[3], upper[3];
  double angle_min_deg, angle_max_deg;
  double angles_above_20deg; /* share of triangles with all angles >= 20 degrees */
  double edge_min, edge_mean, edge_max;
} batten_mesh_measures;
/* Time O(F log F). */
BATTEN_API batten_status batten_mesh_measure(batten_context *ctx, const batten_mesh *mesh,
                                             batten_mesh_measures *out);

/* Pairs of triangles that cross each other (neighbours that share a vertex are tested for overlap). Exact
 * up to rounding of the orientation tests; time O(F log F) for even meshes. */
BATTEN_API batten_status batten_mesh_self_intersections(batten_context *ctx, const batten_mesh *mesh,
                                                        size_t *pairs);

/* ---- the surface f = 0 -------------------------------------------------------------------------- */

typedef struct batten_polygonize_options {
  size_t struct_size;
  double cell;        /* edge length aimed at, caller's unit; 0 = from the seeds' spacing and box. Default 0. */
  double lower[3], upper[3]; /* clip box; all 0 = the seeds' box grown by 25 % (surface beyond it is cut) */
  double accuracy;    /* |f| / |grad f| over the box diagonal at every vertex. Default 1e-6. */
  unsigned improve;   /* rounds of mesh improvement. Default 8. */
  size_t evaluations_max; /* give up above so many field evaluations, 0 = none. Default 0. */
} batten_polygonize_options;
BATTEN_API batten_polygonize_options batten_polygonize_options_default(void);

typedef struct batten_polygonize_info {
  size_t evaluations;  /* points at which the field was evaluated */
  size_t seeds_missed; /* seeds with no surface within two cells */
  double cell;         /* what was used */
  double distance_max; /* max |f| / |grad f| over the vertices, caller's unit */
  int clipped;         /* the surface reaches the box and was cut cleanly there */
  size_t self_intersections; /* pairs of triangles that cross, see batten_mesh_self_intersections */
  double time_track_s, time_improve_s;
} batten_polygonize_info;

/* The surface of the solid f >= 0 through the cells that it crosses near the seeds [seed_count][3] and on from
 * there; triangles counter-clockwise seen from outside (f < 0). The result is a closed oriented 2-manifold, or one
 * with boundary loops on the box (BATTEN_W_CLIPPED). Components without a seed are not found, by design.
 * Fails: INVALID, NOMEM, TOO_LARGE, NOT_FOUND (no seed has f = 0 near it), CANCELLED. info may be NULL. */
BATTEN_API batten_status batten_polygonize(batten_context *ctx, const batten_field *field, size_t seed_count,
                                           const double *seeds, const batten_polygonize_options *opt,
                                           batten_mesh **out, batten_polygonize_info *info);

/* ---- the outline f = 0 in the plane ------------------------------------------------------------- */

typedef struct batten_outline batten_outline;
/* As batten_polygonize in 2-D: polylines with the solid on their left. cell, lower, upper, accuracy of opt count. */
BATTEN_API batten_status batten_trace_outline(batten_context *ctx, const batten_field *field, size_t seed_count,
                                              const double *seeds, const batten_polygonize_options *opt,
                                              batten_outline **out, batten_polygonize_info *info);
BATTEN_API void batten_outline_free(batten_outline *outline);
BATTEN_API size_t batten_outline_loop_count(const batten_outline *outline);
/* Vertices of a loop, [*count][2]; *closed non-zero: last joins first (which is not repeated). */
BATTEN_API const double *batten_outline_loop(const batten_outline *outline, size_t loop, size_t *count, int *closed);
BATTEN_API double batten_outline_area(const batten_outline *outline);   /* signed, holes subtract */
BATTEN_API double batten_outline_length(const batten_outline *outline);

#ifdef __cplusplus
}
#endif
#endif
