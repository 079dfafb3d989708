/* The solid that moving sections sweep: f in space where planes are not parallel.  [Savchenko et al. 1995, section 4]
 *
 * A point p lies in the moving plane at every t where g(t) = n(t) . (p - o(t)) vanishes. Each such t gives it
 * coordinates in the frame there, and so a value F(x, y, t); f is the largest of these, so that the solid is the
 * union of all that the plane sweeps, whether planes cross within the sections or not. In every interval between
 * sections at whose ends g has different signs, one way or the other, there is a root; where g has the same sign at
 * both ends but falls towards zero from both, there may be two. A point that no plane has reached yet at the first
 * section (g_0
 * <= 0) or that the last one has not passed (g_last > 0) also has the value that the rule of that end gives: with the
 * roots that makes one place at least for every point.
 *
 * f is continuous but where two roots meet: on the envelope of the planes, the curve of centres about which the path
 * bends, at which the sweep folds back. It must lie outside of the sections for a solid without a fold. t_i of the
 * paper, d_1 / (d_1 + d_2) between neighbouring planes (RATIO), is the first guess of the root, which Newton's method
 * then follows within a bracket.
 *
 * Gradients follow from the implicit t: grad t = -n / g_t. */
#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "base/checked.h"
#include "mesh/vec.h"
#include "section/path.h"

enum {
  BLOCK = 4096, /* points whose places are found, then blended together */
  CHUNK = 128   /* points of a task: some tens of us at least */
};

/* What makes a point's place there; lift only where gradients are wanted. */
typedef struct swept_place {
  size_t point;
  int end; /* -1: between the sections; 0, 1: beyond that end */
  double beyond;
  double lift[3][3]; /* gradients of x, y, and t (or beyond) by p */
} swept_place;

/* A block on its way. */
typedef struct swept_block {
  const stack *s;
  const stack_plane *planes;
  const stack_piece *pieces;
  size_t count; /* points */
  const double *points;
  bool gradients;
  size_t *slots; /* [count + 1]: places slots[i] .. of point i; some stay empty: point = SIZE_MAX */
  swept_place *places;
  double *at; /* [..][3]: x, y, t */
} swept_block;

/* ---- one point ----------------------------------------------------------------------------------------------- */

static double plane_height(const stack_plane *plane, const double *p) {
  double d[3];
  vec_sub(p, plane->origin, d);
  return vec_dot(plane->rotation[2], d);
}

/* g' on the side of a plane. */
static double plane_slope(const stack_plane *plane, int side, const double *p) {
  double d[3];
  vec_sub(p, plane->origin, d);
  return vec_dot(plane->slope[side], d) - plane->advance[side];
}

/* May two roots lie between planes at which g has the same sign? It falls towards zero at both, and the tangents
 * there meet at zero or beyond. */
static bool may_dip(const stack_plane *planes, const double *p, double a, double b) {
  double sign = a > 0 ? 1 : -1, da = sign * plane_slope(planes, 1, p), db = sign * plane_slope(planes + 1, 0, p);
  if (!(da < 0 && db > 0)) return false;
  double h = planes[1].t - planes[0].t, left = sign * a, right = sign * b;
  double u = (right - left - db * h) / (da - db); /* where the tangents meet */
  return left + da * u <= 0;
}

/* Frame and g, g' at t in the interval i. */
static double moving_height(const swept_block *b, size_t i, const double *p, double t, stack_frame *f,
                            double *slope) {
  const stack_piece *piece = b->pieces + STACK_PATH_PIECES * i;
  for (int j = 1; j < STACK_PATH_PIECES && t >= piece[1].t0; j++) piece++;
  stack_piece_frame(piece, t, f);
  double d[3];
  vec_sub(p, f->origin, d);
  *slope = vec_dot(f->d_rotation[2], d) - vec_dot(f->rotation[2], f->d_origin);
  return vec_dot(f->rotation[2], d);
}

/* The root between t0 and t1, where g has the values g0 and g1 of different signs: Newton's method within a bracket.
 * Returns t; f: the frame there, *slope: g'. */
