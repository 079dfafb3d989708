#!/bin/bash
# batten qp from outside: texts, exit codes, solutions, proofs, conversion. Prints TAP.
#   test_qp.sh PROGRAM SOURCE_ROOT
set -u
. "${0%/*}/functions.sh"

# ---- texts --------------------------------------------------------------------------------------

run 0 "" qp --help
cp out help
check "no line of the help is longer than 118" awk 'length > 118 { exit 1 }' help
for option in output report write engine tolerance exact start time-limit iterations memory threads quiet; do
  check "the help tells --$option" grep -q -- " --$option" help
done
sed -n '/^example/,/^exit status/p' help | grep '^  ' >example.sh
mkdir bin && ln -s "$batten" bin/batten
PATH=$work/bin:$PATH bash -e example.sh >out 2>err
ok $? "the example of qp --help runs when pasted: $(cat err)"
check "and finds the point" awk -F, '{ d = $2 - (NR == 1 ? 1.4 : 1.7); if (d > 1e-9 || d < -1e-9) exit 1 } END { exit NR != 2 }' near-x.csv
check "the summary says optimal" grep -Eq '^status +optimal$' out
holds near-figures.json objective 'x > 0.4 - 1e-12 && x < 0.4 + 1e-12'

# ---- wrong usage --------------------------------------------------------------------------------

ls -A >before
run 2 "no problem" qp
run 2 "not also 'b.qps'" qp a.qps b.qps
run 2 "unknown option '--egnine'; did you mean '--engine'?" qp near.json --egnine dual
run 2 "--engine: 'duel' is not one of auto, primal, dual, interior; did you mean 'dual'?" qp near.json --engine duel
run 2 "--tolerance: '-1'" qp near.json --tolerance -1
run 2 "--time-limit: '0'" qp near.json --time-limit 0
run 2 "--iterations: '0'" qp near.json --iterations 0
run 2 "x.txt: unknown extension for -o; use .json or .csv" qp near.json -o x.txt
run 2 "p.mat: unknown extension for --write; use .qps or .json" qp near.json --write p.mat
run 2 "near.json: is the input" qp near.json -o near.json
run 1 "none.qps" qp none.qps -o x.json
printf 'ROWS\n N o\n X r\n' >bad.qps
run 1 "bad.qps:3: row type 'X'; known are N, E, L, G" qp bad.qps -o x.json --report r.json
run 1 "QPS has no least squares" qp near.json -o x.json --write p.qps
printf '{"batten": "qp", "version": 1, "H": [[1, 2], [3, 1]], "g": [0, 0]}' >skew.json
run 1 "skew.json: problem" qp skew.json -o x.json
rm -f bad.qps skew.json
nothing_new "after all failures"

# ---- engines agree ------------------------------------------------------------------------------

cat >p.qps <<'QPS'
NAME          HS21 AND MORE
ROWS
 N  OBJ
 G  R 1
 E  SUM
 L  BOTH
COLUMNS
    X 1       R 1       10.0           SUM       1.0
    X 2       R 1       -1.0           SUM       1.0
    X 3       SUM       1.0            BOTH      1.0
    X 1       BOTH      1.0
RHS
    RHS       OBJ       100.0          R 1       10.0
    RHS       SUM       6.0            BOTH      5.0
RANGES
    RNG       BOTH      4.0
BOUNDS
 LO BND       X 1       2.0
 UP BND       X 1       50.0
 LO BND       X 2       -50.0
 UP BND       X 2       50.0
 FR BND       X 3
QUADOBJ
    X 1       X 1       0.02
    X 2       X 2       2.0
    X 3       X 3       1.0
ENDATA
QPS
run 1 "p.qps:11: column 'X 1' comes back after another one" qp p.qps
sed -i '/^    X 1       BOTH/d; s/^    X 1       R 1 .*/&\n    X 1       BOTH      1.0/' p.qps
for engine in auto primal dual interior; do
  run 0 "" qp p.qps --engine $engine -o $engine.json --report $engine-r.json --quiet
  check "$engine: --quiet prints nothing" test ! -s out
  is $engine-r.json status optimal
  holds $engine-r.json primal_residual 'x <= 1e-8'
  holds $engine-r.json dual_residual 'x <= 1e-8'
  [ $engine = auto ] || is $engine-r.json engine $engine
done
python3 - <<'PY'
import json, sys
x = {e: json.load(open(e + ".json"))["x"] for e in ("auto", "primal", "dual", "interior")}
sys.exit(any(abs(a - b) > 1e-7 for e in x for a, b in zip(x[e], x["dual"])))
PY
ok $? "all engines find the same point"
for key in rows unknowns equalities bounds; do echo "$key $(figure auto-r.json $key)"; done >sizes
check "sizes are told: $(tr '\n' ' ' <sizes)" grep -qx "equalities 1" sizes
holds auto-r.json bounds 'x == 4'
is auto-r.json name "HS21 AND MORE"
for key in $(sed -n -e '/^## Common/,/^## batten solid/s/^| \(`[^|]*`\) |.*/\1/p' \
  -e '/^## batten qp/,$s/^| \(`[^|]*`\) |.*/\1/p' "$root/docs/report.md" | tr -d '`'); do
  echo "$key"
