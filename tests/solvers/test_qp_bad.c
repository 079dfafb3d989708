/* Quadratic programs that are refused: each mistake, and the text that names it. Nothing is written then. */
#include <batten/qp.h>

#include "tap.h"

/* minimise 1/2 |x|^2 subject to 1 <= x0 + x1, 0 <= x <= 4: right as it is, for each case to spoil. */
typedef struct right {
  size_t starts[3], a_starts[3];
  uint32_t indices[2], a_indices[2], h_indices[4];
  size_t h_starts[3];
  double values[2], lower[1], upper[1], x_lower[2], x_upper[2], h_values[2], g[2], a_values[2], b[2], weights[2];
  double dense[4], x0[2];
  signed char active[3];
  batten_matrix c, h, a;
  batten_qp_problem p;
  batten_qp_options o;
} right;

static void make_right(right *r) {
  *r = (right){.starts = {0, 2},
               .indices = {0, 1},
               .values = {1, 1},
               .lower = {1},
               .upper = {INFINITY},
               .x_upper = {4, 4},
               .h_starts = {0, 1, 2},
               .h_indices = {0, 1},
               .h_values = {1, 1},
               .a_starts = {0, 1, 2},
               .a_indices = {0, 1},
               .a_values = {1, 1},
               .weights = {1, 1},
               .dense = {1, 0, 0, 1}};
  r->c = batten_matrix_sparse(1, 2, r->starts, r->indices, r->values);
  r->h = batten_matrix_sparse(2, 2, r->h_starts, r->h_indices, r->h_values);
  r->a = batten_matrix_sparse(2, 2, r->a_starts, r->a_indices, r->a_values);
  r->p = batten_qp_problem_default(2);
  r->p.c = &r->c;
  r->p.h = &r->h;
  r->p.a = &r->a;
  r->p.b = r->b;
  r->p.weights = r->weights;
  r->p.g = r->g;
  r->p.lower = r->lower;
  r->p.upper = r->upper;
  r->p.x_lower = r->x_lower;
  r->p.x_upper = r->x_upper;
  r->o = batten_qp_options_default();
  r->o.x0 = r->x0;
  r->o.active = r->active;
}

static batten_context *ctx;

static void refuse(const right *r, batten_status expected, const char *text) {
  double x[2] = {7, 7};
  batten_qp_solution s = {.x = x};
  batten_qp_info info = {.objective = 7};
  T_STATUS(batten_qp_solve(ctx, &r->p, &r->o, NULL, &s, &info), expected, ctx, text);
  size_t bytes = 7;
  batten_status st = batten_qp_bytes(ctx, &r->p, &r->o, &bytes, NULL);
  if (x[0] != 7 || info.objective != 7 || bytes != 7 || st != expected || batten_bytes_in_use(ctx) != 0)
    t_line(false, "%s: outputs untouched, the same from batten_qp_bytes (%s)", text, batten_status_name(st));
}

/* SPOIL(change, text): r.change, then INVALID with text. */
#define SPOIL(change, text)              \
  do {                                   \
    right r;                             \
    make_right(&r);                      \
    r.change;                            \
    refuse(&r, BATTEN_E_INVALID, text);  \
  } while (0)
#define TOO_LARGE(change, text)            \
  do {                                     \
    right r;                               \
    make_right(&r);                        \
    r.change;                              \
    refuse(&r, BATTEN_E_TOO_LARGE, text);  \
  } while (0)

static void test_right(void) {
  right r;
  make_right(&r);
  T_OK(batten_qp_solve(ctx, &r.p, &r.o, NULL, NULL, NULL), ctx);
}

