/* batten-exchange: files and pictures. A library of its own; the kernel does not know that files exist.
 *
 * Formats are told by the extension (a trailing .gz is decompressed while reading) and, for PLY, STL and OFF, by
 * the content. Numbers are read and written independent of the locale; every double that is written in text reads
 * back to the same bits. Files are written beside their name and moved into place when whole: nothing half-written
 * stays. Errors say file, line (or byte offset), what is wrong and what would be right. Declared counts are believed
 * only as far as the file holds data. */
#ifndef BATTEN_EXCHANGE_H
#define BATTEN_EXCHANGE_H

#include <batten/batten.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- points ------------------------------------------------------------------------------------- */

typedef struct batten_cloud {
  unsigned n;         /* 2 or 3 */
  size_t count;
  double *points;     /* [count][n] */
  double *normals;    /* [count][n] or NULL; columns of zeros count as none */
  double *parameters; /* [count][2] u v, or NULL */
  double *weights;    /* [count] or NULL */
} batten_cloud;

typedef struct batten_read_points_options {
  size_t struct_size;
  unsigned n;       /* 2 or 3; 0 = as the file has: text of 2 columns (or 4: with normals) is planar. Default 0. */
} batten_read_points_options;
BATTEN_API batten_read_points_options batten_read_points_options_default(void);

/* By extension, each also with .gz:
 *   .xyz .txt .csv .tsv .asc .dat   text: separated by semicolons, else commas, else blanks; # % // comments. Without
 *             names 2 columns are x y, 3 x y z, 4 x y nx ny, 6 x y z nx ny nz; others need a line of names above the
 *             numbers (also as a comment), from which x, y, z, nx, ny, nz, the parameters u, v and the weight w (or
 *             "weight") are taken in any order. Of tables of offsets (see batten_read_contours) all rows are points
             (station, half-breadth, waterline). Lines "contour N" are passed over.
 *   .ply      ASCII and both binary orders; nx ny nz are the normals, u v the parameters, w or weight the weights; the
 *             vertices are planar without z
 *   .obj      v and vn: normals where every vertex has one      .off  also NOFF, COFF, STOFF
 *   .stl      ASCII and binary; the corners, equal ones once
 * Numbers must be finite. Free with batten_cloud_free. Fails: IO, FORMAT, INVALID (unknown extension: lists the
 * known), NOMEM, TOO_LARGE, CANCELLED; *out untouched then. */
BATTEN_API batten_status batten_read_points(batten_context *ctx, const char *path,
                                            const batten_read_points_options *opt, batten_cloud *out);
BATTEN_API void batten_cloud_free(batten_context *ctx, batten_cloud *cloud);

/* ---- meshes ------------------------------------------------------------------------------------- */

/* .ply .obj .off .stl, each also with .gz. Polygons are cut into fans around their first corner; equal corners of STL
 * become one vertex, and triangles that lose a corner by that are dropped. Further numbers at the vertices of PLY and
 * the normals of PLY and NOFF become fields of one component (normals: nx, ny, nz). Fails as batten_read_points. */
BATTEN_API batten_status batten_read_mesh(batten_context *ctx, const char *path, batten_mesh **out);

/* .ply (binary little endian, double; all fields, those of several components as NAME_0, NAME_1, ...), .obj, .off,
 * .stl (binary, single precision), and VTK's XML .vtp and .vtu and older .vtk with all fields. Fails: IO, INVALID (unknown extension:
 * lists the known; STL beyond single precision), NOMEM; what stood under the name is then as it was. */
BATTEN_API batten_status batten_write_mesh(batten_context *ctx, const batten_mesh *mesh, const char *path);

/* Outlines of plane solids: .svg, .csv .xyz .txt (x y; a blank line between loops, closed ones end with their first
 * corner again), .vtp, .obj (lines). Fails as batten_write_mesh. */
BATTEN_API batten_status batten_write_outline(batten_context *ctx, const batten_outline *outline, const char *path);

/* ---- batten's own JSON documents ---------------------------------------------------------------- */

