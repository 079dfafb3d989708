/* Numbers in text: see number.h.
 *
 * strtod and printf take the decimal point from the locale, which belongs to the host, so reading is done here. A
 * number of at most 15 digits with a small power of ten is one exact product or quotient. Otherwise a nearby double
 * is computed in floating point and then moved, one unit in the last place at a time, until the decimal lies between
 * the midpoints to its two neighbours; those comparisons are made in integers and therefore exact (Clinger 1990,
 * algorithm R). Writing is done in whole numbers for numbers of everyday size, else by trial. */
#include "number.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

enum {
  /* A midpoint between two doubles has at most 767 significant digits: more cannot matter but as "not zero". */
  DIGITS_MAX = 770,
  /* 10^(324+770) times a 54-bit number is under 2^3700, and so is 10^770 2^1075. */
  WORDS_MAX = 120,
  /* A written exponent counts as at most this; no line is long enough for digits to make up for it. */
  EXPONENT_MAX = 100000000
};

typedef struct decimal {
  bool negative;
  int digit_count;
  int exponent; /* value = digits x 10^exponent */
  unsigned char digits[DIGITS_MAX];
} decimal;

/* Natural number, least word first. */
typedef struct natural {
  int count;
  uint32_t words[WORDS_MAX];
} natural;

static void multiply_add(natural *a, uint32_t factor, uint32_t addend) {
  uint64_t carry = addend;
  for (int i = 0; i < a->count; i++) {
    carry += (uint64_t)a->words[i] * factor;
    a->words[i] = (uint32_t)carry;
    carry >>= 32;
  }
  if (carry) {
    assert(a->count < WORDS_MAX);
    a->words[a->count++] = (uint32_t)carry;
  }
}

static void multiply_power_of_10(natural *a, int exponent) {
  for (; exponent >= 9; exponent -= 9) multiply_add(a, 1000000000u, 0);
  for (; exponent > 0; exponent--) multiply_add(a, 10, 0);
}

static void shift_left(natural *a, int bits) {
  if (a->count == 0) return;
  int words = bits / 32;
  assert(a->count + words <= WORDS_MAX);
  memmove(a->words + words, a->words, (size_t)a->count * sizeof a->words[0]);
  memset(a->words, 0, (size_t)words * sizeof a->words[0]);
  a->count += words;
  multiply_add(a, (uint32_t)1 << (bits % 32), 0);
}

static int compare_naturals(const natural *a, const natural *b) {
  if (a->count != b->count) return a->count < b->count ? -1 : 1;
  for (int i = a->count; i-- > 0;)
    if (a->words[i] != b->words[i]) return a->words[i] < b->words[i] ? -1 : 1;
  return 0;
}

/* v = mantissa 2^exponent, exactly, with the exponent of the unit in the last place of v. */
static uint64_t take_apart(double v, int *exponent) {
  uint64_t bits;
  memcpy(&bits, &v, sizeof bits);
  uint64_t fraction = bits & (((uint64_t)1 << 52) - 1);
  int biased = (int)(bits >> 52 & 0x7ff);
  *exponent = (biased ? biased : 1) - 1075;
  return biased ? fraction | (uint64_t)1 << 52 : fraction;
}

/* Sign of d - (midpoint between v and the next larger double), v >= 0. */
static int compare_with_midpoint(const decimal *d, double v) {
  int exponent2;
  uint64_t mantissa = 2 * take_apart(v, &exponent2) + 1;
  exponent2--;
  natural left = {0}, right = {.count = 2, .words = {(uint32_t)mantissa, (uint32_t)(mantissa >> 32)}};
  if (!right.words[1]) right.count = 1;
  int i = 0;
  for (; i + 9 <= d->digit_count; i += 9) {
    uint32_t nine = 0;
    for (int j = 0; j < 9; j++) nine = 10 * nine + d->digits[i + j];
    multiply_add(&left, 1000000000u, nine);
  }
  for (; i < d->digit_count; i++) multiply_add(&left, 10, d->digits[i]);
  multiply_power_of_10(d->exponent > 0 ? &left : &right, d->exponent > 0 ? d->exponent : -d->exponent);
  shift_left(exponent2 > 0 ? &right : &left, exponent2 > 0 ? exponent2 : -exponent2);
  return compare_naturals(&left, &right);
}

