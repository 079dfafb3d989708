/* What the writers of CAD files share: see cad.h. */
#include "cad.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

/* "2026-11-22T10:00:00": digits and nothing else where they belong. */
static bool is_time_stamp(const char *text) {
  static const char shape[] = "dddd-dd-ddTdd:dd:dd";
  if (strlen(text) != sizeof shape - 1) return false;
  for (size_t i = 0; shape[i]; i++)
    if (shape[i] == 'd' ? text[i] < '0' || text[i] > '9' : text[i] != shape[i]) return false;
  return true;
}

batten_status bx_check_product(batten_context *ctx, const bx_product *p) {
  if ((unsigned)p->unit > BATTEN_UNIT_INCH)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.unit: %d; must be one of BATTEN_UNIT_MM, CM, M, INCH",
                       (int)p->unit);
  if ((unsigned)p->schema > BATTEN_STEP_AP242)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.schema: %d; must be BATTEN_STEP_AP214 or BATTEN_STEP_AP242",
                       (int)p->schema);
  if (p->time_stamp && !is_time_stamp(p->time_stamp))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.time_stamp: '%.40s'; must be as 2026-11-22T10:00:00",
                       p->time_stamp);
  if (p->name && strlen(p->name) >= BX_PRODUCT_NAME)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.name: %zu bytes; at most %d", strlen(p->name),
                       BX_PRODUCT_NAME - 1);
  return BATTEN_OK;
}

/* "part" of "folder/part.step". */
static void base_name(const char *path, char *out, size_t room) {
  const char *slash = strrchr(path, '/');
  if (slash) path = slash + 1;
  const char *point = strrchr(path, '.');
  size_t length = point && point > path ? (size_t)(point - path) : strlen(path);
  if (length >= room) length = room - 1;
  memcpy(out, path, length);
  out[length] = '\0';
}

void bx_complete_product(bx_product *product, const char *path, char name[BX_PRODUCT_NAME]) {
  base_name(path, name, BX_PRODUCT_NAME);
  if (!product->name) product->name = name;
  if (!product->time_stamp) product->time_stamp = "1970-01-01T00:00:00";
}

batten_status bx_check_cad_size(batten_context *ctx, const char *what, double size, batten_length_unit unit) {
  static const double millimetres[] = {1, 10, 1000, 25.4};
  double in_mm = size * millimetres[unit], least = 1e-5;
  if (in_mm >= least && isfinite(in_mm)) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID,
                     "%s: its size is %g mm; CAD files need %g mm at least: scale it or choose another unit", what,
                     in_mm, least);
}

double bx_cad_uncertainty(double size) { return pow(10, floor(log10(size)) - 7); }
