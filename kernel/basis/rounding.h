/* Bounds of rounding errors for proofs. They hold in any rounding mode. */
#ifndef BATTEN_BASIS_ROUNDING_H
#define BATTEN_BASIS_ROUNDING_H

/* An operation's result is off by at most this times its size: twice what rounding to nearest does. */
static const double CERTIFY_EPS = 0x1p-52;
/* Above what all underflows of a sum together can lose; sizes are near 1. */
static const double CERTIFY_TINY = 0x1p-900;
/* What bounds of bounds are multiplied by, since these are rounded too. */
static const double CERTIFY_UP = 1 + 0x1p-30;

#endif
