/* The nearest places of a network to points.
 *
 * Branch and bound. Patches come from a tree of boxes, near ones first; on a patch the squared distance
 * f = |S - q|^2 is a polynomial of degree 2 n, whose least Bernstein coefficient is below it everywhere, by O(h^2) on
 * a part of size h. A part whose bound is not below the best distance so far is done. So is a part on which f is
 * convex: its one minimum is found by Newton's method, inside or on the sides, and what is left to gain is told by
 * the gradient g there: no place y of the part has f(y) < f(x) + min over the corners of g . (corner - x). f is
 * convex where the Bernstein coefficients of its second derivatives, as 2 x 2 matrices, are all positive definite.
 * All other parts are split in four. Patches that are all but equally near along a whole curve (collapsed or bent
 * around the point) would be split without end: after many parts more and more may be missed, and the caller is told
 * how much. */
#include "surface.h"

#include "base/checked.h"
#include "mesh/box_tree.h"

#include <float.h>
#include <string.h>

enum {
  DEPTH = 26, /* parts of 2^-26: what is between them and the surface is below rounding */
  PARTS = 3 * DEPTH + 4,
  /* Parts of a patch before more may be missed: a second. Most take a few, with a circle of nearest places 5e4. */
  PATIENCE = 1 << 17,
  QUERIES = 16, /* of a task */
  BATCH = 16,   /* tasks between two progress calls; each has scratch */
  TREE_STACK = 64
};
/* What the distance may miss, in sizes of the surface: half of what is promised. After each PATIENCE so many times
 * more. */
static const double MISS = 0.5e-12, CONCESSION = 16;

typedef struct part {
  double corner[3][2]; /* in the patch */
  unsigned depth;
} part;

/* Weights between coefficients of products and sums of products, by degree: n! / (a! b! c!). */
typedef struct weights {
  double *of[2 * TRIANGULAR_DEGREE + 1];
} weights;

/* The point of a task whose distance may be off by most, where that is more than was promised: 0 otherwise. */
typedef struct doubt {
  size_t point;
  double miss;
} doubt;

typedef struct job {
  const batten_network *network;
  const box_tree *tree;
  const weights *weights;
  double miss; /* caller's unit */
  size_t count, first_task, size;
  const double *points;
  batten_place *places;
  double *distances;
  double *work;  /* [BATCH][size] */
  part *parts;   /* [BATCH][PARTS] */
  doubt *doubts; /* [BATCH] */
} job;

/* One point's search. */
typedef struct search {
  const job *job;
  const double *point;
  double best, best2; /* distance, and its square */
  double slack;       /* how many times what is promised may be missed: on the patch in hand */
  double miss;        /* of patches with a slack above 1, the most */
  batten_place place;
  uint32_t patch;
  unsigned degree;
  double net[TRIANGULAR_MAX][3]; /* the patch in hand, the point as origin */
  double *nets, *square, *scratch;
  part *parts;
} search;

/* What the distance may miss: rounding of it too. */
static double may_miss(const search *s) { return s->slack * (s->job->miss + 8 * DBL_EPSILON * s->best); }

/* ---- the minimum on a part ---------------------------------------------------------------------- */

typedef struct slope {
  double value, g[2], h[3]; /* |S|^2 / 2 and its derivatives u, v; uu, uv, vv */
} slope;

static slope slope_at(unsigned n, const double (*net)[3], const double x[2]) {
  double s[6][3];
  triangular_jet(n, net, x[0], x[1], 2, s);
  return (slope){0.5 * vec_dot(s[0], s[0]),
                 {vec_dot(s[0], s[1]), vec_dot(s[0], s[2])},
                 {vec_dot(s[1], s[1]) + vec_dot(s[0], s[3]), vec_dot(s[1], s[2]) + vec_dot(s[0], s[4]),
                  vec_dot(s[2], s[2]) + vec_dot(s[0], s[5])}};
}

