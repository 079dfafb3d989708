#!/bin/bash
# batten convex from outside: texts, exit codes, files, figures. Prints TAP.
#   test_convex.sh PROGRAM SOURCE_ROOT
set -u
. "${0%/*}/functions.sh"

# ---- texts --------------------------------------------------------------------------------------

run 0 "" convex --help
cp out help
check "no line of the help is longer than 118" awk 'length > 118 { exit 1 }' help
for option in output unconstrained picture report degree spans smoothness domain tension rounds parameters rounds-tol correction \
  margin function concave signs gap unit density tolerance view up size title memory threads quiet; do
  check "the help tells --$option" grep -q -- " --$option" help
done
sed -n '/^example/,/^exit status/p' help | grep '^  ' >example.sh
mkdir bin && ln -s "$batten" bin/batten
PATH=$work/bin:$PATH bash -e example.sh >out 2>err
ok $? "the examples of convex --help run when pasted: $(cat err)"
check "without a warning" test ! -s err
check "its STEP file is one" grep -q '^ISO-10303-21;' patch.step
check "and its picture" test -s patch.png
check "the summary tells the proof" grep -Eq '^convexity +proven: Gaussian curvature at least' out
report=patch.report.json
is $report status ok
is $report certified True
holds $report margin_min 'x > 0'
holds $report K_min "x >= $(figure $report margin_min)"
holds $report lsq "x >= $(figure $report lsq_unconstrained) * 0.99 && x <= $(figure $report lsq_reference)"
holds $report supporting_gap 'x >= 0 && x < 1e-9'
is $report points 60
run 0 "" inspect patch.json --report i.json
for key in certified margin_min K_min K_max area sign; do is i.json $key "$(figure $report $key)"; done

# ---- wrong usage --------------------------------------------------------------------------------

ls -A >before
run 2 "no file of points" convex
run 2 "unknown option '--degreee'; did you mean '--degree'?" convex points.xyz --degreee 3
run 2 "--degree: '8'" convex points.xyz --degree 8
run 2 "--degree: 'x'" convex points.xyz --degree 3,x
run 2 "--spans: '0'" convex points.xyz --spans 0,1
run 2 "--parameters: 'flat' is not one of" convex points.xyz --parameters flat
run 2 "--signs needs --function" convex points.xyz --signs signs.txt
run 2 "--concave needs --function" convex points.xyz --concave
run 2 "--parameters is of surfaces: not with --function" convex points.xyz --function --parameters project
run 2 "--concave and --signs: give one of them" convex points.xyz --function --concave --signs s.txt
run 2 "x.txt: unknown extension for -o; use .step .iges .json .vtu" convex points.xyz -o x.txt
run 2 "x.svg: unknown extension for --picture; use .png" convex points.xyz --picture x.svg
run 2 "./x.step: is named as output twice" convex points.xyz -o x.step --unconstrained ./x.step
run 1 "none.xyz" convex none.xyz -o x.step
run 1 "points.xyz: points: no columns u and v in the file" convex points.xyz --parameters file -o x.step
run 1 "--smoothness" convex points.xyz --degree 3 --smoothness 3 -o x.step
run 1 "s.txt: cannot be read" convex points.xyz --function --signs s.txt -o x.step
printf '++\n+\n' >two.txt
run 1 "two.txt:2: 1 signs for 2 spans in x; give one each (see --spans)" convex points.xyz --function --spans 2 --signs two.txt
printf '++\n' >one.txt
run 1 "one.txt: 1 lines for 2 spans in y; give one each (see --spans)" convex points.xyz --function --spans 2 --signs one.txt
printf '+*\n++\n' >star.txt
run 1 "star.txt:1: '*' is no sign; give +, - or 0" convex points.xyz --function --spans 2 --signs star.txt
awk 'BEGIN { for (i = 0; i < 20; i++) print i, 2 * i, 3 * i }' >line.xyz
run 1 "line.xyz: points" convex line.xyz -o x.step
awk 'BEGIN { for (i = 0; i < 20; i++) print 1, 2, 3 }' >same.xyz
run 1 "same.xyz: points" convex same.xyz -o x.step
printf '0 0 0\n1 0 0\n0 1 0\n1 1 1\n' >four.xyz
run 1 "four.xyz: 4 points; a convex surface needs 6 at least" convex four.xyz -o x.step
rm -f two.txt one.txt star.txt line.xyz same.xyz four.xyz

