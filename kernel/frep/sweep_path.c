/* Paths of sweeps: splines in pieces that turn little, frames, and where planes across a path meet a point.
 *
 * Spline. C2 through the points over chord lengths, by the slopes m at the points (de Boor's not-a-knot ends, a
 * parabola through three points; closed paths: cyclic, by Sherman and Morrison's formula); kept as Bezier points.
 * Each segment is halved until its pieces turn by less than TURN: a Bezier curve turns by no more than its polygon.
 *
 * Frames.  [Wang, Juettler, Zheng, Liu 2008]  From node to node, and from a node into its piece, by double
 * reflection: once in the plane across the chord, once in the one that brings the tangent to where it must be. On the
 * closed path the frame comes back turned by an angle, which is taken back evenly along the path.
 *
 * Roots. h(u) = o'(u) . (x - o(u)) is of degree 5; its Bernstein coefficients are linear in x, and change sign at
 * least as often as it has roots: none or one settle it, more are parted by halving. Signs at nodes are those of one
 * number for both pieces beside, so that no root is lost between them. */
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "frep/sweep_path.h"

#define TURN 0.03 /* of a piece: bounds of frames are wide by about its square */

enum { SPLIT = 1024 /* most pieces of a segment */ };

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const double *a, const double *b, double *out) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

static double norm(const double *a) { return sqrt(dot(a, a)); }

/* ---- slopes at the points -------------------------------------------------------------------------- */

/* Row i: low m[i-1] + middle m[i] + high m[i+1] = right; four right sides, the last for the cyclic correction. */
typedef struct spline_row {
  double low, middle, high, right[4];
} spline_row;

static void eliminate(size_t count, spline_row *row) {
  for (size_t i = 1; i < count; i++) {
    double factor = row[i].low / row[i - 1].middle;
    row[i].middle -= factor * row[i - 1].high;
    for (int k = 0; k < 4; k++) row[i].right[k] -= factor * row[i - 1].right[k];
  }
  for (size_t i = count; i-- > 0;)
    for (int k = 0; k < 4; k++) {
      double next = i + 1 < count ? row[i].high * row[i + 1].right[k] : 0;
      row[i].right[k] = (row[i].right[k] - next) / row[i].middle;
    }
}

static double chord(const double *points, size_t i, size_t j, double *way) {
  for (int k = 0; k < 3; k++) way[k] = points[3 * j + (size_t)k] - points[3 * i + (size_t)k];
  return norm(way);
}

/* Not-a-knot end: row at the point, its chords of lengths near and far with slopes. */
static void end_row(double near, double far, const double *slope_near, const double *slope_far, double *own,
                    double *other, double *right) {
  *own = far;
  *other = near + far;
  for (int k = 0; k < 3; k++)
    right[k] = ((near + 2 * (near + far)) * far * slope_near[k] + near * near * slope_far[k]) / (near + far);
}

/* The parabola through three points, of which not-a-knot ends would say the same thing twice. */
static void parabola_slopes(const double *points, spline_row *row) {
  double way[2][3], h = chord(points, 0, 1, way[0]), g = chord(points, 1, 2, way[1]);
  for (int k = 0; k < 3; k++) {
    double before = way[0][k] / h, after = way[1][k] / g, middle = (g * before + h * after) / (h + g);
    row[0].right[k] = 2 * before - middle;
    row[1].right[k] = middle;
    row[2].right[k] = 2 * after - middle;
  }
}

