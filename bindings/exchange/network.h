/* Writers of networks, on a file that is open. Errors stay with the writer until bx_commit. */
#ifndef BATTEN_EXCHANGE_NETWORK_H
#define BATTEN_EXCHANGE_NETWORK_H

#include "brep.h"
#include "cad.h"
#include "write_file.h"

void bx_write_step_network(bx_writer *w, const bx_brep *brep, batten_cad_form form, const bx_product *product);
void bx_write_iges_network(bx_writer *w, const bx_brep *brep, batten_cad_form form, const bx_product *product);
void bx_write_json_network(bx_writer *w, const batten_network *network);
void bx_write_vtu_network(bx_writer *w, const batten_network *network);

/* Bezier triangles of VTK: its order of control points as indices into the library's; order [points of the degree].
 * Returns how many there are. */
size_t bx_vtk_triangle_order(unsigned degree, unsigned order[]);

#endif
