/* The header of a PLY file, shared by its reading (ply_header.c) and the reading of what it describes (ply.c). */
#ifndef BATTEN_EXCHANGE_PLY_H
#define BATTEN_EXCHANGE_PLY_H

#include "soup.h"

typedef enum ply_type {
  PLY_NO_TYPE = 0,
  PLY_INT8,
  PLY_UINT8,
  PLY_INT16,
  PLY_UINT16,
  PLY_INT32,
  PLY_UINT32,
  PLY_FLOAT32,
  PLY_FLOAT64
} ply_type;

typedef enum ply_encoding { PLY_TEXT, PLY_LITTLE_ENDIAN, PLY_BIG_ENDIAN } ply_encoding;

typedef enum ply_role {
  PLY_SKIPPED = 0,
  PLY_X,
  PLY_Y,
  PLY_Z,
  PLY_NX,
  PLY_NY,
  PLY_NZ,
  PLY_U, /* these three where points are read; in meshes they are fields */
  PLY_V,
  PLY_W,
  PLY_FIELD,  /* another number of a vertex */
  PLY_CORNERS /* the list of a face */
} ply_role;

typedef struct ply_property {
  ply_type type;       /* of the value, or of a list's items */
  ply_type count_type; /* of a list's length; PLY_NO_TYPE = no list */
  ply_role role;
  char name[BX_NAME_SIZE];
} ply_property;

typedef struct ply_element {
  char name[BX_NAME_SIZE];
  int64_t count;
  size_t first_property, property_count;
} ply_element;

typedef struct ply_header {
  ply_encoding encoding;
  ply_element *elements;
  size_t element_count, element_capacity;
  ply_property *properties; /* of all elements, one after the other */
  size_t property_count, property_capacity;
} ply_header;

/* Reads up to end_header. ply_free_header also after a failure. */
batten_status ply_read_header(bx_reader *r, ply_header *h);
void ply_free_header(bx_reader *r, ply_header *h);

#endif