/* {"batten": "solid", "version": 1, ...}; carriers nest, also solids in carriers. Evaluates to the same bits when it
 * is back. A callback carrier cannot be saved: INVALID. Loading checks everything and names the place:
 * "a.json: solid.spline.centers[17][2]: ..." (FORMAT). While a document is parsed, its tree is in memory that is not
 * the context's: the JSON library (Jansson) has one allocator for the whole process, which is the host's to set. */
BATTEN_API batten_status batten_save_solid(batten_context *ctx, const batten_solid *solid, const char *path);
BATTEN_API batten_status batten_load_solid(batten_context *ctx, const char *path, batten_solid **out);
/* A carrier alone: {"batten": "carrier", "version": 1, "carrier": {...}}. */
BATTEN_API batten_status batten_save_carrier(batten_context *ctx, const batten_carrier *carrier, const char *path);
BATTEN_API batten_status batten_load_carrier(batten_context *ctx, const char *path, batten_carrier **out);

/* ---- quadratic programs ------------------------------------------------------------------------- */

/* A problem with the arrays that it points to. Matrices are sparse, but those that a JSON document has as dense rows. */
typedef struct batten_qp_file {
  batten_qp_problem problem;
  double *x0;     /* [n] start of the file, or NULL; opt.x0 */
  char *name;     /* of the problem, as the file says; "" = none */
  char **unknown_names, **row_names; /* [n], [m] as the file says, or NULL */
  void *memory;   /* batten's own */
} batten_qp_file;

/* By extension, each also with .gz; docs/files.md has the rules:
 *   .qps .sif .mps   fixed or free columns, told apart line by line: NAME OBJSENSE ROWS COLUMNS RHS RANGES BOUNDS QUADOBJ
 *                    QMATRIX QSECTION ENDATA. A problem to be maximised comes as its negative. Integer unknowns and
 *                    quadratic constraints are refused.
 *   .json            batten "qp"
 *   .mat             MATLAB level 5 with P q r l u A, as the Maros-Meszaros problems are handed on; where the last n rows
 *                    of A are the identity, they are the bounds of x
 * Bounds and sides of size 9e19 and more in QPS and MATLAB files are none (they mean 1e20, some less a constant).
 * Free with batten_qp_file_free. Fails: IO, FORMAT, INVALID (unknown extension: lists the known), NOMEM, TOO_LARGE,
 * CANCELLED; *out untouched then. While a JSON document is parsed, its tree is in memory that is not the context's. */
BATTEN_API batten_status batten_read_qp(batten_context *ctx, const char *path, batten_qp_file *out);

/* Frees what batten_read_qp made; a file that the caller has put together (memory = NULL) is only emptied. */
BATTEN_API void batten_qp_file_free(batten_context *ctx, batten_qp_file *file);

/* .json {"batten": "qp", "version": 1, ...}, which reads back to the same bits, or .qps .sif .mps (free columns,
 * minimise; least squares are refused, x0 is left out, blanks in names become _; the second side of a row that has
 * two is written as their distance, which may round). Names, name and x0 may be NULL, memory is not looked at. Fails:
 * IO, INVALID, TOO_LARGE, NOMEM; what stood under the name is then as it was. */
BATTEN_API batten_status batten_write_qp(batten_context *ctx, const batten_qp_file *file, const char *path);

/* .json {"batten": "qp_solution", "version": 1, "status": WORD, "x", "multipliers", "active"} (or "certificate", or
 * "ray", as the status has it), or .csv of x: NAME,VALUE a line, x1, x2, ... without names. n and m are of
 * file->problem; arrays of solution that are NULL are left out. WORD: optimal, inaccurate, stopped, infeasible,
 * unbounded, not convex, limit. Fails as batten_write_qp. */
BATTEN_API batten_status batten_write_qp_solution(batten_context *ctx, const batten_qp_file *file, batten_status status,
                                                  const batten_qp_solution *solution, const char *path);

/* The word that solutions and reports have for what batten_qp_solve returned: those listed above, or the status' own
 * name where it is none of them. Never NULL. */
BATTEN_API const char *batten_qp_status_word(batten_status status);

/* x, multipliers and active of a .json that batten_write_qp_solution wrote (also .gz), to start from (opt.x0,
 * opt.active) or to look at: each into the caller's array, [n] and [m + n] of file->problem, where solution has one;
 * the file must have that member then. certificate and ray are not looked at. Fails: IO, FORMAT (other sizes; no x,
 * as there was no solution), INVALID, NOMEM; the arrays are as they were then. */
