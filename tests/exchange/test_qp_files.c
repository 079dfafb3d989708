/* Quadratic programs as QPS and JSON: the rules of the format by hand, round trips to the same bits, what is refused.
 */
#include "qp_files.h"

#include <zlib.h>

static const double NONE = INFINITY;

/* Fixed columns, with names that have blanks, D exponents, a card number behind column 61. */
static const char *const fixed_columns =
    "* the second of Hock and Schittkowski's problems, with more rows\n"
    "NAME          TWO WORDS\n"
    "ROWS\n"
    " N  OBJ.FUNC\n"
    " G  ROW 1\n"
    " L  ROW 2\n"
    " E  R------3\n"
    " N  OTHER\n"
    "COLUMNS\n"
    "    C------1  ROW 1     0.100000D+02   OBJ.FUNC  0.500000d+00\n"
    "    C------1  R------3  -.250000E-01   OTHER     0.700000e+01        17\n"
    "    C 2       ROW 1     -1             ROW 2     +3\n"
    "RHS\n"
    "    RHS       OBJ.FUNC  0.100000e+03   ROW 1     0.100000e+02\n"
    "    RHS       R------3  -4\n"
    "RANGES\n"
    "    RNG       ROW 1     2.5            R------3  -1\n"
    "BOUNDS\n"
    " LO BND       C------1  0.200000e+01\n"
    " UP BND       C------1  0.500000e+02\n"
    " UP BND       C 2       -.500000e+02\n"
    "QUADOBJ\n"
    "    C------1  C------1  0.200000e-01   C 2       -1\n"
    "    C 2       C 2       0.200000e+01\n"
    "ENDATA\n"
    "nothing of this counts\n";

/* The same as words. */
static const char *const free_columns =
    "NAME\tTWO WORDS \r\n"
    "OBJSENSE MIN\r\n"
    "ROWS\r\n"
    "\tN\tOBJ.FUNC\r\n G ROW_1\r\n  L  ROW_2\r\n E R------3\r\n n OTHER\r\n"
    "COLUMNS\r\n"
    " C------1 ROW_1 1e1 OBJ.FUNC .5\r\n\r\n"
    " C------1 R------3 -0.025 OTHER 7\r\n"
    "* in between\r\n"
    " C_2 ROW_1 -1 ROW_2 3\r\n"
    "RHS\r\n OBJ.FUNC 100\tROW_1 10\r\n R------3 -4\r\n"
    "RANGES\r\n ROW_1 -2.5 R------3 -1\r\n" /* of G and L only the size counts */
    "BOUNDS\r\n LO C------1 2\r\n UP C------1 50\r\n UP C_2 -50\r\n"
    "QMATRIX\r\n C------1 C------1 2e-2\r\n C------1 C_2 -1\r\n C_2 C------1 -1\r\n C_2 C_2 2\r\n"
    "ENDATA";

static void check_by_hand(const batten_qp_file *f, const char *what) {
  const batten_qp_problem *p = &f->problem;
  static const double h[] = {0.02, -1, -1, 2}, c[] = {10, -1, 3, -0.025}, g[] = {0.5, 0};
  const double lower[] = {10, -NONE, -5}, upper[] = {12.5, 0, -4}, x_lower[] = {2, -NONE}, x_upper[] = {50, -50};
  static const size_t h_starts[] = {0, 2, 4}, c_starts[] = {0, 2, 3, 4};
  static const uint32_t h_indices[] = {0, 1, 0, 1}, c_indices[] = {0, 1, 1, 0};
  const batten_matrix hm = batten_matrix_sparse(2, 2, h_starts, h_indices, h);
  const batten_matrix cm = batten_matrix_sparse(3, 2, c_starts, c_indices, c);
  bool blanks = strchr(f->row_names[0], ' ');
  char *rows[] = {blanks ? "ROW 1" : "ROW_1", blanks ? "ROW 2" : "ROW_2", "R------3"};
  char *columns[] = {"C------1", blanks ? "C 2" : "C_2"};
  batten_qp_file expected = {.problem = {.struct_size = sizeof *p,
                                         .n = 2,
                                         .h = &hm,
                                         .g = g,
                                         .constant = -100,
                                         .c = &cm,
                                         .lower = lower,
                                         .upper = upper,
                                         .x_lower = x_lower,
                                         .x_upper = x_upper},
                             .name = "TWO WORDS",
                             .unknown_names = columns,
                             .row_names = rows};
  const char *wrong = qp_difference(f, &expected);
  T_CHECK(!wrong && p->struct_size == sizeof *p, "%s: as by hand; differs: %s", what, wrong ? wrong : "nothing");
}

static void test_by_hand(batten_context *ctx) {
  batten_qp_file f = {0};
  T_OK(qp_of(ctx, "fixed.QPS", fixed_columns, strlen(fixed_columns), &f), ctx);
  check_by_hand(&f, "fixed columns with blanks in names");
  batten_qp_file_free(ctx, &f);
  T_CHECK(!f.memory && !f.problem.n && batten_bytes_in_use(ctx) == 0, "freeing leaves nothing");
  T_OK(qp_of(ctx, "free.mps", free_columns, strlen(free_columns), &f), ctx);
  check_by_hand(&f, "free columns, tabs, CRLF, no names of sets, QMATRIX");
  batten_qp_file_free(ctx, &f);
  batten_qp_file_free(ctx, NULL);

  z_stream zip = {0};
  static unsigned char packed[4096];
  deflateInit2(&zip, 9, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY);
  zip.next_in = (unsigned char *)(uintptr_t)fixed_columns;
  zip.avail_in = (unsigned)strlen(fixed_columns);
  zip.next_out = packed;
  zip.avail_out = sizeof packed;
  int result = deflate(&zip, Z_FINISH);
  size_t size = sizeof packed - zip.avail_out;
  deflateEnd(&zip);
  if (result == Z_STREAM_END) T_OK(qp_of(ctx, "fixed.sif.gz", packed, size, &f), ctx);
  check_by_hand(&f, "gzip");
  batten_qp_file_free(ctx, &f);
}

