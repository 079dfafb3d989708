/* Quadratic programs in QPS, the linear programs' MPS with a section for the Hessian, as the Maros-Meszaros problems
 * are handed on [Maros, Meszaros 1999; IBM's MPSX for the sections, the MPS rule for negative upper bounds].
 *
 * Sections begin in the first column of a line, data behind a blank. A line of data is taken as words; where those
 * make no sense (their number, a name that is not known, a number that is none) and the line keeps to the columns of
 * punched cards, by its columns. Once a name has a blank in it, cards come first. So no option has to say which form
 * a file has, and names with blanks, which some Maros-Meszaros problems have, are read. */
#include "qp_file.h"
#include "qps_line.h"
#include "soup.h"

#include <math.h>
#include <string.h>

#define IGNORED UINT32_MAX /* index of a row that is no constraint */

typedef struct qps_row {
  char type;      /* N E L G */
  uint32_t index; /* among the constraints, or IGNORED */
  uint32_t last;  /* 1 + the column that had an entry here last */
  bool has_rhs, has_range;
  double rhs, range;
} qps_row;

typedef struct qps_column {
  double g, lower, upper;
  bool lower_given;
} qps_column;

typedef enum qps_section {
  NO_SECTION,
  OBJSENSE,
  ROWS,
  COLUMNS,
  RHS,
  RANGES,
  BOUNDS,
  QUADOBJ, /* one triangle */
  QMATRIX, /* both */
  ENDATA
} qps_section;

typedef struct qps_reader {
  bx_reader *r;
  bx_names row_names, column_names;
  qps_row *rows;
  qps_column *columns;
  size_t row_capacity, column_capacity;
  size_t constraints; /* rows that are none of N */
  size_t objective;   /* number of its row, SIZE_MAX = none yet */
  double constant;
  bool maximise;
  bool blanks; /* in a name: cards come before words */
  qps_section section, hessian;
  bool has_set[ENDATA]; /* a line of this section was read */
  char set[ENDATA][64]; /* its set's name, cut off */
  bx_entries c, h;
  bx_qp_store *store;
} qps_reader;

static bool is(qps_word word, const char *text) { return bx_word_is(word.text, word.length, text); }

static batten_status unknown_name(qps_reader *q, const char *what, qps_word word, const char *section) {
  char quote[BX_QUOTE_SIZE];
  return bx_fail_line(q->r, "%s '%s' is not in %s; check its spelling", what, bx_quote(word.text, word.length, quote),
                      section);
}

static batten_status bad_number(qps_reader *q, const char *what, qps_word word) {
  char quote[BX_QUOTE_SIZE];
  if (word.length == 0) return bx_fail_line(q->r, "%s is missing", what);
  return bx_fail_line(q->r, "%s: '%s' is not a number; is a name longer than its columns, or a word missing?", what,
                      bx_quote(word.text, word.length, quote));
}

/* ---- fields ---------------------------------------------------------------------------------------- */

/* A head and one or two names with a number each; the head may be left out where head_needed is false. */
static bool words_of_pairs(const char *text, bool head_needed, qps_card *out) {
  qps_word w[QPS_WORDS_MAX];
  size_t count = qps_split(text, w), at = count % 2;
  *out = qps_no_card;
  if (count < 2 || count > 5 || (head_needed && !at)) return false;
  if (at) out->head = w[0];
  for (int k = 0; at < count; k++, at += 2) {
    out->name[k] = w[at];
    out->number[k] = w[at + 1];
  }
  return true;
}

typedef struct qps_pairs {
  qps_word head;
  size_t count, index[2];
  double value[2];
} qps_pairs;

/* Are all names of the card in the list, and the numbers numbers? */
static bool understand(const bx_names *names, const qps_card *card, bool head_needed, qps_pairs *out) {
  *out = (qps_pairs){.head = card->head};
  if (head_needed && !card->head.length) return false;
  for (int k = 0; k < 2 && (k == 0 || card->name[k].length || card->number[k].length); k++) {
    out->index[k] = bx_names_find(names, card->name[k].text, card->name[k].length);
    if (!card->name[k].length || out->index[k] == SIZE_MAX || !qps_number(card->number[k], &out->value[k]))
      return false;
    out->count++;
  }
  return true;
}

