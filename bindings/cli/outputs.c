/* Output files: checked before the work begins, written beside their names, and moved into place all together. */
#define _XOPEN_SOURCE 700 /* realpath */
#include "cli.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

static const char *const surface_formats[] = {".ply", ".obj", ".stl", ".off", ".vtp", ".vtu", ".vtk", NULL};
static const char *const outline_formats[] = {".svg", ".csv", ".xyz", ".txt", ".vtp", ".obj", NULL};
static const char *const network_formats[] = {".step", ".stp", ".iges", ".igs", ".json", ".vtu", ".ply",
                                              ".obj",  ".stl", ".off",  ".vtp", ".vtk",  NULL};
static const char *const picture_formats[] = {".png", NULL};
static const char *const plane_picture_formats[] = {".svg", ".png", NULL};
static const char *const curve_formats[] = {".json", ".step", ".stp", ".iges", ".igs", ".svg",
                                            ".vtu",  ".vtp",  ".vtk", ".csv",  NULL};
static const char *const proposal_formats[] = {".json", NULL};
static const char *const qp_formats[] = {".qps", ".sif", ".mps", ".json", NULL};
static const char *const qp_solution_formats[] = {".json", ".csv", NULL};

static bool has_extension(const char *path, const char *const *list) {
  size_t length = strlen(path);
  for (; *list; list++) {
    size_t tail = strlen(*list);
    if (length > tail && path[length - tail - 1] != '/' && strcasecmp(path + length - tail, *list) == 0) return true;
  }
  return false;
}

static void join(const char *const *list, char *text, size_t size) {
  text[0] = '\0';
  for (size_t i = 0; list[i]; i++) snprintf(text + strlen(text), size - strlen(text), "%s%s", i ? " " : "", list[i]);
}

static char *copy_text(const char *text, size_t length) {
  char *copy = malloc(length + 1);
  if (!copy) {
    cli_error("out of memory");
    return NULL;
  }
  memcpy(copy, text, length);
  copy[length] = '\0';
  return copy;
}

char *cli_product_name(const char *path) {
  const char *slash = strrchr(path, '/'), *base = slash ? slash + 1 : path, *dot = strrchr(base, '.');
  return copy_text(base, dot ? (size_t)(dot - base) : strlen(base));
}

bool cli_outputs_add(cli_outputs *o, cli_output_kind kind, const char *path) {
  if (o->count == o->room) {
    size_t room = o->room ? 2 * o->room : 8;
    cli_output *items = realloc(o->items, room * sizeof *items);
    if (!items) {
      cli_error("out of memory");
      return false;
    }
    o->items = items;
    o->room = room;
  }
  o->items[o->count++] = (cli_output){.kind = kind, .path = path};
  return true;
}

static bool is_stdout(const cli_output *f) {
  return f->kind == CLI_OUTPUT_REPORT && (strcmp(f->path, "-") == 0 || strcmp(f->path, "/dev/stdout") == 0);
}

bool cli_outputs_to_stdout(const cli_outputs *o) {
  for (size_t i = 0; i < o->count; i++)
    if (is_stdout(&o->items[i])) return true;
  return false;
}

/* Where the file will be, with links followed, and the name beside it under which it grows: the extension stays,
 * since it tells the format. What is no regular file (a pipe, a device) is written straight. */
static bool stage(cli_output *f, size_t index) {
  struct stat info;
  if (is_stdout(f)) return (f->target = copy_text("-", 1)) != NULL;
  bool exists = stat(f->path, &info) == 0;
  /* A pipe under /dev/fd has no real path. */
  f->target = exists && S_ISREG(info.st_mode) ? realpath(f->path, NULL) : copy_text(f->path, strlen(f->path));
  if (!f->target) {
    cli_error("%s: cannot be resolved: %s", f->path, strerror(errno));
    return false;
  }
  if (exists && S_ISDIR(info.st_mode)) {
    cli_error("%s: is a directory; name a file in it", f->path);
    return false;
  }
  if (exists && access(f->target, W_OK) != 0) {
    cli_error("%s: cannot be written: %s", f->path, strerror(errno));
    return false;
  }
  if (exists && !S_ISREG(info.st_mode)) return true;
  const char *slash = strrchr(f->target, '/');
  size_t head = slash ? (size_t)(slash - f->target) + 1 : 0;
  char *folder = head ? copy_text(f->target, head) : copy_text(".", 1);
  size_t room = strlen(f->target) + 64;
  f->staged = malloc(room);
  if (!folder || !f->staged) {
    free(folder);
    return false;
  }
  bool ok = stat(folder, &info) == 0 && S_ISDIR(info.st_mode) && access(folder, W_OK | X_OK) == 0;
  if (!ok)
    cli_error("%s: cannot be written: %s; make the directory first or check its permissions", f->path,
              errno ? strerror(errno) : "no such directory");
  snprintf(f->staged, room, "%.*s.batten-%ld-%zu-%s", (int)head, f->target, (long)getpid(), index, f->target + head);
  free(folder);
  return ok;
}

static bool same_place(const char *a, const char *b) {
  struct stat x, y;
  return stat(a, &x) == 0 && stat(b, &y) == 0 && x.st_dev == y.st_dev && x.st_ino == y.st_ino;
}