static double next_up(double v) {
  uint64_t bits;
  memcpy(&bits, &v, sizeof bits);
  bits++;
  memcpy(&v, &bits, sizeof v);
  return v;
}

static double next_down(double v) {
  uint64_t bits;
  memcpy(&bits, &v, sizeof bits);
  bits--;
  memcpy(&v, &bits, sizeof v);
  return v;
}

static bool is_odd(double v) {
  uint64_t bits;
  memcpy(&bits, &v, sizeof bits);
  return bits & 1;
}

/* Correctly rounded, HUGE_VAL above the doubles; v is a first guess within some units in the last place. */
static double settle(const decimal *d, double v) {
  if (v > DBL_MAX) v = DBL_MAX;
  for (;;) {
    int above = compare_with_midpoint(d, v);
    if (above > 0 || (above == 0 && is_odd(v))) {
      if (v >= DBL_MAX) return HUGE_VAL;
      v = next_up(v);
      if (above == 0) return v;
      continue;
    }
    if (above == 0 || v <= 0) return v;
    double down = next_down(v);
    int below = compare_with_midpoint(d, down);
    if (below > 0 || (below == 0 && !is_odd(v))) return v;
    v = down;
  }
}

static double decimal_value(const decimal *d) {
  static const double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                  1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
  int magnitude = d->digit_count + d->exponent; /* the value is in [10^(magnitude-1), 10^magnitude) */
  if (d->digit_count == 0 || magnitude < -330) return 0;
  if (magnitude > 310) return HUGE_VAL;
  uint64_t leading = 0;
  int used = d->digit_count < 19 ? d->digit_count : 19;
  for (int i = 0; i < used; i++) leading = 10 * leading + d->digits[i];
  int exponent = d->exponent + d->digit_count - used;
  double v = (double)leading;
  bool exact = used == d->digit_count && leading <= (uint64_t)1 << 53 && exponent >= -22 && exponent <= 22;
  for (; exponent > 22; exponent -= 22) v *= 1e22;
  for (; exponent < -22; exponent += 22) v /= 1e22;
  v = exponent < 0 ? v / powers[-exponent] : v * powers[exponent];
  return exact ? v : settle(d, v);
}

static bool is_digit(char c) { return c >= '0' && c <= '9'; }

static bool starts_with(const char *text, const char *lower_case) {
  for (; *lower_case; text++, lower_case++)
    if ((*text | 0x20) != *lower_case) return false;
  return true;
}

static void append_digit(decimal *d, int digit) {
  if (d->digit_count == 0 && digit == 0) return;
  if (d->digit_count < DIGITS_MAX) {
    d->digits[d->digit_count++] = (unsigned char)digit;
    return;
  }
  if (digit) d->digits[DIGITS_MAX - 1] |= 1; /* keeps the value off every midpoint */
  d->exponent++;
}

/* [e[+-]digits] at text, 0 when there is none; *end moves behind it. */
static int parse_exponent(const char *text, const char **end) {
  *end = text;
  if ((*text | 0x20) != 'e') return 0;
  const char *at = text + 1;
  bool negative = *at == '-';
  if (*at == '-' || *at == '+') at++;
  if (!is_digit(*at)) return 0;
  int exponent = 0;
  for (; is_digit(*at); at++)
    if (exponent < EXPONENT_MAX) exponent = 10 * exponent + (*at - '0');
  *end = at;
  return negative ? -exponent : exponent;
}

