/* Sections of solids on their way from files. */
#ifndef BATTEN_EXCHANGE_SECTIONS_H
#define BATTEN_EXCHANGE_SECTIONS_H

#include "stream.h"

#include <batten/exchange.h>

/* Something to be sorted (qsort): by key, equal ones by their numbers. */
typedef struct bx_ranked {
  double key;
  size_t index;
} bx_ranked;
int bx_by_key(const void *a, const void *b);

/* Room for a section's contours and points, which are its own; starts[0] and the frame are not set. */
batten_status bx_section_make(batten_context *ctx, size_t contours, size_t points, batten_section *out);
/* The arrays of a section that was made so, to be filled. */
size_t *bx_section_starts(const batten_section *section);
double *bx_section_points(const batten_section *section);

/* Contours in space, put together by their planes; closed: those with ends far apart are refused. FORMAT names path.
 */
batten_status bx_stack_contours(batten_context *ctx, const char *path, const batten_contours *c, bool closed,
                                batten_section_set *out);

/* Contours of a table of offsets, as the reader of contours leaves them: a section with both sides of the hull for
 * each station, and the deck. */
batten_status bx_stack_offsets(batten_context *ctx, const char *path, const batten_contours *c,
                               batten_section_set *out);

/* The planes in which points [count][3] in no order lie: one contour for each. FORMAT: points beside all planes. */
batten_status bx_find_cuts(bx_reader *r, size_t count, const double *points, batten_contours *out);

batten_status bx_read_json_sections(bx_reader *r, batten_section_set *out);

#endif