/* m in the rows' right sides. count >= 3. */
static void set_slopes(size_t count, const double *points, bool closed, spline_row *row) {
  for (size_t i = 0; i < count; i++) {
    row[i] = (spline_row){0};
    if (!closed && (i == 0 || i + 1 == count)) continue;
    double before[3], after[3];
    double h = chord(points, i == 0 ? count - 1 : i - 1, i, before), g = chord(points, i, (i + 1) % count, after);
    row[i].low = g;
    row[i].middle = 2 * (h + g);
    row[i].high = h;
    for (int k = 0; k < 3; k++) row[i].right[k] = 3 * (g / h * before[k] + h / g * after[k]);
  }
  if (!closed && count == 3) {
    parabola_slopes(points, row);
    return;
  }
  if (!closed) {
    double near[3], far[3];
    double h = chord(points, 0, 1, near), g = chord(points, 1, 2, far);
    for (int k = 0; k < 3; k++) near[k] /= h, far[k] /= g;
    end_row(h, g, near, far, &row[0].middle, &row[0].high, row[0].right);
    h = chord(points, count - 2, count - 1, near);
    g = chord(points, count - 3, count - 2, far);
    for (int k = 0; k < 3; k++) near[k] /= h, far[k] /= g;
    end_row(h, g, near, far, &row[count - 1].middle, &row[count - 1].low, row[count - 1].right);
    eliminate(count, row);
    return;
  }
  /* A = B + u v': u = (c, 0 .. 0, high_last), v = (1, 0 .. 0, low_first / c) */
  double first = row[0].low, last = row[count - 1].high, c = -row[0].middle;
  row[0].middle -= c;
  row[count - 1].middle -= last * first / c;
  row[0].right[3] = c;
  row[count - 1].right[3] = last;
  row[0].low = row[count - 1].high = 0;
  eliminate(count, row);
  double weight = first / c, by = 1 + row[0].right[3] + weight * row[count - 1].right[3];
  double take[3];
  for (int k = 0; k < 3; k++) take[k] = (row[0].right[k] + weight * row[count - 1].right[k]) / by;
  for (size_t i = 0; i < count; i++)
    for (int k = 0; k < 3; k++) row[i].right[k] -= take[k] * row[i].right[3];
}

/* ---- pieces ---------------------------------------------------------------------------------------- */

static void blossom(double b[4][3], double r, double s, double t, double *out) {
  for (int k = 0; k < 3; k++) {
    double p[3];
    for (int i = 0; i < 3; i++) p[i] = (1 - r) * b[i][k] + r * b[i + 1][k];
    for (int i = 0; i < 2; i++) p[i] = (1 - s) * p[i] + s * p[i + 1];
    out[k] = (1 - t) * p[0] + t * p[1];
  }
}

static void part_of(double b[4][3], double from, double to, double part[4][3]) {
  blossom(b, from, from, from, part[0]);
  blossom(b, from, from, to, part[1]);
  blossom(b, from, to, to, part[2]);
  blossom(b, to, to, to, part[3]);
}

static void legs(double b[4][3], double d[3][3]) {
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) d[i][k] = b[i + 1][k] - b[i][k];
}

static double turn_of(double b[4][3]) {
  double d[3][3], turn = 0;
  legs(b, d);
  for (int i = 0; i < 2; i++) {
    double c[3];
    cross(d[i], d[i + 1], c);
    turn += atan2(norm(c), dot(d[i], d[i + 1]));
  }
  return turn;
}

/* In how many pieces a segment goes so that none turns by more than TURN. */
static size_t splits_of(double b[4][3]) {
  for (size_t parts = 1; parts < SPLIT; parts *= 2) {
    double most = 0, part[4][3];
    for (size_t i = 0; i < parts; i++) {
      part_of(b, (double)i / (double)parts, (double)(i + 1) / (double)parts, part);
      most = fmax(most, turn_of(part));
    }
    if (most <= TURN) return parts;
  }
  return SPLIT;
}

static void measure_piece(sweep_piece *p) {
  static const double choose2[3] = {1, 2, 1}, choose3[4] = {1, 3, 3, 1}, choose5[6] = {1, 5, 10, 10, 5, 1};
  double d[3][3], least = INFINITY, along[3];
  for (int k = 0; k < 3; k++) {
    p->low[k] = fmin(fmin(p->b[0][k], p->b[1][k]), fmin(p->b[2][k], p->b[3][k]));
    p->high[k] = fmax(fmax(p->b[0][k], p->b[1][k]), fmax(p->b[2][k], p->b[3][k]));
  }
  legs(p->b, d);
  p->turn = turn_of(p->b);
  p->length = p->fast = p->bend = 0;
  for (int k = 0; k < 3; k++) along[k] = d[0][k] + d[1][k] + d[2][k];
  for (int i = 0; i < 3; i++) {
    p->length += norm(d[i]);
    p->fast = fmax(p->fast, 3 * norm(d[i]));
    least = fmin(least, 3 * dot(d[i], along) / norm(along));
  }
  p->slow = least > 0 ? least : 0;
  for (int i = 0; i < 2; i++) {
    for (int k = 0; k < 3; k++) p->second[i][k] = 6 * (d[i + 1][k] - d[i][k]);
    p->bend = fmax(p->bend, norm(p->second[i]));
  }
  memset(p->plane, 0, sizeof p->plane);
  memset(p->offset, 0, sizeof p->offset);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 4; j++) {
      double weight = 3 * choose2[i] * choose3[j] / choose5[i + j];
      const double from[3] = {p->b[j][0] - p->b[0][0], p->b[j][1] - p->b[0][1], p->b[j][2] - p->b[0][2]};
      for (int k = 0; k < 3; k++) p->plane[i + j][k] += weight * d[i][k];
      p->offset[i + j] += weight * dot(d[i], from);
    }
}

