#!/bin/bash
# batten network from outside: texts, exit codes, files, figures. Prints TAP.
#   test_network.sh PROGRAM SOURCE_ROOT
set -u
. "${0%/*}/functions.sh"

# ---- texts --------------------------------------------------------------------------------------

run 0 "" network --help
cp out help
check "no line of the help is longer than 118" awk 'length > 118 { exit 1 }' help
for option in output picture report continuity fill normals normal-passes direction length functional weight-power field-weight \
  solver fair-passes creases crease-edges corner boundary-curves lines repair weld smooth faces step-form unit density \
  tolerance color range no-edges view up size title memory threads quiet; do
  check "the help tells --$option" grep -q -- " --$option" help
done
sed -n '/^example/,/^exit status/p' help | grep '^  ' >example.sh
mkdir bin && ln -s "$batten" bin/batten
PATH=$work/bin:$PATH bash -e example.sh >out 2>err
ok $? "the example of network --help runs when pasted: $(cat err)"
check "its STEP file is one" grep -q '^ISO-10303-21;' ball.step
check "and its picture" test -s ball.png
# The ball through an octahedron, by the fair fill: within 1 % of curvature 1 everywhere.
is ball.json status ok
is ball.json fill fair
holds ball.json K_min 'x > 0.99 && x <= 1'
holds ball.json K_max 'x < 1.01 && x >= 1'
holds ball.json normal_jump_max_deg 'x >= 0 && x < 1e-9'
holds ball.json volume 'x > 4.17 && x < 4.20'
holds ball.json K_integral 'x > 12.566 && x < 12.567'
check "the summary tells the joints" grep -Eq '^joints +normals differ by' out

# ---- wrong usage and bad meshes -----------------------------------------------------------------

ls -A >before
run 2 "no mesh" network
run 2 "unknown option '--contnuity'; did you mean '--continuity'?" network octahedron.obj --contnuity G1
run 2 "--fill: 'fare' is not one of" network octahedron.obj --fill fare
run 2 "--weight-power: '7'" network octahedron.obj --weight-power 7
run 2 "--range: '2,1': the first must be below the second" network octahedron.obj --range 2,1
run 2 "x.txt: unknown extension for -o; use .step .iges .json .vtu" network octahedron.obj -o x.txt
run 2 "x.svg: unknown extension for --picture; use .png" network octahedron.obj --picture x.svg
run 2 "./x.step: is named as output twice" network octahedron.obj -o x.step -o ./x.step
run 2 "not with --repair" network octahedron.obj --repair --lines l.txt
run 1 "none.off" network none.off -o x.step
run 1 "batten: --continuity: 2, but this fill is made for a G1 network; leave it away, or take another --fill" network octahedron.obj --fill ss --continuity G2 -o x.step
run 1 "none of its triangles is left by the repair" network octahedron.obj --weld 100
sed 's/^f 1 2 5/f 2 1 5/' octahedron.obj >turned.obj
run 1 "turned.obj: " network turned.obj -o x.step
check "which names the remedy of the program: $(cat err)" grep -q -- --repair err
printf 'OFF\n5 3 0\n0 0 0\n1 0 0\n0 1 0\n0 -1 0\n0 0 1\n3 0 1 2\n3 1 0 3\n3 0 1 4\n' >fin.off
run 1 "edge" network fin.off -o x.step
printf '0 9\n' >far.txt
run 1 "--crease-edges[0]: vertices 0 and 9; give the ends of an edge" network octahedron.obj --crease-edges far.txt -o x.step
run 1 "--lines[1]: no edge from vertex 0 to vertex 9" network octahedron.obj --lines far.txt -o x.step
printf '0 1\nx 2\n' >word.txt
run 1 "word.txt:2: 'x' is not the number of a vertex" network octahedron.obj --crease-edges word.txt
printf '3\n' >alone.txt
run 1 "alone.txt:1: one vertex alone" network octahedron.obj --lines alone.txt
rm -f turned.obj fin.off far.txt word.txt alone.txt
nothing_new "after all failures"

# ---- mending ------------------------------------------------------------------------------------

sed 's/^f 1 2 5/f 2 1 5/' octahedron.obj >turned.obj
run 0 "" network turned.obj --repair --quiet -o turned.json --report t.json
holds t.json turned_triangles 'x == 1'
holds t.json volume "x > $(figure ball.json volume) - 1e-12 && x < $(figure ball.json volume) + 1e-12"

# ---- every fill, every format -------------------------------------------------------------------

for fill in fair fair-linear ss ss-classic degree7 degree6; do
  run 0 "" network octahedron.obj --fill $fill --quiet -o $fill.json -o $fill.step --report r.json
  is r.json fill $fill
  is r.json status ok
  run 0 "" inspect $fill.json --report i.json
  for key in K_min K_max normal_jump_max_deg volume area; do is i.json $key "$(figure r.json $key)"; done
done
for fill in peters pn; do
  "$batten" network octahedron.obj --fill $fill --quiet -o $fill.json --report r.json >out 2>err
  ok $? "$fill is done: $(cat err)"
  is r.json fill $fill
done
is r.json status accuracy
check "what is not G1 says so: $(cat err)" grep -q "normals differ by up to" err
run 0 "" network octahedron.obj --quiet -o a.step -o a.stp -o a.iges -o a.igs -o a.vtu -o a.ply -o a.obj -o a.stl -o a.off -o a.vtp
for format in step stp iges igs vtu ply obj stl off vtp; do check "a.$format is there" test -s a.$format; done
for form in trimmed quads degenerate; do
  run 0 "" network octahedron.obj --quiet --step-form $form --unit inch -o $form.step
done
run 0 "" inspect a.ply --report m.json
is m.json mesh_closed True
for color in gauss mean isophotes reflection none; do
  run 0 "" network octahedron.obj --quiet --color $color --size 200,150 --picture $color.png
done

# ---- creases and lines --------------------------------------------------------------------------

printf '0 1 2 3 0\n' >equator.txt
run 0 "" network octahedron.obj --quiet --crease-edges equator.txt --report c.json
holds c.json crease_edges 'x == 4'
holds c.json crease_jump_max_deg 'x > 1'
holds c.json normal_jump_max_deg 'x < 1e-9'
run 0 "" network octahedron.obj --quiet --lines equator.txt --report l.json
holds l.json line_edges 'x == 4'
holds l.json normal_jump_max_deg 'x < 1e-9'

# ---- report -------------------------------------------------------------------------------------

for key in $(sed -n -e '/^## Common/,/^## batten solid/s/^| \(`[^|]*`\) |.*/\1/p' \
  -e '/^## batten network/,/^## batten qp/s/^| \(`[^|]*`\) |.*/\1/p' "$root/docs/report.md" | tr -d '`'); do
  echo "$key"
done | sort >documented
python3 -c 'import json; print("\n".join(sorted(json.load(open("ball.json")))))' >reported
check "the report has the documented keys and no others: $(diff documented reported | tr '\n' ' ')" cmp documented reported

# The same bits for any number of threads.
run 0 "" network octahedron.obj --quiet --threads 1 -o one.json
run 0 "" network octahedron.obj --quiet --threads 4 -o four.json
check "one thread or four" cmp one.json four.json

echo "1..$count"
exit $bad
