#!/bin/bash
# batten frep from outside: texts, exit codes, files, figures. Prints TAP.
#   test_frep.sh PROGRAM SOURCE_ROOT
set -u
. "${0%/*}/functions.sh"

# ---- texts --------------------------------------------------------------------------------------

run 0 "" frep --help
cp out help
check "no line of the help is longer than 118" awk 'length > 118 { exit 1 }' help
for option in output picture report save cell sharp box color dots view up size title memory threads quiet; do
  check "the help tells --$option" grep -q -- " --$option" help
done
sed -n '/^example/,/^exit status/p' help | sed -n 's/^  //p' >example.sh
mkdir bin && ln -s "$batten" bin/batten
PATH=$work/bin:$PATH bash -e example.sh >out 2>err
ok $? "the example of frep --help runs when pasted: $(cat err)"
check "without a warning" test ! -s err
check "and its picture" test -s scene.png
is scene_report.json status ok
is scene_report.json nodes 6
is scene_report.json mesh_components 1
is scene_report.json mesh_closed True
is scene_report.json mesh_manifold True
is scene_report.json mesh_self_intersections 0
for key in $(sed -n -e '/^## Common/,/^## batten solid/s/^| \(`[^|]*`\) |.*/\1/p' \
  -e '/^## batten frep/,/^## batten inspect/s/^| \(`[^|]*`\) |.*/\1/p' "$root/docs/report.md" | tr -d '`'); do
  echo "$key"
done | sort >documented
python3 -c 'import json; print("\n".join(sorted(json.load(open("scene_report.json")))))' >reported
check "the report has the documented keys and no others: $(diff documented reported | tr '\n' ' ')" cmp documented reported

# ---- wrong usage and bad scenes -------------------------------------------------------------------

scene() { printf '{"batten": "frep", "version": 1, %s}' "$1"; }
ball='{"node": "ball", "center": [0, 0, 0], "radius": 1}'
ls -A >before
run 2 "no scene" frep
run 2 "unknown option '--cells'; did you mean '--cell'?" frep scene.json --cells 1
run 2 "x.step: unknown extension for -o" frep scene.json -o x.step
run 2 "--box: '1,2' is not the 6 numbers of two corners" frep scene.json --box 1,2
run 2 "--sharp: 5; give 15 to 170 degrees, or 0" frep scene.json --sharp 5
run 1 "none.json" frep none.json
scene '"nodes": {"a": {"node": "negation", "a": "b"}, "b": {"node": "negation", "a": "a"}}, "root": "a"' >cycle.json
run 1 "cycle.json: " frep cycle.json
grep -q "cycle" err
ok $? "and says that it is one: $(cat err)"
scene "\"nodes\": {\"body\": $ball}, \"root\": \"bodi\"" >unknown.json
run 1 "unknown.json: root" frep unknown.json
grep -q "bodi" err
ok $? "and names it: $(cat err)"
scene '"root": {"node": "boll", "center": [0, 0, 0], "radius": 1}' >kind.json
run 1 "kind.json: root" frep kind.json
scene '"root": {"node": "ball", "center": [0, 0, 0], "radius": -1}' >radius.json
run 1 "radius.json: root" frep radius.json
scene '"root": {"node": "ball", "center": [0, 0, 0]}' >missing.json
run 1 "radius" frep missing.json
scene "\"root\": {\"node\": \"union\", \"alpha\": 2, \"a\": $ball, \"b\": $ball}" >alpha.json
run 1 "alpha.json: root" frep alpha.json
scene '"root": {"node": "solid", "file": "nowhere.json"}' >file.json
run 1 "nowhere.json" frep file.json
scene "\"root\": {\"node\": \"negation\", \"a\": $ball}" >unbounded.json
run 1 "unbounded.json: " frep unbounded.json
grep -q -- "--box" err
ok $? "and says what to give: $(cat err)"
grep -q "a: the solid" err
ok $((!$?)) "and does not name an argument of the library's"
scene "\"root\": {\"node\": \"offset\", \"distance\": -2, \"a\": $ball}" >empty.json
run 1 "empty.json: " frep empty.json
rm -f cycle.json unknown.json kind.json radius.json missing.json alpha.json file.json unbounded.json empty.json
nothing_new "after all failures"

# ---- figures ------------------------------------------------------------------------------------

near() { # near FILE KEY VALUE PART
  holds "$1" "$2" "x > $3 * (1 - $4) && x < $3 * (1 + $4)"
}
scene '"root": {"node": "box", "center": [0, 0, 0], "half_extents": [1, 1, 0.5]}' >box.json
run 0 "" frep box.json --cell 0.1 --quiet --report r.json
near r.json volume 4 1e-9
near r.json area 16 1e-9
holds r.json crease_vertices 'x > 150'
run 0 "" frep box.json --cell 0.1 --sharp 0 --quiet --report r.json
is r.json crease_vertices 0
holds r.json volume 'x < 3.99'
scene "\"root\": {\"node\": \"offset\", \"distance\": 0.5, \"a\": $ball}" >offset.json
run 0 "" frep offset.json --quiet --report r.json
near r.json volume 14.13717 0.002
scene "\"root\": {\"node\": \"shell\", \"thickness\": 0.2, \"a\": $ball}" >shell.json
run 0 "" frep shell.json --quiet --report r.json
near r.json volume 2.521651 0.01
is r.json mesh_components 2
scene "\"root\": {\"node\": \"negation\", \"a\": $ball}" >outside.json
run 0 "surface reaches its box" frep outside.json --box=-0.5,-1.5,-1.5,1.5,1.5,1.5 --quiet --report r.json
scene '"root": {"node": "sweep", "smooth": false, "closed": false, "path": [[0, 0, 0], [4, 0, 0]],
  "a": {"node": "ball", "center": [0, 0, 0], "radius": 1}}' >capsule.json
run 0 "" frep capsule.json --quiet --report r.json
near r.json volume 16.75516 0.004
scene '"root": {"node": "project", "axis": 2, "lower": -2, "upper": 2, "samples": 16,
  "a": {"node": "torus", "center": [0, 0, 0], "axis": [0, 0, 1], "major_radius": 2, "minor_radius": 0.5}}' >shadow.json
run 0 "" frep shadow.json --quiet -o shadow.svg --picture shadow.png --report r.json
is r.json dimension 2
is r.json outline_loops 2
near r.json area 12.56637 0.002
run 0 "" frep scene.json --quiet --save saved.json -o scene.stl
scene '"root": {"node": "solid", "file": "saved.json"}' >leaf.json
run 0 "" frep leaf.json --quiet --cell "$(figure scene_report.json cell)" --report r.json
near r.json volume "$(figure scene_report.json volume)" 0.001
check "the saved solid is told by inspect" "$batten" inspect saved.json

echo "1..$count"
exit $bad