/* What is wrong with a line that makes no sense either way. */
static batten_status blame(qps_reader *q, const bx_names *names, const qps_card *card, bool fits, const char *what,
                           const char *section) {
  const char *in = q->section == COLUMNS  ? "COLUMNS"
                   : q->section == RHS    ? "RHS"
                   : q->section == RANGES ? "RANGES"
                                          : "the Hessian";
  if (!fits)
    return bx_fail_line(q->r, "a line of %s has %s, and one or two times the name of a %s and a number", in,
                        q->section == RHS || q->section == RANGES ? "the set's name" : "the name of a column", what);
  for (int k = 0; k < 2 && (k == 0 || card->name[k].length); k++) {
    double value;
    if (bx_names_find(names, card->name[k].text, card->name[k].length) == SIZE_MAX)
      return unknown_name(q, what, card->name[k], section);
    if (!qps_number(card->number[k], &value)) return bad_number(q, "the number", card->number[k]);
  }
  return bx_fail_line(q->r, "the line makes no sense");
}

/* The pairs of a line: names are of rows or columns. */
static batten_status read_pairs(qps_reader *q, const bx_names *names, bool head_needed, qps_pairs *out) {
  qps_card words, card;
  bool cut = q->blanks && qps_cut(q->r->text, &card);
  if (cut && understand(names, &card, head_needed, out)) return BATTEN_OK;
  bool fits = words_of_pairs(q->r->text, head_needed, &words);
  if (fits && understand(names, &words, head_needed, out)) return BATTEN_OK;
  if (!q->blanks) cut = qps_cut(q->r->text, &card);
  if (cut && understand(names, &card, head_needed, out)) return BATTEN_OK;
  bool rows = names == &q->row_names;
  return blame(q, names, cut && q->blanks ? &card : &words, fits || (cut && q->blanks), rows ? "row" : "column",
               rows ? "ROWS" : "COLUMNS");
}

static void note_blanks(qps_reader *q, qps_word name) {
  if (memchr(name.text, ' ', name.length)) q->blanks = true;
}

/* RHS, RANGES and BOUNDS may have several sets to choose from; which, nobody could say here. */
static batten_status check_set(qps_reader *q, qps_word set) {
  char *known = q->set[q->section];
  size_t kept = set.length < sizeof q->set[0] ? set.length : sizeof q->set[0] - 1;
  if (q->has_set[q->section]) {
    char quote[BX_QUOTE_SIZE], quote_known[BX_QUOTE_SIZE];
    if (bx_word_is(set.text, kept, known)) return BATTEN_OK;
    return bx_fail_line(q->r, "a second set '%s' beside '%s'; keep one of them",
                        bx_quote(set.text, set.length, quote), bx_quote(known, strlen(known), quote_known));
  }
  q->has_set[q->section] = true;
  if (kept) memcpy(known, set.text, kept);
  known[kept] = '\0';
  return BATTEN_OK;
}

/* ---- sections -------------------------------------------------------------------------------------- */

static batten_status read_sense(qps_reader *q) {
  qps_word w[QPS_WORDS_MAX];
  size_t count = qps_split(q->r->text, w);
  char quote[BX_QUOTE_SIZE];
  bool maximise = count == 1 && (is(w[0], "MAX") || is(w[0], "MAXIMIZE") || is(w[0], "MAXIMISE"));
  if (!maximise && !(count == 1 && (is(w[0], "MIN") || is(w[0], "MINIMIZE") || is(w[0], "MINIMISE"))))
    return bx_fail_line(q->r, "OBJSENSE '%s'; MIN or MAX", bx_quote(w[0].text, w[0].length, quote));
  q->maximise = maximise;
  return BATTEN_OK;
}

