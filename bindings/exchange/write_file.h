/* Output files: written beside their name and moved into place when whole.
 *
 *   bx_writer w;
 *   batten_status st = bx_create(&w, ctx, path);
 *   if (st == BATTEN_OK) { bx_put(&w, ...); bx_print(&w, ...); st = bx_commit(&w); }
 *
 * Errors stick: after the first, every call does nothing, and bx_commit returns it, removes what was written and
 * leaves an older file of that name as it was. So only bx_create and bx_commit need to be looked at. */
#ifndef BATTEN_EXCHANGE_WRITE_FILE_H
#define BATTEN_EXCHANGE_WRITE_FILE_H

#include <batten/base.h>
#include <stdbool.h>
#include <stdint.h>

typedef struct bx_writer {
  batten_context *ctx;
  const char *path; /* the caller's, for messages */
  char *target;     /* what is replaced: path with its symbolic links followed */
  char *part;       /* what is written; NULL = target itself, when it is a device or a pipe */
  int file;
  batten_status status;
  unsigned char *buffer;
  size_t used;
  uint64_t written; /* bytes handed over so far */
} bx_writer;

/* path stays the caller's until bx_commit. On failure nothing is left and bx_commit need not be called. */
batten_status bx_create(bx_writer *w, batten_context *ctx, const char *path);

void bx_put(bx_writer *w, const void *bytes, size_t count);
void bx_put_text(bx_writer *w, const char *text);

/* As printf, at most 1023 bytes; for text and integers. Floating-point numbers go through bx_put_number: printf's
 * decimal point depends on the locale. */
void bx_print(bx_writer *w, const char *format, ...) BATTEN_PRINTF(2, 3);

/* Little endian, whatever the machine. */
void bx_put_u8(bx_writer *w, uint8_t value);
void bx_put_u16(bx_writer *w, uint16_t value);
void bx_put_u32(bx_writer *w, uint32_t value);
void bx_put_u64(bx_writer *w, uint64_t value);
void bx_put_f32(bx_writer *w, float value);
void bx_put_f64(bx_writer *w, double value);

/* For code that must stop because of something else (a library's error, cancel): bx_commit then returns status. */
void bx_writer_fail(bx_writer *w, batten_status status);

/* Asks for cancel now and then, under the progress phase "write"; false when the writer has stopped. */
bool bx_goes_on(bx_writer *w, size_t done, size_t all);

/* Puts the whole file in its place, or removes it. Releases everything. */
batten_status bx_commit(bx_writer *w);

#endif
