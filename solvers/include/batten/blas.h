/* Which BLAS and LAPACK the process really runs. */
#ifndef BATTEN_BLAS_H
#define BATTEN_BLAS_H

#include <batten/base.h>

#ifdef __cplusplus
extern "C" {
#endif

/* One line: OpenBLAS's own configuration string and core type when it is OpenBLAS, else the path of the library
 * that holds dpotrf. Written to text [size], always terminated. What the linker named may differ: distributions
 * switch the library behind the name. */
BATTEN_API void batten_blas_describe(char *text, size_t size);

/* Threads that OpenBLAS will use, 0 when unknown. batten never changes it: set OPENBLAS_NUM_THREADS. */
BATTEN_API unsigned batten_blas_threads(void);

#ifdef __cplusplus
}
#endif
#endif
