#!/bin/bash
# batten stack from outside: texts, exit codes, files, figures. Prints TAP.
#   test_stack.sh PROGRAM SOURCE_ROOT
set -u
. "${0%/*}/functions.sh"

# ---- texts --------------------------------------------------------------------------------------

run 0 "" stack --help
cp out help
check "no line of the help is longer than 118" awk 'length > 118 { exit 1 }' help
for option in output picture report save gap points method tolerance pair-distance min-area apex between shape scales saturation ends \
  end-height rotation path parameter route link draughts cell sharp box color dots view up size title memory threads quiet; do
  check "the help tells --$option" grep -q -- " --$option" help
done
sed -n '/^example/,/^exit status/p' help | grep '^  ' >example.sh
mkdir bin && ln -s "$batten" bin/batten
PATH=$work/bin:$PATH bash -e example.sh >out 2>err
ok $? "the example of stack --help runs when pasted: $(cat err)"
check "without a warning" test ! -s err
check "and its picture" test -s trunk.png
check "the summary tells the certificate" grep -q "sign certified on 7 sections" out
is trunk.json status ok
is trunk.json sections 7
is trunk.json contours 11
is trunk.json holes 0
is trunk.json sections_certified 7
is trunk.json pieces 1
is trunk.json non_overlaps 0
is trunk.json mesh_components 1
holds trunk.json crease_vertices 'x > 20'
is trunk.json mesh_genus 0
is trunk.json mesh_closed True
is trunk.json mesh_manifold True
is trunk.json mesh_self_intersections 0
is trunk.json route sections
# Sum of slices: discs of radius 10, 9, 8 and four pairs of radius 5, 5 apart; polygons of 40 sides are 0.4 % smaller.
holds trunk.json volume 'x > 0.97 * 5 * 3.14159 * (245 + 200) && x < 1.03 * 5 * 3.14159 * (245 + 200)'
for key in $(sed -n -e '/^## Common/,/^## batten solid/s/^| \(`[^|]*`\) |.*/\1/p' \
  -e '/^## batten stack/,/^## batten frep/s/^| \(`[^|]*`\) |.*/\1/p' \
  -e '/^## Surfaces of solids/,/^## batten inspect/s/^| \(`[^|]*`\) |.*/\1/p' "$root/docs/report.md" | tr -d '`'); do
  echo "$key"
done | sort >documented
python3 -c 'import json; print("\n".join(sorted(json.load(open("trunk.json")))))' >reported
check "the report has the documented keys and no others: $(diff documented reported | tr '\n' ' ')" cmp documented reported

# ---- wrong usage and bad input ------------------------------------------------------------------

ls -A >before
run 2 "no file of contours" stack
run 2 "unknown option '--linc'; did you mean '--link'?" stack trunk.txt --linc
run 2 "--between: 'cubik' is not one of natural, not-a-knot, monotone, linear, rational" stack trunk.txt --between cubik
run 2 "--ends: 'round' is not one of flat, plane, rounded, open" stack trunk.txt --ends flat,round
run 2 "--end-height: 0; give gaps above 0, or --ends plane" stack trunk.txt --end-height 0
run 2 "--shape: '-1'" stack trunk.txt --shape -1
run 2 "--pair-distance: '2'" stack trunk.txt --pair-distance 2
run 2 "--scales: 2 numbers for 7 sections; give one for each" stack trunk.txt --scales 1,2
run 2 "--box: '1,2' is not the 6 numbers of two corners" stack trunk.txt --box 1,2
run 2 "x.step: unknown extension for -o" stack trunk.txt -o x.step
run 2 "./x.ply: is named as output twice" stack trunk.txt -o x.ply -o ./x.ply
run 1 "none.txt" stack none.txt -o x.ply
polygon() { # polygon X Y Z R N: a contour
  awk -v x="$1" -v y="$2" -v z="$3" -v r="$4" -v n="$5" \
    'BEGIN { for (i = 0; i < n; i++) print x + r * cos(6.2831853 * i / n), y + r * sin(6.2831853 * i / n), z; print "" }'
}
{ polygon 0 0 0 5 20; printf '0 0 1\n1 0 1\n\n'; polygon 0 0 2 5 20; } >two.txt
run 1 "two.txt: " stack two.txt
{ polygon 0 0 0 5 20; polygon 4 0 0 5 20; polygon 0 0 1 5 20; } >cross.txt
run 1 "cross.txt: sections[0]" stack cross.txt
grep -q "cross" err
ok $? "and says that contours cross: $(cat err)"
{ polygon 0 0 0 5 20; printf '0 0 1\n5 5 1\n5 0 1\n0 5 1\n\n'; } >self.txt
run 1 "self.txt: sections[1]" stack self.txt
{ polygon 0 0 0 5 20; polygon 0 0 1 5 20 | sed 11,20d; } >open.txt
run 1 "open.txt: " stack open.txt
grep -q "closed" err
ok $? "and says that it is not closed: $(cat err)"
polygon 0 0 0 5 20 >single.txt
run 1 "batten: --gap: 0; one section needs the distance that it stands for" stack single.txt
sections() { # sections ROTATION of the second section
  python3 - "$1" <<'END'
import json, math, sys
ring = [[math.cos(2 * math.pi * i / 24), math.sin(2 * math.pi * i / 24)] for i in range(24)]
s = [{"origin": [0, 0, 0], "contours": [ring]}, {"origin": [0, 0, 2], "rotation": json.loads(sys.argv[1]), "contours": [ring]}]
json.dump({"batten": "sections", "version": 1, "sections": s}, sys.stdout)
END
}
sections '[[1, 0, 0], [0, 2, 0], [0, 0, 1]]' >scaled.json
run 1 "scaled.json: " stack scaled.json
grep -q "rotation" err
ok $? "and names the rotation: $(cat err)"
sections '[[1, 0, 0], [0, 1, 0], [0, 0, -1]]' >mirrored.json
run 1 "mirrored.json: " stack mirrored.json
sections '[[1, 0, 0], [0, 1, 0], [0, 0, 1]]' | sed 's/\[0, 0, 2\]/[0, 0, 0]/' >same.json
run 1 "same.json: " stack same.json
run 1 "batten: --scales: 0; must be finite and above 0" stack trunk.txt --between rational --scales 0,1,1,1,1,1,1
rm -f two.txt cross.txt self.txt open.txt scaled.json mirrored.json same.json single.txt
nothing_new "after all failures"

