/* Numbers in text, exact and independent of the locale. */
#ifndef BATTEN_EXCHANGE_NUMBER_H
#define BATTEN_EXCHANGE_NUMBER_H

#include <stdint.h>

typedef enum bx_number_state {
  BX_NUMBER_OK = 0,
  BX_NUMBER_NONE,       /* no number starts here */
  BX_NUMBER_NOT_FINITE, /* nan or inf in one of its spellings */
  BX_NUMBER_TOO_LARGE   /* rounds to infinity, or overflows the integer */
} bx_number_state;

/* The decimal number at text ([+-]digits[.digits][e[+-]digits]), correctly rounded to nearest, ties to even; numbers
 * too small become denormals or zero. *end: the first character behind it (also when not finite or too large). No
 * blanks are skipped. *out is set on OK only. */
bx_number_state bx_parse_number(const char *text, const char **end, double *out);

/* The same for an integer [+-]digits. */
bx_number_state bx_parse_integer(const char *text, const char **end, int64_t *out);

enum { BX_NUMBER_SIZE = 32 };

/* The shortest of 15, 16, 17 digits that reads back to the same bits; value is finite. Returns the length. */
int bx_format_number(double value, char text[BX_NUMBER_SIZE]);

/* The same as CAD files need it: always with a point, and a capital E. */
int bx_format_real(double value, char text[BX_NUMBER_SIZE]);

#endif
