/* Pieces of ISO 10303-21 (STEP): entities are numbered in the order in which they are written. */
#ifndef BATTEN_EXCHANGE_STEP_TEXT_H
#define BATTEN_EXCHANGE_STEP_TEXT_H

#include "write_file.h"

typedef struct step_text {
  bx_writer *w;
  uint64_t last; /* number of the last entity; 0 = none yet */
} step_text;

/* "#17=": begins the next entity and returns its number. */
uint64_t step_begin(step_text *s);
/* "#17" */
void step_put_reference(step_text *s, uint64_t entity);
/* Item i of a list, with what stands before it: "(#1", ",#2"; broken into lines. The caller closes the list. */
void step_put_item(step_text *s, size_t i, uint64_t entity);
/* "(#1,#2,...)", broken into lines. */
void step_put_references(step_text *s, const uint64_t *entities, size_t count);
void step_put_real(step_text *s, double value); /* always with a point, which many readers need */
void step_put_whole(step_text *s, uint64_t value);
/* A text of UTF-8 in its quotes: other letters than ASCII in the standard's own notation. */
void step_put_text(step_text *s, const char *text);
/* A whole entity of integers, texts and references; "#17=" and ";" are added. Returns its number. */
uint64_t step_print(step_text *s, const char *format, ...) BATTEN_PRINTF(2, 3);
/* #17=CARTESIAN_POINT('',(x,y,z)); */
uint64_t step_put_point(step_text *s, const double point[3]);

#endif
