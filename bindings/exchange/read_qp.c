/* Quadratic programs and their solutions from files: the reader of the format. */
#include "qp_file.h"

batten_status bx_read_qp_from(bx_reader *r, bx_format format, batten_qp_file *out) {
  switch (format) {
    case BX_QPS:
      return bx_read_qps(r, out);
    case BX_MAT:
      return bx_read_mat(r, out);
    default:
      return bx_load_qp(r, out);
  }
}

batten_status batten_read_qp(batten_context *ctx, const char *path, batten_qp_file *out) {
  batten_status st = bx_check_pointers(ctx, path, out, "out");
  if (st != BATTEN_OK) return st;
  bool gz;
  bx_format format = bx_format_of(path, &gz);
  if (format != BX_QPS && format != BX_MAT && format != BX_JSON)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "%s: quadratic programs are read from .qps .sif .mps .json .mat, each also with .gz; rename "
                       "the file",
                       bx_short_path(path));
  bx_reader r;
  st = bx_open(&r, ctx, path);
  if (st != BATTEN_OK) return st;
  st = bx_read_qp_from(&r, format, out);
  bx_close(&r);
  return st;
}

batten_status batten_read_qp_solution(batten_context *ctx, const batten_qp_file *file, const char *path,
                                      batten_qp_solution *solution) {
  batten_status st = bx_check_pointers(ctx, path, file, "file");
  if (st == BATTEN_OK) st = bx_check_pointers(ctx, path, solution, "solution");
  if (st != BATTEN_OK) return st;
  bool gz;
  if (bx_format_of(path, &gz) != BX_JSON)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: solutions are read from .json, also with .gz; rename the file",
                       bx_short_path(path));
  bx_reader r;
  st = bx_open(&r, ctx, path);
  if (st != BATTEN_OK) return st;
  st = bx_load_qp_solution(&r, file->problem.n, file->problem.c ? file->problem.c->rows : 0, solution);
  bx_close(&r);
  return st;
}

void batten_qp_file_free(batten_context *ctx, batten_qp_file *file) {
  if (!file) return;
  bx_qp_store_free(ctx, file->memory);
  *file = (batten_qp_file){0};
}
