/* Visibility: which triangle or dot is seen in each sample of the picture, and depth maps for the lights.
 *
 * Both walk the pixels of a triangle's bounding box with three edge functions; the nearer wins. The picture is cut
 * into bands of rows, one task each; each band has a list of what reaches it, in order, so ties go the same way for
 * any number of threads. 1/distance is linear on the screen, distance is not: the buffer keeps 1/distance. Of meshes
 * with far more triangles than pixels, most triangles lie between the centres of pixels: these are found out early.
 */
#include "picture.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

enum { BAND_ROWS = 64 };

/* First and last band that an item reaches; first > last: none. */
typedef struct band_range {
  uint16_t first, last;
} band_range;

typedef struct raster_job {
  const picture_scene *scene;
  const picture_camera *camera;
  picture_buffer *buffer;
  size_t bands;
  band_range *ranges; /* [items], triangles and then dots */
  size_t *starts;     /* [bands + 1] into items */
  uint32_t *items;    /* those of each band, in order */
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

/* Its place on the screen and radius in samples; false: far off the mesh, behind the camera or in its face. */
static bool see_dot(const raster_job *job, size_t index, float p[3], double *radius) {
  const picture_scene *s = job->scene;
  picture_project(job->camera, job->buffer->samples, s->dots + 3 * index, p);
  *radius = s->dot_radius * job->camera->focal * p[2] * job->buffer->samples;
  return p[2] > 0 && p[2] < 2;
}

static void draw_dot(const raster_job *job, const target *t, size_t index) {
  const picture_scene *s = job->scene;
  float p[3];
  double radius;
  size_t x0, x1, y0, y1;
  if (!see_dot(job, index, p, &radius)) return;
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

/* ---- bands of rows ------------------------------------------------------------------------------- */

static const float *screen_of(const picture_buffer *b, uint32_t v) { return b->screen + 3 * (size_t)v; }

/* Of an item within [x_low, x_high] x [y_low, y_high] of the screen. */
static band_range range_of(const raster_job *job, double x_low, double x_high, double y_low, double y_high) {
  size_t x0, x1, y0, y1;
  cells_within(x_low, x_high, 0, job->buffer->width, &x0, &x1);
  cells_within(y_low, y_high, 0, job->buffer->height, &y0, &y1);
  if (x0 >= x1 || y0 >= y1) return (band_range){1, 0};
  return (band_range){(uint16_t)(y0 / BAND_ROWS), (uint16_t)((y1 - 1) / BAND_ROWS)};
}

static band_range triangle_range(const raster_job *job, size_t f) {
  const uint32_t *v = job->scene->triangles + 3 * f;
  const float *a = screen_of(job->buffer, v[0]), *b = screen_of(job->buffer, v[1]), *c = screen_of(job->buffer, v[2]);
  return range_of(job, least(a[0], b[0], c[0]), most(a[0], b[0], c[0]), least(a[1], b[1], c[1]),
                  most(a[1], b[1], c[1]));
}

static band_range dot_range(const raster_job *job, size_t index) {
  float p[3];
  double radius;
  if (!see_dot(job, index, p, &radius)) return (band_range){1, 0};
  return range_of(job, p[0] - radius, p[0] + radius, p[1] - radius, p[1] + radius);
}

enum { RANGE_CHUNK = 8192 };

static void range_chunk(void *arg, size_t chunk) {
  raster_job *job = arg;
  const size_t triangles = job->scene->triangle_count, items = triangles + job->scene->dot_count;
  for (size_t i = chunk * RANGE_CHUNK; i < items && i < (chunk + 1) * RANGE_CHUNK; i++)
    job->ranges[i] = i < triangles ? triangle_range(job, i) : dot_range(job, i - triangles);
}

/* The list of each band. */
static batten_status sort_items(batten_context *ctx, raster_job *job) {
  const size_t count = job->scene->triangle_count + job->scene->dot_count;
  job->ranges = batten_alloc_array(ctx, count, sizeof *job->ranges);
  job->starts = batten_alloc_array(ctx, job->bands + 1, sizeof *job->starts);
  if (!job->ranges || !job->starts) return BATTEN_E_NOMEM;
  batten_parallel(ctx, (count + RANGE_CHUNK - 1) / RANGE_CHUNK, range_chunk, job);
  memset(job->starts, 0, (job->bands + 1) * sizeof *job->starts);
  for (size_t i = 0; i < count; i++)
    for (size_t b = job->ranges[i].first; b <= job->ranges[i].last; b++) job->starts[b + 1]++;
  for (size_t b = 0; b < job->bands; b++) job->starts[b + 1] += job->starts[b];
  job->items = batten_alloc_array(ctx, job->starts[job->bands], sizeof *job->items);
  if (!job->items) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < count; i++)
    for (size_t b = job->ranges[i].first; b <= job->ranges[i].last; b++) job->items[job->starts[b]++] = (uint32_t)i;
  for (size_t b = job->bands; b > 0; b--) job->starts[b] = job->starts[b - 1]; /* each was moved to the next one's */
  job->starts[0] = 0;
  return BATTEN_OK;
}

static void draw_band(void *arg, size_t band) {
  const raster_job *job = arg;
  const picture_scene *s = job->scene;
  picture_buffer *b = job->buffer;
  target t = {.width = b->width, .row_first = band * BAND_ROWS, .depth = b->nearness, .item = b->item};
  t.row_end = t.row_first + BAND_ROWS < b->height ? t.row_first + BAND_ROWS : b->height;
  memset(b->nearness + t.row_first * b->width, 0, (t.row_end - t.row_first) * b->width * sizeof *b->nearness);
  for (size_t i = job->starts[band]; i < job->starts[band + 1]; i++) {
    const uint32_t item = job->items[i], *v = s->triangles + 3 * (size_t)item;
    if (item < s->triangle_count)
      draw_triangle(&t, screen_of(b, v[0]), screen_of(b, v[1]), screen_of(b, v[2]), item);
    else
      draw_dot(job, &t, item - s->triangle_count);
  }
}

batten_status picture_rasterize(batten_context *ctx, const picture_scene *scene, const picture_camera *camera,
                                picture_buffer *buffer) {
  raster_job job = {scene, camera, buffer, .bands = (buffer->height + BAND_ROWS - 1) / BAND_ROWS};
  batten_parallel(ctx, (scene->vertex_count + PROJECT_CHUNK - 1) / PROJECT_CHUNK, project_chunk, &job);
  batten_status st = picture_progress(ctx, scene, 0.05);
  if (st >= 0) st = sort_items(ctx, &job);
  if (st >= 0) st = picture_progress(ctx, scene, 0.1);
  if (st >= 0) {
    batten_parallel(ctx, job.bands, draw_band, &job);
    st = picture_progress(ctx, scene, 0.2);
  }
  batten_free(ctx, job.items);
  batten_free(ctx, job.starts);
  batten_free(ctx, job.ranges);
  return st;
}

/* ---- depth maps ---------------------------------------------------------------------------------- */

/* 2 i for the centre of cell i, an odd number between the centres: a triangle whose corners have one odd number in
 * common has no centre within. */
static uint32_t cell_code(float x, double size) {
  double a = x - 0.5;
  if (!(a > -0.5)) a = -0.5; /* beyond the map, or no number */
  if (a > size - 0.5) a = size - 0.5;
  int32_t below = (int32_t)(a + 1);
  return 2 * (uint32_t)below + ((double)below != a + 1);
}

static uint32_t is_between(uint32_t a, uint32_t b, uint32_t c) {
  uint32_t differ = (a ^ b) | (a ^ c);
  return (a & (uint32_t) !(differ & 0xffff)) | (a >> 16 & (uint32_t) !(differ >> 16)); /* one branch, as above */
}

void picture_depth_map(const picture_scene *s, const float u[3], const float v[3], const float d[3], size_t size,
                       picture_turned turned, float *map) {
  for (size_t i = 0; i < size * size; i++) map[i] = -2;
  for (size_t i = 0; i < s->vertex_count; i++) {
    const float *p = s->vertices + 3 * i;
    float *q = turned.at + 3 * i;
    q[0] = (u[0] * p[0] + u[1] * p[1] + u[2] * p[2] + 1) * 0.5f * (float)size;
    q[1] = (v[0] * p[0] + v[1] * p[1] + v[2] * p[2] + 1) * 0.5f * (float)size;
    q[2] = d[0] * p[0] + d[1] * p[1] + d[2] * p[2];
    turned.cells[i] = cell_code(q[0], (double)size) | cell_code(q[1], (double)size) << 16;
  }
  target t = {.width = size, .row_end = size, .depth = map};
  for (size_t f = 0; f < s->triangle_count; f++) {
    const uint32_t *corner = s->triangles + 3 * f;
    if (is_between(turned.cells[corner[0]], turned.cells[corner[1]], turned.cells[corner[2]])) continue;
    draw_triangle(&t, turned.at + 3 * (size_t)corner[0], turned.at + 3 * (size_t)corner[1],
                  turned.at + 3 * (size_t)corner[2], 0);
  }
}
