/* Numbers in text: against strtod in the C locale, on midpoints, at the ends of the range. */
#include "number.h"

#include "tap.h"

#include <float.h>

static double parsed(const char *text, bx_number_state *state, size_t *length) {
  const char *end;
  double value = -77;
  *state = bx_parse_number(text, &end, &value);
  *length = (size_t)(end - text);
  return value;
}

static bool same(const char *text) {
  bx_number_state state;
  size_t length;
  char *end;
  double mine = parsed(text, &state, &length), theirs = strtod(text, &end);
  bool ok = isinf(theirs)
                ? state == BX_NUMBER_TOO_LARGE && length == (size_t)(end - text)
                : state == BX_NUMBER_OK && !memcmp(&mine, &theirs, sizeof mine) && length == (size_t)(end - text);
  if (!ok) printf("# '%.80s': %a, strtod %a\n", text, mine, theirs);
  return ok;
}

static void test_by_hand(void) {
  static const char *const texts[] = {"0",
                                      "-0",
                                      "1",
                                      "+1.5",
                                      ".5",
                                      "5.",
                                      "1e3",
                                      "1E-3",
                                      "1e",
                                      "1e+",
                                      "12abc",
                                      "1.2.3",
                                      "00012.5000",
                                      "9007199254740993",
                                      "9007199254740992.99999999999999999999",
                                      "9007199254740993.00000000000000000001",
                                      "1.7976931348623157e308",
                                      "1.7976931348623158e308",
                                      "1.7976931348623159e308",
                                      "1e309",
                                      "1e400",
                                      "-1e99999999999",
                                      "4.9406564584124654e-324",
                                      "2.4703282292062327e-324",
                                      "2.4703282292062328e-324",
                                      "1e-400",
                                      "1e-99999999999",
                                      "2.2250738585072011e-308",
                                      "2.2250738585072014e-308",
                                      "6.631236846766476e-316",
                                      "123456789012345678901234567890",
                                      "0.1",
                                      "0.3",
                                      "1e22",
                                      "1e23",
                                      "8.5e22",
                                      "7.2057594037927945e16",
                                      "0.000000000000000000000000000000000000001"};
  size_t bad = 0;
  for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) bad += !same(texts[i]);
  T_CHECK(bad == 0, "%zu numbers by hand as strtod reads them, %zu differ", sizeof texts / sizeof texts[0], bad);
  static const struct {
    const char *text;
    bx_number_state state;
    size_t length;
  } others[] = {
      {"nan", BX_NUMBER_NOT_FINITE, 3}, {"-inf", BX_NUMBER_NOT_FINITE, 4}, {"Infinity", BX_NUMBER_NOT_FINITE, 8},
      {"", BX_NUMBER_NONE, 0},          {"x", BX_NUMBER_NONE, 0},          {"-", BX_NUMBER_NONE, 0},
      {".", BX_NUMBER_NONE, 0},         {"e5", BX_NUMBER_NONE, 0},         {"+-1", BX_NUMBER_NONE, 0},
      {"1,5", BX_NUMBER_OK, 1},         {"0x10", BX_NUMBER_OK, 1}};
  for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) {
    bx_number_state state;
    size_t length;
    parsed(others[i].text, &state, &length);
    T_CHECK(state == others[i].state && length == others[i].length, "'%s'", others[i].text);
  }
}

static void test_long(void) {
  static char text[3000];
  size_t bad = 0;
  for (int zeros = 0; zeros < 2000; zeros += 97) {
    char *at = text + snprintf(text, sizeof text, "0.");
    for (int i = 0; i < zeros; i++) *at++ = '0';
    snprintf(at, 100, "123456789e%d", zeros);
    bad += !same(text);
    at = text + snprintf(text, sizeof text, "1");
    for (int i = 0; i < zeros; i++) *at++ = '0';
    snprintf(at, 100, "7e-%d", zeros);
    bad += !same(text);
    at = text;
    for (int i = 0; i < 1000; i++) *at++ = (char)('0' + (i * 7 + zeros) % 10);
    snprintf(at, 100, "e-%d", 500 + zeros / 2);
    bad += !same(text);
  }
  T_CHECK(bad == 0, "numbers of a thousand digits, %zu differ", bad);
  /* The midpoint of two doubles in full: 1 + 2^-53, then a one far behind it. */
  char *at = text + snprintf(text, sizeof text, "1.00000000000000011102230246251565404236316680908203125");
  bad = !same(text);
  for (int i = 0; i < 1000; i++) *at++ = '0';
  *at = '\0';
  bad += !same(text);
  strcpy(at, "1");
  bx_number_state state;
  size_t length;
  bad += !same(text) || parsed(text, &state, &length) != 1 + DBL_EPSILON;
  T_CHECK(bad == 0, "a midpoint, and one with a digit a thousand places behind it");
}

