#!/bin/sh
# Every public header compiles alone, as C11 and as C++17, without a warning.
# Usage: headers.sh INCLUDE_DIR... -- HEADER...        CC, CXX: compilers; CXX empty = no C++ here
set -u
includes=
while [ "$1" != -- ]; do
  includes="$includes -I$1"
  shift
done
shift
warnings='-Wall -Wextra -Wpedantic -Wshadow -Werror'
number=0
scratch=$(mktemp -d) || exit 1
trap 'rm -rf "$scratch"' EXIT

try() { # try WHAT COMMAND...
  what=$1
  shift
  number=$((number + 1))
  if "$@" >"$scratch/log" 2>&1; then
    echo "ok $number - $what"
  else
    echo "not ok $number - $what"
    sed 's/^/# /' "$scratch/log"
  fi
}

for header; do
  # Twice: the guard holds.
  printf '#include <batten/%s>\n#include <batten/%s>\nint main(void) { return 0; }\n' "$header" "$header" \
    >"$scratch/alone.c"
  cp "$scratch/alone.c" "$scratch/alone.cpp"
  try "$header as C11" $CC -std=c11 -Wstrict-prototypes $warnings $includes -fsyntax-only "$scratch/alone.c"
  if [ -n "$CXX" ]; then
    try "$header as C++17" $CXX -std=c++17 $warnings $includes -fsyntax-only "$scratch/alone.cpp"
  fi
done
[ -n "$CXX" ] || echo "# no C++ compiler: C++ is not tried"
echo "1..$number"