BATTEN_API batten_status batten_read_qp_solution(batten_context *ctx, const batten_qp_file *file, const char *path,
                                                 batten_qp_solution *solution);

/* ---- minimum norm networks ---------------------------------------------------------------------- */

/* How a triangular patch becomes a surface of CAD files, which are quadrangular; all three are exact. */
typedef enum batten_cad_form {
  BATTEN_CAD_TRIMMED = 0, /* the parallelogram over the triangle, trimmed along its diagonal: one face a patch */
  BATTEN_CAD_QUADS,       /* three quadrangles a patch, cut at the middles of its sides and its centre: no trimming */
  BATTEN_CAD_DEGENERATE   /* a square with one side drawn together to the first corner, where it has no normal */
} batten_cad_form;
typedef enum batten_length_unit {
  BATTEN_UNIT_MM = 0,
  BATTEN_UNIT_CM,
  BATTEN_UNIT_M,
  BATTEN_UNIT_INCH
} batten_length_unit;
typedef enum batten_step_schema {
  BATTEN_STEP_AP214 = 0, /* automotive_design */
  BATTEN_STEP_AP242      /* managed_model_based_3d_engineering */
} batten_step_schema;

typedef struct batten_write_network_options {
  size_t struct_size;
  batten_length_unit unit;   /* STEP, IGES: what the coordinates are in. Default MM. */
  batten_cad_form form;      /* STEP, IGES. Default TRIMMED. */
  batten_step_schema schema; /* STEP. Default AP214. */
  const char *name;          /* STEP, IGES: of the product, UTF-8; NULL = the file's name without its extension */
  const char *time_stamp;    /* STEP, IGES: "2026-11-22T10:00:00"; NULL = "1970-01-01T00:00:00", so that the same
                                surface gives the same bytes */
  unsigned density;          /* meshes: segments of every edge, 1 .. 512. Default 8. */
  double tolerance;          /* meshes: as in batten_tessellate_options, caller's unit. Default 0. */
} batten_write_network_options;
BATTEN_API batten_write_network_options batten_write_network_options_default(void);

/* By extension:
 *   .step .stp  ISO 10303-21. Faces are B-spline surfaces of the patches' degree named "face 17" by the triangle
 *               ("face 17 part 2", "face 17 quad 2" where there are more), joined by shared edges and vertices. Closed
 *               components become solids, with those inside them as voids, open ones shells. Patches must meet at
 *               their corners and edges to 1e-9 of the size.
 *   .iges .igs  the same faces as trimmed surfaces (entities 128, 126, 142, 144), which know of no solids
 *   .json       {"batten": "network", "version": 1, ...}; reads back to the same bits
 *   .vtu        Bezier triangles of VTK 9, exact
 *   .ply .obj .off .stl .vtp .vtk   tessellated, see batten_network_tessellate
 * Fails: IO, INVALID (unknown extension: lists the known; patches that do not meet, named by their triangles),
 * TOO_LARGE, NOMEM, CANCELLED; what stood under the name is then as it was. */
BATTEN_API batten_status batten_write_network(batten_context *ctx, const batten_network *network,
                                              const batten_write_network_options *opt, const char *path);

/* .json (also .gz) as batten_write_network makes it. Checks everything and names the place: "a.json:
 * network.patches[17].control_points[3]: ..." (FORMAT). While it is parsed, its tree is in memory that is not the
 * context's. Fails: IO, FORMAT, INVALID (unknown extension), NOMEM, TOO_LARGE, CANCELLED; *out untouched then. */
BATTEN_API batten_status batten_read_network(batten_context *ctx, const char *path, batten_network **out);

/* ---- surfaces of tensor products ----------------------------------------------------------------- */

typedef struct batten_write_surface_options {
  size_t struct_size;
  batten_length_unit unit;   /* STEP, IGES: what the coordinates are in. Default MM. */
  batten_step_schema schema; /* STEP. Default AP214. */
  const char *name;          /* STEP, IGES: of the product, UTF-8; NULL = the file's name without its extension */
  const char *time_stamp;    /* STEP, IGES: as in batten_write_network_options */
  unsigned density;          /* meshes: segments of every span in either direction, 1 .. 1024. Default 16. */
  double tolerance;          /* meshes: as in batten_surface_tessellate_options, caller's unit. Default 0. */
} batten_write_surface_options;
BATTEN_API batten_write_surface_options batten_write_surface_options_default(void);

