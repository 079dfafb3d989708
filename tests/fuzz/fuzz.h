/* One input for every reader of a format; shared by the libFuzzer targets and the plain driver. */
#ifndef FUZZ_H
#define FUZZ_H

#include <stddef.h>

/* Reads data as if it were the file `name` (the extension chooses the readers), with all that can be asked of it.
 * NULL when what must hold for any input did hold, else what did not. */
const char *fuzz_read(const char *name, const unsigned char *data, size_t size);

#endif
