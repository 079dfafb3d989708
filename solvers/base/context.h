/* The context's inside, for solvers/base only; the rest of the house uses <batten/base.h> and checked.h. */
#ifndef BATTEN_BASE_CONTEXT_H
#define BATTEN_BASE_CONTEXT_H

#include <batten/base.h>

enum { BATTEN_ERROR_SIZE = 512 };

struct batten_context {
  batten_context_options options;
  size_t bytes, bytes_peak;
  char error[BATTEN_ERROR_SIZE];
};

#endif
