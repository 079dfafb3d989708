#!/bin/sh
# batten inspect of planar curves.
#   test_curves.sh PROGRAM SOURCE_ROOT
. "$(dirname "$0")/functions.sh"

# The parabola y = x^2 / 2 over [0, 2]: curvature (1 + x^2)^(-3/2), length sqrt(5) + asinh(2) / 2, turn atan(2).
cat >parabola.json <<EOF
{"batten": "curve", "version": 1, "degree": 2, "periodic": false,
"knots": [0, 0, 0, 1, 1, 1], "control_points": [[0, 0], [1, 0], [2, 2]]}
EOF
run 0 "" inspect parabola.json --report r.json
is r.json kind curves
is r.json dimension 2
is r.json planes False
is r.json curves 1
is r.json curves_closed 0
is r.json degree 2
is r.json spans 1
is r.json control_points 3
holds r.json length '(x - 2.957885715089195)^2 < 1e-20'
holds r.json curvature_max '(x - 1)^2 < 1e-20'
holds r.json curvature_max_at 'x == 0'
holds r.json curvature_min '(x - 0.0894427190999916)^2 < 1e-20'
holds r.json curvature_min_at 'x == 1'
holds r.json turn '(x - 63.43494882292201)^2 < 1e-16'
holds r.json box_y_max 'x == 2'
is r.json area 0.0
is r.json inflections 0
check "the form is printed" grep -q '^curve .*open, degree 2, 3 control points, 1 span$' out
check "so are the ends of curvature" grep -q '^curvature .*0.08944 at t = 1 .. 1 at t = 0' out
check "and the turn" grep -q '^turn .*63.4349 degrees' out

# A rectangle that runs to the left, and an S with its inflection in the middle.
cat >two.json <<EOF
{"batten": "contours", "version": 1, "curves": [
{"degree": 1, "periodic": true, "knots": [0, 0, 1, 2, 3, 4, 4],
"control_points": [[0, 0], [2, 0], [2, 3], [0, 3], [0, 0]], "z": 1},
{"degree": 3, "periodic": false, "knots": [0, 0, 0, 0, 1, 1, 1, 1],
"control_points": [[0, 0], [1, 0], [0, 1], [1, 1]], "z": 2}]}
EOF
run 0 "" inspect two.json --report r.json
is r.json planes True
is r.json curves 2
is r.json curves_closed 1
is r.json degree None
is r.json spans 5
is r.json turn None
is r.json area 6.0
is r.json inflections 1
is r.json curve_inflections '[0, 1]'
is r.json curve_area '[6.0, 0.0]'
is r.json curvature_min_curve 1
is r.json curvature_max_curve 1
lengths='import json; r = json.load(open("r.json"))
assert abs(sum(r["curve_length"]) - r["length"]) < 1e-12 and r["curve_length"][0] == 10'
check "lengths add up" python3 -c "$lengths"
turns='import json
assert abs(json.load(open("r.json"))["curve_turn"][0] - 360) < 1e-10'
check "the rectangle turns once" python3 -c "$turns"
check "all are printed" grep -q '^curves .*2, 1 of them closed, degrees 1 to 3, 9 control points, 5 spans' out
check "each is printed" grep -q '^curve 1 .*, 1 inflection$' out

# Every key that is reported is described.
sed -n '/^### Curves/,/^## /p' "$root/docs/report.md" >described
undescribed=
for key in $(python3 -c 'import json; print("\n".join(json.load(open("r.json"))))' | sed -n '/^kind$/,$p'); do
  case $key in kind | dimension | time_total_s | peak_bytes) continue ;; esac
  grep -q "\`$key\`" described || undescribed="$undescribed $key"
done
check "all keys are described: $undescribed" test -z "$undescribed"

sed 's/\[2, 2\]/[2]/' parabola.json >broken.json
run 1 "broken.json: curve.control_points[2]: 1 numbers, where 2 are expected" inspect broken.json
sed 's/1, 1, 1\], "control/1, 1, 2], "control/' parabola.json >broken.json
run 1 "broken.json: curve: knots" inspect broken.json

# Contours are points that are parted.
printf 'contour 2\n1 2 3\n4 5 3\ncontour 1\n7 8 9\n' >stack.txt
run 0 "" inspect stack.txt --report r.json
is r.json points 3
is r.json contours 2
check "their number is printed" grep -q '^contours .*2, each in a plane' out
printf '1 2 3\n4 5 7\n' >cloud.xyz
run 0 "" inspect cloud.xyz --report r.json
is r.json contours None

echo "1..$count"
exit $bad
