#!/bin/sh
# Instructions a collision, scene by scene, beside the committed baseline (instructions.csv): more than 5 % above it
# fails. Counted by callgrind, so the same on a busy machine. Skipped (77) without valgrind or with another compiler than
# the baseline's.
#   instructions.sh COUNT_INSTRUCTIONS BASELINE COMPILER [--write]
set -eu
program=$1 baseline=$2 compiler=$3 write=${4:-}
command -v valgrind >/dev/null || { echo "skipped: there is no valgrind"; exit 77; }
expected=$(sed -n 's/^# compiler: //p' "$baseline" 2>/dev/null || true)
if [ -z "$write" ] && [ "$expected" != "$compiler" ]; then
  echo "skipped: the baseline is of $expected, this is $compiler"
  exit 77
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
status=0
new="# Instructions a collision (callgrind), each scene with one choice more than the one before it.
# compiler: $compiler
scene,instructions"
printf '%-18s %12s %9s %8s\n' scene instructions baseline change
for scene in minimal gravity floor inelastic contact-duration friction bath observables; do
  collisions=$(valgrind --tool=callgrind --toggle-collect=measured --callgrind-out-file="$folder/out" \
    "$program" "$scene" 100000 2>"$folder/log")
  total=$(sed -n 's/^.*Collected : //p' "$folder/log")
  found=$((total / collisions))
  before=$(sed -n "s/^$scene,//p" "$baseline" 2>/dev/null || true)
  change=$(awk -v a="$found" -v b="${before:-0}" 'BEGIN { if (b > 0) printf "%+.1f %%", 100 * (a / b - 1); else print "-" }')
  printf '%-18s %12d %9s %8s\n' "$scene" "$found" "${before:--}" "$change"
  new="$new
$scene,$found"
  if [ -z "$write" ] && [ $((found * 100)) -gt $((${before:-0} * 105)) ]; then
    echo "$scene: more than 5 % above the baseline"
    status=1
  fi
done
[ -n "$write" ] && printf '%s\n' "$new" >"$baseline"
exit $status
