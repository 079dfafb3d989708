/* MATLAB files of quadratic programs, made byte by byte: both byte orders, plain and compressed, small elements,
 * numbers stored as any type; what is refused; sizes that lie. */
#include "qp_files.h"

#include <zlib.h>

enum { INT8 = 1, UINT8, INT16, UINT16, INT32, UINT32, SINGLE, DOUBLE = 9, INT64 = 12, UINT64, MATRIX, COMPRESSED };
enum { CLASS_CELL = 1, CLASS_CHAR = 4, CLASS_SPARSE, CLASS_DOUBLE, CLASS_SINGLE, CLASS_INT8, CLASS_UINT8 };

typedef struct mat {
  unsigned char bytes[1 << 14];
  size_t size;
  bool big, compress;
  size_t element; /* where the variable at hand begins */
} mat;

static void put(mat *m, const void *bytes, size_t count) {
  memcpy(m->bytes + m->size, bytes, count);
  m->size += count;
}

static void put_integer(mat *m, uint64_t value, size_t size) {
  for (size_t i = 0; i < size; i++) m->bytes[m->size + i] = (unsigned char)(value >> 8 * (m->big ? size - 1 - i : i));
  m->size += size;
}

static void begin_file(mat *m, bool big, bool compress) {
  memset(m, 0, sizeof *m);
  m->big = big;
  m->compress = compress;
  memset(m->bytes, ' ', 124);
  memcpy(m->bytes, "MATLAB 5.0 MAT-file, made by a test", 35);
  m->size = 124;
  put_integer(m, 0x0100, 2);
  put_integer(m, 'M' << 8 | 'I', 2);
}

static size_t size_of(int type) {
  static const unsigned char sizes[] = {0, 1, 1, 2, 2, 4, 4, 4, 0, 8, 0, 0, 8, 8};
  return sizes[type];
}

static void put_number(mat *m, int type, double value) {
  uint64_t bits;
  float single = (float)value;
  uint32_t half;
  memcpy(&bits, &value, sizeof bits);
  memcpy(&half, &single, sizeof half);
  put_integer(m, type == DOUBLE ? bits : type == SINGLE ? half : (uint64_t)(int64_t)value, size_of(type));
}

/* An element of numbers; small where it fits into the tag and that is wanted. */
static void put_numbers(mat *m, int type, const double *values, size_t count, bool small) {
  size_t bytes = count * size_of(type);
  small = small && bytes <= 4 && bytes > 0;
  if (small) {
    put_integer(m, (uint64_t)bytes << 16 | (unsigned)type, 4);
  } else {
    put_integer(m, (unsigned)type, 4);
    put_integer(m, bytes, 4);
  }
  for (size_t i = 0; i < count; i++) put_number(m, type, values[i]);
  while (small ? m->size % 4 : (m->size - m->element) % 8) m->bytes[m->size++] = 0;
  if (small)
    while ((m->size - m->element) % 8) m->bytes[m->size++] = 0;
}

/* Tag, flags, dimensions, name. */
static void begin_variable(mat *m, unsigned flags, size_t rows, size_t columns, const char *name) {
  double dimensions[2] = {(double)rows, (double)columns}, letters[80];
  m->element = m->size;
  put_integer(m, MATRIX, 4);
  put_integer(m, 0, 4);
  put_integer(m, UINT32, 4);
  put_integer(m, 8, 4);
  put_integer(m, flags, 4);
  put_integer(m, 3, 4);
  put_numbers(m, INT32, dimensions, 2, false);
  for (size_t i = 0; name[i]; i++) letters[i] = name[i];
  put_numbers(m, INT8, letters, strlen(name), true);
}

static void end_variable(mat *m) {
  size_t size = m->size - m->element - 8, end = m->size;
  m->size = m->element + 4;
  put_integer(m, size, 4);
  m->size = end;
  if (!m->compress) return;
  static unsigned char packed[1 << 14];
  uLongf length = sizeof packed;
  if (compress2(packed, &length, m->bytes + m->element, m->size - m->element, 9) != Z_OK) t_line(false, "zlib");
  m->size = m->element;
  put_integer(m, COMPRESSED, 4);
  put_integer(m, length, 4);
  put(m, packed, length); /* compressed elements are not filled up */
}

static void put_full(mat *m, const char *name, size_t rows, size_t columns, const double *values, int type) {
  begin_variable(m, CLASS_DOUBLE, rows, columns, name);
  put_numbers(m, type, values, rows * columns, true);
  end_variable(m);
}

