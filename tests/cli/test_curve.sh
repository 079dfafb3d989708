#!/bin/bash
# batten curve from outside: texts, exit codes, files, figures. Prints TAP.
#   test_curve.sh PROGRAM SOURCE_ROOT
set -u
. "${0%/*}/functions.sh"

# ---- texts --------------------------------------------------------------------------------------

run 0 "" curve --help
cp out help
check "no line of the help is longer than 118" awk 'length > 118 { exit 1 }' help
for option in output unconstrained proposal picture report degree smooth closed contour inflections sign significance knots tolerance \
  parameters domain ends start-tangent end-tangent rounds rounds-tol correction tension margin construction unit deviation size title \
  memory threads quiet; do
  check "the help tells --$option" grep -q -- " --$option" help
done
sed -n '/^example/,/^exit status/p' help | grep '^  ' >example.sh
mkdir bin && ln -s "$batten" bin/batten
PATH=$work/bin:$PATH bash -e example.sh >out 2>err
ok $? "the examples of curve --help run when pasted: $(cat err)"
check "without a warning" test ! -s err
check "its STEP file is one" grep -q '^ISO-10303-21;' wave.step
check "and its picture" test -s wave.png
check "the summary tells the proof" grep -Eq '^shape +proven: exactly 2 inflections' out
report=wave.report.json
is $report status ok
is $report certified True
is $report inflections_wanted 2
is $report inflections_found 2
holds $report margin_min 'x > 0'
holds $report lsq "x >= $(figure $report lsq_unconstrained) * 0.999 && x <= $(figure $report lsq_reference)"
is $report points 81
is $report curves 1

# ---- wrong usage --------------------------------------------------------------------------------

ls -A >before
run 2 "no file of points" curve
run 2 "unknown option '--degreee'; did you mean '--degree'?" curve wave.txt --degreee 3
run 2 "--degree: '10'" curve wave.txt --degree 10
run 2 "--smooth: '3'" curve wave.txt --smooth 3
run 2 "--sign: 'up' is not one of auto, left, right" curve wave.txt --sign up
run 2 "--ends: 'fix' is not one of free, fixed" curve wave.txt --ends fix
run 2 "--inflections: '0.2,,0.4' is not 3 numbers parted by commas" curve wave.txt --inflections 0.2,,0.4
run 2 "--start-tangent: '1' is not 2 numbers" curve wave.txt --start-tangent 1
run 2 "--start-tangent: '0,-0' is no direction" curve wave.txt --start-tangent 0,-0
run 2 "x.ply: unknown extension for -o; use .json .step .iges .svg" curve wave.txt -o x.ply
run 2 "x.jpg: unknown extension for --picture; use .png or .svg" curve wave.txt --picture x.jpg
run 2 "./x.svg: is named as output twice" curve wave.txt -o x.svg --picture ./x.svg
run 1 "none.txt" curve none.txt -o x.json
run 1 "wishes.txt: cannot be read" curve wave.txt --inflections wishes.txt
run 1 "knots.txt: cannot be read" curve wave.txt --knots knots.txt
run 1 "--contour: 1; the last of the file is 0" curve wave.txt --contour 1
run 1 "wave.txt: points: no column t in the file" curve wave.txt --parameters file
run 1 "batten: --degree: 2" curve wave.txt --degree 2 --smooth 2
printf '0.4\n0.2\n' >back.txt
run 1 "back.txt:2: 0.2 is not above the number before it; sort them" curve wave.txt --inflections back.txt
printf '0.4 x\n' >word.txt
run 1 "word.txt:1: 'x' is not a number" curve wave.txt --knots word.txt
printf '{"batten": "curve"}' >kind.json
run 1 'kind.json: is no document "inflections"' curve wave.txt --inflections kind.json
printf '{"batten": "inflections", "contours": [{"inflections": [0.2, "a"]}]}' >entry.json
run 1 'entry.json: contours[0].inflections[1]: is no number' curve wave.txt --inflections entry.json
printf '0 0\n1 1\n' >two.txt
run 1 "two.txt: " curve two.txt
printf '1 1\n1 1\n1 1\n1 1\n' >same.txt
run 1 "same.txt: points" curve same.txt
rm -f back.txt word.txt kind.json entry.json two.txt same.txt
nothing_new "after all failures"

