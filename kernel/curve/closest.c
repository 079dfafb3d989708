/* The nearest parameters of a curve to points.
 *
 * Branch and bound. Spans come from a tree of boxes, near ones first; on a span, made a Bezier curve around the
 * point, the squared distance f is a polynomial of twice the degree, whose least Bernstein coefficient is below it
 * everywhere, by O(h^2) on a part of length h. A part whose bound is not below the best distance so far is done. So
 * is a part on which f is convex, as second differences of the coefficients tell: its one minimum is found by
 * Newton's method. All other parts are halved. What lies before the best place so far is looked at until it is
 * certainly farther, so that of equally near places the first is found; what lies behind it may be left where next to
 * nothing is to be gained. A point begins with the place of the one before it: that is near where points follow each
 * other.
 *
 * A search is in a unit in which the point is about 1 from the curve, or the curve is 1 large, and has the point as
 * its origin: no square overflows. */
#include "curve_inner.h"

#include "base/checked.h"
#include "mesh/box_tree.h"

#include <float.h>
#include <string.h>

enum {
  DEPTH = 54, /* halvings: what is between such parts and the curve is below rounding */
  PARTS = DEPTH + 2,
  ORDER = BSPLINE_ORDER,
  SQUARE = 2 * BSPLINE_DEGREE + 1, /* coefficients of f */
  QUERIES = 64,                    /* of a task */
  BATCH = 64,                      /* tasks between two progress calls */
  TREE_STACK = 64
};
/* What the distance may miss, in sizes of the curve: half of what is promised. */
static const double MISS = 0.5e-12;

/* Of a span, with its Bezier points around the point that is searched for. */
typedef struct part {
  double net[ORDER][2];
  double lower, width; /* in parts of the span */
  unsigned depth;
} part;

typedef struct job {
  const batten_curve *curve;
  unsigned degree;
  size_t spans;
  size_t *span;           /* [spans] mu */
  double (*bezier)[2];    /* [spans][degree + 1] around the middle, times 2^curve->exponent */
  double middle[2], size; /* size: of the boxes together, in that unit */
  box_tree tree;
  double own[ORDER], both[SQUARE]; /* binomials; inverse ones of twice the degree */
  size_t count, first_task;
  const double *points;
  double *parameters, *distances;
  part *parts; /* [BATCH][PARTS] */
} job;

typedef struct place {
  size_t span;
  double s;
} place;

/* One point's search. */
typedef struct search {
  const job *job;
  double middle[2]; /* of the curve from the point, in the search's unit */
  int exponent;     /* of that unit */
  double scale;     /* 2^(exponent - curve->exponent) */
  double miss, tie; /* what the distance may miss; what counts as equal */
  double best;
  place near;
  part *parts;
} search;

static double dot(const double a[2], const double b[2]) { return a[0] * b[0] + a[1] * b[1]; }
static double norm(const double a[2]) { return sqrt(dot(a, a)); }

static bool before(const place *a, const place *b) {
  return a->span < b->span || (a->span == b->span && a->s < b->s);
}

static void take(search *s, size_t span, double at, double distance) {
  place p = {span, at};
  if (!(distance < s->best) && !(distance <= s->best + s->tie && before(&p, &s->near))) return;
  s->best = fmin(s->best, distance);
  s->near = p;
}

/* ---- parts ---------------------------------------------------------------------------------------- */

static void span_net(const search *s, size_t span, double (*net)[2]) {
  const double(*from)[2] = (const double(*)[2])(s->job->bezier + span * (s->job->degree + 1));
  for (unsigned i = 0; i <= s->job->degree; i++)
    for (int k = 0; k < 2; k++) net[i][k] = s->middle[k] + s->scale * from[i][k];
}

