/* Pictures of `batten loft`, after figure 5 of the paper: control polygons of the sections, contours with sections
 * between them, and the surface in the colours of two curvatures, of the result and perhaps of the surface without
 * inequalities above it. See loft.h; all is drawn from the patches and contours alone. */
#include "loft.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "convex_picture.h" /* segments that grow */

enum {
  PANELS = 4,       /* of a surface */
  LINE_KINDS = 4,   /* of a panel at most */
  PLACES_T = 240,   /* segments of the grids along a contour, and */
  PLACES_Z = 160,   /* across all of them, about */
  SECTIONS = 42,    /* drawn in all, about */
  SECTIONS_MAX = 7, /* in a patch */
  CONTOURS = 24,    /* whose lines are drawn, at most: more darken what is between them */
  CURVE_STEPS = 8,  /* of a drawn section in a cell of the grid: none between the grid's columns */
  TEXT = 128
};

/* ---- places ---------------------------------------------------------------------------------------- */

/* (x, y, height) -> a place of the picture: origin + x rows[0] + y rows[1] + height rows[2]. */
typedef struct frame {
  double origin[3], rows[3][3];
} frame;

static void turn(const frame *f, const double p[3], double out[3]) {
  for (int k = 0; k < 3; k++) out[k] = p[0] * f->rows[0][k] + p[1] * f->rows[1][k] + p[2] * f->rows[2][k];
}

static void place(const frame *f, const double p[3], double out[3]) {
  turn(f, p, out);
  for (int k = 0; k < 3; k++) out[k] += f->origin[k];
}

