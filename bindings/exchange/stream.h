/* Input: a file, or a piece of memory, read once from front to back, by lines or by bytes; gzip is undone on the way.
 * Memory is bounded by the longest line, whatever the file declares. */
#ifndef BATTEN_EXCHANGE_STREAM_H
#define BATTEN_EXCHANGE_STREAM_H

#include <batten/base.h>
#include <stdbool.h>
#include <stdint.h>
#include <zlib.h>

typedef struct bx_reader {
  batten_context *ctx;
  const char *path; /* for messages and the extension */
  uint64_t size;    /* bytes of the file as it lies there, 0 = not known */
  uint64_t line;    /* number of the line that bx_next_line gave last */
  uint64_t offset;  /* of the next byte, counted behind decompression */
  char *text;       /* the line that bx_next_line gave last */
  /* inside */
  int file; /* -1: memory */
  const unsigned char *memory;
  size_t memory_left;
  uint64_t raw_read;
  bool raw_ended, ended, is_gzip, inflating;
  z_stream zip;
  unsigned char *raw;    /* compressed bytes, only with is_gzip */
  unsigned char *buffer; /* window on the content: [begin, end) is still to be read */
  size_t begin, end, capacity;
} bx_reader;

/* path (name) stays the caller's until bx_close, memory as well. On failure nothing is left. */
batten_status bx_open(bx_reader *r, batten_context *ctx, const char *path);
batten_status bx_open_memory(bx_reader *r, batten_context *ctx, const char *name, const void *data, size_t size);
void bx_close(bx_reader *r);

/* Is it plain, so that r->size is what can be read? */
bool bx_size_known(const bx_reader *r);

/* Makes count bytes (at most 64 KiB) available without reading them: *bytes points to *got <= count of them, fewer
 * only where the file ends. */
batten_status bx_peek(bx_reader *r, size_t count, const unsigned char **bytes, size_t *got);

/* The next count bytes, or FORMAT: "byte N: the file ends here; `what` is missing". */
batten_status bx_read_bytes(bx_reader *r, void *to, size_t count, const char *what);

/* Passes over a byte order mark of UTF-8, which may stand in front of all. */
batten_status bx_skip_mark(bx_reader *r);

/* The next line in r->text without its end (LF, CRLF or CR), or *end. A byte order mark before the first is dropped.
 * Refuses lines above 1 MiB and bytes of value 0. */
batten_status bx_next_line(bx_reader *r, bool *end);

/* Errors with the place: "path:line: ..." and "path: byte N: ...". FORMAT. */
batten_status bx_fail_line(bx_reader *r, const char *format, ...) BATTEN_PRINTF(2, 3);
batten_status bx_fail_byte(bx_reader *r, const char *format, ...) BATTEN_PRINTF(2, 3);

/* A path short enough for an error text: its end. */
const char *bx_short_path(const char *path);

/* ---- pieces of a line ---------------------------------------------------------------------------- */

const char *bx_skip_blanks(const char *at);

/* The blank-separated word at *at; its length, 0 at the end of the line. *at moves behind it. */
size_t bx_next_word(const char **at, const char **word);

/* Is the word (of that length) this text? */
bool bx_word_is(const char *word, size_t length, const char *text);

/* The next blank-separated number; `what` names it in the error. */
batten_status bx_next_number(bx_reader *r, const char **at, const char *what, double *out);
batten_status bx_next_integer(bx_reader *r, const char **at, const char *what, int64_t *out);

/* Why text (up to its end) is no number: the common part of the readers' errors. */
batten_status bx_fail_number(bx_reader *r, const char *what, const char *text, size_t length, bool integer);

enum { BX_QUOTE_SIZE = 40 };
/* Text for an error message: printable, at most 32 characters. Returns out. */
const char *bx_quote(const char *text, size_t length, char out[BX_QUOTE_SIZE]);

#endif