/* x, x', x'' at s by de Casteljau's algorithm. */
static void jet_at(unsigned d, const double (*net)[2], double s, double jet[3][2]) {
  double w[ORDER][2];
  memcpy(w, net, (d + 1) * sizeof *w);
  for (int k = 0; k < 2; k++) jet[2][k] = 0;
  for (unsigned left = d; left > 0; left--) {
    for (int k = 0; k < 2 && left == 2; k++)
      jet[2][k] = (double)d * (d - 1) * ((w[2][k] - w[1][k]) - (w[1][k] - w[0][k]));
    for (int k = 0; k < 2 && left == 1; k++) jet[1][k] = d * (w[1][k] - w[0][k]);
    for (unsigned i = 0; i < left; i++)
      for (int k = 0; k < 2; k++) w[i][k] = (1 - s) * w[i][k] + s * w[i + 1][k];
  }
  for (int k = 0; k < 2; k++) jet[0][k] = w[0][k];
}

static void halve(unsigned d, part *left, part *right) {
  left->width *= 0.5;
  left->depth++;
  right->depth = left->depth;
  right->width = left->width;
  right->lower = left->lower + left->width;
  memcpy(right->net, left->net, (d + 1) * sizeof *left->net);
  for (unsigned level = 1; level <= d; level++) {
    for (unsigned i = 0; i + level <= d; i++)
      for (int k = 0; k < 2; k++) right->net[i][k] = 0.5 * right->net[i][k] + 0.5 * right->net[i + 1][k];
    memcpy(left->net[level], right->net[0], sizeof left->net[level]);
  }
}

/* What f is at least, and how far below 0 its second derivative comes at most. */
typedef struct bounds {
  double least, concavity;
} bounds;

static bounds bounds_of(const search *s, const double (*net)[2]) {
  unsigned d = s->job->degree, n = 2 * d;
  double f[SQUARE] = {0}, weighted[ORDER][2], most = 0;
  bounds b = {INFINITY, 0};
  for (unsigned i = 0; i <= d; i++) {
    most = fmax(most, dot(net[i], net[i]));
    for (int k = 0; k < 2; k++) weighted[i][k] = s->job->own[i] * net[i][k];
  }
  for (unsigned i = 0; i <= d; i++) {
    f[2 * i] += dot(weighted[i], weighted[i]);
    for (unsigned k = i + 1; k <= d; k++) f[i + k] += 2 * dot(weighted[i], weighted[k]);
  }
  for (unsigned r = 0; r <= n; r++) {
    f[r] *= s->job->both[r];
    b.least = fmin(b.least, f[r]);
    if (r >= 2) b.concavity = fmax(b.concavity, (f[r - 1] - f[r - 2]) - (f[r] - f[r - 1]));
  }
  b.least -= 16 * DBL_EPSILON * most; /* sums that cancel */
  b.concavity *= (double)n * (n - 1);
  return b;
}

/* The least of what control points reach along the way from the point to the net's middle: below the distance. */
static double reach(const search *s, const double (*net)[2]) {
  unsigned d = s->job->degree;
  double way[2] = {net[0][0] + net[d][0], net[0][1] + net[d][1]}, length = norm(way), least = INFINITY;
  if (!(length > 0)) return 0;
  for (unsigned i = 0; i <= d; i++) least = fmin(least, dot(net[i], way));
  return least / length;
}

/* The minimum where f is convex (or nearly), unless it is at an end, which has been looked at: Newton's method on
 * x . x', bisection where it leaves the interval that holds the change of sign. */
