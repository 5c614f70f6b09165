#!/bin/sh
# usage: other_machines.sh TREE BUILD CMAKE
# The same scenes give the same bytes on x86-64 with AVX2 (where this machine has it), on x86-64 without, and on arm64
# (g++-aarch64-linux-gnu and qemu-user-static; left out, and said so, where they are missing).
set -eu
tree=$1 work=$2/tests/install/machines cmake=$3

# Builds with further arguments of cmake and prints what the program, run by RUNNER, prints. Optimised less than this
# machine's libraries are: that changes no byte either.
printed() {
  name=$1 runner=$2
  shift 2
  "$cmake" -S "$tree/tests/install/machines" -B "$work/$name" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=0 "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG" "-DSHAKEBED_TREE=$tree" \
    "$@" >"$work/$name.log" 2>&1 || { cat "$work/$name.log" >&2; return 1; }
  "$cmake" --build "$work/$name" --target machine_bytes >"$work/$name.log" 2>&1 || { cat "$work/$name.log" >&2; return 1; }
  # shellcheck disable=SC2086
  $runner "$work/$name/machine_bytes" >"$work/$name.txt"
}

mkdir -p "$work"
# This machine's are those of the libraries of the build.
c++ -std=c++20 -O2 -ffp-contract=off "-I$2/include" "$tree/tests/install/machines/machine_bytes.cpp" "$2/sim/libshakebed_sim.a" \
  "$2/statistics/libshakebed_statistics.a" -o "$work/machine_bytes"
"$work/machine_bytes" >"$work/native.txt"
cat "$work/native.txt"
if [ "$(uname -m)" = x86_64 ]; then
  printed baseline "" -DSHAKEBED_ARCH=
  cmp "$work/native.txt" "$work/baseline.txt"
  echo "x86-64 without AVX2: the same bytes"
fi
if command -v aarch64-linux-gnu-g++ >/dev/null && command -v qemu-aarch64-static >/dev/null; then
  printed arm64 "qemu-aarch64-static -L /usr/aarch64-linux-gnu" -DCMAKE_SYSTEM_NAME=Linux \
    -DCMAKE_SYSTEM_PROCESSOR=aarch64 -DCMAKE_CXX_COMPILER=aarch64-linux-gnu-g++
  cmp "$work/native.txt" "$work/arm64.txt"
  echo "arm64: the same bytes"
else
  echo "arm64 was left out: aarch64-linux-gnu-g++ or qemu-aarch64-static is missing"
fi
