#!/bin/sh
# usage: install_test.sh TREE BUILD CMAKE COMPILER prefix|package|pkg_config|symbols|subproject|shared|clang
# Works in BUILD/tests/install; the consumer project is copied out of the tree, so that it finds nothing of ours by chance.
set -eu
tree=$1 build=$2 cmake=$3 compiler=$4 case=$5
work=$build/tests/install
prefix=$work/prefix

fail() { echo "$*" >&2; exit 1; }

# Not optimised, the files of a library at once: what is built here runs for a moment. Symbols, flags and packages are the same.
quick="-DCMAKE_CXX_FLAGS_RELEASE=-O0 -DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=0"

# Builds and runs the consumer with the further arguments of cmake.
consumer() {
  folder=$work/consumer-$case
  rm -rf "$folder"
  mkdir -p "$folder"
  cp "$tree"/tests/install/consumer/* "$folder"
  begin=$(date +%s)
  # shellcheck disable=SC2086
  "$cmake" -S "$folder" -B "$folder/build" -G Ninja -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_BUILD_TYPE=Release \
    "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Wpedantic -Werror" $quick "$@"
  "$cmake" --build "$folder/build" --target with_sim
  case $case in package | shared | clang) "$cmake" --build "$folder/build" ;; esac
  for program in "$folder"/build/with_*; do
    [ -x "$program" ] && [ -f "$program" ] || continue
    echo "== $program"
    "$program" || fail "$program failed"
  done
  echo "configured, built and run in $(($(date +%s) - begin)) s"
}

# Builds the libraries alone with the further arguments of cmake and installs them into $work/NAME-prefix.
built_alone() {
  name=$1
  shift
  rm -rf "$work/$name-prefix"
  # shellcheck disable=SC2086
  "$cmake" -S "$tree" -B "$work/$name" -G Ninja -DCMAKE_BUILD_TYPE=Release -DSHAKEBED_PIPELINES=OFF -DSHAKEBED_TESTS=OFF \
    -DSHAKEBED_BENCH=OFF $quick "$@"
  "$cmake" --build "$work/$name"
  "$cmake" --install "$work/$name" --prefix "$work/$name-prefix" >/dev/null
}

# Strong symbols of ours, in the lines of nm: all in namespace shakebed.
no_symbols_outside() {
  outside=$(grep -E '^[0-9a-f]+ [TDBRGS] ' |
    grep -vE '^[0-9a-f]+ [A-Z] ((typeinfo|typeinfo name|vtable|guard variable|construction vtable|VTT) for |(non-)?virtual thunk to )?shakebed::' |
    grep -vE ' (_init|_fini|_edata|_end|__bss_start)$' || true)
  [ -z "$outside" ] || fail "$1 has symbols outside namespace shakebed: $outside"
}

# No flag that changes what a user's code means or warns of.
no_flags_leak() {
  leaked=$(grep -E 'command' "$folder/build/compile_commands.json" | grep -E 'with_[a-z]+\.cpp' |
    grep -oE -- '-(march|mtune|ffp-contract|fno-math-errno|Wconversion|Wshadow|Wno-psabi|fsanitize)[^ "]*' || true)
  [ -z "$leaked" ] || fail "flags of ours reach the users: $leaked"
}

case $case in
  prefix)
    rm -rf "$prefix"
      for part in program development; do
      "$cmake" --install "$build" --prefix "$prefix" --component "$part" >/dev/null
    done
    for file in bin/shakebed include/shakebed/sim/scene.hpp share/shakebed/schema/pipeline.schema.json \
      share/man/man1/shakebed.1 share/man/man1/shakebed-run.1 share/bash-completion/completions/shakebed \
      share/zsh/site-functions/_shakebed; do
      [ -s "$prefix/$file" ] || fail "$file was not installed"
    done
    for header in $(cd "$prefix/include" && find . -name '*.hpp'); do
      if grep -nE '#include (<|")(gsl|Eigen|opencv|nlohmann|CLI|fmt)' "$prefix/include/$header"; then
        fail "$header includes what its users may not have"
      fi
    done
    if grep -rnE '#include "' "$prefix/include"; then fail "a public header includes a header of the tree"; fi
    # Each says what may be used by several threads and who owns what.
    for header in $(cd "$prefix/include" && find . -name '*.hpp' ! -path '*/detail/*'); do
      grep -q '^//.*thread' "$prefix/include/$header" && grep -qE '^//.*(own|[Pp]lain data|refers to)' "$prefix/include/$header" ||
        fail "$header does not say what may be used by several threads, or who owns what"
    done
    "$prefix/bin/shakebed" theory --json >/dev/null || fail "the installed program does not run"
    bash -n "$prefix/share/bash-completion/completions/shakebed" || fail "the completion for bash is no shell script"
    ;;
  package)
    # Moved: nothing in the package may name the place it was installed to first.
    rm -rf "$work/moved"
    cp -r "$prefix" "$work/moved"
    consumer "-DCMAKE_PREFIX_PATH=$work/moved" "-DCOMPONENTS=sim;ingest;fit"
    no_flags_leak
    # sim alone asks for no other package.
    case=sim_alone
    consumer "-DCMAKE_PREFIX_PATH=$work/moved" -DCOMPONENTS=sim -DCMAKE_DISABLE_FIND_PACKAGE_OpenCV=ON \
      -DCMAKE_DISABLE_FIND_PACKAGE_GSL=ON
    if grep -q 'OpenCV_DIR\|GSL_' "$folder/build/CMakeCache.txt"; then fail "sim looks for OpenCV or GSL"; fi
    # What is not there is named.
    if "$cmake" -S "$folder" -B "$folder/bad" -G Ninja "-DCMAKE_PREFIX_PATH=$work/moved" -DCOMPONENTS=magnets \
      >"$folder/bad.log" 2>&1; then fail "an unknown component was found"; fi
    grep -q 'no component "magnets"' "$folder/bad.log" || fail "the message does not name the component"
    ;;
  pkg_config)
    library=$(dirname "$(find "$prefix" -name libshakebed_sim.a)")
    export PKG_CONFIG_PATH="$library/pkgconfig"
    for room in sim fit; do
      # shellcheck disable=SC2046
      "$compiler" -std=c++20 "$tree/tests/install/consumer/with_$room.cpp" \
        $(pkg-config --cflags --libs --static "shakebed-$room") -o "$work/pc_$room"
      "$work/pc_$room" || fail "the program built by pkg-config failed"
    done
    ;;
  symbols)
    for library in "$build"/*/libshakebed_statistics.a "$build"/*/libshakebed_sim.a "$build"/*/libshakebed_ingest.a \
      "$build"/*/libshakebed_fit.a; do
      [ -f "$library" ] || continue
      nm --defined-only --extern-only -C "$library" 2>/dev/null | no_symbols_outside "$library"
      # A library does not print and does not end the program.
      ends=$(nm --undefined-only -C "$library" 2>/dev/null | grep -E \
        ' (exit|_exit|_Exit|quick_exit|abort|puts|putchar|printf|vprintf|stdout|stderr|std::(cout|cerr|clog))(@|$)' || true)
      [ -z "$ends" ] || fail "$library prints or ends the program: $ends"
    done
    ;;
  subproject)
    consumer "-DSHAKEBED_TREE=$tree"
    no_flags_leak
    ;;
  shared)
    # Of the objects that the build has. Two rooms say themselves how they are optimised, and take minutes.
    built_alone shared -DCMAKE_CXX_COMPILER="$compiler" -DSHAKEBED_SHARED=ON \
      "-DCMAKE_CXX_COMPILER_LAUNCHER=sh;$tree/tests/install/built_before.sh;$build"
    rm -rf "$work/shared-moved"
    mv "$work/shared-prefix" "$work/shared-moved"
    consumer "-DCMAKE_PREFIX_PATH=$work/shared-moved" "-DCOMPONENTS=sim;ingest;fit" -DCMAKE_DISABLE_FIND_PACKAGE_OpenCV=ON \
      -DCMAKE_DISABLE_FIND_PACKAGE_GSL=ON
    no_flags_leak
    for room in sim ingest fit; do
      readelf -d "$folder/build/with_$room" | grep -q "libshakebed_$room.so.1" || fail "with_$room does not use the shared library"
    done
    for library in $(find "$work/shared-moved" -name 'libshakebed_*.so'); do
      nm --dynamic --defined-only -C "$library" | no_symbols_outside "$library"
    done
    ;;
  clang)
    clang=$(command -v clang++ || command -v clang++-14) || { echo "skipped: there is no clang++"; exit 77; }
    compiler=$clang
    # Its user's compiler, with libraries of ours by g++ ...
    consumer "-DCMAKE_PREFIX_PATH=$prefix" "-DCOMPONENTS=sim;ingest;fit"
    # ... and ours, with a user's g++.
    built_alone clang -DCMAKE_CXX_COMPILER="$clang" -DSHAKEBED_INGEST=OFF -DSHAKEBED_FIT=OFF -DSHAKEBED_WERROR=ON
    compiler=$4
    consumer "-DCMAKE_PREFIX_PATH=$work/clang-prefix" -DCOMPONENTS=sim
    ;;
  *) fail "there is no test $case" ;;
esac
