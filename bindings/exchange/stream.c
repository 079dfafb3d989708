/* Input: see stream.h.
 *
 * One window [begin, end) on the content; fill() shifts it to the front of the buffer and appends what read() or
 * inflate() give. Lines are handed out where they lie. Content is gzip when its first two bytes say so. */
#include "stream.h"

#include "base/checked.h"
#include "number.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum {
  WINDOW = 1 << 16,
  LINE_MAX_BYTES = 1 << 20, /* a polygon of 100,000 corners fits */
  PATH_SHOWN = 160,
  GZIP_WITH_HEADER = 15 + 16 /* inflateInit2: largest window, gzip header and checksum */
};

/* ---- errors ------------------------------------------------------------------------------------- */

const char *bx_short_path(const char *path) {
  size_t length = strlen(path);
  return length > PATH_SHOWN ? path + (length - PATH_SHOWN) : path;
}

batten_status bx_fail_line(bx_reader *r, const char *format, ...) {
  char detail[320];
  va_list args;
  va_start(args, format);
  vsnprintf(detail, sizeof detail, format, args);
  va_end(args);
  return batten_fail(r->ctx, BATTEN_E_FORMAT, "%s:%llu: %s", bx_short_path(r->path), (unsigned long long)r->line,
                     detail);
}

batten_status bx_fail_byte(bx_reader *r, const char *format, ...) {
  char detail[320];
  va_list args;
  va_start(args, format);
  vsnprintf(detail, sizeof detail, format, args);
  va_end(args);
  return batten_fail(r->ctx, BATTEN_E_FORMAT, "%s: byte %llu: %s", bx_short_path(r->path),
                     (unsigned long long)r->offset, detail);
}

static batten_status fail_errno(bx_reader *r, const char *what, int error) {
  char text[128];
  if (strerror_r(error, text, sizeof text)) snprintf(text, sizeof text, "error %d", error);
  const char *remedy = error == ENOENT   ? "; check the name"
                       : error == EACCES ? "; check its permissions"
                       : error == EISDIR ? "; name a file in it"
                                         : "";
  return batten_fail(r->ctx, BATTEN_E_IO, "%s: cannot %s: %s%s", bx_short_path(r->path), what, text, remedy);
}

/* ---- bytes -------------------------------------------------------------------------------------- */

static batten_status read_raw(bx_reader *r, unsigned char *to, size_t room, size_t *got) {
  *got = 0;
  double part = r->size ? (double)r->raw_read / (double)r->size : 0;
  batten_status st = batten_progress(r->ctx, "read", part < 1 ? part : 1);
  if (st != BATTEN_OK) return st;
  if (r->file < 0) {
    *got = room < r->memory_left ? room : r->memory_left;
    if (*got) memcpy(to, r->memory, *got);
    r->memory += *got;
    r->memory_left -= *got;
  } else {
    ssize_t count;
    do count = read(r->file, to, room);
    while (count < 0 && errno == EINTR);
    if (count < 0) return fail_errno(r, "read", errno);
    *got = (size_t)count;
  }
  r->raw_read += *got;
  r->raw_ended = *got == 0;
  return BATTEN_OK;
}

static void *zip_allocate(void *ctx, unsigned count, unsigned size) { return batten_alloc_array(ctx, count, size); }
static void zip_release(void *ctx, void *block) { batten_free(ctx, block); }

/* At the end of a gzip member: goes on with the next one, if there is one; anything else behind it is padding. */
static batten_status end_member(bx_reader *r) {
  if (r->zip.avail_in == 0) {
    size_t got;
    batten_status st = read_raw(r, r->raw, WINDOW, &got);
    if (st != BATTEN_OK) return st;
    r->zip.next_in = r->raw;
    r->zip.avail_in = (unsigned)got;
  }
  r->ended = r->zip.avail_in == 0 || r->zip.next_in[0] != 0x1f;
  if (!r->ended) inflateReset(&r->zip);
  return BATTEN_OK;
}

static batten_status inflate_some(bx_reader *r, unsigned char *to, size_t room, size_t *got) {
  *got = 0;
  while (*got == 0 && !r->ended) {
    if (r->zip.avail_in == 0) {
      size_t count;
      batten_status st = read_raw(r, r->raw, WINDOW, &count);
      if (st != BATTEN_OK) return st;
      if (count == 0) return bx_fail_byte(r, "the gzip data end too early; the file is cut off");
      r->zip.next_in = r->raw;
      r->zip.avail_in = (unsigned)count;
    }
    r->zip.next_out = to;
    r->zip.avail_out = (unsigned)room;
    int result = inflate(&r->zip, Z_NO_FLUSH);
    *got = room - r->zip.avail_out;
    if (result == Z_MEM_ERROR) return BATTEN_E_NOMEM; /* the allocator has set the text */
    if (result != Z_OK && result != Z_STREAM_END && result != Z_BUF_ERROR)
      return bx_fail_byte(r, "the gzip data are damaged (%s)", r->zip.msg ? r->zip.msg : "no details");
    if (result == Z_STREAM_END) {
      batten_status st = end_member(r);
      if (st != BATTEN_OK) return st;
    }
  }
  return BATTEN_OK;
}