void sweep_piece_at(const sweep_piece *p, double u, double *o, double *slope, double *bend) {
  for (int k = 0; k < 3; k++) {
    double a = p->b[0][k], d0 = p->b[1][k] - a, d1 = p->b[2][k] - p->b[1][k], d2 = p->b[3][k] - p->b[2][k];
    double linear = 3 * d0, square = 3 * (d1 - d0), cube = d2 - 2 * d1 + d0;
    if (o) o[k] = a + u * (linear + u * (square + u * cube));
    if (slope) slope[k] = linear + u * (2 * square + u * 3 * cube);
    if (bend) bend[k] = 2 * square + u * 6 * cube;
  }
}

/* ---- frames ---------------------------------------------------------------------------------------- */

static void reflect(const double *across, const double *v, double *out) {
  double factor = 2 * dot(across, v) / dot(across, across);
  for (int k = 0; k < 3; k++) out[k] = v[k] - factor * across[k];
}

/* axis of the frame at `tangent`, a chord away; chords of any length but 0. */
static void turn_frame(const sweep_node *from, const double *way, const double *tangent, double *axis) {
  double left[3], mirrored[3], across[3];
  reflect(way, from->axis, left);
  reflect(way, from->tangent, mirrored);
  for (int k = 0; k < 3; k++) across[k] = tangent[k] - mirrored[k];
  reflect(across, left, axis);
}

/* Least turn from one direction to the next; of the two ways back any will do: the axis stays. */
static void turn_corner(const sweep_node *from, const double *tangent, double *axis) {
  double sum[3], size = 1 + dot(from->tangent, tangent);
  for (int k = 0; k < 3; k++) sum[k] = from->tangent[k] + tangent[k];
  double factor = size > 1e-12 ? dot(from->axis, tangent) / size : 0;
  for (int k = 0; k < 3; k++) axis[k] = from->axis[k] - factor * sum[k];
}

static void unit(double *v) {
  double size = norm(v);
  for (int k = 0; k < 3; k++) v[k] /= size;
}

void sweep_frame_at(const sweep_path *path, size_t piece, double u, double axes[2][3]) {
  const sweep_piece *p = path->piece + piece;
  const sweep_node *node = path->node + piece;
  double tangent[3], x[3], y[3], way[3];
  if (path->smooth) {
    sweep_piece_at(p, u, NULL, tangent, NULL);
    unit(tangent);
    double v = 1 - u; /* (o(u) - o(0)) / u, which does not vanish at 0 */
    for (int k = 0; k < 3; k++)
      way[k] = 3 * v * v * (p->b[1][k] - p->b[0][k]) + 3 * v * u * (p->b[2][k] - p->b[0][k]) +
               u * u * (p->b[3][k] - p->b[0][k]);
    turn_frame(node, way, tangent, x);
  } else {
    memcpy(tangent, node->tangent, sizeof tangent);
    memcpy(x, node->axis, sizeof x);
  }
  cross(tangent, x, y);
  double angle = path->spin * (p->start + p->span * u), c = cos(angle), s = sin(angle);
  for (int k = 0; k < 3; k++) {
    axes[0][k] = c * x[k] + s * y[k];
    axes[1][k] = c * y[k] - s * x[k];
  }
}

/* The first frame: the profile's y axis along up. */
static batten_status start_frame(batten_context *ctx, const double *tangent, const double *up, double *axis) {
  double towards[3] = {0};
  if (up && norm(up) > 0) {
    memcpy(towards, up, sizeof towards);
    unit(towards);
  } else {
    int least = 0;
    for (int k = 1; k < 3; k++)
      if (fabs(tangent[k]) < fabs(tangent[least])) least = k;
    towards[least] = 1;
  }
  cross(towards, tangent, axis);
  if (!(norm(axis) > 1e-9))
    return batten_fail(ctx, BATTEN_E_INVALID, "up: lies along the path where it starts; give a direction across it");
  unit(axis);
  return BATTEN_OK;
}