# ---- files --------------------------------------------------------------------------------------

run 0 "" stack trunk.txt --quiet --save trunk_solid.json -o trunk.stl --report again.json
is again.json volume "$(figure trunk.json volume)"
check "the solid is told by inspect" "$batten" inspect trunk_solid.json
printf '{"batten": "frep", "version": 1, "root": {"node": "solid", "file": "trunk_solid.json"}}' >leaf.json
run 0 "" frep leaf.json --quiet --cell "$(figure trunk.json cell)" --report leaf_report.json
holds leaf_report.json volume "x / $(figure trunk.json volume) > 0.999 && x / $(figure trunk.json volume) < 1.001"
is leaf_report.json mesh_genus 0
polygon 0 0 0 5 40 >single.txt
run 0 "" stack single.txt --gap 4 --quiet --report disc.json
holds disc.json volume 'x > 0.985 * 4 * 78.54 && x < 1.015 * 4 * 78.54'

# Half a gap beyond the points is more than a quarter of their box.
{ polygon 0 0 0 1 40; polygon 0 0 4 1 40; } >far_ends.txt
run 0 "" stack far_ends.txt --quiet --report far_ends.json
is far_ends.json status ok
holds far_ends.json volume 'x > 0.985 * 8 * 3.14159 && x < 1.015 * 8 * 3.14159'

# ---- options ------------------------------------------------------------------------------------

for between in natural not-a-knot monotone linear rational; do
  run 0 "" stack trunk.txt --between $between --quiet --report b.json
  is b.json mesh_components 1
  is b.json mesh_genus 0
  is b.json mesh_closed True
done
run 0 "" stack trunk.txt --ends plane --quiet --report plane.json
holds plane.json box_z_min 'x == 0'
run 0 "" stack trunk.txt --ends rounded --quiet --report rounded.json
holds rounded.json volume "x > $(figure plane.json volume) && x < 1.08 * $(figure trunk.json volume)"
run 0 "surface reaches its box" stack trunk.txt --ends open --quiet --report opened.json
is opened.json mesh_boundary_loops 3
is opened.json status clipped
run 0 "" stack trunk.txt --scales 1,1,1,2,1,1,1 --quiet --report scaled.json
run 0 "" stack trunk.txt --draughts 0,15,100 --quiet --report draughts.json
check "the volume below heights goes from half a disc to all" python3 -c '
import json
r = json.load(open("draughts.json"))
d = r["displacements"]
assert d[0] < d[1] < d[2] and abs(d[2] / r["volume"] - 1) < 1e-9, d
assert abs(d[0] / (2.5 * 3.14159 * 100) - 1) < 0.02, d'

# ---- pieces that do not overlap -------------------------------------------------------------------

{ polygon 0 0 0 3 30; polygon 1 0 2 3 30; polygon 9 0 4 3 30; polygon 10 0 6 3 30; } >apart.txt
run 0 "" stack apart.txt --quiet --report apart.json
is apart.json pieces 2
is apart.json non_overlaps 2
is apart.json mesh_components 2
check "the notes name both sections" python3 -c '
import json
n = [x for x in json.load(open("apart.json"))["notes"] if x["what"] == "no overlap"]
assert [(x["section"], x["above"]) for x in n] == [(1, True), (2, False)], n'
run 0 "" stack apart.txt --link --quiet --report linked.json
is linked.json pieces 1
is linked.json links 1
is linked.json mesh_components 1
is linked.json mesh_closed True

# ---- through-holes --------------------------------------------------------------------------------

for z in 0 2 4; do polygon 0 0 $z 6 60; polygon 0 0 $z 3 40; done >tube.txt
run 0 "" stack tube.txt --quiet --report tube.json
is tube.json holes 3
is tube.json mesh_genus 1
is tube.json mesh_components 1

echo "1..$count"
exit $bad