static void minimise(search *s, size_t span, const part *p) {
  unsigned d = s->job->degree;
  const double(*net)[2] = (const double(*)[2])p->net;
  const double first[2] = {net[1][0] - net[0][0], net[1][1] - net[0][1]};
  const double last[2] = {net[d][0] - net[d - 1][0], net[d][1] - net[d - 1][1]};
  double low = 0, high = 1, at = 0.5, jet[3][2];
  if (dot(net[0], first) >= 0 || dot(net[d], last) <= 0) return;
  for (int pass = 0; pass < 60; pass++) {
    jet_at(d, net, at, jet);
    double slope = dot(jet[0], jet[1]), bend = dot(jet[1], jet[1]) + dot(jet[0], jet[2]), next = at - slope / bend;
    if (slope > 0)
      high = at;
    else
      low = at;
    if (!(bend > 0 && next > low && next < high)) next = 0.5 * low + 0.5 * high;
    if (fabs(next - at) <= 2 * DBL_EPSILON) break;
    at = next;
  }
  jet_at(d, net, at, jet);
  take(s, span, p->lower + at * p->width, norm(jet[0]));
}

/* Whether a part with f >= least can be left: it is behind the best place, or not. */
static bool hopeless(const search *s, size_t span, const part *p, double least) {
  place start = {span, p->lower};
  double enough = s->best;
  if (!before(&start, &s->near)) {
    if (s->best <= s->miss) return true;
    enough = s->best - s->miss;
  }
  return least > 0 && least >= enough * enough;
}

static void search_span(search *s, size_t span) {
  unsigned d = s->job->degree;
  size_t height = 1;
  s->parts[0].lower = 0;
  s->parts[0].width = 1;
  s->parts[0].depth = 0;
  span_net(s, span, s->parts[0].net);
  while (height > 0) {
    part *p = &s->parts[--height];
    const double(*net)[2] = (const double(*)[2])p->net;
    if (reach(s, net) > s->best + s->tie) continue;
    take(s, span, p->lower, norm(net[0]));
    take(s, span, p->lower + p->width, norm(net[d]));
    bounds b = bounds_of(s, net);
    if (hopeless(s, span, p, b.least)) continue;
    /* f is convex but for a parabola that takes an eighth of its bend. */
    if (b.concavity <= 4 * s->best * s->miss) {
      minimise(s, span, p);
      continue;
    }
    if (p->depth == DEPTH) continue;
    /* The first half on top. */
    s->parts[height + 1] = *p;
    halve(d, &s->parts[height + 1], &s->parts[height]);
    height += 2;
  }
}

/* ---- one point ------------------------------------------------------------------------------------ */

typedef struct branch {
  size_t node, from, to;
  double bound;
} branch;

static double box_distance(const search *s, const box3 *box) {
  double out[2];
  for (int k = 0; k < 2; k++) {
    double lower = s->middle[k] + s->scale * box->lower[k], upper = s->middle[k] + s->scale * box->upper[k];
    out[k] = fmax(0, fmax(lower, -upper));
  }
  return norm(out);
}

