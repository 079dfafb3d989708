/* Quadratic programs from batten's JSON documents.
 *
 * {"batten": "qp", "version": 1, "name": "...", "n": 2, "H": [[...]], "A": ..., "b": [...], "weights": [...],
 *  "g": [...], "constant": 0, "C": ..., "lower": [0, null], "upper": [...], "x_lower": [...], "x_upper": [...],
 *  "x0": [...], "unknown_names": [...], "row_names": [...]}
 *
 * A matrix is dense rows, or {"rows": [...], "cols": [...], "values": [...]}, counted from 0. How many unknowns and
 * rows there are is taken from arrays alone, never from a number that could claim more than the file holds. */
#include "json_read.h"
#include "qp_file.h"

#include <math.h>
#include <string.h>

typedef struct qp_document {
  bx_json j;
  const json_t *root;
  bx_qp_store *store;
  size_t n, rows[3]; /* of A, H, C */
} qp_document;

static const char *const matrix_names[3] = {"A", "H", "C"};

/* The member, NULL when it is not there or null. */
static json_t *member(const qp_document *d, const char *key) {
  json_t *value = json_object_get(d->root, key);
  return json_is_null(value) ? NULL : value;
}

static batten_status check_keys(qp_document *d) {
  static const char *const known[] = {"batten",  "version", "name", "comment",       "n",        "H",     "A",
                                      "b",       "weights", "g",    "constant",      "C",        "lower", "upper",
                                      "x_lower", "x_upper", "x0",   "unknown_names", "row_names"};
  const char *key;
  json_t *value;
  json_object_foreach((json_t *)d->root, key, value) {
    size_t i = 0, count = sizeof known / sizeof known[0];
    while (i < count && strcmp(known[i], key)) i++;
    if (i < count) continue;
    char quote[BX_QUOTE_SIZE];
    return bx_json_fail(&d->j, "'%s' is not known; is it misspelt? Remarks go into 'comment'",
                        bx_quote(key, strlen(key), quote));
  }
  return BATTEN_OK;
}

/* ---- sizes ----------------------------------------------------------------------------------------- */

static batten_status find_unknowns(qp_document *d) {
  static const char *const of_unknowns[] = {"g", "x_lower", "x_upper", "x0", "unknown_names", "H"};
  const json_t *array = NULL;
  for (size_t i = 0; i < sizeof of_unknowns / sizeof of_unknowns[0] && !json_is_array(array); i++)
    array = member(d, of_unknowns[i]);
  if (!json_is_array(array)) array = json_array_get(member(d, "A"), 0);
  if (!json_is_array(array)) array = json_array_get(member(d, "C"), 0);
  if (!json_is_array(array))
    return bx_json_fail(&d->j, "no array says how many unknowns there are; give 'g', zeros if need be");
  d->n = json_array_size(array);
  int64_t n = 0;
  batten_status st = member(d, "n") ? bx_get_whole(&d->j, d->root, "n", 0, UINT32_MAX, &n) : BATTEN_OK;
  if (st == BATTEN_OK && member(d, "n") && (size_t)n != d->n)
    return bx_json_fail(&d->j, "'n' is %lld, but the arrays are of %zu unknowns", (long long)n, d->n);
  return st;
}

/* Rows of a matrix: dense ones say it themselves, of others the vectors on the same rows. */
static batten_status find_rows(qp_document *d, int i, const char *key, const char *other_key) {
  const json_t *matrix = member(d, matrix_names[i]), *array = member(d, key);
  if (!array) array = member(d, other_key);
  d->rows[i] = json_is_array(matrix) ? json_array_size(matrix) : json_array_size(array);
  if (matrix && !json_is_array(matrix) && !json_is_array(array))
    return bx_json_fail(&d->j, "'%s' is sparse, so '%s' or '%s' must say how many rows it has", matrix_names[i], key,
                        other_key);
  if (!matrix && array) return bx_json_fail(&d->j, "'%s' is missing", matrix_names[i]);
  return BATTEN_OK;
}

/* ---- arrays ---------------------------------------------------------------------------------------- */

