/* MATLAB's level 5 files: see mat.h.
 *
 * A header of 128 bytes; then elements: 4 bytes type, 4 bytes size, data, filled up to 8 bytes. Up to 4 bytes of data
 * may stand in the tag itself, the size then in the upper half of the type. A variable is an element of type MATRIX
 * whose data are elements: flags, dimensions, name, then the numbers, or for sparse ones rows, starts, numbers. In a
 * COMPRESSED element the data are a zlib stream of one such element. Integers of any kind may hold what doubles are
 * meant to be: MATLAB stores whole numbers as the smallest type that takes them. */
#include "mat.h"

#include "base/checked.h"
#include "soup.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum {
  HEADER_SIZE = 128,
  WINDOW = 1 << 14,
  /* types of elements */
  INT8 = 1,
  UINT8 = 2,
  INT16 = 3,
  UINT16 = 4,
  INT32 = 5,
  UINT32 = 6,
  SINGLE = 7,
  DOUBLE = 9,
  INT64 = 12,
  UINT64 = 13,
  MATRIX = 14,
  COMPRESSED = 15,
  UTF8 = 16,
  /* classes of variables */
  CLASS_SPARSE = 5,
  CLASS_DOUBLE = 6,
  CLASS_UINT64 = 15,
  FLAG_COMPLEX = 1 << 11
};

typedef struct tag {
  uint32_t type;
  uint64_t size;
  bool small;
  unsigned char data[4]; /* with small */
} tag;

batten_status mat_fail(mat_reader *m, const char *format, ...) {
  char detail[256];
  va_list args;
  va_start(args, format);
  vsnprintf(detail, sizeof detail, format, args);
  va_end(args);
  if (!m->name[0]) return bx_fail_byte(m->r, "%s", detail);
  return bx_fail_byte(m->r, "variable '%s': %s", m->name, detail);
}

/* ---- bytes ----------------------------------------------------------------------------------------- */

static uint64_t integer(const mat_reader *m, const unsigned char *bytes, size_t size) {
  uint64_t value = 0;
  for (size_t i = 0; i < size; i++) value = value << 8 | bytes[m->big_endian ? i : size - 1 - i];
  return value;
}

static void *zip_allocate(void *ctx, unsigned count, unsigned size) { return batten_alloc_array(ctx, count, size); }
static void zip_release(void *ctx, void *block) { batten_free(ctx, block); }

/* count bytes of the element at hand, as they lie in the file. */
static batten_status read_raw(mat_reader *m, void *to, size_t count) {
  if (count > m->left) return mat_fail(m, "the element ends too early; the file is damaged");
  m->left -= count;
  return bx_read_bytes(m->r, to, count, "data of a variable");
}

/* Up to count bytes out of the compressed stream; *got = 0 at its end. */
static batten_status inflate_some(mat_reader *m, unsigned char *to, size_t count, size_t *got) {
  *got = 0;
  while (*got == 0 && !m->inflated) {
    if (m->zip.avail_in == 0 && m->left > 0) {
      size_t now = m->left < WINDOW ? (size_t)m->left : WINDOW;
      batten_status st = read_raw(m, m->packed, now);
      if (st != BATTEN_OK) return st;
      m->zip.next_in = m->packed;
      m->zip.avail_in = (unsigned)now;
    }
    m->zip.next_out = to;
    m->zip.avail_out = (unsigned)count;
    int result = inflate(&m->zip, Z_NO_FLUSH);
    *got = count - m->zip.avail_out;
    m->inflated = result == Z_STREAM_END;
    if (result == Z_MEM_ERROR) return BATTEN_E_NOMEM; /* the allocator has set the text */
    if (result == Z_BUF_ERROR && *got == 0 && m->left == 0)
      return mat_fail(m, "the compressed data end too early; the file is damaged");
    if (result != Z_OK && result != Z_STREAM_END && result != Z_BUF_ERROR)
      return mat_fail(m, "the compressed data are damaged (%s)", m->zip.msg ? m->zip.msg : "no details");
  }
  return BATTEN_OK;
}

static batten_status read_some(mat_reader *m, void *to, size_t count) {
  if (!m->compressed) return read_raw(m, to, count);
  unsigned char *at = to;
  while (count) {
    size_t got, now = count < WINDOW ? count : WINDOW;
    batten_status st = inflate_some(m, at, now, &got);
    if (st == BATTEN_OK && got == 0) st = mat_fail(m, "the compressed data end too early; the file is damaged");
    if (st != BATTEN_OK) return st;
    at += got;
    count -= got;
  }
  return BATTEN_OK;
}

