/* Shaded view of a mesh. See picture.h for the parts: camera and scene are made here, then the samples of the
 * picture are found (picture_raster.c), lit (picture_shade.c), and title and colour bar are written over them. */
#include "picture.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/checked.h"

batten_picture_options batten_picture_options_default(void) {
  return (batten_picture_options){.struct_size = sizeof(batten_picture_options),
                                  .width = 1200,
                                  .height = 900,
                                  .azimuth_deg = 35,
                                  .elevation_deg = 22,
                                  .up_axis = 2};
}

bool picture_has_extension(const char *path, const char *extension) {
  size_t length = strlen(path), tail = strlen(extension);
  return length > tail && strcasecmp(path + length - tail, extension) == 0;
}

batten_status picture_check_options(batten_context *ctx, const batten_picture_options *opt, unsigned dimension,
                                    batten_picture_options *out) {
  batten_picture_options o = opt ? *opt : batten_picture_options_default();
  batten_status st = batten_check_struct(ctx, "batten_picture_options", o.struct_size, sizeof o);
  if (st < 0) return st;
  unsigned low = PICTURE_SIDE_MIN, high = PICTURE_SIDE_MAX;
  if (o.width < low || o.width > high || o.height < low || o.height > high)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.width x height: %u x %u; each must be %u .. %u pixels", o.width,
                       o.height, low, high);
  if (!isfinite(o.azimuth_deg) || !isfinite(o.elevation_deg) || fabs(o.elevation_deg) > 90)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "opt.azimuth_deg, elevation_deg: %g, %g; must be finite, the elevation within -90 .. 90",
                       o.azimuth_deg, o.elevation_deg);
  if (o.up_axis > 2)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.up_axis: %u; must be 0 (x), 1 (y) or 2 (z)", o.up_axis);
  if (o.point_count && !o.points)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.points: NULL with opt.point_count = %zu", o.point_count);
  size_t numbers;
  if (!batten_mul(o.point_count, dimension, &numbers))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "opt.point_count: %zu is too many", o.point_count);
  size_t bad = batten_first_nonfinite(numbers, o.points);
  if (bad < numbers)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.points[%zu]: coordinate %zu is not finite", bad / dimension,
                       bad % dimension);
  if (!isfinite(o.color_lower) || !isfinite(o.color_upper) || o.color_lower > o.color_upper)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.color_lower, color_upper: %g, %g; must be finite and in order",
                       o.color_lower, o.color_upper);
  if ((unsigned)o.color_map > BATTEN_MAP_STRIPES)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.color_map: %d; must be BATTEN_MAP_LIGHTNESS, RAINBOW or STRIPES",
                       (int)o.color_map);
  if (o.edge_count && !o.edges)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.edges: NULL with opt.edge_count = %zu", o.edge_count);
  if (!batten_mul(o.edge_count, 6, &numbers))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "opt.edge_count: %zu is too many", o.edge_count);
  bad = batten_first_nonfinite(numbers, o.edges);
  if (bad < numbers)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.edges[%zu][%zu]: coordinate %zu is not finite", bad / 6,
                       bad / 3 % 2, bad % 3);
  *out = o;
  return BATTEN_OK;
}

/* ---- scene --------------------------------------------------------------------------------------- */

typedef struct unit_ball {
  double center[3], radius;
  unsigned axis[3]; /* which coordinate becomes x, y, z (upwards) */
} unit_ball;

static void to_unit(const unit_ball *b, const double *p, float out[3]) {
  for (size_t k = 0; k < 3; k++) out[k] = (float)((p[b->axis[k]] - b->center[b->axis[k]]) / b->radius);
}

/* Ball about the middle of the box; halves first, so that the largest coordinates do not overflow. */
static unit_ball ball_of(size_t count, const double *points, unsigned up) {
  unit_ball b = {.axis = {(up + 1) % 3, (up + 2) % 3, up}};
  double lower[3], upper[3];
  memcpy(lower, points, sizeof lower);
  memcpy(upper, points, sizeof upper);
  for (size_t i = 0; i < 3 * count; i++) {
    lower[i % 3] = fmin(lower[i % 3], points[i]);
    upper[i % 3] = fmax(upper[i % 3], points[i]);
  }
  for (size_t k = 0; k < 3; k++) b.center[k] = 0.5 * lower[k] + 0.5 * upper[k];
  for (size_t i = 0; i < count; i++)
    b.radius = fmax(b.radius, hypot(hypot(points[3 * i] - b.center[0], points[3 * i + 1] - b.center[1]),
                                    points[3 * i + 2] - b.center[2]));
  if (!(b.radius > 0)) b.radius = 1;
  return b;
}