static batten_status get_vector(qp_document *d, const char *key, size_t count, double **out) {
  if (!member(d, key)) return BATTEN_OK;
  double *values = bx_qp_fill(d->j.ctx, count, 0);
  if (!values) return BATTEN_E_NOMEM;
  *out = values;
  return bx_get_numbers(&d->j, d->root, key, count, values);
}

/* Numbers, or null for none. */
static batten_status get_side(qp_document *d, const char *key, size_t count, double none, double **out) {
  json_t *array = member(d, key);
  if (!array) return BATTEN_OK;
  size_t mark = bx_enter(&d->j, key);
  batten_status st = BATTEN_OK;
  if (!json_is_array(array) || json_array_size(array) != count)
    st = bx_json_fail(&d->j, "an array of %zu numbers or null is expected", count);
  if (st == BATTEN_OK && !(*out = bx_qp_fill(d->j.ctx, count, none))) st = BATTEN_E_NOMEM;
  for (size_t i = 0; st == BATTEN_OK && i < count; i++) {
    const json_t *item = json_array_get(array, i);
    if (json_is_number(item)) {
      (*out)[i] = json_number_value(item);
    } else if (!json_is_null(item)) {
      bx_enter_item(&d->j, i);
      st = bx_json_fail(&d->j, "a number is expected, or null for none");
    }
  }
  bx_leave(&d->j, mark);
  return st;
}

static batten_status get_names(qp_document *d, const char *key, size_t count, char **text, char ***list) {
  json_t *array = member(d, key);
  if (!array) return BATTEN_OK;
  bx_names names = {.ctx = d->j.ctx};
  size_t mark = bx_enter(&d->j, key);
  batten_status st = BATTEN_OK;
  if (!json_is_array(array) || json_array_size(array) != count)
    st = bx_json_fail(&d->j, "an array of %zu texts is expected", count);
  for (size_t i = 0; st == BATTEN_OK && i < count; i++) {
    const char *name = json_string_value(json_array_get(array, i));
    if (name) {
      st = bx_names_add(&names, name, strlen(name));
    } else {
      bx_enter_item(&d->j, i);
      st = bx_json_fail(&d->j, "a text is expected");
    }
  }
  if (st == BATTEN_OK) st = bx_qp_take_names(&names, text, list);
  bx_names_free(&names);
  bx_leave(&d->j, mark);
  return st;
}

static batten_status get_text(qp_document *d, const char *key, char **out) {
  const char *text;
  if (!member(d, key)) return BATTEN_OK;
  batten_status st = bx_get_text(&d->j, d->root, key, &text);
  if (st != BATTEN_OK) return st;
  *out = batten_alloc(d->j.ctx, strlen(text) + 1);
  if (!*out) return BATTEN_E_NOMEM;
  memcpy(*out, text, strlen(text) + 1);
  return BATTEN_OK;
}

/* ---- matrices -------------------------------------------------------------------------------------- */

static batten_status check_index(qp_document *d, const char *key, size_t e, double value, size_t count) {
  if (value >= 0 && value < (double)count && !(value > floor(value))) return BATTEN_OK;
  size_t mark = bx_enter(&d->j, key);
  bx_enter_item(&d->j, e);
  batten_status st =
      bx_json_fail(&d->j, "%g, where a whole number from 0 to %zu is expected", value, count ? count - 1 : 0);
  bx_leave(&d->j, mark);
  return st;
}

static batten_status get_triplets(qp_document *d, const json_t *object, size_t rows, bx_sparse *out) {
  double *row = NULL, *column = NULL, *value = NULL;
  size_t count = 0, columns = 0, values = 0, i, k;
  bx_entries entries = {.ctx = d->j.ctx};
  batten_status st = bx_get_rows(&d->j, object, "rows", 0, &count, &row);
  if (st == BATTEN_OK) st = bx_get_rows(&d->j, object, "cols", 0, &columns, &column);
  if (st == BATTEN_OK) st = bx_get_rows(&d->j, object, "values", 0, &values, &value);
  if (st == BATTEN_OK && (count != columns || count != values))
    st = bx_json_fail(&d->j, "%zu in 'rows', %zu in 'cols', %zu in 'values'; as many are expected", count, columns,
                      values);
  for (size_t e = 0; st == BATTEN_OK && e < count; e++) {
    st = check_index(d, "rows", e, row[e], rows);
    if (st == BATTEN_OK) st = check_index(d, "cols", e, column[e], d->n);
    if (st == BATTEN_OK)
      st = bx_entries_add(&entries,
                          (bx_entry){.row = (uint32_t)row[e], .column = (uint32_t)column[e], .value = value[e]});
  }
  if (st == BATTEN_OK) st = bx_sparse_from(d->j.ctx, rows, d->n, entries.items, count, out);
  if (st == BATTEN_OK && bx_sparse_twice(out, &i, &k))
    st = bx_json_fail(&d->j, "two entries at row %zu, column %zu; write their sum", i, k);
  batten_free(d->j.ctx, row);
  batten_free(d->j.ctx, column);
  batten_free(d->j.ctx, value);
  batten_free(d->j.ctx, entries.items);
  return st;
}