/* The same, of the parts of a variable. */
static batten_status read_inside(mat_reader *m, void *to, size_t count) {
  if (count > m->inside) return mat_fail(m, "its parts are larger than the whole; the file is damaged");
  m->inside -= count;
  return read_some(m, to, count);
}

static batten_status skip_inside(mat_reader *m, uint64_t count) {
  unsigned char dropped[512];
  batten_status st = BATTEN_OK;
  while (st == BATTEN_OK && count) {
    size_t now = count < sizeof dropped ? (size_t)count : sizeof dropped;
    st = read_inside(m, dropped, now);
    count -= now;
  }
  return st;
}

/* ---- elements -------------------------------------------------------------------------------------- */

static void take_tag(const mat_reader *m, const unsigned char bytes[8], tag *out) {
  uint32_t first = (uint32_t)integer(m, bytes, 4);
  *out = (tag){.type = first, .size = integer(m, bytes + 4, 4), .small = first >> 16 != 0};
  if (!out->small) return;
  out->type = first & 0xffff;
  out->size = first >> 16;
  memcpy(out->data, bytes + 4, 4);
}

static batten_status read_part(mat_reader *m, tag *out) {
  unsigned char bytes[8];
  batten_status st = read_inside(m, bytes, sizeof bytes);
  if (st != BATTEN_OK) return st;
  take_tag(m, bytes, out);
  if (out->small && out->size > 4)
    return mat_fail(m, "%u bytes in a tag that has room for 4; the file is damaged", (unsigned)out->size);
  return BATTEN_OK;
}

static size_t size_of_type(uint32_t type) {
  switch (type) {
    case INT8:
    case UINT8:
      return 1;
    case INT16:
    case UINT16:
      return 2;
    case INT32:
    case UINT32:
    case SINGLE:
      return 4;
    case DOUBLE:
    case INT64:
    case UINT64:
      return 8;
    default:
      return 0;
  }
}

static double number(const mat_reader *m, uint32_t type, const unsigned char *bytes) {
  uint64_t bits = integer(m, bytes, size_of_type(type));
  uint32_t half = (uint32_t)bits;
  float single;
  double value;
  switch (type) {
    case INT8:
      return (int8_t)bits;
    case INT16:
      return (int16_t)bits;
    case INT32:
      return (int32_t)bits;
    case INT64:
      return (double)(int64_t)bits;
    case SINGLE:
      memcpy(&single, &half, sizeof single);
      return single;
    case DOUBLE:
      memcpy(&value, &bits, sizeof value);
      return value;
    default:
      return (double)bits;
  }
}

/* Data of a part: *count numbers of any type, in memory of the context that grows as they come. */
static batten_status read_numbers(mat_reader *m, const char *what, double **out, size_t *count) {
  enum { CHUNK = 2048 };
  unsigned char bytes[CHUNK];
  tag t;
  batten_status st = read_part(m, &t);
  if (st != BATTEN_OK) return st;
  size_t size = size_of_type(t.type), capacity = 0, done = 0;
  void *values = NULL;
  if (!size || t.size % size)
    return mat_fail(m, "%s of type %u and %llu bytes; numbers are expected", what, (unsigned)t.type,
                    (unsigned long long)t.size);
  for (uint64_t left = t.size; st == BATTEN_OK && left;) {
    size_t now = left < CHUNK ? (size_t)left : CHUNK, items = now / size;
    if (t.small)
      memcpy(bytes, t.data, now);
    else
      st = read_inside(m, bytes, now);
    if (st == BATTEN_OK) st = bx_grow(m->r->ctx, &values, &capacity, done + items, sizeof(double));
    for (size_t i = 0; st == BATTEN_OK && i < items; i++)
      ((double *)values)[done++] = number(m, t.type, bytes + i * size);
    left -= now;
  }
  if (st == BATTEN_OK && !t.small) st = skip_inside(m, (8 - t.size % 8) % 8);
  if (st != BATTEN_OK) {
    batten_free(m->r->ctx, values);
    return st;
  }
  *out = values;
  *count = done;
  return BATTEN_OK;
}

/* ---- variables ------------------------------------------------------------------------------------- */

