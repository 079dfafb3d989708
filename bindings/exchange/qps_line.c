/* Lines of QPS: see qps_line.h. */
#include "qps_line.h"

#include "number.h"
#include "stream.h"

#include <math.h>
#include <string.h>

const qps_card qps_no_card = {{"", 0}, {"", 0}, {{"", 0}, {"", 0}}, {{"", 0}, {"", 0}}};

size_t qps_split(const char *text, qps_word words[QPS_WORDS_MAX]) {
  size_t count = 0;
  for (const char *at = text; count < QPS_WORDS_MAX; count++) {
    words[count].length = bx_next_word(&at, &words[count].text);
    if (words[count].length == 0) break;
  }
  return count;
}

/* Columns from .. to, counted from 1, without the blanks around. */
static qps_word field(const char *text, size_t length, size_t from, size_t to) {
  size_t begin = from - 1, end = to < length ? to : length;
  while (begin < end && text[begin] == ' ') begin++;
  while (end > begin && text[end - 1] == ' ') end--;
  return begin < end ? (qps_word){text + begin, end - begin} : (qps_word){text, 0};
}

bool qps_cut(const char *text, qps_card *out) {
  static const unsigned char between[] = {1, 4, 13, 14, 23, 24, 37, 38, 39, 48, 49};
  size_t length = strlen(text);
  if (memchr(text, '\t', length)) return false;
  for (size_t i = 0; i < sizeof between; i++)
    if (between[i] <= length && text[between[i] - 1] != ' ') return false;
  *out = (qps_card){.code = field(text, length, 2, 3),
                    .head = field(text, length, 5, 12),
                    .name = {field(text, length, 15, 22), field(text, length, 40, 47)},
                    .number = {field(text, length, 25, 36), field(text, length, 50, 61)}};
  return true;
}

/* By a copy that ends where the word does, with e for Fortran's D. */
static bool copied_number(qps_word word, double *out) {
  enum { LENGTH_MAX = 64 }; /* of a word without blanks behind it: a field of a card, or a number with D */
  char copy[LENGTH_MAX];
  if (word.length >= LENGTH_MAX) return false;
  memcpy(copy, word.text, word.length);
  copy[word.length] = '\0';
  char *d = strpbrk(copy, "dD");
  if (d) *d = 'e';
  const char *end;
  return bx_parse_number(copy, &end, out) == BX_NUMBER_OK && end == copy + word.length;
}

bool qps_number(qps_word word, double *out) {
  if (word.length == 0) return false;
  const char *end;
  bx_number_state state = bx_parse_number(word.text, &end, out);
  if (state == BX_NUMBER_OK && end == word.text + word.length) return true;
  bool negative = word.text[0] == '-', sign = negative || word.text[0] == '+';
  bool infinite = state == BX_NUMBER_NOT_FINITE && (word.text[sign] | 0x20) == 'i';
  if ((infinite || state == BX_NUMBER_TOO_LARGE) && end == word.text + word.length) {
    *out = negative ? -INFINITY : INFINITY;
    return true;
  }
  return copied_number(word, out);
}
