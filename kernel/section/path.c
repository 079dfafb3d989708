/* The path of the moving plane: its frame M(t), its origin o(t), and their derivatives.  [Savchenko et al. 1995,
 * section 4]
 *
 * All ways from section to section are of one form: M = exp(-[v]x) base with a vector v that is a cubic polynomial of
 * t and a fixed frame `base` for each interval.
 *
 *   GEODESIC   base M_i, v goes straight to the turn from M_i to M_(i+1)
 *   LOGARITHM  base 1, v goes straight from ln M_i to ln M_(i+1): the paper's M(t), with the weights such that it is
 *              M_i on plane i
 *   SPHERICAL  base halfway between both, v cubic with given angular velocities at both ends
 *   VELOCITY   the same between the steps of the integration of the given velocities
 *
 * SPHERICAL takes its velocities from the turns alone, so that a turned frame of reference changes nothing: the sum
 * of the turns l_i is the integral of omega, but for the commutator h^2 / 12 omega_i x omega_(i+1) of each interval
 * (Magnus); the slopes of the cubic spline through the sums, not-a-knot, are omega, and the commutators follow in a
 * few rounds. So M(t) has an error of h^4 between sections and one continuous derivative, as good as two. */
#include "section/path.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "basis/cubic.h"
#include "mesh/vec.h"
#include "section/rotations.h"

struct stack_path {
  batten_context *ctx;
  size_t count; /* pieces */
  double drift, speeds[2];
  stack_plane *planes; /* [count / STACK_PATH_PIECES + 1], behind the pieces */
  stack_piece pieces[];
};

/* ---- pieces ---------------------------------------------------------------------------------------------------- */

/* Bezier points over [u0, u1] of those over [0, 1]. */
static void bezier_part(double in[4][3], double u0, double u1, double out[4][3]) {
  for (int k = 0; k < 3; k++)
    for (int m = 0; m < 4; m++) { /* the blossom at 3 - m times u0 and m times u1 */
      double b[4] = {in[0][k], in[1][k], in[2][k], in[3][k]};
      for (int r = 0; r < 3; r++) {
        double u = r < 3 - m ? u0 : u1;
        for (int j = 0; j < 3 - r; j++) b[j] = (1 - u) * b[j] + u * b[j + 1];
      }
      out[m][k] = b[0];
    }
}

static void bezier_line(const double a[3], const double b[3], double out[4][3]) {
  for (int k = 0; k < 3; k++)
    for (int m = 0; m < 4; m++) out[m][k] = m == 3 ? b[k] : a[k] + m * ((b[k] - a[k]) / 3);
}

/* h: of the interval; da, db: slopes at its ends. */
static void bezier_hermite(const double a[3], const double b[3], const double da[3], const double db[3], double h,
                           double out[4][3]) {
  for (int k = 0; k < 3; k++) {
    out[0][k] = a[k];
    out[1][k] = a[k] + h / 3 * da[k];
    out[2][k] = b[k] - h / 3 * db[k];
    out[3][k] = b[k];
  }
}

static void bezier_value(const double b[4][3], double u, double h, double value[3], double slope[3]) {
  double v = 1 - u;
  for (int k = 0; k < 3; k++) {
    double p = v * b[0][k] + u * b[1][k], q = v * b[1][k] + u * b[2][k], r = v * b[2][k] + u * b[3][k];
    double s = v * p + u * q, t = v * q + u * r;
    value[k] = u == 0 ? b[0][k] : u == 1 ? b[3][k] : v * s + u * t;
    slope[k] = 3 / h * (t - s);
  }
}

/* Turns from `from` to `to` by a cubic about the frame halfway, with the angular velocities at both ends. */
static void turn_hermite(const double *from, const double *to, const double rate_from[3], const double rate_to[3],
                         double h, double *base, double turn[4][3]) {
  double v[3], a[3], b[3], da[3], db[3], half[9];
  rotation_between(from, to, v);
  for (int k = 0; k < 3; k++) {
    b[k] = v[k] / 2;
    a[k] = -b[k];
  }
  rotation_turn(b, half);
  rotation_multiply(half, from, base);
  rotation_rate_inverse(a, rate_from, da);
  rotation_rate_inverse(b, rate_to, db);
  bezier_hermite(a, b, da, db, h, turn);
}

