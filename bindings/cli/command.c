/* What every subcommand does around its work: parse, help, check of the outputs. */
#include "cli.h"

#include <math.h>
#include <stdint.h>

/* The options that all commands have; the rest is the command's own. */
static bool take(const cli_command *c, cli_request *q, int key, const char *value) {
  size_t count = 0;
  switch (key) {
    case 'h':
      q->help = true;
      return true;
    case 'q':
      q->quiet = true;
      return true;
    case CLI_KEY_REPORT:
      return cli_outputs_add(&q->outputs, CLI_OUTPUT_REPORT, value);
    case CLI_KEY_MEMORY:
      return cli_parse_bytes("--memory", value, &q->memory);
    case CLI_KEY_THREADS:
      if (!cli_parse_count("--threads", value, 1, 64, &count)) return false;
      q->threads = (unsigned)count;
      return true;
    default:
      return c->take(q, key, value);
  }
}

bool cli_take_picture(batten_picture_options *p, int key, const char *value) {
  static const char *const axes[] = {"x", "y", "z", NULL};
  double pair[2] = {0};
  int word = 0;
  switch (key) {
    case CLI_KEY_VIEW:
      if (!cli_parse_numbers("--view", value, 2, pair)) return false;
      if (fabs(pair[1]) > 90) {
        cli_error("--view: elevation %g is not from -90 to 90", pair[1]);
        return false;
      }
      p->azimuth_deg = pair[0];
      p->elevation_deg = pair[1];
      return true;
    case CLI_KEY_UP:
      if (!cli_parse_word("--up", value, axes, &word)) return false;
      p->up_axis = (unsigned)word;
      return true;
    case CLI_KEY_SIZE:
      if (!cli_parse_numbers("--size", value, 2, pair)) return false;
      if (!(pair[0] >= 16 && pair[0] <= 8192 && pair[1] >= 16 && pair[1] <= 8192) || pair[0] != floor(pair[0]) ||
          pair[1] != floor(pair[1])) {
        cli_error("--size: '%s' is not two whole numbers of pixels from 16 to 8192", value);
        return false;
      }
      p->width = (unsigned)pair[0];
      p->height = (unsigned)pair[1];
      return true;
    default:
      p->title = value;
      return true;
  }
}

static int take_operand(const cli_command *c, cli_request *q, int argc, char **argv) {
  if (optind >= argc) return cli_usage(c->name, "no %s", c->operand);
  if (optind + 1 < argc) return cli_usage(c->name, "one %s at a time, not also '%s'", c->operand, argv[optind + 1]);
  q->input = argv[optind];
  return CLI_DONE;
}

/* CLI_DONE: go on; q->help when only that was asked for. */
static int parse(const cli_command *c, cli_request *q, int argc, char **argv) {
  cli_options o;
  if (!cli_options_open(&o, c->name, c->table, argc, argv)) return CLI_FAILED;
  int status = CLI_DONE, key;
  while (status == CLI_DONE && !q->help && (key = cli_options_next(&o)) != CLI_OPTIONS_END)
    if (key == CLI_OPTIONS_BAD || !take(c, q, key, o.value)) status = CLI_USAGE;
  if (status == CLI_DONE && !q->help) status = take_operand(c, q, argc, argv);
  cli_options_close(&o);
  return status;
}

int cli_command_run(const cli_command *c, cli_request *q, int argc, char **argv) {
  int status = parse(c, q, argc, argv);
  if (status == CLI_DONE && q->help)
    c->print_help();
  else if (status == CLI_DONE) {
    bool usage;
    status = cli_outputs_check(&q->outputs, q->input, &usage) ? c->work(q) : usage ? CLI_USAGE : CLI_FAILED;
  }
  cli_outputs_close(&q->outputs);
  return status;
}