# The words are those of the command line: what the library calls opt.x is --x, and files are named once.
run 1 "batten: points.none.xyz: cannot open" convex points.none.xyz
run 1 "batten: --domain: of parameters in the file" convex points.xyz --domain 0,1,0,1
run 1 "batten: --domain: 1 to 0; give two ascending numbers, or leave it away" convex points.xyz --function --domain 1,0,0,1
run 1 "is outside the domain 0 .. 0.5; remove it, or widen --domain" convex points.xyz --function --domain 0,0.5,0,1
run 1 "batten: --rounds: 50; give 1 to 20" convex points.xyz --function --rounds 50
run 1 "batten: --spans: 20; must be 1 .. 16" convex points.xyz --spans 20
run 1 "batten: --smoothness: 3; degree 3 allows 1 to 2" convex points.xyz --function --smoothness 3
run 1 "or --tension > 0" convex points.xyz --degree 7 --tension 0
run 1 "--memory allows 1048576" convex points.xyz --memory 1M
run 2 "--size: '300.5,200' is not two whole numbers" convex points.xyz --size 300.5,200
run 1 "batten: --size: 16 x 16 leave 8 x 8 pixels to a panel" convex points.xyz --picture x.png --size 16,16
cut -d' ' -f1,2 points.xyz >two.xyz
run 1 "batten: two.xyz: the points have x and y only, a column z is missing" convex two.xyz
awk 'BEGIN { print "x,y,z,w" } { print $1 "," $2 "," $3 "," (NR == 4 ? -1 : 1) }' points.xyz >negative.csv
run 1 "batten: negative.csv: weights[3]: -1" convex negative.csv
run 1 "batten: negative.csv: weights[3]: -1" convex negative.csv --function
awk 'BEGIN { print "x,y,z,u,v" } { print $1 "," $2 "," $3 ",1," $2 }' points.xyz >row.csv
run 1 "batten: row.csv: parameters: all 60 have u = 1; spread them, or take --parameters project" convex row.csv
printf '%s\n' OFF '6 8 0' '1 0 0' '0 1 0' '-1 0 0' '0 -1 0' '0 0 1' '0 0 -1' \
  '3 0 1 4' '3 1 2 4' '3 2 3 4' '3 3 0 4' '3 1 0 5' '3 2 1 5' '3 3 2 5' '3 0 3 5' >closed.off
run 1 "batten: closed.off: triangles: they close to a surface without a boundary" convex closed.off --parameters floater
printf '+\xe2\x88\x92\n++\n' >minus.txt
run 1 "minus.txt:1: '$(printf '\xe2\x88\x92')' is no sign" convex points.xyz --function --spans 2 --signs minus.txt
rm -f two.xyz negative.csv row.csv closed.off minus.txt
nothing_new "after all failures"

# ---- shapes that are not convex -----------------------------------------------------------------

awk 'BEGIN { srand(5); for (i = 0; i < 80; i++) { x = 2 * rand() - 1; y = 2 * rand() - 1; print x, y, x * y } }' >saddle.xyz
run 0 "warning" convex saddle.xyz --quiet -o plane.json --report s.json
is s.json status shape
is s.json plane True
is s.json flat True
awk 'BEGIN { srand(6); for (i = 0; i < 400; i++) { x = 2 * rand() - 1; y = 2 * rand() - 1
  dent = 0.2 * exp(-((x - 0.1) ^ 2 + (y + 0.2) ^ 2) / 0.02)
  print x, y, sqrt(6 - x * x - y * y) - dent + 0.004 * (rand() - 0.5) } }' >dent.xyz
