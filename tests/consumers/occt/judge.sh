#!/bin/sh
# Has Open CASCADE read what batten writes: compiles judge.cpp, lets FILES write into a scratch folder, and judges that.
#   judge.sh FILES...     environment: SOURCE (root of batten), CXX; OCCT_INCLUDE where its headers are not Debian's
set -eu
include=${OCCT_INCLUDE:-/usr/include/opencascade}
skip() {
  echo "1..0 # SKIP $1"
  exit 0
}
[ -f "$include/STEPControl_Reader.hxx" ] || skip "Open CASCADE is not installed (Debian: libocct-data-exchange-dev)"
cxx=${CXX:-g++}
command -v ${cxx%% *} >/dev/null || skip "no C++ compiler"
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
$cxx -std=c++17 -O1 -Wall -isystem "$include" "$SOURCE/tests/consumers/occt/judge.cpp" -o "$scratch/judge" \
  -lTKSTEP -lTKSTEPBase -lTKSTEPAttr -lTKIGES -lTKXSBase -lTKShHealing -lTKTopAlgo -lTKBRep -lTKGeomAlgo \
  -lTKGeomBase -lTKG3d -lTKG2d -lTKMath -lTKernel
for files; do "$files" "$scratch"; done >"$scratch/manifest"
"$scratch/judge" "$scratch/manifest"