static void cross(const double a[3], const double b[3], double out[3]) {
  for (int k = 0; k < 3; k++) out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static frame frame_of(const batten_plane *base, double height_scale) {
  frame f = {{0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  if (base) {
    memcpy(f.origin, base->origin, sizeof f.origin);
    memcpy(f.rows, base->axes, sizeof base->axes);
    cross(base->axes[0], base->axes[1], f.rows[2]);
  }
  for (int k = 0; k < 3; k++) f.rows[2][k] *= height_scale;
  return f;
}

/* Stacks between these shapes, heights by the size of the contours, are drawn as they are; others as if they had it.
 */
static const double lowest_shape = 0.35, highest_shape = 8;

static double contour_size(const loft_scene *scene) {
  double lower[2] = {INFINITY, INFINITY}, upper[2] = {-INFINITY, -INFINITY};
  for (size_t i = 0; i < scene->contour_count; i++) {
    batten_curve_form f = batten_curve_get(scene->contours[i]);
    for (size_t j = 0; j + f.degree + 1 < f.knot_count; j++)
      for (int k = 0; k < 2; k++) {
        lower[k] = fmin(lower[k], f.control_points[2 * j + (size_t)k]);
        upper[k] = fmax(upper[k], f.control_points[2 * j + (size_t)k]);
      }
  }
  return fmax(upper[0] - lower[0], upper[1] - lower[1]);
}

static double choose_scale(const loft_scene *scene, double size) {
  if (scene->height_scale > 0) return scene->height_scale;
  double shape = (scene->heights[scene->contour_count - 1] - scene->heights[0]) / size;
  double wanted = shape < lowest_shape ? lowest_shape / shape : shape > highest_shape ? highest_shape / shape : 1;
  if (wanted == 1 || !isfinite(wanted)) return 1;
  double power = pow(10, floor(log10(wanted))), lead = wanted / power; /* a number that can be read */
  return power * (lead < 1.5 ? 1 : lead < 3.5 ? 2 : lead < 7.5 ? 5 : 10);
}

/* ---- one surface ----------------------------------------------------------------------------------- */

typedef struct side {
  const batten_surface *const *patches;
  size_t vertex_count, triangle_count;
  double *vertices, *normals; /* [vertex_count][3] */
  double *curvatures[2];      /* [vertex_count] Gaussian; of the sections */
  double *tones[2];
  uint32_t *triangles;
  batten_mesh *mesh, *bare; /* bare: nothing is seen of it, it is as large as the other */
  convex_segments polygons, dots, sections;
  double *levels; /* where sections do not bend */
  size_t level_count;
} side;

typedef struct drawing {
  const loft_scene *scene;
  const batten_picture_options *view;
  frame frame;
  double size, height_scale;
  size_t rows, between;           /* steps of the grid across a patch, sections drawn inside it */
  convex_segments contours, data; /* the given curves and their control polygons */
  side sides[2];
} drawing;

static void drawing_free(batten_context *ctx, drawing *d) {
  batten_free(ctx, d->contours.ends);
  batten_free(ctx, d->data.ends);
  for (int i = 0; i < 2; i++) {
    side *s = &d->sides[i];
    double *arrays[] = {s->vertices, s->normals, s->curvatures[0], s->curvatures[1], s->tones[0],
                        s->tones[1], s->levels,  s->polygons.ends, s->dots.ends,     s->sections.ends};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++) batten_free(ctx, arrays[k]);
    batten_free(ctx, s->triangles);
    batten_mesh_free(s->mesh);
    batten_mesh_free(s->bare);
  }
}

/* Columns of a patch's grid: every span by itself, since curvatures may jump between them. */
static size_t span_count(const batten_surface_form *f) {
  size_t spans = 0;
  for (size_t i = 1; i < f->knot_count[0]; i++) spans += f->knots[0][i] > f->knots[0][i - 1];
  return spans;
}

static size_t span_steps(const batten_surface_form *f) {
  size_t spans = span_count(f), steps = PLACES_T / (spans ? spans : 1);
  return steps < 3 ? 3 : steps > 24 ? 24 : steps;
}

static batten_status side_reserve(batten_context *ctx, const drawing *d, side *s) {
  size_t vertices = 0, triangles = 0;
  for (size_t i = 0; i + 1 < d->scene->contour_count; i++) {
    batten_surface_form f = batten_surface_get(s->patches[i]);
    size_t steps = span_steps(&f), spans = span_count(&f);
    vertices += spans * (steps + 1) * (d->rows + 1);
    triangles += 2 * spans * steps * d->rows;
  }
  s->vertices = batten_alloc_array(ctx, vertices, 3 * sizeof *s->vertices);
  s->normals = batten_alloc_array(ctx, vertices, 3 * sizeof *s->normals);
  s->triangles = batten_alloc_array(ctx, triangles, 3 * sizeof *s->triangles);
  for (int k = 0; k < 2; k++) {
    s->curvatures[k] = batten_alloc_array(ctx, vertices, sizeof(double));
    s->tones[k] = batten_alloc_array(ctx, vertices, sizeof(double));
    if (!s->curvatures[k] || !s->tones[k]) return BATTEN_E_NOMEM;
  }
  return s->vertices && s->normals && s->triangles ? BATTEN_OK : BATTEN_E_NOMEM;
}

static double section_curvature(const batten_surface_point *p) {
  double speed = hypot(p->du[0], p->du[1]);
  return (p->du[0] * p->duu[1] - p->du[1] * p->duu[0]) / (speed * speed * speed);
}

static void take_vertex(const drawing *d, side *s, const batten_surface_point *p) {
  double du[3], dv[3];
  size_t at = s->vertex_count++;
  place(&d->frame, p->point, s->vertices + 3 * at);
  turn(&d->frame, p->du, du);
  turn(&d->frame, p->dv, dv);
  cross(du, dv, s->normals + 3 * at);
  s->curvatures[0][at] = p->gauss;
  s->curvatures[1][at] = section_curvature(p);
}

static void take_triangles(const drawing *d, side *s, size_t first, size_t steps) {
  for (size_t i = 0; i < steps; i++)
    for (size_t j = 0; j < d->rows; j++) {
      size_t a = first + i * (d->rows + 1) + j, b = a + d->rows + 1;
      const size_t corners[6] = {a, b, b + 1, a, b + 1, a + 1};
      for (int k = 0; k < 6; k++) s->triangles[3 * s->triangle_count + (size_t)k] = (uint32_t)corners[k];
      s->triangle_count += 2;
    }
}

/* The grid of one span of a patch. */
static batten_status take_span(batten_context *ctx, drawing *d, side *s, const batten_surface *patch, size_t steps,
                               const double t[2], const double z[2], double *places, batten_surface_point *points) {
  size_t count = 0, first = s->vertex_count;
  for (size_t i = 0; i <= steps; i++)
    for (size_t j = 0; j <= d->rows; j++, count++) {
      double a = (double)i / (double)steps, b = (double)j / (double)d->rows;
      places[2 * count] = i == steps ? nextafter(t[1], t[0]) : t[0] + a * (t[1] - t[0]); /* from the left */
      places[2 * count + 1] = j == d->rows ? z[1] : z[0] + b * (z[1] - z[0]);
    }
  batten_status st = batten_surface_evaluate(ctx, patch, count, places, points);
  for (size_t i = 0; st >= 0 && i < count; i++) take_vertex(d, s, &points[i]);
  if (st >= 0) take_triangles(d, s, first, steps);
  return st;
}

static batten_status take_patch(batten_context *ctx, drawing *d, side *s, const batten_surface *patch) {
  batten_surface_form f = batten_surface_get(patch);
  size_t steps = span_steps(&f), count = (steps + 1) * (d->rows + 1);
  double *places = batten_alloc_array(ctx, count, 2 * sizeof *places);
  batten_surface_point *points = batten_alloc_array(ctx, count, sizeof *points);
  batten_status st = places && points ? BATTEN_OK : BATTEN_E_NOMEM;
  const double z[2] = {f.knots[1][0], f.knots[1][f.knot_count[1] - 1]};
  for (size_t i = 1; st >= 0 && i < f.knot_count[0]; i++)
    if (f.knots[0][i] > f.knots[0][i - 1])
      st = take_span(ctx, d, s, patch, steps, (double[2]){f.knots[0][i - 1], f.knots[0][i]}, z, places, points);
  batten_free(ctx, places);
  batten_free(ctx, points);
  return st;
}

/* ---- lines ------------------------------------------------------------------------------------------ */

static batten_status add_polyline(batten_context *ctx, const frame *f, size_t count, const double *points,
                                  convex_segments *out) {
  batten_status st = BATTEN_OK;
  double from[3], to[3];
  place(f, points, from);
  for (size_t i = 1; st >= 0 && i < count; i++) {
    place(f, points + 3 * i, to);
    st = convex_add_segment(ctx, out, from, to);
    memcpy(from, to, sizeof from);
  }
  return st;
}

/* Point j of a section's polygon: what the Bezier curve of its trajectory has there. */
static void trajectory(const batten_surface_form *f, size_t j, double part, double out[3]) {
  double b[BATTEN_SURFACE_DEGREE_MAX + 1][3];
  unsigned n = f->degree[1];
  memcpy(b, f->control_points + 3 * j * (n + 1), 3 * (n + 1) * sizeof(double));
  for (unsigned r = n; r > 0; r--)
    for (unsigned k = 0; k < r; k++)
      for (int c = 0; c < 3; c++) b[k][c] += part * (b[k + 1][c] - b[k][c]);
  memcpy(out, b[0], 3 * sizeof *out);
}

static batten_status add_polygons(batten_context *ctx, const drawing *d, side *s, const batten_surface *patch) {
  batten_surface_form f = batten_surface_get(patch);
  size_t count = f.knot_count[0] - f.degree[0] - 1;
  double *points = batten_alloc_array(ctx, count, 3 * sizeof *points), at[3];
  batten_status st = points ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t i = 1; st >= 0 && i <= d->between; i++) {
    for (size_t j = 0; j < count; j++) trajectory(&f, j, (double)i / (double)(d->between + 1), points + 3 * j);
    st = add_polyline(ctx, &d->frame, count, points, &s->polygons);
  }
  batten_free(ctx, points);
  for (size_t i = 0; st >= 0 && i < count * (f.degree[1] + 1); i++) {
    place(&d->frame, f.control_points + 3 * i, at);
    st = convex_add_segment(ctx, &s->dots, at, at);
  }
  return st;
}

static batten_status add_sections(batten_context *ctx, const drawing *d, side *s, const batten_surface *patch) {
  batten_surface_form f = batten_surface_get(patch);
  size_t count = span_count(&f) * CURVE_STEPS + 1;
  double *places = batten_alloc_array(ctx, count, 2 * sizeof *places);
  double *line = batten_alloc_array(ctx, count, 3 * sizeof *line);
  batten_surface_point *points = batten_alloc_array(ctx, count, sizeof *points);
  batten_status st = places && points && line ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t i = 1; st >= 0 && i <= d->between; i++) {
    double part = (double)i / (double)(d->between + 1), *at = places;
    double z = f.knots[1][0] + part * (f.knots[1][f.knot_count[1] - 1] - f.knots[1][0]);
    for (size_t k = 1; k < f.knot_count[0]; k++) {
      double from = f.knots[0][k - 1], to = f.knots[0][k];
      for (int step = 0; from < to && step < CURVE_STEPS; step++, at += 2) {
        at[0] = from + (to - from) * step / CURVE_STEPS;
        at[1] = z;
      }
    }
    at[0] = f.knots[0][f.knot_count[0] - 1];
    at[1] = z;
    st = batten_surface_evaluate(ctx, patch, count, places, points);
    for (size_t k = 0; st >= 0 && k < count; k++) memcpy(line + 3 * k, points[k].point, sizeof points[k].point);
    if (st >= 0) st = add_polyline(ctx, &d->frame, count, line, &s->sections);
  }
  batten_free(ctx, line);
  batten_free(ctx, points);
  batten_free(ctx, places);
  return st;
}

