/* How the numbers of a carrier are called in documents, in the order of batten_carrier_parts. */
#ifndef BATTEN_EXCHANGE_JSON_CARRIER_H
#define BATTEN_EXCHANGE_JSON_CARRIER_H

#include <batten/carrier.h>

/* Carriers in carriers in ...: no deeper. The kernel nests 64 levels, and a simple carrier below them. */
enum { BX_CARRIER_DEPTH = 65, BX_CARRIER_MEMBERS = 4 };

typedef enum bx_member_shape { BX_NUMBER, BX_VECTOR /* [n] */, BX_MATRIX /* [n][n] */ } bx_member_shape;

typedef struct bx_carrier_layout {
  batten_carrier_kind kind;
  unsigned member_count;
  struct {
    const char *name;
    bx_member_shape shape;
  } members[BX_CARRIER_MEMBERS];
  unsigned child_count;
} bx_carrier_layout;

/* NULL for a kind that cannot be saved (callback). */
const bx_carrier_layout *bx_layout_of(batten_carrier_kind kind);
const bx_carrier_layout *bx_layout_named(const char *kind_name);

#endif