static batten_status add_row(qps_reader *q, char type, qps_word name) {
  char quote[BX_QUOTE_SIZE];
  if (bx_names_find(&q->row_names, name.text, name.length) != SIZE_MAX)
    return bx_fail_line(q->r, "row '%s' is there twice", bx_quote(name.text, name.length, quote));
  void *rows = q->rows;
  size_t count = q->row_names.count;
  batten_status st = bx_grow(q->r->ctx, &rows, &q->row_capacity, count + 1, sizeof *q->rows);
  q->rows = rows;
  if (st == BATTEN_OK) st = bx_names_add(&q->row_names, name.text, name.length);
  if (st != BATTEN_OK) return st;
  q->rows[count] = (qps_row){.type = type, .index = IGNORED};
  if (type != 'N') q->rows[count].index = (uint32_t)q->constraints++;
  if (type == 'N' && q->objective == SIZE_MAX) q->objective = count;
  note_blanks(q, name);
  return BATTEN_OK;
}

static batten_status read_row(qps_reader *q) {
  qps_word w[QPS_WORDS_MAX];
  qps_card card = qps_no_card;
  size_t count = qps_split(q->r->text, w);
  if (count == 2) {
    card.code = w[0];
    card.head = w[1];
  } else if (!qps_cut(q->r->text, &card) || !card.head.length) {
    return bx_fail_line(q->r, "%zu words, where a row has two: its type and its name", count);
  }
  char quote[BX_QUOTE_SIZE], type = card.code.length == 1 ? (char)(card.code.text[0] & ~0x20) : 0;
  if (!type || !strchr("NELG", type))
    return bx_fail_line(q->r, "row type '%s'; known are N, E, L, G",
                        bx_quote(card.code.text, card.code.length, quote));
  return add_row(q, type, card.head);
}

static batten_status begin_column(qps_reader *q, qps_word name) {
  char quote[BX_QUOTE_SIZE];
  size_t count = q->column_names.count;
  size_t known = bx_names_find(&q->column_names, name.text, name.length);
  if (known != SIZE_MAX && known + 1 == count) return BATTEN_OK;
  if (known != SIZE_MAX)
    return bx_fail_line(q->r, "column '%s' comes back after another one; its entries must follow each other",
                        bx_quote(name.text, name.length, quote));
  void *columns = q->columns;
  batten_status st = bx_grow(q->r->ctx, &columns, &q->column_capacity, count + 1, sizeof *q->columns);
  q->columns = columns;
  if (st == BATTEN_OK) st = bx_names_add(&q->column_names, name.text, name.length);
  if (st != BATTEN_OK) return st;
  q->columns[count] = (qps_column){.lower = 0, .upper = INFINITY};
  note_blanks(q, name);
  return BATTEN_OK;
}

static batten_status refuse_integers(qps_reader *q, const char *what) {
  return bx_fail_line(
      q->r, "%s asks for integer unknowns, which batten does not solve for; remove it to let them be real", what);
}

static bool is_marker(const char *text) {
  qps_word w[QPS_WORDS_MAX];
  return qps_split(text, w) >= 2 && is(w[1], "'MARKER'");
}

static batten_status check_finite(qps_reader *q, double value) {
  return isfinite(value) ? BATTEN_OK : bx_fail_line(q->r, "the number is too large for a double");
}

static batten_status add_column_entry(qps_reader *q, size_t row_number, double value) {
  qps_row *row = &q->rows[row_number];
  size_t column = q->column_names.count - 1;
  char quote[BX_QUOTE_SIZE];
  const char *name = bx_names_get(&q->row_names, row_number);
  if (row->last == column + 1)
    return bx_fail_line(q->r, "a second entry in row '%s'; write their sum", bx_quote(name, strlen(name), quote));
  row->last = (uint32_t)(column + 1);
  batten_status st = check_finite(q, value);
  if (st != BATTEN_OK) return st;
  if (row_number == q->objective) q->columns[column].g = value;
  if (row->index == IGNORED || !(value < 0 || value > 0)) return BATTEN_OK;
  return bx_entries_add(&q->c, (bx_entry){.row = row->index, .column = (uint32_t)column, .value = value});
}