static batten_status add_contour(batten_context *ctx, drawing *d, size_t i) {
  const batten_curve *curve = d->scene->contours[i];
  batten_curve_form f = batten_curve_get(curve);
  size_t points = f.knot_count - f.degree - 1, count = 0;
  double *parameters = NULL, *line = NULL;
  batten_curve_point *at = NULL;
  batten_status st = batten_curve_sample(ctx, curve, 3e-4 * d->size, &count, &parameters);
  if (st < 0) return st;
  at = batten_alloc_array(ctx, count, sizeof *at);
  line = batten_alloc_array(ctx, count > points ? count : points, 3 * sizeof *line);
  st = at && line ? batten_curve_evaluate(ctx, curve, count, parameters, at) : BATTEN_E_NOMEM;
  for (size_t k = 0; st >= 0 && k < count; k++)
    memcpy(line + 3 * k, (double[3]){at[k].point[0], at[k].point[1], d->scene->heights[i]}, 3 * sizeof *line);
  if (st >= 0) st = add_polyline(ctx, &d->frame, count, line, &d->contours);
  for (size_t k = 0; st >= 0 && k < points; k++) {
    const double *p = f.control_points + 2 * k;
    memcpy(line + 3 * k, (double[3]){p[0], p[1], d->scene->heights[i]}, 3 * sizeof *line);
  }
  if (st >= 0) st = add_polyline(ctx, &d->frame, points, line, &d->data);
  batten_free(ctx, line);
  batten_free(ctx, at);
  batten_free(ctx, parameters);
  return st;
}