/* ---- rules ------------------------------------------------------------------------------------------ */

static void test_sides(batten_context *ctx) {
  static const char *const text =
      "NAME\nROWS\n N o\n E e0\n E e+\n E e-\n L l\n G g\n L lf\n G gf\n E ez\n L lr\n G gr\nCOLUMNS\n x o 1 e0 1\n"
      "RHS\n R e0 7 e+ 7\n R e- 7 l 7\n R g 7 lf 1e20\n R gf -1e+30 ez 7\n"
      "RANGES\n R e+ 2 e- -2\n R l 2 g -2\n R ez 0 lr inf\n R lf 1 gf inf\n R gr 1e21\nENDATA\n";
  const double lower[] = {7, 7, 5, 5, 7, -NONE, -NONE, 7, -NONE, 0};
  const double upper[] = {7, 9, 7, 7, 9, NONE, NONE, 7, 0, NONE};
  batten_qp_file f = {0};
  T_OK(qp_of(ctx, "a.qps", text, strlen(text), &f), ctx);
  T_CHECK(same_numbers(f.problem.lower, lower, 10) && same_numbers(f.problem.upper, upper, 10),
          "right-hand sides and ranges of E, L and G, finite and not");
  T_CHECK(!f.problem.h && f.name[0] == '\0', "neither Hessian nor name");
  batten_qp_file_free(ctx, &f);
}

static void test_bounds(batten_context *ctx) {
  static const char *const text =
      "NAME\nROWS\n N o\nCOLUMNS\n a o 1\n b o 1\n c o 1\n d o 1\n e o 1\n f o 1\n g o 1\n h o 1\n i o 1\n j o 1\n"
      "BOUNDS\n UP B b -1\n LO B c -2\n UP B c -1\n FX B d 3\n FR B e\n FR B e 0\n MI B f\n UP B f 4\n UP B g -1\n"
      " LO B g -5\n PL B h\n UP B i 1e20\n LO B j -Infinity\n UP B j 9.1e19\nENDATA\n";
  const double lower[] = {0, -NONE, -2, 3, -NONE, -NONE, -5, 0, 0, -NONE};
  const double upper[] = {NONE, -1, -1, 3, NONE, 4, -1, NONE, NONE, NONE};
  batten_qp_file f = {0};
  T_OK(qp_of(ctx, "a.qps", text, strlen(text), &f), ctx);
  T_CHECK(same_numbers(f.problem.x_lower, lower, 10) && same_numbers(f.problem.x_upper, upper, 10),
          "bounds of every type, the MPS rule for negative upper ones");
  T_CHECK(!f.problem.c && !f.problem.lower && !f.row_names, "no rows");
  batten_qp_file_free(ctx, &f);
}

static void test_maximise(batten_context *ctx) {
  static const char *const text =
      "NAME\nOBJSENSE\n    MAX\nROWS\n N o\n L r\nCOLUMNS\n x o 3 r 1\n y r 1\nRHS\n R o 5 r 2\nQSECTION o\n x x "
      "-4\nENDATA\n";
  batten_qp_file f = {0};
  T_OK(qp_of(ctx, "a.qps", text, strlen(text), &f), ctx);
  T_CHECK(f.problem.g[0] == -3 && f.problem.g[1] == 0 && !signbit(f.problem.g[1]) && f.problem.constant == 5 &&
              f.problem.h->values[0] == 4 && f.problem.upper[0] == 2 && f.problem.c->values[0] == 1,
          "to be maximised: the objective changes its sign, the rows do not");
  batten_qp_file_free(ctx, &f);
}

/* A name that is a word of another one's card, and cards only where words fail. */
static void test_ambiguous(batten_context *ctx) {
  static const char *const text =
      "NAME\nROWS\n N  OBJ\n L  R 1\n L  R\nCOLUMNS\n"
      "    A         R 1       1.0            OBJ       2.0\n"
      "    A 1       R         4.0\n"
      "    1         R         5.0\n"
      "RHS\n"
      "              R 1       6.0            R         7.0\n"
      "BOUNDS\n"
      " FR B         A 1\n"
      " UP B         1         2.0\n"
      " MI           A\n"
      "ENDATA\n";
  const double c[] = {1, 4, 5}, upper[] = {6, 7}, x_lower[] = {-NONE, -NONE, 0}, x_upper[] = {NONE, NONE, 2};
  batten_qp_file f = {0};
  T_STATUS(qp_of(ctx, "a.qps", text, strlen(text), &f), BATTEN_E_FORMAT, ctx, "a second set '' beside 'B'");
  char copy[600];
  snprintf(copy, sizeof copy, "%s", text);
  memcpy(strstr(copy, " MI  "), " MI B", 5);
  T_OK(qp_of(ctx, "a.qps", copy, strlen(copy), &f), ctx);
  T_CHECK(f.problem.n == 3 && same_numbers(f.problem.c->values, c, 3) && same_numbers(f.problem.upper, upper, 2) &&
              same_numbers(f.problem.x_lower, x_lower, 3) && same_numbers(f.problem.x_upper, x_upper, 3),
          "names that begin with other names");
  batten_qp_file_free(ctx, &f);
}

