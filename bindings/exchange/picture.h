/* What the pictures share: an image in linear light, a coverage mask to draw into it, lettering, colours.
 *
 * Everything is drawn through the mask: shapes leave their coverage (0 .. 1 per pixel) there, then one call blends
 * a colour through it. So overlapping strokes of one colour do not darken each other, and antialiasing has one home.
 * Pixel (x, y) covers [x, x+1) x [y, y+1), y downwards. */
#ifndef BATTEN_EXCHANGE_PICTURE_H
#define BATTEN_EXCHANGE_PICTURE_H

#include <batten/exchange.h>
#include <stdbool.h>

enum { PICTURE_SIDE_MIN = 16, PICTURE_SIDE_MAX = 8192, PICTURE_TICK_SIZE = 64 };

typedef struct picture_color {
  float r, g, b; /* linear light, 0 .. 1 */
} picture_color;

typedef struct picture_image {
  size_t width, height;
  float *rgb;                                         /* [height][width][3] linear light */
  float *mask;                                        /* [height][width] coverage; zero between drawings */
  size_t dirty_x0, dirty_y0, dirty_x1, dirty_y1;      /* pixels of the mask that may be non-zero */
  size_t whole_x, whole_y, whole_width, whole_height; /* where it lies in the whole picture, and the size of that */
} picture_image;

/* ---- image ---- */
batten_status picture_image_new(batten_context *ctx, size_t width, size_t height, picture_image *out);
void picture_image_free(batten_context *ctx, picture_image *image);
void picture_mask_capsule(picture_image *image, double x0, double y0, double x1, double y1, double radius);
/* Adds the signed area under a closed polygon, then picture_mask_fold makes coverage of the sum of all loops. */
void picture_mask_polygon(picture_image *image, size_t count, const double *xy);
void picture_mask_fold(picture_image *image);
void picture_mask_rectangle(picture_image *image, double x0, double y0, double x1, double y1);
/* What is seen where nothing is; one for the whole picture. */
picture_color picture_background(const picture_image *image, size_t x, size_t y);
/* Copies an image to its place in the whole. */
void picture_paste(const picture_image *image, picture_image *whole);
/* Blends color * opacity through the mask and clears it. */
void picture_blend(picture_image *image, picture_color color, double opacity);
/* PNG, 8 bit sRGB. */
batten_status picture_write_png(batten_context *ctx, const picture_image *image, const char *path);

/* ---- lettering ---- */
/* Into the mask: left end of the base line at (x, y), height of capitals in pixels. ASCII; others as '?'. */
void picture_mask_text(picture_image *image, double x, double y, double height, double weight, const char *text);
double picture_text_width(double height, const char *text);

/* ---- colours and numbers ---- */
picture_color picture_srgb(unsigned hex);                         /* 0xrrggbb as linear light */
picture_color picture_colormap(batten_picture_map map, double t); /* t in [0, 1]; NaN gives grey */
/* Part of a white stripe, 0 .. 1, about a value of which a pixel covers `width`: stripes as in BATTEN_MAP_STRIPES. */
double picture_stripe(double value, double width);
/* Ticks of [lower, upper]: at (first + i) * mantissa * 10^exponent, i < count, about `wanted` of them. */
typedef struct picture_ticks {
  long long first;
  int mantissa, exponent;
  size_t count;
} picture_ticks;
picture_ticks picture_ticks_choose(double lower, double upper, unsigned wanted);
double picture_tick_value(const picture_ticks *ticks, size_t i);
/* The shortest exact text of a tick, independent of the locale; text [PICTURE_TICK_SIZE]. */
void picture_tick_text(const picture_ticks *ticks, size_t i, char text[PICTURE_TICK_SIZE]);

bool picture_has_extension(const char *path, const char *extension); /* ".png", any case */
/* Options as given or default, checked: ranges, finite numbers. */
batten_status picture_check_options(batten_context *ctx, const batten_picture_options *opt, unsigned dimension,
                                    batten_picture_options *out);

/* ---- the mesh picture's parts ---- */
typedef struct picture_camera {
  double right[3], up[3], back[3]; /* back points from the scene to the camera */
  double distance;                 /* of the camera from the scene's origin along back */
  double offset[2];                /* of its axis, along right and up */
  double focal;                    /* pixels */
  double center[2];                /* pixel where the axis hits the image */
} picture_camera;

/* What becomes the unit ball about the origin, z upwards. */
typedef struct picture_ball {
  double center[3], radius;
  unsigned axis[3]; /* which coordinate of the mesh becomes x, y, z */
} picture_ball;
void picture_to_ball(const picture_ball *ball, const double *point, float out[3]);

