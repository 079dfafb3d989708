#!/bin/sh
# batten inspect of surfaces, and of points with parameters and weights.
#   test_surface.sh PROGRAM SOURCE_ROOT
. "$(dirname "$0")/functions.sh"

# z = x^2 / 2 + y^2 / 4 over [0, 2] x [0, 2], in two spans of u: K = 0.5 / (1 + x^2 + y^2 / 4)^2, 0.5 at (0, 0) and
# 0.5 / 36 at (2, 2).
surface() { # surface SIGN
  cat <<EOF
{"batten": "surface", "version": 1,
"degree": [2, 2],
"knots": [[0, 0, 0, 0.5, 1, 1, 1], [-1, -1, -1, 1, 1, 1]],
"control_points": [
[[0, 0, 0], [0, 1, 0], [0, 2, ${1}1]],
[[0.5, 0, 0], [0.5, 1, 0], [0.5, 2, ${1}1]],
[[1.5, 0, 1], [1.5, 1, 1], [1.5, 2, $2]],
[[2, 0, 2], [2, 1, 2], [2, 2, $3]]]}
EOF
}
surface "" 2 3 >cup.json
run 0 "" inspect cup.json --report r.json
is r.json kind surface
is r.json degree_u 2
is r.json spans_u 2
is r.json spans_v 1
is r.json control_points 12
is r.json certified True
is r.json sign 1
is r.json graph True
holds r.json K_max '(x - 0.5)^2 < 1e-18'
holds r.json K_min '(x - 0.5 / 36)^2 < 1e-18'
holds r.json margin_min 'x > 0.9 * 0.5 / 36 && x < 0.5 / 36 * (1 + 1e-9)'
holds r.json box_z_max '(x - 3)^2 < 1e-16'
holds r.json area '(x - 6.36082899656)^2 < 1e-16'
check "what is printed: $(tr '\n' ';' <out)" grep -q '^convexity .*proven' out
check "the degree is printed" grep -q '^surface .*degree 2 x 2, 4 x 3 control points, 2 x 1 spans' out

# Its sections v = const are the plane parabolas z = x^2 / 2 + const, in two spans.
is r.json section_pairs 2
is r.json section_violations 0
is r.json sections_certified True
check "they are printed" grep -q '^sections .*proven to bend as the end sections in all 2 span pairs' out
# Where the middle one of three rows bends the other way, they do not, and where rows are no planes there are none.
sed 's/\[0.5, 1, 0\]/[0.5, 1, 4]/; s/\[1.5, 1, 1\]/[1.5, 1, 4]/' cup.json >bent.json
run 0 "" inspect bent.json --report bent.r
is bent.r sections_certified False
holds bent.r section_violations 'x >= 1'
sed 's/\[0.5, 1, 0\]/[0.5, 1.2, 0]/' cup.json >wavy.json
run 0 "" inspect wavy.json --report wavy.r
is wavy.r section_pairs None
is wavy.r sections_certified None

# The same with -y^2 / 4 is a saddle.
surface - 0 1 >saddle.json
run 0 "" inspect saddle.json --report r.json
is r.json certified False
holds r.json K_min '(x + 0.5)^2 < 1e-18'
check "a saddle is told to be none" grep -q '^convexity .*not proven' out

# Every key that is reported is described, here or in the table of `batten convex`, to which this points.
{
  sed -n '/^## batten inspect/,/^## batten convex/p' "$root/docs/report.md" | sed -n '/^- surface/,/^- solid/p'
  sed -n '/^## batten convex/,/^## batten curve/p' "$root/docs/report.md" | sed -n '/`certified`/,/`box_x_min`/p'
} >described
undescribed=
for key in $(python3 -c 'import json; print("\n".join(json.load(open("r.json"))))' | sed -n '/^kind$/,$p'); do
  case $key in kind | box_* | centroid_*) continue ;; esac
  grep -q "\`$key\`" described || undescribed="$undescribed $key"
done
check "all keys are described: $undescribed" test -z "$undescribed"

sed 's/0.5, 1, 0/0.5, 1/' cup.json >broken.json
run 1 "broken.json: surface.control_points[1][1]: 2 numbers, where 3 are expected" inspect broken.json

printf 'u v x y z w\n0 0 1 2 3 1\n1 0 4 5 6 2\n' >p.txt
run 0 "" inspect p.txt --report r.json
is r.json parameters True
is r.json weights True
is r.json normals False
check "they are printed" grep -q '^points .*2, in space, with parameters, with weights' out

echo "1..$count"
exit $bad