/* By extension:
 *   .step .stp  ISO 10303-21: a shell of one face "face 1", a B-spline surface of the same degree, knots and control
 *               points, bounded by its sides. Sides that are a point are no edges; sides that meet are one (a seam).
 *               Places nearer than 1e-7 of the size are one.
 *   .iges .igs  entity 128 as a face with its natural bounds (144)
 *   .json       {"batten": "surface", "version": 1, ...}; reads back to the same bits
 *   .vtu        Bezier quadrilaterals of VTK 9, one a span pair, exact; cell data "domain": u_0, u_1, v_0, v_1
 *   .ply .obj .off .stl .vtp .vtk   tessellated, see batten_surface_tessellate
 * Fails: IO, INVALID (unknown extension: lists the known; STEP and IGES: the control points span no area; STEP: two
 * neighbouring sides are points), TOO_LARGE, NOMEM, CANCELLED; what stood under the name is then as it was. */
BATTEN_API batten_status batten_write_surface(batten_context *ctx, const batten_surface *surface,
                                              const batten_write_surface_options *opt, const char *path);

/* .json (also .gz) as batten_write_surface makes it. Checks everything and names the place: "a.json:
 * surface.control_points[3][2]: ..." (FORMAT). While it is parsed, its tree is in memory that is not the context's.
 * Fails: IO, FORMAT, INVALID (unknown extension), NOMEM, TOO_LARGE, CANCELLED; *out untouched then. */
BATTEN_API batten_status batten_read_surface(batten_context *ctx, const char *path, batten_surface **out);

/* ---- contours and planar curves ----------------------------------------------------------------- */

/* Where the coordinates of a plane lie in space: origin + x axes[0] + y axes[1], axes of length 1 at right angles. */
typedef struct batten_plane {
  double origin[3], axes[2][3];
} batten_plane;

/* Where one of several parallel planes lies over a common base: its point (x, y) is matrix (x, y) + shift of the base
 * (as batten_curve_transform takes them) at that height. */
typedef struct batten_plane_place {
  double height, matrix[4], shift[2]; /* matrix row-major; the identity to the bit where axes are equal */
} batten_plane_place;
/* Parallel planes [count] (also those that face each other) as heights: *base has the axes of the first one, and of
 * its origins the one that is nearest to that of space; point (x, y) at a height is origin + x axes[0] + y axes[1] +
 * height (axes[0] x axes[1]). So of planes x, y or z = const all numbers stay, but that heights are -y. places [count]
 * as the planes come, in no order of heights. Fails: INVALID (planes turned by more than 1e-5 radians against the
 * first, named). */
BATTEN_API batten_status batten_plane_stack(batten_context *ctx, size_t count, const batten_plane *planes,
                                            batten_plane *base, batten_plane_place *places);
/* A surface of points (x, y, height) over a base, in space. Fails: INVALID, NOMEM. */
BATTEN_API batten_status batten_plane_lift(batten_context *ctx, const batten_plane *base, const batten_surface *surface,
                                           batten_surface **out);

/* Sequences of points, each in a plane. */
typedef struct batten_contours {
  size_t count;
  size_t *starts;       /* [count + 1] contour i has points starts[i] .. starts[i + 1] - 1 */
  double *points;       /* [starts[count]][2] */
  double *parameters;   /* [starts[count]] or NULL */
  double *weights;      /* [starts[count]] or NULL */
  batten_plane *planes; /* [count] or NULL: the file is planar */
} batten_contours;

