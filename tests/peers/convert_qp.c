/* Reads a quadratic program and writes it in another format: convert_qp FROM TO. */
#include <batten/exchange.h>

#include <stdio.h>

int main(int argc, char **argv) {
  if (argc != 3) {
    fprintf(stderr, "usage: convert_qp FROM TO\n");
    return 2;
  }
  batten_context *ctx = NULL;
  if (batten_context_new(NULL, &ctx) != BATTEN_OK) return 1;
  batten_qp_file file = {0};
  batten_status st = batten_read_qp(ctx, argv[1], &file);
  if (st == BATTEN_OK) st = batten_write_qp(ctx, &file, argv[2]);
  if (st != BATTEN_OK) fprintf(stderr, "%s\n", batten_error(ctx));
  batten_qp_file_free(ctx, &file);
  batten_context_free(ctx);
  return st != BATTEN_OK;
}
