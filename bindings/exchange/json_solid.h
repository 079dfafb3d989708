/* Solids of all kinds in documents, and what nests in them: carriers, plane solids of sections, trees of nodes.
 *
 * json_solid.c, json_write.c   splines under carriers, carriers
 * json_stack.c                 stacks of sections
 * json_scene.c, json_nodes.c   trees: loading and saving; json_layout.c: the arguments of nodes */
#ifndef BATTEN_EXCHANGE_JSON_SOLID_H
#define BATTEN_EXCHANGE_JSON_SOLID_H

#include "json_carrier.h"
#include "json_read.h"
#include "write_file.h"

#include <batten/exchange.h>

/* ---- loading -------------------------------------------------------------------------------------------- */

/* The kernel found something wrong with values that are well-formed. */
batten_status bx_explain(bx_json *j, batten_status st);
batten_status bx_get_dimension(bx_json *j, const json_t *object, unsigned *n);
/* A text that is one of names [count]; left out: *out stays. */
batten_status bx_get_choice(bx_json *j, const json_t *object, const char *key, size_t count, const char *const *names,
                            int *out);

/* depth: solids and carriers around this one. */
batten_status bx_load_solid_members(bx_json *j, const json_t *object, unsigned depth, batten_solid **out);
batten_status bx_load_carrier(bx_json *j, const json_t *object, unsigned n, unsigned depth, batten_carrier **out);
/* Of the kind that is known. */
batten_status bx_load_carrier_members(bx_json *j, const json_t *object, const bx_carrier_layout *layout, unsigned n,
                                      unsigned depth, batten_carrier **out);
batten_status bx_load_stack(bx_json *j, const json_t *object, unsigned depth, batten_solid **out);
batten_status bx_load_tree(bx_json *j, const json_t *object, unsigned depth, batten_solid **out);
/* The members origin, rotation and contours. */
batten_status bx_get_section(bx_json *j, const json_t *object, batten_section *out);

/* ---- saving --------------------------------------------------------------------------------------------- */

/* Can it be saved? Before a file is opened. INVALID: there is a callback of the host. */
batten_status bx_check_carrier(batten_context *ctx, const batten_carrier *carrier);
batten_status bx_check_solid(batten_context *ctx, const batten_solid *solid);
batten_status bx_check_stack(batten_context *ctx, const batten_solid *solid);
batten_status bx_check_nodes(batten_context *ctx, const batten_frep *root);

/* Without the braces around them. What fails stays with the writer. */
void bx_put_solid_members(bx_writer *w, const batten_solid *solid);
void bx_put_stack(bx_writer *w, const batten_solid *solid);
void bx_put_tree(bx_writer *w, const batten_solid *solid);
void bx_put_section_members(bx_writer *w, const batten_section *section);
/* "nodes": {...}, "root": ... */
void bx_put_nodes(bx_writer *w, const batten_frep *root);

void bx_put_carrier(bx_writer *w, const batten_carrier *carrier);
/* One row a line. */
void bx_put_solid_rows(bx_writer *w, const double *values, size_t rows, size_t width);

#endif
