/* Normals of many points from the field of few.
 *
 * The field of least energy on a subset knows the whole, but no detail finer than the subset's spacing: in a wall
 * thinner than that it takes both sides for one sheet, with full confidence. The neighbour graph knows the detail,
 * but one wrong tie turns everything behind it. So:
 *
 *   1. The firmest ties alone, between planes that are sure, join the points to pieces in which the signs agree: a
 *      smooth closed surface is one piece, a plate with a rim of few points two.
 *   2. The signs of the largest pieces are those of the least misfit of Gauss's formula (orient_gauss.c), in which
 *      the whole set counts at full resolution. Where that does not decide, the field's votes do.
 *   3. All other points (sharp edges, noise, thin fingers of few points) hang on by ties, the firmest first; where
 * the settled points around agree with the field, its sign counts instead.
 *   4. Where planes are unsure and the field does not contradict the sign, its direction becomes the normal's.
 *
 * Left over are trees without any sure piece: the field turns them by the majority of their points. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/checked.h"
#include "orient.h"

/* Ties of sure pieces: 0.7 of their agreement is left. */
static const double FIRM = 0.3;
/* Pieces whose signs Gauss's formula settles: the largest by area, of so many points. */
enum { PIECES_MAX = 192, PIECE_POINTS = 24 };
/* Where the field's direction is further off the plane than 60 degrees it votes for nothing. */
static const double VOTE = 0.5;
/* A plane's direction is taken as it is. */
static const double SURE = 0.5;
/* Margin of a sign (0 to about 1) under which it counts as doubtful. */
static const double DOUBTFUL = 0.1;

static const size_t NONE = SIZE_MAX;

typedef struct refinement {
  const batten_orient_graph *g;
  batten_orient_forest *forest;
  const double *planes; /* [count][n] normals by planes */
  double *gradients;    /* [count][n] of the field; in the end the normals */
  double *normals;      /* [count][n] planes, turned to agree within a piece */
  size_t *piece;        /* [count] NONE: in no settled piece */
  signed char *vote;    /* [count] of the field, for the plane's own sign: 1, -1, 0 */
  size_t pieces;
  size_t member[PIECES_MAX]; /* a point of each */
  double votes[PIECES_MAX], by_planes[PIECES_MAX], margin[PIECES_MAX];
  signed char signs[PIECES_MAX];
  size_t doubtful;
} refinement;

static double dot(unsigned n, const double *a, const double *b) {
  double s = 0;
  for (unsigned c = 0; c < n; c++) s += a[c] * b[c];
  return s;
}

static void count_votes(refinement *r) {
  unsigned n = r->g->n;
  for (size_t i = 0; i < r->g->count; i++) {
    const double *v = r->gradients + i * n;
    double along = dot(n, v, r->g->plane + i * n), length = sqrt(dot(n, v, v));
    r->vote[i] = (signed char)(along > VOTE * length ? 1 : along < -VOTE * length ? -1 : 0);
  }
}

typedef struct candidate {
  size_t root, points;
  double area;
} candidate;

/* Larger ones first; equal ones by their root. */
static int compare_candidates(const void *a, const void *b) {
  const candidate *x = a, *y = b;
  if (x->area != y->area) return x->area < y->area ? 1 : -1;
  return (x->root > y->root) - (x->root < y->root);
}

/* Labels the largest trees, turns their planes. */
static batten_status find_pieces(batten_context *ctx, refinement *r) {
  const batten_orient_graph *g = r->g;
  unsigned n = g->n;
  candidate *found = NULL;
  size_t count = 0, *size = batten_alloc_array(ctx, g->count, sizeof *size);
  if (!size) return BATTEN_E_NOMEM;
  memset(size, 0, g->count * sizeof *size);
  bool opposed;
  for (size_t i = 0; i < g->count; i++) {
    size_t root = batten_orient_forest_root(r->forest, i, &opposed);
    if (++size[root] == PIECE_POINTS) count++;
  }
  batten_status status = (found = batten_alloc_array(ctx, count, sizeof *found)) ? BATTEN_OK : BATTEN_E_NOMEM;
  if (status < 0) goto done;
  count = 0;
  for (size_t i = 0; i < g->count; i++)
    if (size[i] >= PIECE_POINTS) found[count++] = (candidate){i, size[i], r->forest->total[i]};
  qsort(found, count, sizeof *found, compare_candidates);
  r->pieces = count < PIECES_MAX ? count : PIECES_MAX;
  for (size_t i = 0; i < g->count; i++) size[i] = NONE;
  for (size_t p = 0; p < r->pieces; p++) {
    r->member[p] = found[p].root;
    r->votes[p] = r->by_planes[p] = 0;
    size[found[p].root] = p;
  }
  for (size_t i = 0; i < g->count; i++) {
    size_t p = r->piece[i] = size[batten_orient_forest_root(r->forest, i, &opposed)];
    for (unsigned c = 0; c < n; c++) r->normals[i * n + c] = opposed ? -g->plane[i * n + c] : g->plane[i * n + c];
    if (p == NONE) continue;
    r->votes[p] += g->area[i] * (opposed ? -r->vote[i] : r->vote[i]);
    r->by_planes[p] += g->area[i] * dot(n, r->normals + i * n, r->planes + i * n);
  }
done:
  batten_free(ctx, found);
  batten_free(ctx, size);
  return status;
}

