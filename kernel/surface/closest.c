/* The nearest places of a surface to points.
 *
 * Branch and bound. Span pairs come from a tree of boxes, near ones first; on a pair the squared distance f = |S -
 * q|^2 is a polynomial of twice the degrees, whose least Bernstein coefficient is below it everywhere, by O(h^2) on a
 * part of size h. A part whose bound is not below the best distance so far is done. So is a part on which f is
 * convex: its one minimum is found by Newton's method, inside or on the sides, and what is left to gain is told by
 * the gradient g there: no place y of the part has f(y) < f(x) + min over the corners of g . (corner - x). f is
 * convex where the bounds a <= f_uu, c <= f_vv, |f_uv| <= b from the Bernstein coefficients have a, c > 0 and a c >=
 * b^2. All other parts are halved across their longer side. Pairs that are all but equally near along a whole curve
 * (a side drawn together, or bent around the point) would be halved without end: after many parts more and more may
 * be missed, and the caller is told how much.
 *
 * A search is in a unit in which the point is about 1 from the surface, or the surface is 1 large, and has the point
 * as its origin: no square overflows. */
#include "surface_inner.h"

#include "base/checked.h"
#include "mesh/box_tree.h"
#include "mesh/vec.h"

#include <float.h>
#include <string.h>

enum {
  DEPTH = 54, /* halvings: what is between such parts and the surface is below rounding */
  PARTS = DEPTH + 2,
  PATIENCE = 1 << 18, /* parts of a span pair before more may be missed: about half a second */
  NET = BSPLINE_ORDER * BSPLINE_ORDER,
  SQUARE = 2 * BSPLINE_DEGREE + 1, /* coefficients of f in one direction */
  QUERIES = 16,                    /* of a task */
  BATCH = 16,                      /* tasks between two progress calls; each has scratch */
  TREE_STACK = 64
};
/* What the distance may miss, in sizes of the surface: half of what is promised. After each PATIENCE so many times
 * more. */
static const double MISS = 0.5e-12, CONCESSION = 16;

/* Of a span pair, in parts of its spans. */
typedef struct part {
  double lower[2], width[2];
  unsigned depth;
} part;

/* The point of a task whose distance may be off by most, where that is more than was promised: 0 otherwise. */
typedef struct doubt {
  size_t point;
  double miss;
} doubt;

typedef struct job {
  const batten_surface *surface;
  surface_axis axis[2];
  bspline unit[2];  /* Bernstein polynomials of the degrees */
  double middle[3]; /* of the surface; boxes are around it, times 2^surface->exponent */
  double size;      /* of all boxes together, in that unit */
  box_tree tree;
  double own[NET];              /* products of binomials: weights of the net's points in f */
  double both[SQUARE * SQUARE]; /* their inverses in f */
  size_t count, first_task, size_of_work;
  const double *points;
  double *places, *distances;
  double *work;  /* [BATCH][size_of_work] */
  part *parts;   /* [BATCH][PARTS] */
  doubt *doubts; /* [BATCH] */
} job;

/* One point's search. */
typedef struct search {
  const job *job;
  unsigned p, q;
  const double *point;
  double middle[3]; /* of the surface from the point, in the search's unit */
  int exponent;     /* of that unit */
  double scale;     /* 2^(exponent - surface->exponent) */
  double best;      /* distance */
  double slack;     /* how many times what is promised may be missed: on the pair in hand */
  double miss;      /* of pairs with a slack above 1, the most */
  size_t pair[2], near_pair[2];
  double near[2];   /* the best place, in parts of the spans of near_pair */
  double (*net)[3]; /* the pair in hand, the point as origin */
  double *nets;     /* of its parts: [PARTS][(p + 1)(q + 1)][3] */
  double *square;   /* [SQUARE * SQUARE] */
  part *parts;
} search;

/* What the distance may miss: rounding of it too. */
static double may_miss(const search *s) {
  return s->slack * (MISS * s->job->size * s->scale + 8 * DBL_EPSILON * s->best);
}