static batten_status get_matrix(qp_document *d, int i) {
  json_t *value = member(d, matrix_names[i]);
  if (!value) return BATTEN_OK;
  size_t rows = d->rows[i];
  if (json_is_object(value)) {
    size_t mark = bx_enter(&d->j, matrix_names[i]);
    batten_status st = get_triplets(d, value, rows, &d->store->sparse[i]);
    bx_leave(&d->j, mark);
    return st;
  }
  if (json_array_size(value) != rows) /* H: as the others take their rows from here */
    return bx_json_fail(&d->j, "'%s' has %zu rows, expected %zu", matrix_names[i], json_array_size(value), rows);
  if (d->n == 0 || rows == 0) return BATTEN_OK;
  batten_status st = bx_get_rows(&d->j, d->root, matrix_names[i], d->n, &rows, &d->store->dense[i]);
  batten_matrix *to = i == 0 ? &d->store->a : i == 1 ? &d->store->h : &d->store->c;
  if (st == BATTEN_OK) *to = batten_matrix_dense(rows, d->n, d->store->dense[i]);
  return st;
}

static batten_status load(qp_document *d, double *constant) {
  bx_qp_store *s = d->store;
  batten_status st = check_keys(d);
  if (st == BATTEN_OK) st = find_unknowns(d);
  d->rows[1] = d->n;
  if (st == BATTEN_OK) st = find_rows(d, 0, "b", "weights");
  if (st == BATTEN_OK) st = find_rows(d, 2, "lower", "upper");
  for (int i = 0; st == BATTEN_OK && i < 3; i++) st = get_matrix(d, i);
  if (st == BATTEN_OK) st = get_vector(d, "b", d->rows[0], &s->b);
  if (st == BATTEN_OK) st = get_vector(d, "weights", d->rows[0], &s->weights);
  if (st == BATTEN_OK) st = get_vector(d, "g", d->n, &s->g);
  if (st == BATTEN_OK) st = get_vector(d, "x0", d->n, &s->x0);
  if (st == BATTEN_OK) st = get_side(d, "lower", d->rows[2], -INFINITY, &s->lower);
  if (st == BATTEN_OK) st = get_side(d, "upper", d->rows[2], INFINITY, &s->upper);
  if (st == BATTEN_OK) st = get_side(d, "x_lower", d->n, -INFINITY, &s->x_lower);
  if (st == BATTEN_OK) st = get_side(d, "x_upper", d->n, INFINITY, &s->x_upper);
  if (st == BATTEN_OK && member(d, "constant")) st = bx_get_number(&d->j, d->root, "constant", constant);
  if (st == BATTEN_OK) st = get_text(d, "name", &s->name);
  if (st == BATTEN_OK) st = get_names(d, "unknown_names", d->n, &s->unknown_text, &s->unknown_names);
  if (st == BATTEN_OK) st = get_names(d, "row_names", d->rows[2], &s->row_text, &s->row_names);
  return st;
}

batten_status bx_load_qp(bx_reader *r, batten_qp_file *out) {
  json_t *root = NULL;
  qp_document d = {.j = {.ctx = r->ctx, .path = r->path}};
  double constant = 0;
  batten_status st = bx_json_parse(r, &root);
  if (st == BATTEN_OK) st = bx_check_head(&d.j, root, "qp");
  d.root = root;
  snprintf(d.j.place, sizeof d.j.place, "qp");
  if (st == BATTEN_OK && !(d.store = bx_qp_store_new(r->ctx))) st = BATTEN_E_NOMEM;
  if (st == BATTEN_OK) st = load(&d, &constant);
  if (st == BATTEN_OK) st = bx_qp_finish(r->ctx, d.store, d.n, constant, out);
  if (st != BATTEN_OK) bx_qp_store_free(r->ctx, d.store);
  json_decref(root);
  return st;
}

