/* One line of a QPS file taken apart, as words or by the columns of punched cards. */
#ifndef BATTEN_EXCHANGE_QPS_LINE_H
#define BATTEN_EXCHANGE_QPS_LINE_H

#include <stdbool.h>
#include <stddef.h>

typedef struct qps_word {
  const char *text;
  size_t length; /* 0 = not there */
} qps_word;

/* The six fields of a card, whatever they are in the section at hand:
 *   code   row's or bound's type        head   column, or name of a set
 *   name[k], number[k]                  what the head has there, up to two */
typedef struct qps_card {
  qps_word code, head, name[2], number[2];
} qps_card;

/* All fields empty. */
extern const qps_card qps_no_card;

enum { QPS_WORDS_MAX = 7 };

/* Words between blanks, at most QPS_WORDS_MAX; returns their number. */
size_t qps_split(const char *text, qps_word words[QPS_WORDS_MAX]);

/* Fields by their columns (counted from 1): code 2-3, head 5-12, names 15-22 and 40-47, numbers 25-36 and 50-61,
 * without the blanks around them; what is behind column 61 counts for nothing. false when something stands between
 * the fields, or the line has tabs. */
bool qps_cut(const char *text, qps_card *out);

/* The number that the word is, also with D for the exponent's e; false when it is none. Of size 1e308 and more, or
 * written as infinity: infinite. */
bool qps_number(qps_word word, double *out);

#endif
