/* The inside of a plan of fast multipole sums, for solvers/fmm only.
 *
 *   check.c      what can be wrong with a caller's arguments
 *   tree.c       cells: an octree (quadtree) of sources and targets together, points in the order of its leaves
 *   lists.c      which pairs of cells meet, and how: directly, or through the far field
 *   operators.c  the far field of a cell in few numbers, and what carries it to another; the same for all plans
 *   passes.c     one product: up the tree, across, down again
 *   near.c, products.c   the inner loops, once per instruction set (lanes.h); radial.h the kernels
 *   direct.c     sums without a tree, and the judgement of a product by them
 *   fmm.c        the public calls */
#ifndef BATTEN_FMM_INNER_H
#define BATTEN_FMM_INNER_H

#include <batten/fmm.h>
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

batten_status batten_fmm_tree_new(batten_context *ctx, unsigned n, const fmm_points *sources,
                                  const fmm_points *targets, bool same, size_t leaf_points, fmm_tree *tree);
void batten_fmm_tree_free(batten_context *ctx, fmm_tree *tree);

static inline bool fmm_is_leaf(const fmm_cell *c) { return c->children == 0; }

/* ---- lists.c ---- */

typedef struct fmm_translation {
  uint32_t target, source;
  uint32_t mirror; /* bit a: the offset along axis a is negative */
} fmm_translation;

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

enum { FMM_GROUP = 64 }; /* tasks that run between two calls of the host's progress callback */

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

/* ---- check.c ---- */

/* Everything that can be wrong with the arguments of batten_fmm_create(); opt is not NULL. */
batten_status batten_fmm_check_plan(batten_context *ctx, const batten_radial *kernel, size_t source_count,
                                    const double *sources, size_t target_count, const double *targets,
                                    const batten_fmm_options *opt);
/* The same of weights and dipoles. */
batten_status batten_fmm_check_weights(batten_context *ctx, const batten_fmm *fmm, const double *weights,
                                       const double *dipoles);

#endif