static void test_random(void) {
  uint64_t seed = 2024;
  size_t bad = 0, worst_length = 0;
  enum { N = 20000 };
  for (int i = 0; i < N; i++) {
    uint64_t bits = t_random(&seed);
    double value, back;
    memcpy(&value, &bits, sizeof value);
    if (!isfinite(value)) continue;
    char text[BX_NUMBER_SIZE], long_text[64];
    bx_format_number(value, text);
    const char *end;
    bad += bx_parse_number(text, &end, &back) != BX_NUMBER_OK || memcmp(&back, &value, sizeof value) || *end;
    if (strlen(text) > worst_length) worst_length = strlen(text);
    snprintf(long_text, sizeof long_text, "%.*e", i % 40, value);
    bad += !same(long_text);
    /* decimals near the middle of two doubles */
    snprintf(long_text, sizeof long_text, "%lld.%lld", (long long)(bits >> 10), (long long)(bits & 1023));
    bad += !same(long_text);
  }
  T_CHECK(bad == 0, "%d random doubles there and back (seed 2024), %zu differ", N, bad);
  T_CHECK(worst_length < BX_NUMBER_SIZE, "the longest text has %zu characters", worst_length);
  char text[BX_NUMBER_SIZE];
  bx_format_number(0.1, text);
  T_CHECK(!strcmp(text, "0.1"), "the shortest text: %s", text);
  bx_format_number(-0.0, text);
  T_CHECK(!strcmp(text, "-0"), "minus zero: %s", text);
}

/* The same text as printf's with the least of 15, 16, 17 digits that reads back; the locale is C here. */
static bool as_printed(double value) {
  char text[BX_NUMBER_SIZE], printed[64];
  int length = bx_format_number(value, text);
  for (int digits = 15; digits <= 17; digits++) {
    snprintf(printed, sizeof printed, "%.*g", digits, value);
    if (strtod(printed, NULL) == value) break;
  }
  bool equal = !strcmp(text, printed) && (size_t)length == strlen(text);
  if (!equal) printf("# %s, printf has %s\n", text, printed);
  return equal;
}

static void test_everyday(void) {
  uint64_t seed = 7;
  size_t bad = 0;
  enum { N = 100000 };
  for (int i = 0; i < N; i++) {
    double size = ldexp(1 + t_uniform(&seed), (int)(t_random(&seed) % 100) - 45), value = i & 1 ? -size : size;
    bad += !as_printed(value);                                                              /* all bits */
    bad += !as_printed(nearbyint(value * 4096) / 4096);                                     /* few bits: ties */
    bad += !as_printed((double)(t_random(&seed) % 100000000) / pow(10, i % 17));            /* few digits */
    bad += !as_printed(nextafter((double)(t_random(&seed) % 1000) / 1000, i & 1 ? 2 : -2)); /* next to few digits */
  }
  T_CHECK(bad == 0, "%d numbers of everyday size are written as printf would (seed 7), %zu differ", 4 * N, bad);
  bad = 0;
  for (int e = -60; e <= 60; e++) {
    char power[16];
    snprintf(power, sizeof power, "1e%d", e / 3);
    double values[2] = {ldexp(1, e), strtod(power, NULL)};
    for (int i = 0; i < 2; i++)
      for (int side = 0; side < 3; side++)
        bad += !as_printed(side ? nextafter(values[i], side * 1e99 - 1e99) : values[i]);
  }
  T_CHECK(bad == 0, "so are powers of 2 and 10 and their neighbours, %zu differ", bad);
}

static void test_integer(void) {
  static const struct {
    const char *text;
    bx_number_state state;
    int64_t value;
  } cases[] = {{"0", BX_NUMBER_OK, 0},
               {"-12", BX_NUMBER_OK, -12},
               {"+7", BX_NUMBER_OK, 7},
               {"4294967296", BX_NUMBER_OK, 4294967296},
               {"99999999999999999999999", BX_NUMBER_TOO_LARGE, 0},
               {"x", BX_NUMBER_NONE, 0},
               {"1.5", BX_NUMBER_OK, 1}};
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    int64_t value = 0;
    const char *end;
    bx_number_state state = bx_parse_integer(cases[i].text, &end, &value);
    T_CHECK(state == cases[i].state && value == cases[i].value, "whole number '%s'", cases[i].text);
  }
}

int main(void) {
  test_by_hand();
  test_long();
  test_random();
  test_everyday();
  test_integer();
  return t_done();
}