bx_number_state bx_parse_number(const char *text, const char **end, double *out) {
  const char *at = text;
  decimal d;
  d.negative = *at == '-';
  d.digit_count = d.exponent = 0;
  if (*at == '-' || *at == '+') at++;
  *end = text;
  if (starts_with(at, "nan") || starts_with(at, "inf")) {
    *end = at + (starts_with(at, "infinity") ? 8 : 3);
    return BX_NUMBER_NOT_FINITE;
  }
  if (!is_digit(*at) && !(*at == '.' && is_digit(at[1]))) return BX_NUMBER_NONE;
  for (; is_digit(*at); at++) append_digit(&d, *at - '0');
  if (*at == '.')
    for (at++; is_digit(*at); at++) {
      d.exponent--;
      append_digit(&d, *at - '0');
    }
  d.exponent += parse_exponent(at, end);
  double value = decimal_value(&d);
  if (value > DBL_MAX) return BX_NUMBER_TOO_LARGE;
  *out = d.negative ? -value : value;
  return BX_NUMBER_OK;
}

bx_number_state bx_parse_integer(const char *text, const char **end, int64_t *out) {
  const char *at = text;
  bool negative = *at == '-', fits = true;
  if (*at == '-' || *at == '+') at++;
  *end = text;
  if (!is_digit(*at)) return BX_NUMBER_NONE;
  int64_t value = 0;
  for (; is_digit(*at); at++) {
    fits = fits && value < INT64_MAX / 10;
    if (fits) value = 10 * value + (*at - '0');
  }
  *end = at;
  if (!fits) return BX_NUMBER_TOO_LARGE;
  *out = negative ? -value : value;
  return BX_NUMBER_OK;
}

/* Puts a point where the locale has put something else: everything in a printed number that is no digit, sign or
 * exponent is its decimal separator. */
static void normalise_point(char *text) {
  char *to = text;
  bool in_separator = false;
  for (const char *from = text; *from; from++) {
    bool part = is_digit(*from) || *from == '-' || *from == '+' || *from == 'e';
    if (part)
      *to++ = *from;
    else if (!in_separator)
      *to++ = '.';
    in_separator = !part;
  }
  *to = '\0';
}

static int format_by_trial(double value, char text[BX_NUMBER_SIZE]) {
  for (int digits = 15; digits <= 17; digits++) {
    snprintf(text, BX_NUMBER_SIZE, "%.*g", digits, value);
    normalise_point(text);
    const char *end;
    double back;
    if (bx_parse_number(text, &end, &back) == BX_NUMBER_OK && back == value) break;
  }
  return (int)strlen(text);
}

#ifdef __SIZEOF_INT128__
__extension__ typedef unsigned __int128 wide;

/* Digits of a number of everyday size in whole numbers: v = m 2^e is scaled by 10^k = 5^k 2^k so that 17 digits stand
 * before the point; m 5^k is below 2^116, and the power of two is a shift. */
typedef struct scaled {
  uint64_t mantissa, whole; /* whole = v 10^k rounded down, 10^16 <= whole < 10^17 */
  wide value, rest;         /* v 10^k = value 2^-shift; rest = value - whole 2^shift */
  uint64_t power;           /* 5^k: a unit in the last place of v, as value counts */
  int shift, exponent;      /* v = whole 10^(exponent-16) */
} scaled;

static bool scale(double v, scaled *s) {
  int exponent2;
  s->mantissa = take_apart(v, &exponent2);
  if (!(v >= 1e-10 && v < 1e15)) return false; /* there 5^k has 63 bits at most, and shift is positive */
  static const double powers[] = {1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1e0,  1e1, 1e2,
                                  1e3,   1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14};
  int low = 0, high = (int)(sizeof powers / sizeof powers[0]) - 1;
  while (low < high) {
    int middle = (low + high + 1) / 2;
    if (v >= powers[middle])
      low = middle;
    else
      high = middle - 1;
  }
  s->exponent = low - 10;
  for (;;) { /* the negative powers are rounded: one step down may follow */
    int k = 16 - s->exponent;
    s->power = 1;
    for (int i = 0; i < k; i++) s->power *= 5;
    s->shift = -(exponent2 + k);
    s->value = (wide)s->mantissa * s->power;
    s->whole = (uint64_t)(s->value >> s->shift);
    s->rest = s->value - ((wide)s->whole << s->shift);
    if (s->whole >= 10000000000000000u || k == 27) break;
    s->exponent--;
  }
  return s->whole >= 10000000000000000u && s->whole < 100000000000000000u;
}

