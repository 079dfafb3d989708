/* Writers of networks, on a file that is open. Errors stay with the writer until bx_commit. */
#ifndef BATTEN_EXCHANGE_NETWORK_H
#define BATTEN_EXCHANGE_NETWORK_H

#include "brep.h"
#include "write_file.h"

/* What CAD files say about the product; the texts are never NULL. */
typedef struct bx_product {
  batten_length_unit unit;
  batten_cad_form form;
  batten_step_schema schema;
  const char *name, *time_stamp;
} bx_product;

void bx_write_step(bx_writer *w, const bx_brep *brep, const bx_product *product);
void bx_write_iges(bx_writer *w, const bx_brep *brep, const bx_product *product);
void bx_write_json_network(bx_writer *w, const batten_network *network);
void bx_write_vtu_network(bx_writer *w, const batten_network *network);

/* Bezier triangles of VTK: its order of control points as indices into the library's; order [points of the degree].
 * Returns how many there are. */
size_t bx_vtk_triangle_order(unsigned degree, unsigned order[]);

/* Asks for cancel now and then; false when the writer has stopped. */
bool bx_network_goes_on(bx_writer *w, size_t done, size_t all);

#endif