/* ---- the minimum on a part ---------------------------------------------------------------------- */

typedef struct slope {
  double value, g[2], h[3]; /* |S|^2 / 2 and its derivatives u, v; uu, uv, vv */
} slope;

static void jet_at(const search *s, const double (*net)[3], const double x[2], double (*jet)[3]) {
  surface_basis u, v;
  surface_basis_make(&s->job->unit[0], s->p, x[0], &u);
  surface_basis_make(&s->job->unit[1], s->q, x[1], &v);
  surface_net_jet(s->p, s->q, 3 * ((size_t)s->q + 1), net[0], 1, &u, &v, jet);
}

static slope slope_at(const search *s, const double (*net)[3], const double x[2]) {
  double j[6][3];
  jet_at(s, net, x, j);
  return (slope){0.5 * vec_dot(j[0], j[0]),
                 {vec_dot(j[0], j[1]), vec_dot(j[0], j[2])},
                 {vec_dot(j[1], j[1]) + vec_dot(j[0], j[3]), vec_dot(j[1], j[2]) + vec_dot(j[0], j[4]),
                  vec_dot(j[2], j[2]) + vec_dot(j[0], j[5])}};
}

/* The part of a step (0 .. 1) that stays on the square. */
static double stay(const double x[2], const double step[2]) {
  double share = 1;
  for (int k = 0; k < 2; k++) {
    double left = step[k] > 0 ? 1 - x[k] : x[k], falls = fabs(step[k]);
    if (falls * share > left) share = left / falls;
  }
  return share;
}

static double clamp(double x) { return fmin(fmax(x, 0), 1); }

/* Newton's step from x with slopes a; what would lead out of a side at once stays there, and its slope no longer
 * counts: `free` tells. False where f is not convex in what is free. */
static bool step_from(const slope *a, const double x[2], bool free[2], double step[2]) {
  for (int k = 0; k < 2; k++) free[k] = !((x[k] <= 0 && a->g[k] > 0) || (x[k] >= 1 && a->g[k] < 0));
  step[0] = step[1] = 0;
  if (free[0] && free[1]) {
    double det = a->h[0] * a->h[2] - a->h[1] * a->h[1];
    if (!(a->h[0] > 0 && det > 0)) return false;
    step[0] = (a->h[1] * a->g[1] - a->h[2] * a->g[0]) / det;
    step[1] = (a->h[1] * a->g[0] - a->h[0] * a->g[1]) / det;
    for (int k = 0; k < 2; k++) free[k] = !((x[k] <= 0 && step[k] < 0) || (x[k] >= 1 && step[k] > 0));
    if (free[0] && free[1]) return true;
    step[0] = step[1] = 0;
  }
  for (int k = 0; k < 2; k++) {
    double h = a->h[k == 0 ? 0 : 2];
    if (!free[k]) continue;
    if (!(h > 0)) return false;
    step[k] = -a->g[k] / h;
    if ((x[k] <= 0 && step[k] < 0) || (x[k] >= 1 && step[k] > 0)) {
      free[k] = false;
      step[k] = 0;
    }
  }
  return true;
}

static double free_slope(const slope *a, const bool free[2]) {
  return hypot(free[0] ? a->g[0] : 0, free[1] ? a->g[1] : 0);
}

/* Newton's method on the square, from x. True: converged, maybe on a side. False: f is not convex there, or stuck. */
static bool descend(const search *s, const double (*net)[3], double x[2]) {
  slope a = slope_at(s, net, x);
  for (int pass = 0; pass < 40; pass++) {
    double step[2];
    bool free[2];
    if (!step_from(&a, x, free, step)) return false;
    double length = fmax(fabs(step[0]), fabs(step[1])), share = stay(x, step);
    if (length <= 4 * DBL_EPSILON) return true;
    for (int half = 0;; half++, share *= 0.5) {
      double y[2] = {clamp(x[0] + share * step[0]), clamp(x[1] + share * step[1])};
      slope t = slope_at(s, net, y);
      /* Near the end values are level to rounding, which slopes are not. */
      bool lower = length * share < 1e-6 ? free_slope(&t, free) < free_slope(&a, free) : t.value < a.value;
      if (lower) {
        memcpy(x, y, sizeof y);
        a = t;
        break;
      }
      if (length * share < 1e-6) return share == 1 || length < 1e-6;
      if (half == 40) return false;
    }
  }
  return false;
}