/* v rounded to 17 less `fewer` digits, ties to even, as a multiple of 10^fewer. */
static uint64_t round_digits(const scaled *s, int fewer) {
  uint64_t unit = fewer == 2 ? 100 : fewer == 1 ? 10 : 1, q = s->whole / unit, r = s->whole % unit;
  bool more, tie;
  if (unit == 1) {
    wide half = (wide)1 << (s->shift - 1);
    more = s->rest > half;
    tie = s->rest == half;
  } else {
    more = 2 * r > unit || (2 * r == unit && s->rest > 0);
    tie = 2 * r == unit && s->rest == 0;
  }
  return (q + (more || (tie && (q & 1)))) * unit;
}

/* Is v the double next to the decimal? Half a unit in the last place either way, a quarter below powers of two. */
static bool reads_back(const scaled *s, uint64_t rounded) {
  wide there = (wide)rounded << s->shift;
  bool below = there < s->value;
  wide off = below ? s->value - there : there - s->value, allowed = s->power;
  off *= below && s->mantissa == (uint64_t)1 << 52 ? 4 : 2;
  return off < allowed || (off == allowed && !(s->mantissa & 1));
}

/* As "%.*g": fixed where the exponent is from -4 to below the number of digits. */
static int put_digits(uint64_t rounded, int exponent, int digits, bool negative, char *text) {
  char figures[20], *at = text;
  int count = 0;
  if (rounded >= 100000000000000000u) { /* rounding has carried to a digit more */
    rounded /= 10;
    exponent++;
  }
  for (int i = 16; i >= 0; i--, rounded /= 10) {
    figures[i] = (char)('0' + rounded % 10);
    if (count == 0 && figures[i] != '0') count = i + 1;
  }
  if (negative) *at++ = '-';
  if (exponent < -4 || exponent >= digits) {
    *at++ = figures[0];
    if (count > 1) *at++ = '.';
    for (int i = 1; i < count; i++) *at++ = figures[i];
    int size = exponent < 0 ? -exponent : exponent;
    *at++ = 'e';
    *at++ = exponent < 0 ? '-' : '+';
    *at++ = (char)('0' + size / 10);
    *at++ = (char)('0' + size % 10);
  } else if (exponent < 0) {
    *at++ = '0';
    *at++ = '.';
    for (int i = -1; i > exponent; i--) *at++ = '0';
    for (int i = 0; i < count; i++) *at++ = figures[i];
  } else {
    for (int i = 0; i <= exponent || i < count; i++) {
      if (i == exponent + 1) *at++ = '.';
      *at++ = figures[i];
    }
  }
  *at = '\0';
  return (int)(at - text);
}

int bx_format_number(double value, char text[BX_NUMBER_SIZE]) {
  scaled s;
  if (!scale(fabs(value), &s)) return format_by_trial(value, text);
  int fewer = 2;
  uint64_t rounded = round_digits(&s, fewer);
  while (fewer > 0 && !reads_back(&s, rounded)) rounded = round_digits(&s, --fewer);
  return put_digits(rounded, s.exponent, 17 - fewer, value < 0, text);
}
#else
int bx_format_number(double value, char text[BX_NUMBER_SIZE]) { return format_by_trial(value, text); }
#endif

int bx_format_real(double value, char text[BX_NUMBER_SIZE]) {
  int length = bx_format_number(value, text), mantissa = 0;
  bool point = false;
  for (; mantissa < length && text[mantissa] != 'e'; mantissa++) point = point || text[mantissa] == '.';
  if (mantissa < length) text[mantissa] = 'E';
  if (point) return length;
  memmove(text + mantissa + 1, text + mantissa, (size_t)(length - mantissa) + 1);
  text[mantissa] = '.';
  return length + 1;
}
