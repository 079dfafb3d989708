/* Formats by extension: see format.h. */
#include "format.h"

#include <math.h>
#include <string.h>

static bool equals(const char *text, size_t length, const char *lower_case) {
  if (strlen(lower_case) != length) return false;
  for (size_t i = 0; i < length; i++) {
    char c = text[i];
    if (c >= 'A' && c <= 'Z') c = (char)(c + ('a' - 'A'));
    if (c != lower_case[i]) return false;
  }
  return true;
}

/* Start of the extension in path[0 .. length), without its point; length when there is none. */
static size_t extension(const char *path, size_t length) {
  size_t at = length;
  while (at > 0 && path[at - 1] != '.' && path[at - 1] != '/') at--;
  return at > 0 && path[at - 1] == '.' ? at : length;
}

bx_format bx_format_of(const char *path, bool *gz) {
  static const struct {
    const char *extension;
    bx_format format;
  } known[] = {{"xyz", BX_TEXT}, {"txt", BX_TEXT},  {"csv", BX_TEXT}, {"tsv", BX_TEXT}, {"asc", BX_TEXT},
               {"dat", BX_TEXT}, {"ply", BX_PLY},   {"obj", BX_OBJ},  {"off", BX_OFF},  {"stl", BX_STL},
               {"vtp", BX_VTP},  {"vtu", BX_VTU},   {"vtk", BX_VTK},  {"svg", BX_SVG},  {"json", BX_JSON},
               {"qps", BX_QPS},  {"sif", BX_QPS},   {"mps", BX_QPS},  {"mat", BX_MAT},  {"step", BX_STEP},
               {"stp", BX_STEP}, {"iges", BX_IGES}, {"igs", BX_IGES}};
  size_t length = strlen(path), at = extension(path, length);
  if (gz) {
    *gz = equals(path + at, length - at, "gz");
    if (*gz) {
      length = at - 1;
      at = extension(path, length);
    }
  }
  for (size_t i = 0; i < sizeof known / sizeof known[0]; i++)
    if (equals(path + at, length - at, known[i].extension)) return known[i].format;
  return BX_UNKNOWN;
}

bool bx_has_extension(const char *path, const char *lower_case) {
  size_t length = strlen(path), at = extension(path, length);
  if (equals(path + at, length - at, "gz")) {
    length = at - 1;
    at = extension(path, length);
  }
  return equals(path + at, length - at, lower_case);
}

batten_status bx_check_pointers(batten_context *ctx, const char *path, const void *out, const char *out_name) {
  if (!path) return batten_fail(ctx, BATTEN_E_INVALID, "path: NULL; name a file");
  if (!*path) return batten_fail(ctx, BATTEN_E_INVALID, "path: empty; name a file");
  if (!out) return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL", out_name);
  return BATTEN_OK;
}

batten_status bx_check_density(batten_context *ctx, unsigned density, unsigned most) {
  if (density >= 1 && density <= most) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "opt.density: %u; must be 1 .. %u", density, most);
}

batten_status bx_check_tolerance(batten_context *ctx, double tolerance) {
  if (tolerance >= 0 && isfinite(tolerance)) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "opt.tolerance: %g; must be finite and not negative", tolerance);
}
