/* Axes about a mesh: the three walls of their box that are behind it, with a line at each tick, and numbers along the
 * edges where the walls end: the two at the bottom on the near side, and the upright one on the left. */
#include "picture.h"

#include <math.h>

typedef struct axes_work {
  picture_image *image;
  const picture_view *view;
  const picture_buffer *buffer;
  float box[2][3];    /* lower and upper end, in the scene */
  unsigned behind[3]; /* which of both is farther from the camera */
  picture_ticks ticks[3];
} axes_work;

/* The mesh's coordinate that is the scene's k-th. */
static unsigned coordinate(const axes_work *w, unsigned k) { return w->view->ball.axis[k]; }

static void to_pixel(const axes_work *w, const float p[3], double out[2]) {
  float at[3];
  picture_project(&w->view->camera, 1, p, at);
  out[0] = (double)at[0];
  out[1] = (double)at[1];
}

/* Where along axis k a tick stands, in the scene. */
static float tick_place(const axes_work *w, unsigned k, size_t i) {
  const batten_picture_axes *a = w->view->o.axes;
  unsigned c = coordinate(w, k);
  double part = (picture_tick_value(&w->ticks[k], i) - a->from[c]) / (a->to[c] - a->from[c]);
  return (float)(w->box[0][k] + fmin(1, fmax(0, part)) * (double)(w->box[1][k] - w->box[0][k]));
}

/* The edge along which the numbers of axis k stand: its ends, and the direction that leads away from the box. */
typedef struct axes_edge {
  float ends[2][3];
  double outward[2]; /* unit, pixels */
  double length;     /* pixels */
} axes_edge;

static axes_edge find_edge(const axes_work *w, unsigned k) {
  axes_edge e;
  float corner[3], center[3];
  double a[2], b[2], middle[2];
  for (unsigned j = 0; j < 3; j++) {
    corner[j] = w->box[j == 2 ? w->behind[2] : 1 - w->behind[j]][j]; /* the near end of the floor */
    center[j] = 0.5f * (w->box[0][j] + w->box[1][j]);
  }
  if (k == 2) { /* of the two upright edges at the ends of the walls the one further left */
    float other[3] = {corner[0], w->box[w->behind[1]][1], corner[2]};
    float first[3] = {w->box[w->behind[0]][0], corner[1], corner[2]};
    to_pixel(w, first, a);
    to_pixel(w, other, b);
    for (unsigned j = 0; j < 3; j++) corner[j] = a[0] <= b[0] ? first[j] : other[j];
  }
  for (unsigned i = 0; i < 2; i++)
    for (unsigned j = 0; j < 3; j++) e.ends[i][j] = j == k ? w->box[i][k] : corner[j];
  to_pixel(w, e.ends[0], a);
  to_pixel(w, e.ends[1], b);
  e.length = hypot(b[0] - a[0], b[1] - a[1]);
  /* Across the edge on the screen, on the side where the box is not. */
  e.outward[0] = e.length > 0 ? (b[1] - a[1]) / e.length : -1;
  e.outward[1] = e.length > 0 ? (a[0] - b[0]) / e.length : 0;
  to_pixel(w, center, middle);
  if ((middle[0] - a[0]) * e.outward[0] + (middle[1] - a[1]) * e.outward[1] > 0)
    e.outward[0] = -e.outward[0], e.outward[1] = -e.outward[1];
  return e;
}

/* ---- walls --------------------------------------------------------------------------------------- */

/* A line on the wall behind along axis a, where axis c has the value `at`. */
static void wall_line(const axes_work *w, unsigned wall, unsigned a, unsigned c, float at, double strength) {
  float line[6];
  for (unsigned i = 0; i < 2; i++) {
    line[3 * i + wall] = w->box[w->behind[wall]][wall];
    line[3 * i + a] = w->box[i][a];
    line[3 * i + c] = at;
  }
  picture_stroke stroke = {picture_srgb(0x4a4f58), 0.085 * w->view->unit, strength, 0};
  picture_draw_lines(w->image, w->buffer, &w->view->camera, 1, line, &stroke);
}

