#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds the library as a static one, installs it into build/static, and builds and runs examples/consumer
# with it. The test install.consumer does that with the shared library.
#
#   bash scripts/static_consumer.sh
set -euo pipefail
cd "$(dirname "$0")/.."

options=(-G Ninja -DCMAKE_BUILD_TYPE=Release)
launcher=()
if command -v ccache >/dev/null; then
  launcher+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi
cmake -S . -B build/static "${options[@]}" "${launcher[@]}" -DBUILD_SHARED_LIBS=OFF \
  -DBUNDLE_ICP_BUILD_TESTS=OFF -DBUNDLE_ICP_BUILD_EXAMPLES=OFF
cmake --build build/static --parallel "$(nproc)"
cmake --install build/static --prefix build/static/installed
cmake -S examples/consumer -B build/static/consumer "${options[@]}" \
  -DCMAKE_PREFIX_PATH="$PWD/build/static/installed"
cmake --build build/static/consumer
build/static/consumer/consumer
