/* Multifrontal Cholesky: what analysis, factorisation and plan share.
 *
 * A supernode is a run of places (rows of blocks in the order of elimination) whose columns of the factor have the
 * same rows below. Its front is the dense lower triangle over its own places and those rows: the own columns of it
 * become columns of the factor (the panel), the rest, less what the own columns take off, is the update, which is
 * added to the front of the parent. Supernodes are numbered so that a subtree is a run that ends with its root. */
#ifndef BATTEN_SPARSE_FRONTS_H
#define BATTEN_SPARSE_FRONTS_H

#include "block.h"
#include "order.h"

/* Numbers count nodes unless said otherwise. */
typedef struct block_fronts {
  size_t nodes, count, size;
  uint32_t *order;    /* [nodes] node at a place */
  uint32_t *first;    /* [count + 1] first own place */
  uint32_t *parent;   /* [count] UINT32_MAX: root */
  uint32_t *subtree;  /* [count] supernodes in the subtree, itself included */
  size_t *row_starts; /* [count + 1] */
  uint32_t *rows;     /* places below the own ones, ascending */
  uint32_t *relative; /* of each such place: which row of the parent's front */
  size_t *panel;      /* [count + 1] doubles before the panel: columns of the front, own ones, one after the other */
  size_t *entry_starts;  /* [count + 1] */
  size_t *entries;       /* blocks of the matrix that belong to the panel: rows of them are columns there */
  size_t *targets;       /* doubles of all panels before the block's first */
  size_t height_most;    /* largest front, in unknowns */
  double flops, seconds; /* predicted */
} block_fronts;

static inline size_t block_front_own(const block_fronts *f, size_t s) { return f->first[s + 1] - f->first[s]; }
static inline size_t block_front_below(const block_fronts *f, size_t s) {
  return f->row_starts[s + 1] - f->row_starts[s];
}
/* Unknowns in the front: leading dimension of the panel. */
static inline size_t block_front_height(const block_fronts *f, size_t s) {
  return (block_front_own(f, s) + block_front_below(f, s)) * f->size;
}

/* Work and predicted time of a front with so many own unknowns and unknowns below. */
double block_front_flops(double own, double below);
double block_front_seconds(double own, double below);

/* Neighbours of all nodes. */
batten_status block_graph(batten_context *ctx, const block_matrix *a, sparse_graph *out);
/* Supernodes of the factor in this order of elimination, [rows], which is changed into an equivalent one. TOO_LARGE:
 * more than size_t or 32 bits can count. */
batten_status block_fronts_new(batten_context *ctx, const sparse_graph *g, unsigned size, const uint32_t *order,
                               block_fronts *out);
/* Where the matrix's blocks go. */
batten_status block_fronts_place(batten_context *ctx, const block_matrix *a, block_fronts *f);
void block_fronts_free(batten_context *ctx, block_fronts *f);
size_t block_fronts_bytes(const block_fronts *f);

/* The numbers: how the fronts are shared out, and memory for them. */
typedef struct block_work {
  size_t part_count;
  uint32_t *part;        /* [part_count] root supernodes of disjoint subtrees that are factored side by side */
  unsigned char *inside; /* [count] belongs to one of those */
  size_t *failed;        /* [part_count] what block_fronts_factor() would return of the part */
  size_t *update;        /* [count] doubles before the update of a supernode, where its parent finds it */
  size_t *scratch;       /* [count] where it is formed, above those of its children */
  size_t room;           /* doubles for updates in all */
  double *factor, *updates;
  double *vector, *front; /* [nodes * size], [height_most]: of solves */
} block_work;
batten_status block_work_new(batten_context *ctx, const block_fronts *f, block_work *out);
void block_work_free(batten_context *ctx, block_work *w);
size_t block_work_bytes(const block_fronts *f, const block_work *w);
/* 0, or 1 + the first node, by elimination, whose pivot is not positive. */
size_t block_fronts_factor(batten_context *ctx, const block_fronts *f, block_work *w, const block_matrix *a);
void block_fronts_solve(const block_fronts *f, const block_work *w, double *x);

#endif
