/* What is connected with what: components (an outer loop with its holes) of neighbouring sections that overlap, the
 * pieces that these make, and the components that the solid between sections cannot reach.
 *
 * A blend of two functions joins what overlaps. Discs of radius r whose centres are s apart thin to sqrt(1 - (s / 2
 * r)^2) of their width half way, and to nothing at s = 2 r, where they cease to overlap; how much of the smaller one
 * lies in both stands for s where components are no discs. Links join components that have no partner to the nearest
 * of the other section, but only across pieces: a component whose piece goes on elsewhere, such as the last section
 * of a lobe, has found its end. */
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "mesh/sets.h"
#include "section/section_inner.h"

/* Noted when less is left of the width. */
static const double THIN_SHARE = 2.0 / 3;

/* A component of a section. */
typedef struct component {
  size_t section, loop;
  double best[2]; /* share of the area in the best partner below, above; -1: no partner */
} component;

typedef struct search {
  batten_context *ctx;
  stack *s;
  size_t count;          /* components */
  component *components; /* [count] by section */
  size_t *first;         /* [sections + 1] */
  uint32_t *piece;       /* [count] sets */
} search;

/* ---- overlaps ------------------------------------------------------------------------------------ */

/* How far section i + 1 lies from section i, in the places that both have in common. */
static void shift_between(const stack *s, size_t i, double *shift) {
  double a[2], b[2];
  stack_shift(s, i, a);
  stack_shift(s, i + 1, b);
  for (int d = 0; d < 2; d++) shift[d] = b[d] - a[d];
}

static batten_status list_components(search *f) {
  const stack *s = f->s;
  size_t total = 0;
  for (size_t i = 0; i < s->count; i++)
    for (size_t k = 0; k < s->sections[i].loops.count; k++) total += s->sections[i].loops.depth[k] % 2 == 0;
  if (total > UINT32_MAX) return batten_fail(f->ctx, BATTEN_E_TOO_LARGE, "sections: %zu contours; too many", total);
  f->components = batten_alloc_array(f->ctx, total, sizeof *f->components);
  f->piece = batten_alloc_array(f->ctx, total, sizeof *f->piece);
  f->first = batten_alloc_array(f->ctx, s->count + 1, sizeof *f->first);
  if (!f->components || !f->piece || !f->first) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < s->count; i++) {
    f->first[i] = f->count;
    for (size_t k = 0; k < s->sections[i].loops.count; k++)
      if (s->sections[i].loops.depth[k] % 2 == 0) f->components[f->count++] = (component){i, k, {-1, -1}};
  }
  f->first[s->count] = f->count;
  sets_start(f->count, f->piece);
  return BATTEN_OK;
}

static void join_overlaps(search *f, size_t i) {
  const polygon_set *a = &f->s->sections[i].loops, *b = &f->s->sections[i + 1].loops;
  double shift[2];
  shift_between(f->s, i, shift);
  for (size_t p = f->first[i]; p < f->first[i + 1]; p++)
    for (size_t q = f->first[i + 1]; q < f->first[i + 2]; q++) {
      component *lower = &f->components[p], *upper = &f->components[q];
      double share;
      if (!polygon_components_overlap(a, lower->loop, b, upper->loop, shift, &share)) continue;
      lower->best[1] = fmax(lower->best[1], share);
      upper->best[0] = fmax(upper->best[0], share);
      sets_join(f->piece, (uint32_t)p, (uint32_t)q);
    }
}

/* What is left of the width between two discs of which this share is common to both. */
static double share_left(double share) {
  double low = 0, high = 1; /* the distance of the centres, over the diameter: decreasing */
  for (int k = 0; k < 50; k++) {
    double u = (low + high) / 2, common = 2 / 3.14159265358979323846 * (acos(u) - u * sqrt(1 - u * u));
    if (common > share)
      low = u;
    else
      high = u;
  }
  return sqrt(1 - low * low);
}

/* ---- links --------------------------------------------------------------------------------------- */

/* The distance of two outlines that lie apart: one of its ends is a vertex. */
static double outline_distance(const polygon_set *a, size_t loop_a, const polygon_set *b, size_t loop_b,
                               const double *shift, unsigned char *chosen) {
  double least = INFINITY;
  memset(chosen, 0, a->count);
  chosen[loop_a] = 1;
  for (size_t i = b->starts[loop_b]; i < b->starts[loop_b + 1]; i++) {
    const double x[2] = {b->points[2 * i] + shift[0], b->points[2 * i + 1] + shift[1]};
    least = fmin(least, polygon_distance_to(a, chosen, x));
  }
  memset(chosen, 0, b->count);
  chosen[loop_b] = 1;
  for (size_t i = a->starts[loop_a]; i < a->starts[loop_a + 1]; i++) {
    const double x[2] = {a->points[2 * i] - shift[0], a->points[2 * i + 1] - shift[1]};
    least = fmin(least, polygon_distance_to(b, chosen, x));
  }
  return least;
}

/* The component of the section above (below) that is nearest to component p, or SIZE_MAX. */
static size_t nearest_component(const search *f, size_t p, bool above, unsigned char *chosen) {
  const component *from = &f->components[p];
  size_t other = above ? from->section + 1 : from->section - 1, best = SIZE_MAX;
  size_t lower = above ? from->section : other;
  double least = INFINITY, shift[2];
  shift_between(f->s, lower, shift);
  const polygon_set *a = &f->s->sections[lower].loops, *b = &f->s->sections[lower + 1].loops;
  for (size_t q = f->first[other]; q < f->first[other + 1]; q++) {
    size_t to = f->components[q].loop;
    double d = outline_distance(a, above ? from->loop : to, b, above ? to : from->loop, shift, chosen);
    if (d >= least) continue;
    least = d;
    best = q;
  }
  return best;
}