/* The minimum on the side x_k = end: bisection, by Newton's steps while these stay between. */
static void descend_side(const search *s, const double (*net)[3], int k, double end, double x[2]) {
  double low = 0, high = 1, t = 0.5, last = 1;
  for (int pass = -2; pass < 60; pass++) {
    x[k] = end;
    x[1 - k] = pass == -2 ? 0 : pass == -1 ? 1 : t;
    slope a = slope_at(s, net, x);
    double g = a.g[1 - k], h = a.h[k == 0 ? 2 : 0];
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
  double place[2], jet[6][3];
  for (int k = 0; k < 2; k++) place[k] = clamp(p->lower[k] + p->width[k] * x[k]);
  jet_at(s, (const double(*)[3])s->net, place, jet);
  double distance = vec_norm(jet[0]);
  if (!(distance < s->best)) return;
  s->best = distance;
  memcpy(s->near, place, sizeof place);
  memcpy(s->near_pair, s->pair, sizeof s->pair);
}

/* Can f fall by more than may be missed below its value at x, for all that its gradient there says? */
static bool nothing_to_gain(const search *s, const double (*net)[3], const double x[2], double below) {
  slope a = slope_at(s, net, x);
  double gain = 0;
  for (int k = 0; k < 2; k++) gain += fmax(a.g[k] * x[k], a.g[k] * (x[k] - 1));
  size_t last = s->p * ((size_t)s->q + 1);
  double size = fmax(vec_distance(net[0], net[s->q]), vec_distance(net[0], net[last]));
  /* Places are rounded, which turns a gradient of 0 into 1e-16 size^2; a gain of that kind is its square. */
  double distance = sqrt(2 * a.value);
  return distance <= may_miss(s) || gain + below <= distance * may_miss(s) + 1e-13 * size * size;
}

/* f is convex on the part, or so nearly that |S|^2 / 2 is at most `below` under its tangent plane. False when the
 * minimum could not be settled. */
static bool minimise(search *s, const part *p, const double (*net)[3], double below) {
  double x[2] = {0.5, 0.5};
  if (descend(s, net, x) && nothing_to_gain(s, net, x, below)) {
    take(s, p, x);
    return true;
  }
  bool settled = false;
  for (int side = 0; side < 4 && !settled; side++) {
    descend_side(s, net, side >> 1, side & 1, x);
    take(s, p, x);
    settled = nothing_to_gain(s, net, x, below);
  }
  return settled;
}

/* ---- bounds ------------------------------------------------------------------------------------- */

/* The least of what control points reach along the way from the point to the net's middle: below the distance. */
static double reach(const search *s, const double (*net)[3]) {
  size_t row = (size_t)s->q + 1, count = (s->p + 1) * row;
  double way[3], least = INFINITY;
  for (int d = 0; d < 3; d++) way[d] = net[0][d] + net[s->q][d] + net[count - row][d] + net[count - 1][d];
  if (!vec_normalize(way)) return 0;
  for (size_t i = 0; i < count; i++) least = fmin(least, vec_dot(net[i], way));
  return least;
}

/* Bernstein coefficients of |S|^2 [2 p + 1][2 q + 1]; returns the least. */
static double square_net(const search *s, const double (*net)[3], double *out) {
  size_t rows = (size_t)s->p + 1, columns = (size_t)s->q + 1, wide = 2 * columns - 1, count = (2 * rows - 1) * wide;
  const double *own = s->job->own;
  double weighted[NET][3], least = INFINITY;
  for (size_t i = 0; i < rows * columns; i++)
    for (int d = 0; d < 3; d++) weighted[i][d] = own[i] * net[i][d];
  memset(out, 0, count * sizeof *out);
  for (size_t a = 0; a < rows; a++)
    for (size_t b = 0; b < columns; b++) {
      const double *from = weighted[a * columns + b];
      out[2 * a * wide + 2 * b] += vec_dot(from, from);
      const double twice[3] = {2 * from[0], 2 * from[1], 2 * from[2]};
      /* Pairs once: all that follow. */
      for (size_t c = a; c < rows; c++) {
        double *row = out + (a + c) * wide + b;
        for (size_t e = c == a ? b + 1 : 0; e < columns; e++) row[e] += vec_dot(twice, weighted[c * columns + e]);
      }
    }
  for (size_t i = 0; i < count; i++) {
    out[i] *= s->job->both[i];
    least = fmin(least, out[i]);
  }
  return least;
}

/* How far below 0 an eigenvalue of the second derivatives of f comes at most: 0 where f is convex. */
static double concavity(const search *s, const double *f) {
  size_t m = 2 * s->p, n = 2 * s->q, wide = n + 1;
  double uu = INFINITY, vv = INFINITY, uv = 0;
  for (size_t i = 0; i <= m; i++)
    for (size_t j = 0; j <= n; j++) {
      const double *b = f + i * wide + j;
      if (i + 2 <= m) uu = fmin(uu, (b[2 * wide] - b[wide]) - (b[wide] - b[0]));
      if (j + 2 <= n) vv = fmin(vv, (b[2] - b[1]) - (b[1] - b[0]));
      if (i < m && j < n) uv = fmax(uv, fabs((b[wide + 1] - b[wide]) - (b[1] - b[0])));
    }
  uu *= (double)(m * (m - 1));
  vv *= (double)(n * (n - 1));
  uv *= (double)(m * n);
  if (uu >= 0 && vv >= 0 && uu * vv >= uv * uv) return 0;
  /* No matrix within the bounds has an eigenvalue below that of the bounds. */
  return fmax(0, hypot(0.5 * (uu - vv), uv) - 0.5 * (uu + vv));
}

/* ---- one span pair ------------------------------------------------------------------------------- */

/* A few steps of Gauss and Newton from the middle: only for a good distance to start with. */
static void guess(search *s, const part *whole) {
  double x[2] = {0.5, 0.5};
  take(s, whole, x);
  for (int pass = 0; pass < 4; pass++) {
    double j[6][3];
    jet_at(s, (const double(*)[3])s->net, x, j);
    double e = vec_dot(j[1], j[1]), f = vec_dot(j[1], j[2]), g = vec_dot(j[2], j[2]), det = e * g - f * f;
    double a = vec_dot(j[0], j[1]), b = vec_dot(j[0], j[2]);
    if (!(det > 0)) return;
    x[0] = clamp(x[0] + (f * b - g * a) / det);
    x[1] = clamp(x[1] + (f * a - e * b) / det);
    if (!isfinite(x[0]) || !isfinite(x[1])) return;
    take(s, whole, x);
  }
}

static void take_corners(search *s, const part *p, const double (*net)[3]) {
  size_t last = s->p * ((size_t)s->q + 1);
  const size_t at[4] = {0, s->q, last, last + s->q};
  for (int c = 0; c < 4; c++)
    if (vec_norm(net[at[c]]) < s->best) take(s, p, (const double[2]){c >> 1, c & 1});
}

static void halve(const search *s, part *parts, double *net) {
  bool by_u = surface_net_longer_in_u(s->p, s->q, 3, net);
  int k = by_u ? 0 : 1;
  surface_net_halve(s->p, s->q, 3, by_u, net, net + 3 * (s->p + 1) * ((size_t)s->q + 1));
  parts->depth++;
  parts->width[k] *= 0.5;
  parts[1] = parts[0];
  parts[1].lower[k] += parts[0].width[k];
}

static void search_pair(search *s, size_t pair) {
  static const part whole = {{0, 0}, {1, 1}, 0};
  const surface_axis *axis = s->job->axis;
  size_t size = 3 * (s->p + 1) * ((size_t)s->q + 1), height = 1;
  s->pair[0] = pair / axis[1].count;
  s->pair[1] = pair % axis[1].count;
  surface_patch_net(s->job->surface, axis, s->pair[0], s->pair[1], s->point, s->exponent, s->net);
  if (reach(s, (const double(*)[3])s->net) >= s->best) return;
  s->slack = 1;
  s->parts[0] = whole;
  guess(s, &whole);
  memcpy(s->nets, s->net, size * sizeof *s->nets);
  for (size_t looked = 1; height > 0; looked++) {
    part *p = &s->parts[--height];
    double *top = s->nets + height * size;
    const double(*net)[3] = (const double(*)[3])top;
    if (looked % PATIENCE == 0) s->slack *= CONCESSION;
    if (reach(s, net) >= s->best) continue;
    take_corners(s, p, net);
    double least = square_net(s, net, s->square);
    /* (best - miss)^2 and more is of no use. */
    double enough = fmax(0, s->best - may_miss(s));
    if (least >= enough * enough || s->best <= may_miss(s)) continue;
    double below = concavity(s, s->square);
    if (below <= s->best * may_miss(s) && minimise(s, p, net, 0.5 * below)) continue;
    if (p->depth == DEPTH) continue;
    halve(s, p, top);
    height += 2;
  }
  if (s->slack > 1) s->miss = fmax(s->miss, may_miss(s));
}

/* The place is as near as is promised, but may be off along the surface: a last descent. */
static void polish(search *s) {
  surface_patch_net(s->job->surface, s->job->axis, s->near_pair[0], s->near_pair[1], s->point, s->exponent, s->net);
  double x[2] = {s->near[0], s->near[1]};
  descend(s, (const double(*)[3])s->net, x);
  double distance = sqrt(2 * slope_at(s, (const double(*)[3])s->net, x).value);
  if (!(distance <= s->best + 4 * DBL_EPSILON * (s->best + s->job->size * s->scale))) return;
  s->best = fmin(s->best, distance);
  memcpy(s->near, x, sizeof x);
}

/* ---- one point ---------------------------------------------------------------------------------- */

typedef struct branch {
  size_t node, from, to;
  double bound;
} branch;

/* Distance of the point from a box, in the search's unit. */
static double box_distance(const search *s, const box3 *box) {
  double out[3];
  for (int d = 0; d < 3; d++) {
    double lower = s->middle[d] + s->scale * box->lower[d], upper = s->middle[d] + s->scale * box->upper[d];
    out[d] = fmax(0, fmax(lower, -upper));
  }
  return vec_norm(out);
}

static void search_tree(search *s) {
  const box_tree *tree = &s->job->tree;
  branch stack[TREE_STACK] = {{0, 0, tree->count, 0}};
  size_t height = 1;
  while (height > 0) {
    branch b = stack[--height];
    if (b.bound >= s->best) continue;
    if (b.to - b.from == 1) {
      search_pair(s, tree->order[b.from]);
      continue;
    }
    size_t mid = (b.from + b.to) / 2;
    branch left = {b.node + 1, b.from, mid, 0}, right = {b.node + 2 * (mid - b.from), mid, b.to, 0};
    left.bound = box_distance(s, &tree->boxes[left.node]);
    right.bound = box_distance(s, &tree->boxes[right.node]);
    bool first = left.bound <= right.bound;
    stack[height++] = first ? right : left;
    stack[height++] = first ? left : right;
  }
}

static void begin(search *s, const double *point) {
  const job *j = s->job;
  double away = 0;
  s->point = point;
  for (int d = 0; d < 3; d++) away = fmax(away, fabs(j->middle[d] - point[d]));
  int own = j->surface->exponent, far = away > 0 ? -ilogb(away) : own;
  s->exponent = far < own ? far : own;
  if (s->exponent < -1022) s->exponent = -1022;
  s->scale = ldexp(1, s->exponent - own);
  double unit = ldexp(1, s->exponent);
  for (int d = 0; d < 3; d++) s->middle[d] = (j->middle[d] - point[d]) * unit;
  s->best = INFINITY;
  s->miss = 0;
}

static void search_some(void *arg, size_t index) {
  const job *j = arg;
  size_t from = (j->first_task + index) * QUERIES;
  search s = {.job = j, .p = j->axis[0].degree, .q = j->axis[1].degree, .parts = j->parts + index * PARTS};
  double *work = j->work + index * j->size_of_work;
  s.square = work;
  s.net = (double(*)[3])(work + SQUARE * SQUARE);
  s.nets = work + SQUARE * SQUARE + 3 * NET;
  j->doubts[index] = (doubt){0};
  for (size_t i = from; i < from + QUERIES && i < j->count; i++) {
    begin(&s, j->points + 3 * i);
    search_tree(&s);
    polish(&s);
    for (int k = 0; k < 2; k++)
      j->places[2 * i + (size_t)k] =
          surface_span_at(&j->surface->space[k], j->axis[k].span[s.near_pair[k]], s.near[k]);
    j->distances[i] = ldexp(s.best, -s.exponent);
    double miss = ldexp(s.miss, -s.exponent);
    if (miss > j->doubts[index].miss) j->doubts[index] = (doubt){i, miss};
  }
}

/* ---- the public call ---------------------------------------------------------------------------- */

static void make_binomials(unsigned n, double *out) {
  out[0] = 1;
  for (unsigned k = 1; k <= n; k++) out[k] = out[k - 1] * (n - k + 1) / k;
}

static void make_weights(job *j) {
  unsigned p = j->axis[0].degree, q = j->axis[1].degree;
  double a[SQUARE], b[SQUARE];
  make_binomials(p, a);
  make_binomials(q, b);
  for (size_t i = 0; i <= p; i++)
    for (size_t k = 0; k <= q; k++) j->own[i * (q + 1) + k] = a[i] * b[k];
  make_binomials(2 * p, a);
  make_binomials(2 * q, b);
  for (size_t i = 0; i <= 2 * p; i++)
    for (size_t k = 0; k <= 2 * q; k++) j->both[i * (2 * q + 1) + k] = 1 / (a[i] * b[k]);
}

static batten_status make_tree(batten_context *ctx, job *j) {
  const batten_surface *s = j->surface;
  size_t pairs = j->axis[0].count * j->axis[1].count;
  if (pairs > UINT32_MAX) return batten_fail(ctx, BATTEN_E_TOO_LARGE, "surface: %zu span pairs are too many", pairs);
  box3 *leaves = batten_alloc_array(ctx, pairs, sizeof *leaves);
  if (!leaves) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < pairs; i++) {
    double net[NET][3];
    surface_patch_net(s, j->axis, i / j->axis[1].count, i % j->axis[1].count, j->middle, s->exponent, net);
    leaves[i] = box3_of_points((j->axis[0].degree + 1) * (j->axis[1].degree + 1), (const double(*)[3])net);
  }
  batten_status st = box_tree_make(ctx, pairs, leaves, &j->tree);
  batten_free(ctx, leaves);
  if (st >= 0) j->size = vec_distance(j->tree.boxes[0].lower, j->tree.boxes[0].upper);
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
  return batten_fail(ctx, BATTEN_W_ACCURACY,
                     "points[%zu]: the distance may be too large by %.2g: the surface is all but equally near in too "
                     "many places; it "
                     "is degenerate, or move the point",
                     worst.point, worst.miss);
}

