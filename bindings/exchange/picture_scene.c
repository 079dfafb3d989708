/* Scenes and cameras: meshes with their dots and lines are brought into the unit ball, and cameras set up so that all
 * views of a group are seen by one. */
#include "picture.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/checked.h"

void picture_to_ball(const picture_ball *b, const double *p, float out[3]) {
  for (size_t k = 0; k < 3; k++) out[k] = (float)((p[b->axis[k]] - b->center[b->axis[k]]) / b->radius);
}

static bool together(const picture_view *a, const picture_view *b) {
  return a == b || (a->mesh && b->mesh && a->group != 0 && a->group == b->group);
}

/* ---- ball ---------------------------------------------------------------------------------------- */

static void grow_box(size_t count, const double *points, double lower[3], double upper[3]) {
  for (size_t i = 0; i < 3 * count; i++) {
    lower[i % 3] = fmin(lower[i % 3], points[i]);
    upper[i % 3] = fmax(upper[i % 3], points[i]);
  }
}

static double farthest(size_t count, const double *points, const double center[3]) {
  double radius = 0;
  for (size_t i = 0; i < count; i++)
    radius = fmax(radius, hypot(hypot(points[3 * i] - center[0], points[3 * i + 1] - center[1]),
                                points[3 * i + 2] - center[2]));
  return radius;
}

/* The corner of a box, by the bits of `which`: x, y, z at the upper end. */
static void box_corner(const batten_picture_axes *a, unsigned which, double out[3]) {
  for (size_t k = 0; k < 3; k++) out[k] = which >> k & 1 ? a->upper[k] : a->lower[k];
}

/* Ball about the middle of the box of all meshes and axes of a group; halves first, so that the largest coordinates
 * do not overflow. */
static picture_ball ball_of(size_t count, const picture_view *views, const picture_view *of) {
  unsigned up = of->o.up_axis;
  picture_ball b = {.axis = {(up + 1) % 3, (up + 2) % 3, up}};
  double lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t i = 0; i < count; i++) {
    if (!together(&views[i], of)) continue;
    grow_box(batten_mesh_vertex_count(views[i].mesh), batten_mesh_vertices(views[i].mesh), lower, upper);
    if (views[i].o.axes) {
      grow_box(1, views[i].o.axes->lower, lower, upper);
      grow_box(1, views[i].o.axes->upper, lower, upper);
    }
  }
  for (size_t k = 0; k < 3; k++) b.center[k] = 0.5 * lower[k] + 0.5 * upper[k];
  for (size_t i = 0; i < count; i++) {
    if (!together(&views[i], of)) continue;
    const batten_mesh *mesh = views[i].mesh;
    b.radius = fmax(b.radius, farthest(batten_mesh_vertex_count(mesh), batten_mesh_vertices(mesh), b.center));
    for (unsigned c = 0; views[i].o.axes && c < 8; c++) {
      double corner[3];
      box_corner(views[i].o.axes, c, corner);
      b.radius = fmax(b.radius, farthest(1, corner, b.center));
    }
  }
  if (!(b.radius > 0)) b.radius = 1;
  return b;
}

/* ---- scene --------------------------------------------------------------------------------------- */

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
  batten_free(ctx, s->normal_of);
  batten_free(ctx, s->tones);
  batten_free(ctx, s->dots);
  batten_free(ctx, s->segments);
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

static void fill_scene(const picture_ball *ball, const batten_mesh *mesh, const batten_picture_options *o,
                       const double *normals, picture_scene *s) {
  const double *vertices = batten_mesh_vertices(mesh);
  for (size_t i = 0; i < s->vertex_count; i++) {
    picture_to_ball(ball, vertices + 3 * i, s->vertices + 3 * i);
    for (size_t k = 0; k < 3; k++) s->normals[3 * i + k] = (float)normals[3 * i + ball->axis[k]];
    s->ground = fminf(s->ground, s->vertices[3 * i + 2]);
    if (s->tones)
      s->tones[i] = (float)(o->color_map == BATTEN_MAP_STRIPES
                                ? o->colors[i]
                                : (o->colors[i] - o->color_lower) / (o->color_upper - o->color_lower));
  }
  for (size_t i = 0; i < s->dot_count; i++) picture_to_ball(ball, o->points + 3 * i, s->dots + 3 * i);
  float *segment = s->segments;
  for (size_t l = 0; l < o->line_count; l++)
    for (size_t i = 0; i < 2 * o->lines[l].count; i++, segment += 3)
      picture_to_ball(ball, o->lines[l].segments + 3 * i, segment);
  /* Dots cover a share of the surface, whatever their number, between just visible and not clumsy. */
  if (s->dot_count) s->dot_radius = fminf(0.016f, fmaxf(0.0035f, 0.3f / sqrtf((float)s->dot_count)));
  if (o->point_scale > 0) s->dot_radius *= (float)o->point_scale;
}