/* The part of a step (0 .. 1) that stays on the triangle. */
static double stay(const double x[2], const double step[2]) {
  double share = 1, left[3] = {x[0], x[1], 1 - x[0] - x[1]}, falls[3] = {-step[0], -step[1], step[0] + step[1]};
  for (int i = 0; i < 3; i++)
    if (falls[i] > 0 && falls[i] * share > left[i]) share = fmax(0, left[i]) / falls[i];
  return share;
}

static void keep_on_triangle(double x[2]) {
  x[0] = fmin(fmax(x[0], 0), 1);
  x[1] = fmin(fmax(x[1], 0), 1 - x[0]);
}

/* Newton's method from x, steps cut at the sides. True: converged. False: led out, or stuck. */
static bool descend_inside(unsigned n, const double (*net)[3], double x[2]) {
  slope s = slope_at(n, net, x);
  for (int pass = 0; pass < 40; pass++) {
    double det = s.h[0] * s.h[2] - s.h[1] * s.h[1];
    if (!(s.h[0] > 0 && det > 0)) return false;
    double step[2] = {(s.h[1] * s.g[1] - s.h[2] * s.g[0]) / det, (s.h[1] * s.g[0] - s.h[0] * s.g[1]) / det};
    double length = fmax(fabs(step[0]), fabs(step[1])), share = stay(x, step);
    if (length <= 4 * DBL_EPSILON) return true;
    if (!(share > 0)) return false;
    for (int half = 0;; half++, share *= 0.5) {
      double y[2] = {x[0] + share * step[0], x[1] + share * step[1]};
      keep_on_triangle(y);
      slope t = slope_at(n, net, y);
      /* Near the end values are level to rounding, which slopes are not. */
      bool lower = length * share < 1e-6 ? hypot(t.g[0], t.g[1]) < hypot(s.g[0], s.g[1]) : t.value < s.value;
      if (lower) {
        memcpy(x, y, sizeof y);
        s = t;
        break;
      }
      if (length * share < 1e-6) return share == 1 || length < 1e-6;
      if (half == 40) return false;
    }
  }
  return false;
}

/* The minimum on side k: bisection, by Newton's steps while these stay between. */
static void descend_side(unsigned n, const double (*net)[3], unsigned side, double x[2]) {
  static const double run[3][2] = {{1, 0}, {-1, 1}, {0, -1}};
  const double *r = run[side];
  double low = 0, high = 1, t = 0.5, last = 1;
  for (int pass = -2; pass < 60; pass++) {
    double at = pass == -2 ? 0 : pass == -1 ? 1 : t;
    net_side_place(side, at, x);
    slope s = slope_at(n, net, x);
    double g = s.g[0] * r[0] + s.g[1] * r[1];
    double h = s.h[0] * r[0] * r[0] + 2 * s.h[1] * r[0] * r[1] + s.h[2] * r[1] * r[1];
    if ((pass == -2 && g >= 0) || (pass == -1 && g <= 0)) return;
    if (pass < 0) continue;
    if (g > 0) high = t;
    if (g < 0) low = t;
    double next = t - g / h;
    if (!(next > low && next < high) || fabs(next - t) > 0.5 * last) next = 0.5 * (low + high);
    last = fabs(next - t);
    if (g == 0 || last <= DBL_EPSILON) return;
    t = next;
  }
}

static void take(search *s, const part *p, const double x[2]) {
  double place[2], point[1][3];
  for (int d = 0; d < 2; d++)
    place[d] = (1 - x[0] - x[1]) * p->corner[0][d] + x[0] * p->corner[1][d] + x[1] * p->corner[2][d];
  keep_on_triangle(place);
  triangular_jet(s->degree, (const double(*)[3])s->net, place[0], place[1], 0, point);
  double distance = vec_norm(point[0]);
  if (!(distance < s->best)) return;
  s->best = distance;
  s->best2 = distance * distance;
  s->place = (batten_place){s->patch, place[0], place[1]};
}

