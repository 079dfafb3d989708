/* The writers of the formats, on a file that is open. Errors stay with the writer until bx_commit. */
#ifndef BATTEN_EXCHANGE_WRITE_H
#define BATTEN_EXCHANGE_WRITE_H

#include "write_file.h"

#include <batten/exchange.h>

/* The shortest text that reads back to the same bits, with a decimal point in every locale. */
void bx_put_number(bx_writer *w, double value);
/* A name as one word of a header: blanks and bytes that are no ASCII become '_'. */
void bx_put_word(bx_writer *w, const char *name);
/* count numbers with blanks between. */
void bx_put_numbers(bx_writer *w, const double *values, size_t count);

void bx_write_vtp(bx_writer *w, const batten_mesh *mesh);
void bx_write_vtu(bx_writer *w, const batten_mesh *mesh);
void bx_write_vtk(bx_writer *w, const batten_mesh *mesh);

/* A text of JSON in its quotes; it is UTF-8. */
void bx_put_json_text(bx_writer *w, const char *text);
/* [1, 2, ...], eight a line; [[...], [...]] with what is between the rows: ", " or ",\n". Numbers are finite. */
void bx_put_json_numbers(bx_writer *w, const double *values, size_t count);
void bx_put_json_rows(bx_writer *w, const double *values, size_t rows, size_t width, const char *between);

void bx_write_json_qp(bx_writer *w, const batten_qp_file *file);
void bx_write_json_qp_solution(bx_writer *w, size_t n, size_t m, batten_status status,
                               const batten_qp_solution *solution);
/* Needs memory of its own; NOMEM and INVALID are the writer's. */
void bx_write_qps(bx_writer *w, const batten_qp_file *file);

#endif