/* Appends something to the window, or sets ended. */
static batten_status fill(bx_reader *r) {
  if (r->begin) {
    memmove(r->buffer, r->buffer + r->begin, r->end - r->begin);
    r->end -= r->begin;
    r->begin = 0;
  }
  if (r->end == r->capacity) {
    unsigned char *grown = batten_realloc_array(r->ctx, r->buffer, 2 * r->capacity + 1, 1);
    if (!grown) return BATTEN_E_NOMEM;
    r->buffer = grown;
    r->capacity *= 2;
  }
  size_t room = r->capacity - r->end, got = 0;
  batten_status st =
      r->is_gzip ? inflate_some(r, r->buffer + r->end, room, &got) : read_raw(r, r->buffer + r->end, room, &got);
  r->end += got;
  if (!r->is_gzip) r->ended = r->raw_ended;
  return st;
}

static batten_status peek_at_least(bx_reader *r, size_t count) {
  batten_status st = BATTEN_OK;
  while (st == BATTEN_OK && !r->ended && r->end - r->begin < count) st = fill(r);
  return st;
}

/* The window holds the first bytes: if they are gzip's, they become its input. */
static batten_status begin_gzip(bx_reader *r) {
  if (r->end < 2 || r->buffer[0] != 0x1f || r->buffer[1] != 0x8b) return BATTEN_OK;
  r->raw = batten_alloc(r->ctx, WINDOW);
  if (!r->raw) return BATTEN_E_NOMEM;
  memcpy(r->raw, r->buffer, r->end);
  r->zip = (z_stream){.zalloc = zip_allocate, .zfree = zip_release, .opaque = r->ctx, .next_in = r->raw};
  r->zip.avail_in = (unsigned)r->end;
  r->end = 0;
  r->is_gzip = true;
  r->ended = false;
  int result = inflateInit2(&r->zip, GZIP_WITH_HEADER);
  r->inflating = result == Z_OK;
  if (result == Z_MEM_ERROR) return BATTEN_E_NOMEM;
  if (result != Z_OK)
    return batten_fail(r->ctx, BATTEN_E_INTERNAL, "%s: zlib does not start (%d)", bx_short_path(r->path), result);
  return BATTEN_OK;
}

static batten_status begin(bx_reader *r) {
  r->buffer = batten_alloc(r->ctx, WINDOW + 1); /* one more: a line's NUL at the end of the window */
  r->capacity = WINDOW;
  batten_status st = r->buffer ? peek_at_least(r, 2) : BATTEN_E_NOMEM;
  if (st == BATTEN_OK) st = begin_gzip(r);
  if (st != BATTEN_OK) bx_close(r);
  return st;
}

batten_status bx_open(bx_reader *r, batten_context *ctx, const char *path) {
  *r = (bx_reader){.ctx = ctx, .path = path, .file = open(path, O_RDONLY | O_CLOEXEC)};
  if (r->file < 0) return fail_errno(r, "open", errno);
  struct stat info;
  if (!fstat(r->file, &info) && S_ISREG(info.st_mode) && info.st_size > 0) r->size = (uint64_t)info.st_size;
  return begin(r);
}

batten_status bx_open_memory(bx_reader *r, batten_context *ctx, const char *name, const void *data, size_t size) {
  *r = (bx_reader){.ctx = ctx, .path = name, .file = -1, .memory = data, .memory_left = size, .size = size};
  return begin(r);
}

void bx_close(bx_reader *r) {
  if (r->inflating) inflateEnd(&r->zip);
  if (r->file >= 0) close(r->file);
  batten_free(r->ctx, r->raw);
  batten_free(r->ctx, r->buffer);
  *r = (bx_reader){.ctx = r->ctx, .path = r->path, .file = -1};
}

bool bx_size_known(const bx_reader *r) { return r->size > 0 && !r->is_gzip; }

batten_status bx_peek(bx_reader *r, size_t count, const unsigned char **bytes, size_t *got) {
  batten_status st = peek_at_least(r, count);
  *bytes = r->buffer + r->begin;
  *got = r->end - r->begin < count ? r->end - r->begin : count;
  return st;
}

batten_status bx_read_bytes(bx_reader *r, void *to, size_t count, const char *what) {
  unsigned char *at = to;
  while (count) {
    if (r->begin == r->end) {
      batten_status st = r->ended ? bx_fail_byte(r, "the file ends here; %s is missing", what) : fill(r);
      if (st != BATTEN_OK) return st;
    }
    size_t now = r->end - r->begin < count ? r->end - r->begin : count;
    memcpy(at, r->buffer + r->begin, now);
    r->begin += now;
    r->offset += now;
    at += now;
    count -= now;
  }
  return BATTEN_OK;
}

