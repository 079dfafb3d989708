/* Shaded views of meshes, one or several in a picture. See picture.h for the parts: scenes and cameras are made
 * (picture_scene.c), then for each view the samples of the picture are found (picture_raster.c), lit
 * (picture_shade.c), and lines, axes, title and colour bar are written over them. */
#include "picture.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/checked.h"

enum { PANELS_MAX = 16 }; /* in a row or column */

/* Height of lettering in a picture, or in a part of it: smaller there, but not by as much as the part is. */
static double lettering(double width, double height, double whole_width, double whole_height) {
  double whole = fmin(whole_width, whole_height), part = fmin(width, height);
  return fmax(7, sqrt(whole * part) / 52);
}

/* Where a title begins, in heights of the whole picture's lettering: panels below each other in line with it. */
static const double title_left = 1.8;

/* Pixels of a line's width; 1.6 thousandths unless said otherwise. In small pictures lines stay as they are in one of
 * 364 pixels. */
static double line_width(const batten_picture_lines *l, const picture_image *im) {
  double side = fmax(364, (double)(im->whole_width < im->whole_height ? im->whole_width : im->whole_height));
  return (l->width > 0 ? l->width : 1.6) * 1e-3 * side;
}

static void draw_lines(const picture_view *v, const picture_buffer *buffer, picture_image *image) {
  const float *segments = v->scene.segments;
  const double strength = 0.8;
  for (size_t i = 0; i < v->o.line_count; i++) {
    const batten_picture_lines *l = &v->o.lines[i];
    picture_stroke stroke = {picture_srgb(l->color), line_width(l, image), strength, strength * l->hidden};
    picture_draw_lines(image, buffer, &v->camera, l->count, segments, &stroke);
    segments += 6 * l->count;
  }
}

static batten_status draw_view(batten_context *ctx, const picture_view *v, picture_image *image) {
  /* 3 x 3 samples a pixel; 2 x 2 for very large pictures, whose pixels are small to the eye anyway. */
  unsigned samples = image->whole_width * image->whole_height > 6000000 ? 2 : 3;
  picture_buffer buffer = {.width = image->width * samples, .height = image->height * samples, .samples = samples};
  buffer.nearness = batten_alloc_array(ctx, buffer.width * buffer.height, sizeof *buffer.nearness);
  buffer.item = batten_alloc_array(ctx, buffer.width * buffer.height, sizeof *buffer.item);
  buffer.screen = batten_alloc_array(ctx, v->scene.vertex_count, 3 * sizeof *buffer.screen);
  batten_status st = buffer.nearness && buffer.item && buffer.screen ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0) st = picture_rasterize(ctx, &v->scene, &v->camera, &buffer);
  if (st >= 0) st = picture_shade(ctx, &v->scene, &v->camera, &buffer, image);
  if (st < 0) goto done;
  if (v->o.axes) picture_draw_axes(image, v, &buffer);
  draw_lines(v, &buffer, image);
  if (picture_has_color_bar(&v->o)) picture_draw_color_bar(image, &v->o, v->unit);
  picture_draw_title(image, &v->o, v->unit, v->left);
done:
  batten_free(ctx, buffer.screen);
  batten_free(ctx, buffer.item);
  batten_free(ctx, buffer.nearness);
  return st;
}

static batten_status check_path(batten_context *ctx, const char *path) {
  if (picture_has_extension(path, ".png")) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "%s: unknown extension for a picture of a mesh; use .png", path);
}

batten_status batten_picture_mesh(batten_context *ctx, const batten_mesh *mesh, const batten_picture_options *opt,
                                  const char *path) {
  picture_view view = {.mesh = mesh};
  picture_image image = {0};
  char name[128];
  batten_status st = picture_check_options(ctx, opt, 3, &view.o);
  if (st >= 0) st = check_path(ctx, path);
  if (st < 0) return st;
  snprintf(name, sizeof name, "%.*s: ", (int)sizeof name - 3, path);
  st = picture_check_mesh(ctx, &view, name);
  if (st < 0) return st;
  view.unit = lettering(view.o.width, view.o.height, view.o.width, view.o.height);
  view.left = title_left * view.unit;
  st = picture_views_make(ctx, 1, &view);
  if (st >= 0) st = picture_image_new(ctx, view.o.width, view.o.height, &image);
  if (st >= 0) st = draw_view(ctx, &view, &image);
  if (st >= 0) st = picture_write_png(ctx, &image, path);
  picture_image_free(ctx, &image);
  picture_views_free(ctx, 1, &view);
  return st;
}

/* ---- panels -------------------------------------------------------------------------------------- */

/* A panel's options and mesh, checked, in its rectangle. */
static batten_status take_panel(batten_context *ctx, const batten_picture_panel *panel, const char *name,
                                picture_view *view) {
  batten_picture_options o = panel->opt ? *panel->opt : batten_picture_options_default();
  o.width = view->o.width;
  o.height = view->o.height;
  batten_status st = picture_check_options(ctx, &o, 3, &view->o);
  if (st < 0) {
    char text[256];
    snprintf(text, sizeof text, "%s", batten_error(ctx));
    return batten_fail(ctx, st, "%s%s", name, text);
  }
  view->mesh = panel->mesh;
  view->group = panel->group;
  return picture_check_mesh(ctx, view, name);
}

