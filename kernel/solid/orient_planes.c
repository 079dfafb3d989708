/* Orientation by local planes: cheap, for many points.   [after Hoppe, DeRose, Duchamp, McDonald, Stuetzle 1992]
 *
 *   1. The forest of firmest ties gives each of its trees signs that agree (orient_forest.c).
 *   2. Each tree is turned so that its extreme points look outwards, and turned round again when it lies inside
 *      an odd number of the others (winding numbers): the walls of cavities. Strays are no extreme points.
 *
 * Time O(N log N) + (components whose boxes overlap) x N. */
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "orient.h"

/* Pieces, and points of pieces, that are looked at between two looks at the host. */
enum { SLICE = 64, POINTS = 1 << 17 };

/* Planes turned as the forest says; piece [count]: label of each point's component, numbered by first point. Returns
 * how many. */
static size_t turn_planes(const batten_orient_graph *g, batten_orient_forest *f, size_t *piece, double *normals) {
  unsigned n = g->n;
  size_t pieces = 0;
  bool opposed;
  for (size_t i = 0; i < g->count; i++) piece[i] = SIZE_MAX;
  for (size_t i = 0; i < g->count; i++) {
    size_t root = batten_orient_forest_root(f, i, &opposed);
    for (unsigned c = 0; c < n; c++) normals[i * n + c] = opposed ? -g->plane[i * n + c] : g->plane[i * n + c];
    if (piece[root] == SIZE_MAX) piece[root] = pieces++; /* a root may come after its points */
    piece[i] = piece[root];
  }
  return pieces;
}

typedef struct box {
  double lower[3], upper[3];
  size_t extreme; /* a point of the component on its box: inside no part of its own */
  bool strays;    /* of these alone */
} box;

static void find_boxes(const batten_orient_graph *g, size_t pieces, const size_t *piece, box *boxes) {
  unsigned n = g->n;
  for (size_t p = 0; p < pieces; p++)
    boxes[p] = (box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}, 0, true};
  for (size_t i = 0; i < g->count; i++)
    if (g->area[i] > 0) boxes[piece[i]].strays = false;
  for (size_t i = 0; i < g->count; i++) {
    box *b = boxes + piece[i];
    const double *x = g->points + i * n;
    if (g->area[i] == 0 && !b->strays) continue; /* only where there is nothing else */
    if (x[0] < b->lower[0]) b->extreme = i;
    for (unsigned c = 0; c < n; c++) {
      b->lower[c] = fmin(b->lower[c], x[c]);
      b->upper[c] = fmax(b->upper[c], x[c]);
    }
  }
}

/* Winding number about x of what point j stands for. */
static double winding(const batten_orient_graph *g, const double *normals, size_t j, const double *x) {
  const double full = g->n == 2 ? 6.283185307179586 : 12.566370614359172;
  double square = 0, flux = 0;
  for (unsigned c = 0; c < g->n; c++) {
    double d = g->points[j * g->n + c] - x[c];
    square += d * d;
    flux += d * normals[j * g->n + c];
  }
  if (square == 0) return 0;
  return flux * g->area[j] / (full * (g->n == 2 ? square : square * sqrt(square)));
}

/* Number of other components around component p. order: points sorted by component, start [pieces + 1]. */
static size_t depth(const batten_orient_graph *g, const double *normals, size_t pieces, const box *boxes,
                    const size_t *order, const size_t *start, size_t p) {
  unsigned n = g->n;
  const double *x = g->points + boxes[p].extreme * n;
  size_t around = 0;
  for (size_t q = 0; q < pieces; q++) {
    bool within = q != p;
    for (unsigned c = 0; c < n; c++) within = within && x[c] > boxes[q].lower[c] && x[c] < boxes[q].upper[c];
    if (!within) continue;
    double turns = 0;
    for (size_t s = start[q]; s < start[q + 1]; s++) turns += winding(g, normals, order[s], x);
    if (turns > 0.5) around++;
  }
  return around;
}

