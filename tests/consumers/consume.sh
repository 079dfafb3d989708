#!/bin/sh
# Builds and runs the program in program/ the way a user of an installed batten does; exit status 77 = skipped.
#   consume.sh pkg-config-shared | pkg-config-static | cmake-shared | cmake-static | subproject
# Environment: MESON, CC, SOURCE (root of batten), BUILD (its build folder), LIBDIR (below the prefix), VERSION.
set -eu
kind=$1
program=$SOURCE/tests/consumers/program
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
flags="-std=c11 -Wall -Wextra -Wpedantic -Werror"

install_batten() { # with shared or static libraries only; moved from where it was configured for, on purpose
  DESTDIR=$scratch/stage "$MESON" install -C "$BUILD" --no-rebuild --quiet
  header=$(find "$scratch/stage" -path '*/include/batten/batten.h')
  prefix=$scratch/installed
  mv "${header%/include/batten/batten.h}" "$prefix"
  libdir=$prefix/$LIBDIR
  case "$1" in
    shared) rm -f "$libdir"/libbatten*.a ;;
    static) rm -f "$libdir"/libbatten*.so* ;;
  esac
}

loads_shared() { ldd "$1" | grep -qF "libbatten.so.0 => $libdir/"; }

try() { # try shared|static NAME: runs a program that was built, and looks what it loads
  if [ "$1" = shared ]; then
    export LD_LIBRARY_PATH="$libdir${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
    loads_shared "$2" || { echo "$2 does not load libbatten.so.0"; exit 1; }
  elif loads_shared "$2"; then
    echo "$2 loads libbatten.so.0"
    exit 1
  fi
  "$2" "$VERSION"
}

with_pkg_config() {
  install_batten "$1"
  export PKG_CONFIG_PATH="$libdir/pkgconfig"
  [ "$(pkg-config --modversion batten)" = "$VERSION" ]
  option=
  [ "$1" = shared ] || option=--static
  for part in batten batten-exchange; do
    [ -f "$libdir/pkgconfig/$part.pc" ] || continue
    $CC $flags "$program/$part.c" -o "$scratch/$part" $(pkg-config $option --cflags --libs $part) -lm
    try "$1" "$scratch/$part"
  done
}

with_cmake() {
  command -v cmake >/dev/null || { echo "cmake is not installed"; exit 77; }
  install_batten "$1"
  # On Debian cmake does not look below lib64, which is what meson takes for libdir where dpkg-dev is missing.
  find=-DCMAKE_PREFIX_PATH=$prefix
  [ "$LIBDIR" != lib64 ] || find=-Dbatten_DIR=$libdir/cmake/batten
  CC=$CC cmake -G Ninja -S "$program" -B "$scratch/build" "$find" -DCMAKE_C_FLAGS="$flags" >"$scratch/log" ||
    { cat "$scratch/log"; exit 1; }
  cmake --build "$scratch/build" >"$scratch/log" 2>&1 || { cat "$scratch/log"; exit 1; }
  for part in batten batten-exchange; do
    [ ! -x "$scratch/build/$part" ] || try "$1" "$scratch/build/$part"
  done
  # A version that does not fit has to be refused.
  if CC=$CC cmake -G Ninja -S "$program" -B "$scratch/other" "$find" -DWANTED=7.0 >"$scratch/log" 2>&1; then
    echo "find_package took version $VERSION for 7.0"
    exit 1
  fi
}

with_subproject() {
  mkdir -p "$scratch/host/subprojects"
  cp "$program/meson.build" "$program/batten.c" "$scratch/host/"
  ln -s "$SOURCE" "$scratch/host/subprojects/batten"
  printf '[wrap-file]\ndirectory = batten\n\n[provide]\ndependency_names = batten\n' \
    >"$scratch/host/subprojects/batten.wrap"
  # Debug builds of what is compiled here once more: this is about building, not about speed.
  CC=$CC "$MESON" setup "$scratch/build" "$scratch/host" --wrap-mode=forcefallback -Doptimization=0 \
    -Ddefault_library=static -Dbatten:blas="$BLAS" -Dbatten:blas_libs="$BLAS_LIBS" >"$scratch/log" 2>&1 || { cat "$scratch/log"; exit 1; }
  if grep -E 'dependency (zlib|libpng|jansson) found' "$scratch/log"; then
    echo "as a subproject batten asks for more than BLAS and LAPACK"
    exit 1
  fi
  ninja -C "$scratch/build" >"$scratch/log" 2>&1 || { tail -n 40 "$scratch/log"; exit 1; }
  "$scratch/build/batten" "$VERSION"
}

case "$kind" in
  pkg-config-shared) with_pkg_config shared ;;
  pkg-config-static) with_pkg_config static ;;
  cmake-shared) with_cmake shared ;;
  cmake-static) with_cmake static ;;
  subproject) with_subproject ;;
esac