static batten_status set_nodes(batten_context *ctx, sweep_path *path, bool framed, const double *up) {
  for (size_t i = 0; i <= path->pieces; i++) {
    bool last = i == path->pieces;
    sweep_node *node = path->node + i;
    const sweep_piece *p = path->piece + (last ? i - 1 : i);
    sweep_piece_at(p, last ? 1 : 0, node->o, node->tangent, NULL);
    if (!(norm(node->tangent) > 1e-9 * p->span))
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "path: stands still near (%g, %g, %g); round the turn there by more "
                         "points",
                         node->o[0] + path->base[0], node->o[1] + path->base[1], node->o[2] + path->base[2]);
    unit(node->tangent);
  }
  sweep_node *last = path->node + path->pieces;
  if (path->closed && path->smooth) {
    memcpy(last->o, path->node[0].o, sizeof last->o);
    memcpy(last->tangent, path->node[0].tangent, sizeof last->tangent);
  }
  if (!framed) return BATTEN_OK;
  batten_status st = start_frame(ctx, path->node[0].tangent, up, path->node[0].axis);
  if (st < 0) return st;
  for (size_t i = 0; i < path->pieces; i++) {
    sweep_node *next = path->node + i + 1;
    const sweep_piece *p = path->piece + i;
    const double way[3] = {p->b[3][0] - p->b[0][0], p->b[3][1] - p->b[0][1], p->b[3][2] - p->b[0][2]};
    if (path->smooth)
      turn_frame(path->node + i, way, next->tangent, next->axis);
    else
      turn_corner(path->node + i, next->tangent, next->axis);
    unit(next->axis);
  }
  if (path->closed && path->smooth) {
    double y[3];
    cross(path->node[0].tangent, path->node[0].axis, y);
    path->spin = -atan2(dot(last->axis, y), dot(last->axis, path->node[0].axis)) / path->total;
  }
  return BATTEN_OK;
}

/* ---- runs ------------------------------------------------------------------------------------------ */

static void set_run(const sweep_path *path, size_t first, size_t last, sweep_run *run) {
  const size_t middle = first + (last - first) / 2;
  memcpy(run->middle, path->node[middle].o, sizeof run->middle);
  memcpy(run->tangent, path->node[middle].tangent, sizeof run->tangent);
  for (size_t i = first; i < last; i++) {
    double apart[3];
    for (int k = 0; k < 3; k++) apart[k] = path->node[i].tangent[k] - run->tangent[k];
    run->spread = fmax(run->spread, norm(apart) + path->piece[i].turn);
    for (int j = 0; j < 4; j++) {
      for (int k = 0; k < 3; k++) apart[k] = path->piece[i].b[j][k] - run->middle[k];
      run->radius = fmax(run->radius, norm(apart));
    }
  }
}

static batten_status set_runs(batten_context *ctx, sweep_path *path) {
  size_t runs = (path->pieces + SWEEP_RUN - 1) / SWEEP_RUN;
  path->run = batten_alloc_array(ctx, runs, sizeof *path->run);
  if (!path->run) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < runs; i++) {
    path->run[i] = (sweep_run){0};
    size_t first = SWEEP_RUN * i, last = path->pieces - first < SWEEP_RUN ? path->pieces : first + SWEEP_RUN;
    set_run(path, first, last, path->run + i);
  }
  return BATTEN_OK;
}

/* T . (x - o) for a unit tangent T at o within the run differs from that of its middle by at most spread |x - middle|
 * + radius. */
static bool is_far(const sweep_path *path, const sweep_run *run, const double *x, double half) {
  double q[3], size = path->total + half;
  for (int k = 0; k < 3; k++) {
    q[k] = x[k] - run->middle[k];
    size += fabs(x[k]);
  }
  return fabs(dot(run->tangent, q)) > run->spread * norm(q) + run->radius + half + 1e-12 * size;
}

size_t sweep_next_near(const sweep_path *path, size_t piece, const double *x, double half) {
  while (piece < path->pieces && piece % SWEEP_RUN == 0 && is_far(path, path->run + piece / SWEEP_RUN, x, half))
    piece += SWEEP_RUN;
  return piece < path->pieces ? piece : path->pieces;
}

/* ---- making ---------------------------------------------------------------------------------------- */