typedef struct depth_task {
  const batten_orient_graph *graph;
  const double *normals;
  size_t pieces;
  const box *boxes;
  const size_t *order, *start;
  unsigned char *inside;
  size_t first;
} depth_task;

static void find_depth(void *task, size_t index) {
  const depth_task *t = task;
  size_t p = t->first + index;
  t->inside[p] = depth(t->graph, t->normals, t->pieces, t->boxes, t->order, t->start, p) & 1;
}

/* Puts the strays behind the others, unless all are; returns how many the others are. */
static size_t drop_strays(const batten_orient_graph *g, size_t count, size_t *members) {
  size_t kept = 0;
  for (size_t q = 0; q < count; q++) {
    size_t i = members[q];
    if (g->area[i] == 0) continue;
    members[q] = members[kept];
    members[kept++] = i;
  }
  return kept ? kept : count;
}

static void turn(const batten_orient_graph *g, size_t begin, size_t end, const size_t *order, double *normals) {
  for (size_t s = begin; s < end; s++)
    for (unsigned c = 0; c < g->n; c++) normals[order[s] * g->n + c] *= -1;
}

/* Step 2. */
static batten_status settle_components(batten_context *ctx, const batten_orient_graph *g, size_t pieces,
                                       const size_t *piece, double *normals) {
  batten_status status = BATTEN_E_NOMEM;
  size_t *order = NULL, *start = NULL;
  unsigned char *inside = NULL;
  box *boxes = NULL;
  if (!(order = batten_alloc_array(ctx, g->count, sizeof *order)) ||
      !(start = batten_alloc_array(ctx, pieces + 1, sizeof *start)) ||
      !(inside = batten_alloc_array(ctx, pieces, sizeof *inside)) ||
      !(boxes = batten_alloc_array(ctx, pieces, sizeof *boxes)))
    goto done;
  memset(start, 0, (pieces + 1) * sizeof *start);
  for (size_t i = 0; i < g->count; i++) start[piece[i] + 1]++;
  for (size_t p = 0; p < pieces; p++) start[p + 1] += start[p];
  for (size_t i = g->count; i-- > 0;) order[--start[piece[i] + 1]] = i; /* start[p + 1] walks down to p's begin */
  memmove(start, start + 1, pieces * sizeof *start);
  start[pieces] = g->count;

  find_boxes(g, pieces, piece, boxes);
  size_t looked_at = POINTS;
  for (size_t p = 0; p < pieces; p++) {
    if (looked_at >= POINTS) {
      if ((status = batten_progress(ctx, "orient", 0.38)) < 0) goto done;
      looked_at = 0;
    }
    looked_at += start[p + 1] - start[p];
    size_t members = drop_strays(g, start[p + 1] - start[p], order + start[p]);
    if (batten_orient_outwardness(g->n, g->points, normals, members, order + start[p]) < 0)
      turn(g, start[p], start[p + 1], order, normals);
  }
  depth_task task = {g, normals, pieces, boxes, order, start, inside, 0};
  for (; task.first < pieces; task.first += SLICE) {
    if ((status = batten_progress(ctx, "orient", 0.4)) < 0) goto done;
    batten_parallel(ctx, pieces - task.first < SLICE ? pieces - task.first : SLICE, find_depth, &task);
  }
  for (size_t p = 0; p < pieces; p++)
    if (inside[p]) turn(g, start[p], start[p + 1], order, normals);
  status = BATTEN_OK;
done:
  batten_free(ctx, boxes);
  batten_free(ctx, inside);
  batten_free(ctx, start);
  batten_free(ctx, order);
  return status;
}

batten_status batten_orient_planes(batten_context *ctx, const batten_orient_graph *g, batten_orient_forest *forest,
                                   double *normals) {
  size_t *piece = batten_alloc_array(ctx, g->count, sizeof *piece);
  batten_status status = piece ? batten_orient_forest_join(ctx, g, forest, INFINITY, 0.35) : BATTEN_E_NOMEM;
  if (status >= 0) status = settle_components(ctx, g, turn_planes(g, forest, piece, normals), piece, normals);
  batten_free(ctx, piece);
  return status;
}
