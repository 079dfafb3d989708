/* Light: a broad sky, a soft key light, a rim light from behind, and what they do to the surface and the ground.
 *
 * Every light is a bundle of parallel beams with a depth map each. What a point gets is the sum over the beams that
 * reach it: so shadows are soft, hollows are dark, and the thing stands on its ground, all by one mechanism and with
 * nothing hidden from it by the picture's frame. Points to shade: one for each pixel where the surface is smooth,
 * one for each sample at edges, and a grid on the ground, where all shadows are soft. */
#include "picture.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

enum {
  SKY_BEAMS = 64,
  KEY_BEAMS = 16,
  RIM_BEAMS = 8,
  BEAMS = SKY_BEAMS + KEY_BEAMS + RIM_BEAMS,
  BATCH = 8,    /* depth maps that are held at a time */
  MAP_MIN = 64, /* their side: finer for larger pictures */
  MAP_MAX = 512,
  CHUNK = 4096, /* shaded points in a task */
  TAPS = 8      /* places in a depth map that are averaged for the ground */
};

typedef struct beam {
  float u[3], v[3], d[3]; /* d points to the light */
  float color[3];         /* radiance times solid angle */
  bool glossy;            /* makes highlights */
} beam;

typedef struct point {
  float position[3], normal[3];
  float light[3], gloss;
  float tone;   /* colour of the mesh there, when it has colours */
  float weight; /* share of the pixel */
  uint32_t pixel;
  unsigned char kind; /* 0 mesh outside, 1 mesh inside, 2 dot, 3 ground */
} point;

typedef struct shading {
  const picture_scene *scene;
  const picture_camera *camera;
  const picture_buffer *buffer;
  picture_image *image;
  point *points;
  size_t *row_first; /* [height + 1] into points */
  size_t total;      /* with the ground behind the last row */
  beam beams[BEAMS];
  size_t beam_first, beam_end; /* the batch at work */
  float taps[TAPS][2];
  float *maps;           /* [BATCH][map][map] */
  picture_turned turned; /* [BATCH][vertex_count] vertices in a beam's frame */
  size_t map, ground;    /* sides of the batch's depth maps and of the ground's grid */
  float reach;           /* half the side of the ground's grid */
} shading;

/* ---- vectors ------------------------------------------------------------------------------------- */

