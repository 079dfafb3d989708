/* The writers of the formats, on a file that is open. Errors stay with the writer until bx_commit. */
#ifndef BATTEN_EXCHANGE_WRITE_H
#define BATTEN_EXCHANGE_WRITE_H

#include "write_file.h"

#include <batten/exchange.h>

/* The shortest text that reads back to the same bits, with a decimal point in every locale. */
void bx_put_number(bx_writer *w, double value);
/* count numbers with blanks between. */
void bx_put_numbers(bx_writer *w, const double *values, size_t count);

void bx_write_vtp(bx_writer *w, const batten_mesh *mesh);
void bx_write_vtu(bx_writer *w, const batten_mesh *mesh);

#endif