/* Can f fall by more than may be missed below its value at x, for all that its gradient there says? */
static bool nothing_to_gain(const search *s, const double (*net)[3], const double x[2], double below) {
  slope a = slope_at(s->degree, net, x);
  unsigned n = s->degree;
  double at = a.g[0] * x[0] + a.g[1] * x[1], gain = fmax(at, fmax(at - a.g[0], at - a.g[1]));
  double size2 =
      fmax(pow(vec_distance(net[0], net[n]), 2), pow(vec_distance(net[0], net[triangular_count(n) - 1]), 2));
  /* Places are rounded, which turns a gradient of 0 into 1e-16 size^2; a gain of that kind is its square. */
  double distance = sqrt(2 * a.value);
  return distance <= may_miss(s) || gain + below <= distance * may_miss(s) + 1e-13 * size2;
}

/* f is convex on the part, or so nearly that |S|^2 / 2 is at most `below` under its tangent plane. False when the
 * minimum could not be settled. */
static bool minimise(search *s, const part *p, const double (*net)[3], double below) {
  double x[2] = {1 / 3.0, 1 / 3.0};
  if (descend_inside(s->degree, net, x) && nothing_to_gain(s, net, x, below)) {
    take(s, p, x);
    return true;
  }
  bool settled = false;
  for (unsigned side = 0; side < 3; side++) {
    descend_side(s->degree, net, side, x);
    take(s, p, x);
    settled = settled || nothing_to_gain(s, net, x, below);
  }
  return settled;
}

/* ---- bounds ------------------------------------------------------------------------------------- */

/* The least of what control points reach along the way from the point to the net's middle: below the distance. */
static double reach(unsigned n, const double (*net)[3]) {
  size_t last = triangular_count(n) - 1;
  double way[3], least = INFINITY;
  for (int d = 0; d < 3; d++) way[d] = net[0][d] + net[n][d] + net[last][d];
  if (!vec_normalize(way)) return 0;
  for (size_t i = 0; i <= last; i++) least = fmin(least, vec_dot(net[i], way));
  return least;
}

/* Bernstein coefficients of |S|^2, degree 2 n; returns the least. */
static double square_net(const weights *w, unsigned n, const double (*net)[3], double *out) {
  const double *own = w->of[n], *both = w->of[2 * n];
  size_t count = triangular_count(2 * n);
  memset(out, 0, count * sizeof *out);
  for (unsigned ka = 0, a = 0; ka <= n; ka++)
    for (unsigned ja = 0; ja + ka <= n; ja++, a++) {
      double from[3];
      for (int d = 0; d < 3; d++) from[d] = 2 * own[a] * net[a][d];
      out[triangular_index(2 * n, 2 * ja, 2 * ka)] += 0.5 * own[a] * vec_dot(from, net[a]);
      /* Pairs once: all that follow a. */
      for (unsigned k = ka, b = a + 1; k <= n; k++) {
        double *row = out + triangular_index(2 * n, ja, ka + k);
        for (unsigned j = k == ka ? ja + 1 : 0; j + k <= n; j++, b++) row[j] += own[b] * vec_dot(from, net[b]);
      }
    }
  double least = INFINITY;
  for (size_t i = 0; i < count; i++) {
    out[i] /= both[i];
    least = fmin(least, out[i]);
  }
  return least;
}

/* How far below 0 an eigenvalue of the second derivatives of f comes at most: 0 where f is convex. */
static double concavity(unsigned m, const double *f) {
  double most = 0;
  for (unsigned k = 0; k + 2 <= m; k++)
    for (unsigned j = 0; j + k + 2 <= m; j++) {
      const double *row = f + triangular_index(m, j, k), *next = f + triangular_index(m, j, k + 1),
                   *last = f + triangular_index(m, j, k + 2);
      double uu = (row[2] - row[1]) - (row[1] - row[0]), uv = (next[1] - next[0]) - (row[1] - row[0]),
             vv = (last[0] - next[0]) - (next[0] - row[0]);
      most = fmax(most, hypot(0.5 * (uu - vv), uv) - 0.5 * (uu + vv));
    }
  return m * (m - 1) * most;
}