/* ---- round trips ------------------------------------------------------------------------------------ */

enum { UNKNOWNS = 9, ROWS = 14, SQUARES = 11 };

typedef struct scene {
  batten_qp_file file;
  batten_matrix a, h, c;
  double dense[3][ROWS * UNKNOWNS], vectors[9][ROWS + UNKNOWNS];
  size_t starts[3][ROWS + 1];
  uint32_t indices[3][ROWS * UNKNOWNS];
  char text[2][ROWS + UNKNOWNS][8];
  char *names[2][ROWS + UNKNOWNS];
} scene;

static void fill_matrix(scene *s, int i, batten_matrix *m, size_t rows, bool sparse, uint64_t *seed) {
  double *to = s->dense[i];
  size_t count = 0;
  for (size_t r = 0; r < rows; r++) {
    s->starts[i][r] = count;
    for (uint32_t j = 0; j < UNKNOWNS; j++) {
      double value = any_number(seed);
      if (i == 1 && j < r && !sparse) value = to[j * UNKNOWNS + r];
      if (i == 1 && sparse && j != r) continue;
      if (sparse && i != 1 && t_random(seed) % 2) continue;
      if (sparse && !(value < 0 || value > 0)) value = 1; /* QPS leaves zeros out */
      s->indices[i][count] = j;
      to[count++] = value;
    }
  }
  s->starts[i][rows] = count;
  *m = sparse ? batten_matrix_sparse(rows, UNKNOWNS, s->starts[i], s->indices[i], to)
              : batten_matrix_dense(rows, UNKNOWNS, to);
}

static void make_scene(scene *s, bool sparse, bool squares, uint64_t seed) {
  memset(s, 0, sizeof *s);
  fill_matrix(s, 0, &s->a, SQUARES, sparse, &seed);
  fill_matrix(s, 1, &s->h, UNKNOWNS, sparse, &seed);
  fill_matrix(s, 2, &s->c, ROWS, sparse, &seed);
  for (int v = 0; v < 9; v++)
    for (size_t i = 0; i < ROWS + UNKNOWNS; i++) s->vectors[v][i] = any_number(&seed);
  for (size_t i = 0; i < ROWS + UNKNOWNS; i++) {
    uint64_t kind = t_random(&seed) % 6;
    double *lower = &s->vectors[2][i], *upper = &s->vectors[3][i];
    *upper = *lower + fabs(*upper);
    if (kind & 1) *lower = -NONE;
    if (kind & 2) *upper = NONE;
    if (kind == 4) *upper = *lower;
    s->vectors[1][i] = fabs(s->vectors[1][i]);
    for (int k = 0; k < 2; k++) {
      snprintf(s->text[k][i], sizeof s->text[k][i], "%c\"\\%zu", k ? 'r' : 'x', i);
      s->names[k][i] = s->text[k][i];
    }
  }
  s->file.problem = (batten_qp_problem){.struct_size = sizeof s->file.problem,
                                        .n = UNKNOWNS,
                                        .h = &s->h,
                                        .g = s->vectors[4],
                                        .constant = s->vectors[5][0],
                                        .c = &s->c,
                                        .lower = s->vectors[2],
                                        .upper = s->vectors[3],
                                        .x_lower = s->vectors[2] + ROWS,
                                        .x_upper = s->vectors[3] + ROWS};
  s->file.name = "made \"up\" \xc3\xa4";
  s->file.unknown_names = s->names[0];
  s->file.row_names = s->names[1];
  if (!squares) return;
  s->file.problem.a = &s->a;
  s->file.problem.b = s->vectors[0];
  s->file.problem.weights = s->vectors[1];
  s->file.x0 = s->vectors[6];
}

static void test_round_trips(batten_context *ctx, scratch *folder) {
  static scene s;
  char first[400];
  for (unsigned k = 0; k < 4; k++) {
    make_scene(&s, k & 1, k & 2, 40 + k);
    batten_qp_file back = {0}, again = {0};
    T_OK(batten_write_qp(ctx, &s.file, scratch_file(folder, "a.json")), ctx);
    T_OK(batten_read_qp(ctx, folder->name, &back), ctx);
    const char *wrong = qp_difference(&s.file, &back);
    T_CHECK(!wrong, "JSON, %s%s: differs: %s", k & 1 ? "sparse" : "dense", k & 2 ? " least squares" : "",
            wrong ? wrong : "nothing");
    if (!(k & 2)) {
      T_OK(batten_write_qp(ctx, &back, scratch_file(folder, "a.qps")), ctx);
      T_OK(batten_read_qp(ctx, folder->name, &again), ctx);
      T_OK(batten_write_qp(ctx, &again, scratch_file(folder, "b.json")), ctx);
      batten_qp_file_free(ctx, &again);
      T_OK(batten_read_qp(ctx, folder->name, &again), ctx);
      T_OK(batten_write_qp(ctx, &again, scratch_file(folder, "b.qps")), ctx);
      snprintf(first, sizeof first, "%s", folder->name);
      T_CHECK(files_equal(first, scratch_file(folder, "a.qps")), "QPS -> JSON -> QPS is the same file");
      /* Dense matrices come back sparse; then all but rounded ranges is as it was. */
      wrong = k & 1 ? qp_difference(&s.file, &again) : NULL;
      T_CHECK(!wrong || !strcmp(wrong, "upper") || !strcmp(wrong, "lower"), "QPS: differs: %s",
              wrong ? wrong : "nothing");
      double most = 0;
      for (size_t i = 0; i < ROWS; i++) {
        double lower = s.vectors[2][i], upper = s.vectors[3][i];
        if (isfinite(lower)) most = fmax(most, fabs(again.problem.lower[i] - lower) / (fabs(lower) + fabs(upper)));
        if (isfinite(upper)) most = fmax(most, fabs(again.problem.upper[i] - upper) / (fabs(lower) + fabs(upper)));
      }
      T_RATIO(most, 0x1p-53, "sides from ranges against the larger");
    }
    batten_qp_file_free(ctx, &back);
    batten_qp_file_free(ctx, &again);
  }
}