/* Text (.txt .xyz .csv .tsv .asc, .dat where the first line may be a title, also .gz), one contour or several:
 *   blocks of lines "x y" or "x y z" parted by blank lines; or each after a line "contour N" (N points follow); or
 *   with a line of names above the numbers, of which x y z, t or "parameter", w or "weight" and contour or "curve"
 *   (its number or name; rows of one contour need not be neighbours) are taken. A .dat whose first numbers are as
 *   many points as two surfaces of an airfoil have (Lednicer's tables: each from the nose) becomes one contour from
 *   the trailing edge along the first surface to the nose and back along the second.
 *   or a table of offsets of a hull: with names of which one is half_breadth (half-breadth, halfbreadth) with x or
 *   station and z or waterline, or which are station, y and waterline; also x_m, "half-breadth [m]" and so on. Each
 *   station is an open contour of points (half-breadth, waterline) in its plane x = station, by ascending stations and
 *   waterlines, whatever the order of the rows is. Of half-breadths 0 that follow each other at the lower or upper end
 *   of a station only the one next to the hull stays; stations with fewer than two different points are left out.
 * Numbers are taken as they are: whether contours are closed is for the caller to know, who may find the first point
 * once more at the end. Points with z lie in one plane for each contour, to 1e-6 of its longest side. Where a
 * coordinate is constant, in all contours if there is one, the plane's axes are the other two in the order x y, x z,
 * y z, and the numbers stay; else it is the best plane, and its axes are these turned into it. Free with
 * batten_contours_free. Fails as batten_read_points. */
BATTEN_API batten_status batten_read_contours(batten_context *ctx, const char *path, batten_contours *out);
BATTEN_API void batten_contours_free(batten_context *ctx, batten_contours *contours);

/* ---- sections of solids, and scenes ---------------------------------------------------------------- */

typedef struct batten_read_sections_options {
  size_t struct_size;
  double gap; /* of a planar file of several contours, each a section then: their distance, along z. 0 = such files are
                 an error. Default 0. */
  int points; /* non-zero: points in no order (text, .ply .obj .off .stl), of which the planes are found. Default 0. */
} batten_read_sections_options;
BATTEN_API batten_read_sections_options batten_read_sections_options_default(void);

/* Sections as batten_stack_build takes them, in the order of the stack. */
typedef struct batten_section_set {
  size_t count;
  batten_section *sections; /* [count], with arrays of their own */
  size_t deck_count;        /* of tables of offsets: stations that are open above, else 0 */
  double *deck;             /* [deck_count][2] x and z of their highest points, by ascending x */
} batten_section_set;

/* Text, as batten_read_contours reads it: contours that lie in one plane (to 2e-6 of the size of all) are a section.
 *   Parallel planes (to 1e-5 radians) follow each other by height, all with the axes of one of them and the normal
 *   axes[0] x axes[1]: of planes z = const and x = const by ascending z and x, of y = const by descending y, and all
 *   numbers stay. Other planes follow each other from neighbour to neighbour, or as they come in the file if that way
 *   is not longer; each frame is that before it turned as little as possible, its origin the middle of the edges.
 *   Contours are closed: of three points or more, FORMAT where the first and the last are farther apart than 3 of the
 *   longest edge. Contours x y are one section, or with opt.gap sections z = 0, gap, 2 gap, ...
 * Tables of offsets of hulls: each run of positive half-breadths of a station, with the rows of 0 beside it, is a
 *   contour, mirrored to both sides (a bulb and the bow above it are two; at a single row of 0 between them both end a
 *   twentieth of a waterline before it). One that is open above goes straight on for two waterlines' distances and is
 *   closed there; deck tells where it really ends, and the caller cuts there. A side that leans inwards goes on until
 *   half of its breadth is left at most. A first or last station of nothing but zeros is a section of one or two
 *   points, from its lowest row to its highest (as far up as the section beside it, where that goes on): the stem, at
 *   which batten_stack_build closes the solid with opt.apex.
 * Points in no order, with opt.points: sections of one "contour" each, in the planes that hold three points or more
 *   across one direction, or else six or more; all points must lie in such planes, to 2e-6 of their size.
 * .json (also .gz): {"batten": "sections", "version": 1, "sections": [{"origin": [3], "rotation": [3][3], "contours":
 *   [[[x, y], ...], ...]}, ...]}; rotation may be left out: then it is the identity. All as it stands.
 * Free with batten_section_set_free. Fails as batten_read_contours; whether contours cross and rotations are some is
 * for batten_stack_build to tell. */
BATTEN_API batten_status batten_read_sections(batten_context *ctx, const char *path,
                                              const batten_read_sections_options *opt, batten_section_set *out);
