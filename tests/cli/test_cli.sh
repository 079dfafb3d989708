#!/bin/bash
# The program batten from outside: texts, exit codes, files, Ctrl-C. Prints TAP.
#   test_cli.sh PROGRAM SOURCE_ROOT
set -u
. "${0%/*}/functions.sh"

# ---- texts --------------------------------------------------------------------------------------

run 0 "" --help
check "--help names the commands" grep -q '^  solid ' out
check "and the exit status" grep -q 'exit status: 0 done, 1 could not, 2 wrong usage' out
run 0 "" --version
check "--version tells version and BLAS" grep -Eq '^batten [0-9]+\.[0-9]+\.[0-9]+$' out
check "--version names the library that is loaded" grep -q '^BLAS: .' out
run 0 "" inspect --help
run 0 "" solid --help
sed -n '/^example/,/^exit status/p' out | grep '^  ' >example.sh
check "solid --help has an example of three lines" test "$(wc -l <example.sh)" -eq 3
mkdir bin && ln -s "$batten" bin/batten
PATH=$work/bin:$PATH bash -e example.sh >out 2>err
ok $? "the example of solid --help runs when pasted: $(cat err)"
for f in ball.ply ball.png ball.json; do check "and makes $f" test -s "$f"; done
check "the summary has the volume" grep -Eq '^volume +4\.1' out
"$batten" solid --help >help
check "no line of the help is longer than 118" awk 'length > 118 { exit 1 }' help
for option in output picture report save carrier order smoothing merge-radius orientation orient-data orient-method \
  method evaluate cell box memory loo threads quiet; do
  check "the help tells --$option" grep -q -- " --$option" help
done

# ---- wrong usage: status 2, one line ------------------------------------------------------------

ls -A >before
run 2 "no command"
run 2 "unknown command 'sold'; did you mean 'solid'?" sold x
run 2 "unknown option '--frob'" --frob
run 2 "no file of points" solid
run 2 "not also 'b.xyz'" solid a.xyz b.xyz
run 2 "unknown option '--pictrue'; did you mean '--picture'?" solid ball.xyz --pictrue p.png
run 2 "unknown option '--xyzzy'" solid ball.xyz --xyzzy
run 2 "unknown option '-z'" solid ball.xyz -z
run 2 "option '--orient' is ambiguous" solid ball.xyz --orient x
run 2 "--quiet: takes no value" solid ball.xyz --quiet=3
run 2 "--report: needs a value" solid ball.xyz --report
run 2 "--order: '5' is not a whole number from 1 to 4" solid ball.xyz --order 5
run 2 "--order: 1 is too low" solid ball.xyz --order 1
run 2 "--smoothing: '-1' is not a number of 0 or more" solid ball.xyz --smoothing -1
run 2 "--smoothing: 'nan'" solid ball.xyz --smoothing nan
run 2 "--merge-radius: '1mm'" solid ball.xyz --merge-radius 1mm
run 2 "--orientation: 'gven' is not one of auto, never, given, estimate; did you mean 'given'?" \
  solid ball.xyz --orientation gven
run 2 "--orient-data: 'x'" solid ball.xyz --orient-data x
run 2 "--orient-method: 'plane' is not one of auto, energy, planes; did you mean 'planes'?" \
  solid ball.xyz --orient-method plane
run 2 "--method: 'lu'" solid ball.xyz --method lu
run 2 "--evaluate: 'quick' is not one of auto, direct, fast" solid ball.xyz --evaluate quick
run 2 "--cell: '0'" solid ball.xyz --cell 0
run 2 "--box: '0,0,0,1,1' is not the 6 numbers" solid ball.xyz --box 0,0,0,1,1
run 2 "--box: '0,0,x,1,1,1' is not 6 numbers" solid ball.xyz --box 0,0,x,1,1,1
run 2 "the first corner must be below the second" solid ball.xyz --box 0,0,1,1,1,1
run 2 "--memory: '12' is not a size" solid ball.xyz --memory 12
run 2 "--memory: '2X' is not a size" solid ball.xyz --memory 2X
run 2 "--loo: 'some'" solid ball.xyz --loo some
run 2 "--threads: '0' is not a whole number from 1 to 64" solid ball.xyz --threads 0
run 2 "--view: '1' is not 2 numbers" solid ball.xyz --view 1
run 2 "--view: elevation 99" solid ball.xyz --view 0,99
run 2 "--up: 'w'" solid ball.xyz --up w
run 2 "--color: 'means' is not one of none, gradient, mean, gauss; did you mean 'mean'?" solid ball.xyz --color means
run 2 "--size: '5,5'" solid ball.xyz --size 5,5
run 2 "m.dae: unknown extension for -o" solid ball.xyz -o m.dae
run 2 "p.jpg: unknown extension for --picture" solid ball.xyz --picture p.jpg
run 2 "ball.xyz: is the input" solid ball.xyz --report ball.xyz
run 2 "m.ply: is named as output twice" solid ball.xyz -o m.ply -o m.ply
run 2 "p.svg: the points are in space; use .png" solid ball.xyz --picture p.svg
run 2 "m.csv: the points are in space" solid ball.xyz -o m.csv
run 2 "no file" inspect
run 2 "unknown option '--reprt'; did you mean '--report'?" inspect ball.ply --reprt x