static void test_pointers(void) {
  right r;
  make_right(&r);
  size_t bytes;
  T_CHECK(batten_qp_solve(NULL, &r.p, NULL, NULL, NULL, NULL) == BATTEN_E_INVALID, "no context");
  T_STATUS(batten_qp_solve(ctx, NULL, NULL, NULL, NULL, NULL), BATTEN_E_INVALID, ctx, "problem: NULL");
  T_CHECK(batten_qp_bytes(NULL, &r.p, NULL, &bytes, NULL) == BATTEN_E_INVALID, "no context");
  T_STATUS(batten_qp_bytes(ctx, &r.p, NULL, NULL, NULL), BATTEN_E_INVALID, ctx, "bytes: NULL");
  T_CHECK(batten_qp_workspace_new(NULL, NULL) == BATTEN_E_INVALID, "no context");
  T_STATUS(batten_qp_workspace_new(ctx, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  batten_qp_workspace_free(NULL);

  batten_context *other = t_context(NULL, NULL, 1);
  batten_qp_workspace *w = NULL;
  T_OK(batten_qp_workspace_new(other, &w), other);
  T_STATUS(batten_qp_solve(ctx, &r.p, NULL, w, NULL, NULL), BATTEN_E_INVALID, ctx,
           "workspace: made with another context");
  batten_qp_workspace_free(w);
  batten_context_free(other);
}

static void test_sizes(void) {
  SPOIL(p.struct_size = 0, "batten_qp_problem.struct_size: 0");
  SPOIL(o.struct_size = 8, "batten_qp_options.struct_size: 8");
  SPOIL(c.columns = 3, "problem.c.columns: 3, but there are n = 2 unknowns");
  SPOIL(a.columns = 1, "problem.a.columns: 1, but there are n = 2 unknowns");
  SPOIL(h.rows = 1, "problem.h.rows: 1, but there are n = 2 unknowns");
  SPOIL(h.columns = 1, "problem.h.columns: 1, but there are n = 2 unknowns");
  SPOIL(p.a = NULL, "problem.b: given without problem.a");
  SPOIL(p.c = NULL, "problem.lower: given without problem.c");
  TOO_LARGE(p.n = SIZE_MAX, "together exceed the range of BLAS's integers");
  TOO_LARGE(p.n = (size_t)1 << 40, "together exceed the range of BLAS's integers");
  TOO_LARGE(c.rows = SIZE_MAX - 1, "together exceed the range of BLAS's integers");
  TOO_LARGE(a.rows = (size_t)1 << 33, "together exceed the range of BLAS's integers");
}

static void test_matrices(void) {
  SPOIL(c.dense = r.values, "problem.c: both dense and sparse arrays; give one of the two");
  SPOIL(c.starts = NULL, "problem.c: neither dense nor starts; give one of the two");
  SPOIL(starts[0] = 1, "problem.c.starts[0]: 1; must be 0");
  SPOIL(h_starts[2] = 0, "problem.h.starts[2]: 0 is less than the one before, 1");
  SPOIL(starts[1] = 3, "problem.c.starts[1]: row 0 has 3 entries in 2 columns");
  SPOIL(c.indices = NULL, "problem.c.indices: NULL with 2 entries");
  SPOIL(a.values = NULL, "problem.a.values: NULL with 2 entries");
  SPOIL(indices[1] = 2, "problem.c.indices[1]: 2, but the columns are 0 to 1");
  SPOIL(indices[1] = 0, "problem.c.indices[1]: column 0 twice in row 0; add its values up");
  SPOIL(values[1] = NAN, "problem.c.values[1]: nan is not finite");
  SPOIL(a_values[0] = INFINITY, "problem.a.values[0]: inf is not finite");
  SPOIL(h_values[1] = -INFINITY, "problem.h.values[1]: -inf is not finite");

  right r;
  make_right(&r);
  r.h = batten_matrix_dense(2, 2, r.dense);
  T_OK(batten_qp_solve(ctx, &r.p, &r.o, NULL, NULL, NULL), ctx);
  r.dense[1] = 0.25;
  refuse(&r, BATTEN_E_INVALID, "problem.h: row 1 has 0 in column 0, row 0 has 0.25 in column 1; give both triangles");
  r.dense[1] = NAN;
  refuse(&r, BATTEN_E_INVALID, "problem.h[0][1]: nan is not finite");

  make_right(&r); /* an entry above the diagonal alone, and one below alone */
  r.h_starts[1] = 2, r.h_starts[2] = 3;
  r.h_indices[0] = 0, r.h_indices[1] = 1, r.h_indices[2] = 1;
  double upper[3] = {1, 0.5, 1};
  r.h.values = upper;
  refuse(&r, BATTEN_E_INVALID, "problem.h: row 0 has 0.5 in column 1, row 1 has 0 in column 0");
  r.h_starts[1] = 1;
  r.h_indices[0] = 0, r.h_indices[1] = 0, r.h_indices[2] = 1;
  refuse(&r, BATTEN_E_INVALID, "problem.h: row 0 has 0 in column 1, row 1 has 0.5 in column 0");
}

static void test_vectors(void) {
  SPOIL(b[1] = NAN, "problem.b[1]: nan is not finite");
  SPOIL(g[0] = INFINITY, "problem.g[0]: inf is not finite");
  SPOIL(weights[1] = -2, "problem.weights[1]: -2; must be finite and not negative");
  SPOIL(weights[0] = NAN, "problem.weights[0]: nan; must be finite and not negative");
  SPOIL(weights[0] = INFINITY, "problem.weights[0]: inf; must be finite and not negative");
  SPOIL(p.constant = NAN, "problem.constant: nan is not finite");
  SPOIL(lower[0] = INFINITY, "problem.lower[0]: inf; give a number, or -INFINITY for none");
  SPOIL(lower[0] = NAN, "problem.lower[0]: nan; give a number");
  SPOIL(upper[0] = -INFINITY, "problem.upper[0]: -inf; give a number, or INFINITY for none");
  SPOIL(upper[0] = 0.5, "problem.lower[0]: 1 exceeds problem.upper[0]: 0.5; exchange or relax them");
  SPOIL(x_lower[1] = 5, "problem.x_lower[1]: 5 exceeds problem.x_upper[1]: 4");
  SPOIL(x_lower[0] = INFINITY, "problem.x_lower[0]: inf");
  SPOIL(x_upper[1] = NAN, "problem.x_upper[1]: nan");

  /* far into a long vector, past the part that is looked at in chunks, and in its midst */
  enum { LONG = 10001 };
  double *g = calloc(LONG, sizeof *g);
  batten_qp_problem p = batten_qp_problem_default(LONG);
  p.g = g;
  g[4095] = NAN;
  T_STATUS(batten_qp_solve(ctx, &p, NULL, NULL, NULL, NULL), BATTEN_E_INVALID, ctx, "problem.g[4095]: nan");
  g[4095] = 0;
  g[LONG - 1] = INFINITY;
  T_STATUS(batten_qp_solve(ctx, &p, NULL, NULL, NULL, NULL), BATTEN_E_INVALID, ctx, "problem.g[10000]: inf");
  free(g);
}

static void test_options(void) {
  SPOIL(o.engine = (batten_qp_engine)4, "opt.engine: 4; use one of batten_qp_engine");
  SPOIL(o.engine = (batten_qp_engine)-1, "opt.engine: -1");
  SPOIL(o.tolerance_absolute = -1, "opt.tolerance_absolute: -1; must be finite and not negative");
  SPOIL(o.tolerance_relative = NAN, "opt.tolerance_relative: nan");
  SPOIL(o.time_limit_s = 0, "opt.time_limit_s: 0; give seconds > 0, or INFINITY for none");
  SPOIL(o.time_limit_s = NAN, "opt.time_limit_s: nan");
  SPOIL(o.hand_over = 2, "opt.hand_over: 2; use 0 or 1");
  SPOIL(o.exact = -1, "opt.exact: -1; use 0 or 1");
  SPOIL(x0[1] = NAN, "opt.x0[1]: nan is not finite");
  SPOIL(active[2] = 3, "opt.active[2]: 3; use -1, 0, 1 or 2");
  right r;
  make_right(&r);
  double inside[2] = {1, INFINITY};
  r.o.interior = inside;
  T_OK(batten_qp_solve(ctx, &r.p, &r.o, NULL, NULL, NULL), ctx); /* not asked for: not looked at */
  r.o.exact = 1;
  refuse(&r, BATTEN_E_INVALID, "opt.interior[1]: inf is not finite");
  r.o.exact = 0;
  r.o.tolerance_absolute = r.o.tolerance_relative = 0;
  refuse(&r, BATTEN_E_INVALID, "both 0; give one > 0");
}

int main(void) {
  ctx = t_context(NULL, NULL, 1);
  test_right();
  test_pointers();
  test_sizes();
  test_matrices();
  test_vectors();
  test_options();
  batten_context_free(ctx);
  return t_done();
}