/* ---- lines -------------------------------------------------------------------------------------- */

batten_status bx_skip_mark(bx_reader *r) {
  batten_status st = peek_at_least(r, 3);
  if (st == BATTEN_OK && r->end - r->begin >= 3 && !memcmp(r->buffer + r->begin, "\xef\xbb\xbf", 3)) {
    r->begin += 3;
    r->offset += 3;
  }
  return st;
}

batten_status bx_next_line(bx_reader *r, bool *end) {
  *end = false;
  batten_status st = r->offset == 0 ? bx_skip_mark(r) : BATTEN_OK;
  if (st != BATTEN_OK) return st;
  r->line++;
  size_t length = 0;
  for (;;) {
    const unsigned char *line = r->buffer + r->begin;
    size_t there = r->end - r->begin;
    while (length < there && line[length] != '\n' && line[length] != '\r' && line[length]) length++;
    if (length < there) break;
    if (r->ended) break;
    if (length > LINE_MAX_BYTES)
      return bx_fail_line(r, "a line of more than %d bytes; is this a text file?", LINE_MAX_BYTES);
    st = fill(r);
    if (st != BATTEN_OK) return st;
  }
  /* A CR as the last byte of the window may be half of a CRLF. */
  if (r->end - r->begin == length + 1 && r->buffer[r->end - 1] == '\r') st = peek_at_least(r, length + 2);
  if (st != BATTEN_OK) return st;
  unsigned char *line = r->buffer + r->begin;
  size_t there = r->end - r->begin, taken = length;
  if (length < there && line[length] == 0)
    return bx_fail_line(r, "a byte of value 0 in column %zu; is this a text file in UTF-8 or ASCII?", length + 1);
  if (length < there) taken += line[length] == '\r' && length + 1 < there && line[length + 1] == '\n' ? 2 : 1;
  *end = there == 0;
  line[length] = '\0'; /* on the line's end, or on the spare byte behind the window */
  r->text = (char *)line;
  r->begin += taken;
  r->offset += taken;
  return BATTEN_OK;
}

static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }

const char *bx_skip_blanks(const char *at) {
  while (is_blank(*at)) at++;
  return at;
}

size_t bx_next_word(const char **at, const char **word) {
  *word = bx_skip_blanks(*at);
  const char *end = *word;
  while (*end && !is_blank(*end)) end++;
  *at = end;
  return (size_t)(end - *word);
}

bool bx_word_is(const char *word, size_t length, const char *text) {
  return strlen(text) == length && !memcmp(word, text, length);
}

const char *bx_quote(const char *text, size_t length, char out[BX_QUOTE_SIZE]) {
  enum { SHOWN = 32 };
  size_t shown = length < SHOWN ? length : SHOWN;
  for (size_t i = 0; i < shown; i++) out[i] = text[i] >= 0x20 && text[i] < 0x7f ? text[i] : '?';
  snprintf(out + shown, BX_QUOTE_SIZE - SHOWN, "%s", length > SHOWN ? "..." : "");
  return out;
}

batten_status bx_fail_number(bx_reader *r, const char *what, const char *text, size_t length, bool integer) {
  char quote[BX_QUOTE_SIZE];
  bx_quote(text, length, quote);
  if (length == 0) return bx_fail_line(r, "%s is missing", what);
  const char *end;
  double value;
  int64_t whole;
  bx_number_state state = integer ? bx_parse_integer(text, &end, &whole) : bx_parse_number(text, &end, &value);
  if (state == BX_NUMBER_NOT_FINITE && end == text + length)
    return bx_fail_line(r, "%s: '%s' is not finite; remove the line or give a number", what, quote);
  if (state == BX_NUMBER_TOO_LARGE && end == text + length)
    return bx_fail_line(r, "%s: '%s' is too large for %s", what, quote, integer ? "an index" : "a double");
  if (!integer && state == BX_NUMBER_OK && *end == ',')
    return bx_fail_line(r, "%s: '%s' has a comma; write a point as the decimal sign", what, quote);
  return bx_fail_line(r, "%s: '%s' is not a%s", what, quote, integer ? " whole number" : " number");
}

batten_status bx_next_number(bx_reader *r, const char **at, const char *what, double *out) {
  const char *word, *end;
  size_t length = bx_next_word(at, &word);
  if (length && bx_parse_number(word, &end, out) == BX_NUMBER_OK && end == word + length) return BATTEN_OK;
  return bx_fail_number(r, what, word, length, false);
}

batten_status bx_next_integer(bx_reader *r, const char **at, const char *what, int64_t *out) {
  const char *word, *end;
  size_t length = bx_next_word(at, &word);
  if (length && bx_parse_integer(word, &end, out) == BX_NUMBER_OK && end == word + length) return BATTEN_OK;
  return bx_fail_number(r, what, word, length, true);
}