# ---- inflections: found, wanted, edited ---------------------------------------------------------

run 0 "" curve wave.txt --quiet --proposal p.json --unconstrained u.json
check "the proposal is a document with its runs" python3 -c '
import json
p = json.load(open("p.json"))
c = p["contours"][0]
assert p["batten"] == "inflections" and len(c["inflections"]) == 2 and c["sign"] == -1, c
assert sum(r["kept"] for r in c["runs"]) == 3 and c["noise"] > 0
c["inflections"] = []
json.dump(p, open("edited.json", "w"))'
run 0 "" curve wave.txt --quiet --inflections p.json -o again.json --report again.report.json
is again.report.json inflections_found 2
run 0 "warning: wave.txt: " curve wave.txt --quiet --inflections edited.json --report edited.report.json
is edited.report.json inflections_found 0
is edited.report.json certified True
is edited.report.json status shape
run 0 "" curve wave.txt --quiet --inflections 0.39,0.79 --sign right --report given.json
is given.json inflections_wanted 2
is given.json certified True
printf '0.39 # the first\n0.79\n' >list.txt
run 0 "" curve wave.txt --quiet --inflections list.txt --knots 9 --report list.json
is list.json inflections_found 2
printf '0.2, 0.4\n0.6 0.8\n' >knots.txt
run 0 "" curve wave.txt --quiet --inflections 0.39,0.79 --knots knots.txt -o k.json --report k.report.json
is k.report.json spans 7
check "the knots are those of the file and the inflections" python3 -c '
import json
k = json.load(open("k.json"))["knots"]
for t in (.2, .4, .6, .8, .39, .79): assert t in k, (t, k)'

# ---- degrees, ends, closed curves, weights ------------------------------------------------------

for degree in 2 3 4 5 9; do
  run 0 "" curve wave.txt --quiet --degree $degree --smooth 1 --report d.json
  is d.json certified True
done
run 0 "" curve wave.txt --quiet --ends fixed -o ends.json --report e.json
check "the ends are those of the data" python3 -c '
import json
p = json.load(open("ends.json"))["control_points"]
d = [list(map(float, l.split())) for l in open("wave.txt")]
for a, b in ((p[0], d[0]), (p[-1], d[-1])): assert max(abs(a[0] - b[0]), abs(a[1] - b[1])) < 1e-12, (a, b)'
run 0 "" curve wave.txt --quiet --start-tangent 1,1 -o tangent.json --report t.json
check "the curve begins in the direction that was given" python3 -c '
import json
p = json.load(open("tangent.json"))["control_points"]
x, y = p[1][0] - p[0][0], p[1][1] - p[0][1]
assert x > 0 and abs(x - y) < 1e-9 * x, (x, y)'
run 0 "" curve ring.txt --quiet --closed -o ring.json --report ring.report.json
is ring.report.json inflections_found 0
is ring.report.json curves_closed 1
check "a closed curve ends where it begins" python3 -c '
import json
c = json.load(open("ring.json"))
assert c["periodic"] and c["control_points"][0] == c["control_points"][-1]'
awk 'BEGIN { print "x,y,t,w"; for (i = 0; i < 60; i++) { t = i / 59
  printf "%.17g,%.17g,%.17g,%g\n", 3 * t, t * t * (i == 20 ? 40 : 1), 5 + 2 * t, i == 20 ? 0 : 1 } }' >weights.csv
run 0 "" curve weights.csv --quiet --inflections none --correction 0 -o w.json --report weights.json
holds weights.json rms 'x < 1e-6'
check "the parameters are those of the file" python3 -c '
import json
k = json.load(open("w.json"))["knots"]
assert k[0] == 5 and k[-1] == 7'

# ---- several contours, planes -------------------------------------------------------------------

awk 'BEGIN { for (z = 0; z < 3; z++) { print "contour " 50; for (i = 0; i < 50; i++)
  print 2.5, (3 + z) * cos(i * 0.12566), (2 + z) * sin(i * 0.12566) } }' >stack.txt
run 0 "" curve stack.txt --quiet --closed -o stack.json -o stack.step -o stack.iges -o stack.svg -o stack.vtu -o stack.vtp -o stack.vtk \
  -o stack.csv --picture stack.png --report stack.report.json