static double find_root(const swept_block *b, size_t i, const double *p, double t0, double g0, double t1, double g1,
                        stack_frame *f, double *slope) {
  double t = t0 + (t1 - t0) * (g0 / (g0 - g1)); /* |d_1| / (|d_1| + |d_2|) */
  t = fmin(fmax(t, t0), t1);
  const double least = 2 * DBL_EPSILON * fmax(fabs(t0), fabs(t1));
  for (int round = 0;; round++) {
    double g = moving_height(b, i, p, t, f, slope);
    if ((g > 0) == (g0 > 0))
      t0 = t;
    else
      t1 = t;
    double next = t - g / *slope;
    if (!(next >= t0 && next <= t1) || round >= 20) next = t0 + (t1 - t0) / 2;
    if (g == 0 || fabs(next - t) <= least || round >= 80) return t; /* 80: halves of any interval */
    t = next;
  }
}

/* Where sign g is least between the planes i and i + 1, unless a place where it is not positive comes first: *at, and
 * g there. g' changes its sign: the secant method on it within a bracket. */
static double find_dip(const swept_block *b, size_t i, const double *p, double sign, double *at) {
  double t0 = b->planes[i].t, t1 = b->planes[i + 1].t, g = sign, t = t0;
  double s0 = sign * plane_slope(b->planes + i, 1, p), s1 = sign * plane_slope(b->planes + i + 1, 0, p);
  for (int round = 0; round < 40; round++) {
    stack_frame f;
    double slope;
    t = round % 3 == 2 ? t0 + (t1 - t0) / 2 : t0 + (t1 - t0) * (s0 / (s0 - s1));
    g = moving_height(b, i, p, t, &f, &slope);
    slope *= sign;
    if (sign * g <= 0 || fabs(slope) * (t1 - t0) <= DBL_EPSILON * fabs(g)) break;
    if (slope < 0) {
      t0 = t;
      s0 = slope;
    } else {
      t1 = t;
      s1 = slope;
    }
  }
  *at = t;
  return g;
}

/* The place of p in the frame f at t, whose gradient by p is `rise`. */
static void put_place(const swept_block *b, size_t point, const stack_frame *f, double t, const double rise[3],
                      swept_place *place, double *at) {
  double d[3];
  vec_sub(b->points + 3 * point, f->origin, d);
  for (int k = 0; k < 2; k++) at[k] = vec_dot(f->rotation[k], d);
  at[2] = t;
  place->point = point;
  place->end = -1;
  if (!b->gradients) return;
  for (int k = 0; k < 2; k++) {
    double speed = vec_dot(f->d_rotation[k], d) - vec_dot(f->rotation[k], f->d_origin);
    for (int m = 0; m < 3; m++) place->lift[k][m] = f->rotation[k][m] + speed * rise[m];
  }
  memcpy(place->lift[2], rise, 3 * sizeof *rise);
}

/* A root between t0 and t1 in the interval i. */
static void put_root(const swept_block *b, size_t i, size_t point, double t0, double g0, double t1, double g1,
                     swept_place *place, double *at) {
  stack_frame f;
  double slope, rise[3];
  double t = find_root(b, i, b->points + 3 * point, t0, g0, t1, g1, &f, &slope);
  /* on the envelope t has no gradient */
  bool steep = fabs(slope) > 1e-12 * vec_norm(f.d_origin);
  for (int k = 0; k < 3; k++) rise[k] = steep ? -f.rotation[2][k] / slope : 0;
  put_place(b, point, &f, t, rise, place, at);
}

/* The paper's t: the ratio of the distances to both planes. */
static void put_ratio(const swept_block *b, size_t i, size_t point, double g0, double g1, swept_place *place,
                      double *at) {
  const stack_plane *plane = b->planes + i;
  double h = plane[1].t - plane[0].t, whole = g0 - g1, t = plane[0].t + h * (g0 / whole), slope, rise[3];
  stack_frame f;
  t = fmin(fmax(t, plane[0].t), plane[1].t);
  moving_height(b, i, b->points + 3 * point, t, &f, &slope);
  for (int k = 0; k < 3; k++)
    rise[k] = h * (g0 / whole * plane[1].rotation[2][k] - g1 / whole * plane[0].rotation[2][k]) / whole;
  put_place(b, point, &f, t, rise, place, at);
}