static void search_tree(search *s) {
  const box_tree *tree = &s->job->tree;
  branch stack[TREE_STACK] = {{0, 0, tree->count, 0}};
  size_t height = 1;
  while (height > 0) {
    branch b = stack[--height];
    if (b.bound > s->best + s->tie) continue;
    if (b.to - b.from == 1) {
      search_span(s, tree->order[b.from]);
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
  for (int k = 0; k < 2; k++) away = fmax(away, fabs(j->middle[k] - point[k]));
  int own = j->curve->exponent, far = away > 0 ? -ilogb(away) : own;
  s->exponent = far < own ? far : own;
  if (s->exponent < -1022) s->exponent = -1022;
  s->scale = ldexp(1, s->exponent - own);
  double unit = ldexp(1, s->exponent);
  for (int k = 0; k < 2; k++) s->middle[k] = (j->middle[k] - point[k]) * unit;
  s->miss = MISS * j->size * s->scale + 8 * DBL_EPSILON * norm(s->middle);
  s->tie = 8 * DBL_EPSILON * (j->size * s->scale + norm(s->middle));
  s->best = INFINITY;
}

static double distance_at(const search *s, const place *p) {
  double net[ORDER][2], jet[3][2];
  span_net(s, p->span, net);
  jet_at(s->job->degree, (const double(*)[2])net, p->s, jet);
  return norm(jet[0]);
}

/* The place is as near as is promised, but may be off along the curve: a last descent on its span. */
static void polish(search *s) {
  double net[ORDER][2], jet[3][2], at = s->near.s;
  span_net(s, s->near.span, net);
  for (int pass = 0; pass < 3; pass++) {
    jet_at(s->job->degree, (const double(*)[2])net, at, jet);
    double bend = dot(jet[1], jet[1]) + dot(jet[0], jet[2]), next = at - dot(jet[0], jet[1]) / bend;
    if (!(bend > 0) || !isfinite(next)) break;
    at = fmin(fmax(next, 0), 1);
  }
  place p = {s->near.span, at};
  double distance = distance_at(s, &p);
  if (!(distance <= s->best + s->tie)) return;
  s->best = distance;
  s->near = p;
}

static double parameter_of(const job *j, const place *p) {
  const double *knots = j->curve->space.knots + j->span[p->span];
  double t = (1 - p->s) * knots[0] + p->s * knots[1];
  return fmin(fmax(t, knots[0]), knots[1]);
}

static void search_some(void *arg, size_t index) {
  const job *j = arg;
  size_t from = (j->first_task + index) * QUERIES;
  search s = {.job = j, .parts = j->parts + index * PARTS};
  for (size_t i = from; i < from + QUERIES && i < j->count; i++) {
    begin(&s, j->points + 2 * i);
    if (i == from) s.near = (place){0, 0};
    s.best = distance_at(&s, &s.near);
    search_tree(&s);
    polish(&s);
    j->parameters[i] = parameter_of(j, &s.near);
    j->distances[i] = ldexp(s.best, -s.exponent);
  }
}

/* ---- the public call ------------------------------------------------------------------------------ */

static batten_status check(batten_context *ctx, const batten_curve *curve, size_t count, const double *points,
                           const double *parameters) {
  if (!curve) return batten_fail(ctx, BATTEN_E_INVALID, "curve: NULL; give a curve");
  if (count && (!points || !parameters))
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give %zu points and room for as many parameters",
                       points ? "parameters" : "points", count);
  if (count > SIZE_MAX / (2 * sizeof *points))
    return batten_fail(ctx, BATTEN_E_INVALID, "count: %zu; no array has so many points", count);
  size_t bad = batten_first_nonfinite(2 * count, points);
  if (bad < 2 * count)
    return batten_fail(ctx, BATTEN_E_INVALID, "points[%zu][%zu]: %g; give finite coordinates", bad / 2, bad % 2,
                       points[bad]);
  return BATTEN_OK;
}

/* No point may be further from the box of the control points than a double can say. */
static batten_status check_far(batten_context *ctx, job *j) {
  double lower[2], upper[2];
  curve_points_box(j->curve->space.count, j->curve->control_points, lower, upper);
  for (size_t i = 0; i < 2 * j->count; i++)
    if (!isfinite(j->points[i] - lower[i % 2]) || !isfinite(j->points[i] - upper[i % 2]))
      return batten_fail(ctx, BATTEN_E_INVALID, "points[%zu][%zu]: %g; its distance is beyond a double", i / 2, i % 2,
                         j->points[i]);
  return BATTEN_OK;
}

static void make_weights(job *j) {
  unsigned d = j->degree;
  double both = 1;
  j->own[0] = j->both[0] = 1;
  for (unsigned k = 1; k <= d; k++) j->own[k] = j->own[k - 1] * (d - k + 1) / k;
  for (unsigned k = 1; k <= 2 * d; k++) {
    both = both * (2 * d - k + 1) / k;
    j->both[k] = 1 / both;
  }
}

/* Bezier points of all spans, and their boxes. */
static void make_spans(job *j, box3 *boxes) {
  const batten_curve *c = j->curve;
  unsigned d = j->degree;
  double rows[ORDER * ORDER], unit = ldexp(1, c->exponent);
  size_t at = 0;
  for (size_t mu = bspline_first(&c->space); mu < c->space.count; mu = bspline_next(&c->space, mu), at++) {
    double(*net)[2] = j->bezier + at * (d + 1);
    double points[ORDER][3] = {{0}};
    j->span[at] = mu;
    bspline_rows(&c->space, mu, 0, c->space.knots[mu], c->space.knots[mu + 1], rows);
    for (unsigned i = 0; i <= d; i++)
      for (size_t k = 0; k < 2; k++) {
        double sum = 0;
        for (unsigned q = 0; q <= d; q++)
          sum += rows[i * (d + 1) + q] * (unit * (c->control_points[2 * (mu - d + q) + k] - j->middle[k]));
        net[i][k] = points[i][k] = sum;
      }
    boxes[at] = box3_of_points(d + 1, (const double(*)[3])points);
  }
}

static batten_status plan(batten_context *ctx, job *j) {
  batten_status st = check_far(ctx, j);
  if (st < 0) return st;
  j->spans = bspline_span_count(&j->curve->space);
  if (j->spans > UINT32_MAX) return batten_fail(ctx, BATTEN_E_TOO_LARGE, "curve: %zu spans are too many", j->spans);
  curve_find_middle(j->curve, j->middle);
  make_weights(j);
  size_t tasks = j->count / QUERIES + 1;
  box3 *boxes = batten_alloc_array(ctx, j->spans, sizeof *boxes);
  j->span = batten_alloc_array(ctx, j->spans, sizeof *j->span);
  j->bezier = batten_alloc_array(ctx, j->spans, (j->degree + 1) * sizeof *j->bezier);
  /* Results go to the caller when all are there. */
  j->parameters = batten_alloc_array(ctx, j->count, sizeof *j->parameters);
  j->distances = batten_alloc_array(ctx, j->count, sizeof *j->distances);
  j->parts = batten_alloc_array(ctx, tasks < BATCH ? tasks : BATCH, PARTS * sizeof *j->parts);
  st = boxes && j->span && j->bezier && j->parameters && j->distances && j->parts ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0) {
    make_spans(j, boxes);
    st = box_tree_make(ctx, j->spans, boxes, &j->tree);
  }
  if (st >= 0)
    j->size = hypot(j->tree.boxes[0].upper[0] - j->tree.boxes[0].lower[0],
                    j->tree.boxes[0].upper[1] - j->tree.boxes[0].lower[1]);
  batten_free(ctx, boxes);
  return st;
}