for format in step iges svg vtu vtp vtk csv png; do check "stack.$format is there" test -s stack.$format; done
is stack.report.json curves 3
is stack.report.json points 150
is stack.report.json certified True
is stack.report.json inflections_found 0
is stack.report.json contour_certified "[1, 1, 1]"
run 0 "" curve stack.txt --quiet --closed --contour 1 --report one.json
is one.json contour "[1]"
printf '0 0\n1 1\n2 0\n\n0 0\n1 0\n2 0\n\n0 0\n1 2\n2 0\n' >straight.txt
run 1 "straight.txt: contour 1: points: all 3 are one point or lie on a line" curve straight.txt -o straight.json
check "nothing is written when one contour of several fails" test ! -e straight.json
run 0 "" curve straight.txt --quiet --contour 2 -o straight.json
is one.json lsq "$(python3 -c 'import json; print(json.load(open("stack.report.json"))["contour_lsq"][1])')"
run 0 "" curve stack.csv --quiet --closed --correction 0 --report again.json
holds again.json points 'x > 153'
holds again.json max_error 'x < 0.01'
run 1 "points: closed contour 0 has parameters, but does not tell where its first point comes again" curve weights.csv --closed
run 0 "" curve weights.csv --quiet --closed --domain 5,9
run 0 "" inspect stack.json --report i.json
is i.json kind curves

# ---- report, threads, pictures ------------------------------------------------------------------

for key in $(sed -n -e '/^## Common/,/^## batten solid/s/^| \(`[^|]*`\) |.*/\1/p' \
  -e '/^### Curves/,/^## batten convex/s/^| \(`[^|]*`\) |.*/\1/p' -e '/^## batten curve/,/^## batten loft/s/^| \(`[^|]*`\) |.*/\1/p' "$root/docs/report.md" | tr -d '`'); do
  echo "$key"
done | sort >documented
for file in $report stack.report.json; do
  python3 -c 'import json, sys; print("\n".join(sorted(json.load(open(sys.argv[1])))))' $file >reported
  check "$file has the documented keys and no others: $(diff documented reported | tr '\n' ' ')" cmp documented reported
done
run 0 "" curve wave.txt --quiet --picture wave.svg --size 800,600 --title "A wave"
check "the picture in SVG has its title" grep -q '>A wave</text>' wave.svg
awk 'BEGIN { print "NACA 0012"; print "41. 41."
  for (side = 1; side >= -1; side -= 2) { print ""; for (i = 0; i <= 40; i++) { x = (1 - cos(i * 3.14159265 / 40)) / 2
    print x, side * 0.6 * (0.2969 * sqrt(x) - 0.126 * x - 0.3516 * x ^ 2 + 0.2843 * x ^ 3 - 0.1036 * x ^ 4) } } }' >naca.dat
run 0 "" curve naca.dat --quiet --picture naca.svg --report naca.json
is naca.json points 81
check "a nose does not flatten the plot of curvature" grep -Eq '>curvature, cut \([0-9.]+ to [0-9.]+\)<' naca.svg
check "nor is a plot cut where that hides little" grep -q '>curvature</text>' wave.svg
run 0 "" curve stack.txt --quiet --closed --picture stack.svg
check "a few contours have combs" grep -q '>control polygon<' stack.svg
for k in 1 2 3; do awk -v k=$k '/^contour/ { print; next } { print k, k * $2, k * $3 }' stack.txt; done >tall.txt
run 0 "" curve tall.txt --quiet --closed --picture tall.svg
check "many have curves and data alone" sh -c "grep -q '>curve<' tall.svg && ! grep -q '>control polygon<' tall.svg"
run 0 "" curve wave.txt --quiet --threads 1 -o one.json
run 0 "" curve wave.txt --quiet --threads 4 -o four.json
check "one thread or four" cmp one.json four.json
ls -A >before
(ulimit -f 1; "$batten" curve wave.txt --quiet --deviation 1e-7 -o beyond.csv >out 2>err)
ok $(($? != 1)) "a file beyond the limit of sizes: $(cat err)"
check "leaves nothing behind" sh -c 'ls -A | diff before -'

echo "1..$count"
exit $bad
