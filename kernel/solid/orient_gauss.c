/* Signs of pieces by Gauss's formula.
 *
 * The winding number w(x) = 1 / (4 pi) sum_j a_j n_j . (x_j - x) / |x_j - x|^3 (in the plane 2 pi, |.|^2) of a closed
 * surface with outward normals n_j, areas a_j, is 1 inside, 0 outside and 1/2 at the points themselves. With signs
 * s_p of pieces and W_tp what piece p adds at point t,
 *
 *     misfit(s) = sum_t A_t (sum_p W_tp s_p - 1/2)^2
 *
 * is least for the right ones: both sides of a wall see each other, at any distance, which a subset's field cannot
 * see when the wall is thinner than its spacing, and no neighbour graph tells when the rim between them is not
 * sampled. The constant 1/2 settles outside and inside too. Errors of the areas scale w and change no sign.
 *
 * W is summed by a tree for each piece, whose cells count as one dipole when they lie far [Barill, Dickson, Schmidt,
 * Levin, Jacobson 2018, "Fast winding numbers for soups and clouds"]; the points stand in a tree's order, so cells
 * are halves of ranges. (In one tree for all, cells in which pieces mingle would have to be summed point by point,
 * from any distance.) Points t are a part of all, some of every piece. The signs: from several starts, the turn of a
 * piece or of two that lowers the misfit most, until none does. */
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "la/la.h"
#include "orient.h"

enum {
  LEAF = 16,
  DEPTH = 64,
  PLACES = 2048, /* 8000 points decide no sign otherwise with all of them */
  PLACES_OF_PIECE = 32,
  CHUNK = 32,
  SLICE = 32 * CHUNK,
  TURNS_MAX = 10000
};
/* Radius over distance of cells that count as one dipole: a hundredth of their part in w. */
static const double FAR = 0.4;
/* What the votes weigh beside the misfit: they decide where it does not. */
static const double VOTES = 0.02;

typedef struct cell {
  size_t low, high, left; /* left 0: a leaf, else the first of two children */
  double middle[3], radius, area, dipole[3];
} cell;

static const size_t NONE = SIZE_MAX;

typedef struct gauss {
  const batten_orient_graph *graph;
  const double *normals;
  const size_t *piece;
  size_t pieces;
  cell *cells;                 /* those of each piece behind its root; the roots come first */
  size_t *members;             /* [count] points by their pieces, in the order of the points within each */
  size_t *places, place_count; /* points t */
  double *weights;             /* [places] A_t */
  double *w;                   /* [places][pieces] sqrt(A_t) W */
  size_t first;
} gauss;

/* Sorts the points by their pieces: the roots of the pieces' trees. */
static void plant_trees(gauss *t) {
  for (size_t p = 0; p < t->pieces; p++) t->cells[p] = (cell){0};
  for (size_t i = 0; i < t->graph->count; i++)
    if (t->piece[i] != NONE) t->cells[t->piece[i]].high++;
  for (size_t p = 1; p < t->pieces; p++) t->cells[p].high += t->cells[p - 1].high;
  for (size_t p = 0; p < t->pieces; p++) t->cells[p].low = t->cells[p].high;
  for (size_t i = t->graph->count; i-- > 0;) /* low walks down to the piece's begin */
    if (t->piece[i] != NONE) t->members[--t->cells[t->piece[i]].low] = i;
}

static double distance(unsigned n, const double *a, const double *b) {
  double square = 0;
  for (unsigned d = 0; d < n; d++) square += (a[d] - b[d]) * (a[d] - b[d]);
  return sqrt(square);
}

/* What the points of a leaf, or the two children, come to. */
static void sum_up(const gauss *t, cell *k) {
  const batten_orient_graph *g = t->graph;
  unsigned n = g->n;
  const cell *children = t->cells + k->left;
  for (size_t q = k->low; q < k->high && !k->left; q++) {
    size_t i = t->members[q];
    k->area += g->area[i];
    for (unsigned d = 0; d < n; d++) {
      k->middle[d] += g->area[i] * g->surface[i * n + d];
      k->dipole[d] += g->area[i] * t->normals[i * n + d];
    }
  }
  for (const cell *child = children; k->left && child < children + 2; child++) {
    k->area += child->area;
    for (unsigned d = 0; d < n; d++) {
      k->middle[d] += child->area * child->middle[d];
      k->dipole[d] += child->dipole[d];
    }
  }
  for (unsigned d = 0; k->area > 0 && d < n; d++) k->middle[d] /= k->area;
  for (size_t q = k->low; q < k->high && !k->left; q++)
    k->radius = fmax(k->radius, distance(n, g->surface + t->members[q] * n, k->middle));
  for (const cell *child = children; k->left && child < children + 2; child++)
    k->radius = fmax(k->radius, child->radius + distance(n, child->middle, k->middle));
}