static batten_status check(batten_context *ctx, const batten_surface *surface, size_t count, const double *points,
                           const double *places) {
  if (!surface) return batten_fail(ctx, BATTEN_E_INVALID, "surface: NULL; give a surface");
  if (count && (!points || !places))
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give %zu points and room for as many places",
                       points ? "places" : "points", count);
  if (count > SIZE_MAX / (3 * sizeof *points))
    return batten_fail(ctx, BATTEN_E_INVALID, "count: %zu; no array has so many points", count);
  size_t bad = batten_first_nonfinite(3 * count, points);
  if (bad < 3 * count)
    return batten_fail(ctx, BATTEN_E_INVALID, "points[%zu][%zu]: %g; give finite coordinates", bad / 3, bad % 3,
                       points[bad]);
  return BATTEN_OK;
}

/* The box of the control points, from which no point may be further than a double can say. */
static batten_status check_far(batten_context *ctx, job *j) {
  const batten_surface *s = j->surface;
  box3 box = box3_of_points(s->space[0].count * s->space[1].count, (const double(*)[3])s->control_points);
  for (int d = 0; d < 3; d++) j->middle[d] = 0.5 * box.lower[d] + 0.5 * box.upper[d];
  for (size_t i = 0; i < 3 * j->count; i++)
    if (!isfinite(j->points[i] - box.lower[i % 3]) || !isfinite(j->points[i] - box.upper[i % 3]))
      return batten_fail(ctx, BATTEN_E_INVALID, "points[%zu][%zu]: %g; its distance is beyond a double", i / 3, i % 3,
                         j->points[i]);
  return BATTEN_OK;
}