/* ---- solutions ------------------------------------------------------------------------------------- */

/* A solution belongs to one problem; of another one its sizes mostly differ. */
static batten_status check_sizes(bx_json *j, const json_t *root, const char *key, size_t count, const char *of) {
  json_t *value;
  batten_status st = bx_get(j, root, key, &value);
  if (st != BATTEN_OK || !json_is_array(value) || json_array_size(value) == count) return st;
  return bx_json_fail(j, "%zu numbers in '%s', but the problem has %zu %s; is it the solution of another one?",
                      json_array_size(value), key, count, of);
}

/* No x: the status, if there is one, says why. */
static batten_status check_solved(bx_json *j, const json_t *root) {
  const char *word = json_string_value(json_object_get(root, "status"));
  char quote[BX_QUOTE_SIZE];
  if (json_object_get(root, "x") || !word) return BATTEN_OK;
  return bx_json_fail(j, "'x' is missing, as the status is '%s'; only what has an x can be taken from here",
                      bx_quote(word, strlen(word), quote));
}

typedef struct qp_arrays {
  double *x, *multipliers, *active;
} qp_arrays;

static batten_status get_solution(bx_json *j, const json_t *root, size_t n, size_t all, const batten_qp_solution *to,
                                  qp_arrays *got) {
  const char *both = "rows and unknowns";
  batten_status st = check_solved(j, root);
  if (st == BATTEN_OK && to->x) st = check_sizes(j, root, "x", n, "unknowns");
  if (st == BATTEN_OK && to->multipliers) st = check_sizes(j, root, "multipliers", all, both);
  if (st == BATTEN_OK && to->active) st = check_sizes(j, root, "active", all, both);
  if (st == BATTEN_OK && to->x) st = bx_get_numbers(j, root, "x", n, got->x);
  if (st == BATTEN_OK && to->multipliers) st = bx_get_numbers(j, root, "multipliers", all, got->multipliers);
  if (st == BATTEN_OK && to->active) st = bx_get_numbers(j, root, "active", all, got->active);
  for (size_t i = 0; st == BATTEN_OK && to->active && i < all; i++) {
    double a = got->active[i];
    if (a >= -1 && a <= 2 && !(a > floor(a))) continue;
    bx_enter(j, "active");
    bx_enter_item(j, i);
    st = bx_json_fail(j, "%g, where -1 (lower side), 1 (upper), 2 (equality) or 0 is expected", a);
  }
  return st;
}

batten_status bx_load_qp_solution(bx_reader *r, size_t n, size_t m, const batten_qp_solution *out) {
  json_t *root = NULL;
  bx_json j = {.ctx = r->ctx, .path = r->path};
  qp_arrays got = {bx_qp_fill(r->ctx, n, 0), bx_qp_fill(r->ctx, m + n, 0), bx_qp_fill(r->ctx, m + n, 0)};
  batten_status st = got.x && got.multipliers && got.active ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st == BATTEN_OK) st = bx_json_parse(r, &root);
  if (st == BATTEN_OK) st = bx_check_head(&j, root, "qp_solution");
  snprintf(j.place, sizeof j.place, "qp_solution");
  if (st == BATTEN_OK) st = get_solution(&j, root, n, m + n, out, &got);
  for (size_t i = 0; st == BATTEN_OK && out->x && i < n; i++) out->x[i] = got.x[i];
  for (size_t i = 0; st == BATTEN_OK && out->multipliers && i < m + n; i++) out->multipliers[i] = got.multipliers[i];
  for (size_t i = 0; st == BATTEN_OK && out->active && i < m + n; i++) out->active[i] = (signed char)got.active[i];
  json_decref(root);
  batten_free(r->ctx, got.x);
  batten_free(r->ctx, got.multipliers);
  batten_free(r->ctx, got.active);
  return st;
}