static void test_defaults(batten_context *ctx, scratch *folder) {
  batten_qp_file f = {.problem = {.struct_size = sizeof f.problem, .n = 3}}, back = {0};
  T_OK(batten_write_qp(ctx, &f, scratch_file(folder, "bare.qps")), ctx);
  T_OK(batten_read_qp(ctx, folder->name, &back), ctx);
  T_CHECK(back.problem.n == 3 && back.problem.x_lower[2] == -NONE && !strcmp(back.unknown_names[2], "x3"),
          "a problem of nothing: free unknowns x1, x2, x3");
  batten_qp_file_free(ctx, &back);
  T_OK(batten_write_qp(ctx, &f, scratch_file(folder, "bare.json")), ctx);
  T_OK(batten_read_qp(ctx, folder->name, &back), ctx);
  T_CHECK(back.problem.n == 3 && !back.problem.x_lower && !back.problem.h && !back.problem.c && !back.unknown_names,
          "as JSON nothing is added but g");
  batten_qp_file_free(ctx, &back);
}

static void test_solutions(batten_context *ctx, scratch *folder) {
  static const size_t starts[] = {0, 0, 0};
  batten_matrix c = batten_matrix_sparse(2, 2, starts, NULL, NULL);
  char *names[] = {"a,b", "c\"d"};
  batten_qp_file f = {.problem = {.struct_size = sizeof f.problem, .n = 2, .c = &c}, .unknown_names = names};
  double x[] = {0.1, -1e300}, y[] = {1, 2, 3, 4.5}, proof[] = {0, 1, 0, -1}, ray[] = {1, 0};
  signed char active[] = {-1, 1, 2, 0};
  batten_qp_solution s = {.x = x, .multipliers = y, .active = active, .certificate = proof, .ray = ray};
  static const struct {
    batten_status status;
    const char *name, *text;
  } cases[] = {
      {BATTEN_OK, "s.json",
       "{\"batten\": \"qp_solution\", \"version\": 1,\n\"status\": \"optimal\",\n\"x\": [0.1, -1e+300],\n"
       "\"multipliers\": [1, 2, 3, 4.5],\n\"active\": [-1, 1, 2, 0]\n}\n"},
      {BATTEN_E_INFEASIBLE, "s.json",
       "{\"batten\": \"qp_solution\", \"version\": 1,\n\"status\": \"infeasible\",\n\"certificate\": [0, 1, 0, "
       "-1]\n}\n"},
      {BATTEN_E_NOT_CONVEX, "s.json",
       "{\"batten\": \"qp_solution\", \"version\": 1,\n\"status\": \"not convex\",\n\"ray\": [1, 0]\n}\n"},
      {BATTEN_E_LIMIT, "s.json", "{\"batten\": \"qp_solution\", \"version\": 1,\n\"status\": \"limit\"\n}\n"},
      {BATTEN_W_STOPPED, "s.CSV", "\"a,b\",0.1\n\"c\"\"d\",-1e+300\n"}};
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    T_OK(batten_write_qp_solution(ctx, &f, cases[i].status, &s, scratch_file(folder, cases[i].name)), ctx);
    size_t size;
    unsigned char *bytes = file_read(folder->name, &size);
    T_CHECK(size == strlen(cases[i].text) && !memcmp(bytes, cases[i].text, size), "%s of %s", cases[i].name,
            batten_status_name(cases[i].status));
    free(bytes);
  }
  T_STATUS(batten_write_qp_solution(ctx, &f, BATTEN_E_LIMIT, &s, scratch_file(folder, "s.csv")), BATTEN_E_INVALID,
           ctx, "s.csv: .csv takes x, and there is none");
  T_STATUS(batten_write_qp_solution(ctx, &f, BATTEN_OK, &s, scratch_file(folder, "s.txt")), BATTEN_E_INVALID, ctx,
           "written as .json or .csv");
  x[1] = NAN;
  T_STATUS(batten_write_qp_solution(ctx, &f, BATTEN_OK, &s, scratch_file(folder, "s.csv")), BATTEN_E_INVALID, ctx,
           "solution.x[1]: nan");
  T_STATUS(batten_write_qp_solution(ctx, &f, BATTEN_OK, NULL, "s.csv"), BATTEN_E_INVALID, ctx, "solution: NULL");
}