void stack_piece_frame(const stack_piece *piece, double t, stack_frame *out) {
  double h = piece->t1 - piece->t0, u = (t - piece->t0) / h, v[3], dv[3], omega[3], turn[9];
  u = u > 0 ? (u < 1 ? u : 1) : 0;
  bezier_value((const double(*)[3])piece->origin, u, h, out->origin, out->d_origin);
  bezier_value((const double(*)[3])piece->turn, u, h, v, dv);
  rotation_turn(v, turn);
  rotation_multiply(turn, piece->base[0], out->rotation[0]);
  rotation_rate(v, dv, omega);
  for (int j = 0; j < 3; j++) { /* M' = -[omega]x M */
    double gamma[3] = {out->rotation[0][j], out->rotation[1][j], out->rotation[2][j]}, w[3];
    vec_cross(omega, gamma, w);
    for (int i = 0; i < 3; i++) out->d_rotation[i][j] = -w[i];
  }
}

/* ---- bounds of the motion ----------------------------------------------------------------------------------------
 */

static void interval_cross(const interval a[3], const interval b[3], interval out[3]) {
  for (int i = 0; i < 3; i++) {
    int j = (i + 1) % 3, k = (i + 2) % 3;
    out[i] = interval_sub(interval_mul(a[j], b[k]), interval_mul(a[k], b[j]));
  }
}

/* Holds the polynomial with these `count` Bezier points times factor, and its rounding. */
static void bezier_hull(int count, double (*b)[3], double factor, interval out[3]) {
  for (int k = 0; k < 3; k++) {
    interval r = interval_of(b[0][k]);
    for (int m = 1; m < count; m++) r = interval_hull(r, interval_of(b[m][k]));
    double size = fmax(fabs(r.lo), fabs(r.hi)) * 1e-14;
    out[k] = interval_scale((interval){r.lo - size, r.hi + size}, factor);
  }
}

/* w - p v x w + q v x (v x w), of which both a turn and the rate of a turn are made. */
static void interval_turned(const interval v[3], const interval w[3], interval p, interval q, interval out[3]) {
  interval once[3], twice[3];
  interval_cross(v, w, once);
  interval_cross(v, once, twice);
  for (int k = 0; k < 3; k++)
    out[k] = interval_add(interval_sub(w[k], interval_mul(p, once[k])), interval_mul(q, twice[k]));
}

static void piece_bounds(stack_piece *p) {
  double h = p->t1 - p->t0, d[3][3], e[3][3];
  for (int m = 0; m < 3; m++)
    for (int k = 0; k < 3; k++) {
      d[m][k] = p->turn[m + 1][k] - p->turn[m][k];
      e[m][k] = p->origin[m + 1][k] - p->origin[m][k];
    }
  double moved[3][3]; /* o' in the frame `base` */
  for (int m = 0; m < 3; m++)
    for (int k = 0; k < 3; k++) moved[m][k] = vec_dot(p->base[k], e[m]);
  interval v[3], dv[3], w[3], square = interval_of(0);
  bezier_hull(4, p->turn, 1, v);
  bezier_hull(3, d, 3 / h, dv);
  bezier_hull(3, moved, 3 / h, w);
  for (int k = 0; k < 3; k++) square = interval_add(square, interval_square(v[k]));
  double s[2], a[2], b[2], pi2 = 9.8696; /* beyond pi the factors need not fall */
  rotation_factors(fmin(fmax(square.lo, 0), pi2), &s[0], &a[0], &b[0]);
  rotation_factors(fmin(square.hi, pi2), &s[1], &a[1], &b[1]);
  interval si = interval_widen(s[1], s[0], 16), ai = interval_widen(a[1], a[0], 16);
  interval bi = interval_widen(b[1], b[0], 16);
  if (square.hi > pi2) {
    si = interval_hull(si, (interval){-0.2173, 0});
    ai = interval_hull(ai, interval_of(0));
    bi = interval_hull(bi, interval_of(0));
  }
  interval_turned(v, dv, ai, bi, p->rate);
  interval_turned(v, w, si, ai, p->velocity);
  for (int k = 0; k < 3; k++) p->middle[k] = (p->origin[0][k] + p->origin[3][k]) / 2;
  p->reach = 0;
  for (int m = 0; m < 4; m++) p->reach = fmax(p->reach, vec_distance(p->origin[m], p->middle));
  p->reach *= 1 + 1e-14;
  interval across = interval_hypot(interval_abs(p->rate[0]), interval_abs(p->rate[1]));
  p->turn_most = across.hi;
  p->advance_most = interval_abs(p->velocity[2]).hi;
}

