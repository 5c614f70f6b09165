#!/bin/sh
# usage: built_before.sh BUILD COMPILER ARGUMENTS...   (a compiler launcher of CMake)
# Compiles, unless BUILD holds the same object: of the same name, from the same compiler and flags but for -O and
# -DNDEBUG. That object is copied, which says so; whoever asks has just had BUILD built.
set -eu
build=$1
shift

# The compiler and the flags that say what the object is, a line each.
meaning() {
  awk 'skip { skip = 0; next } /^-(isystem|MT|MF|o|c)$/ { skip = 1; next } /^($|-I|-O|-MD$|-DNDEBUG$)/ { next } !/ccache$/' | sort
}

object= dependencies= before=
for word in "$@"; do
  case $before in -o) object=$word ;; -MF) dependencies=$word ;; esac
  before=$word
done
if [ -f "$build/$object" ]; then
  there=$(ninja -C "$build" -t commands "$object" | tail -n 1 | tr ' ' '\n' | meaning)
  if [ "$there" = "$(printf '%s\n' "$@" | meaning)" ]; then
    cp "$build/$object" "$object"
    [ -z "$dependencies" ] || echo "$object:" >"$dependencies"
    echo "$object: that of the build"
    exit 0
  fi
fi
exec "$@"
