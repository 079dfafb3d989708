/* Lines on the surface. Each is cut into pieces of a pixel or two; a piece is drawn where the picture's samples about
 * it show nothing that is nearer by more than a little: the lines lie on a surface of which the mesh is a
 * tessellation. */
#include "picture.h"

#include <math.h>

/* 1 % of the scene's radius behind the mesh a line is still taken to be on it. */
static const double on_surface = 0.01;

/* Is a place of the scene seen? One sample about it is enough, so that lines along the silhouette stay whole. */
static bool is_seen(const picture_buffer *b, const float at[3]) {
  double allowed = 1 / (1 / (double)at[2] - on_surface); /* nearness of what may not be in front */
  for (int dy = -1; dy <= 1; dy++)
    for (int dx = -1; dx <= 1; dx++) {
      double x = floor((double)at[0]) + dx, y = floor((double)at[1]) + dy;
      if (!(x >= 0 && y >= 0 && x < (double)b->width && y < (double)b->height)) continue;
      double nearness = (double)b->nearness[(size_t)y * b->width + (size_t)x];
      if (nearness > 0 && nearness <= allowed) return true;
    }
  return false;
}

static void draw_line(picture_image *image, const picture_buffer *b, const picture_camera *camera, const float *line,
                      double width) {
  float ends[2][3], before[3];
  for (int i = 0; i < 2; i++) picture_project(camera, b->samples, line + 3 * i, ends[i]);
  if (!(ends[0][2] > 0 && ends[1][2] > 0 && ends[0][2] < 2 && ends[1][2] < 2)) return; /* behind the camera */
  double length = hypot((double)(ends[1][0] - ends[0][0]), (double)(ends[1][1] - ends[0][1])) / b->samples;
  if (!(length < 1e5)) return;
  unsigned pieces = 1 + (unsigned)(length / 1.5);
  bool seen_before = is_seen(b, ends[0]);
  for (int k = 0; k < 3; k++) before[k] = ends[0][k];
  for (unsigned i = 1; i <= pieces; i++) {
    float place[3], at[3], t = (float)i / (float)pieces;
    for (int k = 0; k < 3; k++) place[k] = (1 - t) * line[k] + t * line[3 + k];
    picture_project(camera, b->samples, place, at);
    bool seen = is_seen(b, at);
    if (seen && seen_before)
      picture_mask_capsule(image, (double)before[0] / b->samples, (double)before[1] / b->samples,
                           (double)at[0] / b->samples, (double)at[1] / b->samples, 0.5 * width);
    seen_before = seen;
    for (int k = 0; k < 3; k++) before[k] = at[k];
  }
}

void picture_draw_lines(picture_image *image, const picture_buffer *buffer, const picture_camera *camera,
                        size_t count, const float *lines, double width) {
  for (size_t i = 0; i < count; i++) draw_line(image, buffer, camera, lines + 6 * i, width);
  if (count) picture_blend(image, picture_srgb(0x14161b), 0.8);
}