static void put_sparse(mat *m, const char *name, size_t rows, size_t columns, const double *row_of,
                       const double *starts, const double *values, int type) {
  begin_variable(m, CLASS_SPARSE, rows, columns, name);
  size_t count = (size_t)starts[columns];
  put_numbers(m, INT32, row_of, count, true);
  put_numbers(m, INT32, starts, columns + 1, true);
  put_numbers(m, type, values, count, true);
  end_variable(m);
}

/* min x^2 + 1.5 y^2 - x y + x - 2 y + 3, 1 <= x + 2 y, y - x <= 4, and bounds as the last two rows. */
static const double p_rows[] = {0, 1, 0, 1}, p_starts[] = {0, 2, 4}, p_values[] = {2, -1, -1, 3};
static const double a_rows[] = {0, 1, 2, 0, 1, 3}, a_starts[] = {0, 3, 6}, a_values[] = {1, -1, 1, 2, 1, 1};
static const double q[] = {1, -2}, l[] = {1, -1e20, 0, -9.9e19}, u[] = {1e20, 4, 10, 1e21};
static const double p_full[] = {2, -1, -1, 3}, a_full[] = {1, -1, 1, 0, 2, 1, 0, 1};

static void make(mat *m, bool big, bool compress, bool full, int integers) {
  static const double r = 3, n = 2, rows = 4, pi = 3.14159;
  begin_file(m, big, compress);
  begin_variable(m, CLASS_CHAR, 1, 2, "remark"); /* passed over */
  put_numbers(m, UINT16, q, 0, false);
  end_variable(m);
  put_full(m, "pi", 1, 1, &pi, DOUBLE);
  put_full(m, "n", 1, 1, &n, integers);
  put_full(m, "m", 1, 1, &rows, integers);
  put_full(m, "q", 2, 1, q, INT8);
  put_full(m, "l", 4, 1, l, DOUBLE);
  put_full(m, "u", 1, 4, u, DOUBLE);
  put_full(m, "r", 1, 1, &r, integers);
  if (full) {
    put_full(m, "P", 2, 2, p_full, SINGLE);
    put_full(m, "A", 4, 2, a_full, INT16);
  } else {
    put_sparse(m, "P", 2, 2, p_rows, p_starts, p_values, INT8);
    put_sparse(m, "A", 4, 2, a_rows, a_starts, a_values, DOUBLE);
  }
}

static const char *compare(const batten_qp_file *f) {
  static const size_t starts[] = {0, 2, 4};
  static const uint32_t indices[] = {0, 1, 0, 1};
  static const double h[] = {2, -1, -1, 3}, c[] = {1, 2, -1, 1};
  const double lower[] = {1, -INFINITY}, upper[] = {INFINITY, 4}, x_lower[] = {0, -INFINITY},
               x_upper[] = {10, INFINITY};
  batten_matrix hm = batten_matrix_sparse(2, 2, starts, indices, h),
                cm = batten_matrix_sparse(2, 2, starts, indices, c);
  batten_qp_file expected = {.problem = {.n = 2,
                                         .h = &hm,
                                         .g = q,
                                         .constant = 3,
                                         .c = &cm,
                                         .lower = lower,
                                         .upper = upper,
                                         .x_lower = x_lower,
                                         .x_upper = x_upper},
                             .name = ""};
  return qp_difference(f, &expected);
}

static void test_by_hand(batten_context *ctx) {
  static const int integers[] = {INT8, UINT8, INT16, UINT16, INT32, UINT32, SINGLE, DOUBLE, INT64, UINT64};
  static mat m;
  for (unsigned k = 0; k < 8; k++)
    for (size_t i = 0; i < sizeof integers / sizeof integers[0]; i++) {
      make(&m, k & 1, k & 2, k & 4, integers[i]);
      batten_qp_file f = {0};
      batten_status st = qp_of(ctx, "a.mat", m.bytes, m.size, &f);
      const char *wrong = st ? batten_error(ctx) : compare(&f);
      if (wrong || i == 0)
        T_CHECK(!wrong, "%s endian, %s, %s, scalars of type %d: %s", k & 1 ? "big" : "little",
                k & 2 ? "compressed" : "plain", k & 4 ? "full" : "sparse", integers[i], wrong ? wrong : "as by hand");
      batten_qp_file_free(ctx, &f);
    }
}

