/* Orientation by least energy.   [Huang, Carr, Ju 2019, "Variational implicit point set surfaces" (VIPSS)]
 *
 * The normals are the unit gradients g for which the spline through the points (values near 0) has the least energy
 * g' M g, see orient_system.c. The problem is not convex; what finds the right valley:
 *
 *   lambda   weight of smoothing: f minimises |f|^2 + sum f(x_i)^2 / lambda. A large one passes over noise and
 *            uneven samples but blurs thin walls (1e-2, a sphere of diameter 1: values may leave 0 by some percent
 *            of the diameter). So lambda walks down from 1e-2 in the unit size, each step starts from the last
 *            one's result, and where no sign moved over a step, the orientation is settled. Where the normals get
 *            rougher instead (batten_orient_doubt), noise has taken over, and the step before counts.
 *   starts   at every lambda also the eigenvector of M's smallest eigenvalue, at the first also the local planes:
 *            the result of least energy goes on.
 *   pieces   a patch, a sheet or a component that is turned round as a whole is a valley of its own: the neighbour
 *            graph falls into pieces there; each is turned on trial, and stays so when that lowers the energy.
 *
 * At the end the extreme points tell outside from inside. */
#include "orient_energy.h"

#include <math.h>
#include <string.h>

#include "base/checked.h"

enum { TURN_ROUNDS = 4, TURNS_MAX = 64 };
/* Steps of lambda, unit size. The last is where r^3 still has digits to spare at some thousand points. */
static const double LAMBDA[] = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6};
enum { LAMBDAS = sizeof LAMBDA / sizeof *LAMBDA };
/* Neighbours whose normals agree by less belong to different pieces: 72 degrees beside the circle through both. */
static const double PIECE_AGREEMENT = 0.3;

static const double DOUBT_GROWTH = 0.05; /* over a step: what resolved features of 1 in 20 points may add */

typedef struct candidate {
  double *g, *mg; /* [N][n] */
  double energy;
} candidate;

static double dot(size_t count, const double *a, const double *b) {
  double s = 0;
  for (size_t i = 0; i < count; i++) s += a[i] * b[i];
  return s;
}

static void exchange(candidate *a, candidate *b) {
  candidate t = *a;
  *a = *b;
  *b = t;
}

/* Turns single pieces of best while that lowers the energy, the largest first. Work: trial, piece, size [N]. True
 * when something was turned. */
static bool turn_pieces(const batten_orient_graph *graph, const batten_orient_system *s, candidate *best,
                        candidate *trial, size_t *piece, size_t *size) {
  unsigned n = s->n;
  size_t pieces = batten_orient_pieces(graph, best->g, PIECE_AGREEMENT, piece);
  bool turned = false;
  memset(size, 0, pieces * sizeof *size);
  for (size_t i = 0; i < s->count; i++) size[piece[i]]++;
  for (size_t turn = 0; pieces > 1 && turn < pieces && turn < TURNS_MAX; turn++) {
    size_t p = 0;
    for (size_t q = 1; q < pieces; q++)
      if (size[q] > size[p]) p = q;
    size[p] = 0; /* tried */
    for (size_t i = 0; i < s->size; i++) trial->g[i] = piece[i / n] == p ? best->g[i] : 0;
    batten_orient_system_solve(s, trial->g, trial->mg);
    double change = 4 * (dot(s->size, trial->g, trial->mg) - dot(s->size, trial->g, best->mg));
    if (change >= -1e-6 * best->energy) continue;
    for (size_t i = 0; i < s->size; i++) {
      best->g[i] -= 2 * trial->g[i];
      best->mg[i] -= 2 * trial->mg[i];
    }
    best->energy += change;
    turned = true;
  }
  return turned;
}

