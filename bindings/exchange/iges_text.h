/* IGES 5.3 files: lines of fixed columns in five sections, whose entities are called by the caller's function. */
#ifndef BATTEN_EXCHANGE_IGES_TEXT_H
#define BATTEN_EXCHANGE_IGES_TEXT_H

#include "cad.h"
#include "write_file.h"

#include <stdbool.h>

enum { IGES_PARAMETER_COLUMNS = 64 };

/* An entity's place among the others. */
typedef enum iges_role {
  IGES_WHOLE, /* stands for itself */
  IGES_PART,  /* belongs to another one */
  IGES_PLANE  /* the same, in the parameter space of a surface */
} iges_role;

typedef struct iges_file {
  bx_writer *w;
  bool directory; /* the first pass */
  size_t entity;  /* that is at work, from 0 */
  size_t line;    /* of parameters so far */
  /* inside */
  unsigned type;
  iges_role role;
  const char *label;
  unsigned long number;
  size_t first; /* line of parameters of the entity */
  char text[IGES_PARAMETER_COLUMNS + 1];
  size_t used;
} iges_file;

/* How others refer to an entity. */
unsigned long iges_pointer(size_t entity);

/* One entity; the label (ASCII, at most 8) is shown to users with its number, which has 8 digits. */
void iges_begin(iges_file *f, unsigned type, iges_role role, const char *label, unsigned long number);
void iges_put_whole(iges_file *f, unsigned long value);
void iges_put_real(iges_file *f, double value);
void iges_put_reals(iges_file *f, const double *values, size_t count);
void iges_end(iges_file *f);

/* Entities 128 and 126, B-splines that are polynomial and not periodic. */
typedef struct iges_curve {
  unsigned degree;
  size_t knot_count;
  const double *knots, *points; /* [knot_count], [knot_count - degree - 1][3] */
  bool closed;
  const double *normal; /* [3] of the plane in which it lies; NULL: not said to lie in one */
  iges_role role;
  const char *label; /* as in iges_begin, with its number */
  unsigned long number;
} iges_curve;
void iges_put_surface(iges_file *f, const batten_surface_form *form, const bool closed[2]);
void iges_put_curve(iges_file *f, const iges_curve *curve);

/* A whole file. put is called twice and has to give the same entities both times; size and reach are the diagonal of
 * the box of what is written, and its largest coordinate. */
typedef void iges_put(iges_file *f, void *user);
void bx_write_iges(bx_writer *w, const bx_product *product, double size, double reach, iges_put *put, void *user);

#endif
