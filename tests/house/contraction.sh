#!/bin/sh
# The program holds no multiplication fused with additions and subtractions by turns: no source asks for one, so it would
# be the compiler's, and results would depend on the machine and on how the code is laid out.
#   contraction.sh PROGRAM...
set -eu
command -v objdump >/dev/null || { echo "skipped: there is no objdump"; exit 77; }
status=0
for program in "$@"; do
  found=$(objdump -d --no-show-raw-insn "$program" | grep -cE 'vfmaddsub|vfmsubadd' || true)
  echo "$program: $found"
  [ "$found" = 0 ] || status=1
done
exit $status