run 0 "warning" convex dent.xyz --quiet -o dent.json --report d.json
is d.json status shape
is d.json plane False
is d.json certified True

# ---- parameters, weights, meshes ----------------------------------------------------------------

awk 'BEGIN { print "x,y,z,u,v,w"; srand(7); for (i = 0; i < 90; i++) { u = rand(); v = rand(); x = 3 * u; y = 2 * v
  printf "%.17g,%.17g,%.17g,%.17g,%.17g,%g\n", x, y, x * x + y * y + x * y / 2, 10 + 2 * u, 7 * v, 1 + i % 2 } }' >uv.csv
run 0 "" convex uv.csv --quiet --degree 2 --domain 10,12,0,7 -o uv.json --report u.json
is u.json status ok
holds u.json rms 'x < 1e-3'
run 0 "" convex uv.csv --quiet --degree 2,3 --correction 0 --tension 0 --domain 10,12,0,7 --report u.json
holds u.json rms 'x < 1e-9'
check "the surface has the domain that was given" python3 -c '
import json
k = json.load(open("uv.json"))["knots"]
assert k[0][0] == 10 and k[0][-1] == 12 and k[1][0] == 0 and k[1][-1] == 7'
run 1 "parameters" convex uv.csv --domain 0,1,0,1 -o x.json
run 0 "" convex points.xyz --quiet -o cap.ply
run 0 "" convex cap.ply --quiet --parameters floater --report f.json
is f.json certified True
holds f.json rms 'x < 0.01'

# ---- functions ----------------------------------------------------------------------------------

is function.json batten surface
awk 'BEGIN { srand(8); for (i = 0; i < 300; i++) { x = 2 * rand() - 1; y = 2 * rand() - 1
  print x, y, (x < 0 ? -1 : 1) * (1.5 * x * x) + 0.2 * y + 0.01 * (rand() - 0.5) } }' >wave.xyz
printf -- '-+\n-+\n' >signs.txt
run 0 "" convex wave.xyz --quiet --function --spans 2 --signs signs.txt --domain=-1,1,-1,1 -o wave.json --report w.json
is w.json certified True
is w.json function True
holds w.json lsq "x >= $(figure w.json lsq_lower)"
holds w.json rms 'x < 0.04'

# ---- every format -------------------------------------------------------------------------------

run 0 "" convex points.xyz --quiet -o a.step -o a.stp -o a.iges -o a.igs -o a.vtu -o a.ply -o a.obj -o a.stl -o a.off -o a.vtp -o a.vtk \
  --unconstrained b.json
for format in step stp iges igs vtu ply obj stl off vtp vtk; do check "a.$format is there" test -s a.$format; done
run 0 "" inspect b.json --report b.report.json
is b.report.json certified False
run 0 "" convex points.xyz --quiet --function --concave --picture f.png --size 300,200

# ---- report -------------------------------------------------------------------------------------

for key in $(sed -n -e '/^## Common/,/^## batten solid/s/^| \(`[^|]*`\) |.*/\1/p' \
  -e '/^## batten convex/,/^## batten curve/s/^| \(`[^|]*`\) |.*/\1/p' "$root/docs/report.md" | tr -d '`'); do
  echo "$key"
done | sort >documented
for file in $report w.json; do
  python3 -c 'import json, sys; print("\n".join(sorted(json.load(open(sys.argv[1])))))' $file >reported
  check "$file has the documented keys and no others: $(diff documented reported | tr '\n' ' ')" cmp documented reported
done

# The same bits for any number of threads.
run 0 "" convex points.xyz --quiet --threads 1 -o one.json
run 0 "" convex points.xyz --quiet --threads 4 -o four.json
check "one thread or four" cmp one.json four.json

echo "1..$count"
exit $bad
