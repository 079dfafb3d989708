/* The inside of a plan of fast multipole sums, for solvers/fmm only.
 *
 *   check.c      what can be wrong with a caller's arguments
 *   tree.c       cells: an octree (quadtree) of sources and targets together, points in the order of its leaves
 *   lists.c      which pairs of cells meet, and how: directly, or through the far field
 *   operators.c  the far field of a cell in few numbers, and what carries it to another; the same for all plans
 *   cells.c      the numbers of one cell: moments, translations, expansions
 *   passes.c     one product: up the tree, across, down again
 *   near.c, products.c   the inner loops, once per instruction set (lanes.h); radial.h the kernels
 *   direct.c     sums without a tree, and the judgement of a product by them
 *   fmm.c        the public calls
 *   evaluator.c  one sum at targets that come in batches; its map: evaluator.h */
#ifndef BATTEN_FMM_INNER_H
#define BATTEN_FMM_INNER_H

#include <batten/fmm.h>
#include <math.h>
#include <stdatomic.h>
#include <stdbool.h>

#include "fmm/lanes.h"

enum {
  FMM_KINDS = 64,      /* |offset| in {0 .. 3}^3; those that do not occur have no operator */
  FMM_CLASSES = 8,     /* parities of a product of polynomials */
  FMM_LEVELS_MAX = 200 /* of the tree: cells of 2^-200 of the whole */
};

/* Points of one role, one array for each axis. */
typedef struct fmm_points {
  size_t count;
  double *x[3];
  double *block; /* what x points into */
} fmm_points;

/* ---- operators.c ---- */

typedef struct fmm_operators {
  atomic_size_t owners;
  batten_context *ctx;
  unsigned n, order;
  size_t full;         /* order^n */
  size_t rank, stride; /* stride: rank, up to whole panels */
  unsigned classes;    /* 2^n */
  size_t class_full[FMM_CLASSES], class_rank[FMM_CLASSES];
  size_t class_first[FMM_CLASSES];   /* where a class begins among the members */
  size_t class_place[FMM_CLASSES];   /* ... and among the `rank` numbers */
  uint32_t *members;                 /* [full] entries of a tensor, class by class */
  double *reduce[FMM_CLASSES];       /* [class_full][class_rank] basis of a class */
  double *expand[FMM_CLASSES];       /* [class_rank][class_full] its transpose */
  double *transfer[FMM_KINDS];       /* panels [stride / FMM_PANEL][rank][FMM_PANEL]; NULL: no such kind */
  double *transfer_power[FMM_KINDS]; /* the same of r^power where the kernel has a logarithm */
  double node[FMM_ORDER_MAX];        /* Chebyshev nodes */
  double at_nodes[FMM_ORDER_MAX][FMM_ORDER_MAX];   /* [a][k] tau_a(node_k) */
  double from_nodes[FMM_ORDER_MAX][FMM_ORDER_MAX]; /* its transpose */
  double up[2][FMM_ORDER_MAX][FMM_ORDER_MAX];      /* [side][a][i]: moments of a child to those of its parent */
  double down[2][FMM_ORDER_MAX][FMM_ORDER_MAX];    /* its transpose: expansions of a parent to those of a child */
  double *block;                                   /* of the bases */
  size_t bytes;
} fmm_operators;

/* Order and relative cut of singular values that give an accuracy. */
typedef struct fmm_orders {
  unsigned order;
  double cut;
} fmm_orders;
fmm_orders batten_fmm_orders(const batten_radial *kernel, double accuracy, bool derivatives);
/* What the rank will be at most, roughly. */
size_t batten_fmm_rank_guess(const batten_radial *kernel, unsigned order);
/* Bytes of operators at the peak: while they are made, or later with `beside` numbers of somebody else. */
size_t batten_fmm_operator_bytes(const batten_radial *kernel, fmm_orders orders, size_t beside);

batten_status batten_fmm_operators_new(batten_context *ctx, const batten_radial *kernel, fmm_orders orders,
                                       fmm_operators **out);
fmm_operators *batten_fmm_operators_retain(fmm_operators *o);
void batten_fmm_operators_free(fmm_operators *o);

/* ---- tree.c ---- */

typedef struct fmm_cell {
  fmm_frame frame;
  uint32_t parent, child, children; /* the first child and how many; 0: a leaf */
  uint32_t level;
  size_t s0, s1, t0, t1; /* its sources and targets, in the order of the tree */
} fmm_cell;

typedef struct fmm_tree {
  size_t cells, leaves;
  unsigned levels;
  fmm_cell *cell; /* level by level, the children of a cell together */
  size_t level_first[FMM_LEVELS_MAX + 1];
  fmm_points sources, targets; /* in the order of the tree, points that no cell can part as one; x of targets */
  bool same;                   /* targets are the sources: targets has no block of its own */
  uint32_t *source_place, *target_place; /* where a point of the caller is; the same array when `same` */
} fmm_tree;