/* Solutions back from files, for a problem of 2 unknowns and 1 row. */
static void test_solutions_read(batten_context *ctx, scratch *folder) {
#define SOLUTION(members) "{\"batten\": \"qp_solution\", \"version\": 1" members "}"
#define ACTIVE ", \"x\": [1, 2], \"multipliers\": [0, 0, 0], \"active\": "
  static const struct {
    const char *text, *part;
  } cases[] = {
      {"{\"batten\": \"qp\", \"version\": 1}", "document: it holds a batten 'qp', not a qp_solution"},
      {SOLUTION(", \"status\": \"infeasible\", \"certificate\": [1, 1]"),
       "qp_solution: 'x' is missing, as the status is 'infeasible'"},
      {SOLUTION(""), "qp_solution: 'x' is missing"},
      {SOLUTION(", \"x\": [1, 2]"), "qp_solution: 'multipliers' is missing"},
      {SOLUTION(", \"x\": [1, 2, 3]"),
       "qp_solution: 3 numbers in 'x', but the problem has 2 unknowns; is it the solution of another one?"},
      {SOLUTION(ACTIVE "[0, 0]"), "qp_solution: 2 numbers in 'active', but the problem has 3 rows and unknowns"},
      {SOLUTION(ACTIVE "1"), "qp_solution.active: a number, where an array is expected"},
      {SOLUTION(ACTIVE "[0, 0, -2]"),
       "qp_solution.active[2]: -2, where -1 (lower side), 1 (upper), 2 (equality) or 0"},
      {SOLUTION(ACTIVE "[0, 0.5, 0]"), "qp_solution.active[1]: 0.5, where"},
      {SOLUTION(ACTIVE "[0, null, 0]"), "qp_solution.active[1]: null, where a number is expected"},
  };
  static const double none[] = {0, 0};
  batten_matrix c = batten_matrix_dense(1, 2, none);
  batten_qp_file f = {.problem = {.struct_size = sizeof f.problem, .n = 2, .c = &c}};
  double x[] = {7, 7}, y[] = {7, 7, 7};
  signed char active[] = {7, 7, 7};
  batten_qp_solution s = {.x = x, .multipliers = y, .active = active};
  const char *path = scratch_file(folder, "start.json");
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    file_write(path, cases[i].text, strlen(cases[i].text));
    T_STATUS(batten_read_qp_solution(ctx, &f, path, &s), BATTEN_E_FORMAT, ctx, cases[i].part);
    if (x[0] < 7 || y[0] < 7 || active[0] != 7) T_CHECK(false, "the arrays are as they were");
  }
  T_STATUS(batten_read_qp_solution(ctx, &f, "s.csv", &s), BATTEN_E_INVALID, ctx, "solutions are read from .json");
  T_STATUS(batten_read_qp_solution(ctx, &f, "none.json", &s), BATTEN_E_IO, ctx, "none.json: cannot open");
  T_STATUS(batten_read_qp_solution(ctx, &f, path, NULL), BATTEN_E_INVALID, ctx, "solution: NULL");
  T_STATUS(batten_read_qp_solution(ctx, NULL, path, &s), BATTEN_E_INVALID, ctx, "file: NULL");

  double u[] = {0.1, -1e300}, v[] = {1. / 3, 0, -5e-324};
  signed char w[] = {-1, 1, 2};
  T_OK(batten_write_qp_solution(ctx, &f, BATTEN_W_STOPPED,
                                &(batten_qp_solution){.x = u, .multipliers = v, .active = w}, path),
       ctx);
  T_OK(batten_read_qp_solution(ctx, &f, path, &s), ctx);
  T_CHECK(!memcmp(x, u, sizeof u) && !memcmp(y, v, sizeof v) && !memcmp(active, w, sizeof w),
          "what was written comes back to the same bits");
  T_OK(batten_write_qp_solution(ctx, &f, BATTEN_OK, &(batten_qp_solution){.x = u}, path), ctx);
  T_OK(batten_read_qp_solution(ctx, &f, path, &(batten_qp_solution){.x = x}), ctx);
#undef SOLUTION
#undef ACTIVE
}

/* ---- what is refused --------------------------------------------------------------------------------- */

#define HEAD "NAME\nROWS\n N o\n L r\n G s\nCOLUMNS\n x o 1 r 1\n y r 2\n"
#define JSON(members) "{\"batten\": \"qp\", \"version\": 1, " members "}"