static batten_status read_column(qps_reader *q) {
  if (strchr(q->r->text, '\'') && is_marker(q->r->text)) return refuse_integers(q, "'MARKER'");
  qps_pairs pairs;
  batten_status st = read_pairs(q, &q->row_names, true, &pairs);
  if (st == BATTEN_OK) st = begin_column(q, pairs.head);
  for (size_t k = 0; st == BATTEN_OK && k < pairs.count; k++)
    st = add_column_entry(q, pairs.index[k], pairs.value[k]);
  return st;
}

static batten_status set_right_side(qps_reader *q, size_t row_number, double value) {
  qps_row *row = &q->rows[row_number];
  char quote[BX_QUOTE_SIZE];
  const char *name = bx_names_get(&q->row_names, row_number);
  bx_quote(name, strlen(name), quote);
  if (row->has_rhs) return bx_fail_line(q->r, "row '%s' has a right-hand side already", quote);
  row->has_rhs = true;
  /* Of size 1e20, on the side where it means nothing: a row that is free. */
  bool infinite = !(fabs(value) < BX_QP_INFINITE);
  bool free = (row->type == 'L' && value > 0) || (row->type == 'G' && value < 0);
  if (infinite && row->type != 'N' && !free)
    return bx_fail_line(q->r, "row '%s' of type %c cannot have a right-hand side of %g", quote, row->type, value);
  if (row->type == 'N') {
    batten_status st = check_finite(q, value);
    if (st != BATTEN_OK) return st;
    if (row_number == q->objective) q->constant = 0 - value;
  }
  row->rhs = infinite ? copysign(INFINITY, value) : value;
  return BATTEN_OK;
}

static batten_status set_range(qps_reader *q, size_t row_number, double value) {
  qps_row *row = &q->rows[row_number];
  char quote[BX_QUOTE_SIZE];
  const char *name = bx_names_get(&q->row_names, row_number);
  bx_quote(name, strlen(name), quote);
  if (row->has_range) return bx_fail_line(q->r, "row '%s' has a range already", quote);
  if (row->type == 'N') return bx_fail_line(q->r, "row '%s' is of type N, which has no range", quote);
  row->has_range = true;
  row->range = fabs(value) < BX_QP_INFINITE ? value : copysign(INFINITY, value);
  return BATTEN_OK;
}

static batten_status read_row_values(qps_reader *q) {
  qps_pairs pairs;
  batten_status st = read_pairs(q, &q->row_names, false, &pairs);
  if (st == BATTEN_OK) st = check_set(q, pairs.head);
  for (size_t k = 0; st == BATTEN_OK && k < pairs.count; k++)
    st = q->section == RHS ? set_right_side(q, pairs.index[k], pairs.value[k])
                           : set_range(q, pairs.index[k], pairs.value[k]);
  return st;
}

/* ---- bounds ---------------------------------------------------------------------------------------- */

static bool takes_value(qps_word code) { return is(code, "LO") || is(code, "UP") || is(code, "FX"); }

/* TYPE [SET] COLUMN [VALUE] as words: the set may be left out, and types without a value may have one. */
static bool words_of_bound(qps_reader *q, qps_card *out) {
  qps_word w[QPS_WORDS_MAX];
  size_t count = qps_split(q->r->text, w);
  *out = qps_no_card;
  if (count < 2 || count > 4) return false;
  out->code = w[0];
  bool set = count == 4;
  if (count == 3) set = !takes_value(w[0]) && bx_names_find(&q->column_names, w[2].text, w[2].length) != SIZE_MAX;
  if (set) out->head = w[1];
  out->name[0] = w[1 + set];
  if (count > 2u + set) out->number[0] = w[2 + set];
  return true;
}

