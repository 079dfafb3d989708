# What the tests of the program share: a scratch folder, checks that print TAP. Sourced with the arguments
#   PROGRAM SOURCE_ROOT
batten=$1
root=$2
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
count=0
bad=0

ok() { # ok CONDITION_STATUS TEXT
  count=$((count + 1))
  if [ "$1" -eq 0 ]; then echo "ok $count - $2"; else echo "not ok $count - $2"; bad=1; fi
}
# check TEXT COMMAND...: the command succeeds.
check() { local text=$1; shift; "$@" >/dev/null 2>&1; ok $? "$text"; }

# run EXPECTED_STATUS ERROR_PART ARGUMENT...: exit status, and one line on stderr that holds the part.
run() {
  local expected=$1 part=$2
  shift 2
  "$batten" "$@" >out 2>err
  local status=$? lines
  lines=$(wc -l <err)
  local good=1
  if [ "$status" -eq "$expected" ]; then
    if [ -z "$part" ]; then
      [ "$lines" -eq 0 ] && good=0
    else
      [ "$lines" -eq 1 ] && grep -qF -- "$part" err && [ "$(head -c 8 err)" = "batten: " ] && good=0
    fi
  fi
  ok $good "batten $*: $status, $(tr '\n' '|' <err)"
}
figure() { python3 -c 'import json, sys; print(json.load(open(sys.argv[1]))[sys.argv[2]])' "$1" "$2"; }
holds() { awk -v x="$(figure "$1" "$2")" "BEGIN { exit !($3) }"; ok $? "$1: $2 = $(figure "$1" "$2"), wanted $3"; }
is() { [ "$(figure "$1" "$2")" = "$3" ]; ok $? "$1: $2 = $(figure "$1" "$2"), wanted $3"; }
nothing_new() { # compares with the list made by `ls -A >before`
  rm -f out err
  ls -A | grep -vx before >after.tmp
  grep -vxF -f before after.tmp | grep -vx after.tmp >new.tmp
  [ ! -s new.tmp ]
  ok $? "$1: nothing is left behind $(tr '\n' ' ' <new.tmp)"
  rm -f after.tmp new.tmp before
}