static void put_end(const swept_block *b, size_t point, int end, double height, swept_place *place, double *at) {
  const stack_plane *plane = b->planes + (end ? b->s->count - 1 : 0);
  double d[3];
  vec_sub(b->points + 3 * point, plane->origin, d);
  for (int k = 0; k < 2; k++) at[k] = vec_dot(plane->rotation[k], d);
  at[2] = plane->t;
  place->point = point;
  place->end = end;
  place->beyond = end ? height : -height;
  if (!b->gradients) return;
  memcpy(place->lift[0], plane->rotation[0], sizeof place->lift[0]);
  memcpy(place->lift[1], plane->rotation[1], sizeof place->lift[1]);
  for (int k = 0; k < 3; k++) place->lift[2][k] = end ? plane->rotation[2][k] : -plane->rotation[2][k];
}

/* ---- blocks -------------------------------------------------------------------------------------------------- */

/* How many places a point may have. */
static size_t count_places(const swept_block *b, const double *p) {
  size_t n = 0;
  double before = plane_height(b->planes, p);
  if (!(before > 0)) n++;
  for (size_t i = 0; i + 1 < b->s->count; i++) {
    double after = plane_height(b->planes + i + 1, p);
    if ((before > 0) != (after > 0))
      n++;
    else if (b->s->parameter == BATTEN_PARAMETER_ROOT && may_dip(b->planes + i, p, before, after))
      n += 2;
    before = after;
  }
  return n + (before > 0);
}

static void fill_places(const swept_block *b, size_t point) {
  const double *p = b->points + 3 * point;
  size_t k = b->slots[point];
  double before = plane_height(b->planes, p);
  if (!(before > 0)) put_end(b, point, 0, before, b->places + k, b->at + 3 * k), k++;
  for (size_t i = 0; i + 1 < b->s->count; i++) {
    double after = plane_height(b->planes + i + 1, p), t0 = b->planes[i].t, t1 = b->planes[i + 1].t;
    if ((before > 0) != (after > 0)) {
      if (b->s->parameter == BATTEN_PARAMETER_ROOT)
        put_root(b, i, point, t0, before, t1, after, b->places + k, b->at + 3 * k);
      else
        put_ratio(b, i, point, before, after, b->places + k, b->at + 3 * k);
      k++;
    } else if (b->s->parameter == BATTEN_PARAMETER_ROOT && may_dip(b->planes + i, p, before, after)) {
      double t, g = find_dip(b, i, p, before > 0 ? 1 : -1, &t);
      if ((g > 0) != (before > 0)) {
        put_root(b, i, point, t0, before, t, g, b->places + k, b->at + 3 * k);
        k++;
        put_root(b, i, point, t, g, t1, after, b->places + k, b->at + 3 * k);
        k++;
      }
    }
    before = after;
  }
  if (before > 0) put_end(b, point, 1, before, b->places + k, b->at + 3 * k), k++;
  for (; k < b->slots[point + 1]; k++) b->places[k].point = SIZE_MAX;
}

static void count_task(void *arg, size_t task) {
  swept_block *b = arg;
  for (size_t i = task * CHUNK; i < b->count && i < (task + 1) * CHUNK; i++)
    b->slots[i + 1] = count_places(b, b->points + 3 * i);
}

static void fill_task(void *arg, size_t task) {
  swept_block *b = arg;
  for (size_t i = task * CHUNK; i < b->count && i < (task + 1) * CHUNK; i++) fill_places(b, i);
}

/* The rules of the ends at a place between them: they may bound the solid already before its last plane. */
static void apply_ends(const stack *s, const double *at, double *value, double *gradient) {
  for (unsigned end = 0; end < 2; end++) {
    double speed = stack_path_speed(s->path, end), edge = s->sections[end ? s->count - 1 : 0].t;
    double by_t = end ? speed : -speed; /* d beyond / dt */
    if (gradient) gradient[2] /= by_t;
    stack_end_apply(s, end, at, (at[2] - edge) * by_t, value, gradient);
    if (gradient) gradient[2] *= by_t;
  }
}