static bool understand_bound(qps_reader *q, const qps_card *card, size_t *column, double *value) {
  *column = bx_names_find(&q->column_names, card->name[0].text, card->name[0].length);
  *value = 0;
  return card->name[0].length && *column != SIZE_MAX &&
         (!takes_value(card->code) || qps_number(card->number[0], value));
}

static batten_status set_bound(qps_reader *q, qps_word code, qps_column *x, double value) {
  if (!(fabs(value) < BX_QP_INFINITE)) value = copysign(INFINITY, value);
  bool lower = is(code, "LO"), upper = is(code, "UP"), fixed = is(code, "FX");
  if ((lower && value >= INFINITY) || (upper && value <= -INFINITY) || (fixed && isinf(value)))
    return bx_fail_line(q->r, "a bound %.*s of %g leaves nothing", (int)code.length, code.text, value);
  if (lower || fixed || is(code, "MI") || is(code, "FR")) {
    x->lower = lower || fixed ? value : -INFINITY;
    x->lower_given = true;
  }
  if (upper || fixed || is(code, "PL") || is(code, "FR")) x->upper = upper || fixed ? value : INFINITY;
  /* The MPS rule: an upper bound below the default lower bound 0 takes that away. */
  if (upper && value < 0 && !x->lower_given) x->lower = -INFINITY;
  return BATTEN_OK;
}

static batten_status check_bound_type(qps_reader *q, qps_word code) {
  char quote[BX_QUOTE_SIZE];
  bx_quote(code.text, code.length, quote);
  if (is(code, "BV") || is(code, "LI") || is(code, "UI")) return refuse_integers(q, quote);
  if (is(code, "SC"))
    return bx_fail_line(q->r, "SC asks for a semi-continuous unknown, which batten does not solve for");
  if (takes_value(code) || is(code, "FR") || is(code, "MI") || is(code, "PL")) return BATTEN_OK;
  return bx_fail_line(q->r, "bound type '%s'; known are LO, UP, FX, FR, MI, PL", quote);
}

static batten_status read_bound(qps_reader *q) {
  qps_card words, card;
  size_t column = SIZE_MAX;
  double value = 0;
  bool known = q->blanks && qps_cut(q->r->text, &card) && understand_bound(q, &card, &column, &value), fits = false;
  if (!known) {
    fits = words_of_bound(q, &words);
    known = fits && understand_bound(q, &words, &column, &value);
    if (known) card = words;
  }
  if (!known) known = qps_cut(q->r->text, &card) && understand_bound(q, &card, &column, &value);
  if (!known && !fits)
    return bx_fail_line(q->r, "a line of BOUNDS has a type, the set's name, the name of a column and a number");
  if (!known) card = words;
  batten_status st = check_bound_type(q, card.code);
  if (st != BATTEN_OK) return st;
  if (!known && bx_names_find(&q->column_names, card.name[0].text, card.name[0].length) == SIZE_MAX)
    return unknown_name(q, "column", card.name[0], "COLUMNS");
  if (!known) return bad_number(q, "the bound", card.number[0]);
  st = check_set(q, card.head);
  return st == BATTEN_OK ? set_bound(q, card.code, &q->columns[column], value) : st;
}

/* ---- Hessian --------------------------------------------------------------------------------------- */

static batten_status read_quadratic(qps_reader *q) {
  qps_pairs pairs;
  batten_status st = read_pairs(q, &q->column_names, true, &pairs);
  if (st != BATTEN_OK) return st;
  size_t i = bx_names_find(&q->column_names, pairs.head.text, pairs.head.length);
  if (i == SIZE_MAX) return unknown_name(q, "column", pairs.head, "COLUMNS");
  for (size_t k = 0; st == BATTEN_OK && k < pairs.count; k++) {
    bx_entry entry = {.row = (uint32_t)i,
                      .column = (uint32_t)pairs.index[k],
                      .value = pairs.value[k],
                      .line = (uint32_t)(q->r->line < UINT32_MAX ? q->r->line : UINT32_MAX)};
    st = check_finite(q, entry.value);
    if (st == BATTEN_OK) st = bx_entries_add(&q->h, entry);
    if (st != BATTEN_OK || q->section == QMATRIX || entry.row == entry.column) continue;
    entry.row = entry.column;
    entry.column = (uint32_t)i;
    st = bx_entries_add(&q->h, entry);
  }
  return st;
}