/* Lines are drawn about a mesh: here a triangle without area, with the box of the surface. */
static batten_status make_bare(batten_context *ctx, side *s) {
  double corners[4][3];
  for (int k = 0; k < 3; k++) {
    double lower = INFINITY, upper = -INFINITY;
    for (size_t i = 0; i < s->vertex_count; i++) {
      lower = fmin(lower, s->vertices[3 * i + (size_t)k]);
      upper = fmax(upper, s->vertices[3 * i + (size_t)k]);
    }
    for (int i = 0; i < 4; i++) corners[i][k] = i == 3 ? upper : lower;
  }
  return batten_mesh_create(ctx, 4, corners[0], 1, (const uint32_t[3]){0, 1, 2}, &s->bare);
}

static batten_status gather(batten_context *ctx, drawing *d, side *s) {
  batten_status st = side_reserve(ctx, d, s);
  for (size_t i = 0; st >= 0 && i + 1 < d->scene->contour_count; i++) {
    st = take_patch(ctx, d, s, s->patches[i]);
    if (st >= 0) st = add_polygons(ctx, d, s, s->patches[i]);
    if (st >= 0) st = add_sections(ctx, d, s, s->patches[i]);
  }
  if (st >= 0) st = batten_mesh_create(ctx, s->vertex_count, s->vertices, s->triangle_count, s->triangles, &s->mesh);
  if (st >= 0) st = make_bare(ctx, s);
  return st;
}