static batten_status plan(batten_context *ctx, job *j) {
  static const double knots[2 * BSPLINE_ORDER] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
  batten_status st = check_far(ctx, j);
  for (int k = 0; k < 2 && st >= 0; k++) {
    unsigned d = j->surface->space[k].degree;
    st = surface_axis_make(ctx, &j->surface->space[k], &j->axis[k]);
    j->unit[k] = (bspline){d, d + 1, knots + BSPLINE_DEGREE - d};
  }
  if (st < 0) return st;
  make_weights(j);
  st = make_tree(ctx, j);
  if (st < 0) return st;
  size_t net = 3 * ((size_t)j->axis[0].degree + 1) * (j->axis[1].degree + 1);
  j->size_of_work = SQUARE * SQUARE + 3 * NET + PARTS * net;
  /* Results go to the caller when all are there. */
  j->places = batten_alloc_array(ctx, j->count, 2 * sizeof *j->places);
  j->distances = batten_alloc_array(ctx, j->count, sizeof *j->distances);
  j->work = batten_alloc_array(ctx, BATCH, j->size_of_work * sizeof *j->work);
  j->parts = batten_alloc_array(ctx, BATCH, PARTS * sizeof *j->parts);
  return j->places && j->distances && j->work && j->parts ? BATTEN_OK : BATTEN_E_NOMEM;
}

batten_status batten_surface_closest(batten_context *ctx, const batten_surface *surface, size_t count,
                                     const double *points, double *places, double *distances) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_status st = check(ctx, surface, count, points, places);
  if (st < 0 || count == 0) return st;
  job *j = batten_alloc(ctx, sizeof *j);
  if (!j) return BATTEN_E_NOMEM;
  *j = (job){.surface = surface, .count = count, .points = points};
  st = plan(ctx, j);
  if (st >= 0) st = search_all(ctx, j);
  if (st >= 0) {
    memcpy(places, j->places, count * 2 * sizeof *places);
    if (distances) memcpy(distances, j->distances, count * sizeof *distances);
  }
  batten_free(ctx, j->parts);
  batten_free(ctx, j->work);
  batten_free(ctx, j->distances);
  batten_free(ctx, j->places);
  box_tree_free(ctx, &j->tree);
  for (int k = 0; k < 2; k++) surface_axis_free(ctx, &j->axis[k]);
  batten_free(ctx, j);
  return st;
}