/* ---- the ways from section to section ----------------------------------------------------------------------------
 */

/* Angular velocities at the sections, [count][3], of the smooth motion through the turns l [count - 1][3]; sums
 * [count][3] and work [count] are scratch. */
static void smooth_rates(size_t count, const double *t, const double *l, double *rates, double *sums, double *work) {
  enum { ROUNDS = 4 }; /* each takes the commutators' error down by h^2 */
  memset(rates, 0, 3 * count * sizeof *rates);
  for (int round = 0; round < ROUNDS; round++) {
    memset(sums, 0, 3 * sizeof *sums);
    for (size_t i = 0; i + 1 < count; i++) {
      double h = t[i + 1] - t[i], c[3];
      vec_cross(rates + 3 * i, rates + 3 * (i + 1), c);
      for (size_t k = 0; k < 3; k++) sums[3 * (i + 1) + k] = sums[3 * i + k] + l[3 * i + k] - h * h / 12 * c[k];
    }
    cubic_slopes(count, 3, t, sums, rates, work);
  }
}

static void fill_pieces(stack_piece *pieces, double base[3][3], double turn[4][3]) {
  for (unsigned j = 0; j < STACK_PATH_PIECES; j++) {
    memcpy(pieces[j].base, base, sizeof pieces[j].base);
    bezier_part(turn, (double)j / STACK_PATH_PIECES, (double)(j + 1) / STACK_PATH_PIECES, pieces[j].turn);
  }
}

/* SPHERICAL and GEODESIC. turns, rates, sums: [3 count] each. */
static batten_status path_between(batten_context *ctx, const stack *s, const double *t, double *scratch,
                                  stack_piece *pieces) {
  const double limit = 3.14159; /* beyond it the way is not determined by what measured frames hold */
  size_t count = s->count;
  double *turns = scratch, *rates = turns + 3 * count, *sums = rates + 3 * count, *work = sums + 3 * count;
  for (size_t i = 0; i + 1 < count; i++) {
    rotation_between(s->sections[i].rotation[0], s->sections[i + 1].rotation[0], turns + 3 * i);
    if (vec_norm(turns + 3 * i) > limit)
      return batten_fail(
          ctx, BATTEN_E_INVALID,
          "sections[%zu].rotation: half a turn from sections[%zu], which way is not determined; give a "
          "section between, or options.angular_velocity",
          i + 1, i);
  }
  if (s->rotation == BATTEN_ROTATION_SPHERICAL) smooth_rates(count, t, turns, rates, sums, work);
  for (size_t i = 0; i + 1 < count; i++) {
    double base[3][3], turn[4][3];
    const double *from = s->sections[i].rotation[0];
    if (s->rotation == BATTEN_ROTATION_SPHERICAL) {
      turn_hermite(from, s->sections[i + 1].rotation[0], rates + 3 * i, rates + 3 * (i + 1), t[i + 1] - t[i], base[0],
                   turn);
    } else {
      memcpy(base, from, sizeof base);
      bezier_line((const double[3]){0, 0, 0}, turns + 3 * i, turn);
    }
    fill_pieces(pieces + STACK_PATH_PIECES * i, base, turn);
  }
  return BATTEN_OK;
}

static batten_status path_logarithm(batten_context *ctx, const stack *s, stack_piece *pieces) {
  const double limit = 3.14159;
  double base[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, v[2][3] = {{0}}, turn[4][3];
  for (size_t i = 0; i < s->count; i++) {
    memcpy(v[0], v[1], sizeof v[0]);
    rotation_between(base[0], s->sections[i].rotation[0], v[1]);
    if (vec_norm(v[1]) > limit)
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "sections[%zu].rotation: half a turn from the axes of reference, where it has no logarithm; "
                         "take another options.rotation",
                         i);
    if (i == 0) continue;
    bezier_line(v[0], v[1], turn);
    fill_pieces(pieces + STACK_PATH_PIECES * (i - 1), base, turn);
  }
  return BATTEN_OK;
}