static batten_status take_panels(batten_context *ctx, unsigned rows, unsigned columns,
                                 const batten_picture_panel *panels, const batten_picture_options *o,
                                 picture_view *views) {
  double unit = lettering(o->width, o->height, o->width, o->height);
  size_t top = (size_t)ceil(picture_title_room(o, unit));
  size_t width = o->width / columns, height = o->height > top ? (o->height - top) / rows : 0;
  if (width < PICTURE_SIDE_MIN || height < PICTURE_SIDE_MIN)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "opt.width x height: %u x %u leave %zu x %zu pixels to a panel; at least %d are needed",
                       o->width, o->height, width, height, PICTURE_SIDE_MIN);
  for (size_t i = 0; i < (size_t)rows * columns; i++) {
    picture_view *v = &views[i];
    *v = (picture_view){.x0 = i % columns * width, .y0 = top + i / columns * height};
    v->o.width = (unsigned)width;
    v->o.height = (unsigned)height;
    v->left = title_left * unit;
    v->unit = lettering((double)width, (double)height, o->width, o->height);
    if (!panels[i].mesh) continue;
    char name[32];
    snprintf(name, sizeof name, "panels[%zu]: ", i);
    batten_status st = take_panel(ctx, &panels[i], name, v);
    if (st < 0) return st;
    for (size_t j = 0; j < i; j++) {
      const batten_picture_options *a = &views[j].o, *b = &v->o;
      if (!views[j].mesh || v->group == 0 || views[j].group != v->group) continue;
      if (a->azimuth_deg != b->azimuth_deg || a->elevation_deg != b->elevation_deg || a->up_axis != b->up_axis)
        return batten_fail(ctx, BATTEN_E_INVALID,
                           "%sgroup %u: its camera differs from that of panels[%zu]; give both the same azimuth_deg, "
                           "elevation_deg and up_axis, or groups of their own",
                           name, v->group, j);
    }
  }
  return BATTEN_OK;
}

static batten_status draw_panel(batten_context *ctx, const picture_view *v, picture_image *whole) {
  picture_image part;
  batten_status st = picture_image_new(ctx, v->o.width, v->o.height, &part);
  if (st < 0) return st;
  part.whole_x = v->x0;
  part.whole_y = v->y0;
  part.whole_width = whole->width;
  part.whole_height = whole->height;
  st = draw_view(ctx, v, &part);
  if (st >= 0) picture_paste(&part, whole);
  picture_image_free(ctx, &part);
  return st;
}

batten_status batten_picture_panels(batten_context *ctx, unsigned rows, unsigned columns,
                                    const batten_picture_panel *panels, const batten_picture_options *opt,
                                    const char *path) {
  batten_picture_options o = opt ? *opt : batten_picture_options_default();
  o = (batten_picture_options){.struct_size = o.struct_size, .width = o.width, .height = o.height, .title = o.title};
  picture_image image = {0};
  batten_status st = picture_check_options(ctx, &o, 3, &o);
  if (st >= 0) st = check_path(ctx, path);
  if (st < 0) return st;
  if (rows < 1 || rows > PANELS_MAX || columns < 1 || columns > PANELS_MAX)
    return batten_fail(ctx, BATTEN_E_INVALID, "rows x columns: %u x %u; each must be 1 .. %d", rows, columns,
                       PANELS_MAX);
  if (!panels) return batten_fail(ctx, BATTEN_E_INVALID, "panels: NULL with %u x %u of them", rows, columns);
  size_t count = (size_t)rows * columns;
  picture_view *views = batten_alloc_array(ctx, count, sizeof *views);
  if (!views) return BATTEN_E_NOMEM;
  st = take_panels(ctx, rows, columns, panels, &o, views);
  if (st < 0) {
    batten_free(ctx, views);
    return st;
  }
  st = picture_views_make(ctx, count, views);
  if (st >= 0) st = picture_image_new(ctx, o.width, o.height, &image);
  if (st < 0) goto done;
  for (size_t i = 0; i < image.width * image.height; i++) {
    picture_color c = picture_background(&image, i % image.width, i / image.width);
    image.rgb[3 * i] = c.r, image.rgb[3 * i + 1] = c.g, image.rgb[3 * i + 2] = c.b;
  }
  for (size_t i = 0; st >= 0 && i < count; i++)
    if (views[i].mesh) st = draw_panel(ctx, &views[i], &image);
  if (st < 0) goto done;
  double unit = lettering(o.width, o.height, o.width, o.height);
  picture_draw_title(&image, &o, unit, title_left * unit);
  st = picture_write_png(ctx, &image, path);
done:
  picture_image_free(ctx, &image);
  picture_views_free(ctx, count, views);
  batten_free(ctx, views);
  return st;
}
