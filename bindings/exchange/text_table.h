/* Tables of numbers in text, with or without a line of names: what the readers of points and of contours share.
 *
 * The separator is what the first line of a kind (names, numbers) uses: semicolons, else commas, else blanks. Without
 * names the number of columns decides: 2 = x y, 3 = x y z and, where normals are wanted, 4 = x y nx ny, 6 = x y z nx
 * ny nz. Names may also stand in a comment above the first numbers ("# x y z nx ny nz", "//X Y Z R G B"); columns
 * with other names are skipped. # % // begin comments.
 *
 * Tables of offsets (hulls of ships) name half-breadths, stations and waterlines: these become y, x and z. */
#ifndef BATTEN_EXCHANGE_TEXT_TABLE_H
#define BATTEN_EXCHANGE_TEXT_TABLE_H

#include "stream.h"

/* What a column means. */
typedef enum bx_role {
  BX_X,
  BX_Y,
  BX_Z,
  BX_NX,
  BX_NY,
  BX_NZ,
  BX_U,
  BX_V,
  BX_W,
  BX_T,
  BX_CONTOUR, /* a text */
  BX_STATION, /* these three stand for x, y and z when they have been found */
  BX_HALF_BREADTH,
  BX_WATERLINE,
  BX_ROLES
} bx_role;

typedef struct bx_field {
  const char *text;
  size_t length;
} bx_field;

typedef struct bx_table {
  bx_reader *r;
  unsigned wanted;     /* bits 1 << role of the roles that names may give */
  unsigned n;          /* coordinates that are asked for, 0 = open */
  const char *names;   /* what a line of names may hold, for messages: "x y z" */
  bool may_have_title; /* the first line may be a text that names no columns, as tables of airfoils have it */
  /* what has been found */
  size_t columns;          /* 0 = no line of numbers yet */
  int column_of[BX_ROLES]; /* -1 = none */
  /* the last row */
  double values[BX_ROLES]; /* of the roles that have a column */
  bx_field contour;        /* in the line */
  const char *head;        /* what follows the word of the last line "contour N" */
  /* inside */
  char separator;        /* of the numbers */
  bool named;            /* columns come from names */
  bool offsets;          /* of a table of offsets */
  bool half_breadths;    /* the last names had them */
  bool names_in_comment; /* which count only when they fit the numbers */
  size_t named_columns;
} bx_table;

typedef enum bx_line {
  BX_LINE_BLANK,   /* nothing on it */
  BX_LINE_COMMENT, /* or names in one */
  BX_LINE_NAMES,
  BX_LINE_HEAD, /* "contour N" */
  BX_LINE_ROW
} bx_line;

static inline bool bx_table_has(const bx_table *t, bx_role role) { return t->column_of[role] >= 0; }

/* Takes the line that the reader gave last. FORMAT names it and the column. */
batten_status bx_table_take(bx_table *t, bx_line *out);

#endif