/* The line of the last entry in a place. */
static uint32_t line_of(const bx_entries *entries, size_t row, size_t column) {
  uint32_t line = 0;
  for (size_t e = 0; e < entries->count; e++)
    if (entries->items[e].row == row && entries->items[e].column == column) line = entries->items[e].line;
  return line;
}

static batten_status fail_pair(qps_reader *q, size_t i, size_t j, const char *what) {
  char quote_i[BX_QUOTE_SIZE], quote_j[BX_QUOTE_SIZE];
  const char *name_i = bx_names_get(&q->column_names, i), *name_j = bx_names_get(&q->column_names, j);
  uint32_t line = line_of(&q->h, i, j);
  q->r->line = line ? line : line_of(&q->h, j, i);
  return bx_fail_line(q->r, "the pair '%s', '%s' %s", bx_quote(name_i, strlen(name_i), quote_i),
                      bx_quote(name_j, strlen(name_j), quote_j), what);
}

static batten_status finish_hessian(qps_reader *q) {
  size_t n = q->column_names.count, i, j;
  bx_sparse *h = &q->store->sparse[1], transposed = {0};
  if (q->h.count == 0) return BATTEN_OK;
  if (q->maximise)
    for (size_t e = 0; e < q->h.count; e++) q->h.items[e].value = 0 - q->h.items[e].value;
  batten_status st = bx_sparse_from(q->r->ctx, n, n, q->h.items, q->h.count, h);
  if (st != BATTEN_OK) return st;
  if (bx_sparse_twice(h, &i, &j))
    return fail_pair(q, i, j,
                     q->hessian == QUADOBJ ? "is there twice; QUADOBJ lists one triangle, QMATRIX lists both"
                                           : "is there twice; write the sum");
  if (q->hessian != QMATRIX) return BATTEN_OK;
  st = bx_sparse_transpose(q->r->ctx, h, &transposed);
  if (st == BATTEN_OK && bx_sparse_differs(h, &transposed, &i, &j))
    st = fail_pair(q, i, j, "differs from its mirror image; QMATRIX lists both triangles, QUADOBJ lists one");
  bx_sparse_free(q->r->ctx, &transposed);
  return st;
}

/* ---- the whole ------------------------------------------------------------------------------------- */

static batten_status begin_hessian(qps_reader *q, qps_section section, qps_word objective) {
  char quote[BX_QUOTE_SIZE];
  if (q->hessian != NO_SECTION) return bx_fail_line(q->r, "a second section for the Hessian; keep one of them");
  q->section = q->hessian = section;
  if (objective.length == 0) return BATTEN_OK;
  size_t row = bx_names_find(&q->row_names, objective.text, objective.length);
  if (row != SIZE_MAX && row == q->objective) return BATTEN_OK;
  return bx_fail_line(q->r, "a quadratic constraint '%s'; batten has linear ones only",
                      bx_quote(objective.text, objective.length, quote));
}

static batten_status take_name(qps_reader *q) {
  const char *at = bx_skip_blanks(q->r->text + strlen("NAME"));
  size_t length = strlen(at);
  while (length && bx_skip_blanks(at + length - 1) > at + length - 1) length--;
  if (q->store->name) return bx_fail_line(q->r, "a second NAME");
  q->store->name = batten_alloc(q->r->ctx, length + 1);
  if (!q->store->name) return BATTEN_E_NOMEM;
  memcpy(q->store->name, at, length);
  q->store->name[length] = '\0';
  return BATTEN_OK;
}

