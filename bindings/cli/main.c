/* The program batten: subcommands by name. */
#include "cli.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct command {
  const char *name;
  int (*run)(int argc, char **argv);
  const char *help;
} command;

static const command commands[] = {
    {"solid", cli_solid, "solid from scattered surface points: mesh, picture, report"},
    {"stack", cli_stack, "solid from plane sections, parallel or not: mesh, picture, report"},
    {"frep", cli_frep, "algebra of solids: unions, blends, offsets, sweeps, deformations of a scene"},
    {"convex", cli_convex, "convex surface or function from scattered points: STEP, mesh, picture, report"},
    {"curve", cli_curve, "planar curves of wanted inflections through points: STEP, SVG, picture, report"},
    {"loft", cli_loft, "surface through contours whose sections keep their shape: STEP, mesh, picture, report"},
    {"network", cli_network, "smooth G1 surface through a triangle mesh: STEP, mesh, picture, report"},
    {"qp", cli_qp, "convex quadratic program: QPS, JSON and MATLAB files"},
    {"inspect", cli_inspect, "what is in a file, and its measures"},
};
enum { COMMANDS = sizeof commands / sizeof commands[0] };

static void print_help(void) {
  printf(
      "batten %s: smooth solids and surfaces from points and meshes, with figures that say how good they are\n\n"
      "usage: batten COMMAND [OPTIONS] FILE\n\ncommands:\n",
      batten_version());
  for (size_t i = 0; i < COMMANDS; i++) printf("  %-10s %s\n", commands[i].name, commands[i].help);
  printf(
      "\nbatten COMMAND --help tells the options of a command, with examples.\n"
      "batten --version tells the version and the linear algebra library that is loaded.\n\n"
      "exit status: 0 done, 1 could not, 2 wrong usage, 130 interrupted; the reason is one line on stderr\n");
}

static void print_version(void) {
  char blas[256];
  batten_blas_describe(blas, sizeof blas);
  printf("batten %s\nBLAS: %s\n", batten_version(), blas);
}

static int unknown(const char *name) {
  const char *names[COMMANDS];
  for (size_t i = 0; i < COMMANDS; i++) names[i] = commands[i].name;
  const char *nearest = cli_nearest(name, names, COMMANDS);
  bool option = name[0] == '-';
  if (nearest && !option) return cli_usage(NULL, "unknown command '%s'; did you mean '%s'?", name, nearest);
  return cli_usage(NULL, "unknown %s '%s'", option ? "option" : "command", name);
}

int main(int argc, char **argv) {
  if (argc < 2) return cli_usage(NULL, "no command");
  if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0 || strcmp(argv[1], "help") == 0)
    print_help();
  else if (strcmp(argv[1], "--version") == 0 || strcmp(argv[1], "-V") == 0)
    print_version();
  else {
    for (size_t i = 0; i < COMMANDS; i++)
      if (strcmp(argv[1], commands[i].name) == 0) {
        int status = commands[i].run(argc - 1, argv + 1);
        if (status == CLI_DONE && fflush(stdout) != 0) {
          cli_error("standard output: cannot be written");
          return CLI_FAILED;
        }
        return status;
      }
    return unknown(argv[1]);
  }
  if (fflush(stdout) == 0) return CLI_DONE;
  cli_error("standard output: cannot be written");
  return CLI_FAILED;
}