/* Flags, dimensions and name; more than two dimensions come as rows = SIZE_MAX. */
static batten_status read_description(mat_reader *m, uint32_t *flags, size_t *rows, size_t *columns) {
  unsigned char bytes[8];
  double *dimensions = NULL, *letters = NULL;
  size_t dimension_count = 0, length = 0;
  tag t;
  batten_status st = read_part(m, &t);
  if (st == BATTEN_OK && (t.type != UINT32 || t.size != 8 || t.small))
    return mat_fail(m, "a variable without flags; the file is damaged");
  if (st == BATTEN_OK) st = read_inside(m, bytes, sizeof bytes);
  if (st != BATTEN_OK) return st;
  *flags = (uint32_t)integer(m, bytes, 4);
  st = read_numbers(m, "dimensions", &dimensions, &dimension_count);
  if (st == BATTEN_OK) st = read_numbers(m, "the name", &letters, &length);
  *rows = *columns = SIZE_MAX;
  if (st == BATTEN_OK && dimension_count == 2 && dimensions[0] >= 0 && dimensions[1] >= 0 &&
      dimensions[0] <= UINT32_MAX && dimensions[1] <= UINT32_MAX) {
    *rows = (size_t)dimensions[0];
    *columns = (size_t)dimensions[1];
  }
  if (st == BATTEN_OK) {
    size_t kept = length < MAT_NAME_SIZE ? length : MAT_NAME_SIZE - 1;
    for (size_t i = 0; i < kept; i++) m->name[i] = letters[i] >= 0x20 && letters[i] < 0x7f ? (char)letters[i] : '?';
    m->name[kept] = '\0';
  }
  batten_free(m->r->ctx, dimensions);
  batten_free(m->r->ctx, letters);
  return st;
}

static bool is_whole(double value, double upper) {
  return value >= 0 && value <= upper && !(value > (double)(uint64_t)value);
}

/* Are rows and starts those of a sparse matrix? More rows than its own count may be there: they are room. */
static batten_status check_sparse(mat_reader *m, mat_matrix *a, size_t rows_there, size_t starts_there) {
  if (a->columns + 1 != starts_there)
    return mat_fail(m, "%zu starts for %zu columns; the file is damaged", starts_there, a->columns);
  for (size_t j = 0; j <= a->columns; j++)
    if (!is_whole(a->starts[j], (double)a->count) || a->starts[j] < (j ? a->starts[j - 1] : 0) ||
        (j == 0 && a->starts[0] > 0))
      return mat_fail(m, "the start of column %zu is %g; the file is damaged", j, a->starts[j]);
  if (a->starts[a->columns] > (double)rows_there)
    return mat_fail(m, "%g entries with %zu rows; the file is damaged", a->starts[a->columns], rows_there);
  a->count = (size_t)a->starts[a->columns];
  for (size_t e = 0; e < a->count; e++)
    if (!is_whole(a->row_of[e], (double)a->rows - 1))
      return mat_fail(m, "entry %zu is in row %g of %zu; the file is damaged", e, a->row_of[e], a->rows);
  return BATTEN_OK;
}

static batten_status read_contents(mat_reader *m, uint32_t flags, mat_matrix *out) {
  unsigned class = flags & 0xff;
  size_t rows_there = 0, starts_there = 0, product;
  if (class != CLASS_SPARSE && (class < CLASS_DOUBLE || class > CLASS_UINT64))
    return mat_fail(m, "of class %u, where numbers are expected", class);
  if (flags & FLAG_COMPLEX) return mat_fail(m, "has complex numbers, where real ones are expected");
  if (out->rows == SIZE_MAX) return mat_fail(m, "has other than two dimensions");
  out->sparse = class == CLASS_SPARSE;
  batten_status st = BATTEN_OK;
  if (out->sparse) st = read_numbers(m, "rows", &out->row_of, &rows_there);
  if (st == BATTEN_OK && out->sparse) st = read_numbers(m, "starts", &out->starts, &starts_there);
  if (st == BATTEN_OK) st = read_numbers(m, "numbers", &out->values, &out->count);
  if (st != BATTEN_OK) return st;
  if (out->sparse) return check_sparse(m, out, rows_there, starts_there);
  if (!batten_mul(out->rows, out->columns, &product) || product != out->count)
    return mat_fail(m, "%zu numbers for %zu x %zu; the file is damaged", out->count, out->rows, out->columns);
  return BATTEN_OK;
}

/* A variable, behind its tag. */
static batten_status read_variable(mat_reader *m, bool (*wanted)(const char *name), mat_matrix *out, bool *found) {
  uint32_t flags = 0;
  batten_status st = read_description(m, &flags, &out->rows, &out->columns);
  if (st == BATTEN_OK) *found = wanted(m->name);
  if (st == BATTEN_OK && *found) st = read_contents(m, flags, out);
  if (st == BATTEN_OK) st = skip_inside(m, m->inside);
  return st;
}