static const struct {
  const char *name, *text, *part;
} bad[] = {
    {"a.qps", "", "a.qps:1: the file ends without ENDATA"},
    {"a.qps", HEAD, "a.qps:9: the file ends without ENDATA; is it cut off?"},
    {"a.qps", " x o 1\n", "a.qps:1: data before the first section"},
    {"a.qps", "NAME\nNAME\n", "a.qps:2: a second NAME"},
    {"a.qps", "ROW\n", "a.qps:1: section 'ROW'; known are NAME OBJSENSE ROWS"},
    {"a.qps", "OBJSENSE\n UP\n", "a.qps:2: OBJSENSE 'UP'; MIN or MAX"},
    {"a.qps", "ROWS\n X r\n", "a.qps:2: row type 'X'; known are N, E, L, G"},
    {"a.qps", "ROWS\n E r s\n", "a.qps:2: 3 words, where a row has two"},
    {"a.qps", "ROWS\n E r\n E r\n", "a.qps:3: row 'r' is there twice"},
    {"a.qps", HEAD " z t 1\n", "a.qps:9: row 't' is not in ROWS; check its spelling"},
    {"a.qps", HEAD " z r 1,5\n", "a.qps:9: the number: '1,5' is not a number"},
    {"a.qps", HEAD " z r nan\n", "a.qps:9: the number: 'nan' is not a number"},
    {"a.qps", HEAD " z r 1e999\n", "a.qps:9: the number is too large for a double"},
    {"a.qps", HEAD " z r\n",
     "a.qps:9: a line of COLUMNS has the name of a column, and one or two times the name of a row"},
    {"a.qps", HEAD " y r 1\n", "a.qps:9: a second entry in row 'r'; write their sum"},
    {"a.qps", HEAD " x s 1\n", "a.qps:9: column 'x' comes back after another one"},
    {"a.qps", HEAD " M1 'MARKER' 'INTORG'\n", "a.qps:9: 'MARKER' asks for integer unknowns"},
    {"a.qps", HEAD "RHS\n R t 1\n", "a.qps:10: row 't' is not in ROWS"},
    {"a.qps", HEAD "RHS\n R r 1\n Q s 1\n", "a.qps:11: a second set 'Q' beside 'R'; keep one of them"},
    {"a.qps", HEAD "RHS\n R r 1\n R r 1\n", "a.qps:11: row 'r' has a right-hand side already"},
    {"a.qps", HEAD "RHS\n R s 1e20\n", "a.qps:10: row 's' of type G cannot have a right-hand side of 1e+20"},
    {"a.qps", HEAD "RANGES\n R o 1\n", "a.qps:10: row 'o' is of type N, which has no range"},
    {"a.qps", HEAD "RANGES\n R r 1 r 1\n", "a.qps:10: row 'r' has a range already"},
    {"a.qps", HEAD "BOUNDS\n UP B z 1\n", "a.qps:10: column 'z' is not in COLUMNS"},
    {"a.qps", HEAD "BOUNDS\n XX B x 1\n", "a.qps:10: bound type 'XX'; known are LO, UP, FX, FR, MI, PL"},
    {"a.qps", HEAD "BOUNDS\n BV B x\n", "a.qps:10: BV asks for integer unknowns"},
    {"a.qps", HEAD "BOUNDS\n SC B x 1\n", "a.qps:10: SC asks for a semi-continuous unknown"},
    {"a.qps", HEAD "BOUNDS\n UP B x one\n", "a.qps:10: the bound: 'one' is not a number"},
    {"a.qps", HEAD "BOUNDS\n LO B x 1e20\n", "a.qps:10: a bound LO of inf leaves nothing"},
    {"a.qps", HEAD "BOUNDS\n LO B x 5\n UP B x 4\nENDATA\n",
     "a.qps: column 'x': its lower bound 5 exceeds its upper bound 4"},
    {"a.qps", HEAD "BOUNDS\n UP\n", "a.qps:10: a line of BOUNDS has a type"},
    {"a.qps", HEAD "QUADOBJ\n x z 1\n", "a.qps:10: column 'z' is not in COLUMNS"},
    {"a.qps", HEAD "QUADOBJ\n z x 1\n", "a.qps:10: column 'z' is not in COLUMNS"},
    {"a.qps", HEAD "QUADOBJ\n x y 1\n y x 1\nENDATA\n",
     "a.qps:11: the pair 'x', 'y' is there twice; QUADOBJ lists one triangle"},
    {"a.qps", HEAD "QMATRIX\n x y 1\n y x 2\nENDATA\n", "a.qps:10: the pair 'x', 'y' differs from its mirror image"},
    {"a.qps", HEAD "QMATRIX\n y x 1\nENDATA\n", "a.qps:10: the pair 'x', 'y' differs from its mirror image"},
    {"a.qps", HEAD "QMATRIX\n x x 1\n x x 1\nENDATA\n", "a.qps:11: the pair 'x', 'x' is there twice; write the sum"},
    {"a.qps", HEAD "QUADOBJ\nQMATRIX\n", "a.qps:10: a second section for the Hessian"},
    {"a.qps", HEAD "QSECTION r\n", "a.qps:9: a quadratic constraint 'r'; batten has linear ones only"},
    {"a.qps", HEAD "QCMATRIX r\n", "a.qps:9: QCMATRIX: quadratic constraints"},
    {"a.json", "{\"batten\": \"solid\", \"version\": 1}", "document: it holds a batten 'solid', not a qp"},
    {"a.json", JSON("\"H\": {\"rows\": [], \"cols\": [], \"values\": []}"),
     "qp: no array says how many unknowns there are"},
    {"a.json", JSON("\"n\": 3, \"g\": [1]"), "qp: 'n' is 3, but the arrays are of 1 unknowns"},
    {"a.json", JSON("\"g\": [1], \"x_lowr\": [1]"), "qp: 'x_lowr' is not known; is it misspelt?"},
    {"a.json", JSON("\"g\": [1, \"a\"]"), "qp.g[1]: a text, where a number is expected"},
    {"a.json", JSON("\"g\": [1, 2], \"x_lower\": [1]"), "qp.x_lower: an array of 2 numbers or null is expected"},
    {"a.json", JSON("\"g\": [1, 2], \"x_upper\": [1, true]"),
     "qp.x_upper[1]: a number is expected, or null for none"},
    {"a.json", JSON("\"g\": [1, 2], \"x0\": [1, null]"), "qp.x0[1]: null, where a number is expected"},
    {"a.json", JSON("\"g\": [1, 2], \"H\": [[1, 0]]"), "qp: 'H' has 1 rows, expected 2"},
    {"a.json", JSON("\"g\": [1, 2], \"C\": [[1, 0], [1]]"), "qp.C[1]: 1 numbers, where 2 are expected"},
    {"a.json", JSON("\"g\": [1, 2], \"lower\": [1]"), "qp: 'C' is missing"},
    {"a.json", JSON("\"g\": [1, 2], \"C\": {}"), "qp: 'C' is sparse, so 'lower' or 'upper' must say how many rows"},
    {"a.json", JSON("\"g\": [1], \"C\": {\"rows\": [0]}, \"lower\": [1]"), "qp.C: 'cols' is missing"},
    {"a.json", JSON("\"g\": [1], \"C\": {\"rows\": [1], \"cols\": [0], \"values\": [1]}, \"lower\": [1]"),
     "qp.C.rows[0]: 1, where a whole number from 0 to 0 is expected"},
    {"a.json", JSON("\"g\": [1], \"C\": {\"rows\": [0, 0], \"cols\": [0, 0], \"values\": [1, 1]}, \"lower\": [1]"),
     "qp.C: two entries at row 0, column 0; write their sum"},
    {"a.json", JSON("\"g\": [1], \"C\": {\"rows\": [0], \"cols\": [0, 0], \"values\": [1, 1]}, \"lower\": [1]"),
     "qp.C: 1 in 'rows', 2 in 'cols', 2 in 'values'"},
    {"a.json", JSON("\"g\": [1], \"unknown_names\": [1]"), "qp.unknown_names[0]: a text is expected"},
};