static batten_status scene_make(batten_context *ctx, picture_view *view) {
  const batten_mesh *mesh = view->mesh;
  batten_picture_options *o = &view->o;
  size_t V = batten_mesh_vertex_count(mesh);
  picture_scene *s = &view->scene;
  *s = (picture_scene){.vertex_count = V,
                       .triangle_count = batten_mesh_triangle_count(mesh),
                       .dot_count = o->point_count,
                       .map = o->color_map,
                       .triangles = batten_mesh_triangles(mesh),
                       .ground = INFINITY,
                       .shadows = !o->axes,
                       .both_sides = o->both_sides != 0};
  for (size_t l = 0; l < o->line_count; l++) s->segment_count += o->lines[l].count;
  double *normals = batten_alloc_array(ctx, V, 3 * sizeof *normals);
  s->vertices = batten_alloc_array(ctx, V, 3 * sizeof *s->vertices);
  s->normals = batten_alloc_array(ctx, V, 3 * sizeof *s->normals);
  s->dots = batten_alloc_array(ctx, s->dot_count, 3 * sizeof *s->dots);
  s->tones = o->colors ? batten_alloc_array(ctx, V, sizeof *s->tones) : NULL;
  batten_status st = BATTEN_E_NOMEM;
  s->segments = batten_alloc_array(ctx, s->segment_count, 6 * sizeof *s->segments);
  if (!normals || !s->vertices || !s->normals || !s->dots || !s->segments || (o->colors && !s->tones)) goto done;
  st = batten_mesh_vertex_normals(ctx, mesh, normals);
  if (o->normals) take_normals(V, o->normals, normals);
  if (st >= 0 && o->colors) st = color_range(ctx, V, o);
  if (st < 0) goto done;
  s->period = (float)(o->color_upper - o->color_lower);
  fill_scene(&view->ball, mesh, o, normals, s);
  st = batten_progress(ctx, "picture", 0);
  if (st < 0) goto done;
  st = o->normals ? BATTEN_OK : picture_part_normals(ctx, s);
done:
  batten_free(ctx, normals);
  return st;
}

/* ---- camera -------------------------------------------------------------------------------------- */

/* The frame of the picture that the thing fills, in pixels. */
typedef struct view_box {
  double x0, y0, x1, y1;
} view_box;

static view_box view_frame(const picture_view *v) {
  const batten_picture_options *o = &v->o;
  double margin = 0.055 * fmin(o->width, o->height), unit = v->unit, top = picture_title_room(o, unit);
  if (o->axes)
    return (view_box){PICTURE_AXES_LEFT * unit, top + PICTURE_AXES_ABOVE * unit, o->width - PICTURE_AXES_RIGHT * unit,
                      o->height - PICTURE_AXES_BELOW * unit};
  double bar = picture_has_color_bar(o) ? picture_color_bar_room(o, unit) : 0;
  return (view_box){margin, top + margin, o->width - margin - bar, o->height - 1.3 * margin};
}

/* What has to be in view: most[k][side] is the largest of +-a + tangent depth along right (k = 0) and up. */
typedef struct view_extent {
  double tangent[2], most[2][2];
} view_extent;

static void extend(const picture_camera *c, const float p[3], view_extent *e) {
  const double *axes[2] = {c->right, c->up};
  double depth = c->back[0] * p[0] + c->back[1] * p[1] + c->back[2] * p[2];
  for (size_t k = 0; k < 2; k++) {
    double a = axes[k][0] * p[0] + axes[k][1] * p[1] + axes[k][2] * p[2];
    e->most[k][0] = fmax(e->most[k][0], a + e->tangent[k] * depth);
    e->most[k][1] = fmax(e->most[k][1], -a + e->tangent[k] * depth);
  }
}

/* Lines that lead farther out than this, of the ball's radius, would make what they lead from too small. */
static const float lines_in_view = 1.4f;

