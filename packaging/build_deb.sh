#!/bin/sh
# Makes shakebed, libshakebed-dev and python3-shakebed for Debian: build/deb/*.deb. The code runs on every x86-64. The
# libraries are there twice: the loader takes those of glibc-hwcaps/x86-64-v3 where the processor has AVX2 and FMA. A
# simulation is five times as fast with them. Needs packages.txt and dpkg-dev.
set -eu
cd "$(dirname "$0")/.."
configure() {  # FOLDER OPTION ...
  folder=$1
  shift
  cmake -S . -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX=/usr -DSHAKEBED_SHARED=ON \
    -DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=8 -DSHAKEBED_TESTS=OFF -DSHAKEBED_BENCH=OFF "$@"
}
fast=
if [ "$(dpkg --print-architecture)" = amd64 ]; then
  fast=build/deb-x86-64-v3
  configure "$fast" -DSHAKEBED_ARCH=x86-64-v3 -DSHAKEBED_PYTHON=OFF "$@"
  cmake --build "$fast" --target shakebed_statistics shakebed_sim shakebed_ingest shakebed_fit
  fast=$(realpath "$fast")
fi
configure build/deb -DSHAKEBED_ARCH= -DSHAKEBED_PYTHON=ON -DSHAKEBED_PYTHON_DIRECTORY=lib/python3/dist-packages \
  -DSHAKEBED_FAST_BUILD="$fast" "$@"
cmake --build build/deb
cd build/deb
cpack -G DEB
ls -l ./*.deb