static batten_status search_all(batten_context *ctx, job *j) {
  size_t tasks = j->count / QUERIES + (j->count % QUERIES > 0);
  for (size_t done = 0; done < tasks; done += BATCH) {
    batten_status st = batten_progress(ctx, "closest", (double)done / (double)tasks);
    if (st < 0) return st;
    j->first_task = done;
    batten_parallel(ctx, tasks - done < BATCH ? tasks - done : BATCH, search_some, j);
  }
  return batten_progress(ctx, "closest", 1);
}

batten_status batten_curve_closest(batten_context *ctx, const batten_curve *curve, size_t count, const double *points,
                                   double *parameters, double *distances) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_status st = check(ctx, curve, count, points, parameters);
  if (st < 0 || count == 0) return st;
  job j = {.curve = curve, .degree = curve->space.degree, .count = count, .points = points};
  st = plan(ctx, &j);
  if (st >= 0) st = search_all(ctx, &j);
  if (st >= 0) {
    memcpy(parameters, j.parameters, count * sizeof *parameters);
    if (distances) memcpy(distances, j.distances, count * sizeof *distances);
  }
  batten_free(ctx, j.parts);
  batten_free(ctx, j.distances);
  batten_free(ctx, j.parameters);
  box_tree_free(ctx, &j.tree);
  batten_free(ctx, j.bezier);
  batten_free(ctx, j.span);
  return st;
}