static void test_bad(batten_context *ctx, scratch *folder) {
  for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
    batten_qp_file f = {.x0 = (double *)ctx};
    T_STATUS(qp_of(ctx, bad[i].name, bad[i].text, strlen(bad[i].text), &f), BATTEN_E_FORMAT, ctx, bad[i].part);
    if (f.x0 != (double *)ctx || f.memory || batten_bytes_in_use(ctx)) T_CHECK(false, "nothing is touched or left");
  }
  batten_qp_file f = {0};
  T_STATUS(batten_read_qp(ctx, "a.xyz", &f), BATTEN_E_INVALID, ctx, ".qps .sif .mps .json .mat, each also with .gz");
  T_STATUS(batten_read_qp(ctx, "none.qps", &f), BATTEN_E_IO, ctx, "none.qps: cannot open");
  T_STATUS(batten_read_qp(ctx, NULL, &f), BATTEN_E_INVALID, ctx, "path: NULL");
  T_STATUS(batten_read_qp(ctx, "a.qps", NULL), BATTEN_E_INVALID, ctx, "out: NULL");

  static scene s;
  make_scene(&s, true, true, 3);
  const char *path = scratch_file(folder, "refused.qps");
  T_STATUS(batten_write_qp(ctx, &s.file, path), BATTEN_E_INVALID, ctx,
           "problem.a: QPS has no least squares; write .json");
  s.file.problem.a = NULL;
  T_STATUS(batten_write_qp(ctx, &s.file, "a.mat"), BATTEN_E_INVALID, ctx, "written as .qps .sif .mps .json");
  T_STATUS(batten_write_qp(ctx, NULL, path), BATTEN_E_INVALID, ctx, "file: NULL");
  s.names[1][3] = s.names[1][2];
  T_STATUS(batten_write_qp(ctx, &s.file, path), BATTEN_E_INVALID, ctx, "row_names[3]: 'r\"\\2' is there twice");
  s.names[1][3] = "";
  T_STATUS(batten_write_qp(ctx, &s.file, path), BATTEN_E_INVALID, ctx, "row_names[3]: empty");
  s.names[1][3] = "\xff";
  T_STATUS(batten_write_qp(ctx, &s.file, path), BATTEN_E_INVALID, ctx, "row_names[3]: not UTF-8");
  s.file.row_names = NULL;
  s.vectors[3][1] = 1e20;
  T_STATUS(batten_write_qp(ctx, &s.file, path), BATTEN_E_INVALID, ctx,
           "problem.upper[1]: so large that QPS takes it for none");
  s.vectors[3][1] = -NONE;
  T_STATUS(batten_write_qp(ctx, &s.file, path), BATTEN_E_INVALID, ctx, "problem.upper[1]: -inf; inf is none");
  s.vectors[3][1] = 1;
  s.vectors[4][2] = NAN;
  T_STATUS(batten_write_qp(ctx, &s.file, path), BATTEN_E_INVALID, ctx, "problem.g[2]: nan");
  s.file.problem.g = NULL;
  s.indices[2][0] = UNKNOWNS;
  T_STATUS(batten_write_qp(ctx, &s.file, path), BATTEN_E_INVALID, ctx, "problem.c.indices[0]: 9 of 9 columns");
  s.file.problem.c = NULL;
  s.file.problem.lower = s.file.problem.upper = NULL;
  s.indices[1][0] = 1;
  T_STATUS(batten_write_qp(ctx, &s.file, path), BATTEN_E_INVALID, ctx, "problem.h: (0, 1) differs from (1, 0)");
  s.file.problem.struct_size = 0;
  T_STATUS(batten_write_qp(ctx, &s.file, path), BATTEN_E_INVALID, ctx, "batten_qp_problem.struct_size: 0");
  T_CHECK(scratch_count(folder) > 0 && access(path, F_OK), "nothing is written");
}

/* ---- memory, cancel, speed --------------------------------------------------------------------------- */