static void lay_cells(gauss *t) {
  plant_trees(t);
  size_t count = t->pieces;
  for (size_t c = 0; c < count; c++) {
    size_t low = t->cells[c].low, high = t->cells[c].high, mid = low + (high - low) / 2;
    if (high - low <= LEAF) continue;
    t->cells[c].left = count;
    t->cells[count++] = (cell){.low = low, .high = mid};
    t->cells[count++] = (cell){.low = mid, .high = high};
  }
  for (size_t c = count; c-- > 0;) sum_up(t, t->cells + c); /* children come behind their parents */
}

/* A dipole's part in w. core: squared radius of what it stands for, so that a near point counts no more than its disk
 * can. */
static double part(unsigned n, const double *dipole, const double *e, double square, double core) {
  double flux = 0;
  for (unsigned c = 0; c < n; c++) flux += dipole[c] * e[c];
  square += core;
  return n == 2 ? flux / (6.283185307179586 * square) : flux / (12.566370614359172 * square * sqrt(square));
}

/* What piece p adds at point `self`. */
static double of_piece(const gauss *t, size_t p, size_t self) {
  const batten_orient_graph *g = t->graph;
  unsigned n = g->n;
  size_t stack[DEPTH], top = 0;
  const double *x = g->surface + self * n;
  double sum = 0;
  stack[top++] = p;
  while (top > 0) {
    const cell *k = t->cells + stack[--top];
    double e[3], square = 0;
    for (unsigned c = 0; c < n; c++) {
      e[c] = k->middle[c] - x[c];
      square += e[c] * e[c];
    }
    if (k->radius * k->radius < FAR * FAR * square) {
      sum += part(n, k->dipole, e, square, 0);
    } else if (k->left) {
      stack[top++] = k->left;
      stack[top++] = k->left + 1;
    } else {
      for (size_t q = k->low; q < k->high; q++) {
        size_t i = t->members[q];
        if (i == self) continue;
        square = 0;
        for (unsigned c = 0; c < n; c++) {
          e[c] = g->surface[i * n + c] - x[c];
          square += e[c] * e[c];
        }
        double core = n == 2 ? g->area[i] * g->area[i] / 4 : g->area[i] / 3.141592653589793;
        if (square > 0) sum += g->area[i] * part(n, t->normals + i * n, e, square, core);
      }
    }
  }
  return sum;
}

static void add_places(void *task, size_t chunk) {
  const gauss *t = task;
  size_t begin = t->first + chunk * CHUNK,
         slice = t->first + SLICE < t->place_count ? t->first + SLICE : t->place_count;
  for (size_t place = begin; place < begin + CHUNK && place < slice; place++) {
    double root = sqrt(t->weights[place]);
    for (size_t p = 0; p < t->pieces; p++) t->w[place * t->pieces + p] = root * of_piece(t, p, t->places[place]);
  }
}

/* Every so many points of a piece one, which stands for the area of all since the last. of_piece [pieces][3] scratch:
 * points of the piece, points and area since the last place. */
static void choose_places(gauss *t, size_t stride, double *of_piece) {
  const batten_orient_graph *g = t->graph;
  memset(of_piece, 0, 3 * t->pieces * sizeof *of_piece);
  for (size_t i = 0; i < g->count; i++)
    if (t->piece[i] != NONE) of_piece[3 * t->piece[i]]++;
  t->place_count = 0;
  for (size_t i = 0; i < g->count; i++) {
    if (t->piece[i] == NONE) continue;
    double *p = of_piece + 3 * t->piece[i], step = fmin((double)stride, ceil(p[0] / PLACES_OF_PIECE));
    p[1]++;
    p[2] += g->area[i];
    if (p[1] < step) continue;
    t->places[t->place_count] = i;
    t->weights[t->place_count++] = p[2];
    p[1] = p[2] = 0;
  }
}

/* The form s'G s - h's - votes's, and its descent. slope [M]: (G s)_p of the present s. */
typedef struct form {
  size_t m;
  const double *g; /* [M][M] symmetric */
  const double *h; /* [M] with the votes */
  double *slope;
} form;

static double of_turn(const form *f, const signed char *s, size_t p) {
  double sp = s[p];
  return -4 * sp * (f->slope[p] - sp * f->g[p * f->m + p]) + 2 * sp * f->h[p];
}

static void turn(const form *f, signed char *s, size_t p) {
  for (size_t q = 0; q < f->m; q++) f->slope[q] -= 2 * s[p] * f->g[q * f->m + p];
  s[p] = (signed char)-s[p];
}

