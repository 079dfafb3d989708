/* Names: see names.h. Open addressing with linear steps; the text is compared only where 32 bits of the hash agree.
 */
#include "names.h"

#include "soup.h"

#include <stdbool.h>
#include <string.h>

void bx_names_free(bx_names *names) {
  batten_free(names->ctx, names->text);
  batten_free(names->ctx, names->starts);
  batten_free(names->ctx, names->slots);
  *names = (bx_names){.ctx = names->ctx};
}

/* FNV-1a, its upper half folded in: the slots are told by the lower bits. */
static uint32_t hash_of(const char *name, size_t length) {
  uint64_t hash = 0xcbf29ce484222325u;
  for (size_t i = 0; i < length; i++) hash = (hash ^ (unsigned char)name[i]) * 0x100000001b3u;
  return (uint32_t)(hash ^ hash >> 32);
}

const char *bx_names_get(const bx_names *names, size_t index) { return names->text + names->starts[index]; }

static bool is_name(const bx_names *names, uint32_t index, const char *name, size_t length) {
  size_t start = names->starts[index], end = index + 1 < names->count ? names->starts[index + 1] : names->used;
  return end - start == length + 1 && !memcmp(names->text + start, name, length);
}

size_t bx_names_find(const bx_names *names, const char *name, size_t length) {
  if (names->slot_count == 0) return SIZE_MAX;
  uint32_t hash = hash_of(name, length);
  size_t mask = names->slot_count - 1;
  for (size_t at = hash & mask;; at = (at + 1) & mask) {
    bx_name_slot slot = names->slots[at];
    if (slot.index == UINT32_MAX) return SIZE_MAX;
    if (slot.hash == hash && is_name(names, slot.index, name, length)) return slot.index;
  }
}

static void put(bx_name_slot *slots, size_t slot_count, bx_name_slot slot) {
  size_t mask = slot_count - 1, at = slot.hash & mask;
  while (slots[at].index != UINT32_MAX) at = (at + 1) & mask;
  slots[at] = slot;
}

static batten_status grow_slots(bx_names *names) {
  size_t wanted = names->slot_count ? 2 * names->slot_count : 64;
  bx_name_slot *slots = batten_alloc_array(names->ctx, wanted, sizeof *slots);
  if (!slots) return BATTEN_E_NOMEM;
  memset(slots, 0xff, wanted * sizeof *slots); /* every index UINT32_MAX */
  for (size_t i = 0; i < names->slot_count; i++)
    if (names->slots[i].index != UINT32_MAX) put(slots, wanted, names->slots[i]);
  batten_free(names->ctx, names->slots);
  names->slots = slots;
  names->slot_count = wanted;
  return BATTEN_OK;
}

batten_status bx_names_add(bx_names *names, const char *name, size_t length) {
  if (names->count >= UINT32_MAX - 1)
    return batten_fail(names->ctx, BATTEN_E_TOO_LARGE, "more than %lu names", (unsigned long)UINT32_MAX - 1);
  batten_status st = 2 * (names->count + 1) > names->slot_count ? grow_slots(names) : BATTEN_OK;
  void *text = names->text, *starts = names->starts;
  if (st == BATTEN_OK) st = bx_grow(names->ctx, &text, &names->text_capacity, names->used + length + 1, 1);
  names->text = text;
  if (st == BATTEN_OK)
    st = bx_grow(names->ctx, &starts, &names->start_capacity, names->count + 1, sizeof *names->starts);
  names->starts = starts;
  if (st != BATTEN_OK) return st;
  memcpy(names->text + names->used, name, length);
  names->text[names->used + length] = '\0';
  names->starts[names->count] = names->used;
  names->used += length + 1;
  put(names->slots, names->slot_count,
      (bx_name_slot){.hash = hash_of(name, length), .index = (uint32_t)names->count++});
  return BATTEN_OK;
}