/* Minimum at the system's lambda from best's gradients; then by turning pieces. */
static batten_status descend(batten_context *ctx, const batten_orient_graph *graph, const batten_orient_system *s,
                             double part, candidate *best, candidate *trial, size_t *piece, size_t *size) {
  batten_status status = batten_orient_minimize(ctx, s, part, best->g, best->mg, &best->energy);
  for (int round = 0; status >= 0 && round < TURN_ROUNDS && turn_pieces(graph, s, best, trial, piece, size); round++)
    status = batten_orient_minimize(ctx, s, part, best->g, best->mg, &best->energy);
  return status;
}

/* Number of vectors whose sign differs, the whole turned round or not. */
static size_t moved(unsigned n, size_t count, const double *g, const double *h) {
  size_t opposed = 0;
  for (size_t i = 0; i < count; i++) opposed += dot(n, g + i * n, h + i * n) < 0;
  return opposed < count - opposed ? opposed : count - opposed;
}

typedef struct workspace {
  candidate best, other, trial;
  double *last;         /* [N][n] best gradients of the last lambda */
  size_t *piece, *size; /* [N] */
} workspace;

/* The walk along lambda; ends with the result in best and the system factored at its lambda. */
static batten_status walk(batten_context *ctx, const batten_orient_graph *graph, batten_orient_system *s,
                          const double *start, workspace *w) {
  size_t bytes = s->size * sizeof(double);
  double least = INFINITY; /* doubt so far */
  memcpy(w->best.g, start, bytes);
  for (int step = 0; step < LAMBDAS; step++) {
    double part = 0.4 + 0.3 * (step + 0.5) / LAMBDAS; /* planes and what follows have the rest */
    batten_status status = batten_progress(ctx, "orient", part - 0.15 / LAMBDAS);
    if (status < 0) return status;
    status = batten_orient_system_factor(ctx, s, LAMBDA[step]);
    if (status == BATTEN_E_SINGULAR && step > 0) return batten_orient_system_factor(ctx, s, LAMBDA[step - 1]);
    if (status < 0) return status;
    memcpy(w->last, w->best.g, bytes);
    if ((status = descend(ctx, graph, s, part, &w->best, &w->trial, w->piece, w->size)) < 0) return status;
    if ((status = batten_orient_eigenvector(ctx, s, part, w->other.g)) < 0) return status;
    if ((status = descend(ctx, graph, s, part, &w->other, &w->trial, w->piece, w->size)) < 0) return status;
    if (w->other.energy < w->best.energy * (1 - 1e-6)) exchange(&w->best, &w->other);
    double doubt = batten_orient_doubt(graph, w->best.g);
    if (doubt > least + DOUBT_GROWTH) {
      memcpy(w->best.g, w->last, bytes);
      return batten_orient_system_factor(ctx, s, LAMBDA[step - 1]);
    }
    least = fmin(least, doubt);
    if (step > 0 && moved(s->n, s->count, w->best.g, w->last) == 0) break;
  }
  return BATTEN_OK;
}

void batten_orient_field_free(batten_context *ctx, batten_orient_field *field) {
  batten_free(ctx, field->points);
  batten_free(ctx, field->a);
  batten_free(ctx, field->b);
  batten_free(ctx, field->normals);
  *field = (batten_orient_field){0};
}

static batten_status field_new(batten_context *ctx, const batten_orient_system *s, const workspace *w,
                               batten_orient_field *field) {
  batten_orient_field f = {.n = s->n, .count = s->count, .lambda = s->lambda};
  batten_status status = BATTEN_E_NOMEM;
  if (!(f.points = batten_alloc_array(ctx, s->size, sizeof *f.points)) ||
      !(f.a = batten_alloc_array(ctx, s->count, sizeof *f.a)) ||
      !(f.b = batten_alloc_array(ctx, s->size, sizeof *f.b)) ||
      !(f.normals = batten_alloc_array(ctx, s->size, sizeof *f.normals)))
    goto done;
  memcpy(f.middle, s->middle, sizeof f.middle);
  memcpy(f.points, s->x, s->size * sizeof *f.points);
  double sign = batten_orient_outwardness(s->n, s->x, w->best.g, s->count, NULL) < 0 ? -1 : 1;
  for (size_t i = 0; i < s->size; i++) f.normals[i] = sign * w->best.g[i];
  status = batten_orient_system_field(ctx, s, f.normals, f.a, f.b, f.c);
done:
  if (status < 0) batten_orient_field_free(ctx, &f);
  *field = f;
  return status;
}