/* ---- colours ---------------------------------------------------------------------------------------- */

static int compare_doubles(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

/* What has the full colour: nineteen of twenty values of the result are smaller. */
static batten_status full_tone(batten_context *ctx, const side *s, int which, double *out) {
  double *sizes = batten_alloc_array(ctx, s->vertex_count, sizeof *sizes);
  size_t n = 0;
  if (!sizes) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < s->vertex_count; i++)
    if (isfinite(s->curvatures[which][i])) sizes[n++] = fabs(s->curvatures[which][i]);
  qsort(sizes, n, sizeof *sizes, compare_doubles);
  *out = n ? sizes[n - 1 - n / 20] : 0;
  batten_free(ctx, sizes);
  return BATTEN_OK;
}

/* Roots, so that a sign shows where the curvature is small, too; but none where it is rounding, of which 1 / size
 * (its square for K) is the measure. */
static void set_tones(const drawing *d, side *s, int which, double full) {
  double rounding = which == 0 ? 1e-9 / (d->size * d->size) : 1e-9 / d->size;
  for (size_t i = 0; i < s->vertex_count; i++) {
    double c = s->curvatures[which][i];
    double part = full > rounding ? fmin(1, fabs(c) / full) : fmin(1, fabs(c) * d->size);
    s->tones[which][i] = !isfinite(c) ? NAN : fabs(c) <= rounding ? 0 : copysign(sqrt(part), c);
  }
}

/* Most of the result is blue, whichever way its contours run. */
static void turn_signs(drawing *d, size_t sides) {
  const side *result = &d->sides[sides - 1];
  ptrdiff_t balance = 0;
  for (size_t i = 0; i < result->vertex_count; i++)
    balance += (result->curvatures[1][i] > 0) - (result->curvatures[1][i] < 0);
  for (size_t k = 0; balance < 0 && k < sides; k++)
    for (size_t i = 0; i < d->sides[k].vertex_count; i++)
      d->sides[k].curvatures[1][i] = -d->sides[k].curvatures[1][i];
}

static batten_status color(batten_context *ctx, drawing *d, size_t sides) {
  batten_status st = BATTEN_OK;
  turn_signs(d, sides);
  for (int which = 0; st >= 0 && which < 2; which++) {
    double full = 0;
    st = full_tone(ctx, &d->sides[sides - 1], which, &full);
    for (size_t i = 0; st >= 0 && i < sides; i++) set_tones(d, &d->sides[i], which, full);
  }
  const double zero = 0;
  for (size_t i = 0; st >= 0 && i < sides; i++) {
    side *s = &d->sides[i];
    st = batten_mesh_level_lines(ctx, s->mesh, s->tones[1], 1, &zero, &s->level_count, &s->levels);
  }
  return st;
}

/* ---- panels ----------------------------------------------------------------------------------------- */

typedef struct panel {
  batten_picture_lines lines[LINE_KINDS];
  char caption[TEXT];
  batten_picture_options options;
} panel;

static batten_picture_lines kind(const convex_segments *s, unsigned rgb, double width, double hidden) {
  return (batten_picture_lines){s->count, s->ends, rgb, width, hidden};
}

/* Stacks of many contours are drawn with finer lines. */
static double line_share(const drawing *d) {
  double many = (double)d->scene->contour_count;
  return fmax(0.2, fmin(1, 8 / many));
}

/* The polygons of closed stacks are seen on the surface: front and back together would be a tangle. */
static bool is_closed(const drawing *d) { return batten_curve_get(d->scene->contours[0]).closed != 0; }