/* margin: the root holds the box of all points moved out by margin times its longest side. */
batten_status batten_fmm_tree_new(batten_context *ctx, unsigned n, const fmm_points *sources,
                                  const fmm_points *targets, bool same, double margin, size_t leaf_points,
                                  fmm_tree *tree);
void batten_fmm_tree_free(batten_context *ctx, fmm_tree *tree);

/* Whether centres of children are numbers, and the children not too deep. */
bool batten_fmm_can_part(unsigned n, const fmm_frame *frame, unsigned level);

static inline bool fmm_is_leaf(const fmm_cell *c) { return c->children == 0; }

/* Bit a: on the upper side of the centre along axis a. */
static inline unsigned fmm_octant(unsigned n, const fmm_frame *frame, const double *x) {
  unsigned o = 0;
  for (unsigned a = 0; a < n; a++) o |= (unsigned)(x[a] >= frame->centre[a]) << a;
  return o;
}

static inline fmm_frame fmm_child_frame(unsigned n, const fmm_frame *parent, unsigned octant) {
  fmm_frame f = {.half = parent->half / 2};
  for (unsigned a = 0; a < n; a++) f.centre[a] = parent->centre[a] + ((octant >> a & 1) ? f.half : -f.half);
  return f;
}

/* Centres are apart by no more than the sum of the halves along each axis. */
static inline bool fmm_side_by_side(unsigned n, const fmm_frame *a, const fmm_frame *b) {
  for (unsigned k = 0; k < n; k++)
    if (fabs(a->centre[k] - b->centre[k]) > a->half + b->half) return false;
  return true;
}

/* ---- lists.c ---- */

typedef struct fmm_translation {
  uint32_t target, source;
  uint32_t mirror; /* bit a: the offset along axis a is negative */
} fmm_translation;

/* Counts in begin[i + 1] to where list i begins in begin[i + 1]; who fills the lists leaves there where it ends.
 * Returns their whole length. */
size_t batten_fmm_begin_lists(size_t *begin, size_t count);

enum { FMM_LIST_NEAR, FMM_LIST_FROM_CELL, FMM_LIST_TO_CELL, FMM_LISTS, FMM_CHUNK_CELLS = 128 };

/* Of the cells, [cells + 1] begin each: sources of direct sums; cells whose far field is evaluated at the leaf's
 * targets; leaves whose sources are expanded in the cell. */
typedef struct fmm_lists {
  size_t *begin[FMM_LISTS];
  uint32_t *with[FMM_LISTS];
  /* Translations by chunk of FMM_CHUNK_CELLS targets of one level, then by kind. */
  size_t chunks;
  size_t *kind_begin; /* [chunks * FMM_KINDS + 1] */
  fmm_translation *translations;
  /* Leaves with targets, in tasks of about the same work. */
  size_t leaves, tasks;
  uint32_t *leaf;
  size_t *task_first; /* [tasks + 1] into leaf */
  size_t pairs;       /* terms of direct sums */
  size_t node_terms;  /* terms between points and the nodes of a cell */
} fmm_lists;

batten_status batten_fmm_lists_new(batten_context *ctx, unsigned n, size_t full, const fmm_tree *tree,
                                   fmm_lists *lists);
void batten_fmm_lists_free(batten_context *ctx, fmm_lists *lists);

/* ---- cells.c ---- */

enum {
  FMM_GROUP = 64,         /* tasks that run between two calls of the host's progress callback */
  FMM_CELLS_TOGETHER = 16 /* that a task of one level takes */
};

typedef struct fmm_far {
  const fmm_operators *o;
  const fmm_lanes *lanes;
} fmm_far;

/* Doubles that any of the functions below needs as scratch. */
size_t batten_fmm_scratch(const fmm_operators *o);

/* Weights and dipoles by the places that points have in the order of a tree (NULL: in their own), to
 * [1 + n][points->count]; equal points that are one there have their sum. */
void batten_fmm_set_terms(const fmm_points *points, const uint32_t *place, unsigned n, size_t sources,
                          const double *weights, const double *dipoles, double *to, fmm_terms *terms);
/* Moments and far fields of all cells: tensors [cells][full], outer [cells][stride]; scratch [FMM_GROUP][...]. */
batten_status batten_fmm_climb(batten_context *ctx, const fmm_far *f, const fmm_tree *tree, const fmm_terms *terms,
                               int dipoles, double *tensors, double *outer, double *scratch);
/* Moments of a child as its parent has them (matrices: up), or expansions the other way (down); in a or b. */
const double *batten_fmm_shift(const fmm_far *f, const fmm_frame *child, const fmm_frame *parent,
                               const double (*matrices)[FMM_ORDER_MAX][FMM_ORDER_MAX], const double *tensor,
                               double *a, double *b);