static batten_status begin_section(qps_reader *q) {
  static const struct {
    const char *name;
    qps_section section;
  } known[] = {{"ROWS", ROWS},     {"COLUMNS", COLUMNS},   {"RHS", RHS},          {"RANGES", RANGES},
               {"BOUNDS", BOUNDS}, {"OBJSENSE", OBJSENSE}, {"ENDATA", ENDATA},    {"QUADOBJ", QUADOBJ},
               {"QUADS", QUADOBJ}, {"QUADRATIC", QUADOBJ}, {"QSECTION", QUADOBJ}, {"QMATRIX", QMATRIX}};
  qps_word w[QPS_WORDS_MAX];
  char quote[BX_QUOTE_SIZE];
  size_t count = qps_split(q->r->text, w);
  bx_quote(w[0].text, w[0].length, quote);
  if (is(w[0], "NAME")) return take_name(q);
  if (is(w[0], "QCMATRIX") || is(w[0], "CSECTION"))
    return bx_fail_line(q->r, "%s: quadratic constraints; batten has linear ones only", quote);
  for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
    if (!is(w[0], known[i].name)) continue;
    q->section = known[i].section;
    if (q->section >= QUADOBJ && q->section < ENDATA)
      return begin_hessian(q, q->section, count > 1 ? w[1] : (qps_word){"", 0});
    if (q->section == OBJSENSE && count > 1) {
      q->r->text += strlen("OBJSENSE");
      return read_sense(q);
    }
    return BATTEN_OK;
  }
  return bx_fail_line(q->r,
                      "section '%s'; known are NAME OBJSENSE ROWS COLUMNS RHS RANGES BOUNDS QUADOBJ QMATRIX QSECTION "
                      "ENDATA; lines of data begin with a blank",
                      quote);
}

static batten_status read_data(qps_reader *q) {
  switch (q->section) {
    case OBJSENSE:
      return read_sense(q);
    case ROWS:
      return read_row(q);
    case COLUMNS:
      return read_column(q);
    case RHS:
    case RANGES:
      return read_row_values(q);
    case BOUNDS:
      return read_bound(q);
    case QUADOBJ:
    case QMATRIX:
      return read_quadratic(q);
    default:
      return bx_fail_line(q->r, "data before the first section; sections begin in the first column of a line");
  }
}

static batten_status read_lines(qps_reader *q) {
  bool end = false;
  batten_status st = BATTEN_OK;
  while (st == BATTEN_OK && q->section != ENDATA) {
    st = bx_next_line(q->r, &end);
    if (st != BATTEN_OK) break;
    if (end) return bx_fail_line(q->r, "the file ends without ENDATA; is it cut off?");
    const char *text = q->r->text;
    if (*text == '*' || !*bx_skip_blanks(text)) continue;
    st = bx_skip_blanks(text) == text ? begin_section(q) : read_data(q);
  }
  return st;
}

/* lower <= row <= upper from its type, right-hand side and range. */
static void sides(const qps_row *row, double *lower, double *upper) {
  double rhs = row->rhs, range = row->range;
  *lower = row->type == 'L' ? -INFINITY : rhs;
  *upper = row->type == 'G' ? INFINITY : rhs;
  if (!row->has_range || isinf(rhs)) return; /* a free row stays free */
  if (row->type == 'L') *lower = rhs - fabs(range);
  if (row->type == 'G') *upper = rhs + fabs(range);
  if (row->type == 'E' && range < 0) *lower = rhs + range;
  if (row->type == 'E' && range > 0) *upper = rhs + range;
}

