/* Command lines: one table of options gives the parser, the help and the suggestions. */
#include "cli.h"

#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- messages ------------------------------------------------------------------------------------ */

/* One line, whatever a file name or text holds. */
static void print_line(const char *format, va_list args) {
  char text[1024];
  vsnprintf(text, sizeof text, format, args);
  for (char *c = text; *c; c++)
    if ((unsigned char)*c < 32 || *c == 127) *c = ' ';
  fprintf(stderr, "batten: %s", text);
}

void cli_error(const char *format, ...) {
  va_list args;
  va_start(args, format);
  print_line(format, args);
  va_end(args);
  fputc('\n', stderr);
}

int cli_usage(const char *command, const char *format, ...) {
  va_list args;
  va_start(args, format);
  print_line(format, args);
  va_end(args);
  fprintf(stderr, " (see batten %s%s--help)\n", command ? command : "", command ? " " : "");
  return CLI_USAGE;
}

/* ---- nearest word -------------------------------------------------------------------------------- */

enum { WORD_MAX = 40 };

/* Letters to insert, remove or change to get from one word to the other. */
static size_t edit_distance(const char *a, const char *b) {
  size_t row[WORD_MAX + 1], n = strlen(a), m = strlen(b);
  if (n > WORD_MAX || m > WORD_MAX) return WORD_MAX;
  for (size_t j = 0; j <= m; j++) row[j] = j;
  for (size_t i = 1; i <= n; i++) {
    size_t diagonal = row[0];
    row[0] = i;
    for (size_t j = 1; j <= m; j++) {
      size_t best = diagonal + (a[i - 1] != b[j - 1]);
      if (row[j] + 1 < best) best = row[j] + 1;
      if (row[j - 1] + 1 < best) best = row[j - 1] + 1;
      diagonal = row[j];
      row[j] = best;
    }
  }
  return row[m];
}

const char *cli_nearest(const char *text, const char *const *words, size_t count) {
  const char *best = NULL;
  size_t least = strlen(text) / 3 + 1; /* more than a third wrong is another word */
  for (size_t i = 0; i < count; i++) {
    size_t d = edit_distance(text, words[i]);
    if (d < least) {
      least = d;
      best = words[i];
    }
  }
  return best;
}

/* ---- parser -------------------------------------------------------------------------------------- */

enum { MISSING_ARGUMENT = ':', UNKNOWN_OPTION = '?' };

static size_t table_size(const cli_option *table) {
  size_t n = 0;
  while (table[n].name) n++;
  return n;
}

bool cli_options_open(cli_options *o, const char *command, const cli_option *table, int argc, char **argv) {
  size_t n = table_size(table), used = 0;
  *o = (cli_options){.command = command, .table = table, .argc = argc, .argv = argv};
  o->longs = calloc(n + 1, sizeof *o->longs);
  o->shorts = calloc(2 * n + 2, 1);
  if (!o->longs || !o->shorts) {
    cli_options_close(o);
    cli_error("out of memory");
    return false;
  }
  o->shorts[used++] = ':';
  for (size_t i = 0; i < n; i++) {
    o->longs[i] = (struct option){.name = table[i].name, .has_arg = table[i].argument != NULL, .val = table[i].key};
    if (table[i].key > CHAR_MAX) continue;
    o->shorts[used++] = (char)table[i].key;
    if (table[i].argument) o->shorts[used++] = ':';
  }
  optind = 1;
  opterr = 0;
  return true;
}

void cli_options_close(cli_options *o) {
  free(o->longs);
  free(o->shorts);
  o->longs = NULL;
  o->shorts = NULL;
}

static void complain(const cli_options *o, int what) {
  const char *given = o->argv[optind - 1];
  if (what == MISSING_ARGUMENT) {
    cli_usage(o->command, "%s: needs a value", given);
    return;
  }
  if (strncmp(given, "--", 2) != 0) {
    cli_usage(o->command, "unknown option '-%c'", optopt);
    return;
  }
  char name[WORD_MAX + 1];
  size_t length = strcspn(given + 2, "="), n = table_size(o->table), alike = 0;
  if (length > WORD_MAX) length = WORD_MAX;
  memcpy(name, given + 2, length);
  name[length] = '\0';
  const char *words[64];
  for (size_t i = 0; i < n && i < 64; i++) {
    words[i] = o->table[i].name;
    if (strcmp(name, words[i]) == 0) {
      cli_usage(o->command, "--%s: takes no value", name);
      return;
    }
    alike += strncmp(name, words[i], length) == 0;
  }
  const char *nearest = cli_nearest(name, words, n < 64 ? n : 64);
  if (alike > 1)
    cli_usage(o->command, "option '--%s' is ambiguous", name);
  else if (nearest)
    cli_usage(o->command, "unknown option '--%s'; did you mean '--%s'?", name, nearest);
  else
    cli_usage(o->command, "unknown option '--%s'", name);
}

