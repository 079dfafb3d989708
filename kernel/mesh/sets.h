/* Disjoint sets of numbers, as a forest of parents; for kernel/mesh and kernel/network. A root is its own parent. */
#ifndef BATTEN_MESH_SETS_H
#define BATTEN_MESH_SETS_H

#include <stddef.h>
#include <stdint.h>

static inline void sets_start(size_t count, uint32_t *parent) {
  for (uint32_t i = 0; i < count; i++) parent[i] = i;
}

static inline uint32_t sets_find(uint32_t *parent, uint32_t i) {
  while (parent[i] != i) {
    parent[i] = parent[parent[i]];
    i = parent[i];
  }
  return i;
}

/* The lower root stays root, so that the outcome does not depend on the order of the unions. */
static inline void sets_join(uint32_t *parent, uint32_t i, uint32_t j) {
  i = sets_find(parent, i);
  j = sets_find(parent, j);
  if (i < j) parent[j] = i;
  if (j < i) parent[i] = j;
}

#endif