batten_status batten_orient_energy(batten_context *ctx, const batten_orient_graph *graph, const double *start,
                                   batten_orient_field *field) {
  batten_orient_system system = {0};
  workspace w = {0};
  size_t size = graph->count * graph->n;
  *field = (batten_orient_field){0};
  batten_status status = BATTEN_E_NOMEM;
  double *memory = batten_alloc_array(ctx, size, 7 * sizeof *memory);
  if (!memory || !(w.piece = batten_alloc_array(ctx, graph->count, 2 * sizeof *w.piece))) goto done;
  w.size = w.piece + graph->count;
  double **blocks[] = {&w.best.g, &w.best.mg, &w.other.g, &w.other.mg, &w.trial.g, &w.trial.mg, &w.last};
  for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) *blocks[i] = memory + i * size;
  if ((status = batten_orient_system_new(ctx, graph->n, graph->count, graph->points, &system)) < 0) goto done;
  if ((status = walk(ctx, graph, &system, start, &w)) < 0) goto done;
  status = field_new(ctx, &system, &w, field);
done:
  batten_orient_system_free(ctx, &system);
  batten_free(ctx, w.piece);
  batten_free(ctx, memory);
  return status;
}

typedef struct gradient_task {
  const batten_orient_field *field;
  const double *points;
  double *gradients;
  size_t first, last;
} gradient_task;

enum { LANES = 32, SLICE = 1024 * LANES };

/* A few points side by side, so that the loop over them fills vectors: 3 a r e - 3 (r b + e (e . b) / r). In the
 * plane the third coordinates are 0. */
static void find_gradients(void *task, size_t chunk) {
  const gradient_task *t = task;
  const batten_orient_field *f = t->field;
  unsigned n = f->n;
  size_t begin = t->first + chunk * LANES, count = t->last - begin < LANES ? t->last - begin : LANES;
  double x[3][LANES] = {{0}}, sum[3][LANES] = {{0}};
  for (size_t i = 0; i < count; i++)
    for (unsigned c = 0; c < n; c++) x[c][i] = t->points[(begin + i) * n + c] - f->middle[c];
  for (size_t j = 0; j < f->count; j++) {
    double y[3] = {0}, b[3] = {0}, a = f->a[j];
    for (unsigned c = 0; c < n; c++) y[c] = f->points[j * n + c], b[c] = f->b[j * n + c];
    for (size_t i = 0; i < LANES; i++) {
      double e0 = x[0][i] - y[0], e1 = x[1][i] - y[1], e2 = x[2][i] - y[2];
      double square = e0 * e0 + e1 * e1 + e2 * e2, r = sqrt(square);
      double radial = a * r - (e0 * b[0] + e1 * b[1] + e2 * b[2]) / (r + 1e-300); /* r = 0: 0 / 1e-300 */
      sum[0][i] += radial * e0 - r * b[0];
      sum[1][i] += radial * e1 - r * b[1];
      sum[2][i] += radial * e2 - r * b[2];
    }
  }
  for (size_t i = 0; i < count; i++)
    for (unsigned c = 0; c < n; c++) t->gradients[(begin + i) * n + c] = 3 * sum[c][i] + f->c[c];
}

batten_status batten_orient_field_gradients(batten_context *ctx, const batten_orient_field *field, size_t count,
                                            const double *points, double *gradients) {
  for (size_t first = 0; first < count; first += SLICE) {
    size_t last = first + SLICE < count ? first + SLICE : count;
    batten_status status = batten_progress(ctx, "orient", 0.7 + 0.2 * (double)first / (double)count);
    if (status < 0) return status;
    batten_parallel(ctx, (last - first + LANES - 1) / LANES, find_gradients,
                    &(gradient_task){field, points, gradients, first, last});
  }
  return BATTEN_OK;
}
