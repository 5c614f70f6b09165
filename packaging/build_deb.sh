#!/bin/sh
# Makes shakebed, libshakebed-dev and python3-shakebed for Debian: build/deb/*.deb. The code runs on every x86-64 (no
# AVX2). Needs packages.txt and dpkg-dev.
set -eu
cd "$(dirname "$0")/.."
cmake -S . -B build/deb -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX=/usr -DSHAKEBED_ARCH= \
  -DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=8 -DSHAKEBED_TESTS=OFF -DSHAKEBED_BENCH=OFF \
  -DSHAKEBED_PYTHON=ON \
  -DSHAKEBED_PYTHON_DIRECTORY=lib/python3/dist-packages "$@"
cmake --build build/deb
cd build/deb
cpack -G DEB
ls -l ./*.deb