/* ---- one patch ---------------------------------------------------------------------------------- */

static void split_part(unsigned n, const part *whole, const double (*net)[3], double *nets, part *parts,
                       double *scratch) {
  triangular_split(n, 3, net[0], nets, scratch);
  for (unsigned k = 0; k < 4; k++) {
    parts[k].depth = whole->depth + 1;
    for (int c = 0; c < 3; c++) {
      double x[2];
      triangular_split_place(k, c == 1, c == 2, x);
      for (int d = 0; d < 2; d++)
        parts[k].corner[c][d] =
            (1 - x[0] - x[1]) * whole->corner[0][d] + x[0] * whole->corner[1][d] + x[1] * whole->corner[2][d];
    }
  }
}

/* A few steps of Gauss and Newton from the middle: only for a good distance to start with. */
static void guess(search *s, const part *whole) {
  double x[2] = {1 / 3.0, 1 / 3.0};
  take(s, whole, x);
  for (int pass = 0; pass < 4; pass++) {
    double j[3][3];
    triangular_jet(s->degree, (const double(*)[3])s->net, x[0], x[1], 1, j);
    double e = vec_dot(j[1], j[1]), f = vec_dot(j[1], j[2]), g = vec_dot(j[2], j[2]), det = e * g - f * f;
    double a = vec_dot(j[0], j[1]), b = vec_dot(j[0], j[2]);
    if (!(det > 0)) return;
    x[0] += (f * b - g * a) / det;
    x[1] += (f * a - e * b) / det;
    if (!isfinite(x[0]) || !isfinite(x[1])) return;
    keep_on_triangle(x);
    take(s, whole, x);
  }
}

static void search_patch(search *s, uint32_t patch) {
  static const part whole = {{{0, 0}, {1, 0}, {0, 1}}, 0};
  static const double corners[3][2] = {{0, 0}, {1, 0}, {0, 1}};
  s->patch = patch;
  s->degree = net_surface_degree(s->job->network, patch);
  const double(*from)[3] = (const double(*)[3])net_surface_points(s->job->network, patch);
  unsigned n = s->degree;
  size_t count = triangular_count(n), height = 1;
  for (size_t i = 0; i < count; i++) vec_sub(from[i], s->point, s->net[i]);
  if (reach(n, (const double(*)[3])s->net) >= s->best) return;
  s->slack = 1;
  part *parts = s->parts;
  parts[0] = whole;
  guess(s, &whole);
  memcpy(s->nets, s->net, count * sizeof *s->net);
  for (size_t looked = 1; height > 0; looked++) {
    part p = parts[--height];
    if (looked % PATIENCE == 0) s->slack *= CONCESSION;
    double *top = s->nets + height * 3 * count;
    const double(*net)[3] = (const double(*)[3])top;
    if (reach(n, net) >= s->best) continue;
    double least = square_net(s->job->weights, n, net, s->square);
    for (int c = 0; c < 3; c++) take(s, &p, corners[c]);
    /* (best - miss)^2 and more is of no use. */
    double enough = fmax(0, s->best - may_miss(s));
    if (least >= enough * enough || s->best <= may_miss(s)) continue;
    double below = concavity(2 * n, s->square);
    if (below <= s->best * may_miss(s) && minimise(s, &p, net, 0.5 * below)) continue;
    if (p.depth == DEPTH) continue;
    memcpy(s->scratch, top, 3 * count * sizeof *top);
    split_part(n, &p, (const double(*)[3])s->scratch, top, parts + height, s->scratch + 3 * count);
    height += 4;
  }
  if (s->slack > 1) s->miss = fmax(s->miss, may_miss(s));
}