/* Rows with one entry that are not the trailing identity stay rows; what is not there has its default. */
static void test_rows(batten_context *ctx) {
  static mat m;
  static const double rows[] = {1, 0}, starts[] = {0, 1, 2}, values[] = {1, 1}, other[] = {0, 1}, two[] = {1, 2};
  batten_qp_file f = {0};
  begin_file(&m, false, false);
  put_full(&m, "q", 2, 1, q, DOUBLE);
  put_full(&m, "l", 2, 1, l, DOUBLE);
  put_sparse(&m, "A", 2, 2, rows, starts, values, DOUBLE);
  T_OK(qp_of(ctx, "a.mat", m.bytes, m.size, &f), ctx);
  T_CHECK(f.problem.c && f.problem.c->rows == 2 && !f.problem.x_lower && !f.problem.h && f.problem.constant == 0 &&
              f.problem.lower[1] == -INFINITY && f.problem.upper[0] == INFINITY,
          "a permuted identity stays rows; no P, r, u");
  batten_qp_file_free(ctx, &f);
  begin_file(&m, false, false);
  put_full(&m, "q", 2, 1, q, DOUBLE);
  put_full(&m, "u", 2, 1, l, DOUBLE);
  put_sparse(&m, "A", 2, 2, other, starts, two, DOUBLE);
  T_OK(qp_of(ctx, "a.mat", m.bytes, m.size, &f), ctx);
  T_CHECK(f.problem.c && f.problem.c->rows == 2 && !f.problem.x_upper, "an entry of 2 stays a row");
  batten_qp_file_free(ctx, &f);
  begin_file(&m, false, false);
  put_full(&m, "q", 2, 1, q, DOUBLE);
  put_full(&m, "u", 2, 1, l, DOUBLE);
  put_sparse(&m, "A", 2, 2, other, starts, values, DOUBLE);
  T_OK(qp_of(ctx, "a.mat", m.bytes, m.size, &f), ctx);
  T_CHECK(!f.problem.c && !f.problem.lower && f.problem.x_upper[0] == 1, "nothing but the identity: bounds, no rows");
  batten_qp_file_free(ctx, &f);
}

/* ---- what is refused --------------------------------------------------------------------------------- */

static void expect(batten_context *ctx, const mat *m, const char *part) {
  batten_qp_file f = {0};
  unsigned char *exact = malloc(m->size ? m->size : 1);
  memcpy(exact, m->bytes, m->size);
  T_STATUS(qp_of(ctx, "a.mat", exact, m->size, &f), BATTEN_E_FORMAT, ctx, part);
  if (f.memory || batten_bytes_in_use(ctx)) T_CHECK(false, "nothing is touched or left");
  free(exact);
}

static void test_headers(batten_context *ctx) {
  static mat m;
  expect(ctx, &m, "this is no MATLAB file of level 5; save it with -v7");
  make(&m, false, false, false, INT8);
  m.size = 100;
  expect(ctx, &m, "this is no MATLAB file of level 5");
  make(&m, false, false, false, INT8);
  memcpy(m.bytes, "MATLAB 7.3", 10);
  expect(ctx, &m, "a file of MATLAB 7.3 (HDF5); save it with -v7");
  memcpy(m.bytes, "\x89HDF\r\n\x1a\n", 8);
  expect(ctx, &m, "a file of MATLAB 7.3 (HDF5); save it with -v7");
  make(&m, false, false, false, INT8);
  m.bytes[125] = 2;
  expect(ctx, &m, "a MATLAB file of version 0x0200, known is 0x0100");
}