static batten_status add_link(search *f, size_t lower, size_t upper) {
  stack *s = f->s;
  batten_stack_link link = {f->components[lower].section, {f->components[lower].loop, f->components[upper].loop}};
  for (size_t k = 0; k < s->link_count; k++)
    if (memcmp(&s->links[k], &link, sizeof link) == 0) return BATTEN_OK;
  batten_stack_link *links = batten_realloc_array(f->ctx, s->links, s->link_count + 1, sizeof *links);
  if (!links) return BATTEN_E_NOMEM;
  s->links = links;
  s->links[s->link_count++] = link;
  return BATTEN_OK;
}

static double component_shift(const search *f, size_t lower, size_t upper) {
  const component *a = &f->components[lower], *b = &f->components[upper];
  double area, from[2], to[2], shift[2];
  shift_between(f->s, a->section, shift);
  polygon_component_measure(&f->s->sections[a->section].loops, a->loop, &area, from);
  polygon_component_measure(&f->s->sections[b->section].loops, b->loop, &area, to);
  return hypot(to[0] + shift[0] - from[0], to[1] + shift[1] - from[1]);
}

/* Notes what is wrong with component p towards the section above (below); pieces are those of overlaps alone. */
static batten_status judge(search *f, size_t p, bool above, bool link, const uint32_t *piece, unsigned char *chosen,
                           stack_notes *notes, size_t *non_overlaps) {
  const component *c = &f->components[p];
  batten_stack_note note = {BATTEN_NOTE_NO_OVERLAP, c->section, f->s->sections[c->section].loops.given[c->loop],
                            above ? 1 : 0,          SIZE_MAX,   0};
  if (c->best[above] >= 0) {
    note.kind = BATTEN_NOTE_THIN;
    note.value = share_left(c->best[above]);
    return note.value < THIN_SHARE ? stack_note_add(notes, note) : BATTEN_OK;
  }
  ++*non_overlaps;
  size_t other = link ? nearest_component(f, p, above, chosen) : SIZE_MAX;
  if (other != SIZE_MAX && piece[other] != piece[p]) {
    const component *to = &f->components[other];
    size_t lower = above ? p : other, upper = above ? other : p;
    batten_status st = add_link(f, lower, upper);
    if (st < 0) return st;
    note.kind = BATTEN_NOTE_LINKED;
    note.other = f->s->sections[to->section].loops.given[to->loop];
    note.value = component_shift(f, lower, upper);
    sets_join(f->piece, (uint32_t)p, (uint32_t)other);
  }
  return stack_note_add(notes, note);
}

static int by_section(const batten_stack_link *a, const batten_stack_link *b) {
  if (a->section != b->section) return a->section < b->section ? -1 : 1;
  if (a->loop[0] != b->loop[0]) return a->loop[0] < b->loop[0] ? -1 : 1;
  return a->loop[1] < b->loop[1] ? -1 : a->loop[1] > b->loop[1];
}

static void sort_links(stack *s) {
  for (size_t i = 1; i < s->link_count; i++)
    for (size_t k = i; k > 0 && by_section(&s->links[k], &s->links[k - 1]) < 0; k--) {
      batten_stack_link swap = s->links[k];
      s->links[k] = s->links[k - 1];
      s->links[k - 1] = swap;
    }
}

/* ---- entry --------------------------------------------------------------------------------------- */

static batten_status judge_all(search *f, bool link, stack_notes *notes, size_t *non_overlaps) {
  size_t loops = 1;
  for (size_t i = 0; i < f->s->count; i++)
    if (f->s->sections[i].loops.count > loops) loops = f->s->sections[i].loops.count;
  unsigned char *chosen = batten_alloc_array(f->ctx, loops, 1);
  uint32_t *piece = batten_alloc_array(f->ctx, f->count, sizeof *piece);
  batten_status st = chosen && piece ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t p = 0; st >= 0 && p < f->count; p++) piece[p] = sets_find(f->piece, (uint32_t)p);
  for (size_t p = 0; st >= 0 && p < f->count; p++) {
    size_t i = f->components[p].section;
    for (int above = 0; st >= 0 && above < 2; above++) {
      size_t other = above ? i + 1 : i - 1; /* beyond the ends: none */
      if (other < f->s->count && f->s->sections[other].loops.count > 0)
        st = judge(f, p, above != 0, link, piece, chosen, notes, non_overlaps);
    }
  }
  batten_free(f->ctx, chosen);
  batten_free(f->ctx, piece);
  return st;
}

batten_status stack_find_components(batten_context *ctx, stack *s, bool link, stack_notes *notes, size_t *pieces,
                                    size_t *non_overlaps) {
  search f = {.ctx = ctx, .s = s};
  batten_status st = list_components(&f);
  if (st < 0) goto done;
  for (size_t i = 0; i + 1 < s->count; i++) join_overlaps(&f, i);
  *non_overlaps = 0;
  st = judge_all(&f, link, notes, non_overlaps);
  if (st < 0) goto done;
  sort_links(s);
  *pieces = 0;
  for (size_t p = 0; p < f.count; p++) *pieces += sets_find(f.piece, (uint32_t)p) == p;
done:
  batten_free(ctx, f.components);
  batten_free(ctx, f.piece);
  batten_free(ctx, f.first);
  return st;
}