static int compare_doubles(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

/* Range of the colours: the caller's, else from the 1st to the 99th percentile, so that a few spikes do not make the
 * rest one colour. */
static batten_status color_range(batten_context *ctx, size_t count, batten_picture_options *o) {
  if (o->color_lower < o->color_upper || o->color_map == BATTEN_MAP_STRIPES) return BATTEN_OK;
  double *sorted = batten_alloc_array(ctx, count, sizeof *sorted);
  if (!sorted) return BATTEN_E_NOMEM;
  size_t n = 0;
  for (size_t i = 0; i < count; i++)
    if (isfinite(o->colors[i])) sorted[n++] = o->colors[i];
  qsort(sorted, n, sizeof *sorted, compare_doubles);
  o->color_lower = n ? sorted[(n - 1) / 100] : 0;
  o->color_upper = n ? sorted[n - 1 - (n - 1) / 100] : 1;
  if (!(o->color_lower < o->color_upper)) { /* one value everywhere: the middle colour */
    double margin = o->color_lower == 0 ? 1 : 0.5 * fabs(o->color_lower);
    o->color_lower -= margin;
    o->color_upper += margin;
  }
  batten_free(ctx, sorted);
  return BATTEN_OK;
}

static void scene_free(batten_context *ctx, picture_scene *s) {
  batten_free(ctx, s->vertices);
  batten_free(ctx, s->normals);
  batten_free(ctx, s->tones);
  batten_free(ctx, s->dots);
  batten_free(ctx, s->lines);
}

/* Given normals, scaled to length 1, replace the triangles' where there are any. */
static void take_normals(size_t count, const double *given, double *normals) {
  for (size_t i = 0; i < count; i++, given += 3, normals += 3) {
    double largest = fmax(fabs(given[0]), fmax(fabs(given[1]), fabs(given[2])));
    if (!(largest > 0) || !isfinite(given[0] + given[1] + given[2])) continue;
    double x = given[0] / largest, y = given[1] / largest, z = given[2] / largest,
           length = sqrt(x * x + y * y + z * z);
    normals[0] = x / length;
    normals[1] = y / length;
    normals[2] = z / length;
  }
}

static batten_status scene_make(batten_context *ctx, const batten_mesh *mesh, batten_picture_options *o,
                                picture_scene *out) {
  size_t V = batten_mesh_vertex_count(mesh);
  const double *vertices = batten_mesh_vertices(mesh);
  picture_scene s = {.vertex_count = V,
                     .triangle_count = batten_mesh_triangle_count(mesh),
                     .dot_count = o->point_count,
                     .line_count = o->edge_count,
                     .map = o->color_map,
                     .period = (float)(o->color_upper - o->color_lower),
                     .triangles = batten_mesh_triangles(mesh),
                     .ground = INFINITY};
  double *normals = batten_alloc_array(ctx, V, 3 * sizeof *normals);
  s.vertices = batten_alloc_array(ctx, V, 3 * sizeof *s.vertices);
  s.normals = batten_alloc_array(ctx, V, 3 * sizeof *s.normals);
  s.dots = batten_alloc_array(ctx, s.dot_count, 3 * sizeof *s.dots);
  s.tones = o->colors ? batten_alloc_array(ctx, V, sizeof *s.tones) : NULL;
  batten_status st = BATTEN_E_NOMEM;
  s.lines = batten_alloc_array(ctx, s.line_count, 6 * sizeof *s.lines);
  if (!normals || !s.vertices || !s.normals || !s.dots || !s.lines || (o->colors && !s.tones)) goto done;
  st = batten_mesh_vertex_normals(ctx, mesh, normals);
  if (o->normals) take_normals(V, o->normals, normals);
  if (st >= 0 && o->colors) st = color_range(ctx, V, o);
  if (st < 0) goto done;
  unit_ball ball = ball_of(V, vertices, o->up_axis);
  for (size_t i = 0; i < V; i++) {
    to_unit(&ball, vertices + 3 * i, s.vertices + 3 * i);
    for (size_t k = 0; k < 3; k++) s.normals[3 * i + k] = (float)normals[3 * i + ball.axis[k]];
    s.ground = fminf(s.ground, s.vertices[3 * i + 2]);
    if (s.tones)
      s.tones[i] = (float)(o->color_map == BATTEN_MAP_STRIPES
                               ? o->colors[i]
                               : (o->colors[i] - o->color_lower) / (o->color_upper - o->color_lower));
  }
  for (size_t i = 0; i < s.dot_count; i++) to_unit(&ball, o->points + 3 * i, s.dots + 3 * i);
  for (size_t i = 0; i < 2 * s.line_count; i++) to_unit(&ball, o->edges + 3 * i, s.lines + 3 * i);
  /* Dots cover a share of the surface, whatever their number, between just visible and not clumsy. */
  if (s.dot_count) s.dot_radius = fminf(0.016f, fmaxf(0.0035f, 0.3f / sqrtf((float)s.dot_count)));
  *out = s;
  st = BATTEN_OK;
done:
  batten_free(ctx, normals);
  if (st < 0) scene_free(ctx, &s);
  return st;
}

/* ---- camera -------------------------------------------------------------------------------------- */

/* The frame of the picture that the thing fills, in pixels. */
typedef struct view_box {
  double x0, y0, x1, y1;
} view_box;

/* The nearest camera of 24 degrees that sees everything within the box. A point is inside the left and right
 * planes when |a - offset| <= t (distance - c), a and c its coordinates along right and back: two linear bounds on
 * offset and distance, so the best of both comes from two maxima; the same upwards. */
static picture_camera camera_fit(const picture_scene *s, const batten_picture_options *o, view_box box) {
  const double degree = 0.017453292519943295;
  double sa = sin(o->azimuth_deg * degree), ca = cos(o->azimuth_deg * degree);
  double se = sin(o->elevation_deg * degree), ce = cos(o->elevation_deg * degree);
  picture_camera c = {.right = {-sa, ca, 0}, .up = {-se * ca, -se * sa, ce}, .back = {ce * ca, ce * sa, se}};
  c.focal = 0.5 * fmin(o->width, o->height) / tan(12 * degree);
  c.center[0] = 0.5 * (box.x0 + box.x1);
  c.center[1] = 0.5 * (box.y0 + box.y1);
  double tangent[2] = {0.5 * (box.x1 - box.x0) / c.focal, 0.5 * (box.y1 - box.y0) / c.focal};
  double most[2][2] = {{-INFINITY, -INFINITY}, {-INFINITY, -INFINITY}};
  const double *axes[2] = {c.right, c.up};
  for (size_t i = 0; i < s->vertex_count; i++) {
    const float *p = s->vertices + 3 * i;
    double depth = c.back[0] * p[0] + c.back[1] * p[1] + c.back[2] * p[2];
    for (size_t k = 0; k < 2; k++) {
      double a = axes[k][0] * p[0] + axes[k][1] * p[1] + axes[k][2] * p[2];
      most[k][0] = fmax(most[k][0], a + tangent[k] * depth);
      most[k][1] = fmax(most[k][1], -a + tangent[k] * depth);
    }
  }
  c.distance = 2.5; /* out of the unit ball, also for a mesh that is a point from here */
  for (size_t k = 0; k < 2; k++) {
    c.distance = fmax(c.distance, 0.5 * (most[k][0] + most[k][1]) / tangent[k]);
    c.offset[k] = 0.5 * (most[k][0] - most[k][1]);
  }
  return c;
}

/* ---- lettering over it --------------------------------------------------------------------------- */

static picture_ticks color_ticks(const batten_picture_options *o) {
  return picture_ticks_choose(o->color_lower, o->color_upper, 6);
}

/* The bar's own width, the numbers to its right, and a margin; all in units of the lettering's height. */
static const double bar_width = 1.2, bar_to_numbers = 0.75, bar_margin = 0.8;

static double color_bar_room(const batten_picture_options *o, double unit) {
  picture_ticks ticks = color_ticks(o);
  double numbers = 0;
  for (size_t i = 0; i < ticks.count; i++) {
    char text[PICTURE_TICK_SIZE];
    picture_tick_text(&ticks, i, text);
    numbers = fmax(numbers, picture_text_width(unit, text));
  }
  return fmax(7 * unit, (bar_width + bar_to_numbers + bar_margin) * unit + numbers);
}

/* Over the bar; in two lines, parted at the last blank, where one would reach into the view. */
static void draw_color_label(picture_image *im, const char *label, double x, double base, double unit) {
  double end = (double)im->width - bar_margin * unit;
  const char *blank = picture_text_width(unit, label) > end - x ? strrchr(label, ' ') : NULL;
  char first[128];
  size_t length = blank ? (size_t)(blank - label) : 0;
  if (length > 0 && length < sizeof first) {
    memcpy(first, label, length);
    first[length] = '\0';
    picture_mask_text(im, fmin(x, end - picture_text_width(unit, first)), base - 1.6 * unit, unit, 1, first);
    label = blank + 1;
  }
  picture_mask_text(im, fmin(x, end - picture_text_width(unit, label)), base, unit, 1, label);
}

/* Vertical bar in [x, x + width] x [top, bottom] with ticks and numbers to its right. */
static void draw_color_bar(picture_image *im, const batten_picture_options *o, double x, double top, double bottom,
                           double unit) {
  double width = bar_width * unit;
  for (size_t y = (size_t)top; y < (size_t)bottom; y++) {
    picture_mask_rectangle(im, x, (double)y, x + width, (double)y + 1);
    picture_blend(im, picture_colormap(o->color_map, (bottom - (double)y - 0.5) / (bottom - top)), 1);
  }
  const picture_color ink = picture_srgb(0x2a2d33);
  picture_ticks ticks = color_ticks(o);
  for (size_t i = 0; i < ticks.count; i++) {
    double t = (picture_tick_value(&ticks, i) - o->color_lower) / (o->color_upper - o->color_lower);
    double y = bottom - t * (bottom - top);
    if (y < top - 0.5 || y > bottom + 0.5) continue;
    char text[PICTURE_TICK_SIZE];
    picture_tick_text(&ticks, i, text);
    picture_mask_capsule(im, x + width, y, x + width + 0.4 * unit, y, 0.05 * unit);
    picture_mask_text(im, x + width + bar_to_numbers * unit, y + 0.5 * unit, unit, 1, text);
  }
  if (o->color_label) draw_color_label(im, o->color_label, x, top - 1.1 * unit, unit);
  picture_blend(im, ink, 0.9);
}

batten_status batten_picture_mesh(batten_context *ctx, const batten_mesh *mesh, const batten_picture_options *opt,
                                  const char *path) {
  batten_picture_options o;
  batten_status st = picture_check_options(ctx, opt, 3, &o);
  if (st < 0) return st;
  if (!picture_has_extension(path, ".png"))
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: unknown extension for a picture of a mesh; use .png", path);
  size_t V = batten_mesh_vertex_count(mesh), F = batten_mesh_triangle_count(mesh), bad;
  if (F == 0) return batten_fail(ctx, BATTEN_E_INVALID, "%s: the mesh has no triangles to draw", path);
  if (F > UINT32_MAX - 1 || o.point_count > UINT32_MAX - 1 - F)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu triangles and %zu points: at most %u together", F, o.point_count,
                       UINT32_MAX - 1);
  if ((bad = batten_first_nonfinite(3 * V, batten_mesh_vertices(mesh))) < 3 * V)
    return batten_fail(ctx, BATTEN_E_INVALID, "mesh: vertex %zu is not finite", bad / 3);

  picture_scene scene = {0};
  picture_image image = {0};
  /* 3 x 3 samples a pixel; 2 x 2 for very large pictures, whose pixels are small to the eye anyway. */
  unsigned samples = (size_t)o.width * o.height > 6000000 ? 2 : 3;
  picture_buffer buffer = {
      .width = (size_t)o.width * samples, .height = (size_t)o.height * samples, .samples = samples};
  double unit = fmax(7, fmin(o.width, o.height) / 52.0), top = o.title ? 3.4 * unit : 0;
  double margin = 0.055 * fmin(o.width, o.height), bar = 0;
  bool has_bar = o.colors && o.color_map != BATTEN_MAP_STRIPES;
  st = scene_make(ctx, mesh, &o, &scene); /* which settles the range of the colours */
  if (st < 0) return st;
  if (has_bar) bar = color_bar_room(&o, unit);
  buffer.nearness = batten_alloc_array(ctx, buffer.width * buffer.height, sizeof *buffer.nearness);
  buffer.item = batten_alloc_array(ctx, buffer.width * buffer.height, sizeof *buffer.item);
  buffer.screen = batten_alloc_array(ctx, V, 3 * sizeof *buffer.screen);
  st = buffer.nearness && buffer.item && buffer.screen ? picture_image_new(ctx, o.width, o.height, &image)
                                                       : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  view_box box = {margin, top + margin, o.width - margin - bar, o.height - 1.3 * margin};
  picture_camera camera = camera_fit(&scene, &o, box);
  st = picture_rasterize(ctx, &scene, &camera, &buffer);
  if (st >= 0) st = picture_shade(ctx, &scene, &camera, &buffer, &image);
  if (st < 0) goto done;
  picture_draw_lines(&image, &buffer, &camera, scene.line_count, scene.lines, 0.085 * unit);
  if (has_bar) draw_color_bar(&image, &o, o.width - bar, 0.25 * o.height, 0.75 * o.height, unit);
  if (o.title) {
    picture_mask_text(&image, 1.8 * unit, 3.2 * unit, 1.25 * unit, 1.15, o.title);
    picture_blend(&image, picture_srgb(0x2a2d33), 0.95);
  }
  st = picture_write_png(ctx, &image, path);
done:
  picture_image_free(ctx, &image);
  batten_free(ctx, buffer.screen);
  batten_free(ctx, buffer.item);
  batten_free(ctx, buffer.nearness);
  scene_free(ctx, &scene);
  return st;
}
