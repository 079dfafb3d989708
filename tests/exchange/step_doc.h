/* STEP files taken apart: a table of entities and what must hold of it. */
#ifndef TEST_STEP_DOC_H
#define TEST_STEP_DOC_H

#include "files.h"

enum { ENTITIES_MAX = 60000 };

typedef struct step_doc {
  char *text;
  size_t count;        /* entities are 1 .. count */
  const char **entity; /* [count + 1] behind "#17=" */
} step_doc;

static inline bool read_step(const char *path, step_doc *d) {
  size_t size;
  d->text = (char *)file_read(path, &size);
  d->text[size] = '\0';
  d->entity = malloc(ENTITIES_MAX * sizeof *d->entity);
  d->count = 0;
  for (char *at = strstr(d->text, "DATA;\n"); at && (at = strchr(at, '\n')) != NULL; at++) {
    if (at[1] != '#') continue; /* a line that goes on */
    char *behind;
    unsigned long number = strtoul(at + 2, &behind, 10);
    if (*behind != '=') continue;
    if (number != d->count + 1 || number >= ENTITIES_MAX) return false; /* numbered without gaps */
    d->entity[++d->count] = behind + 1;
  }
  return d->count > 0;
}

static inline void free_step(step_doc *d) {
  free(d->text);
  free(d->entity);
}

static inline bool is_kind(const step_doc *d, size_t n, const char *kind) {
  size_t length = strlen(kind);
  return n >= 1 && n <= d->count && !strncmp(d->entity[n], kind, length) && d->entity[n][length] == '(';
}

static inline size_t count_kind(const step_doc *d, const char *kind) {
  size_t count = 0;
  for (size_t n = 1; n <= d->count; n++) count += is_kind(d, n, kind);
  return count;
}

/* The i-th reference of an entity, 0 behind the last. */
static inline size_t reference(const step_doc *d, size_t n, size_t i) {
  const char *at = d->entity[n];
  bool quoted = false;
  for (; *at != ';' || quoted; at++) {
    if (*at == '\'') quoted = !quoted;
    if (!quoted && *at == '#' && i-- == 0) return strtoul(at + 1, NULL, 10);
  }
  return 0;
}

static inline bool references_exist(const step_doc *d) {
  for (size_t n = 1; n <= d->count; n++)
    for (size_t i = 0, to; (to = reference(d, n, i)) != 0; i++)
      if (to > d->count) return false;
  return true;
}

/* All points' numbers have a point and read back. */
static inline bool reals_are_real(const step_doc *d) {
  for (size_t n = 1; n <= d->count; n++) {
    if (!is_kind(d, n, "CARTESIAN_POINT")) continue;
    const char *at = strchr(d->entity[n], '(') + 5;
    for (int i = 0; i < 3; i++) {
      char *end;
      strtod(at, &end);
      if (!memchr(at, '.', (size_t)(end - at)) || *end != (i < 2 ? ',' : ')')) return false;
      at = end + 1;
    }
  }
  return true;
}

/* Oriented edges of the faces: each loop runs from vertex to vertex, and in closed shells each edge is used once each
 * way; the edges that are used once are counted. */
static inline bool loops_close(const step_doc *d, size_t *open_edges) {
  signed char *uses = calloc(d->count + 1, 1), *sum = calloc(d->count + 1, 1);
  bool ok = true;
  for (size_t n = 1; n <= d->count; n++) {
    if (!is_kind(d, n, "EDGE_LOOP")) continue;
    size_t first = 0, last = 0, to;
    for (size_t i = 0; (to = reference(d, n, i)) != 0; i++) {
      size_t edge = reference(d, to, 0);
      bool forward = strstr(d->entity[to], ".T.") < strchr(d->entity[to], ';') && strstr(d->entity[to], ".T.");
      size_t from = reference(d, edge, forward ? 0 : 1), end = reference(d, edge, forward ? 1 : 0);
      ok = ok && is_kind(d, to, "ORIENTED_EDGE") && is_kind(d, edge, "EDGE_CURVE") && (i == 0 || from == last);
      if (i == 0) first = from;
      last = end;
      uses[edge]++;
      sum[edge] = (signed char)(sum[edge] + (forward ? 1 : -1));
    }
    ok = ok && first == last;
  }
  *open_edges = 0;
  for (size_t n = 1; n <= d->count; n++) {
    ok = ok && uses[n] <= 2 && (uses[n] < 2 || sum[n] == 0);
    *open_edges += uses[n] == 1;
  }
  free(uses);
  free(sum);
  return ok;
}

#endif