# ---- could not: status 1, one line --------------------------------------------------------------

run 1 "none.xyz" solid none.xyz -o m.ply
run 1 "no/such/m.ply: cannot be written" solid ball.xyz -o no/such/m.ply
run 1 "bin: is a directory" solid ball.xyz --report bin
printf '1 2 3\n4 5 x\n' >broken.xyz
run 1 "broken.xyz:2" solid broken.xyz -o m.ply
printf '0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 1 0\n3 2 0\n' >flat.xyz
run 1 "flat.xyz: points: flat" solid flat.xyz -o m.ply --picture m.png --report m.json
run 1 "has no normals" solid ball.xyz --orientation given
run 1 "carrier.json" solid ball.xyz --carrier carrier.json
run 1 "raise --memory" solid ball.xyz --memory 1M -o m.ply --picture m.png --size 4000,4000
run 1 "broken.xyz" inspect broken.xyz
run 1 "none.ply" inspect none.ply
printf 'hello\n' >hello.bin
run 1 "hello.bin" inspect hello.bin
awk 'BEGIN { srand(1); for (i = 0; i < 150000; i++) print rand(), rand(), rand() }' >many.xyz
run 1 "allowed are" solid many.xyz --memory 9G --method mixed # a matrix of 45 GB: refused by its size
check "and the text is in the words of the program" grep -q 'many.xyz: 150000 rows .*; raise --memory' err
rm -f broken.xyz flat.xyz hello.bin many.xyz
nothing_new "after all failures"

# A failure after files were written in part: the older file of that name stays as it was.
printf 'old\n' >m.ply
run 1 "batten: " solid ball.xyz -o m.ply --picture m.png --size 8000,8000 --memory 20M
check "an older file survives a failure" grep -qx old m.ply
check "and no picture is there" test ! -e m.png
rm -f m.ply

# ---- a whole run --------------------------------------------------------------------------------

awk 'BEGIN { n = 600; for (i = 0; i < n; i++) { z = 1 - (2 * i + 1) / n; r = sqrt(1 - z * z); a = 2.399963229728653 * i
  printf "%.17g,%.17g,%.17g\n", 3 + 2 * r * cos(a), 2 * r * sin(a) - 5, 1 + 2 * z } }' >s.csv
run 0 "" solid s.csv -o s.ply -o s.vtp -o s.stl --report s.json --save s-solid.json --quiet --loo all --threads 2
check "--quiet prints nothing" test ! -s out
holds s.json volume 'x > 33.5103 * 0.99 && x < 33.5103 * 1.01'
holds s.json area 'x > 50.2655 * 0.99 && x < 50.2655 * 1.01'
holds s.json residual_max 'x <= 1e-10'
holds s.json loo_samples 'x == 600'
holds s.json points_used 'x == 600'
holds s.json mesh_genus 'x == 0'
holds s.json mesh_components 'x == 1'
holds s.json mesh_self_intersections 'x == 0'
holds s.json mesh_angles_above_20deg 'x >= 0.99'
holds s.json centroid_y 'x > -5.001 && x < -4.999'
holds s.json phantom_components 'x == 0'
is s.json mesh_closed True
is s.json mesh_manifold True
is s.json sign_check clean
is s.json status ok
is s.json outline_loops None
for key in $(sed -n -e '/^## Common/,/^## batten stack/s/^| \(`[^|]*`\) |.*/\1/p' \
  -e '/^## Surfaces of solids/,/^## batten inspect/s/^| \(`[^|]*`\) |.*/\1/p' "$root/docs/report.md" | tr -d '`'); do
  echo "$key"
done | sort >documented
python3 -c 'import json; print("\n".join(sorted(json.load(open("s.json")))))' >reported
check "the report has the documented keys and no others: $(diff documented reported | tr '\n' ' ')" cmp documented reported
check "there are many of them" test "$(wc -l <documented)" -ge 90
check "the mesh carries curvature" grep -aq 'mean_curvature' s.ply
run 0 "" inspect s.ply --report i.json
holds i.json volume 'x > 33.5103 * 0.99 && x < 33.5103 * 1.01'
is i.json kind mesh
check "inspect prints the shape" grep -q 'closed manifold, genus 0' out
run 0 "" inspect s-solid.json
check "inspect knows a solid" grep -q '^kernel .*r^1' out
run 0 "" inspect s.csv
check "inspect knows points" grep -q '^points .*600, in space' out