BATTEN_API void batten_section_set_free(batten_context *ctx, batten_section_set *set);
/* .json as above, count >= 1; reads back to the same bits. Fails: IO, INVALID (unknown extension; starts that do not
 * ascend from 0, numbers that are not finite, named), NOMEM, CANCELLED; what stood under the name is then as it was. */
BATTEN_API batten_status batten_write_sections(batten_context *ctx, size_t count, const batten_section *sections,
                                               const char *path);

/* Trees of the algebra: {"batten": "frep", "version": 1, "nodes": {NAME: NODE, ...}, "root": NODE}; NODE is the name
 * of one of `nodes` or an object {"node": KIND, ...} with the arguments of KIND's constructor in <batten/frep.h>, the
 * nodes that it takes as "a" and "b"; see docs/files.md. Solids as leaves are inline or {"node": "solid", "file":
 * "heart.json"}, beside the scene. Saving: nodes that stand in several places are saved once, callbacks are INVALID.
 * Loading (.json, also .gz) names the place: "scene.json: root.b.radius: ..."; cycles, names of no node, arguments
 * that a node does not take are FORMAT; nodes that nothing is made of are checked as well. Fails: IO, FORMAT, INVALID
 * (unknown extension), NOMEM, TOO_LARGE, CANCELLED, and as constructors of nodes do; *out untouched then. */
BATTEN_API batten_status batten_save_frep(batten_context *ctx, const batten_frep *tree, const char *path);
BATTEN_API batten_status batten_load_frep(batten_context *ctx, const char *path, batten_frep **out);

typedef struct batten_write_curves_options {
  size_t struct_size;
  const batten_plane *planes; /* [count] where the curves lie; NULL = z = 0. Default NULL. */
  batten_length_unit unit;    /* STEP, IGES, SVG: what the coordinates are in. Default MM. */
  batten_step_schema schema;  /* STEP. Default AP214. */
  const char *name;           /* STEP, IGES: of the product, UTF-8; NULL = the file's name without its extension */
  const char *time_stamp;     /* STEP, IGES: as in batten_write_network_options */
  double tolerance;           /* .svg of degree above 3, .csv, .vtk, .vtp: distance of what is written from the curve,
                                 caller's unit; 0 = 1e-4 of the largest curve's size. Default 0. */
} batten_write_curves_options;
BATTEN_API batten_write_curves_options batten_write_curves_options_default(void);

/* Curves [count], by extension:
 *   .json       one: {"batten": "curve", "version": 1, "degree", "periodic", "knots", "control_points"}, several:
 *               {"batten": "contours", "version": 1, "curves": [{"degree", ...}, ...]}; a curve has "z" where its
 *               plane is horizontal, else, if there are planes, "plane": {"origin", "axes"}. Reads back to the same
 *               bits
 *   .step .stp  ISO 10303-21: a geometric curve set of B-spline curves with the same degree, knots and control
 *               points, named "curve 0", "curve 1", ...
 *   .iges .igs  entities 126, with their number and the normal of their plane
 *   .svg        paths of Bezier pieces with the plane coordinates, y upwards, exact to degree 3; the width and height
 *               are given in the unit
 *   .vtu        Bezier curve cells of VTK 9, one a span, exact; cell data "domain" (the span's ends) and "curve"
 *   .vtp .vtk   polylines within tolerance of the curves; point data "t" and "curvature", cell data "curve"
 *   .csv        curve,t,x,y[,z],curvature: the same points, z where there are planes; curves are numbered from 0.
 *               batten_read_contours reads them
 * A closed curve ends with its first point again. Curvatures are those of batten_curve_evaluate.
 * Fails: IO, INVALID (unknown extension: lists the known), TOO_LARGE, NOMEM, CANCELLED; what stood under the name is
 * then as it was. */
BATTEN_API batten_status batten_write_curves(batten_context *ctx, size_t count, const batten_curve *const *curves,
                                             const batten_write_curves_options *opt, const char *path);

typedef struct batten_curves {
  size_t count;
  batten_curve **curves; /* [count] */
  batten_plane *planes;  /* [count] or NULL */
} batten_curves;
/* .json (also .gz) as batten_write_curves makes it. Checks everything and names the place. Free with
 * batten_curves_free. Fails: IO, FORMAT, INVALID (unknown extension), NOMEM, TOO_LARGE; *out untouched then. */