static batten_status check_path(batten_context *ctx, size_t count, const double *points, bool closed) {
  for (size_t i = 0; i < count; i++) {
    size_t next = i + 1 < count ? i + 1 : 0;
    double way[3];
    if (next == 0 && !closed) break;
    double size = chord(points, i, next, way);
    if (!isfinite(size)) return batten_fail(ctx, BATTEN_E_INVALID, "path[%zu]: too far from path[%zu]", next, i);
    if (size == 0)
      return batten_fail(ctx, BATTEN_E_INVALID, "path[%zu]: equals path[%zu]; leave one of them out%s",
                         next ? next : i, next ? i : next, next ? "" : " (a closed path comes back by itself)");
  }
  return BATTEN_OK;
}

/* Bezier points of segment i. */
static double take_segment(const sweep_path *path, size_t count, const double *points, const spline_row *row,
                           size_t i, double b[4][3]) {
  size_t next = (i + 1) % count;
  double way[3], h = chord(points, i, next, way);
  for (size_t k = 0; k < 3; k++) {
    double a = points[3 * i + k] - path->base[k], z = points[3 * next + k] - path->base[k];
    b[0][k] = a;
    b[3][k] = z;
    b[1][k] = row ? a + row[i].right[k] * h / 3 : a + way[k] / 3;
    b[2][k] = row ? z - row[next].right[k] * h / 3 : z - way[k] / 3;
  }
  return h;
}

static size_t parts_of(double b[4][3], bool framed, bool smooth, size_t segments, size_t least) {
  if (framed) return smooth ? splits_of(b) : 1;
  return (least + segments - 1) / segments;
}

static batten_status set_pieces(batten_context *ctx, sweep_path *path, size_t count, const double *points,
                                const spline_row *row, bool framed, size_t least) {
  size_t segments = path->closed ? count : count - 1;
  double b[4][3];
  for (size_t i = 0; i < segments; i++) {
    take_segment(path, count, points, row, i, b);
    path->pieces += parts_of(b, framed, path->smooth, segments, least);
  }
  path->piece = batten_alloc_array(ctx, path->pieces, sizeof *path->piece);
  path->node = batten_alloc_array(ctx, path->pieces + 1, sizeof *path->node);
  if (!path->piece || !path->node) return BATTEN_E_NOMEM;
  size_t made = 0;
  for (size_t i = 0; i < segments; i++) {
    double h = take_segment(path, count, points, row, i, b);
    size_t parts = parts_of(b, framed, path->smooth, segments, least);
    for (size_t j = 0; j < parts; j++) {
      sweep_piece *p = path->piece + made++;
      *p = (sweep_piece){.start = path->total + h * (double)j / (double)parts, .span = h / (double)parts};
      part_of(b, (double)j / (double)parts, (double)(j + 1) / (double)parts, p->b);
      measure_piece(p);
    }
    path->total += h;
  }
  return BATTEN_OK;
}

batten_status sweep_path_make(batten_context *ctx, size_t count, const double *points, bool smooth, bool closed,
                              bool framed, const double *up, size_t least, sweep_path **out) {
  batten_status st = check_path(ctx, count, points, closed);
  if (st < 0) return st;
  spline_row *row = NULL;
  sweep_path *path = batten_alloc(ctx, sizeof *path);
  if (!path) return BATTEN_E_NOMEM;
  *path = (sweep_path){.ctx = ctx, .smooth = smooth && count > 2, .closed = closed};
  memcpy(path->base, points, sizeof path->base);
  if (path->smooth) {
    row = batten_alloc_array(ctx, count, sizeof *row);
    st = row ? BATTEN_OK : BATTEN_E_NOMEM;
    if (row) set_slopes(count, points, closed, row);
  }
  if (st >= 0) st = set_pieces(ctx, path, count, points, row, framed, least);
  if (st >= 0) st = set_nodes(ctx, path, framed, up);
  if (st >= 0 && framed && path->smooth) st = set_runs(ctx, path);
  batten_free(ctx, row);
  if (st >= 0)
    *out = path;
  else
    sweep_path_free(path);
  return st;
}

void sweep_path_free(sweep_path *path) {
  if (!path) return;
  batten_free(path->ctx, path->piece);
  batten_free(path->ctx, path->node);
  batten_free(path->ctx, path->run);
  batten_free(path->ctx, path);
}

void sweep_path_box(const sweep_path *path, double *lower, double *upper) {
  for (size_t k = 0; k < 3; k++) {
    lower[k] = INFINITY;
    upper[k] = -INFINITY;
    for (size_t i = 0; i < path->pieces; i++) {
      lower[k] = fmin(lower[k], path->piece[i].low[k]);
      upper[k] = fmax(upper[k], path->piece[i].high[k]);
    }
  }
}
