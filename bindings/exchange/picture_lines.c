/* Lines on the surface and in space. Each is cut into pieces of a pixel or two; a piece is seen where the picture's
 * samples about it show nothing that is nearer by more than a little: lines may lie on a surface of which the mesh is
 * a tessellation. What is not seen is drawn as faintly as is asked for, below what is. */
#include "picture.h"

#include <math.h>

/* 1 % of the scene's radius behind the mesh a line is still taken to be on it. */
static const double on_surface = 0.01;

/* From here on lines are cut off: the camera is 2.5 away at least. */
static const double lines_end = 2;

/* Is a place of the scene seen? One sample about it is enough, so that lines along the silhouette stay whole. */
static bool is_seen(const picture_buffer *b, const float at[3]) {
  double allowed = 1 / (1 / (double)at[2] - on_surface); /* nearness of what may not be in front */
  for (int dy = -1; dy <= 1; dy++)
    for (int dx = -1; dx <= 1; dx++) {
      double x = floor((double)at[0]) + dx, y = floor((double)at[1]) + dy;
      if (!(x >= 0 && y >= 0 && x < (double)b->width && y < (double)b->height)) continue;
      if ((double)b->nearness[(size_t)y * b->width + (size_t)x] <= allowed) return true;
    }
  return false;
}

/* The part of a line within the ball of radius lines_end. */
static bool clip(const float *line, float out[6]) {
  double a = 0, b = 0, c = -lines_end * lines_end;
  for (int k = 0; k < 3; k++) {
    double p = line[k], d = (double)line[3 + k] - p;
    a += d * d;
    b += d * p;
    c += p * p;
  }
  double root = b * b - a * c, first = 0, last = 1;
  if (!(root >= 0) || !isfinite(root)) return false;
  if (a > 0) {
    first = fmax(0, (-b - sqrt(root)) / a);
    last = fmin(1, (-b + sqrt(root)) / a);
  }
  for (int k = 0; k < 3; k++) {
    double p = line[k], d = (double)line[3 + k] - p;
    out[k] = (float)(p + first * d);
    out[3 + k] = (float)(p + last * d);
  }
  return first < last || a == 0;
}

/* The pieces that are seen, or those that are not, into the mask. */
static void mask_line(picture_image *image, const picture_buffer *b, const picture_camera *camera, const float *line,
                      double width, bool wanted) {
  float part[6], ends[2][3], before[3];
  if (!clip(line, part)) return;
  for (int i = 0; i < 2; i++) picture_project(camera, b->samples, part + 3 * i, ends[i]);
  double length = hypot((double)(ends[1][0] - ends[0][0]), (double)(ends[1][1] - ends[0][1])) / b->samples;
  if (!(length < 1e5)) return;
  unsigned pieces = 1 + (unsigned)(length / 1.5);
  bool seen_before = is_seen(b, ends[0]);
  for (int k = 0; k < 3; k++) before[k] = ends[0][k];
  for (unsigned i = 1; i <= pieces; i++) {
    float place[3], at[3], t = (float)i / (float)pieces;
    for (int k = 0; k < 3; k++) place[k] = (1 - t) * part[k] + t * part[3 + k];
    picture_project(camera, b->samples, place, at);
    bool seen = is_seen(b, at);
    if ((seen && seen_before) == wanted)
      picture_mask_capsule(image, (double)before[0] / b->samples, (double)before[1] / b->samples,
                           (double)at[0] / b->samples, (double)at[1] / b->samples, 0.5 * width);
    seen_before = seen;
    for (int k = 0; k < 3; k++) before[k] = at[k];
  }
}

void picture_draw_lines(picture_image *image, const picture_buffer *buffer, const picture_camera *camera,
                        size_t count, const float *lines, const picture_stroke *stroke) {
  for (int seen = 0; seen < 2; seen++) {
    double strength = seen ? stroke->strength : stroke->hidden;
    if (!(strength > 0) || count == 0) continue;
    for (size_t i = 0; i < count; i++) mask_line(image, buffer, camera, lines + 6 * i, stroke->width, seen);
    picture_blend(image, stroke->color, strength);
  }
}
