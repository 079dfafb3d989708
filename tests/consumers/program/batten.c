/* A program that embeds batten: what each way of building it has to build and run. */
#include <batten/batten.h>
#include <stdio.h>
#include <string.h>

int main(int argc, char **argv) {
  if (argc != 2) return 2;
  printf("batten %s, headers of %d.%d.%d\n", batten_version(), BATTEN_VERSION_MAJOR, BATTEN_VERSION_MINOR,
         BATTEN_VERSION_PATCH);
  if (strcmp(batten_version(), argv[1])) return 1;
  batten_context *ctx = NULL;
  if (batten_context_new(NULL, &ctx) != BATTEN_OK) return 1;
  batten_context_free(ctx);
  return 0;
}