/* Values and gradients of the places, the largest of each point. */
static void take_largest(const swept_block *b, size_t places, const double *blended, double *lifted, double *values,
                         double *gradients) {
  for (size_t i = 0; i < b->count; i++) values[i] = -INFINITY;
  for (size_t k = 0; k < places; k++) {
    const swept_place *place = b->places + k;
    double value = blended[k], *g = lifted ? lifted + 3 * k : NULL;
    if (place->end < 0) {
      apply_ends(b->s, b->at + 3 * k, &value, g);
    } else {
      if (g) g[2] = 0; /* held from the plane on */
      stack_end_apply(b->s, (unsigned)place->end, b->at + 3 * k, place->beyond, &value, g);
    }
    if (!(value > values[place->point])) continue;
    values[place->point] = value;
    for (int m = 0; g && m < 3; m++)
      gradients[3 * place->point + (size_t)m] =
          g[0] * place->lift[0][m] + g[1] * place->lift[1][m] + g[2] * place->lift[2][m];
  }
}

static batten_status evaluate_block(batten_context *ctx, swept_block *b, double *values, double *gradients) {
  batten_status st = BATTEN_E_NOMEM;
  size_t tasks = (b->count + CHUNK - 1) / CHUNK, places = 0;
  double *blended = NULL;
  b->places = NULL;
  b->at = NULL;
  batten_parallel(ctx, tasks, count_task, b);
  b->slots[0] = 0;
  for (size_t i = 0; i < b->count; i++) b->slots[i + 1] += b->slots[i];
  size_t slots = b->slots[b->count];
  b->places = batten_alloc_array(ctx, slots, sizeof *b->places);
  b->at = batten_alloc_array(ctx, slots, 3 * sizeof *b->at);
  blended = batten_alloc_array(ctx, slots, (b->gradients ? 4 : 1) * sizeof *blended);
  if (!b->places || !b->at || !blended) goto done;
  batten_parallel(ctx, tasks, fill_task, b);
  for (size_t k = 0; k < slots; k++) { /* close the gaps */
    if (b->places[k].point == SIZE_MAX) continue;
    if (places < k) {
      b->places[places] = b->places[k];
      memcpy(b->at + 3 * places, b->at + 3 * k, 3 * sizeof *b->at);
    }
    places++;
  }
  double *lifted = b->gradients ? blended + slots : NULL;
  st = stack_blend(b->s, ctx, places, b->at, blended, lifted);
  if (st < 0) goto done;
  take_largest(b, places, blended, lifted, values, gradients);
done:
  batten_free(ctx, blended);
  batten_free(ctx, b->at);
  batten_free(ctx, b->places);
  return st;
}

batten_status stack_swept_evaluate(const stack *s, batten_context *ctx, size_t count, const double *points,
                                   double *values, double *gradients) {
  if (count == 0 || (!values && !gradients)) return BATTEN_OK;
  size_t block = count < BLOCK ? count : BLOCK;
  size_t *slots = batten_alloc_array(ctx, block + 1, sizeof *slots);
  double *own = values ? NULL : batten_alloc_array(ctx, block, sizeof *own);
  batten_status st = slots && (values || own) ? BATTEN_OK : BATTEN_E_NOMEM;
  swept_block b = {.s = s, .gradients = gradients != NULL, .slots = slots};
  stack_path_planes(s->path, &b.planes);
  stack_path_pieces(s->path, &b.pieces);
  for (size_t first = 0; first < count && st >= 0; first += block) {
    b.count = count - first < block ? count - first : block;
    b.points = points + 3 * first;
    st = evaluate_block(ctx, &b, values ? values + first : own, gradients ? gradients + 3 * first : NULL);
  }
  batten_free(ctx, own);
  batten_free(ctx, slots);
  return st;
}