int cli_options_next(cli_options *o) {
  int key = getopt_long(o->argc, o->argv, o->shorts, o->longs, NULL);
  o->value = optarg;
  if (key == -1) return CLI_OPTIONS_END;
  if (key != MISSING_ARGUMENT && key != UNKNOWN_OPTION) return key;
  complain(o, key);
  return CLI_OPTIONS_BAD;
}

void cli_options_print(const cli_option *table) {
  for (const cli_option *o = table; o->name; o++) {
    char left[64];
    int used =
        o->key <= CHAR_MAX ? snprintf(left, sizeof left, "-%c, ", o->key) : snprintf(left, sizeof left, "    ");
    snprintf(left + used, sizeof left - (size_t)used, "--%s%s%s", o->name, o->argument ? " " : "",
             o->argument ? o->argument : "");
    printf("  %-28s ", left);
    for (const char *c = o->help; *c; c++) {
      putchar(*c);
      if (*c == '\n') printf("%31s", "");
    }
    putchar('\n');
  }
}

/* ---- values -------------------------------------------------------------------------------------- */

bool cli_parse_number(const char *option, const char *text, double lower, double upper, double *out) {
  char *end;
  double v = strtod(text, &end); /* the program never leaves the C locale */
  if (end == text || *end || !(v >= lower && v <= upper) || !isfinite(v)) {
    if (isfinite(upper))
      cli_error("%s: '%s' is not a number from %g to %g", option, text, lower, upper);
    else
      cli_error("%s: '%s' is not a number of %g or more", option, text, lower);
    return false;
  }
  *out = v;
  return true;
}

bool cli_parse_count(const char *option, const char *text, size_t lower, size_t upper, size_t *out) {
  char *end;
  errno = 0;
  unsigned long long v = strtoull(text, &end, 10);
  if (text[0] < '0' || text[0] > '9' || *end || errno || v < lower || v > upper) {
    cli_error("%s: '%s' is not a whole number from %zu to %zu", option, text, lower, upper);
    return false;
  }
  *out = (size_t)v;
  return true;
}

bool cli_parse_bytes(const char *option, const char *text, size_t *out) {
  static const char units[] = "KMGT";
  char *end;
  double v = strtod(text, &end);
  const char *unit = *end ? strchr(units, *end == 'k' ? 'K' : *end) : NULL;
  if (unit) {
    for (const char *u = units; u <= unit; u++) v *= 1024;
    end++;
    if (*end == 'i') end++;
  }
  if (*end == 'B') end++;
  if (end == text || *end || !(v >= 1 << 20) || !(v < (double)(SIZE_MAX / 2))) {
    cli_error("%s: '%s' is not a size of 1M or more, such as 500M or 2G", option, text);
    return false;
  }
  *out = (size_t)v;
  return true;
}

bool cli_parse_numbers(const char *option, const char *text, size_t count, double *out) {
  const char *p = text;
  for (size_t i = 0; i < count; i++) {
    char *end;
    double v = strtod(p, &end);
    if (end == p || !isfinite(v) || *end != (i + 1 < count ? ',' : '\0')) {
      cli_error("%s: '%s' is not %zu numbers parted by commas", option, text, count);
      return false;
    }
    out[i] = v;
    p = end + 1;
  }
  return true;
}

bool cli_parse_word(const char *option, const char *text, const char *const *words, int *out) {
  size_t n = 0;
  char list[256] = "";
  for (; words[n]; n++) {
    if (strcmp(text, words[n]) == 0) {
      *out = (int)n;
      return true;
    }
    snprintf(list + strlen(list), sizeof list - strlen(list), "%s%s", n ? ", " : "", words[n]);
  }
  const char *nearest = cli_nearest(text, words, n);
  if (nearest)
    cli_error("%s: '%s' is not one of %s; did you mean '%s'?", option, text, list, nearest);
  else
    cli_error("%s: '%s' is not one of %s", option, text, list);
  return false;
}