/* The place is as near as is promised, but may be off along the surface: a last descent. */
static void polish(search *s) {
  s->degree = net_surface_degree(s->job->network, s->place.patch);
  const double(*from)[3] = (const double(*)[3])net_surface_points(s->job->network, s->place.patch);
  for (size_t i = 0; i < triangular_count(s->degree); i++) vec_sub(from[i], s->point, s->net[i]);
  double x[2] = {s->place.u, s->place.v};
  descend_inside(s->degree, (const double(*)[3])s->net, x);
  double distance = sqrt(2 * slope_at(s->degree, (const double(*)[3])s->net, x).value);
  if (!(distance <= s->best * (1 + 4 * DBL_EPSILON))) return;
  s->best = fmin(s->best, distance);
  s->place.u = x[0];
  s->place.v = x[1];
}

/* ---- one point ---------------------------------------------------------------------------------- */

typedef struct branch {
  size_t node, from, to;
  double bound2;
} branch;

static void search_tree(search *s) {
  const box_tree *tree = s->job->tree;
  branch stack[TREE_STACK] = {{0, 0, tree->count, 0}};
  size_t height = 1;
  while (height > 0) {
    branch b = stack[--height];
    if (b.bound2 >= s->best2) continue;
    if (b.to - b.from == 1) {
      search_patch(s, tree->order[b.from]);
      continue;
    }
    size_t mid = (b.from + b.to) / 2;
    branch left = {b.node + 1, b.from, mid, 0}, right = {b.node + 2 * (mid - b.from), mid, b.to, 0};
    left.bound2 = box3_distance2(&tree->boxes[left.node], s->point);
    right.bound2 = box3_distance2(&tree->boxes[right.node], s->point);
    bool first = left.bound2 <= right.bound2;
    stack[height++] = first ? right : left;
    stack[height++] = first ? left : right;
  }
}

/* Scratch of a search: nets of the parts, the square, a copy and the scratch of a split. */
static size_t work_size(unsigned degree) {
  return 3 * triangular_count(degree) * (PARTS + 4) + triangular_count(2 * degree);
}

static void search_some(void *arg, size_t index) {
  const job *j = arg;
  size_t from = (j->first_task + index) * QUERIES;
  search s = {.job = j, .nets = j->work + index * j->size, .parts = j->parts + index * PARTS};
  j->doubts[index] = (doubt){0};
  s.square = s.nets + j->size - triangular_count(2 * TRIANGULAR_DEGREE);
  s.scratch = s.nets + 3 * TRIANGULAR_MAX * (size_t)PARTS;
  for (size_t i = from; i < from + QUERIES && i < j->count; i++) {
    s.point = j->points + 3 * i;
    s.best = s.best2 = INFINITY;
    s.miss = 0;
    search_tree(&s);
    polish(&s);
    j->places[i] = s.place;
    j->distances[i] = s.best;
    if (s.miss > j->doubts[index].miss) j->doubts[index] = (doubt){i, s.miss};
  }
}

/* ---- the public call ---------------------------------------------------------------------------- */

/* In one block, by Pascal's rule: the tables of trinomials for degrees 0 .. 24. */
static double *make_weights(batten_context *ctx, weights *out) {
  size_t total = 0;
  for (unsigned m = 0; m <= 2 * TRIANGULAR_DEGREE; m++) total += triangular_count(m);
  double *block = batten_alloc_array(ctx, total, sizeof *block), *at = block;
  for (unsigned m = 0; block && m <= 2 * TRIANGULAR_DEGREE; at += triangular_count(m), m++) {
    out->of[m] = at;
    for (unsigned k = 0, i = 0; k <= m; k++)
      for (unsigned j = 0; j + k <= m; j++, i++) {
        at[i] = m == 0;
        if (m > 0 && j + k < m) at[i] += out->of[m - 1][triangular_index(m - 1, j, k)];
        if (j > 0) at[i] += out->of[m - 1][triangular_index(m - 1, j - 1, k)];
        if (k > 0) at[i] += out->of[m - 1][triangular_index(m - 1, j, k - 1)];
      }
  }
  return block;
}