/* The element behind its tag: a variable, plain or compressed, or something else, which is passed over. */
static batten_status read_element(mat_reader *m, const tag *t, bool (*wanted)(const char *name), mat_matrix *out,
                                  bool *found) {
  unsigned char bytes[512];
  tag inner = *t;
  batten_status st = BATTEN_OK;
  m->compressed = t->type == COMPRESSED;
  if (m->compressed) {
    m->inflated = false;
    m->zip.avail_in = 0;
    inflateReset(&m->zip);
    st = read_some(m, bytes, 8);
    if (st == BATTEN_OK) take_tag(m, bytes, &inner);
  }
  m->inside = inner.size;
  if (st == BATTEN_OK && inner.type == MATRIX && !inner.small && inner.size > 0)
    st = read_variable(m, wanted, out, found);
  /* To the end of the stream, where its checksum is. */
  for (size_t got = 1; st == BATTEN_OK && m->compressed && got;) st = inflate_some(m, bytes, sizeof bytes, &got);
  m->compressed = false;
  while (st == BATTEN_OK && m->left) st = read_raw(m, bytes, m->left < sizeof bytes ? (size_t)m->left : sizeof bytes);
  return st;
}

batten_status mat_next(mat_reader *m, bool (*wanted)(const char *name), mat_matrix *out, bool *end) {
  mat_matrix matrix = {0};
  bool found = false;
  batten_status st = BATTEN_OK;
  *end = false;
  while (st == BATTEN_OK && !found) {
    const unsigned char *ahead;
    unsigned char bytes[8];
    size_t got;
    tag t;
    m->name[0] = '\0';
    st = bx_peek(m->r, 1, &ahead, &got);
    *end = st == BATTEN_OK && got == 0;
    if (st != BATTEN_OK || *end) break;
    st = bx_read_bytes(m->r, bytes, sizeof bytes, "the tag of a variable");
    if (st != BATTEN_OK) break;
    take_tag(m, bytes, &t);
    m->left = t.small ? 0 : t.size;
    st = read_element(m, &t, wanted, &matrix, &found);
  }
  if (st == BATTEN_OK && found)
    *out = matrix;
  else
    mat_free(m->r->ctx, &matrix);
  return st;
}

void mat_free(batten_context *ctx, mat_matrix *matrix) {
  batten_free(ctx, matrix->values);
  batten_free(ctx, matrix->row_of);
  batten_free(ctx, matrix->starts);
  *matrix = (mat_matrix){0};
}

/* ---- the file -------------------------------------------------------------------------------------- */

static batten_status read_header(mat_reader *m) {
  const unsigned char *ahead;
  unsigned char header[HEADER_SIZE];
  size_t got;
  batten_status st = bx_peek(m->r, HEADER_SIZE, &ahead, &got);
  if (st != BATTEN_OK) return st;
  if ((got >= 8 && !memcmp(ahead, "\x89HDF\r\n\x1a\n", 8)) || (got >= 10 && !memcmp(ahead, "MATLAB 7.3", 10)))
    return bx_fail_byte(m->r, "a file of MATLAB 7.3 (HDF5); save it with -v7");
  if (got < HEADER_SIZE || !((ahead[126] == 'I' && ahead[127] == 'M') || (ahead[126] == 'M' && ahead[127] == 'I')))
    return bx_fail_byte(m->r, "this is no MATLAB file of level 5; save it with -v7");
  st = bx_read_bytes(m->r, header, HEADER_SIZE, "the header");
  m->big_endian = header[126] == 'M';
  if (st == BATTEN_OK && integer(m, header + 124, 2) != 0x0100)
    return bx_fail_byte(m->r, "a MATLAB file of version 0x%04x, known is 0x0100; save it with -v7",
                        (unsigned)integer(m, header + 124, 2));
  return st;
}

batten_status mat_begin(mat_reader *m, bx_reader *r) {
  *m = (mat_reader){.r = r};
  batten_status st = read_header(m);
  if (st != BATTEN_OK) return st;
  m->packed = batten_alloc(r->ctx, WINDOW);
  if (!m->packed) return BATTEN_E_NOMEM;
  m->zip = (z_stream){.zalloc = zip_allocate, .zfree = zip_release, .opaque = r->ctx};
  int result = inflateInit(&m->zip);
  m->inflating = result == Z_OK;
  if (m->inflating) return BATTEN_OK;
  mat_end(m);
  if (result == Z_MEM_ERROR) return BATTEN_E_NOMEM;
  return batten_fail(r->ctx, BATTEN_E_INTERNAL, "%s: zlib does not start (%d)", bx_short_path(r->path), result);
}

void mat_end(mat_reader *m) {
  if (m->inflating) inflateEnd(&m->zip);
  batten_free(m->r->ctx, m->packed);
  m->inflating = false;
  m->packed = NULL;
}
