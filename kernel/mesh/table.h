/* A growing hash table from 64-bit keys to 32-bit numbers, and growing arrays; for kernel/mesh only. */
#ifndef BATTEN_MESH_TABLE_H
#define BATTEN_MESH_TABLE_H

#include <batten/base.h>
#include <stdint.h>

typedef struct batten_table {
  uint64_t *keys; /* TABLE_EMPTY where free */
  uint32_t *values;
  size_t count, capacity; /* capacity a power of two */
} batten_table;

/* The place of key's value, new with the value fresh when it was not there (*is_new, may be NULL); NULL: out of
 * memory. Valid until the next insertion. key != UINT64_MAX. */
uint32_t *batten_table_insert(batten_context *ctx, batten_table *table, uint64_t key, uint32_t fresh, int *is_new);
/* The place of key's value, or NULL. */
uint32_t *batten_table_find(const batten_table *table, uint64_t key);
void batten_table_free(batten_context *ctx, batten_table *table);

/* Room for count items of size bytes in *block, by doubling: BATTEN_OK or NOMEM. */
batten_status batten_reserve(batten_context *ctx, void **block, size_t *capacity, size_t count, size_t size);

/* Ascending, with room for as many keys in scratch. */
batten_status batten_sort_keys(batten_context *ctx, size_t count, uint64_t *keys);

#endif
