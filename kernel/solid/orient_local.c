/* Neighbours and local planes.
 *
 * The plane through a point is the one of least squares through its k nearest points and itself. Three things make
 * the nearest points a poor choice, and each has its cure:
 *
 *   lines   neighbours of scan lines and contours lie along a line: half of them are kept, the others become the
 *           nearest ones that stand off that line, also where it bends (else the plane is that of the contour)
 *   noise   where the neighbourhood is not much thinner than wide, a wider one is taken when that makes it thinner in
 *           proportion: averaging over noise does, over a rim or a finger it does not. Points that lie in two sheets
 *           (excess of a two-point distribution) are the walls of something thin, no noise.
 *   folds   the point itself then lies off its plane by the noise, which would look like the other side of a wall to
 *           its neighbours: `surface` holds where it would lie in the plane
 *
 * Angles of a plane are off by about noise / (width sqrt(k)). */
#include <math.h>
#include <string.h>

#include "basis/eigen3.h"
#include "orient.h"

enum { CHUNK = 256, SLICE = 32 * CHUNK, WIDE = 64, WIDEST = 160 };
/* Neighbours that spread over less than this part of their length lie on a scan line or contour: no plane. */
static const double THREAD = 0.3;
/* Points of a line follow each other by so many times the distance to the second nearest at most. */
static const double STEP = 1.7;
/* Thickness over width up to which a plane is taken as it is: 10 neighbours then give its direction to 7 degrees. */
static const double THICK = 0.4;
/* By which a wider neighbourhood must be thinner in proportion: noise gives 0.65 and 0.61 from step to step. */
static const double THINNER = 0.8;
/* Fourth over squared second moment of the offsets: 1 for two sheets, 1.8 for a uniform and 3 for a normal
 * distribution. */
static const double TWO_SHEETS = 1.35;
static const size_t WIDTHS[] = {24, WIDE, WIDEST};
enum { WIDTH_COUNT = sizeof WIDTHS / sizeof *WIDTHS };
/* Fewer neighbours are taken where they are this thin and all are not: one side of a thin wall. Seven points without
 * order are so thin by chance in 3 of 100 cases. */
static const double THIN = 0.15;
static const size_t FEWER[] = {8, 6};

typedef struct plane {
  double values[3], vectors[9], mean[3]; /* principal axes, values ascending, vectors in rows */
  double flatness;
} plane;

typedef struct plane_task {
  batten_orient_graph *graph;
  const batten_tree *tree;
  bool adapt;
  size_t first, last;
} plane_task;

static double dot(unsigned n, const double *a, const double *b) {
  double s = 0;
  for (unsigned c = 0; c < n; c++) s += a[c] * b[c];
  return s;
}

static plane fit(const batten_orient_graph *g, size_t i, size_t k, const size_t *index) {
  plane p = {.flatness = 0};
  unsigned n = g->n;
  double second[9] = {0};
  const double *x = g->points, *center = x + i * n; /* differences from it are small */
  for (size_t q = 0; q < k; q++)
    for (unsigned c = 0; c < n; c++) p.mean[c] += (x[index[q] * n + c] - center[c]) / (double)(k + 1);
  for (size_t q = 0; q <= k; q++) {
    size_t j = q < k ? index[q] : i;
    double e[3];
    for (unsigned c = 0; c < n; c++) e[c] = x[j * n + c] - center[c] - p.mean[c];
    for (unsigned r = 0; r < n; r++)
      for (unsigned c = 0; c < n; c++) second[r * n + c] += e[r] * e[c];
  }
  batten_eigen_symmetric(n, second, p.values, p.vectors);
  for (unsigned c = 0; c < n; c++) p.mean[c] += center[c];
  p.flatness = p.values[1] > 0 ? 1 - sqrt(fmax(p.values[0], 0) / p.values[1]) : 0;
  return p;
}

static bool in_two_sheets(const batten_orient_graph *g, const plane *p, size_t k, const size_t *index) {
  double second = 0, fourth = 0;
  for (size_t q = 0; q < k; q++) {
    double e[3];
    for (unsigned c = 0; c < g->n; c++) e[c] = g->points[index[q] * g->n + c] - p->mean[c];
    double off = dot(g->n, e, p->vectors), square = off * off;
    second += square / (double)k;
    fourth += square * square / (double)k;
  }
  return fourth < TWO_SHEETS * second * second;
}

/* Which of the `found` points near i, nearest first, hang on it by steps of at most `step`: those of its own line,
 * where points stand evenly on it. */
static void follow_line(const batten_orient_graph *g, size_t i, size_t found, const size_t *index, double step,
                        bool *on_line) {
  const double *x = g->points;
  size_t reached[WIDE + 1] = {i}, count = 1;
  for (size_t q = 0; q < found; q++) on_line[q] = false;
  for (size_t r = 0; r < count; r++)
    for (size_t q = 0; q < found; q++) {
      double square = 0;
      for (size_t c = 0; c < 3; c++) square += pow(x[index[q] * 3 + c] - x[reached[r] * 3 + c], 2);
      if (on_line[q] || square > step * step) continue;
      on_line[q] = true;
      reached[count++] = index[q];
    }
}

