#!/usr/bin/env bash
# The page of `shakebed live`, built anew where that is due: same bed as the program's (node), same fused multiply-add as
# the library's (node), and a page that answers, fits and is silent (Chromium).
# usage: live.sh bed|page SOURCE BUILD SHAKEBED [PICTURES]   (exit 77: em++, node or Chromium is not installed)
set -eu
here=$(dirname "$(realpath "$0")")
what=$1 source=$2 build=$3 shakebed=$4 pictures=${5:-}
skip() { echo "SKIPPED: $1 is not installed (Debian: $2)"; exit 77; }
emxx=$(command -v em++) || skip em++ emscripten
node=$(command -v node) || skip node nodejs
cmake --build "$build" --target shakebed_live
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"

# What the program writes is the page.
"$shakebed" live --out bed.html >/dev/null
"$shakebed" live --out bed.html >/dev/null  # and again, over its own
echo mine >other.html
if "$shakebed" live --out other.html 2>err.txt; then echo "BAD: it wrote over another file"; exit 1; fi
grep -q 'other.html exists' err.txt
[ "$(cat other.html)" = mine ]

case $what in
  bed)
    "$emxx" -std=c++20 -O2 -fno-vectorize -fno-slp-vectorize -DNDEBUG -msimd128 -ffp-contract=off -fno-math-errno -Wno-psabi \
      -include "$source/pipelines/live/bit_cast.hpp" "-I$source" "$here/fused_test.cpp" --no-entry -sSTANDALONE_WASM \
      -sEXPORTED_FUNCTIONS=_special_differences,_random_differences -o fused.wasm
    "$node" "$here/fused.mjs" fused.wasm
    "$node" "$here/same_bed.mjs" bed.html "$shakebed" "$folder"
    ;;
  page)
    browser=$(command -v chromium || command -v chromium-browser || command -v google-chrome) || skip Chromium chromium
    "$node" "$here/page.mjs" "$browser" bed.html "$shakebed" "$folder" ${pictures:+"$pictures"}
    ;;
esac
