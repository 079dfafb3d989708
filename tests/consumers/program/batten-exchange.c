/* The same for batten-exchange. */
#include <batten/exchange.h>
#include <stdio.h>
#include <string.h>

int main(int argc, char **argv) {
  if (argc != 2) return 2;
  printf("batten-exchange on batten %s\n", batten_version());
  return strcmp(batten_version(), argv[1]) != 0;
}