static batten_status finish_rows(qps_reader *q) {
  batten_context *ctx = q->r->ctx;
  bx_qp_store *s = q->store;
  bx_names kept = {.ctx = ctx};
  size_t m = q->constraints;
  if (m == 0) return BATTEN_OK;
  batten_status st = bx_sparse_from(ctx, m, q->column_names.count, q->c.items, q->c.count, &s->sparse[2]);
  if (st == BATTEN_OK && !(s->lower = batten_alloc_array(ctx, m, sizeof *s->lower))) st = BATTEN_E_NOMEM;
  if (st == BATTEN_OK && !(s->upper = batten_alloc_array(ctx, m, sizeof *s->upper))) st = BATTEN_E_NOMEM;
  for (size_t k = 0; st == BATTEN_OK && k < q->row_names.count; k++) {
    const char *name = bx_names_get(&q->row_names, k);
    if (q->rows[k].index == IGNORED) continue;
    sides(&q->rows[k], &s->lower[q->rows[k].index], &s->upper[q->rows[k].index]);
    st = bx_names_add(&kept, name, strlen(name));
  }
  if (st == BATTEN_OK) st = bx_qp_take_names(&kept, &s->row_text, &s->row_names);
  bx_names_free(&kept);
  return st;
}

/* Only now, as bounds come in any order. */
static batten_status crossed(qps_reader *q, size_t j) {
  char quote[BX_QUOTE_SIZE];
  const char *name = bx_names_get(&q->column_names, j);
  return batten_fail(
      q->r->ctx, BATTEN_E_FORMAT, "%s: column '%s': its lower bound %.17g exceeds its upper bound %.17g",
      bx_short_path(q->r->path), bx_quote(name, strlen(name), quote), q->columns[j].lower, q->columns[j].upper);
}

static batten_status finish_columns(qps_reader *q) {
  batten_context *ctx = q->r->ctx;
  bx_qp_store *s = q->store;
  size_t n = q->column_names.count;
  if (!(s->g = batten_alloc_array(ctx, n, sizeof *s->g))) return BATTEN_E_NOMEM;
  if (!(s->x_lower = batten_alloc_array(ctx, n, sizeof *s->x_lower))) return BATTEN_E_NOMEM;
  if (!(s->x_upper = batten_alloc_array(ctx, n, sizeof *s->x_upper))) return BATTEN_E_NOMEM;
  for (size_t j = 0; j < n; j++) {
    const qps_column *x = &q->columns[j];
    if (x->lower > x->upper) return crossed(q, j);
    s->g[j] = q->maximise ? 0 - x->g : x->g;
    s->x_lower[j] = x->lower;
    s->x_upper[j] = x->upper;
  }
  if (q->maximise) q->constant = 0 - q->constant;
  return BATTEN_OK;
}

batten_status bx_read_qps(bx_reader *r, batten_qp_file *out) {
  batten_context *ctx = r->ctx;
  qps_reader *q = batten_alloc(ctx, sizeof *q);
  if (!q) return BATTEN_E_NOMEM;
  *q = (qps_reader){.r = r,
                    .row_names = {.ctx = ctx},
                    .column_names = {.ctx = ctx},
                    .c = {.ctx = ctx},
                    .h = {.ctx = ctx},
                    .objective = SIZE_MAX,
                    .store = bx_qp_store_new(ctx)};
  batten_status st = q->store ? read_lines(q) : BATTEN_E_NOMEM;
  size_t n = q->column_names.count;
  if (st == BATTEN_OK) st = finish_rows(q);
  if (st == BATTEN_OK) st = finish_columns(q);
  if (st == BATTEN_OK) st = finish_hessian(q);
  if (st == BATTEN_OK) st = bx_qp_take_names(&q->column_names, &q->store->unknown_text, &q->store->unknown_names);
  if (st == BATTEN_OK) st = bx_qp_finish(ctx, q->store, n, q->constant, out);
  if (st == BATTEN_OK) q->store = NULL;
  bx_qp_store_free(ctx, q->store);
  bx_names_free(&q->row_names);
  bx_names_free(&q->column_names);
  batten_free(ctx, q->rows);
  batten_free(ctx, q->columns);
  batten_free(ctx, q->c.items);
  batten_free(ctx, q->h.items);
  batten_free(ctx, q);
  return st;
}
