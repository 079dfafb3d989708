#!/bin/sh
# What a shared library exports is what the list says, and all of it is declared in a public header; what it takes
# from the host is none of what an embedded library has to leave alone.
#   symbols.sh LIBRARY LIST HEADER...            compares
#   symbols.sh --write LIBRARY LIST              writes the list anew (see docs/testing.md)
set -u
export LC_ALL=C

exported() { nm -D --defined-only "$1" | awk '$2 ~ /^[A-Z]$/ { sub(/@.*/, "", $3); print $3 }' | sort -u; }

if [ "$1" = --write ]; then
  exported "$2" >"$3"
  exit
fi
library=$1
list=$2
shift 2
number=0
scratch=$(mktemp -d) || exit 1
trap 'rm -rf "$scratch"' EXIT

empty() { # empty WHAT: the file of lines to complain of has none
  number=$((number + 1))
  if [ ! -s "$scratch/lines" ]; then
    echo "ok $number - $1"
  else
    echo "not ok $number - $1"
    sed 's/^/#   /' "$scratch/lines"
  fi
}

exported "$library" >"$scratch/exported"
grep -v '^batten_' "$scratch/exported" >"$scratch/lines"
empty "every exported name starts with batten_"

# A declaration is BATTEN_API ... batten_name(: the first such name after the macro.
cat "$@" | tr '\n' ' ' | sed 's/BATTEN_API/\n&/g' | sed -n 's/^BATTEN_API [^(]*\(batten_[a-z0-9_]*\)(.*/\1/p' |
  sort -u >"$scratch/declared"
comm -23 "$scratch/exported" "$scratch/declared" >"$scratch/lines"
empty "every exported name is declared in a public header"
comm -13 "$scratch/exported" "$scratch/declared" >"$scratch/lines"
empty "every declared name is exported"

sort -u "$list" | comm -3 - "$scratch/exported" >"$scratch/lines"
empty "exports are those of $(basename "$list") (left: only in the list; right: only in the library)"

# Ends the process, prints, reads the environment, or changes what belongs to the host.
nm -D --undefined-only "$library" | awk '{ sub(/@.*/, "", $2); print $2 }' |
  grep -Ex '_?_?(v?printf|puts|putchar|perror)(_chk)?|_?exit|_Exit|quick_exit|abort|atexit|stdout|stderr|stdin|'\
's?rand(_r)?|random|srandom|drand48|setlocale|uselocale|signal|sigaction|raise|kill|system|'\
'(secure_)?getenv|setenv|putenv|fesetround|fesetenv|feenableexcept|'\
'(openblas|goto|omp|mkl)_set_.*|chdir|setrlimit' >"$scratch/lines"
empty "takes nothing from the host that it has to leave alone"
echo "1..$number"