BATTEN_API batten_status batten_read_curves(batten_context *ctx, const char *path, batten_curves *out);
BATTEN_API void batten_curves_free(batten_context *ctx, batten_curves *curves);

/* ---- kinds of files ------------------------------------------------------------------------------ */

/* What a file holds, by extension and content; only as much is read as that takes. Fails: IO, FORMAT. */
typedef enum batten_file_kind {
  BATTEN_FILE_UNKNOWN = 0,
  BATTEN_FILE_POINTS,
  BATTEN_FILE_MESH,
  BATTEN_FILE_SOLID,
  BATTEN_FILE_CARRIER,
  BATTEN_FILE_QP,
  BATTEN_FILE_NETWORK,
  BATTEN_FILE_SURFACE,
  BATTEN_FILE_CURVES,   /* one or several */
  BATTEN_FILE_DOCUMENT, /* another batten JSON document */
  BATTEN_FILE_SECTIONS, /* of solids */
  BATTEN_FILE_FREP      /* a tree of the algebra of solids */
} batten_file_kind;
BATTEN_API batten_status batten_file_identify(batten_context *ctx, const char *path, batten_file_kind *out);

/* ---- pictures ----------------------------------------------------------------------------------- */

typedef enum batten_picture_map { /* what colours a scalar has */
  BATTEN_MAP_LIGHTNESS = 0, /* dark blue over green to light yellow; keeps its order in grey and to the colour-blind */
  BATTEN_MAP_RAINBOW,       /* hues, red at the lower end over yellow, green, cyan to blue at the upper, as the figures of
                               Gaussian curvature have them in the paper on minimum norm networks */
  BATTEN_MAP_STRIPES,       /* zebra: white from whole numbers to the next half, black from there: reflection lines.
                               color_upper - color_lower, if not 0, is the period at which the scalar begins anew */
  BATTEN_MAP_PARTED         /* red below the middle of the range, paler towards it, blue above: for signs */
} batten_picture_map;

/* Lines of one kind. Each segment is short against the bends of the surface, if it lies on it. */
typedef struct batten_picture_lines {
  size_t count;
  const double *segments; /* [count][2][3] their ends */
  unsigned color;         /* 0xrrggbb */
  double width;           /* thousandths of the picture's shorter side, 0 .. 100; 0 = 1.6 */
  double hidden;          /* strength where something is in front of them, 0 .. 1; 0 = not drawn there */
} batten_picture_lines;

/* A box with scales about a mesh, as plots of functions have it. The box is in the mesh's coordinates, the numbers at
 * its ends may be others: a plot has the proportions that its mesh has. */
typedef struct batten_picture_axes {
  double lower[3], upper[3]; /* box, lower < upper */
  double from[3], to[3];     /* numbers at its ends, from < to */
  const char *labels[3];     /* NULL = none; ASCII */
} batten_picture_axes;

typedef struct batten_picture_options {
  size_t struct_size;
  unsigned width, height;  /* pixels, 16 .. 8192. Default 1200 x 900. */
  double azimuth_deg;      /* camera around the z axis from +x. Default 35. */
  double elevation_deg;    /* camera above the xy plane, -90 .. 90. Default 22. */
  unsigned up_axis;        /* 0, 1, 2: x, y or z points upwards; the camera's angles turn with it. Default 2. */
  size_t point_count;      /* data points drawn as dots, 0 = none */
  const double *points;    /* [point_count][3], for outlines [point_count][2] */
  const double *colors;    /* mesh: [V] scalar shown by colour, NULL = plain; grey where not finite */
  batten_picture_map color_map; /* Default LIGHTNESS. */
  double color_lower, color_upper; /* their range; equal = from the 1st to the 99th percentile. Default 0, 0. */
  const char *color_label; /* over the colour bar; NULL = none; ASCII */
  const char *title;       /* NULL = none; ASCII */
  const double *normals;   /* mesh: [V][3] to shade with, any length; NULL and rows of zeros: from the triangles. For
                              vertices that patches do not share */
  size_t line_count;       /* mesh: kinds of lines, 0 = none; later ones are drawn over earlier ones */
  const batten_picture_lines *lines; /* [line_count] */
  const batten_picture_axes *axes;   /* mesh: box with scales in place of a ground with shadows; NULL = none */
  const char *caption;     /* mesh: a smaller line below the title; NULL = none; ASCII */
  int no_color_bar;        /* mesh: non-zero: colours without their scale */
  double point_scale;      /* mesh: size of the dots, in that which suits their number, 0 .. 10; 0 = 1 */
  int both_sides;          /* mesh: non-zero: triangles look alike from both sides; else brown from behind */
} batten_picture_options;
BATTEN_API batten_picture_options batten_picture_options_default(void);