/* The steps of the integration are the pieces. scratch [4 count]; frames [pieces + 1][3][3]. */
static double path_velocity(const stack *s, const double *t, double *scratch, double *frames, stack_piece *pieces) {
  static_assert((int)STACK_PATH_PIECES == (int)ROTATION_STEPS, "a step of the integration is a piece");
  size_t count = s->count;
  const double *omega = s->angular_velocity;
  cubic_slopes(count, 3, t, omega, scratch, scratch + 3 * count);
  double drift =
      rotation_integrate(BATTEN_KINEMATICS_MAGNUS, count, t, omega, scratch, s->sections[0].rotation[0], frames);
  for (size_t i = 0; i + 1 < count; i++)
    for (unsigned j = 0; j < STACK_PATH_PIECES; j++) {
      stack_piece *p = pieces + STACK_PATH_PIECES * i + j;
      size_t k = STACK_PATH_PIECES * i + j;
      double a[3], b[3];
      cubic_value(count, 3, t, omega, scratch, p->t0, a, NULL);
      cubic_value(count, 3, t, omega, scratch, p->t1, b, NULL);
      turn_hermite(frames + 9 * k, frames + 9 * (k + 1), a, b, p->t1 - p->t0, p->base[0], p->turn);
    }
  return drift;
}

/* scratch: [7 count]. */
static void path_origins(const stack *s, const double *t, double *scratch, stack_piece *pieces) {
  size_t count = s->count;
  double *origins = scratch, *slopes = origins + 3 * count, *work = slopes + 3 * count;
  for (size_t i = 0; i < count; i++) memcpy(origins + 3 * i, s->sections[i].origin, 3 * sizeof *origins);
  cubic_slopes(count, 3, t, origins, slopes, work);
  for (size_t i = 0; i + 1 < count; i++) {
    const double *a = origins + 3 * i, *b = a + 3;
    double whole[4][3];
    if (s->path_kind == BATTEN_PATH_CUBIC)
      bezier_hermite(a, b, slopes + 3 * i, slopes + 3 * (i + 1), t[i + 1] - t[i], whole);
    else
      bezier_line(a, b, whole);
    for (unsigned j = 0; j < STACK_PATH_PIECES; j++)
      bezier_part(whole, (double)j / STACK_PATH_PIECES, (double)(j + 1) / STACK_PATH_PIECES,
                  pieces[STACK_PATH_PIECES * i + j].origin);
  }
}

static void fill_planes(stack_path *p, size_t count, const double *t) {
  for (size_t i = 0; i < count; i++)
    for (int side = 0; side < 2; side++) { /* the last piece before the section, the first one after it */
      stack_plane *plane = p->planes + i;
      size_t k = STACK_PATH_PIECES * i;
      if (k > 0 && (side == 0 || k == p->count)) k--;
      stack_frame f;
      stack_piece_frame(p->pieces + k, t[i], &f);
      plane->t = t[i];
      memcpy(plane->origin, f.origin, sizeof f.origin);
      memcpy(plane->rotation, f.rotation, sizeof f.rotation);
      memcpy(plane->slope[side], f.d_rotation[2], sizeof plane->slope[side]);
      plane->advance[side] = vec_dot(f.rotation[2], f.d_origin);
    }
}

/* The middle of what a section holds, in space. */
static void section_middle(const stack_section *section, double out[3]) {
  double lower[2] = {0, 0}, upper[2] = {0, 0}, middle[2];
  if (section->loops.count > 0) {
    memcpy(lower, section->loops.lower, sizeof lower);
    memcpy(upper, section->loops.upper, sizeof upper);
  } else if (section->apex_count > 0) {
    memcpy(lower, section->apex[0], sizeof lower);
    memcpy(upper, section->apex[section->apex_count - 1], sizeof upper);
  } else if (section->function) {
    batten_solid_box(section->function, lower, upper);
  }
  for (int k = 0; k < 2; k++) middle[k] = lower[k] / 2 + upper[k] / 2;
  for (int k = 0; k < 3; k++)
    out[k] = section->origin[k] + middle[0] * section->rotation[0][k] + middle[1] * section->rotation[1][k];
}

