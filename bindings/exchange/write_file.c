/* Output files: see write_file.h.
 *
 * The part file lies in the directory of its target, so that rename() is atomic; it is opened with O_EXCL and the
 * host's umask, and takes over the mode of the file that it replaces. Something that is no regular file (a device, a
 * pipe) cannot be replaced and is written straight. */
#define _XOPEN_SOURCE 700 /* realpath */
#include "write_file.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { BUFFER_SIZE = 1 << 16, PART_SUFFIX_SIZE = 48 };

static batten_status fail_errno(bx_writer *w, const char *what, int error) {
  char text[128];
  if (strerror_r(error, text, sizeof text)) snprintf(text, sizeof text, "error %d", error);
  const char *remedy = error == ENOENT    ? "; make the directory first"
                       : error == ENOSPC  ? "; free some space"
                       : error == EACCES  ? "; check the permissions of the directory"
                       : error == EISDIR  ? "; name a file in it"
                       : error == ENOTDIR ? "; a part of the path is a file"
                                          : "";
  return batten_fail(w->ctx, BATTEN_E_IO, "%s: cannot %s: %s%s", w->path, what, text, remedy);
}

static char *copy_text(batten_context *ctx, const char *text, size_t extra) {
  size_t length = strlen(text);
  char *copy = batten_alloc(ctx, length + 1 + extra);
  if (copy) memcpy(copy, text, length + 1);
  return copy;
}

static void release(bx_writer *w) {
  batten_free(w->ctx, w->buffer);
  batten_free(w->ctx, w->part);
  batten_free(w->ctx, w->target);
  w->buffer = NULL;
  w->part = w->target = NULL;
}

/* The path itself, or what it leads to when it is a symbolic link. */
static batten_status follow_links(bx_writer *w) {
  struct stat info;
  if (lstat(w->path, &info) || !S_ISLNK(info.st_mode)) {
    w->target = copy_text(w->ctx, w->path, 0);
    return w->target ? BATTEN_OK : BATTEN_E_NOMEM;
  }
  w->target = batten_alloc(w->ctx, PATH_MAX);
  if (!w->target) return BATTEN_E_NOMEM;
  if (!realpath(w->path, w->target)) return fail_errno(w, "follow the link", errno);
  return BATTEN_OK;
}

static batten_status open_part(bx_writer *w) {
  w->part = copy_text(w->ctx, w->target, PART_SUFFIX_SIZE);
  if (!w->part) return BATTEN_E_NOMEM;
  char *suffix = w->part + strlen(w->part);
  int error = EEXIST;
  for (unsigned i = 0; error == EEXIST && i < 1000; i++) {
    snprintf(suffix, PART_SUFFIX_SIZE, ".%ld-%u.part", (long)getpid(), i);
    w->file = open(w->part, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    error = w->file < 0 ? errno : 0;
  }
  return error ? fail_errno(w, "create", error) : BATTEN_OK;
}

static batten_status open_target(bx_writer *w) {
  struct stat info;
  bool exists = !stat(w->target, &info);
  if (exists && S_ISDIR(info.st_mode)) return fail_errno(w, "write", EISDIR);
  if (exists && !S_ISREG(info.st_mode)) {
    w->file = open(w->target, O_WRONLY | O_CLOEXEC);
    return w->file < 0 ? fail_errno(w, "open for writing", errno) : BATTEN_OK;
  }
  batten_status st = open_part(w);
  /* Not every file system has modes: the umask's default will do there. */
  if (st == BATTEN_OK && exists && fchmod(w->file, info.st_mode & 07777)) errno = 0;
  return st;
}

batten_status bx_create(bx_writer *w, batten_context *ctx, const char *path) {
  *w = (bx_writer){.ctx = ctx, .path = path, .file = -1};
  w->buffer = batten_alloc(ctx, BUFFER_SIZE);
  batten_status st = w->buffer ? follow_links(w) : BATTEN_E_NOMEM;
  if (st == BATTEN_OK) st = open_target(w);
  if (st != BATTEN_OK) release(w);
  return st;
}

static void flush(bx_writer *w) {
  size_t done = 0;
  while (w->status == BATTEN_OK && done < w->used) {
    ssize_t now = write(w->file, w->buffer + done, w->used - done);
    if (now >= 0)
      done += (size_t)now;
    else if (errno != EINTR)
      w->status = fail_errno(w, "write", errno);
  }
  w->used = 0;
}

void bx_put(bx_writer *w, const void *bytes, size_t count) {
  const unsigned char *from = bytes;
  w->written += count;
  while (count && w->status == BATTEN_OK) {
    size_t room = BUFFER_SIZE - w->used, now = count < room ? count : room;
    memcpy(w->buffer + w->used, from, now);
    w->used += now;
    from += now;
    count -= now;
    if (w->used == BUFFER_SIZE) flush(w);
  }
}

void bx_put_text(bx_writer *w, const char *text) { bx_put(w, text, strlen(text)); }

void bx_print(bx_writer *w, const char *format, ...) {
  char text[1024];
  va_list args;
  va_start(args, format);
  int length = vsnprintf(text, sizeof text, format, args);
  va_end(args);
  if (length < 0 || (size_t)length >= sizeof text)
    bx_writer_fail(w, batten_fail(w->ctx, BATTEN_E_INTERNAL, "%s: a piece of text is too long to print", w->path));
  else
    bx_put(w, text, (size_t)length);
}

void bx_put_u64(bx_writer *w, uint64_t value) {
  unsigned char bytes[8];
  for (int i = 0; i < 8; i++) bytes[i] = (unsigned char)(value >> (8 * i));
  bx_put(w, bytes, sizeof bytes);
}

void bx_put_u32(bx_writer *w, uint32_t value) {
  unsigned char bytes[4];
  for (int i = 0; i < 4; i++) bytes[i] = (unsigned char)(value >> (8 * i));
  bx_put(w, bytes, sizeof bytes);
}

void bx_put_u16(bx_writer *w, uint16_t value) {
  unsigned char bytes[2] = {(unsigned char)value, (unsigned char)(value >> 8)};
  bx_put(w, bytes, sizeof bytes);
}

void bx_put_u8(bx_writer *w, uint8_t value) { bx_put(w, &value, 1); }

void bx_put_f32(bx_writer *w, float value) {
  uint32_t bits;
  memcpy(&bits, &value, sizeof bits);
  bx_put_u32(w, bits);
}

void bx_put_f64(bx_writer *w, double value) {
  uint64_t bits;
  memcpy(&bits, &value, sizeof bits);
  bx_put_u64(w, bits);
}

void bx_writer_fail(bx_writer *w, batten_status status) {
  if (w->status == BATTEN_OK) w->status = status;
}

bool bx_goes_on(bx_writer *w, size_t done, size_t all) {
  if (w->status == BATTEN_OK && done % 1024 == 0)
    bx_writer_fail(w, batten_progress(w->ctx, "write", (double)done / (double)all));
  return w->status == BATTEN_OK;
}

batten_status bx_commit(bx_writer *w) {
  if (w->status == BATTEN_OK) flush(w);
  if (close(w->file) && errno != EINTR && w->status == BATTEN_OK) w->status = fail_errno(w, "write", errno);
  if (w->part && w->status == BATTEN_OK && rename(w->part, w->target))
    w->status = fail_errno(w, "move the finished file into place", errno);
  if (w->part && w->status != BATTEN_OK) unlink(w->part);
  release(w);
  return w->status;
}