/* Whether there are settled neighbours and all have the sign that the field gives them. */
static bool field_is_right(const refinement *r, size_t i) {
  const batten_orient_graph *g = r->g;
  unsigned n = g->n;
  size_t right = 0, wrong = 0;
  for (size_t q = 0; q < g->k; q++) {
    size_t j = g->index[i * g->k + q], p = r->piece[j];
    if (p == NONE) continue;
    double along = dot(n, r->normals + j * n, r->gradients + j * n);
    right += along > 0;
    wrong += along < 0;
  }
  return right > 0 && wrong == 0;
}

/* Trees of points that hang on nothing settled: sum of the field's votes for the root's sign. */
static batten_status count_leftover(batten_context *ctx, refinement *r, double **sums) {
  double *sum = *sums = batten_alloc_array(ctx, r->g->count, sizeof *sum);
  if (!sum) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < r->g->count; i++) sum[i] = 0;
  bool opposed;
  for (size_t i = 0; i < r->g->count; i++) {
    size_t root = batten_orient_forest_root(r->forest, i, &opposed);
    sum[root] += opposed ? -r->vote[i] : r->vote[i];
  }
  return BATTEN_OK;
}

/* Steps 3 and 4. */
static batten_status hang_on(batten_context *ctx, refinement *r) {
  const batten_orient_graph *g = r->g;
  unsigned n = g->n;
  bool opposed;
  double *sum = NULL;
  for (size_t p = 1; p < r->pieces; p++) /* one tree of all that is settled */
    batten_orient_forest_tie(r->forest, r->member[0], r->member[p], r->signs[0] != r->signs[p]);
  batten_status status = batten_orient_forest_join(ctx, g, r->forest, INFINITY, 0.97);
  if (status >= 0) status = count_leftover(ctx, r, &sum);
  if (status < 0) return status;
  size_t settled = batten_orient_forest_root(r->forest, r->member[0], &opposed);
  double of_settled = opposed ? -r->signs[0] : r->signs[0];
  for (size_t i = 0; i < g->count; i++) {
    size_t root = batten_orient_forest_root(r->forest, i, &opposed), p = r->piece[i];
    double sign = root == settled ? of_settled : sum[root] < 0 ? -1 : 1;
    if (opposed) sign = -sign;
    bool doubtful = p == NONE ? root != settled || r->vote[i] == -sign : r->margin[p] < DOUBTFUL;
    if (g->area[i] > 0) r->doubtful += doubtful;
    for (unsigned c = 0; c < n; c++) r->normals[i * n + c] = sign * g->plane[i * n + c];
  }
  batten_free(ctx, sum);
  return BATTEN_OK;
}

static void choose_directions(refinement *r) {
  unsigned n = r->g->n; /* gradients of points before i are normals already: right for them */
  for (size_t i = 0; i < r->g->count; i++) {
    double *gradient = r->gradients + i * n;
    const double *normal = r->normals + i * n;
    double length = sqrt(dot(n, gradient, gradient));
    bool keep = r->g->flatness[i] > SURE || !(dot(n, gradient, normal) > VOTE * length) || !field_is_right(r, i);
    for (unsigned c = 0; c < n; c++) gradient[c] = keep ? normal[c] : gradient[c] / length;
  }
}

batten_status batten_orient_refine(batten_context *ctx, const batten_orient_graph *g, batten_orient_forest *forest,
                                   const double *planes, double *gradients, size_t *pieces, size_t *doubtful,
                                   bool *done) {
  refinement *r = batten_alloc(ctx, sizeof *r);
  batten_status status = BATTEN_E_NOMEM;
  if (!r) return status;
  *r = (refinement){.g = g, .forest = forest, .planes = planes, .gradients = gradients};
  if (!(r->normals = batten_alloc_array(ctx, g->count, g->n * sizeof *r->normals)) ||
      !(r->piece = batten_alloc_array(ctx, g->count, sizeof *r->piece)) || !(r->vote = batten_alloc(ctx, g->count)))
    goto done;
  count_votes(r);
  if ((status = batten_orient_forest_join(ctx, g, forest, FIRM, 0.9)) < 0) goto done;
  if ((status = find_pieces(ctx, r)) < 0) goto done;
  *done = r->pieces > 0;
  *pieces = r->pieces;
  if (!*done) goto done;
  status = batten_orient_gauss(ctx, g, r->normals, r->piece, r->pieces, r->votes, r->by_planes, r->signs, r->margin);
  if (status >= 0) status = hang_on(ctx, r);
  if (status < 0) goto done;
  choose_directions(r);
  *doubtful = r->doubtful;
done:
  batten_free(ctx, r->vote);
  batten_free(ctx, r->piece);
  batten_free(ctx, r->normals);
  batten_free(ctx, r);
  return status;
}
