/* The arguments of nodes in scenes: in the order of batten_frep_parts, and of the constructors in <batten/frep.h>. */
#ifndef BATTEN_EXCHANGE_JSON_LAYOUT_H
#define BATTEN_EXCHANGE_JSON_LAYOUT_H

#include <batten/frep.h>

enum { BX_NODE_MEMBERS = 6 };

typedef enum bx_node_shape {
  BX_NODE_NUMBER,  /* fallback: where it is left out; NAN = it must be there */
  BX_NODE_VECTOR,  /* [n] */
  BX_NODE_SHIFT,   /* [n]; left out: zeros */
  BX_NODE_MATRIX,  /* [n][n]; left out: the identity */
  BX_NODE_SPACE,   /* [3] */
  BX_NODE_AXES,    /* [2][3] */
  BX_NODE_FLAG,    /* left out: false */
  BX_NODE_AXIS,    /* 0, 1, 2 or "x", "y", "z" */
  BX_NODE_BELOW,   /* number; left out: -infinity */
  BX_NODE_ABOVE,   /* number; left out: infinity */
  BX_NODE_PATH,    /* [count][3] */
  BX_NODE_UP,      /* [3]; left out: zeros, which the kernel takes as any */
  BX_NODE_PLACES,  /* [count][n] */
  BX_NODE_CONTOURS /* [contours][points][2] */
} bx_node_shape;

typedef struct bx_node_layout {
  batten_frep_kind kind;
  unsigned children; /* the members "a" and "b" */
  unsigned n;        /* of the node; 0: as its children, or the length of its first vector */
  unsigned member_count;
  struct {
    const char *name;
    bx_node_shape shape;
    double fallback;
  } members[BX_NODE_MEMBERS];
} bx_node_layout;

/* NULL: a carrier or a solid, which are told otherwise. */
const bx_node_layout *bx_node_layout_of(batten_frep_kind kind);

#endif