static void extend_view(const picture_camera *c, const picture_view *v, view_extent *e) {
  for (size_t i = 0; i < v->scene.vertex_count; i++) extend(c, v->scene.vertices + 3 * i, e);
  for (size_t i = 0; i < 2 * v->scene.segment_count; i++) {
    const float *p = v->scene.segments + 3 * i;
    float distance = sqrtf(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    if (!isfinite(distance)) continue;
    float factor = distance > lines_in_view ? lines_in_view / distance : 1;
    extend(c, (float[3]){factor * p[0], factor * p[1], factor * p[2]}, e);
  }
  for (unsigned i = 0; v->o.axes && i < 8; i++) {
    double corner[3];
    float p[3];
    box_corner(v->o.axes, i, corner);
    picture_to_ball(&v->ball, corner, p);
    extend(c, p, e);
  }
}

/* The nearest camera of 24 degrees that sees all of a group within the box. A point is inside the left and right
 * planes when |a - offset| <= t (distance - c), a and c its coordinates along right and back: two linear bounds on
 * offset and distance, so the best of both comes from two maxima; the same upwards. */
static picture_camera camera_fit(size_t count, const picture_view *views, const picture_view *of) {
  const batten_picture_options *o = &of->o;
  const double degree = 0.017453292519943295;
  double sa = sin(o->azimuth_deg * degree), ca = cos(o->azimuth_deg * degree);
  double se = sin(o->elevation_deg * degree), ce = cos(o->elevation_deg * degree);
  picture_camera c = {.right = {-sa, ca, 0}, .up = {-se * ca, -se * sa, ce}, .back = {ce * ca, ce * sa, se}};
  view_box box = view_frame(of);
  for (size_t i = 0; i < count; i++) {
    if (!together(&views[i], of)) continue;
    view_box b = view_frame(&views[i]);
    box = (view_box){fmax(box.x0, b.x0), fmax(box.y0, b.y0), fmin(box.x1, b.x1), fmin(box.y1, b.y1)};
  }
  /* Lettering that leaves no room is drawn over the view. */
  if (!(box.x1 - box.x0 > 0.2 * o->width)) box.x0 = 0.1 * o->width, box.x1 = 0.9 * o->width;
  if (!(box.y1 - box.y0 > 0.2 * o->height)) box.y0 = 0.1 * o->height, box.y1 = 0.9 * o->height;
  c.focal = 0.5 * fmin(o->width, o->height) / tan(12 * degree);
  c.center[0] = 0.5 * (box.x0 + box.x1);
  c.center[1] = 0.5 * (box.y0 + box.y1);
  view_extent e = {{0.5 * (box.x1 - box.x0) / c.focal, 0.5 * (box.y1 - box.y0) / c.focal},
                   {{-INFINITY, -INFINITY}, {-INFINITY, -INFINITY}}};
  for (size_t i = 0; i < count; i++)
    if (together(&views[i], of)) extend_view(&c, &views[i], &e);
  c.distance = 2.5; /* out of the unit ball, also for a mesh that is a point from here */
  for (size_t k = 0; k < 2; k++) {
    c.distance = fmax(c.distance, 0.5 * (e.most[k][0] + e.most[k][1]) / e.tangent[k]);
    c.offset[k] = 0.5 * (e.most[k][0] - e.most[k][1]);
  }
  return c;
}

/* ---- views --------------------------------------------------------------------------------------- */

batten_status picture_check_mesh(batten_context *ctx, const picture_view *view, const char *name) {
  size_t V = batten_mesh_vertex_count(view->mesh), F = batten_mesh_triangle_count(view->mesh), bad;
  if (F == 0) return batten_fail(ctx, BATTEN_E_INVALID, "%sthe mesh has no triangles to draw", name);
  if (F > UINT32_MAX - 1 || view->o.point_count > UINT32_MAX - 1 - F)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%s%zu triangles and %zu points: at most %u together", name, F,
                       view->o.point_count, UINT32_MAX - 1);
  if ((bad = batten_first_nonfinite(3 * V, batten_mesh_vertices(view->mesh))) < 3 * V)
    return batten_fail(ctx, BATTEN_E_INVALID, "%smesh: vertex %zu is not finite", name, bad / 3);
  return BATTEN_OK;
}

batten_status picture_views_make(batten_context *ctx, size_t count, picture_view *views) {
  double drawn = 0, done = 0;
  for (size_t i = 0; i < count; i++) {
    if (!views[i].mesh) continue;
    views[i].ball = ball_of(count, views, &views[i]);
    batten_status st = scene_make(ctx, &views[i]); /* which settles the range of the colours */
    if (st < 0) return st;
    drawn++;
  }
  for (size_t i = 0; i < count; i++) {
    picture_view *v = &views[i];
    if (!v->mesh) continue;
    v->camera = camera_fit(count, views, v);
    v->scene.progress_at = done++ / drawn;
    v->scene.progress_share = 1 / drawn;
    for (size_t j = 0; j < count; j++)
      if (together(&views[j], v)) v->scene.ground = fminf(v->scene.ground, views[j].scene.ground);
    if (v->o.axes) {
      float lower[3];
      picture_to_ball(&v->ball, v->o.axes->lower, lower);
      v->scene.ground = fminf(v->scene.ground, lower[2]);
    }
  }
  return BATTEN_OK;
}

void picture_views_free(batten_context *ctx, size_t count, picture_view *views) {
  for (size_t i = 0; i < count; i++) scene_free(ctx, &views[i].scene);
}

batten_status picture_progress(batten_context *ctx, const picture_scene *scene, double part) {
  return batten_progress(ctx, "picture", scene->progress_at + scene->progress_share * part);
}
