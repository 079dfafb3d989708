/* A scratch folder, and files in it as text or bytes. */
#ifndef TEST_FILES_H
#define TEST_FILES_H

#include <batten/exchange.h>

#include "format.h"
#include "tap.h"

#include <dirent.h>
#include <unistd.h>

typedef struct scratch {
  char path[64];
  char name[384];
} scratch;

static inline void scratch_open(scratch *s) {
  snprintf(s->path, sizeof s->path, "batten-test-XXXXXX");
  if (!mkdtemp(s->path)) s->path[0] = '\0';
}

/* Path of a file in the folder; valid until the next call. */
static inline const char *scratch_file(scratch *s, const char *name) {
  snprintf(s->name, sizeof s->name, "%s/%s", s->path, name);
  return s->name;
}

static inline size_t scratch_count(const scratch *s) {
  size_t count = 0;
  DIR *folder = opendir(s->path);
  struct dirent *entry;
  while (folder && (entry = readdir(folder))) count += entry->d_name[0] != '.';
  if (folder) closedir(folder);
  return count;
}

static inline void scratch_close(scratch *s) {
  DIR *folder = opendir(s->path);
  struct dirent *entry;
  while (folder && (entry = readdir(folder)))
    if (entry->d_name[0] != '.') unlink(scratch_file(s, entry->d_name));
  if (folder) closedir(folder);
  rmdir(s->path);
}

static inline void file_write(const char *path, const void *bytes, size_t size) {
  FILE *f = fopen(path, "wb");
  if (!f || fwrite(bytes, 1, size, f) != size) t_line(false, "the test writes %s", path);
  if (f) fclose(f);
}

/* malloc'd; *size bytes. */
static inline unsigned char *file_read(const char *path, size_t *size) {
  unsigned char *bytes = malloc(1 << 22);
  FILE *f = fopen(path, "rb");
  *size = f ? fread(bytes, 1, 1 << 22, f) : 0;
  if (f) fclose(f);
  return bytes;
}

static inline bool files_equal(const char *a, const char *b) {
  size_t size_a, size_b;
  unsigned char *bytes_a = file_read(a, &size_a), *bytes_b = file_read(b, &size_b);
  bool equal = size_a == size_b && size_a > 0 && !memcmp(bytes_a, bytes_b, size_a);
  free(bytes_a);
  free(bytes_b);
  return equal;
}

/* Reads bytes as if they were the file `name`. */
static inline batten_status points_of(batten_context *ctx, const char *name, const void *bytes, size_t size,
                                      unsigned n, batten_cloud *out) {
  bx_reader r;
  batten_status st = bx_open_memory(&r, ctx, name, bytes, size);
  if (st != BATTEN_OK) return st;
  bool gz;
  st = bx_read_points_from(&r, bx_format_of(name, &gz), n, out);
  bx_close(&r);
  return st;
}

static inline batten_status mesh_of(batten_context *ctx, const char *name, const void *bytes, size_t size,
                                    batten_mesh **out) {
  bx_reader r;
  batten_status st = bx_open_memory(&r, ctx, name, bytes, size);
  if (st != BATTEN_OK) return st;
  bool gz;
  st = bx_read_mesh_from(&r, bx_format_of(name, &gz), out);
  bx_close(&r);
  return st;
}

#endif
