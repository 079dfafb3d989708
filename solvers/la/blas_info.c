/* What BLAS the process runs, asked at run time: the linker's name says little, since distributions switch the
 * library behind it. See <batten/blas.h>. OpenBLAS's own symbols are looked up rather than linked, because the same
 * binary may run on another BLAS. */
#define _GNU_SOURCE /* dladdr, RTLD_DEFAULT */
#include <batten/blas.h>

#include <dlfcn.h>
#include <stdio.h>
#include <string.h>

#include "fortran.h"

/* dlsym gives an object pointer; POSIX wants it copied into a function pointer. */
static void find(const char *name, void *function, size_t size) {
  void *symbol = dlsym(RTLD_DEFAULT, name);
  memcpy(function, &symbol, size);
}

void batten_blas_describe(char *text, size_t size) {
  char *(*config)(void) = NULL, *(*core)(void) = NULL;
  if (size == 0) return;
  find("openblas_get_config", &config, sizeof config);
  find("openblas_get_corename", &core, sizeof core);
  if (config) {
    snprintf(text, size, "%s, core %s", config(), core ? core() : "unknown");
    return;
  }
  void (*potrf)(const char *, const batten_la_int *, double *, const batten_la_int *, batten_la_int *, size_t) =
      FORTRAN(dpotrf);
  void *address;
  memcpy(&address, &potrf, sizeof address);
  Dl_info info;
  snprintf(text, size, "%s", dladdr(address, &info) && info.dli_fname ? info.dli_fname : "unknown");
}

unsigned batten_blas_threads(void) {
  int (*threads)(void) = NULL;
  find("openblas_get_num_threads", &threads, sizeof threads);
  int count = threads ? threads() : 0;
  return count > 0 ? (unsigned)count : 0;
}
