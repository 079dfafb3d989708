/* Names of unknowns and rows: each once, found by a hash table. */
#ifndef BATTEN_EXCHANGE_NAMES_H
#define BATTEN_EXCHANGE_NAMES_H

#include <batten/base.h>
#include <stdint.h>

typedef struct bx_name_slot {
  uint32_t hash, index; /* UINT32_MAX = empty */
} bx_name_slot;

/* {.ctx = ctx} is an empty list. */
typedef struct bx_names {
  batten_context *ctx;
  char *text; /* the names one behind the other, each with a NUL */
  size_t used, text_capacity;
  size_t *starts; /* [count] in text */
  size_t count, start_capacity;
  bx_name_slot *slots; /* [slot_count] a power of two, at most half full */
  size_t slot_count;
} bx_names;

void bx_names_free(bx_names *names);

/* Number of the name, SIZE_MAX = not there. */
size_t bx_names_find(const bx_names *names, const char *name, size_t length);

/* Appends a name that is not there. Fails: NOMEM, TOO_LARGE. */
batten_status bx_names_add(bx_names *names, const char *name, size_t length);

const char *bx_names_get(const bx_names *names, size_t index);

#endif