/* Shaded view of a mesh, or filled outline, made without a display: .png (both) or .svg (outline). */
BATTEN_API batten_status batten_picture_mesh(batten_context *ctx, const batten_mesh *mesh,
                                             const batten_picture_options *opt, const char *path);
/* Several meshes in one picture, in rows and columns of equal size.
 *   panels  [rows][columns], rows and columns 1 .. 16
 *   opt     of the whole: its width, height and title count; NULL = defaults
 *   path    .png
 * Fails: INVALID (names the panel), NOMEM, TOO_LARGE, CANCELLED, IO. */
typedef struct batten_picture_panel {
  const batten_mesh *mesh; /* NULL: nothing is drawn there */
  const batten_picture_options *opt; /* its width and height do not count; NULL = defaults */
  unsigned group; /* panels with the same number are seen by one camera, from where all of their meshes, axes and
                     lines are in view: so they have one scale; azimuth_deg, elevation_deg and up_axis must be the
                     same. 0 = by itself. */
} batten_picture_panel;
BATTEN_API batten_status batten_picture_panels(batten_context *ctx, unsigned rows, unsigned columns,
                                               const batten_picture_panel *panels, const batten_picture_options *opt,
                                               const char *path);
BATTEN_API batten_status batten_picture_outline(batten_context *ctx, const batten_outline *outline,
                                                const batten_picture_options *opt, const char *path);

/* What a layer of a plot in the plane draws. */
typedef enum batten_plot_kind {
  BATTEN_PLOT_LINE = 0, /* polylines */
  BATTEN_PLOT_AREA,     /* the inside of closed polylines; holes are turned the other way */
  BATTEN_PLOT_DOTS,     /* with a light rim */
  BATTEN_PLOT_CROSSES,
  BATTEN_PLOT_RINGS
} batten_plot_kind;

typedef struct batten_plot_layer {
  batten_plot_kind kind;
  size_t count; /* points, may be 0 */
  const double *points; /* [count][2] */
  size_t part_count;    /* polylines; 0 = one */
  const size_t *starts; /* [part_count + 1] polyline i has points starts[i] .. starts[i + 1] - 1 */
  int closed;           /* LINE: non-zero: from the last point back to the first */
  unsigned color;       /* 0xrrggbb */
  double width;         /* of lines; radius of marks: thousandths of the picture's shorter side, 0 .. 100; 0 = 2 (marks:
                           5 at most, less when they are many) */
  const char *label;    /* in the legend above the frame; NULL = none; ASCII */
  int beyond;           /* non-zero: does not widen the range that is shown */
} batten_plot_layer;

typedef struct batten_plot {
  size_t layer_count; /* 0: nothing is drawn there */
  const batten_plot_layer *layers; /* later ones over earlier ones; cut at the frame */
  int stretched;               /* non-zero: each axis has its own scale; 0: circles are round */
  double lower[2], upper[2];   /* the range that is shown; equal = all that the layers have and a margin */
  unsigned group;              /* plots with the same number show the same range; 0 = by itself */
  const char *caption;         /* above the frame; NULL = none; ASCII */
  const char *labels[2];       /* of the axes; NULL = none; ASCII */
} batten_plot;

/* Plots [rows][columns] in one picture: .png or .svg. Of opt its width, height and title count. Progress phase
 * "picture". Fails: INVALID (names the plot and layer), NOMEM, TOO_LARGE, CANCELLED, IO. */
BATTEN_API batten_status batten_picture_plots(batten_context *ctx, unsigned rows, unsigned columns,
                                              const batten_plot *plots, const batten_picture_options *opt,
                                              const char *path);

#ifdef __cplusplus
}
#endif
#endif
