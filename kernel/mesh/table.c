/* Hash table with open addressing and linear probing; growing arrays; radix sort. See table.h. */
#include "table.h"

#include <string.h>

#define TABLE_EMPTY UINT64_MAX

enum { TABLE_FIRST = 1024, RADIX_BITS = 11, RADIX = 1 << RADIX_BITS };

/* Keys are packed lattice coordinates, so neighbours differ in few bits: multiply and fold. */
static size_t home(uint64_t key, size_t capacity) {
  key *= 0x9e3779b97f4a7c15u;
  key ^= key >> 32;
  return (size_t)key & (capacity - 1);
}

static size_t probe(const batten_table *table, uint64_t key) {
  size_t i = home(key, table->capacity);
  while (table->keys[i] != TABLE_EMPTY && table->keys[i] != key) i = (i + 1) & (table->capacity - 1);
  return i;
}

static batten_status enlarge(batten_context *ctx, batten_table *table) {
  batten_table larger = {.capacity = table->capacity ? 2 * table->capacity : TABLE_FIRST, .count = table->count};
  larger.keys = batten_alloc_array(ctx, larger.capacity, sizeof *larger.keys);
  larger.values = larger.keys ? batten_alloc_array(ctx, larger.capacity, sizeof *larger.values) : NULL;
  if (!larger.values) {
    batten_free(ctx, larger.keys);
    return BATTEN_E_NOMEM;
  }
  memset(larger.keys, 0xff, larger.capacity * sizeof *larger.keys);
  for (size_t i = 0; i < table->capacity; i++) {
    if (table->keys[i] == TABLE_EMPTY) continue;
    size_t to = probe(&larger, table->keys[i]);
    larger.keys[to] = table->keys[i];
    larger.values[to] = table->values[i];
  }
  batten_table_free(ctx, table);
  *table = larger;
  return BATTEN_OK;
}

uint32_t *batten_table_insert(batten_context *ctx, batten_table *table, uint64_t key, uint32_t fresh, int *is_new) {
  if (2 * table->count >= table->capacity && enlarge(ctx, table) < 0) return NULL;
  size_t i = probe(table, key);
  int missing = table->keys[i] == TABLE_EMPTY;
  if (missing) {
    table->keys[i] = key;
    table->values[i] = fresh;
    table->count++;
  }
  if (is_new) *is_new = missing;
  return table->values + i;
}

uint32_t *batten_table_find(const batten_table *table, uint64_t key) {
  if (!table->capacity) return NULL;
  size_t i = probe(table, key);
  return table->keys[i] == key ? table->values + i : NULL;
}

void batten_table_free(batten_context *ctx, batten_table *table) {
  batten_free(ctx, table->keys);
  batten_free(ctx, table->values);
  *table = (batten_table){0};
}

batten_status batten_reserve(batten_context *ctx, void **block, size_t *capacity, size_t count, size_t size) {
  if (count <= *capacity) return BATTEN_OK;
  size_t larger = count / 2 > *capacity ? count : 2 * (*capacity) + 64;
  if (larger < count) larger = count;
  void *grown = batten_realloc_array(ctx, *block, larger, size);
  if (!grown) return BATTEN_E_NOMEM;
  *block = grown;
  *capacity = larger;
  return BATTEN_OK;
}

/* Digits that all keys share move nothing and are left out. */
batten_status batten_sort_keys(batten_context *ctx, size_t count, uint64_t *keys) {
  uint64_t *other = batten_alloc_array(ctx, count, sizeof *other), *from = keys, *to = other, varying = 0;
  size_t *start = other ? batten_alloc_array(ctx, RADIX + 1, sizeof *start) : NULL;
  for (size_t i = 1; i < count; i++) varying |= keys[i] ^ keys[0];
  for (int shift = 0; start && shift < 64; shift += RADIX_BITS) {
    if (!(varying >> shift & (RADIX - 1))) continue;
    memset(start, 0, (RADIX + 1) * sizeof *start);
    for (size_t i = 0; i < count; i++) start[((from[i] >> shift) & (RADIX - 1)) + 1]++;
    for (size_t i = 0; i < RADIX; i++) start[i + 1] += start[i];
    for (size_t i = 0; i < count; i++) to[start[(from[i] >> shift) & (RADIX - 1)]++] = from[i];
    uint64_t *t = from;
    from = to;
    to = t;
  }
  batten_status st = start ? BATTEN_OK : BATTEN_E_NOMEM;
  if (start && from != keys && count) memcpy(keys, from, count * sizeof *keys);
  batten_free(ctx, start);
  batten_free(ctx, other);
  return st;
}
