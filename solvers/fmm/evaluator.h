/* The inside of an evaluator of one sum at many points, for solvers/fmm only: sources in a tree, and above them a
 * second tree, of places where targets can be, whose nodes are made when a target first comes there (nodes.c).
 * batches.c takes the points of a batch to their nodes and sums there. */
#ifndef BATTEN_FMM_EVALUATOR_H
#define BATTEN_FMM_EVALUATOR_H

#include "fmm/fmm_inner.h"

/* A place of targets: an octant of its parent. What it holds is decided by the sources alone. */
typedef struct fmm_node {
  fmm_frame frame;
  uint32_t parent, level;
  uint32_t child[FMM_CLASSES]; /* 0: not made */
  bool is_leaf;                /* targets are summed here; else they go on to a child */
  uint32_t near_count;
  size_t near_begin;   /* its near cells, in nodes.near */
  size_t near_sources; /* in all of them */
  size_t visitors;     /* targets of the batch that is summed; 0 between batches */
} fmm_node;

enum {
  FMM_SLAB_NODES = 64,
  FMM_TOP_LEVELS = 5 /* of the sources' tree, whose cells points outside of the root use: see evaluator.c */
};

typedef struct fmm_nodes {
  size_t count, room;
  fmm_node *node; /* the root first */
  size_t near_count, near_room;
  uint32_t *near; /* cells of sources */
  size_t slabs, slab_room;
  double **slab; /* [slabs] -> [FMM_SLAB_NODES][full] expansions */
} fmm_nodes;

struct batten_fmm_evaluator {
  batten_context *ctx;
  batten_radial kernel;
  int gradients;
  size_t source_count;      /* the caller's */
  fmm_operators *operators; /* NULL: sums are direct */
  fmm_tree tree;            /* of sources; without operators only tree.sources, in the caller's order */
  double *term_block;
  fmm_terms terms;
  bool dipoles;  /* terms have them */
  double *outer; /* [cells][stride] far fields */
  size_t top_cells;
  double *top; /* [top_cells][full] far fields as weights at the nodes of the cell */
  double *level_transfer[FMM_LEVELS_MAX];
  size_t near_most;   /* sources in cells that could be cut, up to which a node is a leaf */
  size_t cache_bytes; /* that nodes may take */
  fmm_nodes nodes;
  batten_fmm_evaluator_info info;
};

static const uint32_t FMM_OUTSIDE = UINT32_MAX;

/* ---- nodes.c ---- */

static inline double *fmm_expansion(const batten_fmm_evaluator *e, size_t node) {
  return e->nodes.slab[node / FMM_SLAB_NODES] + node % FMM_SLAB_NODES * e->operators->full;
}

/* at [count]: the leaf of each point, points[which[i]] or points[i] where which is NULL; FMM_OUTSIDE beyond the root.
 * NOMEM also when nodes would take more than cache_bytes, unless `forced`; nodes that were there stay in any case. */
batten_status batten_fmm_nodes_find(batten_context *ctx, batten_fmm_evaluator *e, size_t count, const size_t *which,
                                    const double *points, bool forced, uint32_t *at);
void batten_fmm_nodes_drop(batten_fmm_evaluator *e);

/* ---- batches.c ---- */

/* values [count], gradients [count][n] or NULL. Partly written on failure. */
batten_status batten_fmm_batch(batten_context *ctx, batten_fmm_evaluator *e, size_t count, const double *points,
                               double *values, double *gradients);

#endif
