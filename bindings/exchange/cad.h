/* What the writers of CAD files (STEP, IGES) share, whatever the surface is. */
#ifndef BATTEN_EXCHANGE_CAD_H
#define BATTEN_EXCHANGE_CAD_H

#include <batten/exchange.h>

/* What the files say about the product; in options, name and time_stamp may be NULL. */
typedef struct bx_product {
  batten_length_unit unit;
  batten_step_schema schema;
  const char *name, *time_stamp;
  const char *description; /* in ASCII */
} bx_product;

enum { BX_PRODUCT_NAME = 256 };

/* Options as the caller set them: INVALID names the one ("opt.unit: ..."). */
batten_status bx_check_product(batten_context *ctx, const bx_product *product);
/* Puts the defaults where NULL is: the file's name without its extension, in the caller's array, and the beginning of
 * time, so that the same surface gives the same bytes. */
void bx_complete_product(bx_product *product, const char *path, char name[BX_PRODUCT_NAME]);

/* CAD systems take places that are nearer than 1e-7 mm for one; what is not much larger does not come back: INVALID.
 */
batten_status bx_check_cad_size(batten_context *ctx, const char *what, double size, batten_length_unit unit);
/* What CAD files tell as their accuracy: 1e-7 of the size, as a power of ten. Joints are better by far, but systems
 * take it for the tolerance at which they work. */
double bx_cad_uncertainty(double size);

#endif
