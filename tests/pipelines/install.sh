#!/usr/bin/env bash
# What `cmake --install` puts somewhere works there: recipes, schema, and the images module, its own and not the build's.
# usage: install.sh CMAKE BUILD
set -eu
source=$(cd "$(dirname "$0")/../.." && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$1" --install "$2" --prefix "$folder/prefix" >"$folder/log.txt" 2>&1 || { cat "$folder/log.txt"; exit 1; }
export PATH="$folder/prefix/bin:$PATH"
mkdir "$folder/work"
cd "$folder/work"
fail() { echo "FAILED: $*"; exit 1; }
[ "$(command -v shakebed)" = "$folder/prefix/bin/shakebed" ] || fail "no program"
shakebed init bed.json >/dev/null
shakebed schema >schema.json
cmp schema.json "$folder/prefix/share/shakebed/schema/pipeline.schema.json" || fail "the schema beside it is another one"
# The recipes of the tree, all of them; that those are valid, Recipes.AllShippedOnesAreGood asks.
diff -r "$source/pipelines/recipes" "$folder/prefix/share/shakebed/recipes" || fail "other recipes than those of the tree"
diff -r "$source/reference-data" "$folder/prefix/share/shakebed/reference-data" || fail "other numbers than those of the tree"
shakebed validate "$folder/prefix/share/shakebed/recipes/scenes/shaker-table.json" --quiet || fail "a recipe is not valid there"
shakebed reproduce --dry-run | grep -q '^bed: runs' || fail "no recipes inside"
LD_DEBUG=files LD_DEBUG_OUTPUT="$folder/loaded" shakebed run bed.json --preset quick --set /stages/bed/frames/count=8 --out o --quiet >/dev/null 2>&1 || [ $? = 6 ] ||
  fail "the starter does not run"
test -s o/extract/disks.csv || fail "no image was read"
grep -ho 'calling init: .*libshakebed_images[^ ]*' "$folder"/loaded.* | grep -q "$folder/prefix" || fail "the images module is not the installed one"
echo "installed, and whole"