static batten_status read_again(batten_context *ctx, void *arg) {
  batten_qp_file f = {0};
  batten_status st = batten_read_qp(ctx, arg, &f);
  batten_qp_file_free(ctx, &f);
  return st;
}

typedef struct rewriting {
  const char *from, *to;
} rewriting;

static batten_status write_again(batten_context *ctx, void *arg) {
  const rewriting *w = arg;
  batten_qp_file f = {0};
  batten_status st = batten_read_qp(ctx, w->from, &f);
  if (st == BATTEN_OK) st = batten_write_qp(ctx, &f, w->to);
  batten_qp_file_free(ctx, &f);
  return st;
}

static batten_status read_solution_again(batten_context *ctx, void *arg) {
  double x[2], y[2];
  signed char active[2];
  batten_qp_file f = {.problem = {.struct_size = sizeof f.problem, .n = 2}};
  return batten_read_qp_solution(ctx, &f, arg, &(batten_qp_solution){.x = x, .multipliers = y, .active = active});
}

static void test_failures(scratch *folder) {
  char from[400], qps[400], json[400];
  snprintf(from, sizeof from, "%s", scratch_file(folder, "fail.qps"));
  snprintf(qps, sizeof qps, "%s", scratch_file(folder, "fail2.qps"));
  snprintf(json, sizeof json, "%s", scratch_file(folder, "fail.json"));
  file_write(from, free_columns, strlen(free_columns));
  t_fail_every_allocation("reading QPS", read_again, from);
  rewriting w = {from, qps};
  t_fail_every_allocation("QPS again", write_again, &w);
  w.to = json;
  t_fail_every_allocation("QPS as JSON", write_again, &w);
  t_fail_every_allocation("reading JSON", read_again, json);
  t_cancel_every_progress("reading QPS", read_again, from);
  t_cancel_every_progress("reading JSON", read_again, json);
  static const char solution[] =
      "{\"batten\": \"qp_solution\", \"version\": 1, \"x\": [1, 2], \"multipliers\": [0, 0], \"active\": [0, 0]}";
  file_write(json, solution, strlen(solution));
  t_fail_every_allocation("reading a solution", read_solution_again, json);
}

static void test_speed(batten_context *ctx, scratch *folder) {
  enum { SIDE = 25000, ENTRIES = 40 };
  FILE *f = fopen(scratch_file(folder, "large.qps"), "w");
  uint64_t seed = 5;
  fprintf(f, "NAME large\nROWS\n N OBJ\n");
  for (int i = 0; i < SIDE; i++) fprintf(f, " G ROW%d\n", i);
  fprintf(f, "COLUMNS\n");
  for (int j = 0; j < SIDE; j++)
    for (int k = 0; k < ENTRIES; k += 2)
      fprintf(f, "    COLUMN%-7d ROW%-7d %.15g ROW%-7d %.6f\n", j, (j + 37 * k) % SIDE, t_uniform(&seed),
              (j + 37 * k + 37) % SIDE, t_uniform(&seed));
  fprintf(f, "ENDATA\n");
  fclose(f);
  batten_qp_file file = {0}, back = {0};
  double start = batten_now();
  T_OK(batten_read_qp(ctx, folder->name, &file), ctx);
  double read = batten_now() - start;
  T_CHECK(file.problem.c && file.problem.c->starts[SIDE] == (size_t)SIDE * ENTRIES, "all entries are there");
  start = batten_now();
  T_OK(batten_write_qp(ctx, &file, scratch_file(folder, "large.json")), ctx);
  double written = batten_now() - start;
  start = batten_now();
  T_OK(batten_read_qp(ctx, folder->name, &back), ctx);
  printf("# %d entries: QPS read in %.2f s, JSON written in %.2f s, read in %.2f s\n", SIDE * ENTRIES, read, written,
         batten_now() - start);
  T_CHECK(!qp_difference(&file, &back), "and come back as JSON");
  batten_qp_file_free(ctx, &file);
  batten_qp_file_free(ctx, &back);
}

static void test_status_words(void) {
  static const struct {
    batten_status status;
    const char *word;
  } words[] = {{BATTEN_OK, "optimal"},
               {BATTEN_W_ACCURACY, "inaccurate"},
               {BATTEN_W_STOPPED, "stopped"},
               {BATTEN_E_INFEASIBLE, "infeasible"},
               {BATTEN_E_UNBOUNDED, "unbounded"},
               {BATTEN_E_NOT_CONVEX, "not convex"},
               {BATTEN_E_LIMIT, "limit"},
               {BATTEN_E_NOMEM, "BATTEN_E_NOMEM"}};
  for (size_t i = 0; i < sizeof words / sizeof *words; i++)
    T_CHECK(strcmp(batten_qp_status_word(words[i].status), words[i].word) == 0, "%s is told as '%s'",
            batten_status_name(words[i].status), words[i].word);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  scratch folder;
  scratch_open(&folder);
  test_by_hand(ctx);
  test_sides(ctx);
  test_bounds(ctx);
  test_maximise(ctx);
  test_ambiguous(ctx);
  test_round_trips(ctx, &folder);
  test_defaults(ctx, &folder);
  test_solutions(ctx, &folder);
  test_solutions_read(ctx, &folder);
  test_bad(ctx, &folder);
  test_failures(&folder);
  test_speed(ctx, &folder);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "no memory is left");
  batten_context_free(ctx);
  scratch_close(&folder);
  test_status_words();
  return t_done();
}
