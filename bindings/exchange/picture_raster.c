/* Visibility: which triangle or dot is seen in each sample of the picture, and depth maps for the lights.
 *
 * Both walk the pixels of a triangle's bounding box with three edge functions; the nearer wins. The picture is cut
 * into bands of rows, one task each; each band looks at all triangles in order, so ties go the same way for any
 * number of threads. 1/distance is linear on the screen, distance is not: the buffer keeps 1/distance. */
#include "picture.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

enum { BAND_ROWS = 64 };

typedef struct raster_job {
  const picture_scene *scene;
  const picture_camera *camera;
  picture_buffer *buffer;
} raster_job;

/* ---- projection ---------------------------------------------------------------------------------- */

static double dot3(const double a[3], const float b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

void picture_project(const picture_camera *c, unsigned samples, const float point[3], float screen[3]) {
  double distance = c->distance - dot3(c->back, point), scale = c->focal / distance * samples;
  screen[0] = (float)(c->center[0] * samples + scale * (dot3(c->right, point) - c->offset[0]));
  screen[1] = (float)(c->center[1] * samples - scale * (dot3(c->up, point) - c->offset[1]));
  screen[2] = (float)(1 / distance);
}

enum { PROJECT_CHUNK = 8192 };

static void project_chunk(void *arg, size_t chunk) {
  raster_job *job = arg;
  size_t end = (chunk + 1) * PROJECT_CHUNK;
  if (end > job->scene->vertex_count) end = job->scene->vertex_count;
  for (size_t v = chunk * PROJECT_CHUNK; v < end; v++)
    picture_project(job->camera, job->buffer->samples, job->scene->vertices + 3 * v, job->buffer->screen + 3 * v);
}

/* ---- triangles ----------------------------------------------------------------------------------- */

static double edge(const float a[3], const float b[3], double x, double y) {
  return ((double)b[0] - a[0]) * (y - a[1]) - ((double)b[1] - a[1]) * (x - a[0]);
}

/* Without calls into libm, here and below: small triangles, tens of thousands in each of some 150 depth maps, cost
 * little else. */
static float least(float a, float b, float c) {
  float d = a < b ? a : b;
  return d < c ? d : c;
}

static float most(float a, float b, float c) {
  float d = a > b ? a : b;
  return d > c ? d : c;
}

/* First and one-past-last cell centre (i + 0.5) of the grid within [lower, upper]. */
static void cells_within(double lower, double upper, size_t limit_first, size_t limit_end, size_t *first,
                         size_t *end) {
  double a = lower - 0.5, b = upper - 0.5, low = (double)limit_first, high = (double)limit_end;
  *first = limit_first;
  *end = limit_first;
  if (a >= high || !(b >= low)) return;
  if (a > low) *first = (size_t)a + ((double)(size_t)a < a);
  *end = b >= high ? limit_end : (size_t)b + 1;
}

/* The grid that triangles are drawn to: screen of the camera or of a light. */
typedef struct target {
  size_t width, row_first, row_end;
  float *depth;   /* larger is nearer */
  uint32_t *item; /* NULL: depth only */
} target;

static void draw_triangle(const target *t, const float *a, const float *b, const float *c, uint32_t item) {
  float low = least(a[1], b[1], c[1]), high = most(a[1], b[1], c[1]);
  if (high < (float)t->row_first || low > (float)t->row_end) return;
  size_t x0, x1, y0, y1;
  cells_within(least(a[0], b[0], c[0]), most(a[0], b[0], c[0]), 0, t->width, &x0, &x1);
  cells_within(low, high, t->row_first, t->row_end, &y0, &y1);
  if (x0 >= x1 || y0 >= y1) return;
  double area = edge(a, b, c[0], c[1]);
  if (area == 0 || !isfinite(area)) return;
  double sign = area < 0 ? -1 : 1, scale = sign / area;
  /* Edge functions, positive inside, and their steps along the row. */
  double step_a = -sign * ((double)c[1] - b[1]), step_b = -sign * ((double)a[1] - c[1]);
  double step_c = -sign * ((double)b[1] - a[1]);
  double step_z = (step_a * a[2] + step_b * b[2] + step_c * c[2]) * scale;
  for (size_t y = y0; y < y1; y++) {
    double px = (double)x0 + 0.5, py = (double)y + 0.5;
    double ea = sign * edge(b, c, px, py), eb = sign * edge(c, a, px, py), ec = sign * edge(a, b, px, py);
    double ez = (ea * a[2] + eb * b[2] + ec * c[2]) * scale;
    float *depth = t->depth + y * t->width;
    for (size_t x = x0; x < x1; x++, ea += step_a, eb += step_b, ec += step_c, ez += step_z) {
      float z = (float)ez;
      /* & and not &&: one branch, for each by itself would be guessed wrong half of the time. */
      if (!((ea >= 0) & (eb >= 0) & (ec >= 0) & (z > depth[x]))) continue;
      depth[x] = z;
      if (t->item) t->item[y * t->width + x] = item;
    }
  }
}

/* ---- dots: balls, seen as discs ------------------------------------------------------------------ */

static void draw_dot(const raster_job *job, const target *t, size_t index) {
  const picture_scene *s = job->scene;
  float p[3];
  picture_project(job->camera, job->buffer->samples, s->dots + 3 * index, p);
  if (!(p[2] > 0 && p[2] < 2)) return; /* far off the mesh: behind the camera, or in its face */
  double radius = s->dot_radius * job->camera->focal * p[2] * job->buffer->samples;
  size_t x0, x1, y0, y1;
  cells_within(p[0] - radius, p[0] + radius, 0, t->width, &x0, &x1);
  cells_within(p[1] - radius, p[1] + radius, t->row_first, t->row_end, &y0, &y1);
  for (size_t y = y0; y < y1; y++)
    for (size_t x = x0; x < x1; x++) {
      double dx = ((double)x + 0.5 - p[0]) / radius, dy = ((double)y + 0.5 - p[1]) / radius, r2 = dx * dx + dy * dy;
      if (r2 > 1) continue;
      float z = (float)(1 / (1.0 / p[2] - s->dot_radius * sqrt(1 - r2)));
      size_t at = y * t->width + x;
      if (z <= t->depth[at]) continue;
      t->depth[at] = z;
      t->item[at] = (uint32_t)(s->triangle_count + index);
    }
}

static void draw_band(void *arg, size_t band) {
  raster_job *job = arg;
  const picture_scene *s = job->scene;
  picture_buffer *b = job->buffer;
  target t = {.width = b->width, .row_first = band * BAND_ROWS, .depth = b->nearness, .item = b->item};
  t.row_end = t.row_first + BAND_ROWS < b->height ? t.row_first + BAND_ROWS : b->height;
  memset(b->nearness + t.row_first * b->width, 0, (t.row_end - t.row_first) * b->width * sizeof *b->nearness);
  for (size_t f = 0; f < s->triangle_count; f++) {
    const uint32_t *v = s->triangles + 3 * f;
    draw_triangle(&t, b->screen + 3 * (size_t)v[0], b->screen + 3 * (size_t)v[1], b->screen + 3 * (size_t)v[2],
                  (uint32_t)f);
  }
  for (size_t i = 0; i < s->dot_count; i++) draw_dot(job, &t, i);
}

batten_status picture_rasterize(batten_context *ctx, const picture_scene *scene, const picture_camera *camera,
                                picture_buffer *buffer) {
  raster_job job = {scene, camera, buffer};
  batten_parallel(ctx, (scene->vertex_count + PROJECT_CHUNK - 1) / PROJECT_CHUNK, project_chunk, &job);
  batten_status st = picture_progress(ctx, scene, 0.05);
  if (st < 0) return st;
  batten_parallel(ctx, (buffer->height + BAND_ROWS - 1) / BAND_ROWS, draw_band, &job);
  return picture_progress(ctx, scene, 0.2);
}

void picture_depth_map(const picture_scene *s, const float u[3], const float v[3], const float d[3], size_t size,
                       float *turned, float *map) {
  for (size_t i = 0; i < size * size; i++) map[i] = -2;
  for (size_t i = 0; i < s->vertex_count; i++) {
    const float *p = s->vertices + 3 * i;
    turned[3 * i] = (u[0] * p[0] + u[1] * p[1] + u[2] * p[2] + 1) * 0.5f * (float)size;
    turned[3 * i + 1] = (v[0] * p[0] + v[1] * p[1] + v[2] * p[2] + 1) * 0.5f * (float)size;
    turned[3 * i + 2] = d[0] * p[0] + d[1] * p[1] + d[2] * p[2];
  }
  target t = {.width = size, .row_end = size, .depth = map};
  for (size_t f = 0; f < s->triangle_count; f++) {
    const uint32_t *corner = s->triangles + 3 * f;
    draw_triangle(&t, turned + 3 * (size_t)corner[0], turned + 3 * (size_t)corner[1], turned + 3 * (size_t)corner[2],
                  0);
  }
}