/* The mesh in the unit ball, and its dots and lines. */
typedef struct picture_scene {
  size_t vertex_count, triangle_count, dot_count, segment_count;
  const uint32_t *triangles;
  float *vertices;     /* [V][3] */
  float *normals;      /* [V][3] of vertices, and others after these for corners at creases */
  uint32_t *normal_of; /* [3 F] of each corner, an index of normals; NULL: its vertex's */
  float *tones;        /* [V] in [0, 1] or NaN; NULL without colours. With stripes their values */
  batten_picture_map map;
  float period;    /* of the values of stripes, 0 = none */
  float *dots;     /* [dot_count][3] */
  float *segments; /* [segment_count][2][3] of all kinds of lines, one after the other */
  float dot_radius;
  float ground;                       /* height of the ground plane */
  bool shadows;                       /* on it; else it is not seen */
  bool both_sides;                    /* look alike */
  double progress_at, progress_share; /* of the whole picture, before it and its own */
} picture_scene;
/* 40 degrees: triangles that lean farther from each other are parted by an edge. */
static const float picture_crease_cosine = 0.766f;
void picture_face_normal(const picture_scene *s, const uint32_t v[3], float out[3]);
/* Gives the corners of triangles at creases normals of their own. Fails: NOMEM, the scene stays as it was. */
batten_status picture_part_normals(batten_context *ctx, picture_scene *s);
/* Tells of progress with the scene, part in [0, 1]. */
batten_status picture_progress(batten_context *ctx, const picture_scene *scene, double part);

/* A mesh with its options in a rectangle of the picture. */
typedef struct picture_view {
  const batten_mesh *mesh;  /* NULL: nothing is drawn */
  batten_picture_options o; /* checked; width and height are the rectangle's */
  unsigned group;           /* views of one camera; 0 = by itself */
  size_t x0, y0;            /* of the rectangle in the whole */
  double unit, left;        /* height of lettering, and where titles begin */
  picture_ball ball;
  picture_scene scene;
  picture_camera camera;
} picture_view;
/* Checks a view's mesh; name goes before the text of an error, and may be empty. */
batten_status picture_check_mesh(batten_context *ctx, const picture_view *view, const char *name);
/* Balls, scenes and cameras of all views, and settles the ranges of their colours. Views may be empty or made partly:
 * picture_views_free frees all. */
batten_status picture_views_make(batten_context *ctx, size_t count, picture_view *views);
void picture_views_free(batten_context *ctx, size_t count, picture_view *views);

/* What is seen in each of width * height * samples^2 points of the image. */
typedef struct picture_buffer {
  size_t width, height; /* of the samples' grid */
  unsigned samples;     /* per pixel and direction */
  float *nearness;      /* 1 / distance along the camera's axis, 0 = background */
  uint32_t *item;       /* triangle, or triangle_count + dot */
  float *screen;        /* [V][3]: x, y in samples, nearness */
} picture_buffer;

batten_status picture_rasterize(batten_context *ctx, const picture_scene *scene, const picture_camera *camera,
                                picture_buffer *buffer);
/* Vertices seen along a beam: at [V][3] their places in the map and along the beam, cells [V] codes of the cells
 * there.
 */
typedef struct picture_turned {
  float *at;
  uint32_t *cells;
} picture_turned;
/* Depth of a scene seen from infinity along a direction: map [size][size] over the square [-1, 1]^2 of (u, v), holds
 * the largest coordinate along d, -2 where there is nothing; size < 2^14. turned is work space. */
void picture_depth_map(const picture_scene *scene, const float u[3], const float v[3], const float d[3], size_t size,
                       picture_turned turned, float *map);
/* Screen position in samples, and nearness. */
void picture_project(const picture_camera *camera, unsigned samples, const float point[3], float screen[3]);
typedef struct picture_stroke {
  picture_color color;
  double width;            /* pixels */
  double strength, hidden; /* opacity where nothing is in front of a line, and elsewhere */
} picture_stroke;
/* Lines [count][2][3] of the scene. */
void picture_draw_lines(picture_image *image, const picture_buffer *buffer, const picture_camera *camera,
                        size_t count, const float *lines, const picture_stroke *stroke);
batten_status picture_shade(batten_context *ctx, const picture_scene *scene, const picture_camera *camera,
                            const picture_buffer *buffer, picture_image *image);

/* ---- lettering beside and about it ---- */
double picture_title_room(const batten_picture_options *o, double unit); /* at the top, pixels; 0 without a title */
void picture_draw_title(picture_image *image, const batten_picture_options *o, double unit, double left);
bool picture_has_color_bar(const batten_picture_options *o);
double picture_color_bar_room(const batten_picture_options *o, double unit); /* on the right */
void picture_draw_color_bar(picture_image *image, const batten_picture_options *o, double unit);
/* Axes: room on the left, right and below for their numbers; the walls of the box that are farther away with lines at
 * the ticks, and numbers along three of its edges. */
enum { PICTURE_AXES_LEFT = 7, PICTURE_AXES_RIGHT = 4, PICTURE_AXES_BELOW = 4, PICTURE_AXES_ABOVE = 2 }; /* units */
void picture_draw_axes(picture_image *image, const picture_view *view, const picture_buffer *buffer);
#endif