static float dotf(const float a[3], const float b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void normalize(float a[3]) {
  float length = sqrtf(dotf(a, a));
  if (length > 0)
    for (size_t k = 0; k < 3; k++) a[k] /= length;
}

/* Two directions that make a right-handed frame with the unit vector d (Duff et al. 2017), turned by angle. */
static void frame(const float d[3], float angle, float u[3], float v[3]) {
  float sign = copysignf(1, d[2]), a = -1 / (sign + d[2]), b = d[0] * d[1] * a;
  float p[3] = {1 + sign * d[0] * d[0] * a, sign * b, -sign * d[0]}, q[3] = {b, sign + d[1] * d[1] * a, -d[1]};
  for (size_t k = 0; k < 3; k++) {
    u[k] = cosf(angle) * p[k] + sinf(angle) * q[k];
    v[k] = cosf(angle) * q[k] - sinf(angle) * p[k];
  }
}

/* ---- lights -------------------------------------------------------------------------------------- */

static const float golden_angle = 2.39996323f;

/* Direction in the camera's own terms: right, towards the camera (both level), up. */
static void level_direction(const picture_camera *c, double right, double front, double up, float out[3]) {
  double level[2] = {c->right[1], -c->right[0]}; /* level direction to the camera: up x right, turned */
  out[0] = (float)(right * c->right[0] + front * level[0]);
  out[1] = (float)(right * c->right[1] + front * level[1]);
  out[2] = (float)up;
  normalize(out);
}

/* Beams evenly spread over a disc about a direction: a lamp of angular radius `spread`. */
static void add_lamp(beam *beams, size_t count, const float d[3], float spread, const float color[3], bool glossy) {
  float u[3], v[3];
  frame(d, 0, u, v);
  for (size_t i = 0; i < count; i++) {
    float radius = spread * sqrtf(((float)i + 0.5f) / (float)count), angle = golden_angle * (float)i;
    beam *b = &beams[i];
    for (size_t k = 0; k < 3; k++) {
      b->d[k] = d[k] + radius * (cosf(angle) * u[k] + sinf(angle) * v[k]);
      b->color[k] = color[k] / (float)count;
    }
    b->glossy = glossy;
    normalize(b->d);
    frame(b->d, 0.7f * (float)i, b->u, b->v);
  }
}

static void make_lights(const picture_camera *c, beam *beams) {
  float key[3], rim[3], fill[3];
  level_direction(c, -0.6, 0.6, 1.05, key);
  level_direction(c, 0.75, -0.95, 0.55, rim);
  level_direction(c, 0.9, 0.45, 0.15, fill);
  for (size_t i = 0; i < SKY_BEAMS; i++) {
    beam *b = &beams[i];
    float z = 1 - ((float)i + 0.5f) / SKY_BEAMS, r = sqrtf(1 - z * z), angle = golden_angle * (float)i;
    b->d[0] = r * cosf(angle), b->d[1] = r * sinf(angle), b->d[2] = z;
    frame(b->d, 1.3f * (float)i, b->u, b->v);
    /* Brighter overhead and on the side of the fill light. */
    float side = fmaxf(0, dotf(b->d, fill)), level = (0.27f + 0.20f * z + 0.36f * side * side * side) / SKY_BEAMS * 2;
    b->color[0] = 0.93f * level, b->color[1] = 0.98f * level, b->color[2] = 1.08f * level;
    b->glossy = false;
  }
  add_lamp(beams + SKY_BEAMS, KEY_BEAMS, key, 0.16f, (float[3]){1.02f, 0.96f, 0.86f}, true);
  add_lamp(beams + SKY_BEAMS + KEY_BEAMS, RIM_BEAMS, rim, 0.12f, (float[3]){0.42f, 0.45f, 0.50f}, true);
}

/* ---- points to shade ----------------------------------------------------------------------------- */

/* Ray through a sample: position at distance w along the camera's axis is eye + w * direction. */
static void ray(const picture_camera *c, double x, double y, float eye[3], float direction[3]) {
  double a = (x - c->center[0]) / c->focal, b = (c->center[1] - y) / c->focal;
  for (size_t k = 0; k < 3; k++) {
    eye[k] = (float)(c->back[k] * c->distance + c->right[k] * c->offset[0] + c->up[k] * c->offset[1]);
    direction[k] = (float)(a * c->right[k] + b * c->up[k] - c->back[k]);
  }
}

void picture_face_normal(const picture_scene *s, const uint32_t v[3], float out[3]) {
  const float *a = s->vertices + 3 * (size_t)v[0], *b = s->vertices + 3 * (size_t)v[1];
  const float *c = s->vertices + 3 * (size_t)v[2];
  float p[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, q[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
  out[0] = p[1] * q[2] - p[2] * q[1];
  out[1] = p[2] * q[0] - p[0] * q[2];
  out[2] = p[0] * q[1] - p[1] * q[0];
  normalize(out);
}

/* Shares of a triangle's corners in the place that is seen at a sample; in space, that is weighed by nearness. */
static void corner_shares(const float *const p[3], float sx, float sy, float share[3]) {
  float sum = 0;
  for (size_t k = 0; k < 3; k++) {
    const float *q = p[(k + 1) % 3], *r = p[(k + 2) % 3];
    share[k] = ((r[0] - q[0]) * (sy - q[1]) - (r[1] - q[1]) * (sx - q[0])) * p[k][2];
    sum += share[k];
  }
  for (size_t k = 0; k < 3; k++) share[k] = sum != 0 ? share[k] / sum : 1.0f / 3;
}

/* Part of white at a sample, from the values at the corners there and a pixel further right and down. */
static float stripe_tone(const picture_scene *scene, const uint32_t v[3], const float *const p[3], float sx, float sy,
                         unsigned samples) {
  float at[3], value[3] = {0}, step = (float)samples;
  for (size_t k = 0; k < 3; k++) {
    at[k] = scene->tones[v[k]];
    if (scene->period > 0) at[k] -= scene->period * roundf((at[k] - at[0]) / scene->period);
  }
  for (int i = 0; i < 3; i++) {
    float share[3];
    corner_shares(p, i == 1 ? sx + step : sx, i == 2 ? sy + step : sy, share);
    for (size_t k = 0; k < 3; k++) value[i] += share[k] * at[k];
  }
  return (float)picture_stripe((double)value[0], (double)hypotf(value[1] - value[0], value[2] - value[0]));
}

static void surface_point(const shading *s, size_t x, size_t y, point *out) {
  const picture_buffer *b = s->buffer;
  const picture_scene *scene = s->scene;
  size_t at = y * b->width + x, item = b->item[at];
  float eye[3], direction[3], w = 1 / b->nearness[at];
  ray(s->camera, ((double)x + 0.5) / b->samples, ((double)y + 0.5) / b->samples, eye, direction);
  *out = (point){.tone = 0.5f};
  for (size_t k = 0; k < 3; k++) out->position[k] = eye[k] + w * direction[k];
  if (item >= scene->triangle_count) {
    const float *center = scene->dots + 3 * (item - scene->triangle_count);
    for (size_t k = 0; k < 3; k++) out->normal[k] = out->position[k] - center[k];
    out->kind = 2;
  } else {
    const uint32_t *v = scene->triangles + 3 * item;
    const float *p[3] = {b->screen + 3 * (size_t)v[0], b->screen + 3 * (size_t)v[1], b->screen + 3 * (size_t)v[2]};
    float share[3], flat[3], sx = (float)x + 0.5f, sy = (float)y + 0.5f;
    corner_shares(p, sx, sy, share);
    picture_face_normal(scene, v, flat);
    if (scene->tones) out->tone = 0;
    for (size_t k = 0; k < 3; k++) {
      uint32_t own = scene->normal_of ? scene->normal_of[3 * item + k] : v[k];
      const float *smooth = scene->normals + 3 * (size_t)own;
      const float *normal = dotf(smooth, flat) < picture_crease_cosine ? flat : smooth;
      if (scene->tones) out->tone += share[k] * scene->tones[v[k]];
      for (size_t j = 0; j < 3; j++) out->normal[j] += share[k] * normal[j];
    }
    if (scene->map == BATTEN_MAP_STRIPES && scene->tones) out->tone = stripe_tone(scene, v, p, sx, sy, b->samples);
    /* Seen from behind: the inside of an open mesh. The side follows from the turn of the triangle on the screen. */
    float turn = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]);
    if (turn > 0) {
      out->kind = 1;
      for (size_t k = 0; k < 3; k++) out->normal[k] = -out->normal[k];
    }
  }
  normalize(out->normal);
}

/* The shaded points of a pixel; out NULL: only counts. */
static size_t pixel_points(const shading *s, size_t px, size_t py, point *out) {
  const picture_buffer *b = s->buffer;
  size_t n = b->samples, covered = 0, count = 0;
  uint32_t pixel = (uint32_t)(py * s->image->width + px);
  float low = INFINITY, high = 0, first_face[3], face[3];
  uint32_t first = UINT32_MAX;
  bool dots = false, crease = false;
  for (size_t j = 0; j < n; j++)
    for (size_t i = 0; i < n; i++) {
      size_t at = (py * n + j) * b->width + px * n + i;
      if (b->nearness[at] == 0) continue;
      covered++;
      low = fminf(low, b->nearness[at]);
      high = fmaxf(high, b->nearness[at]);
      uint32_t item = b->item[at];
      dots |= item >= s->scene->triangle_count;
      if (dots || item == first) continue;
      picture_face_normal(s->scene, s->scene->triangles + 3 * (size_t)item, first == UINT32_MAX ? first_face : face);
      crease |= first != UINT32_MAX && dotf(first_face, face) < picture_crease_cosine;
      if (first == UINT32_MAX) first = item;
    }
  /* 0.4 %: a surface so steep that it recedes by that in one pixel is an edge to the eye. */
  bool whole = covered == n * n && !dots && !crease && high < 1.004f * low;
  if (whole) {
    if (out) {
      surface_point(s, px * n + n / 2, py * n + n / 2, out);
      out->weight = 1, out->pixel = pixel;
    }
    return 1;
  }
  for (size_t j = 0; j < n && covered; j++)
    for (size_t i = 0; i < n; i++) {
      size_t x = px * n + i, y = py * n + j;
      if (b->nearness[y * b->width + x] == 0) continue;
      if (out) {
        surface_point(s, x, y, out + count);
        out[count].weight = 1 / (float)(n * n), out[count].pixel = pixel;
      }
      count++;
    }
  return count;
}

static void count_row(void *arg, size_t y) {
  shading *s = arg;
  size_t count = 0;
  for (size_t x = 0; x < s->image->width; x++) count += pixel_points(s, x, y, NULL);
  s->row_first[y + 1] = count;
}

static void fill_ground(const shading *s, point *p) {
  for (size_t i = 0; i < s->ground * s->ground; i++) {
    float x = 2 * (float)(i % s->ground) / (float)(s->ground - 1) - 1,
          y = 2 * (float)(i / s->ground) / (float)(s->ground - 1) - 1;
    p[i] = (point){.position = {s->reach * x, s->reach * y, s->scene->ground}, .normal = {0, 0, 1}, .kind = 3};
  }
}

static void fill_row(void *arg, size_t y) {
  shading *s = arg;
  point *p = s->points + s->row_first[y];
  for (size_t x = 0; x < s->image->width; x++) p += pixel_points(s, x, y, p);
}

/* ---- light --------------------------------------------------------------------------------------- */

static void fill_map(void *arg, size_t index) {
  shading *s = arg;
  const beam *b = &s->beams[s->beam_first + index];
  const size_t first = index * s->scene->vertex_count;
  const picture_turned turned = {s->turned.at + 3 * first, s->turned.cells + first};
  picture_depth_map(s->scene, b->u, b->v, b->d, s->map, turned, s->maps + index * s->map * s->map);
}

/* Part of a beam that reaches p: the four texels about it, each lit or not, blended. */
static inline float reached(const float *map, size_t size, const beam *b, const float p[3]) {
  const float bias = 1 / (float)size;
  float x = (dotf(b->u, p) + 1) * 0.5f * (float)size - 0.5f, y = (dotf(b->v, p) + 1) * 0.5f * (float)size - 0.5f;
  float depth = dotf(b->d, p) + bias;
  if (!(x >= 0 && y >= 0 && x < (float)(size - 1) && y < (float)(size - 1))) return 1;
  size_t i = (size_t)x, j = (size_t)y;
  float fx = x - (float)i, fy = y - (float)j;
  const float *m = map + j * size + i;
  float a = (float)(m[0] <= depth) * (1 - fx) + (float)(m[1] <= depth) * fx; /* no branches to be guessed wrong */
  float c = (float)(m[size] <= depth) * (1 - fx) + (float)(m[size + 1] <= depth) * fx;
  return a + fy * (c - a);
}

/* Of the unit ball: as far as the shadows of neighbouring beams lie apart. */
static const float tap_radius = 0.06f;

/* The same over a disc of the map: the few beams of a lamp would leave the edge of a shadow each. */
static float reached_about(const shading *s, const float *map, const beam *b, const float p[3]) {
  const float beyond = 1 + tap_radius;
  float sum = 0;
  if (fabsf(dotf(b->u, p)) > beyond || fabsf(dotf(b->v, p)) > beyond) return 1; /* most of the ground */
  for (size_t i = 0; i < TAPS; i++) {
    float tap[3];
    for (size_t k = 0; k < 3; k++) tap[k] = p[k] + s->taps[i][0] * b->u[k] + s->taps[i][1] * b->v[k];
    sum += reached(map, s->map, b, tap);
  }
  return sum / TAPS;
}

static void make_taps(float taps[TAPS][2]) {
  for (int i = 0; i < TAPS; i++) {
    float r = tap_radius * sqrtf(((float)i + 0.5f) / TAPS), angle = golden_angle * (float)i;
    taps[i][0] = r * cosf(angle);
    taps[i][1] = r * sinf(angle);
  }
}

static void light_chunk(void *arg, size_t chunk) {
  shading *s = arg;
  size_t end = (chunk + 1) * CHUNK < s->total ? (chunk + 1) * CHUNK : s->total;
  bool glossy = s->beams[s->beam_end - 1].glossy; /* the sky's beams come first */
  for (size_t i = chunk * CHUNK; i < end; i++) {
    point *p = &s->points[i];
    float from[3], view[3] = {0};
    /* Off the surface by two texels, so that a beam does not stop at the triangle where it ends. */
    for (size_t k = 0; k < 3; k++) from[k] = p->position[k] + p->normal[k] * (4 / (float)s->map);
    if (glossy) {
      for (size_t k = 0; k < 3; k++) view[k] = (float)(s->camera->back[k] * s->camera->distance) - p->position[k];
      normalize(view);
    }
    for (size_t k = s->beam_first; k < s->beam_end; k++) {
      const beam *b = &s->beams[k];
      float cosine = dotf(p->normal, b->d);
      if (cosine <= 0) continue;
      const float *map = s->maps + (k - s->beam_first) * s->map * s->map;
      float part = p->kind == 3 ? reached_about(s, map, b, from) : reached(map, s->map, b, from);
      if (part <= 0) continue;
      for (size_t c = 0; c < 3; c++) p->light[c] += part * cosine * b->color[c];
      if (b->glossy) {
        float half[3] = {b->d[0] + view[0], b->d[1] + view[1], b->d[2] + view[2]};
        normalize(half);
        float shine = fmaxf(0, dotf(half, p->normal)), away = 1 - fmaxf(0, dotf(view, half)), away2 = away * away;
        shine *= shine, shine *= shine, shine *= shine, shine *= shine, shine *= shine; /* power 32 */
        p->gloss += part * cosine * shine * b->color[1] * (0.16f + 0.84f * away2 * away2 * away);
      }
    }
  }
}

/* ---- picture ------------------------------------------------------------------------------------- */

/* 1 within a panel, 0 at its sides that are inside the picture: no shadow is cut off there. */
static float away_from_sides(const picture_image *im, size_t x, size_t y) {
  float fade = 0.12f * (float)(im->width < im->height ? im->width : im->height), least = fade;
  if (im->whole_x > 0) least = fminf(least, (float)x + 0.5f);
  if (im->whole_y > 0) least = fminf(least, (float)y + 0.5f);
  if (im->whole_x + im->width < im->whole_width) least = fminf(least, (float)(im->width - x) - 0.5f);
  if (im->whole_y + im->height < im->whole_height) least = fminf(least, (float)(im->height - y) - 0.5f);
  float t = least / fade;
  return t * t * (3 - 2 * t);
}

/* How much of its light the ground seen at a pixel has; open is what it gets without shadow. */
static float ground_light(const shading *s, size_t px, size_t py, float open) {
  float eye[3], direction[3];
  if (!s->scene->shadows) return 1;
  ray(s->camera, (double)px + 0.5, (double)py + 0.5, eye, direction);
  if (!(direction[2] < -1e-3f && eye[2] > s->scene->ground)) return 1;
  float w = (s->scene->ground - eye[2]) / direction[2];
  float x = (eye[0] + w * direction[0]) / s->reach, y = (eye[1] + w * direction[1]) / s->reach, far = x * x + y * y;
  if (!(far < 1)) return 1;
  float gx = 0.5f * (x + 1) * (float)(s->ground - 1), gy = 0.5f * (y + 1) * (float)(s->ground - 1);
  size_t i = gx < (float)(s->ground - 2) ? (size_t)gx : s->ground - 2,
         j = gy < (float)(s->ground - 2) ? (size_t)gy : s->ground - 2;
  gx -= (float)i, gy -= (float)j;
  const point *p = s->points + s->row_first[s->image->height] + j * s->ground + i;
  float near_row = p[0].light[1] + gx * (p[1].light[1] - p[0].light[1]);
  float far_row = p[s->ground].light[1] + gx * (p[s->ground + 1].light[1] - p[s->ground].light[1]);
  float part = (near_row + gy * (far_row - near_row)) / open;
  return 1 - 0.85f * (1 - far) * (1 - fminf(1, part)) * away_from_sides(s->image, px, py);
}

/* Bright parts bend and do not burn out. */
static float expose(float v) {
  const float knee = 0.6f;
  return v <= knee ? v : knee + (1 - knee) * (1 - expf(-(v - knee) / (1 - knee)));
}

static void compose_row(void *arg, size_t y) {
  shading *s = arg;
  picture_image *im = s->image;
  const picture_color inside = picture_srgb(0x9a6a58), dot = picture_srgb(0xc8442c), plain = picture_srgb(0xcdc6ba);
  /* What open ground gets: shadow is the part that is missing. */
  float open = 0;
  for (size_t k = 0; k < BEAMS; k++) open += fmaxf(0, s->beams[k].d[2]) * s->beams[k].color[1];
  for (size_t x = 0; x < im->width; x++) {
    picture_color c = picture_background(im, x, y);
    float *rgb = &im->rgb[3 * (y * im->width + x)], part = ground_light(s, x, y, open);
    rgb[0] = c.r * part, rgb[1] = c.g * part, rgb[2] = c.b * part;
  }
  for (size_t i = s->row_first[y]; i < s->row_first[y + 1];) {
    uint32_t pixel = s->points[i].pixel;
    float *rgb = &im->rgb[3 * (size_t)pixel], sum[3] = {0}, left = 1;
    for (; i < s->row_first[y + 1] && s->points[i].pixel == pixel; i++) {
      const point *p = &s->points[i];
      left -= p->weight;
      bool alike = p->kind == 1 && s->scene->both_sides;
      picture_color albedo = p->kind == 2             ? dot
                             : p->kind == 1 && !alike ? inside
                             : s->scene->tones        ? picture_colormap(s->scene->map, p->tone)
                                                      : plain;
      /* Light from the ground, less where the thing is close to it; what has no inside is not dark there. */
      float height = p->position[2] - s->scene->ground;
      float bounce = 0.16f * (0.5f - 0.5f * p->normal[2]) * height / (height + 0.35f) + (alike ? 0.3f : 0.05f);
      float gloss = 0.9f * p->gloss;
      float shown[3] = {albedo.r * (p->light[0] + bounce) + gloss, albedo.g * (p->light[1] + bounce) + gloss,
                        albedo.b * (p->light[2] + bounce) + gloss};
      /* All channels by one factor: each by itself would turn the hue where the first of them bends. */
      float brightest = fmaxf(shown[0], fmaxf(shown[1], shown[2]));
      float factor = brightest > 0 ? p->weight * expose(brightest) / brightest : 0;
      for (size_t c = 0; c < 3; c++) sum[c] += factor * shown[c];
    }
    left = fmaxf(0, left);
    for (size_t c = 0; c < 3; c++) rgb[c] = sum[c] + left * rgb[c];
  }
}

batten_status picture_shade(batten_context *ctx, const picture_scene *scene, const picture_camera *camera,
                            const picture_buffer *buffer, picture_image *image) {
  batten_status st = BATTEN_E_NOMEM;
  size_t height = image->height;
  shading *s = batten_alloc(ctx, sizeof *s);
  if (!s) return st;
  *s = (shading){.scene = scene, .camera = camera, .buffer = buffer, .image = image, .reach = 3};
  make_lights(camera, s->beams);
  for (s->map = MAP_MAX; s->map > MAP_MIN && s->map > image->width && s->map > height;) s->map /= 2;
  s->ground = s->map * 3 / 8;
  make_taps(s->taps);
  s->row_first = batten_alloc_array(ctx, height + 1, sizeof *s->row_first);
  size_t fine = s->map;
  s->maps = batten_alloc_array(ctx, BATCH * fine * fine, sizeof *s->maps);
  s->turned.at = batten_alloc_array(ctx, scene->vertex_count, BATCH * 3 * sizeof *s->turned.at);
  s->turned.cells = batten_alloc_array(ctx, scene->vertex_count, BATCH * sizeof *s->turned.cells);
  if (!s->row_first || !s->maps || !s->turned.at || !s->turned.cells) goto done;
  s->row_first[0] = 0;
  batten_parallel(ctx, height, count_row, s);
  for (size_t y = 0; y < height; y++) s->row_first[y + 1] += s->row_first[y];
  s->total = s->row_first[height] + s->ground * s->ground;
  s->points = batten_alloc_array(ctx, s->total, sizeof *s->points);
  if (!s->points) goto done;
  fill_ground(s, s->points + s->row_first[height]);
  batten_parallel(ctx, height, fill_row, s);
  for (size_t k = 0; k < BEAMS; k += BATCH) {
    st = picture_progress(ctx, scene, 0.25 + 0.65 * (double)k / BEAMS);
    if (st < 0) goto done;
    s->beam_first = k;
    s->beam_end = k + BATCH < BEAMS ? k + BATCH : BEAMS;
    s->map = s->beams[k].glossy ? fine : fine / 2; /* the many beams of the sky blur each other's edges */
    batten_parallel(ctx, s->beam_end - k, fill_map, s);
    batten_parallel(ctx, (s->total + CHUNK - 1) / CHUNK, light_chunk, s);
  }
  batten_parallel(ctx, height, compose_row, s);
  st = picture_progress(ctx, scene, 0.95);
done:
  batten_free(ctx, s->points);
  batten_free(ctx, s->turned.cells);
  batten_free(ctx, s->turned.at);
  batten_free(ctx, s->maps);
  batten_free(ctx, s->row_first);
  batten_free(ctx, s);
  return st;
}
