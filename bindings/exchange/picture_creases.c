/* Normals at the corners of triangles where a mesh has creases: a corner takes the mean of those triangles around its
 * vertex that lean no farther from its own than the crease angle. Elsewhere all corners share the vertex's normal. */
#include "picture.h"

#include <math.h>
#include <string.h>

/* Vertices with more triangles keep one normal: all pairs are looked at. */
enum { FAN_MAX = 64 };

typedef struct fans {
  uint32_t *starts;  /* [V + 1] */
  uint32_t *corners; /* [3 F] by vertex: 3 t + k */
  float *faces;      /* [F][3] unit, 0 of triangles without area */
  float *angles;     /* [3 F] at the corners */
  const picture_scene *scene;
  unsigned char *creased; /* [V] */
} fans;

enum { TASK = 8192 };

static float dot(const float *a, const float *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static float corner_angle(const picture_scene *s, size_t corner) {
  size_t t = corner / 3, k = corner % 3;
  const float *a = s->vertices + 3 * (size_t)s->triangles[corner], *ends[2];
  float d[2][3], length[2];
  for (size_t i = 0; i < 2; i++) {
    ends[i] = s->vertices + 3 * (size_t)s->triangles[3 * t + (k + 1 + i) % 3];
    for (size_t c = 0; c < 3; c++) d[i][c] = ends[i][c] - a[c];
    length[i] = sqrtf(dot(d[i], d[i]));
  }
  float cosine = dot(d[0], d[1]) / (length[0] * length[1]);
  return isfinite(cosine) ? acosf(fmaxf(-1, fminf(1, cosine))) : 0;
}

static void facet_task(void *arg, size_t task) {
  const fans *f = arg;
  const picture_scene *s = f->scene;
  for (size_t t = task * TASK; t < s->triangle_count && t < (task + 1) * TASK; t++) {
    picture_face_normal(s, s->triangles + 3 * t, f->faces + 3 * t);
    for (size_t k = 0; k < 3; k++) f->angles[3 * t + k] = corner_angle(s, 3 * t + k);
  }
}

static void fill_fans(batten_context *ctx, const picture_scene *s, fans *f) {
  const size_t corners = 3 * s->triangle_count;
  memset(f->starts, 0, (s->vertex_count + 1) * sizeof *f->starts);
  for (size_t i = 0; i < corners; i++) f->starts[s->triangles[i] + 1]++;
  for (size_t v = 0; v < s->vertex_count; v++) f->starts[v + 1] += f->starts[v];
  for (size_t i = corners; i-- > 0;) f->corners[--f->starts[s->triangles[i] + 1]] = (uint32_t)i;
  /* every start is one vertex too far ahead by now */
  memmove(f->starts, f->starts + 1, s->vertex_count * sizeof *f->starts);
  f->starts[s->vertex_count] = (uint32_t)corners;
  batten_parallel(ctx, (s->triangle_count + TASK - 1) / TASK, facet_task, f);
}

static bool is_parted(const fans *f, uint32_t a, uint32_t b) {
  return dot(f->faces + 3 * (size_t)(a / 3), f->faces + 3 * (size_t)(b / 3)) < picture_crease_cosine;
}

static bool has_crease(const fans *f, size_t v) {
  uint32_t first = f->starts[v], last = f->starts[v + 1];
  if (last - first > FAN_MAX) return false;
  for (uint32_t i = first; i < last; i++)
    for (uint32_t j = first; j < i; j++)
      if (is_parted(f, f->corners[i], f->corners[j])) return true;
  return false;
}

static void crease_task(void *arg, size_t task) {
  const fans *f = arg;
  for (size_t v = task * TASK; v < f->scene->vertex_count && v < (task + 1) * TASK; v++)
    f->creased[v] = has_crease(f, v);
}

static void part_normals(const fans *f, size_t v, uint32_t at, uint32_t *corners, float *normals) {
  for (uint32_t i = f->starts[v]; i < f->starts[v + 1]; i++, at++) {
    float *n = normals + 3 * (size_t)at, sum[3] = {0, 0, 0};
    for (uint32_t j = f->starts[v]; j < f->starts[v + 1]; j++)
      for (size_t k = 0; k < 3 && !is_parted(f, f->corners[i], f->corners[j]); k++)
        sum[k] += f->angles[f->corners[j]] * f->faces[3 * (size_t)(f->corners[j] / 3) + k];
    float length = sqrtf(dot(sum, sum));
    for (size_t k = 0; k < 3; k++) n[k] = length > 0 ? sum[k] / length : normals[3 * v + k];
    corners[f->corners[i]] = at;
  }
}

batten_status picture_part_normals(batten_context *ctx, picture_scene *s) {
  const size_t V = s->vertex_count, corners = 3 * s->triangle_count;
  fans f = {.scene = s};
  float *normals = NULL;
  uint32_t *of_corners = NULL, extra = 0;
  batten_status st = BATTEN_E_NOMEM;
  if (V + corners >= UINT32_MAX) return BATTEN_OK;
  if (!(f.starts = batten_alloc_array(ctx, V + 1, sizeof *f.starts)) ||
      !(f.corners = batten_alloc_array(ctx, corners, sizeof *f.corners)) ||
      !(f.faces = batten_alloc_array(ctx, s->triangle_count, 3 * sizeof *f.faces)) ||
      !(f.angles = batten_alloc_array(ctx, corners, sizeof *f.angles)) ||
      !(f.creased = batten_alloc_array(ctx, V, 1)))
    goto done;
  fill_fans(ctx, s, &f);
  st = batten_progress(ctx, "picture", 0);
  if (st < 0) goto done;
  batten_parallel(ctx, (V + TASK - 1) / TASK, crease_task, &f);
  for (size_t v = 0; v < V; v++)
    if (f.creased[v]) extra += f.starts[v + 1] - f.starts[v];
  if (extra == 0) goto done;
  of_corners = batten_alloc_array(ctx, corners, sizeof *of_corners);
  normals = batten_alloc_array(ctx, V + extra, 3 * sizeof *normals);
  if (!of_corners || !normals) {
    batten_free(ctx, of_corners);
    batten_free(ctx, normals);
    st = BATTEN_E_NOMEM;
    goto done;
  }
  memcpy(normals, s->normals, 3 * V * sizeof *normals);
  memcpy(of_corners, s->triangles, corners * sizeof *of_corners);
  uint32_t at = (uint32_t)V;
  for (size_t v = 0; v < V; v++) {
    if (!f.creased[v]) continue;
    part_normals(&f, v, at, of_corners, normals);
    at += f.starts[v + 1] - f.starts[v];
  }
  batten_free(ctx, s->normals);
  s->normals = normals;
  s->normal_of = of_corners;
done:
  batten_free(ctx, f.creased);
  batten_free(ctx, f.angles);
  batten_free(ctx, f.faces);
  batten_free(ctx, f.corners);
  batten_free(ctx, f.starts);
  return st;
}
