/* Surfaces as IGES files: entity 128 as a face with its natural bounds (144). A loop that trims it would say the same
 * once more, and would need curves for sides that are points. */
#include "iges_text.h"
#include "surface.h"

typedef struct parts {
  const batten_surface_form *form;
  const bx_sides *sides;
} parts;

static void put_face(iges_file *f, void *user) {
  const parts *p = user;
  if (!bx_goes_on(f->w, f->directory ? 0 : 1024, 2048)) return;
  iges_put_surface(f, p->form, p->sides->closed);
  iges_begin(f, 144, IGES_WHOLE, "FACE", 1); /* the natural bound, none inside */
  iges_put_whole(f, iges_pointer(0));
  for (int i = 0; i < 3; i++) iges_put_whole(f, 0);
  iges_end(f);
}

void bx_write_iges_surface(bx_writer *w, const batten_surface_form *form, const bx_sides *sides,
                           const bx_product *product) {
  parts p = {form, sides};
  bx_write_iges(w, product, sides->size, sides->reach, put_face, &p);
}