# A report on standard output is alone there: through a pipe, into a file, behind what is there already.
"$batten" solid s.csv --report - 2>err | python3 -c 'import json, sys; sys.exit(json.load(sys.stdin)["points_used"] != 600)'
ok $? "--report - is JSON and nothing else"
"$batten" inspect s.ply --report /dev/stdout 2>err | python3 -c 'import json, sys; sys.exit(json.load(sys.stdin)["kind"] != "mesh")'
ok $? "so is --report /dev/stdout, when it is a pipe: $(cat err)"
{ echo before; "$batten" inspect s.ply --report /dev/stdout; } >both 2>err
check "and when it is a file, what stood there is kept" test "$(head -n 2 both | tr '\n' ' ')" = 'before { '
check "no file '-' is made" test ! -e -
"$batten" inspect s.ply -q --report /dev/fd/5 5>&1 >out 2>err | grep -q '"kind": "mesh"'
ok $? "a report goes into a pipe under /dev/fd: $(cat err)"
run 1 "/dev/full: cannot be written" inspect s.ply --report /dev/full
"$batten" inspect s.ply --report - >/dev/full 2>err
[ $? -eq 1 ] && grep -q '^batten: -: cannot be written: No space left' err
ok $? "a full standard output is told: $(cat err)"

# Few points make a mesh that looks smooth: edges of at most 1/120 of the diagonal of the points' box.
head -n 600 s.csv | awk 'NR % 6 == 1' >few.csv
run 0 "" solid few.csv --report few.json --quiet
holds few.json cell 'x > 0 && x <= 1.001 * 4 * sqrt(3) / 120'
holds few.json volume 'x > 33.5103 * 0.998 && x < 33.5103 * 1.002'

# The same from gzip, with other threads: the same figures, the same mesh.
gzip -k s.csv
run 0 "" solid s.csv.gz -o t.ply --report t.json --quiet --threads 1
check "gzip input and one thread give the same mesh" cmp s.ply t.ply
run 0 "" solid s.csv -o u.ply --quiet --carrier ball
run 0 "" solid s.csv --report u.json --quiet --method ldl --order 3 --smoothing 1e-6 --merge-radius 0.01 --cell 0.4
is u.json method ldl
holds u.json order 'x == 3'
holds u.json smoothing 'x == 1e-6'
run 0 "" solid s.csv --report u.json --quiet --method iterative --accuracy 1e-8 --cell 0.4
is u.json method iterative
holds u.json accuracy 'x == 1e-8'
holds u.json residual_rows 'x <= 1e-8'
holds u.json iterations 'x >= 1'
is u.json reduce None
is u.json points_certified None
run 0 "" solid s.csv --report u.json --quiet --reduce 0.05 --save few-centres.json --cell 0.4
holds u.json reduce 'x == 0.05'
holds u.json distance_certified 'x > 0 && x <= 0.05'
holds u.json reduce_ratio 'x <= 1'
holds u.json distance_certified_rms "x > 0 && x < $(figure u.json distance_certified)"
holds u.json distance_rms "x > 0.999 * $(figure u.json distance_certified_rms) && x < 1.001 * $(figure u.json distance_certified_rms)"
holds u.json points_certified "x == $(figure u.json points_used)"
holds u.json centers "x < 0.7 * $(figure u.json points_used)"
run 2 "--reduce" solid s.csv --reduce -1
awk 'BEGIN { srand(4); for (i = 0; i < 500; i++) { z = 1 - (2 * i + 1) / 500; r = sqrt(1 - z * z); a = 2.39996 * i
  n = -6; for (k = 0; k < 12; k++) n += rand(); s = 1 + 0.02 * n; print s * r * cos(a), s * r * sin(a), s * z } }' >noisy.xyz
run 0 "" solid noisy.xyz --report u.json --quiet --noise auto --cell 0.1
holds u.json noise 'x > 0.017 && x < 0.023'
run 0 "" solid noisy.xyz --report u.json --noise 0.015 --cell 0.1
holds u.json noise 'x == 0.015'
holds u.json distance_rms 'x > 0.0142 && x < 0.0158'
holds u.json smoothing 'x > 0'
grep -q '^noise .*0.015, ' out
ok $? "and it says so: $(grep ^noise out)"
run 2 "--noise" solid s.csv --noise -1
run 1 "batten: --noise: 0.1 beside --smoothing" solid s.csv --noise 0.1 --smoothing 1
run 1 "batten: --noise: 0.1 beside --reduce" solid s.csv --noise 0.1 --reduce 1
run 1 "set --order to 2" solid s.csv --order 3 --carrier ball --orientation never
run 0 "" solid s.csv --orientation estimate --reduce 0.05 --cell 0.4
grep -q "^centres .* of all points$" out
ok $? "pairs are summed directly too, and it says so: $(grep ^centres out)"

