/* What commands share that make a solid: its surface, fields on it, pictures, files, figures. */
#ifndef BATTEN_CLI_BODY_H
#define BATTEN_CLI_BODY_H

#include "cli.h"

typedef enum body_color { BODY_PLAIN = 0, BODY_GRADIENT, BODY_MEAN, BODY_GAUSS } body_color;

/* What the command line asks of a solid. */
typedef struct body_request {
  const char *box;
  batten_polygonize_options surface;
  batten_picture_options picture;
  body_color color;
  bool dots;
  batten_evaluation evaluation;
} body_request;
body_request body_request_default(void);

/* Keys of the options, which follow those of all commands; a command's own follow BODY_KEY_OWN. */
enum {
  BODY_KEY_PICTURE = CLI_KEY_OWN,
  BODY_KEY_SAVE,
  BODY_KEY_CELL,
  BODY_KEY_BOX,
  BODY_KEY_COLOR,
  BODY_KEY_DOTS,
  BODY_KEY_SHARP,
  BODY_KEY_OWN
};
#define BODY_OPTION_OUTPUT(planes) \
  { "output", 'o', "FILE", "surface, by extension: .ply .obj .stl .off .vtp .vtu .vtk" planes }
#define BODY_OPTION_SAVE \
  { "save", BODY_KEY_SAVE, "FILE", "the solid itself, as JSON that batten reads back to the same bits" }
#define BODY_OPTION_BOX(otherwise) \
  { "box", BODY_KEY_BOX, "X0,Y0[,Z0],X1,...", "cut the surface at this box; default: " otherwise }
#define BODY_SHARP_DEG 35 /* of stacks and trees */
#define BODY_OPTION_SHARP(otherwise)                                                                 \
  {                                                                                                  \
    "sharp", BODY_KEY_SHARP, "DEG",                                                                  \
        "mesh edges follow creases that turn by more than DEG degrees, 0 = none; default " otherwise \
  }
#define BODY_OPTION_COLOR \
  { "color", BODY_KEY_COLOR, "WHAT", "colour the picture by none, gradient, mean or gauss (curvature); default none" }
/* -o, pictures and the options above; false after a line on stderr. */
bool body_take(cli_request *common, body_request *q, int key, const char *value);

/* A solid on its way to files. */
typedef struct body {
  body_request *request;
  cli_request *common;
  cli_run *run;
  batten_solid *solid;
  batten_solid_evaluator *evaluator;      /* NULL: f is evaluated directly */
  batten_solid_evaluator_info evaluation; /* of the surface */
  batten_mesh *mesh;                      /* in space */
  batten_outline *outline;                /* in the plane */
  batten_polygonize_info surface;
  batten_mesh_measures measures;
  size_t self_intersections;
  double *color; /* [V] what the picture shows */
  double gradient_min, gradient_max;
  batten_status status; /* the first warning of the whole command */
  double time_surface_s, time_write_s;
} body;

/* What could not be checked before the dimension was known: outputs, --box. CLI_USAGE after a line on stderr. */
int body_check(body *b, unsigned dimension);
/* Tells a warning and keeps the first. */
void body_note(body *b, batten_status status);
/* The surface of b->solid, tracked from its points; its measures, gradient and curvatures of f at its vertices. cell:
 * where the command line does not say. */
batten_status body_mesh(body *b, double cell);
/* All outputs but the report to their staged names. */
batten_status body_write(body *b);
/* Puts all in place after report has been written; the exit status. */
int body_finish(body *b, const cli_report *report);
/* Frees mesh, outline and colours, not the solid. */
void body_free(body *b);

/* ---- body_fields.c ---- */

batten_status body_add_fields(body *b);
const double *body_color_values(const body *b); /* NULL = plain */

/* ---- body_figures.c ---- */

/* Keys of the surface, of its mesh, and of outlines; null where they do not apply. */
void body_report(const body *b, cli_report *r);
void body_print(const body *b);
/* Lines "time", "memory", "written"; fit: what came before the surface, with its name. */
void body_print_end(const body *b, const char *name, double seconds, double time_read_s);

#endif
