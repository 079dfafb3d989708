/* The most memory that this process has had resident, in bytes: VmHWM of Linux, elsewhere 0. (getrusage's ru_maxrss
 * would count what the process had before exec.) */
#ifndef BENCH_PEAK_H
#define BENCH_PEAK_H

#include <stdio.h>

static inline size_t peak_resident(void) {
  char line[256];
  size_t kilobytes = 0;
  FILE *file = fopen("/proc/self/status", "r");
  if (!file) return 0;
  while (kilobytes == 0 && fgets(line, sizeof line, file))
    if (sscanf(line, "VmHWM: %zu", &kilobytes) != 1) kilobytes = 0;
  fclose(file);
  return 1024 * kilobytes;
}

#endif