# Fast sums make the same surface; curvatures then come from normals along the mesh: 1/2 on a ball of radius 2.
is s.json evaluation direct
is s.json evaluation_error None
holds s.json residual_points "x == $(figure s.json points_used)"
awk 'BEGIN { n = 4000; for (i = 0; i < n; i++) { z = 1 - (2 * i + 1) / n; r = sqrt(1 - z * z); a = 2.399963229728653 * i
  printf "%.17g,%.17g,%.17g\n", 2 * r * cos(a), 2 * r * sin(a), 2 * z } }' >many.csv
for how in direct fast; do
  run 0 "" solid many.csv --method iterative --evaluate $how --cell 0.15 --report $how.json -o $how.vtp --quiet
done
is fast.json evaluation fast
is fast.json check_evaluation fast
holds fast.json evaluation_error 'x > 0 && x < 1e-7'
holds fast.json check_evaluation_error 'x > 0 && x < 1e-5'
holds fast.json evaluation_gradient_error 'x > 0 && x < 1e-3'
holds fast.json sums_accuracy 'x >= 1e-12 && x <= 1e-6'
holds fast.json time_evaluation_s "x > 0 && x < $(figure fast.json time_total_s)"
for key in mesh_genus mesh_components phantom_cells weak_gradients; do
  holds fast.json $key "x == $(figure direct.json $key)"
done
for key in volume area gradient_max; do
  holds fast.json $key "x > $(figure direct.json $key) * 0.999 && x < $(figure direct.json $key) * 1.001"
done
check "the median of its curvatures is 1/2 and 1/4" python3 - fast.vtp <<'EOF_PY'
import re, struct, sys
data = open(sys.argv[1], "rb").read()
start = data.index(b"_", data.index(b"<AppendedData")) + 1
for name, wanted in (b"mean_curvature", 0.5), (b"gaussian_curvature", 0.25):
    array = re.search(b"<DataArray[^>]*Name=\"%s\"[^>]*>" % name, data).group(0)
    at = start + int(re.search(b"offset=\"(\\d+)\"", array).group(1))
    code, size = (b"f", 4) if b"Float32" in array else (b"d", 8)
    count = struct.unpack_from("<Q", data, at)[0] // size
    values = sorted(struct.unpack_from("<%d%s" % (count, code.decode()), data, at + 8))
    assert abs(values[count // 2] - wanted) < 0.05 * wanted, (name, values[count // 2])
EOF_PY
run 0 "warning: the surface reaches its box and is cut there; enlarge --box" solid s.csv --report u.json --quiet --box 1,-8,-2,6,-2,1.5
is u.json status clipped
is u.json mesh_closed False
is u.json surface_clipped True

# ---- plane points -------------------------------------------------------------------------------

awk 'BEGIN { n = 80; for (i = 0; i < n; i++) { a = 6.283185307179586 * i / n; printf "%.17g %.17g\n", 2 * cos(a), sin(a) } }' >e.xyz
run 0 "" solid e.xyz -o e.csv -o e.svg --picture ep.svg --picture e.png --report e.json
holds e.json area 'x > 6.283185 * 0.99 && x < 6.283185 * 1.01'
holds e.json outline_loops 'x == 1'
holds e.json dimension 'x == 2'
is e.json outline_closed True
is e.json mesh_genus None
python3 -c 'import json; print("\n".join(sorted(json.load(open("e.json")))))' >reported
check "a plane report has the same keys" cmp documented reported
for f in e.csv e.svg ep.svg e.png; do check "$f is there" test -s "$f"; done
run 2 "e.ply: the points are plane; use .svg" solid e.xyz -o e.ply

# ---- Ctrl-C -------------------------------------------------------------------------------------

awk 'BEGIN { n = 6000; for (i = 0; i < n; i++) { z = 1 - (2 * i + 1) / n; r = sqrt(1 - z * z); a = 2.399963229728653 * i
  printf "%.17g %.17g %.17g\n", r * cos(a), r * sin(a), z } }' >big.xyz
ls -A >before
# Job control gives the child a SIGINT that is not ignored.
set -m
"$batten" solid big.xyz -o big.ply --report big.json --method ldl --loo none >out 2>err &
child=$!
set +m
sleep 0.4
kill -INT $child
wait $child
status=$?
[ $status -eq 130 ] && grep -q '^batten: interrupted; nothing was written$' err
ok $? "Ctrl-C ends it with 130: $status, $(cat err)"
nothing_new "after Ctrl-C"

echo "1..$count"
exit $bad
