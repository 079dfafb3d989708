/* The workspace of quadratic programs: a context of its own whose memory hooks keep freed blocks for the next solve,
 * so that everything below allocates in the usual way, LAPACK's wrappers included, and a solve that takes the same
 * sizes in the same order takes nothing from the host. */
#include "base/checked.h"
#include "base/context.h"
#include "engine.h"

/* Precedes every block that the inner context holds; as long as the alignment that batten_alloc() gives. */
typedef struct block {
  struct block *next; /* free blocks, last freed first */
  size_t bytes;       /* behind this header */
} block;
enum { HEADER = 64 };

struct batten_qp_workspace {
  batten_context *outer, *inner;
  block *free_blocks;
};

static void drop_free_blocks(batten_qp_workspace *w) {
  while (w->free_blocks) {
    block *b = w->free_blocks;
    w->free_blocks = b->next;
    batten_free(w->outer, b);
  }
}

/* Sizes come in classes, four to eight to an octave, from 8 pages up in pages. A kept block serves requests of its
 * own class alone: were it lent to smaller ones, the same solve done again could find it taken where it was free
 * before. */
static bool class_of(size_t bytes, size_t *size) {
  const size_t PAGE = 4096;
  size_t step = HEADER;
  while (step < PAGE && 8 * step <= bytes) step *= 2;
  if (!batten_add(bytes, step - 1, size)) return false;
  *size -= *size % step;
  return true;
}

static void *cache_allocate(void *user, size_t bytes) {
  batten_qp_workspace *w = user;
  if (!class_of(bytes, &bytes)) return NULL;
  block **kept = &w->free_blocks;
  while (*kept && (*kept)->bytes != bytes) kept = &(*kept)->next;
  block *taken;
  if (*kept) {
    taken = *kept;
    *kept = taken->next;
  } else {
    size_t all;
    if (!batten_add(bytes, HEADER, &all)) return NULL;
    taken = batten_alloc(w->outer, all);
    if (!taken && w->free_blocks) { /* what is kept from problems of other sizes must not stand in the way */
      drop_free_blocks(w);
      taken = batten_alloc(w->outer, all);
    }
    if (!taken) return NULL;
    taken->bytes = bytes;
  }
  return (char *)taken + HEADER;
}

static void cache_release(void *user, void *memory) {
  if (!memory) return;
  batten_qp_workspace *w = user;
  block *b = (block *)((char *)memory - HEADER);
  b->next = w->free_blocks;
  w->free_blocks = b;
}

static int forward_progress(void *user, const char *phase, double fraction) {
  return batten_progress(((batten_qp_workspace *)user)->outer, phase, fraction) < 0;
}

batten_status batten_qp_workspace_new(batten_context *ctx, batten_qp_workspace **out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!out) return batten_fail(ctx, BATTEN_E_INVALID, "out: NULL");
  batten_qp_workspace *w = batten_alloc(ctx, sizeof *w);
  if (!w) return BATTEN_E_NOMEM;
  *w = (batten_qp_workspace){.outer = ctx};
  batten_context_options o = ctx->options;
  o.allocate = cache_allocate;
  o.release = cache_release;
  o.memory_user = w;
  o.memory_limit = 0; /* the outer context keeps its own */
  o.progress = forward_progress;
  o.progress_user = w;
  if (batten_context_new(&o, &w->inner) < 0) {
    batten_free(ctx, w);
    return BATTEN_E_NOMEM;
  }
  *out = w;
  return BATTEN_OK;
}

void batten_qp_workspace_free(batten_qp_workspace *workspace) {
  if (!workspace) return;
  batten_context *outer = workspace->outer;
  batten_context_free(workspace->inner);
  drop_free_blocks(workspace);
  batten_free(outer, workspace);
}

batten_context *qp_context(batten_qp_workspace *workspace) { return workspace->inner; }
batten_context *qp_outer_context(batten_qp_workspace *workspace) { return workspace->outer; }