/* Keeps the nearer half of the neighbours; the others become the nearest ones that stand off the line along axis: off
 * the line itself too, which bends away from its axis, where there are enough such. */
static void look_beside(const batten_orient_graph *g, const batten_tree *tree, size_t i, const double *axis) {
  size_t index[WIDE], keep = g->k / 2, found, beside = 0;
  double distance[WIDE];
  bool on_line[WIDE];
  const double *x = g->points;
  found = batten_tree_nearest(tree, x + i * 3, WIDE, i, index, distance);
  follow_line(g, i, found, index, STEP * distance[1], on_line);
  for (size_t q = keep; q < found; q++) beside += !on_line[q];
  bool follow = beside >= g->k - keep;
  for (size_t q = keep; q < found && keep < g->k; q++) {
    double e[3];
    for (int c = 0; c < 3; c++) e[c] = x[index[q] * 3 + (size_t)c] - x[i * 3 + (size_t)c];
    double along = dot(3, e, axis);
    beside -= follow && !on_line[q];
    bool last = follow ? beside < g->k - keep : found - q <= g->k - keep;
    if (follow && on_line[q]) continue;
    /* off by 30 degrees, or no more candidates than places */
    if (along * along > 0.75 * dot(3, e, e) && !last) continue;
    g->index[i * g->k + keep] = index[q];
    g->distance[i * g->k + keep++] = distance[q];
  }
}

/* The best of planes through more neighbours or fewer. Through more: how many, and how far they reach. */
static plane adapt(const batten_orient_graph *g, const batten_tree *tree, size_t i, plane p, size_t *k,
                   double *radius) {
  size_t index[WIDEST], found = 0;
  double distance[WIDEST];
  for (size_t w = 0; g->n == 3 && w < 2 && FEWER[w] < g->k; w++) {
    plane few = fit(g, i, FEWER[w], g->index + i * g->k);
    if (1 - few.flatness < THIN) return few;
  }
  for (size_t w = 0; w < WIDTH_COUNT && 1 - p.flatness > THICK; w++) {
    size_t wanted = WIDTHS[w] <= WIDE ? WIDE : WIDEST;
    if (found < wanted) found = batten_tree_nearest(tree, g->points + i * g->n, wanted, i, index, distance);
    if (found < WIDTHS[w]) break;
    plane wide = fit(g, i, WIDTHS[w], index);
    if (1 - wide.flatness > THINNER * (1 - p.flatness) || in_two_sheets(g, &wide, WIDTHS[w], index)) continue;
    p = wide;
    *k = WIDTHS[w];
    *radius = distance[*k - 1];
  }
  return p;
}

/* Area (length) of the point's share of the disk that holds it and its neighbours. */
static double share(unsigned n, size_t k, double radius) {
  const double pi = 3.141592653589793;
  return (n == 2 ? 2 * radius : pi * radius * radius) / (double)(k + 1);
}

static void fit_planes(void *task, size_t chunk) {
  plane_task *t = task;
  batten_orient_graph *g = t->graph;
  unsigned n = g->n;
  size_t begin = t->first + chunk * CHUNK, end = begin + CHUNK < t->last ? begin + CHUNK : t->last;
  for (size_t i = begin; i < end; i++) {
    const double *x = g->points + i * n;
    size_t *index = g->index + i * g->k, k = g->k;
    batten_tree_nearest(t->tree, x, k, i, index, g->distance + i * k);
    plane p = fit(g, i, k, index);
    bool line = n == 3 && p.values[1] < THREAD * THREAD * p.values[2];
    if (line) {
      look_beside(g, t->tree, i, p.vectors + 6);
      p = fit(g, i, k, index);
    }
    double radius = g->distance[i * k + k - 1], off = 0;
    if (t->adapt && !line && 1 - p.flatness > THICK) p = adapt(g, t->tree, i, p, &k, &radius);
    for (unsigned c = 0; k > g->k && c < n; c++) off += (x[c] - p.mean[c]) * p.vectors[c];
    for (unsigned c = 0; c < n; c++) {
      g->plane[i * n + c] = p.vectors[c];
      g->surface[i * n + c] = x[c] - off * p.vectors[c];
    }
    g->flatness[i] = p.flatness;
    g->area[i] = share(n, k, radius);
  }
}

batten_status batten_orient_fit_planes(batten_context *ctx, const batten_tree *tree, bool adapt, double part,
                                       batten_orient_graph *g) {
  for (size_t first = 0; first < g->count; first += SLICE) {
    size_t last = first + SLICE < g->count ? first + SLICE : g->count;
    batten_status status = batten_progress(ctx, "orient", part + 0.2 * (double)first / (double)g->count);
    if (status < 0) return status;
    batten_parallel(ctx, (last - first + CHUNK - 1) / CHUNK, fit_planes, &(plane_task){g, tree, adapt, first, last});
  }
  return BATTEN_OK;
}