/* A tensor through a matrix along each axis; ends in one of the two. */
double *batten_fmm_through(const fmm_far *f, const double (*matrix)[FMM_ORDER_MAX], double *from, double *to);
/* Places of the nodes first .. first + count - 1 of a cell, x[axis][count]. */
void batten_fmm_place_nodes(const fmm_operators *o, const fmm_frame *frame, size_t first, size_t count, double *x[3]);
/* Which operator carries the far field between two cells of one level that are apart, and which axes it mirrors. */
unsigned batten_fmm_kind(unsigned n, const fmm_frame *target, const fmm_frame *source, uint32_t *mirror);
/* inner += C outer for translations of one level, of kind k those from kind_begin[k] on. factor: half a side to the
 * kernel's power; level: NULL, or what batten_fmm_level_transfer() gave. */
void batten_fmm_translate(const fmm_far *f, double factor, const double *level, const size_t *kind_begin,
                          const fmm_translation *translations, const double *outer, double *inner, double *scratch);
/* Kernels with a logarithm: C_t + ln h D_t for all kinds that there are, [kinds][stride * rank]; NULL without
 * memory. */
double *batten_fmm_level_transfer(batten_context *ctx, const fmm_operators *o, double half);
size_t batten_fmm_level_transfer_bytes(const fmm_operators *o);
/* tensor += U inner */
void batten_fmm_expand(const fmm_far *f, const double *inner, double *tensor, double *spare);
/* tensor += terms first .. last - 1, that are apart from the cell, by their sums at its nodes */
void batten_fmm_add_sources(const fmm_far *f, const fmm_frame *frame, fmm_near_function *near, const fmm_terms *terms,
                            size_t first, size_t last, double *tensor, double *scratch);

/* ---- passes.c ---- */

/* What a product works in. */
typedef struct fmm_work {
  double *terms;   /* [1 + n][sources] weights and dipoles in the order of the tree */
  double *tensors; /* [cells][full] moments, then expansions */
  double *outer;   /* [cells][stride] far fields of sources */
  double *inner;   /* [cells][stride] of targets */
  double *sums;    /* [FMM_SUMS][targets] */
  double *scratch; /* [FMM_GROUP][scratch_each] */
  size_t scratch_each;
  double *level_transfer[FMM_LEVELS_MAX]; /* kernels with a logarithm: [kinds][stride * rank] */
} fmm_work;

struct batten_fmm {
  batten_context *ctx;
  batten_radial kernel;
  double accuracy;
  int gradients, dipoles;
  fmm_points sources, targets; /* in the caller's order; sources.count etc. are the caller's */
  bool same;
  fmm_operators *operators; /* NULL: sums are direct */
  fmm_tree tree;
  fmm_lists lists;
  fmm_work work;
  batten_fmm_info info;
};

batten_status batten_fmm_work_new(batten_context *ctx, batten_fmm *f);
void batten_fmm_work_free(batten_context *ctx, fmm_work *work);
batten_status batten_fmm_passes(batten_context *ctx, batten_fmm *f, const double *weights, const double *dipoles,
                                bool gradients);

/* ---- direct.c ---- */

/* sums [FMM_SUMS][count]: over all sources at `count` targets, which ones `at` says (NULL: 0 .. count - 1). */
batten_status batten_fmm_direct(batten_context *ctx, const batten_fmm *f, const double *weights,
                                const double *dipoles, bool gradients, size_t count, const size_t *at, double *sums);

/* ---- fmm.c ---- */

/* One array for each axis; to->block is freed by the caller. */
batten_status batten_fmm_copy_points(batten_context *ctx, unsigned n, size_t count, const double *from,
                                     fmm_points *to);
/* Those of `share`, or new ones. */
batten_status batten_fmm_operators_get(batten_context *ctx, const batten_radial *kernel, fmm_orders orders,
                                       const batten_fmm *share, fmm_operators **out);

/* ---- check.c ---- */

/* Everything that can be wrong with the arguments of batten_fmm_create(); opt is not NULL. */
batten_status batten_fmm_check_plan(batten_context *ctx, const batten_radial *kernel, size_t source_count,
                                    const double *sources, size_t target_count, const double *targets,
                                    const batten_fmm_options *opt);
/* The same of points [count][n]. */
batten_status batten_fmm_check_points(batten_context *ctx, const char *name, unsigned n, size_t count,
                                      const double *points);
/* The same of weights [count] and dipoles [count][n]; NULL is fine. */
batten_status batten_fmm_check_weights(batten_context *ctx, size_t n, size_t count, const double *weights,
                                       const double *dipoles);
/* The same of what a product of a plan is given. */
batten_status batten_fmm_check_terms(batten_context *ctx, const batten_fmm *fmm, const double *weights,
                                     const double *dipoles);

#endif
