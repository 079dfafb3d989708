/* What every subcommand does around its work: parse, help, check of the outputs. */
#include "cli.h"

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