done | sort >documented
python3 -c 'import json; print("\n".join(sorted(json.load(open("auto-r.json")))))' >reported
check "the report has the documented keys and no others: $(diff documented reported | tr '\n' ' ')" cmp documented reported
"$batten" qp p.qps --report - 2>err | python3 -c 'import json, sys; sys.exit(json.load(sys.stdin)["status"] != "optimal")'
ok $? "--report - is JSON and nothing else"
run 0 "" qp p.qps --exact --report e.json --quiet
holds e.json blend 'x >= 0 && x < 1e-6'
run 0 "" qp p.qps -o x.csv
check ".csv has the names" grep -q '^X 2,' x.csv

# Converted it is the same problem.
run 0 "" qp p.qps --write q.json -o a.json --quiet
run 0 "" qp q.json --write q.qps -o b.json --quiet
run 0 "" qp q.qps --write q2.json -o c.json --quiet
check "JSON solves to the same bits" cmp a.json b.json
check "QPS solves to the same bits" cmp a.json c.json
gzip -k q.qps
run 0 "" qp q.qps.gz -o d.json --quiet --threads 1
check "gzip and another number of threads as well" cmp a.json d.json

run 0 "" inspect p.qps --report i.json
is i.json kind "quadratic program"
check "inspect tells sizes" grep -Eq '^problem +HS21 AND MORE: 3 unknowns, 3 rows \(1 equality\), 4 bounds$' out
check "inspect tells the engine" grep -Eq '^engine +(primal|dual|interior) would be taken' out
holds i.json bytes_predicted 'x > 100'
holds i.json hessian_max 'x == 2'

# ---- starting from an earlier solution ----------------------------------------------------------

python3 - <<'PY'
import json, random
n, m = 20, 400
rows = random.Random(1)
rows = [[rows.gauss(0, 1) for j in range(n)] for i in range(m)]
for name, change in (("first", 0), ("second", 1e-3)):
    g = random.Random(2)
    g = [30 * g.gauss(0, 1) * (1 + change * g.random()) for j in range(n)]
    json.dump({"batten": "qp", "version": 1, "H": [[float(i == j) for j in range(n)] for i in range(n)], "g": g,
               "C": rows, "lower": [-1] * m, "x_upper": [0.9] * n}, open(name + ".json", "w"))
PY
for engine in primal dual; do
  run 0 "" qp first.json --engine $engine -o s.json --quiet
  run 0 "" qp second.json --engine $engine -o cold.json --report cold-r.json --quiet
  run 0 "" qp second.json --engine $engine --start s.json -o s.json --report warm-r.json --quiet
  is warm-r.json status optimal
  holds cold-r.json iterations 'x >= 10'
  holds warm-r.json iterations "x <= 0.2 * $(figure cold-r.json iterations)"
  python3 - <<'PY'
import json, sys
a, b = (json.load(open(f))["x"] for f in ("cold.json", "s.json"))
sys.exit(max(abs(p - q) for p, q in zip(a, b)) > 1e-7)
PY
  ok $? "$engine: warm and cold find the same point, the file that was started from is replaced"
done
run 1 "s.json: qp_solution: 20 numbers in 'x', but the problem has 3 unknowns" qp p.qps --start s.json
run 1 "q.json: document: it holds a batten 'qp', not a qp_solution" qp p.qps --start q.json
run 1 "none.json: cannot open" qp p.qps --start none.json
run 1 "x.csv: solutions are read from .json" qp p.qps --start x.csv

run 1 "p.qps: --time-limit: time is up" qp p.qps --time-limit 1e-9 --engine dual --report l.json
is l.json status limit

# ---- no solution: status 1, one line with the proof, solution and report written ----------------

qp() { printf '{"batten": "qp", "version": 1, %s}' "$2" >"$1"; }
qp inf.json '"H": [[1, 0], [0, 1]], "g": [0, 0], "C": [[1, 1], [1, 0]], "lower": [4, null], "upper": [null, 1], "x_upper": [null, 2], "row_names": ["SUM", "CAP"], "unknown_names": ["u", "v"]'
printf 'old\n' >inf.csv
run 1 "inf.json: no point satisfies the constraints; these contradict each other:" qp inf.json -o inf-s.json -o inf.csv --report inf-r.json
check "the line names the rows" grep -Eq 'SUM >= 4 \(times [0-9.]+\)' err
check "and the bound" grep -q 'v <= 2' err
is inf-r.json status infeasible
is inf-r.json objective None
check "an older .csv stays, there is no x" grep -qx old inf.csv
python3 - <<'PY'
import json, sys
d = json.load(open("inf-s.json"))
y = d["certificate"]
zero = [y[0] + y[1] + y[2], y[0] + y[3]]
value = 4 * y[0] + 1 * y[1] + 2 * y[3]
sys.exit(not (d["status"] == "infeasible" and max(map(abs, zero)) < 1e-9 and abs(value - 1) < 1e-9 and "x" not in d))
PY
ok $? "the certificate is one"
qp zero.json '"g": [0], "C": [[0]], "lower": [1]'
run 1 "zero.json: no point satisfies the constraints; this cannot hold, whatever x is: r1 >= 1 (times 1)" qp zero.json
qp unb.json '"H": [[1, 0], [0, 0]], "g": [0, -1], "x_lower": [0, 0]'
run 1 "unb.json: the objective falls without end along x2 (+1); bound these unknowns" qp unb.json -o unb-s.json --report unb-r.json
is unb-r.json status unbounded
qp not.json '"H": [[1, 0], [0, -1]], "g": [0, 0], "x_lower": [0, 0], "x_upper": [1, 1]'
run 1 "not.json: the objective is not convex: it curves downwards along" qp not.json --report not-r.json
is not-r.json status "not convex"
holds not-r.json not_convex_index 'x == 1'

echo "1..$count"
exit $bad