static void describe(const drawing *d, const side *s, unsigned which, const char *name, panel *p) {
  static const char *const titles[PANELS] = {"control polygons", "contours and sections", "Gaussian curvature",
                                             "curvature of sections"};
  double w = line_share(d), behind = is_closed(d) ? 0.1 : 0.7;
  batten_picture_options *o = &p->options;
  *o = batten_picture_options_default();
  if (which == 0) {
    p->lines[0] = kind(&s->dots, 0x8f959d, fmax(1.6, 6 * w), behind);
    p->lines[1] = kind(&s->polygons, 0x24466f, fmax(0.8, 1.5 * w), behind);
    /* twice: lines are a little transparent */
    p->lines[2] = p->lines[3] = kind(&d->data, 0x000000, fmax(1.6, 5 * w), behind);
  } else if (which == 1) {
    p->lines[0] = kind(&d->data, 0x7d848d, fmax(0.8, 2.6 * w), 0.3);
    p->lines[1] = kind(&s->sections, 0x24466f, fmax(0.8, 1.5 * w), 0.2);
    p->lines[2] = p->lines[3] = kind(&d->contours, 0x000000, fmax(1.2, 4 * w), 0.15);
  } else {
    p->lines[0] = kind(&d->contours, 0x000000, fmax(0.8, 2.4 * w), 0.1);
    if (which == 3) p->lines[1] = (batten_picture_lines){s->level_count, s->levels, 0xb01010, 2, 0};
    o->colors = s->tones[which - 2];
    o->color_map = BATTEN_MAP_PARTED;
    o->color_lower = -1;
    o->color_upper = 1;
    o->no_color_bar = 1;
  }
  o->line_count = LINE_KINDS;
  o->lines = p->lines;
  o->azimuth_deg = d->view->azimuth_deg;
  o->elevation_deg = d->view->elevation_deg;
  o->up_axis = d->view->up_axis;
  if (which > 0 || is_closed(d)) o->normals = s->normals;
  o->both_sides = 1;
  o->title = titles[which];
  size_t length = (size_t)snprintf(p->caption, TEXT, "%s", name);
  if (d->height_scale != 1)
    snprintf(p->caption + length, TEXT - length, "%sheights drawn %g times as large", length ? ", " : "",
             d->height_scale);
  if (*p->caption) o->caption = p->caption;
}

static batten_status draw(batten_context *ctx, const drawing *d, size_t sides, const char *path) {
  panel *panels = batten_alloc_array(ctx, 2 * PANELS, sizeof *panels);
  batten_picture_panel shown[2 * PANELS] = {{0}};
  if (!panels) return BATTEN_E_NOMEM;
  memset(panels, 0, 2 * PANELS * sizeof *panels);
  for (size_t i = 0; i < sides; i++)
    for (unsigned k = 0; k < PANELS; k++) {
      const side *s = &d->sides[i];
      panel *p = &panels[i * PANELS + k];
      describe(d, s, k, sides == 1 ? "" : i == 0 ? "without inequalities" : "with inequalities", p);
      shown[i * PANELS + k] = (batten_picture_panel){k == 0 && !is_closed(d) ? s->bare : s->mesh, &p->options, 1};
    }
  batten_status st = batten_picture_panels(ctx, 2, sides == 2 ? PANELS : PANELS / 2, shown, d->view, path);
  batten_free(ctx, panels);
  return st;
}

batten_status loft_draw(batten_context *ctx, const loft_scene *scene, const batten_picture_options *view,
                        const char *path) {
  size_t patches = scene->contour_count - 1, sides = scene->unconstrained ? 2 : 1;
  drawing d = {.scene = scene, .view = view, .size = contour_size(scene)};
  d.height_scale = choose_scale(scene, d.size);
  d.frame = frame_of(scene->base, d.height_scale);
  d.rows = PLACES_Z / patches < 4 ? 4 : PLACES_Z / patches > 32 ? 32 : PLACES_Z / patches;
  d.between = SECTIONS / patches > SECTIONS_MAX ? SECTIONS_MAX : SECTIONS / patches;
  d.sides[0].patches = scene->unconstrained ? scene->unconstrained : scene->patches;
  d.sides[1].patches = scene->patches;
  batten_status st = BATTEN_OK;
  size_t stride = (patches + CONTOURS - 1) / CONTOURS;
  for (size_t i = 0; st >= 0 && i < scene->contour_count; i++)
    if (i % stride == 0 || i == patches) st = add_contour(ctx, &d, i);
  for (size_t i = 0; st >= 0 && i < sides; i++) st = gather(ctx, &d, &d.sides[i]);
  if (st >= 0) st = color(ctx, &d, sides);
  if (st >= 0) st = draw(ctx, &d, sides, path);
  drawing_free(ctx, &d);
  return st;
}