/* Of the origins; where they stand still, as in planes about an axis, of the sections' middles. */
static double speed_beside(const stack *s, unsigned end) {
  const stack_section *a = s->sections + (end ? s->count - 2 : 0), *b = a + 1;
  double middle[2][3], by_origin = vec_distance(a->origin, b->origin);
  section_middle(a, middle[0]);
  section_middle(b, middle[1]);
  double by_middle = vec_distance(middle[0], middle[1]), way = by_origin > 1e-9 * by_middle ? by_origin : by_middle;
  return way > 0 ? way / (b->t - a->t) : 1;
}

batten_status stack_path_make(batten_context *ctx, const stack *s, stack_path **out) {
  assert(s->count >= 2);
  size_t count = s->count, bytes;
  batten_status st = BATTEN_E_NOMEM;
  if (!batten_mul(count, STACK_PATH_PIECES * sizeof(stack_piece) + sizeof(stack_plane), &bytes) ||
      !batten_add(bytes, sizeof(stack_path), &bytes))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu sections", count);
  stack_path *p = batten_alloc(ctx, bytes);
  double *scratch = batten_alloc_array(ctx, count, 11 * sizeof *scratch);
  double *frames = NULL;
  if (!p || !scratch) goto done;
  double *t = scratch + 10 * count;
  *p = (stack_path){.ctx = ctx, .count = STACK_PATH_PIECES * (count - 1)};
  p->planes = (stack_plane *)(p->pieces + p->count);
  for (size_t i = 0; i < count; i++) t[i] = s->sections[i].t;
  for (size_t k = 0; k < p->count; k++) {
    size_t i = k / STACK_PATH_PIECES, j = k % STACK_PATH_PIECES;
    double h = (t[i + 1] - t[i]) / STACK_PATH_PIECES;
    p->pieces[k].t0 = t[i] + h * (double)j;
    p->pieces[k].t1 = j + 1 < STACK_PATH_PIECES ? t[i] + h * (double)(j + 1) : t[i + 1];
  }
  if (s->rotation == BATTEN_ROTATION_VELOCITY) {
    frames = batten_alloc_array(ctx, p->count + 1, 9 * sizeof *frames);
    if (!frames) goto done;
    p->drift = path_velocity(s, t, scratch, frames, p->pieces);
  } else {
    st = s->rotation == BATTEN_ROTATION_LOGARITHM ? path_logarithm(ctx, s, p->pieces)
                                                  : path_between(ctx, s, t, scratch, p->pieces);
    if (st < 0) goto done;
  }
  path_origins(s, t, scratch, p->pieces);
  for (size_t k = 0; k < p->count; k++) piece_bounds(p->pieces + k);
  fill_planes(p, count, t);
  for (unsigned end = 0; end < 2; end++) p->speeds[end] = speed_beside(s, end);
  *out = p;
  p = NULL;
  st = BATTEN_OK;
done:
  batten_free(ctx, frames);
  batten_free(ctx, scratch);
  batten_free(ctx, p);
  return st;
}

void stack_path_free(stack_path *p) {
  if (p) batten_free(p->ctx, p);
}

void stack_path_frame(const stack_path *p, double t, stack_frame *out) {
  size_t low = 0, high = p->count;
  while (high - low > 1) {
    size_t middle = low + (high - low) / 2;
    if (p->pieces[middle].t0 <= t)
      low = middle;
    else
      high = middle;
  }
  stack_piece_frame(p->pieces + low, t, out);
  if (t < p->pieces[0].t0 || t > p->pieces[p->count - 1].t1) { /* held */
    memset(out->d_origin, 0, sizeof out->d_origin);
    memset(out->d_rotation, 0, sizeof out->d_rotation);
  }
}

double stack_path_drift(const stack_path *p) { return p->drift; }

size_t stack_path_pieces(const stack_path *p, const stack_piece **pieces) {
  *pieces = p->pieces;
  return p->count;
}

size_t stack_path_planes(const stack_path *p, const stack_plane **planes) {
  *planes = p->planes;
  return p->count / STACK_PATH_PIECES + 1;
}

double stack_path_speed(const stack_path *p, unsigned end) { return p->speeds[end]; }
