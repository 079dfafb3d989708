#!/bin/bash
# batten loft from outside: texts, exit codes, files, figures. Prints TAP.
#   test_loft.sh PROGRAM SOURCE_ROOT
set -u
. "${0%/*}/functions.sh"

# ---- texts --------------------------------------------------------------------------------------

run 0 "" loft --help
cp out help
check "no line of the help is longer than 118" awk 'length > 118 { exit 1 }' help
for option in output unconstrained contours sections between picture report gap closed degree smooth significance knots tolerance \
  match degree-z degree-z-max smooth-z start-slope end-slope tension knot-tolerance zone margin rounds knot-rounds unit density view \
  up size title memory threads quiet; do
  check "the help tells --$option" grep -q -- " --$option" help
done
sed -n '/^example/,/^exit status/p' help | grep '^  ' >example.sh
mkdir bin && ln -s "$batten" bin/batten
PATH=$work/bin:$PATH bash -e example.sh >out 2>err
ok $? "the example of loft --help runs when pasted: $(cat err)"
check "without a warning" test ! -s err
check "its STEP file is one" grep -q '^ISO-10303-21;' vase.step
check "and its picture" test -s vase.png
check "the summary tells the proof" grep -q "proven to keep the contours' signs" out
is vase.json status ok
is vase.json certified True
is vase.json contours 7
is vase.json patches 6
is vase.json sign_violations 0
holds vase.json interpolation_error 'x <= 1e-12'
holds vase.json continuity_error 'x <= 1e-10'
# The vase's sections have the area pi (r^2 + 0.3^2 / 2), r = 3 + cos z / 2: what is between slices is the loft's.
holds vase.json volume 'x > 250 && x < 420'
for key in $(sed -n -e '/^## Common/,/^## batten solid/s/^| \(`[^|]*`\) |.*/\1/p' \
  -e '/^## batten loft/,/^## batten network/s/^| \(`[^|]*`\) |.*/\1/p' "$root/docs/report.md" | tr -d '`'); do
  echo "$key"
done | sort >documented
python3 -c 'import json; print("\n".join(sorted(json.load(open("vase.json")))))' >reported
check "the report has the documented keys and no others: $(diff documented reported | tr '\n' ' ')" cmp documented reported

# ---- wrong usage --------------------------------------------------------------------------------

ls -A >before
run 2 "no file of contours" loft
run 2 "unknown option '--closd'; did you mean '--closed'?" loft vase.txt --closd
run 2 "--degree-z: '10'" loft vase.txt --degree-z 10
run 2 "--smooth-z: '3'" loft vase.txt --smooth-z 3
run 2 "--match: 'ends' is not one of all, none, orient, align, features" loft vase.txt --match orient,ends
run 2 "--gap: '0'" loft vase.txt --gap 0
run 2 "--start-slope: '1' is not 2 numbers" loft vase.txt --start-slope 1
run 2 "x.svg: unknown extension for -o" loft vase.txt -o x.svg
run 2 "x.ply: unknown extension for --contours" loft vase.txt --contours x.ply
run 2 "./x.ply: is named as output twice" loft vase.txt -o x.ply -o ./x.ply
run 1 "none.txt" loft none.txt -o x.json
awk 'BEGIN { for (i = 0; i < 9; i++) print i, i * i }' >plane.txt
run 1 "plane.txt: contours: 1 in the file; a loft goes through two or more" loft plane.txt
{ cat plane.txt; echo; cat plane.txt; } >two.txt
run 1 "two.txt: contours: the file tells no heights; give points x y z, or --gap" loft two.txt
awk 'BEGIN { for (k = 0; k < 3; k++) { for (i = 0; i < 9; i++) print i, i * i, k % 2; print "" } }' >same.txt
run 1 "same.txt: contours: 0 and 2 lie in one plane, at the height 0; a loft goes through one contour in each plane" loft same.txt
run 1 "batten: --degree-z-max: 4; must be 5 .. 9" loft vase.txt --closed --degree-z 4 --degree-z-max 4 --smooth-z 2
run 1 "vase.txt: contours: the file tells their heights; leave --gap away" loft vase.txt --closed --gap 1
printf '0 0 0\n1 1 0\n\n0 0 1\n1 1 1\n' >short.txt
run 1 "short.txt: contours: 0 in the file with 3 points or more; a loft goes through two or more" loft short.txt
awk 'BEGIN { for (k = 0; k < 3; k++) { for (i = 0; i < 9; i++) print i, k == 1 ? 0 : i * i, 8 - k; print "" } }' >line.txt
run 1 "line.txt: slice 1, at the height 7: points: all 9 are one point or lie on a line" loft line.txt
awk 'BEGIN { for (k = 0; k < 3; k++) { for (i = 0; i < 9; i++) print i, i * i + (k == 1 ? i : 0), k + (k == 1 ? i : 0);
  print "" } }' >turned.txt
