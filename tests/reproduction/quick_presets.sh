#!/usr/bin/env bash
# The preset `quick` of shipped recipes runs to its end and measures numbers of its claims.
# usage: quick_presets.sh SHAKEBED RECIPE...      these recipes
#        quick_presets.sh SHAKEBED all-but RECIPE...      all that are shipped, but these
set -eu
shakebed=$(realpath "$1")
shift
folder=$(mktemp -d /tmp/shakebed-presets.XXXXXX)
trap 'rm -rf "$folder"' EXIT
status=0
recipes=$("$shakebed" reproduce --list | awk '{ print $1 }')
[ "$(wc -w <<<"$recipes")" -ge 17 ] || { echo "recipes are not listed: $recipes"; exit 1; }
if [ "$1" = all-but ]; then
  shift
  for without in "$@"; do
    grep -qx "$without" <<<"$recipes" || { echo "there is no recipe $without"; exit 1; }
    recipes=$(grep -vx "$without" <<<"$recipes")
  done
else
  recipes=$*
fi
for recipe in $recipes; do
  if ! "$shakebed" reproduce "$recipe" --preset quick --quiet -j1 --out "$folder/$recipe" >"$folder/log" 2>&1; then
    echo "$recipe fails:"
    grep -m 3 '^error' "$folder/log" || tail -5 "$folder/log"
    status=1
  fi
  for claims in "$folder/$recipe"/*claims*/claims.csv; do
    measured=$(grep -c -v -e '^claim,' -e 'not measured' "$claims" || true)
    [ "${measured:-0}" -gt 0 ] || { echo "$recipe: $claims has no measured number"; status=1; }
  done
  rm -rf "${folder:?}/$recipe"
done
exit $status