static void test_variables(batten_context *ctx) {
  static mat m;
  static const double nan_q[] = {NAN, 1}, bad_rows[] = {5, 1, 0, 1}, bad_starts[] = {0, 3, 2}, twice[] = {0, 0, 0, 1};
  static const double three = 3;
  begin_file(&m, false, false);
  expect(ctx, &m, "a.mat: no variables P and q; a quadratic program has P q r l u A");
  put_full(&m, "q", 2, 1, q, DOUBLE);
  put_full(&m, "q", 2, 1, q, DOUBLE);
  expect(ctx, &m, "variable 'q': is there twice");
  make(&m, true, true, false, INT8);
  put_full(&m, "q", 2, 1, q, DOUBLE);
  expect(ctx, &m, "variable 'q': is there twice");
  begin_file(&m, false, false);
  put_full(&m, "q", 2, 1, nan_q, DOUBLE);
  expect(ctx, &m, "variable 'q': number 0 is nan");
  begin_file(&m, false, false);
  put_full(&m, "q", 2, 1, q, DOUBLE);
  put_full(&m, "n", 1, 1, &three, DOUBLE);
  expect(ctx, &m, "variable 'n' is 3, but the arrays say 2");
  put_full(&m, "A", 4, 2, a_full, DOUBLE);
  expect(ctx, &m, "A without l and u; give at least one");
  put_full(&m, "u", 2, 1, u, DOUBLE);
  expect(ctx, &m, "variable 'u' is 2 x 1, expected 4 x 1");
  begin_file(&m, false, false);
  put_full(&m, "q", 2, 1, q, DOUBLE);
  put_full(&m, "P", 4, 1, p_full, DOUBLE);
  expect(ctx, &m, "variable 'P' is 4 x 1, expected 1 x 1");
  begin_file(&m, false, false);
  put_sparse(&m, "P", 2, 2, bad_rows, p_starts, p_values, DOUBLE);
  expect(ctx, &m, "variable 'P': entry 0 is in row 5 of 2; the file is damaged");
  begin_file(&m, false, false);
  put_sparse(&m, "P", 2, 2, p_rows, bad_starts, p_values, DOUBLE);
  expect(ctx, &m, "variable 'P': the start of column 1 is 3; the file is damaged");
  begin_file(&m, false, false);
  put_sparse(&m, "P", 2, 2, twice, p_starts, p_values, DOUBLE);
  expect(ctx, &m, "variable 'P' has two entries at (0, 0)");
  begin_file(&m, false, false);
  begin_variable(&m, CLASS_CELL, 1, 1, "P");
  end_variable(&m);
  expect(ctx, &m, "variable 'P': of class 1, where numbers are expected");
  begin_file(&m, false, false);
  begin_variable(&m, CLASS_DOUBLE | 1 << 11, 1, 1, "P");
  put_numbers(&m, DOUBLE, q, 1, false);
  end_variable(&m);
  expect(ctx, &m, "variable 'P': has complex numbers");
}

static void test_lies(batten_context *ctx) {
  static mat m;
  begin_file(&m, false, false);
  begin_variable(&m, CLASS_DOUBLE, 2000000000, 2000000000, "P");
  put_numbers(&m, DOUBLE, q, 2, false);
  end_variable(&m);
  expect(ctx, &m, "variable 'P': 2 numbers for 2000000000 x 2000000000; the file is damaged");
  begin_file(&m, false, false);
  begin_variable(&m, CLASS_DOUBLE, 1, 2, "q");
  put_integer(&m, DOUBLE, 4);
  put_integer(&m, 0xfffffff0u, 4);
  end_variable(&m);
  expect(ctx, &m, "variable 'q': its parts are larger than the whole; the file is damaged");
  begin_file(&m, false, false);
  put_full(&m, "q", 2, 1, q, DOUBLE);
  m.bytes[132] = m.bytes[133] = m.bytes[134] = 0xff; /* the variable's size */
  expect(ctx, &m, "the file ends here; data of a variable is missing");
  for (int big = 0; big < 2; big++) {
    make(&m, big, true, false, INT8);
    size_t size = m.size;
    m.bytes[size - 9] ^= 0x55;
    expect(ctx, &m, "damaged");
    size_t refused = 0, accepted = 0;
    for (size_t cut = 0; cut < size; cut++) {
      make(&m, big, big == 0, false, INT8);
      if (cut >= m.size) break;
      batten_qp_file f = {0};
      batten_status st = qp_of(ctx, "a.mat", m.bytes, cut, &f);
      refused += st == BATTEN_E_FORMAT;
      accepted += st == BATTEN_OK; /* where variables are missing that have defaults */
      batten_qp_file_free(ctx, &f);
      if (st != BATTEN_OK && st != BATTEN_E_FORMAT) T_CHECK(false, "cut at %zu: %s", cut, batten_error(ctx));
    }
    T_CHECK(accepted < 12 && refused > 100, "cut off anywhere: %zu refused, %zu with defaults", refused, accepted);
  }
}

static batten_status read_again(batten_context *ctx, void *arg) {
  const mat *m = arg;
  batten_qp_file f = {0};
  batten_status st = qp_of(ctx, "a.mat", m->bytes, m->size, &f);
  batten_qp_file_free(ctx, &f);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_by_hand(ctx);
  test_rows(ctx);
  test_headers(ctx);
  test_variables(ctx);
  test_lies(ctx);
  static mat m;
  make(&m, true, true, false, DOUBLE);
  t_fail_every_allocation("reading MATLAB's file", read_again, &m);
  t_cancel_every_progress("reading MATLAB's file", read_again, &m);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "no memory is left");
  batten_context_free(ctx);
  return t_done();
}