run 1 "turned.txt: contours[1]: turned by" loft turned.txt
rm -f plane.txt two.txt same.txt short.txt line.txt turned.txt
nothing_new "after all failures"

# ---- files --------------------------------------------------------------------------------------

run 0 "" loft vase.txt --closed --quiet -o vase.iges -o vase.ply -o surface.json --contours contours.json --sections sections.csv \
  --between 2 --unconstrained free.json --report again.json
is again.json volume "$(figure vase.json volume)"
check "the surface reads back, with its sections as contours" "$batten" inspect surface.json
check "it is of the degrees that the report tells" python3 -c '
import json
s, r = json.load(open("surface.json")), json.load(open("again.json"))
assert s["degree"] == [r["degree_t"], r["degree_z"]], s["degree"]'
check "19 sections are written" python3 -c '
rows = [l.split(",") for l in open("sections.csv")][1:]
assert len({r[0] for r in rows}) == 19
z = sorted({float(r[4]) for r in rows})
assert len(z) == 19 and z[0] == 0 and z[-1] == 12, z'
run 1 "surface.json: contours: there are none in the file; give curves" loft surface.json
run 1 "batten: --degree-z: 9; must be 3 .. 5 (2 --smooth-z + 1 .. --degree-z-max)" loft contours.json --degree-z 9 --degree-z-max 5
run 0 "" loft contours.json --quiet -o back.json --report back.report.json
check "the contours give the same surface again" cmp surface.json back.json
is back.report.json points None
is back.report.json certified True
python3 - <<'END'
import json
d = json.load(open("contours.json"))
c = d["curves"][1]
c["knots"] = [2 * k for k in c["knots"]]
json.dump(d, open("longer.json", "w"))
c["knots"] = [1 - k / 2 for k in c["knots"][::-1]]
c["control_points"].reverse()
json.dump(d, open("against.json", "w"))
END
run 1 "longer.json: contours[1]: from t = 0 to 2, but contours[0] from 0 to 1; scale its knots in the file" loft longer.json
run 1 "clockwise and the other counter-clockwise; reverse its knots and control points in the file" loft against.json
run 1 "contours.json: contours: the file has curves; --closed, --degree" loft contours.json --closed
check "the mesh is a tube" python3 -c '
import subprocess, sys, json
subprocess.run([sys.argv[1], "inspect", "vase.ply", "--quiet", "--report", "mesh.json"], check=True)
m = json.load(open("mesh.json"))
assert m["mesh_triangles"] > 1000, m' "$batten"

# ---- options ------------------------------------------------------------------------------------

for smooth in 1 2; do
  for degree in 2 3 4 5; do
    [ $degree -gt $smooth ] || continue
    run 0 "" loft vase.txt --closed --quiet --degree $degree --smooth $smooth --report d.json
    is d.json certified True
    is d.json smoothness $smooth
    is d.json degree_t $degree
  done
done
run 0 "" loft vase.txt --closed --quiet --start-slope 0,0 --end-slope 0,0 -o slope.json
check "the surface begins and ends upright" python3 -c '
import json
s = json.load(open("slope.json"))
p = s["control_points"]
for row in p:
  assert max(abs(row[0][k] - row[1][k]) for k in (0, 1)) < 1e-12, row[:2]
  assert max(abs(row[-1][k] - row[-2][k]) for k in (0, 1)) < 1e-12, row[-2:]'
# The same slices, unlike: other order, other starting points, every second one reversed.
python3 - <<'END'
blocks = [b.split("\n") for b in open("vase.txt").read().strip().split("\n\n")]
out = []
for k, b in enumerate(blocks):
  b = b[7 * k:] + b[:7 * k]
  if k % 2: b = b[::-1]
  out.append("\n".join(b))
open("shuffled.txt", "w").write("\n\n".join(out[::2] + out[1::2]) + "\n")
END
run 0 "" loft shuffled.txt --closed --quiet --report shuffled.json
is shuffled.json certified True
is shuffled.json slices_reversed 3
check "and have the same volume to 0.1 %" python3 -c '
import json
a, b = (json.load(open(f))["volume"] for f in ("vase.json", "shuffled.json"))
assert abs(a - b) < 1e-3 * a, (a, b)'

# A table of offsets whose last station has two points.
awk 'BEGIN { print "station,waterline,half_breadth"; for (k = 0; k < 4; k++) for (i = 0; i <= 8; i++)
  if (k < 3 || i > 6) print 2 * k "," i / 2 "," (4 - k) * sqrt(i / 8) }' >offsets.csv
run 0 "offsets.csv: contours: 1 of fewer than 3 points left out, the first at the height 6; the surface does without them" \
  loft offsets.csv --quiet --report offsets.json -o offsets.step
is offsets.json status shape
is offsets.json slices_left_out 1
is offsets.json contours 3
is offsets.json certified True

echo "1..$count"
exit $bad