static batten_status make_tree(batten_context *ctx, const batten_network *network, box_tree *out) {
  box3 *leaves = batten_alloc_array(ctx, network->patch_count, sizeof *leaves);
  if (!leaves) return BATTEN_E_NOMEM;
  for (size_t p = 0; p < network->patch_count; p++)
    leaves[p] = box3_of_points(triangular_count(net_surface_degree(network, p)),
                               (const double(*)[3])net_surface_points(network, p));
  batten_status st = box_tree_make(ctx, network->patch_count, leaves, out);
  batten_free(ctx, leaves);
  return st;
}

static batten_status search_all(batten_context *ctx, job *j) {
  size_t tasks = j->count / QUERIES + (j->count % QUERIES > 0);
  doubt doubts[BATCH], worst = {0};
  j->doubts = doubts;
  for (size_t done = 0; done < tasks; done += BATCH) {
    batten_status st = batten_progress(ctx, "closest", (double)done / (double)tasks);
    if (st < 0) return st;
    size_t now = tasks - done < BATCH ? tasks - done : BATCH;
    j->first_task = done;
    batten_parallel(ctx, now, search_some, j);
    for (size_t i = 0; i < now; i++)
      if (doubts[i].miss > worst.miss) worst = doubts[i];
  }
  batten_status st = batten_progress(ctx, "closest", 1);
  if (st < 0 || !(worst.miss > 0)) return st;
  return batten_fail(
      ctx, BATTEN_W_ACCURACY,
      "points[%zu]: the distance may be too large by %.2g: a patch is all but equally near in too many "
      "places; it is degenerate, or move the point",
      worst.point, worst.miss);
}

static batten_status check(batten_context *ctx, const batten_network *network, size_t count, const double *points,
                           const batten_place *places) {
  if (!network) return batten_fail(ctx, BATTEN_E_INVALID, "network: NULL; give a network");
  if (count && (!points || !places))
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give %zu points and room for as many places",
                       points ? "places" : "points", count);
  if (count > SIZE_MAX / (3 * sizeof *points))
    return batten_fail(ctx, BATTEN_E_INVALID, "count: %zu; no array has so many points", count);
  if (count && network->patch_count == 0)
    return batten_fail(ctx, BATTEN_E_INVALID, "network: no patches; nothing is near");
  size_t bad = batten_first_nonfinite(3 * count, points);
  if (bad < 3 * count)
    return batten_fail(ctx, BATTEN_E_INVALID, "points[%zu][%zu]: %g; give finite coordinates", bad / 3, bad % 3,
                       points[bad]);
  return BATTEN_OK;
}

batten_status batten_network_closest(batten_context *ctx, const batten_network *network, size_t count,
                                     const double *points, batten_place *places, double *distances) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_status st = check(ctx, network, count, points, places);
  if (st < 0 || count == 0) return st;
  box_tree tree = {0};
  weights w = {{NULL}};
  job j = {.network = network,
           .tree = &tree,
           .weights = &w,
           .count = count,
           .points = points,
           .size = work_size(TRIANGULAR_DEGREE)};
  st = BATTEN_E_NOMEM;
  double *block = make_weights(ctx, &w);
  /* Results go to the caller when all are there. */
  j.places = batten_alloc_array(ctx, count, sizeof *j.places);
  j.distances = batten_alloc_array(ctx, count, sizeof *j.distances);
  j.work = batten_alloc_array(ctx, BATCH, j.size * sizeof *j.work);
  j.parts = batten_alloc_array(ctx, BATCH, PARTS * sizeof *j.parts);
  if (!block || !j.places || !j.distances || !j.work || !j.parts) goto done;
  st = make_tree(ctx, network, &tree);
  if (st < 0) goto done;
  j.miss = MISS * vec_distance(tree.boxes[0].lower, tree.boxes[0].upper);
  st = search_all(ctx, &j);
  if (st < 0) goto done;
  memcpy(places, j.places, count * sizeof *places);
  if (distances) memcpy(distances, j.distances, count * sizeof *distances);
done:
  box_tree_free(ctx, &tree);
  batten_free(ctx, j.parts);
  batten_free(ctx, j.work);
  batten_free(ctx, j.distances);
  batten_free(ctx, j.places);
  batten_free(ctx, block);
  return st;
}
