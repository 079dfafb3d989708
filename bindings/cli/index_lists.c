/* Lists of vertex numbers: creases and polylines for `batten network`. */
#define _XOPEN_SOURCE 700 /* getline */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "network.h"

/* Numbers and lists as they grow. */
typedef struct lists {
  size_t count, room, used, space;
  size_t *starts;
  uint32_t *indices;
} lists;

static bool push_index(batten_context *ctx, lists *l, uint32_t index) {
  if (l->used == l->space) {
    size_t space = l->space ? 2 * l->space : 256;
    uint32_t *grown = batten_realloc_array(ctx, l->indices, space, sizeof *grown);
    if (!grown) return false;
    l->indices = grown;
    l->space = space;
  }
  l->indices[l->used++] = index;
  return true;
}

static bool push_list(batten_context *ctx, lists *l) {
  if (l->count + 1 >= l->room) {
    size_t room = l->room ? 2 * l->room : 64;
    size_t *grown = batten_realloc_array(ctx, l->starts, room, sizeof *grown);
    if (!grown) return false;
    if (!l->room) grown[0] = 0;
    l->starts = grown;
    l->room = room;
  }
  l->starts[++l->count] = l->used;
  return true;
}

/* One line of text into the lists. */
static batten_status take_line(batten_context *ctx, const char *path, size_t number, char *line, lists *l) {
  static const char blanks[] = " \t\r\n,;";
  size_t before = l->used;
  line[strcspn(line, "#%")] = '\0';
  for (char *word = strtok(line, blanks); word; word = strtok(NULL, blanks)) {
    char *end;
    errno = 0;
    unsigned long value = strtoul(word, &end, 10);
    if (*end || *word == '-' || *word == '+' || errno || value >= UINT32_MAX)
      return batten_fail(ctx, BATTEN_E_FORMAT, "%s:%zu: '%.40s' is not the number of a vertex, counted from 0", path,
                         number, word);
    if (!push_index(ctx, l, (uint32_t)value)) return BATTEN_E_NOMEM;
  }
  if (l->used == before) return BATTEN_OK;
  if (l->used == before + 1)
    return batten_fail(ctx, BATTEN_E_FORMAT, "%s:%zu: one vertex alone; give two or more in a line", path, number);
  return push_list(ctx, l) ? BATTEN_OK : BATTEN_E_NOMEM;
}

batten_status network_read_lists(batten_context *ctx, const char *path, size_t *count, size_t **starts,
                                 uint32_t **indices) {
  lists l = {0};
  char *line = NULL;
  size_t size = 0;
  batten_status st = BATTEN_OK;
  FILE *file = fopen(path, "r");
  if (!file) return batten_fail(ctx, BATTEN_E_IO, "%s: cannot be read: %s", path, strerror(errno));
  for (size_t number = 1; st >= 0 && getline(&line, &size, file) >= 0; number++)
    st = take_line(ctx, path, number, line, &l);
  if (st >= 0 && ferror(file)) st = batten_fail(ctx, BATTEN_E_IO, "%s: cannot be read: %s", path, strerror(errno));
  if (st >= 0 && l.count == 0)
    st = batten_fail(ctx, BATTEN_E_FORMAT, "%s: holds no list; give two or more vertex numbers a line", path);
  free(line);
  fclose(file);
  if (st < 0) {
    batten_free(ctx, l.starts);
    batten_free(ctx, l.indices);
    return st;
  }
  *count = l.count;
  *starts = l.starts;
  *indices = l.indices;
  return BATTEN_OK;
}