/* Also of files that are still to be: the same name in the same folder. */
static bool same_file(const char *a, const char *b) {
  if (strcmp(a, b) == 0 || same_place(a, b)) return true;
  const char *slash_a = strrchr(a, '/'), *slash_b = strrchr(b, '/');
  if (strcmp(slash_a ? slash_a + 1 : a, slash_b ? slash_b + 1 : b) != 0) return false;
  char *folder_a = slash_a ? copy_text(a, (size_t)(slash_a - a) + 1) : copy_text(".", 1);
  char *folder_b = slash_b ? copy_text(b, (size_t)(slash_b - b) + 1) : copy_text(".", 1);
  bool same = folder_a && folder_b && same_place(folder_a, folder_b);
  free(folder_a);
  free(folder_b);
  return same;
}

/* Kinds whose extensions do not depend on the data. */
typedef struct rule {
  cli_output_kind kind;
  const char *const *formats;
  const char *option, *use;
} rule;

static const rule *rule_of(cli_output_kind kind) {
  static const rule rules[] = {
      {CLI_OUTPUT_PICTURE, plane_picture_formats, "--picture", ".png, for plane solids also .svg"},
      {CLI_OUTPUT_SHADED, picture_formats, "--picture", ".png"},
      {CLI_OUTPUT_NETWORK, network_formats, "-o",
       ".step .iges .json .vtu, or of a mesh .ply .obj .stl .off .vtp .vtk"},
      {CLI_OUTPUT_PATCH, network_formats, "-o", ".step .iges .json .vtu, or of a mesh .ply .obj .stl .off .vtp .vtk"},
      {CLI_OUTPUT_UNCONSTRAINED, network_formats, "--unconstrained",
       ".step .iges .json .vtu, or of a mesh .ply .obj .stl .off .vtp .vtk"},
      {CLI_OUTPUT_CURVE, curve_formats, "-o", ".json .step .iges .svg .vtu .vtp .vtk .csv"},
      {CLI_OUTPUT_CURVE_FREE, curve_formats, "--unconstrained", ".json .step .iges .svg .vtu .vtp .vtk .csv"},
      {CLI_OUTPUT_CONTOURS, curve_formats, "--contours", ".json .step .iges .svg .vtu .vtp .vtk .csv"},
      {CLI_OUTPUT_SECTIONS, curve_formats, "--sections", ".json .step .iges .svg .vtu .vtp .vtk .csv"},
      {CLI_OUTPUT_PROPOSAL, proposal_formats, "--proposal", ".json"},
      {CLI_OUTPUT_PLOTS, plane_picture_formats, "--picture", ".png or .svg"},
      {CLI_OUTPUT_QP, qp_formats, "--write", ".qps or .json"},
      {CLI_OUTPUT_QP_SOLUTION, qp_solution_formats, "-o", ".json or .csv"},
  };
  for (size_t i = 0; i < sizeof rules / sizeof *rules; i++)
    if (rules[i].kind == kind) return &rules[i];
  return NULL;
}

bool cli_outputs_check(cli_outputs *o, const char *input, bool *usage) {
  char known[128];
  *usage = true;
  for (size_t i = 0; i < o->count; i++) {
    cli_output *f = &o->items[i];
    if (f->kind == CLI_OUTPUT_SURFACE && !has_extension(f->path, surface_formats) &&
        !has_extension(f->path, outline_formats)) {
      join(surface_formats, known, sizeof known);
      cli_error("%s: unknown extension for -o; use %s, for plane solids .svg .csv .xyz .txt .vtp .obj", f->path,
                known);
      return false;
    }
    const rule *r = rule_of(f->kind);
    if (r && !has_extension(f->path, r->formats)) {
      cli_error("%s: unknown extension for %s; use %s", f->path, r->option, r->use);
      return false;
    }
    if (input && same_file(f->path, input)) {
      cli_error("%s: is the input; name another output", f->path);
      return false;
    }
    for (size_t j = 0; j < i; j++)
      if (same_file(f->path, o->items[j].path)) {
        cli_error("%s: is named as output twice", f->path);
        return false;
      }
  }
  *usage = false;
  for (size_t i = 0; i < o->count; i++)
    if (!stage(&o->items[i], i)) return false;
  return true;
}

bool cli_outputs_check_dimension(const cli_outputs *o, unsigned dimension) {
  char known[128];
  for (size_t i = 0; i < o->count; i++) {
    const cli_output *f = &o->items[i];
    const char *const *list = f->kind == CLI_OUTPUT_SURFACE ? dimension == 2 ? outline_formats : surface_formats
                              : f->kind == CLI_OUTPUT_PICTURE
                                  ? dimension == 2 ? plane_picture_formats : picture_formats
                                  : NULL;
    if (!list || has_extension(f->path, list)) continue;
    join(list, known, sizeof known);
    cli_error("%s: the points are %s; use %s", f->path, dimension == 2 ? "plane" : "in space", known);
    return false;
  }
  return true;
}

bool cli_outputs_commit(cli_outputs *o) {
  for (size_t i = 0; i < o->count; i++) {
    cli_output *f = &o->items[i];
    if (!f->staged) continue;
    if (rename(f->staged, f->target) != 0) {
      cli_error("%s: cannot be moved into place: %s", f->path, strerror(errno));
      return false;
    }
    free(f->staged);
    f->staged = NULL;
  }
  return true;
}

void cli_outputs_close(cli_outputs *o) {
  for (size_t i = 0; i < o->count; i++) {
    if (o->items[i].staged) unlink(o->items[i].staged);
    free(o->items[i].staged);
    free(o->items[i].target);
  }
  free(o->items);
  *o = (cli_outputs){0};
}