static void draw_walls(const axes_work *w) {
  for (unsigned wall = 0; wall < 3; wall++)
    for (unsigned c = 0; c < 3; c++) {
      if (c == wall) continue;
      unsigned a = 3 - wall - c;
      for (size_t i = 0; i < w->ticks[c].count; i++) wall_line(w, wall, a, c, tick_place(w, c, i), 0.22);
      for (unsigned end = 0; end < 2; end++) wall_line(w, wall, a, c, w->box[end][c], 0.6);
    }
}

/* ---- numbers ------------------------------------------------------------------------------------- */

/* Text whose box begins `gap` pixels from a place, in a direction; returns how far it reaches. */
static double put_text(const axes_work *w, const double from[2], const double direction[2], double gap, double height,
                       const char *text) {
  double width = picture_text_width(height, text);
  double half = 0.5 * (fabs(direction[0]) * width + fabs(direction[1]) * height);
  double x = from[0] + direction[0] * (gap + half), y = from[1] + direction[1] * (gap + half);
  picture_mask_text(w->image, x - 0.5 * width, y + 0.5 * height, height, 1, text);
  return gap + 2 * half;
}

/* Numbers of an edge that goes up stand beside it rather than across it: where two edges meet theirs keep apart. */
static void text_direction(const axes_edge *e, double out[2]) {
  double x = e->outward[0] + (fabs(e->outward[0]) > 0.5 ? copysign(0.7, e->outward[0]) : 0), y = e->outward[1];
  double length = hypot(x, y);
  out[0] = x / length;
  out[1] = y / length;
}

static void draw_scale(const axes_work *w, unsigned k, const axes_edge *e) {
  double unit = w->view->unit, height = 0.85 * unit, reach = 0;
  if (e->length < 2 * unit) return; /* seen along itself */
  double direction[2];
  text_direction(e, direction);
  const char *label = w->view->o.axes->labels[coordinate(w, k)];
  for (size_t i = 0; i < w->ticks[k].count; i++) {
    char text[PICTURE_TICK_SIZE];
    float place[3] = {e->ends[0][0], e->ends[0][1], e->ends[0][2]};
    double at[2];
    place[k] = tick_place(w, k, i);
    to_pixel(w, place, at);
    picture_tick_text(&w->ticks[k], i, text);
    picture_mask_capsule(w->image, at[0], at[1], at[0] + 0.4 * unit * e->outward[0],
                         at[1] + 0.4 * unit * e->outward[1], 0.05 * unit);
    reach = fmax(reach, put_text(w, at, direction, 0.8 * unit, height, text));
  }
  if (label) {
    float middle[3];
    double at[2];
    for (unsigned j = 0; j < 3; j++) middle[j] = 0.5f * (e->ends[0][j] + e->ends[1][j]);
    to_pixel(w, middle, at);
    put_text(w, at, direction, reach + 0.8 * unit, 1.05 * unit, label);
  }
}

void picture_draw_axes(picture_image *image, const picture_view *view, const picture_buffer *buffer) {
  const batten_picture_axes *a = view->o.axes;
  axes_work w = {.image = image, .view = view, .buffer = buffer};
  axes_edge edges[3];
  picture_to_ball(&view->ball, a->lower, w.box[0]);
  picture_to_ball(&view->ball, a->upper, w.box[1]);
  for (unsigned k = 0; k < 3; k++) w.behind[k] = view->camera.back[k] >= 0 ? 0u : 1u;
  for (unsigned k = 0; k < 3; k++) {
    unsigned c = coordinate(&w, k);
    edges[k] = find_edge(&w, k);
    unsigned wanted = (unsigned)fmin(6, fmax(1, edges[k].length / (4 * view->unit)));
    w.ticks[k] = picture_ticks_choose(a->from[c], a->to[c], wanted);
  }
  draw_walls(&w);
  for (unsigned k = 0; k < 3; k++) draw_scale(&w, k, &edges[k]);
  picture_blend(image, picture_srgb(0x2a2d33), 0.9);
}
