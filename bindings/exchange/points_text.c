/* Points in text: XYZ, TXT, CSV, with or without a header line of names: see text_table.h. Parameters (u v) and
 * weights (w) always need names. */
#include "soup.h"
#include "text_table.h"

static batten_status take_row(const bx_table *t, bx_soup *soup) {
  soup->n = bx_table_has(t, BX_Z) ? 3 : 2;
  bool normals = bx_table_has(t, BX_NX) && bx_table_has(t, BX_NY) && (soup->n == 2 || bx_table_has(t, BX_NZ));
  batten_status st = bx_add_vertex(soup, t->values + BX_X);
  if (st == BATTEN_OK && normals) st = bx_add_normal(soup, t->values + BX_NX);
  if (st == BATTEN_OK && bx_table_has(t, BX_U)) st = bx_add_parameters(soup, t->values + BX_U);
  if (st == BATTEN_OK && bx_table_has(t, BX_W)) st = bx_add_weight(soup, t->values[BX_W]);
  return st;
}

batten_status bx_read_text(bx_reader *r, bx_soup *soup, unsigned n) {
  bx_table t = {.r = r,
                .n = n,
                .wanted = ((1u << (BX_W + 1)) - 1) | 1u << BX_STATION | 1u << BX_HALF_BREADTH | 1u << BX_WATERLINE,
                .names = "x y z nx ny nz u v w"};
  bool end;
  bx_line line;
  batten_status st = bx_next_line(r, &end);
  while (st == BATTEN_OK && !end) {
    st = bx_table_take(&t, &line);
    if (st == BATTEN_OK && line == BX_LINE_ROW) st = take_row(&t, soup);
    if (st == BATTEN_OK) st = bx_next_line(r, &end);
  }
  return st;
}