static double descend(const form *f, signed char *s) {
  size_t m = f->m;
  for (size_t p = 0; p < m; p++) {
    f->slope[p] = 0;
    for (size_t q = 0; q < m; q++) f->slope[p] += f->g[p * m + q] * s[q];
  }
  for (size_t round = 0; round < TURNS_MAX; round++) {
    size_t best = m, other = m;
    double least = 0;
    for (size_t p = 0; p < m; p++) {
      double change = of_turn(f, s, p);
      if (change < least) least = change, best = p, other = m;
    }
    for (size_t p = 0; best == m && p < m; p++)
      for (size_t q = 0; q < p; q++) {
        double change = of_turn(f, s, p) + of_turn(f, s, q) + 8 * s[p] * s[q] * f->g[p * m + q];
        if (change < least) least = change, best = p, other = q;
      }
    if (best == m || !(least < -1e-12 * f->g[best * m + best])) break;
    turn(f, s, best);
    if (other < m) turn(f, s, other);
  }
  double value = 0;
  for (size_t p = 0; p < m; p++) value += s[p] * (f->slope[p] - f->h[p]);
  return value;
}

/* Starts: as the votes say, as planes do, all as they are. */
static void settle(const form *f, const double *votes, const double *planes, const double *area, signed char *signs,
                   signed char *trial, double *margin) {
  const double *starts[] = {votes, planes, area};
  double least = INFINITY;
  for (int start = 0; start < 3; start++) {
    for (size_t p = 0; p < f->m; p++) trial[p] = starts[start][p] < 0 ? -1 : 1;
    double value = descend(f, trial);
    if (!(value < least)) continue;
    least = value;
    memcpy(signs, trial, f->m);
    for (size_t p = 0; p < f->m; p++) margin[p] = area[p] > 0 ? of_turn(f, trial, p) / area[p] : 0;
  }
}

batten_status batten_orient_gauss(batten_context *ctx, const batten_orient_graph *g, const double *normals,
                                  const size_t *piece, size_t pieces, const double *votes, const double *planes,
                                  signed char *signs, double *margin) {
  gauss t = {.graph = g, .normals = normals, .piece = piece, .pieces = pieces};
  size_t M = pieces, most = g->count < PLACES ? g->count : PLACES;
  double *matrix = NULL, *h = NULL;
  signed char *trial = NULL;
  batten_status status = BATTEN_E_NOMEM;
  most += (PLACES_OF_PIECE + 1) * M;
  /* halves of ranges of more than LEAF points: leaves hold LEAF / 2 or more, but for pieces that are one */
  if (!(t.cells = batten_alloc_array(ctx, 4 * (g->count / LEAF + 1) + M, sizeof *t.cells)) ||
      !(t.members = batten_alloc_array(ctx, g->count, sizeof *t.members)) ||
      !(t.places = batten_alloc_array(ctx, most, sizeof *t.places)) ||
      !(t.weights = batten_alloc_array(ctx, most, sizeof *t.weights)) ||
      !(t.w = batten_alloc_array(ctx, most, M * sizeof *t.w)) ||
      !(matrix = batten_alloc_array(ctx, M, M * sizeof *matrix)) ||
      !(h = batten_alloc_array(ctx, M, 3 * sizeof *h)) || !(trial = batten_alloc(ctx, M)))
    goto done;
  if ((status = batten_progress(ctx, "orient", 0.91)) < 0) goto done;
  lay_cells(&t);
  choose_places(&t, (g->count + PLACES - 1) / PLACES, h);
  for (; t.first < t.place_count; t.first += SLICE) {
    if ((status = batten_progress(ctx, "orient", 0.92 + 0.05 * (double)t.first / (double)t.place_count)) < 0)
      goto done;
    batten_parallel(ctx, SLICE / CHUNK, add_places, &t);
  }
  double *slope = h + M, *area = slope + M;
  memset(h, 0, 3 * M * sizeof *h);
  for (size_t i = 0; i < t.place_count; i++)
    for (size_t p = 0; p < M; p++) h[p] += sqrt(t.weights[i]) * t.w[i * M + p];
  for (size_t i = 0; i < g->count; i++)
    if (piece[i] != NONE) area[piece[i]] += g->area[i];
  for (size_t p = 0; p < M; p++) h[p] += VOTES * votes[p];
  batten_la_syrk(BATTEN_LA_DOUBLE, 'L', 'N', M, t.place_count, 1, t.w, M, 0, matrix, M);
  for (size_t p = 0; p < M; p++)
    for (size_t q = 0; q < p; q++) matrix[p * M + q] = matrix[q * M + p] = matrix[p + q * M];
  settle(&(form){M, matrix, h, slope}, votes, planes, area, signs, trial, margin);
done:
  batten_free(ctx, trial);
  batten_free(ctx, h);
  batten_free(ctx, matrix);
  batten_free(ctx, t.w);
  batten_free(ctx, t.weights);
  batten_free(ctx, t.places);
  batten_free(ctx, t.members);
  batten_free(ctx, t.cells);
  return status;
}
